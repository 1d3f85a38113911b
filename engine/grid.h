/* Cells of edge h over the fluid, and the stable sort of the particles into them.
 *
 * A slice waits for its longest row. So the arrays of particles are in the order of cells block by block
 * only: within a block those come first that get rows, the edge of a window after them, and of each kind
 * within a group of ROW_GROUP they go by the size of their last rows. The search, which wants the particles
 * of a cell side by side, has its own copy of the positions in the order of cells. */
#ifndef SKIFF_GRID_H
#define SKIFF_GRID_H

#include "particles.h"

typedef struct Grid {
    CellGrid cells;
    /* Before a sort, which takes it: NULL, or [particles] not 0: goes behind the others of its block, so that
     * these, which get rows, fill their slices */
    const uint8_t *apart;
    /* [particles] in the order of cells, which CellGrid.start counts in: cell, index, position */
    uint32_t *cell, *member;
    float *x, *y, *z;
    uint32_t *visits; /* [particles] group by group as the arrays are, but within it in the order of cells:
                       * the places in that order */
    uint32_t *order;  /* [particles] the last sort: where each particle was before it */
    Buffer start_buffer, cell_buffer, member_buffer, point_buffer, order_buffer, visit_buffer,
        unsorted_buffer, histogram_buffer;
} Grid;

/* Sorts the particles by cell and, in groups, by row size, stably; those outside `domain` are removed and
 * counted in *removed, or are an error when `removed` is NULL (ERR_DIVERGED naming the particle). Cells come
 * from the particles' own bounds, so an empty sky costs nothing. */
bool grid_sort(Grid *grid, Particles *particles, float cell_size, const CellBounds *domain, uint32_t *removed,
               int threads, Err *err);
void grid_free(Grid *grid);

#endif
