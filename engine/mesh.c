/* Triangle meshes: storage, box and sphere, edges and closedness, transformation, mass integrals.
 *
 * The integrals of 1, x and x x^T over the solid are sums over the tetrahedra between each triangle and one
 * origin, V = sum d/6,  int x = sum d/24 (a+b+c),  int x x^T = sum d/120 (a a^T + b b^T + c c^T + s s^T), d =
 * a . (b x c),  s = a + b + c, the same polynomials as [Mirtich 1996] integrated over triangles in place of
 * projected polygons. The origin is the centre of the bounds, so that a hull far from the world's origin
 * loses no digits. */
#include "mesh.h"

#include "base/log.h"
#include "dvec.h"
#include "mesh_build.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- Storage ---- */

bool mesh_allocate(Mesh *mesh, const char *name, size_t vertex_count, size_t triangle_count, Err *err) {
    memset(mesh, 0, sizeof *mesh);
    if (vertex_count > MESH_MAX_ELEMENTS || triangle_count > MESH_MAX_ELEMENTS)
        return err_set(err, ERR_INPUT, "%s: %zu vertices and %zu triangles; at most %d of each are allowed",
                       name, vertex_count, triangle_count, (int)MESH_MAX_ELEMENTS);
    mesh->vertices = calloc(vertex_count + 1, sizeof *mesh->vertices);
    mesh->triangles = calloc(triangle_count + 1, sizeof *mesh->triangles);
    if (!mesh->vertices || !mesh->triangles) {
        mesh_free(mesh);
        return err_set(err, ERR_INPUT, "%s: no memory for %zu vertices and %zu triangles", name, vertex_count,
                       triangle_count);
    }
    mesh->vertex_count = (uint32_t)vertex_count;
    mesh->triangle_count = (uint32_t)triangle_count;
    return true;
}

void mesh_free(Mesh *mesh) {
    mesh_free_tree(mesh);
    free(mesh->vertices);
    free(mesh->triangles);
    free(mesh->materials);
    free(mesh->material_names);
    memset(mesh, 0, sizeof *mesh);
}

static void set_bounds(Mesh *mesh) {
    for (int k = 0; k < 3; k++) {
        mesh->min[k] = INFINITY;
        mesh->max[k] = -INFINITY;
    }
    for (uint32_t t = 0; t < mesh->triangle_count; t++) {
        for (int c = 0; c < 3; c++) {
            const float *v = mesh->vertices[mesh->triangles[t][c]];
            for (int k = 0; k < 3; k++) {
                mesh->min[k] = fminf(mesh->min[k], v[k]);
                mesh->max[k] = fmaxf(mesh->max[k], v[k]);
            }
        }
    }
}

static uint64_t hash_position(const float v[3]) {
    uint32_t bits[3];
    memcpy(bits, v, sizeof bits);
    uint64_t h = 0;
    for (int k = 0; k < 3; k++) {
        h = (h ^ bits[k]) * 0x9e3779b97f4a7c15u;
        h ^= h >> 29;
    }
    return h;
}

/* Merges coinciding vertices in place, keeping the order of their first appearance; map[old] = new. */
static bool merge_vertices(Mesh *mesh, uint32_t *map) {
    size_t size = 16;
    while (size < 2 * (size_t)mesh->vertex_count)
        size *= 2;
    uint32_t *table = malloc(size * sizeof *table);
    if (!table)
        return false;
    memset(table, 0xff, size * sizeof *table);
    uint32_t count = 0;
    for (uint32_t i = 0; i < mesh->vertex_count; i++) {
        float *v = mesh->vertices[i];
        for (int k = 0; k < 3; k++)
            v[k] += 0.0f; /* -0 becomes +0: equal numbers get equal bits */
        size_t slot = hash_position(v) & (size - 1);
        while (table[slot] != UINT32_MAX &&
               memcmp(mesh->vertices[table[slot]], v, sizeof *mesh->vertices) != 0)
            slot = (slot + 1) & (size - 1);
        if (table[slot] == UINT32_MAX) {
            table[slot] = count;
            memmove(mesh->vertices[count++], v, sizeof *mesh->vertices);
        }
        map[i] = table[slot];
    }
    mesh->vertex_count = count;
    free(table);
    return true;
}

/* Leaves out the vertices of no triangle. `map` is scratch of vertex_count. */
static void drop_unused_vertices(Mesh *mesh, uint32_t *map) {
    memset(map, 0, (size_t)mesh->vertex_count * sizeof *map);
    for (uint32_t i = 0; i < 3 * mesh->triangle_count; i++)
        map[mesh->triangles[i / 3][i % 3]] = 1;
    uint32_t count = 0;
    for (uint32_t v = 0; v < mesh->vertex_count; v++) {
        if (map[v] == 0)
            continue;
        map[v] = count;
        memmove(mesh->vertices[count++], mesh->vertices[v], sizeof *mesh->vertices);
    }
    for (uint32_t i = 0; i < 3 * mesh->triangle_count; i++)
        mesh->triangles[i / 3][i % 3] = map[mesh->triangles[i / 3][i % 3]];
    mesh->vertex_count = count;
}

bool mesh_finish(Mesh *mesh, const char *name, Err *err) {
    uint32_t *map = malloc(((size_t)mesh->vertex_count + 1) * sizeof *map);
    if (!map || !merge_vertices(mesh, map)) {
        uint32_t count = mesh->vertex_count;
        free(map);
        mesh_free(mesh);
        return err_set(err, ERR_INPUT, "%s: no memory to merge %" PRIu32 " vertices", name, count);
    }
    uint32_t kept = 0;
    for (uint32_t t = 0; t < mesh->triangle_count; t++) {
        const uint32_t *corner = mesh->triangles[t];
        uint32_t a = map[corner[0]], b = map[corner[1]], c = map[corner[2]];
        if (a == b || b == c || c == a)
            continue;
        if (mesh->materials)
            mesh->materials[kept] = mesh->materials[t];
        mesh->triangles[kept][0] = a;
        mesh->triangles[kept][1] = b;
        mesh->triangles[kept++][2] = c;
    }
    if (kept < mesh->triangle_count)
        log_write(LOG_INFO, "%s: left out %" PRIu32 " triangles whose corners coincide", name,
                  mesh->triangle_count - kept);
    mesh->triangle_count = kept;
    drop_unused_vertices(mesh, map);
    free(map);
    if (kept == 0) {
        mesh_free(mesh);
        return err_set(err, ERR_INPUT, "%s: no surface: every face has coinciding corners", name);
    }
    set_bounds(mesh);
    return true;
}

/* ---- Box and sphere ---- */

bool mesh_make_box(const float min[3], const float max[3], Mesh *mesh, Err *err) {
    /* Corner i has x = max where bit 0 is set, y where bit 1, z where bit 2. */
    static const uint32_t triangles[12][3] = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6},
                                              {0, 1, 5}, {0, 5, 4}, {2, 6, 7}, {2, 7, 3},
                                              {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
    memset(mesh, 0, sizeof *mesh);
    for (int k = 0; k < 3; k++)
        if (!isfinite(min[k]) || !isfinite(max[k]) || !(min[k] < max[k]))
            return err_set(err, ERR_INPUT,
                           "box: axis %c from %g to %g; finite bounds with min < max are allowed", "xyz"[k],
                           (double)min[k], (double)max[k]);
    if (!mesh_allocate(mesh, "box", 8, 12, err))
        return false;
    for (int i = 0; i < 8; i++)
        for (int k = 0; k < 3; k++)
            mesh->vertices[i][k] = i >> k & 1 ? max[k] : min[k];
    memcpy(mesh->triangles, triangles, sizeof triangles);
    set_bounds(mesh);
    return true;
}

/* Four triangles for one. Midpoints lie on the unit sphere; the sum of two vertices does not depend on their
 * order, so that the two triangles of an edge make the same midpoint, and merging finds it. */
static void split_on_sphere(const double corner[3][3], int level, double (**out)[3][3]) {
    if (level == 0) {
        memcpy(**out, corner, sizeof **out);
        (*out)++;
        return;
    }
    double middle[3][3];
    for (int k = 0; k < 3; k++) {
        dvec_add_scaled(middle[k], corner[k], 1.0, corner[(k + 1) % 3]);
        dvec_normalize(middle[k]);
    }
    for (int k = 0; k < 3; k++) {
        double part[3][3];
        dvec_copy(part[0], corner[k]);
        dvec_copy(part[1], middle[k]);
        dvec_copy(part[2], middle[(k + 2) % 3]);
        split_on_sphere(part, level - 1, out);
    }
    split_on_sphere(middle, level - 1, out);
}

bool mesh_make_sphere(const float centre[3], float radius, int level, Mesh *mesh, Err *err) {
    enum { MAX_LEVEL = 8 };
    static const int icosahedron[20][3] = {{0, 11, 5}, {0, 5, 1},  {0, 1, 7},   {0, 7, 10}, {0, 10, 11},
                                           {1, 5, 9},  {5, 11, 4}, {11, 10, 2}, {10, 7, 6}, {7, 1, 8},
                                           {3, 9, 4},  {3, 4, 2},  {3, 2, 6},   {3, 6, 8},  {3, 8, 9},
                                           {4, 9, 5},  {2, 4, 11}, {6, 2, 10},  {8, 6, 7},  {9, 8, 1}};
    memset(mesh, 0, sizeof *mesh);
    if (!isfinite(centre[0]) || !isfinite(centre[1]) || !isfinite(centre[2]) || !isfinite(radius) ||
        !(radius > 0.0f))
        return err_set(err, ERR_INPUT,
                       "sphere: radius %g at (%g, %g, %g); finite numbers with radius > 0 are allowed",
                       (double)radius, (double)centre[0], (double)centre[1], (double)centre[2]);
    if (level < 0 || level > MAX_LEVEL)
        return err_set(err, ERR_INPUT, "sphere: level %d; 0..%d is allowed", level, (int)MAX_LEVEL);

    /* The 12 vertices are the cyclic permutations of (+-1, +-golden ratio, 0). */
    double unit[12][3];
    const double golden = 0.5 * (1.0 + sqrt(5.0));
    for (int i = 0; i < 12; i++) {
        int axis = i / 4;
        unit[i][axis] = i & 1 ? 1.0 : -1.0;
        unit[i][(axis + 1) % 3] = i & 2 ? -golden : golden;
        unit[i][(axis + 2) % 3] = 0.0;
        dvec_normalize(unit[i]);
    }
    size_t count = (size_t)20 << (2 * level);
    double(*soup)[3][3] = malloc(count * sizeof *soup);
    if (!soup || !mesh_allocate(mesh, "sphere", 3 * count, count, err)) {
        free(soup);
        return soup ? false : err_set(err, ERR_INPUT, "sphere: no memory for %zu triangles", count);
    }
    double(*out)[3][3] = soup;
    for (int t = 0; t < 20; t++) {
        double corner[3][3];
        for (int k = 0; k < 3; k++)
            dvec_copy(corner[k], unit[icosahedron[t][k]]);
        split_on_sphere(corner, level, &out);
    }
    for (uint32_t i = 0; i < 3 * (uint32_t)count; i++) {
        for (int k = 0; k < 3; k++)
            mesh->vertices[i][k] = (float)((double)centre[k] + (double)radius * soup[i / 3][i % 3][k]);
        mesh->triangles[i / 3][i % 3] = i;
    }
    free(soup);
    return mesh_finish(mesh, "sphere", err);
}

/* ---- Edges ---- */

/* Side k of triangle t runs from its corner k to its corner k + 1. */
typedef struct Side {
    uint32_t low, high;  /* its vertices */
    uint32_t index;      /* 3 t + k */
    uint32_t descending; /* 1 when it runs from high to low */
} Side;

static int compare_sides(const void *a, const void *b) {
    const Side *p = a, *q = b;
    if (p->low != q->low)
        return p->low < q->low ? -1 : 1;
    if (p->high != q->high)
        return p->high < q->high ? -1 : 1;
    return p->index < q->index ? -1 : p->index > q->index;
}

/* All sides, those of one edge next to each other, 3 triangle_count long; NULL without memory. Bucketed by
 * the lower vertex first: what is left to sort are a handful each. */
static Side *sorted_sides(const Mesh *mesh) {
    uint32_t count = 3 * mesh->triangle_count;
    Side *sides = malloc(((size_t)count + 1) * sizeof *sides);
    uint32_t *start = calloc((size_t)mesh->vertex_count + 2, sizeof *start);
    if (!sides || !start) {
        free(sides);
        free(start);
        return NULL;
    }
    for (int pass = 0; pass < 2; pass++) {
        for (uint32_t i = 0; i < count; i++) {
            uint32_t from = mesh->triangles[i / 3][i % 3], to = mesh->triangles[i / 3][(i + 1) % 3];
            uint32_t low = from < to ? from : to;
            if (pass == 0)
                start[low + 2]++;
            else
                sides[start[low + 1]++] = (Side){low, from < to ? to : from, i, from > to};
        }
        for (uint32_t v = 0; pass == 0 && v <= mesh->vertex_count; v++)
            start[v + 1] += start[v];
    }
    for (uint32_t v = 0; v < mesh->vertex_count; v++)
        if (start[v + 1] > start[v] + 1)
            qsort(sides + start[v], start[v + 1] - start[v], sizeof *sides, compare_sides);
    free(start);
    return sides;
}

/* One past the last side of the edge that begins at `first`. */
static uint32_t edge_end(const Side *sides, uint32_t first, uint32_t count) {
    uint32_t end = first + 1;
    while (end < count && sides[end].low == sides[first].low && sides[end].high == sides[first].high)
        end++;
    return end;
}

bool mesh_neighbours(const Mesh *mesh, uint32_t (*neighbours)[3], Err *err) {
    Side *sides = sorted_sides(mesh);
    uint32_t count = 3 * mesh->triangle_count;
    if (!sides)
        return err_set(err, ERR_INPUT, "mesh: no memory for the sides of %" PRIu32 " triangles",
                       mesh->triangle_count);
    memset(neighbours, 0xff, (size_t)mesh->triangle_count * sizeof *neighbours);
    for (uint32_t first = 0, end; first < count; first = end) {
        end = edge_end(sides, first, count);
        if (end - first != 2 || sides[first].descending == sides[first + 1].descending)
            continue;
        uint32_t i = sides[first].index, j = sides[first + 1].index;
        neighbours[i / 3][i % 3] = j / 3;
        neighbours[j / 3][j % 3] = i / 3;
    }
    free(sides);
    return true;
}

/* ---- Closedness ---- */

/* Counts of what is wrong, and lines for the first faults. */
typedef struct Faults {
    const Mesh *mesh;
    uint32_t open, crowded, flipped, degenerate;
    int line_count;
    char lines[4][256];
} Faults;

static void note_fault(Faults *faults, const char *what, uint32_t triangle, uint32_t from, uint32_t to) {
    if (faults->line_count == (int)(sizeof faults->lines / sizeof faults->lines[0]))
        return;
    const float *a = faults->mesh->vertices[from], *b = faults->mesh->vertices[to];
    snprintf(faults->lines[faults->line_count++], sizeof faults->lines[0],
             "triangle %" PRIu32 ": %s, from (%g, %g, %g) to (%g, %g, %g)", triangle + 1, what, (double)a[0],
             (double)a[1], (double)a[2], (double)b[0], (double)b[1], (double)b[2]);
}

static void find_edge_faults(const Mesh *mesh, const Side *sides, Faults *faults) {
    uint32_t count = 3 * mesh->triangle_count;
    for (uint32_t first = 0, end; first < count; first = end) {
        end = edge_end(sides, first, count);
        const Side *side = &sides[first];
        if (end - first == 1) {
            faults->open++;
            note_fault(faults, "no triangle on the other side of an edge", side->index / 3, side->low,
                       side->high);
        } else if (end - first > 2) {
            faults->crowded++;
            note_fault(faults, "more than two triangles at an edge", side->index / 3, side->low, side->high);
        } else if (side[0].descending == side[1].descending) {
            faults->flipped++;
            note_fault(faults, "the neighbour across an edge faces the other way", side->index / 3, side->low,
                       side->high);
        }
    }
}

/* A triangle is degenerate when it is thinner than 1e-7 of its length: its normal is then rounding noise. */
static void find_degenerate(const Mesh *mesh, Faults *faults) {
    for (uint32_t t = 0; t < mesh->triangle_count; t++) {
        double v[3][3], side[3][3], cross[3], longest_sq = 0.0;
        for (int k = 0; k < 3; k++)
            dvec_from_float(v[k], mesh->vertices[mesh->triangles[t][k]]);
        int longest = 0;
        for (int k = 0; k < 3; k++) {
            dvec_sub(side[k], v[(k + 1) % 3], v[k]);
            if (dvec_dot(side[k], side[k]) > longest_sq) {
                longest_sq = dvec_dot(side[k], side[k]);
                longest = k;
            }
        }
        dvec_cross(cross, side[0], side[1]);
        if (dvec_length(cross) > 1e-7 * longest_sq)
            continue;
        faults->degenerate++;
        note_fault(faults, "degenerate (no area)", t, mesh->triangles[t][longest],
                   mesh->triangles[t][(longest + 1) % 3]);
    }
}

bool mesh_check_closed(const Mesh *mesh, const char *name, Err *err) {
    if (mesh->triangle_count == 0)
        return err_set(err, ERR_INPUT, "%s: no triangles", name);
    Side *sides = sorted_sides(mesh);
    if (!sides)
        return err_set(err, ERR_INPUT, "%s: no memory for the sides of %" PRIu32 " triangles", name,
                       mesh->triangle_count);
    Faults faults = {.mesh = mesh};
    find_edge_faults(mesh, sides, &faults);
    free(sides);
    find_degenerate(mesh, &faults);
    if (faults.open + faults.crowded + faults.flipped + faults.degenerate > 0) {
        err_set(err, ERR_INPUT,
                "%s: not a closed surface: %" PRIu32 " open edges, %" PRIu32
                " edges of more than two triangles, %" PRIu32
                " edges between triangles that face opposite ways, %" PRIu32 " degenerate triangles",
                name, faults.open, faults.crowded, faults.flipped, faults.degenerate);
        for (int i = 0; i < faults.line_count; i++)
            err_add(err, ERR_INPUT, "%s: %s", name, faults.lines[i]);
        return false;
    }
    MeshMass mass;
    mesh_mass(mesh, &mass);
    double x = (double)mesh->max[0] - (double)mesh->min[0], y = (double)mesh->max[1] - (double)mesh->min[1],
           z = (double)mesh->max[2] - (double)mesh->min[2];
    double thickness = mass.area > 0.0 ? fabs(mass.volume) / mass.area : 0.0;
    if (!(thickness > 1e-7 * sqrt(x * x + y * y + z * z)))
        return err_set(err, ERR_INPUT, "%s: the surface encloses no volume (%g m^3 within %g m^2)", name,
                       mass.volume, mass.area);
    if (mass.volume < 0.0)
        return err_set(
            err, ERR_INPUT,
            "%s: inside out (volume %g m^3); triangles must be counter-clockwise seen from outside", name,
            mass.volume);
    return true;
}

/* ---- Transformation ---- */

void mesh_transform(Mesh *mesh, const float scale[3], const float rotation[4], const float translation[3]) {
    double x = (double)rotation[0], y = (double)rotation[1], z = (double)rotation[2], w = (double)rotation[3];
    /* 2 / |q|^2: a quaternion rounded to float32 rotates without scaling all the same. */
    double s = 2.0 / (x * x + y * y + z * z + w * w);
    double matrix[3][3] = {{1 - s * (y * y + z * z), s * (x * y - z * w), s * (x * z + y * w)},
                           {s * (x * y + z * w), 1 - s * (x * x + z * z), s * (y * z - x * w)},
                           {s * (x * z - y * w), s * (y * z + x * w), 1 - s * (x * x + y * y)}};
    for (uint32_t i = 0; i < mesh->vertex_count; i++) {
        double scaled[3];
        for (int k = 0; k < 3; k++)
            scaled[k] = (double)scale[k] * (double)mesh->vertices[i][k];
        for (int k = 0; k < 3; k++)
            mesh->vertices[i][k] = (float)(dvec_dot(matrix[k], scaled) + (double)translation[k]);
    }
    int mirrors = signbit(scale[0]) != 0;
    mirrors += signbit(scale[1]) != 0;
    mirrors += signbit(scale[2]) != 0;
    for (uint32_t t = 0; mirrors % 2 == 1 && t < mesh->triangle_count; t++) {
        uint32_t corner = mesh->triangles[t][1];
        mesh->triangles[t][1] = mesh->triangles[t][2];
        mesh->triangles[t][2] = corner;
    }
    mesh_free_tree(mesh);
    set_bounds(mesh);
}

/* ---- Mass ---- */

/* Inertia about the centre of mass from the second moments about the local origin. */
static void set_inertia(MeshMass *mass, const double first[3], const double second[3][3]) {
    double moment[3][3];
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            moment[i][j] = second[i][j] - (mass->volume != 0.0 ? first[i] * first[j] / mass->volume : 0.0);
    double trace = moment[0][0] + moment[1][1] + moment[2][2];
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            mass->inertia[i][j] = (i == j ? trace : 0.0) - moment[i][j];
}

void mesh_mass(const Mesh *mesh, MeshMass *mass) {
    memset(mass, 0, sizeof *mass);
    if (mesh->triangle_count == 0)
        return;
    double origin[3], first[3] = {0}, second[3][3] = {{0}};
    for (int k = 0; k < 3; k++)
        origin[k] = 0.5 * ((double)mesh->min[k] + (double)mesh->max[k]);
    for (uint32_t t = 0; t < mesh->triangle_count; t++) {
        double p[3][3], sum[3], ab[3], ac[3], cross[3];
        for (int k = 0; k < 3; k++) {
            dvec_from_float(p[k], mesh->vertices[mesh->triangles[t][k]]);
            dvec_sub(p[k], p[k], origin);
        }
        dvec_sub(ab, p[1], p[0]);
        dvec_sub(ac, p[2], p[0]);
        dvec_cross(cross, ab, ac);
        mass->area += 0.5 * dvec_length(cross);
        double d = dvec_dot(p[0], cross); /* a . ((b - a) x (c - a)) = a . (b x c) */
        mass->volume += d / 6.0;
        for (int i = 0; i < 3; i++) {
            sum[i] = p[0][i] + p[1][i] + p[2][i];
            first[i] += d / 24.0 * sum[i];
        }
        for (int i = 0; i < 3; i++)
            for (int j = 0; j < 3; j++)
                second[i][j] +=
                    d / 120.0 * (p[0][i] * p[0][j] + p[1][i] * p[1][j] + p[2][i] * p[2][j] + sum[i] * sum[j]);
    }
    for (int i = 0; i < 3; i++)
        mass->centre[i] = origin[i] + (mass->volume != 0.0 ? first[i] / mass->volume : 0.0);
    set_inertia(mass, first, second);
}
