/* Tables of repeated measurements beside the figures of a paper: medians and spreads, as text, JSON lines,
 * CSV and HTML. */
#ifndef SKIFF_APP_SHEET_H
#define SKIFF_APP_SHEET_H

#include "engine/base/err.h"

#include <stdint.h>
#include <stdio.h>

enum { SHEET_MAX_COLUMNS = 24, SHEET_NAME_SIZE = 48 };

typedef struct SheetColumn {
    const char *key;   /* of JSON and CSV: a name without commas */
    const char *label; /* with its unit */
    int decimals;
    uint32_t sum_of; /* bits of columns whose medians are added up; 0: a column of its own values */
} SheetColumn;

typedef struct SheetRow {
    char name[SHEET_NAME_SIZE];
    double paper[SHEET_MAX_COLUMNS]; /* NaN: the paper gives none */
    double *values;                  /* run by run, [runs][columns]; NaN: that run gave none */
    int run_count;
} SheetRow;

typedef struct Sheet {
    const char *name; /* of files and JSON lines */
    const char *title;
    const char *source;  /* where the paper's figures stand, e.g. "[Carensac2023] table 1" */
    const char *row_key; /* what a row is, as JSON and CSV call it */
    const SheetColumn *columns;
    int column_count;
    SheetRow *rows;
    int row_count;
} Sheet;

/* Over the runs, each column sorted on its own. */
typedef struct SheetFigure {
    double median, low, high; /* low, high: quartiles by nearest rank; all NaN when there is no value */
} SheetFigure;

/* Borrows the strings and the columns. */
Sheet sheet_make(const char *name, const char *title, const char *source, const char *row_key,
                 const SheetColumn *columns, int column_count);
void sheet_free(Sheet *sheet);
/* Adds a row without runs, its paper's figures not known. Its index, or -1 with ERR_IO: no memory. */
int sheet_add_row(Sheet *sheet, const char *name, Err *err);
/* Adds a run: column_count values; those of columns with sum_of are not used. */
bool sheet_add_run(Sheet *sheet, int row, const double *values, Err *err);
SheetFigure sheet_figure(const Sheet *sheet, int row, int column);

/* Median and, below it, the paper's figure. */
void sheet_print(FILE *out, const Sheet *sheet);
/* A line a row: medians under the keys, "<key>_low" and "<key>_high" (quartiles), "<key>_paper" where there
 * is one. */
void sheet_print_json(FILE *out, const Sheet *sheet);
/* A line a row and column: row, column, runs, median, low, high, paper. */
bool sheet_write_csv(const Sheet *sheet, const char *path, Err *err);
void sheet_write_html(FILE *out, const Sheet *sheet);

#endif
