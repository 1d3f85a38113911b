/* Sorting by cells, and the points around one, against all pairs. */
#include "engine/base/random.h"
#include "engine/cell_grid.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdbool.h>
#include <string.h>
#include <cmocka.h>

enum { COUNT = 500, SIDE = 7, CELLS = SIDE * SIDE * (SIDE + 1) };

/* Edge 0.5 m. */
static const CellGrid box = {.origin = {-1.0f, 2.0f, 0.5f}, .inv_size = 2.0f, .size = {SIDE, SIDE + 1, SIDE}};

/* Some in the grid's outermost layer, some beside the grid. */
static void make_points(float points[COUNT][3]) {
    for (uint32_t i = 0; i < COUNT; i++)
        for (uint32_t k = 0; k < 3; k++)
            points[i][k] = box.origin[k] - 0.2f + 4.0f * (float)random_share(k, i);
}

static void test_stable(void **state) {
    (void)state;
    uint32_t cell[COUNT], start[8], order[COUNT], expected = 0, kept = 0;
    for (uint32_t i = 0; i < COUNT; i++) {
        cell[i] = (uint32_t)(8.0 * random_share(9, i)); /* 7: left out; 3: empty */
        cell[i] = cell[i] == 7 ? CELL_NONE : cell[i] == 3 ? 2 : cell[i];
        kept += cell[i] != CELL_NONE;
    }
    memset(order, 0xff, sizeof order);
    assert_int_equal(cell_grid_sort(cell, COUNT, 7, start, order), kept);
    for (uint32_t c = 0; c < 7; c++) {
        assert_int_equal(start[c], expected);
        for (uint32_t i = 0; i < COUNT; i++)
            if (cell[i] == c)
                assert_int_equal(order[expected++], i);
    }
    assert_int_equal(start[7], expected);
    assert_int_equal(start[3], start[4]);
    assert_int_equal(expected, kept);
    assert_int_equal(cell_grid_sort(NULL, 0, 7, start, NULL), 0);
    assert_int_equal(start[7], 0);
}

static void test_around(void **state) {
    (void)state;
    float points[COUNT][3];
    uint32_t cell[COUNT], start[CELLS + 1], order[COUNT], inner = 0;
    int32_t c[COUNT][3];
    CellGrid grid = box;
    make_points(points);
    assert_int_equal(cell_grid_count(&grid), CELLS);
    for (uint32_t i = 0; i < COUNT; i++) {
        bool inside = true;
        for (int k = 0; k < 3; k++) {
            const float at = (points[i][k] - grid.origin[k]) * grid.inv_size;
            inside = inside && at >= 0.0f && at < (float)grid.size[k];
            c[i][k] = at < 0.0f ? -1 : (int32_t)at;
        }
        cell[i] = inside ? (uint32_t)cell_grid_index(&grid, c[i][0], c[i][1], c[i][2]) : CELL_NONE;
    }
    cell_grid_sort(cell, COUNT, CELLS, start, order);
    grid.start = start;
    for (uint32_t i = 0; i < COUNT; i++) {
        bool is_inner = true;
        for (int k = 0; k < 3; k++)
            is_inner = is_inner && c[i][k] >= 1 && c[i][k] < grid.size[k] - 1;
        const int32_t middle = cell_grid_inner(&grid, points[i]);
        assert_int_equal(middle, is_inner ? (int32_t)cell[i] : -1);
        if (!is_inner)
            continue;
        uint8_t seen[COUNT] = {0};
        for (int run = 0; run < CELL_RUNS; run++) {
            const CellRun near = cell_grid_run(&grid, middle, run);
            for (uint32_t n = near.begin; n < near.end; n++)
                seen[order[n]]++;
        }
        for (uint32_t j = 0; j < COUNT; j++) {
            bool beside = cell[j] != CELL_NONE;
            for (int k = 0; k < 3; k++)
                beside = beside && c[j][k] - c[i][k] >= -1 && c[j][k] - c[i][k] <= 1;
            assert_int_equal(seen[j], beside);
        }
        inner++;
    }
    assert_true(inner > 100 && inner < COUNT);
    assert_int_equal(cell_grid_inner(&grid, (const float[3]){0.0f, __builtin_nanf(""), 1.0f}), -1);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_stable),
        cmocka_unit_test(test_around),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
