/* gather -- values between the caller's arrays, strided and block by block, and those of a transfer, cell after cell; vectors
 * are turned and systems converted on the way. All fields of a few cells are moved before those of the next: ours stay in the
 * cache meanwhile. O(cells) per field. */
#include "field_private.h"

#include <stdio.h>

/* Cells next to each other, at most FEW, of one block. */
typedef struct strip {
  const rm_layout *layout;
  int              block;
  rm_lid           first, end;
} strip;
enum { FEW = 256 };

/* The strip after s, the first one after {.layout = layout}; false if there is none. */
static bool next_strip(strip *s, rm_lid num_cells)
{
  const int num_blocks = s->layout->num_blocks;
  rm_lid    block_end  = num_blocks > 0 ? s->layout->block_offset[s->block + 1] : num_cells;

  while (s->end == block_end && s->block + 1 < num_blocks) block_end = s->layout->block_offset[++s->block + 1];
  s->first = s->end;
  s->end   = block_end - s->first > FEW ? s->first + FEW : block_end;
  return s->first < s->end;
}

/* Where a field's values stand in its array, which is one per block or one for all. */
typedef struct spots {
  const int64_t *place; /* [cells], NULL: cell i at place i - zero */
  rm_lid         zero;
  int64_t        stride;
} spots;

static spots spots_of(const strip *s, bool is_by_block, int64_t stride)
{
  return (spots){s->layout->place, is_by_block && s->layout->num_blocks > 0 ? s->layout->block_offset[s->block] : 0,
                 stride ? stride : 1};
}
static inline int64_t spot_of(spots s, rm_lid cell) { return (s.place ? s.place[cell] : cell - s.zero) * s.stride; }

/* A field's name for messages. */
typedef struct label {
  char text[64];
} label;

static label label_of(const rm_packing *packing, int f)
{
  label l;

  if (packing->fields[f].name)
    snprintf(l.text, sizeof l.text, "%s", packing->fields[f].name);
  else
    snprintf(l.text, sizeof l.text, "number %d", f);
  return l;
}

static remap_status bad_value(const rm_packing *packing, int f, const rm_mesh *mesh, rm_lid cell, double value,
                              const char *which, rm_reason *reason)
{
  return rm_fail(REMAP_BAD_VALUE, reason, mesh->side, mesh->cell_global[cell], "field %s: %s value %g is not a finite number",
                 label_of(packing, f).text, which, value);
}

/* What is wrong among these values of field f in the cells of a strip, the first of them at x; num_fields from one cell's to
 * the next one's. */
static remap_status bad_values(const rm_packing *packing, int f, const rm_mesh *mesh, const strip *s, const double *x,
                               const char *which, rm_reason *reason)
{
  rm_lid i = s->first;

  while (rm_is_finite(x[(int64_t)(i - s->first) * packing->num_fields])) i++;
  return bad_value(packing, f, mesh, i, x[(int64_t)(i - s->first) * packing->num_fields], which, reason);
}

remap_status rm_gather_given(const rm_transfer_setup *setup, const rm_packing *packing, double *given, rm_reason *reason)
{
  const rm_mesh *mesh  = setup->giving;
  const uint8_t *cover = setup->giving_rows->cover;
  const int      num   = packing->num_fields;

  for (strip s = {.layout = &setup->giving_layout}; next_strip(&s, mesh->num_cells);)
    for (int f = 0; f < num; f++) {
      const remap_field_desc *field = &packing->fields[f];
      const spots             place = spots_of(&s, field->in_block != NULL, field->in_stride);
      const double           *in    = field->in_block ? field->in_block[s.block] : field->in;
      double                 *to = given + (int64_t)s.first * num + f, *at = to;
      bool                    is_good = true;

      for (rm_lid i = s.first; i < s.end; i++, at += num) {
        const double value = cover[i] != REMAP_UNWANTED ? in[spot_of(place, i)] : 0.0;

        *at = value;
        is_good &= rm_is_finite(value);
      }
      if (!is_good && !packing->how->allow_nan) return bad_values(packing, f, mesh, &s, to, "the", reason);
    }
  return REMAP_OK;
}

/* Where the values of a block's receiving cells go. */
static double *out_of(const remap_field_desc *field, int block)
{
  return field->out_block ? field->out_block[block] : field->out;
}

remap_status rm_gather_old(const rm_transfer_setup *setup, const rm_packing *packing, double *value, rm_reason *reason)
{
  const rm_mesh *mesh  = setup->receiving;
  const uint8_t *cover = setup->rows->cover;

  for (strip s = {.layout = &setup->receiving_layout}; next_strip(&s, mesh->num_cells);)
    for (int f = 0; f < packing->num_fields; f++) {
      const remap_field_desc *field = &packing->fields[f];
      const spots             place = spots_of(&s, field->out_block != NULL, field->out_stride);
      const double           *out   = out_of(field, s.block);

      for (rm_lid i = s.first; i < s.end && field->has_old; i++) {
        if (cover[i] == REMAP_COVERED || !rm_keeps_old(packing->how, field, cover[i])) continue;
        const double old = out[spot_of(place, i)];

        if (!rm_is_finite(old) && !packing->how->allow_nan) return bad_value(packing, f, mesh, i, old, "the old", reason);
        value[(int64_t)i * packing->num_fields + f] = old;
      }
    }
  return REMAP_OK;
}

void rm_write_values(const rm_transfer_setup *setup, const rm_packing *packing, const double *value)
{
  const uint8_t *cover = setup->rows->cover;
  const int      num   = packing->num_fields;

  for (strip s = {.layout = &setup->receiving_layout}; next_strip(&s, setup->receiving->num_cells);)
    for (int f = 0; f < num; f++) {
      const remap_field_desc *field = &packing->fields[f];
      const spots             place = spots_of(&s, field->out_block != NULL, field->out_stride);
      double                 *out   = out_of(field, s.block);

      for (rm_lid i = s.first; i < s.end; i++)
        if (cover[i] != REMAP_UNWANTED) out[spot_of(place, i)] = value[(int64_t)i * num + f];
    }
}

/* Turn the vector with these components in all cells; backward the other way. */
static void turn_vector(const rm_transfer_setup *setup, const rm_packing *packing, const int component[3], double *given)
{
  const double *m         = packing->how->rotation;
  const bool    is_source = setup->giving->side == REMAP_SOURCE;

  for (rm_lid c = 0; c < setup->giving->num_cells; c++) {
    double *v = given + (int64_t)c * packing->num_fields, turned[3];

    for (int r = 0; r < 3; r++) {
      turned[r] = 0.0;
      for (int k = 0; k < 3; k++) turned[r] += m[is_source ? 3 * r + k : 3 * k + r] * v[component[k]];
    }
    for (int r = 0; r < 3; r++) v[component[r]] = turned[r];
  }
}

void rm_turn_vectors(const rm_transfer_setup *setup, const rm_packing *packing, double *given)
{
  if (!packing->how->rotation) return;
  for (int s = 0; s < packing->num_systems; s++)
    if (packing->system[s].motion[0] >= 0) turn_vector(setup, packing, packing->system[s].motion, given);
  for (int f = 0; f < packing->num_fields; f++) {
    int component[3] = {f, -1, -1}, num = 1;

    for (int k = f + 1; k < packing->num_fields && num < 3; k++)
      if (packing->fields[f].vector > 0 && packing->fields[k].vector == packing->fields[f].vector) component[num++] = k;
    if (num == 3) turn_vector(setup, packing, component, given); /* only its first component has two more behind it */
  }
}

remap_status rm_gather_numbers(const rm_mesh *mesh, const rm_rows *rows, const rm_packing *packing, const double *given,
                               double *number, rm_reason *reason)
{
  for (rm_lid c = 0; c < mesh->num_cells; c++) {
    const int64_t at  = (int64_t)c * packing->num_fields;
    int           bad = -1;

    if (rows->cover[c] == REMAP_UNWANTED) {
      for (int f = 0; f < packing->num_fields; f++) number[at + f] = given[at + f];
      continue;
    }
    if (!rm_system_numbers(packing, given + at, number + at, &bad))
      return rm_fail(REMAP_BAD_VALUE, reason, mesh->side, mesh->cell_global[c], "field %s: the density %g is not above 0",
                     label_of(packing, bad).text, given[at + bad]);
  }
  return REMAP_OK;
}

remap_status rm_gather_amounts(const rm_transfer_setup *setup, const rm_packing *packing, double *value, double *room,
                               rm_reason *reason)
{
  const rm_mesh *mesh = setup->receiving;
  const int      num  = packing->num_fields;

  for (rm_lid c = 0; c < mesh->num_cells; c++) {
    double *old   = value + (int64_t)c * num;
    bool    mixes = false;
    int     bad   = -1;

    if (setup->rows->cover[c] != REMAP_PARTIAL) continue;
    for (int s = 0; s < packing->num_systems; s++) {
      const int density = packing->system[s].density;

      if (rm_keeps_old(packing->how, &packing->fields[density], REMAP_PARTIAL))
        mixes = true;
      else
        old[density] = 1.0; /* nobody reads it */
    }
    if (!mixes) continue;
    if (!rm_system_numbers(packing, old, room, &bad))
      return rm_fail(REMAP_BAD_VALUE, reason, mesh->side, mesh->cell_global[c], "field %s: the old density %g is not above 0",
                     label_of(packing, bad).text, old[bad]);
    for (int f = 0; f < num; f++)
      old[f] = rm_system_amount(packing, f, old, room); /* those per mass do not read what is done */
  }
  return REMAP_OK;
}

void rm_gather_kept(const rm_transfer_setup *setup, const rm_packing *packing, double *given, double *number)
{
  const rm_mesh *mesh  = setup->receiving;
  const uint8_t *cover = setup->rows->cover;
  const int      num   = packing->num_fields;

  for (strip s = {.layout = &setup->receiving_layout}; next_strip(&s, mesh->num_cells);)
    for (int f = 0; f < num; f++) {
      const remap_field_desc *field   = &packing->fields[f];
      const bool              is_read = rm_is_blended(setup, packing->how, field);
      const spots             place   = spots_of(&s, field->out_block != NULL, field->out_stride);
      const double           *out     = out_of(field, s.block);

      for (rm_lid i = s.first; i < s.end; i++)
        given[(int64_t)i * num + f] = is_read && cover[i] != REMAP_UNWANTED ? out[spot_of(place, i)] : 0.0;
    }
  for (rm_lid c = 0; c < mesh->num_cells && packing->num_systems > 0; c++) {
    int bad;

    if (!rm_system_numbers(packing, given + (int64_t)c * num, number + (int64_t)c * num, &bad))
      for (int f = 0; f < num; f++)
        number[(int64_t)c * num + f] = packing->system_of[f] < 0 ? given[(int64_t)c * num + f] : (double)NAN;
  }
}
