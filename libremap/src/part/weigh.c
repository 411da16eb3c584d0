/* weigh -- what the overlay will cost, cell by cell, before it is made.
 *
 * Tracing and summing cost most, in proportion to how often edges and faces cross; then what every cell costs by itself. Pairs are
 * made at the seat of the target, so the target bears it. If boxes of extents s fill space, a box of extents h meets
 *
 *     prod_d (h_d + s_d) / (s_x s_y s_z)  =  1  +  sum_d h_d / s_d  +  sum_d h_e h_f / (s_e s_f)  +  h_x h_y h_z / (s_x s_y s_z)
 *
 * of them: where its corner is, along its edges, across its faces, and inside. The second term is how often its edges cross their
 * faces, the third how often their edges cross its faces, the last how many of them it has to itself. s is taken from the source
 * cells around it on the Morton curve, in the smallest block that is as large as the box and holds FEW of them: sums over their
 * boxes of the products of any of their extents give the means wanted, each cell counted by the volume it fills.
 *
 * Giants are left out of this; what they cost is counted, box by box, where their faces meet cells. A source cell that is paired with
 * a giant bears the cost at its own seat. O(n log n) time, 72 bytes per source and 48 per face of a giant that comes here. */
#include "part/part_private.h"

#include <math.h>
#include <string.h>

enum { FEW = 8, NUM_PRODUCTS = 8, ALL_AXES = NUM_PRODUCTS - 1, CURVE_LEVELS = RM_KEY_BITS / 3 };

/* What is counted, in 1/64 of a crossing of an edge and a face. Least squares of user time over the meshes of bench_balance. */
enum { CROSSING = 64, TRIANGLE = 3, PAIR = 4, GIANT_FACE = 32 };

/* The source cells of this rank on the curve. */
typedef struct density {
  rm_lid    num;
  uint64_t *key;                   /* [num] ascending                                                             */
  double  (*sum)[NUM_PRODUCTS];    /* [num + 1] over the cells before: products of the extents of the axes in a mask */
  double    steps;                 /* of the curve per unit length                                                */
} density;

static remap_status find_density(rm_arena *scratch, const rm_frame *frame, const rm_tags *tags, density *out)
{
  density d      = {.num = 0};
  double  extent = 0;

  for (int a = 0; a < 3; a++) extent = fmax(extent, frame->box[a + 3] - frame->box[a]);
  d.steps = extent > 0 ? ldexp(1, CURVE_LEVELS) / extent : 0;
  RM_NEW(d.key, scratch, tags->num[REMAP_SOURCE]);
  RM_NEW(d.sum, scratch, (int64_t)tags->num[REMAP_SOURCE] + 1);
  for (int m = 0; m < NUM_PRODUCTS; m++) d.sum[0][m] = 0;
  for (rm_lid k = 0; k < tags->num[REMAP_SOURCE]; k++) {
    const double *box = tags->box[REMAP_SOURCE][k];

    if (tags->tag[REMAP_SOURCE][k].is_giant) continue;
    for (int m = 0; m < NUM_PRODUCTS; m++) {
      double product = 1;

      for (int a = 0; a < 3; a++)
        if (m >> a & 1) product *= box[a + 3] - box[a];
      d.sum[d.num + 1][m] = d.sum[d.num][m] + product;
    }
    d.key[d.num++] = tags->tag[REMAP_SOURCE][k].key;
  }
  *out = d;
  return REMAP_OK;
}

static rm_lid num_below(const density *d, uint64_t key)
{
  rm_lid low = 0, high = d->num;

  while (low < high) {
    const rm_lid mid = low + (high - low) / 2;

    if (d->key[mid] < key) low = mid + 1;
    else high = mid;
  }
  return low;
}

/* Crossings that a target causes, and how many source cells it has to itself. */
static void expect(const density *d, uint64_t key, const double box[6], double *crossings, double *own)
{
  double h[3], size = 0, mean[NUM_PRODUCTS];
  rm_lid first = 0, end = 0;
  int    level = 0;

  *crossings = *own = 0;
  for (int a = 0; a < 3; a++) h[a] = box[a + 3] - box[a], size = fmax(size, h[a]);
  while (level < CURVE_LEVELS && ldexp(1, level) < size * d->steps) level++;
  for (; level <= CURVE_LEVELS; level++) {
    const uint64_t low = key >> (3 * level) << (3 * level);

    first = num_below(d, low);
    end   = num_below(d, low + (UINT64_C(1) << (3 * level)));
    if (end - first >= FEW) break;
  }
  for (int m = 0; m < NUM_PRODUCTS; m++) mean[m] = d->sum[end][m] - d->sum[first][m];
  if (!(mean[ALL_AXES] > 0)) return;
  for (int m = 0; m < ALL_AXES; m++) {
    double product = mean[m] / mean[ALL_AXES];

    for (int a = 0; a < 3; a++)
      if (!(m >> a & 1)) product *= h[a];
    if (m == 0) *own = product;
    else *crossings += product;
  }
}

/* ---- faces of giants ---------------------------------------------------------------------------------------------- */

/* A face of a giant meets the crowds of some ranks, each of which counts once. */
typedef struct meeting {
  const rm_crowds *crowds;
  int64_t         *next;      /* [comm->size] how many faces meet a rank, or where the next one goes */
  int64_t         *last_face; /* [comm->size] the face that met a rank last                          */
  double         (*list)[6];  /* where the faces go, or NULL to count                                */
  int64_t          face;
  const double    *box;       /* its box */
} meeting;

static int meet_rank(void *user, rm_lid item)
{
  meeting      *m    = user;
  const int64_t rank = m->crowds->crowd[item].rank;

  if (m->last_face[rank] == m->face) return 0;
  m->last_face[rank] = m->face;
  if (m->list) memcpy(m->list[m->next[rank]], m->box, sizeof *m->list);
  m->next[rank]++;
  return 0;
}

/* Every face of this rank's giants of one mesh asks which crowds it meets. */
static void meet_all(const rm_comm *comm, const rm_mesh *mesh, const rm_giants *giants, meeting *m)
{
  for (int r = 0; r < comm->size; r++) m->last_face[r] = -1;
  m->face = 0;
  for (int64_t g = 0; g < giants->num; g++) {
    const rm_lid c = giants->giant[g].cell;

    if (giants->giant[g].side != (int)mesh->side || giants->giant[g].home_rank != comm->rank) continue;
    for (int64_t i = mesh->cell_face_offset[c]; i < mesh->cell_face_offset[c + 1]; i++, m->face++) {
      const rm_lid f      = mesh->cell_face[i];
      double       box[6] = {INFINITY, INFINITY, INFINITY, -INFINITY, -INFINITY, -INFINITY};

      for (int64_t k = mesh->face_offset[f]; k < mesh->face_offset[f + 1]; k++)
        for (int a = 0; a < 3; a++) {
          box[a]     = fmin(box[a], mesh->node_xyz[mesh->face_node[k]][a]);
          box[a + 3] = fmax(box[a + 3], mesh->node_xyz[mesh->face_node[k]][a]);
        }
      m->box = box;
      (void)rm_boxtree_query(m->crowds->tree, m->crowds->box, box, meet_rank, m);
    }
  }
}

/* The boxes of the faces of this rank's giants of one mesh, by the ranks whose tags of the other mesh they may meet; offset is
 * [comm->size + 1]. Not collective. */
static remap_status list_faces(rm_arena *scratch, const rm_comm *comm, const rm_mesh *mesh, const rm_giants *giants,
                               const rm_crowds *crowds, int64_t *offset, double (**box)[6])
{
  meeting m = {.crowds = crowds};

  RM_NEW0(m.next, scratch, comm->size);
  RM_NEW(m.last_face, scratch, comm->size);
  meet_all(comm, mesh, giants, &m);
  for (int r = 0; r < comm->size; r++) offset[r] = m.next[r];
  RM_NEW(*box, scratch, rm_offsets(offset, comm->size));
  for (int r = 0; r < comm->size; r++) m.next[r] = offset[r];
  m.list = *box;
  meet_all(comm, mesh, giants, &m);
  return REMAP_OK;
}

/* Faces of giants of one mesh that may meet this rank's tags of the other, in a tree. Collective. */
typedef struct faces {
  const double    (*box)[6];
  const rm_boxtree *tree;
} faces;

static remap_status bring_faces(rm_arena *scratch, const rm_comm *comm, const rm_mesh *mesh, const rm_tags *tags,
                                const rm_giants *giants, faces *out)
{
  int64_t     *offset  = rm_arena_alloc(scratch, (int64_t)comm->size + 1, sizeof *offset);
  int64_t     *arrived = rm_arena_alloc(scratch, (int64_t)comm->size + 1, sizeof *arrived), num;
  double     (*box)[6] = NULL;
  void        *recv;
  rm_crowds    crowds;
  remap_status status;

  RM_TRY(rm_part_crowds(scratch, comm, tags, 1 - (int)mesh->side, &crowds));
  status = offset && arrived ? list_faces(scratch, comm, mesh, giants, &crowds, offset, &box) : REMAP_NO_MEMORY;
  RM_TRY(rm_comm_agree(comm, status, NULL));
  RM_TRY(rm_comm_exchange(comm, scratch, sizeof *box, offset, box, arrived, &recv));
  num      = arrived[comm->size];
  out->box = recv;
  status   = num > INT32_MAX ? REMAP_TOO_LARGE : rm_boxtree_build(scratch, (rm_lid)num, out->box, &out->tree);
  return rm_comm_agree(comm, status, NULL);
}

/* ---- all of it ---------------------------------------------------------------------------------------------------- */

static int count_one(void *user, rm_lid item)
{
  (void)item;
  ++*(int64_t *)user;
  return 0;
}

static int is_target(void *user, rm_lid item)
{
  const rm_giants *giants = user;

  return giants->giant[item].side == REMAP_TARGET;
}

/* Whether a box meets a target that is a giant. */
static bool meets_giant_target(rm_giants *giants, const double box[6])
{
  return rm_boxtree_query(giants->tree, giants->box, box, is_target, giants) != 0;
}

static int64_t rounded(double work)
{
  return work < 0x1p40 ? (int64_t)ceil(work) : (int64_t)1 << 40;
}

/* The work of the tags of one side; f: the faces of giants of the other side, NULL if there are no giants. Not collective. */
static void weigh_side(const rm_tags *tags, int side, const density *d, const rm_giants *giants, const faces *f, int64_t *work)
{
  rm_giants known = *giants;

  for (rm_lid k = 0; k < tags->num[side]; k++) {
    const rm_tag *tag = &tags->tag[side][k];
    const double *box = tags->box[side][k];
    double        crossings = 0, own = 0;
    int64_t       met = 0;

    work[k] = 0;
    if (tag->is_giant) continue;
    if (f) (void)rm_boxtree_query(f->tree, f->box, box, count_one, &met);
    if (side == REMAP_TARGET) {
      expect(d, tag->key, box, &crossings, &own);
      work[k] = rounded(CROSSING * crossings + (own + 1) * TRIANGLE * tag->num_triangles + (crossings + own + 1) * PAIR);
    } else if (f && meets_giant_target(&known, box)) {
      work[k] = TRIANGLE * (int64_t)tag->num_triangles + PAIR;
    }
    work[k] += GIANT_FACE * met;
  }
}

remap_status rm_part_weigh(rm_arena *arena, rm_arena *scratch, const rm_comm *comm, const rm_frame *zone_frame,
                           const rm_mesh *const mesh[2], const rm_tags *tags, const rm_giants *giants, int64_t *work[2])
{
  density      d = {.num = 0};
  faces        of_giants[2];
  remap_status status = find_density(scratch, zone_frame, tags, &d);

  for (int side = 0; side < 2; side++) work[side] = rm_arena_alloc(arena, tags->num[side], sizeof *work[side]);
  if (status == REMAP_OK && !(work[0] && work[1])) status = REMAP_NO_MEMORY;
  RM_TRY(rm_comm_agree(comm, status, NULL));
  for (int side = 0; side < 2 && giants->num > 0; side++)
    RM_TRY(bring_faces(scratch, comm, mesh[side], tags, giants, &of_giants[side]));
  for (int side = 0; side < 2; side++)
    weigh_side(tags, side, &d, giants, giants->num > 0 ? &of_giants[1 - side] : NULL, work[side]);
  return REMAP_OK;
}
