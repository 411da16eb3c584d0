/* check -- every invariant of a mesh, tested one by one. O(n) time; scratch memory for the nodes and the largest cell. */
#include "mesh/mesh_private.h"

#include <math.h>
#include <string.h>

static bool in_range(rm_lid i, rm_lid lowest, rm_lid end) { return i >= lowest && i < end; }

/* True if no two nodes have the same coordinates. Marks slots of table, [size], by node + 1. */
static bool are_distinct(const rm_mesh *mesh, rm_lid *table, uint64_t size)
{
  for (rm_lid i = 0; i < mesh->num_nodes; i++) {
    uint64_t at = rm_hash_point(mesh->node_xyz[i]) & (size - 1);

    for (; table[at] > 0; at = (at + 1) & (size - 1))
      if (memcmp(mesh->node_xyz[table[at] - 1], mesh->node_xyz[i], sizeof mesh->node_xyz[i]) == 0) return false;
    table[at] = i + 1;
  }
  return true;
}

static remap_status check_nodes(rm_arena *scratch, const rm_mesh *mesh)
{
  uint64_t size = 8;
  rm_lid  *table;

  while (size < 2 * (uint64_t)mesh->num_nodes) size *= 2;
  RM_NEW0(table, scratch, size);
  for (rm_lid i = 0; i < mesh->num_nodes; i++)
    for (int a = 0; a < 3; a++) {
      const double x = fabs(mesh->node_xyz[i][a]);

      RM_REQUIRE(x == 0.0 ? !signbit(mesh->node_xyz[i][a]) : x >= 0x1p-100 && x < 1.0, REMAP_INTERNAL);
    }
  return are_distinct(mesh, table, size) ? REMAP_OK : REMAP_INTERNAL;
}

/* Loops: long enough, nodes in range and not repeated in a row; every node in use. */
static remap_status check_loops(rm_arena *scratch, const rm_mesh *mesh)
{
  rm_lid   num_used = 0;
  uint8_t *used;

  RM_NEW0(used, scratch, mesh->num_nodes);
  RM_REQUIRE(mesh->face_offset[0] == 0, REMAP_INTERNAL);
  for (rm_lid f = 0; f < mesh->num_faces; f++) {
    const rm_lid *loop = mesh->face_node + mesh->face_offset[f];
    const int64_t n    = mesh->face_offset[f + 1] - mesh->face_offset[f];

    RM_REQUIRE(n >= 3, REMAP_INTERNAL);
    for (int64_t k = 0; k < n; k++) {
      RM_REQUIRE(in_range(loop[k], 0, mesh->num_nodes) && loop[k] != loop[(k + 1) % n], REMAP_INTERNAL);
      num_used += !used[loop[k]];
      used[loop[k]] = 1;
    }
  }
  return num_used == mesh->num_nodes ? REMAP_OK : REMAP_INTERNAL;
}

/* Cells of a face and faces of a cell say the same. */
static remap_status check_sides(const rm_mesh *mesh)
{
  int64_t num_sides = 0;

  for (rm_lid f = 0; f < mesh->num_faces; f++) {
    const rm_lid owner = mesh->face_cell[f][0], neighbour = mesh->face_cell[f][1];

    RM_REQUIRE(in_range(owner, 0, mesh->num_cells) && in_range(neighbour, -1, mesh->num_cells), REMAP_INTERNAL);
    RM_REQUIRE(owner != neighbour && !(neighbour >= 0 && mesh->face_is_skin[f]), REMAP_INTERNAL);
    num_sides += 1 + (neighbour >= 0);
  }
  RM_REQUIRE(mesh->cell_face_offset[0] == 0 && mesh->cell_face_offset[mesh->num_cells] == num_sides, REMAP_INTERNAL);
  for (rm_lid c = 0; c < mesh->num_cells; c++)
    for (int64_t i = mesh->cell_face_offset[c]; i < mesh->cell_face_offset[c + 1]; i++) {
      const rm_lid f = mesh->cell_face[i];

      RM_REQUIRE(in_range(f, 0, mesh->num_faces), REMAP_INTERNAL);
      RM_REQUIRE(mesh->face_cell[f][0] == c || mesh->face_cell[f][1] == c, REMAP_INTERNAL);
      RM_REQUIRE(i == mesh->cell_face_offset[c] || mesh->cell_face[i - 1] < f, REMAP_INTERNAL);
    }
  return REMAP_OK;
}

static bool is_inside(const double box[6], const double xyz[3])
{
  for (int a = 0; a < 3; a++)
    if (!(xyz[a] >= box[a] && xyz[a] <= box[a + 3])) return false;
  return true;
}

/* Boxes hold the nodes, volumes and centroids are numbers, ids are not negative. */
static remap_status check_cells(const rm_mesh *mesh)
{
  for (rm_lid c = 0; c < mesh->num_cells; c++) {
    RM_REQUIRE(mesh->cell_global[c] >= 0 && isfinite(mesh->cell_volume[c]), REMAP_INTERNAL);
    for (int a = 0; a < 3; a++) RM_REQUIRE(isfinite(mesh->cell_centroid[c][a]), REMAP_INTERNAL);
    for (int64_t i = mesh->cell_face_offset[c]; i < mesh->cell_face_offset[c + 1]; i++)
      for (int64_t k = mesh->face_offset[mesh->cell_face[i]]; k < mesh->face_offset[mesh->cell_face[i] + 1]; k++)
        RM_REQUIRE(is_inside(mesh->cell_box[c], mesh->node_xyz[mesh->face_node[k]]), REMAP_INTERNAL);
  }
  RM_REQUIRE(mesh->num_global_cells >= mesh->num_cells && mesh->num_inverted >= 0, REMAP_INTERNAL);
  RM_REQUIRE(mesh->num_inverted <= mesh->num_global_cells && mesh->volume >= 0.0, REMAP_INTERNAL);
  return REMAP_OK;
}

static remap_status check_in(rm_arena *scratch, const rm_mesh *mesh)
{
  rm_mesh_open open;

  RM_REQUIRE(scratch, REMAP_NO_MEMORY);
  RM_TRY(check_nodes(scratch, mesh));
  RM_TRY(check_loops(scratch, mesh));
  RM_TRY(check_sides(mesh));
  RM_TRY(check_cells(mesh));
  RM_TRY(rm_mesh_find_open(scratch, mesh, &open));
  return open.cell < 0 ? REMAP_OK : REMAP_INTERNAL;
}

remap_status rm_mesh_check(const rm_mesh *mesh)
{
  rm_arena    *scratch = rm_arena_new();
  remap_status status  = check_in(scratch, mesh);

  rm_arena_drop(scratch);
  return status;
}
