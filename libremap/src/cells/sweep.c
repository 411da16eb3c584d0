/* sweep -- a line that goes over the edges of a plane graph from left to right, and which edges it meets, from below upwards: a
 * sorted array, searched by halving. Left and right are along the view's first axis, equal places are ordered along its second;
 * edges meet nowhere but at their ends. O(log n) exact signs for each step; entries of the array move, 4 bytes each, for each
 * edge that comes or goes. */
#include "cells/cells_private.h"

#include <string.h>

int rm_sweep_compare(const rm_view *v, rm_lid p, rm_lid q)
{
  const int x = p == q ? 0 : rm_compare(v->l, p, q, v->x);
  return x || p == q ? x : v->flip * rm_compare(v->l, p, q, v->y);
}

static void merge_sort(const rm_view *v, const rm_lid *spot, rm_lid *list, rm_lid *spare, rm_lid n)
{
  const rm_lid half = n / 2;
  rm_lid       i = 0, k = half, m = 0;

  if (n < 2) return;
  merge_sort(v, spot, list, spare, half);
  merge_sort(v, spot, list + half, spare, n - half);
  while (i < half && k < n) spare[m++] = rm_sweep_compare(v, spot[list[k]], spot[list[i]]) < 0 ? list[k++] : list[i++];
  while (i < half) spare[m++] = list[i++];
  memcpy(list, spare, sizeof *list * (size_t)m);
}

remap_status rm_sweep_order(rm_arena *scratch, const rm_view *view, rm_lid n, const rm_lid *spot, rm_lid **list)
{
  rm_lid *spare;

  RM_NEW(*list, scratch, n);
  RM_NEW(spare, scratch, n);
  for (rm_lid k = 0; k < n; k++) (*list)[k] = k;
  merge_sort(view, spot, *list, spare, n);
  return REMAP_OK;
}

/* How many edges are below spot p; those at p come next. */
static rm_lid edges_below(const rm_sweep *s, rm_lid p)
{
  rm_lid low = 0, high = s->num;

  while (low < high) {
    const rm_lid middle = low + (high - low) / 2, *e = s->end[s->list[middle]];
    if (e[0] != p && e[1] != p && rm_turn(s->view, e[0], e[1], p) > 0) low = middle + 1;
    else high = middle;
  }
  return low;
}

rm_lid rm_sweep_below(const rm_sweep *s, rm_lid p)
{
  const rm_lid k = edges_below(s, p);
  return k ? s->list[k - 1] : -1;
}

void rm_sweep_insert(rm_sweep *s, rm_lid edge)
{
  const rm_lid p = s->end[edge][0], q = s->end[edge][1];
  rm_lid       k = edges_below(s, p);

  while (k < s->num) { /* edges at p: those that end there are of no account */
    const rm_lid *e = s->end[s->list[k]];
    if (e[1] != p && (e[0] != p || rm_turn(s->view, p, e[1], q) <= 0)) break;
    k++;
  }
  memmove(s->list + k + 1, s->list + k, sizeof *s->list * (size_t)(s->num - k));
  s->list[k] = edge;
  s->num++;
}

bool rm_sweep_remove(rm_sweep *s, rm_lid edge)
{
  const rm_lid p = s->end[edge][1];
  rm_lid       k = edges_below(s, p);

  while (k < s->num && s->list[k] != edge && (s->end[s->list[k]][0] == p || s->end[s->list[k]][1] == p)) k++;
  if (k == s->num || s->list[k] != edge) return false;
  s->num--;
  memmove(s->list + k, s->list + k + 1, sizeof *s->list * (size_t)(s->num - k));
  return true;
}

/* ---- what is below a spot ---------------------------------------------------------------------------------------- */

/* Sweep over all ends of edges; event 2 k is the left end of edge k, 2 k + 1 its right end, beyond them are queries. */
static bool sweep_all(rm_sweep *s, rm_lid num_edges, const rm_lid *spot, rm_lid n, const rm_lid *list, rm_lid *below)
{
  for (rm_lid i = 0, next; i < n; i = next) {
    for (next = i; next < n && spot[list[next]] == spot[list[i]]; next++)
      if (list[next] < 2 * num_edges && (list[next] & 1) && !rm_sweep_remove(s, list[next] / 2)) return false;
    for (rm_lid k = i; k < next; k++)
      if (list[k] >= 2 * num_edges) below[list[k] - 2 * num_edges] = rm_sweep_below(s, spot[list[k]]);
    for (rm_lid k = i; k < next; k++)
      if (list[k] < 2 * num_edges && !(list[k] & 1)) rm_sweep_insert(s, list[k] / 2);
  }
  return true;
}

remap_status rm_edges_below(rm_arena *scratch, const rm_view *view, rm_lid num_edges, const rm_lid (*edge)[2], rm_lid num,
                            const rm_lid *query, rm_lid *below)
{
  const rm_lid n = 2 * num_edges + num;
  rm_lid      *spot, *list;
  rm_lid     (*end)[2];
  rm_sweep     s = {.view = view};

  RM_NEW(end, scratch, num_edges);
  RM_NEW(s.list, scratch, num_edges);
  RM_NEW(spot, scratch, n);
  for (rm_lid k = 0; k < num_edges; k++) {
    const int turned = rm_sweep_compare(view, edge[k][0], edge[k][1]) > 0;
    for (int h = 0; h < 2; h++) spot[2 * k + h] = end[k][h] = edge[k][h ^ turned];
  }
  for (rm_lid k = 0; k < num; k++) spot[2 * num_edges + k] = query[k];
  s.end = (const rm_lid (*)[2])end;
  RM_TRY(rm_sweep_order(scratch, view, n, spot, &list));
  return sweep_all(&s, num_edges, spot, n, list, below) ? REMAP_OK : REMAP_BAD_MESH;
}
