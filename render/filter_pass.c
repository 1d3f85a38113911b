/* Smooths the water's depth: a filter after [Truong & Yuksel 2018] along rows, then along columns, then a
 * local mean. The result is in IMAGE_DEPTH_WORK. */
#include "pass.h"

#include "shader.h"

#define REACH_IN_RADII     4.5f
#define THRESHOLD_IN_RADII 3.0f
#define CLEAN_IN_RADII     2.0f

static const char *const samplers[] = {"depth_image", NULL};

static bool create(Pass *pass, Frame *frame, Err *err) {
    pass->programs[0] = shader_program(frame->gl, "fill.vert", "filter.frag", samplers, err);
    pass->programs[1] =
        pass->programs[0] ? shader_program(frame->gl, "fill.vert", "clean.frag", samplers, err) : 0;
    if (!pass->programs[1])
        return false;
    pass->framebuffers[0] = framebuffer_create(frame->gl, &frame->images[IMAGE_DEPTH], NULL, err);
    pass->framebuffers[1] = framebuffer_create(frame->gl, &frame->images[IMAGE_DEPTH_WORK], NULL, err);
    return pass->framebuffers[0] && pass->framebuffers[1];
}

/* From one of the two depth images into the other. */
static void run(const Pass *pass, const Frame *frame, GLuint program, ImageId from) {
    bool first = from == IMAGE_DEPTH;
    framebuffer_bind(frame->gl, pass->framebuffers[first], &frame->images[IMAGE_DEPTH]);
    texture_bind(frame->gl, 0, &frame->images[from]);
    frame->gl->UseProgram(program);
    pass_fill(frame);
}

static bool draw(Pass *pass, Frame *frame, Err *err) {
    (void)err;
    const Gl *gl = frame->gl;
    GLuint filter = pass->programs[0], clean = pass->programs[1];
    float radius = frame->block.sphere[0];
    float focal = frame->block.sphere[2] * (float)frame->images[IMAGE_DEPTH].height / (float)frame->height;
    GLint direction = gl->GetUniformLocation(filter, "direction");
    gl->UseProgram(filter);
    gl->Uniform1f(gl->GetUniformLocation(filter, "reach"), REACH_IN_RADII * radius * focal);
    gl->Uniform1f(gl->GetUniformLocation(filter, "threshold"), THRESHOLD_IN_RADII * radius);
    gl->Uniform2i(direction, 1, 0);
    run(pass, frame, filter, IMAGE_DEPTH);
    gl->Uniform2i(direction, 0, 1);
    run(pass, frame, filter, IMAGE_DEPTH_WORK);
    gl->UseProgram(clean);
    gl->Uniform1f(gl->GetUniformLocation(clean, "threshold"), CLEAN_IN_RADII * radius);
    run(pass, frame, clean, IMAGE_DEPTH);
    return true;
}

const PassType filter_pass = {"filter", PASS_IN_WATER, IMAGE_DEPTH_WORK, create, draw};
