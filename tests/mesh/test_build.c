/* What rm_mesh_build makes of good meshes: joined faces, skin, ids, the same on any partition. */
#include "built.h"
#include "mesh/mesh_private.h"

static int64_t sum_all(int64_t mine)
{
  int64_t all = 0;

  MPI_Allreduce(&mine, &all, 1, MPI_INT64_T, MPI_SUM, MPI_COMM_WORLD);
  return all;
}

static int64_t num_skin(const rm_mesh *mesh)
{
  int64_t num = 0;

  for (rm_lid f = 0; f < mesh->num_faces; f++) num += mesh->face_is_skin[f];
  return sum_all(num);
}

/* Meshes of the unit cube, warped if map is not NULL. */
enum { KINDS = 7 };
static tm_mesh *maker(int kind, tm_map map, const void *data)
{
  switch (kind) {
    case 0: return tm_hexahedra((int[]){4, 3, 5}, map, data);
    case 1: return tm_tetrahedra((int[]){3, 2, 2}, map, data);
    case 2: return tm_prisms((int[]){2, 3, 3}, map, data);
    case 3: return tm_pyramids((int[]){3, 2, 3}, map, data);
    case 4: return tm_mixed((int[]){6, 2, 2}, map, data);
    case 5: return tm_refined((int[]){4, 3, 3}, tm_right_half, map, data);
    default: return tm_dual((int[]){3, 3, 3}, map, data);
  }
}

/* This rank's part of a mesh. */
static tm_mesh *deal(const tm_mesh *whole, tm_dealing how, uint64_t seed)
{
  int     *rank = tm_deal(whole, rt_size(), how, seed);
  tm_mesh *mine = tm_part(whole, rank, rt_rank(), seed);

  free(rank);
  return mine;
}

static void cells_of_a_cube_fill_it_and_only_its_sides_are_skin(void)
{
  for (int kind = 0; kind < KINDS; kind++) {
    tm_mesh *whole    = maker(kind, NULL, NULL);
    int64_t  boundary = 0;

    for (int64_t f = 0; f < whole->view.num_faces; f++) boundary += whole->neighbour[f] < 0;
    for (int how = 0; how < 3; how++) {
      rm_arena      *arena = rm_arena_new();
      tm_mesh       *mine  = deal(whole, (tm_dealing)how, (uint64_t)how);
      rm_frame       frame;
      const rm_mesh *mesh = build(arena, MPI_COMM_WORLD, &mine->view, REMAP_FACES_CENTRE, &frame);

      if (rt_all(mesh != NULL)) {
        RT_EQ(mesh->num_global_cells, whole->view.num_cells);
        RT_EQ(mesh->num_cells, mine->view.num_cells);
        RT_EQ(mesh->num_inverted, 0);
        RT_NEAR(mesh->volume, 0.125, 0x1p-52);
        RT_EQ(num_skin(mesh), boundary);
      }
      tm_free(mine);
      rm_arena_drop(arena);
    }
    tm_free(whole);
  }
}

/* Volumes and centroids of the cells, and what is global, bitwise as in a build on one rank alone. */
static void compare_with_whole(const rm_mesh *mesh, const rm_mesh *whole)
{
  RT_NEAR(mesh->volume, whole->volume, 0.0);
  RT_EQ(mesh->num_inverted, whole->num_inverted);
  for (rm_lid c = 0; c < mesh->num_cells; c++) {
    const rm_gid id = mesh->cell_global[c];

    RT_NEAR(mesh->cell_volume[c], whole->cell_volume[id], 0.0);
    for (int a = 0; a < 3; a++) RT_NEAR(mesh->cell_centroid[c][a], whole->cell_centroid[id][a], 0.0);
    for (int i = 0; i < 6; i++) RT_NEAR(mesh->cell_box[c][i], whole->cell_box[id][i], 0.0);
  }
}

static void results_are_bitwise_the_same_for_any_partition_and_numbering(void)
{
  const tm_warping warp = {0.06, 0.7};

  for (int kind = 0; kind < KINDS; kind++)
    for (int faces = 0; faces < 2; faces++) {
      tm_mesh       *whole = maker(kind, tm_warp, &warp);
      rm_arena      *arena = rm_arena_new();
      rm_frame       frame, other;
      const rm_mesh *alone = build(arena, MPI_COMM_SELF, &whole->view, (remap_faces)faces, &frame);

      for (int how = 0; how < 3 && rt_all(alone != NULL); how++) {
        tm_mesh       *mine = deal(whole, (tm_dealing)how, 77 + (uint64_t)how);
        const rm_mesh *mesh = build(arena, MPI_COMM_WORLD, &mine->view, (remap_faces)faces, &other);

        RT_NEAR(other.scale, frame.scale, 0.0);
        for (int i = 0; i < 6; i++) RT_NEAR(other.box[i], frame.box[i], 0.0);
        if (mesh) compare_with_whole(mesh, alone);
        tm_free(mine);
      }
      rm_arena_drop(arena);
      tm_free(whole);
    }
}

static void the_unit_of_length_changes_nothing_but_the_scale(void)
{
  const tm_warping warp   = {0.06, 0.7};
  const double     unit[] = {0x1p-900, 0x1p-20, 8.0, 0x1p300, 0x1p1000};
  tm_mesh         *whole  = maker(0, tm_warp, &warp);
  rm_arena        *arena  = rm_arena_new();
  rm_frame         frame, other;
  const rm_mesh   *alone = build(arena, MPI_COMM_SELF, &whole->view, REMAP_FACES_CENTRE, &frame);

  for (int i = 0; i < 5 && rt_all(alone != NULL); i++) {
    tm_mesh       *mine = deal(whole, TM_RANDOM, 3);
    const rm_mesh *mesh;

    for (int64_t k = 0; k < 3 * mine->view.num_nodes; k++) mine->xyz[k] *= unit[i];
    mesh = build(arena, MPI_COMM_WORLD, &mine->view, REMAP_FACES_CENTRE, &other);
    RT_NEAR(other.scale, frame.scale / unit[i], 0.0);
    if (mesh) compare_with_whole(mesh, alone);
    tm_free(mine);
  }
  rm_arena_drop(arena);
  tm_free(whole);
}

static void a_face_has_two_cells_where_both_are_on_the_rank_and_no_skin_where_not(void)
{
  tm_mesh       *whole = tm_hexahedra((int[]){rt_size(), 1, 1}, NULL, NULL);
  rm_arena      *arena = rm_arena_new();
  tm_mesh       *mine  = deal(whole, TM_SLABS, 0); /* one cell each, in a row */
  rm_frame       frame;
  const rm_mesh *mesh = build(arena, MPI_COMM_WORLD, &mine->view, REMAP_FACES_CENTRE, &frame);

  if (rt_all(mesh != NULL)) {
    int64_t inner = 0;

    RT_EQ(mesh->num_faces, 6);
    RT_EQ(mesh->num_nodes, 8);
    for (rm_lid f = 0; f < 6; f++) {
      RT_EQ(mesh->face_cell[f][0], 0);
      RT_EQ(mesh->face_cell[f][1], -1);
      inner += !mesh->face_is_skin[f];
    }
    RT_EQ(inner, rt_size() == 1 ? 0 : rt_rank() == 0 || rt_rank() == rt_size() - 1 ? 1 : 2);
  }
  tm_free(mine);
  tm_free(whole);
  rm_arena_drop(arena);
}

/* Give every face its own copy of its nodes, and each inner face twice, once from each cell. */
static tm_mesh *fall_apart(const tm_mesh *mesh)
{
  const remap_mesh *v    = &mesh->view;
  const int64_t     most = 2 * mesh->face_offset[v->num_faces];
  tm_mesh          *out  = tm_new_(most + 1, 2 * v->num_faces, most, v->num_cells);
  int64_t           face = 0, corner = 0;

  for (int64_t f = 0; f < v->num_faces; f++)
    for (int side = 0; side < 2; side++) {
      const int64_t first = mesh->face_offset[f], n = mesh->face_offset[f + 1] - first;
      const int64_t cell = side ? mesh->neighbour[f] : mesh->owner[f];

      if (cell < 0) continue;
      for (int64_t k = 0; k < n; k++, corner++) {
        memcpy(out->xyz + 3 * corner, mesh->xyz + 3 * mesh->face_node[first + (side ? n - k : k) % n], 3 * sizeof(double));
        out->face_node[corner] = corner;
      }
      out->owner[face]           = cell;
      out->neighbour[face]       = -1;
      out->face_offset[face + 1] = corner;
      face++;
    }
  out->view.num_faces = face;
  for (int a = 0; a < 3; a++) out->xyz[3 * most + a] = NAN; /* no face uses this one */
  memcpy(out->global, mesh->global, (size_t)v->num_cells * sizeof *mesh->global);
  return out;
}

static void nodes_and_faces_given_many_times_are_found_together(void)
{
  for (int kind = 0; kind < KINDS; kind++) {
    tm_mesh       *whole  = maker(kind, NULL, NULL);
    tm_mesh       *pieces = fall_apart(whole);
    rm_arena      *arena  = rm_arena_new();
    rm_frame       frame;
    const rm_mesh *joined = build(arena, MPI_COMM_SELF, &whole->view, REMAP_FACES_CENTRE, &frame);
    const rm_mesh *mesh   = build(arena, MPI_COMM_SELF, &pieces->view, REMAP_FACES_CENTRE, &frame);

    if (joined && mesh) {
      RT_EQ(mesh->num_nodes, whole->view.num_nodes);
      RT_EQ(mesh->num_faces, whole->view.num_faces);
      RT_EQ(num_skin(mesh), num_skin(joined));
      compare_with_whole(mesh, joined);
    }
    tm_free(whole);
    tm_free(pieces);
    rm_arena_drop(arena);
  }
}

static void zones_join_where_their_nodes_agree_and_stay_skin_where_not(void)
{
  for (int match = 0; match < 2; match++) {
    tm_mesh       *whole = tm_two_zones((int[]){2, 3, 3}, (int[]){2, match ? 3 : 4, 3}, 0, NULL, NULL);
    tm_mesh       *mine  = deal(whole, TM_RANDOM, 5);
    rm_arena      *arena = rm_arena_new();
    rm_frame       frame;
    const rm_mesh *mesh = build(arena, MPI_COMM_WORLD, &mine->view, REMAP_FACES_CENTRE, &frame);

    if (rt_all(mesh != NULL)) RT_EQ(num_skin(mesh), match ? 4 * 4 * 3 + 2 * 9 : (9 + 2 * 12 + 9) + (12 + 2 * 6 + 2 * 8 + 12));
    tm_free(mine);
    tm_free(whole);
    rm_arena_drop(arena);
  }
}

/* Unit boxes in a row along x, box i in zone zone[i] at place[i]. Every face is given by its one cell. */
static tm_mesh *row(int n, const int *zone, const int *place)
{
  tm_mesh *one = tm_hexahedra((int[]){1, 1, 1}, NULL, NULL), *out = tm_new_(8 * n, 6 * n, 24 * n, n);

  out->view.num_zones = zone[n - 1] + 1;
  out->zone_offset    = tm_alloc_(out->view.num_zones + 1, sizeof(int64_t));
  out->zone_name      = tm_alloc_(out->view.num_zones, sizeof(char *));
  for (int i = 0; i < n; i++) {
    for (int k = 0; k < 24; k++) {
      out->xyz[24 * i + k]       = one->xyz[k] + (k % 3 == 0 ? place[i] : 0);
      out->face_node[24 * i + k] = one->face_node[k] + 8 * i;
    }
    for (int f = 0; f < 6; f++) {
      out->face_offset[6 * i + f + 1] = 24 * i + 4 * (f + 1);
      out->owner[6 * i + f]           = i;
      out->neighbour[6 * i + f]       = -1;
    }
    out->global[i]                = i;
    out->zone_offset[zone[i] + 1] = i + 1;
  }
  tm_view_(out);
  tm_free(one);
  return out;
}

static int64_t skin_of_row(int n, const int *zone, const int *place)
{
  tm_mesh       *whole = row(n, zone, place), *mine = deal(whole, TM_RANDOM, 11);
  rm_arena      *arena = rm_arena_new();
  rm_frame       frame;
  const rm_mesh *mesh = build(arena, MPI_COMM_WORLD, &mine->view, REMAP_FACES_CENTRE, &frame);
  const int64_t  skin = rt_all(mesh != NULL) ? num_skin(mesh) : -1;

  tm_free(mine);
  tm_free(whole);
  rm_arena_drop(arena);
  return skin;
}

static void a_face_of_three_zones_stays_skin_and_pairs_within_a_zone_come_first(void)
{
  RT_EQ(skin_of_row(2, (int[]){0, 1}, (int[]){0, 1}), 10);       /* two boxes of two zones join             */
  RT_EQ(skin_of_row(2, (int[]){0, 1}, (int[]){0, 0}), 12);       /* the same box twice: all ways the same   */
  RT_EQ(skin_of_row(3, (int[]){0, 1, 2}, (int[]){0, 1, 1}), 18); /* three zones at one face: none joins     */
  RT_EQ(skin_of_row(3, (int[]){0, 0, 1}, (int[]){0, 1, 1}), 16); /* two of one zone join, the third is over */
}

/* A box of no thickness between two boxes: its faces lie on theirs. Cells 0, 1, 2; the flat one is 1. */
static void a_cell_of_no_thickness_lies_between_its_neighbours(void)
{
  tm_mesh       *whole = row(3, (int[]){0, 0, 0}, (int[]){0, 1, 1}), *mine;
  rm_arena      *arena = rm_arena_new();
  rm_frame       frame;
  const rm_mesh *mesh;

  for (int v = 8; v < 16; v++) whole->xyz[3 * v] = 1.0;
  mine = deal(whole, TM_SLABS, 0);
  mesh = build(arena, MPI_COMM_WORLD, &mine->view, REMAP_FACES_CENTRE, &frame);
  if (rt_all(mesh != NULL)) {
    RT_EQ(num_skin(mesh), 10);
    RT_NEAR(mesh->volume, 2.0 / 64, 0.0);
    RT_EQ(mesh->num_inverted, 0);
    for (rm_lid c = 0; c < mesh->num_cells; c++) {
      RT_NEAR(mesh->cell_volume[c], mesh->cell_global[c] == 1 ? 0.0 : 1.0 / 64, 0.0);
      RT_NEAR(mesh->cell_centroid[c][0], 0.125 + 0.125 * (double)mesh->cell_global[c], 0.0);
      RT_NEAR(mesh->cell_centroid[c][2], 0.125, 0.0);
    }
  }
  tm_free(mine);
  tm_free(whole);
  rm_arena_drop(arena);
}

static void mirror(double x[3], const void *unused)
{
  (void)unused;
  x[0] = -x[0];
}

static void a_cell_turned_inside_out_has_negative_volume_and_is_counted(void)
{
  tm_mesh       *whole = tm_hexahedra((int[]){4, 2, 2}, mirror, NULL);
  tm_mesh       *mine  = deal(whole, TM_RANDOM, 2);
  rm_arena      *arena = rm_arena_new();
  rm_frame       frame;
  const rm_mesh *mesh = build(arena, MPI_COMM_WORLD, &mine->view, REMAP_FACES_DIAGONAL, &frame);

  if (rt_all(mesh != NULL)) {
    RT_EQ(mesh->num_inverted, 16);
    RT_EQ(mesh->worst_inverted, 0); /* all alike: the first */
    RT_NEAR(mesh->volume, 0.125, 0.0);
    for (rm_lid c = 0; c < mesh->num_cells; c++) RT_NEAR(mesh->cell_volume[c], -0.125 / 16, 0.0);
  }
  tm_free(mine);
  tm_free(whole);
  rm_arena_drop(arena);
}

static void a_closed_surface_is_a_mesh_of_one_cell(void)
{
  tm_mesh       *cube  = tm_hexahedra((int[]){20, 20, 20}, NULL, NULL);
  rm_arena      *arena = rm_arena_new();
  int64_t        num   = 0;
  rm_frame       frame;
  const rm_mesh *mesh;

  for (int64_t f = 0; f < cube->view.num_faces; f++) { /* keep the faces of the cube's sides, all of one cell */
    if (cube->neighbour[f] >= 0) continue;
    memmove(cube->face_node + 4 * num, cube->face_node + 4 * f, 4 * sizeof *cube->face_node);
    cube->owner[num]       = 0;
    cube->neighbour[num++] = -1;
  }
  cube->view.num_faces = num;
  cube->view.num_cells = 1;
  mesh                 = build(arena, MPI_COMM_SELF, &cube->view, REMAP_FACES_CENTRE, &frame);
  if (mesh) {
    RT_EQ(mesh->num_faces, 6 * 400);
    RT_EQ(mesh->num_nodes, 21 * 21 * 21 - 19 * 19 * 19);
    RT_NEAR(mesh->cell_volume[0], 0.125, 0x1p-52);
    for (int a = 0; a < 3; a++) RT_NEAR(mesh->cell_centroid[0][a], 0.25, 0x1p-52);
  }
  tm_free(cube);
  rm_arena_drop(arena);
}

/* A box with two triangles inside of it, which lie on each other and look opposite ways. */
static void a_wall_inside_a_cell_is_no_skin_and_takes_no_volume(void)
{
  tm_mesh       *box = row(1, (int[]){0}, (int[]){0}), *with = tm_new_(8, 8, 30, 1);
  rm_arena      *arena   = rm_arena_new();
  const int64_t  wall[6] = {0, 3, 7, 7, 3, 0};
  rm_frame       frame;
  const rm_mesh *mesh;

  memcpy(with->xyz, box->xyz, 24 * sizeof(double));
  memcpy(with->face_node, box->face_node, 24 * sizeof(int64_t));
  memcpy(with->face_node + 24, wall, sizeof wall);
  for (int f = 0; f < 8; f++) {
    with->face_offset[f + 1] = f < 6 ? 4 * (f + 1) : 24 + 3 * (f - 5);
    with->neighbour[f]       = -1;
  }
  mesh = build(arena, MPI_COMM_SELF, &with->view, REMAP_FACES_CENTRE, &frame);
  if (mesh) {
    RT_EQ(mesh->num_faces, 8);
    for (int f = 0; f < 8; f++) {
      RT_EQ(mesh->face_is_skin[f], f < 6);
      RT_EQ(mesh->face_cell[f][1], -1);
    }
    RT_NEAR(mesh->cell_volume[0], 0.125, 0.0);
  }
  tm_free(box);
  tm_free(with);
  rm_arena_drop(arena);
}

static void cells_are_numbered_rank_after_rank_if_no_ids_are_given(void)
{
  tm_mesh       *whole = tm_hexahedra((int[]){3, 3, 3}, NULL, NULL);
  tm_mesh       *mine  = deal(whole, TM_SLABS, 0);
  rm_arena      *arena = rm_arena_new();
  rm_frame       frame;
  const rm_mesh *mesh;

  mine->view.cell_global = NULL;
  mesh                   = build(arena, MPI_COMM_WORLD, &mine->view, REMAP_FACES_CENTRE, &frame);
  if (rt_all(mesh != NULL))
    for (rm_lid c = 0; c < mesh->num_cells; c++) RT_EQ(mesh->cell_global[c], mine->global[c]);
  tm_free(mine);
  tm_free(whole);
  rm_arena_drop(arena);
}

static void no_cells_at_all_make_an_empty_mesh(void)
{
  rm_arena        *arena = rm_arena_new();
  const remap_mesh empty = {0};
  rm_frame         frame;
  const rm_mesh   *mesh = build(arena, MPI_COMM_WORLD, &empty, REMAP_FACES_CENTRE, &frame);

  if (rt_all(mesh != NULL)) {
    RT_EQ(mesh->num_cells, 0);
    RT_EQ(mesh->num_global_cells, 0);
    RT_NEAR(mesh->volume, 0.0, 0.0);
  }
  rm_arena_drop(arena);
}

static void a_check_finds_what_is_broken(void)
{
  rm_arena      *arena = rm_arena_new();
  tm_mesh       *given = tm_hexahedra((int[]){2, 2, 2}, NULL, NULL);
  rm_frame       frame;
  const rm_mesh *mesh = build(arena, MPI_COMM_SELF, &given->view, REMAP_FACES_CENTRE, &frame);

  if (mesh) {
    rm_mesh  broken = *mesh;
    rm_lid  *node   = rm_arena_alloc(arena, mesh->face_offset[mesh->num_faces], sizeof *node);
    uint8_t *skin   = rm_arena_alloc(arena, mesh->num_faces, 1);
    double(*xyz)[3] = rm_arena_alloc(arena, mesh->num_nodes, sizeof *xyz);
    double(*box)[6] = rm_arena_alloc(arena, mesh->num_cells, sizeof *box);

    memcpy(node, mesh->face_node, (size_t)mesh->face_offset[mesh->num_faces] * sizeof *node);
    broken.face_node = node;
    node[0]          = node[1];
    RT_EQ(rm_mesh_check(&broken), REMAP_INTERNAL);
    node[0] = mesh->face_node[2];
    node[2] = mesh->face_node[0]; /* turned over: open */
    RT_EQ(rm_mesh_check(&broken), REMAP_INTERNAL);

    broken = *mesh;
    memset(skin, 1, (size_t)mesh->num_faces);
    broken.face_is_skin = skin;
    RT_EQ(rm_mesh_check(&broken), REMAP_INTERNAL);

    broken = *mesh;
    memcpy(xyz, mesh->node_xyz, (size_t)mesh->num_nodes * sizeof *xyz);
    memcpy(xyz[0], xyz[1], sizeof *xyz);
    broken.node_xyz = (const double(*)[3])xyz;
    RT_EQ(rm_mesh_check(&broken), REMAP_INTERNAL);

    broken = *mesh;
    memcpy(box, mesh->cell_box, (size_t)mesh->num_cells * sizeof *box);
    box[3][4] *= 0.9;
    broken.cell_box = (const double(*)[6])box;
    RT_EQ(rm_mesh_check(&broken), REMAP_INTERNAL);
  }
  tm_free(given);
  rm_arena_drop(arena);
}

RT_MAIN(RT_CASE(cells_of_a_cube_fill_it_and_only_its_sides_are_skin),
        RT_CASE(results_are_bitwise_the_same_for_any_partition_and_numbering),
        RT_CASE(the_unit_of_length_changes_nothing_but_the_scale),
        RT_CASE(a_face_has_two_cells_where_both_are_on_the_rank_and_no_skin_where_not),
        RT_CASE(nodes_and_faces_given_many_times_are_found_together),
        RT_CASE(zones_join_where_their_nodes_agree_and_stay_skin_where_not),
        RT_CASE(a_face_of_three_zones_stays_skin_and_pairs_within_a_zone_come_first),
        RT_CASE(a_cell_of_no_thickness_lies_between_its_neighbours),
        RT_CASE(a_cell_turned_inside_out_has_negative_volume_and_is_counted),
        RT_CASE(a_closed_surface_is_a_mesh_of_one_cell), RT_CASE(a_wall_inside_a_cell_is_no_skin_and_takes_no_volume),
        RT_CASE(cells_are_numbered_rank_after_rank_if_no_ids_are_given), RT_CASE(no_cells_at_all_make_an_empty_mesh),
        RT_CASE(a_check_finds_what_is_broken))
