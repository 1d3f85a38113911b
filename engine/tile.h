/* Water at rest, as points in units of the particle radius: a box of them that repeats without a seam (a
 * tile), or a finite block cut out of a simulation. What initialisation, window and absorption take new
 * particles from.
 *
 * Lengths of a tile are in r, so one file serves every resolution; it holds for the support radius 4 r and
 * for the volume factor it was made with. In the world a tile is anchored: the same place always has the same
 * points, wherever a window is. */
#ifndef SKIFF_TILE_H
#define SKIFF_TILE_H

#include "skiff.h"

#include <stdint.h>

/* Zero-initialise; tile_free ends it. */
typedef struct SkiffTile {
    uint32_t count;
    bool periodic;        /* repeats in every direction; false: a block, with nothing outside */
    float size[3];        /* edges of the box, r */
    double volume_factor; /* volume of a particle in d^3 at which its density is rest density */
    float (*position)[3]; /* r, in [0, size) */
    float *share; /* pressure of each point relative to that of still water at its place: with pressures in
                     these proportions the forces on every point are balanced, which equal pressures would
                     miss by what disorder makes of the gradients. 1 on average; all 1 where it is unknown */
} RestTile;

/* An empty tile with room for `count` points. ERR_INPUT: no memory. */
bool tile_init(RestTile *tile, uint32_t count, Err *err);
void tile_free(RestTile *tile);

/* ---- Making ---- */

/* As skiff_tile_make; def->threads >= 1. */
bool tile_make(const SkiffTileDef *def, RestTile *tile, Err *err);
/* The inside of [min, max] (m, world) of `count` particles (position + origin, m) as a block. ERR_INPUT when
 * none is inside, or the box is too small to hold one that has all its neighbours. */
typedef struct TileCut {
    const float (*position)[4];
    uint32_t count;
    double origin[3], min[3], max[3];
    double radius; /* m */
    double volume_factor;
} TileCut;
bool tile_cut(const TileCut *cut, RestTile *tile, Err *err);
/* ERR_INPUT: a block without a point that has all its neighbours; no memory. */
bool tile_measure(const RestTile *tile, int threads, SkiffTileQuality *quality, Err *err);

/* ---- Files ---- */

/* The tile that is part of the program: assets/rest/tile.skiff. */
bool tile_load_default(RestTile *tile, Err *err);
/* What lies over it under a free surface (water.h): assets/rest/surface.skiff. */
bool tile_load_surface(RestTile *tile, Err *err);
/* ERR_INPUT: no such file, damaged, or its numbers make no sense. */
bool tile_load(const char *path, RestTile *tile, Err *err);
/* The same from memory; `name` is used in messages. */
bool tile_parse(const char *name, const void *bytes, size_t size, RestTile *tile, Err *err);
bool tile_save(const RestTile *tile, const char *path, Err *err);

/* ---- Filling ---- */

/* A box of the world, half open: two boxes that share a face share no point. */
typedef struct TileBox {
    double radius;         /* of a particle, m */
    double offset[3];      /* m, where the corner of the tile lies */
    double min[3], max[3]; /* m, min <= x < max */
} TileBox;

/* How many points lie in the box. ERR_INPUT: the box reaches outside a finite block. */
bool tile_count_box(const RestTile *tile, const TileBox *box, uint64_t *count, Err *err);
/* Writes these points, repetitions of the tile in the order x, y, z, z fastest, each in the tile's own order.
 * position (m) is relative to `origin`; index (may be NULL) is the number of the tile's point. Both have room
 * for what tile_count_box counts; the count is returned. */
uint64_t tile_fill_box(const RestTile *tile, const TileBox *box, const double origin[3], float (*position)[3],
                       uint32_t *index);

#endif
