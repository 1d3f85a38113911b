/* Cells of edge h over the fluid, and the stable sort of the particles into them.
 *
 * A slice waits for its longest row. So the arrays of particles are in the order of cells group by group
 * only: within a group of ROW_GROUP they go by the size of their last rows. The search, which wants the
 * particles of a cell side by side, has its own copy of the positions in the order of cells. */
#ifndef SKIFF_GRID_H
#define SKIFF_GRID_H

#include "particles.h"

typedef struct Grid {
    CellGrid cells;
    /* NULL, or before the sort [particles] 1: is sorted into a second part of its slab of cells, so that
     * the others, which get rows, fill their slices */
    const uint8_t *apart;
    /* [particles] in the order of cells, which CellGrid.start counts in: cell (with `apart` of 2 parts a
     * slab), index, position */
    uint32_t *cell, *member;
    float *x, *y, *z;
    uint32_t *order; /* [particles] the last sort: where each particle was before it */
    Buffer start_buffer, cell_buffer, member_buffer, point_buffer, order_buffer, unsorted_buffer,
        histogram_buffer;
} Grid;

typedef struct GridBounds {
    float min[3], max[3];
} GridBounds;

enum { GRID_MAX_CELLS = 1 << 27 };

/* Sorts the particles by cell and, in groups, by row size, stably; those outside `domain` are removed and
 * counted in *removed, or are an error when `removed` is NULL (ERR_DIVERGED naming the particle). Cells come
 * from the particles' own bounds, so an empty sky costs nothing. */
bool grid_sort(Grid *grid, Particles *particles, float cell_size, const GridBounds *domain, uint32_t *removed,
               int threads, Err *err);
void grid_free(Grid *grid);

/* Cell table over given bounds: origin and size set, one empty layer around (`margin` layers). False when it
 * would have more than GRID_MAX_CELLS. */
bool grid_layout(CellGrid *cells, const GridBounds *bounds, float cell_size, int margin);

/* m */
static inline float grid_centre(const CellGrid *cells, int axis) {
    return cells->origin[axis] + 0.5f * (float)cells->size[axis] / cells->inv_size;
}

/* Parts of a slab: cell (x, y, z) of part k is cell (parts x + k, y, z) of the table of starts. */
static inline int grid_parts(const Grid *grid) {
    return grid->apart != NULL ? 2 : 1;
}

static inline uint32_t grid_cell_of(const CellGrid *cells, const float *p) {
    int32_t c[3];
    for (int k = 0; k < 3; k++)
        c[k] = (int32_t)((p[k] - cells->origin[k]) * cells->inv_size);
    return (uint32_t)cell_grid_index(cells, c[0], c[1], c[2]);
}

#endif
