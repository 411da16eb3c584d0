/* moments_private -- the sums of one source cell's pairs, shared by the files of the room. */
#ifndef RM_MOMENTS_PRIVATE_H
#define RM_MOMENTS_PRIVATE_H

#include "geom/expansion.h"
#include "moments/moments.h"

#if defined(__GNUC__)
#define INLINE static inline __attribute__((always_inline))
#else
#define INLINE static inline
#endif

enum {
  FROM_SOURCE = 1, /* the pair has pieces of edges of mesh 1 */
  FROM_TARGET = 2, /* of mesh 2                              */
  FROM_BOTH   = 4, /* it has segments                        */
  SKIN_SOURCE = 8, /* one of its polygons lies in the skin of mesh 1 */
  SKIN_TARGET = 16,
  AGAIN       = 32, /* to be summed again in double-double   */
  IN_DOUBT    = 64  /* its sum is within its noise           */
};

enum { NO_POLYGONS = -1, WANTS_POLYGONS = -2 };

/* Sums of one pair: 6 V, 24 M, 120 S about o. */
typedef struct slot {
  rm_lid  target;
  int32_t num_cones;
  int     kinds;
  int     first_polygon; /* of the pair in work.polygon, NO_POLYGONS if they are not wanted */
  int     last_polygon;  /* in a triangle of mesh 1, the latest; -1                         */
  bool    is_local;      /* o is the pair's own, not that of cell i */
  double  o[3];
  double  reach; /* the pair's points are within half of it of o, along each axis */
  double  sum[10];
} slot;

/* A side of a polygon ends in a vertex or in a crossing of an edge. */
typedef struct point {
  const double *base;     /* the edge's first vertex, or the vertex  */
  double        delta[3]; /* from there; 0 for a vertex              */
  double        at[3];    /* relative to the origin of cell i        */
  int           mesh;     /* of the edge                             */
  rm_lid        edge;     /* -1 for a vertex                         */
  rm_lid        triangle; /* of the other mesh, crossed by the edge  */
  int64_t       crossing; /* its place in the trace                  */
} point;

/* The plane a polygon lies in. */
typedef struct plane {
  int           mesh;
  rm_lid        triangle;
  const double *n, *v;   /* normal, a vertex */
  double        inverse; /* 1 / n.n, 0 for a triangle without area */
  double        foot[3]; /* of the perpendicular from the origin of cell i, relative to it */
  double        height;  /* foot = height n */
} plane;

/* One polygon of a pair, for the decision whether the pair has volume. */
typedef struct polygon {
  int     next; /* of the same pair, -1 */
  int     chain; /* next of the same bucket, -1 */
  rm_lid  target; /* of the pair */
  int     mesh;
  rm_lid  triangle;
  int32_t num_cones;
  int     first_corner; /* in work.corner, -1 */
  double  area; /* twice, times the normal's magnitude, outward or not as the cones' signs say */
  double  first[3]; /* one of its vertices, relative to the pair's origin */
  double  reach;    /* largest distance of the others from it, by any one coordinate */
} polygon;

/* A vertex of a polygon, for the decision whether it has area: the start of a side, followed by the side's end. */
typedef struct corner {
  int           next;     /* start of another side of the same polygon, -1 */
  int           mesh;     /* as in point             */
  rm_lid        edge, triangle;
  int64_t       crossing;
  const double *vertex;   /* its coordinates if it is a vertex, else NULL */
} corner;

/* A crossing in double-double, relative to its edge's first vertex. */
typedef struct memo {
  int    mesh;
  rm_lid edge, triangle;
  rm_dd  delta[3];
} memo;

enum { NUM_MEMOS = 256 };

typedef struct work {
  const rm_part    *part;
  const rm_overlay *o;
  rm_arena         *scratch;
  int               num_sums; /* 4 or 10 */
  int64_t          *piece_offset; /* [cells of mesh 1 + 1] pieces of edges of mesh 2 in them */
  rm_lid          (*piece)[2];    /* edge, number of the piece on it */
  rm_lid           *slot_of;      /* [cells of mesh 2] -1 */
  slot             *slots;
  int64_t           slots_room;
  int               num_slots;
  double            centre[3]; /* origin of cell i: the centre of its box */
  double            extent;    /* largest extent of that box              */
  polygon          *polygon;
  int64_t           polygon_room;
  int               num_polygons;
  int              *bucket; /* [num_buckets] first polygon of each hash value, -1 */
  int64_t           bucket_room;
  int               num_buckets;
  corner           *corner;
  int64_t           corner_room;
  int               num_corners;
  rm_dd           (*exact)[10]; /* [num_slots] sums of those marked AGAIN */
  int64_t           exact_room;
  memo             *memo; /* [NUM_MEMOS] */
  uint8_t          *limit[2];  /* [num_crossings] where a crossing is in the limit, 0 until it is asked for; NULL likewise */
  bool              skin_only; /* sides in triangles of a skin are all that is wanted                                     */
  remap_status      status;
  /* the result */
  rm_lid           *source, *target;
  double           *volume, (*moment)[3], (*second)[6], (*second_back)[6];
  uint8_t          *flags;
  int64_t           num_pairs, room[7];
} work;

/* What is done with a side p -> q of a polygon in plane pl, within cell i and on the border of cells j[0] and j[1] of mesh 2 (or in
 * one of them, the other being RM_OUTSIDE): its cone counts sign times for the first, -sign times for the second. */
typedef void sink(work *w, rm_lid i, const rm_lid j[2], int kind, double sign, const plane *pl, const point *p, const point *q);

/* A point relative to an origin. */
INLINE void relative(const point *p, const double o[3], double out[3])
{
  for (int c = 0; c < 3; c++) out[c] = (p->base[c] - o[c]) + p->delta[c];
}

/* Forget the polygons of the last source cell. */
remap_status rm_moments_no_polygons(work *w);

/* A sink that collects the polygons of pairs that want them. */
sink rm_moments_add_polygon;

/* Forward error of 6 V as it was summed in doubles. */
double rm_moments_noise(const work *w, rm_lid i, const slot *s);

/* True if the exact volume of the pair, whose sum is within its noise, is not zero (DESIGN 2.6). Needs its polygons. */
bool rm_moments_has_volume(const work *w, rm_lid i, const slot *s);

/* True if the skin of a mesh passes through the pair's cell of the other mesh. is_flat: the pair has no volume, and a skin that lies in the
 * other cell's face, to whichever side, does not pass through it. Needs its polygons. */
bool rm_moments_skin_passes(const work *w, rm_lid i, const slot *s, int mesh, bool is_flat);

#endif
