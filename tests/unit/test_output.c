/* What becomes of a finished picture: figures on it, PNG files, film. The film test needs ffmpeg and ffprobe
 * and says so when they are not there. */
#include "render/hud.h"
#include "render/png.h"
#include "render/writer.h"

#include "engine/base/file.h"

#include <math.h>
#include <limits.h>
#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>
#include <cmocka.h>

#include "scratch.h"

enum { WIDTH = 64, HEIGHT = 48, SIZE = WIDTH * HEIGHT * 3 };

static void paint(uint8_t rgb[SIZE], unsigned seed) {
    for (unsigned i = 0; i < SIZE; i++)
        rgb[i] = (uint8_t)((i * 31u + (i / 7u) * (seed + 3u) + seed * 57u) >> 2);
}

static void check_picture(const char *path, unsigned seed) {
    uint8_t expected[SIZE], found[SIZE];
    Err err = {0};
    paint(expected, seed);
    if (!gfx_png_read(path, found, WIDTH, HEIGHT, &err))
        fail_msg("%s", err.message);
    assert_memory_equal(found, expected, SIZE);
}

/* ---- PNG ---- */

static void png_round_trip(void **unused) {
    (void)unused;
    uint8_t rgb[SIZE];
    Err err = {0};
    paint(rgb, 1);
    assert_true(gfx_png_write("a.png", rgb, WIDTH, HEIGHT, &err));
    check_picture("a.png", 1);
    assert_false(file_exists("a.png.tmp"));
    assert_false(gfx_png_read("a.png", rgb, WIDTH + 1, HEIGHT, &err));
    assert_string_equal(err.message, "a.png: 64x48 pixels, expected 65x48");
    assert_true(file_write("b.png", "no picture", 10, &err));
    assert_false(gfx_png_read("b.png", rgb, WIDTH, HEIGHT, &err));
    assert_int_equal(err.code, ERR_INPUT);
    assert_memory_equal(err.message, "b.png: ", 7);
}

static void equal_pictures_are_equal_files(void **unused) {
    (void)unused;
    uint8_t rgb[SIZE];
    char *a, *b;
    size_t a_size, b_size;
    paint(rgb, 2);
    assert_true(gfx_png_write("1.png", rgb, WIDTH, HEIGHT, NULL));
    assert_true(gfx_png_write("2.png", rgb, WIDTH, HEIGHT, NULL));
    assert_true(file_read("1.png", 1 << 20, &a, &a_size, NULL));
    assert_true(file_read("2.png", 1 << 20, &b, &b_size, NULL));
    assert_int_equal(a_size, b_size);
    assert_memory_equal(a, b, a_size);
    free(a);
    free(b);
}

/* A file that may not grow stands for a full disk: both make write() fail half way. In a child, as the limit
 * cannot be taken back. */
static void a_full_disk_leaves_what_was_there(void **unused) {
    (void)unused;
    uint8_t rgb[SIZE];
    paint(rgb, 3);
    assert_true(gfx_png_write("full.png", rgb, WIDTH, HEIGHT, NULL));
    pid_t child = fork();
    if (child == 0) {
        const struct rlimit limit = {1000, 1000};
        Err err = {0};
        signal(SIGXFSZ, SIG_IGN);
        setrlimit(RLIMIT_FSIZE, &limit);
        for (unsigned i = 0; i < SIZE; i++) /* noise does not compress */
            rgb[i] = (uint8_t)(i * i * (i + 77u) * 2654435761u >> 13);
        bool written = gfx_png_write("full.png", rgb, WIDTH, HEIGHT, &err);
        _exit(!written && err.code == ERR_IO &&
                      strcmp(err.message, "full.png: cannot write: File too large") == 0
                  ? 0
                  : 1);
    }
    int status;
    assert_int_equal(waitpid(child, &status, 0), child);
    assert_int_equal(status, 0);
    check_picture("full.png", 3);
    assert_false(file_exists("full.png.tmp"));
}

/* ---- The background thread ---- */

static void writer_keeps_order_and_waits(void **unused) {
    (void)unused;
    enum { FRAMES = 40 };
    uint8_t rgb[SIZE];
    char path[64];
    Err err = {0};
    GfxWriter *writer = gfx_writer_begin(WIDTH, HEIGHT, 2, &err);
    assert_non_null(writer);
    for (int i = 0; i < FRAMES; i++) {
        snprintf(path, sizeof path, "w%03d.png", i);
        paint(rgb, (unsigned)i);
        assert_true(gfx_writer_add(writer, path, NULL, rgb, &err));
        memset(rgb, 0, sizeof rgb); /* the caller's buffer is free again at once */
    }
    assert_true(gfx_writer_finish(writer, &err));
    for (int i = 0; i < FRAMES; i++) {
        snprintf(path, sizeof path, "w%03d.png", i);
        check_picture(path, (unsigned)i);
    }
}

static void writer_stops_at_the_first_error(void **unused) {
    (void)unused;
    uint8_t rgb[SIZE];
    Err err = {0};
    GfxWriter *writer = gfx_writer_begin(WIDTH, HEIGHT, 3, &err);
    paint(rgb, 7);
    assert_true(gfx_writer_add(writer, "good.png", NULL, rgb, &err));
    assert_true(gfx_writer_add(writer, "nowhere/bad.png", NULL, rgb, &err));
    bool more = true;
    for (int i = 0; i < 10 && more; i++) /* the ring is shorter, so the failure shows on the way */
        more = gfx_writer_add(writer, "later.png", NULL, rgb, &err);
    assert_false(more);
    assert_int_equal(err.code, ERR_IO);
    assert_non_null(strstr(err.message, "nowhere/bad.png"));
    Err last = {0};
    assert_false(gfx_writer_finish(writer, &last));
    assert_string_equal(last.message, err.message);
    check_picture("good.png", 7);
    assert_false(file_exists("later.png"));
}

/* ---- Film ---- */

static bool have(const char *program) {
    char command[64];
    snprintf(command, sizeof command, "command -v %s >/dev/null 2>&1", program);
    return system(command) == 0;
}

static void film_is_what_was_asked_for(void **unused) {
    (void)unused;
    if (!have("ffmpeg") || !have("ffprobe")) {
        print_message("ffmpeg or ffprobe is not installed: skipped\n");
        skip();
    }
    uint8_t rgb[SIZE];
    Err err = {0};
    GfxVideo *video = gfx_video_begin("film.mp4", WIDTH, HEIGHT, 25, &err);
    if (!video)
        fail_msg("%s", err.message);
    GfxWriter *writer = gfx_writer_begin(WIDTH, HEIGHT, 2, &err);
    for (unsigned i = 0; i < 10; i++) {
        paint(rgb, i);
        assert_true(gfx_writer_add(writer, NULL, video, rgb, &err));
    }
    assert_true(gfx_writer_finish(writer, &err));
    assert_false(file_exists("film.mp4"));
    if (!gfx_video_finish(video, &err))
        fail_msg("%s", err.message);
    assert_false(file_exists("film.mp4.tmp"));
    assert_int_equal(system("ffprobe -v error -count_frames -select_streams v:0 -show_entries "
                            "stream=codec_name,width,height,pix_fmt,r_frame_rate,nb_read_frames -of csv=p=0 "
                            "film.mp4 > probe.txt"),
                     0);
    char *text;
    size_t size;
    assert_true(file_read("probe.txt", 4096, &text, &size, &err));
    assert_string_equal(text, "h264,64,48,yuv420p,25/1,10\n");
    free(text);
    /* faststart: the index stands before the pictures */
    assert_true(file_read("film.mp4", 1 << 24, &text, &size, &err));
    char *index = memmem(text, size, "moov", 4), *data = memmem(text, size, "mdat", 4);
    assert_true(index && data && index < data);
    free(text);
}

static void film_without_frames_leaves_nothing(void **unused) {
    (void)unused;
    if (!have("ffmpeg")) {
        print_message("ffmpeg is not installed: skipped\n");
        skip();
    }
    Err err = {0};
    GfxVideo *video = gfx_video_begin("empty.mp4", WIDTH, HEIGHT, 25, &err);
    assert_non_null(video);
    assert_true(gfx_video_finish(video, &err));
    assert_false(file_exists("empty.mp4") || file_exists("empty.mp4.tmp"));
}

static void set_program(const char *text) {
    assert_true(file_make_directory("bin", NULL));
    assert_true(file_write("bin/ffmpeg", text, strlen(text), NULL));
    assert_int_equal(chmod("bin/ffmpeg", 0755), 0);
}

/* An ffmpeg that dies must be a message, not a SIGPIPE. */
static void film_reports_what_ffmpeg_says(void **unused) {
    (void)unused;
    char *old = strdup(getenv("PATH"));
    char path[PATH_MAX];
    snprintf(path, sizeof path, "%s/bin:%s", scratch_folder, old);
    set_program("#!/bin/sh\necho first >&2\necho 'no room left' >&2\nexit 7\n");
    assert_int_equal(setenv("PATH", path, 1), 0);
    Err err = {0};
    GfxVideo *video = gfx_video_begin("dead.mp4", WIDTH, HEIGHT, 25, &err);
    assert_non_null(video);
    uint8_t rgb[SIZE] = {0};
    bool ok = true;
    for (int i = 0; i < 4000 && ok; i++)
        ok = gfx_video_add(video, rgb, &err);
    assert_false(ok);
    assert_int_equal(err.code, ERR_IO);
    assert_string_equal(err.message, "dead.mp4: ffmpeg stopped: no room left");
    Err last = {0};
    assert_false(gfx_video_finish(video, &last));
    assert_string_equal(last.message, "dead.mp4: ffmpeg failed: no room left");

    set_program("#!/bin/sh\ncat >/dev/null\necho 'cannot close' >&2\nexit 1\n");
    video = gfx_video_begin("late.mp4", WIDTH, HEIGHT, 25, &err);
    assert_non_null(video);
    assert_true(gfx_video_add(video, rgb, &err));
    assert_false(gfx_video_finish(video, &last));
    assert_string_equal(last.message, "late.mp4: ffmpeg failed: cannot close");
    assert_false(file_exists("late.mp4"));

    snprintf(path, sizeof path, "%s/nothing", scratch_folder);
    assert_int_equal(setenv("PATH", path, 1), 0);
    assert_null(gfx_video_begin("missing.mp4", WIDTH, HEIGHT, 25, &err));
    assert_int_equal(err.code, ERR_IO);
    assert_non_null(strstr(err.message, "Debian package ffmpeg"));
    assert_int_equal(setenv("PATH", old, 1), 0);
    free(old);
    assert_null(gfx_video_begin("odd.mp4", 63, HEIGHT, 25, &err));
    assert_int_equal(err.code, ERR_USAGE);
}

/* ---- Figures ---- */

/* Pixels that drawing has changed inside [x0, x1) x [y0, y1). */
static int changed(const GfxHudValues *values, const int area[4]) {
    enum { W = 1280, H = 720 };
    uint8_t *rgb = malloc(W * H * 3);
    Err err = {0};
    GfxHud *hud = gfx_hud_create(H, &err);
    assert_non_null(rgb);
    assert_non_null(hud);
    memset(rgb, 128, W * H * 3);
    gfx_hud_draw(hud, (GfxImage){rgb, W, H}, values);
    int count = 0;
    for (int y = area[1]; y < area[3]; y++)
        for (int x = area[0]; x < area[2]; x++)
            count += memcmp(rgb + 3 * (y * W + x), (uint8_t[3]){128, 128, 128}, 3) != 0;
    gfx_hud_destroy(hud);
    free(rgb);
    return count;
}

static void hud_shows_what_is_given(void **unused) {
    (void)unused;
    const int all[4] = {0, 0, 1280, 720}, counts[4] = {0, 0, 320, 180}, dash[4] = {0, 600, 400, 720};
    const int keys[4] = {1000, 640, 1280, 720};
    GfxHudValues values = gfx_hud_nothing();
    assert_int_equal(changed(&values, all), 0);
    values.time = 3.42;
    int time_only = changed(&values, counts);
    assert_true(time_only > 1000 && time_only == changed(&values, all));
    values.particles = 204396;
    assert_true(changed(&values, counts) > time_only);
    assert_int_equal(changed(&values, dash), 0);
    values.speed = 5.8;
    int speed_only = changed(&values, dash);
    values.rudder = -0.5;
    assert_true(speed_only > 1000 && changed(&values, dash) > speed_only);
    values.keys = "";
    assert_int_equal(changed(&values, keys), 0);
    values.keys = "w";
    int one = changed(&values, keys);
    values.keys = " w  left ";
    assert_true(one > 500 && changed(&values, keys) > 2 * one);
    /* No key name is too long, no picture too small. */
    values.keys = "a-key-with-a-name-that-does-not-fit-anywhere-at-all";
    assert_true(changed(&values, keys) > one);
    uint8_t tiny[16 * 16 * 3] = {0};
    GfxHud *hud = gfx_hud_create(16, NULL);
    gfx_hud_draw(hud, (GfxImage){tiny, 16, 16}, &values);
    gfx_hud_destroy(hud);
}

static void text_is_measured_as_drawn(void **unused) {
    (void)unused;
    uint8_t rgb[SIZE] = {0};
    TextFont *font = text_font_create(16, NULL);
    const GfxInk white = {255, 255, 255, 1};
    float end = text_draw(font, (GfxImage){rgb, WIDTH, HEIGHT}, 4, 20, white, "123");
    assert_true(fabsf(end - 4 - text_width(font, "123")) < 1e-4f);
    assert_true(text_width(font, "111") == text_width(font, "888")); /* numbers do not shake */
    assert_true(text_width(font, "\xc3\xa9") == text_width(font, "??"));
    int left = WIDTH, right = 0, top = HEIGHT, bottom = 0, grey = 0;
    for (int y = 0; y < HEIGHT; y++)
        for (int x = 0; x < WIDTH; x++)
            if (rgb[3 * (y * WIDTH + x)]) {
                left = x < left ? x : left;
                right = x > right ? x : right;
                top = y < top ? y : top;
                bottom = y > bottom ? y : bottom;
                grey += rgb[3 * (y * WIDTH + x)] < 255;
            }
    assert_true(left >= 4 && (float)right < end && bottom <= 20 && grey > 20);
    assert_true(fabsf((float)(20 - top) - text_cap_height(font)) < 2);
    text_draw(font, (GfxImage){rgb, WIDTH, HEIGHT}, -30.3f, -2, white, "outside on two sides");
    text_draw(font, (GfxImage){rgb, WIDTH, HEIGHT}, 50, 50, white, "outside");
    text_font_destroy(font);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(png_round_trip),
        cmocka_unit_test(equal_pictures_are_equal_files),
        cmocka_unit_test(a_full_disk_leaves_what_was_there),
        cmocka_unit_test(writer_keeps_order_and_waits),
        cmocka_unit_test(writer_stops_at_the_first_error),
        cmocka_unit_test(film_is_what_was_asked_for),
        cmocka_unit_test(film_without_frames_leaves_nothing),
        cmocka_unit_test(film_reports_what_ffmpeg_says),
        cmocka_unit_test(hud_shows_what_is_given),
        cmocka_unit_test(text_is_measured_as_drawn),
    };
    return cmocka_run_group_tests_name("output", tests, scratch_enter, scratch_leave);
}
