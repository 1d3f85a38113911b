/* Textures and framebuffers: thin, so that a pass says in one line what it draws into. */
#include "target.h"

static const struct {
    GLint internal;
    GLenum format, type;
} formats[TEXTURE_FORMAT_COUNT] = {
    [TEXTURE_RGBA8] = {GL_RGBA8, GL_RGBA, GL_UNSIGNED_BYTE},
    [TEXTURE_RG16F] = {GL_RG16F, GL_RG, GL_FLOAT},
    [TEXTURE_RGBA16F] = {GL_RGBA16F, GL_RGBA, GL_FLOAT},
    [TEXTURE_R32F] = {GL_R32F, GL_RED, GL_FLOAT},
    [TEXTURE_DEPTH32F] = {GL_DEPTH_COMPONENT32F, GL_DEPTH_COMPONENT, GL_FLOAT},
};

Texture texture_create(const Gl *gl, TextureFormat format, int width, int height, TextureSampling sampling,
                       const void *pixels) {
    Texture texture = {0, width, height};
    bool repeat = sampling == TEXTURE_REPEAT_MIPMAP;
    GLint magnify = sampling == TEXTURE_NEAREST ? GL_NEAREST : GL_LINEAR;
    GLint wrap = repeat ? GL_REPEAT : GL_CLAMP_TO_EDGE;
    gl->GenTextures(1, &texture.id);
    texture_update(gl, &texture, format, width, height, pixels);
    gl->TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, magnify);
    gl->TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, repeat ? GL_LINEAR_MIPMAP_NEAREST : magnify);
    gl->TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, wrap);
    gl->TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, wrap);
    if (repeat && pixels)
        gl->GenerateMipmap(GL_TEXTURE_2D);
    return texture;
}

void texture_update(const Gl *gl, Texture *texture, TextureFormat format, int width, int height,
                    const void *pixels) {
    texture->width = width;
    texture->height = height;
    gl->ActiveTexture(GL_TEXTURE0);
    gl->BindTexture(GL_TEXTURE_2D, texture->id);
    gl->PixelStorei(GL_UNPACK_ALIGNMENT, 1);
    gl->TexImage2D(GL_TEXTURE_2D, 0, formats[format].internal, width, height, 0, formats[format].format,
                   formats[format].type, pixels);
}

void texture_destroy(const Gl *gl, Texture *texture) {
    gl->DeleteTextures(1, &texture->id);
    *texture = (Texture){0};
}

void texture_bind(const Gl *gl, int unit, const Texture *texture) {
    gl->ActiveTexture(GL_TEXTURE0 + (GLenum)unit);
    gl->BindTexture(GL_TEXTURE_2D, texture->id);
}

GLuint framebuffer_create(const Gl *gl, const Texture *color, const Texture *depth, Err *err) {
    static const GLenum buffers[] = {GL_COLOR_ATTACHMENT0};
    GLuint framebuffer = 0;
    gl->GenFramebuffers(1, &framebuffer);
    gl->BindFramebuffer(GL_FRAMEBUFFER, framebuffer);
    gl->FramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, color->id, 0);
    if (depth)
        gl->FramebufferTexture2D(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_TEXTURE_2D, depth->id, 0);
    gl->DrawBuffers(1, buffers);
    GLenum status = gl->CheckFramebufferStatus(GL_FRAMEBUFFER);
    if (status == GL_FRAMEBUFFER_COMPLETE)
        return framebuffer;
    gl->DeleteFramebuffers(1, &framebuffer);
    err_set(err, ERR_GL, "the driver refuses a framebuffer of %d x %d (0x%04x)", color->width, color->height,
            status);
    return 0;
}

void framebuffer_bind(const Gl *gl, GLuint framebuffer, const Texture *color) {
    gl->BindFramebuffer(GL_FRAMEBUFFER, framebuffer);
    gl->Viewport(0, 0, color->width, color->height);
}
