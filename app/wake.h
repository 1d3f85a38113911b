/* White water that the window has left behind: a map of it, fixed in the world. */
#ifndef SKIFF_APP_WAKE_H
#define SKIFF_APP_WAKE_H

#include "edge_map.h"

enum { WAKE_EDGE = 256 }; /* cells */

/* Zero-initialise, wake_make, wake_free. */
typedef struct Wake {
    float *
        amount; /* WAKE_EDGE^2 values, x fastest: foam of the particles at the surface, per spacing squared */
    float *deposit; /* the same, of one frame */
    float cell;     /* m */
    double base[2]; /* cell numbers (x, z) of the first cell in the world: its middle is at base * cell */
    double time;    /* s, of the last frame */
    bool is_started;
} Wake;

/* ERR_INPUT when memory is exhausted. */
bool wake_make(Wake *wake, float spacing, Err *err);
void wake_free(Wake *wake);

/* Number of amounts; 0: it was not made. */
uint64_t wake_count(const Wake *wake);

/* Moves the map on to the frame's time: inside the window (deeper than `margin` m, the map shifted by `shift`
 * m in x, z) it follows the particles, elsewhere it dies away. `foam`: frame->count amounts, foam_update. The
 * result depends on the frames seen and on nothing else. */
void wake_update(Wake *wake, const Frame *frame, const float *foam, const EdgeMap *window,
                 const float shift[2], float margin);

#endif
