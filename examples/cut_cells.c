/* cut_cells -- a body of triangles cut out of a Cartesian grid: the mesh of the space around it, its cut cells exact polyhedra.
 *
 *   mpirun -n 2 ./cut_cells [FILE]
 *
 * The grid has 32 x 40 x 23 = 29,440 cells, the body, a ring with waists, 760 triangles and concavities of every kind. Prints
 * what each step counted and how long it took, beside the seconds that the first implementation of the method has published for
 * a case of this size. FILE, on one rank, gets the result as text for libremap/doc/cut_cells.py:
 *
 *   nodes N, faces N, cells N
 *   x y z                                          for each node
 *   owner neighbour on_body corners node ...       for each face, neighbour -1 where there is none, all counted from 0 */
#include <remap/remap.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

enum { NX = 32, NY = 40, NZ = 23, AROUND = 20, TUBE = 19 };

#define SIDE 0.1 /* of a cell */

/* A mesh and what it points to. */
typedef struct part {
  remap_mesh mesh;
  double    *xyz;
  int64_t   *face_offset, *face_node, *face_owner, *face_neighbour;
} part;

/* Memory is never short in an example. */
static void *room(int64_t count, size_t size)
{
  void *memory = calloc((size_t)count + 1, size);

  if (!memory) {
    fputs("cut_cells: memory is out\n", stderr);
    exit(1);
  }
  return memory;
}

static void make_room(part *p, int64_t nodes, int64_t faces, int64_t corners)
{
  p->xyz            = room(3 * nodes, sizeof *p->xyz);
  p->face_offset    = room(faces + 1, sizeof *p->face_offset);
  p->face_node      = room(corners, sizeof *p->face_node);
  p->face_owner     = room(faces, sizeof *p->face_owner);
  p->face_neighbour = room(faces, sizeof *p->face_neighbour);
  p->mesh           = (remap_mesh){.node_xyz       = p->xyz,
                                   .face_offset    = p->face_offset,
                                   .face_node      = p->face_node,
                                   .face_owner     = p->face_owner,
                                   .face_neighbour = p->face_neighbour};
}

static void drop(part *p)
{
  free(p->xyz);
  free(p->face_offset);
  free(p->face_node);
  free(p->face_owner);
  free(p->face_neighbour);
}

static void add_face(part *p, int n, const int64_t *loop, int64_t owner, int64_t neighbour)
{
  const int64_t face = p->mesh.num_faces++;
  int64_t       at   = p->face_offset[face];

  for (int i = 0; i < n; i++) p->face_node[at++] = loop[i];
  p->face_offset[face + 1] = at;
  p->face_owner[face]      = owner;
  p->face_neighbour[face]  = neighbour;
}

/* ---- the grid ------------------------------------------------------------------------------------------------------ */

static int64_t node_at(const int at[3]) { return at[0] + (NX + 1) * (at[1] + (NY + 1) * (int64_t)at[2]); }

/* The face across axis d whose lowest corner is `at`, of a grid of size[2] layers. */
static void add_grid_face(part *p, const int size[3], int d, const int at[3])
{
  static const int u[4] = {0, 1, 1, 0}, v[4] = {0, 0, 1, 1};
  const int        is_first = at[d] == 0, is_last = at[d] == size[d];
  const int64_t    above  = at[0] + NX * (at[1] + NY * (int64_t)at[2]);
  const int64_t    stride = d == 0 ? 1 : d == 1 ? NX : NX * NY;
  int64_t          loop[4];

  for (int k = 0; k < 4; k++) {
    int corner[3] = {at[0], at[1], at[2]};

    corner[(d + 1) % 3] += u[is_first ? 3 - k : k];
    corner[(d + 2) % 3] += v[is_first ? 3 - k : k];
    loop[k] = node_at(corner);
  }
  add_face(p, 4, loop, is_first ? above : above - stride, is_first || is_last ? -1 : above);
}

/* The layers first <= k < last of the grid. */
static void make_grid(part *p, int first, int last)
{
  const int     size[3] = {NX, NY, last - first};
  const int64_t nodes = (int64_t)(NX + 1) * (NY + 1) * (size[2] + 1), faces = 3 * nodes;

  make_room(p, nodes, faces, 4 * faces);
  p->mesh.name      = "grid";
  p->mesh.num_nodes = nodes;
  p->mesh.num_cells = (int64_t)NX * NY * size[2];
  for (int64_t i = 0; i < nodes; i++) {
    p->xyz[3 * i]     = SIDE * (double)(i % (NX + 1)) - SIDE * NX / 2;
    p->xyz[3 * i + 1] = SIDE * (double)(i / (NX + 1) % (NY + 1)) - SIDE * NY / 2;
    p->xyz[3 * i + 2] = SIDE * (double)(i / ((NX + 1) * (NY + 1)) + first) - SIDE * NZ / 2;
  }
  if (size[2] == 0) p->mesh.num_nodes = 0; /* more ranks than layers */
  for (int d = 0; d < 3 && size[2]; d++)
    for (int k = 0; k < size[2] + (d == 2); k++)
      for (int j = 0; j < size[1] + (d == 1); j++)
        for (int i = 0; i < size[0] + (d == 0); i++) add_grid_face(p, size, d, (int[3]){i, j, k});
}

/* ---- the body ------------------------------------------------------------------------------------------------------ */

/* The node at angle s round the ring and t round its tube: the ring is longer than wide, has three waists and is tilted. */
static void place_node(int s, int t, double x[3])
{
  const double a = 2 * M_PI * s / AROUND, b = 2 * M_PI * t / TUBE;
  const double tube = .36 + .1 * cos(3 * a), out = tube * cos(b), up = tube * sin(b) + .16 * sin(2 * a);
  const double p = (.92 + out) * cos(a), q = (1.3 + out) * sin(a);

  x[0] = cos(.3) * p - sin(.3) * up;
  x[1] = cos(.2) * q - sin(.2) * (sin(.3) * p + cos(.3) * up);
  x[2] = sin(.2) * q + cos(.2) * (sin(.3) * p + cos(.3) * up);
}

/* A closed surface is a mesh of one cell. */
static void make_body(part *p)
{
  const int64_t faces = 2 * AROUND * TUBE;

  make_room(p, AROUND * TUBE, faces, 3 * faces);
  p->mesh.name      = "body";
  p->mesh.num_nodes = AROUND * TUBE;
  p->mesh.num_cells = 1;
  for (int s = 0; s < AROUND; s++)
    for (int t = 0; t < TUBE; t++) {
      const int64_t a = s * TUBE + t, b = (s + 1) % AROUND * TUBE + t, c = (s + 1) % AROUND * TUBE + (t + 1) % TUBE,
                    d = s * TUBE + (t + 1) % TUBE;

      place_node(s, t, p->xyz + 3 * a);
      add_face(p, 3, (int64_t[]){a, b, c}, 0, -1);
      add_face(p, 3, (int64_t[]){a, c, d}, 0, -1);
    }
}

/* The volume that its triangles bound. */
static double volume_of(const part *p)
{
  double sum = 0;

  for (int64_t f = 0; f < p->mesh.num_faces; f++) {
    const double *a = p->xyz + 3 * p->face_node[3 * f], *b = p->xyz + 3 * p->face_node[3 * f + 1],
                 *c = p->xyz + 3 * p->face_node[3 * f + 2];

    sum += a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0]);
  }
  return sum / 6;
}

/* ---- the result ---------------------------------------------------------------------------------------------------- */

/* A row of the table, over all ranks: what was counted on them, seconds of the slowest. */
static void print_row(int rank, const char *step, int64_t count, const char *what, double seconds, const char *published)
{
  MPI_Allreduce(MPI_IN_PLACE, &count, 1, MPI_INT64_T, MPI_SUM, MPI_COMM_WORLD);
  MPI_Allreduce(MPI_IN_PLACE, &seconds, 1, MPI_DOUBLE, MPI_MAX, MPI_COMM_WORLD);
  if (rank == 0) printf("%-16s %10lld  %-22s %9.4f  %9s\n", step, (long long)count, what, seconds, published);
}

/* Which cells the body cuts: cells of the result that are no longer a whole cell of the grid. */
static int64_t count_cut(const remap_supermesh_view *v)
{
  uint8_t *cut = room(v->num_cells, 1);
  int64_t  num = 0;

  for (int64_t f = 0; f < v->num_faces; f++)
    if (v->face_from[REMAP_TARGET][f] >= 0) cut[v->face_owner[f]] = 1;
  for (int64_t c = 0; c < v->num_cells; c++) num += cut[c];
  free(cut);
  return num;
}

static void print_table(int rank, const remap_supermesh_view *v, double total)
{
  const double  begin   = MPI_Wtime();
  const int64_t cut     = count_cut(v);
  const double  seconds = MPI_Wtime() - begin;

  if (rank == 0) printf("%-16s %10s  %-22s %9s  %9s\n", "step", "count", "", "seconds", "published");
  print_row(rank, "distribution", 1, "parts", v->seconds_partition, "");
  print_row(rank, "triangulation", v->num_triangles[REMAP_SOURCE] + v->num_triangles[REMAP_TARGET], "triangles near the body",
            v->seconds_triangulation, "");
  print_row(rank, "crossings", v->num_crossings, "edges through triangles", v->seconds_crossings, "");
  print_row(rank, "conformizing", v->num_polygons, "polygons", v->seconds_polygons, "41.13");
  print_row(rank, "cells", v->num_cells, "cells", v->seconds_cells, "4.59");
  print_row(rank, "aggregation", rank ? 0 : v->global_faces, "faces", v->seconds_faces, "");
  print_row(rank, "numbering", rank ? 0 : v->global_nodes, "nodes", v->seconds_numbering, "");
  print_row(rank, "classification", cut, "cut cells", seconds, "");
  if (rank == 0)
    printf("%-16s %10lld  %-22s %9.4f  %9s\n", "total", (long long)v->global_cells, "cells of the result", total, "51.07");
}

/* The mesh as text. Returns 0 if it is written. */
static int write_mesh(const char *path, const remap_supermesh_view *v)
{
  FILE *out = fopen(path, "w");

  if (!out) return 1;
  fprintf(out, "nodes %lld, faces %lld, cells %lld\n", (long long)v->num_nodes, (long long)v->num_faces,
          (long long)v->num_cells);
  for (int64_t i = 0; i < v->num_nodes; i++)
    fprintf(out, "%.9g %.9g %.9g\n", v->node_xyz[3 * i], v->node_xyz[3 * i + 1], v->node_xyz[3 * i + 2]);
  for (int64_t f = 0; f < v->num_faces; f++) {
    fprintf(out, "%d %d %d %lld", (int)v->face_owner[f], (int)v->face_neighbour[f], v->face_from[REMAP_TARGET][f] >= 0,
            (long long)(v->face_offset[f + 1] - v->face_offset[f]));
    for (int64_t i = v->face_offset[f]; i < v->face_offset[f + 1]; i++) fprintf(out, " %d", (int)v->face_node[i]);
    fputc('\n', out);
  }
  return fclose(out) != 0;
}

/* The space left over must be the box without the body. Returns 0 if it is. */
static int check_volume(int rank, const remap_supermesh_view *v, double body)
{
  const double box = SIDE * NX * SIDE * NY * SIDE * NZ, sum = v->volume[1];

  if (rank == 0) printf("volume %.15g, the box without the body %.15g: %.1e apart\n", sum, box - body, fabs(sum - box + body));
  return fabs(sum - box + body) > 1e-12 * box;
}

int main(int argc, char **argv)
{
  remap_context          *ctx  = NULL;
  part                    grid = {.xyz = NULL}, body = {.xyz = NULL};
  remap_supermesh_options options;
  remap_supermesh_view    view;
  remap_status            status;
  double                  begin, volume;
  int                     rank, size, failed = 1;

  MPI_Init(&argc, &argv);
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  MPI_Comm_size(MPI_COMM_WORLD, &size);
  make_grid(&grid, NZ * rank / size, NZ * (rank + 1) / size);
  make_body(&body);
  volume = volume_of(&body);
  if (rank) body.mesh = (remap_mesh){.name = "body"}; /* its one cell is on rank 0 */
  remap_supermesh_options_default(&options);
  options.keep = REMAP_IN_SOURCE;
  begin        = MPI_Wtime();
  status       = remap_create(MPI_COMM_WORLD, NULL, &ctx);
  if (status == REMAP_OK) status = remap_set_mesh(ctx, REMAP_SOURCE, &grid.mesh);
  if (status == REMAP_OK) status = remap_set_mesh(ctx, REMAP_TARGET, &body.mesh);
  if (status == REMAP_OK) status = remap_supermesh(ctx, &options, &view);
  if (status == REMAP_OK) {
    print_table(rank, &view, MPI_Wtime() - begin);
    failed = check_volume(rank, &view, volume);
    if (argc > 1 && size == 1 && write_mesh(argv[1], &view))
      failed = fprintf(stderr, "cut_cells: %s cannot be written\n", argv[1]);
  } else if (rank == 0) {
    fprintf(stderr, "cut_cells: %s: %s\n", remap_status_text(status), ctx ? remap_message(ctx) : "");
  }
  remap_destroy(&ctx);
  drop(&grid);
  drop(&body);
  MPI_Finalize();
  return failed != 0;
}
