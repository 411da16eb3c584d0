/* moments -- volumes and moments of all pairs, from segments and pieces of edges (DESIGN 2.4, 2.6): cell of mesh 1 after cell,
 * sums are taken in doubles (sums.c), where rounding shows once more (again.c), and where a pair's sum is within its rounding,
 * or a skin is near, its polygons are looked at (decide.c, skin.c).
 *
 * Cost: O(sides of polygons), see sums.c. */
#include "moments/moments_private.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- one source cell ------------------------------------------------------------------------------------------------- */

/* The slot's second moments about a point d before its origin, with its first ones m. */
static void shift_second(const slot *s, const double m[3], const double d[3], double second[6])
{
  for (int k = 0; k < 6; k++) {
    const int x = rm_row_of[k], y = rm_column_of[k];
    second[k] = s->sum[4 + k] / 120 + (d[x] * m[y] + d[y] * m[x]) + d[x] * d[y] * (s->sum[0] / 6);
  }
}

/* Room for one more pair. The flags come last: what they have room for, all have. */
static remap_status grow_pairs(work *w)
{
  const int64_t need = w->num_pairs + 1;

  RM_TRY(rm_grow(&w->source, &w->room[0], need, sizeof *w->source));
  RM_TRY(rm_grow(&w->target, &w->room[1], need, sizeof *w->target));
  RM_TRY(rm_grow(&w->volume, &w->room[2], need, sizeof *w->volume));
  RM_TRY(rm_grow(&w->moment, &w->room[3], need, sizeof *w->moment));
  if (w->num_sums == 10) {
    RM_TRY(rm_grow(&w->second, &w->room[5], need, sizeof *w->second));
    RM_TRY(rm_grow(&w->second_back, &w->room[6], need, sizeof *w->second_back));
  }
  return rm_grow(&w->flags, &w->room[4], need, sizeof *w->flags);
}

static remap_status push_pair(work *w, rm_lid i, const slot *s, uint8_t flags)
{
  const double *c = w->part->piece[0].cell_centroid[i];
  const double  v = s->sum[0] / 6, d[3] = {s->o[0] - c[0], s->o[1] - c[1], s->o[2] - c[2]};
  const double  m[3] = {s->sum[1] / 24, s->sum[2] / 24, s->sum[3] / 24};
  const int64_t n = w->num_pairs;

  if (n == w->room[4]) RM_TRY(grow_pairs(w));
  w->source[n] = i;
  w->target[n] = s->target;
  w->volume[n] = v;
  w->flags[n]  = flags;
  for (int k = 0; k < 3; k++) w->moment[n][k] = m[k] + d[k] * v;
  if (w->num_sums == 10) {
    const double *b = w->part->piece[1].cell_centroid[s->target], e[3] = {s->o[0] - b[0], s->o[1] - b[1], s->o[2] - b[2]};
    shift_second(s, m, d, w->second[n]);
    shift_second(s, m, e, w->second_back[n]);
  }
  w->num_pairs++;
  return REMAP_OK;
}

/* Collect the polygons of the slots that want them: all polygons of those in doubt, else those in skins. */
static remap_status collect_polygons(work *w, rm_lid i)
{
  w->skin_only = true;
  for (int k = 0; k < w->num_slots; k++) {
    slot *s = &w->slots[k];
    if (s->first_polygon == NO_POLYGONS || s->kinds & APART || fabs(s->sum[0]) > rm_moments_noise(w, i, s)) continue;
    s->kinds |= IN_DOUBT;
    w->skin_only = false;
  }
  for (int side = 0; side < 2 && !w->limit[side]; side++) RM_NEW0(w->limit[side], w->scratch, w->o->trace[side].num_crossings);
  RM_TRY(rm_moments_no_polygons(w));
  rm_moments_all_sides(w, i, rm_moments_add_polygon);
  w->skin_only = false;
  return w->status;
}

static uint8_t skins_in(work *w, rm_lid i, const slot *s, bool is_flat)
{
  uint8_t flags = 0;

  if (s->kinds & SKIN_SOURCE && rm_moments_skin_passes(w, i, s, 0, is_flat)) flags |= RM_PAIR_SOURCE_SKIN;
  if (s->kinds & SKIN_TARGET && rm_moments_skin_passes(w, i, s, 1, is_flat)) flags |= RM_PAIR_TARGET_SKIN;
  return flags;
}

/* A pair without volume is none; but where one cell is flat, wholly or in part, and in the skin, the other may end there. */
static remap_status drop_pair(work *w, rm_lid i, slot *s)
{
  const uint8_t flags = skins_in(w, i, s, true);

  if (!flags) return REMAP_OK;
  memset(s->sum, 0, sizeof s->sum);
  return push_pair(w, i, s, flags | RM_PAIR_EMPTY);
}

/* The boxes of the two cells meet in a face at most: a cell winds about nothing beyond its box, so the pair has no volume. */
static bool are_apart(const work *w, rm_lid i, rm_lid j)
{
  const double *a = w->o->mesh[0]->cell_box[i], *b = w->o->mesh[1]->cell_box[j];

  return a[0] >= b[3] || a[1] >= b[4] || a[2] >= b[5] || b[0] >= a[3] || b[1] >= a[4] || b[2] >= a[5];
}

/* What must be known of a pair besides its sums. Only where skins pass do cells that are apart need their polygons. */
static void look_closer(work *w, rm_lid i, slot *s, bool *sums, bool *polygons)
{
  const double vi = fabs(w->part->piece[0].cell_volume[i]), vj = fabs(w->part->piece[1].cell_volume[s->target]);
  const double noise = rm_moments_noise(w, i, s);
  const bool   skin  = (s->kinds & (SKIN_SOURCE | SKIN_TARGET)) != 0;

  if (are_apart(w, i, s->target)) s->kinds |= APART;
  else if (noise > 6 * 0x1p-33 * (vi < vj ? vi : vj)) s->kinds |= AGAIN, *sums = true;
  if (skin || (!(s->kinds & APART) && fabs(s->sum[0]) <= noise)) s->first_polygon = WANTS_POLYGONS, *polygons = true;
}

static remap_status finish_cell(work *w, rm_lid i)
{
  bool sums = false, polygons = false;

  for (int k = 0; k < w->num_slots; k++)
    if (rm_part_makes_pair(w->part, i, w->slots[k].target)) look_closer(w, i, &w->slots[k], &sums, &polygons);
  if (sums) RM_TRY(rm_moments_sum_again(w, i));
  if (polygons) RM_TRY(collect_polygons(w, i));
  for (int k = 0; k < w->num_slots; k++) {
    slot *s = &w->slots[k];

    w->slot_of[s->target] = -1;
    if (!rm_part_makes_pair(w->part, i, s->target)) continue;
    if (s->kinds & APART || (s->kinds & IN_DOUBT && !rm_moments_has_volume(w, s)))
      RM_TRY(drop_pair(w, i, s));
    else
      RM_TRY(push_pair(w, i, s, skins_in(w, i, s, false)));
    RM_TRY(w->status);
  }
  w->num_slots = 0;
  return REMAP_OK;
}

/* ---- all of them ------------------------------------------------------------------------------------------------------ */

static remap_status all_cells(work *w)
{
  const rm_trimesh *m1 = w->o->mesh[0];

  RM_TRY(rm_moments_file_pieces(w));
  RM_TRY(rm_moments_ready_sums(w));
  RM_NEW(w->memo, w->scratch, NUM_MEMOS);
  for (int k = 0; k < NUM_MEMOS; k++) w->memo[k].edge = -1;
  RM_NEW(w->wedge_of, w->scratch, m1->num_edges);
  for (rm_lid e = 0; e < m1->num_edges; e++) w->wedge_of[e] = -1;
  for (rm_lid t = 0; t < m1->num_triangles; t++) /* cells by their first triangle: as they lie in space */
    for (int h = 0; h < 2; h++) {
      const rm_lid i = m1->side[t][h];

      if (i < 0 || m1->cell_triangle[m1->cell_triangle_offset[i]] != 2 * t + h) continue;
      RM_TRY(rm_moments_open(w, i));
      RM_TRY(rm_moments_sum(w, i));
      RM_TRY(finish_cell(w, i));
    }
  return REMAP_OK;
}

/* (*data)[place[k]] for all k, in the arena; *data, malloc'ed, is given back. */
INLINE void *kept(rm_arena *arena, void *data, const int64_t *place, int64_t n, size_t size)
{
  char *from, *to = rm_arena_alloc(arena, n, size);

  memcpy(&from, data, sizeof from); /* data points to a pointer of some type */
  for (int64_t k = 0; to && k < n; k++) memcpy(to + (size_t)k * size, from + (size_t)place[k] * size, size);
  free(from);
  memset(data, 0, sizeof from);
  return to;
}

/* The pairs in the order of their sources. */
static remap_status keep(rm_arena *arena, work *w, const rm_moments **out)
{
  const int64_t n = w->num_pairs;
  int64_t      *next, *place;
  rm_moments   *m;

  RM_NEW0(next, w->scratch, (int64_t)w->o->mesh[0]->num_cells + 1);
  RM_NEW(place, w->scratch, n);
  for (int64_t k = 0; k < n; k++) next[w->source[k]]++;
  rm_offsets(next, w->o->mesh[0]->num_cells);
  for (int64_t k = 0; k < n; k++) place[next[w->source[k]]++] = k;
  RM_NEW0(m, arena, 1);
  m->num_pairs = n;
  m->source    = kept(arena, &w->source, place, n, sizeof *w->source);
  m->target    = kept(arena, &w->target, place, n, sizeof *w->target);
  m->volume    = kept(arena, &w->volume, place, n, sizeof *w->volume);
  m->moment    = kept(arena, &w->moment, place, n, sizeof *w->moment);
  m->flags     = kept(arena, &w->flags, place, n, sizeof *w->flags);
  m->second    = w->num_sums == 10 ? kept(arena, &w->second, place, n, sizeof *w->second) : NULL;
  m->second_back = w->num_sums == 10 ? kept(arena, &w->second_back, place, n, sizeof *w->second_back) : NULL;
  if (!m->source || !m->target || !m->volume || !m->moment || !m->flags) return REMAP_NO_MEMORY;
  if (w->num_sums == 10 && (!m->second || !m->second_back)) return REMAP_NO_MEMORY;
  *out = m;
  return REMAP_OK;
}

remap_status rm_moments_build(rm_arena *arena, const rm_part *part, const rm_overlay *overlay, int degree,
                              const rm_moments **out)
{
  work         w = {.part = part, .o = overlay, .scratch = rm_arena_new(), .num_sums = degree == 2 ? 10 : 4};
  remap_status status = w.scratch ? REMAP_OK : REMAP_NO_MEMORY;

  if (status == REMAP_OK) status = all_cells(&w);
  if (status == REMAP_OK) status = keep(arena, &w, out);
  rm_moments_decided(&w);
  free(w.slots);
  free(w.own);
  free(w.wedge);
  free(w.spot);
  free(w.spot_key);
  free(w.segment);
  free(w.cut);
  free(w.cut_key);
  free(w.spots.item);
  free(w.cuts.item);
  free(w.exact);
  free(w.source);
  free(w.target);
  free(w.volume);
  free(w.moment);
  free(w.second);
  free(w.second_back);
  free(w.flags);
  rm_arena_drop(w.scratch);
  return status;
}
