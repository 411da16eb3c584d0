/* smooth -- which cells lie where a field is smooth, for the limiter `auto` (libremap/doc/limiters.md).
 *
 * In smooth parts the difference of two neighbours is what the mean of their slopes says, up to the third order of their
 * distance: to the second at walls and on uneven meshes. At a jump it errs by a part of the jump, about one half. So a cell is
 * as rough as
 *
 *   max over k of |u_k - u - (g + g_k).d_k / 2|  /  max over k of R_k,
 *
 * R_k being the range of values around neighbour k. It is of the first order of the cells' size where the slope is not 0. At
 * smooth extrema numerator and range fall with the square of the size; slopes on uneven meshes err by as much there, and it is
 * that R_k looks one layer farther which keeps the quotient small. Somewhere within two layers of a jump it is 1/4 to 1/2,
 * however small the jump. A cell is smooth if no cell within three layers of neighbours is rougher than a threshold below that:
 * a jump of one and a half cells before a wall looks linear from the wall, and is rough only on its far side.
 *
 * The question needs few digits: slopes and ranges are looked at to 21 bits, so that those of a cell's neighbours take half the
 * memory. In slender cells that are oblique to the axes what a slope across adds along them is wrong by as much: up to aspect
 * ratios of 10^5 that is no roughness. Other ranks' come in one exchange, roughness in three. O(neighbours) per cell and field.
 */
#include "field_private.h"
#include "lanes.h"

#include <string.h>

static const double ROUGH = 0.2;

enum { TWOS = RM_SPAN_FIELDS / 2 };

void rm_smooth_show(const rm_profile *w, const rm_packing *p, const rm_span *span, rm_lid cell)
{
  const int     num    = span->num;
  const double *slope  = rm_pack_of(w, p, cell) + p->at[span->first] + RM_PACK_SLOPE * num;
  const double *bounds = rm_bounds_of(w, p, span, cell);
  uint32_t     *to     = w->shown + ((int64_t)cell * p->num_fields + span->first) * 4;

  for (int f = 0; f < num; f += 2) {
    for (int d = 0; d < 3; d++) rm_lanes_put_halves(rm_lanes_at(slope + d * num + f), num - f, to + d * num + f);
    rm_lanes_put_halves(rm_lanes_at(bounds + num + f) - rm_lanes_at(bounds + f), num - f, to + 3 * num + f);
  }
}

/* Which of the num fields of a span are rough in a cell; twos, half of num, rounded up, is a constant where this is called. */
RM_UNROLLED unsigned rough_fields(const rm_profile *w, const rm_packing *p, const rm_span *span, rm_lid cell, int num, int twos)
{
  const rm_stencil *stencil = w->ground.stencil;
  const rm_mesh    *mesh    = w->ground.mesh;
  const rm_lid      cells   = stencil->num_cells;
  const int64_t     stride  = 4 * (int64_t)p->num_fields;
  const uint32_t   *own     = w->shown + 4 * span->first;
  const uint32_t   *halo    = (const uint32_t *)(const void *)w->slopes.received + 4 * span->first;
  const rm_around   u       = rm_around_span(w, p, span);
  const double     *c       = mesh->cell_centroid[cell];
  const rm_lanes    scale   = rm_lanes_of(RM_VALUE_SCALE);
  rm_lanes          value[TWOS], most[TWOS], widest[TWOS], slope[3][TWOS];
  unsigned          rough = 0;

  for (int t = 0; t < twos; t++) {
    most[t] = widest[t] = rm_lanes_of(0.0);
    value[t]            = scale * rm_lanes_at(u.own + cell * u.stride + 2 * t);
    for (int d = 0; d < 3; d++) slope[d][t] = rm_lanes_from_halves(own + cell * stride + d * num + 2 * t);
  }
  for (int64_t k = stencil->offset[cell], end = stencil->offset[cell + 1]; k < end; k++) {
    const rm_lid    n       = stencil->neighbour[k];
    const bool      is_own  = n < cells;
    const double   *x       = is_own ? mesh->cell_centroid[n] : stencil->halo_centroid[n - cells];
    const double   *there   = is_own ? u.own + n * u.stride : u.halo + (n - cells) * u.stride;
    const uint32_t *other   = is_own ? own + n * stride : halo + (n - cells) * stride;
    const rm_lanes  half[3] = {rm_lanes_of(0.5 * (x[0] - c[0])), rm_lanes_of(0.5 * (x[1] - c[1])),
                               rm_lanes_of(0.5 * (x[2] - c[2]))};

    for (int t = 0; t < twos; t++) {
      rm_lanes wrong = scale * rm_lanes_at(there + 2 * t) - value[t];
      rm_lanes told  = (slope[0][t] + rm_lanes_from_halves(other + 2 * t)) * half[0];

      for (int d = 1; d < 3; d++) told += (slope[d][t] + rm_lanes_from_halves(other + d * num + 2 * t)) * half[d];
      wrong     = rm_lanes_magnitude(wrong - told);
      most[t]   = rm_lanes_greatest(wrong, most[t]);
      widest[t] = rm_lanes_greatest(rm_lanes_from_halves(other + 3 * num + 2 * t), widest[t]);
    }
  }
  for (int f = 0; f < num; f++) rough |= most[f / 2][f % 2] > ROUGH * widest[f / 2][f % 2] ? 1u << f : 0u;
  return rough;
}

/* The same of a span of one field, slopes along x and y side by side. */
static unsigned rough_field(const rm_profile *w, const rm_packing *p, const rm_span *span, rm_lid cell)
{
  const rm_stencil *stencil = w->ground.stencil;
  const rm_mesh    *mesh    = w->ground.mesh;
  const rm_lid      cells   = stencil->num_cells;
  const int64_t     stride  = 4 * (int64_t)p->num_fields;
  const uint32_t   *own     = w->shown + 4 * span->first;
  const uint32_t   *halo    = (const uint32_t *)(const void *)w->slopes.received + 4 * span->first;
  const rm_around   u       = rm_around_span(w, p, span);
  const double     *c = mesh->cell_centroid[cell], value = rm_value_at(&u, cells, cell);
  const rm_lanes    xy = rm_lanes_from_halves(own + cell * stride), zr = rm_lanes_from_halves(own + cell * stride + 2);
  double            most = 0.0, widest = 0.0;

  for (int64_t k = stencil->offset[cell], end = stencil->offset[cell + 1]; k < end; k++) {
    const rm_lid    n        = stencil->neighbour[k];
    const double   *x        = n < cells ? mesh->cell_centroid[n] : stencil->halo_centroid[n - cells];
    const uint32_t *other    = n < cells ? own + n * stride : halo + (n - cells) * stride;
    const rm_lanes  other_zr = rm_lanes_from_halves(other + 2);
    const rm_lanes  told     = (xy + rm_lanes_from_halves(other)) * ((rm_lanes_at(x) - rm_lanes_at(c)) * rm_lanes_of(0.5));
    const double    rest     = (zr[0] + other_zr[0]) * (0.5 * (x[2] - c[2]));
    const double    wrong    = fabs(rm_value_at(&u, cells, n) - value - (told[0] + told[1] + rest));

    most   = wrong > most ? wrong : most;
    widest = other_zr[1] > widest ? other_zr[1] : widest;
  }
  return most > ROUGH * widest;
}

/* Set bits first to first + num - 1. */
static void set_bits(uint64_t *words, int first, int num, unsigned bits)
{
  for (int f = 0; f < num; f++) words[(first + f) / 64] |= (uint64_t)(bits >> f & 1) << (first + f) % 64;
}

void rm_smooth_roughness(const rm_profile *w, const rm_packing *p, uint64_t *rough)
{
  const int    words = rm_rough_words(p->num_fields);
  const rm_lid cells = w->ground.mesh->num_cells;

  memset(rough, 0, (size_t)cells * (size_t)words * sizeof *rough);
  for (rm_lid c = 0; c < cells; c++)
    for (int i = 0; i < p->num_spans; i++) {
      const rm_span *span = &p->span[i];

      if (p->order[span->first] < 2) continue;
      const unsigned bits = span->num > 2   ? rough_fields(w, p, span, c, span->num, TWOS)
                            : span->num > 1 ? rough_fields(w, p, span, c, span->num, 1)
                                            : rough_field(w, p, span, c);

      if (bits) set_bits(rough + (int64_t)c * words, span->first, span->num, bits);
    }
}

static bool is_any(const uint64_t *words, int num)
{
  uint64_t all = 0;

  for (int k = 0; k < num; k++) all |= words[k];
  return all != 0;
}

void rm_smooth_spread(const rm_profile *w, int num_words, const uint64_t *rough, const uint64_t *halo, uint64_t *spread)
{
  const rm_stencil *stencil = w->ground.stencil;
  const rm_lid      cells   = stencil->num_cells;

  memcpy(spread, rough, (size_t)cells * (size_t)num_words * sizeof *spread);
  for (rm_lid c = 0; c < cells; c++) { /* from the rough cells, which are few, but for those that are nobody's neighbour */
    const int64_t   first = stencil->offset[c], end = stencil->offset[c + 1];
    const uint64_t *own = rough + (int64_t)c * num_words;

    if (w->ground.rows->cover[c] != REMAP_UNWANTED && is_any(own, num_words))
      for (int64_t k = first; k < end; k++)
        for (int i = 0; i < num_words && stencil->neighbour[k] < cells; i++)
          spread[(int64_t)stencil->neighbour[k] * num_words + i] |= own[i];
    for (int64_t k = first; k < end && w->needs_halo[c]; k++)
      for (int i = 0; i < num_words && stencil->neighbour[k] >= cells; i++)
        spread[(int64_t)c * num_words + i] |= halo[(int64_t)(stencil->neighbour[k] - cells) * num_words + i];
  }
}
