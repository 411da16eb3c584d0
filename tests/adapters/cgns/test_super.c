/* Supermeshes as CGNS files: the same bytes on any number of ranks, what was put in comes out, and nothing else is left
 * behind. */
#include "files.h"

#include "../slices/blocks.h"

static rcgns_message why;

static rcgns_status write_blocks(bl_blocks *b, const char *path)
{
  return rcgns_write_supermesh(MPI_COMM_WORLD, path, 4.2, &b->content, &why);
}

static void the_bytes_do_not_depend_on_the_number_of_ranks(void)
{
  bl_blocks *mine = bl_new((int[]){3, 2, 4}, rt_rank(), rt_size()), *all = bl_new((int[]){3, 2, 4}, 0, 1);
  char       path[64], one[64];

  RT_EQ(write_blocks(mine, cf_path(path, "super")), RCGNS_OK);
  if (rt_rank() == 0) {
    RT_EQ(rcgns_write_supermesh(MPI_COMM_SELF, cf_path(one, "super_one"), 4.2, &all->content, &why), RCGNS_OK);
    RT_CHECK(bl_same_files(path, one));
    remove(one);
    remove(path);
  }
  bl_free(mine);
  bl_free(all);
}

static void what_is_written_is_read_back(void)
{
  bl_blocks     *b = bl_new((int[]){3, 2, 4}, rt_rank(), rt_size());
  char           path[64];
  rcgns_file    *file;
  rcgns_solution solution;

  RT_EQ(write_blocks(b, cf_path(path, "back")), RCGNS_OK);
  RT_EQ(rcgns_open(MPI_COMM_WORLD, path, NULL, &file, &why), RCGNS_OK);
  if (file) {
    const remap_mesh *mesh   = rcgns_mesh(file);
    double           *volume = cf_volumes(mesh, NULL), *value = tm_alloc_(mesh->num_cells, sizeof *value);

    RT_EQ(rcgns_get_info(file)->num_cells, 24);
    for (int64_t c = 0; c < mesh->num_cells; c++) RT_NEAR(volume[c], 1, 1e-14);
    RT_EQ(rcgns_select_solution(file, NULL, &solution, &why), RCGNS_OK);
    RT_STR(solution.name, "FlowSolution#Centers");
    RT_EQ(solution.num_fields, 4);
    RT_STR(solution.field[0].stored, "I4");
    RT_EQ(rcgns_read_field(file, "AncestorB", value, &why), RCGNS_OK);
    for (int64_t c = 0; c < mesh->num_cells; c++) {
      const int64_t g = mesh->cell_global[c];

      RT_NEAR(value[c], g % 2 ? 0.0 : (double)(g / 2 + 1), 0.0);
    }
    RT_EQ(rcgns_read_field(file, "Number", value, &why), RCGNS_OK);
    for (int64_t c = 0; c < mesh->num_cells; c++) RT_NEAR(value[c], 1.5 * (double)mesh->cell_global[c], 0.0);
    free(volume);
    free(value);
  }
  rcgns_close(&file);
  MPI_Barrier(MPI_COMM_WORLD);
  if (rt_rank() == 0) remove(path);
  bl_free(b);
}

static void what_cannot_be_written_is_refused(void)
{
  bl_blocks *b = bl_new((int[]){3, 2, 4}, rt_rank(), rt_size());

  RT_EQ(write_blocks(b, "no_such_folder/x.cgns"), RCGNS_IO);
  RT_CHECK(strstr(why.text, "no_such_folder/x.cgns"));
  b->field.name = "a/b";
  RT_EQ(write_blocks(b, "x.cgns"), RCGNS_USAGE);
  b->content.num_fields = 0;
  b->view.global_cells  = 0;
  RT_EQ(write_blocks(b, "x.cgns"), RCGNS_USAGE);
  RT_CHECK(strstr(why.text, "no cells"));
  bl_free(b);
}

RT_MAIN(RT_CASE(the_bytes_do_not_depend_on_the_number_of_ranks), RT_CASE(what_is_written_is_read_back),
        RT_CASE(what_cannot_be_written_is_refused))
