/* Routes messages of the engine to one sink. Not locked: the sink is set before any simulation exists, and
 * messages are written outside parallel regions. */
#include "log.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

static void write_to_stderr(LogLevel level, const char *message, void *user) {
    static const char *const names[] = {"debug", "info", "warning", "error"};
    (void)user;
    fprintf(stderr, "%s: %s\n", names[level], message);
}

static struct {
    LogSink *sink;
    void *user;
    LogLevel minimum;
} log_state = {write_to_stderr, NULL, LOG_WARNING};

void log_set_sink(LogSink *sink, void *user, LogLevel minimum) {
    if (sink) {
        log_state.sink = sink;
        log_state.user = user;
        log_state.minimum = minimum;
    } else {
        log_state.sink = write_to_stderr;
        log_state.user = NULL;
        log_state.minimum = LOG_WARNING;
    }
}

void log_write(LogLevel level, const char *format, ...) {
    if (level < log_state.minimum)
        return;
    char message[ERR_MESSAGE_SIZE];
    va_list args;
    va_start(args, format);
    int length = vsnprintf(message, sizeof message, format, args);
    va_end(args);
    if (length < 0)
        return;
    if (length >= (int)sizeof message)
        memcpy(message + sizeof message - 4, "...", 4);
    log_state.sink(level, message, log_state.user);
}
