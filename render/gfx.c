/* The public face of the renderer: checks what comes in, owns the context, hands over to frame.c. */
#include "gfx.h"

#include "context.h"
#include "frame.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

struct Gfx {
    Gl gl;
    Context *context;
    char vendor[128], renderer[256], version[128];
    Frame frame;
    Pass passes[FRAME_MAX_PASSES];
    GfxStats stats;
};

/* ---- Names ---- */

static const char *const backend_names[GFX_BACKEND_COUNT] = {"auto", "egl-device", "egl", "osmesa"};
static const char *const look_names[GFX_LOOK_COUNT] = {"water", "particles"};

const char *gfx_backend_name(GfxBackend backend) {
    return backend_names[backend];
}

const char *gfx_look_name(GfxLook look) {
    return look_names[look];
}

/* ---- Defaults ---- */

GfxDef gfx_def_default(void) {
    return (GfxDef){.width = 1280, .height = 720, .supersample = 1};
}

GfxMaterial gfx_material_default(GfxMaterialKind kind) {
    static const float colors[GFX_MATERIAL_COUNT][3] = {
        [GFX_MATERIAL_PAINT] = {0.72f, 0.72f, 0.70f},
        [GFX_MATERIAL_HULL] = {0.86f, 0.87f, 0.86f},
        [GFX_MATERIAL_STONE] = {0.55f, 0.53f, 0.49f},
        [GFX_MATERIAL_TANK] = {0.70f, 0.74f, 0.76f},
    };
    GfxMaterial material = {.kind = kind};
    memcpy(material.color, colors[kind], sizeof material.color);
    return material;
}

GfxScene gfx_scene_default(void) {
    return (GfxScene){
        .particles = {.spacing = 0.05f},
        .camera = {.eye = {-4.5f, 1.8f, 3.6f},
                   .up = {0.0f, 1.0f, 0.0f},
                   .fov_deg = 45.0f,
                   .near_plane = 0.1f,
                   .far_plane = 500.0f},
        .ocean = {.edge_size = {2, 2}, .blend = {0.15f, 0.7f}, .ripples = 1.0f},
        .field = {.max = 1.0f},
        .sun = {0.65f, 0.50f, -0.45f},
    };
}

/* ---- Checks ---- */

static bool check_def(const GfxDef *def, Err *err) {
    int limit = GFX_SIZE_MAX;
    if (def->supersample < 1 || def->supersample > GFX_SUPERSAMPLE_MAX)
        return err_set(err, ERR_USAGE, "supersample is %d; possible are 1 to %d", def->supersample,
                       GFX_SUPERSAMPLE_MAX);
    limit /= def->supersample;
    if (def->width < GFX_SIZE_MIN || def->width > limit || def->height < GFX_SIZE_MIN || def->height > limit)
        return err_set(err, ERR_USAGE, "the image is %d x %d; with supersample %d possible are %d to %d",
                       def->width, def->height, def->supersample, GFX_SIZE_MIN, limit);
    if ((unsigned)def->look >= GFX_LOOK_COUNT || (unsigned)def->backend >= GFX_BACKEND_COUNT)
        return err_set(err, ERR_USAGE, "unknown look %d or way to OpenGL %d", (int)def->look,
                       (int)def->backend);
    return true;
}

static bool all_finite(const float *values, int count) {
    for (int i = 0; i < count; i++)
        if (!isfinite(values[i]))
            return false;
    return true;
}

static bool check_camera(const GfxCamera *camera, Err *err) {
    float view[3], cross[3], view_sq = 0.0f, up_sq = 0.0f, cross_sq = 0.0f;
    const float *up = camera->up;
    if (!all_finite(camera->eye, 3) || !all_finite(camera->target, 3) || !all_finite(up, 3))
        return err_set(err, ERR_USAGE, "camera: a coordinate is not finite");
    for (int k = 0; k < 3; k++)
        view[k] = camera->target[k] - camera->eye[k];
    for (int k = 0; k < 3; k++) {
        cross[k] = view[(k + 1) % 3] * up[(k + 2) % 3] - view[(k + 2) % 3] * up[(k + 1) % 3];
        view_sq += view[k] * view[k];
        up_sq += up[k] * up[k];
        cross_sq += cross[k] * cross[k];
    }
    if (!(cross_sq > 1e-10f * view_sq * up_sq))
        return err_set(err, ERR_USAGE, "camera: the view has no length, or up points along it");
    if (!(camera->fov_deg >= 1.0f && camera->fov_deg <= 150.0f))
        return err_set(err, ERR_USAGE, "camera: field of view %g deg; possible are 1 to 150",
                       (double)camera->fov_deg);
    if (!(camera->near_plane > 0.0f && camera->near_plane < camera->far_plane && isfinite(camera->far_plane)))
        return err_set(err, ERR_USAGE, "camera: near plane %g m, far plane %g m; needed is 0 < near < far",
                       (double)camera->near_plane, (double)camera->far_plane);
    return true;
}

/* Samples over an area: numbers of them and bounds along x and z. */
static bool check_samples(const char *what, const uint32_t size[2], const float min[2], const float max[2],
                          Err *err) {
    for (int k = 0; k < 2; k++) {
        if (size[k] < 2 || size[k] > 4096)
            return err_set(err, ERR_USAGE, "ocean: %u %s along %c; possible are 2 to 4096", size[k], what,
                           "xz"[k]);
        if (!(max[k] > min[k]) || !isfinite(max[k]) || !isfinite(min[k]))
            return err_set(err, ERR_USAGE, "ocean: %s lie between %c = %g and %g m", what, "xz"[k],
                           (double)min[k], (double)max[k]);
    }
    return true;
}

static bool check_ocean(const GfxOcean *ocean, Err *err) {
    if (!isfinite(ocean->level) || !(ocean->ripples >= 0.0f && ocean->ripples <= 2.0f))
        return err_set(err, ERR_USAGE, "ocean: level %g m, ripples %g; needed are a finite level and 0 to 2",
                       (double)ocean->level, (double)ocean->ripples);
    if (!ocean->enabled)
        return true;
    if (!ocean->edge_distance)
        return err_set(err, ERR_USAGE, "ocean: no distances to the window's edge");
    if (!check_samples("edge distances", ocean->edge_size, ocean->edge_min, ocean->edge_max, err) ||
        (ocean->foam &&
         !check_samples("amounts of foam", ocean->foam_size, ocean->foam_min, ocean->foam_max, err)))
        return false;
    if (!(ocean->blend[0] >= 0.0f && ocean->blend[0] < ocean->blend[1]))
        return err_set(err, ERR_USAGE, "ocean: blend from %g to %g m; needed is 0 <= from < to",
                       (double)ocean->blend[0], (double)ocean->blend[1]);
    return true;
}

static bool check_scene(const Gfx *gfx, const GfxScene *scene, Err *err) {
    const float *sun = scene->sun;
    if (!check_camera(&scene->camera, err) || !check_ocean(&scene->ocean, err))
        return false;
    if (scene->particles.count > 0 && !scene->particles.position)
        return err_set(err, ERR_USAGE, "particles: no positions");
    if (!(scene->particles.spacing > 0.0f && scene->particles.spacing < 1e3f))
        return err_set(err, ERR_USAGE, "particles: spacing %g m; needed is 0 to 1000",
                       (double)scene->particles.spacing);
    if (!all_finite(sun, 3) || !(sun[1] > 0.0f))
        return err_set(err, ERR_USAGE, "sun: direction (%g, %g, %g); it must point up", (double)sun[0],
                       (double)sun[1], (double)sun[2]);
    if (!(scene->field.min < scene->field.max) || !all_finite(&scene->field.min, 1) ||
        !all_finite(&scene->field.max, 1))
        return err_set(err, ERR_USAGE, "field: range %g to %g is empty", (double)scene->field.min,
                       (double)scene->field.max);
    if (!isfinite(scene->time) || !isfinite(scene->origin[0]) || !isfinite(scene->origin[1]) ||
        !isfinite(scene->origin[2]) || !isfinite(scene->ground_level))
        return err_set(err, ERR_USAGE, "time, origin or ground level is not finite");
    for (uint32_t i = 0; i < scene->instance_count; i++) {
        if (scene->instances[i].mesh < 0 || scene->instances[i].mesh >= gfx->frame.meshes.count)
            return err_set(err, ERR_USAGE, "instance %u shows mesh %d; there are %d", i,
                           scene->instances[i].mesh, gfx->frame.meshes.count);
        if (!all_finite(scene->instances[i].pose, 16))
            return err_set(err, ERR_USAGE, "instance %u: the pose is not finite", i);
    }
    return true;
}

/* ---- Life ---- */

static void copy_string(const Gl *gl, GLenum name, char *out, size_t size) {
    const GLubyte *text = gl->GetString(name);
    snprintf(out, size, "%s", text ? (const char *)text : "unknown");
}

Gfx *gfx_create(const GfxDef *def, Err *err) {
    if (!check_def(def, err))
        return NULL;
    Gfx *gfx = calloc(1, sizeof *gfx);
    if (!gfx) {
        err_set(err, ERR_GL, "no memory for the renderer");
        return NULL;
    }
    gfx->context = context_open(def->backend, &gfx->gl, err);
    if (!gfx->context) {
        free(gfx);
        return NULL;
    }
    copy_string(&gfx->gl, GL_VENDOR, gfx->vendor, sizeof gfx->vendor);
    copy_string(&gfx->gl, GL_RENDERER, gfx->renderer, sizeof gfx->renderer);
    copy_string(&gfx->gl, GL_VERSION, gfx->version, sizeof gfx->version);
    gfx->frame.gl = &gfx->gl;
    gfx->frame.def = *def;
    gfx->frame.width = def->width * def->supersample;
    gfx->frame.height = def->height * def->supersample;
    if (frame_create(&gfx->frame, gfx->passes, err))
        return gfx;
    gfx_destroy(gfx);
    return NULL;
}

void gfx_destroy(Gfx *gfx) {
    if (!gfx)
        return;
    if (context_make_current(gfx->context, NULL))
        frame_destroy(&gfx->frame, gfx->passes);
    context_close(gfx->context);
    free(gfx);
}

GfxInfo gfx_info(const Gfx *gfx) {
    return (GfxInfo){context_backend(gfx->context), gfx->vendor, gfx->renderer, gfx->version,
                     context_reason(gfx->context)};
}

int gfx_add_mesh(Gfx *gfx, const GfxMeshDef *def, Err *err) {
    if (!context_make_current(gfx->context, err))
        return -1;
    return mesh_store_add(&gfx->frame.meshes, &gfx->gl, def, err);
}

/* ---- Drawing ---- */

bool gfx_draw(Gfx *gfx, const GfxScene *scene, uint8_t *rgb, Err *err) {
    struct timespec start, end;
    if (!check_scene(gfx, scene, err) || !context_make_current(gfx->context, err))
        return false;
    clock_gettime(CLOCK_MONOTONIC, &start);
    Frame *frame = &gfx->frame;
    frame->scene = scene;
    frame->rgb = rgb;
    bool ok = frame_draw(frame, gfx->passes, &gfx->stats, err);
    frame->scene = NULL;
    frame->rgb = NULL;
    clock_gettime(CLOCK_MONOTONIC, &end);
    gfx->stats.total_ms =
        1e3 * (double)(end.tv_sec - start.tv_sec) + 1e-6 * (double)(end.tv_nsec - start.tv_nsec);
    gfx->stats.particles_drawn = frame->surface.body.count + frame->surface.fading.count;
    gfx->stats.droplets = frame->surface.droplets.count;
    return ok;
}

int gfx_pass_count(void) {
    return frame_pass_count();
}

const char *gfx_pass_name(int pass) {
    return frame_pass_type(pass)->name;
}

GfxStats gfx_stats(const Gfx *gfx) {
    return gfx->stats;
}

bool gfx_pass_image(Gfx *gfx, int pass, uint8_t *rgb, Err *err) {
    if (pass < 0 || pass >= frame_pass_count())
        return err_set(err, ERR_USAGE, "pass %d; there are %d", pass, frame_pass_count());
    const PassType *type = frame_pass_type(pass);
    if (type->image < 0 || !(type->looks & 1u << gfx->frame.def.look))
        return err_set(err, ERR_USAGE, "pass %s leaves no picture in the look %s", type->name,
                       gfx_look_name(gfx->frame.def.look));
    return context_make_current(gfx->context, err) &&
           images_show(&gfx->frame, (ImageId)type->image, rgb, err);
}
