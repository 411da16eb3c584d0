/* priority.h -- what priority.c and pieces.c share: SOURCE cut into what is visible of it. */
#ifndef REMAP_CLI_PRIORITY_H
#define REMAP_CLI_PRIORITY_H

#include "job.h"

/** The cells of one class: of the file, or the pieces that are left of them. */
typedef struct cli_part {
  remap_mesh           mesh;
  remap_context       *maker;       /**< of pieces: what holds the arrays; NULL: they are owned here */
  remap_supermesh_view view;        /**< of pieces: their supermesh in maker */
  remap_context       *transfer;    /**< of pieces: overlay with the cells they are parts of, while it is needed; else NULL */
  int64_t             *cell_global; /**< owned, as are these */
  int64_t             *face_offset, *face_node, *face_owner, *face_neighbour;
  int64_t             *number;      /**< of pieces: [view.num_cells] where they are in mesh, -1: rounding, left out */
  int64_t              num_visible; /**< of pieces: over all ranks */
  int64_t              num_whole;   /**< cells of the file in this class */
  int64_t             *place;       /**< [num_whole] their places in arrays of the file's cells */
  uint8_t             *gives;       /**< [cells] the mask; this and the following are NULL if nobody asked for them */
  double              *volume;      /**< [cells] the solver's own */
  double              *origin;      /**< [cells] global numbers in the file, of pieces those of the cells they are parts of */
  int32_t             *boundary;    /**< [faces] number of the boundary they are on, -1: none */
} cli_part;

struct cli_cut {
  int              num_classes, num_parts;
  cli_part        *part;         /**< [num_parts], room for [num_classes] */
  remap_mesh      *block;        /**< [num_parts], likewise */
  double         **values;       /**< [num_parts] [fields][cells], while they are made */
  int64_t         *first_global; /**< [num_parts + 1] cells of part k are numbered from there on; of the first as in the file */
  double          *in;           /**< [fields][num_cells] */
  int64_t          num_cells, num_faces;
  int64_t         *cell_global; /**< [num_cells] */
  const char     **zone_name;
  int64_t         *zone_cell_offset;
  rcgns_zone_info *zone;
  char (*piece_name)[48];      /**< [num_parts] of the zones that stand for pieces */
  rcgns_info       info;       /**< the file's, and one more zone for the pieces of each class */
  rcgns_boundaries boundaries; /**< of the file, for the faces of all parts; none unless a supermesh is asked for */
  int32_t         *boundary;   /**< [num_faces] */
};

/** Fields that are carried. Not collective. */
int cli_num_carried(const cli_job *j);

/** A context for steps of the cut. Collective. Errors: INTERNAL. */
cli_exit cli_cut_context(cli_job *j, remap_context **out, cli_failure *why);

/** A status of the library in a step of the cut. Not collective. */
cli_exit cli_from_cut(const cli_job *j, remap_context *ctx, remap_status status, cli_failure *why);

/** Is a face of a mesh on a cell that has a number (not -1)? Not collective. */
bool cli_is_taken(const remap_mesh *mesh, const int64_t *number, int64_t face);

/** The cells of a mesh that have a number, below num_cells and ascending, as the mesh of the part, but for cell_global; nodes
 *  are shared with it. false: no memory. Not collective. */
bool cli_part_take(const remap_mesh *mesh, const int64_t *number, int64_t num_cells, cli_part *part);

/** Let pieces have what belongs to the cells they are parts of: mask, volumes, numbers, boundaries; in and out are the values
 *  of all fields, [fields][cells]. Pieces that are no more than rounding of their cells are left out of all. Collective.
 *  Errors: GEOMETRY, INTERNAL. */
cli_exit cli_pieces_fill(cli_job *j, const cli_part *whole, cli_part *piece, const double *in, double *out, cli_failure *why);

/** Give a part back. Collective. */
void cli_part_drop(cli_part *part);

#endif
