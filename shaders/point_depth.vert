// Particles of the water's body as points of the fluid's image.
#include "frame.glsl"
layout(location = 0) in vec4 point; // position, fade
flat out float centre_depth;
flat out float radius;
uniform vec2 overscan; // the viewport is this much wider and higher than the image

void main() {
    // Lowered so that the upper sides of the drawn spheres are the water's surface, half a spacing above the centres.
    radius = sphere.x * sqrt(point.w);
    vec4 centre = view * vec4(point.x, point.y - radius * sphere.y, point.z, 1.0);
    centre_depth = -centre.z;
    gl_Position = projection * centre;
    gl_Position.xy /= overscan;
    gl_PointSize = 2.0 * sphere.z * (fluid_size.y * size.w) * radius / max(centre_depth, 1e-3);
}
