/* The finished picture as the caller wants it: top row first, averaged where it was drawn larger. */
#include "pass.h"

/* One row of the result from `n` rows of the picture. */
static void average_row(const uint8_t *rows, int row_width, int n, uint8_t *rgb, int width) {
    int area = n * n;
    for (int x = 0; x < width; x++)
        for (int k = 0; k < 3; k++) {
            int sum = area / 2;
            for (int j = 0; j < n; j++)
                for (int i = 0; i < n; i++)
                    sum += rows[4 * ((size_t)j * (size_t)row_width + (size_t)(x * n + i)) + (size_t)k];
            rgb[3 * x + k] = (uint8_t)(sum / area);
        }
}

static void copy_row(const uint8_t *row, uint8_t *rgb, int width) {
    for (int x = 0; x < width; x++)
        for (int k = 0; k < 3; k++)
            rgb[3 * x + k] = row[4 * x + k];
}

static bool draw(Pass *pass, Frame *frame, Err *err) {
    (void)pass;
    (void)err;
    int n = frame->def.supersample;
    const uint8_t *finished = frame->memory[IMAGE_FINISHED];
#pragma omp parallel for schedule(static)
    for (int y = 0; y < frame->def.height; y++) {
        const uint8_t *rows = finished + 4 * (size_t)frame->width * (size_t)(frame->height - (y + 1) * n);
        uint8_t *rgb = frame->rgb + 3 * (size_t)frame->def.width * (size_t)y;
        if (n == 1)
            copy_row(rows, rgb, frame->width);
        else
            average_row(rows, frame->width, n, rgb, frame->def.width);
    }
    return true;
}

const PassType average_pass = {"average", PASS_IN_WATER | PASS_IN_PARTICLES, -1, NULL, draw};
