/* regular -- can cells that meet nothing stay as they were given? Not where what is made beside them differs from the given
 * faces: where a face of theirs lies on other faces of its mesh, as cells pinched to no thickness have it, or where
 * triangles without area were left out, whose vertices the made cells have on their edges. O(n). */
#include "super/super_private.h"

#include <string.h>

/* True if a cell beside triangle t meets nothing of the other mesh. */
static bool is_beside_passing(const rm_trimesh *m, const uint8_t *flag, rm_lid t)
{
  for (int h = 0; h < 2; h++)
    if (m->side[t][h] >= 0 && !(flag[m->side[t][h]] & RM_COVER_MET)) return true;
  return false;
}

/* Triangles without area touch no cell that passes. */
static remap_status check_flat(rm_arena *passing, const rm_trimesh *m, const uint8_t *flag, bool *regular)
{
  uint8_t *at_flat;

  RM_NEW0(at_flat, passing, m->num_vertices);
  for (rm_lid t = 0; t < m->num_triangles; t++)
    for (int h = 0; h < 3 && !rm_has_area(m, t); h++) at_flat[m->triangle[t][h]] = 1;
  for (rm_lid t = 0; t < m->num_triangles; t++)
    for (int h = 0; h < 3; h++)
      if (at_flat[m->triangle[t][h]] && is_beside_passing(m, flag, t)) *regular = false;
  return REMAP_OK;
}

/* No triangle on which others lie has cells that are made and cells that pass around it. Copies of a triangle stand side by
 * side; which of a face's triangles has them does not matter. */
static void check_stacks(const rm_trimesh *m, const uint8_t *flag, bool *regular)
{
  for (rm_lid t = 0, last; t < m->num_triangles; t = last) {
    bool made = false, passes = false;

    for (last = t; last < m->num_triangles && (last == t || !memcmp(m->triangle[last], m->triangle[t], sizeof *m->triangle));
         last++)
      for (int h = 0; h < 2; h++) {
        const rm_lid c = m->side[last][h];
        made           = made || (c >= 0 && flag[c] & RM_COVER_MET);
        passes         = passes || (c >= 0 && !(flag[c] & RM_COVER_MET));
      }
    if (last > t + 1 && made && passes) *regular = false;
  }
}

remap_status rm_super_is_regular(const rm_super_job *job, const rm_cover *cover, const rm_trimesh *const given[2],
                                 const rm_trimesh *const mesh[2], bool *regular)
{
  rm_arena    *passing = rm_arena_new();
  remap_status status  = passing ? REMAP_OK : REMAP_NO_MEMORY;

  *regular = true;
  for (int side = 0; side < 2 && status == REMAP_OK; side++) {
    if (!rm_super_passes(job, side)) continue;
    if (given[side] != mesh[side]) status = check_flat(passing, given[side], cover->flag[side], regular);
    check_stacks(mesh[side], cover->flag[side], regular);
  }
  rm_arena_drop(passing);
  return status;
}
