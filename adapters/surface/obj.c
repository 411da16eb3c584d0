/* obj -- OBJ files: v, f, g and o; what else they hold (texture, normals, materials, lines) bounds no volume and is
 * passed over. Read line by line; a line that ends in a backslash goes on. */
#include "surface_private.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_CORNERS = 1 << 20 };

/* The file while it is read. */
typedef struct obj {
  rs_input *in;
  int64_t   line;
  ra_array  vertex; /* int64_t: node of each v */
  ra_array  loop;   /* int64_t: of the face that is read */
} obj;

/* Blanks of this line, which ends at a NUL. */
static const char *blanks(const char *at)
{
  while (*at == ' ' || *at == '\t' || *at == '\v' || *at == '\f') at++;
  return at;
}

static bool is_word(const char *line, const char *word)
{
  const size_t n = strlen(word);

  return !strncmp(line, word, n) && (!line[n] || blanks(line + n) != line + n);
}

static rsurf_status read_vertex(obj *o, const char *at)
{
  double  xyz[3];
  int64_t node;

  for (int k = 0; k < 3; k++) {
    char *end;

    xyz[k] = strtod(at, &end);
    if (end == at || (*end && blanks(end) == end))
      return rs_fail(o->in->message, RSURF_IO, "%s: line %lld: a vertex needs three numbers: repair the file", o->in->path,
                     (long long)o->line);
    at = end;
  }
  RS_TRY(rs_node(o->in, xyz, "line", o->line, &node));
  return ra_push(&o->vertex, &node, sizeof node) ? RSURF_OK : rs_no_memory(o->in->message);
}

/* The corner of a face: i, i/t, i//n or i/t/n; i counts from 1, or backwards from the last vertex. */
static rsurf_status read_corner(obj *o, const char **at)
{
  const int64_t num = o->vertex.count;
  char         *end;
  int64_t       i;

  errno = 0;
  i     = strtoll(*at, &end, 10);
  if (end == *at || (*end && *end != '/' && blanks(end) == end))
    return rs_fail(o->in->message, RSURF_IO, "%s: line %lld: '%.40s' is no corner of a face: repair the file", o->in->path,
                   (long long)o->line, *at);
  if (errno || i == 0 || i > num || i < -num)
    return rs_fail(o->in->message, RSURF_IO,
                   "%s: line %lld: a face has vertex %lld, but there are %lld so far: repair the file", o->in->path,
                   (long long)o->line, (long long)i, (long long)num);
  while (*end && blanks(end) == end) end++;
  *at = blanks(end);
  if (o->loop.count == MOST_CORNERS)
    return rs_fail(o->in->message, RSURF_IO, "%s: line %lld: a face has more than %d corners: repair the file", o->in->path,
                   (long long)o->line, MOST_CORNERS);
  return ra_push(&o->loop, (const int64_t *)o->vertex.item + (i > 0 ? i - 1 : num + i), sizeof i)
             ? RSURF_OK
             : rs_no_memory(o->in->message);
}

static rsurf_status read_face(obj *o, const char *at)
{
  o->loop.count = 0;
  while (*at) RS_TRY(read_corner(o, &at));
  if (o->loop.count < 3)
    return rs_fail(o->in->message, RSURF_IO, "%s: line %lld: a face has %lld corners: it needs three", o->in->path,
                   (long long)o->line, (long long)o->loop.count);
  return rs_face(o->in, o->loop.item, o->loop.count);
}

static rsurf_status read_line(obj *o, char *line)
{
  line[strcspn(line, "#")] = 0;
  for (size_t n = strlen(line); n && (unsigned char)line[n - 1] <= ' '; n--) line[n - 1] = 0;
  line = (char *)blanks(line);
  if (is_word(line, "v")) return read_vertex(o, blanks(line + 1));
  if (is_word(line, "f")) return read_face(o, blanks(line + 1));
  if (is_word(line, "g") || is_word(line, "o")) return rs_group(o->in, line + 1, strlen(line + 1));
  return RSURF_OK;
}

/* The end of the line at `at`, where a NUL is put, and the number of lines it takes; continued lines are joined. */
static char *cut_line(char *at, int64_t *lines)
{
  for (*lines = 1;; at++) {
    at += strcspn(at, "\\\r\n");
    if (*at == '\\' && (at[1] == '\n' || at[1] == '\r')) {
      const size_t n = at[1] == '\r' && at[2] == '\n' ? 3 : 2;

      memset(at, ' ', n);
      at += n - 1;
      ++*lines;
    } else if (*at != '\\') {
      break;
    }
  }
  if (!*at) return at;
  if (*at == '\r' && at[1] == '\n') *at++ = 0;
  *at = 0;
  return at + 1;
}

rsurf_status rs_read_obj(rs_input *in)
{
  obj          o      = {.in = in, .line = 1};
  rsurf_status status = RSURF_OK;
  char        *at     = in->text;

  if (memchr(in->text, 0, in->size))
    return rs_fail(in->message, RSURF_IO, "%s: it is no text: give an OBJ file, or name an STL file .stl", in->path);
  while (*at && status == RSURF_OK) {
    int64_t lines;
    char   *next = cut_line(at, &lines);

    status = read_line(&o, at);
    o.line += lines;
    at = next;
  }
  free(o.vertex.item);
  free(o.loop.item);
  return status;
}
