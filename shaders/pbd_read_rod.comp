#version 430
// Copies the state of one rod to a buffer for read-back.
#include "pbd_layout.glsl"
layout(std430, binding = 0) writeonly buffer One { vec4 one[]; };
uniform int u_rod;

void main() {
    int row = invocation();
    if (row < STATE_ROWS) one[row] = state(u_rod, row);
}
