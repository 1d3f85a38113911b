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

/* Sorts the particles by cell and, in groups, by row size, stably; those outside `domain` are removed and
 * counted in *removed, or are an error when `removed` is NULL (ERR_DIVERGED naming the particle). Cells come
 * from the particles' own bounds, so an empty sky costs nothing. */
bool grid_sort(Grid *grid, Particles *particles, float cell_size, const CellBounds *domain, uint32_t *removed,
               int threads, Err *err);
void grid_free(Grid *grid);

/* Parts of a slab: cell (x, y, z) of part k is cell (parts x + k, y, z) of the table of starts. */
static inline int grid_parts(const Grid *grid) {
    return grid->apart != NULL ? 2 : 1;
}

#endif
