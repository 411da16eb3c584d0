/* base.h -- what the adapters share: memory, growing arrays, maps of keys, messages of one line, shares of ranks. Nothing here
 * knows of meshes or files. Not collective unless it is said. */
#ifndef REMAP_ADAPTERS_BASE_H
#define REMAP_ADAPTERS_BASE_H

#include <mpi.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* ---- messages ----------------------------------------------------------------------------------------------------- */

/* Format text of at most size characters. Names in files may hold anything: a control character becomes '?', so that one line
 * stays one line. */
void ra_line(char *text, size_t size, const char *format, va_list args);

/* The greatest of the ranks' statuses, and in text, of the same size everywhere, that of the lowest rank that has it. Where
 * all are 0, success, text stays as it is. Collective. */
int ra_agree(MPI_Comm comm, int mine, char *text, size_t size);

/* ---- memory ------------------------------------------------------------------------------------------------------- */

/* malloc for count items, never NULL for 0 of them; NULL: no memory, or a count below 0 or beyond what can be. */
void *ra_alloc(int64_t count, size_t size);
/* The same with all bytes 0, and one item more than asked for. */
void *ra_zeros(int64_t count, size_t size);

/* An array that grows: items of one size, owned. All zero is an empty array. */
typedef struct ra_array {
  void   *item;
  int64_t count, capacity;
} ra_array;

/* Room for `more` further items of `size` bytes. false: no memory, nothing changed. */
bool ra_reserve(ra_array *array, int64_t more, size_t size);
/* Append an item of `size` bytes. false: no memory. */
bool ra_push(ra_array *array, const void *item, size_t size);
/* Append one int64_t. */
bool ra_push_int(ra_array *array, int64_t value);
/* Give an array back; it is empty then. */
void ra_drop(ra_array *array);

/* A map from keys of `width` int64_t to 0, 1, 2 ... in the order they come. All zero, but for width, is an empty map. */
typedef struct ra_map {
  int      width; /* int64_t per key */
  ra_array key;   /* [count][width] */
  int64_t *slot;  /* [num_slots] index of a key, -1: free */
  int64_t  num_slots;
} ra_map;

/* Index of the key, which is added if new; -1: no memory. */
int64_t ra_map_add(ra_map *map, const int64_t *key);
/* Index of the key, -1: it is not there. */
int64_t ra_map_find(const ra_map *map, const int64_t *key);
/* Give a map back; it is empty then, of the same width. */
void ra_map_drop(ra_map *map);

/* ---- shares ------------------------------------------------------------------------------------------------------- */

/* First of n items that a rank has; rank == size gives n. Shares differ by one at most. */
int64_t ra_share(int64_t n, int rank, int size);
/* The rank that has item i. */
int ra_owner(int64_t n, int64_t i, int size);

#endif
