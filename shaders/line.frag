#include "frame.glsl"
in float height;
uniform float mirror;
layout(location = 0) out vec4 color;

void main() {
    if (mirror < 0.0 && height < eye.w)
        discard;
    color = vec4(0.22, 0.31, 0.37, 1.0);
}
