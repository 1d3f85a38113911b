/* Every key of a scene file, once. Keys, meanings and units follow SPlisHSPlasH scenes where there is such a
 * thing; keys of Configuration that set the simulation come from the engine's own list (engine/params.inl).
 */
#include "scene_table.h"

#include <math.h>
#include <string.h>

#define COUNT(table) ((int)(sizeof(table) / sizeof *(table)))
#define COORDINATE   .min = -1e5, .max = 1e5, .unit = "m"
#define LENGTH       .min = 1e-4, .max = 1e5, .unit = "m"
#define SPEED        .min = -1e4, .max = 1e4, .unit = "m/s"
#define DURATION     .min = 0, .max = 1e6, .unit = "s"

static void set3(float out[3], float x, float y, float z) {
    out[0] = x;
    out[1] = y;
    out[2] = z;
}

static bool is_given(const float vector[3]) {
    return !isnan(vector[0]);
}

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

static bool param_row(int index, Field *field) {
    static const FieldType types[] = {[SKIFF_FLOAT] = FIELD_FLOAT,
                                      [SKIFF_INT] = FIELD_INT,
                                      [SKIFF_BOOL] = FIELD_BOOL,
                                      [SKIFF_VEC3] = FIELD_VEC3,
                                      [SKIFF_ENUM] = FIELD_ENUM};
    int count;
    const SkiffParamInfo *infos = skiff_param_infos(&count);
    if (index >= count)
        return false;
    const SkiffParamInfo *info = &infos[index];
    *field = (Field){.key = info->key,
                     .type = types[info->type],
                     .offset = offsetof(SceneConfiguration, params) + info->offset,
                     .min = info->min,
                     .max = info->max,
                     .unit = info->unit,
                     .names = info->names,
                     .help = info->help};
    return true;
}

#define ROW(field_type, struct_type, member, json_key)                                                       \
    .key = json_key, .type = field_type, .offset = offsetof(struct_type, member)

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

enum { GROUP_SHAPE = 1, GROUP_WEIGHT = 2 };

static void init_body(void *object) {
    SkiffBodyDef def = skiff_body_default();
    SceneBody *body = object;
    *body = (SceneBody){.placement = default_placement(),
                        .sphere = NAN,
                        .density = NAN,
                        .mass = NAN,
                        .free_axes = UINT32_MAX,
                        .release_time = def.release_time};
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

/* ---- Render ---- */

SceneRender scene_render_default(void) {
    return (SceneRender){.fps = 30,
                         .width = 1280,
                         .height = 720,
                         .supersample = 1,
                         .field_min = NAN,
                         .field_max = NAN,
                         .hud = RENDER_HUD_ON,
                         .fade = true,
                         .fade_in = 0.3f,
                         .fade_out = 0.3f,
                         .fade_edge = 0.5f,
                         .ripples = 1,
                         .sun = {-0.5f, 0.6f, 0.45f}};
}

static void init_render(void *object) {
    *(SceneRender *)object = scene_render_default();
}

void scene_camera_default(SceneCamera *camera) {
    *camera = (SceneCamera){.distance = NAN,
                            .height = NAN,
                            .look_up = NAN,
                            .azimuth = NAN,
                            .period = NAN,
                            .smoothing = NAN,
                            .fov = NAN};
    set3(camera->eye, NAN, NAN, NAN);
    set3(camera->target, NAN, NAN, NAN);
    set3(camera->forward, NAN, NAN, NAN);
}

static void init_camera(void *object) {
    scene_camera_default(object);
}

static void init_material(void *object) {
    SceneMaterial *material = object;
    *material = (SceneMaterial){.waterline = NAN, .cabin_base = NAN, .cabin_top = NAN};
    set3(material->color, NAN, NAN, NAN);
}

static void check_sun(void *object, Problems *problems) {
    const SceneRender *render = object;
    if (render->sun[1] > 0)
        return;
    size_t mark = problems_enter(problems, "sun");
    problems_enter_index(problems, 1);
    problems_add(problems, "%g is not above 0: the sun is up", (double)render->sun[1]);
    problems_leave(problems, mark);
}

static void check_field_range(void *object, Problems *problems) {
    const SceneRender *render = object;
    if (!(render->field_min >= render->field_max))
        return;
    size_t mark = problems_enter(problems, "fieldMax");
    problems_add(problems, "%g is not above fieldMin, which is %g", (double)render->field_max,
                 (double)render->field_min);
    problems_leave(problems, mark);
}

static void check_forward(void *object, Problems *problems) {
    const SceneCamera *camera = object;
    if (!is_given(camera->forward) || camera->forward[0] != 0 || camera->forward[2] != 0)
        return;
    size_t mark = problems_enter(problems, "forward");
    problems_add(problems, "has no horizontal direction");
    problems_leave(problems, mark);
}

#define OPTIONAL_LENGTH .min = 1e-3, .max = 1e5, .unit = "m", .flags = FIELD_NULLABLE

static const Field camera_fields[] = {
    {ROW(FIELD_NAME, SceneCamera, name, "name"), .flags = FIELD_REQUIRED,
     .help = "For --camera and for `camera NAME` in an input script"},
    {ROW(FIELD_ENUM, SceneCamera, type, "type"), .names = RENDER_CAMERAS, .flags = FIELD_REQUIRED,
     .help = "Behind a body; still; circling it; above it; on board"},
    {ROW(FIELD_NAME, SceneCamera, body, "body"), .flags = FIELD_NULLABLE,
     .help = "That is followed; absent: the first dynamic one, or the middle of the scene (fixed: none)"},
    {ROW(FIELD_VEC3, SceneCamera, eye, "eye"), COORDINATE, .flags = FIELD_NULLABLE,
     .help = "fixed: in the world; bow: from the body's centre, along its axes"},
    {ROW(FIELD_VEC3, SceneCamera, target, "target"), COORDINATE, .flags = FIELD_NULLABLE,
     .help = "Point in the world that is looked at where no body is followed"},
    {ROW(FIELD_VEC3, SceneCamera, forward, "forward"), .min = -1e6, .max = 1e6, .flags = FIELD_NULLABLE,
     .help =
         "Direction of the body's bow in the world at the start; absent: where -x of its geometry points"},
    {ROW(FIELD_FLOAT, SceneCamera, distance, "distance"), OPTIONAL_LENGTH,
     .help = "chase, orbit: horizontal distance from the body; top: height above it"},
    {ROW(FIELD_FLOAT, SceneCamera, height, "height"), COORDINATE, .flags = FIELD_NULLABLE,
     .help = "chase, orbit: of the eye above the body's centre"},
    {ROW(FIELD_FLOAT, SceneCamera, look_up, "lookUp"), COORDINATE, .flags = FIELD_NULLABLE,
     .help = "chase, orbit: how far above the body's centre the camera aims"},
    {ROW(FIELD_FLOAT, SceneCamera, azimuth, "azimuth"), .min = -100, .max = 100, .unit = "rad",
     .flags = FIELD_NULLABLE, .help = "orbit: where it is at time 0, from +x towards +z"},
    {ROW(FIELD_FLOAT, SceneCamera, period, "period"), .min = 0, .max = 1e6, .unit = "s",
     .flags = FIELD_NULLABLE, .help = "orbit: time for one turn; 0: it stands still"},
    {ROW(FIELD_FLOAT, SceneCamera, smoothing, "smoothing"), .min = 0, .max = 100, .unit = "s",
     .flags = FIELD_NULLABLE, .help = "Time in which nine tenths of a sudden change have been followed"},
    {ROW(FIELD_FLOAT, SceneCamera, fov, "fov"), .min = 5, .max = 150, .unit = "deg", .flags = FIELD_NULLABLE,
     .help = "Field of view, vertical"},
};

static const FieldRule camera_rules[] = {{"forward", check_forward}};

static const ObjectType camera_type = {
    .help = "A camera. Lengths that are absent follow from the size of what is looked at",
    .fields = camera_fields,
    .field_count = COUNT(camera_fields),
    .size = sizeof(SceneCamera),
    .init = init_camera,
    .rules = camera_rules,
    .rule_count = COUNT(camera_rules)};

static const Field material_fields[] = {
    {ROW(FIELD_NAME, SceneMaterial, name, "name"), .flags = FIELD_REQUIRED, .help = "Of a body"},
    {ROW(FIELD_ENUM, SceneMaterial, material, "material"), .names = "paint|hull|stone",
     .help = "hull: antifouling, stripe, topsides, wooden deck and cabin"},
    {ROW(FIELD_VEC3, SceneMaterial, color, "color"), .min = 0, .max = 1, .flags = FIELD_NULLABLE,
     .help = "Red, green and blue, linear; absent: the material's own"},
    {ROW(FIELD_FLOAT, SceneMaterial, waterline, "waterline"), COORDINATE, .flags = FIELD_NULLABLE,
     .help = "hull: y of the waterline at the start; absent: that of the water"},
    {ROW(FIELD_FLOAT, SceneMaterial, cabin_base, "cabinBase"), COORDINATE, .flags = FIELD_NULLABLE,
     .help = "hull: y at the start where the cabin begins; absent: there is none"},
    {ROW(FIELD_FLOAT, SceneMaterial, cabin_top, "cabinTop"), COORDINATE, .flags = FIELD_NULLABLE,
     .help = "hull: y at the start of the cabin's roof"},
};

static const ObjectType material_type = {.help = "What a body is made of",
                                         .fields = material_fields,
                                         .field_count = COUNT(material_fields),
                                         .size = sizeof(SceneMaterial),
                                         .init = init_material};

static const Field render_fields[] = {
    {ROW(FIELD_INT, SceneRender, fps, "fps"), .min = 1, .max = 1000, .unit = "1/s",
     .help = "Frames a second of simulated time; the step need not fit"},
    {ROW(FIELD_INT, SceneRender, width, "width"), .min = 16, .max = 8192, .unit = "px", .help = "Of a frame"},
    {ROW(FIELD_INT, SceneRender, height, "height"), .min = 16, .max = 8192, .unit = "px",
     .help = "Of a frame"},
    {ROW(FIELD_INT, SceneRender, supersample, "supersample"), .min = 1, .max = 4,
     .help = "Drawn that many times larger, then averaged"},
    {ROW(FIELD_ENUM, SceneRender, look, "look"), .names = RENDER_LOOKS,
     .help = "A water surface, or spheres"},
    {ROW(FIELD_ENUM, SceneRender, field, "field"), .names = RENDER_FIELDS,
     .help = "Colour of the look particles; window: distance from the window's edge"},
    {ROW(FIELD_FLOAT, SceneRender, field_min, "fieldMin"), .min = -1e9, .max = 1e9, .flags = FIELD_NULLABLE,
     .help = "Value of the first colour; absent: one that suits the field"},
    {ROW(FIELD_FLOAT, SceneRender, field_max, "fieldMax"), .min = -1e9, .max = 1e9, .flags = FIELD_NULLABLE,
     .help = "Value of the last colour"},
    {ROW(FIELD_ENUM, SceneRender, hud, "hud"), .names = RENDER_HUDS,
     .help = "Figures in the picture; timing: with wall-clock times, which differ between runs"},
    {ROW(FIELD_BOOL, SceneRender, fade, "fade"),
     .help = "Created and removed particles fade, instead of popping in and out"},
    {ROW(FIELD_FLOAT, SceneRender, fade_in, "fadeIn"), .min = 0.001, .max = 10, .unit = "s",
     .help = "How long a created particle takes to appear"},
    {ROW(FIELD_FLOAT, SceneRender, fade_out, "fadeOut"), .min = 0.001, .max = 0.5, .unit = "s",
     .help = "How long a removed particle takes to vanish"},
    {ROW(FIELD_FLOAT, SceneRender, fade_edge, "fadeEdge"), .min = 0.001, .max = 100, .unit = "m",
     .help = "Distance from the window's edge over which the particles give way to the ocean"},
    {ROW(FIELD_FLOAT, SceneRender, ripples, "ripples"), .min = 0, .max = 2,
     .help = "Strength of the wind's ripples; 0 is glass"},
    {ROW(FIELD_VEC3, SceneRender, sun, "sun"), .min = -1e3, .max = 1e3,
     .help = "Direction towards the sun, any length; y above 0"},
    {ROW(FIELD_NAME, SceneRender, camera, "camera"), .flags = FIELD_NULLABLE,
     .help = "That begins: one of `cameras` or chase, fixed, orbit, top, bow, which always exist"},
    {ROW(FIELD_LIST, SceneRender, cameras, "cameras"), .max = 100, .object = &camera_type, .help = "Cameras"},
    {ROW(FIELD_LIST, SceneRender, bodies, "bodies"), .max = 10000, .object = &material_type,
     .help = "What bodies are made of; others have the colours of their meshes' materials, or a plain one"},
};

static const FieldRule render_rules[] = {{"sun", check_sun}, {"fieldMin|fieldMax", check_field_range}};

static const ObjectType render_type = {.help = "How frames are drawn. Present: `skiff run` draws them",
                                       .fields = render_fields,
                                       .field_count = COUNT(render_fields),
                                       .size = sizeof(SceneRender),
                                       .init = init_render,
                                       .rules = render_rules,
                                       .rule_count = COUNT(render_rules)};

/* ---- The file ---- */

static void init_file(void *object) {
    *(SceneFile *)object = (SceneFile){.version = 1, .title = "", .description = ""};
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
    {ROW(FIELD_LIST, SceneFile, blocks, "FluidBlocks"), .max = 100000, .object = &block_type,
     .help = "The fluid"},
    {ROW(FIELD_LIST, SceneFile, bodies, "RigidBodies"), .max = 10000, .object = &body_type,
     .help = "Solids in the fluid; they do not touch each other or the tank"},
    {ROW(FIELD_LIST, SceneFile, probes, "Probes"), .max = 10000, .object = &probe_type,
     .help = "Measurements"},
    {ROW(FIELD_OBJECT, SceneFile, render, "Render"), .flags = FIELD_NULLABLE, .object = &render_type,
     .help = "Frames; absent: none, unless the command line asks for them"},
};

const ObjectType scene_file_type = {.help = "A Skiff scene",
                                    .fields = file_fields,
                                    .field_count = COUNT(file_fields),
                                    .size = sizeof(SceneFile),
                                    .init = init_file};
