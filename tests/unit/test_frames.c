/* Frames: from a simulation, between its steps, to files and back; what fades; what is white. */
#include "app/foam.h"
#include "app/frames.h"
#include "app/scene.h"
#include "app/shade.h"

#include "engine/base/file.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include <cmocka.h>

#include "scratch.h"

/* A column of water that falls freely next to a box that turns, far from the origin of the world. */
static SkiffSim *falling(Err *err) {
    static const SkiffBlockDef block = {
        .start = {500, 1, -300}, .end = {500.2f, 1.2f, -299.8f}, .velocity = {3, 0, 0}, .repeat = 1};
    static SkiffBodyDef body;
    SkiffDef def = skiff_def_default();
    body = skiff_body_default();
    body.name = "box";
    body.geometry.kind = SKIFF_GEOMETRY_BOX;
    body.geometry.size[0] = body.geometry.size[1] = body.geometry.size[2] = 0.2f;
    body.geometry.translation[0] = 501;
    body.geometry.translation[1] = 1;
    body.geometry.translation[2] = -300;
    body.angular_velocity[1] = 10;
    body.velocity[0] = 2;
    body.free_axes = 0;
    def.blocks = &block;
    def.block_count = 1;
    def.bodies = &body;
    def.body_count = 1;
    def.threads = 1;
    return skiff_create(&def, err);
}

static void step(SkiffSim *sim) {
    Err err = {0};
    if (!skiff_step(sim, &err))
        fail_msg("%s", err.message);
}

static void frames_lie_between_steps(void **unused) {
    (void)unused;
    Err err = {0};
    SkiffSim *sim = falling(&err);
    if (!sim)
        fail_msg("%s", err.message);
    Frame first = {0}, half = {0}, whole = {0};
    FrameBody before[1];
    step(sim);
    double begin = skiff_time(sim);
    assert_true(frame_capture(&first, sim, NULL, 0, begin, &err));
    frame_poses(sim, before);
    step(sim);
    double end = skiff_time(sim), middle = 0.5 * (begin + end);
    assert_true(frame_capture(&half, sim, before, begin, middle, &err));
    assert_true(frame_capture(&whole, sim, before, begin, end, &err));
    assert_int_equal(half.live, whole.live);
    assert_true(half.count == half.live && half.live > 50);
    SkiffParticles now = skiff_particles(sim);
    for (uint32_t i = 0; i < whole.live; i++) {
        assert_memory_equal(whole.position[i], now.position[i], 3 * sizeof(float));
        /* The same particle in the frame before: order may have changed. */
        uint32_t j = 0;
        while (first.id[j] != whole.id[i])
            j++;
        for (int k = 0; k < 3; k++) {
            float mean = 0.5f * (first.position[j][k] + whole.position[i][k]);
            assert_true(fabsf(half.position[i][k] - mean) < 2e-6f);
        }
    }
    double angle = 2 * acos(fabs(before[0].rotation[0] * half.bodies[0].rotation[0] +
                                 before[0].rotation[1] * half.bodies[0].rotation[1] +
                                 before[0].rotation[2] * half.bodies[0].rotation[2] +
                                 before[0].rotation[3] * half.bodies[0].rotation[3]));
    assert_true(fabs(angle - 10 * (middle - begin)) < 1e-4);
    assert_true(fabs(half.bodies[0].position[0] -
                     0.5 * (before[0].position[0] + whole.bodies[0].position[0])) < 1e-12);
    assert_true(half.edge[0] == -INFINITY && !half.has_window);
    frame_free(&first);
    frame_free(&half);
    frame_free(&whole);
    skiff_destroy(sim);
}

/* ---- Files ---- */

/* Three particles, two of them alive. */
static void fill(Frame *frame) {
    static float position[3][4] = {{1, 2, 3}, {4, 5, 6}, {7, 8, 9}}, velocity[3][4] = {{0.5f}, {1}, {2}};
    static float density[3] = {1, 0.9f, 0}, pressure[3] = {10, 20, 0}, gone[3] = {0, 0, 0.1f};
    static float edge[3] = {-1, -0.5f, 0.25f};
    static uint64_t id[3] = {7, 1ull << 40, 9};
    static double birth[3] = {0, 1.5, 0.25};
    static FrameBody bodies[1] = {{{1e5, 2, 3}, {0, 0, 0, 1}, {4, 5, 6}}};
    *frame = (Frame){
        .time = 2,
        .rate = 30,
        .origin = {1e5, 0, -2e5},
        .spacing = 0.05f,
        .live = 2,
        .count = 3,
        .position = position,
        .velocity = velocity,
        .density = density,
        .pressure = pressure,
        .id = id,
        .birth = birth,
        .gone = gone,
        .edge = edge,
        .has_window = true,
        .window_centre = {1e5, 0.5, 3},
        .level = 0.25,
        .moves = 12,
        .bodies = bodies,
        .body_count = 1,
        .controls = {.throttle = 0.5, .rudder = NAN, .keys = "w left", .camera = "top", .has_keys = true}};
}

static void saved_frames_come_back(void **unused) {
    (void)unused;
    Err err = {0};
    Frame saved, loaded = {0};
    fill(&saved);
    if (!frame_save(&saved, "a.skiff", &err) || !frame_load(&loaded, "a.skiff", 1, &err))
        fail_msg("%s", err.message);
    assert_true(loaded.time == saved.time && loaded.rate == saved.rate && loaded.spacing == saved.spacing);
    assert_memory_equal(loaded.origin, saved.origin, sizeof saved.origin);
    assert_true(loaded.live == 2 && loaded.count == 3 && loaded.has_window && loaded.moves == 12);
    assert_memory_equal(loaded.window_centre, saved.window_centre, sizeof saved.window_centre);
    assert_true(loaded.level == saved.level);
    assert_memory_equal(loaded.position, saved.position, 3 * sizeof *saved.position);
    assert_memory_equal(loaded.velocity, saved.velocity, 3 * sizeof *saved.velocity);
    assert_memory_equal(loaded.density, saved.density, 3 * sizeof *saved.density);
    assert_memory_equal(loaded.pressure, saved.pressure, 3 * sizeof *saved.pressure);
    assert_memory_equal(loaded.id, saved.id, 3 * sizeof *saved.id);
    assert_memory_equal(loaded.birth, saved.birth, 3 * sizeof *saved.birth);
    assert_memory_equal(loaded.gone, saved.gone, 3 * sizeof *saved.gone);
    assert_memory_equal(loaded.edge, saved.edge, 3 * sizeof *saved.edge);
    assert_memory_equal(loaded.bodies, saved.bodies, sizeof *saved.bodies);
    assert_true(loaded.controls.throttle == 0.5 && isnan(loaded.controls.rudder) && loaded.controls.has_keys);
    assert_string_equal(loaded.controls.keys, "w left");
    assert_string_equal(loaded.controls.camera, "top");
    frame_free(&loaded);
}

static void refused(const char *path, int bodies, const char *reason) {
    Err err = {0};
    Frame frame = {0};
    assert_false(frame_load(&frame, path, bodies, &err));
    assert_int_equal(err.code, ERR_INPUT);
    if (!strstr(err.message, path) || !strstr(err.message, reason))
        fail_msg("expected '%s' and '%s' in: %s", path, reason, err.message);
    assert_true(frame.count == 0 && !frame.position);
}

static void bad_frames_are_refused(void **unused) {
    (void)unused;
    Frame frame;
    fill(&frame);
    assert_true(frame_save(&frame, "b.skiff", NULL));
    refused("b.skiff", 2, "bodies");
    refused("missing.skiff", 1, "cannot open");
    char *bytes;
    size_t size;
    assert_true(file_read("b.skiff", 1 << 20, &bytes, &size, NULL));
    for (size_t i = 0; i < size; i += 41) {
        bytes[i] ^= 0x10;
        assert_true(file_write("c.skiff", bytes, size, NULL));
        refused("c.skiff", 1, "");
        bytes[i] ^= 0x10;
    }
    for (size_t cut = 0; cut < size; cut += 97) {
        assert_true(file_write("c.skiff", bytes, cut, NULL));
        refused("c.skiff", 1, "");
    }
    free(bytes);
    /* Checksums are right, values are not. */
    float x = frame.position[1][1];
    frame.position[1][1] = NAN;
    assert_true(frame_save(&frame, "d.skiff", NULL));
    refused("d.skiff", 1, "position[1] is not finite");
    frame.position[1][1] = x;
    frame.spacing = 0;
    assert_true(frame_save(&frame, "d.skiff", NULL));
    refused("d.skiff", 1, "out of range");
    fill(&frame);
    frame.time = INFINITY;
    assert_true(frame_save(&frame, "d.skiff", NULL));
    refused("d.skiff", 1, "state[0] is not a finite number");
}

static void results_of_a_run_are_removed_and_nothing_else(void **unused) {
    (void)unused;
    char path[128];
    assert_true(file_make_directory("run/frames", NULL) && file_make_directory("run/particles", NULL));
    const char *const gone[] = {"frames/frame_000001.png", "frames/frame_000002.png.tmp", "video.mp4",
                                "particles/frame_000012.skiff"};
    const char *const kept[] = {"frames/frame_1.txt", "frames/mine.png", "other.mp4"};
    for (int i = 0; i < 4; i++) {
        snprintf(path, sizeof path, "run/%s", gone[i]);
        assert_true(file_write(path, "x", 1, NULL));
    }
    for (int i = 0; i < 3; i++) {
        snprintf(path, sizeof path, "run/%s", kept[i]);
        assert_true(file_write(path, "x", 1, NULL));
    }
    assert_int_equal(frames_last("run", "particles", "skiff"), 12);
    assert_int_equal(frames_last("run", "nowhere", "skiff"), 0);
    assert_true(frames_remove("run", NULL));
    for (int i = 0; i < 4; i++) {
        snprintf(path, sizeof path, "run/%s", gone[i]);
        assert_false(file_exists(path));
    }
    for (int i = 0; i < 3; i++) {
        snprintf(path, sizeof path, "run/%s", kept[i]);
        assert_true(file_exists(path));
    }
    assert_false(file_exists("run/particles"));
    assert_true(frames_remove("no-such-run", NULL));
}

/* ---- Fade ---- */

static void fade_follows_birth_removal_and_edge(void **unused) {
    (void)unused;
    SceneRender render = scene_render_default();
    Frame frame;
    float fade[3];
    fill(&frame); /* time 2; births 0, 1.5, 0.25; the third has been gone for 0.1 s */
    shade_fade(&render, &frame, 0, fade);
    assert_true(fade[0] == 1 && fade[1] == 1 && fade[2] > 0.5f && fade[2] < 1);
    render.fade_in = 1;
    shade_fade(&render, &frame, 0, fade);
    assert_true(fade[0] == 1 && fabsf(fade[1] - 0.5f) < 1e-6f);
    frame.time = 1.4; /* before the second is born */
    shade_fade(&render, &frame, 0, fade);
    assert_true(fade[1] == 0);
    frame.time = 2;
    frame.gone[2] = render.fade_out;
    shade_fade(&render, &frame, 0, fade);
    assert_true(fade[2] == 0);
    frame.gone[2] = 0.1f;
    /* Spheres also fade towards the edge; water leaves that to the ocean. */
    render.look = 1;
    render.fade_edge = 1;
    shade_fade(&render, &frame, 0, fade);
    assert_true(fade[0] == 1 && fabsf(fade[1] - 0.25f) < 1e-6f && fade[2] == 0);
    render.fade = false;
    shade_fade(&render, &frame, 0, fade);
    assert_true(fade[0] == 1 && fade[1] == 1 && fade[2] == 0);
}

static void fields_have_a_legend(void **unused) {
    (void)unused;
    SceneRender render = scene_render_default();
    Frame frame;
    float values[3];
    fill(&frame);
    shade_field(RENDER_SPEED, &frame, values);
    assert_true(values[0] == 0.5f && values[1] == 1);
    shade_field(RENDER_WINDOW, &frame, values);
    assert_true(values[0] == 1 && values[1] == 0.5f);
    shade_field(RENDER_AGE, &frame, values);
    assert_true(values[0] == 2 && values[1] == 0.5f);
    for (int field = 0; field < RENDER_FIELD_COUNT; field++) {
        render.field = field;
        ShadeLegend legend = shade_legend(&render);
        assert_true(legend.min < legend.max && *legend.title);
    }
    render.field = RENDER_SPEED;
    render.field_min = 50;
    assert_true(shade_legend(&render).min == 50 && shade_legend(&render).max > 50);
}

/* ---- Foam ---- */

enum { SIDE = 12, WATER = SIDE * SIDE * SIDE };

/* A block of water at rest, or one whose upper layers tear apart. */
static void fill_water(Frame *frame, float position[WATER][4], float velocity[WATER][4], uint64_t id[WATER],
                       bool is_torn) {
    *frame = (Frame){.spacing = 0.05f, .live = WATER, .count = WATER};
    for (int i = 0; i < WATER; i++) {
        int x = i % SIDE, y = i / SIDE % SIDE, z = i / SIDE / SIDE;
        const float at[3] = {0.0464f * (float)x, 0.0464f * (float)y, 0.0464f * (float)z};
        memcpy(position[i], at, sizeof at);
        float sign = (x + y + z) % 2 ? 1.0f : -1.0f;
        velocity[i][0] = is_torn && y >= SIDE - 3 ? 2 * sign : 0;
        id[i] = (uint64_t)i * 1000003u;
    }
    frame->position = position;
    frame->velocity = velocity;
    frame->id = id;
}

static void foam_where_water_tears(void **unused) {
    (void)unused;
    static float position[WATER][4], velocity[WATER][4], amount[WATER], finer[WATER];
    static uint64_t id[WATER];
    Frame frame;
    Foam *foam = foam_create();
    fill_water(&frame, position, velocity, id, false);
    for (int n = 0; n <= 30; n++) {
        frame.time = n / 30.0;
        assert_true(foam_update(foam, &frame, amount, NULL));
    }
    for (int i = 0; i < WATER; i++)
        assert_true(amount[i] == 0);
    foam_destroy(foam);

    foam = foam_create();
    Foam *other = foam_create();
    fill_water(&frame, position, velocity, id, true);
    for (int n = 0; n <= 60; n++) { /* half a second, at 60 and at 120 frames a second */
        frame.time = n / 120.0;
        assert_true(foam_update(other, &frame, finer, NULL));
        if (n % 2 == 0)
            assert_true(foam_update(foam, &frame, amount, NULL));
    }
    float top = 0, bottom = 0;
    for (int i = 0; i < WATER; i++) {
        int y = i / SIDE % SIDE;
        top += y == SIDE - 1 ? amount[i] : 0;
        bottom += y < SIDE / 2 ? amount[i] : 0;
        assert_true(amount[i] >= 0 && amount[i] <= 1 && fabsf(amount[i] - finer[i]) < 1e-4f);
    }
    assert_true(top / (SIDE * SIDE) > 0.5f && bottom == 0);

    /* It follows the particle's id to another place in memory, and decays at rest. */
    const int middle = 6 + (SIDE - 1) * SIDE + 6 * SIDE * SIDE; /* of the top layer */
    float before = amount[middle];
    fill_water(&frame, position, velocity, id, false);
    uint64_t swap = id[0];
    id[0] = id[middle];
    id[middle] = swap;
    frame.time = 0.5;
    assert_true(foam_update(foam, &frame, amount, NULL));
    assert_true(amount[0] == before && amount[middle] == 0);
    for (int n = 1; n <= 300; n++) {
        frame.time = 0.5 + n / 30.0;
        assert_true(foam_update(foam, &frame, amount, NULL));
    }
    assert_true(amount[0] < 0.02f && before > 0.5f);
    foam_destroy(foam);
    foam_destroy(other);
}

/* A drop very far away neither takes all memory nor leaves the grid. */
static void foam_of_scattered_water(void **unused) {
    (void)unused;
    float position[3][4] = {{0, 0, 0}, {3e4f, 2e4f, -3e4f}, {1, 1, 1}}, velocity[3][4] = {{0}}, amount[3];
    uint64_t id[3] = {1, 2, UINT64_MAX - 1};
    Frame frame = {
        .spacing = 0.05f, .live = 3, .count = 3, .position = position, .velocity = velocity, .id = id};
    Foam *foam = foam_create();
    assert_true(foam_update(foam, &frame, amount, NULL));
    frame.live = frame.count = 0;
    assert_true(foam_update(foam, &frame, amount, NULL));
    foam_destroy(foam);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(frames_lie_between_steps),
        cmocka_unit_test(saved_frames_come_back),
        cmocka_unit_test(bad_frames_are_refused),
        cmocka_unit_test(results_of_a_run_are_removed_and_nothing_else),
        cmocka_unit_test(fade_follows_birth_removal_and_edge),
        cmocka_unit_test(fields_have_a_legend),
        cmocka_unit_test(foam_where_water_tears),
        cmocka_unit_test(foam_of_scattered_water),
    };
    return cmocka_run_group_tests_name("frames", tests, scratch_enter, scratch_leave);
}
