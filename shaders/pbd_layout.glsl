// How rods lie in buffers: blocks of LANES rods, row after row, the rod in its block last.
// NODES is defined by the program that compiles.
const int LANES = 64;
const int SEGMENTS = NODES - 1;
const int STATE = 7, PLACE = 0, SPEED = 3, SLACK = 6;  // rows of a node
const int FRAME = 4;                                   // rows of a segment: w, x, y, z
layout(local_size_x = 64) in;

layout(std430, binding = 0) buffer Nodes { float nodes[]; };
layout(std430, binding = 1) buffer Frames { float frames[]; };

int block() { return int(gl_WorkGroupID.x); }
int lane() { return int(gl_LocalInvocationID.x); }
int node_at(int j) { return (block() * NODES + j) * STATE * LANES + lane(); }
int frame_at(int j) { return (block() * SEGMENTS + j) * FRAME * LANES + lane(); }

vec3 node_place(int at) { return vec3(nodes[at], nodes[at + LANES], nodes[at + 2 * LANES]); }
vec3 node_speed(int at) { return node_place(at + SPEED * LANES); }

void set_node(int at, vec3 value) {
    nodes[at] = value.x;
    nodes[at + LANES] = value.y;
    nodes[at + 2 * LANES] = value.z;
}

vec4 frame_of(int at) {
    return vec4(frames[at + LANES], frames[at + 2 * LANES], frames[at + 3 * LANES], frames[at]);
}
