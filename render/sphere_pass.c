/* Particles as lit spheres, coloured by a field: the opaque ones by the nearest in each pixel, then the
 * fading ones from far to near over them, at the depth of their centres. On the CPU (splat.h), into the
 * picture that read_pass brought back. */
#include "pass.h"

#include "tables.h"

#include <math.h>
#include <omp.h>
#include <string.h>

enum { NOBODY = UINT32_MAX };

/* Rows of one band, in planes; those of a thread. */
typedef struct Band {
    int from, to, stride;
    float *depth, *rgb[3];
    uint32_t *owner;
} Band;

/* What all spheres of an image share. */
typedef struct Light {
    float to_sun[3]; /* in the eye's frame */
    float colors[COLOR_MAP_SIZE][3];
    float field_min, field_scale;
} Light;

static Light make_light(const FrameBlock *block) {
    Light light = {.field_min = block->field[0], .field_scale = block->field[1]};
    const float *m = block->view, *sun = block->sun;
    for (int k = 0; k < 3; k++)
        light.to_sun[k] = m[k] * sun[0] + m[4 + k] * sun[1] + m[8 + k] * sun[2];
    for (int i = 0; i < COLOR_MAP_SIZE; i++) {
        uint8_t rgb[3];
        tables_color((float)i / (COLOR_MAP_SIZE - 1), rgb);
        for (int k = 0; k < 3; k++)
            light.colors[i][k] = (float)rgb[k];
    }
    return light;
}

static const float *paint_of(const Light *light, const SurfacePoint *point) {
    float part = (point->value - light->field_min) * light->field_scale;
    part = part > 0.0f ? fminf(part, 1.0f) : 0.0f;
    return light->colors[(int)(part * (COLOR_MAP_SIZE - 1) + 0.5f)];
}

/* How bright paint is (factor) and what shines on it (added, of 255) where the normal is u, v, w. */
static inline void shade(const Light *light, float u, float v, float w, float *factor, float *added) {
    const float *sun = light->to_sun;
    float towards = u * sun[0] + v * sun[1] + w * sun[2], lit = 0.5f + 0.5f * towards;
    float mirrored = 2.0f * towards * w - sun[2], shine = mirrored > 0.0f ? mirrored : 0.0f;
    shine *= shine;
    shine *= shine;
    shine *= shine; /* to the 8th */
    shine *= shine * shine;
    *factor = (0.55f + 0.75f * lit * lit) * (0.70f + 0.30f * w);
    *added = 255.0f * (0.03f + 0.12f * shine);
}

static void load(const Frame *frame, Band *band) {
    const FrameBlock *block = &frame->block;
    float near_plane = block->lens[2], far_plane = block->lens[3];
    for (int y = band->from; y < band->to; y++) {
        size_t row = (size_t)(y - band->from) * (size_t)band->stride;
        size_t image_row = (size_t)y * (size_t)frame->width;
        const uint8_t(*in)[4] = (const uint8_t(*)[4])frame->memory[IMAGE_READ] + image_row;
        const float *buffer = frame->mesh_depth + image_row;
        for (int x = 0; x < frame->width; x++) {
            for (int k = 0; k < 3; k++)
                band->rgb[k][row + (size_t)x] = (float)in[x][k];
            float at = far_plane + near_plane - (2.0f * buffer[x] - 1.0f) * (far_plane - near_plane);
            band->depth[row + (size_t)x] = 2.0f * near_plane * far_plane / at;
            band->owner[row + (size_t)x] = NOBODY;
        }
    }
}

static void shade_opaque(const Frame *frame, const Light *light, Band *band) {
    const SplatDisc *discs = frame->body_discs.discs;
    for (int y = band->from; y < band->to; y++)
        for (int x = 0; x < frame->width; x++) {
            size_t at = (size_t)(y - band->from) * (size_t)band->stride + (size_t)x;
            if (band->owner[at] == NOBODY)
                continue;
            const SplatDisc *disc = &discs[band->owner[at]];
            const float *paint = paint_of(light, &frame->surface.body.points[disc->source]);
            float u = ((float)x + 0.5f - disc->x) / disc->size, v = ((float)y + 0.5f - disc->y) / disc->size;
            float w = sqrtf(fmaxf(1.0f - u * u - v * v, 0.0f)), factor, added;
            shade(light, u, v, w, &factor, &added);
            for (int k = 0; k < 3; k++)
                band->rgb[k][at] = fminf(paint[k] * factor + added, 255.0f);
        }
}

static void blend_row(const Light *light, const SplatDisc *disc, const SurfacePoint *point, float v,
                      const int span[2], const Band *band, size_t row) {
    const float *paint = paint_of(light, point);
    const float *restrict depth = band->depth + row;
    float *restrict r = band->rgb[0] + row, *restrict g = band->rgb[1] + row,
                    *restrict b = band->rgb[2] + row;
    float inv = 1.0f / disc->size, rest = 1.0f - v * v, red = paint[0], green = paint[1], blue = paint[2];
#pragma omp simd
    for (int x = span[0]; x < span[1]; x++) {
        float u = ((float)x + 0.5f - disc->x) * inv, h = rest - u * u, w = sqrtf(h > 0.0f ? h : 0.0f);
        float factor, added, part = disc->depth < depth[x] ? point->fade : 0.0f;
        shade(light, u, v, w, &factor, &added);
        r[x] += (red * factor + added - r[x]) * part;
        g[x] += (green * factor + added - g[x]) * part;
        b[x] += (blue * factor + added - b[x]) * part;
    }
}

static void blend_fading(const Frame *frame, const Light *light, const Band *band) {
    const Splat *splat = &frame->fading_discs;
    for (uint32_t i = 0; i < splat->count; i++) {
        const SplatDisc *disc = &splat->discs[i];
        int low = (int)fmaxf(floorf(disc->y - disc->size), (float)band->from), span[2];
        int high = (int)fminf(ceilf(disc->y + disc->size), (float)band->to);
        for (int y = low; y < high; y++)
            if (splat_span(disc, frame->width, y, &span[0], &span[1]))
                blend_row(light, disc, &frame->surface.fading.points[disc->source],
                          ((float)y + 0.5f - disc->y) / disc->size, span, band,
                          (size_t)(y - band->from) * (size_t)band->stride);
    }
}

static void store(Frame *frame, const Band *band) {
    for (int y = band->from; y < band->to; y++) {
        size_t row = (size_t)(y - band->from) * (size_t)band->stride;
        uint8_t(*out)[4] = (uint8_t(*)[4])frame->memory[IMAGE_READ] + (size_t)y * (size_t)frame->width;
        for (int x = 0; x < frame->width; x++)
            for (int k = 0; k < 3; k++)
                out[x][k] = (uint8_t)(fminf(band->rgb[k][row + (size_t)x], 255.0f) + 0.5f);
    }
}

static bool project(Frame *frame, Err *err) {
    SplatView view = {.view = frame->block.view,
                      .lens = frame->block.lens,
                      .width = frame->width,
                      .height = frame->height,
                      .radius = 0.5f * frame->block.sphere[3]};
    return splat_project(&frame->body_discs, &frame->surface.body, &view, err) &&
           splat_project(&frame->fading_discs, &frame->surface.fading, &view, err);
}

static bool draw(Pass *pass, Frame *frame, Err *err) {
    (void)pass;
    enum { PLANES = 5 };
    int stride = splat_stride(frame->width), threads = omp_get_max_threads();
    size_t plane = (size_t)stride * SPLAT_BAND, size = (size_t)threads * PLANES * plane * sizeof(float);
    if (!project(frame, err) || !buffer_reserve(&frame->band_memory, "bands of the picture", size, err))
        return false;
    const Light light = make_light(&frame->block);
    int bands = (frame->height + SPLAT_BAND - 1) / SPLAT_BAND;
#pragma omp parallel for schedule(dynamic, 1) num_threads(threads)
    for (int i = 0; i < bands; i++) {
        float *own = (float *)frame->band_memory.data + (size_t)omp_get_thread_num() * PLANES * plane;
        int from = i * SPLAT_BAND, to = from + SPLAT_BAND < frame->height ? from + SPLAT_BAND : frame->height;
        Band band = {from, to, stride, own, {own + plane, own + 2 * plane, own + 3 * plane}, NULL};
        band.owner = (uint32_t *)(void *)(own + 4 * plane);
        load(frame, &band);
        splat_rows(&frame->body_discs, frame->width, from, to, band.depth, band.owner);
        shade_opaque(frame, &light, &band);
        blend_fading(frame, &light, &band);
        store(frame, &band);
    }
    return true;
}

const PassType sphere_pass = {"spheres", PASS_IN_PARTICLES, IMAGE_READ, NULL, draw};
