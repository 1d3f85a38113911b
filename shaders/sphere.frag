// A lit sphere with its true depth.
#include "frame.glsl"
#include "sphere.glsl"

void main() {
    vec3 n = sphere_normal();
    float depth = centre_depth - 0.5 * sphere.w * n.z;
    gl_FragDepth = 0.5 + 0.5 * (projection[2][2] * -depth + projection[3][2]) / depth;
    color = sphere_color(n);
}
