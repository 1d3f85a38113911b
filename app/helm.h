/* The helm: what events have set and which keys are held, and what that means for the drives now. */
#ifndef SKIFF_APP_HELM_H
#define SKIFF_APP_HELM_H

#include "script.h"

#include "engine/skiff.h"

#include <stdio.h>

/* What the boat and the camera get. Equal positions drive alike, however they came about. */
typedef struct HelmPosition {
    double throttle;
    double rudder; /* 0 while a heading is held */
    bool hold;
    double heading;                /* degrees; 0 while none is held */
    char camera[SCRIPT_NAME_SIZE]; /* "": none was chosen */
} HelmPosition;

typedef struct Helm {
    const ScriptKey *keys; /* borrowed */
    int key_count;
    bool held[SCRIPT_MAX_KEYS];
    double throttle, rudder; /* set by command; keys that are held take their place */
    bool hold;
    double heading;
    char camera[SCRIPT_NAME_SIZE];
    size_t next; /* event of the script */
} Helm;

Helm helm_begin(const ScriptWords *words);
/* All events up to `time` (s) that were not done yet. */
void helm_advance(Helm *helm, const Script *script, double time);
HelmPosition helm_position(const Helm *helm);
bool helm_same(const HelmPosition *a, const HelmPosition *b);
SkiffControls helm_controls(const HelmPosition *position);
/* Writes, as lines of an input file, what leads from one position to the other at `time`. */
void helm_write_change(FILE *stream, double time, const HelmPosition *from, const HelmPosition *to);

#endif
