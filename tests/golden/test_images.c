/* Images of both looks and of each pass: equal bytes from every context in one run, close to stored images,
 * and a proof that the comparison sees a missing pass. SKIFF_UPDATE_IMAGES=1 in the environment writes the
 * stored images anew.
 *
 * Stored images differ a little between machines (other vector units round otherwise), so those have a
 * tolerance. */
#include "render/png.h"
#include "sea.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>

#include <cmocka.h>

#define XXH_INLINE_ALL
#include <xxhash.h>

#if defined(__SANITIZE_ADDRESS__)
/* OSMesa 22.3 keeps a few hundred bytes of each context for ever. */
const char *__lsan_default_suppressions(void);
const char *__lsan_default_suppressions(void) {
    return "leak:libOSMesa";
}
#endif

enum { WIDTH = 224, HEIGHT = 126, SIZE = WIDTH * HEIGHT * 3, MAX_PICTURES = 24 };

#define TOLERANCE_RMS 1.5 /* of 255, over all pixels and channels */

/* The finished image first, then what passes left, where that is not among the pictures already. */
typedef struct Pictures {
    int count;
    char names[MAX_PICTURES][48];
    uint8_t rgb[MAX_PICTURES][SIZE];
} Pictures;

static Sea *sea;
static GfxInstance boat = {.pose = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}};
static Pictures drawn, other;

static int set_up(void **state) {
    (void)state;
    sea = sea_create(&(SeaDef){1.8f, 0.3f, 0.05f, 1.1f});
    GfxCamera *camera = &sea->scene.camera;
    memcpy(camera->eye, (float[3]){-1.55f, 0.62f, 1.35f}, sizeof camera->eye);
    memcpy(camera->target, (float[3]){0.05f, 0.08f, 0.0f}, sizeof camera->target);
    sea->scene.instances = &boat;
    sea->scene.instance_count = 1;
    return 0;
}

static int tear_down(void **state) {
    (void)state;
    sea_free(sea);
    return 0;
}

/* NULL where this machine lacks the back end. */
static Gfx *open_gfx(GfxBackend backend, GfxLook look, uint32_t skip_passes) {
    Err err = {0};
    GfxDef def = gfx_def_default();
    def.width = WIDTH;
    def.height = HEIGHT;
    def.look = look;
    def.backend = backend;
    def.skip_passes = skip_passes;
    Gfx *gfx = gfx_create(&def, &err);
    if (!gfx) {
        assert_int_equal(err.code, ERR_GL);
        print_message("%s\n", err.message);
        return NULL;
    }
    GfxMeshDef mesh = sea_boat(sea);
    boat.mesh = gfx_add_mesh(gfx, &mesh, &err);
    if (boat.mesh < 0)
        fail_msg("%s", err.message);
    return gfx;
}

static Gfx *open_gfx_or_skip(GfxLook look, uint32_t skip_passes) {
    Gfx *gfx = open_gfx(GFX_BACKEND_AUTO, look, skip_passes);
    if (!gfx)
        skip();
    return gfx;
}

static void draw(Gfx *gfx, const GfxScene *scene, uint8_t *rgb) {
    Err err = {0};
    memset(rgb, 0, SIZE);
    if (!gfx_draw(gfx, scene, rgb, &err))
        fail_msg("%s", err.message);
}

static bool is_known(const Pictures *pictures, const uint8_t *rgb) {
    for (int i = 0; i < pictures->count; i++)
        if (memcmp(pictures->rgb[i], rgb, SIZE) == 0)
            return true;
    return false;
}

static void take_pictures(Gfx *gfx, GfxLook look, Pictures *pictures) {
    draw(gfx, &sea->scene, pictures->rgb[0]);
    snprintf(pictures->names[0], sizeof pictures->names[0], "%s", gfx_look_name(look));
    pictures->count = 1;
    for (int pass = 0; pass < gfx_pass_count(); pass++) {
        int i = pictures->count;
        assert_true(i < MAX_PICTURES);
        if (!gfx_pass_image(gfx, pass, pictures->rgb[i], NULL) || is_known(pictures, pictures->rgb[i]))
            continue;
        snprintf(pictures->names[i], sizeof pictures->names[i], "%s-%s", gfx_look_name(look),
                 gfx_pass_name(pass));
        pictures->count++;
    }
}

static double difference_rms(const uint8_t *a, const uint8_t *b) {
    double sum = 0.0;
    for (int i = 0; i < SIZE; i++)
        sum += (double)(a[i] - b[i]) * (a[i] - b[i]);
    return sqrt(sum / SIZE);
}

static bool is_updating(void) {
    const char *update = getenv("SKIFF_UPDATE_IMAGES");
    return update && strcmp(update, "1") == 0;
}

/* The largest difference between pictures and stored images; `worst` is its name. */
static double compare_with_stored(const Pictures *pictures, const char **worst) {
    static uint8_t stored[SIZE];
    double largest = -1.0;
    for (int i = 0; i < pictures->count; i++) {
        Err err = {0};
        char path[512];
        snprintf(path, sizeof path, "%s/tests/golden/images/%s.png", SKIFF_SOURCE_DIR, pictures->names[i]);
        double rms = 256.0; /* a picture that is not known at all is as far off as can be */
        if (gfx_png_read(path, stored, WIDTH, HEIGHT, &err))
            rms = difference_rms(pictures->rgb[i], stored);
        else
            print_message("%s\n", err.message);
        if (rms > largest) {
            largest = rms;
            *worst = pictures->names[i];
        }
    }
    return largest;
}

static void update_stored(const Pictures *pictures) {
    for (int i = 0; i < pictures->count; i++) {
        Err err = {0};
        char path[512];
        snprintf(path, sizeof path, "%s/tests/golden/images/%s.png", SKIFF_SOURCE_DIR, pictures->names[i]);
        if (!gfx_png_write(path, pictures->rgb[i], WIDTH, HEIGHT, &err))
            fail_msg("%s", err.message);
    }
}

static void images_are_those_stored(void **state) {
    (void)state;
    for (int look = 0; look < GFX_LOOK_COUNT; look++) {
        const char *worst = "";
        Gfx *gfx = open_gfx_or_skip((GfxLook)look, 0);
        take_pictures(gfx, (GfxLook)look, &drawn);
        gfx_destroy(gfx);
        assert_true(drawn.count >= 4);
        if (is_updating())
            update_stored(&drawn);
        double rms = compare_with_stored(&drawn, &worst);
        print_message("%s: %d pictures, farthest from its stored image is %s by %.3f (at most %.1f)\n",
                      gfx_look_name((GfxLook)look), drawn.count, worst, rms, TOLERANCE_RMS);
        assert_true(rms <= TOLERANCE_RMS);
    }
}

static void a_missing_pass_is_seen(void **state) {
    (void)state;
    for (int look = 0; look < GFX_LOOK_COUNT; look++) {
        Gfx *whole = open_gfx_or_skip((GfxLook)look, 0);
        draw(whole, &sea->scene, drawn.rgb[0]);
        GfxStats stats = gfx_stats(whole);
        gfx_destroy(whole);
        for (int pass = 0; pass < gfx_pass_count(); pass++) {
            const char *worst = "";
            if (!stats.pass_ran[pass])
                continue;
            Gfx *gfx = open_gfx_or_skip((GfxLook)look, 1u << pass);
            take_pictures(gfx, (GfxLook)look, &other);
            gfx_destroy(gfx);
            double rms = compare_with_stored(&other, &worst);
            print_message("%s without %s: %s is off by %.1f\n", gfx_look_name((GfxLook)look),
                          gfx_pass_name(pass), worst, rms);
            if (rms <= TOLERANCE_RMS)
                fail_msg("%s: nobody misses the pass %s", gfx_look_name((GfxLook)look), gfx_pass_name(pass));
        }
    }
}

static void contexts_agree_bit_for_bit(void **state) {
    (void)state;
    int opened = 0;
    for (int look = 0; look < GFX_LOOK_COUNT; look++) {
        bool first = true;
        for (int backend = GFX_BACKEND_AUTO + 1; backend < GFX_BACKEND_COUNT; backend++) {
            Gfx *gfx = open_gfx((GfxBackend)backend, (GfxLook)look, 0);
            if (!gfx)
                continue;
            GfxInfo info = gfx_info(gfx);
            print_message("%s: %s, %s, %s\n", gfx_backend_name(info.backend), info.renderer, info.version,
                          info.reason);
            assert_int_equal(info.backend, backend);
            take_pictures(gfx, (GfxLook)look, first ? &drawn : &other);
            gfx_destroy(gfx);
            opened++;
            for (int i = 0; !first && i < drawn.count; i++) {
                XXH64_hash_t a = XXH3_64bits(drawn.rgb[i], SIZE), b = XXH3_64bits(other.rgb[i], SIZE);
                if (a != b)
                    fail_msg("%s differs between contexts, by %.3f", drawn.names[i],
                             difference_rms(drawn.rgb[i], other.rgb[i]));
            }
            first = false;
        }
    }
    if (opened == 0)
        skip();
}

/* Two renderers at once, each drawing twice. */
static void images_repeat(void **state) {
    (void)state;
    Gfx *a = open_gfx_or_skip(GFX_LOOK_WATER, 0), *b = open_gfx_or_skip(GFX_LOOK_WATER, 0);
    draw(a, &sea->scene, drawn.rgb[0]);
    draw(b, &sea->scene, drawn.rgb[1]);
    draw(a, &sea->scene, drawn.rgb[2]);
    gfx_destroy(a);
    gfx_destroy(b);
    assert_memory_equal(drawn.rgb[0], drawn.rgb[1], SIZE);
    assert_memory_equal(drawn.rgb[0], drawn.rgb[2], SIZE);
}

/* Moves the local coordinates by -shift and the origin by +shift, as a window's move does. */
static void shift_scene(const float shift[3]) {
    GfxScene *scene = &sea->scene;
    for (int k = 0; k < 3; k++) {
        for (uint32_t i = 0; i < scene->particles.count; i++)
            sea->position[i][k] -= shift[k];
        scene->camera.eye[k] -= shift[k];
        scene->camera.target[k] -= shift[k];
        boat.pose[12 + k] -= shift[k];
        scene->origin[k] += (double)shift[k];
    }
    scene->ocean.level -= shift[1];
    for (int k = 0; k < 2; k++) {
        scene->ocean.edge_min[k] -= shift[2 * k];
        scene->ocean.edge_max[k] -= shift[2 * k];
        scene->ocean.foam_min[k] -= shift[2 * k];
        scene->ocean.foam_max[k] -= shift[2 * k];
    }
}

static void window_moves_are_not_seen(void **state) {
    (void)state;
    const float there[3] = {0.8f, 0.0f, -0.35f}, back[3] = {-0.8f, 0.0f, 0.35f};
    const double origins[] = {0.0, 123456.789};
    Gfx *gfx = open_gfx_or_skip(GFX_LOOK_WATER, 0);
    for (int i = 0; i < 2; i++) {
        sea->scene.origin[0] = sea->scene.origin[2] = origins[i];
        draw(gfx, &sea->scene, drawn.rgb[0]);
        shift_scene(there);
        draw(gfx, &sea->scene, drawn.rgb[1]);
        shift_scene(back);
        double rms = difference_rms(drawn.rgb[0], drawn.rgb[1]);
        print_message("moved by 0.87 m at %.0f m: %.3f\n", origins[i], rms);
        assert_true(rms < 0.5);
        /* What would be seen if the ripples stayed behind. */
        sea->scene.origin[0] += 0.8;
        draw(gfx, &sea->scene, drawn.rgb[1]);
        assert_true(difference_rms(drawn.rgb[0], drawn.rgb[1]) > 2.0);
    }
    sea->scene.origin[0] = sea->scene.origin[2] = 0.0;
    gfx_destroy(gfx);
}

/* Seen from outside, the ocean hides what lies below its surface in the window, also where the particles' rim
 * is missing: the lower half of the picture shows the sea in front of the window, with particles or without.
 */
static void under_the_rim_nothing_is_seen(void **state) {
    (void)state;
    GfxScene scene = sea->scene;
    float *fade = malloc(scene.particles.count * sizeof *fade);
    assert_non_null(fade);
    for (uint32_t i = 0; i < scene.particles.count; i++)
        fade[i] = hypotf(sea->position[i][0], sea->position[i][2]) < 1.05f ? 1.0f : 0.0f;
    scene.particles.fade = fade;
    memcpy(scene.camera.eye, (float[3]){-4.0f, 0.8f, 0.0f}, sizeof scene.camera.eye);
    memcpy(scene.camera.target, (float[3]){-1.8f, 0.0f, 0.0f}, sizeof scene.camera.target);
    Gfx *gfx = open_gfx_or_skip(GFX_LOOK_WATER, 0);
    draw(gfx, &scene, drawn.rgb[0]);
    scene.particles.count = 0;
    draw(gfx, &scene, drawn.rgb[1]);
    gfx_destroy(gfx);
    free(fade);
    int most = 0, beyond = 0;
    for (int i = 0; i < SIZE; i++) {
        int step = abs(drawn.rgb[0][i] - drawn.rgb[1][i]);
        int *largest = i >= 3 * WIDTH * (HEIGHT / 2 + 3) ? &most : &beyond;
        *largest = step > *largest ? step : *largest;
    }
    print_message("in front of the window %d, beyond its edge %d\n", most, beyond);
    assert_true(most <= 2);
    assert_true(beyond > 30);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(images_are_those_stored),
        cmocka_unit_test(contexts_agree_bit_for_bit),
        cmocka_unit_test(images_repeat),
        cmocka_unit_test(window_moves_are_not_seen),
        cmocka_unit_test(under_the_rim_nothing_is_seen),
        cmocka_unit_test(a_missing_pass_is_seen),
    };
    return cmocka_run_group_tests_name("images", tests, set_up, tear_down);
}
