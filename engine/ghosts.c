/* A queue of particles that were taken out, oldest first. */
#include "ghosts.h"

#include <assert.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

enum { GHOST_BYTES = 2 * sizeof(Float4) + sizeof(uint64_t) + 2 * sizeof(double) };

static void bind(Ghosts *ghosts) {
    const size_t n = ghosts->capacity;
    ghosts->position = ghosts->buffer.data;
    ghosts->velocity = ghosts->position + n;
    ghosts->id = (uint64_t *)(ghosts->velocity + n);
    ghosts->birth = (double *)(ghosts->id + n);
    ghosts->removed = ghosts->birth + n;
}

/* Moves the queue to the front of its memory. */
static void compact(Ghosts *ghosts) {
    const uint32_t first = ghosts->first, n = ghosts->count;
    memmove(ghosts->position, ghosts->position + first, n * sizeof *ghosts->position);
    memmove(ghosts->velocity, ghosts->velocity + first, n * sizeof *ghosts->velocity);
    memmove(ghosts->id, ghosts->id + first, n * sizeof *ghosts->id);
    memmove(ghosts->birth, ghosts->birth + first, n * sizeof *ghosts->birth);
    memmove(ghosts->removed, ghosts->removed + first, n * sizeof *ghosts->removed);
    ghosts->first = 0;
}

bool ghosts_reserve(Ghosts *ghosts, uint32_t more, double time, Err *err) {
    while (ghosts->count > 0 && ghosts->removed[ghosts->first] < time - GHOST_LIFE) {
        ghosts->first++;
        ghosts->count--;
    }
    if (ghosts->first + (uint64_t)ghosts->count + more <= ghosts->capacity)
        return true;
    if (ghosts->count > 0)
        compact(ghosts);
    ghosts->first = 0;
    if (ghosts->count + (uint64_t)more <= ghosts->capacity)
        return true;
    /* the arrays lie one behind the other: growing means copying them one by one, the last first */
    const uint32_t old = ghosts->capacity, capacity = 2 * (ghosts->count + more);
    if (!buffer_reserve(&ghosts->buffer, "removed particles", (size_t)capacity * GHOST_BYTES, err))
        return false;
    Ghosts before = *ghosts;
    before.capacity = old;
    bind(&before);
    ghosts->capacity = capacity;
    bind(ghosts);
    memmove(ghosts->removed, before.removed, ghosts->count * sizeof *ghosts->removed);
    memmove(ghosts->birth, before.birth, ghosts->count * sizeof *ghosts->birth);
    memmove(ghosts->id, before.id, ghosts->count * sizeof *ghosts->id);
    memmove(ghosts->velocity, before.velocity, ghosts->count * sizeof *ghosts->velocity);
    return true;
}

void ghosts_add(Ghosts *ghosts, const Particles *particles, uint32_t i, double time) {
    assert(ghosts->first + ghosts->count < ghosts->capacity);
    const uint32_t to = ghosts->first + ghosts->count++;
    memcpy(ghosts->position[to], particles->position[i], sizeof(Float4));
    memcpy(ghosts->velocity[to], particles->velocity[i], sizeof(Float4));
    ghosts->id[to] = particles->id[i];
    ghosts->birth[to] = particles->birth[i];
    ghosts->removed[to] = time;
}

void ghosts_shift(Ghosts *ghosts, const float shift[3]) {
    for (uint32_t g = ghosts->first; g < ghosts->first + ghosts->count; g++)
        for (int k = 0; k < 3; k++)
            ghosts->position[g][k] -= shift[k];
}

/* ---- Keeping them ---- */

static const struct {
    const char *name;
    StateType type;
    uint32_t components;
} field_types[GHOST_FIELDS] = {{"ghost_position", STATE_F32, 4},
                               {"ghost_velocity", STATE_F32, 4},
                               {"ghost_id", STATE_U64, 1},
                               {"ghost_birth", STATE_F64, 1},
                               {"ghost_removed", STATE_F64, 1}};

void ghosts_describe(const Ghosts *ghosts, StateField fields[GHOST_FIELDS]) {
    const uint32_t first = ghosts->first;
    const bool some = ghosts->count > 0;
    const void *data[GHOST_FIELDS] = {some ? ghosts->position + first : NULL,
                                      some ? ghosts->velocity + first : NULL,
                                      some ? ghosts->id + first : NULL, some ? ghosts->birth + first : NULL,
                                      some ? ghosts->removed + first : NULL};
    for (int f = 0; f < GHOST_FIELDS; f++) {
        fields[f] = (StateField){.type = field_types[f].type,
                                 .components = field_types[f].components,
                                 .count = ghosts->count,
                                 .data = data[f]};
        snprintf(fields[f].name, sizeof fields[f].name, "%s", field_types[f].name);
    }
}

/* In the order of their going. */
static bool times_are_good(const double *birth, const double *removed, uint64_t count) {
    for (uint64_t i = 0; i < count; i++)
        if (!isfinite(birth[i]) || !isfinite(removed[i]) || (i > 0 && removed[i] < removed[i - 1]))
            return false;
    return true;
}

static bool all_finite(const float *values, uint64_t count) {
    for (uint64_t i = 0; i < count; i++)
        if (!isfinite(values[i]))
            return false;
    return true;
}

bool ghosts_load(Ghosts *ghosts, const StateFile *file, const char *path, Err *err) {
    const StateField *fields[GHOST_FIELDS];
    uint64_t count = UINT64_MAX;
    for (int f = 0; f < GHOST_FIELDS; f++) {
        fields[f] = state_file_field(file, field_types[f].name, field_types[f].type,
                                     field_types[f].components, count, err);
        if (fields[f] == NULL)
            return false;
        count = fields[f]->count;
    }
    if (count > UINT32_MAX / 4 || !all_finite(fields[0]->data, 4 * count) ||
        !all_finite(fields[1]->data, 4 * count) || !times_are_good(fields[3]->data, fields[4]->data, count))
        return err_set(err, ERR_INPUT, "%s: what is said of removed particles is out of range", path);
    Ghosts loaded = {0};
    if (!ghosts_reserve(&loaded, (uint32_t)count, 0, err))
        return false;
    if (count > 0) {
        memcpy(loaded.position, fields[0]->data, count * sizeof *loaded.position);
        memcpy(loaded.velocity, fields[1]->data, count * sizeof *loaded.velocity);
        memcpy(loaded.id, fields[2]->data, count * sizeof *loaded.id);
        memcpy(loaded.birth, fields[3]->data, count * sizeof *loaded.birth);
        memcpy(loaded.removed, fields[4]->data, count * sizeof *loaded.removed);
    }
    loaded.count = (uint32_t)count;
    ghosts_free(ghosts);
    *ghosts = loaded;
    return true;
}

void ghosts_free(Ghosts *ghosts) {
    buffer_free(&ghosts->buffer);
    *ghosts = (Ghosts){0};
}
