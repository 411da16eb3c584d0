/* facets -- see facets.h. O(n) time; 21 bytes per triangle and 8 per panel, and nothing at all where no face is whole. */
#include "overlay/facets.h"

/* ---- joining ----------------------------------------------------------------------------------------------------- */

enum { UNSEEN = -1, ALONE = -2, UNLIKE = -3 }; /* what meets a side of a whole face, if it is not one other such side */

static inline rm_lid side_of(const rm_triple *t) { return 2 * t->face + t->side; }

/* A triangle of a whole face meets a side of another face. */
static void note(rm_facets *f, const rm_triple *t, rm_lid other)
{
  rm_lid *beyond = &f->beyond[side_of(t)];

  if (f->is_whole[t->face]) *beyond = *beyond == UNSEEN || *beyond == other ? other : UNLIKE;
}

remap_status rm_facets_compare(rm_arena *scratch, rm_facets *f, rm_lid num_faces, const rm_triple *triple, int64_t n)
{
  bool joined;

  f->any = false;
  for (rm_lid k = 0; k < num_faces; k++) f->any |= f->is_whole[k];
  if (!f->any) return REMAP_OK;
  RM_NEW(f->beyond, scratch, 2 * (int64_t)num_faces);
  RM_NEW(f->first, scratch, 2 * (int64_t)num_faces);
  for (int64_t k = 0; k < 2 * (int64_t)num_faces; k++) f->beyond[k] = UNSEEN, f->first[k] = -1;
  for (int64_t i = 0; i < n;) {
    const int64_t end = rm_triple_copies(triple, i, n, &joined);

    if (joined) {
      note(f, &triple[i], side_of(&triple[i + 1]));
      note(f, &triple[i + 1], side_of(&triple[i]));
    }
    for (; i < end; i++)
      if (!joined) note(f, &triple[i], ALONE);
  }
  return REMAP_OK;
}

bool rm_facets_admit(const rm_facets *f, const rm_triple *a, const rm_triple *b)
{
  if (!f->is_whole[a->face] && !f->is_whole[b->face]) return true;
  return f->beyond[side_of(a)] == side_of(b) && f->beyond[side_of(b)] == side_of(a);
}

/* ---- facets of triangles ----------------------------------------------------------------------------------------- */

remap_status rm_facets_open(rm_arena *arena, rm_facets *f, int64_t n)
{
  if (!f->any) return REMAP_OK;
  RM_NEW(f->facet, arena, n);
  RM_NEW(f->next, arena, n);
  return REMAP_OK;
}

void rm_facets_add(rm_facets *f, const rm_triple *triple, bool joined, rm_lid t)
{
  rm_lid first = -1;

  for (int h = 0; h <= joined && f->is_whole[triple[h].face]; h++)
    if (f->first[side_of(&triple[h])] >= 0) first = f->first[side_of(&triple[h])] ^ triple[h].right;
  f->facet[t] = first >= 0 ? first : 2 * t;
  f->next[t]  = t;
  for (int h = 0; h <= joined && first < 0; h++) f->first[side_of(&triple[h])] = 2 * t + triple[h].right;
  if (first < 0) return;
  f->next[t]         = f->next[first / 2];
  f->next[first / 2] = t;
}

static double square(const double n[3]) { return n[0] * n[0] + n[1] * n[1] + n[2] * n[2]; }

/* Call every facet by its largest triangle, the lower one of equals. */
static void call_by_largest(const rm_facets *f, const rm_trimesh *m)
{
  for (rm_lid t = 0; t < m->num_triangles; t++) {
    rm_lid largest = t;

    if (f->facet[t] != 2 * t || f->next[t] == t) continue; /* not the one that was first */
    for (rm_lid s = f->next[t]; s != t; s = f->next[s]) {
      const double a = square(m->normal[s]), b = square(m->normal[largest]);
      if (a > b || (a == b && s < largest)) largest = s;
    }
    const rm_lid turned = f->facet[largest] & 1;
    for (rm_lid s = f->next[t]; s != t; s = f->next[s]) f->facet[s] = 2 * largest + ((f->facet[s] & 1) ^ turned);
    f->facet[t] = 2 * largest + turned;
  }
}

/* Bit h: edge h of triangle t belongs to another triangle of its facet, too. */
static uint8_t inner_edges(const rm_facets *f, const rm_trimesh *m, rm_lid t)
{
  const rm_lid *e = m->triangle_edge[t];
  uint8_t       bits = 0;

  for (rm_lid s = f->next[t]; s != t; s = f->next[s])
    for (int h = 0; h < 3; h++) {
      const rm_lid x = m->triangle_edge[s][h];
      bits |= (uint8_t)((e[0] == x) | (e[1] == x) << 1 | (e[2] == x) << 2);
    }
  return bits;
}

/* ---- facets at edges --------------------------------------------------------------------------------------------- */

static remap_status make_rings(rm_arena *arena, rm_trimesh *m)
{
  rm_lid *offset, *ring, n = 0;

  for (rm_lid t = 0; t < m->num_triangles; t++)
    for (int h = 0; h < 3; h++) n += !rm_is_inner(m, t, h);
  RM_NEW(offset, arena, (int64_t)m->num_edges + 1);
  RM_NEW(ring, arena, n);
  n = 0;
  for (rm_lid e = 0; e < m->num_edges; e++) {
    offset[e] = n;
    for (rm_lid k = m->star_offset[e]; k < m->star_offset[e + 1]; k++) {
      const rm_lid t = m->star[k] / 4, facet = rm_facet_of(m, t);
      const int    h = m->star[k] & 3;

      if (!rm_is_inner(m, t, h)) ring[n++] = 4 * (facet / 2) + 2 * ((h == 2) ^ (facet & 1));
    }
  }
  offset[m->num_edges] = n;
  m->ring_offset       = offset;
  m->ring              = ring;
  return REMAP_OK;
}

/* ---- facets of cells --------------------------------------------------------------------------------------------- */

/* The corner of triangle t that is opposite to its edge h. */
static inline int opposite(int h) { return h == 0 ? 2 : h == 1 ? 0 : 1; }

/* The facet of t is of two triangles, which have one edge inside: it has four sides. */
static inline bool is_quadrangle(const rm_trimesh *m, rm_lid t)
{
  const rm_lid s = m->facet_next[t];
  return s != t && m->facet_next[s] == t;
}

/* Corners of a quadrangle called by t, v being those of t; s is its other triangle, w those of s. */
static void corners_of_two(const rm_trimesh *m, rm_lid t, const uint8_t v[3], rm_lid s, const uint8_t w[3], uint8_t out[4])
{
  int h = 0, k = 0, n = 0;

  while (!rm_is_inner(m, t, h)) h++;
  while (!rm_is_inner(m, s, k)) k++;
  for (int c = 0; c < 4; c++) out[c] = c == h + 1 ? w[opposite(k)] : v[n++]; /* the new corner between the ends of edge h */
}

/* Write the panels of cell c from place n on; returns the place behind them. place[triangle] is scratch. */
static rm_lid add_panels(const rm_trimesh *m, rm_lid c, rm_lid n, rm_lid *panel, uint8_t (*corner)[4], rm_lid *place)
{
  const rm_lid first = m->cell_triangle_offset[c], end = m->cell_triangle_offset[c + 1];

  if (m->cell_vertex_offset[c] == m->cell_vertex_offset[c + 1]) return n;
  for (rm_lid a = first; a < end; a++) place[m->cell_triangle[a] / 2] = a;
  for (rm_lid a = first; a < end; a++) {
    const rm_lid   t = m->cell_triangle[a] / 2, s = rm_facet_next(m, t);
    const uint8_t *v = m->cell_triangle_vertex[a];
    const bool     is_part = is_quadrangle(m, t);

    if (is_part && rm_facet_of(m, t) / 2 != t) continue;
    panel[n] = m->cell_triangle[a];
    for (int h = 0; h < 4; h++) corner[n][h] = v[h < 3 ? h : 2];
    if (is_part) corners_of_two(m, t, v, s, m->cell_triangle_vertex[place[s]], corner[n]);
    n++;
  }
  return n;
}

static remap_status make_panels(rm_arena *arena, rm_arena *scratch, rm_trimesh *m)
{
  rm_lid *offset, *panel, *place, n = 0;
  uint8_t(*corner)[4];

  for (rm_lid t = 0; t < m->num_triangles; t++)
    if (!is_quadrangle(m, t) || rm_facet_of(m, t) / 2 == t) n += (m->side[t][0] >= 0) + (m->side[t][1] >= 0);
  RM_NEW(place, scratch, m->num_triangles);
  RM_NEW(offset, arena, (int64_t)m->num_cells + 1);
  RM_NEW(panel, arena, n);
  RM_NEW(corner, arena, n);
  n = 0;
  for (rm_lid c = 0; c < m->num_cells; c++) {
    offset[c] = n;
    n         = add_panels(m, c, n, panel, corner, place);
  }
  offset[m->num_cells] = n;
  m->panel_offset      = offset;
  m->panel             = panel;
  m->panel_corner      = (const uint8_t(*)[4])corner;
  return REMAP_OK;
}

/* ------------------------------------------------------------------------------------------------------------------ */

/* Every triangle a facet of its own. */
static void set_apart(rm_trimesh *m)
{
  m->facet = m->facet_next = NULL;
  m->triangle_inner        = NULL;
  m->panel_corner          = NULL;
  m->panel_offset          = m->cell_triangle_offset;
  m->panel                 = m->cell_triangle;
  m->ring_offset           = m->star_offset;
  m->ring                  = m->star;
}

remap_status rm_facets_finish(rm_arena *arena, rm_arena *scratch, const rm_facets *f, rm_trimesh *m)
{
  uint8_t *inner;

  set_apart(m);
  if (!f->any) return REMAP_OK;
  call_by_largest(f, m);
  RM_NEW(inner, arena, m->num_triangles);
  for (rm_lid t = 0; t < m->num_triangles; t++) inner[t] = inner_edges(f, m, t);
  m->facet          = f->facet;
  m->facet_next     = f->next;
  m->triangle_inner = inner;
  RM_TRY(make_rings(arena, m));
  return make_panels(arena, scratch, m);
}

remap_status rm_trimesh_of_triangles(rm_arena *arena, const rm_trimesh *mesh, const rm_trimesh **out)
{
  rm_trimesh *m;

  RM_NEW(m, arena, 1);
  *m = *mesh;
  set_apart(m);
  *out = m;
  return REMAP_OK;
}
