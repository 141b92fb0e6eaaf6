#version 430
// Samples between guide points, head axes: guides resampled at shares of their length.
#include "pbd_layout.glsl"
layout(std430, binding = 0) readonly buffer Local { float local[]; };
layout(std430, binding = 1) writeonly buffer Rows { float rows[]; };  // x, y, z
layout(std430, binding = 2) readonly buffer Between { ivec2 between[]; };  // point before; part of the way
uniform int u_count;

void main() {
    int i = invocation();
    if (i >= u_count) return;
    int before = 3 * between[i].x;
    float part = intBitsToFloat(between[i].y);
    for (int c = 0; c < 3; c++) {
        float at = local[before + c];
        rows[3 * i + c] = part > 0.0 ? mix(at, local[before + 3 + c], part) : at;
    }
}
