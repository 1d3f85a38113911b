/* Propulsion and steering: forces against their formulas on a body in empty space, what water changes, what
 * is refused, and that controls are part of the state. */
#include "engine/base/angle.h"
#include "engine/params.h"
#include "engine/sim.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

#include <cmocka.h>

#include "refuse.h"

#define COUNT(table) ((int)(sizeof(table) / sizeof *(table)))

/* A box of 1 m x 0.2 m x 0.4 m and 40 kg, bow towards -x, without gravity; with or without water around. */
typedef struct Scene {
    SkiffDef def;
    SkiffBodyDef body;
    SkiffDriveDef drive;
    SkiffBlockDef block;
} Scene;

static void scene_make(Scene *scene) {
    const float size[3] = {1.0f, 0.2f, 0.4f};
    scene->def = skiff_def_default();
    scene->body = skiff_body_default();
    scene->drive = skiff_drive_default();
    scene->block = skiff_block_default();
    scene->def.threads = 1;
    scene->def.params.gravity[1] = 0.0f;
    scene->body.name = "boat";
    scene->body.geometry.kind = SKIFF_GEOMETRY_BOX;
    memcpy(scene->body.geometry.size, size, sizeof size);
    scene->body.density = 500.0f;
    scene->body.drive = &scene->drive;
    scene->drive.thrust = 80.0f;
    scene->drive.steering_torque = 10.0f;
    scene->def.bodies = &scene->body;
    scene->def.body_count = 1;
    scene->def.blocks = &scene->block;
}

/* Water at rest from -0.4 m to 0.4 m in y, around the body. */
static void scene_flood(Scene *scene) {
    const float start[3] = {-1.0f, -0.4f, -0.5f}, end[3] = {1.0f, 0.4f, 0.5f};
    memcpy(scene->block.start, start, sizeof start);
    memcpy(scene->block.end, end, sizeof end);
    scene->def.block_count = 1;
}

static SkiffSim *accept(const Scene *scene) {
    Err err = {0};
    SkiffSim *sim = skiff_create(&scene->def, &err);
    if (sim == NULL)
        fail_msg("%s", err.message);
    return sim;
}

static void set(SkiffSim *sim, double throttle, double rudder) {
    Err err = {0};
    const SkiffControls controls = {.throttle = throttle, .rudder = rudder};
    if (!skiff_drive_set(sim, 0, &controls, &err))
        fail_msg("%s", err.message);
}

static void set_heading(SkiffSim *sim, double heading) {
    Err err = {0};
    const SkiffControls controls = {.hold = true, .heading = heading};
    if (!skiff_drive_set(sim, 0, &controls, &err))
        fail_msg("%s", err.message);
}

static void run(SkiffSim *sim, int steps) {
    Err err = {0};
    for (int s = 0; s < steps; s++)
        if (!skiff_step(sim, &err))
            fail_msg("%s", err.message);
}

static double mass(void) {
    return 500.0 * 1.0 * 0.2 * 0.4;
}

static double yaw_inertia(void) {
    return mass() * (1.0 + 0.16) / 12.0;
}

/* ---- In empty space ---- */

static void thrust_accelerates_ahead_and_astern(void **state) {
    (void)state;
    Scene scene;
    scene_make(&scene);
    SkiffSim *sim = accept(&scene);
    assert_int_equal(skiff_drive_count(sim), 1);
    set(sim, 0.5, 0);
    run(sim, 100);
    SkiffBody body = skiff_body(sim, 0);
    assert_float_equal(body.velocity[0], -40.0 / mass() * skiff_time(sim), 1e-6);
    assert_float_equal(skiff_drive(sim, 0).thrust, 40.0, 1e-6);
    assert_float_equal(skiff_drive(sim, 0).speed, -body.velocity[0], 1e-12);
    assert_float_equal(body.velocity[1], 0.0, 0.0);
    assert_float_equal(body.angular_velocity[2], 0.0, 1e-12);
    set(sim, -0.5, 0);
    run(sim, 200);
    body = skiff_body(sim, 0);
    assert_true(body.velocity[0] > 0.25);
    assert_true(skiff_drive(sim, 0).speed < -0.25);
    skiff_destroy(sim);
}

/* However the boat pitches, the thrust at the centre stays level and keeps its size. */
static void thrust_at_the_centre_is_levelled(void **state) {
    (void)state;
    Scene scene;
    scene_make(&scene);
    scene.body.angular_velocity[2] = 1.0f;
    scene.body.free_axes = SKIFF_FREE_X | SKIFF_FREE_Y | SKIFF_FREE_Z;
    SkiffSim *sim = accept(&scene);
    set(sim, 1, 0);
    run(sim, 300); /* to 52 degrees */
    const SkiffBody body = skiff_body(sim, 0);
    assert_float_equal(body.velocity[0], -80.0 / mass() * skiff_time(sim), 1e-6);
    assert_float_equal(body.velocity[1], 0.0, 0.0);
    skiff_destroy(sim);
}

/* Points and axis turn and scale with the geometry. */
static void the_frame_is_the_geometrys(void **state) {
    (void)state;
    Scene scene;
    scene_make(&scene);
    scene.body.geometry.rotation_angle = (float)(pi / 2); /* about y: -x becomes +z */
    scene.body.geometry.scale[0] = 2.0f;
    scene.body.geometry.translation[1] = 3.0f;
    scene.drive.propeller[0] = 0.5f;
    scene.drive.propeller[1] = -0.1f;
    SkiffSim *sim = accept(&scene);
    const Drive *drive = &sim->drives[0];
    const double forward[3] = {0, 0, 1}, starboard[3] = {-1, 0, 0}, propeller[3] = {0, -0.1, -1};
    for (int k = 0; k < 3; k++) {
        assert_float_equal(drive->forward[k], forward[k], 1e-6);
        assert_float_equal(drive->starboard[k], starboard[k], 1e-6);
        assert_float_equal(drive->propeller.arm[k], propeller[k], 1e-6);
    }
    assert_float_equal(skiff_drive(sim, 0).heading, 0.0, 1e-12); /* of the start, whatever it is */
    set(sim, 1, 0);
    run(sim, 10);
    assert_float_equal(skiff_body(sim, 0).velocity[2], 80.0 / (2 * mass()) * skiff_time(sim), 1e-6);
    skiff_destroy(sim);
}

static void rudder_turns_to_starboard(void **state) {
    (void)state;
    Scene scene;
    scene_make(&scene);
    SkiffSim *sim = accept(&scene);
    set(sim, 0, 0.4);
    run(sim, 100);
    const double rate = 4.0 / yaw_inertia() * skiff_time(sim);
    assert_float_equal(skiff_body(sim, 0).angular_velocity[1], -rate, 1e-6);
    assert_float_equal(skiff_drive(sim, 0).torque, 4.0, 1e-6);
    const double heading = skiff_drive(sim, 0).heading;
    assert_float_equal(heading, 0.5 * rate * skiff_time(sim), 0.02 * heading);
    set(sim, 1, 0); /* bow between -x and -z: to starboard */
    run(sim, 50);
    assert_true(skiff_body(sim, 0).velocity[2] < -0.01);
    skiff_destroy(sim);
}

static void a_heading_is_found_and_held(void **state) {
    (void)state;
    const double wanted[] = {0.6, -2.5, 3.0 + 2 * pi};
    for (int k = 0; k < COUNT(wanted); k++) {
        Scene scene;
        scene_make(&scene);
        scene.drive.hold_gain = 2.0f;
        scene.drive.hold_damping = 1.5f; /* critical: 2 sqrt(2 I / T) = 1.76 */
        SkiffSim *sim = accept(&scene);
        set_heading(sim, wanted[k]);
        double highest = 0;
        for (int s = 0; s < 4000; s++) {
            run(sim, 1);
            highest = fmax(highest, fabs(skiff_drive(sim, 0).heading));
            assert_true(fabs(skiff_drive(sim, 0).torque) <= 10.0);
        }
        const double error = remainder(skiff_drive(sim, 0).heading - wanted[k], 2 * pi);
        assert_float_equal(error, 0.0, 1e-3);
        assert_true(highest < fabs(remainder(wanted[k], 2 * pi)) + 0.15);
        skiff_destroy(sim);
    }
}

/* The authors' rule: full rudder always, so the heading swings around the target and never settles. */
static void bangbang_is_always_full(void **state) {
    (void)state;
    Scene scene;
    scene_make(&scene);
    scene.drive.heading_hold = SKIFF_HOLD_BANGBANG;
    SkiffSim *sim = accept(&scene);
    set_heading(sim, 0.3);
    int port = 0, starboard = 0;
    for (int s = 0; s < 3000; s++) {
        run(sim, 1);
        assert_float_equal(fabs(skiff_drive(sim, 0).rudder), 1.0, 0.0);
        port += skiff_drive(sim, 0).rudder < 0;
        starboard += skiff_drive(sim, 0).rudder > 0;
        assert_true(fabs(skiff_drive(sim, 0).heading) < 0.7);
    }
    assert_true(port > 500 && starboard > 500);
    skiff_destroy(sim);
}

static void controls_wait_for_their_time(void **state) {
    (void)state;
    Scene scene;
    scene_make(&scene);
    scene.drive.start_time = 0.15f;
    SkiffSim *sim = accept(&scene);
    set(sim, 1, 1);
    run(sim, 50);
    assert_float_equal(skiff_body(sim, 0).velocity[0], 0.0, 0.0);
    assert_float_equal(skiff_drive(sim, 0).thrust, 0.0, 0.0);
    run(sim, 1);
    assert_float_equal(skiff_drive(sim, 0).thrust, 80.0, 0.0);
    assert_true(skiff_body(sim, 0).velocity[0] < 0.0);
    skiff_destroy(sim);

    scene.drive.start_time = 0.0f;
    scene.body.release_time = 0.15;
    sim = accept(&scene);
    set(sim, 1, 1);
    run(sim, 50);
    assert_float_equal(skiff_body(sim, 0).velocity[0], 0.0, 0.0);
    assert_float_equal(skiff_drive(sim, 0).thrust, 0.0, 0.0);
    run(sim, 2);
    assert_float_equal(skiff_drive(sim, 0).thrust, 80.0, 0.0);
    skiff_destroy(sim);
}

static void drag_slows_and_never_turns_back(void **state) {
    (void)state;
    Scene scene;
    scene_make(&scene);
    scene.drive.water_drag = 20.0f;
    scene.body.velocity[2] = 3.0f;
    SkiffSim *sim = accept(&scene);
    run(sim, 100);
    const double dt = (double)skiff_params(sim)->time_step;
    assert_float_equal(skiff_body(sim, 0).velocity[2], 3.0 * pow(1.0 + 20.0 * dt / mass(), -100), 1e-6);
    skiff_destroy(sim);

    scene.drive.water_drag = 0.0f;
    scene.drive.water_drag_sq = 10.0f;
    sim = accept(&scene);
    run(sim, 100); /* m v' = -c v^2: v = v0 / (1 + c v0 t / m) */
    assert_float_equal(skiff_body(sim, 0).velocity[2], 3.0 / (1.0 + 10.0 * 3.0 * 0.3 / mass()), 5e-3);
    skiff_destroy(sim);

    scene.drive.water_drag_sq = 1e9f;
    sim = accept(&scene);
    run(sim, 10);
    assert_true(skiff_body(sim, 0).velocity[2] >= 0.0 && skiff_body(sim, 0).velocity[2] < 1e-3);
    skiff_destroy(sim);

    scene.drive.water_drag_sq = 0.0f;
    scene.drive.air_drag = 1e6f;
    scene.drive.wind[0] = 7.0f;
    sim = accept(&scene);
    run(sim, 10);
    assert_float_equal(skiff_body(sim, 0).velocity[0], 7.0, 1e-6);
    assert_float_equal(skiff_body(sim, 0).velocity[2], 0.0, 1e-6);
    skiff_destroy(sim);
}

/* ---- In water ---- */

static void a_propeller_needs_water(void **state) {
    (void)state;
    Scene scene;
    scene_make(&scene);
    scene.drive.thrust_at = SKIFF_THRUST_AT_PROPELLER;
    scene.drive.propeller[0] = 0.7f;
    SkiffSim *sim = accept(&scene);
    set(sim, 1, 0);
    run(sim, 3);
    assert_float_equal(skiff_drive(sim, 0).water, 0.0, 0.0);
    assert_float_equal(skiff_drive(sim, 0).thrust, 0.0, 0.0);
    assert_float_equal(skiff_body(sim, 0).velocity[0], 0.0, 0.0);
    skiff_destroy(sim);

    scene_flood(&scene);
    sim = accept(&scene);
    set(sim, 1, 0);
    run(sim, 1);
    assert_float_equal(skiff_drive(sim, 0).water, 1.0, 0.0);
    assert_float_equal(skiff_drive(sim, 0).thrust, 80.0, 0.0);
    skiff_destroy(sim);

    scene.drive.propeller[0] = 0.53f; /* close to the stern, which leaves it half of the room */
    sim = accept(&scene);
    assert_true(sim->drives[0].propeller.open < 0.8);
    set(sim, 1, 0);
    run(sim, 1);
    assert_float_equal(skiff_drive(sim, 0).water, 1.0, 0.0);
    skiff_destroy(sim);

    scene.drive.propeller[0] = 0.7f;
    scene.drive.propeller[1] = 0.45f; /* within the kernel's reach above the water: partly in it */
    sim = accept(&scene);
    set(sim, 1, 0);
    run(sim, 1);
    assert_true(skiff_drive(sim, 0).water > 0.0 && skiff_drive(sim, 0).water < 0.5);
    skiff_destroy(sim);
}

/* A propeller below the centre of mass lifts the bow; along the body's axis, so the thrust tilts with it. */
static void a_low_propeller_pitches(void **state) {
    (void)state;
    Scene scene;
    scene_make(&scene);
    scene_flood(&scene);
    scene.drive.thrust_at = SKIFF_THRUST_AT_PROPELLER;
    scene.drive.propeller[0] = 0.7f;
    scene.drive.propeller[1] = -0.2f;
    SkiffSim *sim = accept(&scene);
    set(sim, 1, 0);
    double torque = 0;
    Err err = {0};
    drives_apply(sim);
    torque = sim->bodies[0].push_torque[2];
    assert_float_equal(torque, -16.0, 1e-6); /* 80 N 0.2 m; bow (-x) up is about -z */
    assert_float_equal(sim->bodies[0].push_torque[1], 0.0, 1e-9);
    assert_true(skiff_step(sim, &err));
    skiff_destroy(sim);
}

/* F = 1/2 rho A c |w| w.n with c = 6.13 s / (s + 2.25), at the moment of the start, when the water rests. */
static void a_rudder_obeys_its_formula(void **state) {
    (void)state;
    Scene scene;
    scene_make(&scene);
    scene_flood(&scene);
    scene.drive.steering = SKIFF_STEERING_RUDDER;
    scene.drive.rudder[0] = 0.7f;
    scene.body.velocity[0] = -2.0f;
    const double c = 6.13 * 1.5 / 3.75, angle = 0.5 * (double)scene.drive.rudder_angle;
    const double normal = 0.5 * 1000.0 * (double)scene.drive.rudder_area * c * 4.0 * sin(angle);
    SkiffSim *sim = accept(&scene);
    set(sim, 0, 0.5);
    drives_apply(sim);
    /* drag, and a stern pushed to port (+z) */
    assert_float_equal(sim->bodies[0].push[0], normal * sin(angle), 1e-4);
    assert_float_equal(sim->bodies[0].push[2], normal * cos(angle), 1e-4);
    assert_float_equal(skiff_drive(sim, 0).torque, 0.7 * normal * cos(angle), 1e-4);
    skiff_destroy(sim);

    /* at rest it has no force, but in the jet of a propeller it has */
    scene.body.velocity[0] = 0.0f;
    sim = accept(&scene);
    set(sim, 1, 0.5);
    drives_apply(sim);
    assert_float_equal(skiff_drive(sim, 0).torque, 0.0, 1e-9);
    skiff_destroy(sim);
    scene.drive.thrust_at = SKIFF_THRUST_AT_PROPELLER;
    scene.drive.propeller[0] = 0.6f;
    sim = accept(&scene);
    set(sim, 1, 0.5);
    drives_apply(sim);
    const double disc = pi * 0.25 * (double)(scene.drive.propeller_diameter * scene.drive.propeller_diameter);
    const double jet_sq = 2.0 * 80.0 / (1000.0 * disc);
    assert_float_equal(skiff_drive(sim, 0).torque, 0.7 * normal / 4.0 * jet_sq * cos(angle), 1e-4);
    set(sim, -1, 0.5); /* astern the jet goes the other way */
    drives_apply(sim);
    assert_float_equal(skiff_drive(sim, 0).torque, 0.0, 1e-9);
    skiff_destroy(sim);
}

/* Speed prescribed, the rest free: the force on the body is its drag. */
static void a_towed_body_reads_its_drag(void **state) {
    (void)state;
    Scene scene;
    scene_make(&scene);
    scene_flood(&scene);
    scene.body.drive = NULL;
    scene.body.velocity[0] = -1.0f;
    scene.body.free_axes = SKIFF_FREE_ALL & ~(unsigned)SKIFF_FREE_X;
    SkiffSim *sim = accept(&scene);
    double drag = 0;
    for (int s = 0; s < 60; s++) {
        run(sim, 1);
        const SkiffBody body = skiff_body(sim, 0);
        assert_float_equal(body.velocity[0], -1.0, 0.0);
        drag += body.force[0] / 60.0;
    }
    assert_float_equal(skiff_body(sim, 0).position[0], -skiff_time(sim), 1e-9);
    /* against the motion, and of the size of 1/2 rho v^2 A with A = 0.08 m^2 */
    assert_true(drag > 10.0 && drag < 400.0);
    skiff_destroy(sim);
}

/* ---- Refusals ---- */

static void bad_drives_are_refused(void **state) {
    (void)state;
    Scene scene;
    scene_make(&scene);
    memset(scene.drive.axis, 0, sizeof scene.drive.axis);
    refuse_saying(&scene.def, "RigidBodies[0].drive.axis: has no direction");
    scene.drive.axis[1] = -3.0f;
    refuse_saying(
        &scene.def,
        "RigidBodies[0].drive.axis: points down at the start; it must be within 84 degrees of level");
    scene_make(&scene);
    scene.body.free_axes = 0;
    refuse_saying(&scene.def, "RigidBodies[0].drive: has no effect, since the body has no free axis");
    scene_make(&scene);
    scene.drive.thrust = -1.0f;
    scene.drive.wind[2] = NAN;
    refuse_saying(&scene.def, "RigidBodies[0].drive.thrust: -1 is out of range, allowed is 0 to 1e+09 N\n"
                              "RigidBodies[0].drive.wind: nan is out of range, allowed is -1000 to 1000 m/s");
    scene_make(&scene);
    scene.drive.thrust_at = SKIFF_THRUST_AT_PROPELLER;
    scene.drive.steering = SKIFF_STEERING_RUDDER;
    refuse_saying(&scene.def, "RigidBodies[0].drive.propeller: is inside the body, where no water comes\n"
                              "RigidBodies[0].drive.rudder: is inside the body, where no water comes");
    scene_make(&scene);
    scene.drive.steering = 2;
    refuse_saying(&scene.def, "RigidBodies[0].drive.steering: 2 is out of range, allowed is 0 to 1");
}

static void bad_controls_are_refused(void **state) {
    (void)state;
    static const struct {
        SkiffControls controls;
        const char *message;
    } cases[] = {
        {{.throttle = 1.5}, "throttle: 1.5 is out of range, allowed is -1 to 1"},
        {{.throttle = NAN}, "throttle: nan is out of range, allowed is -1 to 1"},
        {{.rudder = -1.01}, "rudder: -1.01 is out of range, allowed is -1 to 1"},
        {{.hold = true, .heading = INFINITY}, "heading: must be finite"},
    };
    Scene scene;
    scene_make(&scene);
    SkiffSim *sim = accept(&scene);
    set(sim, 0.25, 0);
    for (int k = 0; k < COUNT(cases); k++) {
        Err err = {0};
        const double scalars[DRIVE_SCALARS] = {cases[k].controls.throttle, cases[k].controls.rudder,
                                               cases[k].controls.hold, cases[k].controls.heading};
        assert_false(skiff_drive_set(sim, 0, &cases[k].controls, &err));
        assert_int_equal(err.code, ERR_USAGE);
        assert_string_equal(err.message, cases[k].message);
        assert_false(drive_check_scalars(scalars, NULL)); /* nor taken from a file */
    }
    assert_float_equal(skiff_drive(sim, 0).controls.throttle, 0.25, 0.0);
    skiff_destroy(sim);
}

/* The table of settings: keys are unique, defaults are allowed, ranges are checked. */
static void every_setting_has_a_range(void **state) {
    (void)state;
    int count;
    const SkiffParamInfo *infos = skiff_drive_infos(&count);
    assert_true(count > 10);
    SkiffDriveDef def = skiff_drive_default();
    assert_true(params_check_drive(&def, "drive", NULL));
    for (int i = 0; i < count; i++) {
        for (int j = 0; j < i; j++)
            assert_string_not_equal(infos[i].key, infos[j].key);
        def = skiff_drive_default();
        void *member = (char *)&def + infos[i].offset;
        if (infos[i].type == SKIFF_ENUM)
            *(int *)member = -1;
        else
            *(float *)member = INFINITY;
        assert_false(params_check_drive(&def, "drive", NULL));
    }
}

/* ---- State ---- */

static void controls_are_state(void **state) {
    (void)state;
    char path[64];
    Err err = {0};
    Scene scene;
    snprintf(path, sizeof path, "drive_%ld.state", (long)getpid());
    scene_make(&scene);
    SkiffSim *first = accept(&scene), *second = accept(&scene);
    assert_int_equal(skiff_hash(first), skiff_hash(second));
    set(first, 0.75, -0.5);
    assert_int_not_equal(skiff_hash(first), skiff_hash(second));
    run(first, 20);
    set_heading(first, 0.3);
    assert_true(skiff_save(first, path, &err));
    assert_true(skiff_load(second, path, &err));
    assert_int_equal(skiff_hash(first), skiff_hash(second));
    run(first, 20);
    run(second, 20);
    assert_int_equal(skiff_hash(first), skiff_hash(second));
    assert_float_equal(skiff_drive(second, 0).controls.heading, 0.3, 0.0);

    /* a drive with other settings is another scene */
    scene.drive.thrust = 81.0f;
    SkiffSim *other = accept(&scene);
    assert_false(skiff_load(other, path, &err));
    assert_non_null(strstr(err.message, "other settings"));
    unlink(path);
    skiff_destroy(first);
    skiff_destroy(second);
    skiff_destroy(other);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(thrust_accelerates_ahead_and_astern),
        cmocka_unit_test(thrust_at_the_centre_is_levelled),
        cmocka_unit_test(the_frame_is_the_geometrys),
        cmocka_unit_test(rudder_turns_to_starboard),
        cmocka_unit_test(a_heading_is_found_and_held),
        cmocka_unit_test(bangbang_is_always_full),
        cmocka_unit_test(controls_wait_for_their_time),
        cmocka_unit_test(drag_slows_and_never_turns_back),
        cmocka_unit_test(a_propeller_needs_water),
        cmocka_unit_test(a_low_propeller_pitches),
        cmocka_unit_test(a_rudder_obeys_its_formula),
        cmocka_unit_test(a_towed_body_reads_its_drag),
        cmocka_unit_test(bad_drives_are_refused),
        cmocka_unit_test(bad_controls_are_refused),
        cmocka_unit_test(every_setting_has_a_range),
        cmocka_unit_test(controls_are_state),
    };
    return cmocka_run_group_tests_name("drive", tests, NULL, NULL);
}
