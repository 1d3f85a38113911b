/* What each particle of a frame shows: how much of it is there, and the field that colours it. */
#ifndef SKIFF_APP_SHADE_H
#define SKIFF_APP_SHADE_H

#include "frames.h"
#include "scene_table.h"

/* frame->count values from 0 (not there) to 1. `start`: time of the first state (s); what existed then does
 * not fade in. */
void shade_fade(const SceneRender *render, const Frame *frame, double start, float *fade);

/* frame->count values in the unit of the legend. */
void shade_field(RenderField field, const Frame *frame, float *values);

/* Does shade_field of what is drawn read the pressures? */
bool shade_needs_pressure(const SceneRender *render);

typedef struct ShadeLegend {
    float min, max; /* min < max */
    const char *title, *unit;
} ShadeLegend;

ShadeLegend shade_legend(const SceneRender *render);

#endif
