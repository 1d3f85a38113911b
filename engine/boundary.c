/* Boundary samples: making, weighing, moving and sorting them, and the terms they give the particles near
 * them. Samples are not visited again after boundary_apply: the solvers work with the contacts [DESIGN sec.
 * 4]. */
#include "boundary.h"
#include "dvec.h"

#include <math.h>
#include <omp.h>
#include <stdlib.h>

/* Of BoundarySamples. */
#define EACH_SAMPLE_ARRAY(DO) DO(position) DO(volume) DO(area) DO(normal) DO(surface) DO(object)

static bool samples_grow(BoundarySamples *samples, uint32_t extra) {
    const uint32_t need = samples->count + extra;
    if (need <= samples->capacity)
        return true;
    bool good = true;
#define GROW(field)                                                                                          \
    {                                                                                                        \
        void *grown = realloc(samples->field, need * sizeof *samples->field);                                \
        samples->field = grown ? grown : samples->field;                                                     \
        good = good && grown;                                                                                \
    }
    EACH_SAMPLE_ARRAY(GROW)
#undef GROW
    samples->capacity = good ? need : samples->capacity;
    return good;
}

/* Displacements that move every face of the mesh by one unit along its normal: a vertex between faces goes
 * where their moved planes meet (least squares over its triangles, weighted by area; the small regular part
 * decides along directions no face speaks of). */
static void offset_directions(const Mesh *mesh, double (*normal_sums)[3], double (*tensors)[6]) {
    for (uint32_t t = 0; t < mesh->triangle_count; t++) {
        double edge[2][3], n[3];
        for (int k = 0; k < 3; k++) {
            const double origin = (double)mesh->vertices[mesh->triangles[t][0]][k];
            edge[0][k] = (double)mesh->vertices[mesh->triangles[t][1]][k] - origin;
            edge[1][k] = (double)mesh->vertices[mesh->triangles[t][2]][k] - origin;
        }
        dvec_cross(n, edge[0], edge[1]);
        const double area = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
        for (int c = 0; c < 3; c++) {
            double *sum = normal_sums[mesh->triangles[t][c]], *tensor = tensors[mesh->triangles[t][c]];
            for (int k = 0; k < 3; k++)
                sum[k] += n[k];
            tensor[0] += n[0] * n[0] / area;
            tensor[1] += n[0] * n[1] / area;
            tensor[2] += n[0] * n[2] / area;
            tensor[3] += n[1] * n[1] / area;
            tensor[4] += n[1] * n[2] / area;
            tensor[5] += n[2] * n[2] / area;
        }
    }
    for (uint32_t v = 0; v < mesh->vertex_count; v++) {
        const double *m = tensors[v], small = 1e-3 * (m[0] + m[3] + m[5]);
        const double a = m[0] + small, b = m[1], c = m[2], d = m[3] + small, e = m[4], f = m[5] + small;
        const double inverse[3][3] = {{d * f - e * e, c * e - b * f, b * e - c * d},
                                      {c * e - b * f, a * f - c * c, b * c - a * e},
                                      {b * e - c * d, b * c - a * e, a * d - b * b}};
        const double det = a * inverse[0][0] + b * inverse[0][1] + c * inverse[0][2];
        matrix_times(inverse, normal_sums[v], normal_sums[v]);
        for (int k = 0; k < 3; k++)
            normal_sums[v][k] /= det;
    }
}

/* Moves a vertex of a body inwards, by as much of the offset as keeps it well inside: where the body is
 * thinner than two offsets (a stem, a mast, a coaming) its sides would trade places. */
static void offset_vertex(const SurfaceDef *surface, const float vertex[3], const double direction[3],
                          float moved[3]) {
    for (float share = 1.0f;; share = share > 0.1f ? 0.5f * share : 0.0f) {
        const float sign = surface->water_inside ? 1.0f : -1.0f, distance = share * surface->offset;
        for (int k = 0; k < 3; k++)
            moved[k] = vertex[k] + sign * distance * (float)direction[k];
        if (surface->water_inside || share == 0.0f ||
            mesh_distance(surface->mesh, moved, NULL) < -0.5f * distance)
            return;
    }
}

/* The mesh with its faces moved behind the surface, seen from the water. */
static bool offset_mesh(const SurfaceDef *surface, Mesh *moved, Err *err) {
    const Mesh *mesh = surface->mesh;
    double(*directions)[3] = calloc(mesh->vertex_count, sizeof *directions);
    double(*tensors)[6] = calloc(mesh->vertex_count, sizeof *tensors);
    *moved = (Mesh){.vertices = malloc(mesh->vertex_count * sizeof *moved->vertices),
                    .triangles = malloc(mesh->triangle_count * sizeof *moved->triangles),
                    .vertex_count = mesh->vertex_count,
                    .triangle_count = mesh->triangle_count};
    const bool memory = directions && tensors && moved->vertices && moved->triangles;
    if (memory) {
        offset_directions(mesh, directions, tensors);
        memcpy(moved->triangles, mesh->triangles, mesh->triangle_count * sizeof *moved->triangles);
    }
    for (uint32_t v = 0; memory && v < mesh->vertex_count; v++)
        offset_vertex(surface, mesh->vertices[v], directions[v], moved->vertices[v]);
    free(directions);
    free(tensors);
    if (!memory) {
        mesh_free(moved);
        return err_add(err, ERR_INPUT, "%s: no memory", surface->path);
    }
    mesh_transform(moved, (const float[3]){1, 1, 1}, (const float[4]){0, 0, 0, 1}, (const float[3]){0, 0, 0});
    return true;
}

bool boundary_add(BoundarySet *set, const SurfaceDef *surface, Err *err) {
    enum { MAX_SAMPLES = 50000000 };
    SamplePoint *points = NULL;
    uint32_t count = 0;
    Err reason = {0};
    Mesh moved;
    if (!offset_mesh(surface, &moved, err))
        return false;
    const bool sampled =
        sample_surface(&moved, surface->spacing, surface->region, MAX_SAMPLES, &points, &count, &reason);
    mesh_free(&moved);
    if (!sampled)
        return err_add(err, reason.code, "%s: %s", surface->path, reason.message);
    BoundarySamples *samples = &set->samples;
    if (!samples_grow(samples, count)) {
        free(points);
        return err_add(err, ERR_INPUT, "%s: no memory for %u boundary samples", surface->path, count);
    }
    for (uint32_t s = 0; s < count; s++) {
        const uint32_t to = samples->count++;
        const float back = surface->water_inside ? -surface->offset : surface->offset;
        memcpy(samples->position[to], points[s].position, sizeof samples->position[to]);
        for (int k = 0; k < 3; k++)
            samples->surface[to][k] = points[s].position[k] + back * points[s].normal[k];
        memcpy(samples->normal[to], points[s].normal, sizeof samples->normal[to]);
        samples->area[to] = points[s].area;
        samples->object[to] = surface->object;
        samples->volume[to] = 0.0f;
    }
    free(points);
    return true;
}

/* ---- Cells ---- */

static bool set_reserve(BoundarySet *set, size_t cells, Err *err) {
    const size_t padded = set->samples.count + SLICE;
    /* world positions and cells of the samples; x, y, z, volume, object, origin of the sorted ones */
    if (!buffer_reserve(&set->buffer, "boundary samples", padded * (7 * sizeof(float) + sizeof(Float4)), err))
        return false;
    if (set->cells.size < (cells + 1) * sizeof(uint32_t) &&
        !buffer_reserve(&set->cells, "boundary cells", (cells + cells / 3 + 1) * sizeof(uint32_t), err))
        return false;
    if (set->occupied.size < cells &&
        !buffer_reserve(&set->occupied, "boundary occupancy", cells + cells / 3, err))
        return false;
    Float4 *world = set->buffer.data;
    float *x = (float *)(world + padded);
    set->world = world;
    set->sorted.x = x;
    set->sorted.y = x + padded;
    set->sorted.z = x + 2 * padded;
    set->sorted.volume = x + 3 * padded;
    set->sorted.object = (int32_t *)(x + 4 * padded);
    set->origin = (uint32_t *)(x + 5 * padded);
    set->cell = (uint32_t *)(x + 6 * padded);
    set->sorted.grid.start = set->cells.data;
    set->sorted.occupied = set->occupied.data;
    return true;
}

static void mark_occupied(const CellGrid *grid, uint8_t *occupied) {
    memset(occupied, 0, cell_grid_count(grid));
    for (int32_t x = 1; x + 1 < grid->size[0]; x++)
        for (int32_t z = 1; z + 1 < grid->size[2]; z++)
            for (int32_t y = 1; y + 1 < grid->size[1]; y++) {
                const int32_t cell = cell_grid_index(grid, x, y, z);
                if (grid->start[cell] == grid->start[cell + 1])
                    continue;
                for (int32_t dx = -1; dx <= 1; dx++)
                    for (int32_t dz = -1; dz <= 1; dz++)
                        memset(occupied + cell_grid_index(grid, x + dx, y - 1, z + dz), 1, 3);
            }
}

static bool in_reach(const BoundarySet *set, uint32_t s) {
    for (int k = 0; set->has_reach && k < 3; k++)
        if (!(set->world[s][k] >= set->reach.min[k] && set->world[s][k] <= set->reach.max[k]))
            return false;
    return true;
}

/* Sorts a set's world positions into cells of edge h. */
static bool sort_set(BoundarySet *set, float cell_size, Err *err) {
    const uint32_t count = set->samples.count;
    CellBounds bounds = cell_bounds_empty();
    set->sorted.count = 0;
    for (uint32_t s = 0; s < count; s++) {
        if (!in_reach(set, s))
            continue;
        set->sorted.count++;
        cell_bounds_grow(&bounds, set->world[s]);
    }
    if (set->sorted.count == 0)
        return true;
    /* two empty layers: the 27 cells around an occupied one, and around those, exist */
    if (!cell_grid_layout(&set->sorted.grid, &bounds, cell_size, 2))
        return err_set(err, ERR_DIVERGED, "the boundary samples spread over more than %d cells of %g m",
                       CELL_GRID_MAX_CELLS, (double)cell_size);
    const CellGrid *grid = &set->sorted.grid;
    const size_t cells = cell_grid_count(grid);
    if (!set_reserve(set, cells, err))
        return false;
    for (uint32_t s = 0; s < count; s++)
        set->cell[s] = in_reach(set, s) ? cell_grid_at(grid, set->world[s]) : CELL_NONE;
    /* samples come grouped by object, and a stable sort keeps them so within a cell */
    cell_grid_sort(set->cell, count, cells, set->cells.data, set->origin);
    float *x = (float *)set->sorted.x, *y = (float *)set->sorted.y, *z = (float *)set->sorted.z;
    float *volume = (float *)set->sorted.volume;
    int32_t *object = (int32_t *)set->sorted.object;
    for (uint32_t to = 0; to < set->sorted.count; to++) {
        const uint32_t s = set->origin[to];
        x[to] = set->world[s][0];
        y[to] = set->world[s][1];
        z[to] = set->world[s][2];
        volume[to] = set->world[s][3];
        object[to] = set->samples.object[s];
    }
    mark_occupied(grid, set->occupied.data);
    return true;
}

/* ---- Volumes ---- */

static void sample_volumes(BoundarySet *set, const Kernel *kernel) {
    const SampleSet *sorted = &set->sorted;
    const CellGrid *grid = &sorted->grid;
#pragma omp parallel for schedule(dynamic, 256)
    for (uint32_t s = 0; s < set->samples.count; s++) {
        const float *p = set->world[s];
        const int32_t cell = (int32_t)cell_grid_at(grid, p);
        double sum = 0.0;
        for (int run = 0; run < CELL_RUNS; run++) {
            const CellRun near = cell_grid_run(grid, cell, run);
            for (uint32_t b = near.begin; b < near.end; b++) {
                const float dx = p[0] - sorted->x[b], dy = p[1] - sorted->y[b], dz = p[2] - sorted->z[b];
                sum += (double)kernel_w(kernel, sqrtf(dx * dx + dy * dy + dz * dz));
            }
        }
        set->samples.volume[s] = (float)(1.0 / sum);
    }
}

bool boundary_weigh(BoundarySet *set, const Kernel *kernel, Err *err) {
    if (set->samples.count == 0)
        return true;
    if (!set_reserve(set, 1, err))
        return false;
    for (uint32_t s = 0; s < set->samples.count; s++)
        memcpy(set->world[s], set->samples.position[s], sizeof set->samples.position[s]);
    if (!sort_set(set, kernel->support, err))
        return false;
    sample_volumes(set, kernel);
    for (uint32_t s = 0; s < set->samples.count; s++)
        set->world[s][3] = set->samples.volume[s];
    return sort_set(set, kernel->support, err); /* once more: the sorted copy takes the volumes along */
}

bool boundary_append(BoundarySet *set, const BoundarySamples *more, Err *err) {
    BoundarySamples *samples = &set->samples;
    if (!samples_grow(samples, more->count))
        return err_add(err, ERR_INPUT, "no memory for %u boundary samples", more->count);
    const uint32_t to = samples->count;
#define COPY(field) memcpy(samples->field + to, more->field, more->count * sizeof *more->field);
    EACH_SAMPLE_ARRAY(COPY)
#undef COPY
    samples->count += more->count;
    return true;
}

/* ---- Steps ---- */

bool boundary_reserve(Boundary *boundary, uint32_t particle_capacity, int body_count, Err *err) {
    const size_t blocks = particle_capacity / BLOCK + 1;
    boundary->object_count = 1 + (uint32_t)body_count;
    /* about 2.5 samples of a wall belong to one particle beside it; two layers of particles feel them */
    const uint32_t guess = 4096 + 2 * (boundary->fixed.samples.count + boundary->moving.samples.count);
    if (boundary->contact_capacity < guess)
        boundary->contact_capacity = guess;
    if (!buffer_reserve(&boundary->contact_buffer, "contacts", boundary->contact_capacity * sizeof(Contact),
                        err) ||
        !buffer_reserve(&boundary->span_buffer, "contact spans", blocks * sizeof(ContactSpan), err) ||
        !buffer_reserve(&boundary->centre_buffer, "object centres", boundary->object_count * sizeof(Float4),
                        err) ||
        !buffer_reserve(&boundary->partial_buffer, "impulse sums",
                        blocks * boundary->object_count * 6 * sizeof(double), err))
        return false;
    boundary->contacts = boundary->contact_buffer.data;
    boundary->spans = boundary->span_buffer.data;
    boundary->centres = boundary->centre_buffer.data;
    return true;
}

void boundary_place_centres(Boundary *boundary, const Body *bodies, int body_count, const double origin[3]) {
    for (int b = 0; b < body_count; b++)
        for (int k = 0; k < 3; k++)
            boundary->centres[1 + b][k] = (float)(bodies[b].position[k] - origin[k]);
}

bool boundary_place(Boundary *boundary, const Body *bodies, int body_count, const double origin[3],
                    float cell_size, int threads, Err *err) {
    boundary_place_centres(boundary, bodies, body_count, origin);
    BoundarySet *set = &boundary->moving;
    if (set->samples.count == 0)
        return true;
    if (set->world == NULL && !set_reserve(set, 1, err))
        return false;
#pragma omp parallel for schedule(static) num_threads(threads)
    for (uint32_t s = 0; s < set->samples.count; s++) {
        const Body *body = &bodies[set->samples.object[s] - 1];
        const float *p = set->samples.position[s];
        const double local[3] = {p[0], p[1], p[2]};
        double world[3];
        matrix_times((const double(*)[3])body->matrix, local, world);
        for (int k = 0; k < 3; k++)
            set->world[s][k] = (float)(world[k] + (body->position[k] - origin[k]));
        set->world[s][3] = set->samples.volume[s];
    }
    return sort_set(set, cell_size, err);
}

/* One try: contacts of every block, appended to the common list. False: a particle touches too many objects
 * or samples. */
static bool apply_blocks(Boundary *boundary, const BoundaryJob *job, const Passes *passes, Rows *rows,
                         int threads, uint32_t *fault) {
    const uint32_t blocks = (job->count + BLOCK - 1) / BLOCK;
    uint32_t used = 0, first_fault = UINT32_MAX;
#pragma omp parallel num_threads(threads) reduction(min : first_fault)
    {
        Scratch *scratch = rows_scratch(rows, omp_get_thread_num());
#pragma omp for schedule(dynamic, 2)
        for (uint32_t block = 0; block < blocks; block++) {
            uint32_t particle = UINT32_MAX;
            const int count = passes->boundary(job, block, scratch, &particle);
            if (count < 0) {
                first_fault = particle < first_fault ? particle : first_fault;
                continue;
            }
            uint32_t start;
#pragma omp atomic capture
            {
                start = used;
                used += (uint32_t)count;
            }
            boundary->spans[block] = (ContactSpan){start, (uint32_t)count};
            if (start + (uint64_t)count <= boundary->contact_capacity)
                memcpy(boundary->contacts + start, scratch->contacts, (size_t)count * sizeof(Contact));
        }
    }
    boundary->contact_count = used;
    *fault = first_fault;
    return first_fault == UINT32_MAX;
}

bool boundary_apply(Boundary *boundary, Rows *rows, const RowsJob *build, Err *err) {
    const Particles *particles = build->particles;
    const BoundaryJob job = {.sets = {&boundary->fixed.sorted, &boundary->moving.sorted},
                             .position = (const Float4 *)particles->position,
                             .centres = (const Float4 *)boundary->centres,
                             .member = build->grid->member,
                             .frozen = build->frozen,
                             .count = particles->count,
                             .kernel = rows->pairs.kernel,
                             .density = rows->density.data,
                             .gradient_sum = rows->gradient_sum.data,
                             .neighbours = rows->neighbours,
                             .shape = {rows->shape[0].data, rows->shape[1].data}};
    uint32_t fault;
    if (!apply_blocks(boundary, &job, build->passes, rows, build->threads, &fault))
        return err_set(
            err, ERR_DIVERGED,
            "particle %llu touches more than %d walls and bodies at once, or more than %d of their "
            "samples lie around it",
            (unsigned long long)particles->id[fault], MAX_CONTACT_OBJECTS, MAX_NEAR_SAMPLES);
    if (boundary->contact_count <= boundary->contact_capacity)
        return true;
    /* the terms are done, only the list was too short: make room and list the contacts alone once more */
    boundary->contact_capacity = boundary->contact_count + boundary->contact_count / 4;
    if (!buffer_reserve(&boundary->contact_buffer, "contacts", boundary->contact_capacity * sizeof(Contact),
                        err))
        return false;
    boundary->contacts = boundary->contact_buffer.data;
    BoundaryJob again = job;
    again.density = NULL;
    return apply_blocks(boundary, &again, build->passes, rows, build->threads, &fault);
}

void boundary_impulse(const Boundary *boundary, const float *p, size_t stride, uint32_t blocks,
                      double (*totals)[6], int threads) {
    const uint32_t objects = boundary->object_count;
    double(*partials)[6] = boundary->partial_buffer.data;
#pragma omp parallel for schedule(static) num_threads(threads)
    for (uint32_t block = 0; block < blocks; block++) {
        const ContactSpan span = boundary->spans[block];
        double(*partial)[6] = partials + (size_t)block * objects;
        if (span.count == 0)
            continue;
        memset(partial, 0, objects * sizeof *partial);
        for (uint32_t c = span.start; c < span.start + span.count; c++) {
            const Contact *contact = &boundary->contacts[c];
            const float weight = p[contact->particle * stride];
            for (int k = 0; k < 3; k++) {
                partial[contact->object][k] += (double)(weight * contact->g[k]);
                partial[contact->object][3 + k] += (double)(weight * contact->t[k]);
            }
        }
    }
    memset(totals, 0, objects * sizeof *totals);
    for (uint32_t block = 0; block < blocks; block++) {
        if (boundary->spans[block].count == 0)
            continue;
        for (uint32_t o = 0; o < objects; o++)
            for (int k = 0; k < 6; k++)
                totals[o][k] += partials[(size_t)block * objects + o][k];
    }
}

void boundary_set_free(BoundarySet *set) {
#define FREE(field) free(set->samples.field);
    EACH_SAMPLE_ARRAY(FREE)
#undef FREE
    buffer_free(&set->buffer);
    buffer_free(&set->cells);
    buffer_free(&set->occupied);
    *set = (BoundarySet){0};
}

void boundary_free(Boundary *boundary) {
    boundary_set_free(&boundary->fixed);
    boundary_set_free(&boundary->moving);
    buffer_free(&boundary->contact_buffer);
    buffer_free(&boundary->span_buffer);
    buffer_free(&boundary->centre_buffer);
    buffer_free(&boundary->partial_buffer);
}
