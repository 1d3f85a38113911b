/* Regular grids on flat rectangles.
 *
 * The sides are divided like the creases along them, so the border nodes of a grid are points that are there
 * already. Where they are not (another edge ends in the middle of a side, another surface runs near), a node
 * is left out for a point that is too near to it, and sample_scatter.c looks for holes. A rectangle that the
 * region cuts to a smaller one, a tank's wall at the wet height, gets a grid that fits what is left. */
#include "sample_parts.h"

#include <stdlib.h>

typedef struct Grid {
    Rectangle part; /* what the region left */
    uint32_t cells[2], triangle;
} Grid;

/* The rectangle that a polygon with longest side u fills, if it fills one. */
static bool fit_rectangle(double (*polygon)[3], int count, double tolerance, Rectangle *out) {
    double longest_sq = 0.0, normal[3] = {0}, low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY};
    for (int i = 0; i < count; i++) {
        double side[3], cross[3], arm[3];
        dvec_sub(side, polygon[(i + 1) % count], polygon[i]);
        if (dvec_dot(side, side) > longest_sq * (1.0 + 1e-6)) {
            longest_sq = dvec_dot(side, side);
            dvec_copy(out->u, side);
        }
        dvec_sub(arm, polygon[i], polygon[0]);
        dvec_cross(cross, arm, side);
        dvec_add_scaled(normal, normal, 1.0, cross);
    }
    if (!(longest_sq > 0.0) || !(dvec_length(normal) > 0.0))
        return false;
    dvec_normalize(out->u);
    dvec_cross(out->v, normal, out->u);
    dvec_normalize(out->v);
    for (int i = 0; i < count; i++) {
        double arm[3];
        dvec_sub(arm, polygon[i], polygon[0]);
        double at[2] = {dvec_dot(arm, out->u), dvec_dot(arm, out->v)};
        for (int axis = 0; axis < 2; axis++) {
            low[axis] = fmin(low[axis], at[axis]);
            high[axis] = fmax(high[axis], at[axis]);
        }
    }
    dvec_add_scaled(out->origin, polygon[0], low[0], out->u);
    dvec_add_scaled(out->origin, out->origin, low[1], out->v);
    out->size[0] = high[0] - low[0];
    out->size[1] = high[1] - low[1];
    double missing = out->size[0] * out->size[1] - sample_polygon_area(polygon, count);
    return fabs(missing) <= 10.0 * tolerance * (out->size[0] + out->size[1]);
}

static void node_position(const Grid *grid, uint32_t i, uint32_t j, double out[3]) {
    const Rectangle *part = &grid->part;
    dvec_add_scaled(out, part->origin, part->size[0] * i / grid->cells[0], part->u);
    dvec_add_scaled(out, out, part->size[1] * j / grid->cells[1], part->v);
}

/* Adds the nodes where there is no point yet. *whole tells whether every node has a point at its place;
 * `spots` gets them. */
static bool add_nodes(Sampler *sampler, const Grid *grid, uint32_t *spots, bool *whole, Err *err) {
    const double same = 0.01 * sampler->spacing;
    *whole = true;
    for (uint32_t j = 0; j <= grid->cells[1]; j++) {
        for (uint32_t i = 0; i <= grid->cells[0]; i++, spots++) {
            double position[3];
            node_position(grid, i, j, position);
            Spot spot = sample_spot(sampler, position, grid->triangle);
            *spots = sample_nearest(sampler, &spot, sample_gap * sampler->spacing);
            if (*spots == SAMPLE_NONE) {
                if (!sample_add(sampler, &spot, spots, err))
                    return false;
            } else if (dvec_distance_sq(sampler->spots[*spots].position, position) > same * same) {
                *whole = false;
            }
        }
    }
    return true;
}

/* Shares each cell's area among the four nodes around it. */
static void share_cells(Sampler *sampler, const Grid *grid, const uint32_t *spots) {
    double cell_area =
        grid->part.size[0] * grid->part.size[1] / ((double)grid->cells[0] * (double)grid->cells[1]);
    for (uint32_t j = 0; j <= grid->cells[1]; j++) {
        for (uint32_t i = 0; i <= grid->cells[0]; i++) {
            double share =
                (i == 0 || i == grid->cells[0] ? 0.5 : 1.0) * (j == 0 || j == grid->cells[1] ? 0.5 : 1.0);
            sampler->spots[*spots++].area += share * cell_area;
        }
    }
}

static bool fill_rectangle(Sampler *sampler, uint32_t patch, uint32_t triangle, Err *err) {
    const Rectangle *whole = &sampler->rectangles[patch];
    Grid grid = {.part = *whole, .triangle = triangle};
    double polygon[SAMPLE_MAX_CORNERS][3];
    bool cut;
    for (int k = 0; k < 4; k++) {
        dvec_add_scaled(polygon[k], whole->origin, k == 1 || k == 2 ? whole->size[0] : 0.0, whole->u);
        dvec_add_scaled(polygon[k], polygon[k], k >= 2 ? whole->size[1] : 0.0, whole->v);
    }
    int count = sample_clip(sampler, polygon, 4, &cut);
    if (count == 0)
        sampler->fills[patch] = FILL_DONE;
    if (count == 0 || (cut && !fit_rectangle(polygon, count, sampler->tolerance, &grid.part)))
        return true;
    for (int axis = 0; axis < 2; axis++)
        grid.cells[axis] = sample_cell_count(grid.part.size[axis] / sampler->spacing);
    size_t nodes = ((size_t)grid.cells[0] + 1) * ((size_t)grid.cells[1] + 1);
    uint32_t *spots = nodes < SAMPLE_NONE ? malloc(nodes * sizeof *spots) : NULL;
    bool complete;
    if (!spots)
        return err_set(err, ERR_INPUT, "sampling: no memory for a grid of %zu points", nodes);
    bool ok = add_nodes(sampler, &grid, spots, &complete, err);
    if (ok && complete)
        share_cells(sampler, &grid, spots);
    sampler->fills[patch] = complete ? FILL_DONE : FILL_SETTLE;
    free(spots);
    return ok;
}

bool sample_grid_fill(Sampler *sampler, Err *err) {
    uint32_t done = 0;
    bool *seen = calloc((size_t)sampler->rectangle_count + 1, sizeof *seen);
    bool ok = seen || err_set(err, ERR_INPUT, "sampling: no memory for the grids");
    for (uint32_t t = 0; ok && t < sampler->mesh->triangle_count && done < sampler->rectangle_count; t++) {
        uint32_t patch = sampler->patches[t];
        if (patch >= sampler->rectangle_count || seen[patch] ||
            !(dvec_dot(sampler->normals[t], sampler->normals[t]) > 0.0))
            continue;
        seen[patch] = true;
        done++;
        ok = fill_rectangle(sampler, patch, t, err);
    }
    free(seen);
    return ok;
}
