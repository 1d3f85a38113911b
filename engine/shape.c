/* Closed shapes: one row of `forms` for each kind, with its checks, its mesh and, where there is one, the
 * closed form of its signed distance.
 *
 * Distances are exact, by the usual decomposition: a prism from the distance to its outline in the plane and
 * that to its floor or lid; a cone from its profile in the half-plane (distance from the axis, height); a
 * star by folding the plane into one half of a branch, where its outline is a single edge: a point and the
 * surface point closest to it always lie in the same half. (The polar test of [Carensac2023]'s code is right
 * about the inside only.) Batches run the function that single points do, inlined in a loop: there is one
 * formula, which compilers vectorise.
 *
 * Not here: unions and differences of shapes, and bodies that turn (their meshes are in body.c). */
#include "shape.h"

#include "base/angle.h"

#include <assert.h>
#include <math.h>
#include <string.h>

enum {
    SEGMENTS = 256,   /* of a circle: it is missed by 7.5e-5 of the radius at most, 0.4 mm of 5 m */
    SPHERE_LEVEL = 5, /* 20480 triangles: missed by 2e-4 of the radius, volume 0.06 % below the sphere's */
    BATCH = 1024,     /* points of one thread at a time */
    STAR_BATCH = 64
};

/* ---- Profiles in the plane ---- */

/* fminf and fmaxf would be calls: they care about NaN. */
static inline float smaller(float a, float b) {
    return a < b ? a : b;
}

static inline float larger(float a, float b) {
    return a > b ? a : b;
}

/* Distance to the intersection of two solids whose surfaces are at right angles, from their distances a and
 * b. weight (or NULL) receives the derivatives by a and by b. */
static inline float join(float a, float b, float weight[2]) {
    const float a_out = larger(a, 0.0f), b_out = larger(b, 0.0f);
    const float distance = smaller(larger(a, b), 0.0f) + sqrtf(a_out * a_out + b_out * b_out);
    if (weight) {
        weight[0] = distance > 0.0f ? a_out / distance : a >= b ? 1.0f : 0.0f;
        weight[1] = distance > 0.0f ? b_out / distance : a >= b ? 0.0f : 1.0f;
    }
    return distance;
}

/* Signed distance to the part of an edge's line between `low` and `high`; the sign is that of the whole line,
 * negative on its left. */
static inline float edge_distance(const ShapeEdge *edge, float low, float high, const float at[2],
                                  float gradient[2]) {
    const float u = at[0] - edge->start[0], v = at[1] - edge->start[1];
    const float along = u * edge->along[0] + v * edge->along[1];
    const float side = u * edge->along[1] - v * edge->along[0];
    const float over = along - smaller(larger(along, low), high); /* beyond an end */
    const float rounded = copysignf(sqrtf(side * side + over * over), side);
    const float distance = over == 0.0f ? side : rounded;
    if (gradient) {
        const float across = over == 0.0f ? 1.0f : side / distance,
                    beyond = over == 0.0f ? 0.0f : over / distance;
        gradient[0] = across * edge->along[1] + beyond * edge->along[0];
        gradient[1] = -across * edge->along[0] + beyond * edge->along[1];
    }
    return distance;
}

/* Length of (x, z) and its direction. */
static inline float axis_distance(float x, float z, float direction[2]) {
    const float distance = sqrtf(x * x + z * z);
    if (direction) {
        direction[0] = distance > 0.0f ? x / distance : 1.0f;
        direction[1] = distance > 0.0f ? z / distance : 0.0f;
    }
    return distance;
}

/* ---- Closed forms ---- */

/* In the shape's own axes. */
static inline void own_position(const Shape *shape, const float point[3], float own[3]) {
    const float x = point[0] - shape->centre[0], y = point[1] - shape->centre[1],
                z = point[2] - shape->centre[2];
    for (int k = 0; k < 3; k++)
        own[k] = shape->axes[k][0] * x + shape->axes[k][1] * y + shape->axes[k][2] * z;
}

static inline void window_direction(const Shape *shape, float x, float y, float z, float out[3]) {
    for (int k = 0; k < 3; k++)
        out[k] = x * shape->axes[0][k] + y * shape->axes[1][k] + z * shape->axes[2][k];
}

/* A prism, from the distance to its outline and the gradient (x, z) of that. */
static inline float prism_distance(const Shape *shape, float y, float outline, const float slope[2],
                                   bool sides, float gradient[3]) {
    float weight[2] = {1.0f, 0.0f};
    const float cap = fabsf(y) - shape->half[1];
    const float distance = sides ? outline : join(outline, cap, gradient ? weight : NULL);
    if (gradient)
        window_direction(shape, weight[0] * slope[0], copysignf(weight[1], y), weight[0] * slope[1],
                         gradient);
    return distance;
}

static inline float box_at(const Shape *shape, const float point[3], bool sides, float gradient[3]) {
    float own[3], slope[2] = {0};
    own_position(shape, point, own);
    const float outline =
        join(fabsf(own[0]) - shape->half[0], fabsf(own[2]) - shape->half[2], gradient ? slope : NULL);
    if (gradient) {
        slope[0] = copysignf(slope[0], own[0]);
        slope[1] = copysignf(slope[1], own[2]);
    }
    return prism_distance(shape, own[1], outline, slope, sides, gradient);
}

static inline float cylinder_at(const Shape *shape, const float point[3], bool sides, float gradient[3]) {
    float own[3], slope[2] = {0};
    own_position(shape, point, own);
    const float outline = axis_distance(own[0], own[2], gradient ? slope : NULL) - shape->radius;
    return prism_distance(shape, own[1], outline, slope, sides, gradient);
}

/* A few points, a coordinate an array, and the tips of the branches they belong to. */
typedef struct StarPoints {
    float x[STAR_BATCH], y[STAR_BATCH], z[STAR_BATCH];
    float tip_x[STAR_BATCH], tip_z[STAR_BATCH], along[STAR_BATCH];
} StarPoints;

/* The branch that each point is farthest out on. Branches in the outer loop: a search within each point would
 * not vectorise. */
static inline void star_tips(const Shape *shape, StarPoints *points, int count) {
    for (int i = 0; i < count; i++)
        points->along[i] = -INFINITY;
    for (int b = 0; b < shape->branches; b++) {
        const float x = shape->tips[b][0], z = shape->tips[b][1];
        for (int i = 0; i < count; i++) {
            const float along = points->x[i] * x + points->z[i] * z;
            const bool farther = along > points->along[i];
            points->tip_x[i] = farther ? x : points->tip_x[i];
            points->tip_z[i] = farther ? z : points->tip_z[i];
            points->along[i] = farther ? along : points->along[i];
        }
    }
}

static inline float star_distance(const Shape *shape, const StarPoints *points, int i, bool sides,
                                  float gradient[3]) {
    const float x = points->x[i], z = points->z[i], tip_x = points->tip_x[i], tip_z = points->tip_z[i];
    float slope[2] = {0}, folded_slope[2] = {0};
    const float across = x * tip_z - z * tip_x;
    const float folded[2] = {x * tip_x + z * tip_z, fabsf(across)};
    const float outline =
        edge_distance(&shape->edge, 0.0f, shape->edge.length, folded, gradient ? folded_slope : NULL);
    if (gradient) {
        const float turn = across < 0.0f ? -folded_slope[1] : folded_slope[1];
        slope[0] = folded_slope[0] * tip_x + turn * tip_z;
        slope[1] = folded_slope[0] * tip_z - turn * tip_x;
    }
    return prism_distance(shape, points->y[i], outline, slope, sides, gradient);
}

static inline void star_load(const Shape *shape, const float point[3], StarPoints *points, int i) {
    float own[3];
    own_position(shape, point, own);
    points->x[i] = own[0];
    points->y[i] = own[1];
    points->z[i] = own[2];
    points->tip_x[i] = points->tip_z[i] = 0.0f;
}

static float star_at(const Shape *shape, const float point[3], bool sides, float gradient[3]) {
    StarPoints one;
    star_load(shape, point, &one, 0);
    star_tips(shape, &one, 1);
    return star_distance(shape, &one, 0, sides, gradient);
}

static void star_batch(const Shape *shape, const float (*restrict points)[4], uint32_t count, bool sides,
                       float *restrict distance) {
    StarPoints part;
    for (uint32_t first = 0; first < count; first += STAR_BATCH) {
        const int size = count - first < STAR_BATCH ? (int)(count - first) : STAR_BATCH;
        float *out = distance + first;
        for (int i = 0; i < size; i++)
            star_load(shape, points[first + (uint32_t)i], &part, i);
        star_tips(shape, &part, size);
        if (sides)
            for (int i = 0; i < size; i++)
                out[i] = star_distance(shape, &part, i, true, NULL);
        else
            for (int i = 0; i < size; i++)
                out[i] = star_distance(shape, &part, i, false, NULL);
    }
}

static inline float cone_at(const Shape *shape, const float point[3], bool sides, float gradient[3]) {
    float own[3], direction[2] = {0}, slope[2] = {0};
    own_position(shape, point, own);
    const float profile[2] = {axis_distance(own[0], own[2], gradient ? direction : NULL), own[1]};
    const ShapeEdge *edge = &shape->edge;
    const float lean = edge->along[0]; /* outwards on the way up; the side goes on as far as the axis */
    const float low = !sides ? 0.0f : lean > 0.0f ? -edge->start[0] / lean : -INFINITY;
    const float high = !sides ? edge->length : lean < 0.0f ? -edge->start[0] / lean : INFINITY;
    float distance = edge_distance(edge, low, high, profile, gradient ? slope : NULL);
    if (!sides) {
        const float cap = fabsf(own[1]) - shape->half[1];
        const bool above = own[1] > 0.0f;
        const float cap_radius = above ? shape->top_radius : shape->radius;
        /* & and |, as && and || would be branches */
        const bool inside = (distance < 0.0f) & (cap <= 0.0f);
        const bool to_cap = (inside & (cap > distance)) | ((cap > 0.0f) & (profile[0] <= cap_radius));
        const bool around = !(inside | to_cap) & (distance < 0.0f); /* the rim, from beyond the side's end */
        if (gradient) {
            slope[0] = to_cap ? 0.0f : around ? -slope[0] : slope[0];
            slope[1] = to_cap ? (above ? 1.0f : -1.0f) : around ? -slope[1] : slope[1];
        }
        distance = to_cap ? cap : around ? -distance : distance;
    }
    if (gradient)
        window_direction(shape, slope[0] * direction[0], slope[1], slope[0] * direction[1], gradient);
    return distance;
}

static inline float sphere_at(const Shape *shape, const float point[3], bool sides, float gradient[3]) {
    (void)sides;
    const float x = point[0] - shape->centre[0], y = point[1] - shape->centre[1],
                z = point[2] - shape->centre[2];
    const float length = sqrtf(x * x + y * y + z * z);
    if (gradient) {
        gradient[0] = length > 0.0f ? x / length : 1.0f;
        gradient[1] = length > 0.0f ? y / length : 0.0f;
        gradient[2] = length > 0.0f ? z / length : 0.0f;
    }
    return length - shape->radius;
}

/* `sides` and the missing gradient are constants in each loop: what they do not need is not computed. */
#define BATCH_OF(name)                                                                                       \
    static void name##_batch(const Shape *shape, const float(*restrict points)[4], uint32_t count,           \
                             bool sides, float *restrict distance) {                                         \
        if (sides)                                                                                           \
            for (uint32_t i = 0; i < count; i++)                                                             \
                distance[i] = name##_at(shape, points[i], true, NULL);                                       \
        else                                                                                                 \
            for (uint32_t i = 0; i < count; i++)                                                             \
                distance[i] = name##_at(shape, points[i], false, NULL);                                      \
    }

BATCH_OF(box)
BATCH_OF(cylinder)
BATCH_OF(cone)
BATCH_OF(sphere)

/* ---- Sizes and volumes of the closed forms; false where the scale makes it another kind of shape ---- */

static void set_edge(ShapeEdge *edge, double from_x, double from_y, double to_x, double to_y) {
    const double length = hypot(to_x - from_x, to_y - from_y);
    *edge = (ShapeEdge){.start = {(float)from_x, (float)from_y},
                        .along = {(float)((to_x - from_x) / length), (float)((to_y - from_y) / length)},
                        .length = (float)length};
}

static bool round_about_y(const SkiffGeometryDef *def) {
    return fabsf(def->scale[0]) == fabsf(def->scale[2]);
}

static bool box_place(const SkiffGeometryDef *def, Shape *shape) {
    shape->volume = 1.0;
    for (int k = 0; k < 3; k++) {
        shape->half[k] = 0.5f * def->size[k] * fabsf(def->scale[k]);
        shape->volume *= (double)def->size[k] * fabs((double)def->scale[k]);
    }
    return true;
}

static bool cone_place(const SkiffGeometryDef *def, Shape *shape) {
    const bool cone = def->kind == SKIFF_GEOMETRY_CONE;
    const double across = fabs((double)def->scale[0]),
                 height = (double)def->height * fabs((double)def->scale[1]);
    const double bottom = (double)def->radius * across;
    const double top = cone ? (double)def->top_radius * across : bottom;
    shape->half[1] = (float)(0.5 * height);
    shape->radius = (float)bottom;
    shape->top_radius = (float)top;
    shape->volume = pi / 3.0 * height * (bottom * bottom + bottom * top + top * top);
    set_edge(&shape->edge, bottom, -0.5 * height, top, 0.5 * height);
    return round_about_y(def);
}

static bool star_place(const SkiffGeometryDef *def, Shape *shape) {
    const double across = fabs((double)def->scale[0]),
                 height = (double)def->height * fabs((double)def->scale[1]);
    const double outer = (double)def->radius * across, inner = (double)def->inner_radius * across;
    const double turn = pi / def->branches;
    shape->half[1] = (float)(0.5 * height);
    shape->radius = (float)outer;
    shape->volume = def->branches * outer * inner * sin(turn) * height;
    set_edge(&shape->edge, outer, 0.0, inner * cos(turn), inner * sin(turn));
    shape->branches = def->branches;
    for (int b = 0; b < def->branches; b++) {
        shape->tips[b][0] = (float)sin(2.0 * turn * b);
        shape->tips[b][1] = (float)cos(2.0 * turn * b);
    }
    return round_about_y(def);
}

static bool sphere_place(const SkiffGeometryDef *def, Shape *shape) {
    const double radius = (double)def->radius * fabs((double)def->scale[0]);
    shape->radius = (float)radius;
    shape->volume = 4.0 / 3.0 * pi * radius * radius * radius;
    return round_about_y(def) && fabsf(def->scale[0]) == fabsf(def->scale[1]);
}

/* ---- How far the closed forms reach in a direction of their own axes; a star's reach is its mesh's ---- */

static float box_reach(const Shape *shape, const float direction[3]) {
    return shape->half[0] * fabsf(direction[0]) + shape->half[1] * fabsf(direction[1]) +
           shape->half[2] * fabsf(direction[2]);
}

static float cone_reach(const Shape *shape, const float direction[3]) {
    const float across = hypotf(direction[0], direction[2]);
    return larger(shape->radius * across - shape->half[1] * direction[1],
                  shape->top_radius * across + shape->half[1] * direction[1]);
}

static float sphere_reach(const Shape *shape, const float direction[3]) {
    (void)direction;
    return shape->radius;
}

/* ---- Checks and meshes ---- */

static bool check_length(double value, const char *key, const char *path, Err *err) {
    return (value > 0.0 && isfinite(value)) ||
           err_add(err, ERR_INPUT, "%s.%s: %g m, must be above 0", path, key, value);
}

static bool box_check(const SkiffGeometryDef *def, const char *path, Err *err) {
    static const char *const keys[3] = {"box[0]", "box[1]", "box[2]"};
    bool good = true;
    for (int k = 0; k < 3; k++)
        good = check_length((double)def->size[k], keys[k], path, err) && good;
    return good;
}

static bool sphere_check(const SkiffGeometryDef *def, const char *path, Err *err) {
    return check_length((double)def->radius, "sphere", path, err);
}

static bool cylinder_check(const SkiffGeometryDef *def, const char *path, Err *err) {
    bool good = check_length((double)def->radius, "radius", path, err);
    return check_length((double)def->height, "height", path, err) && good;
}

static bool cone_check(const SkiffGeometryDef *def, const char *path, Err *err) {
    bool good = cylinder_check(def, path, err);
    if (!(def->top_radius >= 0.0f && isfinite(def->top_radius)))
        good =
            err_add(err, ERR_INPUT, "%s.topRadius: %g m, must be 0 or above", path, (double)def->top_radius);
    return good;
}

static bool star_check(const SkiffGeometryDef *def, const char *path, Err *err) {
    bool good = cylinder_check(def, path, err);
    if (!(def->inner_radius > 0.0f && def->inner_radius <= def->radius))
        good = err_add(err, ERR_INPUT, "%s.innerRadius: %g m, must be above 0 and at most the radius, %g m",
                       path, (double)def->inner_radius, (double)def->radius);
    if (def->branches < 2 || def->branches > SKIFF_MAX_BRANCHES)
        good = err_add(err, ERR_INPUT, "%s.branches: %d, must be 2 to %d", path, def->branches,
                       (int)SKIFF_MAX_BRANCHES);
    return good;
}

static bool obj_mesh(const SkiffGeometryDef *def, Mesh *mesh, Err *err) {
    return mesh_load_obj(def->file, mesh, err);
}

static bool planes_mesh(const SkiffGeometryDef *def, Mesh *mesh, Err *err) {
    return mesh_make_planes(def->plane_points, def->plane_normals, def->plane_count, mesh, err);
}

static bool box_mesh(const SkiffGeometryDef *def, Mesh *mesh, Err *err) {
    const float min[3] = {-def->size[0] / 2, -def->size[1] / 2, -def->size[2] / 2};
    const float max[3] = {def->size[0] / 2, def->size[1] / 2, def->size[2] / 2};
    return mesh_make_box(min, max, mesh, err);
}

static bool sphere_mesh(const SkiffGeometryDef *def, Mesh *mesh, Err *err) {
    return mesh_make_sphere((const float[3]){0, 0, 0}, def->radius, SPHERE_LEVEL, mesh, err);
}

static bool cone_mesh(const SkiffGeometryDef *def, Mesh *mesh, Err *err) {
    float bottom[SEGMENTS][2], top[SEGMENTS][2];
    const double top_radius = (double)(def->kind == SKIFF_GEOMETRY_CONE ? def->top_radius : def->radius);
    for (int i = 0; i < SEGMENTS; i++) {
        const double x = sin(2.0 * pi * i / SEGMENTS), z = cos(2.0 * pi * i / SEGMENTS);
        bottom[i][0] = (float)((double)def->radius * x);
        bottom[i][1] = (float)((double)def->radius * z);
        top[i][0] = (float)(top_radius * x);
        top[i][1] = (float)(top_radius * z);
    }
    return mesh_make_prism((const float(*)[2])bottom, (const float(*)[2])top, SEGMENTS, def->height, mesh,
                           err);
}

static bool star_mesh(const SkiffGeometryDef *def, Mesh *mesh, Err *err) {
    float outline[2 * SKIFF_MAX_BRANCHES][2];
    const int count = 2 * def->branches;
    for (int i = 0; i < count; i++) {
        const double radius = (double)(i % 2 == 0 ? def->radius : def->inner_radius);
        outline[i][0] = (float)(radius * sin(2.0 * pi * i / count));
        outline[i][1] = (float)(radius * cos(2.0 * pi * i / count));
    }
    return mesh_make_prism((const float(*)[2])outline, (const float(*)[2])outline, (uint32_t)count,
                           def->height, mesh, err);
}

/* ---- The table ---- */

typedef struct Form {
    bool (*check)(const SkiffGeometryDef *def, const char *path, Err *err); /* NULL: nothing to check */
    bool (*make_mesh)(const SkiffGeometryDef *def, Mesh *mesh, Err *err);
    /* closed form; NULL: there is none */
    bool (*place)(const SkiffGeometryDef *def, Shape *shape);
    float (*at)(const Shape *shape, const float point[3], bool sides, float gradient[3]);
    void (*batch)(const Shape *shape, const float (*restrict points)[4], uint32_t count, bool sides,
                  float *restrict distance);
    float (*reach)(const Shape *shape, const float direction[3]); /* NULL: the mesh's */
} Form;

static const Form forms[] = {
    [SKIFF_GEOMETRY_MESH] = {.make_mesh = obj_mesh},
    [SKIFF_GEOMETRY_PLANES] = {.make_mesh = planes_mesh},
    [SKIFF_GEOMETRY_BOX] = {box_check, box_mesh, box_place, box_at, box_batch, box_reach},
    [SKIFF_GEOMETRY_SPHERE] = {sphere_check, sphere_mesh, sphere_place, sphere_at, sphere_batch,
                               sphere_reach},
    [SKIFF_GEOMETRY_CYLINDER] = {cylinder_check, cone_mesh, cone_place, cylinder_at, cylinder_batch,
                                 cone_reach},
    [SKIFF_GEOMETRY_STAR] = {star_check, star_mesh, star_place, star_at, star_batch, NULL},
    [SKIFF_GEOMETRY_CONE] = {cone_check, cone_mesh, cone_place, cone_at, cone_batch, cone_reach},
};

/* ---- Making ---- */

static bool geometry_check(const SkiffGeometryDef *def, const char *path, Err *err) {
    if (def->kind == SKIFF_GEOMETRY_NONE)
        return err_add(err, ERR_INPUT, "%s: has no geometry", path);
    const Form *form = &forms[def->kind];
    bool good = form->check == NULL || form->check(def, path, err);
    for (int k = 0; k < 3; k++) {
        if (!isfinite(def->scale[k]) || def->scale[k] == 0.0f)
            good = err_add(err, ERR_INPUT, "%s.scale[%d]: %g, must be finite and not 0", path, k,
                           (double)def->scale[k]);
        if (!isfinite(def->translation[k]))
            good = err_add(err, ERR_INPUT, "%s.translation[%d]: must be finite", path, k);
    }
    const float *axis = def->rotation_axis;
    const float norm = sqrtf(axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2]);
    if (!isfinite(def->rotation_angle) || !isfinite(norm))
        good = err_add(err, ERR_INPUT, "%s.rotationAngle, rotationAxis: must be finite", path);
    else if (def->rotation_angle != 0.0f && norm < 1e-6f)
        good = err_add(err, ERR_INPUT, "%s.rotationAxis: has no length", path);
    return good;
}

/* x y z w */
static void rotation_quaternion(const SkiffGeometryDef *def, float quaternion[4]) {
    const float *axis = def->rotation_axis;
    const float norm = sqrtf(axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2]);
    const float s = norm > 0.0f ? sinf(def->rotation_angle / 2) / norm : 0.0f;
    for (int k = 0; k < 3; k++)
        quaternion[k] = axis[k] * s;
    quaternion[3] = cosf(def->rotation_angle / 2);
}

bool geometry_make(const SkiffGeometryDef *def, const char *path, Mesh *mesh, Err *err) {
    memset(mesh, 0, sizeof *mesh);
    if (!geometry_check(def, path, err))
        return false;
    Err reason = {0};
    if (!forms[def->kind].make_mesh(def, mesh, &reason) ||
        !mesh_check_closed(mesh, def->file ? def->file : "geometry", &reason)) {
        mesh_free(mesh);
        return err_add(err, reason.code, "%s: %s", path, reason.message);
    }
    float quaternion[4];
    rotation_quaternion(def, quaternion);
    mesh_transform(mesh, def->scale, quaternion, (const float[3]){0, 0, 0});
    return true;
}

void geometry_turn(const SkiffGeometryDef *def, const float place[3], double result[3]) {
    float quaternion[4], turned[1][3] = {{place[0], place[1], place[2]}};
    Mesh point = {.vertices = turned, .vertex_count = 1};
    rotation_quaternion(def, quaternion);
    mesh_transform(&point, def->scale, quaternion, (const float[3]){0, 0, 0});
    for (int k = 0; k < 3; k++)
        result[k] = (double)turned[0][k];
}

/* Own axes by turning the unit vectors as meshes are turned: one rule for both. */
static void place_axes(const SkiffGeometryDef *def, Shape *shape) {
    float quaternion[4];
    rotation_quaternion(def, quaternion);
    Mesh frame = {.vertices = shape->axes, .vertex_count = 3};
    memset(shape->axes, 0, sizeof shape->axes);
    for (int k = 0; k < 3; k++)
        shape->axes[k][k] = def->scale[k] < 0.0f ? -1.0f : 1.0f;
    mesh_transform(&frame, (const float[3]){1, 1, 1}, quaternion, (const float[3]){0, 0, 0});
}

static void set_bounds(Shape *shape) {
    memcpy(shape->min, shape->mesh.min, sizeof shape->min);
    memcpy(shape->max, shape->mesh.max, sizeof shape->max);
    const Form *form = &forms[shape->kind];
    if (!shape->analytic || form->reach == NULL)
        return;
    for (int k = 0; k < 3; k++) {
        const float up[3] = {shape->axes[0][k], shape->axes[1][k], shape->axes[2][k]};
        const float down[3] = {-up[0], -up[1], -up[2]};
        shape->max[k] = shape->centre[k] + form->reach(shape, up);
        shape->min[k] = shape->centre[k] - form->reach(shape, down);
    }
}

bool shape_make(const SkiffGeometryDef *def, const char *path, const double origin[3], Shape *shape,
                Err *err) {
    memset(shape, 0, sizeof *shape);
    if (!geometry_make(def, path, &shape->mesh, err))
        return false;
    shape->kind = def->kind;
    for (int k = 0; k < 3; k++)
        shape->centre[k] = (float)((double)def->translation[k] - origin[k]);
    mesh_transform(&shape->mesh, (const float[3]){1, 1, 1}, (const float[4]){0, 0, 0, 1}, shape->centre);
    Err reason = {0};
    if (!mesh_build_tree(&shape->mesh, &reason)) {
        shape_free(shape);
        return err_add(err, reason.code, "%s: %s", path, reason.message);
    }
    const Form *form = &forms[def->kind];
    place_axes(def, shape);
    shape->analytic = form->place != NULL && form->place(def, shape);
    if (!shape->analytic) {
        MeshMass mass;
        mesh_mass(&shape->mesh, &mass);
        shape->volume = mass.volume;
    }
    set_bounds(shape);
    return true;
}

void shape_free(Shape *shape) {
    mesh_free(&shape->mesh);
    memset(shape, 0, sizeof *shape);
}

/* ---- Distances ---- */

static float distance_at(const Shape *shape, const float point[3], bool sides, float gradient[3]) {
    assert(shape->kind != SKIFF_GEOMETRY_NONE);
    if (shape->analytic)
        return forms[shape->kind].at(shape, point, sides, gradient);
    return gradient ? mesh_distance_gradient(&shape->mesh, point, gradient)
                    : mesh_distance(&shape->mesh, point, NULL);
}

static void distances_at(const Shape *shape, const float (*points)[4], uint32_t count, bool sides,
                         float *distance, int threads) {
    assert(shape->kind != SKIFF_GEOMETRY_NONE);
    if (!shape->analytic) {
        mesh_distances(&shape->mesh, points, count, distance, threads);
        return;
    }
    const Form *form = &forms[shape->kind];
    const int64_t batches = ((int64_t)count + BATCH - 1) / BATCH;
#pragma omp parallel for schedule(static) num_threads(threads)
    for (int64_t b = 0; b < batches; b++) {
        const uint32_t first = (uint32_t)b * BATCH, left = count - first;
        form->batch(shape, points + first, left < BATCH ? left : BATCH, sides, distance + first);
    }
}

float shape_distance(const Shape *shape, const float point[3], float gradient[3]) {
    return distance_at(shape, point, false, gradient);
}

float shape_distance_sides(const Shape *shape, const float point[3], float gradient[3]) {
    return distance_at(shape, point, true, gradient);
}

void shape_distances(const Shape *shape, const float (*points)[4], uint32_t count, float *distance,
                     int threads) {
    distances_at(shape, points, count, false, distance, threads);
}

void shape_distances_sides(const Shape *shape, const float (*points)[4], uint32_t count, float *distance,
                           int threads) {
    distances_at(shape, points, count, true, distance, threads);
}
