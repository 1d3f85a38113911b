/* The legend of the look "particles": the colour map with its title, unit and numbers, in the lower left
 * corner. Drawn on the CPU into the finished picture. */
#include "pass.h"

#include "tables.h"
#include "text.h"

#include <stdio.h>

enum { TICKS = 5 };

typedef struct Box {
    int left, top, width, height;
} Box;

static void fill(GfxImage image, Box box, GfxInk ink) {
    for (int y = box.top; y < box.top + box.height; y++)
        for (int x = box.left; x < box.left + box.width; x++)
            text_blend(image, x, y, ink, 1.0f);
}

static void draw_bar(GfxImage image, Box bar) {
    for (int x = 0; x < bar.width; x++) {
        uint8_t rgb[3];
        tables_color((float)x / (float)(bar.width - 1), rgb);
        fill(image, (Box){bar.left + x, bar.top, 1, bar.height}, (GfxInk){rgb[0], rgb[1], rgb[2], 1.0f});
    }
}

static void draw_numbers(const TextFont *font, GfxImage image, Box bar, const GfxField *field, float base) {
    static const GfxInk ink = {225, 230, 236, 1.0f};
    for (int i = 0; i < TICKS; i++) {
        float part = (float)i / (TICKS - 1), x = (float)bar.left + part * (float)(bar.width - 1);
        double value = (double)field->min + (double)part * ((double)field->max - (double)field->min);
        char text[32];
        /* What is zero but for rounding reads 0. */
        double span = (double)field->max - (double)field->min;
        snprintf(text, sizeof text, "%.3g", value < 1e-6 * span && value > -1e-6 * span ? 0.0 : value);
        fill(image, (Box){(int)x, bar.top + bar.height, 1, bar.height / 3}, ink);
        text_draw(font, image, x - 0.5f * text_width(font, text), base, ink, text);
    }
}

static bool draw(Pass *pass, Frame *frame, Err *err) {
    (void)pass;
    const GfxField *field = &frame->scene->field;
    if (!field->title)
        return true;
    GfxImage image = {frame->rgb, frame->def.width, frame->def.height};
    float size = 0.025f * (float)image.height + 4.0f;
    TextFont *font = text_font_create(size, err);
    if (!font)
        return false;
    int line = (int)(1.5f * size), pad = (int)(0.9f * size);
    char title[128];
    bool unit = field->unit && field->unit[0];
    snprintf(title, sizeof title, unit ? "%s  [%s]" : "%s", field->title, unit ? field->unit : "");
    Box box = {pad, image.height - pad - 3 * line - pad, 17 * line / 2, 3 * line + pad};
    int needed = (int)text_width(font, title) + 2 * pad + 1;
    box.width = needed > box.width ? needed : box.width;
    if (box.width > image.width - 2 * pad)
        box.width = image.width - 2 * pad;
    Box bar = {box.left + pad, box.top + pad / 2 + line, box.width - 2 * pad, line / 2};
    fill(image, box, (GfxInk){12, 16, 22, 0.62f});
    text_draw(font, image, (float)bar.left, (float)(box.top + line), (GfxInk){240, 243, 247, 1.0f}, title);
    if (bar.width > 1) {
        draw_bar(image, bar);
        draw_numbers(font, image, bar, field, (float)(bar.top + bar.height + line));
    }
    text_font_destroy(font);
    return true;
}

const PassType legend_pass = {"legend", PASS_IN_PARTICLES, -1, NULL, draw};
