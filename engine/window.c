/* The window follows [Carensac2023 sec. 4.1]: when what it follows is too far from its middle it jumps there.
 * Water that would be too close to the old or the new edge is left behind; the ring that opens is filled with
 * water at rest that fits the walls, selected and stabilised where it meets the water that stayed.
 *
 * Walls never move in memory: positions are relative to the window, so what moves is the water, back. What
 * stays keeps its velocities, pressures and warm starts. */
#include "sim.h"

#include <math.h>

typedef struct WindowPlace {
    const SkiffSim *sim;
    const Shape *walls;
    float shift[3]; /* m */
    float overlap;  /* m: new water may come in this deep, where the cut through the old has left gaps */
    float support;  /* m */
    float old_margin, new_margin; /* m */
} WindowPlace;

/* How far p, in the window after the move, lies inside the water that stayed, m. */
static float depth_in_kept(const WindowPlace *place, const float p[3]) {
    const float before[3] = {p[0] + place->shift[0], p[1] + place->shift[1], p[2] + place->shift[2]};
    const float in_old = -shape_distance_sides(place->walls, before, NULL) - place->old_margin;
    const float in_new = -shape_distance_sides(place->walls, p, NULL) - place->new_margin;
    return fminf(in_old, in_new);
}

/* Points inside the water that stayed can never be added, whatever holes a wave has left there, but they lend
 * their density: the new water's neighbourhoods are full. */
static RestPlace ring_place(const void *user, const float p[3]) {
    const WindowPlace *place = user;
    const float depth = depth_in_kept(place, p);
    if (depth < place->overlap)
        return depth < -place->support && !sim_near_body(place->sim, p, (double)place->support)
                   ? REST_STILL
                   : REST_IN_WATER;
    return depth < place->overlap + place->support ? REST_IN_AIR : REST_OUTSIDE;
}

/* Where the middle of the window should be, world, m. */
static void wanted_centre(const SkiffSim *sim, double wanted[3]) {
    const Sea *sea = &sim->sea;
    if (sea->follow >= 0) {
        memcpy(wanted, sim->bodies[sea->follow].position, 3 * sizeof(double));
        return;
    }
    const int last = sea->path_count - 1;
    int k = 0;
    while (k < last && sea->path[k + 1][0] <= sim->time)
        k++;
    const double *a = sea->path[k], *b = sea->path[k < last ? k + 1 : k];
    double share = b[0] > a[0] ? (sim->time - a[0]) / (b[0] - a[0]) : 0.0;
    share = share < 0.0 ? 0.0 : share;
    wanted[0] = a[1] + share * (b[1] - a[1]);
    wanted[1] = 0.0;
    wanted[2] = a[2] + share * (b[2] - a[2]);
}

/* The next move, rounded to float so that the origin and the positions take the same step. False: none. */
static bool next_shift(const SkiffSim *sim, float shift[3]) {
    const Sea *sea = &sim->sea;
    if (!sea->on || (sea->follow < 0 && sea->path_count == 0))
        return false;
    double wanted[3];
    wanted_centre(sim, wanted);
    const double support = (double)sim->kernel.support;
    const double x = wanted[0] - sim->origin[0] - sea->centre[0],
                 z = wanted[2] - sim->origin[2] - sea->centre[2];
    const double length = sqrt(x * x + z * z), cap = (double)sim->params.window_cap * support;
    if (!(length > (double)sim->params.window_trigger * support))
        return false;
    const double share = length > cap ? cap / length : 1.0;
    shift[0] = (float)(share * x);
    shift[1] = 0.0f;
    shift[2] = (float)(share * z);
    return true;
}

/* Leaves behind what is too close to an edge and moves the rest. */
static bool move_water(SkiffSim *sim, const WindowPlace *place, Err *err) {
    Particles *particles = &sim->particles;
    Sea *sea = &sim->sea;
    const uint32_t n = particles->count;
    if (!buffer_reserve(&sea->distance_buffer, "distances to the edge",
                        (size_t)particles->capacity * 2 * sizeof(float), err) ||
        !buffer_reserve(&sim->rest.source, "water that stays", (size_t)particles->capacity * sizeof(uint32_t),
                        err))
        return false;
    float *in_old = sea->distance_buffer.data, *in_new = in_old + n;
    shape_distances_sides(place->walls, (const float(*)[4])particles->position, n, in_old, sim->threads);
#pragma omp parallel for schedule(static) num_threads(sim->threads)
    for (uint32_t i = 0; i < n; i++)
        for (int k = 0; k < 3; k++)
            particles->position[i][k] -= place->shift[k];
    shape_distances_sides(place->walls, (const float(*)[4])particles->position, n, in_new, sim->threads);
    uint32_t kept = 0, *order = sim->rest.source.data;
    for (uint32_t i = 0; i < n; i++)
        if (in_old[i] < -place->old_margin && in_new[i] < -place->new_margin)
            order[kept++] = i;
    if (!ghosts_reserve(&sim->ghosts, n - kept, sim->time, err))
        return false;
    ghosts_shift(&sim->ghosts, place->shift);
    for (uint32_t i = 0, next = 0; i < n; i++) {
        if (next < kept && order[next] == i)
            next++;
        else
            ghosts_add(&sim->ghosts, particles, i, sim->time);
    }
    sim->stats.particles_out[SKIFF_OUT_WINDOW] += n - kept;
    particles_permute(particles, order, kept, sim->threads);
    for (int k = 0; k < 3; k++)
        sim->origin[k] += (double)place->shift[k];
    return true;
}

/* As sec. 4.1 and the authors' code: the new water fits the walls, and only where it meets the water that
 * stayed a few damped steps are taken. */
static bool fill_ring(SkiffSim *sim, const WindowPlace *place, Err *err) {
    RestRequest request = {.surface = (float)(sim->sea.level - sim->origin[1]),
                           .place = ring_place,
                           .user = place,
                           .fitted = &sim->sea.ring,
                           .birth = sim->time};
    memcpy(request.bounds.min, sim->tank.min, sizeof request.bounds.min);
    memcpy(request.bounds.max, sim->tank.max, sizeof request.bounds.max);
    const SkiffParams params = sim->params;
    sim->params.rest_settle = SKIFF_REST_SETTLE_CANDIDATES;
    sim->params.rest_steps = sim->params.rest_min_steps = params.window_steps;
    sim->params.rest_target = params.window_target;
    sim->params.rest_time_scale = 1.0f;
    sim->params.rest_retention = 0.8f;
    sim->params.rest_divergence = false;
    const bool good = rest_fill(sim, &request, &sim->fill, err);
    sim->params = params;
    sim->stats.particles_in[SKIFF_IN_WINDOW] += sim->fill.particles;
    return good;
}

float window_followed_distance(const SkiffSim *sim) {
    const Body *body = &sim->bodies[sim->sea.follow];
    const float level = (float)(sim->sea.level - sim->origin[1]);
    const float p[3] = {(float)(body->position[0] - sim->origin[0]), level,
                        (float)(body->position[2] - sim->origin[2])};
    return shape_distance_sides(&sim->tank, p, NULL);
}

/* What is followed must not get away: beyond the edge there is no water to carry it. */
static bool check_followed(const SkiffSim *sim, Err *err) {
    const Sea *sea = &sim->sea;
    if (!sea->on || sea->follow < 0)
        return true;
    const float beyond = window_followed_distance(sim);
    return beyond < 0.0f ||
           err_set(
               err, ERR_DIVERGED,
               "body '%s' has left the window by %.3g m: it moves faster than Configuration.windowCap lets "
               "the window follow, %g h a step",
               sim->bodies[sea->follow].name, (double)beyond, (double)sim->params.window_cap);
}

bool window_follow(SkiffSim *sim, Err *err) {
    WindowPlace place = {.sim = sim, .walls = &sim->tank};
    if (!check_followed(sim, err))
        return false;
    if (!next_shift(sim, place.shift))
        return true;
    for (int b = 0; b < sim->body_count; b++) /* new water asks where they are now */
        body_prepare(&sim->bodies[b], sim->time);
    if (sim->sea.water_edge) {
        sim->sea.moves++;
        sim->stats.moved = true;
        return edge_move(sim, place.shift, err);
    }
    const float support = sim->kernel.support;
    place.old_margin = sim->params.window_old * sim->params.particle_radius;
    place.new_margin = sim->params.window_new * support;
    place.overlap = sim->params.window_overlap * sim->params.particle_radius;
    place.support = support;
    if (!move_water(sim, &place, err))
        return false;
    if (sim->particles.count == 0)
        return err_set(err, ERR_DIVERGED, "no water is left in the window after a move of (%g, %g) m",
                       (double)place.shift[0], (double)place.shift[2]);
    sim->sea.moves++;
    sim->stats.moved = true;
    return boundary_place(&sim->boundary, sim->bodies, sim->body_count, sim->origin, support, sim->threads,
                          err) &&
           fill_ring(sim, &place, err);
}
