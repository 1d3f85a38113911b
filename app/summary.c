#include "summary.h"

#include "json_text.h"

#include "engine/base/arena.h"

#include <inttypes.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define COUNT(table) ((int)(sizeof(table) / sizeof *(table)))

/* Columns of steps.csv that are summarised, and under which name. Phases and the step itself join the group
 * "ms". */
static const struct {
    const char *column, *group, *key;
} rows[] = {
    {"density_iterations", "iterations", "density"},
    {"divergence_iterations", "iterations", "divergence"},
    {"density_error_percent", "errors_percent", "density"},
    {"density_max_percent", "errors_percent", "density_max"},
    {"divergence_error_percent", "errors_percent", "divergence"},
    {"residual_percent", "errors_percent", "residual"},
    {"mean_speed", "speed", "mean"},
    {"max_speed", "speed", "max"},
    {"neighbours", "neighbours", NULL},
};

static int compare_doubles(const void *a, const void *b) {
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

void summary_sort(double *values, size_t count) {
    qsort(values, count, sizeof *values, compare_doubles);
}

double summary_percentile(const double *sorted, size_t count, double percent) {
    size_t rank = (size_t)ceil(percent / 100.0 * (double)count);
    return sorted[rank > 0 ? rank - 1 : 0];
}

/* Six digits are more than any of these figures means. */
json_t *summary_figure(double value) {
    char text[32];
    snprintf(text, sizeof text, "%.6g", value);
    return json_text_double(strtod(text, NULL));
}

/* {"mean":, "p50":, "p95":, "p99":, "max":} of count values, whose order is lost. Percentiles by nearest
 * rank. New reference. */
static json_t *statistics(double *values, size_t count) {
    if (count == 0)
        return json_null();
    double sum = 0;
    for (size_t i = 0; i < count; i++)
        sum += values[i];
    summary_sort(values, count);
    return json_pack("{sososososo}", "mean", summary_figure(sum / (double)count), "p50",
                     summary_figure(summary_percentile(values, count, 50)), "p95",
                     summary_figure(summary_percentile(values, count, 95)), "p99",
                     summary_figure(summary_percentile(values, count, 99)), "max",
                     summary_figure(values[count - 1]));
}

double summary_real_time_factor(double simulated, double computed_ms) {
    return computed_ms > 0 ? 1000.0 * simulated / computed_ms : NAN;
}

uint32_t summary_sample_count(const SkiffSim *sim) {
    SkiffBoundary walls, bodies;
    skiff_boundary_samples(sim, false, &walls);
    skiff_boundary_samples(sim, true, &bodies);
    return walls.count + bodies.count;
}

static void add_column(json_t *into, const char *key, const CsvTable *steps, const char *column) {
    double *values = csv_copy_column(steps, column);
    json_object_set_new(into, key, values ? statistics(values, steps->row_count) : json_null());
    free(values);
}

static json_t *milliseconds(const CsvTable *steps) {
    json_t *group = json_object();
    char column[64];
    add_column(group, "step", steps, "step_ms");
    for (int i = 0; i < SKIFF_PHASE_COUNT; i++) {
        snprintf(column, sizeof column, "%s_ms", skiff_phase_key(i));
        add_column(group, skiff_phase_key(i), steps, column);
    }
    return group;
}

/* The same of the steps that moved the window, or of those that did not; null where there are none. */
static json_t *milliseconds_of(const CsvTable *steps, bool moved) {
    CsvTable part = *steps;
    const int column = csv_column(steps, "moved");
    const size_t width = (size_t)steps->column_count;
    part.row_count = 0;
    part.values = malloc((steps->row_count * width + 1) * sizeof *part.values);
    for (size_t row = 0; part.values && column >= 0 && row < steps->row_count; row++) {
        const double *from = steps->values + row * width;
        if ((from[column] > 0) == moved)
            memcpy(part.values + part.row_count++ * width, from, width * sizeof *from);
    }
    json_t *group = part.row_count > 0 ? milliseconds(&part) : json_null();
    free(part.values);
    return group;
}

static double column_sum(const CsvTable *steps, const char *name) {
    double *values = csv_copy_column(steps, name), sum = 0;
    for (size_t i = 0; values && i < steps->row_count; i++)
        sum += values[i];
    free(values);
    return sum;
}

static json_t *cause_counts(const CsvTable *ledger, const char *prefix, int count,
                            const char *(*key)(int cause)) {
    json_t *group = json_object();
    char column[64];
    for (int i = 0; i < count; i++) {
        snprintf(column, sizeof column, "%s_%s", prefix, key(i));
        json_object_set_new(group, key(i), json_integer((json_int_t)column_sum(ledger, column)));
    }
    return group;
}

json_t *summary_make(const Scene *scene, const SkiffSim *sim, const CsvTable *steps, const CsvTable *ledger,
                     const RunEnd *end) {
    const SkiffStats *stats = skiff_stats(sim);
    Machine machine = machine_describe(sim);
    char hash[20];
    snprintf(hash, sizeof hash, "%016" PRIx64, skiff_hash(sim));
    double computed_ms = column_sum(steps, "step_ms");
    double simulated = skiff_time(sim) - scene->def.start_time;
    json_t *summary =
        json_pack("{sossssso so}", "scene", json_text_string(scene->file), "title", scene->title, "status",
                  end->status, "message", json_text_string(end->message), "state_hash", json_string(hash));
    json_object_set_new(summary, "steps", json_integer((json_int_t)skiff_step_count(sim)));
    json_object_set_new(summary, "time", json_text_double(skiff_time(sim)));
    json_object_set_new(summary, "time_step", json_text_float(skiff_params(sim)->time_step));
    json_object_set_new(summary, "particles", json_integer(skiff_particles(sim).count));
    json_object_set_new(summary, "particles_in", cause_counts(ledger, "in", SKIFF_IN_COUNT, skiff_in_key));
    json_object_set_new(summary, "particles_out",
                        cause_counts(ledger, "out", SKIFF_OUT_COUNT, skiff_out_key));
    json_object_set_new(summary, "boundary_samples", json_integer(summary_sample_count(sim)));
    json_object_set_new(summary, "contacts", json_integer(stats->contacts));
    json_object_set_new(summary, "bodies", json_integer(skiff_body_count(sim)));
    json_object_set_new(summary, "computing_seconds", summary_figure(computed_ms / 1000));
    json_object_set_new(summary, "real_time_factor",
                        summary_figure(summary_real_time_factor(simulated, computed_ms)));
    json_object_set_new(summary, "moves", json_integer((json_int_t)column_sum(steps, "moved")));
    json_object_set_new(summary, "ms", milliseconds(steps));
    json_object_set_new(summary, "ms_without_moves", milliseconds_of(steps, false));
    json_object_set_new(summary, "ms_with_moves", milliseconds_of(steps, true));
    for (int i = 0; i < COUNT(rows); i++) {
        json_t *group = rows[i].key ? json_object_get(summary, rows[i].group) : summary;
        if (!group) {
            group = json_object();
            json_object_set_new(summary, rows[i].group, group);
        }
        add_column(group, rows[i].key ? rows[i].key : rows[i].group, steps, rows[i].column);
    }
    json_object_set_new(summary, "memory_mb", summary_figure((double)skiff_memory(sim) / 1e6));
    json_object_set_new(summary, "peak_rss_mb", summary_figure((double)memory_peak() / 1e6));
    json_object_set_new(summary, "machine", machine_json(&machine));
    return summary;
}
