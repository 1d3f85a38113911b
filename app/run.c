/* skiff run: scene in, folder of results out. The order of events:
 *
 *   read and check everything -> make the folder -> the game loop -> checkpoint, summary, trace, report
 *
 * Nothing is written before the scene has become a simulation and the input file is understood. What the
 * folder holds is run_folder.c's business. */
#include "commands.h"

#include "interrupt.h"
#include "run_folder.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double flush_period = 1.0; /* s of wall time */

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
    return scene_load(args->operand, edits, count, err);
}

/* ---- The game loop ---- */

static bool draw_frames(Run *run, Err *err) {
    ViewControls controls = view_controls_none();
    controls.step_ms = skiff_stats(run->sim)->step_ms;
    if (run->view)
        pilot_show(&run->pilot, run->sim, &controls.driven);
    return !run->view || view_step(run->view, run->sim, &controls, err);
}

static bool after_step(Run *run, Err *err) {
    tables_add(&run->tables, run->sim);
    if (!draw_frames(run, err))
        return false;
    progress_step(&run->progress, run->sim);
    double now = run->progress.last;
    if (now >= run->next_flush) {
        if (!run_flush(run, false, err))
            return false;
        run->next_flush = now + flush_period;
    }
    if (now >= run->next_checkpoint) {
        if (!run_checkpoint(run, err))
            return false;
        run->next_checkpoint = progress_clock() + run->args->checkpoint_every;
    }
    return true;
}

static bool is_finished(const Run *run) {
    return skiff_time(run->sim) + 0.5 * (double)skiff_params(run->sim)->time_step >= run->end_time;
}

/* A fixed step; the controls are sampled before each, whatever is drawn when.
 * True: at the end or interrupted. False: diverged (the message says where) or a file could not be written.
 */
static bool step_to_end(Run *run, Err *err) {
    double now = progress_clock();
    run->progress = progress_begin(skiff_time(run->sim), run->end_time, run->args->quiet);
    run->next_flush = now + flush_period;
    run->next_checkpoint = now + run->args->checkpoint_every;
    bool ok = true;
    while (ok && !is_finished(run) && !interrupt_pending())
        ok = pilot_step(&run->pilot, run->sim, err) && skiff_step(run->sim, err) && after_step(run, err);
    progress_clear(&run->progress);
    return ok;
}

/* ---- Ending ---- */

static bool end_diverged(Run *run, Err *err) {
    Err other = {0};
    RunEnd end = {"diverged", err->message};
    if (!view_finish(run->view, &other) || !run_keep_diverged(run, &other) || !run_close(run, &other) ||
        !run_write_results(run, &end, &other))
        err_add(err, ERR_DIVERGED, "%s", other.message);
    else
        err_add(err, ERR_DIVERGED, "the state is in %s/diverged.skiff", run->args->output);
    return false;
}

static bool end_normally(Run *run, Err *err) {
    bool interrupted = !is_finished(run);
    RunEnd end = {interrupted ? "interrupted" : "finished", ""};
    if (!interrupted)
        pilot_report_left(&run->pilot);
    if (!view_finish(run->view, err) || !run_checkpoint(run, err) || !run_close(run, err) ||
        !run_write_results(run, &end, err))
        return false;
    return !interrupted ||
           err_set(err, ERR_INTERRUPTED, "skiff run: interrupted; add --resume to go on from here");
}

/* Warnings of the engine stand on lines of their own, not in the line of progress. */
static bool make_view(Run *run, Err *err) {
    ViewOptions options;
    if (!view_options_make(&options, run->args, run->scene, err))
        return false;
    if (!view_options_needed(&options))
        return true;
    run->view = view_create(&options, run->scene, run->sim, err);
    return run->view ||
           (err->code == ERR_GL ? err_add(err, ERR_GL, "--no-render simulates without pictures") : false);
}

static bool run_scene(Run *run, Err *err) {
    interrupt_hold();
    log_set_sink(progress_log, &run->progress, LOG_INFO);
    run->scene = load_scene(run->args, err);
    const char *folder = run->args->resume ? run->args->output : NULL;
    if (!run->scene || (folder && !run_check_resume(run, err)) ||
        !pilot_read(&run->pilot, run->scene, run->args->input, folder, err))
        return false;
    run->sim = scene_start(run->scene, run->args->threads, (SkiffSimd)run->args->simd, err);
    if (!run->sim)
        return false;
    if (interrupt_pending())
        return err_set(err, ERR_INTERRUPTED,
                       "skiff run: interrupted before the first step; nothing was written");
    if (!make_view(run, err))
        return false;
    run->end_time = run->scene->def.start_time + run->scene->duration;
    if (!run_begin(run, err))
        return false;
    if (step_to_end(run, err))
        return end_normally(run, err);
    return err->code == ERR_DIVERGED ? end_diverged(run, err) : false;
}

bool run_command(const CliArgs *args, Err *err) {
    Run run = {.args = args};
    if (!run_check_args(args, err))
        return false;
    bool ok = run_scene(&run, err);
    log_set_sink(NULL, NULL, LOG_WARNING);
    run_close(&run, NULL);
    pilot_free(&run.pilot);
    view_destroy(run.view);
    skiff_destroy(run.sim);
    scene_free(run.scene);
    return ok;
}
