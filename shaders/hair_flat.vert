#version 430
// Ribbons in one colour, for masks.
#include "ribbon.glsl"

void main() { gl_Position = ribbon_vertex().clip; }
