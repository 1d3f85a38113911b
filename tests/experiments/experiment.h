/* What every experiment shares: command line, defs of boxes, a table of judged figures, series for plots.
 *
 * A program judges each figure once:
 *   experiment_check   |measured - expected| <= tolerance         decides the exit status
 *   experiment_limit   measured <= limit                          decides the exit status
 *   experiment_aim     measured against an aim                    printed MET or MISSED, decides nothing
 *   experiment_note    a figure without a judgement
 * The same rows go to DIR/NAME.csv. Exit status: 0 when every judged figure passes, 1 when one fails, else
 * the engine's error code. */
#ifndef EXPERIMENT_H
#define EXPERIMENT_H

#include "base/angle.h"
#include "base/file.h"
#include "skiff.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#define EXPERIMENT_G 9.81 /* m/s^2, the default gravity of the engine */

typedef struct Experiment {
    const char *name;
    const char *folder;
    int threads;
    int solver;    /* SKIFF_SOLVER_*, the option --solver; -1: not given */
    double radius; /* m; of programs that take --radius */
    int failures;
    double start; /* s, monotonic */
    FileWriter table;
} Experiment;

/* ---- Life of a program ---- */

static inline double experiment_clock(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

/* Prints the message and leaves with its code when `good` is false. */
static inline void experiment_need(bool good, const Err *err) {
    if (good)
        return;
    fprintf(stderr, "%s\n", err->message);
    exit((int)err->code);
}

/* Value of the setting pressureSolver named `name`, -1: none. */
static inline int experiment_solver(const char *name) {
    int count;
    const SkiffParamInfo *info = skiff_param_infos(&count);
    while (count-- > 0 && strcmp(info->key, "pressureSolver") != 0)
        info++;
    const size_t length = strlen(name);
    int value = 0;
    for (const char *at = info->names;; at = strchr(at, '|') + 1, value++) {
        if (strncmp(at, name, length) == 0 && (at[length] == '|' || at[length] == '\0'))
            return value;
        if (strchr(at, '|') == NULL)
            return -1;
    }
}

/* With --radius R for particles of another size than `radius`; NaN: there is no such option. */
static inline Experiment experiment_begin_sized(const char *name, double radius, int argc, char **argv) {
    Experiment experiment = {.name = name,
                             .folder = "out/experiments",
                             .threads = 1,
                             .solver = -1,
                             .radius = radius,
                             .start = experiment_clock()};
    for (int k = 1; k < argc; k++) {
        const bool has_value = k + 1 < argc;
        if (has_value && strcmp(argv[k], "--threads") == 0) {
            experiment.threads = atoi(argv[++k]);
        } else if (has_value && strcmp(argv[k], "--out") == 0) {
            experiment.folder = argv[++k];
        } else if (has_value && strcmp(argv[k], "--solver") == 0 && experiment_solver(argv[k + 1]) >= 0) {
            experiment.solver = experiment_solver(argv[++k]);
        } else if (has_value && !isnan(radius) && strcmp(argv[k], "--radius") == 0) {
            experiment.radius = atof(argv[++k]);
        } else {
            fprintf(stderr, "usage: exp_%s [--threads N] [--out DIR] [--solver NAME]%s\n", name,
                    isnan(radius) ? "" : " [--radius R]");
            exit(ERR_USAGE);
        }
    }
    Err err = {0};
    char path[4096];
    snprintf(path, sizeof path, "%s/%s.csv", experiment.folder, name);
    experiment_need(file_make_directory(experiment.folder, &err) && file_begin(&experiment.table, path, &err),
                    &err);
    fprintf(experiment.table.stream, "name,measured,expected,tolerance,unit,verdict\n");
    setvbuf(stdout, NULL, _IOLBF, 0);
    printf("%s\n%-52s %12s %12s %12s %-7s\n", name, "", "measured", "expected", "tolerance", "unit");
    return experiment;
}

static inline Experiment experiment_begin(const char *name, int argc, char **argv) {
    return experiment_begin_sized(name, (double)NAN, argc, argv);
}

static inline int experiment_end(Experiment *experiment) {
    Err err = {0};
    experiment_need(file_commit(&experiment->table, &err), &err);
    printf("%s: %d failed, wall time %.1f s\n", experiment->name, experiment->failures,
           experiment_clock() - experiment->start);
    return experiment->failures > 0;
}

/* ---- Judgement ---- */

static inline void experiment_row(Experiment *experiment, const char *name, double measured, double expected,
                                  double tolerance, const char *unit, const char *verdict) {
    char texts[2][32] = {"", ""};
    const double numbers[2] = {expected, tolerance};
    for (int k = 0; k < 2; k++)
        if (!isnan(numbers[k]))
            snprintf(texts[k], sizeof texts[k], "%.6g", numbers[k]);
    printf("%-52s %12.6g %12s %12s %-7s %s\n", name, measured, texts[0], texts[1], unit, verdict);
    fprintf(experiment->table.stream, "\"%s\",%.9g,%s,%s,%s,%s\n", name, measured, texts[0], texts[1], unit,
            verdict);
}

static inline void experiment_check(Experiment *experiment, const char *name, double measured,
                                    double expected, double tolerance, const char *unit) {
    const bool good = fabs(measured - expected) <= tolerance;
    experiment->failures += !good;
    experiment_row(experiment, name, measured, expected, tolerance, unit, good ? "PASS" : "FAIL");
}

static inline void experiment_limit(Experiment *experiment, const char *name, double measured, double limit,
                                    const char *unit) {
    const bool good = measured <= limit;
    char text[128];
    snprintf(text, sizeof text, "%s <=", name);
    experiment->failures += !good;
    experiment_row(experiment, text, measured, limit, NAN, unit, good ? "PASS" : "FAIL");
}

static inline void experiment_within(Experiment *experiment, const char *name, double measured, double low,
                                     double high, const char *unit) {
    experiment_check(experiment, name, measured, 0.5 * (low + high), 0.5 * (high - low), unit);
}

static inline void experiment_aim(Experiment *experiment, const char *name, double measured, double aim,
                                  bool more_is_better, const char *unit) {
    const bool met = more_is_better ? measured >= aim : measured <= aim;
    char text[128];
    snprintf(text, sizeof text, "%s, aim %s", name, more_is_better ? ">=" : "<=");
    experiment_row(experiment, text, measured, aim, NAN, unit, met ? "MET" : "MISSED");
}

static inline void experiment_note(Experiment *experiment, const char *name, double measured,
                                   const char *unit) {
    experiment_row(experiment, name, measured, NAN, NAN, unit, "note");
}

/* ---- Series for plots: DIR/NAME_WHAT.csv ---- */

static inline FileWriter experiment_series(const Experiment *experiment, const char *what,
                                           const char *header) {
    Err err = {0};
    FileWriter writer;
    char path[4096];
    snprintf(path, sizeof path, "%s/%s_%s.csv", experiment->folder, experiment->name, what);
    experiment_need(file_begin(&writer, path, &err), &err);
    fprintf(writer.stream, "%s\n", header);
    return writer;
}

static inline void experiment_close(FileWriter *writer) {
    Err err = {0};
    experiment_need(file_commit(writer, &err), &err);
}

/* ---- Reference data: tests/experiments/data ---- */

enum { EXPERIMENT_MAX_ROWS = 512 };

typedef struct ExperimentCurve {
    int count;
    double x[EXPERIMENT_MAX_ROWS], y[EXPERIMENT_MAX_ROWS];
} ExperimentCurve;

/* Two columns of a CSV of numbers; lines that begin with # and the header are skipped. With `key`, only rows
 * whose first column is `key`. */
static inline ExperimentCurve experiment_curve(const char *file, const char *key, int x_column,
                                               int y_column) {
    char path[4096], line[1024];
    snprintf(path, sizeof path, "%s/tests/experiments/data/%s", SKIFF_SOURCE_DIR, file);
    FILE *stream = fopen(path, "r");
    if (stream == NULL) {
        fprintf(stderr, "%s: cannot be opened\n", path);
        exit(ERR_INPUT);
    }
    ExperimentCurve curve = {0};
    bool header = true;
    while (fgets(line, sizeof line, stream) && curve.count < EXPERIMENT_MAX_ROWS) {
        if (line[0] == '#')
            continue;
        double values[2] = {NAN, NAN};
        bool wanted = !header;
        header = false;
        int column = 0;
        for (char *rest = line, *cell; (cell = strsep(&rest, ",\n")) != NULL; column++) {
            if (column == 0 && key != NULL && strcmp(cell, key) != 0)
                wanted = false;
            if (column == x_column)
                values[0] = atof(cell);
            if (column == y_column)
                values[1] = atof(cell);
        }
        if (!wanted)
            continue;
        curve.x[curve.count] = values[0];
        curve.y[curve.count++] = values[1];
    }
    fclose(stream);
    if (curve.count == 0) {
        fprintf(stderr, "%s: no data\n", path);
        exit(ERR_INPUT);
    }
    return curve;
}

/* Linear between the points; NAN outside. */
static inline double experiment_curve_at(const ExperimentCurve *curve, double x) {
    for (int k = 0; k + 1 < curve->count; k++)
        if (x >= curve->x[k] && x <= curve->x[k + 1])
            return curve->y[k] + (curve->y[k + 1] - curve->y[k]) * (x - curve->x[k]) /
                                     fmax(curve->x[k + 1] - curve->x[k], 1e-12);
    return NAN;
}

/* ---- Defs ---- */

/* Water keeps 1.2 r from the samples of walls and bodies, which lie EXPERIMENT_OFFSET r behind the true
 * surface (boundaryOffset; a program may define it before this header). A lattice of rest density
 * (volumeFactor 1) whose cells end 1.2 r from the samples starts with every density within 0.3 % of rest;
 * at 1.0 r the corners start 15 % too dense, at 0 they explode. */
#ifndef EXPERIMENT_OFFSET
#define EXPERIMENT_OFFSET 0.0f
#endif
#define EXPERIMENT_GAP (1.2f - EXPERIMENT_OFFSET)

static inline SkiffDef experiment_def(const Experiment *experiment, float radius, float dt) {
    SkiffDef def = skiff_def_default();
    def.params.boundary_offset = EXPERIMENT_OFFSET;
    def.threads = experiment->threads;
    if (experiment->solver >= 0)
        def.params.pressure_solver = experiment->solver;
    def.params.particle_radius = radius;
    def.params.time_step = dt;
    return def;
}

/* An open box with its floor at y = 0 and a corner in the origin. */
static inline void experiment_tank(SkiffDef *def, float x, float y, float z) {
    def->tank.geometry.kind = SKIFF_GEOMETRY_BOX;
    const float size[3] = {x, y, z};
    for (int k = 0; k < 3; k++) {
        def->tank.geometry.size[k] = size[k];
        def->tank.geometry.translation[k] = size[k] / 2;
    }
    def->tank.open = true;
}

/* nx x ny x nz particles on the lattice, in the middle of the tank and a gap above its floor. */
static inline SkiffBlockDef experiment_block(const SkiffDef *def, int nx, int ny, int nz) {
    SkiffBlockDef block = skiff_block_default();
    const int counts[3] = {nx, ny, nz};
    const float r = def->params.particle_radius;
    for (int k = 0; k < 3; k++) {
        const float length = 2.0f * r * (float)counts[k];
        block.start[k] = k == 1 ? EXPERIMENT_GAP * r : def->tank.geometry.translation[k] - length / 2;
        block.end[k] = block.start[k] + length;
    }
    return block;
}

/* Against the wall at x = 0. */
static inline void experiment_block_to_wall(const SkiffDef *def, SkiffBlockDef *block) {
    const float shift = block->start[0] - EXPERIMENT_GAP * def->params.particle_radius;
    block->start[0] -= shift;
    block->end[0] -= shift;
}

static inline SkiffBodyDef experiment_box(const char *name, const float size[3], const float centre[3],
                                          float density) {
    SkiffBodyDef body = skiff_body_default();
    body.name = name;
    body.geometry.kind = SKIFF_GEOMETRY_BOX;
    memcpy(body.geometry.size, size, sizeof body.geometry.size);
    memcpy(body.geometry.translation, centre, sizeof body.geometry.translation);
    body.density = density;
    return body;
}

static inline SkiffSim *experiment_create(const SkiffDef *def) {
    Err err = {0};
    SkiffSim *sim = skiff_create(def, &err);
    experiment_need(sim != NULL, &err);
    return sim;
}

static inline void experiment_step(SkiffSim *sim) {
    Err err = {0};
    experiment_need(skiff_step(sim, &err), &err);
}

/* Steps until `time`, s. */
static inline void experiment_run(SkiffSim *sim, double time) {
    while (skiff_time(sim) < time - 1e-9)
        experiment_step(sim);
}

/* ---- Measures ---- */

static inline double experiment_particle_volume(const SkiffSim *sim) {
    const double d = 2.0 * (double)skiff_params(sim)->particle_radius;
    return (double)skiff_params(sim)->volume_factor * d * d * d;
}

/* The column of water a set of particles stands for.
 *
 * Particles keep about r from walls, so water stands higher than volume over the tank's area. The water's own
 * extent is taken from its second moments: points spread evenly over a width w have a variance of w^2 / 12.
 * With the area from the two horizontal widths, height = volume / area, and the surface lies half a height
 * above the mean height. No wall gap, no surface search and no threshold enters. */
typedef struct ExperimentColumn {
    double width_x, width_z, height; /* m */
    double surface, floor;           /* y, m */
    double volume;                   /* m^3 */
} ExperimentColumn;

static inline ExperimentColumn experiment_column(const SkiffSim *sim) {
    const SkiffParticles particles = skiff_particles(sim);
    double sum[3] = {0}, sum_sq[3] = {0};
    for (uint32_t i = 0; i < particles.count; i++)
        for (int k = 0; k < 3; k++) {
            const double x = (double)particles.position[i][k] + particles.origin[k];
            sum[k] += x;
            sum_sq[k] += x * x;
        }
    const double n = particles.count > 0 ? particles.count : 1.0;
    double width[3];
    for (int k = 0; k < 3; k++)
        width[k] = sqrt(12.0 * fmax(sum_sq[k] / n - sum[k] / n * (sum[k] / n), 0.0));
    ExperimentColumn column = {.width_x = width[0], .width_z = width[2]};
    column.volume = n * experiment_particle_volume(sim);
    column.height = column.volume / (width[0] * width[2]);
    column.surface = sum[1] / n + column.height / 2;
    column.floor = column.surface - column.height;
    return column;
}

/* Velocities may be written between two steps; the engine keeps nothing that would contradict them but its
 * warm start. The one place where an experiment changes what the public interface only shows. */
static inline float (*experiment_velocities(const SkiffSim *sim))[4] {
    return (float(*)[4])(uintptr_t)skiff_particles(sim).velocity;
}

#endif
