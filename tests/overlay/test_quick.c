/* Coincident faces are the normal case, so what they ask must be answered early: integers of any length and exact sums are
 * the last word, and on identical, nested, shifted and abutting meshes and between layers hardly ever needed. Counted per
 * cell. */
#include "laid.h"
#include "rt.h"
#include "moments/moments_private.h"

static int64_t num_long, num_sums;

/* The last stage of the predicates, and exact sums (the linker's --wrap). */
void __real_rm_int_from_difference(rm_int *r, double x, double y, int scale);
void __wrap_rm_int_from_difference(rm_int *r, double x, double y, int scale);
void __wrap_rm_int_from_difference(rm_int *r, double x, double y, int scale)
{
  num_long++;
  __real_rm_int_from_difference(r, x, y, scale);
}
bool __real_rm_moments_is_zero(work *w, const exact_sum *sum);
bool __wrap_rm_moments_is_zero(work *w, const exact_sum *sum);
bool __wrap_rm_moments_is_zero(work *w, const exact_sum *sum)
{
  num_sums += sum->num_sides + sum->num_strips > 0;
  return __real_rm_moments_is_zero(w, sum);
}

/* Both meshes are given up. Nine differences are one determinant. */
static void quick(tm_mesh *a, tm_mesh *b, double most_determinants, double most_sums)
{
  for (int faces = 0; faces < 2; faces++) {
    num_long = num_sums = 0;
    laid        *l      = laid_over(a, b, faces ? REMAP_FACES_DIAGONAL : REMAP_FACES_CENTRE, NULL);
    const double cells  = fmax(l->num[0], l->num[1]);

    if (RT_EQ(l->status, REMAP_OK)) {
      RT_CHECK((double)num_long / 9 / cells <= most_determinants);
      RT_CHECK((double)num_sums / cells <= most_sums);
    }
    laid_free(l);
  }
  tm_free(a);
  tm_free(b);
}

static tm_mesh *warped(int n) { return tm_hexahedra((int[]){n, n, n}, tm_warp, &(tm_warping){.03, .7}); }
static tm_mesh *lattice(int n, double by)
{
  return tm_hexahedra((int[]){n, n, n}, tm_affine, (double[]){1, 0, 0, by, 0, 1, 0, by, 0, 0, 1, by});
}
static void identical_meshes_are_quick(void)
{
  quick(warped(8), warped(8), 1, 2); /* most of them at the boundary */
  quick(lattice(8, 0), lattice(8, 0), 0, 0);
}
static void nested_meshes_are_quick(void)
{
  quick(lattice(6, 0), lattice(12, 0), 0, 0);
  quick(lattice(12, 0), lattice(4, 0), 0, 0);
}
static void shifted_meshes_are_quick(void) { quick(lattice(8, 0), lattice(8, .0625), 0, 0); }
static void abutting_meshes_are_quick(void)
{
  quick(lattice(8, 0), tm_hexahedra((int[]){8, 8, 8}, tm_affine, (double[]){1, 0, 0, 1, 0, 1, 0, 0, 0, 0, 1, 0}), 0, .5);
  quick(warped(8), tm_hexahedra((int[]){8, 8, 8}, tm_affine, (double[]){1, 0, 0, 1, 0, 1, 0, 0, 0, 0, 1, 0}), 1, .5);
}
/* Layers of the same height, turned about the vertical: edges of the two meshes cross in all planes between layers. */
static void turned_layers_are_quick(void)
{
  const double turned[12] = {.8, -.6, 0, -.4, .6, .8, 0, -.7, 0, 0, 1, 0};

  quick(tm_hexahedra((int[]){8, 8, 8}, NULL, NULL), tm_hexahedra((int[]){9, 9, 8}, tm_affine, turned), 0, .5);
  quick(tm_hexahedra((int[]){8, 8, 8}, NULL, NULL), tm_hexahedra((int[]){9, 9, 4}, tm_affine, turned), 0, .5);
}

RT_MAIN(RT_CASE(identical_meshes_are_quick), RT_CASE(nested_meshes_are_quick), RT_CASE(shifted_meshes_are_quick),
        RT_CASE(abutting_meshes_are_quick), RT_CASE(turned_layers_are_quick))
