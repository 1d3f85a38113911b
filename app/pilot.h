/* The pilot of a run: reads the input file, sets the drives before each step, records what was driven. */
#ifndef SKIFF_APP_PILOT_H
#define SKIFF_APP_PILOT_H

#include "csv.h"
#include "frames.h"
#include "helm.h"
#include "scene.h"

typedef struct Pilot {
    char *text; /* of the input file; NULL: there is none */
    size_t size;
    Script script;
    Helm helm;
    HelmPosition position; /* of the last step, also the last that was recorded */
    CsvWriter record;      /* run.input; not open when nothing can be driven */
    const char *file;      /* for messages */
    char path[4096];
} Pilot;

/* Reads the input: `file` (--input), or the copy that a resumed run's folder holds, or the one the scene
 * names. All problems of the file are in the message; so is that it drives and the scene has nothing to
 * drive: a run must not fill a sea first to find that out. Writes nothing. folder: NULL for a new run. */
bool pilot_read(Pilot *pilot, const Scene *scene, const char *file, const char *folder, Err *err);
/* Before each step. */
bool pilot_step(Pilot *pilot, SkiffSim *sim, Err *err);
/* What is being driven now, for a picture: events of this moment count, though no step has seen them yet, so
 * that frame 1 has the camera of the frames after it. */
void pilot_show(const Pilot *pilot, const SkiffSim *sim, FrameControls *controls);
void pilot_free(Pilot *pilot);
/* ---- Only where a folder keeps what was driven; a pilot without one drives all the same. ---- */

/* Begins run.input and the copy of the input in `folder`. */
bool pilot_create(Pilot *pilot, const char *folder, const SkiffSim *sim, Err *err);
/* Cuts run.input back to the step of `sim` and goes on from there. ERR_INPUT when the input file differs from
 * the run's before that. */
bool pilot_resume(Pilot *pilot, const Scene *scene, const char *folder, const SkiffSim *sim, Err *err);
bool pilot_flush(Pilot *pilot, bool durable, Err *err);
bool pilot_close(Pilot *pilot, Err *err);
/* Logs the events that a finished run has not come to. */
void pilot_report_left(const Pilot *pilot);

#endif
