#version 430
// Hair-hair interaction, pass 1: splat mass and momentum of all nodes to the grid.
#include "pbd_layout.glsl"
#include "pbd_hair_grid.glsl"
uniform sampler2D u_masses;

void main() {
    int i = invocation(), rod = i % u_rods, j = i / u_rods;
    if (j >= NODES) return;
    vec3 p = node_place(rod, j).xyz, share;
    vec3 speed = clamp(node_speed(rod, j).xyz - drift(p), -FASTEST, FASTEST) * u_momentum;
    float mass = texelFetch(u_masses, texel(rod, j, NODES), 0).x;
    ivec3 low = corner_of(p, share);
    for (int k = 0; k < 8; k++) {
        vec3 part = parts(share, corner(k));
        float weight = mass * part.x * part.y * part.z;
        ivec3 at = low + corner(k), momentum = ivec3(round(weight * speed));
        int cell = 4 * ((at.x * u_cells.y + at.y) * u_cells.z + at.z);
        atomicAdd(filled[cell], int(round(weight)));
        if (momentum.x != 0) atomicAdd(filled[cell + 1], momentum.x);
        if (momentum.y != 0) atomicAdd(filled[cell + 2], momentum.y);
        if (momentum.z != 0) atomicAdd(filled[cell + 3], momentum.z);
    }
}
