/* Where the time of a run's steps went, and what the steps that stand out have in common: computed from
 * steps.csv. */
#ifndef SKIFF_APP_PROFILE_H
#define SKIFF_APP_PROFILE_H

#include "csv.h"

#include <jansson.h>

enum { PROFILE_WORST = 10, PROFILE_AFTER = 5, PROFILE_MAX_PHASES = 64 };

/* What a table of steps must have to be profiled: constant, name of the column. Phases come on top. */
#define PROFILE_COLUMNS(COLUMN)                                                                              \
    COLUMN(STEP, "step")                                                                                     \
    COLUMN(TIME, "t")                                                                                        \
    COLUMN(DT, "dt")                                                                                         \
    COLUMN(PARTICLES, "particles")                                                                           \
    COLUMN(DENSITY_ITERATIONS, "density_iterations")                                                         \
    COLUMN(DIVERGENCE_ITERATIONS, "divergence_iterations")                                                   \
    COLUMN(MOVED, "moved")                                                                                   \
    COLUMN(STEP_MS, "step_ms")

typedef enum ProfileColumn {
#define COLUMN(id, name) PROFILE_##id,
    PROFILE_COLUMNS(COLUMN)
#undef COLUMN
        PROFILE_COLUMN_COUNT
} ProfileColumn;

extern const char *const profile_columns[PROFILE_COLUMN_COUNT];

/* Milliseconds are NaN where there is no such step. */
typedef struct ProfilePhase {
    char key[64]; /* its column without "_ms" */
    double mean_ms, plain_ms, move_ms;
    double p50_ms;
} ProfilePhase;

typedef struct ProfileStep {
    double step, t, ms; /* t: s, at its end */
    bool moved;
    char why[256];
} ProfileStep;

typedef struct Profile {
    size_t steps, moves;
    double mean_ms, p50_ms, p95_ms, p99_ms, max_ms;
    double plain_ms;         /* mean of the steps that neither move the window nor follow a move closely */
    double move_ms;          /* mean of the steps that move it */
    double after5_ms;        /* mean of the PROFILE_AFTER steps that follow each move */
    double real_time_factor; /* simulated over computed time */
    ProfilePhase phases[PROFILE_MAX_PHASES];
    int phase_count;
    ProfileStep worst[PROFILE_WORST]; /* slowest first */
    int worst_count;
} Profile;

/* `name` is used in messages. ERR_INPUT when the table has no rows or lacks a column. */
bool profile_make(const CsvTable *steps, const char *name, Profile *profile, Err *err);
/* New reference. */
json_t *profile_json(const Profile *profile);

/* Key of the phase whose time stands in a column ("sort" for "sort_ms"), copied; false for other columns. */
bool profile_phase_key(const char *column, char *key, size_t size);

#endif
