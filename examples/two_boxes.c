/* two_boxes -- a solver's view of libremap: two boxes of cells that overlap, each distributed over all ranks, exchange a field.
 *
 *   mpirun -n 2 ./two_boxes
 *
 * The source box fills [0, 1]^3, the target box [0.3, 1.3]^3. Every rank hands in its own layers of both, learns nothing about
 * the other ranks' cells, and gets the new values of its own. */
#include <remap/remap.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

/* This rank's layers of a cube of n^3 cells: a mesh and what it points to. */
typedef struct box {
  int        size[3]; /* cells along x, y, z */
  remap_mesh mesh;
  double    *xyz;
  int64_t   *face_offset, *face_node, *face_owner, *face_neighbour;
  double    *density; /* [num_cells] */
} box;

/* The field: linear, so that the transfer is exact up to rounding. */
static double density_at(const double x[3]) { return 1 + x[0] + 2 * x[1] + 3 * x[2]; }

static int64_t node_at(const box *b, const int at[3])
{
  return at[0] + (b->size[0] + 1) * (at[1] + (b->size[1] + 1) * (int64_t)at[2]);
}

static int64_t cell_at(const box *b, const int at[3]) { return at[0] + b->size[0] * (at[1] + b->size[1] * (int64_t)at[2]); }

/* The face across axis d whose lowest corner is `at`: between the cell below, which owns it, and the cell above. At the lower
 * end there is no cell below: the one above owns the face, and its loop is turned so that it points out of it. */
static void add_face(box *b, int d, const int at[3])
{
  const int     e = (d + 1) % 3, f = (d + 2) % 3;
  const int     is_first = at[d] == 0, is_last = at[d] == b->size[d];
  const int64_t face      = b->mesh.num_faces++;
  int           corner[3] = {at[0], at[1], at[2]}, below[3] = {at[0], at[1], at[2]};
  int64_t       loop[4];

  below[d]--;
  loop[0] = node_at(b, corner), corner[e]++;
  loop[1] = node_at(b, corner), corner[f]++;
  loop[2] = node_at(b, corner), corner[e]--;
  loop[3] = node_at(b, corner);
  for (int k = 0; k < 4; k++) b->face_node[4 * face + k] = loop[is_first ? 3 - k : k];
  b->face_offset[face + 1] = 4 * (face + 1);
  b->face_owner[face]      = cell_at(b, is_first ? at : below);
  b->face_neighbour[face]  = is_first || is_last ? -1 : cell_at(b, at);
}

/* The cube from low to high on every axis, n cells along each; this rank's layers are first <= k < last along z. */
static int make_box(box *b, double low, double high, int n, int first, int last)
{
  const int     layers    = last - first;
  const int64_t num_nodes = (int64_t)(n + 1) * (n + 1) * (layers + 1);
  const int64_t num_faces = (int64_t)n * n * (layers + 1) + 2 * (int64_t)n * (n + 1) * layers;
  const double  h         = (high - low) / n;
  double       *at;

  *b                = (box){.size = {n, n, layers}};
  b->xyz            = malloc((size_t)num_nodes * 3 * sizeof *b->xyz);
  b->face_offset    = malloc((size_t)(num_faces + 1) * sizeof *b->face_offset);
  b->face_node      = malloc((size_t)num_faces * 4 * sizeof *b->face_node);
  b->face_owner     = malloc((size_t)num_faces * sizeof *b->face_owner);
  b->face_neighbour = malloc((size_t)num_faces * sizeof *b->face_neighbour);
  b->density        = malloc(((size_t)n * (size_t)n * (size_t)layers + 1) * sizeof *b->density);
  if (!b->xyz || !b->face_offset || !b->face_node || !b->face_owner || !b->face_neighbour || !b->density) return 0;

  at = b->xyz;
  for (int k = first; k <= last; k++)
    for (int j = 0; j <= n; j++)
      for (int i = 0; i <= n; i++, at += 3) at[0] = low + h * i, at[1] = low + h * j, at[2] = low + h * k;
  b->face_offset[0] = 0;
  for (int d = 0; d < 3; d++)
    for (int k = 0; k < layers + (d == 2 && layers > 0); k++)
      for (int j = 0; j < n + (d == 1); j++)
        for (int i = 0; i < n + (d == 0); i++) add_face(b, d, (const int[3]){i, j, k});

  b->mesh.num_nodes      = num_nodes;
  b->mesh.num_cells      = (int64_t)n * n * layers;
  b->mesh.node_xyz       = b->xyz;
  b->mesh.face_offset    = b->face_offset;
  b->mesh.face_node      = b->face_node;
  b->mesh.face_owner     = b->face_owner;
  b->mesh.face_neighbour = b->face_neighbour;
  for (int k = 0; k < layers; k++)
    for (int j = 0; j < n; j++)
      for (int i = 0; i < n; i++)
        b->density[cell_at(b, (const int[3]){i, j, k})] =
            density_at((const double[3]){low + h * (i + .5), low + h * (j + .5), low + h * (first + k + .5)});
  return 1;
}

static void free_box(box *b)
{
  free(b->xyz);
  free(b->face_offset);
  free(b->face_node);
  free(b->face_owner);
  free(b->face_neighbour);
  free(b->density);
}

/* Overlay the boxes once, then move the field to the target and back again, as a solver does in every time step. */
static remap_status exchange(remap_context *ctx, box *source, box *target, remap_stats *stats, remap_field_report report[2])
{
  const remap_field_desc forward = {
      .name = "Density", .nature = REMAP_CONSERVED, .has_old = 1, .in = source->density, .out = target->density};
  const remap_field_desc backward = {
      .name = "Density", .nature = REMAP_CONSERVED, .has_old = 1, .in = target->density, .out = source->density};
  remap_transfer how;
  remap_status   status;

  remap_transfer_default(&how);
  how.limiter = REMAP_LIMITER_NONE; /* the field is smooth */
  if ((status = remap_set_mesh(ctx, REMAP_SOURCE, &source->mesh)) != REMAP_OK) return status;
  if ((status = remap_set_mesh(ctx, REMAP_TARGET, &target->mesh)) != REMAP_OK) return status;
  if ((status = remap_build(ctx)) != REMAP_OK) return status;
  if ((status = remap_get_stats(ctx, stats)) != REMAP_OK) return status;
  if ((status = remap_field(ctx, REMAP_FORWARD, &how, 1, &forward, &report[0])) != REMAP_OK) return status;
  return remap_field(ctx, REMAP_BACKWARD, &how, 1, &backward, &report[1]);
}

int main(int argc, char **argv)
{
  box                source, target;
  remap_context     *ctx = NULL;
  remap_stats        stats;
  remap_field_report report[2];
  remap_status       status;
  int                rank, size, ok;

  MPI_Init(&argc, &argv);
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  MPI_Comm_size(MPI_COMM_WORLD, &size);
  ok = make_box(&source, 0, 1, 8, 8 * rank / size, 8 * (rank + 1) / size);
  ok = make_box(&target, .3, 1.3, 7, 7 * rank / size, 7 * (rank + 1) / size) && ok;

  status = remap_create(MPI_COMM_WORLD, NULL, &ctx);
  if (status == REMAP_OK) status = remap_agree(ctx, ok ? REMAP_OK : REMAP_NO_MEMORY);
  if (status == REMAP_OK) status = exchange(ctx, &source, &target, &stats, report);
  if (rank == 0 && status != REMAP_OK) fprintf(stderr, "two_boxes: %s: %s\n", remap_status_text(status), remap_message(ctx));
  if (rank == 0 && status == REMAP_OK) {
    printf("overlap      %.15g in %lld pairs of cells\n", stats.overlap_volume, (long long)stats.pairs);
    printf("to target    %.15g leaves, %.15g arrives\n", report[0].source_integral, report[0].target_integral);
    printf("to source    %.15g leaves, %.15g arrives\n", report[1].source_integral, report[1].target_integral);
    printf("lost         %.1e and %.1e of it\n", report[0].conservation_error, report[1].conservation_error);
  }
  ok = status == REMAP_OK && report[0].conservation_error < 1e-14 && report[1].conservation_error < 1e-14 &&
       fabs(stats.overlap_volume - .343) < 1e-14;

  remap_destroy(&ctx);
  free_box(&source);
  free_box(&target);
  MPI_Finalize();
  return ok ? 0 : 1;
}
