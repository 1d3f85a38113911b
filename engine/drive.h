/* Propulsion and steering of a body: what SkiffControls do to it. */
#ifndef SKIFF_DRIVE_H
#define SKIFF_DRIVE_H

#include "body.h"

/* A propeller or rudder on a body. */
typedef struct DrivePoint {
    double arm[3]; /* m, from the centre of mass, body axes */
    double open;   /* share of its surroundings that the hull leaves to the water */
} DrivePoint;

typedef struct Drive {
    SkiffDriveDef def;
    int body;
    double forward[3], starboard[3]; /* unit, at right angles, body axes */
    DrivePoint propeller, rudder;
    double start_heading[2]; /* unit: x and z of `forward` at the start, seen from above */
    /* state */
    SkiffControls controls;
    /* of the last step; also SkiffDrive */
    double thrust, water, rudder_position, torque;
} Drive;

/* Numbers of a drive that its next steps depend on. Loading sets what the last step applied to zero. */
enum { DRIVE_SCALARS = 4 };
void drive_to_scalars(const Drive *drive, double *out);
bool drive_check_scalars(const double *in, Err *err);
void drive_from_scalars(Drive *drive, const double *in);

#endif
