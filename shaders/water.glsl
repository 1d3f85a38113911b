// The look of water: where its surface is (particles inside the window, still water outside, blended by the distance to the
// window's edge), and what one sees on it and through it. Colours are as displayed; the constants are tuned by eye.
// Who includes this says what may be in sight: HAS_PARTICLES; HAS_MESHES, or their mirror images.
#include "frame.glsl"
#include "sky.glsl"
#include "behind.glsl"
#include "ripples.glsl"
uniform sampler2D mesh_image, mesh_depth_image, reflection_image, normal_image, thickness_image, edge_image, ocean_foam;
in vec2 uv;
layout(location = 0) out vec4 color;

const float NEVER = 1e9;
const vec3 OCEAN_DEEP = vec3(0.010, 0.135, 0.200), TANK_DEEP = vec3(0.03, 0.26, 0.33);
const float FOAM_MOST = 2.3, FOAM_HALF = 0.6, FOAM_LEAST = 0.06;

struct Water {
    float depth;  // of the eye
    vec3 place;
    vec3 normal;
    float fluid;  // 1: particles alone, 0: ocean alone
};

// How much the particles count at local x, z.
float fluid_part(vec2 p) {
    vec2 t = edge_box.xy + p * edge_box.zw;
    float part = smoothstep(edge.x, edge.y, textureLod(edge_image, t, 0.0).r);
    vec2 off = abs(t - 0.5);
    part = max(off.x, off.y) > 0.5 ? 0.0 : part;
    return edge.z > 0.0 ? part : 1.0;
}

// Foam on the sea at local x, z. What is little comes from a particle or two and would be dots.
float foam_afloat(vec2 p) {
    vec2 t = foam_box.xy + p * foam_box.zw;
    vec2 off = abs(t - 0.5);
    float sum = textureLod(ocean_foam, t, 0.0).r;
    sum = max(off.x, off.y) > 0.5 ? 0.0 : max(sum - FOAM_LEAST, 0.0);
    return FOAM_MOST * sum / (FOAM_HALF + sum);
}

// Without branches: software GL computes both sides of them anyway, and then merges.
Water find_water(vec3 ray, float mesh_there) {
    float still = (eye.w - eye.y) / (abs(ray.y) > 1e-5 ? ray.y : 1e-5);
    if (!HAS_PARTICLES && !HAS_MESHES)
        return Water(still, eye.xyz + ray * min(still, 1e5), vec3(0.0, 1.0, 0.0), 0.0);
    bool ocean = edge.z > 0.0 && still > 0.0;
    vec4 fluid = textureLod(normal_image, uv, 0.0), nearest = texelFetch(normal_image, ivec2(uv * fluid_size.xy), 0);
    bool covered = nearest.w > 0.5;
    fluid /= max(fluid.w, 1e-3);
    // Between a crest and what lies behind it there is nothing.
    fluid = abs(fluid.z - nearest.z) > sphere.x ? nearest : fluid;
    // Where no particle is, the ocean; but a hole inside the window is the inside of a boat.
    float depth = covered ? fluid.z + plane_depth(ray) : still;
    // Who looks under the rim of the particles looks through the ocean, which begins in front of it.
    float part = fluid_part((eye.xyz + ray * (ocean ? min(depth, still) : depth)).xz);
    bool hole = !covered && part * mesh_there > 0.5;
    part = covered ? part : 0.0;
    vec3 n = vec3(fluid.xy, sqrt(max(0.003, 1.0 - dot(fluid.xy, fluid.xy))));
    n = mat3(camera) * n;
    // At the edge of a crest before water far behind, the depth's slope is no slope of the sea's.
    n.y = edge.z > 0.0 ? max(n.y, 0.45) : n.y;
    n = mix(vec3(0.0, 1.0, 0.0), n, part);
    float at = ocean ? mix(min(still, depth + 5.0), depth, part) : part > 0.0 ? depth : NEVER;
    at = hole ? NEVER : at;
    return Water(at, eye.xyz + ray * min(at, 1e5), normalize(n), part);
}

// In the air only what is thick is a body of water; the rest are sheets. (Particles inside a body count as much more.)
float body_of_water(Water water, float under, float thickness) {
    bool airborne = edge.z == 0.0 || water.place.y > eye.w + 0.25;
    return airborne ? mix(min(under, thickness), under, smoothstep(0.12, 0.40, thickness)) : under;
}

// What lies behind the surface, seen through the ripples: colour, and metres of water in between.
vec4 see_through(Water water, float ray_length, vec2 bend, float thickness, vec3 empty) {
    float bottomless = edge.z > 0.0 ? 8.0 : 3.0;
    if (!HAS_MESHES && !HAS_PARTICLES)
        return vec4(empty, bottomless);
    if (!HAS_MESHES)
        return vec4(empty, body_of_water(water, bottomless, thickness));
    float own_depth = texelFetch(mesh_depth_image, ivec2(gl_FragCoord.xy), 0).r;
    vec2 at = uv + bend * 0.035;
    float buffer = textureLod(mesh_depth_image, at, 0.0).r;
    bool in_front = mesh_depth(buffer) <= water.depth, gone = buffer == 1.0 && own_depth < 1.0;
    if (in_front || gone) { // of the water; past the edge of what stands behind
        at = uv;
        buffer = own_depth;
    }
    bool mesh_behind = buffer < 1.0;
    float under = mesh_behind ? max(mesh_depth(buffer) - water.depth, 0.0) * ray_length : bottomless;
    under = body_of_water(water, under, thickness);
    return vec4(mesh_behind ? textureLod(mesh_image, at, 0.0).rgb : empty, under);
}

// White water: cells of foam that close up as there is more of it, and a milky veil of small bubbles between them, without which
// old foam looks like a net. The texels are those of the ripples, read once.
float foam_cover(vec2 p, float amount, float level) {
    float coarse = ripple_layer(2, p, level).z, fine = ripple_layer(3, p, level).w;
    float pattern = 0.50 * coarse + 0.50 * fine;
    float patches = ripple_layer(1, p, level).w; // where it has torn open
    float dense = 1.0 - exp(-1.3 * amount * (0.55 + 1.1 * patches));
    float cells = smoothstep(0.80 - dense, 2.1 - 1.2 * dense, pattern + 0.25 * dense) * min(1.0, 4.0 * dense);
    float veil = 0.42 * dense * dense;
    return clamp(cells + (1.0 - cells) * veil, 0.0, 0.95);
}

float power_of_64(float x) {
    x *= x;
    x *= x;
    x *= x;
    x *= x;
    x *= x;
    return x * x;
}

// The sun in a mirror that looks at `up`.
float sun_glint(vec3 up) {
    float broad = power_of_64(max(dot(up, sun.xyz), 0.0)), narrow = broad * broad;
    narrow *= narrow; // 256
    narrow *= narrow * narrow * narrow; // 1024
    return 1.3 * narrow + 0.20 * broad;
}

// Smooth sea far behind, as one sees it through a thin sheet.
vec3 sea_beyond(vec3 direction, vec3 air) {
    float grazing = 1.0 + min(direction.y, 0.0), grazing_sq = grazing * grazing;
    return mix(OCEAN_DEEP, air, 0.7 * grazing_sq * grazing_sq * grazing);
}

vec3 shade(Water water, vec3 direction, float ray_length, vec3 background, vec3 air) {
    vec3 n = water.normal;
    float far = water.depth * ray_length;
    float footprint = far * 2.0 * lens.y * size.w * inversesqrt(max(abs(direction.y), 0.03));
    float level = ripple_level(footprint);
    vec2 slopes = ripple_slopes(water.place.xz, level) * smoothstep(0.2, 0.75, n.y);
    n = normalize(n - vec3(slopes.x, 0.0, slopes.y));
    float facing = dot(n, direction);
    if (facing > -0.03) { // turned away: as steep as can be seen
        n = normalize(n - direction * (facing + 0.04));
        facing = dot(n, direction);
    }
    float grazing = 1.0 + facing, grazing_sq = grazing * grazing;
    // Steep faces are rough: they mirror little.
    float most = mix(0.35, 0.82, smoothstep(0.5, 0.9, n.y));
    float mirror = min(0.02 + 0.98 * grazing_sq * grazing_sq * grazing, most);
    vec3 up = reflect(direction, n);
    // Ripples too small to see still tilt what is seen: far water mirrors a higher sky.
    up.y = abs(up.y) + 0.02 + 0.16 * ground.w * smoothstep(0.02, 0.6, footprint);
    up = normalize(up);
    vec3 mirrored = sky(up);
    float glint = sun_glint(up);
    vec2 bend = (mat3(view) * (n - vec3(0.0, max(n.y, 0.0), 0.0))).xy;
    vec4 mesh_mirrored = vec4(0.0);
    if (HAS_MESHES)
        mesh_mirrored = textureLod(reflection_image, uv + bend * vec2(0.16, 0.20) / max(1.0, 0.5 * far), 0.0);
    mirrored = mix(mirrored, mesh_mirrored.rgb, mesh_mirrored.a);
    glint *= 1.0 - mesh_mirrored.a;

    vec2 sums = !HAS_PARTICLES ? vec2(0.0) : textureLod(thickness_image, uv, 0.0).rg;
    bool ocean = edge.z > 0.0;
    vec3 deep = ocean ? OCEAN_DEEP : TANK_DEEP;
    // Faces turned to the sun let more light in.
    deep *= max(1.0 + 1.3 * dot(n.xz, sun.xz), 0.6);
    vec3 absorption = ocean ? vec3(3.2, 1.05, 0.75) : vec3(0.95, 0.24, 0.15);
    // Light through thin crests and steep faces.
    float height = water.place.y - eye.w;
    float crest = clamp(height * 4.0 + 0.10, 0.0, 1.0) * water.fluid;
    float through = 0.5 - 0.5 * dot(direction, sun.xyz);
    deep += vec3(0.008, 0.135, 0.125) * crest * (0.35 + 0.65 * through);
    deep += vec3(0.0, 0.020, 0.024) * min((1.0 - n.y) * 5.0, 1.5);
    // What lies on the sea is known from above; sheets and crests in the air carry their own.
    float own_foam = ocean ? water.fluid * smoothstep(0.10, 0.30, height) : 1.0;
    float foam = mix(ocean ? foam_afloat(water.place.xz) : 0.0, sums.g, own_foam);
    deep += vec3(0.03, 0.16, 0.16) * (1.0 - exp(-0.6 * foam)); // bubbles below
    vec4 behind = see_through(water, ray_length, bend, mix(4.0, sums.r, water.fluid),
                              ocean && direction.y < 0.0 ? deep : background);
    vec3 clear = exp(-absorption * behind.a);
    vec3 c = mix(behind.rgb * clear + deep * (1.0 - clear), mirrored, mirror) + vec3(1.0, 0.88, 0.68) * glint;
    float light = 0.78 + 0.26 * max(dot(n, sun.xyz), 0.0);
    // Sheets and drops in the air are full of small curved faces: brighter than what is behind them.
    float airborne = ocean ? smoothstep(0.16, 0.26, height) : 0.7;
    float thin = airborne * water.fluid * (1.0 - smoothstep(0.12, 0.40, sums.r));
    c = mix(c, mix(ocean ? sea_beyond(direction, air) : c, vec3(0.86, 0.92, 0.96) * light, 0.55), thin);
    c = mix(c, vec3(0.93, 0.97, 1.0) * light, foam_cover(water.place.xz, foam, level) * (1.0 - 0.5 * thin));
    return ocean ? mix(c, air, 1.0 - exp(-0.0035 * max(far - 6.0, 0.0))) : c;
}
