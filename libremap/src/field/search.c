/* search -- the mapped cell of nearest centroid in a distributed mesh. Every rank holds a k-d tree of its mapped cells; a point
 * asks the rank whose box is nearest first, then every rank whose box is not farther than the answer. Box distances are rounded
 * like true ones, so they never exceed them, and the answer is the same for every partition. */
#include "field_private.h"

enum { LEAF = 8 };

/* The tree is the array itself: the middle of a range divides it, along its own axis. */
typedef struct tree_point {
  double xyz[3];
  rm_lid cell;
  int    axis;
} tree_point;

typedef struct tree {
  tree_point   *point; /* [num] */
  int64_t       num;
  double        box[6];
  const rm_gid *global; /* of the mesh's cells */
  int           rank;
} tree;

static int widest_axis(const tree_point *p, int64_t n)
{
  double widest = -1.0;
  int    axis   = 0;

  for (int d = 0; d < 3; d++) {
    double low = INFINITY, high = -INFINITY;

    for (int64_t k = 0; k < n; k++) {
      low  = fmin(low, p[k].xyz[d]);
      high = fmax(high, p[k].xyz[d]);
    }
    if (high - low <= widest) continue;
    widest = high - low;
    axis   = d;
  }
  return axis;
}

/* Put the points in such order that none before the n-th is greater along the axis, none after it smaller (quickselect). */
static void select_nth(tree_point *p, int64_t num, int64_t nth, int axis)
{
  int64_t low = 0, high = num - 1;

  while (low < high) {
    const double pivot = p[low + (high - low) / 2].xyz[axis];
    int64_t      i = low, j = high;

    while (i <= j) {
      while (p[i].xyz[axis] < pivot) i++;
      while (p[j].xyz[axis] > pivot) j--;
      if (i <= j) {
        const tree_point t = p[i];

        p[i++] = p[j];
        p[j--] = t;
      }
    }
    if (nth <= j)
      high = j;
    else if (nth >= i)
      low = i;
    else
      return;
  }
}

static void divide(tree_point *p, int64_t n)
{
  while (n > LEAF) {
    const int64_t middle = n / 2;
    const int     axis   = widest_axis(p, n);

    select_nth(p, n, middle, axis);
    p[middle].axis = axis;
    divide(p, middle);
    p += middle + 1;
    n -= middle + 1;
  }
}

static remap_status build_tree(rm_arena *scratch, const rm_comm *comm, const rm_mesh *mesh, const uint8_t *cover, tree *t)
{
  RM_NEW(t->point, scratch, mesh->num_cells);
  t->num    = 0;
  t->global = mesh->cell_global;
  t->rank   = comm->rank;
  for (int d = 0; d < 3; d++) {
    t->box[d]     = INFINITY;
    t->box[d + 3] = -INFINITY;
  }
  for (rm_lid c = 0; c < mesh->num_cells; c++) {
    const double *x = mesh->cell_centroid[c];

    if (!rm_is_mapped(cover[c])) continue;
    t->point[t->num++] = (tree_point){{x[0], x[1], x[2]}, c, 0};
    for (int d = 0; d < 3; d++) {
      t->box[d]     = fmin(t->box[d], x[d]);
      t->box[d + 3] = fmax(t->box[d + 3], x[d]);
    }
  }
  divide(t->point, t->num);
  return REMAP_OK;
}

/* Take the new origin if it is nearer, or as near and canonically before. */
static void improve(const double x[3], const rm_origin *o, rm_origin *best)
{
  const double distance = rm_distance2(x, o->xyz), old = best->rank < 0 ? INFINITY : rm_distance2(x, best->xyz);
  bool         is_better = o->global < best->global;

  for (int d = 2; d >= 0; d--)
    if (o->xyz[d] < best->xyz[d] || o->xyz[d] > best->xyz[d]) is_better = o->xyz[d] < best->xyz[d];
  if (distance < old || (distance <= old && is_better)) *best = *o;
}

static void search(const tree *t, int64_t first, int64_t end, const double x[3], rm_origin *best)
{
  while (end - first > LEAF) {
    const int64_t     middle = first + (end - first) / 2;
    const tree_point *p      = &t->point[middle];
    const double      offset = x[p->axis] - p->xyz[p->axis];
    const rm_origin   o      = {{p->xyz[0], p->xyz[1], p->xyz[2]}, t->global[p->cell], t->rank, p->cell};

    improve(x, &o, best);
    search(t, offset < 0.0 ? first : middle + 1, offset < 0.0 ? middle : end, x, best);
    if (offset * offset > rm_distance2(x, best->xyz)) return;
    if (offset < 0.0)
      first = middle + 1;
    else
      end = middle;
  }
  for (int64_t k = first; k < end; k++) {
    const tree_point *p = &t->point[k];
    const rm_origin   o = {{p->xyz[0], p->xyz[1], p->xyz[2]}, t->global[p->cell], t->rank, p->cell};

    improve(x, &o, best);
  }
}

/* Square of the distance from a point to a box; infinite for an empty one. */
static double box_distance2(const double box[6], const double x[3])
{
  double sum = 0.0;

  for (int d = 0; d < 3; d++) {
    const double out = fmax(fmax(box[d] - x[d], x[d] - box[d + 3]), 0.0);

    sum += out * out;
  }
  return sum;
}

/* Points to ask about, grouped by rank. */
typedef struct questions {
  int64_t *offset; /* [comm->size + 1] */
  int64_t *point;  /* [offset[comm->size]] */
} questions;

/* First round, nothing found yet: the rank of the nearest box. Second: every other rank whose box is near enough. */
static bool is_asked(const double (*box)[6], int rank, int nearest_rank, const double x[3], const rm_origin *found)
{
  if (found->rank < 0) return rank == nearest_rank;
  return rank != nearest_rank && box_distance2(box[rank], x) <= rm_distance2(x, found->xyz);
}

static remap_status choose_questions(rm_arena *scratch, const rm_comm *comm, const double (*box)[6], int64_t num_points,
                                     const double (*point)[3], const int *nearest_rank, const rm_origin *found, questions *q)
{
  int64_t num = 0;

  RM_NEW0(q->offset, scratch, (int64_t)comm->size + 1);
  for (int r = 0; r < comm->size; r++)
    for (int64_t k = 0; k < num_points; k++) q->offset[r] += is_asked(box, r, nearest_rank[k], point[k], &found[k]);
  rm_offsets(q->offset, comm->size);
  RM_NEW(q->point, scratch, q->offset[comm->size]);
  for (int r = 0; r < comm->size; r++)
    for (int64_t k = 0; k < num_points; k++)
      if (is_asked(box, r, nearest_rank[k], point[k], &found[k])) q->point[num++] = k;
  return REMAP_OK;
}

/* Send the questions, answer those of others, and take the answers into account. Collective. */
static remap_status ask(rm_arena *scratch, const rm_comm *comm, const tree *t, const questions *q, const double (*point)[3],
                        rm_origin *found)
{
  const int64_t num = q->offset[comm->size];
  double(*send)[3]  = rm_arena_alloc(scratch, num, sizeof *send);
  int64_t   *heard  = rm_arena_alloc(scratch, (int64_t)comm->size + 1, sizeof *heard);
  int64_t   *back   = rm_arena_alloc(scratch, (int64_t)comm->size + 1, sizeof *back);
  rm_origin *answer;
  void      *recv;

  RM_TRY(rm_comm_agree(comm, send && heard && back ? REMAP_OK : REMAP_NO_MEMORY, NULL));
  RM_ASSERT(send && heard && back);
  for (int64_t k = 0; k < num; k++)
    for (int d = 0; d < 3; d++) send[k][d] = point[q->point[k]][d];
  RM_TRY(rm_comm_exchange(comm, scratch, sizeof *send, q->offset, send, heard, &recv));
  answer = rm_arena_alloc(scratch, heard[comm->size], sizeof *answer);
  RM_TRY(rm_comm_agree(comm, answer ? REMAP_OK : REMAP_NO_MEMORY, NULL));
  RM_ASSERT(answer);
  for (int64_t k = 0; k < heard[comm->size]; k++) {
    answer[k] = (rm_origin){.rank = -1};
    search(t, 0, t->num, ((const double(*)[3])recv)[k], &answer[k]);
  }
  RM_TRY(rm_comm_exchange(comm, scratch, sizeof *answer, heard, answer, back, &recv));
  for (int64_t k = 0; k < num; k++) improve(point[q->point[k]], &((const rm_origin *)recv)[k], &found[q->point[k]]);
  return REMAP_OK;
}

remap_status rm_nearest_anywhere(rm_arena *scratch, const rm_comm *comm, const rm_mesh *mesh, const uint8_t *cover,
                                 int64_t num_points, const double (*point)[3], rm_origin *found)
{
  double(*box)[6]        = rm_arena_alloc(scratch, comm->size, sizeof *box);
  int      *nearest_rank = rm_arena_alloc(scratch, num_points, sizeof *nearest_rank);
  tree      t            = {.num = 0};
  questions q            = {0};

  RM_TRY(rm_comm_agree(comm, box && nearest_rank ? build_tree(scratch, comm, mesh, cover, &t) : REMAP_NO_MEMORY, NULL));
  RM_ASSERT(box && nearest_rank);
  RM_TRY(rm_comm_allgather(comm, t.box, box, 6, sizeof(double)));
  for (int64_t k = 0; k < num_points; k++) {
    found[k]        = (rm_origin){.rank = -1};
    nearest_rank[k] = 0;
    for (int r = 1; r < comm->size; r++)
      if (box_distance2(box[r], point[k]) < box_distance2(box[nearest_rank[k]], point[k])) nearest_rank[k] = r;
  }
  for (int round = 0; round < 2; round++) {
    RM_TRY(rm_comm_agree(
        comm, choose_questions(scratch, comm, (const double(*)[6])box, num_points, point, nearest_rank, found, &q), NULL));
    RM_TRY(ask(scratch, comm, &t, &q, point, found));
  }
  return REMAP_OK;
}
