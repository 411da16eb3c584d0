/* What rm_mesh_build refuses, with its reason, on every rank when one rank is at fault; and memory that runs out. */
#include "mesh/mesh_private.h"
#include "meshes.h"
#include "rt.h"

static const rm_frame unit_frame = {0.5, {0, 0, 0, 0.5, 0.5, 0.5}};

/* 4 x 4 x 4 hexahedra of the unit cube in slabs: ranks own ascending ranges of cells. */
static tm_mesh *slab(void)
{
  tm_mesh *whole = tm_hexahedra((int[]){4, 4, 4}, NULL, NULL);
  int     *rank  = tm_deal(whole, rt_size(), TM_SLABS, 0);
  tm_mesh *mine  = tm_part(whole, rank, rt_rank(), 0);

  free(rank);
  tm_free(whole);
  return mine;
}

static bool is_last(void) { return rt_rank() == rt_size() - 1; }

/* A way to spoil a mesh, the words its refusal has, and whether a single pass over the arrays finds it. */
typedef struct fault {
  void (*spoil)(tm_mesh *mesh);
  const char  *words[3];
  bool         names_cell, in_arrays;
  remap_status status;
} fault;

static remap_status try_build(const remap_mesh *given, rm_reason *reason)
{
  rm_comm        comm;
  rm_arena      *arena = rm_arena_new();
  const rm_mesh *out   = NULL;
  remap_status   status;

  RT_EQ(rm_comm_dup(MPI_COMM_WORLD, &comm), REMAP_OK);
  status = rm_mesh_build(arena, &comm, REMAP_TARGET, given, &unit_frame, REMAP_FACES_CENTRE, &out, reason);
  if (status != REMAP_OK) RT_CHECK(out == NULL);
  rm_comm_free(&comm);
  rm_arena_drop(arena);
  return status;
}

/* True if every rank has the same reason as the first. */
static bool same_everywhere(const rm_reason *mine)
{
  rm_reason first = *mine;

  MPI_Bcast(&first, (int)sizeof first, MPI_BYTE, 0, MPI_COMM_WORLD);
  return first.side == mine->side && first.global_cell == mine->global_cell && strcmp(first.text, mine->text) == 0;
}

static void expect(const fault *f)
{
  tm_mesh         *mine   = slab();
  rm_reason        reason = {-1, -1, ""};
  const rm_gid     last   = mine->view.num_cells > 0 ? mine->global[mine->view.num_cells - 1] : 0;
  const remap_mesh empty  = {0};
  rm_comm          comm;

  if (is_last()) f->spoil(mine);
  RT_EQ(try_build(&mine->view, &reason), f->status);
  RT_EQ(reason.side, REMAP_TARGET);
  for (int i = 0; i < 3 && f->words[i]; i++)
    if (!RT_CHECK(strstr(reason.text, f->words[i]) != NULL)) printf("# wanted \"%s\" in \"%s\"\n", f->words[i], reason.text);
  if (is_last() && f->names_cell) RT_CHECK(reason.global_cell >= 0 && reason.global_cell <= last);
  RT_CHECK(same_everywhere(&reason));

  if (f->in_arrays) { /* the frame is built first: it must not read through what it has not checked */
    const remap_mesh pair[2] = {empty, mine->view};
    rm_frame         frame;
    rm_reason        again = {-1, -1, ""};

    RT_EQ(rm_comm_dup(MPI_COMM_WORLD, &comm), REMAP_OK);
    RT_EQ(rm_frame_build(&comm, pair, &frame, &again), f->status);
    RT_STR(again.text, reason.text);
    rm_comm_free(&comm);
  }
  mine->view.num_cells = 0;
  tm_free(mine);
}

/* ---- arrays ---------------------------------------------------------------------------------------------------------- */

static void negative_nodes(tm_mesh *m) { m->view.num_nodes = -1; }
static void negative_faces(tm_mesh *m) { m->view.num_faces = -7; }
static void negative_cells(tm_mesh *m) { m->view.num_cells = INT64_MIN; }
static void too_many_cells(tm_mesh *m) { m->view.num_cells = INT64_MAX; }
static void negative_zones(tm_mesh *m) { m->view.num_zones = -2; }
static void no_nodes(tm_mesh *m) { m->view.node_xyz = NULL; }
static void no_offsets(tm_mesh *m) { m->view.face_offset = NULL; }
static void no_corners(tm_mesh *m) { m->view.face_node = NULL; }
static void no_owners(tm_mesh *m) { m->view.face_owner = NULL; }
static void no_neighbours(tm_mesh *m) { m->view.face_neighbour = NULL; }
static void no_zones(tm_mesh *m) { m->view.num_zones = 1; }
static void first_offset(tm_mesh *m) { m->face_offset[0] = 1; }
static void offsets_descend(tm_mesh *m) { m->face_offset[3] = 2; }
static void two_nodes(tm_mesh *m) { m->face_offset[2] = m->face_offset[1] + 2; }
static void node_out_of_range(tm_mesh *m) { m->face_node[9] = m->view.num_nodes; }
static void negative_node(tm_mesh *m) { m->face_node[9] = -1; }
static void owner_out_of_range(tm_mesh *m) { m->owner[4] = m->view.num_cells; }
static void negative_owner(tm_mesh *m) { m->owner[4] = -1; }
static void neighbour_out_of_range(tm_mesh *m) { m->neighbour[4] = m->view.num_cells + 3; }
static void negative_neighbour(tm_mesh *m) { m->neighbour[4] = -2; }
static void both_sides(tm_mesh *m) { m->neighbour[4] = m->owner[4]; }
static void zones_descend(tm_mesh *m)
{
  m->zone_offset           = tm_alloc_(3, sizeof(int64_t));
  m->zone_offset[0]        = 5;
  m->view.num_zones        = 2;
  m->view.zone_cell_offset = m->zone_offset;
}

static void arrays_that_cannot_be_read_are_refused_with_the_face_and_the_remedy(void)
{
  const fault fault_of[] = {
      {negative_nodes, {"num_nodes is -1", "not negative"}, false, true, REMAP_BAD_MESH},
      {negative_faces, {"num_faces is -7", "not negative"}, false, true, REMAP_BAD_MESH},
      {negative_cells, {"num_cells is -", "not negative"}, false, true, REMAP_BAD_MESH},
      {too_many_cells, {"num_cells is 9", "use more ranks"}, false, true, REMAP_TOO_LARGE},
      {negative_zones, {"num_zones is -2", "not negative"}, false, true, REMAP_BAD_MESH},
      {no_nodes, {"node_xyz is NULL", "give the array"}, false, true, REMAP_BAD_MESH},
      {no_offsets, {"face_offset is NULL", "give the array"}, false, true, REMAP_BAD_MESH},
      {no_corners, {"face_node is NULL", "give the array"}, false, true, REMAP_BAD_MESH},
      {no_owners, {"face_owner is NULL", "give the array"}, false, true, REMAP_BAD_MESH},
      {no_neighbours, {"face_neighbour is NULL", "give the array"}, false, true, REMAP_BAD_MESH},
      {no_zones, {"zone_cell_offset is NULL", "give the array"}, false, true, REMAP_BAD_MESH},
      {zones_descend, {"zone_cell_offset does not ascend at zone 0: 5, then 0"}, false, true, REMAP_BAD_MESH},
      {first_offset, {"face_offset starts with 1"}, false, true, REMAP_BAD_MESH},
      {offsets_descend, {"does not ascend at face 2: 8, then 2"}, true, true, REMAP_BAD_MESH},
      {two_nodes, {"its face 1 has 2 nodes", "leave it out"}, true, true, REMAP_BAD_MESH},
      {node_out_of_range, {"its face 2 has node ", "correct face_node"}, true, true, REMAP_BAD_MESH},
      {negative_node, {"its face 2 has node -1", "correct face_node"}, true, true, REMAP_BAD_MESH},
      {owner_out_of_range, {"face 4 has owner ", "correct face_owner"}, false, true, REMAP_BAD_MESH},
      {negative_owner, {"face 4 has owner -1", "correct face_owner"}, false, true, REMAP_BAD_MESH},
      {neighbour_out_of_range, {"its face 4 has neighbour ", "correct face_neighbour"}, true, true, REMAP_BAD_MESH},
      {negative_neighbour, {"its face 4 has neighbour -2", "-1 where there is none"}, true, true, REMAP_BAD_MESH},
      {both_sides, {"its face 4 has it on both sides"}, true, true, REMAP_BAD_MESH},
  };

  for (size_t i = 0; i < sizeof fault_of / sizeof *fault_of; i++) expect(&fault_of[i]);
}

/* ---- cells ------------------------------------------------------------------------------------------------------------ */

/* Drop the last face. */
static void face_missing(tm_mesh *m) { m->view.num_faces--; }
static void face_turned(tm_mesh *m)
{
  const int64_t x = m->face_node[0];

  m->face_node[0] = m->face_node[2];
  m->face_node[2] = x;
}
/* One face loses a node that its neighbours in the cell keep. */
static void node_missing(tm_mesh *m)
{
  for (int64_t k = 3; k + 1 < m->face_offset[m->view.num_faces]; k++) m->face_node[k] = m->face_node[k + 1];
  for (int64_t f = 1; f <= m->view.num_faces; f++) m->face_offset[f]--;
}
static void cell_without_faces(tm_mesh *m)
{
  m->global = realloc(m->global, (size_t)(m->view.num_cells + 1) * sizeof *m->global);
  if (!m->global) abort();
  m->global[m->view.num_cells] = 777;
  m->view.cell_global          = m->global;
  m->view.num_cells++;
}
static void negative_id(tm_mesh *m) { m->global[2] = -5; }

static void cells_that_are_not_cells_are_refused(void)
{
  const fault fault_of[] = {
      {face_missing, {"it is not closed", "along the edge from (", "give all its faces"}, true, false, REMAP_BAD_MESH},
      {face_turned, {"it is not closed", "along the edge from ("}, true, false, REMAP_BAD_MESH},
      {node_missing, {"it is not closed", "along the edge from ("}, true, false, REMAP_BAD_MESH},
      {cell_without_faces, {"it has no faces", "leave the cell out"}, false, false, REMAP_BAD_MESH},
      {negative_id, {"cell 2 of one rank has the global id -5"}, false, false, REMAP_BAD_MESH},
  };

  for (size_t i = 0; i < sizeof fault_of / sizeof *fault_of; i++) expect(&fault_of[i]);
}

static void an_open_cell_is_named_with_an_edge_in_the_callers_unit(void)
{
  tm_mesh  *whole  = tm_hexahedra((int[]){1, 1, 1}, NULL, NULL);
  rm_reason reason = {-1, -1, ""};

  for (int k = 0; k < 24; k++) whole->xyz[k] += 10.0 * (k % 3); /* x in 0..1, y in 10..11, z in 20..21 */
  whole->global[0] = 42;
  whole->view.num_faces--; /* without its top, z = 21 */
  if (!is_last()) whole->view = (remap_mesh){0};
  RT_EQ(try_build(&whole->view, &reason), REMAP_BAD_MESH);
  RT_EQ(reason.global_cell, 42);
  RT_CHECK(strstr(reason.text, "from (0, 10, 21) to (1, 10, 21)") || strstr(reason.text, "from (0, 10, 21) to (0, 11, 21)") ||
           strstr(reason.text, "from (1, 10, 21) to (1, 11, 21)") || strstr(reason.text, "from (0, 11, 21) to (1, 11, 21)"));
  RT_CHECK(same_everywhere(&reason));
  tm_free(whole);
}

static void an_id_on_two_ranks_is_refused(void)
{
  tm_mesh  *mine   = slab();
  rm_reason reason = {-1, -1, ""};

  mine->global[1] = is_last() ? 5 : mine->global[1]; /* cell 5 is the first rank's */
  RT_EQ(try_build(&mine->view, &reason), REMAP_BAD_MESH);
  RT_EQ(reason.global_cell, 5);
  RT_CHECK(strstr(reason.text, "two cells have this global id") != NULL);
  RT_CHECK(same_everywhere(&reason));
  tm_free(mine);
}

static void ids_on_some_ranks_only_are_refused_but_ranks_without_cells_are_free(void)
{
  tm_mesh         *mine   = slab();
  rm_reason        reason = {-1, -1, ""};
  const remap_mesh empty  = {0};

  if (is_last()) mine->view.cell_global = NULL;
  RT_EQ(try_build(&mine->view, &reason), rt_size() > 1 ? REMAP_BAD_MESH : REMAP_OK);
  if (rt_size() > 1) RT_CHECK(strstr(reason.text, "cell_global is given on some ranks") != NULL);
  RT_CHECK(same_everywhere(&reason));
  tm_free(mine);

  mine   = tm_hexahedra((int[]){2, 2, 2}, NULL, NULL);
  reason = (rm_reason){-1, -1, ""};
  RT_EQ(try_build(is_last() ? &mine->view : &empty, &reason), REMAP_OK);
  RT_STR(reason.text, "");
  tm_free(mine);
}

/* Two cubes side by side, given by the last rank, and a third one over the second by the first rank. */
static void a_third_cell_at_a_face_is_refused_wherever_it_is(void)
{
  for (int split = 0; split < 2; split++) {
    tm_mesh         *pair = tm_hexahedra((int[]){2, 1, 1}, NULL, NULL), *third = tm_hexahedra((int[]){1, 1, 1}, NULL, NULL);
    rm_reason        reason = {-1, -1, ""};
    const remap_mesh empty  = {0};
    tm_mesh         *mine   = pair;

    for (int v = 0; v < 8; v++) third->xyz[3 * v] = 0.5 + third->xyz[3 * v] / 2;
    third->global[0] = 2;
    if (rt_size() == 1 || !split) {
      mine                 = tm_join(pair, third);
      mine->view.num_zones = 0;
      RT_EQ(try_build(is_last() ? &mine->view : &empty, &reason), REMAP_BAD_MESH);
      tm_free(mine);
    } else {
      RT_EQ(try_build(is_last() ? &pair->view : rt_rank() == 0 ? &third->view : &empty, &reason), REMAP_BAD_MESH);
      tm_free(pair);
      tm_free(third);
    }
    RT_EQ(reason.global_cell, 2);
    RT_CHECK(strstr(reason.text, "a face in common with two more cells, 0 and 1, at (") != NULL);
    RT_CHECK(same_everywhere(&reason));
  }
}

/* ---- memory ------------------------------------------------------------------------------------------------------------- */

/* Build on all ranks while the n-th allocation of the last rank's arena, or of its scratch memory, fails. */
static remap_status build_with_failure(const remap_mesh *given, int64_t n, bool of_scratch)
{
  rm_comm        comm;
  rm_arena      *arena = rm_arena_new(), *scratch = rm_arena_new();
  const rm_mesh *out    = NULL;
  rm_reason      reason = {-1, -1, ""};
  remap_status   status;

  RT_EQ(rm_comm_dup(MPI_COMM_WORLD, &comm), REMAP_OK);
  if (is_last()) rm_arena_fail_at(of_scratch ? scratch : arena, n);
  status = rm_mesh_build_in(scratch, arena, &comm, REMAP_SOURCE, given, &unit_frame, REMAP_FACES_CENTRE, &out, &reason);
  RT_CHECK((status == REMAP_OK) == (out != NULL));
  rm_comm_free(&comm);
  rm_arena_drop(arena);
  rm_arena_drop(scratch);
  return status;
}

static void memory_that_runs_out_on_one_rank_stops_all(void)
{
  tm_mesh *mine = slab();

  for (int of_scratch = 0; of_scratch < 2; of_scratch++) {
    int64_t      n      = 0;
    remap_status status = REMAP_NO_MEMORY;

    while (status != REMAP_OK && n < 1000) {
      status = build_with_failure(&mine->view, ++n, of_scratch != 0);
      RT_CHECK(status == REMAP_OK || status == REMAP_NO_MEMORY);
    }
    RT_CHECK(n > (of_scratch ? 30 : 10) && n < 1000);
  }
  tm_free(mine);
}

static void a_rank_without_any_scratch_memory_stops_all(void)
{
  tm_mesh       *mine = slab();
  rm_comm        comm;
  rm_arena      *arena = rm_arena_new(), *scratch = is_last() ? NULL : rm_arena_new();
  const rm_mesh *out    = NULL;
  rm_reason      reason = {-1, -1, ""};

  RT_EQ(rm_comm_dup(MPI_COMM_WORLD, &comm), REMAP_OK);
  RT_EQ(rm_mesh_build_in(scratch, arena, &comm, REMAP_SOURCE, &mine->view, &unit_frame, REMAP_FACES_CENTRE, &out, &reason),
        REMAP_NO_MEMORY);
  rm_comm_free(&comm);
  rm_arena_drop(arena);
  rm_arena_drop(scratch);
  tm_free(mine);
}

RT_MAIN(RT_CASE(arrays_that_cannot_be_read_are_refused_with_the_face_and_the_remedy),
        RT_CASE(cells_that_are_not_cells_are_refused), RT_CASE(an_open_cell_is_named_with_an_edge_in_the_callers_unit),
        RT_CASE(an_id_on_two_ranks_is_refused), RT_CASE(ids_on_some_ranks_only_are_refused_but_ranks_without_cells_are_free),
        RT_CASE(a_third_cell_at_a_face_is_refused_wherever_it_is), RT_CASE(memory_that_runs_out_on_one_rank_stops_all),
        RT_CASE(a_rank_without_any_scratch_memory_stops_all))
