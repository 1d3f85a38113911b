/* Where particles give way to still water.
 *
 * The window jumps, by decimetres: drawn at its own edge, the seam would jump along. What is drawn is a
 * smaller window that stays with the followed body. That body is never farther from the middle than the
 * distance at which the window moves, so the smaller one, by that distance and by what a move replaces at the
 * old edge, lies inside the particles before each move and after it, and holds nothing that a move adds or
 * removes. */
#include "ocean.h"

#include <math.h>
#include <string.h>

static const float band_from = 0.15f; /* of the fade's width: where the particles begin to count */

static int find_followed(const SkiffDef *def) {
    for (int i = 0; def->sea.follow && i < def->body_count; i++)
        if (strcmp(def->bodies[i].name, def->sea.follow) == 0)
            return i;
    return -1;
}

bool ocean_make(Ocean *ocean, const SkiffDef *def, const SkiffSim *sim, const Frame *frame, Err *err) {
    const SkiffParams *params = skiff_params(sim);
    *ocean = (Ocean){.follow = find_followed(def)};
    float support = 4 * params->particle_radius;
    if (ocean->follow >= 0)
        ocean->reach = params->window_trigger * support + params->window_old * params->particle_radius;
    if (!edge_map_make(&ocean->window, sim, frame, err))
        return false;
    return !ocean->window.distance || wake_make(&ocean->wake, frame->spacing, err);
}

void ocean_free(Ocean *ocean) {
    edge_map_free(&ocean->window);
    wake_free(&ocean->wake);
}

/* Distances (m) from the drawn window's edge between which particles give way. */
static void find_band(const Ocean *ocean, const SceneRender *render, const Frame *frame, float band[2]) {
    if (!render->fade) { /* the window as it is */
        band[0] = 0;
        band[1] = 0.01f * frame->spacing;
        return;
    }
    band[0] = ocean->reach + band_from * render->fade_edge;
    band[1] = ocean->reach + render->fade_edge;
}

void ocean_update(Ocean *ocean, const SceneRender *render, const Frame *frame, const float *foam) {
    if (!ocean->window.distance)
        return;
    float band[2];
    find_band(ocean, render, frame, band);
    for (int k = 0; k < 2; k++)
        ocean->shift[k] =
            render->fade && ocean->follow >= 0
                ? (float)(frame->bodies[ocean->follow].position[2 * k] - frame->window_centre[2 * k])
                : 0;
    wake_update(&ocean->wake, frame, foam, &ocean->window, ocean->shift, band[0]);
}

GfxOcean ocean_picture(const Ocean *ocean, const SceneRender *render, const Frame *frame) {
    const EdgeMap *window = &ocean->window;
    const Wake *wake = &ocean->wake;
    GfxOcean picture = gfx_scene_default().ocean;
    picture.enabled = true;
    picture.ripples = render->ripples;
    picture.level = (float)(frame->level - frame->origin[1]);
    picture.edge_distance = window->distance;
    find_band(ocean, render, frame, picture.blend);
    picture.foam = wake->amount;
    for (int k = 0; k < 2; k++) {
        picture.edge_size[k] = window->size[k];
        picture.edge_min[k] = window->min[k] + ocean->shift[k];
        picture.edge_max[k] = window->max[k] + ocean->shift[k];
        picture.foam_size[k] = WAKE_EDGE;
        picture.foam_min[k] = (float)(wake->base[k] * (double)wake->cell - frame->origin[2 * k]);
        picture.foam_max[k] = picture.foam_min[k] + (WAKE_EDGE - 1) * wake->cell;
    }
    return picture;
}
