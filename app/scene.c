/* From a scene file to a SkiffDef: JSON -> edits of the command line -> tables (scene_table.c) -> def. */
#include "scene.h"

#include "scene_rows.h"

#include "engine/base/file.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_SCENE_SIZE = 64 << 20, MAX_EDITS = 256, EDIT_PATH_SIZE = PROBLEMS_PATH_SIZE };

/* What the public struct keeps alive. */
typedef struct SceneContent {
    json_t *document; /* texts point into it */
    Pool pool;
    SceneFile file;
} SceneContent;

/* ---- Tables to def ---- */

static SkiffGeometryDef placed(const ScenePlacement *placement) {
    SkiffGeometryDef geometry = skiff_geometry_default();
    memcpy(geometry.scale, placement->scale, sizeof geometry.scale);
    memcpy(geometry.translation, placement->translation, sizeof geometry.translation);
    memcpy(geometry.rotation_axis, placement->rotation_axis, sizeof geometry.rotation_axis);
    geometry.rotation_angle = placement->rotation_angle;
    return geometry;
}

static void set_round(SkiffGeometryDef *geometry, SkiffGeometryKind kind, const SceneRound *round) {
    geometry->kind = kind;
    geometry->radius = round->radius;
    geometry->inner_radius = round->inner_radius;
    geometry->top_radius = round->top_radius;
    geometry->height = round->height;
    geometry->branches = round->branches;
}

static SkiffTankDef tank_def(const SceneTank *tank, Pool *pool) {
    static const SkiffGeometryKind rounds[] = {[SCENE_TANK_SPHERE] = SKIFF_GEOMETRY_SPHERE,
                                               [SCENE_TANK_CYLINDER] = SKIFF_GEOMETRY_CYLINDER,
                                               [SCENE_TANK_STAR] = SKIFF_GEOMETRY_STAR,
                                               [SCENE_TANK_CONE] = SKIFF_GEOMETRY_CONE};
    SkiffTankDef def = {
        .geometry = placed(&tank->placement), .open = tank->open, .wet_height = tank->wet_height};
    SkiffGeometryDef *geometry = &def.geometry;
    if (tank->type == SCENE_TANK_MESH) {
        geometry->kind = SKIFF_GEOMETRY_MESH;
        geometry->file = tank->file;
    } else if (tank->type == SCENE_TANK_BOX) {
        geometry->kind = SKIFF_GEOMETRY_BOX;
        for (int k = 0; k < 3; k++) {
            geometry->size[k] = tank->max[k] - tank->min[k];
            geometry->translation[k] = 0.5f * (tank->min[k] + tank->max[k]);
        }
    } else if (tank->type != SCENE_TANK_PLANES) {
        set_round(geometry, rounds[tank->type], &tank->round);
    } else {
        size_t count = (size_t)tank->planes.count;
        const ScenePlane *planes = tank->planes.items;
        float(*points)[3] = pool_alloc(pool, count * sizeof *points);
        float(*normals)[3] = pool_alloc(pool, count * sizeof *normals);
        for (size_t i = 0; i < count; i++) {
            memcpy(points[i], planes[i].point, sizeof points[i]);
            memcpy(normals[i], planes[i].normal, sizeof normals[i]);
        }
        geometry->kind = SKIFF_GEOMETRY_PLANES;
        geometry->plane_points = (const float(*)[3])points;
        geometry->plane_normals = (const float(*)[3])normals;
        geometry->plane_count = tank->planes.count;
    }
    return def;
}

static SkiffBodyDef body_def(const SceneBody *body) {
    SkiffBodyDef def = skiff_body_default();
    def.name = body->name;
    def.geometry = placed(&body->placement);
    if (body->file) {
        def.geometry.kind = SKIFF_GEOMETRY_MESH;
        def.geometry.file = body->file;
    } else if (!isnan(body->sphere)) {
        def.geometry.kind = SKIFF_GEOMETRY_SPHERE;
        def.geometry.radius = body->sphere;
    } else if (body->cylinder) {
        set_round(&def.geometry, SKIFF_GEOMETRY_CYLINDER, body->cylinder);
    } else if (body->star) {
        set_round(&def.geometry, SKIFF_GEOMETRY_STAR, body->star);
    } else if (body->cone) {
        set_round(&def.geometry, SKIFF_GEOMETRY_CONE, body->cone);
    } else {
        def.geometry.kind = SKIFF_GEOMETRY_BOX;
        memcpy(def.geometry.size, body->box, sizeof def.geometry.size);
    }
    if (isnan(body->mass)) {
        def.density = body->density;
        def.mass = 0;
    } else {
        def.mass = body->mass;
    }
    memcpy(def.velocity, body->velocity, sizeof def.velocity);
    memcpy(def.angular_velocity, body->angular_velocity, sizeof def.angular_velocity);
    def.free_axes = body->free_axes;
    def.release_time = body->release_time;
    if (!isnan(body->stop_time))
        def.stop_time = body->stop_time;
    def.ramp_time = body->ramp_time;
    def.drive = body->drive;
    return def;
}

static SkiffProbeDef probe_def(const SceneProbe *probe) {
    SkiffProbeDef def = skiff_probe_default();
    def.name = probe->name;
    def.kind = (SkiffProbeKind)probe->type;
    memcpy(def.point, probe->point, sizeof def.point);
    def.radius = probe->radius;
    def.object = probe->object;
    def.has_region = !isnan(probe->min[0]);
    if (def.has_region) {
        memcpy(def.min, probe->min, sizeof def.min);
        memcpy(def.max, probe->max, sizeof def.max);
    }
    return def;
}

/* Where water at rest is kept between runs: $SKIFF_CACHE, else the user's cache; NULL: nowhere. */
static const char *cache_folder(Pool *pool) {
    const char *own = getenv("SKIFF_CACHE"), *cache = getenv("XDG_CACHE_HOME"), *home = getenv("HOME");
    if (own)
        return *own ? own : NULL;
    if (!(cache && *cache) && !(home && *home))
        return NULL;
    const bool user = cache && *cache;
    const char *base = user ? cache : home, *rest = user ? "/skiff" : "/.cache/skiff";
    char *folder = pool_alloc(pool, strlen(base) + strlen(rest) + 1);
    strcpy(folder, base);
    return strcat(folder, rest);
}

static SkiffSeaDef sea_def(const SceneSea *sea, Pool *pool) {
    SkiffSeaDef def = {.on = true,
                       .level = sea->level,
                       .follow = sea->follow,
                       .path_count = sea->path.count,
                       .absorb = sea->absorb,
                       .has_region = is_given(sea->absorb_min),
                       .cache = cache_folder(pool)};
    _Static_assert(sizeof(ScenePathPoint) == sizeof(double[3]), "a point of the path is three numbers");
    def.path = sea->path.items;
    memcpy(def.region_min, sea->absorb_min, sizeof def.region_min);
    memcpy(def.region_max, sea->absorb_max, sizeof def.region_max);
    return def;
}

static void fill_def(Scene *scene) {
    Pool *pool = &scene->content->pool;
    const SceneFile *file = &scene->content->file;
    const SceneConfiguration *configuration = file->configuration;
    SkiffDef *def = &scene->def;
    *def = skiff_def_default();
    def->params = configuration->params;
    def->start_time = configuration->start_time;
    def->has_domain = !isnan(configuration->domain_min[0]);
    if (def->has_domain) {
        memcpy(def->domain_min, configuration->domain_min, sizeof def->domain_min);
        memcpy(def->domain_max, configuration->domain_max, sizeof def->domain_max);
    }
    if (file->tank)
        def->tank = tank_def(file->tank, pool);
    if (file->sea)
        def->sea = sea_def(file->sea, pool);
    SkiffBodyDef *bodies = pool_alloc(pool, (size_t)file->bodies.count * sizeof *bodies);
    for (int i = 0; i < file->bodies.count; i++)
        bodies[i] = body_def((const SceneBody *)file->bodies.items + i);
    SkiffProbeDef *probes = pool_alloc(pool, (size_t)file->probes.count * sizeof *probes);
    for (int i = 0; i < file->probes.count; i++)
        probes[i] = probe_def((const SceneProbe *)file->probes.items + i);
    def->blocks = file->blocks.items;
    def->block_count = file->blocks.count;
    def->bodies = bodies;
    def->body_count = file->bodies.count;
    def->probes = probes;
    def->probe_count = file->probes.count;
    scene->title = file->title;
    scene->input = file->input;
    scene->keys = file->keys.items;
    scene->key_count = file->keys.count;
    scene->duration = configuration->duration;
    scene->probe_rate = configuration->probe_rate;
    scene->render = file->render;
    const size_t size = scene_camera_names(file->render, NULL, 0) + 1;
    char *cameras = pool_alloc(pool, size);
    scene_camera_names(file->render, cameras, size);
    scene->cameras = cameras;
}

/* ---- Reading ---- */

static json_t *parse_document(const char *file, const char *text, size_t size, Err *err) {
    json_error_t error;
    json_t *document = json_loadb(text, size, JSON_REJECT_DUPLICATES | JSON_DECODE_ANY, &error);
    if (!document) {
        char what[JSON_ERROR_TEXT_LENGTH];
        problems_quote(what, sizeof what, error.text);
        err_set(err, ERR_INPUT, "%s:%d:%d: not valid JSON: %s", file, error.line, error.column, what);
    } else if (!json_is_object(document)) {
        err_set(err, ERR_INPUT, "%s: expected an object with \"version\": 1", file);
        json_decref(document);
        document = NULL;
    }
    return document;
}

static char *folder_of(const char *file, Pool *pool) {
    const char *slash = strrchr(file, '/');
    size_t count = slash ? (size_t)(slash - file) : 1;
    char *folder = pool_alloc(pool, count + 1);
    memcpy(folder, slash ? file : ".", count);
    return folder;
}

static bool apply_edits(Scene *scene, const char *const *edits, int count, const char **paths, Err *err) {
    SceneContent *content = scene->content;
    if (count > MAX_EDITS)
        return err_set(err, ERR_USAGE, "--set is given %d times, at most %d are possible", count, MAX_EDITS);
    for (int i = 0; i < count; i++) {
        char *path = pool_alloc(&content->pool, EDIT_PATH_SIZE);
        paths[i] = path;
        if (!field_edit(&scene_file_type, "Configuration", edits[i], content->document, path, EDIT_PATH_SIZE,
                        err))
            return false;
    }
    return true;
}

static bool read_content(Scene *scene, const char *const *edits, int edit_count, Err *err) {
    SceneContent *content = scene->content;
    const char *paths[MAX_EDITS];
    if (!apply_edits(scene, edits, edit_count, paths, err))
        return false;
    if (!json_object_get(content->document, "Configuration"))
        json_object_set_new(content->document, "Configuration", json_object());
    Problems problems = problems_begin(scene->file, err);
    problems.edited = paths;
    problems.edited_count = edit_count;
    FieldReader reader = {&problems, &content->pool, folder_of(scene->file, &content->pool)};
    field_read(&scene_file_type, content->document, &content->file, &reader);
    return problems_end(&problems);
}

Scene *scene_parse(const char *file, const char *text, size_t size, const char *const *edits, int edit_count,
                   Err *err) {
    json_t *document = parse_document(file, text, size, err);
    if (!document)
        return NULL;
    Pool pool = {0};
    Scene *scene = pool_alloc(&pool, sizeof *scene);
    scene->content = pool_alloc(&pool, sizeof *scene->content);
    scene->file = strcpy(pool_alloc(&pool, strlen(file) + 1), file);
    scene->content->document = document;
    scene->content->pool = pool;
    if (!read_content(scene, edits, edit_count, err)) {
        scene_free(scene);
        return NULL;
    }
    fill_def(scene);
    return scene;
}

Scene *scene_load(const char *path, const char *const *edits, int edit_count, Err *err) {
    char *text;
    size_t size;
    if (!file_read(path, MAX_SCENE_SIZE, &text, &size, err))
        return NULL;
    Scene *scene = scene_parse(path, text, size, edits, edit_count, err);
    free(text);
    return scene;
}

void scene_free(Scene *scene) {
    if (!scene)
        return;
    Pool pool = scene->content->pool; /* holds the scene itself */
    json_decref(scene->content->document);
    pool_free(&pool);
}

/* ---- Using ---- */

SkiffSim *scene_start(const Scene *scene, int threads, SkiffSimd simd, Err *err) {
    SkiffDef def = scene->def;
    def.threads = threads;
    def.simd = simd;
    SkiffSim *sim = skiff_create(&def, err);
    if (!sim && err && err->code == ERR_INPUT)
        err_prefix(err, "%s", scene->file);
    return sim;
}

json_t *scene_effective(const Scene *scene) {
    json_t *effective = field_write(&scene_file_type, &scene->content->file);
    json_object_del(effective, "$schema"); /* relative to the file that it stood in */
    return effective;
}

json_t *scene_schema(void) {
    json_t *schema = json_pack("{ssss}", "$schema", "https://json-schema.org/draft/2020-12/schema", "title",
                               "Skiff scene");
    json_t *body = field_schema(&scene_file_type);
    json_object_update(schema, body);
    json_decref(body);
    return schema;
}

void scene_name(const Scene *scene, char *out, size_t size) {
    const char *slash = strrchr(scene->file, '/');
    snprintf(out, size, "%s", slash ? slash + 1 : scene->file);
    char *dot = strrchr(out, '.');
    if (dot && dot != out && strcmp(dot, ".json") == 0)
        *dot = '\0';
    for (char *c = out; *c; c++) /* it becomes a CSV cell */
        if (*c == ',' || *c == '"' || (unsigned char)*c < ' ')
            *c = '_';
}
