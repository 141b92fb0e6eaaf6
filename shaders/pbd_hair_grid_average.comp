#version 430
// Hair-hair interaction, pass 2: mean velocity and crowding of each cell; clears the sums.
#include "pbd_layout.glsl"
#include "pbd_hair_grid.glsl"
layout(rgba32f, binding = 0) writeonly uniform image3D u_new_cells;
uniform sampler3D u_uncrowded_mass;    // units of mass
uniform float u_capacity;     // units of mass that a cell's momentum holds
const float MOST = 4.0;       // upper bound of crowding

void main() {
    int cell = invocation();
    if (cell >= u_cells.x * u_cells.y * u_cells.z) return;
    ivec3 at = ivec3(cell % u_cells.z, cell / u_cells.z % u_cells.y, cell / (u_cells.z * u_cells.y));
    int mass = filled[4 * cell];
    vec4 value = vec4(0.0);
    if (mass > 0) {
        vec3 momentum = vec3(filled[4 * cell + 1], filled[4 * cell + 2], filled[4 * cell + 3]);
        float uncrowded_mass = texelFetch(u_uncrowded_mass, at, 0).x;
        if (float(mass) <= u_capacity) value.xyz = momentum / (float(mass) * u_momentum);
        value.w = clamp((float(mass) - uncrowded_mass) / uncrowded_mass, 0.0, MOST);
        for (int i = 0; i < 4; i++) filled[4 * cell + i] = 0;
    }
    imageStore(u_new_cells, at, value);
}
