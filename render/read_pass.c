/* Brings the picture back to memory; for the look of particles the depth of the meshes too. */
#include "pass.h"

static bool create(Pass *pass, Frame *frame, Err *err) {
    bool water = frame->def.look == GFX_LOOK_WATER;
    const Texture *images = frame->images;
    pass->framebuffers[0] = framebuffer_create(frame->gl, &images[water ? IMAGE_COMPOSED : IMAGE_MESH],
                                               water ? NULL : &images[IMAGE_MESH_DEPTH], err);
    return pass->framebuffers[0] != 0;
}

static bool draw(Pass *pass, Frame *frame, Err *err) {
    (void)err;
    const Gl *gl = frame->gl;
    gl->BindFramebuffer(GL_FRAMEBUFFER, pass->framebuffers[0]);
    gl->PixelStorei(GL_PACK_ALIGNMENT, 1);
    gl->ReadPixels(0, 0, frame->width, frame->height, GL_RGBA, GL_UNSIGNED_BYTE, frame->memory[IMAGE_READ]);
    if (frame->mesh_depth)
        gl->ReadPixels(0, 0, frame->width, frame->height, GL_DEPTH_COMPONENT, GL_FLOAT, frame->mesh_depth);
    return true;
}

const PassType read_pass = {"read", PASS_IN_WATER | PASS_IN_PARTICLES, IMAGE_READ, create, draw};
