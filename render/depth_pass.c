/* Eye depth of the water's body, less that of still water in the same pixel: smoothing the difference leaves
 * no streaks where one looks along the surface. */
#include "pass.h"

#include <omp.h>

/* Rows [from, to) of the image, first as eye depth in `band`, then as what the image keeps. */
static void draw_band(const Frame *frame, int from, int to, float *band, float *residual) {
    int width = frame->images[IMAGE_DEPTH].width, height = frame->images[IMAGE_DEPTH].height;
    int stride = splat_stride(width);
    for (int i = 0; i < (to - from) * stride; i++)
        band[i] = NO_DEPTH;
    splat_rows(&frame->body_discs, width, from, to, band, NULL);
    for (int y = from; y < to; y++) {
        const float *row = band + (y - from) * stride;
        float *out = residual + (size_t)y * (size_t)width;
        for (int x = 0; x < width; x++) {
            float still = pass_still_depth(&frame->block, x, y, width, height);
            out[x] = row[x] < NO_DEPTH ? row[x] - still : NO_DEPTH;
        }
    }
}

static bool draw(Pass *pass, Frame *frame, Err *err) {
    (void)pass;
    const Texture *image = &frame->images[IMAGE_DEPTH];
    const SplatView view = {.view = frame->block.view,
                            .lens = frame->block.lens,
                            .width = image->width,
                            .height = image->height,
                            .radius = frame->block.sphere[0],
                            .lowered = frame->block.sphere[1],
                            .fade_shrinks = true};
    int bands = (image->height + SPLAT_BAND - 1) / SPLAT_BAND, threads = omp_get_max_threads();
    size_t own = (size_t)splat_stride(image->width) * SPLAT_BAND;
    if (!splat_project(&frame->body_discs, &frame->surface.body, &view, err) ||
        !buffer_reserve(&frame->band_memory, "bands of the water", (size_t)threads * own * sizeof(float),
                        err))
        return false;
#pragma omp parallel for schedule(dynamic, 1) num_threads(threads)
    for (int b = 0; b < bands; b++) {
        int from = b * SPLAT_BAND, to = from + SPLAT_BAND < image->height ? from + SPLAT_BAND : image->height;
        draw_band(frame, from, to, (float *)frame->band_memory.data + (size_t)omp_get_thread_num() * own,
                  frame->memory[IMAGE_DEPTH]);
    }
    return true;
}

const PassType depth_pass = {"depth", PASS_IN_WATER, IMAGE_DEPTH, NULL, draw};
