/* GLSL programs from the texts in shaders/, which the build embeds. */
#ifndef SKIFF_SHADER_H
#define SKIFF_SHADER_H

#include "gl.h"

/* One embedded file. The list ends with a name of NULL; the build writes it. */
typedef struct ShaderText {
    const char *name, *text;
} ShaderText;
extern const ShaderText shader_texts[];

enum { SHADER_FRAME_BINDING = 0 }; /* of the uniform block `Frame` (shaders/frame.glsl) */

/* Compiles and links `vertex` and `fragment` (names of files in shaders/). A line `#include "name"` is
 * replaced by that file, once a stage. Samplers named in `samplers` (NULL-terminated) read texture units 0,
 * 1, ... in that order. 0 with ERR_GL and the compiler's words: our bug or the driver's. */
GLuint shader_program(const Gl *gl, const char *vertex, const char *fragment, const char *const *samplers,
                      Err *err);

#endif
