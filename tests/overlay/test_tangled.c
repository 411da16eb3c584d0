/* Meshes with tangled and inverted cells: V_ij is the integral of both winding numbers, so sums over rows and columns stay the
 * signed volumes of the cells wherever the other mesh, as a whole, winds once. */
#include "laid.h"
#include "rt.h"

typedef enum damage { SWAP_NEIGHBOURS, SWAP_DIAGONAL, PUSH_THROUGH, FOLD_LAYER, MIRROR_ALL } damage;

/* Node (i, j, k) of hexahedra n^3, whose numbers run with x fastest. */
static double *node(tm_mesh *mesh, int n, int i, int j, int k)
{
  return mesh->xyz + 3 * (((int64_t)k * (n + 1) + j) * (n + 1) + i);
}

static void swap_nodes(double *a, double *b)
{
  for (int c = 0; c < 3; c++) {
    const double x = a[c];
    a[c]           = b[c];
    b[c]           = x;
  }
}

/* Damage inner nodes: the boundary stays, so that the mesh as a whole still winds once about the cube. */
static tm_mesh *damaged(int n, damage what, int count, uint64_t seed)
{
  tm_mesh *mesh = tm_hexahedra((int[]){n, n, n}, tm_warp, &(tm_warping){.02, .3});

  for (int d = 0; d < count; d++) {
    const int i = 1 + (int)tm_random(&seed, n - 2), j = 1 + (int)tm_random(&seed, n - 2), k = 1 + (int)tm_random(&seed, n - 2);
    double   *p = node(mesh, n, i, j, k);

    switch (what) {
      case SWAP_NEIGHBOURS: swap_nodes(p, node(mesh, n, i + 1, j, k)); break;
      case SWAP_DIAGONAL: swap_nodes(p, node(mesh, n, i + 1, j + 1, k + 1)); break;
      case PUSH_THROUGH:
        p[0] = (i + 1.3) / n, p[1] = (j + .1) / n, p[2] = (k - .2) / n; /* stays in the cube, pushed twice or not */
        break;
      case FOLD_LAYER:
        for (int y = 1; y < n; y++)
          for (int z = 1; z < n; z++) node(mesh, n, i, y, z)[0] += 1.4 / n;
        break;
      case MIRROR_ALL: break;
    }
  }
  if (what == MIRROR_ALL) /* all volumes negative */
    for (int64_t v = 0; v < mesh->view.num_nodes; v++) mesh->xyz[3 * v] = 1 - mesh->xyz[3 * v];
  return mesh;
}

static tm_mesh *other_mesh(int n, double scale)
{
  tm_mesh *mesh = tm_benchmark(n, .7, .3, scale);
  tm_move(mesh, tm_affine, (double[]){1, 0, 0, .5, 0, 1, 0, .5, 0, 0, 1, .5});
  return mesh;
}

/* Sums over the pairs of every cell of one side are `times` its signed volume. */
static void sums_hold(const laid *l, int side, double times)
{
  for (rm_lid c = 0; c < l->num[side]; c++) {
    const double *box  = l->mesh[side]->cell_box[l->place[side][c]];
    const double  size = (box[3] - box[0]) * (box[4] - box[1]) * (box[5] - box[2]), v = laid_cell_volume(l, side, c);
    long double   sum = 0;

    for (rm_lid k = 0; k < l->num[1 - side]; k++) sum += (long double)(side ? laid_volume(l, k, c) : laid_volume(l, c, k));
    RT_NEAR((double)sum, times * v, 1e-12 * fmax(fabs(v), .1 * size));
  }
}

static void check(damage what, int count)
{
  for (uint64_t seed = 1; seed <= (rt_long() ? 50 : 4); seed++)
    for (int way = 0; way < 8; way++) {
      const bool around = way & 1, back = way & 2;
      tm_mesh   *a = damaged(5, what, count, 100 * seed), *b = other_mesh(around ? 6 : 4, around ? 2.5 : .5);
      laid      *l = laid_over(back ? b : a, back ? a : b, way & 4 ? REMAP_FACES_DIAGONAL : REMAP_FACES_CENTRE, NULL);

      if (!RT_EQ(l->status, REMAP_OK))
        printf("# damage %d, seed %llu, way %d: %s\n", what, (unsigned long long)seed, way, l->reason.text);
      else if (around)
        sums_hold(l, back ? 1 : 0, 1);
      else
        sums_hold(l, back ? 0 : 1, what == MIRROR_ALL ? -1 : 1);
      laid_free(l);
      tm_free(a);
      tm_free(b);
    }
}

static void one_pair_of_neighbours_swapped(void) { check(SWAP_NEIGHBOURS, 1); }
static void many_pairs_of_neighbours_swapped(void) { check(SWAP_NEIGHBOURS, 20); }
static void many_pairs_across_cells_swapped(void) { check(SWAP_DIAGONAL, 10); }
static void a_node_pushed_through_the_opposite_face(void) { check(PUSH_THROUGH, 1); }
static void many_nodes_pushed_through_faces(void) { check(PUSH_THROUGH, 10); }
static void a_layer_folded_over_the_next(void) { check(FOLD_LAYER, 2); }
static void a_mesh_turned_inside_out(void) { check(MIRROR_ALL, 0); }

/* Both tangled, in one cube: each winds once as a whole. */
static void both_meshes_tangled(void)
{
  for (uint64_t seed = 1; seed <= (rt_long() ? 50 : 6); seed++) {
    tm_mesh *a = damaged(5, SWAP_DIAGONAL, 6, seed), *b = damaged(4, PUSH_THROUGH, 6, 50 + seed);
    laid    *l;

    /* straight boundaries, which coincide */
    for (int h = 0; h < 2; h++) {
      tm_mesh *m = h ? b : a, *straight = tm_hexahedra(h ? (int[]){4, 4, 4} : (int[]){5, 5, 5}, NULL, NULL);
      for (int64_t v = 0; v < m->view.num_nodes; v++) {
        const double *p        = straight->xyz + 3 * v;
        bool          boundary = false;
        for (int c = 0; c < 3; c++) boundary = boundary || p[c] == 0 || p[c] == 1;
        if (boundary) memcpy(m->xyz + 3 * v, p, 3 * sizeof *p);
      }
      tm_free(straight);
    }
    l = laid_over(a, b, seed & 1 ? REMAP_FACES_CENTRE : REMAP_FACES_DIAGONAL, NULL);
    if (RT_EQ(l->status, REMAP_OK)) {
      sums_hold(l, 0, 1);
      sums_hold(l, 1, 1);
    }
    laid_free(l);
    tm_free(a);
    tm_free(b);
  }
}

/* A mesh against itself, tangled: the worst of coincidences. */
static void a_tangled_mesh_on_itself(void)
{
  for (uint64_t seed = 1; seed <= (rt_long() ? 50 : 6); seed++) {
    tm_mesh *a = damaged(4, (damage)(seed % 3), 4, seed);
    laid    *l = laid_over(a, a, seed & 1 ? REMAP_FACES_CENTRE : REMAP_FACES_DIAGONAL, NULL);

    if (RT_EQ(l->status, REMAP_OK))
      for (int side = 0; side < 2; side++) sums_hold(l, side, 1);
    laid_free(l);
    tm_free(a);
  }
}

RT_MAIN(RT_CASE(one_pair_of_neighbours_swapped), RT_CASE(many_pairs_of_neighbours_swapped),
        RT_CASE(many_pairs_across_cells_swapped), RT_CASE(a_node_pushed_through_the_opposite_face),
        RT_CASE(many_nodes_pushed_through_faces), RT_CASE(a_layer_folded_over_the_next), RT_CASE(a_mesh_turned_inside_out),
        RT_CASE(both_meshes_tangled), RT_CASE(a_tangled_mesh_on_itself))
