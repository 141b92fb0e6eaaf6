// Hair with `u_points` points per strand, head frame; one invocation per strand. Buffers are packed,
// since software renderers fetch them word by word.

#constants hairkit.viewer.draw.place_kernels SLICES TILE OPACITY_UNIT CLOSE
#constants hairkit.rendering.gl_camera NEAREST

uniform mat4 u_clip_from_head;
uniform vec3 u_forward;
uniform float u_depth_offset;
uniform vec2 u_size_px;
uniform float u_focal_px;
uniform float u_perspective;
uniform float u_wider;          // drawn over true width, above 1 for few strands
uniform int u_points;
uniform int u_count;            // of strands
uniform ivec2 u_tiles;
uniform vec2 u_slice_range;     // nearest depth of hair, and slices per metre

struct Seen {
    vec3 place;     // metres
    vec3 pixel;     // x, y (down) in pixels, and depth as in the depth buffer
    float depth;    // along the optical axis, metres; below 0 behind the camera
    float scale;    // pixels per metre at that depth
};

Seen seen_from(vec3 place) {
    vec4 clip = u_clip_from_head * vec4(place, 1.0);
    float depth = dot(u_forward, place) + u_depth_offset;
    vec3 ndc = clip.xyz / max(clip.w, CLOSE);
    bool behind = u_perspective > 0.5 && depth < NEAREST;
    float scale = u_focal_px / mix(1.0, max(depth, CLOSE), u_perspective);
    return Seen(place, vec3((ndc.xy * 0.5 + 0.5) * u_size_px, ndc.z * 0.5 + 0.5),
                behind ? -1.0 : depth, scale);
}
