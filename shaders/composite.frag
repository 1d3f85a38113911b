// The picture where anything may be in sight.
const bool HAS_PARTICLES = true, HAS_MESHES = true;
#include "water.glsl"

void main() {
    vec3 ray = local_ray(uv);
    vec4 mesh = texelFetch(mesh_image, ivec2(gl_FragCoord.xy), 0);
    float solid = mesh_depth(texelFetch(mesh_depth_image, ivec2(gl_FragCoord.xy), 0).r);
    Water water = find_water(ray, mesh.a);
    float ray_length = length(ray);
    vec3 direction = ray / ray_length, air = haze(direction), background = backdrop(ray, direction, air);
    vec3 c = mesh.a > 0.5 ? mesh.rgb : background;
    vec3 shaded = shade(water, direction, ray_length, background, air);
    c = water.depth < solid || (water.depth < NEVER && mesh.a < 0.5) ? shaded : c;
    color = vec4(display(c), 1.0);
}
