/* The folder of a run: what is checked before it is touched, how it begins, goes on after a checkpoint, and
 * what is written into it at the end. A checkpoint is written after the rows that lead up to it are on disk,
 * so that
 * --resume can cut the tables back to it and go on as if nothing had happened. */
#include "run_folder.h"

#include "json_text.h"
#include "report.h"
#include "summary.h"
#include "trace.h"

#include "engine/base/file.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { PATH_SIZE = 4096 };

static const char *run_path(const Run *run, const char *name, char path[PATH_SIZE]) {
    snprintf(path, PATH_SIZE, "%.4000s/%s", run->args->output, name);
    return path;
}

/* ---- Before ---- */

bool run_check_args(const CliArgs *args, Err *err) {
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
    return file_check_directory(args->output, err);
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
    json_object_del(effective, "input"); /* the folder has its own copy */
    return effective;
}

static bool check_same_scene(const Run *run, Err *err) {
    char path[PATH_SIZE], place[256] = "";
    Scene *before = scene_load(run_path(run, "scene.json", path), NULL, 0, err);
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

bool run_check_resume(const Run *run, Err *err) {
    char path[PATH_SIZE];
    if (!file_exists(run_path(run, "state.skiff", path)))
        return err_set(err, ERR_INPUT, "%s: there is no checkpoint to resume from; start again with --force",
                       path);
    return check_same_scene(run, err);
}

static bool resume(Run *run, Err *err) {
    char path[PATH_SIZE];
    return skiff_load(run->sim, run_path(run, "state.skiff", path), err) &&
           pilot_resume(&run->pilot, run->scene, run->args->output, run->sim, err) &&
           tables_resume(&run->tables, run->args->output, run->sim, run->scene->probe_rate, err);
}

/* A replaced run leaves nothing behind that could be taken for the new one's. */
static bool remove_old(const Run *run, Err *err) {
    static const char *const names[] = {"state.skiff", "diverged.skiff", "steps.csv",  "ledger.csv",
                                        "hull.csv",    "probes.csv",     "scene.json", "summary.json",
                                        "report.html", "trace.json",     "run.input",  "script.input"};
    char path[PATH_SIZE];
    for (size_t i = 0; i < sizeof names / sizeof *names; i++)
        if (unlink(run_path(run, names[i], path)) != 0 && errno != ENOENT)
            return err_set(err, ERR_IO, "%s: cannot be replaced: %s", path, strerror(errno));
    return frames_remove(run->args->output, err);
}

bool run_begin(Run *run, Err *err) {
    char path[PATH_SIZE];
    const CliArgs *args = run->args;
    if (args->resume) {
        if (!resume(run, err))
            return false;
    } else {
        if (!file_make_directory(args->output, err) || !remove_old(run, err) ||
            !pilot_create(&run->pilot, args->output, run->sim, err) ||
            !tables_create(&run->tables, args->output, run->sim, run->scene->probe_rate, err))
            return false;
    }
    json_t *effective = scene_effective(run->scene);
    bool written = json_text_write(run_path(run, "scene.json", path), effective, err);
    json_decref(effective);
    ViewControls controls = view_controls_none();
    pilot_show(&run->pilot, run->sim, &controls.driven);
    return written && (!run->view || view_begin(run->view, run->sim, &controls, args->output, err));
}

/* ---- During and after ---- */

bool run_flush(Run *run, bool durable, Err *err) {
    return tables_flush(&run->tables, durable, err) && pilot_flush(&run->pilot, durable, err);
}

bool run_close(Run *run, Err *err) {
    const bool tables = tables_close(&run->tables, err);
    return pilot_close(&run->pilot, tables ? err : NULL) && tables;
}

static bool keep_state(Run *run, const char *name, Err *err) {
    char path[PATH_SIZE];
    return run_flush(run, true, err) && skiff_save(run->sim, run_path(run, name, path), err);
}

bool run_checkpoint(Run *run, Err *err) {
    return keep_state(run, "state.skiff", err) && view_save(run->view, err);
}

bool run_keep_diverged(Run *run, Err *err) {
    return keep_state(run, "diverged.skiff", err);
}

static bool read_tables(const Run *run, ReportInput *input, Err *err) {
    char path[PATH_SIZE];
    return csv_read(run_path(run, "steps.csv", path), &input->steps, err) &&
           csv_read(run_path(run, "ledger.csv", path), &input->ledger, err) &&
           (skiff_body_count(run->sim) == 0 ||
            csv_read(run_path(run, "hull.csv", path), &input->hull, err)) &&
           (skiff_probe_channel_count(run->sim) == 0 ||
            csv_read(run_path(run, "probes.csv", path), &input->probes, err));
}

static void print_end(const Run *run, const RunEnd *end, const json_t *summary, const char *report) {
    const json_t *step_ms = json_object_get(json_object_get(summary, "ms"), "step");
    const json_t *out = json_object_get(summary, "particles_out");
    long long removed = json_integer_value(json_object_get(out, skiff_out_key(SKIFF_OUT_ESCAPED)));
    fprintf(stderr, "%s at t = %.6g s, step %llu: %.4g ms/step, real-time factor %.3g\n", end->status,
            skiff_time(run->sim), (unsigned long long)skiff_step_count(run->sim),
            json_number_value(json_object_get(step_ms, "mean")),
            json_number_value(json_object_get(summary, "real_time_factor")));
    if (removed > 0)
        fprintf(stderr, "%lld particles left the domain and were removed\n", removed);
    fprintf(stderr, "%s\n", report);
}

bool run_write_results(Run *run, const RunEnd *end, Err *err) {
    char path[PATH_SIZE];
    ReportInput input = {.scene = run->scene, .sim = run->sim};
    bool ok = read_tables(run, &input, err);
    json_t *summary = ok ? summary_make(run->scene, run->sim, &input.steps, &input.ledger, end) : NULL;
    input.summary = summary;
    ok = ok && json_text_write(run_path(run, "summary.json", path), summary, err) &&
         trace_write(run_path(run, "trace.json", path), &input.steps, err) &&
         report_write(run_path(run, "report.html", path), &input, err);
    if (ok && !run->args->quiet)
        print_end(run, end, summary, path);
    json_decref(summary);
    csv_free(&input.steps);
    csv_free(&input.ledger);
    csv_free(&input.hull);
    csv_free(&input.probes);
    return ok;
}
