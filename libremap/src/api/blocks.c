/* blocks -- the caller's blocks as one mesh with 64-bit indices from 0. A single block that is so already is passed on as it
 * is; else O(n) time and memory, which lasts as long as the build. */
#include "api/context.h"

#include <string.h>

/* An index array of the caller, in whichever width it comes. */
typedef struct indices {
  const int64_t *wide;
  const int32_t *narrow;
} indices;

static int64_t at(indices list, int64_t k) { return list.wide ? list.wide[k] : list.narrow[k]; }

static bool is_missing(indices list, int64_t num) { return num > 0 && !list.wide && !list.narrow; }

/* What is added to numbers of one block. */
typedef struct shift {
  int     block;
  int64_t base;
  int64_t nodes, faces, corners, cells;
} shift;

static bool is_plain(const remap_mesh *b)
{
  return b->index_base == 0 && (b->face_offset || !b->face_offset32) && (b->face_node || !b->face_node32) &&
         (b->face_owner || !b->face_owner32) && (b->face_neighbour || !b->face_neighbour32);
}

/* A block can be read: its arrays are there and its offsets ascend. */
static remap_status check_block(int side, int number, const remap_mesh *b, rm_reason *reason)
{
  const indices offset = {b->face_offset, b->face_offset32}, node = {b->face_node, b->face_node32};
  const indices owner = {b->face_owner, b->face_owner32}, neighbour = {b->face_neighbour, b->face_neighbour32};

  if (b->num_nodes < 0 || b->num_faces < 0 || b->num_cells < 0)
    return rm_fail(REMAP_BAD_MESH, reason, side, -1,
                   "block %d has %lld nodes, %lld faces and %lld cells: give counts that are not negative", number,
                   (long long)b->num_nodes, (long long)b->num_faces, (long long)b->num_cells);
  if (b->num_nodes > INT32_MAX || b->num_faces > INT32_MAX || b->num_cells > INT32_MAX)
    return rm_fail(REMAP_TOO_LARGE, reason, side, -1, "block %d has more than %d nodes, faces or cells: use more ranks", number,
                   INT32_MAX);
  if (b->index_base != 0 && b->index_base != 1)
    return rm_fail(REMAP_BAD_MESH, reason, side, -1, "block %d has index_base %d: give 0 or 1", number, b->index_base);
  if ((b->num_nodes > 0 && !b->node_xyz) || is_missing(offset, b->num_faces) || is_missing(node, b->num_faces) ||
      is_missing(owner, b->num_faces) || is_missing(neighbour, b->num_faces))
    return rm_fail(REMAP_BAD_MESH, reason, side, -1,
                   "node_xyz, face_offset, face_node, face_owner or face_neighbour of block %d is NULL: give the array",
                   number);
  if (b->num_faces > 0 && at(offset, 0) != b->index_base)
    return rm_fail(REMAP_BAD_MESH, reason, side, -1, "face_offset of block %d starts with %lld: it starts with index_base",
                   number, (long long)at(offset, 0));
  for (int64_t f = 0; f < b->num_faces; f++)
    if (at(offset, f) > at(offset, f + 1))
      return rm_fail(REMAP_BAD_MESH, reason, side, -1, "face_offset of block %d does not ascend at face %lld: %lld, then %lld",
                     number, (long long)f, (long long)at(offset, f), (long long)at(offset, f + 1));
  return REMAP_OK;
}

static remap_status bad_index(int side, const shift *s, int64_t face, const char *what, int64_t index, int64_t num,
                              rm_reason *reason)
{
  return rm_fail(REMAP_BAD_MESH, reason, side, -1, "face %lld of block %d has %s %lld, but those of its block are %lld to %lld",
                 (long long)face, s->block, what, (long long)index, (long long)s->base, (long long)(s->base + num - 1));
}

/* The faces of a block, behind those before it. */
static remap_status add_faces(int side, const remap_mesh *b, const shift *s, int64_t *offset, int64_t *node, int64_t *owner,
                              int64_t *neighbour, rm_reason *reason)
{
  const indices offsets = {b->face_offset, b->face_offset32}, nodes = {b->face_node, b->face_node32};
  const indices owners = {b->face_owner, b->face_owner32}, neighbours = {b->face_neighbour, b->face_neighbour32};

  for (int64_t f = 0; f < b->num_faces; f++) {
    const int64_t first = at(offsets, f) - s->base, end = at(offsets, f + 1) - s->base;
    const int64_t own = at(owners, f) - s->base, other = at(neighbours, f) - s->base;

    if (own < 0 || own >= b->num_cells) return bad_index(side, s, f, "owner", own + s->base, b->num_cells, reason);
    if (other >= b->num_cells) return bad_index(side, s, f, "neighbour", other + s->base, b->num_cells, reason);
    for (int64_t k = first; k < end; k++) {
      const int64_t n = at(nodes, k) - s->base;

      if (n < 0 || n >= b->num_nodes) return bad_index(side, s, f, "node", n + s->base, b->num_nodes, reason);
      node[s->corners + k] = s->nodes + n;
    }
    offset[s->faces + f + 1] = s->corners + end;
    owner[s->faces + f]      = s->cells + own;
    neighbour[s->faces + f]  = other < 0 ? -1 : s->cells + other;
  }
  return REMAP_OK;
}

static int64_t num_corners(const remap_mesh *b)
{
  const indices offset = {b->face_offset, b->face_offset32};

  return b->num_faces > 0 ? at(offset, b->num_faces) - b->index_base : 0;
}

/* Global ids of all blocks, where they are given. */
static remap_status join_ids(rm_arena *passing, int side, int num_blocks, const remap_mesh *block, remap_mesh *out,
                             rm_reason *reason)
{
  int64_t *id, num = 0;
  bool     has = false, lacks = false;

  for (int b = 0; b < num_blocks; b++) {
    has |= block[b].num_cells > 0 && block[b].cell_global;
    lacks |= block[b].num_cells > 0 && !block[b].cell_global;
  }
  if (has && lacks)
    return rm_fail(REMAP_BAD_MESH, reason, side, -1, "cell_global is given for some blocks of a rank and NULL for others");
  out->cell_global = NULL;
  if (!has) return REMAP_OK;
  RM_NEW(id, passing, out->num_cells);
  for (int b = 0; b < num_blocks; b++) {
    if (block[b].num_cells > 0) memcpy(id + num, block[b].cell_global, (size_t)block[b].num_cells * sizeof *id);
    num += block[b].num_cells;
  }
  out->cell_global = id;
  return REMAP_OK;
}

/* Solver volumes of all blocks, 0 where there are none. */
static remap_status join_volumes(rm_arena *passing, int num_blocks, const remap_mesh *block, remap_mesh *out)
{
  double *volume = NULL;
  int64_t num    = 0;
  bool    has    = false;

  for (int b = 0; b < num_blocks; b++) has |= block[b].cell_volume != NULL;
  if (has) RM_NEW(volume, passing, out->num_cells);
  for (int b = 0; b < num_blocks && has; b++)
    for (int64_t c = 0; c < block[b].num_cells; c++) volume[num++] = block[b].cell_volume ? block[b].cell_volume[c] : 0.0;
  out->cell_volume = volume;
  return REMAP_OK;
}

static remap_status join(rm_arena *passing, int side, int num_blocks, const remap_mesh *block, remap_mesh *out,
                         rm_reason *reason)
{
  int64_t  corners = 0, *offset, *node, *owner, *neighbour;
  double  *xyz;
  shift    s = {0};

  out->num_nodes = out->num_faces = out->num_cells = 0;
  for (int b = 0; b < num_blocks; b++) {
    RM_TRY(check_block(side, b, &block[b], reason));
    out->num_nodes += block[b].num_nodes;
    out->num_faces += block[b].num_faces;
    out->num_cells += block[b].num_cells;
    corners += num_corners(&block[b]);
  }
  RM_NEW(xyz, passing, rm_mul_sat(out->num_nodes, 3));
  RM_NEW(offset, passing, out->num_faces + 1);
  RM_NEW(node, passing, corners);
  RM_NEW(owner, passing, out->num_faces);
  RM_NEW(neighbour, passing, out->num_faces);
  offset[0] = 0;
  for (int b = 0; b < num_blocks; b++) {
    s.block = b;
    s.base  = block[b].index_base;
    if (block[b].num_nodes > 0) memcpy(xyz + 3 * s.nodes, block[b].node_xyz, (size_t)block[b].num_nodes * 3 * sizeof *xyz);
    RM_TRY(add_faces(side, &block[b], &s, offset, node, owner, neighbour, reason));
    s.nodes += block[b].num_nodes;
    s.faces += block[b].num_faces;
    s.cells += block[b].num_cells;
    s.corners += num_corners(&block[b]);
  }
  out->node_xyz       = xyz;
  out->face_offset    = offset;
  out->face_node      = node;
  out->face_owner     = owner;
  out->face_neighbour = neighbour;
  RM_TRY(join_volumes(passing, num_blocks, block, out));
  return join_ids(passing, side, num_blocks, block, out, reason);
}

/* Where fields have their values. Counts are good. */
static remap_status lay_out(rm_arena *arena, int side, int num_blocks, const remap_mesh *block, rm_layout *layout,
                            rm_reason *reason)
{
  rm_lid  *offset;
  int64_t *place, num = 0;
  bool     has = false;

  for (int b = 0; b < num_blocks; b++) has |= block[b].cell_place != NULL;
  RM_NEW(offset, arena, (int64_t)num_blocks + 1);
  offset[0] = 0;
  for (int b = 0; b < num_blocks; b++) offset[b + 1] = (rm_lid)(num += block[b].num_cells);
  *layout = (rm_layout){num_blocks, offset, NULL};
  if (!has) return REMAP_OK;
  RM_NEW(place, arena, num);
  for (int b = 0; b < num_blocks; b++)
    for (rm_lid c = offset[b]; c < offset[b + 1]; c++) {
      place[c] = block[b].cell_place ? block[b].cell_place[c - offset[b]] : c - offset[b];
      if (place[c] < 0)
        return rm_fail(REMAP_BAD_MESH, reason, side, -1, "cell %lld of block %d has place %lld: places are not negative",
                       (long long)(c - offset[b]), b, (long long)place[c]);
    }
  layout->place = place;
  return REMAP_OK;
}

remap_status rm_context_join_blocks(rm_arena *arena, rm_arena *passing, int side, int num_blocks, const remap_mesh *block,
                                    remap_mesh *out, rm_layout *layout, rm_reason *reason)
{
  int64_t num_cells = 0;

  *out = num_blocks > 0 ? block[0] : (remap_mesh){0};
  if (num_blocks != 1 || !is_plain(&block[0])) RM_TRY(join(passing, side, num_blocks, block, out, reason));
  for (int b = 0; b < num_blocks; b++) num_cells = rm_add_sat(num_cells, block[b].num_cells < 0 ? 0 : block[b].num_cells);
  if (num_cells > INT32_MAX || (num_blocks == 1 && block[0].num_cells < 0)) { /* room mesh says what is wrong */
    *layout = (rm_layout){0};
    return REMAP_OK;
  }
  return lay_out(arena, side, num_blocks, block, layout, reason);
}
