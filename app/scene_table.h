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
    double release_time, ramp_time;
    double stop_time;     /* NaN: absent */
    SkiffDriveDef *drive; /* NULL: absent */
} SceneBody;

typedef struct SceneProbe {
    const char *name;
    int type; /* SkiffProbeKind */
    float point[3], radius;
    const char *object;   /* NULL: absent */
    float min[3], max[3]; /* NaN: absent */
} SceneProbe;

/* Names of enumerations that the command line knows too. Looks and cameras are in the renderer's order. */
#define RENDER_LOOKS   "water|particles"
#define RENDER_FIELDS  "speed|density|pressure|age|window"
#define RENDER_HUDS    "off|on|timing"
#define RENDER_CAMERAS "chase|fixed|orbit|top|bow"

/* The renderer's limits: view_picture.c holds them together. */
enum { RENDER_SIZE_MIN = 16, RENDER_SIZE_MAX = 8192, RENDER_SUPERSAMPLE_MAX = 4 };

typedef enum RenderField {
    RENDER_SPEED,
    RENDER_DENSITY,
    RENDER_PRESSURE,
    RENDER_AGE,
    RENDER_WINDOW,
    RENDER_FIELD_COUNT
} RenderField;

typedef enum RenderHud { RENDER_HUD_OFF, RENDER_HUD_ON, RENDER_HUD_TIMING } RenderHud;

/* NaN, NULL: absent, and chosen by the size of what is looked at. */
typedef struct SceneCamera {
    const char *name;
    int type;         /* position in RENDER_CAMERAS */
    const char *body; /* that is followed */
    float eye[3], target[3], forward[3];
    float distance, height, look_up, azimuth, period, smoothing, fov;
} SceneCamera;

typedef struct SceneMaterial {
    const char *name; /* of a body */
    int material;     /* 0 paint, 1 hull, 2 stone */
    float color[3];
    float waterline, cabin_base, cabin_top; /* m, world at the start; NaN: absent */
} SceneMaterial;

/* How frames are drawn. */
typedef struct SceneRender {
    int fps, width, height, supersample;
    int look, field;            /* positions in RENDER_LOOKS, RENDER_FIELDS */
    float field_min, field_max; /* NaN: the field's own */
    int hud;                    /* RenderHud */
    bool fade;
    float fade_in, fade_out; /* s */
    float fade_edge;         /* m */
    float ripples;
    float sun[3];
    const char *camera; /* NULL: the first of `cameras`, or the one that suits the scene */
    FieldList cameras;  /* of SceneCamera */
    FieldList bodies;   /* of SceneMaterial */
} SceneRender;

typedef struct ScenePathPoint {
    double time, x, z; /* s, m: an entry of SkiffSeaDef.path */
} ScenePathPoint;

typedef struct SceneSea {
    float level;
    const char *follow; /* NULL: absent */
    FieldList path;     /* of ScenePathPoint */
    bool absorb;
    float absorb_min[3], absorb_max[3]; /* NaN: absent */
} SceneSea;

typedef struct SceneFile {
    const char *schema;
    int version;
    const char *title, *description;
    SceneConfiguration *configuration;
    SceneTank *tank;     /* NULL: absent */
    SceneSea *sea;       /* NULL: absent */
    FieldList blocks;    /* of SkiffBlockDef */
    FieldList bodies;    /* of SceneBody */
    FieldList probes;    /* of SceneProbe */
    const char *input;   /* NULL: absent */
    FieldList keys;      /* of ScriptKey */
    SceneRender *render; /* NULL: absent */
} SceneFile;

extern const ObjectType scene_file_type;

/* What an empty section "Render" means. */
SceneRender scene_render_default(void);
/* Names of all cameras, "a|b|c": those of `render` (NULL: none), then those of
 * RENDER_CAMERAS, which always exist, unless one of these has its name. Returns the length; writes nothing
 * where out is NULL, else size is at least the length + 1.
 */
size_t scene_camera_names(const SceneRender *render, char *out, size_t size);
/* A camera of which nothing is said. */
void scene_camera_default(SceneCamera *camera);

#endif
