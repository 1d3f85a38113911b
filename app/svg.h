/* Line and area charts as inline SVG with an HTML legend. No scripts, no external files. */
#ifndef SKIFF_APP_SVG_H
#define SKIFF_APP_SVG_H

#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>

enum { SVG_MAX_SERIES = 12 };

typedef struct SvgSeries {
    const char *name;
    const double *y; /* SvgChart.count values; NaN: no value there */
} SvgSeries;

typedef struct SvgChart {
    const char *title, *x_label, *y_label; /* labels with their unit */
    const double *x;                       /* rising */
    size_t count;
    SvgSeries series[SVG_MAX_SERIES];
    int series_count;
    bool is_stacked;     /* areas on top of each other, from 0 */
    bool is_logarithmic; /* of base 10; values at or below 0 lie on the lower edge */
    bool from_zero;      /* the axis includes 0 */
} SvgChart;

/* Writes a <figure>. Long series are shown as mean and, where they are not stacked, range of each of a few
 * hundred intervals. */
void svg_chart(FILE *out, const SvgChart *chart);

/* A curve with places of its own, in any order. */
typedef struct SvgCurve {
    const char *name;
    const double *x, *y; /* NaN in either: no point */
    size_t count;
} SvgCurve;

/* Curves that share no x: like svg_chart with `labels` for title, labels and scales (its data are not used).
 * Between its points a curve is straight. At most SVG_MAX_SERIES. */
void svg_curves(FILE *out, const SvgChart *labels, const SvgCurve *curves, int curve_count);

/* Writes text with HTML's special characters escaped. */
void svg_text(FILE *out, const char *text);

#endif
