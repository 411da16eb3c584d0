/* join -- faces that meet, within a rank, across ranks and across zones, found by the coordinates of their nodes.
 *
 * Every loop's hash goes to the rank that the hash names, which answers whether another loop has the same. Only loops that
 * share their hash then travel there with their coordinates, in canonical form: from the smallest node towards the smaller
 * neighbour. Equal loops are one group, and a group is resolved alike whatever the partition: in each zone the loops that run
 * opposite ways are paired, and what is left joins if it is two loops that run opposite ways. A loop that finds no partner is
 * skin. O(corners) time; 8 bytes per face travel, and some 200 bytes for each face that has a partner on another rank or
 * zone. */
#include "mesh/mesh_private.h"

#include <stdlib.h>
#include <string.h>

/* ---- routes -------------------------------------------------------------------------------------------------------- */

/* Loops in the order in which they are sent. */
typedef struct route {
  int64_t *offset; /* [ranks + 1] */
  rm_lid  *loop;   /* [num loops] */
} route;

static remap_status make_route(const rm_mesh_job *job, rm_lid num, const uint64_t *hash, route *out)
{
  const int size = job->comm->size;
  rm_lid   *home;

  RM_NEW(home, job->scratch, num);
  RM_NEW(out->offset, job->scratch, (int64_t)size + 1);
  RM_NEW(out->loop, job->scratch, num);
  for (rm_lid i = 0; i < num; i++) home[i] = rm_mesh_home_of(hash[i], size);
  rm_group(num, home, size, out->offset, out->loop);
  return REMAP_OK;
}

/* ---- canonical loops ------------------------------------------------------------------------------------------------- */

static int compare_points(const double a[3], const double b[3])
{
  for (int k = 0; k < 3; k++)
    if (a[k] != b[k]) return a[k] < b[k] ? -1 : 1;
  return 0;
}

/* Nodes of the loop, n of them, walked from place `from` in steps of +1 or -1. */
static rm_lid walk(const rm_lid *loop, int64_t n, int64_t from, int step, int64_t k)
{
  const int64_t at = from + step * k;

  return loop[at < 0 ? at + n : at >= n ? at - n : at];
}

/* Order of two walks around the same loop, by coordinates. */
static int compare_walks(const rm_loops *loops, const rm_lid *loop, int64_t n, int64_t from_a, int step_a, int64_t from_b,
                         int step_b)
{
  for (int64_t k = 0; k < n; k++) {
    const rm_lid a = walk(loop, n, from_a, step_a, k), b = walk(loop, n, from_b, step_b, k);

    if (a != b) return compare_points(loops->xyz[a], loops->xyz[b]);
  }
  return 0;
}

/* Write the smallest of all walks around loop f to words (3 per node). Returns 1 if it runs with the loop, -1 if against it,
 * 0 if both ways are the same (a loop that goes back the way it came). */
static int write_canonical(const rm_loops *loops, rm_lid f, int64_t *words)
{
  const rm_lid *loop = loops->node + loops->offset[f];
  const int64_t n    = loops->offset[f + 1] - loops->offset[f];
  int64_t       with = -1, against = -1;
  int           order;

  for (int64_t i = 0; i < n; i++) {
    if (with >= 0 && loop[i] != loop[with] && compare_points(loops->xyz[loop[i]], loops->xyz[loop[with]]) > 0) continue;
    if (with < 0 || compare_walks(loops, loop, n, i, 1, with, 1) < 0) with = i;
    if (against < 0 || compare_walks(loops, loop, n, i, -1, against, -1) < 0) against = i;
  }
  order = compare_walks(loops, loop, n, with, 1, against, -1);
  for (int64_t k = 0; k < n; k++) {
    const rm_lid node = order <= 0 ? walk(loop, n, with, 1, k) : walk(loop, n, against, -1, k);

    memcpy(words + 3 * k, loops->xyz[node], sizeof loops->xyz[node]);
  }
  return order < 0 ? 1 : order > 0 ? -1 : 0;
}

/* A hash of the loop that knows neither where it starts nor which way it runs. */
static uint64_t loop_hash(const rm_loops *loops, rm_lid f)
{
  uint64_t sum = 0;

  for (int64_t k = loops->offset[f]; k < loops->offset[f + 1]; k++) sum += loops->node_hash[loops->node[k]];
  return rm_hash_word(sum);
}

/* ---- first round: hashes --------------------------------------------------------------------------------------------- */

/* shared[i] = 1 if another of the n hashes equals the i-th. */
static remap_status find_shared(rm_arena *scratch, int64_t n, const uint64_t *hash, uint8_t **shared)
{
  int64_t  size = 8;
  int64_t *table; /* [size] place of the first with this hash, plus 1; 0 is free */

  while (size < 2 * n) size *= 2;
  RM_NEW0(table, scratch, size);
  RM_NEW0(*shared, scratch, n);
  for (int64_t i = 0; i < n; i++) {
    int64_t at = (int64_t)(hash[i] & (uint64_t)(size - 1));

    while (table[at] != 0 && hash[table[at] - 1] != hash[i]) at = (at + 1) & (size - 1);
    if (table[at] != 0)
      (*shared)[i] = (*shared)[table[at] - 1] = 1;
    else
      table[at] = i + 1;
  }
  return REMAP_OK;
}

/* Which of this rank's loops share their hash with another, in the order of the route. Collective. */
static remap_status ask_shared(const rm_mesh_job *job, const uint64_t *hash, rm_lid num, const route *by_rank, uint8_t **out)
{
  const rm_comm *comm        = job->comm;
  uint64_t      *send        = rm_arena_alloc(job->scratch, num, sizeof *send);
  int64_t       *recv_offset = rm_arena_alloc(job->scratch, (int64_t)comm->size + 1, sizeof *recv_offset);
  int64_t       *back_offset = rm_arena_alloc(job->scratch, (int64_t)comm->size + 1, sizeof *back_offset);
  void          *recv = NULL, *back = NULL;
  uint8_t       *shared = NULL;

  RM_TRY(rm_comm_agree(comm, send && recv_offset && back_offset ? REMAP_OK : REMAP_NO_MEMORY, NULL));
  for (rm_lid i = 0; i < num; i++) send[i] = hash[by_rank->loop[i]];
  RM_TRY(rm_comm_exchange(comm, job->scratch, sizeof *send, by_rank->offset, send, recv_offset, &recv));
  RM_TRY(rm_comm_agree(comm, find_shared(job->scratch, recv_offset[comm->size], recv, &shared), NULL));
  RM_TRY(rm_comm_exchange(comm, job->scratch, sizeof *shared, recv_offset, shared, back_offset, &back));
  *out = back;
  return REMAP_OK;
}

/* ---- second round: loops that share a hash ----------------------------------------------------------------------------- */

/* One loop on its way, in 64-bit words; HEAD words, then three coordinates per node. */
enum { HASH, NUM_NODES, LOOP, DIRECTION, CELL_0, ZONE_0, CELL_1, ZONE_1, HEAD };
/* Answers: the number of the partner on the sender's own rank, or one of these. */
enum { IS_SKIN = -2, IS_JOINED = -1 };

/* Zone of a global cell, -1 if it lies in none. */
static int64_t zone_of(const remap_mesh *given, rm_gid cell)
{
  const int64_t *offset = given->zone_cell_offset, num = given->num_zones;

  return num > 0 && cell >= offset[0] && cell < offset[num] ? rm_interval_of(num, offset, cell) : -1;
}

/* Records of this rank's shared loops, by destination. */
typedef struct outbox {
  int64_t *offset; /* [ranks + 1] in words               */
  int64_t *word;   /* [offset[ranks]]                    */
  int64_t  num;    /* records                            */
  rm_lid  *loop;   /* [num] in the order of the records  */
} outbox;

static remap_status fill_outbox(const rm_mesh_job *job, const rm_gid *cell_global, const rm_loops *loops, const uint64_t *hash,
                                const route *by_rank, const uint8_t *shared, outbox *out)
{
  int64_t num_words = 0;

  RM_NEW(out->offset, job->scratch, (int64_t)job->comm->size + 1);
  out->num = 0;
  for (int r = 0; r < job->comm->size; r++) {
    out->offset[r] = num_words;
    for (int64_t i = by_rank->offset[r]; i < by_rank->offset[r + 1]; i++) {
      const rm_lid f = by_rank->loop[i];

      if (!shared[i]) continue;
      num_words += HEAD + 3 * (loops->offset[f + 1] - loops->offset[f]);
      out->num++;
    }
  }
  out->offset[job->comm->size] = num_words;
  RM_NEW(out->word, job->scratch, num_words);
  RM_NEW(out->loop, job->scratch, out->num);
  num_words = out->num = 0;
  for (int64_t i = 0; i < loops->num; i++) {
    const rm_lid f      = by_rank->loop[i];
    int64_t     *record = out->word + num_words;

    if (!shared[i]) continue;
    record[HASH]      = (int64_t)hash[f];
    record[NUM_NODES] = loops->offset[f + 1] - loops->offset[f];
    record[LOOP]      = f;
    record[DIRECTION] = write_canonical(loops, f, record + HEAD);
    for (int s = 0; s < 2; s++) {
      const rm_gid cell = loops->cell[f][s] < 0 ? -1 : cell_global[loops->cell[f][s]];

      record[s == 0 ? CELL_0 : CELL_1] = cell;
      record[s == 0 ? ZONE_0 : ZONE_1] = zone_of(job->given, cell);
    }
    out->loop[out->num++] = f;
    num_words += HEAD + 3 * record[NUM_NODES];
  }
  return REMAP_OK;
}

/* ---- groups ------------------------------------------------------------------------------------------------------------ */

/* Records as they arrive. */
typedef struct inbox {
  int64_t         num;
  const int64_t **record; /* [num] in the order of arrival                */
  int            *sender; /* [num]                                        */
  int64_t        *count;  /* [ranks + 1] offsets of the senders' records  */
  int64_t        *answer; /* [num]                                        */
} inbox;

static remap_status open_inbox(rm_arena *scratch, int num_ranks, const int64_t *offset, const int64_t *word, inbox *out)
{
  out->num = 0;
  for (int64_t at = 0; at < offset[num_ranks]; at += HEAD + 3 * word[at + NUM_NODES]) out->num++;
  RM_NEW(out->record, scratch, out->num);
  RM_NEW(out->sender, scratch, out->num);
  RM_NEW(out->count, scratch, (int64_t)num_ranks + 1);
  RM_NEW(out->answer, scratch, out->num);
  out->num = 0;
  for (int r = 0; r < num_ranks; r++) {
    out->count[r] = out->num;
    for (int64_t at = offset[r]; at < offset[r + 1]; at += HEAD + 3 * word[at + NUM_NODES]) {
      out->record[out->num] = word + at;
      out->sender[out->num] = r;
      out->answer[out->num] = IS_SKIN;
      out->num++;
    }
  }
  out->count[num_ranks] = out->num;
  return REMAP_OK;
}

/* One cell at a loop. */
typedef struct side {
  int64_t zone;
  rm_gid  cell;
  int     direction; /* 1: the canonical loop points out of the cell, -1: into it */
  bool    waits;     /* no partner yet                                            */
  int64_t place;     /* of the record in the inbox                                */
} side;

static int compare_sides(const void *left, const void *right)
{
  const side *a = left, *b = right;

  if (a->zone != b->zone) return a->zone < b->zone ? -1 : 1;
  if (a->cell != b->cell) return a->cell < b->cell ? -1 : 1;
  if (a->direction != b->direction) return a->direction < b->direction ? -1 : 1;
  return a->place < b->place ? -1 : a->place > b->place;
}

/* The two are partners: tell each sender. */
static void join_sides(inbox *in, side *a, side *b)
{
  const bool local = in->sender[a->place] == in->sender[b->place] && a->cell != b->cell;

  a->waits = b->waits  = false;
  in->answer[a->place] = local ? in->record[b->place][LOOP] : IS_JOINED;
  in->answer[b->place] = local ? in->record[a->place][LOOP] : IS_JOINED;
}

/* Pair the sides of one zone that run opposite ways: those of different cells first; then the two sides of a cell that has
 * both, which bound nothing. */
static void pair_in_zone(inbox *in, side *list, int64_t n)
{
  for (int same_cell = 0; same_cell < 2; same_cell++)
    for (int64_t i = 0; i < n; i++)
      for (int64_t k = 0; k < n && list[i].waits && list[i].direction > 0; k++)
        if (list[k].waits && list[k].direction < 0 && (list[k].cell == list[i].cell) == (same_cell != 0))
          join_sides(in, &list[i], &list[k]);
}

/* Refuse a zone in which more than two cells lie at one loop, not counting cells of no thickness, which have it on both
 * sides. */
static remap_status check_zone(const rm_mesh_job *job, const inbox *in, const side *list, int64_t n)
{
  rm_gid  cell[3];
  int64_t num = 0;

  for (int64_t i = 0, k; i < n && num < 3; i = k) {
    int sum = 0;

    for (k = i; k < n && list[k].cell == list[i].cell; k++) sum += list[k].direction;
    if (sum != 0) cell[num++] = list[i].cell;
  }
  if (num == 3) {
    double point[3];

    memcpy(point, in->record[list[0].place] + HEAD, sizeof point);
    return rm_fail(
        REMAP_BAD_MESH, job->reason, (int)job->side, cell[2],
        "it has a face in common with two more cells, %lld and %lld, at (%.9g, %.9g, %.9g): two cells meet at a face, "
        "so give every cell once and the cells without overlap",
        (long long)cell[0], (long long)cell[1], point[0] / job->frame->scale, point[1] / job->frame->scale,
        point[2] / job->frame->scale);
  }
  return REMAP_OK;
}

/* Decide about n sides of equal loops. */
static remap_status resolve_group(const rm_mesh_job *job, inbox *in, side *list, int64_t n)
{
  side *left[2] = {NULL, NULL};
  int   num     = 0;

  qsort(list, (size_t)n, sizeof *list, compare_sides);
  for (int64_t i = 0, k; i < n; i = k) {
    for (k = i; k < n && list[k].zone == list[i].zone; k++) continue;
    RM_TRY(check_zone(job, in, list + i, k - i));
    pair_in_zone(in, list + i, k - i);
  }
  for (int64_t i = 0; i < n; i++) {
    if (!list[i].waits) continue;
    if (num < 2) left[num] = &list[i];
    num++;
  }
  if (num == 2 && left[0]->direction * left[1]->direction < 0) join_sides(in, left[0], left[1]);
  return REMAP_OK;
}

static bool same_loop(const int64_t *a, const int64_t *b)
{
  return a[NUM_NODES] == b[NUM_NODES] && memcmp(a + HEAD, b + HEAD, (size_t)a[NUM_NODES] * 3 * sizeof *a) == 0;
}

static int64_t add_sides(const inbox *in, int64_t place, side *list)
{
  const int64_t *record = in->record[place];
  const int      out    = (int)record[DIRECTION];
  const bool     single = record[CELL_1] < 0;

  list[0] = (side){record[ZONE_0], record[CELL_0], out, single, place};
  if (single) return 1;
  list[1] = (side){record[ZONE_1], record[CELL_1], -out, false, place};
  return 2;
}

/* Decide about the records of one hash: nearly always one loop; others are set aside and come in the next turn. */
static remap_status resolve_hash(const rm_mesh_job *job, inbox *in, rm_keyed *list, int64_t n, side *sides)
{
  while (n > 0) {
    const int64_t *first = in->record[list[0].item];
    int64_t        num = 0, others = 0;

    for (int64_t i = 0; i < n; i++) {
      if (same_loop(first, in->record[list[i].item]))
        num += add_sides(in, list[i].item, sides + num);
      else
        list[others++] = list[i];
    }
    RM_TRY(resolve_group(job, in, sides, num));
    n = others;
  }
  return REMAP_OK;
}

static remap_status resolve(const rm_mesh_job *job, inbox *in)
{
  rm_keyed *by_hash, *spare;
  side     *sides;

  RM_NEW(by_hash, job->scratch, in->num);
  RM_NEW(spare, job->scratch, in->num);
  RM_NEW(sides, job->scratch, 2 * in->num);
  for (int64_t i = 0; i < in->num; i++) by_hash[i] = (rm_keyed){(uint64_t)in->record[i][HASH], i};
  rm_sort_keyed(by_hash, spare, in->num);
  for (int64_t i = 0, k; i < in->num; i = k) {
    for (k = i; k < in->num && by_hash[k].key == by_hash[i].key; k++) continue;
    RM_TRY(resolve_hash(job, in, by_hash + i, k - i, sides));
  }
  return REMAP_OK;
}

/* ---- all of it ----------------------------------------------------------------------------------------------------------- */

/* What the answers say about this rank's loops. Of two partners on this rank the one with the smaller number stays. */
static void apply_answers(const outbox *sent, const int64_t *answer, rm_loops *loops)
{
  for (int64_t i = 0; i < sent->num; i++) {
    const rm_lid f = sent->loop[i];

    if (loops->cell[f][1] >= 0 || answer[i] == IS_SKIN) continue;
    loops->is_skin[f] = 0;
    if (answer[i] > f) {
      loops->cell[f][1]         = loops->cell[answer[i]][0];
      loops->cell[answer[i]][0] = -1;
    }
  }
}

static remap_status open_and_resolve(const rm_mesh_job *job, const int64_t *offset, const int64_t *word, inbox *in)
{
  RM_TRY(open_inbox(job->scratch, job->comm->size, offset, word, in));
  return resolve(job, in);
}

/* Exchange the shared loops and apply what comes back. Collective. */
static remap_status join_shared(const rm_mesh_job *job, const outbox *sent, rm_loops *loops)
{
  const rm_comm *comm   = job->comm;
  int64_t       *offset = rm_arena_alloc(job->scratch, (int64_t)comm->size + 1, sizeof *offset);
  void          *recv = NULL, *answer = NULL;
  inbox          in;

  RM_TRY(rm_comm_agree(comm, offset ? REMAP_OK : REMAP_NO_MEMORY, NULL));
  RM_TRY(rm_comm_exchange(comm, job->scratch, sizeof *sent->word, sent->offset, sent->word, offset, &recv));
  RM_TRY(rm_comm_agree_reason(comm, open_and_resolve(job, offset, recv, &in), job->reason));
  RM_TRY(rm_comm_exchange(comm, job->scratch, sizeof *in.answer, in.count, in.answer, offset, &answer));
  RM_ASSERT(offset[comm->size] == sent->num);
  apply_answers(sent, answer, loops);
  return REMAP_OK;
}

remap_status rm_mesh_join(const rm_mesh_job *job, const rm_gid *cell_global, rm_loops *loops)
{
  uint64_t    *hash    = rm_arena_alloc(job->scratch, loops->num, sizeof *hash);
  remap_status status  = hash ? REMAP_OK : REMAP_NO_MEMORY;
  uint8_t     *shared  = NULL;
  route        by_rank = {0};
  outbox       out     = {0};

  if (status == REMAP_OK) {
    for (rm_lid f = 0; f < loops->num; f++) hash[f] = loop_hash(loops, f);
    status = make_route(job, loops->num, hash, &by_rank);
  }
  RM_TRY(rm_comm_agree(job->comm, status, NULL));
  RM_TRY(ask_shared(job, hash, loops->num, &by_rank, &shared));
  RM_TRY(rm_comm_agree(job->comm, fill_outbox(job, cell_global, loops, hash, &by_rank, shared, &out), NULL));
  return join_shared(job, &out, loops);
}
