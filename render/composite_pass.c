/* The picture of water: surface, ocean, reflections, what is below, foam, sky. All of it is in
 * shaders/water.glsl; each kind of tile takes as much of it as it needs. */
#include "pass.h"

#include "shader.h"
#include "tiles.h"

static bool create(Pass *pass, Frame *frame, Err *err) {
    static const char *const samplers[] = {
        "mesh_image", "sky_image",  "mesh_depth_image", "normal_image", "thickness_image",
        "edge_image", "ripple_map", "reflection_image", "ocean_foam",   NULL};
    static const char *const fragments[TILE_KIND_COUNT] = {[TILE_SKY] = "composite_sky.frag",
                                                           [TILE_OCEAN] = "composite_ocean.frag",
                                                           [TILE_WATER] = "composite_water.frag",
                                                           [TILE_MIXED] = "composite.frag"};
    const Gl *gl = frame->gl;
    for (int i = 0; i < TILE_KIND_COUNT; i++) {
        pass->programs[i] = shader_program(gl, "tile.vert", fragments[i], samplers, err);
        if (!pass->programs[i])
            return false;
    }
    gl->GenVertexArrays(1, &frame->tiles.vertex_array);
    gl->GenBuffers(1, &frame->tiles.buffer);
    gl->BindVertexArray(frame->tiles.vertex_array);
    gl->BindBuffer(GL_ARRAY_BUFFER, frame->tiles.buffer);
    gl->EnableVertexAttribArray(0);
    gl->VertexAttribPointer(0, 2, GL_FLOAT, GL_FALSE, 0, NULL);
    pass->framebuffers[0] = framebuffer_create(gl, &frame->images[IMAGE_COMPOSED], NULL, err);
    return pass->framebuffers[0] != 0;
}

static void draw_tiles(const Pass *pass, Frame *frame, const TileList *list) {
    const Gl *gl = frame->gl;
    int last = TILE_KIND_COUNT - 1;
    frame->tiles.count = list->first[last] + list->count[last];
    gl->BindVertexArray(frame->tiles.vertex_array);
    gl->BindBuffer(GL_ARRAY_BUFFER, frame->tiles.buffer);
    gl->BufferData(GL_ARRAY_BUFFER, (GLsizeiptr)((size_t)frame->tiles.count * sizeof *list->corners),
                   list->corners, GL_STREAM_DRAW);
    gl->Disable(GL_BLEND);
    gl->Disable(GL_DEPTH_TEST);
    gl->DepthMask(GL_FALSE);
    for (int i = 0; i < TILE_KIND_COUNT; i++) {
        gl->UseProgram(pass->programs[i]);
        gl->DrawArrays(GL_TRIANGLES, list->first[i], list->count[i]);
    }
}

static bool draw(Pass *pass, Frame *frame, Err *err) {
    const Texture *const inputs[] = {&frame->images[IMAGE_MESH],
                                     &frame->images[IMAGE_SKY],
                                     &frame->images[IMAGE_MESH_DEPTH],
                                     &frame->images[IMAGE_NORMAL],
                                     &frame->images[IMAGE_THICKNESS],
                                     &frame->edge_distance,
                                     &frame->ripples,
                                     &frame->images[IMAGE_REFLECTION],
                                     &frame->ocean_foam};
    TileList list;
    if (!tiles_sort(frame, &list, err))
        return false;
    framebuffer_bind(frame->gl, pass->framebuffers[0], &frame->images[IMAGE_COMPOSED]);
    for (int unit = 0; unit < (int)(sizeof inputs / sizeof inputs[0]); unit++)
        texture_bind(frame->gl, unit, inputs[unit]);
    draw_tiles(pass, frame, &list);
    return true;
}

const PassType composite_pass = {"composite", PASS_IN_WATER, IMAGE_COMPOSED, create, draw};
