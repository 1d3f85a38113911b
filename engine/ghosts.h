/* Particles that were taken out lately: pictures let them fade instead of vanish. No part of the state. */
#ifndef SKIFF_GHOSTS_H
#define SKIFF_GHOSTS_H

#include "particles.h"

typedef struct Ghosts {
    uint32_t first, count, capacity; /* [first, first + count), in the order of their going */
    Float4 *position, *velocity;     /* window-local; the velocity when they went */
    uint64_t *id;
    double *birth, *removed; /* s */
    Buffer buffer;
} Ghosts;

/* How long they are kept, s. */
static const double GHOST_LIFE = 0.5;

/* Room for `more`; forgets what is too old at `time`. */
bool ghosts_reserve(Ghosts *ghosts, uint32_t more, double time, Err *err);
/* Remembers particle i; there must be room. */
void ghosts_add(Ghosts *ghosts, const Particles *particles, uint32_t i, double time);
/* The window moves by `shift`, m. */
void ghosts_shift(Ghosts *ghosts, const float shift[3]);
void ghosts_free(Ghosts *ghosts);

#endif
