/* Taking water out of a region. Pressures and warm starts of what stays are kept, so that it goes on as
 * before. */
#include "sim.h"

#include <stdlib.h>

/* What is shown of the last step moves with its particle; `order` rises, so this works in place. */
static void keep_scalars(Buffer *buffer, const uint32_t *order, uint32_t count) {
    float *scalars = buffer->data;
    for (uint32_t k = 0; scalars && k < count; k++)
        scalars[k] = scalars[order[k]];
}

bool skiff_remove_box(SkiffSim *sim, const double min[3], const double max[3], uint32_t *removed, Err *err) {
    Particles *particles = &sim->particles;
    uint32_t *order = malloc(((size_t)particles->count + 1) * sizeof *order), kept = 0;
    *removed = 0;
    if (!order)
        return err_set(err, ERR_INPUT, "no memory to remove water: %u particles", particles->count);
    for (uint32_t i = 0; i < particles->count; i++) {
        bool inside = true;
        for (int k = 0; k < 3; k++) {
            const double x = (double)particles->position[i][k] + sim->origin[k];
            inside = inside && x >= min[k] && x < max[k];
        }
        if (!inside)
            order[kept++] = i;
    }
    *removed = particles->count - kept;
    if (*removed > 0) {
        keep_scalars(&sim->rows.density, order, kept);
        keep_scalars(&sim->pressure, order, kept);
        particles_permute(particles, order, kept, sim->threads);
    }
    free(order);
    return true;
}
