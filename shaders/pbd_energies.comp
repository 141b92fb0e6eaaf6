#version 430
// Stretch and energies (see plugins/pbd/energies.py), summed up over a work group.
#include "pbd_layout.glsl"
#include "pbd_quaternion.glsl"
#include "pbd_constants.glsl"
layout(std430, binding = 0) writeonly buffer Sums { vec4 sums[]; };
uniform vec3 u_gravity;  // m/s^2, head axes
shared vec4 parts[gl_WorkGroupSize.x];

// Largest stretch; kinetic, gravity's and elastic energy, joules.
vec4 combine(vec4 a, vec4 b) { return vec4(max(a.x, b.x), a.yzw + b.yzw); }

vec4 of_node(int rod, int j) {
    vec4 rest = constant(rod, NODE_ROW + 2 * j);
    float pull = constant(rod, NODE_ROW + 2 * j + 1).y;
    vec3 away = node_place(rod, j).xyz - rest.xyz, speed = node_speed(rod, j).xyz;
    return rest.w * vec4(0.0, 0.5 * dot(speed, speed), -dot(u_gravity, away), 0.5 * pull * dot(away, away));
}

// Bending and twist energy between the frame before and that of segment j; updates both.
vec4 of_segment(int rod, int j, inout vec4 before, inout vec3 reach_before) {
    float rest = constant(rod, ELEMENT_ROW + 3 * j).w;
    vec4 firmness = constant(rod, ELEMENT_ROW + 3 * j + 1);
    vec3 edge = node_place(rod, j + 1).xyz - node_place(rod, j).xyz, reach = edge / rest, quarter;
    vec4 after = transport_frame(segment_frame(rod, j), normalize(edge));
    vec3 natural = rotate(half_way(before, after, quarter), constant(rod, ELEMENT_ROW + 3 * j + 2).xyz);
    vec3 off = reach - reach_before - natural;
    float twist = twist_between(before, after) - firmness.z;
    before = after;
    reach_before = reach;
    float energy = 0.5 * (firmness.x * dot(off, off) + firmness.y * twist * twist);
    return vec4(abs(length(reach) - 1.0), 0.0, 0.0, energy);
}

vec4 rod_energies(int rod) {
    vec4 sum = vec4(0.0), before = constant(rod, 0);
    vec3 reach = third_axis(before);
    for (int j = 0; j < u_nodes; j++) sum = combine(sum, of_node(rod, j));
    for (int j = 0; j < u_nodes - 1; j++) sum = combine(sum, of_segment(rod, j, before, reach));
    sum.yzw *= constant(rod, ELEMENT_ROW + 2).w;  // the mean mass, kg
    return sum;
}

void main() {
    int rod = invocation(), own = int(gl_LocalInvocationID.x);
    parts[own] = rod < u_rods ? rod_energies(rod) : vec4(0.0);
    for (int half_ = int(gl_WorkGroupSize.x) / 2; half_ > 0; half_ /= 2) {
        barrier();
        if (own < half_) parts[own] = combine(parts[own], parts[own + half_]);
    }
    if (own == 0) sums[gl_WorkGroupID.x + gl_WorkGroupID.y * gl_NumWorkGroups.x] = parts[0];
}
