/* Meshes as the GPU holds them: handed over once, with normals and the lines of sharp edges made here. */
#ifndef SKIFF_MESH_STORE_H
#define SKIFF_MESH_STORE_H

#include "gfx.h"
#include "gl.h"

typedef struct StoredMesh {
    GfxMaterial material;
    bool own_colors;
    float bounds[2][3];                    /* least and greatest coordinates, own frame */
    GLuint vertex_array, buffer;           /* triangles */
    GLuint edge_vertex_array, edge_buffer; /* lines: edges between faces at an angle */
    GLsizei vertex_count, edge_vertex_count;
} StoredMesh;

typedef struct MeshStore {
    StoredMesh *meshes;
    int count;
} MeshStore;

/* Returns the mesh's index, or -1; see gfx_add_mesh. */
int mesh_store_add(MeshStore *store, const Gl *gl, const GfxMeshDef *def, Err *err);
void mesh_store_free(MeshStore *store, const Gl *gl);

#endif
