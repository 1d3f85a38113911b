/* The section "Sea" of a scene file: the tank as a window on water without end. */
#include "scene_rows.h"

static void init_sea(void *object) {
    SceneSea *sea = object;
    *sea = (SceneSea){.absorb = true};
    set3(sea->absorb_min, NAN, NAN, NAN);
    set3(sea->absorb_max, NAN, NAN, NAN);
}

static void init_point(void *object) {
    *(ScenePathPoint *)object = (ScenePathPoint){0};
}

static void check_follow(void *object, Problems *problems) {
    const SceneSea *sea = object;
    if (sea->follow && sea->path.count > 0)
        problems_add(problems, "follow and path exclude each other");
}

static void check_region(void *object, Problems *problems) {
    const SceneSea *sea = object;
    if (is_given(sea->absorb_min) != is_given(sea->absorb_max))
        problems_add(problems, "absorbMin and absorbMax go together, one of them is missing");
}

static const Field point_fields[] = {
    {ROW(FIELD_DOUBLE, ScenePathPoint, time, "time"), .min = -1e6, .max = 1e6, .unit = "s",
     .flags = FIELD_REQUIRED, .help = "When; times must rise"},
    {ROW(FIELD_DOUBLE, ScenePathPoint, x, "x"), .min = -1e9, .max = 1e9, .unit = "m", .flags = FIELD_REQUIRED,
     .help = "Where the middle of the window is then"},
    {ROW(FIELD_DOUBLE, ScenePathPoint, z, "z"), .min = -1e9, .max = 1e9, .unit = "m", .flags = FIELD_REQUIRED,
     .help = "The same across"},
};

static const ObjectType point_type = {.help = "A place on the window's path",
                                      .fields = point_fields,
                                      .field_count = COUNT(point_fields),
                                      .size = sizeof(ScenePathPoint),
                                      .init = init_point};

static const Field sea_fields[] = {
    {ROW(FIELD_FLOAT, SceneSea, level, "level"), COORDINATE, .flags = FIELD_REQUIRED,
     .help = "y of the still surface; the tank is filled with water at rest up to here"},
    {ROW(FIELD_NAME, SceneSea, follow, "follow"), .flags = FIELD_NULLABLE,
     .help = "Name of the body that the window follows; absent: it stays, or follows the path"},
    {ROW(FIELD_LIST, SceneSea, path, "path"), .max = 1000000, .object = &point_type,
     .help = "Where the window goes instead, straight from point to point"},
    {ROW(FIELD_BOOL, SceneSea, absorb, "absorb"), .help = "Waves are absorbed at the walls"},
    {ROW(FIELD_VEC3, SceneSea, absorb_min, "absorbMin"), COORDINATE, .flags = FIELD_NULLABLE,
     .help = "Only where [absorbMin, absorbMax] is at the start; absent: everywhere"},
    {ROW(FIELD_VEC3, SceneSea, absorb_max, "absorbMax"), COORDINATE, .flags = FIELD_NULLABLE,
     .help = "The corner opposite to absorbMin"},
};

static const FieldRule sea_rules[] = {{"follow|path", check_follow}, {"absorbMin|absorbMax", check_region}};

const ObjectType scene_sea_type = {.help = "A sea without end; the tank is its window and moves with it",
                                   .fields = sea_fields,
                                   .field_count = COUNT(sea_fields),
                                   .size = sizeof(SceneSea),
                                   .init = init_sea,
                                   .rules = sea_rules,
                                   .rule_count = COUNT(sea_rules)};
