/* A run and its folder: see run.c for the order of events. */
#ifndef SKIFF_APP_RUN_FOLDER_H
#define SKIFF_APP_RUN_FOLDER_H

#include "cli.h"
#include "pilot.h"
#include "progress.h"
#include "scene.h"
#include "summary.h"
#include "tables.h"
#include "view.h"

typedef struct Run {
    const CliArgs *args;
    Scene *scene;
    SkiffSim *sim;
    Pilot pilot;
    Tables tables;
    View *view; /* NULL: no pictures */
    Progress progress;
    double end_time;                    /* s, simulated */
    double next_flush, next_checkpoint; /* s, wall clock */
} Run;

/* Whether the options fit what the output folder is, and files can be written there. Changes nothing. */
bool run_check_args(const CliArgs *args, Err *err);
/* Whether the folder holds a checkpoint of a run of this scene: what can be said before the scene becomes a
 * simulation. ERR_INPUT. */
bool run_check_resume(const Run *run, Err *err);
/* Begins the files of a new run, or loads the checkpoint and cuts the files back to it. */
bool run_begin(Run *run, Err *err);
/* Gives all rows to the operating system, and to the disk if `durable`. */
bool run_flush(Run *run, bool durable, Err *err);
/* Rows first, then the state and what the next frames depend on: what --resume goes on from. */
bool run_checkpoint(Run *run, Err *err);
/* Rows first, then the state of a run that cannot go on, as diverged.skiff. */
bool run_keep_diverged(Run *run, Err *err);
bool run_close(Run *run, Err *err);
/* summary.json, trace.json and report.html from the closed tables; prints the end. */
bool run_write_results(Run *run, const RunEnd *end, Err *err);

#endif
