#version 430
// A mesh for depth and labels; u_push_m moves its depth away from the camera, so that roots show.

uniform mat4 u_clip_from_head;
uniform vec3 u_forward;
uniform float u_push_m;

in vec3 in_position;

void main() {
    vec4 clip = u_clip_from_head * vec4(in_position, 1.0);
    vec4 pushed = u_clip_from_head * vec4(in_position + u_push_m * u_forward, 1.0);
    gl_Position = vec4(clip.xy, pushed.z / pushed.w * clip.w, clip.w);
}
