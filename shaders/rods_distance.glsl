// Signed distance to head and torso in the head's axes: trilinear between the values of two grids.
uniform sampler3D u_head_distances, u_torso_distances; // along z, y, x
uniform ivec3 u_cells[2];      // of the distances of head and torso; 0 where there is none
uniform vec4 u_grid[2];        // place of the first distance, 1/spacing
const float OFF_GRID = 0.02;   // least distance outside a grid, m
#constants hairkit.simulation.obstacle_kernels DIAGONAL

// Trilinear distance and its direction in a body's axes; one lookup rejects most far nodes.
// A texel holds the distances at the four corners of a cell's face across x, along (z, y).
float body_distance(sampler3D distances, ivec3 cells, vec4 grid, vec3 p, float clear, out vec3 normal) {
    vec3 at = (p - grid.xyz) * grid.w;
    normal = vec3(0.0);
    if (any(lessThan(at, vec3(0.0))) || any(greaterThan(at, vec3(cells - 1)))) return clear + OFF_GRID;
    ivec3 low = min(ivec3(at), cells - 2);
    vec4 front = texelFetch(distances, low.zyx, 0);
    float least = front.x - DIAGONAL / grid.w;
    if (least > clear) return least;
    vec3 t = at - vec3(low);
    vec4 back = texelFetch(distances, low.zyx + ivec3(0, 0, 1), 0);
    vec4 across = mix(front, back, t.x), slope = back - front;
    vec2 line = mix(across.xz, across.yw, t.z), steep = mix(slope.xz, slope.yw, t.z);
    vec2 deep = across.yw - across.xz;
    vec3 way = vec3(mix(steep.x, steep.y, t.y), line.y - line.x, mix(deep.x, deep.y, t.y));
    normal = way / max(length(way), 1e-12);
    return mix(line.x, line.y, t.y);
}

// Distance and direction of the nearer body; `pose` are the rows from the head's axes to the torso's.
float obstacle_distance(vec3 p, vec4 pose[3], float clear, out vec3 normal, out bool on_torso) {
    float found = body_distance(u_head_distances, u_cells[0], u_grid[0], p, clear, normal);
    on_torso = false;
    vec4 place = vec4(p, 1.0);
    vec3 beside = vec3(dot(pose[0], place), dot(pose[1], place), dot(pose[2], place)), away;
    float other = body_distance(u_torso_distances, u_cells[1], u_grid[1], beside, clear, away);
    if (other >= found) return found;
    on_torso = true;
    normal = away.x * pose[0].xyz + away.y * pose[1].xyz + away.z * pose[2].xyz;
    return other;
}
