/* file -- open and close a CGNS file, and read slabs of either kind of file.
 *
 * Rank 0 reads the tree, all ranks get it; then all open the file (HDF5 together through MPI-IO, ADF each for itself) and
 * keep it open until rcgns_close, since fields are read on demand. */
#include "cgns_private.h"

#include <errno.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

const char *rc_keep(rcgns_file *file, const char *format, ...)
{
  va_list args;
  int     length;
  char   *text;

  va_start(args, format);
  length = vsnprintf(NULL, 0, format, args);
  va_end(args);
  text = length < 0 ? NULL : malloc((size_t)length + 1);
  if (!text || !ra_reserve(&file->names, 1, sizeof text)) {
    free(text);
    return NULL;
  }
  va_start(args, format);
  vsnprintf(text, (size_t)length + 1, format, args);
  va_end(args);
  ((char **)file->names.item)[file->names.count++] = text;
  return text;
}

static bool keep_in(rcgns_file *file, ra_array *list, const char *text)
{
  const char *mine;

  for (int64_t i = 0; i < list->count; i++)
    if (!strcmp(((const char **)list->item)[i], text)) return true;
  if (!(mine = rc_keep(file, "%s", text)) || !ra_reserve(list, 1, sizeof mine)) return false;
  ((const char **)list->item)[list->count++] = mine;
  return true;
}

rcgns_status rc_note(rcgns_file *file, rcgns_message *message, const char *text)
{
  const bool ok = keep_in(file, &file->notes, text);

  file->info.note      = file->notes.item;
  file->info.num_notes = file->notes.count;
  return ok ? RCGNS_OK : rc_no_memory(message);
}

/* ---- slabs -------------------------------------------------------------------------------------------------------- */

/* One transfer moves at most this many values: well below the 2 GiB that MPI-IO can take at once. */
enum { ROUND = 1 << 26 };

/* Does the box lie in the node's array? */
static rcgns_status check_box(const rcgns_file *file, int64_t node, const rc_box *box, rcgns_message *message)
{
  const rc_node *n  = node < 0 ? NULL : rc_node_at(&file->tree, node);
  bool           ok = n && n->kind && n->nd == box->nd;

  for (int d = 0; ok && d < box->nd; d++)
    ok = box->origin[d] >= 0 && box->shape[d] >= 0 && box->origin[d] <= n->dim[d] - box->shape[d];
  return ok ? RCGNS_OK
            : rc_fail(message, RCGNS_IO, "%s: array %s is smaller than its zone needs", file->path, n ? n->name : "(none)");
}

/* This rank's part of a read. */
static rcgns_status read_mine(const rcgns_file *file, int64_t node, const rc_box *box, int64_t lo, int64_t hi, char as,
                              void *out, rcgns_message *message)
{
  const rc_node *n      = rc_node_at(&file->tree, node);
  const size_t   width  = as == 'N' ? (size_t)rc_width(n->type) : sizeof(int64_t);
  const int64_t  handle = file->handle[n->file];
  const bool     is_adf = rc_source_at(&file->tree, n->file)->is_adf;
  char          *path;
  rcgns_status   status = RCGNS_OK;
  rcgns_message  why;

  if (lo >= hi) return RCGNS_OK;
  if (lo < 0 || hi > rc_box_count(box))
    return rc_fail(message, RCGNS_IO, "%s: array %s is smaller than its zone needs", file->path, n->name);
  path = rc_tree_path(&file->tree, node);
  if (!path) return rc_no_memory(message);
  for (int64_t from = lo; from < hi && status == RCGNS_OK; from += ROUND) {
    const int64_t to = hi - from < ROUND ? hi : from + ROUND;
    char         *at = (char *)out + (size_t)(from - lo) * width;

    status = is_adf ? rc_adf_read(handle, path, n->type, box, from, to, as, at, &why)
                    : rc_h5_read(handle, path, n->type, box, from, to, as, at, &why);
    if (status != RCGNS_OK) rc_fail(message, status, "%s: %.900s", file->path, why.text);
  }
  free(path);
  return status;
}

rcgns_status rc_read(rcgns_file *file, rcgns_status mine, int64_t node, const rc_box *box, int64_t lo, int64_t hi, char as,
                     void *out, rcgns_message *message)
{
  rcgns_status status = mine;

  if (status == RCGNS_OK) status = check_box(file, node, box, message);
  if (status == RCGNS_OK) status = read_mine(file, node, box, lo, hi, as, out, message);
  return rc_agree(file->comm, status, message);
}

rcgns_status rc_read_1d(rcgns_file *file, rcgns_status mine, int64_t node, int64_t lo, int64_t hi, char as, void *out,
                        rcgns_message *message)
{
  rc_box box = {.nd = 1};

  if (node >= 0) box = rc_whole(rc_node_at(&file->tree, node));
  return rc_read(file, mine, node, &box, lo, hi, as, out, message);
}

/* ---- open --------------------------------------------------------------------------------------------------------- */

/* Rank 0 alone: what kind of file it is, and its tree. */
static rcgns_status read_tree(rcgns_file *file, rcgns_message *message)
{
  const char *path = file->path;
  FILE       *try  = fopen(path, "rb");
  bool        is_h5, has_byte;
  int         source;

  if (!try) return rc_fail(message, RCGNS_IO, "%s: %s: check the path", path, strerror(errno));
  has_byte = fgetc(try) != EOF;
  fclose(try);
  if (!has_byte) return rc_fail(message, RCGNS_IO, "%s: it is empty or not a file: give a CGNS file", path);
  is_h5 = rc_h5_is_file(path);
  if (!is_h5 && !rc_adf_is_file(path))
    return rc_fail(message, RCGNS_IO, "%s: it is neither an HDF5 nor an ADF file: give a CGNS file", path);
  source = rc_tree_source(&file->tree, path, !is_h5);
  if (source == -1) return rc_no_memory(message);
  if (source < 0) return rc_fail(message, RCGNS_IO, "%s: %s", path, strerror(errno));
  RC_TRY(is_h5 ? rc_h5_walk(&file->tree, message) : rc_adf_walk(&file->tree, message));
  if (rc_tree_find(&file->tree, 0, -1, "CGNSBase_t", NULL) < 0)
    return rc_fail(message, RCGNS_IO, "%s: it holds no CGNSBase_t: it is no CGNS file", path);
  return RCGNS_OK;
}

/* All files that the tree comes from. Collective. */
static rcgns_status open_all(rcgns_file *file, rcgns_message *message)
{
  const int64_t num    = file->tree.source.count;
  rcgns_status  status = RCGNS_OK;

  if (!(file->handle = ra_alloc(num, sizeof *file->handle))) status = rc_no_memory(message);
  RC_TRY(rc_agree(file->comm, status, message));
  for (int64_t i = 0; i < num; i++) file->handle[i] = -1;
  for (int64_t i = 0; i < num && status == RCGNS_OK; i++) {
    const rc_source *source = rc_source_at(&file->tree, i);
    const char      *path   = rc_text(&file->tree, source->path);

    status =
        source->is_adf ? rc_adf_open(path, &file->handle[i], message) : rc_h5_open(file->comm, path, &file->handle[i], message);
    status = rc_agree(file->comm, status, message);
  }
  return status;
}

/* x' = A (scale x) + b */
static rcgns_status set_map(rcgns_file *file, const rcgns_options *options, rcgns_message *message)
{
  const double(*t)[4] = options->transform;
  const double det    = t[0][0] * (t[1][1] * t[2][2] - t[1][2] * t[2][1]) - t[0][1] * (t[1][0] * t[2][2] - t[1][2] * t[2][0]) +
                     t[0][2] * (t[1][0] * t[2][1] - t[1][1] * t[2][0]);
  bool finite = isfinite(options->scale) && isfinite(det);

  for (int r = 0; r < 3; r++)
    for (int c = 0; c < 4; c++) {
      file->map[r][c] = c < 3 ? t[r][c] * options->scale : t[r][c];
      finite          = finite && isfinite(file->map[r][c]);
    }
  if (!finite || options->scale == 0.0 || det == 0.0)
    return rc_fail(message, RCGNS_USAGE, "%s: scale and transform must be finite and not singular", file->path);
  return RCGNS_OK;
}

/* The version stamp, and that the tree may be read at all. */
static void read_version(rcgns_file *file)
{
  const int64_t  at = rc_tree_find(&file->tree, 0, -1, "CGNSLibraryVersion_t", NULL);
  const rc_node *n  = at < 0 ? NULL : rc_node_at(&file->tree, at);

  if (n && n->kind == 'R' && n->small >= 0) file->version = *(const double *)(const void *)rc_text(&file->tree, n->small);
  if (!isfinite(file->version)) file->version = 0.0;
}

/* What the caller sees, from what was found. */
static rcgns_status fill_info(rcgns_file *file, rcgns_message *message)
{
  rcgns_info *info = &file->info;

  file->zone_info        = ra_alloc(file->num_zones, sizeof *file->zone_info);
  file->zone_name        = ra_alloc(file->num_zones, sizeof *file->zone_name);
  file->zone_cell_offset = ra_alloc(file->num_zones + 1, sizeof *file->zone_cell_offset);
  file->solution         = ra_alloc(file->num_zones, sizeof *file->solution);
  if (!file->zone_info || !file->zone_name || !file->zone_cell_offset || !file->solution) return rc_no_memory(message);
  for (int64_t z = 0; z < file->num_zones; z++) {
    const rc_zone *zone = file->zone + z;

    file->zone_info[z]        = (rcgns_zone_info){.name          = zone->name,
                                                  .is_structured = zone->is_structured,
                                                  .num_nodes     = zone->num_nodes,
                                                  .num_cells     = zone->num_cells,
                                                  .first_cell    = zone->first_cell};
    file->zone_name[z]        = zone->name;
    file->zone_cell_offset[z] = zone->first_cell;
    file->solution[z]         = -1;
    if (!keep_in(file, &file->bases, rc_node_at(&file->tree, zone->base)->name)) return rc_no_memory(message);
  }
  file->zone_cell_offset[file->num_zones] = file->num_cells;
  info->path                              = file->path;
  info->format                            = rc_source_at(&file->tree, 0)->is_adf ? "ADF" : "HDF5";
  info->version                           = file->version;
  info->num_cells                         = file->num_cells;
  info->num_bases                         = file->bases.count;
  info->base                              = file->bases.item;
  info->num_zones                         = file->num_zones;
  info->zone                              = file->zone_info;
  return RCGNS_OK;
}

static rcgns_status open_file(rcgns_file *file, const rcgns_options *options, rcgns_message *message)
{
  file->location                 = options->location == RCGNS_VERTICES ? "Vertex" : "CellCenter";
  file->build.wants_face_numbers = options->face_numbers && options->location == RCGNS_CELLS;
  RC_TRY(rc_agree(file->comm, set_map(file, options, message), message));
  RC_TRY(rc_agree(file->comm, file->rank == 0 ? read_tree(file, message) : RCGNS_OK, message));
  RC_TRY(rc_tree_bcast(file->comm, &file->tree, message));
  read_version(file);
  RC_TRY(open_all(file, message));
  RC_TRY(rc_zones_find(file, options->base, message));
  file->cell_lo = ra_share(file->num_cells, file->rank, file->size);
  file->cell_hi = ra_share(file->num_cells, file->rank + 1, file->size);
  RC_TRY(rc_agree(file->comm, fill_info(file, message), message));
  file->info.location = options->location;
  RC_TRY(rc_mesh_build(file, message));
  if (rc_is_dual(file)) RC_TRY(rc_dual_build(file, message));
  rc_mesh_view(file);
  return RCGNS_OK;
}

rcgns_status rcgns_open(MPI_Comm comm, const char *path, const rcgns_options *options, rcgns_file **out, rcgns_message *message)
{
  rcgns_file   *file = calloc(1, sizeof *file);
  rcgns_options plain;
  rcgns_status  status = RCGNS_OK;

  *out             = NULL;
  message->text[0] = 0;
  if (!file || !(file->path = strdup(path))) status = rc_no_memory(message);
  if (file) file->comm = MPI_COMM_NULL;
  status = rc_agree(comm, status, message);
  if (status == RCGNS_OK) {
    rcgns_options_default(&plain);
    MPI_Comm_dup(comm, &file->comm);
    MPI_Comm_rank(file->comm, &file->rank);
    MPI_Comm_size(file->comm, &file->size);
    status = open_file(file, options ? options : &plain, message);
  }
  if (status == RCGNS_OK)
    *out = file;
  else
    rcgns_close(&file);
  return rc_name_file(path, status, message);
}

const rcgns_info *rcgns_get_info(const rcgns_file *file) { return &file->info; }

const remap_mesh *rcgns_mesh(const rcgns_file *file) { return &file->mesh; }

const int64_t *rcgns_face_numbers(const rcgns_file *file)
{
  return file->build.wants_face_numbers ? file->build.face_number.item : NULL;
}

void rcgns_close(rcgns_file **address)
{
  rcgns_file *file = *address;

  *address = NULL;
  if (!file) return;
  for (int64_t i = 0; file->handle && i < file->tree.source.count; i++)
    if (file->handle[i] >= 0) {
      if (rc_source_at(&file->tree, i)->is_adf)
        rc_adf_close(file->handle[i]);
      else
        rc_h5_close(file->handle[i]);
    }
  free(file->handle);
  rc_zones_drop(file);
  rc_tree_drop(&file->tree);
  rc_mesh_drop(&file->build);
  for (int64_t i = 0; i < file->names.count; i++) free(((char **)file->names.item)[i]);
  ra_drop(&file->names);
  ra_drop(&file->bases);
  ra_drop(&file->notes);
  ra_drop(&file->boundary_name);
  ra_drop(&file->boundary_type);
  free(file->face_boundary);
  free(file->zone_info);
  free(file->zone_name);
  free(file->zone_cell_offset);
  free(file->solution);
  free(file->field);
  if (file->comm != MPI_COMM_NULL) MPI_Comm_free(&file->comm);
  free(file->path);
  free(file);
}
