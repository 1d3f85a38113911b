/* Rigid bodies: mass properties, free and prescribed axes, motion. Double precision throughout: there are few
 * of them, and at small speeds a float position would not move. cglm has single precision only, hence the
 * handful of operations below. */
#ifndef SKIFF_BODY_H
#define SKIFF_BODY_H

#include "mesh.h"
#include "skiff.h"

typedef struct Body {
    char *name;
    Mesh mesh;  /* body axes, about the centre of mass */
    bool fixed; /* never moves: its samples are sorted once, with the walls */
    uint32_t free_axes;
    double release_time, stop_time, ramp_time;
    double mass, volume;  /* kg, m^3 */
    double inertia[3][3]; /* kg m^2, body axes */
    double position[3];   /* centre of mass, world */
    double rotation[4];   /* x y z w */
    double velocity[3], angular_velocity[3];
    double start_velocity[3], start_angular_velocity[3];
    double push[3], push_torque[3]; /* for the next step */
    /* What one step works with, from body_prepare: response to an impulse, zero along axes that are not free.
     */
    double matrix[3][3];      /* rotation */
    double inv_mass[3];       /* 1/kg, world axes */
    double inv_inertia[3][3]; /* 1/(kg m^2), world axes */
} Body;

/* Builds a body from its def; `path` names it in messages. position is where the geometry puts the centre of
 * mass. */
bool body_make(const SkiffBodyDef *def, const char *path, Body *body, Err *err);
void body_free(Body *body);

/* Before a step that begins at `time`: stops what is held, gives a body its initial velocity in the step of
 * its release, and brings prescribed velocities to their values. */
void body_hold(Body *body, double time, double dt);
/* Rotation matrix and inverse masses for a step that begins at `time`. */
void body_prepare(Body *body, double time);
/* Gravity and pushes of one step on the free axes. */
void body_push(Body *body, const float gravity[3], double time, double dt);
/* Moves by the velocities; free rotation keeps the angular momentum (the gyroscopic term), renormalises the
 * quaternion. */
void body_advance(Body *body, double time, double dt);
/* Is it kept still at that time: not yet released, or stopped? */
bool body_held(const Body *body, double time);

/* p (world, m) in body axes; returns the square of its distance from the box that holds the body there. After
 * body_prepare. */
double body_box_distance_sq(const Body *body, const double p[3], float local[3]);

/* Of a unit quaternion x y z w. */
void quaternion_matrix(const double q[4], double m[3][3]);
/* result may be v */
void matrix_times(const double m[3][3], const double v[3], double result[3]);

#endif
