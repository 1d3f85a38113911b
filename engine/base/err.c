/* Formats error reports. Messages are built in a local buffer first, so that the old message may be an
 * argument of the new one. */
#include "err.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

/* Formats into a whole message buffer and marks a cut with "...". */
ERR_PRINTF(2, 0)
static void format_message(char out[ERR_MESSAGE_SIZE], const char *format, va_list args) {
    int length = vsnprintf(out, ERR_MESSAGE_SIZE, format, args);
    if (length < 0)
        snprintf(out, ERR_MESSAGE_SIZE, "%s", format);
    else if (length >= ERR_MESSAGE_SIZE)
        memcpy(out + ERR_MESSAGE_SIZE - 4, "...", 4);
}

/* Appends text to a message of *length bytes; what does not fit becomes a final "...". False when full. */
static bool append(char *message, size_t *length, const char *text, size_t text_length) {
    size_t room = ERR_MESSAGE_SIZE - 1 - *length;
    bool fits = text_length <= room;
    size_t n = fits ? text_length : room;
    memcpy(message + *length, text, n);
    *length += n;
    message[*length] = '\0';
    if (!fits)
        memcpy(message + ERR_MESSAGE_SIZE - 4, "...", 4);
    return fits;
}

bool err_set(Err *err, ErrCode code, const char *format, ...) {
    if (!err)
        return false;
    char text[ERR_MESSAGE_SIZE];
    va_list args;
    va_start(args, format);
    format_message(text, format, args);
    va_end(args);
    err->code = code;
    memcpy(err->message, text, strlen(text) + 1);
    return false;
}

bool err_add(Err *err, ErrCode code, const char *format, ...) {
    if (!err)
        return false;
    char text[ERR_MESSAGE_SIZE];
    va_list args;
    va_start(args, format);
    format_message(text, format, args);
    va_end(args);
    if (err->code == ERR_NONE)
        err->code = code;
    size_t length = strlen(err->message);
    if (length == 0 || append(err->message, &length, "\n", 1))
        append(err->message, &length, text, strlen(text));
    return false;
}

void err_prefix(Err *err, const char *format, ...) {
    if (!err)
        return;
    char prefix[ERR_MESSAGE_SIZE], old[ERR_MESSAGE_SIZE];
    va_list args;
    va_start(args, format);
    format_message(prefix, format, args);
    va_end(args);
    memcpy(old, err->message, sizeof old);

    size_t length = 0;
    const char *line = old;
    for (;;) {
        size_t line_length = strcspn(line, "\n");
        if (!append(err->message, &length, prefix, strlen(prefix)) ||
            !append(err->message, &length, ": ", 2) || !append(err->message, &length, line, line_length) ||
            line[line_length] == '\0')
            return;
        if (!append(err->message, &length, "\n", 1))
            return;
        line += line_length + 1;
    }
}
