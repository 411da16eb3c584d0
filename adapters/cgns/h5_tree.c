/* h5_tree -- HDF5 files: the tree, and slabs of its arrays.
 *
 * A CGNS node is a group with the attributes name, label, type; its payload the dataset " data"; its children the groups
 * whose names do not begin with a blank. One rank walks the tree through the ordinary driver: O(nodes). Slabs are read through
 * MPI-IO, by each rank for itself: they are contiguous, so there is nothing to gather for one another, and neighbouring slabs
 * of nodes overlap, for which collective reads of Open MPI 4.1 (OMPIO with dynamic or vulcan) return too few values and say
 * nothing. */
#include "h5.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_DEPTH = 100, MAX_NODES = 1 << 24 };

/* The walk's files: opened once each. */
typedef struct walker {
  rc_tree       *tree;
  ra_array       file; /* hid_t for each source of the tree */
  rcgns_message *message;
  bool           no_memory; /* somewhere on the way: then a link that leads nowhere need not be dead */
  bool           is_damaged; /* HDF5 has failed: it may not survive to be asked for more of the file */
} walker;

/* What HDF5 answers to a question that any sound file has an answer to. */
static int64_t sound(walker *w, int64_t answer)
{
  w->is_damaged |= answer < 0;
  return answer;
}

static hid_t file_of(const walker *w, int source) { return ((hid_t *)w->file.item)[source]; }

static const char *path_of(const walker *w, int source) { return rc_text(w->tree, rc_source_at(w->tree, source)->path); }

bool rc_h5_is_file(const char *path)
{
  htri_t is = 0;

  RC_QUIETLY(is = H5Fis_hdf5(path));
  return is > 0;
}

/* A fixed-length string attribute, trimmed; empty if it is absent or something else. */
static void read_attribute(walker *w, hid_t group, const char *name, char *out, size_t size)
{
  hid_t attribute, stored, memory;

  memset(out, 0, size);
  if (w->is_damaged || sound(w, H5Aexists(group, name)) <= 0) return;
  if ((attribute = sound(w, H5Aopen(group, name, H5P_DEFAULT))) < 0) return;
  stored = H5Aget_type(attribute);
  memory = H5Tcopy(H5T_C_S1);
  if (H5Tget_class(stored) == H5T_STRING && H5Tis_variable_str(stored) == 0 &&
      H5Aget_storage_size(attribute) == H5Tget_size(stored) && H5Tset_size(memory, size) >= 0 &&
      sound(w, H5Aread(attribute, memory, out)) < 0)
    memset(out, 0, size);
  out[size - 1] = 0;
  for (size_t n = strlen(out); n && out[n - 1] == ' '; n--) out[n - 1] = 0;
  H5Tclose(memory);
  H5Tclose(stored);
  H5Aclose(attribute);
}

hid_t rc_h5_type(const char *type)
{
  if (!strcmp(type, "I4")) return H5T_NATIVE_INT32;
  if (!strcmp(type, "I8")) return H5T_NATIVE_INT64;
  if (!strcmp(type, "U4")) return H5T_NATIVE_UINT32;
  if (!strcmp(type, "U8")) return H5T_NATIVE_UINT64;
  if (!strcmp(type, "R4")) return H5T_NATIVE_FLOAT;
  if (!strcmp(type, "R8")) return H5T_NATIVE_DOUBLE;
  if (!strcmp(type, "B1")) return H5T_NATIVE_UCHAR;
  if (!strcmp(type, "C1")) return H5T_NATIVE_SCHAR;
  return -1;
}

/* The type in which values are wanted: as integers, as reals, or as they are. */
static hid_t memory_type(char as, const char *type)
{
  switch (as) {
    case 'I': return H5T_NATIVE_INT64;
    case 'R': return H5T_NATIVE_DOUBLE;
    default: return rc_h5_type(type);
  }
}

/* What the dataset really holds, whatever the node's type says. */
static void classify(hid_t data, rc_node *n)
{
  const hid_t type        = H5Dget_type(data);
  const H5T_class_t class = H5Tget_class(type);
  const size_t size       = H5Tget_size(type);
  const char  *real       = NULL;

  if (class == H5T_INTEGER && size == 1) real = n->type[0] == 'B' || n->type[0] == 'U' ? "B1" : "C1";
  if (class == H5T_INTEGER && size == 4) real = H5Tget_sign(type) == H5T_SGN_NONE ? "U4" : "I4";
  if (class == H5T_INTEGER && size == 8) real = H5Tget_sign(type) == H5T_SGN_NONE ? "U8" : "I8";
  if (class == H5T_FLOAT && size == 4) real = "R4";
  if (class == H5T_FLOAT && size == 8) real = "R8";
  n->kind = '?';
  if (real) {
    memcpy(n->type, real, 3);
    n->kind = real[0] == 'U' ? 'I' : real[0] == 'B' ? 'C' : real[0];
  }
  H5Tclose(type);
}

/* Does the file hold as many bytes as the dataset claims? Compression gains a factor of about 1000 at most. */
static bool is_plausible(hid_t data, const rc_node *n, int64_t file_size)
{
  const hid_t   list      = H5Dget_create_plist(data);
  const bool    chunked   = H5Pget_layout(list) == H5D_CHUNKED;
  const bool    elsewhere = H5Pget_external_count(list) > 0 || H5Pget_layout(list) == H5D_VIRTUAL;
  const hsize_t stored    = H5Dget_storage_size(data);
  const int64_t count     = rc_count(n);

  H5Pclose(list);
  return !elsewhere && stored > 0 && count > 0 && count <= (chunked ? 1100 : 1) * file_size;
}

static rcgns_status payload(walker *w, hid_t group, rc_node *n)
{
  rc_source   *source = rc_source_at(w->tree, n->file);
  hid_t        data, space;
  hsize_t      dims[H5S_MAX_RANK];
  int          nd;
  rcgns_status status = RCGNS_OK;
  void        *small  = NULL;

  if (w->is_damaged || sound(w, H5Lexists(group, " data", H5P_DEFAULT)) <= 0) return RCGNS_OK;
  if ((data = sound(w, H5Dopen2(group, " data", H5P_DEFAULT))) < 0) return RCGNS_OK;
  space = H5Dget_space(data);
  nd    = H5Sget_simple_extent_ndims(space);
  if (nd > 0 && nd <= RC_MAX_DIMS) {
    H5Sget_simple_extent_dims(space, dims, NULL);
    n->nd = nd;
    for (int d = 0; d < nd; d++) n->dim[d] = dims[d] > INT64_MAX ? -1 : (int64_t)dims[d];
    classify(data, n);
    if (!is_plausible(data, n, source->size)) n->kind = 0, n->nd = 0;
  }
  if (rc_is_small(n)) {
    const int64_t count = rc_count(n);

    small = ra_alloc(count, sizeof(int64_t));
    if (!small)
      status = rc_no_memory(w->message);
    else if (H5Dread(data, memory_type(n->kind == 'C' ? 'N' : n->kind, n->type), H5S_ALL, H5S_ALL, H5P_DEFAULT, small) < 0)
      status = rc_fail(w->message, RCGNS_IO, "%s: cannot read node %s: is the file complete?", path_of(w, n->file), n->name);
    else if ((n->small = rc_tree_store(w->tree, small, count * (n->kind == 'C' ? 1 : 8))) < 0)
      status = rc_no_memory(w->message);
  }
  free(small);
  H5Sclose(space);
  H5Dclose(data);
  return status;
}

/* A small dataset of characters in a group; the caller frees; NULL if there is none. */
static char *read_text(walker *w, hid_t group, const char *name)
{
  hid_t   data, space;
  char   *text = NULL;
  int64_t count;

  if (w->is_damaged || sound(w, H5Lexists(group, name, H5P_DEFAULT)) <= 0) return NULL;
  if ((data = sound(w, H5Dopen2(group, name, H5P_DEFAULT))) < 0) return NULL;
  space = H5Dget_space(data);
  count = (int64_t)H5Sget_simple_extent_npoints(space);
  if (count > 0 && count < 1 << 16 && !(text = calloc((size_t)count + 1, 1))) w->no_memory = true;
  if (text && sound(w, H5Dread(data, H5T_NATIVE_SCHAR, H5S_ALL, H5S_ALL, H5P_DEFAULT, text)) < 0) {
    free(text);
    text = NULL;
  }
  H5Sclose(space);
  H5Dclose(data);
  return text;
}

/* The source of that path, opened; -1: it cannot be had, which makes a link dead. */
static int source_at(walker *w, const char *path)
{
  hid_t file;
  int   source;

  for (int i = 0; i < (int)w->tree->source.count; i++)
    if (!strcmp(path_of(w, i), path)) return i;
  if (!rc_h5_is_file(path) || (file = H5Fopen(path, H5F_ACC_RDONLY, H5P_DEFAULT)) < 0) return -1;
  source = ra_reserve(&w->file, 1, sizeof file) ? rc_tree_source(w->tree, path, false) : -1;
  if (source == -1) w->no_memory = true;
  if (source < 0) {
    H5Fclose(file);
    return -1;
  }
  ((hid_t *)w->file.item)[w->file.count++] = file;
  return source;
}

/* A linked file's path: relative ones begin at the folder of the file with the link. The caller frees. */
static char *linked_path(walker *w, int from, const char *file)
{
  const char  *here   = path_of(w, from);
  const char  *slash  = strrchr(here, '/');
  const int    folder = *file == '/' || !slash ? 0 : (int)(slash - here) + 1;
  const size_t size   = (size_t)folder + strlen(file) + 1;
  char        *path   = malloc(size);

  if (path) snprintf(path, size, "%.*s%s", folder, here, file);
  else w->no_memory = true;
  return path;
}

static hid_t open_path(walker *w, int *source, const char *path, char **found, int depth);

/* Where a link group leads: the group, open, and its file and path there; -1: nowhere. */
static hid_t follow(walker *w, hid_t group, int *source, char **found, int depth)
{
  char *file = read_text(w, group, " file");
  char *path = read_text(w, group, " path");
  hid_t to   = -1;
  int   at   = *source;

  if (path && file && *file) {
    char *full = linked_path(w, *source, file);

    at = full ? source_at(w, full) : -1;
    free(full);
  }
  if (path && at >= 0 && depth < MAX_DEPTH) to = open_path(w, &at, path, found, depth + 1);
  if (to >= 0) *source = at;
  free(file);
  free(path);
  return to;
}

/* Open the group at a path of a file, through links on the way. *found is its path without links, the caller's. */
static hid_t open_path(walker *w, int *source, const char *path, char **found, int depth)
{
  hid_t group = H5Gopen2(file_of(w, *source), "/", H5P_DEFAULT);
  char *at    = strdup("");

  while (group >= 0 && at) {
    const size_t skip = strspn(path, "/");
    const size_t n    = strcspn(path + skip, "/");
    char         name[RC_NAME], type[3];
    hid_t        next = -1;
    char        *down = NULL;

    if (!n) break;
    path += skip;
    if (n < sizeof name) {
      memcpy(name, path, n);
      name[n] = 0;
      if (*name != ' ' && !w->is_damaged && sound(w, H5Lexists(group, name, H5P_DEFAULT)) > 0)
        next = H5Gopen2(group, name, H5P_DEFAULT);
    }
    if (next >= 0) {
      read_attribute(w, next, "type", type, sizeof type);
      if (!strcmp(type, "LK")) {
        const hid_t to = follow(w, next, source, &down, depth);

        H5Gclose(next);
        next = to;
      } else if ((down = malloc(strlen(at) + n + 2))) {
        sprintf(down, "%s/%s", at, name);
      }
    }
    H5Gclose(group);
    free(at);
    group = next;
    at    = down;
    path += n;
  }
  if (group >= 0 && !at) {
    w->no_memory = true;
    H5Gclose(group);
    group = -1;
  }
  if (group < 0) {
    free(at);
    return -1;
  }
  *found = at;
  return group;
}

/* Is this place already open above the node? Then a link to it has no end. */
static bool is_above(walker *w, int64_t node, int source, const char *path)
{
  for (; node >= 0; node = rc_node_at(w->tree, node)->parent) {
    const bool here = rc_node_at(w->tree, node)->file == source;
    char      *mine = here ? rc_tree_path(w->tree, node) : NULL;
    const bool same = mine && !strcmp(mine, *path ? path : "/");

    if (here && !mine) w->no_memory = true;
    free(mine);
    if (same) return true;
  }
  return false;
}

typedef struct names {
  ra_array name; /* char * */
  bool     no_memory;
} names;

static herr_t collect(hid_t group, const char *name, const H5L_info_t *info, void *user)
{
  names    *mine = user;
  ra_array *list = &mine->name;
  char     *copy;

  (void)group;
  (void)info;
  if (*name == ' ') return 0;
  if (!ra_reserve(list, 1, sizeof copy) || !(copy = strdup(name))) {
    mine->no_memory = true;
    return -1;
  }
  ((char **)list->item)[list->count++] = copy;
  return 0;
}

static rcgns_status walk(walker *w, hid_t group, int64_t parent, rc_node n, int depth);

/* A child, open; -1: it is no group, or a link of HDF5's own leads nowhere. */
static hid_t open_child(walker *w, hid_t group, const char *name)
{
  H5L_info_t link;
  H5O_info_t object;

  if (w->is_damaged || sound(w, H5Lget_info(group, name, &link, H5P_DEFAULT)) < 0) return -1;
  if (link.type != H5L_TYPE_HARD) return H5Gopen2(group, name, H5P_DEFAULT);
  if (sound(w, H5Oget_info_by_name2(group, name, &object, H5O_INFO_BASIC, H5P_DEFAULT)) < 0) return -1;
  return object.type == H5O_TYPE_GROUP ? sound(w, H5Gopen2(group, name, H5P_DEFAULT)) : -1;
}

/* The children in the order of their making, or by name where the file does not keep it. */
static rcgns_status walk_children(walker *w, hid_t group, int64_t me, int source, int depth)
{
  names        list   = {.no_memory = false};
  unsigned     flags  = 0;
  hid_t        made   = sound(w, H5Gget_create_plist(group));
  rcgns_status status = RCGNS_OK;

  if (made < 0) return RCGNS_OK;
  H5Pget_link_creation_order(made, &flags);
  H5Pclose(made);
  if (H5Literate(group, flags & H5P_CRT_ORDER_TRACKED ? H5_INDEX_CRT_ORDER : H5_INDEX_NAME, H5_ITER_INC, NULL, collect, &list) <
      0)
    status = list.no_memory ? rc_no_memory(w->message)
                            : rc_fail(w->message, RCGNS_IO, "%s: cannot list the children of node %s: is the file complete?",
                                      path_of(w, source), rc_node_at(w->tree, me)->name);
  for (int64_t i = 0; i < list.name.count; i++) {
    char   *name  = ((char **)list.name.item)[i];
    rc_node n     = {.file = source, .link_file = -1, .link_path = -1, .anchor = -1, .small = -1};
    hid_t   child = -1;

    if (status == RCGNS_OK && strlen(name) < sizeof n.name && (child = open_child(w, group, name)) >= 0) {
      strcpy(n.name, name);
      status = walk(w, child, me, n, depth);
      H5Gclose(child);
    }
    free(name);
  }
  ra_drop(&list.name);
  return status;
}

static rcgns_status walk(walker *w, hid_t group, int64_t parent, rc_node n, int depth)
{
  char        *found = NULL, *file = NULL, *path = NULL;
  hid_t        at     = group;
  int64_t      me     = -1;
  rcgns_status status = RCGNS_OK;

  if (depth > MAX_DEPTH || w->tree->node.count > MAX_NODES)
    return rc_fail(w->message, RCGNS_IO, "%s: its tree has no end: does a link lead back to itself?", path_of(w, 0));
  read_attribute(w, group, "type", n.type, sizeof n.type);
  if (!strcmp(n.type, "LK")) {
    file        = read_text(w, group, " file");
    path        = read_text(w, group, " path");
    n.is_link   = true;
    n.link_file = rc_tree_store(w->tree, file ? file : "", file ? (int64_t)strlen(file) + 1 : 1);
    n.link_path = rc_tree_store(w->tree, path ? path : "", path ? (int64_t)strlen(path) + 1 : 1);
    at          = follow(w, group, &n.file, &found, 0);
    n.is_dead   = at < 0 || is_above(w, parent, n.file, found);
    memcpy(n.type, "MT", 3);
    if (at >= 0) {
      read_attribute(w, at, "type", n.type, sizeof n.type);
      n.anchor = rc_tree_store(w->tree, found, (int64_t)strlen(found) + 1);
    }
    if (w->no_memory || n.link_file < 0 || n.link_path < 0 || (at >= 0 && n.anchor < 0)) status = rc_no_memory(w->message);
  }
  if (!n.is_dead) read_attribute(w, at, "label", n.label, sizeof n.label);
  if (status == RCGNS_OK && !n.is_dead && parent >= 0) status = payload(w, at, &n);
  if (status == RCGNS_OK && w->is_damaged)
    status = rc_fail(w->message, RCGNS_IO, "%s: the file is damaged at node %s", path_of(w, n.file), *n.name ? n.name : "/");
  if (status == RCGNS_OK && (me = rc_tree_add(w->tree, parent, &n)) < 0) status = rc_no_memory(w->message);
  if (status == RCGNS_OK && !n.is_dead) status = walk_children(w, at, me, n.file, depth + 1);
  if (status == RCGNS_OK && w->is_damaged)
    status = rc_fail(w->message, RCGNS_IO, "%s: the file is damaged below node %s", path_of(w, n.file), *n.name ? n.name : "/");
  if (at != group && at >= 0) H5Gclose(at);
  free(found);
  free(file);
  free(path);
  return status;
}

static rcgns_status walk_all(walker *w)
{
  const rc_node root  = {.link_file = -1, .link_path = -1, .anchor = -1, .small = -1};
  const char   *path  = path_of(w, 0);
  hid_t         file  = H5Fopen(path, H5F_ACC_RDONLY, H5P_DEFAULT);
  hid_t         group = -1;
  rcgns_status  status;

  if (file < 0) return rc_fail(w->message, RCGNS_IO, "%s: HDF5 cannot open it: the file is truncated, damaged or locked", path);
  if (!ra_reserve(&w->file, 1, sizeof file)) {
    H5Fclose(file);
    return rc_no_memory(w->message);
  }
  ((hid_t *)w->file.item)[w->file.count++] = file;
  group                                    = H5Gopen2(file, "/", H5P_DEFAULT);
  if (sound(w, group) < 0) return rc_fail(w->message, RCGNS_IO, "%s: it has no root group: the file is damaged", path);
  status = walk(w, group, -1, root, 0);
  H5Gclose(group);
  return status;
}

rcgns_status rc_h5_walk(rc_tree *tree, rcgns_message *message)
{
  walker       w      = {.tree = tree, .message = message};
  rcgns_status status = RCGNS_OK;

  RC_QUIETLY(status = walk_all(&w));
  for (int64_t i = 0; i < w.file.count; i++) RC_QUIETLY(H5Fclose(file_of(&w, (int)i)));
  ra_drop(&w.file);
  if (w.is_damaged) H5Eset_auto2(H5E_DEFAULT, NULL, NULL); /* else HDF5 prints at exit that it could not close the file */
  return status;
}

/* ---- slabs -------------------------------------------------------------------------------------------------------- */

rcgns_status rc_h5_open(MPI_Comm comm, const char *path, int64_t *handle, rcgns_message *message)
{
  const hid_t access = H5Pcreate(H5P_FILE_ACCESS);
  hid_t       file   = -1;

  H5Pset_fapl_mpio(access, comm, MPI_INFO_NULL);
  RC_QUIETLY(file = H5Fopen(path, H5F_ACC_RDONLY, access));
  H5Pclose(access);
  *handle = (int64_t)file;
  return file < 0 ? rc_fail(message, RCGNS_IO, "%s: cannot be opened by all ranks: do they see the same file system?", path)
                  : RCGNS_OK;
}

void rc_h5_close(int64_t handle) { RC_QUIETLY(H5Fclose((hid_t)handle)); }

bool rc_h5_select(hid_t space, const rc_box *box, int64_t lo, int64_t hi)
{
  rc_box    part[RC_MAX_BOXES];
  const int parts = rc_box_cut(box, lo, hi, part);
  bool      ok    = H5Sselect_none(space) >= 0;

  for (int p = 0; p < parts; p++) {
    hsize_t start[RC_MAX_DIMS], count[RC_MAX_DIMS];

    for (int d = 0; d < box->nd; d++) {
      start[d] = (hsize_t)part[p].origin[d];
      count[d] = (hsize_t)part[p].shape[d];
    }
    ok = ok && H5Sselect_hyperslab(space, p ? H5S_SELECT_OR : H5S_SELECT_SET, start, NULL, count, NULL) >= 0;
  }
  return ok;
}

static herr_t look_for_memory(unsigned n, const H5E_error2_t *error, void *found)
{
  (void)n;
  if (error->maj_num == H5E_RESOURCE || error->min_num == H5E_NOSPACE || error->min_num == H5E_CANTALLOC) *(bool *)found = true;
  return 0;
}

/* ok, of HDF5's last call; *is_short becomes true if it failed because it got no memory. */
static bool judged(bool ok, bool *is_short)
{
  if (!ok) H5Ewalk2(H5E_DEFAULT, H5E_WALK_UPWARD, look_for_memory, is_short);
  return ok;
}

rcgns_status rc_h5_read(int64_t handle, const char *path, const char *type, const rc_box *box, int64_t lo, int64_t hi, char as,
                        void *out, rcgns_message *message)
{
  const hsize_t count = lo < hi ? (hsize_t)(hi - lo) : 0;
  const size_t  size  = strlen(path) + sizeof "/ data";
  char         *name  = malloc(size);
  hid_t         data = -1, space = -1, memory = -1;
  bool          ok, is_short = false;

  if (!name) return rc_no_memory(message);
  snprintf(name, size, "%s/ data", path);
  RC_QUIETLY(ok = judged((data = H5Dopen2((hid_t)handle, name, H5P_DEFAULT)) >= 0, &is_short));
  if (ok) {
    space  = H5Dget_space(data);
    memory = H5Screate_simple(1, &count, NULL);
    ok     = H5Sget_simple_extent_ndims(space) == box->nd && rc_h5_select(space, box, lo, hi);
    if (ok) RC_QUIETLY(ok = judged(H5Dread(data, memory_type(as, type), memory, space, H5P_DEFAULT, out) >= 0, &is_short));
    H5Sclose(memory);
    H5Sclose(space);
    H5Dclose(data);
  }
  free(name);
  if (is_short) return rc_no_memory(message);
  return ok ? RCGNS_OK : rc_fail(message, RCGNS_IO, "cannot read the array %s: is the file complete?", path);
}
