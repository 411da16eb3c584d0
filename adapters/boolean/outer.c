/* outer -- the outer surface of the result as STL or OBJ, in the order of its faces' numbers, group after group: each rank
 * makes the text of its slice of the faces, and of the nodes, and writes it where it belongs. No rank has more than its slices,
 * and the bytes do not depend on the number of ranks. Linear in the slices, but for sorting of nodes. */
#include "boolean.h"

#include <base.h>
#include <errno.h>
#include <limits.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { HEAD = 2, CORNER = 4 }; /* words of a face before its corners, {corners, group}; of a corner, {node, x, y, z} */
enum { NODES = 0 };            /* the first part of the file */

typedef struct outer {
  MPI_Comm              comm;
  int                   rank, size;
  const char           *path;
  const rslice_content *content;
  bool                  is_stl;
  int                   num_parts; /* of the file: nodes, then groups; the last group is that of faces on no boundary */
  rslice_rows           faces, nodes;
  rsurf_surface         triangles; /* of the faces, for STL */
  int64_t              *number;    /* nodes of the corners in `faces`, one after the other, as the file counts them */
  char                 *text;      /* [part_at[num_parts]] of this rank, part after part */
  int64_t              *part_at;   /* [num_parts + 1] */
} outer;

static const char *group_name(const outer *o, int part)
{
  return part <= o->content->num_boundaries ? o->content->boundary_name[part - 1] : "unnamed";
}

static rslice_status from_surface(rsurf_status status) { return status == RSURF_OK ? RSLICE_OK : RSLICE_MEMORY; }

/* ---- slices -------------------------------------------------------------------------------------------------------- */

/* Rows of the outer faces; all others have none. offset is [faces + 1]. */
static bool list_faces(const rslice_content *content, int64_t *offset, int64_t **word)
{
  const remap_supermesh_view *m     = content->mesh;
  uint8_t                    *inner = calloc((size_t)m->num_faces + 1, 1);
  int64_t                     at    = 0;

  for (int64_t i = 0; inner && i < m->num_beyond; i++) inner[m->beyond_face[i]] = 1;
  for (int64_t f = 0; inner && f < m->num_faces; f++) {
    inner[f] |= m->face_neighbour[f] >= 0;
    offset[f + 1] = offset[f] + (inner[f] ? 0 : HEAD + CORNER * (m->face_offset[f + 1] - m->face_offset[f]));
  }
  *word = inner ? ra_zeros(offset[m->num_faces], sizeof **word) : NULL;
  for (int64_t f = 0; *word && f < m->num_faces; f++) {
    const int32_t *loop = m->face_node + m->face_offset[f];
    const int64_t  n    = m->face_offset[f + 1] - m->face_offset[f];
    int64_t        low  = 0;

    if (inner[f]) continue;
    (*word)[at++] = n;
    (*word)[at++] = content->num_boundaries;
    if (content->num_boundaries && content->face_boundary[f] >= 0) (*word)[at - 1] = content->face_boundary[f];
    for (int64_t i = 1; i < n; i++)
      if (m->node_global[loop[i]] < m->node_global[loop[low]]) low = i;
    for (int64_t i = 0; i < n; i++, at += CORNER) {
      const int32_t node = loop[(low + i) % n];

      (*word)[at] = m->node_global[node];
      memcpy(*word + at + 1, m->node_xyz + 3 * (int64_t)node, 3 * sizeof(double));
    }
  }
  free(inner);
  return *word != NULL;
}

static rslice_status ship_faces(outer *o)
{
  const remap_supermesh_view *m      = o->content->mesh;
  int64_t                    *offset = ra_zeros(m->num_faces + 1, sizeof *offset), *word = NULL;
  rslice_status               status = offset && list_faces(o->content, offset, &word) ? RSLICE_OK : RSLICE_MEMORY;

  status = rslice_ship(o->comm, status, m->global_faces, m->num_faces, m->face_global, offset, word, &o->faces);
  free(offset);
  free(word);
  return status;
}

/* ---- nodes of OBJ -------------------------------------------------------------------------------------------------- */

static int by_number(const void *a, const void *b)
{
  const int64_t x = *(const int64_t *)a, y = *(const int64_t *)b;
  return (x > y) - (x < y);
}

/* Nodes of this rank's faces, ascending, each once; how many of each rank's slice. */
static int64_t *list_nodes(const outer *o, int64_t *num, int64_t *count)
{
  const int64_t words = o->faces.offset[o->faces.num];
  int64_t      *node  = ra_zeros(words / CORNER, sizeof *node), n = 0;

  *num = 0;
  for (int64_t at = 0; node && at < words; at += HEAD + CORNER * o->faces.word[at])
    for (int64_t i = 0; i < o->faces.word[at]; i++) node[n++] = o->faces.word[at + HEAD + CORNER * i];
  if (node) qsort(node, (size_t)n, sizeof *node, by_number);
  for (int64_t i = 0, r = 0; node && i < n; i++) {
    if (*num && node[*num - 1] == node[i]) continue;
    while (node[i] >= ra_share(o->content->mesh->global_nodes, (int)r + 1, o->size)) r++;
    count[r]++;
    node[(*num)++] = node[i];
  }
  return node;
}

/* Nodes of this rank's slice that are asked for get numbers, from those of the ranks before on, which become the answers;
 * others lose their words. Collective. */
static rslice_status answer(outer *o, rslice_status mine, int64_t num, int64_t *asked)
{
  int64_t *number = mine == RSLICE_OK ? ra_zeros(o->nodes.num, sizeof *number) : NULL, before = 0, used = 0;

  for (int64_t i = 0; number && i < num; i++) number[asked[i] - o->nodes.first] = 1;
  for (int64_t i = 0; number && i < o->nodes.num; i++) used += number[i];
  MPI_Exscan(&used, &before, 1, MPI_INT64_T, MPI_SUM, o->comm);
  if (o->rank == 0) before = 0;
  for (int64_t i = 0; number && i < o->nodes.num; i++) {
    if (!number[i]) o->nodes.word[3 * i] = -1; /* as bits: a NaN, which no coordinate is */
    number[i] = number[i] ? before++ : -1;
  }
  for (int64_t i = 0; number && i < num; i++) asked[i] = number[asked[i] - o->nodes.first];
  free(number);
  return mine == RSLICE_OK && !number ? RSLICE_MEMORY : mine;
}

/* Numbers of the corners of this rank's faces. */
static bool number_corners(outer *o, int64_t num, const int64_t *node, const int64_t *number)
{
  const int64_t words = o->faces.offset[o->faces.num];
  int64_t       n     = 0;

  o->number = ra_zeros(words / CORNER, sizeof *o->number);
  for (int64_t at = 0; o->number && at < words; at += HEAD + CORNER * o->faces.word[at])
    for (int64_t i = 0; i < o->faces.word[at]; i++) {
      const int64_t *found = bsearch(&o->faces.word[at + HEAD + CORNER * i], node, (size_t)num, sizeof *node, by_number);

      o->number[n++] = number[found - node];
    }
  return o->number != NULL;
}

/* Which nodes are written, and under which numbers. Collective. */
static rslice_status number_nodes(outer *o)
{
  int64_t      *count  = ra_zeros(2 * (int64_t)o->size, sizeof *count), num = 0, num_asked = 0;
  int64_t      *node   = count ? list_nodes(o, &num, count) : NULL;
  void         *asked  = NULL, *number = NULL;
  rslice_status status = rslice_nodes(o->comm, o->content->mesh, &o->nodes);

  if (status == RSLICE_OK && !node) status = RSLICE_MEMORY;
  status = rslice_exchange(o->comm, status, RSLICE_CHUNK, sizeof *node, count, node, count ? count + o->size : NULL, &asked);
  for (int r = 0; r < o->size && status == RSLICE_OK; r++) num_asked += count[o->size + r];
  status = answer(o, status, num_asked, asked);
  status = rslice_exchange(o->comm, status, RSLICE_CHUNK, sizeof *node, count ? count + o->size : NULL, asked, count, &number);
  if (status == RSLICE_OK && !number_corners(o, num, node, number)) status = RSLICE_MEMORY;
  free(count);
  free(node);
  free(asked);
  free(number);
  return rslice_agree(o->comm, status);
}

/* ---- triangles of STL ---------------------------------------------------------------------------------------------- */

/* The faces of this rank as triangles. */
static rslice_status triangulate(outer *o)
{
  const int64_t  words     = o->faces.offset[o->faces.num];
  const char   **name      = ra_zeros(o->num_parts, sizeof *name);
  double        *xyz       = NULL;
  rsurf_builder *builder   = NULL;
  int64_t        most      = 0;
  rsurf_message  message;
  rslice_status  status = name ? RSLICE_OK : RSLICE_MEMORY;

  for (int64_t at = 0; at < words; at += HEAD + CORNER * o->faces.word[at])
    if (o->faces.word[at] > most) most = o->faces.word[at];
  if (status == RSLICE_OK && !(xyz = ra_zeros(3 * most, sizeof *xyz))) status = RSLICE_MEMORY;
  for (int part = 1; name && part < o->num_parts; part++) name[part - 1] = group_name(o, part);
  if (status == RSLICE_OK) status = from_surface(rsurf_begin(o->num_parts - 1, name, &builder, &message));
  for (int64_t at = 0; at < words && status == RSLICE_OK; at += HEAD + CORNER * o->faces.word[at]) {
    const int64_t *row = o->faces.word + at;

    for (int64_t i = 0; i < row[0]; i++) memcpy(xyz + 3 * i, row + HEAD + CORNER * i + 1, 3 * sizeof *xyz);
    status = from_surface(rsurf_add(builder, xyz, row[0], (int32_t)row[1], &message));
  }
  rsurf_end(&builder, &o->triangles);
  if (status == RSLICE_OK) status = from_surface(rsurf_triangulate(&o->triangles, &message));
  free(name);
  free(xyz);
  return status;
}

/* ---- text ---------------------------------------------------------------------------------------------------------- */

/* What is printed: triangles, or rows of faces. */
typedef struct item {
  int32_t group;
  int64_t number; /* triangle; place of the row in the words, and of its first corner */
  int64_t corner;
} item;

static int64_t list_items(const outer *o, item *list)
{
  const int64_t words = o->faces.offset[o->faces.num];
  int64_t       n     = 0, corner = 0;

  if (o->is_stl) {
    for (; n < o->triangles.num_faces; n++)
      if (list) list[n] = (item){o->triangles.face_group[n], n, 0};
    return n;
  }
  for (int64_t at = 0; at < words; corner += o->faces.word[at], at += HEAD + CORNER * o->faces.word[at], n++)
    if (list) list[n] = (item){(int32_t)o->faces.word[at + 1], at, corner};
  return n;
}

/* The items by their groups, each group's in their order; first is [num_parts + 1], by parts. */
static item *sort_items(const outer *o, int64_t *first)
{
  const int64_t n      = list_items(o, NULL);
  item         *list   = ra_zeros(2 * n, sizeof *list), *sorted = list ? list + n : NULL;

  if (!list) return NULL;
  list_items(o, list);
  for (int64_t i = 0; i < n; i++) first[list[i].group + 2]++;
  for (int part = 1; part <= o->num_parts; part++) first[part] += first[part - 1];
  for (int64_t i = 0; i < n; i++) sorted[first[list[i].group + 1]++] = list[i];
  memmove(list, sorted, (size_t)n * sizeof *list);
  memmove(first + 1, first, (size_t)o->num_parts * sizeof *first);
  first[0] = first[1] = 0;
  return list;
}

static void print_item(const outer *o, FILE *out, const item *x)
{
  const int64_t *node = o->is_stl ? o->triangles.face_node + o->triangles.face_offset[x->number] : NULL;
  const double  *corner[3];

  for (int v = 0; node && v < 3; v++) corner[v] = o->triangles.node_xyz + 3 * node[v];
  if (node) rsurf_print_facet(out, corner);
  else rsurf_print_polygon(out, o->faces.word[x->number], o->number + x->corner);
}

static void print_nodes(const outer *o, FILE *out)
{
  for (int64_t i = 0; i < o->nodes.num && !o->is_stl; i++) {
    double xyz[3];

    memcpy(xyz, o->nodes.word + 3 * i, sizeof xyz);
    if (o->nodes.word[3 * i] != -1) rsurf_print_node(out, xyz);
  }
}

/* All of this rank's text. */
static rslice_status print_parts(outer *o)
{
  int64_t *first = ra_zeros(o->num_parts + 2, sizeof *first);
  item    *list  = first ? sort_items(o, first) : NULL;
  size_t   size  = 0;
  FILE    *out   = list ? open_memstream(&o->text, &size) : NULL;
  bool     ok    = out != NULL;

  o->part_at = ra_zeros(o->num_parts + 1, sizeof *o->part_at);
  for (int part = 0; ok && o->part_at && part < o->num_parts; part++) {
    if (part == NODES) print_nodes(o, out);
    for (int64_t i = first[part]; i < first[part + 1]; i++) print_item(o, out, &list[i]);
    ok                   = !fflush(out) && !ferror(out);
    o->part_at[part + 1] = (int64_t)ftello(out);
  }
  if (out && fclose(out)) ok = false;
  free(first);
  free(list);
  return ok && o->part_at ? RSLICE_OK : RSLICE_MEMORY;
}

/* ---- the file ------------------------------------------------------------------------------------------------------ */

/* Where the parts of the file are. */
typedef struct layout {
  int64_t *size, *before; /* [num_parts] of all ranks, of the ranks before */
  int64_t  bytes;
} layout;

/* The words around a group; how many bytes. */
static int frame_of(const outer *o, int part, bool end, char **text)
{
  size_t size = 0;
  FILE  *out  = open_memstream(text, &size);

  if (!out) return -1;
  (end ? rsurf_print_foot : rsurf_print_head)(out, o->is_stl, group_name(o, part));
  return fclose(out) ? -1 : (int)size;
}

static bool write_bytes(MPI_File file, int64_t at, const char *text, int64_t bytes)
{
  for (int64_t lo = 0, n; lo < bytes; lo += n) {
    MPI_Status status;
    int        written = 0;

    n = bytes - lo < RSLICE_CHUNK ? bytes - lo : RSLICE_CHUNK;
    if (MPI_File_write_at(file, at + lo, text + lo, (int)n, MPI_BYTE, &status)) return false;
    if (MPI_Get_count(&status, MPI_BYTE, &written) || written != (int)n) return false;
  }
  return true;
}

/* Head, faces and foot of all groups that have faces, after the nodes; with no file only bytes are counted. */
static bool write_parts(const outer *o, layout *l, MPI_File *file)
{
  bool ok = true;

  l->bytes = 0;
  for (int part = 0; part < o->num_parts; part++)
    for (int end = 0; end < 2 && l->size[part]; end++) {
      char     *frame = NULL;
      const int n     = part == NODES ? 0 : frame_of(o, part, end, &frame);

      ok = ok && n >= 0;
      if (ok && file && o->rank == 0) ok = write_bytes(*file, l->bytes, frame, n);
      l->bytes += n;
      free(frame);
      if (end) continue;
      const int64_t mine = o->part_at[part + 1] - o->part_at[part];
      if (ok && file) ok = write_bytes(*file, l->bytes + l->before[part], o->text + o->part_at[part], mine);
      l->bytes += l->size[part];
    }
  return ok;
}

static cli_exit cannot_write(const char *path, int error, cli_failure *why)
{
  return cli_fail(why, CLI_IO, "%s: it cannot be written: %s", path, error ? strerror(error) : "is the disk full?");
}

/* Rank 0 alone. */
static cli_exit begin(const outer *o, int64_t bytes, char *part, size_t size, cli_failure *why)
{
  int error = rslice_file_begin(o->path, part, size);

  if (!error) error = rslice_file_claim(part, bytes);
  return error ? cannot_write(o->path, error, why) : CLI_DONE;
}

static cli_exit finish(const outer *o, const char *part, cli_failure *why)
{
  const int error = rslice_file_finish(part, o->path);

  return error ? cannot_write(o->path, error, why) : CLI_DONE;
}

static cli_exit write_file(const outer *o, layout *l, cli_failure *why)
{
  char     part[PATH_MAX] = "";
  MPI_File file;
  cli_exit code = o->rank == 0 ? begin(o, l->bytes, part, sizeof part, why) : CLI_DONE;

  code = cli_agree_on(o->comm, code, why);
  if (code == CLI_DONE) {
    MPI_Bcast(part, (int)sizeof part, MPI_CHAR, 0, o->comm);
    if (MPI_File_open(o->comm, part, MPI_MODE_WRONLY, MPI_INFO_NULL, &file)) {
      code = cli_fail(why, CLI_IO, "%s: it cannot be opened for parallel writing", o->path);
    } else {
      if (!write_parts(o, l, &file)) code = cannot_write(o->path, 0, why);
      if (MPI_File_close(&file) && code == CLI_DONE) code = cannot_write(o->path, 0, why);
    }
    code = cli_agree_on(o->comm, code, why);
  }
  if (code == CLI_DONE) code = cli_agree_on(o->comm, o->rank == 0 ? finish(o, part, why) : CLI_DONE, why);
  if (code != CLI_DONE && o->rank == 0 && *part) unlink(part);
  return code;
}

static cli_exit write_text(const outer *o, cli_failure *why)
{
  layout   l    = {ra_zeros(o->num_parts, sizeof *l.size), ra_zeros(o->num_parts, sizeof *l.before), 0};
  cli_exit code = cli_agree_on(o->comm, l.size && l.before ? CLI_DONE : cli_no_memory(why), why);

  if (code == CLI_DONE) {
    for (int part = 0; part < o->num_parts; part++) l.before[part] = o->part_at[part + 1] - o->part_at[part];
    MPI_Allreduce(l.before, l.size, o->num_parts, MPI_INT64_T, MPI_SUM, o->comm);
    MPI_Exscan(MPI_IN_PLACE, l.before, o->num_parts, MPI_INT64_T, MPI_SUM, o->comm);
    for (int part = 0; part < o->num_parts && o->rank == 0; part++) l.before[part] = 0;
    code = cli_agree_on(o->comm, write_parts(o, &l, NULL) ? CLI_DONE : cli_no_memory(why), why);
  }
  if (code == CLI_DONE) code = write_file(o, &l, why);
  free(l.size);
  free(l.before);
  return code;
}

cli_exit bool_outer_write(MPI_Comm comm, const char *path, const rslice_content *content, cli_failure *why)
{
  outer         o = {.comm = comm, .path = path, .content = content, .is_stl = rsurf_is_stl(path)};
  rslice_status status;
  cli_exit      code;

  MPI_Comm_rank(comm, &o.rank);
  MPI_Comm_size(comm, &o.size);
  o.num_parts = content->num_boundaries + 2;
  status      = ship_faces(&o);
  if (status == RSLICE_OK && !o.is_stl) status = number_nodes(&o);
  if (status == RSLICE_OK && o.is_stl) status = rslice_agree(comm, triangulate(&o));
  if (status == RSLICE_OK) status = rslice_agree(comm, print_parts(&o));
  code = status == RSLICE_OK ? write_text(&o, why) : cli_fail(why, CLI_INTERNAL, "%s: %s", path, rslice_status_text(status));
  rslice_drop(&o.faces);
  rslice_drop(&o.nodes);
  rsurf_drop(&o.triangles);
  free(o.number);
  free(o.text);
  free(o.part_at);
  return code;
}
