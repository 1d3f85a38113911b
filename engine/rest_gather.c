/* First stage of a fill [Carensac2023 sec. 3 and 3.1]: lays the points of water at rest over the place,
 * leaves out those in walls and bodies, and puts those that a solid or existing water can touch, with all
 * that surrounds them, into the cloud. The others are at rest as they come: they are only listed.
 *
 * Which points are touched is first decided by cells of edge h, generously; the selection then goes by
 * density. */
#include "sim.h"

#include <math.h>

/* Fate of a point: for the cloud the RestKind plus IN_CLOUD. */
enum { DROPPED, BULK, IN_CLOUD };

/* Marks of a cell: a solid or existing water is in it, in one beside it, in one beside that. */
enum { TOUCHED = 1, NEAR = 2, AROUND = 4 };

typedef struct Gather {
    SkiffSim *sim;
    const RestRequest *request;
    CellGrid cells;
    uint8_t *marks;
    float *clearance; /* of the cells' centres, m */
    size_t cell_count;
} Gather;

float rest_clearance(const SkiffSim *sim, const float p[3], bool walls) {
    float clearance = INFINITY;
    if (walls && sim->tank.kind != SKIFF_GEOMETRY_NONE) {
        const float rim = sim->tank.max[1] - sim->params.particle_radius;
        const float q[3] = {p[0], sim->tank_open && p[1] > rim ? rim : p[1], p[2]};
        clearance = -shape_distance(&sim->tank, q, NULL);
    }
    double world[3];
    for (int k = 0; k < 3; k++)
        world[k] = (double)p[k] + sim->origin[k];
    for (int b = 0; b < sim->body_count; b++) {
        const Body *body = &sim->bodies[b];
        float local[3];
        const double apart_sq = body_box_distance_sq(body, world, local);
        /* the bounds are a lower bound of the distance, and enough where others are nearer */
        if (apart_sq < (double)(clearance * clearance) || clearance < 0.0f)
            clearance = fminf(clearance, apart_sq > 4.0 * (double)(sim->kernel.support * sim->kernel.support)
                                             ? (float)sqrt(apart_sq)
                                             : mesh_distance(&body->mesh, local, NULL));
    }
    return clearance;
}

/* What a point of water must keep from the true surface: half a radius from the samples [sec. 3.1]. */
static float least_clearance(const SkiffSim *sim) {
    return (0.5f - sim->params.boundary_offset) * sim->params.particle_radius;
}

/* ---- Cells ---- */

static bool cell_of(const CellGrid *cells, const float *p, size_t *cell) {
    int32_t c[3];
    for (int k = 0; k < 3; k++) {
        const float at = (p[k] - cells->origin[k]) * cells->inv_size;
        c[k] = (int32_t)at;
        if (!(at >= 0.0f) || c[k] >= cells->size[k])
            return false;
    }
    *cell = (size_t)cell_grid_index(cells, c[0], c[1], c[2]);
    return true;
}

static void mark_points(Gather *gather, const float *points, uint32_t count, uint8_t mark) {
    size_t cell;
    for (uint32_t i = 0; i < count; i++)
        if (cell_of(&gather->cells, points + 4 * (size_t)i, &cell))
            gather->marks[cell] |= mark;
}

/* Every cell beside one that has `from` gets `to`. */
static void dilate(Gather *gather, uint8_t from, uint8_t to) {
    const CellGrid *cells = &gather->cells;
    for (int32_t x = 1; x + 1 < cells->size[0]; x++)
        for (int32_t z = 1; z + 1 < cells->size[2]; z++)
            for (int32_t y = 1; y + 1 < cells->size[1]; y++) {
                if (!(gather->marks[cell_grid_index(cells, x, y, z)] & from))
                    continue;
                for (int32_t dx = -1; dx <= 1; dx++)
                    for (int32_t dz = -1; dz <= 1; dz++)
                        for (int32_t dy = -1; dy <= 1; dy++)
                            gather->marks[cell_grid_index(cells, x + dx, y + dy, z + dz)] |= to;
            }
}

static void cell_centre(const CellGrid *cells, int32_t x, int32_t y, int32_t z, float centre[3]) {
    const int32_t c[3] = {x, y, z};
    for (int k = 0; k < 3; k++)
        centre[k] = cells->origin[k] + ((float)c[k] + 0.5f) / cells->inv_size;
}

/* One distance a cell settles the matter for most of its points: a distance changes no faster than one moves.
 */
static void measure_cells(Gather *gather) {
    const CellGrid *cells = &gather->cells;
#pragma omp parallel for schedule(dynamic, 1) num_threads(gather->sim->threads)
    for (int32_t x = 0; x < cells->size[0]; x++)
        for (int32_t z = 0; z < cells->size[2]; z++)
            for (int32_t y = 0; y < cells->size[1]; y++) {
                float centre[3];
                cell_centre(cells, x, y, z, centre);
                gather->clearance[cell_grid_index(cells, x, y, z)] =
                    rest_clearance(gather->sim, centre, gather->request->fitted == NULL);
            }
}

/* Is p, in the cell, clear of walls and bodies? */
static bool is_clear(const Gather *gather, size_t cell, const float p[3]) {
    const CellGrid *cells = &gather->cells;
    const int32_t column = (int32_t)cell / cells->size[1];
    float centre[3], apart_sq = 0.0f;
    cell_centre(cells, column / cells->size[2], (int32_t)cell % cells->size[1], column % cells->size[2],
                centre);
    for (int k = 0; k < 3; k++)
        apart_sq += (p[k] - centre[k]) * (p[k] - centre[k]);
    const float clearance = gather->clearance[cell], apart = 1.001f * sqrtf(apart_sq);
    const float least = least_clearance(gather->sim);
    if (clearance - apart > least || clearance + apart < least)
        return clearance > least;
    return rest_clearance(gather->sim, p, gather->request->fitted == NULL) >= least;
}

static bool make_cells(Gather *gather, Err *err) {
    SkiffSim *sim = gather->sim;
    const float support = sim->kernel.support;
    CellBounds bounds = gather->request->bounds;
    for (int k = 0; k < 3; k++) {
        bounds.min[k] -= support;
        bounds.max[k] += support;
    }
    if (!cell_grid_layout(&gather->cells, &bounds, support, 2))
        return err_set(err, ERR_INPUT, "the water to fill spans more than %d cells of %g m",
                       CELL_GRID_MAX_CELLS, (double)support);
    gather->cell_count =
        (size_t)gather->cells.size[0] * (size_t)gather->cells.size[1] * (size_t)gather->cells.size[2];
    if (!buffer_reserve(&sim->rest.marks, "cells to fill", gather->cell_count, err) ||
        !buffer_reserve(&sim->rest.clearance, "clearance of cells", gather->cell_count * sizeof(float), err))
        return false;
    gather->clearance = sim->rest.clearance.data;
    gather->marks = sim->rest.marks.data;
    memset(gather->marks, 0, gather->cell_count);
    if (gather->request->fitted == NULL && sim->boundary.fixed.samples.count > 0)
        mark_points(gather, sim->boundary.fixed.world[0], sim->boundary.fixed.samples.count, TOUCHED);
    if (sim->boundary.moving.samples.count > 0)
        mark_points(gather, sim->boundary.moving.world[0], sim->boundary.moving.samples.count, TOUCHED);
    if (sim->particles.count > 0)
        mark_points(gather, sim->particles.position[0], sim->particles.count, TOUCHED);
    dilate(gather, TOUCHED, NEAR);
    dilate(gather, NEAR, AROUND);
    /* fitted water keeps clear of the walls, and bodies are found by their samples' densities */
    measure_cells(gather);
    return true;
}

/* ---- Points ---- */

static uint8_t fate_of(const Gather *gather, const float p[3]) {
    size_t cell;
    if (!cell_of(&gather->cells, p, &cell))
        return DROPPED;
    const uint8_t mark = gather->marks[cell];
    const RestPlace place = gather->request->place(gather->request->user, p);
    if (place == REST_OUTSIDE || (place == REST_IN_AIR && !(mark & AROUND)))
        return DROPPED;
    if (!is_clear(gather, cell, p))
        return DROPPED;
    if (place == REST_IN_AIR)
        return IN_CLOUD + (mark & NEAR ? REST_AIR : REST_SUPPORT_AIR);
    return mark & NEAR && place != REST_STILL ? IN_CLOUD + REST_FLUID
           : mark & AROUND                    ? IN_CLOUD + REST_SUPPORT
                                              : BULK;
}

/* Positions of all points that may matter, and which point of the source each is. */
static bool lay_points(Gather *gather, uint32_t *count, Err *err) {
    SkiffSim *sim = gather->sim;
    RestCloud *cloud = &sim->rest;
    const RestRequest *request = gather->request;
    TileBox box = {.radius = (double)sim->params.particle_radius};
    uint64_t laid = request->fitted != NULL ? request->fitted->count : 0;
    for (int k = 0; k < 3; k++) {
        box.offset[k] = request->offset[k];
        box.min[k] = (double)(request->bounds.min[k] - sim->kernel.support) + sim->origin[k];
        box.max[k] = (double)(request->bounds.max[k] + sim->kernel.support) + sim->origin[k];
    }
    if (request->fitted == NULL && !tile_count_box(&sim->tile, &box, &laid, err))
        return false;
    if (laid > 2000000000u)
        return err_set(err, ERR_INPUT, "the water to fill takes %.4g points, the limit is 2e9", (double)laid);
    *count = (uint32_t)laid;
    if (!buffer_reserve(&cloud->laid, "points to fill", (size_t)laid * sizeof(float[3]), err) ||
        !buffer_reserve(&cloud->source, "sources of points", (size_t)laid * sizeof(uint32_t), err) ||
        !buffer_reserve(&cloud->fate, "fates of points", (size_t)laid, err))
        return false;
    if (request->fitted == NULL) {
        tile_fill_box(&sim->tile, &box, sim->origin, cloud->laid.data, cloud->source.data);
        return true;
    }
    float(*laid_at)[3] = cloud->laid.data;
    uint32_t *source = cloud->source.data;
    for (uint32_t i = 0; i < *count; i++) {
        memcpy(laid_at[i], request->fitted->position[i], sizeof laid_at[i]);
        source[i] = i;
    }
    return true;
}

/* P of still water at p. */
static float still_pressure(const Gather *gather, const float p[3]) {
    const SkiffParams *params = &gather->sim->params;
    const float depth = gather->request->surface - p[1];
    return fmaxf(-params->gravity[1] * depth * params->time_step * params->time_step, 0.0f);
}

/* With a tile in the proportions that balance its points. */
static void first_pressure(const Gather *gather, const float p[3], uint32_t source, float pressure[2]) {
    const SkiffSim *sim = gather->sim;
    const RestFitted *fitted = gather->request->fitted;
    pressure[0] = still_pressure(gather, p);
    pressure[1] = 0.0f;
    if (fitted != NULL) {
        pressure[0] = fitted->pressure[source][0];
        pressure[1] = fitted->pressure[source][1];
    } else {
        pressure[0] *= sim->tile.share[source];
    }
}

static void put(const Gather *gather, Particles *points, uint32_t to, uint32_t i, uint64_t id, double birth) {
    const float *p = ((const float(*)[3])gather->sim->rest.laid.data)[i];
    float pressure[2];
    particles_put(points, to, id, p, (const float[3]){0}, birth);
    first_pressure(gather, p, ((const uint32_t *)gather->sim->rest.source.data)[i], pressure);
    points->pressure[to] = pressure[0];
    points->pressure_divergence[to] = pressure[1];
}

/* Existing water that the points which may settle can feel. It presses as still water does: its own pressures
 * are those of one step, and swing by their own size from step to step. */
static void add_existing(Gather *gather, uint32_t count) {
    SkiffSim *sim = gather->sim;
    const Particles *points = &sim->rest.points;
    size_t cell;
    memset(gather->marks, 0, gather->cell_count);
    for (uint32_t i = 0; i < points->count; i++) {
        const RestKind kind = rest_kind(points->id[i]);
        if ((kind == REST_FLUID || kind == REST_AIR) && cell_of(&gather->cells, points->position[i], &cell))
            gather->marks[cell] |= NEAR;
    }
    dilate(gather, NEAR, AROUND);
    for (uint32_t i = 0; i < count; i++) {
        const float *p = sim->particles.position[i];
        if (cell_of(&gather->cells, p, &cell) && gather->marks[cell] & AROUND)
            standing_add(&sim->rest.standing, p, still_pressure(gather, p));
    }
}

/* How many of some points go where. */
typedef struct Tally {
    uint32_t near, bulk,
        water; /* to the cloud, to the simulation; to the simulation in the end, by the cloud */
} Tally;

enum { TALLY = 4096 }; /* points that are counted together, so that threads know where theirs begin */

/* Fates of all points. Leaves in `tallies` how many come before each part; returns how many there are. */
static Tally decide(const Gather *gather, uint32_t laid) {
    RestCloud *cloud = &gather->sim->rest;
    const float(*laid_at)[3] = cloud->laid.data;
    uint8_t *fate = cloud->fate.data;
    Tally *tallies = cloud->tallies.data, all = {0};
#pragma omp parallel for schedule(dynamic, 1) num_threads(gather->sim->threads)
    for (uint32_t part = 0; part <= laid / TALLY; part++) {
        Tally tally = {0};
        for (uint32_t i = part * TALLY; i < laid && i < (part + 1) * TALLY; i++) {
            fate[i] = fate_of(gather, laid_at[i]);
            tally.bulk += fate[i] == BULK;
            tally.near += fate[i] >= IN_CLOUD;
            tally.water += fate[i] == IN_CLOUD + REST_FLUID || fate[i] == IN_CLOUD + REST_SUPPORT;
        }
        tallies[part] = tally;
    }
    for (uint32_t part = 0; part <= laid / TALLY; part++) {
        const Tally tally = tallies[part];
        tallies[part] = all;
        all.near += tally.near;
        all.bulk += tally.bulk;
        all.water += tally.water;
    }
    return all;
}

/* Puts all points in their order where their fates say. */
static void deal(const Gather *gather, uint32_t laid, const Tally *all) {
    SkiffSim *sim = gather->sim;
    const uint8_t *fate = sim->rest.fate.data;
    const Tally *tallies = sim->rest.tallies.data;
    const uint64_t first_id = sim->particles.next_id;
    const uint32_t near = particles_extend(&sim->rest.points, all->near);
    const uint32_t bulk = particles_extend(&sim->particles, all->bulk);
#pragma omp parallel for schedule(dynamic, 1) num_threads(sim->threads)
    for (uint32_t part = 0; part <= laid / TALLY; part++) {
        Tally before = tallies[part];
        for (uint32_t i = part * TALLY; i < laid && i < (part + 1) * TALLY; i++) {
            if (fate[i] >= IN_CLOUD) {
                const uint64_t id = rest_id((RestKind)(fate[i] - IN_CLOUD), before.near);
                put(gather, &sim->rest.points, near + before.near++, i, id, 0.0);
            } else if (fate[i] == BULK) {
                put(gather, &sim->particles, bulk + before.bulk, i, first_id + before.bulk,
                    gather->request->birth);
                before.bulk++;
            }
        }
    }
}

bool rest_gather(SkiffSim *sim, const RestRequest *request, SkiffFill *fill, Err *err) {
    Gather gather = {.sim = sim, .request = request};
    RestCloud *cloud = &sim->rest;
    /* water that fits the walls has a true surface, no air over it */
    cloud->fits_walls = request->fitted != NULL;
    cloud->counted_below = request->fitted != NULL ? request->surface - sim->kernel.support : INFINITY;
    uint32_t laid = 0;
    if (!make_cells(&gather, err) || !lay_points(&gather, &laid, err))
        return false;
    if (!buffer_reserve(&cloud->tallies, "tallies of points", (laid / TALLY + 1) * sizeof(Tally), err))
        return false;
    const Tally all = decide(&gather, laid);
    cloud->points.count = cloud->standing.count = 0;
    fill->particles = all.bulk;
    if (all.near == 0 && all.bulk == 0)
        return true;
    const uint32_t existing = sim->particles.count;
    if (!particles_reserve(&cloud->points, all.near, err) ||
        !standing_reserve(&cloud->standing, all.near + existing, err) ||
        !buffer_reserve(&cloud->frozen, "frozen points", cloud->points.capacity + SLICE, err) ||
        !sim_reserve(sim, existing + all.bulk + all.water, err))
        return false;
    deal(&gather, laid, &all);
    if (all.near > 0 && existing > 0)
        add_existing(&gather, existing);
    return standing_sort(&cloud->standing, sim->kernel.support, err);
}
