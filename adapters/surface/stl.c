/* stl -- STL files. A file whose length is what the count at byte 80 says is binary, even if its header begins with
 * "solid", as many do; else one that begins with "solid" is text, read word by word, so that line ends of any kind will
 * do. The normals of facets are not read: the order of the corners says the same. */
#include "surface_private.h"

#include <stdlib.h>
#include <string.h>
#include <strings.h>

enum { HEADER = 84, FACET = 50 };

/* ---- binary -------------------------------------------------------------------------------------------------------- */

static uint32_t little_endian(const char *at)
{
  const unsigned char *b = (const unsigned char *)at;

  return (uint32_t)b[0] | (uint32_t)b[1] << 8 | (uint32_t)b[2] << 16 | (uint32_t)b[3] << 24;
}

static rsurf_status read_binary(rs_input *in, int64_t num)
{
  for (int64_t f = 0; f < num; f++) {
    const char *at = in->text + HEADER + f * FACET + 12;
    int64_t     node[3];

    for (int v = 0; v < 3; v++) {
      double xyz[3];

      for (int k = 0; k < 3; k++) {
        const uint32_t bits = little_endian(at + 12 * v + 4 * k);
        float          x;

        memcpy(&x, &bits, sizeof x);
        xyz[k] = (double)x;
      }
      RS_TRY(rs_node(in, xyz, "facet", f + 1, &node[v]));
    }
    RS_TRY(rs_face(in, node, 3));
  }
  return RSURF_OK;
}

/* ---- text ---------------------------------------------------------------------------------------------------------- */

/* A place in the text. */
typedef struct cursor {
  rs_input   *in;
  const char *at;
  int64_t     line;
} cursor;

static void skip_blanks(cursor *c)
{
  for (; *c->at && (unsigned char)*c->at <= ' '; c->at++) c->line += *c->at == '\n' || (*c->at == '\r' && c->at[1] != '\n');
}

/* The next word is `word`, in letters of any size: then it is behind us. */
static bool take(cursor *c, const char *word)
{
  const size_t n = strlen(word);

  skip_blanks(c);
  if (strncasecmp(c->at, word, n) || (unsigned char)c->at[n] > ' ') return false;
  c->at += n;
  return true;
}

static rsurf_status expected(const cursor *c, const char *what)
{
  const bool ended = c->at == c->in->text + c->in->size;

  return rs_fail(c->in->message, RSURF_IO, "%s: line %lld: %s where '%s' is expected: the file is %s", c->in->path,
                 (long long)c->line, ended ? "it ends" : "something else stands", what, ended ? "truncated" : "damaged");
}

static rsurf_status take_number(cursor *c, double *x)
{
  char *end;

  skip_blanks(c);
  *x = strtod(c->at, &end);
  if (end == c->at || (unsigned char)*end > ' ') return expected(c, "a number");
  c->at = end;
  return RSURF_OK;
}

/* The rest of the line, which is a name. */
static rsurf_status take_name(cursor *c)
{
  const size_t length = strcspn(c->at, "\r\n");

  RS_TRY(rs_group(c->in, c->at, length));
  c->at += length;
  return RSURF_OK;
}

/* From behind "facet". */
static rsurf_status read_facet(cursor *c)
{
  int64_t node[3];

  if (!take(c, "normal")) return expected(c, "normal");
  for (int k = 0; k < 3; k++) { /* three words, whatever they are: some writers put nan */
    skip_blanks(c);
    while ((unsigned char)*c->at > ' ') c->at++;
  }
  if (!take(c, "outer")) return expected(c, "outer loop");
  if (!take(c, "loop")) return expected(c, "loop");
  for (int v = 0; v < 3; v++) {
    double xyz[3];

    if (!take(c, "vertex")) return expected(c, "vertex");
    for (int k = 0; k < 3; k++) RS_TRY(take_number(c, &xyz[k]));
    RS_TRY(rs_node(c->in, xyz, "line", c->line, &node[v]));
  }
  if (!take(c, "endloop")) return expected(c, "endloop");
  if (!take(c, "endfacet")) return expected(c, "endfacet");
  return rs_face(c->in, node, 3);
}

static rsurf_status read_text(rs_input *in)
{
  cursor c = {in, in->text, 1};

  while (take(&c, "solid")) {
    RS_TRY(take_name(&c));
    while (take(&c, "facet")) RS_TRY(read_facet(&c));
    if (!take(&c, "endsolid")) return expected(&c, "facet or endsolid");
    c.at += strcspn(c.at, "\r\n");
  }
  skip_blanks(&c);
  return c.at == in->text + in->size ? RSURF_OK : expected(&c, "solid");
}

/* ---- which --------------------------------------------------------------------------------------------------------- */

rsurf_status rs_read_stl(rs_input *in)
{
  const int64_t num  = in->size >= HEADER ? (int64_t)little_endian(in->text + 80) : 0;
  cursor        c    = {in, in->text, 1};
  const bool    text = take(&c, "solid");

  if (in->size >= HEADER && HEADER + num * FACET == (int64_t)in->size) return read_binary(in, num);
  if (text && memchr(in->text, 0, in->size) == NULL) return read_text(in);
  if (in->size < HEADER)
    return rs_fail(in->message, RSURF_IO, "%s: it is neither text nor long enough for binary STL: it is truncated", in->path);
  return rs_fail(in->message, RSURF_IO,
                 "%s: its header counts %lld facets, which take %lld bytes, but it has %lld: it is damaged or truncated",
                 in->path, (long long)num, (long long)(HEADER + num * FACET), (long long)in->size);
}
