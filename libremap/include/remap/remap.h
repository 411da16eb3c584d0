/** @file
 * remap.h -- conservative transfer of cell fields between two polyhedral meshes.
 *
 *   remap_create      take a communicator, get a context             (collective)
 *   remap_set_mesh    lend the source mesh, then the target mesh     (not collective)
 *   remap_build       overlay the two meshes                         (collective)
 *   remap_move        overlay them again in a new position           (collective)
 *   remap_set_masks   say which cells give and which want values     (collective)
 *   remap_partial_cells  where coverage is worst                     (collective)
 *   remap_field       move cell fields across, either way            (by all ranks; among neighbours)
 *   remap_supermesh   the overlay as a mesh of its own; booleans     (collective)
 *   remap_destroy     give everything back                           (collective)
 *
 * The overlay gives, for every source cell i and target cell j that share volume,
 *
 *   V = |i n j|,   M = integral over i n j of (x - c_i),   S = integral of (x - c_i)(x - c_i)^T,
 *
 * c_i being the centroid of the source cell. remap_pairs hands them out.
 *
 * Conventions that hold for every function below:
 *   - a collective function is called by every rank of the context's communicator and returns the
 *     same status on each of them;
 *   - ranks that call different functions of a context, or differ in what they must agree on, do not wait
 *     for each other: those that notice return REMAP_BAD_ARGUMENT, and the next call that all make alike
 *     is not affected. Two differences cannot be noticed, and leave ranks waiting as any collective call of
 *     MPI would: remap_create on some ranks of its communicator only, and a rank that destroys its context
 *     while others go on to use theirs;
 *   - ranks without cells are welcome: their counts are 0 and their arrays may be NULL;
 *   - outputs are written only when REMAP_OK is returned;
 *   - lengths are in the caller's unit, volumes in that unit cubed;
 *   - indices are 0-based (but see index_base) and local to the rank unless named "global";
 *   - no function prints, exits, or keeps state outside its context;
 *   - a context is used by one thread at a time; different contexts do not know of each other.
 */
#ifndef REMAP_REMAP_H
#define REMAP_REMAP_H

#include <mpi.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#if defined(__GNUC__)
#define REMAP_API __attribute__((visibility("default")))
#else
#define REMAP_API
#endif

#define REMAP_VERSION_MAJOR 0
#define REMAP_VERSION_MINOR 1
#define REMAP_VERSION_PATCH 0

/** Every status: name, number, text. Numbers are never reused; the greater one wins when ranks differ. */
#define REMAP_STATUS_LIST(X)                                                                  \
  X(OK, 0, "success")                                                                         \
  X(COVERAGE, 1, "target cells are not covered as the caller demands")                        \
  X(BAD_VALUE, 2, "a field value is not a finite number, or a density is not positive")       \
  X(BAD_ARGUMENT, 3, "an argument is out of its documented range")                            \
  X(BAD_ORDER, 4, "a function was called before the one it depends on")                       \
  X(BAD_MESH, 5, "a mesh breaks a documented invariant")                                      \
  X(ZONE_OVERLAP, 6, "zones of one mesh overlap")                                             \
  X(CANCELLED, 7, "the progress callback asked to stop")                                      \
  X(TOO_LARGE, 8, "a count exceeds what one rank can hold")                                   \
  X(NO_MEMORY, 9, "memory could not be allocated")                                            \
  X(MPI_FAILURE, 10, "an MPI call failed")                                                    \
  X(INCONSISTENT, 11, "the overlay contradicts itself: a check of its own failed")            \
  X(INTERNAL, 12, "libremap broke one of its own invariants")

typedef enum remap_status {
#define X(name, number, text) REMAP_##name = number,
  REMAP_STATUS_LIST(X)
#undef X
} remap_status;

/** The two meshes of a context. */
typedef enum remap_side { REMAP_SOURCE = 0, REMAP_TARGET = 1 } remap_side;

/** Which way fields move. One overlay serves both. */
typedef enum remap_direction {
  REMAP_FORWARD  = 0, /**< source to target */
  REMAP_BACKWARD = 1  /**< target to source */
} remap_direction;

/** How a polygonal face becomes triangles; the same for both cells beside it, in every zone and on every rank. */
typedef enum remap_faces {
  REMAP_FACES_CENTRE   = 0, /**< fan about the mean of the vertices; planar and concave faces as DIAGONAL */
  REMAP_FACES_DIAGONAL = 1  /**< as few triangles as possible, shorter diagonals first */
} remap_faces;

/** What a field is, hence what its transfer conserves. */
typedef enum remap_nature {
  REMAP_CONSERVED     = 0, /**< amount per volume: the integral of the field is kept */
  REMAP_MASS_SPECIFIC = 1, /**< amount per mass: its integral with the density of its system is kept; VOLUME_MEAN without one */
  REMAP_VOLUME_MEAN   = 2, /**< averaged over volume */
  REMAP_FLAG          = 3  /**< a code, never averaged: taken from the cell of largest overlap */
} remap_nature;

/** What a field is in its system. Fields of a system are carried together, so that what arrives is a state that can be: see
 *  remap_field_desc.system. */
typedef enum remap_role {
  REMAP_ROLE_OTHER         = 0, /**< by nature: CONSERVED an amount per volume, MASS_SPECIFIC one per mass */
  REMAP_ROLE_DENSITY       = 1, /**< mass per volume; every system has one */
  REMAP_ROLE_MOMENTUM_X    = 2, /**< momentum per volume */
  REMAP_ROLE_MOMENTUM_Y    = 3,
  REMAP_ROLE_MOMENTUM_Z    = 4,
  REMAP_ROLE_VELOCITY_X    = 5, /**< velocity; of what moves along an axis a system has one, the other, or nothing: then 0 */
  REMAP_ROLE_VELOCITY_Y    = 6,
  REMAP_ROLE_VELOCITY_Z    = 7,
  REMAP_ROLE_ENERGY        = 8,  /**< total energy, internal and kinetic: per volume if CONSERVED, per mass if MASS_SPECIFIC */
  REMAP_ROLE_PRESSURE      = 9,  /**< of an ideal gas, instead of the energy; needs remap_transfer.gamma */
  REMAP_ROLE_TEMPERATURE   = 10, /**< likewise; needs gas_constant too */
  REMAP_ROLE_MASS_FRACTION = 11  /**< as OTHER, one of those that add up to 1: they share a limiter, so that they still do */
} remap_role;

/** Bounds on the reconstruction inside each giving cell. */
typedef enum remap_limiter {
  REMAP_LIMITER_NONE            = 0, /**< linear (order 3: quadratic) fields are reproduced exactly; may overshoot at jumps */
  REMAP_LIMITER_BARTH_JESPERSEN = 1, /**< no value beyond those of the vertex neighbours */
  REMAP_LIMITER_AUTO            = 2, /**< BARTH_JESPERSEN where the field is not smooth; smooth extrema and slopes towards walls
                                          stay, but no sign changes that the neighbours do not have */
  REMAP_LIMITER_CAAS            = 3  /**< receiving values are clipped to the bounds around their givers; what that takes is
                                          spread over all cells, so that content is kept. Makes a transfer collective */
} remap_limiter;

/** What a receiving cell without any overlap gets. */
typedef enum remap_on_uncovered {
  REMAP_UNCOVERED_KEEP    = 0, /**< its old value, else the nearest mapped cell's */
  REMAP_UNCOVERED_NEAREST = 1, /**< the value of the nearest mapped cell, by layers of neighbours */
  REMAP_UNCOVERED_FILL    = 2, /**< fill_value */
  REMAP_UNCOVERED_ERROR   = 3  /**< remap_field returns REMAP_COVERAGE */
} remap_on_uncovered;

/** What a receiving cell that is covered in part gets. */
typedef enum remap_on_partial {
  REMAP_PARTIAL_BLEND     = 0, /**< old content on the uncovered part; NORMALISE where there is no old value */
  REMAP_PARTIAL_NORMALISE = 1, /**< the mean over the covered part, taken to the cell's centroid */
  REMAP_PARTIAL_CONSERVE  = 2, /**< the content received over the whole volume */
  REMAP_PARTIAL_ERROR     = 3  /**< remap_field returns REMAP_COVERAGE */
} remap_on_partial;

/** How much of a cell the other mesh covers. Decided by whether that mesh's skin passes through the cell, exactly; a part left
 *  over that is not even rounding of the cell's volume (2^-44 of it) does not count. */
typedef enum remap_cover {
  REMAP_UNCOVERED = 0, /**< no pair */
  REMAP_PARTIAL   = 1, /**< pairs, and a part outside of the other mesh */
  REMAP_COVERED   = 2, /**< wholly inside the other mesh */
  REMAP_UNWANTED  = 3  /**< masked: it takes no part */
} remap_cover;

/** A context: one pair of meshes on one communicator. Opaque. */
typedef struct remap_context remap_context;

/** Options of a context. Start from remap_options_default(). */
typedef struct remap_options {
  remap_faces faces;     /**< triangulation of faces, both meshes; default REMAP_FACES_CENTRE */
  int         max_order; /**< highest order that remap_field will be asked for: 1, 2 or 3; default 2. 3 costs memory: pairs get
                              second moments */
  int         systems;  /**< not 0: systems of fields will be moved at order 2, which takes second moments as well; default 0 */
  int         zone_overlap_is_error; /**< not 0: remap_build returns ZONE_OVERLAP, before it overlays, where zones of one mesh
                                          overlap by more than rounding inside the other mesh; 0 (default): remap_stats tells:
                                          see its zone_overlap */

  /** Called with one line of text for a human, without a newline; any rank may call. NULL: silence. */
  void (*log)(void *user, const char *line);
  /** Called now and then on every rank during remap_build, with the phase's name and the share of it that is done on
   *  this rank (0..1). Returning anything but 0 cancels: every rank then returns REMAP_CANCELLED. NULL: none. */
  int (*progress)(void *user, const char *phase, double done);
  void *user; /**< handed to log and progress */
} remap_options;

/** One rank's part of a mesh; the parts of all ranks are disjoint sets of cells. Borrowed: it and everything it points to
 *  are read during remap_build (and remap_move) only and never freed.
 *
 *  A face is a loop of nodes, its normal (by the right-hand rule) pointing out of face_owner. A face between cells of two
 *  ranks, or of two zones, is given once by each, with neighbour -1: faces join by the coordinates of their nodes. Nodes
 *  are shared or repeated as the caller likes. Coordinates are finite; a face has at least 3 nodes; every cell is closed.
 *  Coordinates below 2^-100, about 1e-30, of the largest coordinate of both meshes count as 0.
 *
 *  What is not set is 0 and NULL: index_base 0 and 64-bit indices then. */
typedef struct remap_mesh {
  int64_t        num_nodes, num_faces, num_cells;
  const double  *node_xyz;       /**< [num_nodes][3]                                       */
  const int64_t *face_offset;    /**< [num_faces + 1], face_offset[0] == 0                 */
  const int64_t *face_node;      /**< [face_offset[num_faces]], 0 <= node < num_nodes      */
  const int64_t *face_owner;     /**< [num_faces], 0 <= cell < num_cells                   */
  const int64_t *face_neighbour; /**< [num_faces], -1 where there is none                  */
  const int32_t *face_offset32, *face_node32, *face_owner32, *face_neighbour32; /**< each is read where the one above is NULL */
  int            index_base;     /**< 0 or 1: the number of the first node and cell in these arrays, and face_offset[0]; a
                                      neighbour below it is none                           */
  const int64_t *cell_global;    /**< [num_cells] distinct over all ranks, >= 0; NULL: numbered rank after rank;
                                      NULL on all ranks or on none, but ranks without cells are free         */
  const int64_t *cell_place;     /**< [num_cells] where the cell's values stand in the arrays of fields, not counting
                                      strides: leaves out halo cells; NULL: cell c at place c                */

  const double  *cell_volume;    /**< [num_cells] the solver's own volumes, positive, where it integrates otherwise than over
                                      triangulated faces: CONSERVED fields and systems keep their integrals by them, and cells
                                      that are the same are copied there only if both have one volume; NULL: those of the
                                      triangulated cells                                   */

  const char        *name;             /**< used in messages, say the file's name; may be NULL           */
  int64_t            num_zones;        /**< 0 if the mesh has no zones                                   */
  const char *const *zone_name;        /**< [num_zones] used in messages                                 */
  const int64_t     *zone_cell_offset; /**< [num_zones + 1] zone z holds the global cells from zone_cell_offset[z] up to
                                            zone_cell_offset[z + 1]; the same on every rank              */
} remap_mesh;

/** How remap_field transfers. Start from remap_transfer_default(). */
typedef struct remap_transfer {
  int                order;        /**< 1, 2 or 3, not above options.max_order; default 2 */
  remap_limiter      limiter;      /**< default REMAP_LIMITER_AUTO */
  remap_on_uncovered on_uncovered; /**< default REMAP_UNCOVERED_KEEP */
  remap_on_partial   on_partial;   /**< default REMAP_PARTIAL_BLEND */
  double             fill_value;   /**< for REMAP_UNCOVERED_FILL; default NaN */
  double             gamma;        /**< ratio of specific heats of an ideal gas, above 1; default 0: unknown */
  double             gas_constant; /**< R of p = rho R T; default 0: unknown */
  int                allow_nan;    /**< not 0: values that are no finite numbers pass, and spoil the cells they reach */
  const double      *rotation;     /**< [3][3] by rows, orthogonal: a vector v of the source is rotation v in the target
                                        (backward its transpose is used); read when the transfer starts; default NULL: none */
} remap_transfer;

/** One field of a call of remap_field.
 *
 *  Fields with the same number `system` > 0 form a system: a density and what moves with the mass. They are reconstructed as
 *  density, amounts per mass (velocity, others) about the centre of mass, and internal energy, so that velocity, pressure (if
 *  given: temperature) and amounts per mass stay uniform where they are; then, in the few giving cells where that is not
 *  enough, all slopes of the system are scaled down by one factor until every receiving cell has a density and an internal
 *  energy above 0 and amounts per mass within the bounds around its givers. Mass, momentum, total energy and other amounts are
 *  conserved. Velocity, pressure, temperature and MASS_SPECIFIC fields are converted, moved as amounts, and converted back;
 *  cells that are the same are copied. A transfer with a system of order 2 or 3 is collective. Its integrals are those of the
 *  amounts: of momentum for a velocity, of total energy for a pressure. */
typedef struct remap_field_desc {
  const char   *name;    /**< used in messages; may be NULL */
  remap_nature  nature;
  int           has_old; /**< not 0: out holds old values at entry, in every cell; the same on every rank */
  const double *in;      /**< [cells of the giving mesh on this rank, block after block] borrowed */
  double       *out;     /**< [cells of the receiving mesh on this rank, block after block] borrowed, written */
  int64_t       in_stride, out_stride; /**< doubles from one cell's value to the next one's: n for interleaved q[c * n + k],
                                            with in = q + k; 0 means 1 */
  int           system;  /**< 0: none */
  remap_role    role;    /**< read if system is not 0 */
  int           vector;  /**< 0: none; three fields with the same number > 0 are, in this order, x, y, z of a vector that
                              remap_transfer.rotation turns; what moves in a system is one by itself */
  const double *const *in_block;  /**< [blocks of the giving mesh] an array per block; NULL: in holds all */
  double *const       *out_block; /**< [blocks of the receiving mesh] likewise                            */
} remap_field_desc;

/** Where the nodes of a mesh go; with both members NULL they stay where they are. */
typedef struct remap_motion {
  const double *const *node_xyz; /**< [blocks][num_nodes][3] new coordinates, lent from now on; NULL: those lent last  */
  const double        *matrix;   /**< [3][4] then, of what is lent, x' = m[0] x + m[1] y + m[2] z + m[3] and so on, added in
                                      this order; NULL: as lent */
} remap_motion;

/** Which cells of this rank take part in transfers, by side; [cells, block after block] each, 0 is no; NULL: all do. */
typedef struct remap_masks {
  const uint8_t *gives[2]; /**< [side] has values that others may use: 0 in holes and fringes               */
  const uint8_t *wants[2]; /**< [side] values are to be written: 0 in holes and where the own solver works */
  double min_coverage[2];  /**< [side] receiving cells that are covered in part, by less than this share, lose their pairs and
                                count as uncovered; 0..1, the same on every rank                            */
} remap_masks;

/** What a field's transfer did, over all ranks. */
typedef struct remap_field_report {
  int     order;              /**< order used */
  double  source_integral;    /**< u V over covered giving cells, u over the pairs' volumes for partial ones */
  double  target_integral;    /**< new content less the old content that was kept */
  double  conservation_error; /**< their difference over the sum of abs(u) V */
  double  source_min, source_max, target_min, target_max;
  int64_t limited_cells;      /**< giving cells whose reconstruction the limiter changed; CAAS: receiving cells clipped */
  int64_t order_reduced_cells; /**< giving cells that order 3 found too few neighbours for: order 2 there */
  int64_t scaled_cells;     /**< giving cells whose slopes the field's system scaled down */
  int64_t blended_cells;    /**< receiving cells covered in part that keep old content outside */
  int64_t normalised_cells; /**< likewise with the mean of what covers them: REMAP_PARTIAL_NORMALISE, or no old value */
  int64_t kept_cells;       /**< receiving cells without overlap that keep their old value */
  int64_t nearest_cells;    /**< likewise, that got the nearest mapped cell's */
  int64_t filled_cells;     /**< likewise, that got fill_value */
} remap_field_report;

/** What remap_build found, over all ranks; the same on every rank but for seconds_transfer. Volumes in the caller's unit
 *  cubed. */
typedef struct remap_stats {
  int     ranks;
  int64_t cells[2];               /**< [side] */
  double  volume[2];              /**< [side] sum of abs(cell volume) */
  double  solver_volume[2];       /**< [side] the same by remap_mesh.cell_volume; volume where none are given */
  double  max_volume_difference[2]; /**< [side] largest abs(solver's volume / own - 1), 0 where none are given */
  int64_t worst_volume_cell[2];   /**< [side] its global id, the smallest if several have it; -1 where none are given */
  int64_t inverted_cells[2];      /**< [side] cells of negative volume */
  int64_t worst_inverted_cell[2]; /**< [side] global id of the one of most negative volume, -1 if there is none */
  int64_t pairs;                  /**< (source cell, target cell) that share volume */
  double  overlap_volume;         /**< sum of V over the pairs */
  int64_t cells_by_cover[2][3];   /**< [side][remap_cover] */
  double  volume_by_cover[2][3];  /**< [side][remap_cover] sum of abs(volume) of those cells, whole cells */
  double  max_closure_error[2];   /**< [side] largest abs(sum of V over the cell's pairs / cell volume - 1), covered cells */
  int64_t worst_closure_cell[2];  /**< [side] its global id, -1 if none is covered */
  double  zone_overlap[2];        /**< [side] largest volume shared by two cells of different zones of the mesh, by more than
                                       rounding (no deeper, over the smaller one's surface, than 2^-20 of the mesh's largest
                                       coordinate). Two cells count if a face of the one, without a cell behind it in any zone,
                                       meets the other, and both meet cells of the other mesh, each by their boxes: so it is
                                       where an overlap has its rim in the other mesh, while cells deep in two zones may be
                                       left out. 0: none */
  int64_t zone_overlap_cell[2][2]; /**< [side] their global ids, -1 if none */
  int64_t crossings;              /**< edges of one mesh through triangles of the other, counted on every rank, and in every
                                       block of its cells, that walks along the edge: it depends on how cells are dealt out */
  double  seconds_partition, seconds_overlay; /**< wall clock, slowest rank */
  double  seconds_transfer; /**< wall clock of all calls of remap_field since, on this rank */
} remap_stats;

/** Pairs of one direction as rows of a sparse matrix, one row per receiving cell of this rank. A view: owned by the
 *  context, valid until the next remap_build, remap_move, remap_set_masks or remap_destroy. Within a row the order is
 *  canonical: it depends on coordinates only. */
typedef struct remap_pairs_view {
  int64_t        num_rows;   /**< receiving cells on this rank */
  const int64_t *row_offset; /**< [num_rows + 1] */
  const int64_t *global_cell; /**< [row_offset[num_rows]] the giving cell */
  const int     *owner_rank; /**< [same] the rank that handed it in */
  const double  *volume;     /**< [same] V */
  const double  *moment;     /**< [same][3] integral of (x - c), c the centroid of the giving cell */
  const uint8_t *same;       /**< [same] 1: the two cells cover each other alone */
  const double  *second;     /**< [same][6] integral of (x - c)(x - c)^T: xx, yy, zz, xy, xz, yz; NULL if max_order < 3 and no
                                  systems */
} remap_pairs_view;

/** A cell that is covered in part. */
typedef struct remap_partial_cell {
  int64_t global_cell;
  double  fraction, volume; /**< covered share of the cell's volume; that volume */
  double  centroid[3];
} remap_partial_cell;

/** What of the supermesh to make, by the ancestors of its cells; bits add up. */
typedef enum remap_keep {
  REMAP_IN_BOTH   = 1, /**< cells that lie in a source and a target cell: the intersection */
  REMAP_IN_SOURCE = 2, /**< parts of source cells outside of the target: source less target */
  REMAP_IN_TARGET = 4  /**< parts of target cells outside of the source. All three: the union */
} remap_keep;

/** How remap_supermesh makes it. Start from remap_supermesh_options_default(). */
typedef struct remap_supermesh_options {
  int keep;          /**< REMAP_IN_ bits; default REMAP_IN_BOTH. REMAP_IN_BOTH | REMAP_IN_SOURCE is the whole source with the
                          target's faces in it */
  int aggregate;     /**< pieces of one face between the same two cells become one polygon: 0 (default) where they are coplanar;
                          else also where they are not, wherever that leaves cells closed; the polygons' volumes are then not
                          those of the cells */
  int split_concave; /**< not 0: concave polygons are cut into convex ones, along edges of the meshes' triangles where they have
                          those; default 0 */
  int pass_through;  /**< not 0 (default): cells that meet nothing of the other mesh are part of the result, as they were
                          given */
} remap_supermesh_options;

/** The part of a supermesh that one rank makes: a conformal mesh of polyhedra. Each cell lies in at most one source cell and
 *  at most one target cell, its ancestors; faces of the two meshes that coincide are one face. A face between cells of two
 *  ranks is on both, a node on all that need it. Numbers named global depend on the meshes' coordinates alone, start from 0
 *  and ascend on each rank; on one rank they are the places in these arrays. Everything is owned by the context and valid
 *  until the next remap_supermesh, remap_build, remap_move or remap_destroy. */
typedef struct remap_supermesh_view {
  int64_t        num_nodes, num_faces, num_cells;
  int64_t        global_nodes, global_faces, global_cells; /**< of all ranks, each counted once */
  const double  *node_xyz;          /**< [num_nodes][3] caller's unit                                     */
  const int64_t *node_global;       /**< [num_nodes]                                                      */
  const int64_t *face_offset;       /**< [num_faces + 1]                                                  */
  const int32_t *face_node;         /**< [face_offset[num_faces]] loops; normals point out of face_owner  */
  const int32_t *face_owner;        /**< [num_faces] cell of this rank                                    */
  const int32_t *face_neighbour;    /**< [num_faces] cell of this rank, -1 if there is none here          */
  const int64_t *face_global;       /**< [num_faces]                                                      */
  const int32_t *face_from[2];      /**< [side][num_faces] the face of that mesh it lies in, by its number on the rank that
                                         lent it, block after block (of two that join, one); -1: none */
  const int32_t *face_from_rank[2]; /**< [side][num_faces] that rank; any where there is none             */
  int64_t        num_beyond;        /**< faces without neighbour here behind which lies a cell of another rank; all others
                                         without are on the boundary of what was made */
  const int32_t *beyond_face;       /**< [num_beyond] ascending                                           */
  const int64_t *beyond_cell;       /**< [num_beyond] that cell, by its global number                     */
  const int64_t *cell_global;       /**< [num_cells]                                                      */
  const int64_t *cell_ancestor[2];  /**< [side][num_cells] global id of the cell of that mesh, -1: outside */
  const double  *cell_volume;       /**< [num_cells] of the exact cell, caller's unit cubed               */

  double volume[3]; /**< of all ranks' cells: those in both meshes, in the source alone, in the target alone. Exact sums of
                         cell_volume, rounded once */
  double zone_overlap[2]; /**< [side] volume, over all ranks, of cells that lie in two zones of that mesh, which overlap by
                               rounding; their ancestor is the cell of the zone that comes first */

  int64_t num_triangles[2]; /**< [side] this rank's, from here on: triangles of the faces that took part */
  int64_t num_crossings;    /**< edges of one mesh through triangles of the other */
  int64_t num_polygons;     /**< before pieces of a face were put together again  */
  double  seconds_partition, seconds_triangulation, seconds_crossings, seconds_polygons, seconds_cells, seconds_faces,
      seconds_numbering; /**< wall clock of the steps */
} remap_supermesh_view;

/** A short text for a status; static text, never NULL. Not collective. */
REMAP_API const char *remap_status_text(remap_status status);

/** "0.1.0"; static text. Not collective. */
REMAP_API const char *remap_version(void);

/** Set every option to its default. Not collective. */
REMAP_API void remap_options_default(remap_options *options);

/** Set every member to its default. Not collective. */
REMAP_API void remap_transfer_default(remap_transfer *transfer);

/** Make a context on a duplicate of comm. Collective on comm. options are copied and must agree on all ranks; NULL means
 *  the defaults. The caller owns *out and ends it with remap_destroy.
 *  Errors: BAD_ARGUMENT, NO_MEMORY, MPI_FAILURE; *out is then NULL. */
REMAP_API remap_status remap_create(MPI_Comm comm, const remap_options *options, remap_context **out);

/** Lend this rank's part of one mesh. Not collective: nothing is read before remap_build, which reports what is wrong. The
 *  struct is copied, what it points to is borrowed until remap_build returns. Setting a mesh again replaces it and makes
 *  the last overlay unusable. Errors: BAD_ARGUMENT. */
REMAP_API remap_status remap_set_mesh(remap_context *ctx, remap_side side, const remap_mesh *mesh);

/** The same for a rank whose part consists of several blocks, each a mesh with nodes and numbers of its own. Cells of a
 *  rank are numbered block after block in everything that is per cell; faces between blocks join by coordinates like those
 *  between ranks. Name and zones are the first block's, so a mesh with zones has a block, maybe without cells, on every
 *  rank. block is copied, what it points to is borrowed as in remap_set_mesh; num_blocks may be 0 and differ between ranks.
 *  Not collective.
 *  Errors: BAD_ARGUMENT, NO_MEMORY. */
REMAP_API remap_status remap_set_blocks(remap_context *ctx, remap_side side, int num_blocks, const remap_mesh *block);

/** Overlay the two meshes. Collective. Nodes are read where they were lent last, by a remap_move too, but without its matrix.
 *  Errors: BAD_ORDER (a mesh is missing on this or another rank), BAD_MESH, ZONE_OVERLAP, CANCELLED, TOO_LARGE, NO_MEMORY,
 *  MPI_FAILURE, INCONSISTENT; remap_message tells which cell. */
REMAP_API remap_status remap_build(remap_context *ctx);

/** Overlay the meshes in a new position. Collective, after remap_build; motion is [side]. The result is the same, bit by
 *  bit, as that of a remap_build with the moved coordinates; a mesh that stays is not read again. Whoever calls this keeps
 *  what remap_set_mesh and the last motion lent, unchanged, until the next remap_build or remap_destroy. A matrix is
 *  applied to the lent coordinates each time anew, so that motions do not add up. Masks end. If it fails, remap_build comes
 *  next. From one move to the next the context keeps where cells are overlaid and the triangles of a mesh that stays, which
 *  small motions use again; remap_build gives that memory back.
 *  Errors: those of remap_build; BAD_ORDER (no overlay, a mesh set since, or a transfer under way), BAD_ARGUMENT. */
REMAP_API remap_status remap_move(remap_context *ctx, const remap_motion motion[2]);

/** Say which cells take part in transfers. Collective, after remap_build; masks hold until the next remap_build, remap_move
 *  or call, and are copied. A pair of cells counts if the one gives and the other wants: coverage, pairs, integrals and
 *  reconstruction know no others, so what a masked cell holds is never read, not even as a neighbour, and a cell that does
 *  not want is never written. What is left of a receiving cell's coverage is then held against min_coverage. NULL: no masks.
 *  remap_stats stays as it is.
 *  Errors: BAD_ORDER (no overlay, or a transfer under way), BAD_ARGUMENT, NO_MEMORY, MPI_FAILURE. */
REMAP_API remap_status remap_set_masks(remap_context *ctx, const remap_masks *masks);

/** Transfer num_fields cell fields. Called by all ranks; all of transfer, num_fields, names, natures and has_old agree on
 *  all of them. The first call in a direction after a build, and one that asks for more than those before (more fields, a
 *  higher order, another limiter, nearest cells), prepares it: it is collective. So is one with REMAP_LIMITER_CAAS or a system,
 *  and one with reports, [num_fields] on every rank or NULL on every rank, which get the same content everywhere. Any other
 *  call exchanges messages with neighbours only (and notes with three ranks at most that need not be) and takes no memory: its
 *  status is the worst of this rank's own and of those neighbours' whose values it uses, and may differ from rank to rank;
 *  remap_agree makes it one. transfer NULL means the defaults. Values below 1e-280 count as 0.
 *  Errors: BAD_ORDER (no overlay), BAD_ARGUMENT, BAD_VALUE (a NaN or infinite value, a density in a system that is not
 *  positive), COVERAGE, NO_MEMORY, MPI_FAILURE. */
REMAP_API remap_status remap_field(remap_context *ctx, remap_direction direction, const remap_transfer *transfer,
                                   int num_fields, const remap_field_desc *fields, remap_field_report *reports);

/** remap_field in two halves, so that the caller's own work overlaps with the messages. The start reads values, checks them
 *  and sends the first; it waits for nobody, unless it prepares (see remap_field). The finish does the rest and writes.
 *  fields and transfer are copied and values of `in` read by the start; `out` is lent until the finish and must not change.
 *  One transfer in each direction and context may be under way; all ranks start and finish them in the same order, and none
 *  builds, moves or masks in between, or calls remap_field where others call the halves. A start that fails leaves nothing
 *  under way on this rank; others, whose arguments are sound, hear of it in the finish. What is wrong with this rank's own
 *  values is told by the finish. In halves, each rank also exchanges a note with three ranks at most about reports, which agree
 *  as in remap_field.
 *  Errors: those of remap_field; BAD_ORDER also where the other half is missing. */
REMAP_API remap_status remap_field_start(remap_context *ctx, remap_direction direction, const remap_transfer *transfer,
                                         int num_fields, const remap_field_desc *fields);

/** The other half of remap_field_start, which says what holds for both. */
REMAP_API remap_status remap_field_finish(remap_context *ctx, remap_direction direction, remap_field_report *reports);

/** The greatest of the ranks' statuses, for callers who want their own failures to be shared. Collective. */
REMAP_API remap_status remap_agree(remap_context *ctx, remap_status mine);

/** The text that belongs to the last failure: names the mesh, zone and cell, and what to do. The same on every rank after a
 *  collective failure; empty if nothing failed. Owned by the context, valid until its next call. Not collective. */
REMAP_API const char *remap_message(const remap_context *ctx);

/** Statistics of the last remap_build. Not collective. Errors: BAD_ORDER. */
REMAP_API remap_status remap_get_stats(remap_context *ctx, remap_stats *out);

/** The pairs, as rows of the receiving mesh. Not collective. *out is a view owned by the context, made at the first call.
 *  Errors: BAD_ORDER, BAD_ARGUMENT, NO_MEMORY. */
REMAP_API remap_status remap_pairs(remap_context *ctx, remap_direction direction, remap_pairs_view *out);

/** How much of each cell of one side is covered by cells of the other mesh that give. Not collective. fraction and cover,
 *  [cells of that side on this rank], are the caller's; either may be NULL.
 *  Errors: BAD_ORDER. */
REMAP_API remap_status remap_coverage(remap_context *ctx, remap_side side, double *fraction, remap_cover *cover);

/** The cells of one side on this rank that want values and get none, because nothing that gives covers any of them,
 *  ascending. Not collective. num receives their number; cell [*num] is the caller's and may be NULL.
 *  Errors: BAD_ORDER, BAD_ARGUMENT. */
REMAP_API remap_status remap_uncovered(remap_context *ctx, remap_side side, int64_t *num, int64_t *cell);

/** The cells of one side, over all ranks, that are covered in part and least of all: ascending by fraction. Collective; the
 *  same on every rank. At entry *num is the room in cell, the caller's and the same on every rank; then how many there are in
 *  it. Masks count as in remap_coverage.
 *  Errors: BAD_ORDER, BAD_ARGUMENT, NO_MEMORY, MPI_FAILURE. */
REMAP_API remap_status remap_partial_cells(remap_context *ctx, remap_side side, int *num, remap_partial_cell *cell);

/** Volumes (signed: negative for an inverted cell) and centroids of the cells of one side. Not collective. volume [cells]
 *  and centroid [cells][3] are the caller's; either may be NULL. Errors: BAD_ORDER. */
REMAP_API remap_status remap_cells(remap_context *ctx, remap_side side, double *volume, double *centroid);

/** Set every member to its default. Not collective. */
REMAP_API void remap_supermesh_options_default(remap_supermesh_options *options);

/** Make the supermesh of the two meshes, or a part of it. Collective. Needs no remap_build: without an overlay the meshes are
 *  read here and are lent until this returns; after a remap_build or remap_move it is made of the meshes as they stand.
 *  Neither the overlay nor a transfer is touched. Each rank makes an even share of the cells. A closed surface is a mesh of
 *  one cell. Cells of one mesh must not overlap, cross each other or be inverted; faces may be warped, coincide with others,
 *  have no area, and cells no volume. Zones of one mesh (num_zones) may touch without matching faces: they are joined first,
 *  with the nodes that are missing, some rounded, in their faces; in planes askew to the axes that may leave cells that
 *  overlap by rounding, which is BAD_MESH. Zones as they are lent may overlap by rounding: see zone_overlap of the view.
 *  Cells that overlap all the same are noticed where their parts meet on one rank: whether they are refused can depend on the
 *  number of ranks. options must agree on all ranks; NULL means the defaults.
 *  Errors: BAD_ORDER (a mesh is missing), BAD_ARGUMENT, BAD_MESH, ZONE_OVERLAP (by more than rounding), TOO_LARGE, NO_MEMORY,
 *  MPI_FAILURE, CANCELLED, INCONSISTENT; remap_message tells which cell, where it is one. */
REMAP_API remap_status remap_supermesh(remap_context *ctx, const remap_supermesh_options *options, remap_supermesh_view *out);

/** Take what belongs to cells of one mesh over to the cells of the supermesh: out[c] = in[the ancestor of c in that mesh], or
 *  none where it has none. in [cells of that side on this rank, block after block] and out [num_cells of the view] are the
 *  caller's. Collective, after remap_supermesh. Errors: BAD_ORDER, BAD_ARGUMENT, NO_MEMORY, MPI_FAILURE. */
REMAP_API remap_status remap_supermesh_cell_values(remap_context *ctx, remap_side side, const double *in, double none,
                                                   double *out);

/** The same for faces, say with the number of a boundary condition: out[f] = in[the face of that mesh in which f lies], or
 *  none. in [faces of that side on this rank, block after block] and out [num_faces of the view] are the caller's. */
REMAP_API remap_status remap_supermesh_face_values(remap_context *ctx, remap_side side, const int32_t *in, int32_t none,
                                                   int32_t *out);

/** The same for numbers of 64 bits, say those that faces have in a file. */
REMAP_API remap_status remap_supermesh_face_numbers(remap_context *ctx, remap_side side, const int64_t *in, int64_t none,
                                                    int64_t *out);

/** End a context and set *ctx to NULL. Collective, and harmless on a NULL context. No rank waits for another, so ranks may end
 *  several contexts in different orders where MPI_Comm_free allows it. */
REMAP_API void remap_destroy(remap_context **ctx);

#ifdef __cplusplus
}
#endif
#endif
