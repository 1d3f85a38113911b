/* One picture of a moment. */
#ifndef SKIFF_APP_VIEW_PICTURE_H
#define SKIFF_APP_VIEW_PICTURE_H

#include "view_subject.h"

typedef struct Picture Picture;

/* Prepares cameras, meshes and GL. Options and scene of the subject must outlive the picture. NULL: ERR_GL,
 * no usable OpenGL; ERR_USAGE, --camera names an unknown one; ERR_INPUT, Render names a body that the scene
 * lacks, or memory is exhausted. */
Picture *view_picture_create(const Subject *subject, Err *err);
/* NULL is fine. */
void view_picture_destroy(Picture *picture);

/* Foam, wake and cameras, which have a memory, go on to the frame's time. Call for each frame, drawn or not.
 * ERR_INPUT: the frame cuts to a camera that is not there, or memory is exhausted. */
bool view_picture_advance(Picture *picture, const Frame *frame, Err *err);

/* Draws the frame that view_picture_advance saw last. `step_ms`: wall time of its step, shown where the
 * figures include it; NaN: unknown. `rgb`: width * height * 3 bytes of the options' size, top row first.
 * Errors as of gfx_draw. */
bool view_picture_draw(Picture *picture, const Frame *frame, double step_ms, uint8_t *rgb, Err *err);

/* That memory at `time` (s), in a file: errors as in view_memory.h. */
bool view_picture_save(Picture *picture, double time, const char *path, Err *err);
bool view_picture_load(Picture *picture, double time, const char *path, Err *err);

#endif
