#include "frame.glsl"
flat in vec4 paint;
flat in float centre_depth;
layout(location = 0) out vec4 color;

void main() {
    vec2 u = vec2(gl_PointCoord.x * 2.0 - 1.0, 1.0 - gl_PointCoord.y * 2.0);
    float d = dot(u, u);
    if (d > 1.0)
        discard;
    vec3 n = vec3(u, sqrt(1.0 - d));
    float depth = centre_depth - 0.5 * sphere.w * n.z;
    gl_FragDepth = 0.5 + 0.5 * (projection[2][2] * -depth + projection[3][2]) / depth;
    vec3 to_sun = mat3(view) * sun.xyz;
    float lit = 0.5 + 0.5 * dot(n, to_sun);
    float shine = pow(max(reflect(-to_sun, n).z, 0.0), 24.0);
    color = vec4(paint.rgb * (0.42 + 0.68 * lit * lit) * (0.75 + 0.25 * n.z) + 0.10 * shine, paint.a);
}
