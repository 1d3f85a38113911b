/* Memory and scheduling of the neighbour search; the search itself is in search.c. */
#include "rows.h"

#include <omp.h>

enum { CHUNK_ENTRIES = 4096 };

static size_t entry_size(bool wide) {
    return wide ? sizeof(RowEntryWide) : sizeof(RowEntry);
}

Scratch *rows_scratch(Rows *rows, int thread) {
    return (Scratch *)rows->scratch.data + thread;
}

static uint32_t rows_allocate(void *user, int thread, uint32_t entries) {
    Rows *rows = user;
    RowShare *share = &rows->shares[thread];
    if (share->end - share->next < entries) {
        const uint32_t chunk = entries > CHUNK_ENTRIES ? entries : CHUNK_ENTRIES;
        const uint32_t begin = atomic_fetch_add_explicit(&rows->pool_used, chunk, memory_order_relaxed);
        if (begin + (uint64_t)chunk > rows->pool_entries)
            return UINT32_MAX;
        share->next = begin;
        share->end = begin + chunk;
    }
    const uint32_t first = share->next;
    share->next += entries;
    return first;
}

/* Room for what standing water gives. */
static bool reserve_standing(Rows *rows, const Particles *particles, const StandingSet *standing, Err *err) {
    const size_t bytes = (particles->capacity + SLICE) * sizeof(Float4);
    rows->beside = (Standing){NULL, NULL};
    if (standing == NULL)
        return true;
    if (!buffer_reserve(&rows->push, "push of standing water", bytes, err) ||
        !buffer_reserve(&rows->apart, "standing water nearby", bytes, err))
        return false;
    rows->beside = (Standing){rows->push.data, rows->apart.data};
    return true;
}

static bool rows_reserve(Rows *rows, const Particles *particles, int threads, Err *err) {
    const size_t padded = particles->capacity + SLICE, slices = particles->capacity / SLICE + 1;
    if (rows->pool_entries == 0) /* 45 places a particle: 39 are needed in water at rest */
        rows->pool_entries = (uint32_t)(slices * 45) + CHUNK_ENTRIES * (uint32_t)threads;
    return buffer_reserve(&rows->pool, "neighbour rows", rows->pool_entries * entry_size(rows->wide), err) &&
           buffer_reserve(&rows->weights, "neighbour weights",
                          (size_t)rows->pool_entries * SLICE * sizeof(int16_t), err) &&
           buffer_reserve(&rows->slices, "row starts", slices * sizeof(SliceRows), err) &&
           buffer_reserve(&rows->density, "density", padded * sizeof(float), err) &&
           buffer_reserve(&rows->gradient_sum, "gradient sums", padded * sizeof(Float4), err) &&
           buffer_reserve(&rows->neighbour_counts, "neighbour counts", padded * sizeof(uint16_t), err) &&
           buffer_reserve(&rows->scratch, "search scratch", (size_t)threads * sizeof(Scratch), err);
}

/* One try; returns SearchStatus bits. */
static int rows_search(Rows *rows, const Passes *passes, const SearchJob *job, int threads, uint32_t *fault) {
    atomic_store(&rows->pool_used, 0);
    memset(rows->shares, 0, sizeof rows->shares);
    const uint32_t blocks = (job->count + BLOCK - 1) / BLOCK;
    int status = SEARCH_OK;
    uint32_t first_fault = UINT32_MAX;
#pragma omp parallel num_threads(threads) reduction(| : status) reduction(min : first_fault)
    {
        const int thread = omp_get_thread_num();
#pragma omp for schedule(dynamic, 2)
        for (uint32_t block = 0; block < blocks; block++) {
            uint32_t particle = UINT32_MAX;
            status |= passes->search(job, block, thread, rows_scratch(rows, thread), &particle);
            first_fault = particle < first_fault ? particle : first_fault;
        }
    }
    *fault = first_fault;
    return status;
}

bool rows_build(Rows *rows, const RowsJob *build, Err *err) {
    const Particles *particles = build->particles;
    for (;;) {
        if (!rows_reserve(rows, particles, build->threads, err) ||
            !reserve_standing(rows, particles, build->standing, err))
            return false;
        rows->neighbours = rows->neighbour_counts.data;
        const SearchJob job = {.grid = &build->grid->cells,
                               .cell = build->grid->cell,
                               .member = build->grid->member,
                               .visits = build->grid->visits,
                               .points = {build->grid->x, build->grid->y, build->grid->z},
                               .position = (const Float4 *)particles->position,
                               .count = particles->count,
                               .kernel = *build->kernel,
                               .volume = build->volume,
                               .factor_unit = 2.0f / 65535.0f * build->volume *
                                              build->kernel->gradient_scale * build->kernel->inv_support,
                               .wide = rows->wide,
                               .entries = rows->pool.data,
                               .frozen = build->frozen,
                               .weights = rows->weights.data,
                               .slices = rows->slices.data,
                               .density = rows->density.data,
                               .gradient_sum = rows->gradient_sum.data,
                               .neighbours = rows->neighbours,
                               .row_size = particles->row_size,
                               .standing = build->standing,
                               .beside = rows->beside,
                               .allocate = rows_allocate,
                               .rows = rows};
        uint32_t fault;
        const int status = rows_search(rows, build->passes, &job, build->threads, &fault);
        if (status & SEARCH_TOO_DENSE)
            return err_set(
                err, ERR_DIVERGED,
                "particle %llu has more than %d neighbours, or more than %d particles in the cells "
                "around it; water at rest has 34",
                (unsigned long long)particles->id[fault], MAX_NEIGHBOURS, MAX_CANDIDATES);
        if (status & SEARCH_NEEDS_MEMORY)
            rows->pool_entries += rows->pool_entries / 2;
        if (status & SEARCH_NEEDS_WIDE)
            rows->wide = true;
        if (status == SEARCH_OK) {
            rows->pairs = (PairData){.count = job.count,
                                     .kernel = *build->kernel,
                                     .volume = build->volume,
                                     .factor_unit = job.factor_unit,
                                     .centre = {cell_grid_centre(job.grid, 0), cell_grid_centre(job.grid, 1),
                                                cell_grid_centre(job.grid, 2)},
                                     .wide = rows->wide,
                                     .entries = job.entries,
                                     .weights = job.weights,
                                     .slices = job.slices,
                                     .position = job.position,
                                     .density = job.density,
                                     .gradient_sum = (const Float4 *)job.gradient_sum};
            return true;
        }
    }
}

bool rows_reserve_correction(Rows *rows, const Particles *particles, Err *err) {
    const size_t bytes = (particles->capacity + SLICE) * sizeof(Float4);
    const size_t gradients = (size_t)rows->pool_entries * 3 * SLICE * sizeof(int16_t);
    return buffer_reserve(&rows->gradients, "corrected gradients", gradients, err) &&
           buffer_reserve(&rows->corrected_sum, "corrected gradient sums", bytes, err) &&
           buffer_reserve(&rows->shape[0], "gradient corrections", bytes, err) &&
           buffer_reserve(&rows->shape[1], "gradient corrections", bytes, err);
}

void rows_correct(Rows *rows, const Passes *passes, int threads) {
    const uint32_t blocks = (rows->pairs.count + BLOCK - 1) / BLOCK;
    const Kernel *kernel = &rows->pairs.kernel;
    const CorrectionJob job = {.pairs = &rows->pairs,
                               .shape = {rows->shape[0].data, rows->shape[1].data},
                               .gradients = rows->gradients.data,
                               /* three times the largest that is not corrected */
                               .gradient_unit = rows->pairs.volume * kernel->gradient_scale / 32767.0f,
                               .gradient_sum = rows->corrected_sum.data};
#pragma omp parallel num_threads(threads)
    {
#pragma omp for schedule(static)
        for (uint32_t block = 0; block < blocks; block++)
            passes->shape(&job, block);
#pragma omp for schedule(static)
        for (uint32_t block = 0; block < blocks; block++)
            passes->correct(&job, block);
    }
    rows->corrected = rows->pairs;
    rows->corrected.gradients = job.gradients;
    rows->corrected.gradient_unit = job.gradient_unit;
    rows->corrected.gradient_sum = (const Float4 *)job.gradient_sum;
}

void rows_free(Rows *rows) {
    buffer_free(&rows->gradients);
    buffer_free(&rows->corrected_sum);
    buffer_free(&rows->shape[0]);
    buffer_free(&rows->shape[1]);
    buffer_free(&rows->push);
    buffer_free(&rows->apart);
    buffer_free(&rows->pool);
    buffer_free(&rows->weights);
    buffer_free(&rows->slices);
    buffer_free(&rows->density);
    buffer_free(&rows->gradient_sum);
    buffer_free(&rows->neighbour_counts);
    buffer_free(&rows->scratch);
}
