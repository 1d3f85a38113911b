/* Tables of the renderer, made at start: no files to carry along. Only integer arithmetic and correctly
 * rounded operations come before the rounding to bytes, but for sine, cosine, square root and power at
 * set-up. */
#include "tables.h"

#include <math.h>
#include <stdlib.h>

enum { WAVES = 90, LONGEST = 3, SHORTEST = 40, EDGE = RIPPLE_MAP_EDGE };

#define TWO_PI 6.28318530718f

static float random_part(uint32_t *state) {
    *state = *state * 1664525u + 1013904223u;
    return (float)(*state >> 8) * 0x1p-24f;
}

/* Adds a wave of kx, ky crests a tile: amplitude falls with the wave number, and with the angle to the wind
 * (x). */
static void add_wave(float (*slopes)[2], uint32_t *state, const float *sines) {
    int kx = 0, ky = 0;
    float k_sq = 0.0f;
    while (k_sq < LONGEST * LONGEST || k_sq > SHORTEST * SHORTEST) {
        /* Even in the logarithm of the wave number. */
        float k = LONGEST * powf((float)SHORTEST / LONGEST, random_part(state));
        float angle = 1.25f * (random_part(state) + random_part(state) - 1.0f) * 1.5f;
        kx = (int)lrintf(k * cosf(angle));
        ky = (int)lrintf(k * sinf(angle));
        k_sq = (float)(kx * kx + ky * ky);
    }
    float k = sqrtf(k_sq), slope = powf(k, -0.25f); /* a k: nearly white in slope */
    unsigned phase = (unsigned)(random_part(state) * EDGE);
    for (int y = 0; y < EDGE; y++)
        for (int x = 0; x < EDGE; x++) {
            float s = slope * sines[(unsigned)(kx * x + ky * y + (int)phase) % EDGE];
            slopes[y * EDGE + x][0] += s * (float)kx / k;
            slopes[y * EDGE + x][1] += s * (float)ky / k;
        }
}

/* Borders of the Voronoi cells of one random point in each square of a grid: 1 on a border. */
static float cell_border(const float (*points)[2], int squares, float x, float y) {
    int square_x = (int)x, square_y = (int)y;
    float nearest = 9.0f, second = 9.0f;
    for (int v = -1; v <= 1; v++)
        for (int u = -1; u <= 1; u++) {
            int i = (square_y + v + squares) % squares * squares + (square_x + u + squares) % squares;
            float dx = (float)(square_x + u) + points[i][0] - x,
                  dy = (float)(square_y + v) + points[i][1] - y;
            float d = sqrtf(dx * dx + dy * dy);
            if (d < nearest) {
                second = nearest;
                nearest = d;
            } else if (d < second) {
                second = d;
            }
        }
    float off = (second - nearest) * 1.7f;
    return off < 1.0f ? 1.0f - off : 0.0f;
}

enum { MAX_SQUARES = 48 };

static void add_cells(uint8_t (*texels)[4], int channel, int squares, uint32_t *state) {
    float points[MAX_SQUARES * MAX_SQUARES][2];
    for (int i = 0; i < squares * squares; i++)
        for (int k = 0; k < 2; k++)
            points[i][k] = random_part(state);
    float scale = (float)squares / EDGE;
    for (int y = 0; y < EDGE; y++)
        for (int x = 0; x < EDGE; x++)
            texels[y * EDGE + x][channel] =
                (uint8_t)(255.0f * cell_border((const float(*)[2])points, squares, (float)x * scale,
                                               (float)y * scale));
}

void tables_ripples(uint8_t (*texels)[4]) {
    static float slopes[EDGE * EDGE][2]; /* scratch of this function: too large for the stack */
    float sines[EDGE], sum_sq = 0.0f;
    uint32_t state = 12345;
    for (int i = 0; i < EDGE * EDGE; i++)
        slopes[i][0] = slopes[i][1] = 0.0f;
    for (int i = 0; i < EDGE; i++)
        sines[i] = sinf(TWO_PI * (float)i / EDGE);
    for (int i = 0; i < WAVES; i++)
        add_wave(slopes, &state, sines);
    for (int i = 0; i < EDGE * EDGE; i++)
        sum_sq += slopes[i][0] * slopes[i][0] + slopes[i][1] * slopes[i][1];
    /* Root mean square 0.35: slopes beyond 1 are rare, and cut. */
    float scale = 0.35f / sqrtf(sum_sq / (EDGE * EDGE));
    for (int i = 0; i < EDGE * EDGE; i++)
        for (int k = 0; k < 2; k++) {
            float s = 127.5f + 127.5f * scale * slopes[i][k];
            texels[i][k] = (uint8_t)(s < 0.0f ? 0.0f : s > 255.0f ? 255.0f : s);
        }
    add_cells(texels, 2, 26, &state);
    add_cells(texels, 3, 40, &state);
}

void tables_color(float t, uint8_t rgb[3]) {
    /* Polynomials fitted to the table of 256 colours, within 1 % [M. Zucker 2018]. */
    static const double c[7][3] = {
        {0.2777273272234177, 0.005407344544966578, 0.3340998053353061},
        {0.1050930431085774, 1.404613529898575, 1.384590162594685},
        {-0.3308618287255563, 0.214847559468213, 0.09509516302823659},
        {-4.634230498983486, -5.799100973351585, -19.33244095627987},
        {6.228269936347081, 14.17993336680509, 56.69055260068105},
        {4.776384997670288, -13.74514537774601, -65.35303263337234},
        {-5.435455855934631, 4.645852612178535, 26.3124352495832},
    };
    for (int k = 0; k < 3; k++) {
        double sum = 0.0;
        for (int i = 6; i >= 0; i--)
            sum = sum * (double)t + c[i][k];
        rgb[k] = (uint8_t)(sum < 0.0 ? 0.0 : sum > 1.0 ? 255.0 : sum * 255.0 + 0.5);
    }
}
