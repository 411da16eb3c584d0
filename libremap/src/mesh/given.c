/* given -- the caller's arrays, checked before anything is read through them: counts, missing arrays, offsets that do not
 * ascend, indices out of range. One pass over the corners, no memory. */
#include "mesh/mesh_private.h"

rm_gid rm_mesh_global_of(const remap_mesh *given, rm_gid first_global, int64_t cell)
{
  if (cell < 0 || cell >= given->num_cells) return -1;
  return given->cell_global ? given->cell_global[cell] : first_global + cell;
}

remap_status rm_mesh_first_global(const rm_comm *comm, const remap_mesh *given, rm_gid *out)
{
  *out = given->num_cells < 0 ? 0 : given->num_cells > INT32_MAX ? INT32_MAX : given->num_cells;
  return rm_comm_exscan_i64(comm, out);
}

static remap_status check_count(remap_side side, const char *name, int64_t count, rm_reason *reason)
{
  if (count < 0)
    return rm_fail(REMAP_BAD_MESH, reason, (int)side, -1, "%s is %lld on one rank: give a count that is not negative", name,
                   (long long)count);
  if (count > INT32_MAX)
    return rm_fail(REMAP_TOO_LARGE, reason, (int)side, -1, "%s is %lld on one rank, more than it can hold (%d): use more ranks",
                   name, (long long)count, INT32_MAX);
  return REMAP_OK;
}

static remap_status check_array(remap_side side, const char *name, const void *array, int64_t count, rm_reason *reason)
{
  if (array || count == 0) return REMAP_OK;
  return rm_fail(REMAP_BAD_MESH, reason, (int)side, -1, "the array %s is NULL on one rank, for %lld entries: give the array",
                 name, (long long)count);
}

static remap_status check_zones(remap_side side, const remap_mesh *given, rm_reason *reason)
{
  if (given->num_zones < 0)
    return rm_fail(REMAP_BAD_MESH, reason, (int)side, -1, "num_zones is %lld: give a count that is not negative",
                   (long long)given->num_zones);
  RM_TRY(check_array(side, "zone_cell_offset", given->zone_cell_offset, given->num_zones, reason));
  for (int64_t z = 0; z < given->num_zones; z++)
    if (given->zone_cell_offset[z] > given->zone_cell_offset[z + 1])
      return rm_fail(REMAP_BAD_MESH, reason, (int)side, -1, "zone_cell_offset does not ascend at zone %lld: %lld, then %lld",
                     (long long)z, (long long)given->zone_cell_offset[z], (long long)given->zone_cell_offset[z + 1]);
  return REMAP_OK;
}

/* Offsets, so that no loop reaches outside of face_node or is too short. */
static remap_status check_offsets(remap_side side, const remap_mesh *given, rm_gid first_global, rm_reason *reason)
{
  if (given->num_faces > 0 && given->face_offset[0] != 0)
    return rm_fail(REMAP_BAD_MESH, reason, (int)side, -1, "face_offset starts with %lld: it starts with 0",
                   (long long)given->face_offset[0]);
  for (int64_t f = 0; f < given->num_faces; f++) {
    const int64_t begin = given->face_offset[f], end = given->face_offset[f + 1];
    const rm_gid  cell = rm_mesh_global_of(given, first_global, given->face_owner[f]);

    if (end < begin)
      return rm_fail(REMAP_BAD_MESH, reason, (int)side, cell, "face_offset does not ascend at face %lld: %lld, then %lld",
                     (long long)f, (long long)begin, (long long)end);
    if (end - begin < 3)
      return rm_fail(REMAP_BAD_MESH, reason, (int)side, cell, "its face %lld has %lld nodes: give at least 3 or leave it out",
                     (long long)f, (long long)(end - begin));
    if (end - begin > INT32_MAX / 4)
      return rm_fail(REMAP_TOO_LARGE, reason, (int)side, cell, "its face %lld has %lld nodes: split it", (long long)f,
                     (long long)(end - begin));
  }
  return REMAP_OK;
}

/* Cells and nodes of one face are there. */
static remap_status check_face(remap_side side, const remap_mesh *given, rm_gid first_global, int64_t f, rm_reason *reason)
{
  const int64_t owner = given->face_owner[f], neighbour = given->face_neighbour[f];
  const rm_gid  cell = rm_mesh_global_of(given, first_global, owner);

  if (owner < 0 || owner >= given->num_cells)
    return rm_fail(REMAP_BAD_MESH, reason, (int)side, rm_mesh_global_of(given, first_global, neighbour),
                   "face %lld has owner %lld, but the cells of its rank are 0 to %lld: correct face_owner", (long long)f,
                   (long long)owner, (long long)given->num_cells - 1);
  if (neighbour < -1 || neighbour >= given->num_cells)
    return rm_fail(REMAP_BAD_MESH, reason, (int)side, cell,
                   "its face %lld has neighbour %lld, but the cells of its rank are 0 to %lld: correct face_neighbour, "
                   "-1 where there is none",
                   (long long)f, (long long)neighbour, (long long)given->num_cells - 1);
  if (neighbour == owner)
    return rm_fail(REMAP_BAD_MESH, reason, (int)side, cell,
                   "its face %lld has it on both sides: give a face inside a cell twice, once each way, or leave it out",
                   (long long)f);
  for (int64_t k = given->face_offset[f]; k < given->face_offset[f + 1]; k++)
    if (given->face_node[k] < 0 || given->face_node[k] >= given->num_nodes)
      return rm_fail(REMAP_BAD_MESH, reason, (int)side, cell,
                     "its face %lld has node %lld, but the nodes of its rank are 0 to %lld: correct face_node", (long long)f,
                     (long long)given->face_node[k], (long long)given->num_nodes - 1);
  return REMAP_OK;
}

remap_status rm_mesh_given_check(remap_side side, const remap_mesh *given, rm_gid first_global, rm_reason *reason)
{
  RM_TRY(check_count(side, "num_nodes", given->num_nodes, reason));
  RM_TRY(check_count(side, "num_faces", given->num_faces, reason));
  RM_TRY(check_count(side, "num_cells", given->num_cells, reason));
  RM_TRY(check_array(side, "node_xyz", given->node_xyz, given->num_nodes, reason));
  RM_TRY(check_array(side, "face_offset", given->face_offset, given->num_faces, reason));
  RM_TRY(check_array(side, "face_node", given->face_node, given->num_faces, reason));
  RM_TRY(check_array(side, "face_owner", given->face_owner, given->num_faces, reason));
  RM_TRY(check_array(side, "face_neighbour", given->face_neighbour, given->num_faces, reason));
  RM_TRY(check_zones(side, given, reason));
  RM_TRY(check_offsets(side, given, first_global, reason));
  for (int64_t f = 0; f < given->num_faces; f++) RM_TRY(check_face(side, given, first_global, f, reason));
  return REMAP_OK;
}
