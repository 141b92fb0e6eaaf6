#version 430
// The guides' points in the world.
#include "pbd_layout.glsl"
#include "pbd_embedding.glsl"
layout(std430, binding = 2) writeonly buffer Points { float points[]; }; // x, y, z
uniform int u_count;
uniform vec4 u_head[3];  // rows of the motion from the head's axes to the world

void main() {
    int i = invocation();
    if (i >= u_count) return;
    vec4 at = vec4(guide_point(i), 1.0);
    points[3 * i] = dot(u_head[0], at);
    points[3 * i + 1] = dot(u_head[1], at);
    points[3 * i + 2] = dot(u_head[2], at);
}
