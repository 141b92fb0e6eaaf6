#version 430
#include "ribbon.glsl"

uniform vec3 u_forward;         // optical axis, head frame
uniform float u_depth_offset;   // depth of the head frame's origin, metres

out vec2 v_direction;
out float v_depth;

void main() {
    Ribbon r = ribbon_vertex();
    v_direction = r.direction_px;
    v_depth = dot(u_forward, r.point.position.xyz) + u_depth_offset;
    gl_Position = r.clip;
}
