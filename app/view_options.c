/* Options on pictures. Any of them asks for pictures, so that none is ignored; `--no-render` with one of them
 * is a contradiction. */
#include "view_options.h"

#include <stdlib.h>
#include <string.h>

/* "640x360" */
static bool parse_pair(const char *text, char between, long least, long pair[2]) {
    char *end;
    pair[0] = strtol(text, &end, 10);
    if (end == text || *end != between)
        return false;
    const char *second = end + 1;
    pair[1] = strtol(second, &end, 10);
    return end != second && *end == '\0' && *second != '-' && *second != '+' && pair[0] >= least &&
           pair[1] >= least;
}

static bool set_size(const char *text, SceneRender *render, Err *err) {
    enum { LEAST = RENDER_SIZE_MIN, MOST = RENDER_SIZE_MAX };
    long pair[2];
    if (!parse_pair(text, 'x', LEAST, pair) || pair[0] > MOST || pair[1] > MOST)
        return err_set(err, ERR_USAGE, "--size: expected WIDTHxHEIGHT from %dx%d to %dx%d, found \"%.80s\"",
                       LEAST, LEAST, MOST, MOST, text);
    render->width = (int)pair[0];
    render->height = (int)pair[1];
    return true;
}

static bool set_frames(const char *text, ViewOptions *options, Err *err) {
    const long most = 10000000;
    long pair[2];
    if (!parse_pair(text, ':', 1, pair) || pair[1] < pair[0] || pair[1] > most)
        return err_set(err, ERR_USAGE,
                       "--frames: expected FIRST:LAST with 1 <= FIRST <= LAST <= %ld, found \"%.80s\"", most,
                       text);
    options->first = (int)pair[0];
    options->last = (int)pair[1];
    return true;
}

/* Does an option ask for pictures? --save-particles does not: it needs no GL. */
static const char *asked_by(const CliPictures *pictures) {
    return pictures->video             ? "--video"
           : pictures->frames          ? "--frames"
           : pictures->size            ? "--size"
           : pictures->camera          ? "--camera"
           : pictures->look >= 0       ? "--look"
           : pictures->field >= 0      ? "--field"
           : pictures->hud >= 0        ? "--hud"
           : pictures->fade >= 0       ? "--fade"
           : pictures->gl >= 0         ? "--gl"
           : pictures->fps > 0         ? "--fps"
           : pictures->supersample > 0 ? "--supersample"
           : pictures->render          ? "--render"
                                       : NULL;
}

bool view_options_make(ViewOptions *options, const CliArgs *args, const Scene *scene, Err *err) {
    const CliPictures *pictures = &args->pictures;
    const char *asked = asked_by(pictures);
    *options = (ViewOptions){.render = scene->render ? *scene->render : scene_render_default(), .first = 1};
    SceneRender *render = &options->render;
    if (pictures->no_render && asked)
        return err_set(err, ERR_USAGE, "--no-render and %s contradict each other", asked);
    options->draws = !pictures->no_render && (scene->render || asked);
    options->video = pictures->video;
    options->save_rate = pictures->save_particles;
    options->is_resumed = args->resume;
    options->keeps_camera = pictures->camera != NULL;
    options->backend = pictures->gl >= 0 ? pictures->gl : 0;
    render->fps = pictures->fps > 0 ? pictures->fps : render->fps;
    render->supersample = pictures->supersample > 0 ? pictures->supersample : render->supersample;
    render->look = pictures->look >= 0 ? pictures->look : render->look;
    render->field = pictures->field >= 0 ? pictures->field : render->field;
    render->hud = pictures->hud >= 0 ? pictures->hud : render->hud;
    render->fade = pictures->fade >= 0 ? pictures->fade == 1 : render->fade;
    render->camera = pictures->camera ? pictures->camera : render->camera;
    return (!pictures->size || set_size(pictures->size, render, err)) &&
           (!pictures->frames || set_frames(pictures->frames, options, err));
}

bool view_options_needed(const ViewOptions *options) {
    return options->draws || options->save_rate > 0;
}
