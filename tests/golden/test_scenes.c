/* Every scene that comes with the program, in particles so coarse that it is a matter of a second: it starts,
 * runs, accounts for its particles, and goes on from a saved state with other threads to the same bits. A
 * scene dropped into assets/scenes is tested here without another word. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "app/pilot.h"
#include "app/scene.h"

#include <dirent.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { STEPS = 6, LEAST = 300 };

static const char folder[] = SKIFF_SOURCE_DIR "/assets/scenes";

/* The scene with particles `factor` times as large. */
static Scene *load(const char *path, double factor) {
    Err err = {0};
    Scene *fine = scene_load(path, NULL, 0, &err);
    if (!fine)
        fail_msg("%s", err.message);
    char texts[2][64];
    snprintf(texts[0], sizeof texts[0], "particleRadius=%.9g",
             factor * (double)fine->def.params.particle_radius);
    snprintf(texts[1], sizeof texts[1], "timeStepSize=%.9g", factor * (double)fine->def.params.time_step);
    scene_free(fine);
    const char *const edits[] = {texts[0], texts[1], "seaSteps=4", "restSteps=4"};
    Scene *scene = scene_load(path, edits, 4, &err);
    if (!scene)
        fail_msg("%s", err.message);
    return scene;
}

/* As coarse as leaves some hundred particles and as the scene's blocks allow, which must fit into its tank
 * whole. */
static SkiffSim *start(const char *path, int threads, Scene **scene) {
    static const double factors[] = {4, 3, 2, 1.5, 1};
    Err err = {0};
    for (size_t k = 0; k < sizeof factors / sizeof *factors; k++) {
        *scene = load(path, factors[k]);
        err = (Err){0};
        SkiffSim *sim = scene_start(*scene, threads, SKIFF_SIMD_AUTO, &err);
        if (sim && skiff_particles(sim).count >= LEAST)
            return sim;
        skiff_destroy(sim);
        scene_free(*scene);
    }
    fail_msg("%s: %s", path, err.code == ERR_NONE ? "too few particles" : err.message);
    return NULL;
}

static int64_t step(SkiffSim *sim, int steps) {
    int64_t balance = 0;
    Err err = {0};
    for (int k = 0; k < steps; k++) {
        if (!skiff_step(sim, &err))
            fail_msg("%s", err.message);
        const SkiffStats *stats = skiff_stats(sim);
        for (int c = 0; c < SKIFF_IN_COUNT; c++)
            balance += stats->particles_in[c];
        for (int c = 0; c < SKIFF_OUT_COUNT; c++)
            balance -= stats->particles_out[c];
    }
    return balance;
}

static void expect_input(const Scene *scene) {
    Pilot pilot = {0};
    Err err = {0};
    if (scene->input && !pilot_read(&pilot, scene, NULL, NULL, &err))
        fail_msg("%s", err.message);
    pilot_free(&pilot);
}

static void expect_good(const char *path) {
    char state[64];
    Err err = {0};
    Scene *scene, *again;
    SkiffSim *sim = start(path, 1, &scene);
    expect_input(scene);
    const int64_t first = skiff_particles(sim).count;
    const int64_t balance = step(sim, STEPS);
    assert_int_equal(first + balance, skiff_particles(sim).count);
    assert_true(isfinite(skiff_stats(sim)->kinetic_energy) && isfinite(skiff_stats(sim)->mean_height));
    snprintf(state, sizeof state, "scene_%d.skiff", (int)getpid());
    assert_true(skiff_save(sim, state, &err));
    step(sim, 2);
    SkiffSim *resumed = start(path, 2, &again);
    if (!skiff_load(resumed, state, &err))
        fail_msg("%s: %s", path, err.message);
    step(resumed, 2);
    assert_int_equal(skiff_hash(resumed), skiff_hash(sim));
    unlink(state);
    skiff_destroy(sim);
    skiff_destroy(resumed);
    scene_free(scene);
    scene_free(again);
}

static void every_scene_runs(void **unused) {
    (void)unused;
    DIR *directory = opendir(folder);
    assert_non_null(directory);
    int count = 0;
    for (const struct dirent *entry; (entry = readdir(directory)) != NULL;) {
        const char *dot = strrchr(entry->d_name, '.');
        if (!dot || strcmp(dot, ".json") != 0)
            continue;
        char path[4096];
        snprintf(path, sizeof path, "%s/%s", folder, entry->d_name);
        print_message("%s\n", entry->d_name);
        expect_good(path);
        count++;
    }
    closedir(directory);
    assert_true(count >= 10);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(every_scene_runs)};
    setenv("SKIFF_CACHE", "", 1); /* water of four steps is for nobody else */
    return cmocka_run_group_tests_name("scenes", tests, NULL, NULL);
}
