/* skiff reproduce: runs the experiments of a paper and sets our figures beside the paper's.
 *
 * A row of table1 or fig2 is filled again and again in one simulation, each time with the points of the rest
 * tile shifted by another offset; between two runs the water is taken out. Times are the engine's own,
 * without making walls, tile and existing water, as in the paper. After the last run of a row of table1 the
 * water is left to itself for a while: what a fill is for. */
#include "carensac.h"
#include "carried.h"
#include "commands.h"
#include "csv.h"
#include "html.h"
#include "reproduce.h"
#include "svg.h"

#include "engine/base/angle.h"
#include "engine/base/file.h"

#include <assert.h>
#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { SETTLING_STEPS = 33, FREE_STEPS = 100 }; /* of the water that is there before a fill; after it */

static const double float_seconds = 3.0;

typedef struct Reproduction {
    const CliArgs *args;
    Sheet sheets[CARENSAC_SHEET_COUNT]; /* those not wanted have no rows */
    struct {                            /* of fig4c: t (s), height (r), roll, pitch (deg) */
        double *values[4];
        size_t count;
    } series[CARENSAC_METHOD_COUNT];
    Series wedge, boats[REPRODUCE_BOAT_WINDOWS]; /* of fig5, of boat */
    char folder[4096];                           /* where set-ups write their meshes */
    Machine machine;
} Reproduction;

static bool wants(const Reproduction *run, CarensacSheet sheet) {
    return run->sheets[sheet].row_count > 0;
}

static void tell(const Reproduction *run, const char *what, const char *row, int done, int count) {
    if (!run->args->quiet)
        fprintf(stderr, "%s, %s: %d of %d\n", what, row, done, count);
}

double reproduce_radius(const CliArgs *args) {
    return isnan(args->radius) ? CARENSAC_RADIUS : args->radius;
}

Scene *reproduce_scene(const ReproduceJob *job, const char *name, double duration, const char *const *edits,
                       int edit_count, Err *err) {
    enum { OWN = 3, MAX = 8 };
    const double radius = reproduce_radius(job->args);
    char texts[OWN][64];
    const char *all[MAX] = {texts[0], texts[1], texts[2]};
    assert(OWN + edit_count <= MAX);
    snprintf(texts[0], sizeof texts[0], "particleRadius=%.9g", radius);
    snprintf(texts[1], sizeof texts[1], "timeStepSize=%.9g", carensac_time_step(radius));
    snprintf(texts[2], sizeof texts[2], "duration=%.9g",
             isnan(job->args->duration) ? duration : job->args->duration);
    for (int k = 0; k < edit_count; k++)
        all[OWN + k] = edits[k];
    return carried_scene(name, all, OWN + edit_count, err);
}

void reproduce_keep_layer(const Scene *shipped, double radius,
                          char edits[REPRODUCE_LAYER_EDITS][REPRODUCE_EDIT_SIZE]) {
    const SkiffParams *params = &shipped->def.params;
    const float outflow = params->outflow_distance * params->particle_radius;
    const float inflow = params->inflow_layer * params->particle_radius;
    snprintf(edits[0], REPRODUCE_EDIT_SIZE, "outflowDistance=%.9g", (double)outflow / radius);
    snprintf(edits[1], REPRODUCE_EDIT_SIZE, "inflowLayer=%.9g", (double)inflow / radius);
}

void reproduce_tell(const ReproduceJob *job, const char *row, const SkiffSim *sim, double end) {
    const double time = skiff_time(sim), before = time - (double)skiff_params(sim)->time_step;
    if (!job->args->quiet && floor(20 * time / end) > floor(20 * before / end))
        fprintf(stderr, "%s, %s: %.2f of %g s\n", job->sheet->name, row, time, end);
}

/* ---- Filling ---- */

static void set_variant(SkiffParams *params, const CarensacVariant *variant) {
    params->rest_rule = (int)variant->rule; /* the same names in the same order */
    if (variant->rule == CARENSAC_BASE)
        params->rest_step = (float)variant->parameter / params->rest_density;
    else
        params->rest_ratio = (float)variant->parameter;
}

/* The simulation with everything but the water to fill in. */
static SkiffSim *start(Reproduction *run, CarensacSetup *setup, Err *err) {
    setup->def.threads = run->args->threads;
    setup->def.simd = (SkiffSimd)run->args->simd;
    setup->def.block_count--;
    setup->blocks[0].fill = SKIFF_FILL_REST;
    SkiffSim *sim = skiff_create(&setup->def, err);
    if (sim && !*run->machine.cpu)
        run->machine = machine_describe(sim);
    bool good = sim != NULL;
    for (int step = 0; good && setup->def.block_count > 0 && step < SETTLING_STEPS; step++)
        good = skiff_step(sim, err);
    if (good)
        return sim;
    skiff_destroy(sim);
    return NULL;
}

/* One fill, shifted by the run's offset, and its figures in the order of the columns. */
static bool measure_fill(SkiffSim *sim, const CarensacSetup *setup, int run, double *values, Err *err) {
    const SkiffParams *params = skiff_params(sim);
    SkiffBlockDef block = setup->blocks[setup->def.block_count];
    double offset[3];
    carensac_offset(run, (double)params->particle_radius, offset);
    for (int k = 0; k < 3; k++)
        block.offset[k] = (float)offset[k];
    if (!skiff_fill_block(sim, &block, err))
        return false;
    const SkiffFill *fill = skiff_fill(sim);
    const double target = (double)params->rest_target;
    values[CARENSAC_PARTICLES] = skiff_particles(sim).count;
    values[CARENSAC_NEAR] = fill->selected;
    values[CARENSAC_NEAR_BEFORE] = fill->candidates;
    values[CARENSAC_LOADING] = fill->load_ms;
    values[CARENSAC_SELECTION] = fill->select_ms;
    values[CARENSAC_STABILIZATION] = fill->settle_ms;
    values[CARENSAC_TOTAL] = NAN; /* of the medians */
    values[CARENSAC_SELECTION_PASSES] = fill->passes;
    values[CARENSAC_STABILIZATION_STEPS] = fill->steps;
    values[CARENSAC_DENSITY] = (double)params->rest_density * fill->density_mean;
    values[CARENSAC_DENSITY_ERROR] = 100 * fabs(fill->density_mean - target) / target;
    values[CARENSAC_SPREAD] = 100 * fill->density_rms / target;
    values[CARENSAC_FREE_MEAN] = values[CARENSAC_FREE_MAX] = NAN;
    return true;
}

static bool measure_free_steps(SkiffSim *sim, double *values, Err *err) {
    double mean = 0, largest = 0;
    for (int step = 0; step < FREE_STEPS; step++) {
        if (!skiff_step(sim, err))
            return false;
        mean = fmax(mean, skiff_stats(sim)->mean_speed);
        largest = fmax(largest, skiff_stats(sim)->max_speed);
    }
    values[CARENSAC_FREE_MEAN] = 100 * mean;
    values[CARENSAC_FREE_MAX] = 100 * largest;
    return true;
}

static bool remove_water(SkiffSim *sim, const CarensacSetup *setup, Err *err) {
    double min[3], max[3];
    uint32_t removed;
    for (int k = 0; k < 3; k++) {
        min[k] = setup->removes ? (double)setup->removed_min[k] : -INFINITY;
        max[k] = setup->removes ? (double)setup->removed_max[k] : INFINITY;
    }
    return skiff_remove_box(sim, min, max, &removed, err);
}

static bool measure_fills(const Reproduction *run, Sheet *sheet, int row, SkiffSim *sim,
                          const CarensacSetup *setup, Err *err) {
    bool good = true;
    for (int r = 0; good && r < run->args->runs; r++) {
        double values[CARENSAC_FILL_COLUMNS];
        const bool last = r + 1 == run->args->runs; /* bodies may have moved after it */
        good = remove_water(sim, setup, err) && measure_fill(sim, setup, r, values, err) &&
               (!last || sheet->column_count <= CARENSAC_FREE_MEAN || measure_free_steps(sim, values, err)) &&
               sheet_add_run(sheet, row, values, err);
        if (good)
            tell(run, sheet->name, sheet->rows[row].name, r + 1, run->args->runs);
    }
    return good;
}

/* What is filled in a row, and how. */
typedef struct Filling {
    int experiment;
    CarensacMethod method;
    const CarensacVariant *variant; /* NULL: the rules as they are */
} Filling;

static bool fill_row(Reproduction *run, Sheet *sheet, int row, const Filling *filling, Err *err) {
    CarensacSetup setup;
    if (!carensac_set_up(filling->experiment, reproduce_radius(run->args), run->folder, &setup, err))
        return false;
    if (filling->method == CARENSAC_PAPER)
        carensac_set_paper_method(&setup.def.params);
    if (filling->variant)
        set_variant(&setup.def.params, filling->variant);
    SkiffSim *sim = start(run, &setup, err);
    const bool good = sim && measure_fills(run, sheet, row, sim, &setup, err);
    skiff_destroy(sim);
    if (*setup.mesh)
        unlink(setup.mesh);
    return good;
}

static bool run_table1(Reproduction *run, Err *err) {
    Sheet *sheet = &run->sheets[CARENSAC_TABLE1];
    if (run->args->paper_only)
        sheet->row_count = CARENSAC_FILL_COUNT; /* the others come after them and hold nothing yet */
    bool good = true;
    for (int row = 0; good && row < sheet->row_count; row++) {
        const Filling filling = {row % CARENSAC_FILL_COUNT, (CarensacMethod)(row / CARENSAC_FILL_COUNT),
                                 NULL};
        good = fill_row(run, sheet, row, &filling, err);
    }
    return good;
}

static bool run_fig2(Reproduction *run, Err *err) {
    Sheet *sheet = &run->sheets[CARENSAC_FIG2];
    bool good = true;
    for (int row = 0; good && row < sheet->row_count; row++) {
        const CarensacVariant variant = carensac_variant(row);
        const Filling filling = {CARENSAC_FLOATING_CUBE, CARENSAC_PAPER, &variant};
        good = fill_row(run, sheet, row, &filling, err);
    }
    return good;
}

/* ---- Floating ---- */

static bool add_sample(Reproduction *run, int row, const SkiffSim *sim, double start_height, Err *err) {
    const SkiffBody body = skiff_body(sim, 0);
    const double *q = body.rotation, sine = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2]);
    /* The rotation vector; small angles about x and z are roll, about the submerged edge, and pitch. */
    const double factor = sine > 0 ? 2 * atan2(sine, q[3]) / sine * 180 / pi : 0;
    const double values[4] = {skiff_time(sim),
                              (body.position[1] - start_height) / (double)skiff_params(sim)->particle_radius,
                              factor * q[0], factor * q[2]};
    const size_t count = run->series[row].count;
    for (int k = 0; k < 4; k++) {
        double *series = realloc(run->series[row].values[k], (count + 1) * sizeof *series);
        if (!series)
            return err_set(err, ERR_IO, "out of memory");
        run->series[row].values[k] = series;
        series[count] = values[k];
    }
    run->series[row].count++;
    return true;
}

static bool sum_up_floating(Reproduction *run, int row, Err *err) {
    double values[CARENSAC_FLOAT_COLUMNS] = {0}, end_count = 0, *const *series = run->series[row].values;
    for (size_t i = 0; i < run->series[row].count; i++) {
        const double height = series[1][i];
        values[CARENSAC_HEIGHT_MAX] = fmax(values[CARENSAC_HEIGHT_MAX], fabs(height));
        values[CARENSAC_ROLL_MAX] = fmax(values[CARENSAC_ROLL_MAX], fabs(series[2][i]));
        values[CARENSAC_PITCH_MAX] = fmax(values[CARENSAC_PITCH_MAX], fabs(series[3][i]));
        if (series[0][i] > float_seconds - 1.0) {
            values[CARENSAC_HEIGHT_END] += height;
            end_count++;
        }
    }
    values[CARENSAC_HEIGHT_END] = end_count > 0 ? fabs(values[CARENSAC_HEIGHT_END]) / end_count : (double)NAN;
    return sheet_add_run(&run->sheets[CARENSAC_FIG4C], row, values, err);
}

static bool float_row(Reproduction *run, int row, Err *err) {
    CarensacSetup setup;
    if (!carensac_set_up(CARENSAC_FLOATING_CUBE, reproduce_radius(run->args), run->folder, &setup, err))
        return false;
    if (row == CARENSAC_PAPER)
        carensac_set_paper_method(&setup.def.params);
    double values[CARENSAC_FILL_COLUMNS];
    SkiffSim *sim = start(run, &setup, err);
    bool good = sim && measure_fill(sim, &setup, 0, values, err);
    const double height = sim ? skiff_body(sim, 0).position[1] : 0;
    good = good && add_sample(run, row, sim, height, err);
    while (good && skiff_time(sim) < float_seconds) {
        good = skiff_step(sim, err) && add_sample(run, row, sim, height, err);
        if (good && skiff_step_count(sim) % 100 == 0)
            tell(run, "fig4c", run->sheets[CARENSAC_FIG4C].rows[row].name, (int)skiff_step_count(sim),
                 (int)(float_seconds / (double)skiff_params(sim)->time_step + 0.5));
    }
    skiff_destroy(sim);
    return good && sum_up_floating(run, row, err);
}

static bool run_fig4c(Reproduction *run, Err *err) {
    return float_row(run, CARENSAC_PAPER, err) && float_row(run, CARENSAC_DEFAULTS, err);
}

/* ---- Over time ---- */

static ReproduceJob job_of(Reproduction *run, CarensacSheet sheet) {
    return (ReproduceJob){run->args, &run->sheets[sheet], run->folder, &run->machine};
}

static bool run_fig5(Reproduction *run, Err *err) {
    const ReproduceJob job = job_of(run, CARENSAC_FIG5);
    return reproduce_wedge(&job, &run->wedge, err);
}

static bool run_boat(Reproduction *run, Err *err) {
    const ReproduceJob job = job_of(run, CARENSAC_BOAT);
    return reproduce_boat(&job, run->boats, err);
}

/* ---- Results ---- */

/* Medians of two columns over the rows of one rule. */
typedef struct RuleCurve {
    double x[32], y[32];
} RuleCurve;

static void write_fig2_chart(FILE *out, const Sheet *sheet, const char *title, const char *x_label,
                             const char *y_label, int x_column, int y_column) {
    /* the base rule, which some charts lack, comes last: a rule has the same colour in all of them */
    static const char *const names[] = {"regulator", "regulator+protection", "base"};
    RuleCurve data[3];
    SvgCurve curves[3];
    for (int c = 0; c < 3; c++)
        curves[c] = (SvgCurve){names[c], data[c].x, data[c].y, 0};
    for (int row = 0; row < sheet->row_count; row++) {
        const CarensacVariant variant = carensac_variant(row);
        if (x_column < 0 && variant.rule == CARENSAC_BASE)
            continue; /* has no R */
        const int curve = ((int)variant.rule + 2) % 3;
        const size_t at = curves[curve].count++;
        data[curve].x[at] = x_column < 0 ? variant.parameter : sheet_figure(sheet, row, x_column).median;
        data[curve].y[at] = sheet_figure(sheet, row, y_column).median;
    }
    const SvgChart labels = {.title = title, .x_label = x_label, .y_label = y_label};
    svg_curves(out, &labels, curves, x_column < 0 ? 2 : 3);
}

static void write_fig2_charts(FILE *out, const Sheet *sheet) {
    fputs("<div class=\"charts\">\n", out);
    write_fig2_chart(out, sheet, "Time and density reached (fig. 2a)", "mean density, kg/m3",
                     "total time, ms", CARENSAC_DENSITY, CARENSAC_TOTAL);
    write_fig2_chart(out, sheet, "Density reached (fig. 2b)", "R", "mean density, kg/m3", -1,
                     CARENSAC_DENSITY);
    write_fig2_chart(out, sheet, "Spread of densities (fig. 2b)", "R", "about the target, %", -1,
                     CARENSAC_SPREAD);
    fputs("</div>\n", out);
}

static void write_fig4c_charts(FILE *out, const Reproduction *run) {
    static const struct {
        const char *title, *y_label;
    } charts[3] = {{"Height of the cube (fig. 4c)", "change, r"},
                   {"Roll of the cube (fig. 4c)", "angle, degrees"},
                   {"Pitch of the cube (fig. 4c)", "angle, degrees"}};
    fputs("<div class=\"charts\">\n", out);
    for (int k = 0; k < 3; k++) {
        const SvgChart labels = {
            .title = charts[k].title, .x_label = "time, s", .y_label = charts[k].y_label};
        SvgCurve curves[CARENSAC_METHOD_COUNT];
        for (int m = 0; m < CARENSAC_METHOD_COUNT; m++)
            curves[m] =
                (SvgCurve){m == CARENSAC_PAPER ? "the paper's method" : "defaults", run->series[m].values[0],
                           run->series[m].values[1 + k], run->series[m].count};
        svg_curves(out, &labels, curves, CARENSAC_METHOD_COUNT);
    }
    fputs("</div>\n", out);
}

/* Whose method the fills' rows follow. */
static void write_method(FILE *out, const Reproduction *run) {
    const bool has_table = wants(run, CARENSAC_TABLE1);
    if (!has_table && !wants(run, CARENSAC_FIG2))
        return;
    fputs(
        "<p>In fills, rows with the paper's name follow its method: only particles near solids and existing "
        "water settle, for at most ten steps, and nothing is calmed afterwards either.",
        out);
    if (has_table && !run->args->paper_only)
        fputs(" Rows named <i>defaults</i> are what the program does by itself.", out);
    fputs("</p>\n", out);
}

static bool write_page(const Reproduction *run, Err *err) {
    char path[4200];
    FileWriter writer;
    snprintf(path, sizeof path, "%s/report.html", run->args->output);
    if (!file_begin(&writer, path, err))
        return false;
    FILE *out = writer.stream;
    html_begin(out, "Carensac et al. 2023, reproduced");
    fputs("<h1>Carensac et al. 2023, reproduced</h1>\n<p class=\"soft\">", out);
    svg_text(out, run->machine.cpu);
    fprintf(out,
            ", %d of %d cores, %s, commit <code>%s</code>; the paper's times are of a GPU, an RTX 2070 SUPER"
            "</p>\n",
            run->machine.threads, run->machine.cores, run->machine.isa, run->machine.commit);
    if (reproduce_radius(run->args) != CARENSAC_RADIUS)
        fprintf(out,
                "<p>Particles of radius %g m where the paper has %g m: a quick look, not a comparison.</p>\n",
                reproduce_radius(run->args), CARENSAC_RADIUS);
    write_method(out, run);
    for (int s = 0; s < CARENSAC_SHEET_COUNT; s++) {
        if (!wants(run, (CarensacSheet)s))
            continue;
        sheet_write_html(out, &run->sheets[s]);
        if (s == CARENSAC_FIG2)
            write_fig2_charts(out, &run->sheets[s]);
        if (s == CARENSAC_FIG4C)
            write_fig4c_charts(out, run);
        if (s == CARENSAC_FIG5)
            reproduce_wedge_charts(out, &run->wedge);
        if (s == CARENSAC_BOAT)
            reproduce_boat_charts(out, &run->sheets[s], run->boats);
    }
    html_end(out);
    return file_commit(&writer, err);
}

static bool write_one_series(const Reproduction *run, const Series *series, const char *name, Err *err) {
    char path[4200];
    snprintf(path, sizeof path, "%s/%s-series.csv", run->args->output, name);
    return series_write(series, path, err);
}

static bool write_fig4c_series(const Reproduction *run, Err *err) {
    CsvWriter csv;
    char path[4200];
    snprintf(path, sizeof path, "%s/fig4c-series.csv", run->args->output);
    if (!csv_create(&csv, path, "defaults,t,height_r,roll_deg,pitch_deg", err))
        return false;
    for (int m = 0; m < CARENSAC_METHOD_COUNT; m++)
        for (size_t i = 0; i < run->series[m].count; i++) {
            csv_put(&csv, m == CARENSAC_DEFAULTS, 1);
            for (int k = 0; k < 4; k++)
                csv_put(&csv, run->series[m].values[k][i], 6);
            csv_end_row(&csv);
        }
    return csv_close(&csv, err);
}

static bool write_files(const Reproduction *run, Err *err) {
    char path[4200];
    for (int s = 0; s < CARENSAC_SHEET_COUNT; s++) {
        snprintf(path, sizeof path, "%s/%s.csv", run->args->output, run->sheets[s].name);
        if (wants(run, (CarensacSheet)s) && !sheet_write_csv(&run->sheets[s], path, err))
            return false;
    }
    return (!wants(run, CARENSAC_FIG4C) || write_fig4c_series(run, err)) &&
           (!wants(run, CARENSAC_FIG5) || write_one_series(run, &run->wedge, "fig5", err)) &&
           (!wants(run, CARENSAC_BOAT) || (write_one_series(run, &run->boats[0], "boat-5m", err) &&
                                           write_one_series(run, &run->boats[1], "boat-2.5m", err))) &&
           write_page(run, err);
}

static void print_sheets(const Reproduction *run) {
    bool first = true;
    for (int s = 0; s < CARENSAC_SHEET_COUNT; s++) {
        if (!wants(run, (CarensacSheet)s))
            continue;
        if (run->args->json) {
            sheet_print_json(stdout, &run->sheets[s]);
        } else {
            printf("%s", first ? "" : "\n");
            sheet_print(stdout, &run->sheets[s]);
        }
        first = false;
    }
}

/* ---- Command ---- */

static const struct {
    const char *name;
    CarensacSheet sheet;
    bool (*run)(Reproduction *run, Err *err);
} experiments[] = {
    {"table1", CARENSAC_TABLE1, run_table1}, {"fig2", CARENSAC_FIG2, run_fig2},
    {"fig4c", CARENSAC_FIG4C, run_fig4c},    {"fig5", CARENSAC_FIG5, run_fig5},
    {"boat", CARENSAC_BOAT, run_boat},
};
enum { EXPERIMENT_COUNT = sizeof experiments / sizeof *experiments };

/* The sheets of what the user asked for. */
static bool choose(Reproduction *run, Err *err) {
    const char *wanted = run->args->operand ? run->args->operand : "all";
    const bool all = strcmp(wanted, "all") == 0;
    bool known = all;
    for (int e = 0; e < EXPERIMENT_COUNT; e++) {
        if (!all && strcmp(wanted, experiments[e].name) != 0)
            continue;
        known = true;
        if (!carensac_sheet(experiments[e].sheet, &run->sheets[experiments[e].sheet], err))
            return false;
    }
    if (known)
        return true;
    char names[128] = "";
    for (int e = 0; e < EXPERIMENT_COUNT; e++)
        snprintf(names + strlen(names), sizeof names - strlen(names), "%s%s", e > 0 ? ", " : "",
                 experiments[e].name);
    return err_set(err, ERR_USAGE, "expected %s or all, found \"%.80s\"", names, wanted);
}

/* The results' folder, or without one a temporary folder for the set-ups' meshes. */
static bool prepare_folder(Reproduction *run, Err *err) {
    if (run->args->output) {
        snprintf(run->folder, sizeof run->folder, "%s", run->args->output);
        return cli_check_folder(run->args, run->folder, err) && file_make_directory(run->folder, err);
    }
    const char *temporary = getenv("TMPDIR");
    snprintf(run->folder, sizeof run->folder, "%.4000s/skiff-XXXXXX", temporary ? temporary : "/tmp");
    return mkdtemp(run->folder) ||
           err_set(err, ERR_IO, "%s: cannot make directory: %s", run->folder, strerror(errno));
}

bool reproduce_carensac_command(const CliArgs *args, Err *err) {
    Reproduction run = {.args = args};
    bool good = choose(&run, err) && prepare_folder(&run, err);
    const bool has_folder = good;
    for (int e = 0; good && e < EXPERIMENT_COUNT; e++)
        if (wants(&run, experiments[e].sheet))
            good = experiments[e].run(&run, err);
    if (good)
        print_sheets(&run);
    good = good && (!args->output || write_files(&run, err));
    if (has_folder && !args->output)
        rmdir(run.folder);
    for (int s = 0; s < CARENSAC_SHEET_COUNT; s++)
        sheet_free(&run.sheets[s]);
    for (int m = 0; m < CARENSAC_METHOD_COUNT; m++)
        for (int k = 0; k < 4; k++)
            free(run.series[m].values[k]);
    series_free(&run.wedge);
    for (int w = 0; w < REPRODUCE_BOAT_WINDOWS; w++)
        series_free(&run.boats[w]);
    return good;
}
