/* Tiles and blocks of water at rest: their memory and files, cutting a block out of a simulation, and finding
 * the points of a box of the world. How a tile is made is in tile_make.c, how good it is in tile_quality.c.
 */
#include "tile.h"

#include "base/state_file.h"
#include "tile_bytes.h"
#include "tile_pairs.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { TILE_VERSION = 1, MAX_COUNT = 100000000 };

bool tile_init(RestTile *tile, uint32_t count, Err *err) {
    *tile = (RestTile){.count = count};
    tile->position = calloc((size_t)count + 1, sizeof *tile->position);
    tile->share = calloc((size_t)count + 1, sizeof *tile->share);
    if (tile->position && tile->share)
        return true;
    tile_free(tile);
    return err_set(err, ERR_INPUT, "no memory for %u points of water at rest", count);
}

void tile_free(RestTile *tile) {
    free(tile->position);
    free(tile->share);
    *tile = (RestTile){0};
}

/* ---- Files ---- */

bool tile_save(const RestTile *tile, const char *path, Err *err) {
    const uint32_t periodic = tile->periodic;
    const StateField fields[] = {
        {"periodic", STATE_U32, 1, 1, &periodic},
        {"volume_factor", STATE_F64, 1, 1, &tile->volume_factor},
        {"size", STATE_F32, 3, 1, tile->size},
        {"position", STATE_F32, 3, tile->count, tile->position},
        {"share", STATE_F32, 1, tile->count, tile->share},
    };
    return state_file_write(path, TILE_VERSION, fields, sizeof fields / sizeof *fields, err);
}

/* What the rest of the program relies on. */
static bool check_tile(const char *name, const RestTile *tile, Err *err) {
    /* A periodic box must be wider than the support on both sides of a point. */
    const float least = tile->periodic ? 2.0f * TILE_SUPPORT + 1.0f : 0.0f;
    if (!(tile->volume_factor >= 0.1 && tile->volume_factor <= 2.0))
        return err_set(err, ERR_INPUT, "%s: volume_factor is %g, allowed 0.1 to 2", name,
                       tile->volume_factor);
    for (int k = 0; k < 3; k++)
        if (!(tile->size[k] > least && tile->size[k] <= 1e5f))
            return err_set(err, ERR_INPUT, "%s: size[%d] is %g r, allowed %g to 1e5 r", name, k,
                           (double)tile->size[k], (double)least);
    for (uint32_t i = 0; i < tile->count; i++) {
        for (int k = 0; k < 3; k++)
            if (!(tile->position[i][k] >= 0.0f && tile->position[i][k] < tile->size[k]))
                return err_set(err, ERR_INPUT, "%s: position[%u][%d] is %g r, outside the box of 0 to %g r",
                               name, i, k, (double)tile->position[i][k], (double)tile->size[k]);
        if (!(tile->share[i] >= -1e3f && tile->share[i] <= 1e3f))
            return err_set(err, ERR_INPUT, "%s: share[%u] is %g, allowed -1000 to 1000", name, i,
                           (double)tile->share[i]);
    }
    return true;
}

static bool read_tile(const char *name, const StateFile *file, RestTile *tile, Err *err) {
    const StateField *periodic = state_file_field(file, "periodic", STATE_U32, 1, 1, err);
    const StateField *factor =
        periodic ? state_file_field(file, "volume_factor", STATE_F64, 1, 1, err) : NULL;
    const StateField *size = factor ? state_file_field(file, "size", STATE_F32, 3, 1, err) : NULL;
    const StateField *position =
        size ? state_file_field(file, "position", STATE_F32, 3, UINT64_MAX, err) : NULL;
    if (!position)
        return false;
    if (position->count < 1 || position->count > MAX_COUNT)
        return err_set(err, ERR_INPUT, "%s: %llu points, allowed 1 to %d", name,
                       (unsigned long long)position->count, MAX_COUNT);
    const StateField *share = state_file_field(file, "share", STATE_F32, 1, position->count, err);
    if (!share || !tile_init(tile, (uint32_t)position->count, err))
        return false;
    const uint32_t flag = *(const uint32_t *)periodic->data;
    tile->periodic = flag == 1;
    tile->volume_factor = *(const double *)factor->data;
    memcpy(tile->size, size->data, sizeof tile->size);
    memcpy(tile->position, position->data, tile->count * sizeof *tile->position);
    memcpy(tile->share, share->data, tile->count * sizeof *tile->share);
    const bool good = flag <= 1 ? check_tile(name, tile, err)
                                : err_set(err, ERR_INPUT, "%s: periodic is %u, allowed 0 and 1", name, flag);
    if (!good)
        tile_free(tile);
    return good;
}

/* `file` may be NULL: then err tells why. */
static bool take_tile(const char *name, StateFile *file, RestTile *tile, Err *err) {
    *tile = (RestTile){0};
    if (!file)
        return false;
    const bool good = read_tile(name, file, tile, err);
    state_file_close(file);
    return good;
}

bool tile_parse(const char *name, const void *bytes, size_t size, RestTile *tile, Err *err) {
    return take_tile(name, state_file_parse(name, bytes, size, TILE_VERSION, err), tile, err);
}

bool tile_load(const char *path, RestTile *tile, Err *err) {
    return take_tile(path, state_file_open(path, TILE_VERSION, err), tile, err);
}

bool tile_load_default(RestTile *tile, Err *err) {
    return tile_parse("built-in rest tile", tile_bytes, tile_bytes_size, tile, err);
}

bool tile_load_surface(RestTile *tile, Err *err) {
    return tile_parse("built-in rest surface", surface_bytes, surface_bytes_size, tile, err);
}

/* ---- Cutting ---- */

/* World position of particle i relative to the cut's corner, r; false: outside. */
static bool cut_point(const TileCut *cut, const RestTile *tile, uint32_t i, float out[3]) {
    for (int k = 0; k < 3; k++) {
        out[k] = (float)(((double)cut->position[i][k] + cut->origin[k] - cut->min[k]) / cut->radius);
        if (!(out[k] >= 0.0f && out[k] < tile->size[k]))
            return false;
    }
    return true;
}

bool tile_cut(const TileCut *cut, RestTile *tile, Err *err) {
    RestTile box = {0};
    *tile = box;
    for (int k = 0; k < 3; k++) {
        box.size[k] = (float)((cut->max[k] - cut->min[k]) / cut->radius);
        if (!(box.size[k] > 2.0f * TILE_SUPPORT))
            return err_set(
                err, ERR_INPUT,
                "the box to cut is %g m long in %c: it must be longer than two support radii, %g m",
                cut->max[k] - cut->min[k], "xyz"[k], 2.0 * TILE_SUPPORT * cut -> radius);
    }
    uint32_t inside = 0, next = 0;
    float point[3];
    for (uint32_t i = 0; i < cut->count; i++)
        inside += cut_point(cut, &box, i, point);
    if (inside == 0)
        return err_set(err, ERR_INPUT, "no particle in the box to cut, (%g, %g, %g) to (%g, %g, %g) m",
                       cut->min[0], cut->min[1], cut->min[2], cut->max[0], cut->max[1], cut->max[2]);
    if (!tile_init(tile, inside, err))
        return false;
    tile->volume_factor = cut->volume_factor;
    memcpy(tile->size, box.size, sizeof tile->size);
    for (uint32_t i = 0; i < cut->count; i++)
        if (cut_point(cut, &box, i, point)) {
            memcpy(tile->position[next], point, sizeof point);
            tile->share[next++] = 1.0f;
        }
    return true;
}

/* ---- Filling ---- */

/* Which repetitions of a tile a box touches. */
typedef struct Repeats {
    double size[3]; /* m */
    int64_t first[3], last[3];
} Repeats;

static Repeats find_repeats(const RestTile *tile, const TileBox *box) {
    Repeats repeats;
    for (int k = 0; k < 3; k++) {
        repeats.size[k] = (double)tile->size[k] * box->radius;
        /* One more on each side: rounding may put a point of the next repetition into this one's place. */
        repeats.first[k] = (int64_t)floor((box->min[k] - box->offset[k]) / repeats.size[k]) - 1;
        repeats.last[k] = (int64_t)floor((box->max[k] - box->offset[k]) / repeats.size[k]) + 1;
        if (!tile->periodic)
            repeats.first[k] = repeats.last[k] = 0;
    }
    return repeats;
}

/* World position of point i of the repetition `at`; true when it is in the box. The position comes from the
 * place alone, never from the box: that is what makes equal places have equal points. */
static bool point_in_box(const RestTile *tile, const TileBox *box, const double corner[3], uint32_t i,
                         double out[3]) {
    bool inside = true;
    for (int k = 0; k < 3; k++) {
        out[k] = corner[k] + (double)tile->position[i][k] * box->radius;
        inside = inside && out[k] >= box->min[k] && out[k] < box->max[k];
    }
    return inside;
}

static bool repeat_meets_box(const TileBox *box, const double corner[3], const double size[3]) {
    for (int k = 0; k < 3; k++)
        if (corner[k] > box->max[k] || corner[k] + size[k] * (1.0 + 1e-9) < box->min[k])
            return false;
    return true;
}

/* Visits the points; writes them where there is a position to write to. */
static uint64_t visit(const RestTile *tile, const TileBox *box, const double origin[3], float (*position)[3],
                      uint32_t *index) {
    const Repeats repeats = find_repeats(tile, box);
    uint64_t count = 0;
    int64_t at[3];
    for (at[0] = repeats.first[0]; at[0] <= repeats.last[0]; at[0]++)
        for (at[1] = repeats.first[1]; at[1] <= repeats.last[1]; at[1]++)
            for (at[2] = repeats.first[2]; at[2] <= repeats.last[2]; at[2]++) {
                double corner[3], world[3];
                for (int k = 0; k < 3; k++)
                    corner[k] = box->offset[k] + (double)at[k] * repeats.size[k];
                if (!repeat_meets_box(box, corner, repeats.size))
                    continue;
                for (uint32_t i = 0; i < tile->count; i++) {
                    if (!point_in_box(tile, box, corner, i, world))
                        continue;
                    for (int k = 0; position && k < 3; k++)
                        position[count][k] = (float)(world[k] - origin[k]);
                    if (index)
                        index[count] = i;
                    count++;
                }
            }
    return count;
}

bool tile_count_box(const RestTile *tile, const TileBox *box, uint64_t *count, Err *err) {
    *count = 0;
    for (int k = 0; k < 3; k++) {
        const double end = box->offset[k] + (double)tile->size[k] * box->radius;
        const double slack = 1e-9 * (double)tile->size[k] * box->radius;
        if (!tile->periodic && (box->min[k] < box->offset[k] - slack || box->max[k] > end + slack))
            return err_set(err, ERR_INPUT,
                           "water at rest is needed from %g to %g m in %c, the block has it from %g to %g m",
                           box->min[k], box->max[k], "xyz"[k], box -> offset[k], end);
    }
    *count = visit(tile, box, NULL, NULL, NULL);
    return true;
}

uint64_t tile_fill_box(const RestTile *tile, const TileBox *box, const double origin[3], float (*position)[3],
                       uint32_t *index) {
    return visit(tile, box, origin, position, index);
}
