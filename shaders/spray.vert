// Droplets in the air.
#include "frame.glsl"
layout(location = 0) in vec4 point; // position, opacity
layout(location = 1) in float radius;
flat out float opacity;
flat out float centre_depth;

void main() {
    vec4 centre = view * vec4(point.xyz, 1.0);
    gl_Position = projection * centre;
    centre_depth = -centre.z;
    float wide = 2.0 * sphere.z * radius / max(centre_depth, 1e-3);
    // What is smaller than a pixel and a half becomes fainter instead.
    float drawn = max(wide, 1.5);
    opacity = point.w * min(1.0, wide * wide / (drawn * drawn) * 1.6);
    gl_PointSize = drawn;
}
