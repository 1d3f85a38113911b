/* Scenes: what is refused and with which words, what is read, what is written back, and edits from the
 * command line. */
#include "app/field.h"
#include "app/json_text.h"
#include "app/nearest.h"
#include "app/scene.h"
#include "engine/base/file.h"
#include "engine/base/random.h"

#include <dirent.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

#define COUNT(table) ((int)(sizeof(table) / sizeof *(table)))

static Scene *parse(const char *text, Err *err) {
    return scene_parse("s.json", text, strlen(text), NULL, 0, err);
}

/* Only problems: the scene must be refused with exactly this message. */
static void expect_message(const char *text, const char *message) {
    Err err = {0};
    Scene *scene = parse(text, &err);
    assert_null(scene);
    assert_string_equal(err.message, message);
    assert_int_equal(err.code, ERR_INPUT);
}

/* ---- Bad scenes ---- */

static const struct {
    const char *text, *message;
} bad_files[] = {
    {"", "s.json:1:0: not valid JSON: unexpected token near end of file"},
    {"{\"version\": 1,}", "s.json:1:15: not valid JSON: string or '}' expected near '}'"},
    {"{\"version\": 1,\n \"version\": 1}",
     "s.json:2:10: not valid JSON: duplicate object key near '\"version\"'"},
    {"{\"version\": NaN}", "s.json:1:15: not valid JSON: invalid token near 'NaN'"},
    {"{\"version\": 1e999}", "s.json:1:17: not valid JSON: real number overflow near '1e999'"},
    {"[]", "s.json: expected an object with \"version\": 1"},
    {"7", "s.json: expected an object with \"version\": 1"},
    {"{}", "s.json: version: missing, expected 1: Version of the format"},
    {"{\"version\": 2}", "s.json: version: expected 1, found 2"},
    {"{\"version\": \"1\"}", "s.json: version: expected 1, found \"1\""},
    {"{\"version\": 1, \"title\": 3}", "s.json: title: expected text, found 3"},
    {"{\"version\": 1, \"Tnak\": {}}", "s.json: Tnak: unknown key, did you mean Tank?"},
    {"{\"version\": 1, \"Boats\": {}}", "s.json: Boats: unknown key, expected one of $schema, version, "
                                        "title, description, Configuration, Tank, Sea, "
                                        "FluidBlocks, RigidBodies, Probes, input, Keys, Render"},
    {"{\"version\": 1, \"\\u001b[31m\": 1}", "s.json: ?[31m: unknown key, expected one of $schema, version, "
                                             "title, description, Configuration, Tank, Sea, "
                                             "FluidBlocks, RigidBodies, Probes, input, Keys, Render"},
};

/* Bodies of a scene: `"version": 1` stands before them. */
static const struct {
    const char *text, *message;
} bad_values[] = {
    {"\"Configuration\": 1", "s.json: Configuration: expected an object, found 1"},
    {"\"Configuration\": {\"viscosty\": 0}",
     "s.json: Configuration.viscosty: unknown key, did you mean viscosity?"},
    {"\"Configuration\": {\"colour\": 0}",
     "s.json: Configuration.colour: unknown key; `skiff check --schema` lists all"},
    {"\"Configuration\": {\"viscosity\": 1.5}",
     "s.json: Configuration.viscosity: expected a number from 0 to 1, found 1.5"},
    {"\"Configuration\": {\"viscosity\": -1}",
     "s.json: Configuration.viscosity: expected a number from 0 to 1, found -1"},
    {"\"Configuration\": {\"viscosity\": \"high\"}",
     "s.json: Configuration.viscosity: expected a number from 0 to 1, found \"high\""},
    {"\"Configuration\": {\"viscosity\": null}",
     "s.json: Configuration.viscosity: expected a number from 0 to 1, found null"},
    {"\"Configuration\": {\"timeStepSize\": 0}",
     "s.json: Configuration.timeStepSize: expected a number from 1e-07 to 1 s, found 0"},
    {"\"Configuration\": {\"particleRadius\": 1e300}",
     "s.json: Configuration.particleRadius: expected a number from 0.0001 to 10 m, found 1e+300"},
    {"\"Configuration\": {\"minIterations\": 2.5}",
     "s.json: Configuration.minIterations: expected an integer from 1 to 1000, found 2.5"},
    {"\"Configuration\": {\"minIterations\": 9000000000}",
     "s.json: Configuration.minIterations: expected an integer from 1 to 1000, found 9000000000"},
    {"\"Configuration\": {\"gravitation\": [0, -9.81]}",
     "s.json: Configuration.gravitation: expected 3 numbers from -1000 to 1000 m/s^2, found a list of 2"},
    {"\"Configuration\": {\"gravitation\": [0, -9.81, true]}",
     "s.json: Configuration.gravitation[2]: expected a number from -1000 to 1000 m/s^2, found true"},
    {"\"Configuration\": {\"pressureSolver\": \"jakobi\"}",
     "s.json: Configuration.pressureSolver: expected one of gcr, jacobi, split, found \"jakobi\"; did you "
     "mean "
     "jacobi?"},
    {"\"Configuration\": {\"pressureSolver\": 1}",
     "s.json: Configuration.pressureSolver: expected one of gcr, jacobi, split, found 1"},
    {"\"Configuration\": {\"domainMin\": [0, 0, 0]}",
     "s.json: Configuration: domainMin and domainMax go together, one of them is missing"},
    {"\"Configuration\": {\"domainMin\": [0, 0, 0], \"domainMax\": [1, 0, 1]}",
     "s.json: Configuration.domainMax[1]: 0 is not above domainMin[1], which is 0"},

    {"\"Tank\": []", "s.json: Tank: expected an object or null, found a list of 0"},
    {"\"Tank\": {}",
     "s.json: Tank.type: missing, expected one of box, mesh, planes, sphere, cylinder, star, cone: What the "
     "walls are"},
    {"\"Tank\": {\"type\": \"bok\"}",
     "s.json: Tank.type: expected one of box, mesh, planes, sphere, cylinder, star, cone, found "
     "\"bok\"; did you mean box?"},
    {"\"Tank\": {\"type\": \"box\", \"min\": [0, 0, 0]}",
     "s.json: Tank.max: missing, expected 3 numbers from -100000 to 100000 m: Corner of the box with the "
     "largest coordinates"},
    {"\"Tank\": {\"type\": \"box\", \"min\": [0, 0, 0], \"max\": [1, 1, -1]}",
     "s.json: Tank.max[2]: -1 is not above min[2], which is 0"},
    {"\"Tank\": {\"type\": \"box\", \"min\": [0, 0, 0], \"max\": [1, 1, 1], \"geometryFile\": \"a.obj\"}",
     "s.json: Tank.geometryFile: has no meaning for type \"box\", only for \"mesh\""},
    {"\"Tank\": {\"type\": \"box\", \"min\": [0, 0, 0], \"max\": [1, 1, 1], \"wetHeight\": \"high\"}",
     "s.json: Tank.wetHeight: expected a number from -100000 to 100000 m or null, found \"high\""},
    {"\"Tank\": {\"type\": \"mesh\", \"geometryFile\": \"\"}",
     "s.json: Tank.geometryFile: expected a file name, found \"\""},
    {"\"Tank\": {\"type\": \"mesh\", \"geometryFile\": \"a.obj\", \"rotationAxis\": [0, 0, 0], "
     "\"rotationAngle\": 1}",
     "s.json: Tank.rotationAxis: has no direction, and rotationAngle is not 0"},
    {"\"Tank\": {\"type\": \"planes\", \"planes\": []}",
     "s.json: Tank.planes: 0 planes cannot enclose a tank, expected at least 4"},
    {"\"Tank\": {\"type\": \"planes\", \"planes\": [{\"point\": [0, 0, 0], \"normal\": [0, 0, \"z\"]}]}",
     "s.json: Tank.planes[0].normal[2]: expected a number from -1000000 to 1000000, found \"z\""},
    {"\"Tank\": {\"type\": \"planes\", \"planes\": [{\"point\": [0, 0, 0], \"normal\": [0, 0, 0]}]}",
     "s.json: Tank.planes[0].normal: has no direction"},

    {"\"Tank\": {\"type\": \"cylinder\", \"height\": 2}",
     "s.json: Tank.radius: missing, expected a number from 0.0001 to 100000 m: Of a sphere or cylinder, of a "
     "star's tips, of a cone's floor"},
    {"\"Tank\": {\"type\": \"sphere\", \"radius\": 2, \"height\": 2}",
     "s.json: Tank.height: has no meaning for type \"sphere\", only for \"cylinder\" and \"star\" and "
     "\"cone\""},
    {"\"Tank\": {\"type\": \"cone\", \"radius\": 2, \"topRadius\": -1, \"height\": 2}",
     "s.json: Tank.topRadius: expected a number from 0 to 100000 m, found -1"},
    {"\"Tank\": {\"type\": \"star\", \"radius\": 2, \"innerRadius\": 3, \"height\": 2}",
     "s.json: Tank.innerRadius: 3 is above radius, which is 2"},
    {"\"Tank\": {\"type\": \"star\", \"radius\": 2, \"innerRadius\": 1, \"height\": 2, \"branches\": 65}",
     "s.json: Tank.branches: expected an integer from 2 to 64, found 65"},
    {"\"Tank\": {\"type\": \"cone\", \"radius\": 2, \"topRadius\": 3, \"height\": 2, \"rotationAxis\": [1, "
     "0, "
     "0], \"rotationAngle\": 1}",
     "s.json: Tank.open: a tilted tank keeps its lid, expected false"},

    {"\"FluidBlocks\": {}",
     "s.json: FluidBlocks: expected a list of at most 100000 objects, found an object"},
    {"\"FluidBlocks\": [7]", "s.json: FluidBlocks[0]: expected an object, found 7"},
    {"\"FluidBlocks\": [{\"start\": [0, 0, 0], \"end\": [1, 1, 0]}]",
     "s.json: FluidBlocks[0].end[2]: 0 is not above start[2], which is 0"},
    {"\"FluidBlocks\": [{\"start\": [0, 0, 0], \"end\": [1, 1, 1], \"repeat\": 3, \"period\": 0}]",
     "s.json: FluidBlocks[0].period: expected a number above 0 s, since repeat is 3"},
    {"\"FluidBlocks\": [{\"start\": [0, 0, 0], \"end\": [1, 1, 1], \"time\": -1}]",
     "s.json: FluidBlocks[0].time: expected a number from 0 to 1000000 s, found -1"},

    {"\"RigidBodies\": [{\"name\": \"a\"}]",
     "s.json: RigidBodies[0]: missing, expected one of geometryFile, box, sphere, cylinder, star, cone"},
    {"\"RigidBodies\": [{\"name\": \"a\", \"box\": [1, 1, 1], \"sphere\": 1}]",
     "s.json: RigidBodies[0]: 2 of geometryFile, box, sphere, cylinder, star, cone are given, expected one"},
    {"\"RigidBodies\": [{\"name\": \"a\", \"sphere\": 1, \"mass\": 1, \"density\": 1}]",
     "s.json: RigidBodies[0]: 2 of density, mass are given, expected one"},
    {"\"RigidBodies\": [{\"name\": \"a\", \"sphere\": -1}]",
     "s.json: RigidBodies[0].sphere: expected a number from 0.0001 to 100000 m or null, found -1"},
    {"\"RigidBodies\": [{\"name\": \"a\", \"star\": {\"radius\": 1, \"innerRadius\": 2, \"height\": 1}}]",
     "s.json: RigidBodies[0].star.innerRadius: 2 is above radius, which is 1"},
    {"\"RigidBodies\": [{\"name\": \"a\", \"cylinder\": {\"radius\": 1, \"topRadius\": 1, \"height\": 1}}]",
     "s.json: RigidBodies[0].cylinder.topRadius: unknown key, did you mean radius?"},
    {"\"RigidBodies\": [{\"name\": \"a b\", \"sphere\": 1}]",
     "s.json: RigidBodies[0].name: expected a name of 1 to 63 letters, digits, _ or -, found \"a b\""},
    {"\"RigidBodies\": [{\"name\": \"a\", \"sphere\": 1, \"density\": 0}]",
     "s.json: RigidBodies[0].density: expected a number from 0.001 to 1000000 kg/m^3 or null, found 0"},
    {"\"RigidBodies\": [{\"name\": \"a\", \"sphere\": 1, \"isDynamic\": true, \"freeAxes\": [\"x\", "
     "\"rw\"]}]",
     "s.json: RigidBodies[0].freeAxes[1]: expected one of x, y, z, rx, ry, rz, found \"rw\"; did you mean "
     "rx?"},
    {"\"RigidBodies\": [{\"name\": \"a\", \"sphere\": 1, \"freeAxes\": [\"x\"]}]",
     "s.json: RigidBodies[0].freeAxes: has no meaning while isDynamic is false"},
    {"\"RigidBodies\": [{\"name\": \"a\", \"sphere\": 1}, {\"name\": \"b\", \"sphere\": 1, \"densty\": 300}]",
     "s.json: RigidBodies[1].densty: unknown key, did you mean density?"},

    {"\"RigidBodies\": [{\"name\": \"a\", \"sphere\": 1, \"drive\": true}]",
     "s.json: RigidBodies[0].drive: expected an object or null, found true"},
    {"\"RigidBodies\": [{\"name\": \"a\", \"sphere\": 1, \"drive\": {\"thurst\": 1}}]",
     "s.json: RigidBodies[0].drive.thurst: unknown key, did you mean thrust?"},
    {"\"RigidBodies\": [{\"name\": \"a\", \"sphere\": 1, \"drive\": {\"thrust\": -1, \"steering\": "
     "\"ruder\"}}]",
     "s.json: RigidBodies[0].drive.thrust: expected a number from 0 to 1e+09 N, found -1\n"
     "s.json: RigidBodies[0].drive.steering: expected one of torque, rudder, found \"ruder\"; did you mean "
     "rudder?"},

    {"\"Keys\": [{\"key\": \"w\"}]",
     "s.json: Keys[0].action: missing, expected one of throttle, rudder, camera: What it does: throttle and "
     "rudder while it is held, camera when it is pressed"},
    {"\"Keys\": [{\"key\": \"w\", \"action\": \"throttle\", \"value\": 2}]",
     "s.json: Keys[0].value: expected a number from -1 to 1, found 2"},
    {"\"Keys\": [{\"key\": \"w\", \"action\": \"throttle\", \"camera\": \"top\"}]",
     "s.json: Keys[0].camera: has no meaning for action \"throttle\", only for \"camera\""},
    {"\"Keys\": [{\"key\": \"c\", \"action\": \"camera\", \"camera\": \"mats\"}], \"Render\": {\"cameras\": "
     "[{\"name\": \"mast\", \"type\": \"bow\"}]}",
     "s.json: Keys[0].camera: there is no camera mats, did you mean mast?; there are "
     "mast|chase|fixed|orbit|top|bow"},
    {"\"Keys\": [{\"key\": \"c\", \"action\": \"camera\", \"camera\": \"mast\"}], \"Render\": {\"cameras\": "
     "[{\"name\": \"top\", \"type\": \"bow\"}]}",
     "s.json: Keys[0].camera: there is no camera mast; there are "
     "top|chase|fixed|orbit|bow"},
    {"\"Keys\": [{\"key\": \"w\", \"action\": \"throttle\"}, {\"key\": \"w\", \"action\": \"rudder\"}]",
     "s.json: Keys[1]: key w is bound by Keys[0] already"},

    {"\"Probes\": [{\"name\": \"a\", \"type\": \"height\", \"point\": [0, 0, 0], \"radius\": 1}]",
     "s.json: Probes[0].radius: has no meaning for type \"height\", only for \"pressure\""},
    {"\"Probes\": [{\"name\": \"a\", \"type\": \"force\", \"object\": \"tank\", \"point\": [0, 0, 0]}]",
     "s.json: Probes[0].point: has no meaning for type \"force\", only for \"height\" and \"pressure\""},
    {"\"Probes\": [{\"name\": \"a\", \"type\": \"force\"}]",
     "s.json: Probes[0].object: missing, expected a body's name or \"tank\""},
    {"\"Probes\": [{\"name\": \"a\", \"type\": \"force\", \"object\": \"tank\", \"min\": [0, 0, 0]}]",
     "s.json: Probes[0]: min and max go together, one of them is missing"},
};

static void bad_files_are_refused(void **state) {
    (void)state;
    for (int i = 0; i < COUNT(bad_files); i++)
        expect_message(bad_files[i].text, bad_files[i].message);
}

static void bad_values_are_refused(void **state) {
    (void)state;
    char text[1024];
    for (int i = 0; i < COUNT(bad_values); i++) {
        snprintf(text, sizeof text, "{\"version\": 1, %s}", bad_values[i].text);
        expect_message(text, bad_values[i].message);
    }
}

static void all_problems_come_at_once(void **state) {
    (void)state;
    expect_message(
        "{\"versoin\": 1,"
        " \"Configuration\": {\"viscosity\": 2, \"timeStepSize\": \"fast\"},"
        " \"Tank\": {\"type\": \"box\", \"max\": [1, 1, 1]},"
        " \"RigidBodies\": [{\"name\": \"a\", \"box\": [1, 0, 1]}],"
        " \"Probes\": [{\"name\": \"p\", \"type\": \"hieght\"}]}",
        "s.json: versoin: unknown key, did you mean version?\n"
        "s.json: Configuration.timeStepSize: expected a number from 1e-07 to 1 s, found \"fast\"\n"
        "s.json: Configuration.viscosity: expected a number from 0 to 1, found 2\n"
        "s.json: Tank.min: missing, expected 3 numbers from -100000 to 100000 m: Corner of the box with the "
        "smallest coordinates\n"
        "s.json: RigidBodies[0].box[1]: expected a number from 0.0001 to 100000 m, found 0\n"
        "s.json: Probes[0].type: expected one of height, pressure, force, found \"hieght\"; did you mean "
        "height?\n"
        "s.json: version: missing, expected 1: Version of the format");
}

/* More problems than a message can hold: what does not fit is counted. */
static void too_many_problems_are_counted(void **state) {
    (void)state;
    enum { BLOCKS = 500 };
    char *text = NULL;
    size_t size;
    FILE *stream = open_memstream(&text, &size);
    fputs("{\"version\": 1, \"FluidBlocks\": [0", stream);
    for (int i = 1; i < BLOCKS; i++)
        fprintf(stream, ", %d", i);
    fputs("]}", stream);
    fclose(stream);
    Err err = {0};
    assert_null(parse(text, &err));
    int lines = 1, more = 0;
    const char *last = err.message;
    for (const char *c = err.message; *c; c++)
        if (*c == '\n') {
            lines++;
            last = c + 1;
        }
    assert_int_equal(sscanf(last, "... and %d more problems", &more), 1);
    assert_int_equal(lines - 1 + more, BLOCKS);
    assert_true(lines > 50);
    free(text);
}

/* ---- Good scenes ---- */

static const char full[] =
    "{\"version\": 1, \"title\": \"all\", \"Configuration\": {\"duration\": 2.5, \"probeRate\": 50, "
    "\"startTime\": -1,"
    " \"gravitation\": [0, -1.62, 0], \"pressureSolver\": \"jacobi\", \"maxIterations\": 7,"
    " \"domainMin\": [-2, -2, -2], \"domainMax\": [3, 3, 3]},"
    " \"Tank\": {\"type\": \"box\", \"min\": [-1, 0, -2], \"max\": [1, 3, 2], \"open\": false, "
    "\"wetHeight\": 1.5},"
    " \"FluidBlocks\": [{\"start\": [0, 0, 0], \"end\": [1, 2, 1]},"
    "  {\"start\": [0, 0, 0], \"end\": [1, 1, 1], \"velocity\": [1, 2, 3], \"time\": 0.5, \"period\": 2, "
    "\"repeat\": 4}],"
    " \"RigidBodies\": ["
    "  {\"name\": \"crate\", \"box\": [1, 2, 3], \"density\": 600, \"isDynamic\": true, \"releaseTime\": "
    "1.5, \"stopTime\": 4, \"rampTime\": 0.25},"
    "  {\"name\": \"ball\", \"sphere\": 0.5, \"mass\": 4, \"isDynamic\": true, \"freeAxes\": [\"y\", "
    "\"rx\"]},"
    "  {\"name\": \"hull\", \"geometryFile\": \"hull.obj\", \"scale\": [2, 2, 2], \"translation\": [1, 2, 3],"
    "   \"rotationAxis\": [0, 0, 1], \"rotationAngle\": 0.5, \"velocity\": [1, 0, 0], \"angularVelocity\": "
    "[0, 2, 0]}],"
    " \"Probes\": ["
    "  {\"name\": \"h\", \"type\": \"height\", \"point\": [1, 0, 2]},"
    "  {\"name\": \"p\", \"type\": \"pressure\", \"point\": [1, 1, 1], \"radius\": 0.2, \"object\": "
    "\"crate\"},"
    "  {\"name\": \"f\", \"type\": \"force\", \"object\": \"tank\", \"min\": [0, 0, 0], \"max\": [1, 1, "
    "1]}]}";

static void assert_vec3(const float v[3], float x, float y, float z) {
    assert_true(v[0] == x && v[1] == y && v[2] == z);
}

static void keys_reach_the_def(void **state) {
    (void)state;
    Err err = {0};
    Scene *scene = scene_parse("folder/full.json", full, strlen(full), NULL, 0, &err);
    if (!scene)
        fail_msg("%s", err.message);
    const SkiffDef *def = &scene->def;
    assert_string_equal(scene->title, "all");
    assert_true(scene->duration == 2.5 && scene->probe_rate == 50 && def->start_time == -1);
    assert_vec3(def->params.gravity, 0, -1.62f, 0);
    assert_int_equal(def->params.pressure_solver, 1);
    assert_int_equal(def->params.max_iterations, 7);
    assert_true(def->has_domain);
    assert_vec3(def->domain_max, 3, 3, 3);
    assert_int_equal(def->tank.geometry.kind, SKIFF_GEOMETRY_BOX);
    assert_vec3(def->tank.geometry.size, 2, 3, 4);
    assert_vec3(def->tank.geometry.translation, 0, 1.5f, 0);
    assert_false(def->tank.open);
    assert_true(def->tank.wet_height == 1.5f);
    assert_int_equal(def->block_count, 2);
    assert_int_equal(def->blocks[0].repeat, 1);
    assert_vec3(def->blocks[1].velocity, 1, 2, 3);
    assert_true(def->blocks[1].time == 0.5 && def->blocks[1].period == 2 && def->blocks[1].repeat == 4);
    scene_free(scene);
}

static void bodies_and_probes_reach_the_def(void **state) {
    (void)state;
    Err err = {0};
    Scene *scene = scene_parse("folder/full.json", full, strlen(full), NULL, 0, &err);
    assert_non_null(scene);
    const SkiffBodyDef *bodies = scene->def.bodies;
    const SkiffProbeDef *probes = scene->def.probes;
    assert_int_equal(scene->def.body_count, 3);
    assert_int_equal(bodies[0].geometry.kind, SKIFF_GEOMETRY_BOX);
    assert_vec3(bodies[0].geometry.size, 1, 2, 3);
    assert_true(bodies[0].density == 600 && bodies[0].mass == 0 && bodies[0].release_time == 1.5);
    assert_true(bodies[0].stop_time == 4 && bodies[0].ramp_time == 0.25);
    assert_true(isinf(bodies[1].stop_time) && bodies[1].ramp_time == 0);
    assert_int_equal(bodies[0].free_axes, SKIFF_FREE_ALL);
    assert_int_equal(bodies[1].geometry.kind, SKIFF_GEOMETRY_SPHERE);
    assert_true(bodies[1].geometry.radius == 0.5f && bodies[1].mass == 4);
    assert_int_equal(bodies[1].free_axes, SKIFF_FREE_Y | SKIFF_FREE_RX);
    assert_int_equal(bodies[2].geometry.kind, SKIFF_GEOMETRY_MESH);
    assert_string_equal(bodies[2].geometry.file, "folder/hull.obj"); /* relative to the scene */
    assert_vec3(bodies[2].geometry.scale, 2, 2, 2);
    assert_vec3(bodies[2].geometry.translation, 1, 2, 3);
    assert_vec3(bodies[2].geometry.rotation_axis, 0, 0, 1);
    assert_true(bodies[2].geometry.rotation_angle == 0.5f);
    assert_vec3(bodies[2].angular_velocity, 0, 2, 0);
    assert_int_equal(bodies[2].free_axes, 0);
    assert_int_equal(scene->def.probe_count, 3);
    assert_int_equal(probes[0].kind, SKIFF_PROBE_HEIGHT);
    assert_vec3(probes[0].point, 1, 0, 2);
    assert_true(probes[1].radius == 0.2f && !probes[1].has_region);
    assert_string_equal(probes[1].object, "crate");
    assert_true(probes[2].has_region);
    assert_vec3(probes[2].max, 1, 1, 1);
    scene_free(scene);
}

static const char rounds[] =
    "{\"version\": 1, \"Tank\": {\"type\": \"cone\", \"radius\": 5, \"topRadius\": 6, \"height\": 3, "
    "\"translation\": [0, "
    "1.5, 0]}, \"RigidBodies\": [{\"name\": \"a\", \"cylinder\": {\"radius\": 0.5, \"height\": 2}},"
    "{\"name\": \"b\", \"star\": {\"radius\": 0.5, \"innerRadius\": 0.25, \"height\": 1, \"branches\": 7}, "
    "\"mass\": 3},"
    "{\"name\": \"c\", \"cone\": {\"radius\": 0.5, \"topRadius\": 0, \"height\": 1}}]}";

static void round_shapes_reach_the_def(void **state) {
    (void)state;
    Err err = {0};
    Scene *scene = parse(rounds, &err);
    assert_non_null(scene);
    const SkiffGeometryDef *tank = &scene->def.tank.geometry;
    assert_int_equal(tank->kind, SKIFF_GEOMETRY_CONE);
    assert_true(tank->radius == 5 && tank->top_radius == 6 && tank->height == 3);
    assert_vec3(tank->translation, 0, 1.5f, 0);
    const SkiffBodyDef *bodies = scene->def.bodies;
    assert_int_equal(bodies[0].geometry.kind, SKIFF_GEOMETRY_CYLINDER);
    assert_true(bodies[0].geometry.radius == 0.5f && bodies[0].geometry.height == 2);
    assert_int_equal(bodies[1].geometry.kind, SKIFF_GEOMETRY_STAR);
    assert_int_equal(bodies[1].geometry.branches, 7);
    assert_true(bodies[1].geometry.inner_radius == 0.25f);
    assert_int_equal(bodies[2].geometry.kind, SKIFF_GEOMETRY_CONE);
    assert_true(bodies[2].geometry.top_radius == 0);
    scene_free(scene);
    scene = parse("{\"version\": 1, \"Tank\": {\"type\": \"star\", \"radius\": 3.5, \"innerRadius\": 2, "
                  "\"height\": 5}}",
                  &err);
    assert_non_null(scene);
    assert_int_equal(scene->def.tank.geometry.kind, SKIFF_GEOMETRY_STAR);
    assert_int_equal(scene->def.tank.geometry.branches, 5);
    scene_free(scene);
}

/* ---- The effective scene ---- */

static char *effective_text(const Scene *scene) {
    json_t *effective = scene_effective(scene);
    char *text = json_text_format(effective, 0);
    json_decref(effective);
    assert_non_null(text);
    return text;
}

static void expect_stable(Scene *scene) {
    Err err = {0};
    assert_non_null(scene);
    char *once = effective_text(scene);
    Scene *again = parse(once, &err);
    if (!again)
        fail_msg("%s", err.message);
    char *twice = effective_text(again);
    assert_string_equal(once, twice);
    assert_memory_equal(&scene->def.params, &again->def.params, sizeof scene->def.params);
    assert_true(scene->duration == again->duration);
    free(once);
    free(twice);
    scene_free(again);
    scene_free(scene);
}

static void the_effective_scene_is_a_scene(void **state) {
    (void)state;
    Err err = {0};
    expect_stable(parse("{\"version\": 1}", &err));
    expect_stable(parse(rounds, &err));
    expect_stable(scene_parse("/nowhere/full.json", full, strlen(full), NULL, 0, &err));
    expect_stable(parse(
        "{\"version\": 1, \"Configuration\": {\"viscosity\": 0.123456789, \"duration\": 0.1234567890123},"
        " \"Tank\": {\"type\": \"mesh\", \"geometryFile\": \"/a.obj\", \"rotationAngle\": 0.1}}",
        &err));
}

static void shipped_scenes_are_good(void **state) {
    (void)state;
    static const char folder[] = SKIFF_SOURCE_DIR "/assets/scenes";
    DIR *directory = opendir(folder);
    assert_non_null(directory);
    int count = 0;
    for (const struct dirent *entry; (entry = readdir(directory)) != NULL;) {
        const char *dot = strrchr(entry->d_name, '.');
        if (!dot || strcmp(dot, ".json") != 0)
            continue;
        char path[4096];
        Err err = {0};
        snprintf(path, sizeof path, "%s/%s", folder, entry->d_name);
        Scene *scene = scene_load(path, NULL, 0, &err);
        if (!scene)
            fail_msg("%s", err.message);
        assert_true(strlen(scene->title) > 0);
        expect_stable(scene);
        count++;
    }
    closedir(directory);
    assert_true(count >= 7);
}

/* ---- Edits ---- */

static const struct {
    const char *edit;
    ErrCode code;
    const char *message; /* or, where code is ERR_NONE, "path: value" of the effective scene */
} edits[] = {
    {"Configuration.viscosity=0.05", ERR_NONE, "Configuration.viscosity: 0.05"},
    {"viscosity=0.05", ERR_NONE, "Configuration.viscosity: 0.05"},
    {"pressureSolver=gcr", ERR_NONE, "Configuration.pressureSolver: \"gcr\""},
    {"gravitation[1]=-5", ERR_NONE, "Configuration.gravitation: [0, -5, 0]"},
    {"Configuration.gravitation=[1, 2, 3]", ERR_NONE, "Configuration.gravitation: [1, 2, 3]"},
    {"domainMin=null", ERR_INPUT,
     "s.json: Configuration: domainMin and domainMax go together, one of them is missing"},
    {"title=2024", ERR_NONE, "title: \"2024\""},
    {"title=a=b", ERR_NONE, "title: \"a=b\""},
    {"Tank.open=true", ERR_NONE, "Tank.open: true"},
    {"Tank=null", ERR_NONE, "Tank: null"},
    {"Probes=[]", ERR_NONE, "Probes: []"},
    {"Keys=[]", ERR_NONE, "Keys: []"},
    {"viscosity=5", ERR_INPUT, "--set Configuration.viscosity: expected a number from 0 to 1, found 5"},
    {"viscosity=", ERR_INPUT, "--set Configuration.viscosity: expected a number from 0 to 1, found \"\""},
    {"RigidBodies[0].density=-3", ERR_INPUT,
     "--set RigidBodies[0].density: expected a number from 0.001 to 1000000 kg/m^3 or null, found -3"},
    {"gravitation[1]=down", ERR_INPUT,
     "--set Configuration.gravitation[1]: expected a number from -1000 to 1000 m/s^2, found \"down\""},
    {"viscosty=5", ERR_USAGE, "--set viscosty=5: no key \"viscosty\", did you mean viscosity?"},
    {"Configuration.viscosty=5", ERR_USAGE,
     "--set Configuration.viscosty=5: no key \"viscosty\" in Configuration, did you mean viscosity?"},
    {"RigidBodies[0].densty=3", ERR_USAGE,
     "--set RigidBodies[0].densty=3: no key \"densty\" in RigidBodies[0], did you mean density?"},
    {"RigidBodies[3].density=3", ERR_USAGE,
     "--set RigidBodies[3].density=3: RigidBodies has 3 elements, the first is [0]"},
    {"RigidBodies[-1].density=3", ERR_USAGE,
     "--set RigidBodies[-1].density=3: expected an index like [0] after RigidBodies"},
    {"RigidBodies.density=3", ERR_USAGE,
     "--set RigidBodies.density=3: expected an index like [0] after RigidBodies"},
    {"viscosity.x=3", ERR_USAGE, "--set viscosity.x=3: Configuration.viscosity has no parts"},
    {"viscosity", ERR_USAGE, "--set viscosity: expected PATH=VALUE, e.g. Configuration.viscosity=0.05"},
    {"=3", ERR_USAGE, "--set =3: expected PATH=VALUE, e.g. Configuration.viscosity=0.05"},
    {"title=\xff", ERR_USAGE, "--set title=\xff: the value is not UTF-8 text"},
};

/* "Tank.open: true": what stands at a path of keys. */
static void expect_effective(const Scene *scene, const char *expected) {
    json_t *effective = scene_effective(scene);
    const json_t *value = effective;
    const char *colon = strstr(expected, ": ");
    for (const char *key = expected; key < colon;) {
        size_t count = strcspn(key, ".:");
        char name[64];
        snprintf(name, sizeof name, "%.*s", (int)count, key);
        value = json_object_get(value, name);
        assert_non_null(value);
        key += count + 1;
    }
    char *text = json_text_format(value, -1);
    assert_string_equal(text, colon + 2);
    free(text);
    json_decref(effective);
}

static void edits_change_the_scene(void **state) {
    (void)state;
    for (int i = 0; i < COUNT(edits); i++) {
        Err err = {0};
        Scene *scene = scene_parse("s.json", full, strlen(full), &edits[i].edit, 1, &err);
        assert_int_equal(err.code, edits[i].code);
        if (edits[i].code == ERR_NONE) {
            assert_non_null(scene);
            expect_effective(scene, edits[i].message);
        } else {
            assert_null(scene);
            assert_string_equal(err.message, edits[i].message);
        }
        scene_free(scene);
    }
}

static void edits_create_what_is_missing(void **state) {
    (void)state;
    static const char text[] = "{\"version\": 1}";
    static const char *const two[] = {"gravitation[0]=2",
                                      "Tank={\"type\":\"box\",\"min\":[0,0,0],\"max\":[1,1,1]}"};
    Err err = {0};
    Scene *scene = scene_parse("s.json", text, strlen(text), two, 2, &err);
    if (!scene)
        fail_msg("%s", err.message);
    assert_vec3(scene->def.params.gravity, 2, -9.81f, 0);
    assert_int_equal(scene->def.tank.geometry.kind, SKIFF_GEOMETRY_BOX);
    scene_free(scene);
}

/* ---- Hostile bytes: any answer but a crash ---- */

static void damaged_scenes_do_not_crash(void **state) {
    (void)state;
    uint64_t random = 0;
    size_t size = strlen(full);
    char *text = malloc(size);
    assert_non_null(text);
    for (int round = 0; round < 3000; round++) {
        memcpy(text, full, size);
        for (int change = 0; change < 1 + round % 4; change++) {
            random = random_bits(1, (uint64_t)(4 * round + change));
            const char *bytes = "{}[]\",:-0e\xff\\";
            char byte = round % 2 ? bytes[(random >> 40) % strlen(bytes)] : (char)(random >> 56);
            text[(random >> 20) % size] = byte;
        }
        Err err = {0};
        Scene *scene =
            scene_parse("s.json", text, round % 3 ? size : (size_t)(random >> 33) % size, NULL, 0, &err);
        assert_true(scene ? err.code == ERR_NONE : err.code == ERR_INPUT && strlen(err.message) > 0);
        scene_free(scene);
    }
    free(text);
}

/* ---- Nearest names ---- */

static void nearest_names(void **state) {
    (void)state;
    static const struct {
        const char *word, *best;
    } rows[] = {
        {"viscosty", "viscosity"},
        {"VISCOSITY", "viscosity"},
        {"visocsity", "viscosity"},
        {"dens", "density"},
        {"x", NULL},
        {"", NULL},
        {"elephant", NULL},
        {"mass", "mass"},
    };
    for (int i = 0; i < COUNT(rows); i++) {
        Nearest nearest = nearest_begin(rows[i].word);
        nearest_offer_list(&nearest, "viscosity|density|mass");
        const char *best = nearest_result(&nearest);
        if (rows[i].best)
            assert_string_equal(best, rows[i].best);
        else
            assert_null(best);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(bad_files_are_refused),
        cmocka_unit_test(bad_values_are_refused),
        cmocka_unit_test(all_problems_come_at_once),
        cmocka_unit_test(too_many_problems_are_counted),
        cmocka_unit_test(keys_reach_the_def),
        cmocka_unit_test(bodies_and_probes_reach_the_def),
        cmocka_unit_test(round_shapes_reach_the_def),
        cmocka_unit_test(the_effective_scene_is_a_scene),
        cmocka_unit_test(shipped_scenes_are_good),
        cmocka_unit_test(edits_change_the_scene),
        cmocka_unit_test(edits_create_what_is_missing),
        cmocka_unit_test(damaged_scenes_do_not_crash),
        cmocka_unit_test(nearest_names),
    };
    return cmocka_run_group_tests_name("scene", tests, NULL, NULL);
}
