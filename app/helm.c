/* Rules of the helm:
 * - Keys of one direction do not add up, keys of opposite directions cancel, and while any key of the
 * throttle or of the rudder is held it counts in place of what a command has set.
 * - The last one to steer wins: `rudder` or a rudder key ends the holding of a heading, `heading` puts the
 *   rudder amidships and holds. */
#include "helm.h"

#include "engine/base/angle.h"

#include <string.h>

static const double degree = pi / 180;

/* Steps begin at sums of rounded time steps: an event at 3 s must not miss the step at 2.9999999999 s. */
static const double slack = 1e-9;

Helm helm_begin(const ScriptWords *words) {
    return (Helm){.keys = words->keys, .key_count = words->key_count};
}

static void press(Helm *helm, int index) {
    const ScriptKey *key = &helm->keys[index];
    helm->held[index] = true;
    if (key->action == SCRIPT_KEY_CAMERA)
        snprintf(helm->camera, sizeof helm->camera, "%s", key->camera);
    if (key->action == SCRIPT_KEY_RUDDER)
        helm->hold = false;
}

static void apply(Helm *helm, const ScriptEvent *event) {
    switch (event->command) {
    case SCRIPT_PRESS:
        press(helm, event->key);
        break;
    case SCRIPT_RELEASE:
        helm->held[event->key] = false;
        break;
    case SCRIPT_THROTTLE:
        helm->throttle = event->value;
        break;
    case SCRIPT_RUDDER:
        helm->rudder = event->value;
        helm->hold = false;
        break;
    case SCRIPT_HEADING:
        helm->hold = true;
        helm->heading = event->value;
        helm->rudder = 0;
        break;
    case SCRIPT_HEADING_OFF:
        helm->hold = false;
        break;
    case SCRIPT_CAMERA:
        memcpy(helm->camera, event->camera, sizeof helm->camera);
        break;
    }
}

void helm_advance(Helm *helm, const Script *script, double time) {
    while (helm->next < script->count && script->events[helm->next].time <= time + slack)
        apply(helm, &script->events[helm->next++]);
}

/* What keys and command together make of one lever. */
static double lever(const Helm *helm, ScriptAction action, double command) {
    bool any = false;
    double most = 0, least = 0;
    for (int k = 0; k < helm->key_count; k++) {
        const double value = (double)helm->keys[k].value;
        if (!helm->held[k] || helm->keys[k].action != (int)action)
            continue;
        any = true;
        most = value > most ? value : most;
        least = value < least ? value : least;
    }
    return (any ? most + least : command) + 0.0; /* no -0: it would drive alike and hash differently */
}

HelmPosition helm_position(const Helm *helm) {
    HelmPosition position = {.throttle = lever(helm, SCRIPT_KEY_THROTTLE, helm->throttle),
                             .rudder = helm->hold ? 0 : lever(helm, SCRIPT_KEY_RUDDER, helm->rudder),
                             .hold = helm->hold,
                             .heading = helm->hold ? helm->heading + 0.0 : 0};
    memcpy(position.camera, helm->camera, sizeof position.camera);
    return position;
}

bool helm_same(const HelmPosition *a, const HelmPosition *b) {
    return a->throttle == b->throttle && a->rudder == b->rudder && a->hold == b->hold &&
           a->heading == b->heading && strcmp(a->camera, b->camera) == 0;
}

SkiffControls helm_controls(const HelmPosition *position) {
    return (SkiffControls){.throttle = position->throttle,
                           .rudder = position->rudder,
                           .hold = position->hold,
                           .heading = position->heading * degree};
}

void helm_write_change(FILE *stream, double time, const HelmPosition *from, const HelmPosition *to) {
    if (to->throttle != from->throttle)
        fprintf(stream, "%.17g throttle %.17g\n", time, to->throttle);
    if (to->hold && (!from->hold || to->heading != from->heading))
        fprintf(stream, "%.17g heading %.17g\n", time, to->heading);
    if (!to->hold && from->hold)
        fprintf(stream, "%.17g heading off\n", time);
    if (!to->hold && to->rudder != from->rudder) /* holding and after it: amidships, 0 */
        fprintf(stream, "%.17g rudder %.17g\n", time, to->rudder);
    if (strcmp(to->camera, from->camera) != 0)
        fprintf(stream, "%.17g camera %s\n", time, to->camera);
}
