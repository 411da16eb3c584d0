/* What cells of very many triangles cost, and very many triangles or cells round one vertex or edge: counted in predicates
 * and in items that box trees hand out, per edge and crossing. Whoever looks at every face for every crossing, or compares
 * all polygons of a pair with each other, is found out by numbers that grow with the mesh. */
#include "laid.h"
#include "rt.h"
#include "surfaces.h"

static int64_t work;

/* The room's functions, counted (the linker's --wrap). */
#define COUNTED(type, name, parameters, arguments) \
  type __real_##name parameters;                   \
  type __wrap_##name parameters;                   \
  type __wrap_##name parameters                    \
  {                                                \
    work++;                                        \
    return __real_##name arguments;                \
  }
COUNTED(int, rm_orient3d, (const double a[3], const double b[3], const double c[3], const double d[3]), (a, b, c, d))
COUNTED(int, rm_point_side, (const double a[3], const double b[3], const double c[3], const double p[3], int moved, bool *zero),
        (a, b, c, p, moved, zero))
COUNTED(int, rm_edge_side, (const double a[3], const double b[3], const double c[3], const double d[3], int moved, bool *zero),
        (a, b, c, d, moved, zero))
COUNTED(int, rm_cross_sign, (const double a[3], const double b[3], const double c[3], const double d[3], int axis),
        (a, b, c, d, axis))
COUNTED(int, rm_crossing_order, (const double a[3], const double b[3], const double s[3][3], const double t[3][3], int moved),
        (a, b, s, t, moved))

/* The check of a product is no part of making it. */
remap_status __wrap_rm_trimesh_check(const rm_frame *frame, const rm_trimesh *mesh);
remap_status __wrap_rm_trimesh_check(const rm_frame *frame, const rm_trimesh *mesh)
{
  (void)frame, (void)mesh;
  return REMAP_OK;
}

typedef int visitor(void *user, rm_lid item);
typedef struct counter {
  visitor *visit;
  void    *user;
} counter;

static int count_visit(void *user, rm_lid item)
{
  const counter *c = user;

  work++;
  return c->visit(c->user, item);
}

int __real_rm_boxtree_query(const rm_boxtree *, const double (*)[6], const double[6], visitor *, void *);
int __wrap_rm_boxtree_query(const rm_boxtree *, const double (*)[6], const double[6], visitor *, void *);
int __wrap_rm_boxtree_query(const rm_boxtree *tree, const double (*item_box)[6], const double box[6], visitor *visit,
                            void *user)
{
  return __real_rm_boxtree_query(tree, item_box, box, count_visit, &(counter){visit, user});
}
int __real_rm_boxtree_query_segment(const rm_boxtree *, const double (*)[6], const double[3], const double[3], visitor *,
                                    void *);
int __wrap_rm_boxtree_query_segment(const rm_boxtree *, const double (*)[6], const double[3], const double[3], visitor *,
                                    void *);
int __wrap_rm_boxtree_query_segment(const rm_boxtree *tree, const double (*item_box)[6], const double p[3], const double q[3],
                                    visitor *visit, void *user)
{
  return __real_rm_boxtree_query_segment(tree, item_box, p, q, count_visit, &(counter){visit, user});
}

/* Two meshes; of the first, every other cell may stay away. */
typedef struct task {
  tm_mesh *mesh[2];
  bool     every_other;
} task;
typedef void maker(int n, task *out);

/* Work per edge and crossing of a task, which is given up; 0 if it fails. */
static double cost(task *t, int first)
{
  uint8_t *some = tm_alloc_(t->mesh[0]->view.num_cells, 1), *keep = t->every_other ? some : NULL;
  laid    *l;
  double   size = 0;

  for (int64_t c = 0; c < t->mesh[0]->view.num_cells; c += 2) some[c] = 1;
  work = 0;
  l    = laid_over(t->mesh[first], t->mesh[1 - first], REMAP_FACES_DIAGONAL,
                   &(laid_how){.keep = {first ? NULL : keep, first ? keep : NULL}});
  if (RT_EQ(l->status, REMAP_OK))
    for (int side = 0; side < 2; side++) size += (double)(l->mesh[side]->num_edges + l->overlay->trace[side].num_crossings);
  laid_free(l);
  for (int side = 0; side < 2; side++) tm_free(t->mesh[side]);
  free(some);
  return size > 0 ? (double)work / size : 0;
}

/* Costs of meshes of n elements, n growing by tens, grow as log n at most; one way round and the other in turn. */
static void grows_as_the_logarithm(maker *make, int from, int to)
{
  double first = 0;

  for (int n = from, way = 0; n <= (rt_long() ? 10 * to : to); n *= 10, way = 1 - way) {
    task t = {{NULL, NULL}, false};

    make(n, &t);
    const double now = cost(&t, way);
    if (n == from) first = now;
    if (!(now <= 1.1 * first * log(n) / log(from)))
      rt_fail_(__FILE__, __LINE__, "%d elements cost %g each, %d cost %g", n, now, from, first);
  }
}

static const double middle[3] = {.1, .2, .3};

static tm_mesh *grid(void) { return tm_benchmark(8, .7, .3, 3); }

static void surface_on_grid(int n, task *t)
{
  t->mesh[0] = surfaces_ball((int)lrint(sqrt(n / 8.0)), 1, middle);
  t->mesh[1] = grid();
}
static void surface_on_itself(int n, task *t)
{
  for (int side = 0; side < 2; side++) t->mesh[side] = surfaces_ball((int)lrint(sqrt(n / 8.0)), 1, middle);
}
static void surface_in_surface(int n, task *t)
{
  t->mesh[0] = surfaces_ball((int)lrint(sqrt(n / 8.0)), 1, middle);
  t->mesh[1] = surfaces_ball((int)lrint(sqrt(n / 8.0)), .7, (double[]){.5, .3, .4});
}
static void blocks(int n, task *t)
{
  for (int side = 0; side < 2; side++) t->mesh[side] = surfaces_block((int)lrint(sqrt(n / 2.0)), side == 1);
}
static void cones(int n, task *t)
{
  t->mesh[0] = surfaces_double_cone(n / 2);
  t->mesh[1] = grid();
}
static void wedges(int n, task *t)
{
  t->mesh[0] = surfaces_wedges(n);
  t->mesh[1] = tm_benchmark(3, .7, .3, 3);
}

/* Boxes in a row, a gap behind each, and a cell through all of them. */
static void row(int n, task *t)
{
  t->mesh[0]     = tm_hexahedra((int[]){2 * n, 1, 1}, NULL, NULL);
  t->mesh[1]     = tm_hexahedra((int[]){1, 1, 1}, tm_affine, (double[]){3, .01, .003, -1, .02, .1, 0, .43, .01, 0, .1, .41});
  t->every_other = true;
}

static void a_surface_costs_little_per_crossing_however_fine(void) { grows_as_the_logarithm(surface_on_grid, 1000, 100000); }
static void a_surface_on_itself_costs_little_per_edge(void) { grows_as_the_logarithm(surface_on_itself, 1000, 100000); }
static void surfaces_that_cross_cost_little_per_crossing(void) { grows_as_the_logarithm(surface_in_surface, 1000, 100000); }
static void surfaces_that_touch_in_all_their_triangles_cost_little_per_edge(void)
{
  grows_as_the_logarithm(blocks, 1000, 100000);
}
static void triangles_round_one_vertex_cost_little_each(void) { grows_as_the_logarithm(cones, 1000, 100000); }
static void cells_round_one_edge_cost_little_each(void) { grows_as_the_logarithm(wedges, 1000, 10000); }
static void an_edge_through_many_gaps_costs_little_per_crossing(void) { grows_as_the_logarithm(row, 100, 10000); }

RT_MAIN(RT_CASE(a_surface_costs_little_per_crossing_however_fine), RT_CASE(a_surface_on_itself_costs_little_per_edge),
        RT_CASE(surfaces_that_cross_cost_little_per_crossing),
        RT_CASE(surfaces_that_touch_in_all_their_triangles_cost_little_per_edge),
        RT_CASE(triangles_round_one_vertex_cost_little_each), RT_CASE(cells_round_one_edge_cost_little_each),
        RT_CASE(an_edge_through_many_gaps_costs_little_per_crossing))
