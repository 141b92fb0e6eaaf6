#version 430
// Substeps of rods, one rod an invocation: the steps of plugins/pbd/reference.py in their order.
// Masses are shares of the rod's mean, so that stiffness is in 1/s^2.
#include "pbd_layout.glsl"
#include "pbd_turns.glsl"

const int ROOT = 0;                                     // rows: frame (w, x, y, z), direction
const int NODE = 7, NODE_ROWS = 8;
const int REST = 0, MASS = 3, DRAG = 4, SHAPE = 5, CLEAR = 6, EASE = 7;
const int ELEMENT = NODE + NODES * NODE_ROWS, ELEMENT_ROWS = 11;
const int LENGTH = 0, OVER = 1, BEND = 2, TWIST = 3, CURVE = 4, NATURAL = 7;
const int FIRST = 8, SECOND = 9, PIVOT = 10;            // of the banded factor L D L^T
const int METRIC = ELEMENT + SEGMENTS * ELEMENT_ROWS, METRIC_ROWS = SEGMENTS * NODES / 2;
const float SHARPEST = 0.3, LARGEST_SPIN = 0.3, SOFTEST = 1e-3, SINGULAR = 1e-6;

// What holds for all rods in one substep, head axes after it.
struct Step {
    vec4 ride[3];     // rows of turn and shift from the axes before
    vec4 drift[3];    // rows of velocity of a point that rides on the head: matrix and minus shift
    vec4 air[3];      // rows of the turn from the world's axes, and gravity
    vec4 ride_turn;   // as a quaternion
};
layout(std430, binding = 2) readonly buffer Constants { float constants[]; };
layout(std430, binding = 3) readonly buffer Steps { Step steps[]; };
layout(std430, binding = 4) readonly buffer Distances { float distances[]; };
layout(std430, binding = 5) readonly buffer Air { float air[]; };      // rows x, y, z of a node, world
layout(std430, binding = 6) readonly buffer Force { float forces[]; }; // the same, over mass, head axes

uniform int u_substeps;
uniform int u_iterations;
uniform float u_seconds;       // of a substep
uniform float u_damping;       // 1/s
uniform vec3 u_air;            // m/s, world, where u_gusts is false
uniform bool u_gusts;
uniform bool u_forced;
uniform bool u_obstacles;
uniform float u_friction;
uniform float u_fastest;       // m/s
uniform ivec3 u_cells;         // of the distances
uniform vec4 u_grid;           // place of the first distance, 1/spacing
uniform float u_room;          // m, around the grid without obstacles

vec3 place[NODES], speed[NODES], force[NODES], solved[NODES];
float slack[NODES];
vec4 frame[SEGMENTS];
vec3 edge[SEGMENTS], direction[SEGMENTS];
float pivot[SEGMENTS], beside[SEGMENTS], value[SEGMENTS];

float constant(int row) { return constants[(block() * (METRIC + METRIC_ROWS) + row) * LANES + lane()]; }
float node(int j, int row) { return constant(NODE + j * NODE_ROWS + row); }
float element(int j, int row) { return constant(ELEMENT + j * ELEMENT_ROWS + row); }
vec3 node3(int j, int row) { return vec3(node(j, row), node(j, row + 1), node(j, row + 2)); }
vec3 element3(int j, int row) { return vec3(element(j, row), element(j, row + 1), element(j, row + 2)); }
vec4 root_frame() { return vec4(constant(ROOT + 1), constant(ROOT + 2), constant(ROOT + 3), constant(ROOT)); }
vec3 root_direction() { return vec3(constant(ROOT + 4), constant(ROOT + 5), constant(ROOT + 6)); }
vec3 rows(vec4 a, vec4 b, vec4 c, vec4 v) { return vec3(dot(a, v), dot(b, v), dot(c, v)); }
vec3 ridden(int k, vec4 v) { return rows(steps[k].ride[0], steps[k].ride[1], steps[k].ride[2], v); }
vec3 drift(int k, vec3 p) {
    return rows(steps[k].drift[0], steps[k].drift[1], steps[k].drift[2], vec4(p, 1.0));
}

vec3 pushed(int j) {
    int at = (block() * NODES + j) * 3 * LANES + lane();
    return vec3(forces[at], forces[at + LANES], forces[at + 2 * LANES]);
}

vec3 blown(int j) {
    int at = (block() * NODES + j) * 3 * LANES + lane();
    return u_gusts ? vec3(air[at], air[at + LANES], air[at + 2 * LANES]) : u_air;
}

// Carry a node into the new axes, go on straight, and add up what acts on it.
void predict(int k, int j) {
    vec3 p = ridden(k, vec4(place[j], 1.0)), rest = node3(j, REST);
    vec3 u = j == 0 ? (rest - p) / u_seconds : ridden(k, vec4(speed[j], 0.0));
    p += u_seconds * u;
    vec4 wind = vec4(blown(j), 0.0);
    vec3 drawn = rows(steps[k].air[0], steps[k].air[1], steps[k].air[2], wind) - u;
    vec3 gravity = vec3(steps[k].air[0].w, steps[k].air[1].w, steps[k].air[2].w);
    force[j] = node(j, MASS) * (gravity + node(j, DRAG) * drawn + u_damping * (drift(k, p) - u)
                                + node(j, SHAPE) * (rest - p));
    if (u_forced) force[j] += pushed(j);
    place[j] = p;
    speed[j] = u;
}

// Solve the tridiagonal system that `pivot`, `beside` (j - 1 and j) and `value` hold.
void solve_tridiagonal() {
    for (int j = 1; j < SEGMENTS; j++) {
        float factor = beside[j] / pivot[j - 1];
        pivot[j] -= factor * beside[j];
        value[j] -= factor * value[j - 1];
    }
    value[SEGMENTS - 1] /= pivot[SEGMENTS - 1];
    for (int j = SEGMENTS - 2; j >= 0; j--) value[j] = (value[j] - beside[j + 1] * value[j + 1]) / pivot[j];
}

// Spin frames about their segments until torques balance: one Newton step.
void untwist() {
    vec4 before = root_frame();
    for (int j = 0; j < SEGMENTS; j++) {
        vec4 after = frame[j];
        vec3 quarter, axis = third_axis(before);
        vec3 natural = turned(half_way(before, after, quarter), element3(j, CURVE));
        vec3 turn = direction[j] - axis;
        float bend = element(j, BEND), twist = element(j, TWIST);
        vec3 spun = cross(natural, turn), aside = cross(quarter, spun);
        float torque = twist * (twist_between(before, after) - element(j, NATURAL));
        float firm = 0.25 * bend * max(dot(natural, turn), 0.0);
        pivot[j] = twist + firm;
        beside[j] = firm - twist;
        value[j] = 0.5 * bend * dot(direction[j], spun + aside) - torque;
        if (j > 0) {
            pivot[j - 1] += twist + firm;
            value[j - 1] += 0.5 * bend * dot(axis, spun - aside) + torque;
        }
        before = after;
    }
    solve_tridiagonal();
    for (int j = 0; j < SEGMENTS; j++) {
        // half angles by a rational cosine and sine, as in the reference
        float angle = 0.5 * clamp(value[j], -LARGEST_SPIN, LARGEST_SPIN);
        frame[j] = product(vec4(angle * direction[j], 1.0) / sqrt(1.0 + angle * angle), frame[j]);
    }
}

// Bending and twist as forces on the nodes, minus the energy's slope.
void add_elastic() {
    vec4 before = root_frame();
    vec3 reach_before = root_direction(), pull = vec3(0.0);
    for (int j = 0; j < SEGMENTS; j++) {
        vec4 after = frame[j];
        vec3 quarter, axis = third_axis(before);
        vec3 natural = turned(half_way(before, after, quarter), element3(j, CURVE));
        float bend = element(j, BEND), over = element(j, OVER);
        vec3 reach = edge[j] * over, turn = reach - reach_before;
        vec3 spun = cross(natural, turn), aside = cross(quarter, spun);
        float torque = element(j, TWIST) * (twist_between(before, after) - element(j, NATURAL));
        vec3 twisting = cross(axis, direction[j])
            * (torque / max(1.0 + dot(axis, direction[j]), SHARPEST));
        vec3 moment = bend * (natural - turn);
        if (j > 0) {
            pull += cross(0.5 * bend * (spun - aside), axis) - moment - twisting;
            vec3 done = pull * element(j - 1, OVER);
            force[j - 1] -= done;
            force[j] += done;
        }
        pull = moment - twisting + cross(0.5 * bend * (spun + aside), direction[j]);
        before = after;
        reach_before = reach;
    }
    force[SEGMENTS - 1] -= pull * element(SEGMENTS - 1, OVER);
    force[SEGMENTS] += pull * element(SEGMENTS - 1, OVER);
}

// Write A^-1 force of the free nodes to `solved`.
void solve_banded() {
    vec3 one = vec3(0.0), two = vec3(0.0);
    solved[0] = vec3(0.0);
    for (int j = 1; j < NODES; j++) {
        vec3 here = force[j] - element(j - 1, FIRST) * one - element(j - 1, SECOND) * two;
        two = one;
        one = here;
        solved[j] = here * element(j - 1, PIVOT);
    }
    for (int j = NODES - 2; j > 0; j--) {
        solved[j] -= element(j, FIRST) * solved[j + 1];
        if (j + 2 < NODES) solved[j] -= element(j + 1, SECOND) * solved[j + 2];
    }
}

// Write the pull along the segments that brings them to their lengths to `value`: the factor
// L D L^T of metric * (d d^T), row by row, with its forward substitution.
void solve_lengths() {
    float factor[METRIC_ROWS], scaled[SEGMENTS];
    for (int i = 0; i < SEGMENTS; i++) {
        int base = i * (i + 1) / 2;
        vec3 excess = edge[i] + solved[i + 1] - solved[i];
        float right = dot(excess, direction[i]) - element(i, LENGTH);
        float own = constant(METRIC + base + i), last = own * dot(direction[i], direction[i]);
        for (int j = 0; j < i; j++) {
            int other = j * (j + 1) / 2;
            float here = constant(METRIC + base + j) * dot(direction[i], direction[j]);
            for (int k = 0; k < j; k++) here -= scaled[k] * factor[other + k];
            scaled[j] = here;
            float low = here * pivot[j];
            factor[base + j] = low;
            last -= here * low;
            right -= low * value[j];
        }
        pivot[i] = 1.0 / max(last, SINGULAR * own);
        value[i] = right;
    }
    for (int i = SEGMENTS - 1; i >= 0; i--) {
        value[i] *= pivot[i];
        for (int k = i + 1; k < SEGMENTS; k++) value[i] -= factor[k * (k + 1) / 2 + i] * value[k];
    }
}

// Go on by the solution of forces under the lengths.
void go_on() {
    vec3 free[NODES];
    solve_banded();
    for (int j = 0; j < NODES; j++) free[j] = solved[j];
    for (int iteration = 0; iteration < u_iterations; iteration++) {
        if (iteration > 0)
            for (int j = 0; j < SEGMENTS; j++) {
                direction[j] = normalize(edge[j] + (free[j + 1] - solved[j + 1]) - (free[j] - solved[j]));
            }
        for (int j = 0; j < NODES; j++) solved[j] = free[j];
        solve_lengths();
        for (int j = 0; j < NODES; j++) {
            vec3 pull = j > 0 ? value[j - 1] * direction[j - 1] : vec3(0.0);
            force[j] = j < SEGMENTS ? pull - value[j] * direction[j] : pull;
        }
        solve_banded();
    }
    for (int j = 1; j < NODES; j++) {
        vec3 change = free[j] - solved[j];
        place[j] += change;
        speed[j] += change / u_seconds;
    }
}

#include "pbd_touch.glsl"

void main() {
    for (int j = 0; j < NODES; j++) {
        int at = node_at(j);
        place[j] = node_place(at);
        speed[j] = node_speed(at);
        slack[j] = nodes[at + SLACK * LANES];
    }
    for (int j = 0; j < SEGMENTS; j++) frame[j] = frame_of(frame_at(j));
    for (int k = 0; k < u_substeps; k++) {
        for (int j = 0; j < NODES; j++) predict(k, j);
        for (int j = 0; j < SEGMENTS; j++) {
            edge[j] = place[j + 1] - place[j];
            direction[j] = normalize(edge[j]);
            frame[j] = swung(product(steps[k].ride_turn, frame[j]), direction[j]);
        }
        untwist();
        add_elastic();
        go_on();
        if (u_obstacles) touch(k);
    }
    for (int j = 0; j < NODES; j++) {
        int at = node_at(j);
        set_node(at, place[j]);
        set_node(at + SPEED * LANES, speed[j]);
        nodes[at + SLACK * LANES] = slack[j];
    }
    for (int j = 0; j < SEGMENTS; j++) {
        int at = frame_at(j);
        frames[at] = frame[j].w;
        frames[at + LANES] = frame[j].x;
        frames[at + 2 * LANES] = frame[j].y;
        frames[at + 3 * LANES] = frame[j].z;
    }
}
