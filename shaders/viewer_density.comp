#version 430
// Length of hair in each cell of the light volume.

layout(local_size_x = 64) in;
layout(std430, binding = 3) readonly buffer Places { float places[]; };
layout(std430, binding = 0) buffer Dense { uint dense[]; };     // micrometres of hair

uniform int u_points;
uniform int u_count;            // of strands
uniform ivec3 u_cells;
uniform vec3 u_volume_origin;
uniform vec3 u_volume_size;

vec3 place_at(int index) { return vec3(places[3 * index], places[3 * index + 1], places[3 * index + 2]); }

void main() {
    int strand = int(gl_GlobalInvocationID.x);
    if (strand >= u_count) return;
    vec3 last = place_at(strand * u_points);
    for (int k = 1; k < u_points; k++) {
        vec3 here = place_at(strand * u_points + k);
        vec3 middle = 0.5 * (last + here);
        ivec3 cell = ivec3(floor((middle - u_volume_origin) / u_volume_size * vec3(u_cells)));
        if (all(greaterThanEqual(cell, ivec3(0))) && all(lessThan(cell, u_cells)))
            atomicAdd(dense[(cell.z * u_cells.y + cell.y) * u_cells.x + cell.x],
                      uint(distance(last, here) * 1e6));
        last = here;
    }
}
