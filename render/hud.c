/* Three groups on dark translucent plates: time and counts (top left), speed, throttle and rudder (bottom
 * left), pressed keys (bottom right). Drawn on the CPU after the picture has been read back: about 1 ms at
 * 720p, and the same pixels whatever draws the scene.
 *
 * Shapes are rounded boxes; a pixel's coverage is taken from the signed distance of its centre. Lengths below
 * are px at a height of 720. */
#include "hud.h"

#include <ctype.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const GfxInk plate_ink = {6, 14, 22, 0.55f}, track_ink = {255, 255, 255, 0.20f};
static const GfxInk text_ink = {244, 248, 250, 1.0f}, faint_ink = {196, 211, 221, 1.0f};
static const GfxInk accent_ink = {255, 178, 62, 1.0f}, reverse_ink = {112, 190, 255, 1.0f};
static const GfxInk key_ink = {248, 250, 252, 0.92f}, key_text_ink = {18, 28, 38, 1.0f};
static const float margin = 18, padding = 14, corner = 9;

struct GfxHud {
    float unit; /* px of one px at a height of 720 */
    TextFont *big, *middle, *small;
};

typedef struct Canvas {
    const GfxHud *hud;
    GfxImage image;
    float unit;
} Canvas;

GfxHudValues gfx_hud_nothing(void) {
    return (GfxHudValues){.time = NAN,
                          .speed = NAN,
                          .throttle = NAN,
                          .rudder = NAN,
                          .particles = NAN,
                          .moves = -1,
                          .step_ms = NAN};
}

GfxHud *gfx_hud_create(int height, Err *err) {
    GfxHud *hud = calloc(1, sizeof *hud);
    if (!hud) {
        err_set(err, ERR_IO, "not enough memory for the figures in the picture");
        return NULL;
    }
    hud->unit = (float)height / 720;
    hud->big = text_font_create(44 * hud->unit, err);
    hud->middle = hud->big ? text_font_create(22 * hud->unit, err) : NULL;
    hud->small = hud->middle ? text_font_create(16.5f * hud->unit, err) : NULL;
    if (!hud->small) {
        gfx_hud_destroy(hud);
        return NULL;
    }
    return hud;
}

void gfx_hud_destroy(GfxHud *hud) {
    if (!hud)
        return;
    text_font_destroy(hud->big);
    text_font_destroy(hud->middle);
    text_font_destroy(hud->small);
    free(hud);
}

/* A box with round corners, lengths in units. */
static void box(const Canvas *canvas, float x, float y, float width, float height, float radius, GfxInk ink) {
    float u = canvas->unit;
    float hx = 0.5f * width * u, hy = 0.5f * height * u, r = fminf(radius * u, fminf(hx, hy));
    float cx = x * u + hx, cy = y * u + hy;
    for (int j = (int)floorf(cy - hy) - 1; j <= (int)ceilf(cy + hy); j++)
        for (int i = (int)floorf(cx - hx) - 1; i <= (int)ceilf(cx + hx); i++) {
            float dx = fabsf((float)i + 0.5f - cx) - hx + r, dy = fabsf((float)j + 0.5f - cy) - hy + r;
            float distance = hypotf(fmaxf(dx, 0), fmaxf(dy, 0)) + fminf(fmaxf(dx, dy), 0) - r;
            float coverage = 0.5f - distance;
            if (coverage > 0)
                text_blend(canvas->image, i, j, ink, fminf(coverage, 1));
        }
}

/* (x, y): left end of the base line, in units. Returns the right end. */
static float write_at(const Canvas *canvas, const TextFont *font, float x, float y, GfxInk ink,
                      const char *text) {
    return text_draw(font, canvas->image, x * canvas->unit, y * canvas->unit, ink, text) / canvas->unit;
}

static float width_of(const Canvas *canvas, const TextFont *font, const char *text) {
    return text_width(font, text) / canvas->unit;
}

/* 204396 -> "204 396" */
static void group_digits(double value, char *out, size_t size) {
    char digits[32];
    int count = snprintf(digits, sizeof digits, "%.0f", value), used = 0;
    for (int i = 0; i < count && (size_t)used + 2 < size; i++) {
        if (i > 0 && (count - i) % 3 == 0)
            out[used++] = ' ';
        out[used++] = digits[i];
    }
    out[used] = '\0';
}

/* ---- Time and counts ---- */

enum { LINES = 3, LINE_SIZE = 64 };

static void draw_counts(const Canvas *canvas, const GfxHudValues *values) {
    char lines[LINES][LINE_SIZE], clock[LINE_SIZE] = "";
    int count = 0;
    if (!isnan(values->particles)) {
        char number[48];
        group_digits(values->particles, number, sizeof number);
        snprintf(lines[count++], LINE_SIZE, "%s particles", number);
    }
    if (values->moves >= 0)
        snprintf(lines[count++], LINE_SIZE, "%ld window move%s", values->moves,
                 values->moves == 1 ? "" : "s");
    if (!isnan(values->step_ms))
        snprintf(lines[count++], LINE_SIZE, "%.1f ms a step", values->step_ms);
    if (!isnan(values->time))
        snprintf(clock, sizeof clock, "%.2f s", values->time);
    if (count == 0 && !*clock)
        return;
    float width = width_of(canvas, canvas->hud->middle, clock);
    for (int i = 0; i < count; i++)
        width = fmaxf(width, width_of(canvas, canvas->hud->small, lines[i]));
    width = fmaxf(width, 132); /* a plate that grows with every digit would catch the eye */
    float head = *clock ? 24 : 0, height = head + 20 * (float)count + 2 * padding - 8;
    box(canvas, margin, margin, width + 2 * padding, height, corner, plate_ink);
    float x = margin + padding, y = margin + padding;
    if (*clock)
        write_at(canvas, canvas->hud->middle, x, y + 14, text_ink, clock);
    for (int i = 0; i < count; i++)
        write_at(canvas, canvas->hud->small, x, y + head + 11 + 20 * (float)i, faint_ink, lines[i]);
}

/* ---- Speed, throttle and rudder ---- */

static const float dash_height = 96, speed_width = 132, throttle_width = 70, rudder_width = 138;
static const double knot = 1852.0 / 3600; /* m/s */

static void draw_speed(const Canvas *canvas, float x, float y, double speed) {
    char text[LINE_SIZE];
    snprintf(text, sizeof text, "%.1f", speed);
    float end = write_at(canvas, canvas->hud->big, x, y + 36, text_ink, text);
    write_at(canvas, canvas->hud->small, end + 7, y + 36, faint_ink, "m/s");
    snprintf(text, sizeof text, "%.1f kn", speed / knot);
    write_at(canvas, canvas->hud->middle, x, y + 64, faint_ink, text);
}

static void label_centred(const Canvas *canvas, float centre, float y, const char *text) {
    write_at(canvas, canvas->hud->small, centre - 0.5f * width_of(canvas, canvas->hud->small, text), y,
             faint_ink, text);
}

static void draw_throttle(const Canvas *canvas, float x, float y, double throttle) {
    const float length = 50, width = 12;
    float left = x + 0.5f * (throttle_width - width) - 10, middle = y + 0.5f * length;
    float fill = 0.5f * length * (float)fmin(1, fabs(throttle));
    box(canvas, left, y, width, length, 6, track_ink);
    if (throttle > 0)
        box(canvas, left, middle - fill, width, fill, 3, accent_ink);
    else if (throttle < 0)
        box(canvas, left, middle, width, fill, 3, reverse_ink);
    box(canvas, left - 3, middle - 0.75f, width + 6, 1.5f, 0.5f, faint_ink);
    label_centred(canvas, left + 0.5f * width, y + 66, "throttle");
}

static void draw_rudder(const Canvas *canvas, float x, float y, double rudder) {
    const float length = 104, height = 12;
    float centre = x + 0.5f * rudder_width - 6, top = y + 20;
    float at = centre + 0.5f * (length - height) * (float)fmax(-1, fmin(1, rudder));
    box(canvas, centre - 0.5f * length, top, length, height, 6, track_ink);
    box(canvas, fminf(centre, at), top + 4, fabsf(at - centre), 4, 2, accent_ink);
    box(canvas, centre - 0.75f, top - 3, 1.5f, height + 6, 0.5f, faint_ink);
    box(canvas, at - 8, top - 2, 16, 16, 8, accent_ink);
    label_centred(canvas, centre, y + 66, "rudder");
}

static void draw_dash(const Canvas *canvas, const GfxHudValues *values) {
    bool speed = !isnan(values->speed), throttle = !isnan(values->throttle), rudder = !isnan(values->rudder);
    float width = (speed ? speed_width : 0) + (throttle ? throttle_width : 0) + (rudder ? rudder_width : 0);
    if (width == 0)
        return;
    float all = (float)canvas->image.width / canvas->unit;
    float x = values->has_legend ? 0.5f * (all - width - padding) : margin, y = 720 - margin - dash_height;
    box(canvas, x, y, width + padding, dash_height, corner, plate_ink);
    x += padding;
    y += padding;
    if (speed)
        draw_speed(canvas, x, y, values->speed);
    x += speed ? speed_width : 0;
    if (throttle)
        draw_throttle(canvas, x, y, values->throttle);
    x += throttle ? throttle_width : 0;
    if (rudder)
        draw_rudder(canvas, x, y, values->rudder);
}

/* ---- Keys ---- */

/* From the right edge to the left, so that the last one stays where it is. */
static void draw_keys(const Canvas *canvas, const char *keys) {
    const float size = 34, gap = 7;
    float right = (float)canvas->image.width / canvas->unit - margin, y = 720 - margin - size;
    for (const char *end = keys + strlen(keys); end > keys;) {
        while (end > keys && end[-1] == ' ')
            end--;
        const char *begin = end;
        while (begin > keys && begin[-1] != ' ')
            begin--;
        char name[24];
        int count = 0;
        for (const char *c = begin; c < end && count + 1 < (int)sizeof name; c++)
            name[count++] = (char)toupper((unsigned char)*c);
        name[count] = '\0';
        if (count > 0) {
            float text = width_of(canvas, canvas->hud->small, name), width = fmaxf(size, text + 18);
            box(canvas, right - width, y, width, size, 7, key_ink);
            write_at(canvas, canvas->hud->small, right - 0.5f * (width + text), y + 23, key_text_ink, name);
            right -= width + gap;
        }
        end = begin;
    }
}

void gfx_hud_draw(const GfxHud *hud, GfxImage image, const GfxHudValues *values) {
    Canvas canvas = {hud, image, hud->unit};
    draw_counts(&canvas, values);
    draw_dash(&canvas, values);
    if (values->keys)
        draw_keys(&canvas, values->keys);
}
