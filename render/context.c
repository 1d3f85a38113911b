/* Three ways to OpenGL without a screen, behind one table: EGL on a device, EGL "surfaceless" (Mesa), OSMesa.
 *
 * The libraries are opened at run time with RTLD_LOCAL: libEGL (libGL) and libOSMesa define 1292 symbols
 * alike and crash when linked together, and a program that draws nothing should need neither. They are never
 * closed again: Mesa leaves threads and exit handlers behind that need their code. Displays are not
 * terminated either, since eglTerminate ends them for every context of the process.
 *
 * All draw into framebuffer objects; the context's own surface is none (EGL) or 16 x 16 (OSMesa). */
#include "context.h"

#include <EGL/egl.h>
#include <EGL/eglext.h>

#include <dlfcn.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { OSMESA_EDGE = 16, MAX_DEVICES = 16 };

/* From GL/osmesa.h, which is gone with OSMesa itself since Mesa 25.1. */
enum {
    OSMESA_FORMAT = 0x22,
    OSMESA_DEPTH_BITS = 0x30,
    OSMESA_PROFILE = 0x33,
    OSMESA_CORE_PROFILE = 0x34,
    OSMESA_CONTEXT_MAJOR_VERSION = 0x36,
    OSMESA_CONTEXT_MINOR_VERSION = 0x37
};

typedef void *(*OsmesaCreate)(const int *attributes, void *shared);
typedef unsigned char (*OsmesaMakeCurrent)(void *context, void *buffer, GLenum type, GLsizei width,
                                           GLsizei height);
typedef void (*OsmesaDestroy)(void *context);

typedef struct EglApi {
    PFNEGLGETPROCADDRESSPROC get_proc;
    PFNEGLINITIALIZEPROC initialize;
    PFNEGLBINDAPIPROC bind_api;
    PFNEGLCREATECONTEXTPROC create_context;
    PFNEGLDESTROYCONTEXTPROC destroy_context;
    PFNEGLMAKECURRENTPROC make_current;
    PFNEGLGETERRORPROC get_error;
    PFNEGLQUERYSTRINGPROC query_string;
} EglApi;

typedef struct OsmesaApi {
    OsmesaCreate create;
    OsmesaMakeCurrent make_current;
    OsmesaDestroy destroy;
    GlGetProc get_proc;
} OsmesaApi;

struct Context {
    const struct Backend *backend;
    char reason[ERR_MESSAGE_SIZE + 128];
    EglApi egl;
    EGLDisplay display;
    EGLContext egl_context;
    OsmesaApi osmesa;
    void *osmesa_context;
    uint32_t osmesa_pixels[OSMESA_EDGE * OSMESA_EDGE];
};

/* What one way needs; the order is that of GFX_BACKEND_AUTO. */
typedef struct Backend {
    GfxBackend id;
    const char *packages; /* Debian's, at run time */
    GlGetProc (*open)(Context *context, Err *err);
    bool (*make_current)(Context *context);
    void (*close)(Context *context);
} Backend;

static void say(Context *context, const char *format, ...) ERR_PRINTF(2, 3);
static void say(Context *context, const char *format, ...) {
    va_list args;
    va_start(args, format);
    vsnprintf(context->reason, sizeof context->reason, format, args);
    va_end(args);
}

/* ISO C knows no cast from dlsym's void * to a function; POSIX promises that the bits are the same. */
static bool find_symbol(void *library, const char *name, void *function_pointer, Err *err) {
    void *symbol = dlsym(library, name);
    if (!symbol)
        return err_set(err, ERR_GL, "%s is missing", name);
    memcpy(function_pointer, &symbol, sizeof symbol);
    return true;
}

/* ---- EGL ---- */

static bool egl_load(EglApi *egl, Err *err) {
    void *library = dlopen("libEGL.so.1", RTLD_NOW | RTLD_LOCAL);
    if (!library)
        return err_set(err, ERR_GL, "cannot open libEGL.so.1 (%s)", dlerror());
    return find_symbol(library, "eglGetProcAddress", &egl->get_proc, err) &&
           find_symbol(library, "eglInitialize", &egl->initialize, err) &&
           find_symbol(library, "eglBindAPI", &egl->bind_api, err) &&
           find_symbol(library, "eglCreateContext", &egl->create_context, err) &&
           find_symbol(library, "eglDestroyContext", &egl->destroy_context, err) &&
           find_symbol(library, "eglMakeCurrent", &egl->make_current, err) &&
           find_symbol(library, "eglGetError", &egl->get_error, err) &&
           find_symbol(library, "eglQueryString", &egl->query_string, err);
}

static bool egl_make_current(Context *context) {
    return context->egl.make_current(context->display, EGL_NO_SURFACE, EGL_NO_SURFACE, context->egl_context);
}

static void egl_close(Context *context) {
    context->egl.make_current(context->display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
    context->egl.destroy_context(context->display, context->egl_context);
}

/* A context on `display`. No configuration is asked for: nothing is drawn into a surface of EGL's. */
static bool egl_start(Context *context, EGLDisplay display, Err *err) {
    static const EGLint attributes[] = {EGL_CONTEXT_MAJOR_VERSION,
                                        3,
                                        EGL_CONTEXT_MINOR_VERSION,
                                        3,
                                        EGL_CONTEXT_OPENGL_PROFILE_MASK,
                                        EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT,
                                        EGL_NONE};
    EglApi *egl = &context->egl;
    if (display == EGL_NO_DISPLAY)
        return err_set(err, ERR_GL, "no display");
    if (!egl->initialize(display, NULL, NULL))
        return err_set(err, ERR_GL, "eglInitialize fails (0x%x)", egl->get_error());
    const char *extensions = egl->query_string(display, EGL_EXTENSIONS);
    if (!extensions || !strstr(extensions, "EGL_KHR_surfaceless_context") ||
        !strstr(extensions, "EGL_KHR_no_config_context"))
        return err_set(err, ERR_GL, "no contexts without a surface");
    if (!egl->bind_api(EGL_OPENGL_API))
        return err_set(err, ERR_GL, "no desktop OpenGL (0x%x)", egl->get_error());
    context->display = display;
    context->egl_context = egl->create_context(display, EGL_NO_CONFIG_KHR, EGL_NO_CONTEXT, attributes);
    if (context->egl_context == EGL_NO_CONTEXT)
        return err_set(err, ERR_GL, "no OpenGL 3.3 core context (0x%x)", egl->get_error());
    if (egl_make_current(context))
        return true;
    err_set(err, ERR_GL, "eglMakeCurrent fails (0x%x)", egl->get_error());
    egl->destroy_context(display, context->egl_context);
    return false;
}

/* Devices come with hardware first; Mesa's own software device is the last. */
static GlGetProc egl_device_open(Context *context, Err *err) {
    EglApi *egl = &context->egl;
    if (!egl_load(egl, err))
        return NULL;
    PFNEGLQUERYDEVICESEXTPROC query_devices = (PFNEGLQUERYDEVICESEXTPROC)egl->get_proc("eglQueryDevicesEXT");
    PFNEGLQUERYDEVICESTRINGEXTPROC query_string =
        (PFNEGLQUERYDEVICESTRINGEXTPROC)egl->get_proc("eglQueryDeviceStringEXT");
    PFNEGLGETPLATFORMDISPLAYEXTPROC get_display =
        (PFNEGLGETPLATFORMDISPLAYEXTPROC)egl->get_proc("eglGetPlatformDisplayEXT");
    EGLDeviceEXT devices[MAX_DEVICES];
    EGLint count = 0;
    if (!query_devices || !query_string || !get_display || !query_devices(MAX_DEVICES, devices, &count) ||
        count == 0) {
        err_set(err, ERR_GL, "EGL knows no device");
        return NULL;
    }
    for (int i = 0; i < count; i++) {
        Err device_err = {0};
        if (egl_start(context, get_display(EGL_PLATFORM_DEVICE_EXT, devices[i], NULL), &device_err)) {
            const char *extensions = query_string(devices[i], EGL_EXTENSIONS);
            bool software = extensions && strstr(extensions, "EGL_MESA_device_software");
            say(context, "device %d of %d, %s", i + 1, (int)count, software ? "in software" : "hardware");
            return (GlGetProc)egl->get_proc;
        }
        err_add(err, ERR_GL, "device %d of %d: %s", i + 1, (int)count, device_err.message);
    }
    return NULL;
}

static GlGetProc egl_surfaceless_open(Context *context, Err *err) {
    EglApi *egl = &context->egl;
    if (!egl_load(egl, err))
        return NULL;
    PFNEGLGETPLATFORMDISPLAYEXTPROC get_display =
        (PFNEGLGETPLATFORMDISPLAYEXTPROC)egl->get_proc("eglGetPlatformDisplayEXT");
    const char *extensions = egl->query_string(EGL_NO_DISPLAY, EGL_EXTENSIONS);
    if (!get_display || !extensions || !strstr(extensions, "EGL_MESA_platform_surfaceless")) {
        err_set(err, ERR_GL, "this EGL has no surfaceless platform");
        return NULL;
    }
    if (!egl_start(context, get_display(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, NULL), err))
        return NULL;
    say(context, "Mesa's surfaceless platform");
    return (GlGetProc)egl->get_proc;
}

/* ---- OSMesa ---- */

static bool osmesa_make_current(Context *context) {
    return context->osmesa.make_current(context->osmesa_context, context->osmesa_pixels, GL_UNSIGNED_BYTE,
                                        OSMESA_EDGE, OSMESA_EDGE);
}

static void osmesa_close(Context *context) {
    context->osmesa.destroy(context->osmesa_context);
}

static GlGetProc osmesa_open(Context *context, Err *err) {
    static const int attributes[] = {OSMESA_FORMAT,
                                     GL_RGBA,
                                     OSMESA_DEPTH_BITS,
                                     0,
                                     OSMESA_PROFILE,
                                     OSMESA_CORE_PROFILE,
                                     OSMESA_CONTEXT_MAJOR_VERSION,
                                     3,
                                     OSMESA_CONTEXT_MINOR_VERSION,
                                     3,
                                     0};
    OsmesaApi *osmesa = &context->osmesa;
    void *library = dlopen("libOSMesa.so.8", RTLD_NOW | RTLD_LOCAL);
    if (!library)
        library = dlopen("libOSMesa.so.6", RTLD_NOW | RTLD_LOCAL);
    if (!library) {
        err_set(err, ERR_GL, "cannot open libOSMesa.so.8 or .6 (%s; Mesa 25.1 and later have none)",
                dlerror());
        return NULL;
    }
    if (!find_symbol(library, "OSMesaCreateContextAttribs", &osmesa->create, err) ||
        !find_symbol(library, "OSMesaMakeCurrent", &osmesa->make_current, err) ||
        !find_symbol(library, "OSMesaDestroyContext", &osmesa->destroy, err) ||
        !find_symbol(library, "OSMesaGetProcAddress", &osmesa->get_proc, err))
        return NULL;
    context->osmesa_context = osmesa->create(attributes, NULL);
    if (!context->osmesa_context) {
        err_set(err, ERR_GL, "no OpenGL 3.3 core context");
        return NULL;
    }
    if (!osmesa_make_current(context)) {
        err_set(err, ERR_GL, "OSMesaMakeCurrent fails");
        osmesa_close(context);
        return NULL;
    }
    say(context, "in software, without EGL");
    return osmesa->get_proc;
}

/* ---- The table ---- */

static const Backend backends[] = {
    {GFX_BACKEND_EGL_DEVICE, "libegl1 libegl-mesa0 libgl1-mesa-dri", egl_device_open, egl_make_current,
     egl_close},
    {GFX_BACKEND_EGL_SURFACELESS, "libegl1 libegl-mesa0 libgl1-mesa-dri", egl_surfaceless_open,
     egl_make_current, egl_close},
    {GFX_BACKEND_OSMESA, "libosmesa6", osmesa_open, osmesa_make_current, osmesa_close},
};
enum { BACKEND_COUNT = sizeof backends / sizeof backends[0] };

static bool try_backend(Context *context, const Backend *backend, Gl *gl, Err *err) {
    context->backend = backend;
    GlGetProc get_proc = backend->open(context, err);
    if (!get_proc)
        return false;
    if (gl_load(gl, get_proc, err))
        return true;
    backend->close(context);
    return false;
}

Context *context_open(GfxBackend wanted, Gl *gl, Err *err) {
    Context *context = calloc(1, sizeof *context);
    const char *packages = NULL;
    Err failures = {0};
    if (!context) {
        err_set(err, ERR_GL, "no memory for a GL context");
        return NULL;
    }
    for (int i = 0; i < BACKEND_COUNT; i++) {
        const Backend *backend = &backends[i];
        if (wanted != GFX_BACKEND_AUTO && wanted != backend->id)
            continue;
        Err tried = {0};
        if (try_backend(context, backend, gl, &tried)) {
            size_t length = strlen(context->reason);
            const char *how = wanted == GFX_BACKEND_AUTO ? "first that works" : "as asked for";
            snprintf(context->reason + length, sizeof context->reason - length, "; %s%s%s", how,
                     failures.code ? "; not " : "", failures.message);
            return context;
        }
        err_prefix(&tried, "%s", gfx_backend_name(backend->id));
        err_add(&failures, ERR_GL, "%s", tried.message);
        if (!packages)
            packages = backend->packages;
    }
    free(context);
    err_set(err, ERR_GL, "no usable OpenGL 3.3 without a screen:\n%s\non Debian: apt-get install %s",
            failures.message,
            wanted == GFX_BACKEND_AUTO ? "libegl1 libegl-mesa0 libgl1-mesa-dri (or libosmesa6)" : packages);
    return NULL;
}

void context_close(Context *context) {
    if (!context)
        return;
    context->backend->close(context);
    free(context);
}

bool context_make_current(Context *context, Err *err) {
    if (context->backend->make_current(context))
        return true;
    return err_set(err, ERR_GL, "%s: the context cannot be made current",
                   gfx_backend_name(context->backend->id));
}

GfxBackend context_backend(const Context *context) {
    return context->backend->id;
}

const char *context_reason(const Context *context) {
    return context->reason;
}
