/* search -- the mapped cell of nearest centroid in a distributed mesh. Every rank holds a k-d tree of its mapped cells; a point
 * asks the rank whose box is nearest first, or if there are very many one whose box is joined with that; then every rank whose
 * box is not farther than the answer. Box distances are rounded like true ones, so they never exceed them, and the answer is
 * the same for every partition. */
#include "field_private.h"

#include <stdlib.h>

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
  double        box[6];  /* around them */
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

/* Points to ask about, by rank: key is the rank, item the point. */
typedef struct questions {
  int64_t   num, room;
  rm_keyed *question; /* malloc'ed */
} questions;

static remap_status add_question(questions *q, int64_t rank, int64_t point)
{
  RM_TRY(rm_grow(&q->question, &q->room, q->num + 1, sizeof *q->question));
  q->question[q->num++] = (rm_keyed){(uint64_t)rank, point};
  return REMAP_OK;
}

/* The questions in the order of their ranks, what they are, and room for the offsets of what comes and goes. Not collective. */
typedef struct letters {
  int64_t *offset, *heard, *back; /* [comm->size + 1] of questions, of what others ask, of answers */
  double (*point)[3];             /* [offset[comm->size]]                                          */
} letters;

static remap_status write_letters(rm_arena *scratch, const rm_comm *comm, questions *q, const double (*point)[3], letters *l)
{
  rm_keyed *spare;

  RM_NEW(spare, scratch, q->num);
  RM_NEW(l->point, scratch, q->num);
  RM_NEW0(l->offset, scratch, (int64_t)comm->size + 1);
  RM_NEW(l->heard, scratch, (int64_t)comm->size + 1);
  RM_NEW(l->back, scratch, (int64_t)comm->size + 1);
  rm_sort_keyed(q->question, spare, q->num);
  for (int64_t k = 0; k < q->num; k++) {
    l->offset[q->question[k].key]++;
    for (int d = 0; d < 3; d++) l->point[k][d] = point[q->question[k].item][d];
  }
  rm_offsets(l->offset, comm->size);
  return REMAP_OK;
}

/* Send the questions, answer those of others, and take the answers into account. status: of making the questions here.
 * Collective. */
static remap_status ask(rm_arena *scratch, const rm_comm *comm, const tree *t, remap_status status, questions *q,
                        const double (*point)[3], rm_origin *found)
{
  letters    l = {0};
  rm_origin *answer;
  void      *recv;

  if (status == REMAP_OK) status = write_letters(scratch, comm, q, point, &l);
  RM_TRY(rm_comm_agree(comm, status, NULL));
  RM_TRY(rm_comm_exchange(comm, scratch, sizeof *l.point, l.offset, l.point, l.heard, &recv));
  answer = rm_arena_alloc(scratch, l.heard[comm->size], sizeof *answer);
  RM_TRY(rm_comm_agree(comm, answer ? REMAP_OK : REMAP_NO_MEMORY, NULL));
  RM_ASSERT(answer);
  for (int64_t k = 0; k < l.heard[comm->size]; k++) {
    answer[k] = (rm_origin){.rank = -1};
    search(t, 0, t->num, ((const double(*)[3])recv)[k], &answer[k]);
  }
  RM_TRY(rm_comm_exchange(comm, scratch, sizeof *answer, l.heard, answer, l.back, &recv));
  for (int64_t k = 0; k < q->num; k++) {
    const int64_t asked = q->question[k].item;

    improve(point[asked], &((const rm_origin *)recv)[k], &found[asked]);
  }
  return REMAP_OK;
}

/* A first answer: of the nearest crowd, one box per rank or joined ones. Collective. */
static remap_status ask_nearest(rm_arena *scratch, const rm_comm *comm, const tree *t, int64_t num_points,
                                const double (*point)[3], int64_t *first_rank, rm_origin *found)
{
  const double everywhere[1][6] = {{-DBL_MAX, -DBL_MAX, -DBL_MAX, DBL_MAX, DBL_MAX, DBL_MAX}};
  questions    q                = {0};
  rm_crowds    crowds;
  remap_status status;

  RM_TRY(rm_crowds_meet(scratch, comm, t->num > 0, &t->box, num_points > 0, everywhere, RM_SOME_CROWDS, &crowds));
  status = REMAP_OK;
  for (int64_t k = 0; k < num_points && status == REMAP_OK; k++) {
    double nearest = INFINITY;

    found[k]      = (rm_origin){.rank = -1};
    first_rank[k] = -1;
    for (rm_lid c = 0; c < crowds.num; c++) {
      const double distance = box_distance2(crowds.box[c], point[k]);

      if (first_rank[k] >= 0 && distance >= nearest) continue;
      nearest       = distance;
      first_rank[k] = crowds.crowd[c].rank;
    }
    if (first_rank[k] >= 0) status = add_question(&q, first_rank[k], k);
  }
  status = ask(scratch, comm, t, status, &q, point, found);
  free(q.question);
  return status;
}

/* A point that looks for crowds that are not farther than what it found. */
typedef struct doubt {
  const rm_crowds *crowds;
  questions       *q;
  const double    *x;
  double           distance2;
  int64_t          point, first_rank;
  remap_status     status;
} doubt;

static int doubt_rank(void *user, rm_lid item)
{
  doubt        *d    = user;
  const int64_t rank = d->crowds->crowd[item].rank;

  if (rank != d->first_rank && box_distance2(d->crowds->box[item], d->x) <= d->distance2)
    d->status = add_question(d->q, rank, d->point);
  return d->status != REMAP_OK;
}

/* The box of all that is not farther from a point than what it found, rounding included. */
static void box_around(const double x[3], const rm_origin *found, double box[6])
{
  const double reach = sqrt(rm_distance2(x, found->xyz)) * (1 + 0x1p-40);

  for (int d = 0; d < 3; d++) {
    box[d]     = x[d] - reach;
    box[d + 3] = x[d] + reach;
  }
}

/* Ask every other rank that may know better. Collective. */
static remap_status ask_others(rm_arena *scratch, const rm_comm *comm, const tree *t, int64_t num_points,
                               const double (*point)[3], const int64_t *first_rank, rm_origin *found)
{
  double     (*around)[6] = rm_arena_alloc(scratch, num_points, sizeof *around);
  questions    q          = {0};
  rm_lid       num        = 0;
  rm_crowds    crowds;
  remap_status status = !around ? REMAP_NO_MEMORY : num_points > INT32_MAX ? REMAP_TOO_LARGE : REMAP_OK;

  RM_TRY(rm_comm_agree(comm, status, NULL));
  RM_ASSERT(around);
  for (int64_t k = 0; k < num_points; k++)
    if (found[k].rank >= 0) box_around(point[k], &found[k], around[num++]);
  RM_TRY(rm_crowds_meet(scratch, comm, t->num > 0, &t->box, num, (const double(*)[6])around, RM_ALL_CROWDS, &crowds));
  num = 0;
  for (int64_t k = 0; k < num_points && status == REMAP_OK; k++) {
    doubt d = {&crowds, &q, point[k], 0, k, first_rank[k], REMAP_OK};

    if (found[k].rank < 0) continue;
    d.distance2 = rm_distance2(point[k], found[k].xyz);
    (void)rm_boxtree_query(crowds.tree, crowds.box, around[num++], doubt_rank, &d);
    status = d.status;
  }
  status = ask(scratch, comm, t, status, &q, point, found);
  free(q.question);
  return status;
}

remap_status rm_nearest_anywhere(rm_arena *scratch, const rm_comm *comm, const rm_mesh *mesh, const uint8_t *cover,
                                 int64_t num_points, const double (*point)[3], rm_origin *found)
{
  int64_t     *first_rank = rm_arena_alloc(scratch, num_points, sizeof *first_rank);
  tree         t          = {.num = 0};
  remap_status mine       = first_rank ? build_tree(scratch, comm, mesh, cover, &t) : REMAP_NO_MEMORY;

  RM_TRY(rm_comm_agree(comm, mine, NULL));
  RM_ASSERT(first_rank);
  RM_TRY(ask_nearest(scratch, comm, &t, num_points, point, first_rank, found));
  return ask_others(scratch, comm, &t, num_points, point, first_rank, found);
}
