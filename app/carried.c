/* Carried scenes: texts of the program in place of files. Meshes are read from files, so they are written out
 * for as long as that takes. */
#include "carried.h"

#include "engine/base/file.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static const char *find_text(const char *name) {
    const CarriedText *text = carried_texts;
    while (text->name && strcmp(text->name, name) != 0)
        text++;
    assert(text->name && "a name that CMakeLists.txt does not list");
    return text->text;
}

Scene *carried_scene(const char *name, const char *const *edits, int edit_count, Err *err) {
    const char *text = find_text(name);
    return scene_parse(name, text, strlen(text), edits, edit_count, err);
}

static const char *base_name(const char *path) {
    const char *slash = strrchr(path, '/');
    return slash ? slash + 1 : path;
}

/* Bodies with their meshes' files in `folder`. */
static bool write_meshes(SkiffBodyDef *bodies, int count, const char *folder, char (*paths)[4096], Err *err) {
    for (int b = 0; b < count; b++) {
        SkiffGeometryDef *geometry = &bodies[b].geometry;
        if (geometry->kind != SKIFF_GEOMETRY_MESH)
            continue;
        const char *name = base_name(geometry->file), *text = find_text(name);
        snprintf(paths[b], sizeof paths[b], "%.3000s/%.1000s", folder, name);
        if (!file_write(paths[b], text, strlen(text), err))
            return false;
        geometry->file = paths[b];
    }
    return true;
}

SkiffSim *carried_start(const Scene *scene, const char *folder, int threads, SkiffSimd simd, Err *err) {
    SkiffDef def = scene->def;
    const size_t count = (size_t)def.body_count + 1;
    SkiffBodyDef *bodies = calloc(count, sizeof *bodies);
    char(*paths)[4096] = calloc(count, sizeof *paths);
    SkiffSim *sim = NULL;
    if (!bodies || !paths) {
        err_set(err, ERR_IO, "out of memory");
    } else {
        memcpy(bodies, def.bodies, (size_t)def.body_count * sizeof *bodies);
        def.bodies = bodies;
        def.threads = threads;
        def.simd = simd;
        if (write_meshes(bodies, def.body_count, folder, paths, err))
            sim = skiff_create(&def, err);
        for (int b = 0; b < def.body_count; b++)
            if (*paths[b])
                unlink(paths[b]);
    }
    free(bodies);
    free(paths);
    return sim;
}
