/* PNG files of finished frames: 8-bit RGB, rows from top to bottom without padding. */
#ifndef SKIFF_RENDER_PNG_H
#define SKIFF_RENDER_PNG_H

#include "../engine/base/err.h"

#include <stdint.h>

/* Writes width * height * 3 bytes as one atomic file (temporary name, flush, rename). ERR_IO with the path
 * when that fails; an older file of that name is then intact. */
bool gfx_png_write(const char *path, const uint8_t *rgb, int width, int height, Err *err);

/* Reads a file of exactly this size into `rgb` (width * height * 3 bytes). ERR_INPUT with the path when it is
 * missing, damaged or of another size. */
bool gfx_png_read(const char *path, uint8_t *rgb, int width, int height, Err *err);

#endif
