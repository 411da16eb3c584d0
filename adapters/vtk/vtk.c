/* vtk -- a .vtu file: rank 0 writes the XML, all ranks their slices of each array behind it. Linear in the slices. */
#include "vtk.h"

#include "base.h"

#include <errno.h>
#include <limits.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>
#include <unistd.h>

enum { POLYHEDRON = 42, FIXED_ARRAYS = 16 };

const char *rvtk_status_text(rvtk_status status)
{
  switch (status) {
#define X(name, number, text) \
  case RVTK_##name: return text;
    RVTK_STATUS_LIST(X)
#undef X
  }
  return "unknown status";
}

int rvtk_is_path(const char *path)
{
  const size_t n = strlen(path);

  return n > 4 && !strcasecmp(path + n - 4, ".vtu");
}

static rvtk_status fail(rvtk_message *message, rvtk_status status, const char *format, ...)
    __attribute__((format(printf, 3, 4)));
static rvtk_status fail(rvtk_message *message, rvtk_status status, const char *format, ...)
{
  va_list args;

  va_start(args, format);
  ra_line(message->text, sizeof message->text, format, args);
  va_end(args);
  return status;
}

static rvtk_status no_memory(const char *path, rvtk_message *message)
{
  return fail(message, RVTK_MEMORY, "%s: out of memory: use more ranks", path);
}

/* The greatest of the ranks' statuses and the message of the lowest rank that has it. Collective. */
static rvtk_status agree(MPI_Comm comm, rvtk_status mine, rvtk_message *message)
{
  const int worst = ra_agree(comm, (int)mine, message->text, sizeof message->text);

  if (worst == RVTK_OK) message->text[0] = 0;
  return (rvtk_status)worst;
}

/* ---- arrays ---------------------------------------------------------------------------------------------------------- */

/* An array of the file: this rank's part of it. */
typedef struct array {
  const char *name, *type;
  int         components;  /* 0: not said */
  int         section;     /* 0 points, 1 cells, 2 cell data, 3 field data */
  int64_t     tuples;      /* of field data, on all ranks */
  void       *values;      /* owned */
  int64_t     bytes;       /* of the part */
  int64_t     before, all; /* bytes of the ranks before, of all ranks */
} array;

/* The file while it is made. */
typedef struct vtu {
  MPI_Comm              comm;
  int                   rank;
  const rslice_content *content;
  rslice_rows           nodes, cells, faces;
  array                *array;
  int                   num_arrays;
} vtu;

static void *add_array(vtu *v, const char *name, const char *type, int components, int section, int64_t count, size_t size)
{
  array *a = &v->array[v->num_arrays++];

  *a        = (array){.name = name, .type = type, .components = components, .section = section, .bytes = count * (int64_t)size};
  a->values = calloc((size_t)count + 1, size);
  return a->values;
}

/* A cell's faces: how many, then of each its number, how many nodes, nodes. */
static const int64_t *stream_of(const vtu *v, int64_t c)
{
  return v->cells.word + v->cells.offset[c] + rslice_cell_head(v->content);
}

static int by_number(const void *a, const void *b)
{
  const int64_t x = *(const int64_t *)a, y = *(const int64_t *)b;

  return (x > y) - (x < y);
}

/* The nodes of a cell, ascending, each once. out has room for all words of the stream. */
static int64_t nodes_of(const int64_t *stream, int64_t *out)
{
  int64_t num = 0, kept = 0;

  for (int64_t f = 0, at = 2; f < stream[0]; f++) {
    const int64_t n = stream[at++];

    memcpy(out + num, stream + at, (size_t)n * sizeof *out);
    num += n;
    at += n + 1;
  }
  qsort(out, (size_t)num, sizeof *out, by_number);
  for (int64_t i = 0; i < num; i++)
    if (!kept || out[kept - 1] != out[i]) out[kept++] = out[i];
  return kept;
}

/* The loops of a cell as VTK has them, and apart from them the numbers of its faces. Returns the words of the first. */
static int64_t split_stream(const int64_t *stream, int64_t *loops, int64_t *number)
{
  int64_t words = 0;

  loops[words++] = stream[0];
  for (int64_t f = 0, at = 1; f < stream[0]; f++) {
    const int64_t n = stream[at + 1];

    number[f] = stream[at];
    memcpy(loops + words, stream + at + 1, (size_t)(n + 1) * sizeof *loops);
    words += n + 1;
    at += n + 2;
  }
  return words;
}

/* Faces of this rank's cells, each as often as it is a cell's. */
static int64_t count_faces(const vtu *v)
{
  int64_t num = 0;

  for (int64_t c = 0; c < v->cells.num; c++) num += stream_of(v, c)[0];
  return num;
}

/* Nodes, loops and where they end, counted over all ranks. Collective. */
static bool make_topology(vtu *v)
{
  const int64_t num = v->cells.num, num_faces = count_faces(v);
  const int64_t most = v->cells.offset[num] - num * rslice_cell_head(v->content) - num_faces; /* words of all loops */
  int64_t      *connectivity = add_array(v, "connectivity", "Int64", 0, 1, most, sizeof *connectivity);
  array        *nodes        = &v->array[v->num_arrays - 1];
  int64_t      *offsets      = add_array(v, "offsets", "Int64", 0, 1, num, sizeof *offsets);
  uint8_t      *types        = add_array(v, "types", "UInt8", 0, 1, num, sizeof *types);
  int64_t      *faces        = add_array(v, "faces", "Int64", 0, 1, most, sizeof *faces);
  int64_t      *faceoffsets  = add_array(v, "faceoffsets", "Int64", 0, 1, num, sizeof *faceoffsets);
  int64_t      *number       = add_array(v, "CellFaces", "Int64", 0, 3, num_faces, sizeof *number);
  array        *numbers      = &v->array[v->num_arrays - 1];
  const bool    ok           = connectivity && offsets && types && faces && faceoffsets && number;
  int64_t       sum[3] = {0, 0, 0}, before[3] = {0, 0, 0};

  for (int64_t c = 0; ok && c < num; c++) {
    sum[0] += nodes_of(stream_of(v, c), connectivity + sum[0]);
    sum[1] += split_stream(stream_of(v, c), faces + sum[1], number + sum[2]);
    sum[2] += stream_of(v, c)[0];
    offsets[c]     = sum[0];
    faceoffsets[c] = sum[1];
    types[c]       = POLYHEDRON;
  }
  nodes->bytes = sum[0] * (int64_t)sizeof *connectivity;
  MPI_Allreduce(&sum[2], &numbers->tuples, 1, MPI_INT64_T, MPI_SUM, v->comm);
  MPI_Exscan(sum, before, 3, MPI_INT64_T, MPI_SUM, v->comm);
  for (int64_t c = 0; ok && v->rank && c < num; c++) {
    offsets[c] += before[0];
    faceoffsets[c] += before[1];
  }
  return ok;
}

/* One word of each cell's head as an array of cell data. */
static bool make_data(vtu *v, const char *name, const char *type, int64_t place)
{
  int64_t *values = add_array(v, name, type, 0, 2, v->cells.num, sizeof *values);

  for (int64_t c = 0; values && c < v->cells.num; c++) values[c] = v->cells.word[v->cells.offset[c] + place];
  return values != NULL;
}

/* One word of each face's head as an array of field data. */
static bool make_face_data(vtu *v, const char *name, int64_t place)
{
  int64_t *values = add_array(v, name, "Int64", 0, 3, v->faces.num, sizeof *values);

  for (int64_t f = 0; values && f < v->faces.num; f++) values[f] = v->faces.word[v->faces.offset[f] + place];
  v->array[v->num_arrays - 1].tuples = v->content->mesh->global_faces;
  return values != NULL;
}

/* What belongs to faces, by their numbers. */
static bool make_faces(vtu *v)
{
  static const char *const cell[2] = {"FaceCellA", "FaceCellB"}, *const number[2] = {"FaceNumberA", "FaceNumberB"};
  bool                     ok      = make_face_data(v, "FaceLiesIn", RSLICE_FACE_ORIGIN);

  if (v->content->num_boundaries) ok = make_face_data(v, "FaceBoundary", RSLICE_FACE_BOUNDARY) && ok;
  for (int side = 0; side < 2; side++) {
    if (!v->content->face_cell[side] || !v->content->face_number[side]) continue;
    ok = make_face_data(v, cell[side], RSLICE_FACE_CELL + side) && ok;
    ok = make_face_data(v, number[side], RSLICE_FACE_NUMBER + side) && ok;
  }
  return ok;
}

/* Every array, v->array being there. Collective, whatever happens. */
static bool make_arrays(vtu *v)
{
  const rslice_content *content = v->content;
  double               *points  = add_array(v, "Points", "Float64", 3, 0, 3 * v->nodes.num, sizeof *points);
  bool                  ok      = points != NULL;

  if (ok && v->nodes.num) memcpy(points, v->nodes.word, 3 * (size_t)v->nodes.num * sizeof *points);
  ok = make_topology(v) && ok;
  for (int side = 0; side < 2; side++) ok = make_data(v, content->ancestor[side], "Int64", side) && ok;
  ok = make_data(v, "Volume", "Float64", 2) && ok;
  for (int k = 0; k < content->num_fields; k++) ok = make_data(v, content->field[k].name, "Float64", 3 + k) && ok;
  return make_faces(v) && ok;
}

/* Where each rank's part of each array goes. Collective. */
static void place_arrays(vtu *v)
{
  for (int i = 0; i < v->num_arrays; i++) {
    array *a = &v->array[i];

    MPI_Exscan(&a->bytes, &a->before, 1, MPI_INT64_T, MPI_SUM, v->comm);
    if (v->rank == 0) a->before = 0;
    MPI_Allreduce(&a->bytes, &a->all, 1, MPI_INT64_T, MPI_SUM, v->comm);
  }
}

/* ---- XML ------------------------------------------------------------------------------------------------------------- */

/* A name as the value of an attribute. */
static void put_name(FILE *out, const char *name)
{
  for (; *name; name++) {
    if (strchr("<>&\"", *name) || (unsigned char)*name < ' ')
      fprintf(out, "&#%d;", (unsigned char)*name < ' ' ? ' ' : *name);
    else
      fputc(*name, out);
  }
}

/* Names of boundaries as VTK writes texts: the characters' codes, each text ended by 0. */
static void put_boundary_names(FILE *out, const rslice_content *content)
{
  if (!content->num_boundaries) return;
  fprintf(out, "        <DataArray type=\"String\" Name=\"BoundaryName\" NumberOfTuples=\"%d\" format=\"ascii\">\n",
          content->num_boundaries);
  for (int b = 0; b < content->num_boundaries; b++) {
    for (const char *c = content->boundary_name[b]; *c; c++) fprintf(out, "%d ", (unsigned char)*c);
    fprintf(out, "0\n");
  }
  fprintf(out, "        </DataArray>\n");
}

static void put_section(FILE *out, const vtu *v, int section, const char *name)
{
  int64_t at = 0;

  fprintf(out, "      <%s>\n", name);
  for (int i = 0; i < v->num_arrays; i++) {
    const array *a = &v->array[i];

    if (a->section == section) {
      fprintf(out, "        <DataArray type=\"%s\" Name=\"", a->type);
      put_name(out, a->name);
      fputc('"', out);
      if (a->components) fprintf(out, " NumberOfComponents=\"%d\"", a->components);
      if (section == 3) fprintf(out, " NumberOfTuples=\"%lld\"", (long long)a->tuples);
      fprintf(out, " format=\"appended\" offset=\"%lld\"/>\n", (long long)at);
    }
    at += (int64_t)sizeof(uint64_t) + a->all;
  }
  if (section == 3) put_boundary_names(out, v->content);
  fprintf(out, "      </%s>\n", name);
}

/* Everything before the data; *size bytes. The caller frees; NULL: no memory. */
static char *make_xml(const vtu *v, size_t *size)
{
  const uint16_t one  = 1;
  char          *text = NULL;
  FILE          *out  = open_memstream(&text, size);

  if (!out) return NULL;
  fprintf(out,
          "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"%s\" "
          "header_type=\"UInt64\">\n  <UnstructuredGrid>\n",
          *(const uint8_t *)&one ? "LittleEndian" : "BigEndian");
  put_section(out, v, 3, "FieldData");
  fprintf(out, "    <Piece NumberOfPoints=\"%lld\" NumberOfCells=\"%lld\">\n", (long long)v->content->mesh->global_nodes,
          (long long)v->content->mesh->global_cells);
  put_section(out, v, 0, "Points");
  put_section(out, v, 1, "Cells");
  put_section(out, v, 2, "CellData");
  fprintf(out, "    </Piece>\n  </UnstructuredGrid>\n  <AppendedData encoding=\"raw\">\n   _");
  if (!fclose(out)) return text;
  free(text);
  return NULL;
}

/* ---- the file -------------------------------------------------------------------------------------------------------- */

/* Write this rank's bytes at a place, in rounds of less than 2 GiB that all ranks share. Collective. */
static bool write_part(MPI_Comm comm, MPI_File file, int64_t at, const void *values, int64_t bytes)
{
  const int64_t most   = 1 << 30;
  int64_t       rounds = (bytes + most - 1) / most;
  bool          ok     = true;

  MPI_Allreduce(MPI_IN_PLACE, &rounds, 1, MPI_INT64_T, MPI_MAX, comm);
  for (int64_t r = 0; r < rounds; r++) {
    const int64_t lo = r * most < bytes ? r * most : bytes, n = bytes - lo < most ? bytes - lo : most;
    MPI_Status    status;
    int           written = 0;

    if (MPI_File_write_at_all(file, at + lo, (const char *)values + lo, (int)n, MPI_BYTE, &status)) ok = false;
    if (ok) MPI_Get_count(&status, MPI_BYTE, &written);
    ok = ok && written == (int)n;
  }
  return ok;
}

/* XML from rank 0, then each array after its length. Collective. */
static bool write_all(const vtu *v, MPI_File file, const char *xml, int64_t xml_size)
{
  static const char end[] = "\n  </AppendedData>\n</VTKFile>\n";
  int64_t           at    = xml_size;
  bool              ok    = write_part(v->comm, file, 0, xml, v->rank ? 0 : xml_size);

  for (int i = 0; i < v->num_arrays; i++) {
    const array   *a      = &v->array[i];
    const uint64_t length = (uint64_t)a->all;

    ok = write_part(v->comm, file, at, &length, v->rank ? 0 : (int64_t)sizeof length) && ok;
    at += (int64_t)sizeof length;
    ok = write_part(v->comm, file, at + a->before, a->values, a->bytes) && ok;
    at += a->all;
  }
  return write_part(v->comm, file, at, end, v->rank ? 0 : (int64_t)sizeof end - 1) && ok;
}

static int64_t size_of(const vtu *v, int64_t xml_size)
{
  int64_t size = xml_size + (int64_t)strlen("\n  </AppendedData>\n</VTKFile>\n");

  for (int i = 0; i < v->num_arrays; i++) size += (int64_t)sizeof(uint64_t) + v->array[i].all;
  return size;
}

/* Rank 0 alone: an empty file of the size that it will have. */
static rvtk_status begin(const char *path, char *part, size_t size, int64_t bytes, rvtk_message *message)
{
  int error = rslice_file_begin(path, part, size);

  if (!error) error = rslice_file_claim(part, bytes);
  return error ? fail(message, RVTK_IO, "%s: it cannot be written: %s", path, strerror(error)) : RVTK_OK;
}

/* Rank 0 alone: nothing is missing. */
static rvtk_status finish(const char *part, const char *path, int64_t bytes, rvtk_message *message)
{
  struct stat st;
  int         error = stat(part, &st) ? errno : st.st_size == (off_t)bytes ? 0 : EIO;

  if (!error) error = rslice_file_finish(part, path);
  return error ? fail(message, RVTK_IO, "%s: it cannot be written: %s", path, strerror(error)) : RVTK_OK;
}

static rvtk_status write_file(const vtu *v, const char *path, const char *xml, int64_t xml_size, rvtk_message *message)
{
  const int64_t bytes          = size_of(v, xml_size);
  char          part[PATH_MAX] = "";
  MPI_File      file;
  rvtk_status   status = v->rank == 0 ? begin(path, part, sizeof part, bytes, message) : RVTK_OK;

  status = agree(v->comm, status, message);
  if (status == RVTK_OK) {
    MPI_Bcast(part, (int)sizeof part, MPI_CHAR, 0, v->comm);
    if (MPI_File_open(v->comm, part, MPI_MODE_WRONLY, MPI_INFO_NULL, &file)) {
      status = fail(message, RVTK_IO, "%s: it cannot be opened for parallel writing", path);
    } else {
      if (!write_all(v, file, xml, xml_size))
        status = fail(message, RVTK_IO, "%s: it cannot be written: is the disk full?", path);
      if (MPI_File_close(&file)) status = fail(message, RVTK_IO, "%s: it cannot be written: is the disk full?", path);
    }
    status = agree(v->comm, status, message);
  }
  if (status == RVTK_OK) status = agree(v->comm, v->rank == 0 ? finish(part, path, bytes, message) : RVTK_OK, message);
  if (status != RVTK_OK && v->rank == 0 && *part) unlink(part);
  return status;
}

static rvtk_status from_slices(rslice_status status, const char *path, rvtk_message *message)
{
  if (status == RSLICE_OK) return RVTK_OK;
  return fail(message, status == RSLICE_INTERNAL ? RVTK_INTERNAL : RVTK_MEMORY, "%s: %s", path, rslice_status_text(status));
}

rvtk_status rvtk_write(MPI_Comm comm, const char *path, const rslice_content *content, rvtk_message *message)
{
  vtu         v        = {.comm = comm, .content = content};
  char       *xml      = NULL;
  size_t      xml_size = 0;
  rvtk_status status;

  MPI_Comm_rank(comm, &v.rank);
  status = from_slices(rslice_nodes(comm, content->mesh, &v.nodes), path, message);
  if (status == RVTK_OK) status = from_slices(rslice_cells(comm, content, 1, &v.cells), path, message);
  if (status == RVTK_OK) status = from_slices(rslice_faces(comm, content, &v.faces), path, message);
  if (status == RVTK_OK) {
    v.array = calloc((size_t)(FIXED_ARRAYS + content->num_fields), sizeof *v.array);
    status  = agree(comm, v.array ? RVTK_OK : no_memory(path, message), message);
  }
  if (status == RVTK_OK) {
    const bool ok = make_arrays(&v);

    place_arrays(&v);
    xml    = ok ? make_xml(&v, &xml_size) : NULL;
    status = agree(comm, xml ? RVTK_OK : no_memory(path, message), message);
  }
  if (status == RVTK_OK) status = write_file(&v, path, xml, (int64_t)xml_size, message);
  for (int i = 0; i < v.num_arrays; i++) free(v.array[i].values);
  free(v.array);
  free(xml);
  rslice_drop(&v.nodes);
  rslice_drop(&v.faces);
  rslice_drop(&v.cells);
  return status;
}
