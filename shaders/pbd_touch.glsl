// Nodes out of the obstacles with friction, then the lengths again. Part of pbd_substeps.comp.
const float FURTHER = 1.05;       // slack wears off a little faster than the way that a node goes
const float DIAGONAL = 1.8;       // a distance changes by less within a cell, in cells

// Distances at the four corners of a cell's face across x, along (z, y): a texel holds them all.
vec4 face(ivec3 cell) { return texelFetch(u_distances, cell.zyx, 0); }

// Trilinear distance and its direction; one look tells most nodes that they are far.
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

// Restore the lengths; a node at an obstacle moves only along it, square to its normal.
void relengthen(vec3 normal[NODE_ROOM]) {
    vec3 end_before = vec3(0.0);
    for (int j = 0; j < EACH_SEGMENT; j++) {
        vec3 way = place[j + 1] - place[j];
        float reach = length(way);
        direction[j] = way / reach;
        float a = dot(normal[j], direction[j]), b = dot(normal[j + 1], direction[j]);
        float ease = rates[j].w, ease_after = rates[j + 1].w;
        vec3 start = ease * (direction[j] - a * normal[j]);
        vec3 end = ease_after * (direction[j] - b * normal[j + 1]);
        pivot[j] = dot(direction[j], start + end) + SOFTEST * (ease + ease_after);
        beside[j] = -dot(end_before, direction[j]);
        value[j] = reach - banded[j].w;
        end_before = end;
    }
    solve_tridiagonal();
    for (int j = 0; j < EACH_NODE; j++) {
        vec3 pull = vec3(0.0);
        if (j > 0) pull -= value[j - 1] * direction[j - 1];
        if (j < SEGMENTS) pull += value[j] * direction[j];
        vec3 change = rates[j].w * (pull - dot(pull, normal[j]) * normal[j]);
        place[j] += change;
        speed[j] += change / u_seconds;
    }
}

// Bring a node out of the obstacles; return their normal where it touches, else 0. A node is looked
// up again only when it may have gone as far as it was away the last time.
vec3 touched(int k, int j) {
    vec3 p = place[j], relative = speed[j] - drift(k, p), normal = vec3(0.0);
    float clear = rates[j].z, left = slack[j] - FURTHER * u_seconds * length(relative);
    if (left <= 0.0) {
        left = obstacle_distance(p, clear, normal) - clear;
        float across = dot(relative, normal), inward = max(-across, 0.0);
        // what came in during this substep goes out again; older depth leaves at a limited speed
        float depth = min(-left, (inward + u_fastest) * u_seconds);
        vec3 along = relative - across * normal;
        float size = length(along);
        vec3 brake = along * (min(u_friction * inward, size) / max(size, 1e-12));
        if (left < 0.0) {
            speed[j] += inward * normal - brake;
            place[j] += depth * normal - u_seconds * brake;
        } else {
            normal = vec3(0.0);
        }
    }
    slack[j] = left;
    return normal;
}

void touch(int k) {
    vec3 normal[NODE_ROOM];
    for (int j = 0; j < EACH_NODE; j++) {
        normal[j] = vec3(0.0);
        if (j > 0) normal[j] = touched(k, j);
    }
    relengthen(normal);
}
