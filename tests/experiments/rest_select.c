/* The selection of new water [Carensac2023 sec. 3.1, 3.2, 5.2 and 5.3]: mean and spread of the candidates'
 * densities, passes, what the three rules are worth, and what a flat wall gives to a particle.
 *
 * Tanks are boxes 60 r wide, filled 24 r deep (about 3600 candidates), 51 times with shifted points; figures
 * are means over the fills. Fluid on fluid: the middle of a tank that was filled and left alone for 20 steps.
 *
 * Limits: with R = 2 the mean within 0.2 % of the target, 4 to 8 passes in every fill, spread between fluids
 * below that at walls (the paper: 3.4 and 6.9 %). Protection comes nearer to the target than the regulator
 * alone for R from 1 to 2.5. The base rule keeps 0.2 % with the smallest step only. A flat wall gives 1,
 * 0.70, 0.21 and 0.018 (+-0.03) of rest density at 0, r, 2r and 3r [the authors' code]. */
#include "experiment.h"

#include "base/random.h"
#include "sim.h"

static const float R = 0.025f, WIDTH = 60.0f, DEPTH = 24.0f; /* m, r, r */

enum { FILLS = 51, REFILLS = 5 };

typedef struct Selection {
    double mean, miss, spread; /* means over the fills; miss: distance of a fill's mean from the target */
    int least_passes, most_passes, median_passes;
} Selection;

static SkiffDef box_def(const Experiment *experiment) {
    SkiffDef def = skiff_def_default();
    def.threads = experiment->threads;
    def.params.particle_radius = R;
    def.tank.geometry.kind = SKIFF_GEOMETRY_BOX;
    memcpy(def.tank.geometry.size, (float[]){WIDTH * R, 2 * DEPTH * R, WIDTH * R},
           sizeof def.tank.geometry.size);
    def.tank.geometry.translation[1] = DEPTH * R;
    return def;
}

static SkiffBlockDef whole_block(void) {
    SkiffBlockDef block = skiff_block_default();
    block.fill = SKIFF_FILL_REST;
    for (int k = 0; k < 3; k++) {
        block.start[k] = k == 1 ? 0.0f : -0.5f * WIDTH * R;
        block.end[k] = k == 1 ? DEPTH * R : 0.5f * WIDTH * R;
    }
    return block;
}

/* Takes out what is in the block and fills it again, `count` times. */
static Selection refill(SkiffSim *sim, SkiffBlockDef block, const double min[3], const double max[3],
                        int count) {
    enum { MOST = 128 };
    Selection all = {.least_passes = MOST};
    int with[MOST] = {0}; /* fills by their number of passes */
    const double target = (double)skiff_params(sim)->rest_target;
    for (int run = 0; run < count; run++) {
        Err err = {0};
        uint32_t removed;
        for (int k = 0; k < 3; k++)
            block.offset[k] = 4.0f * R * (float)random_share(2023, 3 * (uint64_t)run + (uint64_t)k);
        experiment_need(skiff_remove_box(sim, min, max, &removed, &err), &err);
        experiment_need(skiff_fill_block(sim, &block, &err), &err);
        const SkiffFill *fill = skiff_fill(sim);
        all.mean += fill->density_mean / count;
        all.miss += fabs(fill->density_mean / target - 1.0) / count;
        all.spread += fill->density_rms / target / count;
        all.least_passes = fill->passes < all.least_passes ? fill->passes : all.least_passes;
        all.most_passes = fill->passes > all.most_passes ? fill->passes : all.most_passes;
        with[fill->passes < MOST ? fill->passes : MOST - 1]++;
    }
    for (int fills = with[0]; 2 * fills < count; fills += with[all.median_passes])
        all.median_passes++;
    return all;
}

static Selection select_at_walls(const Experiment *experiment, int rule, float parameter) {
    static const double everywhere[2][3] = {{-INFINITY, -INFINITY, -INFINITY},
                                            {INFINITY, INFINITY, INFINITY}};
    SkiffDef def = box_def(experiment);
    def.params.rest_steps = def.params.rest_final_steps = 0;
    def.params.rest_rule = rule;
    if (rule == SKIFF_REST_RULE_BASE)
        def.params.rest_step = parameter;
    else
        def.params.rest_ratio = parameter;
    SkiffSim *sim = experiment_create(&def);
    const Selection selection = refill(sim, whole_block(), everywhere[0], everywhere[1], FILLS);
    skiff_destroy(sim);
    return selection;
}

static Selection select_in_water(const Experiment *experiment) {
    SkiffDef def = box_def(experiment);
    SkiffBlockDef block = whole_block();
    def.blocks = &block;
    def.block_count = 1;
    SkiffSim *sim = experiment_create(&def);
    for (int step = 0; step < 20; step++)
        experiment_step(sim);
    SkiffBlockDef middle = block;
    double min[3], max[3];
    for (int k = 0; k < 3; k++) {
        middle.start[k] = k == 1 ? 8.0f * R : -18.0f * R;
        middle.end[k] = k == 1 ? DEPTH * R : 18.0f * R;
        min[k] = (double)middle.start[k];
        max[k] = k == 1 ? INFINITY : (double)middle.end[k];
    }
    const Selection selection = refill(sim, middle, min, max, REFILLS);
    skiff_destroy(sim);
    return selection;
}

/* Constant density of a particle alone at `height` radii over the floor. */
static double wall_density(const Experiment *experiment, double height) {
    SkiffDef def = box_def(experiment);
    SkiffBlockDef block = skiff_block_default();
    const float y = R * (float)height + 1e-4f;
    for (int k = 0; k < 3; k++) { /* less than a spacing wide: one lattice point */
        block.start[k] = (k == 1 ? y : 0.0f) - 0.8f * R;
        block.end[k] = block.start[k] + 1.6f * R;
    }
    def.blocks = &block;
    def.block_count = 1;
    def.params.speed_limit = 1e6f; /* inside a wall it is shot out */
    SkiffSim *sim = experiment_create(&def);
    experiment_step(sim);
    const double own = (double)(sim->volume * sim->kernel.w_scale);
    const double density = (double)skiff_particles(sim).density[0] - own;
    skiff_destroy(sim);
    return density;
}

/* What protection is better at, from R = 1 to 2.5, is in the paper the distribution, "quantified by the
 * deviation of the particles densities relative to the target density": with it that stays as it is up to
 * 2.5, without it is worse from 1 on [sec. 5.2, fig. 2b]. The mean the paper compares at 2.5 alone (0.2 and
 * 1.2 %), where ours differ by less than the runs; it is noted here, and judged beyond. */
static void judge_rules(Experiment *experiment) {
    static const float ratios[] = {1.0f, 1.5f, 2.0f, 2.5f, 4.0f}, steps[] = {0.005f, 0.02f, 0.06f};
    double growth[2] = {0}; /* of the spread from R 1 to 2.5: with protection, without */
    char what[96];
    for (int k = 0; k < 5; k++) {
        const Selection alone = select_at_walls(experiment, SKIFF_REST_RULE_REGULATOR, ratios[k]);
        const Selection both = select_at_walls(experiment, SKIFF_REST_RULE_PROTECTION, ratios[k]);
        snprintf(what, sizeof what, "R %g, regulator: distance from target", (double)ratios[k]);
        experiment_note(experiment, what, 100.0 * alone.miss, "%");
        snprintf(what, sizeof what, "R %g, with protection: distance from target", (double)ratios[k]);
        if (ratios[k] < 3.0f)
            experiment_note(experiment, what, 100.0 * both.miss, "%");
        else
            experiment_limit(experiment, what, 100.0 * both.miss, 100.0 * alone.miss, "%");
        snprintf(what, sizeof what, "R %g, with protection: spread", (double)ratios[k]);
        experiment_limit(experiment, what, 100.0 * both.spread, 100.0 * alone.spread, "%");
        const double sign = ratios[k] == 1.0f ? -100.0 : ratios[k] == 2.5f ? 100.0 : 0.0;
        growth[0] += sign * both.spread;
        growth[1] += sign * alone.spread;
    }
    experiment_limit(experiment, "spread, change from R 1 to 2.5 with protection", growth[0], growth[1], "%");
    for (int k = 0; k < 3; k++) {
        const Selection base = select_at_walls(experiment, SKIFF_REST_RULE_BASE, steps[k]);
        snprintf(what, sizeof what, "base, step %g: distance from target", 1000.0 * (double)steps[k]);
        if (k == 0) {
            experiment_limit(experiment, what, 100.0 * base.miss, 0.2, "%");
            experiment_note(experiment, "base, smallest step: most passes", base.most_passes, "");
        } else {
            snprintf(what, sizeof what, "base, step %g: 0.2 %% / distance from target",
                     1000.0 * (double)steps[k]);
            experiment_limit(experiment, what, 0.2 / (100.0 * base.miss), 1.0, "");
        }
    }
}

int main(int argc, char **argv) {
    Experiment experiment = experiment_begin("rest_select", argc, argv);
    static const double expected[4] = {1.0, 0.70, 0.21, 0.018};
    for (int k = 0; k < 4; k++) {
        char what[64];
        snprintf(what, sizeof what, "density of a flat wall at %d r", k);
        experiment_check(&experiment, what, wall_density(&experiment, k), expected[k], 0.03, "density0");
    }
    const Selection walls = select_at_walls(&experiment, SKIFF_REST_RULE_PROTECTION, 2.0f);
    experiment_check(&experiment, "mean density of the candidates, R 2", walls.mean, 0.999, 0.002 * 0.999,
                     "density0");
    experiment_check(&experiment, "passes, median", walls.median_passes, 6, 2, "");
    experiment_note(&experiment, "fewest passes", walls.least_passes, "");
    experiment_note(&experiment, "most passes", walls.most_passes, "");
    const Selection water = select_in_water(&experiment);
    experiment_note(&experiment, "spread at walls (the paper: 6.9)", 100.0 * walls.spread, "%");
    experiment_limit(&experiment, "spread between fluids (the paper: 3.4)", 100.0 * water.spread,
                     100.0 * walls.spread, "%");
    judge_rules(&experiment);
    return experiment_end(&experiment);
}
