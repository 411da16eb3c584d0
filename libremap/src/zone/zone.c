/* zone -- each rank groups its cells of each mesh into at most RM_ZONE_BOXES boxes, all ranks gather them, and a cell is
 * listed if its box meets a box of the other mesh. Every cell of the other mesh lies in one of the boxes, so a cell that is
 * left out meets none of them. O(n log B) time for n cells here and B boxes. */
#include "zone/zone.h"

/* The groups of one mesh: first this rank's, then, gathered, everybody's. */
typedef struct groups {
  double         mine[RM_ZONE_BOXES][6];
  int            num_mine;
  int64_t       *offset;  /* [comm->size + 1] */
  const double (*box)[6]; /* [offset[comm->size]] */
} groups;

/* This rank's groups of both meshes. Not collective. */
static remap_status group(rm_arena *scratch, const rm_comm *comm, const rm_mesh *const mesh[2], groups *all)
{
  for (int side = 0; side < 2; side++) {
    RM_NEW(all[side].offset, scratch, comm->size + 1);
    RM_TRY(rm_box_groups(scratch, mesh[side]->num_cells, mesh[side]->cell_box, rm_zone_boxes(comm->size), all[side].mine,
                         &all[side].num_mine));
  }
  return REMAP_OK;
}

/* Everybody's groups of both meshes. Collective. */
static remap_status gather(rm_arena *scratch, const rm_comm *comm, groups *all)
{
  for (int side = 0; side < 2; side++) {
    groups *g = &all[side];
    void   *box;

    RM_TRY(rm_comm_allgatherv(comm, scratch, g->mine, g->num_mine, sizeof *g->mine, g->offset, &box));
    g->box = box;
  }
  return REMAP_OK;
}

/* List the cells of mesh that meet one of the n boxes. How many they are is known only afterwards: they are collected in
 * scratch and then copied. Not collective. */
static remap_status list_cells(rm_arena *arena, rm_arena *scratch, const rm_mesh *mesh, int64_t n, const double (*box)[6],
                               rm_lid *num_cells, const rm_lid **cell)
{
  const rm_boxtree *tree;
  rm_lid           *found, *list, num = 0;

  RM_REQUIRE(n <= INT32_MAX, REMAP_TOO_LARGE);
  RM_TRY(rm_boxtree_build(scratch, (rm_lid)n, box, &tree));
  RM_NEW(found, scratch, mesh->num_cells);
  for (rm_lid c = 0; c < mesh->num_cells; c++)
    if (rm_boxtree_meets(tree, box, mesh->cell_box[c])) found[num++] = c;
  RM_NEW(list, arena, num);
  for (rm_lid k = 0; k < num; k++) list[k] = found[k];
  *num_cells = num;
  *cell      = list;
  return REMAP_OK;
}

/* The zone: each mesh's cells against the other mesh's groups. Not collective. */
static remap_status list_both(rm_arena *arena, rm_arena *scratch, const rm_comm *comm, const rm_mesh *const mesh[2],
                              const groups *all, const rm_zone **out)
{
  rm_zone *zone;

  RM_NEW(zone, arena, 1);
  for (int side = 0; side < 2; side++) {
    const groups *other = &all[1 - side];

    RM_TRY(list_cells(arena, scratch, mesh[side], other->offset[comm->size], other->box, &zone->num_cells[side],
                      &zone->cell[side]));
  }
  *out = zone;
  return REMAP_OK;
}

remap_status rm_zone_build(rm_arena *arena, const rm_comm *comm, const rm_mesh *const mesh[2], const rm_zone **out)
{
  rm_arena      *scratch = rm_arena_new();
  const rm_zone *zone    = NULL;
  groups         all[2]  = {{.num_mine = 0}, {.num_mine = 0}};
  remap_status   mine    = scratch ? group(scratch, comm, mesh, all) : REMAP_NO_MEMORY, status;

  RM_GOTO(done, status = rm_comm_agree(comm, mine, NULL));
  RM_ASSERT(mine == REMAP_OK);
  RM_GOTO(done, status = gather(scratch, comm, all));
  mine = list_both(arena, scratch, comm, mesh, all, &zone);
  RM_GOTO(done, status = rm_comm_agree(comm, mine, NULL));
  RM_ASSERT(mine == REMAP_OK && rm_zone_check(zone, mesh) != REMAP_INTERNAL);
  *out = zone;
done:
  rm_arena_drop(scratch);
  return status;
}

/* One side: listed cells ascend, and what lies between two of them meets none of the other mesh's cells on this rank. */
static remap_status check_side(rm_arena *scratch, const rm_zone *zone, int side, const rm_mesh *mesh, const rm_mesh *other)
{
  const rm_boxtree *tree;
  rm_lid            next = 0; /* the first cell that is not yet known to be right */

  RM_TRY(rm_boxtree_build(scratch, other->num_cells, other->cell_box, &tree));
  RM_REQUIRE(zone->num_cells[side] >= 0, REMAP_INTERNAL);
  for (rm_lid k = 0; k <= zone->num_cells[side]; k++) {
    const rm_lid listed = k < zone->num_cells[side] ? zone->cell[side][k] : mesh->num_cells;

    RM_REQUIRE(listed >= next && (k == zone->num_cells[side] || listed < mesh->num_cells), REMAP_INTERNAL);
    for (; next < listed; next++)
      RM_REQUIRE(!rm_boxtree_meets(tree, other->cell_box, mesh->cell_box[next]), REMAP_INTERNAL);
    next = listed + 1;
  }
  return REMAP_OK;
}

remap_status rm_zone_check(const rm_zone *zone, const rm_mesh *const mesh[2])
{
  rm_arena    *scratch = rm_arena_new();
  remap_status status  = scratch ? REMAP_OK : REMAP_NO_MEMORY;

  for (int side = 0; side < 2 && status == REMAP_OK; side++)
    status = check_side(scratch, zone, side, mesh[side], mesh[1 - side]);
  rm_arena_drop(scratch);
  return status;
}
