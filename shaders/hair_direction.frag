#version 430
// 2D direction of the strand (y down), its axial depth in metres, and 1 where there is hair.

in vec2 v_direction;
in float v_depth;
out vec4 out_measured;

void main() { out_measured = vec4(normalize(v_direction), v_depth, 1.0); }
