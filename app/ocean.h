/* The still water around the window of particles: where one gives way to the other, and the wake on it. */
#ifndef SKIFF_APP_OCEAN_H
#define SKIFF_APP_OCEAN_H

#include "scene_table.h"
#include "wake.h"

/* Zero-initialise, ocean_make, ocean_free. */
typedef struct Ocean {
    EdgeMap window; /* no distances: there is no window, and no ocean */
    Wake wake;
    int follow;  /* the body that the window follows; -1: none */
    float reach; /* m: how far from the window's middle that body gets before the window moves, and new water
                    takes the place of old */
    float shift[2]; /* m, x and z: from the window's middle to that body */
    float band[2];  /* m from the edge of the window shifted by that: particles count for nothing nearer to it
                       than [0], alone beyond [1] */
} Ocean;

/* `frame` is the first one. ERR_INPUT when memory is exhausted. */
bool ocean_make(Ocean *ocean, const SkiffDef *def, const SkiffSim *sim, const Frame *frame, Err *err);
void ocean_free(Ocean *ocean);

/* On to the frame's time. `foam`: frame->count amounts, foam_update. */
void ocean_update(Ocean *ocean, const SceneRender *render, const Frame *frame, const float *foam);

#endif
