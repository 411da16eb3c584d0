/* skins -- where the skin of one zone of a mesh may enter cells of another, inside of the other mesh. Both kinds of cells are
 * found coarsely first, by crowds of skin and then of the cells that meet those; then exactly by box, where they meet the other
 * mesh. Few are left unless zones overlap by much, and only they travel. O(n log B) time for n cells here and B crowds, and
 * memory for the faces of the skin; then as room part takes for the cells that are found. */
#include "part/part_private.h"

#include <math.h>
#include <string.h>

/* Boxes of things that belong to zones. */
typedef struct boxes {
  rm_lid   num;
  double (*box)[6]; /* [num] */
  rm_lid  *zone;    /* [num] */
} boxes;

typedef struct work {
  rm_arena             *scratch;
  const rm_comm        *comm;
  const rm_frame       *frame;
  const rm_mesh *const *mesh; /* [side] */
  int                   side;
  const rm_lid         *zone; /* [cells] */
  boxes                 skin;    /* of the faces in the skin                     */
  const rm_lid         *behind;  /* [skin.num] that cell                         */
  uint8_t              *is[2];   /* [RM_SKINS_][cells]                           */
  rm_lid                num[2];
  rm_lid               *cell[2]; /* [RM_SKINS_][num] ascending                   */
  rm_route              route[2];
  rm_reason            *reason;
} work;

/* ---- coarsely ----------------------------------------------------------------------------------------------------- */

static remap_status new_boxes(rm_arena *arena, rm_lid most, boxes *out)
{
  out->num = 0;
  RM_NEW(out->box, arena, most);
  RM_NEW(out->zone, arena, most);
  return REMAP_OK;
}

/* Crowds of the boxes of all ranks that may meet the asking ones. Collective; mine is this rank's status so far. */
static remap_status find_crowds(const work *w, remap_status mine, const boxes *all, rm_lid num_asking,
                                const double (*asking)[6], rm_crowds *out)
{
  RM_TRY(rm_comm_agree(w->comm, mine, NULL));
  return rm_crowds_meet_labelled(w->scratch, w->comm, all->num, (const double(*)[6])all->box, all->zone, num_asking, asking,
                                 RM_SOME_CROWDS, out);
}

typedef struct question {
  const rm_crowds *crowds;
  rm_lid           zone;
} question;

static int meet(void *user, rm_lid item)
{
  const question *q = user;

  return q->crowds->crowd[item].label != q->zone;
}

/* Does a box of one zone meet a crowd of another? */
static bool meets_foreign(const rm_crowds *crowds, const double box[6], rm_lid zone)
{
  question q = {crowds, zone};

  return rm_boxtree_query(crowds->tree, crowds->box, box, meet, &q) != 0;
}

/* The faces of this rank in the skin. Not collective. */
static remap_status find_skin(work *w)
{
  const rm_mesh *m = w->mesh[w->side];
  rm_lid        *behind, num = 0;

  for (rm_lid f = 0; f < m->num_faces; f++) num += m->face_is_skin[f];
  RM_TRY(new_boxes(w->scratch, num, &w->skin));
  RM_NEW(behind, w->scratch, num);
  for (rm_lid f = 0; f < m->num_faces; f++) {
    if (!m->face_is_skin[f]) continue;
    double *box = w->skin.box[w->skin.num];

    for (int d = 0; d < 6; d++) box[d] = d < 3 ? INFINITY : -INFINITY;
    for (int64_t k = m->face_offset[f]; k < m->face_offset[f + 1]; k++)
      for (int d = 0; d < 3; d++) {
        box[d]     = fmin(box[d], m->node_xyz[m->face_node[k]][d]);
        box[d + 3] = rm_max(box[d + 3], m->node_xyz[m->face_node[k]][d]);
      }
    w->skin.zone[w->skin.num] = w->zone[m->face_cell[f][0]];
    behind[w->skin.num++]     = m->face_cell[f][0];
  }
  w->behind = behind;
  for (int kind = 0; kind < 2; kind++) RM_NEW0(w->is[kind], w->scratch, m->num_cells);
  return REMAP_OK;
}

/* Cells that meet crowds of foreign skin. Not collective. */
static remap_status find_entered(work *w, const rm_crowds *skin, boxes *out)
{
  const rm_mesh *m   = w->mesh[w->side];
  uint8_t       *is  = w->is[RM_SKINS_ENTERED];
  rm_lid         num = 0;

  for (rm_lid c = 0; c < m->num_cells; c++) num += is[c] = meets_foreign(skin, m->cell_box[c], w->zone[c]);
  RM_TRY(new_boxes(w->scratch, num, out));
  for (rm_lid c = 0; c < m->num_cells; c++) {
    if (!is[c]) continue;
    memcpy(out->box[out->num], m->cell_box[c], sizeof *out->box);
    out->zone[out->num++] = w->zone[c];
  }
  return REMAP_OK;
}

/* Both kinds, or more. Collective. */
static remap_status find_coarsely(work *w)
{
  const rm_mesh *m     = w->mesh[w->side];
  boxes          found = {0, NULL, NULL};
  rm_crowds      skin, entered;

  RM_TRY(find_crowds(w, find_skin(w), &w->skin, m->num_cells, m->cell_box, &skin));
  RM_TRY(find_crowds(w, find_entered(w, &skin, &found), &found, w->skin.num, (const double(*)[6])w->skin.box, &entered));
  for (rm_lid k = 0; k < w->skin.num; k++)
    w->is[RM_SKINS_ENTERING][w->behind[k]] |= meets_foreign(&entered, w->skin.box[k], w->skin.zone[k]);
  return REMAP_OK;
}

/* ---- what the other mesh meets ------------------------------------------------------------------------------------ */

/* The cells of either kind as a mesh of boxes. Not collective. */
static remap_status list_found(const work *w, rm_mesh *found, rm_lid **cell)
{
  const rm_mesh *m = w->mesh[w->side];
  rm_lid         num = 0;
  double(*box)[6];

  for (rm_lid c = 0; c < m->num_cells; c++) num += w->is[0][c] | w->is[1][c];
  RM_NEW(box, w->scratch, num);
  RM_NEW(*cell, w->scratch, num);
  *found = (rm_mesh){.side = m->side, .cell_box = (const double(*)[6])box};
  for (rm_lid c = 0; c < m->num_cells; c++) {
    if (!(w->is[0][c] | w->is[1][c])) continue;
    memcpy(box[found->num_cells], m->cell_box[c], sizeof *box);
    (*cell)[found->num_cells++] = c;
  }
  return REMAP_OK;
}

/* Forget cells that meet none of the other mesh. Collective. */
static remap_status keep_met(work *w)
{
  rm_mesh        found;
  rm_lid        *cell  = NULL;
  const int      other = 1 - w->side;
  const rm_mesh *pair[2], *asked[2] = {&found, w->mesh[other]};
  const rm_zone *zone;
  rm_route       seats[2], met;

  RM_TRY(rm_comm_agree(w->comm, list_found(w, &found, &cell), NULL));
  pair[w->side] = &found, pair[other] = w->mesh[other];
  RM_TRY(rm_zone_build(w->scratch, w->comm, pair, &zone));
  RM_TRY(rm_part_route_evenly(w->scratch, w->comm, w->frame, pair, zone, seats));
  const rm_zone queried = {{zone->num_cells[w->side], 0}, {zone->cell[w->side], NULL}};

  RM_TRY(rm_part_touch(w->scratch, w->comm, asked, &queried, &seats[other], &met, w->reason));
  for (int64_t k = 0; k < met.offset[w->comm->size]; k++)
    for (int kind = 0; kind < 2; kind++) w->is[kind][cell[met.cell[k]]] |= 2;
  for (int kind = 0; kind < 2; kind++)
    for (rm_lid c = 0; c < w->mesh[w->side]->num_cells; c++) w->is[kind][c] = w->is[kind][c] == 3;
  return REMAP_OK;
}

/* ---- together ----------------------------------------------------------------------------------------------------- */

/* The cells of each kind. Not collective. */
static remap_status list_kinds(work *w)
{
  const rm_lid num_cells = w->mesh[w->side]->num_cells;

  for (int kind = 0; kind < 2; kind++) {
    for (rm_lid c = 0; c < num_cells; c++) w->num[kind] += w->is[kind][c];
    RM_NEW(w->cell[kind], w->scratch, w->num[kind]);
    w->num[kind] = 0;
    for (rm_lid c = 0; c < num_cells; c++)
      if (w->is[kind][c]) w->cell[kind][w->num[kind]++] = c;
  }
  return REMAP_OK;
}

/* Entered cells are shared out evenly; those behind skin go where they meet some. Collective. */
static remap_status find_routes(work *w)
{
  const rm_mesh *const twice[2] = {w->mesh[w->side], w->mesh[w->side]};
  const rm_zone        entering = {{w->num[RM_SKINS_ENTERING], 0}, {w->cell[RM_SKINS_ENTERING], NULL}};
  rm_zone              entered  = {{0, 0}, {NULL, NULL}};
  rm_route             seats[2];

  entered.num_cells[w->side] = w->num[RM_SKINS_ENTERED];
  entered.cell[w->side]      = w->cell[RM_SKINS_ENTERED];
  RM_TRY(rm_part_route_evenly(w->scratch, w->comm, w->frame, twice, &entered, seats));
  w->route[RM_SKINS_ENTERED] = seats[w->side];
  return rm_part_touch(w->scratch, w->comm, twice, &entering, &seats[w->side], &w->route[RM_SKINS_ENTERING], w->reason);
}

/* Send cells of one kind, and their zones. Collective. */
static remap_status send(rm_arena *arena, const work *w, int kind, rm_skins *out)
{
  const rm_route *route   = &w->route[kind];
  const int64_t   num     = route->offset[w->comm->size];
  rm_lid         *zone    = rm_arena_alloc(w->scratch, num, sizeof *zone);
  int64_t        *arrived = rm_arena_alloc(w->scratch, (int64_t)w->comm->size + 1, sizeof *arrived);
  void           *zones;

  RM_TRY(rm_comm_agree(w->comm, zone && arrived ? REMAP_OK : REMAP_NO_MEMORY, NULL));
  RM_ASSERT(zone && arrived);
  for (int64_t k = 0; k < num; k++) zone[k] = w->zone[route->cell[k]];
  RM_TRY(rm_part_ship(arena, w->scratch, w->comm, w->mesh[w->side], route, &out->piece[kind], w->reason));
  RM_TRY(rm_comm_exchange(w->comm, arena, sizeof *zone, route->offset, zone, arrived, &zones));
  out->zone[kind] = zones;
  return REMAP_OK;
}

static remap_status skins(rm_arena *arena, work *w, rm_skins *out)
{
  int64_t num[2];

  RM_TRY(find_coarsely(w));
  RM_TRY(keep_met(w));
  RM_TRY(rm_comm_agree(w->comm, list_kinds(w), NULL));
  for (int kind = 0; kind < 2; kind++) num[kind] = w->num[kind];
  RM_TRY(rm_comm_max_i64(w->comm, num, 2));
  if (num[0] == 0 || num[1] == 0) return REMAP_OK;
  out->any = true;
  RM_TRY(find_routes(w));
  for (int kind = 0; kind < 2; kind++) RM_TRY(send(arena, w, kind, out));
  return REMAP_OK;
}

remap_status rm_part_skins(rm_arena *arena, const rm_comm *comm, const rm_frame *frame, const rm_mesh *const mesh[2], int side,
                           const rm_lid *zone, rm_skins *out, rm_reason *reason)
{
  rm_arena    *scratch = rm_arena_new();
  work         w       = {.scratch = scratch, .comm = comm, .frame = frame, .mesh = mesh, .side = side, .zone = zone,
                          .reason = reason};
  remap_status status;

  *out = (rm_skins){.any = false};
  RM_GOTO(done, status = rm_comm_agree(comm, scratch ? REMAP_OK : REMAP_NO_MEMORY, NULL));
  status = skins(arena, &w, out);
done:
  rm_arena_drop(scratch);
  return status;
}
