/* What several passes do alike. */
#include "pass.h"

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
