/* Meshes: OBJ input with good, bad and random text; closedness; transformation; mass against closed forms;
 * signed distance against brute force, with the sign from the winding number. */
#include "base/angle.h"
#include "base/file.h"
#include "base/random.h"
#include "mesh.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

static const char cube_text[] = "# unit cube\n"
                                "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n"
                                "f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 4 8 7 3\nf 1 5 8 4\nf 2 3 7 6\n";
static const char tetrahedron_text[] = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n"
                                       "f 1 3 2\nf 1 4 3\nf 1 2 4\nf 2 3 4\n";
/* L in x and y, 1 thick: [0,2]x[0,1] and [0,1]x[1,2]. */
static const char l_text[] = "v 0 0 0\nv 2 0 0\nv 2 1 0\nv 1 1 0\nv 1 2 0\nv 0 2 0\n"
                             "v 0 0 1\nv 2 0 1\nv 2 1 1\nv 1 1 1\nv 1 2 1\nv 0 2 1\n"
                             "f 4 3 2 1\nf 4 1 6 5\nf 10 7 8 9\nf 10 11 12 7\n"
                             "f 1 2 8 7\nf 2 3 9 8\nf 3 4 10 9\nf 4 5 11 10\nf 5 6 12 11\nf 6 1 7 12\n";

/* In [-1, 1). */
static double random_signed(uint64_t *counter) {
    return (double)(random_bits(0, (*counter)++) >> 11) * 0x1p-52 - 1.0;
}

/* Parses a copy of exactly this size, so that the sanitizer sees a read past its end. */
static bool parse(const char *text, size_t size, Mesh *mesh, Err *err) {
    char *copy = malloc(size ? size : 1);
    assert_non_null(copy);
    memcpy(copy, text, size);
    bool ok = mesh_parse_obj("x.obj", copy, size, mesh, err);
    free(copy);
    return ok;
}

static Mesh parse_good(const char *text) {
    Mesh mesh;
    Err err = {0};
    if (!parse(text, strlen(text), &mesh, &err))
        fail_msg("%s", err.message);
    return mesh;
}

/* ---- OBJ ---- */

static void test_obj_forms(void **state) {
    (void)state;
    static const struct {
        const char *text;
        uint32_t vertices, triangles;
    } cases[] = {
        {cube_text, 8, 12},
        {tetrahedron_text, 4, 4},
        {"\xef\xbb\xbfv 0 0 0\r\nv 1 0 0 \t\r\nv 0 1 0\r\nf 1 2 3 \r\n", 3, 1},
        {"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3", 3, 1},
        {"v 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\nv 5 5 5\n", 3, 1},
        {"f 1 2 3 # later vertices\nv 0 0 0 1\nv 1e0 +0 -0 0.5 0.5 0.5\n  v\t0 1. .0 \n", 3, 1},
        {"mtllib a.mtl\no name\nvn 0 0 1\nvt 0 0\nv 0 0 0\nv 1 0 0\nv 0 1 0\ng x\ns off\nf 1/1/1 2//1 3/1\nl "
         "1 2\n",
         3, 1},
        /* split vertices are merged, the triangle that collapses by it goes, and so does the unused vertex */
        {"v 0 0 0\nv 1 0 0\nv 0 1 0\nv -0 0 0\nv 1 0 0\nv 1 1 0\nv 9 9 9\nf 1 2 3\nf 5 6 3\nf 1 4 2\n", 4, 2},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        Mesh mesh = parse_good(cases[i].text);
        assert_int_equal(mesh.vertex_count, cases[i].vertices);
        assert_int_equal(mesh.triangle_count, cases[i].triangles);
        assert_true(mesh.min[0] == 0.0f && mesh.max[0] == 1.0f && mesh.max[1] == 1.0f);
        for (uint32_t t = 0; t < mesh.triangle_count; t++)
            for (int k = 0; k < 3; k++)
                assert_true(mesh.triangles[t][k] < mesh.vertex_count);
        mesh_free(&mesh);
        mesh_free(&mesh);
    }
}

static void test_obj_materials(void **state) {
    (void)state;
    /* the second triangle collapses when its corners are merged: the materials of the others stay theirs */
    Mesh mesh =
        parse_good("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nv 0 0 0\nf 1 2 3\nusemtl red # paint\nf 1 5 2\n"
                   "usemtl Glass.001\nf 2 4 3\nusemtl red\nf 3 4 1\nusemtl unused\n");
    static const uint8_t expected[3] = {0, 2, 1};
    static const char *const names[4] = {"", "red", "Glass.001", "unused"};
    assert_int_equal(mesh.triangle_count, 3);
    assert_int_equal(mesh.material_count, 4);
    assert_memory_equal(mesh.materials, expected, sizeof expected);
    for (int i = 0; i < 4; i++)
        assert_string_equal(mesh.material_names[i], names[i]);
    mesh_free(&mesh);
    mesh = parse_good(cube_text);
    assert_null(mesh.materials);
    mesh_free(&mesh);

    char text[8192] = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    for (int i = 0; i < MESH_MAX_MATERIALS + 1; i++)
        snprintf(text + strlen(text), sizeof text - strlen(text), "usemtl m%d\nf 1 2 3\n", i);
    Err err = {0};
    assert_false(parse(text, strlen(text), &mesh, &err));
    assert_string_equal(err.message, "x.obj:516: material 'm256' is one more than the 256 allowed");
    mesh_free(&mesh);
}

static void test_obj_faults(void **state) {
    (void)state;
    static const struct {
        const char *text, *message;
    } cases[] = {
        {"", "x.obj: empty"},
        {"\n \n# nothing\n", "x.obj: no faces (f records) in 3 lines"},
        {"v 0 0 0\nv 1 0 0\nv 0 1 0\n", "x.obj: no faces"},
        {"v 0 0\nf 1 1 1\n", "x.obj:1: vertex without z coordinate; three numbers are needed"},
        {"\nv 0 nan 0\nf 1 2 3\n", "x.obj:2: y coordinate 'nan' is not a decimal number within +-1e9"},
        {"v inf 0 0\nf 1 2 3\n", "x.obj:1: x coordinate 'inf'"},
        {"v 0 0 1e10\nf 1 2 3\n", "x.obj:1: z coordinate '1e10'"},
        {"v 1e999 0 0\nf 1 2 3\n", "x.obj:1: x coordinate '1e999'"},
        {"v 0x1 0 0\nf 1 2 3\n", "x.obj:1: x coordinate '0x1'"},
        {"v 1.2.3 0 0\nf 1 2 3\n", "x.obj:1: x coordinate '1.2.3'"},
        {"v - 0 0\nf 1 2 3\n", "x.obj:1: x coordinate '-'"},
        {"v 0000000000000000000000000000000000000000000000000000000000000000000000000001 0 0\nf 1 2 3\n",
         "x.obj:1: x coordinate '00000000"},
        {"v 0 0 0\nv 1 0 0\nf 1 2\n", "x.obj:3: face with 2 corners; at least 3 are needed"},
        {"v 0 0 0\nf\n", "x.obj:2: face with 0 corners"},
        {"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n",
         "x.obj:4: vertex index of corner '4' is out of range; 1..3 or -3..-1"},
        {"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 -4\n", "x.obj:4: vertex index of corner '-4' is out of range"},
        {"v 0 0 0\nf -2 -1 1\nv 1 0 0\n",
         "x.obj:2: vertex index of corner '-2' is out of range; 1..2 or -1..-1"},
        {"v 0 0 0\nf 1 2 99999999999999999999999\n",
         "x.obj:2: vertex index of corner '2' is out of range; 1..1"},
        {"v 0 0 0\nv 1 0 0\nf 1 2 99999999999999999999999\n", "is out of range"},
        {"usemtl\nf 1 2 3\n", "x.obj:1: usemtl '': a name of 1 to 31 characters is needed"},
        {"usemtl 12345678901234567890123456789012\nf 1 2 3\n",
         "x.obj:1: usemtl '12345678901234567890123456789012': a name of 1 to 31 characters is needed"},
        {"f 1 2 3\n", "x.obj:1: vertex index 1; the file has no vertices"},
        {"v 0 0 0\nf 0 1 1\n", "x.obj:2: face corner '0' is none of"},
        {"v 0 0 0\nf 1/ 1 1\n", "x.obj:2: face corner '1/' is none of"},
        {"v 0 0 0\nf 1/2/ 1 1\n", "x.obj:2: face corner '1/2/' is none of"},
        {"v 0 0 0\nf 1// 1 1\n", "x.obj:2: face corner '1//' is none of"},
        {"v 0 0 0\nf 1.5 1 1\n", "x.obj:2: face corner '1.5' is none of"},
        {"v 0 0 0\nf a\033[31m 1 1\n", "x.obj:2: face corner 'a?[31m' is none of"},
        {"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3 1\n", "x.obj:4: corner '1' is in this face twice"},
        {"v 0 0 0\nv 0 0 0\nv 1 0 0\nf 1 2 3\n", "x.obj: no surface: every face has coinciding corners"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        Mesh mesh;
        Err err = {0};
        assert_false(parse(cases[i].text, strlen(cases[i].text), &mesh, &err));
        assert_int_equal(err.code, ERR_INPUT);
        if (!strstr(err.message, cases[i].message))
            fail_msg("case %zu: expected '%s', got '%s'", i, cases[i].message, err.message);
        assert_null(mesh.vertices);
        mesh_free(&mesh);
    }
}

static void test_obj_file(void **state) {
    (void)state;
    char path[] = "test_mesh_XXXXXX.obj";
    int fd = mkstemps(path, 4);
    assert_true(fd >= 0);
    close(fd);
    Err err = {0};
    Mesh mesh;
    assert_true(file_write(path, cube_text, sizeof cube_text - 1, &err));
    assert_true(mesh_load_obj(path, &mesh, &err));
    assert_int_equal(mesh.triangle_count, 12);
    mesh_free(&mesh);
    assert_true(file_write(path, "v 1 2\n", 6, &err));
    assert_false(mesh_load_obj(path, &mesh, &err));
    assert_int_equal(err.code, ERR_INPUT);
    assert_non_null(strstr(err.message, path));
    unlink(path);
    err = (Err){0};
    assert_false(mesh_load_obj(path, &mesh, &err));
    assert_int_equal(err.code, ERR_INPUT);
    assert_null(mesh.vertices);
}

/* Whatever the bytes are: a clear refusal, or a mesh that every function accepts. */
static void test_obj_fuzz(void **state) {
    (void)state;
    static const char seed[] =
        "v 0 0 0\nv 1 0 0 1\nv 0 1e0 0\r\nv 0 0 -1.5 # c\nvt 0 0\nf 1/1 3/1/2 2//1\nusemtl a\nf -4 4 3\n"
        "f 1 2 4\nf 2 3 4\nf 1 3 4 2\n";
    static const char bytes[] = "0123456789+-.eE/ \t\r\n#vfnt\0\xff";
    uint32_t accepted = 0;
    for (uint64_t run = 0; run < 4000; run++) {
        uint64_t counter = run << 20;
        char text[sizeof seed];
        size_t size = sizeof seed - 1;
        memcpy(text, seed, size);
        int changes = (int)(random_bits(0, counter++) % 6);
        for (int i = 0; i < changes; i++) {
            size_t at = random_bits(0, counter++) % size;
            text[at] = bytes[random_bits(0, counter++) % (sizeof bytes - 1)];
        }
        if (random_bits(0, counter++) % 4 == 0)
            size = random_bits(0, counter++) % size;
        Mesh mesh;
        Err err = {0};
        if (!parse(text, size, &mesh, &err)) {
            assert_int_equal(err.code, ERR_INPUT);
            assert_memory_equal(err.message, "x.obj:", 6);
            continue;
        }
        accepted++;
        for (uint32_t t = 0; t < mesh.triangle_count; t++)
            for (int k = 0; k < 3; k++)
                assert_true(mesh.triangles[t][k] < mesh.vertex_count);
        for (uint32_t t = 0; mesh.materials && t < mesh.triangle_count; t++)
            assert_true(mesh.materials[t] < mesh.material_count);
        MeshMass mass;
        mesh_mass(&mesh, &mass);
        assert_true(isfinite(mass.volume) && isfinite(mass.area));
        (void)mesh_check_closed(&mesh, "x", &err);
        assert_true(mesh_build_tree(&mesh, &err));
        const float point[3] = {0.3f, -0.2f, 0.7f};
        assert_true(isfinite(mesh_distance(&mesh, point, NULL)));
        mesh_free(&mesh);
    }
    assert_in_range(accepted, 400, 3600); /* both ways are taken often */
}

/* ---- Makers and closedness ---- */

static void expect_closed(const Mesh *mesh) {
    Err err = {0};
    if (!mesh_check_closed(mesh, "mesh", &err))
        fail_msg("%s", err.message);
}

static void test_makers(void **state) {
    (void)state;
    const float min[3] = {-1.0f, 0.0f, 2.0f}, max[3] = {1.0f, 0.5f, 2.25f}, centre[3] = {3.0f, -4.0f, 5.0f};
    Mesh mesh;
    Err err = {0};
    assert_true(mesh_make_box(min, max, &mesh, &err));
    assert_int_equal(mesh.vertex_count, 8);
    assert_int_equal(mesh.triangle_count, 12);
    expect_closed(&mesh);
    mesh_free(&mesh);
    for (int level = 0; level < 5; level++) {
        assert_true(mesh_make_sphere(centre, 0.5f, level, &mesh, &err));
        assert_int_equal(mesh.triangle_count, 20 << (2 * level));
        assert_int_equal(mesh.vertex_count, (10 << (2 * level)) + 2);
        expect_closed(&mesh);
        for (uint32_t i = 0; i < mesh.vertex_count; i++) {
            const float *v = mesh.vertices[i];
            assert_float_equal(hypotf(hypotf(v[0] - 3.0f, v[1] + 4.0f), v[2] - 5.0f), 0.5f, 2e-6f);
        }
        mesh_free(&mesh);
    }
    assert_false(mesh_make_sphere(centre, 0.5f, 9, &mesh, &err));
    assert_non_null(strstr(err.message, "level 9; 0..8"));
    assert_false(mesh_make_sphere(centre, -1.0f, 1, &mesh, &err));
    assert_false(mesh_make_sphere(centre, NAN, 1, &mesh, &err));
    assert_false(mesh_make_box(max, min, &mesh, &err));
    assert_int_equal(err.code, ERR_INPUT);
}

static void test_planes(void **state) {
    (void)state;
    /* A square pyramid of base 2 and height 1: five planes, four of them through the apex. */
    const float points[5][3] = {{0, 0, 0}, {1, 0, 0}, {-1, 0, 0}, {0, 0, 1}, {0, 0, -1}};
    const float normals[5][3] = {{0, -3, 0}, {1, 1, 0}, {-1, 1, 0}, {0, 1, 1}, {0, 1, -1}};
    Mesh mesh;
    MeshMass mass;
    Err err = {0};
    assert_true(mesh_make_planes(points, normals, 5, &mesh, &err));
    assert_int_equal(mesh.vertex_count, 5);
    assert_int_equal(mesh.triangle_count, 6);
    mesh_mass(&mesh, &mass);
    assert_true(fabs(mass.volume - 4.0 / 3.0) < 1e-6 && fabs(mass.centre[1] - 0.25) < 1e-6);
    mesh_free(&mesh);

    /* Tangent planes of a sphere: a polyhedron whose every face touches the sphere, a bit larger than it. */
    enum { COUNT = 60 };
    float touch[COUNT][3], normal[COUNT][3];
    for (int i = 0; i < COUNT; i++) {
        double y = 1.0 - (2.0 * i + 1.0) / COUNT, r = sqrt(1.0 - y * y), phi = 2.399963229728653 * i;
        double n[3] = {r * cos(phi), y, r * sin(phi)};
        for (int k = 0; k < 3; k++) {
            normal[i][k] = (float)n[k];
            touch[i][k] = (float)(n[k] + 10.0);
        }
    }
    assert_true(mesh_make_planes((const float(*)[3])touch, (const float(*)[3])normal, COUNT, &mesh, &err));
    expect_closed(&mesh);
    mesh_mass(&mesh, &mass);
    assert_true(mass.volume > 4.18879 && mass.volume < 4.7);
    assert_true(fabs(mass.volume - mass.area / 3.0) < 1e-4); /* every face is 1 m from the centre */
    mesh_free(&mesh);

    assert_false(mesh_make_planes(points, normals, 4, &mesh, &err));
    assert_non_null(strstr(err.message, "unbounded"));
    const float outwards[5][3] = {{0, 3, 0}, {1, 1, 0}, {-1, 1, 0}, {0, 1, 1}, {0, 1, -1}};
    const float above[5][3] = {{0, -2, 0}, {1, 0, 0}, {-1, 0, 0}, {0, 0, 1}, {0, 5, 0}};
    const float facing[5][3] = {{0, 1, 0}, {1, 0, 0}, {-1, 0, 0}, {0, 0, 1}, {0, -1, 0}};
    assert_false(mesh_make_planes(above, facing, 5, &mesh, &err));
    assert_non_null(strstr(err.message, "empty"));
    assert_false(
        mesh_make_planes(points, outwards, 5, &mesh, &err)); /* the pyramid's planes, base turned over */
    assert_false(mesh_make_planes(points, normals, 3, &mesh, &err));
    assert_non_null(strstr(err.message, "3 planes; 4..1024"));
    const float none[4][3] = {{0}};
    assert_false(mesh_make_planes(points, none, 4, &mesh, &err));
    assert_non_null(strstr(err.message, "plane 1 has point"));
    assert_false(mesh_make_planes(none, normals, 4, &mesh, &err));
    assert_non_null(strstr(err.message, "one point"));
}

static void test_closed_faults(void **state) {
    (void)state;
    static const struct {
        const char *text, *message;
    } cases[] = {
        {"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 4 3\nf 1 2 4\n",
         "hull: not a closed surface: 3 open edges"},
        {"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 4 3\nf 1 2 4\n",
         "no triangle on the other side of an edge"},
        {"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 4 3\nf 1 2 4\nf 2 4 3\n",
         "3 edges between triangles that face opposite ways"},
        {"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 4 3\nf 1 2 4\nf 2 3 4\nf 2 3 4\n",
         "3 edges of more than two triangles"},
        {"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 3 4\nf 1 4 2\nf 2 4 3\n",
         "hull: inside out (volume -0.16"},
        {"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 1 3 2\n", "hull: the surface encloses no volume"},
        {"v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\nf 1 3 2\n", "2 degenerate triangles"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        Mesh mesh = parse_good(cases[i].text);
        Err err = {0};
        assert_false(mesh_check_closed(&mesh, "hull", &err));
        assert_int_equal(err.code, ERR_INPUT);
        if (!strstr(err.message, cases[i].message))
            fail_msg("case %zu: expected '%s', got '%s'", i, cases[i].message, err.message);
        mesh_free(&mesh);
    }
    Mesh empty = {0};
    assert_false(mesh_check_closed(&empty, "hull", NULL));
}

static void test_transform(void **state) {
    (void)state;
    Mesh mesh = parse_good(tetrahedron_text);
    MeshMass mass;
    /* Mirrored and stretched, then a quarter turn about y (x to -z), then moved. */
    const float scale[3] = {2.0f, 1.0f, -3.0f}, turn[4] = {0.0f, 0.70710678f, 0.0f, 0.70710678f};
    const float shift[3] = {10.0f, 20.0f, 30.0f};
    mesh_transform(&mesh, scale, turn, shift);
    expect_closed(&mesh);
    mesh_mass(&mesh, &mass);
    assert_true(fabs(mass.volume - 1.0) < 1e-5);
    const float min[3] = {7.0f, 20.0f, 28.0f}, max[3] = {10.0f, 21.0f, 30.0f};
    for (int k = 0; k < 3; k++) {
        assert_float_equal(mesh.min[k], min[k], 1e-5f);
        assert_float_equal(mesh.max[k], max[k], 1e-5f);
    }
    mesh_free(&mesh);
}

/* ---- Mass ---- */

static void expect_inertia(const MeshMass *mass, const double expected[3][3], double tolerance) {
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            if (fabs(mass->inertia[i][j] - expected[i][j]) > tolerance)
                fail_msg("inertia %d %d: %.9g, expected %.9g", i, j, mass->inertia[i][j], expected[i][j]);
}

static void test_mass(void **state) {
    (void)state;
    static const float shifts[2][3] = {{0.0f, 0.0f, 0.0f}, {4096.0f, -8192.0f, 2048.0f}};
    const float none[4] = {0.0f, 0.0f, 0.0f, 1.0f}, one[3] = {1.0f, 1.0f, 1.0f};
    for (int s = 0; s < 2; s++) {
        MeshMass mass;
        Err err = {0};
        Mesh mesh = parse_good(cube_text);
        const float sides[3] = {2.0f, 3.0f, 5.0f};
        mesh_transform(&mesh, sides, none, shifts[s]);
        mesh_mass(&mesh, &mass);
        const double box[3][3] = {{30.0 * 34 / 12, 0, 0}, {0, 30.0 * 29 / 12, 0}, {0, 0, 30.0 * 13 / 12}};
        assert_true(fabs(mass.volume - 30.0) < 1e-9 && fabs(mass.area - 62.0) < 1e-9);
        for (int k = 0; k < 3; k++)
            assert_true(fabs(mass.centre[k] - (double)shifts[s][k] - 0.5 * (double)sides[k]) < 1e-9);
        expect_inertia(&mass, box, 1e-9);
        mesh_free(&mesh);

        /* Corner tetrahedron: V = 1/6; int x^2 = 1/60, int x y = 1/120, less V/16 for the centre (1/4, 1/4,
         * 1/4). */
        mesh = parse_good(tetrahedron_text);
        mesh_transform(&mesh, one, none, shifts[s]);
        mesh_mass(&mesh, &mass);
        const double square = 1.0 / 60 - 1.0 / 96, product = 1.0 / 120 - 1.0 / 96;
        const double tetrahedron[3][3] = {{2 * square, -product, -product},
                                          {-product, 2 * square, -product},
                                          {-product, -product, 2 * square}};
        assert_true(fabs(mass.volume - 1.0 / 6) < 1e-12 && fabs(mass.area - 1.5 - sqrt(0.75)) < 1e-12);
        for (int k = 0; k < 3; k++)
            assert_true(fabs(mass.centre[k] - (double)shifts[s][k] - 0.25) < 1e-9);
        expect_inertia(&mass, tetrahedron, 1e-12);
        mesh_free(&mesh);

        /* Sphere: the polyhedron's volume and inertia approach it as the square of the edge. */
        double last = 0.0;
        for (int level = 2; level < 6; level++) {
            assert_true(mesh_make_sphere(shifts[0], 1.0f, level, &mesh, &err));
            mesh_mass(&mesh, &mass);
            double error = 4.0 / 3.0 * pi - mass.volume;
            assert_true(error > 0.0 && (level == 2 || fabs(error / last - 0.25) < 0.01));
            assert_true(fabs(mass.inertia[0][0] / mass.volume - 0.4) < 1.1 * error);
            last = error;
            mesh_free(&mesh);
        }
    }
}

/* ---- Distance ---- */

/* Squared distance by search over a fine net of each triangle's parameters, refined again and again: slow,
 * and nothing like what is tested. */
static double net_distance(const Mesh *mesh, const double p[3]) {
    double best = INFINITY;
    for (uint32_t t = 0; t < mesh->triangle_count; t++) {
        const float *a = mesh->vertices[mesh->triangles[t][0]], *b = mesh->vertices[mesh->triangles[t][1]],
                    *c = mesh->vertices[mesh->triangles[t][2]];
        double u0 = 0.5, v0 = 0.5, half = 0.5;
        for (int round = 0; round < 26; round++, half *= 0.6) {
            double local = INFINITY, u1 = u0, v1 = v0;
            for (int i = -4; i <= 4; i++) {
                for (int j = -4; j <= 4; j++) {
                    /* (u, v) of the square folded on the triangle: corner a at u = 0 */
                    double u = fmin(1.0, fmax(0.0, u0 + half * i / 4.0)),
                           v = fmin(1.0, fmax(0.0, v0 + half * j / 4.0));
                    double sum = 0.0;
                    for (int k = 0; k < 3; k++) {
                        double x =
                            (1 - u) * (double)a[k] + u * ((1 - v) * (double)b[k] + v * (double)c[k]) - p[k];
                        sum += x * x;
                    }
                    if (sum < local) {
                        local = sum;
                        u1 = u;
                        v1 = v;
                    }
                }
            }
            u0 = u1;
            v0 = v1;
            best = fmin(best, local);
        }
    }
    return sqrt(best);
}

/* Turns of the surface around p: 1 inside, 0 outside [van Oosterom & Strackee 1983]. */
static double winding_number(const Mesh *mesh, const double p[3]) {
    double sum = 0.0;
    for (uint32_t t = 0; t < mesh->triangle_count; t++) {
        double v[3][3], length[3];
        for (int k = 0; k < 3; k++) {
            for (int i = 0; i < 3; i++)
                v[k][i] = (double)mesh->vertices[mesh->triangles[t][k]][i] - p[i];
            length[k] = sqrt(v[k][0] * v[k][0] + v[k][1] * v[k][1] + v[k][2] * v[k][2]);
        }
        double determinant = v[0][0] * (v[1][1] * v[2][2] - v[1][2] * v[2][1]) -
                             v[0][1] * (v[1][0] * v[2][2] - v[1][2] * v[2][0]) +
                             v[0][2] * (v[1][0] * v[2][1] - v[1][1] * v[2][0]);
        double scale = length[0] * length[1] * length[2];
        for (int k = 0; k < 3; k++) {
            int m = (k + 1) % 3, n = (k + 2) % 3;
            scale += length[k] * (v[m][0] * v[n][0] + v[m][1] * v[n][1] + v[m][2] * v[n][2]);
        }
        sum += 2.0 * atan2(determinant, scale);
    }
    return sum / (4.0 * pi);
}

static void check_distances(Mesh *mesh, uint32_t count) {
    Err err = {0};
    assert_true(mesh_build_tree(mesh, &err));
    float(*points)[4] = malloc(count * sizeof *points), *batch = malloc(count * sizeof *batch);
    assert_true(points && batch);
    uint64_t counter = 1;
    uint32_t steep = 0, inside = 0;
    for (uint32_t i = 0; i < count; i++)
        for (int k = 0; k < 3; k++) {
            double centre = 0.5 * ((double)mesh->min[k] + (double)mesh->max[k]);
            double size = (double)mesh->max[k] - (double)mesh->min[k];
            points[i][k] = (float)(centre + (i % 7 == 0 ? 10.0 : 0.9) * size * random_signed(&counter));
        }
    mesh_distances(mesh, (const float(*)[4])points, count, batch, 2);
    for (uint32_t i = 0; i < count; i++) {
        double p[3] = {(double)points[i][0], (double)points[i][1], (double)points[i][2]};
        float closest[3], distance = mesh_distance(mesh, points[i], closest);
        double expected = net_distance(mesh, p), turns = winding_number(mesh, p);
        assert_memory_equal(&distance, &batch[i], sizeof distance);
        if (fabs(fabs((double)distance) - expected) > 2e-4 * (1.0 + expected) ||
            fabs((double)distance) > expected + 1e-6 * (1.0 + expected))
            fail_msg("point %u: %.9g, expected %.9g", i, (double)distance, expected);
        if (fabs((double)distance) > 1e-6 && (distance < 0.0f) != (turns > 0.5))
            fail_msg("point %u: %.9g, winding number %g", i, (double)distance, turns);
        inside += distance < 0.0f;
        double gap = 0.0, slope = 0.0;
        for (int k = 0; k < 3; k++) {
            gap += pow((double)closest[k] - p[k], 2);
            float low[3], high[3];
            memcpy(low, points[i], sizeof low);
            memcpy(high, points[i], sizeof high);
            low[k] -= 1.0f / 512;
            high[k] += 1.0f / 512;
            double width = (double)high[k] - (double)low[k];
            slope += pow(((double)mesh_distance(mesh, high, NULL) - (double)mesh_distance(mesh, low, NULL)) /
                             width,
                         2);
        }
        assert_true(fabs(sqrt(gap) - fabs((double)distance)) < 1e-5 * (1.0 + expected));
        assert_true(sqrt(slope) < 1.01);
        steep += sqrt(slope) > 0.98;
    }
    assert_true(steep > count - count / 8); /* but for the ridges of the distance field */
    assert_true(inside > count / 50);
    free(points);
    free(batch);
}

static void test_distance(void **state) {
    (void)state;
    const float centre[3] = {1.0f, 2.0f, 3.0f};
    Mesh mesh = parse_good(cube_text);
    check_distances(&mesh, 600);
    mesh_free(&mesh);
    mesh = parse_good(tetrahedron_text);
    check_distances(&mesh, 600);
    mesh_free(&mesh);
    mesh = parse_good(l_text);
    expect_closed(&mesh);
    check_distances(&mesh, 600);
    mesh_free(&mesh);
    Err err = {0};
    assert_true(mesh_make_sphere(centre, 0.7f, 1, &mesh, &err));
    check_distances(&mesh, 300);
    mesh_free(&mesh);
}

/* Points on the planes through corners and edges, where features tie, and the closed forms of a cube. */
static void test_distance_ties(void **state) {
    (void)state;
    Mesh mesh = parse_good(cube_text);
    Err err = {0};
    assert_true(mesh_build_tree(&mesh, &err));
    for (int x = -2; x <= 6; x++)
        for (int y = -2; y <= 6; y++)
            for (int z = -2; z <= 6; z++) {
                float p[3] = {0.25f * (float)x, 0.25f * (float)y, 0.25f * (float)z};
                double out = 0.0, in = INFINITY;
                for (int k = 0; k < 3; k++) {
                    double q = fabs((double)p[k] - 0.5) - 0.5;
                    out += q > 0.0 ? q * q : 0.0;
                    in = fmin(in, -q);
                }
                double expected = in > 0.0 ? -in : sqrt(out);
                assert_true(fabs((double)mesh_distance(&mesh, p, NULL) - expected) < 1e-6);
            }
    /* Far away and not a number: an answer, and nothing for the points that follow in the batch. */
    const float odd[4][4] = {
        {1e6f, 0.5f, 0.5f}, {NAN, 0.0f, 0.0f}, {INFINITY, 0.0f, 0.0f}, {0.5f, 0.5f, 0.25f}};
    float distances[4];
    mesh_distances(&mesh, odd, 4, distances, 1);
    assert_true(distances[0] == 999999.0f);
    assert_true(distances[3] == -0.25f);
    mesh_free(&mesh);
    assert_false(mesh_build_tree(&mesh, &err));
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_obj_forms),  cmocka_unit_test(test_obj_materials),
        cmocka_unit_test(test_obj_faults), cmocka_unit_test(test_obj_file),
        cmocka_unit_test(test_obj_fuzz),   cmocka_unit_test(test_makers),
        cmocka_unit_test(test_planes),     cmocka_unit_test(test_closed_faults),
        cmocka_unit_test(test_transform),  cmocka_unit_test(test_mass),
        cmocka_unit_test(test_distance),   cmocka_unit_test(test_distance_ties),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
