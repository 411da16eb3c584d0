/* bench_accuracy -- how well pairs add up to their cells where that is hard: the worst closure, abs(sum of V - V_cell) /
 * V_cell, over the covered cells of either mesh, as a table. The bar is 1e-12.
 *
 *   bench_accuracy */
#include "laid.h"

typedef struct placing {
  double scale[3], angle, shift[3];
} placing;

/* Scale along the axes, turn about z and x, move. */
static void place(double x[3], const void *data)
{
  const placing *p = data;

  for (int k = 0; k < 3; k++) x[k] *= p->scale[k];
  tm_rotate_(x, p->angle);
  for (int k = 0; k < 3; k++) x[k] += p->shift[k];
}

static int worse_than_bar;

/* Closure over the cells that have pairs and through which no skin passes. */
static double closure_of_covered(const laid *l, int side)
{
  uint8_t *asked = tm_alloc_(l->num[side], 1);
  double   worst;

  for (rm_lid c = 0; c < l->num[side]; c++) asked[c] = laid_cover(l, side, c) == REMAP_COVERED;
  worst = laid_closure(l, side, asked);
  free(asked);
  return worst;
}

static void measure(const char *what, double value, tm_mesh *source, tm_mesh *target, remap_faces faces)
{
  laid  *l = laid_over(source, target, faces, NULL);
  double worst[2];

  for (int side = 0; side < 2; side++) {
    worst[side] = l->status == REMAP_OK ? closure_of_covered(l, side) : NAN;
    worse_than_bar += !(worst[side] <= 1e-12);
  }
  printf("| %-44s | %8.0e | %-8s | %9lld | %8.1e | %8.1e |\n", what, value, faces == REMAP_FACES_CENTRE ? "centre" : "diagonal",
         (long long)l->moments->num_pairs, worst[0], worst[1]);
  laid_free(l);
  tm_free(source), tm_free(target);
}

int main(void)
{
  static const tm_warping one = {0.03, 0.7}, other = {0.03, 0.1};

  printf("| case | by | faces | pairs | source | target |\n|---|---|---|---|---|---|\n");
  for (int faces = 0; faces < 2; faces++) {
    /* Turned layers of pancakes, each mesh in the other's planes only by chance. */
    for (double aspect = 1; aspect < 2e5; aspect *= 10) {
      const placing p      = {{1, 1, 1 / aspect}, 0.3, {0, 0, 0}};
      tm_mesh      *mesh[2] = {tm_hexahedra((int[]){7, 7, 7}, tm_warp, &one), tm_hexahedra((int[]){8, 8, 8}, tm_warp, &other)};
      for (int side = 0; side < 2; side++) tm_move(mesh[side], place, &p);
      measure("hexahedra of aspect ratio, turned", aspect, mesh[0], mesh[1], faces);
    }
    for (double ratio = 1; ratio < 2e3; ratio *= 10) { /* a block of small cells about a vertex of large ones */
      const double  size = 1 / ratio;
      const placing p = {{size, size, size}, 0.3, {0.5 - 0.5 * size, 0.5 - 0.5 * size, 0.5 - 0.5 * size}};
      tm_mesh      *mesh[2] = {tm_hexahedra((int[]){2, 2, 2}, tm_warp, &one), tm_hexahedra((int[]){6, 6, 6}, tm_warp, &other)};
      tm_move(mesh[1], place, &p);
      measure("cells of size ratio", 3 * ratio, mesh[0], mesh[1], faces);
    }
    for (double shift = 1; shift < 2e9; shift *= 1e3) { /* coordinates round, the meshes as rounded are compared */
      const placing p = {{1, 1, 1}, 0.3, {shift, -0.7 * shift, 0.4 * shift}};
      tm_mesh      *mesh[2] = {tm_hexahedra((int[]){6, 6, 6}, tm_warp, &one), tm_tetrahedra((int[]){5, 5, 5}, tm_warp, &other)};
      for (int side = 0; side < 2; side++) tm_move(mesh[side], place, &p);
      measure("hexahedra and tetrahedra, moved", shift, mesh[0], mesh[1], faces);
    }
  }
  printf("%d of the figures are worse than 1e-12\n", worse_than_bar);
  return worse_than_bar != 0;
}
