/* Metres of water and amount of foam along each ray, added up over the particles near the surface; at a
 * quarter of the size, as both are smooth. The sums depend on the order of the particles in the last bit, so
 * that order is the input's. */
#include "pass.h"

#include "shader.h"

static bool create(Pass *pass, Frame *frame, Err *err) {
    pass->programs[0] = shader_program(frame->gl, "thickness.vert", "thickness.frag", NULL, err);
    pass->framebuffers[0] = framebuffer_create(frame->gl, &frame->images[IMAGE_THICKNESS], NULL, err);
    return pass->programs[0] && pass->framebuffers[0];
}

static bool draw(Pass *pass, Frame *frame, Err *err) {
    (void)err;
    const Gl *gl = frame->gl;
    const Texture *target = &frame->images[IMAGE_THICKNESS];
    GLuint program = pass->programs[0];
    framebuffer_bind(gl, pass->framebuffers[0], target);
    gl->ClearBufferfv(GL_COLOR, 0, (const float[4]){0.0f});
    gl->UseProgram(program);
    pass_wide_viewport(frame, target, program);
    gl->Uniform1f(gl->GetUniformLocation(program, "focal"),
                  frame->block.sphere[2] * (float)target->height / (float)frame->height);
    gl->Disable(GL_DEPTH_TEST);
    gl->Enable(GL_BLEND);
    gl->BlendFunc(GL_ONE, GL_ONE);
    gl->BindVertexArray(frame->rich.vertex_array);
    gl->DrawArrays(GL_POINTS, 0, frame->rich.count);
    return true;
}

const PassType thickness_pass = {"thickness", PASS_IN_WATER, IMAGE_THICKNESS, create, draw};
