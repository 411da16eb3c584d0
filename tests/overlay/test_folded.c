/* Tangled, inverted, folded and coincident cells whose coordinates have a few bits, so that volumes of pairs vanish in every
 * way, against the oracle: a pair exists if the exact integral of both winding numbers is not zero. */
#include "oracle.h"

/* What becomes of a node of a lattice of whole numbers. */
typedef struct crumple {
  uint64_t seed;
  int      step;   /* between the lattice's planes             */
  int      reach;  /* nodes move by up to so much              */
  int      one_of; /* of so many nodes one moves               */
  int      fold;   /* coordinates beyond this one come back, 0: none do */
  bool     mirror;
} crumple;

static void crumpled(double xyz[3], const void *data)
{
  const crumple *r     = data;
  uint64_t       h     = r->seed ^ rm_hash_point(xyz);
  const bool     moves = tm_random(&h, r->one_of) == 0;

  for (int c = 0; c < 3; c++) {
    xyz[c] = rint(2 * xyz[c]) * r->step;
    if (moves) xyz[c] += (double)(tm_random(&h, 2 * r->reach + 1) - r->reach);
    if (r->fold && xyz[c] > r->fold) xyz[c] = 2 * r->fold - xyz[c];
  }
  if (r->mirror) xyz[0] = 2 * r->step - xyz[0];
}

static tm_mesh *make(int kind, const crumple *r)
{
  const int     n[3]   = {2, 1 + kind % 2, 1};
  const crumple scaled = *r;

  switch (kind / 2) {
    case 0: return tm_hexahedra(n, crumpled, &scaled);
    case 1: return tm_prisms(n, crumpled, &scaled);
    default: return tm_tetrahedra((int[]){1, 1, 1}, crumpled, &scaled);
  }
}

static void agrees(tm_mesh *a, tm_mesh *b, uint64_t number)
{
  const int before = rt_failed_;

  for (int way = 0; way < 2; way++) {
    laid *l = laid_over(way ? b : a, way ? a : b, number & 1 ? REMAP_FACES_DIAGONAL : REMAP_FACES_CENTRE, NULL);

    if (RT_EQ(l->status, REMAP_OK)) oracle_check(l, ORACLE_TANGLED);
    laid_free(l);
  }
  if (rt_failed_ > before) printf("# number %llu\n", (unsigned long long)number);
}

static void rounds(int count, int reach, int one_of, int fold, bool mirror, bool alike)
{
  for (uint64_t number = 1; number <= (uint64_t)(rt_long() ? 100 * count : count) && rt_failed_ < 20; number++) {
    uint64_t      seed = 7919 * number;
    const int     kind = (int)tm_random(&seed, 5);
    const crumple r    = {number, 2, reach, one_of, fold, false},
                  s    = {alike ? number : number + 1000000, 2, reach, one_of, fold, mirror};
    tm_mesh *a = make(kind, &r), *b = make(alike ? kind : (int)tm_random(&seed, 5), &s);

    agrees(a, b, number);
    tm_free(a);
    tm_free(b);
  }
}

static void nodes_anywhere_agree(void) { rounds(25, 3, 1, 0, false, false); }
static void a_few_nodes_moved_through_their_cells_agree(void) { rounds(25, 4, 4, 0, false, false); }
static void a_tangled_mesh_agrees_with_itself(void) { rounds(15, 3, 2, 0, false, true); }
static void a_tangled_mesh_agrees_with_its_mirror_image(void) { rounds(15, 3, 3, 0, true, true); }
static void folded_layers_agree(void) { rounds(25, 1, 6, 2, false, false); }
static void a_folded_mesh_agrees_with_itself(void) { rounds(15, 1, 8, 3, false, true); }
static void an_inverted_mesh_agrees(void) { rounds(15, 1, 6, 0, true, false); }

/* A box twisted by half a turn: what is below the plane z = 4 winds once, what is above, its mirror image, winds back. */
static void twisted(double xyz[3], const void *data)
{
  (void)data;
  xyz[0] = (8 * xyz[0] - 4) * (1 - 2 * xyz[2]);
  xyz[1] *= 8;
  xyz[2] *= 8;
}

/* A tetrahedron that the plane z = 4 cuts in halves. */
static tm_mesh *even_tetrahedron(uint64_t seed)
{
  static const double height[4] = {0, 8, 4, 4};
  tm_builder_         b         = {0};
  double              p[4][3];
  int64_t            *id;
  tm_mesh            *mesh;

  for (int k = 0; k < 4; k++) {
    p[k][0] = (double)(tm_random(&seed, 13) - 6), p[k][1] = (double)(tm_random(&seed, 13) - 2);
    p[k][2] = height[k] + (k == 1 ? 1 : k == 0 ? -1 : 0) * (double)(seed % 2);
  }
  p[1][0] = p[0][0], p[1][1] = p[0][1];
  tm_add_tetrahedron_(&b, (int64_t[]){0, 1, 2, 3});
  mesh = tm_finish_(&b, 4, &id);
  for (int64_t v = 0; v < mesh->view.num_nodes; v++) memcpy(mesh->xyz + 3 * v, p[id[v]], sizeof p[0]);
  free(id);
  return mesh;
}

/* The pair's volume is zero, and no two of its polygons lie in one plane. */
static void what_winds_forth_and_back_is_no_pair(void)
{
  int num_none = 0;

  for (uint64_t number = 1; number <= (rt_long() ? 2000 : 40); number++) {
    tm_mesh *twist = tm_hexahedra((int[]){1, 1, 1}, twisted, NULL), *even = even_tetrahedron(number);
    laid    *l = laid_over(twist, even, REMAP_FACES_CENTRE, NULL);

    if (RT_EQ(l->status, REMAP_OK)) {
      oracle_check(l, ORACLE_TANGLED);
      num_none += laid_volume(l, 0, 0) == 0 && l->overlay->trace[0].num_crossings > 0;
    }
    laid_free(l);
    tm_free(twist);
    tm_free(even);
  }
  RT_CHECK(num_none > 20);
}

/* The same, but for the last bit of one coordinate. */
static void what_winds_not_quite_back_is_a_pair(void)
{
  for (uint64_t number = 1; number <= (rt_long() ? 2000 : 40); number++) {
    tm_mesh *twist = tm_hexahedra((int[]){1, 1, 1}, twisted, NULL), *even = even_tetrahedron(number);
    laid    *l;

    even->xyz[3 * (number % 4) + 2] = nextafter(even->xyz[3 * (number % 4) + 2], 100);
    l                               = laid_over(twist, even, REMAP_FACES_CENTRE, NULL);
    if (RT_EQ(l->status, REMAP_OK)) oracle_check(l, ORACLE_TANGLED);
    laid_free(l);
    tm_free(twist);
    tm_free(even);
  }
}

RT_MAIN(RT_CASE(what_winds_forth_and_back_is_no_pair), RT_CASE(what_winds_not_quite_back_is_a_pair),
        RT_CASE(nodes_anywhere_agree), RT_CASE(a_few_nodes_moved_through_their_cells_agree),
        RT_CASE(a_tangled_mesh_agrees_with_itself), RT_CASE(a_tangled_mesh_agrees_with_its_mirror_image),
        RT_CASE(folded_layers_agree), RT_CASE(a_folded_mesh_agrees_with_itself), RT_CASE(an_inverted_mesh_agrees))
