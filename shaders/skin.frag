#version 430
#include "skin.glsl"
#include "albedo.glsl"

in vec3 v_position;
in vec3 v_normal;
in vec3 v_albedo;
in vec2 v_uv;
out vec4 out_colour;

void main() {
    vec3 normal = normalize(v_normal);
    normal *= gl_FrontFacing ? -1.0 : 1.0;   // pictures are drawn upside down, which swaps the winding
    vec3 albedo = v_albedo * picture(v_uv);
    out_colour = vec4(tone(skin_light(v_position, normal, albedo)), 1.0);
}
