/* Every shape in `cases` goes through the same conformance tests: sign against the parity of a ray through
 * the tessellation, distance against the mesh and against a dense cloud of surface points, gradient, bounds,
 * volume, batches. Then: side walls, refusals, shapes as tanks and bodies, and the meshes of assets/. */
#include "base/random.h"
#include "shape.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#define COUNT(table) ((int)(sizeof(table) / sizeof *(table)))
#define MESHES       SKIFF_SOURCE_DIR "/assets/meshes/"

static const float plane_points[5][3] = {{1, 0, 0}, {-1, 0, 0}, {0, 0.5f, 0}, {0, -0.5f, 0}, {0, 0, -0.7f}};
static const float plane_normals[5][3] = {{1, 0, 1}, {-1, 0, 1}, {0, 1, 0}, {0, -1, 0}, {0, 0, -1}};

/* volume: m^3 in closed form; 0: that of the mesh. sagitta: how far the mesh is from the shape at most, m. */
static const struct {
    const char *name;
    SkiffGeometryDef def;
    double volume, sagitta;
} cases[] = {
    {"box", {.kind = SKIFF_GEOMETRY_BOX, .size = {2, 1, 0.6f}}, 1.2, 0},
    {"sphere", {.kind = SKIFF_GEOMETRY_SPHERE, .radius = 0.8f}, 2.1446606, 3e-4},
    {"cylinder", {.kind = SKIFF_GEOMETRY_CYLINDER, .radius = 1, .height = 0.8f}, 2.5132741, 1e-4},
    {"star",
     {.kind = SKIFF_GEOMETRY_STAR, .radius = 1, .inner_radius = 0.5f, .height = 0.7f, .branches = 5},
     1.0286244,
     0},
    {"blunt star",
     {.kind = SKIFF_GEOMETRY_STAR, .radius = 1, .inner_radius = 1, .height = 0.7f, .branches = 3},
     1.8186533,
     0},
    {"sharp star",
     {.kind = SKIFF_GEOMETRY_STAR, .radius = 1, .inner_radius = 0.2f, .height = 3, .branches = 8},
     1.8368805,
     0},
    {"lozenge",
     {.kind = SKIFF_GEOMETRY_STAR, .radius = 1, .inner_radius = 0.5f, .height = 1, .branches = 2},
     1,
     0},
    {"cone", {.kind = SKIFF_GEOMETRY_CONE, .radius = 1, .top_radius = 0.4f, .height = 0.9f}, 1.4702653, 1e-4},
    {"wide cone",
     {.kind = SKIFF_GEOMETRY_CONE, .radius = 0.3f, .top_radius = 1, .height = 0.5f},
     0.7278023,
     1e-4},
    {"tip", {.kind = SKIFF_GEOMETRY_CONE, .radius = 0.8f, .top_radius = 0, .height = 1.2f}, 0.8042477, 1e-4},
    {"planes",
     {.kind = SKIFF_GEOMETRY_PLANES,
      .plane_points = plane_points,
      .plane_normals = plane_normals,
      .plane_count = 5},
     0,
     0},
    {"mesh", {.kind = SKIFF_GEOMETRY_MESH, .file = MESHES "pyramids.obj"}, 14.3333333, 0},
};

static const struct {
    const char *name;
    float scale[3], axis[3], angle, translation[3];
    double origin[3], volume; /* factor of the volume */
    bool uniform;
} placements[] = {
    {"as it is", {1, 1, 1}, {0, 1, 0}, 0, {0, 0, 0}, {0, 0, 0}, 1, true},
    {"turned, half as large, far away",
     {0.5f, 0.5f, 0.5f},
     {1, 2, -1},
     0.7f,
     {2001.5f, 1.25f, -999.75f},
     {2000, 1, -1000},
     0.125,
     true},
    {"mirrored", {1, -1, -1}, {1, 0, 1}, 2, {0.5f, 0, 0}, {0, 0, 0}, 1, true},
    {"stretched", {1, 0.5f, 1.5f}, {0, 0, 1}, 0.3f, {0, 0, 0}, {0, 0, 0}, 0.75, false},
};

static SkiffGeometryDef placed(int index, int placement) {
    SkiffGeometryDef def = cases[index].def;
    memcpy(def.scale, placements[placement].scale, sizeof def.scale);
    memcpy(def.rotation_axis, placements[placement].axis, sizeof def.rotation_axis);
    memcpy(def.translation, placements[placement].translation, sizeof def.translation);
    def.rotation_angle = placements[placement].angle;
    return def;
}

static Shape make(const SkiffGeometryDef *def, const double origin[3]) {
    Shape shape;
    Err err = {0};
    if (!shape_make(def, "Shape", origin, &shape, &err))
        fail_msg("%s", err.message);
    return shape;
}

/* ---- Random numbers by counter ---- */

static double random_unit(uint64_t *counter) {
    return random_share(0, (*counter)++);
}

/* In the bounds of the shape, widened by `margin` of their size each way. */
static void random_point(const Shape *shape, double margin, uint64_t *counter, float point[4]) {
    for (int k = 0; k < 3; k++) {
        const double min = (double)shape->min[k], size = (double)shape->max[k] - min;
        point[k] = (float)(min + size * ((1.0 + 2.0 * margin) * random_unit(counter) - margin));
    }
    point[3] = -1.0f;
}

/* ---- Independent answers ---- */

/* Does a skew ray from p cross the mesh an odd number of times? */
static bool inside_mesh(const Mesh *mesh, const float p[3]) {
    static const double ray[3] = {0.5734623, 0.6471239, 0.5024871};
    int crossings = 0;
    for (uint32_t t = 0; t < mesh->triangle_count; t++) {
        double v[3][3], a[3], b[3], h[3], q[3];
        for (int c = 0; c < 3; c++)
            for (int k = 0; k < 3; k++)
                v[c][k] = (double)mesh->vertices[mesh->triangles[t][c]][k] - (double)p[k];
        for (int k = 0; k < 3; k++) {
            a[k] = v[1][k] - v[0][k];
            b[k] = v[2][k] - v[0][k];
        }
        for (int k = 0; k < 3; k++) {
            h[k] = ray[(k + 1) % 3] * b[(k + 2) % 3] - ray[(k + 2) % 3] * b[(k + 1) % 3];
            q[k] = a[(k + 1) % 3] * v[0][(k + 2) % 3] - a[(k + 2) % 3] * v[0][(k + 1) % 3];
        }
        const double det = a[0] * h[0] + a[1] * h[1] + a[2] * h[2];
        const double u = -(v[0][0] * h[0] + v[0][1] * h[1] + v[0][2] * h[2]) / det;
        const double w = (ray[0] * q[0] + ray[1] * q[1] + ray[2] * q[2]) / det;
        const double s = (b[0] * q[0] + b[1] * q[1] + b[2] * q[2]) / det;
        crossings += u >= 0 && w >= 0 && u + w <= 1 && s > 0;
    }
    return crossings % 2 == 1;
}

typedef struct Cloud {
    float (*points)[3];
    size_t count;
} Cloud;

/* Points on the surface, none of which is farther than `spacing` from the next one. */
static Cloud make_cloud(const Mesh *mesh, double spacing) {
    Cloud cloud = {0};
    for (int fill = 0; fill < 2; fill++) {
        cloud.count = 0;
        for (uint32_t t = 0; t < mesh->triangle_count; t++) {
            const float *v[3];
            double longest = 0.0;
            for (int c = 0; c < 3; c++)
                v[c] = mesh->vertices[mesh->triangles[t][c]];
            for (int c = 0; c < 3; c++) {
                const float *p = v[c], *q = v[(c + 1) % 3];
                longest = fmax(longest, (double)hypotf(hypotf(p[0] - q[0], p[1] - q[1]), p[2] - q[2]));
            }
            const int n = (int)ceil(longest / spacing);
            for (int i = 0; i <= n; i++)
                for (int j = 0; i + j <= n; j++, cloud.count++)
                    for (int k = 0; fill && k < 3; k++) {
                        const double a = (double)i / n, b = (double)j / n;
                        cloud.points[cloud.count][k] = (float)(a * (double)v[0][k] + b * (double)v[1][k] +
                                                               (1.0 - a - b) * (double)v[2][k]);
                    }
        }
        if (!fill)
            cloud.points = malloc(cloud.count * sizeof *cloud.points);
        assert_non_null(cloud.points);
    }
    return cloud;
}

static double cloud_distance(const Cloud *cloud, const float p[3]) {
    float best = INFINITY;
    for (size_t i = 0; i < cloud->count; i++) {
        const float x = cloud->points[i][0] - p[0], y = cloud->points[i][1] - p[1],
                    z = cloud->points[i][2] - p[2];
        best = fminf(best, x * x + y * y + z * z);
    }
    return sqrt((double)best);
}

/* ---- One shape in one place ---- */

static void check_point(const Shape *shape, const Cloud *cloud, double sagitta, double spacing,
                        const float p[3], const char *name) {
    float gradient[3], foot[3], foot_gradient[3];
    const double d = (double)shape_distance(shape, p, gradient),
                 size = (double)shape->max[0] - (double)shape->min[0];
    const double rounding = 4e-6 * (1.0 + size + fabs(d));
    assert_true(shape_distance(shape, p, NULL) == (float)d);
    const double to_mesh = (double)mesh_distance(&shape->mesh, p, NULL);
    if (fabs(d - to_mesh) > sagitta + rounding)
        fail_msg("%s: %.7g at (%g, %g, %g), to the mesh %.7g", name, d, (double)p[0], (double)p[1],
                 (double)p[2], to_mesh);
    if (fabs(d) > 2.0 * sagitta + rounding && (d < 0.0) != inside_mesh(&shape->mesh, p))
        fail_msg("%s: %.7g at (%g, %g, %g) has the wrong sign", name, d, (double)p[0], (double)p[1],
                 (double)p[2]);
    const double nearest = cloud_distance(cloud, p);
    if (fabs(d) > nearest + sagitta + rounding || hypot(fabs(d), spacing) + sagitta + rounding < nearest)
        fail_msg("%s: %.7g at (%g, %g, %g), surface points at %.7g", name, d, (double)p[0], (double)p[1],
                 (double)p[2], nearest);
    const float length = hypotf(hypotf(gradient[0], gradient[1]), gradient[2]);
    assert_true(fabsf(length - 1.0f) < 1e-5f);
    for (int k = 0; k < 3; k++)
        foot[k] = (float)((double)p[k] - d * (double)gradient[k]);
    const double left = (double)shape_distance(shape, foot, foot_gradient);
    if (fabs(left) > 2.0 * rounding)
        fail_msg("%s: (%g, %g, %g) - %g gradient is %g m from the surface", name, (double)p[0], (double)p[1],
                 (double)p[2], d, left);
    assert_true(fabsf(hypotf(hypotf(foot_gradient[0], foot_gradient[1]), foot_gradient[2]) - 1.0f) < 1e-5f);
}

/* Slope along the gradient is 1 but on ridges; nowhere more than 1 between any two points. */
static void check_slopes(const Shape *shape, const char *name) {
    enum { POINTS = 2000 };
    uint64_t counter = 77;
    int steep = 0;
    float last[4];
    random_point(shape, 1.0, &counter, last);
    for (int i = 0; i < POINTS; i++) {
        float p[4], gradient[3], ahead[3], behind[3];
        double gap = 0.0;
        random_point(shape, 0.3, &counter, p);
        const double d = (double)shape_distance(shape, p, gradient);
        const float step = 1.0f / 256;
        for (int k = 0; k < 3; k++) {
            ahead[k] = p[k] + step * gradient[k];
            behind[k] = p[k] - step * gradient[k];
            gap += pow((double)p[k] - (double)last[k], 2);
        }
        const double change =
            (double)shape_distance(shape, ahead, NULL) - (double)shape_distance(shape, behind, NULL);
        steep += fabs(change - 2.0 * (double)step) < 1e-4;
        if (fabs(change) > 2.0 * (double)step + 1e-5)
            fail_msg("%s: slope %g at (%g, %g, %g)", name, 0.5 * change / (double)step, (double)p[0],
                     (double)p[1], (double)p[2]);
        if (fabs(d - (double)shape_distance(shape, last, NULL)) > sqrt(gap) + 1e-5)
            fail_msg("%s: steeper than 1 between two points", name);
        memcpy(last, p, sizeof last);
    }
    if (steep < POINTS * 9 / 10)
        fail_msg("%s: slope 1 at %d of %d points only", name, steep, (int)POINTS);
}

static void check_bounds(const Shape *shape, const Cloud *cloud, double sagitta, const char *name) {
    float min[3] = {INFINITY, INFINITY, INFINITY}, max[3] = {-INFINITY, -INFINITY, -INFINITY};
    for (size_t i = 0; i < cloud->count; i++)
        for (int k = 0; k < 3; k++) {
            min[k] = fminf(min[k], cloud->points[i][k]);
            max[k] = fmaxf(max[k], cloud->points[i][k]);
        }
    for (int k = 0; k < 3; k++) {
        const double low = (double)min[k] - (double)shape->min[k],
                     high = (double)shape->max[k] - (double)max[k];
        if (low < -1e-5 || low > sagitta + 1e-5 || high < -1e-5 || high > sagitta + 1e-5)
            fail_msg("%s: bounds of axis %d are %g and %g from the surface", name, k, low, high);
    }
}

static void check_volume(const Shape *shape, double expected, const char *name) {
    enum { POINTS = 60000 };
    MeshMass mass;
    mesh_mass(&shape->mesh, &mass);
    if (expected > 0.0 && fabs(shape->volume - expected) > (shape->analytic ? 1e-6 : 1e-3) * expected)
        fail_msg("%s: volume %.8g, expected %.8g", name, shape->volume, expected);
    if (fabs(shape->volume - mass.volume) > 1e-3 * mass.volume)
        fail_msg("%s: volume %g, of the mesh %g", name, shape->volume, mass.volume);
    static float points[POINTS][4], distance[POINTS];
    uint64_t counter = 5;
    double box = 1.0, inside = 0.0;
    for (int k = 0; k < 3; k++)
        box *= (double)shape->max[k] - (double)shape->min[k];
    for (int i = 0; i < POINTS; i++)
        random_point(shape, 0.0, &counter, points[i]);
    shape_distances(shape, (const float(*)[4])points, POINTS, distance, 2);
    for (int i = 0; i < POINTS; i++)
        inside += distance[i] < 0.0f;
    const double share = shape->volume / box, sigma = sqrt(share * (1.0 - share) / POINTS);
    if (fabs(inside / POINTS - share) > 4.0 * sigma + 1e-9)
        fail_msg("%s: %g of the points are inside, expected %g", name, inside / POINTS, share);
}

/* Counts that fill no whole batch, vector or part; some points exactly on the axis. */
static void check_batches(const Shape *shape, const char *name) {
    enum { POINTS = 2 * 1024 + 77 };
    static float points[POINTS][4], batch[POINTS + 1];
    uint64_t counter = 3;
    for (int i = 0; i < POINTS; i++) {
        random_point(shape, i % 5 == 0 ? 20.0 : 0.2, &counter, points[i]);
        if (i % 50 == 0)
            memcpy(points[i], shape->centre, sizeof shape->centre);
    }
    for (int sides = 0; sides < 2; sides++)
        for (int threads = 1; threads < 4; threads++) {
            batch[POINTS] = 123.0f;
            (sides ? shape_distances_sides : shape_distances)(shape, (const float(*)[4])points, POINTS, batch,
                                                              threads);
            assert_true(batch[POINTS] == 123.0f);
            for (int i = 0; i < POINTS; i++) {
                const float one = (sides ? shape_distance_sides : shape_distance)(shape, points[i], NULL);
                if (memcmp(&one, &batch[i], sizeof one) != 0)
                    fail_msg("%s: %.9g alone, %.9g in a batch", name, (double)one, (double)batch[i]);
            }
        }
}

static void shapes_conform(void **state) {
    (void)state;
    for (int c = 0; c < COUNT(cases); c++)
        for (int p = 0; p < COUNT(placements); p++) {
            char name[128];
            snprintf(name, sizeof name, "%s, %s", cases[c].name, placements[p].name);
            const SkiffGeometryDef def = placed(c, p);
            Shape shape = make(&def, placements[p].origin);
            const bool closed_form =
                def.kind == SKIFF_GEOMETRY_BOX || (placements[p].uniform && def.kind != SKIFF_GEOMETRY_MESH &&
                                                   def.kind != SKIFF_GEOMETRY_PLANES);
            assert_int_equal(shape.analytic, closed_form);
            const double sagitta = shape.analytic ? cases[c].sagitta : 0.0;
            const double spacing = 0.03 * ((double)shape.max[0] - (double)shape.min[0]);
            Cloud cloud = make_cloud(&shape.mesh, spacing);
            uint64_t counter = 1;
            for (int i = 0; i < 120; i++) {
                float point[4];
                random_point(&shape, i % 4 == 0 ? 2.0 : 0.1, &counter, point);
                check_point(&shape, &cloud, sagitta, spacing, point, name);
            }
            check_slopes(&shape, name);
            check_bounds(&shape, &cloud, sagitta, name);
            check_volume(&shape, cases[c].volume * placements[p].volume, name);
            check_batches(&shape, name);
            free(cloud.points);
            shape_free(&shape);
            shape_free(&shape);
        }
}

/* ---- Side walls ---- */

/* The side walls are those of a shape so high that floor and lid are out of reach. */
static void sides_go_on(void **state) {
    (void)state;
    static const double origin[3] = {0};
    for (int c = 0; c < COUNT(cases); c++) {
        SkiffGeometryDef def = placed(c, 0), high = def;
        Shape shape = make(&def, origin);
        const double longer = 12.0, thin = 0.01,
                     slope = (double)(def.top_radius - def.radius) / (double)def.height;
        double up = longer, down = longer;
        if (def.kind == SKIFF_GEOMETRY_CONE) { /* up or down nearly to the tip */
            up = slope < 0.0 ? ((double)def.top_radius - thin) / -slope : up;
            down = slope > 0.0 ? ((double)def.radius - thin) / slope : down;
            high.radius = slope > 0.0 ? (float)thin : (float)((double)def.radius - slope * down);
            high.top_radius = slope < 0.0 ? (float)thin : (float)((double)def.top_radius + slope * up);
        }
        high.height = (float)((double)def.height + up + down);
        high.size[1] = 2.0f * (float)longer;
        Shape tall = make(&high, origin);
        uint64_t counter = 9;
        int compared = 0;
        for (int i = 0; i < 2000; i++) {
            float p[4], q[3], gradient[3], tall_gradient[3];
            random_point(&shape, i % 2 ? 0.1 : 1.0, &counter, p);
            memcpy(q, p, sizeof q);
            if (def.kind == SKIFF_GEOMETRY_CONE)
                q[1] = (float)((double)p[1] + 0.5 * (down - up));
            const float sides = shape_distance_sides(&shape, p, gradient);
            if (def.kind == SKIFF_GEOMETRY_SPHERE || !shape.analytic) {
                assert_true(sides == shape_distance(&shape, p, NULL));
                continue;
            }
            const float expected = shape_distance(&tall, q, tall_gradient);
            if (fabsf(q[1] - sides * gradient[1]) > tall.half[1] - 0.1f)
                continue; /* nearest to the side where the tall shape has ended */
            compared++;
            if (fabsf(sides - expected) > 3e-4f)
                fail_msg("%s: %g to the sides at (%g, %g, %g), expected %g", cases[c].name, (double)sides,
                         (double)p[0], (double)p[1], (double)p[2], (double)expected);
            assert_true(fabsf(hypotf(hypotf(gradient[0], gradient[1]), gradient[2]) - 1.0f) < 1e-5f);
            assert_true(gradient[0] * tall_gradient[0] + gradient[1] * tall_gradient[1] +
                            gradient[2] * tall_gradient[2] >
                        0.99f);
        }
        assert_true(compared > 1500 || def.kind == SKIFF_GEOMETRY_SPHERE || !shape.analytic);
        shape_free(&shape);
        shape_free(&tall);
    }
}

static void axes_point_where_they_should(void **state) {
    (void)state;
    static const double origin[3] = {0};
    SkiffGeometryDef def = skiff_geometry_default();
    def.kind = SKIFF_GEOMETRY_STAR;
    Shape star = make(&def, origin);
    assert_true(fabsf(shape_distance(&star, (const float[3]){0, 0, 1}, NULL)) < 1e-6f);
    assert_true(shape_distance(&star, (const float[3]){0, 0, -0.9f}, NULL) > 0.2f);
    shape_free(&star);
    def.kind = SKIFF_GEOMETRY_CONE; /* 1 m at the bottom, 0.5 m at the top */
    Shape cone = make(&def, origin);
    assert_true(shape_distance(&cone, (const float[3]){0.9f, -0.45f, 0}, NULL) < 0.0f);
    assert_true(shape_distance(&cone, (const float[3]){0.9f, 0.45f, 0}, NULL) > 0.2f);
    /* without its lid it ends in a tip at y = 1.5 */
    assert_true(fabsf(shape_distance_sides(&cone, (const float[3]){0, 2.5f, 0}, NULL) - 1.0f) < 1e-5f);
    assert_true(shape_distance_sides(&cone, (const float[3]){0, 1.4f, 0}, NULL) < 0.0f);
    shape_free(&cone);
}

/* ---- Refusals ---- */

static void bad_shapes_are_refused(void **state) {
    (void)state;
    static const struct {
        SkiffGeometryDef def;
        const char *message;
    } bad[] = {
        {{.kind = SKIFF_GEOMETRY_NONE}, "S: has no geometry"},
        {{.kind = SKIFF_GEOMETRY_CYLINDER, .radius = -1, .height = 1}, "S.radius: -1 m, must be above 0"},
        {{.kind = SKIFF_GEOMETRY_CYLINDER, .radius = 1, .height = NAN}, "S.height: nan m, must be above 0"},
        {{.kind = SKIFF_GEOMETRY_CONE, .radius = 1, .top_radius = -1, .height = 1},
         "S.topRadius: -1 m, must be 0 or above"},
        {{.kind = SKIFF_GEOMETRY_STAR, .radius = 1, .inner_radius = 2, .height = 1, .branches = 5},
         "S.innerRadius: 2 m, must be above 0 and at most the radius, 1 m"},
        {{.kind = SKIFF_GEOMETRY_STAR, .radius = 1, .inner_radius = 1, .height = 1, .branches = 1},
         "S.branches: 1, must be 2 to 64"},
        {{.kind = SKIFF_GEOMETRY_MESH, .file = "/nowhere.obj"}, "S: /nowhere.obj: "},
    };
    static const double origin[3] = {0};
    for (int i = 0; i < COUNT(bad); i++) {
        SkiffGeometryDef def = bad[i].def;
        def.scale[0] = def.scale[1] = def.scale[2] = 1;
        Shape shape;
        static const Shape empty;
        Err err = {0};
        memset(&shape, 1, sizeof shape);
        assert_false(shape_make(&def, "S", origin, &shape, &err));
        if (strncmp(err.message, bad[i].message, strlen(bad[i].message)) != 0)
            fail_msg("expected '%s', got '%s'", bad[i].message, err.message);
        assert_memory_equal(&shape, &empty, sizeof shape);
        shape_free(&shape);
    }
}

/* ---- In a simulation ---- */

static SkiffSim *start(const SkiffDef *def) {
    Err err = {0};
    SkiffSim *sim = skiff_create(def, &err);
    if (!sim)
        fail_msg("%s", err.message);
    return sim;
}

static void every_shape_is_a_tank(void **state) {
    (void)state;
    for (int c = 0; c < COUNT(cases); c++) {
        SkiffDef def = skiff_def_default();
        SkiffBlockDef block = skiff_block_default();
        Err err = {0};
        def.params.particle_radius = 0.04f;
        def.threads = 1;
        def.tank.open = false;
        def.tank.geometry = placed(c, 0);
        for (int k = 0; k < 3; k++) {
            block.start[k] = -0.12f;
            block.end[k] = 0.12f;
            if (def.tank.geometry.kind == SKIFF_GEOMETRY_MESH)
                block.start[1] = 0.2f, block.end[1] = 0.5f;
        }
        def.blocks = &block;
        def.block_count = 1;
        SkiffSim *sim = start(&def);
        Shape shape = make(&def.tank.geometry, (const double[3]){0, 0, 0});
        for (int s = 0; s < 60; s++)
            if (!skiff_step(sim, &err))
                fail_msg("%s: %s", cases[c].name, err.message);
        const SkiffParticles water = skiff_particles(sim);
        assert_true(water.count >= 27);
        for (uint32_t i = 0; i < water.count; i++)
            if (shape_distance(&shape, water.position[i], NULL) > 0.0f)
                fail_msg("%s: water outside", cases[c].name);
        shape_free(&shape);
        skiff_destroy(sim);
    }
}

static void every_shape_is_a_body(void **state) {
    (void)state;
    for (int c = 0; c < COUNT(cases); c++) {
        SkiffDef def = skiff_def_default();
        SkiffBodyDef body = skiff_body_default();
        body.name = "body";
        body.geometry = placed(c, 1);
        body.density = 500;
        def.params.particle_radius = 0.04f;
        def.threads = 1;
        def.bodies = &body;
        def.body_count = 1;
        SkiffSim *sim = start(&def);
        Shape shape = make(&body.geometry, (const double[3]){0, 0, 0});
        const SkiffBody seen = skiff_body(sim, 0);
        assert_true(fabs(seen.mass - 500.0 * shape.volume) < 1e-3 * seen.mass);
        assert_true(seen.sample_count > 50);
        shape_free(&shape);
        skiff_destroy(sim);
    }
}

/* ---- The meshes of assets/ ---- */

/* Volume, m^3; inertia about the three axes for 1000 kg/m^3, kg m^2; both summed over tetrahedra by another
 * program. */
static const struct {
    const char *file;
    double volume, inertia[3];
    const char *materials; /* all, in the order of the file */
} meshes[] = {
    {"boat.obj", 3.3716, {768.3, 2319, 2180}, "hull bottom stripe deck cabin glass"},
    {"blunt.obj", 2.9416, {620.1, 2195, 1884}, "hull deck"},
    {"buoy.obj", 0.2688, {18.79, 23.61, 18.79}, "body ring mark"},
    {"crate.obj", 0.1660, {7.084, 11.60, 8.865}, "wood iron"},
    {"harbour.obj", 51.5783, {48520, 435590, 437850}, "stone coping iron white red lamp"},
    {"wedge.obj", 7.0478, {6671, 3015, 8354}, ""},
    {"pyramids.obj", 14.3333, {48671, 6233, 48671}, ""},
};

static void meshes_are_bodies(void **state) {
    (void)state;
    for (int m = 0; m < COUNT(meshes); m++) {
        char path[512], names[256] = "";
        snprintf(path, sizeof path, "%s%s", MESHES, meshes[m].file);
        SkiffDef def = skiff_def_default();
        SkiffBodyDef body = skiff_body_default();
        body.name = "body";
        body.geometry.kind = SKIFF_GEOMETRY_MESH;
        body.geometry.file = path;
        def.params.particle_radius = 0.1f;
        def.threads = 1;
        def.bodies = &body;
        def.body_count = 1;
        SkiffSim *sim = start(&def);
        const SkiffBody seen = skiff_body(sim, 0);
        if (fabs(seen.mass / 1000.0 - meshes[m].volume) > 1e-3 * meshes[m].volume)
            fail_msg("%s: volume %.6g, expected %.6g", meshes[m].file, seen.mass / 1000.0, meshes[m].volume);
        for (int k = 0; k < 3; k++)
            if (fabs(seen.inertia[k][k] - meshes[m].inertia[k]) > 1e-3 * meshes[m].inertia[k])
                fail_msg("%s: inertia %d is %g, expected %g", meshes[m].file, k, seen.inertia[k][k],
                         meshes[m].inertia[k]);
        for (int i = 0; *skiff_body_material_name(sim, 0, i); i++)
            snprintf(names + strlen(names), sizeof names - strlen(names), "%s%s", i ? " " : "",
                     skiff_body_material_name(sim, 0, i));
        assert_string_equal(names, meshes[m].materials);
        assert_int_equal(skiff_body_materials(sim, 0) != NULL, *meshes[m].materials != '\0');
        skiff_destroy(sim);
    }
}

/* What the header of boat.obj says: 1480 kg of water below y = 0, no trim, stable. By columns of a grid. */
static void the_boat_floats_on_its_lines(void **state) {
    (void)state;
    static const double cell = 0.02, origin[3] = {0};
    enum { COLUMN = 64 };
    SkiffGeometryDef def = skiff_geometry_default();
    def.kind = SKIFF_GEOMETRY_MESH;
    def.file = MESHES "boat.obj";
    Shape boat = make(&def, origin);
    MeshMass mass;
    mesh_mass(&boat.mesh, &mass);
    const int depth = (int)ceil(-(double)boat.min[1] / cell);
    double volume = 0.0, moment_x = 0.0, moment_y = 0.0, waterplane = 0.0;
    assert_true(depth <= COLUMN);
    for (double x = (double)boat.min[0]; x < (double)boat.max[0]; x += cell)
        for (double z = 0.5 * cell; z < (double)boat.max[2]; z += cell) {
            float points[COLUMN][4], distance[COLUMN];
            for (int i = 0; i < depth; i++) {
                const float p[4] = {(float)x, (float)(-((double)i + 0.5) * cell), (float)z, 0};
                memcpy(points[i], p, sizeof p);
            }
            shape_distances(&boat, (const float(*)[4])points, (uint32_t)depth, distance, 1);
            for (int i = 0; i < depth; i++) {
                /* a cell that the surface cuts counts in part */
                const double part = fmin(fmax(0.5 - (double)distance[i] / cell, 0.0), 1.0);
                volume += 2.0 * cell * cell * cell * part;
                moment_x += 2.0 * cell * cell * cell * part * x;
                moment_y += 2.0 * cell * cell * cell * part * (double)points[i][1];
                waterplane += i == 0 ? 2.0 * cell * cell * part * z * z : 0.0;
            }
        }
    const double metacentric = moment_y / volume + waterplane / volume - mass.centre[1];
    assert_true(fabs(volume - 1.48) < 0.01);
    assert_true(fabs(moment_x / volume) < 0.005 && fabs(mass.centre[0]) < 1e-3 &&
                fabs(mass.centre[2]) < 1e-4);
    assert_true(fabs(metacentric - 0.17) < 0.02);
    assert_true(fabs((double)boat.max[0] - (double)boat.min[0] - 3.5) < 0.05);
    assert_true(fabs((double)boat.max[2] - (double)boat.min[2] - 1.7) < 0.01);
    shape_free(&boat);
}

/* The stem and the coaming are thinner than two offsets; the rest gets all of it, and nothing sticks out. */
static void samples_of_the_boat_lie_behind_its_surface(void **state) {
    (void)state;
    SkiffDef def = skiff_def_default();
    SkiffBodyDef body = skiff_body_default();
    body.name = "boat";
    body.geometry.kind = SKIFF_GEOMETRY_MESH;
    body.geometry.file = MESHES "boat.obj";
    def.params.particle_radius = 0.04f;
    def.params.boundary_offset = 1.15f;
    def.threads = 1;
    def.bodies = &body;
    def.body_count = 1;
    SkiffSim *sim = start(&def);
    Shape boat = make(&body.geometry, (const double[3]){0, 0, 0});
    SkiffBoundary samples;
    skiff_boundary_samples(sim, true, &samples);
    assert_true(samples.count > 5000);
    float *distance = malloc(samples.count * sizeof *distance);
    assert_non_null(distance);
    shape_distances(&boat, samples.position, samples.count, distance, 1);
    uint32_t deep = 0;
    for (uint32_t s = 0; s < samples.count; s++) {
        assert_true(distance[s] < 1e-5f);
        deep += fabsf(distance[s] + 1.15f * 0.04f) < 0.1f * 0.04f;
    }
    assert_true(deep > samples.count * 7 / 10);
    free(distance);
    shape_free(&boat);
    skiff_destroy(sim);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(shapes_conform),
        cmocka_unit_test(sides_go_on),
        cmocka_unit_test(axes_point_where_they_should),
        cmocka_unit_test(bad_shapes_are_refused),
        cmocka_unit_test(every_shape_is_a_tank),
        cmocka_unit_test(every_shape_is_a_body),
        cmocka_unit_test(meshes_are_bodies),
        cmocka_unit_test(the_boat_floats_on_its_lines),
        cmocka_unit_test(samples_of_the_boat_lie_behind_its_surface),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
