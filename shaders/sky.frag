// Paints the sky: a clear gradient, haze at the horizon, the sun's glow, thin fair-weather clouds.
#include "frame.glsl"
#include "sky.glsl"
in vec2 uv;
layout(location = 0) out vec4 color;

float lattice(vec2 p) {
    uvec2 q = uvec2(ivec2(p));
    uint h = q.x * 1664525u + q.y * 1013904223u;
    h = (h ^ (h >> 15)) * 2246822519u;
    h = (h ^ (h >> 13)) * 3266489917u;
    return float((h ^ (h >> 16)) >> 8) * (1.0 / 16777216.0);
}

float noise(vec2 p) {
    vec2 i = floor(p), f = p - i;
    f = f * f * (3.0 - 2.0 * f);
    return mix(mix(lattice(i), lattice(i + vec2(1, 0)), f.x), mix(lattice(i + vec2(0, 1)), lattice(i + vec2(1, 1)), f.x),
               f.y);
}

float cloud_noise(vec2 p) {
    float sum = 0.0, weight = 0.5;
    for (int i = 0; i < 6; i++) {
        sum += weight * noise(p);
        p = mat2(1.6, 1.2, -1.2, 1.6) * p + 17.3;
        weight *= 0.5;
    }
    return sum;
}

void main() {
    vec2 q = uv * 2.0 - 1.0, p = vec2(q.x + q.y, q.x - q.y) * 0.5;
    vec3 d = normalize(vec3(p.x, 1.0 - abs(p.x) - abs(p.y), p.y));
    float h = max(d.y, 0.0), towards_sun = max(dot(d, sun.xyz), 0.0);
    vec3 clear = mix(vec3(0.56, 0.73, 0.90), vec3(0.17, 0.40, 0.74), 1.0 - exp(-2.6 * h));
    vec3 c = mix(clear, horizon_air(towards_sun), exp(-7.5 * h));

    // A layer of small cumulus far away and cirrus above, both thinner towards the zenith.
    vec2 ceiling = d.xz / (h + 0.16);
    float puffs = smoothstep(0.50, 0.72, cloud_noise(ceiling * 1.15 + 40.0));
    float veil = smoothstep(0.40, 0.85, cloud_noise(ceiling * vec2(0.35, 1.1) + 90.0));
    float shade = cloud_noise(ceiling * 1.15 + 40.0 + 0.10 * sun.xz);
    vec3 cloud = mix(vec3(0.98, 0.98, 0.99), vec3(0.78, 0.82, 0.88), smoothstep(0.55, 0.85, shade));
    float far = smoothstep(0.02, 0.16, h);
    c = mix(c, vec3(0.95, 0.97, 0.99), 0.30 * veil * far);
    c = mix(c, cloud, 0.80 * puffs * far * (1.0 - 0.45 * h));
    c += sun_glow(towards_sun) + vec3(1.0, 0.86, 0.62) * 0.9 * pow(towards_sun, 700.0);
    color = vec4(c, 1.0);
}
