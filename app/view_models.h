/* The bodies and the tank as things to draw. */
#ifndef SKIFF_APP_VIEW_MODELS_H
#define SKIFF_APP_VIEW_MODELS_H

#include "view_subject.h"

#include "render/gfx.h"

/* Zero-initialise, view_models_make, view_models_free. */
typedef struct Models {
    GfxInstance *instances; /* bodies, then the tank */
    uint32_t count;
    bool has_tank; /* it is drawn */
} Models;

/* Hands all meshes to the renderer. `level`: of the water, world y, m. ERR_INPUT: the scene gives a material
 * to a body that is not there, or memory is exhausted. view_models_free in any case. */
bool view_models_make(Models *models, const Subject *subject, Gfx *gfx, double level, Err *err);
void view_models_free(Models *models);

/* Puts the bodies where the frame has them. */
void view_models_place(Models *models, const Frame *frame);

#endif
