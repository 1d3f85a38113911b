// Depth of a sphere minus that of still water in the same pixel. The smallest is kept by blending with MIN.
#include "frame.glsl"
flat in float centre_depth;
flat in float radius;
layout(location = 0) out float residual;

void main() {
    vec2 u = gl_PointCoord * 2.0 - 1.0;
    float d = dot(u, u);
    float still = plane_depth(local_ray(gl_FragCoord.xy * fluid_size.zw));
    residual = d > 1.0 ? NO_DEPTH : centre_depth - sqrt(1.0 - d) * radius - still;
}
