/* Finished frames to disk, off the critical path: one background thread with a bounded queue. */
#ifndef SKIFF_RENDER_WRITER_H
#define SKIFF_RENDER_WRITER_H

#include "video.h"

typedef struct GfxWriter GfxWriter;

/* `capacity` frames (>= 1) of width x height RGB wait at most. ERR_IO when there is no memory or thread. */
GfxWriter *gfx_writer_begin(int width, int height, int capacity, Err *err);

/* Copies the frame and returns; waits only while the queue is full. It is written as `path` (NULL: not) and
 * then added to `video` (NULL: not), in the order of the calls. False with the error of the first frame that
 * could not be written, which may be an earlier one; nothing is written after that, and what had been
 * written is intact. */
bool gfx_writer_add(GfxWriter *writer, const char *path, GfxVideo *video, const uint8_t *rgb, Err *err);

/* Waits until all is written. False with the first error. Frees writer in any case; NULL is fine. */
bool gfx_writer_finish(GfxWriter *writer, Err *err);

#endif
