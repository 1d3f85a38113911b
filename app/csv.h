/* Tables of numbers as CSV: streamed while a run goes on, cut back to a checkpoint, read whole for the
 * report. */
#ifndef SKIFF_APP_CSV_H
#define SKIFF_APP_CSV_H

#include "engine/base/err.h"

#include <stdint.h>
#include <stdio.h>

typedef struct CsvWriter {
    FILE *stream; /* NULL: not open */
    char path[4096];
    bool row_begun;
    int error; /* errno of the first write that failed */
} CsvWriter;

/* Replaces the file by a header line (comma-separated names). */
bool csv_create(CsvWriter *writer, const char *path, const char *header, Err *err);
/* Goes on after the last row of an existing file. */
bool csv_append(CsvWriter *writer, const char *path, Err *err);
void csv_put(CsvWriter *writer, double value, int digits);
void csv_put_count(CsvWriter *writer, uint64_t value);
void csv_end_row(CsvWriter *writer);
/* Gives everything to the operating system, and to the disk if `durable`. ERR_IO with the path when any write
 * so far failed. */
bool csv_flush(CsvWriter *writer, bool durable, Err *err);
bool csv_close(CsvWriter *writer, Err *err);

/* A whole table of numbers. */
typedef struct CsvTable {
    char **names;
    int column_count;
    size_t row_count;
    double *values; /* row by row; not a number where a cell is empty */
    char *text;     /* the names point into it */
} CsvTable;

/* ERR_INPUT with file:line for a row that is not made of numbers or has another count of columns. */
bool csv_read(const char *path, CsvTable *table, Err *err);
void csv_free(CsvTable *table);
/* -1 when there is none. */
int csv_column(const CsvTable *table, const char *name);
/* Copies a column out; malloc'ed, owned by the caller (free). NULL when there is none or memory is exhausted.
 */
double *csv_copy_column(const CsvTable *table, const char *name);

/* Cuts a file back to the rows whose first number is at most `limit`, atomically; a half-written last line
 * goes too. ERR_INPUT if the header is another one. last: the first number of the last row kept, or
 * -infinity. */
bool csv_cut(const char *path, const char *header, double limit, double *last, Err *err);

#endif
