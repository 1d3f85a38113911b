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

/* -(dW/dr) / r in units of l / h, which grad W is minus x_i - x_j times, and W. */
static inline void pair_kernel(const Kernel *kernel, Vf distance_sq, Vf *factor, Vf *weight) {
    const Vf inv_r = vf_rsqrt(distance_sq);
    const Vf q = vf_mul(vf_mul(distance_sq, inv_r), vf_set(kernel->inv_support));
    const Vf p = vf_sub(vf_set(1.0f), q);
    const Vm far = vf_less(vf_set(0.5f), q);
    const Vf near_factor = vf_fnma(vf_set(3.0f), q, vf_set(2.0f));
    const Vf far_factor = vf_mul(vf_mul(vf_set(kernel->support), vf_mul(p, p)), inv_r);
    *factor = vf_select(far, far_factor, near_factor);
    const Vf near_weight = vf_fma(vf_mul(vf_set(-6.0f), vf_mul(q, q)), p, vf_set(1.0f));
    const Vf far_weight = vf_mul(vf_mul(p, p), vf_add(p, p));
    *weight = vf_mul(vf_set(kernel->w_scale), vf_select(far, far_weight, near_weight));
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
