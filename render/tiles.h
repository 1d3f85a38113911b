/* What each square of the picture of water shows, so that it takes the shader that does no more than that: in
 * software GL a pixel pays for every texture a shader might read. */
#ifndef SKIFF_TILES_H
#define SKIFF_TILES_H

#include "pass.h"

enum { TILE_EDGE = 32 }; /* px */

typedef enum TileKind {
    TILE_SKY,   /* no water; meshes may be there */
    TILE_OCEAN, /* the ocean alone */
    TILE_WATER, /* particles in the ocean */
    TILE_MIXED, /* anything */
    TILE_KIND_COUNT
} TileKind;

/* Rectangles of tiles of one kind as pairs of triangles: corners 0..1 in the image. Memory of the frame. */
typedef struct TileList {
    float (*corners)[2];
    int first[TILE_KIND_COUNT], count[TILE_KIND_COUNT]; /* of each kind */
} TileList;

/* ERR_INPUT: no memory. */
bool tiles_sort(Frame *frame, TileList *list, Err *err);

#endif
