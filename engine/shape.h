/* Closed shapes by signed distance: what walls, bodies, windows and regions of water are made of. */
#ifndef SKIFF_SHAPE_H
#define SKIFF_SHAPE_H

#include "mesh.h"
#include "skiff.h"

/* Part of a profile: a line from `start` along the unit vector `along`, with the solid on its left, for
 * positions on it from 0 to `length`. */
typedef struct ShapeEdge {
    float start[2], along[2], length; /* m */
} ShapeEdge;

/* Plain data but for the mesh, which it owns. Zero: no shape. */
typedef struct Shape {
    SkiffGeometryKind kind; /* NONE: no shape */
    Mesh mesh; /* the surface, window-local, for samples and pictures; curved ones in 256 parts a turn */
    float min[3], max[3]; /* bounds, window-local, m */
    double volume;        /* m^3, of the exact shape */
    bool analytic;        /* distances from closed forms; else to the mesh */

    /* for the closed forms: sizes are scaled, m */
    float centre[3];  /* own origin, window-local */
    float axes[3][3]; /* own x, y, z axes in the window, unit; a mirror makes them left-handed */
    float half[3];    /* box: half edges; others: [1] is half the height */
    float radius, top_radius;
    ShapeEdge edge;                    /* star: from a tip to the next corner; cone: up the side */
    float tips[SKIFF_MAX_BRANCHES][2]; /* star: directions (x, z) of the branches */
    int branches;
} Shape;

/* Makes the shape that `def` places in the world, in coordinates relative to `origin` (world, m). ERR_INPUT
 * with `path` before every problem; *shape is then all zero. */
bool shape_make(const SkiffGeometryDef *def, const char *path, const double origin[3], Shape *shape,
                Err *err);
void shape_free(Shape *shape);

/* The mesh of a geometry in its own rotation and scale, without the translation (which is double precision's
 * business). Checked: closed, outside out. */
bool geometry_make(const SkiffGeometryDef *def, const char *path, Mesh *mesh, Err *err);
/* Where the same scale and rotation bring a point or a direction of the geometry's own frame. */
void geometry_turn(const SkiffGeometryDef *def, const float place[3], double result[3]);

/* Signed distance in m, negative inside; exact (Euclidean) inside and outside. Closed forms hold while the
 * scale keeps the kind: any scale of a box, the same one in x and z for cylinders, stars and cones, a uniform
 * one for spheres. Other scales, meshes and planes: distance to the mesh. gradient (may be NULL) is a unit
 * vector that points out of the shape; where several surface points are closest, the direction of one. */
float shape_distance(const Shape *shape, const float point[3], float gradient[3]);
/* Distance to the side walls as if they went on without end: floor and lid of boxes, cylinders and stars are
 * ignored, the cone ends at its tip only. Spheres and everything without a closed form: as above. */
float shape_distance_sides(const Shape *shape, const float point[3], float gradient[3]);
/* Batches of the above on this many OpenMP threads; the same values, bit for bit. The fourth number of a
 * point is not used. */
void shape_distances(const Shape *shape, const float (*points)[4], uint32_t count, float *distance,
                     int threads);
void shape_distances_sides(const Shape *shape, const float (*points)[4], uint32_t count, float *distance,
                           int threads);

#endif
