/* The common frame of two meshes, and Morton keys in it. */
#include "mesh/mesh.h"
#include "rt.h"

static rm_comm world(void)
{
  rm_comm comm;

  RT_EQ(rm_comm_dup(MPI_COMM_WORLD, &comm), REMAP_OK);
  return comm;
}

/* One triangle over three given points, and a fourth point that no face uses. */
static const int64_t face_offset[] = {0, 3}, face_node[] = {0, 1, 2}, zero[] = {0}, none[] = {-1};
static remap_mesh    triangle(const double xyz[12])
{
  return (remap_mesh){.num_nodes      = 4,
                      .num_faces      = 1,
                      .num_cells      = 1,
                      .node_xyz       = xyz,
                      .face_offset    = face_offset,
                      .face_node      = face_node,
                      .face_owner     = zero,
                      .face_neighbour = none};
}

static rm_frame frame_of(remap_mesh source, remap_mesh target)
{
  rm_comm          comm    = world();
  const remap_mesh mesh[2] = {source, target};
  rm_frame         frame   = {0};
  rm_reason        reason  = {-1, -1, ""};

  RT_EQ(rm_frame_build(&comm, mesh, &frame, &reason), REMAP_OK);
  RT_STR(reason.text, "");
  rm_comm_free(&comm);
  return frame;
}

static void without_nodes_the_frame_is_the_callers(void)
{
  const rm_frame frame = frame_of((remap_mesh){0}, (remap_mesh){0});

  RT_NEAR(frame.scale, 1.0, 0.0);
  for (int i = 0; i < 6; i++) RT_NEAR(frame.box[i], 0.0, 0.0);
}

static void the_largest_coordinate_of_both_meshes_and_all_ranks_comes_to_between_a_half_and_one(void)
{
  const double   large[]  = {0, 0, 0, 100.0 * (1 + rt_rank()), 1, 2, -3, 7, 5, 9e9, 0, 0};
  const double   small[]  = {0, 0, 0, 1, 1, 2, -4, -7, 50, 9e9, 0, 0};
  const double   largest  = 100.0 * rt_size();
  const rm_frame frame    = frame_of(triangle(large), rt_rank() == 0 ? triangle(small) : (remap_mesh){0});
  int            exponent = 0;

  RT_NEAR(frexp(frame.scale, &exponent), 0.5, 0.0); /* a power of two */
  RT_CHECK(largest * frame.scale >= 0.5 && largest * frame.scale < 1.0);
  RT_NEAR(frame.box[0], -4 * frame.scale, 0.0);
  RT_NEAR(frame.box[1], -7 * frame.scale, 0.0);
  RT_NEAR(frame.box[2], 0.0, 0.0);
  RT_NEAR(frame.box[3], largest * frame.scale, 0.0);
  RT_NEAR(frame.box[4], 7 * frame.scale, 0.0);
  RT_NEAR(frame.box[5], 50 * frame.scale, 0.0);
}

static void the_greatest_and_the_least_doubles_have_a_frame(void)
{
  const double greatest[] = {-0.0, 0, 0, 1.7e308, 0, 0, 0, -1.7e308, 0, 0, 0, 0};
  const double least[]    = {0, 0, 0, 5e-324, 0, 0, 0, 5e-324, 0, 0, 0, 0};
  const double powers[]   = {0, 0, 0, 0x1p200, 0, 0, 0, 0, 0x1p99, 0, 0, 0};
  rm_frame     frame      = frame_of(triangle(greatest), triangle(greatest));

  RT_CHECK(frame.box[3] >= 0.5 && frame.box[3] < 1.0 && frame.box[1] == -frame.box[3]);
  RT_CHECK(!signbit(frame.box[0]) && !signbit(frame.box[5]));
  frame = frame_of(triangle(least), triangle(least));
  RT_CHECK(frame.box[3] > 0.0 && frame.box[3] < 1.0 && isfinite(frame.scale));
  frame = frame_of(triangle(powers), triangle(powers));
  RT_NEAR(frame.box[3], 0.5, 0.0);
  RT_NEAR(frame.box[5], 0.0, 0.0); /* below 2^-100 of the largest */
}

static void a_coordinate_that_is_not_finite_is_refused_on_every_rank(void)
{
  const double bad[] = {NAN, INFINITY, -INFINITY};

  for (int i = 0; i < 6; i++) {
    rm_comm      comm    = world();
    const int    last    = rt_size() - 1;
    double       xyz[12] = {0, 0, 0, 1, 0, 0, 0, 1, 0, NAN, 0, 0};
    remap_mesh   mesh[2];
    rm_frame     frame  = {7.0, {0}};
    rm_reason    reason = {-1, -1, ""};
    const rm_gid id     = 4711;

    if (rt_rank() == last) xyz[3 * (i % 3) + i / 2] = bad[i % 3];
    mesh[0] = mesh[1] = triangle(xyz);
    mesh[0].num_faces = 0;
    if (rt_rank() == last) mesh[1].cell_global = &id;
    RT_EQ(rm_frame_build(&comm, mesh, &frame, &reason), REMAP_BAD_MESH);
    RT_EQ(reason.side, REMAP_TARGET);
    RT_EQ(reason.global_cell, 4711);
    RT_CHECK(strstr(reason.text, "of its face 0 lies at (") && strstr(reason.text, "give finite coordinates"));
    RT_NEAR(frame.scale, 7.0, 0.0);
    rm_comm_free(&comm);
  }
}

static void morton_keys_follow_the_curve_of_a_cube_about_the_box(void)
{
  const rm_frame frame = {1.0, {0, 0, 0, 0.5, 0.25, 0.5}};
  const uint64_t most  = (UINT64_C(1) << 63) - 1;

  RT_EQ(rm_morton(&frame, (double[]){0, 0, 0}), 0);
  RT_EQ(rm_morton(&frame, (double[]){0x1p-22, 0, 0}), 1);
  RT_EQ(rm_morton(&frame, (double[]){0, 0x1p-22, 0}), 2);
  RT_EQ(rm_morton(&frame, (double[]){0, 0, 0x1p-22}), 4);
  RT_EQ(rm_morton(&frame, (double[]){0x1p-21, 0, 0}), 8);
  RT_EQ(rm_morton(&frame, (double[]){0.25, 0, 0}), (int64_t)1 << 60);
  RT_EQ(rm_morton(&frame, (double[]){0.5, 0.5, 0.5}), (int64_t)most);
  RT_EQ(rm_morton(&frame, (double[]){0.9, 0.9, 0.9}), (int64_t)most); /* outside: the nearest */
  RT_EQ(rm_morton(&frame, (double[]){-0.1, -0.1, -0.1}), 0);
  RT_EQ(rm_morton(&(rm_frame){1.0, {0}}, (double[]){0, 0, 0}), 0);
}

RT_MAIN(RT_CASE(without_nodes_the_frame_is_the_callers),
        RT_CASE(the_largest_coordinate_of_both_meshes_and_all_ranks_comes_to_between_a_half_and_one),
        RT_CASE(the_greatest_and_the_least_doubles_have_a_frame),
        RT_CASE(a_coordinate_that_is_not_finite_is_refused_on_every_rank),
        RT_CASE(morton_keys_follow_the_curve_of_a_cube_about_the_box))
