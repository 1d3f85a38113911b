/* The wake on the ocean: foam that stays where it was when the window leaves it, and dies away. */
#include "app/wake.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>
#include <cmocka.h>

enum { SIDE = 11, SAMPLES = SIDE * SIDE };

static const float half = 1.0f; /* m, of a square window */
static const float still[2] = {0.0f, 0.0f};

static float distances[SAMPLES];

static EdgeMap square_window(void) {
    EdgeMap map = {.distance = distances, .size = {SIDE, SIDE}, .min = {-2, -2}, .max = {2, 2}};
    for (int i = 0; i < SAMPLES; i++) {
        float x = -2 + 0.4f * (float)(i % SIDE), z = -2 + 0.4f * (float)(i / SIDE);
        distances[i] = half - fmaxf(fabsf(x), fabsf(z));
    }
    return map;
}

static void the_map_is_read_between_samples(void **unused) {
    (void)unused;
    EdgeMap map = square_window();
    assert_float_equal(edge_map_at(&map, 1.2f, 0.1f), -0.2, 1e-6);
    assert_float_equal(edge_map_at(&map, 0.0f, -1.5f), -0.5, 1e-6);
    assert_true(edge_map_at(&map, 2.5f, 0.0f) == -INFINITY);
    assert_true(edge_map_at(&map, 0.0f, -2.5f) == -INFINITY);
}

/* Foam at world x, z, in the nearest cell. */
static float foam_at(const Wake *wake, double x, double z) {
    int i = (int)lround(x / (double)wake->cell - wake->base[0]);
    int j = (int)lround(z / (double)wake->cell - wake->base[1]);
    assert_in_range(i, 0, WAKE_EDGE - 1);
    assert_in_range(j, 0, WAKE_EDGE - 1);
    return wake->amount[j * WAKE_EDGE + i];
}

static float sum_of(const Wake *wake) {
    float sum = 0;
    for (uint64_t i = 0; i < wake_count(wake); i++)
        sum += wake->amount[i];
    return sum;
}

static void foam_stays_in_the_world_and_dies_away(void **unused) {
    (void)unused;
    EdgeMap map = square_window();
    Wake wake = {0};
    assert_true(wake_make(&wake, 0.1f, NULL));
    float position[3][4] = {{0.3f, 0, 0.2f, 0}, {0.3f, -0.9f, 0.2f, 0}, {1.4f, 0, 0, 0}};
    float foam[3] = {0.8f, 0.5f, 0.7f}; /* at the surface; deep below; outside the window */
    Frame frame = {.spacing = 0.1f, .live = 3, .count = 3, .position = position, .has_window = true};
    for (int step = 0; step <= 60; step++) {
        frame.time = 0.05 * step;
        wake_update(&wake, &frame, foam, &map, still, 0.1f);
    }
    /* All of it lies in the four cells around: amounts are per square of a spacing, cells 1.5 spacings wide.
     */
    assert_float_equal(sum_of(&wake) * 1.5f * 1.5f, 0.8, 1e-4);
    float before = foam_at(&wake, 0.3, 0.2);
    assert_true(before > 0.1f);

    /* The window goes on by 5 m and takes its particles along. */
    frame.window_centre[0] = frame.origin[0] = 5;
    frame.time += 1;
    foam[0] = 0;
    wake_update(&wake, &frame, foam, &map, still, 0.1f);
    float after = foam_at(&wake, 0.3, 0.2);
    assert_true(after < before && after > 0.5f * before);
    assert_true(foam_at(&wake, 5.3, 0.2) == 0);

    /* And far away: the map forgets. */
    frame.window_centre[0] = frame.origin[0] = 1e6;
    frame.time += 0.1;
    wake_update(&wake, &frame, foam, &map, still, 0.1f);
    assert_true(sum_of(&wake) == 0);
    wake_free(&wake);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_map_is_read_between_samples),
        cmocka_unit_test(foam_stays_in_the_world_and_dies_away),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
