// Reads the shaped points: even vertices on one edge of the ribbon, odd ones on the other.
#include "ribbon.glsl"

layout(std430, binding = 1) readonly buffer RibbonPoints { RibbonPoint ribbon_points[]; };

RibbonPoint ribbon_point() { return ribbon_points[gl_VertexID >> 1]; }

vec4 ribbon_edge(RibbonPoint r) {
    return r.clip + vec4((gl_VertexID & 1) == 0 ? -r.across : r.across, 0.0, 0.0);
}
