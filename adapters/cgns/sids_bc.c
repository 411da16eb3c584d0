/* sids_bc -- boundary conditions: which faces of this rank's mesh are on which BC_t.
 *
 * The mesh keeps for each face without neighbour what a file calls it (rc_rim). Conditions are ranges, known from the tree, or
 * lists of indices, element numbers or vertices, which all ranks read in the same pieces, and each looks up its own faces;
 * where faces are elements of their own (TRI_3 and so on) their sections are read first, to learn their numbers.
 * O(rim + boundary elements of the file) on every rank, with no list in memory. */
#include "cgns_private.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { BLOCK = 1 << 18 };

/* One zone while its conditions are read. */
typedef struct bc_zone {
  rcgns_file    *file;
  const rc_zone *zone;
  rc_rim        *rim; /* those of the zone */
  int64_t        num;
  ra_map         by_nodes;  /* standard elements: nodes of a rim -> its place in rim_of */
  ra_array       rim_of;    /* int64_t */
  ra_map         by_number; /* element number, of a block code_of -> place in rim_of_number */
  ra_array       rim_of_number;
  bool           has_nodes;
  ra_map         node;  /* nodes of rims; once a condition of vertices was met */
  uint8_t       *named; /* [nodes of rims] the condition's list has it */
} bc_zone;

static void drop_zone(bc_zone *z)
{
  ra_map_drop(&z->by_nodes);
  ra_map_drop(&z->by_number);
  ra_map_drop(&z->node);
  ra_drop(&z->rim_of);
  ra_drop(&z->rim_of_number);
  free(z->named);
}

/* The rim gets the boundary, unless it has one. */
static void give(const bc_zone *z, int64_t rim, int32_t boundary)
{
  int32_t *has = &z->file->face_boundary[z->rim[rim].face];

  if (*has < 0) *has = boundary;
}

/* Several rims may have one key: faces of flat cells. The map's index leads to the last, whose number is kept. */
static bool add_key(ra_map *map, ra_array *rim_of, const int64_t *key, int64_t rim)
{
  const int64_t at = ra_map_add(map, key);

  if (at < 0) return false;
  if (at == rim_of->count) return ra_push_int(rim_of, rim);
  ((int64_t *)rim_of->item)[at] = rim;
  return true;
}

/* ---- what faces are called ------------------------------------------------------------------------------------------ */

static bool is_poly(const rc_rim *rim) { return rim->key[1] < 0; }

/* Faces of a block across an axis, and its nodes (axis -1), are numbered from 1 by the indices i, j, k from 0 of the corner of
 * least ones. */
static int64_t code_of(const rc_zone *zone, int64_t axis, int64_t i, int64_t j, int64_t k)
{
  const int64_t *n = zone->vertices;

  return (((axis + 1) * n[2] + k) * n[1] + j) * n[0] + i + 1;
}

static bool index_rims(bc_zone *z)
{
  bool ok = true;

  z->by_nodes.width  = 4;
  z->by_number.width = z->node.width = 1;
  for (int64_t i = 0; i < z->num && ok; i++) {
    const int64_t *key = z->rim[i].key;

    if (z->zone->is_structured) {
      int64_t at[3] = {key[1], key[2], key[3]}, code;

      at[key[0] / 2] += key[0] % 2;
      code = code_of(z->zone, key[0] / 2, at[0], at[1], at[2]);
      ok   = add_key(&z->by_number, &z->rim_of_number, &code, i);
    } else {
      ok = is_poly(&z->rim[i]) ? add_key(&z->by_number, &z->rim_of_number, key, i) : add_key(&z->by_nodes, &z->rim_of, key, i);
    }
  }
  return ok;
}

/* The nodes of a rim, in the zone from 0; those of a block go to room. */
static int64_t nodes_of(const bc_zone *z, const rc_rim *rim, int64_t room[4], const int64_t **node)
{
  const int64_t axis = rim->key[0] / 2;
  int64_t       num  = 0;

  *node = z->zone->is_structured ? room : rim->key;
  if (z->zone->is_structured) {
    for (; num < 4; num++) {
      int64_t at[3] = {rim->key[1], rim->key[2], rim->key[3]};

      at[axis] += rim->key[0] % 2;
      at[(axis + 1) % 3] += num % 2;
      at[(axis + 2) % 3] += num / 2;
      room[num] = code_of(z->zone, -1, at[0], at[1], at[2]) - 1;
    }
    return num;
  }
  if (is_poly(rim)) {
    *node = (const int64_t *)z->file->build.rim_node.item + rim->key[2];
    return rim->key[3] - rim->key[2];
  }
  while (num < 4 && rim->key[num] >= 0) num++;
  return num;
}

/* Collect the nodes of rims, unless that is done. */
static bool index_nodes(bc_zone *z)
{
  const int64_t *node;
  int64_t        room[4];
  bool           ok = true;

  for (int64_t i = 0; i < z->num && ok && !z->has_nodes; i++) {
    const int64_t num = nodes_of(z, &z->rim[i], room, &node);

    for (int64_t k = 0; k < num && ok; k++) ok = ra_map_add(&z->node, &node[k]) >= 0;
  }
  if (!z->has_nodes) z->named = calloc((size_t)z->node.key.count + 1, 1);
  z->has_nodes = true;
  return ok && z->named;
}

/* A surface element of n corners: is it a face of ours? */
static bool number_face(bc_zone *z, const int64_t *corner, int n, int64_t number)
{
  int64_t key[4] = {-1, -1, -1, -1}, at;
  int     num    = 0;

  for (int i = 0; i < n; i++) {
    const int64_t node = corner[i] < 1 ? -1 : corner[i] - 1;
    int           k    = 0;

    if (node < 0) return true; /* of no node: no face of ours */

    while (k < num && key[k] != node) k++;
    if (k < num) continue;
    for (k = num++; k > 0 && key[k - 1] > node; k--) key[k] = key[k - 1];
    key[k] = node;
  }
  at = ra_map_find(&z->by_nodes, key);
  return at < 0 || add_key(&z->by_number, &z->rim_of_number, &number, ((const int64_t *)z->rim_of.item)[at]);
}

/* A section of surface elements of one type. Collective. */
static rcgns_status number_fixed(bc_zone *z, int64_t node, int npe, int corners, rcgns_message *message)
{
  const rc_tree *tree   = &z->file->tree;
  const int64_t  data   = rc_tree_find(tree, node, -1, NULL, "ElementConnectivity");
  const int64_t  ranges = rc_tree_find(tree, node, -1, NULL, "ElementRange");
  const int64_t *range  = ranges < 0 ? NULL : rc_small_ints(tree, rc_node_at(tree, ranges));
  const int64_t  num    = data < 0 ? 0 : rc_count(rc_node_at(tree, data)) / npe;
  int64_t       *block;
  rcgns_status   status;

  if (!range || range[0] < 1 || range[0] > INT64_MAX / 2 || num < 1 || rc_node_at(tree, data)->kind != 'I') return RCGNS_OK;
  block  = ra_alloc((int64_t)BLOCK * npe, sizeof *block);
  status = rc_agree(z->file->comm, block ? RCGNS_OK : rc_no_memory(message), message);
  for (int64_t lo = 0; lo < num && status == RCGNS_OK; lo += BLOCK) {
    const int64_t hi = lo + BLOCK < num ? lo + BLOCK : num;
    bool          ok = true;

    status = rc_read_1d(z->file, RCGNS_OK, data, lo * npe, hi * npe, 'I', block, message);
    for (int64_t i = lo; i < hi && status == RCGNS_OK && ok; i++)
      ok = number_face(z, block + (i - lo) * npe, corners, range[0] + i);
    if (status == RCGNS_OK) status = rc_agree(z->file->comm, ok ? RCGNS_OK : rc_no_memory(message), message);
  }
  free(block);
  return status;
}

/* Surface elements among the rows of a MIXED section. Collective. */
static rcgns_status number_mixed(bc_zone *z, const rc_section *s, rcgns_message *message)
{
  ra_array     offset = {.item = NULL}, data = {.item = NULL};
  rcgns_status status = RCGNS_OK;

  for (int64_t lo = 0; lo < s->num_rows && status == RCGNS_OK; lo += BLOCK) {
    const int64_t hi = lo + BLOCK < s->num_rows ? lo + BLOCK : s->num_rows;
    bool          ok = true;

    status = rc_rows_read(z->file, z->zone, s, lo, hi, &offset, &data, message);
    for (int64_t i = 0; i < hi - lo && status == RCGNS_OK && ok; i++) {
      const int64_t *row     = (const int64_t *)data.item + ((const int64_t *)offset.item)[i];
      const int      corners = rc_mixed_surface_corners(z->file->version, row[0]);

      if (corners) ok = number_face(z, row + 1, corners, s->first + lo + i);
    }
    if (status == RCGNS_OK) status = rc_agree(z->file->comm, ok ? RCGNS_OK : rc_no_memory(message), message);
  }
  ra_drop(&offset);
  ra_drop(&data);
  return status;
}

/* Element numbers of the faces of standard elements. Collective. */
static rcgns_status number_faces(bc_zone *z, rcgns_message *message)
{
  const rc_tree *tree = &z->file->tree;

  for (int64_t at = -1; (at = rc_tree_find(tree, z->zone->node, at, "Elements_t", NULL)) >= 0;) {
    const int64_t *type    = rc_small_ints(tree, rc_node_at(tree, at));
    const int      corners = type ? rc_surface_corners(z->file->version, type[0]) : 0;
    rc_shape       shape;

    if (corners) RC_TRY(number_fixed(z, at, rc_element(z->file->version, type[0], &shape), corners, message));
  }
  for (int64_t i = 0; i < z->zone->num_sections; i++)
    if (z->zone->section[i].layout == RC_MIXED) RC_TRY(number_mixed(z, &z->zone->section[i], message));
  return RCGNS_OK;
}

/* ---- conditions ------------------------------------------------------------------------------------------------------ */

/* Faces of a block in a range of indices {low i j k, high i j k} from 1, of vertices or of faces. */
static void give_range(const bc_zone *z, const int64_t *range, bool of_vertices, int32_t boundary)
{
  for (int64_t i = 0; i < z->num; i++) {
    const int64_t *key = z->rim[i].key, axis = key[0] / 2;
    bool           in = true;

    for (int d = 0; d < 3 && in; d++) {
      const int64_t lo   = range[d] < range[d + 3] ? range[d] : range[d + 3],
                    hi   = range[d] < range[d + 3] ? range[d + 3] : range[d];
      const int64_t cell = key[1 + d] + 1;

      in = d == axis ? lo == hi && lo == cell + key[0] % 2 : lo <= cell && cell + of_vertices <= hi;
    }
    if (in) give(z, i, boundary);
  }
}

/* What a list names: the faces with these element numbers, or nodes. */
static void give_numbers(bc_zone *z, const int64_t *number, int64_t n, bool of_vertices, int32_t boundary)
{
  for (int64_t i = 0; i < n; i++) {
    const int64_t key = number[i] < 1 ? -1 : number[i] - of_vertices;
    const int64_t at  = ra_map_find(of_vertices ? &z->node : &z->by_number, &key);

    if (at >= 0 && of_vertices) z->named[at] = 1;
    if (at >= 0 && !of_vertices) give(z, ((const int64_t *)z->rim_of_number.item)[at], boundary);
  }
}

/* The same of all numbers from lo to hi. */
static void give_span(bc_zone *z, int64_t lo, int64_t hi, bool of_vertices, int32_t boundary)
{
  const ra_array *keys = of_vertices ? &z->node.key : &z->by_number.key;

  for (int64_t i = 0; i < keys->count; i++) {
    const int64_t number = ((const int64_t *)keys->item)[i] + of_vertices;

    if (number >= lo && number <= hi) give_numbers(z, &number, 1, of_vertices, boundary);
  }
}

/* Faces all of whose nodes were named; the names end. */
static void give_named(bc_zone *z, int32_t boundary)
{
  const int64_t *node;
  int64_t        room[4];

  for (int64_t i = 0; i < z->num; i++) {
    const int64_t num = nodes_of(z, &z->rim[i], room, &node);
    bool          in  = true;

    for (int64_t k = 0; k < num && in; k++) in = z->named[ra_map_find(&z->node, &node[k])];
    if (in) give(z, i, boundary);
  }
  if (z->node.key.count) memset(z->named, 0, (size_t)z->node.key.count);
}

/* Where numbers of a condition belong to: elements, or faces of a block across an axis; vertices. */
typedef enum bc_where { OF_ELEMENTS = 0, OF_VERTICES = 1, OF_I_FACES, OF_J_FACES, OF_K_FACES, OF_FACES } bc_where;

/* Triples of indices from 1 in a block as numbers, 0 where there is nothing; how many. */
static int64_t number_points(const bc_zone *z, bc_where where, int64_t *number, int64_t n)
{
  const int64_t axis = (int64_t)where - OF_I_FACES; /* OF_VERTICES: -1 */

  for (int64_t p = 0; p < n / 3; p++) {
    const int64_t *at = number + 3 * p;
    bool           in = true;

    for (int d = 0; d < 3; d++) in = in && at[d] >= 1 && at[d] <= z->zone->vertices[d];
    number[p] = in ? code_of(z->zone, axis, at[0] - 1, at[1] - 1, at[2] - 1) : 0;
  }
  return n / 3;
}

/* Read a list in pieces, whole triples of indices in a block, for visit. Collective. */
static rcgns_status read_list(bc_zone *z, int64_t node, void (*visit)(bc_zone *z, int64_t *number, int64_t n, void *user),
                              void *user, rcgns_message *message)
{
  enum { PIECE = BLOCK / 3 * 3 };
  const rc_node *n      = rc_node_at(&z->file->tree, node);
  const rc_box   box    = rc_whole(n);
  int64_t       *block  = ra_alloc(PIECE, sizeof *block);
  rcgns_status   status = rc_agree(z->file->comm, block ? RCGNS_OK : rc_no_memory(message), message);

  for (int64_t lo = 0; lo < rc_count(n) && status == RCGNS_OK; lo += PIECE) {
    const int64_t hi = lo + PIECE < rc_count(n) ? lo + PIECE : rc_count(n);

    status = rc_read(z->file, RCGNS_OK, node, &box, lo, hi, 'I', block, message);
    if (status == RCGNS_OK) visit(z, block, hi - lo, user);
  }
  free(block);
  return status;
}

typedef struct giving {
  bc_where where;
  int32_t  boundary;
} giving;

static void give_piece(bc_zone *z, int64_t *number, int64_t n, void *user)
{
  const giving *g = user;

  give_numbers(z, number, z->zone->is_structured ? number_points(z, g->where, number, n) : n, g->where == OF_VERTICES,
               g->boundary);
}

/* A list of numbers. Collective. */
static rcgns_status give_list(bc_zone *z, int64_t node, bc_where where, int32_t boundary, rcgns_message *message)
{
  giving g = {where, boundary};

  return read_list(z, node, give_piece, &g, message);
}

/* A list, or numbers of an unstructured zone as a range. Collective. */
static rcgns_status give_place(bc_zone *z, int64_t node, bool is_range, bc_where where, int32_t boundary,
                               rcgns_message *message)
{
  const int64_t *range = is_range ? rc_small_ints(&z->file->tree, rc_node_at(&z->file->tree, node)) : NULL;

  if (where == OF_VERTICES) RC_TRY(rc_agree(z->file->comm, index_nodes(z) ? RCGNS_OK : rc_no_memory(message), message));
  if (range)
    give_span(z, range[0], range[1], where == OF_VERTICES, boundary);
  else
    RC_TRY(give_list(z, node, where, boundary, message));
  if (where == OF_VERTICES) give_named(z, boundary);
  return RCGNS_OK;
}

/* ---- names ----------------------------------------------------------------------------------------------------------- */

/* Is it a type that SIDS knows? */
static bool is_known(const char *type)
{
  static const char *const known[] = {"BCAxisymmetricWedge",
                                      "BCDegenerateLine",
                                      "BCDegeneratePoint",
                                      "BCDirichlet",
                                      "BCExtrapolate",
                                      "BCFarfield",
                                      "BCGeneral",
                                      "BCInflow",
                                      "BCInflowSubsonic",
                                      "BCInflowSupersonic",
                                      "BCNeumann",
                                      "BCOutflow",
                                      "BCOutflowSubsonic",
                                      "BCOutflowSupersonic",
                                      "BCSymmetryPlane",
                                      "BCSymmetryPolar",
                                      "BCTunnelInflow",
                                      "BCTunnelOutflow",
                                      "BCWall",
                                      "BCWallInviscid",
                                      "BCWallViscous",
                                      "BCWallViscousHeatFlux",
                                      "BCWallViscousIsothermal"};

  for (size_t i = 0; i < sizeof known / sizeof *known; i++)
    if (!strcmp(type, known[i])) return true;
  return false;
}

/* The type of a condition; that of its family where it leaves it to it; UserDefined where nobody knows it. */
static void type_of(const rc_tree *tree, const rc_zone *zone, int64_t bc, char out[RC_NAME])
{
  char    family[RC_NAME];
  int64_t at;

  rc_tree_string(tree, bc, out, RC_NAME);
  if (!strcmp(out, "FamilySpecified")) {
    rc_tree_string(tree, rc_tree_find(tree, bc, -1, "FamilyName_t", NULL), family, sizeof family);
    at = rc_tree_find(tree, zone->base, -1, "Family_t", family);
    at = at < 0 ? -1 : rc_tree_find(tree, at, -1, "FamilyBC_t", NULL);
    if (at >= 0) rc_tree_string(tree, at, out, RC_NAME);
  }
  if (!is_known(out)) strcpy(out, "UserDefined");
}

/* The number of a boundary of that name and type, -1: no memory. */
static int32_t boundary_of(rcgns_file *file, const char *name, const char *type)
{
  const char *const *names = file->boundary_name.item, *const *types = file->boundary_type.item;
  const char        *keep[2];
  int64_t            i = 0;

  while (i < file->boundary_name.count && (strcmp(names[i], name) || strcmp(types[i], type))) i++;
  if (i < file->boundary_name.count) return (int32_t)i;
  keep[0] = rc_keep(file, "%s", name);
  keep[1] = rc_keep(file, "%s", type);
  if (!keep[0] || !keep[1] || !ra_reserve(&file->boundary_name, 1, sizeof *keep) ||
      !ra_reserve(&file->boundary_type, 1, sizeof *keep))
    return -1;
  ((const char **)file->boundary_name.item)[file->boundary_name.count++] = keep[0];
  ((const char **)file->boundary_type.item)[file->boundary_type.count++] = keep[1];
  return (int32_t)i;
}

/* ---- faces between ranks --------------------------------------------------------------------------------------------- */

/* A face that was named, on its way to the rank that compares. */
typedef struct inner_claim {
  int64_t key[4], place; /* place: among those that came */
} inner_claim;

static int by_claim(const void *a, const void *b)
{
  const inner_claim *x = a, *y = b;

  for (int k = 0; k < 4; k++)
    if (x->key[k] != y->key[k]) return x->key[k] < y->key[k] ? -1 : 1;
  return (x->place > y->place) - (x->place < y->place);
}

/* Is this rim named, and may another rank have it too? Its claim. */
static bool is_claimed(const bc_zone *z, int64_t i, inner_claim *c)
{
  const rc_rim *rim = &z->rim[i];

  *c = (inner_claim){.key = {rim->key[0], rim->key[1], is_poly(rim) ? -1 : rim->key[2], is_poly(rim) ? -1 : rim->key[3]}};
  return z->file->face_boundary[rim->face] >= 0;
}

/* For each of n claims: did it come twice? */
static void find_twice(inner_claim *claim, int64_t n, uint8_t *twice)
{
  for (int64_t i = 0; i < n; i++) claim[i].place = i, twice[i] = 0;
  qsort(claim, (size_t)n, sizeof *claim, by_claim);
  for (int64_t i = 1; i < n; i++)
    if (!memcmp(claim[i].key, claim[i - 1].key, sizeof claim->key)) twice[claim[i].place] = twice[claim[i - 1].place] = 1;
}

/* Faces between cells of two ranks are inside of the zone: on one rank they would have no name. Collective. */
static rcgns_status unname_inner(bc_zone *z, rcgns_message *message)
{
  const int    size  = z->file->size;
  int64_t     *count = calloc(3 * (size_t)size + 1, sizeof *count), *recv = count ? count + 2 * size : NULL, num = 0, total = 0;
  inner_claim *send = NULL, one;
  uint8_t     *twice = NULL;
  void        *got = NULL, *back = NULL;
  rcgns_status status = count ? RCGNS_OK : rc_no_memory(message);

  for (int64_t i = 0; i < z->num && count; i++)
    if (is_claimed(z, i, &one)) count[one.key[0] % size]++, num++;
  for (int r = 1; r < size && count; r++) count[size + r] = count[size + r - 1] + count[r - 1];
  if (!(send = ra_alloc(num, sizeof *send))) status = rc_no_memory(message);
  for (int64_t i = 0; i < z->num && status == RCGNS_OK; i++)
    if (is_claimed(z, i, &one)) send[count[size + one.key[0] % size]++] = one;
  RC_GOTO(done, status = rc_exchange(z->file->comm, status, send, count, sizeof *send, &got, recv, message));
  for (int r = 0; r < size; r++) total += recv[r];
  if (!(twice = ra_alloc(total, sizeof *twice))) status = rc_no_memory(message);
  else find_twice(got, total, twice);
  RC_GOTO(done, status = rc_exchange(z->file->comm, status, twice, recv, sizeof *twice, &back, count, message));
  for (int64_t i = 0, r = 0; r < size; i += count[r++]) count[size + r] = i;
  for (int64_t i = 0; i < z->num; i++)
    if (is_claimed(z, i, &one) && ((const uint8_t *)back)[count[size + one.key[0] % size]++])
      z->file->face_boundary[z->rim[i].face] = -1;
done:
  free(count);
  free(send);
  free(twice);
  free(got);
  free(back);
  return status;
}

/* ---- the whole ------------------------------------------------------------------------------------------------------- */

/* The node that says where a condition is; *is_elements: its numbers are element numbers whatever the location. */
static int64_t place_of(const rc_tree *tree, int64_t bc, bool *is_range, bool *is_elements)
{
  static const char *const name[4] = {"PointRange", "PointList", "ElementRange", "ElementList"};

  for (int i = 0; i < 4; i++) {
    const int64_t at = rc_tree_find(tree, bc, -1, NULL, name[i]);

    if (at < 0 || rc_node_at(tree, at)->kind != 'I') continue;
    *is_range    = i % 2 == 0;
    *is_elements = i >= 2;
    if (!*is_range || (rc_small_ints(tree, rc_node_at(tree, at)) && rc_count(rc_node_at(tree, at)) >= 2)) return at;
  }
  return -1;
}

static bc_where where_of(const rc_tree *tree, int64_t bc, bool is_structured, bool is_elements)
{
  char location[RC_NAME];

  rc_tree_string(tree, rc_tree_find(tree, bc, -1, "GridLocation_t", NULL), location, sizeof location);
  if (is_elements) return OF_ELEMENTS;
  if (!*location || !strcmp(location, "Vertex")) return OF_VERTICES;
  if (!is_structured) return OF_ELEMENTS;
  return !strcmp(location, "IFaceCenter")   ? OF_I_FACES
         : !strcmp(location, "JFaceCenter") ? OF_J_FACES
         : !strcmp(location, "KFaceCenter") ? OF_K_FACES
                                            : OF_FACES;
}

/* ---- faces of a block whose axis is not told ------------------------------------------------------------------------- */

typedef struct extent {
  int64_t low[3], high[3]; /* of the triples of a list */
} extent;

static void widen(bc_zone *z, int64_t *number, int64_t n, void *user)
{
  extent *e = user;

  (void)z;
  for (int64_t i = 0; i < n; i++) {
    const int64_t d = i % 3;

    if (number[i] < e->low[d]) e->low[d] = number[i];
    if (number[i] > e->high[d]) e->high[d] = number[i];
  }
}

/* Do triples of that extent name faces of the block's side across an axis? */
static bool is_side(const rc_zone *zone, const extent *e, int axis)
{
  bool is = e->low[axis] == e->high[axis] && (e->low[axis] == 1 || e->low[axis] == zone->vertices[axis]);

  for (int d = 0; d < 3; d++) is = is && e->low[d] >= 1 && (d == axis || e->high[d] <= zone->cells[d]);
  return is;
}

/* The axis that a condition's normal tells, -1: none. */
static int axis_of_normal(const rc_tree *tree, int64_t bc)
{
  const int64_t  at     = rc_tree_find(tree, bc, -1, NULL, "InwardNormalIndex");
  const int64_t *normal = at < 0 || rc_count(rc_node_at(tree, at)) != 3 ? NULL : rc_small_ints(tree, rc_node_at(tree, at));

  for (int d = 0; normal && d < 3; d++)
    if (normal[d] && !normal[(d + 1) % 3] && !normal[(d + 2) % 3]) return d;
  return -1;
}

/* Across which axis the faces of a list at FaceCenter are: by the condition's normal, else where only one side of the block can
 * be meant; OF_FACES: it is not told. Collective. */
static rcgns_status find_axis(bc_zone *z, int64_t bc, int64_t place, bc_where *where, rcgns_message *message)
{
  const int normal = axis_of_normal(&z->file->tree, bc);
  extent    e      = {{INT64_MAX, INT64_MAX, INT64_MAX}, {INT64_MIN, INT64_MIN, INT64_MIN}};
  int       num    = 0;

  if (normal >= 0) *where = (bc_where)(OF_I_FACES + normal);
  if (normal >= 0) return RCGNS_OK;
  RC_TRY(read_list(z, place, widen, &e, message));
  for (int d = 0; d < 3; d++)
    if (is_side(z->zone, &e, d)) *where = num++ ? OF_FACES : (bc_where)(OF_I_FACES + d);
  return RCGNS_OK;
}

/* One condition of a zone. Collective. */
static rcgns_status read_bc(bc_zone *z, int64_t bc, rcgns_message *message)
{
  const rc_tree *tree     = &z->file->tree;
  bool           is_range = false, is_elements = false;
  const int64_t  place = place_of(tree, bc, &is_range, &is_elements);
  const bool     is_block = z->zone->is_structured;
  bc_where       where    = where_of(tree, bc, is_block, is_elements);
  char           type[RC_NAME], text[240];
  int32_t        boundary;

  type_of(tree, z->zone, bc, type);
  boundary = boundary_of(z->file, rc_node_at(tree, bc)->name, type);
  RC_TRY(rc_agree(z->file->comm, boundary < 0 ? rc_no_memory(message) : RCGNS_OK, message));
  if (place >= 0 && is_block && is_range && rc_count(rc_node_at(tree, place)) == 6) {
    give_range(z, rc_small_ints(tree, rc_node_at(tree, place)), where == OF_VERTICES, boundary);
    return RCGNS_OK;
  }
  if (place >= 0 && !is_range && where == OF_FACES && rc_count(rc_node_at(tree, place)) % 3 == 0)
    RC_TRY(find_axis(z, bc, place, &where, message));
  if (place >= 0 && (!is_block || (!is_range && where != OF_ELEMENTS && where != OF_FACES &&
                                   rc_count(rc_node_at(tree, place)) % 3 == 0)))
    return give_place(z, place, is_range, where, boundary, message);
  snprintf(text, sizeof text, "zone %.60s: boundary condition %s is left out: its place is given in a way that is not read",
           z->zone->name, rc_node_at(tree, bc)->name);
  return rc_note(z->file, message, text);
}

/* All conditions of a zone, whose rims are num at rim. Collective. */
static rcgns_status read_zone(rcgns_file *file, const rc_zone *zone, rc_rim *rim, int64_t num, rcgns_message *message)
{
  bc_zone      z      = {.file = file, .zone = zone, .rim = rim, .num = num};
  int64_t      list   = -1;
  rcgns_status status = rc_agree(file->comm, index_rims(&z) ? RCGNS_OK : rc_no_memory(message), message);

  if (rc_tree_find(&file->tree, zone->node, -1, "ZoneBC_t", NULL) >= 0 && status == RCGNS_OK && !zone->is_structured)
    status = number_faces(&z, message);
  while (status == RCGNS_OK && (list = rc_tree_find(&file->tree, zone->node, list, "ZoneBC_t", NULL)) >= 0)
    for (int64_t bc = -1; status == RCGNS_OK && (bc = rc_tree_find(&file->tree, list, bc, "BC_t", NULL)) >= 0;)
      status = read_bc(&z, bc, message);
  if (status == RCGNS_OK && !zone->is_structured && file->size > 1) status = unname_inner(&z, message);
  drop_zone(&z);
  return status;
}

rcgns_status rcgns_read_boundaries(rcgns_file *file, rcgns_boundaries *out, rcgns_message *message)
{
  rc_rim       *rim    = file->build.rim.item;
  const int64_t num    = file->build.rim.count;
  rcgns_status  status = RCGNS_OK;

  message->text[0] = 0;
  if (!file->face_boundary) {
    file->face_boundary = ra_alloc(file->mesh.num_faces, sizeof *file->face_boundary);
    status              = rc_agree(file->comm, file->face_boundary ? RCGNS_OK : rc_no_memory(message), message);
    for (int64_t f = 0; f < file->mesh.num_faces && status == RCGNS_OK; f++) file->face_boundary[f] = -1;
    for (int64_t z = 0, at = 0; z < file->num_zones && status == RCGNS_OK; z++) {
      const int64_t first = at;

      while (at < num && rim[at].zone == file->zone[z].node) at++;
      status = read_zone(file, &file->zone[z], rim + first, at - first, message);
    }
  }
  if (status != RCGNS_OK) {
    free(file->face_boundary);
    file->face_boundary = NULL;
    return rc_name_file(file->path, status, message);
  }
  *out = (rcgns_boundaries){.num  = (int)file->boundary_name.count,
                            .name = file->boundary_name.item,
                            .type = file->boundary_type.item,
                            .face = file->face_boundary};
  return RCGNS_OK;
}
