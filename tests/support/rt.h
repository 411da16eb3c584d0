/* rt -- the test harness. Checks record and go on; none of them jumps, so a rank that fails still meets the others in the
 * next collective call. A case is a sentence that is true; it takes nothing, returns nothing and must return.
 *
 *   static void one_and_one_are_two(void) { RT_EQ(1 + 1, 2); }
 *   RT_MAIN(RT_CASE(one_and_one_are_two))
 *
 * RT_ALONE instead of RT_CASE is for what runs on MPI_COMM_SELF: it is skipped on several ranks, which would all do the same.
 * An argument picks the cases whose name contains it. The exit status is 0 if at least one case ran and all that ran hold,
 * 77 if every case that ran was skipped, else 1. */
#ifndef RT_H
#define RT_H
#include <math.h>
#include <mpi.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#if defined(__SANITIZE_ADDRESS__)
#include <sanitizer/lsan_interface.h>
#endif

typedef struct rt_case {
  const char *name;
  void (*run)(void);
  int alone; /* not 0: each rank would do the same, so more than one skip it */
} rt_case;

static int rt_failed_, rt_skipped_, rt_rank_, rt_size_;

static inline int rt_rank(void) { return rt_rank_; }
static inline int rt_size(void) { return rt_size_; }

/* True if long cases are wanted (cmake -DREMAP_LONG_TESTS=ON). */
static inline int rt_long(void) { return getenv("REMAP_LONG_TESTS") != NULL; }

/* Path of a file of the folder of shared data, in a buffer of the caller, and whether it can be read. */
static inline int rt_shared_data(char *path, size_t size, const char *name)
{
  const char *folder = getenv("REMAP_SHARED_DATA");
  FILE       *file;

  snprintf(path, size, "%s/%s", folder ? folder : "../shared/data", name);
  file = fopen(path, "rb");
  if (file) fclose(file);
  return file != NULL;
}

/* The case has nothing to run on; say why and return from it, on every rank. */
static inline void rt_skip(const char *why)
{
  if (rt_rank_ == 0) printf("# skipped: %s\n", why);
  rt_skipped_ = 1;
}

/* True if ok holds on every rank. Collective: the way to leave a case early, together. */
static inline int rt_all(int ok)
{
  int all = 0;

  MPI_Allreduce(&ok, &all, 1, MPI_INT, MPI_LAND, MPI_COMM_WORLD);
  return all;
}

/* A line about a failed check; after fifty of them a case only counts. */
static inline void rt_fail_(const char *file, int line, const char *format, ...) __attribute__((format(printf, 3, 4)));
static inline void rt_fail_(const char *file, int line, const char *format, ...)
{
  va_list list;

  if (++rt_failed_ > 50) return;
  printf("# rank %d %s:%d: ", rt_rank_, file, line);
  va_start(list, format);
  vprintf(format, list);
  va_end(list);
  printf("\n");
}
static inline int rt_true_(int ok, const char *what, const char *file, int line)
{
  if (!ok) rt_fail_(file, line, "%s is false", what);
  return ok;
}
static inline int rt_eq_(long long got, long long want, const char *what, const char *file, int line)
{
  if (got != want) rt_fail_(file, line, "%s = %lld, want %lld", what, got, want);
  return got == want;
}
static inline int rt_near_(double got, double want, double by, const char *what, const char *file, int line)
{
  const int ok = got == want || fabs(got - want) <= by; /* false for NaN */

  if (!ok) rt_fail_(file, line, "%s = %.17g, want %.17g within %g", what, got, want, by);
  return ok;
}
static inline int rt_str_(const char *got, const char *want, const char *what, const char *file, int line)
{
  const int ok = got && strcmp(got, want) == 0;

  if (!ok) rt_fail_(file, line, "%s = \"%s\", want \"%s\"", what, got ? got : "(null)", want);
  return ok;
}
#define RT_CHECK(cond) rt_true_((cond) != 0, #cond, __FILE__, __LINE__)
/* Integers and enums only: a double does not compile (~). */
#define RT_EQ(got, want) ((void)sizeof ~(got), rt_eq_((long long)(got), (long long)(want), #got, __FILE__, __LINE__))
/* |got - want| <= by; by 0.0 is exact equality. NaN never passes. */
#define RT_NEAR(got, want, by) rt_near_(got, want, by, #got, __FILE__, __LINE__)
#define RT_STR(got, want)      rt_str_(got, want, #got, __FILE__, __LINE__)

/* What the address sanitizer needs: MPI_Init loses memory of its own, which is not counted, and MPI_Finalize unloads the
 * plugins that the list of known leaks names, so leaks are asked for before it. */
static inline void rt_init_(int *argc, char ***argv)
{
#if defined(__SANITIZE_ADDRESS__)
  __lsan_disable();
#endif
  MPI_Init(argc, argv);
#if defined(__SANITIZE_ADDRESS__)
  __lsan_enable();
#endif
}
static inline int rt_leaks_(void)
{
#if defined(__SANITIZE_ADDRESS__)
  return __lsan_do_recoverable_leak_check();
#else
  return 0;
#endif
}

static inline int rt_main_(int argc, char **argv, const rt_case *cases, int num_cases)
{
  int ran = 0, held = 0, skipped = 0, leaks;

  setvbuf(stdout, NULL, _IOLBF, BUFSIZ); /* a killed test keeps the lines it wrote */
  rt_init_(&argc, &argv);
  MPI_Comm_rank(MPI_COMM_WORLD, &rt_rank_);
  MPI_Comm_size(MPI_COMM_WORLD, &rt_size_);
  for (int i = 0; i < num_cases; i++) {
    int mine[2], all[2] = {0, 0};

    if (argc > 1 && !strstr(cases[i].name, argv[1])) continue;
    rt_failed_ = rt_skipped_ = 0;
    if (cases[i].alone && rt_size_ > 1)
      rt_skip("each rank would do the same");
    else
      cases[i].run();
    mine[0] = rt_failed_;
    mine[1] = rt_skipped_;
    MPI_Allreduce(mine, all, 2, MPI_INT, MPI_SUM, MPI_COMM_WORLD);
    if (rt_rank_ == 0) printf("%-6s %s\n", all[0] ? "FAILS" : all[1] ? "skips" : "holds", cases[i].name);
    ran++;
    held += all[0] == 0;
    skipped += all[0] == 0 && all[1] > 0;
  }
  if (rt_rank_ == 0) printf("%d of %d cases hold on %d ranks\n", held - skipped, ran, rt_size_);
  leaks = rt_leaks_();
  MPI_Finalize();
  if (ran == 0 || held < ran || leaks) return 1;
  return skipped == ran ? 77 : 0;
}
#define RT_CASE(name)  {#name, name, 0}
#define RT_ALONE(name) {#name, name, 1}
#define RT_MAIN(...)                                                         \
  int main(int argc, char **argv)                                            \
  {                                                                          \
    const rt_case cases[] = {__VA_ARGS__};                                   \
    return rt_main_(argc, argv, cases, (int)(sizeof cases / sizeof *cases)); \
  }
#endif
