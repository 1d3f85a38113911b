/* The picture of water: surface, ocean, reflections, what is below, foam, sky. All of it is in
 * shaders/composite.frag. */
#include "pass.h"

#include "shader.h"

static bool create(Pass *pass, Frame *frame, Err *err) {
    static const char *const samplers[] = {"mesh_image",   "mesh_depth_image", "reflection_image",
                                           "normal_image", "thickness_image",  "edge_image",
                                           "sky_image",    "ripple_map",       NULL};
    pass->programs[0] = shader_program(frame->gl, "fill.vert", "composite.frag", samplers, err);
    pass->framebuffers[0] = framebuffer_create(frame->gl, &frame->images[IMAGE_COMPOSED], NULL, err);
    return pass->programs[0] && pass->framebuffers[0];
}

static bool draw(Pass *pass, Frame *frame, Err *err) {
    (void)err;
    const Gl *gl = frame->gl;
    const Texture *const inputs[] = {&frame->images[IMAGE_MESH],       &frame->images[IMAGE_MESH_DEPTH],
                                     &frame->images[IMAGE_REFLECTION], &frame->images[IMAGE_NORMAL],
                                     &frame->images[IMAGE_THICKNESS],  &frame->edge_distance,
                                     &frame->images[IMAGE_SKY],        &frame->ripples};
    framebuffer_bind(gl, pass->framebuffers[0], &frame->images[IMAGE_COMPOSED]);
    for (int unit = 0; unit < (int)(sizeof inputs / sizeof inputs[0]); unit++)
        texture_bind(gl, unit, inputs[unit]);
    gl->UseProgram(pass->programs[0]);
    pass_fill(frame);
    return true;
}

const PassType composite_pass = {"composite", PASS_IN_WATER, IMAGE_COMPOSED, create, draw};
