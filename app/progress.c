#include "progress.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

static const double terminal_period = 0.2, file_period = 5.0; /* s between lines */

double progress_clock(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

Progress progress_begin(double begin, double end, bool is_quiet) {
    const char *terminal = getenv("TERM");
    bool is_dumb = terminal && strcmp(terminal, "dumb") == 0;
    double now = progress_clock();
    bool is_terminal = isatty(STDERR_FILENO) && !is_dumb;
    return (Progress){.is_quiet = is_quiet,
                      .is_terminal = is_terminal,
                      .begin = begin,
                      .end = end,
                      .next = now + (is_terminal ? 0 : file_period),
                      .last = now};
}

static void format_duration(double seconds, char *out, size_t size) {
    unsigned long whole = seconds > 0 && seconds < 3.6e7 ? (unsigned long)(seconds + 0.5) : 0;
    if (whole >= 3600)
        snprintf(out, size, "%lu:%02lu:%02lu", whole / 3600, whole / 60 % 60, whole % 60);
    else
        snprintf(out, size, "%lu:%02lu", whole / 60, whole % 60);
}

void progress_step(Progress *progress, const SkiffSim *sim) {
    double now = progress_clock();
    double ms = 1000 * (now - progress->last);
    progress->last = now;
    progress->smooth_ms += (progress->smooth_ms > 0 ? 0.05 : 1.0) * (ms - progress->smooth_ms);
    if (progress->is_quiet || now < progress->next)
        return;
    progress->next = now + (progress->is_terminal ? terminal_period : file_period);

    const SkiffStats *stats = skiff_stats(sim);
    double span = progress->end - progress->begin, left = progress->end - stats->time;
    double share = span > 0 ? (stats->time - progress->begin) / span : 1;
    char eta[32];
    format_duration(left / stats->dt * progress->smooth_ms / 1000, eta, sizeof eta);
    fprintf(stderr, "%s%3.0f%%  t %.3f/%.3f s  %.1f ms/step  %d+%d iterations  max %.2g m/s  ETA %s%s",
            progress->is_terminal ? "\r\033[K" : "", 100 * share, stats->time, progress->end,
            progress->smooth_ms, stats->density_iterations, stats->divergence_iterations, stats->max_speed,
            eta, progress->is_terminal ? "" : "\n");
    progress->is_shown = progress->is_terminal;
    fflush(stderr);
}

void progress_clear(Progress *progress) {
    if (progress->is_shown)
        fputs("\r\033[K", stderr);
    progress->is_shown = false;
}

void progress_log(LogLevel level, const char *message, void *user) {
    if (user)
        progress_clear(user);
    fprintf(stderr, "skiff: %s%s\n", level == LOG_WARNING ? "warning: " : "", message);
}
