/* The same state, bit for bit, whatever computes it: threads, instruction sets, a save and resume in the
 * middle. And a steady step allocates nothing.
 *
 * Scene: a dam break of about 3000 particles that meets a floating body with propeller and rudder, driven by
 * an input file, 200 steps. Long enough for every particle to have met walls and body and to have changed
 * cells; a difference in one bit of one sum spreads over the whole state within a few steps. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "app/helm.h"
#include "base/arena.h"
#include "skiff.h"

#include <stdio.h>
#include <string.h>
#include <unistd.h>

enum { STEPS = 200 };

/* pressureSolver of the dams that are made */
static int dam_solver = SKIFF_SOLVER_GCR;

static SkiffSim *make_dam(int threads, SkiffSimd simd, Err *err) {
    SkiffDef def = skiff_def_default();
    def.threads = threads;
    def.simd = simd;
    def.params.pressure_solver = dam_solver;
    def.tank.geometry.kind = SKIFF_GEOMETRY_BOX;
    const float tank[3] = {1.6f, 1.0f, 0.6f};
    for (int k = 0; k < 3; k++) {
        def.tank.geometry.size[k] = tank[k];
        def.tank.geometry.translation[k] = tank[k] / 2;
    }
    def.tank.open = false;
    SkiffBlockDef block = skiff_block_default();
    const float end[3] = {0.775f, 0.975f, 0.575f};
    for (int k = 0; k < 3; k++) {
        block.start[k] = 0.025f;
        block.end[k] = end[k];
    }
    SkiffBodyDef body = skiff_body_default();
    body.name = "box";
    body.geometry.kind = SKIFF_GEOMETRY_BOX;
    body.geometry.rotation_angle = 0.3f;
    const float size[3] = {0.2f, 0.15f, 0.25f}, centre[3] = {1.1f, 0.2f, 0.32f};
    memcpy(body.geometry.size, size, sizeof size);
    memcpy(body.geometry.translation, centre, sizeof centre);
    body.density = 400.0f;
    body.release_time = 0.25; /* the water is under it by then */
    SkiffDriveDef drive = skiff_drive_default();
    drive.thrust = 5.0f;
    drive.thrust_at = SKIFF_THRUST_AT_PROPELLER;
    drive.propeller[1] = drive.rudder[1] = -0.08f;
    drive.propeller[0] = 0.12f;
    drive.propeller_diameter = 0.08f;
    drive.steering = SKIFF_STEERING_RUDDER;
    drive.rudder[0] = 0.16f;
    drive.rudder_area = 0.003f;
    drive.water_drag_sq = 2.0f;
    body.drive = &drive;
    def.blocks = &block;
    def.block_count = 1;
    def.bodies = &body;
    def.body_count = 1;
    return skiff_create(&def, err);
}

/* Drives by the input as the program does; a simulation without a drive just runs. */
static void run(SkiffSim *sim, int steps) {
    static const char input[] = "0.25 throttle 1\n0.27 heading 25\n0.36 press d\n0.45 release d\n"
                                "0.45 throttle 0.4\n0.5 rudder -0.7\n";
    ScriptWords words = {0};
    Script script;
    Err err = {0};
    words.keys = script_default_keys(&words.key_count);
    if (!script_parse("input", input, sizeof input - 1, &words, &script, &err))
        fail_msg("%s", err.message);
    Helm helm = helm_begin(&words);
    bool good = true;
    for (int s = 0; good && s < steps; s++) {
        helm_advance(&helm, &script, skiff_time(sim));
        const HelmPosition position = helm_position(&helm);
        const SkiffControls controls = helm_controls(&position);
        good = (skiff_drive_count(sim) == 0 || skiff_drive_set(sim, 0, &controls, &err)) &&
               skiff_step(sim, &err);
    }
    script_free(&script);
    if (!good)
        fail_msg("%s", err.message);
}

static uint64_t dam_hash(int threads, SkiffSimd simd) {
    Err err = {0};
    SkiffSim *sim = make_dam(threads, simd, &err);
    if (sim == NULL)
        fail_msg("%s", err.message);
    run(sim, STEPS);
    const uint64_t hash = skiff_hash(sim);
    skiff_destroy(sim);
    return hash;
}

/* The state that all others are compared with: one thread, plain C. Also shows that the hash tells states
 * apart. */
static uint64_t reference_hash(void) {
    static uint64_t hash = 0;
    if (hash != 0)
        return hash;
    Err err = {0};
    SkiffSim *sim = make_dam(1, SKIFF_SIMD_PLAIN, &err);
    if (sim == NULL)
        fail_msg("%s", err.message);
    assert_true(skiff_particles(sim).count > 2500);
    uint64_t before = 0;
    bool both_found_water = false; /* propeller and rudder: the box tumbles in and out of it */
    for (int step = 0; step < STEPS; step++) {
        before = skiff_hash(sim);
        run(sim, 1);
        const SkiffDrive drive = skiff_drive(sim, 0);
        both_found_water = both_found_water || (drive.thrust > 0.5 && drive.torque != 0.0);
    }
    hash = skiff_hash(sim);
    assert_int_not_equal(hash, before);
    const SkiffBody body = skiff_body(sim, 0);
    assert_true(body.position[0] > 1.12); /* the water carries it along */
    assert_true(both_found_water);
    skiff_destroy(sim);
    return hash;
}

static void test_threads(void **state) {
    (void)state;
    const int counts[] = {1, 2, 3, 8};
    for (size_t k = 0; k < sizeof counts / sizeof counts[0]; k++)
        assert_int_equal(dam_hash(counts[k], SKIFF_SIMD_AUTO), reference_hash());
}

static void test_instruction_sets(void **state) {
    (void)state;
    const SkiffSimd kinds[] = {SKIFF_SIMD_PLAIN, SKIFF_SIMD_AVX2, SKIFF_SIMD_AVX512};
    for (size_t k = 0; k < sizeof kinds / sizeof kinds[0]; k++) {
        Err err = {0};
        SkiffSim *sim = make_dam(1, kinds[k], &err);
        if (sim == NULL) { /* this processor lacks it: the only failure that is fine here */
            assert_int_equal(err.code, ERR_USAGE);
            print_message("skipped %s: %s\n", skiff_simd_name(kinds[k]), err.message);
            continue;
        }
        skiff_destroy(sim);
        assert_int_equal(dam_hash(2, kinds[k]), reference_hash());
    }
}

static void check_save_and_resume(uint64_t reference) {
    char path[64];
    snprintf(path, sizeof path, "determinism_%ld.state", (long)getpid());
    Err err = {0};
    SkiffSim *first = make_dam(2, SKIFF_SIMD_AUTO, &err);
    SkiffSim *second = make_dam(1, SKIFF_SIMD_AUTO, &err);
    if (first == NULL || second == NULL)
        fail_msg("%s", err.message);
    run(first, STEPS / 2);
    run(second, 3); /* so that the load has something to replace */
    const bool saved = skiff_save(first, path, &err);
    const bool loaded = saved && skiff_load(second, path, &err);
    unlink(path);
    if (!loaded)
        fail_msg("%s", err.message);
    assert_int_equal(skiff_hash(second), skiff_hash(first));
    run(second, STEPS / 2);
    assert_int_equal(skiff_hash(second), reference);
    /* saving changed nothing in the one that was saved */
    run(first, STEPS / 2);
    assert_int_equal(skiff_hash(first), reference);
    skiff_destroy(first);
    skiff_destroy(second);
}

static void test_save_and_resume(void **state) {
    (void)state;
    check_save_and_resume(reference_hash());
}

static void test_split(void **state) {
    (void)state;
    const uint64_t other = reference_hash();
    dam_solver = SKIFF_SOLVER_SPLIT;
    const uint64_t reference = dam_hash(1, SKIFF_SIMD_PLAIN);
    assert_int_not_equal(reference, other);
    assert_int_equal(dam_hash(3, SKIFF_SIMD_AUTO), reference);
    check_save_and_resume(reference);
    dam_solver = SKIFF_SOLVER_GCR;
}

static void test_steady_steps_allocate_nothing(void **state) {
    (void)state;
    SkiffDef def = skiff_def_default();
    def.threads = 2;
    def.tank.geometry.kind = SKIFF_GEOMETRY_BOX;
    def.tank.geometry.translation[1] = 0.5f; /* a cube of 1 m on the floor y = 0 */
    SkiffBlockDef block = skiff_block_default();
    const float start[3] = {-0.475f, 0.025f, -0.475f}, end[3] = {0.475f, 0.425f, 0.475f};
    memcpy(block.start, start, sizeof start);
    memcpy(block.end, end, sizeof end);
    def.blocks = &block;
    def.block_count = 1;
    Err err = {0};
    SkiffSim *sim = skiff_create(&def, &err);
    if (sim == NULL)
        fail_msg("%s", err.message);
    run(sim, 600);
    const uint64_t before = buffer_allocation_count();
    assert_true(before > 0);
    run(sim, 100);
    assert_int_equal(buffer_allocation_count(), before);
    skiff_destroy(sim);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_threads),
        cmocka_unit_test(test_instruction_sets),
        cmocka_unit_test(test_save_and_resume),
        cmocka_unit_test(test_split),
        cmocka_unit_test(test_steady_steps_allocate_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
