/** @file
 * cgns.h -- CGNS files for remap: meshes and cell fields in, results out, in parallel.
 *
 *   rcgns_open             read a file's tree and this rank's part of its mesh    (collective)
 *   rcgns_mesh             that part, as remap_set_mesh wants it                  (not collective)
 *   rcgns_read_boundaries  which of its faces are on which boundary condition     (collective)
 *   rcgns_select_solution  choose the FlowSolution_t whose fields are meant       (collective)
 *   rcgns_read_field       one cell field, in the order of this rank's cells      (collective)
 *   rcgns_read_cells       one of any node: masks, volumes                        (collective)
 *   rcgns_write            the file's whole tree plus new fields, to a new file   (collective)
 *   rcgns_close            give everything back                                   (collective)
 *   rcgns_write_supermesh  a supermesh, its ancestors and boundaries, to a new file   (collective)
 *   rcgns_create           a small file from nothing: demos and tests             (not collective)
 *
 * Conventions that hold for every function below:
 *   - a collective function is called by every rank of the communicator that the file was opened on, and returns the same
 *     status and the same message on each of them;
 *   - `message`, never NULL, holds one line without a newline after a failure (it names the file, zone and cell or field, and
 *     what to do) and is empty after success;
 *   - outputs are written only when RCGNS_OK is returned;
 *   - cells are numbered zone after zone, in the order of the file, from 0; each rank owns one contiguous range of them, in
 *     the order of the ranks, the ranges being of equal length to within one. Only volume cells count: surface sections and
 *     two-dimensional zones are left out;
 *   - a file opened for RCGNS_VERTICES hands out its median-dual mesh: cell k of a zone is then the one about its vertex k, and
 *     CellCenter reads Vertex below;
 *   - zones are called "Base/Zone";
 *   - ADF and HDF5 files of any version are read; output is HDF5;
 *   - no function prints or exits; input files are never opened for writing.
 *
 * Cost: every rank reads its own slices. Memory is proportional to the rank's share of the cells, plus the tree of the file
 * (names and sizes) on every rank.
 */
#ifndef REMAP_ADAPTERS_CGNS_H
#define REMAP_ADAPTERS_CGNS_H

#include <mpi.h>
#include <stddef.h>
#include <stdint.h>

#include <remap/remap.h>
#include <slices.h>

#ifdef __cplusplus
extern "C" {
#endif

/** Every status: name, number, text. The greater one wins when ranks differ. */
#define RCGNS_STATUS_LIST(X)                                         \
  X(OK, 0, "success")                                                \
  X(USAGE, 1, "what was asked for does not fit this file")           \
  X(IO, 2, "a file cannot be read or written, or is not valid CGNS") \
  X(GEOMETRY, 3, "the file's mesh is broken")                        \
  X(MEMORY, 4, "memory could not be allocated, or MPI failed")

typedef enum rcgns_status {
#define X(name, number, text) RCGNS_##name = number,
  RCGNS_STATUS_LIST(X)
#undef X
} rcgns_status;

/** One line of text: why a call failed. */
typedef struct rcgns_message {
  char text[1024];
} rcgns_message;

/** An opened file. Opaque. */
typedef struct rcgns_file rcgns_file;

/** Where values are located. */
typedef enum rcgns_location {
  RCGNS_CELLS    = 0, /**< CellCenter: the file's own cells */
  RCGNS_VERTICES = 1  /**< Vertex: "cells" are the median-dual cells about the vertices, one for each, everywhere below */
} rcgns_location;

/** How a file is opened. Start from rcgns_options_default(). The same on all ranks. */
typedef struct rcgns_options {
  const char    *base;            /**< read this CGNSBase_t only; NULL (default): every base that holds volume cells */
  double         scale;           /**< coordinates are multiplied by it first; default 1 */
  rcgns_location location;        /**< default RCGNS_CELLS */
  double         transform[3][4]; /**< then x' = A x + b, rows [A | b]; default: identity. A must not be singular */
  int            face_numbers;    /**< not 0: rcgns_face_numbers will be asked for; 8 bytes per face. Default 0 */
} rcgns_options;

/** One zone with volume cells. */
typedef struct rcgns_zone_info {
  const char *name;          /**< "Base/Zone", owned by the file */
  int         is_structured; /**< 1: a block; 0: element sections */
  int64_t     num_nodes;     /**< of the whole zone */
  int64_t     num_cells;     /**< volume cells of the whole zone */
  int64_t     first_cell;    /**< global number of its first cell */
} rcgns_zone_info;

/** What rcgns_open found; the same on every rank. Everything is owned by the file and lives until rcgns_close. */
typedef struct rcgns_info {
  const char            *path;      /**< as given */
  const char            *format;    /**< "HDF5" or "ADF" */
  double                 version;   /**< CGNSLibraryVersion, 0 if the file has none */
  rcgns_location         location;  /**< as asked for */
  int64_t                num_cells; /**< volume cells that are read, all zones and ranks */
  int64_t                num_bases; /**< bases that are read */
  const char *const     *base;      /**< [num_bases] their names */
  int64_t                num_zones; /**< zones that are read, at least 1 */
  const rcgns_zone_info *zone;      /**< [num_zones] */
  int64_t                num_notes; /**< remarks for the report, such as "higher-order elements are taken by their corners" */
  const char *const     *note;      /**< [num_notes]; rcgns_select_solution may add some */
} rcgns_info;

/** Which FlowSolution_t. Start from rcgns_choice_default(). The same on all ranks. */
typedef struct rcgns_choice {
  const char *name;     /**< its name; NULL: by step or, with step 0, the only one with CellCenter data in every zone */
  int64_t     step;     /**< 1 ..: that step of BaseIterativeData_t; RCGNS_STEP_LAST; 0 (default): none is asked for */
  int         optional; /**< not 0: no such node, or one without data, is no error, and fields that some zone lacks are left
                             out in silence: for the old values of a target. Default 0 */
} rcgns_choice;

#define RCGNS_STEP_LAST (-1)

/** A CellCenter field of the chosen solution. */
typedef struct rcgns_field {
  const char  *name;         /**< owned by the file, until the next rcgns_select_solution */
  const char  *stored;       /**< "R4", "R8", "I4" or "I8": how the first zone stores it */
  int          is_integer;   /**< 1 if stored is I4 or I8 */
  remap_nature nature;       /**< by rcgns_nature */
  int          nature_known; /**< 0: the name is not in the table and nature is VOLUME_MEAN for want of a better one */
  int          missing_in;   /**< index of the first zone that lacks it, -1 if every zone has it; rcgns_read_field refuses a
                                  field that a zone lacks */
} rcgns_field;

/** The chosen solution; the same on every rank; owned by the file until the next rcgns_select_solution. */
typedef struct rcgns_solution {
  const char        *name;       /**< of the node, in the first zone; NULL if there is none (optional) */
  int64_t            num_fields; /**< CellCenter fields */
  const rcgns_field *field;      /**< [num_fields] in the order of the first zone that has them */
} rcgns_solution;

/** A field to be written. */
typedef struct rcgns_new_field {
  const char   *name;   /**< 1 to 32 characters, without '/' */
  const double *values; /**< [cells of this rank] borrowed */
} rcgns_new_field;

/** A zone for rcgns_create: a block (num_vertices set) or polyhedra (mesh set). Borrowed. */
typedef struct rcgns_new_zone {
  const char            *name;            /**< 1 to 32 characters, without '/' */
  int64_t                num_vertices[3]; /**< along i, j, k, each at least 2; all 0: polyhedra */
  const double          *node_xyz;        /**< block: [k][j][i][3], i fastest; else not read */
  const remap_mesh      *mesh;            /**< polyhedra: written as NGON_n and NFACE_n; cell_global and zones are not read */
  int64_t                num_fields;      /**< CellCenter fields, the same names in every zone by habit; may be 0 */
  const rcgns_new_field *field;           /**< [num_fields] values in the order of the zone's cells, i fastest */
} rcgns_new_zone;

/** A short text for a status; static text, never NULL. Not collective. */
const char *rcgns_status_text(rcgns_status status);

/** Set every member to its default. Not collective. */
void rcgns_options_default(rcgns_options *options);

/** Set every member to its default. Not collective. */
void rcgns_choice_default(rcgns_choice *choice);

/** What a field is by its SIDS name (and by its type: integers are codes). *known, if not NULL, says whether the name is in
 *  the table. Not collective. */
remap_nature rcgns_nature(const char *name, int is_integer, int *known);

/** Read the tree of the file and this rank's part of the mesh. Collective on comm, which is duplicated. options NULL: the
 *  defaults. The caller owns *out and ends it with rcgns_close; it is NULL after a failure.
 *  Errors: USAGE (no such base), IO (missing, truncated, not CGNS, no volume cells, no coordinates, a size that does not
 *  match, vertices of higher-order elements), GEOMETRY (NaN or infinite coordinates, a node number out of range, a face with
 *  more than two cells, a polyhedron with too few faces), MEMORY. That every cell is closed is remap_build's to check. */
rcgns_status rcgns_open(MPI_Comm comm, const char *path, const rcgns_options *options, rcgns_file **out,
                        rcgns_message *message);

/** What the file holds. Not collective. */
const rcgns_info *rcgns_get_info(const rcgns_file *file);

/** This rank's part of the mesh, owned by the file until rcgns_close. Faces between two cells of this rank and one zone are
 *  joined; all others have neighbour -1. cell_global, name and zones are set. Not collective. */
const remap_mesh *rcgns_mesh(const rcgns_file *file);

/** What the file calls the faces of this rank's mesh, [faces of rcgns_mesh]: element numbers of NGON_n in zones of polyhedra,
 *  in others the number of the face in its owner, the lower cell of this rank beside it, as SIDS counts the faces of an element
 *  from 1 (a cell of a block is a HEXA_8). Owned by the file. NULL if options.face_numbers was 0, or cells are dual ones, or
 *  there are no faces. Not collective. */
const int64_t *rcgns_face_numbers(const rcgns_file *file);

/** The boundary conditions of a mesh; owned by the file until rcgns_close. Names and types are the same on every rank. */
typedef struct rcgns_boundaries {
  int                num;
  const char *const *name; /**< [num] of BC_t; conditions of one name and type in several zones are one */
  const char *const *type; /**< [num] "BCWall" and so on; of a family's condition where the family has one */
  const int32_t     *face; /**< [faces of rcgns_mesh] number of the boundary, -1: none */
} rcgns_boundaries;

/** Which faces of this rank's mesh are on which BC_t: by ranges and lists of faces, elements or vertices; a face is on one of
 *  vertices if all of its own are listed. Where two name one face, the first has it. A list of a block at FaceCenter
 *  does not say across which axis: InwardNormalIndex does, or that there is one side of the block only where all of it may be.
 *  A condition that is given in another way is left out and noted. Collective.
 *  Errors: IO (a list cannot be read), MEMORY. */
rcgns_status rcgns_read_boundaries(rcgns_file *file, rcgns_boundaries *out, rcgns_message *message);

/** Choose the FlowSolution_t. Collective. choice NULL: the default. *out is a view owned by the file, valid until the next
 *  call of this function.
 *  Errors: USAGE (no node of that name, no such step, several nodes would do: the message lists them), IO (the node is not
 *  CellCenter, is partial, or holds no fields). */
rcgns_status rcgns_select_solution(rcgns_file *file, const rcgns_choice *choice, rcgns_solution *out, rcgns_message *message);

/** Read a field of the chosen solution. Collective. values, [cells of this rank], is the caller's. NaN and infinite values
 *  are handed over as they are.
 *  Errors: USAGE (no such field, or no solution chosen), IO (a zone lacks it, its size does not match the zone, or it cannot
 *  be read), MEMORY. */
rcgns_status rcgns_read_field(rcgns_file *file, const char *name, double *values, rcgns_message *message);

/** Read cell values that need not be in the chosen solution, such as masks: name is FIELD or NODE/FIELD, NODE a FlowSolution_t
 *  or DiscreteData_t; of FIELD alone the first counts, zone by zone: in the chosen solution if it is there, else in the order
 *  of the file. Collective. values as in rcgns_read_field.
 *  Errors: USAGE (a zone has no such CellCenter array of its size), IO (it cannot be read), MEMORY. */
rcgns_status rcgns_read_cells(rcgns_file *file, const char *name, double *values, rcgns_message *message);

/** An ideal gas, p = (gamma - 1) rho e = rho R T. */
typedef struct rcgns_gas {
  double gamma;        /**< ratio of specific heats, above 1; 0: not told, or not the same in all zones */
  double gas_constant; /**< R, above 0, in the file's units; 0: likewise */
} rcgns_gas;

/** The gas of GasModel_t (SpecificHeatRatio, IdealGasConstant) in FlowEquationSet_t, else of ReferenceState_t, of the zones or
 *  their bases; specific heats do as well. Models without a constant ratio count as not told. Not collective. */
void rcgns_get_gas(const rcgns_file *file, rcgns_gas *out);

/** Refuse an output path that cannot be right: one of the files that `file` was read from, something that is not a regular
 *  file, or a place that cannot be written. Nothing is changed. Collective. Errors: USAGE, IO. */
rcgns_status rcgns_check_output(const rcgns_file *file, const char *path, rcgns_message *message);

/** Refuse a solution name that rcgns_write would refuse for this target: no name for a node, or the name of a node that cannot
 *  take CellCenter fields. Nothing is changed. Collective. Errors: USAGE. */
rcgns_status rcgns_check_solution(rcgns_file *file, const char *solution, rcgns_message *message);

/** Write `path`: everything that `file` (the target) holds, unknown nodes included, as HDF5 with the target's version, plus
 *  the fields as R8 in the CellCenter FlowSolution_t named `solution` of every zone that was read. Where the target has that
 *  node, fields of the same name are replaced and the others stay; its Rind is taken away. Links to other files become
 *  absolute; links on the way to a solution node are replaced by what they point to. Fields and names agree on all ranks.
 *  The file appears at `path` when it is complete; after a failure `path` is as it was. The bytes do not depend on the number
 *  of ranks. Collective.
 *  Errors: USAGE (a bad name, `path` is an input), IO (cannot be written, disk full, the node is not CellCenter), MEMORY. */
rcgns_status rcgns_write(rcgns_file *file, const char *path, const char *solution, int64_t num_fields,
                         const rcgns_new_field *fields, rcgns_message *message);

/** End a file and set *file to NULL. Collective, and harmless on a NULL file. */
void rcgns_close(rcgns_file **file);

/** Write a supermesh to a new HDF5 file at `path`, stamped `version` (see rcgns_create): one zone "Base/Zone" of NGON_n and
 *  NFACE_n; "FaceAncestors" below NGON_n: "LiesIn", the origins of rslice_faces, and where they are known the cells and numbers
 *  of those faces, named like the ancestors with "Cell" and "Face" behind; a BC_t with a PointList of faces for each boundary
 *  that has outer faces, its name cut to what CGNS takes; the ancestors (integers, counted from 1, 0: none), "Volume" and the
 *  fields in the CellCenter FlowSolution_t "FlowSolution#Centers". The file appears when it is complete; an existing one is
 *  replaced. The bytes do not depend on the number of ranks. Collective on comm.
 *  Errors: USAGE (a bad name, no cells), IO, GEOMETRY (the supermesh is inconsistent), MEMORY. */
rcgns_status rcgns_write_supermesh(MPI_Comm comm, const char *path, double version, const rslice_content *content,
                                   rcgns_message *message);

/** Write a small HDF5 file with one base "Base" and the given zones, stamped `version` (4.2 suits most readers, 3.4 suits
 *  Debian's tools). solution: name of the CellCenter FlowSolution_t, NULL if no zone has fields. An existing file is
 *  replaced. Not collective: one rank calls it. Errors: USAGE, IO, MEMORY. */
rcgns_status rcgns_create(const char *path, double version, const char *solution, int64_t num_zones,
                          const rcgns_new_zone *zones, rcgns_message *message);

#ifdef __cplusplus
}
#endif
#endif
