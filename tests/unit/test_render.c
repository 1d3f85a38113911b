/* The renderer without a picture: which particles are chosen, what is refused and with which words. The
 * pictures are in tests/golden/test_images.c. */
#include "render/gfx.h"
#include "render/surface.h"
#include "render/tables.h"

#include <math.h>
#include <omp.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { EDGE = 24, LAYERS = 12, COUNT = EDGE * EDGE * LAYERS };

#define SPACING 0.05f

/* A block of water, its top at y = 0, and room for one more particle. */
static float position[COUNT + 1][4], fade[COUNT + 1];

static GfxScene make_block(void) {
    uint32_t i = 0;
    float d = 0.928f * SPACING;
    for (int y = 0; y < LAYERS; y++)
        for (int z = 0; z < EDGE; z++)
            for (int x = 0; x < EDGE; x++, i++) {
                float p[4] = {((float)x + 0.5f) * d, ((float)y - LAYERS + 0.5f) * d, ((float)z + 0.5f) * d,
                              0.0f};
                memcpy(position[i], p, sizeof p);
                fade[i] = 1.0f;
            }
    fade[COUNT] = 1.0f;
    GfxScene scene = gfx_scene_default();
    scene.particles.count = COUNT;
    scene.particles.spacing = SPACING;
    scene.particles.position = (const float(*)[4])position;
    scene.particles.fade = fade;
    memcpy(scene.camera.eye, (float[3]){0.5f, 3.0f, 0.5f}, sizeof scene.camera.eye);
    return scene;
}

static void select_or_fail(Surface *surface, const GfxScene *scene, GfxLook look) {
    Err err = {0};
    if (!surface_select(surface, scene, look, &err))
        fail_msg("%s", err.message);
}

/* Of the points away from the block's sides, whose cells are filled in part. */
static float lowest_inside(const SurfaceList *list) {
    float y = INFINITY;
    for (uint32_t i = 0; i < list->count; i++) {
        const float *p = list->points[i].position;
        bool inside = fabsf(p[0] - 0.55f) < 0.3f && fabsf(p[2] - 0.55f) < 0.3f;
        y = inside ? fminf(y, p[1]) : y;
    }
    return y;
}

static void only_upper_layers_of_an_ocean_are_drawn(void **state) {
    (void)state;
    Surface surface = {0};
    GfxScene scene = make_block();
    static const float inside[4] = {9.0f, 9.0f, 9.0f, 9.0f};
    scene.ocean.enabled = true;
    scene.ocean.edge_distance = inside;
    for (int k = 0; k < 2; k++) {
        scene.ocean.edge_min[k] = -5.0f;
        scene.ocean.edge_max[k] = 5.0f;
    }
    select_or_fail(&surface, &scene, GFX_LOOK_WATER);
    /* The whole top layer, and nothing more than two cells down. */
    assert_in_range(surface.body.count, EDGE * EDGE, 4 * EDGE * EDGE);
    assert_true(lowest_inside(&surface.body) > -4.5f * SPACING);
    assert_int_equal(surface.droplets.count, 0);
    assert_int_equal(surface.fading.count, 0);
    /* Nothing where the ocean is drawn instead. */
    static const float beyond[4] = {-20.0f, -20.0f, -20.0f, -20.0f};
    scene.ocean.edge_distance = beyond;
    select_or_fail(&surface, &scene, GFX_LOOK_WATER);
    assert_int_equal(surface.body.count, 0);
    surface_free(&surface);
}

static void sides_towards_the_eye_are_drawn_without_an_ocean(void **state) {
    (void)state;
    Surface surface = {0};
    GfxScene scene = make_block();
    memcpy(scene.camera.eye, (float[3]){-3.0f, 1.0f, 0.5f}, sizeof scene.camera.eye);
    select_or_fail(&surface, &scene, GFX_LOOK_PARTICLES);
    uint32_t near_bottom = 0, far_bottom = 0;
    for (uint32_t i = 0; i < surface.body.count; i++) {
        const float *p = surface.body.points[i].position;
        if (p[1] < -8.0f * SPACING) {
            near_bottom += p[0] < SPACING;
            far_bottom += p[0] > (EDGE - 2) * SPACING;
        }
    }
    assert_true(near_bottom > 2 * EDGE);
    assert_int_equal(far_bottom, 0);
    assert_true(surface.body.count < COUNT / 2);
    surface_free(&surface);
}

static void a_lone_particle_becomes_droplets(void **state) {
    (void)state;
    Surface surface = {0};
    GfxScene scene = make_block();
    scene.particles.count = COUNT + 1;
    memcpy(position[COUNT], (float[4]){0.5f, 0.4f, 0.5f, 0.0f}, sizeof position[0]);
    select_or_fail(&surface, &scene, GFX_LOOK_WATER);
    assert_in_range(surface.droplets.count, 3, 30);
    for (uint32_t i = 0; i < surface.droplets.count; i++) {
        const SurfacePoint *drop = &surface.droplets.points[i];
        for (int k = 0; k < 3; k++)
            assert_true(fabsf(drop->position[k] - position[COUNT][k]) < 2.0f * SPACING);
        assert_true(drop->value > 0.0f && drop->value < 0.5f * SPACING);
    }
    /* The look of particles shows it as what it is. */
    select_or_fail(&surface, &scene, GFX_LOOK_PARTICLES);
    assert_int_equal(surface.droplets.count, 0);
    bool found = false;
    for (uint32_t i = 0; i < surface.body.count; i++)
        found = found || memcmp(surface.body.points[i].position, position[COUNT], sizeof(float[3])) == 0;
    assert_true(found);
    surface_free(&surface);
}

static void fading_particles_come_last_and_far_first(void **state) {
    (void)state;
    Surface surface = {0};
    GfxScene scene = make_block();
    memcpy(scene.camera.eye, (float[3]){-3.0f, 1.0f, 0.5f}, sizeof scene.camera.eye);
    memcpy(scene.camera.target, (float[3]){0.5f, 1.0f, 0.5f}, sizeof scene.camera.target);
    for (int i = 0; i < COUNT; i++)
        fade[i] = i % 3 == 0 ? 0.6f : i % 3 == 1 ? 0.0f : 1.0f;
    select_or_fail(&surface, &scene, GFX_LOOK_PARTICLES);
    assert_true(surface.fading.count > EDGE);
    for (uint32_t i = 0; i < surface.body.count; i++)
        assert_true(surface.body.points[i].fade == 1.0f);
    for (uint32_t i = 0; i < surface.fading.count; i++) {
        assert_true(surface.fading.points[i].fade == 0.6f);
        if (i > 0)
            assert_true(surface.fading.points[i].position[0] <=
                        surface.fading.points[i - 1].position[0] + 1e-3f);
    }
    surface_free(&surface);
}

static void the_choice_repeats_and_a_far_particle_is_no_harm(void **state) {
    (void)state;
    Surface a = {0}, b = {0};
    GfxScene scene = make_block();
    select_or_fail(&a, &scene, GFX_LOOK_WATER);
    select_or_fail(&b, &scene, GFX_LOOK_WATER);
    assert_int_equal(a.body.count, b.body.count);
    assert_memory_equal(a.body.points, b.body.points, a.body.count * sizeof *a.body.points);
    uint32_t before = a.body.count;
    scene.particles.count = COUNT + 1;
    memcpy(position[COUNT], (float[4]){900.0f, 700.0f, -800.0f, 0.0f}, sizeof position[0]);
    select_or_fail(&a, &scene, GFX_LOOK_WATER);
    assert_true(a.body.count >= before);
    scene.particles.count = 0;
    select_or_fail(&a, &scene, GFX_LOOK_WATER);
    assert_int_equal(a.body.count, 0);
    surface_free(&a);
    surface_free(&b);
}

static void particles_that_are_not_finite_are_named(void **state) {
    (void)state;
    Surface surface = {0};
    Err err = {0};
    GfxScene scene = make_block();
    position[77][1] = NAN;
    assert_false(surface_select(&surface, &scene, GFX_LOOK_WATER, &err));
    assert_int_equal(err.code, ERR_USAGE);
    assert_string_equal(err.message, "particle 77 of 6912 has coordinate y = nan");
    surface_free(&surface);
}

static void bad_sizes_are_refused(void **state) {
    (void)state;
    Err err = {0};
    GfxDef def = gfx_def_default();
    def.width = 8;
    assert_null(gfx_create(&def, &err));
    assert_int_equal(err.code, ERR_USAGE);
    assert_string_equal(err.message, "the image is 8 x 720; with supersample 1 possible are 16 to 8192");
    def = gfx_def_default();
    def.supersample = 5;
    assert_null(gfx_create(&def, &err));
    assert_string_equal(err.message, "supersample is 5; possible are 1 to 4");
}

static Gfx *small_gfx_or_skip(void) {
    Err err = {0};
    GfxDef def = gfx_def_default();
    def.width = def.height = 32;
    def.look = GFX_LOOK_PARTICLES;
    Gfx *gfx = gfx_create(&def, &err);
    if (!gfx) {
        assert_int_equal(err.code, ERR_GL);
        assert_non_null(strstr(err.message, "apt-get install"));
        skip();
    }
    return gfx;
}

static void expect_refused(Gfx *gfx, const GfxScene *scene, const char *message) {
    static uint8_t rgb[32 * 32 * 3];
    Err err = {0};
    assert_false(gfx_draw(gfx, scene, rgb, &err));
    assert_int_equal(err.code, ERR_USAGE);
    assert_string_equal(err.message, message);
}

static void bad_scenes_are_refused_and_do_no_harm(void **state) {
    (void)state;
    static uint8_t before[32 * 32 * 3], after[32 * 32 * 3];
    Err err = {0};
    Gfx *gfx = small_gfx_or_skip();
    const GfxScene good = make_block();
    assert_true(gfx_draw(gfx, &good, before, &err));
    GfxScene scene = good;
    scene.camera.target[0] = scene.camera.eye[0];
    scene.camera.target[2] = scene.camera.eye[2];
    expect_refused(gfx, &scene, "camera: the view has no length, or up points along it");
    scene = good;
    scene.camera.near_plane = 0.0f;
    expect_refused(gfx, &scene, "camera: near plane 0 m, far plane 500 m; needed is 0 < near < far");
    scene = good;
    scene.sun[1] = -1.0f;
    expect_refused(gfx, &scene, "sun: direction (0.65, -1, -0.45); it must point up");
    scene = good;
    scene.ocean.enabled = true;
    expect_refused(gfx, &scene, "ocean: no distances to the window's edge");
    static const float samples[4] = {0.0f};
    scene.ocean.edge_distance = scene.ocean.foam = samples;
    scene.ocean.edge_max[0] = scene.ocean.edge_max[1] = 1.0f;
    expect_refused(gfx, &scene, "ocean: 0 amounts of foam along x; possible are 2 to 4096");
    scene.ocean.foam_size[0] = scene.ocean.foam_size[1] = 2;
    expect_refused(gfx, &scene, "ocean: amounts of foam lie between x = 0 and 0 m");
    scene = good;
    GfxInstance instance = {.mesh = 3};
    scene.instances = &instance;
    scene.instance_count = 1;
    expect_refused(gfx, &scene, "instance 0 shows mesh 3; there are 0");
    scene = good;
    scene.field.max = scene.field.min;
    expect_refused(gfx, &scene, "field: range 0 to 0 is empty");
    assert_true(gfx_draw(gfx, &good, after, &err));
    assert_memory_equal(before, after, sizeof before);
    gfx_destroy(gfx);
}

static void bad_meshes_are_refused(void **state) {
    (void)state;
    Gfx *gfx = small_gfx_or_skip();
    float vertices[3][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    uint32_t triangles[1][3] = {{0, 1, 2}};
    GfxMeshDef mesh = {(const float(*)[3])vertices,
                       3,
                       (const uint32_t(*)[3])triangles,
                       1,
                       NULL,
                       gfx_material_default(GFX_MATERIAL_STONE)};
    Err err = {0};
    assert_int_equal(gfx_add_mesh(gfx, &mesh, &err), 0);
    triangles[0][2] = 3;
    assert_int_equal(gfx_add_mesh(gfx, &mesh, &err), -1);
    assert_int_equal(err.code, ERR_INPUT);
    assert_string_equal(err.message, "mesh 1: triangle 0 has vertex 3; there are 3");
    triangles[0][2] = 2;
    vertices[1][0] = INFINITY;
    assert_int_equal(gfx_add_mesh(gfx, &mesh, &err), -1);
    assert_string_equal(err.message, "mesh 1: vertex 1 has coordinate x = inf");
    gfx_destroy(gfx);
}

static void colors_grow_lighter(void **state) {
    (void)state;
    int last = -1;
    for (int i = 0; i <= 100; i++) {
        uint8_t rgb[3];
        tables_color((float)i / 100.0f, rgb);
        int light = 299 * rgb[0] + 587 * rgb[1] + 114 * rgb[2];
        assert_true(light > last);
        last = light;
    }
}

/* Odd sizes, eyes above, beside and in the water, both looks, with and without an ocean: the picture is that
 * of one thread. */
static void number_of_threads_does_not_matter(void **state) {
    (void)state;
    static const int sizes[][3] = {{16, 16, 1}, {17, 19, 1}, {83, 31, 2}};
    static const float eyes[][3] = {{0.5f, 3.0f, 0.6f}, {-0.3f, 0.05f, 0.5f}, {0.5f, -0.2f, 0.5f}};
    static uint8_t one[83 * 31 * 3], three[83 * 31 * 3];
    static const float inside[4] = {9.0f, 9.0f, 9.0f, 9.0f};
    GfxScene scene = make_block();
    scene.ocean.edge_distance = inside;
    for (int k = 0; k < 2; k++) {
        scene.ocean.edge_min[k] = -5.0f;
        scene.ocean.edge_max[k] = 5.0f;
    }
    for (int i = 0; i < COUNT; i++)
        fade[i] = i % 5 == 0 ? 0.5f : 1.0f;
    int threads = omp_get_max_threads();
    for (int i = 0; i < 3 * 2; i++) {
        const int *size = sizes[i / 2];
        Err err = {0};
        GfxDef def = gfx_def_default();
        def.width = size[0];
        def.height = size[1];
        def.supersample = size[2];
        def.look = i % 2 ? GFX_LOOK_WATER : GFX_LOOK_PARTICLES;
        Gfx *gfx = gfx_create(&def, &err);
        if (!gfx) {
            assert_int_equal(err.code, ERR_GL);
            skip();
        }
        for (int k = 0; k < 3 * 2; k++) {
            scene.ocean.enabled = k % 2;
            memcpy(scene.camera.eye, eyes[k / 2], sizeof scene.camera.eye);
            memcpy(scene.camera.target, (float[3]){0.6f, -0.1f, 0.4f}, sizeof scene.camera.target);
            omp_set_num_threads(1);
            assert_true(gfx_draw(gfx, &scene, one, &err));
            omp_set_num_threads(3);
            assert_true(gfx_draw(gfx, &scene, three, &err));
            omp_set_num_threads(threads);
            assert_memory_equal(one, three, (size_t)size[0] * (size_t)size[1] * 3);
        }
        gfx_destroy(gfx);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(only_upper_layers_of_an_ocean_are_drawn),
        cmocka_unit_test(sides_towards_the_eye_are_drawn_without_an_ocean),
        cmocka_unit_test(a_lone_particle_becomes_droplets),
        cmocka_unit_test(fading_particles_come_last_and_far_first),
        cmocka_unit_test(the_choice_repeats_and_a_far_particle_is_no_harm),
        cmocka_unit_test(particles_that_are_not_finite_are_named),
        cmocka_unit_test(bad_sizes_are_refused),
        cmocka_unit_test(bad_scenes_are_refused_and_do_no_harm),
        cmocka_unit_test(bad_meshes_are_refused),
        cmocka_unit_test(colors_grow_lighter),
        cmocka_unit_test(number_of_threads_does_not_matter),
    };
    return cmocka_run_group_tests_name("render", tests, NULL, NULL);
}
