#version 430

uniform mat4 u_clip_from_head;

in vec3 in_position;
in vec2 in_uv;
out vec2 v_uv;

void main() {
    gl_Position = u_clip_from_head * vec4(in_position, 1.0);
    v_uv = in_uv;
}
