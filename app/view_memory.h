/* What the next frames depend on beside the simulation, in a file: foam, wake and the state of the cameras.
 */
#ifndef SKIFF_APP_VIEW_MEMORY_H
#define SKIFF_APP_VIEW_MEMORY_H

#include "foam.h"
#include "wake.h"

typedef struct ViewMemory {
    double time;    /* s, of the simulation */
    int camera;     /* the one that is looked through */
    double *states; /* of the cameras; memory of the caller */
    uint64_t state_count;
    Foam *foam;
    Wake *wake; /* made, or without amounts where there is no ocean */
} ViewMemory;

/* Writes atomically. ERR_IO. */
bool view_memory_save(const ViewMemory *memory, const char *path, Err *err);

/* Fills in camera, states, foam and wake of a memory with the same time and number of states. ERR_INPUT when
 * the file is missing, damaged or of another time; all are then unchanged, unless the foam's own part is at
 * fault, which leaves it clear. */
bool view_memory_load(ViewMemory *memory, const char *path, Err *err);

#endif
