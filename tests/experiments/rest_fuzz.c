/* Two hundred random closed tanks, turned and stretched, with up to two random bodies in them, filled with
 * water at rest to a random level: nothing is lost, nothing overlaps, nothing explodes.
 *
 * Judged over all fills: particles that are not finite, particles outside the walls or inside a body
 * (clearance to the true surface below 0), the least distance of two particles (0.5 r), and steps that fail
 * in the 20 after the fill. Noted: the least clearance, speeds, and what the engine refused. */
#include "experiment.h"

#include "base/random.h"
#include "sim.h"

enum { FILLS = 200, FREE_STEPS = 20, MAX_BODIES = 2 };

static const float R = 0.025f;

typedef struct Totals {
    int filled, refused, failed_steps;
    uint32_t not_finite, outside, particles;
    double clearance, nearest; /* r, least */
    double mean_speed, largest_speed;
} Totals;

/* One fill's random numbers, in the order they are asked for. */
typedef struct Dice {
    uint64_t stream, used;
} Dice;

static float roll(Dice *dice, float low, float high) {
    return low + (high - low) * (float)random_share(dice->stream, dice->used++);
}

/* A primitive between `least` and `most` r wide, turned. */
static SkiffGeometryDef random_geometry(Dice *dice, float least, float most) {
    static const SkiffGeometryKind kinds[] = {SKIFF_GEOMETRY_BOX, SKIFF_GEOMETRY_SPHERE,
                                              SKIFF_GEOMETRY_CYLINDER, SKIFF_GEOMETRY_STAR,
                                              SKIFF_GEOMETRY_CONE};
    SkiffGeometryDef geometry = skiff_geometry_default();
    geometry.kind = kinds[(int)roll(dice, 0.0f, 4.999f)];
    geometry.radius = 0.5f * R * roll(dice, least, most);
    geometry.inner_radius = geometry.radius * roll(dice, 0.45f, 0.8f);
    geometry.top_radius = geometry.radius * roll(dice, 0.2f, 1.2f);
    geometry.height = R * roll(dice, least, most);
    geometry.branches = 3 + (int)roll(dice, 0.0f, 3.999f);
    for (int k = 0; k < 3; k++) {
        geometry.size[k] = R * roll(dice, least, most);
        geometry.scale[k] = roll(dice, 0.8f, 1.25f);
        geometry.rotation_axis[k] = roll(dice, -1.0f, 1.0f);
    }
    geometry.rotation_angle = roll(dice, 0.0f, (float)pi);
    return geometry;
}

static void measure(Totals *totals, const SkiffSim *sim) {
    const SkiffParticles particles = skiff_particles(sim);
    totals->particles += particles.count;
    for (uint32_t i = 0; i < particles.count; i++) {
        const float *p = particles.position[i];
        const bool finite = isfinite(p[0]) && isfinite(p[1]) && isfinite(p[2]);
        totals->not_finite += !finite;
        if (!finite)
            continue;
        const double clearance = (double)(rest_clearance(sim, p, true) / R);
        totals->outside += clearance < 0.0;
        totals->clearance = fmin(totals->clearance, clearance);
        float least_sq = INFINITY;
        for (uint32_t j = 0; j < i; j++) {
            const float *q = particles.position[j];
            const float d[3] = {p[0] - q[0], p[1] - q[1], p[2] - q[2]};
            least_sq = fminf(least_sq, d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
        }
        totals->nearest = fmin(totals->nearest, (double)(sqrtf(least_sq) / R));
    }
}

static void let_go(Totals *totals, SkiffSim *sim, int fill) {
    Err err = {0};
    for (int step = 0; step < FREE_STEPS; step++) {
        if (!skiff_step(sim, &err)) {
            printf("fill %d: %s\n", fill, err.message);
            totals->failed_steps++;
            return;
        }
        totals->mean_speed = fmax(totals->mean_speed, skiff_stats(sim)->mean_speed);
        totals->largest_speed = fmax(totals->largest_speed, skiff_stats(sim)->max_speed);
    }
}

static void fill_one(Experiment *experiment, Totals *totals, int fill) {
    Dice dice = {.stream = 1000 + (uint64_t)fill};
    SkiffDef def = skiff_def_default();
    SkiffBlockDef block = skiff_block_default();
    SkiffBodyDef bodies[MAX_BODIES];
    def.threads = experiment->threads;
    def.params.particle_radius = R;
    def.tank.geometry = random_geometry(&dice, 24.0f, 56.0f);
    def.tank.open = false;
    block.fill = SKIFF_FILL_REST;
    const float level = R * roll(&dice, -6.0f, 40.0f);
    for (int k = 0; k < 3; k++) {
        block.start[k] = -80.0f * R;
        block.end[k] = k == 1 ? level : 80.0f * R;
        block.offset[k] = R * roll(&dice, 0.0f, 24.0f);
    }
    def.blocks = &block;
    def.block_count = 1;
    def.body_count = (int)roll(&dice, 0.0f, 0.999f + MAX_BODIES);
    def.bodies = bodies;
    for (int b = 0; b < def.body_count; b++) {
        static const char *const names[MAX_BODIES] = {"first", "second"};
        bodies[b] = skiff_body_default();
        bodies[b].name = names[b];
        bodies[b].geometry = random_geometry(&dice, 3.0f, 10.0f);
        for (int k = 0; k < 3; k++)
            bodies[b].geometry.translation[k] =
                R * (roll(&dice, -2.0f, 2.0f) + (k == 1 ? 10.0f * (float)b : 0));
        bodies[b].density = roll(&dice, 300.0f, 3000.0f);
        bodies[b].free_axes = SKIFF_FREE_ALL;
    }
    Err err = {0};
    SkiffSim *sim = skiff_create(&def, &err);
    if (sim == NULL) {
        printf("fill %d refused: %s\n", fill, err.message);
        totals->refused++;
        return;
    }
    totals->filled++;
    measure(totals, sim);
    let_go(totals, sim, fill);
    skiff_destroy(sim);
}

int main(int argc, char **argv) {
    Experiment experiment = experiment_begin("rest_fuzz", argc, argv);
    Totals totals = {.clearance = INFINITY, .nearest = INFINITY};
    for (int fill = 0; fill < FILLS; fill++)
        fill_one(&experiment, &totals, fill);
    experiment_note(&experiment, "fills", totals.filled, "");
    experiment_note(&experiment, "refused (a body through the wall or in another)", totals.refused, "");
    experiment_note(&experiment, "particles in all", totals.particles, "");
    experiment_limit(&experiment, "particles that are not finite", totals.not_finite, 0.0, "");
    experiment_limit(&experiment, "particles outside walls or in bodies", totals.outside, 0.0, "");
    experiment_limit(&experiment, "fills that failed within 20 steps", totals.failed_steps, 0.0, "");
    experiment_limit(&experiment, "0.5 r / least distance of two particles", 0.5 / totals.nearest, 1.0, "");
    experiment_note(&experiment, "least clearance to a surface", totals.clearance, "r");
    experiment_note(&experiment, "mean speed, worst step of all", totals.mean_speed, "m/s");
    experiment_note(&experiment, "largest speed of all", totals.largest_speed, "m/s");
    return experiment_end(&experiment);
}
