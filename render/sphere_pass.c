/* Particles as spheres: the opaque ones with depth, then the fading ones from far to near over them, without.
 */
#include "pass.h"

#include "shader.h"

static bool create(Pass *pass, Frame *frame, Err *err) {
    static const char *const samplers[] = {"color_map", NULL};
    static const char *const fragments[] = {"sphere.frag", "sphere_fading.frag"};
    for (int i = 0; i < 2; i++) {
        pass->programs[i] = shader_program(frame->gl, "sphere.vert", fragments[i], samplers, err);
        if (!pass->programs[i])
            return false;
    }
    pass->framebuffers[0] =
        framebuffer_create(frame->gl, &frame->images[IMAGE_MESH], &frame->images[IMAGE_MESH_DEPTH], err);
    return pass->framebuffers[0] != 0;
}

static void draw_points(const Frame *frame, GLuint program, const PointBuffer *points) {
    frame->gl->UseProgram(program);
    pass_wide_viewport(frame, &frame->images[IMAGE_MESH], program);
    frame->gl->BindVertexArray(points->vertex_array);
    frame->gl->DrawArrays(GL_POINTS, 0, points->count);
}

static bool draw(Pass *pass, Frame *frame, Err *err) {
    (void)err;
    const Gl *gl = frame->gl;
    framebuffer_bind(gl, pass->framebuffers[0], &frame->images[IMAGE_MESH]);
    texture_bind(gl, 0, &frame->color_map);
    gl->Enable(GL_DEPTH_TEST);
    gl->DepthMask(GL_TRUE);
    gl->Disable(GL_BLEND);
    draw_points(frame, pass->programs[0], &frame->body);
    gl->DepthMask(GL_FALSE);
    gl->Enable(GL_BLEND);
    gl->BlendFunc(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA);
    draw_points(frame, pass->programs[1], &frame->fading);
    return true;
}

const PassType sphere_pass = {"spheres", PASS_IN_PARTICLES, IMAGE_MESH, create, draw};
