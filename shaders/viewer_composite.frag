#version 430
// Hair that was drawn elsewhere, over what stands behind it: pixel on pixel.

uniform sampler2D u_hair;

out vec4 out_colour;            // blended over the picture

void main() { out_colour = texelFetch(u_hair, ivec2(gl_FragCoord.xy), 0); }
