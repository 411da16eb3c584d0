/* bench_balance -- how evenly the overlay is shared out, and what each rank holds: a line of JSON per case, of the meshes in
 * tests/support/balance.h. Ratios are of the largest rank to the mean, of what is counted and of user CPU; bytes are of the
 * largest rank, of the cells that came there and of what the overlay makes of them.
 *
 *   mpirun -n P bench_balance N diagonal|centre [CASE ...] */
#include "balance.h"

static void run(const char *name, int n, const char *faces)
{
  balance b;
  double  sum[6], most[2];

  balance_open_on(&b, MPI_COMM_WORLD, name, n, strcmp(faces, "centre") ? REMAP_FACES_DIAGONAL : REMAP_FACES_CENTRE);
  const balance_work *w        = &b.here;
  const double        cpu      = w->seconds[1] + w->seconds[2];
  const double ratio[4] = {balance_ratio(&b, balance_cost(w)), balance_ratio(&b, w->triangles), balance_ratio(&b, w->crossings),
                           balance_ratio(&b, cpu)};

  memcpy(sum, (double[6]){w->cells, w->triangles, w->crossings, w->pairs, w->seconds[0], cpu}, sizeof sum);
  memcpy(most, (double[2]){b.piece_bytes, b.overlay_bytes}, sizeof most);
  MPI_Allreduce(MPI_IN_PLACE, sum, 6, MPI_DOUBLE, MPI_SUM, MPI_COMM_WORLD);
  MPI_Allreduce(MPI_IN_PLACE, most, 2, MPI_DOUBLE, MPI_MAX, MPI_COMM_WORLD);
  if (b.comm.rank == 0 && b.status == REMAP_OK)
    printf("{\"bench\":\"balance\",\"ranks\":%d,\"case\":\"%s\",\"n\":%d,\"faces\":\"%s\",\"work\":%.3f,\"triangles\":%.3f,"
           "\"crossings\":%.3f,\"cpu\":%.3f,\"all_cells\":%.0f,\"all_triangles\":%.0f,\"all_crossings\":%.0f,"
           "\"all_pairs\":%.0f,\"cpu_partition\":%.3f,\"cpu_overlay\":%.3f,\"piece_bytes\":%.0f,\"overlay_bytes\":%.0f}\n",
           b.comm.size, name, n, faces, ratio[0], ratio[1], ratio[2], ratio[3], sum[0], sum[1], sum[2], sum[3], sum[4], sum[5],
           most[0], most[1]);
  if (b.comm.rank == 0 && b.status != REMAP_OK)
    fprintf(stderr, "%s: %s: %s\n", name, remap_status_text(b.status), b.reason.text);
  balance_close(&b);
}

int main(int argc, char **argv)
{
  static const char *const all[] = {"even",   "graded", "stretched", "facing", "corner",
                                    "layers", "target", "source",    "hull",   "shell"};

  MPI_Init(&argc, &argv);
  if (argc < 3) return fprintf(stderr, "usage: bench_balance N diagonal|centre [CASE ...]\n"), MPI_Finalize(), 2;
  for (int k = 3; k < argc; k++) run(argv[k], atoi(argv[1]), argv[2]);
  for (int k = 0; argc == 3 && k < (int)(sizeof all / sizeof *all); k++) run(all[k], atoi(argv[1]), argv[2]);
  MPI_Finalize();
  return 0;
}
