/* Columns are sorted independently of each other, as the authors of [Carensac2023] do: the median of a total
 * is then not the total of the medians, so totals are columns of their own. */
#include "sheet.h"

#include "json_text.h"
#include "summary.h"
#include "svg.h"

#include "engine/base/file.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- Filling ---- */

Sheet sheet_make(const char *name, const char *title, const char *source, const char *row_key,
                 const SheetColumn *columns, int column_count) {
    return (Sheet){.name = name,
                   .title = title,
                   .source = source,
                   .row_key = row_key,
                   .columns = columns,
                   .column_count = column_count};
}

void sheet_free(Sheet *sheet) {
    for (int r = 0; r < sheet->row_count; r++)
        free(sheet->rows[r].values);
    free(sheet->rows);
    sheet->rows = NULL;
    sheet->row_count = 0;
}

int sheet_add_row(Sheet *sheet, const char *name, Err *err) {
    SheetRow *rows = realloc(sheet->rows, ((size_t)sheet->row_count + 1) * sizeof *rows);
    if (!rows) {
        err_set(err, ERR_IO, "out of memory");
        return -1;
    }
    sheet->rows = rows;
    SheetRow *row = &rows[sheet->row_count];
    *row = (SheetRow){0};
    snprintf(row->name, sizeof row->name, "%s", name);
    for (int c = 0; c < SHEET_MAX_COLUMNS; c++)
        row->paper[c] = (double)NAN;
    return sheet->row_count++;
}

bool sheet_add_run(Sheet *sheet, int row_index, const double *values, Err *err) {
    SheetRow *row = &sheet->rows[row_index];
    const size_t count = (size_t)sheet->column_count, used = (size_t)row->run_count * count;
    double *all = realloc(row->values, (used + count) * sizeof *all);
    if (!all)
        return err_set(err, ERR_IO, "out of memory");
    memcpy(all + used, values, count * sizeof *all);
    row->values = all;
    row->run_count++;
    return true;
}

/* ---- Figures ---- */

static SheetFigure own_figure(const Sheet *sheet, const SheetRow *row, int column) {
    SheetFigure figure = {NAN, NAN, NAN};
    double *sorted = malloc(((size_t)row->run_count + 1) * sizeof *sorted);
    size_t count = 0;
    for (int run = 0; sorted && run < row->run_count; run++) {
        const double value = row->values[run * sheet->column_count + column];
        if (!isnan(value))
            sorted[count++] = value;
    }
    if (count > 0) {
        summary_sort(sorted, count);
        figure = (SheetFigure){summary_percentile(sorted, count, 50), summary_percentile(sorted, count, 25),
                               summary_percentile(sorted, count, 75)};
    }
    free(sorted);
    return figure;
}

SheetFigure sheet_figure(const Sheet *sheet, int row, int column) {
    const uint32_t parts = sheet->columns[column].sum_of;
    if (parts == 0)
        return own_figure(sheet, &sheet->rows[row], column);
    SheetFigure sum = {0, NAN, NAN}; /* of sums of medians there are no quartiles */
    for (int c = 0; c < sheet->column_count; c++) {
        if (parts >> c & 1)
            sum.median += own_figure(sheet, &sheet->rows[row], c).median;
    }
    return sum;
}

/* ---- Text ---- */

static void format_figure(char *out, size_t size, double value, int decimals) {
    if (isnan(value))
        snprintf(out, size, "-");
    else
        snprintf(out, size, "%.*f", decimals, value);
}

static int column_width(const Sheet *sheet, int column) {
    char text[64];
    int width = (int)strlen(sheet->columns[column].label);
    for (int r = 0; r < sheet->row_count; r++) {
        const double values[2] = {sheet_figure(sheet, r, column).median, sheet->rows[r].paper[column]};
        for (int i = 0; i < 2; i++) {
            format_figure(text, sizeof text, values[i], sheet->columns[column].decimals);
            width = (int)strlen(text) > width ? (int)strlen(text) : width;
        }
    }
    return width;
}

static bool has_paper(const Sheet *sheet, int row) {
    bool any = false;
    for (int c = 0; c < sheet->column_count; c++)
        any = any || !isnan(sheet->rows[row].paper[c]);
    return any;
}

void sheet_print(FILE *out, const Sheet *sheet) {
    int widths[SHEET_MAX_COLUMNS], name_width = 7; /* "  paper" */
    for (int r = 0; r < sheet->row_count; r++)
        if ((int)strlen(sheet->rows[r].name) > name_width)
            name_width = (int)strlen(sheet->rows[r].name);
    fprintf(out, "%s (%s)\n\n%-*s", sheet->title, sheet->source, name_width, "");
    for (int c = 0; c < sheet->column_count; c++) {
        widths[c] = column_width(sheet, c);
        fprintf(out, "  %*s", widths[c], sheet->columns[c].label);
    }
    fputc('\n', out);
    for (int r = 0; r < sheet->row_count; r++) {
        const int lines = has_paper(sheet, r) ? 2 : 1;
        for (int line = 0; line < lines; line++) {
            fprintf(out, "%-*s", name_width, line == 0 ? sheet->rows[r].name : "  paper");
            for (int c = 0; c < sheet->column_count; c++) {
                char text[64];
                format_figure(text, sizeof text,
                              line == 0 ? sheet_figure(sheet, r, c).median : sheet->rows[r].paper[c],
                              sheet->columns[c].decimals);
                fprintf(out, "  %*s", widths[c], text);
            }
            fputc('\n', out);
        }
    }
}

/* ---- Files ---- */

static void put_number(json_t *line, const char *key, const char *suffix, double value) {
    char name[128];
    snprintf(name, sizeof name, "%s%s", key, suffix);
    json_object_set_new(line, name, json_text_float((float)value));
}

void sheet_print_json(FILE *out, const Sheet *sheet) {
    for (int r = 0; r < sheet->row_count; r++) {
        const SheetRow *row = &sheet->rows[r];
        json_t *line = json_object();
        json_object_set_new(line, "table", json_string(sheet->name));
        json_object_set_new(line, sheet->row_key, json_string(row->name));
        json_object_set_new(line, "runs", json_integer(row->run_count));
        for (int c = 0; c < sheet->column_count; c++) {
            const char *key = sheet->columns[c].key;
            const SheetFigure figure = sheet_figure(sheet, r, c);
            put_number(line, key, "", figure.median);
            put_number(line, key, "_low", figure.low);
            put_number(line, key, "_high", figure.high);
            if (!isnan(row->paper[c]))
                put_number(line, key, "_paper", row->paper[c]);
        }
        json_text_print(out, line, -1);
        fputc('\n', out);
        json_decref(line);
    }
}

/* Six digits; nothing where there is no value. */
static void put_cell(FILE *out, double value) {
    fputc(',', out);
    if (!isnan(value))
        fprintf(out, "%.6g", value);
}

bool sheet_write_csv(const Sheet *sheet, const char *path, Err *err) {
    FileWriter writer;
    if (!file_begin(&writer, path, err))
        return false;
    fprintf(writer.stream, "%s,column,runs,median,low,high,paper\n", sheet->row_key);
    for (int r = 0; r < sheet->row_count; r++)
        for (int c = 0; c < sheet->column_count; c++) {
            const SheetFigure figure = sheet_figure(sheet, r, c);
            fprintf(writer.stream, "%s,%s,%d", sheet->rows[r].name, sheet->columns[c].key,
                    sheet->rows[r].run_count);
            put_cell(writer.stream, figure.median);
            put_cell(writer.stream, figure.low);
            put_cell(writer.stream, figure.high);
            put_cell(writer.stream, sheet->rows[r].paper[c]);
            fputc('\n', writer.stream);
        }
    return file_commit(&writer, err);
}

static void write_cell(FILE *out, const char *before, double value, int decimals) {
    char text[64];
    format_figure(text, sizeof text, value, decimals);
    fprintf(out, "%s%s", before, isnan(value) ? "&ndash;" : text);
}

void sheet_write_html(FILE *out, const Sheet *sheet) {
    int most_runs = 0;
    for (int r = 0; r < sheet->row_count; r++)
        most_runs = sheet->rows[r].run_count > most_runs ? sheet->rows[r].run_count : most_runs;
    fputs("<h2>", out);
    svg_text(out, sheet->title);
    fprintf(out, "</h2>\n<p class=\"soft\">%s",
            most_runs > 1 ? "Medians, quartiles below; paper: " : "Paper: ");
    svg_text(out, sheet->source);
    /* many columns: smaller, and the rows' names stay where a narrow window scrolls */
    fprintf(out, "</p>\n<div class=\"wide\"><table%s><tr><th></th>",
            sheet->column_count > 8 ? " class=\"dense\"" : "");
    for (int c = 0; c < sheet->column_count; c++) {
        fputs("<th>", out);
        svg_text(out, sheet->columns[c].label);
        fputs("</th>", out);
    }
    fputs("</tr>\n", out);
    for (int r = 0; r < sheet->row_count; r++) {
        const SheetRow *row = &sheet->rows[r];
        fputs("<tr class=\"sum\"><td>", out);
        svg_text(out, row->name);
        fputs("</td>", out);
        for (int c = 0; c < sheet->column_count; c++) {
            const SheetFigure figure = sheet_figure(sheet, r, c);
            const int decimals = sheet->columns[c].decimals;
            write_cell(out, "<td>", figure.median, decimals);
            if (row->run_count > 1 && !isnan(figure.low)) {
                write_cell(out, "<br><small>", figure.low, decimals);
                write_cell(out, " \u2013 ", figure.high, decimals);
                fputs("</small>", out);
            }
            fputs("</td>", out);
        }
        fputs("</tr>\n", out);
        if (!has_paper(sheet, r))
            continue;
        fputs("<tr><td class=\"soft\">paper</td>", out);
        for (int c = 0; c < sheet->column_count; c++) {
            write_cell(out, "<td class=\"soft\">", row->paper[c], sheet->columns[c].decimals);
            fputs("</td>", out);
        }
        fputs("</tr>\n", out);
    }
    fputs("</table></div>\n", out);
}
