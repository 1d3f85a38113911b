/* Two files in the folder of a run: script.input, a copy of the input file, so that --resume needs no other;
 * and run.input, what was driven, one line for each change and written as it happens. run.input is an input
 * file too: a new run with it makes the same steps, whatever keys were bound. */
#include "pilot.h"

#include "engine/base/file.h"
#include "engine/base/log.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_SIZE = 64 << 20 };
static const char copy_name[] = "script.input", record_name[] = "run.input";
static const char record_header[] = "# What was driven. Replay: skiff run SCENE --input run.input -o DIR";

static void join(char path[4096], const char *folder, const char *name) {
    snprintf(path, 4096, "%.4000s/%s", folder, name);
}

static ScriptWords words_of(const Scene *scene) {
    return (ScriptWords){.keys = scene->keys, .key_count = scene->key_count, .cameras = scene->cameras};
}

static bool read_script(const char *path, const Scene *scene, char **text, size_t *size, Script *script,
                        Err *err) {
    const ScriptWords words = words_of(scene);
    return file_read(path, MAX_SIZE, text, size, err) &&
           script_parse(path, *text, *size, &words, script, err);
}

/* A file that would do nothing is a mistake. */
static bool check_use(const Pilot *pilot, const Scene *scene, Err *err) {
    for (int b = 0; b < scene->def.body_count; b++)
        if (scene->def.bodies[b].drive)
            return true;
    for (size_t i = 0; i < pilot->script.count; i++)
        if (pilot->script.events[i].command != SCRIPT_CAMERA)
            return err_set(err, ERR_INPUT, "%s:%d: no body of %s has a drive: RigidBodies[].drive is missing",
                           pilot->file, pilot->script.events[i].line, scene->file);
    return true;
}

bool pilot_read(Pilot *pilot, const Scene *scene, const char *file, const char *folder, Err *err) {
    const ScriptWords words = words_of(scene);
    *pilot = (Pilot){.helm = helm_begin(&words)};
    if (!file && folder) {
        join(pilot->path, folder, copy_name);
        pilot->file = file_exists(pilot->path) ? pilot->path : NULL;
    } else {
        pilot->file = file ? file : scene->input;
        if (!file && pilot->file && !file_exists(pilot->file))
            return err_set(err, ERR_INPUT, "%s: input: there is no file %s", scene->file, pilot->file);
    }
    return !pilot->file ||
           (read_script(pilot->file, scene, &pilot->text, &pilot->size, &pilot->script, err) &&
            check_use(pilot, scene, err));
}

static bool is_open(const Pilot *pilot, const SkiffSim *sim) {
    return pilot->text || skiff_drive_count(sim) > 0;
}

bool pilot_create(Pilot *pilot, const char *folder, const SkiffSim *sim, Err *err) {
    char path[4096];
    join(path, folder, copy_name);
    if (pilot->text && !file_write(path, pilot->text, pilot->size, err))
        return false;
    join(path, folder, record_name);
    return !is_open(pilot, sim) || csv_create(&pilot->record, path, record_header, err);
}

/* Line of the first event up to `time` in which two scripts differ; 0: none. */
static int find_difference(const Script *script, const Script *other, double time) {
    for (size_t i = 0;; i++) {
        const ScriptEvent *a =
            i < script->count && script->events[i].time <= time ? &script->events[i] : NULL;
        const ScriptEvent *b = i < other->count && other->events[i].time <= time ? &other->events[i] : NULL;
        if (!a && !b)
            return 0;
        if (!a || !b || a->time != b->time || a->command != b->command || a->key != b->key ||
            a->value != b->value || strcmp(a->camera, b->camera) != 0)
            return a ? a->line : b->line;
    }
}

/* The events that were driven must be the same; those to come may be others. */
static bool check_past(const Pilot *pilot, const Scene *scene, const char *folder, double time, Err *err) {
    char path[4096], *text = NULL;
    size_t size;
    Script old = {0};
    join(path, folder, copy_name);
    bool good = !file_exists(path) || read_script(path, scene, &text, &size, &old, err);
    const int line = good ? find_difference(&pilot->script, &old, time) : 0;
    if (line > 0)
        good = err_set(err, ERR_INPUT,
                       "%s: differs from %s near line %d, before the checkpoint at %.6g s; what was driven "
                       "cannot change",
                       pilot->file ? pilot->file : "no input", path, line, time);
    script_free(&old);
    free(text);
    return good;
}

bool pilot_resume(Pilot *pilot, const Scene *scene, const char *folder, const SkiffSim *sim, Err *err) {
    char path[4096];
    double last;
    const double dt = (double)skiff_params(sim)->time_step, done = skiff_time(sim) - dt;
    if (skiff_step_count(sim) == 0)
        return pilot_create(pilot, folder, sim, err);
    if (!check_past(pilot, scene, folder, done, err))
        return false;
    join(path, folder, copy_name);
    if (pilot->text && !file_write(path, pilot->text, pilot->size, err))
        return false;
    helm_advance(&pilot->helm, &pilot->script, done);
    pilot->position = helm_position(&pilot->helm);
    if (!is_open(pilot, sim))
        return true;
    join(path, folder, record_name);
    return csv_cut(path, record_header, done + 0.5 * dt, &last, err) && csv_append(&pilot->record, path, err);
}

bool pilot_step(Pilot *pilot, SkiffSim *sim, Err *err) {
    helm_advance(&pilot->helm, &pilot->script, skiff_time(sim));
    const HelmPosition position = helm_position(&pilot->helm);
    if (helm_same(&position, &pilot->position))
        return true;
    const SkiffControls controls = helm_controls(&position);
    bool good = true;
    for (int d = 0; good && d < skiff_drive_count(sim); d++)
        good = skiff_drive_set(sim, d, &controls, err);
    if (pilot->record.stream)
        helm_write_change(pilot->record.stream, skiff_time(sim), &pilot->position, &position);
    pilot->position = position;
    return good;
}

bool pilot_flush(Pilot *pilot, bool durable, Err *err) {
    return csv_flush(&pilot->record, durable, err);
}

bool pilot_close(Pilot *pilot, Err *err) {
    return csv_close(&pilot->record, err);
}

void pilot_report_left(const Pilot *pilot) {
    if (pilot->helm.next < pilot->script.count)
        log_write(LOG_INFO, "%s: what stands from line %d on comes after the end of the run", pilot->file,
                  pilot->script.events[pilot->helm.next].line);
}

void pilot_free(Pilot *pilot) {
    free(pilot->text);
    script_free(&pilot->script);
    *pilot = (Pilot){0};
}

/* ---- For pictures ---- */

void pilot_show(const Pilot *pilot, const SkiffSim *sim, FrameControls *controls) {
    Helm helm = pilot->helm;
    helm_advance(&helm, &pilot->script, skiff_time(sim));
    const HelmPosition position = helm_position(&helm);
    size_t used = 0;
    *controls = (FrameControls){.throttle = NAN, .rudder = NAN, .has_keys = pilot->text != NULL};
    if (skiff_drive_count(sim) > 0) {
        controls->throttle = position.throttle;
        controls->rudder = position.hold ? skiff_drive(sim, 0).rudder : position.rudder;
    }
    for (int k = 0; k < helm.key_count; k++) {
        const size_t length = strlen(helm.keys[k].key);
        if (!helm.held[k] || used + length + 2 > sizeof controls->keys)
            continue; /* hands hold few keys: more than the picture has room for are not shown */
        used += (size_t)snprintf(controls->keys + used, sizeof controls->keys - used, "%s%s",
                                 used > 0 ? " " : "", helm.keys[k].key);
    }
    snprintf(controls->camera, sizeof controls->camera, "%s", position.camera);
}
