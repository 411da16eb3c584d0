/* From the faces of a supermesh in a file back to those of the files that it was made of: blocks that touch without matching
 * faces, and hexahedra as elements; by what the file says alone. */
#include "files.h"

static rcgns_message why;

/* A grid of boxes. */
typedef struct grid {
  double origin[3], step[3];
  int    n[3];
} grid;

static const grid LEFT = {{0, 0, 0}, {1, 1, 1}, {3, 2, 2}}, RIGHT = {{3, 0, 0}, {1, .625, 1}, {2, 3, 2}},
                  OTHER = {{.5, -.25, .25}, {1, 1, .75}, {4, 2, 3}};

static int64_t node_of(const grid *g, int i, int j, int k) { return ((int64_t)k * (g->n[1] + 1) + j) * (g->n[0] + 1) + i; }

static double *nodes_of(const grid *g)
{
  double *xyz = tm_alloc_(3 * (g->n[0] + 1) * (g->n[1] + 1) * (g->n[2] + 1), sizeof *xyz);

  for (int k = 0; k <= g->n[2]; k++)
    for (int j = 0; j <= g->n[1]; j++)
      for (int i = 0; i <= g->n[0]; i++)
        for (int d = 0; d < 3; d++)
          xyz[3 * node_of(g, i, j, k) + d] = g->origin[d] + g->step[d] * (double[]){i, j, k}[d];
  return xyz;
}

static void put_block(cf_file *f, int64_t base, const char *name, const grid *g)
{
  const int64_t size[9] = {g->n[0] + 1, g->n[1] + 1, g->n[2] + 1, g->n[0], g->n[1], g->n[2], 0, 0, 0};
  double       *xyz     = nodes_of(g);

  cf_coordinates(f, cf_zone(f, base, name, 3, size), xyz, 3, (int64_t[]){size[2], size[1], size[0]});
  free(xyz);
}

static void put_elements(cf_file *f, int64_t base, const char *name, const grid *g)
{
  const int64_t num = (int64_t)g->n[0] * g->n[1] * g->n[2], nodes = node_of(g, g->n[0], g->n[1], g->n[2]) + 1;
  const int64_t zone = cf_zone(f, base, name, 1, (int64_t[]){nodes, num, 0});
  int64_t      *node = tm_alloc_(8 * num, sizeof *node);
  double       *xyz = nodes_of(g);

  for (int64_t c = 0; c < num; c++)
    for (int v = 0; v < 8; v++) {
      const int i = (int)(c % g->n[0]) + ((v + 1) / 2 % 2), j = (int)(c / g->n[0] % g->n[1]) + v / 2 % 2,
                k = (int)(c / g->n[0] / g->n[1]) + v / 4; /* corners of a HEXA_8 */

      node[8 * c + v] = node_of(g, i, j, k) + 1;
    }
  cf_coordinates(f, zone, xyz, 1, &nodes);
  cf_section(f, zone, "Hexa", 17, 1, num, 8 * num, node);
  free(node), free(xyz);
}

/* Does a point lie in the face of that number, by SIDS, of a cell? */
static bool holds(const grid *g, int64_t cell, int64_t number, const double p[3])
{
  static const int axis[6] = {2, 1, 0, 1, 0, 2}, upper[6] = {0, 0, 1, 1, 0, 1};
  const int64_t    at[3]   = {cell % g->n[0], cell / g->n[0] % g->n[1], cell / g->n[0] / g->n[1]};

  for (int d = 0; d < 3; d++) {
    const double low = g->origin[d] + g->step[d] * (double)at[d], high = low + g->step[d];

    if (p[d] < low - 1e-12 || p[d] > high + 1e-12) return false;
    if (d == axis[number - 1] && fabs(p[d] - (upper[number - 1] ? high : low)) > 1e-12) return false;
  }
  return true;
}

/* What the files call the faces of their meshes, for the faces of a supermesh. */
static void take(remap_context *ctx, int side, rcgns_file *file, int64_t *cell, int64_t *number)
{
  const remap_mesh *m    = rcgns_mesh(file);
  int64_t          *mine = tm_alloc_(m->num_faces, sizeof *mine);

  for (int64_t f = 0; f < m->num_faces; f++) mine[f] = m->cell_global[m->face_owner[f]] + 1;
  RT_EQ(remap_supermesh_face_numbers(ctx, side, mine, 0, cell), REMAP_OK);
  RT_EQ(remap_supermesh_face_numbers(ctx, side, rcgns_face_numbers(file), 0, number), REMAP_OK);
  free(mine);
}

static void write_supermesh(const char *path, rcgns_file *file[2])
{
  remap_supermesh_view    view;
  remap_supermesh_options how;
  remap_context          *ctx;
  int64_t                *cell[2], *number[2];

  RT_EQ(remap_create(MPI_COMM_WORLD, NULL, &ctx), REMAP_OK);
  for (int side = 0; side < 2; side++) RT_EQ(remap_set_mesh(ctx, side, rcgns_mesh(file[side])), REMAP_OK);
  remap_supermesh_options_default(&how);
  how.keep = REMAP_IN_BOTH | REMAP_IN_SOURCE | REMAP_IN_TARGET;
  RT_EQ(remap_supermesh(ctx, &how, &view), REMAP_OK);
  for (int side = 0; side < 2; side++) {
    cell[side] = tm_alloc_(view.num_faces, sizeof(int64_t)), number[side] = tm_alloc_(view.num_faces, sizeof(int64_t));
    take(ctx, side, file[side], cell[side], number[side]);
  }
  const rslice_content content = {.mesh = &view, .ancestor = {"AncestorA", "AncestorB"}, .face_cell = {cell[0], cell[1]},
                                  .face_number = {number[0], number[1]}};

  RT_EQ(rcgns_write_supermesh(MPI_COMM_WORLD, path, 4.2, &content, &why), RCGNS_OK);
  for (int side = 0; side < 2; side++) free(cell[side]), free(number[side]);
  remap_destroy(&ctx);
}

/* An array below FaceAncestors, the same on every rank. */
static int64_t *read_array(rcgns_file *file, const char *name, int64_t num)
{
  const rc_tree *tree     = &file->tree;
  const int64_t  elements = rc_tree_find(tree, file->zone[0].node, -1, "Elements_t", "NGonElements");
  const int64_t  node     = rc_tree_find(tree, rc_tree_find(tree, elements, -1, NULL, "FaceAncestors"), -1, NULL, name);
  int64_t       *out      = tm_alloc_(num, sizeof *out);

  RT_CHECK(node >= 0);
  if (node >= 0) RT_EQ(rc_read_1d(file, RCGNS_OK, node, 0, num, 'I', out, &why), RCGNS_OK);
  return out;
}

static void check_faces(rcgns_file *file)
{
  const remap_mesh *m       = rcgns_mesh(file);
  const int64_t    *element = rcgns_face_numbers(file), left = (int64_t)LEFT.n[0] * LEFT.n[1] * LEFT.n[2];
  int64_t           all = 0, seen[2] = {0, 0}, bad = 0;

  for (int64_t f = 0; f < m->num_faces; f++) all = element[f] > all ? element[f] : all;
  MPI_Allreduce(MPI_IN_PLACE, &all, 1, MPI_INT64_T, MPI_MAX, MPI_COMM_WORLD);
  int64_t *lies      = read_array(file, "LiesIn", all);
  int64_t *cell[2]   = {read_array(file, "AncestorACell", all), read_array(file, "AncestorBCell", all)};
  int64_t *number[2] = {read_array(file, "AncestorAFace", all), read_array(file, "AncestorBFace", all)};

  for (int64_t f = 0; f < m->num_faces; f++)
    for (int side = 0; side < 2; side++) {
      const int64_t g = element[f] - 1, c = cell[side][g] - 1;
      const bool    lies_in = lies[g] == 3 || lies[g] == side + 1;

      bad += lies_in != (c >= 0);
      bad += lies_in != (number[side][g] > 0);
      if (c < 0) continue;
      const grid *in = side ? &OTHER : c < left ? &LEFT : &RIGHT;

      seen[side]++;
      for (int64_t k = m->face_offset[f]; k < m->face_offset[f + 1]; k++)
        bad += !holds(in, side || c < left ? c : c - left, number[side][g], m->node_xyz + 3 * m->face_node[k]);
    }
  RT_EQ(bad, 0);
  for (int side = 0; side < 2; side++) RT_CHECK(cf_count(seen[side]) > 100);
  free(lies);
  for (int side = 0; side < 2; side++) free(cell[side]), free(number[side]);
}

static void faces_of_a_supermesh_know_those_they_lie_in(void)
{
  rcgns_options how;
  rcgns_file   *file[2], *out;
  char          path[3][64];
  cf_file      *f = cf_new(4.2);
  int64_t       base = cf_base(f);

  put_block(f, base, "Left", &LEFT);
  put_block(f, base, "Right", &RIGHT);
  cf_write(f, cf_path(path[0], "faces_a"));
  f    = cf_new(4.2);
  base = cf_base(f);
  put_elements(f, base, "Other", &OTHER);
  cf_write(f, cf_path(path[1], "faces_b"));
  rcgns_options_default(&how);
  how.face_numbers = 1;
  for (int side = 0; side < 2; side++) file[side] = cf_open(path[side], &how);
  if (file[0] && file[1]) {
    write_supermesh(cf_path(path[2], "faces_out"), file);
    out = cf_open(path[2], &how);
    if (out) check_faces(out);
    rcgns_close(&out);
    cf_remove(path[2]);
  }
  for (int side = 0; side < 2; side++) rcgns_close(&file[side]), cf_remove(path[side]);
}

RT_MAIN(RT_CASE(faces_of_a_supermesh_know_those_they_lie_in))
