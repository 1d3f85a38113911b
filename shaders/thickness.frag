// Thickness and foam of one particle, added up by blending.
flat in vec2 amount;
layout(location = 0) out vec2 sum;

void main() {
    vec2 u = gl_PointCoord * 2.0 - 1.0;
    sum = amount * max(0.0, 1.0 - dot(u, u));
}
