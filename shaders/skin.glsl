// Wrapped diffuse light with a redder terminator, for subsurface scattering, and a soft sheen.
#include "lighting.glsl"
#include "tone.glsl"

uniform vec3 u_eye;
uniform vec3 u_forward;
uniform float u_perspective;
uniform float u_scatter;   // 1 skin, 0 cloth

const vec3 WRAP = vec3(0.28, 0.18, 0.14);   // how far red, green and blue reach past the terminator
const float SHEEN_POWER = 18.0;
const float SHEEN = 0.12;
const float LIFT = 0.007;   // metres above the skin, to avoid self-shadowing in the coarse volume

vec3 lit(vec3 albedo, vec3 normal, vec3 to_eye, vec3 direction, vec3 light) {
    vec3 wrap = WRAP * u_scatter;
    vec3 diffuse = max((dot(normal, direction) + wrap) / (1.0 + wrap), 0.0);
    float sheen = pow(max(dot(normal, normalize(direction + to_eye)), 0.0), SHEEN_POWER);
    return light * (albedo * diffuse + u_scatter * SHEEN * sheen * step(0.0, dot(normal, direction)));
}

vec3 skin_light(vec3 position, vec3 normal, vec3 albedo) {
    vec3 to_eye = u_perspective > 0.5 ? normalize(u_eye - position) : -u_forward;
    vec3 reached = light_at(position + LIFT * normal);
    vec3 light = lit(albedo, normal, to_eye, u_key_direction, u_key_colour * reached.r)
               + lit(albedo, normal, to_eye, u_rim_direction, u_rim_colour * reached.g)
               + albedo * ambient(normal.y) * reached.b;
    return light;
}
