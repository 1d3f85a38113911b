/* Anti-aliasing of the finished picture: blurs along edges of luminance [Lottes 2009, FXAA; the console
 * variant]. On the CPU: most pixels have no edge, and only there is it fast to know. */
#include "pass.h"

#include <math.h>
#include <omp.h>
#include <string.h>

enum { BAND = 24 };

#define CONTRAST_LEAST (0.05f * 255.0f)
#define CONTRAST_PART  0.125f
#define REACH          8.0f /* px */

typedef struct Picture {
    const uint8_t (*pixels)[4];
    int width, height;
} Picture;

static float luminance(const float rgb[3]) {
    return 0.299f * rgb[0] + 0.587f * rgb[1] + 0.114f * rgb[2];
}

/* Unlike those of math.h each is one instruction, also of a vector. */
static inline float least(float a, float b) {
    return a < b ? a : b;
}

static inline float most(float a, float b) {
    return a > b ? a : b;
}

/* Of row y, or the nearest there is, with one more pixel at both ends. */
static void fill_luminance(const Picture *picture, int y, float *out) {
    const uint8_t(*row)[4] =
        picture->pixels + (size_t)pass_clamp(y, picture->height) * (size_t)picture->width;
    for (int x = 0; x < picture->width; x++)
        out[x + 1] = 0.299f * (float)row[x][0] + 0.587f * (float)row[x][1] + 0.114f * (float)row[x][2];
    out[0] = out[1];
    out[picture->width + 1] = out[picture->width];
}

/* Between pixels, `x` and `y` counted from the centre of the first. */
static void sample(const Picture *picture, float x, float y, float rgb[3]) {
    float left = floorf(x), low = floorf(y), part_x = x - left, part_y = y - low;
    int x0 = pass_clamp((int)left, picture->width), x1 = pass_clamp((int)left + 1, picture->width);
    int y0 = pass_clamp((int)low, picture->height), y1 = pass_clamp((int)low + 1, picture->height);
    const uint8_t(*below)[4] = picture->pixels + (size_t)y0 * (size_t)picture->width;
    const uint8_t(*above)[4] = picture->pixels + (size_t)y1 * (size_t)picture->width;
    for (int k = 0; k < 3; k++) {
        float a = (float)below[x0][k] + part_x * (float)(below[x1][k] - below[x0][k]);
        float b = (float)above[x0][k] + part_x * (float)(above[x1][k] - above[x0][k]);
        rgb[k] = a + part_y * (b - a);
    }
}

/* The mean of two samples `reach` of the way forwards and back. */
static void mean_along(const Picture *picture, const float at[2], const float along[2], float reach,
                       float rgb[3]) {
    float back[3];
    sample(picture, at[0] + along[0] * reach, at[1] + along[1] * reach, rgb);
    sample(picture, at[0] - along[0] * reach, at[1] - along[1] * reach, back);
    for (int k = 0; k < 3; k++)
        rgb[k] = 0.5f * (rgb[k] + back[k]);
}

/* low and high: of the luminances around; corners: sw, se, nw, ne. */
static void smooth_pixel(const Picture *picture, const float at[2], const float corners[4],
                         const float range[2], uint8_t out[4]) {
    float sw = corners[0], se = corners[1], nw = corners[2], ne = corners[3];
    float along[2] = {(sw + se) - (nw + ne), (nw + sw) - (ne + se)};
    float reduce = most((nw + ne + sw + se) * 0.03125f, 255.0f / 128.0f);
    float scale = 1.0f / (least(fabsf(along[0]), fabsf(along[1])) + reduce);
    for (int k = 0; k < 2; k++)
        along[k] = most(-REACH, least(REACH, along[k] * scale));
    float near[3], wide[3];
    mean_along(picture, at, along, 1.0f / 6.0f, near);
    mean_along(picture, at, along, 0.5f, wide);
    for (int k = 0; k < 3; k++)
        wide[k] = 0.5f * (near[k] + wide[k]);
    float l = luminance(wide);
    const float *result = l < range[0] || l > range[1] ? near : wide;
    for (int k = 0; k < 3; k++)
        out[k] = (uint8_t)(result[k] + 0.5f);
}

/* Where the luminance changes by much: 1, else 0. Neighbours at the corners do not count, so that a bright
 * drop stays a dot. Each row has one more pixel at both ends. */
static void find_edges(const float *restrict below, const float *restrict here, const float *restrict above,
                       int width, uint8_t *restrict edge) {
    for (int x = 0; x < width; x++) {
        float low = least(here[x], least(least(below[x], above[x]), least(here[x - 1], here[x + 1])));
        float high = most(here[x], most(most(below[x], above[x]), most(here[x - 1], here[x + 1])));
        edge[x] = high - low >= most(CONTRAST_LEAST, CONTRAST_PART * high);
    }
}

/* Three rows of luminance, the middle one that of row y. */
static void smooth_row(const Picture *picture, int y, float *const l[3], uint8_t *edge, uint8_t (*out)[4]) {
    const float *below = l[0] + 1, *here = l[1] + 1, *above = l[2] + 1;
    memcpy(out, picture->pixels + (size_t)y * (size_t)picture->width, 4 * (size_t)picture->width);
    find_edges(below, here, above, picture->width, edge);
    for (int x = 0; x < picture->width; x++) {
        if (!edge[x])
            continue;
        const float corners[4] = {below[x - 1], below[x + 1], above[x - 1], above[x + 1]};
        const float at[2] = {(float)x, (float)y};
        float range[2] = {here[x], here[x]};
        for (int i = 0; i < 4; i++) {
            range[0] = least(range[0], corners[i]);
            range[1] = most(range[1], corners[i]);
        }
        smooth_pixel(picture, at, corners, range, out[x]);
    }
}

static void smooth_band(const Picture *picture, int from, int to, float *memory, uint8_t (*out)[4]) {
    size_t stride = (size_t)picture->width + 2;
    float *rows[3] = {memory, memory + stride, memory + 2 * stride};
    uint8_t *edge = (uint8_t *)(memory + 3 * stride);
    fill_luminance(picture, from - 1, rows[0]);
    fill_luminance(picture, from, rows[1]);
    for (int y = from; y < to; y++) {
        fill_luminance(picture, y + 1, rows[2]);
        smooth_row(picture, y, rows, edge, out + (size_t)y * (size_t)picture->width);
        float *first = rows[0];
        rows[0] = rows[1];
        rows[1] = rows[2];
        rows[2] = first;
    }
}

static bool draw(Pass *pass, Frame *frame, Err *err) {
    (void)pass;
    Picture picture = {frame->memory[IMAGE_READ], frame->width, frame->height};
    int threads = omp_get_max_threads(), bands = (frame->height + BAND - 1) / BAND;
    size_t own = 4 * ((size_t)frame->width + 2);
    if (!buffer_reserve(&frame->band_memory, "bands of the picture", (size_t)threads * own * sizeof(float),
                        err))
        return false;
#pragma omp parallel for schedule(dynamic, 1) num_threads(threads)
    for (int i = 0; i < bands; i++) {
        int from = i * BAND, to = from + BAND < frame->height ? from + BAND : frame->height;
        smooth_band(&picture, from, to, (float *)frame->band_memory.data + (size_t)omp_get_thread_num() * own,
                    frame->memory[IMAGE_FINISHED]);
    }
    return true;
}

const PassType fxaa_pass = {"fxaa", PASS_IN_WATER | PASS_IN_PARTICLES, IMAGE_FINISHED, NULL, draw};
