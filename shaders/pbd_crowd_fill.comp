#version 430
// Hair among hair, first: spreads mass and momentum of all nodes to the grid.
#include "pbd_layout.glsl"
#include "pbd_crowd.glsl"
uniform sampler2D u_masses;

void main() {
    int rod = int(gl_GlobalInvocationID.x);
    if (rod >= u_rods) return;
    // u_nodes, not NODES: compilers would unroll this at length
    for (int j = 0; j < u_nodes; j++) {
        vec3 p = node_place(rod, j).xyz, share;
        vec3 speed = clamp(node_speed(rod, j).xyz - drift(p), -FASTEST, FASTEST) * u_momentum;
        float mass = texelFetch(u_masses, texel(rod, j, NODES), 0).x;
        ivec3 low = corner_of(p, share);
        for (int i = 0; i < 8; i++) {
            vec3 part = parts(share, corner(i));
            float weight = mass * part.x * part.y * part.z;
            ivec3 at = low + corner(i), momentum = ivec3(round(weight * speed));
            int cell = 4 * ((at.x * u_cells.y + at.y) * u_cells.z + at.z);
            atomicAdd(filled[cell], int(round(weight)));
            if (momentum.x != 0) atomicAdd(filled[cell + 1], momentum.x);
            if (momentum.y != 0) atomicAdd(filled[cell + 2], momentum.y);
            if (momentum.z != 0) atomicAdd(filled[cell + 3], momentum.z);
        }
    }
}
