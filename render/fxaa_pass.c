/* Anti-aliasing of the finished picture. */
#include "pass.h"

#include "shader.h"

static bool create(Pass *pass, Frame *frame, Err *err) {
    static const char *const samplers[] = {"source", NULL};
    pass->programs[0] = shader_program(frame->gl, "fill.vert", "fxaa.frag", samplers, err);
    pass->framebuffers[0] = framebuffer_create(frame->gl, &frame->images[IMAGE_FINISHED], NULL, err);
    return pass->programs[0] && pass->framebuffers[0];
}

static bool draw(Pass *pass, Frame *frame, Err *err) {
    (void)err;
    bool water = frame->def.look == GFX_LOOK_WATER;
    framebuffer_bind(frame->gl, pass->framebuffers[0], &frame->images[IMAGE_FINISHED]);
    texture_bind(frame->gl, 0, &frame->images[water ? IMAGE_COMPOSED : IMAGE_MESH]);
    frame->gl->UseProgram(pass->programs[0]);
    pass_fill(frame);
    return true;
}

const PassType fxaa_pass = {"fxaa", PASS_IN_WATER | PASS_IN_PARTICLES, IMAGE_FINISHED, create, draw};
