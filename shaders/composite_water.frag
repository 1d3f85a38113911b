// The picture where particles and ocean are in sight, and no sky.
const bool HAS_PARTICLES = true, HAS_MESHES = false;
#include "water.glsl"
#include "water_alone.glsl"
