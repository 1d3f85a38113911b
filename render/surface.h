/* Chooses which particles are worth drawing, on the CPU: a vertex costs more than a pixel in software GL, and
 * all but the outermost two layers are hidden. */
#ifndef SKIFF_SURFACE_H
#define SKIFF_SURFACE_H

#include "gfx.h"

#include "engine/base/arena.h"

/* One vertex. */
typedef struct SurfacePoint {
    float position[3]; /* local, m */
    float fade;        /* 0..1; droplets: opacity */
    float value;       /* body: foam or field; droplets: radius, m */
    float bulk;        /* body of water: 0 in a thin sheet .. 1 */
} SurfacePoint;

typedef struct SurfaceList {
    SurfacePoint *points;
    uint32_t count;
} SurfaceList;

typedef struct Surface {
    SurfaceList body;     /* seen from the eye; the order is fixed by that of the input */
    uint32_t rich_count;  /* water: the first of them have foam, or are not plainly part of a calm ocean */
    SurfaceList droplets; /* of particles that fly alone (water) */
    SurfaceList fading;   /* fade < 1, farthest first (particles) */
    Buffer memory[10];
} Surface;

/* Fills the lists; memory is reused from call to call. ERR_USAGE: a particle is not finite (its index);
 * ERR_INPUT: no memory. */
bool surface_select(Surface *surface, const GfxScene *scene, GfxLook look, Err *err);
void surface_free(Surface *surface);

#endif
