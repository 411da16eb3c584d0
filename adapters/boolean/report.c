/* report -- what the job found: text on standard output for people, a JSON file for programs. */
#include "boolean.h"

#include <errno.h>
#include <jansson.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static const char *const kind_word[3] = {"in_both", "in_a_only", "in_b_only"};

/* ---- counting ------------------------------------------------------------------------------------------------------ */

/* The kind of a cell of the result: in both, in A only, in B only. */
static int kind_of(const remap_supermesh_view *view, int64_t cell)
{
  return view->cell_ancestor[0][cell] < 0 ? 2 : view->cell_ancestor[1][cell] < 0;
}

void bool_report_count(MPI_Comm comm, const remap_supermesh_view *view, bool_report *report)
{
  int64_t count[6]   = {0, 0, 0, view->num_triangles[0], view->num_triangles[1], view->num_crossings};
  double  seconds[7] = {view->seconds_partition, view->seconds_triangulation, view->seconds_crossings, view->seconds_polygons,
                        view->seconds_cells,     view->seconds_faces,         view->seconds_numbering};

  report->view = *view;
  for (int64_t c = 0; c < view->num_cells; c++) count[kind_of(view, c)]++;
  memcpy(report->volume, view->volume, sizeof report->volume);
  MPI_Allreduce(MPI_IN_PLACE, count, 6, MPI_INT64_T, MPI_SUM, comm);
  MPI_Allreduce(MPI_IN_PLACE, seconds, 7, MPI_DOUBLE, MPI_MAX, comm);
  memcpy(report->cells, count, sizeof report->cells);
  report->view.num_triangles[0]      = count[3];
  report->view.num_triangles[1]      = count[4];
  report->view.num_crossings         = count[5];
  report->view.seconds_partition     = seconds[0];
  report->view.seconds_triangulation = seconds[1];
  report->view.seconds_crossings     = seconds[2];
  report->view.seconds_polygons      = seconds[3];
  report->view.seconds_cells         = seconds[4];
  report->view.seconds_faces         = seconds[5];
  report->view.seconds_numbering     = seconds[6];
}

/* ---- text ---------------------------------------------------------------------------------------------------------- */

static void print_operand(FILE *out, char letter, const bool_operand *o)
{
  fprintf(out, "%c  %s: ", letter, o->path);
  if (!o->is_surface) {
    const rcgns_info *info = rcgns_get_info(o->file);

    fprintf(out, "%lld zone%s, %lld cell%s, %d boundar%s\n", (long long)info->num_zones, cli_plural(info->num_zones),
            (long long)info->num_cells, cli_plural(info->num_cells), o->boundaries.num, o->boundaries.num == 1 ? "y" : "ies");
    for (int64_t i = 0; i < info->num_notes; i++) fprintf(out, "   note: %s\n", info->note[i]);
    return;
  }
  fprintf(out, "a surface of %lld shell%s, %lld of them void%s; %d group%s\n", (long long)o->repairs.shells,
          cli_plural(o->repairs.shells), (long long)o->repairs.voids, cli_plural(o->repairs.voids), o->boundaries.num,
          cli_plural(o->boundaries.num));
  if (o->repairs.faces_dropped || o->repairs.faces_turned || o->repairs.faces_cut || o->repairs.faces_flipped)
    fprintf(out,
            "   repaired: %lld faces turned round, %lld without size dropped, %lld without area flipped, %lld bent or concave "
            "cut\n",
            (long long)o->repairs.faces_turned, (long long)o->repairs.faces_dropped, (long long)o->repairs.faces_flipped,
            (long long)o->repairs.faces_cut);
}

void bool_report_print(FILE *out, const bool_report *r)
{
  fprintf(out, "remap-boolean %s on %d rank%s: %s\n", remap_version(), r->ranks, cli_plural(r->ranks),
          r->options->operation);
  for (int side = 0; side < 2; side++) print_operand(out, (char)('A' + side), &r->operand[side]);
  fprintf(out, "\n%-10s %12s %20s\n", "result", "cells", "volume");
  for (int k = 0; k < 3; k++) fprintf(out, "%-10s %12lld %20.12g\n", kind_word[k], (long long)r->cells[k], r->volume[k]);
  fprintf(out, "%lld faces, %lld nodes\n", (long long)r->view.global_faces, (long long)r->view.global_nodes);
  for (int side = 0; side < 2; side++)
    if (r->view.zone_overlap[side] > 0)
      fprintf(out, "note: zones of %c overlap by rounding; a volume of %.3g that two of them have counts once\n", 'A' + side,
              r->view.zone_overlap[side]);
  for (int b = 0; r->options->verbose && r->content && b < r->content->boundaries.num; b++)
    fprintf(out, "boundary   %s (%s)\n", r->content->boundaries.name[b], r->content->boundaries.type[b]);
  for (int k = 0; r->content && k < r->content->content.num_fields; k++)
    fprintf(out, "field      %s\n", r->content->field[k].name);
  fprintf(out, "\ntime    read %.2f s, supermesh %.2f s, write %.2f s, total %.2f s\n", r->seconds_read, r->seconds_supermesh,
          r->seconds_write, r->seconds_total);
  fprintf(out, "memory  %.1f MB on the rank that needs most\noutput  %s\n", 1e-6 * (double)r->peak_rss, r->options->output);
  fflush(out);
}

/* ---- JSON ---------------------------------------------------------------------------------------------------------- */

/* A text; bytes that are not UTF-8, as names of files may hold, become question marks. */
static json_t *words(const char *text)
{
  json_t *string = json_string(text);
  char   *copy   = string ? NULL : strdup(text);

  for (char *c = copy; c && *c; c++)
    if ((unsigned char)*c >= 0x80) *c = '?';
  if (copy) string = json_string(copy);
  free(copy);
  return string;
}

static json_t *operand_json(const bool_report *r, int side)
{
  const bool_operand *o    = &r->operand[side];
  json_t             *json = json_pack("{s:o, s:s, s:I, s:i, s:f}", "file", words(o->path), "kind",
                                       o->is_surface ? "surface" : "mesh", "cells", (json_int_t)o->num_cells, "boundaries",
                                       o->boundaries.num, "zone_overlap", r->view.zone_overlap[side]);

  if (json && o->is_surface)
    json_object_set_new(json, "repairs",
                        json_pack("{s:I, s:I, s:I, s:I, s:I, s:I}", "faces_flipped", (json_int_t)o->repairs.faces_flipped,
                                  "faces_turned", (json_int_t)o->repairs.faces_turned, "faces_dropped",
                                  (json_int_t)o->repairs.faces_dropped, "faces_cut", (json_int_t)o->repairs.faces_cut, "shells",
                                  (json_int_t)o->repairs.shells, "voids", (json_int_t)o->repairs.voids));
  return json;
}

static json_t *result_json(const bool_report *r)
{
  json_t *json  = json_pack("{s:o, s:I, s:I, s:I, s:f}", "file", words(r->options->output), "cells",
                            (json_int_t)r->view.global_cells, "faces", (json_int_t)r->view.global_faces, "nodes",
                            (json_int_t)r->view.global_nodes, "volume", r->volume[0] + r->volume[1] + r->volume[2]);
  json_t *names = json_array();

  for (int k = 0; k < 3; k++)
    json_object_set_new(json, kind_word[k], json_pack("{s:I, s:f}", "cells", (json_int_t)r->cells[k], "volume", r->volume[k]));
  for (int b = 0; r->content && b < r->content->boundaries.num; b++)
    json_array_append_new(names, words(r->content->boundaries.name[b]));
  json_object_set_new(json, "boundaries", names);
  names = json_array();
  for (int k = 0; r->content && k < r->content->content.num_fields; k++)
    json_array_append_new(names, words(r->content->field[k].name));
  json_object_set_new(json, "fields", names);
  return json;
}

static json_t *report_json(const bool_report *r)
{
  const remap_supermesh_view *v = &r->view;

  return json_pack("{s:s, s:i, s:s, s:o, s:o, s:o, s:{s:f, s:f, s:f, s:f}, s:{s:f, s:f, s:f, s:f, s:f, s:f, s:f}, s:{s:I}}",
                   "version", remap_version(), "ranks", r->ranks, "operation", r->options->operation, "a",
                   operand_json(r, 0), "b", operand_json(r, 1), "result", result_json(r), "time", "read",
                   r->seconds_read, "supermesh", r->seconds_supermesh, "write", r->seconds_write, "total", r->seconds_total,
                   "supermesh_time", "partition", v->seconds_partition, "triangulation", v->seconds_triangulation, "crossings",
                   v->seconds_crossings, "polygons", v->seconds_polygons, "cells", v->seconds_cells, "faces", v->seconds_faces,
                   "numbering", v->seconds_numbering, "memory", "peak_rss_bytes_max", (json_int_t)r->peak_rss);
}

static cli_exit cannot_write(const bool_report *report, int error, cli_failure *why)
{
  if (!error) return CLI_DONE;
  return cli_fail(why, CLI_IO, "%s: the report cannot be written: %s", report->options->report, strerror(error));
}

cli_exit bool_report_begin(bool_report *report, cli_failure *why)
{
  return cannot_write(report, rslice_file_begin(report->options->report, report->part, sizeof report->part), why);
}

cli_exit bool_report_write(bool_report *report, cli_failure *why)
{
  json_t *json  = report_json(report);
  int     error = 0;

  if (!json) return cli_no_memory(why);
  if (json_dump_file(json, report->part, JSON_INDENT(2) | JSON_REAL_PRECISION(17))) error = errno ? errno : EIO;
  if (!error) error = rslice_file_finish(report->part, report->options->report);
  if (!error) report->part[0] = 0;
  json_decref(json);
  return cannot_write(report, error, why);
}

void bool_report_end(bool_report *report)
{
  if (report->part[0]) unlink(report->part);
}
