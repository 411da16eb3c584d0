/* built.h -- a mesh as room mesh builds it, for the room's tests. */
#ifndef BUILT_H
#define BUILT_H

#include "mesh/mesh.h"
#include "meshes.h"
#include "rt.h"

static inline rm_comm duplicate(MPI_Comm of)
{
  rm_comm comm;

  RT_EQ(rm_comm_dup(of, &comm), REMAP_OK);
  return comm;
}

/* Build one mesh in its own frame. The product lives in arena. NULL if it failed, on every rank. */
static inline const rm_mesh *build(rm_arena *arena, MPI_Comm on, const remap_mesh *given, remap_faces faces, rm_frame *frame)
{
  rm_comm          comm    = duplicate(on);
  const remap_mesh mesh[2] = {*given, {0}};
  rm_reason        reason  = {-1, -1, ""};
  const rm_mesh   *out     = NULL;

  RT_EQ(rm_frame_build(&comm, mesh, frame, &reason), REMAP_OK);
  RT_EQ(rm_mesh_build(arena, &comm, REMAP_SOURCE, given, frame, faces, &out, &reason), REMAP_OK);
  RT_STR(reason.text, "");
  if (out) RT_EQ(rm_mesh_check(out), REMAP_OK);
  rm_comm_free(&comm);
  return out;
}

#endif
