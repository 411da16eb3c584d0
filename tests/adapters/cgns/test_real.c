/* Real files of many codes: every one that holds volume cells is read, and agrees with what other means once measured. */
#include "files.h"

static const struct {
  const char *name;
  int64_t     zones, cells;
  double      volume, relative;
} FILES[] = {{"adflow_mdo_tutorial_rans_vol", 38, 24192, 24402902.065, 1e-10},
             {"idwarp_o_mesh_79zones", 79, 24416, 521915.118809, 1e-11},
             {"cgnsutil_717_wl_L2", 5, 15120, 40000513.6987, 1e-11},
             {"pycgns_naca12_hybrid_sol", 5, 27393, 260.185832477, 1e-11},
             {"pycgns_sqnz_t3_8zones_sol", 8, 11264, 1.82423131977, 1e-11},
             {"pycgns_sqnz_unstruct_2dom_sol", 2, 11264, 1.82423131977, 1e-11},
             {"pycgns_124Disk_chimera_brokenlink", 3, 11470, 190.0357782064, 1e-11},
             {"pycgns_001Disk_T0", 3, 2401, 75.1917710705, 1e-11},
             {"cassiopee_sample1_oldNGON", 1, 6859, 6859, 1e-9},
             {"cassiopee_case_hexa_v4", 1, 729, 729, 1e-9},
             {"maia_U_ATB_45_NGON_v42", 1, 460, 8.43504312187, 1e-11},
             {"cgns_vers3310_hexa_sol", 1, 2560, 2560, 1e-9},
             {"cgns_vers3000_hexa20label", 1, 2560, 2560, 1e-9},
             {"cgns_vers3110_hdf5-110_tetra", 1, 13761, 33.2081643148, 1e-11},
             {"su2_bend_coarse_mixed", 1, 1288, 2.99911481482, 1e-11},
             {"hopr_naca0012_icem_110k", 5, 110592, 3.58808099374e13, 1e-11},
             {"hopr_sphere_agglo_S3_21k", 20, 21168, 7.35419726834e12, 1e-11},
             {"hopr_spheremesh01_mixed", 3, 113, 4.91518130532e13, 1e-11},
             {"hopr_spheremesh02_mixed", 3, 376, 6.95109994631e13, 1e-11},
             {"hopr_spheremesh04_mixed", 3, 1904, 7.52381294827e13, 1e-11},
             {"msh2cgns_mandel_mixed", 1, 23566, 1.0, 1e-12}};

static const char *const FLAT[] = {"adflow_nozzle_iblank_surf", "cassiopee_naca_IBMO_overset",
                                   "su2_flamelet_medium_2d",    "msh2cgns_9v_6e_transient_sol",
                                   "msh2cgns_cubic_MIXED_v41",  "msh2cgns_quadratic_QUAD9_v41"};

/* Path of a real file; false: the folder is not there, the case is skipped. */
static int real_file(char path[512], const char *name)
{
  char file[128];

  snprintf(file, sizeof file, "%s.cgns", name);
  if (rt_all(rt_shared_data(path, 512, file))) return 1;
  rt_skip("the folder of shared data is not there");
  return 0;
}

static void cells_and_volumes_of_real_files_agree_with_the_manifest(void)
{
  for (size_t i = 0; i < sizeof FILES / sizeof *FILES; i++) {
    char        path[512];
    rcgns_file *file;

    if (!real_file(path, FILES[i].name) || !(file = cf_open(path, NULL))) return;
    RT_EQ(rcgns_get_info(file)->num_zones, FILES[i].zones);
    RT_EQ(rcgns_get_info(file)->num_cells, FILES[i].cells);
    RT_EQ(cf_count(rcgns_mesh(file)->num_cells), FILES[i].cells);
    RT_NEAR(cf_total(file) / FILES[i].volume, 1.0, FILES[i].relative);
    rcgns_close(&file);
  }
}

static void files_without_volume_cells_are_refused(void)
{
  for (size_t i = 0; i < sizeof FLAT / sizeof *FLAT; i++) {
    char          path[512];
    rcgns_file   *file = NULL;
    rcgns_message why;

    if (!real_file(path, FLAT[i])) return;
    RT_EQ(rcgns_open(MPI_COMM_WORLD, path, NULL, &file, &why), RCGNS_IO);
    RT_CHECK(strstr(why.text, path) && strstr(why.text, "no volume cells"));
    RT_CHECK(cf_is_agreed(&why));
    RT_CHECK(!file);
  }
}

typedef struct integral {
  const char *field;
  double      value, least, greatest;
} integral;

static void check_fields(const char *name, const char *solution, const integral *want, int num)
{
  char           path[512];
  rcgns_file    *file;
  rcgns_solution chosen;
  rcgns_message  why;

  if (!real_file(path, name) || !(file = cf_open(path, NULL))) return;
  if (RT_EQ(rcgns_select_solution(file, NULL, &chosen, &why), RCGNS_OK)) {
    const int64_t n     = rcgns_mesh(file)->num_cells;
    double       *value = tm_alloc_(n, sizeof *value);

    RT_STR(chosen.name, solution);
    for (int i = 0; i < num; i++) {
      double range[2] = {-HUGE_VAL, -HUGE_VAL}; /* -least, greatest */

      RT_NEAR(cf_integral(file, want[i].field), want[i].value, 1e-9 * (fabs(want[i].value) > 1e-3 ? fabs(want[i].value) : 1.0));
      RT_EQ(rcgns_read_field(file, want[i].field, value, &why), RCGNS_OK);
      for (int64_t c = 0; c < n; c++) {
        range[0] = fmax(range[0], -value[c]);
        range[1] = fmax(range[1], value[c]);
      }
      MPI_Allreduce(MPI_IN_PLACE, range, 2, MPI_DOUBLE, MPI_MAX, MPI_COMM_WORLD);
      RT_NEAR(-range[0], want[i].least, 1e-4 * fabs(want[i].least));
      RT_NEAR(range[1], want[i].greatest, 1e-4 * fabs(want[i].greatest));
    }
    free(value);
  }
  rcgns_close(&file);
}

static const integral NOZZLE[] = {{"Density", 1.87404962703, 0.51078, 1.4106},
                                  {"MomentumX", 1.34402047107, 0.68796, 0.74361},
                                  {"MomentumY", -2.43281e-05, -0.19718, 0.20702},
                                  {"MomentumZ", -2.43260e-05, -0.19718, 0.20702},
                                  {"EnergyStagnationDensity", 4.235492327, 1.2534, 3.0756}};

static void fields_of_structured_zones_have_the_integrals_of_the_manifest(void)
{
  check_fields("pycgns_sqnz_t3_8zones_sol", "FlowSolution#Init", NOZZLE, 5);
}

static void fields_of_unstructured_zones_have_the_integrals_of_the_manifest(void)
{
  check_fields("pycgns_sqnz_unstruct_2dom_sol", "initialisation", NOZZLE, 5);
}

static void fields_of_a_hybrid_file_have_the_integrals_of_the_manifest(void)
{
  static const integral want[] = {{"Density", 260.147664358, 0.60362, 1.3736},
                                  {"MomentumX", 259.846604905, 0.272552, 1.02963},
                                  {"MomentumY", 3.86149624832, -0.468852, 0.537123},
                                  {"MomentumZ", 0, 0, 0},
                                  {"EnergyStagnationDensity", 773.151051269, 1.88713, 4.03477}};

  check_fields("pycgns_naca12_hybrid_sol", "sol_1000", want, 5);
}

static void rind_is_left_out_of_fields(void)
{
  static const integral want[] = {{"Density", 24402589.5945, 0.55212, 1.34091},
                                  {"VelocityX", 23087966.2135, 0.000992046, 1.33331},
                                  {"Pressure", 24402589.8404, 0.611544, 1.50835},
                                  {"TurbulentSANuTilde", 14.7251100649, 2.82388e-08, 0.000317433}};

  check_fields("adflow_mdo_tutorial_rans_vol", "Flow solution", want, 4);
}

static void refuse_solution(const char *name, const char *solution, rcgns_status status, const char *words)
{
  char           path[512];
  rcgns_file    *file;
  rcgns_solution chosen;
  rcgns_message  why;
  rcgns_choice   choice;

  if (!real_file(path, name) || !(file = cf_open(path, NULL))) return;
  rcgns_choice_default(&choice);
  choice.name = solution;
  RT_EQ(rcgns_select_solution(file, &choice, &chosen, &why), status);
  if (!RT_CHECK(strstr(why.text, words) && strstr(why.text, path))) printf("# %s\n", why.text);
  RT_CHECK(cf_is_agreed(&why));
  rcgns_close(&file);
}

static void vertex_fields_are_refused_by_name(void)
{
  refuse_solution("cassiopee_case_hexa_v4", NULL, RCGNS_IO, "FlowSolution is Vertex-located (fields: Density)");
  refuse_solution("cgns_vers3310_hexa_sol", "FlowSolution", RCGNS_IO,
                  "FlowSolution is Vertex-located (fields: Density, Pressure)");
}

static void a_solution_that_is_not_there_is_refused_with_those_that_are(void)
{
  refuse_solution("pycgns_sqnz_t3_8zones_sol", "nowhere", RCGNS_USAGE, "it has: FlowSolution#Init (CellCenter)");
  refuse_solution("pycgns_001Disk_T0", NULL, RCGNS_IO, "FlowSolution#EndOfRun (CellCenter, empty)");
}

static void a_base_can_be_chosen(void)
{
  char          path[512];
  rcgns_file   *file = NULL;
  rcgns_options options;
  rcgns_message why;

  if (!real_file(path, "pycgns_124Disk_chimera_brokenlink")) return;
  rcgns_options_default(&options);
  options.base = "Background";
  if ((file = cf_open(path, &options))) {
    RT_EQ(rcgns_get_info(file)->num_cells, 10000);
    RT_NEAR(cf_total(file), 144.0, 1e-9);
    rcgns_close(&file);
  }
  options.base = "Disk";
  if ((file = cf_open(path, &options))) {
    RT_NEAR(cf_total(file), 46.0357782064, 1e-9);
    RT_CHECK(cf_has_note(file, "Disk/zone1 leads nowhere"));
    rcgns_close(&file);
  }
  options.base = "Moon";
  RT_EQ(rcgns_open(MPI_COMM_WORLD, path, &options, &file, &why), RCGNS_USAGE);
  RT_CHECK(strstr(why.text, "no base Moon") && strstr(why.text, "Background, Disk"));
}

static void a_truncated_adf_file_is_refused(void)
{
  char          path[512], cut[64];
  rcgns_file   *file = NULL;
  rcgns_message why;

  if (!real_file(path, "pycgns_sqnz_t3_8zones_sol")) return;
  cf_path(cut, "truncated_adf");
  if (rt_rank() == 0) {
    FILE *in = fopen(path, "rb"), *out = fopen(cut, "wb");
    char  byte[4096];

    for (int i = 0; i < 100 && fread(byte, 1, sizeof byte, in) == sizeof byte; i++) fwrite(byte, 1, sizeof byte, out);
    fclose(in);
    fclose(out);
  }
  MPI_Barrier(MPI_COMM_WORLD);
  RT_EQ(rcgns_open(MPI_COMM_WORLD, cut, NULL, &file, &why), RCGNS_IO);
  if (!RT_CHECK(strstr(why.text, cut) && cf_is_agreed(&why))) printf("# %s\n", why.text);
  rcgns_close(&file);
  cf_remove(cut);
}

/* Both meshes bit by bit. */
static void check_same(const remap_mesh *a, const remap_mesh *b)
{
  if (!RT_EQ(a->num_nodes, b->num_nodes) || !RT_EQ(a->num_faces, b->num_faces) || !RT_EQ(a->num_cells, b->num_cells)) return;
  RT_CHECK(!a->num_nodes || !memcmp(a->node_xyz, b->node_xyz, 3 * (size_t)a->num_nodes * sizeof(double)));
  RT_CHECK(!a->num_faces || !memcmp(a->face_node, b->face_node, (size_t)a->face_offset[a->num_faces] * sizeof(int64_t)));
  RT_CHECK(!a->num_faces || !memcmp(a->face_owner, b->face_owner, (size_t)a->num_faces * sizeof(int64_t)));
}

static void an_adf_file_and_its_hdf5_copy_are_the_same_mesh_and_fields(void)
{
  static const char *const names[] = {"pycgns_sqnz_t3_8zones_sol", "su2_bend_coarse_mixed", "hopr_sphere_agglo_S3_21k"};

  for (int i = 0; i < 3; i++) {
    char           path[512], copy[64];
    rcgns_file    *adf, *hdf;
    rcgns_message  why;
    rcgns_solution chosen;

    if (!real_file(path, names[i]) || !(adf = cf_open(path, NULL))) return;
    cf_path(copy, "adf_copy");
    RT_EQ(rcgns_write(adf, copy, "Unused", 0, NULL, &why), RCGNS_OK);
    if ((hdf = cf_open(copy, NULL))) {
      RT_STR(rcgns_get_info(adf)->format, "ADF");
      RT_STR(rcgns_get_info(hdf)->format, "HDF5");
      RT_NEAR(rcgns_get_info(hdf)->version, rcgns_get_info(adf)->version, 0.0);
      check_same(rcgns_mesh(adf), rcgns_mesh(hdf));
      if (i == 0 && RT_EQ(rcgns_select_solution(adf, NULL, &chosen, &why), RCGNS_OK) &&
          RT_EQ(rcgns_select_solution(hdf, NULL, &chosen, &why), RCGNS_OK))
        RT_NEAR(cf_integral(adf, "Density"), cf_integral(hdf, "Density"), 0.0);
      rcgns_close(&hdf);
    }
    rcgns_close(&adf);
    cf_remove(copy);
  }
}

RT_MAIN(RT_CASE(cells_and_volumes_of_real_files_agree_with_the_manifest), RT_CASE(files_without_volume_cells_are_refused),
        RT_CASE(fields_of_structured_zones_have_the_integrals_of_the_manifest),
        RT_CASE(fields_of_unstructured_zones_have_the_integrals_of_the_manifest),
        RT_CASE(fields_of_a_hybrid_file_have_the_integrals_of_the_manifest), RT_CASE(rind_is_left_out_of_fields),
        RT_CASE(vertex_fields_are_refused_by_name), RT_CASE(a_solution_that_is_not_there_is_refused_with_those_that_are),
        RT_CASE(a_base_can_be_chosen), RT_CASE(a_truncated_adf_file_is_refused),
        RT_CASE(an_adf_file_and_its_hdf5_copy_are_the_same_mesh_and_fields))
