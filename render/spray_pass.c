/* Droplets in front of the finished water. They are small and many: their order among each other is not seen.
 */
#include "pass.h"

#include "shader.h"

static bool create(Pass *pass, Frame *frame, Err *err) {
    static const char *const samplers[] = {"depth_image", NULL};
    pass->programs[0] = shader_program(frame->gl, "spray.vert", "spray.frag", samplers, err);
    pass->framebuffers[0] =
        framebuffer_create(frame->gl, &frame->images[IMAGE_COMPOSED], &frame->images[IMAGE_MESH_DEPTH], err);
    return pass->programs[0] && pass->framebuffers[0];
}

static bool draw(Pass *pass, Frame *frame, Err *err) {
    (void)err;
    const Gl *gl = frame->gl;
    framebuffer_bind(gl, pass->framebuffers[0], &frame->images[IMAGE_COMPOSED]);
    gl->Enable(GL_DEPTH_TEST);
    gl->DepthMask(GL_FALSE);
    gl->Enable(GL_BLEND);
    gl->BlendFunc(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA);
    texture_bind(gl, 0, &frame->images[IMAGE_SMOOTH]);
    gl->UseProgram(pass->programs[0]);
    gl->BindVertexArray(frame->droplets.vertex_array);
    gl->DrawArrays(GL_POINTS, 0, frame->droplets.count);
    return true;
}

const PassType spray_pass = {"spray", PASS_IN_WATER, IMAGE_COMPOSED, create, draw};
