/* A table of numbers in memory that grows row by row: what an experiment records, to be drawn, profiled and
 * written as CSV. */
#ifndef SKIFF_APP_SERIES_H
#define SKIFF_APP_SERIES_H

#include "csv.h"

typedef struct Series {
    CsvTable table; /* grows; empty: no columns */
    size_t capacity;
} Series;

/* header: names of the columns, comma-separated. ERR_IO: no memory. */
bool series_make(Series *series, const char *header, Err *err);
void series_free(Series *series);
/* Cells of a new last row, all NaN, until the next call. NULL with ERR_IO: no memory. */
double *series_add(Series *series, Err *err);
double series_at(const Series *series, size_t row, int column);
bool series_write(const Series *series, const char *path, Err *err);

#endif
