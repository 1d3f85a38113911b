/* The log sink: the only global of the engine. Default: warnings and above to stderr. */
#ifndef SKIFF_BASE_LOG_H
#define SKIFF_BASE_LOG_H

#include "err.h"

typedef enum LogLevel { LOG_DEBUG, LOG_INFO, LOG_WARNING, LOG_ERROR } LogLevel;

typedef void LogSink(LogLevel level, const char *message, void *user);

/* sink NULL restores the default. Call before any simulation exists. */
void log_set_sink(LogSink *sink, void *user, LogLevel minimum);
void log_write(LogLevel level, const char *format, ...) ERR_PRINTF(2, 3);

#endif
