/* From a simulation, or from saved frames, to pictures: which frames are due, where the camera is, what
 * fades, what is white, what stands in the corner; the renderer does the rest.
 *
 * Frame n shows the time start + (n - 1) / fps, whatever the step. A drawn frame depends on the scene, the
 * options and the frames before it, not on the wall clock, unless the figures include it (--hud timing).
 *
 * Foam and smoothed cameras remember the frames before. view.skiff keeps that beside each checkpoint, so that
 * a resumed run draws the frames that it would have drawn. */
#include "view.h"

#include "foam.h"
#include "nearest.h"
#include "ocean.h"
#include "palette.h"
#include "shade.h"
#include "view_memory.h"

#include "engine/base/file.h"
#include "engine/base/log.h"
#include "render/gfx.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { PATH_SIZE = 4096, QUEUE_LENGTH = 4 };

typedef struct ViewCamera {
    const char *name;
    int body; /* that is followed; -1: none */
    GfxCameraDef def;
} ViewCamera;

/* A sequence of moments: number n lies at start + (n - 1) / rate. */
typedef struct Sequence {
    int rate; /* 1/s; 0: none */
    int next, last;
} Sequence;

struct View {
    ViewOptions options;
    const Scene *scene;
    char output[PATH_SIZE];
    double start; /* s */
    Sequence draw, save;
    int drawn;

    /* the picture */
    Gfx *gfx;
    GfxHud *hud;
    uint8_t *rgb;
    GfxWriter *writer;
    GfxVideo *video;

    /* what is in it */
    ViewCamera *cameras;
    GfxCameraState *states; /* of the cameras */
    int camera_count, camera;
    GfxInstance *instances; /* bodies, then the tank */
    uint32_t instance_count;
    int hero; /* the body that cameras follow and whose speed is shown; -1: none */
    Ocean ocean;
    bool has_tank;
    float floor; /* local y of the lowest water at the start, or of the tank */

    /* the moment */
    Frame frame;
    FrameBody *before; /* poses at the beginning of the step */
    double before_time, step_ms;
    Foam *foam;
    float *scalars; /* fade, foam and field of each particle */
    uint32_t scalar_capacity;
};

ViewControls view_controls_none(void) {
    return (ViewControls){.driven = {.throttle = NAN, .rudder = NAN}, .step_ms = NAN};
}

/* ---- What is looked at ---- */

typedef struct Bounds {
    double min[3], max[3];
} Bounds;

static const Bounds no_bounds = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};

static void grow(Bounds *bounds, const float point[3]) {
    for (int k = 0; k < 3; k++) {
        bounds->min[k] = fmin(bounds->min[k], (double)point[k]);
        bounds->max[k] = fmax(bounds->max[k], (double)point[k]);
    }
}

static Bounds bounds_of_points(const float (*points)[3], uint32_t count) {
    Bounds bounds = no_bounds;
    for (uint32_t i = 0; i < count; i++)
        grow(&bounds, points[i]);
    return bounds;
}

static Bounds bounds_of_water(const Frame *frame) {
    Bounds bounds = no_bounds;
    for (uint32_t i = 0; i < frame->live; i++)
        grow(&bounds, frame->position[i]);
    return bounds;
}

/* The tank, else the water, local. */
static Bounds bounds_of_scene(const SkiffSim *sim, const Frame *frame) {
    const float(*vertices)[3];
    const uint32_t(*triangles)[3];
    uint32_t vertex_count, triangle_count;
    skiff_tank_mesh(sim, &vertices, &vertex_count, &triangles, &triangle_count);
    return triangle_count > 0 ? bounds_of_points(vertices, vertex_count) : bounds_of_water(frame);
}

/* The first body that can move. */
static int find_hero(const SkiffDef *def) {
    for (int i = 0; i < def->body_count; i++)
        if (def->bodies[i].free_axes != 0)
            return i;
    return def->body_count > 0 ? 0 : -1;
}

static int find_body(const SkiffDef *def, const char *name) {
    for (int i = 0; i < def->body_count; i++)
        if (strcmp(def->bodies[i].name, name) == 0)
            return i;
    return -1;
}

static bool unknown_body(const View *view, const char *list, int index, const char *name, Err *err) {
    const SkiffDef *def = &view->scene->def;
    Nearest nearest = nearest_begin(name);
    for (int i = 0; i < def->body_count; i++)
        nearest_offer(&nearest, def->bodies[i].name);
    const char *best = nearest_result(&nearest);
    return err_set(err, ERR_INPUT, "%s: Render.%s[%d]: there is no body \"%s\"%s%s%s", view->scene->file,
                   list, index, name, best ? ", did you mean " : "", best ? best : "", best ? "?" : "");
}

/* ---- Cameras ---- */

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
static void suit_body(GfxCameraDef *def, const SkiffSim *sim, int body) {
    const float(*vertices)[3];
    const uint32_t(*triangles)[3];
    uint32_t vertex_count, triangle_count;
    skiff_body_mesh(sim, body, &vertices, &vertex_count, &triangles, &triangle_count);
    Bounds bounds = bounds_of_points(vertices, vertex_count);
    double length = fmax(bounds.max[0] - bounds.min[0], bounds.max[2] - bounds.min[2]);
    SkiffBody pose = skiff_body(sim, body);
    memcpy(def->target, pose.position, sizeof def->target);
    def->distance = (def->kind == GFX_CAMERA_TOP ? 3.2 : 1.95) * length;
    def->height = 0.72 * length;
    def->look_up = 0.22 * length;
    memcpy(def->eye, pose.position, sizeof def->eye);
    if (def->kind == GFX_CAMERA_BOW) {
        def->eye[0] = def->eye[2] = 0;
        def->eye[1] = bounds.max[1] + 0.08 * length;
    } else {
        def->eye[0] -= 1.4 * length;
        def->eye[1] += 0.8 * length;
        def->eye[2] += 1.8 * length;
    }
}

/* Everything in the picture, seen from in front and above. */
static void suit_scene(GfxCameraDef *def, const SkiffSim *sim, const Frame *frame, double aspect) {
    static const double from[3] = {0.35, 0.42, 0.8375}; /* of length 1 */
    static const double air = 1.12;
    Bounds bounds = bounds_of_scene(sim, frame);
    double half[3];
    for (int k = 0; k < 3; k++) {
        half[k] = 0.5 * (bounds.max[k] - bounds.min[k]);
        def->target[k] = frame->origin[k] + (isfinite(half[k]) ? bounds.min[k] + half[k] : 0);
        half[k] = isfinite(half[k]) ? fmax(half[k], (double)frame->spacing) : 1;
    }
    const double above[3] = {0, 1, 1e-9}; /* x to the right in the picture, as far as there is a choice */
    bool is_top = def->kind == GFX_CAMERA_TOP;
    double distance = air * gfx_camera_fit(half, is_top ? above : from, def->fov_deg, aspect);
    for (int k = 0; k < 3; k++)
        def->eye[k] = def->target[k] + distance * from[k];
    memcpy(def->forward, (const double[3]){is_top ? 0 : 1, 0, is_top ? -1 : 0}, sizeof def->forward);
    def->distance = is_top ? distance : distance * hypot(from[0], from[2]);
    def->height = distance * from[1];
    def->look_up = 0;
}

static bool add_camera(View *view, const SceneCamera *camera, int index, const SkiffSim *sim, Err *err) {
    const SkiffDef *scene = &view->scene->def;
    GfxCameraDef def = gfx_camera_default((GfxCameraKind)camera->type);
    int body = camera->body ? find_body(scene, camera->body) : -1;
    if (camera->body && body < 0)
        return unknown_body(view, "cameras", index, camera->body, err);
    bool stands = def.kind == GFX_CAMERA_FIXED && !camera->body;
    /* A body at sea is the subject; in a tank the water is. */
    int subject = camera->body                                           ? body
                  : def.kind == GFX_CAMERA_BOW || view->frame.has_window ? view->hero
                                                                         : -1;
    keep(&def.fov_deg, camera->fov);
    if (subject >= 0) {
        suit_body(&def, sim, subject);
        bow_of(scene, subject, def.forward);
    } else {
        suit_scene(&def, sim, &view->frame, (double)view->options.render.width / view->options.render.height);
    }
    def.follows = subject >= 0 && !(stands && !isnan(camera->target[0]));
    keep3(def.forward, camera->forward);
    keep3(def.eye, camera->eye);
    keep3(def.target, camera->target);
    keep(&def.distance, camera->distance);
    keep(&def.height, camera->height);
    keep(&def.look_up, camera->look_up);
    keep(&def.azimuth, camera->azimuth);
    keep(&def.period, camera->period);
    keep(&def.smoothing, camera->smoothing);
    view->cameras[view->camera_count++] = (ViewCamera){camera->name, subject, def};
    return true;
}

static int find_camera(const View *view, const char *name) {
    for (int i = 0; i < view->camera_count; i++)
        if (strcmp(view->cameras[i].name, name) == 0)
            return i;
    return -1;
}

static bool check_camera(const View *view, const char *name, Err *err) {
    if (find_camera(view, name) >= 0)
        return true;
    char list[1024] = "";
    for (int i = 0, used = 0; i < view->camera_count && used < (int)sizeof list; i++)
        used += snprintf(list + used, sizeof list - (size_t)used, "%s%s", i > 0 ? ", " : "",
                         view->cameras[i].name);
    return err_set(err, ERR_INPUT, "there is no camera \"%s\"; there are %s", name, list);
}

/* Those of the scene, then one of each kind under the name of the kind. */
static bool make_cameras(View *view, const SkiffSim *sim, Err *err) {
    static const char *const kinds[] = {"chase", "fixed", "orbit", "top", "bow"};
    enum { KINDS = sizeof kinds / sizeof *kinds };
    const SceneRender *render = &view->options.render;
    const SceneCamera *given = render->cameras.items;
    int count = render->cameras.count;
    view->cameras = calloc((size_t)count + KINDS, sizeof *view->cameras);
    view->states = calloc((size_t)count + KINDS, sizeof *view->states);
    if (!view->cameras || !view->states)
        return err_set(err, ERR_INPUT, "not enough memory for %d cameras", count);
    for (int i = 0; i < count; i++) {
        if (find_camera(view, given[i].name) >= 0)
            return err_set(err, ERR_INPUT, "%s: Render.cameras[%d]: the name \"%s\" is taken",
                           view->scene->file, i, given[i].name);
        if (!add_camera(view, &given[i], i, sim, err))
            return false;
    }
    for (int i = 0; i < KINDS; i++) {
        SceneCamera camera;
        scene_camera_default(&camera);
        camera.name = kinds[i];
        camera.type = i;
        if (find_camera(view, kinds[i]) < 0 && !add_camera(view, &camera, count + i, sim, err))
            return false;
    }
    const char *first = render->camera           ? render->camera
                        : count > 0              ? given[0].name
                        : view->frame.has_window ? "chase"
                                                 : "fixed";
    if (!check_camera(view, first, err)) {
        err_prefix(err, "%s", view->options.keeps_camera ? "--camera" : view->scene->file);
        if (view->options.keeps_camera && err)
            err->code = ERR_USAGE;
        return false;
    }
    view->camera = find_camera(view, first);
    return true;
}

static GfxPose pose_of(const FrameBody *body) {
    GfxPose pose;
    memcpy(pose.position, body->position, sizeof pose.position);
    memcpy(pose.rotation, body->rotation, sizeof pose.rotation);
    return pose;
}

/* Moves all cameras on, so that a cut finds each one where it would have been. */
static GfxCameraView move_cameras(View *view, const Frame *frame) {
    GfxCameraView current = {0};
    for (int i = 0; i < view->camera_count; i++) {
        ViewCamera *camera = &view->cameras[i];
        GfxPose pose = {.rotation = {0, 0, 0, 1}};
        if (camera->body >= 0)
            pose = pose_of(&frame->bodies[camera->body]);
        GfxCameraView seen =
            gfx_camera_update(&camera->def, &view->states[i], camera->body >= 0 ? &pose : NULL, frame->time);
        if (i == view->camera)
            current = seen;
    }
    return current;
}

static bool cut_to_camera(View *view, const char *name, Err *err) {
    if (!*name || view->options.keeps_camera)
        return true;
    if (!check_camera(view, name, err))
        return false;
    view->camera = find_camera(view, name);
    return true;
}

/* ---- Meshes ---- */

/* What the scene says a body is made of; NULL: nothing. */
static const SceneMaterial *find_material(const View *view, int body) {
    const FieldList *list = &view->options.render.bodies;
    const SceneMaterial *given = NULL;
    for (int i = 0; i < list->count; i++)
        if (strcmp(((const SceneMaterial *)list->items)[i].name, view->scene->def.bodies[body].name) == 0)
            given = (const SceneMaterial *)list->items + i;
    return given;
}

/* `height`: of the body's centre at the start; `level`: of the water, m. */
static GfxMaterial material_of(const SceneMaterial *given, bool is_fixed, double height, double level) {
    static const GfxMaterialKind kinds[] = {GFX_MATERIAL_PAINT, GFX_MATERIAL_HULL, GFX_MATERIAL_STONE};
    if (!given)
        return gfx_material_default(is_fixed ? GFX_MATERIAL_STONE : GFX_MATERIAL_PAINT);
    GfxMaterial material = gfx_material_default(kinds[given->material]);
    if (!isnan(given->color[0]))
        memcpy(material.color, given->color, sizeof material.color);
    material.waterline = (float)((isnan(given->waterline) ? level : (double)given->waterline) - height);
    bool cabin = !isnan(given->cabin_base) && !isnan(given->cabin_top);
    material.cabin_base = cabin ? (float)((double)given->cabin_base - height) : 0;
    material.cabin_top = cabin ? (float)((double)given->cabin_top - height) : 0;
    return material;
}

/* A colour for each triangle, by the names of the mesh's materials. NULL: it has none, or there is no memory;
 * malloc'ed. */
static uint8_t (*triangle_colors(const SkiffSim *sim, int body, uint32_t count))[3] {
    const uint8_t *materials = skiff_body_materials(sim, body);
    uint8_t(*colors)[3] = materials ? malloc(((size_t)count + 1) * sizeof *colors) : NULL;
    for (uint32_t t = 0; colors && t < count; t++)
        memcpy(colors[t], palette_color(skiff_body_material_name(sim, body, materials[t])), sizeof colors[t]);
    return colors;
}

static bool add_instance(View *view, const GfxMeshDef *mesh, Err *err) {
    int index = gfx_add_mesh(view->gfx, mesh, err);
    GfxInstance *instance = &view->instances[view->instance_count++];
    *instance = (GfxInstance){.mesh = index};
    for (int k = 0; k < 4; k++)
        instance->pose[5 * k] = 1;
    return index >= 0;
}

static bool make_meshes(View *view, const SkiffSim *sim, double level, Err *err) {
    const SceneMaterial *materials = view->options.render.bodies.items;
    int body_count = skiff_body_count(sim);
    for (int i = 0; i < view->options.render.bodies.count; i++)
        if (find_body(&view->scene->def, materials[i].name) < 0)
            return unknown_body(view, "bodies", i, materials[i].name, err);
    view->instances = calloc((size_t)body_count + 1, sizeof *view->instances);
    if (!view->instances)
        return err_set(err, ERR_INPUT, "not enough memory for %d bodies", body_count);
    GfxMeshDef mesh = {0};
    for (int i = 0; i < body_count; i++) {
        skiff_body_mesh(sim, i, &mesh.vertices, &mesh.vertex_count, &mesh.triangles, &mesh.triangle_count);
        const SceneMaterial *given = find_material(view, i);
        uint8_t(*colors)[3] = given ? NULL : triangle_colors(sim, i, mesh.triangle_count);
        bool is_fixed = view->scene->def.bodies[i].free_axes == 0 && !colors;
        mesh.material = material_of(given, is_fixed, skiff_body(sim, i).position[1], level);
        mesh.triangle_colors = (const uint8_t(*)[3])colors;
        bool added = add_instance(view, &mesh, err);
        free(colors);
        if (!added)
            return false;
    }
    mesh.triangle_colors = NULL;
    skiff_tank_mesh(sim, &mesh.vertices, &mesh.vertex_count, &mesh.triangles, &mesh.triangle_count);
    /* The walls around a window are none that one could see: the sea goes on behind them. */
    view->has_tank = mesh.triangle_count > 0 && !view->frame.has_window;
    mesh.material = gfx_material_default(GFX_MATERIAL_TANK);
    return !view->has_tank || add_instance(view, &mesh, err);
}

/* Column-major, own frame -> local. */
static void place_bodies(View *view, const Frame *frame) {
    for (int i = 0; i < frame->body_count; i++) {
        const double *q = frame->bodies[i].rotation, *p = frame->bodies[i].position;
        double x = q[0], y = q[1], z = q[2], w = q[3];
        const double m[16] = {1 - 2 * (y * y + z * z), 2 * (x * y + w * z),     2 * (x * z - w * y),     0,
                              2 * (x * y - w * z),     1 - 2 * (x * x + z * z), 2 * (y * z + w * x),     0,
                              2 * (x * z + w * y),     2 * (y * z - w * x),     1 - 2 * (x * x + y * y), 0,
                              p[0] - frame->origin[0], p[1] - frame->origin[1], p[2] - frame->origin[2], 1};
        for (int k = 0; k < 16; k++)
            view->instances[i].pose[k] = (float)m[k];
    }
}

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

static GfxOcean ocean_of(const View *view, const Frame *frame) {
    GfxOcean ocean = gfx_scene_default().ocean;
    ocean.ripples = view->options.render.ripples;
    if (view->ocean.window.distance)
        return sea_around(&view->ocean, frame, ocean);
    double sum = 0;
    for (uint32_t i = 0; i < frame->live; i++)
        sum += (double)frame->position[i][1];
    /* The mean lies half way between the floor and the surface of water at rest. */
    ocean.level = frame->live > 0 ? (float)(2 * sum / frame->live) - view->floor : view->floor;
    return ocean;
}

/* ---- What each particle shows ---- */

static bool reserve_scalars(View *view, uint32_t count, Err *err) {
    if (count <= view->scalar_capacity && view->scalars)
        return true;
    uint32_t capacity = count + count / 8 + 64;
    free(view->scalars);
    view->scalars = malloc(3 * (size_t)capacity * sizeof *view->scalars);
    view->scalar_capacity = view->scalars ? capacity : 0;
    return view->scalars || err_set(err, ERR_INPUT, "not enough memory to draw %u particles", count);
}

static GfxParticles particles_of(View *view, const Frame *frame) {
    float *fade = view->scalars, *foam = fade + view->scalar_capacity, *field = foam + view->scalar_capacity;
    shade_fade(&view->options.render, frame, view->start, fade);
    shade_field((RenderField)view->options.render.field, frame, field);
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

static void draw_figures(const View *view, const Frame *frame) {
    const SceneRender *render = &view->options.render;
    const FrameControls *driven = &frame->controls;
    if (!view->hud)
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
    if (view->hero >= 0 && (frame->has_window || !isnan(driven->throttle))) {
        const double *v = frame->bodies[view->hero].velocity;
        values.speed = hypot(v[0], v[2]);
    }
    values.has_legend = render->look == GFX_LOOK_PARTICLES;
    if (render->hud == RENDER_HUD_TIMING)
        values.step_ms = view->step_ms;
    gfx_hud_draw(view->hud, (GfxImage){view->rgb, render->width, render->height}, &values);
}

static bool draw(View *view, const Frame *frame, int number, Err *err) {
    char path[PATH_SIZE];
    if (!reserve_scalars(view, frame->count, err) ||
        !foam_update(view->foam, frame, view->scalars + view->scalar_capacity, err) ||
        !cut_to_camera(view, frame->controls.camera, err))
        return false;
    ocean_update(&view->ocean, &view->options.render, frame, view->scalars + view->scalar_capacity);
    GfxCameraView seen = move_cameras(view, frame);
    if (number < view->options.first)
        return true;
    GfxScene scene = gfx_scene_default();
    place_bodies(view, frame);
    scene.particles = particles_of(view, frame);
    scene.instances = view->instances;
    scene.instance_count = view->instance_count;
    scene.camera = local_camera(&seen, frame->origin, &scene.camera);
    scene.ocean = ocean_of(view, frame);
    ShadeLegend legend = shade_legend(&view->options.render);
    scene.field = (GfxField){legend.min, legend.max, legend.title, legend.unit};
    scene.ground = !scene.ocean.enabled && view->has_tank;
    scene.ground_level = view->floor;
    memcpy(scene.sun, view->options.render.sun, sizeof scene.sun);
    scene.time = frame->time;
    memcpy(scene.origin, frame->origin, sizeof scene.origin);
    if (!gfx_draw(view->gfx, &scene, view->rgb, err))
        return false;
    draw_figures(view, frame);
    view->drawn++;
    return gfx_writer_add(view->writer, frame_path(view->output, "frames", number, "png", sizeof path, path),
                          view->video, view->rgb, err);
}

/* ---- Life ---- */

static bool make_picture(View *view, const SkiffSim *sim, Err *err) {
    const SceneRender *render = &view->options.render;
    static const GfxBackend backends[] = {GFX_BACKEND_AUTO, GFX_BACKEND_EGL_DEVICE,
                                          GFX_BACKEND_EGL_SURFACELESS, GFX_BACKEND_OSMESA};
    static const GfxLook looks[] = {GFX_LOOK_WATER, GFX_LOOK_PARTICLES};
    GfxDef def = gfx_def_default();
    def.width = render->width;
    def.height = render->height;
    def.supersample = render->supersample;
    def.look = looks[render->look];
    def.backend = backends[view->options.backend];
    if (view->options.video && (def.width % 2 != 0 || def.height % 2 != 0))
        return err_set(err, ERR_USAGE, "--video: width and height must be even, found %dx%d", def.width,
                       def.height);
    if (view->options.video && !gfx_video_check(err))
        return false;
    view->gfx = gfx_create(&def, err);
    if (!view->gfx)
        return false;
    GfxInfo info = gfx_info(view->gfx);
    log_write(LOG_INFO, "OpenGL by %s: %s, %s (%s)", gfx_backend_name(info.backend), info.renderer,
              info.version, info.reason);
    Bounds bounds = bounds_of_scene(sim, &view->frame);
    view->floor = isfinite(bounds.min[1]) ? (float)bounds.min[1] : 0;
    double level = view->frame.has_window
                       ? view->frame.level
                       : (double)ocean_of(view, &view->frame).level + view->frame.origin[1];
    view->rgb = malloc((size_t)def.width * (size_t)def.height * 3);
    view->foam = foam_create();
    if (!view->rgb || !view->foam)
        return err_set(err, ERR_INPUT, "not enough memory for a picture of %dx%d", def.width, def.height);
    if (render->hud != RENDER_HUD_OFF && !(view->hud = gfx_hud_create(def.height, err)))
        return false;
    return make_cameras(view, sim, err) && make_meshes(view, sim, level, err) &&
           ocean_make(&view->ocean, &view->scene->def, sim, &view->frame, err);
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
    view->scene = scene;
    view->start = scene->def.start_time;
    view->before = before;
    view->step_ms = NAN;
    view->hero = find_hero(&scene->def);
    view->draw = (Sequence){options->draws ? options->render.fps : 0, 1, options->last};
    view->save = (Sequence){options->save_rate, 1, 0};
    if (!frame_capture(&view->frame, sim, NULL, 0, skiff_time(sim), err) ||
        (options->draws && !make_picture(view, sim, err))) {
        view_destroy(view);
        return NULL;
    }
    return view;
}

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
        view->step_ms = controls->step_ms;
        if ((saves && !save(view, view->save.next++, err)) ||
            (draw_time <= time + frame_time_tolerance && !draw(view, &view->frame, view->draw.next++, err)))
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

enum { CAMERA_SCALARS = sizeof(GfxCameraState) / sizeof(double) };
_Static_assert(sizeof(GfxCameraState) == 14 * sizeof(double), "it has no padding");

static const char *memory_path(const View *view, char path[PATH_SIZE]) {
    snprintf(path, PATH_SIZE, "%.4000s/view.skiff", view->output);
    return path;
}

static ViewMemory memory_of(View *view) {
    return (ViewMemory){.time = view->before_time,
                        .camera = view->camera,
                        .states = (double *)view->states,
                        .state_count = (uint64_t)view->camera_count * CAMERA_SCALARS,
                        .foam = view->foam,
                        .wake = &view->ocean.wake};
}

bool view_save(View *view, Err *err) {
    char path[PATH_SIZE];
    if (!view || !view->foam)
        return true;
    ViewMemory memory = memory_of(view);
    return view_memory_save(&memory, memory_path(view, path), err);
}

/* Without it the film goes on all the same. */
static void load_memory(View *view) {
    char path[PATH_SIZE];
    Err err = {0};
    ViewMemory memory = memory_of(view);
    if (!view_memory_load(&memory, memory_path(view, path), &err))
        log_write(LOG_WARNING, "foam and cameras begin anew: %s", err.message);
    else if (!view->options.keeps_camera && memory.camera >= 0 && memory.camera < view->camera_count)
        view->camera = memory.camera;
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
        if (view->foam)
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
    view->step_ms = NAN;
    return draw(view, frame, number, err);
}

int view_frame_count(const View *view) {
    return view->drawn;
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
    gfx_hud_destroy(view->hud);
    gfx_destroy(view->gfx);
    foam_destroy(view->foam);
    frame_free(&view->frame);
    free(view->rgb);
    free(view->cameras);
    free(view->states);
    free(view->instances);
    ocean_free(&view->ocean);
    free(view->before);
    free(view->scalars);
    free(view);
}
