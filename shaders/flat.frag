#version 430

uniform vec4 u_colour;
out vec4 out_colour;

void main() { out_colour = u_colour; }
