/* overlay -- traces both meshes through each other and pairs the ends of segments (DESIGN 2.3).
 *
 * A segment is where facet t of mesh 1 meets facet b of mesh 2. Its ends are crossings of an edge of one with the other; each
 * crossing ends one segment for every facet at its edge. Ends are filed under t by counting and sorted by b: O(ends), 8 bytes
 * each, for the ends of one facet are few. */
#include "overlay/overlay.h"

#include <string.h>
#include "overlay/trace.h"

enum { MAX_CROSSINGS = 1 << 30 };

/* +1 if the boundary of the facet of a ring entry runs along the edge. */
static inline int along(rm_lid ring) { return ring & 2 ? -1 : 1; }

/* An end as a word: words ascend as ends are to stand. */
#define LAST (UINT64_C(1) << 31)
static inline uint64_t end_word(rm_lid other, int64_t crossing, int side, bool is_last)
{
  return (uint64_t)(uint32_t)other << 32 | (is_last ? LAST : 0) | (uint64_t)(2 * crossing + side);
}

/* Of all segments in a facet of mesh 1, the ends as words. */
static remap_status file_ends(rm_arena *arena, rm_overlay *o, uint64_t **out)
{
  const rm_trimesh *m1 = o->mesh[0], *m2 = o->mesh[1];
  const rm_trace   *t1 = &o->trace[0], *t2 = &o->trace[1];
  int64_t          *offset;
  uint64_t         *end;

  RM_NEW0(offset, arena, (int64_t)m1->num_triangles + 2);
  for (rm_lid e = 0; e < m1->num_edges; e++)
    for (rm_lid k = m1->ring_offset[e]; k < m1->ring_offset[e + 1]; k++) offset[m1->ring[k] / 4 + 2] += t1->count[e];
  for (rm_lid f = 0; f < m2->num_edges; f++) {
    const rm_lid at_edge = m2->ring_offset[f + 1] - m2->ring_offset[f];
    for (int64_t x = t2->first[f]; x < t2->first[f] + t2->count[f]; x++) offset[t2->crossing[x].triangle / 2 + 2] += at_edge;
  }
  for (rm_lid t = 0; t < m1->num_triangles; t++) offset[t + 2] += offset[t + 1];
  RM_NEW(end, arena, offset[m1->num_triangles + 1]);
  for (rm_lid e = 0; e < m1->num_edges; e++)
    for (int64_t x = t1->first[e]; x < t1->first[e] + t1->count[e]; x++) {
      const rm_lid b = t1->crossing[x].triangle / 2;
      const int    s = t1->crossing[x].triangle & 1 ? -1 : 1;
      for (rm_lid k = m1->ring_offset[e]; k < m1->ring_offset[e + 1]; k++)
        end[offset[m1->ring[k] / 4 + 1]++] = end_word(b, x, 0, along(m1->ring[k]) * s < 0);
    }
  for (rm_lid f = 0; f < m2->num_edges; f++)
    for (int64_t x = t2->first[f]; x < t2->first[f] + t2->count[f]; x++) {
      const rm_lid t = t2->crossing[x].triangle / 2;
      const int    s = t2->crossing[x].triangle & 1 ? -1 : 1;
      for (rm_lid k = m2->ring_offset[f]; k < m2->ring_offset[f + 1]; k++)
        end[offset[t + 1]++] = end_word(m2->ring[k] / 4, x, 1, along(m2->ring[k]) * s > 0);
    }
  o->end_offset = offset;
  *out          = end;
  return REMAP_OK;
}

/* Sort the ends of every facet, by the other facet and starts first, and make of their words what they are: in place.
 * False if one segment has not exactly one start and one end, *bad is then its triangle. */
static bool pair_ends(const rm_overlay *o, uint64_t *word, rm_lid *bad)
{
  for (rm_lid t = 0; t < o->mesh[0]->num_triangles; t++) {
    const int64_t first = o->end_offset[t], last = o->end_offset[t + 1];

    *bad = t;
    if ((last - first) & 1) return false;
    rm_sort_words(word + first, last - first);
    for (int64_t i = first; i < last; i += 2) {
      if (word[i] >> 32 != word[i + 1] >> 32 || word[i] & LAST || !(word[i + 1] & LAST)) return false;
      if (i + 2 < last && word[i + 2] >> 32 == word[i] >> 32) return false;
    }
    for (int64_t i = first; i < last; i++) {
      const rm_end end = {(rm_lid)(word[i] >> 32), (uint32_t)word[i] << 1 | (word[i] & LAST ? 1 : 0)};
      memcpy(&word[i], &end, sizeof end);
    }
  }
  return true;
}

/* Global id of a cell beside a triangle. */
static rm_gid cell_beside(const rm_trimesh *m, const rm_piece *piece, rm_lid t)
{
  const rm_lid c = m->side[t][0] >= 0 ? m->side[t][0] : m->side[t][1];
  return c >= 0 ? piece->cell_global[c] : -1;
}

static remap_status overlay(rm_arena *arena, rm_overlay *o, const rm_part *part, bool by_tree, const rm_progress *progress,
                            rm_reason *reason)
{
  rm_lid    bad = 0;
  uint64_t *word;

  for (int side = 0; side < 2; side++) {
    const rm_trimesh  *m = o->mesh[side];
    const remap_status status =
        rm_trace_build(arena, m, o->mesh[1 - side], side == 0 ? 1 : -1, by_tree, progress, &o->trace[side], &bad);
    if (status == REMAP_INCONSISTENT)
      return rm_fail(
          status, reason, side, cell_beside(m, &part->piece[side], m->star[m->star_offset[bad]] / 4),
          "an edge of this cell arrives in another cell of the other mesh than its neighbours do; please report both meshes");
    RM_TRY(status);
    if (o->trace[side].num_crossings > MAX_CROSSINGS) return REMAP_TOO_LARGE;
  }
  RM_TRY(file_ends(arena, o, &word));
  if (!pair_ends(o, word, &bad))
    return rm_fail(REMAP_INCONSISTENT, reason, REMAP_SOURCE, cell_beside(o->mesh[0], &part->piece[0], bad),
                   "a face of this cell meets the other mesh in a segment without two ends; please report both meshes");
  o->end = (const rm_end *)(const void *)word; /* that is what it holds by now */
  return REMAP_OK;
}

/* Walking by adjacency rests on the mesh being embedded where its cells are not flagged. Should a mesh be tangled in a way that
 * the flags miss, a check fails, and everything is taken from the box tree, which rests on nothing. */
remap_status rm_overlay_build(rm_arena *arena, const rm_trimesh *const mesh[2], const rm_part *part,
                              const rm_progress *progress, const rm_overlay **out, rm_reason *reason)
{
  rm_overlay  *o;
  remap_status status;

  RM_NEW0(o, arena, 1);
  for (int side = 0; side < 2; side++) o->mesh[side] = mesh[side];
  status = overlay(arena, o, part, false, progress, NULL);
  if (status == REMAP_INCONSISTENT) status = overlay(arena, o, part, true, progress, reason);
  if (status == REMAP_TOO_LARGE)
    return rm_fail(status, reason, -1, -1, "a rank has more entities than it can count; use more ranks");
  if (status == REMAP_OK) *out = o;
  return status;
}
