/* Cells of one edge over a box: points sorted by them, and the points in and around one. The fluid, sorted in
 * every step, has a sort of its own on all threads (grid.h). */
#ifndef SKIFF_CELL_GRID_H
#define SKIFF_CELL_GRID_H

#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* A box along the axes; m. */
typedef struct CellBounds {
    float min[3], max[3];
} CellBounds;

/* Around nothing. */
static inline CellBounds cell_bounds_empty(void) {
    return (CellBounds){{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
}

static inline void cell_bounds_grow(CellBounds *bounds, const float p[3]) {
    for (int k = 0; k < 3; k++) {
        bounds->min[k] = p[k] < bounds->min[k] ? p[k] : bounds->min[k];
        bounds->max[k] = p[k] > bounds->max[k] ? p[k] : bounds->max[k];
    }
}

/* y fastest, then z, then x: the three cells of a column that a point of the middle one sees are one
 * contiguous run of points. */
typedef struct CellGrid {
    float origin[3];       /* m */
    float inv_size;        /* 1/m */
    int32_t size[3];       /* cells along x, y, z */
    const uint32_t *start; /* [cells + 1] first point of a cell */
} CellGrid;

/* Points begin to end - 1 in the order of cells. */
typedef struct CellRun {
    uint32_t begin, end;
} CellRun;

enum { CELL_RUNS = 9, CELL_GRID_MAX_CELLS = 1 << 27 };

/* The cell of a point that takes no part. */
#define CELL_NONE UINT32_MAX

static inline int32_t cell_grid_index(const CellGrid *grid, int32_t x, int32_t y, int32_t z) {
    return (x * grid->size[2] + z) * grid->size[1] + y;
}

static inline size_t cell_grid_count(const CellGrid *grid) {
    return (size_t)grid->size[0] * (size_t)grid->size[1] * (size_t)grid->size[2];
}

/* Middle of the grid along an axis, m. */
static inline float cell_grid_centre(const CellGrid *grid, int axis) {
    return grid->origin[axis] + 0.5f * (float)grid->size[axis] / grid->inv_size;
}

/* The cell of a point within the bounds that the grid was laid out for. */
static inline uint32_t cell_grid_at(const CellGrid *grid, const float p[3]) {
    int32_t c[3];
    for (int k = 0; k < 3; k++)
        c[k] = (int32_t)((p[k] - grid->origin[k]) * grid->inv_size);
    return (uint32_t)cell_grid_index(grid, c[0], c[1], c[2]);
}

/* Sets origin and size so that there are `margin` empty layers of cells around the bounds. False when there
 * would be more than CELL_GRID_MAX_CELLS. */
bool cell_grid_layout(CellGrid *grid, const CellBounds *bounds, float cell_size, int margin);

/* The cell of p when all cells around it are in the grid, too; else -1. */
static inline int32_t cell_grid_inner(const CellGrid *grid, const float p[3]) {
    int32_t c[3];
    for (int k = 0; k < 3; k++) {
        const float at = (p[k] - grid->origin[k]) * grid->inv_size;
        if (!(at >= 1.0f && at < (float)(grid->size[k] - 1)))
            return -1;
        c[k] = (int32_t)at;
    }
    return cell_grid_index(grid, c[0], c[1], c[2]);
}

/* Run 0 to CELL_RUNS - 1 of the 27 cells in and around an inner cell: a column's three each. */
static inline CellRun cell_grid_run(const CellGrid *grid, int32_t cell, int run) {
    const int32_t column = grid->size[1], slab = grid->size[1] * grid->size[2];
    const int32_t middle = cell + (run / 3 - 1) * slab + (run % 3 - 1) * column;
    return (CellRun){grid->start[middle - 1], grid->start[middle + 2]};
}

/* Stable counting sort of points of which the cells are known, CELL_NONE those that take no part. Fills
 * start[cell_count + 1] and order: the points of cell c are order[start[c]] to order[start[c + 1] - 1], in
 * the order in which they were given. Their number. */
uint32_t cell_grid_sort(const uint32_t *cell, uint32_t count, size_t cell_count, uint32_t *start,
                        uint32_t *order);

#endif
