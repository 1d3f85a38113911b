/* The hot loops: everything that visits particle pairs. One text (passes.c, search.c) compiled once per
 * instruction set; a table of functions each; all tables give the same bits.
 *
 * Particles are sorted by cell, but see grid.h. Sixteen consecutive ones form a slice, 64 slices a block. A
 * block is the unit of scheduling and of summation: whatever thread runs it, it writes its own particles
 * only, and sums over particles are taken per block and then over the blocks in order. */
#ifndef SKIFF_PASSES_H
#define SKIFF_PASSES_H

#include "base/simd.h"
#include "cell_grid.h"
#include "kernel.h"

#include <stdbool.h>
#include <stdint.h>

enum {
    SLICE = LANES,     /* particles a slice */
    BLOCK_SLICES = 64, /* slices a block */
    BLOCK = SLICE * BLOCK_SLICES,
    ROW_GROUP = 32,          /* particles that slices are filled from, see grid.h; a part of a block */
    MAX_NEIGHBOURS = 496,    /* fluid neighbours a particle may have; at rest it has 34 */
    MAX_CANDIDATES = 8192,   /* particles in the 27 cells around one */
    MAX_NEAR_SAMPLES = 4096, /* of walls, or of bodies, within a support radius of one cell */
    MAX_CONTACT_OBJECTS = 8  /* walls and bodies that may touch one particle */
};

/* One k-th neighbour for each of a slice's sixteen particles, one cache line: the neighbour as offset from
 * the slice's first particle, and -V (dW/dr) / r in units of its largest value / 65535. Times x_i - x_j,
 * which the passes gather along with what they sum up, that is -V grad W: exactly antisymmetric, and a
 * quarter of the traffic of three single-precision components. The rows are streamed from memory in every
 * pass, and that is what a pass costs. Unused places point at the particle itself with factor 0. */
typedef struct RowEntry {
    int16_t place[SLICE];
    uint16_t factor[SLICE];
} RowEntry;

/* The same with room for any offset, for flows so wide that an offset may leave 16 bits. */
typedef struct RowEntryWide {
    int32_t place[SLICE];
    uint16_t factor[SLICE];
} RowEntryWide;

/* Terms of one particle against one wall or body, summed over its samples b of volume psi_b: g = sum psi_b
 * grad W_ib, t = sum psi_b (x_b - c) x grad W_ib with c the object's centre (origin for walls). They replace
 * the samples in every iteration. */
typedef struct Contact {
    uint32_t particle;
    uint32_t object;
    float g[3];   /* 1/m */
    float t[3];   /* 1 */
    float weight; /* sum psi_b W_ib */
} Contact;

typedef struct ContactSpan {
    uint32_t start, count;
} ContactSpan;

/* Samples of walls or of bodies, sorted by cell. */
typedef struct SampleSet {
    CellGrid grid;
    const uint8_t *occupied; /* [cells] 1 where any of the 27 cells around holds a sample */
    const float *x, *y, *z;  /* m; padded by a slice */
    const float *volume;     /* psi, m^3 */
    const int32_t *object;   /* grouped within a cell */
    uint32_t count;
} SampleSet;

/* Water that stands still beside what the search is for, sorted by cell. To the solves it is a wall that
 * presses: it needs no rows, and no iteration visits it. */
typedef struct StandingSet {
    CellGrid grid;
    const float *x, *y, *z; /* m; padded by a slice */
    const Float4 *points;   /* the same; [3]: P, m^2 */
    uint32_t count;
} StandingSet;

/* What it gives the particles. */
typedef struct Standing {
    Float4 *push;  /* [particles] sum P V grad W, m; [3]: sum V W, its part of the density */
    Float4 *apart; /* [particles] sum of r - d along the line to the particle, over its points at a distance d
                    * below r = h / 4, m; [3]: how many are nearer than r / 2 */
} Standing;

/* Samples near one cell. */
typedef struct NearSamples {
    int32_t cell; /* -1: none yet */
    int count;
    float x[MAX_NEAR_SAMPLES + LANES], y[MAX_NEAR_SAMPLES + LANES], z[MAX_NEAR_SAMPLES + LANES];
    float volume[MAX_NEAR_SAMPLES + LANES];
    int32_t object[MAX_NEAR_SAMPLES + LANES];
} NearSamples;

/* Who may be near a cell's particles. */
typedef struct Candidates {
    float x[MAX_CANDIDATES + LANES], y[MAX_CANDIDATES + LANES], z[MAX_CANDIDATES + LANES];
    int32_t halves[MAX_CANDIDATES + LANES]; /* their indices as vf_gather4_i32 takes them */
} Candidates;

/* Scratch of one thread; too large for the stack. */
typedef struct Scratch {
    Candidates candidates, standing;
    /* neighbours of a group's particles, the near ones and in the end all; the far ones; where each begins */
    int32_t lists[ROW_GROUP * (MAX_NEIGHBOURS + LANES) + 3 * LANES],
        far[ROW_GROUP * MAX_NEIGHBOURS + 3 * LANES];
    uint32_t list_start[ROW_GROUP], far_start[ROW_GROUP];
    /* their neighbours among standing water; where each particle's begin, and how many they are */
    int32_t standing_lists[ROW_GROUP * (MAX_NEIGHBOURS + LANES) + 3 * LANES];
    uint32_t standing_start[ROW_GROUP];
    int32_t standing_count[ROW_GROUP];
    NearSamples near[2]; /* walls, bodies */
    Contact contacts[BLOCK * MAX_CONTACT_OBJECTS];
} Scratch;

/* Entries of a slice. Neighbours nearer than NEAR_SUPPORT come first: of every particle they are among the
 * first `near` entries, which may hold others as well. */
typedef struct SliceRows {
    uint32_t start;
    uint16_t length, near;
} SliceRows;

/* In supports: the first shell of water at rest, 12 of 36 neighbours, and seven eighths of the sum of W_ij.
 */
#define NEAR_SUPPORT 0.68f

/* A particle's fluid neighbours, in all and near ones, in one number: particles.inl's row_size. */
static inline uint32_t row_size_of(uint32_t all, uint32_t near) {
    return all << 16 | near;
}
static inline uint32_t row_all(uint32_t row_size) {
    return row_size >> 16;
}
static inline uint32_t row_near(uint32_t row_size) {
    return row_size & 0xffffu;
}

/* What every pair pass reads. Arrays are padded to whole blocks. */
typedef struct PairData {
    uint32_t count;
    Kernel kernel;
    float volume;      /* V, m^3 */
    float factor_unit; /* value of 1 in RowEntry.factor, 1/m^2 */
    float centre[3];   /* m; middle of the particles: moments x . v are taken about it */
    bool wide;
    const uint8_t *entries; /* RowEntry or RowEntryWide */
    const int16_t *weights; /* [entries][SLICE] W_ij in units of W(0) / 32767; 0 in unused places */
    const SliceRows *slices;
    const Float4 *position;
    const float *density;       /* rho / rho0 */
    const Float4 *gradient_sum; /* G_i = sum_j V grad W_ij + g_i; [3]: diagonal of D D^T */
    const int16_t *gradients;   /* NULL, or [entries][3][SLICE] corrected gradients in place of the factors */
    float gradient_unit;        /* value of 1 in gradients, 1/m */
} PairData;

/* The particle in lane `lane` of an entry of the slice that begins at `first`. */
static inline uint32_t entry_neighbour(const PairData *pairs, uint32_t first, uint32_t entry, uint32_t lane) {
    const int32_t place = pairs->wide ? ((const RowEntryWide *)pairs->entries)[entry].place[lane]
                                      : ((const RowEntry *)pairs->entries)[entry].place[lane];
    return (uint32_t)((int32_t)first + place / 2);
}

typedef enum SearchStatus {
    SEARCH_OK = 0,
    SEARCH_NEEDS_WIDE = 1,  /* an index offset does not fit RowEntry */
    SEARCH_TOO_DENSE = 2,   /* more than MAX_NEIGHBOURS or MAX_CANDIDATES */
    SEARCH_NEEDS_MEMORY = 4 /* the row pool is too small */
} SearchStatus;

/* Takes room for `entries` row entries; returns the first or UINT32_MAX when the pool is used up. Called by
 * several threads. */
typedef uint32_t RowAllocate(void *rows, int thread, uint32_t entries);

typedef struct SearchJob {
    const CellGrid *grid;
    /* in the order of cells, see Grid */
    const uint32_t *cell, *member, *visits;
    const float *points[3];
    const Float4 *position;
    uint32_t count;
    Kernel kernel;
    float volume;
    float factor_unit; /* as in PairData */
    bool wide;
    uint8_t *entries;
    int16_t *weights;
    const uint8_t *frozen; /* NULL, or [particles] 1: gets no row, and density and gradient sum of none */
    SliceRows *slices;
    float *density;
    Float4 *gradient_sum; /* sum_j V grad W_ij, 1/m; [3]: sum of their squares */
    uint16_t *neighbours;
    uint32_t *row_size;          /* see particles.inl */
    const StandingSet *standing; /* NULL, or more water around, which gives: */
    Standing beside;
    RowAllocate *allocate;
    void *rows;
} SearchJob;

typedef struct BoundaryJob {
    const SampleSet *sets[2]; /* walls, bodies */
    const Float4 *position;
    const Float4 *centres;  /* of every object */
    const uint32_t *member; /* particles in the order of cells */
    const uint8_t *frozen;  /* NULL, or [particles] 1: left out */
    uint32_t count;
    Kernel kernel;
    float *density;       /* NULL: list the contacts only */
    Float4 *gradient_sum; /* in: as the search left it; out: with the boundary, [3] the diagonal */
    uint16_t *neighbours;
    Float4 *shape[2]; /* NULL, or out: moments of the walls, see CorrectionJob */
} BoundaryJob;

/* Gradients that are right for linear fields, made in two passes over the rows [Bonet & Lok 1999, kept
 * antisymmetric]: B_i = [sum_j -V grad W_ij (x_i - x_j)^T, samples of walls and bodies included]^-1, then
 * (B_i + B_j) / 2 V grad W_ij. What walls and bodies push with stays as it is. */
typedef struct CorrectionJob {
    const PairData *pairs;
    Float4 *shape[2];   /* in: moments of the walls (xx, yy, zz), (xy, xz, yz); `shape` turns them to B */
    int16_t *gradients; /* out of `correct`: as in PairData */
    float gradient_unit;
    Float4 *gradient_sum; /* out of `correct` */
} CorrectionJob;

/* Vectors that `divergence` takes carry their moment about PairData.centre in the fourth place: with it a
 * pair needs one gather, sum_j f (x_i - x_j) . v_j = x_i . sum_j f v_j - sum_j f x_j . v_j. The difference
 * costs the digits of (distance from the centre) / (distance of neighbours): at 100 supports the error is a
 * tenth of what rounding the factors makes. */
static inline float vector_moment(const PairData *pairs, const float *position, const float *v) {
    float moment = 0.0f;
    for (int k = 0; k < 3; k++)
        moment += (position[k] - pairs->centre[k]) * v[k];
    return moment;
}

typedef struct AccelerateJob {
    const Float4 *operand; /* position and p of every particle */
    const Float4 *base;
    float push[3]; /* added to the base */
    float scale;
    Float4 *result; /* with moments */
} AccelerateJob;

typedef struct ForceJob {
    const PairData *pairs;
    const Float4 *velocity; /* in */
    Float4 *result;         /* out: velocity - viscosity sum_j V W_ij (v_i - v_j) */
    float viscosity;
    float calming;           /* share of the velocity that is no part of a linear field taken away; 0: none */
    float calming_limit;     /* m/s: at most this of the difference between two particles */
    const Float4 *strain[2]; /* calming: of `strain` */
} ForceJob;

typedef struct StrainJob {
    const PairData *pairs;
    const Float4 *velocity;
    /* out: position and A_i h, m/s, of the linear field v + A (x - x_i) that fits best, as load_strain takes
     * it apart */
    Float4 *strain[2];
} StrainJob;

typedef struct Passes {
    const char *name;
    /* Neighbours of a block's particles: rows, density, gradient sums. Returns SearchStatus bits; on too
     * dense, *fault is the particle. */
    int (*search)(const SearchJob *job, uint32_t block, int thread, Scratch *scratch, uint32_t *fault);
    /* Boundary terms of a block's particles; contacts go to scratch->contacts. Returns how many, or -1 with
     * *fault. */
    int (*boundary)(const BoundaryJob *job, uint32_t block, Scratch *scratch, uint32_t *fault);
    /* result_i = base_i + push + scale (D^T p)_i, (D^T p)_i = p_i G_i + sum_j p_j V grad W_ij. base NULL: 0,
     * without push; base may be result. Its fourth place is not read. */
    void (*accelerate)(const PairData *pairs, const AccelerateJob *job, uint32_t block);
    /* result_i = (D v)_i = v_i . G_i - sum_j v_j . V grad W_ij, v with moments; contacts with moving bodies
     * are the caller's */
    void (*divergence)(const PairData *pairs, const Float4 *v, float *result, uint32_t block);
    void (*shape)(const CorrectionJob *job, uint32_t block);
    void (*correct)(const CorrectionJob *job, uint32_t block);
    /* velocity gradients by weighted least squares over the neighbours */
    void (*strain)(const StrainJob *job, uint32_t block);
    /* XSPH viscosity and calming, which conserve momentum exactly */
    void (*forces)(const ForceJob *job, uint32_t block);
} Passes;

/* Of search.c, for the table. */
#define PASSES_SEARCH(isa)                                                                                   \
    int search_##isa(const SearchJob *job, uint32_t block, int thread, Scratch *scratch, uint32_t *fault);   \
    int boundary_##isa(const BoundaryJob *job, uint32_t block, Scratch *scratch, uint32_t *fault)
PASSES_SEARCH(plain);
PASSES_SEARCH(avx2);
PASSES_SEARCH(avx512);
#undef PASSES_SEARCH

extern const Passes passes_plain;
#ifdef SKIFF_HAVE_X86
extern const Passes passes_avx2;
extern const Passes passes_avx512;
#endif

#endif
