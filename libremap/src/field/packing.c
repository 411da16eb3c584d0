/* packing -- how much a transfer moves, and where in what travels each number stands. O(fields). */
#include "field_private.h"

bool rm_needs_bounds(const rm_transfer_setup *setup, const remap_transfer *how, int num_fields, const remap_field_desc *fields)
{
  bool normalises = false, has_system = false;

  for (int f = 0; f < num_fields; f++) {
    if (!rm_has_slope(how, &fields[f])) continue;
    has_system |= fields[f].system > 0;
    normalises |= how->on_partial == REMAP_PARTIAL_NORMALISE || (how->on_partial == REMAP_PARTIAL_BLEND && !fields[f].has_old);
  }
  return has_system || how->limiter == REMAP_LIMITER_CAAS ||
         (normalises && how->limiter != REMAP_LIMITER_NONE && setup->any_partial);
}

bool rm_is_blended(const rm_transfer_setup *setup, const remap_transfer *how, const remap_field_desc *field)
{
  return setup->any_partial && how->on_partial == REMAP_PARTIAL_BLEND && field->has_old && rm_has_slope(how, field);
}

/* Is a field the first of its system? */
static bool is_first(const remap_field_desc *fields, int f)
{
  for (int k = 0; k < f; k++)
    if (fields[k].system == fields[f].system) return false;
  return fields[f].system > 0;
}

rm_load rm_load_of(const rm_transfer_setup *setup, const remap_transfer *how, int num_fields, const remap_field_desc *fields)
{
  const bool has_bounds = rm_needs_bounds(setup, how, num_fields, fields);
  rm_load    load       = {.num_fields = num_fields};

  for (int f = 0; f < num_fields; f++) {
    const bool is_sloped = rm_has_slope(how, &fields[f]);

    load.width += rm_pack_width(rm_degree(how, &fields[f]), has_bounds);
    load.num_systems += is_first(fields, f);
    load.has_slopes |= is_sloped;
    load.is_wide |= is_sloped && how->order > 2;
    load.is_curved |= is_sloped && fields[f].system > 0;
    load.is_settled |= is_sloped && how->limiter == REMAP_LIMITER_CAAS;
    load.is_checked |= is_sloped && how->limiter == REMAP_LIMITER_AUTO;
    load.keeps_bounds |= is_sloped && how->limiter == REMAP_LIMITER_AUTO && !has_bounds;
    load.is_blended |= rm_is_blended(setup, how, &fields[f]);
    load.has_nearest |= setup->any_uncovered && rm_needs_nearest(how, &fields[f]);
  }
  return load;
}

static int greater(int a, int b) { return a > b ? a : b; }

rm_load rm_load_max(rm_load a, rm_load b)
{
  return (rm_load){.num_fields  = greater(a.num_fields, b.num_fields),
                   .width       = greater(a.width, b.width),
                   .num_systems = greater(a.num_systems, b.num_systems),
                   .has_slopes  = a.has_slopes || b.has_slopes,
                   .is_settled  = a.is_settled || b.is_settled,
                   .is_checked  = a.is_checked || b.is_checked,
                   .keeps_bounds = a.keeps_bounds || b.keeps_bounds,
                   .is_wide     = a.is_wide || b.is_wide,
                   .is_curved   = a.is_curved || b.is_curved,
                   .is_blended  = a.is_blended || b.is_blended,
                   .has_nearest = a.has_nearest || b.has_nearest};
}

bool rm_load_covers(rm_load a, rm_load b)
{
  return a.num_fields >= b.num_fields && a.width >= b.width && a.num_systems >= b.num_systems && a.has_slopes >= b.has_slopes &&
         a.is_settled >= b.is_settled && a.is_checked >= b.is_checked &&
         a.keeps_bounds >= b.keeps_bounds && a.is_wide >= b.is_wide && a.is_curved >= b.is_curved &&
         a.is_blended >= b.is_blended && a.has_nearest >= b.has_nearest;
}

/* Do two fields next to each other belong in one span? */
static bool are_alike(const rm_packing *p, int f, int g)
{
  return p->degree[f] == p->degree[g] && p->system_of[f] == p->system_of[g];
}

static void find_spans(rm_packing *p)
{
  p->num_spans = p->num_flags = 0;
  for (int f = 0; f < p->num_fields; f++) {
    rm_span *last = p->num_spans > 0 ? &p->span[p->num_spans - 1] : NULL;

    p->num_flags += p->fields[f].nature == REMAP_FLAG;
    if (p->fields[f].nature == REMAP_FLAG) continue;
    if (last && last->first + last->num == f && last->num < RM_SPAN_FIELDS && are_alike(p, last->first, f))
      last->num++;
    else
      p->span[p->num_spans++] = (rm_span){f, 1, p->degree[f]};
  }
}

/* Give num fields from f on, which are alike, their places, behind those before. */
static void lay_out(rm_packing *p, int f, int num)
{
  for (int i = 0; i < num; i++) {
    p->at[f + i]   = p->width + i;
    p->step[f + i] = num;
  }
  p->width += num * rm_pack_width(p->degree[f], p->has_bounds);
}

void rm_packing_fill(rm_packing *p, const rm_transfer_setup *setup, const remap_transfer *how, int num_fields,
                     const remap_field_desc *fields)
{
  p->how        = how;
  p->fields     = fields;
  p->num_fields = num_fields;
  p->is_limited = how->limiter == REMAP_LIMITER_BARTH_JESPERSEN || how->limiter == REMAP_LIMITER_AUTO;
  p->is_checked = how->limiter == REMAP_LIMITER_AUTO;
  p->has_bounds = rm_needs_bounds(setup, how, num_fields, fields);
  p->width      = 0;
  for (int f = 0; f < num_fields; f++) {
    p->order[f]  = rm_has_slope(how, &fields[f]) ? how->order : 1;
    p->degree[f] = rm_degree(how, &fields[f]);
  }
  rm_systems_find(p);
  find_spans(p);
  for (int f = 0, i = 0; f < num_fields; f++) { /* flags stand alone, between spans */
    const bool is_span = i < p->num_spans && p->span[i].first == f;

    lay_out(p, f, is_span ? p->span[i].num : 1);
    if (is_span) f += p->span[i++].num - 1;
  }
}
