/* context -- what stands behind remap_context. The only room that sees every other; seen by none. */
#ifndef RM_CONTEXT_H
#define RM_CONTEXT_H

#include "field/field.h"
#include "overlay/overlay.h"
#include "super/super.h"

/* Names of one mesh, copied so that messages can use them after the caller's arrays are gone. */
typedef struct rm_labels {
  const char        *mesh; /* never NULL */
  int64_t            num_zones;
  const char *const *zone;             /* [num_zones]     */
  const int64_t     *zone_cell_offset; /* [num_zones + 1] */
} rm_labels;

/* Where the cells of both meshes are overlaid. */
typedef struct rm_place {
  rm_arena         *arena;          /* of routes and boxes                                               */
  rm_arena         *stock_arena[2]; /* [side] of the stock                                               */
  rm_arena         *piece_arena[2]; /* [side] of the piece                                               */
  rm_arena         *triangle_arena[2]; /* [side] of its triangles                                        */
  const rm_routes  *routes;         /* NULL: none are chosen                                             */
  const rm_stock   *stock[2];       /* [side] what came along them, until it is kept as a piece          */
  rm_part           part;           /* of the block that is overlaid                                     */
  const rm_trimesh *trimesh[2];     /* [side] of the piece; NULL until made                              */
  rm_frame          frame;          /* that the triangles are for                                        */
  const double    (*box[2])[6];     /* [side][cells of this rank] as they were when routes were chosen   */
  double            margin;         /* by which cells may come nearer to each other while routes hold    */
  int               num_moves;      /* since routes were chosen                                          */
} rm_place;

/* RM_BLOCK_TRIANGLES  what a rank overlays at once at most: about 3300 hexahedra of either mesh, which takes 12 MB with
 *                     diagonal faces, 21 MB with centres
 * RM_BLOCKS           that many on small ranks, whose peak is to fall with their cells, but
 * RM_BLOCK_FEW        not of fewer triangles than that
 * RM_BLOCK_REPEATS    triangles of sources that may come once more for that, over those of all cells of the rank
 * RM_SLICE_PAIRS      pairs that go home at once, at least; 200 bytes each while they do */
enum { RM_BLOCK_TRIANGLES = 80000, RM_BLOCKS = 28, RM_BLOCK_FEW = 25000, RM_SLICE_PAIRS = 20000 };
#define RM_BLOCK_REPEATS 0.5

/* Calls that all ranks make together, or among neighbours. */
typedef enum rm_call {
  RM_CALL_BUILD = 1, RM_CALL_MOVE, RM_CALL_MASKS, RM_CALL_AGREE, RM_CALL_PARTIAL_CELLS, RM_CALL_SUPERMESH,
  RM_CALL_SUPERMESH_VALUES, RM_CALL_FIRST_TRANSFER, RM_CALL_LARGER_TRANSFER, RM_CALL_REFUSED_TRANSFER, RM_CALL_FINISH
} rm_call;

struct remap_context {
  rm_comm       comm;
  rm_arena     *peers_arena;
  rm_parley     few, parley; /* that calls begin with; few: of ranks in the tree only, parley: of neighbours too */
  remap_options options;
  rm_slicing    slicing;  /* of overlays that keep nothing for the next one */
  int64_t       slice;    /* pairs of a rank that go home at once, at least */
  remap_mesh   *block[2]; /* [side][num_blocks] as lent; malloc'ed */
  int64_t       block_room[2];
  int           num_blocks[2];
  bool          is_set[2];
  bool          is_built;
  double        seconds_transfer;
  char          message[1024];

  bool          is_turned[2];  /* [side] nodes lie where matrix puts what was lent */
  double        matrix[2][12];

  rm_arena         *mesh_arena[2]; /* [side] of labels, mesh and layout, which outlive the moves of the other side */
  rm_labels         labels[2];
  double            extent[2][6];
  rm_frame          frame;
  const rm_mesh    *mesh[2];
  rm_layout         layout[2];
  const double     *measure[2]; /* [side][cells] the solver's volume over the own one; NULL: 1 in all cells of all ranks */
  const double     *given_volume[2]; /* [side][cells] the solver's volume; NULL where measure is */
  double            solver_volume[2], max_volume_difference[2]; /* [side] as in remap_stats */
  rm_gid            worst_volume_cell[2];
  rm_arena         *stencil_arena[2]; /* [side] */
  const rm_stencil *stencil[2];       /* [side] of all cells; made when first needed */
  const rm_stencil *wide[2];          /* [side] likewise, for order 3                */
  const double    (*second[2])[6];    /* [side] likewise, rm_mesh_second             */

  rm_place          place; /* kept between moves, empty otherwise */
  rm_arena         *arena; /* of the mapping and its views, dropped by the next overlay */
  const rm_mapping *mapping;
  const uint8_t    *differs[2]; /* [side][cells] as in rm_transfer_setup */
  remap_pairs_view  view[2]; /* made when first needed; row_offset NULL until then */
  remap_stats       stats;

  rm_arena         *mask_arena; /* of what masks change, NULL: there are none */
  const uint8_t    *gives[2], *wants[2]; /* [side] NULL: all do, on every rank */
  const rm_mapping *masked[2];           /* [direction] what transfers see; mapping itself without masks */
  const rm_stencil *giving_stencil[2], *giving_wide[2], *wanting_stencil[2], *wanting_wide[2]; /* of cells that do */
  rm_arena         *carrier_arena[2]; /* [direction] of the carrier alone, which is made anew when more has to fit in */
  rm_carrier       *carrier[2];       /* [direction] NULL until needed                                                */
  rm_load           load[2];          /* [direction] that the carrier is made for                                     */

  rm_arena         *super_arena; /* of the last supermesh alone */
  const rm_super   *super;       /* NULL: none                  */
};

/* Put a text into the context's message, and hand status back. Not collective. */
remap_status rm_context_fail(remap_context *ctx, remap_status status, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

/* What calls that only look at an overlay begin with. Not collective. BAD_ARGUMENT, BAD_ORDER. */
remap_status rm_context_check_view(remap_context *ctx, bool is_good, const char *function);

/* The mark of a call that must agree on a detail. */
uint64_t rm_context_mark(rm_call call, int detail);

/* What a collective call begins with. BAD_ARGUMENT unless every rank makes the same one with the same detail; nobody waits for
 * a rank that makes another. */
remap_status rm_context_enter(remap_context *ctx, rm_call call, int detail, rm_reason *reason);

/* The same, and then one status for all, as rm_comm_agree_reason. */
remap_status rm_context_start_call(remap_context *ctx, rm_call call, remap_status mine, rm_reason *reason);

/* Find out whom calls begin with before there are transfers. Not collective; on all ranks. NO_MEMORY. */
remap_status rm_context_meet_few(remap_context *ctx);

/* The same once carriers are made. Collective. NO_MEMORY: everything stays as it is. */
remap_status rm_context_meet(remap_context *ctx);

/* Find the largest overlap of zones of each mesh, for stats. Collective. ZONE_OVERLAP if that is an error. */
remap_status rm_context_compare_zones(remap_context *ctx, rm_reason *reason);

/* Put what *reason says about a failure into the context's message, with mesh, zone and cell by name. Not collective. */
void rm_context_explain(remap_context *ctx, remap_status status, const rm_reason *reason);

/* What room mesh reads of one side: the blocks in one, with 64-bit indices from 0. Arrays are the caller's where they are so
 * already, else in passing; layout lives in arena. Not collective. BAD_MESH, TOO_LARGE, NO_MEMORY. */
remap_status rm_context_join_blocks(rm_arena *arena, rm_arena *passing, int side, int num_blocks, const remap_mesh *block,
                                    remap_mesh *out, rm_layout *layout, rm_reason *reason);

/* Read the meshes that are new, keep the other one as it is where that is possible; is_new becomes true for what was read after
 * all. Collective. What is not kept lives in passing. */
remap_status rm_context_read_meshes(remap_context *ctx, bool is_new[2], rm_arena *passing, rm_reason *reason);

/* Choose where the cells of both meshes are overlaid, in how many blocks of a rank (rm_part_blocks), one if the place is to be
 * kept, and bring them there, unless they are there already: is_new[side], the mesh is not as it was at the last call.
 * Collective. TOO_LARGE, NO_MEMORY. */
remap_status rm_context_place(remap_context *ctx, const bool is_new[2], bool keeps, rm_reason *reason);

/* Take a block's cells, in place of those of the last, unless the place is kept. Not collective. TOO_LARGE, NO_MEMORY. */
remap_status rm_context_take_block(remap_context *ctx, int block, rm_reason *reason);

/* Triangulate what is there of one side, unless that is done already. Not collective. TOO_LARGE, NO_MEMORY. */
remap_status rm_context_triangulate(remap_context *ctx, int side);

/* Give a side's triangles back. Not collective. */
void rm_context_drop_triangles(remap_context *ctx, int side);

/* Forget where cells are overlaid. Not collective. */
void rm_context_drop_place(remap_context *ctx);

/* Volumes and moments of source cells' pairs too, which remap_build leaves to those who look at them. Not collective.
 * NO_MEMORY. */
remap_status rm_context_need_pairs(remap_context *ctx);

/* Compare the solver's volumes of one side, which lie as given, with those of its mesh. Collective. BAD_MESH. */
remap_status rm_context_measure(remap_context *ctx, int side, const remap_mesh *given, rm_reason *reason);

/* Find the cells that are the same in both meshes but for the solver's volume. Collective, once there is a mapping. */
remap_status rm_context_compare_volumes(remap_context *ctx);

/* Forget meshes and their stencils. Not collective. */
void rm_context_drop_meshes(remap_context *ctx);

/* Tell the caller how far a phase is; CANCELLED if that is the answer. */
remap_status rm_context_progress(remap_context *ctx, const char *phase, double done);

/* Forget masks. Not collective. */
void rm_context_drop_masks(remap_context *ctx);

/* Forget the supermesh. Not collective. */
void rm_context_drop_super(remap_context *ctx);

/* Is a transfer under way in either direction? */
bool rm_context_is_busy(const remap_context *ctx);

/* Give up transfers under way, and drop what they kept. On all ranks; waits for neighbours at most. */
void rm_context_drop_carriers(remap_context *ctx);

#endif
