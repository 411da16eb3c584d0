/* sids_poly -- polyhedra: cells as lists of faces (NFACE_n, or ParentElements alone), faces as loops of nodes (NGON_n).
 *
 * The rank reads its cells' faces, asks the ranks that read NGON_n as slabs for the loops, and the slab readers of the
 * coordinates for the nodes. Signs are trusted where they close the cell: every edge run as often one way as the other. Else
 * the faces are turned so that neighbours in the cell agree and its volume is positive. O(faces) plus a sort of each cell's
 * edges. */
#include "cgns_private.h"

#include <stdlib.h>
#include <string.h>

/* The polyhedra of this rank in one section. */
typedef struct polys {
  int64_t  num_cells;
  int64_t  number;        /* in the zone, of the first cell */
  ra_array offset;        /* [num_cells + 1] */
  ra_array face;          /* face of the zone, later of `faces` below */
  ra_array sign;          /* 1: its normal points out of the cell; -1: into it; 0: listed twice, bounds nothing */
  ra_map   faces;         /* face of the zone -> local face */
  ra_array ref;           /* [local faces][2] where in `face` the cells that have it list it, -1 */
  ra_array loop_at, loop; /* [local faces + 1], nodes: of the zone, later of this rank's mesh */
  ra_map   nodes;         /* node of the zone -> node of this rank's mesh less first_node */
  int64_t  first_node;
} polys;

static int64_t *ints_of(const ra_array *array) { return array->item; }

static void drop_polys(polys *p)
{
  ra_drop(&p->offset);
  ra_drop(&p->face);
  ra_drop(&p->sign);
  ra_map_drop(&p->faces);
  ra_map_drop(&p->nodes);
  ra_drop(&p->ref);
  ra_drop(&p->loop_at);
  ra_drop(&p->loop);
}

/* The face of the zone with that element number, -1: none. */
static int64_t face_numbered(const rc_zone *zone, int64_t number)
{
  for (int64_t i = 0; i < zone->num_face_sections; i++) {
    const rc_section *s = zone->face + i;

    if (number >= s->first && number - s->first < s->num_rows) return s->first_cell + number - s->first;
  }
  return -1;
}

/* The element number of a face of the zone. */
static int64_t number_of(const rc_zone *zone, int64_t face)
{
  int64_t i = zone->num_face_sections - 1;

  while (i > 0 && zone->face[i].first_cell > face) i--;
  return zone->face[i].first + face - zone->face[i].first_cell;
}

/* ---- cells -------------------------------------------------------------------------------------------------------- */

/* Faces of the cells from rows of NFACE_n. Collective. */
static rcgns_status read_nface(rcgns_file *file, const rc_zone *zone, const rc_section *s, int64_t lo, int64_t hi, polys *p,
                               rcgns_message *message)
{
  const int64_t row    = s->row_lo - s->first_cell;
  rcgns_status  status = rc_rows_read(file, zone, s, row + lo, row + hi, &p->offset, &p->face, message);
  int64_t      *face   = p->face.item;

  RC_TRY(status);
  if (!ra_reserve(&p->sign, p->face.count, sizeof *face)) status = rc_no_memory(message);
  for (int64_t c = 0; c < hi - lo && status == RCGNS_OK; c++)
    for (int64_t i = ints_of(&p->offset)[c]; i < ints_of(&p->offset)[c + 1] && status == RCGNS_OK; i++) {
      const int64_t number = face[i];

      ints_of(&p->sign)[i] = number < 0 ? -1 : 1;
      face[i]              = number == INT64_MIN ? -1 : face_numbered(zone, number < 0 ? -number : number);
      if (face[i] < 0)
        status = rc_fail(message, RCGNS_GEOMETRY, "%s: zone %s: cell %lld refers to face %lld, which no NGON_n section holds",
                         file->path, zone->name, (long long)(lo + c + 1), (long long)number);
    }
  p->sign.count = p->face.count;
  return rc_agree(file->comm, status, message);
}

typedef struct side {
  int64_t cell, face, sign; /* cell of the zone */
} side;

/* This rank's share of the parents of one NGON_n section, appended to sides. Collective. */
static rcgns_status read_parents(rcgns_file *file, const rc_zone *zone, const rc_section *s, ra_array *sides,
                                 rcgns_message *message)
{
  const int64_t n  = s->num_rows;
  const int64_t lo = ra_share(n, file->rank, file->size), hi = ra_share(n, file->rank + 1, file->size), num = hi - lo;
  const rc_box  box    = rc_whole(rc_node_at(&file->tree, s->parents));
  int64_t      *parent = ra_alloc(2 * num, sizeof *parent);
  rcgns_status  status = parent && ra_reserve(sides, 2 * num, sizeof(side)) ? RCGNS_OK : rc_no_memory(message);

  RC_GOTO(done, status = rc_read(file, status, s->parents, &box, lo, hi, 'I', parent, message));
  RC_GOTO(done, status = rc_read(file, RCGNS_OK, s->parents, &box, n + lo, n + hi, 'I', parent + num, message));
  for (int64_t i = 0; i < 2 * num && status == RCGNS_OK; i++) {
    const int64_t cell = parent[i] - zone->parent_base;

    if (!parent[i]) continue;
    if (cell < 0 || cell >= zone->num_cells)
      status =
          rc_fail(message, RCGNS_GEOMETRY, "%s: zone %s: ParentElements names cell %lld, which is not among its %lld cells",
                  file->path, zone->name, (long long)parent[i], (long long)zone->num_cells);
    else
      ((side *)sides->item)[sides->count++] = (side){cell, s->first_cell + lo + i % num, i < num ? 1 : -1};
  }
  status = rc_agree(file->comm, status, message);
done:
  free(parent);
  return status;
}

static int by_cell_face(const void *a, const void *b)
{
  const side *x = a, *y = b;

  if (x->cell != y->cell) return x->cell < y->cell ? -1 : 1;
  if (x->face != y->face) return x->face < y->face ? -1 : 1;
  return (x->sign < y->sign) - (x->sign > y->sign);
}

/* Faces of the cells [lo, hi) from ParentElements. Collective. */
static rcgns_status read_by_parents(rcgns_file *file, const rc_zone *zone, int64_t lo, int64_t hi, polys *p,
                                    rcgns_message *message)
{
  ra_array     sides = {.item = NULL};
  int64_t     *count = calloc(2 * (size_t)file->size, sizeof *count), total = 0;
  void        *got    = NULL;
  rcgns_status status = RCGNS_OK;

  for (int64_t i = 0; i < zone->num_face_sections && status == RCGNS_OK; i++)
    status = read_parents(file, zone, zone->face + i, &sides, message);
  if (status != RCGNS_OK) goto done;
  qsort(sides.item, (size_t)sides.count, sizeof(side), by_cell_face); /* cells ascend with the rank that owns them */
  for (int64_t i = 0; i < sides.count && count; i++)
    count[ra_owner(file->num_cells, zone->first_cell + ((side *)sides.item)[i].cell, file->size)]++;
  status = count ? RCGNS_OK : rc_no_memory(message);
  RC_GOTO(done, status = rc_exchange(file->comm, status, sides.item, count, sizeof(side), &got,
                                     count ? count + file->size : NULL, message));
  for (int r = 0; r < file->size; r++) total += count[file->size + r];
  qsort(got, (size_t)total, sizeof(side), by_cell_face);
  if (!ra_reserve(&p->face, total, sizeof(int64_t)) || !ra_reserve(&p->sign, total, sizeof(int64_t)) ||
      !ra_reserve(&p->offset, hi - lo + 1, sizeof(int64_t)))
    status = rc_no_memory(message);
  for (int64_t c = lo, i = 0; c <= hi && status == RCGNS_OK; c++) {
    while (i < total && ((const side *)got)[i].cell < c) i++;
    ints_of(&p->offset)[p->offset.count++] = i;
  }
  for (int64_t i = 0; i < total && status == RCGNS_OK; i++) {
    ints_of(&p->face)[p->face.count++] = ((const side *)got)[i].face;
    ints_of(&p->sign)[p->sign.count++] = ((const side *)got)[i].sign;
  }
  status = rc_agree(file->comm, status, message);
done:
  ra_drop(&sides);
  free(count);
  free(got);
  return status;
}

/* ---- faces -------------------------------------------------------------------------------------------------------- */

/* Number the faces and note the cells that have them. A face that a cell lists twice bounds nothing: its sign becomes 0. */
static rcgns_status number_faces(const rcgns_file *file, const rc_zone *zone, polys *p, rcgns_message *message)
{
  const int64_t *offset = p->offset.item;
  int64_t       *sign   = p->sign.item;

  p->faces.width = 1;
  for (int64_t c = 0; c < p->num_cells; c++) {
    if (offset[c + 1] - offset[c] < 4)
      return rc_fail(message, RCGNS_GEOMETRY, "%s: zone %s: cell %lld has %lld faces: it is not closed", file->path, zone->name,
                     (long long)(p->number + c + 1), (long long)(offset[c + 1] - offset[c]));
    for (int64_t i = offset[c]; i < offset[c + 1]; i++) {
      int64_t      *face = ints_of(&p->face) + i, *ref;
      const int64_t f    = ra_map_add(&p->faces, face);

      if (f < 0 || (2 * f == p->ref.count && !(ra_push_int(&p->ref, -1) && ra_push_int(&p->ref, -1))))
        return rc_no_memory(message);
      ref   = ints_of(&p->ref) + 2 * f;
      *face = f;
      if (ref[ref[1] >= 0] >= offset[c]) {
        sign[i] = sign[ref[ref[1] >= 0]] = 0;
        ref[ref[1] >= 0]                 = -1;
        continue;
      }
      if (ref[1] >= 0)
        return rc_fail(message, RCGNS_GEOMETRY,
                       "%s: zone %s: cell %lld is the third of face %lld: a face has at most two cells", file->path, zone->name,
                       (long long)(p->number + c + 1), (long long)number_of(zone, ints_of(&p->faces.key)[f]));
      ref[ref[0] >= 0] = i;
    }
  }
  return RCGNS_OK;
}

/* A slab of the zone's faces. */
typedef struct slab {
  int64_t  lo, hi;
  ra_array at, end; /* [hi - lo] where the loop of a face lies in node */
  ra_array node;
} slab;

/* Collective. */
static rcgns_status read_faces(rcgns_file *file, const rc_zone *zone, slab *s, rcgns_message *message)
{
  ra_array     offset = {.item = NULL}, data = {.item = NULL};
  rcgns_status status = RCGNS_OK;

  for (int64_t k = 0; k < zone->num_face_sections && status == RCGNS_OK; k++) {
    const rc_section *f = zone->face + k;
    const int64_t lo = rc_clamp(s->lo - f->first_cell, 0, f->num_rows), hi = rc_clamp(s->hi - f->first_cell, lo, f->num_rows);
    const int64_t base = s->node.count;
    bool          ok;

    RC_GOTO(done, status = rc_rows_read(file, zone, f, lo, hi, &offset, &data, message));
    ok = ra_reserve(&s->node, data.count, sizeof(int64_t));
    for (int64_t i = 0; i < hi - lo && ok; i++)
      ok = ra_push_int(&s->at, base + ints_of(&offset)[i]) && ra_push_int(&s->end, base + ints_of(&offset)[i + 1]);
    if (ok && data.count) memcpy(ints_of(&s->node) + base, data.item, (size_t)data.count * sizeof(int64_t));
    s->node.count += data.count;
    status = rc_agree(file->comm, ok ? RCGNS_OK : rc_no_memory(message), message);
  }
done:
  ra_drop(&offset);
  ra_drop(&data);
  return status;
}

typedef struct request {
  int64_t face, refs, cell; /* of the zone; a cell that has it */
} request;

/* The lengths and nodes that answer the requests; nodes count from 0. */
static rcgns_status answer(const rcgns_file *file, const rc_zone *zone, const slab *s, const request *asked, int64_t num,
                           ra_array *length, ra_array *node, rcgns_message *message)
{
  int64_t     *first = calloc(2 * (size_t)(s->hi - s->lo) + 1, sizeof *first), *refs = first + (s->hi - s->lo);
  rcgns_status status = first ? RCGNS_OK : rc_no_memory(message);

  for (int64_t i = 0; i < num && status == RCGNS_OK; i++) {
    const int64_t f = asked[i].face - s->lo, at = ints_of(&s->at)[f], n = ints_of(&s->end)[f] - at;

    if (!refs[f]) first[f] = asked[i].cell;
    refs[f] += asked[i].refs;
    if (refs[f] > 2)
      status =
          rc_fail(message, RCGNS_GEOMETRY,
                  "%s: zone %s: more than two cells, %lld and %lld among them, have face %lld: repair the mesh", file->path,
                  zone->name, (long long)first[f] + 1, (long long)asked[i].cell + 1, (long long)number_of(zone, asked[i].face));
    else if (!ra_push_int(length, n) || !ra_reserve(node, n, sizeof(int64_t)))
      status = rc_no_memory(message);
    for (int64_t v = 0; v < n && status == RCGNS_OK; v++) {
      const int64_t mine = ints_of(&s->node)[at + v];

      if (mine < 1 || mine > zone->num_nodes)
        status = rc_fail(message, RCGNS_GEOMETRY,
                         "%s: zone %s: face %lld refers to node %lld, but there are %lld: the mesh is damaged", file->path,
                         zone->name, (long long)number_of(zone, asked[i].face), (long long)mine, (long long)zone->num_nodes);
      else
        ints_of(node)[node->count++] = mine - 1;
    }
  }
  free(first);
  return status;
}

/* Requests, sorted by the rank that reads the face; place[f] is where local face f stands. */
static void make_requests(const rcgns_file *file, const rc_zone *zone, const polys *p, int64_t *count, int64_t *next,
                          request *send, int64_t *place)
{
  const int64_t *face = p->faces.key.item, *ref = p->ref.item, *offset = p->offset.item;

  for (int64_t f = 0; f < p->faces.key.count; f++) count[ra_owner(zone->num_faces, face[f], file->size)]++;
  next[0] = 0;
  for (int r = 1; r < file->size; r++) next[r] = next[r - 1] + count[r - 1];
  for (int64_t f = 0; f < p->faces.key.count; f++) {
    place[f]       = next[ra_owner(zone->num_faces, face[f], file->size)]++;
    send[place[f]] = (request){face[f], (ref[2 * f] >= 0) + (ref[2 * f + 1] >= 0), -1};
  }
  for (int64_t c = 0; c < p->num_cells; c++)
    for (int64_t i = offset[c]; i < offset[c + 1]; i++) send[place[ints_of(&p->face)[i]]].cell = p->number + c;
}

/* Sums of runs: recv[r] records in a row come from rank r, each with its length. */
static void sum_runs(int size, const int64_t *recv, const int64_t *length, int64_t *sum)
{
  for (int r = 0; r < size; r++) {
    sum[r] = 0;
    for (int64_t i = 0; i < recv[r]; i++) sum[r] += *length++;
  }
}

/* The loops of the faces, as nodes of the zone. Collective. */
static rcgns_status fetch_loops(rcgns_file *file, const rc_zone *zone, polys *p, rcgns_message *message)
{
  const int64_t num   = p->faces.key.count;
  slab          s     = {.lo = ra_share(zone->num_faces, file->rank, file->size),
                         .hi = ra_share(zone->num_faces, file->rank + 1, file->size)};
  int64_t      *count = calloc(5 * (size_t)file->size, sizeof *count), *place = ra_alloc(num, sizeof *place), *start = NULL;
  request      *send   = ra_alloc(num, sizeof *send);
  ra_array      length = {.item = NULL}, node = {.item = NULL};
  void         *asked = NULL, *lengths = NULL, *nodes = NULL;
  int64_t      *recv = NULL, *out = NULL, *in = NULL, num_asked = 0, at = 0;
  rcgns_status  status = count && place && send ? RCGNS_OK : rc_no_memory(message);

  if (status == RCGNS_OK) {
    recv = count + 2 * file->size;
    out  = count + 3 * file->size;
    in   = count + 4 * file->size;
    make_requests(file, zone, p, count, count + file->size, send, place);
  }
  RC_GOTO(done, status = rc_exchange(file->comm, status, send, count, sizeof *send, &asked, recv, message));
  RC_GOTO(done, status = read_faces(file, zone, &s, message));
  for (int r = 0; r < file->size; r++) num_asked += recv[r];
  status = answer(file, zone, &s, asked, num_asked, &length, &node, message);
  RC_GOTO(done, status = rc_exchange(file->comm, status, length.item, recv, sizeof(int64_t), &lengths, count, message));
  sum_runs(file->size, recv, length.item, out);
  RC_GOTO(done, status = rc_exchange(file->comm, RCGNS_OK, node.item, out, sizeof(int64_t), &nodes, in, message));
  start = ra_alloc(num + 1, sizeof *start);
  if (!start || !ra_push_int(&p->loop_at, 0)) status = rc_no_memory(message);
  for (int64_t i = 0; i < num && status == RCGNS_OK; i++) {
    start[i] = at;
    at += ((const int64_t *)lengths)[i];
  }
  for (int64_t f = 0; f < num && status == RCGNS_OK; f++) {
    const int64_t n = ((const int64_t *)lengths)[place[f]];

    if (!ra_reserve(&p->loop, n, sizeof(int64_t))) {
      status = rc_no_memory(message);
      break;
    }
    if (n) memcpy(ints_of(&p->loop) + p->loop.count, (const int64_t *)nodes + start[place[f]], (size_t)n * sizeof(int64_t));
    p->loop.count += n;
    if (!ra_push_int(&p->loop_at, p->loop.count)) status = rc_no_memory(message);
  }
  status = rc_agree(file->comm, status, message);
done:
  ra_drop(&s.at);
  ra_drop(&s.end);
  ra_drop(&s.node);
  ra_drop(&length);
  ra_drop(&node);
  free(count);
  free(place);
  free(start);
  free(send);
  free(asked);
  free(lengths);
  free(nodes);
  return status;
}

/* Turn the nodes of the loops into nodes of this rank's mesh. Collective. */
static rcgns_status locate(rcgns_file *file, const rc_zone *zone, polys *p, rcgns_message *message)
{
  ra_array    *xyz    = &file->build.xyz;
  int64_t     *loop   = p->loop.item;
  ra_map      *nodes  = &p->nodes;
  rcgns_status status = RCGNS_OK;

  nodes->width  = 1;
  p->first_node = xyz->count;
  for (int64_t i = 0; i < p->loop.count && status == RCGNS_OK; i++) {
    const int64_t local = ra_map_add(nodes, &loop[i]);

    if (local < 0) status = rc_no_memory(message);
    loop[i] = xyz->count + local;
  }
  if (status == RCGNS_OK && !ra_reserve(xyz, nodes->key.count, 3 * sizeof(double))) status = rc_no_memory(message);
  for (int64_t i = 0; i < nodes->key.count && status == RCGNS_OK; i++)
    if (!rc_number_node(file, zone, ((const int64_t *)nodes->key.item)[i])) status = rc_no_memory(message);
  status =
      rc_nodes_fetch(file, status, zone, nodes->key.item, nodes->key.count, (double *)xyz->item + 3 * xyz->count, NULL,
                     message);
  if (status == RCGNS_OK) xyz->count += nodes->key.count;
  return status;
}

/* ---- signs -------------------------------------------------------------------------------------------------------- */

typedef struct edge {
  int64_t lo, hi, at; /* nodes; where in the cell's list of faces */
  int     way;        /* 1: the face's loop runs from lo to hi; -1 */
} edge;

static int by_nodes(const void *a, const void *b)
{
  const edge *x = a, *y = b;

  if (x->lo != y->lo) return x->lo < y->lo ? -1 : 1;
  if (x->hi != y->hi) return x->hi < y->hi ? -1 : 1;
  return (x->at > y->at) - (x->at < y->at);
}

/* The edges of cell c, sorted by their nodes. */
static bool edges_of(const polys *p, int64_t c, ra_array *edges)
{
  edges->count = 0;
  for (int64_t i = ints_of(&p->offset)[c]; i < ints_of(&p->offset)[c + 1]; i++) {
    const int64_t  f = ints_of(&p->face)[i], n = ints_of(&p->loop_at)[f + 1] - ints_of(&p->loop_at)[f];
    const int64_t *loop = ints_of(&p->loop) + ints_of(&p->loop_at)[f];

    if (!ra_reserve(edges, n, sizeof(edge))) return false;
    for (int64_t v = 0; v < n && ints_of(&p->sign)[i]; v++) {
      const int64_t a = loop[v], b = loop[v + 1 < n ? v + 1 : 0];

      if (a != b) ((edge *)edges->item)[edges->count++] = (edge){a < b ? a : b, a < b ? b : a, i, a < b ? 1 : -1};
    }
  }
  qsort(edges->item, (size_t)edges->count, sizeof(edge), by_nodes);
  return true;
}

/* One past the last edge with the nodes of edge i. */
static int64_t run_of(const ra_array *edges, int64_t i)
{
  const edge *e = edges->item;
  int64_t     k = i + 1;

  while (k < edges->count && e[k].lo == e[i].lo && e[k].hi == e[i].hi) k++;
  return k;
}

/* Is every edge run as often one way as the other? */
static bool is_closed(const ra_array *edges, const int64_t *sign)
{
  const edge *e = edges->item;

  for (int64_t i = 0, k; i < edges->count; i = k) {
    int64_t sum = 0;

    k = run_of(edges, i);
    for (int64_t j = i; j < k; j++) sum += e[j].way * sign[e[j].at];
    if (sum) return false;
  }
  return true;
}

/* A forest over the faces of one cell: whom a face follows, and whether with its sign or against it. */
typedef struct forest {
  int64_t *parent, *same; /* [faces of all cells] same: 1 or -1 */
} forest;

/* The root of a face and, in *same, its sign relative to it. Paths are shortened on the way. */
static int64_t root_of(forest *t, int64_t i, int64_t *same)
{
  int64_t root = i, way = 1;

  for (; t->parent[root] != root; root = t->parent[root]) way *= t->same[root];
  *same = way;
  while (t->parent[i] != root) {
    const int64_t next = t->parent[i], step = t->same[i];

    t->parent[i] = root;
    t->same[i]   = way;
    way *= step;
    i = next;
  }
  return root;
}

/* Signs for the faces of cell c that agree along every edge between two of them; false: they do not hang together. */
static bool spread_signs(const polys *p, int64_t c, const ra_array *edges, forest *t, int64_t *trial)
{
  const int64_t begin = ints_of(&p->offset)[c], end = ints_of(&p->offset)[c + 1];
  const edge   *e    = edges->item;
  int64_t       root = -1, a, b;

  for (int64_t i = begin; i < end; i++) t->parent[i] = i, t->same[i] = 1;
  for (int64_t i = 0, k; i < edges->count; i = k) {
    k = run_of(edges, i);
    if (k == i + 2) {
      const int64_t x = root_of(t, e[i].at, &a), y = root_of(t, e[i + 1].at, &b);

      if (x != y) t->parent[y] = x, t->same[y] = -a * b * e[i].way * e[i + 1].way;
    }
  }
  for (int64_t i = begin; i < end; i++) {
    trial[i] = 0;
    if (!ints_of(&p->sign)[i]) continue;
    if (root < 0) root = root_of(t, i, &a);
    if (root_of(t, i, &trial[i]) != root) return false;
  }
  return true;
}

/* Six times the volume of cell c with these signs. */
static double volume_of(const rcgns_file *file, const polys *p, int64_t c, const int64_t *sign, const double *origin)
{
  const int64_t *loop = p->loop.item, *at = p->loop_at.item;
  double         sum = 0.0;

  for (int64_t i = ints_of(&p->offset)[c]; i < ints_of(&p->offset)[c + 1]; i++) {
    const int64_t f = ints_of(&p->face)[i];

    if (sign[i]) sum += (double)sign[i] * rc_cone(file->build.xyz.item, loop + at[f], at[f + 1] - at[f], origin);
  }
  return sum;
}

/* Signs that do not close their cell are replaced by ones that do, if there are any. A cell that no signs close is left to
 * remap_build, which knows coordinates. */
static rcgns_status repair_signs(const rcgns_file *file, polys *p, bool *repaired, rcgns_message *message)
{
  int64_t     *sign = p->sign.item, *space = ra_alloc(3 * p->sign.count, sizeof *space), *trial = space;
  forest       tree   = {space + p->sign.count, space + 2 * p->sign.count};
  ra_array     edges  = {.item = NULL};
  rcgns_status status = space ? RCGNS_OK : rc_no_memory(message);

  for (int64_t c = 0; c < p->num_cells && status == RCGNS_OK; c++) {
    const int64_t begin = ints_of(&p->offset)[c], end = ints_of(&p->offset)[c + 1];
    double        volume;

    if (!edges_of(p, c, &edges)) status = rc_no_memory(message);
    if (status != RCGNS_OK || is_closed(&edges, sign) || !spread_signs(p, c, &edges, &tree, trial) || !is_closed(&edges, trial))
      continue;
    volume = volume_of(file, p, c, trial, (const double *)file->build.xyz.item + 3 * ((const edge *)edges.item)->lo);
    for (int64_t i = begin; i < end; i++) sign[i] = volume < 0.0 ? -trial[i] : trial[i];
    *repaired = true;
  }
  ra_drop(&edges);
  free(space);
  return status;
}

/* ---- the whole ---------------------------------------------------------------------------------------------------- */

static int64_t cell_of(const polys *p, int64_t at)
{
  const int64_t *offset = p->offset.item;
  int64_t        lo = 0, hi = p->num_cells;

  while (hi - lo > 1) {
    const int64_t mid = lo + (hi - lo) / 2;

    if (offset[mid] <= at)
      lo = mid;
    else
      hi = mid;
  }
  return lo;
}

static int64_t distinct(const int64_t *loop, int64_t n)
{
  int64_t count = 0;

  for (int64_t i = 0; i < n && count < 3; i++) {
    int64_t k = 0;

    while (k < i && loop[k] != loop[i]) k++;
    count += k == i;
  }
  return count;
}

/* The face that was added last, number f here, is at the rim. */
static bool add_rim(rc_mesh *mesh, const rc_zone *zone, const polys *p, int64_t f)
{
  const int64_t *node  = p->nodes.key.item;
  const int64_t  begin = mesh->rim_node.count;

  for (int64_t k = ints_of(&p->loop_at)[f]; k < ints_of(&p->loop_at)[f + 1]; k++)
    if (!ra_push_int(&mesh->rim_node, node[ints_of(&p->loop)[k] - p->first_node])) return false;
  return rc_rim_add(mesh, zone, number_of(zone, ints_of(&p->faces.key)[f]), -1, begin, mesh->rim_node.count);
}

static bool emit(rc_mesh *mesh, const rc_zone *zone, const polys *p, int64_t first_cell)
{
  const int64_t *sign = p->sign.item, *ref = p->ref.item;
  bool           ok = true;

  for (int64_t f = 0; f < p->faces.key.count && ok; f++) {
    const int64_t  n    = ints_of(&p->loop_at)[f + 1] - ints_of(&p->loop_at)[f];
    const int64_t *loop = ints_of(&p->loop) + ints_of(&p->loop_at)[f];
    const int64_t  a = ref[2 * f], b = ref[2 * f + 1];
    const int64_t  number = number_of(zone, ints_of(&p->faces.key)[f]);

    if (a < 0 || distinct(loop, n) < 3) continue;
    if (b >= 0 && sign[a] != sign[b]) {
      ok = rc_face_add(mesh, loop, n, sign[a] < 0, first_cell + cell_of(p, a), first_cell + cell_of(p, b), number);
      continue;
    }
    ok = rc_face_add(mesh, loop, n, sign[a] < 0, first_cell + cell_of(p, a), -1, number) && add_rim(mesh, zone, p, f);
    if (ok && b >= 0) ok = rc_face_add(mesh, loop, n, sign[b] < 0, first_cell + cell_of(p, b), -1, number);
  }
  return ok;
}

static rcgns_status build(rcgns_file *file, const rc_zone *zone, polys *p, int64_t first_cell, rcgns_message *message)
{
  bool         repaired = false;
  int64_t      any;
  rcgns_status status;

  RC_TRY(rc_agree(file->comm, number_faces(file, zone, p, message), message));
  RC_TRY(fetch_loops(file, zone, p, message));
  RC_TRY(locate(file, zone, p, message));
  status = repair_signs(file, p, &repaired, message);
  if (status == RCGNS_OK && !emit(&file->build, zone, p, first_cell)) status = rc_no_memory(message);
  RC_TRY(rc_agree(file->comm, status, message));
  any = repaired;
  MPI_Allreduce(MPI_IN_PLACE, &any, 1, MPI_INT64_T, MPI_MAX, file->comm);
  if (any)
    RC_TRY(rc_note(file, message, "signs of faces in NFACE_n that do not close their cell were replaced by ones that do"));
  return RCGNS_OK;
}

rcgns_status rc_poly_build(rcgns_file *file, const rc_zone *zone, const rc_section *section, int64_t lo, int64_t hi,
                           int64_t first_cell, rcgns_message *message)
{
  polys        p = {.num_cells = hi - lo, .number = lo};
  rcgns_status status;

  status = section ? read_nface(file, zone, section, lo, hi, &p, message) : read_by_parents(file, zone, lo, hi, &p, message);
  if (status == RCGNS_OK) status = build(file, zone, &p, first_cell, message);
  drop_polys(&p);
  return status;
}
