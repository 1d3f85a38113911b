/* The pictures that passes hand to each other: one table of formats, and their translation for the eye. */
#include "pass.h"

#include <math.h>
#include <stdlib.h>

enum { SKY_EDGE = 512 };

/* How an image is shown. */
typedef enum Shown { SHOWN_COLOR, SHOWN_VECTOR, SHOWN_AMOUNT, SHOWN_DEPTH, SHOWN_NOT } Shown;

static const struct {
    TextureFormat format;
    TextureSampling sampling;
    int divisor; /* of the frame's size; 0: SKY_EDGE x SKY_EDGE */
    unsigned looks;
    Shown shown;
} table[IMAGE_COUNT] = {
    [IMAGE_SKY] = {TEXTURE_RGBA8, TEXTURE_LINEAR, 0, PASS_IN_WATER | PASS_IN_PARTICLES, SHOWN_COLOR},
    [IMAGE_MESH] = {TEXTURE_RGBA8, TEXTURE_LINEAR, 1, PASS_IN_WATER | PASS_IN_PARTICLES, SHOWN_COLOR},
    [IMAGE_MESH_DEPTH] = {TEXTURE_DEPTH32F, TEXTURE_NEAREST, 1, PASS_IN_WATER | PASS_IN_PARTICLES, SHOWN_NOT},
    [IMAGE_REFLECTION] = {TEXTURE_RGBA8, TEXTURE_LINEAR, 2, PASS_IN_WATER, SHOWN_COLOR},
    [IMAGE_REFLECTION_DEPTH] = {TEXTURE_DEPTH32F, TEXTURE_NEAREST, 2, PASS_IN_WATER, SHOWN_NOT},
    [IMAGE_DEPTH] = {TEXTURE_R32F, TEXTURE_NEAREST, 2, PASS_IN_WATER, SHOWN_DEPTH},
    [IMAGE_DEPTH_WORK] = {TEXTURE_R32F, TEXTURE_NEAREST, 2, PASS_IN_WATER, SHOWN_DEPTH},
    [IMAGE_NORMAL] = {TEXTURE_RGBA16F, TEXTURE_LINEAR, 2, PASS_IN_WATER, SHOWN_VECTOR},
    [IMAGE_THICKNESS] = {TEXTURE_RG16F, TEXTURE_LINEAR, 4, PASS_IN_WATER, SHOWN_AMOUNT},
    [IMAGE_COMPOSED] = {TEXTURE_RGBA8, TEXTURE_LINEAR, 1, PASS_IN_WATER, SHOWN_COLOR},
    [IMAGE_FINISHED] = {TEXTURE_RGBA8, TEXTURE_NEAREST, 1, PASS_IN_WATER | PASS_IN_PARTICLES, SHOWN_COLOR},
};

bool images_create(Frame *frame, Err *err) {
    for (int id = 0; id < IMAGE_COUNT; id++) {
        int divisor = table[id].divisor;
        if (!(table[id].looks & 1u << frame->def.look))
            continue;
        int width = divisor ? (frame->width + divisor - 1) / divisor : SKY_EDGE;
        int height = divisor ? (frame->height + divisor - 1) / divisor : SKY_EDGE;
        frame->images[id] =
            texture_create(frame->gl, table[id].format, width, height, table[id].sampling, NULL);
    }
    return gl_check(frame->gl, "images", err);
}

void images_destroy(Frame *frame) {
    for (int id = 0; id < IMAGE_COUNT; id++)
        texture_destroy(frame->gl, &frame->images[id]);
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

bool images_show(Frame *frame, ImageId id, uint8_t *rgb, Err *err) {
    const Gl *gl = frame->gl;
    const Texture *image = &frame->images[id];
    size_t count = (size_t)image->width * (size_t)image->height;
    float *pixels = malloc(count * sizeof(float[4]));
    if (!pixels)
        return err_set(err, ERR_GL, "no memory to read an image back");
    GLuint framebuffer = framebuffer_create(gl, image, NULL, err);
    if (framebuffer) {
        gl->PixelStorei(GL_PACK_ALIGNMENT, 1);
        gl->ReadPixels(0, 0, image->width, image->height, GL_RGBA, GL_FLOAT, pixels);
        gl->DeleteFramebuffers(1, &framebuffer);
        for (int y = 0; y < frame->def.height; y++)
            for (int x = 0; x < frame->def.width; x++) {
                int from_x = x * image->width / frame->def.width;
                int from_y = image->height - 1 - y * image->height / frame->def.height;
                const float *in = pixels + 4 * ((size_t)from_y * (size_t)image->width + (size_t)from_x);
                show_pixel(table[id].shown, in, rgb + 3 * ((size_t)y * (size_t)frame->def.width + (size_t)x));
            }
    }
    free(pixels);
    return framebuffer && gl_check(gl, "reading an image back", err);
}
