#version 430
#include "lighting.glsl"
#include "tone.glsl"
// Wrapped diffuse light whose edge is redder, as light that travelled under the skin is; a soft sheen.

uniform vec3 u_eye;
uniform vec3 u_forward;
uniform float u_perspective;
uniform float u_scatter;   // 1 skin, 0 cloth

in vec3 v_position;
in vec3 v_normal;
in vec3 v_albedo;
out vec4 out_colour;

const vec3 WRAP = vec3(0.28, 0.18, 0.14);   // how far red, green and blue reach past the terminator
const float SHEEN_POWER = 18.0;
const float SHEEN = 0.12;
const float LIFT = 0.007;   // metres off the skin, out of its own shadow in the coarse volume

vec3 lit(vec3 normal, vec3 to_eye, vec3 direction, vec3 light) {
    vec3 wrap = WRAP * u_scatter;
    vec3 diffuse = max((dot(normal, direction) + wrap) / (1.0 + wrap), 0.0);
    float sheen = pow(max(dot(normal, normalize(direction + to_eye)), 0.0), SHEEN_POWER);
    return light * (v_albedo * diffuse + u_scatter * SHEEN * sheen * step(0.0, dot(normal, direction)));
}

void main() {
    vec3 to_eye = u_perspective > 0.5 ? normalize(u_eye - v_position) : -u_forward;
    vec3 normal = normalize(v_normal);
    normal *= gl_FrontFacing ? -1.0 : 1.0;   // pictures are drawn upside down: fronts turn clockwise
    vec3 reached = light_at(v_position + LIFT * normal);
    vec3 light = lit(normal, to_eye, u_key_direction, u_key_colour * reached.r)
               + lit(normal, to_eye, u_rim_direction, u_rim_colour * reached.g)
               + v_albedo * ambient(normal.y) * reached.b;
    out_colour = vec4(tone(light), 1.0);
}
