/* cgio_tree -- ADF files through cgio, the middle layer of the CGNS library: tree and slabs.
 *
 * cgio checks no version and no SIDS rule, so every file that is a tree can be read. It follows links by itself. Each rank
 * opens the file for itself and reads its own slabs; nothing here communicates. cgio's sizes are 32-bit in common builds:
 * a size that wraps comes out negative and is refused. */
#include "cgns_private.h"

#include <cgns_io.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_DEPTH = 100, MAX_NODES = 1 << 24 };

static rcgns_status adf_fail(rcgns_message *message, const char *path, const char *what)
{
  char why[CGIO_MAX_ERROR_LENGTH + 300] = "";

  cgio_error_message(why);
  return rc_fail(message, RCGNS_IO, "%s: cannot read %s of this ADF file (%s): is it complete?", path, what, why);
}

bool rc_adf_is_file(const char *path)
{
  int type = CGIO_FILE_NONE;

  return cgio_check_file(path, &type) == 0 && (type == CGIO_FILE_ADF || type == CGIO_FILE_ADF2);
}

static char kind_of(const char *type)
{
  static const char *const known[] = {"I4", "I8", "U4", "U8", "R4", "R8", "C1", "B1"};

  if (!strcmp(type, "MT") || !strcmp(type, "LK")) return 0;
  for (size_t i = 0; i < sizeof known / sizeof *known; i++)
    if (!strcmp(type, known[i])) return type[0] == 'U' ? 'I' : type[0] == 'B' ? 'C' : type[0];
  return '?';
}

/* Read one box. Memory is filled in the order of the box. */
static int read_box(int cg, double id, const char *type, const rc_box *box, void *out)
{
  cgsize_t s0[RC_MAX_DIMS], s1[RC_MAX_DIMS], one[RC_MAX_DIMS], count = 1, m0 = 1;

  for (int d = 0; d < box->nd; d++) {
    const int f = box->nd - 1 - d; /* Fortran's order, from 1 */

    s0[f]  = (cgsize_t)(box->origin[d] + 1);
    s1[f]  = (cgsize_t)(box->origin[d] + box->shape[d]);
    one[d] = 1;
    count *= (cgsize_t)box->shape[d];
  }
#ifdef RCGNS_CGIO_READ_DATA
  (void)type;
  return cgio_read_data(cg, id, s0, s1, one, 1, &count, &m0, &count, one, out);
#else
  return cgio_read_data_type(cg, id, s0, s1, one, type, 1, &count, &m0, &count, one, out);
#endif
}

/* Widen raw values of a type to int64_t ('I') or double ('R'); false: it is not numeric. */
static bool widen(const char *type, const void *raw, int64_t count, char as, void *out)
{
#define EACH(from)                                                                         \
  do {                                                                                     \
    const from *in = raw;                                                                  \
    for (int64_t i = 0; i < count && as == 'I'; i++) ((int64_t *)out)[i] = (int64_t)in[i]; \
    for (int64_t i = 0; i < count && as == 'R'; i++) ((double *)out)[i] = (double)in[i];   \
  } while (0)
  if (!strcmp(type, "I4"))
    EACH(int32_t);
  else if (!strcmp(type, "U4"))
    EACH(uint32_t);
  else if (!strcmp(type, "I8"))
    EACH(int64_t);
  else if (!strcmp(type, "U8"))
    EACH(uint64_t);
  else if (!strcmp(type, "R8") && as == 'R')
    EACH(double);
  else if (!strcmp(type, "R4") && as == 'R')
    EACH(float);
  else
    return false;
#undef EACH
  return true;
}

static rcgns_status read_range(int cg, double id, const char *path, const char *type, const rc_box *box, int64_t lo, int64_t hi,
                               char as, void *out, rcgns_message *message)
{
  rc_box       part[RC_MAX_BOXES];
  const int    parts  = rc_box_cut(box, lo, hi, part);
  const int    width  = rc_width(type);
  char        *raw    = as == 'N' ? out : ra_alloc(hi - lo, (size_t)width);
  rcgns_status status = raw ? RCGNS_OK : rc_no_memory(message);

  for (int64_t p = 0, at = 0; p < parts && status == RCGNS_OK; at += rc_box_count(part + p++))
    if (read_box(cg, id, type, part + p, raw + at * width)) status = adf_fail(message, path, "an array");
  if (status == RCGNS_OK && as != 'N' && !widen(type, raw, hi - lo, as, out))
    status = rc_fail(message, RCGNS_IO, "%s: an array is stored as %s where numbers are needed", path, type);
  if (raw != out) free(raw);
  return status;
}

/* Type, size and, if it is small, the payload of a node. */
static rcgns_status payload(rc_tree *tree, int cg, double id, const char *path, rc_node *n, rcgns_message *message)
{
  cgsize_t         dims[CGIO_MAX_DIMENSIONS]       = {0};
  char             type[CGIO_MAX_LABEL_LENGTH + 1] = ""; /* ADF knows types of many letters */
  int              nd                              = 0;
  const rc_source *source                          = rc_source_at(tree, 0);
  int64_t          count;
  rcgns_status     status;
  void            *small;
  rc_box           box;

  if (cgio_get_data_type(cg, id, type) || cgio_get_dimensions(cg, id, &nd, dims)) return adf_fail(message, path, n->name);
  memcpy(n->type, type, 2);
  n->kind = kind_of(type);
  n->nd   = n->kind ? nd : 0;
  for (int d = 0; d < n->nd; d++) {
    n->dim[d] = (int64_t)dims[nd - 1 - d];
    if (n->dim[d] < 0)
      return rc_fail(message, RCGNS_IO, "%s: node %s has a size beyond 2^31: convert the file to HDF5 (adf2hdf)", path,
                     n->name);
  }
  count = rc_count(n);
  if (count < 1 || !n->nd) n->kind = 0, n->nd = 0;
  if (n->kind && !n->is_link && count > source->size / (rc_width(n->type) ? rc_width(n->type) : 1))
    return rc_fail(message, RCGNS_IO, "%s: node %s claims more data than the file holds: the file is truncated or damaged",
                   path, n->name);
  if (!rc_is_small(n)) return RCGNS_OK;
  box   = rc_whole(n);
  small = ra_alloc(count, sizeof(int64_t));
  if (!small) return rc_no_memory(message);
  status = read_range(cg, id, path, n->type, &box, 0, count, n->kind == 'C' ? 'N' : n->kind, small, message);
  if (status == RCGNS_OK) {
    n->small = rc_tree_store(tree, small, count * (n->kind == 'C' ? 1 : 8));
    if (n->small < 0) status = rc_no_memory(message);
  }
  free(small);
  return status;
}

static rcgns_status link_of(rc_tree *tree, int cg, double id, const char *path, rc_node *n, rcgns_message *message)
{
  int   length = 0, file_length = 0, name_length = 0;
  char *text;

  if (cgio_is_link(cg, id, &length)) return adf_fail(message, path, n->name);
  if (length <= 0) return RCGNS_OK;
  if (cgio_link_size(cg, id, &file_length, &name_length) || file_length < 0 || name_length < 0)
    return adf_fail(message, path, n->name);
  text = calloc((size_t)file_length + (size_t)name_length + 4, 1);
  if (!text) return rc_no_memory(message);
  n->is_link = true;
  if (!cgio_get_link(cg, id, text, text + file_length + 2)) {
    n->link_file = rc_tree_store(tree, text, (int64_t)strlen(text) + 1);
    n->link_path = rc_tree_store(tree, text + file_length + 2, (int64_t)strlen(text + file_length + 2) + 1);
  }
  free(text);
  return n->link_file < 0 || n->link_path < 0 ? adf_fail(message, path, n->name) : RCGNS_OK;
}

static rcgns_status walk(rc_tree *tree, int cg, double id, int64_t parent, int depth, const char *path, rcgns_message *message)
{
  rc_node      n        = {.link_file = -1, .link_path = -1, .anchor = -1, .small = -1};
  int          children = 0, got = 0;
  double      *ids = NULL;
  int64_t      me;
  rcgns_status status = RCGNS_OK;

  if (depth > MAX_DEPTH || tree->node.count > MAX_NODES)
    return rc_fail(message, RCGNS_IO, "%s: its tree has no end: does a link lead back to itself?", path);
  if (cgio_get_name(cg, id, n.name)) return adf_fail(message, path, "a node");
  if (parent >= 0) RC_TRY(link_of(tree, cg, id, path, &n, message));
  if (cgio_get_label(cg, id, n.label)) {
    if (!n.is_link) return adf_fail(message, path, n.name);
    n.is_dead  = true;
    n.label[0] = 0;
  }
  if (!n.is_dead) RC_TRY(payload(tree, cg, id, path, &n, message));
  me = rc_tree_add(tree, parent, &n);
  if (me < 0) return rc_no_memory(message);
  if (n.is_dead) return RCGNS_OK;
  if (cgio_number_children(cg, id, &children) || children < 0) return adf_fail(message, path, n.name);
  if (!children) return RCGNS_OK;
  ids = ra_alloc(children, sizeof *ids);
  if (!ids) return rc_no_memory(message);
  if (cgio_children_ids(cg, id, 1, children, &got, ids)) status = adf_fail(message, path, n.name);
  for (int i = 0; i < got; i++) {
    if (status == RCGNS_OK) status = walk(tree, cg, ids[i], me, depth + 1, path, message);
    cgio_release_id(cg, ids[i]);
  }
  free(ids);
  return status;
}

rcgns_status rc_adf_walk(rc_tree *tree, rcgns_message *message)
{
  char        *path = strdup(rc_text(tree, rc_source_at(tree, 0)->path)); /* the pool moves while it grows */
  int          cg;
  double       root;
  rcgns_status status = RCGNS_OK;

  if (!path) return rc_no_memory(message);
  if (cgio_open_file(path, CGIO_MODE_READ, CGIO_FILE_NONE, &cg)) {
    status = adf_fail(message, path, "the head");
  } else {
    status = cgio_get_root_id(cg, &root) ? adf_fail(message, path, "the root") : walk(tree, cg, root, -1, 0, path, message);
    cgio_close_file(cg);
  }
  free(path);
  return status;
}

rcgns_status rc_adf_open(const char *path, int64_t *handle, rcgns_message *message)
{
  int cg;

  *handle = -1;
  if (cgio_open_file(path, CGIO_MODE_READ, CGIO_FILE_NONE, &cg)) return adf_fail(message, path, "the head");
  *handle = cg;
  return RCGNS_OK;
}

void rc_adf_close(int64_t handle) { cgio_close_file((int)handle); }

rcgns_status rc_adf_read(int64_t handle, const char *path, const char *type, const rc_box *box, int64_t lo, int64_t hi, char as,
                         void *out, rcgns_message *message)
{
  double       root, id;
  rcgns_status status;

  if (cgio_get_root_id((int)handle, &root) || cgio_get_node_id((int)handle, root, path, &id))
    return adf_fail(message, path, "a node");
  status = read_range((int)handle, id, path, type, box, lo, hi, as, out, message);
  cgio_release_id((int)handle, id);
  return status;
}
