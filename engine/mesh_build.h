/* What the makers of meshes (OBJ, box, sphere, planes) share. Not for users of meshes. */
#ifndef SKIFF_MESH_BUILD_H
#define SKIFF_MESH_BUILD_H

#include "mesh.h"

#include <stddef.h>

enum { MESH_MAX_ELEMENTS = 1 << 28 }; /* vertices, and triangles: 3 of them still fit a uint32_t */

/* Empty arrays for this many vertices and triangles; the counts are set. ERR_INPUT with `name` when there are
 * too many or memory is exhausted; *mesh is then all zero. */
bool mesh_allocate(Mesh *mesh, const char *name, size_t vertex_count, size_t triangle_count, Err *err);

/* Merges vertices that coincide exactly, leaves out triangles that collapsed to a line by it and vertices of
 * no triangle, and sets the bounds. ERR_INPUT when no triangle remains. On failure the mesh is freed. */
bool mesh_finish(Mesh *mesh, const char *name, Err *err);

#endif
