/* Counting sort on one thread. Not for the fluid's own sort in a step: that is grid.c. */
#include "cell_grid.h"

#include <string.h>

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
