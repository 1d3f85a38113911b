/* Pictures as a user gets them: the real program draws, films, resumes and draws again. Without a usable
 * OpenGL, which the program itself says, those that draw are skipped. */
#include "app/scene_table.h"
#include "app/view_options.h"
#include "engine/base/file.h"
#include "render/gfx.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>
#include <cmocka.h>

#include "scratch.h"

#define SMALL SKIFF_SOURCE_DIR "/assets/scenes/small.json"
#define NO_GL "__EGL_VENDOR_LIBRARY_DIRS=/nonexistent "

/* Runs the program with settings of the environment before it; checks exit code and what stderr contains. */
static void expect_with(const char *environment, const char *arguments, int code, const char *message) {
    char command[2048];
    snprintf(command, sizeof command, "%s'%s' %s >out.txt 2>err.txt", environment, SKIFF_PROGRAM, arguments);
    int status = system(command);
    char *text = scratch_read("err.txt");
    if (!WIFEXITED(status) || WEXITSTATUS(status) != code)
        fail_msg("skiff %s: status %x, expected exit code %d\n%s", arguments, (unsigned)status, code, text);
    if (!strstr(text, message))
        fail_msg("skiff %s: expected '%s' in:\n%s", arguments, message, text);
    free(text);
}

static void expect(const char *arguments, int code, const char *message) {
    expect_with("", arguments, code, message);
}

static void need_gl(void) {
    if (system("'" SKIFF_PROGRAM "' gl-info >/dev/null 2>&1") != 0) {
        print_message("no OpenGL: skipped\n");
        skip();
    }
}

static int count_frames(const char *run) {
    char path[256];
    int count = 0;
    for (;; count++) {
        snprintf(path, sizeof path, "%s/frames/frame_%06d.png", run, count + 1);
        if (!file_exists(path))
            return count;
    }
}

static bool same_frame(const char *a, const char *b, int number) {
    char path[256], *text[2];
    size_t size[2];
    const char *const runs[2] = {a, b};
    for (int i = 0; i < 2; i++) {
        snprintf(path, sizeof path, "%s/frames/frame_%06d.png", runs[i], number);
        assert_true(file_read(path, 1 << 26, &text[i], &size[i], NULL));
    }
    bool same = size[0] == size[1] && memcmp(text[0], text[1], size[0]) == 0;
    free(text[0]);
    free(text[1]);
    return same;
}

/* ---- */

static void words_are_the_renderers(void **unused) {
    (void)unused;
    char list[256] = "";
    for (int i = 0; i < GFX_BACKEND_COUNT; i++)
        snprintf(list + strlen(list), sizeof list - strlen(list), "%s%s", i > 0 ? "|" : "",
                 gfx_backend_name((GfxBackend)i));
    assert_string_equal(list, VIEW_BACKENDS);
    *list = '\0';
    for (int i = 0; i < GFX_LOOK_COUNT; i++)
        snprintf(list + strlen(list), sizeof list - strlen(list), "%s%s", i > 0 ? "|" : "",
                 gfx_look_name((GfxLook)i));
    assert_string_equal(list, RENDER_LOOKS);
    assert_string_equal(gfx_camera_kinds, RENDER_CAMERAS);
}

static void wrong_options_are_explained(void **unused) {
    (void)unused;
    expect("run " SMALL " -o a --no-render --video", 2, "--no-render and --video contradict each other");
    expect("run " SMALL " -o a --no-render --look water", 2, "--no-render and --look contradict");
    expect("run " SMALL " -o a --size 640", 2, "--size: expected WIDTHxHEIGHT");
    expect("run " SMALL " -o a --size 8x9000", 2, "found \"8x9000\"");
    expect("run " SMALL " -o a --frames 3:2", 2, "--frames: expected FIRST:LAST");
    expect("run " SMALL " -o a --look glass", 2, "--look: expected water|particles");
    expect("run " SMALL " -o a --size 33x32 --video", 2, "must be even, found 33x32");
    expect("render nothing", 3, "nothing: cannot open");
    expect("render", 2, "the folder of a run is missing");
    expect("gl-info x", 2, "takes options only");
    assert_false(file_exists("a"));
}

static void without_gl_it_says_what_to_install(void **unused) {
    (void)unused;
    expect_with(NO_GL, "gl-info --gl egl-device", 4, "apt-get install");
    expect_with(NO_GL, "run " SMALL " -o no-gl --gl egl", 4, "--no-render simulates without pictures");
    assert_false(file_exists("no-gl"));
    expect_with(NO_GL, "run " SMALL " -o no-gl --no-render --duration 0.006 -q", 0, "");
    assert_false(file_exists("no-gl/frames"));
}

static void no_ffmpeg_is_said_before_anything_is_done(void **unused) {
    (void)unused;
    assert_true(file_make_directory("empty", NULL));
    expect_with("PATH=empty ", "run " SMALL " -o no-ffmpeg --video", 6, "Debian package ffmpeg");
    assert_false(file_exists("no-ffmpeg"));
}

static void same_run_same_frames(void **unused) {
    (void)unused;
    need_gl();
    /* 0, 1/30, ... 9/30 s, from steps of 3 ms that meet none of them but the first and the last */
    expect("run " SMALL " -o one --size 160x90 --threads 1 --save-particles 30", 0, "OpenGL by");
    expect("run " SMALL " -o two --size 160x90 --threads 2 -q", 0, "");
    assert_int_equal(count_frames("one"), 10);
    assert_int_equal(count_frames("two"), 10);
    for (int i = 1; i <= 10; i++)
        assert_true(same_frame("one", "two", i));
}

static void saved_particles_give_the_same_frames(void **unused) {
    (void)unused;
    need_gl();
    if (!file_exists("one"))
        expect("run " SMALL " -o one --size 160x90 --threads 1 --save-particles 30", 0, "");
    expect("render one --size 160x90", 0, "10 frames in one/redrawn");
    for (int i = 1; i <= 10; i++)
        assert_true(same_frame("one", "one/redrawn", i));
    expect("render one", 2, "--force replaces");
    expect("render one --size 160x90 -o last --frames 9:10 -q", 0, "");
    assert_true(same_frame("one", "last", 9) && same_frame("one", "last", 10));
    assert_false(file_exists("last/frames/frame_000008.png"));
    expect("render one --size 160x90 -o balls --look particles --field density -q", 0, "");
    assert_false(same_frame("one", "balls", 5));
    expect("render one --size 160x90 -o above --camera top -q", 0, "");
    assert_false(same_frame("one", "above", 5));
    expect("render one --size 160x90 -o bare --hud off -q", 0, "");
    assert_false(same_frame("one", "bare", 5));
    expect("render one -o none --camera nowhere", 2, "there are chase, fixed, orbit, top, bow");
    expect("render one --frames 11:12 -o none", 2, "there are 10 saved frames");
    expect("render two", 3, "--save-particles FPS");
}

/* A crate shoved through a window that follows it: foam, the wake behind the window, moves. */
static void the_same_sea_gives_the_same_frames(void **unused) {
    (void)unused;
    static const char scene[] =
        "{\"version\": 1, \"Configuration\": {\"duration\": 0.5, \"particleRadius\": 0.05, \"timeStepSize\": "
        "0.005, \"escape\": \"remove\"}, \"Tank\": {\"type\": \"cylinder\", \"radius\": 1, \"height\": 2, "
        "\"translation\": [0, 1, 0], \"wetHeight\": 1}, \"Sea\": {\"level\": 0.5, \"follow\": \"crate\"}, "
        "\"RigidBodies\": [{\"name\": \"crate\", \"geometryFile\": \"" SKIFF_SOURCE_DIR
        "/assets/meshes/crate.obj\", \"scale\": [0.5, 0.5, 0.5], \"mass\": 40, \"translation\": [0, 0.5, 0], "
        "\"isDynamic\": true, \"velocity\": [3, 0, 0]}], \"Render\": {\"fadeEdge\": 0.1, \"fps\": 20}}";
    need_gl();
    assert_true(file_write("sea.json", scene, strlen(scene), NULL));
    expect("run sea.json -o sea-one --size 160x90 --threads 1 --save-particles 20 -q", 0, "");
    expect("run sea.json -o sea-two --size 160x90 --threads 2 -q", 0, "");
    expect("render sea-one --size 160x90 -o sea-again -q", 0, "");
    expect("run sea.json -o sea-resumed --size 160x90 --duration 0.28 -q", 0, "");
    expect("run sea.json -o sea-resumed --size 160x90 --resume -q", 0, "");
    expect("render sea-one --size 160x90 -o sea-pops --fade off -q", 0, "");
    assert_int_equal(count_frames("sea-one"), 11);
    for (int i = 1; i <= 11; i++) { /* what fades, foam, wake and camera go on where a run is resumed */
        assert_true(same_frame("sea-one", "sea-two", i) && same_frame("sea-one", "sea-again", i));
        assert_true(same_frame("sea-one", "sea-resumed", i));
    }
    assert_false(same_frame("sea-one", "sea-pops", 11));
}

static void export_needs_no_gl(void **unused) {
    (void)unused;
    expect("run " SMALL " -o plain --duration 0.05 --save-particles 50 --no-render -q", 0, "");
    assert_false(file_exists("plain/frames"));
    expect_with(NO_GL, "render plain --export ply", 0, "3 frames in plain/export");
    assert_true(file_exists("plain/export/frame_000003.ply"));
    expect_with(NO_GL, "render plain --export vtk -o vtk --frames 2:2", 0, "1 frames in vtk");
    assert_true(file_exists("vtk/frame_000002.vtu") && !file_exists("vtk/frame_000001.vtu"));
}

static void a_resumed_run_goes_on_filming(void **unused) {
    (void)unused;
    need_gl();
    if (system("command -v ffmpeg >/dev/null && command -v ffprobe >/dev/null") != 0) {
        print_message("ffmpeg or ffprobe is not installed: skipped\n");
        skip();
    }
    expect("run " SMALL " -o film --size 160x90 --fps 20 --video --duration 0.15 -q", 0, "");
    assert_int_equal(count_frames("film"), 4);
    expect("run " SMALL " -o film --size 160x90 --fps 20 --video --resume -q", 0, "");
    assert_int_equal(count_frames("film"), 7);
    expect("run " SMALL " -o whole --size 160x90 --fps 20 --render -q", 0, "");
    for (int i = 1; i <= 7; i++) /* foam and cameras go on as if nothing had happened */
        assert_true(same_frame("film", "whole", i));
    assert_int_equal(system("test \"$(ffprobe -v error -count_frames -select_streams v:0 -show_entries "
                            "stream=nb_read_frames -of csv=p=0 film/video.mp4)\" = 7"),
                     0);
    assert_true(file_write("film/view.skiff", "rubbish", 7, NULL));
    expect("run " SMALL " -o film --size 160x90 --fps 20 --resume --duration 0.36", 0,
           "foam and cameras begin anew: film/view.skiff: ");
    assert_int_equal(count_frames("film"), 8);
    /* A new run takes the old one's pictures away. */
    expect("run " SMALL " -o film --force --no-render --duration 0.006 -q", 0, "");
    assert_false(file_exists("film/video.mp4") || file_exists("film/frames"));
}

static void a_scene_can_ask_for_pictures(void **unused) {
    (void)unused;
    need_gl();
    char *scene = scratch_read(SMALL);
    FILE *stream = fopen("scene.json", "w");
    char *end = scene + strlen(scene);
    while (*end != '}')
        end--;
    *end = '\0';
    fprintf(
        stream,
        "%s, \"Render\": {\"fps\": 50, \"width\": 96, \"height\": 64, \"look\": \"particles\", \"cameras\": "
        "[{\"name\": \"crate_view\", \"type\": \"chase\", \"body\": \"crate\"}], \"bodies\": [{\"name\": "
        "\"crate\", \"material\": \"hull\"}]}}",
        scene);
    fclose(stream);
    free(scene);
    expect("run scene.json -o asked --duration 0.042 -q", 0, "");
    assert_int_equal(count_frames("asked"), 3);
    uint8_t rgb[96 * 64 * 3];
    assert_true(gfx_png_read("asked/frames/frame_000003.png", rgb, 96, 64, NULL));
    expect("run scene.json -o other --set Render.cameras[0].body=boat -q", 3,
           "Render.cameras[0]: there is no body \"boat\"");
    expect("run scene.json -o other --set Render.bodies[0].name=crates -q", 3, "did you mean crate?");
    expect("run scene.json -o other --set Render.camera=mast -q", 3, "there are crate_view, chase,");
}

static void input_files_cut_to_cameras(void **unused) {
    (void)unused;
    need_gl();
    assert_true(file_write("cut.input", "0.02 camera top\n", 16, NULL));
    assert_true(file_write("bad.input", "0 camera chase\n0.02 camera mast\n", 32, NULL));
    expect("run " SMALL " -o cut --input cut.input --size 96x64 --fps 50 --duration 0.042 --hud off -q", 0,
           "");
    expect("run " SMALL " -o uncut --size 96x64 --fps 50 --duration 0.042 --hud off -q", 0, "");
    expect("run " SMALL " -o top --camera top --size 96x64 --fps 50 --duration 0.042 --hud off -q", 0, "");
    assert_true(same_frame("cut", "uncut", 1) && same_frame("cut", "top", 3));
    assert_false(same_frame("cut", "uncut", 3));
    assert_true(file_write("at-once.input", "0 camera top\n", 13, NULL));
    expect("run " SMALL
           " -o at-once --input at-once.input --size 96x64 --frames 1:1 --duration 0.006 --hud off -q",
           0, "");
    assert_true(same_frame("at-once", "top", 1));
    expect("run " SMALL " -o bad --input bad.input --render", 3,
           "bad.input:2: camera: there is no camera mast; there are chase|");
    assert_false(file_exists("bad"));
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(words_are_the_renderers),
        cmocka_unit_test(wrong_options_are_explained),
        cmocka_unit_test(without_gl_it_says_what_to_install),
        cmocka_unit_test(no_ffmpeg_is_said_before_anything_is_done),
        cmocka_unit_test(same_run_same_frames),
        cmocka_unit_test(saved_particles_give_the_same_frames),
        cmocka_unit_test(export_needs_no_gl),
        cmocka_unit_test(the_same_sea_gives_the_same_frames),
        cmocka_unit_test(a_resumed_run_goes_on_filming),
        cmocka_unit_test(a_scene_can_ask_for_pictures),
        cmocka_unit_test(input_files_cut_to_cameras),
    };
    return cmocka_run_group_tests_name("pictures", tests, scratch_enter, scratch_leave);
}
