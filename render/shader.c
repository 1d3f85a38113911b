/* Compiles GLSL 3.30 programs. Does not keep binaries: llvmpipe's compile time goes into machine code at the
 * first draw, which no binary would save. */
#include "shader.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_TEXT = 1 << 16, MAX_INCLUDES = 8 };

typedef struct Source {
    char text[MAX_TEXT];
    size_t length;
    const char *included[MAX_INCLUDES];
    int included_count;
} Source;

static const ShaderText *find_text(const char *name, size_t length) {
    for (const ShaderText *text = shader_texts; text->name; text++)
        if (strlen(text->name) == length && memcmp(text->name, name, length) == 0)
            return text;
    return NULL;
}

static bool append(Source *source, const char *text, size_t length, Err *err) {
    if (source->length + length >= MAX_TEXT)
        return err_set(err, ERR_GL, "shader text beyond %d bytes", MAX_TEXT);
    memcpy(source->text + source->length, text, length);
    source->text[source->length += length] = '\0';
    return true;
}

static bool expand(Source *source, const char *name, size_t name_length, Err *err) {
    static const char keyword[] = "#include \"";
    const ShaderText *file = find_text(name, name_length);
    if (!file)
        return err_set(err, ERR_GL, "no shader text '%.*s'", (int)name_length, name);
    for (int i = 0; i < source->included_count; i++)
        if (source->included[i] == file->name)
            return true;
    if (source->included_count == MAX_INCLUDES)
        return err_set(err, ERR_GL, "%s: more than %d included files", file->name, MAX_INCLUDES);
    source->included[source->included_count++] = file->name;
    for (const char *line = file->text; *line;) {
        size_t length = strcspn(line, "\n");
        length += line[length] == '\n';
        if (strncmp(line, keyword, sizeof keyword - 1) == 0) {
            const char *inner = line + sizeof keyword - 1;
            if (!expand(source, inner, strcspn(inner, "\"\n"), err))
                return false;
        } else if (!append(source, line, length, err)) {
            return false;
        }
        line += length;
    }
    return true;
}

static GLuint compile(const Gl *gl, GLenum stage, const char *name, Err *err) {
    static const char version[] = "#version 330 core\n";
    Source *source = calloc(1, sizeof *source);
    if (!source) {
        err_set(err, ERR_GL, "no memory for shader %s", name);
        return 0;
    }
    GLuint shader = 0;
    if (append(source, version, sizeof version - 1, err) && expand(source, name, strlen(name), err)) {
        const char *text = source->text;
        GLint ok = 0;
        shader = gl->CreateShader(stage);
        gl->ShaderSource(shader, 1, &text, NULL);
        gl->CompileShader(shader);
        gl->GetShaderiv(shader, GL_COMPILE_STATUS, &ok);
        if (!ok) {
            char log[2048] = "";
            gl->GetShaderInfoLog(shader, sizeof log, NULL, log);
            err_set(err, ERR_GL, "shader %s: %s", name, log);
            gl->DeleteShader(shader);
            shader = 0;
        }
    }
    free(source);
    return shader;
}

GLuint shader_program(const Gl *gl, const char *vertex, const char *fragment, const char *const *samplers,
                      Err *err) {
    GLuint vertex_shader = compile(gl, GL_VERTEX_SHADER, vertex, err);
    GLuint fragment_shader = vertex_shader ? compile(gl, GL_FRAGMENT_SHADER, fragment, err) : 0;
    GLuint program = 0;
    if (fragment_shader) {
        GLint ok = 0;
        program = gl->CreateProgram();
        gl->AttachShader(program, vertex_shader);
        gl->AttachShader(program, fragment_shader);
        gl->LinkProgram(program);
        gl->GetProgramiv(program, GL_LINK_STATUS, &ok);
        if (!ok) {
            char log[2048] = "";
            gl->GetProgramInfoLog(program, sizeof log, NULL, log);
            err_set(err, ERR_GL, "shaders %s, %s: %s", vertex, fragment, log);
            gl->DeleteProgram(program);
            program = 0;
        }
    }
    if (vertex_shader)
        gl->DeleteShader(vertex_shader);
    if (fragment_shader)
        gl->DeleteShader(fragment_shader);
    if (!program)
        return 0;
    GLuint block = gl->GetUniformBlockIndex(program, "Frame");
    if (block != GL_INVALID_INDEX)
        gl->UniformBlockBinding(program, block, SHADER_FRAME_BINDING);
    gl->UseProgram(program);
    for (int unit = 0; samplers && samplers[unit]; unit++)
        gl->Uniform1i(gl->GetUniformLocation(program, samplers[unit]), unit);
    return program;
}
