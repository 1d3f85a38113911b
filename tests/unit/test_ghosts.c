/* What was removed lately: kept for half a second, also in a file, and refused when it is nonsense. */
#include "engine/base/state_file.h"
#include "engine/ghosts.h"

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

enum { COUNT = 5 };

/* One every tenth of a second from `start` on. */
static void fill(Ghosts *ghosts, double start) {
    Err err = {0};
    for (int i = 0; i < COUNT; i++) {
        double time = start + 0.1 * i;
        assert_true(ghosts_reserve(ghosts, 1, time, &err));
        uint32_t to = ghosts->first + ghosts->count++;
        for (int k = 0; k < 4; k++) {
            ghosts->position[to][k] = (float)(i + k);
            ghosts->velocity[to][k] = (float)(i - k);
        }
        ghosts->id[to] = 100 + (uint64_t)i;
        ghosts->birth[to] = 0.5 * i;
        ghosts->removed[to] = time;
    }
}

static void write_to_file(const Ghosts *ghosts) {
    Err err = {0};
    StateField fields[GHOST_FIELDS];
    ghosts_describe(ghosts, fields);
    assert_true(state_file_write("ghosts.skiff", 1, fields, GHOST_FIELDS, &err));
}

static bool read_from_file(Ghosts *ghosts, Err *err) {
    StateFile *file = state_file_open("ghosts.skiff", 1, err);
    assert_non_null(file);
    bool good = ghosts_load(ghosts, file, "ghosts.skiff", err);
    state_file_close(file);
    return good;
}

static void old_ones_are_forgotten(void **unused) {
    (void)unused;
    Ghosts ghosts = {0};
    Err err = {0};
    fill(&ghosts, 1);
    assert_int_equal(ghosts.count, COUNT);
    assert_true(ghosts_reserve(&ghosts, 1, 1.65, &err));
    assert_int_equal(ghosts.count, COUNT - 2);
    assert_int_equal(ghosts.id[ghosts.first], 102);
    ghosts_free(&ghosts);
}

static void a_file_brings_them_back(void **unused) {
    (void)unused;
    Ghosts ghosts = {0}, other = {0};
    Err err = {0};
    write_to_file(&ghosts); /* none */
    fill(&other, 9);
    assert_true(read_from_file(&other, &err));
    assert_int_equal(other.count, 0);
    fill(&ghosts, 1);
    assert_true(ghosts_reserve(&ghosts, 1, 1.55, &err)); /* the queue no longer begins at the front */
    write_to_file(&ghosts);
    assert_true(read_from_file(&other, &err));
    uint32_t n = ghosts.count, from = ghosts.first, to = other.first;
    assert_int_equal(n, COUNT - 1);
    assert_int_equal(other.count, n);
    assert_memory_equal(ghosts.position + from, other.position + to, n * sizeof *ghosts.position);
    assert_memory_equal(ghosts.velocity + from, other.velocity + to, n * sizeof *ghosts.velocity);
    assert_memory_equal(ghosts.id + from, other.id + to, n * sizeof *ghosts.id);
    assert_memory_equal(ghosts.birth + from, other.birth + to, n * sizeof *ghosts.birth);
    assert_memory_equal(ghosts.removed + from, other.removed + to, n * sizeof *ghosts.removed);
    ghosts_free(&ghosts);
    ghosts_free(&other);
}

static void refused(const Ghosts *bad) {
    Ghosts ghosts = {0};
    Err err = {0};
    fill(&ghosts, 3);
    write_to_file(bad);
    assert_false(read_from_file(&ghosts, &err));
    assert_int_equal(err.code, ERR_INPUT);
    assert_non_null(strstr(err.message, "ghosts.skiff"));
    assert_int_equal(ghosts.count, COUNT); /* and nothing is changed */
    ghosts_free(&ghosts);
}

static void nonsense_is_refused(void **unused) {
    (void)unused;
    Ghosts bad = {0};
    fill(&bad, 1);
    bad.position[2][1] = NAN;
    refused(&bad);
    bad.position[2][1] = 0;
    bad.velocity[0][0] = INFINITY;
    refused(&bad);
    bad.velocity[0][0] = 0;
    bad.removed[3] = 0.2; /* before the one before it */
    refused(&bad);
    ghosts_free(&bad);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(old_ones_are_forgotten),
        cmocka_unit_test(a_file_brings_them_back),
        cmocka_unit_test(nonsense_is_refused),
    };
    return cmocka_run_group_tests_name("ghosts", tests, scratch_enter, scratch_leave);
}
