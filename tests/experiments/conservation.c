/* What a closed system keeps: momentum without gravity, and energy with it.
 *
 * Momentum: two blobs of water of 0.5 x 0.5 x 0.5 m fly at each other at 2 m/s each, off centre, without
 * gravity and without tank; then again with a free box between them, whose momentum counts too. The total
 * must stay where it was, within 1e-4 of the sum of the blobs' absolute momenta, for 0.6 s: pair forces
 * are antisymmetric, boundary forces act on both sides.
 *
 * Energy: a column of water collapses in a closed tank and sloshes for 3 s. Without input, kinetic +
 * potential energy may only fall. Datum of the potential energy: the height at which the same water would
 * lie level on the floor, so that what is measured against is the energy that can be set free and not an
 * arbitrary height. Limit: never above the initial value by more than 1 % of the initial potential energy;
 * the largest rise above the lowest value so far is noted as well. volumeFactor 1 makes the density of the
 * lattice that of rest, so that none is stored as compression. */
#include "experiment.h"

typedef struct Drift {
    double momentum;  /* largest change of the total, kg m/s */
    double reference; /* sum of |m v| at the start */
} Drift;

static void total_momentum(const SkiffSim *sim, double total[3], double *absolute) {
    const SkiffParticles particles = skiff_particles(sim);
    const double mass = 1000.0 * experiment_particle_volume(sim);
    *absolute = 0.0;
    for (int k = 0; k < 3; k++)
        total[k] = 0.0;
    for (uint32_t i = 0; i < particles.count; i++) {
        double square = 0.0;
        for (int k = 0; k < 3; k++) {
            const double v = (double)particles.velocity[i][k];
            total[k] += mass * v;
            square += v * v;
        }
        *absolute += mass * sqrt(square);
    }
    for (int b = 0; b < skiff_body_count(sim); b++) {
        const SkiffBody body = skiff_body(sim, b);
        for (int k = 0; k < 3; k++)
            total[k] += body.mass * body.velocity[k];
    }
}

static void collide(Experiment *experiment, bool with_body, const char *name) {
    SkiffDef def = experiment_def(experiment, 0.025f, 0.002f);
    def.params.gravity[1] = 0.0f;
    SkiffBlockDef blocks[2] = {skiff_block_default(), skiff_block_default()};
    for (int b = 0; b < 2; b++) {
        const float side = b == 0 ? -1.0f : 1.0f,
                    low[3] = {b == 0 ? -0.7f : 0.2f, -0.25f + 0.1f * side, -0.25f};
        for (int k = 0; k < 3; k++) {
            blocks[b].start[k] = low[k];
            blocks[b].end[k] = low[k] + 0.5f;
        }
        blocks[b].velocity[0] = -2.0f * side;
    }
    const SkiffBodyDef body = experiment_box("box", (const float[3]){0.15f, 0.3f, 0.3f},
                                             (const float[3]){0.02f, 0.05f, 0.03f}, 600.0f);
    def.blocks = blocks;
    def.block_count = 2;
    def.bodies = &body;
    def.body_count = with_body;
    def.has_domain = true;
    for (int k = 0; k < 3; k++) {
        def.domain_min[k] = -6.0f;
        def.domain_max[k] = 6.0f;
    }
    SkiffSim *sim = experiment_create(&def);
    double first[3], absolute, ignored, worst = 0.0;
    total_momentum(sim, first, &absolute);
    while (skiff_time(sim) < 0.6 - 1e-9) {
        double total[3], square = 0.0;
        experiment_step(sim);
        total_momentum(sim, total, &ignored);
        for (int k = 0; k < 3; k++)
            square += (total[k] - first[k]) * (total[k] - first[k]);
        worst = fmax(worst, sqrt(square));
    }
    char text[96];
    snprintf(text, sizeof text, "change of momentum / absolute, %s", name);
    experiment_limit(experiment, text, worst / absolute, 1e-4, "");
    if (with_body) {
        const SkiffBody state = skiff_body(sim, 0);
        experiment_note(experiment, "speed of the body afterwards",
                        sqrt(state.velocity[0] * state.velocity[0] + state.velocity[1] * state.velocity[1] +
                             state.velocity[2] * state.velocity[2]),
                        "m/s");
    }
    snprintf(text, sizeof text, "kinetic energy kept, %s", name);
    experiment_note(experiment, text, skiff_stats(sim)->kinetic_energy / (0.5 * 2.0 * absolute), "");
    skiff_destroy(sim);
}

static void slosh(Experiment *experiment) {
    SkiffDef def = experiment_def(experiment, 0.025f, 0.002f);
    def.params.volume_factor = 1.0f;
    experiment_tank(&def, 2.0f, 1.4f, 0.56f);
    def.tank.open = false;
    SkiffBlockDef block = experiment_block(&def, 16, 16, 10);
    experiment_block_to_wall(&def, &block);
    def.blocks = &block;
    def.block_count = 1;
    SkiffSim *sim = experiment_create(&def);
    const SkiffParticles particles = skiff_particles(sim);
    const double mass = 1000.0 * experiment_particle_volume(sim) * particles.count;
    const double rest = 0.5 * mass / 1000.0 / (2.0 * 0.56); /* mean height of the level water */
    double mean = 0.0;
    for (uint32_t i = 0; i < particles.count; i++)
        mean += (double)particles.position[i][1] / particles.count;
    const double initial = mass * EXPERIMENT_G * (mean - rest);
    FileWriter series = experiment_series(experiment, "energy", "t_s,kinetic_J,potential_J,total_J");
    double highest = 0.0, lowest = initial, rise = 0.0;
    while (skiff_time(sim) < 3.0 - 1e-9) {
        experiment_step(sim);
        const SkiffStats *stats = skiff_stats(sim);
        const double potential = stats->potential_energy - mass * EXPERIMENT_G * rest;
        const double total = stats->kinetic_energy + potential;
        highest = fmax(highest, total - initial);
        lowest = fmin(lowest, total);
        rise = fmax(rise, total - lowest);
        fprintf(series.stream, "%.6g,%.6g,%.6g,%.6g\n", stats->time, stats->kinetic_energy, potential, total);
    }
    experiment_close(&series);
    experiment_note(experiment, "initial potential energy above level water", initial, "J");
    experiment_limit(experiment, "rise of energy above the start", 100.0 * highest / initial, 1.0, "%");
    experiment_note(experiment, "largest rise of energy above its lowest so far", 100.0 * rise / initial,
                    "%");
    experiment_note(experiment, "energy left after 3 s", 100.0 * lowest / initial, "%");
    skiff_destroy(sim);
}

int main(int argc, char **argv) {
    Experiment experiment = experiment_begin("conservation", argc, argv);
    collide(&experiment, false, "two blobs");
    collide(&experiment, true, "two blobs and a box");
    slosh(&experiment);
    return experiment_end(&experiment);
}
