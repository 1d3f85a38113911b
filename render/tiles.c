/* Particles are found in IMAGE_DEPTH, which is in memory; meshes by the corners of their boxes. */
#include "tiles.h"

#include <math.h>
#include <string.h>

enum { CORNERS = 6 }; /* of two triangles */

#define MIRRORED_MARGIN 0.04f /* of the image: as far as ripples bend what is mirrored */
#define HORIZON_SLOPE   1e-3f /* rays closer to level than this are at the horizon */

typedef struct Tiles {
    const Frame *frame;
    int columns, rows;
    uint8_t *kind;
} Tiles;

/* Upward part of the ray through a point of the image, 0..1. */
static float slope_at(const FrameBlock *block, float u, float v) {
    const float *camera = block->camera;
    return camera[1] * (2.0f * u - 1.0f) * block->lens[0] + camera[5] * (2.0f * v - 1.0f) * block->lens[1] -
           camera[9];
}

/* By the ocean alone. */
static TileKind kind_of_view(const Frame *frame, int column, int row) {
    const FrameBlock *block = &frame->block;
    float low = INFINITY, high = -INFINITY;
    if (block->edge[2] == 0.0f)
        return TILE_SKY;
    if (block->eye[1] <= block->eye[3]) /* below the surface */
        return TILE_MIXED;
    for (int i = 0; i < 4; i++) {
        float slope = slope_at(block, (float)((column + (i & 1)) * TILE_EDGE) * block->size[2],
                               (float)((row + (i >> 1)) * TILE_EDGE) * block->size[3]);
        low = fminf(low, slope);
        high = fmaxf(high, slope);
    }
    return low > HORIZON_SLOPE ? TILE_SKY : high < -HORIZON_SLOPE ? TILE_OCEAN : TILE_MIXED;
}

/* Is there a particle in the tile, or one pixel beside it? */
static bool has_fluid(const Frame *frame, int column, int row) {
    const Texture *image = &frame->images[IMAGE_DEPTH];
    const float *depth = frame->memory[IMAGE_DEPTH];
    const int edge = TILE_EDGE / 2;
    int left = column * edge - 1, right = left + edge + 2, low = row * edge - 1, high = low + edge + 2;
    left = left < 0 ? 0 : left;
    low = low < 0 ? 0 : low;
    right = right > image->width ? image->width : right;
    high = high > image->height ? image->height : high;
    bool some = false;
    for (int y = low; y < high && !some; y++)
        for (int x = left; x < right; x++)
            some |= depth[y * image->width + x] < NO_DEPTH;
    return some;
}

/* Marks the tiles under a box of the mesh, mirrored in still water or not. */
static void mark_mesh(Tiles *tiles, const GfxInstance *instance, bool mirrored) {
    const FrameBlock *block = &tiles->frame->block;
    const StoredMesh *mesh = &tiles->frame->meshes.meshes[instance->mesh];
    float min[2] = {INFINITY, INFINITY}, max[2] = {-INFINITY, -INFINITY};
    float margin = mirrored ? MIRRORED_MARGIN : 0.0f;
    for (int corner = 0; corner < 8; corner++) {
        float place[3], at[3];
        const float own[3] = {mesh->bounds[corner & 1][0], mesh->bounds[corner >> 1 & 1][1],
                              mesh->bounds[corner >> 2][2]};
        for (int k = 0; k < 3; k++)
            place[k] = instance->pose[k] * own[0] + instance->pose[4 + k] * own[1] +
                       instance->pose[8 + k] * own[2] + instance->pose[12 + k];
        place[1] = mirrored ? 2.0f * block->eye[3] - place[1] : place[1];
        for (int k = 0; k < 3; k++)
            at[k] = block->view[k] * place[0] + block->view[4 + k] * place[1] +
                    block->view[8 + k] * place[2] + block->view[12 + k];
        bool behind = -at[2] < block->lens[2];
        for (int k = 0; k < 2; k++) {
            float x = 0.5f + 0.5f * at[k] / (-at[2] * block->lens[k]);
            min[k] = behind ? 0.0f : fminf(min[k], x);
            max[k] = behind ? 1.0f : fmaxf(max[k], x);
        }
    }
    int from[2], to[2];
    const int count[2] = {tiles->columns, tiles->rows};
    for (int k = 0; k < 2; k++) {
        float scale = block->size[k] / TILE_EDGE;
        from[k] = (int)fminf(fmaxf(floorf((min[k] - margin) * scale - 0.1f), 0.0f), (float)count[k]);
        to[k] = (int)fminf(fmaxf(ceilf((max[k] + margin) * scale + 0.1f), 0.0f), (float)count[k]);
    }
    for (int row = from[1]; row < to[1]; row++)
        for (int column = from[0]; column < to[0]; column++) {
            uint8_t *kind = &tiles->kind[row * tiles->columns + column];
            *kind = *kind == TILE_SKY ? TILE_SKY : TILE_MIXED;
        }
}

static void add_rectangle(const Tiles *tiles, TileList *list, const int span[2], int row, int at) {
    const float *size = tiles->frame->block.size;
    float left = (float)(span[0] * TILE_EDGE) * size[2], right = (float)(span[1] * TILE_EDGE) * size[2];
    float low = (float)(row * TILE_EDGE) * size[3], high = (float)((row + 1) * TILE_EDGE) * size[3];
    const float corners[CORNERS][2] = {{left, low}, {right, low},  {right, high},
                                       {left, low}, {right, high}, {left, high}};
    memcpy(list->corners + at, corners, sizeof corners);
}

/* Neighbours in a row become one rectangle. */
static void fill_list(const Tiles *tiles, TileList *list) {
    int at = 0;
    for (int kind = 0; kind < TILE_KIND_COUNT; kind++) {
        list->first[kind] = at;
        for (int row = 0; row < tiles->rows; row++)
            for (int column = 0, end; column < tiles->columns; column = end) {
                const uint8_t *kinds = tiles->kind + row * tiles->columns;
                for (end = column + 1; end < tiles->columns && kinds[end] == kinds[column];)
                    end++;
                if (kinds[column] != kind)
                    continue;
                add_rectangle(tiles, list, (const int[2]){column, end}, row, at);
                at += CORNERS;
            }
        list->count[kind] = at - list->first[kind];
    }
}

bool tiles_sort(Frame *frame, TileList *list, Err *err) {
    Tiles tiles = {.frame = frame,
                   .columns = (frame->width + TILE_EDGE - 1) / TILE_EDGE,
                   .rows = (frame->height + TILE_EDGE - 1) / TILE_EDGE};
    size_t count = (size_t)tiles.columns * (size_t)tiles.rows;
    if (!buffer_reserve(&frame->band_memory, "tiles of the picture",
                        count * (CORNERS * sizeof *list->corners + sizeof *tiles.kind), err))
        return false;
    list->corners = frame->band_memory.data;
    tiles.kind = (uint8_t *)(list->corners + CORNERS * count);
    for (int row = 0; row < tiles.rows; row++)
        for (int column = 0; column < tiles.columns; column++) {
            TileKind kind = kind_of_view(frame, column, row);
            if (has_fluid(frame, column, row))
                kind = kind == TILE_OCEAN ? TILE_WATER : TILE_MIXED;
            tiles.kind[row * tiles.columns + column] = (uint8_t)kind;
        }
    for (uint32_t i = 0; i < frame->scene->instance_count; i++) {
        mark_mesh(&tiles, &frame->scene->instances[i], false);
        mark_mesh(&tiles, &frame->scene->instances[i], true);
    }
    fill_list(&tiles, list);
    return true;
}
