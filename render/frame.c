/* ONE IMAGE, TOP TO BOTTOM.
 *
 * The list below is all that happens between the caller's arrays and the caller's bytes. A pass takes what
 * earlier ones left in the frame's images; none knows another. The rest of this file turns camera, ocean and
 * time into the numbers that all shaders share. To add a pass: a file with a PassType, a declaration in
 * pass.h, a row here. */
#include "frame.h"

#include "shader.h"
#include "tables.h"

#include <cglm/cglm.h>

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

static const PassType *const passes_in_order[] = {
    &surface_pass,    /* which particles are worth drawing            CPU */
    &sky_pass,        /* the sky, once */
    &backdrop_pass,   /* particles: what is behind all */
    &mesh_pass,       /* boats, walls, ground */
    &reflection_pass, /* water: the same, mirrored */
    &depth_pass,      /* water: depth of the particles                CPU, 1/2 size */
    &filter_pass,     /* water: smoothed                              CPU, 1/2 size */
    &normal_pass,     /* water: normals of it                         1/2 size */
    &thickness_pass,  /* water: how much of it, and foam              1/4 size */
    &composite_pass,  /* water: surface, ocean, reflection, refraction, foam */
    &spray_pass,      /* water: droplets */
    &read_pass,       /* back to memory */
    &sphere_pass,     /* particles: spheres, then those that fade     CPU */
    &fxaa_pass,       /* smooth edges                                 CPU */
    &average_pass,    /* as large as is wanted                        CPU */
    &legend_pass,     /* particles: what the colours mean             CPU */
};
enum { COUNT = sizeof passes_in_order / sizeof passes_in_order[0] };
_Static_assert((int)COUNT <= (int)FRAME_MAX_PASSES, "GfxStats and skip_passes have room for 32 passes");

/* Radius of the drawn sphere in spacings, so that one layer of particles closes. Over an ocean spheres are
 * large, as it is smooth, and lowered, so that the surface lies half a spacing above the uppermost centres.
 * In a tank they would stick out through the walls. */
#define SPHERE_IN_OCEAN 1.0f
#define SPHERE_IN_TANK  0.8f

/* Layers of ripples: length of a tile in m, slope, direction in rad from +x, speed of its waves in m/s. Long
 * waves run faster; directions differ so that no two tiles coincide. */
static const struct {
    float tile, slope, direction, speed;
} ripple_layers[RIPPLE_LAYERS] = {
    {19.0f, 0.09f, 0.45f, 1.9f},
    {6.7f, 0.12f, 0.10f, 1.15f},
    {2.9f, 0.14f, 0.85f, 0.70f},
    {1.13f, 0.15f, 0.30f, 0.42f},
};

int frame_pass_count(void) {
    return COUNT;
}

const PassType *frame_pass_type(int index) {
    return passes_in_order[index];
}

/* ---- What all shaders share ---- */

static void fill_camera(Frame *frame) {
    const GfxCamera *camera = &frame->scene->camera;
    FrameBlock *block = &frame->block;
    mat4 view, inverse, projection;
    vec3 eye, target, up;
    glm_vec3_copy((float *)camera->eye, eye);
    glm_vec3_copy((float *)camera->target, target);
    glm_vec3_copy((float *)camera->up, up);
    float half = tanf(0.5f * glm_rad(camera->fov_deg)), aspect = (float)frame->width / (float)frame->height;
    glm_lookat(eye, target, up, view);
    glm_mat4_inv(view, inverse);
    glm_perspective(glm_rad(camera->fov_deg), aspect, camera->near_plane, camera->far_plane, projection);
    memcpy(block->view, view, sizeof block->view);
    memcpy(block->projection, projection, sizeof block->projection);
    memcpy(block->camera, inverse, sizeof block->camera);
    memcpy(block->eye, eye, sizeof eye);
    block->eye[3] = frame->scene->ocean.level;
    block->lens[0] = half * aspect;
    block->lens[1] = half;
    block->lens[2] = camera->near_plane;
    block->lens[3] = camera->far_plane;
    block->sphere[2] = (float)frame->height / (2.0f * half);
    float distance = glm_vec3_distance(eye, target);
    block->sun[3] = distance > 10.0f ? 4.0f * distance : 40.0f;
}

/* { w, h, 1 / w, 1 / h } */
static void fill_size(float out[4], int width, int height) {
    out[0] = (float)width;
    out[1] = (float)height;
    out[2] = 1.0f / (float)width;
    out[3] = 1.0f / (float)height;
}

/* Texture coordinates so that sample 0 is at the centre of the first texel, the last at that of the last. */
static void fill_box(const uint32_t size[2], const float min[2], const float max[2], float box[4]) {
    for (int k = 0; k < 2; k++) {
        float n = (float)size[k];
        box[2 + k] = (n - 1.0f) / (n * (max[k] - min[k]));
        box[k] = 0.5f / n - min[k] * box[2 + k];
    }
}

static void fill_edge(Frame *frame) {
    static const float beyond[4] = {-1.0f, -1.0f, -1.0f, -1.0f};
    const GfxOcean *ocean = &frame->scene->ocean;
    FrameBlock *block = &frame->block;
    memcpy(block->edge_box, (const float[4]){0.0f, 0.0f, 1.0f, 1.0f}, sizeof block->edge_box);
    if (ocean->enabled)
        fill_box(ocean->edge_size, ocean->edge_min, ocean->edge_max, block->edge_box);
    memcpy(block->edge, ocean->blend, sizeof ocean->blend);
    block->edge[2] = ocean->enabled ? 1.0f : 0.0f;
    block->edge[3] = frame->scene->ground && !ocean->enabled ? 1.0f : 0.0f;
    if (ocean->enabled)
        texture_update(frame->gl, &frame->edge_distance, TEXTURE_R32F, (int)ocean->edge_size[0],
                       (int)ocean->edge_size[1], ocean->edge_distance);
    else
        texture_update(frame->gl, &frame->edge_distance, TEXTURE_R32F, 2, 2, beyond);
}

static void fill_foam(Frame *frame) {
    static const float none[4] = {0.0f};
    const GfxOcean *ocean = &frame->scene->ocean;
    bool some = ocean->enabled && ocean->foam;
    if (some)
        fill_box(ocean->foam_size, ocean->foam_min, ocean->foam_max, frame->block.foam_box);
    texture_update(frame->gl, &frame->ocean_foam, TEXTURE_R32F, some ? (int)ocean->foam_size[0] : 2,
                   some ? (int)ocean->foam_size[1] : 2, some ? ocean->foam : none);
}

/* Offsets are reduced to one tile in double precision, so that they are exact far from the world's origin. */
static void fill_ripples(Frame *frame) {
    const GfxScene *scene = frame->scene;
    for (int i = 0; i < RIPPLE_LAYERS; i++) {
        double tile = (double)ripple_layers[i].tile, angle = (double)ripple_layers[i].direction;
        double c = cos(angle), s = sin(angle), x = scene->origin[0], z = scene->origin[2];
        double along = (c * x + s * z - (double)ripple_layers[i].speed * scene->time) / tile;
        double across = (c * z - s * x) / tile;
        float *layer = frame->block.ripple[i], *turn = frame->block.ripple_turn[i];
        layer[0] = (float)(along - floor(along));
        layer[1] = (float)(across - floor(across));
        layer[2] = ripple_layers[i].slope * scene->ocean.ripples;
        layer[3] = 1.0f / ripple_layers[i].tile;
        turn[0] = (float)c;
        turn[1] = (float)s;
        turn[2] = log2f(layer[3]);
    }
}

static void fill_block(Frame *frame) {
    const GfxScene *scene = frame->scene;
    FrameBlock *block = &frame->block;
    const double repeat = 40.0; /* m; all tiles and joints divide it */
    memset(block, 0, sizeof *block);
    fill_camera(frame);
    fill_size(block->size, frame->width, frame->height);
    fill_size(block->fluid_size, (frame->width + 1) / 2, (frame->height + 1) / 2);
    float length =
        sqrtf(scene->sun[0] * scene->sun[0] + scene->sun[1] * scene->sun[1] + scene->sun[2] * scene->sun[2]);
    for (int k = 0; k < 3; k++)
        block->sun[k] = scene->sun[k] / length;
    bool ocean = scene->ocean.enabled;
    float spacing = scene->particles.spacing, radius = (ocean ? SPHERE_IN_OCEAN : SPHERE_IN_TANK) * spacing;
    block->sphere[0] = radius;
    block->sphere[1] = ocean ? 1.0f - 0.5f * spacing / radius : 0.0f;
    block->sphere[3] = spacing;
    fill_edge(frame);
    fill_foam(frame);
    block->ground[0] = scene->ground_level;
    block->ground[1] = (float)fmod(scene->origin[0], repeat);
    block->ground[2] = (float)fmod(scene->origin[2], repeat);
    block->ground[3] = scene->ocean.ripples;
    fill_ripples(frame);
    block->field[0] = scene->field.min;
    block->field[1] = 1.0f / (scene->field.max - scene->field.min);
    const Gl *gl = frame->gl;
    gl->BindBuffer(GL_UNIFORM_BUFFER, frame->block_buffer);
    gl->BufferData(GL_UNIFORM_BUFFER, sizeof *block, block, GL_STREAM_DRAW);
    gl->BindBufferBase(GL_UNIFORM_BUFFER, SHADER_FRAME_BINDING, frame->block_buffer);
}

/* ---- Life ---- */

static bool create_tables(Frame *frame, Err *err) {
    static const float nothing[4] = {0.0f};
    uint8_t(*ripples)[4] = malloc((size_t)RIPPLE_MAP_EDGE * RIPPLE_MAP_EDGE * sizeof *ripples);
    if (!ripples)
        return err_set(err, ERR_GL, "no memory for the renderer's tables");
    tables_ripples(ripples);
    const Gl *gl = frame->gl;
    frame->ripples =
        texture_create(gl, TEXTURE_RGBA8, RIPPLE_MAP_EDGE, RIPPLE_MAP_EDGE, TEXTURE_REPEAT_MIPMAP, ripples);
    frame->edge_distance = texture_create(gl, TEXTURE_R32F, 2, 2, TEXTURE_LINEAR, nothing);
    frame->ocean_foam = texture_create(gl, TEXTURE_R32F, 2, 2, TEXTURE_LINEAR, nothing);
    free(ripples);
    return true;
}

static bool is_used(const Frame *frame, int index) {
    return passes_in_order[index]->looks & 1u << frame->def.look;
}

bool frame_create(Frame *frame, Pass *passes, Err *err) {
    const Gl *gl = frame->gl;
    size_t pixels = (size_t)frame->width * (size_t)frame->height;
    if (frame->def.look == GFX_LOOK_PARTICLES &&
        !(frame->mesh_depth = calloc(pixels, sizeof *frame->mesh_depth)))
        return err_set(err, ERR_GL, "no memory for an image of %d x %d", frame->width, frame->height);
    gl->GenVertexArrays(1, &frame->empty_vertex_array);
    gl->GenBuffers(1, &frame->block_buffer);
    gl->Enable(GL_PROGRAM_POINT_SIZE);
    if (!create_tables(frame, err) || !images_create(frame, err))
        return false;
    for (int i = 0; i < COUNT; i++)
        if (is_used(frame, i) && passes_in_order[i]->create &&
            !passes_in_order[i]->create(&passes[i], frame, err)) {
            err_prefix(err, "pass %s", passes_in_order[i]->name);
            return false;
        }
    return gl_check(gl, "set-up of the renderer", err);
}

static void destroy_points(const Gl *gl, PointBuffer *points) {
    gl->DeleteVertexArrays(1, &points->vertex_array);
    gl->DeleteBuffers(1, &points->buffer);
}

void frame_destroy(Frame *frame, Pass *passes) {
    const Gl *gl = frame->gl;
    for (int i = 0; i < COUNT; i++)
        for (int k = 0; k < PASS_PROGRAMS; k++) {
            if (passes[i].programs[k])
                gl->DeleteProgram(passes[i].programs[k]);
            gl->DeleteFramebuffers(1, &passes[i].framebuffers[k]);
        }
    images_destroy(frame);
    texture_destroy(gl, &frame->ripples);
    texture_destroy(gl, &frame->edge_distance);
    texture_destroy(gl, &frame->ocean_foam);
    destroy_points(gl, &frame->tiles);
    destroy_points(gl, &frame->rich);
    destroy_points(gl, &frame->droplets);
    mesh_store_free(&frame->meshes, gl);
    gl->DeleteVertexArrays(1, &frame->empty_vertex_array);
    gl->DeleteBuffers(1, &frame->block_buffer);
    surface_free(&frame->surface);
    buffer_free(&frame->body_discs.memory);
    buffer_free(&frame->fading_discs.memory);
    buffer_free(&frame->band_memory);
    free(frame->mesh_depth);
}

static double now_ms(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return 1e3 * (double)now.tv_sec + 1e-6 * (double)now.tv_nsec;
}

bool frame_draw(Frame *frame, Pass *passes, GfxStats *stats, Err *err) {
    fill_block(frame);
    for (int i = 0; i < COUNT; i++) {
        const PassType *type = passes_in_order[i];
        stats->pass_ms[i] = 0.0;
        stats->pass_ran[i] = false;
        if (!is_used(frame, i) || frame->def.skip_passes & 1u << i)
            continue;
        double start = now_ms();
        stats->pass_ran[i] = true;
        if (!type->draw(&passes[i], frame, err)) {
            err_prefix(err, "pass %s", type->name);
            return false;
        }
        if (frame->def.profile) {
            frame->gl->Finish();
            stats->pass_ms[i] = now_ms() - start;
        }
    }
    return gl_check(frame->gl, "drawing", err);
}
