/* How many iterations water at rest needs: the counts themselves and their ratio, at a density error that is
 * the same for both.
 *
 * A settled tank of 16 x 16 x 16 particles. "gcr": this engine's solver with its defaults. "jacobi": as the
 * papers have it, with the whole density error corrected in one step and half of the last pressures as the
 * start. The error is what the next step finds. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "skiff.h"

#include <string.h>

enum { SETTLE = 700, MEASURE = 100 };

typedef struct Effort {
    double iterations, error, speed;
} Effort;

static Effort settled_tank(int solver) {
    SkiffDef def = skiff_def_default();
    def.params.pressure_solver = solver;
    if (solver == SKIFF_SOLVER_JACOBI) {
        def.params.softening = 1.0f;
        def.params.warm_start = 0.5f;
    }
    def.threads = 2;
    def.tank.geometry.kind = SKIFF_GEOMETRY_BOX;
    const float tank[3] = {0.85f, 1.2f, 0.85f};
    SkiffBlockDef block = skiff_block_default();
    for (int k = 0; k < 3; k++) {
        def.tank.geometry.size[k] = tank[k];
        def.tank.geometry.translation[k] = tank[k] / 2;
        block.start[k] = 0.025f;
        block.end[k] = 0.825f;
    }
    def.blocks = &block;
    def.block_count = 1;
    Err err = {0};
    SkiffSim *sim = skiff_create(&def, &err);
    if (sim == NULL)
        fail_msg("%s", err.message);
    Effort effort = {0};
    for (int step = 0; step < SETTLE + MEASURE; step++) {
        if (!skiff_step(sim, &err))
            fail_msg("%s", err.message);
        if (step < SETTLE)
            continue;
        const SkiffStats *stats = skiff_stats(sim);
        effort.iterations += stats->density_iterations / (double)MEASURE;
        effort.error += stats->density_error_percent / MEASURE;
        effort.speed += stats->mean_speed / MEASURE;
    }
    skiff_destroy(sim);
    print_message("%s: %.2f iterations, density error %.4f %%, mean speed %.4f m/s\n",
                  solver == SKIFF_SOLVER_GCR ? "gcr" : "jacobi", effort.iterations, effort.error,
                  effort.speed);
    return effort;
}

static void test_iterations(void **state) {
    (void)state;
    const Effort gcr = settled_tank(SKIFF_SOLVER_GCR), jacobi = settled_tank(SKIFF_SOLVER_JACOBI);
    assert_true(gcr.error <= 0.01);
    assert_true(jacobi.error <= 0.0125); /* its own test of 0.01 % is on the predicted density */
    assert_true(gcr.speed < 0.03);       /* it is at rest, not merely unsolved */
    assert_true(gcr.iterations <= 7.0);
    assert_true(jacobi.iterations >= 3.0 * gcr.iterations);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_iterations)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
