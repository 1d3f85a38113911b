/* Fills the table of GL entry points by name. Nothing but the list in gl.h is looked up: a pass that needs
 * another entry point adds a row there. */
#include "gl.h"

#include <stdio.h>
#include <string.h>

bool gl_load(Gl *gl, GlGetProc get_proc, Err *err) {
    char missing[1024] = "";
    size_t length = 0;
#define X(type, name)                                                                                        \
    gl->name = (PFNGL##type##PROC)get_proc("gl" #name);                                                      \
    if (!gl->name && length < sizeof missing)                                                                \
        length += (size_t)snprintf(missing + length, sizeof missing - length, " gl" #name);
    GL_ENTRY_POINTS(X)
#undef X
    if (length > 0)
        return err_set(err, ERR_GL, "the GL library lacks%s", missing);
    return true;
}

bool gl_check(const Gl *gl, const char *where, Err *err) {
    GLenum code = gl->GetError();
    if (code == GL_NO_ERROR)
        return true;
    while (gl->GetError() != GL_NO_ERROR)
        ;
    return err_set(err, ERR_GL, "%s: OpenGL reports error 0x%04x%s", where, code,
                   code == GL_OUT_OF_MEMORY ? " (out of memory)" : "");
}
