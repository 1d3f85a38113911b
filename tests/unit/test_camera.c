/* Cameras: where they look, that smoothing does not depend on the frame rate, and that a boat far away is
 * looked at as steadily as one at the origin. */
#include "engine/base/angle.h"
#include "render/camera.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>
#include <cmocka.h>

static GfxPose pose_at(double x, double y, double z, double heading) {
    /* A turn by -heading about y takes +x to (cos, 0, sin). */
    return (GfxPose){{x, y, z}, {0, sin(-0.5 * heading), 0, cos(-0.5 * heading)}};
}

static void near3(const double a[3], double x, double y, double z, double tolerance) {
    assert_true(fabs(a[0] - x) <= tolerance && fabs(a[1] - y) <= tolerance && fabs(a[2] - z) <= tolerance);
}

static void chase_starts_astern(void **unused) {
    (void)unused;
    GfxCameraDef def = gfx_camera_default(GFX_CAMERA_CHASE);
    GfxCameraState state = {0};
    GfxPose pose = pose_at(10, 1, 20, 0.5 * pi); /* the bow points to +z */
    def.azimuth = 0;
    GfxCameraView view = gfx_camera_update(&def, &state, &pose, 0);
    near3(view.eye, 10, 1 + def.height, 20 - def.distance, 1e-12);
    near3(view.target, 10, 1 + def.look_up, 20, 1e-12);
    near3(view.up, 0, 1, 0, 0);
    /* Off the line astern: for a bow to +z, from -z towards +x. */
    def.azimuth = 0.5 * pi;
    state = (GfxCameraState){0};
    view = gfx_camera_update(&def, &state, &pose, 0);
    near3(view.eye, 10 + def.distance, 1 + def.height, 20, 1e-12);
}

static void other_bows_are_known(void **unused) {
    (void)unused;
    GfxCameraDef def = gfx_camera_default(GFX_CAMERA_CHASE);
    GfxCameraState state = {0};
    GfxPose pose = pose_at(0, 0, 0, 0);
    memcpy(def.forward, (double[3]){0, 0, -2}, sizeof def.forward);
    def.azimuth = 0;
    near3(gfx_camera_update(&def, &state, &pose, 0).eye, 0, def.height, def.distance, 1e-12);
}

/* A boat that has sailed at constant speed for long stays at the same place of the picture. */
static void constant_speed_has_no_lag(void **unused) {
    (void)unused;
    GfxCameraDef def = gfx_camera_default(GFX_CAMERA_CHASE);
    GfxCameraState state = {0};
    GfxCameraView view = {0};
    for (int i = 0; i <= 300; i++) {
        GfxPose pose = pose_at(6 * i / 30.0, 0, 0, 0);
        view = gfx_camera_update(&def, &state, &pose, i / 30.0);
    }
    near3(view.target, 60, def.look_up, 0, 1e-6);
}

/* Distance of the eye from where it would be without smoothing, 0.4 s after a leap of 1 m to the side. */
static double after_leap(int rate, double smoothing) {
    GfxCameraDef def = gfx_camera_default(GFX_CAMERA_CHASE);
    def.azimuth = 0;
    GfxCameraState state = {0};
    def.smoothing = smoothing;
    GfxPose pose = pose_at(0, 0, 0, 0);
    gfx_camera_update(&def, &state, &pose, 0);
    pose.position[2] = 1;
    gfx_camera_update(&def, &state, &pose, 0); /* a leap in no time gives the goal no speed */
    state.position[2].goal = 1;
    GfxCameraView view = {0};
    for (int i = 1; i <= rate * 2 / 5; i++)
        view = gfx_camera_update(&def, &state, &pose, (double)i / rate);
    return 1 - view.eye[2];
}

static void smoothing_does_not_depend_on_the_frame_rate(void **unused) {
    (void)unused;
    double w = 4 / 0.6, expected = (1 + w * 0.4) * exp(-w * 0.4);
    assert_true(fabs(after_leap(10, 0.6) - expected) < 1e-9);
    assert_true(fabs(after_leap(25, 0.6) - expected) < 1e-9);
    assert_true(fabs(after_leap(240, 0.6) - expected) < 1e-9);
    assert_true(after_leap(30, 0.2) < expected && expected < after_leap(30, 1.2));
    assert_true(fabs(after_leap(30, 0)) < 1e-12);
}

/* The same path 100 km from the origin gives the same picture to a micrometre. */
static void far_away_is_as_steady(void **unused) {
    (void)unused;
    GfxCameraDef def = gfx_camera_default(GFX_CAMERA_CHASE);
    GfxCameraState here = {0}, there = {0};
    for (int i = 0; i < 90; i++) {
        double t = i / 30.0, x = 4 * t, z = sin(t);
        GfxPose a = pose_at(x, 0.05 * sin(7 * t), z, 0.3 * sin(t));
        GfxPose b = a;
        b.position[0] += 1e5;
        b.position[2] -= 1e5;
        GfxCameraView u = gfx_camera_update(&def, &here, &a, t), v = gfx_camera_update(&def, &there, &b, t);
        near3(v.eye, u.eye[0] + 1e5, u.eye[1], u.eye[2] - 1e5, 1e-6);
    }
}

static void turning_round_takes_the_short_way(void **unused) {
    (void)unused;
    GfxCameraDef def = gfx_camera_default(GFX_CAMERA_CHASE);
    GfxCameraState state = {0};
    double last = 0;
    for (int i = 0; i <= 400; i++) { /* two full turns */
        GfxPose pose = pose_at(0, 0, 0, 4 * pi * i / 400);
        gfx_camera_update(&def, &state, &pose, i / 30.0);
        assert_true(state.heading.value - last > -1e-9 && state.heading.value - last < 0.1);
        last = state.heading.value;
    }
    assert_true(fabs(last - 4 * pi) < 0.1);
}

static void rolling_does_not_shake_the_chase(void **unused) {
    (void)unused;
    GfxCameraDef def = gfx_camera_default(GFX_CAMERA_CHASE);
    GfxCameraState state = {0};
    GfxPose level = pose_at(0, 0, 0, 0), rolled = level;
    GfxCameraView before = gfx_camera_update(&def, &state, &level, 0);
    memcpy(rolled.rotation, (double[4]){sin(0.3), 0, 0, cos(0.3)}, sizeof rolled.rotation);
    GfxCameraView after = gfx_camera_update(&def, &state, &rolled, 0.1);
    near3(after.eye, before.eye[0], before.eye[1], before.eye[2], 1e-12);
    near3(after.up, 0, 1, 0, 0);
}

static void other_kinds(void **unused) {
    (void)unused;
    GfxPose pose = pose_at(3, 1, -2, 0.5 * pi);
    GfxCameraDef def = gfx_camera_default(GFX_CAMERA_FIXED);
    GfxCameraState state = {0};
    def.follows = false;
    memcpy(def.eye, (double[3]){1, 2, 3}, sizeof def.eye);
    memcpy(def.target, (double[3]){4, 5, 6}, sizeof def.target);
    GfxCameraView view = gfx_camera_update(&def, &state, &pose, 1);
    near3(view.eye, 1, 2, 3, 0);
    near3(view.target, 4, 5, 6, 0);

    def = gfx_camera_default(GFX_CAMERA_ORBIT);
    state = (GfxCameraState){0};
    def.azimuth = 0;
    def.period = 8;
    view = gfx_camera_update(&def, &state, &pose, 2); /* a quarter of a turn */
    near3(view.eye, 3, 1 + def.height, -2 + def.distance, 1e-9);

    def = gfx_camera_default(GFX_CAMERA_TOP);
    state = (GfxCameraState){0};
    view = gfx_camera_update(&def, &state, &pose, 0);
    near3(view.eye, 3, 1 + def.distance, -2, 1e-12);
    near3(view.up, 0, 0, 1, 1e-12);

    def = gfx_camera_default(GFX_CAMERA_BOW);
    state = (GfxCameraState){0};
    memcpy(def.eye, (double[3]){2, 1, 0}, sizeof def.eye);
    view = gfx_camera_update(&def, &state, &pose, 0);
    near3(view.eye, 3, 2, 0, 1e-12);
    near3(view.target, 3, 2, 1, 1e-12);
}

static void a_vertical_bow_keeps_the_course(void **unused) {
    (void)unused;
    GfxCameraDef def = gfx_camera_default(GFX_CAMERA_CHASE);
    GfxCameraState state = {0};
    GfxPose pose = pose_at(0, 0, 0, 1);
    gfx_camera_update(&def, &state, &pose, 0);
    memcpy(pose.rotation, (double[4]){0, 0, sqrt(0.5), sqrt(0.5)}, sizeof pose.rotation);
    gfx_camera_update(&def, &state, &pose, 1);
    assert_true(fabs(state.heading.value - 1) < 1e-9);
}

static void a_box_that_fits_touches_the_frame(void **unused) {
    (void)unused;
    /* Seen along z from d: a face of half height 1 at depth d - 2 spans a view of 90 degrees. */
    const double from[3] = {0, 0, 1}, box[3] = {1, 1, 2}, wide[3] = {4, 1, 2};
    assert_true(fabs(gfx_camera_fit(box, from, 90, 2) - 3) < 1e-12);
    assert_true(fabs(gfx_camera_fit(wide, from, 90, 2) - 4) < 1e-12); /* 4 / 2: the width decides */
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(chase_starts_astern),
        cmocka_unit_test(other_bows_are_known),
        cmocka_unit_test(constant_speed_has_no_lag),
        cmocka_unit_test(smoothing_does_not_depend_on_the_frame_rate),
        cmocka_unit_test(far_away_is_as_steady),
        cmocka_unit_test(turning_round_takes_the_short_way),
        cmocka_unit_test(rolling_does_not_shake_the_chase),
        cmocka_unit_test(other_kinds),
        cmocka_unit_test(a_vertical_bow_keeps_the_course),
        cmocka_unit_test(a_box_that_fits_touches_the_frame),
    };
    return cmocka_run_group_tests_name("camera", tests, NULL, NULL);
}
