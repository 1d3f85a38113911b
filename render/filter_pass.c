/* Smooths the water's depth: along rows, then along columns, by the narrow-range filter [Truong & Yuksel
 * 2018, A narrow-range filter for screen-space fluid rendering] on the residual depth, then by a local mean.
 * What is far in front of the range is left out; what is far behind counts as a little behind. Unlike theirs
 * the range does not grow along connected neighbours (the residual has no slope to follow, and whether two
 * are connected flips from pixel to pixel at the end of a crest), and its ends are soft.
 *
 * On the CPU, eight pixels at a time. The result goes to IMAGE_SMOOTH. */
#include "pass.h"

#include <math.h>
#include <string.h>

enum { TAPS = 12, LANES = 8 };

#define REACH_IN_RADII     4.5f
#define THRESHOLD_IN_RADII 2.0f
#define CLEAN_IN_RADII     2.0f
#define STRIDE_MOST        5.0f
#define BEHIND             0.33f /* of the range: what lies far behind counts as this much behind */
#define GRAZING_MOST       8.0f

typedef struct Filter {
    const FrameBlock *block;
    int width, height;
    float reach;                            /* px at depth 1 m */
    float threshold;                        /* m */
    float like;                             /* m, of the local mean */
    float weights[(TAPS + 1) * (TAPS + 1)]; /* of tap i of so many, 0 beyond */
} Filter;

/* The eight pixels. */
typedef struct Lanes {
    float centre[LANES], range[LANES], softness[LANES], stride[LANES];
    int taps[LANES];
} Lanes;

static Filter make_filter(const Frame *frame) {
    float radius = frame->block.sphere[0];
    Filter filter = {.block = &frame->block,
                     .width = frame->images[IMAGE_SMOOTH].width,
                     .height = frame->images[IMAGE_SMOOTH].height};
    float focal = frame->block.sphere[2] * (float)filter.height / (float)frame->height;
    filter.reach = REACH_IN_RADII * radius * focal;
    filter.threshold = THRESHOLD_IN_RADII * radius;
    filter.like = CLEAN_IN_RADII * radius;
    for (int taps = 1; taps <= TAPS; taps++)
        for (int i = 0; i <= taps; i++)
            filter.weights[taps * (TAPS + 1) + i] = expf(-4.5f * (float)(i * i) / (float)(taps * taps));
    return filter;
}

static float clamp_part(float x) {
    x = x > 0.0f ? x : 0.0f;
    return x < 1.0f ? x : 1.0f;
}

/* Large kernels take fewer taps at a stride: what they smooth is then as large. At grazing angles a step in
 * height is a long step in depth. Returns the largest number of taps; 0: no water here. */
static int prepare(const Filter *filter, const float *from, int x, int y, Lanes *lanes) {
    const FrameBlock *block = filter->block;
    float above = fmaxf(fabsf(block->eye[1] - block->eye[3]), 0.3f);
    int most = 0;
    for (int k = 0; k < LANES; k++) {
        float z = from[(size_t)y * (size_t)filter->width + (size_t)(x + k)];
        lanes->centre[k] = z;
        lanes->taps[k] = 0;
        lanes->stride[k] = lanes->range[k] = lanes->softness[k] = 1.0f;
        if (z >= 0.9f * NO_DEPTH)
            continue;
        float still = pass_still_depth(block, x + k, y, filter->width, filter->height);
        float wanted = filter->reach / fmaxf(z + still, block->lens[2]);
        lanes->taps[k] = (int)fminf(ceilf(fmaxf(wanted, 1.0f)), TAPS);
        lanes->stride[k] = fminf(fmaxf(wanted / TAPS, 1.0f), STRIDE_MOST);
        lanes->range[k] = filter->threshold * fminf(fmaxf(0.6f * still / above, 1.0f), GRAZING_MOST);
        lanes->softness[k] = 2.0f / lanes->range[k];
        most = lanes->taps[k] > most ? lanes->taps[k] : most;
    }
    return most;
}

/* Eight pixels from (x, y) on, along x or along y. */
static inline void smooth_lanes(const Filter *filter, const float *restrict from, float *restrict to, int x,
                                int y, bool along_x) {
    Lanes lanes;
    float sum[LANES], total[LANES];
    int most = prepare(filter, from, x, y, &lanes), width = filter->width, height = filter->height;
    int row = y * width;
    const float *restrict weights = filter->weights;
    for (int k = 0; k < LANES; k++) {
        sum[k] = 0.0f;
        total[k] = 1.0f;
    }
    for (int i = 1; i <= most; i++)
#pragma omp simd
        for (int k = 0; k < LANES; k++) {
            int off = (int)((float)i * lanes.stride[k] + 0.5f);
            float centre = lanes.centre[k], range = lanes.range[k], softness = lanes.softness[k];
            float weight = weights[lanes.taps[k] * (TAPS + 1) + i];
            int before =
                along_x ? row + pass_clamp(x + k - off, width) : pass_clamp(y - off, height) * width + x + k;
            int after =
                along_x ? row + pass_clamp(x + k + off, width) : pass_clamp(y + off, height) * width + x + k;
            float a = from[before] - centre, b = from[after] - centre;
            float counts_a = weight * clamp_part((a + range) * softness + 1.0f);
            float counts_b = weight * clamp_part((b + range) * softness + 1.0f);
            a += (range * BEHIND - a) * clamp_part((a - range) * softness);
            b += (range * BEHIND - b) * clamp_part((b - range) * softness);
            sum[k] += a * counts_a + b * counts_b;
            total[k] += counts_a + counts_b;
        }
    for (int k = 0; k < LANES; k++)
        to[row + x + k] = lanes.centre[k] + sum[k] / total[k];
}

static void smooth(const Filter *filter, const float *from, float *to, bool along_x) {
#pragma omp parallel for schedule(dynamic, 8)
    for (int y = 0; y < filter->height; y++)
        for (int x = 0; x < filter->width; x += LANES) {
            int first = x + LANES <= filter->width ? x : filter->width - LANES; /* the last ones twice */
            if (along_x)
                smooth_lanes(filter, from, to, first, y, true);
            else
                smooth_lanes(filter, from, to, first, y, false);
        }
}

/* Mean of 3 x 3 pixels, every other one, among neighbours of like depth: takes away the stripes that two
 * one-dimensional filters leave. */
static void clean(const Filter *filter, const float *restrict from, float *restrict to) {
    int width = filter->width;
    float like = filter->like;
#pragma omp parallel for schedule(static)
    for (int y = 0; y < filter->height; y++) {
        const float *rows[3];
        for (int j = 0; j < 3; j++)
            rows[j] = from + (size_t)pass_clamp(y + 2 * (j - 1), filter->height) * (size_t)width;
        for (int x = 0; x < width; x++) {
            const int columns[3] = {pass_clamp(x - 2, width), x, pass_clamp(x + 2, width)};
            float centre = rows[1][x], sum = centre, total = 1.0f;
            for (int j = 0; j < 3; j++)
                for (int i = 0; i < 3; i++) {
                    float z = rows[j][columns[i]];
                    float counts = fabsf(z - centre) < like ? 1.0f : 0.0f;
                    sum += z * counts;
                    total += counts;
                }
            to[(size_t)y * (size_t)width + (size_t)x] = sum / total;
        }
    }
}

static bool draw(Pass *pass, Frame *frame, Err *err) {
    (void)pass;
    const Filter filter = make_filter(frame);
    size_t plane = (size_t)filter.width * (size_t)filter.height;
    if (!buffer_reserve(&frame->band_memory, "smoothed water", 2 * plane * sizeof(float), err))
        return false;
    float *first = frame->band_memory.data, *second = first + plane;
    smooth(&filter, frame->memory[IMAGE_DEPTH], first, true);
    smooth(&filter, first, second, false);
    clean(&filter, second, first);
    texture_update(frame->gl, &frame->images[IMAGE_SMOOTH], TEXTURE_R32F, filter.width, filter.height, first);
    return true;
}

const PassType filter_pass = {"filter", PASS_IN_WATER, IMAGE_SMOOTH, NULL, draw};
