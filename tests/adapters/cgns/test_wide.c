/* Counts, offsets and element numbers beyond 2^31 and 2^32: small meshes at the far end of arrays that are so long, in files
 * that are sparse on the disk. What lies before is rind, or rows that no offset names, and must never be read. */
#include "files.h"

#include <hdf5.h>

static const int64_t FAR = (INT64_C(1) << 32) + 9, MANY = INT64_C(5000000000);
enum { TWO_NODES = 12, TWO_CELLS = 2 };
static const int64_t TWO_HEXA[8 * TWO_CELLS] = {1, 2, 5, 4, 7, 8, 11, 10, 2, 3, 6, 5, 8, 9, 12, 11}; /* of CF_ZOO_XYZ */

/* ---- sparse files ------------------------------------------------------------------------------------------------- */

/* Does the file system take files of 2^38 bytes that are nearly empty? Collective. */
static bool can_be_sparse(void)
{
  char path[64];
  int  ok = 1;

  cf_path(path, "sparse");
  if (rt_rank() == 0) {
    FILE *file = fopen(path, "wb");

    ok = file && !fclose(file) && !truncate(path, (off_t)(INT64_C(1) << 38));
    unlink(path);
  }
  ok = rt_all(ok);
  if (!ok) rt_skip("the file system takes no sparse file of 2^38 bytes");
  return ok;
}

/* An array of which one box is written and the rest a hole. */
typedef struct sparse {
  hid_t   stored;
  int     nd;
  int64_t dim[3], origin[3], shape[3];
} sparse;

static sparse row(hid_t stored, int64_t before, int64_t n)
{
  return (sparse){.stored = stored, .nd = 1, .dim = {before + n}, .origin = {before}, .shape = {n}};
}

/* The payload of the node at `path` of a file that is there. Rank 0 works. */
static void put_sparse(const char *file, const char *path, sparse s, hid_t memory, const void *values)
{
  hsize_t dim[3], origin[3], shape[3];
  hid_t   to, group, data, space, box, list;

  for (int d = 0; d < s.nd; d++) {
    dim[d]    = (hsize_t)s.dim[d];
    origin[d] = (hsize_t)s.origin[d];
    shape[d]  = (hsize_t)s.shape[d];
  }
  if (rt_rank()) return;
  to    = H5Fopen(file, H5F_ACC_RDWR, H5P_DEFAULT);
  group = H5Gopen2(to, path, H5P_DEFAULT);
  list  = H5Pcreate(H5P_DATASET_CREATE);
  H5Pset_alloc_time(list, H5D_ALLOC_TIME_EARLY);
  H5Pset_fill_time(list, H5D_FILL_TIME_NEVER);
  space = H5Screate_simple(s.nd, dim, NULL);
  box   = H5Screate_simple(s.nd, shape, NULL);
  data  = H5Dcreate2(group, " data", s.stored, space, H5P_DEFAULT, list, H5P_DEFAULT);
  RT_CHECK(data >= 0);
  if (values) {
    RT_CHECK(H5Sselect_hyperslab(space, H5S_SELECT_SET, origin, NULL, shape, NULL) >= 0);
    RT_CHECK(H5Dwrite(data, memory, box, space, H5P_DEFAULT, values) >= 0);
  }
  H5Dclose(data);
  H5Sclose(box);
  H5Sclose(space);
  H5Pclose(list);
  H5Gclose(group);
  RT_CHECK(H5Fclose(to) >= 0);
}

/* The file must hold so many cells, closed and of positive volume, and so much volume. Removes the file. */
static void check_mesh(const char *path, int64_t cells, double volume)
{
  rcgns_file *file = cf_open(path, NULL);

  if (file) {
    RT_EQ(rcgns_get_info(file)->num_cells, cells);
    RT_NEAR(cf_total(file), volume, 1e-14);
    rcgns_close(&file);
  }
  cf_remove(path);
}

static void refuse(const char *path, const char *words)
{
  rcgns_file   *file = NULL;
  rcgns_message why  = {""};

  MPI_Barrier(MPI_COMM_WORLD);
  RT_EQ(rcgns_open(MPI_COMM_WORLD, path, NULL, &file, &why), RCGNS_IO);
  if (!RT_CHECK(strstr(why.text, words) && strstr(why.text, path)) && rt_rank() == 0)
    printf("# \"%s\", want \"%s\"\n", why.text, words);
  rcgns_close(&file);
  cf_remove(path);
}

/* ---- reading ------------------------------------------------------------------------------------------------------ */

/* Two hexahedra, the last of so many rows of a section, after as many nodes and values that are rind. */
static void hexahedra_at(hid_t stored, int64_t before)
{
  static const char *const name[3]          = {"CoordinateX", "CoordinateY", "CoordinateZ"};
  static const double      value[TWO_CELLS] = {3.0, 5.0};
  cf_file                 *f                = cf_new(4.2);
  const int64_t            zone             = cf_zone(f, cf_base(f), "Z", 1, (int64_t[]){TWO_NODES, TWO_CELLS, 0});
  const int64_t            grid             = cf_empty(f, zone, "GridCoordinates", "GridCoordinates_t");
  const int64_t            hexa             = cf_ints(f, zone, "Hexa", "Elements_t", 2, (int64_t[]){17, 0});
  const int64_t            flow             = cf_solution(f, zone, "Flow", "Density", 0, NULL);
  char                     path[64], at[64];
  rcgns_file              *file;
  rcgns_solution           chosen;
  rcgns_message            why;

  cf_ints(f, hexa, "ElementRange", "IndexRange_t", 2, (int64_t[]){1, before + TWO_CELLS});
  cf_empty(f, hexa, "ElementConnectivity", "DataArray_t");
  cf_empty(f, flow, "Density", "DataArray_t");
  for (int d = 0; d < 3; d++) cf_empty(f, grid, name[d], "DataArray_t");
  for (int i = 0; i < 3; i++) cf_ints(f, i == 0 ? hexa : i == 1 ? grid : flow, "Rind", "Rind_t", 2, (int64_t[]){before, 0});
  cf_write(f, cf_path(path, "hexahedra"));
  put_sparse(path, "/Base/Z/Hexa/ElementConnectivity", row(stored, 8 * before, 8 * TWO_CELLS), H5T_NATIVE_INT64, TWO_HEXA);
  put_sparse(path, "/Base/Z/Flow/Density", row(H5T_NATIVE_FLOAT, before, TWO_CELLS), H5T_NATIVE_DOUBLE, value);
  for (int d = 0; d < 3; d++) {
    double x[TWO_NODES];

    for (int i = 0; i < TWO_NODES; i++) x[i] = CF_ZOO_XYZ[3 * i + d];
    snprintf(at, sizeof at, "/Base/Z/GridCoordinates/%s", name[d]);
    put_sparse(path, at, row(H5T_NATIVE_FLOAT, before, TWO_NODES), H5T_NATIVE_DOUBLE, x);
  }
  MPI_Barrier(MPI_COMM_WORLD);
  if ((file = cf_open(path, NULL))) {
    RT_EQ(rcgns_select_solution(file, NULL, &chosen, &why), RCGNS_OK);
    RT_NEAR(cf_integral(file, "Density"), 8.0, 1e-14);
    rcgns_close(&file);
  }
  check_mesh(path, TWO_CELLS, 2.0);
}

static void hexahedra_beyond_2_to_the_31_and_32_are_read(void)
{
  if (!can_be_sparse()) return;
  hexahedra_at(H5T_NATIVE_INT32, (INT64_C(1) << 31) / 8 + 3); /* entries beyond 2^31, bytes beyond 2^33 */
  hexahedra_at(H5T_NATIVE_INT32, INT64_C(600000000));         /* entries beyond 2^32 */
  hexahedra_at(H5T_NATIVE_INT64, FAR);                        /* rows, nodes and values beyond 2^32 as well */
}

static void blocks_behind_2_to_the_32_layers_of_rind_are_read(void)
{
  static const char *const name[3] = {"CoordinateX", "CoordinateY", "CoordinateZ"};
  const int64_t            layers  = (INT64_C(1) << 30) + 1; /* of 4 vertices */
  cf_file                 *f       = cf_new(4.2);
  const int64_t            zone    = cf_zone(f, cf_base(f), "Z", 3, (int64_t[]){2, 2, 3, 1, 1, 2, 0, 0, 0});
  const int64_t            grid    = cf_empty(f, zone, "GridCoordinates", "GridCoordinates_t");
  char                     path[64], at[64];

  for (int d = 0; d < 3; d++) cf_empty(f, grid, name[d], "DataArray_t");
  cf_ints(f, grid, "Rind", "Rind_t", 6, (int64_t[]){0, 0, 0, 0, layers, 0});
  cf_write(f, cf_path(path, "block"));
  if (!can_be_sparse()) {
    cf_remove(path);
    return;
  }
  for (int d = 0; d < 3; d++) {
    double x[12];

    for (int i = 0; i < 12; i++) x[i] = d == 0 ? i & 1 : d == 1 ? i >> 1 & 1 : i >> 2;
    snprintf(at, sizeof at, "/Base/Z/GridCoordinates/%s", name[d]);
    put_sparse(path, at,
               (sparse){.stored = H5T_NATIVE_FLOAT, .nd = 3, .dim = {layers + 3, 2, 2}, .origin = {layers}, .shape = {3, 2, 2}},
               H5T_NATIVE_DOUBLE, x);
  }
  MPI_Barrier(MPI_COMM_WORLD);
  check_mesh(path, 2, 2.0);
}

/* A cube of six tetrahedra as polyhedra, their faces numbered from MANY, whose rows begin behind FAR entries; the cells come
 * from NFACE_n or from ParentElements. The last offset is too great by `excess`. */
static void write_polyhedra(const char *path, bool with_nface, int64_t excess)
{
  tm_mesh      *mesh  = tm_tetrahedra((int[]){1, 1, 1}, NULL, NULL);
  const int64_t faces = mesh->view.num_faces, cells = mesh->view.num_cells, corners = mesh->face_offset[faces];
  int64_t      *node = tm_alloc_(corners, sizeof *node), *start = tm_alloc_(faces + 1, sizeof *start), num = 0;
  int64_t      *parent = tm_alloc_(2 * faces, sizeof *parent), *face = tm_alloc_(4 * cells, sizeof *face);
  int64_t      *first = tm_alloc_(cells + 1, sizeof *first), ngon, nface;
  cf_file      *f     = cf_new(4.2);
  const int64_t zone  = cf_zone(f, cf_base(f), "Z", 1, (int64_t[]){mesh->view.num_nodes, cells, 0});

  for (int64_t i = 0; i < corners; i++) node[i] = mesh->face_node[i] + 1;
  for (int64_t i = 0; i <= faces; i++) start[i] = FAR + mesh->face_offset[i];
  start[faces] += excess;
  for (int64_t i = 0; i < faces; i++) {
    parent[i]         = MANY + faces + mesh->owner[i];
    parent[faces + i] = mesh->neighbour[i] < 0 ? 0 : MANY + faces + mesh->neighbour[i];
  }
  for (int64_t c = 0; c <= cells; c++) {
    first[c] = FAR + num;
    for (int64_t i = 0; i < faces && c < cells; i++)
      if (mesh->owner[i] == c || mesh->neighbour[i] == c) face[num++] = mesh->owner[i] == c ? MANY + i : -(MANY + i);
  }
  cf_coordinates(f, zone, mesh->xyz, 1, &mesh->view.num_nodes);
  ngon = cf_ints(f, zone, "Faces", "Elements_t", 2, (int64_t[]){22, 0});
  cf_ints(f, ngon, "ElementRange", "IndexRange_t", 2, (int64_t[]){MANY, MANY + faces - 1});
  cf_empty(f, ngon, "ElementConnectivity", "DataArray_t");
  cf_offsets(f, ngon, faces + 1, start);
  if (with_nface) {
    nface = cf_ints(f, zone, "Cells", "Elements_t", 2, (int64_t[]){23, 0});
    cf_ints(f, nface, "ElementRange", "IndexRange_t", 2, (int64_t[]){MANY + faces, MANY + faces + cells - 1});
    cf_empty(f, nface, "ElementConnectivity", "DataArray_t");
    cf_offsets(f, nface, cells + 1, first);
  } else {
    cf_put(f, ngon, "ParentElements", "DataArray_t", "I8", 2, (int64_t[]){2, faces}, 'I', parent);
  }
  cf_write(f, path);
  put_sparse(path, "/Base/Z/Faces/ElementConnectivity", row(H5T_NATIVE_INT32, FAR, corners), H5T_NATIVE_INT64, node);
  if (with_nface)
    put_sparse(path, "/Base/Z/Cells/ElementConnectivity", row(H5T_NATIVE_INT64, FAR, num), H5T_NATIVE_INT64, face);
  MPI_Barrier(MPI_COMM_WORLD);
  free(node);
  free(start);
  free(parent);
  free(face);
  free(first);
  tm_free(mesh);
}

static void polyhedra_with_offsets_and_numbers_beyond_2_to_the_32_are_read(void)
{
  char path[64];

  if (!can_be_sparse()) return;
  cf_path(path, "polyhedra");
  for (int with_nface = 0; with_nface < 2; with_nface++) {
    write_polyhedra(path, with_nface != 0, 0);
    check_mesh(path, 6, 1.0);
  }
}

/* ---- writing ------------------------------------------------------------------------------------------------------ */

/* Every rank writes its values of two rows of more than 2^32, and reads those of the next rank. */
static void slices_beyond_2_to_the_32_are_written_and_read_again(void)
{
  enum { NUM = 1000 };
  static const char *const type[3]   = {"I4", "I8", "R8"};
  const hid_t              stored[3] = {H5T_NATIVE_INT32, H5T_NATIVE_INT64, H5T_NATIVE_DOUBLE};
  const int64_t            total     = FAR + NUM * (int64_t)rt_size();
  const rc_box             box       = {.nd = 2, .shape = {2, total}};
  rcgns_file               file      = {.comm = MPI_COMM_WORLD, .rank = rt_rank(), .size = rt_size()};
  char                     path[64];

  if (!can_be_sparse()) return;
  for (int t = 0; t < 3; t++) {
    const int64_t next = (rt_rank() + 1) % rt_size();
    const char    as   = t < 2 ? 'I' : 'R';
    cf_file      *f    = cf_new(4.2);
    rc_plan       plan = {.entry = {.item = NULL}};
    int64_t       ints[2 * NUM], got[NUM], handle;
    double        reals[2 * NUM], real[NUM];
    rc_entry     *e;
    rcgns_message why;

    cf_empty(f, -1, "Far", "DataArray_t");
    cf_write(f, cf_path(path, "slices"));
    put_sparse(path, "/Far", (sparse){.stored = stored[t], .nd = 2, .dim = {2, total}}, -1, NULL);
    for (int i = 0; i < 2 * NUM; i++) reals[i] = (double)(ints[i] = 10000 * rt_rank() + i);
    rc_plan_add(&plan, -1, "Far", "DataArray_t", type[t], 2, box.shape, as, t < 2 ? (void *)ints : (void *)reals);
    e          = rc_entry_at(&plan, 0);
    e->content = RC_SLICE;
    e->begin   = FAR + NUM * (int64_t)rt_rank();
    e->end     = e->begin + NUM;
    e->rows    = 2;
    MPI_Barrier(MPI_COMM_WORLD);
    if (!RT_EQ(rc_h5_fill(&file, path, &plan, NULL, &why), RCGNS_OK)) printf("# %s\n", why.text);
    RT_EQ(rc_h5_open(MPI_COMM_WORLD, path, &handle, &why), RCGNS_OK);
    for (int r = 0; r < 2; r++) {
      const int64_t lo = r * total + FAR + NUM * next;

      RT_EQ(rc_h5_read(handle, "/Far", type[t], &box, lo, lo + NUM, as, t < 2 ? (void *)got : (void *)real, &why), RCGNS_OK);
      for (int i = 0; i < NUM; i++) RT_EQ(t < 2 ? got[i] : (int64_t)real[i], 10000 * next + NUM * r + i);
    }
    rc_h5_close(handle);
    rc_plan_drop(&plan);
    cf_remove(path);
  }
}

/* ---- counting ----------------------------------------------------------------------------------------------------- */

static void shares_of_billions_are_even_disjoint_and_complete(void)
{
  const int64_t total[] = {MANY, INT64_C(1) << 31, FAR, INT64_C(1) << 50};
  const int     size[]  = {1, 3, 7, 4096, 100003};

  for (int t = 0; t < 4; t++)
    for (int s = 0; s < 5; s++) {
      int64_t wrong = 0;

      for (int r = 0; r < size[s]; r++) {
        const int64_t lo = ra_share(total[t], r, size[s]), hi = ra_share(total[t], r + 1, size[s]), each = total[t] / size[s];

        wrong += hi - lo < each || hi - lo > each + 1;
        wrong += ra_owner(total[t], lo, size[s]) != r || ra_owner(total[t], hi - 1, size[s]) != r;
      }
      RT_EQ(wrong, 0);
      RT_EQ(ra_share(total[t], 0, size[s]), 0);
      RT_EQ(ra_share(total[t], size[s], size[s]), total[t]);
    }
}

static void ranges_of_boxes_of_billions_are_cut_without_gap(void)
{
  const rc_box  box = {.nd = 3, .origin = {7, 0, 0}, .shape = {3000017, 1009, 2}};
  const int64_t all = rc_box_count(&box);

  RT_CHECK(all > INT64_C(6000000000));
  for (int64_t k = 0; k < 1000; k++) {
    const int64_t lo = all / 1000 * k + 37 * k % 5, hi = k % 2 ? lo + 3 * k + 1 : all - k;
    rc_box        part[RC_MAX_BOXES];
    const int     num = rc_box_cut(&box, lo, hi, part);
    int64_t       at  = lo;

    for (int p = 0; p < num; p++) {
      RT_EQ(((part[p].origin[0] - 7) * 1009 + part[p].origin[1]) * 2 + part[p].origin[2], at);
      at += rc_box_count(part + p);
    }
    RT_EQ(at, hi);
  }
}

/* The last rank sends the first so many records of one byte, most of them 0. */
static rcgns_status send_down(int64_t num, bool *came)
{
  const bool    is_last = rt_rank() == rt_size() - 1;
  int64_t      *count   = tm_alloc_(2 * (int64_t)rt_size(), sizeof *count), *got_count = count + rt_size();
  char         *send = is_last ? calloc((size_t)num, 1) : NULL, *got = NULL;
  rcgns_message why  = {""};
  void         *in   = NULL;
  rcgns_status  status;

  count[0] = is_last ? num : 0;
  if (send) send[num - 1] = 'z';
  status = rc_exchange(MPI_COMM_WORLD, RCGNS_OK, send, count, 1, &in, got_count, &why);
  got    = in;
  *came  = rt_rank() || (got && got_count[rt_size() - 1] == num && got[0] == 0 && got[num - 1] == 'z');
  RT_CHECK((status == RCGNS_OK) == (strstr(why.text, "use more ranks") == NULL));
  RT_CHECK((status == RCGNS_OK) == (in != NULL));
  free(send), free(in), free(count);
  return status;
}

static void exchanges_beyond_one_message_of_mpi_are_made_of_several(void)
{
  bool came;

  if (!rt_long()) {
    rt_skip("it takes 4 GB");
    return;
  }
  RT_EQ(send_down((INT64_C(1) << 31) + 5, &came), RCGNS_OK);
  RT_CHECK(came);
}

static void exchanges_beyond_all_memory_are_refused_on_every_rank(void)
{
  bool came;

  RT_EQ(send_down(INT64_C(1) << 60, &came), RCGNS_MEMORY);
}

/* ---- refusing ----------------------------------------------------------------------------------------------------- */

static void offsets_that_pass_the_end_of_a_long_array_are_refused(void)
{
  char path[64];

  if (!can_be_sparse()) return;
  cf_path(path, "excess");
  write_polyhedra(path, true, 1);
  refuse(path, "ElementStartOffset is not ascending");
  write_polyhedra(path, true, INT64_C(1) << 62);
  refuse(path, "ElementStartOffset is not ascending");
  write_polyhedra(path, true, INT64_MIN / 2);
  refuse(path, "ElementStartOffset is not ascending");
}

static void element_ranges_longer_than_their_array_are_refused(void)
{
  const int64_t     last[]  = {MANY, INT64_C(1) << 50, INT64_MAX};
  const char *const words[] = {"does not match its ElementRange", "does not match its ElementRange", "no valid ElementRange"};
  char              path[64];

  cf_path(path, "range");
  for (int i = 0; i < 3; i++) {
    cf_file      *f    = cf_new(4.2);
    const int64_t zone = cf_zone(f, cf_base(f), "Z", 1, (int64_t[]){TWO_NODES, TWO_CELLS, 0});

    cf_coordinates(f, zone, CF_ZOO_XYZ, 1, (int64_t[]){TWO_NODES});
    cf_section(f, zone, "Hexa", 17, 1, last[i], 8 * TWO_CELLS, TWO_HEXA);
    cf_write(f, path);
    refuse(path, words[i]);
  }
}

static void sizes_whose_product_overflows_are_refused(void)
{
  const int64_t n    = INT64_C(3037000500); /* n^2 > 2^63 */
  cf_file      *f    = cf_new(4.2);
  const int64_t zone = cf_zone(f, cf_base(f), "Z", 3, (int64_t[]){n, n, n, n - 1, n - 1, n - 1, 0, 0, 0});
  char          path[64];

  cf_coordinates(f, zone, CF_ZOO_XYZ, 3, (int64_t[]){3, 2, 2});
  cf_write(f, cf_path(path, "product"));
  refuse(path, "its sizes are not valid");
}

/* Chunks that are not there read as zeros: a damaged size of a chunked array would pass for 2^52 values. */
static void arrays_that_claim_more_than_the_file_holds_are_refused(void)
{
  const hsize_t huge = (hsize_t)1 << 52, chunk = 64, start = 0, count = 16;
  cf_file      *f    = cf_new(4.2);
  const int64_t zone = cf_zone(f, cf_base(f), "Z", 1, (int64_t[]){TWO_NODES, TWO_CELLS, 0});
  const int64_t hexa = cf_ints(f, zone, "Hexa", "Elements_t", 2, (int64_t[]){17, 0});
  char          path[64];

  cf_coordinates(f, zone, CF_ZOO_XYZ, 1, (int64_t[]){TWO_NODES});
  cf_ints(f, hexa, "ElementRange", "IndexRange_t", 2, (int64_t[]){1, INT64_C(1) << 49});
  cf_empty(f, hexa, "ElementConnectivity", "DataArray_t");
  cf_write(f, cf_path(path, "claim"));
  if (rt_rank() == 0) {
    const hid_t to = H5Fopen(path, H5F_ACC_RDWR, H5P_DEFAULT), list = H5Pcreate(H5P_DATASET_CREATE);
    const hid_t space = H5Screate_simple(1, &huge, NULL), box = H5Screate_simple(1, &count, NULL);
    hid_t       data;

    H5Pset_chunk(list, 1, &chunk);
    data = H5Dcreate2(to, "/Base/Z/Hexa/ElementConnectivity/ data", H5T_NATIVE_INT64, space, H5P_DEFAULT, list, H5P_DEFAULT);
    H5Sselect_hyperslab(space, H5S_SELECT_SET, &start, NULL, &count, NULL);
    RT_CHECK(H5Dwrite(data, H5T_NATIVE_INT64, box, space, H5P_DEFAULT, TWO_HEXA) >= 0);
    H5Dclose(data);
    H5Sclose(box);
    H5Sclose(space);
    H5Pclose(list);
    H5Fclose(to);
  }
  refuse(path, "has no ElementConnectivity");
}

RT_MAIN(RT_CASE(hexahedra_beyond_2_to_the_31_and_32_are_read), RT_CASE(blocks_behind_2_to_the_32_layers_of_rind_are_read),
        RT_CASE(polyhedra_with_offsets_and_numbers_beyond_2_to_the_32_are_read),
        RT_CASE(slices_beyond_2_to_the_32_are_written_and_read_again),
        RT_CASE(shares_of_billions_are_even_disjoint_and_complete), RT_CASE(ranges_of_boxes_of_billions_are_cut_without_gap),
        RT_CASE(exchanges_beyond_one_message_of_mpi_are_made_of_several),
        RT_CASE(exchanges_beyond_all_memory_are_refused_on_every_rank),
        RT_CASE(offsets_that_pass_the_end_of_a_long_array_are_refused),
        RT_CASE(element_ranges_longer_than_their_array_are_refused), RT_CASE(sizes_whose_product_overflows_are_refused),
        RT_CASE(arrays_that_claim_more_than_the_file_holds_are_refused))
