/* The surface is made from the tile: cut, its upper part settles (rest_settle_column) over the rest of it. A
 * column is that surface with the tile below, which is at rest as it comes. */
#include "water.h"
#include "sim.h"

#include <math.h>
#include <stdlib.h>

/* ---- Making ---- */

typedef struct Column {
    TileBox box;
    uint32_t count;
    float (*position)[3];
    uint32_t *source;
} Column;

static bool lay_column(SkiffSim *sim, double period, float depth, Column *column, Err *err) {
    uint64_t count;
    column->box = (TileBox){.radius = (double)sim->params.particle_radius,
                            .min = {0.0, -(double)depth, 0.0},
                            .max = {period, 0.0, period}};
    if (!tile_count_box(&sim->tile, &column->box, &count, err))
        return false;
    if (count > 100000000u)
        return err_set(err, ERR_INPUT, "a column of %.4g m of water takes %.4g particles", (double)depth,
                       (double)count);
    if (!buffer_reserve(&sim->rest.laid, "points to fill", (size_t)count * sizeof(float[3]), err) ||
        !buffer_reserve(&sim->rest.source, "sources of points", (size_t)count * sizeof(uint32_t), err))
        return false;
    column->count = (uint32_t)count;
    column->position = sim->rest.laid.data;
    column->source = sim->rest.source.data;
    tile_fill_box(&sim->tile, &column->box, (const double[3]){0}, column->position, column->source);
    return true;
}

/* P of still water, of a depth of a radius at least. */
static float still_pressure(const SkiffSim *sim, float y) {
    const float dt = sim->params.time_step;
    return sim->params.gravity[1] * fminf(y, -sim->params.particle_radius) * dt * dt;
}

static bool list_reserve(WaterList *list, uint32_t capacity, Err *err) {
    if (capacity <= list->capacity)
        return true;
    if (!buffer_reserve(&list->position, "water at rest", capacity * sizeof(Float4), err) ||
        !buffer_reserve(&list->pressure, "pressure of water at rest", capacity * sizeof(float[2]), err))
        return false;
    list->capacity = capacity;
    list->water.position = list->position.data;
    list->water.pressure = list->pressure.data;
    return true;
}

static bool list_add(WaterList *list, const float position[3], const float pressure[2], Err *err) {
    RestFitted *water = &list->water;
    if (water->count == list->capacity && !list_reserve(list, 4096 + 2 * list->capacity, err))
        return false;
    memcpy(water->position[water->count], position, 3 * sizeof(float));
    water->position[water->count][3] = 0.0f;
    memcpy(water->pressure[water->count++], pressure, sizeof(float[2]));
    return true;
}

static uint32_t cell_of(const StillWater *water, const float p[3]) {
    int32_t c[3];
    for (int k = 0; k < 3; k++) {
        const int32_t last = (k == 1 ? water->layers : water->across) - 1;
        const float from = k == 1 ? water->top - p[1] : p[k];
        c[k] = (int32_t)floorf(from / water->cell);
        c[k] = c[k] < 0 ? 0 : c[k] > last ? last : c[k];
    }
    return (uint32_t)((c[0] * water->across + c[2]) * water->layers + c[1]);
}

static bool sort_column(StillWater *water, const WaterList *list, Err *err) {
    const size_t cells = (size_t)water->across * (size_t)water->across * (size_t)water->layers;
    const uint32_t n = list->water.count;
    if (!buffer_reserve(&water->position, "column of water", n * sizeof(Float4), err) ||
        !buffer_reserve(&water->pressure, "pressure of the column", n * sizeof(float[2]), err) ||
        !buffer_reserve(&water->start_buffer, "cells of the column", (cells + 1) * sizeof(uint32_t), err))
        return false;
    uint32_t *cell = malloc(2 * (size_t)n * sizeof *cell);
    if (cell == NULL)
        return err_set(err, ERR_INPUT, "no memory to sort a column of %u particles", n);
    for (uint32_t i = 0; i < n; i++)
        cell[i] = cell_of(water, list->water.position[i]);
    uint32_t *order = cell + n;
    water->start = water->start_buffer.data;
    cell_grid_sort(cell, n, cells, water->start, order);
    water->column = (RestFitted){n, water->position.data, water->pressure.data};
    for (uint32_t to = 0; to < n; to++) {
        memcpy(water->column.position[to], list->water.position[order[to]], sizeof(Float4));
        memcpy(water->column.pressure[to], list->water.pressure[order[to]], sizeof(float[2]));
    }
    free(cell);
    return true;
}

/* y of a surface's floor: a radius below what settles, so that nobody sinks through it. */
static float surface_floor(const SkiffSim *sim) {
    return -WATER_SETTLED * sim->kernel.support - sim->params.particle_radius;
}

/* The tile below, the surface above. */
static bool list_column(const SkiffSim *sim, const Column *column, const RestTile *surface, WaterList *list,
                        Err *err) {
    const float r = sim->params.particle_radius, bottom = -WATER_SETTLED * sim->kernel.support;
    const float floor = surface_floor(sim);
    for (uint32_t i = 0; i < column->count; i++) {
        const float *p = column->position[i];
        const float pressure[2] = {still_pressure(sim, p[1]) * sim->tile.share[column->source[i]], 0.0f};
        if (p[1] < bottom && !list_add(list, p, pressure, err))
            return false;
    }
    for (uint32_t i = 0; i < surface->count; i++) {
        const float p[3] = {r * surface->position[i][0], floor + r * surface->position[i][1],
                            r * surface->position[i][2]};
        const float pressure[2] = {still_pressure(sim, p[1]) * surface->share[i], 0.0f};
        if (!list_add(list, p, pressure, err))
            return false;
    }
    return true;
}

bool water_make(StillWater *water, SkiffSim *sim, float depth, Err *err) {
    const float support = sim->kernel.support;
    Column column;
    WaterList list = {0};
    RestTile surface;
    if (!tile_load_surface(&surface, err))
        return false;
    water->period = (double)sim->tile.size[0] * (double)sim->params.particle_radius;
    water->across = (int32_t)floor(water->period / (double)support);
    water->cell = (float)(water->period / water->across);
    water->top = support;
    depth = fmaxf(depth, WATER_SETTLED * support) + support;
    water->layers = (int32_t)ceilf((depth + water->top) / water->cell);
    const bool good = lay_column(sim, water->period, depth, &column, err) &&
                      list_column(sim, &column, &surface, &list, err) && sort_column(water, &list, err);
    tile_free(&surface);
    water_list_free(&list);
    return good;
}

/* ---- The surface ---- */

/* What settles, over a support of the tile that stands still. */
static bool place_surface(SkiffSim *sim, const Column *column, Err *err) {
    const float bottom = -WATER_SETTLED * sim->kernel.support;
    if (!sim_reserve(sim, column->count, err))
        return false;
    for (uint32_t i = 0; i < column->count; i++) {
        const float *p = column->position[i];
        const uint32_t to = particles_append(&sim->particles, p, (const float[3]){0}, 0.0);
        sim->particles.pressure[to] = still_pressure(sim, p[1]) * sim->tile.share[column->source[i]];
        sim->particles.edge[to] = p[1] < bottom ? EDGE_LAID : EDGE_NONE;
    }
    return true;
}

static bool take_surface(const SkiffSim *sim, double period, RestTile *surface, Err *err) {
    const Particles *particles = &sim->particles;
    const float r = sim->params.particle_radius, floor = surface_floor(sim);
    if (!tile_init(surface, particles->count, err))
        return false;
    surface->volume_factor = sim->tile.volume_factor;
    surface->size[0] = surface->size[2] = (float)(period / (double)r);
    surface->size[1] = (sim->kernel.support - floor) / r;
    surface->count = 0;
    for (uint32_t i = 0; i < particles->count; i++) {
        const float *p = particles->position[i];
        if (particles->edge[i] != EDGE_NONE)
            continue;
        float *to = surface->position[surface->count];
        for (int k = 0; k < 3; k++)
            to[k] = fminf((k == 1 ? p[1] - floor : p[k]) / r, nextafterf(surface->size[k], 0.0f));
        surface->share[surface->count++] = particles->pressure[i] / still_pressure(sim, p[1]);
    }
    return true;
}

bool water_make_surface(SkiffSim *sim, RestTile *surface, Err *err) {
    const double period = (double)sim->tile.size[0] * (double)sim->params.particle_radius;
    Column column;
    SkiffFill fill = {0};
    *surface = (RestTile){0};
    const bool good = lay_column(sim, period, (WATER_SETTLED + 1) * sim->kernel.support, &column, err) &&
                      place_surface(sim, &column, err) && rest_settle_column(sim, period, &fill, err) &&
                      take_surface(sim, period, surface, err);
    sim->particles.count = 0;
    sim->particles.next_id = 0;
    return good;
}

/* ---- Looking ---- */

/* Squares of the world, as wide as cells: a row runs along z. */
typedef struct Squares {
    const StillWater *water;
    const WaterPlace *place;
    RestFitted *list;
    int64_t first[2], last[2]; /* x, z */
} Squares;

/* The cells over a square. */
typedef struct Stack {
    uint32_t cell;    /* the uppermost; the others follow */
    double corner[2]; /* where this copy of the column begins, m */
    float middle[2];  /* m */
} Stack;

static Stack stack_over(const Squares *squares, const int64_t square[2]) {
    const StillWater *water = squares->water;
    Stack stack;
    int32_t c[2];
    for (int k = 0; k < 2; k++) {
        const int64_t turn = (int64_t)floor((double)square[k] / water->across);
        c[k] = (int32_t)(square[k] - turn * water->across);
        stack.corner[k] = (double)turn * water->period - squares->place->origin[2 * k];
        stack.middle[k] = (float)(stack.corner[k] + ((double)c[k] + 0.5) * (double)water->cell);
    }
    stack.cell = (uint32_t)((c[0] * water->across + c[1]) * water->layers);
    return stack;
}

/* Particles over row x: no fewer than can be wanted of it. */
static uint32_t row_size(const Squares *squares, int64_t x) {
    const StillWater *water = squares->water;
    uint32_t size = 0;
    for (int64_t z = squares->first[1]; z <= squares->last[1]; z++) {
        const uint32_t cell = stack_over(squares, (const int64_t[2]){x, z}).cell;
        size += water->start[cell + (uint32_t)water->layers] - water->start[cell];
    }
    return size;
}

static uint32_t add_cell(const Squares *squares, const double corner[2], uint32_t cell, uint32_t to) {
    const StillWater *water = squares->water;
    const WaterPlace *place = squares->place;
    for (uint32_t i = water->start[cell]; i < water->start[cell + 1]; i++) {
        const float *at = water->column.position[i];
        const Float4 p = {(float)(corner[0] + (double)at[0]), place->surface + at[1],
                          (float)(corner[1] + (double)at[2]), 0.0f};
        if (place->outside(place->user, p) > 0.0f)
            continue;
        memcpy(squares->list->position[to], p, sizeof p);
        memcpy(squares->list->pressure[to++], water->column.pressure[i], sizeof(float[2]));
    }
    return to;
}

/* All cells over one square of the world. */
static uint32_t add_square(const Squares *squares, const int64_t square[2], uint32_t to) {
    const StillWater *water = squares->water;
    const WaterPlace *place = squares->place;
    /* a little more than half the diagonal: points lie in their cells but for rounding */
    const float reach = 0.87f * water->cell;
    const Stack stack = stack_over(squares, square);
    float centre[3] = {stack.middle[0], 0.0f, stack.middle[1]};
    for (int32_t layer = 0; layer < water->layers; layer++) {
        centre[1] = place->surface + water->top - ((float)layer + 0.5f) * water->cell;
        if (centre[1] + 0.5f * water->cell < place->bounds.min[1])
            break;
        const uint32_t cell = stack.cell + (uint32_t)layer;
        if (water->start[cell] < water->start[cell + 1] && place->outside(place->user, centre) <= reach)
            to = add_cell(squares, stack.corner, cell, to);
    }
    return to;
}

/* Every row writes where it has room in any case, then the rows move together: one order for any number of
 * threads, and no point is looked at twice. */
bool water_gather(const StillWater *water, const WaterPlace *place, WaterList *list, int threads, Err *err) {
    enum { MAX_ROWS = 4096 };
    Squares squares = {water, place, &list->water, {0}, {0}};
    for (int k = 0; k < 2; k++) {
        const double cell = (double)water->cell, origin = place->origin[2 * k];
        squares.first[k] = (int64_t)floor(((double)place->bounds.min[2 * k] + origin) / cell);
        squares.last[k] = (int64_t)floor(((double)place->bounds.max[2 * k] + origin) / cell);
    }
    const int64_t rows = squares.last[0] - squares.first[0] + 1;
    uint32_t begin[MAX_ROWS + 1], end[MAX_ROWS];
    if (rows > MAX_ROWS)
        return err_set(err, ERR_INPUT, "the window spans more than %d cells of %g m", MAX_ROWS,
                       (double)water->cell);
    begin[0] = 0;
    for (int64_t row = 0; row < rows; row++)
        begin[row + 1] = begin[row] + row_size(&squares, squares.first[0] + row);
    /* the rows' sizes change a little from place to place */
    if (!list_reserve(list, begin[rows] + begin[rows] / 8, err))
        return false;
#pragma omp parallel for schedule(dynamic, 1) num_threads(threads)
    for (int64_t row = 0; row < rows; row++) {
        int64_t square[2] = {squares.first[0] + row, squares.first[1]};
        end[row] = begin[row];
        for (; square[1] <= squares.last[1]; square[1]++)
            end[row] = add_square(&squares, square, end[row]);
    }
    list->water.count = 0;
    for (int64_t row = 0; row < rows; row++) {
        const uint32_t to = list->water.count, count = end[row] - begin[row];
        memmove(list->water.position[to], list->water.position[begin[row]], count * sizeof(Float4));
        memmove(list->water.pressure[to], list->water.pressure[begin[row]], count * sizeof(float[2]));
        list->water.count += count;
    }
    return true;
}

void water_free(StillWater *water) {
    buffer_free(&water->position);
    buffer_free(&water->pressure);
    buffer_free(&water->start_buffer);
    *water = (StillWater){0};
}

void water_list_free(WaterList *list) {
    buffer_free(&list->position);
    buffer_free(&list->pressure);
    *list = (WaterList){0};
}
