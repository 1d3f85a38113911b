/* What lies behind the particles of the look "particles". */
#include "pass.h"

#include "shader.h"

static bool create(Pass *pass, Frame *frame, Err *err) {
    pass->programs[0] = shader_program(frame->gl, "fill.vert", "backdrop.frag", NULL, err);
    pass->framebuffers[0] = framebuffer_create(frame->gl, &frame->images[IMAGE_MESH], NULL, err);
    return pass->programs[0] && pass->framebuffers[0];
}

static bool draw(Pass *pass, Frame *frame, Err *err) {
    (void)err;
    framebuffer_bind(frame->gl, pass->framebuffers[0], &frame->images[IMAGE_MESH]);
    frame->gl->UseProgram(pass->programs[0]);
    pass_fill(frame);
    return true;
}

const PassType backdrop_pass = {"backdrop", PASS_IN_PARTICLES, IMAGE_MESH, create, draw};
