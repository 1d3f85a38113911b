// A point as a sphere.
flat in vec4 paint;
flat in float centre_depth;
layout(location = 0) out vec4 color;

// In the eye's frame; leaves the corners of the point out.
vec3 sphere_normal() {
    vec2 u = vec2(gl_PointCoord.x * 2.0 - 1.0, 1.0 - gl_PointCoord.y * 2.0);
    float d = dot(u, u);
    if (d > 1.0)
        discard;
    return vec3(u, sqrt(1.0 - d));
}

vec4 sphere_color(vec3 n) {
    vec3 to_sun = mat3(view) * sun.xyz;
    float lit = 0.5 + 0.5 * dot(n, to_sun);
    float shine = pow(max(reflect(-to_sun, n).z, 0.0), 24.0);
    return vec4(paint.rgb * (0.55 + 0.75 * lit * lit) * (0.70 + 0.30 * n.z) + 0.03 + 0.12 * shine, paint.a);
}
