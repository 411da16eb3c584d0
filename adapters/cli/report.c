/* report -- what the job found, as text and as JSON. Its numbers have 17 digits in JSON, so that they read back exactly. */
#include "report.h"

#include "command.h"
#include "options.h"

#include <errno.h>
#include <jansson.h>
#include <libgen.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static const char *const side_word[2] = {"source", "target"};

/* "Base/Zone: cell 7 (counted from 1)", or vertex, for a global cell; text has room for size bytes. */
static const char *cell_words(const rcgns_info *info, int64_t cell, char *text, size_t size)
{
  int64_t z = info->num_zones - 1;

  while (z > 0 && info->zone[z].first_cell > cell) z--;
  snprintf(text, size, "%s: %s %lld (counted from 1)", info->zone[z].name, info->location == RCGNS_VERTICES ? "vertex" : "cell",
           (long long)(cell - info->zone[z].first_cell + 1));
  return text;
}

/* ---- text --------------------------------------------------------------------------------------------------------- */

void cli_report_meshes(FILE *out, const cli_report *report, int verbose)
{
  fprintf(out, "remap %s on %d rank%s\n", remap_version(), report->stats.ranks, cli_plural(report->stats.ranks));
  for (int side = 0; side < 2; side++) {
    const rcgns_info *info = report->info[side];

    fprintf(out, "%s  %s  %s", side_word[side], info->path, info->format);
    if (info->version > 0) fprintf(out, " %g", info->version);
    fprintf(out, ", %lld zone%s, %lld cell%s\n", (long long)info->num_zones, cli_plural(info->num_zones),
            (long long)info->num_cells, cli_plural(info->num_cells));
    for (int64_t z = 0; verbose && z < info->num_zones; z++)
      fprintf(out, "        %-32s %s, %lld cells\n", info->zone[z].name, info->zone[z].is_structured ? "block" : "elements",
              (long long)info->zone[z].num_cells);
  }
  fflush(out);
}

void cli_report_overlap(FILE *out, const cli_report *report)
{
  const remap_stats *stats = &report->stats;

  fprintf(out, "\noverlap %lld pairs, volume %.12g\n", (long long)stats->pairs, stats->overlap_volume);
  fprintf(out, "%-8s%18s %12s %12s %12s %10s\n", "", "volume", "covered", "in part", "not", "closure");
  for (int side = 0; side < 2; side++)
    fprintf(out, "%-8s%18.12g %12lld %12lld %12lld %10.1e\n", side_word[side], stats->volume[side],
            (long long)stats->cells_by_cover[side][REMAP_COVERED], (long long)stats->cells_by_cover[side][REMAP_PARTIAL],
            (long long)stats->cells_by_cover[side][REMAP_UNCOVERED], stats->max_closure_error[side]);
  for (int side = 0; side < 2; side++) {
    const int64_t n = stats->inverted_cells[side];
    char          cell[256];

    if (n > 0)
      fprintf(out, "%s: %lld inverted cell%s, the worst is %s\n", side_word[side], (long long)n, cli_plural(n),
              cell_words(report->info[side], stats->worst_inverted_cell[side], cell, sizeof cell));
  }
  fflush(out);
}

static const char *weight_word(const cli_field_row *row)
{
  static const char *const word[] = {[CLI_BY_VOLUME] = "volume", [CLI_BY_MASS] = "mass", [CLI_BY_GAS] = "gas model"};

  return row->nature == REMAP_FLAG ? "none" : word[row->weight];
}

/* A cell that is not wholly covered, for people. */
static void print_bare(FILE *out, const rcgns_info *info, const char *how, const remap_partial_cell *bare)
{
  char cell[256];

  fprintf(out, "        %s %s, %.4g covered of %.4g, at %.6g %.6g %.6g\n", how,
          cell_words(info, bare->global_cell, cell, sizeof cell), bare->fraction * bare->volume, bare->volume,
          bare->centroid[0], bare->centroid[1], bare->centroid[2]);
}

/* How the solver's volumes differ from those of the mesh. */
static void print_volumes(FILE *out, const cli_report *report, remap_side side)
{
  const remap_stats *stats = &report->stats;
  char               cell[256];

  if (!report->volume[side]) return;
  fprintf(out, "%s: volume by %s %.12g", side_word[side], report->volume[side], stats->solver_volume[side]);
  if (stats->worst_volume_cell[side] >= 0)
    fprintf(out, ", differs by %.1e at most, at %s", stats->max_volume_difference[side],
            cell_words(report->info[side], stats->worst_volume_cell[side], cell, sizeof cell));
  fputc('\n', out);
}

void cli_report_cover(FILE *out, const cli_report *report)
{
  for (int side = 0; side < 2; side++) print_volumes(out, report, (remap_side)side);
  for (int side = 0; side < 2; side++) {
    const cli_cover_row *cover = &report->cover[side];

    if (report->mask[side])
      fprintf(out, "%s: mask %s: %lld cell%s of volume %.6g take no part\n", side_word[side], report->mask[side],
              (long long)cover->cells[REMAP_UNWANTED], cli_plural(cover->cells[REMAP_UNWANTED]), cover->volume[REMAP_UNWANTED]);
    if (side == REMAP_SOURCE) continue; /* what TARGET leaves out of SOURCE lacks nobody */
    if (cover->num_partial)
      fprintf(out, "%s: %lld cell%s of volume %.6g covered in part\n", side_word[side], (long long)cover->cells[REMAP_PARTIAL],
              cli_plural(cover->cells[REMAP_PARTIAL]), cover->volume[REMAP_PARTIAL]);
    for (int i = 0; i < cover->num_partial; i++) print_bare(out, report->info[side], "least", &cover->partial[i]);
    if (cover->num_too_little)
      fprintf(out, "%s: %lld of these count as not covered (--min-coverage)\n", side_word[side],
              (long long)cover->num_too_little);
    if (cover->num_uncovered)
      fprintf(out, "%s: %lld cell%s of volume %.6g not covered\n", side_word[side], (long long)cover->cells[REMAP_UNCOVERED],
              cli_plural(cover->cells[REMAP_UNCOVERED]), cover->volume[REMAP_UNCOVERED]);
    for (int i = 0; i < cover->num_uncovered; i++) print_bare(out, report->info[side], "largest", &cover->uncovered[i]);
  }
  fflush(out);
}

void cli_report_fields(FILE *out, const cli_report *report)
{
  int width = 24;

  for (int i = 0; i < report->num_fields; i++)
    if ((int)strlen(report->field[i].name) > width) width = (int)strlen(report->field[i].name);
  fprintf(out, "\n%-*s %-13s %-9s %20s %20s %8s  %s\n", width, "field", "nature", "weight", "source integral",
          "target integral", "error", "range of source, of target");
  for (int i = 0; i < report->num_fields; i++) {
    const cli_field_row      *row  = &report->field[i];
    const remap_field_report *what = &row->what;

    fprintf(out, "%-*s %-13s %-9s %20.12g %20.12g %8.1e  %.5g .. %.5g, %.5g .. %.5g\n", width, row->name,
            cli_nature_word(row->nature), weight_word(row), what->source_integral, what->target_integral,
            what->conservation_error, what->source_min, what->source_max, what->target_min, what->target_max);
  }
  fflush(out);
}

bool cli_check_passes(const cli_check_row *row) { return row->is_least ? row->figure >= row->bar : row->figure <= row->bar; }

void cli_report_check(FILE *out, const cli_report *report)
{
  fprintf(out, "\n%-14s %10s  %s\n", "check", "figure", "bar");
  for (int i = 0; i < report->num_checks; i++) {
    const cli_check_row *row = &report->check[i];

    fprintf(out, row->is_least ? "%-14s %10.2f  at least %-8.2g %s\n" : "%-14s %10.1e  at most %-9.0e %s\n", row->name,
            row->figure, row->bar, cli_check_passes(row) ? "PASS" : "FAIL");
  }
  fflush(out);
}

void cli_report_end(FILE *out, const cli_report *report)
{
  const remap_stats *stats = &report->stats;

  fputc('\n', out);
  for (int i = 0; i < report->num_notes; i++) fprintf(out, "note    %s\n", report->note[i]);
  fprintf(out, "time    read %.2f s, partition %.2f s, overlay %.2f s, transfer %.2f s, write %.2f s, total %.2f s\n",
          report->seconds_read, stats->seconds_partition, stats->seconds_overlay, report->seconds_transfer,
          report->seconds_write, report->seconds_total);
  fprintf(out, "memory  %.1f MB on the rank that needs most\n", 1e-6 * (double)report->peak_rss);
  if (report->supermesh.path)
    fprintf(out, "output  %s, supermesh of %lld cells\n", report->supermesh.path, (long long)report->supermesh.cells);
  if (report->source_coverage) fprintf(out, "output  %s, coverage of SOURCE\n", report->source_coverage);
  if (report->output) fprintf(out, "output  %s, fields in %s\n", report->output, report->solution[REMAP_TARGET]);
  fflush(out);
}

/* ---- JSON --------------------------------------------------------------------------------------------------------- */

/* JSON knows no NaN and no infinity: null. */
static json_t *real(double value)
{
  json_t *number = json_real(value);

  return number ? number : json_null();
}

/* A text; one that is not UTF-8, as names of files and fields may be, is read as Latin 1. NULL becomes null. */
static json_t *words(const char *text)
{
  json_t *string = text ? json_string(text) : json_null();
  char   *utf8;
  size_t  n = 0;

  if (string || !(utf8 = malloc(2 * strlen(text) + 1))) return string;
  for (; *text; text++) {
    const unsigned byte = (unsigned char)*text;

    if (byte >= 0x80) utf8[n++] = (char)(0xC0 | byte >> 6);
    utf8[n++] = (char)(byte >= 0x80 ? 0x80 | (byte & 0x3F) : byte);
  }
  utf8[n] = '\0';
  string  = json_string(utf8);
  free(utf8);
  return string;
}

static json_t *side_json(const cli_report *report, remap_side side)
{
  const rcgns_info *info  = report->info[side];
  const int64_t     worst = report->stats.worst_inverted_cell[side];
  char              cell[256];

  return json_pack(
      "{s:o, s:I, s:I, s:o, s:o, s:o, s:o, s:I, s:o, s:o}", "file", words(info->path), "zones", (json_int_t)info->num_zones,
      "cells", (json_int_t)info->num_cells, "volume", real(report->stats.volume[side]), "volume_field",
      words(report->volume[side]), "solver_volume", real(report->stats.solver_volume[side]), "max_volume_difference",
      real(report->stats.max_volume_difference[side]), "inverted_cells", (json_int_t)report->stats.inverted_cells[side],
      "worst_inverted_cell", words(worst < 0 ? NULL : cell_words(info, worst, cell, sizeof cell)), "solution",
      words(report->solution[side]));
}

static json_t *overlap_json(const remap_stats *stats)
{
  static const char *const cover_word[3] = {"uncovered", "partial", "covered"};
  json_t                  *overlap       = json_object();
  char                     key[64];

  json_object_set_new(overlap, "pairs", json_integer((json_int_t)stats->pairs));
  json_object_set_new(overlap, "volume", real(stats->overlap_volume));
  for (int side = 0; side < 2; side++) {
    for (int cover = REMAP_COVERED; cover >= REMAP_UNCOVERED; cover--) {
      snprintf(key, sizeof key, "%s_%s", side_word[side], cover_word[cover]);
      json_object_set_new(overlap, key, json_integer((json_int_t)stats->cells_by_cover[side][cover]));
    }
    snprintf(key, sizeof key, "max_closure_error_%s", side_word[side]);
    json_object_set_new(overlap, key, real(stats->max_closure_error[side]));
    snprintf(key, sizeof key, "zone_overlap_%s", side_word[side]);
    json_object_set_new(overlap, key, real(stats->zone_overlap[side]));
  }
  return overlap;
}

/* A list of cells that are not wholly covered. */
static json_t *bare_json(const rcgns_info *info, int num, const remap_partial_cell *bare)
{
  json_t *list = json_array();
  char    cell[256];

  for (int i = 0; i < num; i++)
    json_array_append_new(list, json_pack("{s:o, s:o, s:o, s:[o, o, o]}", "cell",
                                          words(cell_words(info, bare[i].global_cell, cell, sizeof cell)), "coverage",
                                          real(bare[i].fraction), "volume", real(bare[i].volume), "centre",
                                          real(bare[i].centroid[0]), real(bare[i].centroid[1]), real(bare[i].centroid[2])));
  return list;
}

static json_t *cover_json(const cli_report *report, remap_side side)
{
  static const char *const word[4] = {"uncovered", "partial", "covered", "masked"};
  const cli_cover_row     *cover   = &report->cover[side];
  json_t                  *object  = json_object();

  json_object_set_new(object, "mask", words(report->mask[side]));
  for (int i = 3; i >= 0; i--)
    json_object_set_new(object, word[i],
                        json_pack("{s:I, s:o}", "cells", (json_int_t)cover->cells[i], "volume", real(cover->volume[i])));
  json_object_set_new(object, "too_little", json_integer((json_int_t)cover->num_too_little));
  json_object_set_new(object, "least_partial", bare_json(report->info[side], cover->num_partial, cover->partial));
  json_object_set_new(object, "largest_uncovered", bare_json(report->info[side], cover->num_uncovered, cover->uncovered));
  return object;
}

static json_t *field_json(const cli_field_row *row)
{
  const remap_field_report *what = &row->what;
  const json_int_t count[]       = {what->limited_cells,    what->order_reduced_cells, what->scaled_cells,  what->blended_cells,
                                    what->normalised_cells, what->kept_cells,          what->nearest_cells, what->filled_cells};
  static const char *const counted[] = {"limited_cells",    "order_reduced_cells", "scaled_cells",  "blended_cells",
                                        "normalised_cells", "kept_cells",          "nearest_cells", "filled_cells"};
  json_t                  *field;

  field = json_pack("{s:o, s:s, s:s, s:i, s:s, s:o, s:o, s:o, s:o, s:o, s:o, s:o}", "name", words(row->name), "nature",
                    cli_nature_word(row->nature), "weight", weight_word(row), "order", what->order, "limiter",
                    cli_limiter_word(row->limiter), "source_integral", real(what->source_integral), "target_integral",
                    real(what->target_integral), "conservation_error", real(what->conservation_error), "source_min",
                    real(what->source_min), "source_max", real(what->source_max), "target_min", real(what->target_min),
                    "target_max", real(what->target_max));
  for (size_t i = 0; i < sizeof count / sizeof *count; i++) json_object_set_new(field, counted[i], json_integer(count[i]));
  return field;
}

static json_t *check_json(const cli_report *report)
{
  json_t *list = json_array();

  for (int i = 0; i < report->num_checks; i++) {
    const cli_check_row *row = &report->check[i];

    json_array_append_new(list, json_pack("{s:s, s:o, s:o, s:b}", "name", row->name, "figure", real(row->figure), "bar",
                                          real(row->bar), "pass", cli_check_passes(row)));
  }
  return list;
}

static json_t *supermesh_json(const cli_supermesh_row *row)
{
  return json_pack("{s:o, s:I, s:o}", "file", words(row->path), "cells", (json_int_t)row->cells, "volume", real(row->volume));
}

/* The whole report; NULL if memory is out. The caller ends it with json_decref. */
static json_t *report_json(const cli_report *report)
{
  const remap_stats *stats  = &report->stats;
  json_t            *fields = json_array(), *notes = json_array(), *report_object;

  for (int i = 0; i < report->num_fields; i++) json_array_append_new(fields, field_json(&report->field[i]));
  for (int i = 0; i < report->num_notes; i++) json_array_append_new(notes, words(report->note[i]));
  report_object = json_pack(
      "{s:s, s:i, s:o, s:o, s:o, s:{s:o, s:o}, s:o, s:o, s:{s:o, s:o, s:o, s:o, s:o, s:o}, s:{s:I}, s:o}", "version",
      remap_version(), "ranks", stats->ranks, "source", side_json(report, REMAP_SOURCE), "target",
      side_json(report, REMAP_TARGET), "overlap", overlap_json(stats), "coverage", "source", cover_json(report, REMAP_SOURCE),
      "target", cover_json(report, REMAP_TARGET), "fields", fields, "check", check_json(report), "time", "read",
      real(report->seconds_read), "partition", real(stats->seconds_partition), "overlay", real(stats->seconds_overlay),
      "transfer", real(report->seconds_transfer), "write", real(report->seconds_write), "total", real(report->seconds_total),
      "memory", "peak_rss_bytes_max", (json_int_t)report->peak_rss, "notes", notes);
  if (report_object && report->supermesh.path)
    json_object_set_new(report_object, "supermesh", supermesh_json(&report->supermesh));
  return report_object;
}

/* ---- the file ----------------------------------------------------------------------------------------------------- */

/* What identifies the folder that path lies in; false if there is none. */
static bool folder_of(const char *path, struct stat *out)
{
  char      *copy = strdup(path);
  const bool ok   = copy && stat(dirname(copy), out) == 0;

  free(copy);
  return ok;
}

static const char *last_part(const char *path)
{
  const char *slash = strrchr(path, '/');

  return slash ? slash + 1 : path;
}

bool cli_is_same_file(const char *a, const char *b)
{
  struct stat sa, sb;

  if (stat(a, &sa) == 0 && stat(b, &sb) == 0) return sa.st_dev == sb.st_dev && sa.st_ino == sb.st_ino;
  return !strcmp(last_part(a), last_part(b)) && folder_of(a, &sa) && folder_of(b, &sb) && sa.st_dev == sb.st_dev &&
         sa.st_ino == sb.st_ino;
}

cli_exit cli_report_open(const char *path, int num_others, const char *const *others, cli_report_file *out, cli_failure *why)
{
  struct stat  there;
  const bool   exists = lstat(path, &there) == 0, in_place = exists && !S_ISREG(there.st_mode);
  const size_t size = strlen(path) + sizeof ".part";

  *out = (cli_report_file){.path = path};
  for (int i = 0; i < num_others; i++)
    if (cli_is_same_file(path, others[i]))
      return cli_fail(why, CLI_USAGE, "%s: it is used already: give --report another file", path);
  if (!in_place && !(out->part = malloc(size))) return cli_no_memory(why);
  if (out->part) snprintf(out->part, size, "%s.part", path);
  out->stream = fopen(in_place ? path : out->part, "w");
  if (!out->stream) {
    const int number = errno;

    free(out->part);
    out->part = NULL;
    return cli_fail(why, CLI_IO, "%s: the report cannot be written: %s: give --report another file", path, strerror(number));
  }
  return CLI_DONE;
}

void cli_report_discard(cli_report_file *file)
{
  if (file->stream) fclose(file->stream);
  if (file->part) unlink(file->part);
  free(file->part);
  *file = (cli_report_file){.path = file->path};
}

cli_exit cli_report_commit(cli_report_file *file, const cli_report *report, cli_failure *why)
{
  json_t *json = report_json(report);
  bool    ok;
  int     number;

  if (!json) {
    cli_report_discard(file);
    return cli_no_memory(why);
  }
  errno  = 0;
  ok     = json_dumpf(json, file->stream, JSON_INDENT(2) | JSON_REAL_PRECISION(17)) == 0 && fputc('\n', file->stream) != EOF;
  ok     = fclose(file->stream) == 0 && ok;
  ok     = ok && (!file->part || rename(file->part, file->path) == 0);
  number = errno;
  file->stream = NULL;
  json_decref(json);
  if (ok) { /* part is no longer there */
    free(file->part);
    file->part = NULL;
  }
  cli_report_discard(file);
  if (ok) return CLI_DONE;
  return cli_fail(why, CLI_IO, "%s: the report cannot be written: %s%s%s%s", file->path, strerror(number),
                  report->output ? "; " : "", report->output ? report->output : "",
                  report->output ? " is written and complete" : "");
}
