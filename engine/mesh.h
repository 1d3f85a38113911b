/* Triangle meshes: Wavefront OBJ input, closedness, exact volume integrals, signed distance. */
#ifndef SKIFF_MESH_H
#define SKIFF_MESH_H

#include "base/err.h"

#include <stdint.h>

enum { MESH_MAX_MATERIALS = 256, MESH_NAME_SIZE = 32 };

/* Positions in metres, right-handed, y up; triangles counter-clockwise seen from outside. */
typedef struct Mesh {
    float (*vertices)[3];
    uint32_t (*triangles)[3];
    uint32_t vertex_count;
    uint32_t triangle_count;
    uint8_t *materials; /* of each triangle, an index into the names; NULL: all of one nameless material */
    char (*material_names)[MESH_NAME_SIZE];
    uint32_t material_count;
    float min[3], max[3];  /* bounds of the referenced vertices */
    struct MeshTree *tree; /* distance queries; built by mesh_build_tree */
} Mesh;

/* Mass properties of a uniform solid of density 1 kg/m^3, by exact polynomial integrals over the surface
 * [Mirtich 1996, Fast and accurate computation of polyhedral mass properties]. */
typedef struct MeshMass {
    double volume;        /* m^3 */
    double area;          /* m^2, of the surface */
    double centre[3];     /* centre of mass, m */
    double inertia[3][3]; /* about the centre, m^5; multiply by the density for kg m^2 */
} MeshMass;

/* Every maker of a mesh leaves *mesh all zero when it fails, so that mesh_free is always allowed.
 *
 * Reads v and f records (triangles and polygons, which are fanned from their first corner: they should be
 * convex; negative indices; v/vt/vn forms), and usemtl records, of which the names are kept (faces before the
 * first one: ""); other records are ignored. ERR_INPUT with file:line on anything
 * malformed: coordinates that are not finite or beyond 1e9, index out of range, fewer than 3 corners, a
 * corner repeated, a material's name that is missing or longer than MESH_NAME_SIZE - 1, too many of them.
 * Vertices that coincide exactly are merged, so that meshes with split normals are still closed; triangles
 * that collapse by it carry no surface and are left out. */
bool mesh_load_obj(const char *path, Mesh *mesh, Err *err);
bool mesh_parse_obj(const char *name, const char *text, size_t size, Mesh *mesh, Err *err);
/* Axis-aligned box, 8 vertices, 12 triangles. */
bool mesh_make_box(const float min[3], const float max[3], Mesh *mesh, Err *err);
/* Icosphere of 20 * 4^level triangles with vertices on the sphere; level 0..8. */
bool mesh_make_sphere(const float centre[3], float radius, int level, Mesh *mesh, Err *err);
/* The solid between an outline at y = -height / 2 and another of as many points (x, z) at y = height / 2,
 * joined point to point. Each outline runs from z to x (clockwise in the x-z plane) once around the y axis,
 * which sees all of it, or is a point on that axis. Points: 3 or more; they lie on the surface. ERR_INPUT
 * otherwise. */
bool mesh_make_prism(const float (*bottom)[2], const float (*top)[2], uint32_t count, float height,
                     Mesh *mesh, Err *err);
/* Convex polyhedron: points p with (p - point_k) . normal_k <= 0 for all k planes (at most 1024; normals of
 * any length > 0). Details below 1e-6 of the extent of the points are not resolved. ERR_INPUT when empty or
 * unbounded. */
bool mesh_make_planes(const float (*points)[3], const float (*normals)[3], int count, Mesh *mesh, Err *err);
void mesh_free(Mesh *mesh);

/* True if every edge joins exactly two triangles of opposite orientation, no triangle is degenerate and the
 * volume is positive. ERR_INPUT otherwise; the message names the mesh (`name`), the first faults with their
 * vertices, and how many there are. A mesh turned inside out (negative volume) is an error that says so. */
bool mesh_check_closed(const Mesh *mesh, const char *name, Err *err);

/* Scales by `scale` per axis, then rotates by the unit quaternion (x, y, z, w), then translates. Rebuild the
 * tree afterwards. A mirrored scale (negative determinant) flips the triangles so that they still face
 * outside. The old tree is freed. */
void mesh_transform(Mesh *mesh, const float scale[3], const float rotation[4], const float translation[3]);

void mesh_mass(const Mesh *mesh, MeshMass *mass);

/* The triangle across each side (side k runs from corner k to corner k + 1), triangle_count rows into memory
 * of the caller. UINT32_MAX where the edge is open, joins more than two triangles or two that face opposite
 * ways. ERR_INPUT without memory. */
bool mesh_neighbours(const Mesh *mesh, uint32_t (*neighbours)[3], Err *err);

/* Replaces an older tree. ERR_INPUT without triangles or memory. */
bool mesh_build_tree(Mesh *mesh, Err *err);
void mesh_free_tree(Mesh *mesh);
/* Signed distance in m, negative inside, exact for closed meshes (angle-weighted pseudo-normals, [Baerentzen
 * & Aanaes 2005]). Needs the tree. closest may be NULL. */
float mesh_distance(const Mesh *mesh, const float point[3], float closest[3]);
/* The same distance and its gradient: a unit vector, away from the closest point outside, towards it inside;
 * on the surface the (pseudo-)normal there. */
float mesh_distance_gradient(const Mesh *mesh, const float point[3], float gradient[3]);
/* The same distances of many points (their fourth number is not used) on this many OpenMP threads. */
void mesh_distances(const Mesh *mesh, const float (*points)[4], uint32_t count, float *distances,
                    int threads);

#endif
