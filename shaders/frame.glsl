// Numbers of one image; filled by render/frame.c (FrameBlock in render/pass.h says what they are).
const int RIPPLE_LAYERS = 4;
const float NO_DEPTH = 1e4; // residual depth where no fluid is
layout(std140) uniform Frame {
    mat4 view, projection, camera;
    vec4 eye, lens, size, fluid_size, sun, sphere, edge_box, foam_box, edge, ground;
    vec4 ripple[RIPPLE_LAYERS], ripple_turn[RIPPLE_LAYERS];
    vec4 field;
};

// The ray through a point of the image, uv in 0..1, in the eye's frame; its length is that of depth 1.
vec3 eye_ray(vec2 uv) {
    return vec3((uv * 2.0 - 1.0) * lens.xy, -1.0);
}

vec3 local_ray(vec2 uv) {
    return mat3(camera) * eye_ray(uv);
}

// Depth at which a local ray meets still water, the reference of the fluid's depth; the farthest that counts where it does
// not. In a tank, which is looked at from all sides, the reference is the eye.
float plane_depth(vec3 ray) {
    float depth = abs(ray.y) > 1e-4 ? (eye.w - eye.y) / ray.y : sun.w;
    depth = depth > 0.0 ? min(depth, sun.w) : sun.w;
    return edge.z > 0.0 ? depth : 0.0;
}

// Eye depth of a depth buffer's value.
float mesh_depth(float depth) {
    return 2.0 * lens.z * lens.w / (lens.w + lens.z - (2.0 * depth - 1.0) * (lens.w - lens.z));
}
