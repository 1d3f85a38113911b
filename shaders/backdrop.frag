// Behind the particles: a calm gradient, and still water or ground as a grid of 1 m that stands still in the world.
#include "frame.glsl"
in vec2 uv;
layout(location = 0) out vec4 color;

void main() {
    vec3 ray = local_ray(uv), direction = normalize(ray);
    vec3 c = mix(vec3(0.93, 0.94, 0.95), vec3(0.74, 0.78, 0.82), clamp(abs(direction.y) * 1.6, 0.0, 1.0));
    float level = edge.z > 0.0 ? eye.w : ground.x;
    float depth = (level - eye.y) / (abs(ray.y) > 1e-5 ? ray.y : 1e-5);
    if (edge.z + edge.w > 0.0 && depth > 0.0) {
        float far = depth * length(ray), pixel = far * size.w * 2.0 * lens.y / max(abs(direction.y), 0.02);
        vec2 p = (eye.xyz + ray * depth).xz + ground.yz;
        vec2 d = abs(fract(p + 0.5) - 0.5);
        vec2 on = (1.0 - smoothstep(vec2(0.004), vec2(0.004 + pixel), d)) * clamp(1.2 - pixel * 2.5, 0.0, 1.0);
        c -= vec3(0.20, 0.17, 0.15) * max(on.x, on.y) * exp(-0.03 * far);
    }
    color = vec4(c, 0.0);
}
