// Guide points embedded in the rods, head axes (see plugins/pbd/resampling.py).
#include "pbd_quaternion.glsl"
#include "pbd_distance.glsl"
layout(std430, binding = 0) readonly buffer Embedding { ivec2 embedding[]; };  // 64 rod + segment; least distance
layout(std430, binding = 1) readonly buffer Offsets { vec4 offsets[]; }; // in the frame; share of segment

vec3 place(int rod, int j) { return node_place(rod, j).xyz; }

// On a smooth curve through the nodes (Catmull-Rom), t of the way along segment j.
vec3 on_rod(int rod, int j, float t) {
    vec3 a = place(rod, j), b = place(rod, j + 1);
    vec3 slope_a = j == 0 ? b - a : 0.5 * (b - place(rod, max(j - 1, 0)));
    vec3 slope_b = j == SEGMENTS - 1 ? b - a : 0.5 * (place(rod, min(j + 2, SEGMENTS)) - a);
    return a + (b - a) * (t * t * (3.0 - 2.0 * t)) + t * (1.0 - t) * ((1.0 - t) * slope_a - t * slope_b);
}

// A segment's frame is at its middle.
vec4 frame_at(int rod, int j, float t) {
    vec4 here = segment_frame(rod, j);
    vec4 there = segment_frame(rod, clamp(j + (t < 0.5 ? -1 : 1), 0, SEGMENTS - 1));
    float part = abs(t - 0.5);
    return normalize((1.0 - part) * here + (dot(here, there) < 0.0 ? -part : part) * there);
}

// Position of point i, pushed out of the obstacles to its least distance.
vec3 guide_point(int i) {
    int rod = embedding[i].x >> 6, j = embedding[i].x & 63;
    vec4 offset = offsets[i];
    vec3 p = on_rod(rod, j, offset.w) + rotate(frame_at(rod, j, offset.w), offset.xyz), normal;
    if (!u_obstacles) return p;
    float least = intBitsToFloat(embedding[i].y), depth = least - obstacle_distance(p, least, normal);
    return p + max(depth, 0.0) * normal;
}
