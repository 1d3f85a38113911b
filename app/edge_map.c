/* Samples the engine's distance to the window's edge at every second particle spacing: between samples the
 * distance is nearly linear, so the renderer's interpolation of it is true to a few millimetres. */
#include "edge_map.h"

#include <math.h>
#include <stdlib.h>

enum { SIZE_MAX_PER_AXIS = 512 };
static const float margin = 1.0f; /* m of ocean around the water */

static void fit(EdgeMap *map, const Frame *frame) {
    for (int k = 0; k < 2; k++) {
        float low = INFINITY, high = -INFINITY;
        for (uint32_t i = 0; i < frame->live; i++) {
            low = fminf(low, frame->position[i][2 * k]);
            high = fmaxf(high, frame->position[i][2 * k]);
        }
        map->min[k] = low - margin;
        map->max[k] = high + margin;
        float cells = (map->max[k] - map->min[k]) / (2 * frame->spacing);
        map->size[k] = 2 + (uint32_t)fminf(cells, SIZE_MAX_PER_AXIS - 2);
    }
}

bool edge_map_make(EdgeMap *map, const SkiffSim *sim, const Frame *frame, Err *err) {
    *map = (EdgeMap){0};
    if (!frame->has_window || frame->live == 0)
        return true;
    fit(map, frame);
    uint32_t count = map->size[0] * map->size[1];
    float(*points)[4] = calloc(count, sizeof *points);
    map->distance = calloc(count, sizeof *map->distance);
    if (!points || !map->distance) {
        free(points);
        edge_map_free(map);
        return err_set(err, ERR_INPUT, "not enough memory for the map of the window's edge");
    }
    for (uint32_t i = 0; i < count; i++) {
        const uint32_t at[2] = {i % map->size[0], i / map->size[0]};
        for (int k = 0; k < 2; k++)
            points[i][2 * k] =
                map->min[k] + (float)at[k] * (map->max[k] - map->min[k]) / (float)(map->size[k] - 1);
        points[i][1] = (float)(frame->level - frame->origin[1]);
    }
    frame_window_distances(sim, (const float(*)[4])points, count, map->distance);
    for (uint32_t i = 0; i < count; i++)
        map->distance[i] = -map->distance[i]; /* the engine counts outwards */
    free(points);
    return true;
}

float edge_map_at(const EdgeMap *map, float x, float z) {
    const float point[2] = {x, z};
    uint32_t at[2];
    float part[2];
    for (int k = 0; k < 2; k++) {
        float place = (point[k] - map->min[k]) / (map->max[k] - map->min[k]) * (float)(map->size[k] - 1);
        if (!(place >= 0 && place < (float)(map->size[k] - 1)))
            return -INFINITY;
        at[k] = (uint32_t)place;
        part[k] = place - (float)at[k];
    }
    const float *near = map->distance + at[1] * map->size[0] + at[0], *far = near + map->size[0];
    return (near[0] * (1 - part[0]) + near[1] * part[0]) * (1 - part[1]) +
           (far[0] * (1 - part[0]) + far[1] * part[0]) * part[1];
}

void edge_map_free(EdgeMap *map) {
    free(map->distance);
    *map = (EdgeMap){0};
}
