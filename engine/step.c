/* ONE STEP, TOP TO BOTTOM. Read this first.
 *
 * [Carensac2023 alg. 2], with the pressure solves of dfsph.c:
 *   thrust and steering -> emit blocks -> move body samples -> sort -> search -> boundary terms -> viscosity
 * -> divergence solve -> gravity and density solve -> advance. The paper has its divergence solve before
 * viscosity. After it, nothing but gravity happens to the velocities until the density solve, and one
 * application of the pressures' gradients serves both. pressureSolver split has no divergence solve; its
 * density solve is two, for velocities and for positions.
 */
#define _POSIX_C_SOURCE 200809L
#include "sim.h"

#include <math.h>
#include <time.h>

double timer_ms(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec * 1e3 + (double)now.tv_nsec * 1e-6;
}

/* Sums over a block's particles that the statistics are made of. */
typedef struct AdvanceSums {
    double speed, height, energy, momentum[3], density_error, neighbours;
    float max_speed_sq, max_density;
} AdvanceSums;

static DfsphProblem step_problem(SkiffSim *sim) {
    return (DfsphProblem){.params = &sim->params,
                          .passes = sim->passes,
                          .rows = &sim->rows,
                          .boundary = &sim->boundary,
                          .bodies = sim->bodies,
                          .body_count = sim->body_count,
                          .particles = &sim->particles,
                          .held = sim->edge_count > 0 ? sim->particles.edge : NULL,
                          .evaluated_count = sim->particles.count - sim->edge_count,
                          .threads = sim->threads};
}

static bool place_bodies(SkiffSim *sim, Err *err) {
    for (int b = 0; b < sim->body_count; b++) {
        body_hold(&sim->bodies[b], sim->time, (double)sim->params.time_step);
        body_prepare(&sim->bodies[b], sim->time);
    }
    return boundary_place(&sim->boundary, sim->bodies, sim->body_count, sim->origin, sim->kernel.support,
                          sim->threads, err);
}

static bool sort_particles(SkiffSim *sim, Err *err) {
    const bool remove = sim->params.escape == SKIFF_ESCAPE_REMOVE;
    sim->edge_count = 0;
    for (uint32_t i = 0; sim->sea.water_edge && i < sim->particles.count; i++)
        sim->edge_count += sim->particles.edge[i] != EDGE_NONE;
    if (sim->edge_count > 0)
        sim->grid.apart = sim->particles.edge;
    return grid_sort(&sim->grid, &sim->particles, sim->kernel.support, &sim->domain,
                     remove ? &sim->stats.particles_out[SKIFF_OUT_ESCAPED] : NULL, sim->threads, err);
}

static RowsJob rows_job(SkiffSim *sim) {
    return (RowsJob){.passes = sim->passes,
                     .grid = &sim->grid,
                     .particles = &sim->particles,
                     .kernel = &sim->kernel,
                     .volume = sim->volume,
                     .frozen = sim->edge_count > 0 ? sim->particles.edge : NULL,
                     .threads = sim->threads};
}

static bool find_neighbours(SkiffSim *sim, Err *err) {
    const RowsJob job = rows_job(sim);
    return rows_build(&sim->rows, &job, err);
}

static bool splits(const SkiffSim *sim) {
    return sim->params.pressure_solver == SKIFF_SOLVER_SPLIT;
}

static bool add_boundary(SkiffSim *sim, Err *err) {
    const RowsJob job = rows_job(sim);
    if (splits(sim) && !rows_reserve_correction(&sim->rows, &sim->particles, err))
        return false;
    if (!boundary_apply(&sim->boundary, &sim->rows, &job, err))
        return false;
    if (splits(sim))
        rows_correct(&sim->rows, sim->passes, sim->threads);
    return true;
}

static void solve_divergence(SkiffSim *sim) {
    if (splits(sim))
        return;
    const DfsphProblem problem = step_problem(sim);
    const SolveResult result = dfsph_solve(&sim->dfsph, &problem, SOLVE_DIVERGENCE);
    sim->stats.divergence_iterations = result.iterations;
    sim->stats.divergence_error_percent = 100.0 * result.error;
}

static void apply_forces(SkiffSim *sim) {
    const DfsphProblem problem = step_problem(sim);
    forces_apply(sim, &problem);
}

static void solve_flow(SkiffSim *sim) {
    const DfsphProblem problem = step_problem(sim);
    const SolveResult result = dfsph_solve(&sim->dfsph, &problem, SOLVE_FLOW);
    sim->stats.divergence_iterations = result.iterations;
    sim->stats.divergence_error_percent = 100.0 * result.error;
}

static void solve_density(SkiffSim *sim) {
    const DfsphProblem problem = step_problem(sim);
    for (int b = 0; b < sim->body_count; b++)
        body_push(&sim->bodies[b], sim->params.gravity, sim->time, (double)sim->params.time_step);
    if (splits(sim))
        solve_flow(sim);
    const SolveResult result = dfsph_solve(&sim->dfsph, &problem, splits(sim) ? SOLVE_SHIFT : SOLVE_DENSITY);
    sim->stats.density_iterations = result.iterations;
    sim->stats.residual_percent = 100.0 * result.residual;
}

void sim_add_pressures(const SkiffSim *sim, float *total) {
    const Particles *particles = &sim->particles;
    const float unit = sim->params.rest_density / (sim->params.time_step * sim->params.time_step);
    const float second = splits(sim) ? 0.0f : 1.0f; /* what shifts particles is no pressure */
#pragma omp parallel for schedule(static) num_threads(sim->threads)
    for (uint32_t i = 0; i < particles->count; i++)
        total[i] = unit * (particles->pressure[i] + second * particles->pressure_divergence[i]);
}

/* Pressure of this step and the forces of the fluid on tank and bodies. */
static void measure_forces(SkiffSim *sim) {
    float *total = sim->pressure.data;
    sim_add_pressures(sim, total);
    const Particles *particles = &sim->particles;
    double(*forces)[6] = sim->object_forces.data;
    boundary_impulse(&sim->boundary, total, 1, particles_blocks(particles), forces, sim->threads);
    for (uint32_t o = 0; o < sim->boundary.object_count; o++)
        for (int k = 0; k < 6; k++)
            forces[o][k] *= (double)sim->volume; /* p V grad W */
}

static AdvanceSums advance_block(SkiffSim *sim, uint32_t block) {
    const Particles *particles = &sim->particles;
    const float dt = sim->params.time_step;
    const float *density = sim->rows.pairs.density;
    const Float4 *motion = splits(sim) ? sim->dfsph.guess : particles->velocity;
    const uint32_t begin = block * BLOCK;
    const uint32_t end = begin + BLOCK < particles->count ? begin + BLOCK : particles->count;
    AdvanceSums sums = {0};
    for (uint32_t i = begin; i < end; i++) {
        float *x = particles->position[i], *v = particles->velocity[i];
        if (particles->edge[i] != EDGE_NONE) {
            edge_advance(sim, i);
            continue;
        }
        for (int k = 0; k < 3; k++) {
            x[k] += dt * motion[i][k];
            sums.momentum[k] += (double)v[k];
        }
        const float speed_sq = v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
        sums.speed += (double)sqrtf(speed_sq);
        sums.energy += (double)speed_sq;
        sums.height += (double)x[1];
        sums.neighbours += sim->rows.neighbours[i];
        sums.density_error += density[i] > 1.0f ? (double)(density[i] - 1.0f) : 0.0;
        /* written so that a NaN stays */
        sums.max_speed_sq = speed_sq <= sums.max_speed_sq ? sums.max_speed_sq : speed_sq;
        sums.max_density = density[i] <= sums.max_density ? sums.max_density : density[i];
    }
    return sums;
}

static void summarise(SkiffSim *sim, const AdvanceSums *blocks, uint32_t block_count) {
    AdvanceSums all = {0};
    for (uint32_t block = 0; block < block_count; block++) {
        const AdvanceSums *one = &blocks[block];
        all.speed += one->speed;
        all.height += one->height;
        all.energy += one->energy;
        all.density_error += one->density_error;
        all.neighbours += one->neighbours;
        for (int k = 0; k < 3; k++)
            all.momentum[k] += one->momentum[k];
        all.max_speed_sq = one->max_speed_sq <= all.max_speed_sq ? all.max_speed_sq : one->max_speed_sq;
        all.max_density = one->max_density <= all.max_density ? all.max_density : one->max_density;
    }
    const uint32_t moving = sim->particles.count - sim->edge_count;
    const double n = moving > 0 ? moving : 1.0;
    const double mass = (double)sim->volume * (double)sim->params.rest_density;
    SkiffStats *stats = &sim->stats;
    stats->particles = sim->particles.count;
    stats->contacts = sim->boundary.contact_count;
    stats->mean_speed = all.speed / n;
    stats->max_speed = sqrt((double)all.max_speed_sq);
    stats->mean_height = all.height / n + sim->origin[1];
    stats->kinetic_energy = 0.5 * mass * all.energy;
    stats->potential_energy = -mass * (double)sim->params.gravity[1] * (all.height + n * sim->origin[1]);
    stats->density_error_percent = 100.0 * all.density_error / n;
    stats->density_max_percent = sim->particles.count > 0 ? 100.0 * ((double)all.max_density - 1.0) : 0.0;
    stats->neighbours = all.neighbours / n;
    for (int k = 0; k < 3; k++)
        stats->momentum[k] = mass * all.momentum[k];
}

static void advance(SkiffSim *sim) {
    const uint32_t blocks = particles_blocks(&sim->particles);
    AdvanceSums *sums = sim->sums.data;
#pragma omp parallel for schedule(static) num_threads(sim->threads)
    for (uint32_t block = 0; block < blocks; block++)
        sums[block] = advance_block(sim, block);
    summarise(sim, sums, blocks);
    const double dt = sim->params.time_step;
    for (int b = 0; b < sim->body_count; b++)
        body_advance(&sim->bodies[b], sim->time, dt);
    sim->step++;
    sim->time += dt;
    sim->stats.step = sim->step;
    sim->stats.time = sim->time;
    sim->stats.dt = dt;
}

/* Finds the particle behind an impossible value: a slow path, taken once. */
static bool report_fault(SkiffSim *sim, Err *err) {
    const Particles *particles = &sim->particles;
    for (uint32_t i = 0; i < particles->count; i++) {
        const float *v = particles->velocity[i], *x = particles->position[i];
        const double speed = sqrt((double)(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]));
        const double density = (double)sim->rows.pairs.density[i];
        if (speed <= (double)sim->params.speed_limit && density <= (double)sim->params.density_limit)
            continue;
        return err_set(
            err, ERR_DIVERGED,
            "particle %llu at (%.4g, %.4g, %.4g) m has speed %.4g m/s (limit %g) and density %.4g of rest "
            "(limit %g)",
            (unsigned long long)particles->id[i], (double)x[0] + sim->origin[0],
            (double)x[1] + sim->origin[1], (double)x[2] + sim->origin[2], speed,
            (double)sim->params.speed_limit, density, (double)sim->params.density_limit);
    }
    return true;
}

static bool check_bodies(const SkiffSim *sim, Err *err) {
    for (int b = 0; b < sim->body_count; b++) {
        double speed = 0.0;
        for (int k = 0; k < 3; k++)
            speed += sim->bodies[b].velocity[k] * sim->bodies[b].velocity[k];
        speed = sqrt(speed);
        if (!(speed <= (double)sim->params.speed_limit))
            return err_set(err, ERR_DIVERGED, "body '%s' has speed %g m/s (limit %g)", sim->bodies[b].name,
                           speed, (double)sim->params.speed_limit);
    }
    return true;
}

static bool check(SkiffSim *sim, Err *err) {
    const SkiffStats *stats = &sim->stats;
    const bool fine = stats->max_speed <= (double)sim->params.speed_limit &&
                      stats->density_max_percent <= 100.0 * ((double)sim->params.density_limit - 1.0);
    return (fine || report_fault(sim, err)) && check_bodies(sim, err);
}

static void begin_stats(SkiffStats *stats) {
    memset(stats->particles_in, 0, sizeof stats->particles_in);
    memset(stats->particles_out, 0, sizeof stats->particles_out);
    stats->moved = false;
}

/* Runs one phase, which sets `good`, and notes its time; after a failure the rest is skipped. */
#define PHASE_RUN(id, call)                                                                                  \
    if (good) {                                                                                              \
        call;                                                                                                \
        const double now = timer_ms();                                                                       \
        sim->stats.phase_ms[SKIFF_PHASE_##id] = now - before;                                                \
        before = now;                                                                                        \
    }

bool skiff_step(SkiffSim *sim, Err *err) {
    if (sim->sea.dry)
        return err_set(err, ERR_USAGE, "a sea that was made dry cannot be stepped");
    double before = timer_ms();
    const double begin = before;
    bool good = true;
    begin_stats(&sim->stats);
    PHASE_RUN(CONTROLS, drives_apply(sim));
    PHASE_RUN(WINDOW, good = window_follow(sim, err));
    PHASE_RUN(EMIT, good = block_emit(sim, &sim->stats.particles_in[SKIFF_IN_EMITTED], err));
    PHASE_RUN(BODIES, good = place_bodies(sim, err));
    PHASE_RUN(SORT, good = sort_particles(sim, err));
    PHASE_RUN(SEARCH, good = find_neighbours(sim, err));
    PHASE_RUN(BOUNDARY, good = add_boundary(sim, err));
    PHASE_RUN(FORCES, apply_forces(sim));
    PHASE_RUN(DIVERGENCE, solve_divergence(sim));
    PHASE_RUN(PRESSURE, solve_density(sim));
    PHASE_RUN(ADVANCE, measure_forces(sim); advance(sim); good = check(sim, err));
    PHASE_RUN(ABSORB, good = absorb_waves(sim, err));
    sim->stats.step_ms = timer_ms() - begin;
    if (!good)
        err_prefix(err, "step %llu (t = %.6g s)", (unsigned long long)sim->step, sim->time);
    return good;
}
