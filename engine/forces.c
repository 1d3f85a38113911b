/* What rubs: XSPH viscosity among the fluid [Schechter & Bridson 2012], and
 * friction on walls and bodies, which is XSPH towards their samples: v_i loses the share  friction * sum_b
 * psi_b W_ib  of its velocity relative to the object, and the object gets the momentum. The sum is part of
 * every contact, so friction visits no sample. */
#include "sim.h"
#include "dvec.h"

/* Velocity of an object where a particle is. */
static void object_velocity(const SkiffSim *sim, uint32_t object, const float *position, double v[3]) {
    v[0] = v[1] = v[2] = 0.0;
    if (object == 0)
        return;
    const Body *body = &sim->bodies[object - 1];
    double arm[3];
    for (int k = 0; k < 3; k++)
        arm[k] = (double)position[k] - (double)sim->boundary.centres[object][k];
    dvec_cross(v, body->angular_velocity, arm);
    for (int k = 0; k < 3; k++)
        v[k] += body->velocity[k];
}

/* Slows a block's particles; lost[object] is the velocity they lost and its moment about the object's centre.
 */
static void friction_block(SkiffSim *sim, uint32_t block, double (*lost)[6]) {
    const Boundary *boundary = &sim->boundary;
    const ContactSpan span = boundary->spans[block];
    memset(lost, 0, boundary->object_count * sizeof *lost);
    for (uint32_t c = span.start; c < span.start + span.count; c++) {
        const Contact *contact = &boundary->contacts[c];
        const float *position = sim->particles.position[contact->particle];
        float *velocity = sim->particles.velocity[contact->particle];
        double share = (double)(sim->params.wall_friction * contact->weight), v[3], change[3], arm[3],
               moment[3];
        share = share < 1.0 ? share : 1.0; /* to rest relative to the wall, not beyond */
        object_velocity(sim, contact->object, position, v);
        for (int k = 0; k < 3; k++) {
            change[k] = share * ((double)velocity[k] - v[k]);
            velocity[k] -= (float)change[k];
            arm[k] = (double)position[k] - (double)boundary->centres[contact->object][k];
        }
        dvec_cross(moment, arm, change);
        for (int k = 0; k < 3; k++) {
            lost[contact->object][k] += change[k];
            lost[contact->object][3 + k] += moment[k];
        }
    }
}

static void apply_friction(SkiffSim *sim) {
    const uint32_t blocks = particles_blocks(&sim->particles), objects = sim->boundary.object_count;
    double(*lost)[6] = sim->boundary.partial_buffer.data;
#pragma omp parallel for schedule(static) num_threads(sim->threads)
    for (uint32_t block = 0; block < blocks; block++)
        friction_block(sim, block, lost + (size_t)block * objects);
    const double mass = (double)sim->volume * (double)sim->params.rest_density;
    for (int b = 0; b < sim->body_count; b++) {
        double total[6] = {0}, turn[3];
        for (uint32_t block = 0; block < blocks; block++)
            for (int k = 0; k < 6; k++)
                total[k] += lost[(size_t)block * objects + 1 + (uint32_t)b][k];
        Body *body = &sim->bodies[b];
        matrix_times((const double(*)[3])body->inv_inertia, total + 3, turn);
        for (int k = 0; k < 3; k++) {
            body->velocity[k] += mass * body->inv_mass[k] * total[k];
            body->angular_velocity[k] += mass * turn[k];
        }
    }
}

void forces_apply_fluid(const DfsphProblem *problem, Dfsph *dfsph) {
    const SkiffParams *params = problem->params;
    const float dt = params->time_step;
    Particles *particles = problem->particles;
    const StrainJob strain = {.pairs = &problem->rows->pairs,
                              .velocity = (const Float4 *)particles->velocity,
                              .strain = {dfsph->answer, dfsph->spare}};
    const ForceJob job = {.pairs = &problem->rows->pairs,
                          .velocity = (const Float4 *)particles->velocity,
                          .result = particles->back[PARTICLE_velocity].data,
                          .viscosity = params->viscosity,
                          .calming = params->calming,
                          .calming_limit = dt * params->calming_limit,
                          .strain = {(const Float4 *)dfsph->answer, (const Float4 *)dfsph->spare}};
    const Float4 *push = (const Float4 *)problem->rows->beside.push; /* standing water rubs, too */
    const uint32_t blocks = particles_blocks(particles);
#pragma omp parallel num_threads(problem->threads)
    {
        if (params->calming > 0.0f) {
#pragma omp for schedule(dynamic, DFSPH_CHUNK)
            for (uint32_t block = 0; block < blocks; block++)
                problem->passes->strain(&strain, block);
        }
#pragma omp for schedule(dynamic, DFSPH_CHUNK)
        for (uint32_t block = 0; block < blocks; block++)
            problem->passes->forces(&job, block);
#pragma omp for schedule(static)
        for (uint32_t i = 0; i < (push != NULL ? particles->count : 0); i++)
            for (int k = 0; k < 3; k++)
                job.result[i][k] -= params->viscosity * push[i][3] * particles->velocity[i][k];
#pragma omp for schedule(static)
        for (uint32_t i = 0; i < (problem->held != NULL ? particles->count : 0); i++)
            if (problem->held[i])
                memcpy(job.result[i], particles->velocity[i], sizeof(Float4));
    }
    particles_swap(particles, PARTICLE_velocity);
}

void forces_apply(SkiffSim *sim, const DfsphProblem *problem) {
    forces_apply_fluid(problem, &sim->dfsph);
    if (sim->params.wall_friction > 0.0f)
        apply_friction(sim);
}
