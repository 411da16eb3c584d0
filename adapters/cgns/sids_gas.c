/* sids_gas -- the ideal gas that a file was computed with, from its FlowEquationSet_t or ReferenceState_t. The tree alone says
 * it, alike on all ranks. */
#include "cgns_private.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* The number in a node of that name; 0: there is none. */
static double number_in(const rc_tree *tree, int64_t parent, const char *name)
{
  const int64_t  at = rc_tree_find(tree, parent, -1, NULL, name);
  const rc_node *n  = at < 0 ? NULL : rc_node_at(tree, at);

  if (!n || n->small < 0 || rc_count(n) < 1) return 0;
  if (n->kind == 'R') return *(const double *)(const void *)rc_text(tree, n->small);
  return n->kind == 'I' ? (double)*rc_small_ints(tree, n) : 0;
}

/* What a GasModel_t or ReferenceState_t says, directly or by specific heats. */
static rcgns_gas read_gas(const rc_tree *tree, int64_t node)
{
  const double cp = number_in(tree, node, "SpecificHeatPressure"), cv = number_in(tree, node, "SpecificHeatVolume");
  rcgns_gas    gas = {.gamma        = number_in(tree, node, "SpecificHeatRatio"),
                      .gas_constant = number_in(tree, node, "IdealGasConstant")};

  if (gas.gamma == 0 && cv > 0) gas.gamma = cp / cv;
  if (gas.gas_constant == 0 && cp > 0 && cv > 0) gas.gas_constant = cp - cv;
  if (gas.gas_constant == 0 && cv > 0 && gas.gamma > 1) gas.gas_constant = cv * (gas.gamma - 1);
  if (!isfinite(gas.gamma) || gas.gamma <= 1) gas.gamma = 0;
  if (!isfinite(gas.gas_constant) || gas.gas_constant <= 0) gas.gas_constant = 0;
  return gas;
}

/* Is the gas of this model one with a constant ratio of specific heats? */
static bool is_perfect(const rc_tree *tree, int64_t model)
{
  static const char *const other[] = {"VanderWaals", "ConstantDensity", "ThermallyPerfect", "RedlichKwong"};
  char                     text[RC_NAME];

  rc_tree_string(tree, model, text, sizeof text);
  for (size_t i = 0; i < sizeof other / sizeof *other; i++)
    if (!strcmp(text, other[i])) return false;
  return true;
}

/* Fill in what is still unknown from the nodes of that label below parent. */
static void add_gas(const rc_tree *tree, int64_t parent, const char *label, rcgns_gas *gas)
{
  for (int64_t at = -1; parent >= 0 && (at = rc_tree_find(tree, parent, at, label, NULL)) >= 0;) {
    const rcgns_gas more = !strcmp(label, "GasModel_t") && !is_perfect(tree, at) ? (rcgns_gas){0, 0} : read_gas(tree, at);

    if (gas->gamma == 0) gas->gamma = more.gamma;
    if (gas->gas_constant == 0) gas->gas_constant = more.gas_constant;
  }
}

/* Of one zone: the zone's own nodes before its base's, equations before reference states. */
static rcgns_gas gas_of(const rcgns_file *file, const rc_zone *zone)
{
  const int64_t parent[2] = {zone->node, zone->base};
  rcgns_gas     gas       = {0, 0};

  for (int i = 0; i < 2; i++) {
    const int64_t set = rc_tree_find(&file->tree, parent[i], -1, "FlowEquationSet_t", NULL);

    if (set >= 0) add_gas(&file->tree, set, "GasModel_t", &gas);
  }
  for (int i = 0; i < 2; i++) add_gas(&file->tree, parent[i], "ReferenceState_t", &gas);
  return gas;
}

void rcgns_get_gas(const rcgns_file *file, rcgns_gas *out)
{
  *out = gas_of(file, file->zone);
  for (int64_t z = 1; z < file->num_zones; z++) {
    const rcgns_gas gas = gas_of(file, file->zone + z);

    if (gas.gamma != out->gamma) out->gamma = 0;
    if (gas.gas_constant != out->gas_constant) out->gas_constant = 0;
  }
}
