/* Walls and bodies as samples: one array each for what never moves and for what does. Volumes after
 * [Akinci2012, eq. 4]. */
#ifndef SKIFF_BOUNDARY_H
#define SKIFF_BOUNDARY_H

#include "body.h"
#include "rows.h"
#include "sample.h"

/* Samples in the order they were made, in their owner's frame (walls: window-local; bodies: body axes about
 * the centre of mass). */
typedef struct BoundarySamples {
    uint32_t count, capacity;
    float (*position)[3];
    float *volume;       /* psi, m^3 */
    float *area;         /* m^2 */
    float (*normal)[3];  /* unit, outward of the mesh */
    float (*surface)[3]; /* the point of the true surface it stands for */
    int32_t *object;     /* 0: tank; 1 + i: body i */
} BoundarySamples;

typedef struct BoundarySet {
    BoundarySamples samples;
    bool has_reach;
    CellBounds reach; /* of the water, window-local: samples outside touch none and are not sorted */
    SampleSet sorted; /* in the window's frame, by cell */
    uint32_t *origin; /* [sorted.count] which of `samples` a sorted one is */
    Float4 *world;    /* [count] window-local positions in the order of `samples`; [3]: volume */
    uint32_t *cell;   /* [count] of these */
    Buffer buffer, cells, occupied;
} BoundarySet;

typedef struct Boundary {
    BoundarySet fixed, moving;
    Float4 *centres;    /* [1 + bodies] window-local centre of every object */
    Contact *contacts;  /* of this step, grouped by block of particles */
    ContactSpan *spans; /* [blocks] */
    uint32_t contact_count, contact_capacity;
    uint32_t object_count;
    Buffer contact_buffer, span_buffer, centre_buffer, partial_buffer;
} Boundary;

/* How a surface is sampled. */
typedef struct SurfaceDef {
    const Mesh *mesh; /* with its tree */
    int32_t object;
    float spacing;              /* m */
    float offset;               /* m, how far behind the surface, seen from the water, the samples lie */
    bool water_inside;          /* a tank; else a body */
    const SampleRegion *region; /* NULL: all of it */
    const char *path;           /* for messages */
} SurfaceDef;

/* Samples a surface as it lies. */
bool boundary_add(BoundarySet *set, const SurfaceDef *surface, Err *err);
/* Volumes psi = 1 / sum W over the set's own samples, as they lie in their frame; then sorts them there. A
 * body is weighed alone, so that a wall it starts beside does not thin it; all that is fixed is weighed
 * together. */
bool boundary_weigh(BoundarySet *set, const Kernel *kernel, Err *err);
/* Adds weighed samples to another set. */
bool boundary_append(BoundarySet *set, const BoundarySamples *more, Err *err);
void boundary_set_free(BoundarySet *set);
/* Sizes what a step needs. */
bool boundary_reserve(Boundary *boundary, uint32_t particle_capacity, int body_count, Err *err);
/* The bodies' centres of mass, window-local. */
void boundary_place_centres(Boundary *boundary, const Body *bodies, int body_count, const double origin[3]);
/* Moves the bodies' samples to where the bodies are and sorts them. */
bool boundary_place(Boundary *boundary, const Body *bodies, int body_count, const double origin[3],
                    float cell_size, int threads, Err *err);
/* Boundary terms of all particles that have a row: densities and gradient sums are completed, contacts
 * listed. */
bool boundary_apply(Boundary *boundary, Rows *rows, const RowsJob *job, Err *err);
/* Sum over the contacts of p_i (g, t) for every object: totals[object][6]; in order, so independent of the
 * threads. The p of neighbouring particles are `stride` floats apart. */
void boundary_impulse(const Boundary *boundary, const float *p, size_t stride, uint32_t blocks,
                      double (*totals)[6], int threads);
void boundary_free(Boundary *boundary);

#endif
