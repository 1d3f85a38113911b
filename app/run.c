/* skiff run: scene in, folder of results out. The order of events:
 *
 *   read and check everything -> make the folder -> step, add rows, checkpoint now and then -> checkpoint,
 * summary, report
 *
 * Nothing is written before the scene has become a simulation. A checkpoint is written after the rows that
 * lead up to it are on disk, so that
 * --resume can cut the tables back to it and go on as if nothing had happened. */
#include "commands.h"

#include "interrupt.h"
#include "json_text.h"
#include "progress.h"
#include "report.h"
#include "scene.h"
#include "summary.h"
#include "tables.h"
#include "view.h"

#include "engine/base/file.h"
#include "engine/base/log.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { PATH_SIZE = 4096 };
static const double flush_period = 1.0; /* s of wall time */

typedef struct Run {
    const CliArgs *args;
    Scene *scene;
    SkiffSim *sim;
    Tables tables;
    View *view; /* NULL: no pictures */
    Progress progress;
    double end_time;                    /* s, simulated */
    double next_flush, next_checkpoint; /* s, wall clock */
} Run;

static const char *path_in(const Run *run, const char *name, char path[PATH_SIZE]) {
    snprintf(path, PATH_SIZE, "%.4000s/%s", run->args->output, name);
    return path;
}

/* ---- Beginning ---- */

static bool check_args(const CliArgs *args, Err *err) {
    struct stat status;
    if (!args->output)
        return err_set(err, ERR_USAGE, "-o DIR is missing: the folder for the results");
    if (args->force && args->resume)
        return err_set(err, ERR_USAGE, "--force starts anew and --resume goes on: give one of them");
    bool exists = stat(args->output, &status) == 0;
    if (exists && !S_ISDIR(status.st_mode))
        return err_set(err, ERR_USAGE, "%s: exists and is not a folder", args->output);
    if (exists && !args->force && !args->resume)
        return err_set(
            err, ERR_USAGE,
            "%s: the folder exists; --resume goes on from its last checkpoint, --force replaces its results",
            args->output);
    if (!exists && args->resume)
        return err_set(err, ERR_USAGE, "%s: there is no such folder to resume", args->output);
    return true;
}

/* The scene as the options change it: --duration is an edit like the others. */
static Scene *load_scene(const CliArgs *args, Err *err) {
    const char *edits[CLI_MAX_EDITS + 1];
    char duration[64];
    int count = args->edit_count;
    memcpy(edits, args->edits, sizeof *edits * (size_t)count);
    if (!isnan(args->duration)) {
        snprintf(duration, sizeof duration, "Configuration.duration=%.17g", args->duration);
        edits[count++] = duration;
    }
    return scene_load(args->scene, edits, count, err);
}

/* First place where two documents differ, as a path. */
static bool find_difference(const json_t *a, const json_t *b, char *path, size_t size) {
    size_t used = strlen(path);
    if (json_equal(a, b))
        return false;
    if (json_is_object(a) && json_is_object(b)) {
        const char *key;
        json_t *item;
        json_object_foreach((json_t *)(uintptr_t)a, key, item) {
            snprintf(path + used, size - used, "%s%s", used > 0 ? "." : "", key);
            if (find_difference(item, json_object_get(b, key), path, size))
                return true;
        }
        path[used] = '\0';
    }
    if (json_is_array(a) && json_is_array(b) && json_array_size(a) == json_array_size(b)) {
        for (size_t i = 0; i < json_array_size(a); i++) {
            snprintf(path + used, size - used, "[%zu]", i);
            if (find_difference(json_array_get(a, i), json_array_get(b, i), path, size))
                return true;
        }
        path[used] = '\0';
    }
    return true;
}

/* What a resumed run may change: how long it is, how it is called and how it is drawn. */
static json_t *comparable(const Scene *scene) {
    json_t *effective = scene_effective(scene);
    json_object_del(json_object_get(effective, "Configuration"), "duration");
    json_object_del(effective, "title");
    json_object_del(effective, "description");
    json_object_del(effective, "$schema");
    json_object_del(effective, "Render");
    return effective;
}

static bool check_same_scene(const Run *run, Err *err) {
    char path[PATH_SIZE], place[256] = "";
    Scene *before = scene_load(path_in(run, "scene.json", path), NULL, 0, err);
    if (!before)
        return false;
    json_t *old = comparable(before), *new = comparable(run->scene);
    bool differ = find_difference(old, new, place, sizeof place);
    json_decref(old);
    json_decref(new);
    scene_free(before);
    return !differ ||
           err_set(err, ERR_INPUT, "%s: differs from %s at %s; only the duration of a resumed run can change",
                   run->scene->file, path, *place ? place : "its top");
}

static bool resume(Run *run, Err *err) {
    char path[PATH_SIZE];
    if (!file_exists(path_in(run, "state.skiff", path)))
        return err_set(err, ERR_INPUT, "%s: there is no checkpoint to resume from; start again with --force",
                       path);
    return check_same_scene(run, err) && skiff_load(run->sim, path, err) &&
           tables_resume(&run->tables, run->args->output, run->sim, run->scene->probe_rate, err);
}

/* A replaced run leaves nothing behind that could be taken for the new one's. */
static bool remove_old(const Run *run, Err *err) {
    static const char *const names[] = {"state.skiff", "diverged.skiff", "steps.csv",    "hull.csv",
                                        "probes.csv",  "scene.json",     "summary.json", "report.html"};
    char path[PATH_SIZE];
    for (size_t i = 0; i < sizeof names / sizeof *names; i++)
        if (unlink(path_in(run, names[i], path)) != 0 && errno != ENOENT)
            return err_set(err, ERR_IO, "%s: cannot be replaced: %s", path, strerror(errno));
    return frames_remove(run->args->output, err);
}

static bool begin(Run *run, Err *err) {
    char path[PATH_SIZE];
    const CliArgs *args = run->args;
    if (args->resume) {
        if (!resume(run, err))
            return false;
    } else {
        if (!file_make_directory(args->output, err) || !remove_old(run, err) ||
            !tables_create(&run->tables, args->output, run->sim, run->scene->probe_rate, err))
            return false;
    }
    json_t *effective = scene_effective(run->scene);
    bool written = json_text_write(path_in(run, "scene.json", path), effective, err);
    json_decref(effective);
    return written && (!run->view || view_begin(run->view, run->sim, args->output, err));
}

/* ---- Stepping ---- */

static bool checkpoint(Run *run, const char *name, Err *err) {
    char path[PATH_SIZE];
    return tables_flush(&run->tables, true, err) && skiff_save(run->sim, path_in(run, name, path), err);
}

static bool draw_frames(Run *run, Err *err) {
    ViewControls controls = view_controls_none();
    controls.step_ms = skiff_stats(run->sim)->step_ms;
    return !run->view || view_step(run->view, run->sim, &controls, err);
}

static bool after_step(Run *run, Err *err) {
    tables_add(&run->tables, run->sim);
    if (!draw_frames(run, err))
        return false;
    progress_step(&run->progress, run->sim);
    double now = run->progress.last;
    if (now >= run->next_flush) {
        if (!tables_flush(&run->tables, false, err))
            return false;
        run->next_flush = now + flush_period;
    }
    if (now >= run->next_checkpoint) {
        if (!checkpoint(run, "state.skiff", err) || !view_save(run->view, err))
            return false;
        run->next_checkpoint = progress_clock() + run->args->checkpoint_every;
    }
    return true;
}

static bool is_finished(const Run *run) {
    return skiff_time(run->sim) + 0.5 * (double)skiff_params(run->sim)->time_step >= run->end_time;
}

/* True: at the end or interrupted. False: diverged (the message says where) or a file could not be written.
 */
static bool step_to_end(Run *run, Err *err) {
    double now = progress_clock();
    run->progress = progress_begin(skiff_time(run->sim), run->end_time, run->args->quiet);
    run->next_flush = now + flush_period;
    run->next_checkpoint = now + run->args->checkpoint_every;
    bool ok = true;
    while (ok && !is_finished(run) && !interrupt_pending())
        ok = skiff_step(run->sim, err) && after_step(run, err);
    progress_clear(&run->progress);
    return ok;
}

/* ---- Ending ---- */

static bool read_tables(const Run *run, ReportInput *input, Err *err) {
    char path[PATH_SIZE];
    return csv_read(path_in(run, "steps.csv", path), &input->steps, err) &&
           (skiff_body_count(run->sim) == 0 || csv_read(path_in(run, "hull.csv", path), &input->hull, err)) &&
           (skiff_probe_channel_count(run->sim) == 0 ||
            csv_read(path_in(run, "probes.csv", path), &input->probes, err));
}

static void print_end(const Run *run, const RunEnd *end, const json_t *summary, const char *report) {
    const json_t *step_ms = json_object_get(json_object_get(summary, "ms"), "step");
    long long removed = json_integer_value(json_object_get(summary, "removed"));
    fprintf(stderr, "%s at t = %.6g s, step %llu: %.4g ms/step, real-time factor %.3g\n", end->status,
            skiff_time(run->sim), (unsigned long long)skiff_step_count(run->sim),
            json_number_value(json_object_get(step_ms, "mean")),
            json_number_value(json_object_get(summary, "real_time_factor")));
    if (removed > 0)
        fprintf(stderr, "%lld particles left the domain and were removed\n", removed);
    fprintf(stderr, "%s\n", report);
}

static bool write_results(Run *run, const RunEnd *end, Err *err) {
    char path[PATH_SIZE];
    ReportInput input = {.scene = run->scene, .sim = run->sim};
    bool ok = read_tables(run, &input, err);
    json_t *summary = ok ? summary_make(run->scene, run->sim, &input.steps, end) : NULL;
    input.summary = summary;
    ok = ok && json_text_write(path_in(run, "summary.json", path), summary, err) &&
         report_write(path_in(run, "report.html", path), &input, err);
    if (ok && !run->args->quiet)
        print_end(run, end, summary, path);
    json_decref(summary);
    csv_free(&input.steps);
    csv_free(&input.hull);
    csv_free(&input.probes);
    return ok;
}

static bool end_diverged(Run *run, Err *err) {
    Err other = {0};
    RunEnd end = {"diverged", err->message};
    if (!view_finish(run->view, &other) || !checkpoint(run, "diverged.skiff", &other) ||
        !tables_close(&run->tables, &other) || !write_results(run, &end, &other))
        err_add(err, ERR_DIVERGED, "%s", other.message);
    else
        err_add(err, ERR_DIVERGED, "the state is in %s/diverged.skiff", run->args->output);
    return false;
}

static bool end_normally(Run *run, Err *err) {
    bool interrupted = !is_finished(run);
    RunEnd end = {interrupted ? "interrupted" : "finished", ""};
    if (!view_finish(run->view, err) || !checkpoint(run, "state.skiff", err) || !view_save(run->view, err) ||
        !tables_close(&run->tables, err) || !write_results(run, &end, err))
        return false;
    return !interrupted ||
           err_set(err, ERR_INTERRUPTED, "skiff run: interrupted; add --resume to go on from here");
}

/* Warnings of the engine stand on lines of their own, not in the line of progress. */
static void log_line(LogLevel level, const char *message, void *user) {
    progress_clear(user);
    fprintf(stderr, "skiff: %s%s\n", level == LOG_WARNING ? "warning: " : "", message);
}

static bool run_scene(Run *run, Err *err) {
    interrupt_hold();
    log_set_sink(log_line, &run->progress, LOG_INFO);
    run->scene = load_scene(run->args, err);
    if (!run->scene)
        return false;
    run->sim = scene_start(run->scene, run->args->threads, (SkiffSimd)run->args->simd, err);
    if (!run->sim)
        return false;
    if (interrupt_pending())
        return err_set(err, ERR_INTERRUPTED,
                       "skiff run: interrupted before the first step; nothing was written");
    ViewOptions options;
    if (!view_options_make(&options, run->args, run->scene, err))
        return false;
    if (view_options_needed(&options) && !(run->view = view_create(&options, run->scene, run->sim, err)))
        return err->code != ERR_GL ? false : err_add(err, ERR_GL, "--no-render simulates without pictures");
    run->end_time = run->scene->def.start_time + run->scene->duration;
    if (!begin(run, err))
        return false;
    if (step_to_end(run, err))
        return end_normally(run, err);
    return err->code == ERR_DIVERGED ? end_diverged(run, err) : false;
}

bool run_command(const CliArgs *args, Err *err) {
    Run run = {.args = args};
    if (!check_args(args, err))
        return false;
    bool ok = run_scene(&run, err);
    log_set_sink(NULL, NULL, LOG_WARNING);
    tables_close(&run.tables, NULL);
    view_destroy(run.view);
    skiff_destroy(run.sim);
    scene_free(run.scene);
    return ok;
}
