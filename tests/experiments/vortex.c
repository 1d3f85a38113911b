/* How thick particle water is: a vortex that should turn for minutes.
 *
 * Tank 1 x 0.8 x 1 m, 19 x 12 x 19 particles of r 0.025 m, dt 3 ms, settled for 6 s; then the Taylor-Green
 * vortex of vertical axis is added, u = U sin(kx) cos(kz), w = -U cos(kx) sin(kz), k = pi / width: four
 * cells that slide along frictionless walls. Velocities are projected on it each step.
 *
 * Expected of a fluid of viscosity nu: exp(-2 nu k^2 t), so nu = -d ln U / dt / (2 k^2), whatever U. Water
 * has 1e-6 m^2/s; XSPH with 0.02 a step at this size stands for about 2e-3.
 *
 * With pressureSolver split; --solver gcr shows the glass.
 *
 * Informational, nothing is judged: a viscosity that grows as U falls, and a slow vortex that stops and
 * turns back, show a yield stress: the settled particles resist small shear like a solid. It is the noise
 * floor of every slow motion in the other experiments. */
#include "experiment.h"

#include <unistd.h>

enum { SPEEDS = 3, POINTS = 9, STEPS_A_POINT = 50 };

typedef struct Vortex {
    double k, left[2];
} Vortex;

static void vortex_velocity(const Vortex *vortex, const float *x, double v[2]) {
    const double a = vortex->k * ((double)x[0] - vortex->left[0]),
                 b = vortex->k * ((double)x[2] - vortex->left[1]);
    v[0] = sin(a) * cos(b);
    v[1] = -cos(a) * sin(b);
}

/* Amplitude of the vortex in the velocities; adds `push` of it first. */
static double vortex_project(const Vortex *vortex, const SkiffSim *sim, double push) {
    const SkiffParticles particles = skiff_particles(sim);
    float(*velocity)[4] = experiment_velocities(sim);
    double dot = 0.0, norm = 0.0;
    for (uint32_t i = 0; i < particles.count; i++) {
        double v[2];
        vortex_velocity(vortex, particles.position[i], v);
        for (int k = 0; k < 2; k++) {
            if (push != 0.0)
                velocity[i][2 * k] += (float)(push * v[k]);
            dot += v[k] * (double)velocity[i][2 * k];
            norm += v[k] * v[k];
        }
    }
    return dot / norm;
}

int main(int argc, char **argv) {
    Experiment experiment = experiment_begin("vortex", argc, argv);
    if (experiment.solver < 0)
        experiment.solver = SKIFF_SOLVER_SPLIT;
    SkiffDef def = experiment_def(&experiment, 0.025f, 0.003f);
    experiment_tank(&def, 1.0f, 0.8f, 1.0f);
    const SkiffBlockDef block = experiment_block(&def, 19, 12, 19);
    def.blocks = &block;
    def.block_count = 1;
    SkiffSim *sim = experiment_create(&def);
    experiment_run(sim, 6.0);
    char path[4096];
    snprintf(path, sizeof path, "%s/vortex_%ld.state", experiment.folder, (long)getpid());
    Err err = {0};
    experiment_need(skiff_save(sim, path, &err), &err);
    const ExperimentColumn column = experiment_column(sim);
    const double width = 0.5 * (column.width_x + column.width_z);
    const Vortex vortex = {.k = pi / width, .left = {0.5 - 0.5 * width, 0.5 - 0.5 * width}};
    const double step = (double)STEPS_A_POINT * 0.003;

    const double speeds[SPEEDS] = {0.03, 0.1, 0.3};
    double amplitude[SPEEDS][POINTS];
    for (int k = 0; k < SPEEDS; k++) {
        experiment_need(skiff_load(sim, path, &err), &err);
        amplitude[k][0] = vortex_project(&vortex, sim, speeds[k]);
        for (int p = 1; p < POINTS; p++) {
            for (int s = 0; s < STEPS_A_POINT; s++)
                experiment_step(sim);
            amplitude[k][p] = vortex_project(&vortex, sim, 0.0);
        }
    }
    unlink(path);
    FileWriter series =
        experiment_series(&experiment, "series", "start_m_per_s,t_s,U_m_per_s,viscosity_m2_per_s");
    for (int k = 0; k < SPEEDS; k++) {
        printf("U = %.2f m/s: U / start, effective viscosity (m^2/s) since the time before\n", speeds[k]);
        for (int p = 1; p < POINTS; p++) {
            const double ratio = amplitude[k][p] / amplitude[k][p - 1];
            const double viscosity = ratio > 0.0 ? -log(ratio) / (2.0 * vortex.k * vortex.k * step) : NAN;
            printf("  t %.2f s  %8.4f  %10.3g\n", p * step, amplitude[k][p] / amplitude[k][0], viscosity);
            fprintf(series.stream, "%g,%g,%.6g,%.6g\n", speeds[k], p * step, amplitude[k][p], viscosity);
        }
        char name[96];
        const double kept = amplitude[k][POINTS - 1] / amplitude[k][0];
        snprintf(name, sizeof name, "U kept after %.1f s, start %.2f m/s", (POINTS - 1) * step, speeds[k]);
        experiment_note(&experiment, name, kept, "");
        snprintf(name, sizeof name, "viscosity of the first %.2f s, start %.2f m/s", step, speeds[k]);
        experiment_note(&experiment, name,
                        -log(fmax(amplitude[k][1] / amplitude[k][0], 1e-9)) /
                            (2.0 * vortex.k * vortex.k * step),
                        "m^2/s");
    }
    experiment_close(&series);
    skiff_destroy(sim);
    return experiment_end(&experiment);
}
