/* pass -- cells that meet nothing of the other mesh become cells of the supermesh as they were given. A face between one of
 * them and a cell that meets something is made by whoever makes that other cell, triangulated as it is there, and sent home:
 * so both sides have the same. O(n); 40 bytes and the vertices for each face that is sent. */
#include "super/super_private.h"

#include <string.h>

/* A face on its way home, where `num` vertices arrive with it. */
typedef struct wire_face {
  int32_t side, num;
  rm_lid  cell, face; /* at home */
  rm_lid  from[2];
  int     from_rank[2];
} wire_face;

typedef struct work {
  rm_arena           *scratch;
  const rm_super_job *job;
  const rm_cover     *cover;
  const rm_trimesh *const *trimesh; /* [side] */
  const rm_cells     *cells;
  rm_soup            *soup;
  rm_lid             *soup_cell[2]; /* [side][cells of the mesh] -1 if it does not pass    */
  uint8_t            *is_sent[2];   /* [side][caller's faces] it came from whoever made it */
} work;

static remap_status add_cells(work *w)
{
  for (int side = 0; side < 2; side++) {
    const rm_mesh *m    = w->job->mesh[side];
    rm_lid         most = -1;
    int64_t        num  = 0;

    for (rm_lid c = 0; c < m->num_cells && rm_super_passes(w->job, side); c++) num += !w->cover->is_met[side][c];
    RM_TRY(rm_soup_reserve(w->soup, 0, 0, 0, num));
    RM_NEW(w->soup_cell[side], w->scratch, m->num_cells);
    for (rm_lid f = 0; f < m->num_faces; f++) most = rm_given_face(m, f) > most ? rm_given_face(m, f) : most;
    RM_NEW0(w->is_sent[side], w->scratch, (int64_t)most + 1);
    for (rm_lid c = 0; c < m->num_cells; c++) {
      rm_soup_cell cell = {{-1, -1}, {-1, -1}, {-1, -1}, m->cell_volume[c]};

      w->soup_cell[side][c] = -1;
      if (!rm_super_passes(w->job, side) || w->cover->is_met[side][c]) continue;
      cell.ancestor[side]   = m->cell_global[c];
      cell.home[side]       = c;
      cell.rank[side]       = w->job->comm->rank;
      w->soup_cell[side][c] = (rm_lid)w->soup->num_cells;
      RM_TRY(rm_soup_add_cell(w->soup, &cell));
    }
  }
  return REMAP_OK;
}

/* ---- faces between cells that are made and cells that pass ------------------------------------------------------- */

/* The passing cell behind face f of what was made; -1 if there is none. */
static rm_lid cell_behind(const work *w, rm_lid f, int *side)
{
  const rm_lid behind = w->soup->face_cell[f][1], *beyond;

  if (behind >= RM_OUTSIDE) return -1;
  beyond = w->cells->beyond[-2 - behind];
  *side = beyond[0] >= 0 ? 0 : 1;
  if (beyond[*side] < 0 || beyond[1 - *side] >= 0 || !rm_super_passes(w->job, *side)) return -1;
  return w->cover->flag[*side][beyond[*side]] & RM_COVER_MET ? -1 : beyond[*side];
}

/* The caller's face of which triangle t is part for the given cell. */
static rm_lid face_at_home(const work *w, int side, rm_lid t, rm_lid cell)
{
  const rm_trimesh *m = w->trimesh[side];

  const rm_lid f = m->triangle_face[t][m->side[t][0] == cell ? 0 : 1];
  return f < 0 ? -1 : w->cover->part.piece[side].face_home[f];
}

typedef struct parcel {
  int64_t   *face_offset, *xyz_offset, *face_arrives, *xyz_arrives; /* [ranks + 1] */
  wire_face *face;
  double   (*xyz)[3];
} parcel;

/* Count (face NULL) or fill in what goes home; next is [ranks] each. */
static void pack(const work *w, int64_t *next_face, int64_t *next_xyz, parcel *p)
{
  for (rm_lid f = 0; f < w->cells->num_faces; f++) {
    const rm_soup *s     = w->soup;
    const int64_t  first = s->first[f], n = s->first[f + 1] - s->first[f];
    int           side;
    const rm_lid  cell = cell_behind(w, f, &side);

    if (cell < 0) continue;
    const rm_piece *piece = &w->cover->part.piece[side];
    const int       home  = piece->cell_home_rank[cell];
    if (p->face) {
      p->face[next_face[home]] = (wire_face){side, (int32_t)n, piece->cell_home[cell],
                                             face_at_home(w, side, rm_cells_triangle(w->cells, f, side), cell),
                                             {s->from[0][f], s->from[1][f]},
                                             {rm_soup_rank(s->from_rank[0], s->from[0], f),
                                              rm_soup_rank(s->from_rank[1], s->from[1], f)}};
      for (int64_t k = 0; k < n; k++)
        memcpy(p->xyz[next_xyz[home] + k], s->xyz[s->loop[first + k]], sizeof *p->xyz);
    }
    next_face[home]++;
    next_xyz[home] += n;
  }
}

static remap_status make_parcels(const work *w, parcel *p)
{
  const int size = w->job->comm->size;
  int64_t  *next[2];

  for (int k = 0; k < 2; k++) RM_NEW(next[k], w->scratch, size);
  RM_NEW0(p->face_offset, w->scratch, (int64_t)size + 1);
  RM_NEW0(p->xyz_offset, w->scratch, (int64_t)size + 1);
  RM_NEW(p->face_arrives, w->scratch, (int64_t)size + 1);
  RM_NEW(p->xyz_arrives, w->scratch, (int64_t)size + 1);
  pack(w, p->face_offset, p->xyz_offset, p);
  rm_offsets(p->face_offset, size);
  rm_offsets(p->xyz_offset, size);
  RM_NEW(p->face, w->scratch, p->face_offset[size]);
  RM_NEW(p->xyz, w->scratch, p->xyz_offset[size]);
  for (int r = 0; r < size; r++) next[0][r] = p->face_offset[r], next[1][r] = p->xyz_offset[r];
  pack(w, next[0], next[1], p);
  return REMAP_OK;
}

/* Add faces that have come home, turned to point out of the cells that pass. */
static remap_status add_arrived(work *w, int64_t num, const wire_face *face, int64_t corners, const double (*xyz)[3])
{
  RM_TRY(rm_soup_reserve(w->soup, corners, num, corners, 0));
  for (int64_t k = 0; k < num; k++) {
    const wire_face *f = &face[k];
    rm_lid           vertex;

    RM_ASSERT(w->soup_cell[f->side][f->cell] >= 0);
    if (f->face >= 0) w->is_sent[f->side][f->face] = 1;
    for (int32_t i = f->num - 1; i >= 0; i--) {
      RM_TRY(rm_soup_add_corner(w->soup, xyz[i], &vertex));
      RM_TRY(rm_soup_add_to_loop(w->soup, vertex));
    }
    const rm_soup_face made = {
        {w->soup_cell[f->side][f->cell], -1}, {f->from[0], f->from[1]}, {f->from_rank[0], f->from_rank[1]}};
    RM_TRY(rm_soup_end_face(w->soup, &made));
    xyz += f->num;
  }
  return REMAP_OK;
}

static remap_status exchange(work *w)
{
  const rm_comm *comm = w->job->comm;
  parcel         p    = {0};
  void          *face, *xyz;

  RM_TRY(rm_comm_agree(comm, make_parcels(w, &p), NULL));
  RM_TRY(rm_comm_exchange(comm, w->scratch, sizeof *p.face, p.face_offset, p.face, p.face_arrives, &face));
  RM_TRY(rm_comm_exchange(comm, w->scratch, sizeof *p.xyz, p.xyz_offset, p.xyz, p.xyz_arrives, &xyz));
  return rm_comm_agree(comm, add_arrived(w, p.face_arrives[comm->size], face, p.xyz_arrives[comm->size], xyz),
                       NULL);
}

/* ---- faces between cells that pass, and of the skin -------------------------------------------------------------- */

/* The soup's cells beside face f of the mesh; false if it is none of the faces that pass. */
static bool passes(const work *w, int side, rm_lid f, rm_lid cell[2])
{
  const rm_mesh *m = w->job->mesh[side];

  for (int h = 0; h < 2; h++) cell[h] = m->face_cell[f][h] < 0 ? -1 : w->soup_cell[side][m->face_cell[f][h]];
  return cell[0] >= 0 && (cell[1] >= 0 || m->face_cell[f][1] < 0) && !w->is_sent[side][rm_given_face(m, f)];
}

/* Room for those faces and their nodes, which get the number -1. */
static remap_status reserve_faces(work *w, int side, rm_lid *vertex)
{
  const rm_mesh *m = w->job->mesh[side];
  int64_t        faces = 0, corners = 0, nodes = 0;
  rm_lid         cell[2];

  for (rm_lid v = 0; v < m->num_nodes; v++) vertex[v] = 0;
  for (rm_lid f = 0; f < m->num_faces; f++) {
    if (!passes(w, side, f, cell)) continue;
    faces++;
    corners += m->face_offset[f + 1] - m->face_offset[f];
    for (int64_t k = m->face_offset[f]; k < m->face_offset[f + 1]; k++) vertex[m->face_node[k]] = -1;
  }
  for (rm_lid v = 0; v < m->num_nodes; v++) nodes += vertex[v] < 0;
  return rm_soup_reserve(w->soup, nodes, faces, corners, 0);
}

static remap_status add_faces(work *w, int side)
{
  const rm_mesh *m = w->job->mesh[side];
  const int      rank = w->job->comm->rank;
  rm_lid        *vertex;

  RM_NEW(vertex, w->scratch, m->num_nodes);
  RM_TRY(reserve_faces(w, side, vertex));
  for (rm_lid f = 0; f < m->num_faces; f++) {
    rm_lid cell[2];

    if (!passes(w, side, f, cell)) continue;
    for (int64_t k = m->face_offset[f]; k < m->face_offset[f + 1]; k++) {
      rm_lid *v = &vertex[m->face_node[k]];
      if (*v < 0) RM_TRY(rm_soup_add_corner(w->soup, m->node_xyz[m->face_node[k]], v));
      RM_TRY(rm_soup_add_to_loop(w->soup, *v));
    }
    rm_soup_face face = {{cell[0], cell[1]}, {-1, -1}, {-1, -1}};
    face.from[side]      = rm_given_face(m, f);
    face.from_rank[side] = rank;
    RM_TRY(rm_soup_end_face(w->soup, &face));
  }
  return REMAP_OK;
}

static remap_status add_all_faces(work *w)
{
  for (int side = 0; side < 2; side++)
    if (rm_super_passes(w->job, side)) RM_TRY(add_faces(w, side));
  return REMAP_OK;
}

remap_status rm_super_pass(const rm_super_job *job, const rm_cover *cover, const rm_trimesh *const mesh[2],
                           const rm_cells *cells, rm_soup *soup)
{
  work         w = {.scratch = rm_arena_new(), .job = job, .cover = cover, .trimesh = mesh, .cells = cells, .soup = soup};
  remap_status status;

  RM_GOTO(done, status = rm_comm_agree(job->comm, w.scratch ? add_cells(&w) : REMAP_NO_MEMORY, NULL));
  RM_GOTO(done, status = exchange(&w));
  RM_GOTO(done, status = rm_comm_agree(job->comm, add_all_faces(&w), NULL));
done:
  rm_arena_drop(w.scratch);
  return status;
}
