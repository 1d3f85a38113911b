/* A made-up sea for tests and benchmarks of the renderer: a round window of jittered particles under swell
 * and the wake of a boat, foam, droplets at the bow, fading at the edge, and the boat's hull. Deterministic.
 * Header only. */
#ifndef SKIFF_TESTS_SEA_H
#define SKIFF_TESTS_SEA_H

#include "render/gfx.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

typedef struct SeaDef {
    float radius, depth; /* of the window, m */
    float spacing;       /* m */
    float boat_length;   /* m */
} SeaDef;

enum { SEA_EDGE_SIZE = 65, SEA_SECTIONS = 24 };

typedef struct Sea {
    GfxScene scene; /* particles, ocean, sun; the caller sets camera and instances */
    float (*position)[4], (*velocity)[4];
    float *fade, *foam, *field;
    uint64_t *id;
    float edge[SEA_EDGE_SIZE * SEA_EDGE_SIZE], wake[SEA_EDGE_SIZE * SEA_EDGE_SIZE];
    float (*vertices)[3]; /* the boat */
    uint32_t (*triangles)[3];
    uint32_t vertex_count, triangle_count;
    GfxMaterial paint;
} Sea;

static inline float sea_random(uint32_t *state) {
    *state = *state * 1664525u + 1013904223u;
    return (float)(*state >> 8) * 0x1p-24f;
}

static inline float sea_smooth(float x) {
    x = x < 0.0f ? 0.0f : x > 1.0f ? 1.0f : x;
    return x * x * (3.0f - 2.0f * x);
}

/* The surface for a boat of length 1.3 that heads to +x with its bow at 0.62. */
static inline float sea_height_unit(float x, float z) {
    float h = 0.022f * sinf(2.7f * x + 1.2f * z) + 0.018f * sinf(-2.1f * x + 3.6f * z + 1.0f) +
              0.006f * sinf(6.1f * x - 5.3f * z + 2.0f);
    float aft = 0.62f - x, side = fabsf(z), a = aft > 0.0f ? aft : 0.0f;
    if (aft > -0.15f) {
        float c = side - 0.12f - 0.36f * a;
        h += 0.11f * expf(-c * c / (0.010f + 0.012f * a)) * expf(-0.75f * a);
        if (aft > 1.1f)
            h += 0.035f * sinf(7.5f * aft - 2.0f * side) * expf(-side * side / (0.02f + 0.08f * aft * aft)) *
                 expf(-0.5f * aft);
    }
    return h + 0.08f * expf(-((x - 0.68f) * (x - 0.68f) / 0.010f + z * z / 0.03f));
}

static inline float sea_foam_unit(float x, float z) {
    float aft = 0.62f - x, side = fabsf(z), a = aft > 0.0f ? aft : 0.0f;
    if (aft < -0.1f)
        return 0.0f;
    float wide = 0.040f + 0.050f * a, c = (side - 0.15f - 0.36f * a) / wide, behind = aft - 1.28f;
    float foam = 0.9f * expf(-c * c) * expf(-0.55f * a);
    if (behind > 0.0f) {
        float e = z / (0.17f + 0.07f * behind);
        foam += expf(-e * e) * expf(-0.8f * behind);
    }
    if (aft < 1.3f) {
        float hull = (side - 0.22f) / 0.05f;
        foam += 0.35f * expf(-hull * hull);
    }
    return foam;
}

/* Half the beam at height 0 of the unit boat; < 0 beyond its ends. */
static inline float sea_half_beam(float x) {
    float s = (x + 0.62f) / 1.30f;
    if (s < 0.0f || s > 1.0f)
        return -1.0f;
    return 0.20f * (s < 0.55f ? 1.0f : sqrtf(fmaxf(0.0f, 1.0f - powf((s - 0.55f) / 0.45f, 2.2f))));
}

static inline float sea_height(const SeaDef *def, float x, float z) {
    float scale = def->boat_length / 1.3f, r = sqrtf(x * x + z * z) / def->radius;
    return scale * sea_height_unit(x / scale, z / scale) * (1.0f - sea_smooth((r - 0.5f) / 0.4f));
}

static inline void sea_add(Sea *sea, float x, float y, float z, float foam, float speed) {
    uint32_t i = sea->scene.particles.count++;
    sea->position[i][0] = x;
    sea->position[i][1] = y;
    sea->position[i][2] = z;
    sea->velocity[i][0] = speed;
    sea->velocity[i][1] = 0.5f * speed;
    sea->foam[i] = foam;
    sea->field[i] = speed;
    sea->id[i] = i;
}

static inline void sea_fill(Sea *sea, const SeaDef *def) {
    float d = def->spacing * 0.928f, R = def->radius,
          scale = def->boat_length / 1.3f; /* 1 / (0.8 d^3) a m^3 */
    uint32_t state = 12345;
    for (float y = -def->depth; y < 0.6f; y += d)
        for (float z = -R; z <= R; z += d)
            for (float x = -R; x <= R; x += d) {
                float px = x + (sea_random(&state) - 0.5f) * 0.6f * d,
                      py = y + (sea_random(&state) - 0.5f) * 0.6f * d,
                      pz = z + (sea_random(&state) - 0.5f) * 0.6f * d;
                float r = sqrtf(px * px + pz * pz), h = sea_height(def, px, pz);
                if (r > R || py > h - 0.5f * d)
                    continue;
                if (fabsf(pz) < scale * sea_half_beam(px / scale) + 0.5f * d && py > -0.11f * scale)
                    continue;
                float foam = py > h - 1.6f * d ? sea_foam_unit(px / scale, pz / scale) : 0.0f;
                uint32_t i = sea->scene.particles.count;
                sea->fade[i] = sea_smooth((R - r) / 0.3f);
                sea_add(sea, px, py, pz, foam, 3.0f * foam * (1.0f - 0.6f * (h - py)));
            }
    /* Thrown up at both sides of the bow: a sheet near the hull, drops farther away. */
    for (int k = 0; k < 420; k++) {
        float t = sea_random(&state), side = sea_random(&state) < 0.5f ? -1.0f : 1.0f,
              up = sea_random(&state);
        float far = k % 3 == 0 ? 1.0f + 2.0f * sea_random(&state) : 1.0f;
        float x = (0.70f - 0.60f * t) * scale, spread = 0.12f * (sea_random(&state) - 0.3f);
        float z = side * (0.08f + 0.30f * t + spread) * far * scale;
        float y = sea_height(def, x, z) + scale * (0.01f + 0.16f * up * far * (1.0f - t));
        sea->fade[sea->scene.particles.count] = 1.0f;
        sea_add(sea, x, y, z, 1.0f, 2.5f);
    }
}

static inline void sea_quad(Sea *sea, uint32_t a, uint32_t b, uint32_t c, uint32_t d) {
    uint32_t rows[2][3] = {{a, b, c}, {a, c, d}};
    memcpy(sea->triangles + sea->triangle_count, rows, sizeof rows);
    sea->triangle_count += 2;
}

static inline uint32_t sea_vertex(Sea *sea, float scale, float x, float y, float z) {
    float *v = sea->vertices[sea->vertex_count];
    v[0] = x * scale;
    v[1] = y * scale;
    v[2] = z * scale;
    return sea->vertex_count++;
}

/* Sections of hull and deck from stern to bow, and a cabin. */
static inline void sea_build_boat(Sea *sea, float scale) {
    enum { RING = 6 };
    sea->vertices = malloc(1000 * sizeof *sea->vertices);
    sea->triangles = malloc(2000 * sizeof *sea->triangles);
    for (int i = 0; i <= SEA_SECTIONS; i++) {
        float s = (float)i / SEA_SECTIONS, x = -0.62f + 1.30f * s, w = fmaxf(sea_half_beam(x), 0.004f);
        float top = 0.16f + 0.10f * s * s * s, keel = fmaxf(0.0f, s - 0.70f) / 0.30f;
        float bottom = -0.12f + 0.16f * keel * keel;
        float ring[RING][2] = {{-w, top},
                               {-0.88f * w, 0.02f},
                               {-0.45f * w, 0.6f * bottom},
                               {0.45f * w, 0.6f * bottom},
                               {0.88f * w, 0.02f},
                               {w, top}};
        for (int j = 0; j < RING; j++)
            sea_vertex(sea, scale, x, ring[j][1] + (j == 2 || j == 3 ? 0.3f * bottom : 0.0f), ring[j][0]);
    }
    for (uint32_t i = 0; i < SEA_SECTIONS; i++)
        for (uint32_t j = 0; j < RING; j++) {
            uint32_t a = i * RING + j, b = i * RING + (j + 1) % RING;
            sea_quad(sea, a, a + RING, b + RING, b);
        }
    sea_quad(sea, 0, 1, 4, 5);
    sea_quad(sea, 1, 2, 3, 4);
    float base = 0.155f, roof = 0.35f, from = -0.40f, to = 0.10f, half = 0.125f;
    uint32_t c[8];
    for (int k = 0; k < 8; k++) {
        float x = (k & 1) ? (k & 4 ? to - 0.07f : to) : from;
        c[k] = sea_vertex(sea, scale, x, k & 4 ? roof : base, (k & 2) ? half : -half);
    }
    sea_quad(sea, c[0], c[4], c[5], c[1]);
    sea_quad(sea, c[1], c[5], c[7], c[3]);
    sea_quad(sea, c[3], c[7], c[6], c[2]);
    sea_quad(sea, c[2], c[6], c[4], c[0]);
    sea_quad(sea, c[4], c[6], c[7], c[5]);
    sea->paint = gfx_material_default(GFX_MATERIAL_HULL);
    sea->paint.waterline = 0.035f * scale;
    sea->paint.cabin_base = 0.17f * scale;
    sea->paint.cabin_top = roof * scale;
}

/* To be freed with sea_free. */
static inline Sea *sea_create(const SeaDef *def) {
    Sea *sea = calloc(1, sizeof *sea);
    float d = def->spacing * 0.928f;
    size_t capacity =
        (size_t)(4.0f * (def->radius / d + 1.0f) * (def->radius / d + 1.0f) * (def->depth + 0.8f) / d) + 1000;
    sea->position = calloc(capacity, sizeof *sea->position);
    sea->velocity = calloc(capacity, sizeof *sea->velocity);
    sea->fade = calloc(capacity, sizeof *sea->fade);
    sea->foam = calloc(capacity, sizeof *sea->foam);
    sea->field = calloc(capacity, sizeof *sea->field);
    sea->id = calloc(capacity, sizeof *sea->id);
    sea->scene = gfx_scene_default();
    sea_fill(sea, def);
    sea_build_boat(sea, def->boat_length / 1.3f);
    GfxParticles *particles = &sea->scene.particles;
    particles->spacing = def->spacing;
    particles->position = (const float(*)[4])sea->position;
    particles->velocity = (const float(*)[4])sea->velocity;
    particles->fade = sea->fade;
    particles->foam = sea->foam;
    particles->field = sea->field;
    particles->id = sea->id;
    GfxOcean *ocean = &sea->scene.ocean;
    ocean->enabled = true;
    ocean->edge_distance = sea->edge;
    ocean->foam = sea->wake;
    for (int k = 0; k < 2; k++) {
        ocean->edge_size[k] = SEA_EDGE_SIZE;
        ocean->edge_min[k] = -def->radius;
        ocean->edge_max[k] = def->radius;
        ocean->foam_size[k] = SEA_EDGE_SIZE;
        ocean->foam_min[k] = -2.0f * def->radius;
        ocean->foam_max[k] = 2.0f * def->radius;
    }
    for (int j = 0; j < SEA_EDGE_SIZE; j++)
        for (int i = 0; i < SEA_EDGE_SIZE; i++) {
            float x = def->radius * (2.0f * (float)i / (SEA_EDGE_SIZE - 1) - 1.0f);
            float z = def->radius * (2.0f * (float)j / (SEA_EDGE_SIZE - 1) - 1.0f);
            sea->edge[j * SEA_EDGE_SIZE + i] = def->radius - sqrtf(x * x + z * z);
            float unit = 2.0f * 1.3f / def->boat_length;
            sea->wake[j * SEA_EDGE_SIZE + i] = 2.5f * sea_foam_unit(unit * x, unit * z);
        }
    sea->scene.field = (GfxField){0.0f, 3.0f, "speed", "m/s"};
    sea->scene.time = 1.3;
    return sea;
}

static inline GfxMeshDef sea_boat(const Sea *sea) {
    return (GfxMeshDef){(const float(*)[3])sea->vertices,
                        sea->vertex_count,
                        (const uint32_t(*)[3])sea->triangles,
                        sea->triangle_count,
                        NULL,
                        sea->paint};
}

static inline void sea_free(Sea *sea) {
    free(sea->position);
    free(sea->velocity);
    free(sea->fade);
    free(sea->foam);
    free(sea->field);
    free(sea->id);
    free(sea->vertices);
    free(sea->triangles);
    free(sea);
}

#endif
