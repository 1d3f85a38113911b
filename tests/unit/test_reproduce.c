/* Tables beside a paper's figures, and the set-ups of [Carensac2023]: what is in them, that the engine takes
 * them. */
#include "app/carensac.h"
#include "app/carried.h"
#include "app/reproduce.h"
#include "app/series.h"
#include "app/svg.h"
#include "engine/base/file.h"
#include "engine/shape.h"

#include <jansson.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include <cmocka.h>

#include "scratch.h"

/* ---- Sheets ---- */

static const SheetColumn columns[] = {
    {"a", "first, ms", 1, 0}, {"b", "second, ms", 1, 0}, {"sum", "both, ms", 1, 3}, {"n", "count", 0, 0}};

static Sheet small_sheet(void) {
    Sheet sheet = sheet_make("small", "A <small> sheet", "[Nobody1900]", "case", columns, 4);
    static const double runs[5][4] = {
        {5, 10, NAN, 7}, {1, 50, NAN, NAN}, {4, 20, NAN, 9}, {2, 40, NAN, 8}, {3, 30, NAN, NAN}};
    assert_int_equal(sheet_add_row(&sheet, "one", NULL), 0);
    assert_int_equal(sheet_add_row(&sheet, "none", NULL), 1);
    for (int run = 0; run < 5; run++)
        assert_true(sheet_add_run(&sheet, 0, runs[run], NULL));
    sheet.rows[0].paper[2] = 31.25;
    return sheet;
}

static void columns_are_sorted_on_their_own(void **state) {
    (void)state;
    Sheet sheet = small_sheet();
    const SheetFigure a = sheet_figure(&sheet, 0, 0), b = sheet_figure(&sheet, 0, 1);
    assert_true(a.median == 3 && a.low == 2 && a.high == 4);
    assert_true(b.median == 30 && b.low == 20 && b.high == 40);
    const SheetFigure sum = sheet_figure(&sheet, 0, 2);
    assert_true(sum.median == 33 && isnan(sum.low) && isnan(sum.high));
    const SheetFigure n = sheet_figure(&sheet, 0, 3); /* of the three that there are */
    assert_true(n.median == 8 && n.low == 7 && n.high == 9);
    assert_true(isnan(sheet_figure(&sheet, 1, 0).median));
    assert_true(isnan(sheet_figure(&sheet, 1, 2).median));
    sheet_free(&sheet);
}

/* What `print` writes; the caller frees. */
static char *printed(void (*print)(FILE *out, const Sheet *sheet), const Sheet *sheet) {
    char *text = NULL;
    size_t size;
    FILE *stream = open_memstream(&text, &size);
    assert_non_null(stream);
    print(stream, sheet);
    assert_int_equal(fclose(stream), 0);
    char *copy = strdup(text); /* gcc 12 takes the stream's own buffer for a dangling one */
    assert_non_null(copy);
    free(text);
    return copy;
}

static void sheets_print_the_paper_below(void **state) {
    (void)state;
    Sheet sheet = small_sheet();
    char *text = printed(sheet_print, &sheet);
    assert_string_equal(text, "A <small> sheet ([Nobody1900])\n"
                              "\n"
                              "         first, ms  second, ms  both, ms  count\n"
                              "one            3.0        30.0      33.0      8\n"
                              "  paper          -           -      31.2      -\n"
                              "none             -           -         -      -\n");
    free(text);
    text = printed(sheet_write_html, &sheet);
    assert_non_null(strstr(text, "<h2>A &lt;small&gt; sheet</h2>"));
    assert_non_null(strstr(text, "<td>3.0<br><small>2.0 \u2013 4.0</small></td>"));
    assert_non_null(strstr(text, "<td>33.0</td>"));
    assert_non_null(strstr(text, "<td class=\"soft\">31.2</td>"));
    free(text);
    sheet_free(&sheet);
}

static void sheets_print_a_line_of_json_a_row(void **state) {
    (void)state;
    Sheet sheet = small_sheet();
    char *text = printed(sheet_print_json, &sheet), *second = strchr(text, '\n');
    assert_non_null(second);
    *second++ = '\0';
    json_t *line = json_loads(text, 0, NULL);
    assert_string_equal(json_string_value(json_object_get(line, "table")), "small");
    assert_string_equal(json_string_value(json_object_get(line, "case")), "one");
    assert_int_equal(json_integer_value(json_object_get(line, "runs")), 5);
    assert_float_equal(json_number_value(json_object_get(line, "b_high")), 40, 0);
    assert_float_equal(json_number_value(json_object_get(line, "sum_paper")), 31.25, 0);
    assert_null(json_object_get(line, "a_paper"));
    json_decref(line);
    line = json_loads(second, 0, NULL);
    assert_true(json_is_null(json_object_get(line, "a")));
    json_decref(line);
    free(text);
    sheet_free(&sheet);
}

static void sheets_are_written_as_csv(void **state) {
    (void)state;
    Sheet sheet = small_sheet();
    Err err = {0};
    char path[128], *text;
    size_t size;
    snprintf(path, sizeof path, "%s/small.csv", scratch_folder);
    assert_true(sheet_write_csv(&sheet, path, &err));
    assert_true(file_read(path, 1 << 20, &text, &size, &err));
    assert_string_equal(text, "case,column,runs,median,low,high,paper\n"
                              "one,a,5,3,2,4,\none,b,5,30,20,40,\none,sum,5,33,,,31.25\none,n,5,8,7,9,\n"
                              "none,a,0,,,,\nnone,b,0,,,,\nnone,sum,0,,,,\nnone,n,0,,,,\n");
    free(text);
    assert_false(sheet_write_csv(&sheet, "/nowhere/small.csv", &err));
    assert_int_equal(err.code, ERR_IO);
    sheet_free(&sheet);
}

/* Two curves over 0 to 4 that share no x; the first comes unsorted and with a hole. */
static void curves_share_an_axis(void **state) {
    (void)state;
    const double x0[] = {4, NAN, 0}, y0[] = {8, 5, 0}, x1[] = {1, 2}, y1[] = {3, 1};
    const SvgCurve curves[] = {{"line", x0, y0, 3}, {"short", x1, y1, 2}};
    const SvgChart labels = {.title = "T", .x_label = "x", .y_label = "y"};
    char *text = NULL;
    size_t size;
    FILE *stream = open_memstream(&text, &size);
    svg_curves(stream, &labels, curves, 2);
    assert_int_equal(fclose(stream), 0);
    /* line: points at x = 0, 1, 2, 4, of which two are between its own; short: two points */
    const char *path = strstr(text, "stroke-linejoin=\"round\" d=\"M");
    assert_non_null(path);
    double x[4], y[4];
    assert_int_equal(sscanf(strstr(path, "d=\"") + 3, "M%lf %lfL%lf %lfL%lf %lfL%lf %lf", x, y, x + 1, y + 1,
                            x + 2, y + 2, x + 3, y + 3),
                     8);
    assert_float_equal(x[1] - x[0], 0.25 * (x[3] - x[0]), 0.11);
    assert_float_equal(y[2] - y[0], 0.5 * (y[3] - y[0]), 0.11);
    path = strstr(path + 1, "stroke-linejoin=\"round\" d=\"M");
    assert_non_null(path);
    path = strchr(path, 'L');
    assert_non_null(path);
    assert_true(strcspn(path + 1, "L") > strcspn(path, "\"") - 1); /* no third point */
    free(text);
}

/* ---- The paper ---- */

static void table1_is_the_paper_s(void **state) {
    (void)state;
    Sheet sheet;
    assert_true(carensac_sheet(CARENSAC_TABLE1, &sheet, NULL));
    assert_int_equal(sheet.row_count, CARENSAC_METHOD_COUNT * CARENSAC_FILL_COUNT);
    double sums[CARENSAC_FILL_COUNT];
    for (int r = 0; r < CARENSAC_FILL_COUNT; r++) {
        const double *paper = sheet.rows[r].paper;
        sums[r] = paper[CARENSAC_LOADING] + paper[CARENSAC_SELECTION] + paper[CARENSAC_STABILIZATION];
        /* its totals are the sums of the rounded medians, or a digit beside them */
        assert_float_equal(paper[CARENSAC_TOTAL], sums[r], 1.65);
        assert_true(paper[CARENSAC_NEAR] < paper[CARENSAC_NEAR_BEFORE]);
    }
    for (int r = CARENSAC_FILL_COUNT; r < sheet.row_count; r++)
        for (int c = 0; c < sheet.column_count; c++)
            assert_true(isnan(sheet.rows[r].paper[c]));
    assert_string_equal(sheet.rows[CARENSAC_PYRAMID].name, "pyramid");
    assert_string_equal(sheet.rows[CARENSAC_FILL_COUNT + CARENSAC_PYRAMID].name, "pyramid, defaults");
    assert_float_equal(sheet.rows[CARENSAC_FLUID_FLUID].paper[CARENSAC_SPREAD], 3.4, 0);
    sheet_free(&sheet);
}

static void fig2_has_every_variant(void **state) {
    (void)state;
    Sheet sheet;
    assert_true(carensac_sheet(CARENSAC_FIG2, &sheet, NULL));
    assert_int_equal(sheet.row_count, 12 + 11 + 11);
    assert_string_equal(sheet.rows[0].name, "base 5");
    assert_float_equal(sheet.rows[0].paper[CARENSAC_TOTAL], 380, 0);
    assert_string_equal(sheet.rows[12].name, "regulator 0.25");
    assert_string_equal(sheet.rows[33].name, "regulator+protection 10");
    int given = 0;
    for (int r = 0; r < sheet.row_count; r++)
        given += !isnan(sheet.rows[r].paper[CARENSAC_TOTAL]);
    assert_int_equal(given, 5);
    sheet_free(&sheet);
    for (int s = 0; s < CARENSAC_SHEET_COUNT; s++) {
        assert_true(carensac_sheet((CarensacSheet)s, &sheet, NULL));
        assert_true(sheet.row_count > 0 && strlen(sheet.name) > 0);
        sheet_free(&sheet);
    }
}

static double shape_volume(const SkiffGeometryDef *def, float min[3], float max[3]) {
    Err err = {0};
    Shape shape;
    if (!shape_make(def, "it", (double[3]){0}, &shape, &err))
        fail_msg("%s", err.message);
    memcpy(min, shape.min, sizeof shape.min);
    memcpy(max, shape.max, sizeof shape.max);
    const double volume = shape.volume;
    shape_free(&shape);
    return volume;
}

static void set_ups_have_the_paper_s_sizes(void **state) {
    (void)state;
    static const struct {
        double tank, top, water; /* m^3; m */
        int bodies;
    } expected[] = {
        {6 * 6 * 6, 6, 3, 0}, {5 * 6 * 5, 6, 2.5, 0}, {43.0 / 3.0, 7, 3.5, 0}, {3.5 * 5 * 3.5, 5, 3, 1}};
    for (int row = 0; row < 4; row++) {
        CarensacSetup setup;
        Err err = {0};
        float min[3], max[3];
        assert_true(carensac_set_up(row, CARENSAC_RADIUS, scratch_folder, &setup, &err));
        assert_float_equal(shape_volume(&setup.def.tank.geometry, min, max), expected[row].tank, 1e-3);
        assert_float_equal(min[1], 0, 1e-6);
        assert_float_equal(max[1], expected[row].top, 1e-5);
        const SkiffBlockDef *fill = &setup.def.blocks[setup.def.block_count - 1];
        assert_float_equal(fill->end[1], expected[row].water, 1e-6);
        assert_int_equal(setup.def.body_count, expected[row].bodies);
        assert_int_equal(setup.removes, row == CARENSAC_FLUID_FLUID);
        assert_true((row == CARENSAC_PYRAMID) == (*setup.mesh != '\0'));
    }
}

static void the_cube_floats_half_immersed_on_an_edge(void **state) {
    (void)state;
    CarensacSetup setup;
    float min[3], max[3];
    assert_true(carensac_set_up(CARENSAC_FLOATING_CUBE, CARENSAC_RADIUS, scratch_folder, &setup, NULL));
    assert_float_equal(shape_volume(&setup.body.geometry, min, max), 8, 1e-4);
    assert_float_equal(min[1], 3 - sqrt(2), 1e-4);
    assert_float_equal(max[1], 3 + sqrt(2), 1e-4);
    assert_float_equal(max[0], 1, 1e-5);
}

/* From 0.586 m above the water through the floor, wider than the corridor: [Carensac2023] 5.6 as its authors'
 * code has it. */
static void the_wedge_parts_the_corridor(void **state) {
    (void)state;
    Err err = {0};
    float min[3], max[3];
    Scene *scene = scene_load(SKIFF_SOURCE_DIR "/assets/scenes/wedge.json", NULL, 0, &err);
    if (!scene)
        fail_msg("%s", err.message);
    const SkiffBodyDef *wedge = &scene->def.bodies[0];
    assert_float_equal(shape_volume(&wedge->geometry, min, max), 7.05, 0.02);
    assert_float_equal(min[1], 1.586, 1e-3);
    assert_float_equal(max[1], 5.414, 1e-3);
    assert_float_equal(max[2], 0.566, 1e-3);
    assert_float_equal(max[0], 1, 1e-3);
    assert_true(wedge->density == 800 && wedge->stop_time == 0.72);
    assert_float_equal(shape_volume(&scene->def.tank.geometry, min, max), 50, 1e-3);
    assert_true(scene->def.sea.has_region && scene->def.sea.region_min[2] == 4.5f);
    /* half a metre of the end absorbs, with particles of any size */
    char edits[REPRODUCE_LAYER_EDITS][REPRODUCE_EDIT_SIZE];
    reproduce_keep_layer(scene, 0.05, edits);
    assert_string_equal(edits[0], "outflowDistance=10");
    assert_string_equal(edits[1], "inflowLayer=10");
    scene_free(scene);
}

/* What the program carries is what the files say. */
static void carried_scenes_are_the_files(void **state) {
    (void)state;
    static const char *const names[] = {"wedge.json", "boat-cylinder-5m.json", "boat-cylinder-2.5m.json"};
    for (size_t k = 0; k < sizeof names / sizeof *names; k++) {
        Err err = {0};
        char path[4096];
        snprintf(path, sizeof path, SKIFF_SOURCE_DIR "/assets/scenes/%s", names[k]);
        Scene *carried = carried_scene(names[k], NULL, 0, &err), *file = scene_load(path, NULL, 0, &err);
        if (!carried || !file)
            fail_msg("%s", err.message);
        assert_int_equal(carried->def.body_count, file->def.body_count);
        assert_memory_equal(&carried->def.params, &file->def.params, sizeof file->def.params);
        assert_string_equal(carried->title, file->title);
        scene_free(carried);
        /* with all the meshes that it names */
        static const char *const coarse[] = {"particleRadius=0.1", "timeStepSize=0.012"};
        carried = carried_scene(names[k], coarse, 2, &err);
        SkiffSim *sim = carried ? carried_start(carried, scratch_folder, 1, SKIFF_SIMD_AUTO, &err) : NULL;
        if (!sim)
            fail_msg("%s", err.message);
        assert_true(skiff_particles(sim).count > 1000);
        skiff_destroy(sim);
        scene_free(carried);
        scene_free(file);
    }
}

static void a_series_grows_and_is_written(void **state) {
    (void)state;
    Series series;
    CsvTable table;
    Err err = {0};
    char path[4200];
    assert_true(series_make(&series, "t,a_ms", &err));
    for (int k = 0; k < 3000; k++) {
        double *row = series_add(&series, &err);
        assert_non_null(row);
        assert_true(isnan(row[1]));
        row[0] = k;
        if (k % 2)
            row[1] = 0.5 * k;
    }
    snprintf(path, sizeof path, "%s/series.csv", scratch_folder);
    assert_true(series_write(&series, path, &err));
    assert_true(csv_read(path, &table, &err));
    assert_int_equal(table.row_count, 3000);
    assert_int_equal(csv_column(&table, "a_ms"), 1);
    assert_true(table.values[2 * 2999 + 1] == 1499.5 && isnan(table.values[2 * 2998 + 1]));
    csv_free(&table);
    series_free(&series);
    unlink(path);
}

static void offsets_cover_a_diameter_on_both_sides(void **state) {
    (void)state;
    double low[3] = {1, 1, 1}, high[3] = {-1, -1, -1}, offset[3], again[3];
    for (int run = 0; run < 51; run++) {
        carensac_offset(run, 0.025, offset);
        for (int k = 0; k < 3; k++) {
            assert_true(fabs(offset[k]) <= 0.05);
            low[k] = fmin(low[k], offset[k]);
            high[k] = fmax(high[k], offset[k]);
        }
    }
    for (int k = 0; k < 3; k++)
        assert_true(low[k] < -0.04 && high[k] > 0.04);
    carensac_offset(50, 0.025, again);
    assert_memory_equal(again, offset, sizeof again);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(columns_are_sorted_on_their_own),
        cmocka_unit_test(sheets_print_the_paper_below),
        cmocka_unit_test(sheets_print_a_line_of_json_a_row),
        cmocka_unit_test(sheets_are_written_as_csv),
        cmocka_unit_test(curves_share_an_axis),
        cmocka_unit_test(table1_is_the_paper_s),
        cmocka_unit_test(fig2_has_every_variant),
        cmocka_unit_test(set_ups_have_the_paper_s_sizes),
        cmocka_unit_test(the_cube_floats_half_immersed_on_an_edge),
        cmocka_unit_test(the_wedge_parts_the_corridor),
        cmocka_unit_test(carried_scenes_are_the_files),
        cmocka_unit_test(a_series_grows_and_is_written),
        cmocka_unit_test(offsets_cover_a_diameter_on_both_sides),
    };
    return cmocka_run_group_tests_name("reproduce", tests, scratch_enter, scratch_leave);
}
