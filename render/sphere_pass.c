/* Particles as spheres: the opaque ones with depth, then the fading ones from far to near over them, without.
 */
#include "pass.h"

#include "shader.h"

static bool create(Pass *pass, Frame *frame, Err *err) {
    static const char *const samplers[] = {"color_map", NULL};
    pass->programs[0] = shader_program(frame->gl, "sphere.vert", "sphere.frag", samplers, err);
    pass->framebuffers[0] =
        framebuffer_create(frame->gl, &frame->images[IMAGE_MESH], &frame->images[IMAGE_MESH_DEPTH], err);
    return pass->programs[0] && pass->framebuffers[0];
}

static bool draw(Pass *pass, Frame *frame, Err *err) {
    (void)err;
    const Gl *gl = frame->gl;
    framebuffer_bind(gl, pass->framebuffers[0], &frame->images[IMAGE_MESH]);
    gl->UseProgram(pass->programs[0]);
    pass_wide_viewport(frame, &frame->images[IMAGE_MESH], pass->programs[0]);
    texture_bind(gl, 0, &frame->color_map);
    gl->Enable(GL_DEPTH_TEST);
    gl->DepthMask(GL_TRUE);
    gl->Disable(GL_BLEND);
    gl->BindVertexArray(frame->body.vertex_array);
    gl->DrawArrays(GL_POINTS, 0, frame->body.count);
    gl->DepthMask(GL_FALSE);
    gl->Enable(GL_BLEND);
    gl->BlendFunc(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA);
    gl->BindVertexArray(frame->fading.vertex_array);
    gl->DrawArrays(GL_POINTS, 0, frame->fading.count);
    return true;
}

const PassType sphere_pass = {"spheres", PASS_IN_PARTICLES, IMAGE_MESH, create, draw};
