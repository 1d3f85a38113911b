/* Rigid bodies: mass properties from def to body, motion without water, axes that are free, held or
 * prescribed. */
#include "engine/body.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

static const float no_gravity[3] = {0, 0, 0};

static Body make_box(float x, float y, float z, uint32_t free_axes) {
    SkiffBodyDef def = skiff_body_default();
    Body body;
    Err err = {0};
    def.name = "box";
    def.geometry.kind = SKIFF_GEOMETRY_BOX;
    def.geometry.size[0] = x;
    def.geometry.size[1] = y;
    def.geometry.size[2] = z;
    def.density = 500.0f;
    def.free_axes = free_axes;
    if (!body_make(&def, "RigidBodies[0]", &body, &err))
        fail_msg("%s", err.message);
    return body;
}

static void step(Body *body, const float gravity[3], double time, double dt) {
    body_hold(body, time, dt);
    body_prepare(body, time);
    body_push(body, gravity, time, dt);
    body_advance(body, time, dt);
}

static void test_mass(void **state) {
    (void)state;
    Body body = make_box(0.4f, 0.6f, 1.0f, SKIFF_FREE_ALL);
    assert_float_equal(body.mass, 500.0 * 0.24, 1e-4);
    assert_float_equal(body.inertia[0][0], body.mass * (0.36 + 1.0) / 12.0, 1e-4);
    assert_float_equal(body.inertia[1][1], body.mass * (0.16 + 1.0) / 12.0, 1e-4);
    assert_float_equal(body.inertia[2][2], body.mass * (0.16 + 0.36) / 12.0, 1e-4);
    assert_false(body.fixed);
    body_free(&body);
}

static void test_free_fall(void **state) {
    (void)state;
    Body body = make_box(0.4f, 0.4f, 0.4f, SKIFF_FREE_ALL);
    const float gravity[3] = {0, -9.81f, 0};
    for (int k = 0; k < 500; k++)
        step(&body, gravity, k * 1e-3, 1e-3);
    assert_float_equal(body.position[1], -9.81 * 0.125, 9.81 * 0.5 * 1e-3);
    assert_float_equal(body.velocity[1], -9.81 * 0.5, 1e-4);
    body_free(&body);
}

/* Torque-free tumbling about the middle axis: angular momentum exactly, energy nearly kept, and it does flip
 * over (Dzhanibekov). */
static void test_tumbling(void **state) {
    (void)state;
    Body body = make_box(0.2f, 0.6f, 1.0f, SKIFF_FREE_ALL);
    body.angular_velocity[1] = 4.0;
    body.angular_velocity[0] = 0.01;
    memcpy(body.start_angular_velocity, body.angular_velocity, sizeof body.angular_velocity);
    const double energy = 0.5 * body.inertia[1][1] * 16.0;
    const double momentum = hypot(body.inertia[1][1] * 4.0, body.inertia[0][0] * 0.01);
    double lowest = 1.0;
    for (int k = 0; k < 20000; k++) {
        step(&body, no_gravity, k * 1e-3, 1e-3);
        lowest = fmin(lowest, body.matrix[1][1]);
    }
    body_prepare(&body, 20.0);
    double local[3], spin[3] = {0}, now = 0.0, size = 0.0;
    for (int k = 0; k < 3; k++) {
        local[k] = 0.0;
        for (int l = 0; l < 3; l++)
            local[k] += body.matrix[l][k] * body.angular_velocity[l];
    }
    matrix_times((const double(*)[3])body.inertia, local, spin);
    for (int k = 0; k < 3; k++) {
        now += 0.5 * local[k] * spin[k];
        size += spin[k] * spin[k];
    }
    assert_float_equal(sqrt(size), momentum, 1e-6 * momentum);
    assert_float_equal(now, energy, 0.02 * energy);
    assert_true(lowest < -0.9);
    body_free(&body);
}

static void test_axes(void **state) {
    (void)state;
    Body body = make_box(0.4f, 0.4f, 0.4f, SKIFF_FREE_Y | SKIFF_FREE_RZ);
    const float gravity[3] = {1, -9.81f, 2};
    body.velocity[0] = body.start_velocity[0] = 0.5; /* prescribed */
    for (int k = 0; k < 100; k++) {
        body.push_torque[0] = body.push_torque[1] = body.push_torque[2] = 10.0;
        step(&body, gravity, k * 1e-2, 1e-2);
    }
    assert_float_equal(body.position[0], 0.5, 1e-12);
    assert_float_equal(body.position[2], 0.0, 1e-12);
    assert_float_equal(body.velocity[1], -9.81, 1e-5);
    assert_float_equal(body.angular_velocity[0], 0.0, 1e-12);
    assert_float_equal(body.angular_velocity[2], 10.0 / body.inertia[2][2], 1e-6);
    body_free(&body);
}

static void test_release(void **state) {
    (void)state;
    SkiffBodyDef def = skiff_body_default();
    Body body;
    Err err = {0};
    def.name = "held";
    def.geometry.kind = SKIFF_GEOMETRY_SPHERE;
    def.geometry.radius = 0.5f;
    def.velocity[0] = 2.0f;
    def.release_time = 0.5;
    assert_true(body_make(&def, "RigidBodies[0]", &body, &err));
    const float gravity[3] = {0, -9.81f, 0};
    for (int k = 0; k < 50; k++)
        step(&body, gravity, k * 1e-2, 1e-2);
    assert_float_equal(body.position[0], 0.0, 1e-12);
    assert_float_equal(body.position[1], 0.0, 1e-12);
    for (int k = 50; k < 100; k++)
        step(&body, gravity, k * 1e-2, 1e-2);
    assert_float_equal(body.position[0], 1.0, 1e-6);
    assert_true(body.position[1] < -1.0);
    body_free(&body);
}

/* It stays where it is from the stop on, in every axis. */
static void test_stop(void **state) {
    (void)state;
    SkiffBodyDef def = skiff_body_default();
    Body body;
    Err err = {0};
    def.name = "stopped";
    def.geometry.kind = SKIFF_GEOMETRY_SPHERE;
    def.geometry.radius = 0.5f;
    def.free_axes = SKIFF_FREE_Y;
    def.velocity[0] = 2.0f;
    def.angular_velocity[1] = 1.0f;
    def.stop_time = 0.5;
    assert_true(body_make(&def, "RigidBodies[0]", &body, &err));
    const float gravity[3] = {0, -9.81f, 0};
    for (int k = 0; k < 50; k++)
        step(&body, gravity, k * 1e-2, 1e-2);
    assert_float_equal(body.position[0], 1.0, 1e-6);
    assert_true(body.position[1] < -1.2);
    const Body before = body;
    for (int k = 50; k < 100; k++)
        step(&body, gravity, k * 1e-2, 1e-2);
    assert_memory_equal(body.position, before.position, sizeof body.position);
    assert_memory_equal(body.rotation, before.rotation, sizeof body.rotation);
    body_free(&body);
    def.release_time = 0.5;
    assert_false(body_make(&def, "RigidBodies[0]", &body, &err));
    assert_string_equal(err.message, "RigidBodies[0].stopTime: 0.5 s, must be after the release at 0.5 s");
}

/* A prescribed velocity that rises within a time covers half of what it covers in the same time at its
 * value, and what is free has its velocity at once. */
static void test_ramp(void **state) {
    (void)state;
    SkiffBodyDef def = skiff_body_default();
    Body body;
    Err err = {0};
    def.name = "towed";
    def.geometry.kind = SKIFF_GEOMETRY_SPHERE;
    def.geometry.radius = 0.5f;
    def.free_axes = SKIFF_FREE_Z;
    def.velocity[0] = 2.0f;
    def.velocity[2] = 3.0f;
    def.ramp_time = 0.5;
    assert_true(body_make(&def, "RigidBodies[0]", &body, &err));
    const float gravity[3] = {0, -9.81f, 0};
    for (int k = 0; k < 50; k++)
        step(&body, gravity, k * 1e-2, 1e-2);
    assert_float_equal(body.position[0], 0.5, 1e-4);
    assert_float_equal(body.position[2], 1.5, 1e-6);
    step(&body, gravity, 0.5, 1e-2);
    assert_float_equal(body.velocity[0], 2.0, 1e-12);
    body_free(&body);
}

static void test_bad(void **state) {
    (void)state;
    const struct {
        float size, density, mass;
        const char *name, *expected;
    } cases[] = {
        {-1.0f, 500, 0, "a", "RigidBodies[3].box[1]: -1 m, must be above 0"},
        {1.0f, 0, 0, "a", "RigidBodies[3].density: 0 kg/m^3, must be above 0"},
        {1.0f, 500, -2, "a", "RigidBodies[3].mass: -2 kg, must be above 0"},
        {1.0f, 500, 0, "", "RigidBodies[3].name: must not be empty"},
        {NAN, 500, 0, "a", "RigidBodies[3].box[1]: nan m, must be above 0"},
    };
    for (size_t k = 0; k < sizeof cases / sizeof cases[0]; k++) {
        SkiffBodyDef def = skiff_body_default();
        Body body;
        Err err = {0};
        def.name = cases[k].name;
        def.geometry.kind = SKIFF_GEOMETRY_BOX;
        def.geometry.size[1] = cases[k].size;
        def.density = cases[k].density;
        def.mass = cases[k].mass;
        assert_false(body_make(&def, "RigidBodies[3]", &body, &err));
        assert_int_equal(err.code, ERR_INPUT);
        assert_string_equal(err.message, cases[k].expected);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_mass), cmocka_unit_test(test_free_fall), cmocka_unit_test(test_tumbling),
        cmocka_unit_test(test_axes), cmocka_unit_test(test_release),   cmocka_unit_test(test_stop),
        cmocka_unit_test(test_ramp), cmocka_unit_test(test_bad),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
