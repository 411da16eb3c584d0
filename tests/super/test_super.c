/* The supermesh over all ranks: the bits of one rank, whatever the partition and numbering; conformal; volumes that add up;
 * cells that meet nothing passed through; values of cells and faces taken over. */
#include <remap/remap.h>
#include "meshes.h"
#include "rough.h"
#include "rt.h"
#include "views.h"

enum { UNION = REMAP_IN_BOTH | REMAP_IN_SOURCE | REMAP_IN_TARGET };

typedef struct world {
  remap_context       *ctx;
  tm_mesh             *mine[2];
  remap_faces          faces;
  remap_status         status;
  remap_supermesh_view v;
} world;

typedef struct plan {
  tm_mesh *(*make)(int side, uint64_t seed);
  uint64_t    seed;
  remap_faces faces;
  remap_supermesh_options options;
  bool        build;    /* remap_build comes first                */
  bool        may_fail; /* cells may be tangled, and then refused */
} plan;

static void open_world(world *w, MPI_Comm comm, const plan *p)
{
  remap_options how;
  int           rank, size;

  MPI_Comm_rank(comm, &rank);
  MPI_Comm_size(comm, &size);
  remap_options_default(&how);
  how.faces = w->faces = p->faces;
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
  w->status = remap_supermesh(w->ctx, &p->options, &w->v);
  if (w->status != REMAP_OK && !p->may_fail) printf("# %s\n", remap_message(w->ctx));
  if (!p->may_fail) RT_EQ(w->status, REMAP_OK);
}

static void close_world(world *w)
{
  remap_destroy(&w->ctx);
  for (int side = 0; side < 2; side++) tm_free(w->mine[side]);
}

/* ---- one rank ---------------------------------------------------------------------------------------------------- */

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

/* Volumes of cells by the cones of their faces from a node of each. */
static double *volumes_by_faces(const remap_supermesh_view *v)
{
  double  *volume = tm_alloc_(v->num_cells, sizeof *volume), a[3];
  int32_t *origin = tm_alloc_(v->num_cells, sizeof *origin);

  for (int64_t c = 0; c < v->num_cells; c++) origin[c] = -1;
  for (int64_t f = 0; f < v->num_faces; f++) {
    const int32_t cell[2] = {v->face_owner[f], v->face_neighbour[f]}, first = v->face_node[v->face_offset[f]];
    view_area_vector(v, f, a);
    for (int h = 0; h < 2; h++) {
      if (cell[h] < 0) continue;
      if (origin[cell[h]] < 0) origin[cell[h]] = first;
      const double *o = v->node_xyz + 3 * (int64_t)origin[cell[h]], *p = v->node_xyz + 3 * (int64_t)first;
      for (int c = 0; c < 3; c++) volume[cell[h]] += (h ? -1 : 1) * a[c] * (p[c] - o[c]) / 6;
    }
  }
  free(origin);
  return volume;
}

/* On one rank: numbers are places; by ancestors the volumes of the union are those of the pairs and of the given cells, to
 * 1e-12 of the smaller cell. */
static void is_the_union(const world *w)
{
  const remap_supermesh_view *v = &w->v;
  const int64_t               n[2] = {w->mine[0]->view.num_cells, w->mine[1]->view.num_cells};
  double                     *own[2], *sum[2], *pair = tm_alloc_(n[0] * n[1], sizeof *pair), worst = 0, kind[3] = {0, 0, 0};
  remap_context              *moments;
  remap_pairs_view            p;
  remap_options               how;

  RT_CHECK(v->num_cells == v->global_cells && v->num_faces == v->global_faces && v->num_nodes == v->global_nodes &&
           v->num_beyond == 0);
  for (int64_t k = 0; k < v->num_cells; k++) RT_EQ(v->cell_global[k], k);
  remap_options_default(&how);
  how.faces = w->faces;
  RT_EQ(remap_create(MPI_COMM_SELF, &how, &moments), REMAP_OK);
  for (int side = 0; side < 2; side++) RT_EQ(remap_set_mesh(moments, side, &w->mine[side]->view), REMAP_OK);
  RT_EQ(remap_build(moments), REMAP_OK);
  RT_EQ(remap_pairs(moments, REMAP_FORWARD, &p), REMAP_OK);
  for (int side = 0; side < 2; side++) {
    own[side] = tm_alloc_(n[side], sizeof(double)), sum[side] = tm_alloc_(n[side], sizeof(double));
    RT_EQ(remap_cells(moments, side, own[side], NULL), REMAP_OK);
  }
  for (int64_t c = 0; c < v->num_cells; c++) {
    const int64_t a = v->cell_ancestor[0][c], b = v->cell_ancestor[1][c];
    kind[a < 0 ? 2 : b < 0] += v->cell_volume[c];
    if (a >= 0) sum[0][a] += v->cell_volume[c];
    if (b >= 0) sum[1][b] += v->cell_volume[c];
    if (a >= 0 && b >= 0) pair[a * n[1] + b] += v->cell_volume[c];
  }
  for (int k = 0; k < 3; k++) RT_NEAR(kind[k], v->volume[k], 1e-13 * v->volume[k]);
  for (int64_t t = 0; t < p.num_rows; t++)
    for (int64_t k = p.row_offset[t]; k < p.row_offset[t + 1]; k++) pair[p.global_cell[k] * n[1] + t] -= p.volume[k];
  for (int64_t k = 0; k < n[0] * n[1]; k++) worst = fmax(worst, fabs(pair[k]) / fmin(own[0][k / n[1]], own[1][k % n[1]]));
  RT_NEAR(worst, 0, 1e-12);
  for (int side = 0; side < 2; side++)
    for (int64_t c = 0; c < n[side]; c++) RT_NEAR(sum[side][c], own[side][c], 1e-12 * own[side][c]);
  for (int side = 0; side < 2; side++) free(own[side]), free(sum[side]);
  remap_destroy(&moments);
  free(pair);
}

/* ---- several ranks ----------------------------------------------------------------------------------------------- */

/* What this rank has of the whole is what one rank alone has. */
static void same_bits(const remap_supermesh_view *all, const remap_supermesh_view *v)
{
  int64_t bad = 0;

  RT_EQ(v->global_cells, all->num_cells);
  RT_EQ(v->global_faces, all->num_faces);
  RT_EQ(v->global_nodes, all->num_nodes);
  RT_CHECK(memcmp(v->volume, all->volume, sizeof v->volume) == 0);
  RT_CHECK(memcmp(v->zone_overlap, all->zone_overlap, sizeof v->zone_overlap) == 0);
  if (v->global_cells != all->num_cells || v->global_faces != all->num_faces || v->global_nodes != all->num_nodes) return;
  for (int64_t k = 0; k < v->num_nodes; k++)
    bad += memcmp(v->node_xyz + 3 * k, all->node_xyz + 3 * v->node_global[k], 3 * sizeof(double)) != 0;
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

/* One rank's mesh is made by each, to compare with: what a case asks of that alone, it asks on one rank only. */
static void look(const plan *p)
{
  world   alone, together;
  int64_t count[2];

  open_world(&alone, MPI_COMM_SELF, p);
  open_world(&together, MPI_COMM_WORLD, p);
  RT_EQ(together.status, alone.status);
  is_a_mesh(&alone.v);
  is_a_mesh(&together.v);
  same_bits(&alone.v, &together.v);
  count[0] = together.v.num_cells;
  MPI_Allreduce(&count[0], &count[1], 1, MPI_INT64_T, MPI_SUM, MPI_COMM_WORLD);
  RT_EQ(count[1], alone.v.num_cells);
  if (alone.status == REMAP_OK && p->options.keep == UNION && p->options.pass_through) is_the_union(&alone);
  close_world(&alone), close_world(&together);
}

/* Faces of what one rank makes. */
static int64_t faces_alone(const plan *p)
{
  world   w;
  int64_t faces;

  open_world(&w, MPI_COMM_SELF, p);
  faces = w.v.num_faces;
  close_world(&w);
  return faces;
}

/* ---- cases ------------------------------------------------------------------------------------------------------- */

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
    const plan p = {warped,    seed, seed % 2 ? REMAP_FACES_CENTRE : REMAP_FACES_DIAGONAL, {keep[seed - 1], 0, 0, seed != 4},
                    seed == 2, false};
    look(&p);
  }
}

/* A small target in a warped source in two zones, most of which it does not meet. */
static tm_mesh *small_in_large(int side, uint64_t seed)
{
  static const double small[12] = {.3, .05, 0, .3, -.05, .3, 0, .35, 0, 0, .3, .3};
  const tm_warping    warp      = {.02, .3 * (double)seed};
  tm_mesh            *m;

  if (side == 0)
    return seed % 2 ? tm_two_zones((int[]){4, 7, 6}, (int[]){5, 7, 6}, 0, tm_warp, &warp)
                    : tm_hexahedra((int[]){9, 7, 8}, tm_warp, &warp);
  m = tm_tetrahedra((int[]){3, 3, 2}, NULL, NULL);
  tm_move(m, tm_affine, small);
  return m;
}

static void cells_that_meet_nothing_pass_through(void)
{
  for (uint64_t seed = 1; seed <= 4; seed++) {
    const plan p = {small_in_large,
                    seed,
                    seed % 2 ? REMAP_FACES_DIAGONAL : REMAP_FACES_CENTRE,
                    {seed == 4 ? REMAP_IN_SOURCE : UNION, 0, 0, 1},
                    false,
                    false};
    world      w;
    int64_t    whole = 0;

    look(&p);
    if (rt_size() > 1) continue;
    open_world(&w, MPI_COMM_SELF, &p);
    for (int64_t f = 0; f < w.v.num_faces; f++) /* a face of four nodes that is warped is as it was given */
      whole += w.v.face_offset[f + 1] - w.v.face_offset[f] == 4 && w.v.face_from[1][f] < 0;
    RT_CHECK(whole > 300);
    close_world(&w);
  }
}

static void pieces_of_warped_faces_come_together(void)
{
  for (uint64_t seed = 1; seed <= 4; seed++) {
    const plan apart = {seed == 4 ? small_in_large : warped,
                        seed,
                        seed % 2 ? REMAP_FACES_CENTRE : REMAP_FACES_DIAGONAL,
                        {UNION, 0, 0, 1},
                        false,
                        false};
    plan       whole = apart;

    whole.options.aggregate = 1;
    look(&whole);
    if (rt_size() > 1) continue;
    if (seed == 3) /* all faces are planar */
      RT_EQ(faces_alone(&whole), faces_alone(&apart));
    else
      RT_CHECK(faces_alone(&whole) < faces_alone(&apart));
  }
}

static tm_mesh *rough_pair(int side, uint64_t seed)
{
  uint64_t state = 1000 * seed;
  tm_mesh *m     = NULL;

  for (int k = 0; k <= side; k++) {
    tm_free(m);
    m = rough_mesh(&state, seed % 3);
  }
  return m;
}

static void meshes_that_touch_in_every_way_are_the_same_on_any_ranks(void)
{
  for (uint64_t seed = 1; seed <= (rt_long() ? 2000 : 60); seed++) {
    const int  before = rt_failed_;
    const plan p = {rough_pair, seed, seed % 2 ? REMAP_FACES_CENTRE : REMAP_FACES_DIAGONAL,
                    {seed % 7 ? UNION : REMAP_IN_SOURCE, seed % 5 == 0, seed % 4 == 0, seed % 11 != 0}, false, true};
    look(&p);
    if (rt_failed_ > before) printf("# seed %d\n", (int)seed);
  }
}

static tm_mesh *same_warped(int side, uint64_t seed)
{
  const tm_warping warp = {.03, .1 * (double)seed};
  (void)side;
  return tm_hexahedra((int[]){3, 3, 4}, tm_warp, &warp);
}

static void aggregated_identical_meshes_are_the_mesh(void)
{
  for (int faces = 0; faces < 2; faces++) {
    const plan p = {same_warped, 1, faces ? REMAP_FACES_DIAGONAL : REMAP_FACES_CENTRE, {UNION, 1, 0, 1}, false, false};
    world      w;

    look(&p);
    if (rt_size() > 1) continue;
    open_world(&w, MPI_COMM_SELF, &p);
    RT_EQ(w.v.num_cells, 36);
    RT_EQ(w.v.num_nodes, 80);
    RT_EQ(w.v.num_faces, 4 * 12 + 4 * 12 + 5 * 9);
    for (int64_t c = 0; c < w.v.num_cells; c++) RT_EQ(w.v.cell_ancestor[0][c], w.v.cell_ancestor[1][c]);
    close_world(&w);
  }
}

/* No face turns the other way at a node, by more than rounding. */
static void is_convex(const remap_supermesh_view *v)
{
  int64_t concave = 0;

  for (int64_t f = 0; f < v->num_faces; f++) {
    const int64_t n = v->face_offset[f + 1] - v->face_offset[f];
    double        a[3];

    view_area_vector(v, f, a);
    for (int64_t k = 0; k < n; k++) {
      const double *x[3];
      double        u[3], w[3], turn = 0, size = 0;
      for (int h = 0; h < 3; h++) x[h] = v->node_xyz + 3 * (int64_t)v->face_node[v->face_offset[f] + (k + h) % n];
      for (int c = 0; c < 3; c++) u[c] = x[1][c] - x[0][c], w[c] = x[2][c] - x[1][c];
      for (int c = 0; c < 3; c++) {
        const double cross = u[(c + 1) % 3] * w[(c + 2) % 3] - u[(c + 2) % 3] * w[(c + 1) % 3];
        turn += cross * a[c], size += fabs(a[c]);
      }
      concave += turn < -1e-12 * size;
    }
  }
  RT_EQ(concave, 0);
}

/* Planar faces, so that polygons have the volumes of the cells, some of them L-shaped. */
static tm_mesh *planar(int side, uint64_t seed)
{
  (void)seed;
  if (side) return tm_refined((int[]){2, 2, 2}, tm_checkered, NULL, NULL);
  const double small[12] = {.75, 0, 0, -.1, 0, .75, 0, -.1, 0, 0, .75, -.1};
  tm_mesh     *m = tm_dual((int[]){2, 2, 2}, NULL, NULL);
  tm_move(m, tm_affine, small);
  return m;
}

static void concave_faces_are_cut(void)
{
  const plan whole = {planar, 1, REMAP_FACES_CENTRE, {UNION, 0, 0, 1}, false, false};
  plan       split = whole;
  world      w;

  split.options.split_concave = 1;
  look(&split);
  if (rt_size() > 1) return;
  open_world(&w, MPI_COMM_SELF, &split);
  RT_CHECK(w.v.num_faces > faces_alone(&whole));
  is_convex(&w.v);
  double *volume = volumes_by_faces(&w.v);
  for (int64_t c = 0; c < w.v.num_cells; c++) RT_NEAR(volume[c], w.v.cell_volume[c], 1e-12 * w.v.cell_volume[c]);
  free(volume);
  close_world(&w);
}

/* ---- zones whose faces do not match ------------------------------------------------------------------------------- */

/* Move points within planes x = const, the sides of the unit cube within themselves. */
static void slide(double xyz[3], const void *data)
{
  const double phase = *(const double *)data, y = xyz[1], z = xyz[2];

  xyz[1] += .2 * y * (1 - y) * sin(3 * z + 5 * xyz[0] + phase);
  xyz[2] += .2 * z * (1 - z) * sin(4 * y + 2 * xyz[0] - phase);
}

/* The zones of the second in the place of the first one's cells from x = 1/2 on. */
static tm_mesh *three_zones(double phase)
{
  static const double halve[12] = {.5, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}, shift[12] = {.5, 0, 0, .5, 0, 1, 0, 0, 0, 0, 1, 0};
  tm_mesh      *first = tm_hexahedra((int[]){2, 3, 4}, NULL, NULL), *whole;
  tm_mesh      *rest  = tm_two_zones((int[]){2, 2, 3}, (int[]){1, 4, 2}, 0, NULL, NULL);
  const int64_t left  = rest->zone_offset[1];

  tm_move(first, tm_affine, halve);
  tm_move(rest, tm_affine, shift);
  whole = tm_join(first, rest);
  tm_move(whole, slide, &phase);
  free(whole->zone_offset), free(whole->zone_name);
  whole->zone_offset    = tm_alloc_(4, sizeof *whole->zone_offset);
  whole->zone_name      = tm_alloc_(3, sizeof *whole->zone_name);
  whole->zone_offset[1] = 24;
  whole->zone_offset[2] = 24 + left;
  whole->zone_offset[3] = whole->view.num_cells;
  for (int z = 0; z < 3; z++) whole->zone_name[z] = "one of three";
  whole->view.num_zones = 3;
  tm_view_(whole);
  return whole;
}

static tm_mesh *patched(int side, uint64_t seed)
{
  const double phase = .3 * (double)seed;

  if (side == 1 && seed == 3) return three_zones(phase);
  if (side == 1) return tm_two_zones((int[]){2, 3, 4}, (int[]){3, 2 + (int)seed, 5}, 0, slide, &phase);
  if (seed == 2) return tm_two_zones((int[]){2, 4, 3}, (int[]){2, 3, 2}, 0, slide, &(double){1.});
  return warped(0, seed);
}

/* Faces with one cell, over all ranks, that lie in a plane x = const inside of the cube. */
static int64_t gaping(const remap_supermesh_view *v)
{
  int64_t num = 0, beyond = 0;

  for (int64_t f = 0; f < v->num_faces; f++) {
    const double x    = v->node_xyz[3 * (int64_t)v->face_node[v->face_offset[f]]];
    bool         flat = x > 0 && x < 1 && v->face_neighbour[f] < 0;

    if (beyond < v->num_beyond && v->beyond_face[beyond] == f) beyond++, flat = false;
    for (int64_t k = v->face_offset[f]; k < v->face_offset[f + 1] && flat; k++)
      flat = v->node_xyz[3 * (int64_t)v->face_node[k]] == x;
    num += flat;
  }
  return num;
}

static void zones_that_touch_need_no_matching_faces(void)
{
  for (uint64_t seed = 1; seed <= 4; seed++) {
    const plan p = {patched, seed, seed % 2 ? REMAP_FACES_CENTRE : REMAP_FACES_DIAGONAL,
                    {UNION, seed == 4, 0, 1}, seed == 1, false};
    world      w;

    look(&p);
    if (rt_size() > 1) continue;
    open_world(&w, MPI_COMM_SELF, &p);
    RT_EQ(gaping(&w.v), 0);
    RT_CHECK(w.v.zone_overlap[0] == 0);
    RT_CHECK(w.v.zone_overlap[1] == 0);
    close_world(&w);
  }
}

/* Two zones of boxes in tenths, whose edges meet in points of doubles. */
static tm_mesh *patched_boxes(int side, uint64_t seed)
{
  double m[12] = {0};
  int    n[2][3];

  for (int k = 0; k < 3; k++) {
    m[5 * k]     = .1 * (double)(tm_random(&seed, 100) + 1);
    m[4 * k + 3] = .1 * (double)tm_random(&seed, 9);
  }
  seed += 10 * (uint64_t)side;
  for (int k = 0; k < 6; k++) n[k / 3][k % 3] = 1 + (int)tm_random(&seed, 3);
  return tm_two_zones(n[0], n[1], 0, tm_affine, m);
}

static void zones_of_boxes_are_joined_without_rounding(void)
{
  for (uint64_t k = 0; k < 150; k++) {
    const plan p = {patched_boxes, 100 * k, k % 2, {UNION, 0, 0, 1}, false, false};
    world      w;

    open_world(&w, MPI_COMM_SELF, &p);
    for (int64_t c = 0; c < w.v.num_cells; c++) RT_CHECK(w.v.cell_volume[c] > 1e-9);
    if (w.status == REMAP_OK) is_the_union(&w);
    close_world(&w);
  }
}

static tm_mesh *by_a_little(int side, uint64_t seed)
{
  const double phase = .3, gap = seed == 1 ? -1e-13 : seed == 2 ? 1e-13 : seed == 3 ? -3e-8 : -.05;

  return side ? tm_two_zones((int[]){2, 3, 4}, (int[]){3, 2, 5}, gap, slide, &phase) : warped(0, 1);
}

static void zones_that_overlap_by_rounding_count_once(void)
{
  for (uint64_t seed = 1; seed <= 3; seed++) {
    const plan p = {by_a_little, seed, REMAP_FACES_CENTRE, {REMAP_IN_TARGET | REMAP_IN_BOTH, 0, 0, 1}, false, false};
    world      w;
    double     sum = 0;

    look(&p);
    if (rt_size() > 1) continue;
    open_world(&w, MPI_COMM_SELF, &p);
    for (int64_t c = 0; c < w.v.num_cells; c++) sum += w.v.cell_volume[c];
    RT_NEAR(sum, seed == 2 ? 1 - 1e-13 : 1, 1e-14);
    RT_NEAR(w.v.zone_overlap[1], seed == 1 ? 1e-13 : seed == 2 ? 0 : 3e-8, 1e-15);
    close_world(&w);
  }
}

static void zones_that_overlap_by_more_are_refused_by_name(void)
{
  const plan p = {by_a_little, 4, REMAP_FACES_CENTRE, {UNION, 0, 0, 1}, false, true};
  world      w;

  open_world(&w, MPI_COMM_WORLD, &p);
  RT_EQ(w.status, REMAP_ZONE_OVERLAP);
  RT_CHECK(strstr(remap_message(w.ctx), "zone left: cell ") && strstr(remap_message(w.ctx), "overlaps cell "));
  RT_CHECK(strstr(remap_message(w.ctx), "of zone right by more than rounding"));
  close_world(&w);
}

static tm_mesh *without_zones(int side, uint64_t seed)
{
  tm_mesh *m = patched(side, seed);

  m->view.num_zones = 0;
  return m;
}

static void parts_of_a_zone_that_do_not_match_are_refused_by_name(void)
{
  for (uint64_t seed = 1; seed <= 2; seed++) {
    const plan  p  = {without_zones, seed, REMAP_FACES_CENTRE, {UNION, 0, 0, 1}, false, true};
    const char *by = "cell 1: a face of this cell meets one of the cell with global number 24, but they do not match";
    world       w;

    open_world(&w, MPI_COMM_WORLD, &p);
    RT_EQ(w.status, REMAP_BAD_MESH);
    if (!RT_CHECK(strstr(remap_message(w.ctx), seed == 1 ? by : "do not match"))) printf("# %s\n", remap_message(w.ctx));
    close_world(&w);
  }
}

/* ---- cells without thickness ------------------------------------------------------------------------------------- */

static void to_two(double xyz[3], const void *data)
{
  (void)data;
  xyz[0] *= 2;
}
static void to_middle(double xyz[3], const void *data)
{
  (void)data;
  for (int c = 0; c < 3; c++) xyz[c] = .25 + .5 * xyz[c];
}

/* Two boxes, and a cell of two triangles without thickness on half of the face between them: on the one or the other half,
 * before or after the boxes. The target lies in the first box. */
static tm_mesh *half_doubled(int side, uint64_t kind)
{
  static const double yz[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};

  if (side) return tm_hexahedra((int[]){1, 1, 1}, to_middle, NULL);
  tm_mesh *flat = tm_new_(3, 2, 6, 1), *two = tm_hexahedra((int[]){2, 1, 1}, to_two, NULL);
  for (int h = 0; h < 3; h++) {
    const double *at = yz[(2 * (kind & 1) + (uint64_t)h) % 4];
    flat->xyz[3 * h] = 1, flat->xyz[3 * h + 1] = at[0], flat->xyz[3 * h + 2] = at[1];
    flat->face_node[h] = h, flat->face_node[3 + h] = 2 - h;
  }
  for (int f = 0; f < 2; f++) flat->face_offset[f + 1] = 3 * (f + 1), flat->neighbour[f] = -1;
  return kind & 2 ? tm_join(two, flat) : tm_join(flat, two);
}

/* It lies on the face between a cell that is made and one that passes, whichever triangle of that it is on: all are made. */
static void a_cell_without_thickness_on_half_a_face_is_not_there(void)
{
  for (uint64_t kind = 0; kind < 4; kind++) {
    const plan p = {half_doubled, kind, REMAP_FACES_CENTRE, {UNION, 0, 0, 1}, false, false};
    world      w;

    look(&p);
    if (rt_size() > 1) continue;
    open_world(&w, MPI_COMM_SELF, &p);
    RT_EQ(w.v.num_cells, 3);
    close_world(&w);
  }
}

/* ---- refusals ---------------------------------------------------------------------------------------------------- */

static void to_seven(double xyz[3], const void *data)
{
  (void)data;
  xyz[0] += 7;
}
static void turn_and_widen(double xyz[3], const void *data)
{
  const double x = xyz[0], y = xyz[1];

  (void)data;
  xyz[0] = x - y, xyz[1] = x + y;
}
static void pull_a_node_out(double xyz[3], const void *data)
{
  (void)data;
  if (xyz[0] == .5 && xyz[1] == .5 && xyz[2] == .5) xyz[0] = 1.2, xyz[1] = 1.3, xyz[2] = 1.1;
}
static void around(double xyz[3], const void *data)
{
  (void)data;
  for (int c = 0; c < 3; c++) xyz[c] = 4 * xyz[c] - 2;
}
static tm_mesh *cube(int n, tm_map map) { return tm_hexahedra((int[]){n, n, n}, map, NULL); }

static tm_mesh *one_zone(tm_mesh *m)
{
  free(m->zone_offset), free(m->zone_name);
  m->zone_offset    = NULL;
  m->zone_name      = NULL;
  m->view.num_zones = 0;
  tm_view_(m);
  return m;
}

/* Meshes that no supermesh is made of, and what is said about them. */
static tm_mesh *refused(int side, uint64_t kind)
{
  switch (kind) {
    case 1: return side ? cube(1, around) : tm_join(cube(1, NULL), cube(1, NULL));
    case 2: return side ? cube(1, NULL) : one_zone(tm_two_zones((int[]){2, 2, 2}, (int[]){2, 2, 2}, -.3, NULL, NULL));
    case 3: return side ? cube(3, NULL) : cube(2, pull_a_node_out);
    case 4: return side ? cube(1, around) : one_zone(tm_join(cube(1, NULL), cube(1, turn_and_widen)));
    case 5: return side ? cube(1, around) : cube(2, pull_a_node_out);
    case 6: return side ? cube(2, around) : tm_join(cube(1, to_seven), tm_join(cube(2, NULL), cube(1, to_seven)));
    default: return side ? tm_join(cube(1, to_seven), tm_join(cube(2, NULL), cube(1, to_seven))) : cube(2, around);
  }
}

/* Cells once more that meet nothing are noticed when faces are numbered; on several ranks, when halves of faces are paired. */
static void every_refusal_names_a_cell(void)
{
  static const struct {
    const char *mesh, *text;
  } say[] = {{"source mesh: ", "this cell overlaps another of its mesh"},
             {"source mesh: ", "a face of this cell meets one of the cell with global number 8, but"},
             {"t mesh: cell ", "a face of this cell meets cells of the other mesh that overlap"},
             {"source mesh: ", "a face of this cell meets one of the cell with global number 1, but"},
             {"source mesh: cell ", "a part of this cell is inverted"},
             {"source mesh: ", "a part of this cell lies on a part of another"},
             {"target mesh: ", "a part of this cell lies on a part of another"}};

  for (uint64_t kind = 1; kind <= 7; kind++) {
    const plan p = {refused, kind, REMAP_FACES_CENTRE, {UNION, 0, 0, 1}, false, true};
    world      w;

    open_world(&w, MPI_COMM_WORLD, &p);
    RT_EQ(w.status, REMAP_BAD_MESH);
    const char *message = remap_message(w.ctx);
    RT_CHECK(strstr(message, say[kind - 1].mesh) && strstr(message, ": cell ") && strstr(message, say[kind - 1].text));
    if (w.status != REMAP_BAD_MESH || !strstr(message, say[kind - 1].text)) printf("# kind %d: %s\n", (int)kind, message);
    close_world(&w);
  }
}

RT_MAIN(RT_CASE(one_rank_and_many_make_the_same), RT_CASE(cells_that_meet_nothing_pass_through),
        RT_CASE(meshes_that_touch_in_every_way_are_the_same_on_any_ranks), RT_CASE(pieces_of_warped_faces_come_together),
        RT_CASE(aggregated_identical_meshes_are_the_mesh), RT_CASE(concave_faces_are_cut),
        RT_CASE(zones_that_touch_need_no_matching_faces), RT_CASE(zones_of_boxes_are_joined_without_rounding),
        RT_CASE(zones_that_overlap_by_rounding_count_once),
        RT_CASE(zones_that_overlap_by_more_are_refused_by_name), RT_CASE(parts_of_a_zone_that_do_not_match_are_refused_by_name),
        RT_CASE(a_cell_without_thickness_on_half_a_face_is_not_there), RT_CASE(every_refusal_names_a_cell))
