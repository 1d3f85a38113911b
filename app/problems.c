/* One growing message in an Err. Room is kept for the last line, which counts what did not fit. */
#include "problems.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

enum { RESERVE = 64 }; /* bytes kept for "and N more problems" */

Problems problems_begin(const char *file, Err *err) {
    return (Problems){.err = err, .file = file};
}

static size_t append(Problems *problems, const char *text) {
    size_t mark = problems->length;
    size_t room = sizeof problems->path - mark;
    int written = snprintf(problems->path + mark, room, "%s", text);
    problems->length = mark + ((size_t)written < room ? (size_t)written : room - 1);
    return mark;
}

size_t problems_enter(Problems *problems, const char *key) {
    char text[PROBLEMS_PATH_SIZE];
    char quoted[80];
    problems_quote(quoted, sizeof quoted, key);
    snprintf(text, sizeof text, "%s%s", problems->length > 0 ? "." : "", quoted);
    return append(problems, text);
}

size_t problems_enter_index(Problems *problems, size_t index) {
    char text[32];
    snprintf(text, sizeof text, "[%zu]", index);
    return append(problems, text);
}

void problems_leave(Problems *problems, size_t mark) {
    problems->length = mark;
    problems->path[mark] = '\0';
}

static bool is_edited(const Problems *problems) {
    for (int i = 0; i < problems->edited_count; i++) {
        size_t count = strlen(problems->edited[i]);
        char next = strncmp(problems->path, problems->edited[i], count) == 0 ? problems->path[count] : 'x';
        if (next == '\0' || next == '.' || next == '[')
            return true;
    }
    return false;
}

void problems_add(Problems *problems, const char *format, ...) {
    char what[1024];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(what, sizeof what, format, arguments);
    va_end(arguments);

    problems->count++;
    char line[PROBLEMS_PATH_SIZE + 1024 + 512];
    if (is_edited(problems))
        snprintf(line, sizeof line, "--set %s: %s", problems->path, what);
    else
        snprintf(line, sizeof line, "%.480s: %s%s%s", problems->file, problems->path,
                 problems->length > 0 ? ": " : "", what);
    size_t used = problems->err ? strlen(problems->err->message) : 0;
    if (problems->omitted > 0 || used + strlen(line) + 1 + RESERVE >= ERR_MESSAGE_SIZE)
        problems->omitted++;
    else
        err_add(problems->err, ERR_INPUT, "%s", line);
}

bool problems_end(Problems *problems) {
    if (problems->omitted > 0)
        err_add(problems->err, ERR_INPUT, "... and %d more problems", problems->omitted);
    return problems->count == 0;
}

/* Length of the UTF-8 sequence at text if it is whole, printable and not a control character; 0 otherwise. */
static size_t printable(const char *text) {
    const unsigned char *byte = (const unsigned char *)text;
    if (byte[0] < 0x80)
        return byte[0] >= 0x20 && byte[0] != 0x7f;
    size_t count = byte[0] >= 0xf0 ? 4 : byte[0] >= 0xe0 ? 3 : byte[0] >= 0xc2 ? 2 : 0;
    for (size_t i = 1; i < count; i++)
        if ((byte[i] & 0xc0) != 0x80)
            return 0;
    return byte[0] == 0xc2 && byte[1] < 0xa0 ? 0 : count; /* C1 controls */
}

void problems_quote(char *out, size_t size, const char *text) {
    size_t used = 0;
    while (*text) {
        size_t count = printable(text);
        size_t step = count > 0 ? count : 1;
        if (used + step + 4 > size) {
            memcpy(out + used, "...", 3);
            used += 3;
            break;
        }
        memcpy(out + used, count > 0 ? text : "?", step);
        used += step;
        text += step;
    }
    out[used] = '\0';
}
