/* Boats, walls and ground; once as they are and once mirrored in still water, at half the size, for
 * reflections. */
#include "pass.h"

#include "shader.h"

static const char *const samplers[] = {"sky_image", NULL};

static bool create_into(Pass *pass, Frame *frame, ImageId color, ImageId depth, Err *err) {
    pass->programs[0] = shader_program(frame->gl, "mesh.vert", "mesh.frag", samplers, err);
    if (!pass->programs[0])
        return false;
    pass->programs[1] = shader_program(frame->gl, "line.vert", "line.frag", NULL, err);
    if (!pass->programs[1])
        return false;
    pass->framebuffers[0] = framebuffer_create(frame->gl, &frame->images[color], &frame->images[depth], err);
    return pass->framebuffers[0] != 0;
}

static void set_pose(const Gl *gl, GLuint program, const GfxInstance *instance, float mirror) {
    gl->UseProgram(program);
    gl->UniformMatrix4fv(gl->GetUniformLocation(program, "pose"), 1, GL_FALSE, instance->pose);
    gl->Uniform1f(gl->GetUniformLocation(program, "mirror"), mirror);
}

static void draw_instance(const Pass *pass, const Frame *frame, const GfxInstance *instance, float mirror) {
    const Gl *gl = frame->gl;
    const StoredMesh *mesh = &frame->meshes.meshes[instance->mesh];
    const GfxMaterial *material = &mesh->material;
    GLuint program = pass->programs[0];
    float paint[4] = {material->color[0], material->color[1], material->color[2], 1.0f};
    float heights[4] = {material->waterline, material->cabin_base, material->cabin_top, 0.0f};
    bool tank = material->kind == GFX_MATERIAL_TANK;
    set_pose(gl, program, instance, mirror);
    gl->Uniform1i(gl->GetUniformLocation(program, "material"), (GLint)material->kind);
    gl->Uniform1i(gl->GetUniformLocation(program, "has_colors"), mesh->own_colors);
    gl->Uniform4fv(gl->GetUniformLocation(program, "paint"), 1, paint);
    gl->Uniform4fv(gl->GetUniformLocation(program, "heights"), 1, heights);
    gl->BindVertexArray(mesh->vertex_array);
    if (tank) { /* only walls that face away from the eye: one looks in through the others */
        gl->Enable(GL_CULL_FACE);
        gl->CullFace(GL_FRONT);
        gl->FrontFace(mirror < 0.0f ? GL_CW : GL_CCW);
    }
    gl->DrawArrays(GL_TRIANGLES, 0, mesh->vertex_count);
    gl->Disable(GL_CULL_FACE);
    if (tank) {
        set_pose(gl, pass->programs[1], instance, mirror);
        gl->BindVertexArray(mesh->edge_vertex_array);
        gl->DrawArrays(GL_LINES, 0, mesh->edge_vertex_count);
    }
}

static void draw_all(const Pass *pass, const Frame *frame, ImageId target, float mirror) {
    static const float far_away[4] = {1.0f};
    const Gl *gl = frame->gl;
    framebuffer_bind(gl, pass->framebuffers[0], &frame->images[target]);
    gl->Disable(GL_BLEND);
    gl->Enable(GL_DEPTH_TEST);
    gl->DepthMask(GL_TRUE);
    gl->ClearBufferfv(GL_DEPTH, 0, far_away);
    if (frame->def.look == GFX_LOOK_WATER)
        gl->ClearBufferfv(GL_COLOR, 0, (const float[4]){0.0f});
    texture_bind(gl, 0, &frame->images[IMAGE_SKY]);
    for (uint32_t i = 0; i < frame->scene->instance_count; i++)
        draw_instance(pass, frame, &frame->scene->instances[i], mirror);
}

static bool create_meshes(Pass *pass, Frame *frame, Err *err) {
    return create_into(pass, frame, IMAGE_MESH, IMAGE_MESH_DEPTH, err);
}

static bool draw_meshes(Pass *pass, Frame *frame, Err *err) {
    (void)err;
    draw_all(pass, frame, IMAGE_MESH, 1.0f);
    return true;
}

static bool create_reflection(Pass *pass, Frame *frame, Err *err) {
    return create_into(pass, frame, IMAGE_REFLECTION, IMAGE_REFLECTION_DEPTH, err);
}

static bool draw_reflection(Pass *pass, Frame *frame, Err *err) {
    (void)err;
    draw_all(pass, frame, IMAGE_REFLECTION, -1.0f);
    return true;
}

const PassType mesh_pass = {"meshes", PASS_IN_WATER | PASS_IN_PARTICLES, IMAGE_MESH, create_meshes,
                            draw_meshes};
const PassType reflection_pass = {"reflection", PASS_IN_WATER, IMAGE_REFLECTION, create_reflection,
                                  draw_reflection};
