/* Volumes and centroids of cells, warped, thin, flat, collapsed, far away: to the last bits. */
#include "built.h"

/* Hexahedra on integer nodes: x = shift + i a + j b + k c + noise, all multiples of 4 so that face centres are integers too. */
typedef struct skewed {
  int64_t a[3], b[3], c[3], shift[3];
  int     noise;
} skewed;

static void integer_node(const skewed *s, const int n[3], int64_t v, int64_t x[3])
{
  const int64_t i = v % (n[0] + 1), j = v / (n[0] + 1) % (n[1] + 1), k = v / (n[0] + 1) / (n[1] + 1);
  uint64_t      state = (uint64_t)v * 3;

  for (int d = 0; d < 3; d++)
    x[d] = 4 * (i * s->a[d] + j * s->b[d] + k * s->c[d] + (s->noise ? tm_random(&state, s->noise) : 0));
}

static int64_t det(const int64_t a[3], const int64_t b[3], const int64_t c[3])
{
  return a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0]);
}

/* 6 V and 24 M of one hexahedron about its first node, which is put into origin, exactly. Faces are fans about their means,
 * or, if planar, any fan. Sums of 24 M stay below 2^53 too if coordinates stay below 2^12 or so; then they are exact. */
static void integer_moments(const skewed *s, const int n[3], const tm_mesh *mesh, int64_t cell, int64_t origin[3], int64_t *six,
                            double moment[3])
{
  bool started = false;

  *six      = 0;
  moment[0] = moment[1] = moment[2] = 0.0;
  for (int64_t f = 0; f < mesh->view.num_faces; f++) {
    const int64_t sign = mesh->owner[f] == cell ? 1 : mesh->neighbour[f] == cell ? -1 : 0;
    int64_t       x[4][3], mean[3] = {0, 0, 0};

    if (!sign) continue;
    for (int k = 0; k < 4; k++) integer_node(s, n, mesh->face_node[4 * f + k], x[k]);
    for (int d = 0; d < 3 && !started; d++) origin[d] = x[0][d];
    started = true;
    for (int k = 0; k < 4; k++)
      for (int d = 0; d < 3; d++) {
        x[k][d] -= origin[d];
        mean[d] += x[k][d] / 4;
      }
    for (int k = 0; k < 4; k++) {
      const int64_t w = sign * det(mean, x[k], x[(k + 1) % 4]);

      *six += w;
      for (int d = 0; d < 3; d++) moment[d] += (double)w * (double)(mean[d] + x[k][d] + x[(k + 1) % 4][d]);
    }
  }
}

/* All volumes within 2^-50; centroids, relative to the cell, within `by` of its size. */
static void check_skewed(const skewed *s, double by)
{
  const int      n[3]  = {3, 2, 2};
  tm_mesh       *whole = tm_hexahedra(n, NULL, NULL);
  rm_arena      *arena = rm_arena_new();
  rm_frame       frame;
  const rm_mesh *mesh;

  for (int64_t v = 0; v < whole->view.num_nodes; v++) {
    int64_t x[3];

    integer_node(s, n, v, x);
    for (int d = 0; d < 3; d++) whole->xyz[3 * v + d] = (double)(x[d] + s->shift[d]);
  }
  mesh = build(arena, MPI_COMM_SELF, &whole->view, REMAP_FACES_CENTRE, &frame);
  for (rm_lid c = 0; mesh && c < mesh->num_cells; c++) {
    const double scale = frame.scale;
    double       moment[3];
    int64_t      origin[3], six;

    integer_moments(s, n, whole, c, origin, &six, moment);
    RT_NEAR(mesh->cell_volume[c] * 6, (double)six * scale * scale * scale, fabs((double)six) * scale * scale * scale * 0x1p-50);
    for (int d = 0; d < 3; d++) {
      const double at    = (double)(origin[d] + s->shift[d]) + moment[d] / (4 * (double)six);
      const double width = mesh->cell_box[c][d + 3] - mesh->cell_box[c][d];

      RT_NEAR(mesh->cell_centroid[c][d], at * scale, by * width + fabs(at * scale) * 0x1p-52);
    }
  }
  tm_free(whole);
  rm_arena_drop(arena);
}

static void volumes_of_warped_cells_are_good_to_fifty_bits_anywhere(void)
{
  const int64_t far = (int64_t)1 << 44;

  check_skewed(&(skewed){{100, 0, 0}, {0, 110, 0}, {0, 0, 120}, {0, 0, 0}, 30}, 0x1p-50);
  check_skewed(&(skewed){{100, 7, -9}, {-5, 110, 30}, {20, -8, 120}, {0, 0, 0}, 30}, 0x1p-50);
  check_skewed(&(skewed){{100, 7, -9}, {-5, 110, 30}, {20, -8, 120}, {far, -3 * far, 5 * far}, 30}, 0x1p-50);
}

static void so_are_those_of_oblique_pancakes_and_needles(void)
{
  const int64_t far = (int64_t)1 << 40;

  /* Volume about 1e-5 of the box's; c is as good as in the plane of a and b. */
  check_skewed(&(skewed){{20000, 31000, -7000}, {-9000, 15000, 33000}, {1, 0, 1}, {0, 0, 0}, 0}, 0x1p-49);
  check_skewed(&(skewed){{20000, 31000, -7000}, {-9000, 15000, 33000}, {1, 0, 1}, {far, far, -far}, 0}, 0x1p-49);
  check_skewed(&(skewed){{20000, 31000, -7000}, {3, -1, 1}, {1, 2, -2}, {far, 0, 0}, 0}, 0x1p-49);
}

/* An angle of two thin legs, its box's centre far outside of it, on integer nodes: 6-gons at z = 0 and h, sheared and moved. */
static void those_of_a_thin_angle_do_not_suffer_from_its_empty_box(void)
{
  const double   leg = 40000, t = 4, h = 20000, far = 0x1p40;
  const double   outline[6][2] = {{0, 0}, {leg, 0}, {leg, t}, {t, t}, {t, leg}, {0, leg}};
  const int64_t  node[]        = {5, 4, 3, 2, 1, 0, 6, 7, 8,  9, 10, 11, 0,  1,  7, 6, 1, 2,
                                  8, 7, 2, 3, 9, 8, 3, 4, 10, 9, 4,  5,  11, 10, 5, 0, 6, 11};
  const int64_t  offset[] = {0, 6, 12, 16, 20, 24, 28, 32, 36}, owner[8] = {0}, neighbour[] = {-1, -1, -1, -1, -1, -1, -1, -1};
  const double   area = leg * t + t * (leg - t), mean = (leg * t * leg / 2 + t * (leg - t) * t / 2) / area;
  double         xyz[36];
  rm_arena      *arena = rm_arena_new();
  rm_frame       frame;
  remap_mesh     given = {.num_nodes      = 12,
                          .num_faces      = 8,
                          .num_cells      = 1,
                          .node_xyz       = xyz,
                          .face_offset    = offset,
                          .face_node      = node,
                          .face_owner     = owner,
                          .face_neighbour = neighbour};
  const rm_mesh *mesh;

  for (int i = 0; i < 12; i++) {
    const double x = outline[i % 6][0], y = outline[i % 6][1], z = i < 6 ? 0 : h;

    xyz[3 * i]     = x + 3 * y - 2 * z + far; /* a map of determinant 35 */
    xyz[3 * i + 1] = y + 5 * z - far;
    xyz[3 * i + 2] = 2 * x + z;
  }
  mesh = build(arena, MPI_COMM_SELF, &given, REMAP_FACES_CENTRE, &frame);
  if (mesh) {
    const double scale = frame.scale, volume = 35 * area * h * scale * scale * scale;
    const double at[3] = {mean + 3 * mean - h + far, mean + 5 * h / 2 - far, 2 * mean + h / 2};

    RT_NEAR(mesh->cell_volume[0], volume, volume * 0x1p-50);
    for (int a = 0; a < 3; a++) RT_NEAR(mesh->cell_centroid[0][a], at[a] * scale, 0x1p-50 * (leg + fabs(at[a])) * scale);
  }
  rm_arena_drop(arena);
}

/* One hexahedron of which every node is moved. */
static const rm_mesh *single(rm_arena *arena, tm_map map, const void *data, rm_frame *frame)
{
  tm_mesh       *mesh = tm_hexahedra((int[]){1, 1, 1}, map, data);
  const rm_mesh *out  = build(arena, MPI_COMM_SELF, &mesh->view, REMAP_FACES_CENTRE, frame);

  tm_free(mesh);
  return out;
}

static void oblique_flat(double x[3], const void *unused)
{
  (void)unused;
  x[0] = 0.3 + 0.7 * x[0] + 0.1 * x[1] + 0.05 * x[2]; /* three doubles of which the third is the exact sum of the others */
  x[1] = floor(x[1] * 1e6 + x[2] * 3e5) * 0x1p-20 + 0.25;
  x[0] = ldexp(floor(ldexp(x[0], 30)), -30);
  x[2] = x[0] + x[1];
}

static void a_flat_cell_has_no_volume_and_its_boxes_centre(void)
{
  rm_arena      *arena = rm_arena_new();
  rm_frame       frame;
  const rm_mesh *mesh = single(arena, oblique_flat, NULL, &frame);

  if (mesh) {
    RT_NEAR(mesh->cell_volume[0], 0.0, 0.0);
    RT_EQ(mesh->num_inverted, 0);
    for (int a = 0; a < 3; a++)
      RT_NEAR(mesh->cell_centroid[0][a], 0.5 * (mesh->cell_box[0][a] + mesh->cell_box[0][a + 3]), 0.0);
  }
  rm_arena_drop(arena);
}

static void a_cell_one_ulp_thick_has_a_true_volume(void)
{
  /* The fourth node lies one ulp above the oblique plane of the others: 6 V = ulp (a x b)_z. */
  const double   ulp = 0x1p-53, xyz[] = {0.125, 0.25, 0.25, 0.5, 0.375, 0.25, 0.25, 0.5, 0.625, 0.625, 0.625, 0.625 + ulp};
  const int64_t  offset[] = {0, 3, 6, 9, 12}, node[] = {0, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2}, owner[4] = {0};
  const int64_t  neighbour[] = {-1, -1, -1, -1};
  remap_mesh     given       = {.num_nodes      = 4,
                                .num_faces      = 4,
                                .num_cells      = 1,
                                .node_xyz       = xyz,
                                .face_offset    = offset,
                                .face_node      = node,
                                .face_owner     = owner,
                                .face_neighbour = neighbour};
  rm_arena      *arena       = rm_arena_new();
  rm_frame       frame;
  const rm_mesh *mesh = build(arena, MPI_COMM_SELF, &given, REMAP_FACES_CENTRE, &frame);

  if (mesh) {
    RT_NEAR(mesh->cell_volume[0], ulp * (0.375 * 0.25 - 0.125 * 0.125) / 6, 0x1p-110);
    for (int a = 0; a < 3; a++)
      RT_NEAR(mesh->cell_centroid[0][a], (xyz[a] + xyz[a + 3] + xyz[a + 6] + xyz[a + 9]) / 4, 0x1p-53);
  }
  rm_arena_drop(arena);
}

/* x = 0 shrinks to a line, y = 0 too: wedges and worse, still as hexahedra. */
static void collapse(double x[3], const void *kind)
{
  const int k = *(const int *)kind;

  if (k == 0) x[1] *= x[0];                      /* one face becomes an edge            */
  if (k == 1) x[1] *= x[0], x[2] *= x[0];        /* one face becomes a point            */
  if (k == 2) x[0] *= x[1] * x[2];               /* two edges fall together             */
  if (k == 3) x[0] = x[1] = x[2] = 0.5;          /* all is one point                    */
  if (k == 4 && x[0] == x[1]) x[0] = x[1] = 0.5; /* opposite edges touch: pinched faces */
}

static void collapsed_hexahedra_are_welcome(void)
{
  const double volume[] = {0.5, 1.0 / 3, 0.25, 0.0, 0.0};

  for (int kind = 0; kind < 5; kind++) {
    rm_arena      *arena = rm_arena_new();
    rm_frame       frame;
    const rm_mesh *mesh = single(arena, collapse, &kind, &frame);

    if (mesh && kind != 2 && kind != 4) RT_NEAR(mesh->cell_volume[0], volume[kind] / 8, 0x1p-53);
    if (mesh && kind == 3) RT_EQ(mesh->num_faces, 0);
    if (mesh && kind == 0) RT_EQ(mesh->num_faces, 5);
    if (mesh && kind == 3) RT_NEAR(mesh->cell_centroid[0][1], 0.5, 0.0);
    rm_arena_drop(arena);
  }
}

RT_MAIN(RT_CASE(volumes_of_warped_cells_are_good_to_fifty_bits_anywhere),
        RT_CASE(so_are_those_of_oblique_pancakes_and_needles),
        RT_CASE(those_of_a_thin_angle_do_not_suffer_from_its_empty_box),
        RT_CASE(a_flat_cell_has_no_volume_and_its_boxes_centre), RT_CASE(a_cell_one_ulp_thick_has_a_true_volume),
        RT_CASE(collapsed_hexahedra_are_welcome))
