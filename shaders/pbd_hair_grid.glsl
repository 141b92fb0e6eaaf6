// The hair grid (see plugins/pbd/hair_grid.py): integer sums, which do not depend on their order. The
// unit of mass is such that all hair together does not overflow.
layout(std430, binding = 0) buffer Filled { int filled[]; };  // mass and momentum of a cell

uniform ivec3 u_cells;
uniform vec4 u_grid;          // place of the first cell, 1/spacing
uniform vec4 u_drift[3];      // velocity of a point fixed to the head
uniform float u_momentum;     // units of momentum in a unit of mass at 1 m/s
const float FASTEST = 10.0;   // bound of a velocity component, m/s

vec3 drift(vec3 p) {
    vec4 at = vec4(p, 1.0);
    return vec3(dot(u_drift[0], at), dot(u_drift[1], at), dot(u_drift[2], at));
}

// The cell of a point and the fractions within it.
ivec3 corner_of(vec3 p, out vec3 share) {
    vec3 at = clamp((p - u_grid.xyz) * u_grid.w, vec3(0.0), vec3(u_cells) - 1.001);
    ivec3 low = ivec3(at);
    share = at - vec3(low);
    return low;
}

ivec3 corner(int i) { return ivec3(i >> 2 & 1, i >> 1 & 1, i & 1); }
vec3 parts(vec3 share, ivec3 at) { return mix(1.0 - share, share, vec3(at)); }
