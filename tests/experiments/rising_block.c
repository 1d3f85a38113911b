/* A light block held at the bottom of a small tank rises, leaps, and bobs: Wu et al. 2014 (Computers &
 * Fluids 100:347).
 *
 * Block 49 x 24 x 48 mm of density 800.52 in a tank of 150 x 140 mm with 52 mm of water (with the block in
 * it), r 1.25 mm (or --radius) and dt 0.8 ms (as r), volumeFactor 1 (a lattice at rest density needs little
 * settling at this size). Held for 0.3 s, then free.
 *
 * Expected: data/04_wu2014_floating_box_rise.csv. The instant of release is not sharp there (0.05 to 0.1
 * s), and a block that lies on the floor cannot rise here, as no particle fits under it; with one layer of
 * particles it takes half a second to come free: and with two it stays: layers
 * between two walls are jammed. It is held three layers above the floor (7.6 mm). So the
 * curves are laid over each other where the centre passes 30 mm on its way up, half of the rise, and compared
 * from there to 1.0 s later.
 *
 * Tolerances: height of the first peak within one particle distance, 2.5 mm: half of it for the level of
 * the water and half for the layer around the hull, the same half each that a floating box is granted.
 * RMSE of y(t): the same 2.5 mm. Times and the mean height of the bobbing are noted.
 *
 * With pressureSolver split: the default's water resists shear, and its block leaps 2 mm less high. */
#define EXPERIMENT_OFFSET 1.15f /* bodies displace what they are, not a layer of water more */
#include "experiment.h"

static const double radius_default = 0.00125;
enum { MAX_STEPS = 16000 };

static double t[MAX_STEPS], y[MAX_STEPS];

/* First time the curve rises through `level`. */
static double rise_time(const double *times, const double *heights, int count, double level) {
    for (int s = 1; s < count; s++)
        if (heights[s - 1] < level && heights[s] >= level)
            return times[s - 1] +
                   (times[s] - times[s - 1]) * (level - heights[s - 1]) / (heights[s] - heights[s - 1]);
    return NAN;
}

/* Speed on the way up through a height: mean over the millimetre to either side. */
static double rise_speed(const double *times, const double *heights, int count, double level) {
    const double side = 0.001;
    return 2.0 * side /
           (rise_time(times, heights, count, level + side) - rise_time(times, heights, count, level - side));
}

/* Index of the first extreme after `from` that nothing within 0.1 s exceeds; sign +1: maximum. -1 when there
 * is none. */
static int extreme_after(const double *times, const double *heights, int count, double from, double sign) {
    for (int s = 0; s < count; s++) {
        bool best = times[s] > from && times[s] + 0.1 < times[count - 1];
        for (int o = 0; best && o < count; o++)
            best = fabs(times[o] - times[s]) > 0.1 || sign * heights[o] <= sign * heights[s];
        if (best)
            return s;
    }
    return -1;
}

/* Height at a time, from the series of steps. */
static double height_at(const double *times, const double *heights, int count, double time) {
    for (int s = 0; s < count; s++)
        if (times[s] >= time)
            return heights[s];
    return heights[count - 1];
}

static int layers(float length, float r) {
    return (int)lroundf(length / (2 * r));
}

static int simulate(const Experiment *experiment) {
    const float r = (float)experiment->radius, gap = EXPERIMENT_GAP * r;
    SkiffDef def = experiment_def(experiment, r, 0.64f * r);
    def.params.volume_factor = 1.0f;
    experiment_tank(&def, 0.150f, 0.14f, 0.140f);
    def.tank.open = false;
    SkiffBodyDef body = experiment_box("block", (const float[3]){0.049f, 0.024f, 0.048f},
                                       (const float[3]){0.075f, 0.012f + 2 * gap + 6 * r, 0.070f}, 800.52f);
    body.release_time = 0.3;
    def.bodies = &body;
    def.body_count = 1;
    def.block_count = 1;
    /* what the experiment gives is the depth, so the depth is met: a gap and 52.5 mm of layers, from wall to
     * wall */
    const SkiffBlockDef block =
        experiment_block(&def, layers(0.150f, r), layers(0.0525f, r), layers(0.140f, r));
    def.blocks = &block;
    SkiffSim *sim = experiment_create(&def);
    printf("%u particles, surface at %.1f mm\n", skiff_particles(sim).count, 1e3 * (double)block.end[1]);
    int count = 0;
    while (skiff_time(sim) < 2.0 && count < MAX_STEPS) {
        experiment_step(sim);
        t[count] = skiff_time(sim);
        y[count++] = skiff_body(sim, 0).position[1];
    }
    skiff_destroy(sim);
    return count;
}

int main(int argc, char **argv) {
    Experiment experiment = experiment_begin_sized("rising_block", radius_default, argc, argv);
    const ExperimentCurve wu = experiment_curve("04_wu2014_floating_box_rise.csv", NULL, 0, 1);
    if (experiment.solver < 0)
        experiment.solver = SKIFF_SOLVER_SPLIT;
    const int count = simulate(&experiment);
    const double there = rise_time(wu.x, wu.y, wu.count, 0.030), here = rise_time(t, y, count, 0.030);
    FileWriter series = experiment_series(&experiment, "series", "t_s,y_m,experiment_y_m");
    double sum = 0.0;
    int used = 0;
    for (int s = 0; s < count; s++) {
        const double expected = experiment_curve_at(&wu, t[s] - here + there);
        fprintf(series.stream, "%.5g,%.5g,%.5g\n", t[s] - here, y[s], expected);
        if (isnan(expected) || t[s] < here || t[s] > here + 1.0)
            continue;
        sum += (y[s] - expected) * (y[s] - expected);
        used++;
    }
    experiment_close(&series);
    const int peak = extreme_after(t, y, count, here, 1.0),
              wu_peak = extreme_after(wu.x, wu.y, wu.count, there, 1.0);
    experiment_check(&experiment, "height of the first peak", peak < 0 ? NAN : y[peak], wu.y[wu_peak], 0.0025,
                     "m");
    experiment_limit(&experiment, "RMSE of y(t), 1 s from 30 mm on", used > 0 ? sqrt(sum / used) : NAN,
                     0.0025, "m");
    if (peak >= 0) {
        const int next = extreme_after(t, y, count, t[peak] + 0.1, 1.0);
        const int wu_next = extreme_after(wu.x, wu.y, wu.count, wu.x[wu_peak] + 0.1, 1.0);
        experiment_note(&experiment, "time from 30 mm to the peak", t[peak] - here, "s");
        experiment_note(&experiment, "the same in the experiment", wu.x[wu_peak] - there, "s");
        experiment_note(&experiment, "peak to next peak", next < 0 ? NAN : t[next] - t[peak], "s");
        experiment_note(&experiment, "the same in the experiment", wu.x[wu_next] - wu.x[wu_peak], "s");
    }
    double mean = 0.0, wu_mean = 0.0;
    for (int k = 0; k < 100; k++) {
        mean += height_at(t, y, count, here + 0.55 + 0.007 * k) / 100;
        wu_mean += experiment_curve_at(&wu, there + 0.55 + 0.007 * k) / 100;
    }
    experiment_note(&experiment, "mean height, 0.55 to 1.25 s after 30 mm", mean, "m");
    experiment_note(&experiment, "the same in the experiment", wu_mean, "m");
    experiment_note(&experiment, "time from the release to 30 mm", here - 0.3, "s");
    experiment_note(&experiment, "speed at 30 mm", rise_speed(t, y, count, 0.030), "m/s");
    experiment_note(&experiment, "the same in the experiment", rise_speed(wu.x, wu.y, wu.count, 0.030),
                    "m/s");
    return experiment_end(&experiment);
}
