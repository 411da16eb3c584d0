/* fuzz -- what the fuzz targets share. A target is one function that takes any bytes and must return:
 *
 *   void fuzz_one(const uint8_t *data, size_t size) { ... }
 *   FUZZ_MAIN
 *
 * Under libFuzzer (cmake -DCMAKE_C_COMPILER=clang -DREMAP_SANITIZE=ON -DREMAP_FUZZERS=ON) it is searched for failures:
 *
 *   fuzz_mesh FOLDER FOLDER_TO_READ ...     inputs that reach new code are kept in the first folder
 *
 * Everywhere else the same file is a program of its own, which CTest runs on one or more ranks:
 *
 *   fuzz_mesh FOLDER [COUNT [FIRST]]   every file of the folder, then COUNT inputs drawn by lot, numbered from FIRST: random
 *                                      bytes, and files of the folder with some bytes changed
 *   fuzz_mesh -w FILE NUMBER FOLDER    write the input of that number to a file, for the corpus
 *
 * With the environment variable REMAP_LONG_TESTS, COUNT is taken 1000 times. What fails, crashes or takes more than a minute
 * names its input on stderr. */
#ifndef FUZZ_H
#define FUZZ_H

#include <dirent.h>
#include <mpi.h>
#include <signal.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#if defined(__SANITIZE_ADDRESS__)
#define FUZZ_ASAN
#elif defined(__has_feature)
#if __has_feature(address_sanitizer)
#define FUZZ_ASAN
#endif
#endif
#if defined(FUZZ_ASAN)
#include <sanitizer/common_interface_defs.h>
#include <sanitizer/lsan_interface.h>
#endif

/* What a fuzz program tries: one input. It ends the program, by FUZZ_CHECK, if a property fails. */
void fuzz_one(const uint8_t *data, size_t size);

/* Inputs that got past the checks of what they are given to, for the last line. */
static int64_t fuzz_accepted;

/* The property that every input must have. */
#define FUZZ_CHECK(cond)                                                     \
  do {                                                                       \
    if (!(cond)) {                                                           \
      fprintf(stderr, "%s:%d: %s is false\n", __FILE__, __LINE__, #cond);    \
      abort();                                                               \
    }                                                                        \
  } while (0)

/* ---- reading ----------------------------------------------------------------------------------------------------- */

/* Bytes that are still to be read; zeros follow the last one. */
typedef struct fuzz_bytes {
  const uint8_t *at;
  size_t         left;
} fuzz_bytes;

static inline uint8_t fuzz_byte(fuzz_bytes *b)
{
  if (!b->left) return 0;
  b->left--;
  return *b->at++;
}

/* Below end, from one byte, or two where end does not fit into one; 0 if end < 1. */
static inline int64_t fuzz_below(fuzz_bytes *b, int64_t end)
{
  const int64_t low = fuzz_byte(b);

  if (end < 1) return 0;
  return (end > 256 ? low << 8 | fuzz_byte(b) : low) % end;
}

static inline int64_t fuzz_int64(fuzz_bytes *b)
{
  uint64_t bits = 0;

  for (int i = 0; i < 8; i++) bits = bits << 8 | fuzz_byte(b);
  return (int64_t)bits;
}

/* Any double: not a number and infinities included. */
static inline double fuzz_double(fuzz_bytes *b)
{
  const int64_t bits = fuzz_int64(b);
  double        x;

  memcpy(&x, &bits, sizeof x);
  return x;
}

/* ---- running ----------------------------------------------------------------------------------------------------- */

/* MPI_Init keeps memory of its own, which is not counted as lost. */
static inline void fuzz_start_(int *argc, char ***argv)
{
#if defined(FUZZ_ASAN)
  __lsan_disable();
#endif
  MPI_Init(argc, argv);
#if defined(FUZZ_ASAN)
  __lsan_enable();
#endif
}

#if defined(REMAP_LIBFUZZER)

int LLVMFuzzerInitialize(int *argc, char ***argv);
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerInitialize(int *argc, char ***argv)
{
  fuzz_start_(argc, argv);
  return 0;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
  fuzz_one(data, size);
  return 0;
}
#define FUZZ_MAIN

#else

enum { FUZZ_MOST_FILES = 1000, FUZZ_MOST_BYTES = 4096, FUZZ_SECONDS = 60 };

typedef struct fuzz_input {
  char     name[300];
  uint8_t *data; /* malloc'ed to size exactly, so that reading past it is seen */
  size_t   size;
} fuzz_input;

typedef struct fuzz_corpus {
  fuzz_input file[FUZZ_MOST_FILES]; /* by name */
  int        num_files;
} fuzz_corpus;

static char fuzz_now_[400]; /* the input that runs, for whoever reports a crash */

static inline void fuzz_tell_(void)
{
  if (write(STDERR_FILENO, fuzz_now_, strlen(fuzz_now_)) < 0) return; /* nowhere to tell */
}
static inline void fuzz_signal_(int number)
{
  fuzz_tell_();
  signal(number, SIG_DFL);
  raise(number);
}

static inline uint64_t fuzz_mix_(uint64_t *state)
{
  uint64_t x = *state += UINT64_C(0x9e3779b97f4a7c15);

  x = (x ^ x >> 30) * UINT64_C(0xbf58476d1ce4e5b9);
  x = (x ^ x >> 27) * UINT64_C(0x94d049bb133111eb);
  return x ^ x >> 31;
}

static inline void *fuzz_alloc_(size_t size)
{
  void *memory = malloc(size);

  if (!memory && size) abort();
  return memory;
}

static inline int fuzz_by_name_(const void *a, const void *b)
{
  return strcmp(((const fuzz_input *)a)->name, ((const fuzz_input *)b)->name);
}

static inline fuzz_corpus *fuzz_read_(const char *folder)
{
  fuzz_corpus   *corpus = calloc(1, sizeof *corpus);
  DIR           *dir    = opendir(folder);
  struct dirent *entry;

  if (!corpus || !dir) {
    fprintf(stderr, "%s: no such folder\n", folder);
    exit(2);
  }
  while ((entry = readdir(dir)) && corpus->num_files < FUZZ_MOST_FILES) {
    fuzz_input *in = &corpus->file[corpus->num_files];
    FILE       *file;
    uint8_t     bytes[FUZZ_MOST_BYTES];

    if (entry->d_name[0] == '.') continue;
    snprintf(in->name, sizeof in->name, "%s/%.200s", folder, entry->d_name);
    if (!(file = fopen(in->name, "rb"))) continue;
    in->size = fread(bytes, 1, sizeof bytes, file);
    fclose(file);
    in->data = fuzz_alloc_(in->size);
    memcpy(in->data, bytes, in->size);
    corpus->num_files++;
  }
  closedir(dir);
  qsort(corpus->file, (size_t)corpus->num_files, sizeof *corpus->file, fuzz_by_name_);
  return corpus;
}

/* Random bytes, or a file with some bytes changed, put in, taken out, or taken from elsewhere in it. */
static inline fuzz_input fuzz_draw_(const fuzz_corpus *corpus, uint64_t number)
{
  uint64_t   state = number * UINT64_C(0xd6e8feb86659fd93) + 1;
  fuzz_input in    = {.size = 1 + fuzz_mix_(&state) % (8u << fuzz_mix_(&state) % 6)};
  uint8_t    bytes[FUZZ_MOST_BYTES];

  snprintf(in.name, sizeof in.name, "input %llu", (unsigned long long)number);
  for (size_t i = 0; i < in.size; i++) bytes[i] = (uint8_t)fuzz_mix_(&state);
  if (corpus->num_files && number % 2) {
    const fuzz_input *from = &corpus->file[fuzz_mix_(&state) % (uint64_t)corpus->num_files];

    in.size = from->size;
    memcpy(bytes, from->data, from->size);
    for (uint64_t n = 1 + fuzz_mix_(&state) % 8; n; n--) {
      const size_t at = in.size ? fuzz_mix_(&state) % in.size : 0;

      switch (fuzz_mix_(&state) % 4) {
        case 0:
          if (in.size == sizeof bytes) break;
          memmove(bytes + at + 1, bytes + at, in.size++ - at);
          bytes[at] = (uint8_t)fuzz_mix_(&state);
          break;
        case 1:
          if (in.size) memmove(bytes + at, bytes + at + 1, --in.size - at);
          break;
        case 2:
          if (in.size) bytes[at] = bytes[fuzz_mix_(&state) % in.size];
          break;
        default: bytes[at] = (uint8_t)fuzz_mix_(&state); break;
      }
    }
  }
  in.data = fuzz_alloc_(in.size);
  memcpy(in.data, bytes, in.size);
  return in;
}

static inline void fuzz_run_(const fuzz_input *in)
{
  snprintf(fuzz_now_, sizeof fuzz_now_, "fuzz: this was %s, %zu bytes\n", in->name, in->size);
  alarm(FUZZ_SECONDS);
  fuzz_one(in->data, in->size);
  alarm(0);
}

static inline int fuzz_write_(const char *path, const char *number, const char *folder)
{
  fuzz_corpus *corpus = fuzz_read_(folder);
  fuzz_input   in     = fuzz_draw_(corpus, strtoull(number, NULL, 10));
  FILE        *file   = fopen(path, "wb");
  const int    ok     = file && fwrite(in.data, 1, in.size, file) == in.size;

  if (file) fclose(file);
  free(in.data);
  for (int i = 0; i < corpus->num_files; i++) free(corpus->file[i].data);
  free(corpus);
  return !ok;
}

static inline int fuzz_main_(int argc, char **argv)
{
  static const int deadly[] = {SIGABRT, SIGALRM, SIGSEGV, SIGBUS, SIGFPE, SIGILL};
  int              num_deadly = (int)(sizeof deadly / sizeof *deadly), rank, leaks = 0;
  fuzz_corpus     *corpus;
  uint64_t         count, first;

  if (argc == 5 && !strcmp(argv[1], "-w")) return fuzz_write_(argv[2], argv[3], argv[4]);
  if (argc < 2) {
    fprintf(stderr, "usage: %s FOLDER [COUNT [FIRST]]\n", argv[0]);
    return 2;
  }
  fuzz_start_(&argc, &argv);
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
#if defined(FUZZ_ASAN)
  __sanitizer_set_death_callback(fuzz_tell_);
  num_deadly = 2; /* the sanitizer reports the others */
#endif
  for (int i = 0; i < num_deadly; i++) signal(deadly[i], fuzz_signal_);
  corpus = fuzz_read_(argv[1]);
  count  = argc > 2 ? strtoull(argv[2], NULL, 10) : 0;
  first  = argc > 3 ? strtoull(argv[3], NULL, 10) : 0;
  if (getenv("REMAP_LONG_TESTS")) count *= 1000;
  for (int i = 0; i < corpus->num_files; i++) fuzz_run_(&corpus->file[i]);
  for (uint64_t i = first; i < first + count; i++) {
    fuzz_input in = fuzz_draw_(corpus, i);

    fuzz_run_(&in);
    free(in.data);
  }
  if (rank == 0)
    printf("%d files and %llu drawn inputs hold, %lld accepted\n", corpus->num_files, (unsigned long long)count,
           (long long)fuzz_accepted);
  for (int i = 0; i < corpus->num_files; i++) free(corpus->file[i].data);
  free(corpus);
#if defined(FUZZ_ASAN)
  fuzz_now_[0] = 0;
  leaks        = __lsan_do_recoverable_leak_check(); /* before MPI_Finalize unloads what the known leaks are named by */
#endif
  MPI_Finalize();
  return leaks != 0;
}
#define FUZZ_MAIN \
  int main(int argc, char **argv) { return fuzz_main_(argc, argv); }

#endif
#endif
