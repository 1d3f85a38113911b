/* Water at rest: how good the tile that comes with the program is, that it repeats without a seam and is
 * anchored in the world, that making one does not depend on threads, and what damaged files are answered
 * with. */
#include "base/file.h"
#include "base/random.h"
#include "base/state_file.h"
#include "kernel.h"
#include "tile.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "scratch.h"

static char path[128];
static RestTile shipped;

static int setup(void **state) {
    if (scratch_enter(state) != 0)
        return -1;
    snprintf(path, sizeof path, "%s/tile.skiff", scratch_folder);
    return tile_load_default(&shipped, NULL) ? 0 : -1;
}

static int teardown(void **state) {
    tile_free(&shipped);
    return scratch_leave(state);
}

/* A result of tile_fill_box. */
typedef struct Points {
    uint64_t count;
    float (*position)[3];
    uint32_t *index;
} Points;

static Points fill(const RestTile *tile, const TileBox *box, const double origin[3]) {
    Err err = {0};
    Points points;
    if (!tile_count_box(tile, box, &points.count, &err))
        fail_msg("%s", err.message);
    points.position = calloc(points.count + 1, sizeof *points.position);
    points.index = calloc(points.count + 1, sizeof *points.index);
    assert_true(points.position && points.index);
    assert_int_equal(tile_fill_box(tile, box, origin, points.position, points.index), points.count);
    return points;
}

static void drop(Points *points) {
    free(points->position);
    free(points->index);
}

static const double zero[3];

/* ---- Quality ---- */

static void shipped_tile_is_at_rest(void **state) {
    (void)state;
    Err err = {0};
    SkiffTileQuality quality;
    assert_true(tile_measure(&shipped, 2, &quality, &err));
    assert_true(shipped.periodic);
    assert_int_equal(quality.count, shipped.count);
    assert_float_equal(quality.density_mean, 1.0, 1e-6);
    assert_true(quality.density_sd < 2e-5);
    assert_true(quality.density_min > 0.9999 && quality.density_max < 1.0001);
    assert_true(quality.gradient_rms < 0.022 && quality.gradient_max < 0.06);
    assert_true(quality.force_rms < 3e-4 && quality.force_max < 1e-3);
    assert_true(quality.share_sd < 0.1);
    assert_true(quality.anisotropy < 1e-3);
    assert_float_equal(quality.number_density, 1.256, 0.001);
    assert_true(quality.nearest_min > 0.75);
}

/* The figures themselves, on a lattice, where they are known. */
static void a_lattice_measures_as_a_lattice(void **state) {
    (void)state;
    Err err = {0};
    RestTile tile;
    SkiffTileQuality quality;
    enum { SIDE = 7 };
    assert_true(tile_init(&tile, SIDE * SIDE * SIDE, &err));
    tile.periodic = true;
    tile.volume_factor = 1.0;
    for (uint32_t i = 0; i < tile.count; i++) {
        const uint32_t at[3] = {i % SIDE, i / SIDE % SIDE, i / SIDE / SIDE};
        for (int k = 0; k < 3; k++)
            tile.position[i][k] = 2.0f * (float)at[k];
        tile.share[i] = i % 2 ? 0.5f : 1.5f;
    }
    for (int k = 0; k < 3; k++)
        tile.size[k] = 2.0f * SIDE;
    assert_true(tile_measure(&tile, 1, &quality, &err));
    assert_int_equal(quality.count, SIDE * SIDE * SIDE);
    assert_float_equal(quality.number_density, 1.0, 1e-12);
    assert_float_equal(quality.density_sd, 0.0, 1e-7);
    assert_float_equal(quality.gradient_max, 0.0, 1e-9);
    assert_float_equal(quality.anisotropy, 0.0, 1e-6);
    assert_float_equal(quality.nearest_min, 1.0, 1e-9);
    assert_float_equal(quality.nearest_mean, 1.0, 1e-9);
    assert_float_equal(quality.share_sd, 0.5, 1e-2);
    /* An odd side: the alternation breaks at the seam, and there the shares leave something unbalanced. */
    assert_true(quality.force_max > 0.01);
    /* Stretching an axis shows. */
    tile.size[0] *= 1.02f;
    for (uint32_t i = 0; i < tile.count; i++)
        tile.position[i][0] *= 1.02f;
    assert_true(tile_measure(&tile, 1, &quality, &err));
    assert_true(quality.anisotropy > 0.005);
    tile_free(&tile);
}

/* ---- Filling ---- */

/* Density of point i by the sum over all points of the box, in r. */
static double density_among(const Points *points, uint64_t i, double volume_factor) {
    const Kernel kernel = kernel_make(4.0);
    double sum = 0.0;
    for (uint64_t j = 0; j < points->count; j++) {
        const float *a = points->position[i], *b = points->position[j];
        sum += (double)kernel_w(&kernel, hypotf(hypotf(a[0] - b[0], a[1] - b[1]), a[2] - b[2]));
    }
    return 8.0 * volume_factor * sum;
}

static void seams_are_as_dense_as_the_inside(void **state) {
    (void)state;
    const double edge = (double)shipped.size[0];
    /* Around the corner where eight repetitions meet. */
    const TileBox box = {
        .radius = 1.0, .min = {edge - 10, edge - 10, edge - 10}, .max = {edge + 10, edge + 10, edge + 10}};
    Points points = fill(&shipped, &box, (double[]){edge, edge, edge});
    int near = 0;
    for (uint64_t i = 0; i < points.count; i++) {
        const float *p = points.position[i];
        const float farthest = fmaxf(fmaxf(fabsf(p[0]), fabsf(p[1])), fabsf(p[2]));
        const float nearest = fminf(fminf(fabsf(p[0]), fabsf(p[1])), fabsf(p[2]));
        if (farthest >= 6.0f || nearest >= 4.0f)
            continue;
        near++;
        assert_float_equal(density_among(&points, i, shipped.volume_factor), 1.0, 1e-4);
    }
    assert_true(near > 200);
    drop(&points);
}

static void a_box_holds_its_volume(void **state) {
    (void)state;
    const double radius = 0.025, edge = (double)shipped.size[0] * radius;
    /* Whole repetitions hold whole tiles, wherever they begin. */
    TileBox whole = {.radius = radius, .offset = {0.017, -0.4, 11.0}, .min = {-0.31, 0.123, 7.7}};
    for (int k = 0; k < 3; k++)
        whole.max[k] = whole.min[k] + (k + 1) * edge;
    uint64_t count;
    assert_true(tile_count_box(&shipped, &whole, &count, NULL));
    assert_int_equal(count, 6 * (uint64_t)shipped.count);
    /* Others within the noise of their surface. */
    const TileBox odd = {.radius = radius, .min = {-1.03, -0.5, 0.21}, .max = {0.64, 0.53, 1.99}};
    const double expected = 1.67 * 1.03 * 1.78 * 1.256 / (8 * radius * radius * radius);
    assert_true(tile_count_box(&shipped, &odd, &count, NULL));
    assert_float_equal((double)count, expected, 0.003 * expected);
}

static void boxes_side_by_side_share_no_point_and_miss_none(void **state) {
    (void)state;
    TileBox whole = {
        .radius = 0.025, .offset = {0.01, 0.02, 0.03}, .min = {-0.7, -0.1, 0.3}, .max = {0.9, 0.8, 1.2}};
    Points all = fill(&shipped, &whole, zero);
    for (int axis = 0; axis < 3; axis++) {
        uint64_t joined = 0;
        for (int side = 0; side < 2; side++) {
            TileBox half = whole;
            /* A face that goes right through a point. */
            const double edge = (double)shipped.size[axis] * whole.radius;
            const double point = (double)shipped.position[7][axis] * whole.radius;
            double face = -INFINITY;
            for (int at = -2; face < whole.min[axis]; at++)
                face = whole.offset[axis] + at * edge + point;
            assert_true(face < whole.max[axis]);
            *(side ? half.min + axis : half.max + axis) = face;
            Points points = fill(&shipped, &half, zero);
            /* The same points in the same order, without those of the other half. */
            uint64_t next = 0;
            for (uint64_t i = 0; i < all.count && next < points.count; i++)
                next += memcmp(all.position[i], points.position[next], sizeof *all.position) == 0;
            assert_int_equal(next, points.count);
            joined += points.count;
            drop(&points);
        }
        assert_int_equal(joined, all.count);
    }
    drop(&all);
}

/* What a window relies on when it moves: a place has the same points, whichever box is asked for and wherever
 * its origin is. */
static void places_keep_their_points(void **state) {
    (void)state;
    const double at = 1e5, step = 0.25;
    const TileBox before = {.radius = 0.025, .min = {at, -1, at}, .max = {at + 1.5, 0, at + 1}};
    const TileBox after = {.radius = 0.025, .min = {at + step, -1, at}, .max = {at + 1.5 + step, 0, at + 1}};
    Points a = fill(&shipped, &before, (double[]){at, 0, at});
    Points b = fill(&shipped, &after, (double[]){at + step, 0, at});
    uint64_t i = 0, j = 0, common = 0;
    while (i < a.count && j < b.count) {
        /* Both lists are in the same order: skip what only one of them has. */
        if (a.position[i][0] < (float)step) {
            i++;
        } else if (b.position[j][0] >= 1.5f - (float)step) {
            j++;
        } else {
            assert_int_equal(a.index[i], b.index[j]);
            for (int k = 0; k < 3; k++)
                assert_float_equal(a.position[i][k] - (k == 0 ? (float)step : 0.0f), b.position[j][k], 3e-7);
            i++, j++, common++;
        }
    }
    assert_true(common > 10000);
    drop(&a);
    drop(&b);
    /* And the whole moved by 100 km is the same water. */
    const TileBox here = {.radius = 0.025, .offset = {0.1, 0, 0.2}, .max = {1.5, 1, 1}};
    const TileBox there = {
        .radius = 0.025, .offset = {at + 0.1, 0, at + 0.2}, .min = {at, 0, at}, .max = {at + 1.5, 1, at + 1}};
    a = fill(&shipped, &here, zero);
    b = fill(&shipped, &there, (double[]){at, 0, at});
    assert_int_equal(a.count, b.count);
    assert_memory_equal(a.index, b.index, a.count * sizeof *a.index);
    for (i = 0; i < a.count; i++)
        for (int k = 0; k < 3; k++)
            assert_float_equal(a.position[i][k], b.position[i][k], 3e-7);
    drop(&a);
    drop(&b);
}

/* ---- Blocks ---- */

static RestTile cut_block(const double min[3], const double max[3], Err *err) {
    const TileBox box = {.radius = 0.025, .min = {-0.5, -0.5, -0.5}, .max = {0.5, 0.5, 0.5}};
    Points points = fill(&shipped, &box, (double[]){10, 20, 30});
    float(*position)[4] = calloc(points.count, sizeof *position);
    assert_non_null(position);
    for (uint64_t i = 0; i < points.count; i++)
        memcpy(position[i], points.position[i], sizeof points.position[i]);
    TileCut cut = {.position = (const float(*)[4])position,
                   .count = (uint32_t)points.count,
                   .origin = {10, 20, 30},
                   .radius = 0.025,
                   .volume_factor = 0.8};
    memcpy(cut.min, min, sizeof cut.min);
    memcpy(cut.max, max, sizeof cut.max);
    RestTile block;
    tile_cut(&cut, &block, err);
    free(position);
    drop(&points);
    return block;
}

static void a_block_ends_at_its_faces(void **state) {
    (void)state;
    Err err = {0};
    SkiffTileQuality quality;
    const double corner[3] = {-0.4, -0.4, -0.45}, end[3] = {0.4, 0.4, 0.45};
    RestTile block = cut_block(corner, end, &err);
    assert_false(block.periodic);
    assert_true(tile_measure(&block, 1, &quality, &err));
    assert_true(quality.count < block.count && quality.count > 1000);
    /* Positions went through float32 at 30 m and back: 2e-6 m. */
    assert_float_equal(quality.density_mean, 1.0, 1e-4);
    assert_true(quality.density_sd < 1e-3);
    assert_float_equal(quality.number_density, 1.256, 0.05);

    TileBox box = {.radius = 0.05, .offset = {1, 1, 1}, .min = {1, 1, 1}, .max = {2.6, 2.6, 2.8}};
    uint64_t count;
    assert_true(tile_count_box(&block, &box, &count, &err));
    assert_int_equal(count, block.count);
    box.max[2] = 2.9;
    assert_false(tile_count_box(&block, &box, &count, &err));
    assert_int_equal(err.code, ERR_INPUT);
    assert_string_equal(err.message,
                        "water at rest is needed from 1 to 2.9 m in z, the block has it from 1 to 2.8 m");
    tile_free(&block);
}

static void boxes_that_cannot_be_cut_are_named(void **state) {
    (void)state;
    Err err = {0};
    RestTile block = cut_block((double[]){0, 0, 0}, (double[]){0.4, 0.15, 0.4}, &err);
    assert_int_equal(err.code, ERR_INPUT);
    assert_non_null(strstr(err.message, "0.15 m long in y: it must be longer than two support radii, 0.2 m"));
    assert_null(block.position);
    block = cut_block((double[]){5, 5, 5}, (double[]){6, 6, 6}, &err);
    assert_non_null(strstr(err.message, "no particle in the box to cut, (5, 5, 5) to (6, 6, 6) m"));
    assert_null(block.position);
}

/* ---- Making ---- */

static void making_does_not_depend_on_threads(void **state) {
    (void)state;
    Err err = {0};
    RestTile tiles[3];
    for (int t = 0; t < 3; t++) {
        SkiffTileDef def = skiff_tile_def_default();
        def.edge = 6;
        def.iterations = 1500;
        def.threads = t + 1;
        if (!tile_make(&def, &tiles[t], &err))
            fail_msg("%s", err.message);
        assert_int_equal(tiles[t].count, tiles[0].count);
        assert_memory_equal(tiles[t].size, tiles[0].size, sizeof tiles[0].size);
        assert_memory_equal(tiles[t].position, tiles[0].position, tiles[0].count * sizeof *tiles[0].position);
        assert_memory_equal(tiles[t].share, tiles[0].share, tiles[0].count * sizeof *tiles[0].share);
    }
    SkiffTileQuality quality;
    assert_true(tile_measure(&tiles[0], 1, &quality, &err));
    assert_true(quality.density_sd < 1e-4);
    assert_float_equal(quality.density_mean, 1.0, 1e-6);
    assert_true(quality.force_rms < 0.1 * quality.gradient_rms);
    for (int t = 0; t < 3; t++)
        tile_free(&tiles[t]);
}

static void impossible_tiles_are_refused(void **state) {
    (void)state;
    Err err = {0};
    RestTile tile;
    SkiffTileDef def = skiff_tile_def_default();
    def.threads = 1;
    def.edge = 5;
    assert_false(tile_make(&def, &tile, &err));
    assert_string_equal(err.message, "edge of the tile: 5 d, allowed 6 to 64 d");
    def.edge = 6;
    def.volume_factor = NAN;
    assert_false(tile_make(&def, &tile, &err));
    assert_non_null(strstr(err.message, "volume factor"));
    def.volume_factor = 0.8;
    def.iterations = 100;
    assert_false(tile_make(&def, &tile, &err));
    assert_int_equal(err.code, ERR_INPUT);
    assert_non_null(strstr(err.message, "not at rest after 100 iterations"));
    assert_null(tile.position);
}

/* ---- Files ---- */

static void files_keep_every_bit(void **state) {
    (void)state;
    Err err = {0};
    RestTile tile;
    assert_true(tile_save(&shipped, path, &err));
    assert_true(tile_load(path, &tile, &err));
    assert_int_equal(tile.count, shipped.count);
    assert_true(tile.periodic);
    assert_true(tile.volume_factor == shipped.volume_factor);
    assert_memory_equal(tile.size, shipped.size, sizeof tile.size);
    assert_memory_equal(tile.position, shipped.position, tile.count * sizeof *tile.position);
    assert_memory_equal(tile.share, shipped.share, tile.count * sizeof *tile.share);
    tile_free(&tile);
}

static void numbers_without_a_sense_are_named(void **state) {
    (void)state;
    static const struct {
        uint32_t periodic;
        double factor;
        float size, x, share;
        const char *expected;
    } cases[] = {
        {1, 0.8, 24, 3, 1, NULL},
        {2, 0.8, 24, 3, 1, "periodic is 2, allowed 0 and 1"},
        {1, -1, 24, 3, 1, "volume_factor is -1, allowed 0.1 to 2"},
        {1, 0.8, 8, 3, 1, "size[0] is 8 r, allowed 9 to 1e5 r"},
        {0, 0.8, NAN, 3, 1, "size[0] is nan r, allowed 0 to 1e5 r"},
        {1, 0.8, 24, 24, 1, "position[1][0] is 24 r, outside the box of 0 to 24 r"},
        {1, 0.8, 24, -1, 1, "position[1][0] is -1 r, outside"},
        {1, 0.8, 24, NAN, 1, "position[1][0] is nan r, outside"},
        {1, 0.8, 24, 3, INFINITY, "share[1] is inf, allowed -1000 to 1000"},
    };
    for (size_t c = 0; c < sizeof cases / sizeof *cases; c++) {
        const float size[3] = {cases[c].size, 24, 24}, share[2] = {1, cases[c].share};
        const float position[2][3] = {{1, 2, 3}, {cases[c].x, 2, 3}};
        const StateField fields[] = {
            {"periodic", STATE_U32, 1, 1, &cases[c].periodic},
            {"volume_factor", STATE_F64, 1, 1, &cases[c].factor},
            {"size", STATE_F32, 3, 1, size},
            {"position", STATE_F32, 3, 2, position},
            {"share", STATE_F32, 1, 2, share},
        };
        Err err = {0};
        RestTile tile;
        assert_true(state_file_write(path, 1, fields, 5, &err));
        const bool good = tile_load(path, &tile, &err);
        assert_true(good == !cases[c].expected);
        if (!good && (err.code != ERR_INPUT || !strstr(err.message, cases[c].expected) || tile.position))
            fail_msg("expected '%s' in: %s", cases[c].expected, err.message);
        tile_free(&tile);
        /* A field less. */
        assert_true(state_file_write(path, 1, fields + 1, 4, &err));
        assert_false(tile_load(path, &tile, &err));
        assert_non_null(strstr(err.message, "field 'periodic' is missing"));
    }
}

static void damage_is_found(void **state) {
    (void)state;
    Err err = {0};
    char *bytes;
    size_t size;
    RestTile tile;
    assert_true(tile_save(&shipped, path, &err));
    assert_true(file_read(path, 1 << 20, &bytes, &size, &err));
    assert_true(size < 60000);
    for (int n = 0; n < 400; n++) {
        const uint64_t random = random_bits(1, (uint64_t)n);
        const size_t at = (size_t)(random >> 33) % (n < 200 ? size : 500);
        const char mask = (char)(1 << (random >> 13 & 7));
        bytes[at] ^= mask;
        err = (Err){0};
        assert_false(tile_parse("x", bytes, size, &tile, &err));
        assert_int_equal(err.code, ERR_INPUT);
        assert_true(strncmp(err.message, "x: ", 3) == 0);
        bytes[at] ^= mask;
        assert_false(tile_parse("x", bytes, at, &tile, &err));
        assert_null(tile.position);
    }
    assert_true(tile_parse("x", bytes, size, &tile, &err));
    tile_free(&tile);
    free(bytes);
    assert_false(tile_load("/nowhere/tile.skiff", &tile, &err));
    assert_non_null(strstr(err.message, "/nowhere/tile.skiff"));
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(shipped_tile_is_at_rest),
        cmocka_unit_test(a_lattice_measures_as_a_lattice),
        cmocka_unit_test(seams_are_as_dense_as_the_inside),
        cmocka_unit_test(a_box_holds_its_volume),
        cmocka_unit_test(boxes_side_by_side_share_no_point_and_miss_none),
        cmocka_unit_test(places_keep_their_points),
        cmocka_unit_test(a_block_ends_at_its_faces),
        cmocka_unit_test(boxes_that_cannot_be_cut_are_named),
        cmocka_unit_test(making_does_not_depend_on_threads),
        cmocka_unit_test(impossible_tiles_are_refused),
        cmocka_unit_test(files_keep_every_bit),
        cmocka_unit_test(numbers_without_a_sense_are_named),
        cmocka_unit_test(damage_is_found),
    };
    return cmocka_run_group_tests_name("tile", tests, setup, teardown);
}
