/* hash -- 64-bit hashes of words and points: two rounds of xor-shift and multiply, in which every input bit reaches every
 * output bit. A bijection on words, so distinct words never collide. */
#include "base.h"

#include <string.h>

uint64_t rm_hash_word(uint64_t x)
{
  x += UINT64_C(0x9e3779b97f4a7c15); /* so that 0 does not stay 0 */
  x = (x ^ x >> 30) * UINT64_C(0xbf58476d1ce4e5b9);
  x = (x ^ x >> 27) * UINT64_C(0x94d049bb133111eb);
  return x ^ x >> 31;
}

uint64_t rm_hash_point(const double xyz[3])
{
  uint64_t hash = 0;

  for (int k = 0; k < 3; k++) {
    const double x = xyz[k] + 0.0; /* -0 becomes +0 */
    uint64_t     bits;

    memcpy(&bits, &x, sizeof bits);
    hash = rm_hash_word(hash ^ bits);
  }
  return hash;
}
