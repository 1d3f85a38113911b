/* Skiff's renderer: one image from plain arrays, without a screen. It knows nothing of the engine.
 *
 * Units are SI, y is up, right-handed. "Local" coordinates are those of the particles' window: world = local
 * + GfxScene.origin, so that an image looks the same 100 km from the world's origin and does not jump when
 * the window moves (the caller moves camera and poses along with the origin). Every pointer is borrowed
 * during the call only. Functions that can fail take an `Err *` last and return false, NULL or -1. One Gfx is
 * used by one thread at a time; several may exist, also of different back ends. Equal input gives equal bytes
 * on one machine.
 *
 *   GfxDef def = gfx_def_default();
 *   Gfx *gfx = gfx_create(&def, &err);
 *   int boat = gfx_add_mesh(gfx, &(GfxMeshDef){...}, &err);
 *   GfxScene scene = gfx_scene_default();
 *   ... fill in ...
 *   gfx_draw(gfx, &scene, rgb, &err);
 *   gfx_destroy(gfx);
 *
 * Where the camera is, figures in the picture and files of it are in headers of their own, included here.
 */
#ifndef SKIFF_GFX_H
#define SKIFF_GFX_H

#include "camera.h"
#include "hud.h"
#include "png.h"
#include "writer.h"

#include "engine/base/err.h"

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* ---- The renderer ---- */

typedef enum GfxBackend {
    GFX_BACKEND_AUTO, /* the first of the others, in this order, that works */
    GFX_BACKEND_EGL_DEVICE,
    GFX_BACKEND_EGL_SURFACELESS,
    GFX_BACKEND_OSMESA,
    GFX_BACKEND_COUNT
} GfxBackend;

/* "auto", "egl-device", "egl", "osmesa": the words of `--gl`. */
const char *gfx_backend_name(GfxBackend backend);

typedef enum GfxLook {
    GFX_LOOK_WATER,     /* a water surface with foam and spray, in an endless ocean where there is one */
    GFX_LOOK_PARTICLES, /* spheres coloured by a scalar field, with a legend */
    GFX_LOOK_COUNT
} GfxLook;

/* "water", "particles". */
const char *gfx_look_name(GfxLook look);

enum { GFX_SIZE_MIN = 16, GFX_SIZE_MAX = 8192, GFX_SUPERSAMPLE_MAX = 4 };

typedef struct GfxDef {
    int width, height; /* of the image handed out, px; GFX_SIZE_MIN..GFX_SIZE_MAX, also times supersample */
    int supersample;   /* 1..GFX_SUPERSAMPLE_MAX: drawn that many times larger, then averaged */
    GfxLook look;
    GfxBackend backend;
    bool profile;         /* wait for the end of every pass, so that gfx_stats has its time; costs a little */
    uint32_t skip_passes; /* for tests: bit i leaves out pass i (see gfx_pass_name) */
} GfxDef;

GfxDef gfx_def_default(void); /* 1280 x 720, 1, water, auto */

typedef struct Gfx Gfx;

/* ERR_USAGE: a value out of its range. ERR_GL: no usable OpenGL; the message has one line for each back end
 * tried and names the packages to install. */
Gfx *gfx_create(const GfxDef *def, Err *err);
void gfx_destroy(Gfx *gfx); /* NULL is fine */

/* Who draws, for log and `gl-info`. Strings live as long as the Gfx. */
typedef struct GfxInfo {
    GfxBackend backend; /* never AUTO */
    const char *vendor, *renderer, *version;
    const char *reason; /* one line: why this back end and, in auto, what failed before it */
} GfxInfo;
GfxInfo gfx_info(const Gfx *gfx);

/* ---- Meshes: handed over once, drawn many times ---- */

typedef enum GfxMaterialKind {
    GFX_MATERIAL_PAINT, /* `color`, or the triangles' own */
    GFX_MATERIAL_HULL, /* a boat's paint: antifouling, boot stripe, topsides in `color`, wooden deck, cabin */
    GFX_MATERIAL_STONE, /* quays, rocks, the sea's ground: `color` with grain and joints */
    GFX_MATERIAL_TANK,  /* a closed container seen from outside through its near walls: far walls and floor
                           tiled in `color`, edges as lines */
    GFX_MATERIAL_COUNT
} GfxMaterialKind;

typedef struct GfxMaterial {
    GfxMaterialKind kind;
    float color[3]; /* linear RGB, 0..1 */
    float waterline, cabin_base,
        cabin_top; /* hull: heights in the mesh's own frame, m; no cabin where top <= base */
} GfxMaterial;

GfxMaterial gfx_material_default(GfxMaterialKind kind);

typedef struct GfxMeshDef {
    const float (*vertices)[3]; /* m, own frame */
    uint32_t vertex_count;
    const uint32_t (*triangles)[3]; /* counter-clockwise seen from outside */
    uint32_t triangle_count;
    const uint8_t (*triangle_colors)[3]; /* sRGB, one a triangle; or NULL: the material's colour */
    GfxMaterial material;
} GfxMeshDef;

/* Returns the mesh's number (0, 1, ...). -1 with ERR_INPUT: an index out of range, a coordinate that is not
 * finite, no triangle. Shading is smooth except across edges sharper than 35 degrees. */
int gfx_add_mesh(Gfx *gfx, const GfxMeshDef *def, Err *err);

typedef struct GfxInstance {
    int mesh;
    float pose[16]; /* own frame -> local, column-major, rigid (no scale) */
} GfxInstance;

/* ---- One image ---- */

/* All arrays have `count` entries; those that say so may be NULL. */
typedef struct GfxParticles {
    uint32_t count;
    float spacing;              /* d = 2 r, m, > 0 */
    const float (*position)[4]; /* local, m; [3] is ignored */
    const float (*velocity)[4]; /* m/s; NULL: droplets are not stretched along their path */
    const float *fade;          /* 0 (not there) .. 1; NULL: 1 */
    const float *foam;          /* water: white air in the water, 0 (clear) .. 1 (dense) and above; NULL: 0 */
    const float *field;         /* particles: what the colour shows; NULL: all at the lower end */
    const uint64_t *id;         /* keeps the droplets of one particle alike between images; NULL: the index */
} GfxParticles;

typedef struct GfxCamera {
    float eye[3], target[3], up[3]; /* local, m; eye != target, up not along the view */
    float fov_deg;                  /* vertical, 1..150 */
    float near_plane, far_plane;    /* m, 0 < near < far; of meshes and particles, the ocean has no end */
} GfxCamera;

/* Still water without end around the window. `edge_distance` tells where the particles end: the horizontal
 * signed distance to the window's edge, positive inside, sampled at x = edge_min[0] + i (edge_max[0] -
 * edge_min[0]) / (edge_size[0] - 1), z alike with j, at [j * edge_size[0] + i]. It is interpolated linearly;
 * beyond its bounds all is ocean. A few spacings between samples are enough. */
typedef struct GfxOcean {
    bool enabled;
    float level; /* y of still water, local, m. Also without an ocean: the height about which the surface is
                    smoothed; best near the mean surface */
    const float *edge_distance;     /* m; needed when enabled */
    uint32_t edge_size[2];          /* 2..4096 each */
    float edge_min[2], edge_max[2]; /* x and z, local, m */
    float blend[2]; /* m, 0 <= [0] < [1]: particles count for nothing nearer to the edge than [0], alone
                       beyond [1] */
    /* White water on the sea, inside the window and where particles have left it, sampled as the distances
     * are; NULL: none. Sum of GfxParticles.foam over the particles at the surface, per square of a spacing; 0
     * beyond the bounds. Only sheets and crests high above still water show the particles' own foam. */
    const float *foam;
    uint32_t foam_size[2];          /* 2..4096 each */
    float foam_min[2], foam_max[2]; /* x and z, local, m */
    float ripples; /* strength of the wind's ripples, 0 (glass) .. 2; also on water without an ocean */
} GfxOcean;

/* Colours of the look "particles". */
typedef struct GfxField {
    float min, max;           /* of GfxParticles.field; values beyond take the end's colour; min < max */
    const char *title, *unit; /* ASCII, e.g. "speed", "m/s"; NULL title: no legend */
} GfxField;

typedef struct GfxScene {
    GfxParticles particles;
    const GfxInstance *instances;
    uint32_t instance_count;
    GfxCamera camera;
    GfxOcean ocean;
    GfxField field;
    bool ground;        /* a floor without end, where there is no ocean */
    float ground_level; /* local y, m */
    float sun[3];       /* direction towards the sun, any length > 0, y > 0 */
    double time;        /* s: ripples move */
    double origin[3];   /* world position of the local origin, m: ripples and tiles stay where they are in the
                           world */
} GfxScene;

/* No particles, no meshes, a camera 6 m away, afternoon sun, no ocean, level 0. */
GfxScene gfx_scene_default(void);

/* `rgb`: width * height * 3 bytes, sRGB, top row first. ERR_USAGE: a value of the scene out of its range,
 * named; particles that are not finite are an error with their index. ERR_GL: the driver failed. */
bool gfx_draw(Gfx *gfx, const GfxScene *scene, uint8_t *rgb, Err *err);

/* ---- Looking inside: for logs, benchmarks and tests ---- */

int gfx_pass_count(void);
const char *gfx_pass_name(int pass); /* "depth", "composite", ... */

typedef struct GfxStats {
    uint32_t particles_drawn, droplets; /* of the last image, like all */
    bool pass_ran[32];
    double pass_ms[32]; /* needs GfxDef.profile, else 0 */
    double total_ms;
} GfxStats;
GfxStats gfx_stats(const Gfx *gfx);

/* What a pass of the last image left behind, scaled to 0..255 for the eye and for comparison; `rgb` as in
 * gfx_draw, nearest neighbour where the pass works at another size. False (ERR_USAGE) for a pass that leaves
 * no picture of its own or is not part of the look. */
bool gfx_pass_image(Gfx *gfx, int pass, uint8_t *rgb, Err *err);

#ifdef __cplusplus
}
#endif
#endif
