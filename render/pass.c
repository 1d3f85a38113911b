/* What several passes do alike. */
#include "pass.h"

#include <math.h>

enum { MARGIN_PX = 48 };

void pass_fill(const Frame *frame) {
    const Gl *gl = frame->gl;
    gl->Disable(GL_BLEND);
    gl->Disable(GL_DEPTH_TEST);
    gl->DepthMask(GL_FALSE);
    gl->BindVertexArray(frame->empty_vertex_array);
    gl->DrawArrays(GL_TRIANGLES, 0, 3);
}

void pass_wide_viewport(const Frame *frame, const Texture *target, GLuint program) {
    const Gl *gl = frame->gl;
    float width = (float)target->width, height = (float)target->height;
    gl->Viewport(-MARGIN_PX, -MARGIN_PX, target->width + 2 * MARGIN_PX, target->height + 2 * MARGIN_PX);
    gl->Uniform2f(gl->GetUniformLocation(program, "overscan"), (width + 2.0f * MARGIN_PX) / width,
                  (height + 2.0f * MARGIN_PX) / height);
}

float pass_still_depth(const FrameBlock *block, int x, int y, int width, int height) {
    const float *camera = block->camera;
    float right = (2.0f * (float)x + 1.0f) / (float)width - 1.0f;
    float up = (2.0f * (float)y + 1.0f) / (float)height - 1.0f;
    float ray = camera[1] * right * block->lens[0] + camera[5] * up * block->lens[1] - camera[9];
    float depth = fabsf(ray) > 1e-4f ? (block->eye[3] - block->eye[1]) / ray : block->sun[3];
    depth = depth > 0.0f && depth < block->sun[3] ? depth : block->sun[3];
    return block->edge[2] > 0.0f ? depth : 0.0f;
}
