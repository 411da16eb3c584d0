/* weigh -- what the overlay will cost, cell by cell, before it is made.
 *
 * Tracing and summing cost most, in proportion to how often edges and faces cross; then what every cell costs by itself. Pairs
 * are made at the seat of the target, so the target bears it. Where boxes i fill space, a box j meets as many of them as
 *
 *     1  +  its edges cross their faces  +  their edges cross its faces  +  their corners lie in it, an eighth each,
 *
 * the 1 for its own corners in them. So crossings are counted by boxes that meet less corners within; and the last term shares
 * out what the sources cost. What it leaves of a source that meets targets here, because it meets others elsewhere or sticks
 * out of all, costs here too: a source comes whole to every rank that needs it. Cells that fill little of their boxes, turned
 * hexahedra or tetrahedra, meet more boxes, by as much as these overlap: their crossings count by the geometric mean of what
 * the two cells fill.
 *
 * Giants are left out of this; what they cost is counted where the boxes of their faces meet cells. A source cell that is
 * paired with a giant bears the cost at its own seat. O(n log n) time, and a visit for each pair of boxes, 102 bytes
 * per source. */
#include "part/part_private.h"

#include <math.h>
#include <string.h>

/* What is counted, in 1/64 of a crossing of a box's edge with another's face, which stands for some six of an edge with a
 * triangle: 64/6 is half a microsecond. SLENDER times: where sums of slender cells are likely to need double-double. From user
 * times and counts of bench_balance. */
enum { CROSSING = 64, SLENDER = 3, TRIANGLE = 10, GIANT_FACE = 16 };

/* Boxes of thin and slanting cells meet very many others; their neighbours on the curve are then not looked at, but weigh the
 * same. */
enum { MOST_VISITS = 32 };

/* ---- pairs of small cells ----------------------------------------------------------------------------------------- */

/* The small sources whose boxes may meet a target here. */
typedef struct sources {
  rm_lid            num;
  double          (*box)[6];
  rm_visitor       *as; /* what they are */
  const rm_boxtree *tree;
  double           *left;   /* what no target here has paid for yet, of 1 */
  rm_lid           *target; /* one that meets it, -1: none does           */
} sources;

static remap_status gather_sources(rm_arena *scratch, const rm_tags *tags, const rm_visitors *visitors, sources *out)
{
  const int64_t most = (int64_t)tags->num[REMAP_SOURCE] + visitors->num;
  rm_lid        num  = 0;

  RM_REQUIRE(most <= INT32_MAX, REMAP_TOO_LARGE);
  RM_NEW(out->box, scratch, most);
  RM_NEW(out->as, scratch, most);
  for (rm_lid k = 0; k < tags->num[REMAP_SOURCE]; k++) {
    const rm_tag *tag = &tags->tag[REMAP_SOURCE][k];

    if (tag->is_giant) continue;
    memcpy(out->box[num], tags->box[REMAP_SOURCE][k], sizeof *out->box);
    out->as[num++] = (rm_visitor){tag->home_rank, tag->cell, tag->num_triangles, tag->fill};
  }
  for (rm_lid k = 0; k < visitors->num; k++) {
    memcpy(out->box[num], visitors->box[k], sizeof *out->box);
    out->as[num++] = visitors->visitor[k];
  }
  RM_NEW(out->left, scratch, num);
  RM_NEW(out->target, scratch, num);
  for (rm_lid k = 0; k < num; k++) {
    out->left[k]   = 1;
    out->target[k] = -1;
  }
  out->num = num;
  return rm_boxtree_build(scratch, num, (const double(*)[6])out->box, &out->tree);
}

/* What a target causes. */
typedef struct estimate {
  const sources *s;
  const double  *box;
  rm_lid         target;
  double         extent, volume, fill; /* largest extent of the box; volume of the cell; over that of the box */
  double         crossings, triangles; /* the latter of the sources it has to itself */
  int64_t        visits;
} estimate;

/* How many of the lowest and the highest corner of another box a box has in it, in halves. */
static inline double corners_in(const double box[6], const double other[6])
{
  bool low = true, high = true;

  for (int a = 0; a < 3; a++) {
    low &= other[a] >= box[a] && other[a] < box[a + 3];
    high &= other[a + 3] > box[a] && other[a + 3] <= box[a + 3];
  }
  return 0.5 * (low + high);
}

static double volume_of(const double box[6])
{
  return (box[3] - box[0]) * (box[4] - box[1]) * (box[5] - box[2]);
}

static double extent_of(const double box[6])
{
  return fmax(box[3] - box[0], fmax(box[4] - box[1], box[5] - box[2]));
}

/* Rounding of a pair's volume against the volume of the smaller cell, as room moments will see it, for a pair of some 40
 * cones. */
static bool is_slender(const estimate *e, const double source[6], double fill)
{
  const double extent = extent_of(source), reach = 4 * e->extent < extent ? e->extent : extent;

  return reach * reach * (extent + e->extent + reach) > 1000 * fmin(fill * volume_of(source), e->volume);
}

static int meet_source(void *user, rm_lid item)
{
  estimate         *e    = user;
  const rm_visitor *as   = &e->s->as[item];
  const double      own  = corners_in(e->box, e->s->box[item]);

  e->crossings += (1 - own - corners_in(e->s->box[item], e->box)) * sqrt((double)as->fill) *
                  (is_slender(e, e->s->box[item], (double)as->fill) ? SLENDER : 1);
  e->triangles += own * as->num_triangles;
  e->s->left[item] -= own * e->fill;
  e->s->target[item] = e->target;
  e->visits++;
  return 0;
}

static int64_t rounded(double work)
{
  return work < 0x1p40 ? (int64_t)ceil(work) : (int64_t)1 << 40;
}

/* The work of the small targets, but for giants. Not collective. */
static void weigh_targets(const rm_tags *tags, const sources *s, int64_t *work)
{
  int64_t skip = 0, last = 0;
  double  size = 0; /* of the box looked at last */

  for (rm_lid k = 0; k < tags->num[REMAP_TARGET]; k++) {
    const rm_tag *tag = &tags->tag[REMAP_TARGET][k];
    const double *box = tags->box[REMAP_TARGET][k];
    estimate      e   = {.s      = s,
                         .box    = box,
                         .target = k,
                         .extent = extent_of(box),
                         .volume = volume_of(box) * (double)tag->fill,
                         .fill   = (double)tag->fill};

    if (tag->is_giant) continue;
    if (skip == 0 || volume_of(box) > 2 * size) {
      (void)rm_boxtree_query(s->tree, (const double(*)[6])s->box, box, meet_source, &e);
      last = rounded(CROSSING * fmax(e.crossings, 0) * sqrt((double)tag->fill) + TRIANGLE * e.triangles * (double)tag->fill);
      skip = (int64_t)((double)e.visits * (1 - (double)tag->fill)) / MOST_VISITS;
      size = volume_of(box);
    } else {
      skip--;
    }
    work[k] = last + TRIANGLE * (int64_t)tag->num_triangles;
  }
  for (rm_lid i = 0; i < s->num; i++)
    if (s->target[i] >= 0 && s->left[i] > 0) work[s->target[i]] += rounded(TRIANGLE * s->left[i] * s->as[i].num_triangles);
}

/* ---- faces of giants ---------------------------------------------------------------------------------------------- */

/* The box of a face. */
static void box_of_face(const rm_mesh *mesh, rm_lid face, double box[6])
{
  for (int a = 0; a < 3; a++) box[a] = INFINITY, box[a + 3] = -INFINITY;
  for (int64_t k = mesh->face_offset[face]; k < mesh->face_offset[face + 1]; k++)
    for (int a = 0; a < 3; a++) {
      box[a]     = fmin(box[a], mesh->node_xyz[mesh->face_node[k]][a]);
      box[a + 3] = fmax(box[a + 3], mesh->node_xyz[mesh->face_node[k]][a]);
    }
}

/* The boxes of the faces of num giants of a mesh. Not collective. */
static remap_status list_faces(rm_arena *scratch, const rm_mesh *mesh, int64_t num, const rm_lid *giant, rm_lid *num_faces,
                               double (**box)[6])
{
  int64_t n = 0;

  for (int64_t g = 0; g < num; g++) n += mesh->cell_face_offset[giant[g] + 1] - mesh->cell_face_offset[giant[g]];
  RM_REQUIRE(n <= INT32_MAX, REMAP_TOO_LARGE);
  RM_NEW(*box, scratch, n);
  *num_faces = 0;
  for (int64_t g = 0; g < num; g++)
    for (int64_t i = mesh->cell_face_offset[giant[g]]; i < mesh->cell_face_offset[giant[g] + 1]; i++)
      box_of_face(mesh, mesh->cell_face[i], (*box)[(*num_faces)++]);
  return REMAP_OK;
}

/* The boxes of faces by the ranks whose crowds they meet; offset is [comm->size + 1]. Not collective. */
static remap_status deal_faces(rm_arena *scratch, const rm_comm *comm, rm_lid num, const double (*box)[6],
                               const rm_crowds *crowds, int64_t *offset, double (**out)[6])
{
  rm_lid *face;

  RM_TRY(rm_crowds_list(scratch, comm, crowds, -1, num, NULL, box, offset, &face));
  RM_NEW(*out, scratch, offset[comm->size]);
  for (int64_t k = 0; k < offset[comm->size]; k++) memcpy((*out)[k], box[face[k]], sizeof **out);
  return REMAP_OK;
}

/* Faces of giants of one mesh that may meet this rank's tags of the other, in a tree. Collective. */
typedef struct faces {
  const double    (*box)[6];
  const rm_boxtree *tree;
} faces;

static remap_status bring_faces(rm_arena *scratch, const rm_comm *comm, const rm_mesh *mesh, const rm_tags *tags, faces *out)
{
  int64_t      *offset  = rm_arena_alloc(scratch, (int64_t)comm->size + 1, sizeof *offset);
  int64_t      *arrived = rm_arena_alloc(scratch, (int64_t)comm->size + 1, sizeof *arrived), num;
  double      (*own)[6] = NULL, (*dealt)[6] = NULL;
  int64_t       num_giants;
  const rm_lid *giant;
  rm_lid        num_own = 0;
  void         *recv;
  rm_crowds     crowds;
  remap_status  status;

  RM_TRY(rm_part_giants_at_home(scratch, comm, tags, (int)mesh->side, &num_giants, &giant));
  status = offset && arrived ? list_faces(scratch, mesh, num_giants, giant, &num_own, &own) : REMAP_NO_MEMORY;
  RM_TRY(rm_comm_agree(comm, status, NULL));
  RM_TRY(rm_part_crowds(scratch, comm, tags, 1 - (int)mesh->side, num_own, (const double(*)[6])own, RM_ALL_CROWDS, &crowds));
  status = deal_faces(scratch, comm, num_own, (const double(*)[6])own, &crowds, offset, &dealt);
  RM_TRY(rm_comm_agree(comm, status, NULL));
  RM_TRY(rm_comm_exchange(comm, scratch, sizeof *dealt, offset, dealt, arrived, &recv));
  num      = arrived[comm->size];
  out->box = recv;
  status   = num > INT32_MAX ? REMAP_TOO_LARGE : rm_boxtree_build(scratch, (rm_lid)num, out->box, &out->tree);
  return rm_comm_agree(comm, status, NULL);
}

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

/* Add what giants of the other side cause at one side's small cells; f: the faces of those. Not collective. */
static void add_giants(const rm_tags *tags, int side, rm_giants giants, const faces *f, int64_t *work)
{
  for (rm_lid k = 0; k < tags->num[side]; k++) {
    const rm_tag *tag = &tags->tag[side][k];
    const double *box = tags->box[side][k];
    int64_t       met = 0;

    if (tag->is_giant) continue;
    (void)rm_boxtree_query(f->tree, f->box, box, count_one, &met);
    if (side == REMAP_SOURCE && rm_boxtree_query(giants.tree, giants.box, box, is_target, &giants))
      work[k] += TRIANGLE * (int64_t)tag->num_triangles;
    work[k] += GIANT_FACE * met;
  }
}

/* ---- all of it ---------------------------------------------------------------------------------------------------- */

remap_status rm_part_weigh(rm_arena *arena, rm_arena *scratch, const rm_comm *comm, const rm_mesh *const mesh[2],
                           const rm_tags *tags, const rm_giants *giants, int64_t *work[2])
{
  rm_visitors  visitors;
  sources      s;
  faces        of_giants;
  remap_status status;

  RM_TRY(rm_part_receive_visitors(scratch, comm, tags, &visitors));
  status = gather_sources(scratch, tags, &visitors, &s);
  for (int side = 0; side < 2; side++) work[side] = rm_arena_zero(arena, tags->num[side], sizeof *work[side]);
  if (status == REMAP_OK && !(work[0] && work[1])) status = REMAP_NO_MEMORY;
  RM_TRY(rm_comm_agree(comm, status, NULL));
  weigh_targets(tags, &s, work[REMAP_TARGET]);
  for (int side = 0; side < 2 && giants->num_everywhere > 0; side++) {
    RM_TRY(bring_faces(scratch, comm, mesh[1 - side], tags, &of_giants));
    add_giants(tags, side, *giants, &of_giants, work[side]);
  }
  return REMAP_OK;
}
