// A mesh in its pose, or its mirror image in still water.
#include "frame.glsl"
layout(location = 0) in vec3 vertex;
layout(location = 1) in vec3 vertex_normal;
layout(location = 2) in vec3 vertex_color;
uniform mat4 pose;
uniform float mirror; // -1: reflected in still water
out vec3 own;         // place in the mesh's own frame
out vec3 place;       // local, not mirrored
out vec3 normal;
out vec3 own_normal;
flat out vec3 own_color;

void main() {
    own = vertex;
    own_normal = vertex_normal;
    own_color = vertex_color;
    place = (pose * vec4(vertex, 1.0)).xyz;
    normal = mat3(pose) * vertex_normal;
    gl_Position = projection * view * vec4(place.x, mirror < 0.0 ? 2.0 * eye.w - place.y : place.y, place.z, 1.0);
}
