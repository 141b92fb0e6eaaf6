#version 430

uniform sampler2D u_image;
uniform float u_opacity;

in vec2 v_uv;
out vec4 out_colour;

void main() {
    vec4 colour = texture(u_image, v_uv);
    out_colour = vec4(colour.rgb, colour.a * u_opacity);
}
