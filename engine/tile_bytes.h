/* The files assets/rest/tile.skiff and surface.skiff, turned into arrays when the engine is built
 * (CMakeLists.txt). */
#ifndef SKIFF_TILE_BYTES_H
#define SKIFF_TILE_BYTES_H

#include <stddef.h>

extern const unsigned char tile_bytes[];
extern const size_t tile_bytes_size;
extern const unsigned char surface_bytes[];
extern const size_t surface_bytes_size;

#endif
