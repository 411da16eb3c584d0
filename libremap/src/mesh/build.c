/* build -- one rank's part of a mesh, checked, joined and measured. Stages end in one agreement each; what a stage leaves
 * behind lives in a scratch arena. O(n) time. */
#include "mesh/mesh_private.h"

#include <math.h>
#include <string.h>

/* ---- global ids -------------------------------------------------------------------------------------------------------- */

/* BAD_MESH on every rank if some ranks with cells give ids and others do not. Collective. */
static remap_status agree_on_ids(const rm_mesh_job *job, bool *are_given)
{
  const bool has_cells = job->given->num_cells > 0, has_ids = job->given->cell_global != NULL;
  int64_t    any[2] = {has_cells && has_ids, has_cells && !has_ids};

  RM_TRY(rm_comm_max_i64(job->comm, any, 2));
  *are_given = any[0] != 0;
  if (any[0] && any[1])
    return rm_fail(REMAP_BAD_MESH, job->reason, (int)job->side, -1,
                   "cell_global is given on some ranks and NULL on others: give it on all ranks that have cells, or on none");
  return REMAP_OK;
}

static remap_status fill_ids(const rm_mesh_job *job, rm_arena *arena, rm_gid **out)
{
  rm_gid *id;

  RM_NEW(id, arena, job->given->num_cells);
  for (int64_t c = 0; c < job->given->num_cells; c++) {
    id[c] = rm_mesh_global_of(job->given, job->first_global, c);
    if (id[c] < 0)
      return rm_fail(REMAP_BAD_MESH, job->reason, (int)job->side, -1,
                     "cell %lld of one rank has the global id %lld: ids are not negative", (long long)c, (long long)id[c]);
  }
  *out = id;
  return REMAP_OK;
}

/* Ids by the rank that looks after them. */
static remap_status sort_ids(const rm_mesh_job *job, const rm_gid *id, int64_t **offset, rm_gid **sorted)
{
  const int64_t num  = job->given->num_cells;
  const int     size = job->comm->size;
  rm_lid       *home, *order;

  RM_NEW(home, job->scratch, num);
  RM_NEW(order, job->scratch, num);
  RM_NEW(*offset, job->scratch, (int64_t)size + 1);
  RM_NEW(*sorted, job->scratch, num);
  for (int64_t c = 0; c < num; c++) home[c] = rm_mesh_home_of(rm_hash_word((uint64_t)id[c]), size);
  rm_group(num, home, size, *offset, order);
  for (int64_t c = 0; c < num; c++) (*sorted)[c] = id[order[c]];
  return REMAP_OK;
}

static remap_status find_duplicate(const rm_mesh_job *job, const rm_gid *id, int64_t n)
{
  rm_keyed *list, *spare;

  RM_NEW(list, job->scratch, n);
  RM_NEW(spare, job->scratch, n);
  for (int64_t i = 0; i < n; i++) list[i] = (rm_keyed){(uint64_t)id[i], i};
  rm_sort_keyed(list, spare, n);
  for (int64_t i = 1; i < n; i++)
    if (list[i].key == list[i - 1].key)
      return rm_fail(REMAP_BAD_MESH, job->reason, (int)job->side, (rm_gid)list[i].key,
                     "two cells have this global id: give each cell on one rank only, with an id of its own");
  return REMAP_OK;
}

/* No id twice on any ranks. Collective. */
static remap_status check_ids(const rm_mesh_job *job, const rm_gid *id)
{
  const rm_comm *comm        = job->comm;
  int64_t       *recv_offset = rm_arena_alloc(job->scratch, (int64_t)comm->size + 1, sizeof *recv_offset), *offset = NULL;
  rm_gid        *sorted = NULL;
  void          *recv   = NULL;
  remap_status   status = recv_offset ? sort_ids(job, id, &offset, &sorted) : REMAP_NO_MEMORY;

  RM_TRY(rm_comm_agree(comm, status, NULL));
  RM_TRY(rm_comm_exchange(comm, job->scratch, sizeof *id, offset, sorted, recv_offset, &recv));
  return rm_comm_agree_reason(comm, find_duplicate(job, recv, recv_offset[comm->size]), job->reason);
}

/* ---- the product --------------------------------------------------------------------------------------------------------- */

static bool survives(const rm_loops *loops, rm_lid f) { return loops->cell[f][0] >= 0; }

/* Faces that are left, in the arena; *node_used gets the new number of each node, -1 if no face uses it. */
static remap_status copy_faces(rm_arena *arena, const rm_loops *loops, rm_lid *new_node, rm_mesh *out)
{
  rm_lid   num_faces = 0, num_nodes = 0;
  int64_t  num_corners = 0, *offset;
  rm_lid  *node, (*cell)[2], *given;
  uint8_t *is_skin;

  for (rm_lid f = 0; f < loops->num; f++) {
    if (!survives(loops, f)) continue;
    num_faces++;
    num_corners += loops->offset[f + 1] - loops->offset[f];
  }
  RM_NEW(offset, arena, (int64_t)num_faces + 1);
  RM_NEW(node, arena, num_corners);
  RM_NEW(cell, arena, num_faces);
  RM_NEW(is_skin, arena, num_faces);
  given = NULL; /* numbers ascend: if the last is its place, all are */
  if (num_faces < loops->num || (num_faces > 0 && loops->given[num_faces - 1] >= num_faces)) RM_NEW(given, arena, num_faces);
  memset(new_node, -1, (size_t)loops->num_nodes * sizeof *new_node);
  num_faces = 0;
  offset[0] = num_corners = 0;
  for (rm_lid f = 0; f < loops->num; f++) {
    if (!survives(loops, f)) continue;
    for (int64_t k = loops->offset[f]; k < loops->offset[f + 1]; k++) {
      rm_lid *number = &new_node[loops->node[k]];

      if (*number < 0) *number = num_nodes++;
      node[num_corners++] = *number;
    }
    memcpy(cell[num_faces], loops->cell[f], sizeof cell[num_faces]);
    is_skin[num_faces]  = loops->is_skin[f];
    if (given) given[num_faces] = loops->given[f];
    offset[++num_faces] = num_corners;
  }
  out->num_faces    = num_faces;
  out->num_nodes    = num_nodes;
  out->face_offset  = offset;
  out->face_node    = node;
  out->face_cell    = (const rm_lid(*)[2])cell;
  out->face_is_skin = is_skin;
  out->face_given   = given;
  return REMAP_OK;
}

static remap_status copy_nodes(rm_arena *arena, const rm_loops *loops, const rm_lid *new_node, rm_mesh *out)
{
  double(*xyz)[3];

  RM_NEW(xyz, arena, out->num_nodes);
  for (rm_lid i = 0; i < loops->num_nodes; i++)
    if (new_node[i] >= 0) memcpy(xyz[new_node[i]], loops->xyz[i], sizeof *xyz);
  out->node_xyz = (const double(*)[3])xyz;
  return REMAP_OK;
}

static remap_status check_closed(const rm_mesh_job *job, const rm_mesh *mesh)
{
  const double  scale = job->frame->scale;
  const double *a, *b;
  rm_mesh_open  open;

  RM_TRY(rm_mesh_find_open(job->scratch, mesh, &open));
  if (open.cell < 0) return REMAP_OK;
  a = mesh->node_xyz[open.node[0]];
  b = mesh->node_xyz[open.node[1]];
  return rm_fail(
      REMAP_BAD_MESH, job->reason, (int)job->side, mesh->cell_global[open.cell],
      "it is not closed: its faces do not run as often one way as the other along the edge from (%.9g, %.9g, %.9g) to "
      "(%.9g, %.9g, %.9g): give all its faces, each pointing out of its owner, with nodes on the edges that faces share",
      a[0] / scale, a[1] / scale, a[2] / scale, b[0] / scale, b[1] / scale, b[2] / scale);
}

/* Everything that this rank can do alone once faces have joined. */
static remap_status assemble(const rm_mesh_job *job, rm_arena *arena, const rm_loops *loops, remap_faces faces, rm_mesh *out)
{
  double *volume, (*centroid)[3], (*box)[6];
  rm_lid *new_node;

  RM_NEW(new_node, job->scratch, loops->num_nodes);
  RM_TRY(copy_faces(arena, loops, new_node, out));
  RM_TRY(copy_nodes(arena, loops, new_node, out));
  RM_TRY(rm_mesh_cell_faces(arena, out->num_cells, out->num_faces, out->face_cell, &out->cell_face_offset, &out->cell_face));
  RM_TRY(check_closed(job, out));
  RM_NEW(box, arena, out->num_cells);
  memcpy(box, loops->cell_box, (size_t)out->num_cells * sizeof *box);
  out->cell_box = (const double(*)[6])box;
  RM_NEW(volume, arena, out->num_cells);
  RM_NEW(centroid, arena, out->num_cells);
  RM_TRY(rm_mesh_integrals(job->scratch, out, faces, volume, centroid));
  out->cell_volume   = volume;
  out->cell_centroid = (const double(*)[3])centroid;
  return REMAP_OK;
}

/* The cell of most negative volume over all ranks, the smallest id if several share it; -1 if none is negative. Collective. */
static remap_status find_worst_inverted(const rm_comm *comm, rm_mesh *mesh)
{
  double  lowest = 0.0, everywhere;
  int64_t id     = INT64_MIN; /* negated, so that the smallest wins */

  for (rm_lid c = 0; c < mesh->num_cells; c++) lowest = fmin(lowest, mesh->cell_volume[c]);
  everywhere = lowest;
  RM_TRY(rm_comm_min_f64(comm, &everywhere, 1));
  for (rm_lid c = 0; everywhere < 0.0 && lowest <= everywhere && c < mesh->num_cells; c++)
    if (mesh->cell_volume[c] <= everywhere && -mesh->cell_global[c] > id) id = -mesh->cell_global[c];
  RM_TRY(rm_comm_max_i64(comm, &id, 1));
  mesh->worst_inverted = id == INT64_MIN ? -1 : -id;
  return REMAP_OK;
}

/* Counts and volume of the whole mesh. Collective. */
static remap_status sum_up(const rm_comm *comm, rm_mesh *mesh)
{
  int64_t count[2] = {mesh->num_cells, 0};
  rm_sum  volume;

  rm_sum_clear(&volume);
  for (rm_lid c = 0; c < mesh->num_cells; c++) {
    count[1] += mesh->cell_volume[c] < 0.0;
    rm_sum_add(&volume, fabs(mesh->cell_volume[c]));
  }
  RM_TRY(rm_comm_sum_i64(comm, count, 2));
  RM_TRY(rm_comm_sum_exact(comm, &volume, 1));
  mesh->num_global_cells = count[0];
  mesh->num_inverted     = count[1];
  mesh->volume           = rm_sum_value(&volume);
  return find_worst_inverted(comm, mesh);
}

remap_status rm_mesh_build_in(rm_arena *scratch, rm_arena *arena, const rm_comm *comm, remap_side side, const remap_mesh *given,
                              const rm_frame *frame, remap_faces faces, const rm_mesh **out, rm_reason *reason)
{
  rm_mesh_job job   = {scratch, comm, side, given, frame, 0, reason};
  rm_loops    loops = {0};
  rm_mesh    *mesh;
  rm_gid     *id        = NULL;
  bool        are_given = false;

  RM_TRY(rm_mesh_first_global(comm, given, &job.first_global));
  RM_TRY(rm_comm_agree_reason(comm, rm_mesh_given_check(side, given, job.first_global, reason), reason));
  mesh = scratch ? rm_arena_zero(arena, 1, sizeof *mesh) : NULL;
  RM_TRY(rm_comm_agree(comm, mesh ? REMAP_OK : REMAP_NO_MEMORY, NULL));
  RM_TRY(agree_on_ids(&job, &are_given));
  RM_TRY(rm_comm_agree_reason(comm, fill_ids(&job, arena, &id), reason));
  if (are_given) RM_TRY(check_ids(&job, id));
  RM_TRY(rm_comm_agree_reason(comm, rm_mesh_loops(&job, &loops), reason));
  RM_TRY(rm_mesh_join(&job, id, &loops));

  mesh->side        = side;
  mesh->num_cells   = (rm_lid)given->num_cells;
  mesh->cell_global = id;
  RM_TRY(rm_comm_agree_reason(comm, assemble(&job, arena, &loops, faces, mesh), reason));
  RM_TRY(sum_up(comm, mesh));
  RM_ASSERT(rm_mesh_check(mesh) != REMAP_INTERNAL);
  *out = mesh;
  return REMAP_OK;
}

remap_status rm_mesh_build(rm_arena *arena, const rm_comm *comm, remap_side side, const remap_mesh *given,
                           const rm_frame *frame, remap_faces faces, const rm_mesh **out, rm_reason *reason)
{
  rm_arena    *scratch = rm_arena_new();
  remap_status status  = rm_mesh_build_in(scratch, arena, comm, side, given, frame, faces, out, reason);

  rm_arena_drop(scratch);
  return status;
}
