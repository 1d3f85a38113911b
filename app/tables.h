/* The CSV files of a run: steps.csv (a row a step), ledger.csv (particles in and out by cause), hull.csv
 * (bodies and drives), probes.csv (at the scene's rate). Columns are listed once, in tables.c. */
#ifndef SKIFF_APP_TABLES_H
#define SKIFF_APP_TABLES_H

#include "csv.h"

#include "engine/skiff.h"

typedef struct Tables {
    CsvWriter steps, ledger;
    CsvWriter hull, probes; /* hull and probes only where the scene has bodies and probes */
    double probe_rate;      /* Hz; 0: every step */
    double *probe_values;
    int probe_count;
} Tables;

/* Begins the files in `folder`. */
bool tables_create(Tables *tables, const char *folder, const SkiffSim *sim, double probe_rate, Err *err);
/* Cuts existing files back to the step of `sim` and goes on from there. ERR_INPUT when they end before it. */
bool tables_resume(Tables *tables, const char *folder, const SkiffSim *sim, double probe_rate, Err *err);
/* Adds what the last step gave. Errors show at the next flush. */
void tables_add(Tables *tables, const SkiffSim *sim);
bool tables_flush(Tables *tables, bool durable, Err *err);
bool tables_close(Tables *tables, Err *err);

#endif
