/* What the parts of sampling share: sample.c (the list of stages, the pool of points), sample_edges.c,
 * sample_grid.c, sample_scatter.c. Not for users of samples. */
#ifndef SKIFF_SAMPLE_PARTS_H
#define SKIFF_SAMPLE_PARTS_H

#include "dvec.h"
#include "sample.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define SAMPLE_NONE UINT32_MAX

enum { SAMPLE_MAX_FACINGS = 6, SAMPLE_MAX_CORNERS = 12 };

/* A patch of the surface that a point lies on, and its unit normal there. */
typedef struct Facing {
    float normal[3];
    uint32_t patch;
} Facing;

/* A point in the making. Inside a patch it has one facing, on an edge two, at a corner one for each patch
 * there. */
typedef struct Spot {
    double position[3];
    double area;
    uint32_t triangle; /* SAMPLE_NONE on creases */
    uint32_t facing_count;
    Facing facings[SAMPLE_MAX_FACINGS];
} Spot;

/* What a search of the pool reads of a spot, in one cache line. */
typedef struct Entry {
    double position[3];
    uint64_t cell; /* of the hash grid */
    float normal[3];
    uint32_t facing_count;
    uint32_t next; /* in its bucket */
} Entry;

/* origin + x u + y v with x in [0, size[0]], y in [0, size[1]]; u, v unit and at right angles. */
typedef struct Rectangle {
    double origin[3], u[3], v[3], size[2];
} Rectangle;

/* How a patch gets its points. */
typedef enum PatchFill {
    FILL_SCATTER, /* darts, relaxed */
    FILL_SETTLE,  /* has a grid with nodes left out: holes are looked for, and area is given to the nearest */
    FILL_DONE     /* has a whole grid, and its area */
} PatchFill;

typedef struct Sampler {
    const Mesh *mesh;
    double spacing;
    double min[3], max[3]; /* region; infinite where there is none */
    double tolerance;      /* m; what is nearer than this to a bound counts as on it */

    uint32_t (*neighbours)[3]; /* mesh_neighbours */
    double (*normals)[3];      /* of the triangles, unit; zero if degenerate */
    double area;               /* of the sampled surface, m^2 */
    double length;             /* of all sides of the triangles in it, in spacings */

    /* sample_edges_find: patches are parts of the surface without a crease inside. The first rectangle_count
     * are flat rectangles. */
    uint32_t *patches; /* of the triangles */
    uint8_t *creases;  /* of the triangles; bit k: side k is one */
    uint32_t patch_count;
    Rectangle *rectangles;
    uint32_t rectangle_count;
    PatchFill *fills; /* of the patches */

    /* pool */
    Spot *spots;
    Entry *entries; /* of the spots, as they were when they were entered */
    uint32_t spot_count, spot_capacity;
    uint32_t *buckets, bucket_mask;
    double cell_origin[3], inv_cell_size;
} Sampler;

/* Smallest distance of two points that do not oppose each other, largest distance of the surface from a
 * point; in spacings and with a little to spare for float32. */
static const double sample_gap = 0.602, sample_reach = 0.99;

/* Finds creases and patches. Rectangles with two sides of at least 4 spacings become patches of their own
 * even where they continue smoothly. */
bool sample_edges_find(Sampler *sampler, Err *err);
/* Puts points on the creases: at their corners, and evenly in between. */
bool sample_edges_fill(Sampler *sampler, Err *err);
/* Fills rectangles with regular grids. Those that the region cuts to another shape are left to be scattered.
 */
bool sample_grid_fill(Sampler *sampler, Err *err);
/* Fills what is left. */
bool sample_scatter_fill(Sampler *sampler, Err *err);

/* Parts of `length` (in spacings) that are nearest to 1 and leave no gap above sample_reach at a cell's
 * diagonal. */
uint32_t sample_cell_count(double length);

/* Clips a convex polygon of up to SAMPLE_MAX_CORNERS - 6 corners to the region, in place; returns the new
 * count, 0 if nothing is left. *cut tells whether anything was cut off. */
int sample_clip(const Sampler *sampler, double (*polygon)[3], int count, bool *cut);
double sample_polygon_area(double (*polygon)[3], int count);
bool sample_inside(const Sampler *sampler, const double position[3]);

void sample_add_facing(Spot *spot, const double normal[3], uint32_t patch);
/* A spot of area 0 inside a triangle. */
Spot sample_spot(const Sampler *sampler, const double position[3], uint32_t triangle);
/* True for points on two sides of a thin part: some patch of one faces away from some patch of the other, and
 * they do not share these patches. Such points may be near each other. */
bool sample_opposed(const Spot *a, const Spot *b);

/* Adds a spot to the pool; *index may be NULL. */
bool sample_add(Sampler *sampler, const Spot *spot, uint32_t *index, Err *err);
/* The nearest spot of the pool within `radius` <= 1 spacing that does not oppose `spot`; SAMPLE_NONE if there
 * is none. */
uint32_t sample_nearest(const Sampler *sampler, const Spot *spot, double radius);
/* Some spot that is, cheaper. */
uint32_t sample_any(const Sampler *sampler, const Spot *spot, double radius);
/* Indices of the spots within `radius` of a position, opposed or not; at most `capacity` of them. */
uint32_t sample_within(const Sampler *sampler, const double position[3], double radius, uint32_t *found,
                       uint32_t capacity);
/* Empties the buckets and enters the first `count` spots again, for spots that moved; the others are dropped.
 */
void sample_rehash(Sampler *sampler, uint32_t count);

#endif
