/* Rigid body mechanics. The fluid's impulses come from the pressure solve, which treats a body's motion as
 * unknown (see dfsph.c), so a light body needs no substeps. Not here: collisions between bodies. */
#include "body.h"
#include "dvec.h"
#include "shape.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

void matrix_times(const double m[3][3], const double v[3], double result[3]) {
    double r[3];
    for (int k = 0; k < 3; k++)
        r[k] = m[k][0] * v[0] + m[k][1] * v[1] + m[k][2] * v[2];
    memcpy(result, r, sizeof r);
}

void quaternion_matrix(const double q[4], double m[3][3]) {
    const double x = q[0], y = q[1], z = q[2], w = q[3];
    const double r[3][3] = {{1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)},
                            {2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)},
                            {2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)}};
    memcpy(m, r, sizeof r);
}

/* R a R^T */
static void rotate_tensor(const double rotation[3][3], const double a[3][3], double result[3][3]) {
    double half[3][3];
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            half[i][j] = 0.0;
            for (int k = 0; k < 3; k++)
                half[i][j] += rotation[i][k] * a[k][j];
        }
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            result[i][j] = 0.0;
            for (int k = 0; k < 3; k++)
                result[i][j] += half[i][k] * rotation[j][k];
        }
}

/* Inverse of the rows and columns in `use`, zero elsewhere: the response of a body that may turn about those
 * axes only. */
static void invert_free(const double a[3][3], const bool use[3], double result[3][3]) {
    double m[3][3];
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            m[i][j] = use[i] && use[j] ? a[i][j] : i == j ? 1.0 : 0.0;
    double cofactor[3][3];
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            const int r0 = (i + 1) % 3, r1 = (i + 2) % 3, c0 = (j + 1) % 3, c1 = (j + 2) % 3;
            cofactor[i][j] = m[r0][c0] * m[r1][c1] - m[r0][c1] * m[r1][c0];
        }
    const double det = m[0][0] * cofactor[0][0] + m[0][1] * cofactor[0][1] + m[0][2] * cofactor[0][2];
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            result[i][j] = use[i] && use[j] ? cofactor[j][i] / det : 0.0;
}

static bool body_check(const SkiffBodyDef *def, const char *path, Err *err) {
    bool good = true;
    if (def->name == NULL || def->name[0] == '\0')
        good = err_add(err, ERR_INPUT, "%s.name: must not be empty", path);
    if (!(def->mass >= 0.0f && isfinite(def->mass)))
        good = err_add(err, ERR_INPUT, "%s.mass: %g kg, must be above 0", path, (double)def->mass);
    if (def->mass == 0.0f && !(def->density > 0.0f && isfinite(def->density)))
        good = err_add(err, ERR_INPUT, "%s.density: %g kg/m^3, must be above 0", path, (double)def->density);
    for (int k = 0; k < 3; k++)
        if (!isfinite(def->velocity[k]) || !isfinite(def->angular_velocity[k]))
            good = err_add(err, ERR_INPUT, "%s.velocity, angularVelocity: must be finite", path);
    if (def->free_axes > SKIFF_FREE_ALL)
        good = err_add(err, ERR_INPUT, "%s.freeAxes: %u has unknown bits", path, def->free_axes);
    if (isnan(def->release_time))
        good = err_add(err, ERR_INPUT, "%s.releaseTime: must be a number", path);
    if (!(def->stop_time > def->release_time))
        good = err_add(err, ERR_INPUT, "%s.stopTime: %g s, must be after the release at %g s", path,
                       def->stop_time, def->release_time);
    if (!(def->ramp_time >= 0.0 && isfinite(def->ramp_time)))
        good = err_add(err, ERR_INPUT, "%s.rampTime: %g s, must be 0 or more", path, def->ramp_time);
    return good;
}

bool body_make(const SkiffBodyDef *def, const char *path, Body *body, Err *err) {
    *body = (Body){0};
    if (!body_check(def, path, err) || !geometry_make(&def->geometry, path, &body->mesh, err))
        return false;
    MeshMass mass;
    mesh_mass(&body->mesh, &mass);
    const double density = def->mass > 0.0f ? def->mass / mass.volume : def->density;
    body->mass = density * mass.volume;
    body->volume = mass.volume;
    body->free_axes = def->free_axes;
    body->release_time = def->release_time;
    body->stop_time = def->stop_time;
    body->ramp_time = def->ramp_time;
    body->rotation[3] = 1.0;
    bool moving = def->free_axes != 0;
    float shift[3];
    for (int k = 0; k < 3; k++) {
        for (int l = 0; l < 3; l++)
            body->inertia[k][l] = density * mass.inertia[k][l];
        body->position[k] = mass.centre[k] + def->geometry.translation[k];
        body->velocity[k] = body->start_velocity[k] = def->velocity[k];
        body->angular_velocity[k] = body->start_angular_velocity[k] = def->angular_velocity[k];
        moving |= def->velocity[k] != 0.0f || def->angular_velocity[k] != 0.0f;
        shift[k] = (float)-mass.centre[k];
    }
    body->fixed = !moving;
    mesh_transform(&body->mesh, (const float[3]){1, 1, 1}, (const float[4]){0, 0, 0, 1}, shift);
    const size_t length = strlen(def->name) + 1;
    body->name = malloc(length);
    if (body->name == NULL || !mesh_build_tree(&body->mesh, err)) {
        body_free(body);
        return err_add(err, ERR_INPUT, "%s: no memory", path);
    }
    memcpy(body->name, def->name, length);
    body_prepare(body, -INFINITY);
    return true;
}

void body_free(Body *body) {
    mesh_free(&body->mesh);
    free(body->name);
    *body = (Body){0};
}

bool body_held(const Body *body, double time) {
    return time < body->release_time || time >= body->stop_time;
}

double body_box_distance_sq(const Body *body, const double p[3], float local[3]) {
    double arm[3], apart_sq = 0.0;
    dvec_sub(arm, p, body->position);
    for (int k = 0; k < 3; k++) { /* R^T arm */
        local[k] =
            (float)(body->matrix[0][k] * arm[0] + body->matrix[1][k] * arm[1] + body->matrix[2][k] * arm[2]);
        const double out =
            fmax((double)(body->mesh.min[k] - local[k]), (double)(local[k] - body->mesh.max[k]));
        apart_sq += out > 0.0 ? out * out : 0.0;
    }
    return apart_sq;
}

/* Share of a prescribed velocity in the middle of the step that begins at `time`. */
static double ramp_share(const Body *body, double time, double dt) {
    const double share = body->ramp_time > 0.0 ? fmax(time + 0.5 * dt, 0.0) / body->ramp_time : 1.0;
    return share < 1.0 ? share * share * (3.0 - 2.0 * share) : 1.0;
}

void body_hold(Body *body, double time, double dt) {
    const bool stopped = time >= body->stop_time;
    const bool held = body_held(body, time), released = !held && time - dt < body->release_time;
    const double share = stopped ? 0.0 : ramp_share(body, time, dt);
    for (int k = 0; k < 3; k++) {
        if (!(body->free_axes >> k & 1))
            body->velocity[k] = share * body->start_velocity[k];
        else if (held || released)
            body->velocity[k] = held ? 0.0 : body->start_velocity[k];
        if (!(body->free_axes >> (3 + k) & 1))
            body->angular_velocity[k] = share * body->start_angular_velocity[k];
        else if (held || released)
            body->angular_velocity[k] = held ? 0.0 : body->start_angular_velocity[k];
    }
}

void body_prepare(Body *body, double time) {
    quaternion_matrix(body->rotation, body->matrix);
    double world[3][3];
    rotate_tensor((const double(*)[3])body->matrix, (const double(*)[3])body->inertia, world);
    const uint32_t axes = body_held(body, time) ? 0 : body->free_axes;
    bool turns[3];
    for (int k = 0; k < 3; k++) {
        body->inv_mass[k] = axes >> k & 1 ? 1.0 / body->mass : 0.0;
        turns[k] = axes >> (3 + k) & 1;
    }
    invert_free((const double(*)[3])world, turns, body->inv_inertia);
}

void body_push(Body *body, const float gravity[3], double time, double dt) {
    double turn[3];
    matrix_times((const double(*)[3])body->inv_inertia, body->push_torque, turn);
    const uint32_t axes = body_held(body, time) ? 0 : body->free_axes;
    for (int k = 0; k < 3; k++) {
        body->velocity[k] += dt * (body->inv_mass[k] * body->push[k] + (axes >> k & 1 ? gravity[k] : 0.0));
        body->angular_velocity[k] += dt * turn[k];
        body->push[k] = body->push_torque[k] = 0.0;
    }
}

/* q turned by the rotation vector w dt, renormalised. */
static void quaternion_turn(const double q[4], const double w[3], double dt, double result[4]) {
    const double speed = sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2]);
    const double half = 0.5 * dt * speed, s = speed > 0.0 ? sin(half) / speed : 0.0, c = cos(half);
    const double d[3] = {w[0] * s, w[1] * s, w[2] * s};
    const double product[4] = {c * q[0] + q[3] * d[0] + d[1] * q[2] - d[2] * q[1],
                               c * q[1] + q[3] * d[1] + d[2] * q[0] - d[0] * q[2],
                               c * q[2] + q[3] * d[2] + d[0] * q[1] - d[1] * q[0],
                               c * q[3] - d[0] * q[0] - d[1] * q[1] - d[2] * q[2]};
    const double norm = sqrt(product[0] * product[0] + product[1] * product[1] + product[2] * product[2] +
                             product[3] * product[3]);
    for (int k = 0; k < 4; k++)
        result[k] = product[k] / norm;
}

/* Free rotation: the angular momentum stays, and the turn is made with the velocity it means half a step
 * later (midpoint rule): the energy of a tumbling body drifts by 0.1 % where the plain rule loses 5 %. */
static void turn_free(Body *body, double time, double dt) {
    double world[3][3], momentum[3];
    const double start[4] = {body->rotation[0], body->rotation[1], body->rotation[2], body->rotation[3]};
    rotate_tensor((const double(*)[3])body->matrix, (const double(*)[3])body->inertia, world);
    matrix_times((const double(*)[3])world, body->angular_velocity, momentum);
    quaternion_turn(start, body->angular_velocity, 0.5 * dt, body->rotation);
    body_prepare(body, time);
    matrix_times((const double(*)[3])body->inv_inertia, momentum, body->angular_velocity);
    quaternion_turn(start, body->angular_velocity, dt, body->rotation);
    body_prepare(body, time);
    matrix_times((const double(*)[3])body->inv_inertia, momentum, body->angular_velocity);
}

void body_advance(Body *body, double time, double dt) {
    for (int k = 0; k < 3; k++)
        body->position[k] += dt * body->velocity[k];
    const uint32_t turns = SKIFF_FREE_RX | SKIFF_FREE_RY | SKIFF_FREE_RZ;
    if ((body->free_axes & turns) == turns && !body_held(body, time))
        turn_free(body, time, dt);
    else
        quaternion_turn(body->rotation, body->angular_velocity, dt, body->rotation);
}
