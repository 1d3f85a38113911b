/* Skiff: particle water (SPH) around moving bodies. The engine's public interface: no GL, no stdout, no files
 * but states.
 *
 * Units are SI, y is up. Arrays are owned by the simulation and valid until the next call that changes it.
 * Functions that can fail take an `Err *` last, return false or NULL, and leave their object as it was unless
 * they say otherwise. One simulation is used by one thread at a time; it runs its own OpenMP threads inside a
 * call. Results do not depend on their number, bit for bit.
 *
 *   SkiffDef def = skiff_def_default();
 *   ... fill in ...
 *   SkiffSim *sim = skiff_create(&def, &err);
 *   while (skiff_time(sim) < 10.0 && skiff_step(sim, &err)) { ... }
 *   skiff_destroy(sim);
 */
#ifndef SKIFF_H
#define SKIFF_H

#include "base/err.h"

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* ---- Settings (params.inl and drive.inl are the one list of them) ---- */

#define PARAM_FLOAT(field, key, value, min, max, unit, help)  float field;
#define PARAM_INT(field, key, value, min, max, unit, help)    int field;
#define PARAM_BOOL(field, key, value, help)                   bool field;
#define PARAM_VEC3(field, key, x, y, z, min, max, unit, help) float field[3];
#define PARAM_ENUM(field, key, value, names, help)            int field;

typedef struct SkiffParams {
#include "params.inl"
} SkiffParams;

/* What drives and steers a body. */
typedef struct SkiffDriveDef {
#include "drive.inl"
} SkiffDriveDef;

#undef PARAM_FLOAT
#undef PARAM_INT
#undef PARAM_BOOL
#undef PARAM_VEC3
#undef PARAM_ENUM

/* Values of enums of params.inl, in the order of their names. */
enum { SKIFF_SOLVER_GCR, SKIFF_SOLVER_JACOBI, SKIFF_SOLVER_SPLIT };
enum { SKIFF_ESCAPE_ERROR, SKIFF_ESCAPE_REMOVE };
enum { SKIFF_REST_RULE_BASE, SKIFF_REST_RULE_REGULATOR, SKIFF_REST_RULE_PROTECTION };
enum { SKIFF_REST_PROTECTOR_MARKED, SKIFF_REST_PROTECTOR_DENSER, SKIFF_REST_PROTECTOR_PRINTED };
enum { SKIFF_REST_SETTLE_ALL, SKIFF_REST_SETTLE_CANDIDATES, SKIFF_REST_SETTLE_SHELL };
enum { SKIFF_REST_SCHEDULE_CONSTANT, SKIFF_REST_SCHEDULE_PRINTED };
enum { SKIFF_WINDOW_EDGE_WALLS, SKIFF_WINDOW_EDGE_WATER };
/* The same of drive.inl. */
enum { SKIFF_THRUST_AT_CENTRE, SKIFF_THRUST_AT_PROPELLER };
enum { SKIFF_STEERING_TORQUE, SKIFF_STEERING_RUDDER };
enum { SKIFF_HOLD_PROPORTIONAL, SKIFF_HOLD_BANGBANG };

typedef enum SkiffParamType { SKIFF_FLOAT, SKIFF_INT, SKIFF_BOOL, SKIFF_VEC3, SKIFF_ENUM } SkiffParamType;

typedef struct SkiffParamInfo {
    const char *key; /* JSON key */
    SkiffParamType type;
    uint32_t offset;    /* of the field in its struct */
    double defaults[3]; /* [0] for scalars; enums: index */
    double min, max;    /* inclusive; per component for vectors */
    const char *unit;   /* "" where there is none */
    const char *names;  /* enums: "a|b|c"; else NULL */
    const char *help;
} SkiffParamInfo;

const SkiffParamInfo *skiff_param_infos(int *count); /* of SkiffParams */
const SkiffParamInfo *skiff_drive_infos(int *count); /* of SkiffDriveDef */
/* Every field in its range and finite; ERR_INPUT with one line of message for each that is not. */
bool skiff_params_check(const SkiffParams *params, Err *err);

/* ---- What a simulation is made of. Strings and arrays are borrowed during skiff_create only. ---- */

typedef enum SkiffGeometryKind {
    SKIFF_GEOMETRY_NONE,
    SKIFF_GEOMETRY_MESH,
    SKIFF_GEOMETRY_BOX,
    SKIFF_GEOMETRY_SPHERE,
    SKIFF_GEOMETRY_PLANES,
    SKIFF_GEOMETRY_CYLINDER,
    SKIFF_GEOMETRY_STAR,
    SKIFF_GEOMETRY_CONE
} SkiffGeometryKind;

enum { SKIFF_MAX_BRANCHES = 64 }; /* of a star */

/* Own frame -> world: scale, rotate about `rotation_axis` by `rotation_angle` (rad), translate. Everything
 * but meshes and planes is centred on its own origin; cylinders, stars and cones stand upright. */
typedef struct SkiffGeometryDef {
    SkiffGeometryKind kind;
    const char *file;               /* mesh: OBJ file, closed */
    float size[3];                  /* box: edge lengths, m */
    float radius;                   /* m; sphere, cylinder; star: of its tips; cone: at the bottom */
    float inner_radius;             /* star: of the corners between tips, above 0 and up to radius, m */
    float top_radius;               /* cone: at the top, 0 for a tip, may exceed radius, m */
    float height;                   /* cylinder, star, cone, m */
    int branches;                   /* star: 2 to SKIFF_MAX_BRANCHES; the first points towards +z */
    const float (*plane_points)[3]; /* planes: convex region (p - point) . normal <= 0; normals point out */
    const float (*plane_normals)[3];
    int plane_count;
    float scale[3];
    float rotation_axis[3];
    float rotation_angle;
    float translation[3];
} SkiffGeometryDef;

/* The walls around the fluid: the inside of a closed geometry. */
typedef struct SkiffTankDef {
    SkiffGeometryDef geometry; /* kind NONE: no tank */
    bool open;                 /* no lid */
    float wet_height;          /* only walls below this y are sampled, m; INFINITY: all */
} SkiffTankDef;

typedef enum SkiffFillKind {
    SKIFF_FILL_LATTICE, /* a cubic lattice of spacing d: round((end - start) / d) particles along each axis,
                           at least one; all of it must be inside the tank and free of water */
    SKIFF_FILL_REST /* water at rest [Carensac2023 sec. 3]: as much as walls, bodies and water that is there
                       already leave room for; its surface is the top of the block */
} SkiffFillKind;

/* An axis-aligned block of water. */
typedef struct SkiffBlockDef {
    float start[3], end[3]; /* m */
    SkiffFillKind fill;
    float offset[3];   /* rest: shifts the pattern of the points, m */
    float velocity[3]; /* m/s */
    double time;       /* s, when it is emitted; <= 0: at the start */
    double period;     /* s between repetitions */
    int repeat;        /* how many times in all, >= 1 */
} SkiffBlockDef;

/* Bits of SkiffBodyDef.free_axes: translation along and rotation about the world's axes. */
enum {
    SKIFF_FREE_X = 1,
    SKIFF_FREE_Y = 2,
    SKIFF_FREE_Z = 4,
    SKIFF_FREE_RX = 8,
    SKIFF_FREE_RY = 16,
    SKIFF_FREE_RZ = 32,
    SKIFF_FREE_ALL = 63
};

/* A rigid body. An axis that is not free keeps the initial velocity (0: it is held). */
typedef struct SkiffBodyDef {
    const char *name; /* unique, not empty */
    SkiffGeometryDef geometry;
    float density;             /* kg/m^3, of the uniform solid; used when mass is 0 */
    float mass;                /* kg, or 0 */
    float velocity[3];         /* of the centre of mass, m/s */
    float angular_velocity[3]; /* rad/s, world axes */
    uint32_t free_axes;        /* 0: static or prescribed */
    double release_time; /* s; until then the body is held still in every axis that is free afterwards */
    double stop_time;    /* s; from then on it is held still in every axis; INFINITY: never */
    double ramp_time; /* s; velocities of axes that are not free rise from 0 between the times 0 and this */
    const SkiffDriveDef *drive; /* NULL: none */
} SkiffBodyDef;

typedef enum SkiffProbeKind {
    SKIFF_PROBE_HEIGHT,   /* length of the vertical line at (x, z) that is under water, m: what a wave gauge
                             reads */
    SKIFF_PROBE_PRESSURE, /* mean pressure on the boundary samples within `radius` of a point, Pa */
    SKIFF_PROBE_FORCE /* force (N) and torque about the body's centre or the world origin (N m) of the fluid
                         on an object */
} SkiffProbeKind;

typedef struct SkiffProbeDef {
    const char *name; /* unique, not empty */
    SkiffProbeKind kind;
    float point[3];     /* m; height: y is ignored */
    float radius;       /* m; pressure: 0 means the support radius */
    const char *object; /* force: a body's name, or "tank"; pressure: NULL (any) or a name */
    bool has_region;    /* force: only samples inside [min, max], in the world at the start */
    float min[3], max[3];
} SkiffProbeDef;

/* A sea without end around the tank [Carensac2023 sec. 4]: the tank is filled to `level` with water at rest,
 * becomes the window that follows a body, and waves die at its edge. One that moves has no walls unless
 * windowEdge says so: the world's water at rest stands around it, one support wide, as particles that are
 * part of the simulation's. */
typedef struct SkiffSeaDef {
    bool on;
    float level;        /* y of the still surface, m */
    const char *follow; /* a body's name, or NULL */
    /* [path_count] time (s, rising), x, z (m): where the middle of the window goes instead, along straight
     * lines; NULL: it stays */
    const double (*path)[3];
    int path_count;
    bool absorb;
    bool has_region; /* absorption only where [min, max] is, m */
    float region_min[3], region_max[3];
    const char *cache; /* folder for water that was made before, or NULL */
    bool dry; /* no water, which takes long to make: for who only looks at shapes; neither steps nor loads */
} SkiffSeaDef;

typedef enum SkiffSimd { SKIFF_SIMD_AUTO, SKIFF_SIMD_PLAIN, SKIFF_SIMD_AVX2, SKIFF_SIMD_AVX512 } SkiffSimd;
#define SKIFF_SIMD_NAMES "auto|plain|avx2|avx512" /* as skiff_simd_name has them */

enum { SKIFF_MAX_THREADS = 256 };

typedef struct SkiffDef {
    SkiffParams params;
    SkiffTankDef tank;
    const SkiffBlockDef *blocks;
    int block_count;
    const SkiffBodyDef *bodies;
    int body_count;
    SkiffSeaDef sea;
    const SkiffProbeDef *probes;
    int probe_count;
    double start_time; /* s */
    bool has_domain;   /* false: bounds of everything, grown */
    float domain_min[3], domain_max[3];
    int threads; /* up to SKIFF_MAX_THREADS; 0: the number of physical cores this process may use */
    SkiffSimd simd;
} SkiffDef;

/* Where every def begins: the defaults of a scene file. What has none (names, kinds of geometry) is zero. */
SkiffDef skiff_def_default(void);
SkiffGeometryDef skiff_geometry_default(void);
SkiffBlockDef skiff_block_default(void);
SkiffBodyDef skiff_body_default(void);
SkiffDriveDef skiff_drive_default(void);
SkiffProbeDef skiff_probe_default(void);

/* ---- Life ---- */

typedef struct SkiffSim SkiffSim;

/* Checks everything, then builds. NULL with ERR_INPUT: every problem found, one a line, each beginning with
 * its path in a scene file ("FluidBlocks[2]: ..."). */
SkiffSim *skiff_create(const SkiffDef *def, Err *err);
/* NULL is fine. */
void skiff_destroy(SkiffSim *sim);

/* One step of params.time_step. ERR_USAGE: of a sea made dry. ERR_DIVERGED (step, particle, value in the
 * message): the state is the one in which the fault was found. */
bool skiff_step(SkiffSim *sim, Err *err);

/* Fills a block with water at rest now, whatever its `fill`, `time` and `repeat` say. What is there already
 * does not move. False, and the simulation is as it was: ERR_INPUT, there is no room in the block, or no
 * memory, or params.volume_factor is not the rest tile's; ERR_DIVERGED, what exists is not fit to be filled
 * beside. */
bool skiff_fill_block(SkiffSim *sim, const SkiffBlockDef *block, Err *err);
/* Takes away the fluid particles inside [min, max) (m, world) and tells how many these were; the others stay
 * as they are. ERR_INPUT: no memory, and nothing is removed. */
bool skiff_remove_box(SkiffSim *sim, const double min[3], const double max[3], uint32_t *removed, Err *err);

/* ---- Looking ---- */

double skiff_time(const SkiffSim *sim); /* s */
uint64_t skiff_step_count(const SkiffSim *sim);
const SkiffParams *skiff_params(const SkiffSim *sim); /* the simulation's own */
SkiffSimd skiff_simd(const SkiffSim *sim);            /* the one in use, never AUTO */
const char *skiff_simd_name(SkiffSimd simd);
int skiff_threads(const SkiffSim *sim);

/* Fluid particles, in an order that changes from step to step; `id` tells who is who. Positions are
 * window-local: add `origin`. */
typedef struct SkiffParticles {
    uint32_t count;
    double origin[3];
    const float (*position)[4]; /* m; [3] is unused */
    const float (*velocity)[4]; /* m/s */
    const float *density;       /* rho / rho0, at the start of the last step; 0 before a particle's first */
    const float *unknown; /* Pa, what the solves of the last step found; before it, of water at rest. Forces
                             come of it; beside walls it is more than the pressure: see skiff_pressure */
    const uint64_t *id;   /* never reused */
    const double *birth;  /* s */
} SkiffParticles;
SkiffParticles skiff_particles(const SkiffSim *sim);

/* Pressure of every particle (skiff_particles(sim).count values, in their order), Pa, mean over the last
 * step; before it, of water at rest. It takes a search for neighbours, which no step pays for. The gradient
 * of p(x) = sum_j V P_j W(x - x_j), P the unknowns above, is what accelerates the water, and its value at a
 * wall is the force on the wall's area (pressure.c has the derivation): it is hydrostatic in water at rest up
 * to floors, walls and corners. ERR_INPUT: no memory; ERR_DIVERGED: a particle is nowhere. */
bool skiff_pressure(const SkiffSim *sim, float *pressure, Err *err);

/* Samples of walls and of bodies. Volumes after [Akinci2012]. */
typedef struct SkiffBoundary {
    uint32_t count;
    const float (*position)[4]; /* m, window-local; [3]: volume, m^3 */
    const int32_t *object;      /* 0: tank; 1 + i: body i */
} SkiffBoundary;
/* Of all that never moves, or of all that may. */
void skiff_boundary_samples(const SkiffSim *sim, bool moving, SkiffBoundary *view);

typedef struct SkiffBody {
    const char *name;
    double mass;                /* kg */
    double inertia[3][3];       /* kg m^2, about the centre of mass, body axes */
    double position[3];         /* of the centre of mass, world, m */
    double rotation[4];         /* unit quaternion x y z w; identity at the start, whatever the geometry's own
                                   rotation */
    double velocity[3];         /* m/s */
    double angular_velocity[3]; /* rad/s, world axes */
    double force[3];            /* of the fluid, mean over the last step, N */
    double torque[3];           /* about the centre of mass, N m */
    uint32_t sample_count;
} SkiffBody;
/* Bodies are numbered as in the def, from 0. */
int skiff_body_count(const SkiffSim *sim);
SkiffBody skiff_body(const SkiffSim *sim, int index);
/* Adds a force (N) and a torque about the centre of mass (N m), world axes, during the next step; nothing
 * moves along axes that are not free. Calls add up; saved states do not hold what no step has used. */
void skiff_body_push(SkiffSim *sim, int index, const double force[3], const double torque[3]);
/* The body's surface in body axes, relative to the centre of mass: a point p is at position + R p in the
 * world. Owned by the simulation. */
void skiff_body_mesh(const SkiffSim *sim, int index, const float (**vertices)[3], uint32_t *vertex_count,
                     const uint32_t (**triangles)[3], uint32_t *triangle_count);
/* The material of each of these triangles, as an index, and the name of each material (from the OBJ file's
 * usemtl records). NULL: no materials. Owned by the simulation. */
const uint8_t *skiff_body_materials(const SkiffSim *sim, int index);
/* "" past the last one, and for faces before the first record. */
const char *skiff_body_material_name(const SkiffSim *sim, int index, int material);

/* The surface of the tank, window-local; no triangles where there is none. Owned by the simulation. */
void skiff_tank_mesh(const SkiffSim *sim, const float (**vertices)[3], uint32_t *vertex_count,
                     const uint32_t (**triangles)[3], uint32_t *triangle_count);

/* ---- Driving. Drives are numbered in the order of their bodies. ---- */

/* What the helmsman does. All zero: nothing. */
typedef struct SkiffControls {
    double throttle; /* -1 (astern) to 1 */
    double rudder;   /* -1 (to port) to 1 (to starboard); not looked at while a heading is held */
    bool hold;       /* steer for `heading` */
    double heading;  /* rad, to starboard of the direction that the drive's axis had at the start; any turn */
} SkiffControls;

typedef struct SkiffDrive {
    int body;
    SkiffControls controls;
    double heading; /* rad, -pi to pi, as in SkiffControls; of the axis, seen from above */
    double speed;   /* m/s, horizontal, along the heading */
    /* applied in the last step; 0 before the drive's start time and while the body is held */
    double thrust; /* N, negative astern */
    double water;  /* 0 to 1: how much of its thrust the water gives a propeller; 1 at the centre of mass */
    double rudder; /* -1 to 1, the heading hold's while one is held */
    double torque; /* N m of the steering about the vertical through the centre of mass, to starboard */
} SkiffDrive;

int skiff_drive_count(const SkiffSim *sim);
SkiffDrive skiff_drive(const SkiffSim *sim, int drive);
/* For all steps from now on. Part of the state. ERR_USAGE when a value is out of range. */
bool skiff_drive_set(SkiffSim *sim, int drive, const SkiffControls *controls, Err *err);

/* ---- What a step came to ---- */

enum {
#define PHASE(id, key, label) SKIFF_PHASE_##id,
#include "phases.inl"
#undef PHASE
    SKIFF_PHASE_COUNT
};
/* Key: a word for files. Label: for people. Static strings. */
const char *skiff_phase_key(int phase);
const char *skiff_phase_label(int phase);

/* Why particles appear (SKIFF_IN_...) and disappear (SKIFF_OUT_...): causes.inl. */
enum {
#define CAUSE_IN(id, key, label) SKIFF_IN_##id,
#define CAUSE_OUT(id, key, label)
#include "causes.inl"
#undef CAUSE_IN
#undef CAUSE_OUT
    SKIFF_IN_COUNT
};
enum {
#define CAUSE_IN(id, key, label)
#define CAUSE_OUT(id, key, label) SKIFF_OUT_##id,
#include "causes.inl"
#undef CAUSE_IN
#undef CAUSE_OUT
    SKIFF_OUT_COUNT
};
const char *skiff_in_key(int cause);
const char *skiff_in_label(int cause);
const char *skiff_out_key(int cause);
const char *skiff_out_label(int cause);

typedef struct SkiffStats {
    uint64_t step;
    double time, dt; /* s, at the end of the step */
    uint32_t particles, boundary_samples, contacts;
    uint32_t particles_in[SKIFF_IN_COUNT], particles_out[SKIFF_OUT_COUNT]; /* during the step, by cause */
    bool moved;                                                            /* the window moved in this step */
    int density_iterations, divergence_iterations;
    double density_error_percent; /* mean over all particles of max(0, rho/rho0 - 1), found at the start of
                                     the step: what the last one left */
    double density_max_percent;   /* largest rho/rho0 - 1 */
    double
        divergence_error_percent; /* mean over all of max(0, dt Drho/Dt / rho0) after the divergence solve */
    double residual_percent;      /* mean two-sided residual of the density solve */
    double neighbours; /* mean number of fluid and boundary neighbours, without the particle itself */
    double mean_speed, max_speed;            /* m/s */
    double mean_height;                      /* mean y, m */
    double kinetic_energy, potential_energy; /* J, of the fluid */
    double momentum[3];                      /* kg m/s, of the fluid */
    double phase_ms[SKIFF_PHASE_COUNT];
    double step_ms;
} SkiffStats;
/* Of the last step. */
const SkiffStats *skiff_stats(const SkiffSim *sim);

/* Where the window is. */
typedef struct SkiffWindow {
    double centre[3]; /* world, m; y of the still surface */
    double level;     /* y of the still surface, world, m */
    uint64_t moves;
} SkiffWindow;
/* False: there is none. */
bool skiff_window(const SkiffSim *sim, SkiffWindow *window);
/* Distances to the window's edge, m, negative inside, of `count` window-local points ([3] is not looked at).
 * There must be a window. */
void skiff_window_distances(const SkiffSim *sim, const float (*position)[4], uint32_t count, float *distance);

/* Particles that a window move or absorption took away during the last half second; window-local, where and
 * how fast they were then. */
typedef struct SkiffGhosts {
    uint32_t count;
    const float (*position)[4]; /* m */
    const float (*velocity)[4]; /* m/s */
    const uint64_t *id;
    const double *birth, *removed; /* s */
} SkiffGhosts;
SkiffGhosts skiff_ghosts(const SkiffSim *sim);

/* What filling with water at rest did: counts, densities and times of [Carensac2023 table 1]. Densities are
 * relative to rest density, over the candidates (points that feel a solid or existing water). */
typedef struct SkiffFill {
    uint32_t particles;    /* new */
    uint32_t candidates;   /* before the selection */
    uint32_t selected;     /* left of them */
    uint32_t active;       /* particles that are stabilised */
    uint32_t rim;          /* particles beside them that stand still meanwhile */
    int passes;            /* of the selection, the first and the last that only look included */
    int steps;             /* of the stabilisation */
    double density_mean;   /* after the selection, with the air still there */
    double density_spread; /* standard deviation about the mean */
    double density_rms;    /* root of the mean squared distance from the target */
    double mean_speed,
        max_speed; /* m/s, of the active in the last step of the stabilisation, before damping */
    double load_ms, select_ms, settle_ms;
} SkiffFill;
/* The last fill; all zero when there was none. */
const SkiffFill *skiff_fill(const SkiffSim *sim);

/* Probe channels, in the order of the def: a height or pressure gives one value, a force six (fx fy fz tx ty
 * tz). */
int skiff_probe_channel_count(const SkiffSim *sim);
const char *skiff_probe_channel_name(const SkiffSim *sim, int channel); /* "name" or "name.fx" */
/* `values`: one for each channel. */
void skiff_probe_read(const SkiffSim *sim, double *values);

/* XXH3 of the whole state: time, particles, warm starts, bodies. Equal for equal states whatever threads, ISA
 * or machine made them. */
uint64_t skiff_hash(const SkiffSim *sim);

/* Bytes held by the simulation. */
uint64_t skiff_memory(const SkiffSim *sim);

/* ---- States ---- */

/* Saves everything that the next steps depend on. ERR_IO: the old file, if any, is intact. */
bool skiff_save(const SkiffSim *sim, const char *path, Err *err);
/* Replaces the state of a simulation made from the same def. ERR_INPUT when the file is damaged or belongs to
 * another def, ERR_USAGE for a sea made dry; sim is then unchanged. */
bool skiff_load(SkiffSim *sim, const char *path, Err *err);

/* ---- Water at rest: what shapes are filled from ---- */

/* Points of water at rest, in units of the particle radius: a periodic tile, which fills boxes of any size,
 * or a block cut out of a simulation, which ends at its faces. skiff_tile_destroy ends any of them. */
typedef struct SkiffTile SkiffTile;

typedef struct SkiffTileDef {
    double edge; /* of the cube to begin with, d: 6 to 64; scaling to rest density changes it by 0.1 % */
    double volume_factor; /* volume of a particle, d^3 */
    uint64_t seed;
    int iterations; /* at most; the relaxation ends sooner when nothing moves any more */
    int threads;    /* as SkiffDef.threads; the result does not depend on it */
} SkiffTileDef;

typedef struct SkiffTileInfo {
    uint32_t count;
    bool periodic;
    double size[3]; /* of the box, r */
    double volume_factor;
} SkiffTileInfo;

typedef struct SkiffTileQuality {
    uint32_t count; /* points measured: all of a tile, those of a block farther than 4 r from its faces */
    double number_density;                                     /* particles per d^3 */
    double density_mean, density_sd, density_min, density_max; /* rho / rho0 */
    double gradient_rms, gradient_max;                         /* h |sum V grad W|: 0 for perfect symmetry */
    double force_rms, force_max;      /* h |sum V (s_i + s_j) / 2 grad W|, s the pressure shares: what of the
                                         former these leave unbalanced */
    double share_sd;                  /* of s, whose mean is 1 */
    double anisotropy;                /* largest entry of 3 sum W d d^T / sum W d^2 - I */
    double nearest_min, nearest_mean; /* distance to the nearest point, d */
} SkiffTileQuality;

/* edge 12 d (2171 points), volume factor 0.8 */
SkiffTileDef skiff_tile_def_default(void);
/* A periodic tile of random points, relaxed to rest. NULL with ERR_INPUT: a setting out of range, or not at
 * rest within `iterations`. */
SkiffTile *skiff_tile_make(const SkiffTileDef *def, Err *err);
/* The particles inside [min, max] (m, world) as a block. NULL with ERR_INPUT: none is, or the box is too
 * small for a particle with all its neighbours. */
SkiffTile *skiff_tile_cut(const SkiffSim *sim, const double min[3], const double max[3], Err *err);
/* The built-in tile settled under a free surface, as a block whose sides repeat: what a sea is made of. Takes
 * a minute. */
SkiffTile *skiff_tile_surface(int threads, Err *err);
/* Reads a file; path NULL: the tile that comes with the program. NULL with ERR_INPUT or ERR_IO. */
SkiffTile *skiff_tile_open(const char *path, Err *err);
/* ERR_IO: the old file, if any, is intact. */
bool skiff_tile_save(const SkiffTile *tile, const char *path, Err *err);
SkiffTileInfo skiff_tile_info(const SkiffTile *tile);
/* ERR_INPUT: a block so small that no point of it has all its neighbours, or no memory. */
bool skiff_tile_measure(const SkiffTile *tile, SkiffTileQuality *quality, Err *err);
/* NULL is fine. */
void skiff_tile_destroy(SkiffTile *tile);

#ifdef __cplusplus
}
#endif
#endif
