/* finish -- the soup numbered over all ranks and put in order. Corners are numbered by coordinates, along the curve of
 * Morton keys; vertices by their corners; faces by their vertices, starting from the least one towards the lesser of its
 * neighbours; cells by their least face and the side they are on. Faces that turn out to be one join. O(n). */
#include "super/super_private.h"

#include <string.h>

typedef struct work {
  rm_arena            *arena;
  const rm_super_job  *job;
  rm_soup             *soup;
  rm_reason           *reason;
  remap_supermesh_view v;
  int64_t             *face_number, *cell_number;
  rm_lid              *face_at;  /* [faces of the result] of the soup                          */
  rm_lid              *face_twin; /* [faces of the result] the soup's other face that it is, -1 */
  rm_lid              *new_cell; /* [cells of the soup]                                        */
} work;

/* How a refusal names a cell of the soup: twice the number of its ancestor, and the side that has it. */
static int64_t name_of(const rm_soup_cell *cell)
{
  const int side = cell->ancestor[0] >= 0 ? 0 : 1;
  return 2 * cell->ancestor[side] + side;
}

static remap_status tangled(const work *w, int64_t name)
{
  return rm_fail(REMAP_BAD_MESH, w->reason, (int)(name & 1), name / 2,
                 "a part of this cell lies on a part of another: cells of one mesh overlap, are there twice or are inverted; a "
                 "supermesh needs cells that do not and are not");
}

/* The cell that has the soup's face f on its owner's side. */
static int64_t name_at_face(const work *w, int64_t f) { return name_of(&w->soup->cell[w->soup->face[f].cell[0]]); }

/* A cell that has the soup's vertex i. */
static int64_t name_at_vertex(const work *w, int64_t i)
{
  const rm_soup *s = w->soup;
  int64_t        f = 0;

  while (f < s->num_faces) {
    int64_t k = s->face[f].first;
    while (k < s->face[f + 1].first && s->loop[k] != i) k++;
    if (k < s->face[f + 1].first) break;
    f++;
  }
  RM_ASSERT(f < s->num_faces); /* no vertex is without a face */
  return name_at_face(w, f);
}

/* ---- vertices ---------------------------------------------------------------------------------------------------- */

/* A word that ascends as the coordinate does. */
static uint64_t word_of(double x)
{
  uint64_t bits;

  memcpy(&bits, &x, sizeof bits);
  return bits >> 63 ? ~bits : bits | UINT64_C(1) << 63;
}

static remap_status number_corners(const work *w, rm_arena *passing, int64_t *number)
{
  const rm_soup *s = w->soup;
  uint64_t     (*key)[4] = rm_arena_alloc(passing, s->num_corners, sizeof *key);
  int64_t        total;

  RM_TRY(rm_comm_agree(w->job->comm, key ? REMAP_OK : REMAP_NO_MEMORY, NULL));
  for (int64_t i = 0; i < s->num_corners && key; i++) {
    key[i][0] = rm_morton(w->job->frame, s->corner[i]);
    for (int c = 0; c < 3; c++) key[i][1 + c] = word_of(s->corner[i][c]);
  }
  return rm_super_number(passing, w->job->comm, s->num_corners, 4, &key[0][0], number, &total);
}

static remap_status number_vertices(work *w, rm_arena *passing, int64_t *number)
{
  const rm_soup *s = w->soup;
  int64_t       *corner = rm_arena_alloc(passing, s->num_corners, sizeof *corner);
  uint64_t     (*key)[RM_SOUP_CORNERS] = rm_arena_alloc(passing, s->num_vertices, sizeof *key);

  RM_TRY(rm_comm_agree(w->job->comm, corner && key ? REMAP_OK : REMAP_NO_MEMORY, NULL));
  RM_TRY(number_corners(w, passing, corner));
  for (int64_t i = 0; i < s->num_vertices && key && corner; i++) {
    const rm_soup_vertex *v = &s->vertex[i];
    for (int k = 0; k < RM_SOUP_CORNERS; k++) key[i][k] = v->corner[k] < 0 ? 0 : (uint64_t)corner[v->corner[k]] + 1;
    key[i][0] = key[i][0] << 2 | (uint64_t)v->kind;
  }
  return rm_super_number(passing, w->job->comm, s->num_vertices, RM_SOUP_CORNERS, &key[0][0], number, &w->v.global_nodes);
}

/* Turn every loop of nodes until it begins with its least one. */
static remap_status turn_loops(rm_soup *s, rm_arena *passing)
{
  int64_t longest = 0;
  rm_lid *copy;

  for (int64_t f = 0; f < s->num_faces; f++) {
    const int64_t n = s->face[f + 1].first - s->face[f].first;
    longest         = n > longest ? n : longest;
  }
  RM_NEW(copy, passing, longest);
  for (int64_t f = 0; f < s->num_faces; f++) {
    const int64_t n = s->face[f + 1].first - s->face[f].first;
    rm_lid       *loop  = s->loop + s->face[f].first;
    int64_t       least = 0;

    for (int64_t k = 1; k < n; k++)
      if (loop[k] < loop[least]) least = k;
    if (!least) continue;
    for (int64_t k = 0; k < n; k++) copy[k] = loop[k < n - least ? k + least : k + least - n];
    memcpy(loop, copy, sizeof *loop * (size_t)n);
  }
  return REMAP_OK;
}

/* Nodes of the result: distinct vertices in order. The soup's loops become loops of nodes; it has no vertices any more. */
static remap_status make_nodes(work *w, rm_arena *passing, const int64_t *number)
{
  const rm_soup *s    = w->soup;
  const double   unit = 1 / w->job->frame->scale;
  rm_keyed      *key, *spare;
  rm_lid        *node_of;
  int64_t       *global, n = 0;
  double       (*xyz)[3];

  RM_NEW(key, passing, s->num_vertices);
  RM_NEW(spare, passing, s->num_vertices);
  RM_NEW(node_of, passing, s->num_vertices);
  for (int64_t i = 0; i < s->num_vertices; i++) key[i] = (rm_keyed){(uint64_t)number[i], i};
  rm_sort_keyed(key, spare, s->num_vertices);
  for (int64_t i = 0; i < s->num_vertices; i++) {
    const bool again = i > 0 && key[i].key == key[i - 1].key;
    if (again && key[i].item < s->num_made) /* the sort is stable: so is the one before */
      return tangled(w, name_at_vertex(w, key[i].item));
    n += !again;
    node_of[key[i].item] = (rm_lid)(n - 1);
  }
  RM_NEW(global, w->arena, n);
  RM_NEW(xyz, w->arena, n);
  for (int64_t i = 0; i < s->num_vertices; i++) {
    const rm_lid to = node_of[i];
    global[to]      = number[i];
    for (int c = 0; c < 3; c++) xyz[to][c] = s->vertex[i].xyz[c] * unit;
  }
  for (int64_t k = 0; k < s->num_loop; k++) s->loop[k] = node_of[s->loop[k]];
  rm_soup_drop_vertices(w->soup);
  w->v.num_nodes   = n;
  w->v.node_global = global;
  w->v.node_xyz    = &xyz[0][0];
  return turn_loops(w->soup, passing);
}

/* What their numbers are made from is given back before the nodes are made. */
static remap_status do_vertices(work *w, rm_arena *passing)
{
  int64_t     *number = rm_arena_alloc(passing, w->soup->num_vertices, sizeof *number);
  rm_arena    *keys   = rm_arena_new();
  remap_status status = rm_comm_agree(w->job->comm, number && keys ? REMAP_OK : REMAP_NO_MEMORY, NULL);

  if (status == REMAP_OK) status = number_vertices(w, keys, number);
  rm_arena_drop(keys);
  RM_TRY(status);
  return rm_comm_agree_reason(w->job->comm, make_nodes(w, passing, number), w->reason);
}

/* ---- faces ------------------------------------------------------------------------------------------------------- */

/* The way in which face f runs from its least node, which is its first, to the lesser of its neighbours: +1 with the loop, -1. */
static int walk_of(const rm_soup *s, int64_t f)
{
  const rm_lid *loop = s->loop + s->face[f].first, *last = s->loop + s->face[f + 1].first - 1;

  return loop[1] < *last ? 1 : -1;
}

static remap_status number_faces(work *w, rm_arena *passing)
{
  const rm_soup *s = w->soup;
  uint64_t     (*key)[4] = rm_arena_alloc(passing, s->num_faces, sizeof *key);

  RM_TRY(rm_comm_agree(w->job->comm, key ? REMAP_OK : REMAP_NO_MEMORY, NULL));
  for (int64_t f = 0; f < s->num_faces && key; f++) {
    const int64_t first = s->face[f].first, n = s->face[f + 1].first - first;
    const int     step = walk_of(s, f);
    uint64_t      hash = 0;
    int64_t       at   = 0;

    for (int64_t k = 0; k < n; k++) {
      const uint64_t g = (uint64_t)w->v.node_global[s->loop[first + at]];
      if (k < 2) key[f][k] = g;
      if (k == n - 1) key[f][2] = g;
      hash = rm_hash_word(hash ^ g);
      at += step;
      at = at < 0 ? n - 1 : at == n ? 0 : at;
    }
    key[f][3] = hash; /* keeps loops apart that have three vertices in common */
  }
  return rm_super_number(passing, w->job->comm, s->num_faces, 4, &key[0][0], w->face_number, &w->v.global_faces);
}

/* Faces of the result in order: those of the soup, two of one number joined. */
static remap_status join_faces(work *w, rm_arena *passing)
{
  const rm_soup *s = w->soup;
  rm_keyed      *key, *spare;
  int64_t        n = 0;

  RM_NEW(key, passing, s->num_faces);
  RM_NEW(spare, passing, s->num_faces);
  for (int64_t f = 0; f < s->num_faces; f++) key[f] = (rm_keyed){(uint64_t)w->face_number[f], f};
  rm_sort_keyed(key, spare, s->num_faces);
  for (int64_t f = 0; f < s->num_faces; f++) {
    const bool twin = f > 0 && key[f].key == key[f - 1].key;

    if (!twin) {
      w->face_twin[n] = -1;
      w->face_at[n++] = (rm_lid)key[f].item;
      continue;
    }
    const rm_soup_face *x = &s->face[w->face_at[n - 1]], *y = &s->face[key[f].item];
    if (w->face_twin[n - 1] >= 0 || x->cell[1] >= 0 || y->cell[1] >= 0 ||
        walk_of(s, x - s->face) == walk_of(s, y - s->face))
      return tangled(w, name_at_face(w, y - s->face));
    w->face_twin[n - 1] = (rm_lid)key[f].item;
  }
  w->v.num_faces = n;
  return REMAP_OK;
}

static remap_status do_join(work *w, rm_arena *passing)
{
  return rm_comm_agree_reason(w->job->comm, join_faces(w, passing), w->reason);
}

/* ---- cells ------------------------------------------------------------------------------------------------------- */

static remap_status number_cells(work *w, rm_arena *passing)
{
  const rm_soup *s   = w->soup;
  uint64_t      *key = rm_arena_alloc(passing, s->num_cells, sizeof *key);

  RM_TRY(rm_comm_agree(w->job->comm, key ? REMAP_OK : REMAP_NO_MEMORY, NULL));
  for (int64_t c = 0; c < s->num_cells && key; c++) key[c] = UINT64_MAX;
  for (int64_t f = 0; f < s->num_faces && key; f++) {
    const int step = walk_of(s, f);
    for (int h = 0; h < 2; h++) {
      const rm_lid   c = s->face[f].cell[h];
      const uint64_t mine = 2 * (uint64_t)w->face_number[f] + ((step > 0) == (h == 0));
      if (c >= 0 && mine < key[c]) key[c] = mine;
    }
  }
  return rm_super_number(passing, w->job->comm, s->num_cells, 1, key, w->cell_number, &w->v.global_cells);
}

static remap_status make_cells(work *w, rm_arena *passing, rm_super *out)
{
  const rm_soup *s    = w->soup;
  const double   unit = 1 / w->job->frame->scale, cubed = unit * unit * unit;
  rm_keyed      *key, *spare;
  int64_t       *global, *ancestor[2];
  rm_lid        *home[2];
  int           *rank[2];
  double        *volume;

  RM_NEW(key, passing, s->num_cells);
  RM_NEW(spare, passing, s->num_cells);
  RM_NEW(global, w->arena, s->num_cells);
  RM_NEW(volume, w->arena, s->num_cells);
  for (int64_t c = 0; c < s->num_cells; c++) key[c] = (rm_keyed){(uint64_t)w->cell_number[c], c};
  rm_sort_keyed(key, spare, s->num_cells);
  for (int64_t c = 0; c < s->num_cells; c++) {
    w->new_cell[key[c].item] = (rm_lid)c;
    global[c]                = (int64_t)key[c].key;
    volume[c]                = s->cell[key[c].item].volume * cubed;
  }
  for (int side = 0; side < 2; side++) {
    RM_NEW(ancestor[side], w->arena, s->num_cells);
    RM_NEW(home[side], w->arena, s->num_cells);
    RM_NEW(rank[side], w->arena, s->num_cells);
    for (int64_t c = 0; c < s->num_cells; c++) {
      const rm_soup_cell *x = &s->cell[key[c].item];
      ancestor[side][c] = x->ancestor[side];
      home[side][c]     = x->home[side];
      rank[side][c]     = x->rank[side];
    }
    w->v.cell_ancestor[side] = ancestor[side];
    out->cell_home[side]     = home[side];
    out->cell_rank[side]     = rank[side];
  }
  w->v.num_cells   = s->num_cells;
  w->v.cell_global = global;
  w->v.cell_volume = volume;
  return REMAP_OK;
}

/* ---- the faces of the result ------------------------------------------------------------------------------------- */

typedef struct face_arrays {
  int64_t *offset, *global;
  int32_t *node, *owner, *neighbour, *from[2], *rank[2];
} face_arrays;

/* Write face f: from its least node on, out of its lower cell. */
static void write_face(const work *w, int64_t f, face_arrays *to)
{
  const rm_soup      *s = w->soup;
  const rm_soup_face *x = &s->face[w->face_at[f]], *y = w->face_twin[f] < 0 ? NULL : &s->face[w->face_twin[f]];
  const int64_t       n = x[1].first - x[0].first;
  const rm_lid        a = w->new_cell[x->cell[0]], other = y ? y->cell[0] : x->cell[1], b = other < 0 ? -1 : w->new_cell[other];
  const bool          turned = b >= 0 && b < a;

  to->global[f]    = w->face_number[w->face_at[f]];
  to->owner[f]     = turned ? b : a;
  to->neighbour[f] = turned ? a : b;
  for (int side = 0; side < 2; side++) {
    const rm_soup_face *z = y && y->from[side] >= 0 &&
                                    (x->from[side] < 0 || y->from_rank[side] < x->from_rank[side] ||
                                     (y->from_rank[side] == x->from_rank[side] && y->from[side] < x->from[side]))
                                ? y
                                : x;
    to->from[side][f] = z->from[side];
    to->rank[side][f] = z->from_rank[side];
  }
  for (int64_t k = 0; k < n; k++) to->node[to->offset[f] + k] = s->loop[x->first + (turned && k ? n - k : k)];
  to->offset[f + 1] = to->offset[f] + n;
}

static remap_status make_faces(work *w)
{
  const int64_t n = w->v.num_faces;
  face_arrays   to;

  RM_NEW(to.offset, w->arena, n + 1);
  RM_NEW(to.global, w->arena, n);
  RM_NEW(to.node, w->arena, w->soup->num_loop);
  RM_NEW(to.owner, w->arena, n);
  RM_NEW(to.neighbour, w->arena, n);
  for (int side = 0; side < 2; side++) {
    RM_NEW(to.from[side], w->arena, n);
    RM_NEW(to.rank[side], w->arena, n);
  }
  to.offset[0] = 0;
  for (int64_t f = 0; f < n; f++) write_face(w, f, &to);
  w->v.face_offset    = to.offset;
  w->v.face_global    = to.global;
  w->v.face_node      = to.node;
  w->v.face_owner     = to.owner;
  w->v.face_neighbour = to.neighbour;
  for (int side = 0; side < 2; side++) {
    w->v.face_from[side]      = to.from[side];
    w->v.face_from_rank[side] = to.rank[side];
  }
  return REMAP_OK;
}

/* ---- cells of other ranks ---------------------------------------------------------------------------------------- */

/* A face that has one cell on a rank, on its way to the rank that looks after its number. */
typedef struct half {
  int64_t face, cell;
  int64_t name; /* name_of the cell                       */
  int64_t way;  /* in which the face runs there, as walk_of */
} half;

static int keeper_of(int64_t face, int size) { return (int)((uint64_t)face % (uint64_t)size); }

/* Faces with one cell here, by their keepers. */
static remap_status collect_halves(const work *w, rm_arena *passing, int64_t **offset, half **list, rm_lid **face)
{
  const int size = w->job->comm->size;
  int64_t  *next, num = 0;

  RM_NEW0(next, passing, (int64_t)size + 2);
  for (int64_t f = 0; f < w->v.num_faces; f++)
    if (w->v.face_neighbour[f] < 0) next[keeper_of(w->v.face_global[f], size) + 1]++, num++;
  rm_offsets(next + 1, size);
  RM_NEW(*list, passing, num);
  RM_NEW(*face, passing, num);
  for (int64_t f = 0; f < w->v.num_faces; f++) {
    if (w->v.face_neighbour[f] >= 0) continue;
    const int64_t at = next[keeper_of(w->v.face_global[f], size) + 1]++, made = w->face_at[f];
    (*list)[at] = (half){w->v.face_global[f], w->v.cell_global[w->v.face_owner[f]], name_at_face(w, made),
                         walk_of(w->soup, made)};
    (*face)[at]      = (rm_lid)f;
  }
  *offset = next; /* each rank's end is the next one's begin */
  return REMAP_OK;
}

/* To each of n halves the cell of the other half of its face, -1 if there is none. */
static remap_status pair_halves(const work *w, rm_arena *passing, int64_t n, const half *list, int64_t **out)
{
  rm_keyed *key, *spare;
  int64_t  *other;

  RM_NEW(key, passing, n);
  RM_NEW(spare, passing, n);
  RM_NEW(other, passing, n);
  for (int64_t k = 0; k < n; k++) key[k] = (rm_keyed){(uint64_t)list[k].face, k};
  rm_sort_keyed(key, spare, n);
  for (int64_t k = 0, next; k < n; k = next) {
    for (next = k + 1; next < n && key[next].key == key[k].key;) next++;
    if (next > k + 2 || (next == k + 2 && list[key[k].item].way == list[key[k + 1].item].way))
      return tangled(w, list[key[k].item].name);
    for (int64_t i = k; i < next; i++) other[key[i].item] = next == k + 2 ? list[key[i == k ? k + 1 : k].item].cell : -1;
  }
  *out = other;
  return REMAP_OK;
}

static remap_status keep_beyond(work *w, rm_arena *passing, int64_t n, const rm_lid *face, const int64_t *other)
{
  int64_t *cell_of, *cell, num = 0;
  int32_t *list;

  for (int64_t k = 0; k < n; k++) num += other[k] >= 0;
  RM_NEW(cell_of, passing, w->v.num_faces);
  RM_NEW(list, w->arena, num);
  RM_NEW(cell, w->arena, num);
  for (int64_t f = 0; f < w->v.num_faces; f++) cell_of[f] = -1;
  for (int64_t k = 0; k < n; k++) cell_of[face[k]] = other[k];
  num = 0;
  for (int64_t f = 0; f < w->v.num_faces; f++) {
    if (cell_of[f] < 0) continue;
    list[num]   = (int32_t)f;
    cell[num++] = cell_of[f];
  }
  w->v.num_beyond  = num;
  w->v.beyond_face = list;
  w->v.beyond_cell = cell;
  return REMAP_OK;
}

static remap_status find_beyond(work *w, rm_arena *passing)
{
  const rm_comm *comm = w->job->comm;
  int64_t       *offset = NULL, *arrives = rm_arena_alloc(passing, (int64_t)comm->size + 1, sizeof *arrives), *other = NULL;
  int64_t       *returns = rm_arena_alloc(passing, (int64_t)comm->size + 1, sizeof *returns);
  half          *list = NULL;
  rm_lid        *face = NULL;
  void          *halves, *answers;
  remap_status   mine = arrives && returns ? REMAP_OK : REMAP_NO_MEMORY;

  if (comm->size == 1) return keep_beyond(w, passing, 0, NULL, NULL);
  if (mine == REMAP_OK) mine = collect_halves(w, passing, &offset, &list, &face);
  RM_TRY(rm_comm_agree(comm, mine, NULL));
  RM_TRY(rm_comm_exchange(comm, passing, sizeof *list, offset, list, arrives, &halves));
  RM_TRY(rm_comm_agree_reason(comm, pair_halves(w, passing, arrives[comm->size], halves, &other), w->reason));
  RM_TRY(rm_comm_exchange(comm, passing, sizeof *other, arrives, other, returns, &answers));
  return rm_comm_agree(comm, keep_beyond(w, passing, returns[comm->size], face, answers), NULL);
}

/* ------------------------------------------------------------------------------------------------------------------ */

/* Run a step with working memory of its own. Collective. */
static remap_status in_passing(work *w, remap_status (*step)(work *w, rm_arena *passing))
{
  rm_arena    *passing = rm_arena_new();
  remap_status status  = rm_comm_agree(w->job->comm, passing ? REMAP_OK : REMAP_NO_MEMORY, NULL);

  if (status == REMAP_OK) status = step(w, passing);
  rm_arena_drop(passing);
  return status;
}

static remap_status make_room(work *w, rm_arena *passing)
{
  RM_NEW(w->face_number, passing, w->soup->num_faces);
  RM_NEW(w->face_at, passing, w->soup->num_faces);
  RM_NEW(w->face_twin, passing, w->soup->num_faces);
  RM_NEW(w->cell_number, passing, w->soup->num_cells);
  RM_NEW(w->new_cell, passing, w->soup->num_cells);
  return REMAP_OK;
}

remap_status rm_super_finish(rm_arena *arena, const rm_super_job *job, rm_soup *soup, rm_super *out, rm_reason *reason)
{
  work         w       = {.arena = arena, .job = job, .soup = soup, .reason = reason};
  rm_arena    *passing = rm_arena_new();
  remap_status status;

  RM_GOTO(done, status = rm_comm_agree(job->comm, passing ? make_room(&w, passing) : REMAP_NO_MEMORY, NULL));
  RM_GOTO(done, status = in_passing(&w, do_vertices));
  RM_GOTO(done, status = in_passing(&w, number_faces));
  RM_GOTO(done, status = in_passing(&w, do_join));
  RM_GOTO(done, status = in_passing(&w, number_cells));
  RM_GOTO(done, status = rm_comm_agree(job->comm, make_cells(&w, passing, out), NULL));
  RM_GOTO(done, status = rm_comm_agree(job->comm, make_faces(&w), NULL));
  RM_GOTO(done, status = in_passing(&w, find_beyond));
  out->view = w.v;
done:
  rm_arena_drop(passing);
  return status;
}
