// Mean of 3 x 3 pixels, every other one, among neighbours of like depth: takes away the stripes that two one-dimensional
// filters leave.
#include "frame.glsl"
uniform sampler2D depth_image;
uniform float threshold; // m
layout(location = 0) out float residual;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy), last = ivec2(fluid_size.xy) - 1;
    float centre = texelFetch(depth_image, pixel, 0).r;
    float sum = centre, weight = 1.0;
    if (centre < 0.9 * NO_DEPTH)
        for (int y = -2; y <= 2; y += 2)
            for (int x = -2; x <= 2; x += 2) {
                float z = texelFetch(depth_image, clamp(pixel + ivec2(x, y), ivec2(0), last), 0).r;
                float like = abs(z - centre) < threshold ? 1.0 : 0.0;
                sum += z * like;
                weight += like;
            }
    residual = sum / weight;
}
