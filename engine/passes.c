/* The pair loops, compiled once per instruction set (PASSES_ISA is plain, avx2 or avx512; see passes.h for
 * the ideas).
 *
 * A particle is a lane: sixteen particles advance together through their k-th neighbours. Every sum is
 * thereby taken over the neighbours in row order with one fused multiply-add each, whatever the register
 * width, and no horizontal sum is needed. */

#include "pair.h"

/* ---- The operators of the pressure solves ---- */

/* The rows are streamed once a pass, from beyond the second cache: asking this far ahead hides its latency.
 */
enum { PREFETCH_ENTRIES = 48 };

static inline void prefetch_entry(const uint8_t *entries, uint32_t entry, bool wide) {
    __builtin_prefetch(entries + (size_t)entry * (wide ? sizeof(RowEntryWide) : sizeof(RowEntry)));
}

static inline void own_arm(const PairData *pairs, Vf x, Vf y, Vf z, Vf arm[3]) {
    arm[0] = vf_sub(x, vf_set(pairs->centre[0]));
    arm[1] = vf_sub(y, vf_set(pairs->centre[1]));
    arm[2] = vf_sub(z, vf_set(pairs->centre[2]));
}

/* Inlined where `wide` is known: it is asked in the innermost loop. */
static inline __attribute__((always_inline)) void
accelerate_slices(const PairData *pairs, const AccelerateJob *job, uint32_t block, const bool wide) {
    const Vf unit = vf_set(-job->scale * pairs->factor_unit), scale = vf_set(job->scale);
    for (uint32_t slice = block * BLOCK_SLICES; slice < (block + 1) * BLOCK_SLICES; slice++) {
        const uint32_t first = slice * SLICE, begin = pairs->slices[slice].start;
        const Float4 *slice_operand = job->operand + first;
        Vf own_x, own_y, own_z, own_p, x = vf_zero(), y = vf_zero(), z = vf_zero();
        vf_load4(slice_operand, &own_x, &own_y, &own_z, &own_p);
        for (uint32_t entry = begin; entry < begin + pairs->slices[slice].length; entry++) {
            prefetch_entry(pairs->entries, entry + PREFETCH_ENTRIES, wide);
            Vf nx, ny, nz, p;
            gather_neighbours(slice_operand, pairs->entries, entry, wide, &nx, &ny, &nz, &p);
            const Vf push = vf_mul(vf_load_u16(entry_factor(pairs->entries, entry, wide)), p);
            x = vf_fma(push, vf_sub(own_x, nx), x);
            y = vf_fma(push, vf_sub(own_y, ny), y);
            z = vf_fma(push, vf_sub(own_z, nz), z);
        }
        Vf gx, gy, gz, unused, bx = vf_zero(), by = vf_zero(), bz = vf_zero();
        vf_load4(pairs->gradient_sum + first, &gx, &gy, &gz, &unused);
        if (job->base != NULL) {
            vf_load4(job->base + first, &bx, &by, &bz, &unused);
            bx = vf_add(bx, vf_set(job->push[0]));
            by = vf_add(by, vf_set(job->push[1]));
            bz = vf_add(bz, vf_set(job->push[2]));
        }
        own_p = vf_mul(scale, own_p);
        x = vf_fma(own_p, gx, vf_fma(x, unit, bx));
        y = vf_fma(own_p, gy, vf_fma(y, unit, by));
        z = vf_fma(own_p, gz, vf_fma(z, unit, bz));
        Vf arm[3];
        own_arm(pairs, own_x, own_y, own_z, arm);
        vf_store4(job->result + first, x, y, z, vf_fma(arm[0], x, vf_fma(arm[1], y, vf_mul(arm[2], z))));
    }
}

static inline void prefetch_gradients(const PairData *pairs, uint32_t entry) {
    const char *at = (const char *)(pairs->gradients + (size_t)entry * 3 * SLICE);
    __builtin_prefetch(at);
    __builtin_prefetch(at + 64);
}

static void accelerate_corrected(const PairData *pairs, const AccelerateJob *job, uint32_t block) {
    const Vf unit = vf_set(job->scale * pairs->gradient_unit), scale = vf_set(job->scale);
    for (uint32_t slice = block * BLOCK_SLICES; slice < (block + 1) * BLOCK_SLICES; slice++) {
        const uint32_t first = slice * SLICE, begin = pairs->slices[slice].start;
        Vf own[3], own_p, sum[3] = {vf_zero(), vf_zero(), vf_zero()};
        vf_load4(job->operand + first, &own[0], &own[1], &own[2], &own_p);
        for (uint32_t entry = begin; entry < begin + pairs->slices[slice].length; entry++) {
            prefetch_entry(pairs->entries, entry + PREFETCH_ENTRIES, pairs->wide);
            prefetch_gradients(pairs, entry + PREFETCH_ENTRIES / 2);
            Vf unused[3], p;
            gather_neighbours(job->operand + first, pairs->entries, entry, pairs->wide, &unused[0],
                              &unused[1], &unused[2], &p);
            const int16_t *gradient = pairs->gradients + (size_t)entry * 3 * SLICE;
            for (int k = 0; k < 3; k++)
                sum[k] = vf_fma(p, vf_load_i16(gradient + k * SLICE), sum[k]);
        }
        Vf g[3], base[3] = {vf_zero(), vf_zero(), vf_zero()}, arm[3], unused, moment = vf_zero();
        vf_load4(pairs->gradient_sum + first, &g[0], &g[1], &g[2], &unused);
        if (job->base != NULL)
            vf_load4(job->base + first, &base[0], &base[1], &base[2], &unused);
        for (int k = 0; job->base != NULL && k < 3; k++)
            base[k] = vf_add(base[k], vf_set(job->push[k]));
        own_p = vf_mul(scale, own_p);
        own_arm(pairs, own[0], own[1], own[2], arm);
        for (int k = 0; k < 3; k++) {
            sum[k] = vf_fma(own_p, g[k], vf_fma(sum[k], unit, base[k]));
            moment = vf_fma(arm[k], sum[k], moment);
        }
        vf_store4(job->result + first, sum[0], sum[1], sum[2], moment);
    }
}

static void accelerate(const PairData *pairs, const AccelerateJob *job, uint32_t block) {
    if (pairs->gradients != NULL)
        accelerate_corrected(pairs, job, block);
    else if (pairs->wide)
        accelerate_slices(pairs, job, block, true);
    else
        accelerate_slices(pairs, job, block, false);
}

static inline __attribute__((always_inline)) void
divergence_slices(const PairData *pairs, const Float4 *v, float *result, uint32_t block, const bool wide) {
    for (uint32_t slice = block * BLOCK_SLICES; slice < (block + 1) * BLOCK_SLICES; slice++) {
        const uint32_t first = slice * SLICE, begin = pairs->slices[slice].start;
        const Float4 *slice_v = v + first;
        Vf sum_x = vf_zero(), sum_y = vf_zero(), sum_z = vf_zero(), moments = vf_zero(), x, y, z, moment;
        for (uint32_t entry = begin; entry < begin + pairs->slices[slice].length; entry++) {
            prefetch_entry(pairs->entries, entry + PREFETCH_ENTRIES, wide);
            gather_neighbours(slice_v, pairs->entries, entry, wide, &x, &y, &z, &moment);
            const Vf factor = vf_load_u16(entry_factor(pairs->entries, entry, wide));
            sum_x = vf_fma(factor, x, sum_x);
            sum_y = vf_fma(factor, y, sum_y);
            sum_z = vf_fma(factor, z, sum_z);
            moments = vf_fma(factor, moment, moments);
        }
        Vf gx, gy, gz, unused, arm[3];
        vf_load4(pairs->position + first, &x, &y, &z, &unused);
        own_arm(pairs, x, y, z, arm);
        vf_load4(pairs->gradient_sum + first, &gx, &gy, &gz, &unused);
        vf_load4(slice_v, &x, &y, &z, &unused);
        const Vf along =
            vf_fma(arm[0], sum_x, vf_fma(arm[1], sum_y, vf_fma(arm[2], sum_z, vf_sub(vf_zero(), moments))));
        vf_store(result + first,
                 vf_fma(x, gx, vf_fma(y, gy, vf_fma(z, gz, vf_mul(along, vf_set(pairs->factor_unit))))));
    }
}

static void divergence_corrected(const PairData *pairs, const Float4 *v, float *result, uint32_t block) {
    for (uint32_t slice = block * BLOCK_SLICES; slice < (block + 1) * BLOCK_SLICES; slice++) {
        const uint32_t first = slice * SLICE, begin = pairs->slices[slice].start;
        Vf sum = vf_zero(), w[3], g[3], unused;
        for (uint32_t entry = begin; entry < begin + pairs->slices[slice].length; entry++) {
            prefetch_entry(pairs->entries, entry + PREFETCH_ENTRIES, pairs->wide);
            prefetch_gradients(pairs, entry + PREFETCH_ENTRIES / 2);
            gather_neighbours(v + first, pairs->entries, entry, pairs->wide, &w[0], &w[1], &w[2], &unused);
            const int16_t *gradient = pairs->gradients + (size_t)entry * 3 * SLICE;
            for (int k = 0; k < 3; k++)
                sum = vf_fma(w[k], vf_load_i16(gradient + k * SLICE), sum);
        }
        sum = vf_mul(vf_set(-pairs->gradient_unit), sum);
        vf_load4(pairs->gradient_sum + first, &g[0], &g[1], &g[2], &unused);
        vf_load4(v + first, &w[0], &w[1], &w[2], &unused);
        for (int k = 0; k < 3; k++)
            sum = vf_fma(w[k], g[k], sum);
        vf_store(result + first, sum);
    }
}

static void divergence(const PairData *pairs, const Float4 *v, float *result, uint32_t block) {
    if (pairs->gradients != NULL)
        divergence_corrected(pairs, v, result, block);
    else if (pairs->wide)
        divergence_slices(pairs, v, result, block, true);
    else
        divergence_slices(pairs, v, result, block, false);
}

/* ---- Corrected gradients ---- */

/* Adjugate (xx, yy, zz, xy, xz, yz) of a symmetric matrix in the same order; returns the determinant. */
static inline Vf adjugate(const Vf m[6], Vf adjugate[6]) {
    const Vf zero = vf_zero();
    adjugate[0] = vf_fma(m[1], m[2], vf_mul(vf_sub(zero, m[5]), m[5]));
    adjugate[1] = vf_fma(m[0], m[2], vf_mul(vf_sub(zero, m[4]), m[4]));
    adjugate[2] = vf_fma(m[0], m[1], vf_mul(vf_sub(zero, m[3]), m[3]));
    adjugate[3] = vf_fma(m[4], m[5], vf_mul(vf_sub(zero, m[3]), m[2]));
    adjugate[4] = vf_fma(m[3], m[5], vf_mul(vf_sub(zero, m[4]), m[1]));
    adjugate[5] = vf_fma(m[3], m[4], vf_mul(vf_sub(zero, m[5]), m[0]));
    return vf_fma(m[0], adjugate[0], vf_fma(m[3], adjugate[3], vf_mul(m[4], adjugate[4])));
}

/* Where neighbours are few, or lie in a plane, B fades to the identity: the determinant of the moments is 1
 * inside water, about 1/2 at a flat surface. */
static void shape(const CorrectionJob *job, uint32_t block) {
    static const float NO_CORRECTION = 0.35f, FULL_CORRECTION = 0.65f, LEAST_DENSITY = 0.8f;
    const PairData *pairs = job->pairs;
    const Vf one = vf_set(1.0f);
    for (uint32_t slice = block * BLOCK_SLICES; slice < (block + 1) * BLOCK_SLICES; slice++) {
        const uint32_t first = slice * SLICE, begin = pairs->slices[slice].start;
        Vf own[3], d[3], unused, sum[6], wall[6], cofactors[6];
        for (int k = 0; k < 6; k++)
            sum[k] = vf_zero();
        vf_load4(pairs->position + first, &own[0], &own[1], &own[2], &unused);
        for (uint32_t entry = begin; entry < begin + pairs->slices[slice].length; entry++) {
            prefetch_entry(pairs->entries, entry + PREFETCH_ENTRIES, pairs->wide);
            gather_neighbours(pairs->position + first, pairs->entries, entry, pairs->wide, &d[0], &d[1],
                              &d[2], &unused);
            const Vf factor = vf_load_u16(entry_factor(pairs->entries, entry, pairs->wide));
            for (int k = 0; k < 3; k++)
                d[k] = vf_sub(own[k], d[k]);
            const Vf fx = vf_mul(factor, d[0]), fy = vf_mul(factor, d[1]);
            sum[0] = vf_fma(fx, d[0], sum[0]);
            sum[1] = vf_fma(fy, d[1], sum[1]);
            sum[2] = vf_fma(vf_mul(factor, d[2]), d[2], sum[2]);
            sum[3] = vf_fma(fx, d[1], sum[3]);
            sum[4] = vf_fma(fx, d[2], sum[4]);
            sum[5] = vf_fma(fy, d[2], sum[5]);
        }
        vf_load4(job->shape[0] + first, &wall[0], &wall[1], &wall[2], &unused);
        vf_load4(job->shape[1] + first, &wall[3], &wall[4], &wall[5], &unused);
        for (int k = 0; k < 6; k++)
            sum[k] = vf_fma(sum[k], vf_set(pairs->factor_unit), wall[k]);
        const Vf determinant = adjugate(sum, cofactors), least = vf_set(NO_CORRECTION);
        const Vm sound =
            vf_less(least, determinant) & vf_less(vf_set(LEAST_DENSITY), vf_load(pairs->density + first));
        Vf share = vf_mul(vf_sub(determinant, least), vf_set(1.0f / (FULL_CORRECTION - NO_CORRECTION)));
        share = vf_mask(sound, vf_select(vf_less(one, share), one, share));
        const Vf root = vf_rsqrt(vf_select(sound, determinant, one));
        const Vf inverse = vf_mul(share, vf_mul(root, root)), rest = vf_sub(one, share);
        for (int k = 0; k < 6; k++)
            cofactors[k] = k < 3 ? vf_fma(inverse, cofactors[k], rest) : vf_mul(inverse, cofactors[k]);
        vf_store4(job->shape[0] + first, cofactors[0], cofactors[1], cofactors[2], vf_zero());
        vf_store4(job->shape[1] + first, cofactors[3], cofactors[4], cofactors[5], vf_zero());
    }
}

/* Rounded to a whole number of units within 16 bits. */
static inline void store_gradient(int16_t *to, Vf value) {
    const Vf limit = vf_set(32767.0f), lowest = vf_set(-32767.0f);
    value = vf_select(vf_less(limit, value), limit, value);
    vf_store_i16(to, vf_select(vf_less(value, lowest), lowest, value));
}

static void correct(const CorrectionJob *job, uint32_t block) {
    const PairData *pairs = job->pairs;
    const Vf half = vf_set(-0.5f * pairs->factor_unit / job->gradient_unit);
    const Vf unit = vf_set(job->gradient_unit), factor_unit = vf_set(pairs->factor_unit);
    for (uint32_t slice = block * BLOCK_SLICES; slice < (block + 1) * BLOCK_SLICES; slice++) {
        const uint32_t first = slice * SLICE, begin = pairs->slices[slice].start;
        Vf own[3], own_b[6], b[6], d[3], unused, raw[3], sum[3], squares = vf_zero();
        for (int k = 0; k < 3; k++)
            raw[k] = sum[k] = vf_zero();
        vf_load4(pairs->position + first, &own[0], &own[1], &own[2], &unused);
        vf_load4(job->shape[0] + first, &own_b[0], &own_b[1], &own_b[2], &unused);
        vf_load4(job->shape[1] + first, &own_b[3], &own_b[4], &own_b[5], &unused);
        for (uint32_t entry = begin; entry < begin + pairs->slices[slice].length; entry++) {
            prefetch_entry(pairs->entries, entry + PREFETCH_ENTRIES, pairs->wide);
            gather_neighbours(pairs->position + first, pairs->entries, entry, pairs->wide, &d[0], &d[1],
                              &d[2], &unused);
            gather_neighbours((const Float4 *)job->shape[0] + first, pairs->entries, entry, pairs->wide,
                              &b[0], &b[1], &b[2], &unused);
            gather_neighbours((const Float4 *)job->shape[1] + first, pairs->entries, entry, pairs->wide,
                              &b[3], &b[4], &b[5], &unused);
            const Vf factor = vf_load_u16(entry_factor(pairs->entries, entry, pairs->wide));
            for (int k = 0; k < 3; k++) {
                d[k] = vf_mul(factor, vf_sub(own[k], d[k]));
                raw[k] = vf_add(raw[k], d[k]);
                d[k] = vf_mul(half, d[k]);
            }
            for (int k = 0; k < 6; k++)
                b[k] = vf_add(own_b[k], b[k]);
            const Vf g[3] = {vf_fma(b[0], d[0], vf_fma(b[3], d[1], vf_mul(b[4], d[2]))),
                             vf_fma(b[3], d[0], vf_fma(b[1], d[1], vf_mul(b[5], d[2]))),
                             vf_fma(b[4], d[0], vf_fma(b[5], d[1], vf_mul(b[2], d[2])))};
            int16_t *to = job->gradients + (size_t)entry * 3 * SLICE;
            for (int k = 0; k < 3; k++) {
                store_gradient(to + k * SLICE, g[k]);
                const Vf stored = vf_load_i16(to + k * SLICE);
                sum[k] = vf_add(sum[k], stored);
                squares = vf_fma(stored, stored, squares);
            }
        }
        /* what walls and bodies add is what the plain sum has beyond its pairs */
        Vf g[3], norm = vf_mul(vf_mul(unit, unit), squares);
        vf_load4(pairs->gradient_sum + first, &g[0], &g[1], &g[2], &unused);
        for (int k = 0; k < 3; k++) {
            g[k] = vf_fma(unit, sum[k], vf_fma(factor_unit, raw[k], g[k]));
            norm = vf_fma(g[k], g[k], norm);
        }
        vf_store4(job->gradient_sum + first, g[0], g[1], g[2], norm);
    }
}

/* ---- Viscosity and calming ---- */

static inline Vf vf_load_weight(const PairData *pairs, uint32_t entry) {
    return vf_load_i16(pairs->weights + (size_t)entry * SLICE);
}

/* Turns positions into distances x_j - x_i in units of the support radius. The weight of neighbours that are
 * not near becomes 0: the same for both of a pair, wherever they stand in their rows. */
static inline void turn_to_arms(const PairData *pairs, const Vf own[3], Vf arm[3], Vf *weight) {
    for (int k = 0; k < 3; k++)
        arm[k] = vf_sub(arm[k], own[k]);
    const Vf distance_sq = vf_fma(arm[0], arm[0], vf_fma(arm[1], arm[1], vf_mul(arm[2], arm[2])));
    *weight = vf_mask(vf_less(distance_sq, vf_set(near_distance_sq(&pairs->kernel))), *weight);
    for (int k = 0; k < 3; k++)
        arm[k] = vf_mul(vf_set(pairs->kernel.inv_support), arm[k]);
}

/* A position, and A of sixteen particles: of its nine numbers as much as eight bits tell, so that two gathers
 * fetch all of it. Both of a pair use the same rounded ones. */
typedef struct Strain {
    Vf x[3], a[9]; /* A column by column */
} Strain;

static inline void unpack_strain(Strain *strain, Vf first, const Vf rest[4]) {
    Vf *a = strain->a;
    a[0] = vf_high(first);
    a[1] = vf_low(first);
    for (int k = 0; k < 3; k++) {
        a[2 + 2 * k] = vf_high(rest[k]);
        a[3 + 2 * k] = vf_low(rest[k]);
    }
    a[8] = rest[3];
}

static inline void load_strain(const ForceJob *job, uint32_t first, Strain *strain) {
    Vf pair, rest[4];
    vf_load4(job->strain[0] + first, &strain->x[0], &strain->x[1], &strain->x[2], &pair);
    vf_load4(job->strain[1] + first, &rest[0], &rest[1], &rest[2], &rest[3]);
    unpack_strain(strain, pair, rest);
}

static inline void gather_strain(const ForceJob *job, uint32_t first, uint32_t entry, Strain *strain) {
    const PairData *pairs = job->pairs;
    Vf pair, rest[4];
    gather_neighbours(job->strain[0] + first, pairs->entries, entry, pairs->wide, &strain->x[0],
                      &strain->x[1], &strain->x[2], &pair);
    gather_neighbours(job->strain[1] + first, pairs->entries, entry, pairs->wide, &rest[0], &rest[1],
                      &rest[2], &rest[3]);
    unpack_strain(strain, pair, rest);
}

static inline void store_strain(const StrainJob *job, uint32_t first, const Strain *strain) {
    const Vf *a = strain->a;
    vf_store4(job->strain[0] + first, strain->x[0], strain->x[1], strain->x[2], vf_pair(a[0], a[1]));
    vf_store4(job->strain[1] + first, vf_pair(a[2], a[3]), vf_pair(a[4], a[5]), vf_pair(a[6], a[7]), a[8]);
}

/* A = [sum w (v_j - v_i) d^T] [sum w d d^T + small I]^-1, w = W_ij / W(0), d in supports. `small` keeps the
 * inverse tame where neighbours lie in a plane or a line. */
static void strain(const StrainJob *job, uint32_t block) {
    const PairData *pairs = job->pairs;
    const Vf small = vf_set(0.008f * 32767.0f);
    for (uint32_t slice = block * BLOCK_SLICES; slice < (block + 1) * BLOCK_SLICES; slice++) {
        const uint32_t first = slice * SLICE, begin = pairs->slices[slice].start;
        Strain own;
        Vf own_v[3], unused;
        vf_load4(pairs->position + first, &own.x[0], &own.x[1], &own.x[2], &unused);
        vf_load4(job->velocity + first, &own_v[0], &own_v[1], &own_v[2], &unused);
        Vf xx = small, yy = small, zz = small, xy = vf_zero(), xz = vf_zero(), yz = vf_zero();
        Vf b[3][3];
        for (int r = 0; r < 3; r++)
            for (int c = 0; c < 3; c++)
                b[r][c] = vf_zero();
        for (uint32_t entry = begin; entry < begin + pairs->slices[slice].near; entry++) {
            __builtin_prefetch(pairs->weights + (size_t)(entry + PREFETCH_ENTRIES) * SLICE);
            prefetch_entry(pairs->entries, entry + PREFETCH_ENTRIES, pairs->wide);
            Vf d[3], v[3], wd[3];
            Vf weight = vf_load_weight(pairs, entry);
            gather_neighbours(pairs->position + first, pairs->entries, entry, pairs->wide, &d[0], &d[1],
                              &d[2], &unused);
            turn_to_arms(pairs, own.x, d, &weight);
            gather_neighbours(job->velocity + first, pairs->entries, entry, pairs->wide, &v[0], &v[1], &v[2],
                              &unused);
            for (int k = 0; k < 3; k++) {
                v[k] = vf_sub(v[k], own_v[k]);
                wd[k] = vf_mul(weight, d[k]);
            }
            xx = vf_fma(wd[0], d[0], xx);
            yy = vf_fma(wd[1], d[1], yy);
            zz = vf_fma(wd[2], d[2], zz);
            xy = vf_fma(wd[0], d[1], xy);
            xz = vf_fma(wd[0], d[2], xz);
            yz = vf_fma(wd[1], d[2], yz);
            for (int r = 0; r < 3; r++)
                for (int c = 0; c < 3; c++)
                    b[r][c] = vf_fma(v[r], wd[c], b[r][c]);
        }
        const Vf moments[6] = {xx, yy, zz, xy, xz, yz};
        Vf c6[6];
        const Vf root = vf_rsqrt(adjugate(moments, c6));
        const Vf inv = vf_mul(root, root);
        const Vf columns[3][3] = {{c6[0], c6[3], c6[4]}, {c6[3], c6[1], c6[5]}, {c6[4], c6[5], c6[2]}};
        for (int c = 0; c < 3; c++)
            for (int r = 0; r < 3; r++)
                own.a[3 * c + r] =
                    vf_mul(inv, vf_fma(b[r][0], columns[c][0],
                                       vf_fma(b[r][1], columns[c][1], vf_mul(b[r][2], columns[c][2]))));
        store_strain(job, first, &own);
    }
}

/* Adds one neighbour's share of calming to sum: w min(1, limit / |e|) e, where e = v_i - v_j + (A_i + A_j) d
 * / 2 is what the two velocities differ by beyond the linear field between them. */
static inline void calm_pair(const ForceJob *job, uint32_t entry, uint32_t first, const Strain *own,
                             Vf weight, Vf e[3], Vf sum[3]) {
    Strain other;
    gather_strain(job, first, entry, &other);
    turn_to_arms(job->pairs, own->x, other.x, &weight);
    Vf size = vf_set(1e-12f);
    for (int c = 0; c < 3; c++) {
        const Vf half_d = vf_mul(vf_set(0.5f), other.x[c]);
        for (int k = 0; k < 3; k++)
            e[k] = vf_fma(vf_add(own->a[3 * c + k], other.a[3 * c + k]), half_d, e[k]);
    }
    for (int k = 0; k < 3; k++)
        size = vf_fma(e[k], e[k], size);
    const Vf limited = vf_mul(vf_set(job->calming_limit), vf_rsqrt(size)), one = vf_set(1.0f);
    const Vf share = vf_mul(weight, vf_select(vf_less(limited, one), limited, one));
    for (int k = 0; k < 3; k++)
        sum[k] = vf_fma(share, e[k], sum[k]);
}

/* XSPH [Schechter & Bridson 2012] without its division by the density: that makes the weights symmetric, and
 * what i gives j gets. The weights come from the search, in a stream of their own: making them again from the
 * positions costs twice this pass. Calming does the same to what is left of the difference when the linear
 * fields around both are taken out, so that it meets disorder and spares waves; being antisymmetric in the
 * two as well it keeps momentum too. */
static inline Vf viscous_pair(const ForceJob *job, uint32_t entry, uint32_t first, const Vf own_v[3], Vf e[3],
                              Vf sum[3]) {
    const PairData *pairs = job->pairs;
    __builtin_prefetch(pairs->weights + (size_t)(entry + PREFETCH_ENTRIES) * SLICE);
    prefetch_entry(pairs->entries, entry + PREFETCH_ENTRIES, pairs->wide);
    Vf unused;
    gather_neighbours(job->velocity + first, pairs->entries, entry, pairs->wide, &e[0], &e[1], &e[2],
                      &unused);
    const Vf weight = vf_load_weight(pairs, entry);
    for (int k = 0; k < 3; k++) {
        e[k] = vf_sub(own_v[k], e[k]);
        sum[k] = vf_fma(weight, e[k], sum[k]);
    }
    return weight;
}

static void forces(const ForceJob *job, uint32_t block) {
    const PairData *pairs = job->pairs;
    const Vf unit = vf_set(-pairs->volume * pairs->kernel.w_scale / 32767.0f);
    const Vf viscous = vf_mul(unit, vf_set(job->viscosity)), calming = vf_mul(unit, vf_set(job->calming));
    for (uint32_t slice = block * BLOCK_SLICES; slice < (block + 1) * BLOCK_SLICES; slice++) {
        const uint32_t first = slice * SLICE;
        const SliceRows *rows = &pairs->slices[slice];
        const uint32_t near_end = rows->start + (job->calming > 0.0f ? rows->near : 0);
        const uint32_t end = job->viscosity > 0.0f ? rows->start + rows->length : near_end;
        Vf own_v[3], e[3], unused;
        Strain own = {0};
        Vf sum[3] = {vf_zero(), vf_zero(), vf_zero()}, calm_sum[3] = {vf_zero(), vf_zero(), vf_zero()};
        vf_load4(job->velocity + first, &own_v[0], &own_v[1], &own_v[2], &unused);
        if (job->calming > 0.0f)
            load_strain(job, first, &own);
        uint32_t entry = rows->start;
        for (; entry < near_end; entry++) {
            const Vf weight = viscous_pair(job, entry, first, own_v, e, sum);
            calm_pair(job, entry, first, &own, weight, e, calm_sum);
        }
        for (; entry < end; entry++)
            viscous_pair(job, entry, first, own_v, e, sum);
        for (int k = 0; k < 3; k++)
            sum[k] = vf_fma(calming, calm_sum[k], vf_fma(viscous, sum[k], own_v[k]));
        vf_store4(job->result + first, sum[0], sum[1], sum[2], vf_zero());
    }
}

const Passes PASSES_JOIN(passes_, PASSES_ISA) = {
    .name = PASSES_TEXT(PASSES_ISA),
    .search = PASSES_NAME(search_),
    .boundary = PASSES_NAME(boundary_),
    .accelerate = accelerate,
    .divergence = divergence,
    .shape = shape,
    .correct = correct,
    .strain = strain,
    .forces = forces,
};
