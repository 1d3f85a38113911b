// One direction of the narrow-range filter [Truong & Yuksel 2018, A narrow-range filter for screen-space fluid rendering]
// on the residual depth. What is far in front of the range is left out; what is far behind counts as a little behind.
// Unlike theirs the range does not grow along connected neighbours (the residual has no slope to follow, and whether two
// are connected flips from pixel to pixel at the end of a crest), and its ends are soft.
#include "frame.glsl"
uniform sampler2D depth_image;
uniform ivec2 direction;
uniform float reach;     // of the filter, px at depth 1 m
uniform float threshold; // m
layout(location = 0) out float residual;

const int TAPS = 12;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy), last = ivec2(fluid_size.xy) - 1;
    float centre = texelFetch(depth_image, pixel, 0).r;
    if (centre >= 0.9 * NO_DEPTH) {
        residual = centre;
        return;
    }
    float still = plane_depth(local_ray(gl_FragCoord.xy * fluid_size.zw));
    // At grazing angles a step in height is a long step in depth.
    float grazing = max(1.0, 0.6 * still / max(abs(eye.y - eye.w), 0.3));
    float range = threshold * min(grazing, 8.0), behind = centre + range * 0.33;
    // Large kernels take fewer taps at a stride: what they smooth is then as large.
    float wanted = reach / max(centre + still, lens.z);
    int taps = int(clamp(ceil(wanted), 1.0, float(TAPS)));
    float stride = clamp(wanted / float(TAPS), 1.0, 5.0);
    float falloff = 4.5 / float(taps * taps);
    vec2 sum = vec2(centre, 0.0), weights = vec2(1.0, 0.0);
    float softness = 1.0 / (0.5 * range);
    for (int i = 1; i <= taps; i++) {
        ivec2 step_to = direction * int(float(i) * stride + 0.5);
        vec2 z = vec2(texelFetch(depth_image, clamp(pixel + step_to, ivec2(0), last), 0).r,
                      texelFetch(depth_image, clamp(pixel - step_to, ivec2(0), last), 0).r);
        vec2 off = z - centre;
        vec2 weight = exp(-float(i * i) * falloff) * clamp((off + range) * softness + 1.0, 0.0, 1.0);
        vec2 counted = mix(z, vec2(behind), clamp((off - range) * softness, 0.0, 1.0));
        sum += counted * weight;
        weights += weight;
    }
    residual = (sum.x + sum.y) / (weights.x + weights.y);
}
