/* ship -- cells travel with their faces and nodes. For every destination the sender numbers what goes there anew; the receiver
 * sets the senders' parcels one after the other and shifts the numbers. Nodes and faces go once to each destination. O(n)
 * time; besides the product, memory for what is sent and for the cells and faces that arrive.
 *
 * The cells of a block are packed and put together in the same way, but stay on the rank: some from its own part of the mesh,
 * the others from what has arrived. */
#include "part/part_private.h"

#include <string.h>

/* A face and a cell under way; cells are numbered within the parcel. */
typedef struct wire_face {
  rm_lid  num_nodes;
  rm_lid  cell[2]; /* the loop's normal points out of cell[0] >= 0; cell[1] may be -1 */
  int32_t is_skin;
  rm_lid  home; /* the caller's number */
} wire_face;

typedef struct wire_cell {
  rm_gid  global;
  rm_lid  home; /* its number there */
  int32_t home_rank;
  double  volume, centroid[3];
} wire_cell;

/* A parcel for, or from, every rank, one after the other; each array is cut at its offsets:
 *
 *     parcel of rank      0              1        2 (empty)  3
 *     node     | 0 1 2 3 4 5 ... | 0 1 2 3 ... |  |  0 1 ...    numbered from 0 in each
 *     face     | corners and cells by those numbers | ...
 *
 * so that joining what arrives is adding the offset of a parcel's first node and cell. The offsets of cells stand beside it:
 * they are the route's on the way out. */
typedef struct parcels {
  int64_t   *node_offset, *face_offset, *corner_offset; /* [comm->size + 1]                             */
  double   (*node)[3];                                  /* [node_offset[comm->size]]                    */
  wire_face *face;                                      /* [face_offset[comm->size]]                    */
  rm_lid    *corner;                                    /* [corner_offset[comm->size]] node in the parcel */
  wire_cell *cell;
} parcels;

/* Where an entity of a mesh stands in the parcel that it came into last: in the present one if that has it there. Begins with
 * any numbers that are not negative. */
typedef struct places {
  rm_lid *of_node, *of_face, *of_cell;
} places;

struct rm_stock {
  const rm_mesh *mesh;
  int            rank;
  rm_piece       came; /* from other ranks */
  rm_mesh        view; /* the same as a mesh, as far as cells are packed from it */
  places         at;   /* scratch of rm_part_take */
};

/* What parcels are packed from: those of a block, BEFORE, OWN and AFTER, from a stock, others from a mesh. */
typedef struct packing {
  const rm_mesh  *mesh;
  const rm_stock *stock; /* NULL: there is none */
  int             rank;
  const rm_route *route;
  int             num_ranks;
  places          at;
  rm_arena       *kept; /* of nodes and corners */
  rm_lid         *face; /* [faces of all parcels] number in the mesh */
  rm_lid         *node; /* [nodes of all parcels]                    */
  parcels         out;
} packing;

/* The mesh from which parcel r is packed. */
static const rm_mesh *mesh_of(const packing *p, int r) { return p->stock && r != RM_OWN ? &p->stock->view : p->mesh; }

/* Number of nodes of a face of the mesh. */
static int64_t loop_length(const rm_mesh *mesh, rm_lid face)
{
  return mesh->face_offset[face + 1] - mesh->face_offset[face];
}

/* Is an entity in a parcel that lists num of its kind so far? */
static bool is_listed(const rm_lid *list, int64_t num, rm_lid place, rm_lid entity)
{
  return place < num && list[place] == entity;
}

static remap_status new_offsets(rm_arena *arena, int num_ranks, parcels *out)
{
  RM_NEW(out->node_offset, arena, (int64_t)num_ranks + 1);
  RM_NEW(out->face_offset, arena, (int64_t)num_ranks + 1);
  RM_NEW(out->corner_offset, arena, (int64_t)num_ranks + 1);
  return REMAP_OK;
}

/* The faces of every parcel, each once, and how many corners they have. */
static remap_status list_faces(rm_arena *scratch, packing *p)
{
  const rm_route *route = p->route;
  int64_t         most = 0, num = 0, num_corners = 0;

  for (int r = 0; r < p->num_ranks; r++)
    for (int64_t k = route->offset[r]; k < route->offset[r + 1]; k++) {
      const int64_t *offset = mesh_of(p, r)->cell_face_offset + route->cell[k];

      most += offset[1] - offset[0];
    }
  RM_NEW(p->face, scratch, most);
  for (int r = 0; r < p->num_ranks; r++) {
    const rm_mesh *mesh = mesh_of(p, r);

    p->out.face_offset[r]   = num;
    p->out.corner_offset[r] = num_corners;
    for (int64_t k = route->offset[r]; k < route->offset[r + 1]; k++)
      for (int64_t i = mesh->cell_face_offset[route->cell[k]]; i < mesh->cell_face_offset[route->cell[k] + 1]; i++) {
        const rm_lid f = mesh->cell_face[i];

        if (is_listed(p->face + p->out.face_offset[r], num - p->out.face_offset[r], p->at.of_face[f], f)) continue;
        p->at.of_face[f] = (rm_lid)(num - p->out.face_offset[r]);
        p->face[num++]      = f;
        num_corners += loop_length(mesh, f);
      }
  }
  p->out.face_offset[p->num_ranks]   = num;
  p->out.corner_offset[p->num_ranks] = num_corners;
  return REMAP_OK;
}

/* A mesh cell's number in rank r's parcel, -1 if it does not go there or is none. */
static rm_lid cell_in_parcel(const packing *p, int r, rm_lid cell)
{
  const int64_t first = p->route->offset[r], num = p->route->offset[r + 1] - first;

  return cell >= 0 && is_listed(p->route->cell + first, num, p->at.of_cell[cell], cell) ? p->at.of_cell[cell] : -1;
}

/* Write face f to rank r's parcel, its loop turned round if only the neighbour goes there. Nodes that are new to the parcel are
 * appended to its list, *num_nodes of all parcels so far. */
static void pack_face(packing *p, int r, rm_lid f, wire_face *face, rm_lid *corner, int64_t *num_nodes)
{
  const rm_mesh *mesh  = mesh_of(p, r);
  const rm_lid   owner = cell_in_parcel(p, r, mesh->face_cell[f][0]);
  const rm_lid   other = cell_in_parcel(p, r, mesh->face_cell[f][1]);
  const rm_lid  *loop  = mesh->face_node + mesh->face_offset[f];
  const rm_lid   num   = (rm_lid)loop_length(mesh, f);
  const int64_t  first = p->out.node_offset[r];

  RM_ASSERT(owner >= 0 || other >= 0);
  face->num_nodes = num;
  face->cell[0]   = owner >= 0 ? owner : other;
  face->cell[1]   = owner >= 0 ? other : -1;
  face->is_skin   = mesh->face_is_skin[f];
  face->home      = rm_given_face(mesh, f);
  for (rm_lid i = 0; i < num; i++) {
    const rm_lid node = loop[owner >= 0 ? i : num - 1 - i];

    if (!is_listed(p->node + first, *num_nodes - first, p->at.of_node[node], node)) {
      p->at.of_node[node]  = (rm_lid)(*num_nodes - first);
      p->node[(*num_nodes)++] = node;
    }
    corner[i] = p->at.of_node[node];
  }
}

/* Write a mesh cell to rank r's parcel. */
static void pack_cell(const packing *p, int r, rm_lid c, wire_cell *cell)
{
  const rm_mesh *mesh = mesh_of(p, r);
  const bool     came = mesh != p->mesh;

  cell->global    = mesh->cell_global[c];
  cell->home      = came ? p->stock->came.cell_home[c] : c;
  cell->home_rank = came ? p->stock->came.cell_home_rank[c] : p->rank;
  cell->volume    = mesh->cell_volume[c];
  memcpy(cell->centroid, mesh->cell_centroid[c], sizeof cell->centroid);
}

/* The cells, faces and corners of every parcel, and its list of nodes. */
static remap_status pack_entities(rm_arena *scratch, packing *p)
{
  parcels      *out       = &p->out;
  const int64_t num_cells = p->route->offset[p->num_ranks], num_corners = out->corner_offset[p->num_ranks];
  int64_t       num_nodes = 0;

  RM_NEW(out->cell, scratch, num_cells);
  RM_NEW(out->face, scratch, out->face_offset[p->num_ranks]);
  RM_NEW(out->corner, p->kept, num_corners);
  RM_NEW(p->node, scratch, num_corners);
  for (int r = 0; r < p->num_ranks; r++) {
    int64_t corner = out->corner_offset[r];

    out->node_offset[r] = num_nodes;
    for (int64_t k = p->route->offset[r]; k < p->route->offset[r + 1]; k++) {
      p->at.of_cell[p->route->cell[k]] = (rm_lid)(k - p->route->offset[r]);
      pack_cell(p, r, p->route->cell[k], &out->cell[k]);
    }
    for (int64_t i = out->face_offset[r]; i < out->face_offset[r + 1]; i++) {
      pack_face(p, r, p->face[i], &out->face[i], out->corner + corner, &num_nodes);
      corner += out->face[i].num_nodes;
    }
    RM_ASSERT(corner == out->corner_offset[r + 1]);
  }
  out->node_offset[p->num_ranks] = num_nodes;
  return REMAP_OK;
}

static rm_lid larger(rm_lid a, rm_lid b) { return a > b ? a : b; }

/* Places for entities of either of two meshes. */
static remap_status new_places(rm_arena *arena, const rm_mesh *a, const rm_mesh *b, places *out)
{
  RM_NEW0(out->of_node, arena, larger(a->num_nodes, b->num_nodes));
  RM_NEW0(out->of_face, arena, larger(a->num_faces, b->num_faces));
  RM_NEW0(out->of_cell, arena, larger(a->num_cells, b->num_cells));
  return REMAP_OK;
}

/* Fill all parcels. Not collective. */
static remap_status pack(rm_arena *scratch, packing *p)
{
  RM_TRY(new_offsets(scratch, p->num_ranks, &p->out));
  RM_TRY(list_faces(scratch, p));
  RM_TRY(pack_entities(scratch, p));
  RM_NEW(p->out.node, p->kept, p->out.node_offset[p->num_ranks]);
  for (int r = 0; r < p->num_ranks; r++)
    for (int64_t i = p->out.node_offset[r]; i < p->out.node_offset[r + 1]; i++)
      memcpy(p->out.node[i], mesh_of(p, r)->node_xyz[p->node[i]], sizeof p->out.node[i]);
  return REMAP_OK;
}

/* Send and receive all parcels. Nodes and corners arrive where they stay. Collective. */
static remap_status exchange(rm_arena *arena, rm_arena *scratch, const rm_comm *comm, const rm_route *route, const parcels *out,
                             parcels *in, int64_t *in_cell_offset)
{
  void *node, *corner, *face, *cell;

  RM_TRY(rm_comm_exchange(comm, arena, sizeof *out->node, out->node_offset, out->node, in->node_offset, &node));
  RM_TRY(rm_comm_exchange(comm, arena, sizeof *out->corner, out->corner_offset, out->corner, in->corner_offset, &corner));
  RM_TRY(rm_comm_exchange(comm, scratch, sizeof *out->face, out->face_offset, out->face, in->face_offset, &face));
  RM_TRY(rm_comm_exchange(comm, scratch, sizeof *out->cell, route->offset, out->cell, in_cell_offset, &cell));
  in->node   = node;
  in->corner = corner;
  in->face   = face;
  in->cell   = cell;
  return REMAP_OK;
}

/* The faces of a piece. Corners are shifted in place. */
static remap_status join_faces(rm_arena *arena, int num_ranks, const parcels *in, const int64_t *cell_offset, rm_piece *piece)
{
  const int64_t num = in->face_offset[num_ranks];
  int64_t      *face_offset;
  rm_lid      (*face_cell)[2];
  uint8_t      *face_is_skin;
  rm_lid       *face_home;

  RM_NEW(face_offset, arena, num + 1);
  RM_NEW(face_cell, arena, num);
  RM_NEW(face_is_skin, arena, num);
  RM_NEW(face_home, arena, num);
  face_offset[0] = 0;
  for (int r = 0; r < num_ranks; r++) {
    const rm_lid first_node = (rm_lid)in->node_offset[r], first_cell = (rm_lid)cell_offset[r];

    for (int64_t i = in->face_offset[r]; i < in->face_offset[r + 1]; i++) {
      const wire_face *face = &in->face[i];

      face_offset[i + 1] = face_offset[i] + face->num_nodes;
      face_cell[i][0]    = first_cell + face->cell[0];
      face_cell[i][1]    = face->cell[1] < 0 ? -1 : first_cell + face->cell[1];
      face_is_skin[i]    = (uint8_t)face->is_skin;
      face_home[i]       = face->home;
    }
    for (int64_t i = in->corner_offset[r]; i < in->corner_offset[r + 1]; i++) in->corner[i] += first_node;
  }
  RM_ASSERT(face_offset[num] == in->corner_offset[num_ranks]);
  piece->num_faces    = (rm_lid)num;
  piece->face_offset  = face_offset;
  piece->face_node    = in->corner;
  piece->face_cell    = (const rm_lid(*)[2])face_cell;
  piece->face_is_skin = face_is_skin;
  piece->face_home    = face_home;
  return REMAP_OK;
}

/* The cells of a piece, taken apart into its arrays. */
static remap_status join_cells(rm_arena *arena, int64_t num, const wire_cell *cell, rm_piece *piece)
{
  rm_gid       *global;
  int          *home_rank;
  rm_lid       *home;
  double       *volume, (*centroid)[3];

  RM_NEW(global, arena, num);
  RM_NEW(home_rank, arena, num);
  RM_NEW(home, arena, num);
  RM_NEW(volume, arena, num);
  RM_NEW(centroid, arena, num);
  for (int64_t k = 0; k < num; k++) {
    global[k]    = cell[k].global;
    home_rank[k] = cell[k].home_rank;
    home[k]      = cell[k].home;
    volume[k]    = cell[k].volume;
    memcpy(centroid[k], cell[k].centroid, sizeof centroid[k]);
  }
  piece->num_cells      = (rm_lid)num;
  piece->cell_global    = global;
  piece->cell_home_rank = home_rank;
  piece->cell_home      = home;
  piece->cell_volume    = volume;
  piece->cell_centroid  = (const double(*)[3])centroid;
  return REMAP_OK;
}

/* Not collective. The piece that the parcels make together. */
static remap_status join(rm_arena *arena, int num_ranks, remap_side side, const parcels *in, const int64_t *cell_offset,
                         rm_piece *piece, rm_reason *reason)
{
  const int64_t nodes = in->node_offset[num_ranks], faces = in->face_offset[num_ranks], cells = cell_offset[num_ranks];

  if (nodes > INT32_MAX || faces > INT32_MAX || cells > INT32_MAX)
    return rm_fail(REMAP_TOO_LARGE, reason, (int)side, -1,
                   "%lld cells, %lld faces and %lld nodes come to one rank, which can number 2^31 - 1 of each; use more ranks",
                   (long long)cells, (long long)faces, (long long)nodes);
  piece->num_nodes = (rm_lid)nodes;
  piece->node_xyz  = (const double(*)[3])in->node;
  RM_TRY(join_faces(arena, num_ranks, in, cell_offset, piece));
  return join_cells(arena, cells, in->cell, piece);
}

/* Pack, and make room for the offsets of what arrives. Not collective. */
static remap_status prepare(rm_arena *scratch, packing *p, parcels *in, int64_t **in_cell_offset)
{
  RM_TRY(new_offsets(scratch, p->num_ranks, in));
  RM_NEW(*in_cell_offset, scratch, (int64_t)p->num_ranks + 1);
  RM_TRY(new_places(scratch, p->mesh, p->mesh, &p->at));
  p->kept = scratch;
  return pack(scratch, p);
}

remap_status rm_part_ship(rm_arena *arena, rm_arena *scratch, const rm_comm *comm, const rm_mesh *mesh, const rm_route *route,
                          rm_piece *out, rm_reason *reason)
{
  packing            p              = {.mesh = mesh, .rank = comm->rank, .route = route, .num_ranks = comm->size};
  parcels            in             = {0};
  rm_piece           piece          = {0};
  int64_t           *in_cell_offset = NULL;
  const remap_status mine           = prepare(scratch, &p, &in, &in_cell_offset);

  RM_TRY(rm_comm_agree(comm, mine, NULL));
  RM_ASSERT(mine == REMAP_OK);
  RM_TRY(exchange(arena, scratch, comm, route, &p.out, &in, in_cell_offset));
  RM_TRY(rm_comm_agree_reason(comm, join(arena, comm->size, mesh->side, &in, in_cell_offset, &piece, reason), reason));
  *out = piece;
  return REMAP_OK;
}

/* ---- blocks ------------------------------------------------------------------------------------------------------- */

/* What came as a mesh: the faces of every cell, besides what a piece has. */
static remap_status view_as_mesh(rm_arena *arena, remap_side side, const rm_piece *p, rm_mesh *out)
{
  int64_t *offset;
  rm_lid  *list;

  RM_NEW0(offset, arena, (int64_t)p->num_cells + 2);
  for (rm_lid f = 0; f < p->num_faces; f++)
    for (int h = 0; h < 2; h++)
      if (p->face_cell[f][h] >= 0) offset[p->face_cell[f][h] + 2]++;
  for (rm_lid c = 0; c < p->num_cells; c++) offset[c + 2] += offset[c + 1];
  RM_NEW(list, arena, offset[p->num_cells + 1]);
  for (rm_lid f = 0; f < p->num_faces; f++)
    for (int h = 0; h < 2; h++)
      if (p->face_cell[f][h] >= 0) list[offset[p->face_cell[f][h] + 1]++] = f;
  *out = (rm_mesh){.side             = side,
                   .num_nodes        = p->num_nodes,
                   .num_faces        = p->num_faces,
                   .num_cells        = p->num_cells,
                   .node_xyz         = p->node_xyz,
                   .face_offset      = p->face_offset,
                   .face_node        = p->face_node,
                   .face_cell        = p->face_cell,
                   .face_is_skin     = p->face_is_skin,
                   .face_given       = p->face_home,
                   .cell_face_offset = offset,
                   .cell_face        = list,
                   .cell_global      = p->cell_global,
                   .cell_volume      = p->cell_volume,
                   .cell_centroid    = p->cell_centroid};
  return REMAP_OK;
}

remap_status rm_part_send(rm_arena *arena, const rm_comm *comm, const rm_mesh *mesh, const rm_routes *routes,
                          const rm_stock **out, rm_reason *reason)
{
  rm_arena    *scratch = rm_arena_new();
  rm_stock    *stock   = rm_arena_zero(arena, 1, sizeof *stock);
  remap_status status;

  RM_GOTO(done, status = rm_comm_agree(comm, scratch && stock ? REMAP_OK : REMAP_NO_MEMORY, NULL));
  RM_ASSERT(scratch && stock);
  stock->mesh = mesh;
  stock->rank = comm->rank;
  RM_GOTO(done, status = rm_part_ship(arena, scratch, comm, mesh, &routes->of[mesh->side], &stock->came, reason));
  RM_ASSERT(stock->came.num_cells == routes->num_came[mesh->side]);
  status = view_as_mesh(arena, mesh->side, &stock->came, &stock->view);
  if (status == REMAP_OK) status = new_places(arena, mesh, &stock->view, &stock->at);
  status = rm_comm_agree(comm, status, NULL);
  *out   = stock;
done:
  rm_arena_drop(scratch);
  return status;
}

/* What a list says of a stock's cells. */
static remap_status pack_block(rm_arena *arena, rm_arena *scratch, const rm_stock *stock, const rm_route *list, rm_piece *out,
                               rm_reason *reason)
{
  packing p = {.mesh = stock->mesh, .stock = stock, .rank = stock->rank, .route = list, .num_ranks = RM_SHARES,
               .at = stock->at, .kept = arena};

  RM_TRY(pack(scratch, &p));
  return join(arena, RM_SHARES, stock->mesh->side, &p.out, list->offset, out, reason);
}

remap_status rm_part_take(rm_arena *arena, const rm_routes *routes, const rm_stock *stock, int block, rm_piece *out,
                          rm_reason *reason)
{
  const int    side    = (int)stock->mesh->side;
  rm_arena    *scratch = rm_arena_new();
  rm_piece     piece   = {0};
  remap_status status  = REMAP_NO_MEMORY;

  if (scratch) status = pack_block(arena, scratch, stock, &routes->block[block].list[side], &piece, reason);
  piece.cell_role = routes->block[block].role[side];
  *out            = piece;
  rm_arena_drop(scratch);
  return status;
}
