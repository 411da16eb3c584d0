/* mapping -- from pairs on the ranks that overlaid them to rows on the ranks that own the cells.
 *
 *   overlay ranks          homes of the receiving cells
 *   (i, j, V, M)  ----->   j | i1 i2 i3 ...       serves source to target
 *        \------------->   i | j1 j2 ...          serves target to source, moments about c_j
 *
 * Each pair travels twice, as one record of 96 bytes, in one exchange per direction; its second moments, where there are any,
 * in another. A row is put into the canonical order of its givers, so nothing that is summed along it can depend on where the
 * pairs were made. O(p) time and memory for p pairs. */
#include "mapping.h"

#include <string.h>

/* A pair on its way to the home of its receiving cell. */
typedef struct pair_record {
  double  volume, moment[3]; /* about the giver's centroid */
  double  giver_centroid[3], giver_volume;
  rm_gid  giver_global;
  rm_lid  giver_cell, receiver; /* numbers at their homes */
  int32_t giver_rank;
  int16_t is_cut;   /* not 0: the skin of the giving mesh passes through the receiver */
  int16_t is_empty; /* not 0: the giver has no volume; no pair, but its skin counts   */
} pair_record;

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

/* The pairs of a piece as records, grouped by the home of the receiving cell, and their second moments in the same order, NULL
 * if there are none; offset is [comm->size + 1]. */
static remap_status pack_pairs(rm_arena *scratch, const rm_comm *comm, const rm_part *part, const rm_moments *moments,
                               remap_side receiving, int64_t *offset, pair_record **out, double (**out_second)[6])
{
  const bool      backward = receiving == REMAP_SOURCE;
  const rm_piece *to = &part->piece[receiving], *from = &part->piece[backward ? REMAP_TARGET : REMAP_SOURCE];
  const rm_lid *receiver = backward ? moments->source : moments->target, *giver = backward ? moments->target : moments->source;
  const int     skin = backward ? RM_PAIR_TARGET_SKIN : RM_PAIR_SOURCE_SKIN;
  const double (*given_second)[6] = backward ? moments->second_back : moments->second;
  pair_record  *record;
  int64_t      *next;
  double(*second)[6] = NULL;

  RM_NEW(record, scratch, moments->num_pairs);
  if (given_second) RM_NEW(second, scratch, moments->num_pairs);
  RM_NEW(next, scratch, (int64_t)comm->size + 1);
  for (int r = 0; r <= comm->size; r++) offset[r] = 0;
  for (int64_t k = 0; k < moments->num_pairs; k++) offset[to->cell_home_rank[receiver[k]]]++;
  rm_offsets(offset, comm->size);
  for (int r = 0; r < comm->size; r++) next[r] = offset[r];
  for (int64_t k = 0; k < moments->num_pairs; k++) {
    const rm_lid  i = giver[k], j = receiver[k];
    const double *c = from->cell_centroid[i];
    const int64_t at = next[to->cell_home_rank[j]]++;
    pair_record  *p  = &record[at];

    *p = (pair_record){.volume         = moments->volume[k],
                       .giver_centroid = {c[0], c[1], c[2]},
                       .giver_volume   = from->cell_volume[i],
                       .giver_global   = from->cell_global[i],
                       .giver_cell     = from->cell_home[i],
                       .receiver       = to->cell_home[j],
                       .giver_rank     = from->cell_home_rank[i],
                       .is_cut         = (moments->flags[k] & skin) != 0,
                       .is_empty       = (moments->flags[k] & RM_PAIR_EMPTY) != 0};
    for (int d = 0; d < 3; d++) /* backward the receiver is the source cell, about whose centroid M is given */
      p->moment[d] = moments->moment[k][d] + (backward ? (to->cell_centroid[j][d] - c[d]) * p->volume : 0.0);
    for (int d = 0; d < 6 && second; d++) second[at][d] = given_second[k][d];
  }
  *out        = record;
  *out_second = second;
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

/* List every giver once, by rank and number there; giver_of_record [n] receives its place in the list. keyed is [2 n]. */
static remap_status list_givers(rm_arena *arena, rm_keyed *keyed, int64_t n, const pair_record *record, rows_draft *draft,
                                rm_rows *rows, rm_lid *giver_of_record)
{
  int64_t num = 0;

  for (int64_t k = 0; k < n; k++)
    keyed[k] = (rm_keyed){(uint64_t)record[k].giver_rank << 32 | (uint64_t)record[k].giver_cell, k};
  rm_sort_keyed(keyed, keyed + n, n);
  for (int64_t k = 0; k < n; k++) {
    num += k == 0 || keyed[k].key != keyed[k - 1].key;
    giver_of_record[keyed[k].item] = (rm_lid)(num - 1);
  }
  rows->num_givers = (rm_lid)num;
  RM_NEW(draft->giver_rank, arena, num);
  RM_NEW(draft->giver_cell, arena, num);
  RM_NEW(draft->giver_global, arena, num);
  RM_NEW(draft->giver_centroid, arena, num);
  for (int64_t k = 0; k < n; k++) {
    const rm_lid g = giver_of_record[k];

    draft->giver_rank[g]   = record[k].giver_rank;
    draft->giver_cell[g]   = record[k].giver_cell;
    draft->giver_global[g] = record[k].giver_global;
    for (int d = 0; d < 3; d++) draft->giver_centroid[g][d] = record[k].giver_centroid[d];
  }
  return REMAP_OK;
}

/* Records sorted by receiver and, within, by the canonical order of the givers: place [n] lists them so. keyed is [2 n]. */
static remap_status sort_rows(rm_arena *scratch, rm_keyed *keyed, const rm_frame *frame, int64_t n, const pair_record *record,
                              const rm_lid *giver_of_record, const rows_draft *draft, const rm_rows *rows, int64_t *place)
{
  const rm_lid num = rows->num_givers;
  double      *volume; /* of the givers */
  rm_lid      *order, *rank_of_giver;
  int64_t     *next;

  RM_NEW(volume, scratch, num);
  RM_NEW(order, scratch, num);
  RM_NEW(rank_of_giver, scratch, num);
  RM_NEW(next, scratch, rows->num_cells);
  for (int64_t k = 0; k < n; k++) volume[giver_of_record[k]] = record[k].giver_volume;
  RM_TRY(
      rm_canonical_order(scratch, frame, num, (const double(*)[3])draft->giver_centroid, volume, draft->giver_global, order));
  for (rm_lid k = 0; k < num; k++) rank_of_giver[order[k]] = k;
  for (int64_t k = 0; k < n; k++) keyed[k] = (rm_keyed){(uint64_t)rank_of_giver[giver_of_record[k]], k};
  rm_sort_keyed(keyed, keyed + n, n);
  for (rm_lid c = 0; c < rows->num_cells; c++) next[c] = draft->offset[c];
  for (int64_t k = 0; k < n; k++) place[next[record[keyed[k].item].receiver]++] = keyed[k].item;
  return REMAP_OK;
}

/* Mark the cells that a skin passes through, and take the records out that are no pairs, with their second moments. Returns how
 * many stay. */
static int64_t mark_cut(int64_t n, pair_record *record, double (*second)[6], uint8_t *is_cut)
{
  int64_t kept = 0;

  for (int64_t k = 0; k < n; k++) {
    is_cut[record[k].receiver] |= record[k].is_cut != 0;
    if (record[k].is_empty) continue;
    if (second) memmove(second[kept], second[k], sizeof *second);
    record[kept++] = record[k];
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

/* Rows of one side out of the records that came, with their second moments (NULL: none); both are reordered. What stays to be
 * filled in is `same` and the plan. */
static remap_status fill_rows(rm_arena *arena, rm_arena *scratch, const rm_frame *frame, const rm_mesh *mesh, int64_t n,
                              pair_record *record, double (*second)[6], rows_draft *draft, rm_rows *rows, rm_reason *reason)
{
  rm_lid   *giver_of_record;
  int64_t  *place;
  uint8_t  *is_cut;
  rm_keyed *keyed;

  if (n > INT32_MAX)
    return rm_fail(REMAP_TOO_LARGE, reason, mesh->side, -1, "%lld pairs come to one rank; use more ranks", (long long)n);
  rows->num_cells = mesh->num_cells;
  RM_NEW0(is_cut, scratch, mesh->num_cells);
  n = mark_cut(n, record, second, is_cut);
  RM_TRY(new_rows(arena, mesh->num_cells, n, second != NULL, draft));
  RM_NEW(giver_of_record, scratch, n);
  RM_NEW(place, scratch, n);
  RM_NEW(keyed, scratch, 2 * n);
  for (int64_t k = 0; k < n; k++) {
    RM_ASSERT(record[k].receiver >= 0 && record[k].receiver < mesh->num_cells);
    draft->offset[record[k].receiver]++;
  }
  rm_offsets(draft->offset, mesh->num_cells);
  RM_TRY(list_givers(arena, keyed, n, record, draft, rows, giver_of_record));
  RM_TRY(sort_rows(scratch, keyed, frame, n, record, giver_of_record, draft, rows, place));
  for (rm_lid c = 0; c < mesh->num_cells; c++) {
    for (int64_t k = draft->offset[c]; k < draft->offset[c + 1]; k++) {
      const pair_record *p = &record[place[k]];

      draft->giver[k]  = giver_of_record[place[k]];
      draft->volume[k] = p->volume;
      for (int d = 0; d < 3; d++) draft->moment[k][d] = p->moment[d];
      for (int d = 0; d < 6 && second; d++) draft->second[k][d] = second[place[k]][d];
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
  int64_t     *send_offset = leaving ? rm_arena_alloc(leaving, (int64_t)comm->size + 1, sizeof *send_offset) : NULL;
  int64_t     *recv_offset = scratch ? rm_arena_alloc(scratch, (int64_t)comm->size + 1, sizeof *recv_offset) : NULL;
  pair_record *send        = NULL;
  void        *recv = NULL, *recv_second = NULL;
  double(*send_second)[6]  = NULL;
  remap_status status      = REMAP_NO_MEMORY;

  if (send_offset && recv_offset)
    status = pack_pairs(leaving, comm, part, moments, mesh->side, send_offset, &send, &send_second);
  RM_GOTO(done, status = rm_comm_agree(comm, status, NULL));
  RM_GOTO(done, status = rm_comm_exchange(comm, scratch, sizeof *send, send_offset, send, recv_offset, &recv));
  if (moments->second)
    RM_GOTO(done,
            status = rm_comm_exchange(comm, scratch, sizeof *send_second, send_offset, send_second, recv_offset, &recv_second));
  rm_arena_drop(leaving);
  leaving = NULL;
  status  = fill_rows(arena, scratch, frame, mesh, recv_offset[comm->size], recv, recv_second, draft, rows, reason);
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
