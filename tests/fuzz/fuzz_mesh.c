/* Any arrays that keep to their documented lengths are refused with a reason, or overlaid; nothing crashes, hangs or reads past
 * an array. The bytes choose a small mesh and damage it: coordinates, corners, offsets, cells, ids, zones, counts. Arrays are
 * handed over in exactly their documented lengths, so that the address sanitizer sees what is read beyond. */
#include "fuzz.h"
#include "meshes.h"

enum {
  FEW        = 8,      /* values of a palette              */
  MOST_ITEMS = 100000  /* in an array that is handed over  */
};

/* ---- the mesh -------------------------------------------------------------------------------------------------------- */

static tm_mesh *base_mesh(fuzz_bytes *b)
{
  static tm_mesh *(*const maker[])(const int n[3], tm_map map, const void *data) = {tm_hexahedra, tm_tetrahedra, tm_prisms,
                                                                                     tm_pyramids,  tm_dual,       tm_mixed};
  const int num = (int)(sizeof maker / sizeof *maker), which = (int)fuzz_below(b, num + 3);
  const int n[3] = {1 + (int)fuzz_below(b, 2), 1 + (int)fuzz_below(b, 2), 1 + (int)fuzz_below(b, 2)};

  if (which < num) return maker[which](n, NULL, NULL);
  if (which == num) return tm_refined((int[]){2, 1, 1}, tm_right_half, NULL, NULL);
  if (which == num + 1) return tm_two_zones(n, (int[]){1, 2, 1}, 0.25 * (double)(fuzz_below(b, 3) - 1), NULL, NULL);
  return tm_new_(fuzz_below(b, 20), fuzz_below(b, 20), 60, fuzz_below(b, 8)); /* all zeros */
}

static double coordinate(fuzz_bytes *b)
{
  static const double palette[FEW] = {0.0, 1.0, 0.5, 0.25, -1.0, 0x1p-60, 1e300, 0x1p-1074};
  const int64_t       choice       = fuzz_below(b, FEW + 4);

  if (choice < FEW) return palette[choice];
  return choice == FEW ? fuzz_double(b) : (double)fuzz_below(b, 16) / 8 - 0.5;
}

/* An index that is mostly valid, sometimes just outside, sometimes far. */
static int64_t an_index(fuzz_bytes *b, int64_t end)
{
  const int64_t index = fuzz_below(b, end + 4) - 2;

  return index == end + 1 ? fuzz_int64(b) : index;
}

static void turn_over(tm_mesh *m, int64_t face)
{
  for (int64_t i = m->face_offset[face], k = m->face_offset[face + 1] - 1; i < k; i++, k--) {
    const int64_t node = m->face_node[i];

    m->face_node[i] = m->face_node[k];
    m->face_node[k] = node;
  }
}

/* A count as it stands, but nothing that is too much to allot and would yet be believed. */
static int64_t credible(int64_t count) { return count > MOST_ITEMS && count <= INT32_MAX ? INT64_MAX : count; }

/* How many of each the mesh was made with: damage stays inside its arrays. */
typedef struct sizes {
  int64_t nodes, faces, corners, cells, zones;
} sizes;

static void damage_points(tm_mesh *m, const sizes *n, fuzz_bytes *b)
{
  const int64_t v = fuzz_below(b, n->nodes), w = fuzz_below(b, n->nodes);
  double        factor;

  if (!n->nodes) return;
  switch (fuzz_below(b, 4)) {
    case 0: m->xyz[3 * v + fuzz_below(b, 3)] = coordinate(b); break;
    case 1: memcpy(m->xyz + 3 * v, m->xyz + 3 * w, 3 * sizeof(double)); break;
    case 2:
      for (int64_t i = fuzz_below(b, 3), x = 0; x < n->nodes; x++) m->xyz[3 * x + i] = m->xyz[3 * v + i];
      break;
    default:
      factor = ldexp(1.0, (int)fuzz_below(b, 2100) - 1050);
      for (int64_t i = 0; i < 3 * n->nodes; i++) m->xyz[i] *= factor;
      break;
  }
}

static void damage_faces(tm_mesh *m, const sizes *n, fuzz_bytes *b)
{
  const int64_t f = fuzz_below(b, n->faces), g = fuzz_below(b, n->faces), i = fuzz_below(b, n->corners);

  if (!n->faces || !n->corners) return;
  switch (fuzz_below(b, 7)) {
    case 0: m->face_node[i] = an_index(b, n->nodes); break;
    case 1: m->face_offset[f + 1] = an_index(b, n->corners); break;
    case 2: m->face_offset[f] += fuzz_below(b, 3) - 1; break;
    case 3: m->owner[f] = an_index(b, n->cells); break;
    case 4: m->neighbour[f] = an_index(b, n->cells); break;
    case 5:
      if (m->face_offset[f] >= 0 && m->face_offset[f + 1] <= n->corners) turn_over(m, f);
      break;
    default:
      m->owner[f]     = m->owner[g];
      m->neighbour[f] = m->neighbour[g];
      break;
  }
}

static void damage_the_rest(tm_mesh *m, const sizes *n, fuzz_bytes *b)
{
  remap_mesh *view = &m->view;

  switch (fuzz_below(b, 9)) {
    case 0:
      if (n->cells) m->global[fuzz_below(b, n->cells)] = an_index(b, n->cells);
      break;
    case 1: view->cell_global = NULL; break;
    case 2: view->num_cells = credible(an_index(b, n->cells)); break;
    case 3: view->num_faces = credible(an_index(b, n->faces)); break;
    case 4: view->num_nodes = credible(an_index(b, n->nodes)); break;
    case 5:
      if (n->zones) m->zone_offset[fuzz_below(b, n->zones + 1)] = an_index(b, n->cells);
      break;
    case 6:
      if (n->zones) m->zone_name[fuzz_below(b, n->zones)] = fuzz_below(b, 2) ? NULL : "";
      break;
    case 7: view->num_zones = fuzz_below(b, n->zones + 2) - 1; break;
    default:
      switch (fuzz_below(b, 7)) {
        case 0: view->node_xyz = NULL; break;
        case 1: view->face_offset = NULL; break;
        case 2: view->face_node = NULL; break;
        case 3: view->face_owner = NULL; break;
        case 4: view->face_neighbour = NULL; break;
        case 5: view->zone_name = NULL; break;
        default: view->zone_cell_offset = NULL; break;
      }
  }
}

/* A copy of `count` of `from`'s `have` items (zeros beyond), malloc'ed to exactly that length; NULL stays NULL. Counts that
 * cannot be meant get no items: they are refused before anything is read. */
static const void *tight(const void *from, int64_t have, int64_t count, size_t size)
{
  const int64_t items = count < 0 || count > MOST_ITEMS ? 0 : count;
  char         *copy;

  if (!from) return NULL;
  copy = malloc((size_t)items * size);
  if (!copy && items) abort();
  if (!copy) return malloc(1);
  memset(copy, 0, (size_t)items * size);
  memcpy(copy, from, (size_t)(have < items ? have : items) * size);
  return copy;
}

/* The damaged mesh in exact lengths. What is borrowed from it belongs to the caller: let_go. */
static remap_mesh exact(const tm_mesh *m, const sizes *n)
{
  const remap_mesh *v    = &m->view;
  remap_mesh        mesh = *v;
  const int64_t     last = v->num_faces >= 0 && v->num_faces <= n->faces ? m->face_offset[v->num_faces] : 0;

  mesh.node_xyz         = tight(v->node_xyz, n->nodes, v->num_nodes, 3 * sizeof(double));
  mesh.face_offset      = tight(v->face_offset, n->faces + 1, v->num_faces < INT64_MAX ? v->num_faces + 1 : 0, sizeof(int64_t));
  mesh.face_node        = tight(v->face_node, n->corners, last, sizeof(int64_t));
  mesh.face_owner       = tight(v->face_owner, n->faces, v->num_faces, sizeof(int64_t));
  mesh.face_neighbour   = tight(v->face_neighbour, n->faces, v->num_faces, sizeof(int64_t));
  mesh.cell_global      = tight(v->cell_global, n->cells, v->num_cells, sizeof(int64_t));
  mesh.zone_name        = tight((const void *)v->zone_name, n->zones, v->num_zones, sizeof(char *));
  mesh.zone_cell_offset = tight(v->zone_cell_offset, n->zones + 1, v->num_zones + 1, sizeof(int64_t));
  return mesh;
}

static void let_go(const remap_mesh *mesh)
{
  free((void *)mesh->node_xyz);
  free((void *)mesh->face_offset);
  free((void *)mesh->face_node);
  free((void *)mesh->face_owner);
  free((void *)mesh->face_neighbour);
  free((void *)mesh->cell_global);
  free((void *)mesh->zone_name);
  free((void *)mesh->zone_cell_offset);
}

static tm_mesh *damaged(fuzz_bytes *b, sizes *n)
{
  tm_mesh *m = base_mesh(b);

  *n = (sizes){m->view.num_nodes, m->view.num_faces, m->face_offset[m->view.num_faces], m->view.num_cells, m->view.num_zones};
  for (int i = 0; i < 40 && b->left; i++) {
    switch (fuzz_below(b, 4)) {
      case 0:
      case 1: damage_points(m, n, b); break;
      case 2: damage_faces(m, n, b); break;
      default: damage_the_rest(m, n, b); break;
    }
  }
  return m;
}

/* ---- what must hold -------------------------------------------------------------------------------------------------- */

/* Everything that a built context hands out can be had. */
static void use(remap_context *ctx, const remap_mesh mesh[2])
{
  remap_transfer   how;
  remap_stats      stats;
  remap_pairs_view pairs;

  FUZZ_CHECK(remap_get_stats(ctx, &stats) == REMAP_OK);
  remap_transfer_default(&how);
  for (int d = 0; d < 2; d++) {
    const int64_t      num_in = mesh[d].num_cells, num_out = mesh[1 - d].num_cells;
    double            *in = tm_alloc_(num_in, sizeof *in), *out = tm_alloc_(4 * num_out, sizeof *out);
    remap_cover       *cover = tm_alloc_(num_out, sizeof *cover);
    remap_field_desc   field = {.name = "f", .nature = REMAP_CONSERVED, .in = in, .out = out};
    remap_field_report report;
    remap_status       status;

    for (int64_t c = 0; c < num_in; c++) in[c] = 1.0 + (double)(c % 3);
    FUZZ_CHECK(remap_pairs(ctx, (remap_direction)d, &pairs) == REMAP_OK && pairs.num_rows == num_out);
    FUZZ_CHECK(remap_coverage(ctx, (remap_side)(1 - d), out, cover) == REMAP_OK);
    FUZZ_CHECK(remap_cells(ctx, (remap_side)(1 - d), out, out + num_out) == REMAP_OK);
    status = remap_field(ctx, (remap_direction)d, &how, 1, &field, &report);
    FUZZ_CHECK(status == REMAP_OK || status == REMAP_COVERAGE);
    free(in);
    free(out);
    free(cover);
  }
}

void fuzz_one(const uint8_t *data, size_t size)
{
  fuzz_bytes     b      = {data, size};
  const int64_t  choice = fuzz_byte(&b);
  const int      side   = choice & 1;
  tm_mesh       *fixed  = choice & 2 ? tm_tetrahedra((int[]){1, 1, 1}, NULL, NULL)
                                     : tm_hexahedra((int[]){2, 1, 2}, tm_warp, &(tm_warping){0.03, 0.7});
  sizes          n;
  tm_mesh       *m       = damaged(&b, &n);
  remap_mesh     mesh[2] = {fixed->view, fixed->view};
  remap_context *ctx     = NULL;
  remap_options  options;
  remap_status   status;

  mesh[side] = exact(m, &n);
  remap_options_default(&options);
  options.faces                 = choice & 4 ? REMAP_FACES_DIAGONAL : REMAP_FACES_CENTRE;
  options.zone_overlap_is_error = choice >> 3 & 1;
  FUZZ_CHECK(remap_create(MPI_COMM_SELF, &options, &ctx) == REMAP_OK);
  for (int s = 0; s < 2; s++) FUZZ_CHECK(remap_set_mesh(ctx, (remap_side)s, &mesh[s]) == REMAP_OK);
  status = remap_build(ctx);
  FUZZ_CHECK(status == REMAP_OK || status == REMAP_BAD_MESH || status == REMAP_ZONE_OVERLAP || status == REMAP_TOO_LARGE);
  FUZZ_CHECK((status == REMAP_OK) == (remap_message(ctx)[0] == 0));
  if (status == REMAP_OK) {
    fuzz_accepted++;
    use(ctx, mesh);
  }
  remap_destroy(&ctx);
  let_go(&mesh[side]);
  tm_free(m);
  tm_free(fixed);
}
FUZZ_MAIN
