/* Steps one after the other on one track, each with its phases inside it; window moves as instant events on a
 * track of their own; counters of particles and iterations. Rebuilt from steps.csv at the end of a run, so
 * that a resumed run has one trace from its beginning; the time between steps (output, rendering, a pause of
 * days before a resume) is left out. Format: "Trace Event Format" of the Chromium project, times in us. */
#include "trace.h"

#include "profile.h"

#include "engine/base/file.h"

#include <stdlib.h>

enum { STEP_TRACK = 1, MOVE_TRACK = 2 };

typedef struct Trace {
    FILE *out;
    const CsvTable *steps;
    int step, moved, step_ms, particles, density, divergence; /* columns, -1: none */
    char (*keys)[64];                                         /* [columns] of phases, "" for others */
} Trace;

static double value_at(const Trace *trace, size_t row, int column) {
    return column < 0 ? 0 : trace->steps->values[row * (size_t)trace->steps->column_count + (size_t)column];
}

static void write_slice(FILE *out, const char *name, double begin_us, double end_us) {
    fprintf(out, ",\n{\"name\":\"%s\",\"ph\":\"X\",\"pid\":1,\"tid\":%d,\"ts\":%.3f,\"dur\":%.3f", name,
            STEP_TRACK, begin_us, end_us - begin_us);
}

/* A counter keeps its value until the next event: written where it changes. */
static void write_counter(const Trace *trace, size_t row, const char *name, int column, double at_us) {
    const bool same = row > 0 && value_at(trace, row, column) == value_at(trace, row - 1, column);
    if (column >= 0 && !same)
        fprintf(trace->out, ",\n{\"name\":\"%s\",\"ph\":\"C\",\"pid\":1,\"ts\":%.3f,\"args\":{\"%s\":%.0f}}",
                name, at_us, name, value_at(trace, row, column));
}

/* Returns the end of the step. */
static double write_step(const Trace *trace, size_t row, double begin_us) {
    const double end_us = begin_us + 1000 * value_at(trace, row, trace->step_ms);
    write_slice(trace->out, "step", begin_us, end_us);
    fprintf(trace->out, ",\"args\":{\"step\":%.0f}}", value_at(trace, row, trace->step));
    double from_us = begin_us;
    for (int c = 0; c < trace->steps->column_count; c++) {
        if (!*trace->keys[c])
            continue;
        double to_us = from_us + 1000 * value_at(trace, row, c);
        to_us = to_us < end_us ? to_us : end_us; /* a slice must lie inside its parent; digits are rounded */
        if (to_us > from_us) { /* a phase that does nothing takes no time to the digits of the table */
            write_slice(trace->out, trace->keys[c], from_us, to_us);
            fputc('}', trace->out);
        }
        from_us = to_us;
    }
    if (value_at(trace, row, trace->moved) > 0)
        fprintf(trace->out,
                ",\n{\"name\":\"window move\",\"ph\":\"i\",\"s\":\"p\",\"pid\":1,\"tid\":%d,\"ts\":%.3f,"
                "\"args\":{\"step\":%.0f}}",
                MOVE_TRACK, begin_us, value_at(trace, row, trace->step));
    write_counter(trace, row, "particles", trace->particles, begin_us);
    write_counter(trace, row, "density iterations", trace->density, begin_us);
    write_counter(trace, row, "divergence iterations", trace->divergence, begin_us);
    return end_us;
}

static void write_events(const Trace *trace) {
    static const struct {
        const char *what;
        int track;
        const char *name;
    } names[] = {{"process_name", 0, "skiff"},
                 {"thread_name", STEP_TRACK, "steps"},
                 {"thread_name", MOVE_TRACK, "moves"}};
    fputs("{\"displayTimeUnit\":\"ms\",\"traceEvents\":[", trace->out);
    for (size_t i = 0; i < sizeof names / sizeof *names; i++)
        fprintf(trace->out,
                "%s\n{\"name\":\"%s\",\"ph\":\"M\",\"pid\":1,\"tid\":%d,\"args\":{\"name\":\"%s\"}}",
                i > 0 ? "," : "", names[i].what, names[i].track, names[i].name);
    double now_us = 0;
    for (size_t row = 0; row < trace->steps->row_count; row++)
        now_us = write_step(trace, row, now_us);
    fputs("\n]}\n", trace->out);
}

bool trace_write(const char *path, const CsvTable *steps, Err *err) {
    FileWriter writer;
    Trace trace = {.steps = steps,
                   .step = csv_column(steps, "step"),
                   .moved = csv_column(steps, "moved"),
                   .step_ms = csv_column(steps, "step_ms"),
                   .particles = csv_column(steps, "particles"),
                   .density = csv_column(steps, "density_iterations"),
                   .divergence = csv_column(steps, "divergence_iterations"),
                   .keys = calloc((size_t)steps->column_count + 1, sizeof *trace.keys)};
    if (!trace.keys)
        return err_set(err, ERR_IO, "%s: out of memory", path);
    for (int c = 0; c < steps->column_count; c++)
        if (!profile_phase_key(steps->names[c], trace.keys[c], sizeof trace.keys[c]))
            trace.keys[c][0] = '\0';
    const bool begun = file_begin(&writer, path, err);
    if (begun) {
        trace.out = writer.stream;
        write_events(&trace);
    }
    free(trace.keys);
    return begun && file_commit(&writer, err);
}
