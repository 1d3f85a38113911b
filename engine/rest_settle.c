/* Last stage of a fill: what was selected settles [Carensac2023 sec. 3.3]. And the fill as a whole.
 *
 * A step: search, viscosity, (divergence solve,) gravity and density solve, damping, motion: the solver's
 * own, but not calming: what settles is all disorder, and losing it every step means creeping to its place
 * where it could fall. Bodies are held. Errors are means over the active particles.
 *
 * restSettle candidates, the paper's way: in the cloud, which then holds the candidates alone. All other
 * points stand still (standing.h) and keep the pressure that still water has at their place: for the solve it
 * is a boundary condition, so what is active settles under the load it will carry, and pressures of points
 * that cannot move do not pile up.
 *
 * restSettle all: in the simulation itself, all new water. A thin layer between walls and water that cannot
 * yield ends crowded or starved wherever the selection took one point too few or too many, and so the first
 * free steps move everything; and a cut through water at rest is no free surface at rest. Existing water
 * stands still here too. It begins with the pressures it has and then, where the new water crowds it, presses
 * harder until it is not.
 *
 * restSettle shell: most of the way is that of the layer, all of it is needed only for the last, small one.
 * First the cloud as with candidates, but twice as thick a layer; then a few steps of everything. */
#include "sim.h"

#include <math.h>

/* alpha of the printed schedule, from the first to the last step [sec. 5.1] */
static const double FIRST_ALPHA = 0.8, LAST_ALPHA = 0.1;
/* Longest step, r / sqrt(p / rho0): beyond 1.5 it is unstable, whatever depth and radius. */
static const float LONGEST = 1.35f;
/* The solves of moving water stop when the two-sided error is 0.6 of a tolerance. In a layer that is let go
 * only after more steps it may be all of the tolerance, as the paper does it the one-sided error, half of
 * that; whatever the last steps leave moves the first free ones. */
static const float PAPER_ERRORS = 3.3f, LAYER_ERRORS = 1.6f, LAST_ERRORS = 0.5f;
/* Of a density error of held water, the share that a step turns into pressure: with 1 its pressures swing. */
static const float HELD_SHARE = 0.15f;
/* Of what two particles lack to the distance of a radius, the share that each moves a step. */
static const float PART_SHARE = 0.1f;

/* Motion in one step, r, of a particle that is not yet where it will stay; and of one that leaves the top
 * between two layers, where it balanced: its speed grows by a tenth a step and more, in spite of the damping.
 */
static const float FAST_MOTION = 0.1f, LEAVING_MOTION = 0.05f, LEAVING_GROWTH = 1.1f;

/* Share of a density error that a step corrects, and of the velocity that it keeps, while a column settles.
 */
static const float COLUMN_SOFTENING = 0.25f, COLUMN_RETENTION = 0.8f;
enum { COLUMN_STEPS = 6000 };

/* What settles, and with what. */
typedef struct Settle {
    SkiffSim *sim;
    SkiffParams params; /* the simulation's, changed for the purpose */
    Particles *particles;
    Grid *grid;
    Rows *rows;
    Boundary *boundary;
    Dfsph *dfsph;
    StandingWater *standing; /* what is no particle and stands still; or NULL */
    const uint8_t *frozen;   /* [particles] 1: no row; or NULL */
    const uint8_t *held;     /* [particles] 1: does not move; or NULL */
    uint32_t active;
    int steps;     /* at most */
    int patience;  /* further ones, while a particle is not where it will stay; not for the cloud */
    bool layer;    /* only what is beside solids and existing water: in the cloud */
    bool yields;   /* existing water beside the new moves too */
    bool tracks;   /* where existing water was before the sorts: RestCloud.whence */
    float surface; /* y, m */
    double period; /* of a column, m */
} Settle;

/* ---- Search ---- */

static bool settle_sort(Settle *settle, Err *err) {
    const CellBounds everywhere = {{-INFINITY, -INFINITY, -INFINITY}, {INFINITY, INFINITY, INFINITY}};
    return grid_sort(settle->grid, settle->particles, settle->sim->kernel.support, &everywhere, NULL,
                     settle->sim->threads, err);
}

static bool settle_rows(Settle *settle, Err *err) {
    SkiffSim *sim = settle->sim;
    const StandingWater *standing = settle->standing;
    const RowsJob job = {.passes = sim->passes,
                         .grid = settle->grid,
                         .particles = settle->particles,
                         .kernel = &sim->kernel,
                         .volume = sim->volume,
                         .frozen = settle->frozen,
                         .standing = standing != NULL && standing->count > 0 ? &standing->set : NULL,
                         .threads = sim->threads};
    return rows_build(settle->rows, &job, err) && boundary_apply(settle->boundary, settle->rows, &job, err);
}

static Settle settle_cloud(SkiffSim *sim) {
    RestCloud *cloud = &sim->rest;
    return (Settle){.sim = sim,
                    .params = sim->params,
                    .layer = true,
                    .particles = &cloud->points,
                    .grid = &cloud->grid,
                    .rows = &cloud->rows,
                    .boundary = &cloud->boundary,
                    .dfsph = &cloud->dfsph,
                    .standing = &cloud->standing};
}

static Settle settle_all(SkiffSim *sim, float surface, uint32_t active) {
    return (Settle){.sim = sim,
                    .params = sim->params,
                    .particles = &sim->particles,
                    .grid = &sim->grid,
                    .rows = &sim->rows,
                    .boundary = &sim->boundary,
                    .dfsph = &sim->dfsph,
                    .active = active,
                    .surface = surface};
}

/* By kind: who gets no row. */
static void mark_kinds(SkiffSim *sim, uint32_t evaluated) {
    const Particles *points = &sim->rest.points;
    uint8_t *frozen = sim->rest.frozen.data;
    const uint32_t padded = particles_blocks(points) * BLOCK;
#pragma omp parallel for schedule(static) num_threads(sim->threads)
    for (uint32_t i = 0; i < padded; i++) {
        frozen[i] = i >= points->count || !(evaluated & 1u << rest_kind(points->id[i]));
    }
}

bool rest_search(SkiffSim *sim, uint32_t evaluated, Err *err) {
    RestCloud *cloud = &sim->rest;
    Settle settle = settle_cloud(sim);
    settle.frozen = cloud->frozen.data;
    mark_kinds(sim, evaluated);
    cloud->grid.apart = settle.frozen;
    if (!settle_sort(&settle, err))
        return false;
    mark_kinds(sim, evaluated);
    /* the samples are the simulation's, the contacts the cloud's own */
    cloud->boundary.fixed = sim->boundary.fixed;
    cloud->boundary.moving = sim->boundary.moving;
    if (!boundary_reserve(&cloud->boundary, cloud->points.capacity, sim->body_count, err))
        return false;
    boundary_place_centres(&cloud->boundary, sim->bodies, sim->body_count, sim->origin);
    return settle_rows(&settle, err);
}

/* ---- Steps ---- */

typedef struct SpeedSums {
    double mean, max;
    double leaving; /* largest of those whose speed grows */
} SpeedSums;

static float speed_of(const Particles *particles, uint32_t i) {
    const float *v = particles->velocity[i];
    return sqrtf(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}

/* The speeds with which a step begins, where it is asked whose grow. */
static void note_speeds(const Settle *settle) {
    if (settle->patience == 0)
        return;
    float *before = settle->sim->rest.speeds.data;
#pragma omp parallel for schedule(static) num_threads(settle->sim->threads)
    for (uint32_t i = 0; i < settle->particles->count; i++)
        before[i] = speed_of(settle->particles, i);
}

static SpeedSums block_speeds(const Settle *settle, uint32_t block, float growth) {
    const Particles *particles = settle->particles;
    const float *before = settle->patience > 0 ? settle->sim->rest.speeds.data : NULL;
    const uint32_t end = (block + 1) * BLOCK < particles->count ? (block + 1) * BLOCK : particles->count;
    SpeedSums sums = {0};
    for (uint32_t i = block * BLOCK; i < end; i++) {
        if (settle->held != NULL && settle->held[i])
            continue;
        const double speed = (double)speed_of(particles, i);
        sums.mean += speed;
        sums.max = speed <= sums.max ? sums.max : speed;
        if (before != NULL && speed > (double)(growth * before[i]))
            sums.leaving = speed <= sums.leaving ? sums.leaving : speed;
    }
    return sums;
}

/* `growth`: of a speed since note_speeds, that counts as leaving. */
static SpeedSums measure_speeds(const Settle *settle, float growth) {
    const uint32_t blocks = particles_blocks(settle->particles);
    double *partials = settle->dfsph->partials; /* free between the solves */
#pragma omp parallel for schedule(static) num_threads(settle->sim->threads)
    for (uint32_t block = 0; block < blocks; block++) {
        const SpeedSums sums = block_speeds(settle, block, growth);
        partials[(size_t)block * DFSPH_SUMS] = sums.mean;
        partials[(size_t)block * DFSPH_SUMS + 1] = sums.max;
        partials[(size_t)block * DFSPH_SUMS + 2] = sums.leaving;
    }
    SpeedSums sums = {0};
    for (uint32_t block = 0; block < blocks; block++) {
        const double *part = partials + (size_t)block * DFSPH_SUMS;
        sums.mean += part[0];
        sums.max = part[1] <= sums.max ? sums.max : part[1];
        sums.leaving = part[2] <= sums.leaving ? sums.leaving : part[2];
    }
    sums.mean /= settle->active;
    return sums;
}

static void move_active(const Settle *settle, float kept) {
    Particles *particles = settle->particles;
    const float dt = settle->params.time_step;
#pragma omp parallel for schedule(static) num_threads(settle->sim->threads)
    for (uint32_t i = 0; i < particles->count; i++) {
        if (settle->held != NULL && settle->held[i])
            continue;
        for (int k = 0; k < 3; k++) {
            particles->velocity[i][k] *= kept;
            particles->position[i][k] += dt * particles->velocity[i][k];
        }
    }
}

static float kept_share(const SkiffParams *params, int step) {
    if (params->rest_schedule == SKIFF_REST_SCHEDULE_CONSTANT || params->rest_steps < 2)
        return params->rest_retention;
    const double fall = pow(LAST_ALPHA / FIRST_ALPHA, (double)step / (params->rest_steps - 1));
    return (float)(1.0 - FIRST_ALPHA * fall);
}

/* Length of a step, in steps of the simulation. Without a wish the longest that is stable: where still water
 * presses with p, a particle out of its place is pushed on or back with a frequency of sqrt(p / rho0) / r
 * times a number, and explicit steps may be as long as that allows. */
static float step_scale(const Settle *settle) {
    const SkiffParams *params = &settle->params;
    if (params->rest_time_scale > 0.0f)
        return params->rest_time_scale;
    float lowest = settle->surface;
    for (uint32_t i = 0; i < settle->particles->count; i++)
        lowest = fminf(lowest, settle->particles->position[i][1]);
    for (uint32_t i = 0; settle->standing != NULL && i < settle->standing->count; i++)
        lowest = fminf(lowest, settle->standing->points[i][1]);
    const float depth = fmaxf(settle->surface - lowest, 8.0f * params->particle_radius);
    const float pressure = -params->gravity[1] * depth; /* p / rho0 */
    const float longest = LONGEST * params->particle_radius / sqrtf(pressure);
    return pressure > 0.0f ? fmaxf(longest / params->time_step, 1.0f) : 1.0f;
}

/* P is p dt^2 / rho0: another time step, another P. */
static void scale_pressures(const Settle *settle, float factor) {
    Particles *particles = settle->particles;
    if (settle->standing != NULL)
        standing_scale(settle->standing, factor);
#pragma omp parallel for schedule(static) num_threads(settle->sim->threads)
    for (uint32_t i = 0; i < particles->count; i++) {
        particles->pressure[i] *= factor;
        particles->pressure_divergence[i] *= factor;
    }
}

/* Sorts, and says who takes part: all of the cloud; in the simulation everyone with an id from `first_id` on.
 */
typedef bool SettleSearch(Settle *settle, uint64_t first_id, Err *err);

static bool search_cloud(Settle *settle, uint64_t first_id, Err *err) {
    (void)first_id;
    return settle_sort(settle, err) && settle_rows(settle, err);
}

static bool beside_moving(const Settle *settle, const uint8_t *held, uint32_t i) {
    RestNeighbour row[MAX_NEIGHBOURS];
    const int length = rest_row(&settle->rows->pairs, i, row);
    for (int k = 0; k < length; k++)
        if (!held[row[k].index])
            return true;
    return false;
}

/* Lets go what stands beside what moves: wider[i] is held[i] without it. */
static void let_go(const Settle *settle, const uint8_t *held, uint8_t *wider) {
#pragma omp parallel for schedule(static, BLOCK) num_threads(settle->sim->threads)
    for (uint32_t i = 0; i < settle->particles->count; i++)
        wider[i] = held[i] && !beside_moving(settle, held, i);
}

static void track_existing(Settle *settle) {
    RestCloud *cloud = &settle->sim->rest;
    const uint32_t *from = cloud->whence[0].data, *order = settle->grid->order;
    uint32_t *to = cloud->whence[1].data;
    for (uint32_t i = 0; i < settle->particles->count; i++)
        to[i] = from[order[i]];
    const Buffer swap = cloud->whence[0];
    cloud->whence[0] = cloud->whence[1];
    cloud->whence[1] = swap;
}

static bool search_all(Settle *settle, uint64_t first_id, Err *err) {
    if (!settle_sort(settle, err))
        return false;
    const Particles *particles = settle->particles;
    settle->frozen = particles->edge;
    if (!settle_rows(settle, err))
        return false;
    if (settle->tracks)
        track_existing(settle);
    RestCloud *cloud = &settle->sim->rest;
    uint8_t *held = cloud->held.data, *wider = cloud->frozen.data;
    for (uint32_t i = 0; i < particles->count; i++)
        held[i] = particles->id[i] < first_id || particles->edge[i] != EDGE_NONE;
    if (settle->tracks && settle->yields) { /* the edge has no rows, and so stays held */
        let_go(settle, held, wider);
        let_go(settle, wider, held);
    }
    return true;
}

/* Drops the last step's copies of the column and wraps what has moved out of it. */
static void wrap_column(Settle *settle, uint32_t *order) {
    Particles *particles = settle->particles;
    const float period = (float)settle->period;
    uint32_t kept = 0;
    for (uint32_t i = 0; i < particles->count; i++)
        if (particles->edge[i] != EDGE_CAUGHT)
            order[kept++] = i;
    particles_permute(particles, order, kept, settle->sim->threads);
    for (uint32_t i = 0; i < kept; i++)
        for (int k = 0; k < 3; k += 2) {
            float *x = &particles->position[i][k];
            *x = *x < 0.0f ? *x + period : *x >= period ? *x - period : *x;
        }
}

/* Copies what is within a support of a face to beyond the opposite one: held there, with the velocity and
 * pressure that the original has now. */
static void copy_column(Settle *settle) {
    Particles *particles = settle->particles;
    const float period = (float)settle->period, support = settle->sim->kernel.support;
    const uint32_t count = particles->count;
    for (uint32_t i = 0; i < count; i++)
        for (int turn_x = -1; turn_x <= 1; turn_x++)
            for (int turn_z = -1; turn_z <= 1; turn_z++) {
                const float *at = particles->position[i];
                const float p[3] = {at[0] + (float)turn_x * period, at[1], at[2] + (float)turn_z * period};
                if ((turn_x == 0 && turn_z == 0) || p[0] < -support || p[0] > period + support ||
                    p[2] < -support || p[2] > period + support)
                    continue;
                const uint32_t to = particles_append(particles, p, particles->velocity[i], 0.0);
                particles->pressure[to] = particles->pressure[i];
                particles->pressure_divergence[to] = particles->pressure_divergence[i];
                particles->edge[to] = EDGE_CAUGHT;
            }
}

static bool search_column(Settle *settle, uint64_t first_id, Err *err) {
    RestCloud *cloud = &settle->sim->rest;
    wrap_column(settle, cloud->order.data);
    copy_column(settle);
    return search_all(settle, first_id, err);
}

/* What is held beside the new water: where it is too dense it presses more, and less where it is too thin, so
 * that the new water comes to rest where both are at rest. */
static void correct_held(Settle *settle) {
    Particles *particles = settle->particles;
    const PairData *pairs = &settle->rows->pairs;
#pragma omp parallel for schedule(static, BLOCK) num_threads(settle->sim->threads)
    for (uint32_t i = 0; i < particles->count; i++) {
        const bool has_row = settle->frozen == NULL || !settle->frozen[i];
        if (!settle->held[i] || !has_row || !beside_moving(settle, settle->held, i))
            continue;
        const float diagonal = fmaxf(pairs->gradient_sum[i][3], 1.0f);
        const float next = particles->pressure[i] + HELD_SHARE * (pairs->density[i] - 1.0f) / diagonal;
        particles->pressure[i] = fmaxf(next, 0.0f);
    }
}

/* Moves who is closer than a radius to another a little apart: so close the kernel's gradient vanishes, and
 * pressure itself pushes pairs together. */
static void part_pairs(const Settle *settle) {
    Particles *particles = settle->particles;
    const Float4 *apart_from = (const Float4 *)settle->rows->beside.apart;
    const float r = settle->params.particle_radius, share = PART_SHARE / settle->params.time_step;
    const int32_t close = (int32_t)(32767.0f * (1.0f - 6.0f / 16.0f * (1.0f - 1.0f / 4.0f))); /* q = 1/4 */
#pragma omp parallel for schedule(static, BLOCK) num_threads(settle->sim->threads)
    for (uint32_t i = 0; i < particles->count; i++) {
        RestNeighbour row[MAX_NEIGHBOURS];
        if (settle->held != NULL && settle->held[i])
            continue;
        for (int k = 0; apart_from != NULL && k < 3; k++)
            particles->velocity[i][k] += share * apart_from[i][k];
        const int length = rest_row(&settle->rows->pairs, i, row);
        for (int n = 0; n < length; n++) {
            if (row[n].weight <= close)
                continue;
            float apart[3], distance_sq = 0.0f;
            for (int k = 0; k < 3; k++) {
                apart[k] = particles->position[i][k] - particles->position[row[n].index][k];
                distance_sq += apart[k] * apart[k];
            }
            const float distance = sqrtf(distance_sq);
            if (!(distance > 0.0f && distance < r))
                continue;
            const float speed = share * (r - distance);
            for (int k = 0; k < 3; k++)
                particles->velocity[i][k] += speed * apart[k] / distance;
        }
    }
}

static bool run_steps(Settle *settle, SettleSearch *search, uint64_t first_id, SkiffFill *fill, Err *err) {
    if (settle->steps == 0)
        return true;
    const SkiffParams given = settle->params;
    SkiffParams *params = &settle->params;
    const double unit = (double)(params->particle_radius / params->time_step);
    const float scale = step_scale(settle);
    const float errors = !settle->layer                                        ? LAST_ERRORS
                         : params->rest_settle == SKIFF_REST_SETTLE_CANDIDATES ? PAPER_ERRORS
                                                                               : LAYER_ERRORS;
    params->max_density_error = errors * params->rest_density_error;
    params->max_divergence_error *= errors;
    params->softening = params->rest_softening;
    params->feedforward = 0.0f;
    params->time_step *= scale;
    params->calming = 0.0f;
    const DfsphProblem problem = {.params = params,
                                  .passes = settle->sim->passes,
                                  .rows = settle->rows,
                                  .boundary = settle->boundary,
                                  .particles = settle->particles,
                                  .held = settle->held,
                                  .density_alone = !params->rest_divergence,
                                  /* Beside water that stands still a tighter stop presses the new into it:
                                   * single particles left at 0.4 m/s where it is 0.16. */
                                  .settling = settle->layer || settle->held != NULL,
                                  .evaluated_count = settle->active,
                                  .threads = settle->sim->threads};
    scale_pressures(settle, scale * scale);
    bool calm = false, restless = false;
    for (int step = 0; step < settle->steps + (restless ? settle->patience : 0) && !calm;
         step++, fill->steps++) {
        if (!search(settle, first_id, err))
            return false;
        note_speeds(settle);
        forces_apply_fluid(&problem, settle->dfsph);
        if (params->rest_divergence)
            dfsph_solve(settle->dfsph, &problem, SOLVE_DIVERGENCE);
        if (params->rest_settle != SKIFF_REST_SETTLE_CANDIDATES)
            part_pairs(settle);
        if (settle->held != NULL)
            correct_held(settle);
        dfsph_solve(settle->dfsph, &problem, SOLVE_DENSITY);
        const float damped = step > 0 ? kept_share(params, step - 1) : 1.0f;
        const SpeedSums speeds = measure_speeds(settle, LEAVING_GROWTH / damped);
        fill->mean_speed = speeds.mean;
        fill->max_speed = speeds.max;
        const double radii = (double)(params->time_step / params->particle_radius);
        restless =
            speeds.max * radii >= (double)FAST_MOTION || speeds.leaving * radii >= (double)LEAVING_MOTION;
        calm = step + 1 >= params->rest_min_steps && speeds.max < (double)params->rest_max_speed * unit &&
               speeds.mean < (double)params->rest_mean_speed * unit;
        move_active(settle, kept_share(params, step));
    }
    scale_pressures(settle, 1.0f / (scale * scale));
    settle->params = given;
    return true;
}

/* The cloud's water joins the simulation's; kinds in `keep` (bits 1 << RestKind) stay in the cloud, and join
 * later. */
static void take_over(SkiffSim *sim, uint32_t keep, double birth, SkiffFill *fill) {
    Particles *points = &sim->rest.points;
    uint32_t kept = 0, *order = sim->rest.order.data;
    for (uint32_t i = 0; i < points->count; i++) {
        const RestKind kind = rest_kind(points->id[i]);
        if (keep & 1u << kind) {
            order[kept++] = i;
            continue;
        }
        const uint32_t to =
            particles_append(&sim->particles, points->position[i], (const float[3]){0}, birth);
        sim->particles.pressure[to] = points->pressure[i];
        sim->particles.pressure_divergence[to] = points->pressure_divergence[i];
        fill->particles++;
    }
    if (kept > 0)
        particles_permute(points, order, kept, sim->threads);
    points->count = kept;
}

/* New water beside what settles stands there as it is. */
static void add_rim(SkiffSim *sim) {
    const Particles *points = &sim->rest.points;
    for (uint32_t i = 0; i < points->count; i++)
        if (rest_kind(points->id[i]) == REST_RIM)
            standing_add(&sim->rest.standing, points->position[i],
                         points->pressure[i] + points->pressure_divergence[i]);
}

bool rest_settle(SkiffSim *sim, const RestRequest *request, SkiffFill *fill, Err *err) {
    if (fill->active == 0 || sim->params.rest_steps == 0)
        return true;
    Settle settle = settle_cloud(sim);
    settle.active = fill->active;
    settle.steps = sim->params.rest_steps;
    settle.surface = request->surface;
    add_rim(sim);
    take_over(sim, 1u << REST_ACTIVE, request->birth, fill);
    return standing_sort(&sim->rest.standing, sim->kernel.support, err) &&
           dfsph_reserve(&sim->rest.dfsph, sim->rest.points.capacity, 1 + (uint32_t)sim->body_count, err) &&
           run_steps(&settle, search_cloud, 0, fill, err);
}

/* Existing water stands still while what is beside it settles, and then goes on as it went. */
static bool stop_existing(SkiffSim *sim, uint64_t first_id, Err *err) {
    RestCloud *cloud = &sim->rest;
    for (int k = 0; k < 2; k++)
        if (!buffer_reserve(&cloud->whence[k], "order of existing water",
                            sim->particles.capacity * sizeof(uint32_t), err))
            return false;
    uint32_t *whence = cloud->whence[0].data;
    for (uint32_t i = 0; i < sim->particles.count; i++) {
        whence[i] = i;
        if (sim->particles.id[i] < first_id)
            memset(sim->particles.velocity[i], 0, sizeof(Float4));
    }
    return true;
}

static void restart_existing(SkiffSim *sim, uint64_t first_id) {
    const Float4 *velocity = sim->rest.kept[PARTICLE_velocity].data;
    const uint32_t *whence = sim->rest.whence[0].data;
    for (uint32_t i = 0; i < sim->particles.count; i++)
        if (sim->particles.id[i] < first_id)
            memcpy(sim->particles.velocity[i], velocity[whence[i]], sizeof(Float4));
}

static uint32_t count_edge(const Particles *particles) {
    uint32_t count = 0;
    for (uint32_t i = 0; i < particles->count; i++)
        count += particles->edge[i] != EDGE_NONE;
    return count;
}

bool rest_settle_column(SkiffSim *sim, double period, SkiffFill *fill, Err *err) {
    fill->active = sim->particles.count - count_edge(&sim->particles);
    /* a period is at least two supports: at most eight copies of a particle */
    if (!sim_reserve(sim, 9 * sim->particles.count, err) ||
        !buffer_reserve(&sim->rest.held, "held particles", sim->particles.capacity + SLICE, err) ||
        !buffer_reserve(&sim->rest.order, "points to keep", sim->particles.capacity * sizeof(uint32_t), err))
        return false;
    Settle settle = settle_all(sim, 0.0f, fill->active);
    settle.held = sim->rest.held.data;
    settle.period = period;
    /* the copies lag one step behind: longer steps, or densities corrected at once, make them swing */
    settle.params.rest_time_scale = 1.0f;
    settle.params.rest_softening = COLUMN_SOFTENING;
    settle.params.rest_retention = COLUMN_RETENTION;
    settle.params.rest_max_speed = 0.0f;
    settle.steps = COLUMN_STEPS;
    const bool good = run_steps(&settle, search_column, 0, fill, err);
    wrap_column(&settle, sim->rest.order.data);
    return good;
}

/* All of the simulation's particles with ids from `first_id` on; all others, and the edge, are held. */
static bool settle_water(SkiffSim *sim, float surface, uint64_t first_id, SkiffFill *fill, Err *err) {
    const SkiffParams *params = &sim->params;
    const bool layer_done = fill->steps > 0;
    fill->active = fill->particles - count_edge(&sim->particles);
    if (fill->active == 0)
        return true;
    if (!buffer_reserve(&sim->rest.held, "held particles", sim->particles.capacity + SLICE, err) ||
        !buffer_reserve(&sim->rest.frozen, "held particles", sim->particles.capacity + SLICE, err) ||
        !buffer_reserve(&sim->rest.speeds, "speeds before a step", sim->particles.capacity * sizeof(float),
                        err))
        return false;
    const bool nothing_else = fill->active == sim->particles.count;
    memset(sim->rest.held.data, 0, sim->particles.capacity + SLICE);
    Settle settle = settle_all(sim, surface, fill->active);
    settle.held = nothing_else ? NULL : sim->rest.held.data;
    settle.tracks = sim->particles.count > fill->particles;
    settle.steps = layer_done ? 0 : params->rest_steps;
    bool good = (!settle.tracks || stop_existing(sim, first_id, err)) &&
                run_steps(&settle, search_all, first_id, fill, err);
    /* a particle that was held between two layers beside what is taken out falls into one of them only now */
    settle.steps = settle.patience = params->rest_final_steps;
    settle.yields = params->rest_settle == SKIFF_REST_SETTLE_SHELL;
    good = good && run_steps(&settle, search_all, first_id, fill, err);
    if (good && settle.tracks)
        restart_existing(sim, first_id);
    for (uint32_t i = 0; i < sim->particles.count; i++)
        if (sim->particles.id[i] >= first_id)
            memset(sim->particles.velocity[i], 0, sizeof(Float4));
    return good;
}

/* ---- The fill ---- */

/* What a fill that fails has to give back. Only settling all of the water touches what exists: it sorts it.
 */
static bool keep_existing(SkiffSim *sim, Err *err) {
    const Particles *particles = &sim->particles;
    for (int f = 0; f <= PARTICLE_FIELD_COUNT; f++) {
        const bool field = f < PARTICLE_FIELD_COUNT;
        const Buffer *from = field ? &particles->front[f] : &sim->rows.density;
        const size_t size = particles->count * (field ? particle_fields[f].size : sizeof(float));
        if (!buffer_reserve(&sim->rest.kept[f], "water kept during a fill", size, err))
            return false;
        memcpy(sim->rest.kept[f].data, from->data, size);
    }
    return true;
}

/* `kept`: the fill may have sorted what exists; else it stands before what is new, as it did. */
static void undo(SkiffSim *sim, uint32_t count, uint64_t first_id, bool kept) {
    Particles *particles = &sim->particles;
    particles->count = count;
    particles->next_id = first_id;
    for (int f = 0; f < PARTICLE_FIELD_COUNT; f++) {
        const size_t size = particle_fields[f].size, used = count * size;
        if (kept)
            memcpy(particles->front[f].data, sim->rest.kept[f].data, used);
        memset((char *)particles->front[f].data + used, 0,
               (particles->capacity + (size_t)SLICE) * size - used);
    }
    if (kept)
        memcpy(sim->rows.density.data, sim->rest.kept[PARTICLE_FIELD_COUNT].data, count * sizeof(float));
}

/* What is shown until the next step: the pressures of the fill; densities only where it came by them. */
static void show(SkiffSim *sim, uint64_t first_id, bool all) {
    float *density = sim->rows.density.data;
    for (uint32_t i = 0; !all && i < sim->particles.count; i++)
        if (sim->particles.id[i] >= first_id)
            density[i] = 0.0f;
    sim_add_pressures(sim, sim->pressure.data);
}

bool rest_check_tile(SkiffSim *sim, Err *err) {
    if (sim->tile.count == 0 && !tile_load_default(&sim->tile, err))
        return false;
    const double own = (double)sim->params.volume_factor, needed = sim->tile.volume_factor;
    return fabs(own - needed) < 1e-6 * needed ||
           err_set(err, ERR_INPUT,
                   "Configuration.volumeFactor: %g, but filling with water at rest needs %g: its points are "
                   "at rest with that",
                   own, needed);
}

bool rest_fill(SkiffSim *sim, const RestRequest *request, SkiffFill *fill, Err *err) {
    *fill = (SkiffFill){0};
    const uint64_t first_id = sim->particles.next_id;
    const uint32_t count = sim->particles.count;
    const bool all = sim->params.rest_settle != SKIFF_REST_SETTLE_CANDIDATES;
    const double start = timer_ms();
    if ((request->fitted == NULL && !rest_check_tile(sim, err)) ||
        (all && count > 0 && !keep_existing(sim, err)))
        return false;
    bool good = rest_gather(sim, request, fill, err);
    const double gathered = timer_ms();
    good = good && rest_select(sim, fill, err);
    const double selected = timer_ms();
    /* a layer between walls and water that both stand still finds no rest */
    const bool layer = !all || (sim->params.rest_settle == SKIFF_REST_SETTLE_SHELL && count == 0);
    good = good && (!layer || rest_settle(sim, request, fill, err));
    if (good)
        take_over(sim, 0, request->birth, fill);
    if (good && request->mark_edge != NULL)
        request->mark_edge(sim, count);
    const bool fits = request->fitted != NULL && fill->candidates == 0; /* as it is */
    good = good && (!all || fits || settle_water(sim, request->surface, first_id, fill, err));
    if (good)
        show(sim, first_id, all && !fits);
    else
        undo(sim, count, first_id, all && count > 0);
    fill->load_ms = gathered - start;
    fill->select_ms = selected - gathered;
    fill->settle_ms = timer_ms() - selected;
    return good;
}

void rest_cloud_free(RestCloud *cloud) {
    particles_free(&cloud->points);
    standing_free(&cloud->standing);
    grid_free(&cloud->grid);
    rows_free(&cloud->rows);
    cloud->boundary.fixed = cloud->boundary.moving = (BoundarySet){0};
    boundary_free(&cloud->boundary);
    dfsph_free(&cloud->dfsph);
    Buffer *buffers[] = {
        &cloud->tallies, &cloud->marks, &cloud->clearance, &cloud->laid,      &cloud->source, &cloud->fate,
        &cloud->frozen,  &cloud->held,  &cloud->state,     &cloud->constant,  &cloud->walls,  &cloud->sum,
        &cloud->density, &cloud->order, &cloud->whence[0], &cloud->whence[1], &cloud->speeds};
    for (size_t b = 0; b < sizeof buffers / sizeof *buffers; b++)
        buffer_free(buffers[b]);
    for (int f = 0; f <= PARTICLE_FIELD_COUNT; f++)
        buffer_free(&cloud->kept[f]);
}
