// Normals of the filtered fluid in the eye's frame, packed with residual depth and coverage; multiplied by the coverage, so
// that linear interpolation at the rim is right after division.
#include "frame.glsl"
uniform sampler2D depth_image;
in vec2 uv;
layout(location = 0) out vec4 packed_normal;

float still_depth(vec2 at) {
    return plane_depth(local_ray(at));
}

vec3 place(vec2 at, float residual) {
    return eye_ray(at) * (residual + still_depth(at));
}

float fetch(ivec2 pixel) {
    return texelFetch(depth_image, clamp(pixel, ivec2(0), ivec2(fluid_size.xy) - 1), 0).r;
}

// Difference along one axis: central where both neighbours belong to the same surface, else on the nearer side.
vec3 slope(vec3 centre, vec3 before, vec3 after, float z, float z_before, float z_after, float limit) {
    float a = abs(z_before - z), b = abs(z_after - z);
    if (a < limit && b < limit)
        return after - before;
    return a < b ? (centre - before) * 2.0 : (after - centre) * 2.0;
}

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    float z = fetch(pixel);
    packed_normal = vec4(0.0);
    if (z >= 0.9 * NO_DEPTH)
        return;
    vec2 dx = vec2(fluid_size.z, 0.0), dy = vec2(0.0, fluid_size.w);
    float left = fetch(pixel - ivec2(1, 0)), right = fetch(pixel + ivec2(1, 0));
    float down = fetch(pixel - ivec2(0, 1)), up = fetch(pixel + ivec2(0, 1));
    float grazing = max(1.0, still_depth(uv) / max(abs(eye.y - eye.w), 0.3));
    float limit = 0.8 * sphere.w * min(grazing, 8.0);
    vec3 centre = place(uv, z);
    vec3 along_x = slope(centre, place(uv - dx, left), place(uv + dx, right), z, left, right, limit);
    vec3 along_y = slope(centre, place(uv - dy, down), place(uv + dy, up), z, down, up, limit);
    vec3 n = normalize(cross(along_x, along_y));
    packed_normal = vec4(n.xy, z, 1.0);
}
