/* Memory runs out on one rank at its n-th request, while files are read and written: every rank returns the same status, none
 * waits for another for ever, the message says so, and nothing half written is left. What HDF5 requests is not counted. */
#include "files.h"

#include "../slices/blocks.h"
#include "heap.h"

#include <glob.h>

/* ---- files ------------------------------------------------------------------------------------------------------------- */

/* Rows without an index, elements of one type, a block, and a solution. */
static void make_file(const char *path)
{
  const int64_t mixed[16] = {7, 1, 2, 8, 7, 14, 2, 3, 6, 8, 9, 12, 10, 8, 9, 12};
  double        value[6] = {1, 2, 3, 4, 5, 6}, xyz[36];
  int64_t       row[17];
  cf_file      *f    = cf_new(3.1);
  const int64_t base = cf_base(f), zone = cf_zone(f, base, "Zoo", 1, (int64_t[]){CF_ZOO_NODES, 3, 0});
  const int64_t block = cf_zone(f, base, "Block", 3, (int64_t[]){3, 2, 2, 2, 1, 1, 0, 0, 0});

  memcpy(row, mixed, sizeof mixed);
  row[16] = 14; /* the last node of the tetrahedron */
  cf_coordinates(f, zone, CF_ZOO_XYZ, 1, (int64_t[]){CF_ZOO_NODES});
  cf_section(f, zone, "Mixed", 20, 1, 3, 17, row);
  cf_section(f, zone, "Hexa", 17, 4, 4, 8, CF_ZOO_HEXA);
  cf_solution(f, zone, "Sol", "Density", 3, value);
  for (int i = 0; i < 12; i++) xyz[3 * i] = 5 + i % 3, xyz[3 * i + 1] = i / 3 % 2, xyz[3 * i + 2] = i / 6;
  cf_coordinates(f, block, xyz, 3, (int64_t[]){2, 2, 3});
  const int64_t sol = cf_empty(f, block, "Sol", "FlowSolution_t");
  cf_text(f, sol, "GridLocation", "GridLocation_t", "CellCenter");
  cf_put(f, sol, "Density", "DataArray_t", "R8", 3, (int64_t[]){1, 1, 2}, 'R', value);
  const int64_t link = cf_empty(f, base, "Again", "FlowSolution_t");
  rc_entry_at(&f->plan, link)->content   = RC_LINK;
  rc_entry_at(&f->plan, link)->link_file = strdup("");
  rc_entry_at(&f->plan, link)->link_path = strdup("/Base/Zoo/Sol");
  cf_write(f, path);
}

typedef struct world {
  char       in[64], poly[64], out[64];
  bl_blocks *blocks;
  double     value[64];
} world;

static rcgns_message why;

/* Read all there is; write it again if asked. */
static rcgns_status pass(world *w, const char *path, rcgns_location location, bool writes)
{
  rcgns_file            *file = NULL;
  rcgns_options          options;
  rcgns_choice           choice;
  rcgns_solution         solution;
  rcgns_boundaries       boundaries;
  const rcgns_new_field  field = {"Pressure", w->value};
  rcgns_status           status;

  rcgns_options_default(&options);
  rcgns_choice_default(&choice);
  options.location = location;
  choice.optional  = 1;
  status           = rcgns_open(MPI_COMM_WORLD, path, &options, &file, &why);
  if (status != RCGNS_OK) return status;
  if (rcgns_mesh(file)->num_cells > (int64_t)(sizeof w->value / sizeof *w->value)) abort();
  status = rcgns_select_solution(file, &choice, &solution, &why);
  if (status == RCGNS_OK && solution.name) status = rcgns_read_field(file, solution.field[0].name, w->value, &why);
  if (status == RCGNS_OK && !location) status = rcgns_read_boundaries(file, &boundaries, &why);
  if (status == RCGNS_OK && writes) status = rcgns_write(file, w->out, "Sol", 1, &field, &why);
  rcgns_close(&file);
  return status;
}

static rcgns_status read_elements(world *w) { return pass(w, w->in, RCGNS_CELLS, false); }
static rcgns_status read_polyhedra(world *w) { return pass(w, w->poly, RCGNS_CELLS, false); }
static rcgns_status read_vertices(world *w) { return pass(w, w->in, RCGNS_VERTICES, false); }
static rcgns_status write_fields(world *w) { return pass(w, w->in, RCGNS_CELLS, true); }
static rcgns_status write_supermesh(world *w)
{
  return rcgns_write_supermesh(MPI_COMM_WORLD, w->out, 4.2, &w->blocks->content, &why);
}

/* The file, and others whose names begin alike. Rank 0 looks. */
static bool is_nothing_left(const char *path)
{
  char   pattern[80];
  glob_t found;
  int    none = 1;

  MPI_Barrier(MPI_COMM_WORLD);
  if (rt_rank() == 0) {
    snprintf(pattern, sizeof pattern, "%s*", path);
    none = glob(pattern, 0, NULL, &found) == GLOB_NOMATCH;
    if (!none) globfree(&found);
  }
  return rt_all(none);
}

/* Until the n-th request of the last rank does not come any more; on several ranks not each n, since each takes a while. */
static void exhaust(rcgns_status (*work)(world *w))
{
  bool  comes  = true;
  int   failed = 0;
  world w;

  make_file(cf_path(w.in, "short_in"));
  cf_path(w.poly, "short_poly");
  cf_path(w.out, "short_out");
  memset(w.value, 0, sizeof w.value);
  w.blocks = bl_new((int[]){2, 1, 2}, rt_rank(), rt_size());
  RT_EQ(rcgns_write_supermesh(MPI_COMM_WORLD, w.poly, 4.2, &w.blocks->content, &why), RCGNS_OK);
  for (int n = 0; comes && n < 5000; n += rt_size()) {
    why.text[0] = '\0';
    heap.left        = rt_rank() == rt_size() - 1 ? n : -1;
    const rcgns_status status = work(&w);

    comes = !rt_all(rt_rank() < rt_size() - 1 || heap.left >= 0);
    heap.left  = -1;
    RT_CHECK(status == RCGNS_MEMORY || (status == RCGNS_OK && !comes));
    int same[2] = {(int)status, -(int)status};
    MPI_Allreduce(MPI_IN_PLACE, same, 2, MPI_INT, MPI_MAX, MPI_COMM_WORLD);
    if (!rt_all(RT_EQ(same[0], -same[1]))) break;
    if (status == RCGNS_OK) continue;
    RT_CHECK(strstr(why.text, "memory") != NULL && cf_is_agreed(&why));
    RT_CHECK(is_nothing_left(w.out));
    failed++;
  }
  RT_CHECK(!comes && failed > 10);
  bl_free(w.blocks);
  cf_remove(w.in);
  cf_remove(w.poly);
  cf_remove(w.out);
}

static void memory_that_runs_out_in_reading_elements_is_told_to_all(void) { exhaust(read_elements); }
static void memory_that_runs_out_in_reading_polyhedra_is_told_to_all(void) { exhaust(read_polyhedra); }
static void memory_that_runs_out_in_reading_vertices_is_told_to_all(void) { exhaust(read_vertices); }
static void memory_that_runs_out_in_writing_leaves_nothing(void) { exhaust(write_fields); }
static void memory_that_runs_out_in_writing_a_supermesh_leaves_nothing(void) { exhaust(write_supermesh); }

RT_MAIN(RT_CASE(memory_that_runs_out_in_reading_elements_is_told_to_all),
        RT_CASE(memory_that_runs_out_in_reading_polyhedra_is_told_to_all),
        RT_CASE(memory_that_runs_out_in_reading_vertices_is_told_to_all),
        RT_CASE(memory_that_runs_out_in_writing_leaves_nothing),
        RT_CASE(memory_that_runs_out_in_writing_a_supermesh_leaves_nothing))
