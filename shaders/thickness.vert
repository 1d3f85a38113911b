// Particles of the water's body, for what adds up along a ray.
#include "frame.glsl"
layout(location = 0) in vec4 point; // position, fade
layout(location = 1) in float foam;
layout(location = 2) in float bulk; // 1: inside a body of water, of which only the outside is drawn
flat out vec2 amount;
uniform vec2 overscan;
uniform float focal; // px of 1 m at depth 1 m in the target

void main() {
    float radius = 0.8 * sphere.x * sqrt(point.w);
    vec4 centre = view * vec4(point.x, point.y - radius * sphere.y, point.z, 1.0);
    amount = vec2(2.0 * radius * (1.0 + 25.0 * bulk), foam) * point.w;
    gl_Position = projection * centre;
    gl_Position.xy /= overscan;
    gl_PointSize = max(1.0, 2.0 * focal * radius / max(-centre.z, 1e-3));
}
