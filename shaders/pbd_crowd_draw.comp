#version 430
// Hair among hair, third: nodes take on their neighbours' velocity and leave crowded places.
#include "pbd_layout.glsl"
#include "pbd_crowd.glsl"

void main() {
    for (int j = 1; j < NODES; j++) {
        int at = node_at(j);
        vec3 p = node_place(at), speed = node_speed(at), share;
        vec3 mean = vec3(0.0), slope = vec3(0.0);
        ivec3 low = corner_of(p, share);
        for (int i = 0; i < 8; i++) {
            vec3 part = parts(share, corner(i)), way = 2.0 * vec3(corner(i)) - 1.0;
            vec4 cell = cells[cell_of(low + corner(i))];
            mean += part.x * part.y * part.z * cell.xyz;
            slope += cell.w * way * part.yxx * part.zzy;
        }
        speed += u_rates.x * (mean - (speed - drift(p))) - u_rates.y * slope;
        set_node(at + SPEED * LANES, speed);
    }
}
