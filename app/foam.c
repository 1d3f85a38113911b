/* Foam by the three signs of [Ihmsen2012, Unified spray, foam and air bubbles for particle-based fluids]:
 * water that tears apart traps air (relative velocity), fast crests do, and the air rises and bursts. What
 * differs: the relative velocity is the spread of velocities in a grid cell of the support radius, which
 * costs one pass in place of a neighbour search, and no new particles are made: the water's own carry an
 * amount that grows and decays. The growth is a + b * (1 - amount) law solved over the time between two
 * frames, so a film at 30 and at 60 frames a second shows the same foam.
 *
 * Particles change places in memory and come and go, so amounts are kept by id, in a table with open
 * addressing that is filled anew for each frame. Everything runs in the frame's order on one thread: equal
 * frames give equal foam. */
#include "foam.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const float spread_begin = 0.25f,
                   spread_full = 0.95f;                   /* m/s, of velocities in a cell, at Froude scale */
static const float crest_begin = 1.2f, crest_full = 3.5f; /* m/s, of a crest against the water at rest */
static const float growth = 6.0f;                         /* 1/s, where both signs are full */
static const float life_surface = 2.2f, life_deep = 0.5f; /* s, to 1/e */
static const float cell_full =
    10.0f; /* particles in a cell of the support radius at rest: (2 d)^3 / 0.8 d^3 */
enum { MAX_CELLS = 1 << 22 };

typedef struct Cell {
    float count;
    float velocity[3]; /* sum */
    float speed_sq;    /* sum */
} Cell;

typedef struct Entry {
    uint64_t key; /* id + 1; 0: free */
    float amount;
} Entry;

typedef struct Table {
    Entry *entries;
    size_t mask; /* size - 1, a power of two */
} Table;

typedef struct CellGrid {
    float min[3], inv_size;
    int size[3];
} CellGrid;

struct Foam {
    Table now, next;
    Cell *cells;
    size_t cell_capacity;
    double time;
    bool is_started;
};

Foam *foam_create(void) {
    return calloc(1, sizeof(Foam));
}

void foam_destroy(Foam *foam) {
    if (!foam)
        return;
    free(foam->now.entries);
    free(foam->next.entries);
    free(foam->cells);
    free(foam);
}

/* ---- Amounts by id ---- */

/* Neighbours in the water mostly have neighbouring ids: groups of 32 stay together, which halves the time. */
static size_t place_of(const Table *table, uint64_t key) {
    uint64_t group = (key >> 5) * 0x9E3779B97F4A7C15u >> 20;
    size_t place = (size_t)(group << 5 | (key & 31)) & table->mask;
    while (table->entries[place].key != 0 && table->entries[place].key != key)
        place = (place + 1) & table->mask;
    return place;
}

static float find_amount(const Table *table, uint64_t id) {
    return table->entries ? table->entries[place_of(table, id + 1)].amount : 0;
}

static bool empty_table(Table *table, uint32_t count) {
    size_t size = 1024;
    while (size < 2 * (size_t)count)
        size *= 2;
    if (!table->entries || size != table->mask + 1) {
        free(table->entries);
        table->entries = malloc(size * sizeof *table->entries);
        table->mask = size - 1;
    }
    if (table->entries)
        memset(table->entries, 0, size * sizeof *table->entries);
    return table->entries != NULL;
}

/* ---- Cells ---- */

static CellGrid fit_grid(const Frame *frame) {
    float max[3] = {-INFINITY, -INFINITY, -INFINITY};
    CellGrid grid = {.min = {INFINITY, INFINITY, INFINITY}};
    for (uint32_t i = 0; i < frame->live; i++)
        for (int k = 0; k < 3; k++) {
            grid.min[k] = fminf(grid.min[k], frame->position[i][k]);
            max[k] = fmaxf(max[k], frame->position[i][k]);
        }
    /* A few drops far away must not take all memory: cells grow until the grid fits. */
    for (float size = 2 * frame->spacing;; size *= 1.25f) {
        double cells = 1;
        grid.inv_size = 1 / size;
        for (int k = 0; k < 3; k++) {
            float extent = frame->live > 0 ? (max[k] - grid.min[k]) / size : 0;
            grid.size[k] = (int)fminf(extent, 1e6f) + 1;
            cells *= grid.size[k];
        }
        if (cells <= MAX_CELLS)
            return grid;
    }
}

static size_t cell_of(const CellGrid *grid, const float position[4], int up) {
    int at[3];
    for (int k = 0; k < 3; k++) {
        at[k] = (int)((position[k] - grid->min[k]) * grid->inv_size);
        at[k] = at[k] < 0 ? 0 : at[k] >= grid->size[k] ? grid->size[k] - 1 : at[k];
    }
    at[1] += up;
    if (at[1] >= grid->size[1])
        return SIZE_MAX;
    return ((size_t)at[2] * (size_t)grid->size[1] + (size_t)at[1]) * (size_t)grid->size[0] + (size_t)at[0];
}

static bool fill_cells(Foam *foam, const CellGrid *grid, const Frame *frame) {
    size_t count = (size_t)grid->size[0] * (size_t)grid->size[1] * (size_t)grid->size[2];
    if (count > foam->cell_capacity) {
        free(foam->cells);
        foam->cells = malloc(count * sizeof *foam->cells);
        foam->cell_capacity = foam->cells ? count : 0;
    }
    if (!foam->cells)
        return false;
    memset(foam->cells, 0, count * sizeof *foam->cells);
    for (uint32_t i = 0; i < frame->live; i++) {
        Cell *cell = &foam->cells[cell_of(grid, frame->position[i], 0)];
        const float *v = frame->velocity[i];
        cell->count += 1;
        for (int k = 0; k < 3; k++)
            cell->velocity[k] += v[k];
        cell->speed_sq += v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
    }
    return true;
}

/* ---- Signs ---- */

static float ramp(float begin, float full, float value) {
    float t = (value - begin) / (full - begin);
    t = fmaxf(0, fminf(1, t));
    return t * t * (3 - 2 * t);
}

/* Share of the two cells above that is filled with water, 0..1. */
static float cover(const Foam *foam, const CellGrid *grid, const float position[4]) {
    float filled = 0;
    for (int up = 1; up <= 2; up++) {
        size_t cell = cell_of(grid, position, up);
        filled += cell == SIZE_MAX ? 0 : fminf(1, foam->cells[cell].count / cell_full);
    }
    return 0.5f * filled;
}

static float update_one(float amount, float spread, float speed, float covered, float dt) {
    float open = 1 - covered;
    float sign = open * (ramp(spread_begin, spread_full, spread) +
                         0.5f * ramp(crest_begin, crest_full, speed) * ramp(0.4f, 0.9f, open));
    float gain = growth * fminf(1, sign);
    float loss = 1 / (life_deep + (life_surface - life_deep) * open);
    float goal = gain / (gain + loss);
    return goal + (amount - goal) * expf(-(gain + loss) * dt);
}

bool foam_update(Foam *foam, const Frame *frame, float *amount, Err *err) {
    CellGrid grid = fit_grid(frame);
    if (!fill_cells(foam, &grid, frame) || !empty_table(&foam->next, frame->count))
        return err_set(err, ERR_INPUT, "not enough memory for the foam of %u particles", frame->count);
    float dt = foam->is_started ? fmaxf(0, (float)(frame->time - foam->time)) : 0;
    for (uint32_t i = 0; i < frame->count; i++) {
        amount[i] = find_amount(&foam->now, frame->id[i]);
        if (i < frame->live) {
            const Cell *cell = &foam->cells[cell_of(&grid, frame->position[i], 0)];
            const float *v = frame->velocity[i];
            float mean_sq = 0;
            for (int k = 0; k < 3; k++)
                mean_sq += cell->velocity[k] * cell->velocity[k];
            mean_sq /= cell->count * cell->count;
            float spread = sqrtf(fmaxf(0, cell->speed_sq / cell->count - mean_sq));
            float speed = sqrtf(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
            amount[i] = update_one(amount[i], spread, speed, cover(foam, &grid, frame->position[i]), dt);
        }
        Entry *entry = &foam->next.entries[place_of(&foam->next, frame->id[i] + 1)];
        *entry = (Entry){frame->id[i] + 1, amount[i]};
    }
    Table old = foam->now;
    foam->now = foam->next;
    foam->next = old;
    foam->time = frame->time;
    foam->is_started = true;
    return true;
}

/* ---- Keeping it ---- */

double foam_time(const Foam *foam) {
    return foam->time;
}

uint32_t foam_count(const Foam *foam) {
    uint32_t count = 0;
    for (size_t i = 0; foam->now.entries && i <= foam->now.mask; i++)
        count += foam->now.entries[i].key != 0;
    return count;
}

void foam_store(const Foam *foam, uint64_t *id, float *amount) {
    size_t used = 0;
    for (size_t i = 0; foam->now.entries && i <= foam->now.mask; i++)
        if (foam->now.entries[i].key != 0) {
            id[used] = foam->now.entries[i].key - 1;
            amount[used++] = foam->now.entries[i].amount;
        }
}

bool foam_restore(Foam *foam, double time, uint64_t count, const uint64_t *id, const float *amount,
                  Err *err) {
    if (count > UINT32_MAX || !empty_table(&foam->now, (uint32_t)count))
        return err_set(err, ERR_INPUT, "not enough memory for the foam of %llu particles",
                       (unsigned long long)count);
    for (uint64_t i = 0; i < count; i++) {
        Entry *entry = &foam->now.entries[place_of(&foam->now, id[i] + 1)];
        bool is_good = entry->key == 0 && id[i] != UINT64_MAX && amount[i] >= 0 && amount[i] <= 1;
        if (!is_good && !empty_table(&foam->now, 0))
            return err_set(err, ERR_INPUT, "not enough memory for foam");
        if (!is_good)
            return err_set(err, ERR_INPUT, "foam of id %llu stands there twice or is out of range",
                           (unsigned long long)id[i]);
        *entry = (Entry){id[i] + 1, amount[i]};
    }
    foam->time = time;
    foam->is_started = count > 0;
    return true;
}
