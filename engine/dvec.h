/* Double-precision three-vectors: meshes, their integrals and samples, rigid bodies. (The vectors of
 * cglm are float32, which loses the last digits that areas, volumes and the sides of a face are decided by.)
 */
#ifndef SKIFF_DVEC_H
#define SKIFF_DVEC_H

#include <math.h>

static inline void dvec_set(double out[3], double x, double y, double z) {
    out[0] = x;
    out[1] = y;
    out[2] = z;
}

static inline void dvec_copy(double out[3], const double a[3]) {
    dvec_set(out, a[0], a[1], a[2]);
}

static inline void dvec_from_float(double out[3], const float a[3]) {
    dvec_set(out, (double)a[0], (double)a[1], (double)a[2]);
}

static inline void dvec_to_float(float out[3], const double a[3]) {
    for (int k = 0; k < 3; k++)
        out[k] = (float)a[k];
}

static inline double dvec_dot(const double a[3], const double b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static inline void dvec_cross(double out[3], const double a[3], const double b[3]) {
    dvec_set(out, a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]);
}

static inline void dvec_sub(double out[3], const double a[3], const double b[3]) {
    dvec_set(out, a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

/* out = a + t b */
static inline void dvec_add_scaled(double out[3], const double a[3], double t, const double b[3]) {
    dvec_set(out, a[0] + t * b[0], a[1] + t * b[1], a[2] + t * b[2]);
}

static inline double dvec_length(const double a[3]) {
    return sqrt(dvec_dot(a, a));
}

static inline double dvec_distance_sq(const double a[3], const double b[3]) {
    double x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];
    return x * x + y * y + z * z;
}

/* Makes `a` a unit vector and returns the length it had. A zero vector stays as it is. */
static inline double dvec_normalize(double a[3]) {
    double length = dvec_length(a);
    if (length > 0.0)
        dvec_set(a, a[0] / length, a[1] / length, a[2] / length);
    return length;
}

#endif
