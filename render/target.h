/* Textures and framebuffers that passes draw into. */
#ifndef SKIFF_TARGET_H
#define SKIFF_TARGET_H

#include "gl.h"

typedef struct Texture {
    GLuint id;
    int width, height;
} Texture;

/* Storage formats; `target.c` has the one table of what GL calls them. */
typedef enum TextureFormat {
    TEXTURE_RGBA8,
    TEXTURE_RG16F,
    TEXTURE_RGBA16F,
    TEXTURE_R32F,
    TEXTURE_DEPTH32F,
    TEXTURE_FORMAT_COUNT
} TextureFormat;

typedef enum TextureSampling { TEXTURE_NEAREST, TEXTURE_LINEAR, TEXTURE_REPEAT_MIPMAP } TextureSampling;

/* pixels NULL: undefined content. Mipmaps are made at once from the pixels. */
Texture texture_create(const Gl *gl, TextureFormat format, int width, int height, TextureSampling sampling,
                       const void *pixels);
/* Replaces size and content. */
void texture_update(const Gl *gl, Texture *texture, TextureFormat format, int width, int height,
                    const void *pixels);
void texture_destroy(const Gl *gl, Texture *texture);
void texture_bind(const Gl *gl, int unit, const Texture *texture);

/* A framebuffer does not own its textures. `depth` may be NULL. 0 with ERR_GL when the driver refuses it. */
GLuint framebuffer_create(const Gl *gl, const Texture *color, const Texture *depth, Err *err);
/* Binds it and sets the viewport to the texture's size. */
void framebuffer_bind(const Gl *gl, GLuint framebuffer, const Texture *color);

#endif
