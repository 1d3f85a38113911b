/* The parts of `skiff reproduce carensac2023` that run a simulation over time: what they share, and what each
 * gives besides its sheet. reproduce.c has the list. */
#ifndef SKIFF_APP_REPRODUCE_H
#define SKIFF_APP_REPRODUCE_H

#include "cli.h"
#include "machine.h"
#include "scene.h"
#include "series.h"
#include "sheet.h"

typedef struct ReproduceJob {
    const CliArgs *args;
    Sheet *sheet;       /* with the paper's rows, to be given runs */
    const char *folder; /* for files that a set-up needs */
    Machine *machine;   /* described by the first simulation */
} ReproduceJob;

enum { REPRODUCE_BOAT_WINDOWS = 2 };

/* --radius, or without it the paper's, m. */
double reproduce_radius(const CliArgs *args);
/* A carried scene with particles of that radius, steps as long for their size as the paper's, and --duration,
 * or without it `duration` (s); then edited by `edits`. */
Scene *reproduce_scene(const ReproduceJob *job, const char *name, double duration, const char *const *edits,
                       int edit_count, Err *err);
/* Edits that leave the layer in which a scene absorbs as thick as it is there (m), whatever its particles'
 * radius becomes (m). `shipped`: the scene without edits. */
enum { REPRODUCE_LAYER_EDITS = 2, REPRODUCE_EDIT_SIZE = 64 };
void reproduce_keep_layer(const Scene *shipped, double radius,
                          char edits[REPRODUCE_LAYER_EDITS][REPRODUCE_EDIT_SIZE]);
/* A line of progress on stderr, twenty times on the way to `end` (s). */
void reproduce_tell(const ReproduceJob *job, const char *row, const SkiffSim *sim, double end);

/* fig5 [Carensac2023 sec. 5.6]: series of every step. */
bool reproduce_wedge(const ReproduceJob *job, Series *series, Err *err);
void reproduce_wedge_charts(FILE *out, const Series *series);

/* Degrees by which the bow, on the body's -x side, stands higher than at the start. */
double reproduce_bow_up(const SkiffBody *boat);
/* boat [Carensac2023 sec. 5.7]: a series for each row of the sheet. */
bool reproduce_boat(const ReproduceJob *job, Series series[REPRODUCE_BOAT_WINDOWS], Err *err);
void reproduce_boat_charts(FILE *out, const Sheet *sheet, const Series series[REPRODUCE_BOAT_WINDOWS]);

#endif
