#version 430

uniform mat4 u_clip_from_head;
uniform vec3 u_forward;
uniform float u_push_m;

in vec3 in_position;
in vec3 in_normal;
in vec3 in_colour;
in vec2 in_uv;

out vec3 v_position;
out vec3 v_normal;
out vec3 v_albedo;
out vec2 v_uv;

void main() {
    vec4 clip = u_clip_from_head * vec4(in_position, 1.0);
    vec4 pushed = u_clip_from_head * vec4(in_position + u_push_m * u_forward, 1.0);
    gl_Position = vec4(clip.xy, pushed.z / pushed.w * clip.w, clip.w);
    v_position = in_position;
    v_normal = in_normal;
    v_albedo = in_colour;
    v_uv = in_uv;
}
