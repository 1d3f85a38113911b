/* Distances and heights that a scene does not give suit what is looked at: a body, or all that is there. */
#include "view_cameras.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Where the body's bow points at the start, world axes: along the axis of its drive, or where boats without
 * one point, to -x in their own frame [Carensac2023]. */
static void bow_of(const SkiffDef *def, int body, double bow[3]) {
    const SkiffGeometryDef *geometry = &def->bodies[body].geometry;
    const SkiffDriveDef *drive = def->bodies[body].drive;
    double own[3] = {-1, 0, 0};
    for (int k = 0; drive && k < 3; k++)
        own[k] = (double)drive->axis[k];
    double axis[3], half = 0.5 * (double)geometry->rotation_angle, length = 0;
    for (int k = 0; k < 3; k++) {
        axis[k] = (double)geometry->rotation_axis[k];
        length += axis[k] * axis[k];
    }
    double scale = length > 0 ? sin(half) / sqrt(length) : 0;
    const double q[4] = {scale * axis[0], scale * axis[1], scale * axis[2], length > 0 ? cos(half) : 1};
    gfx_camera_rotate(q, own, bow);
    if (hypot(bow[0], bow[2]) < 1e-6 * fabs(bow[1])) /* upright: any course will do */
        bow[0] = 1;
}

static void keep(double *value, float given) {
    if (!isnan(given))
        *value = (double)given;
}

static void keep3(double value[3], const float given[3]) {
    for (int k = 0; k < 3 && !isnan(given[0]); k++)
        value[k] = (double)given[k];
}

/* Lengths that suit a body: `length` horizontal, `top` above its centre. */
static void suit_body(GfxCameraDef *def, const Subject *subject, int body) {
    Extent extent = view_subject_body_extent(subject, body);
    double length = fmax(extent.max[0] - extent.min[0], extent.max[2] - extent.min[2]);
    SkiffBody pose = skiff_body(subject->sim, body);
    memcpy(def->target, pose.position, sizeof def->target);
    def->distance = (def->kind == GFX_CAMERA_TOP ? 3.2 : 1.95) * length;
    def->height = 0.72 * length;
    def->look_up = 0.22 * length;
    memcpy(def->eye, pose.position, sizeof def->eye);
    if (def->kind == GFX_CAMERA_BOW) {
        def->eye[0] = def->eye[2] = 0;
        def->eye[1] = extent.max[1] + 0.08 * length;
    } else {
        def->eye[0] -= 1.4 * length;
        def->eye[1] += 0.8 * length;
        def->eye[2] += 1.8 * length;
    }
}

/* Everything in the picture, seen from in front and above. */
static void suit_scene(GfxCameraDef *def, const Subject *subject) {
    static const double from[3] = {0.35, 0.42, 0.8375}; /* of length 1 */
    static const double air = 1.12;
    const SceneRender *render = &subject->options->render;
    const Frame *frame = subject->frame;
    Extent extent = view_subject_extent(subject);
    double half[3];
    for (int k = 0; k < 3; k++) {
        half[k] = 0.5 * (extent.max[k] - extent.min[k]);
        def->target[k] = frame->origin[k] + (isfinite(half[k]) ? extent.min[k] + half[k] : 0);
        half[k] = isfinite(half[k]) ? fmax(half[k], (double)frame->spacing) : 1;
    }
    const double above[3] = {0, 1, 1e-9}; /* x to the right in the picture, as far as there is a choice */
    bool is_top = def->kind == GFX_CAMERA_TOP;
    double distance = air * gfx_camera_fit(half, is_top ? above : from, def->fov_deg,
                                           (double)render->width / render->height);
    for (int k = 0; k < 3; k++)
        def->eye[k] = def->target[k] + distance * from[k];
    memcpy(def->forward, (const double[3]){is_top ? 0 : 1, 0, is_top ? -1 : 0}, sizeof def->forward);
    def->distance = is_top ? distance : distance * hypot(from[0], from[2]);
    def->height = distance * from[1];
    def->look_up = 0;
}

static bool add_camera(Cameras *cameras, const Subject *subject, const SceneCamera *camera, int index,
                       Err *err) {
    const SkiffDef *scene = &subject->scene->def;
    GfxCameraDef def = gfx_camera_default((GfxCameraKind)camera->type);
    int body = camera->body ? view_subject_find(scene, camera->body) : -1;
    if (camera->body && body < 0)
        return view_subject_unknown(subject->scene, "cameras", index, camera->body, err);
    bool stands = def.kind == GFX_CAMERA_FIXED && !camera->body;
    /* A body at sea is the subject; in a tank the water is. */
    int followed = camera->body                                               ? body
                   : def.kind == GFX_CAMERA_BOW || subject->frame->has_window ? view_subject_hero(scene)
                                                                              : -1;
    keep(&def.fov_deg, camera->fov);
    if (followed >= 0) {
        suit_body(&def, subject, followed);
        bow_of(scene, followed, def.forward);
    } else {
        suit_scene(&def, subject);
    }
    def.follows = followed >= 0 && !(stands && !isnan(camera->target[0]));
    keep3(def.forward, camera->forward);
    keep3(def.eye, camera->eye);
    keep3(def.target, camera->target);
    keep(&def.distance, camera->distance);
    keep(&def.height, camera->height);
    keep(&def.look_up, camera->look_up);
    keep(&def.azimuth, camera->azimuth);
    keep(&def.period, camera->period);
    keep(&def.smoothing, camera->smoothing);
    cameras->items[cameras->count++] = (Camera){camera->name, followed, def};
    return true;
}

static int find_camera(const Cameras *cameras, const char *name) {
    for (int i = 0; i < cameras->count; i++)
        if (strcmp(cameras->items[i].name, name) == 0)
            return i;
    return -1;
}

static bool check_camera(const Cameras *cameras, const char *name, Err *err) {
    if (find_camera(cameras, name) >= 0)
        return true;
    char list[1024] = "";
    for (int i = 0, used = 0; i < cameras->count && used < (int)sizeof list; i++)
        used += snprintf(list + used, sizeof list - (size_t)used, "%s%s", i > 0 ? ", " : "",
                         cameras->items[i].name);
    return err_set(err, ERR_INPUT, "there is no camera \"%s\"; there are %s", name, list);
}

bool view_cameras_make(Cameras *cameras, const Subject *subject, Err *err) {
    enum { KINDS = GFX_CAMERA_KIND_COUNT };
    const SceneRender *render = &subject->options->render;
    const SceneCamera *given = render->cameras.items;
    int count = render->cameras.count;
    *cameras = (Cameras){.stays = subject->options->keeps_camera};
    cameras->items = calloc((size_t)count + KINDS, sizeof *cameras->items);
    cameras->states = calloc((size_t)count + KINDS, sizeof *cameras->states);
    if (!cameras->items || !cameras->states)
        return err_set(err, ERR_INPUT, "not enough memory for %d cameras", count);
    for (int i = 0; i < count; i++) {
        if (find_camera(cameras, given[i].name) >= 0)
            return err_set(err, ERR_INPUT, "%s: Render.cameras[%d]: the name \"%s\" is taken",
                           subject->scene->file, i, given[i].name);
        if (!add_camera(cameras, subject, &given[i], i, err))
            return false;
    }
    const char *kind = gfx_camera_kinds;
    for (int i = 0; i < KINDS; i++) {
        SceneCamera camera;
        const int width = (int)strcspn(kind, "|");
        scene_camera_default(&camera);
        snprintf(cameras->kinds[i], sizeof cameras->kinds[i], "%.*s", width, kind);
        kind += width + (kind[width] == '|');
        camera.name = cameras->kinds[i];
        camera.type = i;
        if (find_camera(cameras, camera.name) < 0 && !add_camera(cameras, subject, &camera, count + i, err))
            return false;
    }
    const char *first = render->camera               ? render->camera
                        : count > 0                  ? given[0].name
                        : subject->frame->has_window ? "chase"
                                                     : "fixed";
    if (!check_camera(cameras, first, err)) {
        err_prefix(err, "%s", cameras->stays ? "--camera" : subject->scene->file);
        if (cameras->stays && err)
            err->code = ERR_USAGE;
        return false;
    }
    cameras->current = find_camera(cameras, first);
    return true;
}

static GfxPose pose_of(const FrameBody *body) {
    GfxPose pose;
    memcpy(pose.position, body->position, sizeof pose.position);
    memcpy(pose.rotation, body->rotation, sizeof pose.rotation);
    return pose;
}

GfxCameraView view_cameras_move(Cameras *cameras, const Frame *frame) {
    GfxCameraView current = {0};
    for (int i = 0; i < cameras->count; i++) {
        const Camera *camera = &cameras->items[i];
        GfxPose pose = {.rotation = {0, 0, 0, 1}};
        if (camera->body >= 0)
            pose = pose_of(&frame->bodies[camera->body]);
        GfxCameraView seen = gfx_camera_update(&camera->def, &cameras->states[i],
                                               camera->body >= 0 ? &pose : NULL, frame->time);
        if (i == cameras->current)
            current = seen;
    }
    return current;
}

bool view_cameras_cut(Cameras *cameras, const char *name, Err *err) {
    if (!*name || cameras->stays)
        return true;
    if (!check_camera(cameras, name, err))
        return false;
    cameras->current = find_camera(cameras, name);
    return true;
}

void view_cameras_free(Cameras *cameras) {
    free(cameras->items);
    free(cameras->states);
    *cameras = (Cameras){0};
}
