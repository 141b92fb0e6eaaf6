#version 430
// Interpolates hair: each point keeps its offset from the mean of three guides, rotated with the nearest
// one. Also splats the segments into view cells, which `viewer_opacity.comp` accumulates.
#include "viewer_hair.glsl"

layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly buffer Guides { uint guides[]; };
layout(std430, binding = 1) readonly buffer Hairs { uint hairs[]; };        // 3 words per strand
layout(std430, binding = 2) readonly buffer Offsets { uint offsets[]; };    // 2 words per point
layout(std430, binding = 3) writeonly buffer Places { float places[]; };    // 3 words per point
layout(std430, binding = 4) buffer Filled { uint filled[]; };

vec3 guide_place(uint guide, int k) {
    int at = 5 * (int(guide) * u_points + k);
    return vec3(uintBitsToFloat(guides[at]), uintBitsToFloat(guides[at + 1]), uintBitsToFloat(guides[at + 2]));
}

vec4 guide_turn(uint guide, int k) {
    int at = 5 * (int(guide) * u_points + k);
    return vec4(unpackSnorm2x16(guides[at + 3]), unpackSnorm2x16(guides[at + 4]));
}

vec3 turned(vec4 q, vec3 v) { return v + 2.0 * cross(q.xyz, cross(q.xyz, v) + q.w * v); }

void fill(vec2 pixel, float depth, float opacity) {
    ivec2 tile = ivec2(floor(pixel / float(TILE)));
    int slice = int((depth - u_slice_range.x) * u_slice_range.y);
    if (any(lessThan(tile, ivec2(0))) || any(greaterThanEqual(tile, u_tiles))) return;
    int cell = (clamp(slice, 0, SLICES - 1) * u_tiles.y + tile.y) * u_tiles.x + tile.x;
    atomicAdd(filled[cell], uint(opacity * OPACITY_UNIT + 0.5));
}

void main() {
    int strand = int(gl_GlobalInvocationID.x);
    if (strand >= u_count) return;
    uint first = hairs[3 * strand];
    uint a = first & 0xFFFFu, b = first >> 16, c = hairs[3 * strand + 1] & 0xFFFFu;
    vec2 weight = unpackUnorm2x16(hairs[3 * strand + 2]);
    Seen last;
    for (int k = 0; k < u_points; k++) {
        int index = strand * u_points + k;
        vec2 far = unpackHalf2x16(offsets[2 * index + 1]);
        vec3 offset = vec3(unpackHalf2x16(offsets[2 * index]), far.x);
        vec3 place = weight.x * guide_place(a, k) + weight.y * guide_place(b, k)
                   + (1.0 - weight.x - weight.y) * guide_place(c, k)
                   + 0.001 * turned(guide_turn(a, k), offset);
        places[3 * index] = place.x;
        places[3 * index + 1] = place.y;
        places[3 * index + 2] = place.z;
        Seen s = seen_from(place);
        if (k > 0 && s.depth > 0.0 && last.depth > 0.0) {
            float width = 0.001 * far.y * u_wider * s.scale;
            float opacity = 0.5 * length(s.pixel.xy - last.pixel.xy) * width / float(TILE * TILE);
            vec3 near_end = mix(last.pixel, s.pixel, 0.25), far_end = mix(last.pixel, s.pixel, 0.75);
            fill(near_end.xy, mix(last.depth, s.depth, 0.25), opacity);
            fill(far_end.xy, mix(last.depth, s.depth, 0.75), opacity);
        }
        last = s;
    }
}
