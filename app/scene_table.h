/* What stands in a scene file: the structs that its objects are read into. scene_table.c has the rows,
 * scene.c turns them into a SkiffDef. */
#ifndef SKIFF_APP_SCENE_TABLE_H
#define SKIFF_APP_SCENE_TABLE_H

#include "engine/skiff.h"
#include "field.h"
#include "script.h"

typedef struct SceneConfiguration {
    SkiffParams params;
    double duration, probe_rate, start_time;
    float domain_min[3], domain_max[3]; /* NaN: absent */
} SceneConfiguration;

typedef enum SceneTankType {
    SCENE_TANK_BOX,
    SCENE_TANK_MESH,
    SCENE_TANK_PLANES,
    SCENE_TANK_SPHERE,
    SCENE_TANK_CYLINDER,
    SCENE_TANK_STAR,
    SCENE_TANK_CONE
} SceneTankType;

/* Sizes of a sphere, cylinder, star or cone: what SkiffGeometryDef calls them. */
typedef struct SceneRound {
    float radius, inner_radius, top_radius, height;
    int branches;
} SceneRound;

typedef struct ScenePlane {
    float point[3], normal[3];
} ScenePlane;

/* Where a mesh is put: SkiffGeometryDef without its kind. */
typedef struct ScenePlacement {
    float scale[3], translation[3], rotation_axis[3], rotation_angle;
} ScenePlacement;

typedef struct SceneTank {
    int type; /* SceneTankType */
    float min[3], max[3];
    bool open;
    const char *file;
    SceneRound round;
    ScenePlacement placement;
    FieldList planes; /* of ScenePlane */
    float wet_height;
} SceneTank;

typedef struct SceneBody {
    const char *name;
    const char *file; /* one of these six; NULL, NaN: absent */
    float box[3];
    float sphere;
    SceneRound *cylinder, *star, *cone;
    ScenePlacement placement;
    float density, mass; /* one of these; NaN: absent */
    float velocity[3], angular_velocity[3];
    bool is_dynamic;
    uint32_t free_axes; /* UINT32_MAX: absent */
    double release_time;
    SkiffDriveDef *drive; /* NULL: absent */
} SceneBody;

typedef struct SceneProbe {
    const char *name;
    int type; /* SkiffProbeKind */
    float point[3], radius;
    const char *object;   /* NULL: absent */
    float min[3], max[3]; /* NaN: absent */
} SceneProbe;

typedef struct SceneFile {
    const char *schema;
    int version;
    const char *title, *description;
    SceneConfiguration *configuration;
    SceneTank *tank;   /* NULL: absent */
    FieldList blocks;  /* of SkiffBlockDef */
    FieldList bodies;  /* of SceneBody */
    FieldList probes;  /* of SceneProbe */
    const char *input; /* NULL: absent */
    FieldList keys;    /* of ScriptKey */
} SceneFile;

extern const ObjectType scene_file_type;

#endif
