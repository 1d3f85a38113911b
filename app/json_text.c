/* jansson prints vectors one number a line and doubles with 17 digits; neither is pleasant in a file that
 * people read and edit. */
#include "json_text.h"

#include "engine/base/file.h"

#include <inttypes.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

json_t *json_text_float(float value) {
    if (!isfinite(value))
        return json_null();
    char text[32];
    for (int digits = 6; digits <= 9; digits++) {
        snprintf(text, sizeof text, "%.*g", digits, (double)value);
        if (strtof(text, NULL) == value)
            break;
    }
    return json_real(strtod(text, NULL));
}

json_t *json_text_double(double value) {
    return isfinite(value) ? json_real(value) : json_null();
}

json_t *json_text_string(const char *text) {
    json_t *value = json_string(text);
    char *plain = value ? NULL : strdup(text);
    for (char *c = plain; c && *c; c++)
        *c = (unsigned char)*c < 128 ? *c : '?';
    if (plain)
        value = json_string(plain);
    free(plain);
    return value;
}

static void print_real(FILE *stream, double value) {
    char text[40];
    bool is_whole = fabs(value) < 1e15 && value == floor(value);
    snprintf(text, sizeof text, "%.0f", value);
    for (int digits = 6; !is_whole && digits <= 17; digits++) {
        snprintf(text, sizeof text, "%.*g", digits, value);
        if (strtod(text, NULL) == value)
            break;
    }
    fputs(text, stream);
}

static void print_string(FILE *stream, const char *text) {
    fputc('"', stream);
    for (const unsigned char *byte = (const unsigned char *)text; *byte; byte++) {
        if (*byte == '"' || *byte == '\\')
            fprintf(stream, "\\%c", *byte);
        else if (*byte < 0x20)
            fprintf(stream, "\\u%04x", *byte);
        else
            fputc(*byte, stream);
    }
    fputc('"', stream);
}

static bool is_scalar(const json_t *value) {
    return !json_is_object(value) && !json_is_array(value);
}

static bool fits_one_line(const json_t *array) {
    size_t index, width = 0;
    const json_t *item;
    json_array_foreach((json_t *)(uintptr_t)array, index, item) {
        if (!is_scalar(item))
            return false;
        width += json_is_string(item) ? json_string_length(item) + 4 : 8;
    }
    return width <= 100;
}

static void break_line(FILE *stream, int indent) {
    if (indent < 0)
        return;
    fputc('\n', stream);
    for (int i = 0; i < indent; i++)
        fputs("  ", stream);
}

static void print_array(FILE *stream, const json_t *array, int indent) {
    bool one_line = indent < 0 || fits_one_line(array);
    int inner = one_line ? -1 : indent + 1;
    fputc('[', stream);
    for (size_t i = 0; i < json_array_size(array); i++) {
        if (i > 0)
            fputs(one_line ? ", " : ",", stream);
        break_line(stream, inner);
        json_text_print(stream, json_array_get(array, i), inner);
    }
    if (!one_line && json_array_size(array) > 0)
        break_line(stream, indent);
    fputc(']', stream);
}

/* Objects of a few plain numbers are rows of a table. */
static bool is_row(const json_t *object) {
    const char *key;
    json_t *item;
    json_object_foreach((json_t *)(uintptr_t)object, key, item) if (!json_is_number(item)) return false;
    return json_object_size(object) <= 6;
}

static void print_object(FILE *stream, const json_t *object, int indent) {
    indent = indent > 0 && is_row(object) ? -1 : indent;
    int inner = indent < 0 ? -1 : indent + 1;
    const char *key, *comma = "";
    json_t *item;
    fputc('{', stream);
    json_object_foreach((json_t *)(uintptr_t)object, key, item) {
        fputs(comma, stream);
        comma = indent < 0 ? ", " : ",";
        break_line(stream, inner);
        print_string(stream, key);
        fputs(": ", stream);
        json_text_print(stream, item, inner);
    }
    if (json_object_size(object) > 0)
        break_line(stream, indent);
    fputc('}', stream);
}

void json_text_print(FILE *stream, const json_t *value, int indent) {
    switch (json_typeof(value)) {
    case JSON_OBJECT:
        print_object(stream, value, indent);
        break;
    case JSON_ARRAY:
        print_array(stream, value, indent);
        break;
    case JSON_STRING:
        print_string(stream, json_string_value(value));
        break;
    case JSON_INTEGER:
        fprintf(stream, "%" PRId64, (int64_t)json_integer_value(value));
        break;
    case JSON_REAL:
        print_real(stream, json_real_value(value));
        break;
    case JSON_TRUE:
        fputs("true", stream);
        break;
    case JSON_FALSE:
        fputs("false", stream);
        break;
    case JSON_NULL:
        fputs("null", stream);
        break;
    }
}

char *json_text_format(const json_t *value, int indent) {
    char *text = NULL;
    size_t size = 0;
    FILE *stream = open_memstream(&text, &size);
    if (!stream)
        return NULL;
    json_text_print(stream, value, indent);
    if (indent >= 0)
        fputc('\n', stream);
    if (fclose(stream) != 0) {
        free(text);
        return NULL;
    }
    return text;
}

bool json_text_write(const char *path, const json_t *value, Err *err) {
    char *text = json_text_format(value, 0);
    if (!text)
        return err_set(err, ERR_IO, "%s: out of memory while writing", path);
    bool written = file_write(path, text, strlen(text), err);
    free(text);
    return written;
}
