#version 430
// Hair-hair interaction, pass 3: nodes relax to the mean velocity and leave crowded cells.
#include "pbd_layout.glsl"
#include "pbd_hair_grid.glsl"
layout(rgba32f, binding = 0) writeonly uniform image2D u_new_state;
uniform sampler3D u_means;    // mean velocity and crowding of cells, along z, y, x
uniform vec2 u_rates;         // relaxed share of velocity, push in m/s

void main() {
    int i = invocation(), rod = i % u_rods, j = 1 + i / u_rods;  // roots keep their velocity
    if (j >= NODES) return;
    vec3 p = node_place(rod, j).xyz, speed = node_speed(rod, j).xyz, share;
    vec3 mean = vec3(0.0), slope = vec3(0.0);
    ivec3 low = corner_of(p, share);
    for (int k = 0; k < 8; k++) {
        vec3 part = parts(share, corner(k)), way = 2.0 * vec3(corner(k)) - 1.0;
        vec4 cell = texelFetch(u_means, (low + corner(k)).zyx, 0);
        mean += part.x * part.y * part.z * cell.xyz;
        slope += cell.w * way * part.yxx * part.zzy;
    }
    speed += u_rates.x * (mean - (speed - drift(p))) - u_rates.y * slope;
    imageStore(u_new_state, texel(rod, 2 * j + 1, STATE_ROWS), vec4(speed, 0.0));
}
