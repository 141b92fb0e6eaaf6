#version 430
// Velocity of gusty air at the nodes, world: the mean and plane waves (see hairkit/simulation/wind.py),
// evaluated at every fourth node and interpolated between.
#include "pbd_layout.glsl"
layout(rgba32f, binding = 0) writeonly uniform image2D u_new_wind;
uniform vec3 u_mean;             // m/s
uniform vec4 u_waves[WAVES];     // wave vectors, rad/m, head axes; phases, rad
uniform vec4 u_amplitudes[WAVES];  // m/s, world
const int APART = 4;

vec3 air(int rod, int j) {
    vec4 at = vec4(node_place(rod, j).xyz, 1.0);
    vec3 sum = u_mean;
    for (int i = 0; i < WAVES; i++) sum += cos(dot(u_waves[i], at)) * u_amplitudes[i].xyz;
    return sum;
}

void main() {
    int rod = invocation();
    if (rod >= u_rods) return;
    vec3 before = air(rod, 0);
    for (int first = 0; first < u_nodes - 1; first += APART) {
        int last = min(first + APART, u_nodes - 1);
        vec3 after = air(rod, last);
        for (int j = first; j <= last; j++) {
            vec3 mixed = mix(before, after, float(j - first) / float(last - first));
            imageStore(u_new_wind, texel(rod, j, NODES), vec4(mixed, 0.0));
        }
        before = after;
    }
}
