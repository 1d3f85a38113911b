/* Archimedes: a box floats as deep as its density says.
 *
 * Tank 1.2 x 1.2 x 1.2 m, 23 x 13 x 23 particles of r 0.025 m; a box of 0.5 x 0.4 x 0.5 m of density ratio
 * 0.3, 0.5 and 0.8 is released 2 d above the depth of its balance and left for 6 s; the mean over the last
 * second counts. In a closed tank the level rises with the box in it, so the draft is measured from the
 * level of the time, read by gauges away from the box.
 *
 * Expected: draft = ratio * height (geometric). Tolerance half a particle distance, 0.025 m.
 *
 * Noted too: water keeps a layer away from the hull, so a body displaces more than its own volume. The
 * draft at which the hull grown by EXPERIMENT_GAP r on every side (bottom and sides) displaces its weight
 * is the "effective" one, and the layer that would explain the measured draft exactly is given in r. The
 * judgement is on the geometric draft. */
#define EXPERIMENT_OFFSET 1.15f /* bodies displace what they are, not a layer of water more */
#include "experiment.h"

static const float box_size[3] = {0.5f, 0.4f, 0.5f};

typedef struct Floating {
    double draft, level, tilt_deg, force_y, wander;
} Floating;

static Floating float_box(const Experiment *experiment, double ratio, FileWriter *series) {
    SkiffDef def = experiment_def(experiment, 0.025f, 0.003f);
    experiment_tank(&def, 1.2f, 1.2f, 1.2f);
    def.tank.open = false; /* a splash must not leave */
    const SkiffBlockDef block = experiment_block(&def, 23, 13, 23);
    /* of the filled, settled tank: volume over area, plus what the box displaces */
    const double water = 23.0 * 13.0 * 23.0 * 1e-4 / (1.15 * 1.15) + 0.025;
    const double level = water + ratio * 0.1 / 1.44;
    const float bottom = (float)(level - ratio * 0.4 + 0.1);
    const SkiffBodyDef body =
        experiment_box("box", box_size, (const float[3]){0.6f, bottom + 0.2f, 0.6f}, (float)(1000.0 * ratio));
    SkiffProbeDef gauges[4];
    static const char *const names[4] = {"a", "b", "c", "d"};
    for (int k = 0; k < 4; k++) {
        gauges[k] = skiff_probe_default();
        gauges[k].name = names[k];
        gauges[k].point[0] = k & 1 ? 1.0f : 0.2f;
        gauges[k].point[2] = k & 2 ? 1.0f : 0.2f;
    }
    def.blocks = &block;
    def.block_count = 1;
    def.bodies = &body;
    def.body_count = 1;
    def.probes = gauges;
    def.probe_count = 4;
    SkiffSim *sim = experiment_create(&def);
    Floating mean = {0};
    int count = 0;
    while (skiff_time(sim) < 6.0 - 1e-9) {
        experiment_step(sim);
        if (skiff_step_count(sim) % 10 != 0)
            continue;
        double heights[4];
        skiff_probe_read(sim, heights);
        const double surface = (heights[0] + heights[1] + heights[2] + heights[3]) / 4;
        const SkiffBody state = skiff_body(sim, 0);
        const double *q = state.rotation;
        const double up = 1.0 - 2.0 * (q[0] * q[0] + q[2] * q[2]), low = state.position[1] - 0.2;
        fprintf(series->stream, "%g,%.5g,%.5g,%.5g,%.5g,%.4g\n", ratio, skiff_time(sim), state.position[1],
                surface, surface - low, 180.0 / pi * acos(fmin(up, 1.0)));
        if (skiff_time(sim) < 5.0)
            continue;
        mean.draft += surface - low;
        mean.level += surface;
        mean.tilt_deg += 180.0 / pi * acos(fmin(up, 1.0));
        mean.wander = fmax(mean.wander, hypot(state.position[0] - 0.6, state.position[2] - 0.6));
        mean.force_y += state.force[1];
        count++;
    }
    mean.draft /= count;
    mean.level /= count;
    mean.tilt_deg /= count;
    mean.force_y /= count * skiff_body(sim, 0).mass * EXPERIMENT_G;
    skiff_destroy(sim);
    return mean;
}

/* The layer around the hull with which it displaces `volume` at `draft`, m: bisection. */
static double explaining_layer(double volume, double draft) {
    double low = -0.05, high = 0.1;
    for (int k = 0; k < 50; k++) {
        const double layer = 0.5 * (low + high), side = 0.5 + 2.0 * layer;
        if (side * side * (draft + layer) > volume)
            high = layer;
        else
            low = layer;
    }
    return low;
}

int main(int argc, char **argv) {
    Experiment experiment = experiment_begin("floating_box", argc, argv);
    FileWriter series =
        experiment_series(&experiment, "series", "ratio,t_s,centre_y_m,level_m,draft_m,tilt_deg");
    const double ratios[3] = {0.3, 0.5, 0.8};
    for (int k = 0; k < 3; k++) {
        const double ratio = ratios[k], gap = EXPERIMENT_GAP * 0.025, weight = ratio * 0.1; /* m^3 of water */
        const Floating got = float_box(&experiment, ratio, &series);
        const double effective = weight / ((0.5 + 2 * gap) * (0.5 + 2 * gap)) - gap;
        char name[96];
        snprintf(name, sizeof name, "draft, density ratio %.1f", ratio);
        experiment_check(&experiment, name, got.draft, ratio * 0.4, 0.025, "m");
        snprintf(name, sizeof name, "draft of the hull grown by 1.2 r, ratio %.1f", ratio);
        experiment_note(&experiment, name, effective, "m");
        snprintf(name, sizeof name, "layer that explains the draft, ratio %.1f", ratio);
        experiment_note(&experiment, name, explaining_layer(weight, got.draft) / 0.025, "r");
        snprintf(name, sizeof name, "lift / weight, ratio %.1f", ratio);
        experiment_note(&experiment, name, got.force_y, "");
        snprintf(name, sizeof name, "tilt, ratio %.1f", ratio);
        experiment_note(&experiment, name, got.tilt_deg, "deg");
        snprintf(name, sizeof name, "drift sideways, ratio %.1f", ratio);
        experiment_note(&experiment, name, got.wander, "m");
    }
    experiment_close(&series);
    return experiment_end(&experiment);
}
