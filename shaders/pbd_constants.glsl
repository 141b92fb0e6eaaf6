// What stays the same of a rod until options change; masses are shares of the rod's mean.
// Rows of a rod's constants: its root's frame; of nodes the place at rest and mass, then drag, pull
// to that place, clearance and 1/mass; of elements three, with the mean mass, kg, last in the first; the lengths' metric.
const int NODE_ROW = 1, ELEMENT_ROW = NODE_ROW + 2 * NODES, METRIC_ROW = ELEMENT_ROW + 3 * SEGMENTS;
const int PAIRS = SEGMENTS * NODES / 2, QUADS = (PAIRS + 3) / 4, ROWS = METRIC_ROW + QUADS;
uniform sampler2D u_constants;

vec4 constant(int rod, int row) { return texelFetch(u_constants, texel(rod, row, ROWS), 0); }
