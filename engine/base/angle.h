/* Half a turn, rad. */
#ifndef SKIFF_BASE_ANGLE_H
#define SKIFF_BASE_ANGLE_H

static const double pi = 3.14159265358979323846;

#endif
