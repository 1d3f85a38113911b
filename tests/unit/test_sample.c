/* Boundary samples: distances, coverage, areas and normals on many shapes; exact grids; regions; thin plates;
 * refusals. */
#include "base/angle.h"
#include "base/random.h"
#include "mesh.h"
#include "sample.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static const char l_text[] = "v 0 0 0\nv 2 0 0\nv 2 1 0\nv 1 1 0\nv 1 2 0\nv 0 2 0\n"
                             "v 0 0 1\nv 2 0 1\nv 2 1 1\nv 1 1 1\nv 1 2 1\nv 0 2 1\n"
                             "f 4 3 2 1\nf 4 1 6 5\nf 10 7 8 9\nf 10 11 12 7\n"
                             "f 1 2 8 7\nf 2 3 9 8\nf 3 4 10 9\nf 4 5 11 10\nf 5 6 12 11\nf 6 1 7 12\n";

typedef struct Samples {
    SamplePoint *points;
    uint32_t count;
    double spacing;
    /* cells one spacing wide over the bounds of the points */
    double low[3];
    int size[3];
    uint32_t *heads, *next;
} Samples;

static double random_unit(uint64_t *counter) {
    return random_share(0, (*counter)++);
}

/* ---- Searching ---- */

static int cell_of(const Samples *samples, double x, int axis) {
    double cell = floor((x - samples->low[axis]) / samples->spacing);
    return (int)fmin(fmax(cell, 0.0), samples->size[axis] - 1);
}

static size_t cell_index(const Samples *samples, int x, int y, int z) {
    return ((size_t)z * (size_t)samples->size[1] + (size_t)y) * (size_t)samples->size[0] + (size_t)x;
}

static void index_samples(Samples *samples) {
    double high[3] = {-INFINITY, -INFINITY, -INFINITY};
    for (int k = 0; k < 3; k++)
        samples->low[k] = INFINITY;
    for (uint32_t i = 0; i < samples->count; i++)
        for (int k = 0; k < 3; k++) {
            samples->low[k] = fmin(samples->low[k], (double)samples->points[i].position[k]);
            high[k] = fmax(high[k], (double)samples->points[i].position[k]);
        }
    for (int k = 0; k < 3; k++)
        samples->size[k] = (int)((high[k] - samples->low[k]) / samples->spacing) + 1;
    size_t cells = cell_index(samples, 0, 0, samples->size[2]);
    samples->heads = malloc(cells * sizeof *samples->heads);
    samples->next = malloc(samples->count * sizeof *samples->next);
    assert_true(samples->heads && samples->next);
    memset(samples->heads, 0xff, cells * sizeof *samples->heads);
    for (uint32_t i = 0; i < samples->count; i++) {
        const float *p = samples->points[i].position;
        size_t cell = cell_index(samples, cell_of(samples, (double)p[0], 0),
                                 cell_of(samples, (double)p[1], 1), cell_of(samples, (double)p[2], 2));
        samples->next[i] = samples->heads[cell];
        samples->heads[cell] = i;
    }
}

/* Distance to the nearest sample but number `skip`, in spacings; right up to one spacing. `weights`, if not
 * NULL, gets the sum of the cubic spline of support 2 spacings (and of the same scale everywhere, which is
 * all that is compared). */
static double nearest(const Samples *samples, const double p[3], uint32_t skip, double *weights) {
    int low[3], high[3], reach = weights ? 2 : 1;
    double best_sq = INFINITY, sum = 0.0;
    for (int k = 0; k < 3; k++) {
        int cell = cell_of(samples, p[k], k);
        low[k] = cell - reach < 0 ? 0 : cell - reach;
        high[k] = cell + reach >= samples->size[k] ? samples->size[k] - 1 : cell + reach;
    }
    for (int z = low[2]; z <= high[2]; z++)
        for (int y = low[1]; y <= high[1]; y++)
            for (int x = low[0]; x <= high[0]; x++)
                for (uint32_t i = samples->heads[cell_index(samples, x, y, z)]; i != UINT32_MAX;
                     i = samples->next[i]) {
                    double d_sq = 0.0;
                    for (int k = 0; k < 3; k++) {
                        double d = (double)samples->points[i].position[k] - p[k];
                        d_sq += d * d;
                    }
                    if (i != skip && d_sq < best_sq)
                        best_sq = d_sq;
                    double q = sqrt(d_sq) / (2.0 * samples->spacing);
                    sum += q < 0.5   ? 6.0 * (q * q * q - q * q) + 1.0
                           : q < 1.0 ? 2.0 * pow(1.0 - q, 3.0)
                                     : 0.0;
                }
    if (weights)
        *weights = sum;
    return sqrt(best_sq) / samples->spacing;
}

static Samples sample(const Mesh *mesh, double spacing, const SampleRegion *region) {
    Samples samples = {.spacing = spacing};
    Err err = {0};
    if (!sample_surface(mesh, (float)spacing, region, 1000000, &samples.points, &samples.count, &err))
        fail_msg("%s", err.message);
    assert_non_null(samples.points);
    if (samples.count > 0)
        index_samples(&samples);
    return samples;
}

static void free_samples(Samples *samples) {
    free(samples->points);
    free(samples->heads);
    free(samples->next);
}

/* ---- What every sampling must fulfil ---- */

static double closest_pair(const Samples *samples) {
    double closest = INFINITY;
    for (uint32_t i = 0; i < samples->count; i++) {
        double p[3];
        for (int k = 0; k < 3; k++)
            p[k] = (double)samples->points[i].position[k];
        closest = fmin(closest, nearest(samples, p, i, NULL));
    }
    return closest;
}

static bool in_region(const SampleRegion *region, const double p[3], double slack) {
    for (int k = 0; region && k < 3; k++)
        if (p[k] < (double)region->min[k] - slack || p[k] > (double)region->max[k] + slack)
            return false;
    return true;
}

/* The largest distance from random points of the surface, a part of them on the sides and corners of
 * triangles. */
static double coverage(const Mesh *mesh, const Samples *samples, const SampleRegion *region, uint32_t tries) {
    double *areas = malloc(mesh->triangle_count * sizeof *areas), total = 0.0, worst = 0.0;
    uint64_t counter = 0;
    assert_non_null(areas);
    for (uint32_t t = 0; t < mesh->triangle_count; t++) {
        const float *a = mesh->vertices[mesh->triangles[t][0]], *b = mesh->vertices[mesh->triangles[t][1]],
                    *c = mesh->vertices[mesh->triangles[t][2]];
        double u[3], v[3];
        for (int k = 0; k < 3; k++) {
            u[k] = (double)b[k] - (double)a[k];
            v[k] = (double)c[k] - (double)a[k];
        }
        double x = u[1] * v[2] - u[2] * v[1], y = u[2] * v[0] - u[0] * v[2], z = u[0] * v[1] - u[1] * v[0];
        total += 0.5 * sqrt(x * x + y * y + z * z);
        areas[t] = total;
    }
    for (uint32_t i = 0; i < tries; i++) {
        double at = total * random_unit(&counter), u = random_unit(&counter), v = random_unit(&counter), p[3];
        uint32_t low = 0, high = mesh->triangle_count - 1;
        while (low < high) {
            uint32_t middle = (low + high) / 2;
            if (areas[middle] < at)
                low = middle + 1;
            else
                high = middle;
        }
        if (u + v > 1.0) {
            u = 1.0 - u;
            v = 1.0 - v;
        }
        if (i % 8 == 0)
            v = 0.0;
        if (i % 64 == 0)
            u = 0.0;
        for (int k = 0; k < 3; k++)
            p[k] = (1.0 - u - v) * (double)mesh->vertices[mesh->triangles[low][0]][k] +
                   u * (double)mesh->vertices[mesh->triangles[low][1]][k] +
                   v * (double)mesh->vertices[mesh->triangles[low][2]][k];
        if (in_region(region, p, 0.0))
            worst = fmax(worst, nearest(samples, p, UINT32_MAX, NULL));
    }
    free(areas);
    return worst;
}

static void check_points(Mesh *mesh, const Samples *samples, const SampleRegion *region, double area) {
    Err err = {0};
    double sum = 0.0;
    float extent = 0.0f;
    for (int k = 0; k < 3; k++)
        extent = fmaxf(extent, fmaxf(fabsf(mesh->min[k]), fabsf(mesh->max[k])));
    if (!mesh->tree)
        assert_true(mesh_build_tree(mesh, &err));
    for (uint32_t i = 0; i < samples->count; i++) {
        const SamplePoint *point = &samples->points[i];
        double p[3], length_sq = 0.0;
        for (int k = 0; k < 3; k++) {
            p[k] = (double)point->position[k];
            length_sq += (double)point->normal[k] * (double)point->normal[k];
        }
        assert_true(in_region(region, p, 1e-3 * samples->spacing));
        assert_true(fabsf(mesh_distance(mesh, point->position, NULL)) <= 1e-6f * extent);
        assert_true(fabs(length_sq - 1.0) < 1e-5);
        /* Outward: a small step along it leaves the solid. */
        float out[3];
        for (int k = 0; k < 3; k++)
            out[k] = point->position[k] + 0.01f * (float)samples->spacing * point->normal[k];
        assert_true(mesh_distance(mesh, out, NULL) > 0.0f);
        assert_true(point->area >= 0.0f);
        sum += (double)point->area;
    }
    assert_true(fabs(sum - area) < 1e-5 * area);
}

/* Returns the standard deviation over the mean of the boundary volumes 1 / sum W. */
static double check_quality(const char *name, Mesh *mesh, double spacing, const SampleRegion *region,
                            double area) {
    Samples samples = sample(mesh, spacing, region);
    assert_true(samples.count > 0);
    check_points(mesh, &samples, region, area);
    double gap = samples.count > 1 ? closest_pair(&samples) : 1.0;
    double reach = coverage(mesh, &samples, region, 20000 + 4 * samples.count);
    double sum = 0.0, square = 0.0;
    for (uint32_t i = 0; i < samples.count; i++) {
        double p[3], weights;
        for (int k = 0; k < 3; k++)
            p[k] = (double)samples.points[i].position[k];
        nearest(&samples, p, i, &weights);
        sum += 1.0 / weights;
        square += 1.0 / (weights * weights);
    }
    double mean = sum / samples.count, spread = sqrt(fmax(0.0, square / samples.count - mean * mean)) / mean;
    print_message(
        "%-24s %6u points, closest %.3f, farthest %.3f, points spacing^2 / area %.3f, psi +- %.3f\n", name,
        samples.count, gap, reach, samples.count * spacing * spacing / area, spread);
    if (gap < 0.6 || reach > 1.0)
        fail_msg("%s: closest pair %g (0.6 is allowed), farthest point %g (1.0 is allowed)", name, gap,
                 reach);
    free_samples(&samples);
    return spread;
}

static double mesh_area(const Mesh *mesh) {
    MeshMass mass;
    mesh_mass(mesh, &mass);
    return mass.area;
}

static Mesh make_box(float x0, float y0, float z0, float x1, float y1, float z1) {
    const float min[3] = {x0, y0, z0}, max[3] = {x1, y1, z1};
    Mesh mesh;
    Err err = {0};
    if (!mesh_make_box(min, max, &mesh, &err))
        fail_msg("%s", err.message);
    return mesh;
}

static Mesh make_sphere(float radius, int level) {
    const float centre[3] = {0.3f, -0.2f, 0.1f};
    Mesh mesh;
    Err err = {0};
    if (!mesh_make_sphere(centre, radius, level, &mesh, &err))
        fail_msg("%s", err.message);
    return mesh;
}

static Mesh parse(const char *text) {
    Mesh mesh;
    Err err = {0};
    if (!mesh_parse_obj("x.obj", text, strlen(text), &mesh, &err))
        fail_msg("%s", err.message);
    return mesh;
}

/* A prism of n sides; a smooth wall with sharp rims when n is large. */
static Mesh make_prism(int sides, double radius, double height) {
    size_t room = (size_t)sides * 128 + 64;
    char *text = malloc(room), *end = text;
    assert_non_null(text);
    for (int i = 0; i < sides; i++) {
        double phi = 2.0 * pi * i / sides, x = radius * cos(phi), z = radius * sin(phi);
        end += sprintf(end, "v %.9g 0 %.9g\nv %.9g %.9g %.9g\n", x, z, x, height, z);
    }
    for (int i = 0; i < sides; i++) {
        int j = (i + 1) % sides;
        end += sprintf(end, "f %d %d %d %d\n", 2 * i + 1, 2 * i + 2, 2 * j + 2, 2 * j + 1);
    }
    end += sprintf(end, "f");
    for (int i = 0; i < sides; i++)
        end += sprintf(end, " %d", 2 * i + 1);
    end += sprintf(end, "\nf");
    for (int i = sides; i > 0; i--)
        end += sprintf(end, " %d", 2 * i);
    sprintf(end, "\n");
    Mesh mesh = parse(text);
    free(text);
    return mesh;
}

static void check_mesh(const char *name, Mesh mesh, double spacing, double largest_spread) {
    double spread = check_quality(name, &mesh, spacing, NULL, mesh_area(&mesh));
    assert_true(spread < largest_spread);
    mesh_free(&mesh);
}

static void test_shapes(void **state) {
    (void)state;
    check_mesh("box", make_box(0.0f, 0.0f, 0.0f, 1.0f, 0.7f, 0.33f), 0.025, 0.06);
    check_mesh("box, odd spacing", make_box(-1.0f, 5.0f, 2.0f, 0.0f, 5.7f, 2.33f), 0.0613, 0.1);
    check_mesh("plate of 0.8 spacing", make_box(0.0f, 0.0f, 0.0f, 1.0f, 0.02f, 0.7f), 0.025, 0.1);
    check_mesh("sphere 4", make_sphere(0.5f, 4), 0.025, 0.03);
    check_mesh("sphere, fine mesh", make_sphere(0.5f, 5), 0.06, 0.03);
    check_mesh("sphere, coarse mesh", make_sphere(0.5f, 2), 0.02, 0.03);
    check_mesh("sphere of 2 spacings", make_sphere(0.5f, 4), 0.5, 0.1);
    check_mesh("L", parse(l_text), 0.05, 0.04);
    check_mesh("L, odd spacing", parse(l_text), 0.0713, 0.08);
    check_mesh("cylinder", make_prism(48, 0.3, 1.0), 0.025, 0.04);
    check_mesh("12-sided prism", make_prism(12, 0.3, 1.0), 0.025, 0.1);
    check_mesh("6-sided prism", make_prism(6, 0.3, 1.0), 0.025, 0.1);
    check_mesh("triangular prism", make_prism(3, 0.3, 1.0), 0.025, 0.1);

    enum { COUNT = 40 };
    float points[COUNT][3], normals[COUNT][3];
    for (int i = 0; i < COUNT; i++) {
        double y = 1.0 - (2.0 * i + 1.0) / COUNT, r = sqrt(1.0 - y * y), phi = 2.399963229728653 * i;
        const double n[3] = {r * cos(phi), y, r * sin(phi)};
        for (int k = 0; k < 3; k++)
            points[i][k] = normals[i][k] = (float)n[k];
    }
    Mesh mesh;
    Err err = {0};
    assert_true(mesh_make_planes((const float(*)[3])points, (const float(*)[3])normals, COUNT, &mesh, &err));
    check_mesh("polyhedron", mesh, 0.05, 0.06);
}

/* ---- Grids ---- */

/* All points are at multiples of `step` from `start`. */
static void expect_lattice(const Samples *samples, int axis, double start, double step, const char *what) {
    for (uint32_t i = 0; i < samples->count; i++) {
        double at = ((double)samples->points[i].position[axis] - start) / step;
        if (fabs(at - round(at)) > 1e-3)
            fail_msg("%s: point %u is %g steps along %c", what, i, at, "xyz"[axis]);
    }
}

/* The floor and the wet part of the walls of a tank of 4.95 m: regular throughout, edges and corners once. */
static void test_tank(void **state) {
    (void)state;
    const SampleRegion wet = {{-10.0f, -10.0f, -10.0f}, {10.0f, 1.01f, 10.0f}};
    Mesh mesh = make_box(-2.475f, 0.0f, -2.475f, 2.475f, 3.0f, 2.475f);
    Samples samples = sample(&mesh, 0.025, &wet);
    /* 198 cells along the sides; 1.01 m is 40.4 spacings: 40 cells of 0.02525 m. */
    assert_int_equal(samples.count, 199 * 199 + 40 * 4 * 198);
    expect_lattice(&samples, 0, -2.475, 0.025, "tank");
    expect_lattice(&samples, 1, 0.0, 0.02525, "tank");
    expect_lattice(&samples, 2, -2.475, 0.025, "tank");
    double gap = closest_pair(&samples), sum = 0.0, flat = 0.0;
    assert_true(fabs(gap - 1.0) < 1e-4); /* the floor's, and no point twice */
    for (uint32_t i = 0; i < samples.count; i++) {
        const SamplePoint *point = &samples.points[i];
        double p[3], weights;
        for (int k = 0; k < 3; k++)
            p[k] = (double)point->position[k];
        sum += (double)point->area;
        if (point->normal[1] > -0.99f || fabs(p[0]) > 2.42 || fabs(p[2]) > 2.42)
            continue;
        assert_float_equal(point->area, 0.025f * 0.025f, 1e-8f);
        nearest(&samples, p, i, &weights);
        flat = flat > 0.0 ? flat : weights;
        assert_true(fabs(weights / flat - 1.0) < 1e-4);
    }
    assert_true(fabs(sum - 4.95 * 4.95 - 4.0 * 4.95 * 1.01) < 1e-4);
    free_samples(&samples);
    mesh_free(&mesh);
}

/* The same turned about the vertical, and cut in the middle: still grids. */
static void test_turned_tank(void **state) {
    (void)state;
    const float one[3] = {1.0f, 1.0f, 1.0f}, turn[4] = {0.0f, 0.38268343f, 0.0f, 0.92387953f}, none[3] = {0};
    const SampleRegion wet = {{-10.0f, -10.0f, -10.0f}, {10.0f, 0.49f, 10.0f}};
    Mesh mesh = make_box(-1.0f, 0.0f, -1.0f, 1.0f, 3.0f, 1.0f);
    mesh_transform(&mesh, one, turn, none);
    Samples samples = sample(&mesh, 0.05, &wet);
    assert_int_equal(samples.count, 41 * 41 + 10 * 4 * 40);
    free_samples(&samples);
    check_quality("turned tank", &mesh, 0.05, &wet, 4.0 + 8.0 * 0.49);
    mesh_free(&mesh);

    /* A floor cut on all sides inside its edges, and the same floor in 200 triangles. */
    const SampleRegion middle = {{-0.4f, -1.0f, -0.3f}, {0.4f, 1.0f, 0.3f}};
    for (int parts = 1; parts <= 10; parts += 9) {
        char text[20000], *end = text;
        for (int j = 0; j <= parts; j++)
            for (int i = 0; i <= parts; i++)
                end += sprintf(end, "v %.9g 0 %.9g\n", 2.0 * i / parts - 1.0, 2.0 * j / parts - 1.0);
        for (int j = 0; j < parts; j++)
            for (int i = 0; i < parts; i++) {
                int corner = j * (parts + 1) + i + 1;
                end += sprintf(end, "f %d %d %d %d\n", corner, corner + parts + 1, corner + parts + 2,
                               corner + 1);
            }
        mesh = parse(text);
        samples = sample(&mesh, 0.05, NULL);
        assert_int_equal(samples.count, 41 * 41);
        expect_lattice(&samples, 0, -1.0, 0.05, "floor");
        expect_lattice(&samples, 2, -1.0, 0.05, "floor");
        assert_true(samples.points[0].normal[1] == 1.0f);
        free_samples(&samples);
        samples = sample(&mesh, 0.05, &middle);
        assert_int_equal(samples.count, 17 * 13);
        free_samples(&samples);
        mesh_free(&mesh);
    }
}

static uint32_t count_between(const Samples *samples, int axis, double low, double high) {
    uint32_t count = 0;
    for (uint32_t i = 0; i < samples->count; i++)
        count += (double)samples->points[i].position[axis] > low &&
                 (double)samples->points[i].position[axis] < high;
    return count;
}

/* True if there is a sample at the very place. */
static bool has_point(const Samples *samples, double x, double y, double z) {
    return nearest(samples, (double[3]){x, y, z}, UINT32_MAX, NULL) < 1e-4;
}

/* Edges: where they are, where they are not, and what stays within them. */
static void test_edges(void **state) {
    (void)state;
    /* An open sheet: its corners turn, though only two edges meet there. */
    Mesh mesh = parse("v 0 0 0\nv 2 0 0\nv 2 1.23 0\nv 0 1.23 0\nf 1 2 3 4\n");
    Samples samples = sample(&mesh, 0.05, NULL);
    assert_int_equal(samples.count, 41 * 26);
    free_samples(&samples);
    mesh_free(&mesh);

    /* The ends of the L are scattered, its walls are grids: nothing of the ends slips over the edge. */
    mesh = parse(l_text);
    samples = sample(&mesh, 0.05, NULL);
    assert_int_equal(count_between(&samples, 2, 0.001, 0.999), 160 * 19);
    assert_int_equal(count_between(&samples, 2, 0.04, 0.06), 160);
    free_samples(&samples);
    mesh_free(&mesh);

    /* No rectangles: edges are divided evenly all the same, sqrt(2) / 0.05 is nearest to 28. */
    mesh = parse("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 4 3\nf 1 2 4\nf 2 3 4\n");
    samples = sample(&mesh, 0.05, NULL);
    for (int i = 0; i <= 20; i++)
        assert_true(has_point(&samples, 0.05 * i, 0, 0) && has_point(&samples, 0, 0, 0.05 * i));
    for (int i = 0; i <= 28; i++)
        assert_true(has_point(&samples, i / 28.0, 1.0 - i / 28.0, 0));
    free_samples(&samples);
    mesh_free(&mesh);

    /* Facets that turn by 15 degrees are no edges, but large enough for grids, or too small. */
    mesh = make_prism(24, 1.0, 1.0);
    samples = sample(&mesh, 0.05, NULL);
    assert_int_equal(count_between(&samples, 1, 0.001, 0.999), 24 * 5 * 19);
    free_samples(&samples);
    samples = sample(&mesh, 0.1, NULL);
    assert_int_not_equal(count_between(&samples, 1, 0.099, 0.101), count_between(&samples, 1, 0.199, 0.201));
    free_samples(&samples);
    mesh_free(&mesh);

    /* An edge that ends in the middle of a rectangle's side: its point stays, the grid yields. */
    mesh =
        parse("v 0 0 0\nv 2 0 0\nv 2 0 1\nv 0.73 0 1\nv 0 0 1\nv 0 1 1\nv 0.73 1 1\nv 0.73 -1 1\nv 2 -1 1\n"
              "f 3 2 1\nf 4 3 1\nf 5 4 1\nf 4 5 6 7\nf 3 4 8 9\n");
    samples = sample(&mesh, 0.05, NULL);
    assert_true(has_point(&samples, 0.73, 0, 1) && has_point(&samples, 0, 0, 1) &&
                has_point(&samples, 1, 0, 0.5));
    double sum = 0.0, gap = closest_pair(&samples), reach = coverage(&mesh, &samples, NULL, 20000);
    for (uint32_t i = 0; i < samples.count; i++)
        sum += (double)samples.points[i].area;
    assert_true(gap >= 0.6 && reach <= 1.0 && fabs(sum - 4.0) < 1e-5);
    free_samples(&samples);
    mesh_free(&mesh);
}

/* A floor of 10 x 10 squares, turned in space, whose first triangle is a sliver: its normal is mostly
 * rounding. */
static void test_sliver_first(void **state) {
    (void)state;
    enum { PARTS = 10 };
    const float one[3] = {1.0f, 1.0f, 1.0f}, turn[4] = {0.2f, 0.3f, 0.1f, 0.927f}, none[3] = {0};
    char text[20000], *end = text;
    end += sprintf(end, "v 0.25 0.00005 0\n");
    for (int i = 0; i < (PARTS + 1) * (PARTS + 1); i++)
        end += sprintf(end, "v %g %g 0\n", 0.5 * (i % (PARTS + 1)), 0.5 * (i / (PARTS + 1)));
    end +=
        sprintf(end, "f 2 3 1\nf 3 %d 1\nf %d %d 1\nf %d 2 1\n", PARTS + 4, PARTS + 4, PARTS + 3, PARTS + 3);
    for (int i = 1; i < PARTS * PARTS; i++) {
        int corner = i / PARTS * (PARTS + 1) + i % PARTS + 2;
        end += sprintf(end, "f %d %d %d %d\n", corner, corner + 1, corner + PARTS + 2, corner + PARTS + 1);
    }
    Mesh mesh = parse(text);
    mesh_transform(&mesh, one, turn, none);
    Samples samples = sample(&mesh, 0.1, NULL);
    assert_int_equal(samples.count, 51 * 51);
    free_samples(&samples);
    mesh_free(&mesh);
}

/* From many points down to a few: every spacing keeps the distances. */
static void test_spacings(void **state) {
    (void)state;
    for (int sides = 3; sides <= 30; sides += 9) {
        for (double spacing = 0.055; spacing < 0.6; spacing *= 1.1) {
            Mesh mesh = make_prism(sides, 0.3, 0.37);
            Samples samples = sample(&mesh, spacing, NULL);
            double gap = closest_pair(&samples), reach = coverage(&mesh, &samples, NULL, 5000);
            if (gap < 0.6 || reach > 0.95)
                fail_msg("%d sides, spacing %g: closest pair %g, farthest point %g", sides, spacing, gap,
                         reach);
            free_samples(&samples);
            mesh_free(&mesh);
        }
    }
}

/* The two faces of a thin plate are the same grid; only across the plate are points near. */
static void test_thin_plate(void **state) {
    (void)state;
    Mesh mesh = make_box(0.0f, 0.0f, 0.0f, 1.0f, 0.005f, 0.5f);
    Samples samples = sample(&mesh, 0.025, NULL);
    assert_int_equal(samples.count, 2 * 41 * 21);
    expect_lattice(&samples, 0, 0.0, 0.025, "plate");
    expect_lattice(&samples, 1, 0.0, 0.005, "plate");
    expect_lattice(&samples, 2, 0.0, 0.025, "plate");
    check_points(&mesh, &samples, NULL, mesh_area(&mesh));
    assert_true(coverage(&mesh, &samples, NULL, 20000) < 1.0);
    free_samples(&samples);
    mesh_free(&mesh);

    /* A lens, thin towards its rim: each side by itself. */
    const float scale[3] = {1.0f, 0.02f, 1.0f}, none[4] = {0.0f, 0.0f, 0.0f, 1.0f}, still[3] = {0};
    mesh = make_sphere(0.5f, 5);
    mesh_transform(&mesh, scale, none, still);
    samples = sample(&mesh, 0.025, NULL);
    check_points(&mesh, &samples, NULL, mesh_area(&mesh));
    assert_true(coverage(&mesh, &samples, NULL, 20000) < 1.0);
    uint32_t upper = 0, kept = 0;
    float middle = 0.5f * (mesh.min[1] + mesh.max[1]);
    for (uint32_t i = 0; i < samples.count; i++)
        upper += samples.points[i].position[1] > middle;
    assert_in_range(upper, samples.count * 47 / 100, samples.count * 53 / 100);
    for (uint32_t i = 0; i < samples.count; i++)
        if (samples.points[i].normal[1] > 0.7f)
            samples.points[kept++] = samples.points[i];
    samples.count = kept;
    free(samples.heads);
    free(samples.next);
    index_samples(&samples);
    assert_true(closest_pair(&samples) > 0.6);
    free_samples(&samples);
    mesh_free(&mesh);
}

/* ---- Regions ---- */

static void test_regions(void **state) {
    (void)state;
    /* Half a sphere: area by symmetry. */
    Mesh mesh = make_sphere(0.5f, 4);
    const SampleRegion half = {{-9.0f, -9.0f, -9.0f}, {9.0f, -0.2f, 9.0f}};
    check_quality("half sphere", &mesh, 0.03, &half, 0.5 * mesh_area(&mesh));
    const SampleRegion away = {{5.0f, 5.0f, 5.0f}, {6.0f, 6.0f, 6.0f}};
    Samples samples = sample(&mesh, 0.03, &away);
    assert_int_equal(samples.count, 0);
    free_samples(&samples);
    mesh_free(&mesh);

    mesh = parse(l_text);
    const SampleRegion corner = {{0.5f, 0.5f, 0.25f}, {1.5f, 1.5f, 5.0f}};
    /* the top's three quarter squares, and the two inner walls */
    check_quality("L, inner corner", &mesh, 0.04, &corner, 0.75 + 2.0 * 0.5 * 0.75);
    mesh_free(&mesh);

    /* Lower than any water: a sliver of wall above the floor keeps the floor's points only. */
    mesh = make_box(0.0f, 0.0f, 0.0f, 1.0f, 1.0f, 1.0f);
    const SampleRegion sliver = {{-1.0f, -1.0f, -1.0f}, {2.0f, 0.002f, 2.0f}};
    check_quality("sliver", &mesh, 0.05, &sliver, 1.0 + 4.0 * 0.002);
    /* Turned rectangle, cut by slanted planes (seen from it): no rectangle any more. */
    const float one[3] = {1.0f, 1.0f, 1.0f}, turn[4] = {0.2f, 0.3f, 0.1f, 0.927f}, none[3] = {0};
    mesh_transform(&mesh, one, turn, none);
    const SampleRegion inside = {{-9.0f, -9.0f, -9.0f}, {9.0f, 9.0f, 9.0f}};
    check_quality("turned box", &mesh, 0.05, &inside, 6.0);
    samples = sample(&mesh, 0.05, &(SampleRegion){{0.0f, 0.0f, 0.0f}, {0.8f, 0.8f, 0.8f}});
    assert_true(samples.count > 100 && closest_pair(&samples) > 0.6);
    free_samples(&samples);
    mesh_free(&mesh);
}

/* A cylinder's rim is cut by the region in two places: the ring without corners is divided piece by piece. */
static void test_cut_ring(void **state) {
    (void)state;
    Mesh mesh = make_prism(64, 0.3, 0.6);
    for (int side = 0; side < 2; side++) {
        const SampleRegion part = {{side ? -9.0f : -0.05f, -9.0f, -9.0f}, {side ? 0.1f : 9.0f, 9.0f, 9.0f}};
        double sum = 0.0;
        Samples samples = sample(&mesh, 0.025, &part);
        for (uint32_t i = 0; i < samples.count; i++)
            sum += (double)samples.points[i].area;
        free_samples(&samples);
        check_quality("cut cylinder", &mesh, 0.025, &part, sum);
    }
    mesh_free(&mesh);
}

/* ---- The rest ---- */

static void test_same_again(void **state) {
    (void)state;
    Mesh mesh = make_sphere(0.5f, 3), shapes[2] = {mesh, parse(l_text)};
    for (int i = 0; i < 2; i++) {
        Samples a = sample(&shapes[i], 0.05, NULL), b = sample(&shapes[i], 0.05, NULL);
        assert_int_equal(a.count, b.count);
        assert_memory_equal(a.points, b.points, a.count * sizeof *a.points);
        free_samples(&a);
        free_samples(&b);
        mesh_free(&shapes[i]);
    }
}

static void expect_refusal(const Mesh *mesh, float spacing, const SampleRegion *region, uint32_t max_count,
                           const char *message) {
    SamplePoint *points = (SamplePoint *)1;
    uint32_t count = 1;
    Err err = {0};
    assert_false(sample_surface(mesh, spacing, region, max_count, &points, &count, &err));
    assert_null(points);
    assert_int_equal(count, 0);
    assert_int_equal(err.code, ERR_INPUT);
    if (!strstr(err.message, message))
        fail_msg("expected '%s', got '%s'", message, err.message);
}

static void test_refusals(void **state) {
    (void)state;
    Mesh mesh = make_box(0.0f, 0.0f, 0.0f, 1.0f, 1.0f, 1.0f), empty = {0};
    const SampleRegion turned = {{0.0f, 1.0f, 0.0f}, {1.0f, 0.0f, 1.0f}}, unknown = {{NAN, 0, 0}, {1, 1, 1}};
    expect_refusal(&mesh, 0.1f, NULL, 601, "602 points are needed; at most 601 are allowed");
    expect_refusal(&mesh, 1.0f / 1024.0f, NULL, 1000,
                   "about 6291456 points are needed; at most 1000 are allowed");
    expect_refusal(&mesh, 1e-9f, NULL, UINT32_MAX, "at most");
    expect_refusal(&mesh, 0.0f, NULL, 1000, "spacing 0 m");
    expect_refusal(&mesh, -1.0f, NULL, 1000, "spacing -1 m");
    expect_refusal(&mesh, NAN, NULL, 1000, "spacing nan m");
    expect_refusal(&mesh, INFINITY, NULL, 1000, "spacing inf m");
    expect_refusal(&mesh, 0.1f, &turned, 1000, "region from 1 to 0 m along y");
    expect_refusal(&mesh, 0.1f, &unknown, 1000, "region from nan to 1 m along x");
    expect_refusal(&empty, 0.1f, NULL, 1000, "no triangles");
    Samples samples = sample(&mesh, 0.1, NULL);
    assert_int_equal(samples.count, 602);
    free_samples(&samples);
    mesh.vertices[3][0] = NAN;
    expect_refusal(&mesh, 0.1f, NULL, 1000, "not finite");
    mesh_free(&mesh);
    mesh = parse("v 0 0 0\nv 100000 0 0\nv 100000 1e-7 0\nf 1 2 3\n");
    expect_refusal(&mesh, 0.03f, NULL, 1000, "long thin triangles");
    mesh_free(&mesh);
}

/* Random triangles in a small box, crossing, doubled, folded and degenerate: nothing is promised but an end,
 * a sum and coverage. */
static void test_rubbish(void **state) {
    (void)state;
    uint64_t counter = 77;
    for (int run = 0; run < 300; run++) {
        char text[4096], *end = text;
        int vertices = 4 + (int)(random_bits(0, counter++) % 12),
            faces = 1 + (int)(random_bits(0, counter++) % 30);
        for (int i = 0; i < vertices; i++) {
            end += sprintf(end, "v");
            for (int k = 0; k < 3; k++) /* coarse numbers: many coplanar, collinear and coinciding */
                end += sprintf(end, " %g", (double)(random_bits(0, counter++) % 5) * 0.2);
            end += sprintf(end, "\n");
        }
        for (int i = 0; i < faces; i++) {
            int a = (int)(random_bits(0, counter++) % (uint64_t)vertices), b = (a + 1) % vertices,
                c = (a + 2) % vertices;
            if (random_bits(0, counter++) % 2)
                c = (a + 3) % vertices;
            end += sprintf(end, "f %d %d %d\n", a + 1, b + 1, c + 1);
        }
        Mesh mesh;
        Err err = {0};
        if (!mesh_parse_obj("x", text, (size_t)(end - text), &mesh, &err))
            continue;
        const SampleRegion region = {{0.1f, -1.0f, 0.0f}, {0.7f, 0.5f, 0.4f}};
        for (int cut = 0; cut < 2; cut++) {
            Samples samples = sample(&mesh, 0.07, cut ? &region : NULL);
            double sum = 0.0;
            for (uint32_t i = 0; i < samples.count; i++)
                sum += (double)samples.points[i].area;
            assert_true(cut || fabs(sum - mesh_area(&mesh)) < 1e-3 * (1e-3 + mesh_area(&mesh)));
            assert_true(samples.count == 0 || coverage(&mesh, &samples, cut ? &region : NULL, 500) < 1.0);
            free_samples(&samples);
        }
        mesh_free(&mesh);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_shapes),       cmocka_unit_test(test_tank),
        cmocka_unit_test(test_turned_tank),  cmocka_unit_test(test_edges),
        cmocka_unit_test(test_sliver_first), cmocka_unit_test(test_spacings),
        cmocka_unit_test(test_thin_plate),   cmocka_unit_test(test_regions),
        cmocka_unit_test(test_cut_ring),     cmocka_unit_test(test_same_again),
        cmocka_unit_test(test_refusals),     cmocka_unit_test(test_rubbish),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
