#version 430
// Scales a small picture up to the whole frame.

uniform sampler2D u_studio;
uniform vec2 u_size;

out vec4 out_colour;

void main() { out_colour = vec4(texture(u_studio, gl_FragCoord.xy / u_size).rgb, 1.0); }
