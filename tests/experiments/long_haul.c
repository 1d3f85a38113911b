/* A kilometre in one run: nothing may creep. The boat of assets/meshes in twice its size, under heading hold,
 * so that coarse particles still drag on it.
 *
 * The same again with another number of threads must be in the same bits after a fifth of the way; started
 * 100 km from the origin it must give the same statistics over half of it. A trend is the slope of a straight
 * line fitted over the run but for its first 100 m, times its length. */
#include "experiment.h"

#include "app/carensac.h"

static const double radius_default = 0.2, distance = 1000.0, warm_up = 100.0; /* m */
static const double hash_after = 200.0;                                       /* m */
static const double scale = 2.0, thrust = 20000.0, level = 2.0;               /* N, m */

typedef enum Quantity { LEVEL, COUNT, SPEED, ITERATIONS, STEP_MS, QUANTITY_COUNT } Quantity;
static const char *const names[QUANTITY_COUNT] = {"level", "particles", "speed", "iterations", "step time"};
static const char *const units[QUANTITY_COUNT] = {"m", "", "m/s", "", "ms"};

/* Sums for means and straight lines over the way sailed. */
typedef struct Line {
    double n, x, xx, y, xy;
} Line;

typedef struct Haul {
    double mean[QUANTITY_COUNT], change[QUANTITY_COUNT]; /* change along the run by the fitted line */
    double distance, wall;                               /* m, s */
    double moves;
    uint64_t hash; /* after hash_after */
} Haul;

static SkiffSim *make(const Experiment *experiment, int threads, double start) {
    SkiffDef def = skiff_def_default();
    const double r = experiment->radius;
    def.threads = threads;
    def.params.particle_radius = (float)r;
    def.params.time_step = (float)carensac_time_step(r);
    def.params.boundary_offset = 1.15f;
    def.params.escape = SKIFF_ESCAPE_REMOVE;
    def.tank.geometry.kind = SKIFF_GEOMETRY_CYLINDER;
    def.tank.geometry.radius = 6.0f;
    def.tank.geometry.height = 5.0f;
    def.tank.geometry.translation[0] = (float)start;
    def.tank.geometry.translation[1] = 2.5f;
    def.tank.wet_height = 3.5f;
    def.sea = (SkiffSeaDef){.on = true, .level = (float)level, .follow = "boat", .absorb = true};
    SkiffDriveDef drive = skiff_drive_default();
    drive.thrust = (float)thrust;
    drive.steering_torque = (float)(400.0 * pow(scale, 4));
    SkiffBodyDef boat = skiff_body_default();
    boat.name = "boat";
    boat.geometry.kind = SKIFF_GEOMETRY_MESH;
    boat.geometry.file = SKIFF_SOURCE_DIR "/assets/meshes/boat.obj";
    boat.geometry.translation[0] = (float)start;
    boat.geometry.translation[1] = (float)level;
    for (int k = 0; k < 3; k++)
        boat.geometry.scale[k] = (float)scale;
    boat.mass = (float)(1480.0 * pow(scale, 3));
    boat.drive = &drive;
    def.bodies = &boat;
    def.body_count = 1;
    SkiffSim *sim = experiment_create(&def);
    const SkiffControls ahead = {.throttle = 1.0, .hold = true};
    Err err = {0};
    experiment_need(skiff_drive_set(sim, 0, &ahead, &err), &err);
    return sim;
}

static void add(Line *line, double x, double y) {
    line->n++;
    line->x += x;
    line->xx += x * x;
    line->y += y;
    line->xy += x * y;
}

static void add_step(const SkiffSim *sim, double way, Line *lines, FileWriter *series) {
    const SkiffStats *stats = skiff_stats(sim);
    const double values[QUANTITY_COUNT] = {[LEVEL] = 2.0 * stats->mean_height,
                                           [COUNT] = stats->particles,
                                           [SPEED] = skiff_drive(sim, 0).speed,
                                           [ITERATIONS] =
                                               stats->density_iterations + stats->divergence_iterations,
                                           [STEP_MS] = stats->step_ms};
    if (series && stats->step % 20 == 0) {
        fprintf(series->stream, "%.6g", way);
        for (int q = 0; q < QUANTITY_COUNT; q++)
            fprintf(series->stream, ",%.6g", values[q]);
        fputc('\n', series->stream);
    }
    for (int q = 0; way >= warm_up && q < QUANTITY_COUNT; q++)
        add(&lines[q], way, values[q]);
}

static Haul haul(const Experiment *experiment, int threads, double start, double way, FileWriter *series) {
    SkiffSim *sim = make(experiment, threads, start);
    Line lines[QUANTITY_COUNT] = {0};
    Haul result = {.wall = experiment_clock()};
    double last[2] = {start, 0.0};
    while (result.distance < way) {
        experiment_step(sim);
        const SkiffBody boat = skiff_body(sim, 0);
        result.distance += hypot(boat.position[0] - last[0], boat.position[2] - last[1]);
        last[0] = boat.position[0];
        last[1] = boat.position[2];
        if (result.hash == 0 && result.distance >= hash_after)
            result.hash = skiff_hash(sim);
        add_step(sim, result.distance, lines, series);
        if (skiff_time(sim) > 2000.0)
            break;
    }
    for (int q = 0; q < QUANTITY_COUNT; q++) {
        const Line *line = &lines[q];
        const double slope =
            (line->n * line->xy - line->x * line->y) / (line->n * line->xx - line->x * line->x);
        result.mean[q] = line->y / line->n;
        result.change[q] = slope * (result.distance - warm_up);
    }
    SkiffWindow window = {0};
    skiff_window(sim, &window);
    result.moves = (double)window.moves;
    result.wall = experiment_clock() - result.wall;
    skiff_destroy(sim);
    return result;
}

/* What a trend and a difference of means may be. A quarter of a spacing of level; shares of the rest. Times
 * of steps are printed, not judged: the machine may be busy. */
static double allowed(const Experiment *experiment, Quantity quantity, double mean) {
    const double shares[QUANTITY_COUNT] = {[COUNT] = 0.01, [SPEED] = 0.03, [ITERATIONS] = 0.05};
    return quantity == LEVEL ? 0.5 * experiment->radius : shares[quantity] * mean;
}

int main(int argc, char **argv) {
    Experiment experiment = experiment_begin_sized("long_haul", radius_default, argc, argv);
    FileWriter series = experiment_series(&experiment, "series", "way,level,particles,speed,iterations,ms");
    const Haul near = haul(&experiment, experiment.threads, 0.0, distance, &series);
    experiment_close(&series);
    const Haul again = haul(&experiment, experiment.threads == 1 ? 2 : 1, 0.0, hash_after, NULL);
    const Haul far = haul(&experiment, experiment.threads, 1e5, 0.5 * distance, NULL);
    experiment_check(&experiment, "way sailed", near.distance, distance, 1.0, "m");
    experiment_note(&experiment, "window moves", near.moves, "");
    experiment_note(&experiment, "wall time of a run", near.wall, "s");
    for (int q = 0; q < QUANTITY_COUNT; q++) {
        char name[64];
        snprintf(name, sizeof name, "%s, mean", names[q]);
        experiment_note(&experiment, name, near.mean[q], units[q]);
        snprintf(name, sizeof name, "%s, trend", names[q]);
        if (q == STEP_MS)
            experiment_note(&experiment, name, near.change[q], units[q]);
        else
            experiment_check(&experiment, name, near.change[q], 0.0, allowed(&experiment, q, near.mean[q]),
                             units[q]);
        snprintf(name, sizeof name, "%s, mean from 100 km on", names[q]);
        if (q != STEP_MS)
            experiment_check(&experiment, name, far.mean[q], near.mean[q],
                             allowed(&experiment, q, near.mean[q]), units[q]);
    }
    experiment_check(&experiment, "states that differ with other threads", near.hash != again.hash, 0.0, 0.0,
                     "");
    return experiment_end(&experiment);
}
