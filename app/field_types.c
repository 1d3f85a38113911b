/* One row for each FieldType: how it is read, written, put in the schema and described. */
#include "field.h"

#include "json_text.h"
#include "nearest.h"

#include <limits.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { DESCRIPTION_SIZE = 256 };

/* Limits given as floats print and compare as the decimals they were written as. */
static double short_decimal(double value) {
    json_t *number = json_text_float((float)value);
    double decimal = json_number_value(number);
    json_decref(number);
    return (float)value == (float)decimal ? decimal : value;
}

static void describe_found(const json_t *value, char *out, size_t size) {
    char text[48];
    switch (json_typeof(value)) {
    case JSON_OBJECT:
        snprintf(out, size, "an object");
        break;
    case JSON_ARRAY:
        snprintf(out, size, "a list of %zu", json_array_size(value));
        break;
    case JSON_STRING:
        problems_quote(text, sizeof text, json_string_value(value));
        snprintf(out, size, "\"%s\"", text);
        break;
    case JSON_INTEGER:
        snprintf(out, size, "%lld", (long long)json_integer_value(value));
        break;
    case JSON_REAL:
        snprintf(out, size, "%.9g", json_real_value(value));
        break;
    case JSON_TRUE:
        snprintf(out, size, "true");
        break;
    case JSON_FALSE:
        snprintf(out, size, "false");
        break;
    case JSON_NULL:
        snprintf(out, size, "null");
        break;
    }
}

static void expected(const Field *field, const json_t *value, FieldReader *reader) {
    char want[DESCRIPTION_SIZE], found[64];
    field_describe(field, want, sizeof want);
    describe_found(value, found, sizeof found);
    problems_add(reader->problems, "expected %s, found %s", want, found);
}

static void describe_range(const Field *field, const char *what, char *out, size_t size) {
    const char *unit = field->unit ? field->unit : "";
    double min = short_decimal(field->min), max = short_decimal(field->max);
    const char *space = *unit ? " " : "";
    if (field->min == field->max)
        snprintf(out, size, "%.7g", min);
    else
        snprintf(out, size, "%s from %.7g to %.7g%s%s", what, min, max, space, unit);
}

static void schema_range(const Field *field, json_t *schema) {
    json_object_set_new(schema, "minimum", json_real(short_decimal(field->min)));
    json_object_set_new(schema, "maximum", json_real(short_decimal(field->max)));
}

static void schema_type(const Field *field, const char *type, json_t *schema) {
    if (field->flags & FIELD_NULLABLE)
        json_object_set_new(schema, "type", json_pack("[ss]", type, "null"));
    else
        json_object_set_new(schema, "type", json_string(type));
}

/* ---- Numbers ---- */

static bool in_range(const Field *field, double value) {
    return value >= short_decimal(field->min) && value <= short_decimal(field->max);
}

static void read_float(const Field *field, const json_t *value, void *member, FieldReader *reader) {
    if (!json_is_number(value) || !in_range(field, json_number_value(value)))
        expected(field, value, reader);
    else
        *(float *)member = (float)json_number_value(value);
}

static json_t *write_float(const Field *field, const void *member) {
    (void)field;
    return json_text_float(*(const float *)member);
}

static void read_double(const Field *field, const json_t *value, void *member, FieldReader *reader) {
    if (!json_is_number(value) || !in_range(field, json_number_value(value)))
        expected(field, value, reader);
    else
        *(double *)member = json_number_value(value);
}

static json_t *write_double(const Field *field, const void *member) {
    (void)field;
    return json_text_double(*(const double *)member);
}

static void schema_number(const Field *field, json_t *schema) {
    schema_type(field, "number", schema);
    schema_range(field, schema);
}

static void describe_number(const Field *field, char *out, size_t size) {
    describe_range(field, "a number", out, size);
}

static void read_int(const Field *field, const json_t *value, void *member, FieldReader *reader) {
    double number = json_number_value(value);
    if (!json_is_number(value) || number != floor(number) || !in_range(field, number))
        expected(field, value, reader);
    else
        *(int *)member = (int)number;
}

static json_t *write_int(const Field *field, const void *member) {
    (void)field;
    return json_integer(*(const int *)member);
}

static void schema_int(const Field *field, json_t *schema) {
    schema_type(field, "integer", schema);
    json_object_set_new(schema, "minimum", json_integer((json_int_t)field->min));
    json_object_set_new(schema, "maximum", json_integer((json_int_t)field->max));
}

static void describe_int(const Field *field, char *out, size_t size) {
    describe_range(field, "an integer", out, size);
}

static void read_bool(const Field *field, const json_t *value, void *member, FieldReader *reader) {
    if (!json_is_boolean(value))
        expected(field, value, reader);
    else
        *(bool *)member = json_is_true(value);
}

static json_t *write_bool(const Field *field, const void *member) {
    (void)field;
    return json_boolean(*(const bool *)member);
}

static void schema_bool(const Field *field, json_t *schema) {
    schema_type(field, "boolean", schema);
}

static void describe_bool(const Field *field, char *out, size_t size) {
    (void)field;
    snprintf(out, size, "true or false");
}

static void read_vec3(const Field *field, const json_t *value, void *member, FieldReader *reader) {
    if (!json_is_array(value) || json_array_size(value) != 3) {
        expected(field, value, reader);
        return;
    }
    Field component = *field;
    component.type = FIELD_FLOAT;
    component.flags = 0;
    for (size_t i = 0; i < 3; i++) {
        size_t mark = problems_enter_index(reader->problems, i);
        read_float(&component, json_array_get(value, i), (float *)member + i, reader);
        problems_leave(reader->problems, mark);
    }
}

static json_t *write_vec3(const Field *field, const void *member) {
    (void)field;
    const float *vector = member;
    if (!isfinite(vector[0]))
        return json_null();
    return json_pack("[ooo]", json_text_float(vector[0]), json_text_float(vector[1]),
                     json_text_float(vector[2]));
}

static void schema_vec3(const Field *field, json_t *schema) {
    json_t *items = json_pack("{ss}", "type", "number");
    schema_range(field, items);
    schema_type(field, "array", schema);
    json_object_set_new(schema, "items", items);
    json_object_set_new(schema, "minItems", json_integer(3));
    json_object_set_new(schema, "maxItems", json_integer(3));
}

static void describe_vec3(const Field *field, char *out, size_t size) {
    describe_range(field, "3 numbers", out, size);
}

/* ---- Names of a list ---- */

static void list_names(const char *names, const char *lead, char *out, size_t size) {
    size_t used = (size_t)snprintf(out, size, "%s", lead);
    for (const char *name = names; *name && used < size;) {
        int count = (int)strcspn(name, "|");
        const char *comma = name == names ? "" : ", ";
        used += (size_t)snprintf(out + used, size - used, "%s%.*s", comma, count, name);
        name += count + (name[count] == '|');
    }
}

static json_t *schema_names(const char *names) {
    json_t *list = json_array();
    for (const char *name = names; *name;) {
        size_t count = strcspn(name, "|");
        json_array_append_new(list, json_stringn(name, count));
        name += count + (name[count] == '|');
    }
    return list;
}

/* Position in field->names or -1, reported with the nearest name. */
static int read_name_of(const Field *field, const json_t *value, FieldReader *reader) {
    int index = json_is_string(value) ? field_name_index(field->names, json_string_value(value)) : -1;
    if (index >= 0)
        return index;
    char want[DESCRIPTION_SIZE], found[64];
    list_names(field->names, "", want, sizeof want);
    describe_found(value, found, sizeof found);
    Nearest nearest = nearest_begin(json_is_string(value) ? json_string_value(value) : "");
    nearest_offer_list(&nearest, field->names);
    const char *best = nearest_result(&nearest);
    problems_add(reader->problems, "expected one of %s, found %s%s%s%s", want, found,
                 best ? "; did you mean " : "", best ? best : "", best ? "?" : "");
    return -1;
}

static void read_enum(const Field *field, const json_t *value, void *member, FieldReader *reader) {
    int index = read_name_of(field, value, reader);
    if (index >= 0)
        memcpy(member, &index, sizeof index);
}

static json_t *write_enum(const Field *field, const void *member) {
    int index;
    char name[64];
    memcpy(&index, member, sizeof index);
    field_name_at(field->names, index, name, sizeof name);
    return *name ? json_string(name) : json_null();
}

static void schema_enum(const Field *field, json_t *schema) {
    json_object_set_new(schema, "enum", schema_names(field->names));
}

static void describe_enum(const Field *field, char *out, size_t size) {
    list_names(field->names, "one of ", out, size);
}

static void read_flags(const Field *field, const json_t *value, void *member, FieldReader *reader) {
    if (!json_is_array(value)) {
        expected(field, value, reader);
        return;
    }
    uint32_t flags = 0;
    for (size_t i = 0; i < json_array_size(value); i++) {
        size_t mark = problems_enter_index(reader->problems, i);
        int index = read_name_of(field, json_array_get(value, i), reader);
        if (index >= 0)
            flags |= UINT32_C(1) << index;
        problems_leave(reader->problems, mark);
    }
    *(uint32_t *)member = flags;
}

static json_t *write_flags(const Field *field, const void *member) {
    uint32_t flags = *(const uint32_t *)member;
    if (flags == UINT32_MAX)
        return json_null();
    json_t *list = json_array();
    char name[64];
    for (int i = 0; i < 32; i++) {
        field_name_at(field->names, i, name, sizeof name);
        if (*name && flags >> i & 1)
            json_array_append_new(list, json_string(name));
    }
    return list;
}

static void schema_flags(const Field *field, json_t *schema) {
    schema_type(field, "array", schema);
    json_object_set_new(schema, "items", json_pack("{so}", "enum", schema_names(field->names)));
    json_object_set_new(schema, "uniqueItems", json_true());
}

static void describe_flags(const Field *field, char *out, size_t size) {
    list_names(field->names, "a list of some of ", out, size);
}

/* ---- Text ---- */

static void read_text(const Field *field, const json_t *value, void *member, FieldReader *reader) {
    if (!json_is_string(value))
        expected(field, value, reader);
    else
        *(const char **)member = json_string_value(value);
}

static json_t *write_text(const Field *field, const void *member) {
    (void)field;
    const char *text = *(const char *const *)member;
    return text ? json_string(text) : json_null();
}

static void schema_text(const Field *field, json_t *schema) {
    schema_type(field, "string", schema);
}

static void describe_text(const Field *field, char *out, size_t size) {
    (void)field;
    snprintf(out, size, "text");
}

static void read_name(const Field *field, const json_t *value, void *member, FieldReader *reader) {
    static const char allowed[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_-";
    const char *name = json_string_value(value);
    if (!name || strlen(name) < 1 || strlen(name) > 63 || name[strspn(name, allowed)] != '\0')
        expected(field, value, reader);
    else
        *(const char **)member = name;
}

static void schema_name(const Field *field, json_t *schema) {
    schema_type(field, "string", schema);
    json_object_set_new(schema, "pattern", json_string("^[A-Za-z0-9_-]{1,63}$"));
}

static void describe_name(const Field *field, char *out, size_t size) {
    (void)field;
    snprintf(out, size, "a name of 1 to 63 letters, digits, _ or -");
}

static void read_file(const Field *field, const json_t *value, void *member, FieldReader *reader) {
    const char *name = json_string_value(value);
    if (!name || !*name || strlen(name) >= PATH_MAX / 2) {
        expected(field, value, reader);
        return;
    }
    char path[2 * PATH_MAX], full[PATH_MAX];
    if (name[0] == '/')
        snprintf(path, sizeof path, "%s", name);
    else
        snprintf(path, sizeof path, "%s/%s", reader->folder, name);
    const char *result =
        realpath(path, full) ? full : path; /* a missing file is reported by whoever reads it */
    json_t *kept = json_string(result);
    json_decref(kept);
    if (!kept) {
        problems_add(reader->problems, "the name of its folder is not UTF-8 text, which scene.json must be");
        return;
    }
    size_t size = strlen(result) + 1;
    char *copy = pool_alloc(reader->pool, size);
    memcpy(copy, result, size);
    *(const char **)member = copy;
}

static void schema_file(const Field *field, json_t *schema) {
    schema_type(field, "string", schema);
    json_object_set_new(schema, "minLength", json_integer(1));
}

static void describe_file(const Field *field, char *out, size_t size) {
    (void)field;
    snprintf(out, size, "a file name");
}

/* ---- Objects ---- */

static void read_object(const Field *field, const json_t *value, void *member, FieldReader *reader) {
    if (!json_is_object(value)) {
        expected(field, value, reader);
        return;
    }
    void *object = pool_alloc(reader->pool, field->object->size);
    field_read(field->object, value, object, reader);
    *(void **)member = object;
}

static json_t *write_object(const Field *field, const void *member) {
    const void *object = *(void *const *)member;
    return object ? field_write(field->object, object) : json_null();
}

static void schema_object(const Field *field, json_t *schema) {
    json_t *object = field_schema(field->object);
    json_object_update(schema, object);
    json_decref(object);
    schema_type(field, "object", schema);
}

static void describe_object(const Field *field, char *out, size_t size) {
    (void)field;
    snprintf(out, size, "an object");
}

static void read_list(const Field *field, const json_t *value, void *member, FieldReader *reader) {
    size_t count = json_array_size(value);
    if (!json_is_array(value) || (double)count > field->max) {
        expected(field, value, reader);
        return;
    }
    const ObjectType *type = field->object;
    char *items = pool_alloc(reader->pool, count * type->size);
    for (size_t i = 0; i < count; i++) {
        const json_t *item = json_array_get(value, i);
        size_t mark = problems_enter_index(reader->problems, i);
        if (json_is_object(item))
            field_read(type, item, items + i * type->size, reader);
        else
            expected(&(Field){.type = FIELD_OBJECT}, item, reader);
        problems_leave(reader->problems, mark);
    }
    *(FieldList *)member = (FieldList){items, (int)count};
}

static json_t *write_list(const Field *field, const void *member) {
    const FieldList *list = member;
    json_t *array = json_array();
    for (int i = 0; i < list->count; i++)
        json_array_append_new(
            array, field_write(field->object, (char *)list->items + (size_t)i * field->object->size));
    return array;
}

static void schema_list(const Field *field, json_t *schema) {
    schema_type(field, "array", schema);
    json_object_set_new(schema, "items", field_schema(field->object));
    json_object_set_new(schema, "maxItems", json_integer((json_int_t)field->max));
}

static void describe_list(const Field *field, char *out, size_t size) {
    snprintf(out, size, "a list of at most %.0f objects", field->max);
}

static const FieldTypeRow rows[] = {
    [FIELD_FLOAT] = {read_float, write_float, schema_number, describe_number},
    [FIELD_DOUBLE] = {read_double, write_double, schema_number, describe_number},
    [FIELD_INT] = {read_int, write_int, schema_int, describe_int},
    [FIELD_BOOL] = {read_bool, write_bool, schema_bool, describe_bool},
    [FIELD_VEC3] = {read_vec3, write_vec3, schema_vec3, describe_vec3},
    [FIELD_ENUM] = {read_enum, write_enum, schema_enum, describe_enum},
    [FIELD_FLAGS] = {read_flags, write_flags, schema_flags, describe_flags},
    [FIELD_TEXT] = {read_text, write_text, schema_text, describe_text},
    [FIELD_NAME] = {read_name, write_text, schema_name, describe_name},
    [FIELD_FILE] = {read_file, write_text, schema_file, describe_file},
    [FIELD_OBJECT] = {read_object, write_object, schema_object, describe_object},
    [FIELD_LIST] = {read_list, write_list, schema_list, describe_list},
};

const FieldTypeRow *field_type_row(FieldType type) {
    return &rows[type];
}

void field_describe(const Field *field, char *out, size_t size) {
    rows[field->type].describe(field, out, size);
    size_t used = strlen(out);
    if (field->flags & FIELD_NULLABLE)
        snprintf(out + used, size - used, " or null");
}
