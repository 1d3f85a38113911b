/* skiff profile and trace.json, from tables whose answer is known. */
#include "app/csv.h"
#include "app/profile.h"
#include "app/trace.h"

#include "engine/base/file.h"

#include <jansson.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include <cmocka.h>

#include "scratch.h"

static CsvTable read_table(const char *path) {
    CsvTable table;
    Err err = {0};
    if (!csv_read(path, &table, &err))
        fail_msg("%s", err.message);
    return table;
}

static const char header[] =
    "step,t,dt,particles,density_iterations,divergence_iterations,moved,sort_ms,pressure_ms,"
    "step_ms\n";

/* 100 steps of 10 ms (2 sort, 8 pressure). Steps 40 and 43 are moves of 20 ms, step 41, 42, 44 .. 48 take 12;
 * step 70 has 18 iterations and 30 ms, step 80 adds 500 particles and takes 16, step 90 takes 14 for nothing.
 */
static CsvTable known_table(void) {
    char *text;
    size_t size;
    FILE *stream = open_memstream(&text, &size);
    assert_non_null(stream);
    fputs(header, stream);
    for (int step = 1; step <= 100; step++) {
        const bool moved = step == 40 || step == 43, after = step > 40 && step <= 48 && !moved;
        const double sort = step == 80 ? 8 : moved ? 12 : 2;
        const double pressure = step == 70 ? 28 : step == 90 ? 12 : after ? 10 : 8;
        fprintf(stream, "%d,%g,0.003,%d,%d,3,%d,%g,%g,%g\n", step, 0.003 * step, step < 80 ? 1000 : 1500,
                step == 70 ? 18 : 6, moved, sort, pressure, sort + pressure);
    }
    assert_int_equal(fclose(stream), 0);
    scratch_write("known.csv", text);
    free(text);
    return read_table("known.csv");
}

static void numbers_are_right(void **state) {
    (void)state;
    CsvTable table = known_table();
    Profile profile;
    Err err = {0};
    assert_true(profile_make(&table, "known.csv", &profile, &err));
    assert_int_equal(profile.steps, 100);
    assert_int_equal(profile.moves, 2);
    assert_float_equal(profile.p50_ms, 10, 0);
    assert_float_equal(profile.p95_ms, 12, 0); /* rank 95: above it are 14 16 20 20 30 */
    assert_float_equal(profile.p99_ms, 20, 0);
    assert_float_equal(profile.max_ms, 30, 0);
    assert_float_equal(profile.move_ms, 20, 0);
    assert_float_equal(profile.after5_ms, 12, 1e-12);
    assert_float_equal(profile.plain_ms, (88 * 10 + 30 + 16 + 14) / 91.0, 1e-9);
    assert_float_equal(profile.mean_ms, (88 * 10 + 30 + 16 + 14 + 2 * 20 + 7 * 12) / 100.0, 1e-9);
    assert_float_equal(profile.real_time_factor, 3 / profile.mean_ms, 1e-9);
    assert_int_equal(profile.phase_count, 2);
    assert_string_equal(profile.phases[0].key, "sort");
    assert_string_equal(profile.phases[1].key, "pressure");
    assert_float_equal(profile.phases[0].move_ms, 12, 0);
    assert_float_equal(profile.phases[1].plain_ms, (88 * 8 + 28 + 8 + 12) / 91.0, 1e-9);
    csv_free(&table);
}

static void slow_steps_are_explained(void **state) {
    (void)state;
    static const struct {
        double step, ms;
        const char *why;
    } expected[] = {
        {70, 30, "18 density iterations (median 6); pressure +20 ms"},
        {40, 20, "window move; sort +10 ms"},
        {43, 20, "window move; sort +10 ms"},
        {80, 16, "500 particles more; sort +6 ms"},
        {90, 14, "no more work than other steps; pressure +4 ms"},
        {41, 12, "1 after a window move; pressure +2 ms"},
        {42, 12, "2 after a window move; pressure +2 ms"},
        {44, 12, "1 after a window move; pressure +2 ms"},
        {45, 12, "2 after a window move; pressure +2 ms"},
        {46, 12, "3 after a window move; pressure +2 ms"},
    };
    CsvTable table = known_table();
    Profile profile;
    Err err = {0};
    assert_true(profile_make(&table, "known.csv", &profile, &err));
    assert_int_equal(profile.worst_count, 10);
    for (int k = 0; k < 10; k++) {
        assert_float_equal(profile.worst[k].step, expected[k].step, 0);
        assert_float_equal(profile.worst[k].ms, expected[k].ms, 0);
        assert_string_equal(profile.worst[k].why, expected[k].why);
    }
    csv_free(&table);
}

static void json_has_every_key(void **state) {
    (void)state;
    static const char *const keys[] = {
        "steps",     "moves",  "mean_ms",          "p50_ms",          "p95_ms",
        "p99_ms",    "max_ms", "plain_ms",         "move_ms",         "after5_ms",
        "phases_ms", "worst",  "real_time_factor", "phases_plain_ms", "phases_move_ms"};
    CsvTable table = known_table();
    Profile profile;
    Err err = {0};
    assert_true(profile_make(&table, "known.csv", &profile, &err));
    json_t *object = profile_json(&profile);
    for (size_t i = 0; i < sizeof keys / sizeof *keys; i++)
        if (!json_object_get(object, keys[i]))
            fail_msg("no %s", keys[i]);
    assert_float_equal(json_number_value(json_object_get(json_object_get(object, "phases_move_ms"), "sort")),
                       12, 0);
    json_decref(object);
    csv_free(&table);
}

/* Without moves there is nothing to say about them: null, not 0. */
static void a_run_without_moves_has_nulls(void **state) {
    (void)state;
    char text[512];
    snprintf(text, sizeof text, "%s1,0.003,0.003,10,6,3,0,1,2,3\n2,0.006,0.003,10,6,3,0,1,2,4\n", header);
    scratch_write("two.csv", text);
    CsvTable table = read_table("two.csv");
    Profile profile;
    Err err = {0};
    assert_true(profile_make(&table, "two.csv", &profile, &err));
    assert_true(isnan(profile.move_ms) && isnan(profile.after5_ms));
    assert_float_equal(profile.plain_ms, 3.5, 0);
    assert_int_equal(profile.worst_count, 2);
    json_t *object = profile_json(&profile);
    assert_true(json_is_null(json_object_get(object, "move_ms")));
    json_decref(object);
    csv_free(&table);
}

static void bad_tables_are_refused(void **state) {
    (void)state;
    static const struct {
        const char *text, *message;
    } cases[] = {
        {"step,t,dt,particles,density_iterations,divergence_iterations,step_ms\n1,1,1,1,1,1,1\n",
         "x.csv: has no column moved"},
        {header, "x.csv: has no rows: no step was made"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        Err err = {0};
        Profile profile;
        scratch_write("x.csv", cases[i].text);
        CsvTable table = read_table("x.csv");
        assert_false(profile_make(&table, "x.csv", &profile, &err));
        assert_int_equal(err.code, ERR_INPUT);
        assert_string_equal(err.message, cases[i].message);
        csv_free(&table);
    }
}

static double number_of(const json_t *event, const char *key) {
    return json_number_value(json_object_get(event, key));
}

/* One slice a step, its phases inside it, an instant at each move; no slice begins before the last has ended.
 */
static void a_trace_nests(void **state) {
    (void)state;
    CsvTable table = known_table();
    Err err = {0};
    assert_true(trace_write("trace.json", &table, &err));
    json_t *trace = json_load_file("trace.json", 0, NULL);
    assert_non_null(trace);
    const json_t *events = json_object_get(trace, "traceEvents");
    int steps = 0, phases = 0, moves = 0;
    double step_end = 0, phase_end = 0;
    for (size_t i = 0; i < json_array_size(events); i++) {
        const json_t *event = json_array_get(events, i);
        const char *name = json_string_value(json_object_get(event, "name"));
        const char *kind = json_string_value(json_object_get(event, "ph"));
        const double begin = number_of(event, "ts"), end = begin + number_of(event, "dur");
        if (strcmp(kind, "i") == 0) {
            const double step = number_of(json_object_get(event, "args"), "step");
            assert_string_equal(name, "window move");
            assert_true(step == 40 || step == 43);
            moves++;
        }
        if (strcmp(kind, "X") != 0)
            continue;
        if (strcmp(name, "step") == 0) {
            assert_float_equal(begin, step_end, 1e-6);
            step_end = end;
            phase_end = begin;
            steps++;
        } else {
            assert_true(begin >= phase_end - 1e-6 && end <= step_end + 1e-6);
            phase_end = end;
            phases++;
        }
    }
    assert_int_equal(steps, 100);
    assert_int_equal(phases, 200);
    assert_int_equal(moves, 2);
    assert_float_equal(step_end, 1e3 * (88 * 10 + 30 + 16 + 14 + 2 * 20 + 7 * 12), 1e-3);
    json_decref(trace);
    csv_free(&table);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(numbers_are_right),      cmocka_unit_test(slow_steps_are_explained),
        cmocka_unit_test(json_has_every_key),     cmocka_unit_test(a_run_without_moves_has_nulls),
        cmocka_unit_test(bad_tables_are_refused), cmocka_unit_test(a_trace_nests),
    };
    return cmocka_run_group_tests_name("profile", tests, scratch_enter, scratch_leave);
}
