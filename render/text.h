/* Text in pictures: DejaVu Sans, carried inside the program, anti-aliased at any size. */
#ifndef SKIFF_RENDER_TEXT_H
#define SKIFF_RENDER_TEXT_H

#include "../engine/base/err.h"

#include <stdint.h>

/* A picture to draw on: 8-bit RGB, rows from top to bottom without padding. */
typedef struct GfxImage {
    uint8_t *rgb;
    int width, height; /* px */
} GfxImage;

/* Colour as on the screen (sRGB, 0..255) and opacity 0..1. */
typedef struct GfxInk {
    uint8_t r, g, b;
    float alpha;
} GfxInk;

typedef struct TextFont TextFont;

/* The glyphs of ASCII at one size. `size`: px from the top of "A" to its foot times 1.37. NULL when there is
 * no memory. */
TextFont *text_font_create(float size, Err *err);
void text_font_destroy(TextFont *font);

float text_width(const TextFont *font, const char *text); /* px */
float text_cap_height(const TextFont *font);              /* px, of "H" */
/* Draws with the left end of the base line at (x, y); returns where the next character would begin. Bytes
 * that are not printable ASCII are drawn as '?'; what is outside of the picture is left out. */
float text_draw(const TextFont *font, GfxImage image, float x, float y, GfxInk ink, const char *text);

/* Mixes ink over one pixel; `coverage` 0..1. Pixels outside are ignored. */
void text_blend(GfxImage image, int x, int y, GfxInk ink, float coverage);

#endif
