/* skiff bench: times the same steps of a settled scene. A window is a run of steps; figures are medians over
 * the windows of the windows' means, since a shared machine's speed drifts by a fifth. The errors reached
 * stand beside the times. */
#include "commands.h"

#include "json_text.h"
#include "machine.h"
#include "pilot.h"
#include "progress.h"
#include "scene.h"
#include "summary.h"

#include "engine/base/arena.h"
#include "engine/base/file.h"

#include <errno.h>
#include <inttypes.h>
#include <limits.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

/* Means over the steps of one window. */
typedef struct Window {
    double phase_ms[SKIFF_PHASE_COUNT], step_ms;
} Window;

typedef struct Bench {
    const CliArgs *args;
    const Scene *scene;
    SkiffSim *sim;
    Pilot pilot;
    Window *windows;
    double *figures; /* [windows] for medians */
    /* sums over all steps measured */
    double density_iterations, divergence_iterations, density_error, divergence_error, neighbours, solve_ms;
    double density_max; /* largest */
} Bench;

/* ---- Measuring ---- */

static void add_step(Bench *bench, Window *window) {
    const SkiffStats *stats = skiff_stats(bench->sim);
    for (int i = 0; i < SKIFF_PHASE_COUNT; i++)
        window->phase_ms[i] += stats->phase_ms[i] / bench->args->steps;
    window->step_ms += stats->step_ms / bench->args->steps;
    bench->density_iterations += stats->density_iterations;
    bench->divergence_iterations += stats->divergence_iterations;
    bench->density_error += stats->density_error_percent;
    bench->divergence_error += stats->divergence_error_percent;
    bench->neighbours += stats->neighbours;
    bench->solve_ms += stats->phase_ms[SKIFF_PHASE_DIVERGENCE] + stats->phase_ms[SKIFF_PHASE_PRESSURE];
    if (stats->density_max_percent > bench->density_max)
        bench->density_max = stats->density_max_percent;
}

static bool measure(Bench *bench, Err *err) {
    const CliArgs *args = bench->args;
    double dt = (double)skiff_params(bench->sim)->time_step, start = skiff_time(bench->sim);
    double settled = start + args->settle;
    Progress progress = progress_begin(start, settled + dt * args->steps * args->windows, args->quiet);
    bool ok = true;
    while (ok && skiff_time(bench->sim) + 0.5 * dt < settled) {
        ok = pilot_step(&bench->pilot, bench->sim, err) && skiff_step(bench->sim, err);
        if (ok)
            progress_step(&progress, bench->sim);
    }
    for (int w = 0; ok && w < args->windows; w++)
        for (int s = 0; ok && s < args->steps; s++) {
            ok = pilot_step(&bench->pilot, bench->sim, err) && skiff_step(bench->sim, err);
            if (ok) {
                add_step(bench, &bench->windows[w]);
                progress_step(&progress, bench->sim);
            }
        }
    progress_clear(&progress);
    return ok;
}

/* ---- Figures ---- */

typedef double WindowFigure(const Window *window, int phase);

static double step_figure(const Window *window, int phase) {
    (void)phase;
    return window->step_ms;
}

static double phase_figure(const Window *window, int phase) {
    return window->phase_ms[phase];
}

static double search_figure(const Window *window, int phase) {
    (void)phase;
    return window->phase_ms[SKIFF_PHASE_SORT] + window->phase_ms[SKIFF_PHASE_SEARCH] +
           window->phase_ms[SKIFF_PHASE_BOUNDARY];
}

/* Median, and the smallest and largest where wanted. */
static double median(const Bench *bench, WindowFigure *figure, int phase, double *least, double *most) {
    int count = bench->args->windows;
    double *values = bench->figures;
    for (int w = 0; w < count; w++)
        values[w] = figure(&bench->windows[w], phase);
    summary_sort(values, (size_t)count);
    double middle = 0.5 * (values[(count - 1) / 2] + values[count / 2]);
    if (least)
        *least = values[0];
    if (most)
        *most = values[count - 1];
    return middle;
}

static void put(json_t *result, const char *key, double value) {
    char text[32];
    snprintf(text, sizeof text, "%.6g", value);
    json_object_set_new(result, key, json_text_double(strtod(text, NULL)));
}

static void put_count(json_t *result, const char *key, uint64_t count) {
    json_object_set_new(result, key, json_integer((json_int_t)count));
}

static void put_text(json_t *result, const char *key, const char *text) {
    json_object_set_new(result, key, json_text_string(text));
}

static void put_origin(const Bench *bench, json_t *result) {
    Machine machine = machine_describe(bench->sim);
    char name[256], date[32];
    time_t now = time(NULL);
    struct tm utc;
    scene_name(bench->scene, name, sizeof name);
    strftime(date, sizeof date, "%Y-%m-%dT%H:%M:%SZ", gmtime_r(&now, &utc));
    put_text(result, "date", date);
    put_text(result, "commit", machine.commit);
    put_text(result, "cpu", machine.cpu);
    put_text(result, "compiler", machine.compiler);
    put_text(result, "isa", machine.isa);
    put_count(result, "threads", (uint64_t)machine.threads);
    put_text(result, "scene", name);
}

/* The figures, in the order of the CSV columns. New reference. */
static json_t *make_result(const Bench *bench) {
    const CliArgs *args = bench->args;
    double least, most, step_ms = median(bench, step_figure, 0, &least, &most);
    double steps = (double)args->steps * args->windows;
    double dt = (double)skiff_params(bench->sim)->time_step;
    double particles = skiff_particles(bench->sim).count;
    double iterations = bench->density_iterations + bench->divergence_iterations;
    char key[64], hash[20];
    json_t *result = json_object();
    put_origin(bench, result);
    put(result, "settle", args->settle);
    put_count(result, "steps", (uint64_t)args->steps);
    put_count(result, "windows", (uint64_t)args->windows);
    put_count(result, "particles", skiff_particles(bench->sim).count);
    put_count(result, "boundary_samples", summary_sample_count(bench->sim));
    put(result, "ms_per_step", step_ms);
    put(result, "ms_min", least);
    put(result, "ms_max", most);
    put(result, "search_ms", median(bench, search_figure, 0, NULL, NULL));
    put(result, "iteration_ms", iterations > 0 ? bench->solve_ms / iterations : 0);
    put(result, "density_iterations", bench->density_iterations / steps);
    put(result, "divergence_iterations", bench->divergence_iterations / steps);
    put(result, "density_error_percent", bench->density_error / steps);
    put(result, "density_max_percent", bench->density_max);
    put(result, "divergence_error_percent", bench->divergence_error / steps);
    put(result, "neighbours", bench->neighbours / steps);
    put(result, "peak_rss_mb", (double)memory_peak() / 1e6);
    put(result, "particles_per_s", 1000 * particles / step_ms);
    put(result, "real_time_factor", summary_real_time_factor(dt, step_ms));
    for (int i = 0; i < SKIFF_PHASE_COUNT; i++) {
        snprintf(key, sizeof key, "%s_ms", skiff_phase_key(i));
        if (strcmp(key, "search_ms") == 0) /* search_ms is the sum above */
            snprintf(key, sizeof key, "search_only_ms");
        put(result, key, median(bench, phase_figure, i, NULL, NULL));
    }
    snprintf(hash, sizeof hash, "%016" PRIx64, skiff_hash(bench->sim));
    put_text(result, "state_hash", hash);
    return result;
}

/* ---- Results ---- */

enum { LABEL_WIDTH = 54 };

static double number(const json_t *result, const char *key) {
    return json_number_value(json_object_get(result, key));
}

static const char *text(const json_t *result, const char *key) {
    return json_string_value(json_object_get(result, key));
}

static void print_row(const char *label, double value, const char *unit) {
    printf("  %-*s %10.4g %s\n", LABEL_WIDTH, label, value, unit);
}

static void print_table(const Bench *bench, const json_t *result) {
    double step_ms = number(result, "ms_per_step");
    printf("%s: %.0f particles, %.0f boundary samples\n%s, %.0f threads, %s, commit %s\n",
           text(result, "scene"), number(result, "particles"), number(result, "boundary_samples"),
           text(result, "cpu"), number(result, "threads"), text(result, "isa"), text(result, "commit"));
    printf("%d windows of %d steps after %g s; medians\n\n", bench->args->windows, bench->args->steps,
           bench->args->settle);
    printf("  %-*s %10s %6s\n", LABEL_WIDTH, "phase", "ms", "%");
    for (int i = 0; i < SKIFF_PHASE_COUNT; i++) {
        double ms = median(bench, phase_figure, i, NULL, NULL);
        printf("  %-*s %10.2f %6.1f\n", LABEL_WIDTH, skiff_phase_label(i), ms, 100 * ms / step_ms);
    }
    printf("  %-*s %10.2f %6.1f   (windows: %.2f to %.2f)\n\n", LABEL_WIDTH, "step", step_ms, 100.0,
           number(result, "ms_min"), number(result, "ms_max"));
    print_row("search, sort and boundary terms", number(result, "search_ms"), "ms");
    print_row("one solver iteration", number(result, "iteration_ms"), "ms");
    print_row("density iterations, mean", number(result, "density_iterations"), "");
    print_row("divergence iterations, mean", number(result, "divergence_iterations"), "");
    print_row("density error, mean", number(result, "density_error_percent"), "%");
    print_row("density error, largest", number(result, "density_max_percent"), "%");
    print_row("divergence error, mean", number(result, "divergence_error_percent"), "%");
    print_row("neighbours, mean", number(result, "neighbours"), "");
    print_row("peak memory", number(result, "peak_rss_mb"), "MB");
    printf("  %-*s %10.0f\n", LABEL_WIDTH, "particles a second", number(result, "particles_per_s"));
    print_row("real-time factor (1 is real time)", number(result, "real_time_factor"), "");
    printf("  %-*s %s\n", LABEL_WIDTH, "state hash", text(result, "state_hash"));
}

/* tests/bench/results of the tree whose assets/scenes the scene is in; false when there is no such folder. */
static bool find_results_folder(const CliArgs *args, char folder[PATH_MAX]) {
    char scene[PATH_MAX];
    if (args->results) {
        snprintf(folder, PATH_MAX, "%s", args->results);
        return true;
    }
    if (!realpath(args->operand, scene))
        return false;
    for (int i = 0; i < 3; i++) { /* file, scenes, assets */
        char *slash = strrchr(scene, '/');
        if (!slash)
            return false;
        *slash = '\0';
    }
    snprintf(folder, PATH_MAX, "%.4000s/tests/bench/results", scene);
    return file_exists(folder);
}

static void print_cells(FILE *stream, const json_t *result, bool is_header) {
    const char *key, *comma = "";
    json_t *value;
    json_object_foreach((json_t *)(uintptr_t)result, key, value) {
        fputs(comma, stream);
        comma = ",";
        if (is_header)
            fputs(key, stream);
        else if (json_is_string(value))
            fputs(json_string_value(value), stream);
        else
            json_text_print(stream, value, -1);
    }
    fputc('\n', stream);
}

/* malloc'ed. */
static char *csv_line(const json_t *result, bool is_header) {
    char *line = NULL;
    size_t size;
    FILE *stream = open_memstream(&line, &size);
    if (!stream)
        return NULL;
    print_cells(stream, result, is_header);
    return fclose(stream) == 0 ? line : NULL;
}

/* *same: the file is absent or begins with this header. */
static bool takes_header(const char *path, const char *header, bool *same, Err *err) {
    char *old;
    size_t size;
    *same = !file_exists(path);
    if (*same)
        return true;
    if (!file_read(path, (size_t)64 << 20, &old, &size, err))
        return false;
    *same = strncmp(old, header, strlen(header)) == 0;
    free(old);
    return true;
}

/* The first of SCENE.csv, SCENE-2.csv, ... with these columns: rows of a version that measured other phases
 * stay as they are. */
static bool find_results_file(const char *folder, const char *scene, const char *header, char *path,
                              size_t path_size, Err *err) {
    bool same = false;
    for (int n = 1; !same; n++) {
        if (n == 1)
            snprintf(path, path_size, "%s/%s.csv", folder, scene);
        else
            snprintf(path, path_size, "%s/%s-%d.csv", folder, scene, n);
        if (!takes_header(path, header, &same, err))
            return false;
    }
    return true;
}

static bool append_row(const char *path, const char *header, const char *row, Err *err) {
    bool exists = file_exists(path);
    FILE *stream = fopen(path, "ab");
    if (!stream)
        return err_set(err, ERR_IO, "%s: cannot be written: %s", path, strerror(errno));
    bool written = fprintf(stream, "%s%s", exists ? "" : header, row) > 0 && fflush(stream) == 0 &&
                   fsync(fileno(stream)) == 0;
    int error = errno;
    if (fclose(stream) != 0 && written) {
        written = false;
        error = errno;
    }
    return written || err_set(err, ERR_IO, "%s: writing failed: %s", path, strerror(error));
}

static bool keep_result(const CliArgs *args, const json_t *result, Err *err) {
    char folder[PATH_MAX], path[PATH_MAX + 300];
    if (args->no_results || !find_results_folder(args, folder))
        return true;
    if (!file_make_directory(folder, err))
        return false;
    char *header = csv_line(result, true), *row = csv_line(result, false);
    bool kept = header && row
                    ? find_results_file(folder, text(result, "scene"), header, path, sizeof path, err) &&
                          append_row(path, header, row, err)
                    : err_set(err, ERR_IO, "%s: out of memory", folder);
    free(header);
    free(row);
    return kept;
}

static bool bench_scene(Bench *bench, Err *err) {
    const CliArgs *args = bench->args;
    if (!measure(bench, err))
        return false;
    json_t *result = make_result(bench);
    if (args->json) {
        json_text_print(stdout, result, -1);
        putchar('\n');
    } else {
        print_table(bench, result);
    }
    bool kept = keep_result(args, result, err);
    json_decref(result);
    return kept;
}

bool bench_command(const CliArgs *args, Err *err) {
    Scene *scene = scene_load(args->operand, args->edits, args->edit_count, err);
    if (!scene)
        return false;
    Bench bench = {.args = args, .scene = scene};
    const bool read = pilot_read(&bench.pilot, scene, args->input, NULL, err);
    bench.sim = read ? scene_start(scene, args->threads, (SkiffSimd)args->simd, err) : NULL;
    bench.windows = calloc((size_t)args->windows, sizeof *bench.windows);
    bench.figures = calloc((size_t)args->windows, sizeof *bench.figures);
    const bool memory = bench.windows && bench.figures;
    bool ok = bench.sim && (memory || err_set(err, ERR_IO, "out of memory")) && bench_scene(&bench, err);
    free(bench.windows);
    free(bench.figures);
    skiff_destroy(bench.sim);
    pilot_free(&bench.pilot);
    scene_free(scene);
    return ok;
}
