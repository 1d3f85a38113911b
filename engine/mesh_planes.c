/* Convex polyhedra from half-spaces: a box much larger than the extent of the given points is clipped by one
 * plane after another. Faces share their vertices by index throughout, and each edge that is cut makes one
 * vertex, so the surface stays closed whatever the rounding; vertices within `tolerance` of a plane count as
 * on it, so that more than three planes can meet at a point. What remains of the first box shows that the
 * half-spaces do not bound a solid. */
#include "mesh.h"

#include "dvec.h"
#include "mesh_build.h"

#include <stdlib.h>
#include <string.h>

enum { MAX_PLANES = 1024 };

static const double box_factor = 1e4; /* first box over extent */
static const double tolerance_factor =
    1e-6; /* float32 planes that should meet at a point miss it by about this */

/* Convex face: a loop of vertices, counter-clockwise seen from outside. */
typedef struct Face {
    int *vertices;
    int count;
} Face;

/* Vertices that were cut off keep their place; mesh_finish leaves them out. */
typedef struct Solid {
    double (*vertices)[3];
    double *heights; /* over the plane of the current cut */
    int vertex_count, vertex_capacity;
    Face *faces;
    int face_count;
    double tolerance;
} Solid;

typedef struct Plane {
    double point[3], normal[3];
} Plane;

static void free_solid(Solid *solid) {
    for (int i = 0; solid->faces && i < solid->face_count; i++)
        free(solid->faces[i].vertices);
    free(solid->faces);
    free(solid->vertices);
    free(solid->heights);
    memset(solid, 0, sizeof *solid);
}

static int add_vertex(Solid *solid, const double position[3]) {
    if (solid->vertex_count == solid->vertex_capacity) {
        int capacity = 2 * solid->vertex_capacity + 64;
        double(*vertices)[3] = realloc(solid->vertices, (size_t)capacity * sizeof *vertices);
        if (vertices)
            solid->vertices = vertices;
        double *heights = realloc(solid->heights, (size_t)capacity * sizeof *heights);
        if (heights)
            solid->heights = heights;
        if (!vertices || !heights)
            return -1;
        solid->vertex_capacity = capacity;
    }
    dvec_copy(solid->vertices[solid->vertex_count], position);
    solid->heights[solid->vertex_count] = 0.0;
    return solid->vertex_count++;
}

static bool start_box(Solid *solid, const double centre[3], double half) {
    static const int loops[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                    {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
    solid->faces = calloc(MAX_PLANES + 6, sizeof *solid->faces);
    if (!solid->faces)
        return false;
    for (int i = 0; i < 8; i++) {
        double corner[3];
        for (int k = 0; k < 3; k++)
            corner[k] = centre[k] + (i >> k & 1 ? half : -half);
        if (add_vertex(solid, corner) < 0)
            return false;
    }
    for (; solid->face_count < 6; solid->face_count++) {
        Face *face = &solid->faces[solid->face_count];
        face->vertices = malloc(sizeof loops[0]);
        if (!face->vertices)
            return false;
        memcpy(face->vertices, loops[solid->face_count], sizeof loops[0]);
        face->count = 4;
    }
    return true;
}

/* The vertices that one cut made, each on the edge between two older ones. */
typedef struct CutEdge {
    int low, high, vertex;
} CutEdge;

typedef struct Cut {
    CutEdge *edges;
    int count, capacity;
} Cut;

static int cut_vertex(Solid *solid, Cut *cut, int a, int b) {
    int low = a < b ? a : b, high = a < b ? b : a;
    for (int i = 0; i < cut->count; i++)
        if (cut->edges[i].low == low && cut->edges[i].high == high)
            return cut->edges[i].vertex;
    if (cut->count == cut->capacity) {
        int capacity = 2 * cut->capacity + 16;
        CutEdge *edges = realloc(cut->edges, (size_t)capacity * sizeof *edges);
        if (!edges)
            return -1;
        cut->edges = edges;
        cut->capacity = capacity;
    }
    double t = solid->heights[low] / (solid->heights[low] - solid->heights[high]), side[3], position[3];
    dvec_sub(side, solid->vertices[high], solid->vertices[low]);
    dvec_add_scaled(position, solid->vertices[low], t, side);
    int vertex = add_vertex(solid, position);
    cut->edges[cut->count++] = (CutEdge){low, high, vertex};
    return vertex;
}

/* Cuts one face; it loses all its vertices when nothing of it lies below the plane. */
static bool cut_face(Solid *solid, Cut *cut, Face *face) {
    int *loop = malloc((2 * (size_t)face->count + 2) * sizeof *loop);
    if (!loop)
        return false;
    int count = 0;
    bool below = false;
    for (int i = 0; i < face->count; i++) {
        int a = face->vertices[i], b = face->vertices[(i + 1) % face->count];
        double height_a = solid->heights[a], height_b = solid->heights[b];
        below = below || height_a < -solid->tolerance;
        if (height_a <= solid->tolerance)
            loop[count++] = a;
        if ((height_a > solid->tolerance && height_b < -solid->tolerance) ||
            (height_a < -solid->tolerance && height_b > solid->tolerance)) {
            int vertex = cut_vertex(solid, cut, a, b);
            if (vertex < 0) {
                free(loop);
                return false;
            }
            loop[count++] = vertex;
        }
    }
    free(face->vertices);
    face->vertices = loop;
    face->count = below && count >= 3 ? count : 0;
    return true;
}

/* Closes the hole of a cut with the vertices that lie on its plane. Each edge of the hole is a side of
 * exactly one face left, between two such vertices and not shared with another: the cap runs along these
 * sides backwards. */
static bool add_cap(Solid *solid) {
    int *next = malloc(((size_t)solid->vertex_count + 1) * sizeof *next), start = -1;
    if (!next)
        return false;
    for (int v = 0; v < solid->vertex_count; v++)
        next[v] = -1;
    /* A side met in both directions lies between two faces: the second erases what the first noted. */
    for (int f = 0; f < solid->face_count; f++) {
        const Face *face = &solid->faces[f];
        for (int i = 0; i < face->count; i++) {
            int a = face->vertices[i], b = face->vertices[(i + 1) % face->count];
            if (fabs(solid->heights[a]) > solid->tolerance || fabs(solid->heights[b]) > solid->tolerance)
                continue;
            if (next[a] == b)
                next[a] = -1;
            else
                next[b] = a;
        }
    }
    int *loop = malloc(((size_t)solid->vertex_count + 1) * sizeof *loop), count = 0;
    for (int v = 0; v < solid->vertex_count && start < 0; v++)
        if (next[v] >= 0)
            start = v;
    for (int v = start; loop && v >= 0 && count <= solid->vertex_count; v = next[v]) {
        loop[count++] = v;
        if (next[v] == start)
            break;
    }
    free(next);
    if (!loop)
        return false;
    if (count < 3 || count > solid->vertex_count) {
        free(loop); /* a plane that only touched: nothing to close, or found by the caller's check of
                       closedness */
        return true;
    }
    solid->faces[solid->face_count++] = (Face){loop, count};
    return true;
}

static bool cut_solid(Solid *solid, const Plane *plane) {
    bool outside = false, ok = true;
    for (int v = 0; v < solid->vertex_count; v++)
        solid->heights[v] = 0.0;
    for (int f = 0; f < solid->face_count; f++) {
        for (int i = 0; i < solid->faces[f].count; i++) {
            int v = solid->faces[f].vertices[i];
            double arm[3];
            dvec_sub(arm, solid->vertices[v], plane->point);
            solid->heights[v] = dvec_dot(arm, plane->normal);
            outside = outside || solid->heights[v] > solid->tolerance;
        }
    }
    if (!outside)
        return true;
    Cut cut = {0};
    for (int f = 0; f < solid->face_count && ok; f++)
        ok = cut_face(solid, &cut, &solid->faces[f]);
    free(cut.edges);
    int kept = 0;
    for (int f = 0; f < solid->face_count; f++) {
        if (solid->faces[f].count == 0)
            free(solid->faces[f].vertices);
        else
            solid->faces[kept++] = solid->faces[f];
    }
    solid->face_count = kept;
    return ok && (kept == 0 || add_cap(solid));
}

/* Fans the faces. */
static bool make_mesh(const Solid *solid, Mesh *mesh, Err *err) {
    size_t triangle_count = 0;
    for (int f = 0; f < solid->face_count; f++)
        triangle_count += (size_t)solid->faces[f].count - 2;
    if (!mesh_allocate(mesh, "planes", (size_t)solid->vertex_count, triangle_count, err))
        return false;
    for (int v = 0; v < solid->vertex_count; v++)
        dvec_to_float(mesh->vertices[v], solid->vertices[v]);
    uint32_t(*out)[3] = mesh->triangles;
    for (int f = 0; f < solid->face_count; f++) {
        const int *loop = solid->faces[f].vertices;
        for (int i = 2; i < solid->faces[f].count; i++, out++) {
            (*out)[0] = (uint32_t)loop[0];
            (*out)[1] = (uint32_t)loop[i - 1];
            (*out)[2] = (uint32_t)loop[i];
        }
    }
    if (!mesh_finish(mesh, "planes", err))
        return false;
    if (!mesh_check_closed(mesh, "planes", err)) {
        mesh_free(mesh);
        return false;
    }
    return true;
}

static bool read_planes(const float (*points)[3], const float (*normals)[3], int count, Plane *planes,
                        Err *err) {
    for (int i = 0; i < count; i++) {
        dvec_from_float(planes[i].point, points[i]);
        dvec_from_float(planes[i].normal, normals[i]);
        double length = dvec_normalize(planes[i].normal);
        if (!isfinite(length) || !(length > 0.0) || !isfinite(dvec_length(planes[i].point)))
            return err_set(err, ERR_INPUT,
                           "planes: plane %d has point (%g, %g, %g) and normal (%g, %g, %g); finite numbers "
                           "and a normal "
                           "other than 0 are allowed",
                           i + 1, (double)points[i][0], (double)points[i][1], (double)points[i][2],
                           (double)normals[i][0], (double)normals[i][1], (double)normals[i][2]);
    }
    return true;
}

static bool build(const Plane *planes, int count, Mesh *mesh, Err *err) {
    double min[3] = {INFINITY, INFINITY, INFINITY}, max[3] = {-INFINITY, -INFINITY, -INFINITY}, centre[3],
           size[3];
    for (int i = 0; i < count; i++) {
        for (int k = 0; k < 3; k++) {
            min[k] = fmin(min[k], planes[i].point[k]);
            max[k] = fmax(max[k], planes[i].point[k]);
        }
    }
    dvec_sub(size, max, min);
    dvec_add_scaled(centre, min, 0.5, size);
    double extent = dvec_length(size), half = box_factor * extent;
    if (!(extent > 0.0))
        return err_set(err, ERR_INPUT,
                       "planes: all planes pass through one point: no solid, or one without bounds");
    Solid solid = {.tolerance = tolerance_factor * extent};
    bool ok = start_box(&solid, centre, half);
    for (int i = 0; i < count && ok; i++)
        ok = cut_solid(&solid, &planes[i]);
    bool unbounded = false;
    for (int f = 0; f < solid.face_count && ok; f++)
        for (int i = 0; i < solid.faces[f].count; i++)
            for (int k = 0; k < 3; k++)
                unbounded = unbounded || fabs(solid.vertices[solid.faces[f].vertices[i]][k] - centre[k]) >
                                             half * (1.0 - 1e-6);
    if (!ok)
        ok = err_set(err, ERR_INPUT, "planes: no memory for a solid of %d planes", count);
    else if (solid.face_count == 0)
        ok = err_set(err, ERR_INPUT, "planes: empty: no point is below all %d planes", count);
    else if (unbounded)
        ok = err_set(err, ERR_INPUT,
                     "planes: unbounded, or %g times larger than the extent of the points (%g m)", box_factor,
                     extent);
    else
        ok = make_mesh(&solid, mesh, err);
    free_solid(&solid);
    return ok;
}

bool mesh_make_planes(const float (*points)[3], const float (*normals)[3], int count, Mesh *mesh, Err *err) {
    memset(mesh, 0, sizeof *mesh);
    if (count < 4 || count > MAX_PLANES)
        return err_set(err, ERR_INPUT, "planes: %d planes; 4..%d are allowed", count, (int)MAX_PLANES);
    Plane *planes = malloc((size_t)count * sizeof *planes);
    if (!planes)
        return err_set(err, ERR_INPUT, "planes: no memory for %d planes", count);
    bool ok = read_planes(points, normals, count, planes, err) && build(planes, count, mesh, err);
    free(planes);
    return ok;
}
