/* mapping -- from pairs on the ranks that overlaid them to rows on the ranks that own the cells.
 *
 *   overlay ranks          homes of the receiving cells
 *   (i, j, V, M)  ----->   j | i1 i2 i3 ...       serves source to target
 *        \------------->   i | j1 j2 ...          serves target to source, moments about c_j
 *
 * Each pair travels twice, as one record of 48 bytes, in one exchange per direction; what is to be known of a giving cell goes
 * once from an overlay rank to a home, in another of as many bytes per cell; second moments, where there are any, in a third.
 * A row is put into the canonical order of its givers, so nothing that is summed along it can depend on where the pairs were
 * made. O(p) time and memory for p pairs. */
#include "mapping.h"

#include <string.h>

/* A pair on its way to the home of its receiving cell. */
typedef struct pair_record {
  double  volume, moment[3]; /* about the giver's centroid                                                             */
  rm_lid  receiver;          /* its number at home                                                                     */
  rm_lid  giver;             /* place in the sender's list for that home; -1: without volume, no pair, but its skin counts */
  int32_t is_cut;            /* not 0: the skin of the giving mesh passes through the receiver                         */
  int32_t unused;            /* no padding on the wire                                                                 */
} pair_record;

/* A giving cell on its way to the home of cells that it gives to. */
typedef struct giver_record {
  double  centroid[3], volume;
  rm_gid  global;
  rm_lid  cell; /* its number at its own home */
  int32_t rank; /* that home                  */
} giver_record;

/* What goes out to, or came from, each rank in turn. */
typedef struct shipment {
  int64_t      *pair_offset, *giver_offset; /* [comm->size + 1]                                          */
  pair_record  *pair;                       /* [pair_offset[comm->size]]                                 */
  giver_record *giver;                      /* [giver_offset[comm->size]]                                */
  double      (*second)[6];                 /* of each pair, about the giver's centroid; NULL: none      */
} shipment;

/* A side's rows while they are filled: the arrays of rm_rows, writable. */
typedef struct rows_draft {
  int64_t *offset;
  rm_lid  *giver;
  double  *volume;
  double (*moment)[3], (*second)[6]; /* second NULL if there are none */
  uint8_t *same, *cover;
  double (*centroid_error)[3];
  int    *giver_rank;
  rm_lid *giver_cell;
  rm_gid *giver_global;
  double (*giver_centroid)[3];
} rows_draft;

/* Both sides of the pairs of a part, one of which receives. */
typedef struct giving {
  const rm_piece *to, *from;
  const rm_lid   *receiver, *giver;   /* [pairs] cells of these                                */
  int             skin;               /* flag of a pair through whose receiver the skin passes */
  const double  (*second)[6];         /* [pairs] NULL: none                                    */
  bool            backward;
} giving;

static giving giving_to(remap_side receiving, const rm_part *part, const rm_moments *moments)
{
  if (receiving == REMAP_TARGET)
    return (giving){&part->piece[1], &part->piece[0], moments->target, moments->source, RM_PAIR_SOURCE_SKIN, moments->second,
                    false};
  return (giving){&part->piece[0], &part->piece[1], moments->source, moments->target, RM_PAIR_TARGET_SKIN, moments->second_back,
                  true};
}

/* List the pairs by the home of the receiving cell, their order kept: pair_offset, and place [pairs] of each record. */
static remap_status sort_by_home(rm_arena *scratch, const rm_comm *comm, const giving *g, int64_t n, int64_t *pair_offset,
                                 int64_t **place)
{
  int64_t *next;

  RM_NEW(*place, scratch, n);
  RM_NEW(next, scratch, (int64_t)comm->size + 1);
  for (int r = 0; r <= comm->size; r++) pair_offset[r] = 0;
  for (int64_t k = 0; k < n; k++) pair_offset[g->to->cell_home_rank[g->receiver[k]]]++;
  rm_offsets(pair_offset, comm->size);
  for (int r = 0; r < comm->size; r++) next[r] = pair_offset[r];
  for (int64_t k = 0; k < n; k++) (*place)[next[g->to->cell_home_rank[g->receiver[k]]]++] = k;
  return REMAP_OK;
}

/* The pair's record but for its giver. */
static pair_record record_of(const giving *g, const rm_moments *moments, int64_t k)
{
  const rm_lid  i = g->giver[k], j = g->receiver[k];
  const double *c = g->from->cell_centroid[i];
  pair_record   p = {.volume   = moments->volume[k],
                     .receiver = g->to->cell_home[j],
                     .giver    = -1,
                     .is_cut   = (moments->flags[k] & g->skin) != 0};

  for (int d = 0; d < 3; d++) /* backward the receiver is the source cell, about whose centroid M is given */
    p.moment[d] = moments->moment[k][d] + (g->backward ? (g->to->cell_centroid[j][d] - c[d]) * p.volume : 0.0);
  return p;
}

/* The pairs of a part as they leave, and for each home the cells that give there, once. */
static remap_status pack_pairs(rm_arena *scratch, const rm_comm *comm, const rm_part *part, const rm_moments *moments,
                               remap_side receiving, shipment *out)
{
  const giving    g = giving_to(receiving, part, moments);
  const rm_piece *from = g.from;
  const int64_t   n    = moments->num_pairs;
  int64_t        *order, *place, num = 0; /* place of a cell among the givers so far, -1 */
  rm_lid         *cell;

  RM_TRY(sort_by_home(scratch, comm, &g, n, out->pair_offset, &order));
  RM_NEW(out->pair, scratch, n);
  if (g.second) RM_NEW(out->second, scratch, n);
  RM_NEW(cell, scratch, n);
  RM_NEW(place, scratch, from->num_cells);
  for (rm_lid c = 0; c < from->num_cells; c++) place[c] = -1;
  for (int r = 0; r < comm->size; r++) {
    out->giver_offset[r] = num;
    for (int64_t at = out->pair_offset[r]; at < out->pair_offset[r + 1]; at++) {
      const int64_t k = order[at];
      int64_t      *seen = &place[g.giver[k]];

      out->pair[at] = record_of(&g, moments, k);
      for (int d = 0; d < 6 && g.second; d++) out->second[at][d] = g.second[k][d];
      if (moments->flags[k] & RM_PAIR_EMPTY) continue;
      if (*seen < out->giver_offset[r]) cell[*seen = num++] = g.giver[k];
      out->pair[at].giver = (rm_lid)(*seen - out->giver_offset[r]);
    }
  }
  out->giver_offset[comm->size] = num;
  RM_NEW(out->giver, scratch, num);
  for (int64_t k = 0; k < num; k++) {
    const double *c = from->cell_centroid[cell[k]];

    out->giver[k] = (giver_record){{c[0], c[1], c[2]},           from->cell_volume[cell[k]],    from->cell_global[cell[k]],
                                   from->cell_home[cell[k]], from->cell_home_rank[cell[k]]};
  }
  return REMAP_OK;
}

static remap_status new_offsets(rm_arena *arena, const rm_comm *comm, shipment *out)
{
  if (!arena) return REMAP_NO_MEMORY;
  RM_NEW(out->pair_offset, arena, (int64_t)comm->size + 1);
  RM_NEW(out->giver_offset, arena, (int64_t)comm->size + 1);
  return REMAP_OK;
}

/* Send it all. Collective. What arrives lives in arena. */
static remap_status ship(rm_arena *arena, const rm_comm *comm, const shipment *out, bool has_second, shipment *in)
{
  void *recv;

  RM_TRY(rm_comm_exchange(comm, arena, sizeof *out->pair, out->pair_offset, out->pair, in->pair_offset, &recv));
  in->pair = recv;
  RM_TRY(rm_comm_exchange(comm, arena, sizeof *out->giver, out->giver_offset, out->giver, in->giver_offset, &recv));
  in->giver = recv;
  if (!has_second) return REMAP_OK;
  RM_TRY(rm_comm_exchange(comm, arena, sizeof *out->second, out->pair_offset, out->second, in->pair_offset, &recv));
  in->second = recv;
  return REMAP_OK;
}

static remap_status new_rows(rm_arena *arena, int64_t num_cells, int64_t num_pairs, bool has_second, rows_draft *draft)
{
  RM_NEW0(draft->offset, arena, num_cells + 1);
  RM_NEW0(draft->cover, arena, num_cells);
  RM_NEW0(draft->centroid_error, arena, num_cells);
  RM_NEW(draft->giver, arena, num_pairs);
  RM_NEW(draft->volume, arena, num_pairs);
  RM_NEW(draft->moment, arena, num_pairs);
  draft->second = NULL;
  if (has_second) RM_NEW(draft->second, arena, num_pairs);
  RM_NEW0(draft->same, arena, num_pairs);
  return REMAP_OK;
}

/* Put the givers that came, of which several senders may have sent the same, into the rows' list, each once, and the pairs'
 * numbers for them into that list's. */
static remap_status list_givers(rm_arena *arena, rm_arena *scratch, const rm_comm *comm, shipment *in, rows_draft *draft,
                                rm_rows *rows, double **volume)
{
  const int64_t n = in->giver_offset[comm->size];
  int64_t       num = 0;
  rm_keyed     *keyed, *spare;
  rm_lid       *number;

  RM_NEW(keyed, scratch, n);
  RM_NEW(spare, scratch, n);
  RM_NEW(number, scratch, n);
  for (int64_t k = 0; k < n; k++)
    keyed[k] = (rm_keyed){(uint64_t)in->giver[k].rank << 32 | (uint64_t)in->giver[k].cell, k};
  rm_sort_keyed(keyed, spare, n);
  for (int64_t k = 0; k < n; k++) {
    num += k == 0 || keyed[k].key != keyed[k - 1].key;
    number[keyed[k].item] = (rm_lid)(num - 1);
  }
  rows->num_givers = (rm_lid)num;
  RM_NEW(draft->giver_rank, arena, num);
  RM_NEW(draft->giver_cell, arena, num);
  RM_NEW(draft->giver_global, arena, num);
  RM_NEW(draft->giver_centroid, arena, num);
  RM_NEW(*volume, scratch, num);
  for (int64_t k = 0; k < n; k++) {
    const giver_record *from = &in->giver[k];
    const rm_lid        g    = number[k];

    draft->giver_rank[g]   = from->rank;
    draft->giver_cell[g]   = from->cell;
    draft->giver_global[g] = from->global;
    (*volume)[g]           = from->volume;
    for (int d = 0; d < 3; d++) draft->giver_centroid[g][d] = from->centroid[d];
  }
  for (int r = 0; r < comm->size; r++)
    for (int64_t k = in->pair_offset[r]; k < in->pair_offset[r + 1]; k++)
      if (in->pair[k].giver >= 0) in->pair[k].giver = number[in->giver_offset[r] + in->pair[k].giver];
  return REMAP_OK;
}

/* Records sorted by receiver and, within, by the canonical order of the givers, whose volumes are given: place [n] lists them
 * so. Both by counting. */
static remap_status sort_rows(rm_arena *scratch, const rm_frame *frame, int64_t n, const pair_record *record,
                              const double *volume, const rows_draft *draft, const rm_rows *rows, rm_lid *place)
{
  const rm_lid num = rows->num_givers;
  rm_lid      *order, *by_giver;
  int64_t     *end, *next, at = 0;

  RM_NEW(order, scratch, num);
  RM_NEW(by_giver, scratch, n);
  RM_NEW0(end, scratch, num);
  RM_NEW(next, scratch, rows->num_cells);
  RM_TRY(
      rm_canonical_order(scratch, frame, num, (const double(*)[3])draft->giver_centroid, volume, draft->giver_global, order));
  for (int64_t k = 0; k < n; k++) end[record[k].giver]++;
  for (rm_lid k = 0; k < num; k++) {
    const int64_t count = end[order[k]];

    end[order[k]] = at;
    at += count;
  }
  for (int64_t k = 0; k < n; k++) by_giver[end[record[k].giver]++] = (rm_lid)k;
  for (rm_lid c = 0; c < rows->num_cells; c++) next[c] = draft->offset[c];
  for (int64_t k = 0; k < n; k++) place[next[record[by_giver[k]].receiver]++] = by_giver[k];
  return REMAP_OK;
}

/* Mark the cells that a skin passes through, and take the records out that are no pairs, with their second moments. Returns how
 * many stay. */
static int64_t mark_cut(int64_t n, pair_record *record, double (*second)[6], uint8_t *is_cut)
{
  int64_t kept = 0;

  for (int64_t k = 0; k < n; k++) {
    is_cut[record[k].receiver] |= record[k].is_cut != 0;
    if (record[k].giver < 0) continue;
    if (kept < k) {
      if (second) memcpy(second[kept], second[k], sizeof *second);
      record[kept] = record[k];
    }
    kept++;
  }
  return kept;
}

/* How much of a cell with pairs is covered. A skin that passes through it leaves a part outside, unless what is left is not
 * even rounding of the volume: where zones abut whose faces do not match, the skins of both pass, and cancel. Without a skin
 * the giving mesh winds about the whole cell equally often: once, if it is not tangled and its zones do not overlap there. */
static remap_cover cover_of(const rows_draft *draft, rm_lid cell, double cell_volume, bool is_cut)
{
  rm_compensated sum = {0.0, 0.0}, rest = {-cell_volume, 0.0};

  for (int64_t k = draft->offset[cell]; k < draft->offset[cell + 1]; k++) {
    rm_compensated_add(&sum, draft->volume[k]);
    rm_compensated_add(&rest, draft->volume[k]);
  }
  if (is_cut) return fabs(rm_compensated_value(&rest)) <= 0x1p-44 * fabs(cell_volume) ? REMAP_COVERED : REMAP_PARTIAL;
  if (!(fabs(cell_volume) > 0.0)) return REMAP_COVERED;
  return rint(rm_compensated_value(&sum) / cell_volume) == 1.0 ? REMAP_COVERED : REMAP_PARTIAL;
}

/* Rows of one side out of what came, which is reordered. What stays to be filled in is `same` and the plan. */
static remap_status fill_rows(rm_arena *arena, rm_arena *scratch, const rm_comm *comm, const rm_frame *frame,
                              const rm_mesh *mesh, shipment *in, rows_draft *draft, rm_rows *rows, rm_reason *reason)
{
  const pair_record *record = in->pair;
  int64_t            n      = in->pair_offset[comm->size];
  double            *volume;
  rm_lid            *place;
  uint8_t           *is_cut;

  if (n > INT32_MAX)
    return rm_fail(REMAP_TOO_LARGE, reason, mesh->side, -1, "%lld pairs come to one rank; use more ranks", (long long)n);
  rows->num_cells = mesh->num_cells;
  RM_NEW0(is_cut, scratch, mesh->num_cells);
  RM_TRY(list_givers(arena, scratch, comm, in, draft, rows, &volume));
  n = mark_cut(n, in->pair, in->second, is_cut);
  RM_TRY(new_rows(arena, mesh->num_cells, n, in->second != NULL, draft));
  RM_NEW(place, scratch, n);
  for (int64_t k = 0; k < n; k++) {
    RM_ASSERT(record[k].receiver >= 0 && record[k].receiver < mesh->num_cells);
    draft->offset[record[k].receiver]++;
  }
  rm_offsets(draft->offset, mesh->num_cells);
  RM_TRY(sort_rows(scratch, frame, n, record, volume, draft, rows, place));
  for (rm_lid c = 0; c < mesh->num_cells; c++) {
    for (int64_t k = draft->offset[c]; k < draft->offset[c + 1]; k++) {
      const pair_record *p = &record[place[k]];

      draft->giver[k]  = p->giver;
      draft->volume[k] = p->volume;
      for (int d = 0; d < 3; d++) draft->moment[k][d] = p->moment[d];
      for (int d = 0; d < 6 && in->second; d++) draft->second[k][d] = in->second[place[k]][d];
    }
    if (draft->offset[c] == draft->offset[c + 1]) continue; /* uncovered */
    draft->cover[c] = (uint8_t)cover_of(draft, c, mesh->cell_volume[c], is_cut[c] != 0);
  }
  return REMAP_OK;
}

static void publish(const rows_draft *draft, rm_rows *rows)
{
  rows->offset         = draft->offset;
  rows->giver          = draft->giver;
  rows->volume         = draft->volume;
  rows->moment         = (const double(*)[3])draft->moment;
  rows->second         = (const double(*)[6])draft->second;
  rows->same           = draft->same;
  rows->cover          = draft->cover;
  rows->centroid_error = (const double(*)[3])draft->centroid_error;
  rows->giver_rank     = draft->giver_rank;
  rows->giver_cell     = draft->giver_cell;
  rows->giver_global   = draft->giver_global;
  rows->giver_centroid = (const double(*)[3])draft->giver_centroid;
}

/* One side's rows, without `same`. Collective. */
static remap_status bring_home(rm_arena *arena, const rm_comm *comm, const rm_frame *frame, const rm_mesh *mesh,
                               const rm_part *part, const rm_moments *moments, rows_draft *draft, rm_rows *rows,
                               rm_reason *reason)
{
  rm_arena    *scratch = rm_arena_new(), *leaving = rm_arena_new(); /* leaving: what is sent */
  shipment     out = {.second = NULL}, in = {.second = NULL};
  remap_status status = new_offsets(leaving, comm, &out);

  if (status == REMAP_OK) status = new_offsets(scratch, comm, &in);
  if (status == REMAP_OK) status = pack_pairs(leaving, comm, part, moments, mesh->side, &out);
  RM_GOTO(done, status = rm_comm_agree(comm, status, NULL));
  RM_GOTO(done, status = ship(scratch, comm, &out, moments->second != NULL, &in));
  rm_arena_drop(leaving);
  leaving = NULL;
  status  = fill_rows(arena, scratch, comm, frame, mesh, &in, draft, rows, reason);
  RM_GOTO(done, status = rm_comm_agree_reason(comm, status, reason));
  publish(draft, rows);
  status = rm_plan_build(comm, arena, rows->num_givers, rows->giver_rank, rows->giver_cell, &rows->plan);
done:
  rm_arena_drop(leaving);
  rm_arena_drop(scratch);
  return status;
}

/* 1 for each covered cell with a single pair that has its volume. (Where no skin passes through a cell, that is its own volume
 * times how often the giving mesh winds about it, an integer, which is not one if cells are tangled.) */
static void mark_alone(const rm_mesh *mesh, const rm_rows *rows, uint8_t *alone)
{
  for (rm_lid c = 0; c < rows->num_cells; c++) {
    const int64_t first = rows->offset[c];
    const double  own   = mesh->cell_volume[c];

    alone[c] =
        rows->cover[c] == REMAP_COVERED && rows->offset[c + 1] - first == 1 && fabs(rows->volume[first] - own) < fabs(own) / 2;
  }
}

/* Mark the pairs of cells that cover each other alone: both homes know their half, and the plans carry it across.
 * Collective. */
static remap_status mark_same(const rm_comm *comm, const rm_mesh *const mesh[2], const rm_rows rows[2], rows_draft draft[2])
{
  rm_arena    *scratch  = rm_arena_new();
  uint8_t     *alone[2] = {NULL, NULL}, *heard[2] = {NULL, NULL}, *buffer[2] = {NULL, NULL};
  bool         have = scratch != NULL;
  remap_status status;

  for (int side = 0; side < 2 && have; side++) {
    const rm_plan *plan = rows[side].plan;

    alone[side]  = rm_arena_alloc(scratch, rows[side].num_cells, 1);
    heard[side]  = rm_arena_alloc(scratch, rows[side].num_givers, 1);
    buffer[side] = rm_arena_alloc(scratch, plan->send_offset[plan->num_send], 1);
    have         = alone[side] && heard[side] && buffer[side];
  }
  RM_GOTO(done, status = rm_comm_agree(comm, have ? REMAP_OK : REMAP_NO_MEMORY, NULL));
  for (int side = 0; side < 2; side++) mark_alone(mesh[side], &rows[side], alone[side]);
  for (int side = 0; side < 2 && status == REMAP_OK; side++)
    status = rm_plan_run(comm, rows[side].plan, 1, alone[1 - side], heard[side], buffer[side]);
  RM_GOTO(done, status = rm_comm_agree(comm, status, NULL));
  for (int side = 0; side < 2; side++)
    for (rm_lid c = 0; c < rows[side].num_cells; c++) {
      const int64_t k = rows[side].offset[c];

      if (!alone[side][c] || !heard[side][rows[side].giver[k]]) continue;
      draft[side].same[k]   = 1;
      draft[side].volume[k] = mesh[side]->cell_volume[c];
      for (int d = 0; d < 3; d++) draft[side].moment[k][d] = 0.0;
    }
done:
  rm_arena_drop(scratch);
  return status;
}

/* Where the pairs of a covered cell put its centroid, less where the mesh has it. Far from the origin the latter is rounded to
 * a good part of a cell's size; a slope about it would carry content that the cell does not have. Not collective. */
static void find_centroid_errors(const rm_mesh *mesh, const rm_rows *rows, rows_draft *draft)
{
  for (rm_lid c = 0; c < rows->num_cells; c++) {
    const int64_t  first = rows->offset[c], end = rows->offset[c + 1];
    const double  *centroid  = mesh->cell_centroid[c];
    rm_compensated moment[3] = {{0.0, 0.0}, {0.0, 0.0}, {0.0, 0.0}};

    if (rows->cover[c] != REMAP_COVERED || rows->same[first] || !(fabs(mesh->cell_volume[c]) > 0.0)) continue;
    for (int64_t k = first; k < end; k++) {
      const double *other = rows->giver_centroid[rows->giver[k]]; /* about which this row's moments are */

      for (int d = 0; d < 3; d++)
        rm_compensated_add(&moment[d], rows->moment[k][d] + (other[d] - centroid[d]) * rows->volume[k]);
    }
    for (int d = 0; d < 3; d++) {
      const double error = rm_compensated_value(&moment[d]) / mesh->cell_volume[c];

      if (fabs(error) <= 0x1p-48 * fabs(centroid[d])) draft->centroid_error[c][d] = error;
    }
  }
}

/* abs(sum of V - volume) / abs(volume), the sum in row order. */
static double closure_error(const rm_rows *rows, rm_lid cell, double cell_volume)
{
  rm_compensated sum = {-cell_volume, 0.0};

  for (int64_t k = rows->offset[cell]; k < rows->offset[cell + 1]; k++) rm_compensated_add(&sum, rows->volume[k]);
  return fabs(rm_compensated_value(&sum)) / fabs(cell_volume);
}

/* The worst closure of a side on this rank and the smallest global id of a cell that has it, or -1. */
static double worst_closure(const rm_rows *rows, const rm_mesh *mesh, rm_gid *worst_cell)
{
  double worst = 0.0;

  *worst_cell = -1;
  for (rm_lid c = 0; c < rows->num_cells; c++) {
    double error;

    if (rows->cover[c] != REMAP_COVERED || !(fabs(mesh->cell_volume[c]) > 0.0)) continue;
    error = closure_error(rows, c, mesh->cell_volume[c]);
    if (*worst_cell >= 0 && (error < worst || (!(error > worst) && mesh->cell_global[c] > *worst_cell))) continue;
    worst       = error;
    *worst_cell = mesh->cell_global[c];
  }
  return worst;
}

/* What is known over all ranks. Collective. */
static remap_status count_all(const rm_comm *comm, const rm_mesh *const mesh[2], rm_mapping *mapping)
{
  int64_t count[7] = {0}, smallest[2];
  double  worst[2];
  rm_sum  volume[7]; /* [side][cover], overlap */

  for (int k = 0; k < 7; k++) rm_sum_clear(&volume[k]);
  for (int side = 0; side < 2; side++) {
    const rm_rows *rows = &mapping->rows[side];

    for (rm_lid c = 0; c < rows->num_cells; c++) {
      count[3 * side + rows->cover[c]]++;
      rm_sum_add(&volume[3 * side + rows->cover[c]], fabs(mesh[side]->cell_volume[c]));
    }
    worst[side] = mapping->max_closure_error[side] = worst_closure(rows, mesh[side], &mapping->worst_closure_cell[side]);
  }
  count[6] = mapping->rows[REMAP_TARGET].offset[mapping->rows[REMAP_TARGET].num_cells];
  for (int64_t k = 0; k < count[6]; k++) rm_sum_add(&volume[6], mapping->rows[REMAP_TARGET].volume[k]);
  RM_TRY(rm_comm_sum_i64(comm, count, 7));
  RM_TRY(rm_comm_max_f64(comm, mapping->max_closure_error, 2));
  RM_TRY(rm_comm_sum_exact(comm, volume, 7));
  for (int side = 0; side < 2; side++) { /* the greatest negative id is the smallest one */
    const rm_gid cell = mapping->worst_closure_cell[side];

    smallest[side] = cell < 0 || worst[side] < mapping->max_closure_error[side] ? INT64_MIN : -cell;
  }
  RM_TRY(rm_comm_max_i64(comm, smallest, 2));
  for (int side = 0; side < 2; side++) {
    mapping->worst_closure_cell[side] = smallest[side] == INT64_MIN ? -1 : -smallest[side];
    for (int cover = 0; cover < 3; cover++) {
      mapping->cells_by_cover[side][cover]  = count[3 * side + cover];
      mapping->volume_by_cover[side][cover] = rm_sum_value(&volume[3 * side + cover]);
    }
  }
  mapping->num_pairs      = count[6];
  mapping->overlap_volume = rm_sum_value(&volume[6]);
  return REMAP_OK;
}

remap_status rm_mapping_build(rm_arena *arena, const rm_comm *comm, const rm_frame *frame, const rm_mesh *const mesh[2],
                              const rm_part *part, const rm_moments *moments, const rm_mapping **out, rm_reason *reason)
{
  rm_mapping *mapping = rm_arena_zero(arena, 1, sizeof *mapping);
  rows_draft  draft[2];

  RM_TRY(rm_comm_agree(comm, mapping ? REMAP_OK : REMAP_NO_MEMORY, NULL));
  RM_ASSERT(mapping);
  for (int side = 0; side < 2; side++)
    RM_TRY(bring_home(arena, comm, frame, mesh[side], part, moments, &draft[side], &mapping->rows[side], reason));
  RM_TRY(mark_same(comm, mesh, mapping->rows, draft));
  for (int side = 0; side < 2; side++) find_centroid_errors(mesh[side], &mapping->rows[side], &draft[side]);
  RM_TRY(count_all(comm, mesh, mapping));
  RM_ASSERT(rm_mapping_check(mapping, mesh) != REMAP_INTERNAL);
  *out = mapping;
  return REMAP_OK;
}
