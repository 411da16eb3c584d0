/* mapping -- rows on the ranks that own the cells, out of the pairs that have come to them.
 *
 * A row is put into the canonical order of its givers, so nothing that is summed along it can depend on where the pairs were
 * made. The rows of the source cells say which pair of a target cell is theirs; what that holds is turned round when it is
 * asked for. O(p) time for p pairs; besides the pairs, 20 bytes each are needed on the way, and 100 per giver. */
#include "mapping_private.h"

#include <stdlib.h>
#include <string.h>

/* A side's rows while they are filled: the arrays of rm_rows, writable. */
typedef struct rows_draft {
  int64_t *offset;
  uint8_t *same, *cover;
  double  *volume;     /* source side: in passing */
  double (*moment)[3]; /* NULL of the source side */
  double (*centroid_error)[3];
  int    *giver_rank;
  rm_lid *giver_cell;
  rm_gid *giver_global;
  double (*giver_centroid)[3];
} rows_draft;

/* One call of rm_mapping_close. */
typedef struct job {
  rm_arena             *arena, *passing; /* passing: until rows of both sides are there */
  const rm_comm        *comm;
  const rm_frame       *frame;
  const rm_mesh *const *mesh;
  rm_mapping           *mapping;
  rows_draft            draft[2];
  rm_lid               *place_of; /* [pairs of the target cells] where in the rows each is that arrived */
} job;

static remap_status new_rows(rm_arena *arena, int64_t num_cells, rows_draft *draft)
{
  RM_NEW0(draft->offset, arena, num_cells + 1);
  RM_NEW0(draft->cover, arena, num_cells);
  RM_NEW0(draft->same, arena, num_cells);
  RM_NEW0(draft->centroid_error, arena, num_cells);
  return REMAP_OK;
}

/* The givers by rank and number there; pairs say which by their places in that list. */
static remap_status sort_givers(rm_arena *arena, rm_arrivals *a, rows_draft *draft, rm_rows *rows)
{
  const int64_t num     = a->num_givers;
  rm_arena     *scratch = rm_arena_new();
  rm_keyed     *keyed   = scratch ? rm_arena_alloc(scratch, 2 * num, sizeof *keyed) : NULL;
  rm_lid       *number  = scratch ? rm_arena_alloc(scratch, num, sizeof *number) : NULL; /* where each is then */
  const bool    have    = keyed && number;

  for (int64_t g = 0; g < num && have; g++)
    keyed[g] = (rm_keyed){(uint64_t)a->giver_rank[g] << 32 | (uint64_t)a->giver_cell[g], g};
  if (have) rm_sort_keyed(keyed, keyed + num, num);
  draft->giver_rank     = rm_arena_alloc(arena, num, sizeof *draft->giver_rank);
  draft->giver_cell     = rm_arena_alloc(arena, num, sizeof *draft->giver_cell);
  draft->giver_global   = rm_arena_alloc(arena, num, sizeof *draft->giver_global);
  draft->giver_centroid = rm_arena_alloc(arena, num, sizeof *draft->giver_centroid);
  rows->num_givers      = (rm_lid)num;
  const bool done = have && draft->giver_rank && draft->giver_cell && draft->giver_global && draft->giver_centroid;
  for (int64_t g = 0; g < num && done; g++) {
    draft->giver_rank[g]   = (int)(keyed[g].key >> 32);
    draft->giver_cell[g]   = (rm_lid)(keyed[g].key & INT32_MAX);
    number[keyed[g].item]  = (rm_lid)g;
  }
  for (int64_t k = 0; k < a->num && done; k++) a->giver[k] = number[a->giver[k]];
  rm_arena_drop(scratch);
  rm_arrivals_forget_givers(a);
  return done ? REMAP_OK : REMAP_NO_MEMORY;
}

/* What rows need to know of their givers, from the homes; volume [num_givers]. Collective. */
static remap_status fetch_givers(rm_arena *scratch, const rm_comm *comm, const rm_mesh *givers, const rm_rows *rows,
                                 rows_draft *draft, double **volume)
{
  const rm_plan *plan   = rows->plan;
  void          *buffer = rm_arena_alloc(scratch, plan->send_offset[plan->num_send], sizeof *draft->giver_centroid);

  *volume = rm_arena_alloc(scratch, rows->num_givers, sizeof **volume);
  RM_TRY(rm_comm_agree(comm, buffer && *volume ? REMAP_OK : REMAP_NO_MEMORY, NULL));
  RM_TRY(rm_plan_run(comm, plan, sizeof *draft->giver_centroid, givers->cell_centroid, draft->giver_centroid, buffer));
  RM_TRY(rm_plan_run(comm, plan, sizeof **volume, givers->cell_volume, *volume, buffer));
  return rm_plan_run(comm, plan, sizeof *draft->giver_global, givers->cell_global, draft->giver_global, buffer);
}

/* Put the places of a row's pairs, n of them, into the order of their givers. word is [n]. */
static void sort_row(const rm_lid *giver, const rm_lid *rank_of_giver, uint64_t *word, rm_lid *place, int64_t n)
{
  for (int64_t k = 0; k < n; k++) word[k] = (uint64_t)rank_of_giver[giver[place[k]]] << 32 | (uint64_t)place[k];
  rm_sort_words(word, n);
  for (int64_t k = 0; k < n; k++) place[k] = (rm_lid)(word[k] & INT32_MAX);
}

/* Which pair stands where in the rows: place [pairs]; and the rows' offsets. volume [num_givers]. */
static remap_status order_pairs(rm_arena *scratch, const job *j, const rm_arrivals *a, const rm_rows *rows, rows_draft *draft,
                                const double *volume, rm_lid *place)
{
  const rm_lid num = rows->num_givers;
  int64_t      longest = 0;
  uint64_t    *word;
  rm_lid      *order, *rank_of_giver;

  RM_NEW(order, scratch, num);
  RM_NEW(rank_of_giver, scratch, num);
  RM_TRY(rm_canonical_order(scratch, j->frame, num, (const double(*)[3])draft->giver_centroid, volume, draft->giver_global,
                            order));
  for (rm_lid k = 0; k < num; k++) rank_of_giver[order[k]] = k;
  for (int64_t k = 0; k < a->num; k++) RM_ASSERT(a->receiver[k] >= 0 && a->receiver[k] < rows->num_cells);
  rm_group(a->num, a->receiver, rows->num_cells, draft->offset, place);
  for (rm_lid c = 0; c < rows->num_cells; c++) {
    const int64_t length = draft->offset[c + 1] - draft->offset[c];

    longest = length > longest ? length : longest;
  }
  RM_NEW(word, scratch, longest);
  for (rm_lid c = 0; c < rows->num_cells; c++)
    sort_row(a->giver, rank_of_giver, word, place + draft->offset[c], draft->offset[c + 1] - draft->offset[c]);
  return REMAP_OK;
}

/* The same, in memory that ends here, and then the pairs in that order; place [pairs]. Collective. */
static remap_status arrange(job *j, rm_arrivals *a, remap_side side, rm_lid *place)
{
  rm_rows     *rows    = &j->mapping->rows[side];
  rows_draft  *draft   = &j->draft[side];
  rm_arena    *scratch = rm_arena_new();
  double      *volume;
  remap_status status  = rm_comm_agree(j->comm, scratch && place ? REMAP_OK : REMAP_NO_MEMORY, NULL);

  RM_GOTO(done, status);
  RM_GOTO(done, status = fetch_givers(scratch, j->comm, j->mesh[1 - side], rows, draft, &volume));
  status = rm_comm_agree(j->comm, order_pairs(scratch, j, a, rows, draft, volume, place), NULL);
done:
  rm_arena_drop(scratch);
  if (status == REMAP_OK) rm_arrivals_permute(a, place);
  return status;
}

/* An array of the arrivals, *data, becomes the arena's, cut off after n elements. It moves from *data to *out. */
static remap_status keep(rm_arena *arena, void *data, int64_t n, size_t size, void *out)
{
  static void *const none = NULL;
  const size_t       bytes = n > 0 ? (size_t)n * size : 1;
  void              *array;

  memcpy(&array, data, sizeof array); /* data and out point to pointers of some type */
  array = realloc(array, bytes);
  if (!array) return REMAP_NO_MEMORY;
  memcpy(data, &array, sizeof array);
  RM_TRY(rm_arena_adopt(arena, array, bytes));
  memcpy(out, &array, sizeof array);
  memcpy(data, &none, sizeof none);
  return REMAP_OK;
}

static remap_status keep_target(job *j, rm_arrivals *a, rows_draft *draft, const rm_lid *place)
{
  RM_TRY(keep(j->arena, &a->volume, a->num, sizeof *a->volume, &draft->volume));
  RM_TRY(keep(j->arena, &a->moment, a->num, sizeof *a->moment, &draft->moment));
  RM_NEW(j->place_of, j->passing, a->num);
  for (int64_t k = 0; k < a->num; k++) j->place_of[place[k]] = (rm_lid)k;
  return REMAP_OK;
}

/* Moments of pairs that are away are about their source cell's centroid as they arrive; take them about the target cell's. */
static void turn_away(const rm_mesh *sources, const rows_draft *draft, rm_arrivals *a)
{
  for (rm_lid c = 0; c < sources->num_cells; c++)
    for (int64_t k = draft->offset[c]; k < draft->offset[c + 1]; k++) {
      const double *own = sources->cell_centroid[c], *other = draft->giver_centroid[a->giver[k]];
      const rm_lid  away = -1 - a->twin[k];

      for (int d = 0; d < 3 && away >= 0; d++) a->moment[away][d] += (own[d] - other[d]) * a->volume[away];
    }
}

static remap_status keep_source(job *j, rm_arrivals *a, rows_draft *draft, rm_rows *rows)
{
  const double *of_target = j->draft[REMAP_TARGET].volume;

  RM_NEW(draft->volume, j->passing, a->num);
  draft->moment = NULL;
  for (int64_t k = 0; k < a->num; k++) {
    if (a->twin[k] >= 0) a->twin[k] = j->place_of[a->twin[k]];
    draft->volume[k] = a->twin[k] >= 0 ? of_target[a->twin[k]] : a->volume[-1 - a->twin[k]];
  }
  turn_away(j->mesh[REMAP_SOURCE], draft, a);
  RM_TRY(keep(j->arena, &a->twin, a->num, sizeof *a->twin, &rows->twin));
  RM_TRY(keep(j->arena, &a->volume, a->num_held, sizeof *a->volume, &rows->away_volume));
  return keep(j->arena, &a->moment, a->num_held, sizeof *a->moment, &rows->away_moment);
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

/* What rows are of arrivals that stand in order, but for `same` and what rests on that. Not collective. */
static remap_status fill_rows(job *j, rm_arrivals *a, remap_side side, const rm_lid *place)
{
  rows_draft    *draft = &j->draft[side];
  rm_rows       *rows  = &j->mapping->rows[side];
  const rm_mesh *mesh  = j->mesh[side];

  if (side == REMAP_TARGET) RM_TRY(keep_target(j, a, draft, place));
  else RM_TRY(keep_source(j, a, draft, rows));
  RM_TRY(keep(j->arena, &a->giver, a->num, sizeof *a->giver, &rows->giver));
  if (a->second) RM_TRY(keep(j->arena, &a->second, a->num, sizeof *a->second, &rows->second));
  for (rm_lid c = 0; c < mesh->num_cells; c++)
    if (draft->offset[c] < draft->offset[c + 1]) /* else uncovered */
      draft->cover[c] = (uint8_t)cover_of(draft, c, mesh->cell_volume[c], a->is_cut[c] != 0);
  return REMAP_OK;
}

static void publish(const rows_draft *draft, rm_rows *rows)
{
  rows->offset         = draft->offset;
  rows->volume         = draft->volume;
  rows->moment         = (const double(*)[3])draft->moment;
  rows->same           = draft->same;
  rows->cover          = draft->cover;
  rows->centroid_error = (const double(*)[3])draft->centroid_error;
  rows->giver_rank     = draft->giver_rank;
  rows->giver_cell     = draft->giver_cell;
  rows->giver_global   = draft->giver_global;
  rows->giver_centroid = (const double(*)[3])draft->giver_centroid;
}

/* One side's rows, without `same`. Collective. */
static remap_status make_rows(job *j, rm_arrivals *a, remap_side side)
{
  rm_rows     *rows   = &j->mapping->rows[side];
  rows_draft  *draft  = &j->draft[side];
  remap_status status = new_rows(j->arena, j->mesh[side]->num_cells, draft);
  rm_arena    *passing;
  rm_lid      *place;

  rows->num_cells = j->mesh[side]->num_cells;
  if (status == REMAP_OK) status = sort_givers(j->arena, a, draft, rows);
  RM_TRY(rm_comm_agree(j->comm, status, NULL));
  RM_TRY(rm_plan_build(j->comm, j->arena, rows->num_givers, draft->giver_rank, draft->giver_cell, &rows->plan));
  passing = rm_arena_new();
  place   = passing ? rm_arena_alloc(passing, a->num, sizeof *place) : NULL;
  RM_GOTO(done, status = arrange(j, a, side, place));
  if (side == REMAP_SOURCE) { /* nobody asks for the places of its pairs */
    rm_arena_drop(passing);
    passing = NULL;
    place   = NULL;
  }
  status = rm_comm_agree(j->comm, fill_rows(j, a, side, place), NULL);
  publish(draft, rows);
done:
  rm_arena_drop(passing);
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
      draft[side].same[c]   = 1;
      draft[side].volume[k] = mesh[side]->cell_volume[c];
      for (int d = 0; d < 3 && draft[side].moment; d++) draft[side].moment[k][d] = 0.0;
    }
done:
  rm_arena_drop(scratch);
  return status;
}

double rm_mapping_pair(const rm_rows *rows, const rm_rows *back, const rm_mesh *mesh, rm_lid cell, int64_t k, double moment[3])
{
  if (rows->moment) {
    memcpy(moment, rows->moment[k], 3 * sizeof *moment);
    return rows->volume[k];
  }
  if (rows->same[cell]) {
    memset(moment, 0, 3 * sizeof *moment);
    return mesh->cell_volume[cell];
  }
  const rm_lid twin = rows->twin[k];
  if (twin < 0) {
    memcpy(moment, rows->away_moment[-1 - twin], 3 * sizeof *moment);
    return rows->away_volume[-1 - twin];
  }
  for (int d = 0; d < 3; d++)
    moment[d] = back->moment[twin][d] +
                (mesh->cell_centroid[cell][d] - rows->giver_centroid[rows->giver[k]][d]) * back->volume[twin];
  return back->volume[twin];
}

/* Where the pairs of a covered cell put its centroid, less where the mesh has it. Far from the origin the latter is rounded to
 * a good part of a cell's size; a slope about it would carry content that the cell does not have. Not collective. */
static void find_centroid_errors(const rm_mesh *mesh, const rm_mapping *mapping, rows_draft *draft)
{
  const rm_rows *rows = &mapping->rows[mesh->side];

  for (rm_lid c = 0; c < rows->num_cells; c++) {
    const int64_t  first = rows->offset[c], end = rows->offset[c + 1];
    const double  *centroid  = mesh->cell_centroid[c];
    rm_compensated moment[3] = {{0.0, 0.0}, {0.0, 0.0}, {0.0, 0.0}};

    if (rows->cover[c] != REMAP_COVERED || rows->same[c] || !(fabs(mesh->cell_volume[c]) > 0.0)) continue;
    for (int64_t k = first; k < end; k++) {
      const double *other = rows->giver_centroid[rows->giver[k]]; /* about which this row's moments are */
      double        own[3];

      rm_mapping_pair(rows, &mapping->rows[REMAP_TARGET], mesh, c, k, own);
      for (int d = 0; d < 3; d++) rm_compensated_add(&moment[d], own[d] + (other[d] - centroid[d]) * rows->volume[k]);
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

static remap_status close_both(job *j, rm_gathering *g)
{
  static const remap_side order[2] = {REMAP_TARGET, REMAP_SOURCE}; /* sources look up the pairs of targets */

  for (int k = 0; k < 2; k++) RM_TRY(make_rows(j, &g->of[order[k]], order[k]));
  RM_TRY(mark_same(j->comm, j->mesh, j->mapping->rows, j->draft));
  for (int side = 0; side < 2; side++) find_centroid_errors(j->mesh[side], j->mapping, &j->draft[side]);
  RM_TRY(count_all(j->comm, j->mesh, j->mapping));
  j->mapping->rows[REMAP_SOURCE].volume = NULL; /* it ends here */
  return REMAP_OK;
}

remap_status rm_mapping_close(rm_arena *arena, rm_gathering *g, const rm_comm *comm, const rm_frame *frame,
                              const rm_mesh *const mesh[2], const rm_mapping **out, rm_reason *reason)
{
  job          j      = {.arena = arena, .passing = rm_arena_new(), .comm = comm, .frame = frame, .mesh = mesh};
  remap_status status = REMAP_NO_MEMORY;

  j.mapping = rm_arena_zero(arena, 1, sizeof *j.mapping);
  if (j.mapping && j.passing) status = REMAP_OK;
  RM_GOTO(done, status = rm_comm_agree(comm, status, NULL));
  RM_GOTO(done, status = rm_gathering_send(g, comm, reason));
  RM_GOTO(done, status = close_both(&j, g));
  RM_ASSERT(rm_mapping_check(j.mapping, mesh) != REMAP_INTERNAL);
  *out = j.mapping;
done:
  rm_arena_drop(j.passing);
  return status;
}

remap_status rm_mapping_complete(rm_arena *arena, const rm_mesh *const mesh[2], const rm_mapping *mapping,
                                 const rm_mapping **out)
{
  const rm_rows *rows = &mapping->rows[REMAP_SOURCE];
  const int64_t  n    = rows->offset[rows->num_cells];
  rm_mapping    *all;
  double        *volume, (*moment)[3];

  RM_NEW(all, arena, 1);
  RM_NEW(volume, arena, n);
  RM_NEW(moment, arena, n);
  for (rm_lid c = 0; c < rows->num_cells; c++)
    for (int64_t k = rows->offset[c]; k < rows->offset[c + 1]; k++)
      volume[k] = rm_mapping_pair(rows, &mapping->rows[REMAP_TARGET], mesh[REMAP_SOURCE], c, k, moment[k]);
  *all                           = *mapping;
  all->rows[REMAP_SOURCE].volume = volume;
  all->rows[REMAP_SOURCE].moment = (const double(*)[3])moment;
  *out                           = all;
  RM_ASSERT(rm_mapping_check(all, mesh) != REMAP_INTERNAL);
  return REMAP_OK;
}

remap_status rm_mapping_build(rm_arena *arena, const rm_comm *comm, const rm_frame *frame, const rm_mesh *const mesh[2],
                              const rm_part *part, const rm_moments *moments, const rm_mapping **out, rm_reason *reason)
{
  rm_gathering     *g = rm_mapping_open(mesh, moments->second != NULL, 1);
  const rm_mapping *short_of_sources;
  remap_status      status = g ? rm_mapping_add(g, part, moments) : REMAP_NO_MEMORY;

  RM_GOTO(done, status = rm_comm_agree(comm, status, NULL));
  RM_GOTO(done, status = rm_mapping_close(arena, g, comm, frame, mesh, &short_of_sources, reason));
  status = rm_comm_agree(comm, rm_mapping_complete(arena, mesh, short_of_sources, out), NULL);
done:
  rm_gathering_drop(g);
  return status;
}
