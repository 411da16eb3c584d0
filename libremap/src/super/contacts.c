/* contacts -- which zones of a mesh touch where their faces do not match: a skin triangle of one has a point in common with a
 * skin triangle of the other that is no corner or edge of both; and where a zone so touches itself. Exact. Cells with skin come
 * together by boxes, as for a supermesh of the mesh with itself; O(n log n) for n faces of the skin, wherever zones touch. */
#include "super/super_private.h"

#include <stdlib.h>
#include <string.h>

typedef struct work {
  rm_arena           *passing;
  const rm_super_job *job;
  int                 side;
  const rm_cover     *cover;
  const rm_trimesh   *mesh[2]; /* of the pieces of the cover */
  rm_lid              triangle; /* of mesh[0], that is looked at */
  bool                within;   /* contacts of a zone with itself are looked for: */
  rm_gid              cell[2];  /* the least two cells that have one, ascending; INT64_MAX */
  uint64_t           *pair;     /* zones in contact, the lower one in the upper half */
  int64_t             num_pairs, pair_room;
  remap_status        status;
} work;

/* ---- two triangles ----------------------------------------------------------------------------------------------- */

static inline bool is_same(const double a[3], const double b[3]) { return !memcmp(a, b, 3 * sizeof *a); }

static bool is_corner(const double p[3], const double *const t[3])
{
  return is_same(p, t[0]) || is_same(p, t[1]) || is_same(p, t[2]);
}

/* True if the closed triangle holds the point. */
static bool holds(const double *const t[3], const double p[3])
{
  double o[3];

  if (rm_orient3d(t[0], t[1], t[2], p) != 0 || !rm_off_plane(t[0], t[1], t[2], o)) return false;
  for (int h = 0; h < 3; h++)
    if (rm_orient3d(t[h], t[(h + 1) % 3], p, o) < 0) return false;
  return true;
}

/* True if p0 p1 goes through the inside of the triangle, its ends on both sides. */
static bool pierces(const double p0[3], const double p1[3], const double *const t[3])
{
  const int side = rm_orient3d(t[0], t[1], t[2], p0), turn = rm_orient3d(p0, p1, t[0], t[1]);

  return side * rm_orient3d(t[0], t[1], t[2], p1) < 0 && turn && rm_orient3d(p0, p1, t[1], t[2]) == turn &&
         rm_orient3d(p0, p1, t[2], t[0]) == turn;
}

/* True if two edges cross inside both. */
static bool cross(const double p0[3], const double p1[3], const double q0[3], const double q1[3])
{
  double o[3];

  if (rm_orient3d(p0, p1, q0, q1) != 0) return false;
  if (!rm_off_plane(p0, p1, q0, o) && !rm_off_plane(p0, p1, q1, o)) return false;
  return rm_orient3d(o, p0, p1, q0) * rm_orient3d(o, p0, p1, q1) < 0 &&
         rm_orient3d(o, q0, q1, p0) * rm_orient3d(o, q0, q1, p1) < 0;
}

/* True if what two triangles have in common is more than corners and edges of both: it is convex, and its extreme points are
 * corners of one in the other, edges that cross, edges through triangles. */
static bool do_not_match(const double *const a[3], const double *const b[3])
{
  for (int h = 0; h < 3; h++)
    if ((!is_corner(a[h], b) && holds(b, a[h])) || (!is_corner(b[h], a) && holds(a, b[h]))) return true;
  for (int h = 0; h < 3; h++) {
    const double *const p[2] = {a[h], a[(h + 1) % 3]}, *const q[2] = {b[h], b[(h + 1) % 3]};

    if (pierces(p[0], p[1], b) || pierces(q[0], q[1], a)) return true;
    for (int k = 0; k < 3; k++)
      if (cross(p[0], p[1], b[k], b[(k + 1) % 3])) return true;
  }
  return false;
}

/* ---- those of the skin ------------------------------------------------------------------------------------------- */

/* The cell whose skin a triangle is; -1: it is none, or has no area. */
static rm_lid owner_of(const rm_trimesh *m, rm_lid t)
{
  if (!m->triangle_is_skin[t] || !rm_has_area(m, t)) return -1;
  return m->side[t][0] >= 0 ? m->side[t][0] : m->side[t][1];
}

static int64_t zone_at(const work *w, int piece, rm_lid cell)
{
  return rm_zone_of(&w->job->zones[w->side], w->cover->part.piece[piece].cell_global[cell]);
}

/* Do the triangle that is looked at and another one touch without matching? */
static bool is_contact(const work *w, rm_lid other)
{
  const rm_lid  t[2] = {w->triangle, other};
  const double *corner[2][3];

  for (int s = 0; s < 2; s++)
    for (int h = 0; h < 3; h++) corner[s][h] = w->mesh[s]->vertex[w->mesh[s]->triangle[t[s]][h]];
  return do_not_match(corner[0], corner[1]);
}

/* Two cells of one zone, of which the lower one comes first. */
static void look_within(work *w, rm_lid item)
{
  const rm_piece *p    = w->cover->part.piece;
  const rm_lid    t    = w->mesh[1]->skin[item], other = owner_of(w->mesh[1], t), mine = owner_of(w->mesh[0], w->triangle);
  const rm_gid    a    = p[0].cell_global[mine], b = other < 0 ? -1 : p[1].cell_global[other];

  if (a >= b || zone_at(w, 0, mine) != zone_at(w, 1, other)) return;
  if (a > w->cell[0] || (a == w->cell[0] && b >= w->cell[1]) || !is_contact(w, t)) return;
  w->cell[0] = a;
  w->cell[1] = b;
}

static int look_at(void *user, rm_lid item)
{
  work        *w = user;
  const rm_lid t[2] = {w->triangle, w->mesh[1]->skin[item]}, other = owner_of(w->mesh[1], t[1]);

  if (w->within) look_within(w, item);
  if (w->within || other < 0) return 0;
  const int64_t  x = zone_at(w, 0, owner_of(w->mesh[0], t[0])), y = zone_at(w, 1, other);
  const uint64_t pair = x < y ? (uint64_t)x << 32 | (uint64_t)y : (uint64_t)y << 32 | (uint64_t)x;

  if (x == y) return 0;
  for (int64_t k = w->num_pairs - 1; k >= 0; k--)
    if (w->pair[k] == pair) return 0;
  if (!is_contact(w, t[1])) return 0;
  w->status = rm_grow(&w->pair, &w->pair_room, w->num_pairs + 1, sizeof *w->pair);
  if (w->status == REMAP_OK) w->pair[w->num_pairs++] = pair;
  return w->status != REMAP_OK;
}

/* Pairs of zones in contact where this rank has the core. Not collective. */
static remap_status look_around(work *w)
{
  for (int s = 0; s < 2; s++)
    RM_TRY(rm_trimesh_build(w->passing, w->job->frame, &w->cover->part.piece[s], w->job->faces, &w->mesh[s]));
  const rm_trimesh *m = w->mesh[0], *other = w->mesh[1];

  for (w->triangle = 0; w->triangle < m->num_triangles && w->status == REMAP_OK; w->triangle++) {
    const rm_lid owner = owner_of(m, w->triangle);
    double       box[6];

    if (owner < 0 || !(w->cover->flag[0][owner] & RM_COVER_CORE)) continue;
    for (int c = 0; c < 3; c++) {
      const double x[3] = {m->vertex[m->triangle[w->triangle][0]][c], m->vertex[m->triangle[w->triangle][1]][c],
                           m->vertex[m->triangle[w->triangle][2]][c]};

      box[c]     = -rm_max(-x[0], rm_max(-x[1], -x[2]));
      box[c + 3] = rm_max(x[0], rm_max(x[1], x[2]));
    }
    rm_boxtree_query(other->skin_tree, other->skin_box, box, look_at, w);
  }
  return w->status;
}

/* The cells of this rank that have skin, as cells of both meshes. */
static remap_status skin_cells(work *w, const rm_mesh *m, rm_zone *out)
{
  rm_lid *cell, num = 0;

  RM_NEW(cell, w->passing, m->num_cells);
  for (rm_lid c = 0; c < m->num_cells; c++) {
    bool is_skin = false;

    for (int64_t k = m->cell_face_offset[c]; k < m->cell_face_offset[c + 1] && !is_skin; k++)
      is_skin = m->face_is_skin[m->cell_face[k]];
    if (is_skin) cell[num++] = c;
  }
  *out = (rm_zone){{num, num}, {cell, cell}};
  return REMAP_OK;
}

/* ---- colours ----------------------------------------------------------------------------------------------------- */

/* The least colours, zone after zone, that differ where zones are in contact: the upper zone of two gives way. */
static remap_status colour_zones(const work *w, int64_t *colour, int *num_colours)
{
  const int64_t n = w->job->zones[w->side].num;
  int64_t      *gives_way;
  bool          again = true;

  RM_NEW(gives_way, w->passing, n + 1);
  memset(colour, 0, (size_t)n * sizeof *colour);
  *num_colours = 1;
  while (again) {
    again = false;
    memset(gives_way, 0, (size_t)n * sizeof *gives_way);
    for (int64_t k = 0; k < w->num_pairs; k++)
      if (colour[w->pair[k] >> 32] == colour[w->pair[k] & UINT32_MAX]) gives_way[w->pair[k] & UINT32_MAX] = 1;
    RM_TRY(rm_comm_max_i64(w->job->comm, gives_way, (int)n));
    for (int64_t z = 0; z < n; z++) {
      colour[z] += gives_way[z];
      again = again || gives_way[z];
      if (colour[z] >= *num_colours) *num_colours = (int)colour[z] + 1;
    }
  }
  return REMAP_OK;
}

/* What this rank has to look at, and that done. Collective. */
static remap_status look(work *w, rm_reason *reason)
{
  const rm_mesh       *m       = w->job->mesh[w->side];
  const rm_mesh *const twice[2] = {m, m};
  const bool           all[2]  = {false, false};
  rm_zone              zone;

  RM_TRY(rm_comm_agree(w->job->comm, skin_cells(w, m, &zone), NULL));
  RM_TRY(rm_part_cover(w->passing, w->job->comm, w->job->frame, twice, &zone, REMAP_IN_SOURCE, all, &w->cover, reason));
  return rm_comm_agree(w->job->comm, look_around(w), NULL);
}

remap_status rm_super_colour_zones(const rm_super_job *job, int side, int64_t *colour, int *num_colours, rm_reason *reason)
{
  work         w = {.passing = rm_arena_new(), .job = job, .side = side, .status = REMAP_OK};
  remap_status status;

  RM_GOTO(done, status = rm_comm_agree(job->comm, w.passing ? REMAP_OK : REMAP_NO_MEMORY, NULL));
  RM_GOTO(done, status = look(&w, reason));
  status = colour_zones(&w, colour, num_colours);
done:
  free(w.pair);
  rm_arena_drop(w.passing);
  return status;
}

remap_status rm_super_find_contact(const rm_super_job *job, int side, rm_gid cell[2], rm_reason *reason)
{
  work         w = {.passing = rm_arena_new(), .job = job, .side = side, .within = true, .cell = {INT64_MAX, INT64_MAX}};
  int64_t      least;
  remap_status status;

  RM_GOTO(done, status = rm_comm_agree(job->comm, w.passing ? REMAP_OK : REMAP_NO_MEMORY, NULL));
  RM_GOTO(done, status = look(&w, reason));
  least = -w.cell[0];
  RM_GOTO(done, status = rm_comm_max_i64(job->comm, &least, 1));
  cell[0] = -least;
  least   = w.cell[0] == cell[0] ? -w.cell[1] : -INT64_MAX;
  RM_GOTO(done, status = rm_comm_max_i64(job->comm, &least, 1));
  cell[1] = -least;
  if (cell[0] == INT64_MAX) cell[0] = cell[1] = -1;
done:
  rm_arena_drop(w.passing);
  return status;
}
