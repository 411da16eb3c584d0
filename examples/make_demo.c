/* make_demo -- write two CGNS files to try the remap command on.
 *
 *   ./make_demo DIR [N]
 *
 * Both fill the unit cube with warped cells. DIR/source.cgns: two blocks of hexahedra, N cells along each axis of the cube,
 * with a smooth flow in FlowSolution. DIR/target.cgns: a block of hexahedra below, prisms on octagons and squares above (NGON_n
 * and NFACE_n), neither aligned with the source; the faces of the two meet in a plane but do not match. N is 24 by default. */
#include <cgns.h>

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { NUM_FIELDS = 6 };

static const char *const field_name[NUM_FIELDS] = {
    "Density", "MomentumX", "MomentumY", "MomentumZ", "EnergyStagnationDensity", "Pressure",
};

/* Memory is never short in an example. */
static void *room(int64_t count, size_t size)
{
  void *memory = calloc((size_t)count + 1, size);

  if (!memory) {
    fputs("make_demo: memory is out\n", stderr);
    exit(1);
  }
  return memory;
}

/* Move a point by about `size`; the sides of the cube and the plane z = 1/2 stay exactly where they are. */
static void warp(double size, double x[3])
{
  const double s = sin(2 * M_PI * x[0]) * sin(2 * M_PI * x[1]) * cos(2 * M_PI * x[2]);
  const double c = cos(M_PI * x[0] + 1) * cos(M_PI * x[1] + 2) * cos(M_PI * x[2] + 3);

  x[0] += size * 4 * x[0] * (1 - x[0]) * (c + s);
  x[1] += size * 4 * x[1] * (1 - x[1]) * (c - s);
  x[2] += size * 8 * x[2] * (1 - x[2]) * (2 * x[2] - 1) * c;
}

/* The flow at a point. */
static void flow(const double x[3], double value[NUM_FIELDS])
{
  const double density  = 1 + .3 * sin(2 * M_PI * x[0]) * cos(M_PI * x[1]) + .1 * x[2];
  const double u        = sin(M_PI * x[1]) * cos(M_PI * x[2]);
  const double v        = .5 * cos(2 * M_PI * x[0]);
  const double w        = .2 * x[0] * x[1];
  const double pressure = 1 + .2 * cos(2 * M_PI * x[2]) * sin(M_PI * x[0]);

  value[0] = density;
  value[1] = density * u;
  value[2] = density * v;
  value[3] = density * w;
  value[4] = pressure / .4 + .5 * density * (u * u + v * v + w * w);
  value[5] = pressure;
}

/* ---- blocks ------------------------------------------------------------------------------------------------------- */

/* The vertices of a warped block from low to high with num[] cells. */
static double *block_nodes(const double low[3], const double high[3], const int num[3], double size)
{
  double *xyz = room((int64_t)(num[0] + 1) * (num[1] + 1) * (num[2] + 1), 3 * sizeof *xyz), *at = xyz;
  int     place[3];

  for (place[2] = 0; place[2] <= num[2]; place[2]++)
    for (place[1] = 0; place[1] <= num[1]; place[1]++)
      for (place[0] = 0; place[0] <= num[0]; place[0]++, at += 3) {
        for (int d = 0; d < 3; d++) at[d] = low[d] + (high[d] - low[d]) * place[d] / num[d];
        warp(size, at);
      }
  return xyz;
}

static rcgns_new_zone block_zone(const char *name, const int num[3], const double *xyz)
{
  return (rcgns_new_zone){.name = name, .num_vertices = {num[0] + 1, num[1] + 1, num[2] + 1}, .node_xyz = xyz};
}

/* The flow in every cell of a block, at the mean of its vertices; values are [NUM_FIELDS][cells]. */
static double *block_flow(const int num[3], const double *xyz)
{
  const int64_t row = num[0] + 1, layer = row * (num[1] + 1), num_cells = (int64_t)num[0] * num[1] * num[2];
  double       *values = room(NUM_FIELDS * num_cells, sizeof *values);
  int64_t       cell   = 0;

  for (int64_t k = 0; k < num[2]; k++)
    for (int64_t j = 0; j < num[1]; j++)
      for (int64_t i = 0; i < num[0]; i++, cell++) {
        double mean[3] = {0, 0, 0}, value[NUM_FIELDS];

        for (int corner = 0; corner < 8; corner++)
          for (int d = 0; d < 3; d++)
            mean[d] += xyz[3 * (i + (corner & 1) + row * (j + (corner >> 1 & 1)) + layer * (k + (corner >> 2))) + d] / 8;
        flow(mean, value);
        for (int f = 0; f < NUM_FIELDS; f++) values[f * num_cells + cell] = value[f];
      }
  return values;
}

/* ---- prisms ------------------------------------------------------------------------------------------------------- */

/* Polygons that tile the unit square: n x n squares with their corners cut off, and a small cell about every corner.
 *
 *      +--o------o--+      o  the points: on every edge of the squares at 0.3 and 0.7
 *      |/          \|      +  points at the four corners of the whole only
 *      o            o */
typedef struct tiling {
  int n;
  double (*point)[2];
  int64_t  num_points, num_tiles;
  int64_t *offset; /* [num_tiles + 1] */
  int64_t *corner; /* [offset[num_tiles]] points of a tile, counterclockwise */
} tiling;

/* The point near vertex (i, j) towards (i + di, j + dj), a neighbour. */
static int64_t near_vertex(const tiling *t, int i, int j, int di, int dj)
{
  const int     n    = t->n;
  const int64_t half = 2 * (int64_t)n * (n + 1); /* points on the edges along x, then those along y */

  if (di) return 2 * ((int64_t)j * n + (di > 0 ? i : i - 1)) + (di < 0);
  return half + 2 * ((int64_t)i * n + (dj > 0 ? j : j - 1)) + (dj < 0);
}

static void place_points(tiling *t)
{
  const double h = 1.0 / t->n;
  int64_t      p;

  for (int along = 0; along < 2; along++)
    for (int line = 0; line <= t->n; line++)
      for (int k = 0; k < t->n; k++)
        for (int end = 0; end < 2; end++) {
          p = along ? near_vertex(t, line, k + end, 0, end ? -1 : 1) : near_vertex(t, k + end, line, end ? -1 : 1, 0);
          t->point[p][along]     = h * (k + (end ? .7 : .3));
          t->point[p][1 - along] = line == t->n ? 1 : h * line;
        }
  for (int c = 0; c < 4; c++) {
    p              = t->num_points - 4 + c;
    t->point[p][0] = c == 1 || c == 2;
    t->point[p][1] = c >= 2;
  }
}

/* The cell about vertex (i, j): its points east, north, west and south, as far as they exist, and a corner of the whole. */
static void add_vertex_tile(tiling *t, int i, int j)
{
  static const int step[4][2] = {{1, 0}, {0, 1}, {-1, 0}, {0, -1}};
  const int        n          = t->n;
  int64_t          count      = t->offset[t->num_tiles];

  for (int k = 0; k < 4; k++) {
    const int here = i + step[k][0] >= 0 && i + step[k][0] <= n && j + step[k][1] >= 0 && j + step[k][1] <= n;
    const int next = (k + 1) % 4, after = (k + 2) % 4;

    if (here) t->corner[count++] = near_vertex(t, i, j, step[k][0], step[k][1]);
    /* two steps in a row lead outside: this is a corner of the whole, reached once both of its points are there */
    if (i + step[next][0] >= 0 && i + step[next][0] <= n && j + step[next][1] >= 0 && j + step[next][1] <= n) continue;
    if (i + step[after][0] >= 0 && i + step[after][0] <= n && j + step[after][1] >= 0 && j + step[after][1] <= n) continue;
    if (here) t->corner[count++] = t->num_points - 4 + (j ? (i ? 2 : 3) : (i ? 1 : 0));
  }
  t->offset[++t->num_tiles] = count;
}

static void add_square_tile(tiling *t, int i, int j)
{
  int64_t *c = t->corner + t->offset[t->num_tiles];

  c[0] = near_vertex(t, i, j, 1, 0);
  c[1] = near_vertex(t, i + 1, j, -1, 0);
  c[2] = near_vertex(t, i + 1, j, 0, 1);
  c[3] = near_vertex(t, i + 1, j + 1, 0, -1);
  c[4] = near_vertex(t, i + 1, j + 1, -1, 0);
  c[5] = near_vertex(t, i, j + 1, 1, 0);
  c[6] = near_vertex(t, i, j + 1, 0, -1);
  c[7] = near_vertex(t, i, j, 0, 1);
  t->num_tiles++;
  t->offset[t->num_tiles] = t->offset[t->num_tiles - 1] + 8;
}

static tiling make_tiling(int n)
{
  const int64_t num_vertices = (int64_t)(n + 1) * (n + 1), num_squares = (int64_t)n * n;
  tiling        t = {.n = n, .num_points = 4 * (int64_t)n * (n + 1) + 4};

  t.point  = room(t.num_points, sizeof *t.point);
  t.offset = room(num_vertices + num_squares + 1, sizeof *t.offset);
  t.corner = room(4 * num_vertices + 8 * num_squares, sizeof *t.corner);
  place_points(&t);
  for (int j = 0; j < n; j++)
    for (int i = 0; i < n; i++) add_square_tile(&t, i, j);
  for (int j = 0; j <= n; j++)
    for (int i = 0; i <= n; i++) add_vertex_tile(&t, i, j);
  return t;
}

/* A side of a tile: from `low` to `high`, the smaller point first. */
typedef struct side {
  int64_t low, high, tile;
  int     is_turned; /* the tile runs from high to low */
} side;

static int by_points(const void *a, const void *b)
{
  const side *p = a, *q = b;

  if (p->low != q->low) return p->low < q->low ? -1 : 1;
  if (p->high != q->high) return p->high < q->high ? -1 : 1;
  return p->is_turned - q->is_turned;
}

/* All sides of all tiles, the two of one place beside each other; the caller frees them. */
static side *list_sides(const tiling *t)
{
  side   *sides = room(t->offset[t->num_tiles], sizeof *sides);
  int64_t count = 0;

  for (int64_t tile = 0; tile < t->num_tiles; tile++)
    for (int64_t c = t->offset[tile]; c < t->offset[tile + 1]; c++) {
      const int64_t from = t->corner[c], to = t->corner[c + 1 < t->offset[tile + 1] ? c + 1 : t->offset[tile]];

      sides[count++] = from < to ? (side){from, to, tile, 0} : (side){to, from, tile, 1};
    }
  qsort(sides, (size_t)count, sizeof *sides, by_points);
  return sides;
}

/* A mesh that owns its arrays. */
typedef struct prisms {
  remap_mesh mesh;
  double    *xyz;
  int64_t   *face_offset, *face_node, *face_owner, *face_neighbour;
} prisms;

static void add_face(prisms *p, int count, const int64_t *loop, int64_t owner, int64_t neighbour)
{
  const int64_t face = p->mesh.num_faces++;

  memcpy(p->face_node + p->face_offset[face], loop, (size_t)count * sizeof *loop);
  p->face_offset[face + 1] = p->face_offset[face] + count;
  p->face_owner[face]      = owner;
  p->face_neighbour[face]  = neighbour;
}

/* The tile as a face in plane k: above the cells of layer k - 1 if there are any, else below those of layer 0. */
static void add_cap(prisms *p, const tiling *t, int64_t tile, int k, int num_layers)
{
  const int64_t *corner = t->corner + t->offset[tile], above = k * t->num_tiles + tile;
  const int      count = (int)(t->offset[tile + 1] - t->offset[tile]);
  int64_t        loop[8];

  for (int c = 0; c < count; c++) loop[c] = k * t->num_points + corner[k ? c : count - 1 - c];
  add_face(p, count, loop, k ? above - t->num_tiles : above, k && k < num_layers ? above : -1);
}

/* The face on a side in layer k; s[0] owns it, s[1] is its other tile if is_shared. */
static void add_wall(prisms *p, const tiling *t, const side *s, int is_shared, int k)
{
  const int64_t from = s->is_turned ? s->high : s->low, to = s->is_turned ? s->low : s->high;
  const int64_t low = k * t->num_points, high = low + t->num_points;
  const int64_t loop[4] = {low + from, low + to, high + to, high + from};

  add_face(p, 4, loop, k * t->num_tiles + s[0].tile, is_shared ? k * t->num_tiles + s[1].tile : -1);
}

/* Prisms on the tiles, from z = 1/2 to z = 1. */
static prisms make_prisms(int n, int num_layers, double size)
{
  const tiling  t         = make_tiling(n);
  const int64_t num_sides = t.offset[t.num_tiles];
  side         *sides     = list_sides(&t);
  prisms        p         = {.mesh = {.num_nodes = t.num_points * (num_layers + 1), .num_cells = t.num_tiles * num_layers}};
  const int64_t num_faces = (t.num_tiles + num_sides) * (num_layers + 1); /* at most */

  p.xyz            = room(p.mesh.num_nodes, 3 * sizeof *p.xyz);
  p.face_offset    = room(num_faces + 1, sizeof *p.face_offset);
  p.face_node      = room(num_sides * (num_layers + 1) * 5, sizeof *p.face_node);
  p.face_owner     = room(num_faces, sizeof *p.face_owner);
  p.face_neighbour = room(num_faces, sizeof *p.face_neighbour);
  for (int64_t i = 0; i < p.mesh.num_nodes; i++) {
    p.xyz[3 * i]     = t.point[i % t.num_points][0];
    p.xyz[3 * i + 1] = t.point[i % t.num_points][1];
    p.xyz[3 * i + 2] = .5 + .5 * (double)(i / t.num_points) / num_layers;
    warp(size, p.xyz + 3 * i);
  }
  for (int k = 0; k <= num_layers; k++)
    for (int64_t tile = 0; tile < t.num_tiles; tile++) add_cap(&p, &t, tile, k, num_layers);
  for (int k = 0; k < num_layers; k++)
    for (int64_t s = 0, shared; s < num_sides; s += 1 + shared) {
      shared = s + 1 < num_sides && sides[s].low == sides[s + 1].low && sides[s].high == sides[s + 1].high;
      add_wall(&p, &t, &sides[s], (int)shared, k);
    }
  p.mesh.node_xyz       = p.xyz;
  p.mesh.face_offset    = p.face_offset;
  p.mesh.face_node      = p.face_node;
  p.mesh.face_owner     = p.face_owner;
  p.mesh.face_neighbour = p.face_neighbour;
  free(sides);
  free(t.point);
  free(t.offset);
  free(t.corner);
  return p;
}

/* ---- files -------------------------------------------------------------------------------------------------------- */

static int write_file(const char *folder, const char *name, const char *solution, int num_zones, const rcgns_new_zone *zones)
{
  const size_t  length = strlen(folder) + strlen(name) + 2;
  char         *path   = room((int64_t)length, 1);
  rcgns_message message;
  rcgns_status  status;

  snprintf(path, length, "%s/%s", folder, name);
  status = rcgns_create(path, 4.2, solution, num_zones, zones, &message);
  if (status == RCGNS_OK)
    printf("wrote %s\n", path);
  else
    fprintf(stderr, "make_demo: %s\n", message.text);
  free(path);
  return status == RCGNS_OK;
}

static int write_source(const char *folder, int n)
{
  static const double low[2][3] = {{0, 0, 0}, {.5, 0, 0}}, high[2][3] = {{.5, 1, 1}, {1, 1, 1}};
  const int           num[3] = {n / 2, n, n};
  const int64_t       cells  = (int64_t)num[0] * num[1] * num[2];
  rcgns_new_field     field[2][NUM_FIELDS];
  rcgns_new_zone      zone[2];
  double             *xyz[2], *values[2];
  int                 ok;

  for (int z = 0; z < 2; z++) {
    xyz[z]    = block_nodes(low[z], high[z], num, .05);
    values[z] = block_flow(num, xyz[z]);
    zone[z]   = block_zone(z ? "Right" : "Left", num, xyz[z]);
    for (int f = 0; f < NUM_FIELDS; f++) field[z][f] = (rcgns_new_field){field_name[f], values[z] + f * cells};
    zone[z].num_fields = NUM_FIELDS;
    zone[z].field      = field[z];
  }
  ok = write_file(folder, "source.cgns", "FlowSolution", 2, zone);
  for (int z = 0; z < 2; z++) {
    free(xyz[z]);
    free(values[z]);
  }
  return ok;
}

static int write_target(const char *folder, int n)
{
  const int      num[3] = {n, n, n / 2};
  double        *xyz    = block_nodes((const double[3]){0, 0, 0}, (const double[3]){1, 1, .5}, num, -.03);
  prisms         above  = make_prisms(n, n / 2, -.03);
  rcgns_new_zone zone[2];
  int            ok;

  zone[0] = block_zone("Block", num, xyz);
  zone[1] = (rcgns_new_zone){.name = "Prisms", .mesh = &above.mesh};
  ok      = write_file(folder, "target.cgns", NULL, 2, zone);
  free(xyz);
  free(above.xyz);
  free(above.face_offset);
  free(above.face_node);
  free(above.face_owner);
  free(above.face_neighbour);
  return ok;
}

int main(int argc, char **argv)
{
  const long n = argc > 2 ? strtol(argv[2], NULL, 10) : 24;
  int        ok;

  if (argc < 2 || argc > 3 || n < 4 || n > 1000) {
    fputs("usage: make_demo DIR [N]   (N cells along each axis, 4 to 1000)\n", stderr);
    return 2;
  }
  MPI_Init(&argc, &argv);
  ok = write_source(argv[1], (int)(n / 2 * 2)) && write_target(argv[1], (int)(n * 5 / 12 * 2));
  MPI_Finalize();
  return ok ? 0 : 1;
}
