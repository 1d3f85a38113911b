/* The cameras: chase, fixed, orbit, top, bow.
 *
 * Smoothing is a critically damped spring that also knows how fast its goal moves, so that a boat at constant
 * speed stays where it is in the picture and only its accelerations are softened. With e = value - goal and a
 * goal that moves evenly between two updates, e'' = -2 w e' - w^2 e has the solution
 *   e(t) = (e0 + (e0' + w e0) t) exp(-w t),
 * which is used as it stands: no step size, so the path does not depend on the frame rate. No collision with
 * water or walls is looked for. */
#include "camera.h"

#include "engine/base/angle.h"

#include <math.h>
#include <string.h>

const char gfx_camera_kinds[] = "chase|fixed|orbit|top|bow";

GfxCameraDef gfx_camera_default(GfxCameraKind kind) {
    GfxCameraDef def = {.kind = kind,
                        .follows = true,
                        .forward = {1, 0, 0},
                        .distance = 7,
                        .height = 2.6,
                        .look_up = 0.3,
                        .azimuth = 0.55,
                        .smoothing = 0.6,
                        .fov_deg = 45};
    if (kind == GFX_CAMERA_ORBIT) {
        def.azimuth = 0.7;
        def.period = 24;
    }
    if (kind == GFX_CAMERA_TOP)
        def.distance = 12;
    if (kind == GFX_CAMERA_FIXED) {
        def.eye[0] = -6;
        def.eye[1] = 3;
        def.eye[2] = 6;
    }
    if (kind == GFX_CAMERA_BOW) {
        def.eye[1] = 0.9;
        def.fov_deg = 65;
    }
    return def;
}

/* v + 2 q x (q x v + w v) */
void gfx_camera_rotate(const double q[4], const double v[3], double out[3]) {
    double t[3] = {q[1] * v[2] - q[2] * v[1] + q[3] * v[0], q[2] * v[0] - q[0] * v[2] + q[3] * v[1],
                   q[0] * v[1] - q[1] * v[0] + q[3] * v[2]};
    double u[3] = {v[0] + 2 * (q[1] * t[2] - q[2] * t[1]), v[1] + 2 * (q[2] * t[0] - q[0] * t[2]),
                   v[2] + 2 * (q[0] * t[1] - q[1] * t[0])};
    memcpy(out, u, sizeof u);
}

static void spring_start(GfxSpring *spring, double goal) {
    *spring = (GfxSpring){.value = goal, .rate = 0, .goal = goal};
}

static void spring_move(GfxSpring *spring, double goal, double dt, double smoothing) {
    if (!(dt > 0))
        return;
    double goal_rate = (goal - spring->goal) / dt;
    spring->rate = smoothing > 0 ? spring->rate : goal_rate;
    if (smoothing > 0) {
        double w = 4.0 / smoothing; /* 1 % of a jump is left after 1.66 smoothing, 9 % after one */
        double e = spring->value - spring->goal, v = spring->rate - goal_rate;
        double decay = exp(-w * dt), slope = v + w * e;
        spring->value = goal + (e + slope * dt) * decay;
        spring->rate = goal_rate + (slope - w * (e + slope * dt)) * decay;
    } else {
        spring->value = goal;
    }
    spring->goal = goal;
}

/* Angle of the bow over the sea, nearest to `last`; a bow that points straight up has none and keeps `last`.
 */
static double heading_of(const GfxCameraDef *def, const GfxPose *pose, double last) {
    double bow[3];
    gfx_camera_rotate(pose->rotation, def->forward, bow);
    if (hypot(bow[0], bow[2]) < 1e-6 * fabs(bow[1]))
        return last;
    double angle = atan2(bow[2], bow[0]);
    return angle + 2 * pi * round((last - angle) / (2 * pi));
}

static void follow(const GfxCameraDef *def, GfxCameraState *state, const GfxPose *pose, double time) {
    double heading = heading_of(def, pose, state->heading.goal);
    if (state->updates == 0) {
        for (int k = 0; k < 3; k++)
            spring_start(&state->position[k], pose->position[k]);
        spring_start(&state->heading, heading);
    } else {
        double dt = time - state->time;
        for (int k = 0; k < 3; k++)
            spring_move(&state->position[k], pose->position[k], dt, def->smoothing);
        spring_move(&state->heading, heading, dt, def->smoothing);
    }
    state->updates += 1;
    state->time = time;
}

static void set3(double out[3], double x, double y, double z) {
    out[0] = x;
    out[1] = y;
    out[2] = z;
}

/* From `angle` (rad, from +x towards +z) and `distance`, looking at the centre. */
static void look_from(const GfxCameraDef *def, const double centre[3], double angle, GfxCameraView *view) {
    set3(view->eye, centre[0] + def->distance * cos(angle), centre[1] + def->height,
         centre[2] + def->distance * sin(angle));
    set3(view->target, centre[0], centre[1] + def->look_up, centre[2]);
}

static void look_on_board(const GfxCameraDef *def, const GfxPose *pose, GfxCameraView *view) {
    double eye[3], bow[3];
    const double vertical[3] = {0, 1, 0};
    gfx_camera_rotate(pose->rotation, def->eye, eye);
    gfx_camera_rotate(pose->rotation, def->forward, bow);
    gfx_camera_rotate(pose->rotation, vertical, view->up);
    double length = sqrt(bow[0] * bow[0] + bow[1] * bow[1] + bow[2] * bow[2]);
    for (int k = 0; k < 3; k++) {
        view->eye[k] = pose->position[k] + eye[k];
        view->target[k] = view->eye[k] + bow[k] / length;
    }
}

GfxCameraView gfx_camera_update(const GfxCameraDef *def, GfxCameraState *state, const GfxPose *pose,
                                double time) {
    GfxCameraView view = {.up = {0, 1, 0}, .fov_deg = def->fov_deg};
    static const GfxPose still = {.rotation = {0, 0, 0, 1}};
    bool follows = def->follows && pose;
    GfxPose at = follows ? *pose : still;
    if (!follows)
        memcpy(at.position, def->target, sizeof at.position);
    follow(def, state, &at, time);
    double centre[3], heading = state->heading.value;
    for (int k = 0; k < 3; k++)
        centre[k] = state->position[k].value;
    switch (def->kind) {
    case GFX_CAMERA_FIXED:
        memcpy(view.eye, def->eye, sizeof view.eye);
        memcpy(view.target, centre, sizeof view.target);
        break;
    case GFX_CAMERA_ORBIT:
        look_from(def, centre, def->azimuth + (def->period > 0 ? 2 * pi * time / def->period : 0), &view);
        break;
    case GFX_CAMERA_TOP:
        set3(view.eye, centre[0], centre[1] + def->distance, centre[2]);
        memcpy(view.target, centre, sizeof view.target);
        set3(view.up, cos(heading), 0, sin(heading));
        break;
    case GFX_CAMERA_BOW:
        look_on_board(def, &at, &view);
        break;
    case GFX_CAMERA_CHASE:
    case GFX_CAMERA_KIND_COUNT:
        look_from(def, centre, heading + pi + def->azimuth, &view);
        break;
    }
    return view;
}

static double dot(const double a[3], const double b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* Each corner must lie inside the pyramid of sight: at a depth of its distance across over the slope. */
double gfx_camera_fit(const double half[3], const double from[3], double fov_deg, double aspect) {
    const double flat = hypot(from[0], from[2]);
    const double right[3] = {from[2] / flat, 0, -from[0] / flat};
    const double up[3] = {-from[1] * from[0] / flat, flat, -from[1] * from[2] / flat};
    double slope = tan(0.5 * fov_deg * pi / 180), distance = 0;
    for (int c = 0; c < 8; c++) {
        const double corner[3] = {c & 1 ? half[0] : -half[0], c & 2 ? half[1] : -half[1],
                                  c & 4 ? half[2] : -half[2]};
        double across = fmax(fabs(dot(corner, right)) / aspect, fabs(dot(corner, up)));
        distance = fmax(distance, dot(corner, from) + across / slope);
    }
    return distance;
}
