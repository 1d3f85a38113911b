// The sky as a picture: the upper hemisphere, octahedral, y up.
uniform sampler2D sky_image;

vec2 sky_place(vec3 direction) {
    vec2 p = direction.xz / (abs(direction.x) + abs(direction.y) + abs(direction.z));
    return vec2(p.x + p.y, p.x - p.y) * 0.5 + 0.5;
}

vec3 sky(vec3 direction) {
    return textureLod(sky_image, sky_place(vec3(direction.x, max(direction.y, 0.0), direction.z)), 0.0).rgb;
}

// Colour of the air at the horizon, where everything ends.
vec3 haze(vec3 direction) {
    return sky(vec3(direction.x, 0.0, direction.z));
}
