// Fast approximate anti-aliasing: blurs along edges of luminance [Lottes 2009, FXAA; the console variant].
#include "frame.glsl"
uniform sampler2D source;
in vec2 uv;
layout(location = 0) out vec4 color;

float luminance(vec2 offset) {
    return dot(textureLod(source, uv + offset * size.zw, 0.0).rgb, vec3(0.299, 0.587, 0.114));
}

vec3 tap(vec2 offset) {
    return textureLod(source, uv + offset * size.zw, 0.0).rgb;
}

void main() {
    vec3 middle = tap(vec2(0.0));
    float m = dot(middle, vec3(0.299, 0.587, 0.114));
    float nw = luminance(vec2(-1, -1)), ne = luminance(vec2(1, -1)), sw = luminance(vec2(-1, 1)),
          se = luminance(vec2(1, 1));
    float low = min(m, min(min(nw, ne), min(sw, se))), high = max(m, max(max(nw, ne), max(sw, se)));
    color = vec4(middle, 1.0);
    if (high - low < max(0.03, 0.08 * high))
        return;
    vec2 along = vec2((sw + se) - (nw + ne), (nw + sw) - (ne + se));
    float reduce = max((nw + ne + sw + se) * 0.03125, 1.0 / 128.0);
    along = clamp(along / (min(abs(along.x), abs(along.y)) + reduce), -8.0, 8.0);
    vec3 near = 0.5 * (tap(along * (1.0 / 3.0 - 0.5)) + tap(along * (2.0 / 3.0 - 0.5)));
    vec3 wide = 0.5 * near + 0.25 * (tap(along * -0.5) + tap(along * 0.5));
    float l = dot(wide, vec3(0.299, 0.587, 0.114));
    color.rgb = l < low || l > high ? near : wide;
}
