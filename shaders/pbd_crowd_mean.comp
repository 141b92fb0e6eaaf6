#version 430
// Hair among hair, second: mean velocity and crowding of each cell; the sums start again at 0.
#include "pbd_layout.glsl"
#include "pbd_crowd.glsl"
const float MOST = 4.0;  // crowding that counts

void main() {
    int cell = int(gl_GlobalInvocationID.x);
    if (cell >= u_cells.x * u_cells.y * u_cells.z) return;
    int mass = filled[4 * cell];
    if (mass == 0) {
        cells[cell] = vec4(0.0);
        return;
    }
    vec3 momentum = vec3(filled[4 * cell + 1], filled[4 * cell + 2], filled[4 * cell + 3]);
    vec3 mean = float(mass) > u_capacity ? vec3(0.0) : momentum / (float(mass) * u_momentum);
    float crowding = clamp((float(mass) - usual[cell]) / usual[cell], 0.0, MOST);
    cells[cell] = vec4(mean, crowding);
    for (int i = 0; i < 4; i++) filled[4 * cell + i] = 0;
}
