/* What the outside may look at. */
#include "sim.h"

#define XXH_INLINE_ALL
#include <xxhash.h>

double skiff_time(const SkiffSim *sim) {
    return sim->time;
}

uint64_t skiff_step_count(const SkiffSim *sim) {
    return sim->step;
}

const SkiffParams *skiff_params(const SkiffSim *sim) {
    return &sim->params;
}

SkiffSimd skiff_simd(const SkiffSim *sim) {
    return sim->simd;
}

int skiff_threads(const SkiffSim *sim) {
    return sim->threads;
}

const SkiffFill *skiff_fill(const SkiffSim *sim) {
    return &sim->fill;
}

const SkiffStats *skiff_stats(const SkiffSim *sim) {
    return &sim->stats;
}

SkiffParticles skiff_particles(const SkiffSim *sim) {
    const Particles *particles = &sim->particles;
    SkiffParticles view = {.count = particles->count,
                           .position = (const float(*)[4])particles->position,
                           .velocity = (const float(*)[4])particles->velocity,
                           .density = sim->rows.density.data,
                           .unknown = sim->pressure.data,
                           .id = particles->id,
                           .birth = particles->birth};
    memcpy(view.origin, sim->origin, sizeof view.origin);
    return view;
}

void skiff_boundary_samples(const SkiffSim *sim, bool moving, SkiffBoundary *view) {
    const BoundarySet *set = moving ? &sim->boundary.moving : &sim->boundary.fixed;
    *view = (SkiffBoundary){.count = set->samples.count,
                            .position = (const float(*)[4])set->world,
                            .object = set->samples.object};
}

int skiff_body_count(const SkiffSim *sim) {
    return sim->body_count;
}

SkiffBody skiff_body(const SkiffSim *sim, int index) {
    const Body *body = &sim->bodies[index];
    SkiffBody view = {.name = body->name, .mass = body->mass};
    memcpy(view.inertia, body->inertia, sizeof view.inertia);
    memcpy(view.position, body->position, sizeof view.position);
    memcpy(view.rotation, body->rotation, sizeof view.rotation);
    memcpy(view.velocity, body->velocity, sizeof view.velocity);
    memcpy(view.angular_velocity, body->angular_velocity, sizeof view.angular_velocity);
    const double *force = ((double(*)[6])sim->object_forces.data)[1 + index];
    memcpy(view.force, force, sizeof view.force);
    memcpy(view.torque, force + 3, sizeof view.torque);
    const BoundarySamples *samples =
        body->fixed ? &sim->boundary.fixed.samples : &sim->boundary.moving.samples;
    for (uint32_t s = 0; s < samples->count; s++)
        view.sample_count += samples->object[s] == 1 + index;
    return view;
}

void skiff_body_push(SkiffSim *sim, int index, const double force[3], const double torque[3]) {
    for (int k = 0; k < 3; k++) {
        sim->bodies[index].push[k] += force[k];
        sim->bodies[index].push_torque[k] += torque[k];
    }
}

static void look_at_mesh(const Mesh *mesh, const float (**vertices)[3], uint32_t *vertex_count,
                         const uint32_t (**triangles)[3], uint32_t *triangle_count) {
    *vertices = (const float(*)[3])mesh->vertices;
    *vertex_count = mesh->vertex_count;
    *triangles = (const uint32_t(*)[3])mesh->triangles;
    *triangle_count = mesh->triangle_count;
}

void skiff_body_mesh(const SkiffSim *sim, int index, const float (**vertices)[3], uint32_t *vertex_count,
                     const uint32_t (**triangles)[3], uint32_t *triangle_count) {
    look_at_mesh(&sim->bodies[index].mesh, vertices, vertex_count, triangles, triangle_count);
}

void skiff_tank_mesh(const SkiffSim *sim, const float (**vertices)[3], uint32_t *vertex_count,
                     const uint32_t (**triangles)[3], uint32_t *triangle_count) {
    look_at_mesh(&sim->tank.mesh, vertices, vertex_count, triangles, triangle_count);
}

const uint8_t *skiff_body_materials(const SkiffSim *sim, int index) {
    return sim->bodies[index].mesh.materials;
}

const char *skiff_body_material_name(const SkiffSim *sim, int index, int material) {
    const Mesh *mesh = &sim->bodies[index].mesh;
    return (uint32_t)material < mesh->material_count ? mesh->material_names[material] : "";
}

uint64_t skiff_hash(const SkiffSim *sim) {
    XXH3_state_t state;
    XXH3_64bits_reset(&state);
    XXH3_64bits_update(&state, &sim->step, sizeof sim->step);
    XXH3_64bits_update(&state, &sim->time, sizeof sim->time);
    for (int f = 0; f < PARTICLE_FIELD_COUNT; f++)
        XXH3_64bits_update(&state, sim->particles.front[f].data,
                           (size_t)sim->particles.count * particle_fields[f].size);
    for (int b = 0; b < sim->body_count; b++) {
        const Body *body = &sim->bodies[b];
        XXH3_64bits_update(&state, body->position, sizeof body->position);
        XXH3_64bits_update(&state, body->rotation, sizeof body->rotation);
        XXH3_64bits_update(&state, body->velocity, sizeof body->velocity);
        XXH3_64bits_update(&state, body->angular_velocity, sizeof body->angular_velocity);
    }
    for (int d = 0; d < sim->drive_count; d++) {
        double scalars[DRIVE_SCALARS];
        drive_to_scalars(&sim->drives[d], scalars);
        XXH3_64bits_update(&state, scalars, sizeof scalars);
    }
    return XXH3_64bits_digest(&state);
}

uint64_t skiff_memory(const SkiffSim *sim) {
    uint64_t total = 0;
    for (int f = 0; f < PARTICLE_FIELD_COUNT; f++)
        total += sim->particles.front[f].size + sim->particles.back[f].size;
    const Grid *grid = &sim->grid;
    total += grid->start_buffer.size + grid->cell_buffer.size + grid->member_buffer.size +
             grid->point_buffer.size + grid->order_buffer.size + grid->visit_buffer.size +
             grid->unsorted_buffer.size + grid->histogram_buffer.size;
    const Rows *rows = &sim->rows;
    total += rows->pool.size + rows->weights.size + rows->slices.size + rows->density.size +
             rows->gradient_sum.size + rows->neighbour_counts.size + rows->scratch.size;
    for (int m = 0; m < 2; m++) {
        const BoundarySet *set = m ? &sim->boundary.moving : &sim->boundary.fixed;
        total += set->buffer.size + set->cells.size + set->occupied.size + set->samples.capacity * 36u;
    }
    total += sim->boundary.contact_buffer.size + sim->boundary.span_buffer.size +
             sim->boundary.centre_buffer.size + sim->boundary.partial_buffer.size;
    return total + sim->dfsph.buffer.size + sim->pressure.size + sim->object_forces.size + sim->sums.size;
}
