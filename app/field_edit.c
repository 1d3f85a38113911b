/* "RigidBodies[0].density=300": finds the place in a JSON document by the tables, creates what is missing on
 * the way there, and puts the value in. Whether the value is right is left to field_read, which sees the
 * edited document. */
#include "field.h"

#include "nearest.h"

#include <ctype.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct Edit {
    const char *text; /* the whole of "path=value", for messages */
    const char *at;   /* rest of the path */
    const char *end;  /* of the path: the '=' */
    const char *value;
    char *path; /* full path so far */
    size_t size;
    Err *err;
} Edit;

static void path_add(Edit *edit, const char *text) {
    size_t used = strlen(edit->path);
    snprintf(edit->path + used, edit->size - used, "%s%s", used > 0 && *text != '[' ? "." : "", text);
}

static bool no_such_key(const Edit *edit, const ObjectType *type, const ObjectType *other, const char *key) {
    Field field;
    char quoted[64];
    Nearest nearest = nearest_begin(key);
    for (int i = 0; field_at(type, i, &field); i++)
        nearest_offer(&nearest, field.key);
    for (int i = 0; other && field_at(other, i, &field); i++)
        nearest_offer(&nearest, field.key);
    const char *best = nearest_result(&nearest);
    problems_quote(quoted, sizeof quoted, key);
    return err_set(edit->err, ERR_USAGE, "--set %.200s: no key \"%s\"%s%s%s%s%s", edit->text, quoted,
                   *edit->path ? " in " : "", edit->path, best ? ", did you mean " : "", best ? best : "",
                   best ? "?" : "");
}

/* Takes "key" off the path. */
static bool take_key(Edit *edit, char *key, size_t size) {
    size_t count = strcspn(edit->at, ".[=");
    if (count == 0 || count >= size)
        return err_set(edit->err, ERR_USAGE,
                       "--set %.200s: expected PATH=VALUE, e.g. Configuration.viscosity=0.05", edit->text);
    memcpy(key, edit->at, count);
    key[count] = '\0';
    edit->at += count;
    return true;
}

/* Takes "[index]" off the path; index must be below count. */
static bool take_index(Edit *edit, size_t count, size_t *index) {
    char *end;
    unsigned long number = isdigit((unsigned char)edit->at[1]) ? strtoul(edit->at + 1, &end, 10) : 0;
    if (!isdigit((unsigned char)edit->at[1]) || *end != ']')
        return err_set(edit->err, ERR_USAGE, "--set %.200s: expected an index like [0] after %s", edit->text,
                       edit->path);
    if (number >= count)
        return err_set(edit->err, ERR_USAGE, "--set %.200s: %s has %zu element%s, the first is [0]",
                       edit->text, edit->path, count, count == 1 ? "" : "s");
    char text[32];
    snprintf(text, sizeof text, "[%lu]", number);
    path_add(edit, text);
    edit->at = end + 1;
    *index = number;
    return true;
}

static bool wrong_kind(const Edit *edit, const char *what) {
    return err_set(edit->err, ERR_USAGE, "--set %.200s: %s is not %s in the scene", edit->text, edit->path,
                   what);
}

/* The value as JSON where it is JSON, as text otherwise; for text fields as it stands. */
static json_t *parse_value(const Edit *edit, const Field *field) {
    bool is_text = field && (field->type == FIELD_TEXT || field->type == FIELD_NAME ||
                             field->type == FIELD_FILE || field->type == FIELD_ENUM);
    bool is_json = !is_text || edit->value[0] == '"' || strcmp(edit->value, "null") == 0;
    json_t *value = is_json ? json_loads(edit->value, JSON_DECODE_ANY | JSON_REJECT_DUPLICATES, NULL) : NULL;
    return value ? value : json_string(edit->value);
}

/* What the key has when the file does not say. */
static json_t *default_of(const ObjectType *type, const Field *field) {
    void *object = calloc(1, type->size);
    if (!object)
        return NULL;
    type->init(object);
    json_t *value = field_type_row(field->type)->write(field, (char *)object + field->offset);
    free(object);
    return value;
}

static bool edit_element(Edit *edit, json_t *list) {
    size_t index;
    if (!json_is_array(list))
        return wrong_kind(edit, "a list");
    if (!take_index(edit, json_array_size(list), &index))
        return false;
    if (edit->at != edit->end)
        return err_set(edit->err, ERR_USAGE, "--set %.200s: %s has no parts", edit->text, edit->path);
    json_array_set_new(list, index, parse_value(edit, NULL));
    return true;
}

static bool edit_object(Edit *edit, const ObjectType *type, const char *shortcut, json_t *object);

static bool edit_list(Edit *edit, const Field *field, json_t *list) {
    size_t index;
    if (!json_is_array(list))
        return wrong_kind(edit, "a list");
    if (!take_index(edit, json_array_size(list), &index))
        return false;
    if (edit->at == edit->end) {
        json_array_set_new(list, index, parse_value(edit, field));
        return true;
    }
    if (*edit->at++ != '.')
        return err_set(edit->err, ERR_USAGE, "--set %.200s: expected a key after %s", edit->text, edit->path);
    return edit_object(edit, field->object, NULL, json_array_get(list, index));
}

static bool edit_member(Edit *edit, const ObjectType *type, const Field *field, json_t *object) {
    path_add(edit, field->key);
    if (edit->at == edit->end) {
        json_t *value = parse_value(edit, field);
        if (!value || json_object_set_new(object, field->key, value) != 0)
            return err_set(edit->err, ERR_USAGE, "--set %.200s: the value is not UTF-8 text", edit->text);
        return true;
    }
    if (!json_object_get(object, field->key) || json_is_null(json_object_get(object, field->key)))
        json_object_set_new(object, field->key,
                            field->type == FIELD_OBJECT ? json_object() : default_of(type, field));
    json_t *member = json_object_get(object, field->key);
    char separator = *edit->at;
    if (separator == '[' && field->type == FIELD_LIST)
        return edit_list(edit, field, member);
    if (separator == '[' && (field->type == FIELD_VEC3 || field->type == FIELD_FLAGS))
        return edit_element(edit, member);
    if (separator == '.' && field->type == FIELD_OBJECT) {
        edit->at++;
        return edit_object(edit, field->object, NULL, member);
    }
    if (field->type == FIELD_LIST || field->type == FIELD_VEC3 || field->type == FIELD_FLAGS)
        return err_set(edit->err, ERR_USAGE, "--set %.200s: expected an index like [0] after %s", edit->text,
                       edit->path);
    return err_set(edit->err, ERR_USAGE, "--set %.200s: %s has no parts", edit->text, edit->path);
}

static bool edit_object(Edit *edit, const ObjectType *type, const char *shortcut, json_t *object) {
    char key[128];
    Field field, below = {0};
    if (!json_is_object(object))
        return wrong_kind(edit, "an object");
    if (!take_key(edit, key, sizeof key))
        return false;
    if (field_find(type, key, &field))
        return edit_member(edit, type, &field, object);
    const ObjectType *other = shortcut && field_find(type, shortcut, &below) ? below.object : NULL;
    if (!other || !field_find(other, key, &field))
        return no_such_key(edit, type, other, key);
    path_add(edit, shortcut);
    if (!json_object_get(object, shortcut))
        json_object_set_new(object, shortcut, json_object());
    if (!json_is_object(json_object_get(object, shortcut)))
        return wrong_kind(edit, "an object");
    return edit_member(edit, other, &field, json_object_get(object, shortcut));
}

bool field_edit(const ObjectType *type, const char *shortcut, const char *text, json_t *document, char *path,
                size_t size, Err *err) {
    const char *equals = strchr(text, '=');
    path[0] = '\0';
    if (!equals)
        return err_set(err, ERR_USAGE, "--set %.200s: expected PATH=VALUE, e.g. Configuration.viscosity=0.05",
                       text);
    Edit edit = {
        .text = text, .at = text, .end = equals, .value = equals + 1, .path = path, .size = size, .err = err};
    return edit_object(&edit, type, shortcut, document);
}
