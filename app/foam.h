/* White water: how much air each particle carries, guessed from the motion of the water around it. */
#ifndef SKIFF_APP_FOAM_H
#define SKIFF_APP_FOAM_H

#include "frames.h"

typedef struct Foam Foam;

/* NULL when memory is exhausted. */
Foam *foam_create(void);
void foam_destroy(Foam *foam); /* NULL is fine */

/* Moves the foam on to the frame's time. `amount` receives frame->count values, 0 (clear) .. 1 (white). The
 * first frame and particles never seen before begin clear. The result depends on the frames seen and on
 * nothing else. ERR_INPUT when memory is exhausted. */
bool foam_update(Foam *foam, const Frame *frame, float *amount, Err *err);

/* Keeping it in a file: the time of the last frame (s), and `foam_count` amounts with their ids. */
double foam_time(const Foam *foam);
uint32_t foam_count(const Foam *foam);
void foam_store(const Foam *foam, uint64_t *id, float *amount);
/* Replaces what is there. ERR_INPUT, and all is clear, when memory is exhausted, an id stands there twice or
 * an amount is not from 0 to 1. */
bool foam_restore(Foam *foam, double time, uint64_t count, const uint64_t *id, const float *amount, Err *err);

#endif
