/* Solids between two outlines of as many points at two heights: prisms, cylinders, truncated cones. */
#include "mesh.h"

#include "mesh_build.h"

#include <math.h>
#include <string.h>

/* Leaves out the triangles of an outline that is a point. */
static void add_triangle(Mesh *mesh, uint32_t a, uint32_t b, uint32_t c) {
    const size_t size = sizeof *mesh->vertices;
    if (memcmp(mesh->vertices[a], mesh->vertices[b], size) == 0 ||
        memcmp(mesh->vertices[b], mesh->vertices[c], size) == 0 ||
        memcmp(mesh->vertices[c], mesh->vertices[a], size) == 0)
        return;
    uint32_t *corner = mesh->triangles[mesh->triangle_count++];
    corner[0] = a;
    corner[1] = b;
    corner[2] = c;
}

bool mesh_make_prism(const float (*bottom)[2], const float (*top)[2], uint32_t count, float height,
                     Mesh *mesh, Err *err) {
    memset(mesh, 0, sizeof *mesh);
    if (count < 3 || !(height > 0.0f) || !isfinite(height))
        return err_set(err, ERR_INPUT, "prism: %u points and height %g m; at least 3 and above 0 are allowed",
                       count, (double)height);
    if (!mesh_allocate(mesh, "prism", 2 * (size_t)count + 2, 4 * (size_t)count, err))
        return false;
    const float half = 0.5f * height;
    for (uint32_t i = 0; i < count; i++) {
        const float low[3] = {bottom[i][0], -half, bottom[i][1]}, high[3] = {top[i][0], half, top[i][1]};
        memcpy(mesh->vertices[2 * i], low, sizeof low);
        memcpy(mesh->vertices[2 * i + 1], high, sizeof high);
    }
    const uint32_t floor_centre = 2 * count, lid_centre = 2 * count + 1;
    mesh->vertices[floor_centre][1] = -half;
    mesh->vertices[lid_centre][1] = half;
    mesh->triangle_count = 0;
    for (uint32_t i = 0; i < count; i++) {
        const uint32_t low = 2 * i, next = 2 * ((i + 1) % count);
        add_triangle(mesh, low, next, next + 1);
        add_triangle(mesh, low, next + 1, low + 1);
        add_triangle(mesh, floor_centre, next, low);
        add_triangle(mesh, lid_centre, low + 1, next + 1);
    }
    return mesh_finish(mesh, "prism", err);
}
