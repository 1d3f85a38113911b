/* Blocks of fluid: points of a cubic lattice, at the start or emitted later.
 *
 * Points inside a body are left out, so that a body may start immersed; points outside the tank are an error,
 * and so is water on water: both would explode in the first step. */
#include "sim.h"
#include "base/log.h"

#include <math.h>
#include <stdio.h>

double block_particles(const SkiffBlockDef *def, float spacing, double counts[3]) {
    double total = 1.0;
    for (int k = 0; k < 3; k++) {
        counts[k] = round(((double)def->end[k] - (double)def->start[k]) / (double)spacing);
        counts[k] = counts[k] < 1.0 ? 1.0 : counts[k];
        total *= counts[k];
    }
    return total;
}

/* Signed distance to the tank's walls, negative inside; an open tank goes on above its rim. */
static float tank_distance(const SkiffSim *sim, const float p[3]) {
    if (sim->tank.kind == SKIFF_GEOMETRY_NONE)
        return -INFINITY;
    const float rim = sim->tank.max[1] - sim->params.particle_radius;
    const float q[3] = {p[0], sim->tank_open && p[1] > rim ? rim : p[1], p[2]};
    return shape_distance(&sim->tank, q, NULL);
}

static bool inside_body(const SkiffSim *sim, const float p[3], int *inside) {
    for (int b = 0; b < sim->body_count; b++) {
        const Body *body = &sim->bodies[b];
        double arm[3], local[3];
        for (int k = 0; k < 3; k++)
            arm[k] = (double)p[k] + sim->origin[k] - body->position[k];
        for (int k = 0; k < 3; k++) /* R^T arm */
            local[k] =
                body->matrix[0][k] * arm[0] + body->matrix[1][k] * arm[1] + body->matrix[2][k] * arm[2];
        const float q[3] = {(float)local[0], (float)local[1], (float)local[2]};
        const float r = sim->params.particle_radius;
        bool near = true;
        for (int k = 0; k < 3; k++)
            near = near && q[k] > body->mesh.min[k] - r && q[k] < body->mesh.max[k] + r;
        if (near && mesh_distance(&body->mesh, q, NULL) < r) {
            *inside = b;
            return true;
        }
    }
    return false;
}

/* Index of an existing particle closer than 0.7 d to the lattice of the new block, or UINT32_MAX. */
static uint32_t occupied(const SkiffSim *sim, const float first[3], const double counts[3], float spacing) {
    for (uint32_t i = 0; i < sim->particles.count; i++) {
        float gap_sq = 0.0f;
        for (int k = 0; k < 3; k++) {
            const float at = (sim->particles.position[i][k] - first[k]) / spacing;
            const float nearest = fminf(fmaxf(roundf(at), 0.0f), (float)counts[k] - 1.0f);
            gap_sq += (at - nearest) * (at - nearest);
        }
        if (gap_sq < 0.49f)
            return i;
    }
    return UINT32_MAX;
}

/* ---- Water at rest ---- */

typedef struct RestBlock {
    CellBounds bounds; /* window-local */
} RestBlock;

static RestPlace block_place(const void *user, const float p[3]) {
    const RestBlock *block = user;
    for (int k = 0; k < 3; k++)
        if (!(p[k] >= block->bounds.min[k] && p[k] < block->bounds.max[k]))
            return REST_IN_AIR;
    return REST_IN_WATER;
}

static bool emit_rest(SkiffSim *sim, const SkiffBlockDef *def, const char *path, uint32_t *emitted,
                      Err *err) {
    RestBlock block;
    RestRequest request = {.place = block_place, .user = &block, .birth = sim->time};
    for (int k = 0; k < 3; k++) {
        block.bounds.min[k] = (float)((double)def->start[k] - sim->origin[k]);
        block.bounds.max[k] = (float)((double)def->end[k] - sim->origin[k]);
        request.offset[k] = (double)def->offset[k];
    }
    if (sim->tank_open) /* higher it would run over */
        block.bounds.max[1] = fminf(block.bounds.max[1], sim->tank.max[1] - sim->params.particle_radius);
    request.bounds = block.bounds;
    request.surface = block.bounds.max[1];
    const uint64_t first_id = sim->particles.next_id;
    SkiffFill fill;
    if (!rest_fill(sim, &request, &fill, err)) {
        err_prefix(err, "%s", path);
        return false;
    }
    if (fill.particles == 0)
        return err_add(err, ERR_INPUT, "%s: there is no room for water in it", path);
    sim->fill = fill;
    for (uint32_t i = 0; i < sim->particles.count; i++) /* a fill sorts: the new ones are anywhere */
        if (sim->particles.id[i] >= first_id)
            memcpy(sim->particles.velocity[i], def->velocity, sizeof def->velocity);
    *emitted += fill.particles;
    return true;
}

bool skiff_fill_block(SkiffSim *sim, const SkiffBlockDef *block, Err *err) {
    uint32_t emitted = 0;
    return emit_rest(sim, block, "the block", &emitted, err);
}

/* ---- Lattices ---- */

static bool emit_lattice(SkiffSim *sim, int index, uint32_t *emitted, Err *err) {
    const SkiffBlockDef *def = &sim->blocks[index].def;
    const float spacing = 2.0f * sim->params.particle_radius;
    double counts[3];
    const double total = block_particles(def, spacing, counts);
    float first[3];
    for (int k = 0; k < 3; k++)
        first[k] = (float)(0.5 * ((double)def->start[k] + (double)def->end[k]) -
                           0.5 * (counts[k] - 1.0) * (double)spacing - sim->origin[k]);
    const uint32_t neighbour = occupied(sim, first, counts, spacing);
    if (neighbour != UINT32_MAX)
        return err_add(err, ERR_INPUT,
                       "FluidBlocks[%d]: its place is not free at t = %g s: particle %llu is there", index,
                       sim->time, (unsigned long long)sim->particles.id[neighbour]);
    uint32_t outside = 0, carved = 0;
    int body = 0;
    float example[3] = {0};
    const uint32_t before = sim->particles.count;
    for (int y = 0; y < (int)counts[1]; y++)
        for (int z = 0; z < (int)counts[2]; z++)
            for (int x = 0; x < (int)counts[0]; x++) {
                const float p[3] = {first[0] + (float)x * spacing, first[1] + (float)y * spacing,
                                    first[2] + (float)z * spacing};
                if (inside_body(sim, p, &body)) {
                    carved++;
                } else if (tank_distance(sim, p) >= 0.0f) {
                    if (outside++ == 0)
                        memcpy(example, p, sizeof example);
                } else {
                    particles_append(&sim->particles, p, def->velocity, sim->time);
                }
            }
    if (outside > 0) {
        sim->particles.count = before;
        return err_add(
            err, ERR_INPUT,
            "FluidBlocks[%d]: %u of its %.0f particles are outside the tank, the first at (%g, %g, %g) m",
            index, outside, total, (double)example[0] + sim->origin[0], (double)example[1] + sim->origin[1],
            (double)example[2] + sim->origin[2]);
    }
    if (carved > 0)
        log_write(LOG_INFO,
                  "FluidBlocks[%d]: %u of %.0f particles left out where bodies are (the last in '%s')", index,
                  carved, total, sim->bodies[body].name);
    *emitted += sim->particles.count - before;
    return true;
}

bool block_emit(SkiffSim *sim, uint32_t *emitted, Err *err) {
    *emitted = 0;
    bool good = true;
    for (int k = 0; k < sim->block_count; k++) {
        EmitBlock *block = &sim->blocks[k];
        while (good && block->done < block->def.repeat &&
               block->def.time + block->done * block->def.period <= sim->time + 1e-9) {
            char path[32];
            snprintf(path, sizeof path, "FluidBlocks[%d]", k);
            good = block->def.fill == SKIFF_FILL_REST ? emit_rest(sim, &block->def, path, emitted, err)
                                                      : emit_lattice(sim, k, emitted, err);
            block->done++;
        }
    }
    return good;
}
