/* stencil -- vertex neighbours of every cell, here and on other ranks, and their least-squares weights.
 *
 * Cells of one rank meet at nodes. Cells of other ranks are found in three exchanges: a node that lies in a crowd of another
 * rank's cells is announced to the rank its coordinates hash to; that rank tells all who announced the same point of each
 * other; those send each other the cells around it. Nodes are told apart by coordinates alone, so what is found does not
 * depend on the partition. O(n) time; for hexahedra, about 150 bytes per cell and 620 more with weights.
 *
 * Around the axis of a mesh of revolution, and wherever else very many cells meet at one node, all with all would be n^2. Of
 * the cells at such a node, in canonical order, each has as neighbours those next to it, which are mostly near it in space, and
 * some that are spread over all, so that the distances span space as well as all of them do: a choice by coordinates alone. */
#include "field_private.h"

#include <stdlib.h>

/* A node with more cells than CROWD, which are more than meshes have around inner vertices, is crowded; of its cells each sees
 * NEXT on either side in canonical order, and SPREAD of all, or a few less. */
enum { CROWD = 512, NEXT = 32, SPREAD = 64 };

/* A node, at the rank its coordinates hash to. */
typedef struct announcement {
  double  xyz[3];
  int64_t node;
} announcement;

/* "Your node is that node of another rank." */
typedef struct meeting {
  rm_lid  node, other_node;
  int32_t other_rank;
} meeting;

/* A cell of another rank around a node of this one. */
typedef struct visitor {
  double centroid[3], volume;
  rm_gid global;
  rm_lid node, cell;
} visitor;

/* What the build hands from step to step; all of it lives in the scratch arena. */
typedef struct draft {
  rm_arena      *arena, *scratch;
  const rm_comm *comm;
  const rm_mesh *mesh;
  const uint8_t *takes_part;       /* [num_cells] 0: nobody's neighbour; NULL: all are */
  int64_t       *node_cell_offset; /* [num_nodes + 1] */
  rm_lid        *node_cell;        /* cells that take part */
  int64_t       *node_halo_offset; /* [num_nodes + 1] */
  rm_lid        *node_halo;        /* num_cells + place in the halo */
  int           *halo_rank;        /* [num_halo] */
  rm_lid        *halo_cell;
  int64_t       *crowd_offset; /* [num_nodes + 1] */
  rm_lid        *crowd;        /* of crowded nodes: places of all their cells in the canonical order, ascending */
  rm_lid         num_all; /* own cells, then the halo: */
  double (*centroid)[3];  /* [num_all]                 */
  double *volume;
  rm_gid *global;
} draft;

/* ---- the nodes of cells ---------------------------------------------------------------------------------------- */

/* List a cell's nodes, each once; last_cell [num_nodes] holds 1 + the cell that took a node last. NULL out: count only. */
static int64_t nodes_of_cell(const rm_mesh *mesh, rm_lid cell, rm_lid *last_cell, rm_lid *out)
{
  int64_t num = 0;

  for (int64_t i = mesh->cell_face_offset[cell]; i < mesh->cell_face_offset[cell + 1]; i++) {
    const rm_lid face = mesh->cell_face[i];

    for (int64_t k = mesh->face_offset[face]; k < mesh->face_offset[face + 1]; k++) {
      const rm_lid node = mesh->face_node[k];

      if (last_cell[node] == cell + 1) continue;
      last_cell[node] = cell + 1;
      if (out) out[num] = node;
      num++;
    }
  }
  return num;
}

static bool takes_part(const draft *d, rm_lid cell) { return !d->takes_part || d->takes_part[cell]; }

static remap_status list_nodes(draft *d, rm_stencil *stencil)
{
  const rm_mesh *mesh = d->mesh;
  int64_t       *offset, *next;
  rm_lid        *node, *last_cell;

  RM_NEW(offset, d->arena, (int64_t)mesh->num_cells + 1);
  RM_NEW0(last_cell, d->scratch, mesh->num_nodes);
  for (rm_lid c = 0; c < mesh->num_cells; c++) offset[c] = nodes_of_cell(mesh, c, last_cell, NULL);
  rm_offsets(offset, mesh->num_cells);
  RM_NEW(node, d->arena, offset[mesh->num_cells]);
  for (rm_lid k = 0; k < mesh->num_nodes; k++) last_cell[k] = 0;
  for (rm_lid c = 0; c < mesh->num_cells; c++) nodes_of_cell(mesh, c, last_cell, node + offset[c]);

  RM_NEW0(d->node_cell_offset, d->scratch, (int64_t)mesh->num_nodes + 1);
  RM_NEW(d->node_cell, d->scratch, offset[mesh->num_cells]);
  RM_NEW(next, d->scratch, mesh->num_nodes);
  for (rm_lid c = 0; c < mesh->num_cells; c++)
    for (int64_t k = offset[c]; k < offset[c + 1] && takes_part(d, c); k++) d->node_cell_offset[node[k]]++;
  rm_offsets(d->node_cell_offset, mesh->num_nodes);
  for (rm_lid k = 0; k < mesh->num_nodes; k++) next[k] = d->node_cell_offset[k];
  for (rm_lid c = 0; c < mesh->num_cells; c++)
    for (int64_t k = offset[c]; k < offset[c + 1] && takes_part(d, c); k++) d->node_cell[next[node[k]]++] = c;
  stencil->num_cells   = mesh->num_cells;
  stencil->node_offset = offset;
  stencil->node        = node;
  return REMAP_OK;
}

/* ---- cells of other ranks -------------------------------------------------------------------------------------- */

/* The nodes that another rank may hold too, grouped by the rank their coordinates hash to. */
static remap_status pack_announcements(draft *d, const rm_crowds *crowds, int64_t *offset, announcement **out)
{
  const rm_comm *comm = d->comm;
  const rm_mesh *mesh = d->mesh;
  const double(*box)[6] = crowds->box + crowds->num_own; /* of other ranks */
  const rm_boxtree *tree;
  rm_lid           *to, *node; /* [num_nodes] where a node is announced, -1: nowhere; the nodes by that */

  RM_TRY(rm_boxtree_build(d->scratch, crowds->num - crowds->num_own, box, &tree));
  RM_NEW(to, d->scratch, mesh->num_nodes);
  RM_NEW(node, d->scratch, mesh->num_nodes);
  for (rm_lid k = 0; k < mesh->num_nodes; k++) {
    const double *x = mesh->node_xyz[k], point[6] = {x[0], x[1], x[2], x[0], x[1], x[2]};

    to[k] = rm_boxtree_meets(tree, box, point) ? (rm_lid)(rm_hash_point(x) % (uint64_t)comm->size) : -1;
  }
  const int64_t num = rm_group(mesh->num_nodes, to, comm->size, offset, node);
  RM_NEW(*out, d->scratch, num);
  for (int64_t k = 0; k < num; k++) {
    const double *x = mesh->node_xyz[node[k]];

    (*out)[k] = (announcement){{x[0], x[1], x[2]}, node[k]};
  }
  return REMAP_OK;
}

static bool same_point(const double a[3], const double b[3]) { return a[0] == b[0] && a[1] == b[1] && a[2] == b[2]; }

/* Call for each two announcements of one point: count, or write at next[] of the rank that is told. */
static void introduce(const announcement *heard, const rm_keyed *by_hash, int64_t n, const int *sender, int64_t *next,
                      meeting *out)
{
  for (int64_t first = 0, end; first < n; first = end) {
    for (end = first; end < n && by_hash[end].key == by_hash[first].key; end++) continue;
    for (int64_t a = first; a < end; a++)
      for (int64_t b = first; b < end; b++) {
        const int64_t told = by_hash[a].item, other = by_hash[b].item;

        if (sender[told] == sender[other] || !same_point(heard[told].xyz, heard[other].xyz)) continue;
        if (out)
          out[next[sender[told]]] = (meeting){(rm_lid)heard[told].node, (rm_lid)heard[other].node, (int32_t)sender[other]};
        next[sender[told]]++;
      }
  }
}

/* At the rank that heard: who announced the same point, grouped by the rank to be told. */
static remap_status pack_meetings(draft *d, const int64_t *heard_offset, const announcement *heard, int64_t *offset,
                                  meeting **out)
{
  const rm_comm *comm = d->comm;
  const int64_t  n    = heard_offset[comm->size];
  rm_keyed      *by_hash, *spare;
  int           *sender;
  int64_t       *next;

  RM_NEW(by_hash, d->scratch, n);
  RM_NEW(spare, d->scratch, n);
  RM_NEW(sender, d->scratch, n);
  RM_NEW(next, d->scratch, comm->size);
  for (int r = 0; r < comm->size; r++)
    for (int64_t k = heard_offset[r]; k < heard_offset[r + 1]; k++) {
      sender[k]  = r;
      by_hash[k] = (rm_keyed){rm_hash_point(heard[k].xyz), k};
    }
  rm_sort_keyed(by_hash, spare, n);
  for (int r = 0; r <= comm->size; r++) offset[r] = 0;
  introduce(heard, by_hash, n, sender, offset, NULL);
  rm_offsets(offset, comm->size);
  RM_NEW(*out, d->scratch, offset[comm->size]);
  for (int r = 0; r < comm->size; r++) next[r] = offset[r];
  introduce(heard, by_hash, n, sender, next, *out);
  return REMAP_OK;
}

/* The cells around the nodes of this rank that others hold too, grouped by those others. */
static remap_status pack_visitors(draft *d, const meeting *told, int64_t num_told, int64_t *offset, visitor **out)
{
  const rm_comm *comm = d->comm;
  const rm_mesh *mesh = d->mesh;
  int64_t       *next;

  RM_NEW(next, d->scratch, comm->size);
  for (int r = 0; r <= comm->size; r++) offset[r] = 0;
  for (int64_t k = 0; k < num_told; k++)
    offset[told[k].other_rank] += d->node_cell_offset[told[k].node + 1] - d->node_cell_offset[told[k].node];
  rm_offsets(offset, comm->size);
  RM_NEW(*out, d->scratch, offset[comm->size]);
  for (int r = 0; r < comm->size; r++) next[r] = offset[r];
  for (int64_t k = 0; k < num_told; k++)
    for (int64_t i = d->node_cell_offset[told[k].node]; i < d->node_cell_offset[told[k].node + 1]; i++) {
      const rm_lid  cell = d->node_cell[i];
      const double *c    = mesh->cell_centroid[cell];

      (*out)[next[told[k].other_rank]++] = (visitor){.centroid = {c[0], c[1], c[2]},
                                                     .volume   = mesh->cell_volume[cell],
                                                     .global   = mesh->cell_global[cell],
                                                     .node     = told[k].other_node,
                                                     .cell     = cell};
    }
  return REMAP_OK;
}

/* Own cells' geometry, then each visiting cell once, by rank and number there; and the halo cells around each node. */
static remap_status list_halo(draft *d, const int64_t *offset, const visitor *came)
{
  const rm_mesh *mesh = d->mesh;
  const int64_t  n    = offset[d->comm->size];
  rm_keyed      *keyed, *spare;
  rm_lid        *halo_of, *node, *order; /* [n] */
  int64_t        num = 0;

  if (n > INT32_MAX) return REMAP_TOO_LARGE;
  RM_NEW(keyed, d->scratch, n);
  RM_NEW(spare, d->scratch, n);
  RM_NEW(halo_of, d->scratch, n);
  RM_NEW(node, d->scratch, n);
  RM_NEW(order, d->scratch, n);
  for (int r = 0; r < d->comm->size; r++)
    for (int64_t k = offset[r]; k < offset[r + 1]; k++) keyed[k] = (rm_keyed){(uint64_t)r << 32 | (uint64_t)came[k].cell, k};
  rm_sort_keyed(keyed, spare, n);
  for (int64_t k = 0; k < n; k++) num += k == 0 || keyed[k].key != keyed[k - 1].key;
  if (num > INT32_MAX - mesh->num_cells) return REMAP_TOO_LARGE;
  d->num_all = mesh->num_cells + (rm_lid)num;
  RM_NEW(d->halo_rank, d->scratch, num);
  RM_NEW(d->halo_cell, d->scratch, num);
  RM_NEW(d->centroid, d->scratch, d->num_all);
  RM_NEW(d->volume, d->scratch, d->num_all);
  RM_NEW(d->global, d->scratch, d->num_all);
  for (rm_lid c = 0; c < mesh->num_cells; c++) {
    for (int i = 0; i < 3; i++) d->centroid[c][i] = mesh->cell_centroid[c][i];
    d->volume[c] = mesh->cell_volume[c];
    d->global[c] = mesh->cell_global[c];
  }
  num = 0;
  for (int64_t k = 0; k < n; k++) {
    const visitor *v = &came[keyed[k].item];
    rm_lid         all;

    num += k == 0 || keyed[k].key != keyed[k - 1].key;
    all                    = mesh->num_cells + (rm_lid)(num - 1);
    halo_of[keyed[k].item] = all;
    d->halo_rank[num - 1]  = (int)(keyed[k].key >> 32);
    d->halo_cell[num - 1]  = v->cell;
    for (int i = 0; i < 3; i++) d->centroid[all][i] = v->centroid[i];
    d->volume[all] = v->volume;
    d->global[all] = v->global;
  }
  RM_NEW(d->node_halo_offset, d->scratch, (int64_t)mesh->num_nodes + 1);
  RM_NEW(d->node_halo, d->scratch, n);
  for (int64_t k = 0; k < n; k++) node[k] = came[k].node;
  rm_group(n, node, mesh->num_nodes, d->node_halo_offset, order);
  for (int64_t k = 0; k < n; k++) d->node_halo[k] = halo_of[order[k]];
  return REMAP_OK;
}

/* Find the cells of other ranks that share nodes with this one's. Collective. */
static remap_status meet_other_ranks(draft *d)
{
  const rm_comm *comm        = d->comm;
  int64_t       *send_offset = rm_arena_alloc(d->scratch, (int64_t)comm->size + 1, sizeof *send_offset);
  int64_t       *recv_offset = rm_arena_alloc(d->scratch, (int64_t)comm->size + 1, sizeof *recv_offset);
  const rm_mesh *mesh        = d->mesh;
  rm_crowds      crowds;
  announcement  *announced = NULL;
  meeting       *met       = NULL;
  visitor       *visitors  = NULL;
  void          *recv      = NULL;

  RM_TRY(rm_comm_agree(comm, send_offset && recv_offset ? REMAP_OK : REMAP_NO_MEMORY, NULL));
  RM_ASSERT(send_offset && recv_offset);
  RM_TRY(rm_crowds_meet(d->scratch, comm, mesh->num_cells, mesh->cell_box, mesh->num_cells, mesh->cell_box, RM_SOME_CROWDS,
                        &crowds));
  RM_TRY(rm_comm_agree(comm, pack_announcements(d, &crowds, send_offset, &announced), NULL));
  RM_TRY(rm_comm_exchange(comm, d->scratch, sizeof *announced, send_offset, announced, recv_offset, &recv));
  RM_TRY(rm_comm_agree(comm, pack_meetings(d, recv_offset, recv, send_offset, &met), NULL));
  RM_TRY(rm_comm_exchange(comm, d->scratch, sizeof *met, send_offset, met, recv_offset, &recv));
  RM_TRY(rm_comm_agree(comm, pack_visitors(d, recv, recv_offset[comm->size], send_offset, &visitors), NULL));
  RM_TRY(rm_comm_exchange(comm, d->scratch, sizeof *visitors, send_offset, visitors, recv_offset, &recv));
  return rm_comm_agree(comm, list_halo(d, recv_offset, recv), NULL);
}

/* ---- neighbours ------------------------------------------------------------------------------------------------ */

static int compare_lids(const void *a, const void *b)
{
  const rm_lid x = *(const rm_lid *)a, y = *(const rm_lid *)b;

  return (x > y) - (x < y);
}

static void sort_lids(rm_lid *data, int64_t n)
{
  if (n > 64) {
    qsort(data, (size_t)n, sizeof *data, compare_lids);
    return;
  }
  for (int64_t i = 1; i < n; i++) {
    const rm_lid x = data[i];
    int64_t      k = i;

    for (; k > 0 && data[k - 1] > x; k--) data[k] = data[k - 1];
    data[k] = x;
  }
}

/* How many cells there are at a node, of all ranks. */
static int64_t num_at(const draft *d, rm_lid node)
{
  return d->node_cell_offset[node + 1] - d->node_cell_offset[node] + d->node_halo_offset[node + 1] - d->node_halo_offset[node];
}

/* Cell k of those at a node: own ones, then the halo's. */
static rm_lid cell_at(const draft *d, rm_lid node, int64_t k)
{
  const int64_t own = d->node_cell_offset[node + 1] - d->node_cell_offset[node];

  return k < own ? d->node_cell[d->node_cell_offset[node] + k] : d->node_halo[d->node_halo_offset[node] + k - own];
}

/* List the cells at crowded nodes. O(nodes + n log n) for n cells there. */
static remap_status list_crowds(draft *d, const rm_lid *place)
{
  const rm_lid n = d->mesh->num_nodes;

  RM_NEW(d->crowd_offset, d->scratch, (int64_t)n + 1);
  for (rm_lid v = 0; v < n; v++) d->crowd_offset[v] = num_at(d, v) > CROWD ? num_at(d, v) : 0;
  rm_offsets(d->crowd_offset, n);
  RM_NEW(d->crowd, d->scratch, d->crowd_offset[n]);
  for (rm_lid v = 0; v < n; v++) {
    const int64_t first = d->crowd_offset[v], num = d->crowd_offset[v + 1] - first;

    for (int64_t k = 0; k < num; k++) d->crowd[first + k] = place[cell_at(d, v, k)];
    sort_lids(d->crowd + first, num);
  }
  return REMAP_OK;
}

/* Where a place stands in an ascending list, or would stand. */
static int64_t find_lid(const rm_lid *list, int64_t n, rm_lid wanted)
{
  int64_t low = 0;

  while (n > 0) {
    const int64_t half = n / 2;

    if (list[low + half] < wanted) low += half + 1, n -= half + 1;
    else n = half;
  }
  return low;
}

/* A list of neighbours in the making, of a cell: places in the canonical order, each once. */
typedef struct listing {
  rm_lid  cell, *last_cell; /* [num_all] by place: 1 + the cell that took it last */
  rm_lid *out;              /* NULL: they are only counted */
  int64_t num;
} listing;

static void take(listing *l, rm_lid place)
{
  if (l->last_cell[place] == l->cell + 1) return;
  l->last_cell[place] = l->cell + 1;
  if (l->out) l->out[l->num] = place;
  l->num++;
}

/* Of the cells at a crowded node, which stand at `crowd`: those next to place `own`, and one in so many. */
static void take_of_crowd(listing *l, const rm_lid *crowd, int64_t num, rm_lid own)
{
  const int64_t at = find_lid(crowd, num, own), step = (num + SPREAD - 1) / SPREAD;

  for (int64_t k = at > NEXT ? at - NEXT : 0; k < num && k <= at + NEXT; k++) take(l, crowd[k]);
  for (int64_t k = 0; k < num; k += step) take(l, crowd[k]);
}

/* List the neighbours of a cell as places in the canonical order. last_cell is [num_all], out has room; NULL: count only. */
static int64_t neighbours_of_cell(const draft *d, const rm_stencil *stencil, rm_lid cell, const rm_lid *place,
                                  rm_lid *last_cell, rm_lid *out)
{
  listing l = {.cell = cell, .last_cell = last_cell, .out = out};

  last_cell[place[cell]] = cell + 1;
  for (int64_t i = stencil->node_offset[cell]; i < stencil->node_offset[cell + 1]; i++) {
    const rm_lid  node  = stencil->node[i];
    const int64_t first = d->crowd_offset[node], num = d->crowd_offset[node + 1] - first;

    if (num > 0)
      take_of_crowd(&l, d->crowd + first, num, place[cell]);
    else
      for (int64_t k = 0; k < num_at(d, node); k++) take(&l, place[cell_at(d, node, k)]);
  }
  return l.num;
}

/* Of the halo cells only those stay that are neighbours: of crowded nodes, few. neighbour [offset[num_cells]] gets their new
 * numbers. */
static remap_status keep_used(draft *d, rm_stencil *stencil, rm_lid *neighbour)
{
  const rm_lid  own = stencil->num_cells, num = d->num_all - own;
  const int64_t n = stencil->offset[own];
  rm_lid       *new_of; /* [num] 1 + the new number, 0: nobody's neighbour */
  double(*centroid)[3];

  RM_NEW0(new_of, d->scratch, num);
  for (int64_t k = 0; k < n; k++)
    if (neighbour[k] >= own) new_of[neighbour[k] - own] = 1;
  for (rm_lid h = 0; h < num; h++) {
    if (new_of[h] == 0) continue;
    d->halo_rank[stencil->num_halo] = d->halo_rank[h];
    d->halo_cell[stencil->num_halo] = d->halo_cell[h];
    new_of[h]                       = ++stencil->num_halo;
  }
  RM_NEW(centroid, d->arena, stencil->num_halo);
  for (rm_lid h = 0; h < num; h++)
    for (int i = 0; i < 3 && new_of[h] > 0; i++) centroid[new_of[h] - 1][i] = d->centroid[own + h][i];
  for (int64_t k = 0; k < n; k++)
    if (neighbour[k] >= own) neighbour[k] = own + new_of[neighbour[k] - own] - 1;
  stencil->halo_centroid = (const double(*)[3])centroid;
  return REMAP_OK;
}

static remap_status list_neighbours(draft *d, const rm_frame *frame, rm_stencil *stencil)
{
  const rm_lid n = stencil->num_cells;
  rm_lid      *order, *place, *last_cell, *neighbour;
  int64_t     *offset;

  RM_NEW(order, d->scratch, d->num_all);
  RM_NEW(place, d->scratch, d->num_all);
  RM_NEW0(last_cell, d->scratch, d->num_all);
  RM_NEW(offset, d->arena, (int64_t)n + 1);
  RM_TRY(rm_canonical_order(d->scratch, frame, d->num_all, (const double(*)[3])d->centroid, d->volume, d->global, order));
  for (rm_lid k = 0; k < d->num_all; k++) place[order[k]] = k;
  RM_TRY(list_crowds(d, place));
  for (rm_lid c = 0; c < n; c++) offset[c] = neighbours_of_cell(d, stencil, c, place, last_cell, NULL);
  rm_offsets(offset, n);
  RM_NEW(neighbour, d->arena, offset[n]);
  for (rm_lid k = 0; k < d->num_all; k++) last_cell[k] = 0;
  for (rm_lid c = 0; c < n; c++) {
    rm_lid       *list = neighbour + offset[c];
    const int64_t num  = neighbours_of_cell(d, stencil, c, place, last_cell, list);

    sort_lids(list, num);
    for (int64_t k = 0; k < num; k++) list[k] = order[list[k]];
  }
  stencil->offset    = offset;
  stencil->neighbour = neighbour;
  return keep_used(d, stencil, neighbour);
}

remap_status rm_stencil_build(rm_arena *arena, const rm_comm *comm, const rm_frame *frame, const rm_mesh *mesh,
                              const uint8_t *takes, const rm_stencil **out)
{
  rm_stencil  *stencil = rm_arena_zero(arena, 1, sizeof *stencil);
  draft        d       = {.arena = arena, .scratch = rm_arena_new(), .comm = comm, .mesh = mesh, .takes_part = takes};
  remap_status status  = stencil && d.scratch ? REMAP_OK : REMAP_NO_MEMORY;

  if (status == REMAP_OK) status = list_nodes(&d, stencil);
  RM_GOTO(done, status = rm_comm_agree(comm, status, NULL));
  RM_GOTO(done, status = meet_other_ranks(&d));
  RM_GOTO(done, status = rm_comm_agree(comm, list_neighbours(&d, frame, stencil), NULL));
  RM_GOTO(done, status = rm_plan_build(comm, arena, stencil->num_halo, d.halo_rank, d.halo_cell, &stencil->plan));
  *out = stencil;
done:
  rm_arena_drop(d.scratch);
  return status;
}

/* ---- weights ---------------------------------------------------------------------------------------------------- */

static const double *centroid_of(const rm_stencil *stencil, const rm_mesh *mesh, rm_lid cell)
{
  return cell < stencil->num_cells ? mesh->cell_centroid[cell] : stencil->halo_centroid[cell - stencil->num_cells];
}

/* What rounding leaves of the distances around a cell: centroids are good to a few units of their own last place. */
static rm_distance_noise noise_of_cell(const rm_stencil *stencil, const rm_mesh *mesh, rm_lid cell)
{
  const double     *box = mesh->cell_box[cell];
  rm_distance_noise noise;

  for (int c = 0; c < 3; c++) {
    double largest = fabs(mesh->cell_centroid[cell][c]);

    for (int64_t k = stencil->offset[cell]; k < stencil->offset[cell + 1]; k++)
      largest = fmax(largest, fabs(centroid_of(stencil, mesh, stencil->neighbour[k])[c]));
    noise.coordinate[c] = 0x1p-48 * largest;
    noise.extent[c]     = box[c + 3] - box[c];
  }
  return noise;
}

static remap_status weigh_neighbours(rm_arena *arena, rm_arena *scratch, const rm_mesh *mesh, rm_stencil *stencil)
{
  int64_t most = 0;
  double(*weight)[3], (*distance)[3], *spare;

  for (rm_lid c = 0; c < stencil->num_cells; c++) {
    const int64_t num = stencil->offset[c + 1] - stencil->offset[c];

    if (num > most) most = num;
  }
  RM_NEW(weight, arena, stencil->offset[stencil->num_cells]);
  RM_NEW(distance, scratch, most);
  RM_NEW(spare, scratch, most);
  for (rm_lid c = 0; c < stencil->num_cells; c++) {
    const int64_t           first = stencil->offset[c], num = stencil->offset[c + 1] - first;
    const rm_distance_noise noise = noise_of_cell(stencil, mesh, c);

    for (int64_t k = 0; k < num; k++)
      for (int i = 0; i < 3; i++)
        distance[k][i] = centroid_of(stencil, mesh, stencil->neighbour[first + k])[i] - mesh->cell_centroid[c][i];
    rm_leastsq_weights(num, distance, &noise, spare, weight + first);
  }
  stencil->weight = (const double(*)[3])weight;
  return REMAP_OK;
}

remap_status rm_stencil_weigh(rm_arena *arena, const rm_mesh *mesh, const rm_stencil *stencil, const rm_stencil **out)
{
  rm_arena    *scratch = rm_arena_new();
  rm_stencil  *weighed = rm_arena_alloc(arena, 1, sizeof *weighed);
  remap_status status  = scratch && weighed ? REMAP_OK : REMAP_NO_MEMORY;

  if (weighed) *weighed = *stencil;
  if (status == REMAP_OK) status = weigh_neighbours(arena, scratch, mesh, weighed);
  if (status == REMAP_OK) *out = weighed;
  rm_arena_drop(scratch);
  return status;
}
