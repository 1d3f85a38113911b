/* The fluid's particles: one array a field (particles.inl), padded to whole blocks, double-buffered for the
 * sort. */
#ifndef SKIFF_PARTICLES_H
#define SKIFF_PARTICLES_H

#include "base/arena.h"
#include "base/state_file.h"
#include "passes.h"

typedef enum ParticleFieldId {
#define PARTICLE_FIELD(field, type, components, state) PARTICLE_##field,
#include "particles.inl"
#undef PARTICLE_FIELD
    PARTICLE_FIELD_COUNT
} ParticleFieldId;

/* Water that stands still around a window, in place of a wall: as it was laid, or caught as it came. */
typedef enum ParticleEdge { EDGE_NONE, EDGE_LAID, EDGE_CAUGHT } ParticleEdge;

typedef struct Particles {
    uint32_t count;
    uint32_t capacity; /* multiple of BLOCK */
    uint64_t next_id;
    Float4 *position;
    Float4 *velocity;
    float *pressure;
    float *pressure_divergence;
    float *prediction;
    uint64_t *id;
    double *birth;
    uint32_t *row_size;
    uint8_t *edge;
    Buffer front[PARTICLE_FIELD_COUNT], back[PARTICLE_FIELD_COUNT];
} Particles;

typedef struct ParticleFieldInfo {
    const char *name;
    StateType type;
    uint32_t components;
    uint32_t size; /* bytes a particle */
} ParticleFieldInfo;

extern const ParticleFieldInfo particle_fields[PARTICLE_FIELD_COUNT];

bool particles_reserve(Particles *particles, uint32_t capacity, Err *err);
void particles_free(Particles *particles);

/* New particle k of the sorted order is old particle order[k]; the first `count` stay. Zeroes the padding
 * after them. */
void particles_permute(Particles *particles, const uint32_t *order, uint32_t count, int threads);

/* What has been written to the field's back buffer becomes its values. */
void particles_swap(Particles *particles, ParticleFieldId field);

/* Takes out the particles `gone` (ascending); the last of those that stay take their places, and take their
 * values of `scalar` with them. Zeroes the padding after them. */
void particles_remove(Particles *particles, const uint32_t *gone, uint32_t gone_count, float *scalar);

/* Appends one particle; the capacity must hold it. Returns its index. */
uint32_t particles_append(Particles *particles, const float position[3], const float velocity[3],
                          double birth);

/* The same for many: room for `count` at the end, which takes as many ids; returns the first index. Then each
 * is put there, by any thread. */
uint32_t particles_extend(Particles *particles, uint32_t count);
void particles_put(Particles *particles, uint32_t i, uint64_t id, const float position[3],
                   const float velocity[3], double birth);

/* Blocks of BLOCK particles that cover the fluid. */
static inline uint32_t particles_blocks(const Particles *particles) {
    return (particles->count + BLOCK - 1) / BLOCK;
}

#endif
