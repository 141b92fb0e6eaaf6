#version 430
// Light volume: transmittance towards key and rim light, visible share of the sky; light_cpu.py is its
// twin. A dispatch computes every `u_turns`-th layer, and only cells near hair or meshes.

layout(local_size_x = 8, local_size_y = 8) in;
layout(rgba16f, binding = 0) writeonly uniform image3D u_transmittance;

uniform sampler3D u_extinction;      // optical depth per metre
uniform ivec3 u_cells;
uniform float u_spacing;        // metres
uniform vec3 u_key_direction;
uniform vec3 u_rim_direction;
uniform int u_turn;
uniform int u_turns;

#constants hairkit.viewer.draw.light_cpu STEPS GROWTH SKY_STEPS SKY_GROWTH START

float extinction(vec3 cell) { return textureLod(u_extinction, (cell + 0.5) / vec3(u_cells), 0.0).r; }

float towards(vec3 cell, vec3 direction, float growth, int steps) {
    float near = START, length = 1.0, depth = 0.0;
    for (int i = 0; i < steps; i++) {
        depth += extinction(cell + (near + 0.5 * length) * direction) * length;
        near += length;
        length *= growth;
    }
    return exp(-depth * u_spacing);
}

void main() {
    ivec3 cell = ivec3(gl_GlobalInvocationID.xy, int(gl_GlobalInvocationID.z) * u_turns + u_turn);
    if (any(greaterThanEqual(cell, u_cells))) return;
    vec3 at = vec3(cell);
    float near = extinction(at) + extinction(at + vec3(1, 1, 0)) + extinction(at - vec3(1, 1, 0))
               + extinction(at + vec3(1, -1, 1)) + extinction(at - vec3(1, -1, 1))
               + extinction(at + vec3(0, 1, -1)) + extinction(at - vec3(0, 1, -1));
    if (near <= 0.0) {
        imageStore(u_transmittance, cell, vec4(1.0));
        return;
    }
    float sky = 2.0 * towards(at, vec3(0, 1, 0), SKY_GROWTH, SKY_STEPS)
              + towards(at, vec3(1, 0, 0), SKY_GROWTH, SKY_STEPS)
              + towards(at, vec3(-1, 0, 0), SKY_GROWTH, SKY_STEPS)
              + towards(at, vec3(0, 0, 1), SKY_GROWTH, SKY_STEPS)
              + towards(at, vec3(0, 0, -1), SKY_GROWTH, SKY_STEPS);
    imageStore(u_transmittance, cell, vec4(towards(at, u_key_direction, GROWTH, STEPS),
                                     towards(at, u_rim_direction, GROWTH, STEPS), sky / 6.0, 1.0));
}
