/* selftest -- does the compiled arithmetic keep what the exact predicates rest on: rounding to nearest, no excess precision,
 * no fused multiply-add, error-free transformations? Constant time. */
#include "geom/expansion.h"

/* Hide a value from the optimiser, which computes at compile time with an arithmetic of its own. */
static double opaque(double x)
{
  volatile double hidden = x;
  return hidden;
}

/* Ties go to even and everything else to the nearest, for either sign. */
static bool rounds_to_nearest(void)
{
  const double one = opaque(1), half_ulp = opaque(0x1p-53), more = opaque(0x1.8p-53);

  return one + half_ulp == 1 && one + more == 1 + 0x1p-52 && -one - half_ulp == -1 && -one - more == -1 - 0x1p-52 &&
         (one + 0x1p-52) + half_ulp == 1 + 0x1p-51;
}

/* A product is rounded before it is added to. */
static bool products_are_rounded(void)
{
  const double x = opaque(1 + 0x1p-30), y = opaque(1 - 0x1p-30), z = opaque(-1);

  return x * y + z == 0;
}

static bool transformations_are_exact(void)
{
  const double x = opaque(1 + 0x1p-30), y = opaque(1 - 0x1p-30), tiny = opaque(0x1p-100), third = opaque(0x1.5555555555555p-2);
  const rm_dd  product = rm_two_product(x, y), sum = rm_two_sum(tiny, x), diff = rm_two_diff(x, tiny);
  const rm_dd  square = rm_two_product(third, third);

  return product.hi == 1 && product.lo == -0x1p-60 && sum.hi == x && sum.lo == 0x1p-100 && diff.hi == x &&
         diff.lo == -0x1p-100 && square.hi == 0x1.c71c71c71c71cp-4 && square.lo == -0x1.c71c71c71c71cp-58;
}

bool rm_geom_selftest(void) { return rounds_to_nearest() && products_are_rounded() && transformations_are_exact(); }
