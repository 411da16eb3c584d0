/* part -- the zone in; out the cells of both meshes that this rank overlays. The Morton curve through the zone is cut into one
 * interval per rank, of even estimated work; the interval that holds the centre of a cell's box is the cell's seat. A target
 * cell goes to its seat, a source cell to every rank that has a target cell whose box it meets.
 *
 * A cell that meets a large part of the other mesh (a closed surface, a huge background cell) is a giant: it is replicated to
 * the seats of the cells it meets, and its pairs are made there. So every pair of cells is made on exactly one rank, and no
 * rank gets all cells of a mesh because of one cell of the other.
 *
 * A rank overlays its interval in blocks, one after the other and without asking others, so that the memory of an overlay need
 * not grow with what a rank has: a block is to a rank's interval what that is to the whole, and pairs do not depend on where
 * they are made. What comes from other ranks comes once, and waits in the rank's stock. */
#ifndef RM_PART_H
#define RM_PART_H

#include "zone/zone.h"

/* What a cell is on the rank that overlays it, bits. */
enum {
  RM_ROLE_SEATED = 1, /* this rank is its seat                          */
  RM_ROLE_GIANT  = 2  /* it may be on other ranks too, though it be a target */
};

/* The cells of one mesh on the rank that overlays them. Read-only once built. Invariants:
 *   every cell's faces are all here; a face between two cells of this piece that came from one rank is listed once;
 *   nodes of different senders may repeat coordinates. */
typedef struct rm_piece {
  rm_lid          num_nodes, num_faces, num_cells;
  const double  (*node_xyz)[3];      /* [num_nodes]                                                         */
  const int64_t  *face_offset;       /* [num_faces + 1]                                                     */
  const rm_lid   *face_node;         /* [face_offset[num_faces]]                                            */
  const rm_lid  (*face_cell)[2];     /* [num_faces] owner, neighbour or -1; a kept face's missing owner: the
                                        loop is turned so that face_cell[f][0] >= 0 always                 */
  const uint8_t  *face_is_skin;      /* [num_faces] of the whole mesh, as in rm_mesh                        */
  const rm_lid   *face_home;         /* [num_faces] the caller's number, on the home rank of its cells      */
  const rm_gid   *cell_global;       /* [num_cells]                                                         */
  const int      *cell_home_rank;    /* [num_cells] whose part of the mesh it belongs to                    */
  const rm_lid   *cell_home;         /* [num_cells] its number there                                        */
  const double   *cell_volume;       /* [num_cells] as in rm_mesh                                           */
  const double  (*cell_centroid)[3]; /* [num_cells]                                                         */
  const uint8_t  *cell_role;         /* [num_cells] RM_ROLE_; NULL: no giants                               */
} rm_piece;

typedef struct rm_part {
  rm_piece piece[2]; /* [side] */
} rm_part;

/* Whether the pair of two cells of the pieces is made on this rank: with a small target at its seat, where it is alone; else at
 * the seat of the source, or of the target if both are giants. Not collective. */
static inline bool rm_part_makes_pair(const rm_part *part, rm_lid source, rm_lid target)
{
  const uint8_t *of_source = part->piece[0].cell_role, *of_target = part->piece[1].cell_role;

  if (!of_target || !(of_target[target] & RM_ROLE_GIANT)) return true;
  return ((of_source[source] & RM_ROLE_GIANT ? of_target[target] : of_source[source]) & RM_ROLE_SEATED) != 0;
}

/* How a rank's interval is cut into blocks. */
typedef struct rm_slicing {
  int64_t triangles; /* that the cells seated in a block have, about, at most; a face between two cells counts half   */
  double  repeats;   /* triangles of sources that come to a block once more, at most, over those of all cells seated
                        on the rank: fewer blocks are cut where there would be more                                   */
  int64_t blocks;    /* that a rank has at least                                                                      */
  int64_t few;       /* triangles: no smaller blocks are cut for that                                                 */
} rm_slicing;
extern const rm_slicing rm_one_block;

/* Which cells go where, and which block of a rank needs which, as what. Opaque; read-only once made. */
typedef struct rm_routes rm_routes;

/* The cells of one mesh from which a rank takes those of its blocks: its own and what came. Opaque. */
typedef struct rm_stock rm_stock;

/* Choose where the cells of the zone go. Collective. Lives in arena. TOO_LARGE as below. */
remap_status rm_part_plan(rm_arena *arena, const rm_comm *comm, const rm_frame *frame, const rm_mesh *const mesh[2],
                          const rm_zone *zone, const rm_slicing *slicing, const rm_routes **out, rm_reason *reason);

/* How many blocks this rank has, at least 1. Not collective: others may have more or fewer. */
int rm_part_blocks(const rm_routes *routes);

/* Send the cells of one mesh to the ranks that need them, each once. Collective. The routes may have been made for the same
 * cells in another position. *out lives in arena and borrows mesh. TOO_LARGE if 2^31 or more entities come to a rank. */
remap_status rm_part_send(rm_arena *arena, const rm_comm *comm, const rm_mesh *mesh, const rm_routes *routes,
                          const rm_stock **out, rm_reason *reason);

/* The cells of a block. Not collective, and not twice at once from one stock. *out lives in arena, its roles with the routes.
 * Cells come in ascending order of the rank of their home, then of their number there: later rooms must not let results depend
 * on it. TOO_LARGE, NO_MEMORY. */
remap_status rm_part_take(rm_arena *arena, const rm_routes *routes, const rm_stock *stock, int block, rm_piece *out,
                          rm_reason *reason);

/* All of it, for both meshes, in one block. Collective. Lives in arena. */
remap_status rm_part_build(rm_arena *arena, const rm_comm *comm, const rm_frame *frame, const rm_mesh *const mesh[2],
                           const rm_zone *zone, const rm_part **out, rm_reason *reason);
/* Every invariant above; slow. Not collective. */
remap_status rm_part_check(const rm_part *part);

/* The part that a supermesh is made from. Each cell whose box meets the other mesh is core on exactly one rank, if it is asked
 * for; a rank has every cell of either mesh whose box meets that of one of its core cells, so what is made of these here is
 * what would be made of them anywhere. Read-only once built. */
typedef struct rm_cover {
  rm_part        part;
  int            owner;     /* side whose core cells make what lies in both meshes: that of more cells that meet the other */
  const uint8_t *flag[2];   /* [side][cells of the piece] RM_COVER_                                                       */
  const uint8_t *is_met[2]; /* [side][cells of this rank's mesh] its box meets that of a cell of the other mesh            */
} rm_cover;
enum { RM_COVER_CORE = 1, RM_COVER_MET = 2 };

/* keep: REMAP_IN_ bits, of what is made. all: cells of that side count as if each met the other mesh. Collective. Lives in
 * arena. TOO_LARGE as rm_part_build. */
remap_status rm_part_cover(rm_arena *arena, const rm_comm *comm, const rm_frame *frame, const rm_mesh *const mesh[2],
                           const rm_zone *zone, int keep, const bool all[2], const rm_cover **out, rm_reason *reason);

/* Cells of one mesh, brought together where the skin of one zone may enter a cell of another, both cells having boxes that meet
 * that of a cell of the other mesh: entered ones, each on one rank, at least those whose boxes meet that of a foreign face of
 * the skin; and there every entering one, behind such a face, whose box meets theirs. So every pair of which a face of the one
 * meets the box of the other is on exactly one rank, whatever their number. */
enum { RM_SKINS_ENTERED = 0, RM_SKINS_ENTERING = 1 };
typedef struct rm_skins {
  bool          any;      /* the same on every rank; false: nothing else is set       */
  rm_piece      piece[2]; /* [RM_SKINS_] a cell may be in both                         */
  const rm_lid *zone[2];  /* [RM_SKINS_][cells of the piece] */
} rm_skins;

/* zone: [cells of that side on this rank]. Collective. Lives in arena. TOO_LARGE as rm_part_build. */
remap_status rm_part_skins(rm_arena *arena, const rm_comm *comm, const rm_frame *frame, const rm_mesh *const mesh[2], int side,
                           const rm_lid *zone, rm_skins *out, rm_reason *reason);

#endif
