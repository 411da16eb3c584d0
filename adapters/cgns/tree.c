/* tree -- the tree of a CGNS file as plain data, the same on every rank.
 *
 * Rank 0 reads it once; small payloads (sizes, names, ranges, pointers) travel with it, so that everything but the large
 * arrays is known to all ranks without touching the file again. About 250 bytes for each node. */
#include "cgns_private.h"

#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

enum { MAX_SOURCES = 10000, SMALL_VALUES = 512, SMALL_TEXT = 1 << 20 };

int rc_width(const char *type)
{
  switch (type[0]) {
    case 'C':
    case 'B': return 1;
    case 'I':
    case 'U':
    case 'R': return type[1] - '0';
    default: return 0;
  }
}

int64_t rc_count(const rc_node *node)
{
  int64_t count = node->kind ? 1 : 0;

  for (int d = 0; d < node->nd && node->kind; d++)
    if (node->dim[d] < 0 || __builtin_mul_overflow(count, node->dim[d], &count)) return -1;
  return count;
}

bool rc_is_small(const rc_node *node)
{
  const int64_t count = rc_count(node);

  if (count < 1) return false;
  return node->kind == 'C' ? count <= SMALL_TEXT : (node->kind == 'I' || node->kind == 'R') && count <= SMALL_VALUES;
}

int64_t rc_tree_store(rc_tree *tree, const void *bytes, int64_t count)
{
  static const char zero[8] = {0};
  const int64_t     at      = (tree->pool.count + 7) / 8 * 8;

  if (!ra_reserve(&tree->pool, at - tree->pool.count + count, 1)) return -1;
  memcpy((char *)tree->pool.item + tree->pool.count, zero, (size_t)(at - tree->pool.count));
  memcpy((char *)tree->pool.item + at, bytes, (size_t)count);
  tree->pool.count = at + count;
  return at;
}

int64_t rc_tree_add(rc_tree *tree, int64_t parent, const rc_node *node)
{
  const int64_t at = tree->node.count;
  rc_node      *mine;

  if (!ra_reserve(&tree->node, 1, sizeof *node)) return -1;
  mine         = rc_node_at(tree, at);
  *mine        = *node;
  mine->parent = parent;
  mine->child = mine->last = mine->next = -1;
  tree->node.count++;
  if (parent >= 0) {
    rc_node *up = rc_node_at(tree, parent);

    if (up->last < 0)
      up->child = at;
    else
      rc_node_at(tree, up->last)->next = at;
    up->last = at;
  }
  return at;
}

int rc_tree_source(rc_tree *tree, const char *path, bool is_adf)
{
  struct stat st;
  rc_source   source = {.is_adf = is_adf};

  if (tree->source.count >= MAX_SOURCES || stat(path, &st)) return -2;
  source.size   = (int64_t)st.st_size;
  source.device = (int64_t)st.st_dev;
  source.inode  = (int64_t)st.st_ino;
  source.path   = rc_tree_store(tree, path, (int64_t)strlen(path) + 1);
  if (source.path < 0 || !ra_reserve(&tree->source, 1, sizeof source)) return -1;
  *rc_source_at(tree, tree->source.count) = source;
  return (int)tree->source.count++;
}

char *rc_tree_path(const rc_tree *tree, int64_t node)
{
  const char *anchor = "";
  size_t      length = 0;
  char       *path;
  int64_t     top = node;

  for (; top > 0 && rc_node_at(tree, top)->anchor < 0; top = rc_node_at(tree, top)->parent)
    length += strlen(rc_node_at(tree, top)->name) + 1;
  if (top > 0) anchor = rc_text(tree, rc_node_at(tree, top)->anchor);
  length += strlen(anchor);
  path = malloc(length + 2);
  if (!path) return NULL;
  memcpy(path, anchor, strlen(anchor));
  path[length] = 0;
  for (size_t end = length; node != top; node = rc_node_at(tree, node)->parent) {
    const char  *name = rc_node_at(tree, node)->name;
    const size_t n    = strlen(name);

    end -= n;
    memcpy(path + end, name, n);
    path[--end] = '/';
  }
  if (!length) strcpy(path, "/");
  return path;
}

int64_t rc_tree_find(const rc_tree *tree, int64_t parent, int64_t after, const char *label, const char *name)
{
  int64_t i = after < 0 ? rc_node_at(tree, parent)->child : rc_node_at(tree, after)->next;

  for (; i >= 0; i = rc_node_at(tree, i)->next) {
    const rc_node *n = rc_node_at(tree, i);

    if ((!label || !strcmp(n->label, label)) && (!name || !strcmp(n->name, name))) return i;
  }
  return -1;
}

void rc_tree_string(const rc_tree *tree, int64_t node, char *out, size_t size)
{
  const rc_node *n     = node < 0 ? NULL : rc_node_at(tree, node);
  const char    *text  = n && n->kind == 'C' && n->small >= 0 ? rc_text(tree, n->small) : "";
  size_t         count = *text ? strnlen(text, (size_t)rc_count(n)) : 0;

  while (count && text[count - 1] == ' ') count--;
  while (count && *text == ' ') text++, count--;
  if (count >= size) count = size - 1;
  memcpy(out, text, count);
  out[count] = 0;
}

rcgns_status rc_tree_bcast(MPI_Comm comm, rc_tree *tree, rcgns_message *message)
{
  int64_t      count[3] = {tree->node.count, tree->source.count, tree->pool.count};
  rcgns_status status   = RCGNS_OK;
  int          rank;

  MPI_Comm_rank(comm, &rank);
  rc_bcast(comm, count, (int64_t)sizeof count);
  if (rank && !(ra_reserve(&tree->node, count[0], sizeof(rc_node)) && ra_reserve(&tree->source, count[1], sizeof(rc_source)) &&
                ra_reserve(&tree->pool, count[2], 1)))
    status = rc_no_memory(message);
  RC_TRY(rc_agree(comm, status, message));
  tree->node.count   = count[0];
  tree->source.count = count[1];
  tree->pool.count   = count[2];
  rc_bcast(comm, tree->node.item, count[0] * (int64_t)sizeof(rc_node));
  rc_bcast(comm, tree->source.item, count[1] * (int64_t)sizeof(rc_source));
  rc_bcast(comm, tree->pool.item, count[2]);
  return RCGNS_OK;
}

void rc_tree_drop(rc_tree *tree)
{
  ra_drop(&tree->node);
  ra_drop(&tree->source);
  ra_drop(&tree->pool);
}

/* ---- boxes -------------------------------------------------------------------------------------------------------- */

rc_box rc_whole(const rc_node *node)
{
  rc_box box = {.nd = node->nd};

  for (int d = 0; d < node->nd; d++) box.shape[d] = node->dim[d];
  return box;
}

int64_t rc_box_count(const rc_box *box)
{
  int64_t count = 1;

  for (int d = 0; d < box->nd; d++) count *= box->shape[d];
  return count;
}

int rc_box_cut(const rc_box *box, int64_t lo, int64_t hi, rc_box *part)
{
  int64_t stride[RC_MAX_DIMS];
  int     n = 0;

  for (int64_t d = box->nd - 1, s = 1; d >= 0; s *= box->shape[d--]) stride[d] = s;
  for (int64_t at = lo, len; at < hi; at += len) {
    rc_box *p    = part + n++;
    int64_t rest = at;
    int     d    = 0;

    while (at % stride[d] || at + stride[d] > hi) d++; /* the slowest dimension with a whole row ahead */
    *p = *box;
    for (int e = 0; e < box->nd; rest %= stride[e++]) {
      const int64_t index = rest / stride[e];

      p->origin[e] += index;
      if (e < d) p->shape[e] = 1;
      if (e == d) p->shape[e] = (hi - at) / stride[e] < box->shape[e] - index ? (hi - at) / stride[e] : box->shape[e] - index;
    }
    len = p->shape[d] * stride[d];
  }
  return n;
}
