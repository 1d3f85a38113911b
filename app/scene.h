/* Scenes: JSON files that say what a simulation is made of. `skiff check --schema` documents every key. */
#ifndef SKIFF_APP_SCENE_H
#define SKIFF_APP_SCENE_H

#include "script.h"

#include "engine/skiff.h"

#include <jansson.h>

typedef struct Scene {
    const char *file;  /* as the user named it */
    const char *title; /* "" where there is none */
    double duration;   /* s, from def.start_time */
    double probe_rate; /* Hz; 0: every step */
    const char *input; /* input file, as a path that can be opened; NULL: none */
    const ScriptKey *keys;
    int key_count;
    SkiffDef def;                     /* strings and arrays belong to the scene */
    const struct SceneRender *render; /* NULL: the file has no section "Render" */
    const char *cameras;              /* names, "a|b|c": those of Render, then those that always exist */
    struct SceneContent *content;
} Scene;

/* Reads a file, applies `edits` ("path=value") and checks it. NULL with every problem of the file in the
 * message, one a line (ERR_INPUT; ERR_USAGE for an edit of a key that does not exist). */
Scene *scene_load(const char *path, const char *const *edits, int edit_count, Err *err);
/* The same from memory; `file` is used in messages and tells the folder that relative file names start from.
 */
Scene *scene_parse(const char *file, const char *text, size_t size, const char *const *edits, int edit_count,
                   Err *err);
void scene_free(Scene *scene);

/* Makes the simulation. threads 0: as many as there are cores. What the engine finds wrong with the scene is
 * reported with the file's name. */
SkiffSim *scene_start(const Scene *scene, int threads, SkiffSimd simd, Err *err);

/* The scene with every default filled in; reading it gives the same simulation. New reference. */
json_t *scene_effective(const Scene *scene);
/* JSON schema of scene files. New reference. */
json_t *scene_schema(void);

/* Name without folder and ".json", for tables and result files. */
void scene_name(const Scene *scene, char *out, size_t size);

#endif
