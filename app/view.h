/* Pictures of a simulation as it runs: which frames are due, and where they go. The files
 * view*.c are all that know both the engine and the renderer. */
#ifndef SKIFF_APP_VIEW_H
#define SKIFF_APP_VIEW_H

#include "frames.h"
#include "scene.h"
#include "view_options.h"

typedef struct View View;

/* What a view adds to the figures in the picture at each step. */
typedef struct ViewControls {
    FrameControls driven;
    double step_ms; /* wall time of the step */
} ViewControls;

ViewControls view_controls_none(void);

/* Prepares cameras, meshes and GL. `sim` must be in its first state: that is what heights of materials in the
 * scene refer to. Scene and what the options point to must outlive the view. ERR_GL: no usable OpenGL;
 * ERR_USAGE: an unknown camera, an odd size for a film; ERR_INPUT: Render names a body that the scene lacks.
 * Writes nothing. */
View *view_create(const ViewOptions *options, const Scene *scene, const SkiffSim *sim, Err *err);

/* Begins `output`/frames, video.mp4 and particles/, as the options ask, at the time of `sim` (NULL,
 * as `controls`: saved frames follow). Frame 1 is the scene's start. A resumed film begins with the frames
 * that are there already. */
bool view_begin(View *view, const SkiffSim *sim, const ViewControls *controls, const char *output, Err *err);

/* After every step: draws and saves every frame whose time lies in it. */
bool view_step(View *view, const SkiffSim *sim, const ViewControls *controls, Err *err);

/* Keeps in view.skiff what the next frames depend on beside the simulation; for checkpoints. NULL is fine. */
bool view_save(View *view, Err *err);

/* Draws frame `number` of the sequence from saved particles; call for each number from 1 on, also for those
 * that --frames leaves out: foam and cameras have a memory. */
bool view_saved(View *view, const Frame *frame, int number, Err *err);

/* Waits for the last frame and ends the film. The view is only good for view_destroy then. NULL is fine. */
bool view_finish(View *view, Err *err);
/* Without view_finish the film is thrown away; frames are complete in any case. NULL is fine. */
void view_destroy(View *view);

#endif
