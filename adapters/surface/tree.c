/* tree -- boxes in a balanced binary tree: which of them meet a box? O(n log n) to build, O(log n + found) to ask, where boxes
 * hardly overlap. */
#include "surface_private.h"

#include <stdlib.h>
#include <string.h>

static void widen(double box[6], const double by[6])
{
  for (int k = 0; k < 3; k++) {
    if (by[k] < box[k]) box[k] = by[k];
    if (by[k + 3] > box[k + 3]) box[k + 3] = by[k + 3];
  }
}

static double centre(const rs_tree *tree, int64_t at, int axis)
{
  const double *box = tree->box[tree->item[at]];

  return box[axis] + box[axis + 3];
}

static void swap(rs_tree *tree, int64_t i, int64_t k)
{
  const int64_t keep = tree->item[i];

  tree->item[i] = tree->item[k];
  tree->item[k] = keep;
}

/* Bring the items of [lo, hi) whose centres come first along the axis before mid (Hoare's selection). */
static void divide(rs_tree *tree, int64_t lo, int64_t hi, int64_t mid, int axis)
{
  while (hi - lo > 1) {
    const double pivot = centre(tree, lo + (hi - lo) / 2, axis);
    int64_t      i = lo, k = hi - 1;

    while (i <= k) {
      while (centre(tree, i, axis) < pivot) i++;
      while (centre(tree, k, axis) > pivot) k--;
      if (i <= k) swap(tree, i++, k--);
    }
    if (mid <= k)
      hi = k + 1;
    else if (mid >= i)
      lo = i;
    else
      return;
  }
}

static void build(rs_tree *tree, int64_t lo, int64_t hi)
{
  const int64_t mid  = lo + (hi - lo) / 2;
  double       *box  = tree->part[mid];
  int           axis = 0;

  if (hi - lo < 2) return;
  memcpy(box, tree->box[tree->item[lo]], 6 * sizeof *box);
  for (int64_t i = lo + 1; i < hi; i++) widen(box, tree->box[tree->item[i]]);
  for (int k = 1; k < 3; k++)
    if (box[k + 3] - box[k] > box[axis + 3] - box[axis]) axis = k;
  divide(tree, lo, hi, mid, axis);
  build(tree, lo, mid);
  build(tree, mid, hi);
}

bool rs_tree_build(int64_t num, const double (*box)[6], rs_tree *out)
{
  *out = (rs_tree){.num = num, .box = box, .item = ra_zeros(num, sizeof *out->item), .part = ra_zeros(num, sizeof *out->part)};
  if (!out->item || !out->part) return false;
  for (int64_t i = 0; i < num; i++) out->item[i] = i;
  build(out, 0, num);
  return true;
}

static bool meets(const double *a, const double *b)
{
  return a[0] <= b[3] && b[0] <= a[3] && a[1] <= b[4] && b[1] <= a[4] && a[2] <= b[5] && b[2] <= a[5];
}

static bool find(const rs_tree *tree, int64_t lo, int64_t hi, const double box[6], ra_array *hits)
{
  const int64_t mid = lo + (hi - lo) / 2;

  if (hi - lo < 2)
    return lo == hi || !meets(tree->box[tree->item[lo]], box) || ra_push(hits, &tree->item[lo], sizeof *tree->item);
  return !meets(tree->part[mid], box) || (find(tree, lo, mid, box, hits) && find(tree, mid, hi, box, hits));
}

/* The box around a part of the list. */
static const double *around(const rs_tree *tree, int64_t lo, int64_t hi)
{
  return hi - lo < 2 ? tree->box[tree->item[lo]] : tree->part[lo + (hi - lo) / 2];
}

/* Pairs of an item of one part and one of another; false: visit has had enough. */
static bool pairs_between(const rs_tree *tree, const int64_t a[2], const int64_t b[2], rs_visit visit, void *user)
{
  const bool     split_a = a[1] - a[0] > b[1] - b[0];
  const int64_t *larger = split_a ? a : b, *other = split_a ? b : a, mid = larger[0] + (larger[1] - larger[0]) / 2;

  if (!meets(around(tree, a[0], a[1]), around(tree, b[0], b[1]))) return true;
  if (larger[1] - larger[0] < 2) return visit(user, tree->item[a[0]], tree->item[b[0]]);
  return pairs_between(tree, (int64_t[2]){larger[0], mid}, other, visit, user) &&
         pairs_between(tree, (int64_t[2]){mid, larger[1]}, other, visit, user);
}

static bool pairs_within(const rs_tree *tree, int64_t lo, int64_t hi, rs_visit visit, void *user)
{
  const int64_t mid = lo + (hi - lo) / 2;

  return hi - lo < 2 || (pairs_within(tree, lo, mid, visit, user) && pairs_within(tree, mid, hi, visit, user) &&
                         pairs_between(tree, (int64_t[2]){lo, mid}, (int64_t[2]){mid, hi}, visit, user));
}

void rs_tree_pairs(const rs_tree *tree, rs_visit visit, void *user) { (void)pairs_within(tree, 0, tree->num, visit, user); }

bool rs_tree_find(const rs_tree *tree, const double box[6], ra_array *hits)
{
  hits->count = 0;
  return find(tree, 0, tree->num, box, hits);
}

void rs_tree_drop(rs_tree *tree)
{
  free(tree->item);
  free(tree->part);
}
