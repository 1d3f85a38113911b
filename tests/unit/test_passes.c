/* The pair passes against sums taken in double precision over all pairs, against each other across
 * instruction sets, and the operator identities the solvers rely on. */
#include "engine/base/random.h"
#include "engine/rows.h"
#include "engine/standing.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { COUNT = 1500 };

typedef struct Cloud {
    Particles particles;
    Grid grid;
    Rows rows;
    Kernel kernel;
    float volume;
    Float4 operand[COUNT + BLOCK];
} Cloud;

/* The next number of a stream of its own, [0, 1). */
static double random_unit(uint64_t *drawn) {
    return random_share(7, (*drawn)++);
}

static void cloud_search(Cloud *cloud, const Passes *passes, const StandingSet *standing) {
    Err err = {0};
    const CellBounds domain = {{-5, -5, -5}, {5, 5, 5}};
    assert_true(grid_sort(&cloud->grid, &cloud->particles, 0.1f, &domain, NULL, 1, &err));
    const RowsJob job = {.passes = passes,
                         .grid = &cloud->grid,
                         .particles = &cloud->particles,
                         .kernel = &cloud->kernel,
                         .volume = cloud->volume,
                         .standing = standing,
                         .threads = 1};
    assert_true(rows_build(&cloud->rows, &job, &err));
}

/* Jittered lattice of 0.05 m, so that densities are near rest and no two points coincide; one far outlier
 * makes lonely slices. */
static void cloud_make(Cloud *cloud, const Passes *passes, bool wide) {
    Err err = {0};
    *cloud = (Cloud){.kernel = kernel_make(0.1), .volume = 0.8f * 0.05f * 0.05f * 0.05f};
    assert_true(particles_reserve(&cloud->particles, COUNT, &err));
    uint64_t drawn = 0;
    for (int i = 0; i < COUNT; i++) {
        float p[3], v[3];
        const int at[3] = {i % 15, i / 15 % 10, i / 150};
        for (int k = 0; k < 3; k++) {
            p[k] = (float)(0.047 * at[k] + 0.03 * random_unit(&drawn));
            v[k] = (float)(random_unit(&drawn) - 0.5);
        }
        if (i == COUNT - 1)
            p[1] = 2.0f;
        particles_append(&cloud->particles, p, v, 0.0);
        cloud->particles.pressure[i] = (float)random_unit(&drawn);
    }
    cloud->rows.wide = wide;
    cloud_search(cloud, passes, NULL);
    assert_int_equal(cloud->rows.wide, wide);
    /* what the boundary pass does when there is no boundary */
    Float4 *sum = cloud->rows.gradient_sum.data;
    for (int i = 0; i < COUNT; i++) {
        const float *x = cloud->particles.position[i];
        float *v = cloud->particles.velocity[i];
        v[3] = vector_moment(&cloud->rows.pairs, x, v);
        memcpy(cloud->operand[i], x, sizeof(Float4));
        cloud->operand[i][3] = cloud->particles.pressure[i];
        sum[i][3] += sum[i][0] * sum[i][0] + sum[i][1] * sum[i][1] + sum[i][2] * sum[i][2];
    }
}

static void cloud_free(Cloud *cloud) {
    particles_free(&cloud->particles);
    grid_free(&cloud->grid);
    rows_free(&cloud->rows);
}

static double pair(const Cloud *cloud, int i, int j, double d[3]) {
    double sq = 0.0;
    for (int k = 0; k < 3; k++) {
        d[k] = (double)cloud->particles.position[i][k] - (double)cloud->particles.position[j][k];
        sq += d[k] * d[k];
    }
    return sqrt(sq);
}

static void test_against_all_pairs(void **state) {
    (void)state;
    static Cloud cloud;
    cloud_make(&cloud, &passes_plain, false);
    const double volume = cloud.volume;
    static Float4 acceleration[COUNT + BLOCK];
    static float divergence[COUNT + BLOCK];
    const PairData *pairs = &cloud.rows.pairs;
    const AccelerateJob job = {
        .operand = (const Float4 *)cloud.operand, .scale = 1.0f, .result = acceleration};
    for (uint32_t block = 0; block < particles_blocks(&cloud.particles); block++) {
        passes_plain.accelerate(pairs, &job, block);
        passes_plain.divergence(pairs, (const Float4 *)cloud.particles.velocity, divergence, block);
    }
    double largest_factor = 0.0;
    for (int i = 0; i < COUNT; i++) {
        double density = (double)cloud.kernel.w_scale, a[3] = {0}, div = 0.0, diagonal = 0.0, sum[3] = {0};
        int neighbours = 0;
        for (int j = 0; j < COUNT; j++) {
            double d[3];
            const double r = pair(&cloud, i, j, d);
            if (i == j || r >= 0.1)
                continue;
            neighbours++;
            density += (double)kernel_w(&cloud.kernel, (float)r);
            const double factor = volume * kernel_gradient_factor(&cloud.kernel, r);
            for (int k = 0; k < 3; k++) {
                const double g = factor * d[k];
                sum[k] += g;
                diagonal += g * g;
                a[k] += ((double)cloud.particles.pressure[i] + (double)cloud.particles.pressure[j]) * g;
                div += ((double)cloud.particles.velocity[i][k] - (double)cloud.particles.velocity[j][k]) * g;
                largest_factor = fmax(largest_factor, fabs(factor));
            }
        }
        for (int k = 0; k < 3; k++)
            diagonal += sum[k] * sum[k];
        assert_int_equal(cloud.rows.neighbours[i], neighbours);
        assert_float_equal(pairs->density[i], density * volume, 1e-5);
        /* each of 34 pairs is rounded by half a unit at most, at a distance of at most 0.1 */
        const double rounding = 34.0 * 0.1 * (double)pairs->factor_unit;
        for (int k = 0; k < 3; k++)
            assert_float_equal(acceleration[i][k], a[k], rounding);
        assert_float_equal(divergence[i], div, 3.0 * rounding);
        assert_float_equal(pairs->gradient_sum[i][3], diagonal, 1e-3 * (diagonal + 1.0));
    }
    assert_true(largest_factor <= 65535.0 * (double)pairs->factor_unit);
    cloud_free(&cloud);
}

/* Corrected gradients, without walls. */
static void cloud_correct(Cloud *cloud, const Passes *passes) {
    Err err = {0};
    assert_true(rows_reserve_correction(&cloud->rows, &cloud->particles, &err));
    for (int m = 0; m < 2; m++)
        memset(cloud->rows.shape[m].data, 0, cloud->rows.shape[m].size);
    rows_correct(&cloud->rows, passes, 1);
}

/* <D^T p, v> = <p, D v> and sum D^T p = 0: the pressure solve is symmetric and conserves momentum. */
static void check_adjoint(bool corrected) {
    static Cloud cloud;
    cloud_make(&cloud, &passes_plain, false);
    cloud_correct(&cloud, &passes_plain);
    const PairData *pairs = corrected ? &cloud.rows.corrected : &cloud.rows.pairs;
    static Float4 acceleration[COUNT + BLOCK];
    static float divergence[COUNT + BLOCK];
    const AccelerateJob job = {
        .operand = (const Float4 *)cloud.operand, .scale = 1.0f, .result = acceleration};
    for (uint32_t block = 0; block < particles_blocks(&cloud.particles); block++) {
        passes_plain.accelerate(pairs, &job, block);
        passes_plain.divergence(pairs, (const Float4 *)cloud.particles.velocity, divergence, block);
    }
    double left = 0.0, right = 0.0, total[3] = {0}, scale = 0.0;
    for (int i = 0; i < COUNT; i++) {
        right += (double)cloud.particles.pressure[i] * (double)divergence[i];
        for (int k = 0; k < 3; k++) {
            left += (double)acceleration[i][k] * (double)cloud.particles.velocity[i][k];
            total[k] += (double)acceleration[i][k];
            scale += fabs((double)acceleration[i][k]);
        }
    }
    assert_float_equal(left, right, 1e-6 * scale);
    for (int k = 0; k < 3; k++)
        assert_float_equal(total[k], 0.0, 1e-6 * scale);
    cloud_free(&cloud);
}

static void test_adjoint(void **state) {
    (void)state;
    check_adjoint(false);
    check_adjoint(true);
}

/* rms over the inner particles of the divergence that is found of a linear field with none. */
static double divergence_of_shear(const Cloud *cloud, const PairData *pairs) {
    static Float4 v[COUNT + BLOCK];
    static float divergence[COUNT + BLOCK];
    for (int i = 0; i < COUNT; i++) {
        const float *x = cloud->particles.position[i];
        v[i][0] = 2.0f * x[1] - x[0];
        v[i][1] = x[2] - x[0] + 3.0f * x[1];
        v[i][2] = x[1] - 2.0f * x[2];
        v[i][3] = vector_moment(pairs, x, v[i]);
    }
    for (uint32_t block = 0; block < particles_blocks(&cloud->particles); block++)
        passes_plain.divergence(pairs, (const Float4 *)v, divergence, block);
    double sum = 0.0;
    int inner = 0;
    for (int i = 0; i < COUNT; i++) {
        const float *x = cloud->particles.position[i];
        if (x[0] < 0.12f || x[0] > 0.58f || x[1] < 0.12f || x[1] > 0.35f || x[2] < 0.12f || x[2] > 0.35f)
            continue;
        sum += (double)(divergence[i] * divergence[i]);
        inner++;
    }
    assert_true(inner > 100);
    return sqrt(sum / inner);
}

static void test_correction(void **state) {
    (void)state;
    static Cloud cloud;
    cloud_make(&cloud, &passes_plain, false);
    cloud_correct(&cloud, &passes_plain);
    const double plain = divergence_of_shear(&cloud, &cloud.rows.pairs),
                 corrected = divergence_of_shear(&cloud, &cloud.rows.corrected);
    print_message("divergence of a flow without any: %.4f, corrected %.4f\n", plain, corrected);
    /* a lattice shaken by two thirds of its spacing */
    assert_true(corrected < 0.7 * plain);
    cloud_free(&cloud);
}

static uint64_t bits(const void *data, size_t size) {
    uint64_t hash = 1469598103934665603u;
    for (size_t k = 0; k < size; k++)
        hash = (hash ^ ((const uint8_t *)data)[k]) * 1099511628211u;
    return hash;
}

static uint64_t all_bits(const Passes *passes, bool wide) {
    static Cloud cloud;
    cloud_make(&cloud, passes, wide);
    cloud_correct(&cloud, passes);
    static Float4 acceleration[COUNT + BLOCK], corrected[COUNT + BLOCK], velocity[COUNT + BLOCK],
        fields[2][COUNT + BLOCK];
    static float divergence[COUNT + BLOCK], corrected_divergence[COUNT + BLOCK];
    const ForceJob job = {.pairs = &cloud.rows.pairs,
                          .velocity = (const Float4 *)cloud.particles.velocity,
                          .result = velocity,
                          .viscosity = 0.02f,
                          .calming = 0.7f,
                          .calming_limit = 0.1f,
                          .strain = {(const Float4 *)fields[0], (const Float4 *)fields[1]}};
    const StrainJob strain = {
        .pairs = &cloud.rows.pairs, .velocity = job.velocity, .strain = {fields[0], fields[1]}};
    const AccelerateJob push = {.operand = (const Float4 *)cloud.operand,
                                .base = (const Float4 *)cloud.particles.velocity,
                                .push = {0.1f, -0.03f, 0.2f},
                                .scale = -3.0f,
                                .result = acceleration};
    AccelerateJob push_corrected = push;
    push_corrected.result = corrected;
    for (uint32_t block = 0; block < particles_blocks(&cloud.particles); block++) {
        passes->accelerate(&cloud.rows.corrected, &push_corrected, block);
        passes->divergence(&cloud.rows.corrected, (const Float4 *)cloud.particles.velocity,
                           corrected_divergence, block);
        passes->accelerate(&cloud.rows.pairs, &push, block);
        passes->divergence(&cloud.rows.pairs, (const Float4 *)cloud.particles.velocity, divergence, block);
        passes->strain(&strain, block);
    }
    for (uint32_t block = 0; block < particles_blocks(&cloud.particles); block++)
        passes->forces(&job, block);
    const uint64_t hash =
        bits(cloud.rows.pairs.density, COUNT * sizeof(float)) * 3 +
        bits(cloud.rows.pairs.gradient_sum, COUNT * sizeof(Float4)) * 5 +
        bits(acceleration, COUNT * sizeof(Float4)) * 7 + bits(velocity, COUNT * sizeof(Float4)) * 11 +
        bits(divergence, COUNT * sizeof(float)) * 13 +
        bits(cloud.rows.corrected.gradient_sum, COUNT * sizeof(Float4)) * 17 +
        bits(corrected, COUNT * sizeof(Float4)) * 19 + bits(corrected_divergence, COUNT * sizeof(float)) * 23;
    cloud_free(&cloud);
    return hash;
}

static void test_same_bits(void **state) {
    (void)state;
    const uint64_t plain = all_bits(&passes_plain, false);
    assert_true(plain == all_bits(&passes_plain, true));
#ifdef SKIFF_HAVE_X86
    if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) {
        assert_true(plain == all_bits(&passes_avx2, false));
        assert_true(plain == all_bits(&passes_avx2, true));
    }
    if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") &&
        __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512dq")) {
        assert_true(plain == all_bits(&passes_avx512, false));
        assert_true(plain == all_bits(&passes_avx512, true));
    }
#endif
}

/* Too many neighbours is an error that names the particle, not an overflow. */
static void test_crowd(void **state) {
    (void)state;
    Err err = {0};
    Particles particles = {0};
    Grid grid = {0};
    static Rows rows;
    const Kernel kernel = kernel_make(0.1);
    const CellBounds domain = {{-1, -1, -1}, {1, 1, 1}};
    assert_true(particles_reserve(&particles, 700, &err));
    for (int i = 0; i < 700; i++)
        particles_append(&particles, (const float[3]){1e-4f * (float)i, 0, 0}, (const float[3]){0}, 0.0);
    assert_true(grid_sort(&grid, &particles, 0.1f, &domain, NULL, 1, &err));
    const RowsJob job = {.passes = &passes_plain,
                         .grid = &grid,
                         .particles = &particles,
                         .kernel = &kernel,
                         .volume = 1e-4f,
                         .threads = 1};
    assert_false(rows_build(&rows, &job, &err));
    assert_int_equal(err.code, ERR_DIVERGED);
    assert_non_null(strstr(err.message, "more than 496 neighbours"));
    particles_free(&particles);
    grid_free(&grid);
    rows_free(&rows);
}

/* Around the cell of every point within the bounds lies the whole margin, also where the bounds are multiples
 * of the cell size and rounding decides the cell. */
static void test_margins(void **state) {
    (void)state;
    const float sizes[] = {0.1f, 0.4f, 0.2f, 0.05f, 0.3f};
    for (size_t s = 0; s < sizeof sizes / sizeof sizes[0]; s++)
        for (int n = -2000; n <= 2000; n++)
            for (int margin = 1; margin <= 2; margin++) {
                const float exact = (float)n * sizes[s];
                const float points[] = {nextafterf(exact, -1e9f), exact, nextafterf(exact, 1e9f),
                                        (float)(n * 0.1), (float)n * 0.025f};
                for (size_t p = 0; p < sizeof points / sizeof points[0]; p++) {
                    const float x = points[p], far = x + 7.0f * sizes[s];
                    const CellBounds bounds = {{x, x, x}, {far, far, far}};
                    CellGrid cells;
                    assert_true(cell_grid_layout(&cells, &bounds, sizes[s], margin));
                    const int low = (int)floorf((x - cells.origin[0]) * cells.inv_size);
                    const int high = (int)floorf((far - cells.origin[0]) * cells.inv_size);
                    assert_true(low >= margin && high < cells.size[0] - margin);
                }
            }
}

/* The search beside standing water: a third of the cloud, and one point that all but touches a particle. */
static void search_beside(const Passes *passes, Cloud *cloud, StandingWater *water) {
    static Cloud whole;
    Err err = {0};
    cloud_make(&whole, passes, false);
    *cloud = (Cloud){.kernel = whole.kernel, .volume = whole.volume};
    *water = (StandingWater){0};
    assert_true(particles_reserve(&cloud->particles, COUNT, &err));
    assert_true(standing_reserve(water, COUNT + 1, &err));
    const Float4 *position = (const Float4 *)whole.particles.position;
    for (int i = 0; i < COUNT; i++) {
        if (position[i][0] + 0.3f * position[i][2] < 0.3f)
            standing_add(water, position[i], whole.particles.pressure[i]);
        else
            particles_append(&cloud->particles, position[i], (const float[3]){0}, 0.0);
    }
    standing_add(water, (const float[3]){position[0][0] + 0.01f, position[0][1], position[0][2]}, 1.0f);
    particles_append(&cloud->particles, position[0], (const float[3]){0}, 0.0);
    cloud_free(&whole);
    assert_true(standing_sort(water, 0.1f, &err));
    cloud_search(cloud, passes, &water->set);
}

static void test_standing_water(void **state) {
    (void)state;
    static Cloud cloud;
    StandingWater water;
    search_beside(&passes_plain, &cloud, &water);
    const Standing *beside = &cloud.rows.beside;
    const double volume = (double)cloud.volume, r = 0.025;
    double touched = 0.0;
    for (uint32_t i = 0; i < cloud.particles.count; i++) {
        double share = 0.0, push[3] = {0}, apart[3] = {0}, sum[3] = {0}, touching = 0.0, own = 0.0;
        for (uint32_t j = 0; j < water.count + cloud.particles.count; j++) {
            const bool stands = j < water.count;
            const float *other = stands ? water.points[j] : cloud.particles.position[j - water.count];
            double d[3], sq = 0.0;
            for (int k = 0; k < 3; k++) {
                d[k] = (double)cloud.particles.position[i][k] - (double)other[k];
                sq += d[k] * d[k];
            }
            const double distance = sqrt(sq);
            if (distance >= 0.1 || (!stands && j - water.count == i))
                continue;
            const double w = volume * (double)kernel_w(&cloud.kernel, (float)distance);
            *(stands ? &share : &own) += w;
            touching += stands && distance < 0.5 * r;
            for (int k = 0; k < 3; k++) {
                const double g = volume * kernel_gradient_factor(&cloud.kernel, distance) * d[k];
                sum[k] += g;
                push[k] += stands ? (double)other[3] * g : 0.0;
                apart[k] += stands && distance < r ? (r - distance) * d[k] / distance : 0.0;
            }
        }
        const double rounding = 34.0 * 0.1 * (double)cloud.rows.pairs.factor_unit;
        for (int k = 0; k < 3; k++) {
            assert_float_equal(beside->push[i][k], push[k], 1e-4);
            assert_float_equal(beside->apart[i][k], apart[k], 1e-7);
            assert_float_equal(cloud.rows.pairs.gradient_sum[i][k], sum[k], rounding);
        }
        assert_float_equal(beside->push[i][3], share, 1e-4); /* thirty weights in units of W(0) / 32767 */
        assert_float_equal(beside->apart[i][3], touching, 0.0);
        assert_float_equal(cloud.rows.pairs.density[i], own + share + volume * (double)cloud.kernel.w_scale,
                           1e-4);
        touched += touching;
    }
    assert_true(touched > 0.0);
    cloud_free(&cloud);
    standing_free(&water);
}

/* The sort is stable and the same for every number of threads; particles outside go, or are named. */
static void test_sort(void **state) {
    (void)state;
    uint64_t expected = 0;
    for (int threads = 1; threads <= 8; threads = threads * 2 + 1) {
        Err err = {0};
        Particles particles = {0};
        Grid grid = {0};
        uint64_t drawn = 0;
        assert_true(particles_reserve(&particles, 5000, &err));
        for (int i = 0; i < 5000; i++) {
            float p[3];
            for (int k = 0; k < 3; k++)
                p[k] = (float)random_unit(&drawn);
            particles_append(&particles, p, (const float[3]){0}, 0.0);
            particles.row_size[i] = row_size_of((uint32_t)(30 + 8 * random_unit(&drawn)),
                                                (uint32_t)(10 + 4 * random_unit(&drawn)));
        }
        const CellBounds domain = {{0, 0, 0}, {1, 0.9f, 1}};
        uint32_t removed = 0;
        assert_false(grid_sort(&grid, &particles, 0.1f, &domain, NULL, threads, &err));
        assert_int_equal(err.code, ERR_DIVERGED);
        assert_true(grid_sort(&grid, &particles, 0.1f, &domain, &removed, threads, &err));
        assert_int_equal(particles.count + removed, 5000);
        assert_in_range(removed, 400, 600);
        for (uint32_t k = 0; k < particles.count; k++) { /* in the order of cells, group by group */
            const uint32_t i = grid.member[k];
            assert_int_equal(i / ROW_GROUP, k / ROW_GROUP);
            assert_int_equal(grid.cell[k], cell_grid_at(&grid.cells, particles.position[i]));
            assert_true(grid.x[k] == particles.position[i][0] && grid.y[k] == particles.position[i][1] &&
                        grid.z[k] == particles.position[i][2]);
            if (k > 0) {
                assert_true(grid.cell[k] >= grid.cell[k - 1]);
                if (grid.cell[k] == grid.cell[k - 1])
                    assert_true(particles.id[i] > particles.id[grid.member[k - 1]]);
            }
        }
        for (uint32_t i = 1; i < particles.count; i++) /* within a group by the size of rows */
            assert_true(i % ROW_GROUP == 0 || particles.row_size[i] >= particles.row_size[i - 1]);
        const uint64_t hash = bits(particles.position, particles.count * sizeof(Float4));
        assert_true(threads == 1 || hash == expected);
        expected = hash;
        particles_free(&particles);
        grid_free(&grid);
    }
}

/* Who is set apart goes behind the others of its block; the search's order visits groups as they lie. */
static void test_sort_apart(void **state) {
    (void)state;
    enum { POINTS = 3000 };
    Err err = {0};
    Particles particles = {0};
    Grid grid = {0};
    uint64_t drawn = 0;
    uint8_t apart[POINTS];
    assert_true(particles_reserve(&particles, POINTS, &err));
    for (int i = 0; i < POINTS; i++) {
        const float p[3] = {(float)random_unit(&drawn), (float)random_unit(&drawn),
                            (float)random_unit(&drawn)};
        particles_append(&particles, p, (const float[3]){0}, 0.0);
        apart[i] = random_unit(&drawn) < 0.3 ? 2 : 0;
    }
    const uint64_t first_id = particles.id[0];
    const CellBounds domain = {{0, 0, 0}, {1, 1, 1}};
    grid.apart = apart;
    assert_true(grid_sort(&grid, &particles, 0.1f, &domain, NULL, 3, &err));
    assert_null(grid.apart);
    int turns = 0; /* from who is set apart to who is not, in the order of the arrays: once a block, and in
                    * the group where both meet, which goes by the size of rows */
    for (uint32_t i = 0; i < POINTS; i++) {
        const bool behind = apart[particles.id[i] - first_id] != 0;
        turns += i > 0 && i / BLOCK == (i - 1) / BLOCK && i / ROW_GROUP != (i - 1) / ROW_GROUP && !behind &&
                 apart[particles.id[i - 1] - first_id] != 0;
        const uint32_t k = grid.visits[i];
        assert_int_equal(k / BLOCK, i / BLOCK);
        assert_int_equal(grid.member[k] / ROW_GROUP, i / ROW_GROUP);
        assert_true(k == 0 || grid.cell[k] >= grid.cell[k - 1]);
    }
    assert_int_equal(turns, 0);
    particles_free(&particles);
    grid_free(&grid);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_against_all_pairs),
        cmocka_unit_test(test_adjoint),
        cmocka_unit_test(test_correction),
        cmocka_unit_test(test_same_bits),
        cmocka_unit_test(test_crowd),
        cmocka_unit_test(test_standing_water),
        cmocka_unit_test(test_margins),
        cmocka_unit_test(test_sort),
        cmocka_unit_test(test_sort_apart),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
