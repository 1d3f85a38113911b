/* The particles carry their foam away when they leave the window, and a boat's track would end with it. So
 * each frame leaves the foam of its surface in a map that stands still in the world and dies away.
 *
 * The map follows the particles over a tenth of a second or so, which evens out that there are only a few of
 * them in a cell. It neither flows nor spreads: what leaves the window moves little. The map is moved with
 * the window by whole cells. */
#include "wake.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { CELLS = WAKE_EDGE * WAKE_EDGE };

static const float cell_in_spacings = 1.5f;
static const float life = 3.5f;          /* s, to 1/e */
static const float follow = 0.12f;       /* s, in which the map follows the particles */
static const float surface_below = 2.5f; /* spacings below the highest particle of a cell: what is seen */

bool wake_make(Wake *wake, float spacing, Err *err) {
    *wake = (Wake){.cell = cell_in_spacings * spacing,
                   .amount = calloc(CELLS, sizeof *wake->amount),
                   .deposit = calloc(CELLS, sizeof *wake->deposit)};
    return (wake->amount && wake->deposit) || err_set(err, ERR_INPUT, "not enough memory for the wake");
}

void wake_free(Wake *wake) {
    free(wake->amount);
    free(wake->deposit);
    *wake = (Wake){0};
}

uint64_t wake_count(const Wake *wake) {
    return wake->amount ? CELLS : 0;
}

/* The window's middle to the middle of the map. */
static void move_map(Wake *wake, const Frame *frame) {
    double base[2];
    int by[2];
    for (int k = 0; k < 2; k++) {
        base[k] = floor(frame->window_centre[2 * k] / (double)wake->cell) - WAKE_EDGE / 2;
        double cells = wake->is_started ? base[k] - wake->base[k] : 0;
        by[k] = (int)fmax(-WAKE_EDGE, fmin(cells, WAKE_EDGE));
        wake->base[k] = base[k];
    }
    if (by[0] == 0 && by[1] == 0)
        return;
    float *moved = wake->deposit;
    memset(moved, 0, CELLS * sizeof *moved);
    int from = by[0] > 0 ? by[0] : 0, to = by[0] > 0 ? 0 : -by[0];
    size_t length = (size_t)(WAKE_EDGE - abs(by[0])) * sizeof *moved;
    for (int z = 0; z < WAKE_EDGE; z++)
        if (z + by[1] >= 0 && z + by[1] < WAKE_EDGE)
            memcpy(moved + z * WAKE_EDGE + to, wake->amount + (z + by[1]) * WAKE_EDGE + from, length);
    wake->deposit = wake->amount;
    wake->amount = moved;
}

typedef struct CellShare {
    int cell[4];
    float weight[4];
} CellShare;

/* The four cells around local x, z. False: beyond the map. */
static bool find_cells(const Wake *wake, const Frame *frame, const float position[4], CellShare *share) {
    float part[2];
    int at[2];
    for (int k = 0; k < 2; k++) {
        double x = (frame->origin[2 * k] + (double)position[2 * k]) / (double)wake->cell - wake->base[k];
        double low = floor(x);
        if (!(low >= 0 && low < WAKE_EDGE - 1))
            return false;
        at[k] = (int)low;
        part[k] = (float)(x - low);
    }
    for (int i = 0; i < 4; i++) {
        int dx = i & 1, dz = i >> 1;
        share->cell[i] = (at[1] + dz) * WAKE_EDGE + at[0] + dx;
        share->weight[i] = (dx ? part[0] : 1 - part[0]) * (dz ? part[1] : 1 - part[1]);
    }
    return true;
}

/* Foam of what lies at the surface, per cell and in units of a spacing squared. */
static void fill_deposit(Wake *wake, const Frame *frame, const float *foam) {
    float unit = 1 / (cell_in_spacings * cell_in_spacings);
    float low = (float)(frame->level - frame->origin[1]) - surface_below * frame->spacing;
    memset(wake->deposit, 0, CELLS * sizeof *wake->deposit);
    for (uint32_t i = 0; i < frame->live; i++) {
        CellShare share;
        if (foam[i] <= 0 || frame->position[i][1] < low ||
            !find_cells(wake, frame, frame->position[i], &share))
            continue;
        for (int k = 0; k < 4; k++)
            wake->deposit[share.cell[k]] += foam[i] * unit * share.weight[k];
    }
}

void wake_update(Wake *wake, const Frame *frame, const float *foam, const EdgeMap *window,
                 const float shift[2], float margin) {
    move_map(wake, frame);
    fill_deposit(wake, frame, foam);
    float dt = wake->is_started ? fmaxf(0, (float)(frame->time - wake->time)) : 0;
    float left = expf(-dt / life), near = 1 - expf(-dt / follow);
    for (int i = 0; i < CELLS; i++) {
        float x = (float)((wake->base[0] + i % WAKE_EDGE) * (double)wake->cell - frame->origin[0]);
        float z = (float)((wake->base[1] + i / WAKE_EDGE) * (double)wake->cell - frame->origin[2]);
        bool inside = edge_map_at(window, x - shift[0], z - shift[1]) > margin;
        float *amount = &wake->amount[i];
        *amount = inside ? *amount + (wake->deposit[i] - *amount) * near : *amount * left;
    }
    wake->time = frame->time;
    wake->is_started = true;
}
