// The picture where nothing but the ocean is in sight.
const bool HAS_PARTICLES = false, HAS_MESHES = false;
#include "water.glsl"
#include "water_alone.glsl"
