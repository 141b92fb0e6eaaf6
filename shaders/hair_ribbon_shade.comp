#version 430
// Shapes ribbons and shades their points.
#include "ribbon_shape.glsl"
#include "light_volume.glsl"
#include "hair_colour.glsl"

void main() {
    uint index = gl_GlobalInvocationID.x;
    if (index >= u_count) return;
    vec3 tangent;
    float cover;
    StrandPoint point = strand_points[index];
    RibbonPoint r = shaped(index, point, tangent, cover);
    vec3 own = unpacked(floatBitsToUint(point.look.z));
    r.colour = packUnorm4x8(vec4(seen_colour(point.position.xyz, tangent, own, point.look.y), cover));
    ribbon_points[index] = r;
}
