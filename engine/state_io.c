/* Saving and loading a simulation's state. What is saved is what the next step depends on; everything else a
 * step makes anew. */
#include "sim.h"

#include <stdio.h>
#include <stdlib.h>

enum { STATE_VERSION = 5, BODY_SCALARS = 3 + 4 + 3 + 3 };

static void body_to_scalars(const Body *body, double *out) {
    memcpy(out, body->position, 3 * sizeof(double));
    memcpy(out + 3, body->rotation, 4 * sizeof(double));
    memcpy(out + 7, body->velocity, 3 * sizeof(double));
    memcpy(out + 10, body->angular_velocity, 3 * sizeof(double));
}

static void body_from_scalars(Body *body, const double *in) {
    memcpy(body->position, in, 3 * sizeof(double));
    memcpy(body->rotation, in + 3, 4 * sizeof(double));
    memcpy(body->velocity, in + 7, 3 * sizeof(double));
    memcpy(body->angular_velocity, in + 10, 3 * sizeof(double));
}

static void add_field(StateField *fields, uint32_t *count, const char *name, StateType type,
                      uint32_t components, uint64_t elements, const void *data) {
    StateField *field = &fields[(*count)++];
    *field = (StateField){.type = type, .components = components, .count = elements, .data = data};
    snprintf(field->name, sizeof field->name, "%s", name);
}

bool skiff_save(const SkiffSim *sim, const char *path, Err *err) {
    double *bodies = malloc(((size_t)sim->body_count * BODY_SCALARS + 1) * sizeof *bodies);
    double *drives = malloc(((size_t)sim->drive_count * DRIVE_SCALARS + 1) * sizeof *drives);
    int32_t *emitted = malloc(((size_t)sim->block_count + 1) * sizeof *emitted);
    if (bodies == NULL || drives == NULL || emitted == NULL) {
        free(bodies);
        free(drives);
        free(emitted);
        return err_set(err, ERR_IO, "%s: no memory to save the state", path);
    }
    for (int b = 0; b < sim->body_count; b++)
        body_to_scalars(&sim->bodies[b], bodies + b * BODY_SCALARS);
    for (int d = 0; d < sim->drive_count; d++)
        drive_to_scalars(&sim->drives[d], drives + d * DRIVE_SCALARS);
    for (int b = 0; b < sim->block_count; b++)
        emitted[b] = sim->blocks[b].done;
    const uint64_t header[4] = {sim->def_hash, sim->step, sim->particles.next_id, sim->sea.moves};
    const double place[4] = {sim->time, sim->origin[0], sim->origin[1], sim->origin[2]};
    StateField fields[PARTICLE_FIELD_COUNT + 5 + GHOST_FIELDS];
    uint32_t count = 0;
    add_field(fields, &count, "header", STATE_U64, 1, 4, header);
    add_field(fields, &count, "time_and_origin", STATE_F64, 1, 4, place);
    for (int f = 0; f < PARTICLE_FIELD_COUNT; f++)
        add_field(fields, &count, particle_fields[f].name, particle_fields[f].type,
                  particle_fields[f].components, sim->particles.count, sim->particles.front[f].data);
    add_field(fields, &count, "bodies", STATE_F64, BODY_SCALARS, (uint64_t)sim->body_count, bodies);
    add_field(fields, &count, "drives", STATE_F64, DRIVE_SCALARS, (uint64_t)sim->drive_count, drives);
    add_field(fields, &count, "blocks_emitted", STATE_I32, 1, (uint64_t)sim->block_count, emitted);
    ghosts_describe(&sim->ghosts, fields + count);
    count += GHOST_FIELDS;
    const bool good = state_file_write(path, STATE_VERSION, fields, count, err);
    free(bodies);
    free(drives);
    free(emitted);
    return good;
}

/* Everything checked before anything is changed. */
static bool load_fields(SkiffSim *sim, const StateFile *file, const char *path, Err *err) {
    const StateField *header = state_file_field(file, "header", STATE_U64, 1, 4, err);
    const StateField *place = state_file_field(file, "time_and_origin", STATE_F64, 1, 4, err);
    const StateField *bodies =
        state_file_field(file, "bodies", STATE_F64, BODY_SCALARS, (uint64_t)sim->body_count, err);
    const StateField *drives =
        state_file_field(file, "drives", STATE_F64, DRIVE_SCALARS, (uint64_t)sim->drive_count, err);
    const StateField *emitted =
        state_file_field(file, "blocks_emitted", STATE_I32, 1, (uint64_t)sim->block_count, err);
    const StateField *position = state_file_field(file, "position", STATE_F32, 4, UINT64_MAX, err);
    if (!header || !place || !bodies || !drives || !emitted || !position)
        return false;
    const uint64_t *numbers = header->data;
    if (numbers[0] != sim->def_hash)
        return err_set(err, ERR_INPUT,
                       "%s: the state was saved by another scene, or by this one with other settings", path);
    if (position->count > UINT32_MAX / 2)
        return err_set(err, ERR_INPUT, "%s: holds %llu particles", path, (unsigned long long)position->count);
    const StateField *fields[PARTICLE_FIELD_COUNT];
    for (int f = 0; f < PARTICLE_FIELD_COUNT; f++) {
        fields[f] = state_file_field(file, particle_fields[f].name, particle_fields[f].type,
                                     particle_fields[f].components, position->count, err);
        if (fields[f] == NULL)
            return false;
    }
    for (int d = 0; d < sim->drive_count; d++) {
        Err reason = {0};
        if (!drive_check_scalars((const double *)drives->data + d * DRIVE_SCALARS, &reason))
            return err_set(err, ERR_INPUT, "%s: drives[%d]: %s", path, d, reason.message);
    }
    if (!sim_reserve(sim, (uint32_t)position->count, err) || !ghosts_load(&sim->ghosts, file, path, err))
        return false;
    Particles *particles = &sim->particles;
    particles->count = (uint32_t)position->count;
    for (int f = 0; f < PARTICLE_FIELD_COUNT; f++) {
        const size_t used = particles->count * (size_t)particle_fields[f].size;
        memcpy(particles->front[f].data, fields[f]->data, used);
        memset((char *)particles->front[f].data + used, 0,
               (particles->capacity + (size_t)SLICE) * particle_fields[f].size - used);
    }
    sim->step = numbers[1];
    particles->next_id = numbers[2];
    sim->sea.moves = numbers[3];
    const double *numbers_place = place->data;
    sim->time = numbers_place[0];
    memcpy(sim->origin, numbers_place + 1, sizeof sim->origin);
    for (int b = 0; b < sim->body_count; b++)
        body_from_scalars(&sim->bodies[b], (const double *)bodies->data + b * BODY_SCALARS);
    for (int d = 0; d < sim->drive_count; d++)
        drive_from_scalars(&sim->drives[d], (const double *)drives->data + d * DRIVE_SCALARS);
    for (int b = 0; b < sim->block_count; b++)
        sim->blocks[b].done = ((const int32_t *)emitted->data)[b];
    return true;
}

bool skiff_load(SkiffSim *sim, const char *path, Err *err) {
    if (sim->sea.dry)
        return err_set(err, ERR_USAGE, "%s: a state cannot be loaded into a sea that was made dry", path);
    StateFile *file = state_file_open(path, STATE_VERSION, err);
    if (file == NULL)
        return false;
    const bool good = load_fields(sim, file, path, err);
    state_file_close(file);
    if (!good)
        return false;
    for (int b = 0; b < sim->body_count; b++)
        body_prepare(&sim->bodies[b], sim->time);
    sim->stats = (SkiffStats){.step = sim->step,
                              .time = sim->time,
                              .particles = sim->particles.count,
                              .boundary_samples = sim->stats.boundary_samples};
    return boundary_place(&sim->boundary, sim->bodies, sim->body_count, sim->origin, sim->kernel.support,
                          sim->threads, err) &&
           (!sim->sea.water_edge || absorb_make(sim, err));
}
