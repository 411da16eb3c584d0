/* files -- what the tests of the CGNS adapter share: files made node by node, and a mesh's volumes.
 *
 *   cf_file  *f    = cf_new(4.2);
 *   const int64_t zone = cf_zone(f, cf_base(f), "Z", 1, (int64_t[]){8, 1, 0});
 *   cf_ints(f, zone, ...);
 *   cf_write(f, path);   // rank 0 writes, all wait; f is freed
 *
 * Memory that runs out ends the program. */
#ifndef FILES_H
#define FILES_H

#include "cgns_private.h"
#include "meshes.h"
#include "rt.h"

#include <stdarg.h>
#include <unistd.h>

typedef struct cf_file {
  rc_plan plan;
  void   *own[1024];
  int     num_own;
} cf_file;

/* A name in the working folder that no other program or number of ranks uses. */
static inline const char *cf_path(char out[64], const char *name)
{
  snprintf(out, 64, "cgns_%s_np%d.cgns", name, rt_size());
  return out;
}

static inline void *cf_keep(cf_file *f, const void *data, size_t bytes)
{
  void *copy = malloc(bytes + 1);

  if (!copy || f->num_own == (int)(sizeof f->own / sizeof *f->own)) abort();
  memcpy(copy, data, bytes);
  return f->own[f->num_own++] = copy;
}

static inline int64_t cf_put(cf_file *f, int64_t parent, const char *name, const char *label, const char *type, int nd,
                             const int64_t *dim, char kind, const void *values)
{
  size_t count = kind == 'C' ? 1 : 8;

  for (int d = 0; d < nd; d++) count *= (size_t)dim[d];
  return rc_plan_add(&f->plan, parent, name, label, type, nd, dim, kind, nd ? cf_keep(f, values, count) : NULL);
}
static inline int64_t cf_empty(cf_file *f, int64_t parent, const char *name, const char *label)
{
  return cf_put(f, parent, name, label, NULL, 0, NULL, 0, NULL);
}
static inline int64_t cf_text(cf_file *f, int64_t parent, const char *name, const char *label, const char *text)
{
  return cf_put(f, parent, name, label, "C1", 1, (int64_t[]){(int64_t)strlen(text)}, 'C', text);
}
static inline int64_t cf_ints(cf_file *f, int64_t parent, const char *name, const char *label, int64_t n, const int64_t *values)
{
  return cf_put(f, parent, name, label, "I8", 1, &n, 'I', values);
}
static inline int64_t cf_reals(cf_file *f, int64_t parent, const char *name, int64_t n, const double *values)
{
  return cf_put(f, parent, name, "DataArray_t", "R8", 1, &n, 'R', values);
}

static inline cf_file *cf_new(double version)
{
  cf_file *f = calloc(1, sizeof *f);

  if (!f) abort();
  cf_put(f, -1, "CGNSLibraryVersion", "CGNSLibraryVersion_t", "R4", 1, (int64_t[]){1}, 'R', &version);
  return f;
}
static inline int64_t cf_base(cf_file *f)
{
  return cf_put(f, -1, "Base", "CGNSBase_t", "I4", 1, (int64_t[]){2}, 'I', (int64_t[]){3, 3});
}
/* nd 1: unstructured, size[3]; nd 3: a block, size[9]. */
static inline int64_t cf_zone(cf_file *f, int64_t base, const char *name, int64_t nd, const int64_t *size)
{
  const int64_t zone = cf_put(f, base, name, "Zone_t", "I8", 2, (int64_t[]){3, nd}, 'I', size);

  cf_text(f, zone, "ZoneType", "ZoneType_t", nd == 1 ? "Unstructured" : "Structured");
  return zone;
}
/* xyz is [n][3]; dim is slowest first. */
static inline int64_t cf_coordinates(cf_file *f, int64_t zone, const double *xyz, int nd, const int64_t *dim)
{
  static const char *const name[3] = {"CoordinateX", "CoordinateY", "CoordinateZ"};
  const int64_t            grid    = cf_empty(f, zone, "GridCoordinates", "GridCoordinates_t");
  int64_t                  n       = 1;

  for (int d = 0; d < nd; d++) n *= dim[d];
  for (int k = 0; k < 3; k++) {
    double *x = malloc((size_t)n * sizeof *x + 1);

    if (!x) abort();
    for (int64_t i = 0; i < n; i++) x[i] = xyz[3 * i + k];
    cf_put(f, grid, name[k], "DataArray_t", "R8", nd, dim, 'R', x);
    free(x);
  }
  return grid;
}
static inline int64_t cf_section(cf_file *f, int64_t zone, const char *name, int64_t code, int64_t first, int64_t last,
                                 int64_t n, const int64_t *connectivity)
{
  const int64_t at = cf_ints(f, zone, name, "Elements_t", 2, (int64_t[]){code, 0});

  cf_ints(f, at, "ElementRange", "IndexRange_t", 2, (int64_t[]){first, last});
  cf_ints(f, at, "ElementConnectivity", "DataArray_t", n, connectivity);
  return at;
}
static inline void cf_offsets(cf_file *f, int64_t section, int64_t n, const int64_t *offset)
{
  cf_ints(f, section, "ElementStartOffset", "DataArray_t", n, offset);
}
/* A CellCenter solution with one field. */
static inline int64_t cf_solution(cf_file *f, int64_t zone, const char *name, const char *field, int64_t n,
                                  const double *values)
{
  const int64_t at = cf_empty(f, zone, name, "FlowSolution_t");

  cf_text(f, at, "GridLocation", "GridLocation_t", "CellCenter");
  if (n) cf_reals(f, at, field, n, values);
  return at;
}

/* Write and free. Collective. */
static inline void cf_write(cf_file *f, const char *path)
{
  rcgns_message why = {""};

  if (rt_rank() == 0 && rc_h5_skeleton(path, &f->plan, &why) != RCGNS_OK) {
    printf("# %s: %s\n", path, why.text);
    abort();
  }
  rc_plan_drop(&f->plan);
  for (int i = 0; i < f->num_own; i++) free(f->own[i]);
  free(f);
  MPI_Barrier(MPI_COMM_WORLD);
}
static inline void cf_remove(const char *path)
{
  MPI_Barrier(MPI_COMM_WORLD);
  if (rt_rank() == 0) unlink(path);
}

/* ---- volumes ------------------------------------------------------------------------------------------------------ */

/* Volumes of the rank's cells, faces fanned about the mean of their nodes; the caller frees. *open, if not NULL, counts the
 * cells whose faces' areas do not sum to nothing. */
static inline double *cf_volumes(const remap_mesh *m, int64_t *open)
{
  double *volume = tm_alloc_(m->num_cells, sizeof *volume), *area = tm_alloc_(3 * m->num_cells, sizeof *area);
  double *size = tm_alloc_(m->num_cells, sizeof *size), *origin = tm_alloc_(3 * m->num_cells, sizeof *origin);
  bool   *seen = tm_alloc_(m->num_cells, sizeof *seen);

  for (int64_t f = 0; f < m->num_faces; f++) {
    const int64_t *node = m->face_node + m->face_offset[f], n = m->face_offset[f + 1] - m->face_offset[f];

    for (int side = 0; side < 2; side++) {
      const int64_t c       = side ? m->face_neighbour[f] : m->face_owner[f];
      double        mean[3] = {0, 0, 0};

      if (c < 0) continue;
      if (!seen[c]) memcpy(origin + 3 * c, m->node_xyz + 3 * node[0], 3 * sizeof(double));
      seen[c] = true;
      for (int64_t i = 0; i < n; i++)
        for (int d = 0; d < 3; d++) mean[d] += (m->node_xyz[3 * node[i] + d] - origin[3 * c + d]) / (double)n;
      for (int64_t i = 0; i < n; i++) {
        const double *a = m->node_xyz + 3 * node[i], *b = m->node_xyz + 3 * node[(i + 1) % n];
        double        p[3], q[3], cross[3];

        for (int d = 0; d < 3; d++) p[d] = a[d] - origin[3 * c + d], q[d] = b[d] - origin[3 * c + d];
        for (int d = 0; d < 3; d++) cross[d] = p[(d + 1) % 3] * q[(d + 2) % 3] - p[(d + 2) % 3] * q[(d + 1) % 3];
        for (int d = 0; d < 3; d++) {
          volume[c] += (side ? -1 : 1) * mean[d] * cross[d] / 6.0;
          area[3 * c + d] += (side ? -1 : 1) * cross[d];
          size[c] += fabs(cross[d]);
        }
      }
    }
  }
  for (int64_t c = 0; open && c < m->num_cells; c++)
    for (int d = 0; d < 3; d++)
      if (fabs(area[3 * c + d]) > 1e-9 * size[c]) {
        ++*open;
        break;
      }
  free(area);
  free(size);
  free(origin);
  free(seen);
  return volume;
}

static inline double cf_sum(double mine)
{
  MPI_Allreduce(MPI_IN_PLACE, &mine, 1, MPI_DOUBLE, MPI_SUM, MPI_COMM_WORLD);
  return mine;
}
static inline int64_t cf_count(int64_t mine)
{
  MPI_Allreduce(MPI_IN_PLACE, &mine, 1, MPI_INT64_T, MPI_SUM, MPI_COMM_WORLD);
  return mine;
}

/* Open, and say why not. Collective. */
static inline rcgns_file *cf_open(const char *path, const rcgns_options *options)
{
  rcgns_file   *file = NULL;
  rcgns_message why;

  if (!RT_EQ(rcgns_open(MPI_COMM_WORLD, path, options, &file, &why), RCGNS_OK) && rt_rank() == 0) printf("# %s\n", why.text);
  return file;
}

/* Total volume of a file's mesh; every cell must be closed and of positive volume. Collective. */
static inline double cf_total(const rcgns_file *file)
{
  const remap_mesh *mesh = rcgns_mesh(file);
  int64_t           open = 0, inverted = 0;
  double           *volume = cf_volumes(mesh, &open), sum = 0.0;

  for (int64_t c = 0; c < mesh->num_cells; c++) sum += volume[c], inverted += !(volume[c] > 0.0);
  free(volume);
  RT_EQ(open, 0);
  RT_EQ(inverted, 0);
  return cf_sum(sum);
}

/* Integral of a field of the chosen solution. Collective. */
static inline double cf_integral(rcgns_file *file, const char *name)
{
  const remap_mesh *mesh   = rcgns_mesh(file);
  double           *volume = cf_volumes(mesh, NULL), *value = tm_alloc_(mesh->num_cells, sizeof *value), sum = 0.0;
  rcgns_message     why;

  if (!RT_EQ(rcgns_read_field(file, name, value, &why), RCGNS_OK) && rt_rank() == 0) printf("# %s\n", why.text);
  for (int64_t c = 0; c < mesh->num_cells; c++) sum += volume[c] * value[c];
  free(volume);
  free(value);
  return cf_sum(sum);
}

static inline bool cf_has_note(const rcgns_file *file, const char *words)
{
  const rcgns_info *info = rcgns_get_info(file);

  for (int64_t i = 0; i < info->num_notes; i++)
    if (strstr(info->note[i], words)) return true;
  return false;
}

/* The same text on every rank? Collective. */
static inline bool cf_is_agreed(const rcgns_message *message)
{
  rcgns_message first = *message;

  MPI_Bcast(first.text, (int)sizeof first.text, MPI_CHAR, 0, MPI_COMM_WORLD);
  return rt_all(!strcmp(first.text, message->text));
}

/* ---- a small zoo: a hexahedron, two prisms, a pyramid and a tetrahedron, volume 2.5, four inner faces ---------------- */

enum { CF_ZOO_NODES = 14, CF_ZOO_CELLS = 5 };
static const double  CF_ZOO_XYZ[3 * CF_ZOO_NODES] = {0, 0, 0, 1, 0, 0, 2, 0, 0, 0, 1, 0, 1, 1, 0, 2,   1,   0, 0,   0,   1,
                                                     1, 0, 1, 2, 0, 1, 0, 1, 1, 1, 1, 1, 2, 1, 1, 0.5, 0.5, 2, 1.5, 0.5, 2};
static const int64_t CF_ZOO_HEXA[8] = {1, 2, 5, 4, 7, 8, 11, 10}, CF_ZOO_PENTA[12] = {2, 3, 6, 8, 9, 12, 2, 6, 5, 8, 12, 11};
static const int64_t CF_ZOO_PYRA[5] = {7, 8, 11, 10, 13}, CF_ZOO_TETRA[4] = {8, 9, 12, 14}, CF_ZOO_QUAD[4] = {1, 2, 8, 7};

static inline int64_t cf_zoo_zone(cf_file *f, int64_t base, const char *name)
{
  const int64_t zone = cf_zone(f, base, name, 1, (int64_t[]){CF_ZOO_NODES, CF_ZOO_CELLS, 0});

  cf_coordinates(f, zone, CF_ZOO_XYZ, 1, (int64_t[]){CF_ZOO_NODES});
  return zone;
}
#endif
