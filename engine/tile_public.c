/* The functions of skiff.h for water at rest: handles around the tiles of tile.h. */
#include "sim.h"

#include <stdlib.h>

/* Moves a tile into a handle of its own. */
static SkiffTile *own(RestTile *tile, Err *err) {
    SkiffTile *handle = malloc(sizeof *handle);
    if (handle) {
        *handle = *tile;
    } else {
        err_set(err, ERR_INPUT, "no memory for a rest tile");
        tile_free(tile);
    }
    return handle;
}

SkiffTile *skiff_tile_make(const SkiffTileDef *def, Err *err) {
    RestTile tile;
    SkiffTileDef own_def = *def;
    own_def.threads = sim_threads(def->threads);
    return tile_make(&own_def, &tile, err) ? own(&tile, err) : NULL;
}

SkiffTile *skiff_tile_cut(const SkiffSim *sim, const double min[3], const double max[3], Err *err) {
    RestTile tile;
    const SkiffParticles particles = skiff_particles(sim);
    TileCut cut = {.position = particles.position,
                   .count = particles.count,
                   .radius = (double)sim->params.particle_radius,
                   .volume_factor = (double)sim->params.volume_factor};
    for (int k = 0; k < 3; k++) {
        cut.origin[k] = particles.origin[k];
        cut.min[k] = min[k];
        cut.max[k] = max[k];
    }
    return tile_cut(&cut, &tile, err) ? own(&tile, err) : NULL;
}

SkiffTile *skiff_tile_surface(int threads, Err *err) {
    SkiffDef def = skiff_def_default();
    RestTile surface;
    def.threads = threads;
    SkiffSim *sim = skiff_create(&def, err);
    const bool good = sim && tile_load_default(&sim->tile, err) && water_make_surface(sim, &surface, err);
    skiff_destroy(sim);
    return good ? own(&surface, err) : NULL;
}

SkiffTile *skiff_tile_open(const char *path, Err *err) {
    RestTile tile;
    const bool good = path ? tile_load(path, &tile, err) : tile_load_default(&tile, err);
    return good ? own(&tile, err) : NULL;
}

bool skiff_tile_save(const SkiffTile *tile, const char *path, Err *err) {
    return tile_save(tile, path, err);
}

SkiffTileInfo skiff_tile_info(const SkiffTile *tile) {
    SkiffTileInfo info = {
        .count = tile->count, .periodic = tile->periodic, .volume_factor = tile->volume_factor};
    for (int k = 0; k < 3; k++)
        info.size[k] = (double)tile->size[k];
    return info;
}

bool skiff_tile_measure(const SkiffTile *tile, SkiffTileQuality *quality, Err *err) {
    return tile_measure(tile, sim_threads(0), quality, err);
}

void skiff_tile_destroy(SkiffTile *tile) {
    if (tile)
        tile_free(tile);
    free(tile);
}
