#version 430
// Strands thinner than a sample cover it by chance: stochastic transparency (Enderton et al. 2010), which
// needs no order.

in vec4 v_colour;
out vec4 out_colour;

// A random number in [0, 1] of a sample and a piece of a strand: PCG3D (Jarzynski and Olano 2020).
float random_of(uvec3 v) {
    v = v * 1664525u + 1013904223u;
    v.x += v.y * v.z; v.y += v.z * v.x; v.z += v.x * v.y;
    v ^= v >> 16u;
    v.x += v.y * v.z;
    return float(v.x) / 4294967295.0;
}

void main() {
    if (v_colour.a < random_of(uvec3(gl_FragCoord.xy, gl_PrimitiveID))) discard;
    out_colour = vec4(v_colour.rgb, 1.0);
}
