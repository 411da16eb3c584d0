/* zone -- a cell is listed if its box meets a crowd of the other mesh's cells. Every cell of the other mesh lies in one of its
 * rank's crowds, so a cell that is left out meets none of them. O(n log B) time for n cells here and B crowds that are near. */
#include "zone/zone.h"

/* List the cells of mesh that meet a crowd. How many they are is known only afterwards: they are collected in scratch and then
 * copied. Not collective. */
static remap_status list_cells(rm_arena *arena, rm_arena *scratch, const rm_mesh *mesh, const rm_crowds *crowds,
                               rm_lid *num_cells, const rm_lid **cell)
{
  rm_lid *found, *list, num = 0;

  RM_NEW(found, scratch, mesh->num_cells);
  for (rm_lid c = 0; c < mesh->num_cells; c++)
    if (rm_boxtree_meets(crowds->tree, crowds->box, mesh->cell_box[c])) found[num++] = c;
  RM_NEW(list, arena, num);
  for (rm_lid k = 0; k < num; k++) list[k] = found[k];
  *num_cells = num;
  *cell      = list;
  return REMAP_OK;
}

remap_status rm_zone_build(rm_arena *arena, const rm_comm *comm, const rm_mesh *const mesh[2], const rm_zone **out)
{
  rm_arena    *scratch = rm_arena_new();
  rm_zone     *zone    = rm_arena_alloc(arena, 1, sizeof *zone);
  rm_crowds    crowds;
  remap_status mine, status;

  RM_GOTO(done, status = rm_comm_agree(comm, scratch && zone ? REMAP_OK : REMAP_NO_MEMORY, NULL));
  RM_ASSERT(scratch && zone);
  for (int side = 0; side < 2; side++) {
    const rm_mesh *own = mesh[side], *other = mesh[1 - side];

    RM_GOTO(done, status = rm_crowds_meet(scratch, comm, other->num_cells, other->cell_box, own->num_cells, own->cell_box,
                                          RM_SOME_CROWDS, &crowds));
    mine = list_cells(arena, scratch, own, &crowds, &zone->num_cells[side], &zone->cell[side]);
    RM_GOTO(done, status = rm_comm_agree(comm, mine, NULL));
  }
  RM_ASSERT(rm_zone_check(zone, mesh) != REMAP_INTERNAL);
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
