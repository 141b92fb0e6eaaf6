#version 430
// The studio: a grey background with a floor and a soft shadow of the head.

uniform vec2 u_size;            // pixels of this picture
uniform vec3 u_eye;             // world
uniform mat3 u_ray_from_place;  // world direction of the ray through (x, y, 1) as fractions of the picture
uniform vec3 u_wall_top;        // sRGB
uniform vec3 u_wall_bottom;
uniform float u_floor;          // height of the floor, world
uniform float u_shadow_radius;
uniform float u_shaded;         // 0: the same colour everywhere

out vec4 out_colour;

void main() {
    vec2 place = gl_FragCoord.xy / u_size;
    vec3 way = normalize(u_ray_from_place * vec3(place, 1.0));
    vec3 wall = mix(u_wall_bottom, u_wall_top, smoothstep(-0.5, 0.7, way.y));
    vec2 off = place - 0.5;
    wall *= 1.0 - 0.3 * u_shaded * dot(off, off);
    float reach = (u_floor - u_eye.y) / min(way.y, -1e-4);
    vec2 spot = (u_eye + reach * way).xz / u_shadow_radius;
    float shadow = 0.3 * exp(-dot(spot, spot)) + 0.15 * exp(-5.0 * dot(spot, spot));
    float below = u_shaded * smoothstep(0.0, 0.05, -way.y) * step(0.0, reach);
    out_colour = vec4(wall * (1.0 - shadow * below), 1.0);
}
