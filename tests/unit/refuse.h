/* A simulation that must not come to be. Needs cmocka.h before it. */
#ifndef SKIFF_TESTS_REFUSE_H
#define SKIFF_TESTS_REFUSE_H

#include "engine/skiff.h"

#include <string.h>

static inline Err refusal_of(const SkiffDef *def, const char *expected) {
    Err err = {0};
    if (skiff_create(def, &err) != NULL)
        fail_msg("not refused: %s", expected);
    assert_int_equal(err.code, ERR_INPUT);
    return err;
}

/* The message has `expected` in it. */
static inline void refuse(const SkiffDef *def, const char *expected) {
    const Err err = refusal_of(def, expected);
    if (strstr(err.message, expected) == NULL)
        fail_msg("expected: %s\nfound:    %s", expected, err.message);
}

/* The message is `expected` and nothing more. */
static inline void refuse_saying(const SkiffDef *def, const char *expected) {
    const Err err = refusal_of(def, expected);
    if (strcmp(err.message, expected) != 0)
        fail_msg("expected: %s\nfound:    %s", expected, err.message);
}

#endif
