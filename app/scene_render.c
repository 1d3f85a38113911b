/* The section "Render" of a scene file: cameras, materials, and how frames are drawn. */
#include "scene_rows.h"

#include <stdio.h>
#include <string.h>

SceneRender scene_render_default(void) {
    return (SceneRender){.fps = 30,
                         .width = 1280,
                         .height = 720,
                         .supersample = 1,
                         .field_min = NAN,
                         .field_max = NAN,
                         .hud = RENDER_HUD_ON,
                         .fade = true,
                         .fade_in = 0.3f,
                         .fade_out = 0.3f,
                         .fade_edge = 0.5f,
                         .ripples = 1,
                         .sun = {-0.5f, 0.6f, 0.45f}};
}

static void init_render(void *object) {
    *(SceneRender *)object = scene_render_default();
}

void scene_camera_default(SceneCamera *camera) {
    *camera = (SceneCamera){.distance = NAN,
                            .height = NAN,
                            .look_up = NAN,
                            .azimuth = NAN,
                            .period = NAN,
                            .smoothing = NAN,
                            .fov = NAN};
    set3(camera->eye, NAN, NAN, NAN);
    set3(camera->target, NAN, NAN, NAN);
    set3(camera->forward, NAN, NAN, NAN);
}

static void init_camera(void *object) {
    scene_camera_default(object);
}

static void init_material(void *object) {
    SceneMaterial *material = object;
    *material = (SceneMaterial){.waterline = NAN, .cabin_base = NAN, .cabin_top = NAN};
    set3(material->color, NAN, NAN, NAN);
}

static void check_sun(void *object, Problems *problems) {
    const SceneRender *render = object;
    if (render->sun[1] > 0)
        return;
    size_t mark = problems_enter(problems, "sun");
    problems_enter_index(problems, 1);
    problems_add(problems, "%g is not above 0: the sun is up", (double)render->sun[1]);
    problems_leave(problems, mark);
}

static void check_field_range(void *object, Problems *problems) {
    const SceneRender *render = object;
    if (!(render->field_min >= render->field_max))
        return;
    size_t mark = problems_enter(problems, "fieldMax");
    problems_add(problems, "%g is not above fieldMin, which is %g", (double)render->field_max,
                 (double)render->field_min);
    problems_leave(problems, mark);
}

static void check_forward(void *object, Problems *problems) {
    const SceneCamera *camera = object;
    if (!is_given(camera->forward) || camera->forward[0] != 0 || camera->forward[2] != 0)
        return;
    size_t mark = problems_enter(problems, "forward");
    problems_add(problems, "has no horizontal direction");
    problems_leave(problems, mark);
}

#define OPTIONAL_LENGTH .min = 1e-3, .max = 1e5, .unit = "m", .flags = FIELD_NULLABLE

static const Field camera_fields[] = {
    {ROW(FIELD_NAME, SceneCamera, name, "name"), .flags = FIELD_REQUIRED,
     .help = "For --camera and for `camera NAME` in an input script"},
    {ROW(FIELD_ENUM, SceneCamera, type, "type"), .names = RENDER_CAMERAS, .flags = FIELD_REQUIRED,
     .help = "Behind a body; still; circling it; above it; on board"},
    {ROW(FIELD_NAME, SceneCamera, body, "body"), .flags = FIELD_NULLABLE,
     .help = "That is followed; absent: the first dynamic one, or the middle of the scene (fixed: none)"},
    {ROW(FIELD_VEC3, SceneCamera, eye, "eye"), COORDINATE, .flags = FIELD_NULLABLE,
     .help = "fixed: in the world; bow: from the body's centre, along its axes"},
    {ROW(FIELD_VEC3, SceneCamera, target, "target"), COORDINATE, .flags = FIELD_NULLABLE,
     .help = "Point in the world that is looked at where no body is followed"},
    {ROW(FIELD_VEC3, SceneCamera, forward, "forward"), .min = -1e6, .max = 1e6, .flags = FIELD_NULLABLE,
     .help = "Direction of the body's bow in the world at the start; absent: of its drive, or where -x of "
             "its geometry points"},
    {ROW(FIELD_FLOAT, SceneCamera, distance, "distance"), OPTIONAL_LENGTH,
     .help = "chase, orbit: horizontal distance from the body; top: height above it"},
    {ROW(FIELD_FLOAT, SceneCamera, height, "height"), COORDINATE, .flags = FIELD_NULLABLE,
     .help = "chase, orbit: of the eye above the body's centre"},
    {ROW(FIELD_FLOAT, SceneCamera, look_up, "lookUp"), COORDINATE, .flags = FIELD_NULLABLE,
     .help = "chase, orbit: how far above the body's centre the camera aims"},
    {ROW(FIELD_FLOAT, SceneCamera, azimuth, "azimuth"), .min = -100, .max = 100, .unit = "rad",
     .flags = FIELD_NULLABLE,
     .help = "From +x towards +z. orbit: where it is at time 0; chase: how far off the line astern"},
    {ROW(FIELD_FLOAT, SceneCamera, period, "period"), .min = 0, .max = 1e6, .unit = "s",
     .flags = FIELD_NULLABLE, .help = "orbit: time for one turn; 0: it stands still"},
    {ROW(FIELD_FLOAT, SceneCamera, smoothing, "smoothing"), .min = 0, .max = 100, .unit = "s",
     .flags = FIELD_NULLABLE, .help = "Time in which nine tenths of a sudden change have been followed"},
    {ROW(FIELD_FLOAT, SceneCamera, fov, "fov"), .min = 5, .max = 150, .unit = "deg", .flags = FIELD_NULLABLE,
     .help = "Field of view, vertical"},
};

static const FieldRule camera_rules[] = {{"forward", check_forward}};

static const ObjectType camera_type = {
    .help = "A camera. Lengths that are absent follow from the size of what is looked at",
    .fields = camera_fields,
    .field_count = COUNT(camera_fields),
    .size = sizeof(SceneCamera),
    .init = init_camera,
    .rules = camera_rules,
    .rule_count = COUNT(camera_rules)};

static const Field material_fields[] = {
    {ROW(FIELD_NAME, SceneMaterial, name, "name"), .flags = FIELD_REQUIRED, .help = "Of a body"},
    {ROW(FIELD_ENUM, SceneMaterial, material, "material"), .names = "paint|hull|stone",
     .help = "hull: antifouling, stripe, topsides, wooden deck and cabin"},
    {ROW(FIELD_VEC3, SceneMaterial, color, "color"), .min = 0, .max = 1, .flags = FIELD_NULLABLE,
     .help = "Red, green and blue, linear; absent: the material's own"},
    {ROW(FIELD_FLOAT, SceneMaterial, waterline, "waterline"), COORDINATE, .flags = FIELD_NULLABLE,
     .help = "hull: y of the waterline at the start; absent: that of the water"},
    {ROW(FIELD_FLOAT, SceneMaterial, cabin_base, "cabinBase"), COORDINATE, .flags = FIELD_NULLABLE,
     .help = "hull: y at the start where the cabin begins; absent: there is none"},
    {ROW(FIELD_FLOAT, SceneMaterial, cabin_top, "cabinTop"), COORDINATE, .flags = FIELD_NULLABLE,
     .help = "hull: y at the start of the cabin's roof"},
};

static const ObjectType material_type = {.help = "What a body is made of",
                                         .fields = material_fields,
                                         .field_count = COUNT(material_fields),
                                         .size = sizeof(SceneMaterial),
                                         .init = init_material};

static const Field render_fields[] = {
    {ROW(FIELD_INT, SceneRender, fps, "fps"), .min = 1, .max = 1000, .unit = "1/s",
     .help = "Frames a second of simulated time; the step need not fit"},
    {ROW(FIELD_INT, SceneRender, width, "width"), .min = RENDER_SIZE_MIN, .max = RENDER_SIZE_MAX,
     .unit = "px", .help = "Of a frame"},
    {ROW(FIELD_INT, SceneRender, height, "height"), .min = RENDER_SIZE_MIN, .max = RENDER_SIZE_MAX,
     .unit = "px", .help = "Of a frame"},
    {ROW(FIELD_INT, SceneRender, supersample, "supersample"), .min = 1, .max = RENDER_SUPERSAMPLE_MAX,
     .help = "Drawn that many times larger, then averaged"},
    {ROW(FIELD_ENUM, SceneRender, look, "look"), .names = RENDER_LOOKS,
     .help = "A water surface, or spheres"},
    {ROW(FIELD_ENUM, SceneRender, field, "field"), .names = RENDER_FIELDS,
     .help = "Colour of the look particles; window: distance from the window's edge"},
    {ROW(FIELD_FLOAT, SceneRender, field_min, "fieldMin"), .min = -1e9, .max = 1e9, .flags = FIELD_NULLABLE,
     .help = "Value of the first colour; absent: one that suits the field"},
    {ROW(FIELD_FLOAT, SceneRender, field_max, "fieldMax"), .min = -1e9, .max = 1e9, .flags = FIELD_NULLABLE,
     .help = "Value of the last colour"},
    {ROW(FIELD_ENUM, SceneRender, hud, "hud"), .names = RENDER_HUDS,
     .help = "Figures in the picture; timing: with wall-clock times, which differ between runs"},
    {ROW(FIELD_BOOL, SceneRender, fade, "fade"),
     .help = "Created and removed particles fade, instead of popping in and out"},
    {ROW(FIELD_FLOAT, SceneRender, fade_in, "fadeIn"), .min = 0.001, .max = 10, .unit = "s",
     .help = "How long a created particle takes to appear"},
    {ROW(FIELD_FLOAT, SceneRender, fade_out, "fadeOut"), .min = 0.001, .max = 0.5, .unit = "s",
     .help = "How long a removed particle takes to vanish"},
    {ROW(FIELD_FLOAT, SceneRender, fade_edge, "fadeEdge"), .min = 0.001, .max = 100, .unit = "m",
     .help = "Distance from the window's edge over which the particles give way to the ocean"},
    {ROW(FIELD_FLOAT, SceneRender, ripples, "ripples"), .min = 0, .max = 2,
     .help = "Strength of the wind's ripples; 0 is glass"},
    {ROW(FIELD_VEC3, SceneRender, sun, "sun"), .min = -1e3, .max = 1e3,
     .help = "Direction towards the sun, any length; y above 0"},
    {ROW(FIELD_NAME, SceneRender, camera, "camera"), .flags = FIELD_NULLABLE,
     .help = "That begins: one of `cameras` or chase, fixed, orbit, top, bow, which always exist"},
    {ROW(FIELD_LIST, SceneRender, cameras, "cameras"), .max = 100, .object = &camera_type, .help = "Cameras"},
    {ROW(FIELD_LIST, SceneRender, bodies, "bodies"), .max = 10000, .object = &material_type,
     .help = "What bodies are made of; others have the colours of their meshes' materials, or a plain one"},
};

static const FieldRule render_rules[] = {{"sun", check_sun}, {"fieldMin|fieldMax", check_field_range}};

const ObjectType scene_render_type = {.help = "How frames are drawn. Present: `skiff run` draws them",
                                      .fields = render_fields,
                                      .field_count = COUNT(render_fields),
                                      .size = sizeof(SceneRender),
                                      .init = init_render,
                                      .rules = render_rules,
                                      .rule_count = COUNT(render_rules)};

static size_t append_name(char *out, size_t size, size_t length, const char *name, size_t width) {
    return length + (size_t)snprintf(out ? out + length : NULL, out ? size - length : 0, "%s%.*s",
                                     length > 0 ? "|" : "", (int)width, name);
}

static bool is_taken(const FieldList *cameras, const char *name, size_t width) {
    for (int i = 0; i < cameras->count; i++) {
        const char *other = ((const SceneCamera *)cameras->items)[i].name;
        if (strlen(other) == width && memcmp(other, name, width) == 0)
            return true;
    }
    return false;
}

size_t scene_camera_names(const SceneRender *render, char *out, size_t size) {
    const FieldList none = {0}, *list = render ? &render->cameras : &none;
    size_t length = 0;
    for (int i = 0; i < list->count; i++) {
        const char *name = ((const SceneCamera *)list->items)[i].name;
        length = append_name(out, size, length, name, strlen(name));
    }
    for (const char *kind = RENDER_CAMERAS; *kind;) {
        const size_t width = strcspn(kind, "|");
        if (!is_taken(list, kind, width))
            length = append_name(out, size, length, kind, width);
        kind += width + (kind[width] == '|');
    }
    return length;
}
