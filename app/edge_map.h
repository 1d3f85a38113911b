/* Where the window of particles ends, as a picture seen from above. */
#ifndef SKIFF_APP_EDGE_MAP_H
#define SKIFF_APP_EDGE_MAP_H

#include "frames.h"

/* Horizontal signed distance to the window's edge, m, positive inside, at
 * x = min[0] + i (max[0] - min[0]) / (size[0] - 1), z alike with j: distance[j * size[0] + i]. Local
 * coordinates, in which the window does not move. */
typedef struct EdgeMap {
    float *distance; /* NULL: there is no window */
    uint32_t size[2];
    float min[2], max[2];
} EdgeMap;

/* Around the water of `frame`, which must be the first one: it fills the window. ERR_INPUT when memory is
 * exhausted. */
bool edge_map_make(EdgeMap *map, const SkiffSim *sim, const Frame *frame, Err *err);
/* At local x, z, between the samples; beyond them far outside. */
float edge_map_at(const EdgeMap *map, float x, float z);
void edge_map_free(EdgeMap *map);

#endif
