/* Making the sea: water at rest that fits the walls. It is the initial water, what a moving window refills
 * itself from, and where water may come in at the edge.
 *
 * The tank is filled and settled once without its bodies. That takes as long as many steps, and gives the
 * same water every time: it is kept in a cache, under a name made of everything it depends on. */
#include "sim.h"
#include "base/file.h"
#include "base/log.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#define XXH_INLINE_ALL
#include <xxhash.h>

enum { FITTED_VERSION = 2, PATH_SIZE = 4096 };

/* ---- Storage ---- */

static bool fitted_reserve(RestFitted *fitted, Buffer *buffer, uint32_t count, Err *err) {
    if (!buffer_reserve(buffer, "water at rest", (size_t)count * (sizeof(Float4) + sizeof(float[2])) + 64,
                        err))
        return false;
    fitted->position = buffer->data;
    fitted->pressure = (void *)(fitted->position + count);
    fitted->count = count;
    return true;
}

static bool keep_fitted(SkiffSim *sim, Err *err) {
    RestFitted *fitted = &sim->sea.fitted;
    const Particles *particles = &sim->particles;
    if (!fitted_reserve(fitted, &sim->sea.fitted_buffer, particles->count, err))
        return false;
    memcpy(fitted->position, particles->position, particles->count * sizeof(Float4));
    for (uint32_t i = 0; i < particles->count; i++) {
        fitted->pressure[i][0] = particles->pressure[i];
        fitted->pressure[i][1] = particles->pressure_divergence[i];
    }
    return true;
}

/* ---- Cache ---- */

/* Of everything the fitted water depends on. */
static uint64_t hash_fitted(const SkiffSim *sim) {
    XXH3_state_t state;
    const BoundarySamples *samples = &sim->boundary.fixed.samples;
    const float level = (float)(sim->sea.level - sim->origin[1]);
    XXH3_64bits_reset(&state);
    XXH3_64bits_update(&state, &sim->params, sizeof sim->params);
    XXH3_64bits_update(&state, samples->position, samples->count * sizeof *samples->position);
    XXH3_64bits_update(&state, samples->volume, samples->count * sizeof *samples->volume);
    XXH3_64bits_update(&state, &level, sizeof level);
    XXH3_64bits_update(&state, sim->tile.position, sim->tile.count * sizeof *sim->tile.position);
    return XXH3_64bits_digest(&state);
}

static bool read_cache(SkiffSim *sim, const char *path) {
    Err reason = {0};
    if (!file_exists(path))
        return false;
    StateFile *file = state_file_open(path, FITTED_VERSION, &reason);
    const StateField *position =
        file ? state_file_field(file, "position", STATE_F32, 4, UINT64_MAX, &reason) : NULL;
    const StateField *pressure =
        position ? state_file_field(file, "pressure", STATE_F32, 2, position->count, &reason) : NULL;
    bool good = pressure != NULL && position->count < UINT32_MAX &&
                fitted_reserve(&sim->sea.fitted, &sim->sea.fitted_buffer, (uint32_t)position->count, &reason);
    if (good) {
        memcpy(sim->sea.fitted.position, position->data, (size_t)position->count * sizeof(Float4));
        memcpy(sim->sea.fitted.pressure, pressure->data, (size_t)position->count * sizeof(float[2]));
    } else {
        log_write(LOG_WARNING, "%s is not used: %s", path, reason.message);
    }
    state_file_close(file);
    return good;
}

static void write_cache(const SkiffSim *sim, const char *folder, const char *path) {
    const RestFitted *fitted = &sim->sea.fitted;
    Err reason = {0};
    StateField fields[2] = {{.name = "position",
                             .type = STATE_F32,
                             .components = 4,
                             .count = fitted->count,
                             .data = fitted->position},
                            {.name = "pressure",
                             .type = STATE_F32,
                             .components = 2,
                             .count = fitted->count,
                             .data = fitted->pressure}};
    /* a cache that cannot be written costs time, not the run */
    if (!file_make_directory(folder, &reason) || !state_file_write(path, FITTED_VERSION, fields, 2, &reason))
        log_write(LOG_WARNING, "water at rest is not kept for the next run: %s", reason.message);
}

/* ---- Making ---- */

typedef struct SeaPlace {
    float level;
} SeaPlace;

static RestPlace below_level(const void *user, const float p[3]) {
    return p[1] < ((const SeaPlace *)user)->level ? REST_IN_WATER : REST_IN_AIR;
}

static RestPlace anywhere(const void *user, const float p[3]) {
    (void)user;
    (void)p;
    return REST_IN_WATER;
}

static RestRequest sea_request(const SkiffSim *sim, const SeaPlace *place) {
    RestRequest request = {.surface = place->level, .place = below_level, .user = place, .birth = sim->time};
    memcpy(request.bounds.min, sim->tank.min, sizeof request.bounds.min);
    memcpy(request.bounds.max, sim->tank.max, sizeof request.bounds.max);
    request.bounds.max[1] = fminf(request.bounds.max[1], place->level);
    return request;
}

/* Fills the tank as if it had no bodies. */
static bool fill_alone(SkiffSim *sim, Err *err) {
    const SeaPlace place = {(float)(sim->sea.level - sim->origin[1])};
    const RestRequest request = sea_request(sim, &place);
    const int body_count = sim->body_count;
    const BoundarySet moving = sim->boundary.moving;
    const SkiffParams params = sim->params;
    sim->body_count = 0;
    sim->boundary.moving = (BoundarySet){0};
    sim->params.rest_steps = sim->params.sea_steps;
    sim->params.rest_settle = SKIFF_REST_SETTLE_ALL;
    const bool good = rest_fill(sim, &request, &sim->fill, err) && keep_fitted(sim, err);
    sim->params = params;
    sim->boundary.moving = moving;
    sim->body_count = body_count;
    sim->particles.count = 0;
    sim->particles.next_id = 0;
    return good;
}

/* The part of the fitted water that moves can need: between the edge and as far in as the largest move, the
 * water it leaves behind, and two supports for what surrounds that. */
static bool make_ring(SkiffSim *sim, Err *err) {
    Sea *sea = &sim->sea;
    const float depth = (sim->params.window_cap + sim->params.window_new + 2.0f) * sim->kernel.support +
                        sim->params.window_old * sim->params.particle_radius;
    const uint32_t n = sea->fitted.count;
    if (!fitted_reserve(&sea->ring, &sea->ring_buffer, n, err) ||
        !buffer_reserve(&sea->distance_buffer, "distances to the edge", (size_t)n * 2 * sizeof(float), err))
        return false;
    float *distance = sea->distance_buffer.data;
    shape_distances_sides(&sim->tank, (const float(*)[4])sea->fitted.position, n, distance, sim->threads);
    uint32_t count = 0;
    for (uint32_t i = 0; i < n; i++) {
        if (distance[i] < -depth)
            continue;
        memcpy(sea->ring.position[count], sea->fitted.position[i], sizeof(Float4));
        memcpy(sea->ring.pressure[count], sea->fitted.pressure[i], sizeof(float[2]));
        count++;
    }
    sea->ring.count = count;
    return true;
}

static bool check_def(SkiffSim *sim, const SkiffDef *def, Err *err) {
    const SkiffSeaDef *sea = &def->sea;
    bool good = true;
    if (sim->tank.kind == SKIFF_GEOMETRY_NONE)
        return err_add(err, ERR_INPUT, "Sea: needs a Tank, whose walls are its edge");
    if (!(sea->level > sim->tank.min[1] + sim->origin[1] && sea->level < sim->tank.max[1] + sim->origin[1]))
        good = err_add(err, ERR_INPUT,
                       "Sea.level: %g m, must lie between the tank's floor at %g m and its top at %g m",
                       (double)sea->level, (double)sim->tank.min[1] + sim->origin[1],
                       (double)sim->tank.max[1] + sim->origin[1]);
    if (sim->params.gravity[0] != 0.0f || sim->params.gravity[2] != 0.0f || sim->params.gravity[1] >= 0.0f)
        good = err_add(err, ERR_INPUT, "Sea: gravity must point straight down");
    if (sea->follow != NULL && sea->path_count > 0)
        good = err_add(err, ERR_INPUT, "Sea: follow and path exclude each other");
    sim->sea.follow = -1;
    for (int b = 0; sea->follow != NULL && b < sim->body_count; b++)
        if (strcmp(sim->bodies[b].name, sea->follow) == 0)
            sim->sea.follow = b;
    if (sea->follow != NULL && sim->sea.follow < 0)
        good = err_add(err, ERR_INPUT, "Sea.follow: there is no body '%s'", sea->follow);
    sim->sea.level = (double)sea->level;
    const float beyond = sim->sea.follow >= 0 ? window_followed_distance(sim) : -1.0f;
    if (beyond >= 0.0f)
        good = err_add(err, ERR_INPUT, "Sea.follow: body '%s' starts outside the window, by %.3g m",
                       sea->follow, (double)beyond);
    for (int k = 0; k < sea->path_count; k++) {
        const double *p = sea->path[k];
        if (!isfinite(p[0]) || !isfinite(p[1]) || !isfinite(p[2]) || (k > 0 && p[0] <= sea->path[k - 1][0]))
            good = err_add(err, ERR_INPUT, "Sea.path[%d]: times must rise and numbers be finite", k);
    }
    /* a window smaller than what it leaves behind on both sides holds no water */
    const float room = (sim->params.window_cap + 2.0f * sim->params.window_new) * sim->kernel.support;
    const float width = fminf(sim->tank.max[0] - sim->tank.min[0], sim->tank.max[2] - sim->tank.min[2]);
    if ((sea->follow != NULL || sea->path_count > 0) && width < room)
        good = err_add(err, ERR_INPUT, "Sea: a window must be at least %g m wide to move, the tank is %g m",
                       (double)room, (double)width);
    return good;
}

static bool take_def(SkiffSim *sim, const SkiffDef *def, Err *err) {
    Sea *sea = &sim->sea;
    sea->on = true;
    sea->absorbs = def->sea.absorb;
    sea->dry = def->sea.dry;
    sea->water_edge = sea_has_water_edge(def);
    sea->has_region = def->sea.has_region;
    for (int k = 0; k < 3; k++) {
        sea->centre[k] = 0.5 * ((double)sim->tank.min[k] + (double)sim->tank.max[k]);
        sea->region_min[k] = (float)((double)def->sea.region_min[k] - sim->origin[k]);
        sea->region_max[k] = (float)((double)def->sea.region_max[k] - sim->origin[k]);
    }
    sea->path_count = def->sea.path_count;
    if (sea->path_count == 0)
        return true;
    sea->path = malloc((size_t)sea->path_count * sizeof *sea->path);
    if (sea->path == NULL)
        return err_add(err, ERR_INPUT, "no memory");
    memcpy(sea->path, def->sea.path, (size_t)sea->path_count * sizeof *sea->path);
    return true;
}

bool sea_has_water_edge(const SkiffDef *def) {
    return def->sea.on && def->params.window_edge == SKIFF_WINDOW_EDGE_WATER &&
           (def->sea.follow != NULL || def->sea.path_count > 0);
}

/* The initial water of a window whose edge is water. */
static bool fill_edged(SkiffSim *sim, Err *err) {
    const float depth = (float)(sim->sea.level - sim->origin[1]) - sim->tank.min[1] + sim->kernel.support;
    if (!water_make(&sim->sea.water, sim, depth, err) || !edge_gather_all(sim, err)) {
        err_prefix(err, "Sea");
        return false;
    }
    const uint32_t count = sim->sea.laid.water.count;
    const SeaPlace place = {(float)(sim->sea.level - sim->origin[1])};
    RestRequest request = sea_request(sim, &place);
    request.place = anywhere;
    request.fitted = &sim->sea.laid.water;
    request.mark_edge = edge_mark;
    for (int k = 0; k < 3; k++) {
        request.bounds.min[k] = sim->tank.min[k] - sim->kernel.support;
        request.bounds.max[k] = sim->tank.max[k] + sim->kernel.support;
    }
    return sim_reserve(sim, count + count / 10, err) && rest_fill(sim, &request, &sim->fill, err) &&
           absorb_make(sim, err);
}

/* The initial water: the fitted one, less what bodies take up. */
static bool fill_first(SkiffSim *sim, Err *err) {
    const SeaPlace place = {(float)(sim->sea.level - sim->origin[1])};
    RestRequest request = sea_request(sim, &place);
    request.place = anywhere;
    request.bounds.max[1] = sim->tank.max[1];
    request.fitted = &sim->sea.fitted;
    return rest_fill(sim, &request, &sim->fill, err);
}

bool sea_make(SkiffSim *sim, const SkiffDef *def, Err *err) {
    if (!def->sea.on)
        return true;
    if (!check_def(sim, def, err) || !take_def(sim, def, err) || !rest_check_tile(sim, err))
        return false;
    if (def->sea.dry)
        return true;
    if (sim->sea.water_edge)
        return fill_edged(sim, err);
    char path[PATH_SIZE] = "";
    if (def->sea.cache != NULL)
        snprintf(path, sizeof path, "%.4000s/sea-%016llx.skiff", def->sea.cache,
                 (unsigned long long)hash_fitted(sim));
    if (!*path || !read_cache(sim, path)) {
        log_write(LOG_INFO, "making the sea's water at rest; this happens once for a window");
        if (!fill_alone(sim, err)) {
            err_prefix(err, "Sea");
            return false;
        }
        if (*path)
            write_cache(sim, def->sea.cache, path);
    }
    /* a window's water comes and goes: room for a tenth more, so that no step allocates */
    return sim_reserve(sim, sim->sea.fitted.count + sim->sea.fitted.count / 10, err) && make_ring(sim, err) &&
           absorb_make(sim, err) && fill_first(sim, err);
}

void sea_free(Sea *sea) {
    free(sea->path);
    buffer_free(&sea->fitted_buffer);
    buffer_free(&sea->ring_buffer);
    buffer_free(&sea->inlet_buffer);
    buffer_free(&sea->distance_buffer);
    buffer_free(&sea->flow_buffer);
    buffer_free(&sea->rim_start);
    buffer_free(&sea->rim_index);
    water_free(&sea->water);
    water_list_free(&sea->laid);
    *sea = (Sea){0};
}

/* ---- Looking ---- */

bool skiff_window(const SkiffSim *sim, SkiffWindow *window) {
    if (!sim->sea.on)
        return false;
    *window = (SkiffWindow){.level = sim->sea.level, .moves = sim->sea.moves};
    for (int k = 0; k < 3; k++)
        window->centre[k] = sim->origin[k] + sim->sea.centre[k];
    return true;
}

void skiff_window_distances(const SkiffSim *sim, const float (*position)[4], uint32_t count,
                            float *distance) {
    shape_distances_sides(&sim->tank, position, count, distance, sim->threads);
}

SkiffGhosts skiff_ghosts(const SkiffSim *sim) {
    const Ghosts *ghosts = &sim->ghosts;
    const uint32_t first = ghosts->first;
    return (SkiffGhosts){.count = ghosts->count,
                         .position = (const float(*)[4])ghosts->position + first,
                         .velocity = (const float(*)[4])ghosts->velocity + first,
                         .id = ghosts->id + first,
                         .birth = ghosts->birth + first,
                         .removed = ghosts->removed + first};
}
