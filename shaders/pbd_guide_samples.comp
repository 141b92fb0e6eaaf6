#version 430
// Samples between guide points, head axes: guides resampled at shares of their length.
#include "pbd_layout.glsl"
#include "pbd_embedding.glsl"
layout(std430, binding = 2) writeonly buffer Rows { float rows[]; };  // x, y, z
layout(std430, binding = 3) readonly buffer Between { ivec2 between[]; };  // point before; part of the way
uniform int u_count;

void main() {
    int i = invocation();
    if (i >= u_count) return;
    int before = between[i].x;
    float part = intBitsToFloat(between[i].y);
    vec3 at = guide_point(before);
    if (part > 0.0) at = mix(at, guide_point(before + 1), part);
    rows[3 * i] = at.x;
    rows[3 * i + 1] = at.y;
    rows[3 * i + 2] = at.z;
}
