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

#endif
