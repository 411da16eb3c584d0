/* laid -- two test meshes laid over one another on one rank, by the rooms overlay and moments alone: no partition, no messages.
 *
 *   laid *l = laid_over(source, target, REMAP_FACES_CENTRE, NULL);
 *   if (RT_EQ(l->status, REMAP_OK)) ... l->moments, laid_pair(l, i, j) ...
 *   laid_free(l);
 *
 * Cells of a laid mesh are spoken of by their numbers in the test mesh, whatever subset of them was laid and in which
 * numbering. Memory that runs out ends the program. */
#ifndef LAID_H
#define LAID_H

#include "meshes.h"
#include "moments/moments.h"

/* What to do besides. */
typedef struct laid_how {
  const uint8_t *keep[2]; /* [side][cells] 0: this cell stays away; NULL: all take part                               */
  uint64_t       shuffle; /* not 0: cells, faces, nodes, where loops start and which cell owns a face are drawn from it */
  int            senders; /* above 1, with shuffle: cells come from so many ranks, which share neither nodes nor faces  */
  int            degree;  /* of the moments; 0 stands for 1                                                            */
} laid_how;

typedef struct laid {
  remap_status      status;
  rm_reason         reason;
  rm_arena         *arena;
  rm_frame          frame;
  rm_part           part;
  const rm_trimesh *mesh[2];
  const rm_overlay *overlay;
  const rm_moments *moments;
  rm_lid            num[2];   /* cells of the test meshes                                                   */
  rm_lid           *place[2]; /* [side][num] where a cell of the test mesh is in the piece, -1 if it stayed away */
  int64_t          *row;      /* [cells of piece 0 + 1] first pair of a source cell                          */
} laid;

static inline void *laid_get_(rm_arena *arena, int64_t n, size_t size)
{
  void *p = arena ? rm_arena_zero(arena, n, size) : NULL;

  if (!p) abort();
  return p;
}

static inline rm_frame laid_frame_(const tm_mesh *const whole[2])
{
  rm_frame frame = {1, {INFINITY, INFINITY, INFINITY, -INFINITY, -INFINITY, -INFINITY}};
  double   most  = 0;
  int      power = 0;

  for (int side = 0; side < 2; side++)
    for (int64_t k = 0; k < 3 * whole[side]->view.num_nodes; k++) {
      const double x = whole[side]->xyz[k];

      most                 = fmax(most, fabs(x));
      frame.box[k % 3]     = fmin(frame.box[k % 3], x);
      frame.box[k % 3 + 3] = fmax(frame.box[k % 3 + 3], x);
    }
  frexp(most, &power);
  frame.scale = ldexp(1, -power);
  for (int c = 0; c < 6; c++) frame.box[c] *= frame.scale;
  return frame;
}

/* [num_faces] 1 where no cell lies on the other side, be it behind another face of the same coordinates. */
static inline uint8_t *laid_skin_(rm_arena *arena, const tm_mesh *m)
{
  const int64_t n   = m->view.num_faces;
  rm_keyed     *key = laid_get_(arena, n, sizeof *key), *spare = laid_get_(arena, n, sizeof *spare);
  uint8_t      *skin = laid_get_(arena, n, 1);

  for (int64_t f = 0; f < n; f++) {
    key[f].item = f;
    for (int64_t k = m->face_offset[f]; k < m->face_offset[f + 1]; k++)
      key[f].key += rm_hash_point(m->xyz + 3 * m->face_node[k]);
    skin[f] = m->neighbour[f] < 0;
  }
  rm_sort_keyed(key, spare, n);
  for (int64_t k = 0; k + 1 < n; k++)
    if (key[k].key == key[k + 1].key) skin[key[k].item] = skin[key[k + 1].item] = 0;
  return skin;
}

static inline void laid_permute_(rm_lid *list, rm_lid n, uint64_t *seed)
{
  for (rm_lid k = 0; k < n; k++) list[k] = k;
  for (rm_lid k = n - 1; k > 0 && *seed; k--) {
    const rm_lid other = (rm_lid)tm_random(seed, k + 1), x = list[k];

    list[k]     = list[other];
    list[other] = x;
  }
}

/* A face's loop as points in the frame, without points repeated in a row; their number. */
static inline int laid_loop_(const tm_mesh *m, int64_t f, int64_t *node)
{
  int n = 0;

  for (int64_t k = m->face_offset[f]; k < m->face_offset[f + 1]; k++) {
    const int64_t v = m->face_node[k];
    if (n && !memcmp(m->xyz + 3 * v, m->xyz + 3 * node[n - 1], 3 * sizeof(double))) continue;
    node[n++] = v;
  }
  while (n > 1 && !memcmp(m->xyz + 3 * node[0], m->xyz + 3 * node[n - 1], 3 * sizeof(double))) n--;
  return n;
}

typedef struct laid_maker_ {
  laid          *l;
  const tm_mesh *m;
  uint64_t       seed;
  int            senders;
  int           *sender;  /* [cells of the test mesh]        */
  rm_lid        *node_of; /* [senders][nodes] -1 if not used */
  double (*xyz)[3];
  int64_t *offset;
  rm_lid  *face_node, (*face_cell)[2];
  uint8_t *skin;
  rm_lid   num_nodes, num_faces;
} laid_maker_;

/* Add a face with owner and neighbour by their places; the loop points out of the owner. */
static inline void laid_add_face_(laid_maker_ *k, const int64_t *node, int n, rm_lid owner, rm_lid neighbour, int sender,
                                  uint8_t skin)
{
  const bool turned = owner < 0 || (neighbour >= 0 && k->seed && tm_random(&k->seed, 2));
  const int  start  = k->seed ? (int)tm_random(&k->seed, n) : 0;

  for (int h = 0; h < n; h++) {
    const int64_t v     = node[turned ? (n - 1 - h + start) % n : (h + start) % n];
    rm_lid       *local = &k->node_of[sender * k->m->view.num_nodes + v];

    if (*local < 0) {
      *local = k->num_nodes++;
      for (int c = 0; c < 3; c++) k->xyz[*local][c] = k->m->xyz[3 * v + c] * k->l->frame.scale + 0.0;
    }
    k->face_node[k->offset[k->num_faces] + h] = *local;
  }
  k->face_cell[k->num_faces][0] = turned ? neighbour : owner;
  k->face_cell[k->num_faces][1] = turned ? owner : neighbour;
  k->skin[k->num_faces]         = skin;
  k->offset[k->num_faces + 1]   = k->offset[k->num_faces] + n;
  k->num_faces++;
}

/* Add the faces of the cells that have a place, in shuffled order: those between two senders once for each. */
static inline void laid_faces_(laid_maker_ *k, const rm_lid *place)
{
  const rm_lid   faces = (rm_lid)k->m->view.num_faces;
  const uint8_t *skin  = laid_skin_(k->l->arena, k->m);
  rm_lid        *order = laid_get_(k->l->arena, faces, sizeof *order);
  int64_t       *loop  = laid_get_(k->l->arena, k->m->face_offset[faces], sizeof *loop);

  laid_permute_(order, faces, &k->seed);
  for (rm_lid i = 0; i < faces; i++) {
    const rm_lid  f   = order[i];
    const int     len = laid_loop_(k->m, f, loop);
    const int64_t a = k->m->owner[f], b = k->m->neighbour[f];
    const rm_lid  owner = place[a], neighbour = b < 0 ? -1 : place[b];

    if (len < 3) continue;
    if (owner >= 0 && neighbour >= 0 && k->sender[a] == k->sender[b]) {
      laid_add_face_(k, loop, len, owner, neighbour, k->sender[a], skin[f]);
    } else {
      if (owner >= 0) laid_add_face_(k, loop, len, owner, -1, k->sender[a], skin[f]);
      if (neighbour >= 0) laid_add_face_(k, loop, len, -1, neighbour, k->sender[b], skin[f]);
    }
  }
}

static inline void laid_piece_(laid *l, const tm_mesh *m, int side, const laid_how *how)
{
  const rm_lid   num = (rm_lid)m->view.num_cells, faces = (rm_lid)m->view.num_faces;
  const int64_t  corners = m->face_offset[faces];
  const uint8_t *keep = how->keep[side];
  rm_lid        *cells = laid_get_(l->arena, num, sizeof *cells), n = 0;
  laid_maker_    k    = {.l = l, .m = m, .senders = how->shuffle && how->senders > 1 ? how->senders : 1};
  rm_gid        *global;
  rm_lid        *home;
  int           *rank;

  k.seed         = how->shuffle ? how->shuffle + (uint64_t)side : 0;
  k.sender       = laid_get_(l->arena, num, sizeof *k.sender);
  k.node_of      = laid_get_(l->arena, k.senders * m->view.num_nodes, sizeof *k.node_of);
  k.xyz          = laid_get_(l->arena, k.senders * m->view.num_nodes, sizeof *k.xyz);
  k.offset       = laid_get_(l->arena, 2 * (int64_t)faces + 1, sizeof *k.offset);
  k.face_node    = laid_get_(l->arena, 2 * corners, sizeof *k.face_node);
  k.face_cell    = laid_get_(l->arena, 2 * (int64_t)faces, sizeof *k.face_cell);
  k.skin         = laid_get_(l->arena, 2 * (int64_t)faces, 1);
  global         = laid_get_(l->arena, num, sizeof *global);
  home           = laid_get_(l->arena, num, sizeof *home);
  rank           = laid_get_(l->arena, num, sizeof *rank);
  l->num[side]   = num;
  l->place[side] = laid_get_(l->arena, num, sizeof **l->place);
  for (int64_t v = 0; v < k.senders * m->view.num_nodes; v++) k.node_of[v] = -1;
  laid_permute_(cells, num, &k.seed);
  for (rm_lid i = 0; i < num; i++) {
    const rm_lid c = cells[i];

    k.sender[c]       = k.senders > 1 ? (int)tm_random(&k.seed, k.senders) : 0;
    l->place[side][c] = -1;
    if (keep && !keep[c]) continue;
    global[n]         = c;
    home[n]           = c;
    rank[n]           = k.sender[c];
    l->place[side][c] = n++;
  }
  laid_faces_(&k, l->place[side]);
  l->part.piece[side] = (rm_piece){.num_nodes      = k.num_nodes,
                                   .num_faces      = k.num_faces,
                                   .num_cells      = n,
                                   .node_xyz       = (const double(*)[3])k.xyz,
                                   .face_offset    = k.offset,
                                   .face_node      = k.face_node,
                                   .face_cell      = (const rm_lid(*)[2])k.face_cell,
                                   .face_is_skin   = k.skin,
                                   .cell_global    = global,
                                   .cell_home_rank = rank,
                                   .cell_home      = home};
}

/* Volumes and centroids of the cells as they are triangulated, in an order that depends on coordinates alone. */
static inline void laid_measure_(laid *l, int side)
{
  const rm_trimesh *m      = l->mesh[side];
  double           *volume = laid_get_(l->arena, m->num_cells, sizeof *volume);
  double(*centroid)[3]     = laid_get_(l->arena, m->num_cells, sizeof *centroid);

  for (rm_lid c = 0; c < m->num_cells; c++) {
    const double *box    = m->cell_box[c];
    const double  o[3]   = {box[0] + .5 * (box[3] - box[0]), box[1] + .5 * (box[4] - box[1]), box[2] + .5 * (box[5] - box[2])};
    double        sum[4] = {0, 0, 0, 0}, low = 0;

    for (rm_lid a = m->cell_triangle_offset[c]; a < m->cell_triangle_offset[c + 1]; a++) {
      const rm_lid *t    = m->triangle[m->cell_triangle[a] / 2];
      const rm_dd   d    = rm_det_dd(o, m->vertex[t[0]], m->vertex[t[1]], m->vertex[t[2]]);
      const double  sign = m->cell_triangle[a] & 1 ? -1 : 1, old = sum[0], x = sign * d.hi;

      sum[0] += x;
      low += (fabs(old) > fabs(x) ? (old - sum[0]) + x : (x - sum[0]) + old) + sign * d.lo;
      for (int k = 0; k < 3; k++)
        sum[1 + k] += x * (m->vertex[t[0]][k] - o[k] + m->vertex[t[1]][k] - o[k] + m->vertex[t[2]][k] - o[k]);
    }
    sum[0] += low;
    volume[c] = sum[0] / 6;
    for (int k = 0; k < 3; k++) centroid[c][k] = sum[0] != 0 ? o[k] + sum[1 + k] / (4 * sum[0]) : o[k];
  }
  l->part.piece[side].cell_volume   = volume;
  l->part.piece[side].cell_centroid = (const double(*)[3])centroid;
}

/* Lay source and target over one another; how may be NULL. Owned by the caller: laid_free. */
static inline laid *laid_over(const tm_mesh *source, const tm_mesh *target, remap_faces faces, const laid_how *how)
{
  static const laid_how plain    = {{NULL, NULL}, 0, 0, 0};
  const tm_mesh *const  whole[2] = {source, target};
  laid                 *l        = tm_alloc_(1, sizeof *l);

  how       = how ? how : &plain;
  l->arena  = rm_arena_new();
  l->frame  = laid_frame_(whole);
  l->reason = (rm_reason){-1, -1, ""};
  for (int side = 0; side < 2 && l->status == REMAP_OK; side++) {
    laid_piece_(l, whole[side], side, how);
    l->status = rm_trimesh_build(l->arena, &l->frame, &l->part.piece[side], faces, &l->mesh[side]);
    if (l->status == REMAP_OK) l->status = rm_trimesh_check(&l->frame, l->mesh[side]);
    if (l->status == REMAP_OK) laid_measure_(l, side);
  }
  if (l->status == REMAP_OK) l->status = rm_overlay_build(l->arena, l->mesh, &l->part, NULL, &l->overlay, &l->reason);
  if (l->status == REMAP_OK)
    l->status = rm_moments_build(l->arena, &l->part, l->overlay, how->degree ? how->degree : 1, &l->moments);
  if (l->status != REMAP_OK) return l;
  l->row = laid_get_(l->arena, (int64_t)l->part.piece[0].num_cells + 1, sizeof *l->row);
  for (int64_t k = 0; k < l->moments->num_pairs; k++) l->row[l->moments->source[k] + 1] = k + 1;
  for (rm_lid i = 0; i < l->part.piece[0].num_cells; i++)
    if (l->row[i + 1] < l->row[i]) l->row[i + 1] = l->row[i];
  return l;
}

static inline void laid_free(laid *l)
{
  if (!l) return;
  rm_arena_drop(l->arena);
  free(l);
}

/* The pair of cell i of the source and cell j of the target, -1 if they have none. */
static inline int64_t laid_pair(const laid *l, rm_lid i, rm_lid j)
{
  const rm_lid at = l->place[0][i], to = l->place[1][j];

  if (at < 0 || to < 0) return -1;
  for (int64_t k = l->row[at]; k < l->row[at + 1]; k++)
    if (l->moments->target[k] == to) return k;
  return -1;
}

/* What the pair holds, 0 if there is none. */
static inline double laid_volume(const laid *l, rm_lid i, rm_lid j)
{
  const int64_t k = laid_pair(l, i, j);
  return k < 0 ? 0 : l->moments->volume[k];
}

/* Volume of cell c of the test mesh. */
static inline double laid_cell_volume(const laid *l, int side, rm_lid c)
{
  return l->part.piece[side].cell_volume[l->place[side][c]];
}

/* How a cell is covered, as the flags of its pairs say: what the mapping room makes of them. */
static inline remap_cover laid_cover(const laid *l, int side, rm_lid c)
{
  const rm_lid *own   = side == 0 ? l->moments->source : l->moments->target;
  const int     skin  = side == 0 ? RM_PAIR_TARGET_SKIN : RM_PAIR_SOURCE_SKIN;
  remap_cover   cover = REMAP_UNCOVERED;

  for (int64_t k = 0; k < l->moments->num_pairs; k++) {
    if (own[k] != l->place[side][c]) continue;
    if (l->moments->flags[k] & skin) return REMAP_PARTIAL;
    cover = REMAP_COVERED;
  }
  return cover;
}

/* Largest abs(sum of V over a cell's pairs - V_c) / abs(V_c) over the cells of one side that `asked` (NULL: all) names. */
static inline double laid_closure(const laid *l, int side, const uint8_t *asked)
{
  const rm_lid *own   = side == 0 ? l->moments->source : l->moments->target;
  long double  *sum   = laid_get_(l->arena, l->part.piece[side].num_cells, sizeof *sum);
  double        worst = 0;

  for (int64_t k = 0; k < l->moments->num_pairs; k++) sum[own[k]] += (long double)l->moments->volume[k];
  for (rm_lid c = 0; c < l->num[side]; c++) {
    const rm_lid at = l->place[side][c];

    if (at < 0 || (asked && !asked[c])) continue;
    const double v = l->part.piece[side].cell_volume[at], off = fabs((double)(sum[at] - (long double)v)) / fabs(v);
    if (!(off <= worst)) worst = off;
  }
  return worst;
}

#endif
