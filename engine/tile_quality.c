/* How much a tile or block is at rest: densities, symmetry of the neighbourhoods, balance of the pressures.
 */
#include "tile.h"

#include "dvec.h"
#include "tile_pairs.h"

#include <math.h>
#include <stdlib.h>

typedef struct Sums {
    uint32_t count;
    double density, density_sq, share, share_sq, nearest;
    double moment[3][3]; /* sum W d d^T */
} Sums;

/* Does point i have all the neighbours it would have in a larger body of water? */
static bool is_whole(const TilePairs *pairs, uint32_t i) {
    for (int k = 0; !pairs->periodic && k < 3; k++)
        if (pairs->position[i][k] < TILE_SUPPORT || pairs->position[i][k] > pairs->size[k] - TILE_SUPPORT)
            return false;
    return true;
}

/* Distance to the nearest neighbour, r; adds to the moment. */
static double add_neighbours(const TilePairs *pairs, uint32_t i, double moment[3][3]) {
    double nearest_sq = INFINITY;
    for (uint64_t e = pairs->first[i]; e < pairs->first[i] + pairs->used[i]; e++) {
        double arm[3];
        tile_pairs_vector(pairs, i, pairs->neighbour[e], arm);
        const double r_sq = dvec_dot(arm, arm);
        const double w = (double)kernel_w(&pairs->kernel, (float)sqrt(r_sq));
        nearest_sq = fmin(nearest_sq, r_sq);
        for (int a = 0; a < 3; a++)
            for (int b = 0; b < 3; b++)
                moment[a][b] += w * arm[a] * arm[b];
    }
    return sqrt(nearest_sq);
}

static double anisotropy(double moment[3][3]) {
    const double mean = (moment[0][0] + moment[1][1] + moment[2][2]) / 3.0;
    double largest = 0.0;
    for (int a = 0; a < 3; a++)
        for (int b = 0; b < 3; b++)
            largest = fmax(largest, fabs(moment[a][b] / mean - (a == b ? 1.0 : 0.0)));
    return largest;
}

static void add_point(const TilePairs *pairs, uint32_t i, const double *share, Sums *sums,
                      SkiffTileQuality *quality) {
    const double density = pairs->density[i];
    const double nearest = 0.5 * add_neighbours(pairs, i, sums->moment);
    sums->count++;
    sums->density += density;
    sums->density_sq += density * density;
    sums->share += share[i];
    sums->share_sq += share[i] * share[i];
    sums->nearest += nearest;
    quality->density_min = fmin(quality->density_min, density);
    quality->density_max = fmax(quality->density_max, density);
    quality->nearest_min = fmin(quality->nearest_min, nearest);
}

/* Root of the mean square and largest of h |v| over the whole points. */
static void measure_vectors(const TilePairs *pairs, double (*vector)[3], uint32_t whole, double *rms,
                            double *max) {
    double sum_sq = 0.0, longest_sq = 0.0;
    for (uint32_t i = 0; i < pairs->count; i++) {
        const double length_sq = dvec_dot(vector[i], vector[i]);
        if (!is_whole(pairs, i))
            continue;
        sum_sq += length_sq;
        longest_sq = fmax(longest_sq, length_sq);
    }
    *rms = TILE_SUPPORT * sqrt(sum_sq / whole);
    *max = TILE_SUPPORT * sqrt(longest_sq);
}

static bool measure(const RestTile *tile, TilePairs *pairs, double *share, double (*vector)[3],
                    SkiffTileQuality *quality, Err *err) {
    Sums sums = {0};
    for (uint32_t i = 0; i < tile->count; i++) {
        dvec_from_float(pairs->position[i], tile->position[i]);
        share[i] = (double)tile->share[i];
    }
    if (!tile_pairs_update(pairs, err))
        return false;
    *quality = (SkiffTileQuality){.density_min = INFINITY, .nearest_min = INFINITY};
    double volume = 1.0;
    for (int k = 0; k < 3; k++)
        volume *=
            (pairs->periodic ? 1.0 : fmax(0.0, 1.0 - 2.0 * TILE_SUPPORT / pairs->size[k])) * pairs->size[k];
    for (uint32_t i = 0; i < pairs->count; i++)
        if (is_whole(pairs, i))
            add_point(pairs, i, share, &sums, quality);
    if (sums.count < 2)
        return err_set(
            err, ERR_INPUT,
            "the block of %g x %g x %g r has no inside: %d r from its faces neighbours are missing",
            pairs->size[0], pairs->size[1], pairs->size[2], TILE_SUPPORT);
    const double n = sums.count;
    quality->count = sums.count;
    quality->number_density = 8.0 * n / volume;
    quality->density_mean = sums.density / n;
    quality->density_sd =
        sqrt(fmax(0.0, sums.density_sq / n - quality->density_mean * quality->density_mean));
    quality->share_sd = sqrt(fmax(0.0, sums.share_sq / n - sums.share / n * sums.share / n));
    quality->nearest_mean = sums.nearest / n;
    quality->anisotropy = anisotropy(sums.moment);
    tile_pairs_gradient(pairs, NULL, vector);
    measure_vectors(pairs, vector, sums.count, &quality->gradient_rms, &quality->gradient_max);
    tile_pairs_gradient(pairs, share, vector);
    measure_vectors(pairs, vector, sums.count, &quality->force_rms, &quality->force_max);
    return true;
}

bool tile_measure(const RestTile *tile, int threads, SkiffTileQuality *quality, Err *err) {
    TilePairs pairs;
    double *share = calloc((size_t)tile->count + 1, sizeof *share);
    double(*vector)[3] = calloc((size_t)tile->count + 1, sizeof *vector);
    bool good = tile_pairs_init(&pairs, tile->count, threads, err);
    if (good && (!share || !vector))
        good = err_set(err, ERR_INPUT, "no memory to measure %u points", tile->count);
    pairs.periodic = tile->periodic;
    pairs.volume = 8.0 * tile->volume_factor;
    dvec_from_float(pairs.size, tile->size);
    good = good && measure(tile, &pairs, share, vector, quality, err);
    tile_pairs_free(&pairs);
    free(share);
    free(vector);
    return good;
}
