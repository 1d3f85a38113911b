/* Standing waves: how fast they swing, and how much of them each swing loses.
 *
 * Two tanks 0.5 m wide, r 0.025 m, dt 3 ms: L 2.35 m with about 0.5 m of water, L 1.2 m with about 1 m.
 * After 4 s of settling every particle is given the velocity of the first linear standing wave, u = -U
 * sin(kx) cosh(kY) / sinh(kh), v = U cos(kx) sinh(kY) / sinh(kh), Y above the floor, k = pi / length,
 * released from a flat surface. U is chosen for an amplitude of 0.1 h, the largest for which the reference
 * data call the theory linear. Each step the velocities are projected on that mode; what the mode's
 * velocity does is q(t) = exp(-t/tau) cos(w t).
 *
 * Expected: T = 2 pi / sqrt(g k tanh kh) with the length and depth of the water itself (ExperimentColumn:
 * walls keep it about r away), tolerance 3 %. The theory is inviscid: all amplitude should be kept, apart
 * from exp(-2 nu k^2 T), below 0.1 % in real water. Aim: at least 0.90 a period. That is a known open
 * problem of the method, printed as met or missed and not judged.
 *
 * With pressureSolver split, whose purpose this is; --solver gcr shows the default: too fast by 4 to 5 %, and
 * 0.80 kept.
 *
 * Two more runs judge nothing and show where deviations come from: half the amplitude (a period that
 * shortens with the amplitude is the mark of water that resists small shear like a solid, see vortex.c)
 * and no viscosity. */
#include "experiment.h"

enum { MAX_STEPS = 6000 };

typedef struct Mode {
    double k, depth, left, floor;
} Mode;

static void mode_velocity(const Mode *mode, const float *x, double v[2]) {
    const double a = mode->k * ((double)x[0] - mode->left), b = mode->k * ((double)x[1] - mode->floor);
    const double scale = 1.0 / sinh(mode->k * mode->depth);
    v[0] = -sin(a) * cosh(b) * scale;
    v[1] = cos(a) * sinh(b) * scale;
}

/* <velocity, mode> / <mode, mode> over the particles: the mode's U at this moment. */
static double mode_project(const Mode *mode, const SkiffSim *sim) {
    const SkiffParticles particles = skiff_particles(sim);
    double dot = 0.0, norm = 0.0;
    for (uint32_t i = 0; i < particles.count; i++) {
        double v[2];
        mode_velocity(mode, particles.position[i], v);
        for (int k = 0; k < 2; k++) {
            dot += v[k] * (double)particles.velocity[i][k];
            norm += v[k] * v[k];
        }
    }
    return dot / norm;
}

static void mode_add(const Mode *mode, const SkiffSim *sim, double speed) {
    const SkiffParticles particles = skiff_particles(sim);
    float(*velocity)[4] = experiment_velocities(sim);
    for (uint32_t i = 0; i < particles.count; i++) {
        double v[2];
        mode_velocity(mode, particles.position[i], v);
        for (int k = 0; k < 2; k++)
            velocity[i][k] += (float)(speed * v[k]);
    }
}

typedef struct Swing {
    double period, kept;
    int count; /* of half periods seen */
} Swing;

/* Period from the zero crossings, amplitude kept from the extremes between them. */
static Swing swing_measure(const double *q, int count, double dt) {
    double crossings[64], extremes[64];
    int found = 0;
    double extreme = 0.0;
    for (int s = 1; s < count && found < 64; s++) {
        extreme = fmax(extreme, fabs(q[s]));
        if ((q[s - 1] > 0.0) == (q[s] > 0.0))
            continue;
        crossings[found] = (s - 1 + q[s - 1] / (q[s - 1] - q[s])) * dt;
        extremes[found++] = extreme;
        extreme = 0.0;
    }
    Swing swing = {.count = found - 1};
    if (found < 5)
        return swing;
    /* extremes[0] is the push itself; use those between crossings */
    const int last = found - 1;
    swing.period = 2.0 * (crossings[last] - crossings[0]) / last;
    swing.kept = pow(extremes[last] / extremes[1], 2.0 / (last - 1));
    return swing;
}

typedef struct Case {
    const char *name;
    float length, viscosity;
    int layers;
    double amplitude; /* of the surface, in depths */
    bool judged;
} Case;

static void wave(Experiment *experiment, const Case *wanted) {
    const char *name = wanted->name;
    const float length = wanted->length;
    const int layers = wanted->layers;
    SkiffDef def = experiment_def(experiment, 0.025f, 0.003f);
    def.params.viscosity = wanted->viscosity;
    experiment_tank(&def, length, 0.05f * (float)layers + 0.5f, 0.5f);
    const int along = (int)((length - 0.05f) / 0.05f + 0.5f);
    const SkiffBlockDef block = experiment_block(&def, along, layers, 9);
    def.blocks = &block;
    def.block_count = 1;
    SkiffSim *sim = experiment_create(&def);
    experiment_run(sim, 4.0);
    const ExperimentColumn column = experiment_column(sim);
    const Mode mode = {.k = pi / column.width_x,
                       .depth = column.height,
                       .left = 0.5 * ((double)length - column.width_x),
                       .floor = column.floor};
    const double omega = sqrt(EXPERIMENT_G * mode.k * tanh(mode.k * mode.depth)), expected = 2 * pi / omega;
    const double speed = wanted->amplitude * mode.depth * omega;
    mode_add(&mode, sim, speed);
    static double q[MAX_STEPS];
    char text[96];
    snprintf(text, sizeof text, "%s", name);
    FileWriter series = experiment_series(experiment, text, "t_s,mode_velocity_m_per_s,linear_m_per_s");
    int count = 0;
    const double start = skiff_time(sim);
    while (skiff_time(sim) < start + 3.3 * expected && count < MAX_STEPS) {
        experiment_step(sim);
        q[count++] = mode_project(&mode, sim);
        const double t = skiff_time(sim) - start;
        fprintf(series.stream, "%.6g,%.6g,%.6g\n", t, q[count - 1], speed * cos(omega * t));
    }
    experiment_close(&series);
    const Swing swing = swing_measure(q, count, (double)skiff_params(sim)->time_step);
    snprintf(text, sizeof text, "%s: period, mean of %d halves", name, swing.count);
    if (wanted->judged)
        experiment_check(experiment, text, swing.period, expected, 0.03 * expected, "s");
    else
        experiment_note(experiment, text, swing.period, "s");
    snprintf(text, sizeof text, "%s: period / linear theory", name);
    experiment_note(experiment, text, swing.period / expected, "");
    snprintf(text, sizeof text, "%s: amplitude kept a period", name);
    experiment_aim(experiment, text, swing.kept, 0.90, true, "");
    snprintf(text, sizeof text, "%s: depth of the water", name);
    experiment_note(experiment, text, mode.depth, "m");
    skiff_destroy(sim);
}

int main(int argc, char **argv) {
    Experiment experiment = experiment_begin("standing_wave", argc, argv);
    if (experiment.solver < 0)
        experiment.solver = SKIFF_SOLVER_SPLIT;
    const Case cases[] = {
        {"long", 2.35f, 0.02f, 12, 0.1, true},
        {"deep", 1.2f, 0.02f, 24, 0.1, true},
        {"long-half-amplitude", 2.35f, 0.02f, 12, 0.05, false},
        {"long-no-viscosity", 2.35f, 0.0f, 12, 0.1, false},
    };
    for (size_t k = 0; k < sizeof cases / sizeof cases[0]; k++)
        wave(&experiment, &cases[k]);
    return experiment_end(&experiment);
}
