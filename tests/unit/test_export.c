/* Exported particles, read back by readers that know nothing of the writer: meshio for vtk and ply (skipped
 * where Debian's python3-meshio is not installed), and for bgeo one written here from Partio's reader, byte
 * by byte. */
#include "app/export.h"

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

/* meshio 5.0 mixes up arrays whose place in the file happens to equal one that it has computed for another;
 * with these numbers of particles none does. */
enum { COUNT = 30, LIVE = 29 };

static float position[COUNT][4], velocity[COUNT][4], density[COUNT], edge[COUNT];
static uint64_t id[COUNT];
static double birth[COUNT];

/* The last particle is a ghost, which is not exported. */
static Frame make_frame(void) {
    for (int i = 0; i < COUNT; i++) {
        for (int k = 0; k < 3; k++) {
            position[i][k] = 0.25f * (float)(i + 4 * k);
            velocity[i][k] = (float)(i - k) / 3;
        }
        density[i] = 0.9f + 0.02f * (float)i;
        edge[i] = -0.3f * (float)i;
        id[i] = 100u + 7u * (unsigned)i;
        birth[i] = 0.1 * i;
    }
    return (Frame){.time = 1.25,
                   .origin = {1000, 0, -2000},
                   .live = LIVE,
                   .count = COUNT,
                   .position = position,
                   .velocity = velocity,
                   .density = density,
                   .id = id,
                   .birth = birth,
                   .edge = edge,
                   .has_window = true};
}

static void save_as(const Frame *frame, ExportFormat format, const char *path) {
    Err err = {0};
    if (!export_write(frame, 1000, format, path, &err))
        fail_msg("%s", err.message);
}

/* ---- meshio ---- */

/* One line a particle, sorted names: x y z, then every value of every attribute. */
static const char script[] = "import sys, meshio\n"
                             "m = meshio.read(sys.argv[1])\n"
                             "d = m.point_data\n"
                             "print(' '.join(sorted(d)))\n"
                             "for i in range(len(m.points)):\n"
                             "    v = list(m.points[i])\n"
                             "    for k in sorted(d): v += list(d[k][i].flatten())\n"
                             "    print(' '.join(repr(float(x)) for x in v))\n";

static char *read_with_meshio(const char *path) {
    char command[256], *text;
    size_t size;
    if (system("/usr/bin/python3 -c 'import meshio' 2>/dev/null") != 0) {
        print_message("python3-meshio is not installed: skipped\n");
        skip();
    }
    assert_true(file_write("read.py", script, sizeof script - 1, NULL));
    snprintf(command, sizeof command, "/usr/bin/python3 read.py %s > read.txt", path);
    assert_int_equal(system(command), 0);
    assert_true(file_read("read.txt", 1 << 20, &text, &size, NULL));
    return text;
}

static double next_number(char **text) {
    char *end;
    double value = strtod(*text, &end);
    assert_true(end != *text);
    *text = end;
    return value;
}

static void expect_number(char **text, double expected) {
    double found = next_number(text);
    if (fabs(found - expected) > 1e-6 * fmax(1, fabs(expected)))
        fail_msg("found %.9g, expected %.9g", found, expected);
}

/* In the order of the names: birth, density, edge_distance, id, velocity. */
static void check_numbers(char *text, const Frame *frame) {
    char *rest = strchr(text, '\n');
    for (uint32_t i = 0; i < LIVE; i++) {
        for (int k = 0; k < 3; k++)
            expect_number(&rest, frame->origin[k] + (double)position[i][k]);
        expect_number(&rest, birth[i]);
        expect_number(&rest, 1000 * (double)density[i]);
        if (frame->has_window)
            expect_number(&rest, (double)edge[i]);
        expect_number(&rest, (double)id[i]);
        for (int k = 0; k < 3; k++)
            expect_number(&rest, (double)velocity[i][k]);
    }
    assert_int_equal(strspn(rest, "\n"), strlen(rest));
}

static void vtk_is_read_by_meshio(void **unused) {
    (void)unused;
    Frame frame = make_frame();
    id[2] = (1ull << 53) - 1; /* what the test's own doubles hold */
    save_as(&frame, EXPORT_VTK, "a.vtu");
    char *text = read_with_meshio("a.vtu");
    assert_memory_equal(text, "birth density edge_distance id velocity\n", 40);
    check_numbers(text, &frame);
    free(text);
    frame.has_window = false;
    save_as(&frame, EXPORT_VTK, "b.vtu");
    text = read_with_meshio("b.vtu");
    assert_memory_equal(text, "birth density id velocity\n", 26);
    check_numbers(text, &frame);
    free(text);
}

static void ply_is_read_by_meshio(void **unused) {
    (void)unused;
    Frame frame = make_frame();
    save_as(&frame, EXPORT_PLY, "a.ply");
    char *text = read_with_meshio("a.ply");
    assert_memory_equal(text, "birth density edge_distance id velocity_x velocity_y velocity_z\n", 64);
    check_numbers(text, &frame);
    free(text);
    Err err = {0};
    id[1] = (1ull << 53) + 1;
    assert_false(export_write(&frame, 1000, EXPORT_PLY, "b.ply", &err));
    assert_int_equal(err.code, ERR_INPUT);
    assert_non_null(strstr(err.message, "9007199254740993"));
    assert_false(file_exists("b.ply") || file_exists("b.ply.tmp"));
}

/* ---- bgeo ---- */

typedef struct Bytes {
    const uint8_t *next, *end;
} Bytes;

static uint32_t take(Bytes *bytes, int size) {
    uint32_t value = 0;
    assert_true(bytes->end - bytes->next >= size);
    for (int i = 0; i < size; i++)
        value = value << 8 | *bytes->next++;
    return value;
}

static float take_float(Bytes *bytes) {
    uint32_t bits = take(bytes, 4);
    float value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

static void bgeo_is_what_partio_reads(void **unused) {
    (void)unused;
    static const struct {
        const char *name;
        uint32_t size, type;
    } expected[] = {{"id", 1, 1}, {"v", 3, 5}, {"density", 1, 0}, {"birth", 1, 0}, {"edge_distance", 1, 0}};
    Frame frame = make_frame();
    save_as(&frame, EXPORT_BGEO, "a.bgeo");
    char *data;
    size_t size;
    assert_true(file_read("a.bgeo", 1 << 20, &data, &size, NULL));
    Bytes bytes = {(const uint8_t *)data, (const uint8_t *)data + size};
    assert_true(take(&bytes, 4) == 0x4267656f && take(&bytes, 1) == 'V' && take(&bytes, 4) == 5);
    const uint32_t counts[8] = {LIVE, 0, 0, 0, 5, 0, 0, 0};
    for (int i = 0; i < 8; i++)
        assert_int_equal(take(&bytes, 4), counts[i]);
    for (int a = 0; a < 5; a++) {
        size_t length = take(&bytes, 2);
        assert_int_equal(length, strlen(expected[a].name));
        assert_memory_equal(bytes.next, expected[a].name, length);
        bytes.next += length;
        assert_int_equal(take(&bytes, 2), expected[a].size);
        assert_int_equal(take(&bytes, 4), expected[a].type);
        for (uint32_t k = 0; k < expected[a].size; k++)
            assert_int_equal(take(&bytes, 4), 0);
    }
    for (int i = 0; i < LIVE; i++) {
        for (int k = 0; k < 3; k++)
            assert_true(take_float(&bytes) == (float)(frame.origin[k] + (double)position[i][k]));
        assert_true(take_float(&bytes) == 1);
        assert_int_equal(take(&bytes, 4), id[i]);
        for (int k = 0; k < 3; k++)
            assert_true(take_float(&bytes) == velocity[i][k]);
        assert_true(fabsf(take_float(&bytes) - 1000 * density[i]) < 1e-3f);
        assert_true(take_float(&bytes) == (float)birth[i]);
        assert_true(take_float(&bytes) == edge[i]);
    }
    assert_true(take(&bytes, 1) == 0 && take(&bytes, 1) == 0xff && bytes.next == bytes.end);
    free(data);
    Err err = {0};
    id[3] = 1ull << 31;
    assert_false(export_write(&frame, 1000, EXPORT_BGEO, "b.bgeo", &err));
    assert_non_null(strstr(err.message, "2147483648"));
    assert_false(file_exists("b.bgeo"));
}

static void a_file_that_cannot_be_written_is_named(void **unused) {
    (void)unused;
    Frame frame = make_frame();
    Err err = {0};
    assert_false(export_write(&frame, 1000, EXPORT_VTK, "nowhere/a.vtu", &err));
    assert_int_equal(err.code, ERR_IO);
    assert_non_null(strstr(err.message, "nowhere/a.vtu"));
}

static void an_empty_frame_is_a_file_too(void **unused) {
    (void)unused;
    Frame frame = make_frame();
    frame.live = frame.count = 0;
    for (int format = EXPORT_VTK; format <= EXPORT_BGEO; format++)
        save_as(&frame, (ExportFormat)format, "empty");
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(vtk_is_read_by_meshio),
        cmocka_unit_test(ply_is_read_by_meshio),
        cmocka_unit_test(bgeo_is_what_partio_reads),
        cmocka_unit_test(a_file_that_cannot_be_written_is_named),
        cmocka_unit_test(an_empty_frame_is_a_file_too),
    };
    return cmocka_run_group_tests_name("export", tests, scratch_enter, scratch_leave);
}
