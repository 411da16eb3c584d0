/* boxtree -- a binary tree of boxes over items, split at the median of the centres along the axis on which they spread most.
 * Nodes lie in preorder: the first child follows its parent, so a query walks mostly forward. Building takes O(n log n) time
 * and 32 bytes per item besides the result; with leaves of n / 64 items the same split makes the coarse groups in O(n). */
#include "zone/zone.h"

#include <math.h>

enum { LEAF_ITEMS = 8, MAX_DEPTH = 64 };

/* An item on its way into the tree, with what the splits compare: twice the centre of its box. */
typedef struct place {
  double centre[3];
  rm_lid item;
} place;

typedef struct builder {
  const double (*item_box)[6]; /* [n]                        */
  place   *place;              /* [n] permuted by the splits */
  rm_lid   leaf_items;         /* most items of a leaf       */
  rm_lid   num_nodes;
  double (*box)[6];            /* as in rm_boxtree           */
  rm_lid  *first, *count;
} builder;

static void box_join(double box[6], const double other[6])
{
  for (int d = 0; d < 3; d++) {
    if (other[d] < box[d]) box[d] = other[d];
    if (other[3 + d] > box[3 + d]) box[3 + d] = other[3 + d];
  }
}

static void box_copy(double box[6], const double other[6])
{
  for (int d = 0; d < 6; d++) box[d] = other[d];
}

static double median_of_three(double a, double b, double c)
{
  const double low = a < b ? a : b, high = a < b ? b : a;

  return c < low ? low : c > high ? high : c;
}

/* Permute place[begin, end) so that no centre before mid lies above, and none from mid on below, that of place[mid]. Expected
 * O(n), many equal centres included: a scan stops at them from either side. */
static void select_median(place *p, rm_lid begin, rm_lid mid, rm_lid end, int axis)
{
  while (end - begin > 1) {
    const double middle = p[begin + (end - begin) / 2].centre[axis];
    const double pivot  = median_of_three(p[begin].centre[axis], middle, p[end - 1].centre[axis]);
    rm_lid       i = begin, j = end - 1;

    while (i <= j) {
      while (p[i].centre[axis] < pivot) i++;
      while (p[j].centre[axis] > pivot) j--;
      if (i <= j) {
        const place swap = p[i];

        p[i++] = p[j];
        p[j--] = swap;
      }
    }
    if (mid <= j) end = j + 1;
    else if (mid >= i) begin = i;
    else return; /* between the two parts all centres equal the pivot */
  }
}

static int widest_axis(const place *p, rm_lid begin, rm_lid end)
{
  double low[3], high[3];
  int    axis = 0;

  for (int d = 0; d < 3; d++) low[d] = high[d] = p[begin].centre[d];
  for (rm_lid i = begin + 1; i < end; i++)
    for (int d = 0; d < 3; d++) {
      if (p[i].centre[d] < low[d]) low[d] = p[i].centre[d];
      if (p[i].centre[d] > high[d]) high[d] = p[i].centre[d];
    }
  for (int d = 1; d < 3; d++)
    if (high[d] - low[d] > high[axis] - low[axis]) axis = d;
  return axis;
}

static rm_lid add_leaf(builder *b, rm_lid begin, rm_lid end)
{
  const rm_lid node = b->num_nodes++;

  RM_ASSERT(begin < end);
  b->first[node] = begin;
  b->count[node] = end - begin;
  box_copy(b->box[node], b->item_box[b->place[begin].item]);
  for (rm_lid i = begin + 1; i < end; i++) box_join(b->box[node], b->item_box[b->place[i].item]);
  return node;
}

/* Add the tree over place[begin, end) and return its root. Halving bounds the depth by 32. */
static rm_lid add_tree(builder *b, rm_lid begin, rm_lid end)
{
  const rm_lid mid = begin + (end - begin) / 2;
  rm_lid       node, first, second;

  if (end - begin <= b->leaf_items) return add_leaf(b, begin, end);
  node = b->num_nodes++;
  select_median(b->place, begin, mid, end, widest_axis(b->place, begin, end));
  first  = add_tree(b, begin, mid);
  second = add_tree(b, mid, end);
  RM_ASSERT(first == node + 1);
  b->first[node] = second;
  b->count[node] = 0;
  box_copy(b->box[node], b->box[first]);
  box_join(b->box[node], b->box[second]);
  return node;
}

/* A split leaves at least (leaf_items + 1) / 2 items on either side, which bounds the number of leaves. */
static int64_t most_nodes(rm_lid n, rm_lid leaf_items)
{
  const int64_t leaves = n / (leaf_items - leaf_items / 2);

  return n == 0 ? 0 : leaves < 2 ? 1 : 2 * leaves - 1;
}

/* The tree lives in arena, but for the places, which are in scratch. */
static remap_status build(rm_arena *arena, rm_arena *scratch, rm_lid n, const double (*box)[6], rm_lid leaf_items, builder *b)
{
  const int64_t max_nodes = most_nodes(n, leaf_items);

  *b = (builder){.item_box = box, .leaf_items = leaf_items};
  RM_NEW(b->box, arena, max_nodes);
  RM_NEW(b->first, arena, max_nodes);
  RM_NEW(b->count, arena, max_nodes);
  RM_NEW(b->place, scratch, n);
  for (rm_lid i = 0; i < n; i++) {
    for (int d = 0; d < 3; d++) b->place[i].centre[d] = box[i][d] + box[i][3 + d];
    b->place[i].item = i;
  }
  if (n > 0) (void)add_tree(b, 0, n);
  RM_ASSERT(b->num_nodes <= max_nodes);
  return REMAP_OK;
}

static remap_status build_tree(rm_arena *arena, rm_arena *scratch, rm_lid n, const double (*box)[6], const rm_boxtree **out)
{
  builder     b;
  rm_boxtree *tree;
  rm_lid     *item;

  RM_TRY(build(arena, scratch, n, box, LEAF_ITEMS, &b));
  RM_NEW(tree, arena, 1);
  RM_NEW(item, arena, n);
  for (rm_lid i = 0; i < n; i++) item[i] = b.place[i].item;
  *tree = (rm_boxtree){.num_items = n,
                       .num_nodes = b.num_nodes,
                       .box       = (const double(*)[6])b.box,
                       .first     = b.first,
                       .count     = b.count,
                       .item      = item};
  *out  = tree;
  return REMAP_OK;
}

remap_status rm_boxtree_build(rm_arena *arena, rm_lid n, const double (*box)[6], const rm_boxtree **out)
{
  rm_arena    *scratch = rm_arena_new();
  remap_status status  = scratch ? build_tree(arena, scratch, n, box, out) : REMAP_NO_MEMORY;

  rm_arena_drop(scratch);
  return status;
}

/* Leaves of at most n / m items, rounded up, are reached by log2 m halvings at the latest, m the power of two up to `most`. */
remap_status rm_box_groups(rm_arena *scratch, rm_lid n, const double (*box)[6], int most, double (*group)[6], rm_lid *group_of,
                           int *num_groups)
{
  rm_lid leaf_items = n;
  builder      b;
  int          num = 0;

  for (int leaves = 2; leaves <= most; leaves *= 2) leaf_items = n / leaves + (n % leaves > 0);
  RM_TRY(build(scratch, scratch, n, box, leaf_items > 0 ? leaf_items : 1, &b));
  for (rm_lid node = 0; node < b.num_nodes; node++)
    if (b.count[node] > 0) {
      RM_ASSERT(num < most);
      for (rm_lid k = b.first[node]; group_of && k < b.first[node] + b.count[node]; k++) group_of[b.place[k].item] = num;
      box_copy(group[num++], b.box[node]);
    }
  *num_groups = num;
  return REMAP_OK;
}

/* What a query looks for: a box or a straight segment. */
typedef struct shape {
  double box[6];                   /* of the segment too              */
  double middle[3], half[3], slack; /* of the segment                  */
} shape;

/* True unless one of the axes that are normal to the segment and to an edge of the box parts them; slack covers rounding. */
static inline bool segment_meets(const shape *s, const double box[6])
{
  double t[3], e[3];

  if (!rm_box_meets(s->box, box)) return false;
  for (int d = 0; d < 3; d++) {
    e[d] = 0.5 * (box[d + 3] - box[d]);
    t[d] = box[d] + e[d] - s->middle[d];
  }
  for (int d = 0; d < 3; d++) {
    const int    i = (d + 1) % 3, j = (d + 2) % 3;
    const double hi = fabs(s->half[i]), hj = fabs(s->half[j]);

    if (fabs(t[i] * s->half[j] - t[j] * s->half[i]) >
        e[i] * hj + e[j] * hi + s->slack * (fabs(t[i]) + fabs(t[j]) + e[i] + e[j] + hi + hj))
      return false;
  }
  return true;
}

static inline bool box_meets(const shape *s, const double box[6]) { return rm_box_meets(s->box, box); }

static inline int query(const rm_boxtree *tree, const double (*item_box)[6], const shape *s,
                        bool (*meets)(const shape *s, const double box[6]), int (*visit)(void *user, rm_lid item), void *user)
{
  rm_lid stack[MAX_DEPTH];
  int    depth = 0;

  if (tree->num_nodes > 0) stack[depth++] = 0;
  while (depth > 0) {
    const rm_lid node = stack[--depth], first = tree->first[node], end = first + tree->count[node];

    if (!meets(s, tree->box[node])) continue;
    if (tree->count[node] == 0) {
      RM_ASSERT(depth + 2 <= MAX_DEPTH);
      stack[depth++] = first;
      stack[depth++] = node + 1;
      continue;
    }
    for (rm_lid i = first; i < end; i++) {
      const rm_lid item   = tree->item[i];
      const int    result = meets(s, item_box[item]) ? visit(user, item) : 0;

      if (result != 0) return result;
    }
  }
  return 0;
}

int rm_boxtree_query(const rm_boxtree *tree, const double (*item_box)[6], const double box[6],
                     int (*visit)(void *user, rm_lid item), void *user)
{
  shape s;

  box_copy(s.box, box);
  return query(tree, item_box, &s, box_meets, visit, user);
}

int rm_boxtree_query_segment(const rm_boxtree *tree, const double (*item_box)[6], const double p[3], const double q[3],
                             int (*visit)(void *user, rm_lid item), void *user)
{
  shape s = {.slack = 0};

  for (int d = 0; d < 3; d++) {
    s.box[d]     = p[d] < q[d] ? p[d] : q[d];
    s.box[d + 3] = p[d] < q[d] ? q[d] : p[d];
    s.half[d]    = 0.5 * (s.box[d + 3] - s.box[d]);
    s.middle[d]  = s.box[d] + s.half[d];
    s.slack      = rm_max(s.slack, rm_max(s.half[d], 4 * rm_max(fabs(p[d]), fabs(q[d]))));
    if (p[d] > q[d]) s.half[d] = -s.half[d];
  }
  s.slack *= 0x1p-48; /* coordinates of magnitude c make t and e err by a few ulps of c */
  return query(tree, item_box, &s, segment_meets, visit, user);
}

static int stop(void *user, rm_lid item)
{
  (void)user, (void)item;
  return 1;
}

bool rm_boxtree_meets(const rm_boxtree *tree, const double (*item_box)[6], const double box[6])
{
  return rm_boxtree_query(tree, item_box, box, stop, NULL) != 0;
}
