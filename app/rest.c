/* skiff rest: water at rest as points, which shapes are filled from: makes a periodic tile, cuts a block out
 * of a run, shows how good either is; fills a scene and shows how still it stands. The engine does the work;
 * this file asks and prints. */
#include "commands.h"

#include "json_text.h"
#include "scene.h"

#include "engine/base/file.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* One figure of a table and its JSON line. */
typedef struct Figure {
    const char *key, *label, *unit;
    double value;
} Figure;

static void put_figures(json_t *line, const Figure *figures, int count) {
    for (int i = 0; i < count; i++)
        json_object_set_new(line, figures[i].key, json_text_float((float)figures[i].value));
}

static void print_line(json_t *line) {
    json_text_print(stdout, line, -1);
    putchar('\n');
    json_decref(line);
}

static void print_figures(const Figure *figures, int count) {
    for (int i = 0; i < count; i++)
        printf("  %-44s %12.6g %s\n", figures[i].label, figures[i].value, figures[i].unit);
}

/* ---- Quality ---- */

enum { FIGURE_COUNT = 16 };

static void list_figures(const SkiffTileInfo *info, const SkiffTileQuality *q, Figure figures[FIGURE_COUNT]) {
    const Figure list[FIGURE_COUNT] = {
        {"size_x", "size, x", "r", info->size[0]},
        {"size_y", "size, y", "r", info->size[1]},
        {"size_z", "size, z", "r", info->size[2]},
        {"number_density", "number density", "1/d^3", q->number_density},
        {"density_mean", "density, mean", "rest density", q->density_mean},
        {"density_sd_percent", "density, standard deviation", "%", 100 * q->density_sd},
        {"density_min", "density, smallest", "rest density", q->density_min},
        {"density_max", "density, largest", "rest density", q->density_max},
        {"gradient_rms", "h |sum V grad W|, rms", "", q->gradient_rms},
        {"gradient_max", "h |sum V grad W|, largest", "", q->gradient_max},
        {"force_rms", "the same with pressure shares, rms", "", q->force_rms},
        {"force_max", "the same with pressure shares, largest", "", q->force_max},
        {"share_sd", "pressure shares, standard deviation", "", q->share_sd},
        {"anisotropy_percent", "anisotropy", "%", 100 * q->anisotropy},
        {"nearest_min", "nearest point, least distance", "d", q->nearest_min},
        {"nearest_mean", "nearest point, mean distance", "d", q->nearest_mean},
    };
    memcpy(figures, list, sizeof list);
}

static void print_json(const SkiffTileInfo *info, const SkiffTileQuality *quality, const Figure *figures) {
    json_t *line = json_object();
    json_object_set_new(line, "kind", json_string(info->periodic ? "tile" : "block"));
    json_object_set_new(line, "points", json_integer(info->count));
    json_object_set_new(line, "measured", json_integer(quality->count));
    put_figures(line, figures, FIGURE_COUNT);
    print_line(line);
}

static bool print_quality(const SkiffTile *tile, bool as_json, Err *err) {
    SkiffTileQuality quality;
    if (!skiff_tile_measure(tile, &quality, err))
        return false;
    SkiffTileInfo info = skiff_tile_info(tile);
    Figure figures[FIGURE_COUNT];
    list_figures(&info, &quality, figures);
    if (as_json) {
        print_json(&info, &quality, figures);
        return true;
    }
    printf("%s of %u points", info.periodic ? "periodic tile" : "block", info.count);
    if (quality.count != info.count)
        printf(", %u of them with all their neighbours", quality.count);
    printf("\n\n");
    print_figures(figures, FIGURE_COUNT);
    return true;
}

/* Said before the work that would be lost. */
static bool check_output(const CliArgs *args, Err *err) {
    FileWriter writer;
    if (!args->output)
        return true;
    if (!file_begin(&writer, args->output, err))
        return false;
    file_abort(&writer);
    return true;
}

/* Saves where that is wanted, measures, and ends the tile. False as well when there is none. */
static bool finish_tile(SkiffTile *tile, const CliArgs *args, Err *err) {
    bool good = tile && (!args->output || skiff_tile_save(tile, args->output, err)) &&
                print_quality(tile, args->json, err);
    skiff_tile_destroy(tile);
    return good;
}

/* ---- Commands ---- */

bool rest_make_command(const CliArgs *args, Err *err) {
    SkiffTileDef def = skiff_tile_def_default();
    def.edge = args->edge;
    def.seed = (uint64_t)args->seed;
    def.threads = args->threads;
    return check_output(args, err) && finish_tile(skiff_tile_make(&def, err), args, err);
}

bool rest_surface_command(const CliArgs *args, Err *err) {
    return check_output(args, err) && finish_tile(skiff_tile_surface(args->threads, err), args, err);
}

bool rest_show_command(const CliArgs *args, Err *err) {
    return finish_tile(skiff_tile_open(args->operand, err), args, err);
}

/* Where the user gave no corner: two support radii inside the outermost particles, past what walls and
 * surface do to the arrangement. */
static bool find_box(const CliArgs *args, const SkiffSim *sim, double min[3], double max[3], Err *err) {
    const SkiffParticles particles = skiff_particles(sim);
    const double margin = 8.0 * (double)skiff_params(sim)->particle_radius;
    for (int k = 0; k < 3; k++) {
        float low = INFINITY, high = -INFINITY;
        for (uint32_t i = 0; i < particles.count; i++) {
            low = fminf(low, particles.position[i][k]);
            high = fmaxf(high, particles.position[i][k]);
        }
        min[k] = isnan(args->min[k]) ? (double)low + particles.origin[k] + margin : args->min[k];
        max[k] = isnan(args->max[k]) ? (double)high + particles.origin[k] - margin : args->max[k];
        if (!(min[k] < max[k]))
            return err_set(err, ERR_INPUT,
                           "%s: nothing to cut: the box reaches from %g to %g m in %c (--min, --max; by "
                           "default %g m, two "
                           "support radii, inside the outermost particles)",
                           args->operand, min[k], max[k], "xyz"[k], margin);
    }
    return true;
}

bool rest_cut_command(const CliArgs *args, Err *err) {
    char scene_path[4096], state_path[4096];
    if (!args->output)
        return err_set(err, ERR_USAGE, "-o FILE is missing");
    if (!file_exists(args->operand))
        return err_set(err, ERR_INPUT, "%s: there is no such folder", args->operand);
    if (!check_output(args, err))
        return false;
    snprintf(scene_path, sizeof scene_path, "%.4000s/scene.json", args->operand);
    snprintf(state_path, sizeof state_path, "%.4000s/state.skiff", args->operand);
    Scene *scene = scene_load(scene_path, NULL, 0, err);
    if (!scene)
        return false;
    double min[3], max[3];
    SkiffSim *sim = scene_start(scene, args->threads, SKIFF_SIMD_AUTO, err);
    bool good = sim && skiff_load(sim, state_path, err) && find_box(args, sim, min, max, err) &&
                finish_tile(skiff_tile_cut(sim, min, max, err), args, err);
    skiff_destroy(sim);
    scene_free(scene);
    return good;
}

/* ---- Filling ---- */

/* What a fill was and what the water did when it was let go. */
typedef struct Filled {
    SkiffFill fill;
    uint32_t particles;
    int free_steps;
    double mean_speed, max_speed; /* m/s, of the worst step */
    double drift;                 /* of the level, d */
} Filled;

static double mean_height(const SkiffSim *sim) {
    const SkiffParticles particles = skiff_particles(sim);
    double sum = 0;
    for (uint32_t i = 0; i < particles.count; i++)
        sum += (double)particles.position[i][1];
    return particles.count > 0 ? sum / particles.count + particles.origin[1] : 0;
}

static bool let_go(SkiffSim *sim, int steps, Filled *filled, Err *err) {
    const double before = mean_height(sim);
    for (int step = 0; step < steps; step++) {
        if (!skiff_step(sim, err))
            return false;
        filled->mean_speed = fmax(filled->mean_speed, skiff_stats(sim)->mean_speed);
        filled->max_speed = fmax(filled->max_speed, skiff_stats(sim)->max_speed);
    }
    /* between upright walls the level moves twice as far as the mean height */
    filled->drift = (mean_height(sim) - before) / (double)skiff_params(sim)->particle_radius;
    filled->free_steps = steps;
    return true;
}

static void print_filled(const Filled *filled, bool as_json) {
    const SkiffFill *fill = &filled->fill;
    const Figure figures[] = {
        {"particles", "particles", "", filled->particles},
        {"candidates", "near walls, bodies and water, at first", "", fill->candidates},
        {"selected", "the same after the selection", "", fill->selected},
        {"passes", "passes of the selection", "", fill->passes},
        {"density_mean", "their density, mean", "rest density", fill->density_mean},
        {"density_sd_percent", "their density, standard deviation", "%", 100 * fill->density_spread},
        {"density_rms_percent", "the same about the target", "%", 100 * fill->density_rms},
        {"settled", "particles that settled", "", fill->active},
        {"settle_steps", "steps of settling", "", fill->steps},
        {"settle_v_mean", "speed in the last of them, mean", "m/s", fill->mean_speed},
        {"settle_v_max", "speed in the last of them, largest", "m/s", fill->max_speed},
        {"load_ms", "time to lay points", "ms", fill->load_ms},
        {"select_ms", "time to select", "ms", fill->select_ms},
        {"settle_ms", "time to settle", "ms", fill->settle_ms},
        {"free_steps", "free steps", "", filled->free_steps},
        {"v_mean", "mean speed, worst free step", "m/s", filled->mean_speed},
        {"v_max", "largest speed, worst free step", "m/s", filled->max_speed},
        {"level_drift_d", "level's drift over the free steps", "d", filled->drift},
    };
    enum { COUNT = sizeof figures / sizeof *figures };
    if (!as_json) {
        print_figures(figures, COUNT);
        return;
    }
    json_t *line = json_object();
    put_figures(line, figures, COUNT);
    print_line(line);
}

bool rest_fill_command(const CliArgs *args, Err *err) {
    Scene *scene = scene_load(args->operand, args->edits, args->edit_count, err);
    if (!scene)
        return false;
    SkiffSim *sim = scene_start(scene, args->threads, (SkiffSimd)args->simd, err);
    Filled filled = {0};
    bool good = sim != NULL;
    if (good) {
        filled.fill = *skiff_fill(sim);
        filled.particles = skiff_particles(sim).count;
        good = filled.fill.particles > 0 ||
               err_set(err, ERR_INPUT,
                       "%s: nothing in it is filled with water at rest at the start; a block is with --set "
                       "FluidBlocks[0].fill=rest",
                       args->operand);
    }
    good = good && let_go(sim, args->free_steps, &filled, err);
    if (good)
        print_filled(&filled, args->json);
    skiff_destroy(sim);
    scene_free(scene);
    return good;
}
