/* Prepares meshes for drawing: corner normals that are smooth across shallow edges and sharp across steep
 * ones, and the steep edges as lines. Positions are taken as they come: vertices that should shade as one
 * must be one. */
#include "mesh_store.h"

#include <math.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#define CREASE_COSINE 0.819f /* of 35 degrees */

typedef struct MeshVertex {
    float position[3], normal[3];
    uint8_t color[4];
} MeshVertex;

/* An edge of one triangle, lower vertex first. */
typedef struct MeshEdge {
    uint32_t from, to, triangle;
} MeshEdge;

/* Working memory of one mesh. */
typedef struct MeshWork {
    float (*area_normals)[3];  /* of triangles; length: twice the area */
    uint32_t *starts, *around; /* triangles around vertex v: around[starts[v]] .. around[starts[v + 1] - 1] */
    MeshVertex *corners;
    MeshEdge *edges;
    float (*lines)[3];
} MeshWork;

static bool check_mesh(const GfxMeshDef *def, int number, Err *err) {
    if (!def->vertices || !def->triangles || def->triangle_count == 0 || def->triangle_count > 100000000)
        return err_set(err, ERR_INPUT, "mesh %d: %u triangles; 1 to 100000000 are possible", number,
                       def->triangles ? def->triangle_count : 0);
    if ((unsigned)def->material.kind >= GFX_MATERIAL_COUNT)
        return err_set(err, ERR_INPUT, "mesh %d: unknown material %d", number, (int)def->material.kind);
    for (uint32_t i = 0; i < def->vertex_count; i++)
        for (int k = 0; k < 3; k++)
            if (!isfinite(def->vertices[i][k]))
                return err_set(err, ERR_INPUT, "mesh %d: vertex %u has coordinate %c = %g", number, i,
                               "xyz"[k], (double)def -> vertices[i][k]);
    for (uint32_t t = 0; t < def->triangle_count; t++)
        for (int k = 0; k < 3; k++)
            if (def->triangles[t][k] >= def->vertex_count)
                return err_set(err, ERR_INPUT, "mesh %d: triangle %u has vertex %u; there are %u", number, t,
                               def->triangles[t][k], def->vertex_count);
    return true;
}

static void find_normals(const GfxMeshDef *def, MeshWork *work) {
    for (uint32_t t = 0; t < def->triangle_count; t++) {
        const float *a = def->vertices[def->triangles[t][0]], *b = def->vertices[def->triangles[t][1]],
                    *c = def->vertices[def->triangles[t][2]];
        float u[3], v[3], *n = work->area_normals[t];
        for (int k = 0; k < 3; k++) {
            u[k] = b[k] - a[k];
            v[k] = c[k] - a[k];
        }
        n[0] = u[1] * v[2] - u[2] * v[1];
        n[1] = u[2] * v[0] - u[0] * v[2];
        n[2] = u[0] * v[1] - u[1] * v[0];
    }
}

static void find_triangles_around(const GfxMeshDef *def, MeshWork *work) {
    for (uint32_t t = 0; t < def->triangle_count; t++)
        for (int k = 0; k < 3; k++)
            work->starts[def->triangles[t][k] + 1]++;
    for (uint32_t v = 0; v < def->vertex_count; v++)
        work->starts[v + 1] += work->starts[v];
    for (uint32_t t = 0; t < def->triangle_count; t++)
        for (int k = 0; k < 3; k++)
            work->around[work->starts[def->triangles[t][k]]++] = t;
    /* Filling moved every start to its end. */
    memmove(work->starts + 1, work->starts, def->vertex_count * sizeof *work->starts);
    work->starts[0] = 0;
}

static float dot(const float a[3], const float b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static bool is_shallow(const float a[3], const float b[3]) {
    return dot(a, b) > CREASE_COSINE * sqrtf(dot(a, a) * dot(b, b));
}

static void fill_corners(const GfxMeshDef *def, MeshWork *work) {
    for (uint32_t t = 0; t < def->triangle_count; t++)
        for (int k = 0; k < 3; k++) {
            uint32_t v = def->triangles[t][k];
            MeshVertex *corner = &work->corners[3 * (size_t)t + (size_t)k];
            const float *own = work->area_normals[t];
            float sum[3] = {own[0], own[1], own[2]};
            for (uint32_t i = work->starts[v]; i < work->starts[v + 1]; i++) {
                const float *other = work->area_normals[work->around[i]];
                for (int axis = 0; work->around[i] != t && is_shallow(own, other) && axis < 3; axis++)
                    sum[axis] += other[axis];
            }
            float length = sqrtf(dot(sum, sum));
            for (int axis = 0; axis < 3; axis++) {
                corner->position[axis] = def->vertices[v][axis];
                corner->normal[axis] = length > 0.0f ? sum[axis] / length : 0.0f;
            }
            if (def->triangle_colors)
                memcpy(corner->color, def->triangle_colors[t], 3);
        }
}

static int compare_edges(const void *a, const void *b) {
    const MeshEdge *p = a, *q = b;
    if (p->from != q->from)
        return p->from < q->from ? -1 : 1;
    if (p->to != q->to)
        return p->to < q->to ? -1 : 1;
    return (p->triangle > q->triangle) - (p->triangle < q->triangle);
}

/* Lines along edges that do not join two triangles at a shallow angle. Returns the number of their ends. */
static size_t fill_lines(const GfxMeshDef *def, MeshWork *work) {
    size_t count = 0, ends = 0;
    for (uint32_t t = 0; t < def->triangle_count; t++)
        for (int k = 0; k < 3; k++) {
            uint32_t a = def->triangles[t][k], b = def->triangles[t][(k + 1) % 3];
            work->edges[count++] = (MeshEdge){a < b ? a : b, a < b ? b : a, t};
        }
    qsort(work->edges, count, sizeof *work->edges, compare_edges);
    for (size_t i = 0, next; i < count; i = next) {
        const MeshEdge *edge = &work->edges[i];
        for (next = i + 1;
             next < count && work->edges[next].from == edge->from && work->edges[next].to == edge->to;)
            next++;
        if (next == i + 2 &&
            is_shallow(work->area_normals[edge->triangle], work->area_normals[edge[1].triangle]))
            continue;
        memcpy(work->lines[ends++], def->vertices[edge->from], sizeof(float[3]));
        memcpy(work->lines[ends++], def->vertices[edge->to], sizeof(float[3]));
    }
    return ends;
}

static void upload_triangles(StoredMesh *mesh, const Gl *gl, const MeshWork *work, uint32_t triangle_count) {
    mesh->vertex_count = (GLsizei)(3 * triangle_count);
    gl->GenVertexArrays(1, &mesh->vertex_array);
    gl->GenBuffers(1, &mesh->buffer);
    gl->BindVertexArray(mesh->vertex_array);
    gl->BindBuffer(GL_ARRAY_BUFFER, mesh->buffer);
    gl->BufferData(GL_ARRAY_BUFFER, (GLsizeiptr)((size_t)mesh->vertex_count * sizeof(MeshVertex)),
                   work->corners, GL_STATIC_DRAW);
    for (GLuint i = 0; i < 3; i++)
        gl->EnableVertexAttribArray(i);
    gl->VertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, sizeof(MeshVertex),
                            (void *)offsetof(MeshVertex, position));
    gl->VertexAttribPointer(1, 3, GL_FLOAT, GL_FALSE, sizeof(MeshVertex),
                            (void *)offsetof(MeshVertex, normal));
    gl->VertexAttribPointer(2, 3, GL_UNSIGNED_BYTE, GL_TRUE, sizeof(MeshVertex),
                            (void *)offsetof(MeshVertex, color));
}

static void upload_lines(StoredMesh *mesh, const Gl *gl, const MeshWork *work, size_t ends) {
    mesh->edge_vertex_count = (GLsizei)ends;
    gl->GenVertexArrays(1, &mesh->edge_vertex_array);
    gl->GenBuffers(1, &mesh->edge_buffer);
    gl->BindVertexArray(mesh->edge_vertex_array);
    gl->BindBuffer(GL_ARRAY_BUFFER, mesh->edge_buffer);
    gl->BufferData(GL_ARRAY_BUFFER, (GLsizeiptr)(ends * sizeof(float[3])), work->lines, GL_STATIC_DRAW);
    gl->EnableVertexAttribArray(0);
    gl->VertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, 0, NULL);
}

static void find_bounds(const GfxMeshDef *def, float bounds[2][3]) {
    for (int k = 0; k < 3; k++) {
        bounds[0][k] = INFINITY;
        bounds[1][k] = -INFINITY;
    }
    for (uint32_t i = 0; i < def->vertex_count; i++)
        for (int k = 0; k < 3; k++) {
            bounds[0][k] = fminf(bounds[0][k], def->vertices[i][k]);
            bounds[1][k] = fmaxf(bounds[1][k], def->vertices[i][k]);
        }
}

static bool reserve_work(MeshWork *work, const GfxMeshDef *def, Err *err) {
    size_t triangles = def->triangle_count;
    work->area_normals = malloc(triangles * sizeof *work->area_normals);
    work->starts = calloc((size_t)def->vertex_count + 1, sizeof *work->starts);
    work->around = malloc(3 * triangles * sizeof *work->around);
    work->corners = calloc(3 * triangles, sizeof *work->corners);
    work->edges = malloc(3 * triangles * sizeof *work->edges);
    work->lines = malloc(6 * triangles * sizeof *work->lines);
    if (work->area_normals && work->starts && work->around && work->corners && work->edges && work->lines)
        return true;
    return err_set(err, ERR_INPUT, "no memory for a mesh of %u triangles", def->triangle_count);
}

static void free_work(MeshWork *work) {
    free(work->area_normals);
    free(work->starts);
    free(work->around);
    free(work->corners);
    free(work->edges);
    free(work->lines);
}

int mesh_store_add(MeshStore *store, const Gl *gl, const GfxMeshDef *def, Err *err) {
    MeshWork work = {0};
    if (!check_mesh(def, store->count, err))
        return -1;
    StoredMesh *grown = realloc(store->meshes, (size_t)(store->count + 1) * sizeof *grown);
    if (!grown) {
        err_set(err, ERR_INPUT, "no memory for mesh %d", store->count);
        return -1;
    }
    store->meshes = grown;
    bool ok = reserve_work(&work, def, err);
    if (ok) {
        StoredMesh *mesh = &store->meshes[store->count];
        *mesh = (StoredMesh){.material = def->material, .own_colors = def->triangle_colors != NULL};
        find_bounds(def, mesh->bounds);
        find_normals(def, &work);
        find_triangles_around(def, &work);
        fill_corners(def, &work);
        upload_triangles(mesh, gl, &work, def->triangle_count);
        if (def->material.kind == GFX_MATERIAL_TANK)
            upload_lines(mesh, gl, &work, fill_lines(def, &work));
        store->count++;
    }
    free_work(&work);
    return ok ? store->count - 1 : -1;
}

void mesh_store_free(MeshStore *store, const Gl *gl) {
    for (int i = 0; i < store->count; i++) {
        StoredMesh *mesh = &store->meshes[i];
        gl->DeleteVertexArrays(1, &mesh->vertex_array);
        gl->DeleteBuffers(1, &mesh->buffer);
        gl->DeleteVertexArrays(1, &mesh->edge_vertex_array);
        gl->DeleteBuffers(1, &mesh->edge_buffer);
    }
    free(store->meshes);
    *store = (MeshStore){0};
}
