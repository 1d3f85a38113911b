/* Scenes that the program carries with it, and their meshes: what it runs of its own accord. The build embeds
 * the files of assets/ that CMakeLists.txt names. */
#ifndef SKIFF_APP_CARRIED_H
#define SKIFF_APP_CARRIED_H

#include "scene.h"

/* One embedded file. The list ends with a name of NULL; the build writes it. */
typedef struct CarriedText {
    const char *name, *text; /* without folder */
} CarriedText;
extern const CarriedText carried_texts[];

/* A scene by the name of its file, as `edits` change it (see scene_load). */
Scene *carried_scene(const char *name, const char *const *edits, int edit_count, Err *err);
/* The simulation of a carried scene; its meshes stand in `folder` while it is made. */
SkiffSim *carried_start(const Scene *scene, const char *folder, int threads, SkiffSimd simd, Err *err);

#endif
