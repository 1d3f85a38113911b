/* The world's water at rest: what lies where nothing has been yet. A column of it, the tile under a surface
 * that has settled on it, repeats along x and z with the period of the tile. It is anchored in the world:
 * whatever window looks at a place finds the same particles there, and where two looks meet there is no seam.
 */
#ifndef SKIFF_WATER_H
#define SKIFF_WATER_H

#include "rest.h"

typedef struct StillWater {
    RestFitted column; /* x and z in [0, period), y relative to the surface; by cells */
    double period;     /* m */
    float cell, top;   /* m: edge of a cell, y of the uppermost cell's top */
    int32_t across, layers;
    uint32_t *start; /* [across * across * layers + 1] */
    Buffer position, pressure, start_buffer;
} StillWater;

/* How deep the surface is felt, supports. */
enum { WATER_SETTLED = 8 };

/* Which part of it. */
typedef struct WaterPlace {
    double origin[3];  /* of the coordinates, world, m */
    float surface;     /* y of the still surface in them, m */
    CellBounds bounds; /* in them */
    /* At most the distance of p from the part that is wanted, m; not positive: p belongs to it. */
    float (*outside)(const void *user, const float p[3]);
    const void *user;
} WaterPlace;

/* A growing list of water. */
typedef struct WaterList {
    RestFitted water;
    uint32_t capacity;
    Buffer position, pressure;
} WaterList;

/* Makes a column that reaches `depth` (m) down at least. The simulation has its tile and params. */
bool water_make(StillWater *water, struct SkiffSim *sim, float depth, Err *err);
/* Lets the tile's upper part settle under a free surface, as a block, the level WATER_SETTLED
 * supports and a radius over its bottom, shares relative to a depth of a radius at least. It is at rest at
 * every scale, and comes with the program. The simulation has its tile and no particles; it is left as it
 * was. */
bool water_make_surface(struct SkiffSim *sim, RestTile *surface, Err *err);
/* Replaces the list by the particles of a place, always in the same order. */
bool water_gather(const StillWater *water, const WaterPlace *place, WaterList *list, int threads, Err *err);
void water_free(StillWater *water);
void water_list_free(WaterList *list);

#endif
