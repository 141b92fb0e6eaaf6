// Hair of `u_points` points a strand in the head frame, one invocation a strand. Buffers are packed:
// software renderers fetch them word by word.

const int SLICES = 32;          // of the view's depth, for the hair's opacity
const int TILE = 8;             // pixels along an edge of a cell of that opacity
const float OPACITY_UNIT = 4096.0;

uniform mat4 u_clip_from_head;
uniform vec3 u_forward;
uniform float u_depth_offset;
uniform vec2 u_size_px;
uniform float u_focal_px;
uniform float u_perspective;
uniform float u_wider;          // fewer hairs than on a head are drawn wider
uniform int u_points;
uniform int u_count;            // of strands
uniform ivec2 u_tiles;
uniform vec2 u_slice_range;     // nearest depth of hair, and slices a metre

struct Seen {
    vec3 place;     // metres
    vec3 pixel;     // x, y (down) in pixels, and depth as in the depth buffer
    float depth;    // along the optical axis, metres; below 0 behind the camera
    float scale;    // pixels a metre there
};

Seen seen_from(vec3 place) {
    vec4 clip = u_clip_from_head * vec4(place, 1.0);
    float depth = dot(u_forward, place) + u_depth_offset;
    vec3 ndc = clip.xyz / max(clip.w, 1e-4);
    bool behind = u_perspective > 0.5 && depth < 0.01;
    float scale = u_focal_px / mix(1.0, max(depth, 1e-4), u_perspective);
    return Seen(place, vec3((ndc.xy * 0.5 + 0.5) * u_size_px, ndc.z * 0.5 + 0.5),
                behind ? -1.0 : depth, scale);
}
