// Meshes: paint by material, sun and sky.
#include "frame.glsl"
#include "sky.glsl"
in vec3 own;
in vec3 place;
in vec3 normal;
in vec3 own_normal;
flat in vec3 own_color;
uniform int material;   // GfxMaterialKind
uniform int has_colors; // 1: the triangles' own
uniform vec4 paint;     // colour
uniform vec4 heights;   // hull: waterline, cabin from, to
uniform float mirror;
layout(location = 0) out vec4 color;

const int PAINT = 0, HULL = 1, STONE = 2, TANK = 3;

float hash(vec2 p) {
    uvec2 q = uvec2(ivec2(p));
    uint h = q.x * 1664525u + q.y * 1013904223u;
    h = (h ^ (h >> 15)) * 2246822519u;
    return float((h ^ (h >> 13)) >> 8 & 0xffffu) * (1.0 / 65536.0);
}

// Lines of the given width every `pitch` metres, softened by the size of a pixel: 1 on a line.
float joints(float x, float pitch, float width) {
    float d = abs(fract(x / pitch + 0.5) - 0.5) * pitch, soft = fwidth(x);
    return (1.0 - smoothstep(width, width + soft, d)) * clamp(1.5 - 2.0 * soft / pitch, 0.0, 1.0);
}

// The two coordinates along a face: the axis nearest to its normal is left out.
vec2 along_face(vec3 p, vec3 n) {
    vec3 a = abs(n);
    return a.y > max(a.x, a.z) ? p.xz : a.x > a.z ? p.zy : p.xy;
}

// A boat's paint, by height above its own keel's axes and by slope.
vec4 hull_paint() {
    float y = own.y - heights.x;
    vec3 base = paint.rgb;
    float gloss = 0.35;
    bool flat_face = own_normal.y > 0.75;
    bool roof = own.y > mix(heights.y, heights.z, 0.8);
    bool flared = own_normal.y < -0.02; // hulls flare at the bow, cabins do not
    if (heights.z > heights.y && own.y > heights.y && (roof || !(flat_face || flared))) {
        float part = (own.y - heights.y) / (heights.z - heights.y);
        base = vec3(0.80, 0.16, 0.10);
        if (part > 0.42 && part < 0.82 && own_normal.y < 0.6) {
            base = vec3(0.05, 0.08, 0.11);
            gloss = 1.0;
        }
    } else if (flat_face && y > 0.0) {
        float plank = floor(own.z / 0.055);
        base = vec3(0.60, 0.41, 0.23) * (0.90 + 0.16 * hash(vec2(plank, 3.0)));
        base = mix(base, vec3(0.22, 0.14, 0.08), 0.7 * joints(own.z, 0.055, 0.003));
        gloss = 0.12;
    } else if (y < 0.0) {
        base = vec3(0.46, 0.09, 0.07);
        gloss = 0.15;
    } else if (y < 0.045) {
        base = vec3(0.93, 0.92, 0.88);
    }
    return vec4(base, gloss);
}

vec4 stone() {
    vec2 q = along_face(place + vec3(ground.y, 0.0, ground.z), normal);
    float line = max(joints(q.x, 0.8, 0.008), joints(q.y, 0.4, 0.008));
    float grain = 0.90 + 0.12 * hash(floor(q * 40.0)) + 0.10 * hash(floor(q * vec2(1.25, 2.5)));
    return vec4(paint.rgb * grain * (1.0 - 0.35 * line), 0.03);
}

vec4 tiles(vec3 n) {
    vec2 q = along_face(place + vec3(ground.y, 0.0, ground.z), n);
    float line = max(joints(q.x, 0.1, 0.002), joints(q.y, 0.1, 0.002)) * 0.55;
    line = max(line, 0.9 * max(joints(q.x, 0.5, 0.003), joints(q.y, 0.5, 0.003)));
    float tone = 0.96 + 0.06 * hash(floor(q / 0.1));
    return vec4(mix(paint.rgb * tone, vec3(0.36, 0.48, 0.55), 0.55 * line), 0.15);
}

// Waves leave sides wet above the sea: darker, and shining. 1: wet.
float wetness() {
    float line = place.y - eye.w + 0.025 * sin(9.0 * own.x) + 0.015 * sin(23.0 * own.x + 17.0 * own.z);
    return edge.z > 0.0 && material != TANK && own_normal.y < 0.7 ? 1.0 - smoothstep(0.04, 0.16, line) : 0.0;
}

void main() {
    if (mirror < 0.0 && place.y < eye.w - 0.03)
        discard;
    if (material == TANK && normal.y > 0.9)
        discard; // a lid is of glass
    vec3 n = normalize(normal) * (material == TANK ? -1.0 : 1.0);
    vec4 surface = vec4(has_colors == 1 ? own_color : paint.rgb, 0.3);
    if (material == HULL)
        surface = hull_paint();
    else if (material == STONE)
        surface = stone();
    else if (material == TANK)
        surface = tiles(n);
    float wet = wetness();
    surface = vec4(surface.rgb * (1.0 - 0.30 * wet), surface.w + 0.45 * wet);
    vec3 to_eye = normalize(eye.xyz - place);
    // Light falls into a container through all its walls.
    float lit = material == TANK ? 0.45 + 0.35 * dot(n, sun.xyz) : max(dot(n, sun.xyz), 0.0);
    vec3 ambient = mix(vec3(0.24, 0.34, 0.40), vec3(0.56, 0.66, 0.78), n.y * 0.5 + 0.5);
    vec3 c = surface.rgb * (ambient * 1.04 + vec3(1.0, 0.93, 0.82) * lit * 0.95);
    float facing = 1.0 - max(dot(n, to_eye), 0.0), f = facing * facing;
    c += surface.w * sky(reflect(-to_eye, n)) * (0.05 + 0.65 * f * f * facing);
    c += surface.w * vec3(1.0, 0.92, 0.8) * pow(max(dot(n, normalize(to_eye + sun.xyz)), 0.0), 90.0) * lit;
    color = vec4(c, 1.0);
}
