#version 430

uniform mat4 u_clip_from_head;
uniform float u_pull;       // depth bias of lines, as a share of the depth range

in vec3 in_position;
in vec4 in_colour;
out vec4 v_colour;

void main() {
    gl_Position = u_clip_from_head * vec4(in_position, 1.0);
    gl_Position.z -= u_pull * gl_Position.w;
    v_colour = in_colour;
}
