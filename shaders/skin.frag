#version 430
#include "skin.glsl"

in vec3 v_position;
in vec3 v_normal;
in vec3 v_albedo;
out vec4 out_colour;

void main() {
    vec3 normal = normalize(v_normal);
    normal *= gl_FrontFacing ? -1.0 : 1.0;   // pictures are drawn upside down, which swaps the winding
    out_colour = vec4(skin(v_position, normal, v_albedo), 1.0);
}
