/* The pressure solves of DFSPH [Bender & Koschier 2017; Carensac2023 appendix A]: which pressures keep the
 * density, and the velocity's divergence, where they should be. */
#ifndef SKIFF_DFSPH_H
#define SKIFF_DFSPH_H

#include "boundary.h"

typedef enum SolveKind {
    SOLVE_DIVERGENCE,
    SOLVE_DENSITY,
    /* the two of pressureSolver split, in this order */
    SOLVE_FLOW, /* velocities, by corrected gradients; particles->pressure */
    SOLVE_SHIFT /* positions, by the density's own; particles->pressure_divergence. The velocities stay; guess
                   is what to move with */
} SolveKind;

typedef struct SolveResult {
    int iterations;  /* applications of the operator, the one for the warm start included */
    double error;    /* mean over the evaluated particles of max(0, residual), relative density */
    double residual; /* mean two-sided residual: |r| where there is pressure, max(0, r) elsewhere */
} SolveResult;

typedef struct Dfsph {
    Float4 *operand;       /* the particles' positions, and what D^T is applied to in the fourth place */
    Float4 *guess;         /* velocity after the pressure evaluated last */
    Float4 *answer;        /* D^T z */
    Float4 *spare;         /* for others between the solves, as are the two above; in them see base */
    double (*response)[6]; /* [objects] a body's answer: (D^T p) of its six velocities */
    float *residual, *direction, *image, *new_image, *inv_diagonal;
    float *source;         /* what stands beside dt D v: relative density */
    double *partials;      /* [blocks][DFSPH_SUMS] */
    double (*impulses)[6]; /* [objects] sums of boundary_impulse */
    float *lower;          /* [particles] least value of the unknown in a shift; one slice of zeros else */
    uint8_t *still;        /* [blocks] 1: all of it is held, and its vectors are zero during a solve */
    const float *carried;  /* NULL, or [particles] pressure that acts beside the unknown */
    const Float4
        *base; /* velocities before the pressures: the particles', or, pushed by standing water, in spare */
    float push[3]; /* m/s, of gravity: acts beside the pressures */
    bool shifting;
    bool moving;           /* any object has a velocity or may get one */
    bool answering;        /* and bodies answer pressure */
    const PairData *pairs; /* whose gradients the solve at hand is made with */
    Buffer buffer;
} Dfsph;

enum {
    DFSPH_SUMS = 6,
    DFSPH_CHUNK = 8 /* blocks handed out at a time: cores are seldom equally fast */
};

/* What the solves work on. */
typedef struct DfsphProblem {
    const SkiffParams *params;
    const Passes *passes;
    Rows *rows;
    Boundary *boundary;
    Body *bodies;
    int body_count;
    Particles *particles;
    const uint8_t *held;      /* NULL, or [particles] 1: keeps velocity and pressure, with a row or without */
    bool density_alone;       /* no divergence solve comes before the density's */
    bool settling;            /* a fill's: steps that only lead somewhere stop as a flow's do */
    uint32_t evaluated_count; /* particles that are not held: errors are means over these */
    int threads;
} DfsphProblem;

bool dfsph_reserve(Dfsph *dfsph, uint32_t particle_capacity, uint32_t object_count, Err *err);
void dfsph_free(Dfsph *dfsph);

/* Solves for the pressure field of `kind` (particles->pressure or pressure_divergence, warm start in, result
 * out). The divergence solve changes nothing else: the density solve after it gives velocities of fluid and
 * bodies what both have found, and the fluid its gravity. So does the flow's with its own; a shift changes no
 * velocity. */
SolveResult dfsph_solve(Dfsph *dfsph, const DfsphProblem *problem, SolveKind kind);

#endif
