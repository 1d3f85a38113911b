/* The parameter tables made into data, and the defaults of every def. */
#include "params.h"

#include <math.h>
#include <stddef.h>
#include <string.h>

#define PARAM_FLOAT(field, key, value, min, max, unit, help)                                                 \
    {key, SKIFF_FLOAT, offsetof(PARAM_STRUCT, field), {value}, min, max, unit, NULL, help},
#define PARAM_INT(field, key, value, min, max, unit, help)                                                   \
    {key, SKIFF_INT, offsetof(PARAM_STRUCT, field), {value}, min, max, unit, NULL, help},
#define PARAM_BOOL(field, key, value, help)                                                                  \
    {key, SKIFF_BOOL, offsetof(PARAM_STRUCT, field), {value}, 0, 1, "", NULL, help},
#define PARAM_VEC3(field, key, x, y, z, min, max, unit, help)                                                \
    {key, SKIFF_VEC3, offsetof(PARAM_STRUCT, field), {x, y, z}, min, max, unit, NULL, help},
#define PARAM_ENUM(field, key, value, names, help)                                                           \
    {key, SKIFF_ENUM, offsetof(PARAM_STRUCT, field), {value}, 0, 0, "", names, help},

#define PARAM_STRUCT SkiffParams
static const SkiffParamInfo param_infos[] = {
#include "params.inl"
};
#undef PARAM_STRUCT

#define PARAM_STRUCT SkiffDriveDef
static const SkiffParamInfo drive_infos[] = {
#include "drive.inl"
};
#undef PARAM_STRUCT

#undef PARAM_FLOAT
#undef PARAM_INT
#undef PARAM_BOOL
#undef PARAM_VEC3
#undef PARAM_ENUM

enum {
    PARAM_COUNT = sizeof param_infos / sizeof param_infos[0],
    DRIVE_COUNT = sizeof drive_infos / sizeof drive_infos[0]
};

const SkiffParamInfo *skiff_param_infos(int *count) {
    *count = PARAM_COUNT;
    return param_infos;
}

const SkiffParamInfo *skiff_drive_infos(int *count) {
    *count = DRIVE_COUNT;
    return drive_infos;
}

static int enum_count(const char *names) {
    int count = 1;
    for (; *names != '\0'; names++)
        count += *names == '|';
    return count;
}

/* Largest and smallest component of the field; NaN if any is. */
static void param_extremes(const SkiffParamInfo *info, const void *field, double *low, double *high) {
    switch (info->type) {
    case SKIFF_FLOAT:
        *low = *high = *(const float *)field;
        break;
    case SKIFF_INT:
    case SKIFF_ENUM:
        *low = *high = *(const int *)field;
        break;
    case SKIFF_BOOL: /* both values are in range */
        break;
    case SKIFF_VEC3: {
        const float *v = field;
        *low = *high = v[0];
        for (int k = 1; k < 3; k++) {
            *low = v[k] < *low || isnan(v[k]) ? v[k] : *low;
            *high = v[k] > *high || isnan(v[k]) ? v[k] : *high;
        }
        break;
    }
    }
}

static bool check_fields(const SkiffParamInfo *infos, int count, const void *object, const char *path,
                         Err *err) {
    bool good = true;
    for (int k = 0; k < count; k++) {
        const SkiffParamInfo *info = &infos[k];
        double low = 0.0, high = 0.0;
        param_extremes(info, (const char *)object + info->offset, &low, &high);
        const double max = info->type == SKIFF_ENUM ? enum_count(info->names) - 1 : info->max;
        /* float fields are compared with float limits: 0.1f is above 0.1 */
        if ((float)low >= (float)info->min && (float)high <= (float)max)
            continue;
        const double bad = (float)low >= (float)info->min ? high : low;
        good = err_add(err, ERR_INPUT, "%s.%s: %g is out of range, allowed is %g to %g%s%s", path, info->key,
                       bad, info->min, max, info->unit[0] ? " " : "", info->unit);
    }
    return good;
}

bool skiff_params_check(const SkiffParams *params, Err *err) {
    return check_fields(param_infos, PARAM_COUNT, params, "Configuration", err);
}

bool params_check_drive(const SkiffDriveDef *def, const char *path, Err *err) {
    return check_fields(drive_infos, DRIVE_COUNT, def, path, err);
}

static void set_defaults(const SkiffParamInfo *infos, int count, void *object) {
    for (int k = 0; k < count; k++) {
        void *field = (char *)object + infos[k].offset;
        switch (infos[k].type) {
        case SKIFF_FLOAT:
            *(float *)field = (float)infos[k].defaults[0];
            break;
        case SKIFF_INT:
        case SKIFF_ENUM:
            *(int *)field = (int)infos[k].defaults[0];
            break;
        case SKIFF_BOOL:
            *(bool *)field = infos[k].defaults[0] != 0.0;
            break;
        case SKIFF_VEC3:
            for (int a = 0; a < 3; a++)
                ((float *)field)[a] = (float)infos[k].defaults[a];
            break;
        }
    }
}

SkiffDef skiff_def_default(void) {
    SkiffDef def;
    memset(&def, 0, sizeof def);
    set_defaults(param_infos, PARAM_COUNT, &def.params);
    def.tank.geometry = skiff_geometry_default();
    def.tank.open = true;
    def.tank.wet_height = INFINITY;
    return def;
}

SkiffGeometryDef skiff_geometry_default(void) {
    return (SkiffGeometryDef){.size = {1, 1, 1},
                              .radius = 1,
                              .inner_radius = 0.5f,
                              .top_radius = 0.5f,
                              .height = 1,
                              .branches = 5,
                              .scale = {1, 1, 1},
                              .rotation_axis = {0, 1, 0}};
}

SkiffBlockDef skiff_block_default(void) {
    return (SkiffBlockDef){.repeat = 1, .period = 1.0};
}

SkiffBodyDef skiff_body_default(void) {
    return (SkiffBodyDef){.geometry = skiff_geometry_default(),
                          .density = 1000.0f,
                          .free_axes = SKIFF_FREE_ALL,
                          .stop_time = INFINITY};
}

SkiffDriveDef skiff_drive_default(void) {
    SkiffDriveDef def;
    memset(&def, 0, sizeof def);
    set_defaults(drive_infos, DRIVE_COUNT, &def);
    return def;
}

SkiffProbeDef skiff_probe_default(void) {
    return (SkiffProbeDef){.kind = SKIFF_PROBE_HEIGHT};
}

const char *skiff_simd_name(SkiffSimd simd) {
    static const char *const names[] = {"auto", "plain", "avx2", "avx512"};
    return names[simd];
}

#define PHASE(id, key, label) [SKIFF_PHASE_##id] = {key, label},
static const char *const phase_texts[SKIFF_PHASE_COUNT][2] = {
#include "phases.inl"
};
#undef PHASE

const char *skiff_phase_key(int phase) {
    return phase_texts[phase][0];
}

const char *skiff_phase_label(int phase) {
    return phase_texts[phase][1];
}

static const char *const in_texts[SKIFF_IN_COUNT][2] = {
#define CAUSE_IN(id, key, label) [SKIFF_IN_##id] = {key, label},
#define CAUSE_OUT(id, key, label)
#include "causes.inl"
#undef CAUSE_IN
#undef CAUSE_OUT
};

static const char *const out_texts[SKIFF_OUT_COUNT][2] = {
#define CAUSE_IN(id, key, label)
#define CAUSE_OUT(id, key, label) [SKIFF_OUT_##id] = {key, label},
#include "causes.inl"
#undef CAUSE_IN
#undef CAUSE_OUT
};

const char *skiff_in_key(int cause) {
    return in_texts[cause][0];
}

const char *skiff_in_label(int cause) {
    return in_texts[cause][1];
}

const char *skiff_out_key(int cause) {
    return out_texts[cause][0];
}

const char *skiff_out_label(int cause) {
    return out_texts[cause][1];
}
