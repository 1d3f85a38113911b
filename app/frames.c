/* Frames from a simulation, to files and back.
 *
 * A frame rarely falls on the end of a step. Semi-implicit Euler moves a particle evenly with its new
 * velocity, so going back from the end of the step by v dt is exact, and the picture needs no state from the
 * step before but the poses of the bodies, between which position is interpolated linearly and rotation along
 * the arc. Positions are relative to the origin at the end of the step: a window that moved has no part in
 * it. */
#include "frames.h"

#include "engine/base/state_file.h"

#include <dirent.h>
#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { FRAME_VERSION = 1, BODY_SCALARS = 10, STATE_SCALARS = 15 };

_Static_assert(sizeof(FrameBody) == BODY_SCALARS * sizeof(double), "bodies are saved as they are");

void frame_free(Frame *frame) {
    free(frame->position);
    free(frame->velocity);
    free(frame->density);
    free(frame->pressure);
    free(frame->id);
    free(frame->birth);
    free(frame->gone);
    free(frame->edge);
    free(frame->bodies);
    *frame = (Frame){0};
}

/* Room for that many; the content is lost. */
static bool frame_reserve(Frame *frame, uint64_t count, int body_count, Err *err) {
    if (count > frame->capacity || body_count != frame->body_count || !frame->position) {
        uint64_t capacity = count + count / 8 + 64;
        frame_free(frame);
        bool ok = capacity <= UINT32_MAX && (frame->position = calloc(capacity, sizeof *frame->position)) &&
                  (frame->velocity = calloc(capacity, sizeof *frame->velocity)) &&
                  (frame->density = calloc(capacity, sizeof *frame->density)) &&
                  (frame->pressure = calloc(capacity, sizeof *frame->pressure)) &&
                  (frame->id = calloc(capacity, sizeof *frame->id)) &&
                  (frame->birth = calloc(capacity, sizeof *frame->birth)) &&
                  (frame->gone = calloc(capacity, sizeof *frame->gone)) &&
                  (frame->edge = calloc(capacity, sizeof *frame->edge)) &&
                  (frame->bodies = calloc((size_t)body_count + 1, sizeof *frame->bodies));
        if (!ok) {
            frame_free(frame);
            return err_set(err, ERR_INPUT, "not enough memory for a frame of %llu particles",
                           (unsigned long long)count);
        }
        frame->capacity = (uint32_t)capacity;
        frame->body_count = body_count;
    }
    return true;
}

/* ---- From a simulation ---- */

static bool window_of(const SkiffSim *sim, Frame *frame) {
    SkiffWindow window;
    if (!skiff_window(sim, &window))
        return false;
    memcpy(frame->window_centre, window.centre, sizeof frame->window_centre);
    frame->level = window.level;
    frame->moves = window.moves;
    return true;
}

bool frame_window_distances(const SkiffSim *sim, const float (*points)[4], uint32_t count, float *distance) {
    SkiffWindow window;
    if (!skiff_window(sim, &window))
        return false;
    skiff_window_distances(sim, points, count, distance);
    return true;
}

void frame_poses(const SkiffSim *sim, FrameBody *bodies) {
    for (int i = 0; i < skiff_body_count(sim); i++) {
        SkiffBody body = skiff_body(sim, i);
        memcpy(bodies[i].position, body.position, sizeof bodies[i].position);
        memcpy(bodies[i].rotation, body.rotation, sizeof bodies[i].rotation);
        memcpy(bodies[i].velocity, body.velocity, sizeof bodies[i].velocity);
    }
}

/* From a to b along the shorter arc; `share` 0..1. */
static void slerp(const double a[4], const double b[4], double share, double out[4]) {
    double dot = a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3];
    double sign = dot < 0 ? -1 : 1, angle = acos(fmin(1, fabs(dot)));
    /* below that angle, sin(x) is x */
    double wa = angle > 1e-6 ? sin((1 - share) * angle) / sin(angle) : 1 - share;
    double wb = angle > 1e-6 ? sin(share * angle) / sin(angle) : share;
    double length = 0;
    for (int k = 0; k < 4; k++) {
        out[k] = wa * a[k] + sign * wb * b[k];
        length += out[k] * out[k];
    }
    for (int k = 0; k < 4; k++)
        out[k] /= sqrt(length);
}

static void between(const FrameBody *before, double share, FrameBody *body) {
    for (int k = 0; k < 3; k++) {
        body->position[k] = before->position[k] + share * (body->position[k] - before->position[k]);
        body->velocity[k] = before->velocity[k] + share * (body->velocity[k] - before->velocity[k]);
    }
    slerp(before->rotation, body->rotation, share, body->rotation);
}

static void copy_particles(Frame *frame, const SkiffParticles *particles, float back) {
    size_t count = particles->count;
    memcpy(frame->velocity, particles->velocity, count * sizeof *frame->velocity);
    memcpy(frame->id, particles->id, count * sizeof *frame->id);
    memcpy(frame->birth, particles->birth, count * sizeof *frame->birth);
    for (size_t i = 0; i < count; i++) {
        /* Before the first step it is not known: water at rest. */
        frame->density[i] = particles->density ? particles->density[i] : 1;
        frame->pressure[i] = frame->gone[i] = 0;
        for (int k = 0; k < 3; k++)
            frame->position[i][k] = particles->position[i][k] - particles->velocity[i][k] * back;
        frame->position[i][3] = 0;
    }
}

static void copy_ghosts(Frame *frame, const SkiffGhosts *ghosts) {
    for (uint32_t g = 0; g < ghosts->count; g++) {
        uint32_t i = frame->count++;
        /* Negative: it was removed between the frame's time and the end of the step, and is still all there.
         */
        float gone = (float)(frame->time - ghosts->removed[g]);
        for (int k = 0; k < 3; k++) {
            frame->velocity[i][k] = ghosts->velocity[g][k];
            frame->position[i][k] = ghosts->position[g][k] + gone * ghosts->velocity[g][k];
        }
        frame->position[i][3] = frame->velocity[i][3] = 0;
        frame->density[i] = frame->pressure[i] = 0;
        frame->id[i] = ghosts->id[g];
        frame->birth[i] = ghosts->birth[g];
        frame->gone[i] = fmaxf(0, gone);
    }
}

bool frame_capture(Frame *frame, const SkiffSim *sim, const FrameBody *before, double before_time,
                   double time, Err *err) {
    SkiffParticles particles = skiff_particles(sim);
    SkiffGhosts ghosts = skiff_ghosts(sim);
    if (!frame_reserve(frame, (uint64_t)particles.count + ghosts.count, skiff_body_count(sim), err))
        return false;
    double end = skiff_time(sim);
    frame->time = time;
    memcpy(frame->origin, particles.origin, sizeof frame->origin);
    frame->spacing = 2 * skiff_params(sim)->particle_radius;
    frame->live = frame->count = particles.count;
    copy_particles(frame, &particles, (float)(end - time));
    copy_ghosts(frame, &ghosts);
    frame->has_window = window_of(sim, frame);
    if (!frame_window_distances(sim, (const float(*)[4])frame->position, frame->count, frame->edge))
        for (uint32_t i = 0; i < frame->count; i++)
            frame->edge[i] = -INFINITY;
    frame_poses(sim, frame->bodies);
    double share = before && end > before_time ? (time - before_time) / (end - before_time) : 1;
    for (int i = 0; before && share < 1 && i < frame->body_count; i++)
        between(&before[i], share, &frame->bodies[i]);
    return true;
}

bool frame_capture_pressure(Frame *frame, const SkiffSim *sim, Err *err) {
    return skiff_pressure(sim, frame->pressure, err);
}

/* ---- Files ---- */

static StateField state_field(const char *name, StateType type, uint32_t components, uint64_t count,
                              const void *data) {
    StateField field = {.type = type, .components = components, .count = count, .data = data};
    snprintf(field.name, sizeof field.name, "%s", name);
    return field;
}

/* The three coordinates that count of each particle; malloc'ed. */
static float *pack(const float (*vectors)[4], uint32_t count) {
    float *packed = malloc(((size_t)count * 3 + 1) * sizeof *packed);
    for (uint32_t i = 0; packed && i < count; i++)
        memcpy(packed + 3 * (size_t)i, vectors[i], 3 * sizeof *packed);
    return packed;
}

bool frame_save(const Frame *frame, const char *path, Err *err) {
    const FrameControls *controls = &frame->controls;
    const double state[STATE_SCALARS] = {frame->time,
                                         frame->rate,
                                         frame->origin[0],
                                         frame->origin[1],
                                         frame->origin[2],
                                         (double)frame->spacing,
                                         (double)frame->live,
                                         frame->has_window,
                                         frame->window_centre[0],
                                         frame->window_centre[1],
                                         frame->window_centre[2],
                                         frame->level,
                                         (double)frame->moves,
                                         controls->throttle,
                                         controls->rudder};
    uint8_t text[2][FRAME_TEXT_SIZE] = {{0}};
    memcpy(text[0], controls->keys, strnlen(controls->keys, FRAME_TEXT_SIZE - 1));
    memcpy(text[1], controls->camera, strnlen(controls->camera, FRAME_TEXT_SIZE - 1));
    text[0][FRAME_TEXT_SIZE - 1] = controls->has_keys;
    uint64_t count = frame->count;
    float *position = pack((const float(*)[4])frame->position, frame->count);
    float *velocity = pack((const float(*)[4])frame->velocity, frame->count);
    const StateField fields[] = {
        state_field("state", STATE_F64, 1, STATE_SCALARS, state),
        state_field("text", STATE_U8, FRAME_TEXT_SIZE, 2, text),
        state_field("bodies", STATE_F64, BODY_SCALARS, (uint64_t)frame->body_count, frame->bodies),
        state_field("position", STATE_F32, 3, count, position),
        state_field("velocity", STATE_F32, 3, count, velocity),
        state_field("density", STATE_F32, 1, count, frame->density),
        state_field("pressure", STATE_F32, 1, count, frame->pressure),
        state_field("id", STATE_U64, 1, count, frame->id),
        state_field("birth", STATE_F64, 1, count, frame->birth),
        state_field("gone", STATE_F32, 1, count - frame->live, frame->gone + frame->live),
        state_field("edge", STATE_F32, 1, count, frame->edge),
    };
    bool ok = position && velocity
                  ? state_file_write(path, FRAME_VERSION, fields, sizeof fields / sizeof *fields, err)
                  : err_set(err, ERR_IO, "%s: not enough memory to write it", path);
    free(position);
    free(velocity);
    return ok;
}

typedef struct Loader {
    const StateFile *file;
    const char *path;
    Err *err;
} Loader;

static const StateField *find(const Loader *loader, const char *name, StateType type, uint32_t components,
                              uint64_t count) {
    return state_file_field(loader->file, name, type, components, count, loader->err);
}

/* Into `count` elements of `out`. */
static bool load_array(const Loader *loader, const char *name, StateType type, uint64_t count, void *out) {
    const StateField *field = find(loader, name, type, 1, count);
    if (field && count > 0)
        memcpy(out, field->data, state_type_size(type) * count);
    return field != NULL;
}

static bool load_vectors(const Loader *loader, const char *name, uint64_t count, float (*out)[4]) {
    const StateField *field = find(loader, name, STATE_F32, 3, count);
    const float *packed = field ? field->data : NULL;
    for (uint64_t i = 0; packed && i < count; i++) {
        memcpy(out[i], packed + 3 * i, 3 * sizeof *packed);
        out[i][3] = 0;
        if (!isfinite(out[i][0] + out[i][1] + out[i][2]))
            return err_set(loader->err, ERR_INPUT, "%s: %s[%llu] is not finite", loader->path, name,
                           (unsigned long long)i);
    }
    return field != NULL;
}

static bool load_state(const Loader *loader, const double *state, const uint8_t *text, Frame *frame) {
    for (int i = 0; i < STATE_SCALARS - 2; i++) /* the controls may be NaN */
        if (!isfinite(state[i]))
            return err_set(loader->err, ERR_INPUT, "%s: state[%d] is not a finite number", loader->path, i);
    if (!(state[6] >= 0 && state[6] <= (double)frame->count && state[6] == floor(state[6])))
        return err_set(loader->err, ERR_INPUT, "%s: %g of %u particles exist", loader->path, state[6],
                       frame->count);
    if (!(state[1] > 0 && state[5] > 0 && state[12] >= 0 && state[12] < 1e18))
        return err_set(loader->err, ERR_INPUT, "%s: rate %g, spacing %g or moves %g is out of range",
                       loader->path, state[1], state[5], state[12]);
    frame->time = state[0];
    frame->rate = state[1];
    memcpy(frame->origin, state + 2, sizeof frame->origin);
    frame->spacing = (float)state[5];
    frame->live = (uint32_t)state[6];
    frame->has_window = state[7] != 0;
    memcpy(frame->window_centre, state + 8, sizeof frame->window_centre);
    frame->level = state[11];
    frame->moves = (uint64_t)state[12];
    FrameControls *controls = &frame->controls;
    *controls = (FrameControls){.throttle = state[13], .rudder = state[14]};
    memcpy(controls->keys, text, FRAME_TEXT_SIZE - 1);
    memcpy(controls->camera, text + FRAME_TEXT_SIZE, FRAME_TEXT_SIZE - 1);
    controls->has_keys = text[FRAME_TEXT_SIZE - 1] != 0;
    return true;
}

static bool load_fields(const Loader *loader, int body_count, Frame *frame) {
    const StateField *position = find(loader, "position", STATE_F32, 3, UINT64_MAX);
    const StateField *state = find(loader, "state", STATE_F64, 1, STATE_SCALARS);
    const StateField *text = find(loader, "text", STATE_U8, FRAME_TEXT_SIZE, 2);
    const StateField *bodies = find(loader, "bodies", STATE_F64, BODY_SCALARS, (uint64_t)body_count);
    if (!position || !state || !text || !bodies ||
        !frame_reserve(frame, position->count, body_count, loader->err))
        return false;
    uint64_t count = position->count;
    frame->count = (uint32_t)count;
    if (body_count > 0)
        memcpy(frame->bodies, bodies->data, (size_t)body_count * sizeof *frame->bodies);
    if (!load_state(loader, state->data, text->data, frame))
        return false;
    memset(frame->gone, 0, frame->live * sizeof *frame->gone);
    return load_vectors(loader, "position", count, frame->position) &&
           load_vectors(loader, "velocity", count, frame->velocity) &&
           load_array(loader, "density", STATE_F32, count, frame->density) &&
           load_array(loader, "pressure", STATE_F32, count, frame->pressure) &&
           load_array(loader, "id", STATE_U64, count, frame->id) &&
           load_array(loader, "birth", STATE_F64, count, frame->birth) &&
           load_array(loader, "gone", STATE_F32, count - frame->live, frame->gone + frame->live) &&
           load_array(loader, "edge", STATE_F32, count, frame->edge);
}

bool frame_load(Frame *frame, const char *path, int body_count, Err *err) {
    StateFile *file = state_file_open(path, FRAME_VERSION, err);
    if (!file)
        return false;
    const Loader loader = {file, path, err};
    bool ok = load_fields(&loader, body_count, frame);
    state_file_close(file);
    if (!ok)
        frame_free(frame);
    return ok;
}

/* ---- Results of a run ---- */

enum { PATH_SIZE = 4096 };

const char *frame_path(const char *output, const char *folder, int number, const char *suffix, size_t size,
                       char *path) {
    snprintf(path, size, "%.4000s/%s/frame_%06d.%s", output, folder, number, suffix);
    return path;
}

static bool remove_file(const char *path, Err *err) {
    return unlink(path) == 0 || errno == ENOENT ||
           err_set(err, ERR_IO, "%s: cannot be replaced: %s", path, strerror(errno));
}

/* The number in "frame_NNNNNN.SUFFIX", 0 for other names. `rest` receives SUFFIX. */
static int number_of(const char *name, const char **rest) {
    int number = 0, end = 0;
    bool matches = sscanf(name, "frame_%d.%n", &number, &end) == 1 && end > 0 && number > 0;
    *rest = name + end;
    return matches ? number : 0;
}

int frames_last(const char *output, const char *folder, const char *suffix) {
    char path[PATH_SIZE];
    int last = 0;
    snprintf(path, sizeof path, "%.4000s/%s", output, folder);
    DIR *directory = opendir(path);
    for (struct dirent *entry = directory ? readdir(directory) : NULL; entry; entry = readdir(directory)) {
        const char *rest;
        int number = number_of(entry->d_name, &rest);
        if (number > last && strcmp(rest, suffix) == 0)
            last = number;
    }
    if (directory)
        closedir(directory);
    return last;
}

bool frames_remove_sequence(const char *output, const char *folder, const char *suffix, Err *err) {
    char path[PATH_SIZE], temporary[32]; /* what a crash left */
    snprintf(temporary, sizeof temporary, "%s.tmp", suffix);
    snprintf(path, sizeof path, "%.4000s/%s", output, folder);
    DIR *directory = opendir(path);
    if (!directory)
        return errno == ENOENT || err_set(err, ERR_IO, "%s: cannot open: %s", path, strerror(errno));
    bool ok = true;
    for (struct dirent *entry = readdir(directory); ok && entry; entry = readdir(directory)) {
        const char *rest;
        if (number_of(entry->d_name, &rest) == 0 ||
            (strcmp(rest, suffix) != 0 && strcmp(rest, temporary) != 0))
            continue;
        snprintf(path, sizeof path, "%.3000s/%s/%.255s", output, folder, entry->d_name);
        ok = remove_file(path, err);
    }
    closedir(directory);
    snprintf(path, sizeof path, "%.4000s/%s", output, folder);
    rmdir(path); /* a folder with other things in it stays */
    return ok;
}

bool frames_remove(const char *output, Err *err) {
    static const char *const names[] = {"video.mp4", "video.mp4.tmp", "view.skiff"};
    char path[PATH_SIZE];
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
        snprintf(path, sizeof path, "%.4000s/%s", output, names[i]);
        if (!remove_file(path, err))
            return false;
    }
    return frames_remove_sequence(output, "frames", "png", err) &&
           frames_remove_sequence(output, "particles", "skiff", err);
}
