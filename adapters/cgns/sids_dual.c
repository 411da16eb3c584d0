/* sids_dual -- the median-dual mesh: a cell about every vertex of the file, for values that are located there.
 *
 * Every cell of the file is cut between its vertices: along each edge p-q of each of its faces, by the triangle of the edge's
 * middle m, the cell's centre c and the face's centre f, which separates what belongs to p from what belongs to q. Centres are
 * means of vertices, as vertex-centred solvers have them. On the skin, the face's fan about f is cut at m: the dual cells fill
 * just the same space.
 *
 *      p ---- m ---- q        seen from outside; c lies behind f
 *       \     |     /         m c f   from p to q
 *        \    |    /          p m f   skin of p
 *         `-- f --'           m q f   skin of q
 *
 * The rank that has a cell makes its triangles and sends them to the ranks that have the vertices, both of which so get the
 * same bits; skin that meets the skin of a cell of another rank cancels at the vertex. Centres are summed in the order of
 * coordinates, alike from both sides of a face. O(edges of the faces of cells) time and memory, about 4 kB for each hexahedron,
 * and one exchange. */
#include "cgns_private.h"

#include <stdlib.h>
#include <string.h>

/* A triangle of a dual cell, its normal pointing out. Points are compared bit by bit, -0 being 0. */
typedef struct facet {
  int64_t vertex, beyond; /* in the file, all zones; whose cell is on the other side, -1: skin */
  double  xyz[3][3];
} facet;

/* The facets under way to each rank. */
typedef struct outbox {
  ra_array *to; /* [ranks] facet */
  bool      ok; /* memory has lasted */
} outbox;

typedef struct dual {
  rcgns_file *file;
  int64_t     num_vertices, lo, hi;    /* of all zones; this rank's */
  int64_t    *cell_offset, *cell_face; /* faces of this rank's cells of the file */
  outbox      out;
} dual;

/* ---- points ------------------------------------------------------------------------------------------------------- */

static int by_place(const void *a, const void *b)
{
  const double *x = a, *y = b;

  for (int d = 0; d < 3; d++)
    if (x[d] != y[d]) return x[d] < y[d] ? -1 : 1;
  return 0;
}

/* The mean of n points, which are sorted. */
static void mean_of(double (*point)[3], int64_t n, double mean[3])
{
  qsort(point, (size_t)n, sizeof *point, by_place);
  for (int d = 0; d < 3; d++) {
    mean[d] = 0;
    for (int64_t i = 0; i < n; i++) mean[d] += point[i][d];
    mean[d] = mean[d] / (double)n + 0.0; /* -0 is 0 */
  }
}

static int by_value(const void *a, const void *b)
{
  const int64_t x = *(const int64_t *)a, y = *(const int64_t *)b;

  return (x > y) - (x < y);
}

/* ---- cutting ------------------------------------------------------------------------------------------------------ */

static void send_facet(dual *d, int64_t vertex, int64_t beyond, const double *a, const double *b, const double *c)
{
  ra_array *box = d->out.to + ra_owner(d->num_vertices, vertex, d->file->size);
  facet    *f;

  if (!by_place(a, b) || !by_place(b, c) || !by_place(c, a)) return; /* without area it bounds nothing */
  if (!ra_reserve(box, 1, sizeof *f)) {
    d->out.ok = false;
    return;
  }
  f         = (facet *)box->item + box->count++;
  f->vertex = vertex;
  f->beyond = beyond;
  for (int i = 0; i < 3; i++) f->xyz[0][i] = a[i] + 0.0, f->xyz[1][i] = b[i] + 0.0, f->xyz[2][i] = c[i] + 0.0;
}

/* The triangles along the edges of one face, as its cell with that centre sees it; sign -1: the loop runs the other way. */
static void cut_face(dual *d, int64_t face, int sign, const double centre[3], const double middle[3])
{
  const rc_mesh *mesh   = &d->file->build;
  const int64_t *offset = mesh->face_offset.item, *node = (const int64_t *)mesh->face_node.item + offset[face];
  const int64_t  n = offset[face + 1] - offset[face], *number = mesh->node_number.item;
  const bool     is_skin = ((const int64_t *)mesh->face_neighbour.item)[face] < 0;

  for (int64_t i = 0; i < n; i++) {
    const int64_t next = i + 1 < n ? i + 1 : 0, p = node[sign > 0 ? i : next], q = node[sign > 0 ? next : i];
    const double *x = (const double *)mesh->xyz.item + 3 * p, *y = (const double *)mesh->xyz.item + 3 * q;
    const double  half[3] = {(x[0] + y[0]) / 2, (x[1] + y[1]) / 2, (x[2] + y[2]) / 2};

    if (number[p] == number[q]) continue;
    send_facet(d, number[p], number[q], half, centre, middle);
    if (ra_owner(d->num_vertices, number[p], d->file->size) != ra_owner(d->num_vertices, number[q], d->file->size))
      send_facet(d, number[q], number[p], half, middle, centre);
    if (!is_skin) continue;
    send_facet(d, number[p], -1, x, half, middle);
    send_facet(d, number[q], -1, half, y, middle);
  }
}

/* Vertices of faces or of a cell while their mean is taken. */
typedef struct corners {
  ra_array node, xyz;
} corners;

static bool add_corners(corners *c, const rc_mesh *mesh, int64_t face)
{
  const int64_t *offset = mesh->face_offset.item, *node = mesh->face_node.item;

  for (int64_t k = offset[face]; k < offset[face + 1]; k++)
    if (!ra_push_int(&c->node, node[k])) return false;
  return true;
}

/* The mean of the distinct vertices there. */
static bool mean_of_corners(corners *c, const rc_mesh *mesh, double mean[3])
{
  int64_t *node = c->node.item, n = 0;

  qsort(node, (size_t)c->node.count, sizeof *node, by_value);
  for (int64_t i = 0; i < c->node.count; i++)
    if (!i || node[i] != node[i - 1]) node[n++] = node[i];
  c->xyz.count = 0;
  if (!n || !ra_reserve(&c->xyz, n, 3 * sizeof(double))) return false;
  for (int64_t i = 0; i < n; i++)
    memcpy((double *)c->xyz.item + 3 * i, (const double *)mesh->xyz.item + 3 * node[i], 3 * sizeof(double));
  mean_of(c->xyz.item, n, mean);
  return true;
}

static bool cut_cell(dual *d, int64_t cell, const double (*middle)[3], corners *c)
{
  const rc_mesh *mesh  = &d->file->build;
  const int64_t *owner = mesh->face_owner.item;
  double         centre[3];

  c->node.count = 0;
  for (int64_t k = d->cell_offset[cell]; k < d->cell_offset[cell + 1]; k++)
    if (!add_corners(c, mesh, d->cell_face[k])) return false;
  if (d->cell_offset[cell] == d->cell_offset[cell + 1]) return true;
  if (!mean_of_corners(c, mesh, centre)) return false;
  for (int64_t k = d->cell_offset[cell]; k < d->cell_offset[cell + 1]; k++) {
    const int64_t face = d->cell_face[k];

    cut_face(d, face, owner[face] == cell ? 1 : -1, centre, middle[face]);
  }
  return d->out.ok;
}

/* Which faces each cell has. */
static bool list_faces(dual *d)
{
  const rc_mesh *mesh  = &d->file->build;
  const int64_t  cells = mesh->cell_global.count, faces = mesh->face_owner.count;
  const int64_t *side[2] = {mesh->face_owner.item, mesh->face_neighbour.item};

  d->cell_offset = calloc((size_t)cells + 2, sizeof *d->cell_offset);
  d->cell_face   = ra_alloc(2 * faces, sizeof *d->cell_face);
  if (!d->cell_offset || !d->cell_face) return false;
  for (int s = 0; s < 2; s++)
    for (int64_t f = 0; f < faces; f++)
      if (side[s][f] >= 0) d->cell_offset[side[s][f] + 2]++;
  for (int64_t c = 0; c < cells; c++) d->cell_offset[c + 2] += d->cell_offset[c + 1];
  for (int64_t f = 0; f < faces; f++) /* cell_offset[c + 1] runs ahead to where the next face of c goes */
    for (int s = 0; s < 2; s++)
      if (side[s][f] >= 0) d->cell_face[d->cell_offset[side[s][f] + 1]++] = f;
  return true;
}

/* All facets of this rank's cells. */
static bool cut_cells(dual *d)
{
  const rc_mesh *mesh  = &d->file->build;
  const int64_t  faces = mesh->face_owner.count;
  double(*middle)[3]   = ra_alloc(faces, sizeof *middle);
  corners c            = {.node = {.item = NULL}, .xyz = {.item = NULL}};
  bool    ok           = middle && list_faces(d);

  for (int64_t f = 0; f < faces && ok; f++) {
    c.node.count = 0;
    ok           = add_corners(&c, mesh, f) && mean_of_corners(&c, mesh, middle[f]);
  }
  for (int64_t cell = 0; cell < mesh->cell_global.count && ok; cell++) ok = cut_cell(d, cell, (const double(*)[3])middle, &c);
  ra_drop(&c.node);
  ra_drop(&c.xyz);
  free(middle);
  return ok;
}

/* ---- gathering ---------------------------------------------------------------------------------------------------- */

/* A facet of skin with its points sorted, and whether that took an odd number of swaps. */
typedef struct skin {
  int64_t vertex, facet;
  double  xyz[3][3];
  int     is_odd;
} skin;

static skin skin_of(const facet *f, int64_t at)
{
  skin s = {.vertex = f->vertex, .facet = at};

  memcpy(s.xyz, f->xyz, sizeof s.xyz);
  for (int pass = 0; pass < 3; pass++) {
    const int i = pass == 1;

    if (by_place(s.xyz[i], s.xyz[i + 1]) > 0) {
      double keep[3];

      memcpy(keep, s.xyz[i], sizeof keep);
      memcpy(s.xyz[i], s.xyz[i + 1], sizeof keep);
      memcpy(s.xyz[i + 1], keep, sizeof keep);
      s.is_odd = !s.is_odd;
    }
  }
  return s;
}

static int by_vertex_and_place(const void *a, const void *b)
{
  const skin *x = a, *y = b;

  if (x->vertex != y->vertex) return x->vertex < y->vertex ? -1 : 1;
  for (int i = 0; i < 3; i++) {
    const int order = by_place(x->xyz[i], y->xyz[i]);

    if (order) return order;
  }
  return 0;
}

/* Mark facets of skin that another one of the same vertex covers the other way round: the cells behind both join. */
static bool cancel_skin(const facet *f, int64_t n, bool *is_gone)
{
  skin   *s   = NULL;
  int64_t num = 0;

  for (int64_t i = 0; i < n; i++) num += f[i].beyond < 0;
  if (!(s = ra_alloc(num, sizeof *s))) return false;
  num = 0;
  for (int64_t i = 0; i < n; i++)
    if (f[i].beyond < 0) s[num++] = skin_of(f + i, i);
  qsort(s, (size_t)num, sizeof *s, by_vertex_and_place);
  for (int64_t i = 0, end; i < num; i = end) { /* one place: as many each way go */
    int64_t ways[2] = {0, 0}, both;

    for (end = i; end < num && !by_vertex_and_place(s + i, s + end); end++) ways[s[end].is_odd]++;
    both    = ways[0] < ways[1] ? ways[0] : ways[1];
    ways[0] = ways[1] = both;
    for (int64_t k = i; k < end; k++)
      if (ways[s[k].is_odd]-- > 0) is_gone[s[k].facet] = true;
  }
  free(s);
  return true;
}

/* The node of a mesh at a point. -1: no memory. */
static int64_t node_at(rc_mesh *mesh, ra_map *nodes, const double x[3])
{
  int64_t key[3], node;

  memcpy(key, x, sizeof key);
  node = ra_map_add(nodes, key);
  if (node < mesh->xyz.count) return node;
  if (!ra_reserve(&mesh->xyz, 1, 3 * sizeof *x)) return -1;
  memcpy((double *)mesh->xyz.item + 3 * mesh->xyz.count++, x, 3 * sizeof *x);
  return node;
}

/* The dual cells of this rank from their facets; has_face [hi - lo] says which have any. */
static bool gather(const dual *d, const facet *f, int64_t n, const bool *is_gone, rc_mesh *mesh, ra_map *nodes, bool *has_face)
{
  for (int64_t i = 0; i < n; i++) {
    const bool is_mine = f[i].beyond >= d->lo && f[i].beyond < d->hi;
    int64_t    loop[3];

    has_face[f[i].vertex - d->lo] = true;
    if (is_mine) has_face[f[i].beyond - d->lo] = true;
    if (is_gone[i]) continue;
    for (int k = 0; k < 3; k++)
      if ((loop[k] = node_at(mesh, nodes, f[i].xyz[k])) < 0) return false;
    if (!rc_face_add(mesh, loop, 3, false, f[i].vertex - d->lo, is_mine ? f[i].beyond - d->lo : -1, 0)) return false;
  }
  for (int64_t v = d->lo; v < d->hi; v++)
    if (!ra_push_int(&mesh->cell_global, v)) return false;
  return true;
}

/* Vertices of no cell get a cell without volume at their place: two faces that collapse to a point. Collective. */
static rcgns_status add_loose(const dual *d, rc_mesh *mesh, const bool *has_face, rcgns_message *message)
{
  rcgns_status status = RCGNS_OK;

  for (int64_t z = 0; z < d->file->num_zones; z++) {
    const rc_zone *zone = d->file->zone + z;
    const int64_t  lo   = rc_clamp(d->lo - zone->first_node, 0, zone->num_nodes),
                  hi    = rc_clamp(d->hi - zone->first_node, lo, zone->num_nodes);
    ra_array loose      = {.item = NULL};
    double  *xyz        = NULL;

    if (zone->is_structured) continue;
    for (int64_t v = lo; v < hi && status == RCGNS_OK; v++)
      if (!has_face[zone->first_node + v - d->lo] && !ra_push_int(&loose, v)) status = rc_no_memory(message);
    if (status == RCGNS_OK && !(xyz = ra_alloc(3 * loose.count, sizeof *xyz))) status = rc_no_memory(message);
    status = rc_nodes_fetch(d->file, status, zone, loose.item, loose.count, xyz, NULL, message);
    for (int64_t i = 0; i < loose.count && status == RCGNS_OK; i++) {
      const int64_t node = mesh->xyz.count, loop[3] = {node, node, node};
      const int64_t cell = zone->first_node + ((const int64_t *)loose.item)[i] - d->lo;

      if (!ra_reserve(&mesh->xyz, 1, 3 * sizeof *xyz)) status = rc_no_memory(message);
      if (status != RCGNS_OK) break;
      memcpy((double *)mesh->xyz.item + 3 * mesh->xyz.count++, xyz + 3 * i, 3 * sizeof *xyz);
      if (!rc_face_add(mesh, loop, 3, false, cell, -1, 0)) status = rc_no_memory(message);
    }
    free(xyz);
    ra_drop(&loose);
    RC_TRY(rc_agree(d->file->comm, status, message));
  }
  return RCGNS_OK;
}

/* ---- the whole ---------------------------------------------------------------------------------------------------- */

/* The boxes behind each other, and how many facets go to each rank. */
static facet *pack(dual *d, int64_t *count)
{
  int64_t total = 0;
  facet  *all;

  for (int r = 0; r < d->file->size; r++) total += count[r] = d->out.to[r].count;
  if (!(all = ra_alloc(total, sizeof *all))) return NULL;
  total = 0;
  for (int r = 0; r < d->file->size; r++) {
    if (count[r]) memcpy(all + total, d->out.to[r].item, (size_t)count[r] * sizeof *all);
    total += count[r];
    ra_drop(&d->out.to[r]);
  }
  return all;
}

/* Facets to the ranks of their vertices. Collective. */
static rcgns_status exchange(dual *d, facet **received, int64_t *num, rcgns_message *message)
{
  int64_t     *count  = calloc(2 * (size_t)d->file->size, sizeof *count);
  facet       *all    = NULL;
  void        *in     = NULL;
  rcgns_status status = RCGNS_OK;

  d->out.to = calloc((size_t)d->file->size, sizeof *d->out.to);
  d->out.ok = d->out.to != NULL;
  if (!count || !d->out.ok || !cut_cells(d) || !(all = pack(d, count))) status = rc_no_memory(message);
  status = rc_exchange(d->file->comm, status, all, count, sizeof *all, &in, count ? count + d->file->size : NULL, message);
  *num   = 0;
  for (int r = 0; r < d->file->size && status == RCGNS_OK; r++) *num += count[d->file->size + r];
  *received = in;
  for (int r = 0; r < d->file->size && d->out.to; r++) ra_drop(&d->out.to[r]);
  free(d->out.to);
  free(d->cell_offset);
  free(d->cell_face);
  free(all);
  free(count);
  return status;
}

/* From now on the file's cells are the vertices. */
static void take_place(dual *d, rc_mesh *mesh)
{
  rcgns_file *file = d->file;

  rc_mesh_drop(&file->build);
  file->build     = *mesh;
  *mesh           = (rc_mesh){.xyz = {.item = NULL}};
  file->num_cells = file->info.num_cells = d->num_vertices;
  file->cell_lo                          = d->lo;
  file->cell_hi                          = d->hi;
  for (int64_t z = 0; z < file->num_zones; z++) {
    rc_zone *zone = file->zone + z;

    zone->first_cell = file->zone_info[z].first_cell = file->zone_cell_offset[z] = zone->first_node;
    zone->num_cells = file->zone_info[z].num_cells = zone->num_nodes;
    memcpy(zone->cells, zone->vertices, sizeof zone->cells);
  }
  file->zone_cell_offset[file->num_zones] = d->num_vertices;
}

rcgns_status rc_dual_build(rcgns_file *file, rcgns_message *message)
{
  const rc_zone *last     = file->zone + file->num_zones - 1;
  dual           d        = {.file = file, .num_vertices = last->first_node + last->num_nodes};
  rc_mesh        mesh     = {.xyz = {.item = NULL}};
  ra_map         nodes    = {.width = 3};
  facet         *received = NULL;
  bool          *is_gone = NULL, *has_face = NULL;
  int64_t        num;
  rcgns_status   status;

  d.lo = ra_share(d.num_vertices, file->rank, file->size);
  d.hi = ra_share(d.num_vertices, file->rank + 1, file->size);
  RC_GOTO(done, status = exchange(&d, &received, &num, message));
  is_gone  = calloc((size_t)num + 1, sizeof *is_gone);
  has_face = calloc((size_t)(d.hi - d.lo) + 1, sizeof *has_face);
  if (!is_gone || !has_face || !ra_push_int(&mesh.face_offset, 0) || !cancel_skin(received, num, is_gone) ||
      !gather(&d, received, num, is_gone, &mesh, &nodes, has_face))
    status = rc_no_memory(message);
  RC_GOTO(done, status = rc_agree(file->comm, status, message));
  RC_GOTO(done, status = add_loose(&d, &mesh, has_face, message));
  take_place(&d, &mesh);
done:
  rc_mesh_drop(&mesh);
  ra_map_drop(&nodes);
  free(received);
  free(is_gone);
  free(has_face);
  return status;
}
