/* The language of input files. What the events do is helm.c's business. */
#include "script.h"

#include "nearest.h"
#include "problems.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define COUNT(table) ((int)(sizeof(table) / sizeof *(table)))

enum { MAX_WORDS = 4, LINE_SIZE = 256 };

static const ScriptKey default_keys[] = {
    {"w", SCRIPT_KEY_THROTTLE, 1, NULL},     {"z", SCRIPT_KEY_THROTTLE, 1, NULL},
    {"up", SCRIPT_KEY_THROTTLE, 1, NULL},    {"s", SCRIPT_KEY_THROTTLE, -1, NULL},
    {"down", SCRIPT_KEY_THROTTLE, -1, NULL}, {"a", SCRIPT_KEY_RUDDER, -1, NULL},
    {"q", SCRIPT_KEY_RUDDER, -1, NULL},      {"left", SCRIPT_KEY_RUDDER, -1, NULL},
    {"d", SCRIPT_KEY_RUDDER, 1, NULL},       {"right", SCRIPT_KEY_RUDDER, 1, NULL},
};

const ScriptKey *script_default_keys(int *count) {
    *count = COUNT(default_keys);
    return default_keys;
}

/* One line being read. */
typedef struct Reader {
    const ScriptWords *words;
    Problems problems;               /* its file is `place` */
    char place[600];                 /* "file:line" */
    double last_time;                /* s, of the last line that had one */
    int pressed_at[SCRIPT_MAX_KEYS]; /* line; 0: not pressed */
    const char *word[MAX_WORDS + 1]; /* of the line; NULL past the last */
    int word_count;                  /* MAX_WORDS + 1: there are more */
    ScriptEvent event;
} Reader;

/* ---- Words of a line ---- */

/* Cuts the line into words, in place. */
static void split(Reader *reader, char *line) {
    reader->word_count = 0;
    memset(reader->word, 0, sizeof reader->word);
    line[strcspn(line, "#")] = '\0';
    for (char *word = strtok(line, " \t\r"); word && reader->word_count <= MAX_WORDS;
         word = strtok(NULL, " \t\r"))
        reader->word[reader->word_count++] = word;
}

/* A decimal number; strtod alone would take "nan" and "0x1p3" too. */
static bool read_number(const char *word, double *value) {
    char *end;
    *value = strtod(word, &end);
    return end != word && *end == '\0' && strspn(word, "+-.0123456789eE") == strlen(word) && isfinite(*value);
}

static void expected(Reader *reader, const char *what, const char *found) {
    char quoted[80];
    problems_quote(quoted, sizeof quoted, found ? found : "");
    if (found)
        problems_add(&reader->problems, "%s: expected %s, found %s", reader->word[1], what, quoted);
    else
        problems_add(&reader->problems, "%s: expected %s, found nothing", reader->word[1], what);
}

static bool read_range(Reader *reader, double limit, const char *what) {
    const char *word = reader->word[2];
    if (word && read_number(word, &reader->event.value) && fabs(reader->event.value) <= limit)
        return true;
    expected(reader, what, word);
    return false;
}

/* ---- Commands ---- */

static bool read_throttle(Reader *reader) {
    return read_range(reader, 1, "a number from -1 (astern) to 1");
}

static bool read_rudder(Reader *reader) {
    return read_range(reader, 1, "a number from -1 (to port) to 1 (to starboard)");
}

static bool read_heading(Reader *reader) {
    if (reader->word[2] && strcmp(reader->word[2], "off") == 0) {
        reader->event.command = SCRIPT_HEADING_OFF;
        return true;
    }
    return read_range(reader, 360, "degrees from -360 to 360, or off");
}

static bool is_name(const char *word) {
    static const char allowed[] = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-";
    return *word && strspn(word, allowed) == strlen(word) && strlen(word) < SCRIPT_NAME_SIZE;
}

static bool in_names(const char *names, const char *word) {
    for (const size_t length = strlen(word); *names; names += strcspn(names, "|"), names += *names == '|')
        if (strcspn(names, "|") == length && memcmp(names, word, length) == 0)
            return true;
    return false;
}

static bool read_camera(Reader *reader) {
    const char *word = reader->word[2], *names = reader->words->cameras;
    if (!word || !is_name(word)) {
        expected(reader, "the name of a camera", word);
        return false;
    }
    snprintf(reader->event.camera, sizeof reader->event.camera, "%s", word);
    if (!names || in_names(names, word))
        return true;
    Nearest nearest = nearest_begin(word);
    nearest_offer_list(&nearest, names);
    const char *best = nearest_result(&nearest);
    problems_add(&reader->problems, "camera: there is no camera %s%s%s%s; there are %s", word,
                 best ? ", did you mean " : "", best ? best : "", best ? "?" : "", names);
    return false;
}

static void report_key(Reader *reader, const char *word) {
    char quoted[80], known[256] = "";
    Nearest nearest = nearest_begin(word);
    for (int k = 0; k < reader->words->key_count; k++) {
        const size_t used = strlen(known);
        nearest_offer(&nearest, reader->words->keys[k].key);
        snprintf(known + used, sizeof known - used, "%s%s", k > 0 ? " " : "", reader->words->keys[k].key);
    }
    const char *best = nearest_result(&nearest);
    problems_quote(quoted, sizeof quoted, word);
    problems_add(&reader->problems, "%s: the key %s is not bound%s%s%s; bound are %s", reader->word[1],
                 quoted, best ? ", did you mean " : "", best ? best : "", best ? "?" : "",
                 *known ? known : "none");
}

static bool read_key(Reader *reader) {
    const char *word = reader->word[2];
    int key = 0;
    if (!word) {
        expected(reader, "a key", NULL);
        return false;
    }
    while (key < reader->words->key_count && strcmp(reader->words->keys[key].key, word) != 0)
        key++;
    if (key == reader->words->key_count) {
        report_key(reader, word);
        return false;
    }
    const bool press = reader->event.command == SCRIPT_PRESS;
    if (press && reader->pressed_at[key] != 0)
        problems_add(&reader->problems, "press: %s is already pressed, since line %d", word,
                     reader->pressed_at[key]);
    if (!press && reader->pressed_at[key] == 0)
        problems_add(&reader->problems, "release: %s is not pressed", word);
    reader->pressed_at[key] = press ? reader->event.line : 0;
    reader->event.key = key;
    return true;
}

static const struct {
    const char *name;
    ScriptCommand command;
    bool (*read)(Reader *reader); /* reads word[2] into the event; false: a problem was added */
} commands[] = {
    {"press", SCRIPT_PRESS, read_key},
    {"release", SCRIPT_RELEASE, read_key},
    {"throttle", SCRIPT_THROTTLE, read_throttle},
    {"rudder", SCRIPT_RUDDER, read_rudder},
    {"heading", SCRIPT_HEADING, read_heading},
    {"camera", SCRIPT_CAMERA, read_camera},
};

static void report_command(Reader *reader, const char *word) {
    char quoted[80], known[256] = "";
    Nearest nearest = nearest_begin(word);
    for (int c = 0; c < COUNT(commands); c++) {
        const size_t used = strlen(known);
        nearest_offer(&nearest, commands[c].name);
        snprintf(known + used, sizeof known - used, "%s%s", c > 0 ? ", " : "", commands[c].name);
    }
    const char *best = nearest_result(&nearest);
    problems_quote(quoted, sizeof quoted, word);
    if (best)
        problems_add(&reader->problems, "unknown command %s, did you mean %s?", quoted, best);
    else
        problems_add(&reader->problems, "unknown command %s, expected one of %s", quoted, known);
}

/* ---- Lines ---- */

static void read_time(Reader *reader) {
    const double limit = 1e6;
    double *time = &reader->event.time;
    if (!read_number(reader->word[0], time) || fabs(*time) > limit) {
        char quoted[80];
        problems_quote(quoted, sizeof quoted, reader->word[0]);
        problems_add(&reader->problems, "expected a time from %.0f to %.0f s, found %s", -limit, limit,
                     quoted);
        return;
    }
    if (*time < reader->last_time)
        problems_add(&reader->problems, "%g s is before the line above, which is at %g s", *time,
                     reader->last_time);
    else
        reader->last_time = *time;
}

static void read_event(Reader *reader) {
    read_time(reader);
    if (reader->word_count < 2) {
        problems_add(&reader->problems, "a command is missing after the time");
        return;
    }
    int c = 0;
    while (c < COUNT(commands) && strcmp(commands[c].name, reader->word[1]) != 0)
        c++;
    if (c == COUNT(commands)) {
        report_command(reader, reader->word[1]);
        return;
    }
    reader->event.command = commands[c].command;
    if (commands[c].read(reader) && reader->word_count > 3) {
        char quoted[80];
        problems_quote(quoted, sizeof quoted, reader->word[3]);
        problems_add(&reader->problems, "%s %s: nothing can follow, found %s", reader->word[1],
                     reader->word[2], quoted);
    }
}

/* False for a line without an event. */
static bool read_line(Reader *reader, const char *text, size_t length, int number) {
    char line[LINE_SIZE];
    reader->event = (ScriptEvent){.line = number};
    if (memchr(text, '\0', length)) {
        problems_add(&reader->problems, "holds a zero byte: this is no text");
        return false;
    }
    const char *comment = memchr(text, '#', length);
    length = comment ? (size_t)(comment - text) : length;
    if (length >= sizeof line) {
        problems_add(&reader->problems, "%zu characters long, at most %d are possible", length,
                     LINE_SIZE - 1);
        return false;
    }
    memcpy(line, text, length);
    line[length] = '\0';
    split(reader, line);
    if (reader->word_count == 0)
        return false;
    read_event(reader);
    return true;
}

/* Room for one more event; grows by doubling. */
static ScriptEvent *next_event(Script *script, size_t *capacity) {
    if (script->count == *capacity) {
        const size_t grown = *capacity > 0 ? 2 * *capacity : 64;
        ScriptEvent *events = realloc(script->events, grown * sizeof *events);
        if (!events)
            return NULL;
        script->events = events;
        *capacity = grown;
    }
    return &script->events[script->count++];
}

bool script_parse(const char *file, const char *text, size_t size, const ScriptWords *words, Script *script,
                  Err *err) {
    Reader reader = {.words = words, .last_time = -INFINITY};
    const char *end = text + size;
    size_t capacity = 0;
    bool memory = true;
    *script = (Script){0};
    reader.problems = problems_begin(reader.place, err);
    for (int line = 1; memory && text < end; line++) {
        const char *newline = memchr(text, '\n', (size_t)(end - text));
        const char *stop = newline ? newline : end;
        snprintf(reader.place, sizeof reader.place, "%.480s:%d", file, line);
        if (read_line(&reader, text, (size_t)(stop - text), line)) {
            ScriptEvent *event = next_event(script, &capacity);
            memory = event != NULL;
            if (memory)
                *event = reader.event;
        }
        text = newline ? newline + 1 : end;
    }
    const bool good = problems_end(&reader.problems);
    if (!good || !memory)
        script_free(script);
    return memory ? good : err_add(err, ERR_IO, "%s: out of memory", file);
}

void script_free(Script *script) {
    free(script->events);
    *script = (Script){0};
}
