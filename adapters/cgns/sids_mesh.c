/* sids_mesh -- this rank's part of the mesh.
 *
 * Blocks: the nodes of the rank's layers are read as slabs and faces follow from indices alone. Elements and polyhedra have
 * files of their own; the coordinates of their nodes come from the ranks that read them as slabs. O(cells) time and memory, and
 * one exchange for each unstructured zone. Cells of different ranks or zones are not joined here. A zone whose volume is
 * negative is mirrored as a whole: its faces are turned round. */
#include "cgns_private.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

bool rc_face_add(rc_mesh *mesh, const int64_t *node, int64_t n, bool reverse, int64_t owner, int64_t neighbour, int64_t number)
{
  int64_t *loop;

  if (!ra_reserve(&mesh->face_node, n, sizeof *loop)) return false;
  loop = (int64_t *)mesh->face_node.item + mesh->face_node.count;
  for (int64_t i = 0; i < n; i++) loop[i] = node[reverse ? n - 1 - i : i];
  mesh->face_node.count += n;
  if (mesh->wants_face_numbers && !ra_push_int(&mesh->face_number, number)) return false;
  return ra_push_int(&mesh->face_offset, mesh->face_node.count) && ra_push_int(&mesh->face_owner, owner) &&
         ra_push_int(&mesh->face_neighbour, neighbour);
}

bool rc_number_node(rcgns_file *file, const rc_zone *zone, int64_t node)
{
  return !rc_is_dual(file) || ra_push_int(&file->build.node_number, zone->first_node + node);
}

bool rc_rim_add(rc_mesh *mesh, const rc_zone *zone, int64_t a, int64_t b, int64_t c, int64_t d)
{
  if (!ra_reserve(&mesh->rim, 1, sizeof(rc_rim))) return false;
  ((rc_rim *)mesh->rim.item)[mesh->rim.count++] =
      (rc_rim){.face = mesh->face_owner.count - 1, .zone = zone->node, .key = {a, b, c, d}};
  return true;
}

double rc_cone(const double *xyz, const int64_t *node, int64_t n, const double *origin)
{
  double mean[3] = {0, 0, 0}, sum = 0.0;

  for (int64_t i = 0; i < n; i++)
    for (int d = 0; d < 3; d++) mean[d] += (xyz[3 * node[i] + d] - origin[d]) / (double)n;
  for (int64_t i = 0; i < n; i++) {
    const double *a = xyz + 3 * node[i], *b = xyz + 3 * node[i + 1 < n ? i + 1 : 0];
    double        p[3], q[3];

    for (int d = 0; d < 3; d++) p[d] = a[d] - origin[d], q[d] = b[d] - origin[d];
    sum +=
        mean[0] * (p[1] * q[2] - p[2] * q[1]) + mean[1] * (p[2] * q[0] - p[0] * q[2]) + mean[2] * (p[0] * q[1] - p[1] * q[0]);
  }
  return sum;
}

/* The caller's scale and transform; false: not finite. */
static bool place(const rcgns_file *file, const double x[3], double *out)
{
  bool finite = true;

  for (int r = 0; r < 3; r++) {
    const double *row = file->map[r];

    out[r] = row[0] * x[0] + row[1] * x[1] + row[2] * x[2] + row[3];
    finite = finite && isfinite(out[r]);
  }
  return finite;
}

/* Coordinates as they are stored are handed on bit by bit where neither scale nor transform was asked for. */
static bool is_identity(const rcgns_file *file)
{
  for (int r = 0; r < 3; r++)
    for (int c = 0; c < 4; c++)
      if (file->map[r][c] != (r == c ? 1.0 : 0.0)) return false;
  return true;
}

/* Interleave, place and check n nodes; number[i], or first + i where it is NULL, is for the message. */
static rcgns_status place_all(const rcgns_file *file, const rc_zone *zone, int64_t n, const double *x, const double *y,
                              const double *z, int64_t first, double *xyz, rcgns_message *message)
{
  const bool same = is_identity(file);

  for (int64_t i = 0; i < n; i++) {
    const double at[3] = {x[i], y[i], z[i]};
    bool         ok    = isfinite(at[0]) && isfinite(at[1]) && isfinite(at[2]);

    if (same)
      memcpy(xyz + 3 * i, at, sizeof at);
    else
      ok = place(file, at, xyz + 3 * i) && ok;
    if (!ok)
      return rc_fail(message, RCGNS_GEOMETRY,
                     "%s: zone %s: node %lld has a coordinate that is not a finite number: repair the mesh", file->path,
                     zone->name, (long long)(first + i + 1));
  }
  return RCGNS_OK;
}

/* ---- blocks ------------------------------------------------------------------------------------------------------- */

/* The nodes of a rank's part of a block: rows j0 .. j0 + rows - 1 of the planes k0 .. k0 + planes - 1, i fastest. */
typedef struct patch {
  int64_t j0, rows, k0, planes, count;
} patch;

static patch patch_of(const rc_zone *zone, int64_t lo, int64_t hi)
{
  const int64_t ci = zone->cells[0], layer = ci * zone->cells[1];
  const int64_t k0 = lo / layer, k1 = (hi - 1) / layer;
  patch         p = {0, 0, 0, 0, 0};

  if (lo >= hi) return p;
  p = (patch){.rows = zone->vertices[1], .k0 = k0, .planes = k1 - k0 + 2};
  if (k0 == k1) {
    p.j0   = lo % layer / ci;
    p.rows = (hi - 1) % layer / ci - p.j0 + 2;
  }
  p.count = p.planes * p.rows * zone->vertices[0];
  return p;
}

/* One coordinate of the patch: a slab of planes or, within one layer, of rows in two planes. Collective. */
static rcgns_status read_patch(rcgns_file *file, rcgns_status mine, const rc_zone *zone, const patch *p, int64_t node,
                               double *out, rcgns_message *message)
{
  const int64_t ni = zone->vertices[0], nj = zone->vertices[1];
  const rc_box  box  = {.nd = 3, .origin = {zone->rind[4], zone->rind[2], zone->rind[0]}, .shape = {zone->vertices[2], nj, ni}};
  const int64_t from = (p->k0 * nj + p->j0) * ni;
  const int64_t first = p->rows < nj ? p->rows * ni : p->count; /* values of the first slab */
  const int64_t rest  = p->count - first;

  RC_TRY(rc_read(file, mine, node, &box, from, from + first, 'R', out, message));
  return rc_read(file, RCGNS_OK, node, &box, from + nj * ni, from + nj * ni + rest, 'R', out ? out + first : NULL, message);
}

static rcgns_status patch_nodes(rcgns_file *file, const rc_zone *zone, const patch *p, rcgns_message *message)
{
  ra_array    *xyz    = &file->build.xyz;
  double      *x      = ra_alloc(3 * p->count, sizeof *x);
  rcgns_status status = x && ra_reserve(xyz, p->count, 3 * sizeof *x) ? RCGNS_OK : rc_no_memory(message);

  for (int d = 0; d < 3; d++) {
    double *at = x ? x + d * p->count : NULL;

    RC_GOTO(done, status = read_patch(file, status, zone, p, zone->coordinate[d], at, message));
  }
  status = place_all(file, zone, p->count, x, x + p->count, x + 2 * p->count,
                     (p->k0 * zone->vertices[1] + p->j0) * zone->vertices[0], (double *)xyz->item + 3 * xyz->count, message);
  xyz->count += p->count;
  for (int64_t i = 0; i < p->count && status == RCGNS_OK; i++) {
    const int64_t row = i / zone->vertices[0], plane = row / p->rows;

    if (!rc_number_node(file, zone,
                        ((p->k0 + plane) * zone->vertices[1] + p->j0 + row % p->rows) * zone->vertices[0] +
                            i % zone->vertices[0]))
      status = rc_no_memory(message);
  }
  status = rc_agree(file->comm, status, message);
done:
  free(x);
  return status;
}

/* Faces of the cells [lo, hi): those towards larger indices of every cell, and the others where no cell of ours is beyond. */
static bool block_faces(rc_mesh *mesh, const rc_zone *zone, const patch *p, int64_t base, int64_t lo, int64_t hi,
                        int64_t first_cell)
{
  static const int8_t  corner[RC_HEXA_CORNERS][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},
                                                     {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};
  static const int8_t  axis[RC_HEXA_FACES] = {2, 1, 0, 1, 0, 2}, step[RC_HEXA_FACES] = {-1, -1, 1, 1, -1, 1};
  const int64_t *const n         = zone->cells;
  const int64_t        stride[3] = {1, n[0], n[0] * n[1]};

  for (int64_t c = lo; c < hi; c++) {
    const int64_t at[3] = {c % n[0], c / n[0] % n[1], c / stride[2]};

    for (int f = 0; f < RC_HEXA_FACES; f++) {
      const int     a     = axis[f];
      const int64_t index = at[a] + step[f];
      int64_t       other = index < 0 || index >= n[a] ? -1 : c + step[f] * stride[a];
      int64_t       loop[4];

      if (other < lo || other >= hi) other = -1;
      if (other >= 0 && step[f] < 0) continue;
      for (int v = 0; v < 4; v++) {
        const int8_t *d = corner[rc_hexa_face[f][v]];

        loop[v] = base + ((at[2] + d[2] - p->k0) * p->rows + at[1] + d[1] - p->j0) * zone->vertices[0] + at[0] + d[0];
      }
      if (!rc_face_add(mesh, loop, 4, false, first_cell + c - lo, other < 0 ? -1 : first_cell + other - lo, f + 1))
        return false;
      if (index >= 0 && index < n[a]) continue;
      if (!rc_rim_add(mesh, zone, 2 * a + (step[f] > 0), at[0], at[1], at[2])) return false;
    }
  }
  return true;
}

static rcgns_status build_block(rcgns_file *file, const rc_zone *zone, int64_t lo, int64_t hi, int64_t first_cell,
                                rcgns_message *message)
{
  const patch   p    = patch_of(zone, lo, hi);
  const int64_t base = file->build.xyz.count;

  RC_TRY(patch_nodes(file, zone, &p, message));
  return rc_agree(file->comm, block_faces(&file->build, zone, &p, base, lo, hi, first_cell) ? RCGNS_OK : rc_no_memory(message),
                  message);
}

/* ---- nodes of elements -------------------------------------------------------------------------------------------- */

typedef struct located {
  double  xyz[3];
  int64_t shared;
} located;

/* The rank's slab of the coordinates, [n][3]. Collective. */
static rcgns_status read_slab(rcgns_file *file, rcgns_status mine, const rc_zone *zone, int64_t lo, int64_t hi, double *x,
                              rcgns_message *message)
{
  const rc_box box = {.nd = 1, .origin = {zone->rind[0]}, .shape = {zone->num_nodes}};

  for (int d = 0; d < 3; d++) {
    RC_TRY(rc_read(file, mine, zone->coordinate[d], &box, lo, hi, 'R', x ? x + d * (hi - lo) : NULL, message));
    mine = RCGNS_OK;
  }
  return RCGNS_OK;
}

/* Answer the requests: which nodes, from how many each. */
static rcgns_status answer(const rcgns_file *file, const rc_zone *zone, int64_t lo, int64_t n, const double *x,
                           const int64_t *asked, int64_t num_asked, located *reply, rcgns_message *message)
{
  uint8_t     *times  = calloc((size_t)n + 1, 1);
  rcgns_status status = times ? RCGNS_OK : rc_no_memory(message);

  for (int64_t i = 0; i < num_asked && times; i++)
    if (times[asked[i] - lo] < 2) times[asked[i] - lo]++;
  for (int64_t i = 0; i < num_asked && status == RCGNS_OK; i++) {
    const int64_t at = asked[i] - lo;

    status          = place_all(file, zone, 1, x + at, x + n + at, x + 2 * n + at, asked[i], reply[i].xyz, message);
    reply[i].shared = times[at] > 1;
  }
  free(times);
  return status;
}

rcgns_status rc_nodes_fetch(rcgns_file *file, rcgns_status mine, const rc_zone *zone, const int64_t *node, int64_t n,
                            double *xyz, uint8_t *shared, rcgns_message *message)
{
  const int64_t total = zone->num_nodes;
  const int64_t lo = ra_share(total, file->rank, file->size), hi = ra_share(total, file->rank + 1, file->size);
  int64_t      *count = calloc(3 * (size_t)file->size, sizeof *count), *next = count ? count + file->size : NULL;
  int64_t      *sorted = ra_alloc(n, sizeof *sorted), *place_of = ra_alloc(n, sizeof *place_of),
          *recv      = count ? count + 2 * file->size : NULL;
  double      *x     = ra_alloc(3 * (hi - lo), sizeof *x);
  void        *asked = NULL, *back = NULL;
  located     *reply     = NULL;
  int64_t      num_asked = 0;
  rcgns_status status    = mine;

  if (status == RCGNS_OK && !(count && sorted && place_of && x)) status = rc_no_memory(message);
  for (int64_t i = 0; i < n && status == RCGNS_OK; i++) count[ra_owner(total, node[i], file->size)]++;
  for (int r = 1; r < file->size && status == RCGNS_OK; r++) next[r] = next[r - 1] + count[r - 1];
  for (int64_t i = 0; i < n && status == RCGNS_OK; i++) {
    place_of[i]         = next[ra_owner(total, node[i], file->size)]++;
    sorted[place_of[i]] = node[i];
  }
  RC_GOTO(done, status = rc_exchange(file->comm, status, sorted, count, sizeof *sorted, &asked, recv, message));
  RC_GOTO(done, status = read_slab(file, RCGNS_OK, zone, lo, hi, x, message));
  for (int r = 0; r < file->size; r++) num_asked += recv[r];
  reply  = ra_alloc(num_asked, sizeof *reply);
  status = reply ? answer(file, zone, lo, hi - lo, x, asked, num_asked, reply, message) : rc_no_memory(message);
  RC_GOTO(done, status = rc_exchange(file->comm, status, reply, recv, sizeof *reply, &back, count, message));
  for (int64_t i = 0; i < n; i++) {
    const located *l = (const located *)back + place_of[i];

    memcpy(xyz + 3 * i, l->xyz, sizeof l->xyz);
    if (shared) shared[i] = l->shared != 0;
  }
done:
  free(count);
  free(sorted);
  free(place_of);
  free(x);
  free(asked);
  free(back);
  free(reply);
  return status;
}

/* ---- the whole ---------------------------------------------------------------------------------------------------- */

/* Turn the faces of zones round whose volume is negative; first_face [zones + 1] says which faces are whose. Collective. */
static rcgns_status orient_zones(rcgns_file *file, const int64_t *first_face, rcgns_message *message)
{
  const rc_mesh *mesh   = &file->build;
  const int64_t *offset = mesh->face_offset.item, *neighbour = mesh->face_neighbour.item;
  int64_t       *node   = mesh->face_node.item;
  const double  *xyz    = mesh->xyz.item;
  double        *volume = calloc((size_t)file->num_zones, sizeof *volume);
  rcgns_status   status = rc_agree(file->comm, volume ? RCGNS_OK : rc_no_memory(message), message);

  if (status != RCGNS_OK) {
    free(volume);
    return status;
  }
  for (int64_t z = 0; z < file->num_zones; z++)
    for (int64_t f = first_face[z]; f < first_face[z + 1]; f++)
      if (neighbour[f] < 0)
        volume[z] += rc_cone(xyz, node + offset[f], offset[f + 1] - offset[f], xyz + 3 * node[offset[first_face[z]]]);
  for (int64_t z = 0; z < file->num_zones; z += 1 << 20)
    MPI_Allreduce(MPI_IN_PLACE, volume + z, (int)(file->num_zones - z < 1 << 20 ? file->num_zones - z : 1 << 20), MPI_DOUBLE,
                  MPI_SUM, file->comm);
  for (int64_t z = 0; z < file->num_zones; z++)
    for (int64_t f = first_face[z]; f < first_face[z + 1] && volume[z] < 0.0; f++)
      for (int64_t a = offset[f], b = offset[f + 1] - 1; a < b; a++, b--) {
        const int64_t keep = node[a];

        node[a] = node[b];
        node[b] = keep;
      }
  free(volume);
  return RCGNS_OK;
}

static rcgns_status build_zone(rcgns_file *file, int64_t z, rcgns_message *message)
{
  const rc_zone *zone  = file->zone + z;
  ra_array      *cells = &file->build.cell_global;
  const int64_t  first = cells->count;
  const int64_t  lo    = rc_clamp(file->cell_lo - zone->first_cell, 0, zone->num_cells),
                hi     = rc_clamp(file->cell_hi - zone->first_cell, lo, zone->num_cells);
  rcgns_status status  = RCGNS_OK;

  for (int64_t c = lo; c < hi && status == RCGNS_OK; c++)
    if (!ra_push_int(cells, zone->first_cell + c)) status = rc_no_memory(message);
  RC_TRY(rc_agree(file->comm, status, message));
  return zone->is_structured ? build_block(file, zone, lo, hi, first, message)
                             : rc_sections_build(file, zone, lo, hi, first, message);
}

rcgns_status rc_mesh_build(rcgns_file *file, rcgns_message *message)
{
  rc_mesh     *build      = &file->build;
  int64_t     *first_face = ra_alloc(file->num_zones + 1, sizeof *first_face);
  rcgns_status status     = first_face && ra_push_int(&build->face_offset, 0) ? RCGNS_OK : rc_no_memory(message);

  status = rc_agree(file->comm, status, message);
  for (int64_t z = 0; z < file->num_zones && status == RCGNS_OK; z++) {
    first_face[z] = build->face_owner.count;
    status        = build_zone(file, z, message);
  }
  if (status == RCGNS_OK) {
    first_face[file->num_zones] = build->face_owner.count;
    status                      = orient_zones(file, first_face, message);
  }
  free(first_face);
  return status;
}

void rc_mesh_view(rcgns_file *file)
{
  const rc_mesh *build = &file->build;

  file->mesh = (remap_mesh){.num_nodes        = build->xyz.count,
                            .num_faces        = build->face_owner.count,
                            .num_cells        = build->cell_global.count,
                            .node_xyz         = build->xyz.item,
                            .face_offset      = build->face_offset.item,
                            .face_node        = build->face_node.item,
                            .face_owner       = build->face_owner.item,
                            .face_neighbour   = build->face_neighbour.item,
                            .cell_global      = build->cell_global.item,
                            .name             = file->path,
                            .num_zones        = file->num_zones,
                            .zone_name        = file->zone_name,
                            .zone_cell_offset = file->zone_cell_offset};
}

void rc_mesh_drop(rc_mesh *mesh)
{
  ra_drop(&mesh->xyz);
  ra_drop(&mesh->node_number);
  ra_drop(&mesh->face_number);
  ra_drop(&mesh->face_offset);
  ra_drop(&mesh->face_node);
  ra_drop(&mesh->face_owner);
  ra_drop(&mesh->face_neighbour);
  ra_drop(&mesh->cell_global);
  ra_drop(&mesh->rim);
  ra_drop(&mesh->rim_node);
}
