#version 430
// Ribbons in one colour, for masks.
#include "ribbon_vertex.glsl"

void main() { gl_Position = ribbon_edge(ribbon_point()); }
