/* One moment of a simulation as plain arrays: what is drawn, saved and exported. */
#ifndef SKIFF_APP_FRAMES_H
#define SKIFF_APP_FRAMES_H

#include "engine/skiff.h"

enum { FRAME_TEXT_SIZE = 64 };
static const double frame_time_tolerance = 1e-7; /* s: two times this close are the same */

typedef struct FrameBody {
    double position[3]; /* of the centre of mass, world, m */
    double rotation[4]; /* body axes -> world, unit quaternion x y z w */
    double velocity[3]; /* m/s */
} FrameBody;

/* What was driven at that time. */
typedef struct FrameControls {
    double throttle, rudder;      /* -1..1; NaN: there is no drive */
    char keys[FRAME_TEXT_SIZE];   /* pressed, separated by blanks */
    char camera[FRAME_TEXT_SIZE]; /* chosen by the input script; "": none yet */
    bool has_keys;                /* keys are the input */
} FrameControls;

/* Particles [0, live) exist; [live, count) were removed a moment ago and are moving on as they did. Owned;
 * zero-initialise, reuse, frame_free. */
typedef struct Frame {
    double time;      /* s */
    double rate;      /* frames a second of the sequence it belongs to */
    double origin[3]; /* world = origin + position, m */
    float spacing;    /* d, m */
    uint32_t live, count, capacity;
    float (*position)[4]; /* m, local; [3] is 0 */
    float (*velocity)[4]; /* m/s; [3] is 0 */
    float *density;       /* rho / rho0; 0 past live */
    float *pressure;      /* Pa; 0 past live, and where nobody asked for it */
    uint64_t *id;
    double *birth; /* s */
    float *gone;   /* s since removal; 0 before live */
    float *edge;   /* m, signed distance to the window's edge, negative inside; -INFINITY: no window */
    bool has_window;
    double window_centre[3]; /* world, m */
    double level;            /* world y of still water, m */
    uint64_t moves;          /* of the window, so far */
    FrameBody *bodies;
    int body_count;
    FrameControls controls;
} Frame;

void frame_free(Frame *frame);

/* The poses of all bodies now, into memory of the caller. */
void frame_poses(const SkiffSim *sim, FrameBody *bodies);

/* The state at `time`, which lies in the last step of `sim` or at its end. Particles: x - v (end - time),
 * exactly where a semi-implicit step had them. Bodies: between `before` (poses at the beginning of the step,
 * at `before_time`; NULL: those of the end) and now. ERR_INPUT when memory is exhausted. */
bool frame_capture(Frame *frame, const SkiffSim *sim, const FrameBody *before, double before_time,
                   double time, Err *err);

/* Adds the pressures, which take a search for neighbours, to a frame just captured. */
bool frame_capture_pressure(Frame *frame, const SkiffSim *sim, Err *err);

/* Horizontal signed distances to the window's edge (m, negative inside) at count points of the plane y = 0,
 * local. False where there is no window. */
bool frame_window_distances(const SkiffSim *sim, const float (*points)[4], uint32_t count, float *distance);

/* A checked binary file (engine/base/state_file.h), 52 bytes a particle. */
bool frame_save(const Frame *frame, const char *path, Err *err);
/* ERR_INPUT when the file is missing, damaged or has another number of bodies. The frame is then empty. */
bool frame_load(Frame *frame, const char *path, int body_count, Err *err);

/* OUTPUT/FOLDER/frame_NNNNNN.SUFFIX; number from 1 on. */
const char *frame_path(const char *output, const char *folder, int number, const char *suffix, size_t size,
                       char *path);

/* The largest number of such files; 0: there are none. */
int frames_last(const char *output, const char *folder, const char *suffix);

/* Removes such files, and the folder if that leaves it empty. */
bool frames_remove_sequence(const char *output, const char *folder, const char *suffix, Err *err);
/* Removes the frames, the particles and the film of an earlier run. */
bool frames_remove(const char *output, Err *err);

#endif
