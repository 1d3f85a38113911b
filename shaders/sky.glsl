// The sky as a picture: the upper hemisphere, octahedral, y up.
uniform sampler2D sky_image;

vec2 sky_place(vec3 direction) {
    vec2 p = direction.xz / (abs(direction.x) + abs(direction.y) + abs(direction.z));
    return vec2(p.x + p.y, p.x - p.y) * 0.5 + 0.5;
}

vec3 sky(vec3 direction) {
    return textureLod(sky_image, sky_place(vec3(direction.x, max(direction.y, 0.0), direction.z)), 0.0).rgb;
}

// The sun's light in the air around it.
vec3 sun_glow(float towards_sun) {
    float glow = towards_sun * towards_sun;
    glow *= glow;
    float core = glow * glow;
    core *= core;
    core *= core;
    return vec3(1.0, 0.86, 0.62) * (0.10 * glow + 0.22 * core);
}

// Colour of the air at the horizon, where everything ends.
vec3 horizon_air(float towards_sun) {
    return mix(vec3(0.80, 0.88, 0.94), vec3(0.93, 0.90, 0.84), towards_sun * towards_sun * towards_sun * 0.7);
}

vec3 haze(vec3 direction) {
    float towards_sun = max(dot(direction.xz, sun.xz) * inversesqrt(max(dot(direction.xz, direction.xz), 1e-12)), 0.0);
    return horizon_air(towards_sun) + sun_glow(towards_sun);
}
