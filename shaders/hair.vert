#version 430
#include "ribbon_vertex.glsl"

out vec3 v_colour;

void main() {
    RibbonPoint r = ribbon_point();
    v_colour = unpackUnorm4x8(r.colour).rgb;
    gl_Position = ribbon_edge(r);
}
