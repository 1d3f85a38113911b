/* The picture of water: surface, ocean, reflections, what is below, foam, sky. All of it is in
 * shaders/composite.frag. Rows above all water take a shader of their own: in software GL a pixel of sky
 * would else cost as much as one of water. */
#include "pass.h"

#include "shader.h"

#include <math.h>

static bool create(Pass *pass, Frame *frame, Err *err) {
    static const char *const samplers[] = {
        "mesh_image", "sky_image",  "mesh_depth_image", "normal_image", "thickness_image",
        "edge_image", "ripple_map", "reflection_image", "ocean_foam",   NULL};
    static const char *const fragments[PASS_PROGRAMS] = {"composite.frag", "composite_sky.frag"};
    for (int i = 0; i < PASS_PROGRAMS; i++) {
        pass->programs[i] = shader_program(frame->gl, "fill.vert", fragments[i], samplers, err);
        if (!pass->programs[i])
            return false;
    }
    pass->framebuffers[0] = framebuffer_create(frame->gl, &frame->images[IMAGE_COMPOSED], NULL, err);
    return pass->framebuffers[0] != 0;
}

/* Height in the image, 0 (bottom) .. 1, below which all of the ocean lies. */
static float horizon_height(const FrameBlock *block) {
    const float *camera = block->camera;
    float rise = camera[5], top = 0.0f;
    if (block->eye[1] <= block->eye[3] || rise < 0.05f) /* below the surface, or almost no horizon */
        return 1.0f;
    for (float side = -1.0f; side <= 1.0f; side += 2.0f) {
        float y = (camera[9] - side * block->lens[0] * camera[1]) / (rise * block->lens[1]);
        top = fmaxf(top, 0.5f + 0.5f * y);
    }
    return top;
}

/* The same for the particles. */
static float fluid_height(const Frame *frame) {
    const float *view = frame->block.view;
    float top = -1.0f, radius = frame->block.sphere[0], near_plane = frame->block.lens[2];
    for (uint32_t i = 0; i < frame->surface.body.count; i++) {
        const float *p = frame->surface.body.points[i].position;
        float depth = -(view[2] * p[0] + view[6] * p[1] + view[10] * p[2] + view[14]) - radius;
        float y = view[1] * p[0] + view[5] * p[1] + view[9] * p[2] + view[13] + radius;
        if (depth + 2.0f * radius < near_plane)
            continue;
        top = fmaxf(top, depth > near_plane ? y / (depth * frame->block.lens[1]) : 1.0f);
    }
    return 0.5f + 0.5f * top;
}

/* Rows of the image, from the bottom, that can show water. */
static int find_water_rows(const Frame *frame) {
    const float margin_px = 8.0f; /* of the filter and the fluid's smaller image */
    float top = fluid_height(frame);
    if (frame->scene->ocean.enabled)
        top = fmaxf(top, horizon_height(&frame->block));
    float rows = ceilf(top * (float)frame->height + margin_px);
    return rows < 0.0f ? 0 : rows > (float)frame->height ? frame->height : (int)rows;
}

static bool draw(Pass *pass, Frame *frame, Err *err) {
    (void)err;
    const Gl *gl = frame->gl;
    const Texture *const inputs[] = {&frame->images[IMAGE_MESH],
                                     &frame->images[IMAGE_SKY],
                                     &frame->images[IMAGE_MESH_DEPTH],
                                     &frame->images[IMAGE_NORMAL],
                                     &frame->images[IMAGE_THICKNESS],
                                     &frame->edge_distance,
                                     &frame->ripples,
                                     &frame->images[IMAGE_REFLECTION],
                                     &frame->ocean_foam};
    int water_rows = find_water_rows(frame);
    framebuffer_bind(gl, pass->framebuffers[0], &frame->images[IMAGE_COMPOSED]);
    for (int unit = 0; unit < (int)(sizeof inputs / sizeof inputs[0]); unit++)
        texture_bind(gl, unit, inputs[unit]);
    gl->Enable(GL_SCISSOR_TEST);
    gl->UseProgram(pass->programs[0]);
    gl->Scissor(0, 0, frame->width, water_rows);
    pass_fill(frame);
    gl->UseProgram(pass->programs[1]);
    gl->Scissor(0, water_rows, frame->width, frame->height - water_rows);
    pass_fill(frame);
    gl->Disable(GL_SCISSOR_TEST);
    return true;
}

const PassType composite_pass = {"composite", PASS_IN_WATER, IMAGE_COMPOSED, create, draw};
