/* What the passes of one image share: the frame's numbers, its images, and the form of a pass. */
#ifndef SKIFF_PASS_H
#define SKIFF_PASS_H

#include "gfx.h"
#include "mesh_store.h"
#include "splat.h"
#include "surface.h"
#include "target.h"

enum { RIPPLE_LAYERS = 4 };
#define NO_DEPTH 1e4f /* as in shaders/frame.glsl */

/* The uniform block `Frame` of shaders/frame.glsl, layout std140. */
typedef struct FrameBlock {
    float view[16];       /* local -> eye */
    float projection[16]; /* eye -> clip */
    float camera[16];     /* eye -> local */
    float eye[4];         /* local; [3]: level of still water */
    float lens[4];        /* tangents of half the field of view, horizontal and vertical; near, far plane */
    float size[4];        /* of the image drawn, px, and its inverse */
    float fluid_size[4];  /* of the fluid's images, alike */
    float sun[4];         /* unit; [3]: farthest depth at which the still surface serves as reference, m */
    float sphere[4];      /* radius of a particle as drawn, m; part of it by which it is lowered; px of 1 m at
                             depth 1 m in the full image; spacing, m */
    float edge_box[4];    /* local x, z -> texture coordinates of the edge distance: offset, scale */
    float foam_box[4];    /* the same for the ocean's foam */
    float edge[4];        /* blend from, to, m; 1: there is an ocean; 1: there is a ground */
    float ground[4];      /* level; world offset of tiles in x, z; strength of ripples */
    float ripple[RIPPLE_LAYERS][4];      /* offset in tiles (2), slope, tiles a metre */
    float ripple_turn[RIPPLE_LAYERS][4]; /* cosine, sine of its direction; log2 of tiles a metre */
    float field[4];                      /* minimum, 1 / (maximum - minimum) */
} FrameBlock;

/* Pictures between passes. images.c has the one table of their formats. */
typedef enum ImageId {
    IMAGE_SKY,  /* colour of the upper hemisphere, octahedral */
    IMAGE_MESH, /* meshes; alpha 1 where there is one */
    IMAGE_MESH_DEPTH,
    IMAGE_REFLECTION, /* meshes mirrored in still water */
    IMAGE_REFLECTION_DEPTH,
    IMAGE_DEPTH,     /* of the fluid: eye depth minus that of still water, m; NO_DEPTH where there is none */
    IMAGE_SMOOTH,    /* the same, smoothed */
    IMAGE_NORMAL,    /* of the fluid in the eye's frame x, y; residual depth; coverage */
    IMAGE_THICKNESS, /* m of water along the ray in particles near the surface; foam */
    IMAGE_COMPOSED,
    IMAGE_READ,     /* the picture as it was drawn */
    IMAGE_FINISHED, /* with smooth edges */
    IMAGE_COUNT
} ImageId;

/* Points in a vertex buffer: SurfacePoint arrays. */
typedef struct PointBuffer {
    GLuint vertex_array, buffer;
    GLsizei count;
} PointBuffer;

typedef struct Frame {
    const Gl *gl;
    GfxDef def;
    int width, height; /* drawn: with supersampling */
    GLuint empty_vertex_array, block_buffer;
    Texture images[IMAGE_COUNT];
    void *memory[IMAGE_COUNT];                  /* of those that the CPU draws: bottom row first */
    Texture ripples, edge_distance, ocean_foam; /* tables */
    float painted_sun[3];                       /* for which IMAGE_SKY is right */
    MeshStore meshes;

    /* Of this image. */
    const GfxScene *scene;
    FrameBlock block;
    Surface surface;
    PointBuffer tiles;              /* of composite_pass */
    PointBuffer rich, droplets;     /* filled by surface_pass */
    Splat body_discs, fading_discs; /* filled by the passes that draw them */
    float *mesh_depth;              /* of the look particles: the depth buffer, filled by read_pass */
    Buffer band_memory;             /* of passes, during each */
    uint8_t *rgb;                   /* the caller's */
} Frame;

enum { PASS_PROGRAMS = 4 };

/* GL objects of one pass; what is 0 is not used. */
typedef struct Pass {
    GLuint programs[PASS_PROGRAMS], framebuffers[PASS_PROGRAMS];
} Pass;

#define PASS_IN_WATER     (1u << GFX_LOOK_WATER)
#define PASS_IN_PARTICLES (1u << GFX_LOOK_PARTICLES)

typedef struct PassType {
    const char *name;
    unsigned looks;
    int image;                                          /* ImageId it leaves for the eye, or -1 */
    bool (*create)(Pass *pass, Frame *frame, Err *err); /* NULL: needs no GL objects */
    bool (*draw)(Pass *pass, Frame *frame, Err *err);
} PassType;

extern const PassType surface_pass, sky_pass, backdrop_pass, mesh_pass, reflection_pass, depth_pass,
    filter_pass, normal_pass, thickness_pass, composite_pass, spray_pass, read_pass, sphere_pass, fxaa_pass,
    average_pass, legend_pass;

/* Creates the images of a look, and destroys all. */
bool images_create(Frame *frame, Err *err);
void images_destroy(Frame *frame);
/* Reads an image back as pictures for the eye: rgb, width x height of the def, top row first. */
bool images_show(Frame *frame, ImageId id, uint8_t *rgb, Err *err);

/* Depth at which the ray through pixel (x, y) of an image meets still water: plane_depth of
 * shaders/frame.glsl. */
float pass_still_depth(const FrameBlock *block, int x, int y, int width, int height);

/* The nearest of `count` rows or columns. */
static inline int pass_clamp(int i, int count) {
    return i < 0 ? 0 : i >= count ? count - 1 : i;
}

/* Draws one triangle over the whole target, with depth test, depth writes and blending off. */
void pass_fill(const Frame *frame);
/* The fluid's images are half the size of the frame's. Points whose centres lie a little outside the view
 * still cover pixels inside, but GL clips points by centre: the viewport is widened by a margin, as is the
 * projection (shaders). */
void pass_wide_viewport(const Frame *frame, const Texture *target, GLuint program);

#endif
