/* boat [Carensac2023 sec. 5.7]: the boat under 5000 N in the window of 5 m, then in that of 2.5 m. The scenes
 * are assets/scenes/boat-cylinder-*.json; full ahead on the heading of the start from 5 s on. Times and
 * speeds are of the cruise: the second half of what follows. */
#include "carensac.h"
#include "carried.h"
#include "profile.h"
#include "reproduce.h"
#include "svg.h"

#include "engine/base/angle.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const char *const scenes[REPRODUCE_BOAT_WINDOWS] = {"boat-cylinder-5m.json",
                                                           "boat-cylinder-2.5m.json"};

static const double standard_duration = 25;
static const double start_time = 5; /* s, of the thrust */

/* Columns between those of the profile and those of the phases. */
enum { SPEED = PROFILE_COLUMN_COUNT, BOW_UP, FIRST_PHASE };

static bool make_series(Series *series, Err *err) {
    char text[4096];
    size_t length = 0;
    for (int c = 0; c < PROFILE_COLUMN_COUNT; c++)
        length += (size_t)snprintf(text + length, sizeof text - length, "%s,", profile_columns[c]);
    length += (size_t)snprintf(text + length, sizeof text - length, "speed,bow_up_deg");
    for (int p = 0; p < SKIFF_PHASE_COUNT; p++)
        length += (size_t)snprintf(text + length, sizeof text - length, ",%s_ms", skiff_phase_key(p));
    return series_make(series, text, err);
}

double reproduce_bow_up(const SkiffBody *boat) {
    const double *q = boat->rotation;
    const double rise = -2 * (q[0] * q[1] + q[2] * q[3]); /* y of the turned -x axis */
    return asin(fmax(-1, fmin(1, rise))) * 180 / pi;
}

static bool add_row(Series *series, const SkiffSim *sim, Err *err) {
    double *row = series_add(series, err);
    if (!row)
        return false;
    const SkiffStats *stats = skiff_stats(sim);
    const SkiffBody boat = skiff_body(sim, 0);
    row[PROFILE_STEP] = (double)stats->step;
    row[PROFILE_TIME] = stats->time;
    row[PROFILE_DT] = stats->dt;
    row[PROFILE_PARTICLES] = stats->particles;
    row[PROFILE_DENSITY_ITERATIONS] = stats->density_iterations;
    row[PROFILE_DIVERGENCE_ITERATIONS] = stats->divergence_iterations;
    row[PROFILE_MOVED] = stats->moved;
    row[PROFILE_STEP_MS] = stats->step_ms;
    row[SPEED] = sqrt(boat.velocity[0] * boat.velocity[0] + boat.velocity[2] * boat.velocity[2]);
    row[BOW_UP] = reproduce_bow_up(&boat);
    for (int p = 0; p < SKIFF_PHASE_COUNT; p++)
        row[FIRST_PHASE + p] = stats->phase_ms[p];
    return true;
}

static bool sail(const ReproduceJob *job, int window, SkiffSim *sim, double end, Series *series, Err *err) {
    const SkiffControls ahead = {.throttle = 1, .hold = true};
    bool good = make_series(series, err), under_way = false;
    while (good && skiff_time(sim) + 0.5 * (double)skiff_params(sim)->time_step < end) {
        if (!under_way && skiff_time(sim) >= start_time)
            good = under_way = skiff_drive_set(sim, 0, &ahead, err);
        good = good && skiff_step(sim, err) && add_row(series, sim, err);
        reproduce_tell(job, job->sheet->rows[window].name, sim, end);
    }
    return good;
}

/* The rows of the cruise as a table of their own, which shares them. */
static CsvTable cruise_of(const Series *series) {
    CsvTable table = series->table;
    const double end = series_at(series, table.row_count - 1, PROFILE_TIME);
    const double begin = end > start_time ? 0.5 * (start_time + end) : 0.5 * end;
    while (table.row_count > 1 && table.values[PROFILE_TIME] < begin) {
        table.values += table.column_count;
        table.row_count--;
    }
    return table;
}

static double column_mean(const CsvTable *table, int column) {
    double sum = 0;
    for (size_t row = 0; row < table->row_count; row++)
        sum += table->values[row * (size_t)table->column_count + (size_t)column];
    return sum / (double)table->row_count;
}

static bool sum_up(const ReproduceJob *job, int window, const SkiffSim *sim, const Series *series, Err *err) {
    const CsvTable cruise = cruise_of(series);
    double values[CARENSAC_BOAT_COLUMNS];
    Profile *profile = malloc(sizeof *profile);
    bool good = profile || err_set(err, ERR_IO, "out of memory");
    good = good && profile_make(&cruise, scenes[window], profile, err);
    if (good) {
        values[CARENSAC_BOAT_PARTICLES] = column_mean(&cruise, PROFILE_PARTICLES);
        values[CARENSAC_BOAT_SAMPLES] = skiff_stats(sim)->boundary_samples;
        values[CARENSAC_BOAT_STEP] = profile->plain_ms;
        values[CARENSAC_BOAT_ABSORB] = profile->phases[SKIFF_PHASE_ABSORB].plain_ms;
        values[CARENSAC_BOAT_MOVE] = profile->move_ms;
        values[CARENSAC_BOAT_AFTER] = profile->after5_ms;
        values[CARENSAC_BOAT_MEAN] = profile->mean_ms;
        values[CARENSAC_BOAT_SPEED] = column_mean(&cruise, SPEED);
        values[CARENSAC_BOAT_BOW_UP] = column_mean(&cruise, BOW_UP);
        good = sheet_add_run(job->sheet, window, values, err);
    }
    free(profile);
    return good;
}

static bool sail_window(const ReproduceJob *job, int window, Series *series, Err *err) {
    Scene *scene = reproduce_scene(job, scenes[window], standard_duration, NULL, 0, err);
    SkiffSim *sim =
        scene ? carried_start(scene, job->folder, job->args->threads, (SkiffSimd)job->args->simd, err) : NULL;
    if (sim && !*job->machine->cpu)
        *job->machine = machine_describe(sim);
    const bool good =
        sim && sail(job, window, sim, scene->duration, series, err) && sum_up(job, window, sim, series, err);
    skiff_destroy(sim);
    scene_free(scene);
    return good;
}

bool reproduce_boat(const ReproduceJob *job, Series series[REPRODUCE_BOAT_WINDOWS], Err *err) {
    bool good = true;
    for (int window = 0; good && window < REPRODUCE_BOAT_WINDOWS; window++)
        good = sail_window(job, window, &series[window], err);
    return good;
}

/* ---- Charts ---- */

/* One column of each window. */
static void write_windows(FILE *out, const Sheet *sheet, const Series *series, const SvgChart *labels,
                          int column) {
    SvgCurve curves[REPRODUCE_BOAT_WINDOWS];
    double *copies[2 * REPRODUCE_BOAT_WINDOWS];
    bool good = true;
    for (int w = 0; w < REPRODUCE_BOAT_WINDOWS; w++) {
        const CsvTable *table = &series[w].table;
        copies[2 * w] = csv_copy_column(table, table->names[PROFILE_TIME]);
        copies[2 * w + 1] = csv_copy_column(table, table->names[column]);
        good = good && copies[2 * w] && copies[2 * w + 1];
        curves[w] = (SvgCurve){sheet->rows[w].name, copies[2 * w], copies[2 * w + 1], table->row_count};
    }
    if (good)
        svg_curves(out, labels, curves, REPRODUCE_BOAT_WINDOWS);
    for (int k = 0; k < 2 * REPRODUCE_BOAT_WINDOWS; k++)
        free(copies[k]);
}

/* Mean time of the k-th step after a move, of the cruise. */
static void write_after_moves(FILE *out, const Sheet *sheet, const Series *series) {
    enum { AGES = 31 };
    double age[AGES], mean[REPRODUCE_BOAT_WINDOWS][AGES];
    SvgChart chart = {.title = "Steps after a move, cruise",
                      .x_label = "steps since the move (0: the move itself)",
                      .y_label = "mean time of a step, ms",
                      .x = age,
                      .count = AGES,
                      .series_count = REPRODUCE_BOAT_WINDOWS,
                      .from_zero = true};
    for (int w = 0; w < REPRODUCE_BOAT_WINDOWS; w++) {
        const CsvTable cruise = cruise_of(&series[w]);
        double count[AGES] = {0}, sum[AGES] = {0};
        int steps = AGES;
        for (size_t row = 0; row < cruise.row_count; row++) {
            const double *cells = cruise.values + row * (size_t)cruise.column_count;
            steps = cells[PROFILE_MOVED] > 0 ? 0 : steps + 1;
            if (steps < AGES) {
                sum[steps] += cells[PROFILE_STEP_MS];
                count[steps]++;
            }
        }
        for (int k = 0; k < AGES; k++) {
            age[k] = k;
            mean[w][k] = count[k] > 0 ? sum[k] / count[k] : (double)NAN;
        }
        chart.series[w] = (SvgSeries){sheet->rows[w].name, mean[w]};
    }
    svg_chart(out, &chart);
}

void reproduce_boat_charts(FILE *out, const Sheet *sheet, const Series series[REPRODUCE_BOAT_WINDOWS]) {
    static const struct {
        SvgChart labels;
        int column;
    } charts[] = {
        {{.title = "Speed of the boat", .y_label = "speed, m/s", .from_zero = true}, SPEED},
        {{.title = "Trim", .y_label = "bow up, degrees"}, BOW_UP},
        {{.title = "Particles", .y_label = "particles", .from_zero = true}, PROFILE_PARTICLES},
        {{.title = "Time of a step", .y_label = "ms", .from_zero = true}, PROFILE_STEP_MS},
        {{.title = "Density iterations", .y_label = "iterations", .from_zero = true},
         PROFILE_DENSITY_ITERATIONS},
    };
    fputs("<div class=\"charts\">\n", out);
    for (size_t k = 0; k < sizeof charts / sizeof *charts; k++) {
        SvgChart labels = charts[k].labels;
        labels.x_label = "time, s";
        write_windows(out, sheet, series, &labels, charts[k].column);
    }
    write_after_moves(out, sheet, series);
    fputs("</div>\n", out);
}
