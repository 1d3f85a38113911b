/* Counting sort of the particles by cell, and of groups of them by who moves and by the size of their rows.
 * Each thread counts and later moves one contiguous part of the particles, and the parts are taken in order
 * within a cell, so the sort is stable and its result does not depend on the number of threads. */
#include "grid.h"

#include <assert.h>
#include <math.h>
#include <omp.h>

enum { MAX_PARTS = 8 };

static void grid_bounds(const Particles *particles, CellBounds *bounds, int threads) {
    float min_x = INFINITY, min_y = INFINITY, min_z = INFINITY, max_x = -INFINITY, max_y = -INFINITY,
          max_z = -INFINITY;
#pragma omp parallel for schedule(static) num_threads(threads) reduction(min                                 \
                                                                         : min_x, min_y, min_z)              \
    reduction(max                                                                                            \
              : max_x, max_y, max_z)
    for (uint32_t i = 0; i < particles->count; i++) {
        const float *p = particles->position[i];
        /* fminf is a call; a NaN position is found by the check of the step that made it */
        min_x = p[0] < min_x ? p[0] : min_x;
        min_y = p[1] < min_y ? p[1] : min_y;
        min_z = p[2] < min_z ? p[2] : min_z;
        max_x = p[0] > max_x ? p[0] : max_x;
        max_y = p[1] > max_y ? p[1] : max_y;
        max_z = p[2] > max_z ? p[2] : max_z;
    }
    *bounds = (CellBounds){{min_x, min_y, min_z}, {max_x, max_y, max_z}};
}

static bool inside(const float *p, const CellBounds *domain) {
    for (int k = 0; k < 3; k++)
        if (!(p[k] >= domain->min[k] && p[k] <= domain->max[k]))
            return false;
    return true;
}

/* Clips the bounds to the domain; particles outside go to one extra cell at the end. */
static uint32_t count_outside(const Particles *particles, const CellBounds *domain, uint32_t *first) {
    uint32_t outside = 0;
    *first = UINT32_MAX;
    for (uint32_t i = 0; i < particles->count; i++) {
        if (!inside(particles->position[i], domain)) {
            *first = *first == UINT32_MAX ? i : *first;
            outside++;
        }
    }
    return outside;
}

static bool grid_reserve(Grid *grid, const Particles *particles, size_t cells, int parts, Err *err) {
    const size_t padded = particles->capacity + SLICE;
    /* a third more than asked, so that slowly growing bounds do not allocate in every step */
    const size_t table = (cells + 2) * sizeof(uint32_t);
    if (grid->start_buffer.size < table &&
        !buffer_reserve(&grid->start_buffer, "cell starts", table + table / 3, err))
        return false;
    const size_t histograms = (size_t)parts * (cells + 2) * sizeof(uint32_t);
    if (grid->histogram_buffer.size < histograms &&
        !buffer_reserve(&grid->histogram_buffer, "cell histograms", histograms + histograms / 3, err))
        return false;
    if (!buffer_reserve(&grid->cell_buffer, "cells of particles", padded * sizeof(uint32_t), err) ||
        !buffer_reserve(&grid->unsorted_buffer, "cells before the sort", padded * sizeof(uint32_t), err) ||
        !buffer_reserve(&grid->member_buffer, "particles by cell", padded * sizeof(uint32_t), err) ||
        !buffer_reserve(&grid->point_buffer, "positions by cell", 3 * padded * sizeof(float), err) ||
        !buffer_reserve(&grid->order_buffer, "sort order", padded * sizeof(uint32_t), err) ||
        !buffer_reserve(&grid->visit_buffer, "order of the search", padded * sizeof(uint32_t), err))
        return false;
    grid->cell = grid->cell_buffer.data;
    grid->member = grid->member_buffer.data;
    grid->x = grid->point_buffer.data;
    grid->y = grid->x + padded;
    grid->z = grid->y + padded;
    grid->order = grid->order_buffer.data;
    grid->visits = grid->visit_buffer.data;
    grid->cells.start = grid->start_buffer.data;
    return true;
}

/* Fills cell, member (for now with where the particles are) and the starts; `outside` particles go to the
 * cell after the last. */
static void counting_sort(Grid *grid, const Particles *particles, const CellBounds *domain, bool check,
                          int parts) {
    const CellGrid *cells = &grid->cells;
    const uint32_t cell_count = (uint32_t)cell_grid_count(cells);
    uint32_t *unsorted = grid->unsorted_buffer.data, *histograms = grid->histogram_buffer.data;
    uint32_t *start = grid->start_buffer.data;
    const uint32_t n = particles->count;
#pragma omp parallel num_threads(parts)
    {
        /* fewer threads than asked for is possible: the parts are dealt out, not the threads assumed */
        for (int part = omp_get_thread_num(); part < parts; part += omp_get_num_threads()) {
            uint32_t *histogram = histograms + (size_t)part * (cell_count + 1);
            memset(histogram, 0, (cell_count + 1) * sizeof(uint32_t));
            const uint32_t end = (uint32_t)((uint64_t)n * (part + 1) / parts);
            for (uint32_t i = (uint32_t)((uint64_t)n * part / parts); i < end; i++) {
                const float *p = particles->position[i];
                unsorted[i] = check && !inside(p, domain) ? cell_count : cell_grid_at(cells, p);
                histogram[unsorted[i]]++;
            }
        }
#pragma omp barrier
#pragma omp single
        {
            uint32_t total = 0;
            for (uint32_t c = 0; c <= cell_count; c++) {
                start[c] = total;
                for (int part = 0; part < parts; part++) {
                    uint32_t *entry = &histograms[(size_t)part * (cell_count + 1) + c];
                    const uint32_t here = *entry;
                    *entry = total;
                    total += here;
                }
            }
            start[cell_count + 1] = total;
        }
        for (int part = omp_get_thread_num(); part < parts; part += omp_get_num_threads()) {
            uint32_t *histogram = histograms + (size_t)part * (cell_count + 1);
            const uint32_t end = (uint32_t)((uint64_t)n * (part + 1) / parts);
            for (uint32_t i = (uint32_t)((uint64_t)n * part / parts); i < end; i++) {
                const uint32_t k = histogram[unsorted[i]]++;
                grid->member[k] = i;
                grid->cell[k] = unsorted[i];
            }
        }
    }
}

/* Orders by neighbours, by near ones, by place: all different. */
static inline int32_t row_key(uint32_t row_size, uint32_t place) {
    static_assert(MAX_NEIGHBOURS < 512 && ROW_GROUP <= 8192, "three numbers in 31 bits");
    return (int32_t)((row_all(row_size) << 9 | row_near(row_size)) * ROW_GROUP + place);
}

/* Fills visits of a block. */
static void part_block(Grid *grid, uint32_t begin, uint32_t end) {
    uint32_t first = begin, last_count = 0, last[BLOCK];
    for (uint32_t k = begin; k < end; k++) {
        if (grid->apart != NULL && grid->apart[grid->member[k]])
            last[last_count++] = k;
        else
            grid->visits[first++] = k;
    }
    memcpy(grid->visits + first, last, last_count * sizeof *last);
}

/* Fills order of a group, and turns member from where its particles are to where they will be. A particle's
 * rank in its group is the number of those before it: few enough to compare all with all. */
static void arrange_group(Grid *grid, const Particles *particles, uint32_t begin, uint32_t count) {
    const uint32_t *visits = grid->visits + begin;
    uint32_t *member = grid->member;
    int32_t key[ROW_GROUP];
    for (uint32_t k = 0; k < ROW_GROUP; k++)
        key[k] = k < count ? row_key(particles->row_size[member[visits[k]]], k) : INT32_MAX;
    for (uint32_t k = 0; k < count; k++) {
        int32_t rank = 0;
#pragma omp simd reduction(+ : rank)
        for (uint32_t other = 0; other < ROW_GROUP; other++)
            rank += key[other] < key[k];
        grid->order[begin + (uint32_t)rank] = member[visits[k]];
        member[visits[k]] = begin + (uint32_t)rank;
    }
}

static void arrange(Grid *grid, const Particles *particles, uint32_t kept, int threads) {
#pragma omp parallel for schedule(static) num_threads(threads)
    for (uint32_t block = 0; block < kept; block += BLOCK) {
        const uint32_t end = kept - block < BLOCK ? kept : block + BLOCK;
        part_block(grid, block, end);
        for (uint32_t begin = block; begin < end; begin += ROW_GROUP)
            arrange_group(grid, particles, begin, end - begin < ROW_GROUP ? end - begin : ROW_GROUP);
    }
}

/* Positions in the order of cells; the slice after the last is read, too. */
static void copy_points(Grid *grid, const Particles *particles, int threads) {
    const uint32_t count = particles->count;
#pragma omp parallel for schedule(static) num_threads(threads)
    for (uint32_t k = 0; k < count + SLICE; k++) {
        const float *p = particles->position[k < count ? grid->member[k] : k];
        grid->x[k] = p[0];
        grid->y[k] = p[1];
        grid->z[k] = p[2];
    }
}

static bool sort(Grid *grid, Particles *particles, float cell_size, const CellBounds *domain,
                 uint32_t *removed, int threads, Err *err) {
    CellBounds bounds;
    grid_bounds(particles, &bounds, threads);
    if (particles->count == 0)
        bounds = (CellBounds){{0}, {0}};
    uint32_t outside = 0;
    if (!inside(bounds.min, domain) || !inside(bounds.max, domain)) {
        uint32_t first;
        outside = count_outside(particles, domain, &first);
        if (removed == NULL) {
            const float *p = particles->position[first];
            return err_set(
                err, ERR_DIVERGED,
                "particle %llu left the domain: it is at (%g, %g, %g) m (window-local), the domain is "
                "(%g, %g, %g) to (%g, %g, %g) m; %u particles in all are outside",
                (unsigned long long)particles->id[first], (double)p[0], (double)p[1], (double)p[2],
                (double)domain->min[0], (double)domain->min[1], (double)domain->min[2],
                (double)domain->max[0], (double)domain->max[1], (double)domain->max[2], outside);
        }
        for (int k = 0; k < 3; k++) {
            bounds.min[k] = fminf(fmaxf(bounds.min[k], domain->min[k]), domain->max[k]);
            bounds.max[k] = fmaxf(fminf(bounds.max[k], domain->max[k]), domain->min[k]);
        }
    }
    if (!cell_grid_layout(&grid->cells, &bounds, cell_size, 1))
        return err_set(err, ERR_DIVERGED, "the fluid spreads over more than %d cells of %g m",
                       CELL_GRID_MAX_CELLS, (double)cell_size);
    const size_t cells = cell_grid_count(&grid->cells);
    const int parts = threads < MAX_PARTS ? threads : MAX_PARTS;
    if (!grid_reserve(grid, particles, cells, parts, err))
        return false;
    counting_sort(grid, particles, domain, outside != 0, parts);
    if (removed != NULL)
        *removed = outside;
    arrange(grid, particles, particles->count - outside, threads);
    particles_permute(particles, grid->order, particles->count - outside, threads);
    copy_points(grid, particles, threads);
    return true;
}

bool grid_sort(Grid *grid, Particles *particles, float cell_size, const CellBounds *domain, uint32_t *removed,
               int threads, Err *err) {
    const bool good = sort(grid, particles, cell_size, domain, removed, threads, err);
    grid->apart = NULL;
    return good;
}

void grid_free(Grid *grid) {
    buffer_free(&grid->start_buffer);
    buffer_free(&grid->cell_buffer);
    buffer_free(&grid->member_buffer);
    buffer_free(&grid->point_buffer);
    buffer_free(&grid->order_buffer);
    buffer_free(&grid->visit_buffer);
    buffer_free(&grid->unsorted_buffer);
    buffer_free(&grid->histogram_buffer);
    *grid = (Grid){0};
}
