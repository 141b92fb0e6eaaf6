#version 430
#include "viewer_accumulation.glsl"
#constants hairkit.viewer.draw.raster_kernels CROWDED
// Hair over the picture; clears the sums for the next frame.

layout(std430, binding = 7) buffer Sums { uint sums[]; };

uniform ivec2 u_picture;

out vec4 out_colour;            // blended over the picture

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    uint index = sum_index(pixel, u_picture.x);
    uint blue_weight = sums[index + 1];
    if (blue_weight == 0u) discard;
    uint red_green = sums[index];
    sums[index] = 0u;
    sums[index + 1] = 0u;
    float weight = float(blue_weight & 0xFFFFu);
    vec3 total = vec3(red_green >> 16, red_green & 0xFFFFu, blue_weight >> 16);
    float cover = weight / sum_unit();
    out_colour = vec4(total / max(weight, 1.0), min(cover * (1.0 + CROWDED * cover), 1.0));
}
