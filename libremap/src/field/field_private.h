/* field_private -- between the files of the room.
 *
 *   stencil, widen  neighbours and their weights                     leastsq, quadratic  the weights of one cell
 *   fit             slopes and curvature in one cell
 *   reconstruct     cells of a mesh: value, slope, bounds            smooth    where a field is smooth
 *   profile         reconstruction with its messages                 packing   what travels, and where it stands
 *   system          fields that are converted and moved together     admit     states that can be
 *   gather          between the caller's arrays and ours             nearest   where uncovered cells look
 *   rows            sums over pairs                                  integral  what was kept, exactly
 *   receive         receiving cells, coverage policies
 *   caas            clipping                                         carrier   all of it in order, in two steps  */
#ifndef RM_FIELD_PRIVATE_H
#define RM_FIELD_PRIVATE_H

#include "field.h"

#include <float.h>
#include <math.h>

/* ---- leastsq --------------------------------------------------------------------------------------------------- */

/* What rounding leaves of the distances in one stencil. */
typedef struct rm_distance_noise {
  double coordinate[3]; /* a distance along an axis below this is rounding only                  */
  double extent[3];     /* of the cell itself: what is far smaller spans nothing along this axis */
} rm_distance_noise;

/* Weights w_k with gradient = sum of w_k (u_k - u), from distances d_k between n centroids and the cell's own. d is used up.
 * Not collective. O(n). */
void rm_leastsq_weights(int64_t n, double (*d)[3], const rm_distance_noise *noise, double *scratch, double (*weight)[3]);

/* Axes W such that the products W d are orthonormal as columns; their number, the dimension of what the distances span. d is
 * used up; scratch is [n]. Not collective. O(n). */
int rm_leastsq_axes(int64_t n, double (*d)[3], const rm_distance_noise *noise, double *scratch, double axes[3][3]);

/* ---- quadratic ------------------------------------------------------------------------------------------------- */

/* Working memory, [n] each. */
typedef struct rm_quadratic_room {
  double (*distance)[3], (*row)[9], *row_weight;
} rm_quadratic_room;

/* Weights of the nine coefficients of a quadratic polynomial with zero mean over a cell, from distances d_k between n centroids
 * and the cell's own and differences of mean (x - c)(x - c)^T. False if the neighbours do not determine it well. Not
 * collective. O(n). */
bool rm_quadratic_weights(int64_t n, const double (*d)[3], const double (*spread)[6], const rm_distance_noise *noise,
                          rm_quadratic_room *room, double (*weight)[9]);

/* ---- reconstruct ----------------------------------------------------------------------------------------------- */

/* Sums and slopes are of values times this power of two, so that differences of the largest values and slopes over small cells
 * stay finite. It changes no digit of what is not below 1e-280. */
#define RM_VALUE_SCALE 0x1p-64

/* What travels for a giving cell, `width` doubles: per field the value as the caller gave it, of a field in a system the amount
 * per volume (at order 2 the reconstruction's at the centroid as rounded, unless the cell has a pair of its own alone, whose
 * value is copied as given); where the field has slopes, three slopes of the scaled value, then, if asked for, least and
 * greatest value around, scaled (of a field in a system: of the amount per mass); where it has curvature six coefficients h of
 * the scaled value and the constant that gives h:(y y^T) zero mean over the cell. Span after span; in a span row after row, the
 * values of its fields, their slopes along x and so on: number k of field f stands at at[f] + k step[f]. */

/* Fields that are moved together, by number; -1: there is none. */
typedef struct rm_system {
  int density, motion[3], energy;
} rm_system;

/* Fields next to each other that rows are summed for together: of one degree, all in one system or in none. */
enum { RM_SPAN_FIELDS = 4 };
typedef struct rm_span {
  int first, num, degree; /* num <= RM_SPAN_FIELDS */
} rm_span;

typedef struct rm_packing {
  const remap_transfer   *how;
  const remap_field_desc *fields;
  int                     num_fields, width;
  int                    *at, *step; /* [num_fields]                                              */
  int                    *order;     /* [num_fields] 1, 2 or 3: of what is reconstructed          */
  int                    *degree;    /* [num_fields] 0, 1 or 2: of the polynomials that travel    */
  int                    *system_of; /* [num_fields] number in the list, -1: none                 */
  int                     num_systems;
  rm_system              *system; /* [num_systems]                                             */
  int                     num_spans;
  rm_span                *span; /* [num_spans] all fields but flags, ascending               */
  int                     num_flags;
  bool                    has_bounds; /* fields of order 2 or 3 carry the bounds                   */
  bool                    is_limited; /* Barth-Jespersen                                           */
  bool                    is_checked; /* but not in cells that are smooth                          */
} rm_packing;
enum { RM_PACK_SLOPE = 1, RM_PACK_BOUNDS = 4 }; /* number of the first of them */

/* Number of the first coefficient of h, the constant is the seventh; and how many a field has. */
static inline int rm_pack_curvature(bool has_bounds) { return has_bounds ? RM_PACK_BOUNDS + 2 : RM_PACK_BOUNDS; }
static inline int rm_pack_width(int degree, bool has_bounds)
{
  return degree == 0 ? 1 : rm_pack_curvature(has_bounds) + (degree > 1 ? 7 : 0);
}

/* Numbers first to first + n - 1 of a field, from a cell's place in a pack and to it. */
static inline void rm_pack_read(const rm_packing *p, int f, const double *place, int first, int n, double *out)
{
  for (int k = 0; k < n; k++) out[k] = place[p->at[f] + (first + k) * p->step[f]];
}
static inline void rm_pack_write(const rm_packing *p, int f, const double *x, int first, int n, double *place)
{
  for (int k = 0; k < n; k++) place[p->at[f] + (first + k) * p->step[f]] = x[k];
}
static inline void rm_pack_scale(const rm_packing *p, int f, double factor, int first, int n, double *place)
{
  for (int k = 0; k < n; k++) place[p->at[f] + (first + k) * p->step[f]] *= factor;
}

/* Does a transfer of this order give a field slopes? Of which degree are its polynomials? */
static inline bool rm_has_slope(const remap_transfer *how, const remap_field_desc *field)
{
  return how->order > 1 && field->nature != REMAP_FLAG;
}
static inline int rm_degree(const remap_transfer *how, const remap_field_desc *field)
{
  return !rm_has_slope(how, field) ? 0 : field->system ? 2 : how->order - 1;
}

/* Is a field's old content, outside of what is covered, reconstructed? */
bool rm_is_blended(const rm_transfer_setup *setup, const remap_transfer *how, const remap_field_desc *field);

/* Is a field one of amounts, of which integrals count? */
static inline bool rm_is_amount(const rm_packing *packing, int f)
{
  return packing->system_of[f] >= 0 || packing->fields[f].nature == REMAP_CONSERVED;
}

/* Is what a mapped cell has of a field, amounts or not, that of the only cell that it shares volume with, as it is? */
static inline bool rm_is_copied(const rm_rows *rows, const uint8_t *differs, rm_lid cell, bool is_amount)
{
  return rows->same[cell] && !(is_amount && differs && differs[cell]);
}

/* Do receiving cells need bounds: all (CAAS, systems), or those in part covered that a reconstruction is taken beyond? */
bool rm_needs_bounds(const rm_transfer_setup *setup, const remap_transfer *how, int num_fields, const remap_field_desc *fields);

/* Lay out a packing whose arrays are there. */
void rm_packing_fill(rm_packing *packing, const rm_transfer_setup *setup, const remap_transfer *how, int num_fields,
                     const remap_field_desc *fields);

/* h:(y z^T) with h as six coefficients of a symmetric form. */
static inline double rm_form(const double h[6], const double y[3], const double z[3])
{
  return h[0] * y[0] * z[0] + h[1] * y[1] * z[1] + h[2] * y[2] * z[2] +
         0.5 * (h[3] * (y[0] * z[1] + y[1] * z[0]) + h[4] * (y[0] * z[2] + y[2] * z[0]) + h[5] * (y[1] * z[2] + y[2] * z[1]));
}
static inline double rm_dot6(const double h[6], const double s[6])
{
  return h[0] * s[0] + h[1] * s[1] + h[2] * s[2] + h[3] * s[3] + h[4] * s[4] + h[5] * s[5];
}

/* Moments of pair k of a row about a point x instead of its giver's centroid, from its volume and its moment about the latter;
 * second ones are 0 where there are none. */
static inline void rm_moments_about(const rm_rows *rows, int64_t k, double volume, const double moment[3], const double x[3],
                                    double m[3], double second[6])
{
  const double *c    = rows->giver_centroid[rows->giver[k]];
  const double  e[3] = {c[0] - x[0], c[1] - x[1], c[2] - x[2]};

  for (int d = 0; d < 3; d++) m[d] = moment[d] + e[d] * volume;
  for (int i = 0; i < 6; i++) {
    const int a = rm_row_of[i], b = rm_column_of[i];

    second[i] = rows->second ? rows->second[k][i] + e[a] * moment[b] + e[b] * moment[a] + e[a] * e[b] * volume : 0.0;
  }
}

/* Values of one field: own cells, then the halo's. */
typedef struct rm_around {
  const double *own, *halo; /* [cells][stride], this field's first value */
  int64_t       stride;
} rm_around;
static inline double rm_value_at(const rm_around *u, rm_lid num_cells, rm_lid cell)
{
  return RM_VALUE_SCALE * (cell < num_cells ? u->own[cell * u->stride] : u->halo[(cell - num_cells) * u->stride]);
}

/* In line, unlike isfinite. */
static inline bool rm_is_finite(double x) { return fabs(x) <= DBL_MAX; }

/* ---- fit ------------------------------------------------------------------------------------------------------- */

/* Fits of the num fields of a span in one cell, u its first field; results are scaled, row by row. Not collective.
 *
 * Least-squares slopes over the vertex neighbours [3][num]; and, unless bounds is NULL, least and greatest value of the cell
 * and these neighbours [2][num]. */
void rm_fit_slopes(const rm_stencil *stencil, rm_lid cell, const rm_around *u, int num, double *slope, double *bounds);
/* The bounds alone. */
void rm_fit_bounds(const rm_stencil *stencil, rm_lid cell, const rm_around *u, int num, double *bounds);
/* Slope [3][num] and curvature, with its constant, [7][num] of the quadratic polynomials; the stencil is widened. Bit i of what
 * is returned: field i has one; of others both are 0. */
unsigned rm_fit_quadratic(const rm_stencil *stencil, rm_lid cell, const rm_around *u, int num, double *slope,
                          double *curvature);

/* A mesh whose fields are reconstructed. */
typedef struct rm_ground {
  const rm_mesh    *mesh;
  const rm_stencil *stencil;
  const rm_rows    *rows;    /* of its cells                                                               */
  const double (*second)[6]; /* rm_mesh_second; NULL unless systems have slopes                            */
  const double  *measure;    /* [cells] the solver's volumes over those of the mesh; NULL: 1               */
  const uint8_t *differs;    /* [cells] as in rm_transfer_setup                                            */
  bool           is_keeping; /* polynomials are asked for in partial cells only, not in all that are mapped */
} rm_ground;

typedef struct rm_profile rm_profile;

/* What is done in a cell: fields are fitted to what is around; then limited and made what travels. */
enum { RM_FIT = 1, RM_FINISH = 2 };
/* Do either or both in the cells whose needs_halo is `which`, and fill their places in the pack. The halo's numbers are read
 * only for cells that need it. Cells that nobody asks get slope 0 in the end. Not collective. */
void rm_reconstruct(const rm_profile *profile, const rm_packing *packing, uint8_t which, int steps);

/* ---- smooth ---------------------------------------------------------------------------------------------------- */

/* Cells are smooth if none within so many layers of neighbours is rough. */
enum { RM_ROUGH_LAYERS = 3 };

/* Which fields are rough in a cell is told by bits, so many words of them. */
static inline int rm_rough_words(int num_fields) { return (num_fields + 63) / 64; }
static inline bool rm_is_rough(const uint64_t *words, int f) { return words[f / 64] >> f % 64 & 1; }

/* Show what neighbours look at of a span in a cell that is fitted. Not collective. */
void rm_smooth_show(const rm_profile *profile, const rm_packing *packing, const rm_span *span, rm_lid cell);

/* Which fields are rough in own cells, rough [cells][rm_rough_words]; numbers and what was shown of other ranks' cells have
 * come. Not collective. */
void rm_smooth_roughness(const rm_profile *profile, const rm_packing *packing, uint64_t *rough);

/* Likewise in cells or a neighbour of theirs, spread [cells][rm_rough_words]: one layer more. halo: of other ranks' cells. Not
 * collective. */
void rm_smooth_spread(const rm_profile *profile, int num_words, const uint64_t *rough, const uint64_t *halo, uint64_t *spread);

/* ---- profile --------------------------------------------------------------------------------------------------- */

/* What is known of how a transfer goes. */
typedef struct rm_word {
  rm_note      note; /* worst status so far                  */
  remap_status mine; /* the same without what neighbours told */
  rm_reason    reason;
  rm_parley    parley;     /* who goes along                                                     */
  bool         is_given;   /* something has been sent, and peers know what is under way           */
  bool         is_counted; /* it is known whether all ranks go along, which is_complete says then */
  bool         is_complete;
} rm_word;

/* What a step on this rank said; the first failure stays. */
void rm_word_add(rm_word *word, remap_status status);
/* Send `size` bytes of each item along a flow; the first ones open the parley, and are waited for before others are sent. */
void rm_word_post(rm_word *word, const rm_comm *comm, rm_flow *flow, size_t size, const void *item);
/* Wait for a flow, if it is under way; what its senders say counts. */
void rm_word_await(rm_word *word, const rm_comm *comm, rm_flow *flow);
/* What peers said: their status of the parley. */
void rm_word_hear(rm_word *word, remap_status status);
/* Do all ranks go along? False, and noted, if not: then nothing collective may follow. By all ranks that go along. */
bool rm_word_count(rm_word *word, const rm_comm *comm);
/* One word for all ranks. True if all is well. Collective. */
bool rm_word_agree(rm_word *word, const rm_comm *comm);

static inline const double *rm_flow_numbers(const rm_flow *flow) { return (const double *)(const void *)flow->received; }

/* profile -- the fields of one mesh reconstructed, again and again. It owns flows and room; values are the carrier's. */
struct rm_profile {
  rm_ground     ground;
  rm_flow       halo;           /* numbers around the stencils                                    */
  rm_flow       slopes, roughs; /* likewise slopes and roughness, if smooth cells are told from others */
  uint32_t     *shown;          /* [cells][4 num_fields] upper halves of slopes, and of the range of values around; span after
                                   span and row after row, as what follows: */
  double       *bounds;         /* [cells][2 num_fields] of rm_fit_slopes, where they do not travel but are kept */
  double       *line;           /* [7][num_fields] of one cell: its bounds, if nobody keeps them; and room */
  uint8_t      *is_made;        /* [num_fields] likewise                                          */
  uint64_t     *rough, *spread; /* [cells][rm_rough_words] cells that are rough, or near one; spread is the last layer */
  uint8_t      *needs_halo;     /* [cells] 1: its stencil reaches other ranks                      */
  const double *given;          /* [cells][num_fields] values as the caller has them              */
  const double *number;         /* [cells][num_fields] what is reconstructed: given, or amounts per mass */
  double       *extreme;        /* [2][num_fields] least number, then greatest, over all ranks: of fields in systems */
  double       *pack;           /* [places][width]                                                */
  const rm_lid *place;          /* [cells] of a cell in the pack; NULL: its number                */
  int64_t      *limited;        /* [2][num_fields] cells that the limiter changed; those without a polynomial of order 3 */
};
static inline double *rm_pack_of(const rm_profile *w, const rm_packing *packing, rm_lid cell)
{
  return w->pack + (int64_t)(w->place ? w->place[cell] : cell) * packing->width;
}

/* The numbers of a span's first field. */
static inline rm_around rm_around_span(const rm_profile *w, const rm_packing *packing, const rm_span *span)
{
  const double *halo = rm_flow_numbers(&w->halo);

  return (rm_around){w->number + span->first, halo ? halo + span->first : NULL, packing->num_fields};
}

/* Where the bounds of a span are in a fitted cell, [2][span->num]; NULL if nobody asks for them. */
double *rm_bounds_of(const rm_profile *profile, const rm_packing *packing, const rm_span *span, rm_lid cell);

/* Flows and room for a load on a ground, but for values and pack. Not collective. Lives in arena. */
remap_status rm_profile_init(rm_arena *arena, int stream, const rm_load *load, rm_profile *profile);
/* Does a transfer read the halo? */
bool rm_profile_reads_halo(const rm_packing *packing);
/* Send the halo's numbers. What can be done without them is done before rm_profile_finish. Among neighbours. */
void rm_profile_post(rm_profile *profile, const rm_comm *comm, const rm_packing *packing, rm_word *word);
/* Receive them and make the whole pack. Among neighbours. */
void rm_profile_finish(rm_profile *profile, const rm_comm *comm, const rm_packing *packing, rm_word *word);
/* Wait for what is under way. */
void rm_profile_abandon(rm_profile *profile, const rm_comm *comm, rm_word *word);

/* ---- system ---------------------------------------------------------------------------------------------------- */

/* Find the systems among the fields of a packing. Fields have passed rm_systems_check. */
void rm_systems_find(rm_packing *packing);

/* Is the internal energy of system s reconstructed per mass, not per volume? */
bool rm_system_is_energy_per_mass(const rm_packing *packing, int s);
/* Of one cell: what is reconstructed, number [num_fields], from what is given [num_fields], which may be the same array. Fields
 * outside of systems stay as they are. False if a density is not positive; *bad is its field then. */
bool rm_system_numbers(const rm_packing *packing, const double *given, double *number, int *bad);
/* Of one cell: the amount per volume of field f, from both. */
double rm_system_amount(const rm_packing *packing, int f, const double *given, const double *number);
/* Of one cell: what is given, from amounts per volume, value [num_fields] in place. Fields outside of systems stay as they are.
 */
void rm_system_restore(const rm_packing *packing, double *value);

/* The polynomials of a system's amounts per volume, of degree 2, from those of density and amounts per mass. place is the
 * cell's in the pack; second and volume are the cell's moments. The mean over the cell stays its amount. */
void rm_system_combine(const rm_packing *packing, int s, const double *given, const double *number, const double second[6],
                       double volume, const double centroid_error[3], double *place);

/* ---- rows ------------------------------------------------------------------------------------------------------ */

/* Cells whose rows are summed at once, so that what is summed stays at hand. */
enum { RM_FEW_CELLS = 64 };

/* What receiving cells get, scaled: content [end - first][num_fields] of u V + g.M + h:S over the rows of cells first to
 * end - 1, but for flags. got as in rm_receipt. Not collective. O(pairs of the rows) per field. */
void rm_sum_rows(const rm_packing *packing, const rm_rows *rows, const double *got, rm_lid first, rm_lid end, double *content);

/* ---- admit ----------------------------------------------------------------------------------------------------- */

/* Least and greatest amount per mass of each field about some place, [num_fields] each, not scaled. */
typedef struct rm_limits {
  double *least, *greatest;
} rm_limits;

/* No limits yet, for all fields of systems. */
void rm_limits_clear(const rm_packing *packing, rm_limits limits);
/* Widen them by one more giver, from its place in a pack. */
void rm_limits_add(const rm_packing *packing, const double *place, rm_limits limits);

/* The greatest factor in [0, 1] by which change may be added to content, scaled amounts in a volume, [num_fields] each, so that
 * the state of a system stays one that can be: density and internal energy above a tenth of the least around, amounts per mass
 * within limits, up to rounding. Content alone is such a state. slack is what rounding may take, relative. */
double rm_admit_factor(const rm_packing *packing, int s, const double *content, const double *change, double volume,
                       rm_limits limits, double slack);

/* admission -- the rounds in which slopes are scaled until every receiving cell's state can be. */
typedef struct rm_admission {
  rm_flow  refusals;  /* of receiving cells, to their givers           */
  rm_flow  factors;   /* of giving cells, to those who receive         */
  uint8_t *refused;   /* [receiving cells][num_systems]                */
  uint8_t *is_scaled; /* [giving cells][num_systems]                  */
  double  *factor;    /* [giving cells][num_systems] of this round     */
  double  *room;      /* [4][num_fields]                               */
  double  *content;   /* [RM_FEW_CELLS][num_fields]                    */
} rm_admission;

/* Flows and room for a load. Not collective. Lives in arena. NO_MEMORY. */
remap_status rm_admission_init(rm_arena *arena, const rm_transfer_setup *setup, const rm_load *load, rm_admission *admission);
/* The pack of the profile, in which the givers of the rows come first, is scaled. Collective. */
void rm_admission_run(rm_admission *admission, const rm_transfer_setup *setup, const rm_packing *packing,
                      const rm_profile *giving, rm_word *word);

/* ---- caas ------------------------------------------------------------------------------------------------------ */

typedef struct rm_receipt rm_receipt;

/* What clipping takes from the new values, and the room above and below the clipped ones, [num_fields][3], scaled; to be summed
 * over all ranks. old [receiving cells][num_fields] are the values before. The pack has bounds. Not collective. */
void rm_caas_sum(const rm_receipt *receipt, const double *old, rm_sum *sum);

/* Clip, and give back what the sums over all ranks say. limited [num_fields] grows by the number of clipped cells. */
void rm_caas_settle(const rm_receipt *receipt, const double *old, const rm_sum *sum, int64_t *limited);

/* ---- nearest --------------------------------------------------------------------------------------------------- */

/* Where cells without a value of their own look: the nearest mapped cell. Read-only once built. */
typedef struct rm_nearest {
  int64_t        num;    /* cells without pairs on this rank         */
  const rm_lid  *cell;   /* [num] ascending                          */
  const rm_lid  *origin; /* [num] place in what the plan brings      */
  const rm_plan *plan;   /* brings the values of mapped cells        */
} rm_nearest;

/* Find the nearest mapped cell, by layers of vertex neighbours: a cell takes, among its neighbours' mapped cells of the layers
 * before, the one whose centroid is nearest to its own, the canonically first if some are equally near. Cells that no
 * layer reaches take the mapped cell of nearest centroid in the whole mesh. COVERAGE if no cell is mapped anywhere.
 * Collective. Lives in arena. */
remap_status rm_nearest_build(rm_arena *arena, const rm_comm *comm, const rm_mesh *mesh, const rm_stencil *stencil,
                              const uint8_t *cover, const rm_nearest **out, rm_reason *reason);

/* The cell a search has found for a point. */
typedef struct rm_origin {
  double xyz[3]; /* its centroid */
  rm_gid global;
  int    rank; /* -1: none yet */
  rm_lid cell;
} rm_origin;

/* The mapped cell of nearest centroid for each of num_points points, by distance, then centroid, then global id. Collective;
 * some cell is mapped somewhere. found is [num_points]. Working memory from scratch. O(log n) per point and rank that is near.
 */
remap_status rm_nearest_anywhere(rm_arena *scratch, const rm_comm *comm, const rm_mesh *mesh, const uint8_t *cover,
                                 int64_t num_points, const double (*point)[3], rm_origin *found);

static inline double rm_distance2(const double x[3], const double y[3])
{
  const double dx = x[0] - y[0], dy = x[1] - y[1], dz = x[2] - y[2];

  return dx * dx + dy * dy + dz * dz;
}

/* ---- integral -------------------------------------------------------------------------------------------------- */

/* What a field's transfer kept, summed without rounding; scaled values, own frame. */
typedef struct rm_integral {
  rm_sum source, minus_target, magnitude;
} rm_integral;

/* Add x y to a sum unless it is too small to count beside products of ordinary size (below 2^-900), or no number. */
static inline void rm_integral_add(rm_sum *sum, double x, double y)
{
  if (fabs(x * y) >= 0x1p-900 && fabs(x * y) < 0x1p1000) rm_sum_add_product(sum, x, y);
}

/* Add what the giving cells hold to source and magnitude of integral [num_fields]; flags are left out. back: the rows of the
 * receiving cells. Not collective. */
void rm_integral_source(const rm_profile *profile, const rm_rows *back, const rm_packing *packing, rm_integral *integral);

/* Reduce over all ranks and fill in the integrals of reports [num_fields]. Collective. Working memory from scratch. */
remap_status rm_integral_report(rm_arena *scratch, const rm_transfer_setup *setup, int num_fields, const rm_integral *integral,
                                remap_field_report *reports);

/* ---- gather ---------------------------------------------------------------------------------------------------- */

/* Values of all fields in the giving cells, [giving cells][num_fields]. Those that nobody may have count as 0, whatever stands
 * there. BAD_VALUE. */
remap_status rm_gather_given(const rm_transfer_setup *setup, const rm_packing *packing, double *given, rm_reason *reason);
/* Old values, where they are used, [receiving cells][num_fields]; others stay as they are. BAD_VALUE. */
remap_status rm_gather_old(const rm_transfer_setup *setup, const rm_packing *packing, double *value, rm_reason *reason);
/* Old values of systems, where they are mixed with new ones, to amounts per volume; room is [num_fields]. BAD_VALUE. */
remap_status rm_gather_amounts(const rm_transfer_setup *setup, const rm_packing *packing, double *value, double *room,
                               rm_reason *reason);
/* Old values of all fields that are blended, and what is reconstructed of them; NaN where there is no such number. Both are
 * [receiving cells][num_fields], one array if there are no systems. */
void rm_gather_kept(const rm_transfer_setup *setup, const rm_packing *packing, double *given, double *number);
/* Into the caller's arrays. */
void rm_write_values(const rm_transfer_setup *setup, const rm_packing *packing, const double *value);
/* Turn vectors into the frame of those who receive. */
void rm_turn_vectors(const rm_transfer_setup *setup, const rm_packing *packing, double *given);
/* What is reconstructed, from what is given; they may be the same array. BAD_VALUE if a density is not positive. */
remap_status rm_gather_numbers(const rm_mesh *mesh, const rm_rows *rows, const rm_packing *packing, const double *given,
                               double *number, rm_reason *reason);

/* ---- receive --------------------------------------------------------------------------------------------------- */

/* One transfer on the receiving side. */
struct rm_receipt {
  const rm_transfer_setup *setup;
  const remap_transfer    *how;
  const remap_field_desc  *fields; /* [packing->num_fields]                                     */
  const rm_packing        *packing;
  const double            *got;      /* [givers of the rows][width]                               */
  double                  *value;    /* [receiving cells][num_fields] old values, then new ones   */
  double                  *room;     /* [5][num_fields]                                           */
  double                  *content;  /* [RM_FEW_CELLS][num_fields]                                */
  const uint8_t           *is_plain; /* [receiving cells] of rm_find_plain                        */
  const rm_profile        *keeping;  /* of old content; NULL: nobody blends, or there are no slopes */
  rm_integral             *integral; /* [num_fields], NULL: nobody wants them                     */
};

/* Is a receiving cell's old value used? */
bool rm_keeps_old(const remap_transfer *how, const remap_field_desc *field, uint8_t cover);
/* Do uncovered cells take the nearest value of this field? */
bool rm_needs_nearest(const remap_transfer *how, const remap_field_desc *field);
/* Which receiving cells simply divide what they get by their volume: is_plain [receiving cells] receives 1 for those that are
 * covered by more than their like alone, and have volume. */
void rm_find_plain(const rm_transfer_setup *setup, uint8_t *is_plain);
/* The new value of every cell that wants one, but for those that take the nearest. Not collective. O(pairs) per field. */
void rm_receive(const rm_receipt *receipt);

#endif
