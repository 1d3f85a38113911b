// The part of the water look's picture that is above all water.
#include "frame.glsl"
#include "sky.glsl"
#include "behind.glsl"
uniform sampler2D mesh_image;
in vec2 uv;
layout(location = 0) out vec4 color;

void main() {
    vec3 ray = local_ray(uv), direction = normalize(ray);
    vec4 mesh = texelFetch(mesh_image, ivec2(gl_FragCoord.xy), 0);
    color = vec4(display(mesh.a > 0.5 ? mesh.rgb : backdrop(ray, direction, haze(direction))), 1.0);
}
