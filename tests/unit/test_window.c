/* Windows that move: still water does not notice, and whatever goes wrong is said. */
#include "engine/sim.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

#include "refuse.h"

typedef struct Scene {
    SkiffDef def;
    SkiffBodyDef body;
    double path[2][3];
} Scene;

/* A round window over half a metre of water, a few thousand particles, that is drawn 3 m along x in 2 s. */
static void scene_make(Scene *scene) {
    *scene = (Scene){.def = skiff_def_default(), .body = skiff_body_default(), .path = {{0}, {2, 3, 0}}};
    SkiffDef *def = &scene->def;
    def->threads = 1;
    def->params.particle_radius = 0.04f;
    def->params.time_step = 0.005f;
    def->params.boundary_offset = 1.15f;
    def->params.rest_steps = 10;
    def->tank.geometry.kind = SKIFF_GEOMETRY_CYLINDER;
    def->tank.geometry.radius = 0.8f;
    def->tank.geometry.height = 1.2f;
    def->tank.geometry.translation[1] = 0.6f;
    def->tank.wet_height = 1.0f;
    def->sea = (SkiffSeaDef){.on = true, .level = 0.5f, .path = scene->path, .path_count = 2, .absorb = true};
    scene->body.name = "box";
    scene->body.geometry.kind = SKIFF_GEOMETRY_BOX;
    for (int k = 0; k < 3; k++)
        scene->body.geometry.size[k] = 0.3f;
    scene->body.geometry.translation[1] = 0.5f;
    scene->body.free_axes = 0;
}

static void follow_body(Scene *scene) {
    scene->def.bodies = &scene->body;
    scene->def.body_count = 1;
    scene->def.sea.follow = "box";
    scene->def.sea.path_count = 0;
}

static SkiffSim *accept(const Scene *scene) {
    Err err = {0};
    SkiffSim *sim = skiff_create(&scene->def, &err);
    if (sim == NULL)
        fail_msg("%s", err.message);
    return sim;
}

static void step(SkiffSim *sim) {
    Err err = {0};
    if (!skiff_step(sim, &err))
        fail_msg("%s", err.message);
}

/* Steps until there were `wanted` moves; none of them may be felt. */
static void expect_silence(SkiffSim *sim, uint64_t wanted) {
    step(sim);
    const uint32_t count = skiff_particles(sim).count;
    const double height = skiff_stats(sim)->mean_height;
    uint64_t moves = 0;
    for (int k = 0; k < 500 && moves < wanted; k++) {
        step(sim);
        const SkiffStats *stats = skiff_stats(sim);
        moves += stats->moved;
        assert_true(stats->max_speed < 0.05);
        assert_true(stats->density_iterations <= 3); /* the least is 2 */
        assert_true(fabs(stats->mean_height - height) < 0.002);
        assert_true(fabs((double)stats->particles / count - 1.0) < 0.02); /* who is in at the ends varies */
    }
    assert_int_equal(moves, wanted);
}

/* The world's water is at rest, wherever it was laid: nothing moves, nothing has to be solved for, and a
 * window that comes back finds what it left. */
static void test_still_water(void **state) {
    (void)state;
    Scene scene;
    scene_make(&scene);
    SkiffSim *sim = accept(&scene);
    expect_silence(sim, 7);
    skiff_destroy(sim);
}

static void test_every_shape(void **state) {
    (void)state;
    static const SkiffGeometryKind kinds[] = {SKIFF_GEOMETRY_BOX, SKIFF_GEOMETRY_SPHERE, SKIFF_GEOMETRY_STAR,
                                              SKIFF_GEOMETRY_CONE};
    for (size_t k = 0; k < sizeof kinds / sizeof *kinds; k++) {
        Scene scene;
        scene_make(&scene);
        SkiffGeometryDef *tank = &scene.def.tank.geometry;
        tank->kind = kinds[k];
        tank->size[0] = tank->size[2] = 1.4f;
        tank->size[1] = 1.2f;
        tank->branches = 5;
        tank->radius = 0.9f;
        tank->inner_radius = 0.7f;
        tank->top_radius = 0.6f;
        tank->translation[1] = kinds[k] == SKIFF_GEOMETRY_SPHERE ? 0.5f : 0.6f;
        SkiffSim *sim = accept(&scene);
        expect_silence(sim, 2);
        skiff_destroy(sim);
    }
}

/* Both kinds of edge, the paper's walls and water, keep an old particle where it is in the world. */
static void test_particles_stay(void **state) {
    (void)state;
    for (int edge = SKIFF_WINDOW_EDGE_WALLS; edge <= SKIFF_WINDOW_EDGE_WATER; edge++) {
        Scene scene;
        scene_make(&scene);
        scene.def.params.window_edge = edge;
        scene.def.params.sea_steps = 10;
        SkiffSim *sim = accept(&scene);
        while (skiff_stats(sim)->step == 0 || !skiff_stats(sim)->moved) {
            const SkiffParticles before = skiff_particles(sim);
            uint64_t id = UINT64_MAX;
            double at[3] = {0};
            for (uint32_t i = 0; i < before.count && id == UINT64_MAX; i++)
                if (fabsf(before.position[i][0] - 0.2f) < 0.1f && fabsf(before.position[i][2]) < 0.1f) {
                    id = before.id[i];
                    for (int k = 0; k < 3; k++)
                        at[k] = (double)before.position[i][k] + before.origin[k];
                }
            step(sim);
            const SkiffParticles after = skiff_particles(sim);
            bool found = false;
            for (uint32_t i = 0; i < after.count && !found; i++) {
                found = after.id[i] == id;
                for (int k = 0; k < 3 && found; k++)
                    assert_true(fabs((double)after.position[i][k] + after.origin[k] - at[k]) < 0.005);
            }
            assert_true(found);
        }
        skiff_destroy(sim);
    }
}

/* An obstacle that the window comes to stands in water that fits it, and is left behind. */
static void test_path_into_an_obstacle(void **state) {
    (void)state;
    Scene scene;
    scene_make(&scene);
    scene.body.geometry.translation[0] = 1.5f;
    scene.body.geometry.size[1] = 1.5f;
    scene.def.bodies = &scene.body;
    scene.def.body_count = 1;
    SkiffSim *sim = accept(&scene);
    for (int k = 0; k < 400; k++) {
        step(sim);
        assert_true(skiff_stats(sim)->max_speed < 3.0);
        const SkiffParticles particles = skiff_particles(sim);
        for (uint32_t i = 0; i < particles.count; i++) {
            const double x = (double)particles.position[i][0] + particles.origin[0] - 1.5;
            const double z = (double)particles.position[i][2] + particles.origin[2];
            assert_true(fmax(fabs(x), fabs(z)) > 0.15 - 0.04); /* a radius deep */
        }
    }
    SkiffWindow window;
    assert_true(skiff_window(sim, &window));
    assert_true(window.centre[0] > 2.5);
    skiff_destroy(sim);
}

/* A path that jumps is followed as fast as the cap allows. */
static void test_path_that_jumps(void **state) {
    (void)state;
    Scene scene;
    scene_make(&scene);
    scene.path[0][1] = 2.0; /* the window starts at 0 */
    scene.path[1][1] = 2.1;
    SkiffSim *sim = accept(&scene);
    const double cap = 3.5 * 4.0 * 0.04;
    SkiffWindow window;
    for (int k = 1; k <= 3; k++) {
        step(sim);
        assert_true(skiff_window(sim, &window));
        assert_true(fabs(window.centre[0] - k * cap) < 1e-6);
    }
    skiff_destroy(sim);
}

static void test_body_outruns_the_window(void **state) {
    (void)state;
    Scene scene;
    Err err = {0};
    scene_make(&scene);
    follow_body(&scene);
    scene.def.params.window_cap = 0.1f; /* 0.016 m a step */
    scene.def.params.window_trigger = 0.1f;
    scene.body.velocity[0] = 20.0f; /* 0.1 m a step */
    SkiffSim *sim = accept(&scene);
    int steps = 0;
    while (steps < 40 && skiff_step(sim, &err))
        steps++;
    assert_int_equal(err.code, ERR_DIVERGED);
    assert_non_null(strstr(err.message, "body 'box' has left the window by"));
    assert_non_null(strstr(err.message, "windowCap"));
    assert_true(steps >= 5 && steps <= 15); /* it gains 0.084 m a step on a window of 0.8 m */
    skiff_destroy(sim);
}

/* ---- Absorption at the speed of waves ---- */

/* How many of `count` heights have their turn in a step, when still water is `depth` deep: mean and variance.
 */
static void expect_turns(const SkiffSim *sim, const float *height, int count, float speed, double sums[2]) {
    const double layer = 8.0 * (double)sim->params.particle_radius, dt = sim->params.time_step;
    const double depth = sim->sea.level - sim->origin[1];
    sums[0] = sums[1] = 0.0;
    for (int k = 0; k < count; k++) {
        const double wave = 3.0 * sqrt(9.81 * (double)height[k]) - 2.0 * sqrt(9.81 * depth);
        const double share = 1.0 - exp(-(double)speed * fmax(wave, 0.0) / layer * dt);
        sums[0] += share;
        sums[1] += share * (1.0 - share);
    }
}

static SkiffSim *basin_make(Scene *scene, float speed) {
    scene_make(scene);
    scene->def.sea.path_count = 0;
    scene->def.params.outflow_distance = scene->def.params.inflow_layer = 8.0f;
    scene->def.params.outflow_speed = scene->def.params.inflow_speed = speed;
    SkiffSim *sim = accept(scene);
    step(sim);
    return sim;
}

/* The sea has sunk by a fifth of a metre. Returns how many of the layer stand above it, and their heights. */
static int sink(SkiffSim *sim, float *height, int capacity) {
    Err err = {0};
    sim->sea.level -= 0.2;
    int above = 0;
    for (uint32_t i = 0; i < sim->particles.count; i++) {
        const float *p = sim->particles.position[i];
        const bool goes = p[1] > (float)sim->sea.level && hypotf(p[0], p[2]) > 0.8f - 0.32f;
        if (goes && above < capacity)
            height[above++] = p[1];
    }
    sim->stats.particles_out[SKIFF_OUT_OUTFLOW] = 0;
    assert_true(absorb_waves(sim, &err));
    return above;
}

/* The upper fifth of a metre has gone: there is room for it. Returns how many came, and their heights. */
static int refill(SkiffSim *sim, float *height, int capacity) {
    Err err = {0};
    for (uint32_t i = sim->particles.count; i-- > 0;)
        if (sim->particles.position[i][1] > 0.3f)
            particles_remove(&sim->particles, &i, 1, sim->pressure.data);
    sim->sea.absorbs = false;
    step(sim); /* sorts them */
    sim->sea.absorbs = true;
    const uint32_t before = sim->particles.count;
    assert_true(absorb_waves(sim, &err));
    const int came = (int)sim->stats.particles_in[SKIFF_IN_INFLOW];
    for (int k = 0; k < came && k < capacity; k++)
        height[k] = sim->particles.position[before + (uint32_t)k][1];
    return came;
}

static void test_levelling(void **state) {
    (void)state;
    enum { CAPACITY = 4000 };
    static float height[CAPACITY];
    const float speeds[2] = {0.0f, 8.0f}; /* at once; as eight waves */
    double sums[2];
    for (int k = 0; k < 2; k++) {
        Scene scene;
        SkiffSim *sim = basin_make(&scene, speeds[k]);
        const int above = sink(sim, height, CAPACITY);
        const double gone = sim->stats.particles_out[SKIFF_OUT_OUTFLOW];
        assert_in_range(above, 300, CAPACITY - 1);
        expect_turns(sim, height, above, speeds[1], sums);
        assert_true(sums[0] < 0.6 * above);
        assert_float_equal(gone, k == 0 ? above : sums[0], k == 0 ? 0.0 : 4.0 * sqrt(sums[1]));
        skiff_destroy(sim);
    }
    for (int k = 0; k < 2; k++) {
        Scene scene;
        SkiffSim *sim = basin_make(&scene, speeds[k]);
        const int came = refill(sim, height, CAPACITY);
        if (k == 0) {
            assert_in_range(came, 300, CAPACITY - 1);
            expect_turns(sim, height, came, speeds[1], sums);
            assert_true(sums[0] < 0.6 * came);
        } else {
            assert_float_equal(came, sums[0], 4.0 * sqrt(sums[1]));
        }
        skiff_destroy(sim);
    }
}

static void test_refusals(void **state) {
    (void)state;
    Scene scene;
    scene_make(&scene);
    scene.def.params.volume_factor = 0.9f;
    refuse(&scene.def, "Configuration.volumeFactor: 0.9, but filling with water at rest needs 0.8");
    scene_make(&scene);
    scene.def.tank.geometry.radius = 0.3f;
    refuse(&scene.def, "Sea: a window must be at least");
    scene_make(&scene);
    scene.def.sea.level = 1.5f;
    refuse(&scene.def, "Sea.level: 1.5 m, must lie between the tank's floor");
    scene_make(&scene);
    follow_body(&scene);
    scene.def.sea.follow = "raft";
    refuse(&scene.def, "Sea.follow: there is no body 'raft'");
    scene_make(&scene);
    follow_body(&scene);
    scene.body.geometry.translation[0] = 2.0f;
    refuse(&scene.def, "Sea.follow: body 'box' starts outside the window");
}

/* A sea without water is good for its meshes and for nothing else, and says so. */
static void test_dry(void **state) {
    (void)state;
    Scene scene;
    scene_make(&scene);
    scene.def.sea.dry = true;
    SkiffSim *sim = accept(&scene);
    Err err = {0};
    const float(*vertices)[3];
    const uint32_t(*triangles)[3];
    uint32_t vertex_count, triangle_count;
    skiff_tank_mesh(sim, &vertices, &vertex_count, &triangles, &triangle_count);
    assert_true(triangle_count > 0);
    assert_int_equal(skiff_particles(sim).count, 0);
    assert_false(skiff_step(sim, &err));
    assert_int_equal(err.code, ERR_USAGE);
    assert_false(skiff_load(sim, "dry.skiff", &err));
    assert_int_equal(err.code, ERR_USAGE);
    assert_non_null(strstr(err.message, "dry.skiff"));
    skiff_destroy(sim);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_dry),
        cmocka_unit_test(test_still_water),
        cmocka_unit_test(test_every_shape),
        cmocka_unit_test(test_particles_stay),
        cmocka_unit_test(test_path_into_an_obstacle),
        cmocka_unit_test(test_path_that_jumps),
        cmocka_unit_test(test_body_outruns_the_window),
        cmocka_unit_test(test_levelling),
        cmocka_unit_test(test_refusals),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
