// A lit sphere to be blended, at the depth of its centre: without a depth of its own the test comes before shading.
#include "frame.glsl"
#include "sphere.glsl"

void main() {
    color = sphere_color(sphere_normal());
}
