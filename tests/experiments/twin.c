/* The same hull at the same speed in a moving window and in a still tank of twice the radius: what the window
 * leaves out must not be missed. Drag and surface are taken over the same time in both, before waves come
 * back from the walls of the tank (shallow water: sqrt(g h), to the side and back about 3.6 s). */
#include "experiment.h"

#include "app/carensac.h"
#include "app/reproduce.h"

enum { CELLS = 15, HALF = CELLS / 2 }; /* cells of the map of the surface, to a side */

static const double radius_default = 0.06, level = 0.9, window_radius = 2.5; /* m */
static const double speed = 1.4, ramp = 1.0;                                 /* m/s, s */
static const double from = 2.0, surface_from = 3.0, to = 3.6;                /* s */
static const double cell = 0.25;                                             /* m */

typedef struct Twin {
    double drag;                 /* mean, N, against the motion */
    double rise, trim;           /* of the hull at the end: m, degrees by the bow */
    double height[CELLS][CELLS]; /* of the water around the hull, mean over the last 0.6 s, m */
    double count;
} Twin;

static SkiffSim *make(const Experiment *experiment, bool window) {
    SkiffDef def = skiff_def_default();
    const double r = experiment->radius;
    def.threads = experiment->threads;
    def.params.particle_radius = (float)r;
    def.params.time_step = (float)carensac_time_step(r);
    def.params.boundary_offset = 1.15f;
    def.params.escape = SKIFF_ESCAPE_REMOVE;
    def.tank.geometry.kind = SKIFF_GEOMETRY_CYLINDER;
    def.tank.geometry.radius = (float)((window ? 1.0 : 2.0) * window_radius);
    def.tank.geometry.height = 3.0f;
    def.tank.geometry.translation[1] = 1.5f;
    def.tank.wet_height = 1.5f;
    def.sea =
        (SkiffSeaDef){.on = true, .level = (float)level, .follow = window ? "hull" : NULL, .absorb = window};
    SkiffBodyDef hull = skiff_body_default();
    hull.name = "hull";
    hull.geometry.kind = SKIFF_GEOMETRY_MESH;
    hull.geometry.file = SKIFF_SOURCE_DIR "/assets/meshes/boat.obj";
    for (int k = 0; k < 3; k++)
        hull.geometry.scale[k] = 0.5f;
    /* in the tank it crosses the middle */
    hull.geometry.translation[0] = window ? 0.0f : 2.5f;
    hull.geometry.translation[1] = (float)level;
    hull.mass = 185.0f;
    hull.free_axes = SKIFF_FREE_Y | SKIFF_FREE_RX | SKIFF_FREE_RZ;
    hull.velocity[0] = (float)-speed;
    hull.ramp_time = ramp;
    def.bodies = &hull;
    def.body_count = 1;
    return experiment_create(&def);
}

/* Adds the depth of water in each cell around the hull: particles times their volume over its area. */
static void add_heights(const SkiffSim *sim, double (*height)[CELLS]) {
    const SkiffBody hull = skiff_body(sim, 0);
    const SkiffParticles particles = skiff_particles(sim);
    const double share = experiment_particle_volume(sim) / (cell * cell);
    for (uint32_t i = 0; i < particles.count; i++) {
        if ((double)particles.position[i][1] + particles.origin[1] < 0.0)
            continue; /* below the floor: of the water at rest that stands around a moving window */
        const double x = (double)particles.position[i][0] + particles.origin[0] - hull.position[0];
        const double z = (double)particles.position[i][2] + particles.origin[2] - hull.position[2];
        const int column = (int)floor(x / cell + 0.5) + HALF, row = (int)floor(z / cell + 0.5) + HALF;
        if (column >= 0 && column < CELLS && row >= 0 && row < CELLS)
            height[row][column] += share;
    }
}

static Twin run(const Experiment *experiment, bool window) {
    SkiffSim *sim = make(experiment, window);
    Twin twin = {0};
    double steps = 0.0, maps = 0.0;
    while (skiff_time(sim) < to) {
        experiment_step(sim);
        if (skiff_time(sim) >= from) {
            twin.drag += skiff_body(sim, 0).force[0];
            steps++;
        }
        if (skiff_time(sim) >= surface_from) {
            add_heights(sim, twin.height);
            maps++;
        }
    }
    const SkiffBody hull = skiff_body(sim, 0);
    twin.drag /= steps;
    twin.rise = hull.position[1];
    twin.trim = reproduce_bow_up(&hull);
    twin.count = skiff_particles(sim).count;
    for (int k = 0; k < CELLS * CELLS; k++)
        twin.height[k / CELLS][k % CELLS] /= maps;
    skiff_destroy(sim);
    return twin;
}

/* Cells under the hull and those beyond 0.6 R are not compared. */
static bool is_compared(int row, int column) {
    const double x = cell * (column - HALF), z = cell * (row - HALF);
    return x * x + z * z <= 0.36 * window_radius * window_radius && !(fabs(x) < 1.1 && fabs(z) < 0.6);
}

int main(int argc, char **argv) {
    Experiment experiment = experiment_begin_sized("twin", radius_default, argc, argv);
    const double d = 2.0 * experiment.radius;
    Twin *tank = malloc(sizeof *tank), *window = malloc(sizeof *window);
    if (tank == NULL || window == NULL)
        return ERR_IO;
    *window = run(&experiment, true);
    *tank = run(&experiment, false);
    double sum_sq = 0.0, largest = 0.0, cells = 0.0, mean = 0.0;
    FileWriter map = experiment_series(&experiment, "surface", "x,z,window,tank");
    for (int row = 0; row < CELLS; row++)
        for (int column = 0; column < CELLS; column++) {
            const double difference = window->height[row][column] - tank->height[row][column];
            fprintf(map.stream, "%g,%g,%g,%g\n", cell * (column - HALF), cell * (row - HALF),
                    window->height[row][column], tank->height[row][column]);
            if (!is_compared(row, column))
                continue;
            sum_sq += difference * difference;
            mean += difference;
            largest = fmax(largest, fabs(difference));
            cells++;
        }
    experiment_close(&map);
    experiment_note(&experiment, "particles, window", window->count, "");
    experiment_note(&experiment, "particles, tank", tank->count, "");
    experiment_note(&experiment, "drag, tank", tank->drag, "N");
    experiment_check(&experiment, "drag, window", window->drag, tank->drag, 0.1 * fabs(tank->drag), "N");
    experiment_check(&experiment, "height of the hull, window against tank", window->rise - tank->rise, 0.0,
                     0.5 * d, "m");
    experiment_check(&experiment, "bow up, window against tank", window->trim - tank->trim, 0.0, 1.0, "deg");
    experiment_note(&experiment, "surface inside 0.6 R, mean difference", mean / cells, "m");
    experiment_note(&experiment, "surface inside 0.6 R, RMS difference", sqrt(sum_sq / cells), "m");
    experiment_limit(&experiment, "surface inside 0.6 R, largest difference of a cell", largest, d, "m");
    free(tank);
    free(window);
    return experiment_end(&experiment);
}
