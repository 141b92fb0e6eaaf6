#version 430
// A textured card; in_uv runs from the picture's upper left corner.

uniform mat4 u_clip_from_head;

in vec3 in_position;
in vec3 in_normal;
in vec2 in_uv;
out vec3 v_normal;
out vec2 v_uv;

void main() {
    gl_Position = u_clip_from_head * vec4(in_position, 1.0);
    v_normal = in_normal;
    v_uv = in_uv;
}
