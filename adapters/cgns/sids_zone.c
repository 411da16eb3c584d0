/* sids_zone -- zones and element sections: what is a volume cell. Almost everything is known from the tree, alike on all ranks;
 * rows that have no index there are looked for (sids_rows.c). */
#include "cgns_private.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MIXED = 20, PYRA_13 = 21, NGON = 22, NFACE = 23, MAX_CODE = 56 };

/* ---- element types ------------------------------------------------------------------------------------------------ */

int rc_corners(rc_shape shape)
{
  static const int corners[] = {[RC_NONE] = 0, [RC_TETRA] = 4, [RC_PYRA] = 5, [RC_PENTA] = 6, [RC_HEXA] = 8};

  return corners[shape];
}

/* Today's code for a code in a file of that version: 3.00 to 3.09 put PYRA_13 at its place in the order. */
static int64_t modern_code(double version, int64_t code)
{
  if (version >= 2.995 && version < 3.095) return code == 13 ? PYRA_13 : code >= 14 && code <= 21 ? code - 1 : code;
  if (version > 0.0 && version < 2.995 && code == 21) return NGON; /* PYRA_13 was not yet there */
  return code;
}

int rc_element(double version, int64_t code, rc_shape *shape)
{
  static const int8_t nodes[MAX_CODE + 1] = {0,  0,  1,  2,  3,  3,  6,  4,  8,  9,  4,  10, 5,  14, 6,  15, 18, 8,  20,
                                             27, 0,  13, 0,  0,  4,  9,  10, 12, 16, 16, 20, 21, 29, 30, 24, 38, 40, 32,
                                             56, 64, 5,  12, 15, 16, 25, 22, 34, 35, 29, 50, 55, 33, 66, 75, 44, 98, 125};
  static const char   kind[MAX_CODE + 2]  = "..........TTPPEEEHHH.P.......TTPPPEEEHHH.....TTTPPPEEEHHH";
  const int64_t       c                   = modern_code(version, code);

  *shape = RC_NONE;
  if (c < 0 || c > MAX_CODE) return 0;
  switch (kind[c]) {
    case 'T': *shape = RC_TETRA; break;
    case 'P': *shape = RC_PYRA; break;
    case 'E': *shape = RC_PENTA; break;
    case 'H': *shape = RC_HEXA; break;
    default: break;
  }
  return nodes[c];
}

int rc_surface_corners(double version, int64_t code)
{
  static const char corners[MAX_CODE + 2] = "....."
                                            "33444"
                                            "....."
                                            "....."
                                            "....."
                                            "33444"
                                            "....."
                                            "....."
                                            "."
                                            "33444";
  rc_shape          shape;
  const int64_t     c = modern_code(version, code);

  (void)rc_element(version, code, &shape);
  return c < 0 || c > MAX_CODE || corners[c] == '.' ? 0 : corners[c] - '0';
}

/* ---- small readers ------------------------------------------------------------------------------------------------ */

static const int64_t *ints(const rc_tree *tree, int64_t node, int64_t count)
{
  return node >= 0 && rc_count(rc_node_at(tree, node)) >= count ? rc_small_ints(tree, rc_node_at(tree, node)) : NULL;
}

bool rc_rind(const rc_tree *tree, int64_t parent, int nd, int64_t *rind)
{
  const int64_t  at    = rc_tree_find(tree, parent, -1, "Rind_t", NULL);
  const int64_t *value = ints(tree, at, 2 * nd);

  memset(rind, 0, 2 * (size_t)nd * sizeof *rind);
  if (at < 0) return true;
  for (int d = 0; value && d < 2 * nd; d++) {
    if (value[d] < 0 || value[d] > RC_TOO_MANY) return false;
    rind[d] = value[d];
  }
  return value != NULL;
}

/* ---- sections ----------------------------------------------------------------------------------------------------- */

static rcgns_status broken(const rcgns_file *file, const rc_zone *zone, const char *section, const char *what,
                           rcgns_message *message)
{
  return rc_fail(message, RCGNS_IO, "%s: zone %s: section %s %s", file->path, zone->name, section, what);
}

/* What a section is: false, if it holds nothing for us. */
static rcgns_status read_section(const rcgns_file *file, const rc_zone *zone, int64_t node, rc_section *s, int64_t *code,
                                 bool *matters, rcgns_message *message)
{
  const rc_tree *tree  = &file->tree;
  const char    *name  = rc_node_at(tree, node)->name;
  const int64_t *type  = ints(tree, node, 1);
  const int64_t *range = ints(tree, rc_tree_find(tree, node, -1, NULL, "ElementRange"), 2);
  int64_t        rind[2];

  *matters = false;
  if (!type) return broken(file, zone, name, "has no element type", message);
  *code  = modern_code(file->version, type[0]);
  *s     = (rc_section){.layout = RC_FIXED};
  s->npe = rc_element(file->version, type[0], &s->shape);
  if (s->shape == RC_NONE && *code != MIXED && *code != NGON && *code != NFACE) {
    if (*code >= 0 && *code <= MAX_CODE) return RCGNS_OK;
    return broken(file, zone, name, "has an unknown element type", message);
  }
  if (!range || range[0] < 1 || range[1] < range[0] || range[1] > RC_TOO_MANY)
    return broken(file, zone, name, "has no valid ElementRange", message);
  if (!rc_rind(tree, node, 1, rind)) return broken(file, zone, name, "has a malformed Rind", message);
  s->first        = range[0];
  s->num_rows     = range[1] - range[0] + 1;
  s->row_lo       = rind[0];
  s->row_hi       = s->num_rows - rind[1];
  s->connectivity = rc_tree_find(tree, node, -1, NULL, "ElementConnectivity");
  s->offsets      = rc_tree_find(tree, node, -1, NULL, "ElementStartOffset");
  s->parents      = rc_tree_find(tree, node, -1, NULL, "ParentElements");
  if (s->parents < 0) s->parents = rc_tree_find(tree, node, -1, NULL, "ParentData");
  if (s->parents >= 0 && !rc_node_at(tree, s->parents)->kind) s->parents = -1;
  if (s->offsets >= 0 && !rc_node_at(tree, s->offsets)->kind) s->offsets = -1;
  if (s->connectivity >= 0) s->length = rc_count(rc_node_at(tree, s->connectivity));
  if (s->connectivity < 0 || rc_node_at(tree, s->connectivity)->kind != 'I' || s->length < 1)
    return broken(file, zone, name, "has no ElementConnectivity", message);
  if (s->row_lo >= s->row_hi) s->row_lo = s->row_hi = 0;
  s->is_poly = *code == NGON || *code == NFACE;
  s->layout  = *code == MIXED ? RC_MIXED : !s->is_poly ? RC_FIXED : s->offsets >= 0 ? RC_OFFSETS : RC_INLINE;
  if (s->offsets >= 0 && s->layout != RC_FIXED &&
      (rc_count(rc_node_at(tree, s->offsets)) != s->num_rows + 1 || rc_node_at(tree, s->offsets)->kind != 'I'))
    return broken(file, zone, name, "has an ElementStartOffset whose size does not match its ElementRange", message);
  if (s->layout == RC_FIXED ? s->length != s->num_rows * s->npe : s->length < s->num_rows * (s->layout == RC_OFFSETS ? 1 : 2))
    return broken(file, zone, name, "has an ElementConnectivity whose size does not match its ElementRange", message);
  s->num_cells = s->row_hi - s->row_lo;
  *matters     = true;
  return RCGNS_OK;
}

/* NGON_n whose rows are all edges: polygons in a plane. Rows of volumes are longer. */
static bool is_flat(const rc_section *s) { return s->length == s->num_rows * (s->layout == RC_OFFSETS ? 2 : 3); }

static int by_first(const void *a, const void *b)
{
  const int64_t x = ((const rc_section *)a)->first, y = ((const rc_section *)b)->first;

  return (x > y) - (x < y);
}

static rcgns_status check_order(const rcgns_file *file, const rc_zone *zone, const rc_section *s, int64_t num,
                                rcgns_message *message)
{
  for (int64_t i = 1; i < num; i++)
    if (s[i].first < s[i - 1].first + s[i - 1].num_rows)
      return rc_fail(message, RCGNS_IO, "%s: zone %s: two sections claim the element number %lld", file->path, zone->name,
                     (long long)s[i].first);
  return RCGNS_OK;
}

/* Sections of an unstructured zone. Not collective, alike on all ranks. */
static rcgns_status find_sections(const rcgns_file *file, rc_zone *zone, bool *curved, rcgns_message *message)
{
  int64_t num  = 0;
  bool    flat = false;

  for (int64_t at = -1; (at = rc_tree_find(&file->tree, zone->node, at, "Elements_t", NULL)) >= 0;) num++;
  zone->section = calloc((size_t)num + 1, sizeof *zone->section);
  zone->face    = calloc((size_t)num + 1, sizeof *zone->face);
  if (!zone->section || !zone->face) return rc_no_memory(message);
  for (int64_t at = -1; (at = rc_tree_find(&file->tree, zone->node, at, "Elements_t", NULL)) >= 0;) {
    rc_section s;
    int64_t    code;
    bool       matters;

    RC_TRY(read_section(file, zone, at, &s, &code, &matters, message));
    if (!matters) continue;
    if (code == NGON)
      zone->face[zone->num_face_sections++] = s;
    else
      zone->section[zone->num_sections++] = s;
    *curved |= s.layout == RC_FIXED && s.npe > rc_corners(s.shape);
  }
  qsort(zone->section, (size_t)zone->num_sections, sizeof *zone->section, by_first);
  qsort(zone->face, (size_t)zone->num_face_sections, sizeof *zone->face, by_first);
  RC_TRY(check_order(file, zone, zone->section, zone->num_sections, message));
  RC_TRY(check_order(file, zone, zone->face, zone->num_face_sections, message));
  for (int64_t i = 0; i < zone->num_face_sections; i++) {
    flat                     = flat || is_flat(zone->face + i);
    zone->face[i].first_cell = zone->num_faces; /* of NGON_n: the index of its first face */
    zone->num_faces += zone->face[i].num_rows;
  }
  num = 0;
  for (int64_t i = 0; i < zone->num_sections; i++)
    if (!zone->section[i].is_poly || !flat) zone->section[num++] = zone->section[i];
  zone->num_sections = num;
  zone->by_parents   = !num && zone->num_face_sections && !flat;
  for (int64_t i = 0; i < zone->num_face_sections; i++) zone->by_parents = zone->by_parents && zone->face[i].parents >= 0;
  for (int64_t i = 0; i < num; i++)
    if (zone->section[i].is_poly && !zone->num_face_sections)
      return broken(file, zone, "NFACE_n", "has no NGON_n section with its faces", message);
  return RCGNS_OK;
}

/* The cells of a zone that has NGON_n with ParentElements alone. Collective. */
static rcgns_status count_parents(rcgns_file *file, rc_zone *zone, rcgns_message *message)
{
  const rc_section *last     = zone->face + zone->num_face_sections - 1;
  int64_t           range[2] = {INT64_MIN, INT64_MIN}; /* -min, max */
  rcgns_status      status   = RCGNS_OK;

  for (int64_t i = 0; i < zone->num_face_sections; i++) {
    const rc_section *s   = zone->face + i;
    const rc_node    *n   = rc_node_at(&file->tree, s->parents);
    const rc_box      box = rc_whole(n);
    const int64_t     lo  = ra_share(2 * s->num_rows, file->rank, file->size),
                  hi      = ra_share(2 * s->num_rows, file->rank + 1, file->size);
    int64_t *parent       = ra_alloc(hi - lo, sizeof *parent);

    if (n->nd != 2 || n->dim[0] < 2 || n->dim[1] != s->num_rows)
      status = rc_fail(message, RCGNS_IO, "%s: zone %s: ParentElements does not match its section", file->path, zone->name);
    else if (!parent)
      status = rc_no_memory(message);
    status = rc_read(file, status, s->parents, &box, lo, hi, 'I', parent, message);
    for (int64_t k = 0; k < hi - lo && status == RCGNS_OK; k++) {
      if (!parent[k]) continue;
      if (parent[k] < 0 || parent[k] > RC_TOO_MANY) {
        status = rc_fail(message, RCGNS_GEOMETRY, "%s: zone %s: ParentElements names cell %lld", file->path, zone->name,
                         (long long)parent[k]);
        break;
      }
      if (-parent[k] > range[0]) range[0] = -parent[k];
      if (parent[k] > range[1]) range[1] = parent[k];
    }
    free(parent);
    RC_TRY(rc_agree(file->comm, status, message));
  }
  MPI_Allreduce(MPI_IN_PLACE, range, 2, MPI_INT64_T, MPI_MAX, file->comm);
  if (range[1] < 1) return RCGNS_OK;
  zone->parent_base = -range[0] >= last->first + last->num_rows ? last->first + last->num_rows : 1;
  zone->num_cells   = range[1] - zone->parent_base + 1;
  if (zone->num_cells > zone->num_faces / 2 + 1)
    return rc_fail(message, RCGNS_GEOMETRY,
                   "%s: zone %s: ParentElements names cell %lld, which is more cells than %lld faces can bound", file->path,
                   zone->name, (long long)range[1], (long long)zone->num_faces);
  return RCGNS_OK;
}

/* ---- zones -------------------------------------------------------------------------------------------------------- */

/* Sizes of a zone; num_nodes 0 if it holds no volume. */
static rcgns_status read_sizes(const rcgns_file *file, rc_zone *zone, rcgns_message *message)
{
  const rc_tree *tree  = &file->tree;
  const int64_t *size  = ints(tree, zone->node, 3);
  const int64_t  count = size ? rc_count(rc_node_at(tree, zone->node)) : 0;
  char           type[RC_NAME];
  int64_t        product = 1;

  rc_tree_string(tree, rc_tree_find(tree, zone->node, -1, "ZoneType_t", NULL), type, sizeof type);
  if (!size) return rc_fail(message, RCGNS_IO, "%s: zone %s: its sizes are missing", file->path, zone->name);
  zone->is_structured = strcmp(type, "Unstructured") != 0;
  if (!zone->is_structured) {
    if (size[0] < 0 || size[0] > RC_TOO_MANY)
      return rc_fail(message, RCGNS_IO, "%s: zone %s: its sizes are not valid", file->path, zone->name);
    zone->vertices[0] = zone->num_nodes = size[0];
    return RCGNS_OK;
  }
  if (count != 9) return RCGNS_OK;
  for (int d = 0; d < 3; d++) {
    if (size[d] < 1 || size[d + 3] != size[d] - 1 || __builtin_mul_overflow(product, size[d], &product) ||
        product > RC_TOO_MANY)
      return rc_fail(message, RCGNS_IO, "%s: zone %s: its sizes are not valid", file->path, zone->name);
    zone->vertices[d] = size[d];
    zone->cells[d]    = size[d + 3];
  }
  zone->num_cells = zone->cells[0] * zone->cells[1] * zone->cells[2];
  zone->num_nodes = zone->num_cells ? product : 0;
  return RCGNS_OK;
}

/* The three coordinate arrays and their rind; every size is checked here. */
static rcgns_status find_coordinates(const rcgns_file *file, rc_zone *zone, rcgns_message *message)
{
  static const char *const name[3] = {"CoordinateX", "CoordinateY", "CoordinateZ"};
  const rc_tree           *tree    = &file->tree;
  const int                nd      = zone->is_structured ? 3 : 1;
  const int64_t            grid    = rc_tree_find(tree, zone->node, -1, "GridCoordinates_t", "GridCoordinates");

  if (grid < 0) return rc_fail(message, RCGNS_IO, "%s: zone %s: it has no GridCoordinates", file->path, zone->name);
  if (!rc_rind(tree, grid, nd, zone->rind))
    return rc_fail(message, RCGNS_IO, "%s: zone %s: the Rind of its coordinates is malformed", file->path, zone->name);
  for (int c = 0; c < 3; c++) {
    const rc_node *n;
    bool           fits;

    zone->coordinate[c] = rc_tree_find(tree, grid, -1, NULL, name[c]);
    if (zone->coordinate[c] < 0 && rc_tree_find(tree, grid, -1, NULL, "CoordinateR") >= 0)
      return rc_fail(message, RCGNS_IO, "%s: zone %s: its coordinates are not Cartesian: convert them", file->path, zone->name);
    n = zone->coordinate[c] < 0 ? NULL : rc_node_at(tree, zone->coordinate[c]);
    if (!n || (n->kind != 'R' && n->kind != 'I'))
      return rc_fail(message, RCGNS_IO, "%s: zone %s: %s is missing or empty", file->path, zone->name, name[c]);
    fits = n->nd == nd;
    for (int d = 0; fits && d < nd; d++)
      fits = n->dim[nd - 1 - d] == zone->vertices[d] + zone->rind[2 * d] + zone->rind[2 * d + 1];
    if (!fits)
      return rc_fail(message, RCGNS_IO, "%s: zone %s: the size of %s does not match the zone", file->path, zone->name, name[c]);
  }
  return RCGNS_OK;
}

/* One zone; *keep: it holds volume cells. Collective. */
static rcgns_status read_zone(rcgns_file *file, rc_zone *zone, bool *keep, rcgns_message *message)
{
  bool         curved = false;
  rcgns_status status = read_sizes(file, zone, message);

  *keep = false;
  if (status == RCGNS_OK && !zone->is_structured && zone->num_nodes) status = find_sections(file, zone, &curved, message);
  RC_TRY(rc_agree(file->comm, status, message));
  if (!zone->num_nodes) return RCGNS_OK;
  for (int64_t i = 0; i < zone->num_sections; i++) {
    rc_section *s = zone->section + i;

    if (s->layout == RC_MIXED || s->layout == RC_INLINE) RC_TRY(rc_rows_scan(file, zone, s, &curved, message));
    s->first_cell = zone->num_cells;
    zone->num_cells += s->num_cells;
  }
  if (zone->by_parents) RC_TRY(count_parents(file, zone, message));
  *keep = zone->num_cells > 0;
  if (!*keep) return RCGNS_OK;
  for (int64_t i = 0; i < zone->num_face_sections; i++)
    if (zone->face[i].layout == RC_INLINE) RC_TRY(rc_rows_scan(file, zone, zone->face + i, &curved, message));
  if (curved && rc_is_dual(file))
    return rc_fail(message, RCGNS_IO,
                   "%s: zone %s: it has higher-order elements, whose middle nodes have no dual cells: make them linear",
                   file->path, zone->name);
  if (curved) RC_TRY(rc_note(file, message, "higher-order elements are taken by their corners"));
  return rc_agree(file->comm, find_coordinates(file, zone, message), message);
}

static void drop_zone(rc_zone *zone)
{
  for (int64_t i = 0; i < zone->num_sections; i++) ra_drop(&zone->section[i].cut);
  for (int64_t i = 0; i < zone->num_face_sections; i++) ra_drop(&zone->face[i].cut);
  free(zone->section);
  free(zone->face);
}

void rc_zones_drop(rcgns_file *file)
{
  for (int64_t z = 0; z < file->num_zones; z++) drop_zone(file->zone + z);
  free(file->zone);
}

/* Links among the children of a base that lead nowhere might have been zones: say so. */
static rcgns_status note_dead(rcgns_file *file, int64_t base, rcgns_message *message)
{
  char text[160];

  for (int64_t i = -1; (i = rc_tree_find(&file->tree, base, i, NULL, NULL)) >= 0;) {
    const rc_node *n = rc_node_at(&file->tree, i);

    if (!n->is_dead) continue;
    snprintf(text, sizeof text, "the link %s/%s leads nowhere and is left out", rc_node_at(&file->tree, base)->name, n->name);
    RC_TRY(rc_note(file, message, text));
  }
  return RCGNS_OK;
}

/* All zones of one base. Collective. */
static rcgns_status read_base(rcgns_file *file, int64_t base, ra_array *zones, rcgns_message *message)
{
  RC_TRY(rc_agree(file->comm, note_dead(file, base, message), message));
  for (int64_t at = -1; (at = rc_tree_find(&file->tree, base, at, "Zone_t", NULL)) >= 0;) {
    rc_zone      zone = {.node = at, .base = base, .coordinate = {-1, -1, -1}};
    bool         keep = false;
    rcgns_status status;

    zone.name = rc_keep(file, "%s/%s", rc_node_at(&file->tree, base)->name, rc_node_at(&file->tree, at)->name);
    status    = zone.name && ra_reserve(zones, 1, sizeof zone) ? RCGNS_OK : rc_no_memory(message);
    status    = rc_agree(file->comm, status, message);
    if (status == RCGNS_OK) status = read_zone(file, &zone, &keep, message);
    if (status != RCGNS_OK || !keep) {
      drop_zone(&zone);
      if (status != RCGNS_OK) return status;
      continue;
    }
    zone.first_cell = file->num_cells;
    if (zones->count) {
      const rc_zone *before = (const rc_zone *)zones->item + zones->count - 1;

      zone.first_node = before->first_node + before->num_nodes;
    }
    file->num_cells += zone.num_cells;
    ((rc_zone *)zones->item)[zones->count++] = zone;
  }
  return RCGNS_OK;
}

rcgns_status rc_zones_find(rcgns_file *file, const char *base, rcgns_message *message)
{
  ra_array     zones     = {.item = NULL};
  rcgns_status status    = RCGNS_OK;
  int64_t      bases     = 0;
  char         list[512] = "";

  for (int64_t at = -1; status == RCGNS_OK && (at = rc_tree_find(&file->tree, 0, at, "CGNSBase_t", NULL)) >= 0;) {
    const char  *name = rc_node_at(&file->tree, at)->name;
    const size_t used = strlen(list);

    snprintf(list + used, sizeof list - used, "%s%s", used ? ", " : "", name);
    if (base && strcmp(base, name)) continue;
    bases++;
    status = read_base(file, at, &zones, message);
  }
  file->zone      = zones.item;
  file->num_zones = zones.count;
  if (status == RCGNS_OK && !bases)
    return rc_fail(message, RCGNS_USAGE, "%s: it has no base %s: choose from %s", file->path, base, list);
  if (status == RCGNS_OK && !zones.count)
    return rc_fail(message, RCGNS_IO, "%s: %s%s holds no volume cells: give a three-dimensional mesh", file->path,
                   base ? "base " : "it", base ? base : "");
  return status;
}
