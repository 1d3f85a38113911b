/* Walks an object's table: reads and checks it, writes it, makes its schema. What a single value is belongs
 * to field_types.c. */
#include "field.h"

#include "nearest.h"

#include <assert.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { FIELD_MAX_COUNT = 256 };

void *pool_alloc(Pool *pool, size_t size) {
    void **blocks = realloc(pool->blocks, (pool->count + 1) * sizeof *blocks);
    void *block = calloc(1, size > 0 ? size : 1);
    if (!blocks || !block) {
        fputs("skiff: out of memory while reading a scene\n", stderr);
        exit(ERR_INPUT);
    }
    blocks[pool->count++] = block;
    pool->blocks = blocks;
    return block;
}

void pool_free(Pool *pool) {
    for (size_t i = 0; i < pool->count; i++)
        free(pool->blocks[i]);
    free(pool->blocks);
    *pool = (Pool){0};
}

bool field_at(const ObjectType *type, int index, Field *field) {
    if (index < type->field_count) {
        *field = type->fields[index];
        return true;
    }
    return type->more && type->more(index - type->field_count, field);
}

bool field_find(const ObjectType *type, const char *key, Field *field) {
    for (int i = 0; field_at(type, i, field); i++)
        if (strcmp(field->key, key) == 0)
            return true;
    return false;
}

int field_name_index(const char *names, const char *name) {
    size_t length = strlen(name);
    for (int index = 0; *names; index++) {
        size_t count = strcspn(names, "|");
        if (count == length && memcmp(names, name, count) == 0)
            return index;
        names += count + (names[count] == '|');
    }
    return -1;
}

void field_name_at(const char *names, int index, char *out, size_t size) {
    for (; *names && index > 0; index--) {
        size_t count = strcspn(names, "|");
        names += count + (names[count] == '|');
    }
    snprintf(out, size, "%.*s", (int)strcspn(names, "|"), index == 0 ? names : "");
}

static void *member_of(const Field *field, const void *object) {
    return (char *)(uintptr_t)object + field->offset;
}

/* Bit of the object's variant; all bits where it has none. */
static unsigned variant_of(const ObjectType *type, const void *object) {
    Field field;
    if (!type->variant_key || !field_find(type, type->variant_key, &field))
        return ~0u;
    int index;
    memcpy(&index, member_of(&field, object), sizeof index);
    return 1u << index;
}

static bool has_meaning(const Field *field, unsigned variant) {
    return field->variants == 0 || (field->variants & variant) != 0;
}

/* ---- Reading ---- */

static void report_unknown_key(const ObjectType *type, const char *key, FieldReader *reader) {
    Field field;
    char known[512] = "";
    Nearest nearest = nearest_begin(key);
    for (int i = 0; field_at(type, i, &field); i++) {
        size_t used = strlen(known);
        nearest_offer(&nearest, field.key);
        snprintf(known + used, sizeof known - used, "%s%s", used > 0 ? ", " : "", field.key);
    }
    const char *best = nearest_result(&nearest);
    size_t mark = problems_enter(reader->problems, key);
    if (best)
        problems_add(reader->problems, "unknown key, did you mean %s?", best);
    else if (type->more)
        problems_add(reader->problems, "unknown key; `skiff check --schema` lists all");
    else
        problems_add(reader->problems, "unknown key, expected one of %s", known);
    problems_leave(reader->problems, mark);
}

static void report_unknown_keys(const ObjectType *type, const json_t *value, FieldReader *reader) {
    const char *key;
    json_t *item;
    Field field;
    json_object_foreach((json_t *)(uintptr_t)value, key, item) {
        if (!field_find(type, key, &field))
            report_unknown_key(type, key, reader);
    }
}

static void report_unused(const ObjectType *type, const Field *field, const void *object,
                          FieldReader *reader) {
    Field selector;
    int index;
    char value[64], name[64], others[256] = "";
    field_find(type, type->variant_key, &selector);
    memcpy(&index, member_of(&selector, object), sizeof index);
    field_name_at(selector.names, index, value, sizeof value);
    for (int i = 0; i < 32; i++) {
        field_name_at(selector.names, i, name, sizeof name);
        size_t used = strlen(others);
        if (*name && field->variants >> i & 1)
            snprintf(others + used, sizeof others - used, "%s\"%s\"", used > 0 ? " and " : "", name);
    }
    problems_add(reader->problems, "has no meaning for %s \"%s\", only for %s", selector.key, value, others);
}

static void report_missing(const Field *field, FieldReader *reader) {
    char want[256];
    field_describe(field, want, sizeof want);
    problems_add(reader->problems, "missing, expected %s: %s", want, field->help);
}

/* At most one member of each group, exactly one where they are required. */
static void check_groups(const ObjectType *type, const json_t *value, FieldReader *reader) {
    Field field, other;
    for (int i = 0; field_at(type, i, &field); i++) {
        int given = 0;
        char keys[256] = "";
        bool first = field.group != 0;
        for (int j = 0; first && field_at(type, j, &other); j++) {
            if (other.group != field.group)
                continue;
            first = j >= i;
            const json_t *item = json_object_get(value, other.key);
            given += item && !json_is_null(item);
            size_t used = strlen(keys);
            snprintf(keys + used, sizeof keys - used, "%s%s", used > 0 ? ", " : "", other.key);
        }
        if (first && given > 1)
            problems_add(reader->problems, "%d of %s are given, expected one", given, keys);
        else if (first && given == 0 && (field.flags & FIELD_REQUIRED))
            problems_add(reader->problems, "missing, expected one of %s", keys);
    }
}

static void check_presence(const ObjectType *type, const json_t *value, const void *object, bool *failed,
                           FieldReader *reader) {
    Field field;
    unsigned variant = variant_of(type, object);
    for (int i = 0; field_at(type, i, &field); i++)
        if (type->variant_key && strcmp(field.key, type->variant_key) == 0 &&
            (failed[i] || !json_object_get(value, field.key)))
            variant = 0; /* unknown: only keys that belong to every variant can be judged */
    for (int i = 0; field_at(type, i, &field); i++) {
        const json_t *item = json_object_get(value, field.key);
        size_t mark = problems_enter(reader->problems, field.key);
        if (item && variant != 0 && !has_meaning(&field, variant))
            report_unused(type, &field, object, reader);
        if (!item && has_meaning(&field, variant) && (field.flags & FIELD_REQUIRED) && field.group == 0) {
            report_missing(&field, reader);
            failed[i] = true;
        }
        problems_leave(reader->problems, mark);
    }
    check_groups(type, value, reader);
}

static void check_rules(const ObjectType *type, void *object, const bool *failed, FieldReader *reader) {
    Field field;
    for (int r = 0; r < type->rule_count; r++) {
        bool can_ask = true;
        for (int i = 0; field_at(type, i, &field); i++)
            can_ask = can_ask && !(failed[i] && field_name_index(type->rules[r].keys, field.key) >= 0);
        if (can_ask)
            type->rules[r].check(object, reader->problems);
    }
}

void field_read(const ObjectType *type, const json_t *value, void *object, FieldReader *reader) {
    Field field;
    bool failed[FIELD_MAX_COUNT] = {false};
    type->init(object);
    report_unknown_keys(type, value, reader);
    for (int i = 0; field_at(type, i, &field); i++) {
        assert(i < FIELD_MAX_COUNT);
        const json_t *item = json_object_get(value, field.key);
        if (!item || (json_is_null(item) && (field.flags & FIELD_NULLABLE)))
            continue;
        int count = reader->problems->count;
        size_t mark = problems_enter(reader->problems, field.key);
        field_type_row(field.type)->read(&field, item, member_of(&field, object), reader);
        problems_leave(reader->problems, mark);
        failed[i] = reader->problems->count > count;
    }
    check_presence(type, value, object, failed, reader);
    check_rules(type, object, failed, reader);
}

/* ---- Writing ---- */

json_t *field_write(const ObjectType *type, const void *object) {
    Field field;
    json_t *value = json_object();
    unsigned variant = variant_of(type, object);
    for (int i = 0; field_at(type, i, &field); i++) {
        if (!has_meaning(&field, variant))
            continue;
        json_t *item = field_type_row(field.type)->write(&field, member_of(&field, object));
        if (field.group != 0 && json_is_null(item))
            json_decref(item);
        else
            json_object_set_new(value, field.key, item);
    }
    return value;
}

/* ---- Schema ---- */

static json_t *schema_of_field(const Field *field, const void *defaults) {
    char help[512];
    json_t *schema = json_object();
    if (field->unit && *field->unit)
        snprintf(help, sizeof help, "%s (%s)", field->help, field->unit);
    else
        snprintf(help, sizeof help, "%s", field->help);
    field_type_row(field->type)->schema(field, schema);
    json_object_set_new(schema, "description", json_string(help));
    json_t *value = field_type_row(field->type)->write(field, member_of(field, defaults));
    bool is_default = !(field->flags & FIELD_REQUIRED) && !json_is_null(value) && field->type != FIELD_OBJECT;
    if (is_default)
        json_object_set(schema, "default", value);
    json_decref(value);
    return schema;
}

/* "if type is box then min is required and planes is not allowed", once for each variant. */
static void schema_variants(const ObjectType *type, json_t *rules) {
    Field selector, field;
    char name[64];
    if (!type->variant_key || !field_find(type, type->variant_key, &selector))
        return;
    for (int v = 0; field_name_at(selector.names, v, name, sizeof name), *name; v++) {
        json_t *required = json_array(), *forbidden = json_object();
        for (int i = 0; field_at(type, i, &field); i++) {
            if (field.variants == 0)
                continue;
            if (!has_meaning(&field, 1u << v))
                json_object_set_new(forbidden, field.key, json_false());
            else if (field.flags & FIELD_REQUIRED)
                json_array_append_new(required, json_string(field.key));
        }
        json_array_append_new(rules, json_pack("{s{s{s{ss}}s[s]}s{soso}}", "if", "properties", selector.key,
                                               "const", name, "required", selector.key, "then", "required",
                                               required, "properties", forbidden));
    }
}

static void schema_groups(const ObjectType *type, json_t *rules) {
    Field field, other;
    for (int i = 0; field_at(type, i, &field); i++) {
        json_t *choices = json_array();
        bool first = field.group != 0;
        for (int j = 0; first && field_at(type, j, &other); j++) {
            if (other.group != field.group)
                continue;
            first = j >= i;
            json_array_append_new(choices, json_pack("{s[s]}", "required", other.key));
        }
        if (first && (field.flags & FIELD_REQUIRED))
            json_array_append_new(rules, json_pack("{sO}", "oneOf", choices));
        else if (first)
            json_array_append_new(rules, json_pack("{s{sO}}", "not", "allOf", choices));
        json_decref(choices);
    }
}

json_t *field_schema(const ObjectType *type) {
    Field field;
    void *defaults = calloc(1, type->size);
    if (!defaults)
        return NULL;
    type->init(defaults);
    json_t *properties = json_object(), *required = json_array(), *rules = json_array();
    for (int i = 0; field_at(type, i, &field); i++) {
        json_object_set_new(properties, field.key, schema_of_field(&field, defaults));
        if ((field.flags & FIELD_REQUIRED) && field.group == 0 && field.variants == 0)
            json_array_append_new(required, json_string(field.key));
    }
    free(defaults);
    schema_variants(type, rules);
    schema_groups(type, rules);
    json_t *schema =
        json_pack("{ssssso}", "type", "object", "description", type->help, "properties", properties);
    json_object_set_new(schema, "required", required);
    json_object_set_new(schema, "additionalProperties", json_false());
    if (json_array_size(rules) > 0)
        json_object_set(schema, "allOf", rules);
    json_decref(rules);
    return schema;
}
