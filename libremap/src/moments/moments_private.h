/* moments_private -- the sums of one source cell's pairs, shared by the files of the room. */
#ifndef RM_MOMENTS_PRIVATE_H
#define RM_MOMENTS_PRIVATE_H

#include "geom/expansion.h"
#include "geom/residue.h"
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
  IN_DOUBT    = 64, /* its sum is within its noise           */
  APART       = 128 /* its cells' boxes share no volume      */
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
  int           mesh;     /* of the edge                             */
  rm_lid        edge;     /* -1 for a vertex                         */
  rm_lid        triangle; /* of the other mesh, crossed by the edge  */
  int64_t       crossing; /* its place in the trace                  */
} point;

/* The plane a polygon lies in. */
typedef struct plane {
  int           mesh;
  rm_lid        triangle;
  const double *n, *v; /* normal, a vertex */
} plane;

/* A facet of cell i. */
typedef struct own_facet {
  plane  in;
  double outward; /* 1, or -1 if n points into the cell                                             */
  double height;  /* foot = height n                                                                */
  double foot[3]; /* of the perpendicular from the origin of cell i on the plane, relative to it */
  int    first_segment, last_segment; /* of those in it, in work.segment; past the end */
} own_facet;

/* An edge of a cell and two of its facets there: seen from outside, the boundary of the first runs along it, that of the
 * second against it. */
typedef struct wedge {
  rm_lid edge;
  int    facet[2]; /* in work.own, -1 */
} wedge;

/* A segment in a facet of cell i. */
typedef struct segment {
  int cut, from, to; /* in work.cut, work.spot */
} segment;

/* What a facet of mesh 2 has in common with cell i: a polygon of the pairs on both sides of it. */
typedef struct cut {
  int32_t num_cones;
  int     kinds;
  int     slot[2];  /* of the pairs with the cells left and right of it, -1 */
  int     plain[2]; /* those among them that are summed about the origin of cell i, -1 */
  bool    any_plain, any_local;
  double  n[3];
  double  sum[10]; /* of its sides, see sums.c */
} cut;

/* Finds the items of one cell by their keys; its memory stays in the cache. */
typedef struct table {
  int32_t *item; /* [mask + 1] -1 */
  int64_t  room;
  uint32_t mask;
  int      shift;
} table;

/* Where simulation of simplicity leaves a point: in a vertex of one of the meshes, where an edge of one crosses an edge of the
 * other, or where an edge crosses a facet. The edges are known once the locus is settled; a vertex may lie on more. */
typedef struct locus {
  const double *vertex;   /* its coordinates if it is one, else NULL                */
  int           mesh;     /* of the edge                                            */
  int64_t       crossing; /* its place in the trace, -1 for a vertex                */
  rm_lid        edge[2];  /* [mesh] an edge on which it lies, -1 where none is known */
} locus;

/* A side of a polygon, going round it. */
typedef struct polygon_side {
  int           next;  /* of the same polygon, -1 */
  int           times; /* it counts so often      */
  locus         from, to;
  const double *in_plane; /* a point of the polygon's plane */
} polygon_side;

/* One polygon of a pair, for the decision whether the pair has volume. */
typedef struct polygon {
  int     next; /* of the same pair, -1 */
  int     chain; /* next of the same bucket, -1 */
  rm_lid  target; /* of the pair */
  int     mesh;
  rm_lid  triangle;
  int32_t num_cones;
  int     first_side; /* in work.side, -1 */
  bool    is_settled; /* its sides are those in the limit, where they come to something */
  double  area; /* twice, times the normal's magnitude, outward or not as the cones' signs say */
  double  first[3]; /* one of its vertices, relative to the pair's origin */
  double  reach;    /* largest distance of the others from it, by any one coordinate */
} polygon;

/* A side of what two coplanar triangles have in common: along an edge p -> q of one of them, from where it meets the line
 * through from[0] and from[1], which are NULL if that is p, to where it meets the line through to[0] and to[1], NULL for q. */
typedef struct strip {
  const double *p, *q, *from[2], *to[2];
} strip;

/* Sums that may be exactly zero (rational.c). */
typedef struct exact_sum {
  const int   *side; /* [num_sides] in work.side */
  int64_t      num_sides;
  const strip *strip; /* [num_strips] counted strip_sign times; an area's only */
  int64_t      num_strips;
  int          strip_sign;
  int          axis;   /* twice the area that the sides bound, seen along this axis; -1: six times the volume */
  const double *origin; /* of the cones */
} exact_sum;

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
  own_facet        *own;          /* [num_own] facets of cell i */
  wedge            *wedge;        /* [num_wedges] at the edges of cell i   */
  int              *wedge_of;     /* [edges of mesh 1] -1 between cells    */
  int64_t           own_room, wedge_room;
  int               num_own, num_wedges;
  table             spots, cuts;  /* by spot_key and cut_key */
  double          (*spot)[3];     /* [num_spots] crossings at cell i, relative to its origin */
  uint32_t         *spot_key;     /* [num_spots] 2 * crossing + side */
  cut              *cut;          /* [num_cuts] */
  uint32_t         *cut_key;      /* [num_cuts] the facet */
  segment          *segment;      /* [num_segments] */
  int64_t           spot_room, spot_key_room, cut_room, cut_key_room, segment_room;
  int               num_spots, num_cuts, num_segments;
  int              *slot_of;      /* [cells of mesh 2] -1 */
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
  polygon_side     *side;
  int64_t           side_room;
  int               num_sides;
  int              *plane, *left; /* polygons by plane; sides that are left of them */
  rm_keyed         *key, *spare;
  strip            *strip;
  rm_modulus       *modulus; /* [num_moduli] descending primes */
  int64_t           plane_room, left_room, key_room, spare_room, strip_room, modulus_room, num_moduli;
  double          (*triangle_box[2])[6]; /* [side][triangles] of the meshes that have a tree     */
  const rm_boxtree *tree[2];             /* [side] over a mesh's triangles, NULL: not yet needed */
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
  int64_t           num_pairs, room[7]; /* rooms are equal, as far as the arrays are there */
} work;

/* What is done with a side p -> q of a polygon in plane pl, within cell i and on the border of cells j[0] and j[1] of mesh 2
 * (or in one of them, the other being RM_OUTSIDE): its cone counts sign times for the first, -sign times for the second. If
 * `other` is not NULL the side is one of a polygon there as well, and that cone counts the other way. */
typedef void sink(work *w, const rm_lid j[2], double sign, const plane *pl, const plane *other, const point *p, const point *q);

/* A point relative to an origin. */
INLINE void relative(const point *p, const double o[3], double out[3])
{
  for (int c = 0; c < 3; c++) out[c] = (p->base[c] - o[c]) + p->delta[c];
}

/* The foot of the perpendicular from o on the plane with normal n through v, relative to o; returns h with foot = h n, 0 for a
 * triangle without area. */
INLINE double rm_moments_foot(const double n[3], const double v[3], const double o[3], double foot[3])
{
  const double square = n[0] * n[0] + n[1] * n[1] + n[2] * n[2];
  const double along  = n[0] * (v[0] - o[0]) + n[1] * (v[1] - o[1]) + n[2] * (v[2] - o[2]);
  const double height = square > 0 ? along / square : 0;

  for (int c = 0; c < 3; c++) foot[c] = n[c] * height;
  return height;
}

INLINE rm_lid piece_state(const rm_trace *tr, rm_lid e, rm_lid k)
{
  return k == 0 ? tr->state[e] : tr->crossing[tr->first[e] + k - 1].state;
}

/* How often a cell winds about piece k of an edge. */
INLINE int piece_number(const rm_trace *tr, rm_lid e, rm_lid k, rm_lid cell)
{
  const rm_lid state = piece_state(tr, e, k);

  if (state >= RM_OUTSIDE) return state == cell;
  for (rm_lid z = tr->list_offset[-2 - state]; z < tr->list_offset[-1 - state]; z++)
    if (tr->winding[z].cell == cell) return tr->winding[z].number;
  return 0;
}

/* Pieces of an edge about which a cell winds equally often count as one: what cuts them are other cells that overlap this one,
 * and another rank need not have those. The number of the first piece behind those that begin with piece k; k if they began
 * before. */
INLINE rm_lid run_end(const rm_trace *tr, rm_lid e, rm_lid k, rm_lid cell, int number)
{
  if (k > 0 && piece_number(tr, e, k - 1, cell) == number) return k;
  do k++;
  while (k <= tr->count[e] && piece_number(tr, e, k, cell) == number);
  return k;
}

/* The planes of cell i's facets, and its edges with the two facets at each: once for all that is summed of the cell. */
remap_status rm_moments_open(work *w, rm_lid i);

/* File the pieces of edges of mesh 2 under the cells of mesh 1. */
remap_status rm_moments_file_pieces(work *w);

/* Crossing of that number of an edge of `mesh`. */
void rm_moments_set_crossing(const work *w, int mesh, int64_t crossing, point *p);
/* Point k of an edge of `mesh`, where its piece k begins and its piece k - 1 ends. */
void rm_moments_set_point(const work *w, int mesh, rm_lid e, rm_lid k, point *p);

/* Hand on every side of every polygon in the open cell i. */
void rm_moments_all_sides(work *w, rm_lid i, sink *add_side);

/* Make ready for sums: once. */
remap_status rm_moments_ready_sums(work *w);
/* Slots for all pairs of the open cell i, and their sums in doubles. */
remap_status rm_moments_sum(work *w, rm_lid i);
/* Sum the slots marked AGAIN in double-double. */
remap_status rm_moments_sum_again(work *w, rm_lid i);

/* Forget the polygons of the last source cell. */
remap_status rm_moments_no_polygons(work *w);

/* A sink that collects the polygons of pairs that want them. */
sink rm_moments_add_polygon;

/* Forward error of 6 V as it was summed in doubles. */
double rm_moments_noise(const work *w, rm_lid i, const slot *s);

/* The polygon has area beyond rounding: its points err by 4 extents, in units of u, however small it is itself. */
bool rm_moments_has_area(const work *w, rm_lid i, const slot *s, const polygon *g);

/* Triangles of the meshes lie in one plane exactly; a triangle without area lies in every plane. */
bool rm_moments_coplanar(const work *w, int mesh_a, rm_lid a, int mesh_b, rm_lid b);

/* Exact sign of the component of a triangle's normal along an axis. */
int rm_moments_normal_sign(const rm_trimesh *m, rm_lid t, int axis);
/* An axis along which it is not 0, mostly the longest component's; -1: the triangle has no area. */
int rm_moments_axis(const rm_trimesh *m, rm_lid t);

/* Put a polygon's sides where they are in the limit, and leave out those that come to nothing there. */
void rm_moments_settle(work *w, polygon *g);

/* True if the exact volume of the pair, whose sum is within its noise, is not zero (DESIGN 2.6). Needs its polygons.
 * w->status tells if memory ran out, as below. */
bool rm_moments_has_volume(work *w, const slot *s);

/* True if the skin of a mesh passes through the pair's cell of the other mesh. is_flat: the pair has no volume, and a skin
 * that lies in the other cell's face, to whichever side, does not pass through it. Needs its polygons. */
bool rm_moments_skin_passes(work *w, rm_lid i, const slot *s, int mesh, bool is_flat);

/* Prime number k, found when first needed; NULL if memory ran out. */
const rm_modulus *rm_moments_modulus(work *w, int64_t k);

/* True if the sum is zero exactly. O(terms), hardly ever more, if it is not; that times its length in words if it is. */
bool rm_moments_is_zero(work *w, const exact_sum *sum);

/* Give back what decisions needed. */
void rm_moments_decided(work *w);

#endif
