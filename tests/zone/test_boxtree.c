/* The box tree and the coarse groups against brute force, over seeds, sizes and kinds of boxes. */
#include "zone/zone.h"
#include "rt.h"

#include <stdlib.h>

enum { NUM_KINDS = 5 };

/* Pseudo-random number in [0, 1). */
static double draw(uint64_t *state)
{
  *state += UINT64_C(0x9e3779b97f4a7c15);
  return (double)(rm_hash_word(*state) >> 11) * 0x1p-53;
}

/* n boxes: of like size, of all sizes, on integers so that many touch, flat ones in one plane, all of them equal. */
static double (*make_boxes(int kind, rm_lid n, uint64_t seed))[6]
{
  double (*box)[6] = malloc(((size_t)n + 1) * sizeof *box);
  uint64_t state = seed;

  for (rm_lid i = 0; i < n; i++)
    for (int d = 0; d < 3; d++) {
      const double low = draw(&state), size = draw(&state);

      switch (kind) {
        case 0: box[i][d] = low, box[i][3 + d] = low + 0.1 * size; break;
        case 1: box[i][d] = low, box[i][3 + d] = low + pow(size, 8.0); break;
        case 2: box[i][d] = floor(8.0 * low), box[i][3 + d] = box[i][d] + floor(3.0 * size); break;
        case 3: box[i][d] = d == 2 ? 0.5 : low, box[i][3 + d] = d == 2 ? 0.5 : low + 0.1 * size; break;
        default: box[i][d] = 0.25, box[i][3 + d] = 0.75; break;
      }
    }
  return box;
}

static bool holds(const double outer[6], const double inner[6])
{
  for (int d = 0; d < 3; d++)
    if (inner[d] < outer[d] || inner[3 + d] > outer[3 + d]) return false;
  return true;
}

/* Call one with every kind of boxes, many sizes and seeds. */
static void for_all_boxes(void (*one)(rm_arena *arena, rm_lid n, double (*box)[6], uint64_t seed))
{
  static const rm_lid sizes[] = {0, 1, 2, 7, 8, 9, 16, 17, 63, 64, 65, 129, 500, 3000};

  for (int kind = 0; kind < NUM_KINDS; kind++)
    for (size_t s = 0; s < sizeof sizes / sizeof *sizes; s++)
      for (uint64_t seed = 1; seed <= 5; seed++) {
        rm_arena *arena  = rm_arena_new();
        double (*box)[6] = make_boxes(kind, sizes[s], seed);

        one(arena, sizes[s], box, seed);
        free(box);
        rm_arena_drop(arena);
      }
}

/* The node after the subtree at `node`; counts its items and checks its boxes. */
static rm_lid walk(const rm_boxtree *tree, rm_lid node, double (*box)[6], int *seen)
{
  if (tree->count[node] > 0) {
    RT_CHECK(tree->count[node] <= 8);
    for (rm_lid i = tree->first[node]; i < tree->first[node] + tree->count[node]; i++) {
      RT_CHECK(holds(tree->box[node], box[tree->item[i]]));
      seen[tree->item[i]]++;
    }
    return node + 1;
  }
  RT_CHECK(holds(tree->box[node], tree->box[node + 1]) && holds(tree->box[node], tree->box[tree->first[node]]));
  RT_EQ(walk(tree, node + 1, box, seen), tree->first[node]);
  return walk(tree, tree->first[node], box, seen);
}

static void check_structure(rm_arena *arena, rm_lid n, double (*box)[6], uint64_t seed)
{
  const rm_boxtree *tree;
  int              *seen = calloc((size_t)n + 1, sizeof *seen);

  (void)seed;
  RT_EQ(rm_boxtree_build(arena, n, (const double(*)[6])box, &tree), REMAP_OK);
  RT_EQ(tree->num_items, n);
  RT_CHECK((tree->num_nodes == 0) == (n == 0));
  if (n > 0) RT_EQ(walk(tree, 0, box, seen), tree->num_nodes);
  for (rm_lid i = 0; i < n; i++) RT_EQ(seen[i], 1);
  free(seen);
}

static void every_item_is_in_one_leaf_and_every_box_holds_its_parts(void)
{
  for_all_boxes(check_structure);
}

static int count_item(void *user, rm_lid item)
{
  ((int *)user)[item]++;
  return 0;
}

static void check_queries(rm_arena *arena, rm_lid n, double (*box)[6], uint64_t seed)
{
  const rm_boxtree *tree;
  int              *found = malloc(((size_t)n + 1) * sizeof *found);

  RT_EQ(rm_boxtree_build(arena, n, (const double(*)[6])box, &tree), REMAP_OK);
  for (int kind = 0; kind < NUM_KINDS; kind++) {
    double (*query)[6] = make_boxes(kind, 8, seed + 100);

    for (int q = 0; q < 8; q++) {
      bool meets = false;

      for (rm_lid i = 0; i < n; i++) found[i] = 0;
      RT_EQ(rm_boxtree_query(tree, (const double(*)[6])box, query[q], count_item, found), 0);
      for (rm_lid i = 0; i < n; i++) {
        RT_EQ(found[i], rm_box_meets(box[i], query[q]) ? 1 : 0);
        meets = meets || found[i];
      }
      RT_CHECK(rm_boxtree_meets(tree, (const double(*)[6])box, query[q]) == meets);
    }
    free(query);
  }
  free(found);
}

static void a_query_visits_what_brute_force_finds_once_each(void)
{
  for_all_boxes(check_queries);
}

static int stop_at_seventh(void *user, rm_lid item)
{
  (void)item;
  return ++*(int *)user == 7 ? 42 : 0;
}

static void a_query_stops_when_the_visitor_says_so_and_hands_its_answer_back(void)
{
  rm_arena *arena  = rm_arena_new();
  double (*box)[6] = make_boxes(NUM_KINDS - 1, 100, 1);
  int visits       = 0;
  const rm_boxtree *tree;

  RT_EQ(rm_boxtree_build(arena, 100, (const double(*)[6])box, &tree), REMAP_OK);
  RT_EQ(rm_boxtree_query(tree, (const double(*)[6])box, box[0], stop_at_seventh, &visits), 42);
  RT_EQ(visits, 7);
  free(box);
  rm_arena_drop(arena);
}

static void boxes_that_touch_in_a_corner_meet_and_those_an_ulp_apart_do_not(void)
{
  const double unit[6] = {0, 0, 0, 1, 1, 1}, corner[6] = {1, 1, 1, 2, 2, 2};
  const double apart[6] = {nextafter(1.0, 2.0), 1, 1, 2, 2, 2}, inside[6] = {0.5, 0.5, 0.5, 0.5, 0.5, 0.5};

  RT_CHECK(rm_box_meets(unit, corner) && rm_box_meets(corner, unit));
  RT_CHECK(!rm_box_meets(unit, apart) && !rm_box_meets(apart, unit));
  RT_CHECK(rm_box_meets(unit, inside) && rm_box_meets(inside, unit));
}

static void check_groups(rm_arena *arena, rm_lid n, double (*box)[6], uint64_t seed)
{
  double  group[RM_CROWDS][6];
  rm_lid *group_of = rm_arena_alloc(arena, n, sizeof *group_of);
  int     num = -1, most = seed % 3 ? RM_CROWDS : 1 + (int)(seed % RM_CROWDS);

  RT_EQ(rm_box_groups(arena, n, (const double(*)[6])box, most, group, group_of, &num), REMAP_OK);
  RT_CHECK(num <= most && (num > 0) == (n > 0) && num <= n);
  for (rm_lid i = 0; i < n; i++) RT_CHECK(group_of[i] >= 0 && group_of[i] < num && holds(group[group_of[i]], box[i]));
}

static void every_item_is_held_by_its_group_of_at_most_64(void)
{
  for_all_boxes(check_groups);
}

static void a_failed_allocation_is_reported_wherever_it_happens(void)
{
  double (*box)[6]    = make_boxes(0, 200, 1);
  remap_status status = REMAP_NO_MEMORY;
  int          failed = 0;

  for (int64_t at = 1; status != REMAP_OK && at < 100; at++) {
    rm_arena         *arena = rm_arena_new();
    const rm_boxtree *tree  = NULL;

    rm_arena_fail_at(arena, at);
    status = rm_boxtree_build(arena, 200, (const double(*)[6])box, &tree);
    RT_EQ(status, tree ? REMAP_OK : REMAP_NO_MEMORY);
    failed += !tree;
    rm_arena_drop(arena);
  }
  RT_EQ(status, REMAP_OK);
  RT_CHECK(failed > 0);
  free(box);
}

RT_MAIN(RT_CASE(every_item_is_in_one_leaf_and_every_box_holds_its_parts),
        RT_CASE(a_query_visits_what_brute_force_finds_once_each),
        RT_CASE(a_query_stops_when_the_visitor_says_so_and_hands_its_answer_back),
        RT_CASE(boxes_that_touch_in_a_corner_meet_and_those_an_ulp_apart_do_not),
        RT_CASE(every_item_is_held_by_its_group_of_at_most_64), RT_CASE(a_failed_allocation_is_reported_wherever_it_happens))
