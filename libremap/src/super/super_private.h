/* super_private -- what the files of the room hand to each other, in the order of the work:
 *
 *   soup.c    what this rank has made, not yet numbered: vertices by what they are made of, faces, cells
 *   regular.c whether cells can pass as they were given
 *   pass.c    cells that meet nothing of the other mesh, and the faces they share with cells that do
 *   order.c   what this rank has, in the order of its keys
 *   number.c  numbers of equal keys over all ranks
 *   nodes.c   the soup's vertices become nodes
 *   finish.c  its faces and cells numbered and put in order
 *   beyond.c  cells of other ranks behind faces
 *   super.c   all of it
 *   contacts.c  zones of a mesh that touch where faces do not match
 *   conform.c   such a mesh made conformal
 *   fetch.c     what belongs to cells and faces of other ranks */
#ifndef RM_SUPER_PRIVATE_H
#define RM_SUPER_PRIVATE_H

#include "super/super.h"

/* How many corners make a vertex at most: an edge and a triangle. */
enum { RM_SOUP_CORNERS = 5 };

/* A vertex by what it is made of: corners, which are vertices of the two triangulated meshes, less than 2^30 of them. */
typedef struct rm_made_of {
  uint32_t first;
  uint32_t kind : 2;    /* 0 a corner; 1, 2 an edge of mesh 1, 2 with a triangle of the other; 3 an edge of each */
  uint32_t second : 30; /* corner + 1; 0 if there are no more; the others likewise                              */
  uint32_t more[RM_SOUP_CORNERS - 2];
} rm_made_of;

/* A face as it is added. */
typedef struct rm_soup_face {
  rm_lid cell[2]; /* of the soup; its normal points out of cell[0]; cell[1] is negative if it is not here */
  rm_lid from[2]; /* [side] the caller's face, -1 */
  int    from_rank[2];
} rm_soup_face;

/* A cell as it is added. */
typedef struct rm_soup_cell {
  rm_gid ancestor[2]; /* [side] -1 */
  rm_lid home[2];
  int    rank[2];
  double volume;
} rm_soup_cell;

/* Arrays are malloc'ed, each by itself, so that whoever uses one up frees it and makes it NULL; rm_soup_free. Vertices, and
 * faces, of equal coordinates may be there twice. One rank alone has no arrays of ranks. */
typedef struct rm_soup {
  bool        has_ranks;
  int64_t     num_corners, num_vertices, num_faces, num_cells, num_loop;
  int64_t     num_made; /* vertices that room cells made, which come first: distinct ones */
  int64_t     corner_room, vertex_room, face_room, loop_room, cell_room;
  double    (*corner)[3];
  double    (*xyz)[3];      /* [num_vertices]                                              */
  rm_made_of *made_of;      /* [num_vertices]                                              */
  uint32_t   *first;        /* [num_faces + 1] places in loop                              */
  rm_lid    (*face_cell)[2];
  rm_lid     *from[2];      /* [side][num_faces]                                           */
  int        *from_rank[2]; /* [side][num_faces]                                           */
  rm_lid     *loop;         /* [num_loop] vertices                                         */
  rm_gid     *ancestor[2];  /* [side][num_cells]                                           */
  rm_lid     *home[2];      /* [side][num_cells]                                           */
  int        *rank[2];      /* [side][num_cells]                                           */
  double     *volume;       /* [num_cells]                                                 */
} rm_soup;

/* Give all of it back. Not collective, nor are the others. */
void rm_soup_free(rm_soup *soup);

/* Room for so much more, and no more than that. NO_MEMORY. */
remap_status rm_soup_reserve(rm_soup *soup, int64_t vertices, int64_t faces, int64_t loop, int64_t cells);

/* Add a corner of a given cell, and the vertex that it is: *vertex is its number. NO_MEMORY, TOO_LARGE. */
remap_status rm_soup_add_corner(rm_soup *soup, const double xyz[3], rm_lid *vertex);

/* Add a vertex to the loop of the face that is being made. NO_MEMORY, TOO_LARGE. */
remap_status rm_soup_add_to_loop(rm_soup *soup, rm_lid vertex);

/* Add the face whose loop is what rm_soup_add_to_loop added since the last one. NO_MEMORY, TOO_LARGE. */
remap_status rm_soup_end_face(rm_soup *soup, const rm_soup_face *face);

/* Add a cell; faces name it by its number, soup->num_cells before. NO_MEMORY, TOO_LARGE. */
remap_status rm_soup_add_cell(rm_soup *soup, const rm_soup_cell *cell);

/* The rank of entity k, whose number there is from[k], by an array of the soup; -1 if it is none. */
static inline int rm_soup_rank(const int *rank, const rm_lid *from, int64_t k) { return rank ? rank[k] : from[k] < 0 ? -1 : 0; }

/* Begin with what room cells made: vertex k, face k, cell k of it are those of the soup, which takes its vertices, loops and
 * cells of faces from arena; what its vertices are is given back. NO_MEMORY, TOO_LARGE. */
remap_status rm_soup_add_cells(rm_soup *soup, rm_arena *arena, const rm_part *part, const rm_trimesh *const mesh[2],
                               const rm_cells *cells);

/* True if cells of mesh `side` that meet nothing are part of the result, as they were given. */
static inline bool rm_super_passes(const rm_super_job *job, int side)
{
  return job->options->pass_through && (job->options->keep & (side ? REMAP_IN_TARGET : REMAP_IN_SOURCE));
}

/* *regular is false if what was made does not fit cells that pass, which then have to be made too. given: the meshes as they
 * were triangulated; mesh: as they were overlaid. Not collective. */
remap_status rm_super_is_regular(const rm_super_job *job, const rm_cover *cover, const rm_trimesh *const given[2],
                                 const rm_trimesh *const mesh[2], bool *regular);

/* Add the cells of this rank that meet nothing, of the meshes that keep names; send the faces between them and others, which
 * are behind faces of `cells`, home, and add those that come. Collective. */
remap_status rm_super_pass(const rm_super_job *job, const rm_cover *cover, const rm_trimesh *const mesh[2],
                           const rm_cells *cells, rm_soup *soup);

/* Keys of items as words, which dwindle as they are compared one after the other. */
typedef struct rm_words {
  uint32_t  (*word)(const void *user, int64_t item, int k); /* word k of the item's key */
  const void *user;
  int         num;
  int64_t     end; /* word 0 is below it */
} rm_words;
/* order[n]: the items in the order of their keys, + RM_SAME where the key is the one before; of equal ones the first comes
 * first. Not collective. NO_MEMORY. O(n + end) for keys that differ in their first words, else O(n log n); 8 bytes an item. */
#define RM_SAME UINT32_C(0x80000000)
remap_status rm_super_order(const rm_words *words, int64_t n, uint32_t *order);

/* place[n] of n keys of `words` words each, key[n][words], among the *num distinct ones in their lexicographical order. Not
 * collective. Lives in passing. O(n) mostly. */
remap_status rm_super_rank(rm_arena *passing, int64_t n, int words, const uint64_t *key, int64_t *place, int64_t *num);

/* Number n keys of `words` words each, key[n][words], which ascend on each rank, over all ranks: equal keys get one number,
 * from 0 without gaps, in their order. range: the first words are 0 .. range - 1, about as many of each; or 0: they are
 * anything. number is [n]. Collective, for more than one rank. Working memory from passing. O(n). */
remap_status rm_super_number(rm_arena *passing, const rm_comm *comm, int64_t n, int words, const uint64_t *key, int64_t range,
                             int64_t *number, int64_t *total);

/* Where a cell or face comes from. */
typedef struct rm_origin {
  rm_gid global; /* of a cell      */
  rm_lid home;   /* number there   */
  int    rank;   /* -1: from none  */
} rm_origin;

/* A mesh made of another one. */
typedef struct rm_conformed {
  const rm_mesh   *mesh;
  const rm_origin *cell; /* [mesh->num_cells]     */
  const rm_origin *face; /* [faces as it was given them] */
  double           overlap; /* volume that two zones of the other one hold, over all ranks */
} rm_conformed;

/* The zone of a cell. */
static inline int64_t rm_zone_of(const rm_zones *zones, rm_gid cell)
{
  return rm_interval_of(zones->num, zones->cell_offset, cell);
}

/* Colours of the zones of one mesh, [zones], from 0; different where zones touch and faces do not match. Collective. */
remap_status rm_super_colour_zones(const rm_super_job *job, int side, int64_t *colour, int *num_colours, rm_reason *reason);

/* The least two cells of one zone, or of a mesh without zones, whose faces in the skin touch or cross and do not match; -1:
 * none. Collective. */
remap_status rm_super_find_contact(const rm_super_job *job, int side, rm_gid cell[2], rm_reason *reason);

/* One mesh made conformal; out->mesh is NULL if it is. *arena, where it lives, may become another. Collective. ZONE_OVERLAP
 * where zones overlap by more than rounding, BAD_MESH where they cannot be joined. */
remap_status rm_super_conform(rm_arena **arena, const rm_super_job *job, int side, rm_conformed *out, rm_reason *reason);
/* The cell of a reason as one of the mesh that was made conformal. Collective. */
void rm_super_trace_reason(const rm_comm *comm, const rm_conformed *mesh, rm_reason *reason);
/* Ancestors in the mesh that was made conformal. Collective. */
remap_status rm_super_retrace(rm_arena *arena, const rm_comm *comm, int side, const rm_conformed *from, rm_super *super);

/* The supermesh of meshes whose cells do not overlap and whose faces match. Collective. As rm_super_build. */
remap_status rm_super_make(rm_arena *arena, const rm_super_job *job, rm_super **out, rm_reason *reason);

/* What becomes of the soup. */
typedef struct rm_finish {
  rm_arena            *arena; /* of the result */
  const rm_super_job  *job;
  rm_soup             *soup;
  rm_reason           *reason;
  remap_supermesh_view v;
} rm_finish;

/* How a refusal names a cell: twice the number of its ancestor, and the side that has it. */
static inline int64_t rm_cell_name(const int64_t *const ancestor[2], int64_t c)
{
  return ancestor[0][c] >= 0 ? 2 * ancestor[0][c] : 2 * ancestor[1][c] + 1;
}
/* BAD_MESH: cells of one mesh lie on each other, one of that name. Not collective. */
remap_status rm_super_tangled(const rm_finish *w, int64_t name);

/* The soup's vertices become the nodes of the result, by the order of their corners, whose order is that of their Morton keys;
 * loops become loops of nodes, from the least one on. The soup has no vertices any more. Collective. BAD_MESH if vertices that
 * are not the same lie in one place. */
remap_status rm_super_nodes(rm_finish *w);

/* The cells of other ranks behind faces. Collective. BAD_MESH if more than two cells have a face. */
remap_status rm_super_beyond(rm_finish *w);

/* Number the soup and put it in order. Collective. *out lives in arena. The soup is used up. BAD_MESH if vertices of it that
 * are not the same lie in one place, or more than two faces. */
remap_status rm_super_finish(rm_arena *arena, const rm_super_job *job, rm_soup *soup, rm_super *out, rm_reason *reason);

#endif
