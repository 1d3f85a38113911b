/* A growing CsvTable. */
#include "series.h"

#include "engine/base/file.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static bool no_memory(Err *err) {
    return err_set(err, ERR_IO, "out of memory");
}

bool series_make(Series *series, const char *header, Err *err) {
    CsvTable *table = &series->table;
    *series = (Series){0};
    table->column_count = 1;
    for (const char *c = header; *c; c++)
        table->column_count += *c == ',';
    table->text = malloc(strlen(header) + 1);
    table->names = calloc((size_t)table->column_count, sizeof *table->names);
    if (!table->text || !table->names) {
        series_free(series);
        return no_memory(err);
    }
    char *name = strcpy(table->text, header);
    for (int i = 0; i < table->column_count; i++) {
        table->names[i] = name;
        name += strcspn(name, ",");
        *name++ = '\0';
    }
    return true;
}

void series_free(Series *series) {
    csv_free(&series->table);
    *series = (Series){0};
}

double *series_add(Series *series, Err *err) {
    CsvTable *table = &series->table;
    const size_t columns = (size_t)table->column_count;
    if (table->row_count == series->capacity) {
        const size_t capacity = series->capacity > 0 ? 2 * series->capacity : 1024;
        double *values = realloc(table->values, capacity * columns * sizeof *values);
        if (!values) {
            no_memory(err);
            return NULL;
        }
        table->values = values;
        series->capacity = capacity;
    }
    double *row = table->values + table->row_count++ * columns;
    for (size_t c = 0; c < columns; c++)
        row[c] = (double)NAN;
    return row;
}

double series_at(const Series *series, size_t row, int column) {
    return series->table.values[row * (size_t)series->table.column_count + (size_t)column];
}

static bool write_header(FILE *stream, const CsvTable *table) {
    for (int c = 0; c < table->column_count; c++)
        fprintf(stream, "%s%s", c > 0 ? "," : "", table->names[c]);
    return fputc('\n', stream) != EOF;
}

bool series_write(const Series *series, const char *path, Err *err) {
    FileWriter writer;
    if (!file_begin(&writer, path, err))
        return false;
    write_header(writer.stream, &series->table);
    for (size_t row = 0; row < series->table.row_count; row++)
        for (int c = 0; c < series->table.column_count; c++) {
            const double value = series_at(series, row, c);
            fprintf(writer.stream, "%s", c > 0 ? "," : "");
            if (!isnan(value))
                fprintf(writer.stream, "%.7g", value);
            if (c + 1 == series->table.column_count)
                fputc('\n', writer.stream);
        }
    return file_commit(&writer, err);
}
