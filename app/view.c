/* Which frames of a simulation, or of saved particles, are due, and where they go.
 *
 * Frame n shows the time start + (n - 1) / fps, whatever the step. A drawn frame depends on the scene, the
 * options and the frames before it, not on the wall clock, unless the figures include it (--hud timing).
 *
 * Foam and smoothed cameras remember the frames before. view.skiff keeps that beside each checkpoint, so that
 * a resumed run draws the frames that it would have drawn. */
#include "view.h"

#include "shade.h"
#include "view_picture.h"

#include "engine/base/file.h"
#include "engine/base/log.h"
#include "render/gfx.h"

#include <math.h>
#include <stdlib.h>

enum { PATH_SIZE = 4096, QUEUE_LENGTH = 4 };

/* A sequence of moments: number n lies at start + (n - 1) / rate. */
typedef struct Sequence {
    int rate; /* 1/s; 0: none */
    int next, last;
} Sequence;

struct View {
    ViewOptions options;
    char output[PATH_SIZE];
    double start; /* s */
    Sequence draw, save;

    Picture *picture; /* NULL: nothing is drawn */
    uint8_t *rgb;     /* the frame that is drawn, or was before an interruption */
    GfxWriter *writer;
    GfxVideo *video;

    Frame frame;
    FrameBody *before; /* poses at the beginning of the step */
    double before_time;
};

ViewControls view_controls_none(void) {
    return (ViewControls){.driven = {.throttle = NAN, .rudder = NAN}, .step_ms = NAN};
}

/* ---- What is due ---- */

static double time_of(const View *view, const Sequence *sequence) {
    bool is_over = sequence->rate == 0 || (sequence->last > 0 && sequence->next > sequence->last);
    return is_over ? INFINITY : view->start + (double)(sequence->next - 1) / sequence->rate;
}

static bool save(View *view, int number, Err *err) {
    char path[PATH_SIZE];
    view->frame.rate = view->save.rate;
    return frame_save(&view->frame, frame_path(view->output, "particles", number, "skiff", sizeof path, path),
                      err);
}

static bool draw(View *view, const Frame *frame, int number, double step_ms, Err *err) {
    char path[PATH_SIZE];
    if (!view_picture_advance(view->picture, frame, err))
        return false;
    if (number < view->options.first)
        return true;
    if (!view_picture_draw(view->picture, frame, step_ms, view->rgb, err))
        return false;
    return gfx_writer_add(view->writer, frame_path(view->output, "frames", number, "png", sizeof path, path),
                          view->video, view->rgb, err);
}

/* Draws and saves all that is due by now. */
static bool catch_up(View *view, const SkiffSim *sim, const FrameBody *before, const ViewControls *controls,
                     Err *err) {
    for (;;) {
        double draw_time = time_of(view, &view->draw), save_time = time_of(view, &view->save);
        double time = fmin(draw_time, save_time);
        if (!(time <= skiff_time(sim) + frame_time_tolerance))
            return true;
        bool saves = save_time <= time + frame_time_tolerance;
        bool needs_pressure = saves || shade_needs_pressure(&view->options.render);
        if (!frame_capture(&view->frame, sim, before, view->before_time, time, err) ||
            (needs_pressure && !frame_capture_pressure(&view->frame, sim, err)))
            return false;
        view->frame.controls = controls->driven;
        if ((saves && !save(view, view->save.next++, err)) ||
            (draw_time <= time + frame_time_tolerance &&
             !draw(view, &view->frame, view->draw.next++, controls->step_ms, err)))
            return false;
    }
}

/* Puts the frames before the first one to be drawn into the film. */
static bool add_old_frames(View *view, Err *err) {
    const SceneRender *render = &view->options.render;
    char path[PATH_SIZE];
    int first = view->options.first;
    for (int i = first; i < view->draw.next; i++)
        if (!file_exists(frame_path(view->output, "frames", i, "png", sizeof path, path))) {
            log_write(LOG_WARNING, "%s: there is no such frame; video.mp4 begins where the run goes on",
                      path);
            return true;
        }
    for (int i = first; i < view->draw.next; i++)
        if (!gfx_png_read(frame_path(view->output, "frames", i, "png", sizeof path, path), view->rgb,
                          render->width, render->height, err) ||
            !gfx_writer_add(view->writer, NULL, view->video, view->rgb, err))
            return false;
    return true;
}

/* ---- What must outlive an interruption ---- */

static const char *memory_path(const View *view, char path[PATH_SIZE]) {
    snprintf(path, PATH_SIZE, "%.4000s/view.skiff", view->output);
    return path;
}

bool view_save(View *view, Err *err) {
    char path[PATH_SIZE];
    if (!view || !view->picture)
        return true;
    return view_picture_save(view->picture, view->before_time, memory_path(view, path), err);
}

/* Without it the film goes on all the same. */
static void load_memory(View *view) {
    char path[PATH_SIZE];
    Err err = {0};
    if (!view_picture_load(view->picture, view->before_time, memory_path(view, path), &err))
        log_write(LOG_WARNING, "foam and cameras begin anew: %s", err.message);
}

/* ---- Life ---- */

static bool make_picture(View *view, const Subject *subject, Err *err) {
    const SceneRender *render = &view->options.render;
    if (view->options.video && (render->width % 2 != 0 || render->height % 2 != 0))
        return err_set(err, ERR_USAGE, "--video: width and height must be even, found %dx%d", render->width,
                       render->height);
    if (view->options.video && !gfx_video_check(err))
        return false;
    view->rgb = malloc((size_t)render->width * (size_t)render->height * 3);
    if (!view->rgb)
        return err_set(err, ERR_INPUT, "not enough memory for a picture of %dx%d", render->width,
                       render->height);
    view->picture = view_picture_create(subject, err);
    return view->picture != NULL;
}

View *view_create(const ViewOptions *options, const Scene *scene, const SkiffSim *sim, Err *err) {
    View *view = calloc(1, sizeof *view);
    FrameBody *before = calloc((size_t)skiff_body_count(sim) + 1, sizeof *before);
    if (!view || !before) {
        err_set(err, ERR_INPUT, "not enough memory for pictures");
        free(view);
        free(before);
        return NULL;
    }
    view->options = *options;
    view->start = scene->def.start_time;
    view->before = before;
    view->draw = (Sequence){options->draws ? options->render.fps : 0, 1, options->last};
    view->save = (Sequence){options->save_rate, 1, 0};
    if (!frame_capture(&view->frame, sim, NULL, 0, skiff_time(sim), err) ||
        (options->draws && !make_picture(view, &(Subject){&view->options, scene, sim, &view->frame}, err))) {
        view_destroy(view);
        return NULL;
    }
    return view;
}

static void skip_to(const View *view, Sequence *sequence, double time) {
    while (time_of(view, sequence) <= time + frame_time_tolerance)
        sequence->next++;
}

bool view_begin(View *view, const SkiffSim *sim, const ViewControls *controls, const char *output, Err *err) {
    const SceneRender *render = &view->options.render;
    char path[PATH_SIZE];
    snprintf(view->output, sizeof view->output, "%.4000s", output);
    if (view->save.rate > 0) {
        snprintf(path, sizeof path, "%.4000s/particles", output);
        if (!file_make_directory(path, err))
            return false;
    }
    if (view->draw.rate > 0) {
        snprintf(path, sizeof path, "%.4000s/frames", output);
        view->writer = file_make_directory(path, err)
                           ? gfx_writer_begin(render->width, render->height, QUEUE_LENGTH, err)
                           : NULL;
        snprintf(path, sizeof path, "%.4000s/video.mp4", output);
        if (!view->writer ||
            (view->options.video &&
             !(view->video = gfx_video_begin(path, render->width, render->height, render->fps, err))))
            return false;
    }
    if (!sim)
        return true;
    frame_poses(sim, view->before);
    view->before_time = skiff_time(sim);
    if (view->options.is_resumed) {
        if (view->picture)
            load_memory(view);
        skip_to(view, &view->draw, skiff_time(sim));
        skip_to(view, &view->save, skiff_time(sim));
        return !view->video || add_old_frames(view, err);
    }
    return catch_up(view, sim, NULL, controls, err);
}

bool view_step(View *view, const SkiffSim *sim, const ViewControls *controls, Err *err) {
    if (!catch_up(view, sim, view->before, controls, err))
        return false;
    frame_poses(sim, view->before);
    view->before_time = skiff_time(sim);
    return true;
}

bool view_saved(View *view, const Frame *frame, int number, Err *err) {
    return draw(view, frame, number, NAN, err);
}

bool view_finish(View *view, Err *err) {
    if (!view)
        return true;
    bool ok = gfx_writer_finish(view->writer, err);
    view->writer = NULL;
    if (view->video && ok)
        ok = gfx_video_finish(view->video, err);
    else
        gfx_video_abort(view->video);
    view->video = NULL;
    return ok;
}

void view_destroy(View *view) {
    if (!view)
        return;
    gfx_writer_finish(view->writer, NULL);
    gfx_video_abort(view->video);
    view_picture_destroy(view->picture);
    frame_free(&view->frame);
    free(view->rgb);
    free(view->before);
    free(view);
}
