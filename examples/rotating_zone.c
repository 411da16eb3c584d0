/* rotating_zone -- libremap in an overset solver: a ring of cells rotates within a box of cells. Both are
 * distributed over all ranks.
 *
 *   mpirun -n 2 ./rotating_zone
 *
 * In every step the ring moves, and cells take their roles: the ring's innermost, outermost, lowest and highest cells (its
 * fringe) want values of the box; those of the box that the rest of the ring covers wholly (the hole) want values of the ring;
 * all others give. Both transfers run at once. The field is linear, so that what arrives is known. */
#include <remap/remap.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

enum { BOX = REMAP_SOURCE, RING = REMAP_TARGET, STEPS = 6 };

/* This rank's layers of a block of cells, and what the solver keeps for each cell. */
typedef struct zone {
  int        size[3];
  remap_mesh mesh;
  double    *xyz;
  int64_t   *face_offset, *face_node, *face_owner, *face_neighbour;
  uint8_t   *gives, *wants; /* [num_cells] masks */
  double    *centroid;      /* [num_cells][3]    */
  double    *density;       /* [num_cells]       */
} zone;

static const double pi = 3.14159265358979323846;

static double density_at(const double x[3]) { return 1 + x[0] + 2 * x[1] + 3 * x[2]; }

/* Node i, j, k of the box of n^3 cells. */
static void place_in_box(const int n[3], const int at[3], double xyz[3])
{
  for (int d = 0; d < 3; d++) xyz[d] = (double)at[d] / n[d];
}

/* Of the ring: radius, angle, height. The last angle is the first one, exactly, and so the ring closes. */
static void place_in_ring(const int n[3], const int at[3], double xyz[3])
{
  const double radius = .12 + .3 * at[0] / n[0], angle = 2 * pi * (at[1] % n[1]) / n[1];

  xyz[0] = .5 + radius * cos(angle);
  xyz[1] = .5 + radius * sin(angle);
  xyz[2] = .13 + .71 * at[2] / n[2];
}

static int64_t node_at(const zone *z, const int at[3])
{
  return at[0] + (z->size[0] + 1) * (at[1] + (z->size[1] + 1) * (int64_t)at[2]);
}

static int64_t cell_at(const zone *z, const int at[3]) { return at[0] + z->size[0] * (at[1] + z->size[1] * (int64_t)at[2]); }

/* The face across axis d whose lowest corner is `at`: it belongs to the cell below, or to the one above where there is none. */
static void add_face(zone *z, int d, const int at[3])
{
  const int     e = (d + 1) % 3, f = (d + 2) % 3;
  const int     is_first = at[d] == 0, is_last = at[d] == z->size[d];
  const int64_t face      = z->mesh.num_faces++;
  int           corner[3] = {at[0], at[1], at[2]}, below[3] = {at[0], at[1], at[2]};
  int64_t       loop[4];

  below[d]--;
  loop[0] = node_at(z, corner), corner[e]++;
  loop[1] = node_at(z, corner), corner[f]++;
  loop[2] = node_at(z, corner), corner[e]--;
  loop[3] = node_at(z, corner);
  for (int k = 0; k < 4; k++) z->face_node[4 * face + k] = loop[is_first ? 3 - k : k];
  z->face_offset[face + 1] = 4 * (face + 1);
  z->face_owner[face]      = cell_at(z, is_first ? at : below);
  z->face_neighbour[face]  = is_first || is_last ? -1 : cell_at(z, at);
}

/* This rank's share of the layers of a zone of n[0] * n[1] * n[2] cells. */
static int make_zone(zone *z, const int n[3], void (*place)(const int n[3], const int at[3], double xyz[3]), int rank,
                     int num_ranks)
{
  const int     first = n[2] * rank / num_ranks, last = n[2] * (rank + 1) / num_ranks, layers = last - first;
  const int64_t num_nodes = (int64_t)(n[0] + 1) * (n[1] + 1) * (layers + 1), num_cells = (int64_t)n[0] * n[1] * layers;
  const size_t  num_faces = (size_t)(3 * num_nodes);

  *z                = (zone){.size = {n[0], n[1], layers}};
  z->xyz            = malloc((size_t)num_nodes * 3 * sizeof *z->xyz);
  z->face_offset    = malloc((num_faces + 1) * sizeof *z->face_offset);
  z->face_node      = malloc(num_faces * 4 * sizeof *z->face_node);
  z->face_owner     = malloc(num_faces * sizeof *z->face_owner);
  z->face_neighbour = malloc(num_faces * sizeof *z->face_neighbour);
  z->gives          = malloc((size_t)num_cells + 1);
  z->wants          = malloc((size_t)num_cells + 1);
  z->centroid       = malloc(((size_t)num_cells + 1) * 3 * sizeof *z->centroid);
  z->density        = malloc(((size_t)num_cells + 1) * sizeof *z->density);
  if (!z->xyz || !z->face_offset || !z->face_node || !z->face_owner || !z->face_neighbour || !z->gives || !z->wants ||
      !z->centroid || !z->density)
    return 0;

  for (int k = first; k <= last; k++)
    for (int j = 0; j <= n[1]; j++)
      for (int i = 0; i <= n[0]; i++)
        place(n, (const int[3]){i, j, k}, z->xyz + 3 * node_at(z, (const int[3]){i, j, k - first}));
  z->face_offset[0] = 0;
  for (int d = 0; d < 3 && layers > 0; d++)
    for (int k = 0; k < layers + (d == 2); k++)
      for (int j = 0; j < n[1] + (d == 1); j++)
        for (int i = 0; i < n[0] + (d == 0); i++) add_face(z, d, (const int[3]){i, j, k});
  z->mesh.name           = place == place_in_box ? "box" : "ring";
  z->mesh.num_nodes      = layers > 0 ? num_nodes : 0;
  z->mesh.num_cells      = num_cells;
  z->mesh.node_xyz       = z->xyz;
  z->mesh.face_offset    = z->face_offset;
  z->mesh.face_node      = z->face_node;
  z->mesh.face_owner     = z->face_owner;
  z->mesh.face_neighbour = z->face_neighbour;

  for (int k = first; k < last; k++) /* the fringe; the box has none */
    for (int j = 0; j < n[1]; j++)
      for (int i = 0; i < n[0]; i++) {
        const int     is_fringe = place == place_in_ring && (i == 0 || i == n[0] - 1 || k == 0 || k == n[2] - 1);
        const int64_t cell      = cell_at(z, (const int[3]){i, j, k - first});

        z->wants[cell] = (uint8_t)is_fringe;
        z->gives[cell] = !is_fringe;
      }
  return 1;
}

static void free_zone(zone *z)
{
  free(z->xyz);
  free(z->face_offset);
  free(z->face_node);
  free(z->face_owner);
  free(z->face_neighbour);
  free(z->gives);
  free(z->wants);
  free(z->centroid);
  free(z->density);
}

/* The hole: cells of the box that the giving cells of the ring cover wholly want, the others give. */
static remap_status cut_hole(remap_context *ctx, zone zones[2])
{
  const remap_masks ring_alone = {.gives = {NULL, zones[RING].gives}};
  const int64_t     n          = zones[BOX].mesh.num_cells;
  remap_cover      *cover      = malloc(((size_t)n + 1) * sizeof *cover);
  remap_status      status     = remap_agree(ctx, cover ? REMAP_OK : REMAP_NO_MEMORY);

  if (status == REMAP_OK) status = remap_set_masks(ctx, &ring_alone);
  if (status == REMAP_OK) status = remap_coverage(ctx, REMAP_SOURCE, NULL, cover);
  for (int64_t c = 0; c < n && status == REMAP_OK; c++) {
    zones[BOX].wants[c] = cover[c] == REMAP_COVERED;
    zones[BOX].gives[c] = cover[c] != REMAP_COVERED;
  }
  free(cover);
  return status;
}

/* What came of a step on this rank. */
typedef struct outcome {
  int64_t wanting[2], orphans[2]; /* [zone] */
  double  error;                  /* largest distance from the field in a wanting cell */
} outcome;

/* The solver's own step: here, the field itself; cells that wait for values hold none. */
static remap_status solve(remap_context *ctx, zone zones[2])
{
  for (int side = 0; side < 2; side++) {
    const remap_status status = remap_cells(ctx, side, NULL, zones[side].centroid);

    if (status != REMAP_OK) return status;
    for (int64_t c = 0; c < zones[side].mesh.num_cells; c++)
      zones[side].density[c] = zones[side].gives[c] ? density_at(zones[side].centroid + 3 * c) : -1;
  }
  return REMAP_OK;
}

static remap_status step(remap_context *ctx, zone zones[2], double angle, outcome *out, remap_field_report report[2])
{
  const double       c = cos(angle), s = sin(angle), half = .5;
  const double       turn[12]  = {c, -s, 0, half - c * half + s * half, s, c, 0, half - s * half - c * half, 0, 0, 1, 0};
  const remap_motion motion[2] = {{NULL, NULL}, {NULL, turn}};
  const remap_masks  masks = {.gives = {zones[BOX].gives, zones[RING].gives}, .wants = {zones[BOX].wants, zones[RING].wants}};
  remap_field_desc   field[2];
  remap_transfer     how;
  remap_status       status;

  *out = (outcome){.error = 0};
  if ((status = remap_move(ctx, motion)) != REMAP_OK) return status;
  if ((status = cut_hole(ctx, zones)) != REMAP_OK) return status;
  if ((status = remap_set_masks(ctx, &masks)) != REMAP_OK) return status;
  if ((status = solve(ctx, zones)) != REMAP_OK) return status;

  remap_transfer_default(&how);
  how.limiter = REMAP_LIMITER_NONE; /* the field is smooth */
  for (int way = 0; way < 2; way++) {
    field[way] = (remap_field_desc){
        .name = "Density", .nature = REMAP_CONSERVED, .has_old = 1, .in = zones[way].density, .out = zones[1 - way].density};
    if ((status = remap_field_start(ctx, way, &how, 1, &field[way])) != REMAP_OK) return status;
  }
  /* work that needs no values of the other zone fits here */
  for (int way = 0; way < 2; way++)
    if ((status = remap_field_finish(ctx, way, &report[way])) != REMAP_OK) return status;

  for (int side = 0; side < 2; side++) {
    if ((status = remap_uncovered(ctx, side, &out->orphans[side], NULL)) != REMAP_OK) return status;
    for (int64_t i = 0; i < zones[side].mesh.num_cells; i++) {
      out->wanting[side] += zones[side].wants[i];
      out->error = fmax(out->error, fabs(zones[side].density[i] - density_at(zones[side].centroid + 3 * i)));
    }
  }
  return REMAP_OK;
}

/* Sum and maximum over the ranks. */
static void add_up(outcome *out)
{
  MPI_Allreduce(MPI_IN_PLACE, out->wanting, 2, MPI_INT64_T, MPI_SUM, MPI_COMM_WORLD);
  MPI_Allreduce(MPI_IN_PLACE, out->orphans, 2, MPI_INT64_T, MPI_SUM, MPI_COMM_WORLD);
  MPI_Allreduce(MPI_IN_PLACE, &out->error, 1, MPI_DOUBLE, MPI_MAX, MPI_COMM_WORLD);
}

int main(int argc, char **argv)
{
  zone           zones[2];
  remap_context *ctx = NULL;
  remap_status   status;
  int            rank, size, ok;

  MPI_Init(&argc, &argv);
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  MPI_Comm_size(MPI_COMM_WORLD, &size);
  ok = make_zone(&zones[BOX], (const int[3]){14, 14, 12}, place_in_box, rank, size);
  ok = make_zone(&zones[RING], (const int[3]){7, 36, 14}, place_in_ring, rank, size) && ok;

  status = remap_create(MPI_COMM_WORLD, NULL, &ctx);
  if (status == REMAP_OK) status = remap_agree(ctx, ok ? REMAP_OK : REMAP_NO_MEMORY);
  for (int side = 0; side < 2 && status == REMAP_OK; side++)
    status = remap_agree(ctx, remap_set_mesh(ctx, side, &zones[side].mesh));
  if (status == REMAP_OK) status = remap_build(ctx);
  if (rank == 0 && status == REMAP_OK) printf("step  hole fringe orphans  error     lost to ring, to box\n");
  for (int n = 1; n <= STEPS && status == REMAP_OK; n++) {
    outcome            out;
    remap_field_report report[2];

    status = step(ctx, zones, .05 * n, &out, report);
    if (status != REMAP_OK) break;
    add_up(&out);
    if (rank == 0)
      printf("%4d %5lld %6lld %7lld  %.1e   %.1e, %.1e\n", n, (long long)out.wanting[BOX], (long long)out.wanting[RING],
             (long long)(out.orphans[BOX] + out.orphans[RING]), out.error, report[0].conservation_error,
             report[1].conservation_error);
    ok = ok && out.wanting[BOX] > 0 && out.orphans[BOX] == 0 && out.orphans[RING] == 0 && out.error < 1e-11 &&
         report[0].conservation_error < 1e-14 && report[1].conservation_error < 1e-14;
  }
  if (rank == 0 && status != REMAP_OK)
    fprintf(stderr, "rotating_zone: %s: %s\n", remap_status_text(status), remap_message(ctx));

  remap_destroy(&ctx);
  free_zone(&zones[BOX]);
  free_zone(&zones[RING]);
  MPI_Finalize();
  return ok && status == REMAP_OK ? 0 : 1;
}
