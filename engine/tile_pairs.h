/* Neighbours of the points of a tile or block, and the sums over them that say how much it is at rest. Double
 * precision, lengths in r. */
#ifndef SKIFF_TILE_PAIRS_H
#define SKIFF_TILE_PAIRS_H

#include "kernel.h"

#include "base/err.h"

#include <stdint.h>

enum { TILE_SUPPORT = 4 }; /* h, r */

typedef struct TilePairs {
    uint32_t count;
    bool periodic;
    double size[3]; /* of the box, r */
    double volume;  /* of a particle, r^3 */
    int threads;
    Kernel kernel;
    double (
        *position)[3]; /* in the box, or not farther from it than points have moved since the last search */
    double *density;   /* rho / rho0 */
    /* Candidates of point i: entries first[i] .. first[i + 1]; the first `used[i]` of them are its
     * neighbours. */
    uint64_t *first;
    uint32_t *used, *candidate, *neighbour;
    double (*gradient)[3]; /* V grad W, 1/r */
    uint64_t capacity;     /* entries */
    double (*searched)[3]; /* positions at the last search */
} TilePairs;

/* False with ERR_INPUT when memory is exhausted. tile_pairs_free in any case. */
bool tile_pairs_init(TilePairs *pairs, uint32_t count, int threads, Err *err);
void tile_pairs_free(TilePairs *pairs);
/* Finds the neighbours of the positions as they are, their gradients and the densities. */
bool tile_pairs_update(TilePairs *pairs, Err *err);
/* out = sum_j V (weight_i + weight_j) / 2 grad W_ij; weight NULL: all 1 */
void tile_pairs_gradient(const TilePairs *pairs, const double *weight, double (*out)[3]);
/* Shortest vector from point j to point i. */
void tile_pairs_vector(const TilePairs *pairs, uint32_t i, uint32_t j, double out[3]);

#endif
