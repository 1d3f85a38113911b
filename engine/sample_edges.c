/* Creases and patches of a surface, and the points on its creases.
 *
 * A side of a triangle is a crease where the surface is open, branches or turns by more than 30 degrees, and
 * along the border of large flat rectangles, which are found first. Creases join to chains, which end where
 * three or more meet or where they turn by more than 30 degrees; each chain is divided evenly along its
 * length, so that both of its faces see the same points. What creases enclose is a patch. */
#include "sample_parts.h"

#include <inttypes.h>
#include <stdlib.h>
#include <string.h>

static const double crease_cosine = 0.86602540378443865; /* of 30 degrees */
static const double large_rectangle = 4.0;               /* spacings, shorter side */

static void corner_position(const Mesh *mesh, uint32_t triangle, int corner, double out[3]) {
    dvec_from_float(out, mesh->vertices[mesh->triangles[triangle][corner % 3]]);
}

/* ---- Flat groups and the rectangles among them ---- */

typedef struct Groups {
    uint32_t *of;      /* group of each triangle */
    uint32_t *members; /* triangles, those of a group next to each other */
    uint32_t *stack;
    uint32_t member_count, count;
} Groups;

/* Collects the triangles that are connected to `seed` and lie in its plane. */
static void flood_plane(const Sampler *sampler, Groups *groups, uint32_t seed) {
    const double *normal = sampler->normals[seed];
    const double flat = 1e-3 * sampler->spacing;
    double origin[3];
    corner_position(sampler->mesh, seed, 0, origin);
    uint32_t depth = 0;
    groups->of[seed] = groups->count;
    groups->stack[depth++] = seed;
    while (depth > 0) {
        uint32_t t = groups->stack[--depth];
        groups->members[groups->member_count++] = t;
        for (int k = 0; k < 3; k++) {
            uint32_t next = sampler->neighbours[t][k];
            if (next == SAMPLE_NONE || groups->of[next] != SAMPLE_NONE ||
                dvec_dot(sampler->normals[next], normal) < 0.99)
                continue;
            bool coplanar = true;
            for (int c = 0; c < 3; c++) {
                double arm[3];
                corner_position(sampler->mesh, next, c, arm);
                dvec_sub(arm, arm, origin);
                coplanar = coplanar && fabs(dvec_dot(arm, normal)) < flat;
            }
            if (!coplanar)
                continue;
            groups->of[next] = groups->count;
            groups->stack[depth++] = next;
        }
    }
    groups->count++;
}

static bool is_border(const Sampler *sampler, const Groups *groups, uint32_t t, int k) {
    uint32_t next = sampler->neighbours[t][k];
    return next == SAMPLE_NONE || groups->of[next] != groups->of[t];
}

/* The bounds of a group along its longest border side and across it. */
static bool bound_group(const Sampler *sampler, const Groups *groups, uint32_t first, uint32_t end,
                        Rectangle *out) {
    double longest_sq = 0.0, low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY};
    for (uint32_t i = first; i < end; i++) {
        for (int k = 0; k < 3; k++) {
            uint32_t t = groups->members[i];
            double a[3], side[3];
            if (!is_border(sampler, groups, t, k))
                continue;
            corner_position(sampler->mesh, t, k, a);
            corner_position(sampler->mesh, t, k + 1, side);
            dvec_sub(side, side, a);
            if (dvec_dot(side, side) > longest_sq * (1.0 + 1e-6)) {
                longest_sq = dvec_dot(side, side);
                dvec_copy(out->u, side);
                dvec_copy(out->origin, a);
            }
        }
    }
    if (!(longest_sq > 0.0))
        return false;
    dvec_normalize(out->u);
    dvec_cross(out->v, sampler->normals[groups->members[first]], out->u);
    dvec_normalize(out->v);
    for (uint32_t i = first; i < end; i++) {
        for (int k = 0; k < 3; k++) {
            double arm[3];
            corner_position(sampler->mesh, groups->members[i], k, arm);
            dvec_sub(arm, arm, out->origin);
            double at[2] = {dvec_dot(arm, out->u), dvec_dot(arm, out->v)};
            for (int axis = 0; axis < 2; axis++) {
                low[axis] = fmin(low[axis], at[axis]);
                high[axis] = fmax(high[axis], at[axis]);
            }
        }
    }
    dvec_add_scaled(out->origin, out->origin, low[0], out->u);
    dvec_add_scaled(out->origin, out->origin, low[1], out->v);
    out->size[0] = high[0] - low[0];
    out->size[1] = high[1] - low[1];
    return true;
}

/* True if a flat group fills a rectangle: its area is that of its bounds. */
static bool find_rectangle(const Sampler *sampler, const Groups *groups, uint32_t first, uint32_t end,
                           Rectangle *out) {
    double area = 0.0;
    if (!bound_group(sampler, groups, first, end, out))
        return false;
    for (uint32_t i = first; i < end; i++) {
        double corners[3][3];
        for (int k = 0; k < 3; k++)
            corner_position(sampler->mesh, groups->members[i], k, corners[k]);
        area += sample_polygon_area(corners, 3);
    }
    double tolerance = 1e-3 * sampler->spacing;
    return fabs(area - out->size[0] * out->size[1]) <= tolerance * (out->size[0] + out->size[1]);
}

static double side_cosine(const Sampler *sampler, uint32_t t, int k) {
    uint32_t next = sampler->neighbours[t][k];
    return next == SAMPLE_NONE ? -1.0 : dvec_dot(sampler->normals[t], sampler->normals[next]);
}

/* Decides whether a rectangle becomes a patch, and if so makes its border a crease on both sides. */
static bool claim_rectangle(Sampler *sampler, const Groups *groups, uint32_t first, uint32_t end,
                            const Rectangle *rectangle) {
    bool large = fmin(rectangle->size[0], rectangle->size[1]) >= large_rectangle * sampler->spacing,
         sharp = true;
    for (uint32_t i = first; i < end && !large; i++)
        for (int k = 0; k < 3; k++)
            if (is_border(sampler, groups, groups->members[i], k))
                sharp = sharp && (sampler->creases[groups->members[i]] >> k & 1 ||
                                  side_cosine(sampler, groups->members[i], k) < crease_cosine);
    if (!large && !sharp)
        return false;
    for (uint32_t i = first; i < end; i++) {
        for (int k = 0; k < 3; k++) {
            uint32_t t = groups->members[i], next = sampler->neighbours[t][k];
            if (!is_border(sampler, groups, t, k))
                continue;
            sampler->creases[t] |= (uint8_t)(1u << k);
            for (int c = 0; c < 3 && next != SAMPLE_NONE; c++)
                if (sampler->neighbours[next][c] == t &&
                    sampler->mesh->triangles[next][c] == sampler->mesh->triangles[t][(k + 1) % 3])
                    sampler->creases[next] |= (uint8_t)(1u << c);
        }
    }
    return true;
}

static bool add_rectangle(Sampler *sampler, const Rectangle *rectangle) {
    uint32_t count = sampler->rectangle_count;
    if ((count & (count - 1)) == 0) { /* full at every power of two */
        Rectangle *grown = realloc(sampler->rectangles, 2 * ((size_t)count + 1) * sizeof *grown);
        if (!grown)
            return false;
        sampler->rectangles = grown;
    }
    sampler->rectangles[sampler->rectangle_count++] = *rectangle;
    return true;
}

/* Groups, rectangles, and the creases these ask for. The rectangles' triangles get their patches. */
static bool find_rectangles(Sampler *sampler, Groups *groups) {
    uint32_t count = sampler->mesh->triangle_count;
    memset(groups->of, 0xff, count * sizeof *groups->of);
    memset(sampler->patches, 0xff, count * sizeof *sampler->patches);
    for (uint32_t t = 0; t < count; t++) {
        uint32_t first = groups->member_count;
        Rectangle rectangle;
        if (groups->of[t] != SAMPLE_NONE)
            continue;
        flood_plane(sampler, groups, t);
        if (!find_rectangle(sampler, groups, first, groups->member_count, &rectangle) ||
            !claim_rectangle(sampler, groups, first, groups->member_count, &rectangle))
            continue;
        for (uint32_t i = first; i < groups->member_count; i++)
            sampler->patches[groups->members[i]] = sampler->rectangle_count;
        if (!add_rectangle(sampler, &rectangle))
            return false;
    }
    return true;
}

/* ---- Patches ---- */

static void find_patches(Sampler *sampler, uint32_t *stack) {
    uint32_t count = sampler->mesh->triangle_count;
    for (uint32_t t = 0; t < count; t++)
        for (int k = 0; k < 3; k++)
            if (side_cosine(sampler, t, k) < crease_cosine)
                sampler->creases[t] |= (uint8_t)(1u << k);
    sampler->patch_count = sampler->rectangle_count;
    for (uint32_t seed = 0; seed < count; seed++) {
        if (sampler->patches[seed] != SAMPLE_NONE)
            continue;
        uint32_t depth = 0;
        sampler->patches[seed] = sampler->patch_count;
        stack[depth++] = seed;
        while (depth > 0) {
            uint32_t t = stack[--depth];
            for (int k = 0; k < 3; k++) {
                uint32_t next = sampler->neighbours[t][k];
                if (sampler->creases[t] >> k & 1 || next == SAMPLE_NONE ||
                    sampler->patches[next] != SAMPLE_NONE)
                    continue;
                sampler->patches[next] = sampler->patch_count;
                stack[depth++] = next;
            }
        }
        sampler->patch_count++;
    }
}

bool sample_edges_find(Sampler *sampler, Err *err) {
    size_t count = sampler->mesh->triangle_count;
    Groups groups = {.of = malloc(count * sizeof(uint32_t)),
                     .members = malloc(count * sizeof(uint32_t)),
                     .stack = malloc(count * sizeof(uint32_t))};
    bool ok = groups.of && groups.members && groups.stack && find_rectangles(sampler, &groups);
    if (ok) {
        find_patches(sampler, groups.stack);
        sampler->fills = malloc(sampler->patch_count * sizeof *sampler->fills);
        ok = sampler->fills != NULL;
    }
    for (uint32_t p = 0; ok && p < sampler->patch_count; p++)
        sampler->fills[p] = FILL_SCATTER;
    free(groups.of);
    free(groups.members);
    free(groups.stack);
    return ok ? true : err_set(err, ERR_INPUT, "sampling: no memory for the edges of %zu triangles", count);
}

/* ---- Crease edges ---- */

typedef struct Crease {
    uint32_t ends[2]; /* vertices, lower first */
    uint32_t triangle;
    uint32_t facing_first, facing_count; /* into Net.triangles: the triangles at this edge */
    bool used;
} Crease;

typedef struct Net {
    Crease *creases;
    uint32_t count;
    uint32_t *triangles;
    uint32_t *start; /* creases of vertex v: touching[start[v] .. start[v + 1] - 1] */
    uint32_t *touching;
    bool *corners; /* of the vertices: chains end here */
} Net;

static int compare_creases(const void *a, const void *b) {
    const Crease *p = a, *q = b;
    for (int k = 0; k < 2; k++)
        if (p->ends[k] != q->ends[k])
            return p->ends[k] < q->ends[k] ? -1 : 1;
    return p->triangle < q->triangle ? -1 : p->triangle > q->triangle;
}

static void free_net(Net *net) {
    free(net->creases);
    free(net->triangles);
    free(net->start);
    free(net->touching);
    free(net->corners);
}

/* One crease for each side of a triangle that is one, then those of the same edge made one. */
static bool collect_creases(const Sampler *sampler, Net *net) {
    const Mesh *mesh = sampler->mesh;
    uint32_t sides = 0;
    for (uint32_t i = 0; i < 3 * mesh->triangle_count; i++)
        sides += sampler->creases[i / 3] >> i % 3 & 1;
    net->creases = malloc(((size_t)sides + 1) * sizeof *net->creases);
    net->triangles = malloc(((size_t)sides + 1) * sizeof *net->triangles);
    if (!net->creases || !net->triangles)
        return false;
    uint32_t count = 0;
    for (uint32_t i = 0; i < 3 * mesh->triangle_count; i++) {
        if (!(sampler->creases[i / 3] >> i % 3 & 1))
            continue;
        uint32_t a = mesh->triangles[i / 3][i % 3], b = mesh->triangles[i / 3][(i + 1) % 3];
        net->creases[count++] = (Crease){.ends = {a < b ? a : b, a < b ? b : a}, .triangle = i / 3};
    }
    qsort(net->creases, sides, sizeof *net->creases, compare_creases);
    for (uint32_t i = 0; i < sides; i++) {
        Crease *last = net->count > 0 ? &net->creases[net->count - 1] : NULL, crease = net->creases[i];
        net->triangles[i] = crease.triangle;
        if (last && last->ends[0] == crease.ends[0] && last->ends[1] == crease.ends[1]) {
            last->facing_count++;
            continue;
        }
        crease.facing_first = i;
        crease.facing_count = 1;
        net->creases[net->count++] = crease;
    }
    return true;
}

static void crease_direction(const Mesh *mesh, const Crease *crease, uint32_t from, double out[3]) {
    double a[3];
    uint32_t to = crease->ends[0] == from ? crease->ends[1] : crease->ends[0];
    dvec_from_float(a, mesh->vertices[from]);
    dvec_from_float(out, mesh->vertices[to]);
    dvec_sub(out, out, a);
    dvec_normalize(out);
}

static bool link_creases(const Mesh *mesh, Net *net) {
    net->start = calloc((size_t)mesh->vertex_count + 2, sizeof *net->start);
    net->touching = malloc((2 * (size_t)net->count + 1) * sizeof *net->touching);
    net->corners = calloc((size_t)mesh->vertex_count + 1, sizeof *net->corners);
    if (!net->start || !net->touching || !net->corners)
        return false;
    for (uint32_t i = 0; i < 2 * net->count; i++)
        net->start[net->creases[i / 2].ends[i % 2] + 2]++;
    for (uint32_t v = 2; v <= mesh->vertex_count; v++)
        net->start[v] += net->start[v - 1];
    for (uint32_t i = 0; i < 2 * net->count; i++)
        net->touching[net->start[net->creases[i / 2].ends[i % 2] + 1]++] = i / 2;
    for (uint32_t v = 0; v < mesh->vertex_count; v++) {
        uint32_t degree = net->start[v + 1] - net->start[v];
        net->corners[v] = degree != 0 && degree != 2;
        if (degree == 2) {
            double a[3], b[3];
            crease_direction(mesh, &net->creases[net->touching[net->start[v]]], v, a);
            crease_direction(mesh, &net->creases[net->touching[net->start[v] + 1]], v, b);
            net->corners[v] = dvec_dot(a, b) > -crease_cosine;
        }
    }
    return true;
}

/* ---- Points on creases ---- */

static void add_crease_facings(const Sampler *sampler, const Net *net, const Crease *crease, Spot *spot) {
    for (uint32_t i = 0; i < crease->facing_count; i++) {
        uint32_t t = net->triangles[crease->facing_first + i];
        sample_add_facing(spot, sampler->normals[t], sampler->patches[t]);
    }
}

/* Adds the spot unless another is too near, or it lies between degenerate triangles and faces nowhere. */
static bool add_if_free(Sampler *sampler, const Spot *spot, Err *err) {
    if (spot->facing_count == 0 || !sample_inside(sampler, spot->position) ||
        sample_any(sampler, spot, sample_gap * sampler->spacing) != SAMPLE_NONE)
        return true;
    return sample_add(sampler, spot, NULL, err);
}

static bool fill_corners(Sampler *sampler, const Net *net, Err *err) {
    const Mesh *mesh = sampler->mesh;
    for (uint32_t v = 0; v < mesh->vertex_count; v++) {
        if (!net->corners[v])
            continue;
        Spot spot = {.triangle = SAMPLE_NONE};
        dvec_from_float(spot.position, mesh->vertices[v]);
        for (uint32_t i = net->start[v]; i < net->start[v + 1]; i++)
            add_crease_facings(sampler, net, &net->creases[net->touching[i]], &spot);
        if (!add_if_free(sampler, &spot, err))
            return false;
    }
    return true;
}

/* A run of connected straight pieces, cut at the region's bounds where it leaves the region. */
typedef struct Piece {
    double from[3], to[3];
    const Crease *crease;
} Piece;

typedef struct Chain {
    const Net *net;
    Piece *pieces;
    uint32_t count, capacity;
} Chain;

/* Puts points at equal distances along pieces [first, end). The ends get none where a corner's point is. */
static bool fill_run(Sampler *sampler, const Chain *chain, uint32_t first, uint32_t end,
                     const bool keep_ends[2], Err *err) {
    double length = 0.0, done = 0.0;
    for (uint32_t i = first; i < end; i++)
        length += sqrt(dvec_distance_sq(chain->pieces[i].from, chain->pieces[i].to));
    uint32_t cells = sample_cell_count(length / sampler->spacing), piece = first;
    for (uint32_t i = keep_ends[0] ? 0 : 1; i < cells + (keep_ends[1] ? 1 : 0); i++) {
        double at = length * i / cells, step;
        for (;; piece++) {
            step = sqrt(dvec_distance_sq(chain->pieces[piece].from, chain->pieces[piece].to));
            if (done + step >= at || piece + 1 == end)
                break;
            done += step;
        }
        double t = step > 0.0 ? fmin(1.0, fmax(0.0, (at - done) / step)) : 0.0, side[3];
        Spot spot = {.triangle = SAMPLE_NONE};
        dvec_sub(side, chain->pieces[piece].to, chain->pieces[piece].from);
        dvec_add_scaled(spot.position, chain->pieces[piece].from, t, side);
        add_crease_facings(sampler, chain->net, chain->pieces[piece].crease, &spot);
        if (!add_if_free(sampler, &spot, err))
            return false;
    }
    return true;
}

/* Cuts a piece to the region; false when nothing is left. */
static bool clip_piece(const Sampler *sampler, Piece *piece, bool cut[2]) {
    double side[3], low = 0.0, high = 1.0, origin[3];
    cut[0] = cut[1] = false;
    if (sample_inside(sampler, piece->from) && sample_inside(sampler, piece->to))
        return true;
    dvec_copy(origin, piece->from);
    dvec_sub(side, piece->to, piece->from);
    for (int k = 0; k < 3; k++) {
        double below = sampler->min[k] - origin[k], above = sampler->max[k] - origin[k];
        if (fabs(side[k]) <= sampler->tolerance) {
            if (below > sampler->tolerance || above < -sampler->tolerance)
                return false;
            continue;
        }
        low = fmax(low, (side[k] > 0.0 ? below : above) / side[k]);
        high = fmin(high, (side[k] > 0.0 ? above : below) / side[k]);
    }
    double slack = sampler->tolerance / dvec_length(side);
    if (high - low <= slack)
        return false;
    cut[0] = low > slack;
    cut[1] = high < 1.0 - slack;
    if (cut[0])
        dvec_add_scaled(piece->from, origin, low, side);
    if (cut[1])
        dvec_add_scaled(piece->to, origin, high, side);
    return true;
}

/* Divides a chain: as a whole, or run by run where the region cuts it. `ring`: it has no corner, and ends
 * where it began. */
static bool fill_chain(Sampler *sampler, Chain *chain, bool ring, Err *err) {
    uint32_t first = 0, kept = 0;
    bool open_start = ring, whole = true, left[2];
    for (uint32_t i = 0; i < chain->count; i++) {
        Piece piece = chain->pieces[i];
        bool inside = clip_piece(sampler, &piece, left);
        if (!inside || left[0]) {
            /* A gap before this piece: close the run. */
            if (kept > first && !fill_run(sampler, chain, first, kept, (bool[2]){open_start, true}, err))
                return false;
            first = kept;
            open_start = true;
            whole = false;
        }
        if (!inside)
            continue;
        chain->pieces[kept++] = piece; /* kept <= i: pieces are overwritten only after they were read */
        if (left[1]) {
            if (!fill_run(sampler, chain, first, kept, (bool[2]){open_start, true}, err))
                return false;
            first = kept;
            open_start = true;
            whole = false;
        }
    }
    if (kept == first)
        return true;
    /* The last run ends in a corner or, in a whole ring, where it began. A ring that was cut may have no
     * point there; if it has, add_if_free does not double it. */
    return fill_run(sampler, chain, first, kept, (bool[2]){open_start, ring && !whole}, err);
}

static bool follow_chain(Sampler *sampler, Net *net, Chain *chain, uint32_t vertex, uint32_t crease) {
    const Mesh *mesh = sampler->mesh;
    chain->count = 0;
    for (;;) {
        Crease *edge = &net->creases[crease];
        uint32_t next = edge->ends[0] == vertex ? edge->ends[1] : edge->ends[0];
        if (chain->count == chain->capacity) {
            uint32_t capacity = 2 * chain->capacity + 64;
            Piece *pieces = realloc(chain->pieces, capacity * sizeof *pieces);
            if (!pieces)
                return false;
            chain->pieces = pieces;
            chain->capacity = capacity;
        }
        Piece *piece = &chain->pieces[chain->count++];
        dvec_from_float(piece->from, mesh->vertices[vertex]);
        dvec_from_float(piece->to, mesh->vertices[next]);
        piece->crease = edge;
        edge->used = true;
        vertex = next;
        if (net->corners[vertex])
            return true;
        const uint32_t *both = &net->touching[net->start[vertex]];
        crease = both[0] == crease ? both[1] : both[0];
        if (net->creases[crease].used)
            return true; /* around a ring */
    }
}

static bool fill_chains(Sampler *sampler, Net *net, Chain *chain, Err *err) {
    const Mesh *mesh = sampler->mesh;
    /* Chains from corner to corner first; what is unused then are rings. */
    for (int rings = 0; rings < 2; rings++) {
        for (uint32_t v = 0; v < mesh->vertex_count; v++) {
            for (uint32_t i = net->start[v]; i < net->start[v + 1]; i++) {
                if (net->creases[net->touching[i]].used || (!rings && !net->corners[v]))
                    continue;
                if (!follow_chain(sampler, net, chain, v, net->touching[i]))
                    return err_set(err, ERR_INPUT, "sampling: no memory for an edge of %" PRIu32 " pieces",
                                   chain->count);
                if (!fill_chain(sampler, chain, rings == 1, err))
                    return false;
            }
        }
    }
    return true;
}

bool sample_edges_fill(Sampler *sampler, Err *err) {
    const Mesh *mesh = sampler->mesh;
    Net net = {0};
    Chain chain = {.net = &net};
    bool ok = collect_creases(sampler, &net) && link_creases(mesh, &net);
    if (!ok)
        err_set(err, ERR_INPUT, "sampling: no memory for the edges of %" PRIu32 " triangles",
                mesh->triangle_count);
    ok = ok && fill_corners(sampler, &net, err) && fill_chains(sampler, &net, &chain, err);
    free(chain.pieces);
    free_net(&net);
    return ok;
}
