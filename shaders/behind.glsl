// Sky, and the ground where there is one.
vec3 backdrop(vec3 ray, vec3 direction, vec3 air) {
    vec3 c = sky(direction);
    if (edge.w > 0.0 && ray.y < -1e-4) {
        float depth = (ground.x - eye.y) / ray.y;
        if (depth > 0.0) {
            float far = depth * length(ray), pixel = far * size.w * 2.0 * lens.y / max(-direction.y, 0.02);
            vec2 p = (eye.xyz + ray * depth).xz + ground.yz;
            vec2 d = abs(fract(p + 0.5) - 0.5);
            vec2 on = (1.0 - smoothstep(vec2(0.006), vec2(0.006 + pixel), d)) * clamp(1.2 - pixel * 3.0, 0.0, 1.0);
            vec3 floor_color = vec3(0.66, 0.68, 0.69) - 0.10 * max(on.x, on.y);
            c = mix(floor_color, air, 1.0 - exp(-0.035 * far));
        }
    }
    return c;
}

// Leaves all but the brightest as it is.
vec3 display(vec3 c) {
    vec3 over = max(c - 0.75, 0.0);
    return min(c, vec3(0.75)) + 0.25 * (1.0 - exp(-4.0 * over));
}
