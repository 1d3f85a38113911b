/* What the pair loops share: the instruction set they are compiled for (PASSES_ISA is plain, avx2 or avx512),
 * the kernel of a pair, and the entries of rows. Included by passes.c and search.c only. */
#ifndef SKIFF_PAIR_H
#define SKIFF_PAIR_H

#define PASSES_AVX512      1
#define PASSES_AVX2        2
#define PASSES_PLAIN       3
#define PASSES_avx512      PASSES_AVX512
#define PASSES_avx2        PASSES_AVX2
#define PASSES_plain       PASSES_PLAIN
#define PASSES_JOIN_(a, b) a##b
#define PASSES_JOIN(a, b)  PASSES_JOIN_(a, b)
#if PASSES_JOIN(PASSES_, PASSES_ISA) == PASSES_AVX512
#define SIMD_AVX512
#elif PASSES_JOIN(PASSES_, PASSES_ISA) == PASSES_AVX2
#define SIMD_AVX2
#endif
#define PASSES_TEXT_(a) #a
#define PASSES_TEXT(a)  PASSES_TEXT_(a)

/* `name` of this instruction set. */
#define PASSES_NAME(name) PASSES_JOIN(name, PASSES_ISA)

#include "passes.h"

/* -(dW/dr) / r is largest at r = 0, where it is 2 l / h: see kernel.h. */
static const float FACTOR_STEPS = 65535.0f / 2.0f;

/* -(dW/dr) / r in steps of l / h / FACTOR_STEPS, which grad W is minus x_i - x_j times, and W. What waits for
 * the root is kept short: the search is a chain of these. */
static inline void pair_kernel(const Kernel *kernel, Vf distance_sq, Vf *factor, Vf *weight) {
    const Vf steps = vf_set(FACTOR_STEPS), one = vf_set(1.0f);
    const Vf q_sq = vf_mul(distance_sq, vf_set(kernel->inv_support * kernel->inv_support));
    const Vf inv_q = vf_rsqrt(q_sq), q = vf_mul(q_sq, inv_q), p = vf_sub(one, q), p_sq = vf_mul(p, p);
    const Vm far = vf_less(vf_set(0.25f), q_sq);
    const Vf near_factor = vf_fnma(vf_set(3.0f * FACTOR_STEPS), q, vf_set(2.0f * FACTOR_STEPS));
    *factor = vf_select(far, vf_mul(vf_mul(steps, inv_q), p_sq), near_factor);
    const Vf near_weight = vf_fma(vf_mul(vf_set(-6.0f), q_sq), p, one);
    *weight = vf_mul(vf_set(kernel->w_scale), vf_select(far, vf_mul(p_sq, vf_add(p, p)), near_weight));
}

static inline float near_distance_sq(const Kernel *kernel) {
    const float distance = NEAR_SUPPORT * kernel->support;
    return distance * distance;
}

static inline uint16_t *entry_factor(const uint8_t *entries, uint32_t entry, bool wide) {
    return wide ? (uint16_t *)((const RowEntryWide *)entries)[entry].factor
                : (uint16_t *)((const RowEntry *)entries)[entry].factor;
}

/* Four floats of each neighbour of a slice. */
static inline void gather_neighbours(const Float4 *slice_base, const uint8_t *entries, uint32_t entry,
                                     bool wide, Vf *x, Vf *y, Vf *z, Vf *w) {
    if (wide)
        vf_gather4_i32(slice_base, ((const RowEntryWide *)entries)[entry].place, x, y, z, w);
    else
        vf_gather4_i16(slice_base, ((const RowEntry *)entries)[entry].place, x, y, z, w);
}

#endif
