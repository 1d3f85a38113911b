/* What the files of scene tables write their rows with: scene_table.c, scene_render.c,
 * scene_sea.c. */
#ifndef SKIFF_APP_SCENE_ROWS_H
#define SKIFF_APP_SCENE_ROWS_H

#include "scene_table.h"

#include <math.h>

#define COUNT(table) ((int)(sizeof(table) / sizeof *(table)))
#define COORDINATE   .min = -1e5, .max = 1e5, .unit = "m"
#define LENGTH       .min = 1e-4, .max = 1e5, .unit = "m"
#define SPEED        .min = -1e4, .max = 1e4, .unit = "m/s"
#define DURATION     .min = 0, .max = 1e6, .unit = "s"

#define ROW(field_type, struct_type, member, json_key)                                                       \
    .key = json_key, .type = field_type, .offset = offsetof(struct_type, member)

static inline void set3(float out[3], float x, float y, float z) {
    out[0] = x;
    out[1] = y;
    out[2] = z;
}

/* Vectors that are absent hold NaN. */
static inline bool is_given(const float vector[3]) {
    return !isnan(vector[0]);
}

/* The section "Render" (scene_render.c). */
extern const ObjectType scene_render_type;
/* The section "Sea" (scene_sea.c). */
extern const ObjectType scene_sea_type;

#endif
