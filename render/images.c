/* The pictures that passes hand to each other: one table of formats, and their translation for the eye. */
#include "pass.h"

#include <math.h>
#include <stdlib.h>

enum { SKY_EDGE = 512 };

/* How an image is shown. */
typedef enum Shown { SHOWN_COLOR, SHOWN_VECTOR, SHOWN_AMOUNT, SHOWN_DEPTH, SHOWN_NOT } Shown;

/* Where it is kept. */
typedef enum Place { IN_TEXTURE, IN_MEMORY } Place;

static const struct {
    TextureFormat format;
    TextureSampling sampling;
    int divisor; /* of the frame's size; 0: SKY_EDGE x SKY_EDGE */
    unsigned looks;
    Shown shown;
    Place place;
} table[IMAGE_COUNT] = {
    [IMAGE_SKY] = {TEXTURE_RGBA8, TEXTURE_LINEAR, 0, PASS_IN_WATER | PASS_IN_PARTICLES, SHOWN_COLOR,
                   IN_TEXTURE},
    [IMAGE_MESH] = {TEXTURE_RGBA8, TEXTURE_LINEAR, 1, PASS_IN_WATER | PASS_IN_PARTICLES, SHOWN_COLOR,
                    IN_TEXTURE},
    [IMAGE_MESH_DEPTH] = {TEXTURE_DEPTH32F, TEXTURE_NEAREST, 1, PASS_IN_WATER | PASS_IN_PARTICLES, SHOWN_NOT,
                          IN_TEXTURE},
    [IMAGE_REFLECTION] = {TEXTURE_RGBA8, TEXTURE_LINEAR, 2, PASS_IN_WATER, SHOWN_COLOR, IN_TEXTURE},
    [IMAGE_REFLECTION_DEPTH] = {TEXTURE_DEPTH32F, TEXTURE_NEAREST, 2, PASS_IN_WATER, SHOWN_NOT, IN_TEXTURE},
    [IMAGE_DEPTH] = {TEXTURE_R32F, TEXTURE_NEAREST, 2, PASS_IN_WATER, SHOWN_DEPTH, IN_MEMORY},
    [IMAGE_SMOOTH] = {TEXTURE_R32F, TEXTURE_NEAREST, 2, PASS_IN_WATER, SHOWN_DEPTH, IN_TEXTURE},
    [IMAGE_NORMAL] = {TEXTURE_RGBA16F, TEXTURE_LINEAR, 2, PASS_IN_WATER, SHOWN_VECTOR, IN_TEXTURE},
    [IMAGE_THICKNESS] = {TEXTURE_RG16F, TEXTURE_LINEAR, 4, PASS_IN_WATER, SHOWN_AMOUNT, IN_TEXTURE},
    [IMAGE_COMPOSED] = {TEXTURE_RGBA8, TEXTURE_LINEAR, 1, PASS_IN_WATER, SHOWN_COLOR, IN_TEXTURE},
    [IMAGE_READ] = {TEXTURE_RGBA8, TEXTURE_NEAREST, 1, PASS_IN_WATER | PASS_IN_PARTICLES, SHOWN_COLOR,
                    IN_MEMORY},
    [IMAGE_FINISHED] = {TEXTURE_RGBA8, TEXTURE_NEAREST, 1, PASS_IN_WATER | PASS_IN_PARTICLES, SHOWN_COLOR,
                        IN_MEMORY},
};

static size_t pixel_size(ImageId id) {
    return table[id].format == TEXTURE_R32F ? sizeof(float) : sizeof(uint8_t[4]);
}

bool images_create(Frame *frame, Err *err) {
    for (int id = 0; id < IMAGE_COUNT; id++) {
        int divisor = table[id].divisor;
        if (!(table[id].looks & 1u << frame->def.look))
            continue;
        int width = divisor ? (frame->width + divisor - 1) / divisor : SKY_EDGE;
        int height = divisor ? (frame->height + divisor - 1) / divisor : SKY_EDGE;
        if (table[id].place == IN_TEXTURE) {
            frame->images[id] =
                texture_create(frame->gl, table[id].format, width, height, table[id].sampling, NULL);
            continue;
        }
        frame->images[id] = (Texture){0, width, height};
        frame->memory[id] = calloc((size_t)width * (size_t)height, pixel_size((ImageId)id));
        if (!frame->memory[id])
            return err_set(err, ERR_GL, "no memory for an image of %d x %d", width, height);
    }
    return gl_check(frame->gl, "images", err);
}

void images_destroy(Frame *frame) {
    for (int id = 0; id < IMAGE_COUNT; id++) {
        if (frame->images[id].id)
            texture_destroy(frame->gl, &frame->images[id]);
        free(frame->memory[id]);
    }
}

static uint8_t to_byte(float x) {
    return x <= 0.0f ? 0 : x >= 1.0f ? 255 : (uint8_t)(x * 255.0f + 0.5f);
}

/* One pixel (RGBA float as GL gives it) for the eye. */
static void show_pixel(Shown shown, const float in[4], uint8_t out[3]) {
    float shades[3] = {in[0], in[1], in[2]};
    if (shown == SHOWN_VECTOR) {
        shades[0] = 0.5f + 0.5f * in[0];
        shades[1] = 0.5f + 0.5f * in[1];
        shades[2] = in[3];
    } else if (shown == SHOWN_AMOUNT) {
        shades[0] = 1.0f - expf(-2.0f * in[0]);
        shades[1] = 1.0f - expf(-in[1]);
    } else if (shown == SHOWN_DEPTH) {
        /* Grey is still water, nearer is lighter, red is none. */
        bool none = in[0] > 1000.0f;
        shades[0] = none ? 0.5f : 0.5f - 0.4f * in[0];
        shades[1] = shades[2] = none ? 0.0f : shades[0];
    }
    for (int k = 0; k < 3; k++)
        out[k] = to_byte(shades[k]);
}

/* A texture's pixels as RGBA. */
static bool read_texture(const Gl *gl, const Texture *image, float *pixels, Err *err) {
    GLuint framebuffer = framebuffer_create(gl, image, NULL, err);
    if (!framebuffer)
        return false;
    gl->PixelStorei(GL_PACK_ALIGNMENT, 1);
    gl->ReadPixels(0, 0, image->width, image->height, GL_RGBA, GL_FLOAT, pixels);
    gl->DeleteFramebuffers(1, &framebuffer);
    return gl_check(gl, "reading an image back", err);
}

/* The same of an image in memory; of one channel only the first is filled. */
static void read_memory(const Frame *frame, ImageId id, size_t count, float *pixels) {
    bool is_float = table[id].format == TEXTURE_R32F;
    const float *floats = frame->memory[id];
    const uint8_t *bytes = frame->memory[id];
    for (size_t i = 0; i < count; i++)
        for (size_t k = 0; k < 4; k++)
            pixels[4 * i + k] = is_float ? floats[i] : (float)bytes[4 * i + k] / 255.0f;
}

bool images_show(Frame *frame, ImageId id, uint8_t *rgb, Err *err) {
    const Texture *image = &frame->images[id];
    size_t count = (size_t)image->width * (size_t)image->height;
    bool ok = true;
    float *pixels = malloc(count * sizeof(float[4]));
    if (!pixels)
        return err_set(err, ERR_GL, "no memory to read an image back");
    if (table[id].place == IN_MEMORY)
        read_memory(frame, id, count, pixels);
    else
        ok = read_texture(frame->gl, image, pixels, err);
    for (int y = 0; ok && y < frame->def.height; y++)
        for (int x = 0; x < frame->def.width; x++) {
            int from_x = x * image->width / frame->def.width;
            int from_y = image->height - 1 - y * image->height / frame->def.height;
            const float *in = pixels + 4 * ((size_t)from_y * (size_t)image->width + (size_t)from_x);
            show_pixel(table[id].shown, in, rgb + 3 * ((size_t)y * (size_t)frame->def.width + (size_t)x));
        }
    free(pixels);
    return ok;
}
