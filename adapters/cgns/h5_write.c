/* h5_write -- HDF5 output from a plan, in two steps.
 *
 * One rank makes the skeleton: all groups, attributes and small arrays, and every large array with its place in the file but
 * without values. Then all ranks open it through MPI-IO and fill those arrays by collective writes of their own slabs. What
 * lies where was settled by one rank and no time is stamped anywhere, so the bytes do not depend on the number of ranks. The
 * format is kept to that of HDF5 1.8, which every CGNS library opens. */
#include "h5.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/statvfs.h>
#include <unistd.h>

enum { COPY_ROUND = 1 << 22, WRITE_ROUND = 1 << 26 }; /* values of one rank in one transfer */

/* "/A/B" of an entry; the caller frees. */
static char *path_of(const rc_plan *plan, int64_t i)
{
  size_t length = 0;
  char  *path;

  for (int64_t k = i; k >= 0; k = rc_entry_at(plan, k)->parent) length += strlen(rc_entry_at(plan, k)->name) + 1;
  path = malloc(length + 1);
  if (!path) return NULL;
  path[length] = 0;
  for (; i >= 0; i = rc_entry_at(plan, i)->parent) {
    const size_t n = strlen(rc_entry_at(plan, i)->name);

    length -= n;
    memcpy(path + length, rc_entry_at(plan, i)->name, n);
    path[--length] = '/';
  }
  return path;
}

/* ---- skeleton ----------------------------------------------------------------------------------------------------- */

/* Property lists and an error flag for the making of one file. */
typedef struct maker {
  hid_t file, group, small, large; /* lists: groups, arrays written at once, arrays filled later */
  bool  ok, no_memory;
} maker;

static void text_attribute(maker *m, hid_t group, const char *name, const char *value, size_t size)
{
  const hid_t type            = H5Tcopy(H5T_C_S1);
  const hid_t space           = H5Screate(H5S_SCALAR);
  char        padded[RC_NAME] = "";
  hid_t       attribute;

  memcpy(padded, value, strnlen(value, size - 1));
  H5Tset_size(type, size);
  attribute = H5Acreate2(group, name, type, space, H5P_DEFAULT, H5P_DEFAULT);
  m->ok     = m->ok && attribute >= 0 && H5Awrite(attribute, type, padded) >= 0;
  if (attribute >= 0) H5Aclose(attribute);
  H5Sclose(space);
  H5Tclose(type);
}

static void node_attributes(maker *m, hid_t group, const char *name, const char *label, const char *type)
{
  text_attribute(m, group, "name", name, RC_NAME);
  text_attribute(m, group, "label", label, RC_NAME);
  text_attribute(m, group, "type", type, 3);
}

static void flags_attribute(maker *m, hid_t group)
{
  const hsize_t one       = 1;
  const int     flags     = 1;
  const hid_t   space     = H5Screate_simple(1, &one, NULL);
  const hid_t   attribute = H5Acreate2(group, "flags", H5T_NATIVE_INT, space, H5P_DEFAULT, H5P_DEFAULT);

  m->ok = m->ok && attribute >= 0 && H5Awrite(attribute, H5T_NATIVE_INT, &flags) >= 0;
  if (attribute >= 0) H5Aclose(attribute);
  H5Sclose(space);
}

static void dataset(maker *m, hid_t group, const char *name, hid_t type, int nd, const int64_t *dim, hid_t memory,
                    const void *values)
{
  hsize_t dims[RC_MAX_DIMS];
  hid_t   space, data;

  for (int d = 0; d < nd; d++) dims[d] = (hsize_t)dim[d];
  space = H5Screate_simple(nd, dims, NULL);
  data  = H5Dcreate2(group, name, type, space, H5P_DEFAULT, values ? m->small : m->large, H5P_DEFAULT);
  m->ok = m->ok && data >= 0 && (!values || H5Dwrite(data, memory, H5S_ALL, H5S_ALL, H5P_DEFAULT, values) >= 0);
  if (data >= 0) H5Dclose(data);
  H5Sclose(space);
}

static void text_dataset(maker *m, hid_t group, const char *name, const char *text, int64_t size)
{
  char padded[RC_NAME] = "";

  if (size == (int64_t)sizeof padded) text = memcpy(padded, text, strnlen(text, sizeof padded - 1));
  dataset(m, group, name, H5T_NATIVE_SCHAR, 1, &size, H5T_NATIVE_SCHAR, text);
}

static void link_datasets(maker *m, hid_t group, const rc_entry *e)
{
  const int64_t path = (int64_t)strlen(e->link_path) + 1, file = (int64_t)strlen(e->link_file) + 1;

  dataset(m, group, " path", H5T_NATIVE_SCHAR, 1, &path, H5T_NATIVE_SCHAR, e->link_path);
  if (file > 1) {
    dataset(m, group, " file", H5T_NATIVE_SCHAR, 1, &file, H5T_NATIVE_SCHAR, e->link_file);
    m->ok = m->ok && H5Lcreate_external(e->link_file, e->link_path, group, " link", H5P_DEFAULT, H5P_DEFAULT) >= 0;
  } else {
    m->ok = m->ok && H5Lcreate_soft(e->link_path, group, " link", H5P_DEFAULT, H5P_DEFAULT) >= 0;
  }
}

static void make_entry(maker *m, const rc_plan *plan, int64_t i)
{
  const rc_entry *e     = rc_entry_at(plan, i);
  char           *path  = path_of(plan, i);
  const hid_t     group = path ? H5Gcreate2(m->file, path, H5P_DEFAULT, m->group, H5P_DEFAULT) : -1;

  m->no_memory = !path;
  m->ok        = m->ok && group >= 0;
  free(path);
  if (!m->ok) return;
  node_attributes(m, group, e->name, e->label, e->content == RC_LINK ? "LK" : e->content == RC_EMPTY ? "MT" : e->type);
  flags_attribute(m, group);
  if (e->content == RC_LINK)
    link_datasets(m, group, e);
  else if (e->content == RC_LITERAL)
    dataset(m, group, " data", rc_h5_type(e->type), e->nd, e->dim,
            e->kind == 'I'   ? H5T_NATIVE_INT64
            : e->kind == 'R' ? H5T_NATIVE_DOUBLE
                             : rc_h5_type(e->type),
            e->literal);
  else if (e->content != RC_EMPTY)
    dataset(m, group, " data", rc_h5_type(e->type), e->nd, e->dim, -1, NULL);
  H5Gclose(group);
}

static void make_root(maker *m)
{
  const hid_t root = H5Gopen2(m->file, "/", H5P_DEFAULT);
  char        version[RC_NAME];

  snprintf(version, sizeof version, "HDF5 Version %d.%d.%d", H5_VERS_MAJOR, H5_VERS_MINOR, H5_VERS_RELEASE);
  node_attributes(m, root, "HDF5 MotherNode", "Root Node of HDF5 File", "MT");
  text_dataset(m, root, " format", H5Tget_order(H5T_NATIVE_DOUBLE) == H5T_ORDER_BE ? "IEEE_BIG_32" : "IEEE_LITTLE_32",
               H5Tget_order(H5T_NATIVE_DOUBLE) == H5T_ORDER_BE ? 12 : 15);
  text_dataset(m, root, " hdf5version", version, RC_NAME);
  H5Gclose(root);
}

/* More bytes than the file can need. */
static int64_t most_bytes(const rc_plan *plan)
{
  int64_t bytes = 1 << 16;

  for (int64_t i = 0; i < plan->entry.count; i++) {
    const rc_entry *e     = rc_entry_at(plan, i);
    int64_t         array = rc_width(e->type);

    for (int d = 0; d < e->nd; d++) array *= e->dim[d];
    bytes += 4096 + (e->nd ? array : 0);
    if (e->content == RC_LINK) bytes += 2 * (int64_t)(strlen(e->link_file) + strlen(e->link_path));
  }
  return bytes;
}

/* Is there room for so many bytes, as far as one can ask? An error number, or 0. Asked before HDF5 begins, because HDF5 cannot
 * let go of a file that it cannot write to the end. */
static int ask_space(const char *path, int64_t bytes)
{
  struct statvfs disk;
  struct rlimit  limit;

  if (!getrlimit(RLIMIT_FSIZE, &limit) && limit.rlim_cur != RLIM_INFINITY && (uint64_t)limit.rlim_cur < (uint64_t)bytes)
    return EFBIG;
  if (!statvfs(path, &disk) && disk.f_frsize && (uint64_t)disk.f_bavail < (uint64_t)bytes / disk.f_frsize) return ENOSPC;
  return 0;
}

/* Everything but the values, into a new file whose space is claimed. An error number, or 0; EIO is of HDF5, ENOMEM of here. */
static int make_file(const char *path, const rc_plan *plan)
{
  const unsigned order  = H5P_CRT_ORDER_TRACKED | H5P_CRT_ORDER_INDEXED;
  const hid_t    access = H5Pcreate(H5P_FILE_ACCESS), create = H5Pcreate(H5P_FILE_CREATE);
  maker          m    = {-1,   H5Pcreate(H5P_GROUP_CREATE), H5Pcreate(H5P_DATASET_CREATE), H5Pcreate(H5P_DATASET_CREATE),
                         true, false};
  hsize_t        size = 0;
  int            error;

  H5Pset_libver_bounds(access, H5F_LIBVER_V18, H5F_LIBVER_V18);
  H5Pset_link_creation_order(create, order);
  H5Pset_link_creation_order(m.group, order);
  H5Pset_obj_track_times(create, 0);
  H5Pset_obj_track_times(m.group, 0);
  H5Pset_obj_track_times(m.small, 0);
  H5Pset_obj_track_times(m.large, 0);
  H5Pset_layout(m.small, H5D_CONTIGUOUS);
  H5Pset_layout(m.large, H5D_CONTIGUOUS);
  H5Pset_alloc_time(m.large, H5D_ALLOC_TIME_EARLY);
  H5Pset_fill_time(m.large, H5D_FILL_TIME_NEVER);
  m.file = H5Fcreate(path, H5F_ACC_TRUNC, create, access);
  m.ok   = m.file >= 0;
  error  = m.ok ? rslice_file_claim(path, most_bytes(plan)) : EIO;
  if (!error) make_root(&m);
  for (int64_t i = 0; i < plan->entry.count && m.ok && !error; i++) make_entry(&m, plan, i);
  if (m.ok && !error) m.ok = H5Fflush(m.file, H5F_SCOPE_LOCAL) >= 0 && H5Fget_filesize(m.file, &size) >= 0;
  if (m.file >= 0 && H5Fclose(m.file) < 0) m.ok = false;
  if (m.ok && !error && truncate(path, (off_t)size)) error = errno;
  H5Pclose(m.large);
  H5Pclose(m.small);
  H5Pclose(m.group);
  H5Pclose(create);
  H5Pclose(access);
  return error ? error : m.ok ? 0 : m.no_memory ? ENOMEM : EIO;
}

rcgns_status rc_h5_skeleton(const char *path, const rc_plan *plan, rcgns_message *message)
{
  int error = ask_space(path, most_bytes(plan));

  if (!error) RC_QUIETLY(error = make_file(path, plan));
  if (error == ENOMEM) return rc_no_memory(message);
  return error ? rc_fail(message, RCGNS_IO, "cannot be written: %s", strerror(error)) : RCGNS_OK;
}

/* ---- values ------------------------------------------------------------------------------------------------------- */

/* Write [lo, hi) of the whole of a dataset, counted along its values; every rank takes part. */
static bool write_range(hid_t data, const rc_box *box, int64_t lo, int64_t hi, hid_t memory, const void *values)
{
  const hsize_t count = lo < hi ? (hsize_t)(hi - lo) : 0;
  const hid_t   space = H5Dget_space(data), shape = H5Screate_simple(1, &count, NULL), transfer = H5Pcreate(H5P_DATASET_XFER);
  const char    nothing[16] = {0};
  bool          ok          = rc_h5_select(space, box, lo, hi);

  if (!count) H5Sselect_none(shape);
  H5Pset_dxpl_mpio(transfer, H5FD_MPIO_COLLECTIVE);
  ok = H5Dwrite(data, memory, shape, space, transfer, count ? values : nothing) >= 0 && ok;
  H5Pclose(transfer);
  H5Sclose(shape);
  H5Sclose(space);
  return ok;
}

static rcgns_status write_failed(const rcgns_file *file, bool ok, const char *name, rcgns_message *message)
{
  return rc_agree(file->comm, ok ? RCGNS_OK : rc_fail(message, RCGNS_IO, "cannot write array %s: is the disk full?", name),
                  message);
}

/* Copy a large array, each rank its share, in rounds. Collective. */
static rcgns_status copy_array(rcgns_file *file, hid_t data, const rc_entry *e, rcgns_message *message)
{
  rc_box       from = {.nd = e->nd}, to = {.nd = e->nd};
  const int    width = rc_width(e->type);
  int64_t      total = 1, lo, hi, rounds;
  char        *block;
  rcgns_status status;

  for (int d = 0; d < e->nd; d++) {
    from.origin[d] = e->origin[d];
    from.shape[d] = to.shape[d] = e->dim[d];
    total *= e->dim[d];
  }
  lo     = ra_share(total, file->rank, file->size);
  hi     = ra_share(total, file->rank + 1, file->size);
  rounds = (ra_share(total, 1, file->size) + COPY_ROUND - 1) / COPY_ROUND;
  block  = ra_alloc(hi - lo < COPY_ROUND ? hi - lo : COPY_ROUND, (size_t)width);
  status = rc_agree(file->comm, block ? RCGNS_OK : rc_no_memory(message), message);
  for (int64_t r = 0; r < rounds && status == RCGNS_OK; r++) {
    const int64_t a = rc_clamp(lo + r * COPY_ROUND, lo, hi), b = rc_clamp(a + COPY_ROUND, a, hi);

    status = rc_read(file, RCGNS_OK, e->node, &from, a, b, 'N', block, message);
    if (status == RCGNS_OK)
      status = write_failed(file, write_range(data, &to, a, b, rc_h5_type(e->type), block), e->name, message);
  }
  free(block);
  return status;
}

/* Write a field of one zone from the ranks that hold its cells. Collective. */
static rcgns_status write_values(rcgns_file *file, hid_t data, const rc_entry *e, const rcgns_new_field *fields,
                                 rcgns_message *message)
{
  const rc_zone *zone   = file->zone + e->zone;
  const int64_t  lo     = rc_clamp(file->cell_lo - zone->first_cell, 0, zone->num_cells);
  const int64_t  hi     = rc_clamp(file->cell_hi - zone->first_cell, lo, zone->num_cells);
  const int64_t  most   = ra_share(file->num_cells, 1, file->size);
  const int64_t  rounds = ((most < zone->num_cells ? most : zone->num_cells) + WRITE_ROUND - 1) / WRITE_ROUND;
  const double  *values = fields[e->field].values;
  rc_box         box    = {.nd = e->nd};
  rcgns_status   status = RCGNS_OK;

  for (int d = 0; d < e->nd; d++) box.shape[d] = e->dim[d];
  for (int64_t r = 0; r < rounds && status == RCGNS_OK; r++) {
    const int64_t a = rc_clamp(lo + r * WRITE_ROUND, lo, hi), b = rc_clamp(a + WRITE_ROUND, a, hi);
    const double *from = a < b ? values + (zone->first_cell + a - file->cell_lo) : NULL;

    status = write_failed(file, write_range(data, &box, a, b, H5T_NATIVE_DOUBLE, from), e->name, message);
  }
  return status;
}

/* Write this rank's slice of each row of an array. Collective. */
static rcgns_status write_slice(rcgns_file *file, hid_t data, const rc_entry *e, rcgns_message *message)
{
  const int64_t num    = e->end - e->begin;
  const hid_t   memory = e->kind == 'I' ? H5T_NATIVE_INT64 : H5T_NATIVE_DOUBLE;
  int64_t       total = 1, rounds = (num + WRITE_ROUND - 1) / WRITE_ROUND;
  rc_box        box    = {.nd = e->nd};
  rcgns_status  status = RCGNS_OK;

  for (int d = 0; d < e->nd; d++) total *= box.shape[d] = e->dim[d];
  MPI_Allreduce(MPI_IN_PLACE, &rounds, 1, MPI_INT64_T, MPI_MAX, file->comm);
  for (int64_t i = 0; i < rounds * e->rows && status == RCGNS_OK; i++) {
    const int64_t row = i / rounds, lo = rc_clamp(i % rounds * WRITE_ROUND, 0, num), hi = rc_clamp(lo + WRITE_ROUND, lo, num);
    const int64_t at = total / e->rows * row + e->begin;

    status =
        write_failed(file, write_range(data, &box, at + lo, at + hi, memory, (const char *)e->literal + 8 * (num * row + lo)),
                     e->name, message);
  }
  return status;
}

static rcgns_status fill_entry(rcgns_file *file, hid_t out, const rc_plan *plan, int64_t i, const rcgns_new_field *fields,
                               rcgns_message *message)
{
  const rc_entry *e    = rc_entry_at(plan, i);
  char           *path = path_of(plan, i), *name = path ? malloc(strlen(path) + sizeof "/ data") : NULL;
  hid_t           data = -1;
  rcgns_status    status;

  if (name) {
    sprintf(name, "%s/ data", path);
    data = H5Dopen2(out, name, H5P_DEFAULT);
  }
  status = rc_agree(file->comm, name ? RCGNS_OK : rc_no_memory(message), message);
  if (status == RCGNS_OK) status = write_failed(file, data >= 0, e->name, message);
  if (status == RCGNS_OK)
    status = e->content == RC_COPY    ? copy_array(file, data, e, message)
             : e->content == RC_SLICE ? write_slice(file, data, e, message)
                                      : write_values(file, data, e, fields, message);
  if (data >= 0) H5Dclose(data);
  free(name);
  free(path);
  return status;
}

static rcgns_status fill_file(rcgns_file *file, const char *path, const rc_plan *plan, const rcgns_new_field *fields,
                              rcgns_message *message)
{
  const hid_t  access = H5Pcreate(H5P_FILE_ACCESS);
  hid_t        out;
  bool         closed = true;
  rcgns_status status;

  H5Pset_fapl_mpio(access, file->comm, MPI_INFO_NULL);
  H5Pset_libver_bounds(access, H5F_LIBVER_V18, H5F_LIBVER_V18);
  out = H5Fopen(path, H5F_ACC_RDWR, access);
  H5Pclose(access);
  status = write_failed(file, out >= 0, "(the file)", message);
  for (int64_t i = 0; i < plan->entry.count && status == RCGNS_OK; i++) {
    const rc_content content = rc_entry_at(plan, i)->content;

    if (content == RC_COPY || content == RC_VALUES || content == RC_SLICE)
      status = fill_entry(file, out, plan, i, fields, message);
  }
  if (out >= 0) closed = H5Fclose(out) >= 0;
  return status == RCGNS_OK ? write_failed(file, closed, "(the file)", message) : status;
}

rcgns_status rc_h5_fill(rcgns_file *file, const char *path, const rc_plan *plan, const rcgns_new_field *fields,
                        rcgns_message *message)
{
  rcgns_status status = RCGNS_OK;

  RC_QUIETLY(status = fill_file(file, path, plan, fields, message));
  return status;
}
