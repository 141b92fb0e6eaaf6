// Constants of a rod, which change with the options only; see CONSTANTS in plugins/rods/block.py. Five rows
// a node: rest place and mass; drag, pull, clearance, 1/mass; of the segment that ends there two lower
// entries and 1/pivot of the banded factor, length; bend, twist, natural twist, 1/length; natural turn.
// After them the metric of the lengths.
const int NODE_ROWS = 5, METRIC_ROW = NODE_ROWS * NODES;
const int PAIRS = SEGMENTS * NODES / 2, QUADS = (PAIRS + 3) / 4, ROWS = METRIC_ROW + QUADS;
uniform sampler2D u_constants;

vec4 constant(int rod, int row) { return texelFetch(u_constants, texel(rod, row, ROWS), 0); }
