/* Neighbour search in a periodic or finite box, and the sums sum_j V W and sum_j V grad W.
 *
 * Candidates are searched in cells and kept while no point has moved farther than half of what the search
 * reached beyond the support radius [Verlet 1967]: a relaxation searches in one of twenty iterations. Points
 * gather, so the sums do not depend on the number of threads. Not used in a simulation's steps: rows.h is for
 * those. */
#include "tile_pairs.h"

#include "cell_grid.h"
#include "dvec.h"

#include <stdlib.h>
#include <string.h>

static const double skin = 0.4; /* what a search reaches beyond the support radius, r */

/* Of a box, which they divide into equal parts: a periodic one has no place for layers around or for a width
 * of the cells' own, as a CellGrid has. */
typedef struct Cells {
    int64_t counts[3];
    uint32_t *start, *member; /* members of cell c: member[start[c]] .. member[start[c + 1]] */
    uint32_t *cell_of;
} Cells;

bool tile_pairs_init(TilePairs *pairs, uint32_t count, int threads, Err *err) {
    *pairs = (TilePairs){.count = count, .threads = threads, .kernel = kernel_make(TILE_SUPPORT)};
    pairs->position = calloc((size_t)count + 1, sizeof *pairs->position);
    pairs->searched = calloc((size_t)count + 1, sizeof *pairs->searched);
    pairs->density = calloc((size_t)count + 1, sizeof *pairs->density);
    pairs->first = calloc((size_t)count + 1, sizeof *pairs->first);
    pairs->used = calloc((size_t)count + 1, sizeof *pairs->used);
    if (pairs->position && pairs->searched && pairs->density && pairs->first && pairs->used)
        return true;
    return err_set(err, ERR_INPUT, "no memory for the neighbours of %u points", count);
}

void tile_pairs_free(TilePairs *pairs) {
    free(pairs->position);
    free(pairs->searched);
    free(pairs->density);
    free(pairs->first);
    free(pairs->used);
    free(pairs->candidate);
    free(pairs->neighbour);
    free(pairs->gradient);
    *pairs = (TilePairs){0};
}

void tile_pairs_vector(const TilePairs *pairs, uint32_t i, uint32_t j, double out[3]) {
    dvec_sub(out, pairs->position[i], pairs->position[j]);
    for (int k = 0; pairs->periodic && k < 3; k++)
        out[k] -= pairs->size[k] * nearbyint(out[k] / pairs->size[k]);
}

/* ---- Search ---- */

static void cell_coordinates(const TilePairs *pairs, const Cells *cells, uint32_t i, int64_t at[3]) {
    for (int k = 0; k < 3; k++) {
        const int64_t cell =
            (int64_t)floor(pairs->position[i][k] / pairs->size[k] * (double)cells->counts[k]);
        at[k] = cell < 0 ? 0 : cell >= cells->counts[k] ? cells->counts[k] - 1 : cell;
    }
}

static uint32_t cell_index(const Cells *cells, const int64_t at[3]) {
    return (uint32_t)((at[0] * cells->counts[1] + at[1]) * cells->counts[2] + at[2]);
}

/* Sorts the points into cells at least as wide as the search reaches. */
static bool sort_cells(TilePairs *pairs, Cells *cells, Err *err) {
    for (int k = 0; k < 3; k++) {
        double *size = &pairs->size[k];
        for (uint32_t i = 0; pairs->periodic && i < pairs->count; i++) {
            double *x = &pairs->position[i][k];
            *x -= *size * floor(*x / *size);
        }
        const double reach = (double)TILE_SUPPORT + skin;
        cells->counts[k] = (int64_t)fmin(fmax(floor(*size / reach), 1.0), 500.0);
    }
    const size_t total = (size_t)(cells->counts[0] * cells->counts[1] * cells->counts[2]);
    cells->start = malloc((total + 1) * sizeof *cells->start);
    cells->member = malloc(((size_t)pairs->count + 1) * sizeof *cells->member);
    cells->cell_of = malloc(((size_t)pairs->count + 1) * sizeof *cells->cell_of);
    if (!cells->start || !cells->member || !cells->cell_of)
        return err_set(err, ERR_INPUT, "no memory to search the neighbours of %u points", pairs->count);
    for (uint32_t i = 0; i < pairs->count; i++) {
        int64_t at[3];
        cell_coordinates(pairs, cells, i, at);
        cells->cell_of[i] = cell_index(cells, at);
    }
    cell_grid_sort(cells->cell_of, pairs->count, total, cells->start, cells->member);
    return true;
}

/* The cells around a cell, each once: fewer than three along an axis are all neighbours of each other. */
static int near_cells(const TilePairs *pairs, const Cells *cells, const int64_t at[3], uint32_t out[27]) {
    int64_t list[3][3];
    int counts[3];
    for (int k = 0; k < 3; k++) {
        counts[k] = 0;
        for (int64_t step = -1; step <= 1; step++) {
            int64_t cell = at[k] + step;
            if (pairs->periodic)
                cell = (cell + cells->counts[k]) % cells->counts[k];
            bool seen = cell < 0 || cell >= cells->counts[k];
            for (int n = 0; n < counts[k]; n++)
                seen = seen || list[k][n] == cell;
            if (!seen)
                list[k][counts[k]++] = cell;
        }
    }
    int count = 0;
    for (int a = 0; a < counts[0]; a++)
        for (int b = 0; b < counts[1]; b++)
            for (int c = 0; c < counts[2]; c++)
                out[count++] = cell_index(cells, (int64_t[]){list[0][a], list[1][b], list[2][c]});
    return count;
}

/* Candidates of point i: written to `out` unless that is NULL. */
static uint32_t find_candidates(const TilePairs *pairs, const Cells *cells, uint32_t i, uint32_t *out) {
    const double reach = (double)TILE_SUPPORT + skin;
    uint32_t near[27], count = 0;
    int64_t at[3];
    cell_coordinates(pairs, cells, i, at);
    const int near_count = near_cells(pairs, cells, at, near);
    for (int n = 0; n < near_count; n++)
        for (uint32_t m = cells->start[near[n]]; m < cells->start[near[n] + 1]; m++) {
            const uint32_t j = cells->member[m];
            double arm[3];
            tile_pairs_vector(pairs, i, j, arm);
            if (j == i || dvec_dot(arm, arm) >= reach * reach)
                continue;
            if (out)
                out[count] = j;
            count++;
        }
    return count;
}

static bool reserve_entries(TilePairs *pairs, uint64_t count, Err *err) {
    if (count <= pairs->capacity)
        return true;
    pairs->capacity = count + count / 8;
    free(pairs->candidate);
    free(pairs->neighbour);
    free(pairs->gradient);
    pairs->candidate = malloc(pairs->capacity * sizeof *pairs->candidate);
    pairs->neighbour = malloc(pairs->capacity * sizeof *pairs->neighbour);
    pairs->gradient = malloc(pairs->capacity * sizeof *pairs->gradient);
    if (pairs->candidate && pairs->neighbour && pairs->gradient)
        return true;
    return err_set(err, ERR_INPUT, "no memory for %llu neighbours", (unsigned long long)count);
}

static bool search_cells(TilePairs *pairs, const Cells *cells, Err *err) {
    const int64_t count = pairs->count;
#pragma omp parallel for schedule(static) num_threads(pairs->threads)
    for (int64_t i = 0; i < count; i++)
        pairs->first[i + 1] = find_candidates(pairs, cells, (uint32_t)i, NULL);
    pairs->first[0] = 0;
    for (int64_t i = 0; i < count; i++)
        pairs->first[i + 1] += pairs->first[i];
    if (!reserve_entries(pairs, pairs->first[count], err))
        return false;
#pragma omp parallel for schedule(static) num_threads(pairs->threads)
    for (int64_t i = 0; i < count; i++)
        find_candidates(pairs, cells, (uint32_t)i, pairs->candidate + pairs->first[i]);
    memcpy(pairs->searched, pairs->position, (size_t)count * sizeof *pairs->position);
    return true;
}

static bool search(TilePairs *pairs, Err *err) {
    Cells cells = {0};
    const bool good = sort_cells(pairs, &cells, err) && search_cells(pairs, &cells, err);
    free(cells.start);
    free(cells.member);
    free(cells.cell_of);
    return good;
}

static bool must_search(const TilePairs *pairs) {
    if (pairs->capacity == 0)
        return true;
    for (uint32_t i = 0; i < pairs->count; i++)
        if (dvec_distance_sq(pairs->position[i], pairs->searched[i]) > 0.25 * skin * skin)
            return true;
    return false;
}

/* ---- Sums ---- */

static void evaluate(TilePairs *pairs, uint32_t i) {
    const uint64_t first = pairs->first[i];
    uint32_t used = 0;
    double sum = (double)pairs->kernel.w_scale;
    for (uint64_t e = first; e < pairs->first[i + 1]; e++) {
        double arm[3];
        tile_pairs_vector(pairs, i, pairs->candidate[e], arm);
        const double r = dvec_length(arm);
        if (r >= (double)TILE_SUPPORT)
            continue;
        const double factor = pairs->volume * kernel_gradient_factor(&pairs->kernel, r);
        sum += (double)kernel_w(&pairs->kernel, (float)r);
        pairs->neighbour[first + used] = pairs->candidate[e];
        for (int k = 0; k < 3; k++)
            pairs->gradient[first + used][k] = factor * arm[k];
        used++;
    }
    pairs->used[i] = used;
    pairs->density[i] = pairs->volume * sum;
}

bool tile_pairs_update(TilePairs *pairs, Err *err) {
    if (must_search(pairs) && !search(pairs, err))
        return false;
    const int64_t count = pairs->count;
#pragma omp parallel for schedule(static) num_threads(pairs->threads)
    for (int64_t i = 0; i < count; i++)
        evaluate(pairs, (uint32_t)i);
    return true;
}

void tile_pairs_gradient(const TilePairs *pairs, const double *weight, double (*out)[3]) {
    const int64_t count = pairs->count;
#pragma omp parallel for schedule(static) num_threads(pairs->threads)
    for (int64_t i = 0; i < count; i++) {
        double sum[3] = {0};
        for (uint64_t e = pairs->first[i]; e < pairs->first[i] + pairs->used[i]; e++) {
            const double share = weight ? 0.5 * (weight[i] + weight[pairs->neighbour[e]]) : 1.0;
            dvec_add_scaled(sum, sum, share, pairs->gradient[e]);
        }
        dvec_copy(out[i], sum);
    }
}
