/* trace.json: a run's steps as Chrome trace events, for Perfetto (ui.perfetto.dev) or chrome://tracing. */
#ifndef SKIFF_APP_TRACE_H
#define SKIFF_APP_TRACE_H

#include "csv.h"

/* Writes the file atomically from the table of steps.csv. */
bool trace_write(const char *path, const CsvTable *steps, Err *err);

#endif
