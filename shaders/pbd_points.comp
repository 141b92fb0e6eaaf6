#version 430
// The guides' points in the world: they ride on the rods (see plugins/pbd/guides.py).
#include "pbd_layout.glsl"
#include "pbd_turns.glsl"
layout(std430, binding = 0) readonly buffer Rods { int rods[]; };        // rod and segment of a point
layout(std430, binding = 1) readonly buffer Offsets { vec4 offsets[]; }; // in the frame; share of segment
layout(std430, binding = 2) writeonly buffer Points { float points[]; }; // x, y, z
uniform int u_count;
uniform vec4 u_head[3];  // rows of the motion from the head's axes to the world

vec3 place(int rod, int j) { return node_place(rod, j).xyz; }

void main() {
    int i = int(gl_GlobalInvocationID.x);
    if (i >= u_count) return;
    int rod = rods[2 * i], j = rods[2 * i + 1];
    vec4 offset = offsets[i];
    float t = offset.w;
    vec3 a = place(rod, j), b = place(rod, j + 1);
    vec3 slope_a = j == 0 ? b - a : 0.5 * (b - place(rod, max(j - 1, 0)));
    vec3 slope_b = j == SEGMENTS - 1 ? b - a : 0.5 * (place(rod, min(j + 2, SEGMENTS)) - a);
    vec3 p = a + (b - a) * (t * t * (3.0 - 2.0 * t))
        + t * (1.0 - t) * ((1.0 - t) * slope_a - t * slope_b);
    // a segment's frame is at its middle
    vec4 here = segment_frame(rod, j);
    vec4 there = segment_frame(rod, clamp(j + (t < 0.5 ? -1 : 1), 0, SEGMENTS - 1));
    float part = abs(t - 0.5);
    vec4 mixed = (1.0 - part) * here + (dot(here, there) < 0.0 ? -part : part) * there;
    vec4 at = vec4(p + turned(normalize(mixed), offset.xyz), 1.0);
    points[3 * i] = dot(u_head[0], at);
    points[3 * i + 1] = dot(u_head[1], at);
    points[3 * i + 2] = dot(u_head[2], at);
}
