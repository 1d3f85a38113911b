/* What the pressure of a particle is.
 *
 * The unknown P_i of the solves is a multiplier: what it costs to keep one particle's density at rest
 * density. Walls and bodies take part in that density but have no unknown of their own, so a pair of fluid
 * particles is pressed apart by P_i + P_j, a particle and a wall by P_i alone. Beside a wall the multipliers
 * therefore exceed the pressure: 1.5 to 1.7 times on a floor, twice in a corner. (The same in words of
 * stress: per particle, the fluid's bonds carry 0.6 of the pressure across the layer on the floor, and the
 * wall's carry the rest in a gap that belongs to no particle.)
 *
 * The force on a particle is, with the density sum rho of fluid, walls and bodies,
 *   -V (P_i grad rho(x_i) + grad p(x_i)),   p(x) = sum_j V P_j W(x - x_j),
 * j over the fluid alone, itself included. The density is what the solve keeps constant, so its gradient has
 * no part in the mean, and what drives the water is the gradient of p: that is the pressure. It needs no wall
 * term and no division by the sum of the weights. In the continuum, beside a plane wall at 0, the force on
 * the wall is int P(y) W1(y) dy = p(0), and the momentum that passes through any plane at y is p(y): pressure
 * by the method of planes [Todd, Evans & Daivis 1995] and p are the same. Measured in tests/bench/NOTES.md.
 *
 * Positions are those of now; the unknowns acted during the last step, and what moves in one is little. */
#include "sim.h"

#include <stdlib.h>

/* The fluid by cells of edge h, copied in order: the three cells of a column that a particle feels are one
 * run. */
typedef struct PressureCloud {
    CellGrid cells;
    uint32_t *start, *cell; /* [cells + 1]; [count] */
    uint32_t *order;        /* [count] particle k of the cloud is the simulation's order[k] */
    Float4 *points;         /* [count] position, unknown (Pa) */
} PressureCloud;

static void cloud_free(PressureCloud *cloud) {
    free(cloud->start);
    free(cloud->cell);
    free(cloud->order);
    free(cloud->points);
}

static bool cloud_layout(const SkiffSim *sim, PressureCloud *cloud, Err *err) {
    const Particles *particles = &sim->particles;
    CellBounds bounds = cell_bounds_empty();
    for (uint32_t i = 0; i < particles->count; i++) {
        const float *p = particles->position[i];
        if (!isfinite(p[0]) || !isfinite(p[1]) || !isfinite(p[2]))
            return err_set(err, ERR_DIVERGED, "particle %llu has no finite position",
                           (unsigned long long)particles->id[i]);
        cell_bounds_grow(&bounds, p);
    }
    return cell_grid_layout(&cloud->cells, &bounds, sim->kernel.support, 1) ||
           err_set(err, ERR_DIVERGED, "the particles spread over more than %d cells of %g m",
                   CELL_GRID_MAX_CELLS, (double)sim->kernel.support);
}

static void cloud_sort(const SkiffSim *sim, const float *unknown, PressureCloud *cloud) {
    const Particles *particles = &sim->particles;
    for (uint32_t i = 0; i < particles->count; i++)
        cloud->cell[i] = cell_grid_at(&cloud->cells, particles->position[i]);
    cell_grid_sort(cloud->cell, particles->count, cell_grid_count(&cloud->cells), cloud->start, cloud->order);
    for (uint32_t k = 0; k < particles->count; k++) {
        const uint32_t i = cloud->order[k];
        const float *x = particles->position[i];
        memcpy(cloud->points[k], (float[]){x[0], x[1], x[2], unknown[i]}, sizeof(Float4));
    }
    cloud->cells.start = cloud->start;
}

static bool cloud_make(const SkiffSim *sim, const float *unknown, PressureCloud *cloud, Err *err) {
    *cloud = (PressureCloud){0};
    if (!cloud_layout(sim, cloud, err))
        return false;
    const size_t count = sim->particles.count;
    cloud->start = malloc((cell_grid_count(&cloud->cells) + 1) * sizeof *cloud->start);
    cloud->cell = malloc(count * sizeof *cloud->cell);
    cloud->order = malloc(count * sizeof *cloud->order);
    cloud->points = malloc(count * sizeof *cloud->points);
    if (!cloud->start || !cloud->cell || !cloud->order || !cloud->points) {
        cloud_free(cloud);
        return err_set(err, ERR_INPUT, "no memory for the pressures of %u particles", sim->particles.count);
    }
    cloud_sort(sim, unknown, cloud);
    return true;
}

/* sum_j P_j W_ij, Pa/m^3. */
static double cloud_sum(const PressureCloud *cloud, const Kernel *kernel, const float *p) {
    const int32_t cell = (int32_t)cell_grid_at(&cloud->cells, p);
    const float support_sq = kernel->support * kernel->support;
    double sum = 0.0;
    for (int run = 0; run < CELL_RUNS; run++) {
        const CellRun near = cell_grid_run(&cloud->cells, cell, run);
        for (uint32_t j = near.begin; j < near.end; j++) {
            const float *q = cloud->points[j];
            const float dx = p[0] - q[0], dy = p[1] - q[1], dz = p[2] - q[2];
            const float distance_sq = dx * dx + dy * dy + dz * dz;
            if (distance_sq < support_sq)
                sum += (double)(q[3] * kernel_w(kernel, sqrtf(distance_sq)));
        }
    }
    return sum;
}

bool skiff_pressure(const SkiffSim *sim, float *pressure, Err *err) {
    const Particles *particles = &sim->particles;
    if (particles->count == 0)
        return true;
    sim_add_pressures(sim, pressure);
    PressureCloud cloud;
    if (!cloud_make(sim, pressure, &cloud, err))
        return false;
#pragma omp parallel for schedule(dynamic, 256) num_threads(sim->threads)
    for (uint32_t k = 0; k < particles->count; k++) {
        const uint32_t i = cloud.order[k];
        /* what stands at a window's edge has no unknown but the pressure of still water itself */
        if (particles->edge[i] == EDGE_NONE)
            pressure[i] = sim->volume * (float)cloud_sum(&cloud, &sim->kernel, cloud.points[k]);
    }
    cloud_free(&cloud);
    return true;
}
