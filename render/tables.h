/* Constant textures: the tile of ripples and foam, and the colour map. */
#ifndef SKIFF_RENDER_TABLES_H
#define SKIFF_RENDER_TABLES_H

#include <stdint.h>

enum { RIPPLE_MAP_EDGE = 256, COLOR_MAP_SIZE = 256 };

/* A tile that repeats: slopes of wind waves along x (mostly downwind) and z as 127.5 + 127.5 s, |s| <= 1;
 * cells of foam, bright along their borders; finer cells. */
void tables_ripples(uint8_t (*texels)[4]);

/* "Viridis" [van der Walt & Smith 2015]: even steps to the eye, also in grey and for the colour-blind. t:
 * 0..1; sRGB. */
void tables_color(float t, uint8_t rgb[3]);

#endif
