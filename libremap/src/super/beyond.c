/* beyond -- faces with one cell here and one on another rank: each goes to the rank that looks after its number, where the two
 * halves meet. O(n) for n such faces, and those of the boundary; 32 bytes for each on its way. */
#include "super/super_private.h"

/* A face that has one cell on a rank. */
typedef struct half {
  int64_t face, cell;
  int64_t name; /* rm_cell_name                                                                        */
  int64_t way;  /* in which it runs there, from its least node to the lesser of its neighbours: +1, -1 */
} half;

static int keeper_of(int64_t face, int size) { return (int)((uint64_t)face % (uint64_t)size); }

static half half_of(const remap_supermesh_view *v, int64_t f)
{
  const int32_t *loop = v->face_node + v->face_offset[f], *last = v->face_node + v->face_offset[f + 1] - 1;
  const int32_t  cell = v->face_owner[f];

  return (half){v->face_global[f], v->cell_global[cell], rm_cell_name(v->cell_ancestor, cell), loop[1] < *last ? 1 : -1};
}

/* Faces with one cell here, by their keepers. */
static remap_status collect_halves(const rm_finish *w, rm_arena *passing, int64_t **offset, half **list, rm_lid **face)
{
  const remap_supermesh_view *v    = &w->v;
  const int                   size = w->job->comm->size;
  int64_t                    *next, num = 0;

  RM_NEW0(next, passing, (int64_t)size + 2);
  for (int64_t f = 0; f < v->num_faces; f++)
    if (v->face_neighbour[f] < 0) next[keeper_of(v->face_global[f], size) + 1]++, num++;
  rm_offsets(next + 1, size);
  RM_NEW(*list, passing, num);
  RM_NEW(*face, passing, num);
  for (int64_t f = 0; f < v->num_faces; f++) {
    if (v->face_neighbour[f] >= 0) continue;
    const int64_t at = next[keeper_of(v->face_global[f], size) + 1]++;
    (*list)[at]      = half_of(v, f);
    (*face)[at]      = (rm_lid)f;
  }
  *offset = next; /* each rank's end is the next one's begin */
  return REMAP_OK;
}

/* To each of n halves the cell of the other half of its face, -1 if there is none. */
static remap_status pair_halves(const rm_finish *w, rm_arena *passing, int64_t n, const half *list, int64_t **out)
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
      return rm_super_tangled(w, list[key[k].item].name);
    for (int64_t i = k; i < next; i++) other[key[i].item] = next == k + 2 ? list[key[i == k ? k + 1 : k].item].cell : -1;
  }
  *out = other;
  return REMAP_OK;
}

static remap_status keep_beyond(rm_finish *w, rm_arena *passing, int64_t n, const rm_lid *face, const int64_t *other)
{
  int64_t *cell_of, *cell, num = 0;
  int32_t *list;

  for (int64_t k = 0; k < n; k++) num += other[k] >= 0;
  RM_NEW(list, w->arena, num);
  RM_NEW(cell, w->arena, num);
  RM_NEW(cell_of, passing, w->v.num_faces);
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

/* Collective. */
static remap_status beyond(rm_finish *w, rm_arena *passing)
{
  const rm_comm *comm = w->job->comm;
  int64_t       *offset = NULL, *arrives = rm_arena_alloc(passing, (int64_t)comm->size + 1, sizeof *arrives), *other = NULL;
  int64_t       *returns = rm_arena_alloc(passing, (int64_t)comm->size + 1, sizeof *returns);
  half          *list = NULL;
  rm_lid        *face = NULL;
  void          *halves, *answers;
  remap_status   mine = arrives && returns ? REMAP_OK : REMAP_NO_MEMORY;

  if (mine == REMAP_OK) mine = collect_halves(w, passing, &offset, &list, &face);
  RM_TRY(rm_comm_agree(comm, mine, NULL));
  RM_TRY(rm_comm_exchange(comm, passing, sizeof *list, offset, list, arrives, &halves));
  RM_TRY(rm_comm_agree_reason(comm, pair_halves(w, passing, arrives[comm->size], halves, &other), w->reason));
  RM_TRY(rm_comm_exchange(comm, passing, sizeof *other, arrives, other, returns, &answers));
  return rm_comm_agree(comm, keep_beyond(w, passing, returns[comm->size], face, answers), NULL);
}

remap_status rm_super_beyond(rm_finish *w)
{
  rm_arena    *passing = rm_arena_new();
  remap_status status  = rm_comm_agree(w->job->comm, passing ? REMAP_OK : REMAP_NO_MEMORY, NULL);

  if (status == REMAP_OK && w->job->comm->size > 1) status = beyond(w, passing);
  rm_arena_drop(passing);
  return status;
}
