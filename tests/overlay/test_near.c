/* Meshes that are the same up to the last bits of their coordinates: slivers of every shape, each with its true volume. */
#include "oracle.h"

/* Full mantissas, and every coordinate off by up to `ulps` in its last place. */
typedef struct noise {
  uint64_t seed;
  int      ulps;
  double   size; /* of a random move, before */
} noise;

static void disturb(double xyz[3], const void *data)
{
  const noise *d = data;
  uint64_t     h = rm_hash_point(xyz), g = h ^ (d->seed * UINT64_C(0x9e3779b97f4a7c15));

  for (int c = 0; c < 3; c++) {
    xyz[c] += .1 + d->size * (double)(tm_random(&h, 2000001) - 1000000) * 1e-6;
    for (int64_t k = d->ulps ? tm_random(&g, 2 * d->ulps + 1) - d->ulps : 0; k; k += k > 0 ? -1 : 1)
      xyz[c] = nextafter(xyz[c], k > 0 ? 4 : -4);
  }
}

static tm_mesh *make(int kind, const noise *d)
{
  switch (kind) {
    case 0: return tm_hexahedra((int[]){2, 2, 1}, disturb, d);
    case 1: return tm_tetrahedra((int[]){1, 1, 1}, disturb, d);
    default: return tm_prisms((int[]){2, 1, 1}, disturb, d);
  }
}

static void agrees(double size, int ulps, int rounds)
{
  for (int round = 0; round < (rt_long() ? 20 * rounds : rounds); round++)
    for (int kind = 0; kind < 3; kind++) {
      tm_mesh  *a = make(kind, &(noise){0, 0, size}), *b = make(kind, &(noise){1 + (uint64_t)round, ulps, size});
      laid     *l      = laid_over(a, b, round & 1 ? REMAP_FACES_DIAGONAL : REMAP_FACES_CENTRE, NULL);
      const int before = rt_failed_;

      if (RT_EQ(l->status, REMAP_OK)) oracle_check(l, ORACLE_EXACT);
      if (rt_failed_ > before) printf("# kind %d, round %d, size %g\n", kind, round, size);
      laid_free(l);
      tm_free(a);
      tm_free(b);
    }
}

static void straight_meshes_off_by_one_ulp_agree(void) { agrees(0, 1, 2); }
static void warped_meshes_off_by_one_ulp_agree(void) { agrees(.05, 1, 2); }
static void warped_meshes_off_by_a_thousand_ulps_agree(void) { agrees(.05, 1000, 2); }
static void identical_meshes_with_all_their_digits_agree(void) { agrees(.05, 0, 2); }

RT_MAIN(RT_CASE(straight_meshes_off_by_one_ulp_agree), RT_CASE(warped_meshes_off_by_one_ulp_agree),
        RT_CASE(warped_meshes_off_by_a_thousand_ulps_agree), RT_CASE(identical_meshes_with_all_their_digits_agree))
