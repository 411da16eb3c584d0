/* sids_write -- the plan of an output file: the target's tree with a solution put in.
 *
 * The plan is made from the tree alone, alike on all ranks. The file is written under another name beside OUTPUT and gets its
 * name when it is complete, so that OUTPUT is never half written; its space on disk is claimed before it is filled, so that a
 * full disk is found while one rank alone is at work. */
#include "cgns_private.h"

#include <errno.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

/* ---- plan --------------------------------------------------------------------------------------------------------- */

static int64_t add_entry(rc_plan *plan, const rc_entry *entry)
{
  if (!ra_reserve(&plan->entry, 1, sizeof *entry)) return -1;
  *rc_entry_at(plan, plan->entry.count) = *entry;
  return plan->entry.count++;
}

int64_t rc_plan_add(rc_plan *plan, int64_t parent, const char *name, const char *label, const char *type, int nd,
                    const int64_t *dim, char kind, const void *literal)
{
  rc_entry e = {.parent = parent, .kind = kind, .literal = literal};

  snprintf(e.name, sizeof e.name, "%s", name);
  snprintf(e.label, sizeof e.label, "%s", label);
  snprintf(e.type, sizeof e.type, "%s", type ? type : "MT");
  e.content = type && nd ? RC_LITERAL : RC_EMPTY;
  e.nd      = e.content == RC_LITERAL ? nd : 0;
  for (int d = 0; d < e.nd; d++) e.dim[d] = dim[d];
  return add_entry(plan, &e);
}

void rc_plan_drop(rc_plan *plan)
{
  for (int64_t i = 0; i < plan->entry.count; i++) {
    free(rc_entry_at(plan, i)->link_file);
    free(rc_entry_at(plan, i)->link_path);
  }
  ra_drop(&plan->entry);
}

/* What is put into which zones. */
typedef struct change {
  rcgns_file            *file;
  rc_plan               *plan;
  const char            *solution;
  int64_t                num_fields;
  const rcgns_new_field *fields;
  int64_t               *zone_of; /* [nodes of the tree] zone that is read, -1 */
  bool                  *touched; /* [nodes] it or something below it changes */
  rcgns_message         *message;
} change;

static int64_t find_solution(const change *c, int64_t zone)
{
  return rc_tree_find(&c->file->tree, c->file->zone[zone].node, -1, NULL, c->solution);
}

/* An absolute path for a file that a link in `holder` names. NULL: no memory. */
static char *absolute(const char *holder, const char *file)
{
  const char *slash = strrchr(holder, '/');
  char       *folder, *real, *path = NULL;
  size_t      size;

  if (*file == '/') return strdup(file);
  folder = slash ? strndup(holder, (size_t)(slash - holder) + 1) : strdup(".");
  real   = folder ? realpath(folder, NULL) : NULL;
  if (real) {
    size = strlen(real) + strlen(file) + 2;
    path = malloc(size);
    if (path) snprintf(path, size, "%s/%s", strcmp(real, "/") ? real : "", file);
  }
  free(folder);
  free(real);
  return path;
}

/* A link as it is, but for relative file names. */
static rcgns_status copy_link(change *c, int64_t node, int64_t parent)
{
  const rc_tree *tree   = &c->file->tree;
  const rc_node *n      = rc_node_at(tree, node);
  const int      from   = rc_node_at(tree, n->parent)->file;
  const char    *holder = rc_text(tree, rc_source_at(tree, from)->path), *file = rc_text(tree, n->link_file);
  const char    *name = strrchr(holder, '/');
  rc_entry       e    = {.parent = parent, .content = RC_LINK};

  memcpy(e.name, n->name, sizeof e.name);
  memcpy(e.label, n->label, sizeof e.label);
  e.link_path = strdup(rc_text(tree, n->link_path));
  e.link_file = *file ? absolute(holder, file) : from ? absolute(holder, name ? name + 1 : holder) : strdup("");
  if (e.link_path && e.link_file && add_entry(c->plan, &e) >= 0) return RCGNS_OK;
  free(e.link_path);
  free(e.link_file);
  return rc_no_memory(c->message);
}

/* A node alone with its payload; *at is its entry. */
static rcgns_status copy_payload(change *c, int64_t node, int64_t parent, int64_t *at)
{
  const rc_node *n = rc_node_at(&c->file->tree, node);
  rc_entry       e = {.parent = parent, .node = node, .kind = n->kind, .nd = n->nd};

  if (n->kind == '?')
    return rc_fail(c->message, RCGNS_IO, "%s: node %s holds values of a type (%s) that cannot be copied", c->file->path,
                   n->name, n->type);
  memcpy(e.name, n->name, sizeof e.name);
  memcpy(e.label, n->label, sizeof e.label);
  memcpy(e.type, n->type, sizeof e.type);
  for (int d = 0; d < n->nd; d++) e.dim[d] = n->dim[d];
  e.content = !n->kind ? RC_EMPTY : n->small >= 0 ? RC_LITERAL : RC_COPY;
  if (e.content == RC_LITERAL) e.literal = rc_text(&c->file->tree, n->small);
  *at = add_entry(c->plan, &e);
  return *at < 0 ? rc_no_memory(c->message) : RCGNS_OK;
}

static rcgns_status copy_node(change *c, int64_t node, int64_t parent);

static rcgns_status copy_children(change *c, int64_t node, int64_t parent)
{
  for (int64_t i = -1; (i = rc_tree_find(&c->file->tree, node, i, NULL, NULL)) >= 0;) RC_TRY(copy_node(c, i, parent));
  return RCGNS_OK;
}

/* The array of a field in a zone, its values to be filled in. */
static rcgns_status add_values(change *c, int64_t zone, int64_t field, int64_t parent, int64_t *at)
{
  const rc_zone *z = c->file->zone + zone;
  rc_entry e = {.parent = parent, .label = "DataArray_t", .type = "R8", .content = RC_VALUES, .zone = zone, .field = field};

  snprintf(e.name, sizeof e.name, "%s", c->fields[field].name);
  e.nd     = z->is_structured ? 3 : 1;
  e.dim[0] = z->num_cells;
  for (int d = 0; d < e.nd && z->is_structured; d++) e.dim[d] = z->cells[2 - d];
  *at = add_entry(c->plan, &e);
  return *at < 0 ? rc_no_memory(c->message) : RCGNS_OK;
}

static rcgns_status add_location(change *c, int64_t parent)
{
  const char   *text = c->file->location;
  const int64_t size = (int64_t)strlen(text);

  return rc_plan_add(c->plan, parent, "GridLocation", "GridLocation_t", "C1", 1, &size, 'C', text) < 0
             ? rc_no_memory(c->message)
             : RCGNS_OK;
}

/* An array that stays in a solution whose rind is taken away. */
static rcgns_status copy_core(change *c, int64_t zone, int64_t node, const int64_t *rind, int64_t parent)
{
  const rc_zone *z  = c->file->zone + zone;
  const rc_node *n  = rc_node_at(&c->file->tree, node);
  const int      nd = z->is_structured ? 3 : 1;
  int64_t        at, shape[3];
  bool           fits = n->nd == nd;
  rc_entry      *e;

  RC_TRY(copy_payload(c, node, parent, &at));
  e = rc_entry_at(c->plan, at);
  for (int d = 0; d < nd && fits; d++) {
    const int64_t cells = z->is_structured ? z->cells[d] : z->num_cells;

    fits              = n->dim[nd - 1 - d] == cells + rind[2 * d] + rind[2 * d + 1];
    shape[nd - 1 - d] = cells;
  }
  for (int d = 0; d < nd && fits; d++) {
    e->content   = RC_COPY;
    e->dim[d]    = shape[d];
    e->origin[d] = rind[2 * (nd - 1 - d)];
  }
  return copy_children(c, node, at);
}

static int64_t field_named(const change *c, const char *name)
{
  for (int64_t f = 0; f < c->num_fields; f++)
    if (!strcmp(c->fields[f].name, name)) return f;
  return -1;
}

/* A solution that the target has: fields are replaced, the rest stays, rind goes. */
static rcgns_status change_solution(change *c, int64_t zone, int64_t node, int64_t parent)
{
  const rc_tree *tree    = &c->file->tree;
  bool          *written = calloc((size_t)c->num_fields + 1, sizeof *written);
  const int      nd      = c->file->zone[zone].is_structured ? 3 : 1;
  int64_t        rind[6], at, array;
  bool           located = false;
  rcgns_status   status  = written ? RCGNS_OK : rc_no_memory(c->message);

  if (status == RCGNS_OK && !rc_rind(tree, node, nd, rind))
    status = rc_fail(c->message, RCGNS_IO, "%s: zone %s: the Rind of solution %s is malformed", c->file->path,
                     c->file->zone[zone].name, c->solution);
  if (status == RCGNS_OK) status = copy_payload(c, node, parent, &at);
  for (int64_t i = -1; status == RCGNS_OK && (i = rc_tree_find(tree, node, i, NULL, NULL)) >= 0;) {
    const rc_node *n = rc_node_at(tree, i);
    const int64_t  f = field_named(c, n->name);

    if (!strcmp(n->label, "Rind_t")) continue;
    located = located || !strcmp(n->label, "GridLocation_t");
    if (f >= 0) {
      written[f] = true;
      status     = add_values(c, zone, f, at, &array);
      if (status == RCGNS_OK) status = copy_children(c, i, array);
    } else if (!strcmp(n->label, "DataArray_t") && n->kind) {
      status = copy_core(c, zone, i, rind, at);
    } else {
      status = copy_node(c, i, at);
    }
  }
  if (status == RCGNS_OK && !located) status = add_location(c, at);
  for (int64_t f = 0; f < c->num_fields && status == RCGNS_OK; f++)
    if (!written[f]) status = add_values(c, zone, f, at, &array);
  free(written);
  return status;
}

static rcgns_status new_solution(change *c, int64_t zone, int64_t parent)
{
  const int64_t at = rc_plan_add(c->plan, parent, c->solution, "FlowSolution_t", NULL, 0, NULL, 0, NULL);
  int64_t       array;

  if (at < 0) return rc_no_memory(c->message);
  RC_TRY(add_location(c, at));
  for (int64_t f = 0; f < c->num_fields; f++) RC_TRY(add_values(c, zone, f, at, &array));
  return RCGNS_OK;
}

/* A node and what is below it. Links stay links unless something below them changes; those of ADF files are replaced by what
 * they lead to, since HDF5 cannot link to ADF. */
static rcgns_status copy_node(change *c, int64_t node, int64_t parent)
{
  const rc_tree *tree = &c->file->tree;
  const rc_node *n    = rc_node_at(tree, node);
  const int64_t  zone = c->zone_of[node];
  int64_t        at, solution;

  if (n->is_link && (n->is_dead || (!c->touched[node] && !rc_source_at(tree, n->file)->is_adf)))
    return copy_link(c, node, parent);
  RC_TRY(copy_payload(c, node, parent, &at));
  if (zone < 0) return copy_children(c, node, at);
  solution = find_solution(c, zone);
  for (int64_t i = -1; (i = rc_tree_find(tree, node, i, NULL, NULL)) >= 0;)
    RC_TRY(i == solution ? change_solution(c, zone, i, at) : copy_node(c, i, at));
  return solution < 0 ? new_solution(c, zone, at) : RCGNS_OK;
}

/* May the node of that name take fields of the file's location? */
static rcgns_status check_solution(const change *c, int64_t zone)
{
  const rc_tree *tree  = &c->file->tree;
  const int64_t  node  = find_solution(c, zone);
  const char    *where = c->file->zone[zone].name;
  char           location[RC_NAME];
  bool           empty = true;

  if (node < 0) return RCGNS_OK;
  if (rc_node_at(tree, node)->is_dead || strcmp(rc_node_at(tree, node)->label, "FlowSolution_t"))
    return rc_fail(c->message, RCGNS_USAGE, "%s: zone %s: its node %s is no solution: choose another name (--output-solution)",
                   c->file->path, where, c->solution);
  rc_tree_string(tree, rc_tree_find(tree, node, -1, "GridLocation_t", NULL), location, sizeof location);
  for (int64_t i = -1; (i = rc_tree_find(tree, node, i, "DataArray_t", NULL)) >= 0;)
    empty = empty && !rc_node_at(tree, i)->kind;
  if ((*location || !empty) && strcmp(*location ? location : "Vertex", c->file->location))
    return rc_fail(c->message, RCGNS_USAGE,
                   "%s: zone %s: its solution %s is %s-located: choose another name (--output-solution)", c->file->path, where,
                   c->solution, *location ? location : "Vertex");
  if (rc_tree_find(tree, node, -1, NULL, "PointList") >= 0 || rc_tree_find(tree, node, -1, NULL, "PointRange") >= 0)
    return rc_fail(c->message, RCGNS_USAGE,
                   "%s: zone %s: its solution %s covers a part of the zone: choose another name (--output-solution)",
                   c->file->path, where, c->solution);
  return RCGNS_OK;
}

bool rc_is_name(const char *name)
{
  const size_t n = name ? strlen(name) : 0;

  return n >= 1 && n < RC_NAME && *name != ' ' && !strchr(name, '/') && strcmp(name, ".") && strcmp(name, "..");
}

static rcgns_status check_names(const change *c)
{
  if (!rc_is_name(c->solution))
    return rc_fail(c->message, RCGNS_USAGE, "\"%.64s\" is no name for a solution: 1 to 32 characters without /",
                   c->solution ? c->solution : "");
  for (int64_t f = 0; f < c->num_fields; f++) {
    if (!rc_is_name(c->fields[f].name))
      return rc_fail(c->message, RCGNS_USAGE, "\"%.64s\" is no name for a field: 1 to 32 characters without /",
                     c->fields[f].name);
    for (int64_t g = 0; g < f; g++)
      if (!strcmp(c->fields[f].name, c->fields[g].name))
        return rc_fail(c->message, RCGNS_USAGE, "field %s is given twice", c->fields[f].name);
  }
  for (int64_t z = 0; z < c->file->num_zones; z++) RC_TRY(check_solution(c, z));
  return RCGNS_OK;
}

static rcgns_status make_plan(change *c)
{
  const rc_tree *tree   = &c->file->tree;
  rcgns_status   status = check_names(c);

  if (status != RCGNS_OK) return status;
  c->zone_of = ra_alloc(tree->node.count, sizeof *c->zone_of);
  c->touched = calloc((size_t)tree->node.count, sizeof *c->touched);
  if (!c->zone_of || !c->touched) status = rc_no_memory(c->message);
  for (int64_t i = 0; i < tree->node.count && status == RCGNS_OK; i++) c->zone_of[i] = -1;
  for (int64_t z = 0; z < c->file->num_zones && status == RCGNS_OK; z++) {
    const rc_zone *zone = c->file->zone + z;
    const int64_t  at   = find_solution(c, z);

    c->zone_of[zone->node] = z;
    c->touched[zone->node] = c->touched[zone->base] = true;
    if (at >= 0) c->touched[at] = true;
  }
  if (status == RCGNS_OK) status = copy_children(c, 0, -1);
  free(c->zone_of);
  free(c->touched);
  return status;
}

/* ---- the file ----------------------------------------------------------------------------------------------------- */

/* Rank 0 alone. */
static rcgns_status check_path(const rcgns_file *file, const char *path, rcgns_message *message)
{
  const char  *slash  = strrchr(path, '/');
  char        *folder = slash == path ? strdup("/") : slash ? strndup(path, (size_t)(slash - path)) : strdup(".");
  struct stat  st;
  rcgns_status status = RCGNS_OK;

  if (!folder) return rc_no_memory(message);
  if (!stat(path, &st)) {
    if (!S_ISREG(st.st_mode))
      status = rc_fail(message, RCGNS_IO, "%s: it exists and is not a regular file: choose another output", path);
    for (int64_t i = 0; i < file->tree.source.count && status == RCGNS_OK; i++) {
      const rc_source *source = rc_source_at(&file->tree, i);

      if (source->device == (int64_t)st.st_dev && source->inode == (int64_t)st.st_ino)
        status = rc_fail(message, RCGNS_USAGE, "%s: it is one of the input files: choose another output", path);
    }
  } else if (errno != ENOENT) {
    status = rc_fail(message, RCGNS_IO, "%s: %s: choose another output", path, strerror(errno));
  }
  if (status == RCGNS_OK && rslice_file_check(path))
    status = rc_fail(message, RCGNS_IO, "%s: it may not be written (%s): remove it, or choose another output", path,
                     strerror(rslice_file_check(path)));
  if (status == RCGNS_OK && slash && !slash[1]) status = rc_fail(message, RCGNS_IO, "%s: it is a folder: give a file", path);
  if (status == RCGNS_OK && access(folder, W_OK | X_OK))
    status = rc_fail(message, RCGNS_IO, "%s: its folder cannot be written (%s): choose another output", path, strerror(errno));
  free(folder);
  return status;
}

rcgns_status rcgns_check_output(const rcgns_file *file, const char *path, rcgns_message *message)
{
  return rc_agree(file->comm, file->rank == 0 ? check_path(file, path, message) : RCGNS_OK, message);
}

rcgns_status rcgns_check_solution(rcgns_file *file, const char *solution, rcgns_message *message)
{
  const change c = {.file = file, .solution = solution, .message = message};

  return rc_agree(file->comm, check_names(&c), message);
}

static rcgns_status cannot_write(const char *path, int error, rcgns_message *message)
{
  return error ? rc_fail(message, RCGNS_IO, "%s: cannot be written: %s", path, strerror(error)) : RCGNS_OK;
}

rcgns_status rc_begin(const rc_plan *plan, const char *path, char *part, size_t size, rcgns_message *message)
{
  rcgns_message why = {""};

  RC_TRY(cannot_write(path, rslice_file_begin(path, part, size), message));
  const rcgns_status status = rc_h5_skeleton(part, plan, &why);
  return status == RCGNS_OK ? status : rc_fail(message, status, "%s: %.900s", path, why.text);
}

rcgns_status rc_finish(const char *part, const char *path, rcgns_message *message)
{
  return cannot_write(path, rslice_file_finish(part, path), message);
}

rcgns_status rc_write_plan(rcgns_file *file, const rc_plan *plan, const char *path, const rcgns_new_field *fields,
                           rcgns_message *message)
{
  char          part[PATH_MAX] = "";
  rcgns_message why            = {""};
  rcgns_status  status         = file->rank == 0 ? rc_begin(plan, path, part, sizeof part, message) : RCGNS_OK;

  status = rc_agree(file->comm, status, message);
  if (status == RCGNS_OK) {
    MPI_Bcast(part, (int)sizeof part, MPI_CHAR, 0, file->comm);
    status = rc_h5_fill(file, part, plan, fields, &why);
    if (status != RCGNS_OK) rc_fail(message, status, "%s: %.900s", path, why.text);
  }
  if (status == RCGNS_OK) status = rc_agree(file->comm, file->rank == 0 ? rc_finish(part, path, message) : RCGNS_OK, message);
  if (status != RCGNS_OK && file->rank == 0 && *part) unlink(part);
  return status;
}

rcgns_status rcgns_write(rcgns_file *file, const char *path, const char *solution, int64_t num_fields,
                         const rcgns_new_field *fields, rcgns_message *message)
{
  rc_plan plan = {.entry = {.item = NULL}};
  change  c    = {
          .file = file, .plan = &plan, .solution = solution, .num_fields = num_fields, .fields = fields, .message = message};
  rcgns_status status;

  status = rcgns_check_output(file, path, message);
  if (status == RCGNS_OK) status = rc_agree(file->comm, make_plan(&c), message);
  if (status == RCGNS_OK) status = rc_write_plan(file, &plan, path, fields, message);
  rc_plan_drop(&plan);
  return rc_name_file(path, status, message);
}
