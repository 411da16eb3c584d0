/* conform -- a mesh whose zones touch without matching faces, made conformal: the union of its zones, by the same machinery as
 * any supermesh. Zones in contact get different colours; colour after colour is joined to what there is. Cells keep all of
 * their volume; what two zones both hold, which may be rounding only, is a cell of the zone that comes first. The nodes in
 * which edges of two zones cross are rounded then, so that the result is a mesh like any other. A supermesh for each colour
 * but the first, made where the zones touch; all other cells pass. */
#include "super/super_private.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

static const rm_origin no_origin = {-1, -1, -1};

typedef struct work {
  const rm_super_job *job;
  int                 side;
  rm_frame            frame; /* of meshes that are in the library's own frame already */
  const int64_t      *colour; /* [zones] */
  rm_reason          *reason;
} work;

/* ---- zones of one colour ----------------------------------------------------------------------------------------- */

/* Arrays of a mesh as room mesh reads them, and where its cells and faces come from. */
typedef struct given {
  remap_mesh mesh;
  int64_t   *face_offset, *face_node, *face_owner, *face_neighbour, *cell_global;
  rm_origin *cell, *face;
} given;

static remap_status given_room(rm_arena *passing, rm_arena *arena, int64_t cells, int64_t faces, int64_t corners, given *g)
{
  RM_NEW(g->face_offset, passing, faces + 1);
  RM_NEW(g->face_node, passing, corners);
  RM_NEW(g->face_owner, passing, faces);
  RM_NEW(g->face_neighbour, passing, faces);
  RM_NEW(g->cell_global, passing, cells);
  RM_NEW(g->cell, arena, cells);
  RM_NEW(g->face, arena, faces);
  g->face_offset[0] = 0;
  g->mesh           = (remap_mesh){.num_faces      = faces,
                                   .num_cells      = cells,
                                   .face_offset    = g->face_offset,
                                   .face_node      = g->face_node,
                                   .face_owner     = g->face_owner,
                                   .face_neighbour = g->face_neighbour,
                                   .cell_global    = g->cell_global};
  return REMAP_OK;
}

/* The mesh of what is given. Collective. */
static remap_status build_mesh(rm_arena *arena, const work *w, const given *g, rm_conformed *out)
{
  RM_TRY(rm_mesh_build(arena, w->job->comm, w->side, &g->mesh, &w->frame, w->job->faces, &out->mesh, w->reason));
  out->cell = g->cell;
  out->face = g->face;
  return REMAP_OK;
}

static bool has_colour(const work *w, rm_lid cell, int64_t colour)
{
  return w->colour[rm_zone_of(&w->job->zones[w->side], w->job->mesh[w->side]->cell_global[cell])] == colour;
}

/* The cells of one colour as arrays. Not collective. */
static remap_status take_colour(rm_arena *passing, rm_arena *arena, const work *w, int64_t colour, given *g)
{
  const rm_mesh *m    = w->job->mesh[w->side];
  const int      rank = w->job->comm->rank;
  rm_lid        *number, cells = 0, faces = 0;
  int64_t        corners = 0;

  RM_NEW(number, passing, m->num_cells);
  for (rm_lid c = 0; c < m->num_cells; c++) number[c] = has_colour(w, c, colour) ? cells++ : -1;
  RM_TRY(given_room(passing, arena, cells, m->num_faces, m->face_offset[m->num_faces], g));
  for (rm_lid c = 0; c < m->num_cells; c++) {
    if (number[c] < 0) continue;
    g->cell_global[number[c]] = m->cell_global[c];
    g->cell[number[c]]        = (rm_origin){m->cell_global[c], c, rank};
  }
  for (rm_lid f = 0; f < m->num_faces; f++) {
    const rm_lid *cell     = m->face_cell[f];
    const rm_lid  owner    = number[cell[0]], other = cell[1] < 0 ? -1 : number[cell[1]];
    const int64_t first    = m->face_offset[f], n = m->face_offset[f + 1] - first;
    const bool    is_turned = owner < 0;

    if (owner < 0 && other < 0) continue;
    for (int64_t k = 0; k < n; k++) g->face_node[corners + k] = m->face_node[first + (is_turned ? n - 1 - k : k)];
    g->face_owner[faces]     = is_turned ? other : owner;
    g->face_neighbour[faces] = is_turned ? -1 : other;
    g->face[faces]           = (rm_origin){-1, rm_given_face(m, f), rank};
    g->face_offset[++faces]  = corners += n;
  }
  g->mesh.num_faces = faces;
  g->mesh.num_nodes = m->num_nodes;
  g->mesh.node_xyz  = m->num_nodes ? &m->node_xyz[0][0] : NULL;
  return REMAP_OK;
}

/* Collective. */
static remap_status mesh_of_colour(rm_arena *arena, const work *w, int64_t colour, rm_conformed *out)
{
  rm_arena    *passing = rm_arena_new();
  given        g       = {.cell = NULL};
  remap_status status;

  status = rm_comm_agree(w->job->comm, passing ? take_colour(passing, arena, w, colour, &g) : REMAP_NO_MEMORY, NULL);
  if (status == REMAP_OK) status = build_mesh(arena, w, &g, out);
  rm_arena_drop(passing);
  return status;
}

/* ---- what two zones both hold ------------------------------------------------------------------------------------ */

/* Twice the area of a polygon. */
static double area_of(const remap_supermesh_view *v, int64_t f)
{
  const int32_t *loop = v->face_node + v->face_offset[f];
  const int64_t  n    = v->face_offset[f + 1] - v->face_offset[f];
  const double  *o    = v->node_xyz + 3 * (int64_t)loop[0];
  double         sum[3] = {0, 0, 0};

  for (int64_t k = 2; k < n; k++) {
    const double *p = v->node_xyz + 3 * (int64_t)loop[k - 1], *q = v->node_xyz + 3 * (int64_t)loop[k];

    for (int c = 0; c < 3; c++) {
      const int x = (c + 1) % 3, y = (c + 2) % 3;
      sum[c] += (p[x] - o[x]) * (q[y] - o[y]) - (p[y] - o[y]) * (q[x] - o[x]);
    }
  }
  return sqrt(sum[0] * sum[0] + sum[1] * sum[1] + sum[2] * sum[2]);
}

static bool is_doubled(const remap_supermesh_view *v, int64_t c)
{
  return v->cell_ancestor[0][c] >= 0 && v->cell_ancestor[1][c] >= 0;
}

/* The first cell, by its number, of those of this rank that two zones hold and that are thicker than rounding of the mesh's
 * largest coordinate, at most 1 in this frame; -1. */
static remap_status find_thick(rm_arena *passing, const remap_supermesh_view *v, double magnitude, int64_t *thick)
{
  double *area;

  *thick = -1;
  RM_NEW0(area, passing, v->num_cells);
  for (int64_t f = 0; f < v->num_faces; f++)
    for (int h = 0; h < 2; h++) {
      const int32_t c = h ? v->face_neighbour[f] : v->face_owner[f];
      if (c >= 0 && is_doubled(v, c)) area[c] += area_of(v, f);
    }
  for (int64_t c = 0; c < v->num_cells && *thick < 0; c++)
    if (is_doubled(v, c) && v->cell_volume[c] > 0x1p-20 * magnitude * 0.25 * area[c]) *thick = c;
  return REMAP_OK;
}

/* Refuse zones that overlap by more than rounding. origin: [side] of the union's cells. Collective. */
static remap_status refuse_thick(const work *w, const remap_supermesh_view *v, const rm_origin *const origin[2], int64_t thick)
{
  const rm_comm  *comm  = w->job->comm;
  const rm_zones *zones = &w->job->zones[w->side];
  int64_t         first = thick < 0 ? INT64_MIN : -v->cell_global[thick], cell[2] = {-1, -1};

  RM_TRY(rm_comm_max_i64(comm, &first, 1));
  if (first == INT64_MIN) return REMAP_OK;
  if (thick >= 0 && v->cell_global[thick] == -first)
    for (int h = 0; h < 2; h++) cell[h] = origin[h][thick].global;
  RM_TRY(rm_comm_max_i64(comm, cell, 2));
  const int     low = cell[0] > cell[1]; /* which one is named first */
  const int64_t z   = rm_zone_of(zones, cell[1 - low]);
  return rm_fail(REMAP_ZONE_OVERLAP, w->reason, w->side, cell[low],
                 "it overlaps cell %lld of zone %s by more than rounding; choose one of the overlapping bases or zones",
                 (long long)(cell[1 - low] - zones->cell_offset[z] + 1), zones->name[z]);
}

/* The volume of cells that two zones hold. Collective. */
static remap_status sum_doubled(const rm_comm *comm, const remap_supermesh_view *v, double *volume)
{
  rm_sum sum;

  rm_sum_clear(&sum);
  for (int64_t c = 0; c < v->num_cells; c++)
    if (is_doubled(v, c)) rm_sum_add(&sum, v->cell_volume[c]);
  RM_TRY(rm_comm_sum_exact(comm, &sum, 1));
  *volume += rm_sum_value(&sum);
  return REMAP_OK;
}

static remap_status find_magnitude(const work *w, double *magnitude)
{
  const rm_mesh *m = w->job->mesh[w->side];

  *magnitude = 0;
  for (rm_lid c = 0; c < m->num_cells; c++)
    for (int k = 0; k < 6; k++) *magnitude = fmax(*magnitude, fabs(m->cell_box[c][k]));
  return rm_comm_max_f64(w->job->comm, magnitude, 1);
}

static remap_status check_doubled(const work *w, const remap_supermesh_view *v, const rm_origin *const origin[2],
                                  double *volume)
{
  rm_arena    *passing = rm_arena_new();
  double       magnitude;
  int64_t      thick = -1;
  remap_status status = find_magnitude(w, &magnitude);

  if (status == REMAP_OK)
    status = rm_comm_agree(w->job->comm, passing ? find_thick(passing, v, magnitude, &thick) : REMAP_NO_MEMORY, NULL);
  rm_arena_drop(passing);
  RM_TRY(status);
  RM_TRY(refuse_thick(w, v, origin, thick));
  return sum_doubled(w->job->comm, v, volume);
}

/* ---- one colour joined to those before --------------------------------------------------------------------------- */

/* Origins of the cells, or faces, of a union: [side] of what it is of. Collective. */
static remap_status fetch_origins(rm_arena *passing, const rm_comm *comm, int64_t n, const int32_t *const from[2],
                                  const int32_t *const from_rank[2], const rm_origin *const origin[2], rm_origin *out[2])
{
  for (int h = 0; h < 2; h++) out[h] = rm_arena_alloc(passing, n, sizeof *out[h]);
  RM_TRY(rm_comm_agree(comm, out[0] && out[1] ? REMAP_OK : REMAP_NO_MEMORY, NULL));
  for (int h = 0; h < 2; h++)
    RM_TRY(rm_super_fetch(comm, n, from[h], from_rank[h], sizeof no_origin, origin[h], &no_origin, out[h]));
  return REMAP_OK;
}

/* The union as arrays; of two origins that of the zone which comes first. Not collective. */
static remap_status take_union(rm_arena *passing, rm_arena *arena, const work *w, const remap_supermesh_view *v,
                               rm_origin *const cell[2], rm_origin *const face[2], given *g)
{
  const rm_zones *zones = &w->job->zones[w->side];

  RM_TRY(given_room(passing, arena, v->num_cells, v->num_faces, v->face_offset[v->num_faces], g));
  for (int64_t c = 0; c < v->num_cells; c++) {
    const bool second = cell[0][c].rank < 0 || (cell[1][c].rank >= 0 && rm_zone_of(zones, cell[1][c].global) <
                                                                            rm_zone_of(zones, cell[0][c].global));
    g->cell[c]        = cell[second][c];
    g->cell_global[c] = v->cell_global[c];
  }
  memcpy(g->face_offset, v->face_offset, sizeof *g->face_offset * ((size_t)v->num_faces + 1));
  for (int64_t k = 0; k < v->face_offset[v->num_faces]; k++) g->face_node[k] = v->face_node[k];
  for (int64_t f = 0; f < v->num_faces; f++) {
    g->face[f]           = face[face[0][f].rank < 0][f];
    g->face_owner[f]     = v->face_owner[f];
    g->face_neighbour[f] = v->face_neighbour[f];
  }
  g->mesh.num_nodes = v->num_nodes;
  g->mesh.node_xyz  = v->node_xyz;
  return REMAP_OK;
}

/* What went wrong in a union of zones, as of the mesh. Collective. */
static void explain(const work *w, const rm_conformed part[2], rm_reason *reason)
{
  const int h = reason->side == 1;

  rm_super_trace_reason(w->job->comm, &part[h], reason);
  *w->reason = (rm_reason){.side = w->side, .global_cell = reason->side < 0 ? -1 : reason->global_cell};
  snprintf(w->reason->text, sizeof w->reason->text,
           "its zones touch without matching faces and cannot be joined, for cells of one of them overlap, cross each other or "
           "are inverted: %.200s", reason->text);
}

static remap_status join(rm_arena *arena, rm_arena *passing, const work *w, const rm_conformed part[2], rm_conformed *out)
{
  const remap_supermesh_options options = {.keep         = REMAP_IN_BOTH | REMAP_IN_SOURCE | REMAP_IN_TARGET,
                                           .pass_through = 1};
  rm_mesh              side[2] = {*part[0].mesh, *part[1].mesh};
  const rm_mesh *const mesh[2] = {&side[0], &side[1]};
  const rm_origin *const cell_of[2] = {part[0].cell, part[1].cell}, *const face_of[2] = {part[0].face, part[1].face};
  const rm_super_job job = {w->job->comm, &w->frame, mesh, {{0}, {0}}, w->job->faces, &options, w->job->progress};
  rm_super          *s;
  rm_reason          reason = {-1, -1, ""};
  rm_origin         *cell[2], *face[2];
  given              g = {.cell = NULL};
  remap_status       status;

  for (int h = 0; h < 2; h++) side[h].side = (remap_side)h;
  status = rm_super_make(passing, &job, &s, &reason);
  if (status != REMAP_OK) status = rm_comm_agree_reason(w->job->comm, status, &reason);
  if (status == REMAP_BAD_MESH) explain(w, part, &reason);
  RM_TRY(status);
  const remap_supermesh_view *v = &s->view;
  RM_TRY(fetch_origins(passing, w->job->comm, v->num_cells, s->cell_home, s->cell_rank, cell_of, cell));
  RM_TRY(fetch_origins(passing, w->job->comm, v->num_faces, v->face_from, v->face_from_rank, face_of, face));
  RM_TRY(check_doubled(w, v, (const rm_origin *const *)cell, &out->overlap));
  RM_TRY(rm_comm_agree(w->job->comm, take_union(passing, arena, w, v, cell, face, &g), NULL));
  return build_mesh(arena, w, &g, out);
}

/* Part 1 joined to part 0, which becomes the union; both live in arenas of their own. Collective. */
static remap_status join_colour(const work *w, rm_arena **arena, int64_t colour, rm_conformed *so_far)
{
  rm_arena    *own = rm_arena_new(), *passing = rm_arena_new();
  rm_conformed part[2] = {*so_far, {.mesh = NULL}}, both = {.overlap = so_far->overlap};
  remap_status status = rm_comm_agree(w->job->comm, own && passing ? REMAP_OK : REMAP_NO_MEMORY, NULL);

  if (status == REMAP_OK) status = mesh_of_colour(passing, w, colour, &part[1]);
  if (status == REMAP_OK) status = join(own, passing, w, part, &both);
  rm_arena_drop(passing);
  rm_arena_drop(*arena);
  *arena  = own;
  *so_far = both;
  return status;
}

/* ------------------------------------------------------------------------------------------------------------------ */

/* True if every rank knows the same number of zones, more than one. Collective. */
static remap_status has_zones(const rm_super_job *job, int side, bool *has)
{
  int64_t extreme[2] = {job->zones[side].num, -job->zones[side].num};

  RM_TRY(rm_comm_max_i64(job->comm, extreme, 2));
  *has = extreme[0] == -extreme[1] && extreme[0] > 1 && extreme[0] < INT32_MAX;
  return REMAP_OK;
}

remap_status rm_super_conform(rm_arena **arena, const rm_super_job *job, int side, rm_conformed *out, rm_reason *reason)
{
  work         w = {.job = job, .side = side, .frame = *job->frame, .reason = reason};
  rm_arena    *passing;
  int64_t     *colour;
  int          num_colours = 1;
  bool         any;
  remap_status status;

  *out = (rm_conformed){.mesh = NULL};
  RM_TRY(has_zones(job, side, &any));
  if (!any) return REMAP_OK;
  w.frame.scale = 1;
  passing       = rm_arena_new();
  w.colour = colour = passing ? rm_arena_alloc(passing, job->zones[side].num, sizeof *colour) : NULL;
  status            = rm_comm_agree(job->comm, colour ? REMAP_OK : REMAP_NO_MEMORY, NULL);
  if (status == REMAP_OK) status = rm_super_colour_zones(job, side, colour, &num_colours, reason);
  if (status == REMAP_OK && num_colours > 1) status = mesh_of_colour(*arena, &w, 0, out);
  for (int64_t c = 1; c < num_colours && status == REMAP_OK; c++) status = join_colour(&w, arena, c, out);
  rm_arena_drop(passing);
  return status;
}

void rm_super_trace_reason(const rm_comm *comm, const rm_conformed *mesh, rm_reason *reason)
{
  int64_t cell = -1;

  for (rm_lid c = 0; c < mesh->mesh->num_cells && reason->global_cell >= 0; c++)
    if (mesh->mesh->cell_global[c] == reason->global_cell) cell = mesh->cell[c].global;
  if (rm_comm_max_i64(comm, &cell, 1) != REMAP_OK) cell = -1;
  reason->global_cell = cell;
}

/* ---- a supermesh of what was made conformal ---------------------------------------------------------------------- */

static remap_status retrace_cells(rm_arena *arena, rm_arena *passing, const rm_comm *comm, int side, const rm_conformed *from,
                                  rm_super *super)
{
  const int64_t n    = super->view.num_cells;
  int64_t      *ancestor = rm_arena_alloc(arena, n, sizeof *ancestor);
  rm_lid       *home     = rm_arena_alloc(arena, n, sizeof *home);
  int          *rank     = rm_arena_alloc(arena, n, sizeof *rank);
  rm_origin    *origin   = rm_arena_alloc(passing, n, sizeof *origin);

  RM_TRY(rm_comm_agree(comm, ancestor && home && rank && origin ? REMAP_OK : REMAP_NO_MEMORY, NULL));
  RM_ASSERT(ancestor && home && rank && origin);
  RM_TRY(rm_super_fetch(comm, n, super->cell_home[side], super->cell_rank[side], sizeof *origin, from->cell, &no_origin,
                        origin));
  for (int64_t c = 0; c < n; c++) ancestor[c] = origin[c].global, home[c] = origin[c].home, rank[c] = origin[c].rank;
  super->view.cell_ancestor[side] = ancestor;
  super->cell_home[side]          = home;
  super->cell_rank[side]          = rank;
  return REMAP_OK;
}

static remap_status retrace_faces(rm_arena *arena, rm_arena *passing, const rm_comm *comm, int side, const rm_conformed *from,
                                  rm_super *super)
{
  remap_supermesh_view *v      = &super->view;
  int32_t              *face   = rm_arena_alloc(arena, v->num_faces, sizeof *face);
  int32_t              *rank   = rm_arena_alloc(arena, v->num_faces, sizeof *rank);
  rm_origin            *origin = rm_arena_alloc(passing, v->num_faces, sizeof *origin);

  RM_TRY(rm_comm_agree(comm, face && rank && origin ? REMAP_OK : REMAP_NO_MEMORY, NULL));
  RM_ASSERT(face && rank && origin);
  RM_TRY(rm_super_fetch(comm, v->num_faces, v->face_from[side], v->face_from_rank[side], sizeof *origin, from->face, &no_origin,
                        origin));
  for (int64_t f = 0; f < v->num_faces; f++) face[f] = origin[f].home, rank[f] = origin[f].rank;
  v->face_from[side]      = face;
  v->face_from_rank[side] = rank;
  return REMAP_OK;
}

remap_status rm_super_retrace(rm_arena *arena, const rm_comm *comm, int side, const rm_conformed *from, rm_super *super)
{
  rm_arena    *passing = rm_arena_new();
  remap_status status  = rm_comm_agree(comm, passing ? REMAP_OK : REMAP_NO_MEMORY, NULL);

  if (status == REMAP_OK) status = retrace_cells(arena, passing, comm, side, from, super);
  if (status == REMAP_OK) status = retrace_faces(arena, passing, comm, side, from, super);
  rm_arena_drop(passing);
  return status;
}
