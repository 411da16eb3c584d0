/* What is written as .vtu: the same bytes on any number of ranks, arrays of the announced lengths, and VTK itself agrees. */
#include "blocks.h"
#include "rt.h"
#include "vtk.h"

#include <sys/stat.h>
#include <unistd.h>

static rvtk_message why;

static const char *path_of(char out[64], const char *name)
{
  snprintf(out, 64, "vtk_%s_np%d.vtu", name, rt_size());
  return out;
}

static void the_bytes_do_not_depend_on_the_number_of_ranks(void)
{
  bl_blocks *mine = bl_new((int[]){3, 2, 4}, rt_rank(), rt_size()), *all = bl_new((int[]){3, 2, 4}, 0, 1);
  char       path[64], one[64];

  RT_EQ(rvtk_write(MPI_COMM_WORLD, path_of(path, "many"), &mine->content, &why), RVTK_OK);
  if (rt_rank() == 0) {
    RT_EQ(rvtk_write(MPI_COMM_SELF, path_of(one, "one"), &all->content, &why), RVTK_OK);
    RT_CHECK(bl_same_files(path, one));
    remove(one);
    remove(path);
  }
  bl_free(mine);
  bl_free(all);
}

/* The bytes of an appended array of a file, found by its name. */
static const char *array_of(const char *text, const char *name, uint64_t *bytes)
{
  char        wanted[64];
  const char *at, *data = strstr(text, "encoding=\"raw\">");

  snprintf(wanted, sizeof wanted, "Name=\"%s\"", name);
  at = strstr(text, wanted);
  if (!RT_CHECK(at && data)) return NULL;
  data = strchr(data, '_') + 1 + strtoll(strstr(at, "offset=\"") + 8, NULL, 10);
  memcpy(bytes, data, sizeof *bytes);
  return data + sizeof *bytes;
}

static void the_arrays_are_what_the_head_says(void)
{
  bl_blocks    *b = bl_new((int[]){2, 1, 1}, rt_rank(), rt_size());
  static char   text[20000];
  char          path[64];
  const char   *data;
  uint64_t      bytes;
  const int64_t offsets[2] = {8, 16}, ends[2] = {31, 62}, ancestors[2] = {1, 0};
  const int64_t faces[12] = {0, 1, 3, 5, 7, 9, 1, 2, 4, 6, 8, 10};
  const int64_t numbers[11] = {1, 0, 0, 4, 0, 0, 1, 0, 0, 4, 0}, cells[11] = {1, 0, 0, 2, 0, 0, 4, 0, 0, 5, 0};
  const double  values[2] = {0, 1.5};
  int64_t       boundary = -2;
  FILE         *in;

  RT_EQ(rvtk_write(MPI_COMM_WORLD, path_of(path, "arrays"), &b->content, &why), RVTK_OK);
  if (rt_rank() == 0 && RT_CHECK((in = fopen(path, "rb")) != NULL)) {
    RT_CHECK(fread(text, 1, sizeof text - 1, in) > 1000);
    fclose(in);
    RT_CHECK(strstr(text, "NumberOfPoints=\"12\" NumberOfCells=\"2\""));
    data = array_of(text, "offsets", &bytes);
    RT_CHECK(data && bytes == 16 && !memcmp(data, offsets, 16));
    data = array_of(text, "faceoffsets", &bytes);
    RT_CHECK(data && bytes == 16 && !memcmp(data, ends, 16));
    data = array_of(text, "AncestorB", &bytes);
    RT_CHECK(data && bytes == 16 && !memcmp(data, ancestors, 16));
    data = array_of(text, "Number", &bytes);
    RT_CHECK(data && bytes == 16 && !memcmp(data, values, 16));
    data = array_of(text, "CellFaces", &bytes);
    RT_CHECK(data && bytes == 96 && !memcmp(data, faces, 96));
    data = array_of(text, "FaceBoundary", &bytes);
    if (RT_CHECK(data && bytes == 88)) memcpy(&boundary, data, sizeof boundary);
    RT_CHECK(boundary >= -1);
    data = array_of(text, "FaceNumberB", &bytes);
    RT_CHECK(data && bytes == 88 && !memcmp(data, numbers, 88));
    data = array_of(text, "FaceCellB", &bytes);
    RT_CHECK(data && bytes == 88 && !memcmp(data, cells, 88));
    data = array_of(text, "types", &bytes);
    RT_CHECK(data && bytes == 2 && data[0] == 42 && data[1] == 42);
    remove(path);
  }
  bl_free(b);
}

static void a_place_that_cannot_be_written_is_told_and_nothing_is_left(void)
{
  bl_blocks *b = bl_new((int[]){2, 1, 1}, rt_rank(), rt_size());

  RT_EQ(rvtk_write(MPI_COMM_WORLD, "no_such_folder/x.vtu", &b->content, &why), RVTK_IO);
  RT_CHECK(strstr(why.text, "no_such_folder/x.vtu"));
  bl_free(b);
}

static void vtk_reads_polyhedra_of_the_right_volume(void)
{
  bl_blocks *b = bl_new((int[]){3, 2, 4}, rt_rank(), rt_size());
  char       path[64], command[1800];
  int        none;

  RT_EQ(rvtk_write(MPI_COMM_WORLD, path_of(path, "read"), &b->content, &why), RVTK_OK);
  none = rt_rank() == 0 && system("/usr/bin/python3 -c 'import vtkmodules.vtkIOXML' 2>/dev/null");
  MPI_Bcast(&none, 1, MPI_INT, 0, MPI_COMM_WORLD);
  if (rt_rank() == 0 && !none) {
    snprintf(
        command, sizeof command,
        "/usr/bin/python3 -c 'import vtkmodules.vtkIOXML as x\n"
             "from vtkmodules.vtkFiltersVerdict import vtkCellSizeFilter as F\n"
        "r = x.vtkXMLUnstructuredGridReader()\nr.SetFileName(\"%s\")\nf = F()\nf.SetInputConnection(r.GetOutputPort())\n"
        "f.Update()\ng = f.GetOutput()\nv = g.GetCellData().GetArray(\"Volume\")\na = g.GetCellData().GetArray(\"AncestorA\")\n"
        "assert g.GetNumberOfCells() == 24 and g.GetNumberOfPoints() == 60\n"
        "assert all(abs(v.GetValue(i) - 1) < 1e-12 for i in range(24))\n"
        "assert [a.GetValue(i) for i in range(24)] == list(range(1, 25))\n"
        "h = lambda n: [d.GetAbstractArray(n).GetValue(i) for i in range(d.GetAbstractArray(n).GetNumberOfTuples())]\n"
        "d = r.GetOutput().GetFieldData()\nn = h(\"BoundaryName\")\nb = h(\"FaceBoundary\")\nc = h(\"CellFaces\")\n"
        "assert n == [\"left\", \"right\", \"front\", \"back\", \"a very long name with / in it, 40 letters\", \"top\"]\n"
        "assert len(c) == 144 and len(b) == len(set(c)) and sum(x < 0 for x in b) == len(c) - len(b)\n"
        "assert h(\"FaceNumberA\") == [100 + g for g in range(len(b))]'",
        path);
    RT_EQ(system(command), 0);
  }
  MPI_Barrier(MPI_COMM_WORLD);
  if (rt_rank() == 0) remove(path);
  if (none) rt_skip("python3-vtk9 is not installed");
  bl_free(b);
}

RT_MAIN(RT_CASE(the_bytes_do_not_depend_on_the_number_of_ranks), RT_CASE(the_arrays_are_what_the_head_says),
        RT_CASE(a_place_that_cannot_be_written_is_told_and_nothing_is_left), RT_CASE(vtk_reads_polyhedra_of_the_right_volume))
