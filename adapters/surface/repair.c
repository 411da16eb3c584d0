/* repair -- faces into the boundary of bodies: polygons cut, edges matched, orientation spread from face to face. Linear
 * but for the search for crossings; cutting a polygon takes the square of its corners. */
#include "surface_private.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_CORNERS = 4096, MOST_NAMED = 3 };

/* ---- coordinates ---------------------------------------------------------------------------------------------------- */

/* Coordinates times a power of two, so that the largest is near 1; what is below 2^-100 counts as 0. NULL: no memory. */
static double *unit_coordinates(const rsurf_surface *s)
{
  double *unit    = ra_zeros(3 * s->num_nodes, sizeof *unit);
  double  largest = 0;
  int     exponent;

  for (int64_t i = 0; i < 3 * s->num_nodes; i++) largest = fmax(largest, fabs(s->node_xyz[i]));
  frexp(largest, &exponent);
  for (int64_t i = 0; unit && i < 3 * s->num_nodes; i++) {
    unit[i] = ldexp(s->node_xyz[i], -exponent);
    if (fabs(unit[i]) < 0x1p-100) unit[i] = 0;
  }
  return unit;
}

size_t rs_put_point(const double *x, char *out, size_t size)
{
  const int n = snprintf(out, size, "(%.9g %.9g %.9g)", x[0], x[1], x[2]);

  return n < 0 ? 0 : (size_t)n < size ? (size_t)n : size ? size - 1 : 0;
}

static const double *corner(const rsurf_surface *s, int64_t at) { return s->node_xyz + 3 * s->face_node[at]; }

/* ---- polygons -------------------------------------------------------------------------------------------------------- */

/* The axis across which a loop covers most area, and to which side it turns there. */
static int main_axis(const double *xyz, const int64_t *loop, int64_t n, int *turn)
{
  double area[3] = {0, 0, 0};
  int    axis    = 0;

  for (int64_t i = 0; i < n; i++) {
    const double *a = xyz + 3 * loop[i], *b = xyz + 3 * loop[(i + 1) % n], *o = xyz + 3 * loop[0];

    for (int k = 0; k < 3; k++) {
      const int x = (k + 1) % 3, y = (k + 2) % 3;

      area[k] += (a[x] - o[x]) * (b[y] - o[y]) - (a[y] - o[y]) * (b[x] - o[x]);
    }
  }
  for (int k = 1; k < 3; k++)
    if (fabs(area[k]) > fabs(area[axis])) axis = k;
  *turn = area[axis] < 0 ? -1 : 1;
  return axis;
}

/* Flat, and turning truly to one side in every corner and as seen from the first. */
static bool is_plain(const double *xyz, const int64_t *loop, int64_t n, int axis, int turn)
{
  const double *o = xyz + 3 * loop[0];

  for (int64_t i = 0; i < n; i++) {
    const double *a = xyz + 3 * loop[i], *b = xyz + 3 * loop[(i + 1) % n], *c = xyz + 3 * loop[(i + 2) % n];

    if (rs_turn(a, b, c, axis) != turn) return false;
    if (i && i + 1 < n && rs_turn(o, a, b, axis) != turn) return false;
    if (rs_side(o, xyz + 3 * loop[1], xyz + 3 * loop[2], a)) return false;
  }
  return true;
}

/* All corners lie on one line, or in one point. */
static bool is_line(const double *xyz, const int64_t *loop, int64_t n)
{
  for (int64_t i = 1; i < n; i++)
    for (int64_t k = i + 1; k < n; k++)
      for (int axis = 0; axis < 3; axis++)
        if (rs_turn(xyz + 3 * loop[0], xyz + 3 * loop[i], xyz + 3 * loop[k], axis)) return false;
  return true;
}

/* No corner of the loop lies in the triangle a, b, c of three that follow each other, seen across the axis. */
static bool is_ear(const double *xyz, const int64_t *loop, int64_t n, const int64_t ear[3], int axis, int turn)
{
  const double *a = xyz + 3 * ear[0], *b = xyz + 3 * ear[1], *c = xyz + 3 * ear[2];

  if (rs_turn(a, b, c, axis) != turn) return false;
  for (int64_t i = 0; i < n; i++) {
    const double *p = xyz + 3 * loop[i];

    if (loop[i] == ear[0] || loop[i] == ear[1] || loop[i] == ear[2]) continue;
    if (rs_turn(a, b, p, axis) != -turn && rs_turn(b, c, p, axis) != -turn && rs_turn(c, a, p, axis) != -turn) return false;
  }
  return true;
}

/* A loop, which is used up, into triangles appended to out. false: there is no ear; *memory false: no memory. */
static bool clip_ears(const double *xyz, int64_t *loop, int64_t n, ra_array *out, bool *memory)
{
  int       turn;
  const int axis = main_axis(xyz, loop, n, &turn);

  for (int64_t i = 0, missed = 0; n > 2; i = (i + 1) % n) {
    const int64_t ear[3] = {loop[i], loop[(i + 1) % n], loop[(i + 2) % n]}, at = (i + 1) % n;

    if (!is_ear(xyz, loop, n, ear, axis, turn)) {
      if (++missed > n) return false;
      continue;
    }
    for (int v = 0; v < 3 && *memory; v++) *memory = ra_push(out, &ear[v], sizeof ear[v]);
    if (!*memory) return true;
    memmove(loop + at, loop + at + 1, (size_t)(n - at - 1) * sizeof *loop);
    missed = 0;
    if (i == n - 1) i--;
    n--;
  }
  return true;
}

/* ---- clean faces ----------------------------------------------------------------------------------------------------- */

/* Faces that replace those of the surface. */
typedef struct faces {
  ra_array offset, loop, group;
  int64_t  cut, dropped;
} faces;

/* A loop without corners that repeat the one before. */
static int64_t tidy(const int64_t *from, int64_t n, int64_t *loop)
{
  int64_t m = 0;

  for (int64_t i = 0; i < n; i++)
    if (!m || loop[m - 1] != from[i]) loop[m++] = from[i];
  while (m > 1 && loop[m - 1] == loop[0]) m--;
  return m;
}

static bool visits_twice(const int64_t *loop, int64_t n)
{
  for (int64_t i = 0; i < n; i++)
    for (int64_t k = i + 1; k < n; k++)
      if (loop[i] == loop[k]) return true;
  return false;
}

static bool add_face(faces *to, const int64_t *loop, int64_t n, int32_t group)
{
  bool ok = true;

  for (int64_t i = 0; i < n && ok; i++) ok = ra_push(&to->loop, &loop[i], sizeof *loop);
  return ok && ra_push(&to->offset, &to->loop.count, sizeof to->loop.count) && ra_push(&to->group, &group, sizeof group);
}

/* What stands in loop from `first` on are triangles. */
static bool end_triangles(faces *to, int64_t first, int32_t group)
{
  bool ok = true;

  for (int64_t end = first + 3; end <= to->loop.count && ok; end += 3)
    ok = ra_push(&to->offset, &end, sizeof end) && ra_push(&to->group, &group, sizeof group);
  return ok;
}

static rsurf_status refuse_face(const rsurf_surface *s, const char *name, int64_t face, const char *what,
                                rsurf_message *message)
{
  char place[300];

  rs_put_point(corner(s, s->face_offset[face]), place, sizeof place);
  return rs_fail(message, RSURF_GEOMETRY, "%s: face %lld (counted from 1), which begins at %s, %s: repair the surface", name,
                 (long long)face + 1, place, what);
}

/* Face f as it shall be. */
static rsurf_status clean_face(const rsurf_surface *s, const double *xyz, const char *name, int64_t f, faces *to,
                               rsurf_message *message)
{
  const int64_t n = s->face_offset[f + 1] - s->face_offset[f];
  int64_t       loop[MOST_CORNERS], m;
  bool          memory = true;
  int           turn, axis;

  if (n > MOST_CORNERS) return refuse_face(s, name, f, "has more than 4096 corners", message);
  m = tidy(s->face_node + s->face_offset[f], n, loop);
  if (m < 3) {
    to->dropped++;
    return RSURF_OK;
  }
  if (visits_twice(loop, m)) return refuse_face(s, name, f, "has a corner twice", message);
  axis = main_axis(xyz, loop, m, &turn);
  if (m == 3 || is_plain(xyz, loop, m, axis, turn))
    return add_face(to, loop, m, s->face_group[f]) ? RSURF_OK : rs_no_memory(message);
  if (is_line(xyz, loop, m))
    return refuse_face(s, name, f, "has no area: beside the size of the surface its corners lie on one line", message);
  {
    const int64_t first = to->loop.count;

    to->cut++;
    if (!clip_ears(xyz, loop, m, &to->loop, &memory)) return refuse_face(s, name, f, "crosses itself", message);
    memory = memory && end_triangles(to, first, s->face_group[f]);
  }
  return memory ? RSURF_OK : rs_no_memory(message);
}

/* The faces take the place of the surface's, or end where something failed. */
static void replace(rsurf_surface *s, faces *to, rsurf_status status)
{
  const rsurf_surface old = *s;

  if (status == RSURF_OK) {
    s->num_faces   = to->group.count;
    s->face_offset = to->offset.item;
    s->face_node   = to->loop.item;
    s->face_group  = to->group.item;
  }
  free(status == RSURF_OK ? old.face_offset : to->offset.item);
  free(status == RSURF_OK ? old.face_node : to->loop.item);
  free(status == RSURF_OK ? old.face_group : to->group.item);
}

static rsurf_status clean_faces(rsurf_surface *s, const double *xyz, const char *name, rsurf_repairs *repairs,
                                rsurf_message *message)
{
  faces         to     = {.cut = 0};
  const int64_t zero   = 0;
  rsurf_status  status = ra_push(&to.offset, &zero, sizeof zero) ? RSURF_OK : rs_no_memory(message);

  for (int64_t f = 0; f < s->num_faces && status == RSURF_OK; f++) status = clean_face(s, xyz, name, f, &to, message);
  replace(s, &to, status);
  if (status != RSURF_OK) return status;
  repairs->faces_cut     = to.cut;
  repairs->faces_dropped = to.dropped;
  if (!s->num_faces) return rs_fail(message, RSURF_GEOMETRY, "%s: all its faces lie in points or lines: give a surface", name);
  return RSURF_OK;
}

/* The triangles of a polygon; a fan where rounding has made it cross itself. */
static bool cut_face(const rsurf_surface *s, const double *xyz, int64_t f, faces *to)
{
  const int64_t  n = s->face_offset[f + 1] - s->face_offset[f], first = to->loop.count;
  const int64_t *face = s->face_node + s->face_offset[f];
  int64_t       *loop = ra_zeros(n, sizeof *loop);
  bool           ok   = loop != NULL;

  if (ok) memcpy(loop, face, (size_t)n * sizeof *loop);
  if (ok && !clip_ears(xyz, loop, n, &to->loop, &ok)) {
    to->loop.count = first;
    for (int64_t i = 1; i + 1 < n && ok; i++)
      ok = ra_push(&to->loop, &face[0], sizeof *face) && ra_push(&to->loop, &face[i], sizeof *face) &&
           ra_push(&to->loop, &face[i + 1], sizeof *face);
  }
  free(loop);
  return ok && end_triangles(to, first, s->face_group[f]);
}

rsurf_status rsurf_triangulate(rsurf_surface *s, rsurf_message *message)
{
  faces         to   = {.cut = 0};
  double       *xyz  = unit_coordinates(s);
  const int64_t zero = 0;
  bool          ok   = xyz && ra_push(&to.offset, &zero, sizeof zero);

  for (int64_t f = 0; f < s->num_faces && ok; f++) {
    const int64_t n = s->face_offset[f + 1] - s->face_offset[f];

    ok = n == 3 ? add_face(&to, s->face_node + s->face_offset[f], 3, s->face_group[f]) : cut_face(s, xyz, f, &to);
  }
  replace(s, &to, ok ? RSURF_OK : RSURF_MEMORY);
  free(xyz);
  return ok ? RSURF_OK : rs_no_memory(message);
}

/* ---- edges ----------------------------------------------------------------------------------------------------------- */

void rs_edges_drop(rs_edges *e)
{
  ra_map_drop(&e->map);
  free(e->of_side);
  free(e->side);
  free(e->count);
}

bool rs_find_edges(const rsurf_surface *s, rs_edges *e)
{
  const int64_t num = s->face_offset[s->num_faces];

  e->map.width = 2;
  e->of_side   = ra_zeros(num, sizeof *e->of_side);
  e->side      = ra_zeros(num, sizeof *e->side);
  e->count     = ra_zeros(num, sizeof *e->count);
  if (!e->of_side || !e->side || !e->count) return false;
  for (int64_t f = 0; f < s->num_faces; f++)
    for (int64_t i = s->face_offset[f]; i < s->face_offset[f + 1]; i++) {
      const int64_t a = s->face_node[i], b = s->face_node[i + 1 < s->face_offset[f + 1] ? i + 1 : s->face_offset[f]];
      const int64_t edge = ra_map_add(&e->map, (int64_t[2]){a < b ? a : b, a < b ? b : a});

      if (edge < 0) return false;
      e->of_side[i] = edge;
      if (!e->count[edge]) e->side[edge][1] = -1;
      if (e->count[edge] < 2) e->side[edge][e->count[edge]] = i;
      e->count[edge]++;
    }
  return true;
}

/* How many edges have one side (open) or more than two, and where the first ones are. */
static rsurf_status check_edges(const rsurf_surface *s, const rs_edges *e, const char *name, rsurf_message *message)
{
  int64_t num[2]                    = {0, 0};
  char    text[2][MOST_NAMED * 110] = {"", ""};

  for (int64_t i = 0; i < e->map.key.count; i++) {
    const int64_t *node = (const int64_t *)e->map.key.item + 2 * i;
    const int      kind = e->count[i] > 2;
    size_t         used = strlen(text[kind]);

    if (e->count[i] == 2) continue;
    if (num[kind]++ >= MOST_NAMED) continue;
    used += (size_t)snprintf(text[kind] + used, sizeof text[kind] - used, " ");
    used += rs_put_point(s->node_xyz + 3 * node[0], text[kind] + used, sizeof text[kind] - used);
    used += (size_t)snprintf(text[kind] + used, sizeof text[kind] - used, "-");
    rs_put_point(s->node_xyz + 3 * node[1], text[kind] + used, sizeof text[kind] - used);
  }
  if (num[1])
    return rs_fail(message, RSURF_GEOMETRY,
                   "%s: %lld edges have more than two faces, so that it bounds no body:%s%s: repair it", name,
                   (long long)num[1], text[1], num[1] > MOST_NAMED ? " ..." : "");
  if (num[0])
    return rs_fail(message, RSURF_GEOMETRY, "%s: the surface is open: %lld edges have one face only:%s%s: close it", name,
                   (long long)num[0], text[0], num[0] > MOST_NAMED ? " ..." : "");
  return RSURF_OK;
}

/* ---- orientation ----------------------------------------------------------------------------------------------------- */

void rs_turn_face(rsurf_surface *s, int64_t face)
{
  for (int64_t a = s->face_offset[face], b = s->face_offset[face + 1] - 1; a < b; a++, b--) {
    const int64_t keep = s->face_node[a];

    s->face_node[a] = s->face_node[b];
    s->face_node[b] = keep;
  }
}

/* From each face to those beside it: which shell, and whether it must be turned. */
static rsurf_status spread(const rsurf_surface *s, const rs_edges *e, const char *name, int64_t *shell, int8_t *turned,
                           int64_t *num_shells, rsurf_message *message)
{
  int64_t *face_of = ra_zeros(s->face_offset[s->num_faces], sizeof *face_of), *stack = ra_zeros(s->num_faces, sizeof *stack);
  rsurf_status status = face_of && stack ? RSURF_OK : rs_no_memory(message);

  *num_shells = 0;
  for (int64_t f = 0; f < s->num_faces && status == RSURF_OK; f++) {
    shell[f] = -1;
    for (int64_t i = s->face_offset[f]; i < s->face_offset[f + 1]; i++) face_of[i] = f;
  }
  for (int64_t first = 0; first < s->num_faces && status == RSURF_OK; first++) {
    int64_t depth = 0;

    if (shell[first] >= 0) continue;
    shell[first]   = (*num_shells)++;
    stack[depth++] = first;
    while (depth && status == RSURF_OK) {
      const int64_t f = stack[--depth];

      for (int64_t i = s->face_offset[f]; i < s->face_offset[f + 1]; i++) {
        const int64_t *both = e->side[e->of_side[i]], k = both[0] == i ? both[1] : both[0], g = face_of[k];
        const int8_t   want = (int8_t)(turned[f] ^ (s->face_node[i] == s->face_node[k]));

        if (shell[g] < 0) {
          shell[g]       = shell[f];
          turned[g]      = want;
          stack[depth++] = g;
        } else if (turned[g] != want) {
          char place[300];

          rs_put_point(corner(s, i), place, sizeof place);
          status = rs_fail(message, RSURF_GEOMETRY, "%s: the surface has one side only, as is seen at %s: it bounds no body",
                           name, place);
          break;
        }
      }
    }
  }
  free(face_of);
  free(stack);
  return status;
}

/* ---- the whole ------------------------------------------------------------------------------------------------------- */

bool rs_fan(const rsurf_surface *s, rs_triangles *out)
{
  const int64_t most = s->face_offset[s->num_faces] - 2 * s->num_faces;

  *out = (rs_triangles){.corner = ra_zeros(most, sizeof *out->corner), .face = ra_zeros(most, sizeof *out->face)};
  if (!out->corner || !out->face) return false;
  for (int64_t f = 0; f < s->num_faces; f++)
    for (int64_t i = s->face_offset[f] + 1; i + 1 < s->face_offset[f + 1]; i++) {
      int64_t *c = out->corner[out->num];

      c[0]                  = s->face_node[s->face_offset[f]];
      c[1]                  = s->face_node[i];
      c[2]                  = s->face_node[i + 1];
      out->face[out->num++] = f;
    }
  return true;
}

/* Triangles without area are named. */
static rsurf_status check_areas(const rsurf_surface *s, const double *xyz, const char *name, const rs_triangles *t,
                                rsurf_message *message)
{
  for (int64_t i = 0; i < t->num; i++) {
    const double *a = xyz + 3 * t->corner[i][0], *b = xyz + 3 * t->corner[i][1], *c = xyz + 3 * t->corner[i][2];

    char text[3][110];

    if (rs_turn(a, b, c, 0) || rs_turn(a, b, c, 1) || rs_turn(a, b, c, 2)) continue;
    for (int v = 0; v < 3; v++) rs_put_point(s->node_xyz + 3 * t->corner[i][v], text[v], sizeof text[v]);
    return rs_fail(message, RSURF_GEOMETRY,
                   "%s: the triangle %s%s%s has no area: its corners are on a line: repair the surface", name, text[0], text[1],
                   text[2]);
  }
  return RSURF_OK;
}

rsurf_status rsurf_repair(rsurf_surface *s, const char *name, rsurf_repairs *repairs, rsurf_message *message)
{
  rs_edges      e         = {.count = NULL};
  rs_triangles  triangles = {.num = 0};
  double       *xyz       = unit_coordinates(s);
  int64_t      *shell     = NULL, num_shells;
  int8_t       *turned    = NULL;
  rsurf_repairs did       = {0};
  rsurf_status  status    = xyz ? RSURF_OK : rs_no_memory(message);

  if (status != RSURF_OK) goto done;
  RS_GOTO(done, status = clean_faces(s, xyz, name, &did, message));
  RS_GOTO(done, status = rs_flip_caps(s, xyz, &did, message));
  shell  = ra_zeros(s->num_faces, sizeof *shell);
  turned = ra_zeros(s->num_faces, sizeof *turned);
  RS_GOTO(done, status = shell && turned && rs_find_edges(s, &e) ? RSURF_OK : rs_no_memory(message));
  RS_GOTO(done, status = check_edges(s, &e, name, message));
  RS_GOTO(done, status = spread(s, &e, name, shell, turned, &num_shells, message));
  for (int64_t f = 0; f < s->num_faces; f++)
    if (turned[f]) rs_turn_face(s, f);
  RS_GOTO(done, status = rs_fan(s, &triangles) ? RSURF_OK : rs_no_memory(message));
  RS_GOTO(done, status = check_areas(s, xyz, name, &triangles, message));
  RS_GOTO(done, status = rs_make_bodies(s, xyz, name, num_shells, shell, turned, &triangles, &did, message));
  for (int64_t f = 0; f < s->num_faces; f++) did.faces_turned += turned[f];
  *repairs         = did;
  message->text[0] = 0;
done:
  rs_edges_drop(&e);
  free(triangles.corner);
  free(triangles.face);
  free(shell);
  free(turned);
  free(xyz);
  return status;
}

remap_mesh rsurf_mesh(const rsurf_surface *s, const char *name)
{
  return (remap_mesh){.num_nodes      = s->num_nodes,
                      .num_faces      = s->num_faces,
                      .num_cells      = s->num_bodies,
                      .node_xyz       = s->node_xyz,
                      .face_offset    = s->face_offset,
                      .face_node      = s->face_node,
                      .face_owner     = s->face_body,
                      .face_neighbour = s->face_none,
                      .name           = name};
}
