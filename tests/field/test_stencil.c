/* Vertex neighbours and their weights on meshes of every kind, in place and size of every kind. */
#include "boxes.h"
#include "surfaces.h"
#include "field/field.h"

/* What a mesh of the tests is made of. */
typedef enum mesh_kind { HEXAHEDRA, TETRAHEDRA, PRISMS, PYRAMIDS, MIXED, REFINED, DUAL, NUM_KINDS, CROWDED } mesh_kind;

static tm_mesh *make(mesh_kind kind)
{
  static const tm_warping warp = {0.03, 0.7};

  switch (kind) {
    case TETRAHEDRA: return tm_tetrahedra((int[]){3, 3, 4}, tm_warp, &warp);
    case PRISMS: return tm_prisms((int[]){4, 4, 3}, tm_warp, &warp);
    case PYRAMIDS: return tm_pyramids((int[]){3, 3, 3}, tm_warp, &warp);
    case MIXED: return tm_mixed((int[]){5, 3, 3}, tm_warp, &warp);
    case REFINED: return tm_refined((int[]){4, 4, 4}, tm_right_half, tm_warp, &warp);
    case DUAL: return tm_dual((int[]){3, 3, 3}, tm_warp, &warp);
    case CROWDED: return surfaces_wedges(1500);
    default: return tm_hexahedra((int[]){5, 4, 6}, tm_warp, &warp);
  }
}

/* A mesh alone: the target is one box of the same size at the same place. */
static void open_mesh(boxes_world *w, MPI_Comm comm, tm_mesh *mesh, tm_dealing deal)
{
  boxes_shape shape = {{0, 0, 0}, {0, 0, 0}, 0};

  for (int d = 0; d < 3; d++) {
    shape.low[d]  = INFINITY;
    shape.high[d] = -INFINITY;
    for (int64_t v = 0; v < mesh->view.num_nodes; v++) {
      shape.low[d]  = fmin(shape.low[d], mesh->xyz[3 * v + d]);
      shape.high[d] = fmax(shape.high[d], mesh->xyz[3 * v + d]);
    }
  }
  boxes_open_meshes(w, comm, mesh, boxes_grid(1, 1, 1, shape), deal);
}

/* Values of all own and halo cells, from own ones. */
static const double *with_halo(boxes_world *w, const double *own)
{
  const rm_stencil *s      = w->stencil[0];
  double           *all    = rm_arena_alloc(w->arena, (int64_t)s->num_cells + s->num_halo, sizeof *all);
  double           *buffer = rm_arena_alloc(w->arena, s->plan->send_offset[s->plan->num_send], sizeof *buffer);

  memcpy(all, own, (size_t)s->num_cells * sizeof *all);
  RT_EQ(rm_plan_run(&w->comm, s->plan, sizeof *own, own, all + s->num_cells, buffer), REMAP_OK);
  return all;
}

static void slope_of(const rm_stencil *s, rm_lid cell, const double *all, double slope[3])
{
  slope[0] = slope[1] = slope[2] = 0.0;
  for (int64_t k = s->offset[cell]; k < s->offset[cell + 1]; k++)
    for (int d = 0; d < 3; d++) slope[d] += s->weight[k][d] * (all[s->neighbour[k]] - all[cell]);
}

/* A linear field of the centroids, with slopes as told. */
static const double *linear(boxes_world *w, const double slope[3])
{
  const rm_mesh *mesh = w->mesh[0];
  double        *own  = rm_arena_alloc(w->arena, mesh->num_cells, sizeof *own);

  for (rm_lid c = 0; c < mesh->num_cells; c++) {
    const double *x = mesh->cell_centroid[c];

    own[c] = 1.0 + slope[0] * x[0] + slope[1] * x[1] + slope[2] * x[2];
  }
  return with_halo(w, own);
}

static void slopes_are_exact(boxes_world *w, const double slope[3], double by)
{
  const double *all = linear(w, slope);

  for (rm_lid c = 0; c < w->mesh[0]->num_cells; c++) {
    double found[3];

    slope_of(w->stencil[0], c, all, found);
    for (int d = 0; d < 3; d++) RT_NEAR(found[d], slope[d], by);
  }
}

static void slopes_of_linear_fields_are_exact_on_every_kind_of_cell(void)
{
  for (mesh_kind k = HEXAHEDRA; k < NUM_KINDS; k++)
    for (int deal = TM_SLABS; deal <= TM_LAST; deal++) {
      boxes_world w;

      open_mesh(&w, MPI_COMM_WORLD, make(k), (tm_dealing)deal);
      slopes_are_exact(&w, (double[]){2.0, -3.0, 5.0}, 1e-12);
      boxes_close(&w);
    }
}

/* The neighbour k of a cell, by global id, from own and halo cells. */
static const rm_gid *globals_with_halo(boxes_world *w)
{
  const rm_stencil *s      = w->stencil[0];
  rm_gid           *all    = rm_arena_alloc(w->arena, (int64_t)s->num_cells + s->num_halo, sizeof *all);
  rm_gid           *buffer = rm_arena_alloc(w->arena, s->plan->send_offset[s->plan->num_send], sizeof *buffer);

  memcpy(all, w->mesh[0]->cell_global, (size_t)s->num_cells * sizeof *all);
  RT_EQ(rm_plan_run(&w->comm, s->plan, sizeof *all, w->mesh[0]->cell_global, all + s->num_cells, buffer), REMAP_OK);
  return all;
}

static void check_bits_of_one_rank(mesh_kind kind, tm_dealing deal)
{
  boxes_world   w, alone;
  const rm_gid *global;

  open_mesh(&w, MPI_COMM_WORLD, make(kind), deal);
  open_mesh(&alone, MPI_COMM_SELF, make(kind), TM_SLABS);
  global = globals_with_halo(&w);
  RT_EQ(alone.stencil[0]->num_halo, 0);
  for (rm_lid c = 0; c < w.mesh[0]->num_cells; c++) {
    const rm_stencil *s = w.stencil[0], *t = alone.stencil[0];
    const rm_lid      other = boxes_find(alone.mesh[0], w.mesh[0]->cell_global[c]);
    const int64_t     num   = s->offset[c + 1] - s->offset[c];

    if (!RT_EQ(num, t->offset[other + 1] - t->offset[other])) continue;
    for (int64_t i = 0; i < num; i++) {
      RT_EQ(global[s->neighbour[s->offset[c] + i]], alone.mesh[0]->cell_global[t->neighbour[t->offset[other] + i]]);
      RT_CHECK(boxes_same_bits(s->weight[s->offset[c] + i], t->weight[t->offset[other] + i], 3 * sizeof(double)));
    }
  }
  boxes_close(&alone);
  boxes_close(&w);
}

static void stencils_are_those_of_one_rank_bit_by_bit(void)
{
  for (mesh_kind k = HEXAHEDRA; k < NUM_KINDS; k++)
    for (int deal = TM_SLABS; deal <= TM_LAST; deal++) check_bits_of_one_rank(k, (tm_dealing)deal);
}

/* Round an edge, where a mesh one cell long has no slope along it. */
static void cells_that_are_very_many_round_an_edge_have_few_neighbours_that_do(void)
{
  boxes_world w;

  open_mesh(&w, MPI_COMM_WORLD, make(CROWDED), TM_RANDOM);
  for (rm_lid c = 0; c < w.mesh[0]->num_cells; c++) RT_CHECK(w.stencil[0]->offset[c + 1] - w.stencil[0]->offset[c] < 140);
  slopes_are_exact(&w, (double[]){0.0, -3.0, 5.0}, 4e-12); /* a cell is 240 times longer than wide */
  boxes_close(&w);
  check_bits_of_one_rank(CROWDED, TM_RANDOM);
}

/* Only what is read travels: of the cells round an edge on other ranks those next to this one's, and a sample. */
static void halos_hold_neighbours_alone(void)
{
  for (int deal = TM_SLABS; deal <= TM_LAST; deal++) {
    boxes_world w;

    open_mesh(&w, MPI_COMM_WORLD, make(CROWDED), (tm_dealing)deal);
    const rm_stencil *s    = w.stencil[0];
    uint8_t          *used = rm_arena_zero(w.arena, s->num_halo, sizeof *used);
    for (int64_t k = 0; k < s->offset[s->num_cells]; k++)
      if (s->neighbour[k] >= s->num_cells) used[s->neighbour[k] - s->num_cells] = 1;
    for (rm_lid h = 0; h < s->num_halo; h++) RT_CHECK(used[h]);
    if (deal == TM_SLABS) RT_CHECK(s->num_halo < 350); /* of 1500 less the own ones */
    boxes_close(&w);
  }
}

static void inner_cells_of_a_grid_have_26_neighbours_and_8_nodes(void)
{
  boxes_world w;
  int64_t     count[27] = {0};

  open_mesh(&w, MPI_COMM_WORLD, boxes_grid(4, 5, 6, (boxes_shape){{0, 0, 0}, {1, 1, 1}, 0}), TM_RANDOM);
  for (rm_lid c = 0; c < w.mesh[0]->num_cells; c++) {
    const int64_t num = w.stencil[0]->offset[c + 1] - w.stencil[0]->offset[c];

    RT_EQ(w.stencil[0]->node_offset[c + 1] - w.stencil[0]->node_offset[c], 8);
    if (RT_CHECK(num <= 26)) count[num]++;
  }
  RT_EQ(rm_comm_sum_i64(&w.comm, count, 27), REMAP_OK);
  RT_EQ(count[26], 2 * 3 * 4);
  RT_EQ(count[7], 8);
  RT_EQ(count[11], 4 * (2 + 3 + 4));
  RT_EQ(count[17], 2 * (2 * 3 + 2 * 4 + 3 * 4));
  boxes_close(&w);
}

/* One layer of cells: the slope across it is 0, the slopes along it are exact. */
static void a_mesh_one_cell_thick_has_no_slope_across(void)
{
  for (int axis = 0; axis < 3; axis++) {
    boxes_world   w;
    const int     n[3]     = {axis == 0 ? 1 : 6, axis == 1 ? 1 : 5, axis == 2 ? 1 : 4};
    const double  slope[3] = {2.0, -3.0, 5.0};
    const double *all;

    open_mesh(&w, MPI_COMM_WORLD, boxes_grid(n[0], n[1], n[2], (boxes_shape){{0.1, 0.2, 0.3}, {1, 1, 1}, .5}), TM_SLABS);
    all = linear(&w, slope);
    for (rm_lid c = 0; c < w.mesh[0]->num_cells; c++) {
      double found[3];

      slope_of(w.stencil[0], c, all, found);
      for (int d = 0; d < 3; d++) RT_NEAR(found[d], d == axis ? 0.0 : slope[d], d == axis ? 0.0 : 1e-12);
    }
    boxes_close(&w);
  }
}

/* Turned by 0.4 about z, then about x, shrunk and moved: as tm_affine wants it. */
static void turning(double size, double shift, double m[12])
{
  const double c = cos(0.4), s = sin(0.4);
  const double turn[3][3] = {{c, -s, 0}, {c * s, c * c, -s}, {s * s, s * c, c}};

  for (int r = 0; r < 3; r++) {
    for (int k = 0; k < 3; k++) m[4 * r + k] = size * turn[r][k];
    m[4 * r + 3] = shift;
  }
}

/* The same when the layer is parallel to no axis: the slope is that of the field along the layer. */
static void check_turned_layer(const int n[3], double size, double shift, double by)
{
  boxes_world   w;
  double        m[12], field[3] = {2.0, -3.0, 5.0}, want[3];
  const double *all;
  tm_mesh      *mesh = tm_hexahedra(n, NULL, NULL);

  turning(size, shift, m);
  tm_move(mesh, tm_affine, m);
  open_mesh(&w, MPI_COMM_WORLD, mesh, TM_RANDOM);
  memcpy(want, field, sizeof want);
  for (int axis = 0; axis < 3; axis++) {
    const double *direction = m + axis; /* a column: every fourth */
    double        part      = 0.0;

    if (n[axis] > 1) continue;
    for (int d = 0; d < 3; d++) part += field[d] * direction[4 * d] / size;
    for (int d = 0; d < 3; d++) want[d] -= part * direction[4 * d] / size;
  }
  all = linear(&w, field);
  for (rm_lid c = 0; c < w.mesh[0]->num_cells; c++) {
    double found[3];

    slope_of(w.stencil[0], c, all, found);
    for (int d = 0; d < 3; d++) RT_NEAR(found[d], want[d], by);
  }
  boxes_close(&w);
}
static void a_turned_mesh_one_cell_thick_has_no_slope_across(void)
{
  check_turned_layer((int[]){6, 5, 1}, 1.0, 0.0, 1e-12);
  check_turned_layer((int[]){6, 1, 5}, 1.0, 0.0, 1e-12);
  check_turned_layer((int[]){7, 1, 1}, 1.0, 0.0, 1e-12); /* a row of cells */
  check_turned_layer((int[]){6, 5, 1}, 1.0, 1e3, 1e-9);
  check_turned_layer((int[]){6, 5, 1}, 1e-6, 1.0, 1e-6);
}

static void a_single_cell_has_slope_zero(void)
{
  boxes_world w;

  open_mesh(&w, MPI_COMM_WORLD, boxes_grid(1, 1, 1, (boxes_shape){{0, 0, 0}, {1, 1, 1}, 0}), TM_LAST);
  RT_EQ(w.stencil[0]->offset[w.mesh[0]->num_cells], 0);
  boxes_close(&w);
}

/* Thin cells, also turned: what counts is the error of the reconstruction within the cell, not that of the slope. */
static void thin_cells_reconstruct_linear_fields(void)
{
  for (int turned = 0; turned < 2; turned++) {
    boxes_world   w;
    double        m[12], slope[3] = {2.0, -3.0, 5.0};
    tm_mesh      *mesh = boxes_grid(6, 6, 6, (boxes_shape){{0, 0, 0}, {1, 1, 1e-5}, .5});
    const double *all;

    turning(1.0, 0.0, m);
    if (turned) tm_move(mesh, tm_affine, m);
    open_mesh(&w, MPI_COMM_WORLD, mesh, TM_SLABS);
    all = linear(&w, slope);
    for (rm_lid c = 0; c < w.mesh[0]->num_cells; c++) {
      const rm_stencil *s = w.stencil[0];
      double            found[3];

      slope_of(s, c, all, found);
      for (int64_t k = s->node_offset[c]; k < s->node_offset[c + 1]; k++) {
        const double *x = w.mesh[0]->node_xyz[s->node[k]], *y = w.mesh[0]->cell_centroid[c];
        double        error = 0.0;

        for (int d = 0; d < 3; d++) error += (found[d] - slope[d]) * (x[d] - y[d]);
        RT_NEAR(error, 0.0, 1e-13);
      }
    }
    boxes_close(&w);
  }
}

/* Cells far from the origin: the slope is as good as the rounded coordinates and values allow. */
static void slopes_far_from_the_origin_are_as_good_as_the_coordinates(void)
{
  boxes_world w;
  tm_mesh    *mesh  = make(TETRAHEDRA);
  double      m[12] = {1, 0, 0, 1e6, 0, 1, 0, 1e6, 0, 0, 1, 1e6};

  tm_move(mesh, tm_affine, m);
  open_mesh(&w, MPI_COMM_WORLD, mesh, TM_SLABS);
  slopes_are_exact(&w, (double[]){2.0, -3.0, 5.0}, 1e-8);
  boxes_close(&w);
}

static void slopes_do_not_depend_on_the_unit(void)
{
  for (int sign = -1; sign < 2; sign += 2) {
    const double size  = sign < 0 ? 0x1p-40 : 0x1p40;
    double       m[12] = {size, 0, 0, 0, 0, size, 0, 0, 0, 0, size, 0};
    tm_mesh     *mesh  = make(HEXAHEDRA);
    boxes_world  w;

    tm_move(mesh, tm_affine, m);
    open_mesh(&w, MPI_COMM_WORLD, mesh, TM_SLABS);
    slopes_are_exact(&w, (double[]){2.0, -3.0, 5.0}, 1e-12);
    boxes_close(&w);
  }
}

RT_MAIN(RT_CASE(slopes_of_linear_fields_are_exact_on_every_kind_of_cell), RT_CASE(stencils_are_those_of_one_rank_bit_by_bit),
        RT_CASE(cells_that_are_very_many_round_an_edge_have_few_neighbours_that_do),
        RT_CASE(halos_hold_neighbours_alone),
        RT_CASE(inner_cells_of_a_grid_have_26_neighbours_and_8_nodes), RT_CASE(a_mesh_one_cell_thick_has_no_slope_across),
        RT_CASE(a_turned_mesh_one_cell_thick_has_no_slope_across), RT_CASE(a_single_cell_has_slope_zero),
        RT_CASE(thin_cells_reconstruct_linear_fields), RT_CASE(slopes_far_from_the_origin_are_as_good_as_the_coordinates),
        RT_CASE(slopes_do_not_depend_on_the_unit))
