#include "standing.h"

#include <assert.h>
#include <math.h>

bool standing_reserve(StandingWater *water, uint32_t capacity, Err *err) {
    if (capacity <= water->capacity)
        return true;
    if (!buffer_reserve(&water->point_buffer, "standing water", capacity * sizeof(Float4), err))
        return false;
    water->points = water->point_buffer.data;
    water->capacity = capacity;
    return true;
}

void standing_add(StandingWater *water, const float position[3], float pressure) {
    assert(water->count < water->capacity);
    float *point = water->points[water->count++];
    memcpy(point, position, 3 * sizeof(float));
    point[3] = pressure;
}

void standing_scale(StandingWater *water, float factor) {
    Float4 *sorted = (Float4 *)water->set.points;
    for (uint32_t i = 0; i < water->count; i++) {
        water->points[i][3] *= factor;
        sorted[i][3] *= factor;
    }
}

static bool reserve_sorted(StandingWater *water, Err *err) {
    const size_t cells = cell_grid_count(&water->set.grid), padded = water->count + (size_t)SLICE;
    if (!buffer_reserve(&water->sorted, "standing water by cell",
                        padded * (sizeof(Float4) + 3 * sizeof(float)), err) ||
        !buffer_reserve(&water->cells, "cells of standing water", (size_t)2 * water->count * sizeof(uint32_t),
                        err) ||
        !buffer_reserve(&water->start, "cell starts of standing water", (cells + 1) * sizeof(uint32_t), err))
        return false;
    Float4 *points = water->sorted.data;
    float *x = (float *)(points + padded);
    water->set.points = (const Float4 *)points;
    water->set.x = x;
    water->set.y = x + padded;
    water->set.z = x + 2 * padded;
    water->set.grid.start = water->start.data;
    return true;
}

static bool lay_out(StandingWater *water, float cell_size, Err *err) {
    CellBounds bounds = cell_bounds_empty();
    for (uint32_t i = 0; i < water->count; i++)
        cell_bounds_grow(&bounds, water->points[i]);
    /* two empty layers: the 27 cells around an occupied one, and around those, exist */
    return cell_grid_layout(&water->set.grid, &bounds, cell_size, 2) ||
           err_set(err, ERR_DIVERGED, "the water around a fill spreads over more than %d cells of %g m",
                   CELL_GRID_MAX_CELLS, (double)cell_size);
}

bool standing_sort(StandingWater *water, float cell_size, Err *err) {
    StandingSet *set = &water->set;
    set->count = water->count;
    if (water->count == 0)
        return true;
    if (!lay_out(water, cell_size, err) || !reserve_sorted(water, err))
        return false;
    uint32_t *cell = water->cells.data, *order = cell + water->count;
    for (uint32_t i = 0; i < water->count; i++)
        cell[i] = cell_grid_at(&set->grid, water->points[i]);
    cell_grid_sort(cell, water->count, cell_grid_count(&set->grid), water->start.data, order);
    float *x = (float *)set->x, *y = (float *)set->y, *z = (float *)set->z;
    Float4 *points = (Float4 *)set->points;
    for (uint32_t k = 0; k < water->count; k++) {
        const float *point = water->points[order[k]];
        x[k] = point[0];
        y[k] = point[1];
        z[k] = point[2];
        memcpy(points[k], point, sizeof points[k]);
    }
    return true;
}

void standing_free(StandingWater *water) {
    buffer_free(&water->point_buffer);
    buffer_free(&water->sorted);
    buffer_free(&water->cells);
    buffer_free(&water->start);
    *water = (StandingWater){0};
}
