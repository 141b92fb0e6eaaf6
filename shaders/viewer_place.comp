#version 430
// Interpolates hair: each segment keeps its length and is rotated as three guides are, see
// place_kernels.py. Also splats the segments into view cells, which `viewer_opacity.comp` accumulates.
#include "viewer_hair.glsl"

layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly buffer Guides { uint guides[]; };
layout(std430, binding = 1) readonly buffer Hairs { uint hairs[]; };        // 3 words per strand
layout(std430, binding = 2) readonly buffer Edges { uint edges[]; };        // 2 words per point
layout(std430, binding = 3) writeonly buffer Places { float places[]; };    // 3 words per point
layout(std430, binding = 4) buffer Filled { uint filled[]; };

#constants hairkit.viewer.draw.place_kernels PARTED TOGETHER

uint guide_word(uint guide, int k, int word) { return guides[3 * (int(guide) * u_points + k) + word]; }

vec3 guide_root(uint guide) {
    return vec3(uintBitsToFloat(guide_word(guide, 0, 0)), uintBitsToFloat(guide_word(guide, 0, 1)),
                uintBitsToFloat(guide_word(guide, 0, 2)));
}

vec4 guide_turn(uint guide, int k) {
    return vec4(unpackSnorm2x16(guide_word(guide, k, 0)), unpackSnorm2x16(guide_word(guide, k, 1)));
}

float guide_stretch(uint guide, int k) { return uintBitsToFloat(guide_word(guide, k, 2)); }

vec4 shared_turn(vec4 nearest, vec4 other) {
    float along = dot(nearest, other);
    return smoothstep(PARTED, TOGETHER, abs(along)) * sign(along) * other;
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
    vec3 place;
    for (int k = 0; k < u_points; k++) {
        int index = strand * u_points + k;
        vec2 far = unpackHalf2x16(edges[2 * index + 1]);
        vec3 edge = 0.001 * vec3(unpackHalf2x16(edges[2 * index]), far.x);
        if (k == 0) {
            place = weight.x * guide_root(a) + weight.y * guide_root(b)
                  + (1.0 - weight.x - weight.y) * guide_root(c) + edge;
        } else {
            vec4 nearest = guide_turn(a, k);
            vec4 turn = weight.x * nearest + weight.y * shared_turn(nearest, guide_turn(b, k))
                      + (1.0 - weight.x - weight.y) * shared_turn(nearest, guide_turn(c, k));
            place += guide_stretch(a, k) * turned(normalize(turn), edge);
        }
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
