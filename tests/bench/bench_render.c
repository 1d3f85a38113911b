/* Milliseconds per pass of one image: the made-up sea of tests/golden/sea.h with about 187 000 particles, at
 * 1280 x 720, in both looks. Each image is drawn several times; the best and the median of each pass are
 * printed as a CSV row a pass. With a file name as argument the images are kept (LOOK.png is added). Not run
 * by ctest: it asserts nothing. */
#include "base/log.h"
#include "render/png.h"
#include "tests/golden/sea.h"

#include <stdio.h>

enum { IMAGES = 9, MAX_PASSES = 32, WIDTH = 1280, HEIGHT = 720 };

static int compare(const void *a, const void *b) {
    double p = *(const double *)a, q = *(const double *)b;
    return (p > q) - (p < q);
}

static void print_row(const char *look, const char *pass, double *ms) {
    qsort(ms, IMAGES, sizeof *ms, compare);
    printf("%s,%s,%.2f,%.2f\n", look, pass, ms[0], ms[IMAGES / 2]);
}

static bool run(GfxLook look, const char *keep, Err *err) {
    static double ms[MAX_PASSES + 1][IMAGES];
    GfxDef def = gfx_def_default();
    def.width = WIDTH;
    def.height = HEIGHT;
    def.look = look;
    def.profile = true;
    Gfx *gfx = gfx_create(&def, err);
    if (!gfx)
        return false;
    Sea *sea = sea_create(&(SeaDef){2.5f, 1.0f, 0.05f, 1.3f});
    GfxMeshDef boat = sea_boat(sea);
    GfxInstance instance = {.pose = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}};
    GfxCamera *camera = &sea->scene.camera;
    memcpy(camera->eye, (float[3]){-2.3f, 0.85f, 1.9f}, sizeof camera->eye);
    memcpy(camera->target, (float[3]){0.0f, 0.1f, 0.0f}, sizeof camera->target);
    sea->scene.instances = &instance;
    sea->scene.instance_count = 1;
    uint8_t *rgb = malloc((size_t)WIDTH * HEIGHT * 3);
    bool ok = rgb && (instance.mesh = gfx_add_mesh(gfx, &boat, err)) >= 0;
    for (int i = -2; ok && i < IMAGES; i++) { /* two to warm up */
        ok = gfx_draw(gfx, &sea->scene, rgb, err);
        GfxStats stats = gfx_stats(gfx);
        for (int pass = 0; i >= 0 && pass < gfx_pass_count(); pass++)
            ms[pass][i] = stats.pass_ms[pass];
        if (i >= 0)
            ms[gfx_pass_count()][i] = stats.total_ms;
    }
    if (ok) {
        GfxStats stats = gfx_stats(gfx);
        printf("# %s, %s: %u particles, %u drawn, %u droplets\n", gfx_look_name(look), gfx_info(gfx).renderer,
               sea->scene.particles.count, stats.particles_drawn, stats.droplets);
        for (int pass = 0; pass < gfx_pass_count(); pass++)
            if (ms[pass][0] > 0.0)
                print_row(gfx_look_name(look), gfx_pass_name(pass), ms[pass]);
        print_row(gfx_look_name(look), "total", ms[gfx_pass_count()]);
    }
    if (ok && keep) {
        char path[512];
        snprintf(path, sizeof path, "%s%s.png", keep, gfx_look_name(look));
        ok = gfx_png_write(path, rgb, WIDTH, HEIGHT, err);
    }
    free(rgb);
    sea_free(sea);
    gfx_destroy(gfx);
    return ok;
}

int main(int argc, char **argv) {
    Err err = {0};
    const char *keep = argc > 1 ? argv[1] : NULL;
    printf("look,pass,best_ms,median_ms\n");
    if (run(GFX_LOOK_WATER, keep, &err) && run(GFX_LOOK_PARTICLES, keep, &err))
        return 0;
    fprintf(stderr, "%s\n", err.message);
    return (int)err.code;
}
