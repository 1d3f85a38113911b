/* skiff render: the saved particles of a run, drawn again or converted.
 *
 * The run's own scene.json gives bodies, tank and the section "Render"; options change it as they do in a
 * run. With the options of the run and as many saved frames a second as drawn ones, the pictures are the
 * same, byte for byte. */
#include "commands.h"

#include "export.h"
#include "interrupt.h"
#include "progress.h"
#include "scene.h"
#include "view.h"

#include "engine/base/file.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { PATH_SIZE = 4096 };

typedef struct Redraw {
    const CliArgs *args;
    char output[PATH_SIZE];
    int last; /* number of the last saved frame */
    Scene *scene;
    SkiffSim *sim;
    View *view; /* NULL: export */
    ViewOptions options;
    Frame frame;
} Redraw;

static const char *saved_path(const Redraw *redraw, int number, char path[PATH_SIZE]) {
    return frame_path(redraw->args->operand, "particles", number, "skiff", PATH_SIZE, path);
}

static bool exports(const CliArgs *args) {
    return args->pictures.export >= 0;
}

static bool check_args(Redraw *redraw, Err *err) {
    const CliArgs *args = redraw->args;
    struct stat status;
    if (stat(args->operand, &status) != 0)
        return err_set(err, ERR_INPUT, "%s: cannot open: %s", args->operand, strerror(errno));
    if (!S_ISDIR(status.st_mode))
        return err_set(err, ERR_INPUT, "%s: is not the folder of a run", args->operand);
    if (args->output)
        snprintf(redraw->output, sizeof redraw->output, "%.4000s", args->output);
    else
        snprintf(redraw->output, sizeof redraw->output, "%.4000s/%s", args->operand,
                 exports(args) ? "export" : "redrawn");
    if (!cli_check_folder(args, redraw->output, err))
        return false;
    redraw->last = frames_last(args->operand, "particles", "skiff");
    if (redraw->last == 0)
        return err_set(err, ERR_INPUT,
                       "%s/particles: there are no saved particles; `skiff run` saves them with "
                       "--save-particles FPS",
                       args->operand);
    return file_check_directory(redraw->output, err);
}

/* The saved frames say how many of them a second there are; a film of them has that rate. */
static bool read_rate(Redraw *redraw, Err *err) {
    char path[PATH_SIZE];
    if (!frame_load(&redraw->frame, saved_path(redraw, 1, path), redraw->scene->def.body_count, err))
        return false;
    if (redraw->frame.rate != floor(redraw->frame.rate) || redraw->frame.rate > 1000)
        return err_set(err, ERR_INPUT, "%s: %g frames a second, expected an integer from 1 to 1000", path,
                       redraw->frame.rate);
    redraw->options.render.fps = (int)redraw->frame.rate;
    return true;
}

static bool begin(Redraw *redraw, Err *err) {
    char path[PATH_SIZE];
    const CliArgs *args = redraw->args;
    snprintf(path, sizeof path, "%.4000s/scene.json", args->operand);
    redraw->scene = scene_load(path, NULL, 0, err);
    if (!redraw->scene || !view_options_make(&redraw->options, args, redraw->scene, err) ||
        !read_rate(redraw, err))
        return false;
    redraw->options.draws = true;
    if (!exports(args)) {
        redraw->scene->def.sea.dry = true;
        redraw->sim = scene_start(redraw->scene, 0, SKIFF_SIMD_AUTO, err); /* for its meshes */
        if (!redraw->sim || !(redraw->view = view_create(&redraw->options, redraw->scene, redraw->sim, err)))
            return false;
    }
    if (!file_make_directory(redraw->output, err))
        return false;
    if (exports(args))
        return frames_remove_sequence(redraw->output, ".", export_suffix((ExportFormat)args->pictures.export),
                                      err);
    return frames_remove(redraw->output, err) && view_begin(redraw->view, NULL, NULL, redraw->output, err);
}

static bool handle_frame(Redraw *redraw, int number, Err *err) {
    char path[PATH_SIZE];
    if (!frame_load(&redraw->frame, saved_path(redraw, number, path), redraw->scene->def.body_count, err))
        return false;
    if (!exports(redraw->args))
        return view_saved(redraw->view, &redraw->frame, number, err);
    if (number < redraw->options.first)
        return true;
    ExportFormat format = (ExportFormat)redraw->args->pictures.export;
    frame_path(redraw->output, ".", number, export_suffix(format), sizeof path, path);
    return export_write(&redraw->frame, redraw->scene->def.params.rest_density, format, path, err);
}

static bool redraw_all(Redraw *redraw, Err *err) {
    int last =
        redraw->options.last > 0 && redraw->options.last < redraw->last ? redraw->options.last : redraw->last;
    bool shows = !redraw->args->quiet && isatty(STDERR_FILENO), ok = true;
    if (redraw->options.first > last)
        return err_set(err, ERR_USAGE, "--frames: there are %d saved frames", redraw->last);
    for (int number = 1; ok && number <= last && !interrupt_pending(); number++) {
        ok = handle_frame(redraw, number, err);
        if (shows)
            fprintf(stderr, "\r\033[Kframe %d of %d", number, last);
    }
    if (shows)
        fputs("\r\033[K", stderr);
    ok = ok && view_finish(redraw->view, err);
    if (ok && interrupt_pending())
        return err_set(err, ERR_INTERRUPTED, "skiff render: interrupted; the frames so far are in %s",
                       redraw->output);
    if (ok && !redraw->args->quiet)
        fprintf(stderr, "%d frames in %s\n", last - redraw->options.first + 1, redraw->output);
    return ok;
}

bool render_command(const CliArgs *args, Err *err) {
    Redraw redraw = {.args = args};
    if (!check_args(&redraw, err))
        return false;
    interrupt_hold();
    log_set_sink(progress_log, NULL, args->quiet ? LOG_WARNING : LOG_INFO);
    bool ok = begin(&redraw, err) && redraw_all(&redraw, err);
    log_set_sink(NULL, NULL, LOG_WARNING);
    view_destroy(redraw.view);
    frame_free(&redraw.frame);
    skiff_destroy(redraw.sim);
    scene_free(redraw.scene);
    return ok;
}
