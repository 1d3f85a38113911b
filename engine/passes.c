/* The pair loops, compiled once per instruction set (PASSES_ISA is plain, avx2 or avx512; see passes.h for
 * the ideas).
 *
 * A particle is a lane: sixteen particles advance together through their k-th neighbours. Every sum is
 * thereby taken over the neighbours in row order with one fused multiply-add each, whatever the register
 * width, and no horizontal sum is needed. */

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

/* ---- Neighbour search ---- */

/* The cell whose candidates lie in scratch. */
typedef struct SearchCell {
    uint32_t index;
    int candidate_count;
} SearchCell;

/* Copies the particles of the 27 cells around `cell` into scratch, run by run, and fills the last lanes with
 * points that are near nothing. Returns how many there are, -1 for too many. */
static int gather_candidates(const SearchJob *job, uint32_t cell, Scratch *scratch) {
    const CellGrid *grid = job->grid;
    const int32_t column = grid->size[1], slab = grid->size[1] * grid->size[2];
    int n = 0;
    for (int run = 0; run < 9; run++) {
        const int64_t middle = (int64_t)cell + (run / 3 - 1) * slab + (run % 3 - 1) * column;
        const uint32_t begin = grid->start[middle - 1], end = grid->start[middle + 2];
        if (n + (int64_t)(end - begin) > MAX_CANDIDATES)
            return -1;
        for (uint32_t j = begin; j < end; j += LANES) {
            Vf x, y, z, unused;
            vf_load4(job->position + j, &x, &y, &z, &unused);
            const int to = n + (int)(j - begin);
            vf_store(scratch->x + to, x);
            vf_store(scratch->y + to, y);
            vf_store(scratch->z + to, z);
            const Vi index = vi_add(vi_set((int32_t)j), vi_lane());
            vi_store(scratch->halves + to, vi_add(index, index));
        }
        n += (int)(end - begin);
    }
    vf_store(scratch->x + n, vf_set(1e18f));
    return n;
}

typedef struct NeighbourCount {
    int all, near;
} NeighbourCount;

/* Neighbours of particle i in the order of the candidates, the near ones first; all is -1 when there are too
 * many. */
static NeighbourCount find_neighbours(const SearchJob *job, int candidate_count, uint32_t i, Scratch *scratch,
                                      int32_t *list) {
    const Vf x = vf_set(job->position[i][0]), y = vf_set(job->position[i][1]),
             z = vf_set(job->position[i][2]);
    const Vf limit = vf_set(job->kernel.support * job->kernel.support);
    const Vf near_limit = vf_set(near_distance_sq(&job->kernel));
    const Vi self = vi_set((int32_t)(2 * i));
    int near = 0, far = 0;
    for (int c = 0; c < candidate_count; c += LANES) {
        const Vf dx = vf_sub(x, vf_load(scratch->x + c));
        const Vf dy = vf_sub(y, vf_load(scratch->y + c));
        const Vf dz = vf_sub(z, vf_load(scratch->z + c));
        const Vf distance_sq = vf_fma(dx, dx, vf_fma(dy, dy, vf_mul(dz, dz)));
        const Vm is_near = vf_less(distance_sq, near_limit);
        const Vm is_far = vf_less(distance_sq, limit) & (Vm)~is_near;
        const Vm is_self = vi_equal(vi_load(scratch->halves + c), self);
        near += vi_compress(list + near, scratch->halves + c, is_near & (Vm)~is_self);
        far += vi_compress(scratch->far + far, scratch->halves + c, is_far);
        if (near + far > MAX_NEIGHBOURS)
            return (NeighbourCount){-1, 0};
    }
    for (int k = 0; k < far; k += LANES)
        vi_store(list + near + k, vi_load(scratch->far + k));
    return (NeighbourCount){near + far, near};
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

static inline void entry_store_place(uint8_t *entries, uint32_t entry, bool wide, Vi place) {
    if (wide)
        vi_store(((RowEntryWide *)entries)[entry].place, place);
    else
        vi_store_i16(((RowEntry *)entries)[entry].place, place);
}

/* What the passes read is the rounded factor, so the sums are made of it, too. */
static inline Vf entry_store_factor(uint8_t *entries, uint32_t entry, bool wide, Vf factor) {
    const Vi rounded = vi_round(vf_mul(factor, vf_set(FACTOR_STEPS)));
    vi_store_i16((int16_t *)entry_factor(entries, entry, wide), rounded);
    return vf_from_int(rounded);
}

/* Turns the sixteen lists in scratch into row entries, densities and gradient sums. True if all offsets fit
 * 16 bits or wide. */
static bool pack_slice(const SearchJob *job, uint32_t first, const int32_t counts[SLICE],
                       const SliceRows *rows, const Scratch *scratch) {
    const Vi count = vi_load(counts), minus_first = vi_set(-2 * (int32_t)first);
    Vf x, y, z, w;
    vf_load4(job->position + first, &x, &y, &z, &w);
    Vf sum_x = vf_zero(), sum_y = vf_zero(), sum_z = vf_zero(), sum_sq = vf_zero(), sum_w = vf_zero();
    Vm misfit = 0;
    int32_t halves[SLICE][SLICE]; /* of the next sixteen entries, from the first particle of all */
    uint32_t entry = rows->start;
    for (int k = 0; k < rows->length; k++, entry++) {
        if (k % SLICE == 0)
            vi_transpose16(scratch->list[0] + k, MAX_NEIGHBOURS + LANES, halves);
        const Vm valid = vi_less(vi_set(k), count);
        const Vi place = vi_add(vi_load(halves[k % SLICE]), minus_first);
        misfit |= vi_less(place, vi_set(INT16_MIN)) | vi_less(vi_set(INT16_MAX), place);
        entry_store_place(job->entries, entry, job->wide, place);
        Vf nx, ny, nz;
        vf_gather4_i32(job->position, halves[k % SLICE], &nx, &ny, &nz, &w);
        const Vf dx = vf_sub(x, nx), dy = vf_sub(y, ny), dz = vf_sub(z, nz);
        const Vf distance_sq = vf_fma(dx, dx, vf_fma(dy, dy, vf_mul(dz, dz)));
        Vf factor, weight;
        pair_kernel(&job->kernel, distance_sq, &factor, &weight);
        factor = entry_store_factor(job->entries, entry, job->wide, vf_mask(valid, factor));
        sum_x = vf_fma(factor, dx, sum_x);
        sum_y = vf_fma(factor, dy, sum_y);
        sum_z = vf_fma(factor, dz, sum_z);
        sum_sq = vf_fma(vf_mul(factor, factor), distance_sq, sum_sq);
        weight = vf_mask(valid, weight);
        sum_w = vf_add(sum_w, weight);
        vf_store_i16(job->weights + (size_t)entry * SLICE,
                     vf_mul(weight, vf_set(32767.0f / job->kernel.w_scale)));
    }
    const Vf unit = vf_set(-job->factor_unit), unit_sq = vf_mul(unit, unit);
    vf_store4(job->gradient_sum + first, vf_mul(unit, sum_x), vf_mul(unit, sum_y), vf_mul(unit, sum_z),
              vf_mul(unit_sq, sum_sq));
    vf_store(job->density + first, vf_mul(vf_set(job->volume), vf_add(sum_w, vf_set(job->kernel.w_scale))));
    return job->wide || misfit == 0;
}

/* Lists the neighbours of a slice's particles in scratch, all to the length of the longest: what is missing
 * is the particle itself. all is -1, and *fault the particle, when one has too many. */
static NeighbourCount list_neighbours(const SearchJob *job, uint32_t first, SearchCell *cell,
                                      Scratch *scratch, int32_t counts[SLICE], uint32_t *fault) {
    NeighbourCount most = {0, 0};
    for (uint32_t l = 0; l < SLICE; l++) {
        const uint32_t i = first + l;
        counts[l] = 0;
        if (i >= job->count)
            continue;
        job->neighbours[i] = 0;
        if (job->frozen != NULL && job->frozen[i])
            continue;
        NeighbourCount found = {-1, 0};
        if (job->cell[i] != cell->index) {
            cell->index = job->cell[i];
            cell->candidate_count = gather_candidates(job, cell->index, scratch);
        }
        if (cell->candidate_count >= 0)
            found = find_neighbours(job, cell->candidate_count, i, scratch, scratch->list[l]);
        if (found.all < 0) {
            *fault = i;
            return found;
        }
        counts[l] = found.all;
        job->neighbours[i] = (uint16_t)found.all;
        most.all = found.all > most.all ? found.all : most.all;
        most.near = found.near > most.near ? found.near : most.near;
    }
    for (uint32_t l = 0; l < SLICE; l++)
        for (int k = counts[l]; k < most.all; k += LANES)
            vi_store(scratch->list[l] + k, vi_set((int32_t)(2 * (first + l))));
    return most;
}

static int search(const SearchJob *job, uint32_t block, int thread, Scratch *scratch, uint32_t *fault) {
    SearchCell cell = {.index = UINT32_MAX};
    int status = SEARCH_OK;
    for (uint32_t slice = block * BLOCK_SLICES; slice < (block + 1) * BLOCK_SLICES; slice++) {
        const uint32_t first = slice * SLICE;
        int32_t counts[SLICE];
        const NeighbourCount found = list_neighbours(job, first, &cell, scratch, counts, fault);
        if (found.all < 0)
            return SEARCH_TOO_DENSE;
        SliceRows *rows = &job->slices[slice];
        *rows = (SliceRows){.length = (uint16_t)found.all, .near = (uint16_t)found.near};
        if (first >= job->count) {
            for (uint32_t i = first; i < first + SLICE; i++) {
                memset(job->gradient_sum[i], 0, sizeof(Float4));
                job->density[i] = 0.0f;
            }
            continue;
        }
        rows->start = job->allocate(job->rows, thread, rows->length);
        if (rows->start == UINT32_MAX)
            return SEARCH_NEEDS_MEMORY;
        if (!pack_slice(job, first, counts, rows, scratch))
            status = SEARCH_NEEDS_WIDE;
    }
    return status;
}

/* ---- Walls and bodies ---- */

/* Sums over one object's samples near one particle, a lane a sample. */
typedef struct ContactSum {
    int32_t object;
    int count;
    Vf weight, g[3], t[3];
} ContactSum;

typedef struct ContactSums {
    int count;
    ContactSum sums[MAX_CONTACT_OBJECTS];
} ContactSums;

static ContactSum *contact_sum_of(ContactSums *sums, int32_t object) {
    for (int k = 0; k < sums->count; k++)
        if (sums->sums[k].object == object)
            return &sums->sums[k];
    if (sums->count == MAX_CONTACT_OBJECTS)
        return NULL;
    ContactSum *sum = &sums->sums[sums->count++];
    sum->object = object;
    sum->count = 0;
    sum->weight = vf_zero();
    for (int k = 0; k < 3; k++)
        sum->g[k] = sum->t[k] = vf_zero();
    return sum;
}

/* Adds up to sixteen samples beginning at s; near: lanes in reach. */
static bool contact_add(const BoundaryJob *job, const SampleSet *set, uint32_t s, Vm near, const Vf d[3],
                        ContactSums *sums) {
    const Vf volume = vf_load(set->volume + s);
    const Vf position[3] = {vf_load(set->x + s), vf_load(set->y + s), vf_load(set->z + s)};
    const Vi object = vi_load(set->object + s);
    const Vf distance_sq = vf_fma(d[0], d[0], vf_fma(d[1], d[1], vf_mul(d[2], d[2])));
    Vf factor, weight;
    pair_kernel(&job->kernel, distance_sq, &factor, &weight);
    factor = vf_mul(vf_mul(factor, vf_set(-job->kernel.gradient_scale * job->kernel.inv_support)), volume);
    weight = vf_mul(weight, volume);
    uint32_t left = near;
    while (left != 0) {
        const int32_t id = set->object[s + (uint32_t)__builtin_ctz(left)];
        const Vm mine = (Vm)(left & vi_equal(object, vi_set(id)));
        left &= ~(uint32_t)mine;
        ContactSum *sum = contact_sum_of(sums, id);
        if (sum == NULL)
            return false;
        Vf g[3], arm[3];
        for (int k = 0; k < 3; k++) {
            g[k] = vf_mask(mine, vf_mul(factor, d[k]));
            arm[k] = vf_sub(position[k], vf_set(job->centres[id][k]));
            sum->g[k] = vf_add(sum->g[k], g[k]);
        }
        for (int k = 0; k < 3; k++) {
            const int a = (k + 1) % 3, b = (k + 2) % 3;
            sum->t[k] = vf_fma(arm[a], g[b], vf_fnma(arm[b], g[a], sum->t[k]));
        }
        sum->weight = vf_add(sum->weight, vf_mask(mine, weight));
        sum->count += __builtin_popcount(mine);
    }
    return true;
}

static bool contacts_of_particle(const BoundaryJob *job, const SampleSet *set, const float *p,
                                 ContactSums *sums) {
    int32_t c[3];
    for (int k = 0; k < 3; k++) {
        c[k] = (int32_t)floorf((p[k] - set->grid.origin[k]) * set->grid.inv_size);
        if (c[k] < 0 || c[k] >= set->grid.size[k])
            return true;
    }
    const int32_t cell = cell_grid_index(&set->grid, c[0], c[1], c[2]);
    if (!set->occupied[cell])
        return true;
    const Vf limit = vf_set(job->kernel.support * job->kernel.support);
    const int32_t column = set->grid.size[1], slab = set->grid.size[1] * set->grid.size[2];
    for (int run = 0; run < 9; run++) {
        const int32_t middle = cell + (run / 3 - 1) * slab + (run % 3 - 1) * column;
        const uint32_t end = set->grid.start[middle + 2];
        for (uint32_t s = set->grid.start[middle - 1]; s < end; s += LANES) {
            const Vf d[3] = {vf_sub(vf_set(p[0]), vf_load(set->x + s)),
                             vf_sub(vf_set(p[1]), vf_load(set->y + s)),
                             vf_sub(vf_set(p[2]), vf_load(set->z + s))};
            const Vf distance_sq = vf_fma(d[0], d[0], vf_fma(d[1], d[1], vf_mul(d[2], d[2])));
            const uint32_t valid = end - s >= LANES ? 0xffffu : (1u << (end - s)) - 1u;
            const Vm near = (Vm)(vf_less(distance_sq, limit) & valid);
            if (near != 0 && !contact_add(job, set, s, near, d, sums))
                return false;
        }
    }
    return true;
}

static int boundary(const BoundaryJob *job, uint32_t block, Scratch *scratch, uint32_t *fault) {
    int contact_count = 0;
    const uint32_t begin = block * BLOCK, end = begin + BLOCK < job->count ? begin + BLOCK : job->count;
    for (uint32_t i = begin; i < end; i++) {
        if (job->frozen != NULL && job->frozen[i])
            continue;
        ContactSums sums;
        sums.count = 0;
        for (int k = 0; k < 2; k++) {
            if (job->sets[k]->count != 0 &&
                !contacts_of_particle(job, job->sets[k], job->position[i], &sums)) {
                *fault = i;
                return -1;
            }
        }
        float g[3] = {0};
        for (int k = 0; k < sums.count; k++) {
            const ContactSum *sum = &sums.sums[k];
            Contact *contact = &scratch->contacts[contact_count++];
            contact->particle = i;
            contact->object = (uint32_t)sum->object;
            for (int a = 0; a < 3; a++) {
                contact->g[a] = vf_sum(sum->g[a]);
                contact->t[a] = vf_sum(sum->t[a]);
                g[a] += contact->g[a];
            }
            contact->weight = vf_sum(sum->weight);
            if (job->density == NULL)
                continue;
            job->density[i] += contact->weight;
            job->neighbours[i] = (uint16_t)(job->neighbours[i] + sum->count);
        }
        if (job->density == NULL)
            continue;
        float *sum = job->gradient_sum[i];
        float norm_sq = 0.0f;
        for (int a = 0; a < 3; a++) {
            sum[a] += g[a];
            norm_sq += sum[a] * sum[a];
        }
        sum[3] += norm_sq;
    }
    return contact_count;
}

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

static inline void accelerate_slices(const PairData *pairs, const AccelerateJob *job, uint32_t block,
                                     const bool wide) {
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
        if (job->base != NULL)
            vf_load4(job->base + first, &bx, &by, &bz, &unused);
        own_p = vf_mul(scale, own_p);
        x = vf_fma(own_p, gx, vf_fma(x, unit, bx));
        y = vf_fma(own_p, gy, vf_fma(y, unit, by));
        z = vf_fma(own_p, gz, vf_fma(z, unit, bz));
        Vf arm[3];
        own_arm(pairs, own_x, own_y, own_z, arm);
        vf_store4(job->result + first, x, y, z, vf_fma(arm[0], x, vf_fma(arm[1], y, vf_mul(arm[2], z))));
    }
}

static void accelerate(const PairData *pairs, const AccelerateJob *job, uint32_t block) {
    if (pairs->wide)
        accelerate_slices(pairs, job, block, true);
    else
        accelerate_slices(pairs, job, block, false);
}

static inline void divergence_slices(const PairData *pairs, const Float4 *v, float *result, uint32_t block,
                                     const bool wide) {
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

static void divergence(const PairData *pairs, const Float4 *v, float *result, uint32_t block) {
    if (pairs->wide)
        divergence_slices(pairs, v, result, block, true);
    else
        divergence_slices(pairs, v, result, block, false);
}

/* ---- Gravity, viscosity and calming ---- */

static inline Vf vf_load_weight(const PairData *pairs, uint32_t entry) {
    return vf_load_i16(pairs->weights + (size_t)entry * SLICE);
}

/* Distances x_j - x_i of a slice's neighbours in units of the support radius. The weight of those that are
 * not near becomes 0: the same for both of a pair, wherever they stand in their rows. */
static inline void gather_arms(const PairData *pairs, uint32_t entry, const Float4 *slice_position,
                               const Vf own[3], Vf arm[3], Vf *weight) {
    Vf unused;
    gather_neighbours(slice_position, pairs->entries, entry, pairs->wide, &arm[0], &arm[1], &arm[2], &unused);
    for (int k = 0; k < 3; k++)
        arm[k] = vf_sub(arm[k], own[k]);
    const Vf distance_sq = vf_fma(arm[0], arm[0], vf_fma(arm[1], arm[1], vf_mul(arm[2], arm[2])));
    *weight = vf_mask(vf_less(distance_sq, vf_set(near_distance_sq(&pairs->kernel))), *weight);
    for (int k = 0; k < 3; k++)
        arm[k] = vf_mul(vf_set(pairs->kernel.inv_support), arm[k]);
}

/* A = [sum w (v_j - v_i) d^T] [sum w d d^T + small I]^-1, w = W_ij / W(0), d in supports. `small` keeps the
 * inverse tame where neighbours lie in a plane or a line. */
static void strain(const StrainJob *job, uint32_t block) {
    const PairData *pairs = job->pairs;
    const Vf small = vf_set(0.008f * 32767.0f);
    for (uint32_t slice = block * BLOCK_SLICES; slice < (block + 1) * BLOCK_SLICES; slice++) {
        const uint32_t first = slice * SLICE, begin = pairs->slices[slice].start;
        Vf own_x[3], own_v[3], unused;
        vf_load4(pairs->position + first, &own_x[0], &own_x[1], &own_x[2], &unused);
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
            gather_arms(pairs, entry, pairs->position + first, own_x, d, &weight);
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
        /* adjugate of the symmetric matrix, over the determinant */
        const Vf cxx = vf_fma(yy, zz, vf_mul(vf_sub(vf_zero(), yz), yz));
        const Vf cyy = vf_fma(xx, zz, vf_mul(vf_sub(vf_zero(), xz), xz));
        const Vf czz = vf_fma(xx, yy, vf_mul(vf_sub(vf_zero(), xy), xy));
        const Vf cxy = vf_fma(xz, yz, vf_mul(vf_sub(vf_zero(), xy), zz));
        const Vf cxz = vf_fma(xy, yz, vf_mul(vf_sub(vf_zero(), xz), yy));
        const Vf cyz = vf_fma(xy, xz, vf_mul(vf_sub(vf_zero(), yz), xx));
        const Vf root = vf_rsqrt(vf_fma(xx, cxx, vf_fma(xy, cxy, vf_mul(xz, cxz))));
        const Vf inv = vf_mul(root, root);
        const Vf columns[3][3] = {{cxx, cxy, cxz}, {cxy, cyy, cyz}, {cxz, cyz, czz}};
        for (int c = 0; c < 3; c++) {
            Vf a[3];
            for (int r = 0; r < 3; r++)
                a[r] = vf_mul(inv, vf_fma(b[r][0], columns[c][0],
                                          vf_fma(b[r][1], columns[c][1], vf_mul(b[r][2], columns[c][2]))));
            vf_store4(job->gradient[c] + first, a[0], a[1], a[2], vf_zero());
        }
    }
}

/* Adds one neighbour's share of calming to sum: w min(1, limit / |e|) e, where e = v_i - v_j + (A_i + A_j) d
 * / 2 is what the two velocities differ by beyond the linear field between them. */
static inline void calm_pair(const ForceJob *job, uint32_t entry, uint32_t first, const Vf own_x[3],
                             const Vf own_a[3][3], Vf weight, Vf e[3], Vf sum[3]) {
    const PairData *pairs = job->pairs;
    Vf d[3], unused, size = vf_set(1e-12f);
    gather_arms(pairs, entry, pairs->position + first, own_x, d, &weight);
    const Vf half = vf_set(0.5f);
    for (int c = 0; c < 3; c++) {
        Vf a[3];
        gather_neighbours(job->gradient[c] + first, pairs->entries, entry, pairs->wide, &a[0], &a[1], &a[2],
                          &unused);
        const Vf half_d = vf_mul(half, d[c]);
        for (int k = 0; k < 3; k++)
            e[k] = vf_fma(vf_add(own_a[c][k], a[k]), half_d, e[k]);
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
        Vf own_v[3], own_x[3], own_a[3][3], e[3], unused;
        Vf sum[3] = {vf_zero(), vf_zero(), vf_zero()}, calm_sum[3] = {vf_zero(), vf_zero(), vf_zero()};
        vf_load4(job->velocity + first, &own_v[0], &own_v[1], &own_v[2], &unused);
        vf_load4(pairs->position + first, &own_x[0], &own_x[1], &own_x[2], &unused);
        for (int c = 0; job->calming > 0.0f && c < 3; c++)
            vf_load4(job->gradient[c] + first, &own_a[c][0], &own_a[c][1], &own_a[c][2], &unused);
        uint32_t entry = rows->start;
        for (; entry < near_end; entry++) {
            const Vf weight = viscous_pair(job, entry, first, own_v, e, sum);
            calm_pair(job, entry, first, own_x, own_a, weight, e, calm_sum);
        }
        for (; entry < end; entry++)
            viscous_pair(job, entry, first, own_v, e, sum);
        for (int k = 0; k < 3; k++)
            sum[k] = vf_fma(calming, calm_sum[k],
                            vf_fma(viscous, sum[k], vf_add(own_v[k], vf_set(job->gravity_dt[k]))));
        vf_store4(job->result + first, sum[0], sum[1], sum[2], vf_zero());
    }
}

const Passes PASSES_JOIN(passes_, PASSES_ISA) = {
    .name = PASSES_TEXT(PASSES_ISA),
    .search = search,
    .boundary = boundary,
    .accelerate = accelerate,
    .divergence = divergence,
    .strain = strain,
    .forces = forces,
};
