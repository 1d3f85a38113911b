/* Error reports. One struct travels through every call that can fail; its code is also the exit code of the
 * program. */
#ifndef SKIFF_BASE_ERR_H
#define SKIFF_BASE_ERR_H

#include <stdbool.h>
#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Values are the program's exit codes and never change meaning. */
typedef enum ErrCode {
    ERR_NONE = 0,
    ERR_USAGE = 2,    /* wrong command line or API call */
    ERR_INPUT = 3,    /* a file or a value in it is bad */
    ERR_GL = 4,       /* no usable OpenGL */
    ERR_DIVERGED = 5, /* the simulation left the range in which its numbers mean anything */
    ERR_IO = 6,       /* reading or writing failed */
    ERR_INTERRUPTED = 130
} ErrCode;

enum { ERR_MESSAGE_SIZE = 4096 };

/* Zero-initialise before use: `Err err = {0};`. A message holds one problem a line, no final newline. */
typedef struct Err {
    ErrCode code;
    char message[ERR_MESSAGE_SIZE];
} Err;

#if defined(__GNUC__)
#define ERR_PRINTF(fmt_index, args_index) __attribute__((format(printf, fmt_index, args_index)))
#else
#define ERR_PRINTF(fmt_index, args_index)
#endif

/* Sets code and message (replacing what was there). Returns false, so that a caller can `return
 * err_set(...)`. A message that does not fit ends in "...". err may be NULL. */
bool err_set(Err *err, ErrCode code, const char *format, ...) ERR_PRINTF(3, 4);

/* Adds one more line to the message; the first code stays. Returns false. */
bool err_add(Err *err, ErrCode code, const char *format, ...) ERR_PRINTF(3, 4);

/* Puts "prefix: " before every line of the message, e.g. a file name. */
void err_prefix(Err *err, const char *format, ...) ERR_PRINTF(2, 3);

#ifdef __cplusplus
}
#endif
#endif
