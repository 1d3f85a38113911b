#include "svg.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
    WIDTH = 560,
    HEIGHT = 280,
    LEFT = 66,
    RIGHT = 14,
    TOP = 12,
    BOTTOM = 46,
    BUCKETS = 240,
    MAX_TICKS = 64,
    MAX_DECADES = 5
};

static const char *const colours[SVG_MAX_SERIES] = {"#2f6db3", "#e8762b", "#3a9a5b", "#c8413b",
                                                    "#8560b0", "#8a6552", "#d271a8", "#6f7680",
                                                    "#a9a42a", "#2aa5b5", "#f2b447", "#20435c"};

/* One series thinned out: interval b holds points [first, last). */
typedef struct Line {
    double x[BUCKETS], low[BUCKETS], mean[BUCKETS], high[BUCKETS];
} Line;

typedef struct Axis {
    double min, max;
    double ticks[MAX_TICKS];
    int tick_count;
    int decimals;       /* of labels; < 0: %g */
    double label_scale; /* labels are values divided by this, followed by label_suffix */
    const char *label_suffix;
    bool is_logarithmic;
} Axis;

typedef struct Plot {
    Line *lines; /* one a series; stacked: sums from below */
    int count;   /* intervals */
    Axis x, y;
    bool has_range; /* several points an interval */
} Plot;

void svg_text(FILE *out, const char *text) {
    for (; *text; text++) {
        const char *entity = *text == '<'   ? "&lt;"
                             : *text == '>' ? "&gt;"
                             : *text == '&' ? "&amp;"
                             : *text == '"' ? "&quot;"
                                            : NULL;
        if (entity)
            fputs(entity, out);
        else
            fputc(*text, out);
    }
}

/* ---- Data ---- */

static void thin_out(const SvgChart *chart, const double *y, int count, Line *line) {
    for (int b = 0; b < count; b++) {
        size_t first = chart->count * (size_t)b / (size_t)count,
               last = chart->count * (size_t)(b + 1) / (size_t)count;
        double low = INFINITY, high = -INFINITY, sum = 0, valid = 0;
        for (size_t i = first; i < last; i++) {
            if (!isfinite(y[i]))
                continue;
            low = fmin(low, y[i]);
            high = fmax(high, y[i]);
            sum += y[i];
            valid++;
        }
        line->x[b] = 0.5 * (chart->x[first] + chart->x[last - 1]);
        line->mean[b] = valid > 0 ? sum / valid : (double)NAN;
        line->low[b] = valid > 0 ? low : (double)NAN;
        line->high[b] = valid > 0 ? high : (double)NAN;
    }
}

static void stack(Line *lines, int series_count, int count) {
    for (int s = 1; s < series_count; s++)
        for (int b = 0; b < count; b++) {
            double below = lines[s - 1].mean[b], value = lines[s].mean[b];
            lines[s].mean[b] = (isfinite(below) ? below : 0) + (isfinite(value) ? value : 0);
        }
}

static void find_range(const SvgChart *chart, const Plot *plot, double *min, double *max) {
    *min = INFINITY;
    *max = -INFINITY;
    for (int s = 0; s < chart->series_count; s++)
        for (int b = 0; b < plot->count; b++) {
            const Line *line = &plot->lines[s];
            double low = chart->is_stacked ? line->mean[b] : line->low[b];
            double high = chart->is_stacked ? line->mean[b] : line->high[b];
            if (!isfinite(low) || (chart->is_logarithmic && high <= 0))
                continue;
            *min = fmin(*min, chart->is_logarithmic && low <= 0 ? high : low);
            *max = fmax(*max, high);
        }
}

/* ---- Axes ---- */

static void linear_ticks(Axis *axis, int wanted) {
    double raw = (axis->max - axis->min) / wanted;
    double power = pow(10, floor(log10(raw)));
    double share = raw / power;
    double step = power * (share <= 1 ? 1 : share <= 2 ? 2 : share <= 5 ? 5 : 10);
    axis->min = step * floor(axis->min / step + 1e-9);
    axis->max = step * ceil(axis->max / step - 1e-9);
    for (int i = 0; i < MAX_TICKS && axis->min + i * step < axis->max + 0.5 * step; i++)
        axis->ticks[axis->tick_count++] = axis->min + i * step;
    double largest = fmax(fabs(axis->min), fabs(axis->max));
    if (largest >= 1e4 && largest < 1e12) { /* 250k instead of 250000 */
        axis->label_scale = largest < 1e7 ? 1e3 : largest < 1e10 ? 1e6 : 1e9;
        axis->label_suffix = largest < 1e7 ? "k" : largest < 1e10 ? "M" : "G";
    }
    int decimals = (int)ceil(-log10(step / axis->label_scale) - 1e-9);
    axis->decimals = decimals > 4 ? -1 : decimals > 0 ? decimals : 0;
}

static void logarithmic_ticks(Axis *axis) {
    int low = (int)floor(log10(axis->min) + 1e-9), high = (int)ceil(log10(axis->max) - 1e-9);
    if (high - low > MAX_DECADES)
        low = high - MAX_DECADES; /* a first step of nearly 0 must not flatten the rest */
    if (high == low)
        high++;
    axis->min = pow(10, low);
    axis->max = pow(10, high);
    for (int e = low; e <= high; e++)
        axis->ticks[axis->tick_count++] = pow(10, e);
    axis->decimals = -1;
}

static Axis make_axis(double min, double max, bool from_zero, bool is_logarithmic, int wanted) {
    Axis axis = {.is_logarithmic = is_logarithmic, .label_scale = 1, .label_suffix = ""};
    if (!isfinite(min) || !isfinite(max)) {
        min = is_logarithmic ? 0.1 : 0;
        max = 1;
    }
    if (from_zero && !is_logarithmic) {
        min = fmin(min, 0);
        max = fmax(max, 0);
    }
    double least = 1e-6 * fmax(fabs(min), fabs(max)); /* a constant curve runs through the middle */
    if (!is_logarithmic && !(max - min > least)) {
        double margin = fmax(0.05 * fabs(max), 1e-9);
        max += margin;
        min -= from_zero ? 0 : margin;
    }
    axis.min = min;
    axis.max = max;
    if (is_logarithmic)
        logarithmic_ticks(&axis);
    else
        linear_ticks(&axis, wanted);
    return axis;
}

/* 0 at the axis's start, 1 at its end. */
static double place(const Axis *axis, double value) {
    double share = axis->is_logarithmic
                       ? log10(fmax(value, axis->min) / axis->min) / log10(axis->max / axis->min)
                       : (value - axis->min) / (axis->max - axis->min);
    return fmin(fmax(share, 0), 1);
}

static double to_x(const Plot *plot, double value) {
    return LEFT + place(&plot->x, value) * (WIDTH - LEFT - RIGHT);
}

static double to_y(const Plot *plot, double value) {
    return HEIGHT - BOTTOM - place(&plot->y, value) * (HEIGHT - TOP - BOTTOM);
}

static void print_tick(FILE *out, const Axis *axis, double value) {
    double shown = fabs(value) < 1e-12 ? 0.0 : value / axis->label_scale;
    if (axis->is_logarithmic && (value < 0.99e-3 || value > 0.99e9))
        fprintf(out, "1e%.0f", log10(value));
    else if (axis->is_logarithmic && value > 0.99e3)
        fprintf(out, value < 0.99e6 ? "%.0fk" : "%.0fM", value / (value < 0.99e6 ? 1e3 : 1e6));
    else if (axis->decimals < 0)
        fprintf(out, "%.3g", shown);
    else
        fprintf(out, "%.*f", axis->decimals, shown);
    if (shown != 0)
        fputs(axis->label_suffix, out);
}

static void draw_axes(FILE *out, const SvgChart *chart, const Plot *plot) {
    fputs("<g class=\"grid\">", out);
    for (int i = 0; i < plot->y.tick_count; i++) {
        double y = to_y(plot, plot->y.ticks[i]);
        fprintf(out, "<line x1=\"%d\" x2=\"%d\" y1=\"%.1f\" y2=\"%.1f\"/>", LEFT, WIDTH - RIGHT, y, y);
    }
    fputs("</g><g class=\"ticks\" text-anchor=\"end\">", out);
    for (int i = 0; i < plot->y.tick_count; i++) {
        fprintf(out, "<text x=\"%d\" y=\"%.1f\">", LEFT - 7, to_y(plot, plot->y.ticks[i]) + 4.5);
        print_tick(out, &plot->y, plot->y.ticks[i]);
        fputs("</text>", out);
    }
    fputs("</g><g class=\"ticks\" text-anchor=\"middle\">", out);
    for (int i = 0; i < plot->x.tick_count; i++) {
        fprintf(out, "<text x=\"%.1f\" y=\"%d\">", to_x(plot, plot->x.ticks[i]), HEIGHT - BOTTOM + 18);
        print_tick(out, &plot->x, plot->x.ticks[i]);
        fputs("</text>", out);
    }
    fprintf(out, "</g><line class=\"axis\" x1=\"%d\" x2=\"%d\" y1=\"%d\" y2=\"%d\"/>", LEFT, WIDTH - RIGHT,
            HEIGHT - BOTTOM, HEIGHT - BOTTOM);
    fprintf(out, "<text class=\"label\" x=\"%d\" y=\"%d\" text-anchor=\"middle\">",
            (LEFT + WIDTH - RIGHT) / 2, HEIGHT - 7);
    svg_text(out, chart->x_label);
    fprintf(out,
            "</text><text class=\"label\" transform=\"translate(14 %d) rotate(-90)\" text-anchor=\"middle\">",
            (TOP + HEIGHT - BOTTOM) / 2);
    svg_text(out, chart->y_label);
    fputs("</text>\n", out);
}

/* ---- Curves ---- */

static void draw_area(FILE *out, const Plot *plot, const Line *line, const double *low, const double *high,
                      const char *colour, double opacity) {
    const char *command = "M";
    fprintf(out, "<path fill=\"%s\" fill-opacity=\"%g\" d=\"", colour, opacity);
    for (int b = 0; b < plot->count; b++)
        if (isfinite(high[b])) {
            fprintf(out, "%s%.1f %.1f", command, to_x(plot, line->x[b]), to_y(plot, high[b]));
            command = "L";
        }
    for (int b = plot->count - 1; b >= 0; b--)
        if (isfinite(high[b]))
            fprintf(out, "L%.1f %.1f", to_x(plot, line->x[b]), to_y(plot, low ? low[b] : 0));
    fputs("Z\"/>\n", out);
}

static void draw_curve(FILE *out, const Plot *plot, const Line *line, const char *colour) {
    bool is_down = false;
    fprintf(out, "<path fill=\"none\" stroke=\"%s\" stroke-width=\"1.6\" stroke-linejoin=\"round\" d=\"",
            colour);
    for (int b = 0; b < plot->count; b++) {
        if (isfinite(line->mean[b]))
            fprintf(out, "%s%.1f %.1f", is_down ? "L" : "M", to_x(plot, line->x[b]),
                    to_y(plot, line->mean[b]));
        is_down = isfinite(line->mean[b]);
    }
    fputs("\"/>\n", out);
}

static void draw_series(FILE *out, const SvgChart *chart, const Plot *plot) {
    for (int s = 0; s < chart->series_count; s++) {
        const Line *line = &plot->lines[s];
        if (chart->is_stacked)
            draw_area(out, plot, line, s > 0 ? plot->lines[s - 1].mean : NULL, line->mean, colours[s], 0.85);
        else if (plot->has_range)
            draw_area(out, plot, line, line->low, line->high, colours[s], 0.16);
    }
    for (int s = 0; s < chart->series_count && !chart->is_stacked; s++)
        draw_curve(out, plot, &plot->lines[s], colours[s]);
}

static void draw_legend(FILE *out, const SvgChart *chart) {
    fputs("<ul class=\"legend\">", out);
    for (int i = 0; i < chart->series_count; i++) {
        int s = chart->is_stacked ? chart->series_count - 1 - i : i; /* from the top of the stack down */
        fprintf(out, "<li><i style=\"background:%s\"></i>", colours[s]);
        svg_text(out, chart->series[s].name);
        fputs("</li>", out);
    }
    fputs("</ul>", out);
}

void svg_chart(FILE *out, const SvgChart *chart) {
    Plot plot = {.count = chart->count < BUCKETS ? (int)chart->count : BUCKETS,
                 .has_range = chart->count > BUCKETS};
    plot.lines = calloc((size_t)chart->series_count + 1, sizeof *plot.lines);
    fputs("<figure><figcaption>", out);
    svg_text(out, chart->title);
    fputs("</figcaption>", out);
    if (chart->count < 2 || chart->series_count == 0 || !plot.lines) {
        fputs("<p class=\"none\">No curve: fewer than two values.</p></figure>\n", out);
        free(plot.lines);
        return;
    }
    double min, max;
    for (int s = 0; s < chart->series_count; s++)
        thin_out(chart, chart->series[s].y, plot.count, &plot.lines[s]);
    if (chart->is_stacked)
        stack(plot.lines, chart->series_count, plot.count);
    find_range(chart, &plot, &min, &max);
    plot.y = make_axis(min, max, chart->from_zero || chart->is_stacked, chart->is_logarithmic, 5);
    plot.x = make_axis(chart->x[0], chart->x[chart->count - 1], false, false, 7);
    plot.x.min = chart->x[0]; /* no empty strips beside the curves */
    plot.x.max = chart->x[chart->count - 1];
    while (plot.x.tick_count > 0 && plot.x.ticks[plot.x.tick_count - 1] > plot.x.max * (1 + 1e-9) + 1e-12)
        plot.x.tick_count--;
    while (plot.x.tick_count > 0 && plot.x.ticks[0] < plot.x.min - 1e-9 * fabs(plot.x.max))
        memmove(plot.x.ticks, plot.x.ticks + 1, (size_t)--plot.x.tick_count * sizeof *plot.x.ticks);
    fprintf(out, "<svg viewBox=\"0 0 %d %d\" role=\"img\" aria-label=\"", WIDTH, HEIGHT);
    svg_text(out, chart->title);
    fputs("\">", out);
    draw_axes(out, chart, &plot);
    draw_series(out, chart, &plot);
    fputs("</svg>", out);
    draw_legend(out, chart);
    fputs("</figure>\n", out);
    free(plot.lines);
}

/* ---- Curves with places of their own ---- */

typedef struct Point {
    double x, y;
} Point;

static int compare_points(const void *a, const void *b) {
    const Point *p = a, *q = b;
    return (p->x > q->x) - (p->x < q->x);
}

/* The points of a curve by rising x; returns how many there are. */
static size_t sort_points(const SvgCurve *curve, Point *points) {
    size_t count = 0;
    for (size_t i = 0; i < curve->count; i++)
        if (isfinite(curve->x[i]) && isfinite(curve->y[i]))
            points[count++] = (Point){curve->x[i], curve->y[i]};
    qsort(points, count, sizeof *points, compare_points);
    return count;
}

static double curve_at(const Point *points, size_t count, double x) {
    size_t next = 0;
    while (next < count && points[next].x < x)
        next++;
    if (next == count || (next == 0 && points[0].x > x))
        return NAN;
    if (points[next].x == x)
        return points[next].y;
    const Point *a = &points[next - 1], *b = &points[next];
    return a->y + (b->y - a->y) * (x - a->x) / (b->x - a->x);
}

void svg_curves(FILE *out, const SvgChart *labels, const SvgCurve *curves, int curve_count) {
    SvgChart chart = *labels;
    size_t total = 0, count = 0, kept = 0;
    for (int c = 0; c < curve_count; c++)
        total += curves[c].count;
    Point *points = malloc((total + 1) * sizeof *points);
    double *x = malloc((total + 1) * sizeof *x);
    double *y = malloc((total * (size_t)curve_count + 1) * sizeof *y);
    for (int c = 0; c < curve_count && points; c++)
        count += sort_points(&curves[c], points + count);
    if (points)
        qsort(points, count, sizeof *points, compare_points);
    for (size_t i = 0; i < count && x; i++)
        if (kept == 0 || points[i].x > x[kept - 1])
            x[kept++] = points[i].x;
    chart.x = x;
    chart.count = points && x && y ? kept : 0;
    chart.series_count = curve_count;
    for (int c = 0; c < curve_count && chart.count > 0; c++) {
        const size_t own = sort_points(&curves[c], points);
        double *series = y + (size_t)c * kept;
        for (size_t i = 0; i < kept; i++)
            series[i] = curve_at(points, own, x[i]);
        chart.series[c] = (SvgSeries){curves[c].name, series};
    }
    svg_chart(out, &chart);
    free(points);
    free(x);
    free(y);
}
