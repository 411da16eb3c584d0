/* sides -- the sides of the polygons that bound what cell i of mesh 1 has in common with the cells of mesh 2 (DESIGN 2.4):
 * segments and pieces of edges, by labels alone. sums.c adds up the same sides in its own way, where every cycle counts.
 *
 * O(crossings of the cell's edges and facets); the pieces of edges of mesh 2 are filed under the cells once, by counting. */
#include "moments/moments_private.h"

/* ---- the cell's own facets and edges --------------------------------------------------------------------------------- */

static plane plane_of(const work *w, int mesh, rm_lid t)
{
  const rm_trimesh *m = w->o->mesh[mesh];
  return (plane){mesh, t, m->normal[t], m->vertex[m->triangle[t][0]]};
}

/* Facet t of cell i, which is its right one or not. Written where it stays: a copy would wait for its parts. */
INLINE void set_own(const work *w, rm_lid t, bool is_right, own_facet *f)
{
  const rm_trimesh *m = w->o->mesh[0];

  f->in.mesh     = 0;
  f->in.triangle = t;
  f->in.n        = m->normal[t];
  f->in.v        = m->vertex[m->triangle[t][0]];
  f->outward     = is_right ? -1 : 1;
  f->height      = rm_moments_foot(f->in.n, f->in.v, w->centre, f->foot);
}

/* Edge e of cell i bounds its facet of that number, whose boundary, seen from outside of the cell, runs along it or against it.
 * An edge has one facet each way nearly always: these two are one wedge. */
static remap_status add_to_wedge(work *w, rm_lid e, int number, bool against)
{
  const int k = w->wedge_of[e];

  if (k < 0 || w->wedge[k].facet[against] >= 0) {
    RM_TRY(rm_grow(&w->wedge, &w->wedge_room, w->num_wedges + 1, sizeof *w->wedge));
    w->wedge[w->num_wedges]                = (wedge){e, {-1, -1}};
    w->wedge[w->num_wedges].facet[against] = number;
    w->wedge_of[e]                         = w->num_wedges++;
  } else {
    w->wedge[k].facet[against] = number;
  }
  return REMAP_OK;
}

remap_status rm_moments_open(work *w, rm_lid i)
{
  const rm_trimesh *m   = w->o->mesh[0];
  const double     *box = m->cell_box[i];

  w->extent = rm_max(box[3] - box[0], rm_max(box[4] - box[1], box[5] - box[2]));
  for (int c = 0; c < 3; c++) w->centre[c] = box[c] + 0.5 * (box[c + 3] - box[c]);
  w->num_own = w->num_wedges = 0;
  for (rm_lid a = m->cell_triangle_offset[i]; a < m->cell_triangle_offset[i + 1]; a++) {
    const rm_lid facet = m->cell_triangle[a] / 2, is_right = m->cell_triangle[a] & 1;
    rm_lid       t     = facet;

    if (rm_facet_of(m, facet) / 2 != facet) continue;
    RM_TRY(rm_grow(&w->own, &w->own_room, w->num_own + 1, sizeof *w->own));
    set_own(w, facet, is_right, &w->own[w->num_own]);
    do {
      for (int h = 0; h < 3; h++)
        if (!rm_is_inner(m, t, h))
          RM_TRY(add_to_wedge(w, m->triangle_edge[t][h], w->num_own, (h == 2) ^ (rm_facet_of(m, t) & 1) ^ is_right));
      t = rm_facet_next(m, t);
    } while (t != facet);
    w->num_own++;
  }
  for (int k = 0; k < w->num_wedges; k++) w->wedge_of[w->wedge[k].edge] = -1;
  return REMAP_OK;
}

/* ---- pieces of edges of mesh 2 --------------------------------------------------------------------------------------- */

remap_status rm_moments_file_pieces(work *w)
{
  const rm_trace *t = &w->o->trace[1];
  const rm_lid    ne = w->o->mesh[1]->num_edges, nc = w->o->mesh[0]->num_cells;

  RM_NEW0(w->piece_offset, w->scratch, (int64_t)nc + 2);
  for (int pass = 0; pass < 2; pass++) {
    for (rm_lid f = 0; f < ne; f++) {
      if (t->count[f] == 0 && t->state[f] == RM_OUTSIDE) continue;
      for (rm_lid k = 0; k <= t->count[f]; k++) {
        const rm_lid     state = k ? t->crossing[t->first[f] + k - 1].state : t->state[f];
        const rm_winding one   = {state, 1};
        const rm_winding *list = state < RM_OUTSIDE ? t->winding + t->list_offset[-2 - state] : &one;
        const rm_lid      n    = state < RM_OUTSIDE ? t->list_offset[-1 - state] - t->list_offset[-2 - state] : state >= 0;
        for (rm_lid z = 0; z < n; z++) {
          if (pass == 0) {
            w->piece_offset[list[z].cell + 2]++;
          } else {
            rm_lid *piece = w->piece[w->piece_offset[list[z].cell + 1]++];
            piece[0] = f, piece[1] = k;
          }
        }
      }
    }
    if (pass == 0) {
      for (rm_lid i = 0; i < nc; i++) w->piece_offset[i + 2] += w->piece_offset[i + 1];
      RM_NEW(w->piece, w->scratch, w->piece_offset[nc + 1]);
    }
  }
  return REMAP_OK;
}

/* ---- sides ----------------------------------------------------------------------------------------------------------- */

void rm_moments_set_crossing(const work *w, int mesh, int64_t crossing, point *p)
{
  const rm_trimesh  *m = w->o->mesh[mesh];
  const rm_crossing *x = &w->o->trace[mesh].crossing[crossing];
  const double      *v = m->vertex[m->edge[x->edge][0]], *u = m->vertex[m->edge[x->edge][1]];

  p->base = v;
  for (int c = 0; c < 3; c++) p->delta[c] = x->lambda * (u[c] - v[c]);
  p->mesh     = mesh;
  p->edge     = x->edge;
  p->triangle = x->triangle / 2;
  p->crossing = crossing;
}

void rm_moments_set_point(const work *w, int mesh, rm_lid e, rm_lid k, point *p)
{
  const rm_trimesh *m  = w->o->mesh[mesh];
  const rm_trace   *tr = &w->o->trace[mesh];

  if (k == 0) *p = (point){m->vertex[m->edge[e][0]], {0, 0, 0}, 0, -1, -1, -1};
  else if (k > tr->count[e]) *p = (point){m->vertex[m->edge[e][1]], {0, 0, 0}, 0, -1, -1, -1};
  else rm_moments_set_crossing(w, mesh, tr->first[e] + k - 1, p);
}

/* Segments in a facet of cell i. */
static void segments_in(work *w, const own_facet *ft, sink *add_side)
{
  const rm_overlay *o    = w->o;
  const bool        skin = o->mesh[0]->triangle_is_skin[ft->in.triangle];

  for (int64_t k = o->end_offset[ft->in.triangle]; k < o->end_offset[ft->in.triangle + 1]; k += 2) {
    const rm_end start = o->end[k], end = o->end[k + 1];
    const rm_lid b     = start.other;
    if (w->skin_only && !skin && !o->mesh[1]->triangle_is_skin[b]) continue;
    const plane  pb    = plane_of(w, 1, b);
    point        p, q;

    rm_moments_set_crossing(w, start.at >> 1 & 1, start.at >> 2, &p);
    rm_moments_set_crossing(w, end.at >> 1 & 1, end.at >> 2, &q);
    add_side(w, o->mesh[1]->side[b], ft->outward, &ft->in, &pb, &p, &q);
  }
}

/* Piece k of edge e, and those behind it that count as one with it. */
static void tangled_pieces(work *w, rm_lid e, rm_lid k, double sign, const plane *pl, const plane *other, sink *add_side)
{
  const rm_trace   *tr    = &w->o->trace[0];
  const rm_lid      state = piece_state(tr, e, k);
  const rm_winding  one   = {state, 1};
  const rm_winding *list  = state < RM_OUTSIDE ? tr->winding + tr->list_offset[-2 - state] : &one;
  const rm_lid      n     = state < RM_OUTSIDE ? tr->list_offset[-1 - state] - tr->list_offset[-2 - state] : state >= 0;
  point             p, q;

  rm_moments_set_point(w, 0, e, k, &p);
  for (rm_lid z = 0; z < n; z++) {
    const rm_lid in[2] = {list[z].cell, RM_OUTSIDE}, end = run_end(tr, e, k, in[0], list[z].number);

    if (end == k) continue;
    rm_moments_set_point(w, 0, e, end, &q);
    add_side(w, in, sign * list[z].number, pl, other, &p, &q);
  }
}

/* Pieces of an edge of cell i, which bound polygons of its facets in the cells of mesh 2. */
static void pieces_at(work *w, const wedge *at, sink *add_side)
{
  const uint8_t *skin   = w->o->mesh[0]->triangle_is_skin;
  const plane   *along  = at->facet[0] >= 0 ? &w->own[at->facet[0]].in : NULL;
  const plane   *second = at->facet[1] >= 0 ? &w->own[at->facet[1]].in : NULL;
  const plane   *pl     = along ? along : second, *other = along ? second : NULL;

  if (w->skin_only && !(skin[pl->triangle] || (other && skin[other->triangle]))) return;
  for (rm_lid k = 0; k <= w->o->trace[0].count[at->edge]; k++)
    tangled_pieces(w, at->edge, k, along ? 1 : -1, pl, other, add_side);
}

/* Pieces of edges of mesh 2 inside cell i. */
static void foreign_pieces(work *w, rm_lid i, sink *add_side)
{
  const rm_trimesh *m  = w->o->mesh[1];
  const rm_trace   *tr = &w->o->trace[1];

  for (int64_t k = w->piece_offset[i]; k < w->piece_offset[i + 1]; k++) {
    const rm_lid f = w->piece[k][0], at = w->piece[k][1];
    const int    number = piece_number(tr, f, at, i);
    const rm_lid end    = run_end(tr, f, at, i, number);
    point        p, q;

    if (end == at) continue;
    rm_moments_set_point(w, 1, f, at, &p);
    rm_moments_set_point(w, 1, f, end, &q);
    for (rm_lid z = m->ring_offset[f]; z < m->ring_offset[f + 1]; z++) {
      const rm_lid b  = m->ring[z] / 4;
      if (w->skin_only && !m->triangle_is_skin[b]) continue;
      const plane  pb = plane_of(w, 1, b);

      add_side(w, m->side[b], m->ring[z] & 2 ? -number : number, &pb, NULL, &p, &q);
    }
  }
}

void rm_moments_all_sides(work *w, rm_lid i, sink *add_side)
{
  for (int k = 0; k < w->num_own; k++) segments_in(w, &w->own[k], add_side);
  for (int k = 0; k < w->num_wedges; k++) pieces_at(w, &w->wedge[k], add_side);
  foreign_pieces(w, i, add_side);
}
