/* Waves die at the edge [Carensac2023 sec. 4.2]: water that rises above the still surface close to the walls
 * is taken out, and where a trough opens a gap there, water comes in.
 *
 * It comes in at points of water at rest that fits the walls: all of them could be filled at once and be at
 * rest, so every point can be decided by itself. Decisions use the cells of this step's sort, whose particles
 * have moved by one step since: far less than the cells' slack. */
#include "sim.h"

#include "base/random.h"

#include <math.h>

/* Random numbers: stream of the first inlet, beyond any particle's id, which are those of the particles. */
static const uint64_t INFLOW_STREAM = (uint64_t)1 << 63;

static bool in_region(const Sea *sea, const float p[3]) {
    for (int k = 0; sea->has_region && k < 3; k++)
        if (!(p[k] >= sea->region_min[k] && p[k] <= sea->region_max[k]))
            return false;
    return true;
}

/* Chance that in this step the water at height y of a layer goes, or comes where there is room. The level of
 * a wave over h of water travels at 3 sqrt(g h) - 2 sqrt(g depth) into water at rest `depth` deep. When each
 * height of the layer is levelled at that speed over its width, as much passes in all as if the wave went on:
 * what is quicker sends back a wave upside down, what is slower the wave itself. */
static double levelling_share(const SkiffSim *sim, float y, float share_of_speed, float layer) {
    const double gravity = -(double)sim->params.gravity[1], floor = (double)sim->tank.min[1];
    const double depth = sim->sea.level - sim->origin[1] - floor, height = fmax((double)y - floor, 0.0);
    const double speed = fmax(3.0 * sqrt(gravity * height) - 2.0 * sqrt(gravity * depth), 0.0);
    return 1.0 - exp(-(double)share_of_speed * speed / (double)layer * (double)sim->params.time_step);
}

/* Has its turn come? `share_of_speed` 0: always. */
static bool has_turn(const SkiffSim *sim, uint64_t stream, float y, float share_of_speed, float layer) {
    return share_of_speed == 0.0f ||
           random_share(stream, sim->step) < levelling_share(sim, y, share_of_speed, layer);
}

/* ---- Inlets ---- */

static bool inlet_reserve(Sea *sea, uint32_t count, Err *err) {
    const size_t padded = (size_t)count + SLICE;
    if (!buffer_reserve(&sea->inlet_buffer, "inlets", padded * (2 * sizeof(Float4) + sizeof(float[2])),
                        err) ||
        !buffer_reserve(&sea->flow_buffer, "inflow", padded * sizeof(Float4), err))
        return false;
    sea->inlets = sea->inlet_buffer.data;
    sea->inlet_normals = sea->inlets + padded;
    sea->inlet_pressure = (void *)(sea->inlet_normals + padded);
    return true;
}

/* What the walls contribute to the density at an inlet: sum psi_b W, once for all. */
static float wall_density(const SkiffSim *sim, const float p[3]) {
    const SampleSet *walls = &sim->boundary.fixed.sorted;
    const int32_t cell = walls->count > 0 ? cell_grid_inner(&walls->grid, p) : -1;
    double sum = 0.0;
    for (int run = 0; cell >= 0 && run < CELL_RUNS; run++) {
        const CellRun near = cell_grid_run(&walls->grid, cell, run);
        for (uint32_t s = near.begin; s < near.end; s++) {
            const float dx = p[0] - walls->x[s], dy = p[1] - walls->y[s], dz = p[2] - walls->z[s];
            sum += (double)(walls->volume[s] * kernel_w(&sim->kernel, sqrtf(dx * dx + dy * dy + dz * dz)));
        }
    }
    return (float)sum;
}

/* For water_gather: along the inside of an edge of water. */
static float outside_layer(const void *user, const float p[3]) {
    const SkiffSim *sim = user;
    const float layer = sim->params.inflow_layer * sim->params.particle_radius;
    const float distance = shape_distance_sides(&sim->tank, p, NULL);
    return fmaxf(distance, -layer - distance);
}

/* The water at rest of which the inlets are part. */
static bool inlet_source(SkiffSim *sim, const RestFitted **source, Err *err) {
    Sea *sea = &sim->sea;
    *source = &sea->ring;
    if (!sea->water_edge)
        return true;
    WaterPlace place = {
        .surface = (float)(sea->level - sim->origin[1]), .outside = outside_layer, .user = sim};
    memcpy(place.origin, sim->origin, sizeof place.origin);
    memcpy(place.bounds.min, sim->tank.min, sizeof place.bounds.min);
    memcpy(place.bounds.max, sim->tank.max, sizeof place.bounds.max);
    *source = &sea->laid.water;
    return water_gather(&sea->water, &place, &sea->laid, sim->threads, err);
}

bool absorb_make(SkiffSim *sim, Err *err) {
    Sea *sea = &sim->sea;
    if (!sea->absorbs)
        return true;
    const float layer = sim->params.inflow_layer * sim->params.particle_radius;
    const float level = (float)(sea->level - sim->origin[1]);
    const RestFitted *source;
    uint32_t count = 0;
    if (!inlet_source(sim, &source, err) || !inlet_reserve(sea, source->count + source->count / 8, err))
        return false;
    Float4 *normals = sea->inlet_normals; /* [3]: is it one? */
#pragma omp parallel for schedule(static) num_threads(sim->threads)
    for (uint32_t i = 0; i < source->count; i++) {
        const float *p = source->position[i];
        float normal[3];
        const bool is_inlet =
            p[1] < level && in_region(sea, p) && shape_distance_sides(&sim->tank, p, normal) >= -layer;
        normals[i][3] = is_inlet ? 1.0f : 0.0f;
        if (!is_inlet)
            continue;
        const float length = sqrtf(normal[0] * normal[0] + normal[2] * normal[2]);
        normals[i][0] = length > 0.0f ? -normal[0] / length : 0.0f;
        normals[i][2] = length > 0.0f ? -normal[2] / length : 0.0f;
    }
    for (uint32_t i = 0; i < source->count; i++) {
        if (normals[i][3] == 0.0f)
            continue;
        const float *p = source->position[i];
        memcpy(sea->inlets[count], p, 3 * sizeof(float));
        sea->inlets[count][3] = sea->water_edge ? 0.0f : wall_density(sim, p);
        memmove(normals[count], normals[i], sizeof(Float4));
        memcpy(sea->inlet_pressure[count], source->pressure[i], sizeof(float[2]));
        count++;
    }
    sea->inlet_count = count;
    return true;
}

static bool body_is_near(const SkiffSim *sim, const float p[3], float distance) {
    const SampleSet *bodies = &sim->boundary.moving.sorted;
    const int32_t cell = bodies->count > 0 ? cell_grid_inner(&bodies->grid, p) : -1;
    if (cell < 0 || !bodies->occupied[cell])
        return false;
    for (int run = 0; run < CELL_RUNS; run++) {
        const CellRun near = cell_grid_run(&bodies->grid, cell, run);
        for (uint32_t s = near.begin; s < near.end; s++) {
            const float dx = p[0] - bodies->x[s], dy = p[1] - bodies->y[s], dz = p[2] - bodies->z[s];
            if (dx * dx + dy * dy + dz * dz < distance * distance)
                return true;
        }
    }
    return false;
}

/* Members [begin, end) of run 0 to 8 of the cells around cell c: three cells of a column each, the column
 * of the cell itself first. */
static void cell_run(const CellGrid *grid, const int32_t c[3], int run, uint32_t *begin, uint32_t *end) {
    const int column = (run + 4) % 9;
    const int32_t x = c[0] + column / 3 - 1, z = c[2] + column % 3 - 1;
    const int32_t low = c[1] - 1 < 0 ? 0 : c[1] - 1;
    const int32_t high = c[1] + 1 >= grid->size[1] ? grid->size[1] - 1 : c[1] + 1;
    *begin = *end = 0;
    if (x < 0 || z < 0 || x >= grid->size[0] || z >= grid->size[2] || low > high)
        return;
    *begin = grid->start[cell_grid_index(grid, x, low, z)];
    *end = grid->start[cell_grid_index(grid, x, high, z) + 1];
}

static float distance_sq(const float p[3], const float q[3]) {
    const float dx = p[0] - q[0], dy = p[1] - q[1], dz = p[2] - q[2];
    return dx * dx + dy * dy + dz * dz;
}

/* Is there room at inlet `index`? flow: the velocity of what would come in; [3] 1 if it does. Nearly always
 * somebody is there, and is found at once. */
static void try_inlet(const SkiffSim *sim, uint32_t index, float flow[4]) {
    const Sea *sea = &sim->sea;
    const CellGrid *grid = &sim->grid.cells;
    const uint32_t *member = sim->grid.member;
    const Float4 *position = sim->particles.position;
    const float *p = sea->inlets[index];
    const float distance = sim->params.inflow_distance * sim->params.particle_radius;
    int32_t c[3];
    uint32_t begin, end;
    double weight_sum = 0.0, sum[3] = {0};
    flow[3] = 0.0f;
    if (!has_turn(sim, INFLOW_STREAM + index, p[1], sim->params.inflow_speed,
                  sim->params.inflow_layer * sim->params.particle_radius))
        return;
    for (int k = 0; k < 3; k++)
        c[k] = (int32_t)floorf((p[k] - grid->origin[k]) * grid->inv_size);
    for (int run = 0; run < 9; run++) {
        cell_run(grid, c, run, &begin, &end);
        for (uint32_t j = begin; j < end; j++)
            if (distance_sq(p, position[member[j]]) < distance * distance)
                return;
    }
    for (int run = 0; run < 9; run++) {
        cell_run(grid, c, run, &begin, &end);
        for (uint32_t j = begin; j < end; j++) {
            const uint32_t i = member[j];
            const double weight =
                (double)(sim->volume * kernel_w(&sim->kernel, sqrtf(distance_sq(p, position[i]))));
            weight_sum += weight;
            for (int k = 0; k < 3; k++)
                sum[k] += weight * (double)sim->particles.velocity[i][k];
        }
    }
    weight_sum += (double)p[3]; /* the walls, which stand still */
    if (weight_sum + (double)(sim->volume * sim->kernel.w_scale) > (double)sim->params.inflow_density ||
        body_is_near(sim, p, distance) || rest_clearance(sim, p, false) < 0.0f)
        return;
    for (int k = 0; k < 3; k++)
        flow[k] = weight_sum > 0.0 ? (float)(sum[k] / weight_sum) : 0.0f;
    const float *normal = sea->inlet_normals[index];
    if (sim->params.inflow_inwards && flow[0] * normal[0] + flow[2] * normal[2] < 0.0f)
        return;
    flow[3] = 1.0f;
}

/* ---- Steps ---- */

/* The last particle takes the place of one that goes. */
static void remove_particle(SkiffSim *sim, uint32_t i) {
    const uint32_t last = sim->particles.count - 1;
    float *density = sim->rows.density.data;
    density[i] = density[last];
    particles_remove(&sim->particles, &i, 1, sim->pressure.data);
}

static bool let_out(SkiffSim *sim, Err *err) {
    const Sea *sea = &sim->sea;
    Particles *particles = &sim->particles;
    const float level = (float)(sea->level - sim->origin[1]);
    const float layer = sim->params.outflow_distance * sim->params.particle_radius;
    if (!buffer_reserve(&sim->sea.distance_buffer, "distances to the edge",
                        (size_t)particles->capacity * sizeof(float), err))
        return false;
    float *distance = sea->distance_buffer.data;
    shape_distances_sides(&sim->tank, (const float(*)[4])particles->position, particles->count, distance,
                          sim->threads);
    /* from the last to the first: who takes the place of one that goes has been looked at */
    for (uint32_t i = particles->count; i-- > 0;) {
        const float *p = particles->position[i];
        if (particles->edge[i] != EDGE_NONE)
            continue;
        /* above the surface near the edge; and what has got through or over the walls */
        const float depth = !in_region(sea, p) ? INFINITY : -distance[i];
        if (!(depth < (p[1] > level ? layer : -sim->params.particle_radius)))
            continue;
        if (depth >= -sim->params.particle_radius &&
            !has_turn(sim, particles->id[i], p[1], sim->params.outflow_speed, layer))
            continue;
        if (!ghosts_reserve(&sim->ghosts, 1, sim->time, err))
            return false;
        ghosts_add(&sim->ghosts, particles, i, sim->time);
        remove_particle(sim, i);
        sim->stats.particles_out[SKIFF_OUT_OUTFLOW]++;
    }
    return true;
}

static bool let_in(SkiffSim *sim, Err *err) {
    Sea *sea = &sim->sea;
    Float4 *flow = sea->flow_buffer.data;
    uint32_t entering = 0;
    for (uint32_t k = 0; k < sea->inlet_count; k++)
        entering += flow[k][3] > 0.0f;
    if (!sim_reserve(sim, sim->particles.count + entering, err) ||
        !buffer_reserve(&sim->rows.density, "density", (sim->particles.capacity + SLICE) * sizeof(float),
                        err))
        return false;
    float *density = sim->rows.density.data, *pressure = sim->pressure.data;
    for (uint32_t k = 0; k < sea->inlet_count; k++) {
        if (!(flow[k][3] > 0.0f))
            continue;
        const uint32_t to = particles_append(&sim->particles, sea->inlets[k], flow[k], sim->time);
        sim->particles.pressure[to] = sea->inlet_pressure[k][0];
        sim->particles.pressure_divergence[to] = sea->inlet_pressure[k][1];
        density[to] = 1.0f;
        pressure[to] = 0.0f;
        sim->stats.particles_in[SKIFF_IN_INFLOW]++;
    }
    return true;
}

bool absorb_waves(SkiffSim *sim, Err *err) {
    Sea *sea = &sim->sea;
    if (!sea->absorbs)
        return true;
    Float4 *flow = sea->flow_buffer.data;
#pragma omp parallel for schedule(static) num_threads(sim->threads)
    for (uint32_t k = 0; k < sea->inlet_count; k++)
        try_inlet(sim, k, flow[k]);
    return let_out(sim, err) && let_in(sim, err);
}
