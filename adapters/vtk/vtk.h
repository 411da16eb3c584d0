/** @file
 * vtk.h -- supermeshes as VTK files of polyhedra, for ParaView and its like.
 *
 *   rvtk_write     a .vtu file, by all ranks together     (collective)
 *
 * The file is XML with appended raw data: UInt64 lengths, Int64 indices, Float64 numbers, in the byte order of the machine.
 * Cell data are the two ancestors, the volume and the fields. No function prints or exits. */
#ifndef REMAP_ADAPTERS_VTK_H
#define REMAP_ADAPTERS_VTK_H

#include <mpi.h>

#include <slices.h>

#ifdef __cplusplus
extern "C" {
#endif

/** Every status: name, number, text. The greater one wins when ranks differ. */
#define RVTK_STATUS_LIST(X)                     \
  X(OK, 0, "success")                           \
  X(IO, 1, "a file cannot be written")          \
  X(MEMORY, 2, "memory could not be allocated") \
  X(INTERNAL, 3, "the supermesh is inconsistent")

typedef enum rvtk_status {
#define X(name, number, text) RVTK_##name = number,
  RVTK_STATUS_LIST(X)
#undef X
} rvtk_status;

/** One line of text: why a call failed. */
typedef struct rvtk_message {
  char text[1024];
} rvtk_message;

/** A short text for a status; static text, never NULL. Not collective. */
const char *rvtk_status_text(rvtk_status status);

/** Does the name end in .vtu, in letters of any size? Not collective. */
int rvtk_is_path(const char *path);

/** Write the supermesh to `path`, which appears when it is complete and is replaced if it exists. The bytes do not depend on
 *  the number of ranks. The format has data of cells only, so what faces have is field data: "CellFaces", the faces' numbers in
 *  the order of the cells' faces, and by these numbers "FaceBoundary" (-1: none; its name in "BoundaryName"), "FaceLiesIn",
 *  "FaceCellA", "FaceNumberA", "FaceCellB", "FaceNumberB": the words of rslice_faces, cells and numbers where they are known.
 *  message, never NULL, holds one line after a failure. Collective on comm. Errors: IO, MEMORY, INTERNAL. */
rvtk_status rvtk_write(MPI_Comm comm, const char *path, const rslice_content *content, rvtk_message *message);

#ifdef __cplusplus
}
#endif
#endif
