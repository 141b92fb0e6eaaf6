// Unit quaternions (x, y, z, w) of frames whose third axis is a segment's direction.
#constants hairkit_plugins.rods.frames OPPOSITE

vec4 product(vec4 a, vec4 b) {
    return vec4(a.w * b.xyz + b.w * a.xyz + cross(a.xyz, b.xyz), a.w * b.w - dot(a.xyz, b.xyz));
}

vec3 rotate(vec4 q, vec3 v) { return v + 2.0 * cross(q.xyz, cross(q.xyz, v) + q.w * v); }

vec3 third_axis(vec4 q) {
    return vec3(2.0 * (q.x * q.z + q.w * q.y), 2.0 * (q.y * q.z - q.w * q.x),
                1.0 - 2.0 * (q.x * q.x + q.y * q.y));
}

// Rotate a frame by the shortest arc that brings its third axis to `direction`.
vec4 transport_frame(vec4 q, vec3 direction) {
    vec3 axis = third_axis(q);
    vec4 turn = vec4(cross(axis, direction), max(1.0 + dot(axis, direction), OPPOSITE));
    return normalize(product(turn, q));
}

// The midpoint frame of neighbours, and the axis of the rotation between them times the tangent of a
// quarter of its angle.
vec4 half_way(vec4 before, vec4 after, out vec3 quarter) {
    float cosine = dot(before, after), sign_ = cosine < 0.0 ? -1.0 : 1.0;
    vec3 turn = before.w * after.xyz - after.w * before.xyz + cross(before.xyz, after.xyz);
    quarter = turn * (sign_ / (1.0 + sign_ * cosine));
    return normalize(before + sign_ * after);
}

// Twist about their direction between neighbouring frames: twice the angle of (w, z) of the turn. Four
// times the arc tangent of u, the tangent of a quarter of it, by a continued fraction.
float twist_between(vec4 before, vec4 after) {
    float w = dot(before, after);
    float z = before.w * after.z - before.x * after.y + before.y * after.x - before.z * after.w;
    float size = sqrt(w * w + z * z);
    float u = z / (w < 0.0 ? w - size : w + size);
    return 4.0 * u * (1.0 - u * u / (3.0 + 1.8 * u * u));
}
