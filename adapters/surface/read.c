/* read -- a file as a surface: which format it is, and nodes joined where all three coordinates are equal. Linear. */
#include "surface_private.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

static bool ends_in(const char *path, const char *ending)
{
  const size_t n = strlen(path), m = strlen(ending);

  return n > m && !strcasecmp(path + n - m, ending);
}

int rsurf_is_path(const char *path) { return ends_in(path, ".stl") || ends_in(path, ".obj"); }

/* The whole file and a NUL. */
static rsurf_status load(rs_input *in)
{
  FILE  *file = fopen(in->path, "rb");
  size_t got = 0, room = 0;

  if (!file) return rs_fail(in->message, RSURF_IO, "%s: %s: check the path", in->path, strerror(errno));
  do {
    char *more;

    room = room ? 2 * room : 1 << 16;
    more = realloc(in->text, room);
    if (!more) {
      fclose(file);
      return rs_no_memory(in->message);
    }
    in->text = more;
    got += fread(in->text + got, 1, room - got - 1, file);
  } while (got == room - 1);
  in->size      = got;
  in->text[got] = 0;
  if (ferror(file)) {
    fclose(file);
    return rs_fail(in->message, RSURF_IO, "%s: it cannot be read: give a regular file", in->path);
  }
  fclose(file);
  return got ? RSURF_OK : rs_fail(in->message, RSURF_IO, "%s: it is empty: give an STL or OBJ file", in->path);
}

rsurf_status rs_node(rs_input *in, const double xyz[3], const char *unit, int64_t where, int64_t *node)
{
  double  at[3];
  int64_t key[3];

  for (int k = 0; k < 3; k++) {
    at[k] = xyz[k] * in->scale + 0.0; /* one zero, not two */
    if (!isfinite(at[k]))
      return rs_fail(in->message, RSURF_IO, "%s: %s %lld: a coordinate is not a finite number: repair the file", in->path, unit,
                     (long long)where);
  }
  memcpy(key, at, sizeof key);
  *node = ra_map_add(&in->nodes, key);
  return *node < 0 ? rs_no_memory(in->message) : RSURF_OK;
}

rsurf_status rs_group(rs_input *in, const char *name, size_t length)
{
  const char *slash = strrchr(in->path, '/'), *stem = slash ? slash + 1 : in->path, *dot = strrchr(stem, '.');
  char       *copy;

  while (length && (unsigned char)name[length - 1] <= ' ') length--;
  while (length && (unsigned char)*name <= ' ') name++, length--;
  if (!length) {
    name   = stem;
    length = dot && dot > stem ? (size_t)(dot - stem) : strlen(stem);
  }
  for (in->current = 0; in->current < in->names.count; in->current++) {
    const char *known = ((char **)in->names.item)[in->current];

    if (strlen(known) == length && !memcmp(known, name, length)) return RSURF_OK;
  }
  if (in->names.count == 100000)
    return rs_fail(in->message, RSURF_IO, "%s: it has more than 100000 groups: join some", in->path);
  copy = strndup(name, length);
  if (copy && ra_push(&in->names, &copy, sizeof copy)) return RSURF_OK;
  free(copy);
  return rs_no_memory(in->message);
}

rsurf_status rs_face(rs_input *in, const int64_t *node, int64_t n)
{
  bool ok = true;

  if (in->current < 0) RS_TRY(rs_group(in, "", 0));
  for (int64_t i = 0; i < n && ok; i++) ok = ra_push(&in->loop, &node[i], sizeof *node);
  ok = ok && ra_push(&in->offset, &in->loop.count, sizeof in->loop.count);
  ok = ok && ra_push(&in->group, &in->current, sizeof in->current);
  return ok ? RSURF_OK : rs_no_memory(in->message);
}

/* What was read becomes a surface. */
static void hand_over(rs_input *in, rsurf_surface *out)
{
  *out               = (rsurf_surface){.num_nodes   = in->nodes.key.count,
                                       .num_faces   = in->group.count,
                                       .num_groups  = (int32_t)in->names.count,
                                       .node_xyz    = in->nodes.key.item,
                                       .face_offset = in->offset.item,
                                       .face_node   = in->loop.item,
                                       .face_group  = in->group.item,
                                       .group_name  = in->names.item};
  in->nodes.key.item = in->offset.item = in->loop.item = in->group.item = in->names.item = NULL;
  in->names.count                                                                        = 0;
}

static void drop_input(rs_input *in)
{
  for (int64_t i = 0; i < in->names.count; i++) free(((char **)in->names.item)[i]);
  free(in->names.item);
  free(in->offset.item);
  free(in->loop.item);
  free(in->group.item);
  ra_map_drop(&in->nodes);
  free(in->text);
}

rsurf_status rsurf_read(const char *path, double scale, rsurf_surface *out, rsurf_message *message)
{
  rs_input      in   = {.path = path, .scale = scale, .nodes = {.width = 3}, .current = -1, .message = message};
  const int64_t zero = 0;
  rsurf_status  status;

  message->text[0] = 0;
  RS_GOTO(done, status = load(&in));
  RS_GOTO(done, status = ra_push(&in.offset, &zero, sizeof zero) ? RSURF_OK : rs_no_memory(message));
  RS_GOTO(done, status = ends_in(path, ".stl") ? rs_read_stl(&in) : rs_read_obj(&in));
  if (in.group.count)
    hand_over(&in, out);
  else
    status = rs_fail(message, RSURF_IO, "%s: it holds no faces: give an STL or OBJ file of a closed surface", path);
done:
  drop_input(&in);
  return status;
}

/* ---- from polygons ------------------------------------------------------------------------------------------------- */

struct rsurf_builder {
  rs_input in;
  ra_array loop; /* int64_t: of the face that is added */
};

rsurf_status rsurf_begin(int32_t num_groups, const char *const *group_name, rsurf_builder **out, rsurf_message *message)
{
  rsurf_builder *b    = ra_zeros(1, sizeof *b);
  const int64_t  zero = 0;
  bool           ok   = b != NULL;

  if (b) b->in = (rs_input){.path = "the surface", .scale = 1, .nodes = {.width = 3}, .message = message};
  ok = ok && ra_push(&b->in.offset, &zero, sizeof zero);
  for (int32_t g = 0; g < num_groups && ok; g++) {
    char *copy = strdup(group_name[g]);

    ok = copy && ra_push(&b->in.names, &copy, sizeof copy);
    if (!ok) free(copy);
  }
  if (!ok) {
    rsurf_surface none;

    rsurf_end(&b, &none);
    rsurf_drop(&none);
    return rs_no_memory(message);
  }
  *out = b;
  return RSURF_OK;
}

rsurf_status rsurf_add(rsurf_builder *b, const double *xyz, int64_t n, int32_t group, rsurf_message *message)
{
  b->in.message = message;
  b->in.current = group;
  b->loop.count = 0;
  for (int64_t i = 0; i < n; i++) {
    int64_t node;

    RS_TRY(rs_node(&b->in, xyz + 3 * i, "face", b->in.group.count + 1, &node));
    if (!ra_push(&b->loop, &node, sizeof node)) return rs_no_memory(message);
  }
  return rs_face(&b->in, b->loop.item, n);
}

void rsurf_end(rsurf_builder **builder, rsurf_surface *out)
{
  rsurf_builder *b = *builder;

  *out = (rsurf_surface){.num_nodes = 0};
  if (!b) return;
  hand_over(&b->in, out);
  drop_input(&b->in);
  free(b->loop.item);
  free(b);
  *builder = NULL;
}
