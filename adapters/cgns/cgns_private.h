/* cgns_private.h -- what the files of the adapter share. Nobody else includes it, but the adapter's tests.
 *
 *   common.c     status and message, agreement of ranks, exchange of records
 *   tree.c       the file's tree as plain data, the same on every rank
 *   cgio_tree.c  ADF files through cgio           (the only file that includes cgns_io.h)
 *   h5_tree.c    HDF5 files: tree and slabs       (with h5_write.c the only files that include hdf5.h, by h5.h)
 *   h5_write.c   HDF5 output from a plan
 *   file.c       rcgns_open, rcgns_close, reading of slabs from either kind of file
 *   sids_zone.c  zones and element sections: what is a volume cell
 *   sids_rows.c  rows of sections that have no index
 *   sids_mesh.c  this rank's part of the mesh
 *   sids_dual.c  the cells about its vertices instead
 *   sids_elements.c  its elements of unstructured zones
 *   sids_poly.c  its polyhedra: NGON_n, NFACE_n, ParentElements
 *   sids_bc.c      BC_t: which faces are on which boundary
 *   sids_gas.c     FlowEquationSet_t and ReferenceState_t: the gas
 *   sids_fields.c  FlowSolution_t: choice, names, values
 *   sids_write.c   the plan of an output file, rcgns_write
 *   sids_create.c  plans from nothing, rcgns_create
 *   sids_super.c   rcgns_write_supermesh
 *
 * Trees are in HDF5's order of dimensions: slowest first. */
#ifndef REMAP_ADAPTERS_CGNS_PRIVATE_H
#define REMAP_ADAPTERS_CGNS_PRIVATE_H

#include "base.h"
#include "cgns.h"

#include <stdbool.h>

enum {
  RC_MAX_DIMS  = 12,
  RC_NAME      = 33, /* 32 characters and NUL */
  RC_MAX_BOXES = 2 * RC_MAX_DIMS
};

/* ---- status ------------------------------------------------------------------------------------------------------- */

/* Hand a failure up; only where nothing is owned. */
#define RC_TRY(call)                         \
  do {                                       \
    const rcgns_status rc_try_ = (call);     \
    if (rc_try_ != RCGNS_OK) return rc_try_; \
  } while (0)

/* Hand it up through the one cleanup label; assign is an assignment to the status. */
#define RC_GOTO(label, assign)            \
  do {                                    \
    if ((assign) != RCGNS_OK) goto label; \
  } while (0)

/* Format the message and return the status, so that `return rc_fail(...)` reads as one act. */
rcgns_status rc_fail(rcgns_message *message, rcgns_status status, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

/* MEMORY, with the words for it. */
rcgns_status rc_no_memory(rcgns_message *message);

/* What a public function ends with: status, and where memory ran out the file's name in front of the message. */
rcgns_status rc_name_file(const char *path, rcgns_status status, rcgns_message *message);

/* The greatest of the ranks' statuses and the message of the lowest rank that has it. Collective. */
rcgns_status rc_agree(MPI_Comm comm, rcgns_status mine, rcgns_message *message);

/* Broadcast of any length from rank 0. Collective. */
void rc_bcast(MPI_Comm comm, void *data, int64_t bytes);

static inline int64_t rc_clamp(int64_t value, int64_t lo, int64_t hi) { return value < lo ? lo : value > hi ? hi : value; }

/* Records of `size` bytes to every rank and back: send holds send_count[r] records for rank r, r ascending. *received is
 * the caller's (free), recv_count [ranks] is filled. Collective, with agreement: mine is the caller's own status so far. */
rcgns_status rc_exchange(MPI_Comm comm, rcgns_status mine, const void *send, const int64_t *send_count, size_t size,
                         void **received, int64_t *recv_count, rcgns_message *message);

/* ---- tree --------------------------------------------------------------------------------------------------------- */

/* A node. Links are followed where that is possible: label, payload and children are those of the node they lead to. */
typedef struct rc_node {
  char    name[RC_NAME], label[RC_NAME];
  char    type[3];          /* of the payload: I4 I8 U4 U8 R4 R8 C1 B1; MT: none */
  char    kind;             /* of the payload: 'I' 'R' 'C'; '?': another type; 0: none */
  bool    is_link, is_dead; /* dead: a link that leads nowhere */
  int     file;             /* index of the file that holds the payload */
  int     nd;
  int64_t dim[RC_MAX_DIMS];
  int64_t parent, child, last, next; /* indices of nodes, -1: none */
  int64_t link_file, link_path;      /* links: as stored, offsets of text in the pool */
  int64_t anchor;                    /* offset of the path in `file` where it is not the parent's path and the name; -1 */
  int64_t small;                     /* offset of the payload in the pool if it is small (int64_t, double or char), -1 */
} rc_node;

/* A file that the tree comes from: 0 is the one that was opened, the others are reached by links. */
typedef struct rc_source {
  int64_t path; /* offset of text in the pool */
  bool    is_adf;
  int64_t size, device, inode;
} rc_source;

/* Node 0 is the root. Read-only once it is broadcast. Invariants: parent < index of node; children are linked in the order
 * of the file; small payloads have rc_count(node) values, aligned to 8 bytes. */
typedef struct rc_tree {
  ra_array node, source, pool; /* rc_node, rc_source, char */
} rc_tree;

static inline rc_node       *rc_node_at(const rc_tree *tree, int64_t i) { return (rc_node *)tree->node.item + i; }
static inline rc_source     *rc_source_at(const rc_tree *tree, int64_t i) { return (rc_source *)tree->source.item + i; }
static inline const char    *rc_text(const rc_tree *tree, int64_t at) { return (const char *)tree->pool.item + at; }
static inline const int64_t *rc_small_ints(const rc_tree *tree, const rc_node *n)
{
  return n->kind == 'I' && n->small >= 0 ? (const int64_t *)(const void *)rc_text(tree, n->small) : NULL;
}

/* Bytes of one value of the node's type; 0 for MT. */
int rc_width(const char *type);
/* Number of values of the payload, -1 if the product overflows. 0 without a payload. */
int64_t rc_count(const rc_node *node);
/* Is the payload small enough to travel with the tree? */
bool rc_is_small(const rc_node *node);
/* Append a node below parent (-1: the root). -1: no memory. */
int64_t rc_tree_add(rc_tree *tree, int64_t parent, const rc_node *node);
/* Append bytes to the pool, aligned to 8; the offset, -1: no memory. */
int64_t rc_tree_store(rc_tree *tree, const void *bytes, int64_t count);
/* Append a file; fails on more than 10000. -1: no memory, -2: it cannot be read. */
int rc_tree_source(rc_tree *tree, const char *path, bool is_adf);
/* The path of a node in its file; *path is the caller's (free), NULL: no memory. */
char *rc_tree_path(const rc_tree *tree, int64_t node);
/* First child of that label (NULL: any) and name (NULL: any) after `after` (-1: from the first); -1: none. */
int64_t rc_tree_find(const rc_tree *tree, int64_t parent, int64_t after, const char *label, const char *name);
/* The trimmed text of a small C1 node, cut to fit; empty if it is none. */
void rc_tree_string(const rc_tree *tree, int64_t node, char *out, size_t size);
/* Rank 0's tree to all. Collective. */
rcgns_status rc_tree_bcast(MPI_Comm comm, rc_tree *tree, rcgns_message *message);
/* Give a tree back. */
void rc_tree_drop(rc_tree *tree);

/* ---- the two kinds of file ---------------------------------------------------------------------------------------- */

/* A part of an array: the linear range [lo, hi) of the box that begins at origin and has shape, rows slowest first. */
typedef struct rc_box {
  int     nd;
  int64_t origin[RC_MAX_DIMS], shape[RC_MAX_DIMS];
} rc_box;

/* The whole payload of a node. */
rc_box rc_whole(const rc_node *node);
/* Cut the linear range [lo, hi) of the box into at most RC_MAX_BOXES boxes, in order. Returns how many. */
int rc_box_cut(const rc_box *box, int64_t lo, int64_t hi, rc_box *part);
/* How many items a box has. */
int64_t rc_box_count(const rc_box *box);

/* Is it an HDF5 file? Not collective. */
bool rc_h5_is_file(const char *path);
/* Read the tree of source `file` into tree, whose node `parent` is that file's root. Not collective. */
rcgns_status rc_h5_walk(rc_tree *tree, rcgns_message *message);
/* Open for parallel reading. Collective; the handle is 64-bit, -1 after a failure. */
rcgns_status rc_h5_open(MPI_Comm comm, const char *path, int64_t *handle, rcgns_message *message);
/* Close it. Collective. */
void rc_h5_close(int64_t handle);
/* Read [lo, hi), not empty, of box from the node at path: as 'I' int64_t, 'R' double, 'N' its own type. Not collective. */
rcgns_status rc_h5_read(int64_t handle, const char *path, const char *type, const rc_box *box, int64_t lo, int64_t hi, char as,
                        void *out, rcgns_message *message);

/* The same for ADF, through cgio; every call is for one rank alone. */

/* As rc_h5_is_file. */
bool rc_adf_is_file(const char *path);
/* As rc_h5_walk. */
rcgns_status rc_adf_walk(rc_tree *tree, rcgns_message *message);
/* As rc_h5_open. */
rcgns_status rc_adf_open(const char *path, int64_t *handle, rcgns_message *message);
/* As rc_h5_close. */
void rc_adf_close(int64_t handle);
/* As rc_h5_read. */
rcgns_status rc_adf_read(int64_t handle, const char *path, const char *type, const rc_box *box, int64_t lo, int64_t hi, char as,
                         void *out, rcgns_message *message);

/* ---- the file ----------------------------------------------------------------------------------------------------- */

typedef enum rc_shape { RC_NONE, RC_TETRA, RC_PYRA, RC_PENTA, RC_HEXA } rc_shape;

/* How the rows of a section lie in ElementConnectivity. */
typedef enum rc_layout {
  RC_FIXED,  /* npe nodes each */
  RC_MIXED,  /* a type, then its nodes */
  RC_INLINE, /* a count, then as many */
  RC_OFFSETS /* ElementStartOffset says */
} rc_layout;

/* One Elements_t that matters: volume elements or, in zone->face, NGON_n. */
typedef struct rc_section {
  int64_t   connectivity, offsets, parents; /* nodes, -1: none */
  rc_layout layout;
  bool      is_poly;               /* NFACE_n, or NGON_n in zone->face */
  rc_shape  shape;                 /* RC_FIXED */
  int       npe;                   /* RC_FIXED: nodes per element, mid nodes included */
  int64_t   first;                 /* element number of its first row */
  int64_t   num_rows, length;      /* rows, and values of ElementConnectivity */
  int64_t   row_lo, row_hi;        /* rows that are no rind */
  int64_t   num_cells, first_cell; /* volume cells; number of the first in its zone */
  ra_array  cut;                   /* MIXED, INLINE: rc_cut, every RC_CUT-th row of those that this rank passed, ascending */
} rc_section;

enum { RC_CUT = 1024 };

/* A row whose number is a multiple of RC_CUT. */
typedef struct rc_cut {
  int64_t row, at; /* number; where it begins in ElementConnectivity */
  int64_t cell;    /* volume cells of the section before it */
} rc_cut;

/* More than any file holds; sums of such counts do not overflow. */
#define RC_TOO_MANY (INT64_C(1) << 50)

typedef struct rc_zone {
  int64_t     node, base; /* in the tree */
  const char *name;       /* "Base/Zone", in the file's names */
  bool        is_structured;
  int64_t     vertices[3], cells[3]; /* along i, j, k; unstructured: the first only */
  int64_t     num_nodes, num_cells, first_node, first_cell;
  int64_t     coordinate[3];           /* nodes */
  int64_t     rind[6];                 /* of the coordinates: i before, i after, ... */
  int64_t     num_sections, num_faces; /* faces: rows of all of face */
  rc_section *section;                 /* [num_sections] by element number; cells */
  int64_t     num_face_sections;
  rc_section *face;        /* [num_face_sections] NGON_n by element number */
  bool        by_parents;  /* the cells come from ParentElements alone */
  int64_t     parent_base; /* by_parents: what ParentElements calls the first cell */
} rc_zone;

/* A face without neighbour on this rank, by what boundary conditions call it. key: in a block {2 axis + (it is the upper
 * side), i, j, k of its cell}; of standard elements its nodes in the zone, ascending, then -1; of polyhedra {its element
 * number, -1, first, last + 1 of its nodes in rim_node}. */
typedef struct rc_rim {
  int64_t face, zone, key[4]; /* zone: its node in the tree */
} rc_rim;

/* This rank's mesh while it grows. */
typedef struct rc_mesh {
  ra_array rim;         /* rc_rim */
  ra_array rim_node;    /* int64_t, of polyhedra: nodes in the zone */
  ra_array xyz;         /* double[3] */
  ra_array node_number; /* int64_t, for dual cells only: node of the file, all zones */
  ra_array face_number; /* int64_t, as in rcgns_face_numbers; empty unless they are wanted */
  bool     wants_face_numbers;
  ra_array face_offset, face_node, face_owner, face_neighbour, cell_global; /* int64_t */
} rc_mesh;

struct rcgns_file {
  MPI_Comm         comm;
  int              rank, size;
  char            *path;
  rc_tree          tree;
  int64_t         *handle; /* [sources], -1: not open */
  double           version;
  const char      *location;  /* "CellCenter" or "Vertex": what cells stand for */
  double           map[3][4]; /* coordinates: scale and transform in one */
  int64_t          num_zones;
  rc_zone         *zone;
  int64_t          num_cells, cell_lo, cell_hi; /* all ranks; this rank */
  rc_mesh          build;
  remap_mesh       mesh;
  const char     **zone_name;
  int64_t         *zone_cell_offset;
  ra_array         names;        /* char *, owned: every string that info hands out */
  ra_array         bases, notes; /* const char *, in names */
  rcgns_zone_info *zone_info;
  rcgns_info       info;
  ra_array         boundary_name, boundary_type; /* const char *, in names */
  int32_t         *face_boundary;                /* [faces of mesh] NULL before they are asked for */
  int64_t         *solution;                     /* [num_zones] node of the chosen FlowSolution_t, -1 */
  rcgns_field     *field;
  int64_t          num_fields;
};

/* A copy of the text, owned by the file; NULL: no memory. */
const char *rc_keep(rcgns_file *file, const char *format, ...) __attribute__((format(printf, 2, 3)));
/* Add a remark, once. The same on all ranks. */
rcgns_status rc_note(rcgns_file *file, rcgns_message *message, const char *text);

/* Read [lo, hi) of box from a node: as 'I' int64_t, 'R' double, 'N' its own type. Collective, with agreement; mine is the
 * caller's own status so far, so that a rank in trouble takes the others with it. */
rcgns_status rc_read(rcgns_file *file, rcgns_status mine, int64_t node, const rc_box *box, int64_t lo, int64_t hi, char as,
                     void *out, rcgns_message *message);
/* The same for the whole of a one-dimensional array. */
rcgns_status rc_read_1d(rcgns_file *file, rcgns_status mine, int64_t node, int64_t lo, int64_t hi, char as, void *out,
                        rcgns_message *message);

/* Find the zones with volume cells and count them. Collective. */
rcgns_status rc_zones_find(rcgns_file *file, const char *base, rcgns_message *message);
/* Give back what it found. */
void rc_zones_drop(rcgns_file *file);
/* Nodes of an element type as files of this version write it: *shape, and how many; 0: unknown. */
int rc_element(double version, int64_t code, rc_shape *shape);
/* Corners of a surface element of that type, 0: it is none. */
int rc_surface_corners(double version, int64_t code);
/* Corners of a shape. */
int rc_corners(rc_shape shape);
/* Nodes of a row of MIXED that begins with that code: of an element, or of a polygon, which old files may have; 0: unknown. */
int64_t rc_mixed_nodes(double version, int64_t code, rc_shape *shape);
/* Corners of a surface that such a row is and a volume element may have, 0: it is none. */
int rc_mixed_surface_corners(double version, int64_t code);
/* Find the rows of a section that is MIXED or INLINE, count its volume cells; *curved: it has some of higher order.
 * Collective. */
rcgns_status rc_rows_scan(rcgns_file *file, const rc_zone *zone, rc_section *section, bool *curved, rcgns_message *message);
/* The last cuts of such a section, on whatever rank, whose row or cell is no greater than key[num], which ascend. Collective,
 * mine as in rc_read. */
rcgns_status rc_cuts_find(rcgns_file *file, rcgns_status mine, const rc_section *section, bool by_cell, int num,
                          const int64_t *key, rc_cut *found, rcgns_message *message);
/* Rows [lo, hi) of a section that is not FIXED: offset [hi - lo + 1] and data, the type word of MIXED included, the count of
 * INLINE not. Collective. */
rcgns_status rc_rows_read(rcgns_file *file, const rc_zone *zone, const rc_section *section, int64_t lo, int64_t hi,
                          ra_array *offset, ra_array *data, rcgns_message *message);
/* The Rind of a node: [2 nd], zero where there is none. false: it is malformed. */
bool rc_rind(const rc_tree *tree, int64_t parent, int nd, int64_t *rind);

/* This rank's part of the mesh. Collective. */
rcgns_status rc_mesh_build(rcgns_file *file, rcgns_message *message);

/* Coordinates of nodes of an unstructured zone. Collective. xyz [n][3]; shared, if not NULL, [n]: more ranks than one ask. */
rcgns_status rc_nodes_fetch(rcgns_file *file, rcgns_status mine, const rc_zone *zone, const int64_t *node, int64_t n,
                            double *xyz, uint8_t *shared, rcgns_message *message);
/* One face into the mesh: a loop of local nodes, and what the file calls it. false: no memory. */
bool rc_face_add(rc_mesh *mesh, const int64_t *node, int64_t n, bool reverse, int64_t owner, int64_t neighbour, int64_t number);
/* Corners of the faces of a hexahedron, outward. */
enum { RC_HEXA_FACES = 6, RC_HEXA_CORNERS = 8 };
extern const int8_t rc_hexa_face[RC_HEXA_FACES][4];
/* Cells [lo, hi) of an unstructured zone, whatever its sections are; first_cell is the local number of cell lo. Collective. */
rcgns_status rc_sections_build(rcgns_file *file, const rc_zone *zone, int64_t lo, int64_t hi, int64_t first_cell,
                               rcgns_message *message);
/* Faces of the cells [lo, hi) (numbers in the zone) of polyhedra; first_cell is the local number of cell lo. Collective. */
rcgns_status rc_poly_build(rcgns_file *file, const rc_zone *zone, const rc_section *section, int64_t lo, int64_t hi,
                           int64_t first_cell, rcgns_message *message);
/* Remember which node of its zone the next one of this rank's mesh is, if dual cells will be made. false: no memory. */
bool rc_number_node(rcgns_file *file, const rc_zone *zone, int64_t node);
/* Put the median-dual mesh in the place of this rank's: its cells are the vertices. Collective. */
rcgns_status rc_dual_build(rcgns_file *file, rcgns_message *message);
/* Give a mesh back. */
void rc_mesh_drop(rc_mesh *mesh);
/* What rcgns_mesh hands out, from what was built. */
void rc_mesh_view(rcgns_file *file);
/* Are values of the nodes located at cells, for this file? */
static inline bool rc_is_dual(const rcgns_file *file) { return file->location[0] == 'V'; }
/* The face that was added last is at the rim. false: no memory. */
bool rc_rim_add(rc_mesh *mesh, const rc_zone *zone, int64_t a, int64_t b, int64_t c, int64_t d);
/* Six times the volume of the cone from origin to the loop, fanned about its mean. */
double rc_cone(const double *xyz, const int64_t *node, int64_t n, const double *origin);

/* ---- output ------------------------------------------------------------------------------------------------------- */

typedef enum rc_content { RC_EMPTY, RC_LITERAL, RC_COPY, RC_VALUES, RC_SLICE, RC_LINK } rc_content;

/* A node of the file to be. */
typedef struct rc_entry {
  int64_t     parent; /* entry; -1: the root of the file */
  char        name[RC_NAME], label[RC_NAME], type[3];
  int         nd;
  int64_t     dim[RC_MAX_DIMS];
  rc_content  content;
  const void *literal;               /* LITERAL, SLICE: int64_t, double or char by kind; borrowed */
  char        kind;                  /* LITERAL, SLICE */
  int64_t     begin, end, rows;      /* SLICE: this rank's values [begin, end) of each of so many rows, one after the other */
  int64_t     node;                  /* COPY: of the tree */
  int64_t     origin[RC_MAX_DIMS];   /* COPY: of the box that is taken */
  int64_t     zone, field;           /* VALUES */
  char       *link_file, *link_path; /* LINK: owned; an empty file is this one */
} rc_entry;

typedef struct rc_plan {
  ra_array entry;
} rc_plan;

/* Append an entry; its index, -1: no memory. Type NULL or nd 0: no payload; else literal is written as type. */
int64_t rc_plan_add(rc_plan *plan, int64_t parent, const char *name, const char *label, const char *type, int nd,
                    const int64_t *dim, char kind, const void *literal);
static inline rc_entry *rc_entry_at(const rc_plan *plan, int64_t i) { return (rc_entry *)plan->entry.item + i; }
/* Give a plan back; the arrays that its entries borrow are their owners'. */
void rc_plan_drop(rc_plan *plan);

/* A plan whose arrays it owns; ok turns false where memory runs out, and stays so. */
typedef struct rc_draft {
  rc_plan  plan;
  ra_array owned; /* void * */
  bool     ok;
} rc_draft;

/* Space for an array that lives as long as the draft; NULL: no memory. */
void *rc_draft_own(rc_draft *d, int64_t count, size_t size);
/* An entry; -1: no memory. */
int64_t rc_draft_put(rc_draft *d, int64_t parent, const char *name, const char *label, const char *type, int nd,
                     const int64_t *dim, char kind, const void *values);
/* Integers, as I4 where they fit. */
int64_t rc_draft_ints(rc_draft *d, int64_t parent, const char *name, const char *label, int nd, const int64_t *dim,
                      const int64_t *values);
/* A text, as C1. */
void rc_draft_text(rc_draft *d, int64_t parent, const char *name, const char *label, const char *text);
/* Give a draft back, and all that it owns. */
void rc_draft_drop(rc_draft *d);

/* Is it a name for a node? */
bool rc_is_name(const char *name);

/* A new file with every group, attribute and literal of the plan, and room for the rest. Not collective. */
rcgns_status rc_h5_skeleton(const char *path, const rc_plan *plan, rcgns_message *message);
/* Fill what the skeleton left empty. Collective on the file's communicator. */
rcgns_status rc_h5_fill(rcgns_file *file, const char *path, const rc_plan *plan, const rcgns_new_field *fields,
                        rcgns_message *message);

/* Rank 0 alone: the skeleton under another name beside path, which goes to part. */
rcgns_status rc_begin(const rc_plan *plan, const char *path, char *part, size_t size, rcgns_message *message);
/* Rank 0 alone: bring the file to the disk and give it its name. */
rcgns_status rc_finish(const char *part, const char *path, rcgns_message *message);
/* All of it. Collective on the file's communicator. */
rcgns_status rc_write_plan(rcgns_file *file, const rc_plan *plan, const char *path, const rcgns_new_field *fields,
                           rcgns_message *message);

#endif
