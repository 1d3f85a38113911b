/* Making a simulation from its def: every check, every allocation. What a step does is in step.c. */

#include "sim.h"
#include "base/log.h"

#include <math.h>
#include <omp.h>
#include <stdio.h>
#include <stdlib.h>

#define XXH_INLINE_ALL
#include <xxhash.h>

/* Bytes a particle needs in all arrays together; rows are most of it. bench-tank measures 750. */
enum { BYTES_PER_PARTICLE = 800 };

/* ---- Machine ---- */

int sim_threads(int wanted) {
    if (wanted > 0)
        return wanted;
    /* hyper-threads share the units that the passes keep busy: one thread a core */
    int cores = 0;
    const int cpus = omp_get_num_procs();
    for (int cpu = 0; cpu < 4096 && cores < cpus; cpu++) {
        char path[128];
        snprintf(path, sizeof path, "/sys/devices/system/cpu/cpu%d/topology/thread_siblings_list", cpu);
        FILE *file = fopen(path, "r");
        int first = -1;
        if (file == NULL)
            break;
        if (fscanf(file, "%d", &first) == 1 && first == cpu)
            cores++;
        fclose(file);
    }
    cores = cores > 0 && cores < cpus ? cores : cpus;
    return cores < SKIFF_MAX_THREADS ? cores : SKIFF_MAX_THREADS;
}

static bool simd_available(SkiffSimd simd) {
#ifdef SKIFF_HAVE_X86
    if (simd == SKIFF_SIMD_AVX2)
        return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
    if (simd == SKIFF_SIMD_AVX512)
        return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") &&
               __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512dq");
#endif
    return simd == SKIFF_SIMD_PLAIN;
}

static bool choose_passes(SkiffSim *sim, const SkiffDef *def, Err *err) {
    sim->simd = def->simd;
    if (def->simd == SKIFF_SIMD_AUTO)
        sim->simd = simd_available(SKIFF_SIMD_AVX512) ? SKIFF_SIMD_AVX512
                    : simd_available(SKIFF_SIMD_AVX2) ? SKIFF_SIMD_AVX2
                                                      : SKIFF_SIMD_PLAIN;
    if (!simd_available(sim->simd))
        return err_add(err, ERR_USAGE, "simd: this processor has no %s", skiff_simd_name(sim->simd));
    sim->passes = &passes_plain;
#ifdef SKIFF_HAVE_X86
    if (sim->simd == SKIFF_SIMD_AVX2)
        sim->passes = &passes_avx2;
    if (sim->simd == SKIFF_SIMD_AVX512)
        sim->passes = &passes_avx512;
#endif
    if (def->threads < 0 || def->threads > SKIFF_MAX_THREADS)
        return err_add(err, ERR_USAGE, "threads: %d is out of range, allowed is 0 to %d", def->threads,
                       SKIFF_MAX_THREADS);
    sim->threads = sim_threads(def->threads);
    return true;
}

/* ---- Checks that need no simulation ---- */

static bool check_blocks(const SkiffDef *def, double *particles, Err *err) {
    bool good = true;
    *particles = 0.0;
    for (int b = 0; b < def->block_count; b++) {
        const SkiffBlockDef *block = &def->blocks[b];
        bool finite = true;
        for (int k = 0; k < 3; k++) {
            finite = finite && isfinite(block->start[k]) && isfinite(block->end[k]) &&
                     isfinite(block->velocity[k]);
            if (!(block->end[k] > block->start[k]))
                good =
                    err_add(err, ERR_INPUT, "FluidBlocks[%d]: end[%d] = %g m must be above start[%d] = %g m",
                            b, k, (double)block->end[k], k, (double)block->start[k]);
        }
        if (!finite || isnan(block->time))
            good =
                err_add(err, ERR_INPUT, "FluidBlocks[%d]: start, end, velocity and time must be finite", b);
        if (block->repeat < 1)
            good =
                err_add(err, ERR_INPUT, "FluidBlocks[%d].repeat: %d, must be at least 1", b, block->repeat);
        if (block->repeat > 1 && !(block->period > 0.0 && isfinite(block->period)))
            good = err_add(err, ERR_INPUT, "FluidBlocks[%d].period: %g s, must be above 0", b, block->period);
        double counts[3];
        /* water at rest is as dense as its particles' volume says, a lattice is thinner */
        const double density =
            block->fill == SKIFF_FILL_REST ? 1.01 / (double)def->params.volume_factor : 1.0;
        if (good)
            *particles +=
                density * block->repeat * block_particles(block, 2.0f * def->params.particle_radius, counts);
    }
    return good;
}

static bool check_memory(double particles, Err *err) {
    const double need = particles * BYTES_PER_PARTICLE, have = (double)memory_available();
    if (particles > 2e9 || need > have)
        return err_add(err, ERR_INPUT,
                       "FluidBlocks: %.4g particles need about %.3g GB, this machine has %.3g GB free (and "
                       "2e9 is the limit)",
                       particles, need * 1e-9, have * 1e-9);
    return true;
}

/* ---- Parts ---- */

/* Whole metres near the middle of things: float coordinates stay small, and a scene around the origin keeps
 * its numbers. */
static void choose_origin(SkiffSim *sim, const SkiffDef *def) {
    double min[3] = {INFINITY, INFINITY, INFINITY}, max[3] = {-INFINITY, -INFINITY, -INFINITY};
    for (int b = 0; b < def->block_count; b++)
        for (int k = 0; k < 3; k++) {
            min[k] = fmin(min[k], (double)def->blocks[b].start[k]);
            max[k] = fmax(max[k], (double)def->blocks[b].end[k]);
        }
    for (int k = 0; k < 3; k++) {
        double middle = min[k] <= max[k] ? 0.5 * (min[k] + max[k]) : 0.0;
        if (def->tank.geometry.kind != SKIFF_GEOMETRY_NONE)
            middle = (double)def->tank.geometry.translation[k];
        sim->origin[k] = fabs(middle) < 16.0 ? 0.0 : round(middle);
    }
}

static bool make_tank(SkiffSim *sim, const SkiffDef *def, Err *err) {
    const SkiffTankDef *tank = &def->tank;
    if (tank->geometry.kind == SKIFF_GEOMETRY_NONE)
        return true;
    if (isnan(tank->wet_height))
        return err_add(err, ERR_INPUT, "Tank.wetHeight: must be a number");
    if (!shape_make(&tank->geometry, "Tank", sim->origin, &sim->tank, err))
        return false;
    const Mesh *mesh = &sim->tank.mesh;
    sim->tank_open = tank->open;
    if (sea_has_water_edge(def))
        return true;
    /* the lid of an open tank lies on the bounds: cutting just below leaves it out */
    SampleRegion region = {{-INFINITY, -INFINITY, -INFINITY}, {INFINITY, INFINITY, INFINITY}};
    const float spacing = def->params.boundary_spacing * def->params.particle_radius;
    if (tank->open)
        region.max[1] = mesh->max[1] - 0.01f * spacing;
    region.max[1] = fminf(region.max[1], (float)((double)tank->wet_height - sim->origin[1]));
    if (region.max[1] <= mesh->min[1])
        return err_add(err, ERR_INPUT, "Tank.wetHeight: %g m is below the tank's floor at %g m",
                       (double)tank->wet_height, (double)mesh->min[1] + sim->origin[1]);
    const SurfaceDef surface = {.mesh = mesh,
                                .spacing = spacing,
                                .offset = def->params.boundary_offset * def->params.particle_radius,
                                .water_inside = true,
                                .region = &region,
                                .path = "Tank"};
    return boundary_add(&sim->boundary.fixed, &surface, err);
}

static bool make_body(SkiffSim *sim, const SkiffDef *def, int index, Err *err) {
    char path[64];
    snprintf(path, sizeof path, "RigidBodies[%d]", index);
    Body *body = &sim->bodies[index];
    if (!body_make(&def->bodies[index], path, body, err))
        return false;
    body->fixed = body->fixed && !def->sea.on; /* a window's frame moves: nothing else stands still in it */
    for (int other = 0; other < index; other++)
        if (sim->bodies[other].name && strcmp(body->name, sim->bodies[other].name) == 0)
            return err_add(err, ERR_INPUT, "%s.name: '%s' is also the name of RigidBodies[%d]", path,
                           body->name, other);
    BoundarySet own = {0};
    const SurfaceDef surface = {.mesh = &body->mesh,
                                .object = 1 + index,
                                .spacing = def->params.boundary_spacing * def->params.particle_radius,
                                .offset = def->params.boundary_offset * def->params.particle_radius,
                                .path = path};
    bool good = boundary_add(&own, &surface, err);
    if (good && body->fixed) /* fixed samples live in the window's frame */
        for (uint32_t s = 0; s < own.samples.count; s++)
            for (int k = 0; k < 3; k++) {
                own.samples.position[s][k] += (float)(body->position[k] - sim->origin[k]);
                own.samples.surface[s][k] += (float)(body->position[k] - sim->origin[k]);
            }
    good = good && (body->fixed || boundary_weigh(&own, &sim->kernel, err)) &&
           boundary_append(body->fixed ? &sim->boundary.fixed : &sim->boundary.moving, &own.samples, err);
    boundary_set_free(&own);
    return good;
}

/* ---- Overlaps ---- */

/* How deep a point of body a (its frame, m) lies inside body b, at most as deep as inside a itself; `shift`
 * leads from a's frame to b's. */
static double depth_in(const Body *a, const Body *b, const double shift[3], const float p[3], bool surface) {
    const float q[3] = {(float)((double)p[0] + shift[0]), (float)((double)p[1] + shift[1]),
                        (float)((double)p[2] + shift[2])};
    for (int k = 0; k < 3; k++)
        if (q[k] < b->mesh.min[k] || q[k] > b->mesh.max[k])
            return 0.0;
    const double in_b = -(double)mesh_distance(&b->mesh, q, NULL);
    return surface ? in_b : fmin(in_b, -(double)mesh_distance(&a->mesh, p, NULL));
}

/* Depth of the overlap as body a's surface and the points halfway to its centre see it: the latter find
 * bodies that coincide. */
static double penetration(const Body *a, const Body *b) {
    const double shift[3] = {a->position[0] - b->position[0], a->position[1] - b->position[1],
                             a->position[2] - b->position[2]};
    double deepest = 0.0;
    for (uint32_t t = 0; t < a->mesh.triangle_count; t++) {
        const uint32_t *corner = a->mesh.triangles[t];
        float middle[3] = {0}, inner[3];
        for (int c = 0; c < 3; c++) {
            deepest = fmax(deepest, depth_in(a, b, shift, a->mesh.vertices[corner[c]], true));
            for (int k = 0; k < 3; k++)
                middle[k] += a->mesh.vertices[corner[c]][k] / 3.0f;
        }
        for (int k = 0; k < 3; k++)
            inner[k] = 0.5f * middle[k];
        deepest = fmax(deepest, depth_in(a, b, shift, middle, true));
        deepest = fmax(deepest, depth_in(a, b, shift, inner, false));
    }
    return deepest;
}

static bool check_overlaps(const SkiffSim *sim, const SkiffDef *def, Err *err) {
    bool good = true;
    const double tolerance = (double)sim->params.particle_radius;
    for (int a = 0; a < sim->body_count; a++) {
        for (int b = 0; b < a; b++) {
            const double depth = fmax(penetration(&sim->bodies[a], &sim->bodies[b]),
                                      penetration(&sim->bodies[b], &sim->bodies[a]));
            if (depth > tolerance)
                good = err_add(err, ERR_INPUT,
                               "RigidBodies[%d]: overlaps RigidBodies[%d] by at least %.3g m (allowed: less "
                               "than %.3g m)",
                               a, b, depth, tolerance);
        }
        if (sim->tank.kind == SKIFF_GEOMETRY_NONE || def->sea.on)
            continue; /* the sea goes on behind a window's walls */
        const Body *body = &sim->bodies[a];
        double worst = -INFINITY;
        for (uint32_t v = 0; v < body->mesh.vertex_count; v++) {
            float p[3];
            for (int k = 0; k < 3; k++)
                p[k] = (float)((double)body->mesh.vertices[v][k] + body->position[k] - sim->origin[k]);
            if (sim->tank_open)
                p[1] = fminf(p[1], sim->tank.max[1] - sim->params.particle_radius);
            worst = fmax(worst, (double)shape_distance(&sim->tank, p, NULL));
        }
        if (worst > tolerance)
            good = err_add(err, ERR_INPUT,
                           "RigidBodies[%d]: reaches %.3g m through the tank's wall (allowed: %.3g m)", a,
                           worst, tolerance);
    }
    return good;
}

/* Everything there is, four supports wider, ten metres higher: water that gets out of this is lost. */
static bool choose_domain(SkiffSim *sim, const SkiffDef *def, Err *err) {
    CellBounds *domain = &sim->domain;
    if (def->has_domain) {
        bool good = true;
        for (int k = 0; k < 3; k++) {
            domain->min[k] = (float)((double)def->domain_min[k] - sim->origin[k]);
            domain->max[k] = (float)((double)def->domain_max[k] - sim->origin[k]);
            if (!(domain->max[k] > domain->min[k]) || !isfinite(domain->min[k]) || !isfinite(domain->max[k]))
                good = err_add(err, ERR_INPUT,
                               "Configuration.domainMax[%d]: %g m must be finite and above domainMin[%d]", k,
                               (double)def->domain_max[k], k);
        }
        return good;
    }
    *domain = cell_bounds_empty();
    if (sim->tank.kind != SKIFF_GEOMETRY_NONE) {
        cell_bounds_grow(domain, sim->tank.min);
        cell_bounds_grow(domain, sim->tank.max);
    }
    for (int b = 0; b < def->block_count; b++) {
        float low[3], high[3];
        for (int k = 0; k < 3; k++) {
            low[k] = (float)((double)def->blocks[b].start[k] - sim->origin[k]);
            high[k] = (float)((double)def->blocks[b].end[k] - sim->origin[k]);
        }
        cell_bounds_grow(domain, low);
        cell_bounds_grow(domain, high);
    }
    if (!(domain->min[0] <= domain->max[0]))
        *domain = (CellBounds){{-1, -1, -1}, {1, 1, 1}};
    const float grow = sim->tank.kind != SKIFF_GEOMETRY_NONE ? 4.0f * sim->kernel.support : 10.0f;
    for (int k = 0; k < 3; k++) {
        domain->min[k] -= grow;
        domain->max[k] += grow;
    }
    domain->max[1] += 10.0f;
    return true;
}

/* A window sails away from bodies that stay, and their samples would span the whole way. */
static void limit_bodies(SkiffSim *sim) {
    BoundarySet *moving = &sim->boundary.moving;
    moving->has_reach = true;
    moving->reach = sim->domain;
    for (int k = 0; k < 3; k++) {
        moving->reach.min[k] -= sim->kernel.support;
        moving->reach.max[k] += sim->kernel.support;
    }
}

static uint64_t hash_def(const SkiffSim *sim, const SkiffDef *def) {
    XXH3_state_t state;
    XXH3_64bits_reset(&state);
    XXH3_64bits_update(&state, &def->params, sizeof def->params);
    for (int m = 0; m < 2; m++) {
        const BoundarySamples *samples = m ? &sim->boundary.moving.samples : &sim->boundary.fixed.samples;
        XXH3_64bits_update(&state, samples->position, samples->count * sizeof *samples->position);
        XXH3_64bits_update(&state, samples->object, samples->count * sizeof *samples->object);
    }
    for (int b = 0; b < sim->body_count; b++) {
        XXH3_64bits_update(&state, &sim->bodies[b].mass, sizeof(double));
        XXH3_64bits_update(&state, &sim->bodies[b].free_axes, sizeof(uint32_t));
        XXH3_64bits_update(&state, &sim->bodies[b].release_time, sizeof(double));
        XXH3_64bits_update(&state, &sim->bodies[b].stop_time, sizeof(double));
        XXH3_64bits_update(&state, &sim->bodies[b].ramp_time, sizeof(double));
    }
    for (int b = 0; b < def->block_count; b++) {
        XXH3_64bits_update(&state, def->blocks[b].start, 6 * sizeof(float));
        XXH3_64bits_update(&state, &def->blocks[b].fill, sizeof def->blocks[b].fill);
        XXH3_64bits_update(&state, def->blocks[b].offset, 6 * sizeof(float)); /* and the velocity */
        XXH3_64bits_update(&state, &def->blocks[b].time, 2 * sizeof(double));
        XXH3_64bits_update(&state, &def->blocks[b].repeat, sizeof(int));
    }
    for (int d = 0; d < sim->drive_count; d++) { /* all its fields have four bytes: there is no padding */
        XXH3_64bits_update(&state, &sim->drives[d].body, sizeof(int));
        XXH3_64bits_update(&state, &sim->drives[d].def, sizeof(SkiffDriveDef));
    }
    XXH3_64bits_update(&state, sim->tank.min, sizeof sim->tank.min);
    XXH3_64bits_update(&state, sim->tank.max, sizeof sim->tank.max);
    XXH3_64bits_update(&state, &sim->domain, sizeof sim->domain);
    XXH3_64bits_update(&state, &sim->sea.level, sizeof sim->sea.level);
    XXH3_64bits_update(&state, &sim->sea.follow, sizeof sim->sea.follow);
    XXH3_64bits_update(&state, def->sea.path, (size_t)def->sea.path_count * sizeof *def->sea.path);
    XXH3_64bits_update(&state, &def->sea.absorb, sizeof def->sea.absorb);
    XXH3_64bits_update(&state, def->sea.region_min, 6 * sizeof(float));
    return XXH3_64bits_digest(&state);
}

bool sim_near_body(const SkiffSim *sim, const float p[3], double margin) {
    double world[3];
    float local[3];
    for (int k = 0; k < 3; k++)
        world[k] = (double)p[k] + sim->origin[k];
    for (int b = 0; b < sim->body_count; b++)
        if (body_box_distance_sq(&sim->bodies[b], world, local) < margin * margin &&
            (double)mesh_distance(&sim->bodies[b].mesh, local, NULL) < margin)
            return true;
    return false;
}

bool sim_reserve(SkiffSim *sim, uint32_t capacity, Err *err) {
    const size_t padded = capacity + BLOCK;
    return particles_reserve(&sim->particles, capacity, err) &&
           boundary_reserve(&sim->boundary, capacity, sim->body_count, err) &&
           dfsph_reserve(&sim->dfsph, capacity, 1 + (uint32_t)sim->body_count, err) &&
           buffer_reserve(&sim->pressure, "pressure", padded * sizeof(float), err) &&
           buffer_reserve(&sim->rows.density, "density", padded * sizeof(float), err) &&
           buffer_reserve(&sim->object_forces, "object forces",
                          (1 + (size_t)sim->body_count) * 6 * sizeof(double), err) &&
           buffer_reserve(&sim->sums, "statistics", (padded / BLOCK + 1) * 128, err);
}

static bool build(SkiffSim *sim, const SkiffDef *def, Err *err) {
    double particles;
    bool good = skiff_params_check(&def->params, err);
    good = choose_passes(sim, def, err) && good;
    good = good && check_blocks(def, &particles, err) && check_memory(particles, err);
    if (!good)
        return false;
    const double d = 2.0 * (double)def->params.particle_radius;
    sim->params = def->params;
    sim->kernel = kernel_make(2.0 * d);
    sim->volume = (float)((double)def->params.volume_factor * d * d * d);
    sim->time = def->start_time;
    choose_origin(sim, def);
    sim->blocks = calloc((size_t)def->block_count + 1, sizeof *sim->blocks);
    sim->bodies = calloc((size_t)def->body_count + 1, sizeof *sim->bodies);
    if (sim->blocks == NULL || sim->bodies == NULL)
        return err_add(err, ERR_INPUT, "no memory");
    sim->block_count = def->block_count;
    for (int b = 0; b < def->block_count; b++)
        sim->blocks[b].def = def->blocks[b];
    good = make_tank(sim, def, err);
    for (sim->body_count = 0; sim->body_count < def->body_count; sim->body_count++)
        good = make_body(sim, def, sim->body_count, err) && good;
    good = good && drives_make(sim, def, err) && check_overlaps(sim, def, err) &&
           choose_domain(sim, def, err) && boundary_weigh(&sim->boundary.fixed, &sim->kernel, err) &&
           sim_reserve(sim, (uint32_t)particles, err);
    if (good)
        limit_bodies(sim);
    good = good &&
           boundary_place(&sim->boundary, sim->bodies, sim->body_count, sim->origin, sim->kernel.support,
                          sim->threads, err) &&
           sea_make(sim, def, err) && block_emit(sim, &sim->stats.particles_in[SKIFF_IN_EMITTED], err) &&
           probes_make(sim, def, err);
    if (!good)
        return false;
    sim->def_hash = hash_def(sim, def);
    sim->stats.particles = sim->particles.count;
    sim->stats.time = sim->time;
    sim->stats.boundary_samples = sim->boundary.fixed.samples.count + sim->boundary.moving.samples.count;
    return true;
}

SkiffSim *skiff_create(const SkiffDef *def, Err *err) {
    Err own = {0};
    if (err == NULL)
        err = &own;
    SkiffSim *sim = calloc(1, sizeof *sim);
    if (sim == NULL) {
        err_set(err, ERR_INPUT, "no memory");
        return NULL;
    }
    if (!build(sim, def, err)) {
        skiff_destroy(sim);
        return NULL;
    }
    return sim;
}

void skiff_destroy(SkiffSim *sim) {
    if (sim == NULL)
        return;
    probes_free(sim);
    for (int b = 0; b < sim->body_count; b++)
        body_free(&sim->bodies[b]);
    free(sim->bodies);
    free(sim->drives);
    free(sim->blocks);
    shape_free(&sim->tank);
    particles_free(&sim->particles);
    grid_free(&sim->grid);
    rows_free(&sim->rows);
    boundary_free(&sim->boundary);
    dfsph_free(&sim->dfsph);
    buffer_free(&sim->pressure);
    buffer_free(&sim->object_forces);
    buffer_free(&sim->sums);
    tile_free(&sim->tile);
    rest_cloud_free(&sim->rest);
    sea_free(&sim->sea);
    ghosts_free(&sim->ghosts);
    free(sim);
}
