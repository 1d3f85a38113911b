/* The endless sea: water at rest that fits the tank's walls, the window that follows a body and refills
 * itself from it, and the absorption of waves at the edge [Carensac2023 sec. 4]. */
#ifndef SKIFF_SEA_H
#define SKIFF_SEA_H

#include "ghosts.h"
#include "water.h"

typedef struct Sea {
    bool on, absorbs;
    bool dry;          /* to be looked at only */
    bool water_edge;   /* no walls: water stands still around the window */
    double level;      /* y of the still surface, world, m */
    double centre[3];  /* of the walls, window-local, m */
    int follow;        /* body, or -1: the path */
    double (*path)[3]; /* t (s), x, z (world, m) */
    int path_count;
    bool has_region;                    /* absorption only here */
    float region_min[3], region_max[3]; /* window-local */
    RestFitted fitted;                  /* the whole */
    RestFitted ring;                    /* what moves may need of it: positions and pressures of its own */
    Buffer fitted_buffer, ring_buffer;
    /* with an edge of water */
    StillWater water;
    WaterList laid;              /* of the last move */
    Buffer rim_start, rim_index; /* edge.c */
    Float4 *inlets;              /* points where water may come in; [3]: density the walls give there */
    Float4 *inlet_normals;       /* horizontal, unit, into the window */
    float (*inlet_pressure)[2];
    uint32_t inlet_count;
    Buffer inlet_buffer, distance_buffer, flow_buffer;
    uint64_t moves;
} Sea;

/* Builds all that, filling the tank once without its bodies (or reading that from the cache), then puts the
 * water in. The tank, its samples and the bodies must be there. */
bool sea_make(struct SkiffSim *sim, const SkiffDef *def, Err *err);
void sea_free(Sea *sea);
/* Does water stand in for this window's walls? */
bool sea_has_water_edge(const SkiffDef *def);

/* Moves the window when what it follows has gone too far. */
bool window_follow(struct SkiffSim *sim, Err *err);
/* Of the body that is followed: signed distance from the edge, m, negative inside. */
float window_followed_distance(const struct SkiffSim *sim);

/* The edge as water (edge.c). Signed distance from it, m, negative inside; over the surface it goes straight
 * up. */
float edge_distance(const struct SkiffSim *sim, const float p[3], float gradient[3]);
/* The first water. */
bool edge_gather_all(struct SkiffSim *sim, Err *err);
void edge_mark(struct SkiffSim *sim, uint32_t first);
/* Moves the window by `shift` (m). */
bool edge_move(struct SkiffSim *sim, const float shift[3], Err *err);
/* One step of a particle that stands still. */
void edge_advance(struct SkiffSim *sim, uint32_t i);

/* Takes water in and out at the edge, after a step. */
bool absorb_waves(struct SkiffSim *sim, Err *err);
bool absorb_make(struct SkiffSim *sim, Err *err);

#endif
