/* sids_elements -- this rank's elements of an unstructured zone: tetrahedra, pyramids, prisms, hexahedra.
 *
 * The rank's rows are read, the coordinates of their nodes come from the ranks that read them as slabs, and faces join by node
 * numbers through a hash. Polyhedra among the sections go to sids_poly. O(cells) time and memory, one exchange. */
#include "cgns_private.h"

#include <stdlib.h>
#include <string.h>

enum { MAX_FACES = RC_HEXA_FACES, MAX_CORNERS = RC_HEXA_CORNERS };

/* Faces of the standard elements, outward, corners from 0; -1 pads triangles. */
static const int8_t TETRA[][4] = {{0, 2, 1, -1}, {0, 1, 3, -1}, {1, 2, 3, -1}, {2, 0, 3, -1}};
static const int8_t PYRA[][4]  = {{0, 3, 2, 1}, {0, 1, 4, -1}, {1, 2, 4, -1}, {2, 3, 4, -1}, {3, 0, 4, -1}};
static const int8_t PENTA[][4] = {{0, 1, 4, 3}, {1, 2, 5, 4}, {2, 0, 3, 5}, {0, 2, 1, -1}, {3, 4, 5, -1}};
const int8_t rc_hexa_face[RC_HEXA_FACES][4] = {
    {0, 3, 2, 1}, {0, 1, 5, 4}, {1, 2, 6, 5}, {2, 3, 7, 6}, {0, 4, 7, 3}, {4, 5, 6, 7}};

static const struct {
  int num;
  const int8_t (*face)[4];
} ELEMENT[] = {[RC_NONE]  = {0, NULL},
               [RC_TETRA] = {4, TETRA},
               [RC_PYRA]  = {5, PYRA},
               [RC_PENTA] = {5, PENTA},
               [RC_HEXA]  = {RC_HEXA_FACES, rc_hexa_face}};

/* The standard elements of this rank in one zone. */
typedef struct elements {
  ra_array cell;   /* int64_t: number in the zone */
  ra_array shape;  /* int64_t: rc_shape */
  ra_array corner; /* int64_t [count][MAX_CORNERS] node in the zone, later in this rank's mesh; the rest is -1 */
  ra_map   node;   /* node in the zone -> in the order they come */
  uint8_t *shared; /* [nodes] other ranks have it too */
  int64_t  base;   /* index in this rank's mesh of its first node */
} elements;

static void drop_elements(elements *e)
{
  ra_drop(&e->cell);
  ra_drop(&e->shape);
  ra_drop(&e->corner);
  ra_map_drop(&e->node);
  free(e->shared);
}

static rcgns_status add_element(const rcgns_file *file, const rc_zone *zone, elements *e, int64_t cell, rc_shape shape,
                                const int64_t *node, rcgns_message *message)
{
  int64_t corner[MAX_CORNERS];

  for (int i = 0; i < MAX_CORNERS; i++) {
    corner[i] = i < rc_corners(shape) ? node[i] - 1 : -1;
    if (i < rc_corners(shape) && (node[i] < 1 || node[i] > zone->num_nodes))
      return rc_fail(message, RCGNS_GEOMETRY,
                     "%s: zone %s: cell %lld refers to node %lld, but there are %lld: the mesh is damaged", file->path,
                     zone->name, (long long)cell + 1, (long long)node[i], (long long)zone->num_nodes);
  }
  if (!ra_push_int(&e->cell, cell) || !ra_push_int(&e->shape, (int64_t)shape) || !ra_reserve(&e->corner, 1, sizeof corner))
    return rc_no_memory(message);
  memcpy((int64_t *)e->corner.item + MAX_CORNERS * e->corner.count++, corner, sizeof corner);
  return RCGNS_OK;
}

/* Cells [lo, hi) of a section of one type. Collective. */
static rcgns_status read_fixed(rcgns_file *file, const rc_zone *zone, const rc_section *s, int64_t lo, int64_t hi, elements *e,
                               rcgns_message *message)
{
  int64_t     *node   = ra_alloc((hi - lo) * s->npe, sizeof *node);
  rcgns_status status = node ? RCGNS_OK : rc_no_memory(message);

  status = rc_read_1d(file, status, s->connectivity, (s->row_lo + lo) * s->npe, (s->row_lo + hi) * s->npe, 'I', node, message);
  for (int64_t i = 0; i < hi - lo && status == RCGNS_OK; i++)
    status = add_element(file, zone, e, s->first_cell + lo + i, s->shape, node + i * s->npe, message);
  free(node);
  return rc_agree(file->comm, status, message);
}

/* Cells [lo, hi) of a MIXED section, which lie in the rows between two cuts. Collective. */
static rcgns_status read_mixed(rcgns_file *file, const rc_zone *zone, const rc_section *s, int64_t lo, int64_t hi, elements *e,
                               rcgns_message *message)
{
  ra_array     offset = {.item = NULL}, data = {.item = NULL};
  rc_cut       cut[2] = {{0, 0, 0}, {-RC_CUT, 0, 0}};
  const int64_t end[2] = {lo, hi - 1};
  int64_t      cell, row_lo, row_hi;
  rcgns_status status;

  RC_TRY(rc_cuts_find(file, RCGNS_OK, s, true, lo < hi ? 2 : 0, end, cut, message));
  cell   = cut[0].cell;
  row_lo = cut[0].row;
  row_hi = rc_clamp(cut[1].row + RC_CUT, 0, s->num_rows);
  status = rc_rows_read(file, zone, s, row_lo, row_hi, &offset, &data, message);
  for (int64_t r = row_lo; r < row_hi && status == RCGNS_OK; r++) {
    const int64_t *row = (const int64_t *)data.item + ((const int64_t *)offset.item)[r - row_lo];
    rc_shape       shape;

    rc_mixed_nodes(file->version, row[0], &shape);
    if (shape == RC_NONE || r < s->row_lo || r >= s->row_hi) continue;
    if (cell >= lo && cell < hi) status = add_element(file, zone, e, s->first_cell + cell, shape, row + 1, message);
    cell++;
  }
  ra_drop(&offset);
  ra_drop(&data);
  return rc_agree(file->comm, status, message);
}

/* Number the nodes, fetch their coordinates. Collective. */
static rcgns_status locate(rcgns_file *file, const rc_zone *zone, elements *e, rcgns_message *message)
{
  ra_array    *xyz    = &file->build.xyz;
  int64_t     *corner = e->corner.item;
  rcgns_status status = RCGNS_OK;
  int64_t      n;

  e->base       = xyz->count;
  e->node.width = 1;
  for (int64_t i = 0; i < MAX_CORNERS * e->corner.count && status == RCGNS_OK; i++) {
    if (corner[i] < 0) continue;
    corner[i] = ra_map_add(&e->node, &corner[i]);
    if (corner[i] < 0) status = rc_no_memory(message);
  }
  n         = e->node.key.count;
  e->shared = ra_alloc(n, 1);
  if (status == RCGNS_OK && !(e->shared && ra_reserve(xyz, n, 3 * sizeof(double)))) status = rc_no_memory(message);
  for (int64_t i = 0; i < n && status == RCGNS_OK; i++)
    if (!rc_number_node(file, zone, ((const int64_t *)e->node.key.item)[i])) status = rc_no_memory(message);
  RC_TRY(rc_nodes_fetch(file, status, zone, e->node.key.item, n, (double *)xyz->item + 3 * xyz->count, e->shared, message));
  xyz->count += n;
  return RCGNS_OK;
}

/* Face f of element i: its loop without repetitions of neighbours, its sorted nodes. Returns the number of distinct nodes. */
static int side_of(const elements *e, int64_t i, int f, int64_t *loop, int *length, int64_t key[4])
{
  const int64_t *corner   = (const int64_t *)e->corner.item + MAX_CORNERS * i;
  const int8_t  *face     = ELEMENT[((const int64_t *)e->shape.item)[i]].face[f];
  int            distinct = 0, n = 0;

  for (int v = 0; v < 4 && face[v] >= 0; v++) {
    const int64_t node = corner[face[v]];
    int           k    = 0;

    if (!n || loop[n - 1] != node) loop[n++] = node;
    while (k < distinct && key[k] != node) k++;
    if (k < distinct) continue;
    for (k = distinct++; k > 0 && key[k - 1] > node; k--) key[k] = key[k - 1];
    key[k] = node;
  }
  while (n > 1 && loop[n - 1] == loop[0]) n--;
  for (int k = distinct; k < 4; k++) key[k] = -1;
  *length = n;
  return distinct;
}

/* Do two loops over the same nodes run against each other? */
static bool is_opposite(const int64_t *a, int n, const int64_t *b, int m)
{
  int at = 0;

  if (n != m) return false;
  while (at < m && b[at] != a[0]) at++;
  if (at == m) return false;
  for (int i = 0; i < n; i++)
    if (a[i] != b[(at + m - i) % m]) return false;
  return true;
}

/* Faces that join by their nodes. For each set of nodes: up to two sides, MAX_FACES * element + face. */
typedef struct joints {
  ra_map   set;
  ra_array side;  /* int64_t [sets][2], -1: none */
  ra_array alone; /* int64_t: sides that fold back on their own cell */
} joints;

static rcgns_status join_side(const rcgns_file *file, const rc_zone *zone, const elements *e, joints *j, int64_t side,
                              const int64_t key[4], rcgns_message *message)
{
  const int64_t *cell = e->cell.item;
  const int64_t  set  = ra_map_add(&j->set, key);
  int64_t       *both;

  if (set < 0) return rc_no_memory(message);
  if (set == j->side.count / 2 && !(ra_push_int(&j->side, -1) && ra_push_int(&j->side, -1))) return rc_no_memory(message);
  both = (int64_t *)j->side.item + 2 * set;
  if (both[0] >= 0 && both[1] >= 0)
    return rc_fail(message, RCGNS_GEOMETRY,
                   "%s: zone %s: the cells %lld, %lld and %lld share one face: at most two can: repair the mesh", file->path,
                   zone->name, (long long)cell[both[0] / MAX_FACES] + 1, (long long)cell[both[1] / MAX_FACES] + 1,
                   (long long)cell[side / MAX_FACES] + 1);
  both[both[0] >= 0] = side;
  return RCGNS_OK;
}

/* All sides of all elements. A flat cell's two equal faces join nothing: its neighbours see each other through it. */
static rcgns_status join(const rcgns_file *file, const rc_zone *zone, const elements *e, joints *j, rcgns_message *message)
{
  j->set.width = 4;
  for (int64_t i = 0; i < e->cell.count; i++) {
    const int num = ELEMENT[((const int64_t *)e->shape.item)[i]].num;
    int64_t   key[MAX_FACES][4], loop[4];
    int       distinct[MAX_FACES], length;

    for (int f = 0; f < num; f++) distinct[f] = side_of(e, i, f, loop, &length, key[f]);
    for (int f = 0; f < num; f++) {
      bool folded = false;

      if (distinct[f] < 3) continue;
      for (int g = 0; g < num; g++) folded = folded || (g != f && !memcmp(key[f], key[g], sizeof key[f]));
      if (!folded)
        RC_TRY(join_side(file, zone, e, j, MAX_FACES * i + f, key[f], message));
      else if (!ra_push_int(&j->alone, MAX_FACES * i + f))
        return rc_no_memory(message);
    }
  }
  return RCGNS_OK;
}

/* Nodes of these elements as nodes of the zone, ascending, then -1. */
static void zone_key(const elements *e, const int64_t key[4], int64_t out[4])
{
  const int64_t *node = e->node.key.item;

  for (int k = 0; k < 4; k++) out[k] = -1;
  for (int k = 0; k < 4 && key[k] >= 0; k++) {
    int at = k;

    for (; at > 0 && out[at - 1] > node[key[k]]; at--) out[at] = out[at - 1];
    out[at] = node[key[k]];
  }
}

/* A side, or two that join, into the mesh. */
static bool emit(rc_mesh *mesh, const rc_zone *zone, const elements *e, int64_t first_cell, int64_t lo, int64_t side,
                 int64_t other)
{
  const int64_t *cell = e->cell.item;
  int64_t        loop[4], key[4], against[4];
  int            n, m = 0;

  side_of(e, side / MAX_FACES, (int)(side % MAX_FACES), loop, &n, key);
  if (other >= 0) side_of(e, other / MAX_FACES, (int)(other % MAX_FACES), against, &m, key);
  if (other >= 0 && !is_opposite(loop, n, against, m))
    return emit(mesh, zone, e, first_cell, lo, side, -1) && emit(mesh, zone, e, first_cell, lo, other, -1);
  for (int i = 0; i < n; i++) loop[i] += e->base;
  if (!rc_face_add(mesh, loop, n, false, first_cell + cell[side / MAX_FACES] - lo,
                   other < 0 ? -1 : first_cell + cell[other / MAX_FACES] - lo, side % MAX_FACES + 1))
    return false;
  if (other >= 0) return true;
  zone_key(e, key, against);
  return rc_rim_add(mesh, zone, against[0], against[1], against[2], against[3]);
}

typedef struct claim {
  int64_t key[4], cell, sides;
} claim;

static int by_key(const void *a, const void *b)
{
  const claim *x = a, *y = b;

  for (int k = 0; k < 4; k++)
    if (x->key[k] != y->key[k]) return x->key[k] < y->key[k] ? -1 : 1;
  return (x->cell > y->cell) - (x->cell < y->cell);
}

/* A set of nodes that other ranks may have as a face too, in the zone's numbers; false: they cannot. */
static bool claim_of(const elements *e, const joints *j, int64_t set, claim *c)
{
  const int64_t *key = (const int64_t *)j->set.key.item + 4 * set, *both = (const int64_t *)j->side.item + 2 * set;

  *c = (claim){.cell = ((const int64_t *)e->cell.item)[both[0] / MAX_FACES], .sides = both[1] < 0 ? 1 : 2};
  for (int k = 0; k < 4 && key[k] >= 0; k++)
    if (!e->shared[key[k]]) return false;
  zone_key(e, key, c->key);
  return true;
}

/* No face may belong to three cells, wherever they are. Collective; only faces between ranks travel. */
static rcgns_status check_shared(rcgns_file *file, const rc_zone *zone, const elements *e, const joints *j,
                                 rcgns_message *message)
{
  const int64_t sets   = j->set.key.count;
  int64_t      *count  = calloc(3 * (size_t)file->size, sizeof *count);
  rcgns_status  status = count ? RCGNS_OK : rc_no_memory(message);
  claim        *send   = NULL, one;
  void         *got    = NULL;
  int64_t       total = 0, num = 0;

  for (int64_t s = 0; s < sets && count; s++)
    if (claim_of(e, j, s, &one)) count[one.key[0] % file->size]++, num++;
  if (!(send = ra_alloc(num, sizeof *send))) status = rc_no_memory(message);
  for (int r = 1; r < file->size && count; r++) count[file->size + r] = count[file->size + r - 1] + count[r - 1];
  for (int64_t s = 0; s < sets && status == RCGNS_OK; s++)
    if (claim_of(e, j, s, &one)) send[count[file->size + one.key[0] % file->size]++] = one;
  RC_GOTO(done, status = rc_exchange(file->comm, status, send, count, sizeof *send, &got, count ? count + 2 * file->size : NULL,
                                     message));
  for (int r = 0; r < file->size; r++) total += count[2 * file->size + r];
  qsort(got, (size_t)total, sizeof *send, by_key);
  for (int64_t i = 0, first = 0, sides = 0; i < total && status == RCGNS_OK; i++) {
    const claim *c = (const claim *)got + i;

    if (memcmp(c->key, ((const claim *)got)[first].key, sizeof c->key)) first = i, sides = 0;
    sides += c->sides;
    if (sides > 2)
      status =
          rc_fail(message, RCGNS_GEOMETRY,
                  "%s: zone %s: more than two cells, %lld and %lld among them, share the face with the nodes %lld %lld %lld: "
                  "repair the mesh",
                  file->path, zone->name, (long long)((const claim *)got)[first].cell + 1, (long long)c->cell + 1,
                  (long long)c->key[0] + 1, (long long)c->key[1] + 1, (long long)c->key[2] + 1);
  }
  status = rc_agree(file->comm, status, message);
done:
  free(count);
  free(send);
  free(got);
  return status;
}

static rcgns_status build_elements(rcgns_file *file, const rc_zone *zone, elements *e, int64_t lo, int64_t first_cell,
                                   rcgns_message *message)
{
  joints       j      = {.alone = {.item = NULL}};
  rcgns_status status = locate(file, zone, e, message);

  if (status == RCGNS_OK) {
    status = rc_agree(file->comm, join(file, zone, e, &j, message), message);
    if (status == RCGNS_OK) status = check_shared(file, zone, e, &j, message);
    if (status == RCGNS_OK) {
      const int64_t *side = j.side.item, *alone = j.alone.item;
      bool           ok = true;

      for (int64_t s = 0; s < j.set.key.count && ok; s++)
        ok = emit(&file->build, zone, e, first_cell, lo, side[2 * s], side[2 * s + 1]);
      for (int64_t s = 0; s < j.alone.count && ok; s++) ok = emit(&file->build, zone, e, first_cell, lo, alone[s], -1);
      status = rc_agree(file->comm, ok ? RCGNS_OK : rc_no_memory(message), message);
    }
  }
  ra_map_drop(&j.set);
  ra_drop(&j.side);
  ra_drop(&j.alone);
  return status;
}

rcgns_status rc_sections_build(rcgns_file *file, const rc_zone *zone, int64_t lo, int64_t hi, int64_t first_cell,
                               rcgns_message *message)
{
  elements     e      = {.base = 0};
  bool         any    = false;
  rcgns_status status = RCGNS_OK;

  if (zone->by_parents) return rc_poly_build(file, zone, NULL, lo, hi, first_cell, message);
  for (int64_t i = 0; i < zone->num_sections && status == RCGNS_OK; i++) {
    const rc_section *s = zone->section + i;
    const int64_t     a = rc_clamp(lo - s->first_cell, 0, s->num_cells), b = rc_clamp(hi - s->first_cell, a, s->num_cells);

    if (s->is_poly) continue;
    any = true;
    status =
        s->layout == RC_MIXED ? read_mixed(file, zone, s, a, b, &e, message) : read_fixed(file, zone, s, a, b, &e, message);
  }
  if (status == RCGNS_OK && any) status = build_elements(file, zone, &e, lo, first_cell, message);
  drop_elements(&e);
  for (int64_t i = 0; i < zone->num_sections && status == RCGNS_OK; i++) {
    const rc_section *s = zone->section + i;
    const int64_t     a = rc_clamp(lo, s->first_cell, s->first_cell + s->num_cells),
                  b     = rc_clamp(hi, a, s->first_cell + s->num_cells);

    if (s->is_poly) status = rc_poly_build(file, zone, s, a, b, first_cell + a - lo, message);
  }
  return status;
}
