/* Water at rest: a settled tank stays calm and level, carries its weight on its floor, and its pressure
 * grows with depth.
 *
 * Tank 2.45 x 1.5 x 2.45 m, 48 x 20 x 48 particles of r 0.025 m, dt 3 ms; 5 s of settling, then 1 s is
 * measured.
 *
 * Expected: hydrostatics. p = rho0 g depth, with depth below the effective surface of experiment.h
 * (ExperimentColumn); floor force = weight of the water. Limits on speed, level, density error and
 * iterations are the engine's own targets. */
#include "experiment.h"

enum { BINS = 16 };

typedef struct Profile {
    double pressure[BINS], depth[BINS], count[BINS];
} Profile;

/* Pressure of particles by height, and the depth of each below the surface. */
static void profile_add(Profile *profile, const SkiffSim *sim, const ExperimentColumn *column) {
    const SkiffParticles particles = skiff_particles(sim);
    for (uint32_t i = 0; i < particles.count; i++) {
        const double y = (double)particles.position[i][1] + particles.origin[1];
        const int bin = (int)((y - column->floor) / column->height * BINS);
        if (bin < 0 || bin >= BINS)
            continue;
        profile->pressure[bin] += (double)particles.pressure[i];
        profile->depth[bin] += column->surface - y;
        profile->count[bin] += 1.0;
    }
}

/* RMSE in % of the pressure at the floor, over the bins from `lowest` up. */
static double profile_error(const Profile *profile, int lowest, double rho_g, double height) {
    double sum = 0.0;
    int used = 0;
    for (int b = lowest; b < BINS; b++) {
        if (profile->count[b] == 0.0)
            continue;
        const double depth = profile->depth[b] / profile->count[b];
        const double pressure = profile->pressure[b] / profile->count[b];
        sum += (pressure - rho_g * depth) * (pressure - rho_g * depth);
        used++;
    }
    return 100.0 * sqrt(sum / used) / (rho_g * height);
}

static void profile_write(const Profile *profile, double rho_g, const Experiment *experiment) {
    FileWriter series = experiment_series(experiment, "profile", "depth_m,pressure_Pa,hydrostatic_Pa");
    for (int b = 0; b < BINS; b++)
        if (profile->count[b] > 0.0)
            fprintf(series.stream, "%.5g,%.6g,%.6g\n", profile->depth[b] / profile->count[b],
                    profile->pressure[b] / profile->count[b], rho_g * profile->depth[b] / profile->count[b]);
    experiment_close(&series);
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
    const double rho_g = 1000.0 * EXPERIMENT_G, weight = rho_g * last->volume, area = 2.45 * 2.45;
    experiment_note(experiment, "particles", skiff_particles(sim).count, "");
    experiment_limit(experiment, "mean speed, worst step", second->worst_mean, 0.02, "m/s");
    experiment_limit(experiment, "largest speed, worst step", second->worst_max, 0.2, "m/s");
    experiment_aim(experiment, "mean speed, mean of the second", second->mean_speed / n, 0.005, false, "m/s");
    experiment_limit(experiment, "level drift over 1 s", fabs(last->surface - first->surface), 0.2 * d, "m");
    experiment_limit(experiment, "level range over 1 s", second->high - second->low, 0.2 * d, "m");
    experiment_check(experiment, "mean floor pressure", second->floor_force / n / area, weight / area,
                     0.01 * weight / area, "Pa");
    experiment_check(experiment, "floor force", second->floor_force / n, weight, 0.01 * weight, "N");
    experiment_limit(experiment, "pressure profile, RMSE of the floor's",
                     profile_error(profile, 0, rho_g, last->height), 5.0, "%");
    experiment_note(experiment, "the same without the layer on the floor",
                    profile_error(profile, 1, rho_g, last->height), "%");
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
    experiment_note(experiment, "effective width / tank", last->width_x / 2.45, "");
    experiment_note(experiment, "height / (volume / tank area)", last->height / (last->volume / area), "");
}

int main(int argc, char **argv) {
    Experiment experiment = experiment_begin("rest_tank", argc, argv);
    SkiffDef def = experiment_def(&experiment, 0.025f, 0.003f);
    experiment_tank(&def, 2.45f, 1.5f, 2.45f);
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
    while (skiff_time(sim) < 6.0 - 1e-9) {
        experiment_step(sim);
        column = experiment_column(sim);
        second_add(&second, sim, column.surface);
        profile_add(&profile, sim, &column);
        double values[16];
        skiff_probe_read(sim, values);
        fprintf(series.stream, "%.6g,%.5g,%.5g,%.7g,%.7g\n", skiff_time(sim), skiff_stats(sim)->mean_speed,
                skiff_stats(sim)->max_speed, column.surface, -values[1]);
    }
    experiment_close(&series);
    profile_write(&profile, 1000.0 * EXPERIMENT_G, &experiment);
    judge(&experiment, sim, &second, &profile, &first, &column);
    skiff_destroy(sim);
    return experiment_end(&experiment);
}
