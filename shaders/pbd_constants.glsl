// Constants of a rod, which change with the options only; masses are relative to the rod's mean.
// Rows: root frame; two per node: rest position and mass, then drag, shape rate, clearance, 1/mass;
// three per element, with the mean mass in kg as the last value of the first; metric of the lengths.
const int NODE_ROW = 1, ELEMENT_ROW = NODE_ROW + 2 * NODES, METRIC_ROW = ELEMENT_ROW + 3 * SEGMENTS;
const int PAIRS = SEGMENTS * NODES / 2, QUADS = (PAIRS + 3) / 4, ROWS = METRIC_ROW + QUADS;
uniform sampler2D u_constants;

vec4 constant(int rod, int row) { return texelFetch(u_constants, texel(rod, row, ROWS), 0); }
