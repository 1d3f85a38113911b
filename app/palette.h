/* Colours for the names of materials in meshes. */
#ifndef SKIFF_APP_PALETTE_H
#define SKIFF_APP_PALETTE_H

#include <stdint.h>

/* sRGB. A name that is not in the table gives a light grey. */
const uint8_t *palette_color(const char *material);

#endif
