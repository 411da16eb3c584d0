/* Pairs of small polyhedral meshes whose coordinates have so few bits that nodes, edges and faces of the two coincide: the
 * overlay never contradicts itself, volumes and first moments of a covered cell's pairs sum to its own, the pairs of the
 * swapped meshes are the same, and constants stay constant. The bytes choose two meshes, move and merge their nodes and merge
 * their cells; cells may become tangled, inverted or flat. On more than one rank the cells are dealt by lot, and everything
 * must be bitwise what one rank finds. */
#include "fuzz.h"
#include "meshes.h"

#define CLOSURE 1e-12 /* DESIGN section 7, over a cube about the cell */

/* ---- meshes ---------------------------------------------------------------------------------------------------------- */

typedef struct placing {
  double scale[3], shift[3];
} placing;

static void place(double xyz[3], const void *data)
{
  const placing *p = data;

  for (int d = 0; d < 3; d++) xyz[d] = p->scale[d] * xyz[d] + p->shift[d];
}

/* Let the two cells beside a face be one: faces between them vanish. */
static void merge_across(tm_mesh *m, int64_t face)
{
  const int64_t keep = m->owner[face], drop = m->neighbour[face], last = m->view.num_cells - 1;
  int64_t       num = 0, corner = 0;

  if (drop < 0) return;
  for (int64_t f = 0; f < m->view.num_faces; f++) {
    const int64_t begin = m->face_offset[f], end = m->face_offset[f + 1];
    int64_t       side[2] = {m->owner[f], m->neighbour[f]};

    for (int k = 0; k < 2; k++) {
      if (side[k] == drop) side[k] = keep;
      if (side[k] == last) side[k] = drop;
    }
    m->face_offset[num] = corner; /* at or before what is still to be read */
    if (side[0] == side[1]) continue;
    for (int64_t i = begin; i < end; i++) m->face_node[corner++] = m->face_node[i];
    m->owner[num]       = side[0];
    m->neighbour[num++] = side[1];
  }
  m->face_offset[num]   = corner;
  m->view.num_faces = num;
  m->view.num_cells = last;
}

/* *is_tame: no node is moved by itself. */
static tm_mesh *decode(fuzz_bytes *b, bool *is_tame)
{
  static tm_mesh *(*const maker[])(const int n[3], tm_map map, const void *data) = {
      tm_hexahedra, tm_hexahedra, tm_tetrahedra, tm_prisms, tm_pyramids, tm_dual};
  static const double scale[] = {1.0, 1.0, 0.5, 2.0, 0.75, -1.0 + 0x1p-20 + 2.0},
                      shift[] = {0.0, 0.0, 0.5, 0.25, -0.5, 0x1p-40};
  const int           num = (int)(sizeof maker / sizeof *maker), which = (int)fuzz_below(b, num + 1);
  const int           most = which < 2 ? 3 : which < 4 ? 2 : 1;
  int                 n[3];
  placing             p;
  tm_mesh            *m;

  for (int d = 0; d < 3; d++) {
    const int64_t choice = fuzz_byte(b);

    n[d]       = 1 + (int)(choice % most);
    p.scale[d] = scale[choice / 3 % 6];
    p.shift[d] = shift[choice / 18 % 6];
  }
  m = which < num ? maker[which](n, place, &p) : tm_refined((int[]){2, 1, 1}, tm_right_half, place, &p);
  for (int64_t ops = fuzz_below(b, 12); ops && b->left; ops--) {
    const int64_t kind = fuzz_below(b, 8), v = fuzz_below(b, m->view.num_nodes), w = fuzz_below(b, m->view.num_nodes);

    *is_tame = *is_tame && kind > 4;
    if (kind == 0)
      memcpy(m->xyz + 3 * v, m->xyz + 3 * w, 3 * sizeof(double));
    else if (kind < 4)
      m->xyz[3 * v + kind - 1] += (double)(fuzz_below(b, 9) - 4) / 16;
    else if (kind == 4)
      m->xyz[3 * v + fuzz_below(b, 3)] += ldexp((double)(fuzz_below(b, 3) - 1), -(int)fuzz_below(b, 52));
    else if (m->view.num_cells > 1)
      merge_across(m, fuzz_below(b, m->view.num_faces));
  }
  return m;
}

/* Volume of a cube about every cell: what sums are compared against. The caller frees. */
static double *cube_volumes(const remap_mesh *m)
{
  double *box = tm_alloc_(6 * m->num_cells, sizeof *box), *volume = tm_alloc_(m->num_cells, sizeof *volume);

  for (int64_t i = 0; i < 6 * m->num_cells; i++) box[i] = i % 6 < 3 ? INFINITY : -INFINITY;
  for (int64_t f = 0; f < m->num_faces; f++)
    for (int64_t i = m->face_offset[f]; i < m->face_offset[f + 1]; i++)
      for (int side = 0; side < 2; side++) {
        const int64_t c = side ? m->face_neighbour[f] : m->face_owner[f];

        for (int d = 0; c >= 0 && d < 3; d++) {
          const double x = m->node_xyz[3 * m->face_node[i] + d];

          box[6 * c + d]     = fmin(box[6 * c + d], x);
          box[6 * c + 3 + d] = fmax(box[6 * c + 3 + d], x);
        }
      }
  for (int64_t c = 0; c < m->num_cells; c++) {
    double extent = 0.0;

    for (int d = 0; d < 3; d++) extent = fmax(extent, box[6 * c + 3 + d] - box[6 * c + d]);
    volume[c] = extent * extent * extent;
  }
  free(box);
  return volume;
}

/* ---- what must hold ---------------------------------------------------------------------------------------------------- */

/* The status, or the reason why not. */
static void expect(const remap_context *ctx, remap_status got, remap_status want)
{
  if (got != want) fprintf(stderr, "%s\n", remap_message(ctx));
  FUZZ_CHECK(got == want);
}

static remap_context *overlaid(MPI_Comm comm, remap_faces faces, const remap_mesh *source, const remap_mesh *target,
                               remap_status *status)
{
  remap_context *ctx = NULL;
  remap_options  options;

  remap_options_default(&options);
  options.faces = faces;
  FUZZ_CHECK(remap_create(comm, &options, &ctx) == REMAP_OK);
  FUZZ_CHECK(remap_set_mesh(ctx, REMAP_SOURCE, source) == REMAP_OK && remap_set_mesh(ctx, REMAP_TARGET, target) == REMAP_OK);
  *status = remap_build(ctx);
  if (*status != REMAP_BAD_MESH) expect(ctx, *status, REMAP_OK); /* faces of different cells may have become one */
  return ctx;
}

/* Which receiving cells are covered; the caller frees. */
static bool *covered(remap_context *ctx, int direction, int64_t n)
{
  remap_cover *cover = tm_alloc_(n, sizeof *cover);
  bool        *is    = tm_alloc_(n, sizeof *is);

  FUZZ_CHECK(remap_coverage(ctx, (remap_side)(1 - direction), NULL, cover) == REMAP_OK);
  for (int64_t c = 0; c < n; c++) is[c] = cover[c] == REMAP_COVERED;
  free(cover);
  return is;
}

/* Volumes of a covered cell's pairs sum to its own; so do first moments, once they are about one point. */
static void check_closure(remap_context *ctx, int direction, const remap_mesh *giving, const remap_mesh *receiving)
{
  const remap_side in = (remap_side)direction, out = (remap_side)(1 - direction);
  const int64_t    n = receiving->num_cells, m = giving->num_cells;
  double *volume = tm_alloc_(n, sizeof *volume), *centre = tm_alloc_(3 * m, sizeof *centre), *cube = cube_volumes(receiving);
  double          *own_centre = tm_alloc_(3 * n, sizeof *own_centre);
  bool            *is_covered = covered(ctx, direction, n);
  remap_pairs_view p;

  FUZZ_CHECK(remap_pairs(ctx, (remap_direction)direction, &p) == REMAP_OK && p.num_rows == n);
  FUZZ_CHECK(remap_cells(ctx, out, volume, own_centre) == REMAP_OK && remap_cells(ctx, in, NULL, centre) == REMAP_OK);
  for (int64_t c = 0; c < n; c++) {
    double sum = 0.0, moment[3] = {0, 0, 0};

    for (int64_t k = p.row_offset[c]; k < p.row_offset[c + 1]; k++) {
      FUZZ_CHECK(isfinite(p.volume[k]));
      sum += p.volume[k];
      for (int d = 0; d < 3; d++)
        moment[d] += p.moment[3 * k + d] + p.volume[k] * (centre[3 * p.global_cell[k] + d] - own_centre[3 * c + d]);
    }
    if (!is_covered[c]) continue;
    FUZZ_CHECK(fabs(sum - volume[c]) <= CLOSURE * cube[c]);
    if (fabs(volume[c]) < 1e-3 * cube[c]) continue; /* a centroid far outside of the cell */
    for (int d = 0; d < 3; d++) FUZZ_CHECK(fabs(moment[d]) <= 100 * CLOSURE * cube[c]);
  }
  free(volume);
  free(centre);
  free(own_centre);
  free(cube);
  free(is_covered);
}

/* A constant stays constant. */
static void check_constant(remap_context *ctx, int direction, const remap_mesh *giving, const remap_mesh *receiving)
{
  const int64_t      n = receiving->num_cells;
  double            *in = tm_alloc_(giving->num_cells, sizeof *in), *out = tm_alloc_(n, sizeof *out);
  double            *volume = tm_alloc_(n, sizeof *volume), *cube = cube_volumes(receiving);
  bool              *is_covered = covered(ctx, direction, n);
  remap_field_desc   field = {.name = "one", .nature = REMAP_CONSERVED, .in = in, .out = out};
  remap_field_report report;
  remap_stats        stats;
  remap_transfer     how;

  for (int64_t c = 0; c < giving->num_cells; c++) in[c] = 1.0;
  remap_transfer_default(&how);
  FUZZ_CHECK(remap_get_stats(ctx, &stats) == REMAP_OK);
  expect(ctx, remap_field(ctx, (remap_direction)direction, &how, 1, &field, &report), stats.pairs ? REMAP_OK : REMAP_COVERAGE);
  FUZZ_CHECK(remap_cells(ctx, (remap_side)(1 - direction), volume, NULL) == REMAP_OK);
  for (int64_t c = 0; c < n; c++)
    if (is_covered[c] && fabs(volume[c]) > 1e-3 * cube[c]) FUZZ_CHECK(stats.pairs && fabs(out[c] - 1.0) <= 1e3 * CLOSURE);
  free(in);
  free(out);
  free(volume);
  free(cube);
  free(is_covered);
}

/* The volume of pair (c, g) of a row; 0 if there is none. */
static double pair_volume(const remap_pairs_view *p, int64_t c, int64_t g)
{
  for (int64_t k = p->row_offset[c]; k < p->row_offset[c + 1]; k++)
    if (p->global_cell[k] == g) return p->volume[k];
  return 0.0;
}

/* The pairs of one context are those of the other, whose meshes are swapped. */
static void check_swapped(remap_context *ctx, remap_context *back, const remap_mesh *source, const remap_mesh *target)
{
  remap_pairs_view p, q;
  double          *cube[2] = {cube_volumes(source), cube_volumes(target)};

  FUZZ_CHECK(remap_pairs(ctx, REMAP_FORWARD, &p) == REMAP_OK && remap_pairs(back, REMAP_BACKWARD, &q) == REMAP_OK);
  for (int64_t j = 0; j < target->num_cells; j++)
    for (int64_t i = 0; i < source->num_cells; i++) {
      const double least = fmin(cube[0][i], cube[1][j]);

      FUZZ_CHECK(fabs(pair_volume(&p, j, i) - pair_volume(&q, j, i)) <= CLOSURE * least);
    }
  free(cube[0]);
  free(cube[1]);
}

/* Rows of this rank's cells are bitwise those that one rank finds. */
static void check_same(remap_context *mine, const remap_mesh *part, remap_context *alone)
{
  remap_pairs_view p, q;

  FUZZ_CHECK(remap_pairs(mine, REMAP_FORWARD, &p) == REMAP_OK && remap_pairs(alone, REMAP_FORWARD, &q) == REMAP_OK);
  for (int64_t c = 0; c < p.num_rows; c++) {
    const int64_t k = p.row_offset[c], g = part->cell_global[c], n = p.row_offset[c + 1] - k, l = q.row_offset[g];

    FUZZ_CHECK(n == q.row_offset[g + 1] - l);
    if (n == 0) continue;
    FUZZ_CHECK(!memcmp(p.global_cell + k, q.global_cell + l, (size_t)n * sizeof *p.global_cell));
    FUZZ_CHECK(!memcmp(p.volume + k, q.volume + l, (size_t)n * sizeof *p.volume));
    FUZZ_CHECK(!memcmp(p.moment + 3 * k, q.moment + 3 * l, (size_t)n * 3 * sizeof *p.moment));
    FUZZ_CHECK(!memcmp(p.same + k, q.same + l, (size_t)n));
  }
}

/* The whole meshes, dealt over the ranks by lot. Collective. */
static void check_ranks(tm_mesh *const whole[2], remap_faces faces, remap_context *alone, remap_status expected, int size)
{
  tm_mesh       *part[2];
  remap_context *ctx;
  remap_status   status;
  int            me;

  MPI_Comm_rank(MPI_COMM_WORLD, &me);
  for (int side = 0; side < 2; side++) {
    int *rank = tm_deal(whole[side], size, TM_RANDOM, (uint64_t)side + 1);

    part[side] = tm_part(whole[side], rank, me, 3);
    free(rank);
  }
  ctx = overlaid(MPI_COMM_WORLD, faces, &part[0]->view, &part[1]->view, &status);
  FUZZ_CHECK(status == expected);
  if (status == REMAP_OK) check_same(ctx, &part[1]->view, alone);
  remap_destroy(&ctx);
  for (int side = 0; side < 2; side++) tm_free(part[side]);
}

void fuzz_one(const uint8_t *data, size_t size)
{
  fuzz_bytes        b     = {data, size};
  const remap_faces faces = fuzz_byte(&b) & 1 ? REMAP_FACES_DIAGONAL : REMAP_FACES_CENTRE;
  tm_mesh          *mesh[2];
  remap_context    *ctx, *back;
  remap_status      status[2];
  bool              is_tame[2] = {true, true};
  int               ranks;

  for (int side = 0; side < 2; side++) mesh[side] = decode(&b, &is_tame[side]);
  ctx  = overlaid(MPI_COMM_SELF, faces, &mesh[0]->view, &mesh[1]->view, &status[0]);
  back = overlaid(MPI_COMM_SELF, faces, &mesh[1]->view, &mesh[0]->view, &status[1]);
  FUZZ_CHECK(status[0] == status[1]);
  if (status[0] == REMAP_OK) {
    fuzz_accepted++;
    for (int d = 0; d < 2; d++) {
      if (!is_tame[0] || !is_tame[1]) continue; /* tangled cells may wind about a point any number of times */
      check_closure(ctx, d, &mesh[d]->view, &mesh[1 - d]->view);
      check_constant(ctx, d, &mesh[d]->view, &mesh[1 - d]->view);
    }
    check_swapped(ctx, back, &mesh[0]->view, &mesh[1]->view);
  }
  MPI_Comm_size(MPI_COMM_WORLD, &ranks);
  if (ranks > 1) check_ranks(mesh, faces, ctx, status[0], ranks);
  remap_destroy(&ctx);
  remap_destroy(&back);
  for (int side = 0; side < 2; side++) tm_free(mesh[side]);
}
FUZZ_MAIN
