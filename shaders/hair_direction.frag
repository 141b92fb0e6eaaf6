#version 430
// The strand's direction in the picture (y down) and 1 where hair is.

in vec2 v_direction;
out vec4 out_direction;

void main() { out_direction = vec4(normalize(v_direction), 1.0, 1.0); }
