/* widen -- a stencil for order 3: quadratic least squares over vertex neighbours, and over their neighbours too where the
 * former do not determine a quadratic polynomial (at walls, mostly).
 *
 * Neighbours of a halo cell are known on its own rank; where they are wanted, they are asked for in two exchanges. Then the
 * halo is listed anew, with a plan of its own. What a cell gets depends on coordinates alone. O(n) time; for hexahedra about 2
 * kB per cell. */
#include "field_private.h"

/* A cell as its neighbours see it. */
typedef struct known {
  double  centroid[3], volume, spread[6];
  rm_gid  global;
  int32_t rank;
  rm_lid  cell;
} known;

/* "Who are the neighbours of your cell? I know it as this one of my halo." */
typedef struct question {
  rm_lid cell, halo;
} question;

/* One of them. */
typedef struct answer {
  known  neighbour;
  rm_lid halo;
} answer;

typedef struct draft {
  rm_arena         *arena, *scratch;
  const rm_comm    *comm;
  const rm_frame   *frame;
  const rm_mesh    *mesh;
  const rm_stencil *near;
  rm_stencil       *wide;
  known            *all; /* [num_all] own cells, near halo; later own cells, new halo                      */
  rm_lid            num_all;
  uint8_t          *is_flat;       /* [own cells] second moments that no body of its extent has: no curvature there  */
  uint8_t          *grows;         /* [own cells] 1: needs the neighbours' neighbours                                */
  double (*weight)[9];             /* [near->offset[num_cells]] over vertex neighbours                            */
  rm_lid           *new_of_halo;   /* [near->num_halo] number in the new list of all                             */
  int64_t          *answer_offset; /* [near->num_halo + 1] */
  rm_lid           *answer;        /* numbers in the new list of all */
  rm_quadratic_room room;
  double (*distance)[3], (*spread)[6]; /* [room] */
} draft;

/* ---- weights of one cell ------------------------------------------------------------------------------------------ */

static remap_status make_quadratic_room(draft *d, int64_t most)
{
  RM_NEW(d->room.distance, d->scratch, most);
  RM_NEW(d->room.row, d->scratch, most);
  RM_NEW(d->room.row_weight, d->scratch, most);
  RM_NEW(d->distance, d->scratch, most);
  RM_NEW(d->spread, d->scratch, most);
  return REMAP_OK;
}

/* Weights over n neighbours; false if they do not determine the polynomial. */
static bool weigh(draft *d, rm_lid cell, int64_t n, const rm_lid *neighbour, double (*weight)[9])
{
  const double     *box = d->mesh->cell_box[cell];
  const known      *own = &d->all[cell];
  rm_distance_noise noise;
  double            largest[3];

  for (int i = 0; i < 3; i++) largest[i] = fabs(own->centroid[i]);
  for (int64_t k = 0; k < n; k++) {
    const known *other = &d->all[neighbour[k]];

    for (int i = 0; i < 3; i++) {
      d->distance[k][i] = other->centroid[i] - own->centroid[i];
      largest[i]        = fmax(largest[i], fabs(other->centroid[i]));
    }
    for (int i = 0; i < 6; i++) d->spread[k][i] = other->spread[i] - own->spread[i];
  }
  for (int i = 0; i < 3; i++) {
    noise.coordinate[i] = 0x1p-48 * largest[i];
    noise.extent[i]     = box[i + 3] - box[i];
  }
  return rm_quadratic_weights(n, (const double(*)[3])d->distance, (const double(*)[6])d->spread, &noise, &d->room, weight);
}

/* ---- what is known ------------------------------------------------------------------------------------------------ */

/* Mean of (x - c)(x - c)^T; 0 and false where it is not that of a body within the cell's box (no volume, inverted in part). */
static bool spread_of(const double box[6], double volume, const double second[6], double spread[6])
{
  bool is_good = fabs(volume) > 0.0;

  for (int k = 0; k < 6; k++) {
    const double x = box[3 + rm_row_of[k]] - box[rm_row_of[k]], y = box[3 + rm_column_of[k]] - box[rm_column_of[k]];

    spread[k] = is_good ? second[k] / volume : 0.0;
    is_good   = is_good && fabs(spread[k]) <= x * y && (k >= 3 || spread[k] >= 0.0);
  }
  for (int k = 0; k < 6 && !is_good; k++) spread[k] = 0.0;
  return is_good;
}

static remap_status list_own(draft *d, const double (*second)[6])
{
  const rm_mesh *mesh = d->mesh;
  double(*spread)[6];

  d->num_all = mesh->num_cells + d->near->num_halo;
  RM_NEW(d->all, d->scratch, d->num_all);
  RM_NEW(spread, d->arena, mesh->num_cells);
  RM_NEW(d->is_flat, d->scratch, mesh->num_cells);
  for (rm_lid c = 0; c < mesh->num_cells; c++) {
    const double *x = mesh->cell_centroid[c];

    d->is_flat[c] = !spread_of(mesh->cell_box[c], mesh->cell_volume[c], second[c], spread[c]);
    d->all[c]     = (known){.centroid = {x[0], x[1], x[2]},
                            .volume   = mesh->cell_volume[c],
                            .global   = mesh->cell_global[c],
                            .rank     = d->comm->rank,
                            .cell     = c};
    for (int k = 0; k < 6; k++) d->all[c].spread[k] = spread[c][k];
  }
  d->wide->spread = (const double(*)[6])spread;
  return REMAP_OK;
}

/* The halo as its owners know it. Collective. */
static remap_status fetch_near(draft *d)
{
  const rm_plan *plan   = d->near->plan;
  known         *buffer = rm_arena_alloc(d->scratch, plan->send_offset[plan->num_send], sizeof *buffer);

  RM_TRY(rm_comm_agree(d->comm, buffer ? REMAP_OK : REMAP_NO_MEMORY, NULL));
  return rm_comm_agree(d->comm, rm_plan_run(d->comm, plan, sizeof *buffer, d->all, d->all + d->mesh->num_cells, buffer), NULL);
}

/* Weights over vertex neighbours, where those suffice. */
static remap_status weigh_near(draft *d, int64_t *num_growing)
{
  const rm_stencil *near = d->near;
  int64_t           most = 0;

  for (rm_lid c = 0; c < near->num_cells; c++)
    if (near->offset[c + 1] - near->offset[c] > most) most = near->offset[c + 1] - near->offset[c];
  RM_TRY(make_quadratic_room(d, most));
  RM_NEW(d->weight, d->scratch, near->offset[near->num_cells]);
  RM_NEW0(d->grows, d->scratch, near->num_cells);
  *num_growing = 0;
  for (rm_lid c = 0; c < near->num_cells; c++) {
    const int64_t first = near->offset[c];

    d->grows[c] = !weigh(d, c, near->offset[c + 1] - first, near->neighbour + first, d->weight + first);
    *num_growing += d->grows[c];
  }
  return REMAP_OK;
}

/* ---- the neighbours' neighbours on other ranks --------------------------------------------------------------------- */

/* Questions about the halo cells beside growing cells, grouped by their ranks, by which the halo is sorted. */
static remap_status pack_questions(draft *d, int64_t *offset, question **out)
{
  const rm_stencil *near = d->near;
  uint8_t          *is_asked;
  int64_t           num = 0;

  RM_NEW0(is_asked, d->scratch, near->num_halo);
  RM_NEW(*out, d->scratch, near->num_halo);
  for (rm_lid c = 0; c < near->num_cells; c++)
    for (int64_t k = near->offset[c]; k < near->offset[c + 1] && d->grows[c]; k++)
      if (near->neighbour[k] >= near->num_cells) is_asked[near->neighbour[k] - near->num_cells] = 1;
  for (int r = 0; r <= d->comm->size; r++) offset[r] = 0;
  for (rm_lid h = 0; h < near->num_halo; h++) {
    if (!is_asked[h]) continue;
    offset[d->all[near->num_cells + h].rank]++;
    (*out)[num++] = (question){d->all[near->num_cells + h].cell, h};
  }
  rm_offsets(offset, d->comm->size);
  return REMAP_OK;
}

static remap_status pack_answers(draft *d, const int64_t *asked_offset, const question *asked, int64_t *offset, answer **out)
{
  const rm_stencil *near = d->near;
  int64_t           num  = 0;

  for (int r = 0; r <= d->comm->size; r++) offset[r] = 0;
  for (int r = 0; r < d->comm->size; r++)
    for (int64_t k = asked_offset[r]; k < asked_offset[r + 1]; k++)
      offset[r] += near->offset[asked[k].cell + 1] - near->offset[asked[k].cell];
  rm_offsets(offset, d->comm->size);
  RM_NEW(*out, d->scratch, offset[d->comm->size]);
  for (int64_t k = 0; k < asked_offset[d->comm->size]; k++)
    for (int64_t i = near->offset[asked[k].cell]; i < near->offset[asked[k].cell + 1]; i++)
      (*out)[num++] = (answer){d->all[near->neighbour[i]], asked[k].halo};
  return REMAP_OK;
}

/* List own cells and every foreign one once, by rank and number there; near halo and answers point into it. */
static remap_status list_all(draft *d, int64_t num_answers, const answer *came, int **halo_rank, rm_lid **halo_cell)
{
  const rm_stencil *near = d->near;
  const rm_lid      own  = near->num_cells;
  const int64_t     n    = near->num_halo + num_answers;
  rm_keyed         *keyed, *spare;
  known            *all;
  rm_lid           *new_of; /* [n] near halo, then answers */
  rm_lid           *about, *order; /* [num_answers] */
  int64_t           num = 0, num_own = 0;

  if (n > INT32_MAX) return REMAP_TOO_LARGE;
  RM_NEW(keyed, d->scratch, n);
  RM_NEW(spare, d->scratch, n);
  RM_NEW(new_of, d->scratch, n);
  for (int64_t k = 0; k < n; k++) {
    const known *c = k < near->num_halo ? &d->all[own + k] : &came[k - near->num_halo].neighbour;

    if (c->rank == d->comm->rank) {
      new_of[k] = c->cell;
      num_own++;
    } else {
      keyed[k - num_own] = (rm_keyed){(uint64_t)c->rank << 32 | (uint64_t)c->cell, k};
    }
  }
  rm_sort_keyed(keyed, spare, n - num_own);
  for (int64_t k = 0; k < n - num_own; k++) num += k == 0 || keyed[k].key != keyed[k - 1].key;
  if (num > INT32_MAX - own) return REMAP_TOO_LARGE;
  RM_NEW(all, d->scratch, own + num);
  RM_NEW(*halo_rank, d->scratch, num);
  RM_NEW(*halo_cell, d->scratch, num);
  for (rm_lid c = 0; c < own; c++) all[c] = d->all[c];
  num = 0;
  for (int64_t k = 0; k < n - num_own; k++) {
    const int64_t item = keyed[k].item;
    const known  *c    = item < near->num_halo ? &d->all[own + item] : &came[item - near->num_halo].neighbour;

    num += k == 0 || keyed[k].key != keyed[k - 1].key;
    new_of[item]          = own + (rm_lid)(num - 1);
    all[new_of[item]]     = *c;
    (*halo_rank)[num - 1] = c->rank;
    (*halo_cell)[num - 1] = c->cell;
  }
  d->all            = all;
  d->num_all        = own + (rm_lid)num;
  d->new_of_halo    = new_of;
  d->wide->num_halo = (rm_lid)num;

  RM_NEW(d->answer_offset, d->scratch, (int64_t)near->num_halo + 1);
  RM_NEW(d->answer, d->scratch, num_answers);
  RM_NEW(about, d->scratch, num_answers);
  RM_NEW(order, d->scratch, num_answers);
  for (int64_t k = 0; k < num_answers; k++) about[k] = came[k].halo;
  rm_group(num_answers, about, near->num_halo, d->answer_offset, order);
  for (int64_t k = 0; k < num_answers; k++) d->answer[k] = new_of[near->num_halo + order[k]];
  return REMAP_OK;
}

/* Ask, answer, and list the halo anew. Collective. */
static remap_status reach_further(draft *d)
{
  const rm_comm *comm        = d->comm;
  int64_t       *send_offset = rm_arena_alloc(d->scratch, (int64_t)comm->size + 1, sizeof *send_offset);
  int64_t       *recv_offset = rm_arena_alloc(d->scratch, (int64_t)comm->size + 1, sizeof *recv_offset);
  question      *questions   = NULL;
  answer        *answers     = NULL;
  int           *halo_rank   = NULL;
  rm_lid        *halo_cell   = NULL;
  void          *recv        = NULL;
  remap_status   status      = send_offset && recv_offset ? REMAP_OK : REMAP_NO_MEMORY;

  if (status == REMAP_OK) status = pack_questions(d, send_offset, &questions);
  RM_TRY(rm_comm_agree(comm, status, NULL));
  RM_TRY(rm_comm_exchange(comm, d->scratch, sizeof *questions, send_offset, questions, recv_offset, &recv));
  RM_TRY(rm_comm_agree(comm, pack_answers(d, recv_offset, recv, send_offset, &answers), NULL));
  RM_TRY(rm_comm_exchange(comm, d->scratch, sizeof *answers, send_offset, answers, recv_offset, &recv));
  RM_TRY(rm_comm_agree(comm, list_all(d, recv_offset[comm->size], recv, &halo_rank, &halo_cell), NULL));
  return rm_plan_build(comm, d->arena, d->wide->num_halo, halo_rank, halo_cell, &d->wide->plan);
}

/* ---- the product --------------------------------------------------------------------------------------------------- */

/* Take a cell into the list of places if it is not there yet; last_cell is [num_all]. */
static void take(rm_lid other, rm_lid cell, const rm_lid *place, rm_lid *last_cell, rm_keyed *list, int64_t *num)
{
  if (last_cell[other] == cell + 1) return;
  last_cell[other] = cell + 1;
  if (list) list[*num] = (rm_keyed){(uint64_t)place[other], other};
  (*num)++;
}

/* Vertex neighbours and their vertex neighbours, each once, as places in the canonical order. NULL list: count only. */
static int64_t two_layers(const draft *d, rm_lid cell, const rm_lid *place, rm_lid *last_cell, rm_keyed *list)
{
  const rm_stencil *near = d->near;
  const rm_lid      own  = near->num_cells;
  int64_t           num  = 0;

  last_cell[cell] = cell + 1;
  for (int64_t k = near->offset[cell]; k < near->offset[cell + 1]; k++) {
    const rm_lid first = near->neighbour[k];

    take(first < own ? first : d->new_of_halo[first - own], cell, place, last_cell, list, &num);
    if (first < own) {
      for (int64_t i = near->offset[first]; i < near->offset[first + 1]; i++) {
        const rm_lid second = near->neighbour[i];

        take(second < own ? second : d->new_of_halo[second - own], cell, place, last_cell, list, &num);
      }
    } else {
      for (int64_t i = d->answer_offset[first - own]; i < d->answer_offset[first - own + 1]; i++)
        take(d->answer[i], cell, place, last_cell, list, &num);
    }
  }
  return num;
}

/* Places of all cells in the canonical order. */
static remap_status order_all(const draft *d, rm_lid **out)
{
  rm_lid *order, *place;
  rm_gid *global;
  double(*centroid)[3], *volume;

  RM_NEW(order, d->scratch, d->num_all);
  RM_NEW(place, d->scratch, d->num_all);
  RM_NEW(global, d->scratch, d->num_all);
  RM_NEW(centroid, d->scratch, d->num_all);
  RM_NEW(volume, d->scratch, d->num_all);
  for (rm_lid k = 0; k < d->num_all; k++) {
    for (int i = 0; i < 3; i++) centroid[k][i] = d->all[k].centroid[i];
    volume[k] = d->all[k].volume;
    global[k] = d->all[k].global;
  }
  RM_TRY(rm_canonical_order(d->scratch, d->frame, d->num_all, (const double(*)[3])centroid, volume, global, order));
  for (rm_lid k = 0; k < d->num_all; k++) place[order[k]] = k;
  *out = place;
  return REMAP_OK;
}

/* The lists of vertex neighbours in the new numbers. */
static remap_status renumber_near(draft *d)
{
  const rm_stencil *near = d->near;
  const int64_t     n    = near->offset[near->num_cells];
  rm_lid           *neighbour;
  double(*centroid)[3];

  RM_NEW(neighbour, d->arena, n);
  RM_NEW(centroid, d->arena, d->wide->num_halo);
  for (rm_lid h = 0; h < d->wide->num_halo; h++)
    for (int i = 0; i < 3; i++) centroid[h][i] = d->all[near->num_cells + h].centroid[i];
  for (int64_t k = 0; k < n; k++)
    neighbour[k] =
        near->neighbour[k] < near->num_cells ? near->neighbour[k] : d->new_of_halo[near->neighbour[k] - near->num_cells];
  d->wide->num_cells     = near->num_cells;
  d->wide->offset        = near->offset;
  d->wide->neighbour     = neighbour;
  d->wide->weight        = near->weight;
  d->wide->node_offset   = near->node_offset;
  d->wide->node          = near->node;
  d->wide->halo_centroid = (const double(*)[3])centroid;
  return REMAP_OK;
}

static remap_status list_wide(draft *d)
{
  const rm_stencil *near = d->near;
  const rm_lid      n    = near->num_cells;
  int64_t          *offset, most = 0;
  rm_lid           *neighbour, *place, *last_cell;
  rm_keyed         *list, *spare;
  double(*weight)[9];
  uint8_t *is_reduced;

  RM_TRY(renumber_near(d));
  RM_TRY(order_all(d, &place));
  RM_NEW0(last_cell, d->scratch, d->num_all);
  RM_NEW(offset, d->arena, (int64_t)n + 1);
  for (rm_lid c = 0; c < n; c++) {
    offset[c] = d->grows[c] ? two_layers(d, c, place, last_cell, NULL) : near->offset[c + 1] - near->offset[c];
    if (offset[c] > most) most = offset[c];
  }
  rm_offsets(offset, n);
  RM_TRY(make_quadratic_room(d, most));
  RM_NEW(list, d->scratch, most);
  RM_NEW(spare, d->scratch, most);
  RM_NEW(neighbour, d->arena, offset[n]);
  RM_NEW(weight, d->arena, offset[n]);
  RM_NEW0(is_reduced, d->arena, n);
  for (rm_lid k = 0; k < d->num_all; k++) last_cell[k] = 0;
  for (rm_lid c = 0; c < n; c++) {
    const int64_t first = offset[c], num = offset[c + 1] - first;

    if (d->grows[c]) {
      two_layers(d, c, place, last_cell, list);
      rm_sort_keyed(list, spare, num);
      for (int64_t k = 0; k < num; k++) neighbour[first + k] = (rm_lid)list[k].item;
      is_reduced[c] = !weigh(d, c, num, neighbour + first, weight + first);
    } else {
      for (int64_t k = 0; k < num; k++) {
        neighbour[first + k] = d->wide->neighbour[near->offset[c] + k];
        for (int i = 0; i < 9; i++) weight[first + k][i] = d->weight[near->offset[c] + k][i];
      }
    }
    is_reduced[c] |= d->is_flat[c];
  }
  d->wide->wide_offset    = offset;
  d->wide->wide_neighbour = neighbour;
  d->wide->wide_weight    = (const double(*)[9])weight;
  d->wide->is_reduced     = is_reduced;
  return REMAP_OK;
}

remap_status rm_stencil_widen(rm_arena *arena, const rm_comm *comm, const rm_frame *frame, const rm_mesh *mesh,
                              const double (*second)[6], const rm_stencil *near, const rm_stencil **out)
{
  rm_stencil *wide = rm_arena_zero(arena, 1, sizeof *wide);
  draft d = {.arena = arena, .scratch = rm_arena_new(), .comm = comm, .frame = frame, .mesh = mesh, .near = near, .wide = wide};
  int64_t      num_growing = 0;
  remap_status status      = wide && d.scratch ? REMAP_OK : REMAP_NO_MEMORY;

  if (status == REMAP_OK) status = list_own(&d, second);
  RM_GOTO(done, status = rm_comm_agree(comm, status, NULL));
  RM_GOTO(done, status = fetch_near(&d));
  RM_GOTO(done, status = rm_comm_agree(comm, weigh_near(&d, &num_growing), NULL));
  RM_GOTO(done, status = reach_further(&d));
  RM_GOTO(done, status = rm_comm_agree(comm, list_wide(&d), NULL));
  *out = wide;
done:
  rm_arena_drop(d.scratch);
  return status;
}
