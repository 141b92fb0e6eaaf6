#version 430
#include "ribbon_vertex.glsl"

out vec4 v_colour;

void main() {
    RibbonPoint r = ribbon_point();
    v_colour = unpackUnorm4x8(r.colour);
    gl_Position = ribbon_edge(r);
}
