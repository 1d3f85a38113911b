// Water in every pixel.
void main() {
    vec3 ray = local_ray(uv);
    float ray_length = length(ray);
    vec3 direction = ray / ray_length, air = haze(direction);
    color = vec4(display(shade(find_water(ray, 0.0), direction, ray_length, air, air)), 1.0);
}
