/* One line about a running simulation on stderr: rewritten in place on a terminal, a new one every few
 * seconds elsewhere. */
#ifndef SKIFF_APP_PROGRESS_H
#define SKIFF_APP_PROGRESS_H

#include "engine/base/log.h"
#include "engine/skiff.h"

typedef struct Progress {
    bool is_quiet, is_terminal;
    double begin, end; /* s, simulated */
    double next;       /* s, wall clock: when the next line is due */
    double smooth_ms;  /* wall time of a step, smoothed */
    double last;       /* s, wall clock at the last step */
    bool is_shown;     /* a line stands on the terminal */
} Progress;

double progress_clock(void); /* s, monotonic */

Progress progress_begin(double begin, double end, bool is_quiet);
/* After each step. */
void progress_step(Progress *progress, const SkiffSim *sim);
/* Clears the line, so that something else can be printed. */
void progress_clear(Progress *progress);
/* A LogSink: a line on stderr, after the progress that stands there. user: the Progress, or NULL. */
void progress_log(LogLevel level, const char *message, void *user);

#endif
