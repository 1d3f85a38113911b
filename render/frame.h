/* One image, from the scene's arrays to bytes. */
#ifndef SKIFF_FRAME_H
#define SKIFF_FRAME_H

#include "pass.h"

enum { FRAME_MAX_PASSES = 32 };

/* The passes in the order in which they run. */
int frame_pass_count(void);
const PassType *frame_pass_type(int index);

/* GL objects of all passes of the look. `passes` has FRAME_MAX_PASSES rows. */
bool frame_create(Frame *frame, Pass *passes, Err *err);
void frame_destroy(Frame *frame, Pass *passes);

/* Draws; frame->scene and frame->rgb are set by the caller. Fills the passes' rows of stats. */
bool frame_draw(Frame *frame, Pass *passes, GfxStats *stats, Err *err);

#endif
