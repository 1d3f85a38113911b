/* Second stage of a fill: which of the cloud's points stay [Carensac2023 sec. 3.1, 3.2 and algorithm 1].
 *
 * No point moves, so the rows are built once. Their weights are integers (PairData.weights), and so is the
 * sum of a point's weights: taking a removed point out of its neighbours' sums is exact, costs only the
 * removed points' rows, and gives the same numbers in any order.
 *
 * density = own + constant (walls, bodies, existing water) + sum over the cloud's other points, air included.
 * Candidates are the points of water that feel a solid or existing water at all. */
#include "sim.h"

#include <math.h>

/* State of a point during the selection. */
enum { PASSIVE, CANDIDATE, MARKED, GONE };

typedef struct Select {
    const SkiffParams *params;
    RestCloud *cloud;
    uint32_t count, blocks;
    int threads;
    const PairData *pairs;
    float unit; /* density of a weight of 1 */
    float own;  /* density of a particle alone */
    uint8_t *state;
    uint32_t *candidates; /* in their order, those that are gone left out */
    uint32_t candidate_count;
    float *constant; /* of what can push points out: solids that they do not fit, existing water */
    float *walls;    /* of walls that they fit */
    int32_t *sum;
    float *density;
} Select;

#define EACH_POINT                                                                                           \
    _Pragma("omp parallel for schedule(static, BLOCK) num_threads(select->threads)") for (uint32_t i = 0;    \
                                                                                          i < select->count; \
                                                                                          i++)

#define EACH_CANDIDATE                                                                                       \
    _Pragma("omp parallel for schedule(static) num_threads(select->threads)") for (uint32_t k = 0;           \
                                                                                   k <                       \
                                                                                   select->candidate_count;  \
                                                                                   k++)

int rest_row(const PairData *pairs, uint32_t i, RestNeighbour *row) {
    const uint32_t slice = i / SLICE, lane = i % SLICE, first = slice * SLICE;
    const uint32_t begin = pairs->slices[slice].start;
    int count = 0;
    for (uint32_t entry = begin; entry < begin + pairs->slices[slice].length; entry++) {
        const int32_t weight = pairs->weights[(size_t)entry * SLICE + lane];
        if (weight == 0)
            continue;
        row[count++] = (RestNeighbour){entry_neighbour(pairs, first, entry, lane), weight};
    }
    return count;
}

static RestKind kind_of(const Select *select, uint32_t i) {
    return rest_kind(select->cloud->points.id[i]);
}

/* ---- Constant density and the early removals ---- */

static void add_solids(Select *select) {
    const Boundary *boundary = &select->cloud->boundary;
    memset(select->constant, 0, select->count * sizeof *select->constant);
    memset(select->walls, 0, select->count * sizeof *select->walls);
    for (uint32_t block = 0; block < select->blocks; block++) {
        const ContactSpan span = boundary->spans[block];
        for (uint32_t c = span.start; c < span.start + span.count; c++)
            (select->cloud->fits_walls && boundary->contacts[c].object == 0
                 ? select->walls
                 : select->constant)[boundary->contacts[c].particle] += boundary->contacts[c].weight;
    }
}

/* What water up to a plane gives a point on the plane, with the point's own share. Air farther in stands
 * where existing water is, and would lend what it has to give once more: the interface would end up short of
 * water. */
static const float HALF_SPACE = 0.5f;

static void find_candidates(Select *select) {
    const Standing *existing = &select->cloud->rows.beside;
    const bool exists = existing->push != NULL;
    EACH_POINT {
        const RestKind kind = kind_of(select, i);
        select->state[i] = PASSIVE;
        if (kind != REST_FLUID && kind != REST_AIR)
            continue;
        const float share = exists ? existing->push[i][3] : 0.0f;
        const bool touches = exists && existing->apart[i][3] > 0.0f;
        const bool taken = kind == REST_AIR && share > HALF_SPACE;
        select->constant[i] += share;
        if (touches || taken || select->constant[i] > select->params->rest_max_constant)
            select->state[i] = GONE;
        else if (kind == REST_FLUID && select->constant[i] > 0.0f)
            select->state[i] = CANDIDATE;
    }
}

static void list_candidates(Select *select) {
    select->candidates = select->cloud->order.data;
    select->candidate_count = 0;
    for (uint32_t i = 0; i < select->count; i++)
        if (select->state[i] == CANDIDATE)
            select->candidates[select->candidate_count++] = i;
}

static void sum_weights(Select *select) {
    EACH_CANDIDATE {
        const uint32_t i = select->candidates[k];
        RestNeighbour row[MAX_NEIGHBOURS];
        int32_t sum = 0;
        const int length = rest_row(select->pairs, i, row);
        for (int n = 0; n < length; n++) {
            if (select->state[row[n].index] != GONE)
                sum += row[n].weight;
        }
        select->sum[i] = sum;
    }
}

/* ---- Passes ---- */

typedef struct DensitySums {
    uint32_t count;
    double mean, square; /* means of rho and of rho^2 */
    float max;
} DensitySums;

static DensitySums measure(Select *select) {
    EACH_CANDIDATE {
        const uint32_t i = select->candidates[k];
        select->density[i] =
            select->own + select->constant[i] + select->walls[i] + select->unit * (float)select->sum[i];
    }
    DensitySums sums = {0};
    for (uint32_t k = 0; k < select->candidate_count; k++) {
        const uint32_t i = select->candidates[k];
        if (select->cloud->points.position[i][1] >= select->cloud->counted_below)
            continue;
        const double density = (double)select->density[i];
        sums.count++;
        sums.mean += density;
        sums.square += density * density;
        sums.max = fmaxf(sums.max, select->density[i]);
    }
    if (sums.count > 0) {
        sums.mean /= sums.count;
        sums.square /= sums.count;
    }
    return sums;
}

/* May j's going save i from going [sec. 3.1.1]? Of two equally dense the first in order counts as denser. */
static bool shields(const Select *select, uint32_t j, uint32_t i) {
    const bool marked = select->state[j] == MARKED;
    const bool denser =
        select->density[j] > select->density[i] || (select->density[j] == select->density[i] && j < i);
    switch (select->params->rest_protector) {
    case SKIFF_REST_PROTECTOR_DENSER:
        return denser && (marked || select->state[j] == CANDIDATE);
    case SKIFF_REST_PROTECTOR_PRINTED:
        return marked;
    default:
        return denser && marked;
    }
}

static bool is_protected(const Select *select, uint32_t i, float limit) {
    RestNeighbour row[MAX_NEIGHBOURS];
    const int length = rest_row(select->pairs, i, row);
    for (int k = 0; k < length; k++) {
        const float share = select->unit * (float)row[k].weight;
        if (share > select->params->rest_min_share && select->density[i] - share < limit &&
            shields(select, row[k].index, i))
            return true;
    }
    return false;
}

/* Marks go by the state at the start, so that no order of visits matters. Algorithm 1 as printed asks for no
 * difference in density: two points would save each other for ever, unless marks are lifted one by one. */
static void protect(Select *select, float limit) {
    uint8_t *stays = select->cloud->fate.data; /* not needed any more */
    if (select->params->rest_rule != SKIFF_REST_RULE_PROTECTION)
        return;
    if (select->params->rest_protector == SKIFF_REST_PROTECTOR_PRINTED) {
        for (uint32_t k = 0; k < select->candidate_count; k++) {
            const uint32_t i = select->candidates[k];
            if (select->state[i] == MARKED && is_protected(select, i, limit))
                select->state[i] = CANDIDATE;
        }
        return;
    }
    EACH_CANDIDATE {
        const uint32_t i = select->candidates[k];
        stays[i] = select->state[i] == MARKED && is_protected(select, i, limit);
    }
    EACH_CANDIDATE {
        const uint32_t i = select->candidates[k];
        if (stays[i])
            select->state[i] = CANDIDATE;
    }
}

static void remove_above(Select *select, float limit) {
    EACH_CANDIDATE {
        const uint32_t i = select->candidates[k];
        if (select->density[i] > limit)
            select->state[i] = MARKED;
    }
    protect(select, limit);
    uint32_t left = 0;
    for (uint32_t k = 0; k < select->candidate_count; k++) {
        const uint32_t i = select->candidates[k];
        if (select->state[i] != MARKED) {
            select->candidates[left++] = i;
            continue;
        }
        select->state[i] = GONE;
        RestNeighbour row[MAX_NEIGHBOURS];
        const int length = rest_row(select->pairs, i, row);
        for (int n = 0; n < length; n++)
            select->sum[row[n].index] -= row[n].weight;
    }
    select->candidate_count = left;
}

/* Sec. 3.1.2. Densities are in units of rest density. */
static float next_step(const SkiffParams *params, float step, double mean) {
    if (params->rest_rule == SKIFF_REST_RULE_BASE || (params->rest_freeze && step <= params->rest_min_step))
        return step;
    double wanted = (mean - (double)params->rest_target) * (double)params->rest_ratio;
    if (params->rest_round) /* the authors' code counts whole kg/m^3 */
        wanted = (floor(1000.0 * wanted) + 1.0) / 1000.0;
    return wanted > (double)params->rest_min_step ? (float)wanted : params->rest_min_step;
}

static void run_passes(Select *select, SkiffFill *fill) {
    const SkiffParams *params = select->params;
    DensitySums sums = measure(select);
    float limit = sums.max, step = params->rest_step;
    fill->passes = 1;
    fill->candidates = sums.count;
    while (sums.count > 0 && sums.mean >= (double)params->rest_target) {
        step = next_step(params, step, sums.mean);
        limit = fmaxf(limit - step, params->rest_target);
        remove_above(select, limit);
        sums = measure(select);
        fill->passes++;
    }
    fill->selected = sums.count;
    fill->density_mean = sums.mean;
    fill->density_spread = sqrt(fmax(0.0, sums.square - sums.mean * sums.mean));
    fill->density_rms = sqrt(fmax(0.0, sums.square + (double)params->rest_target *
                                                         ((double)params->rest_target - 2.0 * sums.mean)));
}

/* ---- The stage ---- */

static bool reserve(Select *select, Err *err) {
    RestCloud *cloud = select->cloud;
    const size_t n = select->count;
    if (!buffer_reserve(&cloud->state, "states of points", n, err) ||
        !buffer_reserve(&cloud->constant, "constant densities", n * sizeof(float), err) ||
        !buffer_reserve(&cloud->walls, "densities of walls", n * sizeof(float), err) ||
        !buffer_reserve(&cloud->sum, "sums of weights", n * sizeof(int32_t), err) ||
        !buffer_reserve(&cloud->density, "densities of points", n * sizeof(float), err) ||
        !buffer_reserve(&cloud->order, "points to keep", n * sizeof(uint32_t), err) ||
        !buffer_reserve(&cloud->fate, "fates of points", n, err))
        return false;
    select->state = cloud->state.data;
    select->constant = cloud->constant.data;
    select->walls = cloud->walls.data;
    select->sum = cloud->sum.data;
    select->density = cloud->density.data;
    return true;
}

/* What stands beside the candidates that are left. */
static void mark_rim(Select *select) {
    uint64_t *id = select->cloud->points.id;
    uint8_t *touched = select->cloud->fate.data; /* not needed any more */
    memset(touched, 0, select->count);
    EACH_POINT {
        if (select->state[i] != CANDIDATE)
            continue;
        RestNeighbour row[MAX_NEIGHBOURS];
        const int length = rest_row(select->pairs, i, row);
        for (int k = 0; k < length; k++) {
#pragma omp atomic write
            touched[row[k].index] = 1;
        }
    }
    EACH_POINT {
        const RestKind kind = rest_kind(id[i]);
        if (!touched[i])
            continue;
        if (select->state[i] == PASSIVE && (kind == REST_FLUID || kind == REST_SUPPORT))
            id[i] = rest_id(REST_RIM, id[i]);
    }
}

/* All points that may feel a solid settle with those that do: between one and two support radii from it. */
static void widen(Select *select) {
    EACH_POINT {
        if (select->state[i] == PASSIVE && kind_of(select, i) == REST_FLUID)
            select->state[i] = CANDIDATE;
    }
}

/* Air and what was removed goes; what stays is told apart by how it takes part in the stabilisation. */
static void keep_selected(Select *select, SkiffFill *fill) {
    Particles *points = &select->cloud->points;
    uint32_t kept = 0, *order = select->cloud->order.data;
    if (select->params->rest_settle == SKIFF_REST_SETTLE_SHELL)
        widen(select);
    mark_rim(select);
    fill->active = 0;
    for (uint32_t i = 0; i < select->count; i++) {
        const RestKind kind = kind_of(select, i);
        if (select->state[i] == GONE || kind == REST_AIR || kind == REST_SUPPORT_AIR)
            continue;
        if (select->state[i] == CANDIDATE) {
            points->id[i] = rest_id(REST_ACTIVE, points->id[i]);
            fill->active++;
        }
        fill->rim += kind == REST_RIM;
        order[kept++] = i;
    }
    particles_permute(points, order, kept, select->threads);
}

bool rest_select(SkiffSim *sim, SkiffFill *fill, Err *err) {
    RestCloud *cloud = &sim->rest;
    if (cloud->points.count == 0)
        return true;
    Select select = {.params = &sim->params,
                     .cloud = cloud,
                     .count = cloud->points.count,
                     .blocks = particles_blocks(&cloud->points),
                     .threads = sim->threads,
                     .pairs = &cloud->rows.pairs};
    if (!rest_search(sim, 1u << REST_FLUID | 1u << REST_AIR, err) || !reserve(&select, err))
        return false;
    select.own = sim->volume * sim->kernel.w_scale;
    select.unit = select.own / 32767.0f;
    add_solids(&select);
    find_candidates(&select);
    list_candidates(&select);
    sum_weights(&select);
    run_passes(&select, fill);
    keep_selected(&select, fill);
    return true;
}
