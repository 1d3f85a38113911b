/* Boundary samples: the stages, and the pool of points they fill.
 *
 * Sharp edges come first, divided evenly, then flat rectangles with grids that meet these edges, then all the
 * rest with scattered and relaxed points that keep away from what is there. Even spacing is what makes the
 * boundary volumes psi = 1 / sum W [Akinci 2012] even, and water at rest on a floor rest. Serial: the order
 * of the points is part of the result. */
#include "sample.h"

#include "sample_parts.h"

#include <inttypes.h>
#include <stdlib.h>
#include <string.h>

/* ---- Geometry ---- */

uint32_t sample_cell_count(double length) {
    /* The extra 1e-3 keeps lengths of exactly n + 1/2 spacings, equal but for rounding, from different
     * counts. */
    double count = floor(length + 0.5 + 1e-3);
    if (count < 2.0)
        return length > 1.3 ? 2 : 1;
    return count < 1e9 ? (uint32_t)count : 1000000000u;
}

bool sample_inside(const Sampler *sampler, const double position[3]) {
    for (int k = 0; k < 3; k++)
        if (position[k] < sampler->min[k] - sampler->tolerance ||
            position[k] > sampler->max[k] + sampler->tolerance)
            return false;
    return true;
}

/* Keeps what lies where sign * (x[axis] - bound) <= tolerance [Sutherland & Hodgman 1974]. */
static int clip_plane(const Sampler *sampler, double (*polygon)[3], int count, int axis, double sign) {
    double out[SAMPLE_MAX_CORNERS][3], bound = sign > 0.0 ? sampler->max[axis] : sampler->min[axis];
    int kept = 0;
    for (int i = 0; i < count; i++) {
        const double *a = polygon[i], *b = polygon[(i + 1) % count];
        double height_a = sign * (a[axis] - bound), height_b = sign * (b[axis] - bound);
        bool in_a = height_a <= sampler->tolerance, in_b = height_b <= sampler->tolerance;
        if (in_a && kept < SAMPLE_MAX_CORNERS)
            dvec_copy(out[kept++], a);
        /* A corner within the tolerance is on the plane: cutting next to it would leave a sliver. */
        bool crosses = in_a != in_b && fabs(in_a ? height_a : height_b) > sampler->tolerance;
        if (crosses && kept < SAMPLE_MAX_CORNERS) {
            double side[3];
            dvec_sub(side, b, a);
            dvec_add_scaled(out[kept], a, height_a / (height_a - height_b), side);
            out[kept++][axis] = bound;
        }
    }
    memcpy(polygon, out, (size_t)kept * sizeof *out);
    return kept;
}

int sample_clip(const Sampler *sampler, double (*polygon)[3], int count, bool *cut) {
    *cut = false;
    for (int i = 0; i < count; i++)
        *cut = *cut || !sample_inside(sampler, polygon[i]);
    for (int axis = 0; axis < 3 && *cut && count > 0; axis++)
        for (int side = 0; side < 2 && count > 0; side++)
            count = clip_plane(sampler, polygon, count, axis, side ? 1.0 : -1.0);
    return count < 3 ? 0 : count;
}

double sample_polygon_area(double (*polygon)[3], int count) {
    double sum[3] = {0};
    for (int i = 2; i < count; i++) {
        double a[3], b[3], cross[3];
        dvec_sub(a, polygon[i - 1], polygon[0]);
        dvec_sub(b, polygon[i], polygon[0]);
        dvec_cross(cross, a, b);
        dvec_add_scaled(sum, sum, 0.5, cross);
    }
    return dvec_length(sum);
}

/* ---- Spots ---- */

static float facing_dot(const Facing *a, const Facing *b) {
    return a->normal[0] * b->normal[0] + a->normal[1] * b->normal[1] + a->normal[2] * b->normal[2];
}

void sample_add_facing(Spot *spot, const double normal[3], uint32_t patch) {
    Facing facing = {.patch = patch};
    dvec_to_float(facing.normal, normal);
    /* A patch may come twice, once from each side of a crease that ends inside it. */
    for (uint32_t i = 0; i < spot->facing_count; i++)
        if (spot->facings[i].patch == patch && facing_dot(&spot->facings[i], &facing) > 0.5f)
            return;
    if (spot->facing_count < SAMPLE_MAX_FACINGS && dvec_dot(normal, normal) > 0.0)
        spot->facings[spot->facing_count++] = facing;
}

Spot sample_spot(const Sampler *sampler, const double position[3], uint32_t triangle) {
    Spot spot;
    dvec_copy(spot.position, position);
    spot.area = 0.0;
    spot.triangle = triangle;
    spot.facing_count = 0;
    sample_add_facing(&spot, sampler->normals[triangle], sampler->patches[triangle]);
    return spot;
}

static bool shares_facing(const Spot *spot, const Facing *facing) {
    for (uint32_t i = 0; i < spot->facing_count; i++)
        if (spot->facings[i].patch == facing->patch && facing_dot(&spot->facings[i], facing) > 0.0f)
            return true;
    return false;
}

bool sample_opposed(const Spot *a, const Spot *b) {
    for (uint32_t i = 0; i < a->facing_count; i++) {
        for (uint32_t j = 0; j < b->facing_count; j++) {
            const Facing *f = &a->facings[i], *g = &b->facings[j];
            if (facing_dot(f, g) < -0.5f && !shares_facing(b, f) && !shares_facing(a, g))
                return true;
        }
    }
    return false;
}

/* ---- Pool: a hash grid of cells 2 spacings wide, so that a ball of one spacing meets at most 8 ---- */

enum { CELL_BITS = 21 };

static uint64_t cell_key(const int64_t cell[3]) {
    return (uint64_t)cell[0] | (uint64_t)cell[1] << CELL_BITS | (uint64_t)cell[2] << (2 * CELL_BITS);
}

static uint32_t bucket_of(const Sampler *sampler, uint64_t key) {
    uint64_t h = key * 0x9e3779b97f4a7c15u;
    return (uint32_t)(h >> 32) & sampler->bucket_mask;
}

/* Positive for all that is asked for: the origin is 4 spacings below the mesh. */
static double cell_coordinate(const Sampler *sampler, double x, int axis) {
    return (x - sampler->cell_origin[axis]) * sampler->inv_cell_size;
}

static void enter(Sampler *sampler, uint32_t index) {
    const Spot *spot = &sampler->spots[index];
    Entry *entry = &sampler->entries[index];
    int64_t cell[3];
    for (int k = 0; k < 3; k++)
        cell[k] = (int64_t)cell_coordinate(sampler, spot->position[k], k);
    dvec_copy(entry->position, spot->position);
    entry->cell = cell_key(cell);
    memcpy(entry->normal, spot->facings[0].normal, sizeof entry->normal);
    entry->facing_count = spot->facing_count;
    uint32_t *bucket = &sampler->buckets[bucket_of(sampler, entry->cell)];
    entry->next = *bucket;
    *bucket = index;
}

bool sample_add(Sampler *sampler, const Spot *spot, uint32_t *index, Err *err) {
    if (sampler->spot_count == sampler->spot_capacity) {
        size_t capacity = 2 * (size_t)sampler->spot_capacity + 1024;
        bool fits = capacity < SAMPLE_NONE;
        Spot *spots = fits ? realloc(sampler->spots, capacity * sizeof *spots) : NULL;
        if (spots)
            sampler->spots = spots;
        Entry *entries = fits ? realloc(sampler->entries, capacity * sizeof *entries) : NULL;
        if (entries)
            sampler->entries = entries;
        if (!spots || !entries)
            return err_set(err, ERR_INPUT, "sampling: no memory for %zu points", capacity);
        sampler->spot_capacity = (uint32_t)capacity;
    }
    sampler->spots[sampler->spot_count] = *spot;
    enter(sampler, sampler->spot_count);
    if (index)
        *index = sampler->spot_count;
    sampler->spot_count++;
    return true;
}

void sample_rehash(Sampler *sampler, uint32_t count) {
    memset(sampler->buckets, 0xff, ((size_t)sampler->bucket_mask + 1) * sizeof *sampler->buckets);
    sampler->spot_count = count;
    for (uint32_t i = 0; i < count; i++)
        enter(sampler, i);
}

/* Walks through the entries of the cells that a ball meets, its centre's cell first: whatever is nearest is
 * there as a rule. */
typedef struct Walk {
    int64_t cells[3][4]; /* along each axis */
    int counts[3], at[3];
    uint64_t key;
    uint32_t entry;
} Walk;

static void walk_cell(const Sampler *sampler, Walk *walk) {
    int64_t cell[3] = {walk->cells[0][walk->at[0]], walk->cells[1][walk->at[1]], walk->cells[2][walk->at[2]]};
    walk->key = cell_key(cell);
    walk->entry = sampler->buckets[bucket_of(sampler, walk->key)];
}

static Walk walk_start(const Sampler *sampler, const double position[3], double radius) {
    Walk walk;
    for (int k = 0; k < 3; k++) {
        double x = cell_coordinate(sampler, position[k], k), reach = radius * sampler->inv_cell_size;
        int64_t own = (int64_t)x, low = (int64_t)(x - reach), high = (int64_t)(x + reach);
        walk.cells[k][0] = own;
        walk.counts[k] = 1;
        walk.at[k] = 0;
        for (int64_t cell = low; cell <= high && walk.counts[k] < 4; cell++)
            if (cell != own)
                walk.cells[k][walk.counts[k]++] = cell;
    }
    walk_cell(sampler, &walk);
    return walk;
}

static uint32_t walk_next(const Sampler *sampler, Walk *walk) {
    for (;;) {
        while (walk->entry != SAMPLE_NONE) {
            uint32_t found = walk->entry;
            walk->entry = sampler->entries[found].next;
            if (sampler->entries[found].cell == walk->key)
                return found;
        }
        int axis = 0;
        while (axis < 3 && ++walk->at[axis] == walk->counts[axis])
            walk->at[axis++] = 0;
        if (axis == 3)
            return SAMPLE_NONE;
        walk_cell(sampler, walk);
    }
}

/* sample_opposed of a spot and one of the pool. Two points inside patches never ask the whole spots. */
static bool opposed_entry(const Sampler *sampler, const Spot *spot, uint32_t index) {
    const Entry *entry = &sampler->entries[index];
    const float *normal = spot->facings[0].normal;
    if (spot->facing_count == 1 && entry->facing_count == 1)
        return normal[0] * entry->normal[0] + normal[1] * entry->normal[1] + normal[2] * entry->normal[2] <
               -0.5f;
    return sample_opposed(spot, &sampler->spots[index]);
}

uint32_t sample_nearest(const Sampler *sampler, const Spot *spot, double radius) {
    double best_sq = radius * radius;
    uint32_t best = SAMPLE_NONE, i;
    Walk walk = walk_start(sampler, spot->position, radius);
    while ((i = walk_next(sampler, &walk)) != SAMPLE_NONE) {
        double distance_sq = dvec_distance_sq(sampler->entries[i].position, spot->position);
        /* Equal distances: the older one, whatever the order of the bucket. */
        if (distance_sq > best_sq || (distance_sq == best_sq && i > best) || opposed_entry(sampler, spot, i))
            continue;
        best_sq = distance_sq;
        best = i;
    }
    return best;
}

uint32_t sample_any(const Sampler *sampler, const Spot *spot, double radius) {
    uint32_t i;
    Walk walk = walk_start(sampler, spot->position, radius);
    while ((i = walk_next(sampler, &walk)) != SAMPLE_NONE)
        if (dvec_distance_sq(sampler->entries[i].position, spot->position) < radius * radius &&
            !opposed_entry(sampler, spot, i))
            return i;
    return SAMPLE_NONE;
}

uint32_t sample_within(const Sampler *sampler, const double position[3], double radius, uint32_t *found,
                       uint32_t capacity) {
    uint32_t i, count = 0;
    Walk walk = walk_start(sampler, position, radius);
    while (count < capacity && (i = walk_next(sampler, &walk)) != SAMPLE_NONE)
        if (dvec_distance_sq(sampler->entries[i].position, position) < radius * radius)
            found[count++] = i;
    return count;
}

/* ---- Stages ---- */

static bool check_input(const Mesh *mesh, float spacing, const SampleRegion *region, Err *err) {
    if (!isfinite(spacing) || !(spacing > 0.0f))
        return err_set(err, ERR_INPUT, "sampling: spacing %g m; a finite length > 0 is allowed",
                       (double)spacing);
    if (mesh->triangle_count == 0)
        return err_set(err, ERR_INPUT, "sampling: the mesh has no triangles");
    for (int k = 0; k < 3; k++) {
        double size = (double)mesh->max[k] - (double)mesh->min[k], cells = size / (2.0 * (double)spacing);
        if (!(cells < (double)((1 << CELL_BITS) - 8)))
            return err_set(err, ERR_INPUT,
                           "sampling: mesh of %g m along %c at spacing %g m; at most %d spacings are allowed",
                           size, "xyz"[k], (double)spacing, 2 * ((1 << CELL_BITS) - 8));
        if (region && !(region->min[k] <= region->max[k]))
            return err_set(err, ERR_INPUT, "sampling: region from %g to %g m along %c; min <= max is needed",
                           (double)region->min[k], (double)region->max[k], "xyz"[k]);
    }
    return true;
}

/* Normals, and how much there is inside the region. */
static void measure(Sampler *sampler) {
    const Mesh *mesh = sampler->mesh;
    for (uint32_t t = 0; t < mesh->triangle_count; t++) {
        double polygon[SAMPLE_MAX_CORNERS][3], a[3], b[3];
        bool cut;
        for (int k = 0; k < 3; k++)
            dvec_from_float(polygon[k], mesh->vertices[mesh->triangles[t][k]]);
        dvec_sub(a, polygon[1], polygon[0]);
        dvec_sub(b, polygon[2], polygon[0]);
        dvec_cross(sampler->normals[t], a, b);
        dvec_normalize(sampler->normals[t]);
        int count = sample_clip(sampler, polygon, 3, &cut);
        sampler->area += sample_polygon_area(polygon, count);
        for (int i = 0; i < count; i++)
            sampler->length +=
                sqrt(dvec_distance_sq(polygon[i], polygon[(i + 1) % count])) / sampler->spacing;
    }
}

static bool too_many(double count, uint32_t max_count, const char *about, Err *err) {
    return err_set(err, ERR_INPUT, "sampling: %s%.0f points are needed; at most %" PRIu32 " are allowed",
                   about, count, max_count);
}

static bool prepare(Sampler *sampler, float spacing, const SampleRegion *region, uint32_t max_count,
                    Err *err) {
    const Mesh *mesh = sampler->mesh;
    sampler->spacing = (double)spacing;
    sampler->tolerance = 1e-4 * sampler->spacing;
    sampler->inv_cell_size = 0.5 / sampler->spacing;
    for (int k = 0; k < 3; k++) {
        sampler->min[k] = region ? (double)region->min[k] : -INFINITY;
        sampler->max[k] = region ? (double)region->max[k] : INFINITY;
        sampler->cell_origin[k] = (double)mesh->min[k] - 4.0 * sampler->spacing;
    }
    size_t count = mesh->triangle_count;
    sampler->neighbours = malloc(count * sizeof *sampler->neighbours);
    sampler->normals = malloc(count * sizeof *sampler->normals);
    sampler->patches = malloc(count * sizeof *sampler->patches);
    sampler->creases = calloc(count, sizeof *sampler->creases);
    if (!sampler->neighbours || !sampler->normals || !sampler->patches || !sampler->creases)
        return err_set(err, ERR_INPUT, "sampling: no memory for %zu triangles", count);
    measure(sampler);
    if (!isfinite(sampler->area))
        return err_set(err, ERR_INPUT, "sampling: the mesh has vertices that are not finite");
    double expected = sampler->area / (sampler->spacing * sampler->spacing);
    if (0.7 * expected > (double)max_count)
        return too_many(expected, max_count, "about ", err);
    /* Time and memory grow with the area, the number of triangles and, for slivers without area, with their
     * length. */
    double longest = 64.0 * ((double)max_count + (double)count) + 1e6;
    if (sampler->length > longest)
        return err_set(err, ERR_INPUT,
                       "sampling: the sides of the triangles are %.0f spacings long in all; at most %.0f are "
                       "allowed (a larger "
                       "spacing, or fewer long thin triangles)",
                       sampler->length, longest);
    size_t buckets = 1024;
    while ((double)buckets < expected && buckets < (size_t)1 << 28)
        buckets *= 2;
    sampler->bucket_mask = (uint32_t)(buckets - 1);
    sampler->buckets = malloc(buckets * sizeof *sampler->buckets);
    if (!sampler->buckets)
        return err_set(err, ERR_INPUT, "sampling: no memory for about %.0f points", expected);
    sample_rehash(sampler, 0);
    return mesh_neighbours(mesh, sampler->neighbours, err);
}

static SamplePoint finish_spot(const Spot *spot) {
    SamplePoint point;
    double normal[3] = {0};
    for (uint32_t i = 0; i < spot->facing_count; i++)
        for (int k = 0; k < 3; k++)
            normal[k] += (double)spot->facings[i].normal[k];
    if (spot->facing_count > 0 && dvec_length(normal) < 1e-3) /* both sides of a sheet */
        dvec_from_float(normal, spot->facings[0].normal);
    dvec_normalize(normal);
    dvec_to_float(point.position, spot->position);
    dvec_to_float(point.normal, normal);
    point.area = (float)spot->area;
    return point;
}

static bool finish(const Sampler *sampler, uint32_t max_count, SamplePoint **points, uint32_t *count,
                   Err *err) {
    if (sampler->spot_count > max_count)
        return too_many((double)sampler->spot_count, max_count, "", err);
    SamplePoint *out = malloc(((size_t)sampler->spot_count + 1) * sizeof *out);
    if (!out)
        return err_set(err, ERR_INPUT, "sampling: no memory for %" PRIu32 " points", sampler->spot_count);
    for (uint32_t i = 0; i < sampler->spot_count; i++)
        out[i] = finish_spot(&sampler->spots[i]);
    *points = out;
    *count = sampler->spot_count;
    return true;
}

bool sample_surface(const Mesh *mesh, float spacing, const SampleRegion *region, uint32_t max_count,
                    SamplePoint **points, uint32_t *count, Err *err) {
    *points = NULL;
    *count = 0;
    if (!check_input(mesh, spacing, region, err))
        return false;
    Sampler sampler = {.mesh = mesh};
    bool ok = prepare(&sampler, spacing, region, max_count, err);
    ok = ok && sample_edges_find(&sampler, err);
    ok = ok && sample_edges_fill(&sampler, err);
    ok = ok && sample_grid_fill(&sampler, err);
    ok = ok && sample_scatter_fill(&sampler, err);
    ok = ok && finish(&sampler, max_count, points, count, err);
    free(sampler.neighbours);
    free(sampler.normals);
    free(sampler.patches);
    free(sampler.creases);
    free(sampler.rectangles);
    free(sampler.fills);
    free(sampler.spots);
    free(sampler.entries);
    free(sampler.buckets);
    return ok;
}
