/* carried -- two meshes, the means of an analytic field on both, and transfers between them through the public interface. Needs
 * a main of rt.h. Everything is collective on the communicator of carried_open. */
#ifndef CARRIED_H
#define CARRIED_H

#include "averages.h"
#include "rt.h"

/* One context over this rank's parts of two meshes. */
typedef struct carried {
  remap_context *ctx;
  tm_mesh       *mine[2];
  int64_t        cells[2];
  double        *volume[2], *mean[2], *got[2];
} carried;

/* Two meshes, freed here, dealt to the ranks of comm; with a seed other than 0, at random and renumbered. False if that
 * failed. */
static inline bool carried_open(carried *w, MPI_Comm comm, int max_order, tm_mesh *source, tm_mesh *target, uint64_t seed)
{
  tm_mesh      *whole[2] = {source, target};
  remap_options options;
  int           rank, size;

  MPI_Comm_rank(comm, &rank);
  MPI_Comm_size(comm, &size);
  memset(w, 0, sizeof *w);
  remap_options_default(&options);
  options.max_order = max_order;
  if (!rt_all(RT_EQ(remap_create(comm, &options, &w->ctx), REMAP_OK))) return false;
  for (int side = 0; side < 2; side++) {
    int *deal = tm_deal(whole[side], size, seed ? TM_RANDOM : TM_SLABS, seed);

    w->mine[side]   = tm_part(whole[side], deal, rank, seed);
    w->cells[side]  = w->mine[side]->view.num_cells;
    w->volume[side] = tm_alloc_(w->cells[side], sizeof(double));
    w->mean[side]   = tm_alloc_(w->cells[side], sizeof(double));
    w->got[side]    = tm_alloc_(w->cells[side], sizeof(double));
    RT_EQ(remap_set_mesh(w->ctx, (remap_side)side, &w->mine[side]->view), REMAP_OK);
    free(deal);
    tm_free(whole[side]);
  }
  return rt_all(RT_EQ(remap_build(w->ctx), REMAP_OK));
}

static inline void carried_close(carried *w)
{
  remap_destroy(&w->ctx);
  for (int side = 0; side < 2; side++) {
    tm_free(w->mine[side]);
    free(w->volume[side]), free(w->mean[side]), free(w->got[side]);
  }
}

/* Means of a field on both sides. */
static inline void carried_evaluate(carried *w, av_field *field)
{
  for (int side = 0; side < 2; side++) av_means(w->mine[side], REMAP_FACES_CENTRE, 1, &field, w->volume[side], &w->mean[side]);
}

/* One field from in to out. report may be NULL, on all ranks. */
static inline bool carried_move(carried *w, remap_direction direction, int order, remap_limiter limiter, const double *in,
                                double *out, remap_field_report *report)
{
  const remap_field_desc desc = {.name = "u", .nature = REMAP_CONSERVED, .in = in, .out = out};
  remap_transfer         how;

  remap_transfer_default(&how);
  how.order                 = order;
  how.limiter               = limiter;
  const remap_status status = remap_field(w->ctx, direction, &how, 1, &desc, report);
  if (status != REMAP_OK) printf("# %s\n", remap_message(w->ctx));
  return rt_all(RT_EQ(status, REMAP_OK));
}
#endif
