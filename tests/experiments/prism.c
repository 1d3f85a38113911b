/* A square prism of density ratio 0.6 does not float on a face: it rolls until an edge points up.
 *
 * Prism of 0.5 x 0.5 x 0.8 m, free in y and about its long axis z, in a tank of 2.0 x 1.4 x 0.86 m that it
 * nearly spans (the gap at its ends is too thin for water, so the flow is that of a section); 38 x 18 x 16
 * particles of r 0.025 m, dt 3 ms. It starts turned by 30 degrees, is held for 2 s and then left for 14 s;
 * the mean angle of the last 3 s counts.
 *
 * Expected: 45 +- 3 degrees. Flotation of a square section: for ratios between 0.28 and 0.72 the diagonal
 * position is the stable one. */
#include "experiment.h"

int main(int argc, char **argv) {
    Experiment experiment = experiment_begin("prism", argc, argv);
    SkiffDef def = experiment_def(&experiment, 0.025f, 0.003f);
    experiment_tank(&def, 2.0f, 1.4f, 0.86f);
    def.tank.open = false;
    const SkiffBlockDef block = experiment_block(&def, 38, 18, 16);
    SkiffBodyDef prism = experiment_box("prism", (const float[3]){0.5f, 0.5f, 0.8f},
                                        (const float[3]){1.0f, 0.75f, 0.43f}, 600.0f);
    const float axis[3] = {0, 0, 1};
    memcpy(prism.geometry.rotation_axis, axis, sizeof axis);
    prism.geometry.rotation_angle = (float)(30.0 / 180.0 * pi);
    prism.free_axes = SKIFF_FREE_Y | SKIFF_FREE_RZ;
    prism.release_time = 2.0;
    def.blocks = &block;
    def.block_count = 1;
    def.bodies = &prism;
    def.body_count = 1;
    SkiffSim *sim = experiment_create(&def);
    experiment_note(&experiment, "particles", skiff_particles(sim).count, "");
    FileWriter series = experiment_series(&experiment, "series", "t_s,angle_deg,centre_y_m");
    double sum = 0.0, low = INFINITY, high = -INFINITY;
    int count = 0;
    while (skiff_time(sim) < 16.0 - 1e-9) {
        experiment_step(sim);
        const SkiffBody body = skiff_body(sim, 0);
        const double angle = 30.0 + 360.0 / pi * atan2(body.rotation[2], body.rotation[3]);
        if (skiff_step_count(sim) % 10 == 0)
            fprintf(series.stream, "%.5g,%.5g,%.5g\n", skiff_time(sim), angle, body.position[1]);
        if (skiff_time(sim) <= 13.0)
            continue;
        sum += angle;
        low = fmin(low, angle);
        high = fmax(high, angle);
        count++;
    }
    experiment_close(&series);
    /* a square looks the same every quarter turn */
    const double mean = sum / count, angle = mean - 90.0 * floor(mean / 90.0);
    experiment_check(&experiment, "angle, mean of the last 3 s", angle, 45.0, 3.0, "deg");
    experiment_note(&experiment, "range of the angle in that time", high - low, "deg");
    skiff_destroy(sim);
    return experiment_end(&experiment);
}
