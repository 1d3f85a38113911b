/* Layout, and a counting sort on one thread. Not for the fluid's own sort in a step: that is grid.c. */
#include "cell_grid.h"

#include <string.h>

bool cell_grid_layout(CellGrid *grid, const CellBounds *bounds, float cell_size, int margin) {
    double total = 1.0;
    grid->inv_size = 1.0f / cell_size;
    for (int k = 0; k < 3; k++) {
        /* origins on multiples of the cell size: a particle changes cell only when it moves, not when the
         * bounds do */
        double low = floor((double)bounds->min[k] / cell_size) - margin;
        const double high = floor((double)bounds->max[k] / cell_size) + margin;
        if (!(high - low < (double)CELL_GRID_MAX_CELLS))
            return false;
        grid->origin[k] = (float)(low * cell_size);
        /* rounding may put the lowest point into the cell below, which is the margin's: one cell more then */
        if ((bounds->min[k] - grid->origin[k]) * grid->inv_size < (float)margin)
            grid->origin[k] = (float)(--low * cell_size);
        /* one more for rounding between the origin and the bounds */
        grid->size[k] = (int32_t)(high - low) + 2;
        total *= grid->size[k];
    }
    return total <= CELL_GRID_MAX_CELLS;
}

uint32_t cell_grid_sort(const uint32_t *cell, uint32_t count, size_t cell_count, uint32_t *start,
                        uint32_t *order) {
    uint32_t total = 0;
    memset(start, 0, (cell_count + 1) * sizeof *start);
    for (uint32_t i = 0; i < count; i++)
        if (cell[i] != CELL_NONE)
            start[cell[i]]++;
    for (size_t c = 0; c < cell_count; c++)
        start[c] = total += start[c];
    start[cell_count] = total;
    /* from the ends of the cells backwards, which leaves their starts */
    for (uint32_t i = count; i-- > 0;)
        if (cell[i] != CELL_NONE)
            order[--start[cell[i]]] = i;
    return total;
}
