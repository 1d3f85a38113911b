/* Normals of the smoothed water. */
#include "pass.h"

#include "shader.h"

static bool create(Pass *pass, Frame *frame, Err *err) {
    static const char *const samplers[] = {"depth_image", NULL};
    pass->programs[0] = shader_program(frame->gl, "fill.vert", "normal.frag", samplers, err);
    pass->framebuffers[0] = framebuffer_create(frame->gl, &frame->images[IMAGE_NORMAL], NULL, err);
    return pass->programs[0] && pass->framebuffers[0];
}

static bool draw(Pass *pass, Frame *frame, Err *err) {
    (void)err;
    framebuffer_bind(frame->gl, pass->framebuffers[0], &frame->images[IMAGE_NORMAL]);
    texture_bind(frame->gl, 0, &frame->images[IMAGE_SMOOTH]);
    frame->gl->UseProgram(pass->programs[0]);
    pass_fill(frame);
    return true;
}

const PassType normal_pass = {"normals", PASS_IN_WATER, IMAGE_NORMAL, create, draw};
