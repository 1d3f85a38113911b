/* A band of rows is drawn by one thread, all discs in their order: the nearest depth does not depend on the
 * number of threads, and of equal depths the first disc wins. */
#include "splat.h"

#include <math.h>

static bool project(const SurfacePoint *point, const SplatView *view, SplatDisc *disc) {
    const float *m = view->view, *p = point->position;
    float radius = view->radius * (view->fade_shrinks ? sqrtf(point->fade) : 1.0f);
    float y = p[1] - radius * view->lowered, at[3];
    for (int k = 0; k < 3; k++)
        at[k] = m[k] * p[0] + m[4 + k] * y + m[8 + k] * p[2] + m[12 + k];
    float depth = -at[2];
    if (!(depth > view->lens[2]))
        return false;
    float width = (float)view->width, height = (float)view->height;
    float up = height / (2.0f * view->lens[1] * depth), along = width / (2.0f * view->lens[0] * depth);
    disc->x = 0.5f * width + at[0] * along;
    disc->y = 0.5f * height + at[1] * up;
    disc->size = fmaxf(radius * up, 0.5f);
    disc->depth = depth;
    disc->radius = radius;
    return disc->x + disc->size > 0.0f && disc->x - disc->size < width && disc->y + disc->size > 0.0f &&
           disc->y - disc->size < height;
}

bool splat_project(Splat *splat, const SurfaceList *points, const SplatView *view, Err *err) {
    size_t size = ((size_t)points->count + 1) * sizeof *splat->discs;
    if (!buffer_reserve(&splat->memory, "discs", size, err))
        return false;
    splat->discs = splat->memory.data;
    splat->count = 0;
    for (uint32_t i = 0; i < points->count; i++) {
        SplatDisc *disc = &splat->discs[splat->count];
        disc->source = i;
        splat->count += project(&points->points[i], view, disc);
    }
    return true;
}

bool splat_span(const SplatDisc *disc, int width, int y, int *first, int *end) {
    float dy = ((float)y + 0.5f - disc->y) / disc->size, rest = 1.0f - dy * dy;
    if (rest <= 0.0f)
        return false;
    float half = disc->size * sqrtf(rest);
    *first = (int)fmaxf(ceilf(disc->x - half - 0.5f), 0.0f);
    *end = (int)fminf(floorf(disc->x + half - 0.5f) + 1.0f, (float)width);
    return *first < *end;
}

/* Whole groups of pixels, so that the compiler has vectors without remainders; what lies beyond the disc
 * stays. Inlined, so that the form without owners has no trace of them. */
static inline void draw_disc(const SplatDisc *disc, float dy, int first, int end, float *restrict depth,
                             uint32_t *restrict owner, uint32_t number) {
    float inv = 1.0f / disc->size, rest = 1.0f - dy * dy, left = ((float)first + 0.5f - disc->x) * inv;
    for (int x = first; x < end; x += SPLAT_LANES, left += (float)SPLAT_LANES * inv)
#pragma omp simd
        for (int k = 0; k < SPLAT_LANES; k++) {
            float u = left + (float)k * inv, h = rest - u * u;
            float z = disc->depth - disc->radius * sqrtf(h > 0.0f ? h : 0.0f), old = depth[x + k];
            z = h > 0.0f ? z : old;
            if (owner)
                owner[x + k] = z < old ? number : owner[x + k];
            depth[x + k] = z < old ? z : old;
        }
}

void splat_rows(const Splat *splat, int width, int from, int to, float *depth, uint32_t *owner) {
    size_t stride = (size_t)splat_stride(width);
    for (uint32_t i = 0; i < splat->count; i++) {
        const SplatDisc *disc = &splat->discs[i];
        if (disc->y + disc->size < (float)from || disc->y - disc->size > (float)to)
            continue;
        int low = (int)fmaxf(floorf(disc->y - disc->size), (float)from);
        int high = (int)fminf(ceilf(disc->y + disc->size), (float)to), first, end;
        for (int y = low; y < high; y++) {
            if (!splat_span(disc, width, y, &first, &end))
                continue;
            float dy = ((float)y + 0.5f - disc->y) / disc->size;
            float *row = depth + (size_t)(y - from) * stride;
            if (owner)
                draw_disc(disc, dy, first, end, row, owner + (size_t)(y - from) * stride, i);
            else
                draw_disc(disc, dy, first, end, row, NULL, i);
        }
    }
}
