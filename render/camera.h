/* Where the camera is: pure arithmetic on the pose of a body, in world coordinates and double, so that the
 * picture stays still when the window of particles moves. */
#ifndef SKIFF_RENDER_CAMERA_H
#define SKIFF_RENDER_CAMERA_H

#include <stdbool.h>

typedef enum GfxCameraKind {
    GFX_CAMERA_CHASE, /* behind the body, following its course and not its rolling */
    GFX_CAMERA_FIXED, /* stands in the world */
    GFX_CAMERA_ORBIT, /* circles the body */
    GFX_CAMERA_TOP,   /* above the body; its bow is up in the picture */
    GFX_CAMERA_BOW,   /* on board, moving with every wave */
    GFX_CAMERA_KIND_COUNT
} GfxCameraKind;

/* "chase|fixed|orbit|top|bow", in the order of the enum. */
extern const char gfx_camera_kinds[];

/* Without a body to follow, `target` is the point that orbit and top look at. */
typedef struct GfxCameraDef {
    GfxCameraKind kind;
    bool follows;      /* there is a body; fixed: turns to look at it */
    double forward[3]; /* the body's bow, body axes; any length > 0, not vertical */
    double eye[3];     /* m. fixed: world. bow: body axes, from the body's centre. Others: unused */
    double target[3];  /* m, world. fixed, orbit, top: looked at where there is no body */
    double distance;   /* m, > 0. chase, orbit: horizontal, from the body's centre; top: above it */
    double height;     /* m. chase, orbit: of the eye above the body's centre */
    double look_up;    /* m. chase, orbit: what is looked at lies this much above the body's centre */
    double azimuth;    /* rad, from +x towards +z. orbit: at time 0; chase: off the line astern */
    double period;     /* s. orbit: for one turn; 0: stands still */
    double smoothing;  /* s, >= 0: time in which a sudden change of course or height has mostly gone */
    double fov_deg;    /* vertical */
} GfxCameraDef;

GfxCameraDef gfx_camera_default(GfxCameraKind kind);

/* The pose of what is followed. */
typedef struct GfxPose {
    double position[3]; /* m, world */
    double rotation[4]; /* unit quaternion x y z w, body axes to world */
} GfxPose;

typedef struct GfxCameraView {
    double eye[3], target[3], up[3]; /* world, m */
    double fov_deg;
} GfxCameraView;

/* A value that follows its goal like a critically damped spring. */
typedef struct GfxSpring {
    double value, rate, goal;
} GfxSpring;

/* Zero-initialise before the first update. Only doubles, so that it can be kept in a file as it is. */
typedef struct GfxCameraState {
    double updates;        /* so far */
    double time;           /* s, of the last one */
    GfxSpring position[3]; /* of the followed body, smoothed */
    GfxSpring heading;     /* rad, unwrapped, from +x towards +z */
} GfxCameraState;

/* Moves the state on to `time` (s, not before the last one) and gives the view. `pose` is NULL when nothing
 * is followed. The first update starts at rest at the goal. */
GfxCameraView gfx_camera_update(const GfxCameraDef *def, GfxCameraState *state, const GfxPose *pose,
                                double time);

/* From how far away a box of these half lengths (m) just fits into the picture. `from`: unit vector from its
 * centre towards the eye, not vertical; `aspect`: width over height of the picture. */
double gfx_camera_fit(const double half[3], const double from[3], double fov_deg, double aspect);

/* A vector turned by a unit quaternion x y z w. out may be v. */
void gfx_camera_rotate(const double q[4], const double v[3], double out[3]);

#endif
