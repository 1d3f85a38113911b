/* The cameras of a scene, and the one that is looked through. */
#ifndef SKIFF_APP_VIEW_CAMERAS_H
#define SKIFF_APP_VIEW_CAMERAS_H

#include "view_subject.h"

#include "render/gfx.h"

typedef struct Camera {
    const char *name; /* belongs to the scene */
    int body;         /* that is followed; -1: none */
    GfxCameraDef def;
} Camera;

/* Zero-initialise, view_cameras_make, view_cameras_free. */
typedef struct Cameras {
    Camera *items;
    GfxCameraState *states;               /* of the items */
    char kinds[GFX_CAMERA_KIND_COUNT][8]; /* names of those that always exist */
    int count, current;
    bool stays; /* cuts are not followed */
} Cameras;

/* Those of the scene, then one of each kind under the name of the kind. ERR_INPUT: a name given twice, an
 * unknown body or camera; ERR_USAGE: --camera names an unknown one. view_cameras_free in any case. */
bool view_cameras_make(Cameras *cameras, const Subject *subject, Err *err);
void view_cameras_free(Cameras *cameras);

/* Looks through another camera. "", or where --camera was given: nothing changes. ERR_INPUT: there is none of
 * that name. */
bool view_cameras_cut(Cameras *cameras, const char *name, Err *err);

/* Moves all cameras on to the frame's time, so that a cut finds each one where it would have been. What the
 * current one sees, world. */
GfxCameraView view_cameras_move(Cameras *cameras, const Frame *frame);

#endif
