/* "Did you mean": the known name closest to a mistyped one. */
#ifndef SKIFF_APP_NEAREST_H
#define SKIFF_APP_NEAREST_H

#include <stddef.h>

enum { NEAREST_NAME_SIZE = 64 };

typedef struct Nearest {
    const char *word;
    char best[NEAREST_NAME_SIZE];
    size_t distance; /* edits between word and best */
} Nearest;

/* word is borrowed. Offer every known name, then ask for the result. */
Nearest nearest_begin(const char *word);
void nearest_offer(Nearest *nearest, const char *name);
/* The same for each name of "a|b|c". */
void nearest_offer_list(Nearest *nearest, const char *names);
/* The best name, or NULL when none is close enough to be what was meant. */
const char *nearest_result(const Nearest *nearest);

#endif
