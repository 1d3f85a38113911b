/* Numbers only: cells need no quotes since names are checked where they come from. */
#include "csv.h"

#include "engine/base/file.h"

#include <errno.h>
#include <inttypes.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { MAX_COLUMNS = 65536 };
static const size_t max_size = (size_t)8 << 30;

/* ---- Writing ---- */

static bool open_stream(CsvWriter *writer, const char *path, const char *mode, Err *err) {
    *writer = (CsvWriter){0};
    snprintf(writer->path, sizeof writer->path, "%s", path);
    writer->stream = fopen(path, mode);
    if (!writer->stream)
        return err_set(err, ERR_IO, "%s: cannot be written: %s", path, strerror(errno));
    setvbuf(writer->stream, NULL, _IOFBF, 1 << 16);
    return true;
}

bool csv_create(CsvWriter *writer, const char *path, const char *header, Err *err) {
    if (!open_stream(writer, path, "wb", err))
        return false;
    if (fprintf(writer->stream, "%s\n", header) < 0)
        writer->error = errno;
    return csv_flush(writer, false, err);
}

bool csv_append(CsvWriter *writer, const char *path, Err *err) {
    return open_stream(writer, path, "ab", err);
}

static void begin_cell(CsvWriter *writer) {
    if (writer->row_begun)
        fputc(',', writer->stream);
    writer->row_begun = true;
}

void csv_put(CsvWriter *writer, double value, int digits) {
    begin_cell(writer);
    if (fprintf(writer->stream, "%.*g", digits, value) < 0 && writer->error == 0)
        writer->error = errno;
}

void csv_put_count(CsvWriter *writer, uint64_t value) {
    begin_cell(writer);
    if (fprintf(writer->stream, "%" PRIu64, value) < 0 && writer->error == 0)
        writer->error = errno;
}

void csv_end_row(CsvWriter *writer) {
    if (fputc('\n', writer->stream) == EOF && writer->error == 0)
        writer->error = errno;
    writer->row_begun = false;
}

static bool report(const CsvWriter *writer, Err *err) {
    return err_set(err, ERR_IO, "%s: writing failed: %s", writer->path, strerror(writer->error));
}

bool csv_flush(CsvWriter *writer, bool durable, Err *err) {
    if (!writer->stream)
        return true;
    bool failed = ferror(writer->stream) || fflush(writer->stream) != 0 ||
                  (durable && fsync(fileno(writer->stream)) != 0);
    if (failed && writer->error == 0)
        writer->error = errno != 0 ? errno : EIO;
    return writer->error == 0 || report(writer, err);
}

bool csv_close(CsvWriter *writer, Err *err) {
    if (!writer->stream)
        return true;
    csv_flush(writer, false, NULL);
    if (fclose(writer->stream) != 0 && writer->error == 0)
        writer->error = errno;
    writer->stream = NULL;
    return writer->error == 0 || report(writer, err);
}

/* ---- Reading ---- */

static size_t count_of(const char *text, char c) {
    size_t count = 0;
    for (; *text; text++)
        count += *text == c;
    return count;
}

static bool parse_names(const char *path, CsvTable *table, char **rest, Err *err) {
    char *line = table->text, *end = strchr(line, '\n');
    if (!end)
        return err_set(err, ERR_INPUT, "%s:1: the header is missing or cut off", path);
    *end = '\0';
    size_t count = count_of(line, ',') + 1;
    if (count > MAX_COLUMNS)
        return err_set(err, ERR_INPUT, "%s:1: %zu columns, at most %d are possible", path, count,
                       MAX_COLUMNS);
    table->names = calloc(count, sizeof *table->names);
    if (!table->names)
        return err_set(err, ERR_IO, "%s: out of memory", path);
    table->column_count = (int)count;
    for (size_t i = 0; i < count; i++) {
        table->names[i] = line;
        line += strcspn(line, ",");
        *line++ = '\0';
    }
    *rest = end + 1;
    return true;
}

static bool parse_row(const char *path, CsvTable *table, char **text, Err *err) {
    double *row = table->values + table->row_count * (size_t)table->column_count;
    for (int i = 0; i < table->column_count; i++) {
        char *end, wanted = i + 1 < table->column_count ? ',' : '\n';
        bool is_empty = **text == wanted;
        row[i] = is_empty ? (double)NAN : strtod(*text, &end);
        if (is_empty)
            end = *text;
        else if (end == *text)
            return err_set(err, ERR_INPUT, "%s:%zu: column %d is not a number", path, table->row_count + 2,
                           i + 1);
        if (*end != wanted)
            return err_set(err, ERR_INPUT, "%s:%zu: expected %d numbers", path, table->row_count + 2,
                           table->column_count);
        *text = end + 1;
    }
    table->row_count++;
    return true;
}

bool csv_read(const char *path, CsvTable *table, Err *err) {
    size_t size;
    char *rest = NULL;
    *table = (CsvTable){0};
    if (!file_read(path, max_size, &table->text, &size, err))
        return false;
    if (!parse_names(path, table, &rest, err)) {
        csv_free(table);
        return false;
    }
    size_t lines = count_of(rest, '\n');
    table->values = malloc((lines * (size_t)table->column_count + 1) * sizeof *table->values);
    bool read = table->values || err_set(err, ERR_IO, "%s: out of memory", path);
    while (read && table->row_count < lines)
        read = parse_row(path, table, &rest, err);
    if (!read)
        csv_free(table);
    return read;
}

void csv_free(CsvTable *table) {
    free(table->names);
    free(table->values);
    free(table->text);
    *table = (CsvTable){0};
}

int csv_column(const CsvTable *table, const char *name) {
    for (int i = 0; i < table->column_count; i++)
        if (strcmp(table->names[i], name) == 0)
            return i;
    return -1;
}

double *csv_copy_column(const CsvTable *table, const char *name) {
    int column = csv_column(table, name);
    double *copy = column < 0 ? NULL : malloc((table->row_count + 1) * sizeof *copy);
    for (size_t i = 0; copy && i < table->row_count; i++)
        copy[i] = table->values[i * (size_t)table->column_count + (size_t)column];
    return copy;
}

/* ---- Cutting ---- */

bool csv_cut(const char *path, const char *header, double limit, double *last, Err *err) {
    char *text;
    size_t size, header_size = strlen(header);
    *last = -INFINITY;
    if (!file_read(path, max_size, &text, &size, err))
        return false;
    if (size <= header_size || memcmp(text, header, header_size) != 0 || text[header_size] != '\n') {
        free(text);
        return err_set(err, ERR_INPUT, "%s: has other columns than this run", path);
    }
    size_t kept = header_size + 1;
    for (const char *end; (end = strchr(text + kept, '\n')) != NULL; kept = (size_t)(end - text) + 1) {
        double first = strtod(text + kept, NULL);
        if (!(first <= limit))
            break;
        *last = first;
    }
    bool written = kept == size || file_write(path, text, kept, err);
    free(text);
    return written;
}
