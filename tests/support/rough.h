/* rough -- random meshes whose coordinates have so few bits that vertices, edges and faces of two of them coincide, cross
 * and touch in every way. *seed goes on, so that the next mesh is another one. */
#ifndef ROUGH_H
#define ROUGH_H

#include "base/base.h"
#include "meshes.h"

/* A mesh of a random kind, place and roughness. */
typedef struct rough_recipe {
  uint64_t seed;
  int      steps; /* coordinates are multiples of 1 / steps   */
  int      rough; /* nodes move by up to so many of them      */
  double   scale[3], shift[3];
} rough_recipe;

static inline void rough_node_(double xyz[3], const void *data)
{
  const rough_recipe *r = data;
  uint64_t      h = r->seed ^ rm_hash_point(xyz);

  for (int c = 0; c < 3; c++) {
    const double move = r->rough ? (double)(tm_random(&h, 2 * r->rough + 1) - r->rough) : 0;
    xyz[c]            = (rint((xyz[c] * r->scale[c] + r->shift[c]) * r->steps) + move) / r->steps;
  }
}

static inline tm_mesh *rough_mesh(uint64_t *seed, bool rough)
{
  const int kind = (int)tm_random(seed, 7), most = kind < 2 ? 3 : 2;
  const int n[3] = {1 + (int)tm_random(seed, most), 1 + (int)tm_random(seed, most), 1 + (int)tm_random(seed, most)};
  rough_recipe r = {*seed, 16 << tm_random(seed, 3), 0, {0, 0, 0}, {0, 0, 0}};

  for (int c = 0; c < 3; c++) {
    r.scale[c] = .5 + .25 * (double)tm_random(seed, 3);
    r.shift[c] = .125 * (double)tm_random(seed, 5) - .25;
  }
  r.rough = rough ? (int)tm_random(seed, 2) * (r.steps / 16) : 0;
  switch (kind) {
    case 2: return tm_tetrahedra(n, rough_node_, &r);
    case 3: return tm_prisms(n, rough_node_, &r);
    case 4: return tm_pyramids(n, rough_node_, &r);
    case 5: return tm_refined((int[]){2, 1, 1}, tm_right_half, rough_node_, &r);
    case 6: return tm_dual((int[]){1, 1, 1}, rough_node_, &r);
    default: return tm_hexahedra(n, rough_node_, &r);
  }
}

#endif
