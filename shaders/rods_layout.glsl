// Layout of rods in RGBA float textures: one column per rod, its values row by row; rods beyond u_width
// follow below. NODES is a #define of the host program.
// Software renderers read textures many times faster than buffers.
#constants hairkit_plugins.rods.gl_backend UNROLLED GROUP
const int SEGMENTS = NODES - 1;
// Of each node: place and slack, velocity, acceleration, frame (w, x, y, z) of the segment that ends there.
const int STATE_ROWS = 4 * NODES;
layout(local_size_x = GROUP) in;

// Global index of this invocation; work groups beyond the limit of x continue along y.
int invocation() {
    return int(gl_GlobalInvocationID.x + gl_GlobalInvocationID.y * gl_NumWorkGroups.x * gl_WorkGroupSize.x);
}

// Loops over few nodes have constant bounds, so that compilers unroll them and keep arrays in
// registers. For many nodes that takes minutes, so the bounds are uniforms.
uniform int u_nodes;
#if NODES <= UNROLLED
#define EACH_NODE NODES
#define EACH_SEGMENT SEGMENTS
const int NODE_ROOM = NODES;
#else
#define EACH_NODE u_nodes
#define EACH_SEGMENT (u_nodes - 1)
const int NODE_ROOM = 64;  // indexing shorter arrays compiles to a chain of branches
#endif
const int SEGMENT_ROOM = NODE_ROOM - 1;
#define FOURS(count) (((count) + 3) / 4)

uniform sampler2D u_state;
uniform int u_rods;
uniform int u_width;

ivec2 texel(int rod, int row, int rows) { return ivec2(rod % u_width, rod / u_width * rows + row); }
vec4 state(int rod, int row) { return texelFetch(u_state, texel(rod, row, STATE_ROWS), 0); }
vec4 frame_before(int rod, int j) { return state(rod, 4 * j + 3).yzwx; }
