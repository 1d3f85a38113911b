/* summary.json: what a run came to, from its steps.csv and ledger.csv. */
#ifndef SKIFF_APP_SUMMARY_H
#define SKIFF_APP_SUMMARY_H

#include "csv.h"
#include "machine.h"
#include "scene.h"

typedef struct RunEnd {
    const char *status; /* "finished", "interrupted" or "diverged" */
    const char *message;
} RunEnd;

/* New reference. NULL when memory is exhausted. */
json_t *summary_make(const Scene *scene, const SkiffSim *sim, const CsvTable *steps, const CsvTable *ledger,
                     const RunEnd *end);

void summary_sort(double *values, size_t count); /* ascending */
/* Nearest rank, of at least one value in ascending order. */
double summary_percentile(const double *sorted, size_t count, double percent);
/* A number with six digits, which is more than any measured time means; null when not finite. New reference.
 */
json_t *summary_figure(double value);

/* Samples of walls and bodies. */
uint32_t summary_sample_count(const SkiffSim *sim);

/* Simulated seconds for each second of computing: 1 is real time, more is faster. */
double summary_real_time_factor(double simulated, double computed_ms);

#endif
