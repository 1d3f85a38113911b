/* Spheres as discs of an image, drawn on the CPU: in software GL a point costs four to ten times as much. */
#ifndef SKIFF_SPLAT_H
#define SKIFF_SPLAT_H

#include "surface.h"

enum {
    SPLAT_LANES = 8, /* rows are written in whole groups of pixels: they need as many more at their end */
    SPLAT_BAND = 24, /* rows that are drawn at once: their pixels stay in the second cache */
};

/* One sphere in the image. */
typedef struct SplatDisc {
    float x, y;      /* of the centre, px from the lower left corner */
    float size;      /* radius, px */
    float depth;     /* of the centre, m */
    float radius;    /* m */
    uint32_t source; /* which of the points */
} SplatDisc;

/* Zero-initialise, reuse, buffer_free. */
typedef struct Splat {
    SplatDisc *discs;
    uint32_t count;
    Buffer memory;
} Splat;

typedef struct SplatView {
    const float *view; /* local -> eye, column-major */
    const float *lens; /* tangents of half the field of view; near plane */
    int width, height; /* of the image, px */
    float radius;      /* of a sphere, m */
    float lowered;     /* by this part of the radius the centres are lowered */
    bool fade_shrinks; /* what fades is smaller instead of clearer */
} SplatView;

/* Those of the points that are seen, in their order. ERR_INPUT: no memory. */
bool splat_project(Splat *splat, const SurfaceList *points, const SplatView *view, Err *err);

static inline int splat_stride(int width) {
    return width + SPLAT_LANES;
}

/* Draws all discs into the rows [from, to) of an image, whose first one the arrays begin with: the nearest
 * depth, and the number of the disc that it belongs to where `owner` is not NULL. */
void splat_rows(const Splat *splat, int width, int from, int to, float *depth, uint32_t *owner);

/* The pixels [*first, *end) of row `y` that the disc touches; false: none. */
bool splat_span(const SplatDisc *disc, int width, int y, int *first, int *end);

#endif
