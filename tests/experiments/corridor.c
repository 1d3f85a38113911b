/* What the absorbing end of the corridor [Carensac2023 sec. 5.6, assets/scenes/wedge.json] sends back. Water
 * at an edge that sends nothing back moves as it does in a corridor that goes on: so the same wedge falls
 * into one twelve metres long, and the half of five metres is set against its first five. Energies as the
 * paper's: sums of squared velocities. The paper's measure, energy of the first reflection over that at a
 * closed end, holds the wave of the wedge's own gap too: the endless corridor shows how much of it no edge
 * can take. */
#include "experiment.h"

#include "app/carensac.h"
#include "app/reproduce.h"

enum { CLOSED, OPEN, SIDE_COUNT, MAX_STEPS = 4096, MAX_EDITS = 8 };

static const char scene_file[] = SKIFF_SOURCE_DIR "/assets/scenes/wedge.json";
static const double radius_default = 0.05, duration = 6.0;
static const double length = 5.0;                     /* m, of a half */
static const double wave_from = 1.3;                  /* s; the first wave reaches the end */
static const double first_from = 1.9, first_to = 2.7; /* s; it has come back from a closed one */
static const double rest_from = 5.85, rest_to = 5.95; /* s */
static const char *const endless[] = {"Tank.max[2]=12", "Sea.absorbMin[2]=11.5", "Sea.absorbMax[2]=13"};
static const char *const at_once[] = {"inflowSpeed=0"};
static const char *const as_waves[] = {"outflowSpeed=1"};

typedef struct Corridor {
    int count;
    double time[MAX_STEPS], energy[SIDE_COUNT][MAX_STEPS], depth[SIDE_COUNT][MAX_STEPS];
} Corridor;

static SkiffSim *start(const Experiment *experiment, const char *const *edits, int edit_count) {
    enum { OWN = 2 + REPRODUCE_LAYER_EDITS };
    const double r = experiment->radius;
    char texts[OWN][REPRODUCE_EDIT_SIZE];
    const char *all[MAX_EDITS];
    Err err = {0};
    Scene *shipped = scene_load(scene_file, NULL, 0, &err);
    experiment_need(shipped != NULL, &err);
    snprintf(texts[0], sizeof texts[0], "particleRadius=%.9g", r);
    snprintf(texts[1], sizeof texts[1], "timeStepSize=%.9g", carensac_time_step(r));
    reproduce_keep_layer(shipped, r, texts + 2);
    scene_free(shipped);
    for (int k = 0; k < OWN; k++)
        all[k] = texts[k];
    for (int k = 0; k < edit_count; k++)
        all[OWN + k] = edits[k];
    Scene *scene = scene_load(scene_file, all, OWN + edit_count, &err);
    experiment_need(scene != NULL, &err);
    SkiffSim *sim = scene_start(scene, experiment->threads, SKIFF_SIMD_AUTO, &err);
    experiment_need(sim != NULL, &err);
    scene_free(scene);
    return sim;
}

/* The depth is that of the half's particles, by their volume. */
static void add_step(Corridor *corridor, const SkiffSim *sim) {
    const int row = corridor->count++;
    const SkiffParticles particles = skiff_particles(sim);
    corridor->time[row] = skiff_time(sim);
    for (uint32_t i = 0; i < particles.count; i++) {
        const float *v = particles.velocity[i];
        const double z = (double)particles.position[i][2] + particles.origin[2];
        if (z > length)
            continue;
        const int side = z < 0.0 ? CLOSED : OPEN;
        corridor->energy[side][row] += (double)(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
        corridor->depth[side][row] += experiment_particle_volume(sim) / length; /* the corridor is 1 m wide */
    }
}

static Corridor *run(const Experiment *experiment, const char *name, const char *const *edits,
                     int edit_count) {
    Corridor *corridor = calloc(1, sizeof *corridor);
    if (corridor == NULL)
        exit(ERR_IO);
    SkiffSim *sim = start(experiment, edits, edit_count);
    while (skiff_time(sim) < duration && corridor->count < MAX_STEPS) {
        experiment_step(sim);
        add_step(corridor, sim);
    }
    skiff_destroy(sim);
    FileWriter series = experiment_series(experiment, name, "t,closed_energy,energy,closed_depth,depth");
    for (int k = 0; k < corridor->count; k++)
        fprintf(series.stream, "%.6g,%.6g,%.6g,%.6g,%.6g\n", corridor->time[k], corridor->energy[CLOSED][k],
                corridor->energy[OPEN][k], corridor->depth[CLOSED][k], corridor->depth[OPEN][k]);
    experiment_close(&series);
    return corridor;
}

/* Largest energy of the first reflection over that at the closed end. */
static double first_reflection(const Corridor *corridor) {
    double most[SIDE_COUNT] = {0};
    for (int k = 0; k < corridor->count; k++)
        for (int side = 0; side < SIDE_COUNT; side++)
            if (corridor->time[k] >= first_from && corridor->time[k] <= first_to)
                most[side] = fmax(most[side], corridor->energy[side][k]);
    return most[OPEN] / most[CLOSED];
}

static double energy_at_rest(const Corridor *corridor) {
    double sum[SIDE_COUNT] = {0};
    for (int k = 0; k < corridor->count; k++)
        for (int side = 0; side < SIDE_COUNT; side++)
            if (corridor->time[k] >= rest_from && corridor->time[k] <= rest_to)
                sum[side] += corridor->energy[side][k];
    return sum[OPEN] / sum[CLOSED];
}

/* Root mean square of how far the energy is from that of a corridor that goes on, over that of the closed
 * half. */
static double sent_back(const Corridor *corridor, const Corridor *reference) {
    double sum[SIDE_COUNT] = {0};
    for (int k = 0; k < corridor->count; k++)
        for (int side = 0; side < SIDE_COUNT; side++)
            if (corridor->time[k] >= wave_from) {
                const double more = corridor->energy[side][k] - reference->energy[OPEN][k];
                sum[side] += more * more;
            }
    return sqrt(sum[OPEN] / sum[CLOSED]);
}

static double level_change(const Corridor *corridor, const Corridor *reference) {
    const int last = corridor->count - 1;
    return corridor->depth[OPEN][last] - reference->depth[OPEN][last];
}

int main(int argc, char **argv) {
    Experiment experiment = experiment_begin_sized("corridor", radius_default, argc, argv);
    Corridor *reference = run(&experiment, "endless", endless, 3);
    experiment_note(&experiment, "endless: first reflection, open / closed", first_reflection(reference), "");
    experiment_note(&experiment, "endless: energy at 5.9 s, open / closed", energy_at_rest(reference), "");
    const struct {
        const char *name;
        const char *const *edits;
        int count;
    } ways[] = {{"shipped", NULL, 0}, {"inflow-at-once", at_once, 1}, {"both-as-waves", as_waves, 1}};
    for (int k = 0; k < 3; k++) {
        Corridor *corridor = run(&experiment, ways[k].name, ways[k].edits, ways[k].count);
        printf("%s\n", ways[k].name);
        experiment_aim(&experiment, "first reflection, absorbing / closed", first_reflection(corridor), 0.35,
                       false, "");
        experiment_limit(&experiment, "energy sent back, of what a wall does", sent_back(corridor, reference),
                         0.2, "");
        experiment_note(&experiment, "depth at the end over the endless one's",
                        level_change(corridor, reference), "m");
        if (k == 0)
            experiment_limit(&experiment, "energy at 5.9 s, absorbing / closed", energy_at_rest(corridor),
                             0.1, "");
        else
            experiment_note(&experiment, "energy at 5.9 s, absorbing / closed", energy_at_rest(corridor), "");
        free(corridor);
    }
    free(reference);
    return experiment_end(&experiment);
}
