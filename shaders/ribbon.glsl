// Camera-facing ribbons: two vertices a strand point, pulled from a buffer by gl_VertexID.
// Pixels as in hairkit.camera: x right, y down, (0, 0) the outer corner of the first pixel.

struct StrandPoint {
    vec4 position;  // xyz head frame in metres; w arc length over strand length, 0 root, 1 tip
    vec4 look;      // diameter in metres; the strand's random number in [0, 1); rgb packed; unused
};

layout(std430, binding = 0) readonly buffer StrandPoints { StrandPoint strand_points[]; };

uniform mat4 u_clip_from_head;
uniform vec2 u_size_px;
uniform float u_focal_px;
uniform float u_perspective;   // 1 perspective, 0 orthographic
uniform float u_min_width_px;

struct Ribbon {
    StrandPoint point;
    vec3 tangent;       // head frame, unit, root to tip
    vec2 direction_px;  // unit, along the strand in the picture, y down
    float coverage;     // true width over drawn width
    vec4 clip;
};

vec2 pixel_of(vec4 clip) { return (clip.xy / clip.w * 0.5 + 0.5) * u_size_px; }

Ribbon ribbon_vertex() {
    Ribbon r;
    int index = gl_VertexID / 2;
    float side = (gl_VertexID & 1) == 0 ? -0.5 : 0.5;
    r.point = strand_points[index];
    vec3 before = strand_points[r.point.position.w > 0.0 ? index - 1 : index].position.xyz;
    vec3 after = strand_points[r.point.position.w < 1.0 ? index + 1 : index].position.xyz;
    r.tangent = normalize(after - before + vec3(0.0, 1e-12, 0.0));

    r.clip = u_clip_from_head * vec4(r.point.position.xyz, 1.0);
    vec2 along = pixel_of(u_clip_from_head * vec4(after, 1.0))
               - pixel_of(u_clip_from_head * vec4(before, 1.0));
    r.direction_px = dot(along, along) > 1e-12 ? normalize(along) : vec2(1.0, 0.0);

    float depth = mix(1.0, r.clip.w, u_perspective);
    float true_width_px = r.point.look.x * u_focal_px / depth;
    float width_px = max(true_width_px, u_min_width_px);
    r.coverage = true_width_px / width_px;
    vec2 across_px = vec2(-r.direction_px.y, r.direction_px.x) * side * width_px;
    r.clip.xy += across_px * 2.0 / u_size_px * r.clip.w;
    return r;
}
