/* bench_openfoam -- write the meshes of a case as two OpenFOAM cases, FOLDER/source and FOLDER/target, with one uniform field,
 * for openfoam.sh. Internal faces come first, each owned by the lower of its cells, in the order of owners and neighbours.
 *
 *   bench_openfoam CASE N FOLDER
 *
 * Cases: bench.h. The folders source/system, source/constant/polyMesh, source/0 ... must exist. */
#include "bench.h"

/* A file of the case, opened and with its header written. */
static FILE *begin(const char *folder, const char *name, const char *class)
{
  char        path[4096];
  const char *object = strrchr(name, '/') + 1;
  FILE       *out;

  snprintf(path, sizeof path, "%s/%s", folder, name);
  out = fopen(path, "w");
  if (!out) {
    fprintf(stderr, "bench_openfoam: %s cannot be written\n", path);
    exit(1);
  }
  fprintf(out, "FoamFile { version 2.0; format ascii; class %s; object %s; }\n", class, object);
  return out;
}

static void write_text(const char *folder, const char *name, const char *class, const char *text)
{
  FILE *out = begin(folder, name, class);

  fputs(text, out);
  fclose(out);
}

/* A face in OpenFOAM's order. */
typedef struct ranked {
  int64_t face, low, high; /* low: the owner; high: the neighbour, -1 on the boundary */
} ranked;

static int by_cells(const void *a, const void *b)
{
  const ranked *x = a, *y = b;

  if ((x->high < 0) != (y->high < 0)) return x->high < 0 ? 1 : -1;
  if (x->low != y->low) return x->low < y->low ? -1 : 1;
  return (x->high > y->high) - (x->high < y->high);
}

static ranked *rank_faces(const tm_mesh *m, int64_t *num_internal)
{
  ranked *list = tm_alloc_(m->view.num_faces, sizeof *list);

  *num_internal = 0;
  for (int64_t f = 0; f < m->view.num_faces; f++) {
    const int64_t a = m->owner[f], b = m->neighbour[f];
    list[f] = (ranked){f, b >= 0 && b < a ? b : a, b >= 0 && b < a ? a : b};
    *num_internal += b >= 0;
  }
  qsort(list, (size_t)m->view.num_faces, sizeof *list, by_cells);
  return list;
}

static void write_faces(const char *folder, const tm_mesh *m, const ranked *list)
{
  FILE *out = begin(folder, "constant/polyMesh/faces", "faceList");

  fprintf(out, "%lld\n(\n", (long long)m->view.num_faces);
  for (int64_t k = 0; k < m->view.num_faces; k++) {
    const int64_t f = list[k].face, first = m->face_offset[f], n = m->face_offset[f + 1] - first;
    const bool    turned = list[k].low != m->owner[f];

    fprintf(out, "%lld(", (long long)n);
    for (int64_t h = 0; h < n; h++)
      fprintf(out, "%s%lld", h ? " " : "", (long long)m->face_node[first + (turned ? n - 1 - h : h)]);
    fputs(")\n", out);
  }
  fputs(")\n", out);
  fclose(out);
}

static void write_mesh(const char *folder, const tm_mesh *m)
{
  int64_t num_internal;
  ranked *list = rank_faces(m, &num_internal);
  FILE   *out  = begin(folder, "constant/polyMesh/points", "vectorField");

  fprintf(out, "%lld\n(\n", (long long)m->view.num_nodes);
  for (int64_t v = 0; v < m->view.num_nodes; v++)
    fprintf(out, "(%.17g %.17g %.17g)\n", m->xyz[3 * v], m->xyz[3 * v + 1], m->xyz[3 * v + 2]);
  fputs(")\n", out);
  fclose(out);
  write_faces(folder, m, list);
  for (int side = 0; side < 2; side++) {
    const int64_t n = side ? num_internal : m->view.num_faces;
    out = begin(folder, side ? "constant/polyMesh/neighbour" : "constant/polyMesh/owner", "labelList");
    fprintf(out, "%lld\n(\n", (long long)n);
    for (int64_t k = 0; k < n; k++) fprintf(out, "%lld\n", (long long)(side ? list[k].high : list[k].low));
    fputs(")\n", out);
    fclose(out);
  }
  out = begin(folder, "constant/polyMesh/boundary", "polyBoundaryMesh");
  fprintf(out, "1 ( all { type patch; nFaces %lld; startFace %lld; } )\n", (long long)(m->view.num_faces - num_internal),
          (long long)num_internal);
  fclose(out);
  free(list);
}

int main(int argc, char **argv)
{
  static const char *const name[2] = {"source", "target"};
  tm_mesh *mesh[2];
  char     folder[4000];

  if (argc != 4 || atoi(argv[2]) < 1 || !bench_meshes(argv[1], atoi(argv[2]), mesh))
    return fprintf(stderr, "usage: bench_openfoam " BENCH_CASES " N FOLDER\n"), 2;
  for (int side = 0; side < 2; side++) {
    snprintf(folder, sizeof folder, "%s/%s", argv[3], name[side]);
    write_mesh(folder, mesh[side]);
    write_text(
        folder, "system/controlDict", "dictionary",
        "application none; startFrom startTime; startTime 0; stopAt endTime; endTime 1; deltaT 1; writeControl timeStep;\n"
        "writeInterval 1; writeFormat ascii; writePrecision 8; timeFormat general; timePrecision 6;\n");
    write_text(folder, "system/fvSchemes", "dictionary",
               "ddtSchemes {} gradSchemes { default Gauss linear; } divSchemes {} laplacianSchemes {}\n"
               "interpolationSchemes { default linear; } snGradSchemes { default corrected; }\n");
    write_text(folder, "system/fvSolution", "dictionary", "solvers {}\n");
    write_text(folder, "system/mapFieldsDict", "dictionary", "patchMap (); cuttingPatches ( all );\n"); /* cells alone */
    write_text(folder, "0/T", "volScalarField",
               "dimensions [0 0 0 0 0 0 0]; internalField uniform 1; boundaryField { all { type zeroGradient; } }\n");
    tm_free(mesh[side]);
  }
  return 0;
}
