/* Dam break against a box: SPHERIC test 2, the MARIN experiment of Kleefsman et al. 2005 (J. Comput. Phys.
 * 206:363-393).
 *
 * Tank 3.22 x 1 x 1 m, column of 1.228 x 1 x 0.55 m at its right end, static box of 0.161 x 0.403 x 0.161
 * m; gauges H1..H4 and sensors P1..P8 as in figures 6 and 7 of the test's description. r 0.0125 m, dt 1 ms
 * (0.2 of d at the largest speed, 5 m/s), 2 s. volumeFactor 1: a lattice at rest density has the column's
 * volume and needs no settling; its cells end EXPERIMENT_GAP r from the walls, where the engine keeps
 * water anyway, and it is given as many layers as the volume of the experiment's column needs. There is no
 * gate.
 *
 * Expected: data/01_kleefsman_heights_50hz.csv and 01_kleefsman_pressures.csv (columns of heights follow
 * figure 6). H2 and H4 within an RMSE of 0.04 m over 2 s; P1 above 300 Pa first at 0.393 +- 0.03 s; its
 * impulse from 0.38 to 1.0 s 2901 Pa s +- 20 %. */
#include "experiment.h"

enum { GAUGES = 4, SENSORS = 8, STEPS = 2000 };

static const float gauge_x[GAUGES] = {0.496f, 0.992f, 1.488f, 2.638f};
static const float sensor_place[SENSORS][2] = {{0.8245f, 0.021f}, {0.8245f, 0.061f}, {0.8245f, 0.101f},
                                               {0.8245f, 0.141f}, {0.8035f, 0.161f}, {0.7635f, 0.161f},
                                               {0.7235f, 0.161f}, {0.6835f, 0.161f}};
static double times[STEPS], values[STEPS][GAUGES + SENSORS];

static void add_instruments(SkiffDef *def, SkiffProbeDef *probes) {
    static const char *const names[GAUGES + SENSORS] = {"H1", "H2", "H3", "H4", "P1", "P2",
                                                        "P3", "P4", "P5", "P6", "P7", "P8"};
    for (int k = 0; k < GAUGES + SENSORS; k++) {
        probes[k] = skiff_probe_default();
        probes[k].name = names[k];
        if (k < GAUGES) {
            probes[k].point[0] = gauge_x[k];
            probes[k].point[2] = 0.5f;
        } else {
            probes[k].kind = SKIFF_PROBE_PRESSURE;
            probes[k].object = "obstacle";
            probes[k].radius =
                0.03f; /* a patch of three samples' width; the real sensors are smaller than d */
            probes[k].point[0] = sensor_place[k - GAUGES][0];
            probes[k].point[1] = sensor_place[k - GAUGES][1];
            probes[k].point[2] = 0.2985f + 0.176f;
        }
    }
    def->probes = probes;
    def->probe_count = GAUGES + SENSORS;
}

static void simulate(const Experiment *experiment) {
    SkiffDef def = experiment_def(experiment, 0.0125f, 0.001f);
    const float r = def.params.particle_radius;
    def.params.volume_factor = 1.0f;
    def.params.escape = SKIFF_ESCAPE_REMOVE; /* splashes over the rim are lost, as in the experiment; they are
                                                counted below */
    experiment_tank(&def, 3.22f, 1.0f, 1.0f);
    const float gap = EXPERIMENT_GAP * r, width = 1.0f - 2.0f * gap, length = 1.228f - gap;
    const int nx = (int)(length / (2 * r) + 0.5f), nz = (int)(width / (2 * r) + 0.5f);
    const double layers = 1.228 * 0.55 / (nx * nz * pow(2.0 * (double)r, 2)) / (2.0 * (double)r);
    SkiffBlockDef block = experiment_block(&def, nx, (int)(layers + 0.5), nz);
    const float shift = 3.22f - gap - block.end[0];
    block.start[0] += shift;
    block.end[0] += shift;
    SkiffBodyDef obstacle = experiment_box("obstacle", (const float[3]){0.161f, 0.161f, 0.403f},
                                           (const float[3]){0.744f, 0.0805f, 0.5f}, 1000.0f);
    obstacle.free_axes = 0;
    SkiffProbeDef probes[GAUGES + SENSORS];
    add_instruments(&def, probes);
    def.blocks = &block;
    def.block_count = 1;
    def.bodies = &obstacle;
    def.body_count = 1;
    SkiffSim *sim = experiment_create(&def);
    printf("%u particles, column %.3f m high\n", skiff_particles(sim).count,
           (double)(block.end[1] - block.start[1]));
    FileWriter series = experiment_series(experiment, "probes", "t_s,H1,H2,H3,H4,P1,P2,P3,P4,P5,P6,P7,P8");
    for (int s = 0; s < STEPS; s++) {
        experiment_step(sim);
        times[s] = skiff_time(sim);
        skiff_probe_read(sim, values[s]);
        fprintf(series.stream, "%.5g", times[s]);
        for (int k = 0; k < GAUGES + SENSORS; k++)
            fprintf(series.stream, ",%.6g", values[s][k]);
        fprintf(series.stream, "\n");
    }
    experiment_close(&series);
    printf("%u particles at the end\n", skiff_particles(sim).count);
    skiff_destroy(sim);
}

/* RMSE over 2 s at the times of the experiment. */
static double height_error(int gauge) {
    const ExperimentCurve curve = experiment_curve("01_kleefsman_heights_50hz.csv", NULL, 0, 1 + gauge);
    double sum = 0.0;
    int used = 0;
    for (int s = 0; s < STEPS; s++) {
        const double expected = experiment_curve_at(&curve, times[s]);
        if (isnan(expected))
            continue;
        sum += (values[s][gauge] - expected) * (values[s][gauge] - expected);
        used++;
    }
    return sqrt(sum / used);
}

/* First time above 300 Pa and impulse from 0.38 to 1.0 s of a sensor. */
static void pressure_figures(int sensor, double *arrival, double *impulse) {
    *arrival = NAN;
    *impulse = 0.0;
    for (int s = 0; s < STEPS; s++) {
        const double p = values[s][GAUGES + sensor];
        if (isnan(*arrival) && p > 300.0)
            *arrival = times[s];
        if (times[s] > 0.38 && times[s] <= 1.0)
            *impulse += p * (s > 0 ? times[s] - times[s - 1] : times[s]);
    }
}

int main(int argc, char **argv) {
    Experiment experiment = experiment_begin("dam_kleefsman", argc, argv);
    simulate(&experiment);
    static const bool judged[GAUGES] = {false, true, false, true};
    char name[64];
    for (int k = 0; k < GAUGES; k++) {
        snprintf(name, sizeof name, "H%d, RMSE over 2 s", k + 1);
        if (judged[k])
            experiment_limit(&experiment, name, height_error(k), 0.04, "m");
        else
            experiment_note(&experiment, name, height_error(k), "m");
    }
    /* of the experiment: 01_kleefsman_summary, rows P1 to P4 */
    static const double arrivals[4] = {0.393026, 0.410016, 0.423029, 0.429019};
    static const double impulses[4] = {2901.42, 2512.33, 2384.3, 2029.65};
    for (int k = 0; k < 4; k++) {
        double arrival, impulse;
        pressure_figures(k, &arrival, &impulse);
        if (k == 0) {
            experiment_check(&experiment, "P1, first time above 300 Pa", arrival, 0.393, 0.03, "s");
            experiment_check(&experiment, "P1, impulse from 0.38 to 1.0 s", impulse, 2901.0, 0.2 * 2901.0,
                             "Pa s");
            continue;
        }
        snprintf(name, sizeof name, "P%d, arrival - experiment", k + 1);
        experiment_note(&experiment, name, arrival - arrivals[k], "s");
        snprintf(name, sizeof name, "P%d, impulse / experiment", k + 1);
        experiment_note(&experiment, name, impulse / impulses[k], "");
    }
    return experiment_end(&experiment);
}
