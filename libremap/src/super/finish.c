/* finish -- the soup numbered over all ranks and put in order. Vertices become nodes first; then faces are put in the order of
 * their nodes, starting from the least one towards the lesser of its neighbours, and cells in that of their least face and the
 * side they are on. Faces that turn out to be one join. Each array of the result is made by itself, and what it is made from
 * given back, so that little is there twice. O(n). */
#include "super/super_private.h"

#include <stdlib.h>
#include <string.h>

typedef struct work {
  rm_finish f;
  uint32_t *order;    /* [faces of the soup], with RM_SAME; until the result has them all */
  rm_lid   *new_cell; /* [cells of the soup]                                              */
  rm_lid   *cell_at;  /* [cells] of the soup                                              */
} work;

remap_status rm_super_tangled(const rm_finish *w, int64_t name)
{
  return rm_fail(REMAP_BAD_MESH, w->reason, (int)(name & 1), name / 2,
                 "a part of this cell lies on a part of another: cells of one mesh overlap, are there twice or are inverted; a "
                 "supermesh needs cells that do not and are not");
}

/* ---- faces ------------------------------------------------------------------------------------------------------- */

/* A face of the result: one of the soup, or two of it. */
typedef struct face {
  int64_t at, twin; /* twin: -1 */
} face;

/* The face of the result that begins at place *k of the order; *k is where the next one does. */
static inline face next_face(const work *w, int64_t *k)
{
  face x = {(int64_t)(w->order[(*k)++] & ~RM_SAME), -1};

  if (*k < w->f.soup->num_faces && w->order[*k] & RM_SAME) x.twin = (int64_t)(w->order[(*k)++] & ~RM_SAME);
  return x;
}

/* The loop of face f, which begins with its least node. */
static inline const rm_lid *loop_of(const rm_soup *s, int64_t f, uint32_t *n)
{
  *n = s->first[f + 1] - s->first[f];
  return s->loop + s->first[f];
}

/* The way in which face f runs from its least node to the lesser of its neighbours: +1 with the loop, -1. */
static int walk_of(const rm_soup *s, int64_t f)
{
  uint32_t      n;
  const rm_lid *loop = loop_of(s, f, &n);

  return loop[1] < loop[n - 1] ? 1 : -1;
}

/* Tells loops apart that have three nodes in common. */
static uint64_t hash_of(const work *w, int64_t f)
{
  uint32_t      n;
  const rm_lid *loop = loop_of(w->f.soup, f, &n);
  const int     step = walk_of(w->f.soup, f);
  uint64_t      hash = 0;

  for (uint32_t k = 0; k < n; k++) {
    const rm_lid node = loop[step > 0 || k == 0 ? k : n - k];
    hash = rm_hash_word(hash ^ (uint64_t)(w->f.v.node_global ? w->f.v.node_global[node] : node));
  }
  return hash;
}

/* The least node, the lesser of its neighbours, the other one, the hash. */
static uint32_t word_of_face(const void *user, int64_t f, int k)
{
  const work   *w = user;
  uint32_t      n;
  const rm_lid *loop = loop_of(w->f.soup, f, &n);

  if (k == 0) return (uint32_t)loop[0];
  if (k == 1) return (uint32_t)(loop[1] < loop[n - 1] ? loop[1] : loop[n - 1]);
  if (k == 2) return (uint32_t)(loop[1] < loop[n - 1] ? loop[n - 1] : loop[1]);
  return (uint32_t)(k == 3 ? hash_of(w, f) >> 32 : hash_of(w, f));
}

/* Faces of the result in order: those of the soup, two of one key joined. */
static remap_status join_faces(work *w)
{
  const rm_soup *s     = w->f.soup;
  const rm_words words = {word_of_face, w, 5, w->f.v.num_nodes};

  RM_TRY(rm_super_order(&words, s->num_faces, w->order));
  for (int64_t k = 0; k < s->num_faces; w->f.v.num_faces++) {
    const face x = next_face(w, &k);

    if ((k < s->num_faces && w->order[k] & RM_SAME) ||
        (x.twin >= 0 &&
         (s->face_cell[x.at][1] >= 0 || s->face_cell[x.twin][1] >= 0 || walk_of(s, x.at) == walk_of(s, x.twin))))
      return rm_super_tangled(&w->f, rm_cell_name((const int64_t *const *)s->ancestor, s->face_cell[x.at][0]));
  }
  return REMAP_OK;
}

static remap_status number_faces(work *w, rm_arena *passing)
{
  const rm_soup *s      = w->f.soup;
  uint64_t     (*key)[4] = rm_arena_alloc(passing, w->f.v.num_faces, sizeof *key);
  int64_t       *global = rm_arena_alloc(w->f.arena, w->f.v.num_faces, sizeof *global);

  RM_TRY(rm_comm_agree(w->f.job->comm, key && global ? REMAP_OK : REMAP_NO_MEMORY, NULL));
  for (int64_t k = 0, f = 0; k < s->num_faces && key; f++) {
    const int64_t at = next_face(w, &k).at;

    for (int d = 0; d < 3; d++) key[f][d] = (uint64_t)w->f.v.node_global[word_of_face(w, at, d)];
    key[f][3] = hash_of(w, at);
  }
  w->f.v.face_global = global;
  return rm_super_number(passing, w->f.job->comm, w->f.v.num_faces, 4, &key[0][0], w->f.v.global_nodes, global,
                         &w->f.v.global_faces);
}

/* ---- cells ------------------------------------------------------------------------------------------------------- */

/* The soup's cells beside a face: first the one out of which it points when it runs from its least node to the greater of that
 * node's neighbours; -1. */
static void cells_beside(const rm_soup *s, face x, rm_lid cell[2])
{
  const int way = walk_of(s, x.at) > 0;

  cell[way]     = s->face_cell[x.at][0];
  cell[1 - way] = x.twin >= 0 ? s->face_cell[x.twin][0] : s->face_cell[x.at][1] < 0 ? -1 : s->face_cell[x.at][1];
}

/* Cells in the order in which faces, from the first one on, have them; key: [num_cells] twice the face and the side, NULL on
 * one rank. */
static void sort_cells(work *w, uint64_t *key)
{
  const rm_soup *s = w->f.soup;
  rm_lid         n = 0;

  for (int64_t c = 0; c < s->num_cells; c++) w->new_cell[c] = -1;
  for (int64_t k = 0, f = 0; k < s->num_faces; f++) {
    rm_lid cell[2];

    cells_beside(s, next_face(w, &k), cell);
    for (int h = 0; h < 2; h++) {
      if (cell[h] < 0 || w->new_cell[cell[h]] >= 0) continue;
      if (key) key[n] = 2 * (uint64_t)w->f.v.face_global[f] + (uint64_t)h;
      w->cell_at[n]        = cell[h];
      w->new_cell[cell[h]] = n++;
    }
  }
  RM_ASSERT(n == s->num_cells); /* every cell has faces */
  w->f.v.num_cells = n;
}

static remap_status number_cells(work *w, rm_arena *passing)
{
  uint64_t *key    = rm_arena_alloc(passing, w->f.soup->num_cells, sizeof *key);
  int64_t  *global = rm_arena_alloc(w->f.arena, w->f.soup->num_cells, sizeof *global);

  RM_TRY(rm_comm_agree(w->f.job->comm, key && global ? REMAP_OK : REMAP_NO_MEMORY, NULL));
  RM_ASSERT(key);
  sort_cells(w, key);
  w->f.v.cell_global = global;
  return rm_super_number(passing, w->f.job->comm, w->f.v.num_cells, 1, key, 2 * w->f.v.global_faces, global,
                         &w->f.v.global_cells);
}

static remap_status make_cells(work *w, rm_super *out)
{
  rm_soup      *s    = w->f.soup;
  const int64_t n    = w->f.v.num_cells;
  const double  unit = 1 / w->f.job->frame->scale, cubed = unit * unit * unit;
  double       *volume;

  RM_NEW(volume, w->f.arena, n);
  for (int64_t c = 0; c < n; c++) volume[c] = s->volume[w->cell_at[c]] * cubed;
  w->f.v.cell_volume = volume;
  for (int side = 0; side < 2; side++) {
    int64_t *ancestor;
    rm_lid  *home;
    int     *rank;

    RM_NEW(ancestor, w->f.arena, n);
    RM_NEW(home, w->f.arena, n);
    for (int64_t c = 0; c < n; c++) ancestor[c] = s->ancestor[side][w->cell_at[c]];
    for (int64_t c = 0; c < n; c++) home[c] = s->home[side][w->cell_at[c]];
    w->f.v.cell_ancestor[side] = ancestor;
    out->cell_home[side]       = home;
    if (!s->has_ranks) continue;
    RM_NEW(rank, w->f.arena, n);
    for (int64_t c = 0; c < n; c++) rank[c] = s->rank[side][w->cell_at[c]];
    out->cell_rank[side] = rank;
  }
  return REMAP_OK;
}

/* ---- the faces of the result ------------------------------------------------------------------------------------- */

/* Owner and neighbour of a face; true if its loop has to be turned for it to point out of the owner. */
static bool cells_of_face(const work *w, face x, rm_lid cell[2])
{
  const rm_soup *s = w->f.soup;
  const rm_lid   a = w->new_cell[s->face_cell[x.at][0]], other = x.twin >= 0 ? s->face_cell[x.twin][0] : s->face_cell[x.at][1];
  const rm_lid   b = other < 0 ? -1 : w->new_cell[other];
  const bool     turned = b >= 0 && b < a;

  cell[0] = turned ? b : a;
  cell[1] = turned ? a : b;
  return turned;
}

/* Loops, from their least node on. The soup has none any more. */
static remap_status make_loops(work *w)
{
  rm_soup *s = w->f.soup;
  int64_t *offset, corners = 0;
  int32_t *node;

  for (int64_t k = 0; k < s->num_faces;) {
    uint32_t n;
    loop_of(s, next_face(w, &k).at, &n);
    corners += n;
  }
  RM_NEW(offset, w->f.arena, w->f.v.num_faces + 1);
  RM_NEW(node, w->f.arena, corners);
  offset[0] = 0;
  for (int64_t k = 0, f = 0; k < s->num_faces; f++) {
    const face    x = next_face(w, &k);
    rm_lid        cell[2];
    uint32_t      n;
    const bool    turned = cells_of_face(w, x, cell);
    const rm_lid *loop   = loop_of(s, x.at, &n);
    int32_t      *to     = node + offset[f];

    for (uint32_t i = 0; i < n; i++) to[i] = loop[turned && i ? n - i : i];
    offset[f + 1] = offset[f] + n;
  }
  w->f.v.face_offset = offset;
  w->f.v.face_node   = node;
  free(s->first);
  free(s->loop);
  s->first = NULL;
  s->loop  = NULL;
  return REMAP_OK;
}

static remap_status make_sides(work *w)
{
  rm_soup *s = w->f.soup;
  int32_t *owner, *neighbour;

  RM_NEW(owner, w->f.arena, w->f.v.num_faces);
  RM_NEW(neighbour, w->f.arena, w->f.v.num_faces);
  for (int64_t k = 0, f = 0; k < s->num_faces; f++) {
    rm_lid cell[2];

    cells_of_face(w, next_face(w, &k), cell);
    owner[f]     = cell[0];
    neighbour[f] = cell[1];
  }
  w->f.v.face_owner     = owner;
  w->f.v.face_neighbour = neighbour;
  free(s->face_cell);
  s->face_cell = NULL;
  return REMAP_OK;
}

/* Of the two of the soup that a face may be, the one that says from which face of that side it comes: that of the lower rank
 * and number. */
static int64_t origin_of(const rm_soup *s, int side, face x)
{
  const rm_lid *from = s->from[side];

  if (x.twin < 0 || from[x.twin] < 0) return x.at;
  if (from[x.at] < 0) return x.twin;
  const int rank[2] = {rm_soup_rank(s->from_rank[side], from, x.at), rm_soup_rank(s->from_rank[side], from, x.twin)};
  return rank[1] < rank[0] || (rank[1] == rank[0] && from[x.twin] < from[x.at]) ? x.twin : x.at;
}

static remap_status make_origins(work *w, int side)
{
  rm_soup *s = w->f.soup;
  int32_t *from, *rank = NULL;

  RM_NEW(from, w->f.arena, w->f.v.num_faces);
  if (s->has_ranks) RM_NEW(rank, w->f.arena, w->f.v.num_faces);
  for (int64_t k = 0, f = 0; k < s->num_faces; f++) {
    const int64_t at = origin_of(s, side, next_face(w, &k));

    from[f] = s->from[side][at];
    if (rank) rank[f] = s->from_rank[side][at];
  }
  w->f.v.face_from[side]      = from;
  w->f.v.face_from_rank[side] = rank;
  free(s->from[side]);
  free(s->from_rank[side]);
  s->from[side]      = NULL;
  s->from_rank[side] = NULL;
  return REMAP_OK;
}

static remap_status make_faces(work *w)
{
  RM_TRY(make_loops(w));
  RM_TRY(make_sides(w));
  for (int side = 0; side < 2; side++) RM_TRY(make_origins(w, side));
  return REMAP_OK;
}

/* ---- one rank ---------------------------------------------------------------------------------------------------- */

static int64_t longest(const remap_supermesh_view *v)
{
  const int64_t n = v->num_faces > v->num_cells ? v->num_faces : v->num_cells;
  return n > v->num_nodes ? n : v->num_nodes;
}

/* Global numbers are places, and all ranks are this one: an array for all of each. */
static remap_status make_trivial(work *w, rm_super *out)
{
  remap_supermesh_view *v = &w->f.v;
  const int64_t         n = longest(v);
  int64_t              *place;
  int32_t              *rank;

  RM_NEW(place, w->f.arena, n);
  RM_NEW0(rank, w->f.arena, n);
  for (int64_t k = 0; k < n; k++) place[k] = k;
  v->node_global = v->face_global = v->cell_global = place;
  v->global_nodes = v->num_nodes;
  v->global_faces = v->num_faces;
  v->global_cells = v->num_cells;
  for (int side = 0; side < 2; side++) v->face_from_rank[side] = out->cell_rank[side] = rank;
  return REMAP_OK;
}

/* ------------------------------------------------------------------------------------------------------------------ */

/* Run a step with working memory of its own. Collective. */
static remap_status in_passing(work *w, remap_status (*step)(work *w, rm_arena *passing))
{
  rm_arena    *passing = rm_arena_new();
  remap_status status  = rm_comm_agree(w->f.job->comm, passing ? REMAP_OK : REMAP_NO_MEMORY, NULL);

  if (status == REMAP_OK) status = step(w, passing);
  rm_arena_drop(passing);
  return status;
}

static remap_status make_room(work *w, rm_arena *passing)
{
  RM_NEW(w->order, passing, w->f.soup->num_faces);
  RM_NEW(w->new_cell, passing, w->f.soup->num_cells);
  RM_NEW(w->cell_at, passing, w->f.soup->num_cells);
  return REMAP_OK;
}

static remap_status make_arrays(work *w, rm_super *out)
{
  if (!w->f.soup->has_ranks) sort_cells(w, NULL);
  RM_TRY(make_cells(w, out));
  RM_TRY(make_faces(w));
  return w->f.soup->has_ranks ? REMAP_OK : make_trivial(w, out);
}

/* Collective. */
static remap_status finish(work *w, rm_arena *passing, rm_super *out)
{
  const rm_comm *comm = w->f.job->comm;

  RM_TRY(rm_super_nodes(&w->f));
  RM_TRY(rm_comm_agree(comm, make_room(w, passing), NULL));
  RM_TRY(rm_comm_agree_reason(comm, join_faces(w), w->f.reason));
  if (w->f.soup->has_ranks) {
    RM_TRY(in_passing(w, number_faces));
    RM_TRY(in_passing(w, number_cells));
  }
  return rm_comm_agree(comm, make_arrays(w, out), NULL);
}

remap_status rm_super_finish(rm_arena *arena, const rm_super_job *job, rm_soup *soup, rm_super *out, rm_reason *reason)
{
  work         w       = {.f = {.arena = arena, .job = job, .soup = soup, .reason = reason}};
  rm_arena    *passing = rm_arena_new();
  remap_status status;

  status = rm_comm_agree(job->comm, passing ? REMAP_OK : REMAP_NO_MEMORY, NULL);
  if (status == REMAP_OK) status = finish(&w, passing, out);
  rm_arena_drop(passing);
  RM_TRY(status);
  RM_TRY(rm_super_beyond(&w.f));
  out->view = w.f.v;
  return REMAP_OK;
}
