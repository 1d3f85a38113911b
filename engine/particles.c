/* Storage of the fluid's particles and the permutation that sorting needs. */
#include "particles.h"

#include <assert.h>

const ParticleFieldInfo particle_fields[PARTICLE_FIELD_COUNT] = {
#define PARTICLE_FIELD(field, type, components, state)                                                       \
    [PARTICLE_##field] = {#field, state, components, (uint32_t)sizeof(type) * (components)},
#include "particles.inl"
#undef PARTICLE_FIELD
};

static void particles_bind(Particles *particles) {
#define PARTICLE_FIELD(field, type, components, state)                                                       \
    particles->field = particles->front[PARTICLE_##field].data;
#include "particles.inl"
#undef PARTICLE_FIELD
}

bool particles_reserve(Particles *particles, uint32_t capacity, Err *err) {
    /* one slice beyond the last block: sixteen-wide loads may begin at the last particle */
    const uint32_t padded = (capacity + BLOCK - 1) / BLOCK * BLOCK;
    for (int f = 0; f < PARTICLE_FIELD_COUNT; f++) {
        const size_t size = (size_t)(padded + SLICE) * particle_fields[f].size;
        if (!buffer_reserve(&particles->front[f], particle_fields[f].name, size, err) ||
            !buffer_reserve(&particles->back[f], particle_fields[f].name, size, err))
            return false;
    }
    if (padded > particles->capacity)
        particles->capacity = padded;
    particles_bind(particles);
    return true;
}

void particles_free(Particles *particles) {
    for (int f = 0; f < PARTICLE_FIELD_COUNT; f++) {
        buffer_free(&particles->front[f]);
        buffer_free(&particles->back[f]);
    }
    *particles = (Particles){0};
}

static void permute_field(const ParticleFieldInfo *info, const void *from, void *to, const uint32_t *order,
                          uint32_t begin, uint32_t end) {
    switch (info->size) {
    case 1:
        for (uint32_t k = begin; k < end; k++)
            ((uint8_t *)to)[k] = ((const uint8_t *)from)[order[k]];
        break;
    case 4:
        for (uint32_t k = begin; k < end; k++)
            ((uint32_t *)to)[k] = ((const uint32_t *)from)[order[k]];
        break;
    case 8:
        for (uint32_t k = begin; k < end; k++)
            ((uint64_t *)to)[k] = ((const uint64_t *)from)[order[k]];
        break;
    default:
        for (uint32_t k = begin; k < end; k++)
            memcpy((char *)to + (size_t)k * info->size, (const char *)from + (size_t)order[k] * info->size,
                   info->size);
    }
}

void particles_swap(Particles *particles, ParticleFieldId field) {
    const Buffer front = particles->front[field];
    particles->front[field] = particles->back[field];
    particles->back[field] = front;
    particles_bind(particles);
}

void particles_permute(Particles *particles, const uint32_t *order, uint32_t count, int threads) {
    assert(count <= particles->capacity);
    const uint32_t blocks = (count + BLOCK - 1) / BLOCK;
#pragma omp parallel for schedule(static) num_threads(threads)
    for (uint32_t block = 0; block < blocks; block++) {
        const uint32_t begin = block * BLOCK, end = begin + BLOCK < count ? begin + BLOCK : count;
        for (int f = 0; f < PARTICLE_FIELD_COUNT; f++)
            permute_field(&particle_fields[f], particles->front[f].data, particles->back[f].data, order,
                          begin, end);
    }
    for (int f = 0; f < PARTICLE_FIELD_COUNT; f++) {
        const size_t size = particle_fields[f].size;
        memset((char *)particles->back[f].data + count * size, 0,
               ((size_t)blocks * BLOCK + SLICE - count) * size);
        particles_swap(particles, (ParticleFieldId)f);
    }
    particles->count = count;
}

void particles_remove(Particles *particles, const uint32_t *gone, uint32_t gone_count, float *scalar) {
    uint32_t last = particles->count, left = gone_count;
    const uint32_t kept = last - gone_count;
    for (uint32_t g = 0; g < gone_count && gone[g] < kept; g++) {
        for (last--; left > 0 && gone[left - 1] == last; last--)
            left--;
        scalar[gone[g]] = scalar[last];
        for (int f = 0; f < PARTICLE_FIELD_COUNT; f++) {
            char *data = particles->front[f].data;
            const size_t size = particle_fields[f].size;
            memcpy(data + gone[g] * size, data + last * size, size);
        }
    }
    for (int f = 0; f < PARTICLE_FIELD_COUNT; f++) {
        const size_t size = particle_fields[f].size;
        memset((char *)particles->front[f].data + kept * size, 0, gone_count * size);
    }
    particles->count = kept;
}

uint32_t particles_extend(Particles *particles, uint32_t count) {
    assert(count <= particles->capacity - particles->count);
    const uint32_t first = particles->count;
    particles->count += count;
    particles->next_id += count;
    return first;
}

void particles_put(Particles *particles, uint32_t i, uint64_t id, const float position[3],
                   const float velocity[3], double birth) {
    for (int k = 0; k < 3; k++) {
        particles->position[i][k] = position[k];
        particles->velocity[i][k] = velocity[k];
    }
    particles->position[i][3] = particles->velocity[i][3] = 0.0f;
    particles->pressure[i] = particles->pressure_divergence[i] = particles->prediction[i] = 0.0f;
    particles->id[i] = id;
    particles->birth[i] = birth;
    particles->row_size[i] = 0;
    particles->edge[i] = EDGE_NONE;
}

uint32_t particles_append(Particles *particles, const float position[3], const float velocity[3],
                          double birth) {
    const uint64_t id = particles->next_id;
    const uint32_t i = particles_extend(particles, 1);
    particles_put(particles, i, id, position, velocity, birth);
    return i;
}
