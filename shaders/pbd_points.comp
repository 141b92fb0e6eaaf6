#version 430
// The guides' points, head axes and world: each follows the curve of its rod at its own distance from the
// point before, out of the obstacles (see hairkit.simulation.obstacle_kernels.draw_points). One invocation a rod.
#include "pbd_layout.glsl"
#include "pbd_quaternion.glsl"
#include "pbd_distance.glsl"
struct Guide { vec4 offset, kind; };  // in the frame, share of segment; segment, least distance, length
layout(std430, binding = 0) readonly buffer Guides { Guide guides[]; };
layout(std430, binding = 1) readonly buffer Starts { int starts[]; };
layout(std430, binding = 2) writeonly buffer Local { float local[]; };    // x, y, z, head axes
layout(std430, binding = 3) writeonly buffer Points { float points[]; };  // x, y, z, world
uniform vec4 u_head[3];  // rows of the motion from the head's axes to the world
uniform vec4 u_torso_from_head[3];
const float CHASE = 0.3, TINY = 1e-20;

vec3 node(int rod, int j) { return node_place(rod, j).xyz; }

// On a smooth curve through the nodes (Catmull-Rom), t of the way along segment j.
vec3 on_rod(int rod, int j, float t) {
    vec3 a = node(rod, j), b = node(rod, j + 1);
    vec3 slope_a = j == 0 ? b - a : 0.5 * (b - node(rod, max(j - 1, 0)));
    vec3 slope_b = j == SEGMENTS - 1 ? b - a : 0.5 * (node(rod, min(j + 2, SEGMENTS)) - a);
    return a + (b - a) * (t * t * (3.0 - 2.0 * t)) + t * (1.0 - t) * ((1.0 - t) * slope_a - t * slope_b);
}

// A segment's frame is at its middle.
vec4 frame_at(int rod, int j, float t) {
    vec4 here = segment_frame(rod, j);
    vec4 there = segment_frame(rod, clamp(j + (t < 0.5 ? -1 : 1), 0, SEGMENTS - 1));
    float part = abs(t - 0.5);
    return normalize((1.0 - part) * here + (dot(here, there) < 0.0 ? -part : part) * there);
}

vec3 along(vec3 start, vec3 way, float size) { return start + way * (size / sqrt(dot(way, way) + TINY)); }

void main() {
    int rod = invocation();
    if (rod >= u_rods) return;
    vec3 before = vec3(0.0), place = vec3(0.0), normal;
    bool on_torso;
    for (int i = starts[rod]; i < starts[rod + 1]; i++) {
        vec4 offset = guides[i].offset, kind = guides[i].kind;
        int j = int(kind.x);
        float t = offset.w, least = kind.y, size = kind.z;
        vec3 curve = on_rod(rod, j, t) + rotate(frame_at(rod, j, t), offset.xyz), start = place;
        place = i == starts[rod] ? curve : along(start, curve - before + CHASE * (before - start), size);
        before = curve;
        for (int turn = 0; turn < 3; turn++) {
            float depth = 0.0;
            if (u_obstacles) depth = least - obstacle_distance(place, u_torso_from_head, least, normal, on_torso);
            if (depth > 0.0 && size > 0.0) place = along(start, place + depth * normal - start, size);
        }
        for (int c = 0; c < 3; c++) local[3 * i + c] = place[c];
        for (int c = 0; c < 3; c++) points[3 * i + c] = dot(u_head[c], vec4(place, 1.0));
    }
}
