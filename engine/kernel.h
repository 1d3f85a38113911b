/* Cubic spline kernel with support h [Monaghan 1992], q = r / h in [0, 1]:
 *   W = k (6 q^3 - 6 q^2 + 1) for q <= 1/2, 2 k (1 - q)^3 above, k = 8 / (pi h^3);
 *   dW/dr = l q (3 q - 2) for q <= 1/2, -l (1 - q)^2 above, l = 48 / (pi h^4).
 * |dW/dr| is largest at q = 1/3, where it is l / 3: that bounds the fixed-point gradients of rows.h. */
#ifndef SKIFF_KERNEL_H
#define SKIFF_KERNEL_H

#include "base/angle.h"

#include <math.h>

typedef struct Kernel {
    float support;        /* h, m */
    float inv_support;    /* 1/m */
    float w_scale;        /* k, 1/m^3: also W(0) */
    float gradient_scale; /* l, 1/m^4 */
} Kernel;

static inline Kernel kernel_make(double support) {
    return (Kernel){.support = (float)support,
                    .inv_support = (float)(1.0 / support),
                    .w_scale = (float)(8.0 / (pi * support * support * support)),
                    .gradient_scale = (float)(48.0 / (pi * support * support * support * support))};
}

static inline float kernel_w(const Kernel *kernel, float r) {
    const float q = r * kernel->inv_support;
    if (q >= 1.0f)
        return 0.0f;
    const float p = 1.0f - q;
    return kernel->w_scale * (q <= 0.5f ? 1.0f - 6.0f * q * q * p : 2.0f * p * p * p);
}

/* (dW/dr) / r: grad W = this times (x_i - x_j). r in m; 0 where it is 0 / 0. */
static inline double kernel_gradient_factor(const Kernel *kernel, double r) {
    const double q = r * (double)kernel->inv_support, p = 1.0 - q;
    if (q >= 1.0)
        return 0.0;
    if (q <= 0.5)
        return (double)kernel->gradient_scale * (double)kernel->inv_support * (3.0 * q - 2.0);
    return -(double)kernel->gradient_scale * p * p / r;
}

#endif
