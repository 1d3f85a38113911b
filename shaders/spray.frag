#include "frame.glsl"
uniform sampler2D depth_image;
flat in float opacity;
flat in float centre_depth;
layout(location = 0) out vec4 color;

void main() {
    vec2 u = gl_PointCoord * 2.0 - 1.0;
    float d = dot(u, u);
    float residual = texelFetch(depth_image, ivec2(gl_FragCoord.xy * size.zw * fluid_size.xy), 0).r;
    float still = plane_depth(local_ray(gl_FragCoord.xy * size.zw));
    bool hidden = centre_depth > residual + still + sphere.x;
    if (d > 1.0 || hidden)
        discard;
    color = vec4(vec3(0.93, 0.965, 1.0) - 0.12 * u.y, opacity * (1.0 - d * d));
}
