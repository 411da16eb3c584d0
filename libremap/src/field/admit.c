/* admit -- slopes of systems are scaled until every receiving cell's state can be: density and internal energy stay positive,
 * amounts per mass within the bounds around the givers.
 *
 * Such states form a convex cone in mass, momentum, total energy and amounts (internal energy is a concave function of them, of
 * degree 1). So a giving cell whose every pair has content in the cone can do no harm; without slopes it is so. Whoever gives
 * to a receiving cell whose sum is not in the cone is scaled by the greatest factor that brings all its pairs into it; that
 * changes what its other receivers get, so the rounds go on until nothing is refused. A cell is scaled once, hence they end; a
 * round is two exchanges with neighbours and a reduction. Content stays, since a factor of all slopes of a cell keeps its mean,
 * and what is uniform per mass, since it is the same factor for all. O(pairs) per round and system. */
#include "field_private.h"

static const double LEAST_PART    = 0.1;     /* of the least density and internal energy around                */
static const double SLACK_RECEIVE = 0x1p-43; /* what rounding may take of amounts per mass: about 1e-13        */
static const double SLACK_GIVE    = 0x1p-44; /* less, so that a sum of what givers may give is not refused     */

void rm_limits_clear(const rm_packing *packing, rm_limits limits)
{
  for (int f = 0; f < packing->num_fields; f++) {
    limits.least[f]    = INFINITY;
    limits.greatest[f] = -INFINITY;
  }
}

void rm_limits_add(const rm_packing *packing, const double *place, rm_limits limits)
{
  for (int f = 0; f < packing->num_fields; f++) {
    double bounds[2];

    if (packing->system_of[f] < 0) continue;
    rm_pack_read(packing, f, place, RM_PACK_BOUNDS, 2, bounds);
    const double least = bounds[0] / RM_VALUE_SCALE, greatest = bounds[1] / RM_VALUE_SCALE;
    limits.least[f]    = least < limits.least[f] ? least : limits.least[f]; /* not by fmin, which is a call */
    limits.greatest[f] = greatest > limits.greatest[f] ? greatest : limits.greatest[f];
  }
}

/* Is a field bounded on both sides? */
static bool is_bounded(const rm_packing *p, int f, int s)
{
  return p->system_of[f] == s && f != p->system[s].density && f != p->system[s].energy;
}

/* A part of the least internal energy around: in a volume and per mass, of which one is 0. None if neither is above 0: then
 * what is given is not positive itself. */
typedef struct lowest {
  double fixed, per_mass;
} lowest;

static lowest floor_of(const rm_packing *p, int system, double volume, rm_limits limits, double part)
{
  const int energy = p->system[system].energy;

  if (energy < 0) return (lowest){0.0, 0.0};
  if (rm_system_is_energy_per_mass(p, system)) return (lowest){0.0, part * limits.least[energy]};
  return (lowest){part * RM_VALUE_SCALE * limits.least[energy] * volume, 0.0};
}

/* Density times the excess of internal energy over a floor, for content + t change: A t^2 + B t + C. */
typedef struct excess {
  double a, b, c;
} excess;

static excess excess_of(const rm_system *s, const double *content, const double *change, lowest floor)
{
  const double r = content[s->density], dr = change[s->density];
  const double e = content[s->energy] - floor.per_mass * r - floor.fixed, de = change[s->energy] - floor.per_mass * dr;
  excess       x = {de * dr, e * dr + de * r, e * r};

  for (int d = 0; d < 3; d++) {
    const double m = s->motion[d] >= 0 ? content[s->motion[d]] : 0.0, dm = s->motion[d] >= 0 ? change[s->motion[d]] : 0.0;

    x.a -= 0.5 * dm * dm;
    x.b -= m * dm;
    x.c -= 0.5 * m * m;
  }
  return x;
}

static double excess_at(const excess *x, double t) { return (x->a * t + x->b) * t + x->c; }

/* The greatest t in [0, most] where it is not negative; at 0 it is not, up to rounding. */
static double keep_excess(const excess *x, double most)
{
  const double root = sqrt(fmax(x->b * x->b - 4.0 * x->a * x->c, 0.0)), q = -0.5 * (x->b + (x->b < 0.0 ? -root : root));
  double       t = most;

  if (excess_at(x, most) >= 0.0 || !(x->c > 0.0)) return x->c > 0.0 ? most : 0.0;
  if (q / x->a > 0.0) t = fmin(t, q / x->a);
  if (x->c / q > 0.0) t = fmin(t, x->c / q);
  t *= 1.0 - 0x1p-30;
  for (int k = 0; k < 64 && !(excess_at(x, t) >= 0.0); k++) t *= 0.5;
  return excess_at(x, t) >= 0.0 ? t : 0.0;
}

/* The greatest t in [0, most] with base + t rise <= room. */
static double keep_below(double base, double rise, double room, double most)
{
  if (!(base + most * rise > room)) return most;
  return base < room ? fmin(most, (room - base) / rise) : 0.0;
}

double rm_admit_factor(const rm_packing *p, int system, const double *content, const double *change, double volume,
                       rm_limits limits, double slack)
{
  const rm_system *s = &p->system[system];
  const double     r = content[s->density], dr = change[s->density];
  const lowest     floor = floor_of(p, system, volume, limits, LEAST_PART);
  double           t     = 1.0;

  if (!(volume > 0.0)) return 0.0;
  t = keep_below(-r, -dr, -LEAST_PART * RM_VALUE_SCALE * limits.least[s->density] * volume, t);
  for (int f = 0; f < p->num_fields; f++) {
    const double low = limits.least[f], high = limits.greatest[f], room = slack * fmax(fabs(low), fabs(high)) * r;

    if (!is_bounded(p, f, system)) continue;
    t = keep_below(content[f] - high * r, change[f] - high * dr, room, t);
    t = keep_below(low * r - content[f], low * dr - change[f], room, t);
  }
  if (floor.fixed > 0.0 || floor.per_mass > 0.0) {
    const excess x = excess_of(s, content, change, floor);

    t = keep_excess(&x, t);
  }
  return t;
}

/* Is the content of a receiving cell a state that can be? What is no number passes. */
static bool admits(const rm_packing *p, int system, const double *content, double volume, rm_limits limits)
{
  const rm_system *s = &p->system[system];
  const double     r = content[s->density], part = LEAST_PART * (1.0 - 0x1p-20);
  const lowest     floor = floor_of(p, system, volume, limits, part);

  if (r < part * RM_VALUE_SCALE * limits.least[s->density] * volume) return false;
  for (int f = 0; f < p->num_fields; f++) {
    const double low = limits.least[f], high = limits.greatest[f], room = SLACK_RECEIVE * fmax(fabs(low), fabs(high)) * r;

    if (is_bounded(p, f, system) && (content[f] - high * r > room || low * r - content[f] > room)) return false;
  }
  return !(floor.fixed > 0.0 || floor.per_mass > 0.0) || !(excess_of(s, content, content, floor).c < 0.0);
}

/* ---- rounds ----------------------------------------------------------------------------------------------------- */

remap_status rm_admission_init(rm_arena *arena, const rm_transfer_setup *setup, const rm_load *load, rm_admission *w)
{
  const int n = load->num_systems;

  RM_TRY(rm_flow_init(arena, setup->giving_rows->plan, (int)setup->giving->side, (size_t)n, &w->refusals));
  RM_TRY(rm_flow_init(arena, setup->rows->plan, (int)setup->giving->side, (size_t)n * sizeof(double), &w->factors));
  RM_NEW(w->refused, arena, rm_mul_sat(setup->receiving->num_cells, n));
  RM_NEW(w->is_scaled, arena, rm_mul_sat(setup->giving->num_cells, n));
  RM_NEW(w->factor, arena, rm_mul_sat(setup->giving->num_cells, n));
  RM_NEW(w->room, arena, 4 * (int64_t)load->num_fields);
  RM_NEW(w->content, arena, RM_FEW_CELLS * (int64_t)load->num_fields);
  return REMAP_OK;
}

/* Add what a giver's polynomials hold in a piece of space with these moments about its centroid: amounts, and what slopes add.
 */
static void add_content(const rm_packing *p, int s, const double *place, double volume, const double m[3],
                        const double second[6], double *content, double *change)
{
  for (int f = 0; f < p->num_fields; f++) {
    double g[3], h[7];

    if (p->system_of[f] != s) continue;
    rm_pack_read(p, f, place, RM_PACK_SLOPE, 3, g);
    rm_pack_read(p, f, place, rm_pack_curvature(p->has_bounds), 7, h);
    content[f] += RM_VALUE_SCALE * place[p->at[f]] * volume;
    change[f] += g[0] * m[0] + g[1] * m[1] + g[2] * m[2] + rm_dot6(h, second) + h[6] * volume;
  }
}

static bool has_slopes(const rm_packing *p, int s) { return p->degree[p->system[s].density] > 0; }

/* Does a receiving cell refuse, in each of the systems, what it is given? Those that it refused before it is not asked again:
 * all their givers are scaled. content [num_fields] is what it is given. */
static void refuse_in_cell(rm_admission *w, const rm_rows *rows, const rm_packing *p, rm_lid cell, const double *got,
                           const double *content)
{
  const rm_limits limits  = {w->room, w->room + p->num_fields};
  const double    volume  = rm_row_volume(rows, cell);
  uint8_t        *refused = w->refused + (int64_t)cell * p->num_systems;

  rm_limits_clear(p, limits);
  for (int64_t k = rows->offset[cell]; k < rows->offset[cell + 1]; k++)
    rm_limits_add(p, got + (int64_t)rows->giver[k] * p->width, limits);
  for (int s = 0; s < p->num_systems; s++)
    if (has_slopes(p, s) && !refused[s]) refused[s] = !admits(p, s, content, volume, limits);
}

/* Which receiving cells refuse. */
static void refuse(rm_admission *w, const rm_transfer_setup *setup, const rm_packing *p, const double *got)
{
  const rm_rows *rows = setup->rows;

  for (rm_lid first = 0, end; first < rows->num_cells; first = end) {
    end = rows->num_cells - first > RM_FEW_CELLS ? first + RM_FEW_CELLS : rows->num_cells;
    rm_sum_rows(p, rows, got, first, end, w->content);
    for (rm_lid c = first; c < end; c++)
      if (rm_is_mapped(rows->cover[c]) && !rm_is_copied(rows, setup->receiving_differs, c, true))
        refuse_in_cell(w, rows, p, c, got, w->content + (int64_t)(c - first) * p->num_fields);
  }
}

/* The greatest factor by which all pairs of a giving cell hold what can be. Its rows have moments about the receiving cells'
 * centroids; they are taken back. */
static double factor_of(const rm_admission *w, const rm_transfer_setup *setup, const rm_packing *p, int s, rm_lid cell,
                        const double *place)
{
  const rm_rows  *rows    = setup->giving_rows;
  const int       num     = p->num_fields;
  const rm_limits limits  = {w->room, w->room + num};
  double         *content = w->room + 2 * num, *change = w->room + 3 * num, factor = 1.0;

  rm_limits_clear(p, limits);
  rm_limits_add(p, place, limits);
  for (int64_t k = rows->offset[cell]; k < rows->offset[cell + 1]; k++) {
    double m[3], second[6];

    rm_moments_about(rows, k, rows->volume[k], rows->moment[k], setup->giving->cell_centroid[cell], m, second);
    for (int f = 0; f < num; f++) content[f] = change[f] = 0.0;
    add_content(p, s, place, rows->volume[k], m, second, content, change);
    factor = fmin(factor, rm_admit_factor(p, s, content, change, rows->volume[k], limits, SLACK_GIVE));
  }
  return factor;
}

static void scale(const rm_packing *p, int s, double factor, double *place)
{
  for (int f = 0; f < p->num_fields; f++) {
    if (p->system_of[f] != s) continue;
    rm_pack_scale(p, f, factor, RM_PACK_SLOPE, 3, place);
    rm_pack_scale(p, f, factor, rm_pack_curvature(p->has_bounds), 7, place);
  }
}

/* Scale the cells that were refused by somebody for the first time. True if there is any. */
static bool scale_refused(rm_admission *w, const rm_transfer_setup *setup, const rm_packing *p, const rm_profile *giving)
{
  const rm_rows *rows    = setup->giving_rows;
  const uint8_t *refused = (const uint8_t *)w->refusals.received;
  const int      n       = p->num_systems;
  bool           any     = false;

  for (rm_lid c = 0; c < rows->num_cells; c++)
    for (int s = 0; s < n; s++) {
      double *factor = &w->factor[(int64_t)c * n + s];
      bool    is_hit = false;

      *factor = 1.0;
      for (int64_t k = rows->offset[c]; k < rows->offset[c + 1] && !w->is_scaled[(int64_t)c * n + s]; k++)
        is_hit |= refused[(int64_t)rows->giver[k] * n + s] != 0;
      if (!is_hit) continue;
      w->is_scaled[(int64_t)c * n + s] = 1;
      *factor                          = factor_of(w, setup, p, s, c, rm_pack_of(giving, p, c));
      scale(p, s, *factor, rm_pack_of(giving, p, c));
      any |= *factor < 1.0;
    }
  return any;
}

/* One round. True if some slope was scaled on some rank. Collective. */
static bool run_round(rm_admission *w, const rm_transfer_setup *setup, const rm_packing *p, const rm_profile *giving,
                      rm_word *word)
{
  const size_t n   = (size_t)p->num_systems;
  int64_t      any = 0;

  if (word->note.status == REMAP_OK) refuse(w, setup, p, giving->pack);
  rm_word_post(word, setup->comm, &w->refusals, n, w->refused);
  rm_word_await(word, setup->comm, &w->refusals);
  if (word->note.status == REMAP_OK) any = scale_refused(w, setup, p, giving);
  rm_word_post(word, setup->comm, &w->factors, n * sizeof(double), w->factor);
  rm_word_await(word, setup->comm, &w->factors);
  for (rm_lid g = 0; g < setup->rows->num_givers && word->note.status == REMAP_OK; g++)
    for (int s = 0; s < p->num_systems && setup->rows->giver_rank[g] != setup->comm->rank; s++) /* own ones are scaled */
      if (rm_flow_numbers(&w->factors)[(int64_t)g * p->num_systems + s] < 1.0)
        scale(p, s, rm_flow_numbers(&w->factors)[(int64_t)g * p->num_systems + s], giving->pack + (int64_t)g * p->width);
  if (!rm_word_agree(word, setup->comm)) return false;
  rm_word_add(word, rm_comm_max_i64(setup->comm, &any, 1));
  return any != 0;
}

void rm_admission_run(rm_admission *w, const rm_transfer_setup *setup, const rm_packing *p, const rm_profile *giving,
                      rm_word *word)
{
  for (int64_t k = 0; k < (int64_t)setup->receiving->num_cells * p->num_systems; k++) w->refused[k] = 0;
  for (int64_t k = 0; k < (int64_t)setup->giving->num_cells * p->num_systems; k++) w->is_scaled[k] = 0;
  while (run_round(w, setup, p, giving, word) && word->note.status == REMAP_OK) {
  }
}
