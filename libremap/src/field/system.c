/* system -- fields that are moved together: mass and what moves with it.
 *
 * What is reconstructed are density r, amounts per mass q (velocity u, others) and internal energy per volume w, which is
 * pressure but for a constant: so pressure stays uniform where it is, whatever density does. (Where temperature is given,
 * internal energy per mass is reconstructed, and temperature stays uniform.) Polynomials are multiplied, so that amounts per
 * volume travel: r q, and w + r u.u / 2 for the total energy. With polynomials about the centroid
 *
 *   r = r0 + g.y + h:(y y^T),   q = q0 + G.y + K:(y y^T),   r q = r0 q0 + (r0 G + q0 g).y + (r0 K + q0 h + g G):(y y^T) + ...
 *
 * is a polynomial of degree 2, exactly so at order 2, where h = K = 0; at order 3 what is left out is of third order. q0 is
 * such that the mean over the cell is the cell's amount: at order 2, q is linear about the centre of mass. Where q is uniform,
 * r q is q times r to the last bits, so it stays uniform (after R. B. DeBar, UCIR-760, 1974). O(fields) per cell. */
#include "field_private.h"

/* ---- which fields ---------------------------------------------------------------------------------------------- */

static bool is_moving(remap_role role) { return role >= REMAP_ROLE_MOMENTUM_X && role <= REMAP_ROLE_VELOCITY_Z; }
static int  axis_of(remap_role role)
{
  return (int)role - (int)(role < REMAP_ROLE_VELOCITY_X ? REMAP_ROLE_MOMENTUM_X : REMAP_ROLE_VELOCITY_X);
}
static bool is_energy(remap_role role) { return role >= REMAP_ROLE_ENERGY && role <= REMAP_ROLE_TEMPERATURE; }

static rm_system system_of(int num_fields, const remap_field_desc *fields, int number)
{
  rm_system s = {-1, {-1, -1, -1}, -1};

  for (int f = num_fields - 1; f >= 0; f--) {
    const remap_role role = fields[f].role;

    if (fields[f].system != number) continue;
    if (role == REMAP_ROLE_DENSITY) s.density = f;
    if (is_moving(role)) s.motion[axis_of(role)] = f;
    if (is_energy(role)) s.energy = f;
  }
  return s;
}

void rm_systems_find(rm_packing *p)
{
  p->num_systems = 0;
  for (int f = 0; f < p->num_fields; f++) {
    p->system_of[f] = -1;
    if (p->fields[f].system == 0) continue;
    for (int k = 0; k < f && p->system_of[f] < 0; k++)
      if (p->fields[k].system == p->fields[f].system) p->system_of[f] = p->system_of[k];
    if (p->system_of[f] >= 0) continue;
    p->system_of[f]             = p->num_systems;
    p->system[p->num_systems++] = system_of(p->num_fields, p->fields, p->fields[f].system);
  }
}

static remap_status bad_field(const remap_field_desc *field, const char *what, rm_reason *reason)
{
  return rm_fail(REMAP_BAD_ARGUMENT, reason, -1, -1, "field %s: %s", field->name ? field->name : "?", what);
}

/* Are there three momenta, or three velocities? */
static bool is_vector(const rm_system *s, const remap_field_desc *fields)
{
  int num_velocities = 0, num = 0;

  for (int d = 0; d < 3; d++) {
    if (s->motion[d] < 0) continue;
    num++;
    num_velocities += fields[s->motion[d]].role >= REMAP_ROLE_VELOCITY_X;
  }
  return num == 3 && num_velocities % 3 == 0;
}

/* A field within its system, which is there. */
static remap_status check_member(const remap_transfer *how, const remap_field_desc *field, int f, const rm_system *s,
                                 const remap_field_desc *fields, rm_reason *reason)
{
  const remap_role role = field->role;

  if (role < REMAP_ROLE_OTHER || role > REMAP_ROLE_MASS_FRACTION)
    return bad_field(field, "its role is not one of its enum", reason);
  if (s->density < 0) return bad_field(field, "its system has no density: give one, or system 0", reason);
  if ((role == REMAP_ROLE_DENSITY && s->density != f) || (is_moving(role) && s->motion[axis_of(role)] != f) ||
      (is_energy(role) && s->energy != f))
    return bad_field(field,
                     "its system has another density, momentum or velocity along this axis, or energy, pressure or "
                     "temperature: give it role OTHER",
                     reason);
  if ((role == REMAP_ROLE_OTHER || role == REMAP_ROLE_MASS_FRACTION || role == REMAP_ROLE_ENERGY) &&
      field->nature != REMAP_CONSERVED && field->nature != REMAP_MASS_SPECIFIC)
    return bad_field(field, "in a system it is conserved or mass-specific", reason);
  if (field->nature == REMAP_FLAG) return bad_field(field, "a flag is in no system", reason);
  if (!field->has_old != !fields[s->density].has_old)
    return bad_field(field, "all of a system have old values, or none", reason);
  if ((role == REMAP_ROLE_PRESSURE || role == REMAP_ROLE_TEMPERATURE) && !(how->gamma > 1.0))
    return bad_field(field, "pressure and temperature need gamma above 1: give it, or system 0", reason);
  if (role == REMAP_ROLE_TEMPERATURE && !(how->gas_constant > 0.0))
    return bad_field(field, "temperature needs a gas constant above 0: give it, or system 0", reason);
  if (how->rotation && is_moving(role) && !is_vector(s, fields))
    return bad_field(field, "a rotation needs all three components of momentum, or all of velocity", reason);
  return REMAP_OK;
}

static bool is_orthogonal(const double m[9])
{
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) {
      const double product = m[3 * i] * m[3 * j] + m[3 * i + 1] * m[3 * j + 1] + m[3 * i + 2] * m[3 * j + 2];

      if (!(fabs(product - (i == j)) <= 1e-10)) return false;
    }
  return true;
}

remap_status rm_systems_check(const remap_transfer *how, int num_fields, const remap_field_desc *fields, rm_reason *reason)
{
  if (how->rotation && !is_orthogonal(how->rotation))
    return rm_fail(REMAP_BAD_ARGUMENT, reason, -1, -1, "the rotation is not orthogonal to 1e-10");
  for (int f = 0; f < num_fields; f++) {
    int num = 0;

    if (fields[f].system < 0 || fields[f].vector < 0)
      return bad_field(&fields[f], "numbers of systems and vectors are not below 0", reason);
    if (fields[f].system > 0) {
      const rm_system s = system_of(num_fields, fields, fields[f].system);

      RM_TRY(check_member(how, &fields[f], f, &s, fields, reason));
      if (fields[f].vector > 0 && is_moving(fields[f].role))
        return bad_field(&fields[f], "what moves in a system is a vector by itself: give vector 0", reason);
    }
    for (int k = 0; k < num_fields; k++) num += fields[k].vector == fields[f].vector;
    if (fields[f].vector > 0 && num != 3) return bad_field(&fields[f], "a vector has three components", reason);
    if (fields[f].vector > 0 && fields[f].nature == REMAP_FLAG) return bad_field(&fields[f], "a flag is no vector", reason);
  }
  return REMAP_OK;
}

/* ---- conversions ------------------------------------------------------------------------------------------------ */

static bool is_per_volume(const remap_field_desc *field)
{
  switch (field->role) {
    case REMAP_ROLE_DENSITY:
    case REMAP_ROLE_MOMENTUM_X:
    case REMAP_ROLE_MOMENTUM_Y:
    case REMAP_ROLE_MOMENTUM_Z: return true;
    case REMAP_ROLE_OTHER:
    case REMAP_ROLE_MASS_FRACTION:
    case REMAP_ROLE_ENERGY: return field->nature == REMAP_CONSERVED;
    default: return false;
  }
}

/* Kinetic energy per mass. */
static double kinetic(const rm_system *s, const double *number)
{
  double sum = 0.0;

  for (int d = 0; d < 3; d++)
    if (s->motion[d] >= 0) sum += number[s->motion[d]] * number[s->motion[d]];
  return 0.5 * sum;
}

bool rm_system_is_energy_per_mass(const rm_packing *p, int s)
{
  return p->fields[p->system[s].energy].role == REMAP_ROLE_TEMPERATURE;
}

/* Internal energy of what is given; density and velocities are numbers already. */
static double internal(const rm_packing *p, const rm_system *s, const double *given, const double *number)
{
  const remap_transfer *how = p->how;
  const double          x   = given[s->energy];

  switch (p->fields[s->energy].role) {
    case REMAP_ROLE_PRESSURE: return x / (how->gamma - 1.0);
    case REMAP_ROLE_TEMPERATURE: return how->gas_constant * x / (how->gamma - 1.0);
    default:
      return (is_per_volume(&p->fields[s->energy]) ? x : number[s->density] * x) - number[s->density] * kinetic(s, number);
  }
}

bool rm_system_numbers(const rm_packing *p, const double *given, double *number, int *bad)
{
  for (int s = 0; s < p->num_systems; s++)
    if (given[p->system[s].density] <= 0.0) {
      *bad = p->system[s].density;
      return false;
    }
  for (int f = 0; f < p->num_fields; f++) {
    const rm_system *s = p->system_of[f] >= 0 ? &p->system[p->system_of[f]] : NULL;

    if (!s || f == s->density || !is_per_volume(&p->fields[f]) || f == s->energy)
      number[f] = given[f];
    else
      number[f] = given[f] / given[s->density];
  }
  for (int s = 0; s < p->num_systems; s++)
    if (p->system[s].energy >= 0) number[p->system[s].energy] = internal(p, &p->system[s], given, number);
  return true;
}

double rm_system_amount(const rm_packing *p, int f, const double *given, const double *number)
{
  const rm_system *s = p->system_of[f] >= 0 ? &p->system[p->system_of[f]] : NULL;

  if (!s || is_per_volume(&p->fields[f])) return given[f];
  if (f == s->energy && !rm_system_is_energy_per_mass(p, p->system_of[f]))
    return number[f] + number[s->density] * kinetic(s, number);
  if (f == s->energy) return number[s->density] * (number[f] + kinetic(s, number));
  return number[s->density] * number[f];
}

/* What is given in place of the total energy per volume; velocities are in number, amounts in value. */
static double energy_given(const rm_packing *p, const rm_system *s, const double *value)
{
  const remap_transfer *how     = p->how;
  const double          density = value[s->density];
  double                sum     = 0.0, e;

  for (int d = 0; d < 3; d++)
    if (s->motion[d] >= 0) sum += value[s->motion[d]] * value[s->motion[d]];
  e = value[s->energy] - 0.5 * sum / density; /* internal, per volume */
  switch (p->fields[s->energy].role) {
    case REMAP_ROLE_PRESSURE: return (how->gamma - 1.0) * e;
    case REMAP_ROLE_TEMPERATURE: return (how->gamma - 1.0) * e / (density * how->gas_constant);
    default: return is_per_volume(&p->fields[s->energy]) ? value[s->energy] : value[s->energy] / density;
  }
}

void rm_system_restore(const rm_packing *p, double *value)
{
  for (int s = 0; s < p->num_systems; s++)
    if (p->system[s].energy >= 0) value[p->system[s].energy] = energy_given(p, &p->system[s], value);
  for (int f = 0; f < p->num_fields; f++) {
    const rm_system *s = p->system_of[f] >= 0 ? &p->system[p->system_of[f]] : NULL;

    if (s && f != s->energy && !is_per_volume(&p->fields[f])) value[f] /= value[s->density];
  }
}

/* ---- polynomials ------------------------------------------------------------------------------------------------ */

/* A polynomial of degree 2 about the centroid: value not scaled, coefficients scaled. */
typedef struct polynomial {
  double value, slope[3], curvature[6];
} polynomial;

/* (g.y)(G.y) as six coefficients, times scale. */
static void multiply(const double g[3], const double G[3], double scale, double out[6])
{
  for (int k = 0; k < 6; k++) {
    const int x = rm_row_of[k], y = rm_column_of[k];

    out[k] = scale * (x == y ? g[x] * G[x] : g[x] * G[y] + g[y] * G[x]);
  }
}

/* The polynomial of a field as reconstructed, with a mean of its own. */
static void read_polynomial(const rm_packing *p, int f, double mean, const double *place, polynomial *out)
{
  out->value = mean;
  rm_pack_read(p, f, place, RM_PACK_SLOPE, 3, out->slope);
  rm_pack_read(p, f, place, rm_pack_curvature(p->has_bounds), 6, out->curvature);
}

/* Density times q, of which the mass-weighted mean is q->value: coefficients of amounts per volume. spread is the cell's mean
 * of y y^T. r->value is the density at the centroid, mean its mean. */
static polynomial times_density(const polynomial *r, double mean, const polynomial *q, const double spread[6])
{
  polynomial product;
  double     cross[6], q0;

  multiply(r->slope, q->slope, 1.0 / RM_VALUE_SCALE, cross);
  q0 = q->value - (rm_dot6(cross, spread) / mean + rm_dot6(q->curvature, spread)) / RM_VALUE_SCALE;
  for (int d = 0; d < 3; d++) product.slope[d] = r->value * q->slope[d] + q0 * r->slope[d];
  for (int k = 0; k < 6; k++) product.curvature[k] = cross[k] + r->value * q->curvature[k] + q0 * r->curvature[k];
  product.value = r->value * q0;
  return product;
}

/* Add the kinetic energy of the velocities, per mass: u.u / 2 = u0.u0 / 2 + u0.(G y + ...) + (G y).(G y) / 2, but for its
 * value. */
static void add_kinetic(polynomial *e, const polynomial u[3], const bool is_there[3])
{
  for (int d = 0; d < 3; d++) {
    double square[6];

    if (!is_there[d]) continue;
    multiply(u[d].slope, u[d].slope, 0.5 / RM_VALUE_SCALE, square);
    for (int i = 0; i < 3; i++) e->slope[i] += u[d].value * u[d].slope[i];
    for (int k = 0; k < 6; k++) e->curvature[k] += u[d].value * u[d].curvature[k] + square[k];
  }
}

static bool is_finite_polynomial(const polynomial *q)
{
  double sum = 0.0;

  for (int d = 0; d < 3; d++) sum += 0.0 * q->slope[d];
  for (int k = 0; k < 6; k++) sum += 0.0 * q->curvature[k];
  return isfinite(sum);
}

/* Coefficients into the pack, with the constant that makes their mean 0; the true centroid lies error beyond that of the
 * moments. */
static void put(const rm_packing *p, int f, const polynomial *q, const double spread[6], const double error[3], double *place)
{
  const int    at       = rm_pack_curvature(p->has_bounds);
  const double constant = -(rm_dot6(q->curvature, spread) +
                            (q->slope[0] * error[0] + q->slope[1] * error[1] + q->slope[2] * error[2]));

  rm_pack_write(p, f, q->slope, RM_PACK_SLOPE, 3, place);
  rm_pack_write(p, f, q->curvature, at, 6, place);
  rm_pack_write(p, f, &constant, at + 6, 1, place);
}

/* No slopes: the amounts alone. */
static void flatten(const rm_packing *p, int s, double *place)
{
  for (int f = 0; f < p->num_fields; f++) {
    static const double none[7] = {0.0};

    if (p->system_of[f] != s) continue;
    rm_pack_write(p, f, none, RM_PACK_SLOPE, 3, place);
    rm_pack_write(p, f, none, rm_pack_curvature(p->has_bounds), 7, place);
  }
}

/* What rm_system_combine keeps while it overwrites the pack. */
typedef struct factors {
  polynomial density, velocity[3];
  bool       moves[3];
  double     mean, spread[6];
  bool       is_body; /* the cell has moments that a body can have */
} factors;

static factors factors_of(const rm_packing *p, const rm_system *s, const double *number, const double second[6], double volume,
                          const double *place)
{
  factors w = {.mean = number[s->density], .is_body = fabs(volume) > 0.0};

  read_polynomial(p, s->density, w.mean, place, &w.density);
  for (int k = 0; k < 6; k++) {
    w.spread[k] = w.is_body ? second[k] / volume : 0.0;
    w.is_body   = w.is_body && (k > 2 || w.spread[k] >= 0.0);
  }
  w.density.value -= rm_dot6(w.density.curvature, w.spread) / RM_VALUE_SCALE;
  for (int d = 0; d < 3; d++) {
    w.moves[d] = s->motion[d] >= 0;
    if (w.moves[d]) read_polynomial(p, s->motion[d], number[s->motion[d]], place, &w.velocity[d]);
  }
  return w;
}

/* The polynomial of the total energy per volume. */
static polynomial total_energy(const rm_packing *p, int system, const factors *w, const double *given, const double *number,
                               const double *place)
{
  const rm_system *s        = &p->system[system];
  const double     total    = rm_system_amount(p, s->energy, given, number);
  const bool       per_mass = rm_system_is_energy_per_mass(p, system);
  polynomial       q        = {.value = (per_mass ? total : total - number[s->energy]) / w->mean}, energy, internal;

  read_polynomial(p, s->energy, number[s->energy], place, &internal);
  for (int d = 0; d < 3 && per_mass; d++) q.slope[d] = internal.slope[d];
  for (int k = 0; k < 6 && per_mass; k++) q.curvature[k] = internal.curvature[k];
  add_kinetic(&q, w->velocity, w->moves);
  energy = times_density(&w->density, w->mean, &q, w->spread);
  for (int d = 0; d < 3 && !per_mass; d++) energy.slope[d] += internal.slope[d];
  for (int k = 0; k < 6 && !per_mass; k++) energy.curvature[k] += internal.curvature[k];
  return energy;
}

void rm_system_combine(const rm_packing *p, int system, const double *given, const double *number, const double second[6],
                       double volume, const double centroid_error[3], double *place)
{
  const rm_system *s       = &p->system[system];
  const factors    w       = factors_of(p, s, number, second, volume, place);
  bool             is_good = w.is_body;

  for (int f = 0; f < p->num_fields && is_good; f++) {
    polynomial amount;

    if (p->system_of[f] != system) continue;
    if (f == s->density) {
      amount = w.density;
    } else if (f == s->energy) {
      amount = total_energy(p, system, &w, given, number, place);
    } else {
      polynomial q;

      read_polynomial(p, f, number[f], place, &q);
      amount = times_density(&w.density, w.mean, &q, w.spread);
    }
    is_good = is_finite_polynomial(&amount);
    put(p, f, &amount, w.spread, centroid_error, place);
  }
  if (!is_good) flatten(p, system, place);
}
