/* Input files: what is refused and with which words, what events do, that what is recorded drives alike, and
 * that no file at all brings the parser down. */
#include "app/helm.h"

#include <dirent.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

#include "engine/base/angle.h"
#include "engine/base/file.h"
#include "engine/base/random.h"

#define COUNT(table) ((int)(sizeof(table) / sizeof *(table)))

static ScriptWords default_words(void) {
    ScriptWords words = {0};
    words.keys = script_default_keys(&words.key_count);
    return words;
}

static Script parse(const char *text) {
    Script script;
    Err err = {0};
    const ScriptWords words = default_words();
    if (!script_parse("f", text, strlen(text), &words, &script, &err))
        fail_msg("%s", err.message);
    return script;
}

/* ---- The language ---- */

static const struct {
    const char *text, *message;
} bad[] = {
    {"1 thottle 1", "f:1: unknown command thottle, did you mean throttle?"},
    {"1 elephant",
     "f:1: unknown command elephant, expected one of press, release, throttle, rudder, heading, camera"},
    {"\n# x\n1", "f:3: a command is missing after the time"},
    {"throttle 1",
     "f:1: expected a time from -1000000 to 1000000 s, found throttle\n"
     "f:1: unknown command 1, expected one of press, release, throttle, rudder, heading, camera"},
    {"1e7 throttle 1", "f:1: expected a time from -1000000 to 1000000 s, found 1e7"},
    {"nan throttle 1", "f:1: expected a time from -1000000 to 1000000 s, found nan"},
    {"0x1 throttle 1", "f:1: expected a time from -1000000 to 1000000 s, found 0x1"},
    {"2 throttle 1\n1.5 throttle 0", "f:2: 1.5 s is before the line above, which is at 2 s"},
    {"1 throttle 1.01", "f:1: throttle: expected a number from -1 (astern) to 1, found 1.01"},
    {"1 throttle full", "f:1: throttle: expected a number from -1 (astern) to 1, found full"},
    {"1 throttle", "f:1: throttle: expected a number from -1 (astern) to 1, found nothing"},
    {"1 rudder -2", "f:1: rudder: expected a number from -1 (to port) to 1 (to starboard), found -2"},
    {"1 heading 361", "f:1: heading: expected degrees from -360 to 360, or off, found 361"},
    {"1 heading of", "f:1: heading: expected degrees from -360 to 360, or off, found of"},
    {"1 camera a/b", "f:1: camera: expected the name of a camera, found a/b"},
    {"1 press", "f:1: press: expected a key, found nothing"},
    {"1 press lft",
     "f:1: press: the key lft is not bound, did you mean left?; bound are w z up s down a q left d right"},
    {"1 press w\n2 press w", "f:2: press: w is already pressed, since line 1"},
    {"1 release w", "f:1: release: w is not pressed"},
    {"1 press w\n2 release w\n3 release w", "f:3: release: w is not pressed"},
    {"1 rudder 0 0", "f:1: rudder 0: nothing can follow, found 0"},
    {"1 rudder 0 0 0 0 0 0 0", "f:1: rudder 0: nothing can follow, found 0"},
    {"1 \x1b[31m 1", "f:1: unknown command ?[31m, expected one of press, release, throttle, rudder, heading, "
                     "camera"},
    {"3 throttle 2\n1 rudder x\n",
     "f:1: throttle: expected a number from -1 (astern) to 1, found 2\n"
     "f:2: 1 s is before the line above, which is at 3 s\n"
     "f:2: rudder: expected a number from -1 (to port) to 1 (to starboard), found x"},
};

static void bad_lines_are_named(void **state) {
    (void)state;
    const ScriptWords words = default_words();
    for (int i = 0; i < COUNT(bad); i++) {
        Script script;
        Err err = {0};
        if (script_parse("f", bad[i].text, strlen(bad[i].text), &words, &script, &err))
            fail_msg("not refused: %s", bad[i].text);
        assert_int_equal(err.code, ERR_INPUT);
        assert_string_equal(err.message, bad[i].message);
        assert_null(script.events);
        assert_int_equal(script.count, 0);
    }
}

static void cameras_are_looked_up(void **state) {
    (void)state;
    ScriptWords words = default_words();
    Script script;
    Err err = {0};
    static const char text[] = "1 camera chse";
    words.cameras = "chase|top";
    assert_false(script_parse("f", text, sizeof text - 1, &words, &script, &err));
    assert_string_equal(err.message,
                        "f:1: camera: there is no camera chse, did you mean chase?; there are chase|top");
}

static void no_text_is_refused(void **state) {
    (void)state;
    static char text[5000];
    Script script;
    const ScriptWords words = default_words();
    Err zero = {0}, length = {0}, many = {0};
    assert_false(script_parse("f", "1 throttle 1\n\0 2", 16, &words, &script, &zero));
    assert_string_equal(zero.message, "f:2: holds a zero byte: this is no text");
    memset(text, 'x', sizeof text);
    assert_false(script_parse("f", text, 256, &words, &script, &length));
    assert_string_equal(length.message, "f:1: 256 characters long, at most 255 are possible");
    for (size_t i = 0; i + 1 < sizeof text; i += 2)
        memcpy(text + i, "x\n", 2);
    assert_false(script_parse("f", text, sizeof text, &words, &script, &many));
    assert_non_null(strstr(many.message, "more problems")); /* none is dropped in silence */
}

static void good_lines_are_read(void **state) {
    (void)state;
    Script script = parse("# head\r\n\r\n  -1\tthrottle  0.5# no blank needed\r\n1 heading off\n"
                          "1 heading -90.5\n1e1 press up\n10 camera my_cam-2\n10.5 release up");
    assert_int_equal(script.count, 6);
    assert_int_equal(script.events[0].command, SCRIPT_THROTTLE);
    assert_float_equal(script.events[0].time, -1.0, 0.0);
    assert_float_equal(script.events[0].value, 0.5, 0.0);
    assert_int_equal(script.events[0].line, 3);
    assert_int_equal(script.events[1].command, SCRIPT_HEADING_OFF);
    assert_float_equal(script.events[2].value, -90.5, 0.0);
    assert_int_equal(script.events[3].key, 2);
    assert_float_equal(script.events[3].time, 10.0, 0.0);
    assert_string_equal(script.events[4].camera, "my_cam-2");
    assert_int_equal(script.events[5].line, 8);
    script_free(&script);
    script = parse("");
    assert_int_equal(script.count, 0);
    script_free(&script);
}

static void samples_are_good(void **state) {
    (void)state;
    DIR *folder = opendir(SKIFF_SOURCE_DIR "/assets/inputs");
    int count = 0;
    assert_non_null(folder);
    for (struct dirent *entry; (entry = readdir(folder));) {
        char path[512], *text;
        size_t size;
        Script script;
        Err err = {0};
        const ScriptWords words = default_words();
        if (!strstr(entry->d_name, ".input"))
            continue;
        snprintf(path, sizeof path, SKIFF_SOURCE_DIR "/assets/inputs/%.200s", entry->d_name);
        if (!file_read(path, 1 << 20, &text, &size, &err) ||
            !script_parse(entry->d_name, text, size, &words, &script, &err))
            fail_msg("%s", err.message);
        assert_true(script.count > 1);
        script_free(&script);
        free(text);
        count++;
    }
    closedir(folder);
    assert_true(count >= 5);
}

/* ---- What events do ---- */

static HelmPosition at(const char *text, double time) {
    const ScriptWords words = default_words();
    Script script = parse(text);
    Helm helm = helm_begin(&words);
    helm_advance(&helm, &script, time);
    script_free(&script);
    return helm_position(&helm);
}

static void events_wait_for_their_time(void **state) {
    (void)state;
    static const char text[] = "1 throttle 1\n";
    assert_float_equal(at(text, 0.999).throttle, 0.0, 0.0);
    assert_float_equal(at(text, 1).throttle, 1.0, 0.0);
    double time = 0; /* the step that begins at 1, but for the rounding of ten additions */
    for (int s = 0; s < 10; s++)
        time += 0.1;
    assert_true(time < 1);
    assert_float_equal(at(text, time).throttle, 1.0, 0.0);
}

static void keys_take_the_place_of_commands(void **state) {
    (void)state;
    static const char text[] = "1 throttle 0.2\n2 press w\n3 press up\n4 press s\n5 release w\n6 release up\n"
                               "7 release s\n8 press d\n9 press a\n10 release d\n";
    static const double throttle[] = {0, 0.2, 1, 1, 0, 0, -1, 0.2}, rudder[] = {1, 0, -1};
    for (int k = 0; k < COUNT(throttle); k++)
        assert_float_equal(at(text, k).throttle, throttle[k], 0.0);
    for (int k = 0; k < COUNT(rudder); k++)
        assert_float_equal(at(text, 8 + k).rudder, rudder[k], 0.0);
}

static void the_last_to_steer_wins(void **state) {
    (void)state;
    static const char text[] = "1 rudder 0.5\n2 heading 30\n3 rudder -0.5\n4 heading 40\n5 press d\n"
                               "6 heading 50\n7 heading off\n8 release d\n";
    HelmPosition position = at(text, 2);
    assert_true(position.hold);
    assert_float_equal(position.heading, 30.0, 0.0);
    assert_float_equal(position.rudder, 0.0, 0.0);
    position = at(text, 3);
    assert_false(position.hold);
    assert_float_equal(position.heading, 0.0, 0.0);
    assert_float_equal(position.rudder, -0.5, 0.0);
    assert_false(at(text, 5).hold);
    assert_float_equal(at(text, 5).rudder, 1.0, 0.0);
    assert_true(at(text, 6).hold);
    assert_float_equal(at(text, 7).rudder, 1.0, 0.0); /* d is still held */
    assert_float_equal(at(text, 8).rudder, 0.0, 0.0); /* `heading` put it amidships */
    const SkiffControls controls = helm_controls(&position);
    assert_float_equal(controls.rudder, -0.5, 0.0);
    position = at(text, 4);
    assert_float_equal(helm_controls(&position).heading, 40.0 / 180 * pi, 1e-15);
}

static void scenes_bind_other_keys(void **state) {
    (void)state;
    static const ScriptKey keys[] = {{"half", SCRIPT_KEY_THROTTLE, 0.5f, NULL},
                                     {"1", SCRIPT_KEY_CAMERA, 1, "top"}};
    static const char text[] = "0 press half\n0 press 1\n";
    const ScriptWords words = {.keys = keys, .key_count = 2};
    Script script;
    Helm helm = helm_begin(&words);
    assert_true(script_parse("f", text, strlen(text), &words, &script, NULL));
    helm_advance(&helm, &script, 0);
    const HelmPosition position = helm_position(&helm);
    assert_float_equal(position.throttle, 0.5, 0.0);
    assert_string_equal(position.camera, "top");
    script_free(&script);
}

/* ---- Recording ---- */

/* Counter-based, so that a failing case can be found again. */
static uint32_t mix(uint64_t n) {
    return (uint32_t)(random_bits(0, n) >> 32);
}

/* A random but valid file: all commands, many at the same time. */
static void make_file(FILE *out, uint64_t seed) {
    bool held[16] = {false};
    int count;
    double time = 0;
    const ScriptKey *keys = script_default_keys(&count);
    for (int i = 0; i < 60; i++) {
        const uint64_t n = seed * 1000 + (uint64_t)i * 5;
        const int key = (int)(mix(n + 1) % (uint32_t)count);
        const double value = (double)mix(n + 2) / 2147483648.0 - 1.0;
        time += (mix(n + 3) % 3) * 0.0037;
        switch (mix(n + 4) % 6) {
        case 0:
            fprintf(out, "%.9g throttle %.9g\n", time, mix(n) % 4 ? value : -0.0);
            break;
        case 1:
            fprintf(out, "%.9g rudder %.9g\n", time, mix(n) % 4 ? value : -0.0);
            break;
        case 2:
            fprintf(out, "%.9g heading %.9g\n", time, mix(n) % 4 ? 360 * value : -0.0);
            break;
        case 3:
            fprintf(out, "%.9g heading off\n", time);
            break;
        case 4:
            fprintf(out, "%.9g camera c%u\n", time, mix(n) % 3);
            break;
        default:
            fprintf(out, "%.9g %s %s\n", time, held[key] ? "release" : "press", keys[key].key);
            held[key] = !held[key];
        }
    }
}

enum { RECORD_STEPS = 120 };

/* Positions at the beginning of each step, and what was recorded; malloc'ed. */
static char *drive(const char *text, HelmPosition *positions) {
    const ScriptWords words = default_words();
    Script script = parse(text);
    Helm helm = helm_begin(&words);
    HelmPosition last = {0};
    char *record;
    size_t size;
    double time = 0;
    FILE *stream = open_memstream(&record, &size);
    assert_non_null(stream);
    for (int s = 0; s < RECORD_STEPS; s++) {
        helm_advance(&helm, &script, time);
        positions[s] = helm_position(&helm);
        helm_write_change(stream, time, &last, &positions[s]);
        last = positions[s];
        time += (double)0.003f;
    }
    assert_int_equal(fclose(stream), 0);
    script_free(&script);
    return record;
}

static void a_record_drives_alike(void **state) {
    (void)state;
    static HelmPosition first[RECORD_STEPS], second[RECORD_STEPS];
    for (uint64_t seed = 1; seed <= 300; seed++) {
        char *text;
        size_t size;
        FILE *stream = open_memstream(&text, &size);
        assert_non_null(stream);
        make_file(stream, seed);
        assert_int_equal(fclose(stream), 0);
        char *record = drive(text, first), *again = drive(record, second);
        assert_true(strlen(record) > 100);
        assert_string_equal(record, again);
        for (int s = 0; s < RECORD_STEPS; s++) {
            const SkiffControls a = helm_controls(&first[s]), b = helm_controls(&second[s]);
            if (!helm_same(&first[s], &second[s]) || memcmp(&a.throttle, &b.throttle, 2 * sizeof(double)) ||
                memcmp(&a.heading, &b.heading, sizeof(double)))
                fail_msg("seed %d, step %d: the record drives differently\n%s\n%s", (int)seed, s, text,
                         record);
        }
        free(text);
        free(record);
        free(again);
    }
}

/* ---- Hostile files ---- */

static void mutations_do_no_harm(void **state) {
    (void)state;
    static const char seed_text[] = "# x\n1 press w\n2.5 throttle 0.5\n3 heading -30 # y\n4 heading off\n"
                                    "5 release w\n6 camera chase\n7 rudder -1e-3\n";
    static const char bytes[] = "\0\n\r\t #-+.eE0129xnwa\x80\xff|\x1b";
    const ScriptWords words = default_words();
    int good = 0, refused = 0;
    for (uint64_t n = 0; n < 20000; n++) {
        char text[sizeof seed_text];
        size_t size = sizeof seed_text - 1;
        memcpy(text, seed_text, sizeof text);
        for (uint64_t change = 0; change <= mix(n * 40) % 4; change++) {
            const uint32_t place = mix(n * 40 + change * 4 + 1) % (uint32_t)size;
            text[place] = bytes[mix(n * 40 + change * 4 + 2) % (sizeof bytes - 1)];
            if (mix(n * 40 + change * 4 + 3) % 8 == 0)
                size = place + 1;
        }
        char *exact = malloc(size); /* so that a read past the end is seen */
        assert_non_null(exact);
        memcpy(exact, text, size);
        Script script;
        Err err = {0};
        if (script_parse("f", exact, size, &words, &script, &err)) {
            Helm helm = helm_begin(&words);
            helm_advance(&helm, &script, INFINITY);
            const HelmPosition position = helm_position(&helm);
            assert_true(fabs(position.throttle) <= 1 && fabs(position.rudder) <= 1);
            assert_true(fabs(position.heading) <= 360);
            assert_int_equal(helm.next, script.count);
            good++;
        } else {
            assert_int_equal(err.code, ERR_INPUT);
            assert_true(strncmp(err.message, "f:", 2) == 0);
            refused++;
        }
        script_free(&script);
        free(exact);
    }
    assert_true(good > 1000 && refused > 1000);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(bad_lines_are_named),
        cmocka_unit_test(cameras_are_looked_up),
        cmocka_unit_test(no_text_is_refused),
        cmocka_unit_test(good_lines_are_read),
        cmocka_unit_test(samples_are_good),
        cmocka_unit_test(events_wait_for_their_time),
        cmocka_unit_test(keys_take_the_place_of_commands),
        cmocka_unit_test(the_last_to_steer_wins),
        cmocka_unit_test(scenes_bind_other_keys),
        cmocka_unit_test(a_record_drives_alike),
        cmocka_unit_test(mutations_do_no_harm),
    };
    return cmocka_run_group_tests_name("script", tests, NULL, NULL);
}
