/* What pictures are of: how far it reaches at the start, and its bodies by name. */
#ifndef SKIFF_APP_VIEW_SUBJECT_H
#define SKIFF_APP_VIEW_SUBJECT_H

#include "frames.h"
#include "scene.h"
#include "view_options.h"

/* All of it belongs to others. */
typedef struct Subject {
    const ViewOptions *options;
    const Scene *scene;
    const SkiffSim *sim; /* in its first state */
    const Frame *frame;  /* of that state */
} Subject;

/* m; min above max: nothing is there. */
typedef struct Extent {
    double min[3], max[3];
} Extent;

/* Of the tank, else of the water, local. */
Extent view_subject_extent(const Subject *subject);
/* Of a body, in its own axes. */
Extent view_subject_body_extent(const Subject *subject, int body);

/* The body that cameras follow and whose speed is shown: the first that can move, else the first; -1: there
 * is none. */
int view_subject_hero(const SkiffDef *def);
/* Index of a body; -1: there is none of that name. */
int view_subject_find(const SkiffDef *def, const char *name);
/* False, and says that Render.LIST[index] names a body that the scene lacks: ERR_INPUT. */
bool view_subject_unknown(const Scene *scene, const char *list, int index, const char *name, Err *err);

#endif
