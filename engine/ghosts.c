/* A queue of particles that were taken out, oldest first. */
#include "ghosts.h"

#include <assert.h>
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

void ghosts_free(Ghosts *ghosts) {
    buffer_free(&ghosts->buffer);
    *ghosts = (Ghosts){0};
}
