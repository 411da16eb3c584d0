/* loops -- the caller's faces as loops over nodes that are unified by coordinates. O(corners) time by hashing; about 30 bytes
 * per node and 6 per corner of scratch memory. */
#include "mesh/mesh_private.h"

#include <math.h>
#include <string.h>

/* Smallest power of two of at least 2 n, for a table that is at most half full. */
static int64_t table_size(int64_t n)
{
  int64_t size = 8;

  while (size < 2 * n) size *= 2;
  return size;
}

/* Which given nodes do faces use? node_of becomes 0 for them, -1 for the others. */
static int64_t mark_used(const remap_mesh *given, rm_lid *node_of)
{
  const int64_t num_corners = given->num_faces > 0 ? given->face_offset[given->num_faces] : 0;
  int64_t       num         = 0;

  memset(node_of, -1, (size_t)given->num_nodes * sizeof *node_of);
  for (int64_t k = 0; k < num_corners; k++) {
    num += node_of[given->face_node[k]] != 0;
    node_of[given->face_node[k]] = 0;
  }
  return num;
}

/* Number of the node at these coordinates, which are added if they are new. */
static rm_lid find_or_add(rm_lid *table, int64_t size, double (*xyz)[3], uint64_t *hash, rm_lid *num, const double point[3])
{
  const uint64_t key = rm_hash_point(point);
  int64_t        at  = (int64_t)(key & (uint64_t)(size - 1));

  for (; table[at] >= 0; at = (at + 1) & (size - 1))
    if (hash[table[at]] == key && memcmp(xyz[table[at]], point, sizeof *xyz) == 0) return table[at];
  memcpy(xyz[*num], point, sizeof *xyz);
  hash[*num]       = key;
  return table[at] = (*num)++;
}

/* Number given nodes by coordinates: node_of [given num_nodes], -1 where no face uses one. */
static remap_status unify_nodes(const rm_mesh_job *job, rm_lid *node_of, rm_loops *out)
{
  const remap_mesh *given = job->given;
  const int64_t     used = mark_used(given, node_of), size = table_size(used);
  rm_lid           *table;
  double(*xyz)[3];
  uint64_t *hash;

  RM_NEW(table, job->scratch, size);
  RM_NEW(xyz, job->scratch, used);
  RM_NEW(hash, job->scratch, used);
  memset(table, -1, (size_t)size * sizeof *table);
  out->num_nodes = 0;
  for (int64_t i = 0; i < given->num_nodes; i++) {
    double point[3];

    if (node_of[i] < 0) continue;
    for (int a = 0; a < 3; a++) point[a] = rm_mesh_to_frame(given->node_xyz[3 * i + a], job->frame->scale);
    node_of[i] = find_or_add(table, size, xyz, hash, &out->num_nodes, point);
  }
  out->xyz       = (const double(*)[3])xyz;
  out->node_hash = hash;
  return REMAP_OK;
}

/* Unified nodes of a loop of n without those that repeat the one before, around the end too. Returns how many are left in out,
 * 0 if fewer than 3 are distinct. */
static int clean_loop(const int64_t *node, int64_t n, const rm_lid *node_of, rm_lid *out)
{
  int num = 0;

  for (int64_t k = 0; k < n; k++)
    if (num == 0 || out[num - 1] != node_of[node[k]]) out[num++] = node_of[node[k]];
  while (num > 1 && out[num - 1] == out[0]) num--;
  for (int k = 2; k < num; k++)
    if (out[k] != out[0] && out[k] != out[1]) return num;
  return 0;
}

static void clean_loops(const remap_mesh *given, const rm_lid *node_of, rm_loops *out)
{
  out->num       = 0;
  out->offset[0] = 0;
  for (int64_t f = 0; f < given->num_faces; f++) {
    const int64_t first = given->face_offset[f];
    const int     left =
        clean_loop(given->face_node + first, given->face_offset[f + 1] - first, node_of, out->node + out->offset[out->num]);

    if (left == 0) continue;
    out->cell[out->num][0]    = (rm_lid)given->face_owner[f];
    out->cell[out->num][1]    = (rm_lid)given->face_neighbour[f];
    out->is_skin[out->num]    = given->face_neighbour[f] < 0;
    out->given[out->num]      = (rm_lid)f;
    out->offset[out->num + 1] = out->offset[out->num] + left;
    out->num++;
  }
}

static void widen(double box[6], const double xyz[3])
{
  for (int a = 0; a < 3; a++) {
    if (xyz[a] < box[a]) box[a] = xyz[a];
    if (xyz[a] > box[a + 3]) box[a + 3] = xyz[a];
  }
}

/* Boxes of the cells, of collapsed faces too: a cell may have no others. */
static remap_status make_boxes(const rm_mesh_job *job, const rm_lid *node_of, rm_loops *out)
{
  const remap_mesh *given = job->given;
  double(*box)[6];

  RM_NEW(box, job->scratch, given->num_cells);
  for (int64_t c = 0; c < given->num_cells; c++)
    for (int a = 0; a < 3; a++) {
      box[c][a]     = INFINITY;
      box[c][a + 3] = -INFINITY;
    }
  for (int64_t f = 0; f < given->num_faces; f++)
    for (int64_t k = given->face_offset[f]; k < given->face_offset[f + 1]; k++) {
      const double *xyz = out->xyz[node_of[given->face_node[k]]];

      widen(box[given->face_owner[f]], xyz);
      if (given->face_neighbour[f] >= 0) widen(box[given->face_neighbour[f]], xyz);
    }
  for (int64_t c = 0; c < given->num_cells; c++)
    if (box[c][0] > box[c][3])
      return rm_fail(REMAP_BAD_MESH, job->reason, (int)job->side, rm_mesh_global_of(given, job->first_global, c),
                     "it has no faces: give its faces or leave the cell out");
  out->cell_box = box;
  return REMAP_OK;
}

remap_status rm_mesh_loops(const rm_mesh_job *job, rm_loops *out)
{
  const remap_mesh *given       = job->given;
  const int64_t     num_corners = given->num_faces > 0 ? given->face_offset[given->num_faces] : 0;
  rm_lid           *node_of;

  RM_NEW(node_of, job->scratch, given->num_nodes);
  RM_NEW(out->offset, job->scratch, given->num_faces + 1);
  RM_NEW(out->node, job->scratch, num_corners);
  RM_NEW(out->cell, job->scratch, given->num_faces);
  RM_NEW(out->is_skin, job->scratch, given->num_faces);
  RM_NEW(out->given, job->scratch, given->num_faces);
  RM_TRY(unify_nodes(job, node_of, out));
  RM_TRY(make_boxes(job, node_of, out));
  clean_loops(given, node_of, out);
  return REMAP_OK;
}
