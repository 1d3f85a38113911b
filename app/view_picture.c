/* Gathers what stands in a picture - particles with what each one shows, bodies, the sea around, the camera,
 * figures in the corner -; the renderer does the rest. */
#include "view_picture.h"

#include "foam.h"
#include "ocean.h"
#include "shade.h"
#include "view_cameras.h"
#include "view_memory.h"
#include "view_models.h"

#include "engine/base/log.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Scenes and options allow what the renderer does. */
_Static_assert((int)RENDER_SIZE_MIN == (int)GFX_SIZE_MIN && (int)RENDER_SIZE_MAX == (int)GFX_SIZE_MAX &&
                   (int)RENDER_SUPERSAMPLE_MAX == (int)GFX_SUPERSAMPLE_MAX,
               "limits of scene_table.h");

struct Picture {
    const SceneRender *render;
    double start; /* s */

    /* what draws */
    Gfx *gfx;
    GfxHud *hud; /* NULL: no figures */

    /* what is in it */
    Cameras cameras;
    Models models;
    Ocean ocean;
    Foam *foam;
    int hero;    /* whose speed is shown; -1: nobody's */
    float floor; /* local y of the lowest water at the start, or of the tank, m */

    /* the moment */
    GfxCameraView seen;
    float *scalars; /* fade, foam and field of each particle */
    uint32_t scalar_capacity;
};

/* ---- The water around ---- */

static GfxOcean sea_around(const Ocean *sea, const Frame *frame, GfxOcean ocean) {
    const EdgeMap *window = &sea->window;
    const Wake *wake = &sea->wake;
    ocean.enabled = true;
    ocean.level = (float)(frame->level - frame->origin[1]);
    ocean.edge_distance = window->distance;
    ocean.foam = wake->amount;
    memcpy(ocean.blend, sea->band, sizeof ocean.blend);
    for (int k = 0; k < 2; k++) {
        ocean.edge_size[k] = window->size[k];
        ocean.edge_min[k] = window->min[k] + sea->shift[k];
        ocean.edge_max[k] = window->max[k] + sea->shift[k];
        ocean.foam_size[k] = WAKE_EDGE;
        ocean.foam_min[k] = (float)(wake->base[k] * (double)wake->cell - frame->origin[2 * k]);
        ocean.foam_max[k] = ocean.foam_min[k] + (WAKE_EDGE - 1) * wake->cell;
    }
    return ocean;
}

static GfxOcean ocean_of(const Picture *picture, const Frame *frame) {
    GfxOcean ocean = gfx_scene_default().ocean;
    ocean.ripples = picture->render->ripples;
    if (picture->ocean.window.distance)
        return sea_around(&picture->ocean, frame, ocean);
    double sum = 0;
    for (uint32_t i = 0; i < frame->live; i++)
        sum += (double)frame->position[i][1];
    /* The mean lies half way between the floor and the surface of water at rest. */
    ocean.level = frame->live > 0 ? (float)(2 * sum / frame->live) - picture->floor : picture->floor;
    return ocean;
}

/* ---- What each particle shows ---- */

static bool reserve_scalars(Picture *picture, uint32_t count, Err *err) {
    if (count <= picture->scalar_capacity && picture->scalars)
        return true;
    uint32_t capacity = count + count / 8 + 64;
    free(picture->scalars);
    picture->scalars = malloc(3 * (size_t)capacity * sizeof *picture->scalars);
    picture->scalar_capacity = picture->scalars ? capacity : 0;
    return picture->scalars || err_set(err, ERR_INPUT, "not enough memory to draw %u particles", count);
}

static GfxParticles particles_of(const Picture *picture, const Frame *frame) {
    float *fade = picture->scalars, *foam = fade + picture->scalar_capacity,
          *field = foam + picture->scalar_capacity;
    shade_fade(picture->render, frame, picture->start, fade);
    shade_field((RenderField)picture->render->field, frame, field);
    return (GfxParticles){.count = frame->count,
                          .spacing = frame->spacing,
                          .position = (const float(*)[4])frame->position,
                          .velocity = (const float(*)[4])frame->velocity,
                          .fade = fade,
                          .foam = foam,
                          .field = field,
                          .id = frame->id};
}

/* ---- One picture ---- */

static GfxCamera local_camera(const GfxCameraView *seen, const double origin[3], const GfxCamera *defaults) {
    GfxCamera camera = *defaults;
    for (int k = 0; k < 3; k++) {
        camera.eye[k] = (float)(seen->eye[k] - origin[k]);
        camera.target[k] = (float)(seen->target[k] - origin[k]);
        camera.up[k] = (float)seen->up[k];
    }
    camera.fov_deg = (float)seen->fov_deg;
    return camera;
}

static void draw_figures(const Picture *picture, const Frame *frame, double step_ms, uint8_t *rgb) {
    const SceneRender *render = picture->render;
    const FrameControls *driven = &frame->controls;
    if (!picture->hud)
        return;
    GfxHudValues values = gfx_hud_nothing();
    values.time = frame->time;
    values.particles = frame->live;
    values.throttle = driven->throttle;
    values.rudder = driven->rudder;
    if (driven->has_keys)
        values.keys = driven->keys;
    if (frame->has_window)
        values.moves = (long)frame->moves;
    if (picture->hero >= 0 && (frame->has_window || !isnan(driven->throttle))) {
        const double *v = frame->bodies[picture->hero].velocity;
        values.speed = hypot(v[0], v[2]);
    }
    values.has_legend = render->look == GFX_LOOK_PARTICLES;
    if (render->hud == RENDER_HUD_TIMING)
        values.step_ms = step_ms;
    gfx_hud_draw(picture->hud, (GfxImage){rgb, render->width, render->height}, &values);
}

bool view_picture_advance(Picture *picture, const Frame *frame, Err *err) {
    if (!reserve_scalars(picture, frame->count, err))
        return false;
    float *foam = picture->scalars + picture->scalar_capacity;
    if (!foam_update(picture->foam, frame, foam, err) ||
        !view_cameras_cut(&picture->cameras, frame->controls.camera, err))
        return false;
    ocean_update(&picture->ocean, picture->render, frame, foam);
    picture->seen = view_cameras_move(&picture->cameras, frame);
    return true;
}

bool view_picture_draw(Picture *picture, const Frame *frame, double step_ms, uint8_t *rgb, Err *err) {
    GfxScene scene = gfx_scene_default();
    view_models_place(&picture->models, frame);
    scene.particles = particles_of(picture, frame);
    scene.instances = picture->models.instances;
    scene.instance_count = picture->models.count;
    scene.camera = local_camera(&picture->seen, frame->origin, &scene.camera);
    scene.ocean = ocean_of(picture, frame);
    ShadeLegend legend = shade_legend(picture->render);
    scene.field = (GfxField){legend.min, legend.max, legend.title, legend.unit};
    scene.ground = !scene.ocean.enabled && picture->models.has_tank;
    scene.ground_level = picture->floor;
    memcpy(scene.sun, picture->render->sun, sizeof scene.sun);
    scene.time = frame->time;
    memcpy(scene.origin, frame->origin, sizeof scene.origin);
    if (!gfx_draw(picture->gfx, &scene, rgb, err))
        return false;
    draw_figures(picture, frame, step_ms, rgb);
    return true;
}

/* ---- What must outlive an interruption ---- */

enum { CAMERA_SCALARS = sizeof(GfxCameraState) / sizeof(double) };
_Static_assert(sizeof(GfxCameraState) == 14 * sizeof(double), "it has no padding");

static ViewMemory memory_of(Picture *picture, double time) {
    return (ViewMemory){.time = time,
                        .camera = picture->cameras.current,
                        .states = (double *)picture->cameras.states,
                        .state_count = (uint64_t)picture->cameras.count * CAMERA_SCALARS,
                        .foam = picture->foam,
                        .wake = &picture->ocean.wake};
}

bool view_picture_save(Picture *picture, double time, const char *path, Err *err) {
    ViewMemory memory = memory_of(picture, time);
    return view_memory_save(&memory, path, err);
}

bool view_picture_load(Picture *picture, double time, const char *path, Err *err) {
    Cameras *cameras = &picture->cameras;
    ViewMemory memory = memory_of(picture, time);
    if (!view_memory_load(&memory, path, err))
        return false;
    if (!cameras->stays && memory.camera >= 0 && memory.camera < cameras->count)
        cameras->current = memory.camera;
    return true;
}

/* ---- Life ---- */

static bool make_gfx(Picture *picture, const ViewOptions *options, Err *err) {
    const SceneRender *render = picture->render;
    GfxDef def = gfx_def_default();
    def.width = render->width;
    def.height = render->height;
    def.supersample = render->supersample;
    def.look = (GfxLook)render->look;
    def.backend = (GfxBackend)options->backend;
    picture->gfx = gfx_create(&def, err);
    if (!picture->gfx)
        return false;
    GfxInfo info = gfx_info(picture->gfx);
    log_write(LOG_INFO, "OpenGL by %s: %s, %s (%s)", gfx_backend_name(info.backend), info.renderer,
              info.version, info.reason);
    picture->foam = foam_create();
    if (!picture->foam)
        return err_set(err, ERR_INPUT, "not enough memory for the foam");
    return render->hud == RENDER_HUD_OFF || (picture->hud = gfx_hud_create(def.height, err));
}

static bool make_content(Picture *picture, const Subject *subject, Err *err) {
    const Frame *frame = subject->frame;
    Extent extent = view_subject_extent(subject);
    picture->floor = isfinite(extent.min[1]) ? (float)extent.min[1] : 0;
    double level =
        frame->has_window ? frame->level : (double)ocean_of(picture, frame).level + frame->origin[1];
    return view_cameras_make(&picture->cameras, subject, err) &&
           view_models_make(&picture->models, subject, picture->gfx, level, err) &&
           ocean_make(&picture->ocean, &subject->scene->def, subject->sim, frame, err);
}

Picture *view_picture_create(const Subject *subject, Err *err) {
    Picture *picture = calloc(1, sizeof *picture);
    if (!picture) {
        err_set(err, ERR_INPUT, "not enough memory for pictures");
        return NULL;
    }
    picture->render = &subject->options->render;
    picture->start = subject->scene->def.start_time;
    picture->hero = view_subject_hero(&subject->scene->def);
    if (!make_gfx(picture, subject->options, err) || !make_content(picture, subject, err)) {
        view_picture_destroy(picture);
        return NULL;
    }
    return picture;
}

void view_picture_destroy(Picture *picture) {
    if (!picture)
        return;
    gfx_hud_destroy(picture->hud);
    gfx_destroy(picture->gfx);
    foam_destroy(picture->foam);
    view_cameras_free(&picture->cameras);
    view_models_free(&picture->models);
    ocean_free(&picture->ocean);
    free(picture->scalars);
    free(picture);
}
