/* skiff check: what a scene means. The effective scene goes to stdout, so that it can be kept; the summary
 * goes to stderr. */
#include "commands.h"

#include "json_text.h"
#include "pilot.h"
#include "scene.h"
#include "summary.h"

#include <math.h>
#include <stdio.h>

/* Rounding errors of exact integrals are not worth reading. */
static double tidy(double value) {
    return fabs(value) < 1e-9 ? 0.0 : value;
}

static void print_body(const SkiffBody *body) {
    fprintf(stderr, "    %s: mass %.6g kg, centre (%.5g, %.5g, %.5g) m, %u samples\n", body->name, body->mass,
            tidy(body->position[0]), tidy(body->position[1]), tidy(body->position[2]), body->sample_count);
    for (int row = 0; row < 3; row++)
        fprintf(stderr, "      %s [%11.5g %11.5g %11.5g]%s\n", row == 0 ? "inertia" : "       ",
                tidy(body->inertia[row][0]), tidy(body->inertia[row][1]), tidy(body->inertia[row][2]),
                row == 2 ? " kg m^2" : "");
}

static void print_summary(const Scene *scene, const SkiffSim *sim) {
    double dt = (double)skiff_params(sim)->time_step;
    int later = 0;
    for (int i = 0; i < scene->def.block_count; i++)
        later += scene->def.blocks[i].time > scene->def.start_time ? scene->def.blocks[i].repeat
                                                                   : scene->def.blocks[i].repeat - 1;
    fprintf(stderr, "%s: ok\n", scene->file);
    const uint32_t particles = skiff_particles(sim).count;
    fprintf(stderr, "  particles         %u%s\n", particles,
            particles == 0 && later == 0 ? ": the scene has no fluid" : "");
    if (later > 0)
        fprintf(stderr, "  emitted later     %d blocks\n", later);
    fprintf(stderr, "  boundary samples  %u\n", summary_sample_count(sim));
    fprintf(stderr, "  duration          %g s, %.0f steps of %g ms\n", scene->duration, scene->duration / dt,
            1000 * dt);
    fprintf(stderr, "  probe channels    %d\n", skiff_probe_channel_count(sim));
    fprintf(stderr, "  memory            %.1f MB\n", (double)skiff_memory(sim) / 1e6);
    fprintf(stderr, "  bodies            %d\n", skiff_body_count(sim));
    for (int i = 0; i < skiff_body_count(sim); i++) {
        SkiffBody body = skiff_body(sim, i);
        print_body(&body);
    }
}

static bool print_json(json_t *value, Err *err) {
    if (!value)
        return err_set(err, ERR_IO, "out of memory");
    json_text_print(stdout, value, 0);
    putchar('\n');
    fflush(stdout); /* before what follows on stderr; a failure shows when the program ends */
    json_decref(value);
    return true;
}

bool check_command(const CliArgs *args, Err *err) {
    if (args->schema)
        return print_json(scene_schema(), err);
    Scene *scene = scene_load(args->operand, args->edits, args->edit_count, err);
    if (!scene)
        return false;
    Pilot pilot;
    SkiffSim *sim = pilot_read(&pilot, scene, NULL, NULL, err)
                        ? scene_start(scene, args->threads, (SkiffSimd)args->simd, err)
                        : NULL;
    bool ok = sim && print_json(scene_effective(scene), err);
    if (ok)
        print_summary(scene, sim);
    skiff_destroy(sim);
    pilot_free(&pilot);
    scene_free(scene);
    return ok;
}
