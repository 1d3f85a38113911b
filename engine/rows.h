/* The packed neighbour rows of one step: built once, streamed by every iteration. */
#ifndef SKIFF_ROWS_H
#define SKIFF_ROWS_H

#include "grid.h"
#include "skiff.h"

#include <stdatomic.h>

typedef struct RowShare {
    uint32_t next, end; /* entries of the pool this thread may still take */
    char padding[56];   /* a cache line each */
} RowShare;

typedef struct Rows {
    PairData pairs;
    PairData
        corrected; /* the same pairs with gradients that are right for linear fields, after rows_correct */
    uint16_t *neighbours; /* [particles] fluid and boundary */
    Standing beside;      /* what RowsJob.standing gives them; without it NULL */
    bool wide;
    /* pool of row entries: threads take chunks, slices take from their thread's chunk */
    Buffer pool, weights, slices, density, gradient_sum, neighbour_counts;
    uint32_t pool_entries;
    atomic_uint pool_used;
    RowShare shares[SKIFF_MAX_THREADS];
    Buffer gradients, corrected_sum, shape[2], push, apart;
    Buffer scratch; /* Scratch of every thread */
} Rows;

/* What rows are built from. */
typedef struct RowsJob {
    const Passes *passes;
    const Grid *grid;
    const Particles *particles;
    const Kernel *kernel;
    float volume;                /* m^3, of a particle */
    const uint8_t *frozen;       /* NULL, or [particles] 1: others see it, but it gets no row */
    const StandingSet *standing; /* NULL, or more water that does not move */
    int threads;
} RowsJob;
/* Neighbours, densities (fluid part) and gradient sums (fluid part, fixed-point units) of the sorted
 * particles. Grows the pool when it is too small, and turns to wide entries when offsets do not fit: both
 * happen in the first steps or never. ERR_DIVERGED: a particle has too many neighbours, and is named. */
bool rows_build(Rows *rows, const RowsJob *job, Err *err);
/* Room for `shape`, the moments that boundary_apply adds for rows_correct. */
bool rows_reserve_correction(Rows *rows, const Particles *particles, Err *err);
/* Makes `corrected` from rows that are complete, boundary and all. */
void rows_correct(Rows *rows, const Passes *passes, int threads);
void rows_free(Rows *rows);
Scratch *rows_scratch(Rows *rows, int thread);

#endif
