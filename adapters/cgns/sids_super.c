/* sids_super -- a supermesh as a file: one zone of polyhedra with NGON_n and NFACE_n, boundary conditions on its outer faces,
 * its ancestors and fields as cell-centred values, and which mesh each face comes from. Each rank writes its slices; linear in
 * them. */
#include "cgns_private.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* The file while it is made, and this rank's slices. */
typedef struct sheet {
  rcgns_file            file; /* communicator and rank alone */
  const rslice_content *content;
  rslice_rows           nodes, faces, cells;
  rc_draft              draft;
  int64_t               zone;
  int64_t               before[2], all[2];  /* nodes of faces, faces of cells: on the ranks before, in all */
  int64_t              *bc_before, *bc_all; /* [boundaries] outer faces, likewise */
  char (*bc_name)[RC_NAME];                 /* [boundaries] fit for nodes, distinct */
} sheet;

enum { FACE_NODE = 0, CELL_FACE = 1 }; /* what is counted */

/* ---- counts -------------------------------------------------------------------------------------------------------- */

/* The boundary of a face of the slice, -1 if it has a cell on both sides. */
static int64_t boundary_of(const sheet *s, int64_t face)
{
  const int64_t *row = s->faces.word + s->faces.offset[face];

  return row[1] < 0 ? row[2] : -1;
}

static void sum_before(const sheet *s, int64_t *mine, int n, int64_t *all)
{
  MPI_Allreduce(mine, all, n, MPI_INT64_T, MPI_SUM, s->file.comm);
  MPI_Exscan(MPI_IN_PLACE, mine, n, MPI_INT64_T, MPI_SUM, s->file.comm);
  for (int i = 0; i < n && s->file.rank == 0; i++) mine[i] = 0;
}

/* Collective; what must be allotted is. */
static void count_all(sheet *s)
{
  const int64_t num = s->content->num_boundaries;

  s->before[FACE_NODE] = s->faces.offset[s->faces.num] - RSLICE_FACE_HEAD * s->faces.num;
  s->before[CELL_FACE] = s->cells.offset[s->cells.num] - rslice_cell_head(s->content) * s->cells.num;
  for (int64_t f = 0; f < s->faces.num; f++)
    if (num && boundary_of(s, f) >= 0) s->bc_before[boundary_of(s, f)]++;
  sum_before(s, s->before, 2, s->all);
  sum_before(s, s->bc_before, (int)num, s->bc_all);
}

/* ---- names --------------------------------------------------------------------------------------------------------- */

static bool is_taken(const sheet *s, int b)
{
  for (int i = 0; i < b; i++)
    if (!strcmp(s->bc_name[i], s->bc_name[b])) return true;
  return false;
}

/* The name of boundary b as the name of a node: 32 characters with what stands behind it, no '/', no blank at its begin. */
static void name_boundary(sheet *s, int b, const char *behind)
{
  char       *name = s->bc_name[b];
  const char *from = s->content->boundary_name[b];

  snprintf(name, RC_NAME, "%.*s%s", (int)(RC_NAME - 1 - strlen(behind)), *from ? from : "Boundary", behind);
  for (char *c = name; *c; c++)
    if (*c == '/' || (unsigned char)*c < ' ' || (c == name && (*c == ' ' || *c == '.'))) *c = '_';
}

static void name_boundaries(sheet *s)
{
  for (int b = 0; b < s->content->num_boundaries; b++) {
    name_boundary(s, b, "");
    for (int i = 2; is_taken(s, b); i++) {
      char number[16];

      snprintf(number, sizeof number, "_%d", i);
      name_boundary(s, b, number);
    }
  }
}

/* ---- plan ---------------------------------------------------------------------------------------------------------- */

/* An array of which this rank writes [begin, end) of each of `rows` rows. */
static void put_slice(sheet *s, int64_t parent, const char *name, const char *label, const char *type, int nd,
                      const int64_t *dim, int64_t begin, int64_t end, const void *values)
{
  const char    kind = *type;
  const int64_t at   = rc_draft_put(&s->draft, parent, name, label, type, nd, dim, kind, values);
  rc_entry     *e;

  if (at < 0) return;
  e          = rc_entry_at(&s->draft.plan, at);
  e->content = RC_SLICE;
  e->begin   = begin;
  e->end     = end;
  e->rows    = nd == 2 && dim[1] > 1 ? dim[0] : 1;
}

/* The type for integers up to most. */
static const char *int_type(int64_t most) { return most <= INT32_MAX ? "I4" : "I8"; }

static void put_coordinates(sheet *s)
{
  static const char *const name[3] = {"CoordinateX", "CoordinateY", "CoordinateZ"};
  const int64_t      grid = rc_draft_put(&s->draft, s->zone, "GridCoordinates", "GridCoordinates_t", NULL, 0, NULL, 0, NULL);
  const rslice_rows *n    = &s->nodes;

  for (int k = 0; k < 3; k++) {
    double *x = rc_draft_own(&s->draft, n->num, sizeof *x);

    for (int64_t i = 0; x && i < n->num; i++) memcpy(&x[i], &n->word[n->offset[i] + k], sizeof *x);
    put_slice(s, grid, name[k], "DataArray_t", "R8", 1, &s->content->mesh->global_nodes, n->first, n->first + n->num, x);
  }
}

/* A section without its rows' contents; its entry. */
static int64_t put_section(sheet *s, const char *name, int64_t code, int64_t first, int64_t num)
{
  static const int64_t two  = 2;
  int64_t             *head = rc_draft_own(&s->draft, 4, sizeof *head), at;

  if (!head) return -1;
  memcpy(head, (int64_t[4]){code, 0, first, first + num - 1}, 4 * sizeof *head);
  at = rc_draft_ints(&s->draft, s->zone, name, "Elements_t", 1, &two, head);
  rc_draft_ints(&s->draft, at, "ElementRange", "IndexRange_t", 1, &two, head + 2);
  return at;
}

/* Contents of rows after `head` words each, made numbers of CGNS by adding 1 to what is not signed yet, and where they begin.
 * */
static void put_rows(sheet *s, int64_t parent, const rslice_rows *r, int64_t head, int add, int which, int64_t total_rows,
                     int64_t most)
{
  const int64_t length = r->offset[r->num] - head * r->num, rows = total_rows + 1;
  const int64_t last = r->first + r->num == total_rows; /* the last rank with rows writes where they end */
  int64_t *item = rc_draft_own(&s->draft, length, sizeof *item), *start = rc_draft_own(&s->draft, r->num + 1, sizeof *start);
  int64_t  at = 0;

  if (!item || !start) return;
  for (int64_t i = 0; i < r->num; i++) {
    start[i] = s->before[which] + at;
    for (int64_t k = r->offset[i] + head; k < r->offset[i + 1]; k++) item[at++] = r->word[k] + add;
  }
  start[r->num] = s->before[which] + at;
  put_slice(s, parent, "ElementConnectivity", "DataArray_t", int_type(most), 1, &s->all[which], s->before[which],
            s->before[which] + length, item);
  put_slice(s, parent, "ElementStartOffset", "DataArray_t", int_type(s->all[which]), 1, &rows, r->first,
            r->first + r->num + (last && r->num), start);
}

/* The cells beside each face, as element numbers of NFACE_n; 0: none. */
static void put_parents(sheet *s, int64_t parent)
{
  const rslice_rows          *f      = &s->faces;
  const remap_supermesh_view *m      = s->content->mesh;
  const int64_t               dim[2] = {2, m->global_faces};
  int64_t                    *cell   = rc_draft_own(&s->draft, 2 * f->num, sizeof *cell);

  for (int64_t i = 0; cell && i < 2 * f->num; i++) {
    const int64_t at = f->word[f->offset[i % f->num] + i / f->num];

    cell[i] = at < 0 ? 0 : m->global_faces + 1 + at;
  }
  put_slice(s, parent, "ParentElements", "DataArray_t", int_type(m->global_faces + m->global_cells), 2, dim, f->first,
            f->first + f->num, cell);
}

/* One word of each face's head; most: its greatest value on any rank. */
static void put_face_word(sheet *s, int64_t parent, const char *name, int64_t place, int64_t most)
{
  const rslice_rows *f      = &s->faces;
  int64_t           *values = rc_draft_own(&s->draft, f->num, sizeof *values);

  for (int64_t i = 0; values && i < f->num; i++) values[i] = f->word[f->offset[i] + place];
  put_slice(s, parent, name, "DataArray_t", int_type(most), 1, &s->content->mesh->global_faces, f->first, f->first + f->num,
            values);
}

/* In which faces of what mesh each face lies. Collective. */
static void put_origins(sheet *s, int64_t parent)
{
  const int64_t at = rc_draft_put(&s->draft, parent, "FaceAncestors", "UserDefinedData_t", NULL, 0, NULL, 0, NULL);
  int64_t       most[RSLICE_FACE_HEAD] = {0};

  for (int64_t i = 0; i < s->faces.num; i++)
    for (int k = RSLICE_FACE_CELL; k < RSLICE_FACE_HEAD; k++)
      if (s->faces.word[s->faces.offset[i] + k] > most[k]) most[k] = s->faces.word[s->faces.offset[i] + k];
  MPI_Allreduce(MPI_IN_PLACE, most, RSLICE_FACE_HEAD, MPI_INT64_T, MPI_MAX, s->file.comm);
  put_face_word(s, at, "LiesIn", RSLICE_FACE_ORIGIN, 3);
  for (int side = 0; side < 2; side++) {
    char name[RC_NAME + 8];

    if (!s->content->face_cell[side] || !s->content->face_number[side]) continue;
    snprintf(name, sizeof name, "%.27sCell", s->content->ancestor[side]);
    put_face_word(s, at, name, RSLICE_FACE_CELL + side, most[RSLICE_FACE_CELL + side]);
    snprintf(name, sizeof name, "%.27sFace", s->content->ancestor[side]);
    put_face_word(s, at, name, RSLICE_FACE_NUMBER + side, most[RSLICE_FACE_NUMBER + side]);
  }
  rc_draft_text(&s->draft, at, "Meaning", "Descriptor_t",
                "LiesIn - 1: in a face of the first ancestors' mesh, 2: of the second ones', 3: of both; ...Cell: a cell of "
                "that mesh beside that face, as ancestors are counted; ...Face: the element number of that face if the zone of "
                "that cell has NGON_n, else its number in that cell by SIDS, a cell of a block being a HEXA_8; of a surface, "
                "the number of its polygon. 0: in none.");
}

static void put_elements(sheet *s)
{
  const remap_supermesh_view *m  = s->content->mesh;
  int64_t                     at = put_section(s, "NGonElements", 22, 1, m->global_faces);

  put_rows(s, at, &s->faces, RSLICE_FACE_HEAD, 1, FACE_NODE, m->global_faces, m->global_nodes);
  put_parents(s, at);
  put_origins(s, at);
  at = put_section(s, "NFaceElements", 23, m->global_faces + 1, m->global_cells);
  put_rows(s, at, &s->cells, rslice_cell_head(s->content), 0, CELL_FACE, m->global_cells, m->global_faces);
}

/* A boundary condition on outer faces, if there are any. */
static void put_boundary(sheet *s, int64_t parent, int b)
{
  const char   *type   = s->content->boundary_type ? s->content->boundary_type[b] : "UserDefined";
  const int64_t dim[2] = {s->bc_all[b], 1}, size = (int64_t)strlen(type);
  int64_t      *face = rc_draft_own(&s->draft, s->faces.num, sizeof *face), num = 0, at;

  for (int64_t f = 0; face && f < s->faces.num; f++)
    if (boundary_of(s, f) == b) face[num++] = s->faces.first + f + 1;
  at = rc_draft_put(&s->draft, parent, s->bc_name[b], "BC_t", "C1", 1, &size, 'C', type);
  put_slice(s, at, "PointList", "IndexArray_t", int_type(s->content->mesh->global_faces), 2, dim, s->bc_before[b],
            s->bc_before[b] + num, face);
  rc_draft_text(&s->draft, at, "GridLocation", "GridLocation_t", "FaceCenter");
}

static void put_boundaries(sheet *s)
{
  int64_t parent = -1;

  for (int b = 0; b < s->content->num_boundaries; b++) {
    if (!s->bc_all[b]) continue;
    if (parent < 0) parent = rc_draft_put(&s->draft, s->zone, "ZoneBC", "ZoneBC_t", NULL, 0, NULL, 0, NULL);
    put_boundary(s, parent, b);
  }
}

/* One word of each cell's head as a field. */
static void put_field(sheet *s, int64_t parent, const char *name, const char *type, int64_t place)
{
  const rslice_rows *c      = &s->cells;
  int64_t           *values = rc_draft_own(&s->draft, c->num, sizeof *values);

  for (int64_t i = 0; values && i < c->num; i++) values[i] = c->word[c->offset[i] + place];
  put_slice(s, parent, name, "DataArray_t", type, 1, &s->content->mesh->global_cells, c->first, c->first + c->num, values);
}

static void put_fields(sheet *s)
{
  const int64_t at   = rc_draft_put(&s->draft, s->zone, "FlowSolution#Centers", "FlowSolution_t", NULL, 0, NULL, 0, NULL);
  int64_t       most = 0;

  for (int64_t i = 0; i < s->cells.num; i++)
    for (int side = 0; side < 2; side++)
      if (s->cells.word[s->cells.offset[i] + side] > most) most = s->cells.word[s->cells.offset[i] + side];
  MPI_Allreduce(MPI_IN_PLACE, &most, 1, MPI_INT64_T, MPI_MAX, s->file.comm);
  rc_draft_text(&s->draft, at, "GridLocation", "GridLocation_t", "CellCenter");
  for (int side = 0; side < 2; side++) put_field(s, at, s->content->ancestor[side], int_type(most), side);
  put_field(s, at, "Volume", "R8", 2);
  for (int k = 0; k < s->content->num_fields; k++) put_field(s, at, s->content->field[k].name, "R8", 3 + k);
}

/* The plan of the whole file. Collective, whatever happens to memory. */
static void make_plan(sheet *s, const double *version)
{
  static const int64_t        one = 1, two = 2, dimensions[2] = {3, 3}, shape[2] = {3, 1};
  const remap_supermesh_view *m    = s->content->mesh;
  int64_t                    *size = rc_draft_own(&s->draft, 3, sizeof *size), base;

  rc_draft_put(&s->draft, -1, "CGNSLibraryVersion", "CGNSLibraryVersion_t", "R4", 1, &one, 'R', version);
  base = rc_draft_ints(&s->draft, -1, "Base", "CGNSBase_t", 1, &two, dimensions);
  if (size) {
    memcpy(size, (int64_t[3]){m->global_nodes, m->global_cells, 0}, 3 * sizeof *size);
    s->zone = rc_draft_ints(&s->draft, base, "Zone", "Zone_t", 2, shape, size);
  }
  rc_draft_text(&s->draft, s->zone, "ZoneType", "ZoneType_t", "Unstructured");
  put_coordinates(s);
  put_elements(s);
  put_boundaries(s);
  put_fields(s);
}

/* ---- the file ------------------------------------------------------------------------------------------------------ */

static rcgns_status from_slices(const sheet *s, rslice_status status, const char *path, rcgns_message *message)
{
  const rcgns_status mine = status == RSLICE_INTERNAL ? RCGNS_GEOMETRY : RCGNS_MEMORY;

  return rc_agree(s->file.comm,
                  status == RSLICE_OK ? RCGNS_OK : rc_fail(message, mine, "%s: %s", path, rslice_status_text(status)), message);
}

static rcgns_status check_content(const char *path, const rslice_content *content, rcgns_message *message)
{
  bool ok = rc_is_name(content->ancestor[0]) && rc_is_name(content->ancestor[1]);

  for (int k = 0; k < content->num_fields; k++) ok = ok && rc_is_name(content->field[k].name);
  if (!ok) return rc_fail(message, RCGNS_USAGE, "%s: a field has no name of 1 to 32 characters without /", path);
  if (!content->mesh->global_cells)
    return rc_fail(message, RCGNS_USAGE, "%s: the result has no cells: nothing is written", path);
  return RCGNS_OK;
}

rcgns_status rcgns_write_supermesh(MPI_Comm comm, const char *path, double version, const rslice_content *content,
                                   rcgns_message *message)
{
  const int64_t num = content->num_boundaries;
  sheet         s   = {.file = {.comm = comm}, .content = content, .draft = {.ok = true}, .zone = -1};
  rcgns_status  status;

  MPI_Comm_rank(comm, &s.file.rank);
  MPI_Comm_size(comm, &s.file.size);
  s.bc_before = calloc((size_t)num + 1, sizeof *s.bc_before);
  s.bc_all    = calloc((size_t)num + 1, sizeof *s.bc_all);
  s.bc_name   = calloc((size_t)num + 1, sizeof *s.bc_name);
  status      = s.bc_before && s.bc_all && s.bc_name ? check_content(path, content, message) : rc_no_memory(message);
  status      = rc_agree(comm, status, message);
  if (status == RCGNS_OK) status = from_slices(&s, rslice_nodes(comm, content->mesh, &s.nodes), path, message);
  if (status == RCGNS_OK) status = from_slices(&s, rslice_faces(comm, content, &s.faces), path, message);
  if (status == RCGNS_OK) status = from_slices(&s, rslice_cells(comm, content, 0, &s.cells), path, message);
  if (status == RCGNS_OK) {
    count_all(&s);
    name_boundaries(&s);
    make_plan(&s, &version);
    status = rc_agree(comm, s.draft.ok ? RCGNS_OK : rc_no_memory(message), message);
  }
  if (status == RCGNS_OK) status = rc_write_plan(&s.file, &s.draft.plan, path, NULL, message);
  rc_draft_drop(&s.draft);
  rslice_drop(&s.nodes);
  rslice_drop(&s.faces);
  rslice_drop(&s.cells);
  free(s.bc_before);
  free(s.bc_all);
  free(s.bc_name);
  return status;
}
