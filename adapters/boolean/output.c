/* output -- the result as CGNS or VTK, which all ranks write together, or its outer surface as STL or OBJ, which rank 0
 * writes: to it alone goes what the surface needs, rank after rank. */
#include "boolean.h"

#include <vtk.h>

#include <errno.h>
#include <limits.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>
#include <unistd.h>

#define CGNS_VERSION 4.2 /* what most readers of ElementStartOffset want */

/* ---- check --------------------------------------------------------------------------------------------------------- */

static bool is_same_file(const char *one, const char *other)
{
  struct stat a, b;

  return !stat(one, &a) && !stat(other, &b) && a.st_dev == b.st_dev && a.st_ino == b.st_ino;
}

/* Can a file be made there? Rank 0 alone. */
static cli_exit check_path(const char *path, const char *word, const bool_options *options, cli_failure *why)
{
  const char *slash  = strrchr(path, '/');
  char       *folder = slash == path ? strdup("/") : slash ? strndup(path, (size_t)(slash - path)) : strdup(".");
  struct stat st;
  cli_exit    code = CLI_DONE;

  if (!folder) return cli_no_memory(why);
  for (int side = 0; side < 2 && code == CLI_DONE; side++)
    if (is_same_file(path, options->path[side]))
      code = cli_fail(why, CLI_USAGE, "%s: it is one of the input files: choose another %s", path, word);
  if (code == CLI_DONE && !stat(path, &st) && !S_ISREG(st.st_mode))
    code = cli_fail(why, CLI_IO, "%s: it exists and is not a regular file: choose another %s", path, word);
  if (code == CLI_DONE && rslice_file_check(path))
    code = cli_fail(why, CLI_IO, "%s: it may not be written (%s): remove it, or choose another %s", path,
                    strerror(rslice_file_check(path)), word);
  if (code == CLI_DONE && access(folder, W_OK | X_OK))
    code = cli_fail(why, CLI_IO, "%s: its folder cannot be written (%s): choose another %s", path, strerror(errno), word);
  free(folder);
  return code;
}

static bool ends_in(const char *path, const char *ending)
{
  const size_t n = strlen(path), m = strlen(ending);

  return n > m && !strcasecmp(path + n - m, ending);
}

cli_exit bool_output_check(MPI_Comm comm, const bool_options *options, cli_failure *why)
{
  cli_exit code = CLI_DONE;
  int      rank;

  MPI_Comm_rank(comm, &rank);
  if (!rsurf_is_path(options->output) && !rvtk_is_path(options->output) && !ends_in(options->output, ".cgns"))
    return cli_fail(why, CLI_USAGE, "%s: its ending says no format: give OUT as .cgns, .vtu, .stl or .obj", options->output);
  if (rank == 0) code = check_path(options->output, "OUT", options, why);
  if (rank == 0 && code == CLI_DONE && options->report) code = check_path(options->report, "report", options, why);
  return cli_agree_on(comm, code, why);
}

/* ---- outer surface ------------------------------------------------------------------------------------------------- */

/* Faces that have words for rank 0: {corners, boundary, coordinates ...}; all others have none. */
typedef struct outer {
  int64_t *offset, *word; /* [faces + 1], [offset[faces]] */
} outer;

static bool list_outer(const rslice_content *content, outer *out)
{
  const remap_supermesh_view *m     = content->mesh;
  uint8_t                    *inner = calloc((size_t)m->num_faces + 1, 1);
  int64_t                     at    = 0;

  out->offset = calloc((size_t)m->num_faces + 1, sizeof *out->offset);
  if (!inner || !out->offset) {
    free(inner);
    return false;
  }
  for (int64_t i = 0; i < m->num_beyond; i++) inner[m->beyond_face[i]] = 1;
  for (int64_t f = 0; f < m->num_faces; f++) {
    inner[f] |= m->face_neighbour[f] >= 0;
    out->offset[f + 1] = out->offset[f] + (inner[f] ? 0 : 2 + 3 * (m->face_offset[f + 1] - m->face_offset[f]));
  }
  out->word = malloc(((size_t)out->offset[m->num_faces] + 1) * sizeof *out->word);
  for (int64_t f = 0; out->word && f < m->num_faces; f++) {
    const int32_t *loop = m->face_node + m->face_offset[f];
    const int64_t  n    = m->face_offset[f + 1] - m->face_offset[f];
    int64_t        low  = 0;

    if (inner[f]) continue;
    out->word[at++] = n;
    out->word[at++] = content->face_boundary[f] < 0 ? content->num_boundaries : content->face_boundary[f];
    for (int64_t i = 1; i < n; i++)
      if (m->node_global[loop[i]] < m->node_global[loop[low]]) low = i;
    for (int64_t i = 0; i < n; i++, at += 3) memcpy(out->word + at, m->node_xyz + 3 * loop[(low + i) % n], 3 * sizeof(double));
  }
  free(inner);
  return out->word != NULL;
}

/* The faces of a slice join the surface on rank 0. */
static cli_exit add_faces(const int64_t *word, int64_t num, rsurf_builder *builder, cli_failure *why)
{
  rsurf_message message;

  for (int64_t at = 0; at < num; at += 2 + 3 * word[at])
    if (rsurf_add(builder, (const double *)(const void *)(word + at + 2), word[at], (int32_t)word[at + 1], &message) !=
        RSURF_OK)
      return cli_fail(why, CLI_INTERNAL, "%s", message.text);
  return CLI_DONE;
}

/* Words from one rank to rank 0, in pieces that MPI can count. */
static void send_words(MPI_Comm comm, const int64_t *word, int64_t num)
{
  MPI_Send(&num, 1, MPI_INT64_T, 0, 0, comm);
  for (int64_t at = 0; at < num; at += 1 << 27)
    MPI_Send(word + at, (int)(num - at < 1 << 27 ? num - at : 1 << 27), MPI_INT64_T, 0, 1, comm);
}

/* What another rank sends; where memory is out it is dropped. The caller frees. */
static int64_t *receive_words(MPI_Comm comm, int rank, int64_t *num)
{
  int64_t *word, *piece;

  MPI_Recv(num, 1, MPI_INT64_T, rank, 0, comm, MPI_STATUS_IGNORE);
  word = malloc(((size_t)*num + 1) * sizeof *word);
  for (int64_t at = 0; at < *num; at += 1 << 27) {
    const int n = (int)(*num - at < 1 << 27 ? *num - at : 1 << 27);

    piece = word ? word + at : malloc((size_t)n * sizeof *piece);
    MPI_Recv(piece, piece ? n : 0, MPI_INT64_T, rank, 1, comm, MPI_STATUS_IGNORE);
    if (!word) free(piece);
  }
  return word;
}

/* All outer faces in their order, into a surface on rank 0. Collective, whatever happens. */
static cli_exit collect(MPI_Comm comm, const rslice_rows *rows, rsurf_builder *builder, cli_exit code, cli_failure *why)
{
  const int64_t mine = rows->offset[rows->num];
  int           rank, size;

  MPI_Comm_rank(comm, &rank);
  MPI_Comm_size(comm, &size);
  if (rank) {
    send_words(comm, rows->word, mine);
    return CLI_DONE;
  }
  if (code == CLI_DONE) code = add_faces(rows->word, mine, builder, why);
  for (int r = 1; r < size; r++) {
    int64_t  num;
    int64_t *word = receive_words(comm, r, &num);

    if (code == CLI_DONE) code = word ? add_faces(word, num, builder, why) : cli_no_memory(why);
    free(word);
  }
  return code;
}

/* Rank 0 alone. */
static cli_exit write_text(const char *path, const rsurf_surface *surface, cli_failure *why)
{
  char          part[PATH_MAX] = "";
  int           error          = rslice_file_begin(path, part, sizeof part);
  FILE         *out            = error ? NULL : fopen(part, "w");
  rsurf_message message;
  cli_exit      code = CLI_DONE;

  if (!out) return cli_fail(why, CLI_IO, "%s: it cannot be written: %s", path, strerror(error ? error : errno));
  if (rsurf_write(out, path, surface, &message) != RSURF_OK) code = cli_fail(why, CLI_IO, "%s", message.text);
  if (fclose(out) && code == CLI_DONE) code = cli_fail(why, CLI_IO, "%s: it cannot be written: is the disk full?", path);
  error = code == CLI_DONE ? rslice_file_finish(part, path) : 0;
  if (error) code = cli_fail(why, CLI_IO, "%s: it cannot be written: %s", path, strerror(error));
  if (code != CLI_DONE) unlink(part);
  return code;
}

/* The surface of rank 0 from the builder, which ends. */
static cli_exit finish_surface(const char *path, rsurf_builder **builder, cli_exit code, cli_failure *why)
{
  rsurf_surface surface = {.num_nodes = 0};
  rsurf_message message;

  rsurf_end(builder, &surface);
  if (code == CLI_DONE && ends_in(path, ".stl") && rsurf_triangulate(&surface, &message) != RSURF_OK)
    code = cli_fail(why, CLI_INTERNAL, "%s", message.text);
  if (code == CLI_DONE) code = write_text(path, &surface, why);
  rsurf_drop(&surface);
  return code;
}

/* A builder with the boundaries as groups, and one for faces that are on none. Rank 0 alone. */
static cli_exit begin_surface(const rslice_content *content, rsurf_builder **out, cli_failure *why)
{
  const char  **name = calloc((size_t)content->num_boundaries + 1, sizeof *name);
  rsurf_message message;
  cli_exit      code = name ? CLI_DONE : cli_no_memory(why);

  for (int b = 0; name && b < content->num_boundaries; b++) name[b] = content->boundary_name[b];
  if (name) name[content->num_boundaries] = "unnamed";
  if (name && rsurf_begin(content->num_boundaries + 1, name, out, &message) != RSURF_OK)
    code = cli_fail(why, CLI_INTERNAL, "%s", message.text);
  free(name);
  return code;
}

static cli_exit write_surface(MPI_Comm comm, const char *path, const rslice_content *content, cli_failure *why)
{
  const remap_supermesh_view *m       = content->mesh;
  outer                       list    = {NULL, NULL};
  rsurf_builder              *builder = NULL;
  rslice_rows                 rows;
  const rslice_status         mine = list_outer(content, &list) ? RSLICE_OK : RSLICE_MEMORY;
  const rslice_status         status =
      rslice_ship(comm, mine, m->global_faces, m->num_faces, m->face_global, list.offset, list.word, &rows);
  cli_exit code = CLI_DONE;
  int      rank;

  MPI_Comm_rank(comm, &rank);
  free(list.offset);
  free(list.word);
  if (status != RSLICE_OK) return cli_fail(why, CLI_INTERNAL, "%s: %s", path, rslice_status_text(status));
  if (rank == 0) code = begin_surface(content, &builder, why);
  code = collect(comm, &rows, builder, code, why);
  if (rank == 0) code = finish_surface(path, &builder, code, why);
  rslice_drop(&rows);
  return cli_agree_on(comm, code, why);
}

/* ---- which --------------------------------------------------------------------------------------------------------- */

cli_exit bool_output_write(MPI_Comm comm, const bool_options *options, const rslice_content *content, cli_failure *why)
{
  rcgns_message message;
  rvtk_message  text;
  rvtk_status   status;

  if (rsurf_is_path(options->output)) return write_surface(comm, options->output, content, why);
  if (!rvtk_is_path(options->output))
    return cli_from_cgns(rcgns_write_supermesh(comm, options->output, CGNS_VERSION, content, &message), &message, why);
  status = rvtk_write(comm, options->output, content, &text);
  if (status == RVTK_OK) return CLI_DONE;
  return cli_fail(why, status == RVTK_IO ? CLI_IO : CLI_INTERNAL, "%s", text.text);
}
