/* Relaxes random points of a periodic cube to water at rest.
 *
 * Rest means two things. Every density is rest density, as the pressure solver would otherwise move points
 * until it is; and there are pressures, much the same everywhere, under which no point is pushed. Both hold
 * at a minimum of the mean density among the arrangements of equal densities. Its conditions, sum_j V (s_i +
 * s_j) grad W_ij = 0,    rho_i = rho0, have the pressure shares s as multipliers, which the method of
 * multipliers [Hestenes 1969] finds: FIRE [Bitzek et al. 2006] lowers sum_i m_i rho_i + b / 2 (rho_i -
 * mean)^2, whose force has s_i = m_i + b (rho_i - mean), and every so often these become the new m_i. A
 * penalty alone (m_i = 1 throughout) leaves a spread of 1 % / b^(2/3). Packing by the concentration gradient
 * [Colagrossi et al. 2012] is the case b = 0, and the beginning here.
 *
 * The box is scaled to mean density 1 along the way. Doubles throughout, rounded to float32 once at the end.
 * Serial but for the sums over neighbours. */
#include "tile.h"

#include "base/random.h"
#include "dvec.h"
#include "tile_pairs.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
    PACKING = 300, /* iterations without a stiffness */
    ROUND = 100,   /* iterations between changes of multipliers and scale */
    STEADY = 5     /* iterations downhill before FIRE lengthens its step */
};

static const double stiffness = 100.0;                                           /* b */
static const double points_per_volume = 1.0050;                                  /* times d^3 / V */
static const double first_step = 0.05, longest_step = 0.5, shortest_step = 1e-4; /* the force is a length */
static const double first_mix = 0.1;
static const double longest_move = 0.16;      /* of an iteration, r */
static const double density_tolerance = 1e-4; /* largest spread that counts as rest */
static const double force_goal = 1e-6;        /* nothing to gain below: h |F|, of gradients of order 1 */

typedef struct Relaxation {
    TilePairs pairs;
    double (*velocity)[3], (*force)[3]; /* r, masses and times being numbers */
    double *multiplier, *share;
    double step, mix; /* FIRE's time step, and how much velocities turn towards the forces */
    int downhill;     /* iterations since velocities last pointed uphill */
    double density_mean, density_sd, force_max;
} Relaxation;

SkiffTileDef skiff_tile_def_default(void) {
    return (SkiffTileDef){.edge = 12.0, .volume_factor = 0.8, .seed = 1, .iterations = 6000};
}

/* ---- Beginning ---- */

static bool check_def(const SkiffTileDef *def, Err *err) {
    /* Below 5 d a point would be its own neighbour's neighbour from both sides of the box. */
    if (!(def->edge >= 6.0 && def->edge <= 64.0))
        return err_set(err, ERR_INPUT, "edge of the tile: %g d, allowed 6 to 64 d", def->edge);
    if (!(def->volume_factor >= 0.5 && def->volume_factor <= 1.5))
        return err_set(err, ERR_INPUT, "volume factor of the tile: %g, allowed 0.5 to 1.5",
                       def->volume_factor);
    if (def->iterations < 1 || def->threads < 1)
        return err_set(err, ERR_INPUT, "tile: %d iterations on %d threads, at least 1 of each",
                       def->iterations, def->threads);
    return true;
}

static bool begin(Relaxation *relax, const SkiffTileDef *def, Err *err) {
    const double count = round(points_per_volume / def->volume_factor * def->edge * def->edge * def->edge);
    TilePairs *pairs = &relax->pairs;
    if (!tile_pairs_init(pairs, (uint32_t)count, def->threads, err))
        return false;
    relax->velocity = calloc(pairs->count, sizeof *relax->velocity);
    relax->force = calloc(pairs->count, sizeof *relax->force);
    relax->multiplier = calloc(pairs->count, sizeof *relax->multiplier);
    relax->share = calloc(pairs->count, sizeof *relax->share);
    if (!relax->velocity || !relax->force || !relax->multiplier || !relax->share)
        return err_set(err, ERR_INPUT, "no memory for a tile of %u points", pairs->count);
    pairs->periodic = true;
    pairs->volume = 8.0 * def->volume_factor;
    for (int k = 0; k < 3; k++)
        pairs->size[k] = 2.0 * def->edge;
    for (uint32_t i = 0; i < pairs->count; i++) {
        relax->multiplier[i] = 1.0;
        for (int k = 0; k < 3; k++)
            pairs->position[i][k] = random_share(def->seed, 3 * (uint64_t)i + (uint64_t)k) * pairs->size[k];
    }
    relax->step = first_step;
    relax->mix = first_mix;
    return true;
}

static void end(Relaxation *relax) {
    tile_pairs_free(&relax->pairs);
    free(relax->velocity);
    free(relax->force);
    free(relax->multiplier);
    free(relax->share);
}

/* ---- Relaxing ---- */

static bool find_densities(Relaxation *relax, Err *err) {
    const uint32_t count = relax->pairs.count;
    const double *density = relax->pairs.density;
    if (!tile_pairs_update(&relax->pairs, err))
        return false;
    double sum = 0.0, sum_sq = 0.0;
    for (uint32_t i = 0; i < count; i++)
        sum += density[i];
    relax->density_mean = sum / count;
    for (uint32_t i = 0; i < count; i++)
        sum_sq += (density[i] - relax->density_mean) * (density[i] - relax->density_mean);
    relax->density_sd = sqrt(sum_sq / count);
    return true;
}

/* The mean of the multipliers stays 1: deviations from the mean density sum to 0. */
static void find_shares(Relaxation *relax, double b) {
    for (uint32_t i = 0; i < relax->pairs.count; i++)
        relax->share[i] = relax->multiplier[i] + b * (relax->pairs.density[i] - relax->density_mean);
}

static void find_forces(Relaxation *relax) {
    const double support = TILE_SUPPORT;
    double longest_sq = 0.0;
    tile_pairs_gradient(&relax->pairs, relax->share, relax->force);
    for (uint32_t i = 0; i < relax->pairs.count; i++) {
        double *force = relax->force[i];
        longest_sq = fmax(longest_sq, dvec_dot(force, force));
        dvec_set(force, -support * support * force[0], -support * support * force[1],
                 -support * support * force[2]);
    }
    relax->force_max = support * sqrt(longest_sq);
}

static void scale(Relaxation *relax) {
    const double factor = cbrt(relax->density_mean);
    for (int k = 0; k < 3; k++)
        relax->pairs.size[k] *= factor;
    for (uint32_t i = 0; i < relax->pairs.count; i++)
        for (int k = 0; k < 3; k++)
            relax->pairs.position[i][k] *= factor;
}

/* One step of FIRE. */
static void move(Relaxation *relax) {
    const uint32_t count = relax->pairs.count;
    double power = 0.0, speed_sq = 0.0, force_sq = 0.0;
    for (uint32_t i = 0; i < count; i++)
        power += dvec_dot(relax->force[i], relax->velocity[i]);
    if (power > 0.0) {
        if (++relax->downhill > STEADY) {
            relax->step = fmin(1.1 * relax->step, longest_step);
            relax->mix *= 0.99;
        }
    } else {
        relax->downhill = 0;
        relax->step = fmax(0.5 * relax->step, shortest_step);
        relax->mix = first_mix;
        memset(relax->velocity, 0, count * sizeof *relax->velocity);
    }
    for (uint32_t i = 0; i < count; i++) {
        double *velocity = relax->velocity[i];
        dvec_add_scaled(velocity, velocity, relax->step, relax->force[i]);
        speed_sq += dvec_dot(velocity, velocity);
        force_sq += dvec_dot(relax->force[i], relax->force[i]);
    }
    const double turn = force_sq > 0.0 ? relax->mix * sqrt(speed_sq / force_sq) : 0.0;
    for (uint32_t i = 0; i < count; i++) {
        double *velocity = relax->velocity[i], *position = relax->pairs.position[i];
        dvec_set(velocity, (1.0 - relax->mix) * velocity[0], (1.0 - relax->mix) * velocity[1],
                 (1.0 - relax->mix) * velocity[2]);
        dvec_add_scaled(velocity, velocity, turn, relax->force[i]);
        const double length = relax->step * dvec_length(velocity);
        const double cut = length > longest_move ? longest_move / length : 1.0;
        dvec_add_scaled(position, position, cut * relax->step, velocity);
    }
}

static bool relax_points(Relaxation *relax, int iterations, Err *err) {
    for (int iteration = 0; iteration < iterations; iteration++) {
        const double b = iteration < PACKING ? 0.0 : stiffness;
        if (!find_densities(relax, err))
            return false;
        if (iteration > PACKING && iteration % ROUND == 0) {
            find_shares(relax, b);
            memcpy(relax->multiplier, relax->share, relax->pairs.count * sizeof *relax->multiplier);
            scale(relax);
            if (!find_densities(relax, err))
                return false;
        }
        find_shares(relax, b);
        find_forces(relax);
        if (b > 0.0 && relax->force_max < force_goal && relax->density_sd < 0.01 * density_tolerance)
            break;
        move(relax);
    }
    scale(relax);
    return find_densities(relax, err);
}

/* ---- Result ---- */

/* Rounds to float32, into [0, size). */
static void round_points(const Relaxation *relax, RestTile *tile) {
    for (int k = 0; k < 3; k++)
        tile->size[k] = (float)relax->pairs.size[k];
    for (uint32_t i = 0; i < tile->count; i++) {
        for (int k = 0; k < 3; k++) {
            const double size = relax->pairs.size[k], x = relax->pairs.position[i][k];
            const float rounded = (float)(x - size * floor(x / size));
            tile->position[i][k] = rounded < tile->size[k] ? rounded : 0.0f;
        }
        tile->share[i] = (float)relax->share[i];
    }
}

bool tile_make(const SkiffTileDef *def, RestTile *tile, Err *err) {
    *tile = (RestTile){0};
    if (!check_def(def, err))
        return false;
    Relaxation relax = {0};
    bool good = begin(&relax, def, err) && relax_points(&relax, def->iterations, err);
    if (good && !(relax.density_sd <= density_tolerance))
        good = err_set(
            err, ERR_INPUT,
            "the tile is not at rest after %d iterations: its densities spread by %.3g %%, at most %g %% "
            "is rest; allow more iterations",
            def->iterations, 100.0 * relax.density_sd, 100.0 * density_tolerance);
    good = good && tile_init(tile, relax.pairs.count, err);
    if (good) {
        tile->periodic = true;
        tile->volume_factor = def->volume_factor;
        round_points(&relax, tile);
    }
    end(&relax);
    return good;
}
