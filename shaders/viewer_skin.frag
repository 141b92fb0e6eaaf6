#version 430
#include "tone.glsl"
#include "albedo.glsl"

in vec3 v_light;
in vec3 v_specular;
in vec2 v_uv;
out vec4 out_colour;

void main() {
    out_colour = vec4(u_textured > 0.5 ? tone(v_light * picture(v_uv) + v_specular) : v_light, 1.0);
}
