#version 430
// Optical depth of the hair in front of every slice of the view, a coarse form of deep opacity maps
// (Yuksel and Keyser 2008) along the line of sight. Each tile is smoothed with its neighbours.
#include "viewer_hair.glsl"
#constants hairkit.viewer.draw.place_kernels MIDDLE BESIDE

layout(local_size_x = 64) in;
layout(std430, binding = 4) readonly buffer Filled { uint filled[]; };
layout(r32f, binding = 0) writeonly uniform image3D u_opacity;      // SLICES + 1 layers

float filled_at(ivec2 tile, int slice) {
    tile = clamp(tile, ivec2(0), u_tiles - 1);
    return float(filled[(slice * u_tiles.y + tile.y) * u_tiles.x + tile.x]) / OPACITY_UNIT;
}

void main() {
    int index = int(gl_GlobalInvocationID.x);
    if (index >= u_count) return;
    ivec2 tile = ivec2(index % u_tiles.x, index / u_tiles.x);
    float sum = 0.0;
    for (int slice = 0; slice < SLICES; slice++) {
        imageStore(u_opacity, ivec3(tile, slice), vec4(sum));
        sum += MIDDLE * filled_at(tile, slice)
             + BESIDE * (filled_at(tile + ivec2(1, 0), slice) + filled_at(tile - ivec2(1, 0), slice)
                     + filled_at(tile + ivec2(0, 1), slice) + filled_at(tile - ivec2(0, 1), slice));
    }
    imageStore(u_opacity, ivec3(tile, SLICES), vec4(sum));
}
