// Signed distance to the obstacles in the head's axes: trilinear between the values of a grid.
uniform sampler3D u_distances; // along z, y, x
uniform bool u_obstacles;      // false: there are none
uniform ivec3 u_cells;         // of the distances
uniform vec4 u_grid;           // place of the first distance, 1/spacing
uniform float u_room;          // least distance outside the grid, m
const float DIAGONAL = 1.8;    // bound of the change of distance within a cell, in cells

// Distances at the four corners of a cell's face across x, along (z, y): a texel holds them all.
vec4 face(ivec3 cell) { return texelFetch(u_distances, cell.zyx, 0); }

// Trilinear distance and its direction; one lookup rejects most far nodes.
float obstacle_distance(vec3 p, float clear, out vec3 normal) {
    vec3 at = (p - u_grid.xyz) * u_grid.w;
    normal = vec3(0.0);
    if (any(lessThan(at, vec3(0.0))) || any(greaterThan(at, vec3(u_cells - 1)))) return clear + u_room;
    ivec3 low = min(ivec3(at), u_cells - 2);
    vec4 front = face(low);
    float least = front.x - DIAGONAL / u_grid.w;
    if (least > clear) return least;
    vec3 t = at - vec3(low);
    vec4 back = face(low + ivec3(1, 0, 0)), across = mix(front, back, t.x), slope = back - front;
    vec2 line = mix(across.xz, across.yw, t.z), steep = mix(slope.xz, slope.yw, t.z);
    vec2 deep = across.yw - across.xz;
    vec3 way = vec3(mix(steep.x, steep.y, t.y), line.y - line.x, mix(deep.x, deep.y, t.y));
    normal = way / max(length(way), 1e-12);
    return mix(line.x, line.y, t.y);
}
