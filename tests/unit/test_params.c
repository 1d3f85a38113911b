/* The parameter table: sane in itself, and the same everywhere it shows up (defaults, checks, schema, shipped
 * schema file). */
#include "app/field.h"
#include "app/json_text.h"
#include "app/scene.h"
#include "engine/base/file.h"
#include "engine/skiff.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

static int component_count(const SkiffParamInfo *info) {
    return info->type == SKIFF_VEC3 ? 3 : 1;
}

static int name_count(const char *names) {
    int count = 1;
    for (; *names; names++)
        count += *names == '|';
    return count;
}

static void keys_are_unique(void **state) {
    (void)state;
    int count;
    const SkiffParamInfo *infos = skiff_param_infos(&count);
    assert_true(count > 0);
    for (int i = 0; i < count; i++) {
        assert_true(strlen(infos[i].key) > 0);
        assert_true(strlen(infos[i].help) > 0);
        assert_non_null(infos[i].unit);
        for (int j = 0; j < i; j++) {
            assert_string_not_equal(infos[i].key, infos[j].key);
            assert_int_not_equal(infos[i].offset, infos[j].offset);
        }
    }
}

static void defaults_are_in_range(void **state) {
    (void)state;
    int count;
    const SkiffParamInfo *infos = skiff_param_infos(&count);
    for (int i = 0; i < count; i++) {
        const SkiffParamInfo *info = &infos[i];
        if (info->type == SKIFF_BOOL)
            continue;
        double max = info->type == SKIFF_ENUM ? name_count(info->names) - 1 : info->max;
        if (info->type != SKIFF_ENUM)
            assert_true(info->min < info->max);
        for (int k = 0; k < component_count(info); k++)
            assert_true(info->defaults[k] >= info->min && info->defaults[k] <= max);
    }
    Err err = {0};
    SkiffParams params = skiff_def_default().params;
    assert_true(skiff_params_check(&params, &err));
}

/* Puts one value into a field of the defaults; true if the check names the field. */
static bool is_refused(const SkiffParamInfo *info, double value) {
    SkiffParams params = skiff_def_default().params;
    char *member = (char *)&params + info->offset, expected[128];
    Err err = {0};
    if (info->type == SKIFF_INT || info->type == SKIFF_ENUM)
        *(int *)(void *)member = (int)value;
    else
        *(float *)(void *)member = (float)value;
    bool good = skiff_params_check(&params, &err);
    snprintf(expected, sizeof expected, "Configuration.%s: ", info->key);
    return !good && err.code == ERR_INPUT && strstr(err.message, expected) == err.message;
}

static void every_range_is_checked(void **state) {
    (void)state;
    int count;
    const SkiffParamInfo *infos = skiff_param_infos(&count);
    for (int i = 0; i < count; i++) {
        const SkiffParamInfo *info = &infos[i];
        double span = info->max - info->min;
        switch (info->type) {
        case SKIFF_FLOAT:
        case SKIFF_VEC3:
            assert_true(is_refused(info, info->max + span));
            assert_true(is_refused(info, info->min - span));
            assert_true(is_refused(info, NAN));
            assert_true(is_refused(info, INFINITY));
            break;
        case SKIFF_INT:
            assert_true(is_refused(info, info->max + 1));
            assert_true(is_refused(info, info->min - 1));
            break;
        case SKIFF_ENUM:
            assert_true(is_refused(info, name_count(info->names)));
            assert_true(is_refused(info, -1));
            break;
        case SKIFF_BOOL:
            break;
        }
    }
}

static json_t *configuration_of(const json_t *scene) {
    return json_object_get(scene, "Configuration");
}

static void a_scene_has_every_default(void **state) {
    (void)state;
    static const char text[] = "{\"version\": 1}";
    int count;
    const SkiffParamInfo *infos = skiff_param_infos(&count);
    Err err = {0};
    Scene *scene = scene_parse("empty.json", text, strlen(text), NULL, 0, &err);
    assert_non_null(scene);
    SkiffParams defaults = skiff_def_default().params;
    assert_memory_equal(&scene->def.params, &defaults, sizeof defaults);
    json_t *effective = scene_effective(scene);
    for (int i = 0; i < count; i++) {
        json_t *value = json_object_get(configuration_of(effective), infos[i].key);
        assert_non_null(value);
        if (infos[i].type == SKIFF_FLOAT)
            assert_true((float)json_number_value(value) == (float)infos[i].defaults[0]);
        if (infos[i].type == SKIFF_INT)
            assert_true(json_number_value(value) == infos[i].defaults[0]);
        if (infos[i].type == SKIFF_ENUM)
            assert_true(field_name_index(infos[i].names, json_string_value(value)) == infos[i].defaults[0]);
        if (infos[i].type == SKIFF_VEC3)
            assert_int_equal(json_array_size(value), 3);
    }
    json_decref(effective);
    scene_free(scene);
}

static void the_schema_lists_every_key(void **state) {
    (void)state;
    int count;
    const SkiffParamInfo *infos = skiff_param_infos(&count);
    json_t *schema = scene_schema();
    json_t *configuration = configuration_of(json_object_get(schema, "properties"));
    json_t *properties = json_object_get(configuration, "properties");
    assert_non_null(properties);
    for (int i = 0; i < count; i++) {
        json_t *entry = json_object_get(properties, infos[i].key);
        assert_non_null(entry);
        assert_non_null(json_object_get(entry, "default"));
        assert_non_null(strstr(json_string_value(json_object_get(entry, "description")), infos[i].help));
    }
    json_decref(schema);
}

static void the_shipped_schema_is_current(void **state) {
    (void)state;
    char *shipped;
    size_t size;
    Err err = {0};
    json_t *schema = scene_schema();
    char *text = json_text_format(schema, 0);
    json_decref(schema);
    if (!file_read(SKIFF_SOURCE_DIR "/assets/schema/scene.schema.json", 1 << 24, &shipped, &size, &err))
        fail_msg("%s", err.message);
    if (strcmp(shipped, text) != 0)
        fail_msg("assets/schema/scene.schema.json is not what `skiff check --schema` prints: write it anew");
    free(shipped);
    free(text);
}

static void instruction_sets_have_their_words(void **state) {
    (void)state;
    char list[128] = "";
    for (int i = SKIFF_SIMD_AUTO; i <= SKIFF_SIMD_AVX512; i++)
        snprintf(list + strlen(list), sizeof list - strlen(list), "%s%s", i > 0 ? "|" : "",
                 skiff_simd_name((SkiffSimd)i));
    assert_string_equal(list, SKIFF_SIMD_NAMES);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(instruction_sets_have_their_words),
        cmocka_unit_test(keys_are_unique),
        cmocka_unit_test(defaults_are_in_range),
        cmocka_unit_test(every_range_is_checked),
        cmocka_unit_test(a_scene_has_every_default),
        cmocka_unit_test(the_schema_lists_every_key),
        cmocka_unit_test(the_shipped_schema_is_current),
    };
    return cmocka_run_group_tests_name("params", tests, NULL, NULL);
}
