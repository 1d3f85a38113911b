/* JSON as people like to read it: short lists on one line, numbers in their shortest exact form. */
#ifndef SKIFF_APP_JSON_TEXT_H
#define SKIFF_APP_JSON_TEXT_H

#include "engine/base/err.h"

#include <jansson.h>
#include <stdio.h>

/* A float as the shortest decimal that reads back as the same float: 0.025, not 0.02500000037. null when not
 * finite. */
json_t *json_text_float(float value);
/* null when not finite. */
json_t *json_text_double(double value);
/* Names of files may be no UTF-8, which JSON must be: then each byte beyond ASCII becomes a question mark. */
json_t *json_text_string(const char *text);

/* indent < 0: all on one line, without a newline at the end. */
void json_text_print(FILE *stream, const json_t *value, int indent);
/* The same as text; malloc'ed, owned by the caller (free). NULL when memory is exhausted. */
char *json_text_format(const json_t *value, int indent);
/* Writes an indented file atomically. */
bool json_text_write(const char *path, const json_t *value, Err *err);

#endif
