/* Glyphs by stb_truetype from a font that is part of the program: DejaVu Sans, whose licence allows it, has
 * digits of equal width, so that numbers do not shake, and reads well when small. A font file found at run
 * time would make pictures differ between machines and fail on bare ones; the build needs the file once.
 *
 * Each glyph is drawn at four positions between two pixels, and the nearest is taken: letters keep even
 * distances without hinting. No kerning, no shaping, ASCII only. */
#include "text.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define STB_TRUETYPE_IMPLEMENTATION
#define STBTT_STATIC
#include <stb/stb_truetype.h>

enum { FIRST = 32, COUNT = 95, SHIFTS = 4 };

/* The file's bytes, by the assembler: as a C array they would take the compiler seconds. */
__asm__(".pushsection .rodata\n"
        ".global text_font_begin\n"
        "text_font_begin:\n"
        ".incbin \"" TEXT_FONT_FILE "\"\n"
        ".byte 0\n"
        ".popsection\n");
extern const unsigned char text_font_begin[];

typedef struct Glyph {
    unsigned char *coverage; /* NULL: a blank */
    int width, height, left, top;
} Glyph;

struct TextFont {
    float cap_height;
    float advance[COUNT];
    Glyph glyphs[COUNT][SHIFTS];
};

TextFont *text_font_create(float size, Err *err) {
    stbtt_fontinfo info;
    TextFont *font = calloc(1, sizeof *font);
    if (!font || !stbtt_InitFont(&info, text_font_begin, 0)) {
        err_set(err, ERR_IO, "not enough memory for the font");
        free(font);
        return NULL;
    }
    float scale = stbtt_ScaleForPixelHeight(&info, size);
    int x0, y0, x1, y1;
    stbtt_GetCodepointBox(&info, 'H', &x0, &y0, &x1, &y1);
    font->cap_height = scale * (float)y1;
    for (int i = 0; i < COUNT; i++) {
        int advance, bearing;
        stbtt_GetCodepointHMetrics(&info, FIRST + i, &advance, &bearing);
        font->advance[i] = scale * (float)advance;
        for (int s = 0; s < SHIFTS; s++) {
            Glyph *glyph = &font->glyphs[i][s];
            glyph->coverage =
                stbtt_GetCodepointBitmapSubpixel(&info, scale, scale, (float)s / SHIFTS, 0, FIRST + i,
                                                 &glyph->width, &glyph->height, &glyph->left, &glyph->top);
        }
    }
    return font;
}

void text_font_destroy(TextFont *font) {
    if (!font)
        return;
    for (int i = 0; i < COUNT; i++)
        for (int s = 0; s < SHIFTS; s++)
            stbtt_FreeBitmap(font->glyphs[i][s].coverage, NULL);
    free(font);
}

static int glyph_index(char c) {
    int i = (unsigned char)c - FIRST;
    return i >= 0 && i < COUNT ? i : '?' - FIRST;
}

float text_width(const TextFont *font, const char *text) {
    float width = 0;
    for (; *text; text++)
        width += font->advance[glyph_index(*text)];
    return width;
}

float text_cap_height(const TextFont *font) {
    return font->cap_height;
}

void text_blend(GfxImage image, int x, int y, GfxInk ink, float coverage) {
    if (x < 0 || y < 0 || x >= image.width || y >= image.height)
        return;
    uint8_t *p = image.rgb + 3 * ((size_t)y * (size_t)image.width + (size_t)x);
    const uint8_t color[3] = {ink.r, ink.g, ink.b};
    float a = ink.alpha * coverage;
    for (int k = 0; k < 3; k++)
        p[k] = (uint8_t)lrintf((float)p[k] + a * (float)(color[k] - p[k]));
}

static void draw_glyph(const Glyph *glyph, GfxImage image, int x, int y, GfxInk ink) {
    for (int j = 0; j < glyph->height; j++)
        for (int i = 0; i < glyph->width; i++) {
            unsigned char c = glyph->coverage[j * glyph->width + i];
            if (c)
                text_blend(image, x + glyph->left + i, y + glyph->top + j, ink, (float)c / 255);
        }
}

float text_draw(const TextFont *font, GfxImage image, float x, float y, GfxInk ink, const char *text) {
    for (; *text; text++) {
        int i = glyph_index(*text);
        int quarters = (int)floorf(x * SHIFTS + 0.5f);
        int column = quarters >= 0 ? quarters / SHIFTS : -((SHIFTS - 1 - quarters) / SHIFTS);
        const Glyph *glyph = &font->glyphs[i][quarters - column * SHIFTS];
        if (glyph->coverage)
            draw_glyph(glyph, image, column, (int)floorf(y + 0.5f), ink);
        x += font->advance[i];
    }
    return x;
}
