/* Chooses the particles to draw (surface.c) and hands GL those that it draws. */
#include "pass.h"

#include <stddef.h>

static void create_points(const Gl *gl, PointBuffer *points) {
    gl->GenVertexArrays(1, &points->vertex_array);
    gl->GenBuffers(1, &points->buffer);
    gl->BindVertexArray(points->vertex_array);
    gl->BindBuffer(GL_ARRAY_BUFFER, points->buffer);
    for (GLuint i = 0; i < 3; i++)
        gl->EnableVertexAttribArray(i);
    gl->VertexAttribPointer(0, 4, GL_FLOAT, GL_FALSE, sizeof(SurfacePoint), NULL);
    gl->VertexAttribPointer(1, 1, GL_FLOAT, GL_FALSE, sizeof(SurfacePoint),
                            (void *)offsetof(SurfacePoint, value));
    gl->VertexAttribPointer(2, 1, GL_FLOAT, GL_FALSE, sizeof(SurfacePoint),
                            (void *)offsetof(SurfacePoint, bulk));
}

static bool create(Pass *pass, Frame *frame, Err *err) {
    (void)pass;
    (void)err;
    create_points(frame->gl, &frame->rich);
    create_points(frame->gl, &frame->droplets);
    return true;
}

static void upload(const Gl *gl, PointBuffer *buffer, const SurfacePoint *points, uint32_t count) {
    buffer->count = (GLsizei)count;
    gl->BindBuffer(GL_ARRAY_BUFFER, buffer->buffer);
    gl->BufferData(GL_ARRAY_BUFFER, (GLsizeiptr)((size_t)count * sizeof *points), points, GL_STREAM_DRAW);
}

static bool draw(Pass *pass, Frame *frame, Err *err) {
    (void)pass;
    Surface *surface = &frame->surface;
    if (!surface_select(surface, frame->scene, frame->def.look, err))
        return false;
    upload(frame->gl, &frame->rich, surface->body.points, surface->rich_count);
    upload(frame->gl, &frame->droplets, surface->droplets.points, surface->droplets.count);
    return true;
}

const PassType surface_pass = {"surface", PASS_IN_WATER | PASS_IN_PARTICLES, -1, create, draw};
