/* sids_create -- plans of files that are made from nothing, and small such files. */
#include "cgns_private.h"

#include <limits.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* ---- drafts ------------------------------------------------------------------------------------------------------- */

void *rc_draft_own(rc_draft *d, int64_t count, size_t size)
{
  void *item = ra_alloc(count, size);

  if (!item || !ra_reserve(&d->owned, 1, sizeof item)) {
    free(item);
    d->ok = false;
    return NULL;
  }
  ((void **)d->owned.item)[d->owned.count++] = item;
  return item;
}

int64_t rc_draft_put(rc_draft *d, int64_t parent, const char *name, const char *label, const char *type, int nd,
                     const int64_t *dim, char kind, const void *values)
{
  const int64_t at = d->ok ? rc_plan_add(&d->plan, parent, name, label, type, nd, dim, kind, values) : -1;

  d->ok = d->ok && at >= 0;
  return at;
}

int64_t rc_draft_ints(rc_draft *d, int64_t parent, const char *name, const char *label, int nd, const int64_t *dim,
                      const int64_t *values)
{
  int64_t count = 1;
  bool    small = true;

  for (int k = 0; k < nd; k++) count *= dim[k];
  for (int64_t i = 0; i < count; i++) small = small && values[i] >= INT32_MIN && values[i] <= INT32_MAX;
  return rc_draft_put(d, parent, name, label, small ? "I4" : "I8", nd, dim, 'I', values);
}

void rc_draft_text(rc_draft *d, int64_t parent, const char *name, const char *label, const char *text)
{
  const int64_t size = (int64_t)strlen(text);

  rc_draft_put(d, parent, name, label, "C1", 1, &size, 'C', text);
}

void rc_draft_drop(rc_draft *d)
{
  rc_plan_drop(&d->plan);
  for (int64_t i = 0; i < d->owned.count; i++) free(((void **)d->owned.item)[i]);
  ra_drop(&d->owned);
}

/* ---- small files -------------------------------------------------------------------------------------------------- */

static void put_coordinates(rc_draft *d, int64_t zone, const double *xyz, int64_t n, int nd, const int64_t *dim)
{
  static const char *const name[3] = {"CoordinateX", "CoordinateY", "CoordinateZ"};
  const int64_t            grid    = rc_draft_put(d, zone, "GridCoordinates", "GridCoordinates_t", NULL, 0, NULL, 0, NULL);

  for (int k = 0; k < 3; k++) {
    double *x = rc_draft_own(d, n, sizeof *x);

    for (int64_t i = 0; x && i < n; i++) x[i] = xyz[3 * i + k];
    rc_draft_put(d, grid, name[k], "DataArray_t", "R8", nd, dim, 'R', x);
  }
}

static void put_elements(rc_draft *d, int64_t zone, const char *name, int64_t code, int64_t first, int64_t n,
                         const int64_t *connectivity, const int64_t *offset)
{
  const int64_t two = 2, rows = n + 1, length = offset[n];
  int64_t      *head = rc_draft_own(d, 4, sizeof *head);
  int64_t       at;

  if (!head) return;
  memcpy(head, (int64_t[4]){code, 0, first, first + n - 1}, 4 * sizeof *head);
  at = rc_draft_ints(d, zone, name, "Elements_t", 1, &two, head);
  rc_draft_ints(d, at, "ElementRange", "IndexRange_t", 1, &two, head + 2);
  rc_draft_ints(d, at, "ElementConnectivity", "DataArray_t", 1, &length, connectivity);
  rc_draft_ints(d, at, "ElementStartOffset", "DataArray_t", 1, &rows, offset);
}

/* NGON_n as the mesh has its faces, NFACE_n from their owners and neighbours. */
static void put_polyhedra(rc_draft *d, int64_t zone, const remap_mesh *mesh)
{
  const int64_t n = mesh->num_faces, cells = mesh->num_cells, length = mesh->face_offset[n];
  int64_t      *node = rc_draft_own(d, length, sizeof *node), *offset = rc_draft_own(d, cells + 1, sizeof *offset),
          *face = rc_draft_own(d, 2 * n, sizeof *face);

  if (!node || !offset || !face) return;
  for (int64_t i = 0; i < length; i++) node[i] = mesh->face_node[i] + 1;
  memset(offset, 0, ((size_t)cells + 1) * sizeof *offset);
  for (int64_t f = 0; f < n; f++) {
    offset[mesh->face_owner[f] + 1]++;
    if (mesh->face_neighbour[f] >= 0) offset[mesh->face_neighbour[f] + 1]++;
  }
  for (int64_t c = 0; c < cells; c++) offset[c + 1] += offset[c];
  for (int64_t f = 0; f < n; f++) { /* offset[c] runs ahead to where the next face of c goes */
    face[offset[mesh->face_owner[f]]++] = f + 1;
    if (mesh->face_neighbour[f] >= 0) face[offset[mesh->face_neighbour[f]]++] = -(f + 1);
  }
  for (int64_t c = cells; c > 0; c--) offset[c] = offset[c - 1];
  offset[0] = 0;
  put_elements(d, zone, "NGonElements", 22, 1, n, node, mesh->face_offset);
  put_elements(d, zone, "NFaceElements", 23, n + 1, cells, face, offset);
}

static void put_zone(rc_draft *d, int64_t base, const rcgns_new_zone *z, const char *solution)
{
  const bool    block    = z->mesh == NULL;
  const int     nd       = block ? 3 : 1;
  const int64_t shape[2] = {3, nd};
  int64_t      *size = rc_draft_own(d, 9, sizeof *size), dim[3], cell[3], nodes = 1, zone, at;

  if (!size) return;
  memset(size, 0, 9 * sizeof *size);
  for (int k = 0; k < nd; k++) {
    size[k]          = block ? z->num_vertices[k] : z->mesh->num_nodes;
    size[nd + k]     = block ? z->num_vertices[k] - 1 : z->mesh->num_cells;
    dim[nd - 1 - k]  = size[k];
    cell[nd - 1 - k] = size[nd + k];
    nodes *= size[k];
  }
  zone = rc_draft_ints(d, base, z->name, "Zone_t", 2, shape, size);
  rc_draft_text(d, zone, "ZoneType", "ZoneType_t", block ? "Structured" : "Unstructured");
  put_coordinates(d, zone, block ? z->node_xyz : z->mesh->node_xyz, nodes, nd, dim);
  if (!block) put_polyhedra(d, zone, z->mesh);
  if (!z->num_fields) return;
  at = rc_draft_put(d, zone, solution, "FlowSolution_t", NULL, 0, NULL, 0, NULL);
  rc_draft_text(d, at, "GridLocation", "GridLocation_t", "CellCenter");
  for (int64_t f = 0; f < z->num_fields; f++)
    rc_draft_put(d, at, z->field[f].name, "DataArray_t", "R8", nd, cell, 'R', z->field[f].values);
}

static rcgns_status check_zones(const char *path, const char *solution, int64_t num_zones, const rcgns_new_zone *zones,
                                rcgns_message *message)
{
  bool ok = num_zones > 0;

  for (int64_t i = 0; i < num_zones; i++) {
    const rcgns_new_zone *z = zones + i;

    ok = ok && rc_is_name(z->name) &&
         (z->mesh ? z->mesh->num_cells > 0 : z->num_vertices[0] > 1 && z->num_vertices[1] > 1 && z->num_vertices[2] > 1);
    ok = ok && (!z->num_fields || rc_is_name(solution));
    for (int64_t f = 0; f < z->num_fields; f++) ok = ok && rc_is_name(z->field[f].name);
  }
  return ok ? RCGNS_OK
            : rc_fail(message, RCGNS_USAGE, "%s: zones need names of 1 to 32 characters and cells, fields a solution", path);
}

rcgns_status rcgns_create(const char *path, double version, const char *solution, int64_t num_zones,
                          const rcgns_new_zone *zones, rcgns_message *message)
{
  static const int64_t one = 1, two = 2, dimensions[2] = {3, 3};
  rc_draft             d              = {.ok = true};
  char                 part[PATH_MAX] = "";
  int64_t              base;
  rcgns_status         status = check_zones(path, solution, num_zones, zones, message);

  if (status != RCGNS_OK) return status;
  rc_draft_put(&d, -1, "CGNSLibraryVersion", "CGNSLibraryVersion_t", "R4", 1, &one, 'R', &version);
  base = rc_draft_ints(&d, -1, "Base", "CGNSBase_t", 1, &two, dimensions);
  for (int64_t i = 0; i < num_zones; i++) put_zone(&d, base, zones + i, solution);
  status = d.ok ? rc_begin(&d.plan, path, part, sizeof part, message) : rc_no_memory(message);
  if (status == RCGNS_OK) status = rc_finish(part, path, message);
  if (status != RCGNS_OK && *part) unlink(part);
  if (status == RCGNS_OK) message->text[0] = 0;
  rc_draft_drop(&d);
  return status;
}
