#version 430
// Root of each guide, and rotation and stretch of its segments since rest. The rotations are those of
// a frame that is carried along the guide without twist (Bishop 1975, "There is more than one way to
// frame a curve").

layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly buffer Rest { float rest[]; };
layout(std430, binding = 1) readonly buffer Now { float now[]; };
layout(std430, binding = 2) writeonly buffer Guides { uint guides[]; };
// 3 words per point: the root, and for each segment to a later point two of its turn and its stretch

uniform int u_points;
uniform int u_count;    // of guides

#constants hairkit.viewer.draw.place_kernels MOST_STRETCH SHORTEST

vec3 rest_at(int i) { return vec3(rest[3 * i], rest[3 * i + 1], rest[3 * i + 2]); }
vec3 now_at(int i) { return vec3(now[3 * i], now[3 * i + 1], now[3 * i + 2]); }

vec4 quaternion_between(vec3 a, vec3 b) {
    vec4 q = vec4(cross(a, b), 1.0 + dot(a, b));
    return dot(q, q) > 1e-8 ? normalize(q) : vec4(0.0, 0.0, 1.0, 0.0);
}

vec4 multiplied(vec4 a, vec4 b) {
    return vec4(a.w * b.xyz + b.w * a.xyz + cross(a.xyz, b.xyz), a.w * b.w - dot(a.xyz, b.xyz));
}

void write_word(int index, int word, uint value) { guides[3 * index + word] = value; }

void main() {
    int guide = int(gl_GlobalInvocationID.x);
    if (guide >= u_count) return;
    int first = guide * u_points;
    vec3 root = now_at(first);
    for (int c = 0; c < 3; c++) write_word(first, c, floatBitsToUint(root[c]));
    vec4 was = vec4(0.0, 0.0, 0.0, 1.0), is = was;
    vec3 before_was, before_is;
    for (int k = 1; k < u_points; k++) {
        vec3 edge_was = rest_at(first + k) - rest_at(first + k - 1);
        vec3 edge_is = now_at(first + k) - now_at(first + k - 1);
        vec3 way_was = normalize(edge_was + vec3(0.0, 1e-12, 0.0));
        vec3 way_is = normalize(edge_is + vec3(0.0, 1e-12, 0.0));
        if (k == 1) before_was = before_is = way_was;
        was = multiplied(quaternion_between(before_was, way_was), was);
        is = multiplied(quaternion_between(before_is, way_is), is);
        vec4 turn = normalize(multiplied(is, vec4(-was.xyz, was.w)));
        float stretch = min(length(edge_is) / max(length(edge_was), SHORTEST), MOST_STRETCH);
        write_word(first + k, 0, packSnorm2x16(turn.xy));
        write_word(first + k, 1, packSnorm2x16(turn.zw));
        write_word(first + k, 2, floatBitsToUint(stretch));
        before_was = way_was;
        before_is = way_is;
    }
}
