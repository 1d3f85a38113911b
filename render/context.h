/* An OpenGL 3.3 core context without a window. */
#ifndef SKIFF_CONTEXT_H
#define SKIFF_CONTEXT_H

#include "gfx.h"
#include "gl.h"

typedef struct Context Context;

/* Opens the wanted back end, or for GFX_BACKEND_AUTO the first that works, makes it current and loads `gl`.
 * ERR_GL: one line for each that was tried, and one with the packages to install. */
Context *context_open(GfxBackend wanted, Gl *gl, Err *err);
void context_close(Context *context);

/* To be called before GL is used, as another context of the process may be current. */
bool context_make_current(Context *context, Err *err);

GfxBackend context_backend(const Context *context);
const char *context_reason(const Context *context);

#endif
