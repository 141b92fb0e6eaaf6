#version 430
#include "ribbon.glsl"

out vec2 v_direction;

void main() {
    Ribbon r = ribbon_vertex();
    v_direction = r.direction_px;
    gl_Position = r.clip;
}
