// Rectangles of an image.
layout(location = 0) in vec2 corner; // 0..1
out vec2 uv;

void main() {
    uv = corner;
    gl_Position = vec4(corner * 2.0 - 1.0, 0.0, 1.0);
}
