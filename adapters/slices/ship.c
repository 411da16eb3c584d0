/* ship -- rows to the ranks that write them: two exchanges, one of numbers and lengths, one of words. Linear. */
#include "slices.h"

#include "base.h"

#include <stdlib.h>
#include <string.h>

const char *rslice_status_text(rslice_status status)
{
  switch (status) {
#define X(name, number, text) \
  case RSLICE_##name: return text;
    RSLICE_STATUS_LIST(X)
#undef X
  }
  return "unknown status";
}

/* What goes out, sorted by rank: {number, length} of each row, and the words. */
typedef struct parcels {
  int64_t *head, *word;           /* [rows][2], [words] */
  int64_t *num_heads, *num_words; /* [ranks], in words */
  int64_t *next_head, *next_word; /* [ranks] where the next row goes */
} parcels;

static void parcels_drop(parcels *p)
{
  free(p->head);
  free(p->word);
  free(p->num_heads);
}

static rslice_status pack(int size, int64_t total, int64_t num, const int64_t *global, const int64_t *offset,
                          const int64_t *word, parcels *p)
{
  const int64_t base = num ? offset[0] : 0;

  p->head      = ra_zeros(2 * num, sizeof *p->head);
  p->word      = ra_zeros(num ? offset[num] - base : 0, sizeof *p->word);
  p->num_heads = ra_zeros(4 * (int64_t)size, sizeof *p->num_heads);
  if (!p->head || !p->word || !p->num_heads) return RSLICE_MEMORY;
  p->num_words = p->num_heads + size;
  p->next_head = p->num_heads + 2 * size;
  p->next_word = p->num_heads + 3 * size;
  for (int64_t i = 0; i < num; i++) {
    const int r = ra_owner(total, global[i], size);

    p->num_heads[r] += 2;
    p->num_words[r] += offset[i + 1] - offset[i];
  }
  for (int r = 1; r < size; r++) {
    p->next_head[r] = p->next_head[r - 1] + p->num_heads[r - 1];
    p->next_word[r] = p->next_word[r - 1] + p->num_words[r - 1];
  }
  for (int64_t i = 0; i < num; i++) {
    const int     r = ra_owner(total, global[i], size);
    const int64_t n = offset[i + 1] - offset[i];

    p->head[p->next_head[r]++] = global[i];
    p->head[p->next_head[r]++] = n;
    if (n) memcpy(p->word + p->next_word[r], word + offset[i], (size_t)n * sizeof *word);
    p->next_word[r] += n;
  }
  return RSLICE_OK;
}

/* What came, in the order of the rows. */
static rslice_status unpack(const int64_t *head, int64_t num, const int64_t *word, rslice_rows *out)
{
  int64_t *from = ra_zeros(out->num, sizeof *from), at = 0;

  out->offset = ra_zeros(out->num + 1, sizeof *out->offset);
  if (!from || !out->offset) {
    free(from);
    return RSLICE_MEMORY;
  }
  for (int64_t i = 0; i < out->num; i++) from[i] = -1;
  for (int64_t i = 0; i < num; i++) {
    const int64_t row = head[2 * i] - out->first;

    from[row]            = at;
    out->offset[row + 1] = head[2 * i + 1];
    at += head[2 * i + 1];
  }
  for (int64_t i = 0; i < out->num; i++) {
    out->offset[i + 1] += out->offset[i];
    if (from[i] >= 0) continue;
    free(from);
    return RSLICE_INTERNAL;
  }
  out->word = ra_zeros(out->offset[out->num], sizeof *out->word);
  for (int64_t i = 0; out->word && i < out->num; i++)
    memcpy(out->word + out->offset[i], word + from[i], (size_t)(out->offset[i + 1] - out->offset[i]) * sizeof *word);
  free(from);
  return out->word ? RSLICE_OK : RSLICE_MEMORY;
}

rslice_status rslice_ship_chunked(MPI_Comm comm, rslice_status mine, int64_t chunk, int64_t total, int64_t num,
                                  const int64_t *global, const int64_t *offset, const int64_t *word, rslice_rows *out)
{
  parcels       p     = {.head = NULL};
  rslice_status status = mine;
  int           rank, size;
  int64_t      *recv_count = NULL, num_in = 0;
  void         *heads = NULL, *words = NULL;

  MPI_Comm_rank(comm, &rank);
  MPI_Comm_size(comm, &size);
  *out     = (rslice_rows){.first = ra_share(total, rank, size)};
  out->num = ra_share(total, rank + 1, size) - out->first;
  if (status == RSLICE_OK) status = pack(size, total, num, global, offset, word, &p);
  if (status == RSLICE_OK && !(recv_count = ra_zeros(size, sizeof *recv_count))) status = RSLICE_MEMORY;
  status = rslice_exchange(comm, status, chunk, sizeof *p.head, p.num_heads, p.head, recv_count, &heads);
  for (int r = 0; r < size && status == RSLICE_OK; r++) num_in += recv_count[r] / 2;
  status = rslice_exchange(comm, status, chunk, sizeof *p.word, p.num_words, p.word, recv_count, &words);
  if (status == RSLICE_OK) status = unpack(heads, num_in, words, out);
  status = rslice_agree(comm, status);
  parcels_drop(&p);
  free(recv_count);
  free(heads);
  free(words);
  if (status != RSLICE_OK) rslice_drop(out);
  return status;
}

rslice_status rslice_ship(MPI_Comm comm, rslice_status mine, int64_t total, int64_t num, const int64_t *global,
                          const int64_t *offset, const int64_t *word, rslice_rows *out)
{
  return rslice_ship_chunked(comm, mine, RSLICE_CHUNK, total, num, global, offset, word, out);
}

void rslice_drop(rslice_rows *rows)
{
  free(rows->offset);
  free(rows->word);
  *rows = (rslice_rows){.num = 0};
}
