/* cgnscheck, the CGNS library's own checker, finds nothing in an output that it does not find in the target. It knows versions
 * up to 3.4, so newer stamps are replaced in copies. One rank. */
#include "files.h"

#include "../slices/blocks.h"

#include <hdf5.h>

/* Lines of complaint about a file; the caller frees. NULL: there is no cgnscheck. */
static char *complaints(const char *path)
{
  char   command[700], line[512];
  char  *all  = tm_alloc_(1, 1);
  size_t used = 0;
  FILE  *pipe;

  if (system("command -v cgnscheck > /dev/null 2>&1")) {
    free(all);
    return NULL;
  }
  snprintf(command, sizeof command, "cgnscheck '%s' 2>&1", path);
  pipe = popen(command, "r");
  if (!pipe) abort();
  while (fgets(line, sizeof line, pipe)) {
    if (!strstr(line, "ERROR")) continue;
    all = realloc(all, used + strlen(line) + 1);
    if (!all) abort();
    strcpy(all + used, line);
    used += strlen(line);
  }
  pclose(pipe);
  return all;
}

static void copy_file(const char *from, const char *to)
{
  FILE  *in = fopen(from, "rb"), *out = fopen(to, "wb");
  char   block[65536];
  size_t n;

  if (!in || !out) abort();
  while ((n = fread(block, 1, sizeof block, in)) > 0) fwrite(block, 1, n, out);
  fclose(in);
  fclose(out);
}

static void stamp(const char *path, float version)
{
  const hid_t file = H5Fopen(path, H5F_ACC_RDWR, H5P_DEFAULT);
  const hid_t data = H5Dopen2(file, "/CGNSLibraryVersion/ data", H5P_DEFAULT);

  RT_CHECK(H5Dwrite(data, H5T_NATIVE_FLOAT, H5S_ALL, H5S_ALL, H5P_DEFAULT, &version) >= 0);
  H5Dclose(data);
  H5Fclose(file);
}

/* Every line of `mine` is in `theirs`. */
static void check_subset(char *mine, const char *theirs, const char *path)
{
  for (char *line = strtok(mine, "\n"); line; line = strtok(NULL, "\n"))
    if (!RT_CHECK(strstr(theirs, line) != NULL)) printf("# %s: %s\n", path, line);
}

/* Write a target with a field added, check both. false: there is no cgnscheck. */
static bool check_output(const char *target)
{
  rcgns_file *file = cf_open(target, NULL);
  char        out[64], copy[64], *mine, *theirs;

  if (!file) return true;
  cf_path(out, "checked");
  cf_path(copy, "stamped");
  {
    const bool            newer = rcgns_get_info(file)->version > 3.45, is_adf = !strcmp(rcgns_get_info(file)->format, "ADF");
    double               *value = tm_alloc_(rcgns_mesh(file)->num_cells, sizeof *value);
    const rcgns_new_field field = {"Density", value};
    rcgns_message         why;

    if (!RT_EQ(rcgns_write(file, out, "FlowSolution#Centers", 1, &field, &why), RCGNS_OK)) printf("# %s\n", why.text);
    free(value);
    rcgns_close(&file);
    copy_file(target, copy);
    if (newer && !is_adf) stamp(copy, 3.4f), stamp(out, 3.4f);
  }
  theirs = complaints(copy);
  mine   = theirs ? complaints(out) : NULL;
  if (mine) check_subset(mine, theirs, target);
  cf_remove(copy);
  cf_remove(out);
  free(theirs);
  free(mine);
  return mine != NULL;
}

static void outputs_on_real_targets_add_no_error(void)
{
  static const char *const names[] = {
      "adflow_mdo_tutorial_rans_vol", "pycgns_naca12_hybrid_sol", "pycgns_sqnz_t3_8zones_sol", "pycgns_sqnz_unstruct_2dom_sol",
      "cassiopee_case_hexa_v4",       "maia_U_ATB_45_NGON_v42",   "cgns_vers3310_hexa_sol",    "cgns_vers3000_hexa20label",
      "cgns_vers3110_hdf5-110_tetra", "su2_bend_coarse_mixed",    "hopr_spheremesh02_mixed",   "msh2cgns_mandel_mixed"};

  for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
    char path[512], name[64];

    snprintf(name, sizeof name, "%s.cgns", names[i]);
    if (!rt_shared_data(path, sizeof path, name)) {
      rt_skip("the folder of shared data is not there");
      return;
    }
    if (!check_output(path)) {
      rt_skip("cgnscheck is not installed");
      return;
    }
  }
}

static void new_files_have_no_error(void)
{
  tm_mesh              *whole   = tm_refined((int[]){4, 3, 3}, tm_right_half, NULL, NULL);
  double               *volume  = cf_volumes(&whole->view, NULL), grid[24];
  const rcgns_new_field field   = {"Density", volume};
  const rcgns_new_zone  zone[2] = {
       {.name = "Poly", .mesh = &whole->view, .num_fields = 1, .field = &field},
       {.name = "Block", .num_vertices = {2, 2, 2}, .node_xyz = grid, .num_fields = 1, .field = &field}};
  rcgns_message why;
  char          path[64], *found;

  for (int i = 0; i < 24; i++) grid[i] = (double)(i / 3 >> i % 3 & 1);
  cf_path(path, "created");
  RT_EQ(rcgns_create(path, 3.4, "FlowSolution#Centers", 2, zone, &why), RCGNS_OK);
  found = complaints(path);
  if (found) {
    if (!RT_EQ(strlen(found), 0)) printf("# %s\n", found);
    RT_CHECK(check_output(path));
  } else {
    rt_skip("cgnscheck is not installed");
  }
  cf_remove(path);
  free(found);
  free(volume);
  tm_free(whole);
}

/* Copy what is in `from` to a file of the newest format that this HDF5 knows. */
static void modernise(const char *from, const char *to)
{
  static const char *const name[2] = {"CGNSLibraryVersion", "Base"};
  const hid_t              access = H5Pcreate(H5P_FILE_ACCESS), in = H5Fopen(from, H5F_ACC_RDONLY, H5P_DEFAULT);
  hid_t                    out;

  H5Pset_libver_bounds(access, H5F_LIBVER_LATEST, H5F_LIBVER_LATEST);
  out = H5Fcreate(to, H5F_ACC_TRUNC, H5P_DEFAULT, access);
  for (int i = 0; i < 2; i++) RT_CHECK(H5Ocopy(in, name[i], out, name[i], H5P_DEFAULT, H5P_DEFAULT) >= 0);
  H5Pclose(access);
  H5Fclose(out);
  H5Fclose(in);
}

static void files_of_the_newest_hdf5_format_are_read(void)
{
  tm_mesh              *whole  = tm_refined((int[]){4, 3, 3}, tm_right_half, NULL, NULL);
  double               *volume = cf_volumes(&whole->view, NULL);
  const rcgns_new_field field  = {"Density", volume};
  const rcgns_new_zone  zone   = {.name = "Poly", .mesh = &whole->view, .num_fields = 1, .field = &field};
  char                  path[64], latest[64];
  unsigned char         head[9] = {0};
  rcgns_message         why;
  rcgns_file           *file;
  FILE                 *raw;

  cf_path(path, "plain");
  cf_path(latest, "latest");
  RT_EQ(rcgns_create(path, 4.2, "Sol", 1, &zone, &why), RCGNS_OK);
  modernise(path, latest);
  if ((raw = fopen(latest, "rb"))) {
    RT_EQ(fread(head, 1, sizeof head, raw), sizeof head);
    RT_CHECK(head[8] >= 3); /* the version of the superblock, which libcgns 3.4 does not know */
    fclose(raw);
  }
  if ((file = cf_open(latest, NULL))) {
    RT_NEAR(cf_total(file), 1.0, 1e-13);
    RT_EQ(rcgns_write(file, path, "Sol", 1, &field, &why), RCGNS_OK);
    rcgns_close(&file);
  }
  if ((raw = fopen(path, "rb"))) {
    RT_EQ(fread(head, 1, sizeof head, raw), sizeof head);
    RT_EQ(head[8], 2);
    fclose(raw);
  }
  cf_remove(path);
  cf_remove(latest);
  free(volume);
  tm_free(whole);
}

static void supermeshes_have_no_error(void)
{
  bl_blocks    *b = bl_new((int[]){3, 2, 4}, 0, 1);
  rcgns_message why;
  char          path[64], *found;

  cf_path(path, "super_checked");
  RT_EQ(rcgns_write_supermesh(MPI_COMM_SELF, path, 3.4, &b->content, &why), RCGNS_OK);
  found = complaints(path);
  if (!found)
    rt_skip("cgnscheck is not installed");
  else if (!RT_EQ(strlen(found), 0))
    printf("# %s\n", found);
  free(found);
  cf_remove(path);
  bl_free(b);
}

RT_MAIN(RT_CASE(files_of_the_newest_hdf5_format_are_read), RT_CASE(outputs_on_real_targets_add_no_error),
        RT_CASE(new_files_have_no_error), RT_CASE(supermeshes_have_no_error))
