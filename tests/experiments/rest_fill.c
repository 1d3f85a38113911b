/* Water filled in at rest stays at rest: in every kind of tank, with and without a floating body, with and
 * without water that is there already, at three resolutions.
 *
 * Tanks are 60 r wide and filled 24 r deep. The body is a box turned by 45 degrees, half immersed, which with
 * samples on its surface takes the density below (water keeps 1.15 r from samples). Existing water: a tank
 * filled and left alone for 20 steps, of which a good half is taken out and filled again. dt 3 ms throughout.
 * Last the floating cube of [Carensac2023 sec. 5.5] at half its size, for 3 s; `skiff reproduce` floats it at
 * full size.
 *
 * Limits, over the first 100 free steps: mean speed 2.5 cm/s and largest 0.3 m/s at every step, level within
 * 0.25 d; the cube: height within 0.5 r, roll and pitch below 0.3 degrees. */
#include "experiment.h"

enum { FREE_STEPS = 100, BODY = 1, WATER = 2 };

static const float WIDTH = 60.0f, DEPTH = 24.0f; /* r */

typedef struct TankKind {
    const char *name;
    SkiffGeometryKind kind;
    float body_edge; /* r, that there is room for; 0: none */
} TankKind;

static const TankKind TANKS[] = {
    {"box", SKIFF_GEOMETRY_BOX, 20},       {"cylinder", SKIFF_GEOMETRY_CYLINDER, 20},
    {"sphere", SKIFF_GEOMETRY_SPHERE, 20}, {"star", SKIFF_GEOMETRY_STAR, 0},
    {"cone", SKIFF_GEOMETRY_CONE, 20},     {"pyramids", SKIFF_GEOMETRY_MESH, 14},
    {"harbour", SKIFF_GEOMETRY_MESH, 0},
};

/* What a case is made of; the def points into it. */
typedef struct Case {
    SkiffDef def;
    SkiffBlockDef block;
    SkiffBodyDef body;
    char file[4096];
    float level; /* m */
} Case;

/* Bounds of a mesh's vertices. */
static void mesh_bounds(const char *file, float min[3], float max[3]) {
    FILE *stream = fopen(file, "r");
    char line[256];
    if (stream == NULL) {
        fprintf(stderr, "%s: cannot be opened\n", file);
        exit(ERR_INPUT);
    }
    for (int k = 0; k < 3; k++) {
        min[k] = INFINITY;
        max[k] = -INFINITY;
    }
    while (fgets(line, sizeof line, stream)) {
        float v[3];
        if (sscanf(line, "v %f %f %f", &v[0], &v[1], &v[2]) != 3)
            continue;
        for (int k = 0; k < 3; k++) {
            min[k] = fminf(min[k], v[k]);
            max[k] = fmaxf(max[k], v[k]);
        }
    }
    fclose(stream);
}

/* A mesh is scaled to WIDTH along its longest side, and stands with its lowest point at y = 0. */
static void set_mesh(Case *it, const char *name, float r) {
    SkiffGeometryDef *geometry = &it->def.tank.geometry;
    float min[3], max[3], widest = 0.0f;
    snprintf(it->file, sizeof it->file, "%s/assets/meshes/%s.obj", SKIFF_SOURCE_DIR, name);
    mesh_bounds(it->file, min, max);
    geometry->file = it->file;
    for (int k = 0; k < 3; k += 2)
        widest = fmaxf(widest, max[k] - min[k]);
    const float scale = WIDTH * r / widest;
    for (int k = 0; k < 3; k++) {
        geometry->scale[k] = scale;
        geometry->translation[k] = scale * (k == 1 ? -min[1] : -0.5f * (min[k] + max[k]));
    }
}

static void set_tank(Case *it, const TankKind *tank, float r) {
    SkiffGeometryDef *geometry = &it->def.tank.geometry;
    const float width = WIDTH * r, height = 2.0f * DEPTH * r;
    geometry->kind = tank->kind;
    memcpy(geometry->size, (float[]){width, height, width}, sizeof geometry->size);
    geometry->height = height;
    geometry->radius = 0.5f * width;
    geometry->inner_radius = geometry->top_radius = 0.25f * width;
    geometry->branches = 5;
    geometry->translation[1] = tank->kind == SKIFF_GEOMETRY_SPHERE ? 0.5f * width : 0.5f * height;
    if (tank->kind == SKIFF_GEOMETRY_MESH)
        set_mesh(it, tank->name, r);
}

/* Of a cube that floats half immersed: water keeps 1.15 r from its samples, which makes it larger than it is;
 * 4 % less is what floats in tanks so narrow that their walls keep water away, too. */
static float floating_density(float edge) {
    const float swollen = (edge + 2.3f) / edge;
    return 1000.0f * 0.5f * swollen * swollen * swollen * 0.96f;
}

static void case_make(Case *it, const Experiment *experiment, const TankKind *tank, int with, float r) {
    *it = (Case){.def = skiff_def_default(),
                 .block = skiff_block_default(),
                 .body = skiff_body_default(),
                 .level = DEPTH * r};
    it->def.threads = experiment->threads;
    it->def.params.particle_radius = r;
    set_tank(it, tank, r);
    it->block.fill = SKIFF_FILL_REST;
    for (int k = 0; k < 3; k++) {
        it->block.start[k] = k == 1 ? 0.0f : -0.5f * WIDTH * r;
        it->block.end[k] = k == 1 ? it->level : 0.5f * WIDTH * r;
    }
    it->def.blocks = &it->block;
    it->def.block_count = 1;
    if (!(with & BODY))
        return;
    it->body.name = "box";
    it->body.geometry.kind = SKIFF_GEOMETRY_BOX;
    for (int k = 0; k < 3; k++)
        it->body.geometry.size[k] = tank->body_edge * r;
    memcpy(it->body.geometry.rotation_axis, (float[]){1, 0, 0}, sizeof it->body.geometry.rotation_axis);
    it->body.geometry.rotation_angle = (float)(pi / 4);
    it->body.geometry.translation[1] = it->level;
    it->body.density = floating_density(tank->body_edge);
    it->body.free_axes = SKIFF_FREE_ALL;
    it->def.bodies = &it->body;
    it->def.body_count = 1;
}

/* Takes out all but a floor layer and one side, and fills that again with other points. */
static void refill(SkiffSim *sim, const Case *it) {
    Err err = {0};
    uint32_t removed;
    SkiffBlockDef block = it->block;
    block.end[0] *= 0.25f;
    block.start[1] = 0.2f * it->level;
    for (int k = 0; k < 3; k++)
        block.offset[k] = 0.7f * it->def.params.particle_radius * (float)(k + 1);
    for (int step = 0; step < 20; step++)
        experiment_step(sim);
    const double min[3] = {-INFINITY, (double)block.start[1], -INFINITY};
    const double max[3] = {(double)block.end[0], INFINITY, INFINITY};
    experiment_need(skiff_remove_box(sim, min, max, &removed, &err) && skiff_fill_block(sim, &block, &err),
                    &err);
}

static double mean_height(const SkiffSim *sim) {
    const SkiffParticles particles = skiff_particles(sim);
    double sum = 0.0;
    for (uint32_t i = 0; i < particles.count; i++)
        sum += (double)particles.position[i][1];
    return sum / particles.count + particles.origin[1];
}

static void run_case(Experiment *experiment, const TankKind *tank, int with, float r) {
    Case it;
    case_make(&it, experiment, tank, with, r);
    SkiffSim *sim = experiment_create(&it.def);
    if (with & WATER)
        refill(sim, &it);
    const double before = mean_height(sim);
    double mean = 0.0, largest = 0.0;
    for (int step = 0; step < FREE_STEPS; step++) {
        experiment_step(sim);
        mean = fmax(mean, skiff_stats(sim)->mean_speed);
        largest = fmax(largest, skiff_stats(sim)->max_speed);
    }
    /* between upright walls the level moves twice as far as the mean height */
    const double drift = fabs(mean_height(sim) - before) / (double)r;
    char name[64], what[96];
    snprintf(name, sizeof name, "%s%s%s, r %g", tank->name, with & BODY ? "+body" : "",
             with & WATER ? "+water" : "", (double)r);
    snprintf(what, sizeof what, "%s: mean speed", name);
    experiment_limit(experiment, what, mean, 0.025, "m/s");
    snprintf(what, sizeof what, "%s: largest speed", name);
    experiment_limit(experiment, what, largest, 0.3, "m/s");
    snprintf(what, sizeof what, "%s: level", name);
    experiment_limit(experiment, what, drift, 0.25, "d");
    skiff_destroy(sim);
}

/* [Carensac2023 sec. 5.5] with everything but r multiplied by `scale`. Water keeps 1.15 r off samples, which
 * makes the cube larger than it is: 550 kg/m^3 balance that at scale 1. */
static void float_cube(Experiment *experiment, float scale, float density) {
    SkiffDef def = skiff_def_default();
    SkiffBlockDef block = skiff_block_default();
    const float level = 3.0f * scale, half = 1.75f * scale;
    def.threads = experiment->threads;
    def.tank.geometry.kind = SKIFF_GEOMETRY_BOX;
    memcpy(def.tank.geometry.size, (float[]){2 * half, 5 * scale, 2 * half}, sizeof def.tank.geometry.size);
    def.tank.geometry.translation[1] = 2.5f * scale;
    def.tank.wet_height = level + 0.2f;
    block.fill = SKIFF_FILL_REST;
    memcpy(block.start, (float[]){-half, 0, -half}, sizeof block.start);
    memcpy(block.end, (float[]){half, level, half}, sizeof block.end);
    def.blocks = &block;
    def.block_count = 1;
    const float size[3] = {2 * scale, 2 * scale, 2 * scale}, centre[3] = {0, level, 0};
    SkiffBodyDef body = experiment_box("cube", size, centre, density);
    memcpy(body.geometry.rotation_axis, (float[]){1, 0, 0}, sizeof body.geometry.rotation_axis);
    body.geometry.rotation_angle = (float)(pi / 4);
    body.free_axes = SKIFF_FREE_ALL;
    def.bodies = &body;
    def.body_count = 1;
    SkiffSim *sim = experiment_create(&def);
    char what[64];
    snprintf(what, sizeof what, "cube_%g", (double)scale);
    FileWriter series = experiment_series(experiment, what, "t_s,height_r,roll_deg,pitch_deg");
    double worst[3] = {0};
    while (skiff_time(sim) < 3.0 - 1e-9) {
        experiment_step(sim);
        const SkiffBody cube = skiff_body(sim, 0);
        const double degrees = 2.0 * 180.0 / pi; /* of half the angle, which is small */
        const double now[3] = {(cube.position[1] - (double)level) / (double)def.params.particle_radius,
                               degrees * cube.rotation[0], degrees * cube.rotation[2]};
        for (int k = 0; k < 3; k++)
            worst[k] = fmax(worst[k], fabs(now[k]));
        fprintf(series.stream, "%g,%.5g,%.5g,%.5g\n", skiff_time(sim), now[0], now[1], now[2]);
    }
    experiment_close(&series);
    static const char *const names[] = {"height", "roll", "pitch"};
    for (int k = 0; k < 3; k++) {
        snprintf(what, sizeof what, "floating cube of %g m: %s", 2.0 * (double)scale, names[k]);
        experiment_limit(experiment, what, worst[k], k == 0 ? 0.5 : 0.3, k == 0 ? "r" : "deg");
    }
    skiff_destroy(sim);
}

int main(int argc, char **argv) {
    Experiment experiment = experiment_begin("rest_fill", argc, argv);
    static const float radii[] = {0.0125f, 0.025f, 0.05f};
    for (size_t t = 0; t < sizeof TANKS / sizeof *TANKS; t++)
        for (int with = 0; with <= (BODY | WATER); with++)
            for (int r = 0; r < 3; r++)
                if (!(with & BODY) || TANKS[t].body_edge > 0.0f)
                    run_case(&experiment, &TANKS[t], with, radii[r]);
    float_cube(&experiment, 0.5f, 600.0f);
    return experiment_end(&experiment);
}
