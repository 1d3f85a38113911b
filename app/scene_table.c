/* Every key of a scene file, once. Keys, meanings and units follow SPlisHSPlasH scenes where there is such a
 * thing; keys of Configuration that set the simulation come from the engine's own list (engine/params.inl).
 */
#include "nearest.h"
#include "scene_rows.h"

#include <stdlib.h>
#include <string.h>

static void check_corners(const float min[3], const float max[3], const char *min_key, const char *max_key,
                          Problems *problems) {
    for (int k = 0; k < 3; k++)
        if (!(max[k] > min[k])) {
            size_t mark = problems_enter(problems, max_key);
            problems_enter_index(problems, (size_t)k);
            problems_add(problems, "%g is not above %s[%d], which is %g", (double)max[k], min_key, k,
                         (double)min[k]);
            problems_leave(problems, mark);
        }
}

/* ---- Configuration ---- */

static void init_configuration(void *object) {
    SkiffDef def = skiff_def_default();
    SceneConfiguration *configuration = object;
    *configuration = (SceneConfiguration){.params = def.params, .duration = 10, .start_time = def.start_time};
    set3(configuration->domain_min, NAN, NAN, NAN);
    set3(configuration->domain_max, NAN, NAN, NAN);
}

static void check_domain(void *object, Problems *problems) {
    const SceneConfiguration *configuration = object;
    if (is_given(configuration->domain_min) != is_given(configuration->domain_max))
        problems_add(problems, "domainMin and domainMax go together, one of them is missing");
    else if (is_given(configuration->domain_min))
        check_corners(configuration->domain_min, configuration->domain_max, "domainMin", "domainMax",
                      problems);
}

/* Row of a field that stands in one of the engine's own lists, in a struct `base` bytes into the object. */
static Field info_row(const SkiffParamInfo *info, size_t base) {
    static const FieldType types[] = {[SKIFF_FLOAT] = FIELD_FLOAT,
                                      [SKIFF_INT] = FIELD_INT,
                                      [SKIFF_BOOL] = FIELD_BOOL,
                                      [SKIFF_VEC3] = FIELD_VEC3,
                                      [SKIFF_ENUM] = FIELD_ENUM};
    return (Field){.key = info->key,
                   .type = types[info->type],
                   .offset = base + info->offset,
                   .min = info->min,
                   .max = info->max,
                   .unit = info->unit,
                   .names = info->names,
                   .help = info->help};
}

static bool param_row(int index, Field *field) {
    int count;
    const SkiffParamInfo *infos = skiff_param_infos(&count);
    if (index < count)
        *field = info_row(&infos[index], offsetof(SceneConfiguration, params));
    return index < count;
}

static const Field configuration_fields[] = {
    {ROW(FIELD_DOUBLE, SceneConfiguration, duration, "duration"), .min = 1e-6, .max = 1e6, .unit = "s",
     .help = "Simulated time"},
    {ROW(FIELD_DOUBLE, SceneConfiguration, start_time, "startTime"), .min = -1e6, .max = 1e6, .unit = "s",
     .help = "Time at the start"},
    {ROW(FIELD_DOUBLE, SceneConfiguration, probe_rate, "probeRate"), .min = 0, .max = 1e6, .unit = "Hz",
     .help = "Rows of probes.csv a second; 0 is one every step"},
    {ROW(FIELD_VEC3, SceneConfiguration, domain_min, "domainMin"), COORDINATE, .flags = FIELD_NULLABLE,
     .help = "Corner of the domain that particles must not leave; absent: bounds of everything, grown"},
    {ROW(FIELD_VEC3, SceneConfiguration, domain_max, "domainMax"), COORDINATE, .flags = FIELD_NULLABLE,
     .help = "The corner opposite to domainMin"},
};

static const FieldRule configuration_rules[] = {{"domainMin|domainMax", check_domain}};

static const ObjectType configuration_type = {.help = "Settings of the simulation",
                                              .fields = configuration_fields,
                                              .field_count = COUNT(configuration_fields),
                                              .more = param_row,
                                              .size = sizeof(SceneConfiguration),
                                              .init = init_configuration,
                                              .rules = configuration_rules,
                                              .rule_count = COUNT(configuration_rules)};

/* ---- Placement, shared by tanks and bodies ---- */

#define PLACEMENT_ROWS(struct_type, mask)                                                                    \
    {ROW(FIELD_VEC3, struct_type, placement.scale, "scale"), .min = 1e-6, .max = 1e6, .variants = mask,      \
     .help = "Factor along each axis, applied first"},                                                       \
        {ROW(FIELD_VEC3, struct_type, placement.rotation_axis, "rotationAxis"), .min = -1e6, .max = 1e6,     \
         .variants = mask, .help = "Axis of the rotation, applied after the scale"},                         \
        {ROW(FIELD_FLOAT, struct_type, placement.rotation_angle, "rotationAngle"),                           \
         .min = -1e3,                                                                                        \
         .max = 1e3,                                                                                         \
         .unit = "rad",                                                                                      \
         .variants = mask,                                                                                   \
         .help = "Angle of the rotation"},                                                                   \
    {                                                                                                        \
        ROW(FIELD_VEC3, struct_type, placement.translation, "translation"), COORDINATE,                      \
            .variants = mask, .help = "Where its own origin is put, applied last"                            \
    }

static ScenePlacement default_placement(void) {
    SkiffGeometryDef geometry = skiff_geometry_default();
    ScenePlacement placement = {.rotation_angle = geometry.rotation_angle};
    memcpy(placement.scale, geometry.scale, sizeof placement.scale);
    memcpy(placement.translation, geometry.translation, sizeof placement.translation);
    memcpy(placement.rotation_axis, geometry.rotation_axis, sizeof placement.rotation_axis);
    return placement;
}

static void check_rotation(const ScenePlacement *placement, Problems *problems) {
    const float *axis = placement->rotation_axis;
    if (placement->rotation_angle != 0 && axis[0] == 0 && axis[1] == 0 && axis[2] == 0) {
        size_t mark = problems_enter(problems, "rotationAxis");
        problems_add(problems, "has no direction, and rotationAngle is not 0");
        problems_leave(problems, mark);
    }
}

/* ---- Cylinders, stars and cones, shared by tanks and bodies ---- */

/* `variants` are those of a tank; members of bodies have 0. */
#define RADIUS_ROW(struct_type, member, mask)                                                                \
    {                                                                                                        \
        ROW(FIELD_FLOAT, struct_type, member, "radius"), LENGTH,                                             \
            .flags = FIELD_REQUIRED, .variants = mask,                                                       \
            .help = "Of a sphere or cylinder, of a star's tips, of a cone's floor"                           \
    }
#define HEIGHT_ROW(struct_type, member, mask)                                                                \
    {                                                                                                        \
        ROW(FIELD_FLOAT, struct_type, member, "height"), LENGTH,                                             \
            .flags = FIELD_REQUIRED, .variants = mask, .help = "Along y; half of it below its own origin"    \
    }
#define TOP_RADIUS_ROW(struct_type, member, mask)                                                            \
    {                                                                                                        \
        ROW(FIELD_FLOAT, struct_type, member, "topRadius"),                                                  \
            .min = 0, .max = 1e5, .unit = "m", .flags = FIELD_REQUIRED, .variants = mask,                    \
            .help = "Of the cone's top, narrower or wider than its floor; 0: a tip"                          \
    }
#define INNER_RADIUS_ROW(struct_type, member, mask)                                                          \
    {                                                                                                        \
        ROW(FIELD_FLOAT, struct_type, member, "innerRadius"), LENGTH,                                        \
            .flags = FIELD_REQUIRED, .variants = mask,                                                       \
            .help = "Of the corners between a star's tips; at most radius"                                   \
    }
#define BRANCHES_ROW(struct_type, member, mask)                                                              \
    {                                                                                                        \
        ROW(FIELD_INT, struct_type, member, "branches"),                                                     \
            .min = 2, .max = SKIFF_MAX_BRANCHES, .variants = mask,                                           \
            .help = "Tips of the star; the first one points towards +z"                                      \
    }

static SceneRound default_round(void) {
    SkiffGeometryDef geometry = skiff_geometry_default();
    return (SceneRound){.branches = geometry.branches};
}

static void init_round(void *object) {
    *(SceneRound *)object = default_round();
}

static void check_star(const SceneRound *star, Problems *problems) {
    if (star->inner_radius > star->radius) {
        size_t mark = problems_enter(problems, "innerRadius");
        problems_add(problems, "%g is above radius, which is %g", (double)star->inner_radius,
                     (double)star->radius);
        problems_leave(problems, mark);
    }
}

static void check_body_star(void *object, Problems *problems) {
    check_star(object, problems);
}

static const Field cylinder_fields[] = {RADIUS_ROW(SceneRound, radius, 0), HEIGHT_ROW(SceneRound, height, 0)};
static const Field star_fields[] = {BRANCHES_ROW(SceneRound, branches, 0), RADIUS_ROW(SceneRound, radius, 0),
                                    INNER_RADIUS_ROW(SceneRound, inner_radius, 0),
                                    HEIGHT_ROW(SceneRound, height, 0)};
static const Field cone_fields[] = {RADIUS_ROW(SceneRound, radius, 0),
                                    TOP_RADIUS_ROW(SceneRound, top_radius, 0),
                                    HEIGHT_ROW(SceneRound, height, 0)};

static const FieldRule star_rules[] = {{"radius|innerRadius", check_body_star}};

static const ObjectType cylinder_type = {.help = "An upright cylinder",
                                         .fields = cylinder_fields,
                                         .field_count = COUNT(cylinder_fields),
                                         .size = sizeof(SceneRound),
                                         .init = init_round};
static const ObjectType star_type = {.help = "An upright prism over a star with straight edges",
                                     .fields = star_fields,
                                     .field_count = COUNT(star_fields),
                                     .size = sizeof(SceneRound),
                                     .init = init_round,
                                     .rules = star_rules,
                                     .rule_count = COUNT(star_rules)};
static const ObjectType cone_type = {.help = "An upright cone or truncated cone",
                                     .fields = cone_fields,
                                     .field_count = COUNT(cone_fields),
                                     .size = sizeof(SceneRound),
                                     .init = init_round};

/* ---- Tank ---- */

static void init_plane(void *object) {
    *(ScenePlane *)object = (ScenePlane){0};
}

static void check_plane(void *object, Problems *problems) {
    const ScenePlane *plane = object;
    if (plane->normal[0] == 0 && plane->normal[1] == 0 && plane->normal[2] == 0) {
        size_t mark = problems_enter(problems, "normal");
        problems_add(problems, "has no direction");
        problems_leave(problems, mark);
    }
}

static const Field plane_fields[] = {
    {ROW(FIELD_VEC3, ScenePlane, point, "point"), COORDINATE, .flags = FIELD_REQUIRED,
     .help = "A point on the wall"},
    {ROW(FIELD_VEC3, ScenePlane, normal, "normal"), .min = -1e6, .max = 1e6, .flags = FIELD_REQUIRED,
     .help = "Points out of the tank; any length"},
};

static const FieldRule plane_rules[] = {{"normal", check_plane}};

static const ObjectType plane_type = {.help = "A flat wall",
                                      .fields = plane_fields,
                                      .field_count = COUNT(plane_fields),
                                      .size = sizeof(ScenePlane),
                                      .init = init_plane,
                                      .rules = plane_rules,
                                      .rule_count = COUNT(plane_rules)};

enum {
    BOX = 1 << SCENE_TANK_BOX,
    MESH = 1 << SCENE_TANK_MESH,
    PLANES = 1 << SCENE_TANK_PLANES,
    SPHERE = 1 << SCENE_TANK_SPHERE,
    CYLINDER = 1 << SCENE_TANK_CYLINDER,
    STAR = 1 << SCENE_TANK_STAR,
    CONE = 1 << SCENE_TANK_CONE,
    UPRIGHT = CYLINDER | STAR | CONE
};

static void init_tank(void *object) {
    SkiffTankDef tank = skiff_def_default().tank;
    *(SceneTank *)object = (SceneTank){.open = tank.open,
                                       .round = default_round(),
                                       .placement = default_placement(),
                                       .wet_height = tank.wet_height};
}

static void check_tank_box(void *object, Problems *problems) {
    const SceneTank *tank = object;
    if (tank->type == SCENE_TANK_BOX)
        check_corners(tank->min, tank->max, "min", "max", problems);
}

static void check_tank_rotation(void *object, Problems *problems) {
    const SceneTank *tank = object;
    check_rotation(&tank->placement, problems);
}

static void check_tank_star(void *object, Problems *problems) {
    const SceneTank *tank = object;
    if (tank->type == SCENE_TANK_STAR)
        check_star(&tank->round, problems);
}

/* The lid is what lies at the very top: that of a tilted tank does not. */
static void check_tank_open(void *object, Problems *problems) {
    const SceneTank *tank = object;
    const float *axis = tank->placement.rotation_axis;
    const bool tilted = tank->placement.rotation_angle != 0 && (axis[0] != 0 || axis[2] != 0);
    if (tank->open && tilted && (UPRIGHT >> tank->type & 1)) {
        size_t mark = problems_enter(problems, "open");
        problems_add(problems, "a tilted tank keeps its lid, expected false");
        problems_leave(problems, mark);
    }
}

static void check_tank_planes(void *object, Problems *problems) {
    const SceneTank *tank = object;
    if (tank->type == SCENE_TANK_PLANES && tank->planes.count < 4) {
        size_t mark = problems_enter(problems, "planes");
        problems_add(problems, "%d planes cannot enclose a tank, expected at least 4", tank->planes.count);
        problems_leave(problems, mark);
    }
}

static const Field tank_fields[] = {
    {ROW(FIELD_ENUM, SceneTank, type, "type"), .names = "box|mesh|planes|sphere|cylinder|star|cone",
     .flags = FIELD_REQUIRED, .help = "What the walls are"},
    {ROW(FIELD_VEC3, SceneTank, min, "min"), COORDINATE, .flags = FIELD_REQUIRED, .variants = BOX,
     .help = "Corner of the box with the smallest coordinates"},
    {ROW(FIELD_VEC3, SceneTank, max, "max"), COORDINATE, .flags = FIELD_REQUIRED, .variants = BOX,
     .help = "Corner of the box with the largest coordinates"},
    {ROW(FIELD_BOOL, SceneTank, open, "open"), .variants = BOX | UPRIGHT, .help = "No lid"},
    {ROW(FIELD_FILE, SceneTank, file, "geometryFile"), .flags = FIELD_REQUIRED, .variants = MESH,
     .help = "OBJ file of a closed mesh, relative to the scene; the fluid is inside it"},
    BRANCHES_ROW(SceneTank, round.branches, STAR),
    RADIUS_ROW(SceneTank, round.radius, SPHERE | UPRIGHT),
    INNER_RADIUS_ROW(SceneTank, round.inner_radius, STAR),
    TOP_RADIUS_ROW(SceneTank, round.top_radius, CONE),
    HEIGHT_ROW(SceneTank, round.height, UPRIGHT),
    PLACEMENT_ROWS(SceneTank, MESH | SPHERE | UPRIGHT),
    {ROW(FIELD_LIST, SceneTank, planes, "planes"), .max = 1000, .flags = FIELD_REQUIRED, .variants = PLANES,
     .object = &plane_type, .help = "Flat walls around a convex tank"},
    {ROW(FIELD_FLOAT, SceneTank, wet_height, "wetHeight"), COORDINATE, .flags = FIELD_NULLABLE,
     .help = "Only walls below this y feel the fluid; absent: all of them"},
};

static const FieldRule tank_rules[] = {{"type|min|max", check_tank_box},
                                       {"rotationAxis|rotationAngle", check_tank_rotation},
                                       {"type|radius|innerRadius", check_tank_star},
                                       {"type|open|rotationAxis|rotationAngle", check_tank_open},
                                       {"type|planes", check_tank_planes}};

static const ObjectType tank_type = {.help = "The walls around the fluid",
                                     .fields = tank_fields,
                                     .field_count = COUNT(tank_fields),
                                     .size = sizeof(SceneTank),
                                     .init = init_tank,
                                     .rules = tank_rules,
                                     .rule_count = COUNT(tank_rules),
                                     .variant_key = "type"};

/* ---- FluidBlocks ---- */

static void init_block(void *object) {
    *(SkiffBlockDef *)object = skiff_block_default();
}

static void check_block_corners(void *object, Problems *problems) {
    const SkiffBlockDef *block = object;
    check_corners(block->start, block->end, "start", "end", problems);
}

static void check_block_period(void *object, Problems *problems) {
    const SkiffBlockDef *block = object;
    if (block->repeat > 1 && !(block->period > 0)) {
        size_t mark = problems_enter(problems, "period");
        problems_add(problems, "expected a number above 0 s, since repeat is %d", block->repeat);
        problems_leave(problems, mark);
    }
}

static const Field block_fields[] = {
    {ROW(FIELD_VEC3, SkiffBlockDef, start, "start"), COORDINATE, .flags = FIELD_REQUIRED,
     .help = "Corner with the smallest coordinates; the first particle is half a spacing inside"},
    {ROW(FIELD_VEC3, SkiffBlockDef, end, "end"), COORDINATE, .flags = FIELD_REQUIRED,
     .help = "Corner with the largest coordinates; (end - start) / spacing particles along each axis"},
    {ROW(FIELD_ENUM, SkiffBlockDef, fill, "fill"), .names = "lattice|rest",
     .help = "lattice: points of a cubic lattice, all inside; rest: water at rest wherever walls, bodies and "
             "existing water leave room"},
    {ROW(FIELD_VEC3, SkiffBlockDef, offset, "offset"), COORDINATE,
     .help = "Shifts the pattern of the points of fill rest"},
    {ROW(FIELD_VEC3, SkiffBlockDef, velocity, "velocity"), SPEED, .help = "Velocity when emitted"},
    {ROW(FIELD_DOUBLE, SkiffBlockDef, time, "time"), DURATION, .help = "When it is emitted; 0: at the start"},
    {ROW(FIELD_DOUBLE, SkiffBlockDef, period, "period"), DURATION, .help = "Time between repetitions"},
    {ROW(FIELD_INT, SkiffBlockDef, repeat, "repeat"), .min = 1, .max = 1e6,
     .help = "How often it is emitted in all"},
};

static const FieldRule block_rules[] = {{"start|end", check_block_corners},
                                        {"period|repeat", check_block_period}};

static const ObjectType block_type = {.help = "A box of fluid, emitted once or periodically",
                                      .fields = block_fields,
                                      .field_count = COUNT(block_fields),
                                      .size = sizeof(SkiffBlockDef),
                                      .init = init_block,
                                      .rules = block_rules,
                                      .rule_count = COUNT(block_rules)};

/* ---- RigidBodies ---- */

static void init_drive(void *object) {
    *(SkiffDriveDef *)object = skiff_drive_default();
}

static bool drive_row(int index, Field *field) {
    int count;
    const SkiffParamInfo *infos = skiff_drive_infos(&count);
    if (index < count)
        *field = info_row(&infos[index], 0);
    return index < count;
}

static const ObjectType drive_type = {
    .help = "What drives and steers a body. Points and directions are in the geometry's own frame, as its "
            "vertices are",
    .more = drive_row,
    .size = sizeof(SkiffDriveDef),
    .init = init_drive};

enum { GROUP_SHAPE = 1, GROUP_WEIGHT = 2 };

static void init_body(void *object) {
    SkiffBodyDef def = skiff_body_default();
    SceneBody *body = object;
    *body = (SceneBody){.placement = default_placement(),
                        .sphere = NAN,
                        .density = NAN,
                        .mass = NAN,
                        .free_axes = UINT32_MAX,
                        .release_time = def.release_time,
                        .stop_time = NAN,
                        .ramp_time = def.ramp_time};
    set3(body->box, NAN, NAN, NAN);
    memcpy(body->velocity, def.velocity, sizeof body->velocity);
    memcpy(body->angular_velocity, def.angular_velocity, sizeof body->angular_velocity);
}

static void check_body_rotation(void *object, Problems *problems) {
    const SceneBody *body = object;
    check_rotation(&body->placement, problems);
}

static void fill_body_weight(void *object, Problems *problems) {
    SceneBody *body = object;
    (void)problems;
    if (isnan(body->density) && isnan(body->mass))
        body->density = skiff_body_default().density;
}

static void check_body_axes(void *object, Problems *problems) {
    SceneBody *body = object;
    if (body->free_axes == UINT32_MAX)
        body->free_axes = body->is_dynamic ? SKIFF_FREE_ALL : 0;
    if (body->free_axes != 0 && !body->is_dynamic) {
        size_t mark = problems_enter(problems, "freeAxes");
        problems_add(problems, "has no meaning while isDynamic is false");
        problems_leave(problems, mark);
    }
}

static const Field body_fields[] = {
    {ROW(FIELD_NAME, SceneBody, name, "name"), .flags = FIELD_REQUIRED,
     .help = "Unique; begins its columns of hull.csv"},
    {ROW(FIELD_FILE, SceneBody, file, "geometryFile"), .flags = FIELD_REQUIRED | FIELD_NULLABLE,
     .group = GROUP_SHAPE, .help = "OBJ file of a closed mesh, relative to the scene"},
    {ROW(FIELD_VEC3, SceneBody, box, "box"), LENGTH, .flags = FIELD_REQUIRED | FIELD_NULLABLE,
     .group = GROUP_SHAPE, .help = "Edge lengths of a box around its own origin"},
    {ROW(FIELD_FLOAT, SceneBody, sphere, "sphere"), LENGTH, .flags = FIELD_REQUIRED | FIELD_NULLABLE,
     .group = GROUP_SHAPE, .help = "Radius of a sphere around its own origin"},
    {ROW(FIELD_OBJECT, SceneBody, cylinder, "cylinder"), .flags = FIELD_REQUIRED | FIELD_NULLABLE,
     .group = GROUP_SHAPE, .object = &cylinder_type, .help = "An upright cylinder around its own origin"},
    {ROW(FIELD_OBJECT, SceneBody, star, "star"), .flags = FIELD_REQUIRED | FIELD_NULLABLE,
     .group = GROUP_SHAPE, .object = &star_type, .help = "An upright star prism around its own origin"},
    {ROW(FIELD_OBJECT, SceneBody, cone, "cone"), .flags = FIELD_REQUIRED | FIELD_NULLABLE,
     .group = GROUP_SHAPE, .object = &cone_type,
     .help = "An upright cone or truncated cone around its own origin"},
    PLACEMENT_ROWS(SceneBody, 0),
    {ROW(FIELD_FLOAT, SceneBody, density, "density"), .min = 1e-3, .max = 1e6, .unit = "kg/m^3",
     .flags = FIELD_NULLABLE, .group = GROUP_WEIGHT,
     .help = "Of the uniform solid; 1000 when mass is absent too"},
    {ROW(FIELD_FLOAT, SceneBody, mass, "mass"), .min = 1e-9, .max = 1e12, .unit = "kg",
     .flags = FIELD_NULLABLE, .group = GROUP_WEIGHT, .help = "In place of density"},
    {ROW(FIELD_VEC3, SceneBody, velocity, "velocity"), SPEED,
     .help = "Of the centre of mass at the start; kept along axes that are not free"},
    {ROW(FIELD_VEC3, SceneBody, angular_velocity, "angularVelocity"), .min = -1e4, .max = 1e4,
     .unit = "rad/s", .help = "About the world's axes at the start; kept about axes that are not free"},
    {ROW(FIELD_BOOL, SceneBody, is_dynamic, "isDynamic"), .help = "Moved by the fluid and by gravity"},
    {ROW(FIELD_FLAGS, SceneBody, free_axes, "freeAxes"), .names = "x|y|z|rx|ry|rz", .flags = FIELD_NULLABLE,
     .help = "Axes along and about which a dynamic body can move; absent: all"},
    {ROW(FIELD_DOUBLE, SceneBody, release_time, "releaseTime"), DURATION,
     .help = "A dynamic body is held until then"},
    {ROW(FIELD_DOUBLE, SceneBody, stop_time, "stopTime"), DURATION, .flags = FIELD_NULLABLE,
     .help = "From then on the body is held where it is; absent: never"},
    {ROW(FIELD_DOUBLE, SceneBody, ramp_time, "rampTime"), DURATION,
     .help = "Velocities along and about axes that are not free rise from 0 to their value until then"},
    {ROW(FIELD_OBJECT, SceneBody, drive, "drive"), .flags = FIELD_NULLABLE, .object = &drive_type,
     .help = "Propulsion and steering; absent: none"},
};

static const FieldRule body_rules[] = {{"rotationAxis|rotationAngle", check_body_rotation},
                                       {"density|mass", fill_body_weight},
                                       {"isDynamic|freeAxes", check_body_axes}};

static const ObjectType body_type = {.help = "A rigid body: floating, prescribed or fixed",
                                     .fields = body_fields,
                                     .field_count = COUNT(body_fields),
                                     .size = sizeof(SceneBody),
                                     .init = init_body,
                                     .rules = body_rules,
                                     .rule_count = COUNT(body_rules)};

/* ---- Probes ---- */

enum {
    HEIGHT = 1 << SKIFF_PROBE_HEIGHT,
    PRESSURE = 1 << SKIFF_PROBE_PRESSURE,
    FORCE = 1 << SKIFF_PROBE_FORCE
};

static void init_probe(void *object) {
    SceneProbe *probe = object;
    *probe = (SceneProbe){0};
    set3(probe->min, NAN, NAN, NAN);
    set3(probe->max, NAN, NAN, NAN);
}

static void check_probe_object(void *object, Problems *problems) {
    const SceneProbe *probe = object;
    if (probe->type == SKIFF_PROBE_FORCE && !probe->object) {
        size_t mark = problems_enter(problems, "object");
        problems_add(problems, "missing, expected a body's name or \"tank\"");
        problems_leave(problems, mark);
    }
}

static void check_probe_region(void *object, Problems *problems) {
    const SceneProbe *probe = object;
    if (is_given(probe->min) != is_given(probe->max))
        problems_add(problems, "min and max go together, one of them is missing");
    else if (is_given(probe->min))
        check_corners(probe->min, probe->max, "min", "max", problems);
}

static const Field probe_fields[] = {
    {ROW(FIELD_NAME, SceneProbe, name, "name"), .flags = FIELD_REQUIRED,
     .help = "Unique; its column of probes.csv"},
    {ROW(FIELD_ENUM, SceneProbe, type, "type"), .names = "height|pressure|force", .flags = FIELD_REQUIRED,
     .help = "Wave gauge (m of water on a vertical line), wall pressure (Pa), or force (N) and torque (N m) "
             "on an object"},
    {ROW(FIELD_VEC3, SceneProbe, point, "point"), COORDINATE, .flags = FIELD_REQUIRED,
     .variants = HEIGHT | PRESSURE, .help = "Where it is; heights ignore y"},
    {ROW(FIELD_FLOAT, SceneProbe, radius, "radius"), .min = 0, .max = 1e5, .unit = "m", .variants = PRESSURE,
     .help = "Mean over the wall within this distance; 0: support radius"},
    {ROW(FIELD_NAME, SceneProbe, object, "object"), .flags = FIELD_NULLABLE, .variants = PRESSURE | FORCE,
     .help = "A body's name or \"tank\"; a force needs one, a pressure without one takes any wall"},
    {ROW(FIELD_VEC3, SceneProbe, min, "min"), COORDINATE, .flags = FIELD_NULLABLE, .variants = FORCE,
     .help = "Only the part of the object inside [min, max] at the start"},
    {ROW(FIELD_VEC3, SceneProbe, max, "max"), COORDINATE, .flags = FIELD_NULLABLE, .variants = FORCE,
     .help = "The corner opposite to min"},
};

static const FieldRule probe_rules[] = {{"type|object", check_probe_object}, {"min|max", check_probe_region}};

static const ObjectType probe_type = {.help = "A measurement, written to probes.csv",
                                      .fields = probe_fields,
                                      .field_count = COUNT(probe_fields),
                                      .size = sizeof(SceneProbe),
                                      .init = init_probe,
                                      .rules = probe_rules,
                                      .rule_count = COUNT(probe_rules),
                                      .variant_key = "type"};

/* ---- Keys ---- */

enum { LEVERS = 1 << SCRIPT_KEY_THROTTLE | 1 << SCRIPT_KEY_RUDDER, CAMERA = 1 << SCRIPT_KEY_CAMERA };

static void init_key(void *object) {
    *(ScriptKey *)object = (ScriptKey){.value = 1};
}

static const Field key_fields[] = {
    {ROW(FIELD_NAME, ScriptKey, key, "key"), .flags = FIELD_REQUIRED,
     .help = "What `press` and `release` in input files call it"},
    {ROW(FIELD_ENUM, ScriptKey, action, "action"), .names = SCRIPT_ACTIONS, .flags = FIELD_REQUIRED,
     .help = "What it does: throttle and rudder while it is held, camera when it is pressed"},
    {ROW(FIELD_FLOAT, ScriptKey, value, "value"), .min = -1, .max = 1, .variants = LEVERS,
     .help = "Throttle (ahead is above 0) or rudder (to starboard is above 0)"},
    {ROW(FIELD_NAME, ScriptKey, camera, "camera"), .flags = FIELD_REQUIRED, .variants = CAMERA,
     .help = "Name of the camera"},
};

static const ObjectType key_type = {.help = "A key and what it does",
                                    .fields = key_fields,
                                    .field_count = COUNT(key_fields),
                                    .size = sizeof(ScriptKey),
                                    .init = init_key,
                                    .variant_key = "action"};

/* ---- The file ---- */

static void init_file(void *object) {
    SceneFile *file = object;
    *file = (SceneFile){.version = 1, .title = "", .description = ""};
    file->keys.items = (void *)(uintptr_t)script_default_keys(&file->keys.count);
}

static void check_keys(void *object, Problems *problems) {
    const SceneFile *file = object;
    const ScriptKey *keys = file->keys.items;
    for (int i = 0; i < file->keys.count; i++)
        for (int j = 0; j < i; j++)
            if (strcmp(keys[i].key, keys[j].key) == 0) {
                const size_t mark = problems_enter(problems, "Keys");
                problems_enter_index(problems, (size_t)i);
                problems_add(problems, "key %s is bound by Keys[%d] already", keys[i].key, j);
                problems_leave(problems, mark);
            }
}

static const Field file_fields[] = {
    {ROW(FIELD_TEXT, SceneFile, schema, "$schema"), .flags = FIELD_NULLABLE, .help = "For editors; not used"},
    {ROW(FIELD_INT, SceneFile, version, "version"), .min = 1, .max = 1, .flags = FIELD_REQUIRED,
     .help = "Version of the format"},
    {ROW(FIELD_TEXT, SceneFile, title, "title"), .help = "Heads the report"},
    {ROW(FIELD_TEXT, SceneFile, description, "description"), .help = "What the scene is for"},
    {ROW(FIELD_OBJECT, SceneFile, configuration, "Configuration"), .object = &configuration_type,
     .help = "Settings of the simulation"},
    {ROW(FIELD_OBJECT, SceneFile, tank, "Tank"), .flags = FIELD_NULLABLE, .object = &tank_type,
     .help = "The walls around the fluid; absent: none"},
    {ROW(FIELD_OBJECT, SceneFile, sea, "Sea"), .flags = FIELD_NULLABLE, .object = &scene_sea_type,
     .help = "A sea without end; absent: the tank is all there is"},
    {ROW(FIELD_LIST, SceneFile, blocks, "FluidBlocks"), .max = 100000, .object = &block_type,
     .help = "The fluid"},
    {ROW(FIELD_LIST, SceneFile, bodies, "RigidBodies"), .max = 10000, .object = &body_type,
     .help = "Solids in the fluid; they do not touch each other or the tank"},
    {ROW(FIELD_LIST, SceneFile, probes, "Probes"), .max = 10000, .object = &probe_type,
     .help = "Measurements"},
    {ROW(FIELD_FILE, SceneFile, input, "input"), .flags = FIELD_NULLABLE,
     .help = "Input file that drives, relative to the scene; `skiff run --input` takes its place"},
    {ROW(FIELD_LIST, SceneFile, keys, "Keys"), .max = SCRIPT_MAX_KEYS, .object = &key_type,
     .help = "Keys that input files can press; absent: w s a d, z q and the arrows"},
    {ROW(FIELD_OBJECT, SceneFile, render, "Render"), .flags = FIELD_NULLABLE, .object = &scene_render_type,
     .help = "Frames; absent: none, unless the command line asks for them"},
};

/* Keys can only cut to cameras that there are. */
static void check_key_cameras(void *object, Problems *problems) {
    const SceneFile *file = object;
    const ScriptKey *keys = file->keys.items;
    const size_t size = scene_camera_names(file->render, NULL, 0) + 1;
    char *names = malloc(size);
    if (!names)
        return problems_add(problems, "not enough memory for the names of the cameras");
    scene_camera_names(file->render, names, size);
    for (int i = 0; i < file->keys.count; i++) {
        if (keys[i].action != SCRIPT_KEY_CAMERA || field_name_index(names, keys[i].camera) >= 0)
            continue;
        Nearest nearest = nearest_begin(keys[i].camera);
        nearest_offer_list(&nearest, names);
        const char *best = nearest_result(&nearest);
        const size_t mark = problems_enter(problems, "Keys");
        problems_enter_index(problems, (size_t)i);
        problems_enter(problems, "camera");
        problems_add(problems, "there is no camera %s%s%s%s; there are %s", keys[i].camera,
                     best ? ", did you mean " : "", best ? best : "", best ? "?" : "", names);
        problems_leave(problems, mark);
    }
    free(names);
}

static const FieldRule file_rules[] = {{"Keys", check_keys}, {"Keys|Render", check_key_cameras}};

const ObjectType scene_file_type = {.help = "A Skiff scene",
                                    .fields = file_fields,
                                    .field_count = COUNT(file_fields),
                                    .size = sizeof(SceneFile),
                                    .init = init_file,
                                    .rules = file_rules,
                                    .rule_count = COUNT(file_rules)};
