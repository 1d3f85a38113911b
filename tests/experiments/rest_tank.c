/* Water at rest: a settled tank stays calm and level, carries its weight on its floor, and its pressure
 * grows with depth.
 *
 * Tank 2.45 x 1.5 x 2.45 m, 48 x 20 x 48 particles of r 0.025 m, dt 3 ms; 5 s of settling, then 1 s is
 * measured.
 *
 * Expected: hydrostatics. p = rho0 g depth, with depth below the effective surface of experiment.h
 * (ExperimentColumn); floor force = weight of the water. Limits on speed, level, density error and
 * iterations are the engine's own targets.
 *
 * Noted beside the profile: that of the solver's unknowns, and the pressure by the method of planes, which
 * asks no particle for its pressure: the momentum that all forces between what is above and what is below a
 * horizontal plane carry through it. */
#include "experiment.h"
#include "kernel.h"

#define SIDE 2.45 /* of the tank, m */

enum { BINS = 16, PLANE_BINS = 4, SAMPLE_STEPS = 10 };

/* ---- Method of planes ---- */

/* What lies less than a support below a plane. */
typedef struct Below {
    uint32_t count;
    double (*position)[3]; /* m */
    double *force; /* of the bond with a particle of unknown P: (force[0] + force[1] P) times -V dW/dr */
} Below;

static void below_add(Below *below, const SkiffParticles *particles, const float position[4], double y,
                      double support, double alone, double shared) {
    const double height = (double)position[1] + particles->origin[1];
    if (!(height <= y && height > y - support))
        return;
    for (int k = 0; k < 3; k++)
        below->position[below->count][k] = (double)position[k] + particles->origin[k];
    below->force[2 * below->count] = alone;
    below->force[2 * below->count + 1] = shared;
    below->count++;
}

/* N; the bonds of one particle above with all that is below. */
static double bonds_force(const Below *below, const Kernel *kernel, const double above[3], double unknown) {
    double sum = 0.0;
    for (uint32_t b = 0; b < below->count; b++) {
        double distance_sq = 0.0;
        for (int k = 0; k < 3; k++)
            distance_sq += (above[k] - below->position[b][k]) * (above[k] - below->position[b][k]);
        if (distance_sq < (double)(kernel->support * kernel->support))
            sum -= (below->force[2 * b] + below->force[2 * b + 1] * unknown) *
                   kernel_gradient_factor(kernel, sqrt(distance_sq)) * (above[1] - below->position[b][1]);
    }
    return sum;
}

/* Force (N) with which the water and the floor below y press up what is above. */
static double plane_force(const SkiffSim *sim, double y) {
    const SkiffParticles particles = skiff_particles(sim);
    SkiffBoundary walls;
    skiff_boundary_samples(sim, false, &walls);
    const Kernel kernel = kernel_make(4.0 * (double)skiff_params(sim)->particle_radius);
    const double support = (double)kernel.support, volume = experiment_particle_volume(sim);
    const size_t most = (size_t)particles.count + walls.count;
    Below below = {0, malloc(most * sizeof *below.position), malloc(2 * most * sizeof *below.force)};
    for (uint32_t i = 0; i < particles.count; i++)
        below_add(&below, &particles, particles.position[i], y, support,
                  volume * volume * (double)particles.unknown[i], volume * volume);
    for (uint32_t s = 0; s < walls.count; s++)
        if (fabs((double)walls.position[s][1] + particles.origin[1]) < 1e-6) /* the sides have no say here */
            below_add(&below, &particles, walls.position[s], y, support, 0.0,
                      volume * (double)walls.position[s][3]);
    double force = 0.0;
    for (uint32_t i = 0; i < particles.count; i++) {
        double above[3];
        for (int k = 0; k < 3; k++)
            above[k] = (double)particles.position[i][k] + particles.origin[k];
        if (above[1] > y && above[1] < y + support)
            force += bonds_force(&below, &kernel, above, (double)particles.unknown[i]);
    }
    free(below.position);
    free(below.force);
    return force;
}

/* ---- Profile ---- */

/* Sums over the particles of a height. */
typedef struct Profile {
    double pressure[BINS], unknown[BINS], depth[BINS], count[BINS];
    double planes[BINS], plane_pressure[BINS], planes_count; /* sums of one value a sample */
} Profile;

static void sample_planes(Profile *profile, const SkiffSim *sim, const ExperimentColumn *column,
                          const Profile *sample) {
    for (int b = 0; b < BINS; b += PLANE_BINS) {
        const double depth = sample->depth[b] / sample->count[b];
        profile->planes[b] += plane_force(sim, column->surface - depth) / (column->width_x * column->width_z);
        profile->plane_pressure[b] += sample->pressure[b] / sample->count[b];
    }
    profile->planes_count += 1.0;
}

static void profile_add(Profile *profile, const SkiffSim *sim, const ExperimentColumn *column,
                        float *pressure) {
    const SkiffParticles particles = skiff_particles(sim);
    Profile sample = {0};
    Err err = {0};
    experiment_need(skiff_pressure(sim, pressure, &err), &err);
    for (uint32_t i = 0; i < particles.count; i++) {
        const double y = (double)particles.position[i][1] + particles.origin[1];
        const int bin = (int)((y - column->floor) / column->height * BINS);
        if (bin < 0 || bin >= BINS)
            continue;
        sample.pressure[bin] += (double)pressure[i];
        sample.unknown[bin] += (double)particles.unknown[i];
        sample.depth[bin] += column->surface - y;
        sample.count[bin] += 1.0;
    }
    for (int b = 0; b < BINS; b++) {
        profile->pressure[b] += sample.pressure[b];
        profile->unknown[b] += sample.unknown[b];
        profile->depth[b] += sample.depth[b];
        profile->count[b] += sample.count[b];
    }
    sample_planes(profile, sim, column, &sample);
}

/* RMSE of sums[b] / count[b] against expected[b], in % of the pressure at the floor. */
static double profile_error(const Profile *profile, const double sums[BINS], const double expected[BINS],
                            double floor_pressure) {
    double sum = 0.0;
    int used = 0;
    for (int b = 0; b < BINS; b++) {
        if (profile->count[b] == 0.0)
            continue;
        const double error = sums[b] / profile->count[b] - expected[b];
        sum += error * error;
        used++;
    }
    return 100.0 * sqrt(sum / used) / floor_pressure;
}

/* Largest difference between the pressure of the particles of a height and by the method of planes, in % of
 * the latter. */
static double planes_difference(const Profile *profile) {
    double worst = 0.0;
    for (int b = 0; b < BINS; b += PLANE_BINS)
        worst = fmax(worst, 100.0 * fabs(profile->plane_pressure[b] / profile->planes[b] - 1.0));
    return worst;
}

static void profile_judge(Experiment *experiment, const Profile *profile, const ExperimentColumn *column) {
    const double rho_g = 1000.0 * EXPERIMENT_G, floor_pressure = rho_g * column->height;
    double hydrostatic[BINS] = {0};
    FileWriter series = experiment_series(
        experiment, "profile", "depth_m,pressure_Pa,hydrostatic_Pa,unknown_Pa,method_of_planes_Pa");
    for (int b = 0; b < BINS; b++) {
        if (profile->count[b] == 0.0)
            continue;
        const double depth = profile->depth[b] / profile->count[b];
        hydrostatic[b] = rho_g * depth;
        fprintf(series.stream, "%.5g,%.6g,%.6g,%.6g,", depth, profile->pressure[b] / profile->count[b],
                hydrostatic[b], profile->unknown[b] / profile->count[b]);
        if (b % PLANE_BINS == 0)
            fprintf(series.stream, "%.6g", profile->planes[b] / profile->planes_count);
        fprintf(series.stream, "\n");
    }
    experiment_close(&series);
    experiment_limit(experiment, "pressure profile, RMSE of the floor's",
                     profile_error(profile, profile->pressure, hydrostatic, floor_pressure), 5.0, "%");
    experiment_note(experiment, "pressure / hydrostatic, layer on the floor",
                    profile->pressure[0] / profile->count[0] / hydrostatic[0], "");
    experiment_note(experiment, "pressure from the method of planes, farthest", planes_difference(profile),
                    "%");
    experiment_note(experiment, "RMSE of the solver's unknowns",
                    profile_error(profile, profile->unknown, hydrostatic, floor_pressure), "%");
}

typedef struct Second {
    double mean_speed, mean_max, worst_mean, worst_max;
    double floor_force, tank_force, side_force, patch_pressure;
    double density_error, density_max, iterations, divergence_iterations;
    double low, high;
    int steps;
} Second;

static void second_add(Second *second, const SkiffSim *sim, double surface) {
    const SkiffStats *stats = skiff_stats(sim);
    double probes[16];
    skiff_probe_read(sim, probes);
    second->mean_speed += stats->mean_speed;
    second->mean_max += stats->max_speed;
    second->worst_mean = fmax(second->worst_mean, stats->mean_speed);
    second->worst_max = fmax(second->worst_max, stats->max_speed);
    second->floor_force -= probes[1];
    second->tank_force -= probes[7];
    second->side_force += hypot(probes[6], probes[8]);
    second->patch_pressure += probes[12];
    second->density_error += stats->density_error_percent;
    second->density_max = fmax(second->density_max, stats->density_max_percent);
    second->iterations += stats->density_iterations;
    second->divergence_iterations += stats->divergence_iterations;
    second->low = fmin(second->low, surface);
    second->high = fmax(second->high, surface);
    second->steps++;
}

static void judge(Experiment *experiment, const SkiffSim *sim, const Second *second, const Profile *profile,
                  const ExperimentColumn *first, const ExperimentColumn *last) {
    const double n = second->steps, d = 2.0 * (double)skiff_params(sim)->particle_radius;
    const double rho_g = 1000.0 * EXPERIMENT_G, weight = rho_g * last->volume, area = SIDE * SIDE;
    experiment_note(experiment, "particles", skiff_particles(sim).count, "");
    experiment_limit(experiment, "mean speed, worst step", second->worst_mean, 0.02, "m/s");
    experiment_limit(experiment, "largest speed, worst step", second->worst_max, 0.2, "m/s");
    experiment_aim(experiment, "mean speed, mean of the second", second->mean_speed / n, 0.005, false, "m/s");
    experiment_limit(experiment, "level drift over 1 s", fabs(last->surface - first->surface), 0.2 * d, "m");
    experiment_limit(experiment, "level range over 1 s", second->high - second->low, 0.2 * d, "m");
    experiment_check(experiment, "mean floor pressure", second->floor_force / n / area, weight / area,
                     0.01 * weight / area, "Pa");
    experiment_check(experiment, "floor force", second->floor_force / n, weight, 0.01 * weight, "N");
    profile_judge(experiment, profile, last);
    experiment_limit(experiment, "mean density error", second->density_error / n, 0.01, "%");
    experiment_limit(experiment, "density iterations, mean", second->iterations / n, 6.0, "");
    experiment_note(experiment, "density, largest", second->density_max, "%");
    experiment_note(experiment, "divergence iterations, mean", second->divergence_iterations / n, "");
    experiment_note(experiment, "largest speed, mean of the second", second->mean_max / n, "m/s");
    experiment_note(experiment, "vertical force on the whole tank / weight", second->tank_force / n / weight,
                    "");
    experiment_note(experiment, "net side force / weight", second->side_force / n / weight, "");
    experiment_note(experiment, "pressure on a patch in the middle of the floor", second->patch_pressure / n,
                    "Pa");
    experiment_note(experiment, "rho0 g height of the effective column", rho_g * last->height, "Pa");
    experiment_note(experiment, "effective width / tank", last->width_x / SIDE, "");
    experiment_note(experiment, "height / (volume / tank area)", last->height / (last->volume / area), "");
}

int main(int argc, char **argv) {
    Experiment experiment = experiment_begin("rest_tank", argc, argv);
    SkiffDef def = experiment_def(&experiment, 0.025f, 0.003f);
    experiment_tank(&def, (float)SIDE, 1.5f, (float)SIDE);
    const SkiffBlockDef block = experiment_block(&def, 48, 20, 48);
    SkiffProbeDef probes[3] = {skiff_probe_default(), skiff_probe_default(), skiff_probe_default()};
    probes[0] = (SkiffProbeDef){.name = "floor",
                                .kind = SKIFF_PROBE_FORCE,
                                .object = "tank",
                                .has_region = true,
                                .min = {-1, -0.005f, -1},
                                .max = {4, 0.005f, 4}};
    probes[1] = (SkiffProbeDef){.name = "tank", .kind = SKIFF_PROBE_FORCE, .object = "tank"};
    probes[2] = (SkiffProbeDef){.name = "patch",
                                .kind = SKIFF_PROBE_PRESSURE,
                                .object = "tank",
                                .radius = 0.5f,
                                .point = {1.225f, 0.0f, 1.225f}};
    def.blocks = &block;
    def.block_count = 1;
    def.probes = probes;
    def.probe_count = 3;
    SkiffSim *sim = experiment_create(&def);
    experiment_run(sim, 5.0);

    FileWriter series =
        experiment_series(&experiment, "steps", "t_s,mean_speed,max_speed,surface_m,floor_force_N");
    const ExperimentColumn first = experiment_column(sim);
    ExperimentColumn column = first;
    Second second = {.low = INFINITY, .high = -INFINITY};
    Profile profile = {0};
    float *pressure = malloc(skiff_particles(sim).count * sizeof *pressure);
    while (skiff_time(sim) < 6.0 - 1e-9) {
        experiment_step(sim);
        column = experiment_column(sim);
        second_add(&second, sim, column.surface);
        if (second.steps % SAMPLE_STEPS == 0)
            profile_add(&profile, sim, &column, pressure);
        double values[16];
        skiff_probe_read(sim, values);
        fprintf(series.stream, "%.6g,%.5g,%.5g,%.7g,%.7g\n", skiff_time(sim), skiff_stats(sim)->mean_speed,
                skiff_stats(sim)->max_speed, column.surface, -values[1]);
    }
    experiment_close(&series);
    free(pressure);
    judge(&experiment, sim, &second, &profile, &first, &column);
    skiff_destroy(sim);
    return experiment_end(&experiment);
}
