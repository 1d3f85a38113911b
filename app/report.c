/* The page is written top to bottom: key figures, charts, table of times, bodies, how it was made. Everything
 * in it comes from summary.json and the CSV files. */
#include "report.h"

#include "html.h"
#include "svg.h"

#include "engine/base/angle.h"
#include "engine/base/file.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- Pieces ---- */

static double number_at(const json_t *summary, const char *group, const char *key, const char *statistic) {
    const json_t *value = json_object_get(summary, group);
    value = key ? json_object_get(value, key) : value;
    value = statistic ? json_object_get(value, statistic) : value;
    return json_is_number(value) ? json_number_value(value) : (double)NAN;
}

static const char *text_at(const json_t *object, const char *key) {
    const char *text = json_string_value(json_object_get(object, key));
    return text ? text : "";
}

/* Thousands in groups of three, with thin spaces. */
static void write_count(FILE *out, double count) {
    char digits[32];
    snprintf(digits, sizeof digits, "%.0f", count);
    size_t length = strlen(digits);
    for (size_t i = 0; i < length; i++) {
        if (i > 0 && (length - i) % 3 == 0)
            fputs("&#8239;", out);
        fputc(digits[i], out);
    }
}

static void write_number(FILE *out, double value) {
    if (!isfinite(value))
        fputs("&ndash;", out);
    else if (value != 0 && fabs(value) < 1e-3)
        fprintf(out, "%.2e", value);
    else
        fprintf(out, "%.4g", value);
}

static void figure_count(FILE *out, double count, const char *label) {
    fputs("<div><b>", out);
    write_count(out, count);
    fprintf(out, "</b><span>%s</span></div>", label);
}

static void figure_number(FILE *out, double value, const char *label) {
    fputs("<div><b>", out);
    write_number(out, value);
    fprintf(out, "</b><span>%s</span></div>", label);
}

static void write_header(FILE *out, const ReportInput *input) {
    const json_t *summary = input->summary, *machine = json_object_get(summary, "machine");
    const char *status = text_at(summary, "status"), *message = text_at(summary, "message");
    char name[256];
    scene_name(input->scene, name, sizeof name);
    const char *title = *input->scene->title ? input->scene->title : name;
    html_begin(out, title);
    fputs("<h1>", out);
    svg_text(out, title);
    fprintf(out, " <span class=\"status %s\">%s</span></h1>\n<p class=\"soft\">", status, status);
    svg_text(out, text_at(machine, "cpu"));
    fprintf(out, ", %.0f of %.0f cores, %s</p>\n", number_at(machine, "threads", NULL, NULL),
            number_at(machine, "cores", NULL, NULL), text_at(machine, "isa"));
    if (*message) {
        fputs("<p>", out);
        svg_text(out, message);
        fputs("</p>\n", out);
    }
}

/* Particles that appeared or disappeared, for each cause that there was. */
static void write_causes(FILE *out, const json_t *counts, int count, const char *(*key)(int cause),
                         const char *(*label)(int cause)) {
    for (int i = 0; i < count; i++) {
        char text[128];
        const double particles = json_number_value(json_object_get(counts, key(i)));
        snprintf(text, sizeof text, "particles %s", label(i));
        if (particles > 0)
            figure_count(out, particles, text);
    }
}

static void write_figures(FILE *out, const json_t *summary) {
    fputs("<div class=\"figures\">", out);
    figure_count(out, number_at(summary, "particles", NULL, NULL), "particles");
    figure_count(out, number_at(summary, "boundary_samples", NULL, NULL), "boundary samples");
    figure_number(out, number_at(summary, "time", NULL, NULL), "s simulated");
    figure_count(out, number_at(summary, "steps", NULL, NULL), "steps");
    figure_number(out, number_at(summary, "ms", "step", "p50"), "ms a step, median");
    figure_number(out, number_at(summary, "ms", "step", "mean"), "ms a step, mean");
    figure_number(out, number_at(summary, "ms", "step", "p99"), "ms a step, 99th percentile");
    figure_number(out, number_at(summary, "real_time_factor", NULL, NULL),
                  "real-time factor (1 is real time)");
    figure_number(out, number_at(summary, "iterations", "density", "mean"), "density iterations, mean");
    figure_number(out, number_at(summary, "iterations", "divergence", "mean"), "divergence iterations, mean");
    figure_number(out, number_at(summary, "errors_percent", "density", "mean"), "% density error, mean");
    figure_number(out, number_at(summary, "errors_percent", "density_max", "max"),
                  "% density error, largest");
    figure_number(out, number_at(summary, "peak_rss_mb", NULL, NULL), "MB of memory, peak");
    if (number_at(summary, "moves", NULL, NULL) > 0)
        figure_count(out, number_at(summary, "moves", NULL, NULL), "window moves");
    write_causes(out, json_object_get(summary, "particles_in"), SKIFF_IN_COUNT, skiff_in_key, skiff_in_label);
    write_causes(out, json_object_get(summary, "particles_out"), SKIFF_OUT_COUNT, skiff_out_key,
                 skiff_out_label);
    fputs("</div>\n", out);
}

/* ---- Charts ---- */

/* Columns copied out for one chart. */
typedef struct ChartData {
    SvgChart chart;
    double *columns[SVG_MAX_SERIES];
} ChartData;

static ChartData chart_begin(const char *title, const char *y_label, const CsvTable *table, const double *t) {
    return (ChartData){
        .chart = {
            .title = title, .x_label = "time, s", .y_label = y_label, .x = t, .count = table->row_count}};
}

static void chart_add(ChartData *data, const CsvTable *table, const char *column, const char *name) {
    int s = data->chart.series_count;
    double *values = s < SVG_MAX_SERIES ? csv_copy_column(table, column) : NULL;
    if (!values)
        return;
    data->columns[s] = values;
    data->chart.series[s] = (SvgSeries){name, values};
    data->chart.series_count++;
}

static void chart_end(FILE *out, ChartData *data) {
    if (data->chart.series_count > 0)
        svg_chart(out, &data->chart);
    for (int s = 0; s < data->chart.series_count; s++)
        free(data->columns[s]);
}

static void write_phase_chart(FILE *out, const CsvTable *steps, const double *t) {
    ChartData data = chart_begin("Time of a step, by phase", "ms", steps, t);
    char column[64];
    data.chart.is_stacked = true;
    for (int i = 0; i < SKIFF_PHASE_COUNT; i++) {
        snprintf(column, sizeof column, "%s_ms", skiff_phase_key(i));
        chart_add(&data, steps, column, skiff_phase_label(i));
    }
    chart_end(out, &data);
}

static void write_step_charts(FILE *out, const CsvTable *steps, const double *t) {
    static const struct {
        const char *title, *y_label;
        bool is_logarithmic, from_zero;
        const char *columns[4], *names[4];
    } charts[] = {
        {"Solver iterations",
         "iterations",
         false,
         true,
         {"density_iterations", "divergence_iterations"},
         {"density", "divergence"}},
        {"Density error",
         "%",
         true,
         false,
         {"density_max_percent", "density_error_percent", "residual_percent"},
         {"largest", "mean", "mean residual of the solve"}},
        {"Divergence error", "%", true, false, {"divergence_error_percent"}, {"mean"}},
        {"Speed", "m/s", true, false, {"max_speed", "mean_speed"}, {"largest", "mean"}},
        {"Kinetic energy of the fluid", "J", false, true, {"kinetic"}, {"kinetic"}},
        {"Potential energy of the fluid", "J", false, false, {"potential"}, {"potential"}},
        {"Mean height of the fluid", "m", false, false, {"mean_height"}, {"mean y"}},
        {"Particles", "particles", false, true, {"particles"}, {"particles"}},
        {"Neighbours", "neighbours", false, true, {"neighbours"}, {"mean"}},
    };
    write_phase_chart(out, steps, t);
    for (size_t i = 0; i < sizeof charts / sizeof *charts; i++) {
        ChartData data = chart_begin(charts[i].title, charts[i].y_label, steps, t);
        data.chart.is_logarithmic = charts[i].is_logarithmic;
        data.chart.from_zero = charts[i].from_zero;
        for (int c = 0; c < 4 && charts[i].columns[c]; c++)
            chart_add(&data, steps, charts[i].columns[c], charts[i].names[c]);
        chart_end(out, &data);
    }
}

/* Probes of one kind share charts, as many curves in each as there are colours. */
static void write_scalar_probes(FILE *out, const ReportInput *input, const double *t, SkiffProbeKind kind,
                                const char *title, const char *y_label) {
    ChartData data = chart_begin(title, y_label, &input->probes, t);
    for (int i = 0; i < input->scene->def.probe_count; i++) {
        const SkiffProbeDef *probe = &input->scene->def.probes[i];
        if (probe->kind != kind)
            continue;
        if (data.chart.series_count == SVG_MAX_SERIES) {
            chart_end(out, &data);
            data = chart_begin(title, y_label, &input->probes, t);
        }
        chart_add(&data, &input->probes, probe->name, probe->name);
    }
    chart_end(out, &data);
}

static void write_vector_chart(FILE *out, const CsvTable *table, const double *t, const char *name,
                               const char *what, const char *unit, const char *prefix) {
    static const char *const axes[] = {"x", "y", "z"};
    char title[128], column[96];
    snprintf(title, sizeof title, "%s: %s", name, what);
    ChartData data = chart_begin(title, unit, table, t);
    for (int k = 0; k < 3; k++) {
        snprintf(column, sizeof column, "%s.%s%s", name, prefix, axes[k]);
        chart_add(&data, table, column, axes[k]);
    }
    chart_end(out, &data);
}

static void write_probe_charts(FILE *out, const ReportInput *input, const double *t) {
    write_scalar_probes(out, input, t, SKIFF_PROBE_HEIGHT, "Water height at the wave gauges", "m");
    write_scalar_probes(out, input, t, SKIFF_PROBE_PRESSURE, "Pressure at the walls", "Pa");
    for (int i = 0; i < input->scene->def.probe_count; i++) {
        const SkiffProbeDef *probe = &input->scene->def.probes[i];
        if (probe->kind != SKIFF_PROBE_FORCE)
            continue;
        write_vector_chart(out, &input->probes, t, probe->name, "force of the fluid", "N", "f");
        write_vector_chart(out, &input->probes, t, probe->name, "torque of the fluid", "N m", "t");
    }
}

/* Nothing for a body without a drive. */
static void write_drive_charts(FILE *out, const CsvTable *hull, const double *t, const char *name) {
    static const struct {
        const char *what, *unit, *columns[2];
    } charts[] = {
        {"speed along the heading", "m/s", {"speed"}},
        {"heading, to starboard of the start", "rad", {"heading"}},
        {"helm", "share of full throttle and rudder", {"throttle", "rudder"}},
    };
    for (size_t i = 0; i < sizeof charts / sizeof *charts; i++) {
        char title[128], column[96];
        snprintf(title, sizeof title, "%s: %s", name, charts[i].what);
        ChartData data = chart_begin(title, charts[i].unit, hull, t);
        for (int c = 0; c < 2 && charts[i].columns[c]; c++) {
            snprintf(column, sizeof column, "%s.%s", name, charts[i].columns[c]);
            chart_add(&data, hull, column, charts[i].columns[c]);
        }
        chart_end(out, &data);
    }
}

static void write_body_charts(FILE *out, const ReportInput *input, const double *t) {
    char column[96];
    int count = skiff_body_count(input->sim);
    ChartData data = chart_begin("Height of the bodies' centres of mass", "m", &input->hull, t);
    for (int i = 0; i < count; i++) {
        const char *name = input->scene->def.bodies[i].name;
        if (data.chart.series_count == SVG_MAX_SERIES) {
            chart_end(out, &data);
            data = chart_begin("Height of the bodies' centres of mass", "m", &input->hull, t);
        }
        snprintf(column, sizeof column, "%s.y", name);
        chart_add(&data, &input->hull, column, name);
    }
    chart_end(out, &data);
    for (int i = 0; i < count && i < 4; i++) {
        write_vector_chart(out, &input->hull, t, input->scene->def.bodies[i].name, "velocity", "m/s", "v");
        write_vector_chart(out, &input->hull, t, input->scene->def.bodies[i].name, "force of the fluid", "N",
                           "f");
        write_drive_charts(out, &input->hull, t, input->scene->def.bodies[i].name);
    }
}

static void write_charts(FILE *out, const ReportInput *input) {
    double *steps_t = csv_copy_column(&input->steps, "t");
    double *hull_t = csv_copy_column(&input->hull, "t");
    double *probes_t = csv_copy_column(&input->probes, "t");
    if (probes_t) {
        fputs("<h2>Probes</h2>\n<div class=\"charts\">\n", out);
        write_probe_charts(out, input, probes_t);
        fputs("</div>\n", out);
    }
    if (hull_t) {
        fputs("<h2>Bodies</h2>\n<div class=\"charts\">\n", out);
        write_body_charts(out, input, hull_t);
        fputs("</div>\n", out);
    }
    if (steps_t) {
        fputs("<h2>Steps</h2>\n<div class=\"charts\">\n", out);
        write_step_charts(out, &input->steps, steps_t);
        fputs("</div>\n", out);
    }
    free(steps_t);
    free(hull_t);
    free(probes_t);
}

/* ---- Tables ---- */

static void write_time_row(FILE *out, const json_t *summary, const char *key, const char *label,
                           const char *class_name) {
    static const char *const statistics[] = {"mean", "p50", "p95", "p99", "max"};
    fprintf(out, "<tr%s><td>%s</td>", class_name, label);
    for (size_t i = 0; i < sizeof statistics / sizeof *statistics; i++) {
        double value = number_at(summary, "ms", key, statistics[i]);
        if (isfinite(value))
            fprintf(out, "<td>%.2f</td>", value);
        else
            fputs("<td>&ndash;</td>", out);
    }
    fputs("</tr>\n", out);
}

static void write_time_table(FILE *out, const json_t *summary) {
    fputs("<h2>Times, ms</h2>\n<div "
          "class=\"wide\"><table><tr><th>phase</th><th>mean</th><th>median</th><th>95 %</th><th>99 %</th>"
          "<th>longest</th></tr>\n",
          out);
    for (int i = 0; i < SKIFF_PHASE_COUNT; i++)
        write_time_row(out, summary, skiff_phase_key(i), skiff_phase_label(i), "");
    write_time_row(out, summary, "step", "whole step", " class=\"sum\"");
    fputs("</table></div>\n", out);
}

static void write_body_table(FILE *out, const SkiffSim *sim) {
    int count = skiff_body_count(sim);
    if (count == 0)
        return;
    fputs("<h2>Bodies at the end</h2>\n<div class=\"wide\"><table><tr><th>name</th><th>mass, kg</th><th>x, "
          "m</th><th>y, m</th>"
          "<th>z, m</th><th>turned, &deg;</th><th>speed, m/s</th><th>samples</th></tr>\n",
          out);
    for (int i = 0; i < count; i++) {
        SkiffBody body = skiff_body(sim, i);
        const double *v = body.velocity, *q = body.rotation;
        double turned = 2 * acos(fmin(fabs(q[3]), 1)) * 180 / pi; /* since the start */
        fputs("<tr><td>", out);
        svg_text(out, body.name);
        fprintf(out,
                "</td><td>%.5g</td><td>%.4f</td><td>%.4f</td><td>%.4f</td><td>%.1f</td><td>%.4f</td><td>",
                body.mass, body.position[0], body.position[1], body.position[2], turned,
                sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]));
        write_count(out, body.sample_count);
        fputs("</td></tr>\n", out);
    }
    fputs("</table></div>\n", out);
}

static void write_footer(FILE *out, const ReportInput *input) {
    const json_t *machine = json_object_get(input->summary, "machine");
    fputs("<h2>How it was made</h2>\n<p class=\"soft\">Scene <code>", out);
    svg_text(out, input->scene->file);
    fprintf(out,
            "</code>, time step %g ms. Skiff %s, commit <code>%s</code>, %s.</p>\n<p class=\"soft\">State at "
            "the end: "
            "<code>%s</code> (equal states have equal hashes, whatever the number of threads).</p>\n",
            1000 * number_at(input->summary, "time_step", NULL, NULL), text_at(machine, "version"),
            text_at(machine, "commit"), text_at(machine, "compiler"), text_at(input->summary, "state_hash"));
    fputs(
        "<p class=\"soft\">Numbers: steps.csv, ledger.csv, hull.csv, probes.csv and summary.json beside this "
        "file; trace.json opens in Perfetto. Bands around the curves show the range within the interval of a "
        "point.</p>\n",
        out);
    html_end(out);
}

bool report_write(const char *path, const ReportInput *input, Err *err) {
    FileWriter writer;
    if (!file_begin(&writer, path, err))
        return false;
    write_header(writer.stream, input);
    write_figures(writer.stream, input->summary);
    write_charts(writer.stream, input);
    write_time_table(writer.stream, input->summary);
    write_body_table(writer.stream, input->sim);
    write_footer(writer.stream, input);
    return file_commit(&writer, err);
}
