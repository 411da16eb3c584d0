/* zone_overlap -- see zone_overlap.h. If two zones share volume, the skin of one passes through cells of the other: the cells
 * whose boxes meet a foreign zone's skin, and the cells behind that skin, are all that needs to be overlaid; first those pairs
 * whose entered cell is of the zone that comes first, then the others. */
#include "moments/zone_overlap.h"

#include <math.h>
#include <string.h>

typedef struct candidates {
  const rm_skins   *skins;
  const double    (*box)[6];      /* [entered cells]                                     */
  const rm_lid     *skin;         /* faces of the entering piece                         */
  const double    (*skin_box)[6];
  const rm_boxtree *tree;         /* over them                                           */
  int               first;        /* RM_SKINS_ of those that come first in pairs         */
  rm_lid            cell;         /* the entered one that asks                           */
  rm_lid            other;        /* for this entering one                               */
  uint8_t          *marks[2];     /* [RM_SKINS_][cells] is in such a pair                */
  bool              any;          /* one is                                              */
} candidates;

static rm_lid cell_behind(const candidates *c, rm_lid s)
{
  return c->skins->piece[RM_SKINS_ENTERING].face_cell[c->skin[s]][0];
}

/* Is this a pair of different zones, the first of which is `first`? */
static bool is_in_order(const candidates *c, rm_lid entered, rm_lid entering)
{
  const rm_lid zone[2] = {c->skins->zone[RM_SKINS_ENTERED][entered], c->skins->zone[RM_SKINS_ENTERING][entering]};

  return zone[c->first] < zone[1 - c->first];
}

static int mark(void *user, rm_lid s)
{
  candidates  *c        = user;
  const rm_lid entering = cell_behind(c, s);

  if (is_in_order(c, c->cell, entering)) {
    c->marks[RM_SKINS_ENTERED][c->cell] = c->marks[RM_SKINS_ENTERING][entering] = 1;
    c->any                                                                     = true;
  }
  return 0;
}

static int is_of_other(void *user, rm_lid s)
{
  const candidates *c = user;

  return cell_behind(c, s) == c->other;
}

/* The marked cells of a piece as a piece of their own, and their numbers before; faces that lose their only cell go. */
static remap_status marked_cells(rm_arena *arena, const rm_piece *p, const uint8_t *marks, rm_piece *out, rm_lid **old)
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
  RM_NEW(*old, arena, num_cells);
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
    (*old)[number[c]] = c;
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

/* Overlay what is marked, and take the largest overlap beyond rounding. */
static remap_status overlay_marked(rm_arena *arena, const rm_frame *frame, candidates *c, remap_faces faces, double magnitude,
                                   rm_zone_overlap *out, rm_reason *reason)
{
  const int         kind[2] = {c->first, 1 - c->first}, at = kind[0] == RM_SKINS_ENTERED ? 0 : 1; /* of the entered piece */
  rm_part           part;
  rm_lid           *old[2];
  const rm_trimesh *mesh[2];
  const rm_overlay *o;
  const rm_moments *m;

  for (int k = 0; k < 2; k++) {
    RM_TRY(marked_cells(arena, &c->skins->piece[kind[k]], c->marks[kind[k]], &part.piece[k], &old[k]));
    RM_TRY(rm_trimesh_build(arena, frame, &part.piece[k], faces, &mesh[k]));
  }
  RM_TRY(rm_overlay_build(arena, mesh, &part, NULL, &o, reason));
  RM_TRY(rm_moments_build(arena, &part, o, 1, &m));
  for (int64_t k = 0; k < m->num_pairs; k++) {
    const rm_lid cell[2] = {m->source[k], m->target[k]};
    const rm_gid a = part.piece[0].cell_global[cell[0]], b = part.piece[1].cell_global[cell[1]];
    const double v = fabs(m->volume[k]);

    if (v <= 0x1p-20 * magnitude * fmin(surface(mesh[0], cell[0]), surface(mesh[1], cell[1]))) continue;
    if (v < out->volume || (v == out->volume && (a > out->cell[0] || (a == out->cell[0] && b >= out->cell[1])))) continue;
    c->cell  = old[at][cell[at]];
    c->other = old[1 - at][cell[1 - at]];
    if (is_in_order(c, c->cell, c->other) && rm_boxtree_query(c->tree, c->skin_box, c->box[c->cell], is_of_other, c))
      *out = (rm_zone_overlap){v, {a, b}};
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

static const double nothing[6] = {INFINITY, INFINITY, INFINITY, -INFINITY, -INFINITY, -INFINITY};

static void find_face_box(const rm_piece *p, rm_lid f, double out[6])
{
  memcpy(out, nothing, sizeof nothing);
  for (int64_t k = p->face_offset[f]; k < p->face_offset[f + 1]; k++) {
    const double *x = p->node_xyz[p->face_node[k]];

    widen(out, (const double[6]){x[0], x[1], x[2], x[0], x[1], x[2]});
  }
}

/* The boxes of the entered cells, and the faces of entering ones in the skin of the mesh with theirs. */
static remap_status find_boxes(rm_arena *arena, candidates *c)
{
  const rm_piece *entered = &c->skins->piece[RM_SKINS_ENTERED], *entering = &c->skins->piece[RM_SKINS_ENTERING];
  rm_lid         *skin, num = 0;
  double        (*box)[6], (*skin_box)[6];

  RM_NEW(box, arena, entered->num_cells);
  for (rm_lid k = 0; k < entered->num_cells; k++) memcpy(box[k], nothing, sizeof nothing);
  for (rm_lid f = 0; f < entered->num_faces; f++) {
    double own[6];

    find_face_box(entered, f, own);
    for (int h = 0; h < 2; h++)
      if (entered->face_cell[f][h] >= 0) widen(box[entered->face_cell[f][h]], own);
  }
  for (rm_lid f = 0; f < entering->num_faces; f++) num += entering->face_is_skin[f];
  RM_NEW(skin, arena, num);
  RM_NEW(skin_box, arena, num);
  num = 0;
  for (rm_lid f = 0; f < entering->num_faces; f++) {
    if (!entering->face_is_skin[f]) continue;
    find_face_box(entering, f, skin_box[num]);
    skin[num++] = f;
  }
  c->box      = (const double(*)[6])box;
  c->skin     = skin;
  c->skin_box = (const double(*)[6])skin_box;
  return rm_boxtree_build(arena, num, c->skin_box, &c->tree);
}

/* Pairs in which entered cells, or entering ones, come first. */
static remap_status find_in_order(rm_arena *arena, const rm_frame *frame, candidates *c, int first, remap_faces faces,
                                  double magnitude, rm_zone_overlap *out, rm_reason *reason)
{
  c->first = first;
  c->any   = false;
  for (int kind = 0; kind < 2; kind++) RM_NEW0(c->marks[kind], arena, c->skins->piece[kind].num_cells);
  for (c->cell = 0; c->cell < c->skins->piece[RM_SKINS_ENTERED].num_cells; c->cell++)
    rm_boxtree_query(c->tree, c->skin_box, c->box[c->cell], mark, c);
  return c->any ? overlay_marked(arena, frame, c, faces, magnitude, out, reason) : REMAP_OK;
}

remap_status rm_zone_overlap_find(const rm_frame *frame, const rm_skins *skins, remap_faces faces, double magnitude,
                                  rm_zone_overlap *out, rm_reason *reason)
{
  candidates   c = {.skins = skins};
  rm_arena    *arena;
  remap_status status = REMAP_NO_MEMORY;

  *out = (rm_zone_overlap){0, {-1, -1}};
  if (!skins->any) return REMAP_OK;
  arena = rm_arena_new();
  if (arena) status = find_boxes(arena, &c);
  for (int first = 0; first < 2 && status == REMAP_OK; first++)
    status = find_in_order(arena, frame, &c, first, faces, magnitude, out, reason);
  rm_arena_drop(arena);
  return status;
}
