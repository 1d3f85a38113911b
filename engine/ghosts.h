/* Particles that were taken out lately: pictures let them fade instead of vanish. No step depends on them,
 * but the frames after a resumption do: state files hold them. */
#ifndef SKIFF_GHOSTS_H
#define SKIFF_GHOSTS_H

#include "particles.h"

#include "base/state_file.h"

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
/* As fields of a state file, in memory of the ghosts. */
enum { GHOST_FIELDS = 5 };
void ghosts_describe(const Ghosts *ghosts, StateField fields[GHOST_FIELDS]);
/* Replaces them by the file's. ERR_INPUT, and nothing is changed, where it holds none or a number is not one.
 */
bool ghosts_load(Ghosts *ghosts, const StateFile *file, const char *path, Err *err);
void ghosts_free(Ghosts *ghosts);

#endif
