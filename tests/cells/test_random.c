/* Supermeshes of random meshes whose coordinates have so few bits that vertices, edges and faces of the two coincide, cross and
 * touch in every way. What fails prints its seed. */
#include "rough.h"
#include "super.h"

/* Every cell is seen from the mean of its vertices, clearly: neither tangled nor inverted. */
static bool is_plain(const rm_trimesh *m)
{
  for (rm_lid c = 0; c < m->num_cells; c++) {
    const rm_lid first = m->cell_vertex_offset[c], last = m->cell_vertex_offset[c + 1];
    double       o[3]  = {0, 0, 0};

    for (rm_lid k = first; k < last; k++)
      for (int d = 0; d < 3; d++) o[d] += m->vertex[m->cell_vertex[k]][d] / (last - first);
    for (rm_lid a = m->cell_triangle_offset[c]; a < m->cell_triangle_offset[c + 1]; a++) {
      const rm_lid *t = m->triangle[m->cell_triangle[a] / 2];
      if (rm_det_dd(o, m->vertex[t[0]], m->vertex[t[1]], m->vertex[t[2]]).hi * (m->cell_triangle[a] & 1 ? -1 : 1) < 1e-9)
        return false;
    }
  }
  return true;
}

static bool try_seed(uint64_t number, bool rough)
{
  uint64_t          seed   = 1000 * number;
  const int         before = rt_failed_;
  tm_mesh          *a = rough_mesh(&seed, rough), *b = rough_mesh(&seed, rough);
  const remap_faces faces = tm_random(&seed, 2) ? REMAP_FACES_CENTRE : REMAP_FACES_DIAGONAL;
  super             s     = super_of(a, b, faces, NULL, SUPER_UNION);
  const bool        plain = s.l->mesh[0] && s.l->mesh[1] && is_plain(s.l->mesh[0]) && is_plain(s.l->mesh[1]);

  if (plain) super_check(&s, -1, faces == REMAP_FACES_DIAGONAL); /* centres do not have few bits */
  if (rt_failed_ > before)
    printf("# seed %llu, %d and %d cells, faces %d\n", (unsigned long long)number, s.l->num[0], s.l->num[1], faces);
  laid_free(s.l);
  tm_free(a);
  tm_free(b);
  return plain;
}

static void seeds(int count, bool rough)
{
  int done = 0;

  for (uint64_t number = 1; done < (rt_long() ? 50 * count : count) && rt_failed_ < 40; number++)
    done += try_seed(number, rough);
}

static void straight_meshes_on_one_lattice_have_a_supermesh(void) { seeds(400, false); }
static void rough_meshes_of_few_bits_have_a_supermesh(void) { seeds(400, true); }

/* A mesh of which cells have been taken away by lot: many parts, each of which leaves holes in the large faces of the other. */
static void crumbs_in_large_cells_have_a_supermesh(void)
{
  for (uint64_t number = 1; number <= (rt_long() ? 200 : 12); number++) {
    uint64_t          seed = 77 * number;
    const bool        straight = number & 1;
    const int         before = rt_failed_, n = straight ? 4 : 3 + (int)tm_random(&seed, 4);
    const remap_faces faces    = number & 2 ? REMAP_FACES_CENTRE : REMAP_FACES_DIAGONAL;
    tm_mesh          *large = tm_hexahedra((int[]){1, number & 4 ? 2 : 1, 2}, NULL, NULL), *crumbs = NULL;

    if (straight) crumbs = tm_hexahedra((int[]){n, n, n}, tm_affine, (double[]){2, 0, 0, -.5, 0, 1.5, 0, -.25, 0, 0, 1.5, -.5});
    else crumbs = tm_benchmark(n, 0.3, 0.4, 1.3);
    for (int64_t v = 0; v < crumbs->view.num_nodes && !straight; v++)
      for (int c = 0; c < 3; c++) crumbs->xyz[3 * v + c] += .5;
    uint8_t *keep = tm_alloc_(crumbs->view.num_cells, 1);
    for (int64_t c = 0; c < crumbs->view.num_cells; c++) keep[c] = tm_random(&seed, 3) == 0;
    for (int way = 0; way < 2; way++) {
      const laid_how how = {.keep = {way ? keep : NULL, way ? NULL : keep}};
      super          s   = super_of(way ? crumbs : large, way ? large : crumbs, faces, &how, SUPER_UNION);

      super_check(&s, -1, straight);
      laid_free(s.l);
    }
    if (rt_failed_ > before) printf("# number %d\n", (int)number);
    free(keep);
    tm_free(large);
    tm_free(crumbs);
  }
}

RT_MAIN(RT_CASE(straight_meshes_on_one_lattice_have_a_supermesh), RT_CASE(rough_meshes_of_few_bits_have_a_supermesh),
        RT_CASE(crumbs_in_large_cells_have_a_supermesh))
