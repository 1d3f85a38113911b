/* Chooses the particles to draw (surface.c) and hands them to GL. */
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
    create_points(frame->gl, &frame->body);
    create_points(frame->gl, &frame->droplets);
    create_points(frame->gl, &frame->fading);
    return true;
}

static void upload(const Gl *gl, PointBuffer *points, const SurfaceList *list) {
    points->count = (GLsizei)list->count;
    gl->BindBuffer(GL_ARRAY_BUFFER, points->buffer);
    gl->BufferData(GL_ARRAY_BUFFER, (GLsizeiptr)((size_t)list->count * sizeof(SurfacePoint)), list->points,
                   GL_STREAM_DRAW);
}

static bool draw(Pass *pass, Frame *frame, Err *err) {
    (void)pass;
    Surface *surface = &frame->surface;
    if (!surface_select(surface, frame->scene, frame->def.look, err))
        return false;
    upload(frame->gl, &frame->body, &surface->body);
    upload(frame->gl, &frame->droplets, &surface->droplets);
    upload(frame->gl, &frame->fading, &surface->fading);
    return true;
}

const PassType surface_pass = {"surface", PASS_IN_WATER | PASS_IN_PARTICLES, -1, create, draw};
