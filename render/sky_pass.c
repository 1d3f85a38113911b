/* Paints the sky into a picture of the upper hemisphere, from which background and reflections read. */
#include "pass.h"

#include "shader.h"

static bool create(Pass *pass, Frame *frame, Err *err) {
    pass->programs[0] = shader_program(frame->gl, "fill.vert", "sky.frag", NULL, err);
    pass->framebuffers[0] = framebuffer_create(frame->gl, &frame->images[IMAGE_SKY], NULL, err);
    return pass->programs[0] && pass->framebuffers[0];
}

static bool draw(Pass *pass, Frame *frame, Err *err) {
    (void)err;
    const float *sun = frame->block.sun, *painted = frame->painted_sun;
    if (sun[0] == painted[0] && sun[1] == painted[1] && sun[2] == painted[2])
        return true;
    for (int k = 0; k < 3; k++)
        frame->painted_sun[k] = sun[k];
    framebuffer_bind(frame->gl, pass->framebuffers[0], &frame->images[IMAGE_SKY]);
    frame->gl->UseProgram(pass->programs[0]);
    pass_fill(frame);
    return true;
}

const PassType sky_pass = {"sky", PASS_IN_WATER | PASS_IN_PARTICLES, IMAGE_SKY, create, draw};
