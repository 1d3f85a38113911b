/* Set-ups and figures of [Carensac2023] sec. 5. Of the figures that the paper only draws, what its text says
 * in numbers is given. */
#include "carensac.h"

#include "engine/base/file.h"
#include "engine/base/random.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define COUNT(table) ((int)(sizeof(table) / sizeof *(table)))
#define NONE         ((double)NAN)

/* ---- Sheets ---- */

static const SheetColumn fill_columns[CARENSAC_FILL_COLUMNS] = {
    [CARENSAC_PARTICLES] = {"N_particles", "particles", 0, 0},
    [CARENSAC_NEAR] = {"N_NearBoundary", "near", 0, 0},
    [CARENSAC_NEAR_BEFORE] = {"N_NearBoundary_before", "(before)", 0, 0},
    [CARENSAC_LOADING] = {"t_loading", "load, ms", 1, 0},
    [CARENSAC_SELECTION] = {"t_selection", "select, ms", 1, 0},
    [CARENSAC_STABILIZATION] = {"t_stabilization", "stabilise, ms", 1, 0},
    [CARENSAC_TOTAL] = {"t_total", "total, ms", 1,
                        1u << CARENSAC_LOADING | 1u << CARENSAC_SELECTION | 1u << CARENSAC_STABILIZATION},
    [CARENSAC_SELECTION_PASSES] = {"iter_sel", "iter. sel.", 0, 0},
    [CARENSAC_STABILIZATION_STEPS] = {"iter_stab", "iter. stab.", 0, 0},
    [CARENSAC_DENSITY] = {"density_mean", "density, kg/m3", 2, 0},
    [CARENSAC_DENSITY_ERROR] = {"density_error_percent", "error, %", 2, 0},
    [CARENSAC_SPREAD] = {"density_spread_percent", "spread, %", 2, 0},
    [CARENSAC_FREE_MEAN] = {"v_mean_cm_s", "free: mean, cm/s", 2, 0},
    [CARENSAC_FREE_MAX] = {"v_max_cm_s", "largest, cm/s", 1, 0},
};

static const SheetColumn float_columns[CARENSAC_FLOAT_COLUMNS] = {
    [CARENSAC_HEIGHT_END] = {"height_end_r", "height, last second, r", 2, 0},
    [CARENSAC_HEIGHT_MAX] = {"height_max_r", "largest change of height, r", 2, 0},
    [CARENSAC_ROLL_MAX] = {"roll_max_deg", "largest roll, deg", 3, 0},
    [CARENSAC_PITCH_MAX] = {"pitch_max_deg", "largest pitch, deg", 3, 0},
};

static const SheetColumn wedge_columns[CARENSAC_WEDGE_COLUMNS] = {
    [CARENSAC_SIDE_START] = {"particles_start", "particles, absorbing side", 0, 0},
    [CARENSAC_SIDE_LEAST] = {"particles_least", "least", 0, 0},
    [CARENSAC_SIDE_END] = {"particles_5_9s", "at 5.9 s", 0, 0},
    [CARENSAC_DEPTH_END] = {"depth_5_9s", "depth at 5.9 s, m", 3, 0},
    [CARENSAC_ENERGY_RATIO] = {"energy_ratio_2_1s", "energy closed : absorbing, 2.1 s", 2, 0},
    [CARENSAC_ENERGY_END] = {"energy_percent_5_9s", "absorbing / closed at 5.9 s, %", 1, 0},
};

static const SheetColumn boat_columns[CARENSAC_BOAT_COLUMNS] = {
    [CARENSAC_BOAT_PARTICLES] = {"particles", "particles", 0, 0},
    [CARENSAC_BOAT_SAMPLES] = {"boundary_samples", "boundary samples", 0, 0},
    [CARENSAC_BOAT_STEP] = {"ms_per_step", "step, ms", 1, 0},
    [CARENSAC_BOAT_ABSORB] = {"ms_absorption", "absorption, ms", 1, 0},
    [CARENSAC_BOAT_MOVE] = {"ms_move", "step with move, ms", 1, 0},
    [CARENSAC_BOAT_AFTER] = {"ms_after_move", "after a move, ms", 1, 0},
    [CARENSAC_BOAT_MEAN] = {"ms_mean", "mean, ms", 1, 0},
    [CARENSAC_BOAT_SPEED] = {"speed", "speed, m/s", 2, 0},
    [CARENSAC_BOAT_BOW_UP] = {"bow_up_deg", "bow up, deg", 2, 0},
};

/* A row: its figures in the order of the columns, as far as the paper gives them. */
typedef struct PaperRow {
    const char *name;
    double figures[CARENSAC_FILL_COLUMNS];
} PaperRow;

static const PaperRow table1_rows[] = {
    [CARENSAC_FLUID_FLUID] = {"fluid-fluid",
                              {1045405, 55098, 62048, 15.0, 109.3, 122.1, 246.4, 6, 6, NONE, NONE, 3.4, NONE,
                               NONE}},
    [CARENSAC_FLUID_BOUNDARY] = {"fluid-boundary",
                                 {605810, 49895, 62007, 14.1, 88.3, 124.0, 226.4, 6, 10, NONE, NONE, 6.9,
                                  NONE, NONE}},
    [CARENSAC_PYRAMID] = {"pyramid",
                          {75142, 21222, 22963, 15.5, 38.0, 183.5, 237.0, 7, 10, NONE, NONE, NONE, NONE,
                           NONE}},
    [CARENSAC_FLOATING_CUBE] = {"floating cube",
                                {309225, 44662, 48293, 15.2, 74.3, 156.8, 244.7, 7, 10, NONE, NONE, NONE,
                                 NONE, NONE}},
};

static const PaperRow float_rows[] = {{"floating cube", {0.4, NONE, 0.2, 0.2}}};
static const PaperRow wedge_rows[] = {{"wedge", {46000, 38000, 40200, 1, 3, NONE}}};
static const PaperRow boat_rows[] = {
    {"cylinder 5 m", {750000, 300000, 75, 3.5, 96, 120, 100, 2.9, NONE}},
    {"cylinder 2.5 m", {187000, 114000, 25, NONE, 40, NONE, 30, NONE, NONE}},
};

/* As in the authors' drivers. */
static const double base_steps[] = {5, 10, 15, 20, 25, 30, 40, 50, 60, 70, 80, 100};
static const double ratios[] = {0.25, 0.5, 1, 1.5, 2, 2.5, 3, 4, 5, 7, 10};

/* What the text of sec. 5.2 says about single points of fig. 2. */
static const struct {
    CarensacVariant variant;
    double error, total;
} fig2_figures[] = {
    {{CARENSAC_BASE, 5}, 0.1, 380},         {{CARENSAC_REGULATOR, 2}, NONE, 244},
    {{CARENSAC_REGULATOR, 2.5}, 1.2, 212},  {{CARENSAC_PROTECTION, 2}, NONE, 242},
    {{CARENSAC_PROTECTION, 2.5}, 0.2, 232},
};

CarensacVariant carensac_variant(int row) {
    if (row < COUNT(base_steps))
        return (CarensacVariant){CARENSAC_BASE, base_steps[row]};
    row -= COUNT(base_steps);
    return row < COUNT(ratios) ? (CarensacVariant){CARENSAC_REGULATOR, ratios[row]}
                               : (CarensacVariant){CARENSAC_PROTECTION, ratios[row - COUNT(ratios)]};
}

static bool add_rows(Sheet *sheet, const PaperRow *rows, int count, Err *err) {
    for (int i = 0; i < count; i++) {
        const int row = sheet_add_row(sheet, rows[i].name, err);
        if (row < 0)
            return false;
        memcpy(sheet->rows[row].paper, rows[i].figures, (size_t)sheet->column_count * sizeof(double));
    }
    return true;
}

/* The same once more without figures: what the engine does by itself is not the paper's. */
static bool add_default_rows(Sheet *sheet, const PaperRow *rows, int count, Err *err) {
    for (int i = 0; i < count; i++) {
        char name[SHEET_NAME_SIZE];
        snprintf(name, sizeof name, "%s, defaults", rows[i].name);
        if (sheet_add_row(sheet, name, err) < 0)
            return false;
    }
    return true;
}

static bool add_variants(Sheet *sheet, Err *err) {
    static const char *const names[] = {"base", "regulator", "regulator+protection"};
    for (int r = 0; r < COUNT(base_steps) + 2 * COUNT(ratios); r++) {
        const CarensacVariant variant = carensac_variant(r);
        char name[SHEET_NAME_SIZE];
        snprintf(name, sizeof name, "%s %g", names[variant.rule], variant.parameter);
        const int row = sheet_add_row(sheet, name, err);
        if (row < 0)
            return false;
        for (int i = 0; i < COUNT(fig2_figures); i++)
            if (fig2_figures[i].variant.rule == variant.rule &&
                fig2_figures[i].variant.parameter == variant.parameter) {
                sheet->rows[row].paper[CARENSAC_DENSITY_ERROR] = fig2_figures[i].error;
                sheet->rows[row].paper[CARENSAC_TOTAL] = fig2_figures[i].total;
            }
    }
    return true;
}

bool carensac_sheet(CarensacSheet which, Sheet *sheet, Err *err) {
    static const struct {
        const char *name, *title, *source, *row_key;
        const SheetColumn *columns;
        int column_count;
        const PaperRow *rows; /* NULL: the variants of fig. 2 */
        int row_count;
    } kinds[CARENSAC_SHEET_COUNT] = {
        [CARENSAC_TABLE1] = {"table1", "Filling with water at rest", "[Carensac2023] table 1 and sec. 5.3",
                             "simulation", fill_columns, CARENSAC_FILL_COLUMNS, table1_rows,
                             COUNT(table1_rows)},
        [CARENSAC_FIG2] = {"fig2", "Rules of the selection, floating cube",
                           "[Carensac2023] fig. 2 and sec. 5.2", "variant", fill_columns, CARENSAC_FREE_MEAN,
                           NULL, 0},
        [CARENSAC_FIG4C] = {"fig4c", "A floating cube after filling, 3 s",
                            "[Carensac2023] fig. 4c and sec. 5.5", "simulation", float_columns,
                            CARENSAC_FLOAT_COLUMNS, float_rows, COUNT(float_rows)},
        [CARENSAC_FIG5] = {"fig5", "Waves of a wedge absorbed at one end",
                           "[Carensac2023] fig. 5 and sec. 5.6", "simulation", wedge_columns,
                           CARENSAC_WEDGE_COLUMNS, wedge_rows, COUNT(wedge_rows)},
        [CARENSAC_BOAT] = {"boat", "A boat in a window that follows it", "[Carensac2023] sec. 5.7", "window",
                           boat_columns, CARENSAC_BOAT_COLUMNS, boat_rows, COUNT(boat_rows)},
    };
    *sheet = sheet_make(kinds[which].name, kinds[which].title, kinds[which].source, kinds[which].row_key,
                        kinds[which].columns, kinds[which].column_count);
    bool good = kinds[which].rows ? add_rows(sheet, kinds[which].rows, kinds[which].row_count, err)
                                  : add_variants(sheet, err);
    if (which == CARENSAC_TABLE1 || which == CARENSAC_FIG4C)
        good = good && add_default_rows(sheet, kinds[which].rows, kinds[which].row_count, err);
    if (!good)
        sheet_free(sheet);
    return good;
}

/* ---- Set-ups ---- */

static void begin(CarensacSetup *setup, double radius, int block_count) {
    *setup = (CarensacSetup){.def = skiff_def_default()};
    setup->def.params.particle_radius = (float)radius;
    setup->def.blocks = setup->blocks;
    setup->def.block_count = block_count;
    for (int b = 0; b < COUNT(setup->blocks); b++)
        setup->blocks[b] = skiff_block_default();
}

static void set_box(float min[3], float max[3], float half_x, float half_z, float bottom, float top) {
    memcpy(min, (float[]){-half_x, bottom, -half_z}, 3 * sizeof *min);
    memcpy(max, (float[]){half_x, top, half_z}, 3 * sizeof *max);
}

/* A closed box from y = 0 to `height`, of which water wets no more than a support radius above `level`. */
static void set_tank(CarensacSetup *setup, float half_x, float half_z, float height, float level) {
    SkiffTankDef *tank = &setup->def.tank;
    tank->geometry = skiff_geometry_default();
    tank->geometry.kind = SKIFF_GEOMETRY_BOX;
    memcpy(tank->geometry.size, (float[]){2 * half_x, height, 2 * half_z}, sizeof tank->geometry.size);
    tank->geometry.translation[1] = 0.5f * height;
    tank->wet_height = level + 4 * setup->def.params.particle_radius;
}

static void set_up_fluid_fluid(CarensacSetup *setup, double radius) {
    begin(setup, radius, 2);
    set_tank(setup, 3, 3, 6, 3);
    set_box(setup->blocks[0].start, setup->blocks[0].end, 3, 3, 0, 3);
    set_box(setup->blocks[1].start, setup->blocks[1].end, 2.5f, 2.5f, 0.5f, 3);
    setup->removes = true;
    /* All of the middle, with what stands a little above the surface. */
    set_box(setup->removed_min, setup->removed_max, 2.5f, 2.5f, 0.5f, 6);
}

static void set_up_fluid_boundary(CarensacSetup *setup, double radius) {
    begin(setup, radius, 1);
    set_tank(setup, 2.5f, 2.5f, 6, 2.5f);
    set_box(setup->blocks[0].start, setup->blocks[0].end, 2.5f, 2.5f, 0, 2.5f);
}

/* Half immersed at rest: water keeps a layer around the cube free, so that a density of 550 does that, not
 * 500. The paper does not give it; it is the authors' scene file's. With other radii the layer is another. */
static float cube_density(double radius) {
    const double edge = 2.0, layer = 1.15; /* m, r */
    const double swollen = (edge + 2 * layer * radius) / (edge + 2 * layer * CARENSAC_RADIUS);
    return (float)(550 * swollen * swollen * swollen);
}

static void set_up_floating_cube(CarensacSetup *setup, double radius) {
    begin(setup, radius, 1);
    set_tank(setup, 1.75f, 1.75f, 5, 3);
    set_box(setup->blocks[0].start, setup->blocks[0].end, 1.75f, 1.75f, 0, 3);
    setup->body = skiff_body_default();
    setup->body.name = "cube";
    setup->body.geometry.kind = SKIFF_GEOMETRY_BOX;
    memcpy(setup->body.geometry.size, (float[]){2, 2, 2}, sizeof setup->body.geometry.size);
    memcpy(setup->body.geometry.rotation_axis, (float[]){1, 0, 0}, sizeof setup->body.geometry.rotation_axis);
    setup->body.geometry.rotation_angle = 0.78539816f;
    setup->body.geometry.translation[1] = 3;
    setup->body.density = cube_density(radius);
    setup->body.free_axes = SKIFF_FREE_ALL;
    setup->def.bodies = &setup->body;
    setup->def.body_count = 1;
}

/* Squares on top of each other: five frusta, each narrowing from 2 m to 1 m, with ledges between, and a
 * pyramid. */
static void write_pyramid(FILE *out) {
    enum { RINGS = 11 };
    fprintf(out, "# Pyramids of 2 m, each 1 m above the one before [Carensac2023 sec. 5.4]\n");
    for (int ring = 0; ring < RINGS; ring++) {
        const double half = ring % 2 == 0 ? 1.0 : 0.5, y = (ring + 1) / 2;
        fprintf(out, "v %g %g %g\nv %g %g %g\nv %g %g %g\nv %g %g %g\n", -half, y, -half, -half, y, half,
                half, y, half, half, y, -half);
    }
    fprintf(out, "v 0 7 0\nf 4 3 2 1\n");
    for (int ring = 0; ring + 1 < RINGS; ring++)
        for (int side = 0; side < 4; side++) {
            const int a = 4 * ring + side + 1, b = 4 * ring + (side + 1) % 4 + 1;
            fprintf(out, "f %d %d %d %d\n", a, b, b + 4, a + 4);
        }
    for (int side = 0; side < 4; side++)
        fprintf(out, "f %d %d %d\n", 4 * (RINGS - 1) + side + 1, 4 * (RINGS - 1) + (side + 1) % 4 + 1,
                4 * RINGS + 1);
}

static bool set_up_pyramid(CarensacSetup *setup, double radius, const char *folder, Err *err) {
    FileWriter writer;
    begin(setup, radius, 1);
    snprintf(setup->mesh, sizeof setup->mesh, "%.4000s/pyramid-stack.obj", folder);
    if (!file_begin(&writer, setup->mesh, err))
        return false;
    write_pyramid(writer.stream);
    if (!file_commit(&writer, err))
        return false;
    SkiffTankDef *tank = &setup->def.tank;
    tank->geometry = skiff_geometry_default();
    tank->geometry.kind = SKIFF_GEOMETRY_MESH;
    tank->geometry.file = setup->mesh;
    tank->wet_height = 3.5f + 4 * setup->def.params.particle_radius;
    set_box(setup->blocks[0].start, setup->blocks[0].end, 1, 1, 0, 3.5f);
    return true;
}

double carensac_time_step(double radius) {
    static const double paper = 0.003; /* s */
    return paper * radius / CARENSAC_RADIUS;
}

void carensac_set_paper_method(SkiffParams *params) {
    params->rest_settle = SKIFF_REST_SETTLE_CANDIDATES;
    params->rest_schedule = SKIFF_REST_SCHEDULE_CONSTANT;
    params->rest_retention = 0.8f;
    params->rest_steps = 10;
    params->rest_min_steps = 4;
    params->rest_time_scale = 1.0f;
    params->rest_max_speed = 0.25f;
    params->rest_mean_speed = 0.025f; /* the drivers of table 1; 0.05 in the text */
    params->calming = 0.0f;
}

bool carensac_set_up(int experiment, double radius, const char *folder, CarensacSetup *setup, Err *err) {
    switch (experiment) {
    case CARENSAC_FLUID_FLUID:
        set_up_fluid_fluid(setup, radius);
        return true;
    case CARENSAC_FLUID_BOUNDARY:
        set_up_fluid_boundary(setup, radius);
        return true;
    case CARENSAC_PYRAMID:
        return set_up_pyramid(setup, radius, folder, err);
    default:
        set_up_floating_cube(setup, radius);
        return true;
    }
}

void carensac_offset(int run, double radius, double offset[3]) {
    for (int k = 0; k < 3; k++)
        offset[k] = 2.0 * radius * (2.0 * random_share(2023, 3 * (uint64_t)run + (uint64_t)k) - 1.0);
}
