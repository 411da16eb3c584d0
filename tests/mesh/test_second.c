/* Second moments of cells: those of boxes as written down, symmetric under numbering, right for flat and far cells. */
#include "mesh/mesh.h"
#include "meshes.h"
#include "rt.h"

/* A mesh of this rank alone and its second moments, in the arena. */
static const rm_mesh *build(rm_arena *arena, const tm_mesh *given, const double (**second)[6])
{
  const remap_mesh both[2] = {given->view, given->view};
  const rm_mesh   *mesh    = NULL;
  rm_reason        reason  = {-1, -1, ""};
  rm_frame         frame;
  rm_comm          comm;

  RT_EQ(rm_comm_dup(MPI_COMM_SELF, &comm), REMAP_OK);
  RT_EQ(rm_frame_build(&comm, both, &frame, &reason), REMAP_OK);
  RT_EQ(rm_mesh_build(arena, &comm, REMAP_SOURCE, &given->view, &frame, REMAP_FACES_CENTRE, &mesh, &reason), REMAP_OK);
  RT_EQ(rm_mesh_second(arena, mesh, REMAP_FACES_CENTRE, second), REMAP_OK);
  rm_comm_free(&comm);
  return mesh;
}

/* A box has V a^2 / 12 along its edge a, and nothing off the diagonal, wherever it is and however thin. */
static void boxes_have_what_is_written_down(void)
{
  static const double at[][3] = {{0, 0, 0}, {1000, -300, 77}}, size[][3] = {{1, 1, 1}, {1, 0.5, 1e-5}};

  for (int p = 0; p < 2; p++)
    for (int s = 0; s < 2; s++) {
      const double m[12] = {size[s][0], 0, 0, at[p][0], 0, size[s][1], 0, at[p][1], 0, 0, size[s][2], at[p][2]};
      tm_mesh     *given = tm_hexahedra((int[]){3, 2, 4}, tm_affine, m);
      rm_arena    *arena = rm_arena_new();
      const double(*second)[6];
      const rm_mesh *mesh = build(arena, given, &second);

      for (rm_lid c = 0; c < mesh->num_cells; c++) {
        const double *box = mesh->cell_box[c], v = mesh->cell_volume[c];
        double        edge[3], off[3];

        for (int a = 0; a < 3; a++) {
          edge[a] = box[a + 3] - box[a];
          off[a]  = mesh->cell_centroid[c][a] - (box[a] + 0.5 * edge[a]); /* what rounding takes from the centroid */
        }
        for (int k = 0; k < 6; k++) {
          static const int row[6] = {0, 1, 2, 0, 0, 1}, column[6] = {0, 1, 2, 1, 2, 2};
          const double     scale = v * edge[row[k]] * edge[column[k]];

          RT_NEAR(second[c][k], (k < 3 ? scale / 12 : 0) + v * off[row[k]] * off[column[k]], 1e-14 * scale);
        }
      }
      rm_arena_drop(arena);
      tm_free(given);
    }
}

static void bits_depend_on_coordinates_alone(void)
{
  const tm_warping warp     = {0.03, 0.7};
  tm_mesh         *given[3] = {tm_hexahedra((int[]){3, 3, 3}, tm_warp, &warp), tm_tetrahedra((int[]){2, 2, 2}, tm_warp, &warp),
                               tm_dual((int[]){2, 2, 2}, tm_warp, &warp)};

  for (int k = 0; k < 3; k++) {
    rm_arena *arena = rm_arena_new();
    tm_mesh  *other = tm_part(given[k], NULL, 0, 5);
    const double(*second[2])[6];
    const rm_mesh *mesh[2] = {build(arena, given[k], &second[0]), build(arena, other, &second[1])};

    for (rm_lid c = 0; c < mesh[1]->num_cells; c++) {
      const rm_lid same = (rm_lid)mesh[1]->cell_global[c];

      RT_CHECK(!memcmp(second[1][c], second[0][same], sizeof second[0][0]));
    }
    rm_arena_drop(arena);
    tm_free(given[k]), tm_free(other);
  }
}

/* The parts of a body add up to it: cells of a tetrahedral mesh against the boxes they divide. */
static void parts_add_up_to_the_whole(void)
{
  tm_mesh  *given  = tm_tetrahedra((int[]){3, 3, 3}, NULL, NULL);
  rm_arena *arena  = rm_arena_new();
  double    sum[6] = {0}, volume = 0;
  const double(*second)[6];
  const rm_mesh *mesh = build(arena, given, &second);

  for (rm_lid c = 0; c < mesh->num_cells; c++) {
    static const int row[6] = {0, 1, 2, 0, 0, 1}, column[6] = {0, 1, 2, 1, 2, 2};
    const double    *x = mesh->cell_centroid[c];

    volume += mesh->cell_volume[c];
    for (int k = 0; k < 6; k++) sum[k] += second[c][k] + mesh->cell_volume[c] * x[row[k]] * x[column[k]];
  }
  const double size = cbrt(volume);
  for (int k = 0; k < 6; k++) RT_NEAR(sum[k] / (volume * size * size), k < 3 ? 1.0 / 3 : 0.25, 1e-14);
  rm_arena_drop(arena);
  tm_free(given);
}

RT_MAIN(RT_CASE(boxes_have_what_is_written_down), RT_CASE(bits_depend_on_coordinates_alone), RT_CASE(parts_add_up_to_the_whole))
