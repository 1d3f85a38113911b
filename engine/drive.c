/* Propulsion and steering of bodies, extra drag. Forces are added to the body's pushes and act in this step's
 * `forces` phase.
 *
 * - Thrust after [Carensac2023 5.7] as its authors' code has it: at the centre of mass, along the bow but
 *   levelled, at full size. Or a propeller's: at its point, along the body's axis, as far as there is water.
 * - Steering as the authors: a torque about the vertical. Or a rudder: normal force of a plate,
 *   F = 1/2 rho A c |w| (w . n) n  with  c = 6.13 s / (s + 2.25),  s its aspect ratio (Fujii's formula, as in
 *   the MMG standard method [Yasukawa2015]); w is the water's velocity past it, with the jet of
 *   the propeller by momentum theory: v_jet^2 = v^2 + 2 T / (rho A_p).
 * - Heading hold: rudder = gain * error - damping * rate, up to full rudder, or full rudder always as the
 *   authors.
 *
 * The water at a propeller or rudder is what the particles there say: its share and velocity are kernel
 * averages over all of them. One look at 200 000 particles takes a few tenths of a millisecond, and costs
 * nothing unless a propeller or rudder asks for it.
 *
 * Not here: stall of the rudder, time that a rudder or an engine needs, the propeller's torque on the hull,
 * and what propeller and rudder do to the water. */
#include "drive.h"

#include "dvec.h"
#include "params.h"
#include "sim.h"

#include "base/angle.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

/* ---- Making ---- */

static bool make_frame(Drive *drive, const SkiffGeometryDef *geometry, const char *path, Err *err) {
    const double up[3] = {0, 1, 0};
    double *forward = drive->forward;
    geometry_turn(geometry, drive->def.axis, forward);
    if (dvec_normalize(forward) == 0.0)
        return err_add(err, ERR_INPUT, "%s.axis: has no direction", path);
    const double level = hypot(forward[0], forward[2]);
    if (level < 0.1)
        return err_add(err, ERR_INPUT,
                       "%s.axis: points %s at the start; it must be within 84 degrees of level", path,
                       forward[1] > 0 ? "up" : "down");
    drive->start_heading[0] = forward[0] / level;
    drive->start_heading[1] = forward[2] / level;
    dvec_cross(drive->starboard, forward, up);
    dvec_normalize(drive->starboard);
    return true;
}

/* Share of a point's surroundings that the hull fills, as its samples say. */
static double solid_share(const SkiffSim *sim, int body, const double arm[3]) {
    const BoundarySamples *samples = &sim->boundary.moving.samples;
    double sum = 0.0;
    for (uint32_t s = 0; s < samples->count; s++) {
        double place[3];
        dvec_from_float(place, samples->position[s]);
        if (samples->object[s] == 1 + body)
            sum += (double)samples->volume[s] *
                   (double)kernel_w(&sim->kernel, (float)sqrt(dvec_distance_sq(place, arm)));
    }
    return sum;
}

/* False for a point inside the body. */
static bool make_point(const SkiffSim *sim, const SkiffBodyDef *def, int index, const float place[3],
                       DrivePoint *point) {
    const Body *body = &sim->bodies[index];
    float local[3];
    geometry_turn(&def->geometry, place, point->arm);
    for (int k = 0; k < 3; k++)
        point->arm[k] += (double)def->geometry.translation[k] - body->position[k];
    dvec_to_float(local, point->arm);
    point->open = 1.0 - fmin(solid_share(sim, index, point->arm), 0.9);
    return mesh_distance(&body->mesh, local, NULL) > 0.0f;
}

static bool make_drive(Drive *drive, const SkiffSim *sim, const SkiffBodyDef *def, const char *path,
                       Err *err) {
    const SkiffDriveDef *own = &drive->def;
    bool good = true;
    drive->def = *def->drive;
    if (!params_check_drive(own, path, err))
        return false;
    if (sim->bodies[drive->body].free_axes == 0)
        return err_add(err, ERR_INPUT, "%s: has no effect, since the body has no free axis", path);
    if (!make_point(sim, def, drive->body, own->propeller, &drive->propeller) &&
        own->thrust_at == SKIFF_THRUST_AT_PROPELLER)
        good = err_add(err, ERR_INPUT, "%s.propeller: is inside the body, where no water comes", path);
    if (!make_point(sim, def, drive->body, own->rudder, &drive->rudder) &&
        own->steering == SKIFF_STEERING_RUDDER)
        good = err_add(err, ERR_INPUT, "%s.rudder: is inside the body, where no water comes", path);
    return make_frame(drive, &def->geometry, path, err) && good;
}

bool drives_make(SkiffSim *sim, const SkiffDef *def, Err *err) {
    bool good = true;
    sim->drives = calloc((size_t)def->body_count + 1, sizeof *sim->drives);
    if (sim->drives == NULL)
        return err_add(err, ERR_INPUT, "no memory");
    for (int b = 0; b < def->body_count; b++) {
        char path[64];
        if (def->bodies[b].drive == NULL)
            continue;
        snprintf(path, sizeof path, "RigidBodies[%d].drive", b);
        Drive *drive = &sim->drives[sim->drive_count++];
        drive->body = b;
        good = make_drive(drive, sim, &def->bodies[b], path, err) && good;
    }
    return good;
}

/* ---- The water at a point ---- */

typedef struct Water {
    double share;       /* 0: none, 1: the point is under water */
    double velocity[3]; /* m/s, its mean around the point; 0 where there is none */
} Water;

typedef struct WaterSums {
    double weight, momentum[3];
} WaterSums;

static WaterSums water_block(const SkiffSim *sim, uint32_t block, const float point[3]) {
    const Particles *particles = &sim->particles;
    const float reach_sq = sim->kernel.support * sim->kernel.support;
    const uint32_t begin = block * BLOCK;
    const uint32_t end = begin + BLOCK < particles->count ? begin + BLOCK : particles->count;
    WaterSums sums = {0};
    for (uint32_t i = begin; i < end; i++) {
        const float *x = particles->position[i];
        const float dx = x[0] - point[0], dy = x[1] - point[1], dz = x[2] - point[2];
        const float distance_sq = dx * dx + dy * dy + dz * dz;
        if (distance_sq >= reach_sq)
            continue;
        const double weight = (double)kernel_w(&sim->kernel, sqrtf(distance_sq));
        sums.weight += weight;
        for (int k = 0; k < 3; k++)
            sums.momentum[k] += weight * (double)particles->velocity[i][k];
    }
    return sums;
}

/* At the surface of a pool half of a point's open surroundings is water: from there on downwards the share is
 * 1. `arm` leads from the centre of mass to the point, in the world. */
static Water water_at(SkiffSim *sim, const Body *body, const double arm[3], double open) {
    const uint32_t blocks = particles_blocks(&sim->particles);
    WaterSums *sums = sim->sums.data, all = {0};
    float point[3];
    for (int k = 0; k < 3; k++)
        point[k] = (float)(body->position[k] + arm[k] - sim->origin[k]);
#pragma omp parallel for schedule(static) num_threads(sim->threads)
    for (uint32_t block = 0; block < blocks; block++)
        sums[block] = water_block(sim, block, point);
    for (uint32_t block = 0; block < blocks; block++) {
        all.weight += sums[block].weight;
        for (int k = 0; k < 3; k++)
            all.momentum[k] += sums[block].momentum[k];
    }
    Water water = {.share = fmin(2.0 * (double)sim->volume * all.weight / open, 1.0)};
    for (int k = 0; k < 3 && all.weight > 0.0; k++)
        water.velocity[k] = all.momentum[k] / all.weight;
    return water;
}

/* ---- One step ---- */

/* A drive's directions and points in the world, at the beginning of a step. */
typedef struct Pose {
    double forward[3], starboard[3];
    double level[3];                        /* unit: forward, horizontal; 0 for a body that stands on end */
    double propeller_arm[3], rudder_arm[3]; /* m, from the centre of mass */
} Pose;

static Pose drive_pose(const Drive *drive, const Body *body) {
    double matrix[3][3];
    Pose pose;
    quaternion_matrix(body->rotation, matrix);
    matrix_times((const double(*)[3])matrix, drive->forward, pose.forward);
    matrix_times((const double(*)[3])matrix, drive->starboard, pose.starboard);
    matrix_times((const double(*)[3])matrix, drive->propeller.arm, pose.propeller_arm);
    matrix_times((const double(*)[3])matrix, drive->rudder.arm, pose.rudder_arm);
    dvec_set(pose.level, pose.forward[0], 0.0, pose.forward[2]);
    dvec_normalize(pose.level);
    return pose;
}

/* To starboard is clockwise seen from above; y is up. */
static double pose_heading(const Drive *drive, const Pose *pose) {
    const double *from = drive->start_heading, *to = pose->level;
    return atan2(to[2] * from[0] - to[0] * from[1], to[0] * from[0] + to[2] * from[1]);
}

static double wrap_angle(double angle) {
    return remainder(angle, 2.0 * pi);
}

static double rudder_position(const Drive *drive, const Body *body, const Pose *pose) {
    const SkiffControls *controls = &drive->controls;
    if (!controls->hold)
        return controls->rudder;
    const double error = wrap_angle(controls->heading - pose_heading(drive, pose));
    if (drive->def.heading_hold == SKIFF_HOLD_BANGBANG)
        return error > 0.0 ? 1.0 : error < 0.0 ? -1.0 : 0.0;
    const double rate = -body->angular_velocity[1]; /* to starboard */
    const double wanted = (double)drive->def.hold_gain * error - (double)drive->def.hold_damping * rate;
    return fmin(fmax(wanted, -1.0), 1.0); /* the rudder's stops */
}

static void push_at(Body *body, const double arm[3], const double force[3]) {
    double torque[3];
    dvec_cross(torque, arm, force);
    for (int k = 0; k < 3; k++) {
        body->push[k] += force[k];
        body->push_torque[k] += torque[k];
    }
}

/* Velocity of the water past a point of the body. */
static void flow_at(const Body *body, const double arm[3], const Water *water, double flow[3]) {
    double turning[3];
    dvec_cross(turning, body->angular_velocity, arm);
    for (int k = 0; k < 3; k++)
        flow[k] = water->velocity[k] - body->velocity[k] - turning[k];
}

/* Thrust of the propeller; its jet (m/s) is what it adds to the water's speed astern. */
static double propel(SkiffSim *sim, Drive *drive, Body *body, const Pose *pose) {
    double flow[3], force[3];
    const Water water = water_at(sim, body, pose->propeller_arm, drive->propeller.open);
    drive->water = water.share;
    drive->thrust *= water.share;
    for (int k = 0; k < 3; k++)
        force[k] = drive->thrust * pose->forward[k];
    push_at(body, pose->propeller_arm, force);
    if (drive->thrust <= 0.0) /* astern the jet goes away from the rudder */
        return 0.0;
    flow_at(body, pose->propeller_arm, &water, flow);
    const double diameter = (double)drive->def.propeller_diameter;
    const double advance = fmax(-dvec_dot(flow, pose->forward), 0.0);
    const double disc = 0.25 * pi * diameter * diameter;
    return sqrt(advance * advance + 2.0 * drive->thrust / ((double)sim->params.rest_density * disc)) -
           advance;
}

static void apply_rudder(SkiffSim *sim, Drive *drive, Body *body, const Pose *pose, double jet) {
    const SkiffDriveDef *def = &drive->def;
    double flow[3], normal[3], force[3], torque[3];
    const Water water = water_at(sim, body, pose->rudder_arm, drive->rudder.open);
    flow_at(body, pose->rudder_arm, &water, flow);
    dvec_add_scaled(flow, flow, -jet, pose->forward);
    const double angle = drive->rudder_position * (double)def->rudder_angle;
    for (int k = 0; k < 3; k++)
        normal[k] = cos(angle) * pose->starboard[k] + sin(angle) * pose->forward[k];
    /* what flows along the rudder's stock exerts no force */
    const double speed = hypot(dvec_dot(flow, pose->forward), dvec_dot(flow, pose->starboard));
    const double slope = 6.13 * (double)def->rudder_aspect / ((double)def->rudder_aspect + 2.25);
    const double size = 0.5 * (double)sim->params.rest_density * (double)def->rudder_area * slope * speed *
                        dvec_dot(flow, normal) * water.share;
    for (int k = 0; k < 3; k++)
        force[k] = size * normal[k];
    push_at(body, pose->rudder_arm, force);
    dvec_cross(torque, pose->rudder_arm, force);
    drive->torque = -torque[1];
}

/* Drag k(u) u on the horizontal velocity u past a medium, taken at the end of the step so that it can stop a
 * body but never turn it back: u' = u / (1 + k dt / m). */
static void apply_drag(Body *body, double linear, double square, const float medium[3], double dt) {
    const double u = body->velocity[0] - (double)medium[0], w = body->velocity[2] - (double)medium[2];
    const double k = linear + square * hypot(u, w);
    const double share = k / (1.0 + k * dt / body->mass);
    body->push[0] -= share * u;
    body->push[2] -= share * w;
}

static void apply_drive(SkiffSim *sim, Drive *drive, Body *body) {
    const SkiffDriveDef *def = &drive->def;
    const Pose pose = drive_pose(drive, body);
    double jet = 0.0;
    drive->thrust = drive->controls.throttle * (double)def->thrust;
    drive->water = 1.0;
    drive->rudder_position = rudder_position(drive, body, &pose);
    if (def->thrust_at == SKIFF_THRUST_AT_PROPELLER)
        jet = propel(sim, drive, body, &pose);
    else
        for (int k = 0; k < 3; k++)
            body->push[k] += drive->thrust * pose.level[k];
    if (def->steering == SKIFF_STEERING_RUDDER) {
        apply_rudder(sim, drive, body, &pose, jet);
    } else {
        drive->torque = drive->rudder_position * (double)def->steering_torque;
        body->push_torque[1] -= drive->torque;
    }
}

void drives_apply(SkiffSim *sim) {
    static const float still[3] = {0, 0, 0};
    const double dt = (double)sim->params.time_step;
    for (int d = 0; d < sim->drive_count; d++) {
        Drive *drive = &sim->drives[d];
        Body *body = &sim->bodies[drive->body];
        const SkiffDriveDef *def = &drive->def;
        drive->thrust = drive->water = drive->rudder_position = drive->torque = 0.0;
        if (body_held(body, sim->time))
            continue;
        apply_drag(body, (double)def->water_drag, (double)def->water_drag_sq, still, dt);
        apply_drag(body, (double)def->air_drag, (double)def->air_drag_sq, def->wind, dt);
        if (sim->time + 1e-3 * dt >= (double)def->start_time) /* a float: 0.15f is above 0.15 */
            apply_drive(sim, drive, body);
    }
}

/* ---- From outside ---- */

int skiff_drive_count(const SkiffSim *sim) {
    return sim->drive_count;
}

SkiffDrive skiff_drive(const SkiffSim *sim, int index) {
    const Drive *drive = &sim->drives[index];
    const Body *body = &sim->bodies[drive->body];
    const Pose pose = drive_pose(drive, body);
    return (SkiffDrive){.body = drive->body,
                        .controls = drive->controls,
                        .heading = pose_heading(drive, &pose),
                        .speed = dvec_dot(body->velocity, pose.level),
                        .thrust = drive->thrust,
                        .water = drive->water,
                        .rudder = drive->rudder_position,
                        .torque = drive->torque};
}

static bool check_controls(const SkiffControls *controls, Err *err) {
    if (!(fabs(controls->throttle) <= 1.0))
        return err_set(err, ERR_USAGE, "throttle: %g is out of range, allowed is -1 to 1",
                       controls->throttle);
    if (!(fabs(controls->rudder) <= 1.0))
        return err_set(err, ERR_USAGE, "rudder: %g is out of range, allowed is -1 to 1", controls->rudder);
    if (!isfinite(controls->heading))
        return err_set(err, ERR_USAGE, "heading: must be finite");
    return true;
}

bool skiff_drive_set(SkiffSim *sim, int index, const SkiffControls *controls, Err *err) {
    if (!check_controls(controls, err))
        return false;
    sim->drives[index].controls = *controls;
    return true;
}

void drive_to_scalars(const Drive *drive, double *out) {
    const SkiffControls *controls = &drive->controls;
    const double scalars[DRIVE_SCALARS] = {controls->throttle, controls->rudder, controls->hold ? 1.0 : 0.0,
                                           controls->heading};
    memcpy(out, scalars, sizeof scalars);
}

static SkiffControls controls_from_scalars(const double *in) {
    return (SkiffControls){.throttle = in[0], .rudder = in[1], .hold = in[2] != 0.0, .heading = in[3]};
}

bool drive_check_scalars(const double *in, Err *err) {
    const SkiffControls controls = controls_from_scalars(in);
    return check_controls(&controls, err);
}

void drive_from_scalars(Drive *drive, const double *in) {
    drive->controls = controls_from_scalars(in);
    drive->thrust = drive->water = drive->rudder_position = drive->torque = 0.0;
}
