/* zone_overlap -- see zone_overlap.h. If two zones share volume, the skin of one passes through cells of the other: the cells
 * whose boxes meet a foreign zone's skin, and the cells behind that skin, are all that needs to be overlaid. */
#include "moments/zone_overlap.h"

#include <math.h>
#include <string.h>

typedef struct candidates {
  const rm_piece   *piece;
  const rm_lid     *zone;        /* [cells] */
  const double    (*box)[6];     /* [cells] */
  const rm_lid     *skin;        /* faces   */
  const double    (*skin_box)[6];
  const rm_boxtree *tree;        /* over the skin */
  rm_lid            cell;
  uint8_t          *entered, *entering; /* [cells] marks */
} candidates;

static int mark(void *user, rm_lid s)
{
  candidates  *c     = user;
  const rm_lid owner = c->piece->face_cell[c->skin[s]][0];

  if (c->zone[owner] != c->zone[c->cell]) c->entered[c->cell] = c->entering[owner] = 1;
  return 0;
}

static rm_lid zone_of(int64_t num_zones, const int64_t *offset, rm_gid cell)
{
  int64_t low = 0, high = num_zones;

  while (high - low > 1) {
    const int64_t mid = low + (high - low) / 2;
    if (offset[mid] <= cell) low = mid;
    else high = mid;
  }
  return (rm_lid)low;
}

/* The marked cells of a piece as a piece of their own; faces that lose their only cell go. */
static remap_status marked_cells(rm_arena *arena, const rm_piece *p, const uint8_t *marks, rm_piece *out)
{
  rm_lid  *number, num_cells = 0, num_faces = 0, *node, (*cell)[2], *home;
  int64_t *offset, corners = 0;
  uint8_t *skin;
  rm_gid  *global;
  int     *rank;
  double  *volume, (*centroid)[3];

  RM_NEW(number, arena, p->num_cells);
  for (rm_lid c = 0; c < p->num_cells; c++) number[c] = marks[c] ? num_cells++ : -1;
  RM_NEW(offset, arena, (int64_t)p->num_faces + 1);
  RM_NEW(node, arena, p->face_offset[p->num_faces]);
  RM_NEW(cell, arena, p->num_faces);
  RM_NEW0(skin, arena, p->num_faces);
  RM_NEW(global, arena, num_cells);
  RM_NEW(rank, arena, num_cells);
  RM_NEW(home, arena, num_cells);
  RM_NEW(volume, arena, num_cells);
  RM_NEW(centroid, arena, num_cells);
  offset[0] = 0;
  for (rm_lid f = 0; f < p->num_faces; f++) {
    const rm_lid owner = number[p->face_cell[f][0]], other = p->face_cell[f][1] >= 0 ? number[p->face_cell[f][1]] : -1;
    const int64_t first = p->face_offset[f], n = p->face_offset[f + 1] - first;

    if (owner < 0 && other < 0) continue;
    for (int64_t k = 0; k < n; k++) node[corners + k] = p->face_node[first + (owner >= 0 ? k : n - 1 - k)];
    corners += n;
    cell[num_faces][0]  = owner >= 0 ? owner : other;
    cell[num_faces][1]  = owner >= 0 ? other : -1;
    offset[++num_faces] = corners;
  }
  for (rm_lid c = 0; c < p->num_cells; c++) {
    if (number[c] < 0) continue;
    global[number[c]] = p->cell_global[c];
    rank[number[c]]   = p->cell_home_rank[c];
    home[number[c]]   = p->cell_home[c];
    volume[number[c]] = p->cell_volume[c];
    memcpy(centroid[number[c]], p->cell_centroid[c], sizeof *centroid);
  }
  *out = (rm_piece){.num_nodes      = p->num_nodes,
                    .num_faces      = num_faces,
                    .num_cells      = num_cells,
                    .node_xyz       = p->node_xyz,
                    .face_offset    = offset,
                    .face_node      = node,
                    .face_cell      = (const rm_lid (*)[2])cell,
                    .face_is_skin   = skin,
                    .cell_global    = global,
                    .cell_home_rank = rank,
                    .cell_home      = home,
                    .cell_volume    = volume,
                    .cell_centroid  = (const double (*)[3])centroid};
  return REMAP_OK;
}

static double surface(const rm_trimesh *m, rm_lid c)
{
  double area = 0;

  for (rm_lid a = m->cell_triangle_offset[c]; a < m->cell_triangle_offset[c + 1]; a++) {
    const double *n = m->normal[m->cell_triangle[a] / 2];
    area += 0.5 * sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
  }
  return area;
}

static remap_status overlay_marked(rm_arena *arena, const rm_frame *frame, const candidates *c, remap_faces faces,
                                   int64_t num_zones, const int64_t *zone_cell_offset, double magnitude, rm_zone_overlap *out,
                                   rm_reason *reason)
{
  rm_part           part;
  const rm_trimesh *mesh[2];
  const rm_overlay *o;
  const rm_moments *m;

  RM_TRY(marked_cells(arena, c->piece, c->entered, &part.piece[0]));
  RM_TRY(marked_cells(arena, c->piece, c->entering, &part.piece[1]));
  for (int k = 0; k < 2; k++) RM_TRY(rm_trimesh_build(arena, frame, &part.piece[k], faces, &mesh[k]));
  RM_TRY(rm_overlay_build(arena, mesh, &part, NULL, &o, reason));
  RM_TRY(rm_moments_build(arena, &part, o, 1, &m));
  for (int64_t k = 0; k < m->num_pairs; k++) {
    const rm_gid a = part.piece[0].cell_global[m->source[k]], b = part.piece[1].cell_global[m->target[k]];
    const double v = fabs(m->volume[k]);

    if (zone_of(num_zones, zone_cell_offset, a) == zone_of(num_zones, zone_cell_offset, b)) continue;
    if (v <= 0x1p-20 * magnitude * fmin(surface(mesh[0], m->source[k]), surface(mesh[1], m->target[k]))) continue;
    const rm_gid low = a < b ? a : b, high = a < b ? b : a;
    if (v < out->volume || (v == out->volume && (low > out->cell[0] || (low == out->cell[0] && high >= out->cell[1]))))
      continue;
    *out = (rm_zone_overlap){v, {low, high}};
  }
  return REMAP_OK;
}

static void widen(double box[6], const double other[6])
{
  for (int d = 0; d < 3; d++) {
    box[d]     = fmin(box[d], other[d]);
    box[d + 3] = rm_max(box[d + 3], other[d + 3]);
  }
}

/* The boxes of a piece's cells, and its faces in the skin of the mesh with theirs. */
static remap_status find_boxes(rm_arena *arena, candidates *c)
{
  static const double nothing[6] = {INFINITY, INFINITY, INFINITY, -INFINITY, -INFINITY, -INFINITY};
  const rm_piece     *p          = c->piece;
  rm_lid             *skin, num = 0;
  double            (*box)[6], (*skin_box)[6];

  for (rm_lid f = 0; f < p->num_faces; f++) num += p->face_is_skin[f];
  RM_NEW(box, arena, p->num_cells);
  RM_NEW(skin, arena, num);
  RM_NEW(skin_box, arena, num);
  for (rm_lid k = 0; k < p->num_cells; k++) memcpy(box[k], nothing, sizeof nothing);
  num = 0;
  for (rm_lid f = 0; f < p->num_faces; f++) {
    double own[6];

    memcpy(own, nothing, sizeof own);
    for (int64_t k = p->face_offset[f]; k < p->face_offset[f + 1]; k++) {
      const double *x = p->node_xyz[p->face_node[k]];

      widen(own, (const double[6]){x[0], x[1], x[2], x[0], x[1], x[2]});
    }
    for (int h = 0; h < 2; h++)
      if (p->face_cell[f][h] >= 0) widen(box[p->face_cell[f][h]], own);
    if (!p->face_is_skin[f]) continue;
    memcpy(skin_box[num], own, sizeof own);
    skin[num++] = f;
  }
  c->box      = (const double(*)[6])box;
  c->skin     = skin;
  c->skin_box = (const double(*)[6])skin_box;
  return rm_boxtree_build(arena, num, c->skin_box, &c->tree);
}

remap_status rm_zone_overlap_find(const rm_frame *frame, const rm_piece *piece, remap_faces faces, int64_t num_zones,
                                  const int64_t *zone_cell_offset, double magnitude, rm_zone_overlap *out, rm_reason *reason)
{
  rm_arena    *arena  = rm_arena_new();
  remap_status status = arena ? REMAP_OK : REMAP_NO_MEMORY;
  candidates   c      = {.piece = piece};
  rm_lid      *zone;
  bool         any = false;

  *out = (rm_zone_overlap){0, {-1, -1}};
  if (status == REMAP_OK && num_zones > 1) {
    c.zone     = zone = rm_arena_alloc(arena, piece->num_cells, sizeof *zone);
    c.entered  = rm_arena_zero(arena, piece->num_cells, 1);
    c.entering = rm_arena_zero(arena, piece->num_cells, 1);
    status     = zone && c.entered && c.entering ? find_boxes(arena, &c) : REMAP_NO_MEMORY;
    for (rm_lid k = 0; status == REMAP_OK && k < piece->num_cells; k++)
      zone[k] = zone_of(num_zones, zone_cell_offset, piece->cell_global[k]);
    for (rm_lid k = 0; status == REMAP_OK && k < piece->num_cells; k++) {
      c.cell = k;
      rm_boxtree_query(c.tree, c.skin_box, c.box[k], mark, &c);
      any |= c.entered[k];
    }
    if (status == REMAP_OK && any)
      status = overlay_marked(arena, frame, &c, faces, num_zones, zone_cell_offset, magnitude, out, reason);
  }
  rm_arena_drop(arena);
  return status;
}
