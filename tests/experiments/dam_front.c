/* The front of a collapsing column runs as fast as measured.
 *
 * Column of L = 0.146 m by H = 0.292 m (Koshizuka & Oka 1996; Martin & Moyce 1952 used the same
 * proportion) in a narrow tank without friction, eight particles wide, long enough that the front meets no
 * wall; r 0.0025 m, dt 0.4 ms. volumeFactor 1: the lattice is at rest density, has the column's volume and
 * needs no settling. The front is where the last eight particles begin, one row across the tank, so that
 * no single drop makes it.
 *
 * Expected: data/02_dambreak_front_martinmoyce_koshizuka.csv, x* = (x - L) / H against t* = t sqrt(g / H).
 * Six digitised experiments of it make the envelope, wherever two of them at least cover a time; the
 * computed rows are left out. Inside means not farther out than one particle distance, d / H = 0.017,
 * which is what the front of a particle method is known to.
 *
 * Noted too: the distance from a computed, frictionless front (MPS, same file), and the result if the
 * clocks of the experiments had started late by what others grant them for the gate (0.175 in T, 0.0875 in
 * t*). */
#include "experiment.h"

enum { SETS = 6 };

static const char *const sets[SETS] = {"MartinMoyce1952_a1.125in_n2=2",
                                       "MartinMoyce1952_a2.25in_n2=2",
                                       "KoshizukaOka1996_exp_L0.146_H0.292",
                                       "DualSPHysics_EXP_file_labelled_KoshizukaOka1996_L1_H2",
                                       "MartinMoyce1952_H0.114",
                                       "MartinMoyce1952_H0.057"};

enum { ROW = 8 };

static double front(const SkiffSim *sim) {
    const SkiffParticles particles = skiff_particles(sim);
    double foremost[ROW] = {0}; /* descending */
    for (uint32_t i = 0; i < particles.count; i++) {
        double x = (double)particles.position[i][0];
        for (int k = 0; k < ROW && x > foremost[ROW - 1]; k++)
            if (x > foremost[k]) {
                const double smaller = foremost[k];
                foremost[k] = x;
                x = smaller;
            }
    }
    return foremost[ROW - 1] + (double)skiff_params(sim)->particle_radius;
}

/* False where fewer than two experiments cover the time. */
static bool envelope(const ExperimentCurve *curves, double t, double *low, double *high) {
    int covered = 0;
    *low = INFINITY;
    *high = -INFINITY;
    for (int k = 0; k < SETS; k++) {
        const double x = experiment_curve_at(&curves[k], t);
        if (isnan(x))
            continue;
        covered++;
        *low = fmin(*low, x);
        *high = fmax(*high, x);
    }
    return covered >= 2;
}

int main(int argc, char **argv) {
    Experiment experiment = experiment_begin("dam_front", argc, argv);
    const double length = 0.146, height = 0.292, scale = sqrt(EXPERIMENT_G / height);
    SkiffDef def = experiment_def(&experiment, 0.0025f, 0.0004f);
    def.params.volume_factor = 1.0f;
    const float r = def.params.particle_radius, gap = EXPERIMENT_GAP * r;
    const int nx = (int)((length - (double)gap) / (2 * (double)r) + 0.5), nz = ROW;
    /* as many layers as the volume of the experiment's column needs, per width of water */
    const int ny = (int)(length * height / (nx * 4.0 * (double)r * (double)r) + 0.5);
    experiment_tank(&def, 1.3f, 0.4f, 2 * r * (float)nz + 2 * gap);
    SkiffBlockDef block = experiment_block(&def, nx, ny, nz);
    experiment_block_to_wall(&def, &block);
    def.blocks = &block;
    def.block_count = 1;
    SkiffSim *sim = experiment_create(&def);
    const ExperimentCurve curves[SETS] = {
        experiment_curve("02_dambreak_front_martinmoyce_koshizuka.csv", sets[0], 1, 2),
        experiment_curve("02_dambreak_front_martinmoyce_koshizuka.csv", sets[1], 1, 2),
        experiment_curve("02_dambreak_front_martinmoyce_koshizuka.csv", sets[2], 1, 2),
        experiment_curve("02_dambreak_front_martinmoyce_koshizuka.csv", sets[3], 1, 2),
        experiment_curve("02_dambreak_front_martinmoyce_koshizuka.csv", sets[4], 1, 2),
        experiment_curve("02_dambreak_front_martinmoyce_koshizuka.csv", sets[5], 1, 2)};
    experiment_note(&experiment, "particles", skiff_particles(sim).count, "");
    FileWriter series = experiment_series(&experiment, "series", "tstar,xstar,lowest,highest");
    const ExperimentCurve mps = experiment_curve("02_dambreak_front_martinmoyce_koshizuka.csv",
                                                 "KoshizukaOka1996_MPS_computed", 1, 2);
    double behind = 0.0, ahead = 0.0, ahead_late = 0.0, computed = 0.0;
    int inside = 0, all = 0;
    while (skiff_time(sim) * scale < 2.9) {
        experiment_step(sim);
        const double t = skiff_time(sim) * scale, x = (front(sim) - length) / height;
        double low, high;
        if (!isnan(experiment_curve_at(&mps, t)))
            computed = fmax(computed, fabs(x - experiment_curve_at(&mps, t)));
        if (envelope(curves, t + 0.0875, &low, &high))
            ahead_late = fmax(ahead_late, x - high);
        if (!envelope(curves, t, &low, &high))
            continue;
        fprintf(series.stream, "%.5g,%.5g,%.5g,%.5g\n", t, x, low, high);
        behind = fmax(behind, low - x);
        ahead = fmax(ahead, x - high);
        inside += x >= low && x <= high;
        all++;
    }
    experiment_close(&series);
    const double d = 2.0 * (double)r / height;
    experiment_limit(&experiment, "x* behind the envelope, farthest", behind, d, "");
    experiment_limit(&experiment, "x* ahead of the envelope, farthest", ahead, d, "");
    experiment_note(&experiment, "x* ahead, experiments' clocks 0.0875 later", ahead_late, "");
    experiment_note(&experiment, "x* from the computed front (MPS), farthest", computed, "");
    experiment_note(&experiment, "share of the time inside it", 100.0 * inside / all, "%");
    skiff_destroy(sim);
    return experiment_end(&experiment);
}
