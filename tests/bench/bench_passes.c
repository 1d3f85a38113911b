/* The pair passes, a row each: milliseconds a pass, nanoseconds an entry and thread, and what a second thread
 * gives. bench_passes [PARTICLES_PER_EDGE LAYERS]: water of 10 000 particles/m^3 on a jittered lattice, r
 * 0.025 m; default 98 20, the size of bench-tank. Each figure is the best of several, so that only a busy
 * machine for the whole run spoils it. */
#define _POSIX_C_SOURCE 200809L
#include "engine/rows.h"
#include "engine/sim.h"

#include <stdio.h>
#include <stdlib.h>

enum { REPEATS = 9, MAX_THREADS = 2 };

typedef struct Tank {
    Particles particles;
    Grid grid;
    Rows rows;
    Kernel kernel;
    float volume;
    const Passes *passes;
    Float4 *operand, *vector, *strain[2];
    float *result;
} Tank;

static bool tank_make(Tank *tank, int edge, int layers, Err *err) {
    const uint32_t count = (uint32_t)(edge * edge * layers);
    const float spacing = 0.0464f;
    if (!particles_reserve(&tank->particles, count, err))
        return false;
    uint32_t seed = 1;
    for (uint32_t i = 0; i < count; i++) {
        const int at[3] = {(int)i % edge, (int)i / edge % layers, (int)i / edge / layers};
        float x[3], v[3];
        for (int k = 0; k < 3; k++) {
            seed = seed * 1664525u + 1013904223u;
            x[k] = spacing * ((float)at[k] + 0.4f * (float)(seed >> 8) / 16777216.0f);
            v[k] = (float)(seed >> 16) / 65536.0f - 0.5f;
        }
        particles_append(&tank->particles, x, v, 0.0);
    }
    const size_t padded = count + BLOCK;
    tank->operand = aligned_alloc(64, padded * sizeof(Float4));
    tank->vector = aligned_alloc(64, padded * sizeof(Float4));
    tank->result = aligned_alloc(64, padded * sizeof(float));
    for (int k = 0; k < 2; k++)
        tank->strain[k] = aligned_alloc(64, padded * sizeof(Float4));
    return true;
}

static bool tank_search(Tank *tank, int threads, Err *err) {
    const RowsJob job = {.passes = tank->passes,
                         .grid = &tank->grid,
                         .particles = &tank->particles,
                         .kernel = &tank->kernel,
                         .volume = tank->volume,
                         .threads = threads};
    return rows_build(&tank->rows, &job, err);
}

static const Passes *best_passes(void) {
#ifdef SKIFF_HAVE_X86
    if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") &&
        __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512dq"))
        return &passes_avx512;
    if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma"))
        return &passes_avx2;
#endif
    return &passes_plain;
}

typedef enum Pass { ACCELERATE, DIVERGENCE, STRAIN, VISCOSITY, CALMING, PASS_COUNT } Pass;

static void run_block(const Tank *tank, Pass pass, uint32_t block) {
    const PairData *pairs = &tank->rows.pairs;
    const Float4 *velocity = (const Float4 *)tank->particles.velocity;
    ForceJob force = {.pairs = pairs, .velocity = velocity, .result = tank->vector, .viscosity = 0.02f};
    switch (pass) {
    case ACCELERATE:
        tank->passes->accelerate(
            pairs,
            &(AccelerateJob){.operand = (const Float4 *)tank->operand, .scale = 1.0f, .result = tank->vector},
            block);
        break;
    case DIVERGENCE:
        tank->passes->divergence(pairs, velocity, tank->result, block);
        break;
    case STRAIN:
        tank->passes->strain(
            &(StrainJob){.pairs = pairs, .velocity = velocity, .strain = {tank->strain[0], tank->strain[1]}},
            block);
        break;
    case CALMING:
        force.calming = 1.0f;
        force.calming_limit = 0.003f;
        for (int k = 0; k < 2; k++)
            force.strain[k] = (const Float4 *)tank->strain[k];
        tank->passes->forces(&force, block);
        break;
    default:
        tank->passes->forces(&force, block);
        break;
    }
}

static double time_pass(const Tank *tank, Pass pass, int threads) {
    const uint32_t blocks = particles_blocks(&tank->particles);
    double best = 1e30;
    for (int repeat = 0; repeat < REPEATS; repeat++) {
        const double begin = timer_ms();
#pragma omp parallel for schedule(static) num_threads(threads)
        for (uint32_t block = 0; block < blocks; block++)
            run_block(tank, pass, block);
        const double ms = timer_ms() - begin;
        best = ms < best ? ms : best;
    }
    return best;
}

int main(int argc, char **argv) {
    const int edge = argc > 2 ? atoi(argv[1]) : 98, layers = argc > 2 ? atoi(argv[2]) : 20;
    if (edge < 4 || layers < 4 || (int64_t)edge * edge * layers > 20000000) {
        fprintf(stderr,
                "usage: bench_passes [PARTICLES_PER_EDGE LAYERS], each at least 4, 20 million in all\n");
        return 2;
    }
    Err err = {0};
    Tank tank = {.kernel = kernel_make(0.1), .volume = 1e-4f, .passes = best_passes()};
    const CellBounds domain = {{-1, -1, -1}, {1e4f, 1e4f, 1e4f}};
    if (!tank_make(&tank, edge, layers, &err) ||
        /* the second sort knows the rows of the first search, as every step knows those of the last */
        !grid_sort(&tank.grid, &tank.particles, tank.kernel.support, &domain, NULL, 1, &err) ||
        !tank_search(&tank, 1, &err) ||
        !grid_sort(&tank.grid, &tank.particles, tank.kernel.support, &domain, NULL, 1, &err)) {
        fprintf(stderr, "%s\n", err.message);
        return 1;
    }
    double search[MAX_THREADS + 1];
    for (int threads = 1; threads <= MAX_THREADS; threads++) {
        search[threads] = 1e30;
        for (int repeat = 0; repeat < REPEATS; repeat++) {
            const double begin = timer_ms();
            if (!tank_search(&tank, threads, &err)) {
                fprintf(stderr, "%s\n", err.message);
                return 1;
            }
            const double ms = timer_ms() - begin;
            search[threads] = ms < search[threads] ? ms : search[threads];
        }
    }
    const PairData *pairs = &tank.rows.pairs;
    uint64_t entries = 0, neighbours = 0;
    for (uint32_t i = 0; i < pairs->count; i++) {
        float *v = tank.particles.velocity[i];
        v[3] = vector_moment(pairs, tank.particles.position[i], v);
        memcpy(tank.operand[i], tank.particles.position[i], sizeof(Float4));
        tank.operand[i][3] = 0.001f;
        neighbours += tank.rows.neighbours[i];
    }
    for (uint32_t slice = 0; slice < (pairs->count + SLICE - 1) / SLICE; slice++)
        entries += pairs->slices[slice].length;
    printf("%u particles, %.1f neighbours each, padding %.2f, %s\n", pairs->count,
           (double)neighbours / pairs->count, (double)entries * SLICE / (double)neighbours,
           tank.passes->name);
    printf("%-12s %10s %10s %8s %14s\n", "pass", "1 thread", "2 threads", "gain", "ns an entry");
    static const char *const names[PASS_COUNT] = {"accelerate", "divergence", "strain", "viscosity",
                                                  "calming"};
    printf("%-12s %7.2f ms %7.2f ms %8.2f %14.2f\n", "search", search[1], search[2], search[1] / search[2],
           2e6 * search[2] / (double)entries);
    for (int pass = 0; pass < PASS_COUNT; pass++) {
        const double one = time_pass(&tank, (Pass)pass, 1), two = time_pass(&tank, (Pass)pass, 2);
        printf("%-12s %7.2f ms %7.2f ms %8.2f %14.2f\n", names[pass], one, two, one / two,
               2e6 * two / (double)entries);
    }
    return 0;
}
