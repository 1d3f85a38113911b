/* Still water, a window driven back and forth over it [Carensac2023 sec. 4.1]: water that comes in ahead must
 * be at rest, and nothing of it may show in the middle. */
#include "experiment.h"

enum { MOVES = 40 };

typedef struct Watch {
    double inner_max, level_max, count_max, spread; /* over all steps */
} Watch;

static void watch(const SkiffSim *sim, double radius, uint32_t first_count, double first_height,
                  Watch *seen) {
    const SkiffParticles particles = skiff_particles(sim);
    const SkiffStats *stats = skiff_stats(sim);
    float *distance = malloc(particles.count * sizeof *distance);
    if (distance == NULL)
        exit(ERR_IO);
    skiff_window_distances(sim, particles.position, particles.count, distance);
    for (uint32_t i = 0; i < particles.count; i++) {
        const float *v = particles.velocity[i];
        const double speed = sqrt((double)(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]));
        /* away from the edge: what no move has touched within the last second */
        if ((double)distance[i] < -0.5 * radius)
            seen->inner_max = fmax(seen->inner_max, speed);
    }
    free(distance);
    seen->count_max = fmax(seen->count_max, fabs((double)particles.count / first_count - 1.0));
    seen->level_max = fmax(seen->level_max, 2.0 * fabs(stats->mean_height - first_height));
}

int main(int argc, char **argv) {
    Experiment experiment = experiment_begin("window_still", argc, argv);
    Err err = {0};
    SkiffDef def = skiff_def_default();
    const double radius = 2.5, r = 0.04, speed = 2.0;
    def.threads = experiment.threads;
    def.params.particle_radius = (float)r;
    def.params.time_step = 0.005f;
    def.params.boundary_offset = 1.15f;
    def.tank.geometry.kind = SKIFF_GEOMETRY_CYLINDER;
    def.tank.geometry.radius = (float)radius;
    def.tank.geometry.height = 3.0f;
    def.tank.geometry.translation[1] = 1.5f;
    def.tank.wet_height = 1.5f;
    /* a move every 2.5 h = 0.4 m: ten ahead, twenty back, ten ahead */
    const double span = 10.5 * 2.5 * 4.0 * r;
    const double path[][3] = {{0.0, 0.0, 0.0},
                              {span / speed, span, 0.0},
                              {3.0 * span / speed, -span, 0.0},
                              {4.2 * span / speed, 0.2 * span, 0.3 * span}};
    def.sea = (SkiffSeaDef){.on = true, .level = 1.0f, .path = path, .path_count = 4, .absorb = true};
    SkiffSim *sim = skiff_create(&def, &err);
    experiment_need(sim != NULL, &err);
    experiment_need(skiff_step(sim, &err), &err);
    const uint32_t count = skiff_particles(sim).count;
    const double height = skiff_stats(sim)->mean_height;
    Watch seen = {0};
    SkiffWindow window = {0};
    while (window.moves < MOVES && skiff_time(sim) < 30.0) {
        experiment_need(skiff_step(sim, &err), &err);
        watch(sim, radius, count, height, &seen);
        skiff_window(sim, &window);
    }
    experiment_note(&experiment, "moves", (double)window.moves, "");
    experiment_limit(&experiment, "largest speed deeper than R/2", seen.inner_max, 0.05, "m/s");
    experiment_limit(&experiment, "level drift (2 x mean height)", seen.level_max, 0.5 * 2.0 * r, "m");
    experiment_limit(&experiment, "particle count off the first", 100.0 * seen.count_max, 0.5, "%");
    skiff_destroy(sim);
    return experiment_end(&experiment);
}
