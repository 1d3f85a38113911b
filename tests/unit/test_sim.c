/* Simulations made from bad and good defs: every refusal with its message, and what must hold in the small.
 */
#include "engine/sim.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>

#include <cmocka.h>

#include "refuse.h"

/* A 0.6 m tank with a few hundred particles. */
typedef struct Scene {
    SkiffDef def;
    SkiffBlockDef block;
    SkiffBodyDef bodies[2];
    SkiffProbeDef probe;
} Scene;

static void scene_make(Scene *scene) {
    scene->def = skiff_def_default();
    scene->block = skiff_block_default();
    scene->bodies[0] = scene->bodies[1] = skiff_body_default();
    scene->probe = skiff_probe_default();
    scene->def.threads = 1;
    scene->def.tank.geometry.kind = SKIFF_GEOMETRY_BOX;
    scene->def.tank.geometry.translation[1] = 0.3f;
    for (int k = 0; k < 3; k++) {
        scene->def.tank.geometry.size[k] = 0.6f;
        scene->block.start[k] = -0.275f;
        scene->block.end[k] = 0.275f;
        for (int b = 0; b < 2; b++)
            scene->bodies[b].geometry.size[k] = 0.2f;
    }
    scene->block.start[1] = 0.025f;
    scene->block.end[1] = 0.225f;
    for (int b = 0; b < 2; b++) {
        scene->bodies[b].name = b ? "second" : "first";
        scene->bodies[b].geometry.kind = SKIFF_GEOMETRY_BOX;
        scene->bodies[b].geometry.translation[1] = 0.4f;
    }
    scene->def.blocks = &scene->block;
    scene->def.block_count = 1;
    scene->def.bodies = scene->bodies;
    scene->def.probes = &scene->probe;
}

static SkiffSim *accept(const Scene *scene) {
    Err err = {0};
    SkiffSim *sim = skiff_create(&scene->def, &err);
    if (sim == NULL)
        fail_msg("%s", err.message);
    return sim;
}

static void test_refusals(void **state) {
    (void)state;
    Scene scene;
    scene_make(&scene);
    scene.def.params.particle_radius = -1.0f;
    scene.def.params.viscosity = NAN;
    refuse(&scene.def, "Configuration.particleRadius: -1 is out of range, allowed is 0.0001 to 10 m\n"
                       "Configuration.viscosity: nan is out of range, allowed is 0 to 1");
    scene_make(&scene);
    scene.block.end[0] = -2.0f;
    refuse(&scene.def, "FluidBlocks[0]: end[0] = -2 m must be above start[0] = -0.275 m");
    scene_make(&scene);
    scene.block.end[2] = NAN;
    refuse(&scene.def, "FluidBlocks[0]: start, end, velocity and time must be finite");
    scene_make(&scene);
    scene.block.end[1] = 0.825f;
    scene.block.end[0] = 0.375f;
    refuse(&scene.def, "352 of its 2288 particles are outside the tank, the first at (0.3, 0.05, -0.25) m");
    scene_make(&scene);
    scene.block.end[1] = 1e7f;
    refuse(&scene.def, "particles need about");
    scene_make(&scene);
    scene.def.body_count = 2;
    refuse(&scene.def,
           "RigidBodies[1]: overlaps RigidBodies[0] by at least 0.05 m (allowed: less than 0.025 m)");
    scene_make(&scene);
    scene.def.body_count = 1;
    scene.bodies[0].geometry.translation[0] = 0.3f;
    refuse(&scene.def, "RigidBodies[0]: reaches 0.1 m through the tank's wall (allowed: 0.025 m)");
    scene_make(&scene);
    scene.def.body_count = 2;
    scene.bodies[1].name = "first";
    refuse(&scene.def, "RigidBodies[1].name: 'first' is also the name of RigidBodies[0]");
    scene_make(&scene);
    scene.def.tank.wet_height = -1.0f;
    refuse(&scene.def, "Tank.wetHeight: -1 m is below the tank's floor at 0 m");
    scene_make(&scene);
    scene.def.tank.geometry.size[1] = 0.0f;
    refuse(&scene.def, "Tank.box[1]: 0 m, must be above 0");
    scene_make(&scene);
    scene.def.probe_count = 1;
    scene.probe.name = "p";
    scene.probe.kind = SKIFF_PROBE_FORCE;
    scene.probe.object = "raft";
    refuse(&scene.def, "Probes[0].object: no body is named 'raft'");
    scene.probe.kind = SKIFF_PROBE_PRESSURE;
    scene.probe.object = NULL;
    scene.probe.point[1] = 0.3f;
    refuse(&scene.def, "Probes[0].point: no wall or body within 0.1 m of (0, 0.3, 0)");
}

static void test_blow_up(void **state) {
    (void)state;
    Scene scene;
    scene_make(&scene);
    scene.block.velocity[1] = 50.0f;
    scene.def.params.speed_limit = 20.0f;
    SkiffSim *sim = accept(&scene);
    Err err = {0};
    assert_false(skiff_step(sim, &err));
    assert_int_equal(err.code, ERR_DIVERGED);
    assert_non_null(strstr(err.message, "step 1 (t = 0.003 s): particle "));
    assert_non_null(strstr(err.message, "(limit 20)"));
    skiff_destroy(sim);
}

/* Pushes of a step add up, act in that step alone, and move nothing along an axis that is held. */
static void test_push(void **state) {
    (void)state;
    Scene scene;
    Err err = {0};
    scene_make(&scene);
    scene.def.body_count = 1;
    scene.def.params.gravity[1] = 0.0f;
    scene.bodies[0].geometry.translation[1] = 0.45f; /* clear of the water */
    scene.bodies[0].free_axes = SKIFF_FREE_X | SKIFF_FREE_RY;
    SkiffSim *sim = accept(&scene);
    const SkiffBody before = skiff_body(sim, 0);
    const double dt = (double)scene.def.params.time_step;
    skiff_body_push(sim, 0, (const double[3]){3, 7, 0}, (const double[3]){0, 0.01, 0});
    skiff_body_push(sim, 0, (const double[3]){2, 0, 0}, (const double[3]){0.02, 0.01, 0});
    assert_true(skiff_step(sim, &err) && skiff_step(sim, &err));
    const SkiffBody after = skiff_body(sim, 0);
    assert_float_equal(after.velocity[0], dt * 5 / before.mass, 1e-12);
    assert_float_equal(after.position[0] - before.position[0], 2 * dt * after.velocity[0], 1e-12);
    assert_float_equal(after.angular_velocity[1], dt * 0.02 / before.inertia[1][1], 1e-9);
    assert_true(after.velocity[1] == 0.0 && after.velocity[2] == 0.0);
    assert_true(after.angular_velocity[0] == 0.0 && after.angular_velocity[2] == 0.0);
    skiff_destroy(sim);
}

/* A leak: without a floor the water falls out of the domain, as an error or as a count. */
static void test_escape(void **state) {
    (void)state;
    for (int remove = 0; remove < 2; remove++) {
        Scene scene;
        scene_make(&scene);
        scene.def.tank.geometry.kind = SKIFF_GEOMETRY_NONE;
        scene.def.has_domain = true;
        scene.def.params.escape = remove;
        for (int k = 0; k < 3; k++) {
            scene.def.domain_min[k] = -1.0f;
            scene.def.domain_max[k] = 1.0f;
        }
        SkiffSim *sim = accept(&scene);
        const uint32_t start = skiff_particles(sim).count;
        uint32_t removed = 0;
        Err err = {0};
        bool good = true;
        while (good && skiff_time(sim) < 1.0) {
            good = skiff_step(sim, &err);
            removed += skiff_stats(sim)->particles_out[SKIFF_OUT_ESCAPED];
            assert_true(!good || skiff_particles(sim).count + removed == start);
        }
        if (remove) {
            assert_true(good);
            assert_int_equal(removed, start);
        } else {
            assert_int_equal(err.code, ERR_DIVERGED);
            assert_non_null(strstr(err.message, "left the domain"));
        }
        skiff_destroy(sim);
    }
}

static void test_emit(void **state) {
    (void)state;
    Scene scene;
    scene_make(&scene);
    scene.block.start[1] = 0.4f;
    scene.block.end[1] = 0.5f;
    scene.block.start[0] = -0.1f;
    scene.block.end[0] = 0.1f;
    scene.block.time = 0.03;
    scene.block.period = 0.3;
    scene.block.repeat = 2;
    SkiffSim *sim = accept(&scene);
    Err err = {0};
    assert_int_equal(skiff_particles(sim).count, 0);
    for (int k = 0; k < 150; k++)
        if (!skiff_step(sim, &err))
            fail_msg("%s", err.message);
    assert_int_equal(skiff_particles(sim).count, 2 * 4 * 2 * 11);
    skiff_destroy(sim);
    scene.block.period = 0.006; /* the first has not left yet */
    sim = accept(&scene);
    bool good = true;
    for (int k = 0; good && k < 20; k++)
        good = skiff_step(sim, &err);
    assert_false(good);
    assert_int_equal(err.code, ERR_INPUT);
    assert_non_null(strstr(err.message, "its place is not free"));
    skiff_destroy(sim);
}

/* A flat wall gives a particle 1, 0.70, 0.21, 0.018 of rest density at 0, 1, 2, 3 radii [code facts of
 * Carensac2023, sec. 3.5]. */
static void test_flat_wall(void **state) {
    (void)state;
    const double expected[4] = {1.0, 0.70, 0.21, 0.018};
    Scene scene;
    scene_make(&scene);
    for (int k = 0; k < 4; k++) {
        const float y = (float)k * 0.025f + 1e-4f;
        scene.block.start[0] = scene.block.start[2] = -0.02f;
        scene.block.end[0] = scene.block.end[2] = 0.02f;
        scene.block.start[1] = y - 0.02f;
        scene.block.end[1] = y + 0.02f;
        scene.def.params.gravity[1] = 0.0f;
        scene.def.params.boundary_offset = 0.0f;
        /* alone inside a wall it is shot out: only its density is of interest */
        scene.def.params.speed_limit = 1e6f;
        SkiffSim *sim = accept(&scene);
        assert_int_equal(skiff_particles(sim).count, 1);
        Err err = {0};
        if (!skiff_step(sim, &err))
            fail_msg("%s", err.message);
        const double own = (double)(sim->volume * sim->kernel.w_scale);
        assert_float_equal((double)skiff_particles(sim).density[0] - own, expected[k], 0.03);
        skiff_destroy(sim);
    }
}

static void test_states(void **state) {
    (void)state;
    char path[] = "/tmp/skiff_test_XXXXXX";
    const int file = mkstemp(path);
    assert_true(file >= 0);
    Scene scene;
    scene_make(&scene);
    scene.def.body_count = 1;
    SkiffSim *sim = accept(&scene);
    Err err = {0};
    for (int k = 0; k < 20; k++)
        assert_true(skiff_step(sim, &err));
    assert_true(skiff_save(sim, path, &err));
    const uint64_t hash = skiff_hash(sim);
    for (int k = 0; k < 20; k++)
        assert_true(skiff_step(sim, &err));
    const uint64_t later = skiff_hash(sim);
    assert_true(skiff_load(sim, path, &err));
    assert_true(skiff_hash(sim) == hash);
    for (int k = 0; k < 20; k++)
        assert_true(skiff_step(sim, &err));
    assert_true(skiff_hash(sim) == later);
    skiff_destroy(sim);
    scene.bodies[0].density = 700.0f;
    sim = accept(&scene);
    const uint64_t fresh = skiff_hash(sim);
    assert_false(skiff_load(sim, path, &err));
    assert_int_equal(err.code, ERR_INPUT);
    assert_non_null(strstr(err.message, "saved by another scene"));
    assert_true(skiff_hash(sim) == fresh);
    skiff_destroy(sim);
    remove(path);
}

/* A body starts immersed: the water where it is is left out, and it is not thrown out. */
static void test_carving(void **state) {
    (void)state;
    Scene scene;
    scene_make(&scene);
    scene.block.end[1] = 0.525f;
    scene.def.body_count = 1;
    scene.bodies[0].geometry.translation[1] = 0.25f;
    SkiffSim *sim = accept(&scene);
    assert_true(skiff_particles(sim).count < 11 * 11 * 10);
    Err err = {0};
    for (int k = 0; k < 100; k++) {
        assert_true(skiff_step(sim, &err));
        const SkiffBody body = skiff_body(sim, 0);
        /* the water itself falls at 1 m/s; thrown out by an overlap a body would be ten times as fast */
        assert_true(fabs(body.velocity[1]) < 2.0);
        assert_in_range((int)(1e3 * body.position[1]), 150, 350);
    }
    skiff_destroy(sim);
}

/* What stays keeps its order and everything that belongs to it, and goes on. */
static void test_remove_box(void **state) {
    (void)state;
    Scene scene;
    scene_make(&scene);
    SkiffSim *sim = accept(&scene);
    Err err = {0};
    for (int step = 0; step < 5; step++)
        assert_true(skiff_step(sim, &err));
    const SkiffParticles before = skiff_particles(sim);
    uint64_t ids[2000];
    float values[2000][3];
    uint32_t kept = 0, removed;
    assert_in_range(before.count, 100, 2000);
    for (uint32_t i = 0; i < before.count; i++) {
        const double x = (double)before.position[i][0] + before.origin[0];
        const double y = (double)before.position[i][1] + before.origin[1];
        if (x >= -0.1 && x < 0.1 && y < 0.15)
            continue;
        ids[kept] = before.id[i];
        memcpy(values[kept++], (float[]){before.density[i], before.unknown[i], before.velocity[i][1]},
               sizeof *values);
    }
    assert_true(skiff_remove_box(sim, (double[]){-0.1, -1, -1}, (double[]){0.1, 0.15, 1}, &removed, &err));
    const SkiffParticles after = skiff_particles(sim);
    assert_true(removed > 50);
    assert_int_equal(removed, before.count - kept);
    assert_int_equal(after.count, kept);
    for (uint32_t i = 0; i < kept; i++) {
        assert_int_equal(after.id[i], ids[i]);
        assert_true(after.density[i] == values[i][0] && after.unknown[i] == values[i][1] &&
                    after.velocity[i][1] == values[i][2]);
    }
    for (int step = 0; step < 5; step++)
        assert_true(skiff_step(sim, &err));
    assert_true(skiff_remove_box(sim, (double[]){5, 5, 5}, (double[]){6, 6, 6}, &removed, &err));
    assert_int_equal(removed, 0);
    skiff_destroy(sim);
}

/* Water sliding over a floor: free slip keeps its speed, friction takes it; a body takes up what the water
 * loses. */
static void test_wall_friction(void **state) {
    (void)state;
    double drift[2];
    for (int rough = 0; rough < 2; rough++) {
        Scene scene;
        scene_make(&scene);
        scene.def.tank.geometry.kind = SKIFF_GEOMETRY_NONE;
        scene.def.params.gravity[1] = 0.0f;
        scene.def.params.wall_friction = rough ? 0.1f : 0.0f;
        scene.def.body_count = 1;
        scene.bodies[0].geometry.size[0] = scene.bodies[0].geometry.size[2] = 2.0f;
        scene.bodies[0].geometry.translation[1] = -0.08f;
        scene.block.velocity[0] = 1.0f;
        SkiffSim *sim = accept(&scene);
        Err err = {0};
        const double mass = (double)sim->volume * 1000.0 * skiff_particles(sim).count;
        for (int k = 0; k < 60; k++)
            if (!skiff_step(sim, &err))
                fail_msg("%s", err.message);
        const SkiffBody body = skiff_body(sim, 0);
        drift[rough] = body.mass * body.velocity[0];
        assert_float_equal(skiff_stats(sim)->momentum[0] + drift[rough], mass, 1e-4 * mass);
        assert_true(!rough || drift[rough] > 0.02 * mass);
        skiff_destroy(sim);
    }
    assert_true(fabs(drift[0]) < 0.1 * drift[1]);
}

/* Densities that a solve foresees are none or more, however fast drops fly apart: less marks water that a
 * window has just set free, which corrects its density at ease. */
static void test_drops_apart(void **state) {
    (void)state;
    Scene scene;
    scene_make(&scene);
    scene.def.params.gravity[1] = 0.0f;
    SkiffSim *sim = accept(&scene);
    uint32_t seed = 1;
    for (uint32_t i = 0; i < sim->particles.count; i++)
        for (int k = 0; k < 3; k++) {
            seed = seed * 1664525u + 1013904223u;
            sim->particles.velocity[i][k] = 30.0f * ((float)(seed >> 8) / 16777216.0f - 0.5f);
        }
    Err err = {0};
    for (int step = 0; step < 5; step++) {
        assert_true(skiff_step(sim, &err));
        for (uint32_t i = 0; i < sim->particles.count; i++)
            assert_true(sim->particles.prediction[i] >= 0.0f);
    }
    skiff_destroy(sim);
}

/* p / (rho g depth) over the particles that are within 1.6 d of `walls` of the tank's sides and floor at
 * least, means over some steps. */
static void hydrostatic_ratios(SkiffSim *sim, double ratios[4], double unknown_ratios[4]) {
    enum { STEPS = 40 };
    static float pressure[4000];
    double sums[4] = {0}, unknown_sums[4] = {0}, counts[4] = {0};
    const float near = 3.2f * sim->params.particle_radius;
    assert_in_range(sim->particles.count, 500, 4000);
    Err err = {0};
    for (int step = 0; step < STEPS; step++) {
        assert_true(skiff_step(sim, &err) && skiff_pressure(sim, pressure, &err));
        const SkiffParticles water = skiff_particles(sim);
        for (uint32_t i = 0; i < water.count; i++) {
            const float *x = water.position[i];
            const int walls = (x[1] < near) + (0.5f - fabsf(x[0]) < near) + (0.5f - fabsf(x[2]) < near);
            /* the surface: a mean height above the walls' particles is all that is needed */
            const double depth = 0.8 - (double)x[1], still = 9.81 * 1000.0 * depth;
            if (depth < 0.3)
                continue;
            sums[walls] += (double)pressure[i] / still;
            unknown_sums[walls] += (double)water.unknown[i] / still;
            counts[walls] += 1.0;
        }
    }
    for (int k = 0; k < 4; k++) {
        assert_true(counts[k] > 0.0);
        ratios[k] = sums[k] / counts[k];
        unknown_ratios[k] = unknown_sums[k] / counts[k];
    }
}

/* Water at rest has the pressure of its depth wherever it stands: amid other water, at a wall, in an edge of
 * two and in a corner of three. The solver's unknowns do not. A loaded state shows the same bits. */
static void test_pressure(void **state) {
    (void)state;
    Scene scene;
    scene_make(&scene);
    for (int k = 0; k < 3; k++) {
        scene.def.tank.geometry.size[k] = 1.0f;
        scene.block.start[k] = -0.5f;
        scene.block.end[k] = 0.5f;
    }
    scene.def.tank.geometry.translation[1] = 0.5f;
    scene.block.start[1] = 0.0f;
    scene.block.end[1] = 0.8f;
    scene.block.fill = SKIFF_FILL_REST;
    scene.def.params.particle_radius = 0.04f;
    SkiffSim *sim = accept(&scene);
    Err err = {0};
    for (int step = 0; step < 60; step++)
        assert_true(skiff_step(sim, &err));
    double ratios[4], unknown_ratios[4];
    hydrostatic_ratios(sim, ratios, unknown_ratios);
    for (int k = 0; k < 4; k++) {
        assert_float_equal(ratios[k], 1.0, 0.04);
        assert_true(k == 0 || unknown_ratios[k] > 1.0 + 0.3 * k);
    }
    static float before[4000], after[4000];
    assert_true(skiff_pressure(sim, before, &err));
    assert_true(skiff_save(sim, "pressure.skiff", &err) && skiff_load(sim, "pressure.skiff", &err));
    sim->threads = 2;
    assert_true(skiff_pressure(sim, after, &err));
    assert_memory_equal(after, before, sim->particles.count * sizeof *before);
    remove("pressure.skiff");
    skiff_destroy(sim);
}

/* Two drops that barely touch and still have the pressure of the water they came from, over water whose slow
 * modes make the solver's steps long, within a tolerance that hides so few from it: nothing throws them. */
static void test_drops_touching(void **state) {
    (void)state;
    Scene scene;
    scene_make(&scene);
    scene.def.params.max_density_error = 2.0f;
    scene.def.params.min_iterations = 8;
    SkiffSim *sim = accept(&scene);
    const uint64_t first_drop = sim->particles.next_id;
    const float apart = 3.913f * sim->params.particle_radius, speed = 1.0f;
    Err err = {0};
    for (int trial = 0; trial < 160; trial++) {
        assert_true(sim_reserve(sim, sim->particles.count + 2, &err));
        for (uint32_t i = 0; i < sim->particles.count; i++)
            sim->particles.velocity[i][1] = -speed;
        for (int side = 0; side < 2; side++) {
            const float p[3] = {-0.2f + (float)side * apart, 0.55f, -0.2f + 0.0025f * (float)trial};
            const uint32_t drop = particles_append(&sim->particles, p, (const float[3]){0}, sim->time);
            sim->particles.pressure[drop] = 1e-4f;
        }
        for (int step = 0; step < 2; step++) {
            assert_true(skiff_step(sim, &err));
            assert_true(sim->stats.max_speed < 1.5 * (double)speed);
        }
        for (uint32_t i = sim->particles.count; i-- > 0;)
            if (sim->particles.id[i] >= first_drop)
                particles_remove(&sim->particles, &i, 1, sim->pressure.data);
    }
    skiff_destroy(sim);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_refusals),    cmocka_unit_test(test_blow_up),
        cmocka_unit_test(test_push),        cmocka_unit_test(test_escape),
        cmocka_unit_test(test_emit),        cmocka_unit_test(test_flat_wall),
        cmocka_unit_test(test_states),      cmocka_unit_test(test_carving),
        cmocka_unit_test(test_remove_box),  cmocka_unit_test(test_wall_friction),
        cmocka_unit_test(test_drops_apart), cmocka_unit_test(test_drops_touching),
        cmocka_unit_test(test_pressure),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
