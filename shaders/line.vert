// Edges of a container, drawn a little nearer than its faces.
#include "frame.glsl"
layout(location = 0) in vec3 vertex;
uniform mat4 pose;
uniform float mirror;
out float height;

void main() {
    vec3 place = (pose * vec4(vertex, 1.0)).xyz;
    height = place.y;
    vec4 at = view * vec4(place.x, mirror < 0.0 ? 2.0 * eye.w - place.y : place.y, place.z, 1.0);
    at.xyz *= 0.998;
    gl_Position = projection * at;
}
