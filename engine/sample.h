/* Boundary samples: points spread near-uniformly over a triangle mesh's surface. */
#ifndef SKIFF_SAMPLE_H
#define SKIFF_SAMPLE_H

#include "mesh.h"

typedef struct SamplePoint {
    float position[3]; /* m, on the surface */
    float normal[3];   /* unit, outward of the mesh */
    float area;        /* m^2 of surface this point stands for; the points of a mesh sum to the sampled area */
} SamplePoint;

/* Only the part of the surface inside [min, max] is sampled (a tank's walls above any water are never wet). */
typedef struct SampleRegion {
    float min[3], max[3];
} SampleRegion;

/* Spreads points with mean spacing `spacing` m (one point for each spacing^2 * sqrt(3)/2 .. spacing^2 of area). Flat regions (sets of coplanar
 * connected triangles) get a regular grid that fits their edges where they are rectangles; edges and corners carry points, shared by the
 * faces that meet there and never doubled; curved or odd regions get a deterministic Poisson-disk set relaxed towards uniform. No two points are closer
 * than 0.6 spacing, no surface point is farther than 1.0 spacing from a sample. Deterministic: same mesh, same points.
 * *points is malloc'ed, owned by the caller (free). region NULL: the whole surface. ERR_INPUT when more than max_count points would be
 * needed (the message says how many). */
bool sample_surface(const Mesh *mesh, float spacing, const SampleRegion *region, uint32_t max_count, SamplePoint **points,
                    uint32_t *count, Err *err);

#endif
