/* Boundary samples: points spread near-uniformly over a triangle mesh's surface. */
#ifndef SKIFF_SAMPLE_H
#define SKIFF_SAMPLE_H

#include "mesh.h"

typedef struct SamplePoint {
    float position[3]; /* m, on the surface */
    float normal[3];   /* unit, outward of the mesh */
    float area; /* m^2 of surface this point stands for; the points of a mesh sum to the sampled area */
} SamplePoint;

/* Only the part of the surface inside [min, max] is sampled (a tank's walls above any water are never wet).
 */
typedef struct SampleRegion {
    float min[3], max[3];
} SampleRegion;

/* Spreads points with mean spacing `spacing` m (one point for each spacing^2 * sqrt(3)/2 .. spacing^2 of
 * area, more on shapes of a few spacings).
 * - Sharp edges (a turn of more than 30 degrees, or an open border) are divided evenly, with a point at each
 * corner; the faces that meet there share these points.
 * - Flat rectangles (connected coplanar triangles) get a regular grid that reaches their edges; the spacing
 * is adjusted a little to divide each edge evenly. A rectangle that the region cuts to a smaller rectangle
 * gets a grid that fits what is left. Rectangles of at least 4 spacings each way are found inside smooth
 * surfaces, too.
 * - Everything else gets a Poisson-disk set relaxed towards even spacing.
 * No surface point is farther than 1.0 spacing from a sample. No two points are closer than 0.6 spacing, but
 * for points on the two sides of a plate, a blade or a gap thinner than that, whose faces look away from each
 * other (by more than 120 degrees): both sides are sampled as if they were alone, so that a thin plate feels
 * the same water above and below. Deterministic: same mesh, same points, in the same order. *points is
 * malloc'ed, owned by the caller (free); there may be none. region NULL: the whole surface. ERR_INPUT when
 * more than max_count points would be needed (the message says how many), the spacing is not a length, the
 * mesh is longer than 4 million spacings or not finite, or the region is inside out. Open meshes are fine. */
bool sample_surface(const Mesh *mesh, float spacing, const SampleRegion *region, uint32_t max_count,
                    SamplePoint **points, uint32_t *count, Err *err);

#endif
