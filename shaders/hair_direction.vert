#version 430
#include "ribbon_vertex.glsl"

uniform vec2 u_size_px;

out vec2 v_direction;
out float v_depth;

void main() {
    RibbonPoint r = ribbon_point();
    vec2 across_px = r.across * u_size_px;
    v_direction = normalize(vec2(across_px.y, -across_px.x));
    v_depth = r.depth;
    gl_Position = ribbon_edge(r);
}
