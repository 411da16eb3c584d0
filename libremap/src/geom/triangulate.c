/* triangulate -- a polygon's triangles, by its vertices' coordinates alone.
 *
 * The loop is brought to canonical form: vertices repeated in a row and spikes (b c b) drop out, it starts at the
 * lexicographically smallest vertex and runs towards the smaller neighbour. Every rounded sum and every choice follows that
 * order; a loop given the other way round only has its triangles turned at the end. A loop that passes through one point more
 * than once is cut there into parts. So the boundary of the triangles is the loop, edge by edge, whatever its shape.
 *
 * Cost: about 20 ns for a triangle, 50-75 ns for a quadrangle; O(n) for a fan besides the search for repeated points, which is
 * O(n^2) as ears are. */
#include "geom/geom_private.h"

#include <math.h>
#include <string.h>

/* Where triangles go. */
typedef struct sink {
  const double (*xyz)[3];
  bool reversed; /* the canonical loop runs against the input */
  int *corner;   /* [3 num]                                   */
  int  num;
} sink;

static inline void emit(sink *out, int a, int b, int c)
{
  int *corner = out->corner + 3 * out->num++;

  corner[0] = a;
  corner[1] = out->reversed ? c : b;
  corner[2] = out->reversed ? b : c;
}

/* -1, 0, +1 in lexicographic order. */
static inline int compare(const double a[3], const double b[3])
{
  for (int k = 0; k < 3; k++)
    if (a[k] != b[k]) return a[k] < b[k] ? -1 : 1;
  return 0;
}

static inline double squared_distance(const double a[3], const double b[3])
{
  const double x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];
  return x * x + y * y + z * z;
}

/* normal += (a - o) x (b - o). */
static inline void add_normal(const double o[3], const double a[3], const double b[3], double normal[3])
{
  const double ax = a[0] - o[0], ay = a[1] - o[1], az = a[2] - o[2];
  const double bx = b[0] - o[0], by = b[1] - o[1], bz = b[2] - o[2];

  normal[0] += ay * bz - az * by;
  normal[1] += az * bx - ax * bz;
  normal[2] += ax * by - ay * bx;
}

/* Twice the area vector of a part. */
static inline void area_vector(const double (*xyz)[3], const int *part, int n, double area[3])
{
  area[0] = area[1] = area[2] = 0;
  for (int i = 1; i + 1 < n; i++) add_normal(xyz[part[0]], xyz[part[i]], xyz[part[i + 1]], area);
}

/* ---- ears --------------------------------------------------------------------------------------------------------- */

/* The view in which a part is seen flat: along the axis of its largest area, from the side that turns it counter-clockwise. */
typedef struct view {
  const double (*xyz)[3];
  int axis, side;
} view;

static inline view view_of(const double (*xyz)[3], const int *part, int n)
{
  double area[3];
  int    axis = 0;

  area_vector(xyz, part, n, area);
  for (int k = 1; k < 3; k++)
    if (fabs(area[k]) > fabs(area[axis])) axis = k;
  return (view){xyz, axis, rm_sign(area[axis])};
}

/* +1 where a, b, c turn left as seen in the view, -1 right, 0 straight on or back; exact. */
static inline int turn(const view *v, int a, int b, int c)
{
  return v->side * rm_cross_sign(v->xyz[a], v->xyz[b], v->xyz[a], v->xyz[c], v->axis);
}

/* True if vertex i of the part can be cut off: a left turn whose closed triangle holds no other vertex, be it on the
 * diagonal. */
static bool is_ear(const view *v, const int *part, int n, int i)
{
  const int before = i ? i - 1 : n - 1, after = i + 1 < n ? i + 1 : 0;
  const int a = part[before], b = part[i], c = part[after];

  if (turn(v, a, b, c) <= 0) return false;
  for (int k = 0; k < n; k++) {
    if (k == before || k == i || k == after) continue;
    if (turn(v, a, b, part[k]) >= 0 && turn(v, b, c, part[k]) >= 0 && turn(v, c, a, part[k]) >= 0) return false;
  }
  return true;
}

/* The ear with the shortest diagonal, the first one of equals; -1 if there is none. */
static int best_ear(const double (*xyz)[3], const int *part, const int *ear, int n)
{
  double shortest = 0;
  int    best     = -1;

  for (int i = 0; i < n; i++) {
    if (!ear[i]) continue;
    const double length = squared_distance(xyz[part[i ? i - 1 : n - 1]], xyz[part[i + 1 < n ? i + 1 : 0]]);

    if (best < 0 || length < shortest) best = i, shortest = length;
  }
  return best;
}

/* Cut ears off until a triangle is left; a fan from the first vertex where none can be cut. part is used up; ear is [n]. */
static void cut_ears(sink *out, int *part, int n, int *ear)
{
  const view v = view_of(out->xyz, part, n);

  for (int i = 0; i < n; i++) ear[i] = is_ear(&v, part, n, i);
  while (n > 3) {
    int i = best_ear(out->xyz, part, ear, n);

    if (i < 0) { /* a vertex cut off since may have freed another ear */
      for (int k = 0; k < n; k++) ear[k] = is_ear(&v, part, n, k);
      if ((i = best_ear(out->xyz, part, ear, n)) < 0) break;
    }
    emit(out, part[i ? i - 1 : n - 1], part[i], part[i + 1 < n ? i + 1 : 0]);
    n--;
    memmove(part + i, part + i + 1, (size_t)(n - i) * sizeof *part);
    memmove(ear + i, ear + i + 1, (size_t)(n - i) * sizeof *ear);
    const int before = i ? i - 1 : n - 1, after = i < n ? i : 0;
    ear[before] = is_ear(&v, part, n, before);
    ear[after]  = is_ear(&v, part, n, after);
  }
  for (int i = 1; i + 1 < n; i++) emit(out, part[0], part[i], part[i + 1]);
}

/* As few triangles as the part admits. A quadrangle that turns left everywhere, the common case, is cut along its shorter
 * diagonal, which is what cut_ears() would find. */
static void fewest_triangles(sink *out, int *part, int n, int *ear)
{
  const double(*xyz)[3] = out->xyz;

  if (n == 4) {
    const view v       = view_of(xyz, part, 4);
    const int  turns[] = {turn(&v, part[3], part[0], part[1]), turn(&v, part[0], part[1], part[2]),
                          turn(&v, part[1], part[2], part[3]), turn(&v, part[2], part[3], part[0])};

    if (turns[0] > 0 && turns[1] > 0 && turns[2] > 0 && turns[3] > 0) {
      const int first = squared_distance(xyz[part[1]], xyz[part[3]]) < squared_distance(xyz[part[0]], xyz[part[2]]);

      emit(out, part[first], part[first + 1], part[first + 2]);
      emit(out, part[first], part[first + 2], part[(first + 3) % 4]);
      return;
    }
  }
  cut_ears(out, part, n, ear);
}

/* ---- fan ---------------------------------------------------------------------------------------------------------- */

/* A face's loop cut into parts in which every point is distinct. */
typedef struct face_parts {
  int  num, total; /* parts; vertices of all           */
  int *vertex;     /* [total] in canonical order       */
  int *size;       /* [num], none below 3              */
} face_parts;

/* A fan about the mean of the vertices, unless one of its triangles runs against the area vector or the mean is a vertex. */
static bool fan(sink *out, const face_parts *face, double centre[3])
{
  const double(*xyz)[3] = out->xyz;
  const int first       = out->num;
  double    area[3] = {0, 0, 0};

  for (int k = 0; k < 3; k++) {
    double sum = 0, low = xyz[face->vertex[0]][k], high = low;

    for (int i = 0; i < face->total; i++) {
      const double x = xyz[face->vertex[i]][k];
      sum += x;
      low  = x < low ? x : low;
      high = x > high ? x : high;
    }
    sum /= face->total; /* rounding must not take it out of the face's box, by which cells are told to be apart */
    centre[k] = sum < low ? low : sum > high ? high : sum;
  }
  for (int p = 0, from = 0; p < face->num; from += face->size[p++]) {
    double part_area[3];

    area_vector(xyz, face->vertex + from, face->size[p], part_area);
    for (int k = 0; k < 3; k++) area[k] += part_area[k];
  }
  for (int p = 0, from = 0; p < face->num; from += face->size[p++])
    for (int i = 0; i < face->size[p]; i++) {
      const int a = face->vertex[from + i], b = face->vertex[from + (i + 1 < face->size[p] ? i + 1 : 0)];
      double    normal[3] = {0, 0, 0};

      add_normal(xyz[a], xyz[b], centre, normal);
      if (normal[0] * area[0] + normal[1] * area[1] + normal[2] * area[2] < 0 || rm_same_point(xyz[a], centre)) {
        out->num = first;
        return false;
      }
      emit(out, a, b, RM_CENTRE_POINT);
    }
  return true;
}

/* True if three points are on a line; exact. */
static bool collinear(const double a[3], const double b[3], const double c[3]) { return !rm_first_cross_sign(a, b, a, c); }

/* True if all vertices lie in one plane; exact. Warped faces are seen at the fourth vertex. */
static bool coplanar(const double (*xyz)[3], const int *vertex, int n)
{
  int third = 2;

  while (third < n && collinear(xyz[vertex[0]], xyz[vertex[1]], xyz[vertex[third]])) third++;
  for (int i = third + 1; i < n; i++)
    if (rm_orient3d(xyz[vertex[0]], xyz[vertex[1]], xyz[vertex[third]], xyz[vertex[i]])) return false;
  return true;
}

/* +1 or -1 by which way p -> q runs along the first of the two axes beside `axis` on which the points differ; 0 if on none. */
static inline int heading(const double p[3], const double q[3], int axis)
{
  const int x = (axis + 1) % 3, y = (axis + 2) % 3, sign = rm_sign(q[x] - p[x]);
  return sign ? sign : rm_sign(q[y] - p[y]);
}

/* A loop is the boundary of a convex polygon if it never turns right, or never left, and goes round once: then its heading
 * changes twice. */
bool rm_is_planar_convex(const double (*xyz)[3], int n)
{
  int third = 2, axis = 0, way = 0, changes = 0;

  if (n > 3 && rm_orient3d(xyz[0], xyz[1], xyz[2], xyz[3])) return false; /* as where faces are warped */
  while (third < n && collinear(xyz[0], xyz[1], xyz[third])) third++;
  if (third >= n) return false;
  for (int i = third == 2 ? 4 : 2; i < n; i++)
    if (i != third && rm_orient3d(xyz[0], xyz[1], xyz[third], xyz[i])) return false;
  while (!rm_cross_sign(xyz[0], xyz[1], xyz[0], xyz[third], axis)) axis++;
  for (int i = 0; i < n; i++) {
    const double *p = xyz[i], *q = xyz[(i + 1) % n], *r = xyz[(i + 2) % n];
    const int     side = rm_cross_sign(p, q, q, r, axis), from = heading(p, q, axis), to = heading(q, r, axis);

    if (!from || (side && way && side != way)) return false;
    way = side ? side : way;
    changes += from != to;
  }
  return changes == 2;
}

/* The rule of DESIGN 2.1. ear is scratch, [total]. */
static inline int triangulate_parts(sink *out, const face_parts *face, remap_faces faces, double centre[3], int *ear)
{
  if (face->num == 1 && face->total == 3) {
    emit(out, face->vertex[0], face->vertex[1], face->vertex[2]);
  } else if (faces == REMAP_FACES_DIAGONAL || coplanar(out->xyz, face->vertex, face->total) || !fan(out, face, centre)) {
    for (int p = 0, from = 0; p < face->num; from += face->size[p++])
      fewest_triangles(out, face->vertex + from, face->size[p], ear);
  }
  return out->num;
}

/* ---- canonical loop ----------------------------------------------------------------------------------------------- */

/* Drop vertices repeated in a row and spikes, around the loop's end too. kept is [n]; what is left are the returned number of
 * indices from kept[*begin] on. */
static int reduce(const double (*xyz)[3], int n, int *kept, int *begin)
{
  int first = 0, end = 0;

  for (int i = 0; i < n; i++) {
    if (end > 0 && rm_same_point(xyz[kept[end - 1]], xyz[i])) continue;
    if (end > 1 && rm_same_point(xyz[kept[end - 2]], xyz[i]))
      end--; /* the root of the spike stands for both */
    else
      kept[end++] = i;
  }
  while (end - first > 2) {
    if (rm_same_point(xyz[kept[first]], xyz[kept[end - 1]]))
      end--;
    else if (rm_same_point(xyz[kept[first]], xyz[kept[end - 2]]))
      end -= 2; /* the last vertex is the tip */
    else if (rm_same_point(xyz[kept[first + 1]], xyz[kept[end - 1]]))
      first++; /* the first vertex is the tip */
    else
      break;
  }
  *begin = first;
  return end - first;
}

/* A walk once around a loop. */
typedef struct walk {
  int from, step; /* step +1 or -1 */
} walk;

static inline int walk_at(walk w, int n, int k)
{
  const int i = w.from + w.step * k;
  return i < 0 ? i + n : i >= n ? i - n : i;
}

/* True if walk a comes before b, vertex by vertex. */
static bool walk_precedes(const double (*xyz)[3], const int *loop, int n, walk a, walk b)
{
  for (int k = 0; k < n; k++) {
    const int order = compare(xyz[loop[walk_at(a, n, k)]], xyz[loop[walk_at(b, n, k)]]);

    if (order) return order < 0;
  }
  return false;
}

/* The first of all walks around the loop: from the smallest vertex towards its smaller neighbour, and on where points
 * repeat. */
static walk canonical_walk(const double (*xyz)[3], const int *loop, int n)
{
  walk best = {0, 1};

  for (int i = 0; i < n; i++) {
    if (compare(xyz[loop[i]], xyz[loop[best.from]]) > 0) continue;
    for (int step = 1; step >= -1; step -= 2)
      if (walk_precedes(xyz, loop, n, (walk){i, step}, best)) best = (walk){i, step};
  }
  return best;
}

/* Parts of fewer than three vertices enclose nothing. */
static void add_part(face_parts *face, const int *vertex, int n)
{
  if (n < 3) return;
  memcpy(face->vertex + face->total, vertex, (size_t)n * sizeof *vertex);
  face->size[face->num++] = n;
  face->total += n;
}

/* Cut the loop wherever it comes back to a point. The loop is used up as a stack of what waits to be closed. */
static void cut_into_parts(const double (*xyz)[3], int *loop, int n, face_parts *face)
{
  int top = 0;

  for (int i = 0; i < n; i++) {
    int met = 0;

    while (met < top && !rm_same_point(xyz[loop[met]], xyz[loop[i]])) met++;
    if (met < top) {
      add_part(face, loop + met, top - met);
      top = met + 1;
    } else {
      loop[top++] = loop[i];
    }
  }
  add_part(face, loop, top);
}

/* Any loop. */
static int triangulate_polygon(sink *out, int n, remap_faces faces, double centre[3], int *work)
{
  int       *kept = work, *loop = work + n, begin;
  const int  m     = reduce(out->xyz, n, kept, &begin);
  face_parts face  = {0, 0, work + 2 * n, work + 3 * n};
  const walk first = m < 3 ? (walk){0, 1} : canonical_walk(out->xyz, kept + begin, m);

  if (m < 3) return 0;
  for (int k = 0; k < m; k++) loop[k] = kept[begin + walk_at(first, m, k)];
  out->reversed = first.step < 0;
  cut_into_parts(out->xyz, loop, m, &face);
  return triangulate_parts(out, &face, faces, centre, kept);
}

/* A triangle or quadrangle of distinct points, n = 3 or 4, without the general machinery: the same result. Returns -1 if a
 * point is repeated. */
static inline int triangulate_small(sink *out, int n, remap_faces faces, double centre[3])
{
  const double(*xyz)[3] = out->xyz;
  int vertex[4], ear[4], smallest = 0;

  for (int i = 0; i < n; i++)
    for (int j = i + 1; j < n; j++)
      if (rm_same_point(xyz[i], xyz[j])) return -1;
  for (int i = 1; i < n; i++)
    if (compare(xyz[i], xyz[smallest]) < 0) smallest = i;
  const int after = smallest + 1 < n ? smallest + 1 : 0, before = smallest ? smallest - 1 : n - 1;

  out->reversed = compare(xyz[before], xyz[after]) < 0;
  for (int k = 0; k < n; k++) vertex[k] = walk_at((walk){smallest, out->reversed ? -1 : 1}, n, k);
  return triangulate_parts(out, &(face_parts){1, n, vertex, &n}, faces, centre, ear);
}

int rm_triangulate(const double (*xyz)[3], int n, remap_faces faces, int *corner, double centre[3], int *work)
{
  sink out = {xyz, false, corner, 0};

  if (n == 3 || n == 4) {
    const int num = triangulate_small(&out, n, faces, centre);
    if (num >= 0) return num;
  }
  return triangulate_polygon(&out, n, faces, centre, work);
}
