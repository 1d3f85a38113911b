/* skiff gl-info: who would draw, and why. */
#include "commands.h"

#include "render/gfx.h"

#include <stdio.h>

bool gl_info_command(const CliArgs *args, Err *err) {
    GfxDef def = gfx_def_default();
    /* The option's words and the renderer's are in one order; test_pictures holds them together. */
    def.backend = (GfxBackend)(args->pictures.gl >= 0 ? args->pictures.gl : GFX_BACKEND_AUTO);
    def.width = def.height = GFX_SIZE_MIN;
    Gfx *gfx = gfx_create(&def, err);
    if (!gfx)
        return false;
    GfxInfo info = gfx_info(gfx);
    printf("way       %s\nvendor    %s\nrenderer  %s\nversion   %s\nreason    %s\n",
           gfx_backend_name(info.backend), info.vendor, info.renderer, info.version, info.reason);
    gfx_destroy(gfx);
    return true;
}
