#version 430
// Extinction of hair and meshes in each cell, per metre.

layout(local_size_x = 8, local_size_y = 8) in;
layout(std430, binding = 0) readonly buffer Dense { uint dense[]; };
layout(std430, binding = 1) readonly buffer Solids { float solids[]; };
layout(r32f, binding = 0) writeonly uniform image3D u_taken_image;

uniform ivec3 u_cells;
uniform float u_hair_extinction;  // optical depth per metre, for a micrometre of hair in a cell

void main() {
    ivec3 cell = ivec3(gl_GlobalInvocationID);
    if (any(greaterThanEqual(cell, u_cells))) return;
    int index = (cell.z * u_cells.y + cell.y) * u_cells.x + cell.x;
    imageStore(u_taken_image, cell, vec4(solids[index] + u_hair_extinction * float(dense[index])));
}
