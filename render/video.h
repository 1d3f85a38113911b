/* A film: raw frames into the standard input of ffmpeg (H.264, yuv420p, faststart). */
#ifndef SKIFF_RENDER_VIDEO_H
#define SKIFF_RENDER_VIDEO_H

#include "../engine/base/err.h"

#include <stdint.h>

typedef struct GfxVideo GfxVideo;

/* Can --video work? ERR_IO naming the package when there is no ffmpeg in PATH. */
bool gfx_video_check(Err *err);

/* Starts ffmpeg. Width and height must be even (ERR_USAGE); the file grows under `path`.tmp. ERR_IO when
 * ffmpeg is missing or cannot be started. */
GfxVideo *gfx_video_begin(const char *path, int width, int height, int fps, Err *err);

/* Adds a frame of width * height * 3 bytes, rows from top to bottom. Blocks while ffmpeg is busy. ERR_IO with
 * ffmpeg's own words when it has ended. */
bool gfx_video_add(GfxVideo *video, const uint8_t *rgb, Err *err);

/* Ends the film and gives it its name. Frees video in any case; without a single frame no file appears. */
bool gfx_video_finish(GfxVideo *video, Err *err);

/* Stops ffmpeg and removes the unfinished file. NULL is fine. */
void gfx_video_abort(GfxVideo *video);

#endif
