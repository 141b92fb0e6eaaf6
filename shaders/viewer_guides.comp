#version 430
// Position of each guide point and rotation of the guide there since rest.

layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly buffer Rest { float rest[]; };
layout(std430, binding = 1) readonly buffer Now { float now[]; };
layout(std430, binding = 2) writeonly buffer Guides { uint guides[]; };   // 5 words per point

uniform int u_points;
uniform int u_count;    // of guide points

vec3 rest_at(int i) { return vec3(rest[3 * i], rest[3 * i + 1], rest[3 * i + 2]); }
vec3 now_at(int i) { return vec3(now[3 * i], now[3 * i + 1], now[3 * i + 2]); }

vec4 quaternion_between(vec3 a, vec3 b) {
    vec4 q = vec4(cross(a, b), 1.0 + dot(a, b));
    return dot(q, q) > 1e-8 ? normalize(q) : vec4(0.0, 0.0, 1.0, 0.0);
}

void place_guide(int index) {
    int k = index % u_points;
    int before = k > 0 ? index - 1 : index;
    int after = k < u_points - 1 ? index + 1 : index;
    vec3 up = vec3(0.0, 1e-12, 0.0);
    vec3 first = normalize(rest_at(after) - rest_at(before) + up);
    vec3 second = normalize(now_at(after) - now_at(before) + up);
    vec4 turn = quaternion_between(first, second);
    vec3 place = now_at(index);
    guides[5 * index] = floatBitsToUint(place.x);
    guides[5 * index + 1] = floatBitsToUint(place.y);
    guides[5 * index + 2] = floatBitsToUint(place.z);
    guides[5 * index + 3] = packSnorm2x16(turn.xy);
    guides[5 * index + 4] = packSnorm2x16(turn.zw);
}

void main() {
    int index = int(gl_GlobalInvocationID.x);
    if (index < u_count) place_guide(index);
}
