/* A window whose edge is water: around it, one support wide, particles of the world's water at rest stand
 * still. They press on the water inside as still water does and yield to nothing: a wall that still water
 * does not notice. When the window moves, those that come to lie inside are set free where they are; water
 * that comes to lie in the edge is caught where it is; what is farther out is forgotten, and ahead the
 * world's water is laid on. Nothing that the water inside touches changes its place, so a move costs its
 * solver nothing: [Carensac2023 sec. 4.1] lays new water along all of the new wall instead and cuts it to fit
 * what stayed. */
#include "sim.h"

#include <math.h>

/* Caught water goes on for a while, so that the water behind it need not stop at once; s. */
static const float CATCH_TIME = 0.05f;
/* Pressures at rest differ from that of still water by less than this share of it, three times their spread,
 * and what a radius of depth makes: the surface's particles do not lie at the level. */
static const float SHARE = 0.25f;
/* Where the edge ends rounding decides who belongs to it: the same particle is closer than this, r. */
static const float SAME = 0.5f;
/* Laid water comes no closer than this to caught water, r: at rest the particles of the surface come as close
 * as 1.0. */
static const float APART = 0.9f;
/* How far beyond the old edge particles of it can lie in the way, r. */
static const float RIM = 2.0f;

typedef struct EdgePlace {
    const SkiffSim *sim;
    float shift[3]; /* m; of the window's last move */
    bool has_old;
    float support, radius;
    CellGrid rim_cells; /* of the edge that stayed, near its end */
    const uint32_t *rim_index;
} EdgePlace;

float edge_distance(const SkiffSim *sim, const float p[3], float gradient[3]) {
    const float level = (float)(sim->sea.level - sim->origin[1]);
    const float q[3] = {p[0], fminf(p[1], level), p[2]};
    return shape_distance(&sim->tank, q, gradient);
}

static float distance_before(const EdgePlace *place, const float p[3]) {
    const float before[3] = {p[0] + place->shift[0], p[1] + place->shift[1], p[2] + place->shift[2]};
    return edge_distance(place->sim, before, NULL);
}

/* ---- What stays ---- */

/* edge_distance of all particles, by batches. */
static bool measure_distances(SkiffSim *sim, Err *err) {
    const Particles *particles = &sim->particles;
    const float level = (float)(sim->sea.level - sim->origin[1]);
    Float4 *clamped = sim->dfsph.guess; /* free between the solves */
    if (!buffer_reserve(&sim->sea.distance_buffer, "distances to the edge",
                        (size_t)particles->capacity * sizeof(float), err))
        return false;
#pragma omp parallel for schedule(static) num_threads(sim->threads)
    for (uint32_t i = 0; i < particles->count; i++) {
        memcpy(clamped[i], particles->position[i], sizeof(Float4));
        clamped[i][1] = fminf(clamped[i][1], level);
    }
    shape_distances(&sim->tank, (const float(*)[4])clamped, particles->count, sim->sea.distance_buffer.data,
                    sim->threads);
    return true;
}

/* Pressure of still water, as the density solve has it. */
static float still_pressure(const SkiffSim *sim, const float p[3]) {
    const SkiffParams *params = &sim->params;
    const float depth = (float)(sim->sea.level - sim->origin[1]) - p[1];
    return fmaxf(-params->gravity[1] * depth * params->time_step * params->time_step, 0.0f);
}

/* Water at rest keeps the pressure that balances it; that of moving water is one step's, and gives way to
 * what still water has. */
static void catch_particle(SkiffSim *sim, uint32_t i) {
    Particles *particles = &sim->particles;
    const float *p = particles->position[i];
    const float still = still_pressure(sim, p);
    const float deeper =
        still_pressure(sim, (const float[3]){p[0], p[1] - sim->params.particle_radius, p[2]});
    particles->edge[i] = EDGE_CAUGHT;
    if (!(fabsf(particles->pressure[i] - still) < SHARE * still + (deeper - still)))
        particles->pressure[i] = still;
    particles->pressure_divergence[i] = 0.0f;
}

void edge_advance(SkiffSim *sim, uint32_t i) {
    Particles *particles = &sim->particles;
    const float dt = sim->params.time_step, kept = expf(-dt / CATCH_TIME);
    for (int k = 0; k < 3; k++) {
        particles->position[i][k] += dt * particles->velocity[i][k];
        particles->velocity[i][k] *= kept;
    }
}

static bool move_water(SkiffSim *sim, const EdgePlace *place, Err *err) {
    Particles *particles = &sim->particles;
    const uint32_t n = particles->count;
    if (!buffer_reserve(&sim->rest.source, "water that goes", (size_t)particles->capacity * sizeof(uint32_t),
                        err))
        return false;
#pragma omp parallel for schedule(static) num_threads(sim->threads)
    for (uint32_t i = 0; i < n; i++)
        for (int k = 0; k < 3; k++)
            particles->position[i][k] -= place->shift[k];
    for (int k = 0; k < 3; k++)
        sim->origin[k] += (double)place->shift[k];
    ghosts_shift(&sim->ghosts, place->shift);
    if (!measure_distances(sim, err))
        return false;
    float *distance = sim->sea.distance_buffer.data;
    uint32_t gone_count = 0, *gone = sim->rest.source.data;
    for (uint32_t i = 0; i < n; i++) {
        if (distance[i] >= place->support)
            gone[gone_count++] = i;
        else if (distance[i] >= 0.0f && particles->edge[i] == EDGE_NONE)
            catch_particle(sim, i);
    }
    if (!ghosts_reserve(&sim->ghosts, gone_count, sim->time, err))
        return false;
    for (uint32_t g = 0; g < gone_count; g++)
        ghosts_add(&sim->ghosts, particles, gone[g], sim->time);
    sim->stats.particles_out[SKIFF_OUT_WINDOW] += gone_count;
    particles_remove(particles, gone, gone_count, distance); /* the next sort cares for the order */
    return true;
}

/* After move_water, and when nobody needs to know any more who was edge. */
static void set_free(SkiffSim *sim, uint32_t count) {
    const float *distance = sim->sea.distance_buffer.data;
    Particles *particles = &sim->particles;
    for (uint32_t i = 0; i < count; i++)
        if (distance[i] < 0.0f && particles->edge[i] != EDGE_NONE) {
            particles->edge[i] = EDGE_NONE;
            particles->prediction[i] = -1.0f;
        }
}

/* ---- What comes ---- */

/* Sorts the old edge's particles near its end into cells. */
static bool sort_rim(SkiffSim *sim, EdgePlace *place, Err *err) {
    const Particles *particles = &sim->particles;
    Sea *sea = &sim->sea;
    CellBounds bounds;
    for (int k = 0; k < 3; k++) {
        bounds.min[k] = sim->tank.min[k] - place->support;
        bounds.max[k] = sim->tank.max[k] + place->support;
    }
    if (!cell_grid_layout(&place->rim_cells, &bounds, place->support, 2))
        return err_set(err, ERR_INPUT, "the window spans more than %d cells of %g m", CELL_GRID_MAX_CELLS,
                       (double)place->support);
    const CellGrid *grid = &place->rim_cells;
    const size_t cells = cell_grid_count(grid);
    if (!buffer_reserve(&sea->rim_start, "cells of the edge", (cells + 1) * sizeof(uint32_t), err) ||
        !buffer_reserve(&sea->rim_index, "particles of the edge",
                        2 * (size_t)particles->capacity * sizeof(uint32_t), err))
        return false;
    uint32_t *start = sea->rim_start.data, *index = sea->rim_index.data, *cell = index + particles->capacity;
#pragma omp parallel for schedule(static) num_threads(sim->threads)
    for (uint32_t i = 0; i < particles->count; i++) {
        const float *p = particles->position[i];
        const bool near = particles->edge[i] != EDGE_NONE &&
                          distance_before(place, p) >= place->support - RIM * place->radius;
        cell[i] = near ? cell_grid_at(grid, p) : CELL_NONE;
    }
    cell_grid_sort(cell, particles->count, cells, start, index);
    place->rim_cells.start = start;
    place->rim_index = index;
    return true;
}

/* Is somebody of the old edge where p would be? */
static bool is_taken(const EdgePlace *place, const float p[3]) {
    const Particles *particles = &place->sim->particles;
    const CellGrid *grid = &place->rim_cells;
    const int32_t cell = (int32_t)cell_grid_at(grid, p);
    for (int run = 0; run < CELL_RUNS; run++) {
        const CellRun around = cell_grid_run(grid, cell, run);
        for (uint32_t n = around.begin; n < around.end; n++) {
            const uint32_t j = place->rim_index[n];
            const float least = place->radius * (particles->edge[j] == EDGE_LAID ? SAME : APART);
            float distance_sq = 0.0f;
            for (int k = 0; k < 3; k++) {
                const float arm = p[k] - particles->position[j][k];
                distance_sq += arm * arm;
            }
            if (distance_sq < least * least)
                return true;
        }
    }
    return false;
}

/* For water_gather: beyond the old edge, up to the end of the new one. */
static float outside_ring(const void *user, const float p[3]) {
    const EdgePlace *place = user;
    const float beyond = edge_distance(place->sim, p, NULL) - place->support;
    if (!place->has_old)
        return beyond;
    return fmaxf(beyond, place->support - SAME * place->radius - distance_before(place, p));
}

static bool gather(SkiffSim *sim, const EdgePlace *place, Err *err) {
    WaterPlace part = {
        .surface = (float)(sim->sea.level - sim->origin[1]), .outside = outside_ring, .user = place};
    memcpy(part.origin, sim->origin, sizeof part.origin);
    for (int k = 0; k < 3; k++) {
        part.bounds.min[k] = sim->tank.min[k] - place->support;
        part.bounds.max[k] = sim->tank.max[k] + place->support;
    }
    return water_gather(&sim->sea.water, &part, &sim->sea.laid, sim->threads, err);
}

/* Takes out of the list what would come too close to the edge that stayed. */
static void drop_taken(const EdgePlace *place, RestFitted *laid) {
    Float4 *position = laid->position;
#pragma omp parallel for schedule(static) num_threads(place->sim->threads)
    for (uint32_t i = 0; i < laid->count; i++) {
        const float *p = position[i];
        const bool near = distance_before(place, p) < place->support + RIM * place->radius;
        position[i][3] = near && is_taken(place, p) ? 1.0f : 0.0f;
    }
    uint32_t kept = 0;
    for (uint32_t i = 0; i < laid->count; i++)
        if (position[i][3] == 0.0f) {
            memmove(position[kept], position[i], sizeof(Float4));
            memmove(laid->pressure[kept++], laid->pressure[i], sizeof(float[2]));
        }
    laid->count = kept;
}

/* Could a body be felt at p? */
static bool body_is_near(const EdgePlace *place, const float p[3]) {
    return sim_near_body(place->sim, p, (double)place->support);
}

static RestPlace laid_place(const void *user, const float p[3]) {
    return body_is_near(user, p) ? REST_IN_WATER : REST_STILL;
}

void edge_mark(SkiffSim *sim, uint32_t first) {
    Particles *particles = &sim->particles;
#pragma omp parallel for schedule(static) num_threads(sim->threads)
    for (uint32_t i = first; i < particles->count; i++)
        particles->edge[i] = edge_distance(sim, particles->position[i], NULL) < 0.0f ? EDGE_NONE : EDGE_LAID;
}

static RestRequest laid_request(SkiffSim *sim, const EdgePlace *place) {
    RestRequest request = {.surface = (float)(sim->sea.level - sim->origin[1]),
                           .place = laid_place,
                           .user = place,
                           .fitted = &sim->sea.laid.water,
                           .birth = sim->time,
                           .mark_edge = edge_mark};
    for (int k = 0; k < 3; k++) {
        request.bounds.min[k] = sim->tank.min[k] - place->support;
        request.bounds.max[k] = sim->tank.max[k] + place->support;
    }
    return request;
}

static bool append_laid(SkiffSim *sim, Err *err) {
    Particles *particles = &sim->particles;
    const RestFitted *laid = &sim->sea.laid.water;
    const uint32_t first = particles->count;
    if (!sim_reserve(sim, first + laid->count, err))
        return false;
    for (uint32_t i = 0; i < laid->count; i++) {
        const uint32_t to = particles_append(particles, laid->position[i], (const float[3]){0}, sim->time);
        particles->pressure[to] = laid->pressure[i][0];
        particles->pressure_divergence[to] = laid->pressure[i][1];
    }
    edge_mark(sim, first);
    sim->fill = (SkiffFill){.particles = laid->count};
    return true;
}

/* Water that a body may touch is selected to fit it, as everywhere; the rest is at rest as it comes. */
static bool lay_water(SkiffSim *sim, const EdgePlace *place, Err *err) {
    const RestFitted *laid = &sim->sea.laid.water;
    bool touches = false;
#pragma omp parallel for schedule(static) num_threads(sim->threads) reduction(|| : touches)
    for (uint32_t i = 0; i < laid->count; i++)
        touches = touches || body_is_near(place, laid->position[i]);
    if (!touches)
        return append_laid(sim, err);
    const SkiffParams params = sim->params;
    sim->params.rest_settle = SKIFF_REST_SETTLE_CANDIDATES;
    sim->params.rest_steps = sim->params.rest_min_steps = params.window_steps;
    sim->params.rest_target = params.window_target;
    const RestRequest request = laid_request(sim, place);
    const bool good = rest_fill(sim, &request, &sim->fill, err);
    sim->params = params;
    return good;
}

static EdgePlace edge_place(const SkiffSim *sim) {
    return (EdgePlace){.sim = sim, .support = sim->kernel.support, .radius = sim->params.particle_radius};
}

bool edge_gather_all(SkiffSim *sim, Err *err) {
    const EdgePlace place = edge_place(sim);
    return gather(sim, &place, err);
}

bool edge_move(SkiffSim *sim, const float shift[3], Err *err) {
    EdgePlace place = edge_place(sim);
    memcpy(place.shift, shift, sizeof place.shift);
    place.has_old = true;
    if (!move_water(sim, &place, err) || !sort_rim(sim, &place, err) || !gather(sim, &place, err))
        return false;
    drop_taken(&place, &sim->sea.laid.water);
    set_free(sim, sim->particles.count);
    if (!boundary_place(&sim->boundary, sim->bodies, sim->body_count, sim->origin, place.support,
                        sim->threads, err) ||
        !lay_water(sim, &place, err))
        return false;
    sim->stats.particles_in[SKIFF_IN_WINDOW] += sim->fill.particles;
    return absorb_make(sim, err);
}
