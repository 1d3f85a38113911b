/* Shapes come from the engine; what they are made of from the scene, else from the mesh's own materials. */
#include "view_models.h"

#include "palette.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* What the scene says a body is made of; NULL: nothing. */
static const SceneMaterial *find_material(const Subject *subject, int body) {
    const FieldList *list = &subject->options->render.bodies;
    const SceneMaterial *given = NULL;
    for (int i = 0; i < list->count; i++)
        if (strcmp(((const SceneMaterial *)list->items)[i].name, subject->scene->def.bodies[body].name) == 0)
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

static bool add_instance(Models *models, Gfx *gfx, const GfxMeshDef *mesh, Err *err) {
    int index = gfx_add_mesh(gfx, mesh, err);
    GfxInstance *instance = &models->instances[models->count++];
    *instance = (GfxInstance){.mesh = index};
    for (int k = 0; k < 4; k++)
        instance->pose[5 * k] = 1;
    return index >= 0;
}

bool view_models_make(Models *models, const Subject *subject, Gfx *gfx, double level, Err *err) {
    const SkiffDef *def = &subject->scene->def;
    const SkiffSim *sim = subject->sim;
    const FieldList *materials = &subject->options->render.bodies;
    int body_count = skiff_body_count(sim);
    for (int i = 0; i < materials->count; i++) {
        const char *name = ((const SceneMaterial *)materials->items)[i].name;
        if (view_subject_find(def, name) < 0)
            return view_subject_unknown(subject->scene, "bodies", i, name, err);
    }
    *models = (Models){.instances = calloc((size_t)body_count + 1, sizeof *models->instances)};
    if (!models->instances)
        return err_set(err, ERR_INPUT, "not enough memory for %d bodies", body_count);
    GfxMeshDef mesh = {0};
    for (int i = 0; i < body_count; i++) {
        skiff_body_mesh(sim, i, &mesh.vertices, &mesh.vertex_count, &mesh.triangles, &mesh.triangle_count);
        const SceneMaterial *given = find_material(subject, i);
        uint8_t(*colors)[3] = given ? NULL : triangle_colors(sim, i, mesh.triangle_count);
        bool is_fixed = def->bodies[i].free_axes == 0 && !colors;
        mesh.material = material_of(given, is_fixed, skiff_body(sim, i).position[1], level);
        mesh.triangle_colors = (const uint8_t(*)[3])colors;
        bool added = add_instance(models, gfx, &mesh, err);
        free(colors);
        if (!added)
            return false;
    }
    mesh.triangle_colors = NULL;
    skiff_tank_mesh(sim, &mesh.vertices, &mesh.vertex_count, &mesh.triangles, &mesh.triangle_count);
    /* The walls around a window are none that one could see: the sea goes on behind them. */
    models->has_tank = mesh.triangle_count > 0 && !subject->frame->has_window;
    mesh.material = gfx_material_default(GFX_MATERIAL_TANK);
    return !models->has_tank || add_instance(models, gfx, &mesh, err);
}

void view_models_free(Models *models) {
    free(models->instances);
    *models = (Models){0};
}

void view_models_place(Models *models, const Frame *frame) {
    for (int i = 0; i < frame->body_count; i++) {
        const double *q = frame->bodies[i].rotation, *p = frame->bodies[i].position;
        double x = q[0], y = q[1], z = q[2], w = q[3];
        /* column-major, own frame -> local */
        const double m[16] = {1 - 2 * (y * y + z * z), 2 * (x * y + w * z),     2 * (x * z - w * y),     0,
                              2 * (x * y - w * z),     1 - 2 * (x * x + z * z), 2 * (y * z + w * x),     0,
                              2 * (x * z + w * y),     2 * (y * z - w * x),     1 - 2 * (x * x + y * y), 0,
                              p[0] - frame->origin[0], p[1] - frame->origin[1], p[2] - frame->origin[2], 1};
        for (int k = 0; k < 16; k++)
            models->instances[i].pose[k] = (float)m[k];
    }
}
