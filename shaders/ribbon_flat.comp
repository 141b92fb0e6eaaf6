#version 430
// Ribbons without colour, for masks and measurements.
#include "ribbon_shape.glsl"

void main() {
    uint index = gl_GlobalInvocationID.x;
    if (index >= u_count) return;
    vec3 tangent;
    float cover;
    ribbon_points[index] = shaped(index, strand_points[index], tangent, cover);
}
