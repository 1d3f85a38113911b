/* Input files: what is done at the helm, when. Text, one event a line, `#` begins a comment:
 *
 *   5     throttle 1       # -1 (astern) to 1
 *   7.5   rudder -0.5      # -1 (to port) to 1 (to starboard)
 *   10    heading -30      # steer for a heading, degrees to starboard of the one at the start
 *   14    heading off
 *   15    press d          # and later: release d; keys are bound by the scene
 *   16    camera chase
 *
 * Times are s of simulated time and never decrease. An event acts from the first step that begins at or after
 * its time, whatever is drawn when. */
#ifndef SKIFF_APP_SCRIPT_H
#define SKIFF_APP_SCRIPT_H

#include "engine/base/err.h"

#include <stddef.h>

enum { SCRIPT_NAME_SIZE = 64, SCRIPT_MAX_KEYS = 256 };

/* What a key does while it is held (throttle, rudder) or when it is pressed (camera). */
typedef enum ScriptAction { SCRIPT_KEY_THROTTLE, SCRIPT_KEY_RUDDER, SCRIPT_KEY_CAMERA } ScriptAction;
#define SCRIPT_ACTIONS "throttle|rudder|camera"

typedef struct ScriptKey {
    const char *key; /* at most 63 characters, no blanks */
    int action;      /* ScriptAction */
    float value;     /* -1 to 1 */
    const char *camera;
} ScriptKey;

/* w s a d, their places on a French keyboard (z, q), and the arrows. */
const ScriptKey *script_default_keys(int *count);

typedef enum ScriptCommand {
    SCRIPT_PRESS,
    SCRIPT_RELEASE,
    SCRIPT_THROTTLE,
    SCRIPT_RUDDER,
    SCRIPT_HEADING,
    SCRIPT_HEADING_OFF,
    SCRIPT_CAMERA
} ScriptCommand;

typedef struct ScriptEvent {
    double time; /* s */
    ScriptCommand command;
    int key;                       /* press, release: index of the key */
    double value;                  /* throttle, rudder; heading: degrees */
    char camera[SCRIPT_NAME_SIZE]; /* camera */
    int line;
} ScriptEvent;

/* What an input file may name. Borrowed. */
typedef struct ScriptWords {
    const ScriptKey *keys;
    int key_count;
    const char *cameras; /* "a|b|c"; NULL: any name of letters, digits, _ and - */
} ScriptWords;

typedef struct Script {
    ScriptEvent *events;
    size_t count;
} Script;

/* All problems of a file are in the message, each with file:line (ERR_INPUT). *script is empty then. */
bool script_parse(const char *file, const char *text, size_t size, const ScriptWords *words, Script *script,
                  Err *err);
void script_free(Script *script);

#endif
