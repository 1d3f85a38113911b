/* Water that stands still while other water settles beside it: what exists already, and what is at rest as it
 * was laid. It is sorted once, and gives every step what it has to give (StandingSet, Standing in passes.h).
 */
#ifndef SKIFF_STANDING_H
#define SKIFF_STANDING_H

#include "grid.h"

typedef struct StandingWater {
    uint32_t count, capacity;
    Float4 *points;  /* [count] window-local, m; [3]: P, m^2 */
    StandingSet set; /* the same by cell, after standing_sort */
    Buffer point_buffer, sorted, cells, start;
} StandingWater;

/* Room for `capacity` points in all. */
bool standing_reserve(StandingWater *water, uint32_t capacity, Err *err);
void standing_add(StandingWater *water, const float position[3], float pressure);
/* Another time step, other P. */
void standing_scale(StandingWater *water, float factor);
/* Sorts all points into cells of edge h. */
bool standing_sort(StandingWater *water, float cell_size, Err *err);
void standing_free(StandingWater *water);

#endif
