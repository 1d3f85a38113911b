/* Water at rest in any shape [Carensac2023 sec. 3]: points of a fluid that is at rest everywhere are laid
 * over the place; near solids and existing water the ones too many are taken away by density alone
 * (selection), and what is left there is let settle while all other water stands still (stabilisation).
 *
 * Initialisation, window moves and absorption all fill through rest_fill. It works on a cloud of its own: the
 * points near solids and existing water and what surrounds them. Everything farther away is at rest as it
 * comes and is taken over untouched. */
#ifndef SKIFF_REST_H
#define SKIFF_REST_H

#include "dfsph.h"
#include "standing.h"
#include "tile.h"

/* What a point of the cloud is. FLUID and AIR may feel a solid or existing water; SUPPORT and SUPPORT_AIR
 * cannot and only surround them. FLUID that does becomes ACTIVE: the part that is stabilised. */
typedef enum RestKind {
    REST_FLUID,
    REST_AIR,
    REST_SUPPORT,
    REST_SUPPORT_AIR,
    REST_ACTIVE,
    REST_RIM /* stands still beside what is active */
} RestKind;

struct SkiffSim;

/* Where water shall be. All of it window-local. */
/* STILL: water that is known to touch nothing it does not fit. */
typedef enum RestPlace { REST_OUTSIDE, REST_IN_WATER, REST_STILL, REST_IN_AIR } RestPlace;

/* Water at rest that already fits the walls: what a window refills itself from. */
typedef struct RestFitted {
    uint32_t count;
    Float4 *position;     /* m, window-local; [3] 0 */
    float (*pressure)[2]; /* of the density and of the divergence solve, m^2 */
} RestFitted;

typedef struct RestRequest {
    CellBounds bounds; /* of the water; air is taken from up to a support radius around */
    float surface;     /* y of the still surface, m: gives depth and first pressure */
    /* Is p in the water, or in the space over or beside it that only lends its density? Called from several
     * threads. Not asked about walls and bodies: that is rest_fill's own business. */
    RestPlace (*place)(const void *user, const float p[3]);
    const void *user;
    const RestFitted *fitted; /* NULL: the tile, shifted by `offset` (m, world) */
    double offset[3];
    double birth; /* s, of the new particles */
    /* NULL, or: marks the edge of a window among the new particles, from `first` on, before they settle. */
    void (*mark_edge)(struct SkiffSim *sim, uint32_t first);
} RestRequest;

/* The points of a fill and what the stages need. Kept from fill to fill for its memory. */
typedef struct RestCloud {
    Particles points;       /* new ones; id: RestKind in the upper half */
    StandingWater standing; /* existing water that they can feel; then also new water beside what settles */
    Grid grid;
    Rows rows;
    Boundary boundary; /* the simulation's samples with contacts of the cloud's own */
    Dfsph dfsph;
    bool fits_walls;     /* the points fit the walls: these make no candidates and remove nothing */
    float counted_below; /* y: candidates above lack neighbours and do not count in the mean density */
    Buffer marks, clearance, laid, source, fate, tallies; /* rest_gather.c */
    Buffer speeds;       /* [particles of the simulation] m/s, before a step */
    Buffer frozen, held; /* [points] 1: gets no row; [particles of the simulation] 1: does not move */
    Buffer state, constant, walls, sum, density, order; /* rest_select.c */
    Buffer kept[PARTICLE_FIELD_COUNT + 1];              /* existing water as it was, and its densities */
    Buffer whence[2];                                   /* where existing water stands in `kept` */
} RestCloud;

/* Fills and appends the new particles to the simulation's. False: no memory, or the water is too dense
 * anywhere; the simulation's particles are as they were. */
bool rest_fill(struct SkiffSim *sim, const RestRequest *request, SkiffFill *fill, Err *err);
void rest_cloud_free(RestCloud *cloud);

/* Loads the tile of water at rest unless it is there; false when it is not made for the scene's volumeFactor.
 */
bool rest_check_tile(struct SkiffSim *sim, Err *err);

/* The stages of rest_fill. */
bool rest_gather(struct SkiffSim *sim, const RestRequest *request, SkiffFill *fill, Err *err);
bool rest_select(struct SkiffSim *sim, SkiffFill *fill, Err *err);
bool rest_settle(struct SkiffSim *sim, const RestRequest *request, SkiffFill *fill, Err *err);
/* The simulation's particles are a column of water, x and z in [0, period), that goes on periodically: all
 * but the edge settles. */
bool rest_settle_column(struct SkiffSim *sim, double period, SkiffFill *fill, Err *err);
/* Sorts the cloud, and makes rows and boundary terms of the kinds in `evaluated` (bits 1 << RestKind); the
 * others are only seen by these. */
bool rest_search(struct SkiffSim *sim, uint32_t evaluated, Err *err);
typedef struct RestNeighbour {
    uint32_t index;
    int32_t weight; /* in units of W(0) / 32767 */
} RestNeighbour;
/* Neighbours of particle i from its row, at most MAX_NEIGHBOURS; unused places have no weight and are left
 * out. Their number. */
int rest_row(const PairData *pairs, uint32_t i, RestNeighbour *row);
/* Distance from bodies and, if asked, walls, m: positive where water may be. An open tank goes on above its
 * rim. */
float rest_clearance(const struct SkiffSim *sim, const float p[3], bool walls);

static inline RestKind rest_kind(uint64_t id) {
    return (RestKind)(id >> 32);
}

static inline uint64_t rest_id(RestKind kind, uint64_t id) {
    return (uint64_t)kind << 32 | (id & 0xffffffffu);
}

#endif
