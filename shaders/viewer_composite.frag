#version 430
// Composites hair drawn into another texture over the picture.

uniform sampler2D u_hair;

out vec4 out_colour;            // blended over the picture

void main() { out_colour = texelFetch(u_hair, ivec2(gl_FragCoord.xy), 0); }
