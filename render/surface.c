/* Which particles are drawn.
 *
 * Particles are counted in cubic cells of two spacings. A cell that holds less than a third of what water
 * holds is open. Particles whose cell touches an open one on the side of the eye are drawn: about two layers.
 * Over an ocean the space beside the window counts as full, as the ocean covers it. Particles alone in their
 * neighbourhood become droplets: smaller ones, scattered around the particle by its id, stretched along its
 * path.
 *
 * Counting is exact integer work in the order of the input, so that equal input gives equal lists. A few
 * particles far away only make the cells larger: more is drawn, never less. */
#include "surface.h"

#include "engine/base/random.h"

#include <math.h>
#include <string.h>

enum {
    MAX_CELLS = 1 << 22,
    DEPTH_BINS = 4096,
    DROPLETS_EACH = 12,
    ALONE_AT_MOST = 6, /* particles in 3 x 3 x 3 fine cells, itself included */
};
enum {
    MEMORY_BODY,
    MEMORY_DROPLETS,
    MEMORY_FADING,
    MEMORY_SORTED,
    MEMORY_CELLS,
    MEMORY_FINE,
    MEMORY_COLUMNS,
    MEMORY_CELL_OF
};

/* A cell with less than this part of a full one is open. The smaller the spheres that are drawn, the more
 * layers must stand behind their gaps. */
#define OPEN_PART_OCEAN   0.25f
#define OPEN_PART_TANK    0.45f
#define OPEN_PART_SPHERES 0.60f
#define CALM_HEIGHT       0.15f  /* m above still water; below it the sea has no bottom to be seen */
#define SOLID_FADE        0.5f   /* what fades more than this hides nothing */
#define DROPLET_SHOW      0.012f /* s of path shown by a droplet's stretch */
#define WATER_PART        0.8f   /* mass of a particle / (rho0 d^3) */

typedef struct Cells {
    int size[3]; /* with a margin of one empty cell on every side */
    float origin[3], inv_edge;
    uint16_t *count;
    uint8_t *fine;   /* the same for cells of half the edge */
    uint8_t *column; /* 1: some particle is above or below */
    int32_t *cell_of;
    float full;     /* particles in a cell of water */
    int open_below; /* counts below this make a cell open */
} Cells;

static float fade_of(const GfxParticles *particles, uint32_t i) {
    return particles->fade ? particles->fade[i] : 1.0f;
}

static bool find_bounds(const GfxParticles *particles, float min[3], float max[3], Err *err) {
    bool some = false;
    for (uint32_t i = 0; i < particles->count; i++) {
        bool counts = fade_of(particles, i) > 0.0f, first = counts && !some;
        some = some || counts;
        for (int k = 0; k < 3; k++) {
            float x = particles->position[i][k];
            if (!isfinite(x))
                return err_set(err, ERR_USAGE, "particle %u of %u has coordinate %c = %g", i,
                               particles->count, "xyz"[k], (double)x);
            min[k] = first || (counts && x < min[k]) ? x : min[k];
            max[k] = first || (counts && x > max[k]) ? x : max[k];
        }
    }
    return true;
}

static bool make_cells(Cells *cells, Surface *surface, const GfxParticles *particles, float open_part,
                       Err *err) {
    float min[3] = {0.0f}, max[3] = {0.0f}, edge = 2.0f * particles->spacing;
    if (!find_bounds(particles, min, max, err))
        return false;
    double total;
    for (;; edge *= 2.0f) {
        total = 1.0;
        for (int k = 0; k < 3; k++)
            total *= floor((double)(max[k] - min[k]) / edge) + 4.0;
        if (total <= MAX_CELLS)
            break;
    }
    for (int k = 0; k < 3; k++) {
        cells->size[k] = (int)floorf((max[k] - min[k]) / edge) + 4;
        cells->origin[k] = min[k] - 1.5f * edge;
    }
    cells->inv_edge = 1.0f / edge;
    float ratio = edge / particles->spacing;
    cells->full = ratio * ratio * ratio / WATER_PART;
    float open = ceilf(open_part * cells->full);
    cells->open_below = open > 60000.0f ? 60000 : (int)open;
    size_t count = (size_t)cells->size[0] * (size_t)cells->size[1] * (size_t)cells->size[2];
    size_t columns = (size_t)cells->size[0] * (size_t)cells->size[2];
    Buffer *memory = surface->memory;
    if (!buffer_reserve(&memory[MEMORY_CELLS], "surface cells", count * sizeof *cells->count, err) ||
        !buffer_reserve(&memory[MEMORY_FINE], "surface cells", 8 * count, err) ||
        !buffer_reserve(&memory[MEMORY_COLUMNS], "surface columns", columns, err) ||
        !buffer_reserve(&memory[MEMORY_CELL_OF], "surface particles",
                        particles->count * sizeof *cells->cell_of, err))
        return false;
    cells->count = memory[MEMORY_CELLS].data;
    cells->fine = memory[MEMORY_FINE].data;
    cells->column = memory[MEMORY_COLUMNS].data;
    cells->cell_of = memory[MEMORY_CELL_OF].data;
    memset(cells->count, 0, count * sizeof *cells->count);
    memset(cells->fine, 0, 8 * count);
    memset(cells->column, 0, columns);
    return true;
}

static int cell_coordinate(const Cells *cells, float x, int k) {
    return (int)((x - cells->origin[k]) * cells->inv_edge);
}

static size_t fine_cell(const Cells *cells, const float p[3]) {
    size_t f[3];
    for (int k = 0; k < 3; k++)
        f[k] = (size_t)((p[k] - cells->origin[k]) * (2.0f * cells->inv_edge));
    return (f[2] * 2 * (size_t)cells->size[0] + f[0]) * 2 * (size_t)cells->size[1] + f[1];
}

/* y runs fastest, so that columns are contiguous. What is not there counts nowhere. */
static void count_particles(Cells *cells, const GfxParticles *particles) {
    for (uint32_t i = 0; i < particles->count; i++) {
        const float *p = particles->position[i];
        cells->cell_of[i] = 0;
        if (!(fade_of(particles, i) > 0.0f))
            continue;
        int x = cell_coordinate(cells, p[0], 0), y = cell_coordinate(cells, p[1], 1);
        int column = cell_coordinate(cells, p[2], 2) * cells->size[0] + x;
        int cell = column * cells->size[1] + y;
        cells->cell_of[i] = cell;
        uint8_t *fine = &cells->fine[fine_cell(cells, p)];
        cells->column[column] = 1;
        *fine += *fine < UINT8_MAX;
        if (fade_of(particles, i) >= SOLID_FADE && cells->count[cell] < UINT16_MAX)
            cells->count[cell]++;
    }
}

/* Does the cell touch an open one on the side of the eye, or is it open itself? */
static bool is_outer(const Cells *cells, int cell, const int eye[3], bool ocean) {
    int y = cell % cells->size[1], column = cell / cells->size[1];
    int c[3] = {column % cells->size[0], y, column / cells->size[0]}, from[3], to[3];
    for (int k = 0; k < 3; k++) {
        from[k] = c[k] > eye[k] - 2 ? -1 : 0;
        to[k] = c[k] < eye[k] + 2 ? 1 : 0;
    }
    for (int dz = from[2]; dz <= to[2]; dz++)
        for (int dx = from[0]; dx <= to[0]; dx++) {
            int near = column + dz * cells->size[0] + dx;
            if (ocean && !cells->column[near])
                continue;
            for (int dy = from[1]; dy <= to[1]; dy++)
                if (cells->count[near * cells->size[1] + y + dy] < cells->open_below)
                    return true;
        }
    return false;
}

static bool is_alone(const Cells *cells, const float p[3]) {
    size_t along_x = 2 * (size_t)cells->size[1], along_z = 2 * (size_t)cells->size[0] * along_x;
    const uint8_t *corner = &cells->fine[fine_cell(cells, p) - along_z - along_x - 1];
    int total = 0;
    for (size_t z = 0; z < 3; z++)
        for (size_t x = 0; x < 3; x++)
            for (size_t y = 0; y < 3; y++)
                total += corner[z * along_z + x * along_x + y];
    return total <= ALONE_AT_MOST;
}

/* ---- Droplets ---- */

/* From [0, 1): the same droplets in every frame. */
static float random_part(uint64_t id, uint64_t draw) {
    return (float)(random_bits(0, id * 128 + draw) >> 40) * 0x1p-24f;
}

static void add_droplets(SurfaceList *list, const GfxParticles *particles, uint32_t i) {
    uint64_t id = particles->id ? particles->id[i] : i;
    float fade = fade_of(particles, i), d = particles->spacing;
    for (uint64_t k = 0; k < DROPLETS_EACH; k++) {
        SurfacePoint *point = &list->points[list->count++];
        float along = random_part(id, 8 * k + 6) - 0.5f, size = random_part(id, 8 * k + 7);
        for (uint64_t axis = 0; axis < 3; axis++) {
            /* Two draws: denser in the middle. */
            float off = random_part(id, 8 * k + axis) + random_part(id, 8 * k + axis + 3) - 1.0f;
            float path = particles->velocity ? particles->velocity[i][axis] * DROPLET_SHOW : 0.0f;
            point->position[axis] = particles->position[i][axis] + 1.3f * d * off + path * along * 2.0f;
        }
        point->value = d * (0.03f + 0.10f * size * size * size);
        point->fade = fade * 0.85f;
    }
}

/* ---- Order of what fades ---- */

static float depth_along(const float axis[3], const SurfacePoint *point) {
    return point->position[0] * axis[0] + point->position[1] * axis[1] + point->position[2] * axis[2];
}

/* Farthest first by distance along the view, in bins; the order of the input within a bin. */
static bool sort_far_first(Surface *surface, const GfxCamera *camera, Err *err) {
    SurfaceList *list = &surface->fading;
    uint32_t starts[DEPTH_BINS + 1] = {0};
    float axis[3], min = INFINITY, max = -INFINITY;
    for (int k = 0; k < 3; k++)
        axis[k] = camera->target[k] - camera->eye[k];
    size_t size = (size_t)list->count * sizeof(SurfacePoint);
    if (!buffer_reserve(&surface->memory[MEMORY_SORTED], "fading particles", size, err))
        return false;
    SurfacePoint *sorted = surface->memory[MEMORY_SORTED].data;
    for (uint32_t i = 0; i < list->count; i++) {
        float depth = depth_along(axis, &list->points[i]);
        min = depth < min ? depth : min;
        max = depth > max ? depth : max;
    }
    float scale = max > min ? (DEPTH_BINS - 1) / (max - min) : 0.0f;
    for (uint32_t i = 0; i < list->count; i++)
        starts[(int)((max - depth_along(axis, &list->points[i])) * scale) + 1]++;
    for (int bin = 0; bin < DEPTH_BINS; bin++)
        starts[bin + 1] += starts[bin];
    for (uint32_t i = 0; i < list->count; i++)
        sorted[starts[(int)((max - depth_along(axis, &list->points[i])) * scale)]++] = list->points[i];
    list->points = sorted;
    return true;
}

/* ---- All ---- */

static bool reserve_lists(Surface *surface, uint32_t count, Err *err) {
    Buffer *memory = surface->memory;
    size_t size = (size_t)count * sizeof(SurfacePoint);
    if (!buffer_reserve(&memory[MEMORY_BODY], "drawn particles", size, err) ||
        !buffer_reserve(&memory[MEMORY_FADING], "fading particles", size, err))
        return false;
    surface->body = (SurfaceList){memory[MEMORY_BODY].data, 0};
    surface->fading = (SurfaceList){memory[MEMORY_FADING].data, 0};
    surface->droplets = (SurfaceList){NULL, 0};
    return true;
}

/* The lone ones, known after a first sweep, give several points each. */
static bool fill_droplets(Surface *surface, const Cells *cells, const GfxParticles *particles, Err *err) {
    uint32_t alone = 0;
    for (uint32_t i = 0; i < particles->count; i++)
        alone += cells->cell_of[i] < 0;
    Buffer *memory = &surface->memory[MEMORY_DROPLETS];
    if (!buffer_reserve(memory, "droplets", (size_t)alone * DROPLETS_EACH * sizeof(SurfacePoint), err))
        return false;
    surface->droplets.points = memory->data;
    for (uint32_t i = 0; i < particles->count; i++)
        if (cells->cell_of[i] < 0)
            add_droplets(&surface->droplets, particles, i);
    return true;
}

/* How much the 27 cells around are filled: a quarter is a sheet, half the surface of a body of water. */
static float bulk_of(const Cells *cells, int cell) {
    int total = 0;
    for (int z = -1; z <= 1; z++)
        for (int x = -1; x <= 1; x++)
            for (int y = -1; y <= 1; y++)
                total += cells->count[cell + (z * cells->size[0] + x) * cells->size[1] + y];
    float part = ((float)total / (27.0f * cells->full) - 0.20f) / 0.20f;
    return part < 0.0f ? 0.0f : part > 1.0f ? 1.0f : part;
}

/* Do particles count there? (Distances are interpolated from the nearest sample: the margin is wide.) */
static bool is_in_window(const GfxOcean *ocean, float spacing, const float p[3]) {
    int at[2];
    for (int k = 0; k < 2; k++) {
        float part = (p[2 * k] - ocean->edge_min[k]) / (ocean->edge_max[k] - ocean->edge_min[k]);
        float place = part * (float)(ocean->edge_size[k] - 1) + 0.5f;
        if (!(place >= 0.0f && place < (float)ocean->edge_size[k]))
            return false;
        at[k] = (int)place;
    }
    float half_cell = 0.0f;
    for (int k = 0; k < 2; k++)
        half_cell += 0.5f * (ocean->edge_max[k] - ocean->edge_min[k]) / (float)(ocean->edge_size[k] - 1);
    return ocean->edge_distance[(size_t)at[1] * ocean->edge_size[0] + (size_t)at[0]] >
           ocean->blend[0] - half_cell - 3.0f * spacing;
}

static SurfacePoint make_point(const GfxParticles *particles, const float *values, uint32_t i, float bulk) {
    const float *p = particles->position[i];
    return (SurfacePoint){{p[0], p[1], p[2]}, fade_of(particles, i), values ? values[i] : 0.0f, bulk};
}

bool surface_select(Surface *surface, const GfxScene *scene, GfxLook look, Err *err) {
    const GfxParticles *particles = &scene->particles;
    bool water = look == GFX_LOOK_WATER;
    bool ocean = water && scene->ocean.enabled;
    float open_part = ocean ? OPEN_PART_OCEAN : water ? OPEN_PART_TANK : OPEN_PART_SPHERES;
    float calm_level = scene->ocean.level + CALM_HEIGHT;
    uint32_t plain = 0;
    Cells cells;
    if (!reserve_lists(surface, particles->count, err))
        return false;
    if (particles->count == 0)
        return true;
    if (!make_cells(&cells, surface, particles, open_part, err))
        return false;
    count_particles(&cells, particles);
    int eye[3];
    for (int k = 0; k < 3; k++) {
        float cell = (scene->camera.eye[k] - cells.origin[k]) * cells.inv_edge;
        eye[k] = (int)(cell < -9.0f ? -9.0f : cell > 1e6f ? 1e6f : cell);
    }
    const float *values = water ? particles->foam : particles->field;
    for (uint32_t i = 0; i < particles->count; i++) {
        float fade = fade_of(particles, i);
        int cell = cells.cell_of[i];
        if (!(fade > 0.0f) || !is_outer(&cells, cell, eye, ocean))
            continue;
        if (water && is_alone(&cells, particles->position[i])) {
            cells.cell_of[i] = -1;
            continue;
        }
        if (ocean && !is_in_window(&scene->ocean, particles->spacing, particles->position[i]))
            continue;
        SurfacePoint point = make_point(particles, values, i, water ? bulk_of(&cells, cell) : 0.0f);
        if (!water && fade < 1.0f)
            surface->fading.points[surface->fading.count++] = point;
        else if (!ocean || point.value > 0.0f || point.position[1] > calm_level)
            surface->body.points[surface->body.count++] = point;
        else
            surface->body.points[particles->count - ++plain] = point;
    }
    /* What is plain was stored from the end downwards. */
    surface->rich_count = surface->body.count;
    memmove(surface->body.points + surface->body.count, surface->body.points + (particles->count - plain),
            (size_t)plain * sizeof(SurfacePoint));
    surface->body.count += plain;
    if (water)
        return fill_droplets(surface, &cells, particles, err);
    return sort_far_first(surface, &scene->camera, err);
}

void surface_free(Surface *surface) {
    for (size_t i = 0; i < sizeof surface->memory / sizeof surface->memory[0]; i++)
        buffer_free(&surface->memory[i]);
    *surface = (Surface){0};
}
