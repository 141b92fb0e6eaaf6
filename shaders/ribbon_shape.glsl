// Shapes one point of a ribbon.
#include "ribbon.glsl"

layout(local_size_x = 64) in;

struct StrandPoint {
    vec4 position;  // xyz head frame in metres; w arc length over strand length, 0 root, 1 tip
    vec4 look;      // diameter in metres; the strand's random number in [0, 1); its packed colour; unused
};

layout(std430, binding = 0) readonly buffer StrandPoints { StrandPoint strand_points[]; };
layout(std430, binding = 1) writeonly buffer RibbonPoints { RibbonPoint ribbon_points[]; };

uniform mat4 u_clip_from_head;
uniform vec3 u_forward;         // optical axis, head frame
uniform float u_depth_offset;   // depth of the head frame's origin, metres
uniform vec2 u_size_px;
uniform float u_focal_px;
uniform float u_perspective;    // 1 perspective, 0 orthographic
uniform float u_min_width_px;
uniform uint u_count;           // of strand points

vec2 pixel_of(vec4 clip) { return (clip.xy / clip.w * 0.5 + 0.5) * u_size_px; }

// `cover` is the share of the ribbon that the strand covers: ribbons have a least width.
RibbonPoint shaped(uint index, StrandPoint point, out vec3 tangent, out float cover) {
    vec3 before = strand_points[point.position.w > 0.0 ? index - 1u : index].position.xyz;
    vec3 after = strand_points[point.position.w < 1.0 ? index + 1u : index].position.xyz;
    tangent = normalize(after - before + vec3(0.0, 1e-12, 0.0));

    RibbonPoint r;
    r.clip = u_clip_from_head * vec4(point.position.xyz, 1.0);
    r.depth = dot(u_forward, point.position.xyz) + u_depth_offset;
    vec2 along = pixel_of(u_clip_from_head * vec4(after, 1.0))
               - pixel_of(u_clip_from_head * vec4(before, 1.0));
    along = dot(along, along) > 1e-12 ? normalize(along) : vec2(1.0, 0.0);
    float width_px = point.look.x * u_focal_px / mix(1.0, r.clip.w, u_perspective);
    cover = min(width_px / u_min_width_px, 1.0);
    vec2 edge_px = vec2(-along.y, along.x) * 0.5 * max(width_px, u_min_width_px);
    r.across = edge_px * 2.0 / u_size_px * r.clip.w;
    r.colour = 0u;
    return r;
}
