/* A folder of the test program's own, in which it runs: setup and teardown of a group of tests. Needs
 * cmocka.h before it. */
#ifndef SKIFF_TESTS_SCRATCH_H
#define SKIFF_TESTS_SCRATCH_H

#include "engine/base/file.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static char scratch_folder[] = "/tmp/skiff-test-XXXXXX";

static inline int scratch_enter(void **state) {
    (void)state;
    return mkdtemp(scratch_folder) && chdir(scratch_folder) == 0 ? 0 : -1;
}

static inline int scratch_leave(void **state) {
    (void)state;
    char command[64];
    snprintf(command, sizeof command, "rm -rf '%s'", scratch_folder);
    return chdir("/") == 0 ? system(command) : -1;
}

/* To be freed. */
static inline char *scratch_read(const char *path) {
    char *text = NULL;
    size_t size;
    Err err = {0};
    if (!file_read(path, 1 << 26, &text, &size, &err))
        fail_msg("%s", err.message);
    return text;
}

static inline void scratch_write(const char *path, const char *text) {
    Err err = {0};
    if (!file_write(path, text, strlen(text), &err))
        fail_msg("%s", err.message);
}

#endif
