// Wind ripples, fixed in the world: four layers of one tile of slopes, turned and scaled. The same on particles and ocean.
uniform sampler2D ripple_map; // slopes x, z as 0.5 + 0.5 s; foam cells; finer foam cells

const float RIPPLE_MAP_EDGE = 256.0;

// level: of the tile's mipmaps for a tile of 1 m.
float ripple_level(float footprint) {
    return log2(footprint * RIPPLE_MAP_EDGE);
}

vec4 ripple_layer(int i, vec2 p, float level) {
    vec4 turn = ripple_turn[i];
    vec2 q = mat2(turn.x, -turn.y, turn.y, turn.x) * p * ripple[i].w + ripple[i].xy;
    return textureLod(ripple_map, q, max(level + turn.z, 0.0));
}

vec2 ripple_slope(int i, vec2 p, float level) {
    vec4 turn = ripple_turn[i];
    vec2 s = ripple_layer(i, p, level).xy * 2.0 - 1.0;
    return mat2(turn.x, turn.y, -turn.y, turn.x) * s * ripple[i].z;
}

// Slope of the surface at local x, z.
vec2 ripple_slopes(vec2 p, float level) {
    vec2 sum = vec2(0.0);
    for (int i = 0; i < RIPPLE_LAYERS; i++)
        sum += ripple_slope(i, p, level);
    return sum;
}
