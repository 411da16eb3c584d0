/* write -- lines of surfaces as text with all digits: OBJ, or STL, whose binary kind holds single precision only. */
#include "surface_private.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

int rsurf_is_stl(const char *path)
{
  const size_t n = strlen(path);

  return rsurf_is_path(path) && (path[n - 1] == 'l' || path[n - 1] == 'L');
}

void rsurf_print_head(FILE *out, int is_stl, const char *group) { fprintf(out, "%s %s\n", is_stl ? "solid" : "g", group); }

void rsurf_print_foot(FILE *out, int is_stl, const char *group)
{
  if (is_stl) fprintf(out, "endsolid %s\n", group);
}

void rsurf_print_facet(FILE *out, const double *const corner[3])
{
  const double *a = corner[0], *b = corner[1], *c = corner[2];
  double        normal[3], length = 0;

  for (int k = 0; k < 3; k++) {
    const int x = (k + 1) % 3, y = (k + 2) % 3;

    normal[k] = (b[x] - a[x]) * (c[y] - a[y]) - (b[y] - a[y]) * (c[x] - a[x]);
    length += normal[k] * normal[k];
  }
  length = length > 0 && isfinite(length) ? sqrt(length) : 1;
  fprintf(out, "facet normal %.9g %.9g %.9g\n outer loop\n", normal[0] / length, normal[1] / length, normal[2] / length);
  for (int v = 0; v < 3; v++) fprintf(out, "  vertex %.17g %.17g %.17g\n", corner[v][0], corner[v][1], corner[v][2]);
  fputs(" endloop\nendfacet\n", out);
}

void rsurf_print_node(FILE *out, const double xyz[3]) { fprintf(out, "v %.17g %.17g %.17g\n", xyz[0], xyz[1], xyz[2]); }

void rsurf_print_polygon(FILE *out, int64_t n, const int64_t *node)
{
  fputc('f', out);
  for (int64_t i = 0; i < n; i++) fprintf(out, " %lld", (long long)node[i] + 1);
  fputc('\n', out);
}
