/* Who is near whom: the neighbour search and the terms of walls and bodies, compiled once per instruction
 * set.
 *
 * The 27 cells around a particle are nine runs of particles;
 * what is near the cell's own is copied once, and each of these keeps those within a support radius. The
 * lists of a group become the rows of its slices, with densities and sums of gradients on the way. Standing
 * water is found alike, in a grid of its own, and is summed up at once. */
#include "pair.h"

/* ---- Neighbour search ---- */

/* The cell whose candidates lie in scratch. */
typedef struct SearchCell {
    uint32_t index;
    int candidate_count, standing_count;
} SearchCell;

/* Points by cell, to take candidates from. */
typedef struct Source {
    const CellGrid *grid;
    const float *points[3];
    const uint32_t *member; /* who they are; NULL: as they stand */
} Source;

/* How far coordinates are outside [low, high]. */
static inline Vf beyond(Vf x, float low, float high) {
    return vf_max(vf_max(vf_sub(vf_set(low), x), vf_sub(x, vf_set(high))), vf_zero());
}

/* A box, and what is near it. */
typedef struct Reach {
    float low[3], high[3], limit; /* m; of the square of the distance, m^2 */
} Reach;

/* With a margin for rounding: who is near is decided particle by particle. */
static inline float reach_limit(const Kernel *kernel) {
    return kernel->support * kernel->support * 1.001f;
}

static inline Vm within_reach(const Reach *reach, Vf x, Vf y, Vf z) {
    const Vf d[3] = {beyond(x, reach->low[0], reach->high[0]), beyond(y, reach->low[1], reach->high[1]),
                     beyond(z, reach->low[2], reach->high[2])};
    return vf_less(vf_fma(d[0], d[0], vf_fma(d[1], d[1], vf_mul(d[2], d[2]))), vf_set(reach->limit));
}

/* Lanes that hold one of `left` values. */
static inline Vm first_lanes(uint32_t left) {
    return left >= LANES ? (Vm)0xffffu : (Vm)((1u << left) - 1u);
}

/* Around the points of a cell: they take up half of it. */
static Reach cell_reach(const SearchJob *job, uint32_t cell) {
    Reach reach = {.limit = reach_limit(&job->kernel)};
    const uint32_t begin = job->grid->start[cell], end = job->grid->start[cell + 1];
    for (int k = 0; k < 3; k++) {
        const float *x = job->points[k];
        float low = x[begin], high = low;
        for (uint32_t j = begin + 1; j < end; j++) {
            low = x[j] < low ? x[j] : low;
            high = x[j] > high ? x[j] : high;
        }
        reach.low[k] = low;
        reach.high[k] = high;
    }
    return reach;
}

/* Copies those points of the 27 cells around `cell` that are within reach, run by run, and fills the last
 * lanes with points that are near nothing. Returns how many there are, -1 for too many. */
static int gather_candidates(const Source *source, int32_t cell, const Reach *reach, Candidates *to) {
    const float *const x = source->points[0], *const y = source->points[1], *const z = source->points[2];
    const int32_t *member = (const int32_t *)source->member;
    int n = 0;
    for (int run = 0; run < CELL_RUNS; run++) {
        const CellRun part = cell_grid_run(source->grid, cell, run);
        for (uint32_t j = part.begin; j < part.end; j += LANES) {
            const Vf p[3] = {vf_load(x + j), vf_load(y + j), vf_load(z + j)};
            const Vi who = member != NULL ? vi_load(member + j) : vi_add(vi_set((int32_t)j), vi_lane());
            const Vm mine = (Vm)(within_reach(reach, p[0], p[1], p[2]) & first_lanes(part.end - j));
            if (n > MAX_CANDIDATES - LANES)
                return -1;
            vf_compress(to->x + n, p[0], mine);
            vf_compress(to->y + n, p[1], mine);
            vf_compress(to->z + n, p[2], mine);
            n += vi_compress(to->halves + n, vi_add(who, who), mine);
        }
    }
    vf_store(to->x + n, vf_set(1e18f));
    return n;
}

/* A cell of the search in the grid of standing water; both begin on multiples of the same edge. False:
 * outside, or at the rim, whose neighbours are empty. */
static bool standing_cell(const SearchJob *job, uint32_t index, int32_t *cell) {
    const CellGrid *from = job->grid, *to = &job->standing->grid;
    const int32_t column = (int32_t)index / from->size[1];
    const int32_t c[3] = {column / from->size[2], (int32_t)index % from->size[1], column % from->size[2]};
    int32_t moved[3];
    for (int k = 0; k < 3; k++) {
        moved[k] = c[k] + (int32_t)lrintf((from->origin[k] - to->origin[k]) * to->inv_size);
        if (moved[k] < 1 || moved[k] > to->size[k] - 2)
            return false;
    }
    *cell = cell_grid_index(to, moved[0], moved[1], moved[2]);
    return true;
}

/* Candidates of another cell. */
static void enter_cell(const SearchJob *job, uint32_t index, SearchCell *cell, Scratch *scratch) {
    const Source particles = {job->grid, {job->points[0], job->points[1], job->points[2]}, job->member};
    const StandingSet *standing = job->standing;
    const Reach reach = cell_reach(job, index);
    int32_t there;
    cell->index = index;
    cell->candidate_count = gather_candidates(&particles, (int32_t)index, &reach, &scratch->candidates);
    cell->standing_count = 0;
    if (standing != NULL && standing_cell(job, index, &there)) {
        const Source source = {&standing->grid, {standing->x, standing->y, standing->z}, NULL};
        cell->standing_count = gather_candidates(&source, there, &reach, &scratch->standing);
    }
}

typedef struct NeighbourCount {
    int all, near;
} NeighbourCount;

/* Neighbours of the k-th particle in the order of cells, in the order of the candidates, the near ones apart;
 * all is -1 when there are too many. */
static NeighbourCount find_neighbours(const SearchJob *job, int candidate_count, uint32_t k,
                                      const Candidates *candidates, int32_t *list, int32_t *far_list) {
    const Vf x = vf_set(job->points[0][k]), y = vf_set(job->points[1][k]), z = vf_set(job->points[2][k]);
    const Vf limit = vf_set(job->kernel.support * job->kernel.support);
    const Vf near_limit = vf_set(near_distance_sq(&job->kernel));
    const Vi self = vi_set((int32_t)(2 * job->member[k]));
    int near = 0, far = 0;
    for (int c = 0; c < candidate_count; c += LANES) {
        const Vf dx = vf_sub(x, vf_load(candidates->x + c));
        const Vf dy = vf_sub(y, vf_load(candidates->y + c));
        const Vf dz = vf_sub(z, vf_load(candidates->z + c));
        const Vi halves = vi_load(candidates->halves + c);
        const Vf distance_sq = vf_fma(dx, dx, vf_fma(dy, dy, vf_mul(dz, dz)));
        const Vm is_near = vf_less(distance_sq, near_limit);
        const Vm is_far = vf_less(distance_sq, limit) & (Vm)~is_near;
        near += vi_compress(list + near, halves, is_near & (Vm)~vi_equal(halves, self));
        far += vi_compress(far_list + far, halves, is_far);
        if (near + far > MAX_NEIGHBOURS)
            return (NeighbourCount){-1, 0};
    }
    return (NeighbourCount){near + far, near};
}

/* The same among standing water: how many, -1 for too many. */
static int find_standing(const SearchJob *job, int candidate_count, uint32_t k, const Candidates *candidates,
                         int32_t *list) {
    const Vf x = vf_set(job->points[0][k]), y = vf_set(job->points[1][k]), z = vf_set(job->points[2][k]);
    const Vf limit = vf_set(job->kernel.support * job->kernel.support);
    int count = 0;
    for (int c = 0; c < candidate_count; c += LANES) {
        const Vf dx = vf_sub(x, vf_load(candidates->x + c));
        const Vf dy = vf_sub(y, vf_load(candidates->y + c));
        const Vf dz = vf_sub(z, vf_load(candidates->z + c));
        const Vf distance_sq = vf_fma(dx, dx, vf_fma(dy, dy, vf_mul(dz, dz)));
        count += vi_compress(list + count, vi_load(candidates->halves + c), vf_less(distance_sq, limit));
        if (count > MAX_NEIGHBOURS)
            return -1;
    }
    return candidate_count < 0 ? -1 : count;
}

static inline void entry_store_place(uint8_t *entries, uint32_t entry, bool wide, Vi place) {
    if (wide)
        vi_store(((RowEntryWide *)entries)[entry].place, place);
    else
        vi_store_i16(((RowEntry *)entries)[entry].place, place);
}

/* What the passes read is the rounded factor, so the sums are made of it, too. */
static inline Vf entry_store_factor(uint8_t *entries, uint32_t entry, bool wide, Vf factor) {
    const Vi rounded = vi_round(factor);
    vi_store_i16((int16_t *)entry_factor(entries, entry, wide), rounded);
    return vf_from_int(rounded);
}

/* Neighbours k to k + 15 of a slice's particles; who has no more gets itself. */
static void next_places(const int32_t *const lists[SLICE], Vi count, Vi own, int k,
                        int32_t places[SLICE][SLICE]) {
    vi_transpose16(lists, k, places);
    for (int n = 0; n < SLICE; n++)
        vi_store(places[n], vi_select(vi_less(vi_set(k + n), count), vi_load(places[n]), own));
}

/* Turns the lists of a slice's particles into row entries, densities and gradient sums. True if all offsets
 * fit 16 bits or wide. */
static bool pack_slice(const SearchJob *job, uint32_t first, const SliceRows *rows, const Scratch *scratch) {
    const int32_t *lists[SLICE];
    int32_t counts[SLICE];
    for (uint32_t l = 0; l < SLICE; l++) {
        const bool real = first + l < job->count;
        lists[l] = scratch->lists + (real ? scratch->list_start[(first + l) % ROW_GROUP] : 0);
        counts[l] = real ? (int32_t)row_all(job->row_size[first + l]) : 0;
    }
    /* copies, as what is stored here could be anything, for all the compiler knows */
    const Kernel kernel = job->kernel;
    const Float4 *position = job->position;
    uint8_t *entries = job->entries;
    int16_t *weights = job->weights + (size_t)rows->start * SLICE;
    const bool wide = job->wide;
    const Vi count = vi_load(counts), minus_first = vi_set(-2 * (int32_t)first);
    const Vi own = vi_add(vi_set((int32_t)(2 * first)), vi_add(vi_lane(), vi_lane()));
    const Vf weight_unit = vf_set(32767.0f / kernel.w_scale);
    Vf x, y, z, w;
    vf_load4(position + first, &x, &y, &z, &w);
    Vf sum_x = vf_zero(), sum_y = vf_zero(), sum_z = vf_zero(), sum_sq = vf_zero(), sum_w = vf_zero();
    Vm misfit = 0;
    int32_t halves[SLICE][SLICE]; /* of the next sixteen entries, from the first particle of all */
    uint32_t entry = rows->start;
    for (int k = 0; k < rows->length; k++, entry++) {
        if (k % SLICE == 0)
            next_places(lists, count, own, k, halves);
        const Vm valid = vi_less(vi_set(k), count);
        const Vi place = vi_add(vi_load(halves[k % SLICE]), minus_first);
        misfit |= vi_less(place, vi_set(INT16_MIN)) | vi_less(vi_set(INT16_MAX), place);
        entry_store_place(entries, entry, wide, place);
        Vf nx, ny, nz;
        vf_gather4_i32(position, halves[k % SLICE], &nx, &ny, &nz, &w);
        const Vf dx = vf_sub(x, nx), dy = vf_sub(y, ny), dz = vf_sub(z, nz);
        const Vf distance_sq = vf_fma(dx, dx, vf_fma(dy, dy, vf_mul(dz, dz)));
        Vf factor, weight;
        pair_kernel(&kernel, distance_sq, &factor, &weight);
        factor = entry_store_factor(entries, entry, wide, vf_mask(valid, factor));
        sum_x = vf_fma(factor, dx, sum_x);
        sum_y = vf_fma(factor, dy, sum_y);
        sum_z = vf_fma(factor, dz, sum_z);
        sum_sq = vf_fma(vf_mul(factor, factor), distance_sq, sum_sq);
        weight = vf_mask(valid, weight);
        sum_w = vf_add(sum_w, weight);
        vf_store_i16(weights + (size_t)k * SLICE, vf_mul(weight, weight_unit));
    }
    const Vf unit = vf_set(-job->factor_unit), unit_sq = vf_mul(unit, unit);
    vf_store4(job->gradient_sum + first, vf_mul(unit, sum_x), vf_mul(unit, sum_y), vf_mul(unit, sum_z),
              vf_mul(unit_sq, sum_sq));
    vf_store(job->density + first, vf_mul(vf_set(job->volume), vf_add(sum_w, vf_set(kernel.w_scale))));
    return wide || misfit == 0;
}

/* ---- Standing water ---- */

/* Sums over standing water, a lane a particle. */
typedef struct StandingSum {
    Vf g[3], push[3], apart[3], weight, touching;
} StandingSum;

/* Adds a neighbour of each particle at d; valid: of those that have one more. */
static inline void standing_add(const Kernel *kernel, Vm valid, const Vf d[3], Vf p, StandingSum *sum) {
    const float r = 0.25f * kernel->support;
    const Vf distance_sq = vf_fma(d[0], d[0], vf_fma(d[1], d[1], vf_mul(d[2], d[2])));
    Vf factor, weight;
    pair_kernel(kernel, distance_sq, &factor, &weight);
    factor = vf_mask(valid, factor);
    /* in whole units, as the weights of rows are: the selection may treat both alike */
    const Vf rounded = vf_from_int(vi_round(vf_mul(weight, vf_set(32767.0f / kernel->w_scale))));
    sum->weight = vf_add(sum->weight, vf_mask(valid, rounded));
    for (int k = 0; k < 3; k++) {
        const Vf g = vf_mul(factor, d[k]);
        sum->g[k] = vf_add(sum->g[k], g);
        sum->push[k] = vf_fma(p, g, sum->push[k]);
    }
    const Vm close = vf_less(distance_sq, vf_set(r * r)) & valid;
    if (close == 0)
        return;
    const Vf lack = vf_mask(close, vf_fma(vf_set(r), vf_rsqrt(distance_sq), vf_set(-1.0f)));
    for (int k = 0; k < 3; k++)
        sum->apart[k] = vf_fma(lack, d[k], sum->apart[k]);
    const Vm touching = vf_less(distance_sq, vf_set(0.25f * r * r)) & close;
    sum->touching = vf_add(sum->touching, vf_mask(touching, vf_set(1.0f)));
}

/* What standing water gives a slice's particles; adds its part to their densities and gradient sums. */
static void add_standing(const SearchJob *job, uint32_t first, const Scratch *scratch) {
    const int32_t *lists[SLICE];
    int32_t counts[SLICE], longest = 0, halves[SLICE][SLICE];
    for (uint32_t l = 0; l < SLICE; l++) {
        const uint32_t place = (first + l) % ROW_GROUP;
        const bool real = first + l < job->count;
        lists[l] = scratch->standing_lists + (real ? scratch->standing_start[place] : 0);
        counts[l] = real ? scratch->standing_count[place] : 0;
        longest = counts[l] > longest ? counts[l] : longest;
    }
    const Kernel kernel = job->kernel;
    const Float4 *points = job->standing->points;
    const Vi count = vi_load(counts), none = vi_set(0);
    Vf x, y, z, w, nx, ny, nz, p;
    vf_load4(job->position + first, &x, &y, &z, &w);
    StandingSum sum = {.weight = vf_zero(), .touching = vf_zero()};
    for (int k = 0; k < 3; k++)
        sum.g[k] = sum.push[k] = sum.apart[k] = vf_zero();
    for (int k = 0; k < longest; k++) {
        if (k % SLICE == 0)
            next_places(lists, count, none, k, halves);
        vf_gather4_i32(points, halves[k % SLICE], &nx, &ny, &nz, &p);
        const Vf d[3] = {vf_sub(x, nx), vf_sub(y, ny), vf_sub(z, nz)};
        standing_add(&kernel, vi_less(vi_set(k), count), d, p, &sum);
    }
    /* minus V grad W in steps of the factors */
    const Vf unit = vf_set(-job->volume * kernel.gradient_scale * kernel.inv_support / FACTOR_STEPS);
    const Vf share = vf_mul(vf_set(job->volume * kernel.w_scale / 32767.0f), sum.weight);
    vf_store4(job->beside.push + first, vf_mul(unit, sum.push[0]), vf_mul(unit, sum.push[1]),
              vf_mul(unit, sum.push[2]), share);
    vf_store4(job->beside.apart + first, sum.apart[0], sum.apart[1], sum.apart[2], sum.touching);
    vf_store(job->density + first, vf_add(vf_load(job->density + first), share));
    vf_load4(job->gradient_sum + first, &x, &y, &z, &w);
    vf_store4(job->gradient_sum + first, vf_fma(unit, sum.g[0], x), vf_fma(unit, sum.g[1], y),
              vf_fma(unit, sum.g[2], z), w);
}

/* Lists the neighbours of a group's particles in scratch. False, and *fault the particle, when one has too
 * many. */
static bool list_group(const SearchJob *job, uint32_t begin, SearchCell *cell, Scratch *scratch,
                       uint32_t *fault) {
    const uint32_t end = begin + ROW_GROUP < job->count ? begin + ROW_GROUP : job->count;
    uint32_t used = 0, far_used = 0, standing_used = 0;
    for (uint32_t visit = begin; visit < end; visit++) {
        const uint32_t k = job->visits[visit], i = job->member[k];
        scratch->list_start[i % ROW_GROUP] = used;
        scratch->far_start[i % ROW_GROUP] = far_used;
        scratch->standing_start[i % ROW_GROUP] = standing_used;
        scratch->standing_count[i % ROW_GROUP] = 0;
        job->neighbours[i] = 0;
        job->row_size[i] = 0;
        if (job->frozen != NULL && job->frozen[i])
            continue;
        NeighbourCount found = {-1, 0};
        if (job->cell[k] != cell->index)
            enter_cell(job, job->cell[k], cell, scratch);
        if (cell->candidate_count >= 0)
            found = find_neighbours(job, cell->candidate_count, k, &scratch->candidates,
                                    scratch->lists + used, scratch->far + far_used);
        const int standing = cell->standing_count == 0
                                 ? 0
                                 : find_standing(job, cell->standing_count, k, &scratch->standing,
                                                 scratch->standing_lists + standing_used);
        if (found.all < 0 || standing < 0) {
            *fault = i;
            return false;
        }
        used += (uint32_t)found.all + LANES;
        far_used += (uint32_t)(found.all - found.near);
        standing_used += (uint32_t)standing + LANES;
        scratch->standing_count[i % ROW_GROUP] = standing;
        job->neighbours[i] = (uint16_t)(found.all + standing);
        job->row_size[i] = row_size_of((uint32_t)found.all, (uint32_t)found.near);
    }
    return true;
}

/* Puts the far neighbours of a group's particles behind the near ones. Apart from the search, which is still
 * writing what this reads. */
static void join_group(const SearchJob *job, uint32_t begin, Scratch *scratch) {
    for (uint32_t i = begin; i < begin + ROW_GROUP && i < job->count; i++) {
        const int near = (int)row_near(job->row_size[i]), count = (int)row_all(job->row_size[i]) - near;
        const int32_t *from = scratch->far + scratch->far_start[i % ROW_GROUP];
        int32_t *to = scratch->lists + scratch->list_start[i % ROW_GROUP] + near;
        for (int k = 0; k < count; k += LANES)
            vi_store(to + k, vi_load(from + k));
    }
}

/* The longest row of a slice, and the most near neighbours. */
static SliceRows slice_extent(const SearchJob *job, uint32_t first) {
    SliceRows rows = {0};
    for (uint32_t i = first; i < first + SLICE && i < job->count; i++) {
        const uint16_t all = (uint16_t)row_all(job->row_size[i]), near = (uint16_t)row_near(job->row_size[i]);
        rows.length = all > rows.length ? all : rows.length;
        rows.near = near > rows.near ? near : rows.near;
    }
    return rows;
}

int PASSES_NAME(search_)(const SearchJob *job, uint32_t block, int thread, Scratch *scratch,
                         uint32_t *fault) {
    SearchCell cell = {.index = UINT32_MAX};
    int status = SEARCH_OK;
    for (uint32_t slice = block * BLOCK_SLICES; slice < (block + 1) * BLOCK_SLICES; slice++) {
        const uint32_t first = slice * SLICE;
        if (first % ROW_GROUP == 0) {
            if (!list_group(job, first, &cell, scratch, fault))
                return SEARCH_TOO_DENSE;
            join_group(job, first, scratch);
        }
        SliceRows *rows = &job->slices[slice];
        *rows = slice_extent(job, first);
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
        if (!pack_slice(job, first, rows, scratch))
            status = SEARCH_NEEDS_WIDE;
        if (job->standing != NULL)
            add_standing(job, first, scratch);
    }
    return status;
}

/* ---- Walls and bodies ---- */

/* Sums over one object's samples near one particle, a lane a sample. */
typedef struct ContactSum {
    int32_t object;
    int count;
    Vf weight, g[3], m[6]; /* m: xx, yy, zz, xy, xz, yz of -sum psi_b grad W_ib (x_i - x_b)^T */
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
        sum->g[k] = sum->m[k] = sum->m[3 + k] = vf_zero();
    return sum;
}

/* Adds up to sixteen samples beginning at s; in_reach: their lanes. */
static bool contact_add(const BoundaryJob *job, const NearSamples *near, int s, Vm in_reach, const Vf d[3],
                        Vf distance_sq, ContactSums *sums) {
    const bool shaped = job->shape[0] != NULL;
    const Vf volume = vf_load(near->volume + s);
    const Vi object = vi_load(near->object + s);
    Vf factor, weight;
    pair_kernel(&job->kernel, distance_sq, &factor, &weight);
    const float unit = job->kernel.gradient_scale * job->kernel.inv_support / FACTOR_STEPS;
    factor = vf_mul(vf_mul(factor, vf_set(-unit)), volume);
    weight = vf_mul(weight, volume);
    uint32_t left = in_reach;
    while (left != 0) {
        const int32_t id = near->object[s + __builtin_ctz(left)];
        const Vm mine = (Vm)(left & vi_equal(object, vi_set(id)));
        left &= ~(uint32_t)mine;
        ContactSum *sum = contact_sum_of(sums, id);
        if (sum == NULL)
            return false;
        Vf g[3];
        for (int k = 0; k < 3; k++) {
            g[k] = vf_mask(mine, vf_mul(factor, d[k]));
            sum->g[k] = vf_add(sum->g[k], g[k]);
        }
        for (int k = 0; shaped && k < 3; k++) {
            sum->m[k] = vf_fnma(g[k], d[k], sum->m[k]);
            sum->m[3 + k] = vf_fnma(g[k == 2], d[k == 0 ? 1 : 2], sum->m[3 + k]);
        }
        sum->weight = vf_add(sum->weight, vf_mask(mine, weight));
        sum->count += __builtin_popcount(mine);
    }
    return true;
}

/* Copies together the samples within a support radius of a cell. False: there are too many. */
static bool gather_samples(const BoundaryJob *job, const SampleSet *set, const int32_t c[3],
                           NearSamples *near) {
    const CellGrid *grid = &set->grid;
    const float edge = 1.0f / grid->inv_size;
    Reach reach = {.limit = reach_limit(&job->kernel)};
    for (int k = 0; k < 3; k++) {
        reach.low[k] = grid->origin[k] + edge * (float)c[k];
        reach.high[k] = reach.low[k] + edge;
    }
    near->cell = cell_grid_index(grid, c[0], c[1], c[2]);
    near->count = 0;
    for (int run = 0; run < CELL_RUNS; run++) {
        const CellRun part = cell_grid_run(grid, near->cell, run);
        for (uint32_t s = part.begin; s < part.end; s += LANES) {
            const Vf x = vf_load(set->x + s), y = vf_load(set->y + s), z = vf_load(set->z + s);
            const Vm mine = (Vm)(within_reach(&reach, x, y, z) & first_lanes(part.end - s));
            const int to = near->count;
            if (to + __builtin_popcount(mine) > MAX_NEAR_SAMPLES)
                return false;
            vf_compress(near->x + to, x, mine);
            vf_compress(near->y + to, y, mine);
            vf_compress(near->z + to, z, mine);
            vf_compress(near->volume + to, vf_load(set->volume + s), mine);
            near->count += vi_compress(near->object + to, vi_load(set->object + s), mine);
        }
    }
    vf_store(near->x + near->count, vf_set(1e18f)); /* the last lanes are near nothing */
    return true;
}

static bool contacts_of_particle(const BoundaryJob *job, const SampleSet *set, const float *p,
                                 NearSamples *near, ContactSums *sums) {
    int32_t c[3];
    for (int k = 0; k < 3; k++) {
        c[k] = (int32_t)floorf((p[k] - set->grid.origin[k]) * set->grid.inv_size);
        if (c[k] < 0 || c[k] >= set->grid.size[k])
            return true;
    }
    const int32_t cell = cell_grid_index(&set->grid, c[0], c[1], c[2]);
    if (!set->occupied[cell])
        return true;
    if (near->cell != cell && !gather_samples(job, set, c, near))
        return false;
    const Vf limit = vf_set(job->kernel.support * job->kernel.support);
    for (int s = 0; s < near->count; s += LANES) {
        const Vf d[3] = {vf_sub(vf_set(p[0]), vf_load(near->x + s)),
                         vf_sub(vf_set(p[1]), vf_load(near->y + s)),
                         vf_sub(vf_set(p[2]), vf_load(near->z + s))};
        const Vf distance_sq = vf_fma(d[0], d[0], vf_fma(d[1], d[1], vf_mul(d[2], d[2])));
        const Vm in_reach = vf_less(distance_sq, limit);
        if (in_reach != 0 && !contact_add(job, near, s, in_reach, d, distance_sq, sums))
            return false;
    }
    return true;
}

/* Samples push along the line to the particle, so their moments about the object's centre are the sum's at
 * the particle. */
static void turn_of_push(const BoundaryJob *job, Contact *contact) {
    float arm[3];
    for (int k = 0; k < 3; k++)
        arm[k] = job->position[contact->particle][k] - job->centres[contact->object][k];
    for (int k = 0; k < 3; k++) {
        const int a = (k + 1) % 3, b = (k + 2) % 3;
        contact->t[k] = arm[a] * contact->g[b] - arm[b] * contact->g[a];
    }
}

int PASSES_NAME(boundary_)(const BoundaryJob *job, uint32_t block, Scratch *scratch, uint32_t *fault) {
    int contact_count = 0;
    scratch->near[0].cell = scratch->near[1].cell = -1;
    const uint32_t begin = block * BLOCK, end = begin + BLOCK < job->count ? begin + BLOCK : job->count;
    for (uint32_t k = begin; k < end; k++) {
        const uint32_t i = job->member[k];
        const bool shaped = job->density != NULL && job->shape[0] != NULL;
        for (int m = 0; shaped && m < 2; m++)
            memset(job->shape[m][i], 0, sizeof(Float4));
        if (job->frozen != NULL && job->frozen[i])
            continue;
        ContactSums sums;
        sums.count = 0;
        for (int s = 0; s < 2; s++) {
            if (job->sets[s]->count != 0 &&
                !contacts_of_particle(job, job->sets[s], job->position[i], &scratch->near[s], &sums)) {
                *fault = i;
                return -1;
            }
        }
        float g[3] = {0};
        for (int s = 0; shaped && s < sums.count; s++)
            for (int a = 0; a < 6; a++)
                job->shape[a / 3][i][a % 3] += vf_sum(sums.sums[s].m[a]);
        for (int s = 0; s < sums.count; s++) {
            const ContactSum *sum = &sums.sums[s];
            Contact *contact = &scratch->contacts[contact_count++];
            contact->particle = i;
            contact->object = (uint32_t)sum->object;
            for (int a = 0; a < 3; a++) {
                contact->g[a] = vf_sum(sum->g[a]);
                g[a] += contact->g[a];
            }
            turn_of_push(job, contact);
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
