#version 430
// Hair among hair, first: spreads mass and momentum of all nodes to the grid.
#include "pbd_layout.glsl"
#include "pbd_crowd.glsl"

void main() {
    for (int j = 0; j < NODES; j++) {
        int at = node_at(j);
        float mass = masses[(block() * NODES + j) * LANES + lane()];
        if (mass == 0.0) continue;  // lanes beyond the last rod
        vec3 p = node_place(at), share;
        vec3 speed = clamp(node_speed(at) - drift(p), -FASTEST, FASTEST) * u_momentum;
        ivec3 low = corner_of(p, share);
        for (int i = 0; i < 8; i++) {
            vec3 part = parts(share, corner(i));
            float weight = mass * part.x * part.y * part.z;
            int cell = 4 * cell_of(low + corner(i));
            ivec3 momentum = ivec3(round(weight * speed));
            atomicAdd(filled[cell], int(round(weight)));
            if (momentum.x != 0) atomicAdd(filled[cell + 1], momentum.x);
            if (momentum.y != 0) atomicAdd(filled[cell + 2], momentum.y);
            if (momentum.z != 0) atomicAdd(filled[cell + 3], momentum.z);
        }
    }
}
