/* Points on curved and odd-shaped patches.
 *
 * Triangles are bisected to leaves smaller than a spacing. Darts thrown at the leaves in a fixed random
 * order give a Poisson-disk set [Cook 1986], which then repels itself towards even spacing: points slide over
 * the triangles of their patch and stop at creases. Pairs that are still too near lose one, and what is then
 * uncovered gets a point, found by bisecting leaves further: the largest distance is guaranteed, not sampled.
 * Each leaf gives its area to the nearest point. */
#include "sample_parts.h"

#include "base/random.h"

#include <stdlib.h>
#include <string.h>

enum {
    SHUFFLE_BLOCK = 1 << 14,
    RELAX_ROUNDS = 10,
    LIST_ROUNDS = 5,   /* rounds that a list of neighbours is used for */
    MAX_CROSSINGS = 64 /* triangles that one move may lead through */
};

/* In spacings. The numbers of the relaxation were tried out on an ellipsoid and on a plane with an inner
 * corner: 10 rounds make psi vary by 2 % (standard deviation) where the darts alone vary by 12 %. Weaker
 * pushes need more rounds, stronger ones overshoot, as does a radius that takes in the second ring of
 * neighbours. */
static const double dart_leaf = 1.0, area_leaf = 0.7;
static const double candidate_density = 10.0; /* a spacing^2 */
static const double dart_radius = 0.75;       /* makes about one point a spacing^2 */
static const double repel_radius = 1.7, repel_strength = 1.6, move_limit = 0.15;
static const double list_margin = 0.15;
static const double hole_radius = 0.86; /* a point is added where none is nearer */

/* ---- Leaves ---- */

typedef struct Leaf {
    const double (*corners)[3];
    uint32_t triangle;
    double area;
} Leaf;

typedef bool LeafVisit(Sampler *sampler, const Leaf *leaf, void *user, Err *err);

typedef struct Visit {
    Sampler *sampler;
    LeafVisit *function;
    void *user;
    uint32_t triangle;
    double size_sq; /* of the longest side of a leaf */
    Err *err;
} Visit;

static void leaf_centre(const Leaf *leaf, double out[3]) {
    for (int k = 0; k < 3; k++)
        out[k] = (leaf->corners[0][k] + leaf->corners[1][k] + leaf->corners[2][k]) / 3.0;
}

/* Largest distance of a point of the leaf from its centre. */
static double leaf_radius(const Leaf *leaf, const double centre[3]) {
    double radius_sq = 0.0;
    for (int k = 0; k < 3; k++)
        radius_sq = fmax(radius_sq, dvec_distance_sq(leaf->corners[k], centre));
    return sqrt(radius_sq);
}

/* Halves the longest side until it is short enough. */
static bool bisect(const Visit *visit, const double corners[3][3], double area) {
    int longest = 0;
    double longest_sq = 0.0;
    for (int k = 0; k < 3; k++) {
        double side_sq = dvec_distance_sq(corners[k], corners[(k + 1) % 3]);
        if (side_sq > longest_sq) {
            longest_sq = side_sq;
            longest = k;
        }
    }
    if (longest_sq <= visit->size_sq) {
        Leaf leaf = {corners, visit->triangle, area};
        return visit->function(visit->sampler, &leaf, visit->user, visit->err);
    }
    int next = (longest + 1) % 3;
    double middle[3], half[3][3];
    for (int k = 0; k < 3; k++)
        middle[k] = 0.5 * (corners[longest][k] + corners[next][k]);
    memcpy(half, corners, sizeof half);
    dvec_copy(half[next], middle);
    if (!bisect(visit, (const double(*)[3])half, 0.5 * area))
        return false;
    memcpy(half, corners, sizeof half);
    dvec_copy(half[longest], middle);
    return bisect(visit, (const double(*)[3])half, 0.5 * area);
}

/* Calls `function` for all leaves inside the region of the patches that are filled at most like `last`, in a
 * fixed order. */
static bool visit_leaves(Sampler *sampler, PatchFill last, LeafVisit *function, void *user, Err *err) {
    const Mesh *mesh = sampler->mesh;
    double size = (last == FILL_SCATTER ? dart_leaf : area_leaf) * sampler->spacing;
    Visit visit = {sampler, function, user, 0, size * size, err};
    for (uint32_t t = 0; t < mesh->triangle_count; t++) {
        double polygon[SAMPLE_MAX_CORNERS][3];
        bool cut;
        if (sampler->fills[sampler->patches[t]] > last ||
            !(dvec_dot(sampler->normals[t], sampler->normals[t]) > 0.0))
            continue;
        for (int k = 0; k < 3; k++)
            dvec_from_float(polygon[k], mesh->vertices[mesh->triangles[t][k]]);
        int count = sample_clip(sampler, polygon, 3, &cut);
        visit.triangle = t;
        for (int k = 2; k < count; k++) {
            double corners[3][3];
            dvec_copy(corners[0], polygon[0]);
            dvec_copy(corners[1], polygon[k - 1]);
            dvec_copy(corners[2], polygon[k]);
            if (!bisect(&visit, (const double(*)[3])corners, sample_polygon_area(corners, 3)))
                return false;
        }
    }
    return true;
}

/* ---- Darts ---- */

typedef struct Candidate {
    float position[3];
    uint32_t triangle;
} Candidate;

typedef struct Candidates {
    Candidate *items;
    uint32_t count, capacity;
    uint64_t leaf_count;
} Candidates;

/* Where a spot is, for sorting. */
typedef struct Place {
    uint64_t cell;
    uint32_t index;
} Place;

static bool add_candidate(Candidates *candidates, const Leaf *leaf, uint64_t bits, Err *err) {
    if (candidates->count == candidates->capacity) {
        size_t capacity = 2 * (size_t)candidates->capacity + 4096;
        Candidate *items =
            capacity < SAMPLE_NONE ? realloc(candidates->items, capacity * sizeof *items) : NULL;
        if (!items)
            return err_set(err, ERR_INPUT, "sampling: no memory for %zu candidates", capacity);
        candidates->items = items;
        candidates->capacity = (uint32_t)capacity;
    }
    /* A random point of the leaf; the upper half of the unit square is folded over. */
    double u = (double)(bits >> 32) * 0x1p-32, v = (double)(bits & UINT32_MAX) * 0x1p-32;
    if (u + v > 1.0) {
        u = 1.0 - u;
        v = 1.0 - v;
    }
    Candidate *candidate = &candidates->items[candidates->count++];
    const double(*c)[3] = leaf->corners;
    for (int k = 0; k < 3; k++)
        candidate->position[k] = (float)((1.0 - u - v) * c[0][k] + u * c[1][k] + v * c[2][k]);
    candidate->triangle = leaf->triangle;
    return true;
}

/* Candidates in proportion to the area, rounded up or down at random: as many on a coarse mesh as on a fine
 * one. */
static bool collect(Sampler *sampler, const Leaf *leaf, void *user, Err *err) {
    Candidates *candidates = user;
    double share = candidate_density * leaf->area / (sampler->spacing * sampler->spacing);
    share += random_share(0, 2 * candidates->leaf_count++);
    for (int left = (int)share; left > 0; left--)
        if (!add_candidate(candidates, leaf, random_bits(0, 2 * (uint64_t)candidates->count + 1), err))
            return false;
    return true;
}

static bool throw_darts(Sampler *sampler, Err *err) {
    Candidates candidates = {0};
    bool ok = visit_leaves(sampler, FILL_SCATTER, collect, &candidates, err);
    /* Shuffled block by block while they are taken [Fisher & Yates]: a block is large against what a point
     * keeps free, and small enough for the cache. */
    for (uint32_t i = 0; i < candidates.count && ok; i++) {
        uint32_t left = SHUFFLE_BLOCK - i % SHUFFLE_BLOCK;
        left = left < candidates.count - i ? left : candidates.count - i;
        uint32_t other = i + (uint32_t)((random_bits(0, ~(uint64_t)i) >> 32) * left >> 32);
        Candidate taken = candidates.items[other];
        double position[3];
        candidates.items[other] = candidates.items[i];
        dvec_from_float(position, taken.position);
        Spot spot = sample_spot(sampler, position, taken.triangle);
        if (sample_any(sampler, &spot, dart_radius * sampler->spacing) == SAMPLE_NONE)
            ok = sample_add(sampler, &spot, NULL, err);
    }
    free(candidates.items);
    return ok;
}

static int compare_places(const void *a, const void *b) {
    const Place *p = a, *q = b;
    if (p->cell != q->cell)
        return p->cell < q->cell ? -1 : 1;
    return p->index < q->index ? -1 : p->index > q->index;
}

/* Puts the points from `first` on in the order of their cells: what is near in space is near in memory. */
static bool sort_spots(Sampler *sampler, uint32_t first, Err *err) {
    size_t count = sampler->spot_count - first;
    if (count == 0)
        return true;
    Place *places = malloc(count * sizeof *places);
    Spot *sorted = malloc(count * sizeof *sorted);
    bool ok = places && sorted;
    for (uint32_t i = 0; ok && i < count; i++)
        places[i] = (Place){sampler->entries[first + i].cell, first + i};
    if (ok)
        qsort(places, count, sizeof *places, compare_places);
    for (uint32_t i = 0; ok && i < count; i++)
        sorted[i] = sampler->spots[places[i].index];
    if (ok)
        memcpy(sampler->spots + first, sorted, count * sizeof *sorted);
    free(places);
    free(sorted);
    return ok ? true : err_set(err, ERR_INPUT, "sampling: no memory to sort %zu points", count);
}

/* ---- Relaxation ---- */

/* Moves a point over the surface: in the plane of its triangle, turned into the next plane at each side it
 * crosses, at most to a crease or the region's bounds. */
static void slide(const Sampler *sampler, Spot *spot, const double move[3]) {
    const Mesh *mesh = sampler->mesh;
    double p[3], rest[3];
    uint32_t t = spot->triangle, entry = SAMPLE_NONE;
    dvec_copy(p, spot->position);
    dvec_add_scaled(rest, move, -dvec_dot(move, sampler->normals[t]), sampler->normals[t]);
    for (int crossing = 0; crossing < MAX_CROSSINGS; crossing++) {
        double first = 1.0, along[3] = {0};
        int side = -1;
        for (int k = 0; k < 3; k++) {
            double a[3], b[3], inward[3], arm[3];
            dvec_from_float(a, mesh->vertices[mesh->triangles[t][k]]);
            dvec_from_float(b, mesh->vertices[mesh->triangles[t][(k + 1) % 3]]);
            dvec_sub(b, b, a);
            dvec_cross(inward, sampler->normals[t], b);
            dvec_sub(arm, p, a);
            double height = dvec_dot(arm, inward), gain = dvec_dot(rest, inward);
            if (sampler->neighbours[t][k] == entry && entry != SAMPLE_NONE)
                continue;
            if (gain >= 0.0 || height + gain >= 0.0)
                continue;
            double at = fmax(0.0, height / -gain);
            if (at < first) {
                first = at;
                side = k;
                dvec_copy(along, b);
            }
        }
        dvec_add_scaled(p, p, first, rest);
        uint32_t next = side < 0 ? SAMPLE_NONE : sampler->neighbours[t][side];
        if (next == SAMPLE_NONE || sampler->creases[t] >> side & 1 ||
            !(dvec_dot(sampler->normals[next], sampler->normals[next]) > 0.0))
            break;
        /* The part across the side turns with the surface, the part along it stays. */
        double inward[3], forward;
        for (int k = 0; k < 3; k++)
            rest[k] *= 1.0 - first;
        dvec_normalize(along);
        forward = dvec_dot(rest, along);
        dvec_cross(inward, along, sampler->normals[next]); /* runs from the shared side into `next` */
        double across = sqrt(fmax(0.0, dvec_dot(rest, rest) - forward * forward));
        for (int k = 0; k < 3; k++)
            rest[k] = forward * along[k] + across * inward[k];
        entry = t;
        t = next;
    }
    if (!sample_inside(sampler, p))
        return;
    *spot = sample_spot(sampler, p, t);
}

/* For each movable point the points it is pushed by. */
typedef struct Lists {
    uint32_t *start; /* count + 1 */
    uint32_t *items;
    size_t item_count, item_capacity;
} Lists;

static bool list_neighbours(const Sampler *sampler, uint32_t first, Lists *lists) {
    enum { CAPACITY = 64 };
    uint32_t found[CAPACITY];
    lists->item_count = 0;
    for (uint32_t i = first; i < sampler->spot_count; i++) {
        const Spot *spot = &sampler->spots[i];
        lists->start[i - first] = (uint32_t)lists->item_count;
        uint32_t count = sample_within(sampler, spot->position,
                                       (repel_radius + list_margin) * sampler->spacing, found, CAPACITY);
        if (lists->item_count + count > lists->item_capacity) {
            size_t capacity = 2 * lists->item_capacity + 4096;
            uint32_t *items = capacity < SAMPLE_NONE ? realloc(lists->items, capacity * sizeof *items) : NULL;
            if (!items)
                return false;
            lists->items = items;
            lists->item_capacity = capacity;
        }
        for (uint32_t k = 0; k < count; k++)
            if (found[k] != i && !sample_opposed(spot, &sampler->spots[found[k]]))
                lists->items[lists->item_count++] = found[k];
    }
    lists->start[sampler->spot_count - first] = (uint32_t)lists->item_count;
    return true;
}

/* Each point is moved at once, so that the next already sees it there: evens out in half the rounds. */
static void push(Sampler *sampler, uint32_t first, const Lists *lists) {
    double radius = repel_radius * sampler->spacing;
    for (uint32_t i = first; i < sampler->spot_count; i++) {
        double sum[3] = {0};
        for (uint32_t k = lists->start[i - first]; k < lists->start[i - first + 1]; k++) {
            double arm[3];
            dvec_sub(arm, sampler->spots[i].position, sampler->spots[lists->items[k]].position);
            double distance = dvec_length(arm), q = 1.0 - distance / radius;
            if (q > 0.0 && distance > 0.0)
                dvec_add_scaled(sum, sum, q * q / distance, arm);
        }
        double step = repel_strength * sampler->spacing, length = step * dvec_length(sum);
        if (length > move_limit * sampler->spacing)
            step *= move_limit * sampler->spacing / length;
        for (int k = 0; k < 3; k++)
            sum[k] *= step;
        slide(sampler, &sampler->spots[i], sum);
    }
}

/* Moves the points from `first` on; the others stay. */
static bool relax(Sampler *sampler, uint32_t first, Err *err) {
    size_t count = sampler->spot_count - first;
    Lists lists = {.start = malloc((count + 1) * sizeof(uint32_t))};
    bool ok = lists.start != NULL;
    for (int round = 0; round < RELAX_ROUNDS && ok; round++) {
        if (round % LIST_ROUNDS == 0) {
            sample_rehash(sampler, sampler->spot_count);
            ok = list_neighbours(sampler, first, &lists);
        }
        if (!ok)
            break;
        push(sampler, first, &lists);
    }
    free(lists.start);
    free(lists.items);
    return ok ? true : err_set(err, ERR_INPUT, "sampling: no memory to spread %zu points", count);
}

/* ---- Repair and area ---- */

/* Enters the points from `first` on again, without those too near to one before. */
static bool drop_crowded(Sampler *sampler, uint32_t first, Err *err) {
    uint32_t count = sampler->spot_count;
    sample_rehash(sampler, first);
    for (uint32_t i = first; i < count; i++) {
        Spot spot = sampler->spots[i];
        if (sample_any(sampler, &spot, sample_gap * sampler->spacing) == SAMPLE_NONE &&
            !sample_add(sampler, &spot, NULL, err))
            return false;
    }
    return true;
}

/* Gives a leaf's area to the nearest point. A leaf that is far from all gets a point of its own; one that may
 * be too far in part is looked at more closely. */
static bool settle(Sampler *sampler, const Leaf *leaf, void *user, Err *err) {
    uint32_t *last = user; /* the point of the leaf before: a neighbour, whose distance bounds the search */
    double centre[3], radius = sampler->spacing;
    leaf_centre(leaf, centre);
    Spot spot = sample_spot(sampler, centre, leaf->triangle);
    if (*last != SAMPLE_NONE) {
        double distance = sqrt(dvec_distance_sq(sampler->spots[*last].position, centre));
        if (distance < radius && !sample_opposed(&spot, &sampler->spots[*last]))
            radius = distance * (1.0 + 1e-9);
    }
    *last = sample_nearest(sampler, &spot, radius);
    double distance = INFINITY;
    if (*last != SAMPLE_NONE)
        distance = sqrt(dvec_distance_sq(sampler->spots[*last].position, centre));
    if (distance > hole_radius * sampler->spacing) {
        if (!sample_add(sampler, &spot, last, err))
            return false;
        distance = 0.0;
    }
    double size = leaf_radius(leaf, centre);
    if (distance + size > sample_reach * sampler->spacing) {
        Visit visit = {sampler, settle, last, leaf->triangle, 0.36 * size * size, err};
        return bisect(&visit, leaf->corners, leaf->area);
    }
    sampler->spots[*last].area += leaf->area;
    return true;
}

bool sample_scatter_fill(Sampler *sampler, Err *err) {
    uint32_t first = sampler->spot_count, last = SAMPLE_NONE;
    return throw_darts(sampler, err) && sort_spots(sampler, first, err) && relax(sampler, first, err) &&
           drop_crowded(sampler, first, err) && visit_leaves(sampler, FILL_SETTLE, settle, &last, err);
}
