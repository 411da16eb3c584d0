/* system -- which fields move together, and by which weights: a density and what belongs to its mass form a system (see
 * remap_field_desc), known by their SIDS names; a gas model lets pressure or temperature stand for the energy; vectors turn
 * with the transform of SOURCE. Names and trees alone decide, alike on all ranks. */
#include "job.h"

#include <fnmatch.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- roles -------------------------------------------------------------------------------------------------------- */

/* Names that play a part of their own; the first match counts. */
static const struct {
  const char  *pattern;
  remap_role   role;
  remap_nature nature; /* in a system */
} ROLE[] = {
    {"Density", REMAP_ROLE_DENSITY, REMAP_CONSERVED},
    {"MomentumX", REMAP_ROLE_MOMENTUM_X, REMAP_CONSERVED},
    {"MomentumY", REMAP_ROLE_MOMENTUM_Y, REMAP_CONSERVED},
    {"MomentumZ", REMAP_ROLE_MOMENTUM_Z, REMAP_CONSERVED},
    {"Momentum_x", REMAP_ROLE_MOMENTUM_X, REMAP_CONSERVED},
    {"Momentum_y", REMAP_ROLE_MOMENTUM_Y, REMAP_CONSERVED},
    {"Momentum_z", REMAP_ROLE_MOMENTUM_Z, REMAP_CONSERVED},
    {"VelocityX", REMAP_ROLE_VELOCITY_X, REMAP_MASS_SPECIFIC},
    {"VelocityY", REMAP_ROLE_VELOCITY_Y, REMAP_MASS_SPECIFIC},
    {"VelocityZ", REMAP_ROLE_VELOCITY_Z, REMAP_MASS_SPECIFIC},
    {"Velocity_x", REMAP_ROLE_VELOCITY_X, REMAP_MASS_SPECIFIC},
    {"Velocity_y", REMAP_ROLE_VELOCITY_Y, REMAP_MASS_SPECIFIC},
    {"Velocity_z", REMAP_ROLE_VELOCITY_Z, REMAP_MASS_SPECIFIC},
    {"EnergyStagnationDensity", REMAP_ROLE_ENERGY, REMAP_CONSERVED},
    {"Energy", REMAP_ROLE_ENERGY, REMAP_CONSERVED},
    {"EnergyStagnation", REMAP_ROLE_ENERGY, REMAP_MASS_SPECIFIC},
    {"Pressure", REMAP_ROLE_PRESSURE, REMAP_VOLUME_MEAN},
    {"Temperature", REMAP_ROLE_TEMPERATURE, REMAP_MASS_SPECIFIC},
    {"MassFraction*", REMAP_ROLE_MASS_FRACTION, REMAP_MASS_SPECIFIC},
    {"SpeciesDensity*", REMAP_ROLE_MASS_FRACTION, REMAP_CONSERVED},
    {"DensityStagnation*", REMAP_ROLE_OTHER, REMAP_VOLUME_MEAN},
    {"Density?*", REMAP_ROLE_MASS_FRACTION, REMAP_CONSERVED},
};

/* The row of a name; -1: it plays no part of its own. */
static int row_of(const char *name)
{
  const int num = sizeof ROLE / sizeof *ROLE;
  int       i   = 0;

  while (i < num && fnmatch(ROLE[i].pattern, name, 0)) i++;
  return i < num ? i : -1;
}

/* The field of the job that has a role by its name and is not told to be something else; -1: none. */
static int find_role(const cli_job *j, remap_role role, remap_nature nature)
{
  for (int k = 0; k < j->num_fields; k++) {
    const int row = row_of(j->field[k].name);

    if (row >= 0 && ROLE[row].role == role && ROLE[row].nature == nature && !j->row[k].is_told) return k;
  }
  return -1;
}

/* The field that stands for the energy: the total one, else what the gas model makes of pressure or temperature; -1: none. */
static int find_energy(const cli_job *j)
{
  const remap_transfer *how = &j->options.transfer;
  int                   k   = find_role(j, REMAP_ROLE_ENERGY, REMAP_CONSERVED);

  if (k < 0) k = find_role(j, REMAP_ROLE_ENERGY, REMAP_MASS_SPECIFIC);
  if (k < 0 && how->gamma > 0) k = find_role(j, REMAP_ROLE_PRESSURE, REMAP_VOLUME_MEAN);
  if (k < 0 && how->gamma > 0 && how->gas_constant > 0) k = find_role(j, REMAP_ROLE_TEMPERATURE, REMAP_MASS_SPECIFIC);
  return k;
}

/* ---- the system --------------------------------------------------------------------------------------------------- */

/* Is there a momentum along the axis of this velocity? */
static bool has_momentum(const cli_job *j, remap_role velocity)
{
  const int axis = (int)velocity - (int)REMAP_ROLE_VELOCITY_X;

  return axis >= 0 && axis < 3 && find_role(j, (remap_role)((int)REMAP_ROLE_MOMENTUM_X + axis), REMAP_CONSERVED) >= 0;
}

/* Put one field into the system, if it belongs there: by its role, or as what a mass has or carries. */
static void join(cli_job *j, int k, int energy)
{
  remap_field_desc *f    = &j->field[k];
  cli_field_row    *row  = &j->row[k];
  const int         at   = row->is_told ? -1 : row_of(f->name);
  remap_role        role = at < 0 ? REMAP_ROLE_OTHER : ROLE[at].role;

  if (k == energy) {
    row->weight = role == REMAP_ROLE_ENERGY ? CLI_BY_MASS : CLI_BY_GAS;
  } else {
    if (role == REMAP_ROLE_ENERGY || role == REMAP_ROLE_PRESSURE || role == REMAP_ROLE_TEMPERATURE || has_momentum(j, role))
      role = REMAP_ROLE_OTHER;
    if (at >= 0) f->nature = ROLE[at].nature;
    if (f->nature != REMAP_MASS_SPECIFIC && (f->nature != REMAP_CONSERVED || row->is_told)) return;
    row->weight = CLI_BY_MASS;
  }
  row->nature = f->nature;
  f->system   = 1;
  f->role     = role;
}

/* A density that nothing moves with is a field like others. */
static void leave_alone(cli_job *j)
{
  int num = 0, last = -1;

  for (int k = 0; k < j->num_fields + j->num_hidden; k++)
    if (j->field[k].system) num++, last = k;
  if (num != 1 || j->num_hidden) return;
  j->field[last].system = 0;
  j->row[last].weight   = CLI_BY_VOLUME;
}

/* Old values are blended as states, so all fields of a system have some or none has. */
static void agree_old(cli_job *j)
{
  int  with = 0, without = 0;
  bool any;

  for (int k = 0; k < j->num_fields + j->num_hidden; k++)
    if (j->field[k].system) *(j->field[k].has_old ? &with : &without) += 1;
  any = with && without;
  for (int k = 0; any && k < j->num_fields + j->num_hidden; k++)
    if (j->field[k].system) j->field[k].has_old = 0;
  if (any)
    cli_note(j, "%s: old values of the fields that move with Density are not used: some of them are missing there",
             j->options.path[REMAP_TARGET]);
}

/* rho = p / (R T) of files that leave the density out: a field that is not written. */
static void hide_density(cli_job *j)
{
  const int p = find_role(j, REMAP_ROLE_PRESSURE, REMAP_VOLUME_MEAN),
            t = find_role(j, REMAP_ROLE_TEMPERATURE, REMAP_MASS_SPECIFIC);

  for (int k = 0; k < j->num_fields; k++)
    if (!strcmp(j->field[k].name, "Density")) return; /* --nature takes it out */
  if (p < 0 || t < 0 || j->options.transfer.gas_constant <= 0) return;
  j->num_hidden           = 1;
  j->field[j->num_fields] = (remap_field_desc){.name    = "Density",
                                               .nature  = REMAP_CONSERVED,
                                               .system  = 1,
                                               .role    = REMAP_ROLE_DENSITY,
                                               .has_old = j->field[p].has_old && j->field[t].has_old};
  cli_note(j, "Density is not there: pressure over gas constant and temperature stands for it");
}

void cli_hidden_density(const cli_job *j, const double *const *value, int64_t num_cells, double *density)
{
  const double *p = value[find_role(j, REMAP_ROLE_PRESSURE, REMAP_VOLUME_MEAN)],
               *t = value[find_role(j, REMAP_ROLE_TEMPERATURE, REMAP_MASS_SPECIFIC)];

  for (int64_t c = 0; c < num_cells; c++) density[c] = p[c] / (j->options.transfer.gas_constant * t[c]);
}

/* What the report remarks of weights. */
static void note_weights(cli_job *j, bool has_density)
{
  for (int k = 0; k < j->num_fields; k++) {
    const char *name = j->field[k].name;

    if (j->row[k].weight == CLI_BY_GAS)
      cli_note(j, "field %s: it moves as energy, by the gas model with gamma %.6g", name, j->options.transfer.gamma);
    else if (j->field[k].nature == REMAP_MASS_SPECIFIC && !has_density)
      cli_note(j, "field %s: a quantity per mass, but there is no Density: it is averaged over volume", name);
  }
}

/* The gas of SOURCE, --gamma first. */
static void find_gas(cli_job *j)
{
  rcgns_gas gas;

  rcgns_get_gas(j->file[REMAP_SOURCE], &gas);
  j->options.transfer.gamma        = j->options.gamma > 0 ? j->options.gamma : gas.gamma;
  j->options.transfer.gas_constant = gas.gas_constant;
}

/* ---- vectors ------------------------------------------------------------------------------------------------------ */

/* One step towards the nearest rotation: the mean of a matrix and its inverse transposed. false: it is singular. */
static bool approach_rotation(double r[3][3])
{
  double cofactor[3][3], det = 0;

  for (int i = 0; i < 3; i++)
    for (int k = 0; k < 3; k++)
      cofactor[i][k] =
          r[(i + 1) % 3][(k + 1) % 3] * r[(i + 2) % 3][(k + 2) % 3] - r[(i + 1) % 3][(k + 2) % 3] * r[(i + 2) % 3][(k + 1) % 3];
  for (int k = 0; k < 3; k++) det += r[0][k] * cofactor[0][k];
  if (!(fabs(det) > 1e-6)) return false;
  for (int i = 0; i < 9; i++) r[i / 3][i % 3] = (r[i / 3][i % 3] + cofactor[i / 3][i % 3] / det) / 2;
  return true;
}

/* The rotation in the transform, up to a factor and the digits that people write; false: there is none but the identity,
 * *is_odd: because it is another map. */
static bool find_rotation(double t[3][4], double r[3][3], bool *is_odd)
{
  const double det = t[0][0] * (t[1][1] * t[2][2] - t[1][2] * t[2][1]) - t[0][1] * (t[1][0] * t[2][2] - t[1][2] * t[2][0]) +
                     t[0][2] * (t[1][0] * t[2][1] - t[1][1] * t[2][0]);
  double given[3][3], moved = 0, turned = 0;

  *is_odd = true;
  if (!(det > 0)) return false;
  for (int i = 0; i < 9; i++) given[i / 3][i % 3] = r[i / 3][i % 3] = t[i / 3][i % 3] / cbrt(det);
  for (int step = 0; step < 8; step++)
    if (!approach_rotation(r)) return false;
  for (int i = 0; i < 9; i++) {
    moved  = fmax(moved, fabs(r[i / 3][i % 3] - given[i / 3][i % 3]));
    turned = fmax(turned, fabs(r[i / 3][i % 3] - (i % 4 == 0)));
  }
  *is_odd = moved > 1e-4;
  return !*is_odd && turned > 1e-12;
}

/* The name of a vector's component without its axis, and the axis; -1: it is none. */
static int axis_of(const char *name, size_t *stem)
{
  static const char *const ending[6] = {"X", "Y", "Z", "_x", "_y", "_z"};
  const size_t             length    = strlen(name);

  for (int i = 0; i < 6; i++) {
    const size_t n = strlen(ending[i]);

    if (length > n && !strcmp(name + length - n, ending[i])) {
      *stem = length - n;
      return i % 3;
    }
  }
  return -1;
}

/* The component of field k's vector along an axis; -1: it is not among the fields. */
static int component(const cli_job *j, int k, size_t stem, int axis)
{
  for (int i = 0; i < j->num_fields; i++) {
    size_t mine;

    if (axis_of(j->field[i].name, &mine) == axis && mine == stem && !strncmp(j->field[i].name, j->field[k].name, stem))
      return i;
  }
  return -1;
}

static void swap_fields(cli_job *j, int a, int b)
{
  const remap_field_desc field = j->field[a];
  const cli_field_row    row   = j->row[a];

  j->field[a] = j->field[b], j->row[a] = j->row[b];
  j->field[b] = field, j->row[b] = row;
}

/* Bring the components of field k's vector into the order x, y, z, which the library wants. false: some are missing. */
static bool order_components(cli_job *j, int k, size_t stem, int part[3])
{
  for (int pass = 0; pass < 3; pass++) {
    for (int d = 0; d < 3; d++)
      if ((part[d] = component(j, k, stem, d)) < 0) return false;
    for (int d = 0; d < 2; d++)
      if (part[d] > part[d + 1]) {
        swap_fields(j, part[d], part[d + 1]);
        break;
      }
  }
  return true;
}

/* Number the vectors, but for what moves in the system, which turns by itself; what lacks a component turns nowhere. */
static void number_vectors(cli_job *j)
{
  int num = 0;

  for (int k = 0; k < j->num_fields; k++) {
    const char *name  = j->field[k].name;
    const bool  moves = j->field[k].role >= REMAP_ROLE_MOMENTUM_X && j->field[k].role <= REMAP_ROLE_VELOCITY_Z;
    size_t      stem;
    int         part[3];

    if (axis_of(name, &stem) < 0 || j->field[k].nature == REMAP_FLAG || j->field[k].vector) continue;
    if (!order_components(j, k, stem, part)) {
      cli_note(j, "field %s: it is not turned with SOURCE: the other components are not there", name);
      if (moves) j->field[k].role = REMAP_ROLE_OTHER;
    } else if (!moves || !j->field[k].system) {
      num++;
      for (int d = 0; d < 3; d++) j->field[part[d]].vector = num;
    }
  }
}

static void find_vectors(cli_job *j)
{
  bool is_odd;

  if (j->options.keep_vectors) return;
  if (find_rotation(j->transform, j->rotation, &is_odd)) {
    j->options.transfer.rotation = &j->rotation[0][0];
    number_vectors(j);
    cli_note(j, "vectors are turned with SOURCE, as --transform says");
  } else if (is_odd) {
    cli_note(j, "--transform is no rotation: vectors stay as they are");
  }
}

/* ---- the whole ---------------------------------------------------------------------------------------------------- */

void cli_systems_find(cli_job *j)
{
  bool has_density;

  find_gas(j);
  has_density = find_role(j, REMAP_ROLE_DENSITY, REMAP_CONSERVED) >= 0;
  if (!has_density) hide_density(j);
  if (has_density || j->num_hidden) {
    const int energy = find_energy(j);

    for (int k = 0; k < j->num_fields; k++) join(j, k, energy);
    leave_alone(j);
    agree_old(j);
  }
  note_weights(j, has_density || j->num_hidden);
  find_vectors(j);
}
