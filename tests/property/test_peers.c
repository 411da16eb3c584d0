/* Where other remappers fail silently (DESIGN section 6), one property each, over seeds, through the public interface: nothing
 * is lost, nothing is made up, whatever the scale, the place and the position of the meshes. */
#include <remap/remap.h>
#include "meshes.h"
#include "rt.h"

enum { SEEDS = 4 };

static double uniform(uint64_t *seed, double low, double high)
{
  return low + (high - low) * (double)tm_random(seed, 1 << 24) / (1 << 24);
}

/* Rotation by random angles, scale and shift as a 3 x 4 matrix. */
static void random_motion(uint64_t *seed, double scale, const double shift[3], double m[12])
{
  const double a = uniform(seed, 0, 3), b = uniform(seed, 0, 3), c = cos(a), s = sin(a), d = cos(b), e = sin(b);
  const double r[9] = {c, -s, 0, d * s, d * c, -e, e * s, e * c, d};

  for (int i = 0; i < 3; i++) {
    for (int k = 0; k < 3; k++) m[4 * i + k] = scale * r[3 * i + k];
    m[4 * i + 3] = shift[i];
  }
}

static tm_mesh *warped(int n, uint64_t *seed)
{
  return tm_hexahedra((int[]){n, n, n}, tm_warp, &(tm_warping){0.03, uniform(seed, 0, 6)});
}

typedef struct result {
  remap_stats        stats;
  remap_field_report report; /* of the constant 1, without limiter, conserve */
  bool               ok;
} result;

static result overlay(const tm_mesh *source, const tm_mesh *target, remap_faces faces)
{
  const tm_mesh *whole[2] = {source, target};
  tm_mesh       *mine[2];
  remap_options  options;
  remap_transfer how;
  remap_context *ctx = NULL;
  result         r   = {.ok = false};

  remap_options_default(&options);
  options.faces = faces;
  RT_EQ(remap_create(MPI_COMM_WORLD, &options, &ctx), REMAP_OK);
  for (int side = 0; side < 2; side++) {
    int *deal  = tm_deal(whole[side], rt_size(), TM_RANDOM, 7);
    mine[side] = tm_part(whole[side], deal, rt_rank(), 3);
    free(deal);
    RT_EQ(remap_set_mesh(ctx, side, &mine[side]->view), REMAP_OK);
  }
  r.ok = rt_all(RT_EQ(remap_build(ctx), REMAP_OK));
  if (r.ok) {
    double *one = tm_alloc_(mine[0]->view.num_cells, sizeof *one), *out = tm_alloc_(mine[1]->view.num_cells, sizeof *out);
    remap_field_desc field = {.name = "one", .nature = REMAP_CONSERVED, .in = one, .out = out, .has_old = 1};

    for (int64_t c = 0; c < mine[0]->view.num_cells; c++) one[c] = 1;
    remap_transfer_default(&how);
    how.on_partial = REMAP_PARTIAL_CONSERVE;
    RT_EQ(remap_field(ctx, REMAP_FORWARD, &how, 1, &field, &r.report), REMAP_OK);
    RT_EQ(remap_get_stats(ctx, &r.stats), REMAP_OK);
    for (int side = 0; side < 2; side++) RT_CHECK(r.stats.max_closure_error[side] <= 1e-12);
    RT_CHECK(r.report.conservation_error <= 1e-14);
    RT_NEAR(r.report.target_integral, r.stats.overlap_volume, 1e-13 * r.stats.overlap_volume);
    free(one), free(out);
  } else if (rt_rank() == 0) {
    printf("# %s\n", remap_message(ctx));
  }
  remap_destroy(&ctx);
  for (int side = 0; side < 2; side++) tm_free(mine[side]);
  return r;
}

/* Overlay two meshes that this frees. */
static result overlay_once(tm_mesh *source, tm_mesh *target, remap_faces faces)
{
  const result r = overlay(source, target, faces);
  tm_free(source), tm_free(target);
  return r;
}

static void the_unit_of_length_does_not_matter(void)
{
  static const double scale[] = {1e-5, 1e-3, 1, 1e3, 1e6};

  for (uint64_t seed = 1; seed <= SEEDS; seed++) {
    int64_t pairs = 0;
    for (int k = 0; k < 5; k++) {
      uint64_t     s = seed;
      const double m[12] = {scale[k], 0, 0, 0, 0, scale[k], 0, 0, 0, 0, scale[k], 0};
      tm_mesh     *source = warped(4, &s), *target = warped(5, &s);
      tm_move(source, tm_affine, m), tm_move(target, tm_affine, m);
      const result r = overlay_once(source, target, REMAP_FACES_CENTRE);
      if (k == 0) pairs = r.stats.pairs;
      RT_CHECK(r.stats.pairs > 0 && llabs(r.stats.pairs - pairs) <= 2); /* coordinates round differently */
      RT_NEAR(r.stats.overlap_volume / (scale[k] * scale[k] * scale[k]), r.stats.volume[0] / (scale[k] * scale[k] * scale[k]),
              0.2);
    }
  }
}

static void a_place_far_from_the_origin_does_not_matter(void)
{
  for (uint64_t seed = 1; seed <= SEEDS; seed++) {
    uint64_t s = seed;
    double   m[12];
    tm_mesh *source = warped(4, &s), *target = tm_tetrahedra((int[]){3, 3, 3}, NULL, NULL);
    random_motion(&s, 1, (double[3]){1e6, -2e6, 0.3e6}, m);
    tm_move(source, tm_affine, m), tm_move(target, tm_affine, m);
    const result r = overlay_once(source, target, REMAP_FACES_CENTRE);
    RT_NEAR(r.stats.volume[1], 1, 1e-8); /* coordinates are rounded to 1e-10 there */
    RT_CHECK(r.stats.overlap_volume > 0.8);
  }
}

static void a_mesh_inside_one_cell_of_the_other_is_wholly_mapped(void)
{
  for (uint64_t seed = 1; seed <= SEEDS; seed++)
    for (int inner = 0; inner < 2; inner++) {
      uint64_t s = seed;
      double   m[12];
      tm_mesh *big = tm_hexahedra((int[]){2, 2, 2}, NULL, NULL), *small = warped(3, &s);
      random_motion(&s, 0.05, (double[3]){0.25, 0.25, 0.25}, m);
      tm_move(small, tm_affine, m);
      const result r = inner == 0 ? overlay_once(small, big, REMAP_FACES_CENTRE) : overlay_once(big, small, REMAP_FACES_CENTRE);
      RT_EQ(r.stats.pairs, 27);
      RT_EQ(r.stats.cells_by_cover[inner][REMAP_COVERED], 27);
      RT_EQ(r.stats.cells_by_cover[1 - inner][REMAP_PARTIAL], 1);
      RT_EQ(r.stats.cells_by_cover[1 - inner][REMAP_UNCOVERED], 7);
      RT_NEAR(r.stats.overlap_volume, r.stats.volume[inner], 1e-14 * r.stats.volume[inner]);
    }
}

static void a_gap_thinner_than_a_cell_stays_a_gap(void)
{
  for (uint64_t seed = 1; seed <= SEEDS; seed++) {
    uint64_t     s = seed;
    const double gap = uniform(&s, 1e-6, 0.05);
    tm_mesh     *source = tm_two_zones((int[]){3, 3, 3}, (int[]){2, 4, 4}, gap, NULL, NULL);
    const result r = overlay_once(source, tm_hexahedra((int[]){5, 5, 5}, NULL, NULL), REMAP_FACES_CENTRE);
    RT_NEAR(r.stats.overlap_volume, 1 - gap, 1e-14);
    RT_EQ(r.stats.cells_by_cover[1][REMAP_PARTIAL], 25);
    RT_EQ(r.stats.cells_by_cover[1][REMAP_COVERED], 100);
  }
}

/* Numbers of cells across the two zones and the other mesh, one to twelve of them. */
static void random_numbers(uint64_t *seed, int n[3][3])
{
  for (int mesh = 0; mesh < 3; mesh++)
    for (int d = 0; d < 3; d++) n[mesh][d] = 1 + (int)tm_random(seed, 12);
}

static void zones_that_touch_in_a_plane_are_whole_whatever_their_faces(void)
{
  for (uint64_t seed = 1; seed <= 2 * SEEDS; seed++) {
    uint64_t s   = seed;
    double   far = seed % 4 == 0 ? 1e4 : 0, thin = seed % 3 == 0 ? 1e-4 : 1;
    double   m[12] = {uniform(&s, .1, 1), 0, 0, far, 0, thin * uniform(&s, .1, 1), 0, far, 0, 0, uniform(&s, .1, 1), far};
    int      n[3][3];

    random_numbers(&s, n);
    tm_mesh *mesh[2] = {tm_two_zones(n[0], n[1], 0, tm_affine, m), tm_hexahedra(n[2], tm_affine, m)};
    for (int zones = 0; zones < 2; zones++) {
      const result r = overlay(mesh[zones], mesh[1 - zones], REMAP_FACES_CENTRE);

      for (int side = 0; side < 2; side++) RT_EQ(r.stats.cells_by_cover[side][REMAP_COVERED], r.stats.cells[side]);
    }
    for (int k = 0; k < 2; k++) tm_free(mesh[k]);
  }
}

static void cells_a_million_times_smaller_are_not_dropped(void)
{
  for (uint64_t seed = 1; seed <= SEEDS; seed++) {
    uint64_t s = seed;
    double   m[12];
    tm_mesh *small = warped(3, &s);
    random_motion(&s, 1e-6, (double[3]){0.5, 0.5 - 3e-7, 0.5}, m); /* about a vertex of eight cells */
    tm_move(small, tm_affine, m);
    const result r =
        overlay_once(tm_hexahedra((int[]){2, 2, 2}, tm_warp, &(tm_warping){0.03, 0.4}), small, REMAP_FACES_DIAGONAL);
    RT_EQ(r.stats.cells_by_cover[1][REMAP_COVERED], 27);
    RT_NEAR(r.stats.overlap_volume, r.stats.volume[1], 1e-12 * r.stats.volume[1]);
  }
}

static void rotated_boxes_share_the_volume_known(void)
{
  /* A square of side 1 and the same turned by 45 degrees about its centre share a regular octagon of area 2 (sqrt(2) - 1). */
  const double c = sqrt(0.5), m[12] = {c, -c, 0, 0.5, c, c, 0, 0.5 - c, 0, 0, 1, 0.25};
  for (int n = 1; n <= 5; n++) {
    tm_mesh *turned = tm_hexahedra((int[]){n, n + 1, 2}, NULL, NULL);
    tm_move(turned, tm_affine, m);
    const result r = overlay_once(tm_hexahedra((int[]){3, n, 2}, NULL, NULL), turned, REMAP_FACES_CENTRE);
    RT_NEAR(r.stats.overlap_volume, 0.75 * 2 * (sqrt(2) - 1), 1e-14);
    RT_CHECK(r.stats.cells_by_cover[0][REMAP_PARTIAL] > 0 && r.stats.cells_by_cover[1][REMAP_PARTIAL] > 0);
  }
}

static void warped_faces_lose_nothing_on_either_side(void)
{
  for (uint64_t seed = 1; seed <= SEEDS; seed++)
    for (int faces = 0; faces < 2; faces++) {
      uint64_t     s = seed;
      double       m[12];
      tm_mesh     *inside = warped(4, &s);
      tm_mesh     *around = tm_hexahedra((int[]){5, 5, 5}, tm_warp, &(tm_warping){0.05, uniform(&s, 0, 6)});
      random_motion(&s, 0.3, (double[3]){0.5, 0.5, 0.5}, m);
      for (int k = 0; k < 3; k++) m[4 * k + 3] -= 0.5 * (m[4 * k] + m[4 * k + 1] + m[4 * k + 2]);
      tm_move(inside, tm_affine, m);
      const result r = seed % 2 ? overlay_once(inside, around, faces) : overlay_once(around, inside, faces);
      const int    in = seed % 2 ? 0 : 1;
      RT_EQ(r.stats.cells_by_cover[in][REMAP_COVERED], 64);
      RT_NEAR(r.stats.overlap_volume, r.stats.volume[in], 1e-14 * r.stats.volume[in]);
    }
}

static void disjoint_and_touching_meshes_share_nothing(void)
{
  static const double shift[][3] = {{3, 0, 0}, {1, 0, 0}, {1, 0.3, 0.2}, {1, 1, 0}, {1, 1, 1}, {0, 0, -1}, {1 + 0x1p-52, 0, 0}};

  for (int k = 0; k < 7; k++) {
    const double m[12] = {1, 0, 0, shift[k][0], 0, 1, 0, shift[k][1], 0, 0, 1, shift[k][2]};
    tm_mesh     *other = tm_tetrahedra((int[]){2, 3, 2}, NULL, NULL);
    tm_move(other, tm_affine, m);
    const result r = overlay_once(tm_hexahedra((int[]){3, 3, 3}, NULL, NULL), other, REMAP_FACES_CENTRE);
    RT_EQ(r.stats.pairs, 0);
    RT_NEAR(r.stats.overlap_volume, 0, 0.0);
    for (int side = 0; side < 2; side++) RT_EQ(r.stats.cells_by_cover[side][REMAP_UNCOVERED], r.stats.cells[side]);
  }
}

static void an_overlap_a_millionth_of_a_millionth_thick_survives(void)
{
  const double thin = 0x1p-40, m[12] = {1, 0, 0, 1 - thin, 0, 1, 0, 0, 0, 0, 1, 0};
  tm_mesh     *other = tm_hexahedra((int[]){2, 2, 2}, NULL, NULL);
  tm_move(other, tm_affine, m);
  const result r = overlay_once(tm_hexahedra((int[]){2, 2, 2}, NULL, NULL), other, REMAP_FACES_CENTRE);
  RT_EQ(r.stats.pairs, 4);
  RT_NEAR(r.stats.overlap_volume, thin, 1e-15 * thin);
}

/* On a cylinder of radius 1: x is the angle, y runs along the axis, z through layers 1e-5 thick in all. */
static void to_curved_wall(double x[3], const void *data)
{
  const double r = 1 + 1e-5 * x[2], a = x[0] + *(const double *)data;

  x[0] = r * cos(a);
  x[2] = r * sin(a);
}

static void layers_of_pancakes_on_a_curved_wall_fill_each_other(void)
{
  for (uint64_t seed = 1; seed <= SEEDS; seed++)
    for (int faces = 0; faces < 2; faces++) {
      uint64_t     s     = seed;
      const double angle = uniform(&s, 0, 6);
      const result r = overlay_once(tm_hexahedra((int[]){6, 6, 5}, to_curved_wall, &angle),
                                    tm_hexahedra((int[]){6, 6, 7}, to_curved_wall, &angle), faces);
      RT_NEAR(r.stats.overlap_volume, r.stats.volume[0], 1e-6 * r.stats.volume[0]); /* radii are rounded, each for itself */
      RT_CHECK(r.stats.pairs >= 36 * 11);
      RT_EQ(r.stats.cells_by_cover[0][REMAP_UNCOVERED] + r.stats.cells_by_cover[1][REMAP_UNCOVERED], 0);
    }
}

/* The middle of each axis moves to 1e-3 of its length. */
static void to_uneven(double x[3], const void *unused)
{
  (void)unused;
  for (int k = 0; k < 3; k++) x[k] = x[k] <= 0.5 ? 2e-3 * x[k] : 1e-3 + (x[k] - 0.5) * 1.998;
}

static void neighbours_a_thousand_million_times_larger_do_not_matter(void)
{
  const result r = overlay_once(tm_hexahedra((int[]){2, 2, 2}, to_uneven, NULL),
                                tm_hexahedra((int[]){4, 4, 4}, to_uneven, NULL), REMAP_FACES_CENTRE);
  RT_NEAR(r.stats.overlap_volume, 1, 1e-14);
  RT_EQ(r.stats.pairs, 64);
  for (uint64_t seed = 1; seed <= SEEDS; seed++) {
    uint64_t     s = seed;
    double       m[12];
    tm_mesh     *other = warped(4, &s);
    random_motion(&s, 4e-3, (double[3]){1e-3, 1e-3, 1e-3}, m); /* across the small cell and into its large neighbours */
    for (int k = 0; k < 3; k++) m[4 * k + 3] -= 0.5 * (m[4 * k] + m[4 * k + 1] + m[4 * k + 2]);
    tm_move(other, tm_affine, m);
    RT_CHECK(overlay_once(tm_hexahedra((int[]){2, 2, 2}, to_uneven, NULL), other, REMAP_FACES_DIAGONAL).stats.pairs > 8);
  }
}

RT_MAIN(RT_CASE(layers_of_pancakes_on_a_curved_wall_fill_each_other),
        RT_CASE(neighbours_a_thousand_million_times_larger_do_not_matter), RT_CASE(the_unit_of_length_does_not_matter),
        RT_CASE(a_place_far_from_the_origin_does_not_matter), RT_CASE(a_mesh_inside_one_cell_of_the_other_is_wholly_mapped),
        RT_CASE(a_gap_thinner_than_a_cell_stays_a_gap),
        RT_CASE(zones_that_touch_in_a_plane_are_whole_whatever_their_faces),
        RT_CASE(cells_a_million_times_smaller_are_not_dropped),
        RT_CASE(rotated_boxes_share_the_volume_known), RT_CASE(warped_faces_lose_nothing_on_either_side),
        RT_CASE(disjoint_and_touching_meshes_share_nothing), RT_CASE(an_overlap_a_millionth_of_a_millionth_thick_survives))
