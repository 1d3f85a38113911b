/* A simulation's data, grouped by the phase that fills it. */
#ifndef SKIFF_SIM_H
#define SKIFF_SIM_H

#include "drive.h"
#include "sea.h"
#include "shape.h"

typedef struct EmitBlock {
    SkiffBlockDef def;
    int done; /* repetitions emitted so far */
} EmitBlock;

typedef struct Probe {
    SkiffProbeDef def;  /* name and object are owned copies */
    int32_t object;     /* -1: any */
    uint8_t *chosen[2]; /* pressure, or force on a region: 1 for the samples that count, of the fixed and the
                           moving set */
    double area;        /* m^2 of the chosen samples */
    double normal[3];   /* pressure: unit, from the fluid into the wall; body axes when the samples move */
    char (*channels)[96];
    int channel_count;
} Probe;

struct SkiffSim {
    /* set at creation */
    SkiffParams params;
    Kernel kernel;
    float volume;      /* m^3, of a particle */
    double origin[3];  /* of the window, world, m */
    CellBounds domain; /* window-local */
    int threads;
    SkiffSimd simd;
    const Passes *passes;
    uint64_t def_hash; /* of everything a state must agree with */
    EmitBlock *blocks;
    int block_count;
    Shape tank; /* window-local; the fluid is inside */
    bool tank_open;
    Body *bodies;
    int body_count;
    Drive *drives;
    int drive_count;
    Probe *probes;
    int probe_count;
    uint32_t probe_channels;

    /* the state */
    uint64_t step;
    double time;
    Particles particles;

    /* sort and search */
    uint32_t edge_count; /* particles that stand still around a window */
    Grid grid;
    Rows rows;
    Boundary boundary;

    /* solves */
    Dfsph dfsph;
    Buffer pressure;      /* [particles] Pa, unknowns of both solves of the last step: see pressure.c */
    Buffer object_forces; /* [objects][6] force (N) and torque about the object's centre (N m) of the last
                             step */

    /* filling */
    RestTile tile; /* loaded with the first fill */
    RestCloud rest;
    Sea sea;
    Ghosts ghosts;
    SkiffFill fill;

    /* advance */
    Buffer sums; /* [blocks] partial sums: of the statistics, of the water at a propeller */
    SkiffStats stats;
};

/* Emits the blocks whose time has come. Lattice points inside bodies, outside the tank or on existing water
 * are refused: see block.c. */
bool block_emit(SkiffSim *sim, uint32_t *emitted, Err *err);
/* Particles of one emission; also without a simulation's capacity (counts are exact, double to survive absurd
 * input). */
double block_particles(const SkiffBlockDef *def, float spacing, double counts[3]);

/* Gravity, viscosity, calming and wall friction of one step, for fluid and bodies. */
void forces_apply(SkiffSim *sim, const DfsphProblem *problem);
/* The fluid's part, but for friction. Uses the solver's vectors between its solves. */
void forces_apply_fluid(const DfsphProblem *problem, Dfsph *dfsph);

/* Drives of the bodies, which stand at their start. */
bool drives_make(SkiffSim *sim, const SkiffDef *def, Err *err);
/* Thrust, steering and extra drag of one step, added to what pushes the bodies. */
void drives_apply(SkiffSim *sim);

bool probes_make(SkiffSim *sim, const SkiffDef *def, Err *err);
void probes_free(SkiffSim *sim);

/* [particles] The unknowns of both solves together, Pa. */
void sim_add_pressures(const SkiffSim *sim, float *total);
/* Is p within `margin` (m) of a body? Bodies touch water too. */
bool sim_near_body(const SkiffSim *sim, const float p[3], double margin);

/* Room for `capacity` particles in everything a step uses; what is there stays. */
bool sim_reserve(SkiffSim *sim, uint32_t capacity, Err *err);

double timer_ms(void);

/* `wanted`, or when that is 0 the number of physical cores this process may use. */
int sim_threads(int wanted);

#endif
