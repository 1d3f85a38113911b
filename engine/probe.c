/* Instruments: wave gauges, pressure sensors, forces on objects and parts of them. They read the last step;
 * nothing here changes the state.
 *
 * A pressure is the force on the boundary samples of a small patch divided by its area. That is the pressure
 * the fluid really exerts (momentum balance), without the bias that averaging over particles on one side of a
 * wall has. */
#include "sim.h"
#include "dvec.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

static const char *const force_suffix[6] = {".fx", ".fy", ".fz", ".tx", ".ty", ".tz"};

static char *copy_text(const char *text) {
    const size_t length = strlen(text) + 1;
    char *copy = malloc(length);
    return copy ? memcpy(copy, text, length) : NULL;
}

static bool probe_object(const SkiffSim *sim, const SkiffProbeDef *def, const char *path, int32_t *object,
                         Err *err) {
    *object = -1;
    if (def->object == NULL) {
        if (def->kind == SKIFF_PROBE_FORCE)
            return err_add(err, ERR_INPUT, "%s.object: a force probe needs \"tank\" or a body's name", path);
        return true;
    }
    if (strcmp(def->object, "tank") == 0) {
        *object = 0;
        return sim->tank.kind != SKIFF_GEOMETRY_NONE ||
               err_add(err, ERR_INPUT, "%s.object: there is no tank", path);
    }
    for (int b = 0; b < sim->body_count; b++)
        if (strcmp(def->object, sim->bodies[b].name) == 0)
            *object = 1 + b;
    return *object >= 0 || err_add(err, ERR_INPUT, "%s.object: no body is named '%s'", path, def->object);
}

/* World position at the start of the surface point a sample stands for. */
static void sample_place(const SkiffSim *sim, const BoundarySet *set, bool moving, uint32_t s,
                         double position[3]) {
    for (int k = 0; k < 3; k++)
        position[k] = (double)set->samples.surface[s][k] +
                      (moving ? sim->bodies[set->samples.object[s] - 1].position[k] : sim->origin[k]);
}

static double distance_sq(const double a[3], const float b[3]) {
    double sum = 0.0;
    for (int k = 0; k < 3; k++)
        sum += (a[k] - (double)b[k]) * (a[k] - (double)b[k]);
    return sum;
}

/* Normal of the sample nearest to the sensor, which tells the face it sits on. */
static bool pressure_face(const SkiffSim *sim, const Probe *probe, double radius, float normal[3],
                          bool *into) {
    double best = radius * radius;
    bool found = false;
    for (int m = 0; m < 2; m++) {
        const BoundarySet *set = m ? &sim->boundary.moving : &sim->boundary.fixed;
        for (uint32_t s = 0; s < set->samples.count; s++) {
            double position[3];
            sample_place(sim, set, m, s, position);
            const double d = distance_sq(position, probe->def.point);
            if (d >= best || (probe->object >= 0 && set->samples.object[s] != probe->object))
                continue;
            best = d;
            found = true;
            memcpy(normal, set->samples.normal[s], 3 * sizeof(float));
            *into = set->samples.object[s] ==
                    0; /* a tank's mesh faces away from the fluid, a body's towards it */
        }
    }
    return found;
}

static bool probe_choose(const SkiffSim *sim, Probe *probe, const char *path, Err *err) {
    const SkiffProbeDef *def = &probe->def;
    const double radius = def->radius > 0.0f ? def->radius : sim->kernel.support;
    float normal[3] = {0};
    bool into = true;
    if (def->kind == SKIFF_PROBE_PRESSURE && !pressure_face(sim, probe, radius, normal, &into))
        return err_add(err, ERR_INPUT, "%s.point: no wall or body within %g m of (%g, %g, %g)", path, radius,
                       (double)def->point[0], (double)def->point[1], (double)def->point[2]);
    for (int k = 0; k < 3; k++)
        probe->normal[k] = into ? normal[k] : -normal[k];
    for (int m = 0; m < 2; m++) {
        const BoundarySet *set = m ? &sim->boundary.moving : &sim->boundary.fixed;
        probe->chosen[m] = calloc(set->samples.count + 1, 1);
        if (probe->chosen[m] == NULL)
            return err_add(err, ERR_INPUT, "%s: no memory", path);
        for (uint32_t s = 0; s < set->samples.count; s++) {
            double p[3];
            sample_place(sim, set, m, s, p);
            bool use = probe->object < 0 || set->samples.object[s] == probe->object;
            if (def->kind == SKIFF_PROBE_PRESSURE) {
                const float *n = set->samples.normal[s];
                use = use && distance_sq(p, def->point) < radius * radius &&
                      n[0] * normal[0] + n[1] * normal[1] + n[2] * normal[2] > 0.9f;
            } else {
                for (int k = 0; k < 3; k++)
                    use = use && p[k] >= (double)def->min[k] && p[k] <= (double)def->max[k];
            }
            probe->chosen[m][s] = use;
            probe->area += use ? (double)set->samples.area[s] : 0.0;
        }
    }
    return probe->area > 0.0 ||
           err_add(err, ERR_INPUT, "%s: no part of '%s' is in [min, max]", path, def->object);
}

static bool probe_make(SkiffSim *sim, const SkiffProbeDef *def, const char *path, Probe *probe, Err *err) {
    if (def->name == NULL || def->name[0] == '\0' || strlen(def->name) > 80)
        return err_add(err, ERR_INPUT, "%s.name: must have 1 to 80 characters", path);
    if (!isfinite(def->radius) || def->radius < 0.0f)
        return err_add(err, ERR_INPUT, "%s.radius: %g m, must be at least 0", path, (double)def->radius);
    for (int k = 0; k < 3; k++)
        if (!isfinite(def->point[k]))
            return err_add(err, ERR_INPUT, "%s.point: must be finite", path);
    probe->def = *def;
    probe->def.object = NULL;
    probe->def.name = copy_text(def->name);
    probe->channel_count = def->kind == SKIFF_PROBE_FORCE ? 6 : 1;
    probe->channels = calloc((size_t)probe->channel_count, sizeof *probe->channels);
    if (probe->def.name == NULL || probe->channels == NULL)
        return err_add(err, ERR_INPUT, "%s: no memory", path);
    for (int c = 0; c < probe->channel_count; c++)
        snprintf(probe->channels[c], sizeof probe->channels[c], "%s%s", def->name,
                 probe->channel_count == 6 ? force_suffix[c] : "");
    if (!probe_object(sim, def, path, &probe->object, err))
        return false;
    if (def->object != NULL)
        probe->def.object = probe->object == 0 ? "tank" : sim->bodies[probe->object - 1].name;
    const bool patch =
        def->kind == SKIFF_PROBE_PRESSURE || (def->kind == SKIFF_PROBE_FORCE && def->has_region);
    return !patch || probe_choose(sim, probe, path, err);
}

bool probes_make(SkiffSim *sim, const SkiffDef *def, Err *err) {
    sim->probes = calloc((size_t)def->probe_count + 1, sizeof *sim->probes);
    if (sim->probes == NULL)
        return err_add(err, ERR_INPUT, "Probes: no memory");
    sim->probe_count = def->probe_count;
    bool good = true;
    for (int k = 0; k < def->probe_count; k++) {
        char path[64];
        snprintf(path, sizeof path, "Probes[%d]", k);
        for (int other = 0; other < k; other++)
            if (def->probes[k].name && def->probes[other].name &&
                !strcmp(def->probes[k].name, def->probes[other].name))
                good = err_add(err, ERR_INPUT, "%s.name: '%s' is also the name of Probes[%d]", path,
                               def->probes[k].name, other);
        good &= probe_make(sim, &def->probes[k], path, &sim->probes[k], err);
        sim->probe_channels += (uint32_t)sim->probes[k].channel_count;
    }
    return good;
}

void probes_free(SkiffSim *sim) {
    for (int k = 0; k < sim->probe_count; k++) {
        free((char *)sim->probes[k].def.name);
        free(sim->probes[k].channels);
        free(sim->probes[k].chosen[0]);
        free(sim->probes[k].chosen[1]);
    }
    free(sim->probes);
}

/* ---- Water height ---- */

enum { GAUGE_POINTS = 4096 };

typedef struct Gauge {
    double x, z; /* window-local */
    double low, step;
    int count;
    double fluid[GAUGE_POINTS], wall[GAUGE_POINTS]; /* volume fraction of each along the line */
} Gauge;

static void gauge_add(Gauge *gauge, const Kernel *kernel, const float *p, double volume, double *sums) {
    const double dx = (double)p[0] - gauge->x, dz = (double)p[2] - gauge->z, h = (double)kernel->support;
    const double side_sq = dx * dx + dz * dz;
    if (side_sq >= h * h)
        return;
    const double reach = sqrt(h * h - side_sq);
    int k = (int)ceil(((double)p[1] - reach - gauge->low) / gauge->step);
    for (k = k < 0 ? 0 : k; k < gauge->count; k++) {
        const double dy = gauge->low + k * gauge->step - (double)p[1];
        if (dy > reach)
            return;
        sums[k] += volume * (double)kernel_w(kernel, (float)sqrt(side_sq + dy * dy));
    }
}

/* Wet where the fluid fills more than half of what walls leave; the ends of wet stretches are interpolated.
 */
static double gauge_wet_length(const Gauge *gauge) {
    double wet = 0.0;
    for (int k = 0; k + 1 < gauge->count; k++) {
        const double a = gauge->fluid[k] - 0.5 * (1.0 - fmin(gauge->wall[k], 1.0));
        const double b = gauge->fluid[k + 1] - 0.5 * (1.0 - fmin(gauge->wall[k + 1], 1.0));
        if (a > 0.0 && b > 0.0)
            wet += gauge->step;
        else if (a > 0.0 || b > 0.0)
            wet += gauge->step * fmax(a, b) / (fmax(a, b) - fmin(a, b));
    }
    return wet;
}

static double read_height(const SkiffSim *sim, const Probe *probe) {
    Gauge gauge = {.x = (double)probe->def.point[0] - sim->origin[0],
                   .z = (double)probe->def.point[2] - sim->origin[2],
                   .step = 0.2 * (double)sim->params.particle_radius};
    const double h = (double)sim->kernel.support;
    double low = INFINITY, high = -INFINITY;
    const Particles *particles = &sim->particles;
    for (uint32_t i = 0; i < particles->count; i++) {
        const float *p = particles->position[i];
        if (fabs((double)p[0] - gauge.x) < h && fabs((double)p[2] - gauge.z) < h) {
            low = fmin(low, (double)p[1]);
            high = fmax(high, (double)p[1]);
        }
    }
    if (!(low <= high))
        return 0.0;
    /* the line ends at the tank's floor: water shows no further than the wall's surface */
    gauge.low = low - h;
    if (sim->tank.kind != SKIFF_GEOMETRY_NONE)
        gauge.low = fmax(gauge.low, (double)sim->tank.min[1]);
    gauge.count = (int)fmin(ceil((high + h - gauge.low) / gauge.step) + 1, GAUGE_POINTS);
    for (uint32_t i = 0; i < particles->count; i++)
        gauge_add(&gauge, &sim->kernel, particles->position[i], (double)sim->volume, gauge.fluid);
    for (int m = 0; m < 2; m++) {
        const BoundarySet *set = m ? &sim->boundary.moving : &sim->boundary.fixed;
        for (uint32_t s = 0; s < set->samples.count; s++)
            gauge_add(&gauge, &sim->kernel, set->world[s], (double)set->world[s][3], gauge.wall);
    }
    return gauge_wet_length(&gauge);
}

/* ---- Forces on parts ---- */

/* Force of one particle on the chosen samples of a set, per unit of pressure. */
static void part_force(const SkiffSim *sim, const BoundarySet *set, const uint8_t *chosen, const float p[3],
                       double weight, const float centre[3], double force[6]) {
    const int32_t cell = cell_grid_inner(&set->sorted.grid, p);
    if (cell < 0 || !set->sorted.occupied[cell])
        return;
    for (int run = 0; run < CELL_RUNS; run++) {
        const CellRun near = cell_grid_run(&set->sorted.grid, cell, run);
        for (uint32_t s = near.begin; s < near.end; s++) {
            if (!chosen[set->origin[s]])
                continue;
            const double at[3] = {set->sorted.x[s], set->sorted.y[s], set->sorted.z[s]};
            const double d[3] = {(double)p[0] - at[0], (double)p[1] - at[1], (double)p[2] - at[2]};
            const double r = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
            const double factor =
                weight * (double)set->sorted.volume[s] * kernel_gradient_factor(&sim->kernel, r);
            const double f[3] = {factor * d[0], factor * d[1], factor * d[2]};
            const double arm[3] = {at[0] - (double)centre[0], at[1] - (double)centre[1],
                                   at[2] - (double)centre[2]};
            double t[3];
            dvec_cross(t, arm, f);
            for (int k = 0; k < 3; k++) {
                force[k] += f[k];
                force[3 + k] += t[k];
            }
        }
    }
}

static void read_part_force(const SkiffSim *sim, const Probe *probe, double force[6]) {
    const float *pressure = sim->pressure.data;
    const Particles *particles = &sim->particles;
    const float *centre = sim->boundary.centres[probe->object > 0 ? probe->object : 0];
    for (uint32_t i = 0; sim->step > 0 && i < particles->count; i++) {
        if (pressure[i] == 0.0f)
            continue;
        float p[3]; /* where the pressure acted: before the step's motion */
        for (int k = 0; k < 3; k++)
            p[k] = particles->position[i][k] - sim->params.time_step * particles->velocity[i][k];
        for (int m = 0; m < 2; m++) {
            const BoundarySet *set = m ? &sim->boundary.moving : &sim->boundary.fixed;
            if (set->sorted.count != 0)
                part_force(sim, set, probe->chosen[m], p, (double)(sim->volume * pressure[i]), centre, force);
        }
    }
}

/* Torque about the window's origin, where the tank's is measured, to about the world's. */
static void shift_torque(const SkiffSim *sim, double force[6]) {
    double turn[3];
    dvec_cross(turn, sim->origin, force);
    for (int k = 0; k < 3; k++)
        force[3 + k] += turn[k];
}

void skiff_probe_read(const SkiffSim *sim, double *values) {
    for (int k = 0; k < sim->probe_count; k++) {
        const Probe *probe = &sim->probes[k];
        double force[6] = {0};
        switch (probe->def.kind) {
        case SKIFF_PROBE_HEIGHT:
            values[0] = read_height(sim, probe);
            break;
        case SKIFF_PROBE_PRESSURE: {
            read_part_force(sim, probe, force);
            double normal[3] = {probe->normal[0], probe->normal[1], probe->normal[2]};
            if (probe->object > 0)
                matrix_times((const double(*)[3])sim->bodies[probe->object - 1].matrix, probe->normal,
                             normal);
            values[0] = (force[0] * normal[0] + force[1] * normal[1] + force[2] * normal[2]) / probe->area;
            break;
        }
        case SKIFF_PROBE_FORCE:
            if (probe->chosen[0] != NULL)
                read_part_force(sim, probe, force);
            else if (sim->step > 0)
                memcpy(force, (double(*)[6])sim->object_forces.data + probe->object, sizeof force);
            if (probe->object == 0)
                shift_torque(sim, force);
            memcpy(values, force, sizeof force);
            break;
        }
        values += probe->channel_count;
    }
}

int skiff_probe_channel_count(const SkiffSim *sim) {
    return (int)sim->probe_channels;
}

const char *skiff_probe_channel_name(const SkiffSim *sim, int channel) {
    for (int k = 0; k < sim->probe_count; k++) {
        if (channel < sim->probes[k].channel_count)
            return sim->probes[k].channels[channel];
        channel -= sim->probes[k].channel_count;
    }
    return NULL;
}
