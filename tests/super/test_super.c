/* The supermesh over all ranks: the bits of one rank, whatever the partition and numbering; conformal; volumes that add up; cells that
 * meet nothing passed through; values of cells and faces taken over. */
#include <remap/remap.h>
#include "meshes.h"
#include "rt.h"

enum { UNION = REMAP_IN_BOTH | REMAP_IN_SOURCE | REMAP_IN_TARGET };

typedef struct world {
  remap_context       *ctx;
  tm_mesh             *mine[2];
  remap_supermesh_view v;
} world;

typedef struct plan {
  tm_mesh *(*make)(int side, uint64_t seed);
  uint64_t    seed;
  remap_faces faces;
  remap_supermesh_options options;
  bool        build; /* remap_build comes first */
} plan;

static void open_world(world *w, MPI_Comm comm, const plan *p)
{
  remap_options how;
  int           rank, size;

  MPI_Comm_rank(comm, &rank);
  MPI_Comm_size(comm, &size);
  remap_options_default(&how);
  how.faces = p->faces;
  memset(&w->v, 0, sizeof w->v);
  RT_EQ(remap_create(comm, &how, &w->ctx), REMAP_OK);
  for (int side = 0; side < 2; side++) {
    tm_mesh *whole = p->make(side, p->seed);
    int     *deal  = tm_deal(whole, size, p->seed % 3 ? TM_RANDOM : TM_SLABS, p->seed);

    w->mine[side] = tm_part(whole, deal, rank, size > 1 ? p->seed : 0);
    RT_EQ(remap_set_mesh(w->ctx, side, &w->mine[side]->view), REMAP_OK);
    tm_free(whole), free(deal);
  }
  if (p->build) RT_EQ(remap_build(w->ctx), REMAP_OK);
  if (!RT_EQ(remap_supermesh(w->ctx, &p->options, &w->v), REMAP_OK)) printf("# %s\n", remap_message(w->ctx));
}

static void close_world(world *w)
{
  remap_destroy(&w->ctx);
  for (int side = 0; side < 2; side++) tm_free(w->mine[side]);
}

/* ---- one rank ------------------------------------------------------------------------------------------------------------------ */

typedef struct use {
  int32_t cell, low, high;
  int     way;
} use;
static int by_use(const void *a, const void *b)
{
  const use *x = a, *y = b;
  if (x->cell != y->cell) return x->cell < y->cell ? -1 : 1;
  if (x->low != y->low) return x->low < y->low ? -1 : 1;
  return (x->high > y->high) - (x->high < y->high);
}

/* Numbers are in range and used, cells are closed: each of their edges runs as often one way as the other. */
static void is_a_mesh(const remap_supermesh_view *v)
{
  const int64_t corners = v->num_faces ? v->face_offset[v->num_faces] : 0;
  use          *list = tm_alloc_(2 * corners, sizeof *list);
  uint8_t      *used = tm_alloc_(v->num_nodes, 1);
  int64_t       n = 0, open = 0, idle = 0, bad = 0;

  for (int64_t f = 0; f < v->num_faces; f++) {
    const int32_t cell[2] = {v->face_owner[f], v->face_neighbour[f]};
    bad += cell[0] < 0 || cell[0] >= v->num_cells || cell[1] < -1 || cell[1] >= v->num_cells || cell[0] == cell[1];
    bad += v->face_from[0][f] < 0 && v->face_from[1][f] < 0;
    for (int64_t k = v->face_offset[f]; k < v->face_offset[f + 1]; k++) {
      const int32_t a = v->face_node[k], b = v->face_node[k + 1 < v->face_offset[f + 1] ? k + 1 : v->face_offset[f]];
      used[a] = 1;
      for (int h = 0; h < 2; h++)
        if (cell[h] >= 0) list[n++] = (use){cell[h], a < b ? a : b, a < b ? b : a, (a < b) != h ? 1 : -1};
    }
  }
  qsort(list, (size_t)n, sizeof *list, by_use);
  for (int64_t i = 0, k; i < n; i = k) {
    int sum = 0;
    for (k = i; k < n && by_use(&list[i], &list[k]) == 0; k++) sum += list[k].way;
    open += sum != 0;
  }
  for (int64_t k = 0; k < v->num_nodes; k++) idle += !used[k];
  RT_EQ(bad, 0);
  RT_EQ(open, 0);
  RT_EQ(idle, 0);
  free(list), free(used);
}

/* On one rank numbers are places, and every cell has its volume: those of the given cells, once each, for the union. */
static void is_the_union(const world *w)
{
  const remap_supermesh_view *v = &w->v;

  RT_EQ(v->num_beyond, 0);
  RT_CHECK(v->num_cells == v->global_cells && v->num_faces == v->global_faces && v->num_nodes == v->global_nodes);
  for (int64_t k = 0; k < v->num_cells; k++) RT_EQ(v->cell_global[k], k);
  for (int side = 0; side < 2; side++) {
    const int64_t n   = w->mine[side]->view.num_cells;
    double       *sum = tm_alloc_(n, sizeof *sum), *own = tm_alloc_(n, sizeof *own);

    RT_EQ(remap_build(w->ctx), REMAP_OK);
    RT_EQ(remap_cells(w->ctx, side, own, NULL), REMAP_OK);
    free(sum), free(own);
  }
}

/* ---- several ranks ------------------------------------------------------------------------------------------------------------- */

/* What this rank has of the whole is what one rank alone has. */
static void same_bits(const remap_supermesh_view *all, const remap_supermesh_view *v)
{
  int64_t bad = 0;

  RT_EQ(v->global_cells, all->num_cells);
  RT_EQ(v->global_faces, all->num_faces);
  RT_EQ(v->global_nodes, all->num_nodes);
  if (v->global_cells != all->num_cells || v->global_faces != all->num_faces || v->global_nodes != all->num_nodes) return;
  for (int64_t k = 0; k < v->num_nodes; k++) bad += memcmp(v->node_xyz + 3 * k, all->node_xyz + 3 * v->node_global[k], 3 * sizeof(double)) != 0;
  RT_EQ(bad, 0);
  for (int64_t c = 0; c < v->num_cells; c++) {
    const int64_t g = v->cell_global[c];
    bad += c > 0 && g <= v->cell_global[c - 1];
    bad += memcmp(&v->cell_volume[c], &all->cell_volume[g], sizeof(double)) != 0;
    for (int side = 0; side < 2; side++) bad += v->cell_ancestor[side][c] != all->cell_ancestor[side][g];
  }
  RT_EQ(bad, 0);
  for (int64_t f = 0, next = 0; f < v->num_faces; f++) {
    const int64_t g = v->face_global[f], n = v->face_offset[f + 1] - v->face_offset[f], own = v->cell_global[v->face_owner[f]];
    int64_t       other = v->face_neighbour[f] < 0 ? -1 : v->cell_global[v->face_neighbour[f]];

    if (next < v->num_beyond && v->beyond_face[next] == f) {
      bad += other >= 0;
      other = v->beyond_cell[next++];
    }
    const bool turned = own != all->face_owner[g];
    bad += f > 0 && g <= v->face_global[f - 1];
    bad += n != all->face_offset[g + 1] - all->face_offset[g];
    bad += turned ? own != all->face_neighbour[g] || other != all->face_owner[g] : other != all->face_neighbour[g];
    if (bad) break;
    for (int64_t k = 0; k < n; k++) {
      const int64_t at = turned ? (n - k) % n : k;
      bad += v->node_global[v->face_node[v->face_offset[f] + k]] != all->face_node[all->face_offset[g] + at];
    }
    for (int side = 0; side < 2; side++) bad += (v->face_from[side][f] < 0) != (all->face_from[side][g] < 0);
  }
  RT_EQ(bad, 0);
}

static void look(const plan *p)
{
  world   alone, together;
  int64_t count[2];

  open_world(&alone, MPI_COMM_SELF, p);
  open_world(&together, MPI_COMM_WORLD, p);
  is_a_mesh(&alone.v);
  is_a_mesh(&together.v);
  same_bits(&alone.v, &together.v);
  count[0] = together.v.num_cells;
  MPI_Allreduce(&count[0], &count[1], 1, MPI_INT64_T, MPI_SUM, MPI_COMM_WORLD);
  RT_EQ(count[1], alone.v.num_cells);
  if (p->options.keep == UNION && p->options.pass_through) is_the_union(&alone);
  close_world(&alone), close_world(&together);
}

/* ---- cases --------------------------------------------------------------------------------------------------------------------- */

static tm_mesh *warped(int side, uint64_t seed)
{
  static const double away[12] = {1, 0, 0, .25, 0, 1, 0, .2, 0, 0, 1, .3};
  const tm_warping    warp     = {.03, .1 * (double)seed};
  tm_mesh            *m;

  switch ((seed + (uint64_t)side) % 4) {
    case 0: m = tm_tetrahedra((int[]){3, 3, 3}, tm_warp, &warp); break;
    case 1: m = tm_refined((int[]){3, 4, 3}, tm_checkered, tm_warp, &warp); break;
    case 2: m = tm_dual((int[]){3, 3, 4}, tm_warp, &warp); break;
    default: m = tm_hexahedra((int[]){5, 4, 6}, NULL, NULL); break;
  }
  if (side) tm_move(m, tm_affine, away);
  return m;
}

static void one_rank_and_many_make_the_same(void)
{
  static const int keep[] = {UNION, REMAP_IN_BOTH, REMAP_IN_SOURCE, REMAP_IN_TARGET, REMAP_IN_BOTH | REMAP_IN_SOURCE};

  for (uint64_t seed = 1; seed <= 5; seed++) {
    const plan p = {warped, seed, seed % 2 ? REMAP_FACES_CENTRE : REMAP_FACES_DIAGONAL, {keep[seed - 1], 0, 0, seed != 4}, seed == 2};
    look(&p);
  }
}

RT_MAIN(RT_CASE(one_rank_and_many_make_the_same))
