/* Collects every problem of one file, each with the place it stands at: "tank.json: RigidBodies[0].density:
 * ...". */
#ifndef SKIFF_APP_PROBLEMS_H
#define SKIFF_APP_PROBLEMS_H

#include "engine/base/err.h"

enum { PROBLEMS_PATH_SIZE = 256 };

typedef struct Problems {
    Err *err;                      /* receives the lines, with ERR_INPUT */
    const char *file;              /* as the user named it */
    char path[PROBLEMS_PATH_SIZE]; /* of the value being looked at; "" is the file itself */
    size_t length;                 /* of path */
    const char *const *edited; /* paths given on the command line; theirs are reported as "--set PATH: ..." */
    int edited_count;
    int count;   /* problems found */
    int omitted; /* of which the message had no room for */
} Problems;

Problems problems_begin(const char *file, Err *err);

/* Go down to a key or an index; the result goes back to problems_leave. */
size_t problems_enter(Problems *problems, const char *key);
size_t problems_enter_index(Problems *problems, size_t index);
void problems_leave(Problems *problems, size_t mark);

void problems_add(Problems *problems, const char *format, ...) ERR_PRINTF(2, 3);

/* True if there were none. Otherwise the message is complete; what did not fit is counted in its last line.
 */
bool problems_end(Problems *problems);

/* Copies text with everything but printable ASCII and whole UTF-8 sequences replaced, so that a hostile file
 * cannot drive a terminal; long text ends in "...". */
void problems_quote(char *out, size_t size, const char *text);

#endif
