/* Eye depth of the water's body, less that of still water in the same pixel: smoothing the difference leaves
 * no streaks where one looks along the surface. Blending with MIN instead of a depth buffer is 1.4 times
 * faster in software. */
#include "pass.h"

#include "shader.h"

static bool create(Pass *pass, Frame *frame, Err *err) {
    pass->programs[0] = shader_program(frame->gl, "point_depth.vert", "point_depth.frag", NULL, err);
    pass->framebuffers[0] = framebuffer_create(frame->gl, &frame->images[IMAGE_DEPTH], NULL, err);
    return pass->programs[0] && pass->framebuffers[0];
}

static bool draw(Pass *pass, Frame *frame, Err *err) {
    (void)err;
    static const float nothing[4] = {1e4f};
    const Gl *gl = frame->gl;
    framebuffer_bind(gl, pass->framebuffers[0], &frame->images[IMAGE_DEPTH]);
    gl->ClearBufferfv(GL_COLOR, 0, nothing);
    gl->UseProgram(pass->programs[0]);
    pass_wide_viewport(frame, &frame->images[IMAGE_DEPTH], pass->programs[0]);
    gl->Disable(GL_DEPTH_TEST);
    gl->Enable(GL_BLEND);
    gl->BlendEquation(GL_MIN);
    gl->BlendFunc(GL_ONE, GL_ONE);
    gl->BindVertexArray(frame->body.vertex_array);
    gl->DrawArrays(GL_POINTS, 0, frame->body.count);
    gl->BlendEquation(GL_FUNC_ADD);
    return true;
}

const PassType depth_pass = {"depth", PASS_IN_WATER, IMAGE_DEPTH, create, draw};
