// Particles as spheres, coloured by a field.
#include "frame.glsl"
layout(location = 0) in vec4 point; // position, opacity
layout(location = 1) in float value;
uniform sampler2D color_map;
uniform vec2 overscan;
flat out vec4 paint;
flat out float centre_depth;

void main() {
    float part = clamp((value - field.x) * field.y, 0.0, 1.0);
    paint = vec4(textureLod(color_map, vec2(part * (255.0 / 256.0) + 0.5 / 256.0, 0.5), 0.0).rgb, point.w);
    vec4 centre = view * vec4(point.xyz, 1.0);
    centre_depth = -centre.z;
    gl_Position = projection * centre;
    gl_Position.xy /= overscan;
    gl_PointSize = max(1.0, sphere.z * sphere.w / max(centre_depth, 1e-3));
}
