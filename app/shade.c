/* Fade and fields.
 *
 * A particle is created ahead of the boat at rest, and removed behind it, out of any viewer's sight of cause:
 * without help it pops. Here it appears over fade_in seconds from its birth, vanishes over fade_out seconds
 * from its removal (the engine keeps it so long, and it moves on), and in the look "particles" also towards
 * the window's edge. In the look "water" the edge belongs to the renderer, which gives way to the ocean. */
#include "shade.h"

#include <math.h>

enum { LOOK_PARTICLES = 1 }; /* in RENDER_LOOKS */

static float smooth(float value) {
    float t = fmaxf(0, fminf(1, value));
    return t * t * (3 - 2 * t);
}

static float fade_of(const SceneRender *render, const Frame *frame, double start, uint32_t i) {
    float age = (float)(frame->time - frame->birth[i]);
    bool is_new = frame->birth[i] > start + frame_time_tolerance;
    if (is_new && age < 0)
        return 0; /* comes at the end of this step */
    if (!render->fade)
        return i < frame->live ? 1 : 0;
    float fade = is_new ? smooth(age / render->fade_in) : 1;
    if (i >= frame->live)
        fade *= 1 - smooth(frame->gone[i] / render->fade_out);
    if (frame->has_window && render->look == LOOK_PARTICLES)
        fade *= smooth(-frame->edge[i] / render->fade_edge);
    return fade;
}

void shade_fade(const SceneRender *render, const Frame *frame, double start, float *fade) {
    for (uint32_t i = 0; i < frame->count; i++)
        fade[i] = fade_of(render, frame, start, i);
}

static float field_of(RenderField field, const Frame *frame, uint32_t i) {
    const float *v = frame->velocity[i];
    switch (field) {
    case RENDER_SPEED:
        return sqrtf(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    case RENDER_DENSITY:
        return frame->density[i];
    case RENDER_PRESSURE:
        return 0.001f * frame->pressure[i]; /* kPa: short numbers in the legend */
    case RENDER_AGE:
        return (float)(frame->time - frame->birth[i]);
    case RENDER_WINDOW:
        return frame->has_window ? -frame->edge[i] : 0;
    case RENDER_FIELD_COUNT:
        break;
    }
    return 0;
}

bool shade_needs_pressure(const SceneRender *render) {
    return render->look == LOOK_PARTICLES && render->field == RENDER_PRESSURE;
}

void shade_field(RenderField field, const Frame *frame, float *values) {
    for (uint32_t i = 0; i < frame->count; i++)
        values[i] = field_of(field, frame, i);
}

ShadeLegend shade_legend(const SceneRender *render) {
    static const ShadeLegend legends[RENDER_FIELD_COUNT] = {
        [RENDER_SPEED] = {0, 3, "speed", "m/s"},
        [RENDER_DENSITY] = {0.9f, 1.05f, "density / rest density", ""},
        [RENDER_PRESSURE] = {0, 10, "pressure", "kPa"},
        [RENDER_AGE] = {0, 5, "age", "s"},
        [RENDER_WINDOW] = {0, 1, "distance from the edge", "m"},
    };
    ShadeLegend legend = legends[render->field];
    float span = legend.max - legend.min;
    /* With one end given beyond the other's default, the span is kept. */
    if (!isnan(render->field_min))
        legend.min = render->field_min;
    if (!isnan(render->field_max))
        legend.max = render->field_max;
    if (!(legend.min < legend.max) && isnan(render->field_min))
        legend.min = legend.max - span;
    else if (!(legend.min < legend.max))
        legend.max = legend.min + span;
    return legend;
}
