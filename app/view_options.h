/* How frames are drawn: the scene's section "Render" as the command line changes it. */
#ifndef SKIFF_APP_VIEW_OPTIONS_H
#define SKIFF_APP_VIEW_OPTIONS_H

#include "cli.h"
#include "scene.h"
#include "scene_table.h"

#define VIEW_BACKENDS "auto|egl-device|egl|osmesa" /* in the renderer's order */
#define VIEW_EXPORTS  "vtk|ply|bgeo"

typedef struct ViewOptions {
    SceneRender render; /* texts and lists belong to the scene or the command line */
    bool draws;         /* frames/ */
    bool video;         /* video.mp4 */
    int first, last;    /* numbers of the frames drawn, from 1; last 0: all */
    int backend;        /* position in VIEW_BACKENDS */
    int save_rate;      /* particle frames a second; 0: none */
    bool is_resumed;    /* frames of the time before are kept */
    bool keeps_camera;  /* --camera: cuts of the input script are not followed */
} ViewOptions;

/* ERR_USAGE: a word that cannot be understood, or options that contradict each other. */
bool view_options_make(ViewOptions *options, const CliArgs *args, const Scene *scene, Err *err);

/* Is there anything to do for a view? */
bool view_options_needed(const ViewOptions *options);

#endif
