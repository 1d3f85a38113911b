/* Signed distance to a triangle mesh.
 *
 * A binary tree of bounding boxes, split at the median along the widest axis of the triangles' centres, is
 * searched nearest box first. The distance to a triangle follows [Ericson 2005, Real-Time Collision
 * Detection, 5.1.5]; the sign is that of (p - closest) . n with n the pseudo-normal of the closest feature:
 * the face's normal, the sum of the normals of the two faces of an edge, or the angle-weighted sum of the
 * normals around a vertex [Baerentzen & Aanaes 2005]. Arithmetic is double: far from the mesh the feature
 * that is closest is decided by the last digits. Open meshes get a distance too, but its sign means little
 * there. */
#include "mesh.h"

#include "dvec.h"

#include <assert.h>
#include <float.h>
#include <inttypes.h>
#include <stdlib.h>
#include <string.h>

enum { LEAF_SIZE = 4, MAX_DEPTH = 64, BATCH = 64 };

/* Leaf: `count` triangles of the tree's order from `first`. Inner node: count 0, children at index + 1 and
 * `first`. */
typedef struct Node {
    float min[3], max[3];
    uint32_t first, count;
} Node;

typedef struct MeshTree {
    Node *nodes;
    uint32_t node_count;
    uint32_t *order;            /* triangles, those of a leaf next to each other */
    uint32_t (*neighbours)[3];  /* mesh_neighbours */
    float (*face_normals)[3];   /* unit; zero for a degenerate triangle */
    float (*vertex_normals)[3]; /* angle-weighted sums */
} MeshTree;

/* ---- Building ---- */

void mesh_free_tree(Mesh *mesh) {
    MeshTree *tree = mesh->tree;
    if (!tree)
        return;
    free(tree->nodes);
    free(tree->order);
    free(tree->neighbours);
    free(tree->face_normals);
    free(tree->vertex_normals);
    free(tree);
    mesh->tree = NULL;
}

static void set_normals(const Mesh *mesh, MeshTree *tree) {
    for (uint32_t t = 0; t < mesh->triangle_count; t++) {
        double v[3][3], side[3][3], normal[3];
        for (int k = 0; k < 3; k++)
            dvec_from_float(v[k], mesh->vertices[mesh->triangles[t][k]]);
        for (int k = 0; k < 3; k++)
            dvec_sub(side[k], v[(k + 1) % 3], v[k]);
        dvec_cross(normal, side[0], side[1]);
        dvec_normalize(normal);
        dvec_to_float(tree->face_normals[t], normal);
        for (int k = 0; k < 3; k++) {
            double cross[3];
            const double *in = side[(k + 2) % 3], *out = side[k];
            dvec_cross(cross, in, out);
            double angle = atan2(dvec_length(cross), -dvec_dot(in, out));
            float *sum = tree->vertex_normals[mesh->triangles[t][k]];
            for (int axis = 0; axis < 3; axis++)
                sum[axis] += (float)(angle * normal[axis]);
        }
    }
}

typedef struct Builder {
    const Mesh *mesh;
    MeshTree *tree;
    float (*centres)[3];
} Builder;

static void grow_box(float min[3], float max[3], const float point[3]) {
    for (int k = 0; k < 3; k++) {
        min[k] = point[k] < min[k] ? point[k] : min[k];
        max[k] = point[k] > max[k] ? point[k] : max[k];
    }
}

/* Total order, so that the tree does not depend on how the selection below moves equal centres. */
static bool precedes(const Builder *builder, int axis, uint32_t a, uint32_t b) {
    float p = builder->centres[a][axis], q = builder->centres[b][axis];
    return p < q || (p == q && a < b);
}

/* Quickselect: puts the triangle of rank `middle` in [first, end) in its place, smaller ones before it. */
static void select_median(const Builder *builder, int axis, uint32_t first, uint32_t middle, uint32_t end) {
    uint32_t *order = builder->tree->order;
    while (end - first > 1) {
        uint32_t pivot = order[first + (end - first) / 2], low = first, high = end - 1;
        for (;;) {
            while (precedes(builder, axis, order[low], pivot))
                low++;
            while (precedes(builder, axis, pivot, order[high]))
                high--;
            if (low >= high)
                break;
            uint32_t swap = order[low];
            order[low++] = order[high];
            order[high--] = swap;
        }
        /* All before `low` precede the pivot, all after `high` follow it; if they met, they met at the pivot.
         */
        if (low == high && low == middle)
            break;
        if (middle < low)
            end = low;
        else
            first = high + 1;
    }
}

static uint32_t build_node(const Builder *builder, uint32_t first, uint32_t end) {
    MeshTree *tree = builder->tree;
    uint32_t index = tree->node_count++;
    Node *node = &tree->nodes[index];
    float low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
    memcpy(node->min, low, sizeof low);
    memcpy(node->max, high, sizeof high);
    for (uint32_t i = first; i < end; i++) {
        uint32_t t = tree->order[i];
        grow_box(low, high, builder->centres[t]);
        for (int k = 0; k < 3; k++)
            grow_box(node->min, node->max, builder->mesh->vertices[builder->mesh->triangles[t][k]]);
    }
    node->first = first;
    node->count = end - first;
    if (end - first <= LEAF_SIZE)
        return index;
    int axis = 0;
    for (int k = 1; k < 3; k++)
        if (high[k] - low[k] > high[axis] - low[axis])
            axis = k;
    uint32_t middle = first + (end - first) / 2;
    select_median(builder, axis, first, middle, end);
    build_node(builder, first, middle);
    uint32_t right = build_node(builder, middle, end);
    tree->nodes[index].first = right;
    tree->nodes[index].count = 0;
    return index;
}

bool mesh_build_tree(Mesh *mesh, Err *err) {
    mesh_free_tree(mesh);
    size_t count = mesh->triangle_count;
    if (count == 0)
        return err_set(err, ERR_INPUT, "mesh: no triangles to build a tree of");
    MeshTree *tree = calloc(1, sizeof *tree);
    float(*centres)[3] = malloc(count * sizeof *centres);
    mesh->tree = tree;
    if (tree) {
        tree->nodes = malloc(2 * count * sizeof *tree->nodes);
        tree->order = malloc(count * sizeof *tree->order);
        tree->neighbours = malloc(count * sizeof *tree->neighbours);
        tree->face_normals = malloc(count * sizeof *tree->face_normals);
        tree->vertex_normals = calloc((size_t)mesh->vertex_count + 1, sizeof *tree->vertex_normals);
    }
    if (!tree || !centres || !tree->nodes || !tree->order || !tree->neighbours || !tree->face_normals ||
        !tree->vertex_normals || !mesh_neighbours(mesh, tree->neighbours, NULL)) {
        free(centres);
        mesh_free_tree(mesh);
        return err_set(err, ERR_INPUT, "mesh: no memory for the tree of %zu triangles", count);
    }
    set_normals(mesh, tree);
    for (uint32_t t = 0; t < count; t++) {
        tree->order[t] = t;
        const uint32_t *corner = mesh->triangles[t];
        for (int k = 0; k < 3; k++)
            centres[t][k] =
                (mesh->vertices[corner[0]][k] + mesh->vertices[corner[1]][k] + mesh->vertices[corner[2]][k]) /
                3.0f;
    }
    Builder builder = {mesh, tree, centres};
    build_node(&builder, 0, (uint32_t)count);
    free(centres);
    return true;
}

/* ---- Distance ---- */

/* Part of a triangle: the face, side k (from corner k to corner k + 1) or corner k. */
typedef enum Feature { FEATURE_FACE, FEATURE_SIDE, FEATURE_CORNER = FEATURE_SIDE + 3 } Feature;

typedef struct Hit {
    double distance_sq;
    double closest[3]; /* relative to the point asked for */
    uint32_t triangle;
    int feature; /* FEATURE_FACE, FEATURE_SIDE + k or FEATURE_CORNER + k */
} Hit;

/* The point of a side closest to the origin; returns the feature it lies on. */
static int closest_on_side(const double a[3], const double ab[3], int side, double out[3]) {
    double length_sq = dvec_dot(ab, ab), t = -dvec_dot(a, ab);
    if (!(t > 0.0)) {
        dvec_copy(out, a);
        return FEATURE_CORNER + side;
    }
    if (t >= length_sq) {
        dvec_add_scaled(out, a, 1.0, ab);
        return FEATURE_CORNER + (side + 1) % 3;
    }
    dvec_add_scaled(out, a, t / length_sq, ab);
    return FEATURE_SIDE + side;
}

/* The point of triangle v closest to the origin. */
static int closest_on_triangle(const double v[3][3], double out[3]) {
    double ab[3], ac[3];
    dvec_sub(ab, v[1], v[0]);
    dvec_sub(ac, v[2], v[0]);
    double d1 = -dvec_dot(ab, v[0]), d2 = -dvec_dot(ac, v[0]);
    double d3 = -dvec_dot(ab, v[1]), d4 = -dvec_dot(ac, v[1]);
    double d5 = -dvec_dot(ab, v[2]), d6 = -dvec_dot(ac, v[2]);
    double va = d3 * d6 - d5 * d4, vb = d5 * d2 - d1 * d6, vc = d1 * d4 - d3 * d2, sum = va + vb + vc;
    if (va > 0.0 && vb > 0.0 && vc > 0.0) {
        dvec_add_scaled(out, v[0], vb / sum, ab);
        dvec_add_scaled(out, out, vc / sum, ac);
        return FEATURE_FACE;
    }
    /* Outside of one or two sides: the nearest point of the three sides, which also holds for degenerate
     * triangles. */
    int best = FEATURE_FACE;
    double best_sq = INFINITY;
    for (int k = 0; k < 3; k++) {
        double side[3], point[3];
        dvec_sub(side, v[(k + 1) % 3], v[k]);
        int feature = closest_on_side(v[k], side, k, point);
        double distance_sq = dvec_dot(point, point);
        if (distance_sq < best_sq) {
            best_sq = distance_sq;
            best = feature;
            dvec_copy(out, point);
        }
    }
    return best;
}

static void test_triangle(const Mesh *mesh, uint32_t t, const double point[3], Hit *hit) {
    double v[3][3], closest[3] = {0};
    for (int k = 0; k < 3; k++) {
        dvec_from_float(v[k], mesh->vertices[mesh->triangles[t][k]]);
        dvec_sub(v[k], v[k], point);
    }
    int feature = closest_on_triangle((const double(*)[3])v, closest);
    double distance_sq = dvec_dot(closest, closest);
    if (distance_sq < hit->distance_sq) {
        hit->distance_sq = distance_sq;
        hit->triangle = t;
        hit->feature = feature;
        dvec_copy(hit->closest, closest);
    }
}

static double box_distance_sq(const Node *node, const double point[3]) {
    double sum = 0.0;
    for (int k = 0; k < 3; k++) {
        double below = (double)node->min[k] - point[k], above = point[k] - (double)node->max[k];
        double d = below > above ? below : above;
        sum += d > 0.0 ? d * d : 0.0;
    }
    return sum;
}

/* `hit` holds an upper bound of the distance on entry. */
static void search(const Mesh *mesh, const double point[3], Hit *hit) {
    const MeshTree *tree = mesh->tree;
    struct {
        uint32_t node;
        double distance_sq;
    } stack[MAX_DEPTH];
    int depth = 0;
    uint32_t index = 0;
    double distance_sq = box_distance_sq(&tree->nodes[0], point);
    for (;;) {
        const Node *node = &tree->nodes[index];
        if (distance_sq < hit->distance_sq && node->count == 0) {
            uint32_t near_index = index + 1, far_index = node->first;
            double near_sq = box_distance_sq(&tree->nodes[near_index], point);
            double far_sq = box_distance_sq(&tree->nodes[far_index], point);
            if (far_sq < near_sq) {
                double swap_sq = near_sq;
                near_sq = far_sq;
                far_sq = swap_sq;
                far_index = near_index;
                near_index = node->first;
            }
            stack[depth].node = far_index;
            stack[depth++].distance_sq = far_sq;
            index = near_index;
            distance_sq = near_sq;
            continue;
        }
        if (distance_sq < hit->distance_sq)
            for (uint32_t i = 0; i < node->count; i++)
                test_triangle(mesh, tree->order[node->first + i], point, hit);
        if (depth == 0)
            return;
        index = stack[--depth].node;
        distance_sq = stack[depth].distance_sq;
    }
}

static void pseudo_normal(const Mesh *mesh, const Hit *hit, double out[3]) {
    const MeshTree *tree = mesh->tree;
    if (hit->feature >= FEATURE_CORNER) {
        dvec_from_float(out,
                        tree->vertex_normals[mesh->triangles[hit->triangle][hit->feature - FEATURE_CORNER]]);
        return;
    }
    dvec_from_float(out, tree->face_normals[hit->triangle]);
    if (hit->feature == FEATURE_FACE)
        return;
    uint32_t other = tree->neighbours[hit->triangle][hit->feature - FEATURE_SIDE];
    if (other != UINT32_MAX) {
        double normal[3];
        dvec_from_float(normal, tree->face_normals[other]);
        dvec_add_scaled(out, out, 1.0, normal);
    }
}

static float signed_distance(const Mesh *mesh, const Hit *hit) {
    double normal[3], distance = sqrt(hit->distance_sq);
    pseudo_normal(mesh, hit, normal);
    return (float)(dvec_dot(hit->closest, normal) > 0.0 ? -distance : distance);
}

float mesh_distance(const Mesh *mesh, const float point[3], float closest[3]) {
    assert(mesh->tree);
    double p[3], position[3];
    dvec_from_float(p, point);
    Hit hit = {.distance_sq = INFINITY};
    search(mesh, p, &hit);
    if (closest) {
        dvec_add_scaled(position, p, 1.0, hit.closest);
        dvec_to_float(closest, position);
    }
    return signed_distance(mesh, &hit);
}

float mesh_distance_gradient(const Mesh *mesh, const float point[3], float gradient[3]) {
    assert(mesh->tree);
    double p[3], direction[3];
    dvec_from_float(p, point);
    Hit hit = {.distance_sq = INFINITY};
    search(mesh, p, &hit);
    const float distance = signed_distance(mesh, &hit);
    const double extent = fmax(fmax(fabs(p[0]), fabs(p[1])), fabs(p[2]));
    if (hit.distance_sq > 1e-16 * extent * extent)
        dvec_add_scaled(direction, (const double[3]){0, 0, 0}, distance < 0.0f ? 1.0 : -1.0, hit.closest);
    else
        pseudo_normal(mesh, &hit, direction);
    dvec_normalize(direction);
    dvec_to_float(gradient, direction);
    return distance;
}

/* Points of a batch are near each other as a rule, so the distance to the last point's triangle is a good
 * bound. It is widened, so that the search still meets the triangle that a search without a bound settles on:
 * the values are the same. */
static void query_batch(const Mesh *mesh, const float (*points)[4], uint32_t count, float *distances) {
    uint32_t last = mesh->tree->order[0];
    for (uint32_t i = 0; i < count; i++) {
        double p[3];
        dvec_from_float(p, points[i]);
        Hit bound = {.distance_sq = INFINITY};
        test_triangle(mesh, last, p, &bound);
        Hit hit = {.distance_sq = bound.distance_sq * (1.0 + 1e-12) + DBL_MIN};
        search(mesh, p, &hit);
        distances[i] = signed_distance(mesh, &hit);
        last = hit.triangle;
    }
}

void mesh_distances(const Mesh *mesh, const float (*points)[4], uint32_t count, float *distances,
                    int threads) {
    assert(mesh->tree);
    int64_t batches = ((int64_t)count + BATCH - 1) / BATCH;
#pragma omp parallel for schedule(static) num_threads(threads)
    for (int64_t b = 0; b < batches; b++) {
        uint32_t first = (uint32_t)b * BATCH, left = count - first;
        query_batch(mesh, points + first, left < BATCH ? left : BATCH, distances + first);
    }
}
