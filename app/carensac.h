/* The experiments of [Carensac2023] (doi 10.1177/00375497231216477): what each is made of, and what the paper
 * says came out. Where the paper leaves something open, the set-up is that of the authors' public code. */
#ifndef SKIFF_APP_CARENSAC_H
#define SKIFF_APP_CARENSAC_H

#include "sheet.h"

#include "engine/skiff.h"

/* Columns of the sheets table1 and fig2. */
enum {
    CARENSAC_PARTICLES,
    CARENSAC_NEAR, /* candidates that the selection left */
    CARENSAC_NEAR_BEFORE,
    CARENSAC_LOADING, /* ms, as all times */
    CARENSAC_SELECTION,
    CARENSAC_STABILIZATION,
    CARENSAC_TOTAL,
    CARENSAC_SELECTION_PASSES,
    CARENSAC_STABILIZATION_STEPS,
    CARENSAC_DENSITY,       /* of the candidates after selection, mean, kg/m^3 */
    CARENSAC_DENSITY_ERROR, /* its distance from the target, % of the target */
    CARENSAC_SPREAD,        /* of their densities about the target, % of the target */
    CARENSAC_FREE_MEAN,     /* speeds in the free steps after the last run's fill, worst step, cm/s; table1 */
    CARENSAC_FREE_MAX,
    CARENSAC_FILL_COLUMNS
};

/* Columns of fig4c. */
enum {
    CARENSAC_HEIGHT_END,
    CARENSAC_HEIGHT_MAX,
    CARENSAC_ROLL_MAX,
    CARENSAC_PITCH_MAX,
    CARENSAC_FLOAT_COLUMNS
};

/* Columns of fig5. */
enum {
    CARENSAC_SIDE_START, /* particles of the absorbing half */
    CARENSAC_SIDE_LEAST,
    CARENSAC_SIDE_END,     /* particles at 5.9 s */
    CARENSAC_DEPTH_END,    /* m, there and then */
    CARENSAC_ENERGY_RATIO, /* peaks of the first reflection, closed : absorbing */
    CARENSAC_ENERGY_END,   /* at 5.9 s, of the absorbing half, % of the closed one's */
    CARENSAC_WEDGE_COLUMNS
};

/* Columns of boat. */
enum {
    CARENSAC_BOAT_PARTICLES,
    CARENSAC_BOAT_SAMPLES,
    CARENSAC_BOAT_STEP,
    CARENSAC_BOAT_ABSORB,
    CARENSAC_BOAT_MOVE,
    CARENSAC_BOAT_AFTER,
    CARENSAC_BOAT_MEAN,
    CARENSAC_BOAT_SPEED,
    CARENSAC_BOAT_BOW_UP, /* degrees */
    CARENSAC_BOAT_COLUMNS
};

typedef enum CarensacSheet {
    CARENSAC_TABLE1,
    CARENSAC_FIG2,
    CARENSAC_FIG4C,
    CARENSAC_FIG5,
    CARENSAC_BOAT,
    CARENSAC_SHEET_COUNT
} CarensacSheet;

/* The sheet with its rows and the paper's figures, and no runs. ERR_IO: no memory. */
bool carensac_sheet(CarensacSheet which, Sheet *sheet, Err *err);

/* Which rules of the selection a row of fig2 uses. */
typedef enum CarensacRule { CARENSAC_BASE, CARENSAC_REGULATOR, CARENSAC_PROTECTION } CarensacRule;

typedef struct CarensacVariant {
    CarensacRule rule;
    double parameter; /* base: step, kg/m^3; others: R_ssr */
} CarensacVariant;

CarensacVariant carensac_variant(int fig2_row);

/* table1 has each of its experiments by the paper's method and then by the engine's defaults; fig4c its
 * one. */
typedef enum CarensacMethod { CARENSAC_PAPER, CARENSAC_DEFAULTS, CARENSAC_METHOD_COUNT } CarensacMethod;

/* How the paper and its authors' code stabilise, with no calming: the last is no part of theirs. */
void carensac_set_paper_method(SkiffParams *params);

/* A set-up. `def` points into it: do not copy. */
typedef struct CarensacSetup {
    SkiffDef def;
    SkiffBlockDef blocks[2]; /* the last is the water whose filling is measured; its top is the surface */
    SkiffBodyDef body;
    bool removes; /* before the last block comes, water in [removed_min, removed_max] goes */
    float removed_min[3], removed_max[3]; /* m */
    char mesh[4096]; /* file that the set-up wrote, to be removed by the caller; "" : none */
} CarensacSetup;

/* The experiments of table1, in its order. */
enum {
    CARENSAC_FLUID_FLUID,
    CARENSAC_FLUID_BOUNDARY,
    CARENSAC_PYRAMID,
    CARENSAC_FLOATING_CUBE,
    CARENSAC_FILL_COUNT
};

/* Particle radius of all of the paper's experiments, m. */
#define CARENSAC_RADIUS 0.025
/* The paper's steps, or as long ones for particles of another radius (m), s. */
double carensac_time_step(double radius);

/* Set-up of an experiment of table1 for particles of `radius` (m); fig2 and fig4c use the floating cube.
 * Files it needs are written to `folder`. */
bool carensac_set_up(int experiment, double radius, const char *folder, CarensacSetup *setup, Err *err);

/* Shift of the points of water at rest in a run, from -d to d on each axis, m. */
void carensac_offset(int run, double radius, double offset[3]);

#endif
