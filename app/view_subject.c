/* What pictures are of. */
#include "view_subject.h"

#include "nearest.h"

#include <math.h>
#include <string.h>

static const Extent nothing = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};

static void grow(Extent *extent, const float point[3]) {
    for (int k = 0; k < 3; k++) {
        extent->min[k] = fmin(extent->min[k], (double)point[k]);
        extent->max[k] = fmax(extent->max[k], (double)point[k]);
    }
}

static Extent extent_of_points(const float (*points)[3], uint32_t count) {
    Extent extent = nothing;
    for (uint32_t i = 0; i < count; i++)
        grow(&extent, points[i]);
    return extent;
}

static Extent extent_of_water(const Frame *frame) {
    Extent extent = nothing;
    for (uint32_t i = 0; i < frame->live; i++)
        grow(&extent, frame->position[i]);
    return extent;
}

Extent view_subject_extent(const Subject *subject) {
    const float(*vertices)[3];
    const uint32_t(*triangles)[3];
    uint32_t vertex_count, triangle_count;
    skiff_tank_mesh(subject->sim, &vertices, &vertex_count, &triangles, &triangle_count);
    return triangle_count > 0 ? extent_of_points(vertices, vertex_count) : extent_of_water(subject->frame);
}

Extent view_subject_body_extent(const Subject *subject, int body) {
    const float(*vertices)[3];
    const uint32_t(*triangles)[3];
    uint32_t vertex_count, triangle_count;
    skiff_body_mesh(subject->sim, body, &vertices, &vertex_count, &triangles, &triangle_count);
    return extent_of_points(vertices, vertex_count);
}

int view_subject_hero(const SkiffDef *def) {
    for (int i = 0; i < def->body_count; i++)
        if (def->bodies[i].free_axes != 0)
            return i;
    return def->body_count > 0 ? 0 : -1;
}

int view_subject_find(const SkiffDef *def, const char *name) {
    for (int i = 0; i < def->body_count; i++)
        if (strcmp(def->bodies[i].name, name) == 0)
            return i;
    return -1;
}

bool view_subject_unknown(const Scene *scene, const char *list, int index, const char *name, Err *err) {
    const SkiffDef *def = &scene->def;
    Nearest nearest = nearest_begin(name);
    for (int i = 0; i < def->body_count; i++)
        nearest_offer(&nearest, def->bodies[i].name);
    const char *best = nearest_result(&nearest);
    return err_set(err, ERR_INPUT, "%s: Render.%s[%d]: there is no body \"%s\"%s%s%s", scene->file, list,
                   index, name, best ? ", did you mean " : "", best ? best : "", best ? "?" : "");
}
