/* Random numbers of a counter: the same number for the same place in the same stream, in whatever order and
 * on whatever thread it is asked for. splitmix64 [Steele et al. 2014]. */
#ifndef SKIFF_BASE_RANDOM_H
#define SKIFF_BASE_RANDOM_H

#include <stdint.h>

static inline uint64_t random_bits(uint64_t stream, uint64_t counter) {
    uint64_t z = stream * 0xd1342543de82ef95u + (counter + 1) * 0x9e3779b97f4a7c15u;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
}

/* From [0, 1). */
static inline double random_share(uint64_t stream, uint64_t counter) {
    return (double)(random_bits(stream, counter) >> 11) * 0x1p-53;
}

#endif
