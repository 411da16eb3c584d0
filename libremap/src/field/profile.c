/* profile -- the fields of one mesh reconstructed, with the messages that this takes: numbers around the stencils; for the
 * limiter auto slopes, then which cells are rough, thrice; with systems a reduction over all ranks. O(neighbours) per cell and
 * field; 8 to 48 bytes per cell and field in the pack, 56 more for polynomials of degree 2; for auto 16 more, and another 16
 * unless bounds travel. */
#include "field_private.h"

#include <string.h>

void rm_word_add(rm_word *word, remap_status status)
{
  if (status > word->mine) word->mine = status;
  if ((int32_t)status > word->note.status) word->note.status = (int32_t)status;
}

void rm_word_post(rm_word *word, const rm_comm *comm, rm_flow *flow, size_t size, const void *item)
{
  const bool opens = !word->is_given;

  word->is_given = true;
  rm_word_add(word, rm_flow_post(comm, flow, &word->parley, opens, size, item, word->note));
}

void rm_word_hear(rm_word *word, remap_status status)
{
  if (status == REMAP_BAD_ARGUMENT)
    rm_fail(status, &word->reason, -1, -1,
            "a neighbouring rank calls another function, or passes another direction, transfer, number, natures or old values "
            "of fields, or reports where others pass NULL");
  rm_word_add(word, status);
}

void rm_word_await(rm_word *word, const rm_comm *comm, rm_flow *flow)
{
  if (flow->is_under_way) rm_word_hear(word, rm_flow_wait(comm, flow, &word->parley, &word->note));
}

bool rm_word_count(rm_word *word, const rm_comm *comm)
{
  if (!word->is_counted) rm_word_add(word, rm_parley_all(comm, &word->parley, &word->is_complete));
  word->is_counted = true;
  if (!word->is_complete)
    rm_word_add(word, rm_fail(REMAP_BAD_ARGUMENT, &word->reason, -1, -1, "the ranks pass different arguments"));
  return word->is_complete;
}

bool rm_word_agree(rm_word *word, const rm_comm *comm)
{
  if (!rm_word_count(word, comm)) return false;
  word->note.status = (int32_t)rm_comm_agree(comm, (remap_status)word->note.status, NULL);
  return word->note.status == REMAP_OK;
}

static void mark_halo_cells(const rm_stencil *stencil, uint8_t *needs_halo)
{
  for (rm_lid c = 0; c < stencil->num_cells; c++) {
    for (int64_t k = stencil->offset[c]; k < stencil->offset[c + 1]; k++)
      needs_halo[c] |= stencil->neighbour[k] >= stencil->num_cells;
    for (int64_t k = stencil->wide_offset ? stencil->wide_offset[c] : 0;
         stencil->wide_offset && k < stencil->wide_offset[c + 1]; k++)
      needs_halo[c] |= stencil->wide_neighbour[k] >= stencil->num_cells;
  }
}

/* What it takes to tell smooth cells from others. */
static remap_status make_smoothing(rm_arena *arena, int stream, const rm_load *load, rm_profile *p)
{
  const rm_plan *plan = p->ground.stencil->plan;
  const int64_t  n = load->num_fields, cells = p->ground.mesh->num_cells, words = rm_rough_words(load->num_fields);

  RM_TRY(rm_flow_init(arena, plan, stream, 4 * (size_t)n * sizeof *p->shown, &p->slopes));
  RM_TRY(rm_flow_init(arena, plan, stream, (size_t)words * sizeof *p->rough, &p->roughs));
  RM_NEW(p->shown, arena, rm_add_sat(rm_mul_sat(4 * n, cells), 1)); /* one more, here and below: lanes.h */
  RM_NEW(p->rough, arena, rm_mul_sat(words, cells));
  RM_NEW(p->spread, arena, rm_mul_sat(words, cells));
  if (load->keeps_bounds) RM_NEW(p->bounds, arena, rm_add_sat(rm_mul_sat(2 * n, cells), 1));
  return REMAP_OK;
}

remap_status rm_profile_init(rm_arena *arena, int stream, const rm_load *load, rm_profile *p)
{
  const rm_lid   cells = p->ground.mesh->num_cells;
  const int      n     = load->num_fields;
  const size_t   bytes = (size_t)n * sizeof(double);
  const rm_plan *plan  = load->has_slopes ? p->ground.stencil->plan : NULL;

  RM_NEW0(p->needs_halo, arena, cells);
  RM_NEW(p->limited, arena, 2 * (int64_t)n);
  RM_NEW0(p->extreme, arena, 2 * (int64_t)n);
  RM_NEW(p->line, arena, 7 * (int64_t)n + 1); /* one more: lanes.h */
  RM_NEW(p->is_made, arena, n);
  if (load->has_slopes) {
    RM_TRY(rm_flow_init(arena, plan, stream, bytes, &p->halo));
    mark_halo_cells(p->ground.stencil, p->needs_halo);
  }
  return load->is_checked ? make_smoothing(arena, stream, load, p) : REMAP_OK;
}

bool rm_profile_reads_halo(const rm_packing *packing)
{
  bool reads = false;

  for (int f = 0; f < packing->num_fields; f++) reads |= packing->order[f] > 1;
  return reads;
}

/* Values as they are, where nothing else travels: to the pack of a profile whose cells have places there. */
static void copy_values(const rm_profile *p, int num)
{
  for (rm_lid c = 0; c < p->ground.mesh->num_cells && num == 1; c++) p->pack[p->place[c]] = p->given[c];
  for (rm_lid c = 0; c < p->ground.mesh->num_cells && num > 1; c++)
    memcpy(p->pack + (int64_t)p->place[c] * num, p->given + (int64_t)c * num, (size_t)num * sizeof *p->pack);
}

void rm_profile_post(rm_profile *p, const rm_comm *comm, const rm_packing *packing, rm_word *word)
{
  const size_t bytes   = (size_t)packing->num_fields * sizeof(double);
  const bool   is_bare = packing->width == packing->num_fields && packing->num_systems == 0 && !p->ground.measure;

  for (int f = 0; f < 2 * packing->num_fields; f++) p->limited[f] = 0;
  if (rm_profile_reads_halo(packing)) {
    rm_word_post(word, comm, &p->halo, bytes, p->number);
  } else if (word->note.status == REMAP_OK && is_bare) {
    copy_values(p, packing->num_fields);
  } else if (word->note.status == REMAP_OK) {
    rm_reconstruct(p, packing, 0, RM_FINISH);
    rm_reconstruct(p, packing, 1, RM_FINISH);
  }
}

/* Tell smooth cells from others: slopes of all around, then roughness, layer after layer. */
static void find_smooth(rm_profile *p, const rm_comm *comm, const rm_packing *packing, rm_word *word)
{
  const int words = rm_rough_words(packing->num_fields);

  rm_word_post(word, comm, &p->slopes, 4 * (size_t)packing->num_fields * sizeof *p->shown, p->shown);
  rm_word_await(word, comm, &p->slopes);
  if (word->note.status == REMAP_OK) rm_smooth_roughness(p, packing, p->rough);
  for (int layer = 0; layer < RM_ROUGH_LAYERS; layer++) {
    uint64_t *const before = p->rough;

    rm_word_post(word, comm, &p->roughs, (size_t)words * sizeof *p->rough, p->rough);
    rm_word_await(word, comm, &p->roughs);
    if (word->note.status == REMAP_OK)
      rm_smooth_spread(p, words, p->rough, (const uint64_t *)(const void *)p->roughs.received, p->spread);
    if (layer + 1 == RM_ROUGH_LAYERS) break;
    p->rough  = p->spread;
    p->spread = before;
  }
}

/* The least and the greatest number of every field anywhere. Collective. */
static void find_extremes(rm_profile *p, const rm_comm *comm, const rm_packing *packing, rm_word *word)
{
  const int num = packing->num_fields;

  for (int f = 0; f < 2 * num; f++) p->extreme[f] = -INFINITY; /* of negative numbers, then of numbers */
  for (rm_lid c = 0; c < p->ground.mesh->num_cells; c++)
    for (int f = 0; f < num; f++) {
      const double x = p->number[(int64_t)c * num + f];

      if (p->ground.rows->cover[c] == REMAP_UNWANTED || !isfinite(x)) continue;
      p->extreme[f]       = fmax(p->extreme[f], -x);
      p->extreme[num + f] = fmax(p->extreme[num + f], x);
    }
  if (!rm_word_agree(word, comm)) return;
  rm_word_add(word, rm_comm_max_f64(comm, p->extreme, 2 * num));
  for (int f = 0; f < num; f++) p->extreme[f] = -p->extreme[f];
}

void rm_profile_finish(rm_profile *p, const rm_comm *comm, const rm_packing *packing, rm_word *word)
{
  const bool waits = packing->is_checked || packing->num_systems > 0; /* no cell is finished before all are looked at */
  const int  steps = waits ? RM_FIT : RM_FIT | RM_FINISH;

  if (!rm_profile_reads_halo(packing)) return;
  if (word->note.status == REMAP_OK) rm_reconstruct(p, packing, 0, steps);
  rm_word_await(word, comm, &p->halo);
  if (word->note.status == REMAP_OK) rm_reconstruct(p, packing, 1, steps);
  if (packing->is_checked) find_smooth(p, comm, packing, word);
  if (packing->num_systems > 0) find_extremes(p, comm, packing, word);
  if (word->note.status != REMAP_OK || !waits) return;
  rm_reconstruct(p, packing, 0, RM_FINISH);
  rm_reconstruct(p, packing, 1, RM_FINISH);
}

void rm_profile_abandon(rm_profile *p, const rm_comm *comm, rm_word *word) { rm_word_await(word, comm, &p->halo); }
