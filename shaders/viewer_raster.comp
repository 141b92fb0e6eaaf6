#version 430
// Shades hair at its points and rasterises the segments into weighted sums for each pixel, in any
// order: colour times weight, and weight, which is the coverage of the pixel times the transmittance of
// the hair before it. Software renderers run compute shaders on all cores, triangle set-up on one.
#include "viewer_hair.glsl"
#include "viewer_accumulation.glsl"
#include "light_volume.glsl"
#include "hair_colour.glsl"
#constants hairkit.viewer.draw.shade_kernels HIDDEN ALL_HIDDEN DENSE
#constants hairkit.viewer.draw.raster_kernels WIDEST

layout(local_size_x = 64) in;
layout(std430, binding = 1) readonly buffer Hairs { uint hairs[]; };
layout(std430, binding = 2) readonly buffer Offsets { uint offsets[]; };
layout(std430, binding = 3) readonly buffer Places { float places[]; };
layout(std430, binding = 5) readonly buffer Colours { uint colours[]; };    // of the guides
layout(std430, binding = 7) buffer Sums { uint sums[]; };   // two per pixel, two 16-bit numbers each

uniform sampler2D u_solid_depth;
uniform sampler3D u_opacity;
uniform ivec2 u_picture;
uniform float u_smooth;         // 1: partial coverage across the stroke; 0: whole pixels, faster

vec3 place_at(int index) { return vec3(places[3 * index], places[3 * index + 1], places[3 * index + 2]); }

float arriving(Seen s) {
    if (s.depth < 0.0) return 0.0;
    float slice = clamp((s.depth - u_slice_range.x) * u_slice_range.y, 0.0, float(SLICES));
    vec3 at = vec3(s.pixel.xy / (float(TILE) * vec2(u_tiles)), (slice + 0.5) / float(SLICES + 1));
    return exp(-DENSE * u_dimming * textureLod(u_opacity, at, 0.0).r);
}

bool hidden_by_solid(vec3 pixel) {
    ivec2 at = clamp(ivec2(pixel.xy), ivec2(0), u_picture - 1);
    return pixel.z > texelFetch(u_solid_depth, at, 0).r;
}

void add(ivec2 pixel, vec4 colour_weight, float dither) {
    uvec4 whole = uvec4(colour_weight * sum_unit() + dither);
    uint index = sum_index(pixel, u_picture.x);
    atomicAdd(sums[index], whole.r << 16 | whole.g);
    atomicAdd(sums[index + 1], whole.b << 16 | whole.a);
}

void stroke(vec3 a, vec3 b, vec4 from, vec4 to, float width, float dither) {
    vec3 middle = mix(a, b, 0.5);
    int hidden = int(hidden_by_solid(a)) + int(hidden_by_solid(middle)) + int(hidden_by_solid(b));
    if (hidden == ALL_HIDDEN) return;
    bool test = hidden > 0;     // depth test each pixel only across a mesh's outline

    vec2 along = b.xy - a.xy;
    bool steep = abs(along.y) > abs(along.x);
    if (steep) { a.xy = a.yx; b.xy = b.yx; along = along.yx; }
    if (along.x < 0.0) {
        vec3 end = a; a = b; b = end;
        vec4 colour = from; from = to; to = colour;
        along = -along;
    }
    ivec2 limit = steep ? u_picture.yx : u_picture;
    int first = max(int(ceil(a.x - 0.5)), 0), last = min(int(ceil(b.x - 0.5)), limit.x);
    float across = min(width * length(along) / max(along.x, 1e-6), WIDEST);   // along the minor axis
    float half_width = 0.5 * max(across, 1.0);
    bool whole = u_smooth < 0.5 && across <= 1.0;
    float pace = 1.0 / max(along.x, 1e-6);
    float t = (float(first) + 0.5 - a.x) * pace;
    vec4 start = vec4(from.rgb * from.a, from.a) * min(across, 1.0);
    vec4 change = vec4(to.rgb * to.a, to.a) * min(across, 1.0) - start;
    float y = a.y + t * along.y, slope = along.y * pace;
    if (whole) {
        for (int x = first; x < last; x++, t += pace, y += slope) {
            int row = int(y);
            if (y < 0.0 || row >= limit.y) continue;
            ivec2 pixel = steep ? ivec2(row, x) : ivec2(x, row);
            if (test && mix(a.z, b.z, t) > texelFetch(u_solid_depth, pixel, 0).r) continue;
            add(pixel, start + t * change, fract(dither + 0.618034 * float(x)));
        }
        return;
    }
    for (int x = first; x < last; x++, t += pace, y += slope) {
        int low = max(int(floor(y - half_width)), 0);
        int high = min(int(floor(y + half_width)), limit.y - 1);
        for (int row = low; row <= high; row++) {
            ivec2 pixel = steep ? ivec2(row, x) : ivec2(x, row);
            if (test && mix(a.z, b.z, t) > texelFetch(u_solid_depth, pixel, 0).r) continue;
            float part = min(y + half_width, float(row + 1)) - max(y - half_width, float(row));
            add(pixel, (start + t * change) * part, fract(dither + 0.618034 * float(x)));
        }
    }
}

vec3 own_colour(int strand, int k) {
    uint first = hairs[3 * strand];
    uint a = first & 0xFFFFu, b = first >> 16, c = hairs[3 * strand + 1] & 0xFFFFu;
    vec2 weight = unpackUnorm2x16(hairs[3 * strand + 2]);
    return weight.x * unpacked(colours[int(a) * u_points + k])
         + weight.y * unpacked(colours[int(b) * u_points + k])
         + (1.0 - weight.x - weight.y) * unpacked(colours[int(c) * u_points + k]);
}

void main() {
    int strand = int(gl_GlobalInvocationID.x);
    if (strand >= u_count) return;
    float random = float(hairs[3 * strand + 1] >> 16) / 65535.0;
    int start = strand * u_points;
    vec3 before = place_at(start), here = before, after;
    Seen last;
    vec4 last_look;
    for (int k = 0; k < u_points; k++) {
        after = k < u_points - 1 ? place_at(start + k + 1) : here;
        Seen s = seen_from(here);
        vec4 look = vec4(0.0, 0.0, 0.0, arriving(s));
        if (look.a > HIDDEN) {
            vec3 tangent = normalize(after - before + vec3(0.0, 1e-12, 0.0));
            look.rgb = seen_colour(here, tangent, own_colour(strand, k), random);
            if (k > 0 && last_look.a > HIDDEN) {
                float width = 0.001 * unpackHalf2x16(offsets[2 * (start + k) + 1]).y * u_wider * s.scale;
                stroke(last.pixel, s.pixel, last_look, look, width, fract(random + float(k) * 0.7548777));
            }
        }
        last = s;
        last_look = look;
        before = here;
        here = after;
    }
}
