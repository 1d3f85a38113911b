/* Brings the picture back to memory, top row first, averaged where it was drawn larger. */
#include "pass.h"

static bool create(Pass *pass, Frame *frame, Err *err) {
    pass->framebuffers[0] = framebuffer_create(frame->gl, &frame->images[IMAGE_FINISHED], NULL, err);
    return pass->framebuffers[0] != 0;
}

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
    (void)err;
    const Gl *gl = frame->gl;
    int n = frame->def.supersample;
    framebuffer_bind(gl, pass->framebuffers[0], &frame->images[IMAGE_FINISHED]);
    gl->PixelStorei(GL_PACK_ALIGNMENT, 1);
    gl->ReadPixels(0, 0, frame->width, frame->height, GL_RGBA, GL_UNSIGNED_BYTE, frame->pixels);
    for (int y = 0; y < frame->def.height; y++) {
        const uint8_t *rows =
            frame->pixels + 4 * (size_t)frame->width * (size_t)(frame->height - (y + 1) * n);
        uint8_t *rgb = frame->rgb + 3 * (size_t)frame->def.width * (size_t)y;
        if (n == 1)
            copy_row(rows, rgb, frame->def.width);
        else
            average_row(rows, frame->width, n, rgb, frame->def.width);
    }
    return true;
}

const PassType read_pass = {"read", PASS_IN_WATER | PASS_IN_PARTICLES, -1, create, draw};
