/* A minute at rest: the tank neither creeps nor heats up.
 *
 * Tank 0.85 x 1.5 x 0.85 m, 16 x 20 x 16 particles of r 0.025 m, dt 3 ms, 60 s. In a working solver the
 * motion left over from filling dies away and the level stays; in one that feeds on its own errors speed
 * or level grow within this time.
 *
 * Limits: level within 0.5 d from 10 s on, both as a range and as a fitted trend; mean speed of the last
 * 10 s below that from 5 to 15 s; at most 6 density iterations on average and a mean density error of 0.01
 * %. */
#include "experiment.h"

enum { WINDOWS = 12 };

typedef struct Window {
    double speed, max_speed, surface, iterations, error;
    int steps;
} Window;

int main(int argc, char **argv) {
    Experiment experiment = experiment_begin("rest_60s", argc, argv);
    SkiffDef def = experiment_def(&experiment, 0.025f, 0.003f);
    experiment_tank(&def, 0.85f, 1.5f, 0.85f);
    const SkiffBlockDef block = experiment_block(&def, 16, 20, 16);
    def.blocks = &block;
    def.block_count = 1;
    SkiffSim *sim = experiment_create(&def);
    Window windows[WINDOWS] = {0};
    double low = INFINITY, high = -INFINITY, iterations = 0.0, early = 0.0;
    int early_steps = 0;
    while (skiff_time(sim) < 60.0 - 1e-9) {
        experiment_step(sim);
        const SkiffStats *stats = skiff_stats(sim);
        const int at = (int)((skiff_time(sim) - 1e-6) / 60.0 * WINDOWS);
        Window *window = &windows[at < WINDOWS ? at : WINDOWS - 1];
        const double surface = skiff_step_count(sim) % 10 ? NAN : experiment_column(sim).surface;
        window->speed += stats->mean_speed;
        window->max_speed = fmax(window->max_speed, stats->max_speed);
        window->iterations += stats->density_iterations;
        window->error += stats->density_error_percent;
        window->steps++;
        iterations += stats->density_iterations;
        if (!isnan(surface)) {
            window->surface = surface;
            low = skiff_time(sim) > 10.0 ? fmin(low, surface) : low;
            high = skiff_time(sim) > 10.0 ? fmax(high, surface) : high;
        }
        if (skiff_time(sim) > 5.0 && skiff_time(sim) <= 15.0) {
            early += stats->mean_speed;
            early_steps++;
        }
    }
    FileWriter series = experiment_series(&experiment, "windows",
                                          "t_s,mean_speed,max_speed,surface_m,iterations,error_percent");
    double sums[4] = {0};
    for (int w = 0; w < WINDOWS; w++) {
        const double n = windows[w].steps, t = 60.0 / WINDOWS * (w + 1);
        fprintf(series.stream, "%g,%.5g,%.5g,%.6g,%.4g,%.4g\n", t, windows[w].speed / n, windows[w].max_speed,
                windows[w].surface, windows[w].iterations / n, windows[w].error / n);
        if (w < 2)
            continue;
        sums[0] += t;
        sums[1] += windows[w].surface;
        sums[2] += t * t;
        sums[3] += t * windows[w].surface;
    }
    experiment_close(&series);
    const double d = 0.05, n = WINDOWS - 2;
    const double trend = (sums[3] - sums[0] * sums[1] / n) / (sums[2] - sums[0] * sums[0] / n);
    const Window *last = &windows[WINDOWS - 2];
    const double late = (last[0].speed + last[1].speed) / (last[0].steps + last[1].steps);
    experiment_limit(&experiment, "range of the level from 10 s on", high - low, 0.5 * d, "m");
    experiment_limit(&experiment, "trend of the level over 50 s", fabs(trend) * 50.0, 0.5 * d, "m");
    experiment_limit(&experiment, "mean speed of the last 10 s / of 5 to 15 s", late / (early / early_steps),
                     1.0, "");
    experiment_limit(&experiment, "density iterations, mean", iterations / (double)skiff_step_count(sim), 6.0,
                     "");
    experiment_limit(&experiment, "mean density error of the last 5 s", last[1].error / last[1].steps, 0.01,
                     "%");
    experiment_aim(&experiment, "mean speed of the last 10 s", late, 0.005, false, "m/s");
    experiment_note(&experiment, "largest speed of the last 5 s", last[1].max_speed, "m/s");
    skiff_destroy(sim);
    return experiment_end(&experiment);
}
