/* Pressure solves: the operator, and two ways to invert it.
 *
 * Unknown: P_i = p_i dt^2 / rho0 >= 0 (m^2). With V gradW_ij packed in the rows, G_i = sum_j V gradW_ij +
 * g_i, D the divergence and D^T its transpose: velocity change  -(D^T P)_i / dt,  (D^T P)_i = P_i G_i + sum_j
 * P_j V gradW_ij; density change in one step, relative to rho0:  dt (D v)_i = dt (v_i . G_i - sum_j v_j . V
 * gradW_ij - sum_b v_b . g_ib - omega_b . t_ib). A = D D^T is symmetric positive semidefinite. A body takes
 * part as six more unknown velocities: it answers a pressure field by
 * -(m / M) sum_i P_i g_ib and -m I^-1 sum_i P_i t_ib, which keeps A symmetric and couples light bodies
 * without substeps.
 *
 * Density solve: gamma (rho / rho0 - 1) + dt D v - A P <= 0, P >= 0, and zero where P > 0. gamma < 1 corrects
 * a density error over about 1 / gamma steps: with 1 a residual comes back doubled in the next step, once
 * through the density and once through the velocity, and every step has to work it off again. Divergence
 * solve: the same with dt D v alone.
 *
 * Split: water at rest that is solved so is a glass. Every density is a constraint of its own, a smooth flow
 * through disordered particles breaks them all a little, and what mends them works against the pressure: a
 * slow vortex stops and turns back. So velocities get the pressure by gradients that are right for linear
 * fields, on which a smooth flow without divergence does no work, and the densities are mended by moving the
 * particles without their velocities (the same solve with the density's own gradients; where there is
 * pressure it may pull as well as push). Bodies do not answer the second.
 *
 * gcr: conjugate residuals (GCR with one direction kept) preconditioned by the diagonal, on the set where P >
 * 0 or the residual is positive, projected to P >= 0 after each step. jacobi: relaxed Jacobi as in the
 * papers, compression only. Both count applications of A. */
#include "dfsph.h"

#include <float.h>
#include <math.h>

/* Diagonals below this belong to particles without a neighbour to push. */
static const float MIN_DIAGONAL = 1e-6f;
/* Water thinner than this, of rest, starts a solve without pressure. Two drops that barely touch have a tiny
 * diagonal: the first step would cut the pressures of both by a huge amount, of which each one's residual
 * knows only its own, and they went apart at thousands of m/s by the rest. */
static const float THIN = 0.5f;
/* Marks of a slice where nothing is held. */
static const uint8_t NONE_HELD[SLICE];
/* The divergence solve leaves out particles with fewer neighbours: spray has no divergence to speak of. */
enum { MIN_NEIGHBOURS = 20 };
/* The two-sided residual goes this far below the one-sided tolerance, so that the usual error, measured at
 * the next step, keeps it. `motion` is that of the water in spacings a step. In a flow the motion's curved
 * part is most of the error anyway. In still water what is left over stays where it is, and forces on the
 * floor flicker with it; in water stiller than a settled tank a column would breathe within the tolerance,
 * and there it costs one iteration to say no. */
static double safety(double motion) {
    static const double knots[][2] = {{0.0008, 0.15}, {0.0014, 0.4}, {0.002, 0.4}, {0.02, 0.75}};
    enum { COUNT = sizeof knots / sizeof knots[0] };
    for (int k = 1; k < COUNT; k++)
        if (motion < knots[k][0]) {
            const double share = (motion - knots[k - 1][0]) / (knots[k][0] - knots[k - 1][0]);
            return knots[k - 1][1] + (knots[k][1] - knots[k - 1][1]) * (share > 0.0 ? share : 0.0);
        }
    return knots[COUNT - 1][1];
}

/* Of the solves that only prepare another. */
static const double STEADY_SAFETY = 0.4;

bool dfsph_reserve(Dfsph *dfsph, uint32_t particle_capacity, uint32_t object_count, Err *err) {
    const size_t padded = particle_capacity + BLOCK, blocks = padded / BLOCK;
    const size_t bytes = padded * (3 * sizeof(Float4) + 7 * sizeof(float)) +
                         blocks * (DFSPH_SUMS * sizeof(double) + 1) +
                         (size_t)object_count * 2 * sizeof *dfsph->response;
    if (!buffer_reserve(&dfsph->buffer, "pressure solver", bytes, err))
        return false;
    char *next = dfsph->buffer.data;
#define TAKE(field, count) (dfsph->field = (void *)next, next += (count) * sizeof *dfsph->field)
    TAKE(guess, padded);
    TAKE(answer, padded);
    TAKE(spare, padded);
    TAKE(partials, blocks * DFSPH_SUMS);
    TAKE(impulses, object_count);
    TAKE(response, object_count);
    TAKE(residual, padded);
    TAKE(direction, padded);
    TAKE(image, padded);
    TAKE(new_image, padded);
    TAKE(inv_diagonal, padded);
    TAKE(source, padded);
    TAKE(lower, padded);
    TAKE(still, blocks);
#undef TAKE
    return true;
}

void dfsph_free(Dfsph *dfsph) {
    buffer_free(&dfsph->buffer);
}

/* ---- Sums ---- */

/* Sixteen running sums, added up in a fixed order: the same whatever the register width. */
typedef struct LaneSum {
    float lane[LANES];
} LaneSum;

static double lane_total(const LaneSum *sum) {
    double total = 0.0;
    for (int l = 0; l < LANES; l++)
        total += (double)sum->lane[l];
    return total;
}

static void total_partials(const Dfsph *dfsph, uint32_t blocks, int count, double *totals) {
    for (int k = 0; k < count; k++)
        totals[k] = 0.0;
    for (uint32_t block = 0; block < blocks; block++)
        for (int k = 0; k < count; k++)
            totals[k] += dfsph->partials[block * DFSPH_SUMS + (uint32_t)k];
}

#define EACH_BLOCK                                                                                           \
    _Pragma(                                                                                                 \
        "omp parallel for schedule(dynamic, DFSPH_CHUNK) num_threads(problem->threads)") for (uint32_t       \
                                                                                                  block = 0; \
                                                                                              block <        \
                                                                                              blocks;        \
                                                                                              block++)
#define EACH_SLICE for (uint32_t first = block * BLOCK; first < (block + 1) * BLOCK; first += SLICE)
#define EACH_LANE  _Pragma("omp simd") for (uint32_t l = 0; l < LANES; l++)

/* ---- The operator ---- */

/* What is held answers no pressure: result = base for it. Few slices hold any, which one comparison tells. */
static void hold_block(const uint8_t *held, const PairData *pairs, const AccelerateJob *job, uint32_t block) {
    EACH_SLICE {
        if (memcmp(held + first, NONE_HELD, SLICE) == 0)
            continue;
        for (uint32_t i = first; i < first + SLICE; i++) {
            if (!held[i])
                continue;
            memset(job->result[i], 0, sizeof(Float4));
            if (job->base == NULL)
                continue; /* the usual case: no position is fetched */
            memcpy(job->result[i], job->base[i], 3 * sizeof(float));
            job->result[i][3] = vector_moment(pairs, pairs->position[i], job->result[i]);
        }
    }
}

/* The operand of D^T becomes p, and what the divergence solve has found beside it. */
static void set_operand(Dfsph *dfsph, const DfsphProblem *problem, const float *p) {
    const uint32_t blocks = particles_blocks(problem->particles);
    const float *carried = dfsph->carried;
    EACH_BLOCK {
        for (uint32_t i = block * BLOCK; i < (block + 1) * BLOCK; i++)
            dfsph->operand[i][3] = carried != NULL ? p[i] + carried[i] : p[i];
    }
}

/* result = base + push + scale D^T p for the fluid, response = D^T p for the bodies; p is the operand's. base
 * NULL: 0, and no push. */
static void apply_transpose(Dfsph *dfsph, const DfsphProblem *problem, const Float4 *base, float scale,
                            Float4 *result) {
    const uint32_t blocks = particles_blocks(problem->particles);
    const PairData *pairs = dfsph->pairs;
    const AccelerateJob job = {.operand = (const Float4 *)dfsph->operand,
                               .base = base,
                               .push = {dfsph->push[0], dfsph->push[1], dfsph->push[2]},
                               .scale = scale,
                               .result = result};
    EACH_BLOCK {
        if (base == NULL && dfsph->still[block])
            continue;
        problem->passes->accelerate(pairs, &job, block);
        if (problem->held != NULL)
            hold_block(problem->held, pairs, &job, block);
    }
    if (!dfsph->moving || !dfsph->answering)
        return;
    boundary_impulse(problem->boundary, &dfsph->operand[0][3], 4, blocks, dfsph->impulses, problem->threads);
    const double mass = (double)pairs->volume * (double)problem->params->rest_density;
    for (int b = 0; b < problem->body_count; b++) {
        const double *impulse = dfsph->impulses[1 + b];
        double *answer = dfsph->response[1 + b];
        matrix_times((const double(*)[3])problem->bodies[b].inv_inertia, impulse + 3, answer + 3);
        for (int k = 0; k < 3; k++) {
            answer[k] = -mass * problem->bodies[b].inv_mass[k] * impulse[k];
            answer[3 + k] *= -mass;
        }
    }
}

/* Takes the motion of walls and bodies out of a divergence: velocities[object] = (v, omega). */
static void subtract_bodies(const Boundary *boundary, const double (*velocities)[6], float *result,
                            uint32_t block) {
    const ContactSpan span = boundary->spans[block];
    for (uint32_t c = span.start; c < span.start + span.count; c++) {
        const Contact *contact = &boundary->contacts[c];
        if (contact->object == 0)
            continue;
        const double *v = velocities[contact->object];
        double sum = 0.0;
        for (int k = 0; k < 3; k++)
            sum += v[k] * (double)contact->g[k] + v[3 + k] * (double)contact->t[k];
        result[contact->particle] -= (float)sum;
    }
}

static void divergence_block(const Dfsph *dfsph, const DfsphProblem *problem, const Float4 *v,
                             const double (*velocities)[6], float *result, uint32_t block) {
    problem->passes->divergence(dfsph->pairs, v, result, block);
    if (dfsph->moving)
        subtract_bodies(problem->boundary, velocities, result, block);
}

/* result = velocity + push - D^T p / dt, p the operand's and standing water's; the bodies' share stays in
 * `response`. */
static void apply_pressure(Dfsph *dfsph, const DfsphProblem *problem, Float4 *result) {
    apply_transpose(dfsph, problem, dfsph->base, -1.0f / problem->params->time_step, result);
}

/* Velocities of the bodies after the pressure so far. */
static void body_velocities(const Dfsph *dfsph, const DfsphProblem *problem, double (*velocities)[6]) {
    const double scale = 1.0 / (double)problem->params->time_step;
    for (int b = 0; b < problem->body_count; b++)
        for (int k = 0; k < 3; k++) {
            velocities[1 + b][k] = problem->bodies[b].velocity[k] - scale * dfsph->response[1 + b][k];
            velocities[1 + b][3 + k] =
                problem->bodies[b].angular_velocity[k] - scale * dfsph->response[1 + b][3 + k];
        }
}

/* The fluid's velocities after the solve, by the pressure itself. (The answers of the iterations add up to
 * the same at less cost, but for what the projection cut: with that in their velocities lone drops fly
 * apart.) What is held is kept out by way of a copy: the passes write whole blocks. */
static void change_velocities(Dfsph *dfsph, const DfsphProblem *problem) {
    Float4 *velocity = problem->particles->velocity;
    if (problem->held == NULL) {
        apply_pressure(dfsph, problem, velocity);
        return;
    }
    apply_pressure(dfsph, problem, dfsph->guess);
#pragma omp parallel for schedule(static) num_threads(problem->threads)
    for (uint32_t i = 0; i < problem->particles->count; i++)
        if (!problem->held[i])
            memcpy(velocity[i], dfsph->guess[i], sizeof(Float4));
}

/* ---- Residuals ---- */

typedef struct Errors {
    double one_sided, two_sided;
} Errors;

static inline void error_lanes(const float *residual, const float *p, const float *lower, LaneSum *one,
                               LaneSum *two) {
    EACH_LANE {
        const float positive = residual[l] > 0.0f ? residual[l] : 0.0f;
        const float negative = residual[l] < 0.0f && p[l] > lower[l] ? -residual[l] : 0.0f;
        one->lane[l] += positive;
        two->lane[l] += positive + negative;
    }
}

/* z, the search direction of a particle with pressure or to get some, is the operand of the next
 * application. */
static inline void precondition_lanes(const float *residual, const float *p, const float *lower,
                                      const float *inv_diagonal, Float4 *operand) {
    EACH_LANE operand[l][3] = p[l] > lower[l] || residual[l] > 0.0f ? residual[l] * inv_diagonal[l] : 0.0f;
}

static inline const float *lower_of(const Dfsph *dfsph, uint32_t first) {
    return dfsph->lower + (dfsph->shifting ? first : 0);
}

/* Held pressures act where P itself is applied; along the directions of a solve nothing of them changes, and
 * a block that is all held is left out. */
static void still_block(Dfsph *dfsph, uint32_t block) {
    const size_t first = (size_t)block * BLOCK;
    for (size_t i = first; i < first + BLOCK; i++)
        dfsph->operand[i][3] = 0.0f;
    memset(dfsph->residual + first, 0, BLOCK * sizeof(float));
    memset(dfsph->answer + first, 0, BLOCK * sizeof(Float4));
    memset(dfsph->partials + (size_t)block * DFSPH_SUMS, 0, DFSPH_SUMS * sizeof(double));
}

/* residual = source + dt D (v - D^T p / dt), and what follows from it; p is the operand's. One application of
 * A. */
static Errors evaluate_residual(Dfsph *dfsph, const DfsphProblem *problem, const float *p) {
    const uint32_t blocks = particles_blocks(problem->particles);
    apply_pressure(dfsph, problem, dfsph->guess);
    double(*velocities)[6] = dfsph->impulses; /* no longer needed */
    if (dfsph->moving)
        body_velocities(dfsph, problem, velocities);
    const float dt = problem->params->time_step;
    float *residual = dfsph->residual;
    EACH_BLOCK {
        if (dfsph->still[block]) {
            still_block(dfsph, block);
            continue;
        }
        divergence_block(dfsph, problem, (const Float4 *)dfsph->guess, (const double(*)[6])velocities,
                         residual, block);
        LaneSum one = {0}, two = {0};
        EACH_SLICE {
            EACH_LANE {
                const uint32_t i = first + l;
                const float r = dfsph->source[i] + dt * residual[i];
                residual[i] = dfsph->inv_diagonal[i] > 0.0f ? r : 0.0f;
            }
            const float *lower = lower_of(dfsph, first);
            error_lanes(residual + first, p + first, lower, &one, &two);
            precondition_lanes(residual + first, p + first, lower, dfsph->inv_diagonal + first,
                               dfsph->operand + first);
        }
        dfsph->partials[block * DFSPH_SUMS] = lane_total(&one);
        dfsph->partials[block * DFSPH_SUMS + 1] = lane_total(&two);
    }
    double totals[2];
    total_partials(dfsph, blocks, 2, totals);
    const double count = problem->evaluated_count;
    return (Errors){totals[0] / count, totals[1] / count};
}

/* Water that has just been set free (particles.inl) takes this long to correct its density as fast as other
 * water, s: others have crowded it while it could not yield. */
static const float YIELD_TIME = 0.1f;

/* What a density solve corrects: a share gamma of the density error, and the error that this step's motion
 * will add because D v is only the tangent. That is taken to be what the last step's motion added. Without it
 * a fast flow carries an error of 1 / gamma times a step's. */
typedef struct DensitySource {
    float softening;      /* gamma */
    float feedforward;    /* share of last step's that is expected again */
    float least_speed_sq; /* m^2/s^2: who moves less than a hundredth of the spacing a step has no curved
                           * part to foresee, only noise to repeat */
} DensitySource;

static DensitySource density_source(const SkiffParams *params) {
    const float least = 0.02f * params->particle_radius / params->time_step;
    return (DensitySource){.softening = params->softening,
                           .feedforward =
                               params->pressure_solver != SKIFF_SOLVER_JACOBI ? params->feedforward : 0.0f,
                           .least_speed_sq = least * least};
}

static inline float density_source_at(const DensitySource *source, float density, float prediction,
                                      float speed_sq) {
    static const float LARGEST = 0.005f,
                       DENSE = 0.99f; /* near the surface neighbours come and go: nothing to learn there */
    const bool foresees = (speed_sq > source->least_speed_sq) & (prediction > 0.0f) & (density > DENSE);
    float expected = foresees ? source->feedforward * (density - prediction) : 0.0f;
    expected = expected > LARGEST ? LARGEST : expected < -LARGEST ? -LARGEST : expected;
    const float patience = prediction < 0.0f ? 1.0f + prediction : 1.0f;
    return patience * source->softening * (density - 1.0f) + expected;
}

/* Density that the velocities found lead to: rho + dt D v, from the residual that is left. Drops that fly
 * apart would have less than none, and less than none means water that has just been set free. */
static void predict_density(const Dfsph *dfsph, const DfsphProblem *problem) {
    const uint32_t blocks = particles_blocks(problem->particles);
    const float *density = problem->rows->pairs.density;
    const float less = problem->params->time_step / YIELD_TIME;
    EACH_BLOCK {
        for (uint32_t i = block * BLOCK; i < (block + 1) * BLOCK; i++) {
            float *prediction = &problem->particles->prediction[i];
            if (problem->held != NULL && problem->held[i])
                continue;
            const float found = density[i] + dfsph->residual[i] - dfsph->source[i];
            if (*prediction < -less)
                *prediction += less;
            else
                *prediction = dfsph->inv_diagonal[i] > 0.0f && found > 0.0f ? found : 0.0f;
        }
    }
}

/* What stands beside dt D v, of a slice. Divergence and flow: where there is room to the rest density,
 * approaching is no fault: thin water falls together freely. */
static void source_slice(Dfsph *dfsph, const DfsphProblem *problem, SolveKind kind,
                         const DensitySource *terms, uint32_t first) {
    float *source = dfsph->source + first;
    const float *density = problem->rows->pairs.density + first;
    if (kind == SOLVE_DIVERGENCE || kind == SOLVE_FLOW) {
        EACH_LANE source[l] = density[l] < 1.0f ? density[l] - 1.0f : 0.0f;
        return;
    }
    const float *prediction = problem->particles->prediction + first;
    const Float4 *velocity = (const Float4 *)problem->particles->velocity + first;
    EACH_LANE {
        const float *v = velocity[l];
        source[l] =
            density_source_at(terms, density[l], prediction[l], v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    }
}

/* Share of the last solution to start from. */
static float warm_start(const SkiffParams *params, SolveKind kind) {
    return kind == SOLVE_DIVERGENCE ? params->warm_start_divergence : params->warm_start;
}

/* Inverse diagonal, 0 where a particle takes no part; pressure scaled to the warm start, also as the operand;
 * of a slice. */
static void start_slice(Dfsph *dfsph, const DfsphProblem *problem, SolveKind kind, float *pressure,
                        uint32_t first) {
    static const float NO_PRESSURE[SLICE];
    const float warm = warm_start(problem->params, kind);
    const int least_neighbours = kind == SOLVE_DIVERGENCE ? MIN_NEIGHBOURS : 0;
    const Float4 *gradient_sum = dfsph->pairs->gradient_sum + first;
    const uint16_t *neighbours = problem->rows->neighbours + first;
    const uint8_t *held = problem->held != NULL ? problem->held + first : NONE_HELD;
    const float *carried = dfsph->carried != NULL ? dfsph->carried + first : NO_PRESSURE;
    const float *density = problem->rows->pairs.density + first, *lower = lower_of(dfsph, first);
    float *p = pressure + first, *inv_diagonal = dfsph->inv_diagonal + first;
    Float4 *operand = dfsph->operand + first;
    EACH_LANE {
        const float diagonal = gradient_sum[l][3];
        const bool takes_part =
            (diagonal > MIN_DIAGONAL) & (neighbours[l] >= least_neighbours) & (held[l] == 0);
        inv_diagonal[l] = takes_part ? 1.0f / diagonal : 0.0f;
        const bool starts = takes_part & (density[l] >= THIN) & (p[l] > lower[l]);
        const float start = starts ? warm * p[l] : 0.0f;
        p[l] = held[l] != 0 ? p[l] : start;
    }
    EACH_LANE operand[l][3] = p[l] + carried[l];
}

/* Water under pressure may be pulled, too. */
static void lower_block(Dfsph *dfsph, const float *pressure, uint32_t block) {
    for (uint32_t i = block * BLOCK; i < (block + 1) * BLOCK; i++)
        dfsph->lower[i] = pressure[i] > 0.0f ? -FLT_MAX : 0.0f;
}

static bool all_held(const uint8_t *held, uint32_t block) {
    for (uint32_t i = block * BLOCK; held != NULL && i < (block + 1) * BLOCK; i++)
        if (!held[i])
            return false;
    return held != NULL;
}

/* What standing water does to a block's velocities. */
static void push_block(Dfsph *dfsph, const DfsphProblem *problem, uint32_t block) {
    const Float4 *push = (const Float4 *)problem->rows->beside.push;
    const Float4 *velocity = (const Float4 *)problem->particles->velocity;
    const float scale = -1.0f / problem->params->time_step;
    for (uint32_t i = block * BLOCK; i < (block + 1) * BLOCK; i++)
        for (int k = 0; k < 3; k++)
            dfsph->spare[i][k] = velocity[i][k] + scale * push[i][k];
}

/* What a solve begins with. */
static void prepare(Dfsph *dfsph, const DfsphProblem *problem, SolveKind kind, float *p) {
    const uint32_t blocks = particles_blocks(problem->particles);
    const DensitySource terms = density_source(problem->params);
    memset(dfsph->lower, 0, SLICE * sizeof *dfsph->lower);
    EACH_BLOCK {
        const size_t begin = (size_t)block * BLOCK;
        /* other arrays may have lain here */
        memset(dfsph->direction + begin, 0, BLOCK * sizeof(float));
        memset(dfsph->image + begin, 0, BLOCK * sizeof(float));
        if (dfsph->base == dfsph->spare)
            push_block(dfsph, problem, block);
        if (dfsph->shifting)
            lower_block(dfsph, problem->particles->pressure, block);
        EACH_SLICE {
            start_slice(dfsph, problem, kind, p, first);
            source_slice(dfsph, problem, kind, &terms, first);
        }
        dfsph->still[block] = all_held(problem->held, block);
    }
}

/* Root mean square of the velocities before this step's gravity, in particle spacings a step, of what is not
 * held. */
static double water_motion(const Dfsph *dfsph, const DfsphProblem *problem) {
    const uint32_t blocks = particles_blocks(problem->particles);
    const uint32_t count = problem->particles->count;
    const Float4 *velocity = (const Float4 *)problem->particles->velocity;
    EACH_BLOCK {
        double sum = 0.0;
        const uint32_t end = (block + 1) * BLOCK < count ? (block + 1) * BLOCK : count;
        for (uint32_t i = block * BLOCK; i < end; i++)
            for (int k = 0; k < 3 && !(problem->held != NULL && problem->held[i]); k++)
                sum += (double)(velocity[i][k] * velocity[i][k]);
        dfsph->partials[block * DFSPH_SUMS] = sum;
    }
    double total;
    total_partials(dfsph, blocks, 1, &total);
    const double spacing = 2.0 * (double)problem->params->particle_radius;
    return sqrt(total / problem->evaluated_count) * (double)problem->params->time_step / spacing;
}

/* ---- Conjugate residuals ---- */

typedef struct GcrSums {
    double old_new, new_new, old_old, residual_new, residual_old;
} GcrSums;

/* new_image = A preconditioned, and the dot products a step needs, weighted by the inverse diagonal over the
 * active set. */
static GcrSums gcr_apply(Dfsph *dfsph, const DfsphProblem *problem, const float *p) {
    const uint32_t blocks = particles_blocks(problem->particles);
    apply_transpose(dfsph, problem, NULL, 1.0f, dfsph->answer);
    EACH_BLOCK {
        if (dfsph->still[block])
            continue;
        divergence_block(dfsph, problem, (const Float4 *)dfsph->answer, (const double(*)[6])dfsph->response,
                         dfsph->new_image, block);
        LaneSum sums[5] = {0};
        EACH_SLICE {
            const float *r = dfsph->residual + first, *q = dfsph->image + first,
                        *w = dfsph->new_image + first;
            const float *inv = dfsph->inv_diagonal + first, *pressure = p + first;
            const float *lower = lower_of(dfsph, first);
            EACH_LANE {
                const float weight = pressure[l] > lower[l] || r[l] > 0.0f ? inv[l] : 0.0f;
                const float wq = weight * q[l], ww = weight * w[l];
                sums[0].lane[l] += wq * w[l];
                sums[1].lane[l] += ww * w[l];
                sums[2].lane[l] += wq * q[l];
                sums[3].lane[l] += ww * r[l];
                sums[4].lane[l] += wq * r[l];
            }
        }
        for (int k = 0; k < 5; k++)
            dfsph->partials[block * DFSPH_SUMS + (uint32_t)k] = lane_total(&sums[k]);
    }
    double t[5];
    total_partials(dfsph, blocks, 5, t);
    return (GcrSums){t[0], t[1], t[2], t[3], t[4]};
}

/* One step along the new direction: d = z - beta d, q = A d, P = max(0, P + alpha d). Returns what the
 * projection cut, weighted by the diagonal. */
static double gcr_update(Dfsph *dfsph, const DfsphProblem *problem, float *p, float alpha, float beta,
                         Errors *errors) {
    const uint32_t blocks = particles_blocks(problem->particles);
    EACH_BLOCK {
        if (dfsph->still[block])
            continue;
        LaneSum one = {0}, two = {0}, cut = {0};
        EACH_SLICE {
            float *r = dfsph->residual + first, *q = dfsph->image + first, *d = dfsph->direction + first;
            float *pressure = p + first;
            const float *w = dfsph->new_image + first, *inv = dfsph->inv_diagonal + first;
            const float *lower = lower_of(dfsph, first);
            EACH_LANE {
                const bool active = pressure[l] > lower[l] || r[l] > 0.0f;
                const float z = active ? r[l] * inv[l] : 0.0f; /* the operand's fourth place */
                d[l] = z - beta * d[l];
                q[l] = w[l] - beta * q[l];
                /* What has left the active set stays in the direction until that is begun anew, but must not
                 * come back by it; and what P >= 0 does not allow has not changed the particle's own
                 * residual either. Two drops that barely touch went apart at 200 m/s without this: their
                 * diagonal is tiny and their steps are huge. */
                const float step = alpha * d[l], next = pressure[l] + step;
                const float lost = !active ? step : next < lower[l] ? next - lower[l] : 0.0f;
                const float correction = inv[l] > 0.0f ? lost / inv[l] : 0.0f;
                cut.lane[l] += fabsf(correction);
                pressure[l] = active && next > lower[l] ? next : lower[l];
                r[l] = inv[l] > 0.0f ? r[l] - alpha * q[l] + correction : 0.0f;
            }
            error_lanes(r, pressure, lower, &one, &two);
            precondition_lanes(r, pressure, lower, inv, dfsph->operand + first);
        }
        dfsph->partials[block * DFSPH_SUMS] = lane_total(&one);
        dfsph->partials[block * DFSPH_SUMS + 1] = lane_total(&two);
        dfsph->partials[block * DFSPH_SUMS + 2] = lane_total(&cut);
    }
    double totals[3];
    total_partials(dfsph, blocks, 3, totals);
    const double count = problem->evaluated_count;
    *errors = (Errors){totals[0] / count, totals[1] / count};
    return totals[2] / count;
}

typedef struct SolveLimits {
    double tolerance; /* relative density */
    double safety;
    int min, max;
} SolveLimits;

static SolveResult solve_gcr(Dfsph *dfsph, const DfsphProblem *problem, float *p, SolveLimits limits) {
    const double tolerance = limits.safety * limits.tolerance;
    Errors errors = evaluate_residual(dfsph, problem, p);
    int iterations = 1;
    bool has_direction = false;
    double cut = 0.0;
    while (!(errors.two_sided <= tolerance && iterations >= limits.min) && iterations < limits.max) {
        const GcrSums sums = gcr_apply(dfsph, problem, p);
        iterations++;
        const double beta = has_direction && sums.old_old > 0.0 ? sums.old_new / sums.old_old : 0.0;
        const double image_sq = sums.new_new - 2.0 * beta * sums.old_new + beta * beta * sums.old_old;
        const double along = sums.residual_new - beta * sums.residual_old;
        const double alpha = image_sq > 0.0 ? along / image_sq : 0.0;
        has_direction = alpha > 0.0;
        const float step = has_direction ? (float)alpha : 0.0f;
        cut += gcr_update(dfsph, problem, p, step, (float)beta, &errors);
        if (!has_direction && beta == 0.0)
            break; /* the residual has nothing left along any direction */
        if (cut > 0.5 * tolerance && iterations < limits.max) {
            /* the projection moved P without the residual knowing */
            set_operand(dfsph, problem, p);
            errors = evaluate_residual(dfsph, problem, p);
            iterations++;
            has_direction = false;
            cut = 0.0;
        }
    }
    return (SolveResult){iterations, errors.one_sided, errors.two_sided};
}

/* ---- Relaxed Jacobi ---- */

static SolveResult solve_jacobi(Dfsph *dfsph, const DfsphProblem *problem, float *p, SolveLimits limits) {
    const uint32_t blocks = particles_blocks(problem->particles);
    const float relaxation = problem->params->jacobi_relaxation;
    for (int iterations = 1;; iterations++) {
        const Errors errors = evaluate_residual(dfsph, problem, p);
        EACH_BLOCK {
            const uint32_t end = (block + 1) * BLOCK;
            for (uint32_t i = block * BLOCK; i < end; i++) {
                const float next = p[i] + relaxation * dfsph->residual[i] * dfsph->inv_diagonal[i];
                p[i] = next > 0.0f ? next : 0.0f;
            }
        }
        set_operand(dfsph, problem, p);
        if ((errors.one_sided <= limits.tolerance && iterations >= limits.min) || iterations >= limits.max)
            return (SolveResult){iterations, errors.one_sided, errors.two_sided};
    }
}

/* ---- The solve ---- */

static SolveLimits solve_limits(const Dfsph *dfsph, const DfsphProblem *problem, SolveKind kind) {
    /* what the flow leaves, the shift mends in the same step */
    static const double FLOW_TOLERANCE = 2.0;
    const SkiffParams *params = problem->params;
    const double density = (double)params->max_density_error / 100.0;
    switch (kind) {
    case SOLVE_DIVERGENCE:
        return (SolveLimits){(double)params->max_divergence_error / 100.0, STEADY_SAFETY,
                             params->min_divergence_iterations, params->max_divergence_iterations};
    case SOLVE_FLOW:
        return (SolveLimits){FLOW_TOLERANCE * density, STEADY_SAFETY, params->min_iterations,
                             params->max_iterations};
    case SOLVE_SHIFT:
        return (SolveLimits){density, STEADY_SAFETY, params->min_iterations, params->max_iterations};
    default:
        return (SolveLimits){density, problem->settling ? safety(1.0) : safety(water_motion(dfsph, problem)),
                             params->min_iterations, params->max_iterations};
    }
}

/* Bodies that are to follow what was found, and no longer answer. */
static void change_bodies(const Dfsph *dfsph, const DfsphProblem *problem) {
    const double scale = 1.0 / (double)problem->params->time_step;
    for (int b = 0; b < problem->body_count; b++)
        for (int k = 0; k < 3; k++) {
            problem->bodies[b].velocity[k] -= scale * dfsph->response[1 + b][k];
            problem->bodies[b].angular_velocity[k] -= scale * dfsph->response[1 + b][3 + k];
        }
}

SolveResult dfsph_solve(Dfsph *dfsph, const DfsphProblem *problem, SolveKind kind) {
    if (problem->evaluated_count == 0)
        return (SolveResult){0};
    const bool first = kind == SOLVE_DENSITY || kind == SOLVE_FLOW;
    float *p = first ? problem->particles->pressure : problem->particles->pressure_divergence;
    dfsph->operand = problem->particles->position;
    dfsph->pairs = kind == SOLVE_FLOW ? &problem->rows->corrected : &problem->rows->pairs;
    dfsph->moving = problem->body_count > 0 && problem->boundary->moving.samples.count != 0;
    dfsph->answering = kind != SOLVE_SHIFT;
    dfsph->shifting = kind == SOLVE_SHIFT;
    dfsph->carried =
        kind == SOLVE_DENSITY && !problem->density_alone ? problem->particles->pressure_divergence : NULL;
    /* the divergence solve mends what moves, and standing water's pressure is no part of that */
    dfsph->base = kind == SOLVE_DENSITY && problem->rows->beside.push != NULL ? dfsph->spare
                                                                              : problem->particles->velocity;
    for (int k = 0; k < 3; k++)
        dfsph->push[k] = first ? problem->params->time_step * problem->params->gravity[k] : 0.0f;
    if (dfsph->moving)
        memset(dfsph->response, 0, (1 + (size_t)problem->body_count) * sizeof *dfsph->response);
    prepare(dfsph, problem, kind, p);
    const SolveLimits limits = solve_limits(dfsph, problem, kind);
    const SolveResult result = problem->params->pressure_solver == SKIFF_SOLVER_JACOBI
                                   ? solve_jacobi(dfsph, problem, p, limits)
                                   : solve_gcr(dfsph, problem, p, limits);
    if (kind == SOLVE_DIVERGENCE)
        return result;
    if (kind == SOLVE_DENSITY || kind == SOLVE_SHIFT)
        predict_density(dfsph, problem);
    set_operand(dfsph, problem, p);
    if (kind == SOLVE_SHIFT)
        apply_pressure(dfsph, problem, dfsph->guess);
    else
        change_velocities(dfsph, problem);
    if (dfsph->moving && kind != SOLVE_SHIFT)
        change_bodies(dfsph, problem);
    return result;
}
