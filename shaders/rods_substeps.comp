#version 430
// Substeps of rods, one rod per invocation: the steps of plugins/rods/kernels.py in their order. Masses
// are relative to the rod's mean, so that stiffness is in 1/s^2. Loops run over whole arrays with
// conditions inside, so that compilers can unroll them.
#include "rods_layout.glsl"
#include "rods_quaternion.glsl"
#include "rods_constants.glsl"
#include "rods_substep_schedule.glsl"

#constants hairkit_plugins.rods.kernels SHARPEST SPIN TURN CHANGE TINY PASSED DRIFT
#constants hairkit_plugins.rods.linear_system IMPLICIT

layout(rgba32f, binding = 0) writeonly uniform image2D u_new_state;
// Six numbers of each node, in two rows: velocity of the air, world; a force over the rod's mean mass,
// head axes.
uniform sampler2D u_acting;
uniform bool u_even;           // the same acts on all nodes
uniform int u_substeps;         // in this dispatch
uniform float u_seconds;       // of a substep
uniform float u_damping;       // 1/s
uniform float u_friction;
uniform int u_rounds;             // friction iterations under the strands' tension
uniform float u_fastest;       // m/s

int rod;
vec3 place[NODE_ROOM], speed[NODE_ROOM], gain[NODE_ROOM], force[NODE_ROOM], solved[NODE_ROOM];
vec3 held_back;                // force of the root's acceleration on the next node
float slack[NODE_ROOM];
vec4 frame[SEGMENT_ROOM], root_frame;
vec3 edge[SEGMENT_ROOM], direction[SEGMENT_ROOM];
float pivot[SEGMENT_ROOM], beside[SEGMENT_ROOM], value[NODE_ROOM];

// Constants are read where they are used, which saves local memory.
vec4 rest_and_mass(int j) { return constant(rod, NODE_ROWS * j); }
vec4 rates(int j) { return constant(rod, NODE_ROWS * j + 1); }             // drag, pull, clearance, 1/mass
vec4 banded(int j) { return constant(rod, NODE_ROWS * (j + 1) + 2); }      // two lower entries, 1/pivot; length
vec4 stiffness(int j) { return constant(rod, NODE_ROWS * (j + 1) + 3); }   // bend, twist, natural twist, 1/length
vec3 curvature(int j) { return constant(rod, NODE_ROWS * (j + 1) + 4).xyz; }
vec4 metrics;
float next_metric(int pair) {  // called with consecutive pairs
    if (pair % 4 == 0) metrics = constant(rod, METRIC_ROW + pair / 4);
    return metrics[pair % 4];
}

vec3 drift(int k, vec3 p) {
    return rows(steps[k].drift[0], steps[k].drift[1], steps[k].drift[2], vec4(p, 1.0));
}

vec3 torso_drift(int k, vec3 p) {
    return rows(steps[k].torso_drift[0], steps[k].torso_drift[1], steps[k].torso_drift[2], vec4(p, 1.0));
}

// Transform a node to the new axes, extrapolate it, and sum the forces on it.
void predict(int k, int j) {
    vec4 rest = rest_and_mass(j), rate = rates(j);
    vec3 p = to_new_axes(k, vec4(place[j], 1.0)), u = to_new_axes(k, vec4(speed[j], 0.0));
    vec3 a = to_new_axes(k, vec4(gain[j], 0.0));
    if (j == 0) {  // the root goes with the head
        speed[0] = (rest.xyz - p) / u_seconds;
        gain[0] = (speed[0] - u) / u_seconds;
        // the inertia between it and the next node, a sixth of the segment's mass, is a third of its own
        held_back = rest.w / (3.0 * IMPLICIT) * (gain[0] - PASSED * a);
        place[0] = rest.xyz;
        force[0] = vec3(0.0);
        return;
    }
    p += u_seconds * (u + DRIFT * u_seconds * a);
    a *= PASSED;
    u += u_seconds * a;
    ivec2 at = u_even ? ivec2(0) : texel(rod, 2 * j, 2 * NODES);
    vec4 outer = texelFetch(u_acting, at, 0), more = texelFetch(u_acting, at + ivec2(0, 1), 0);
    vec3 drawn = rows(steps[k].air[0], steps[k].air[1], steps[k].air[2], vec4(outer.xyz, 0.0)) - u;
    vec3 gravity = vec3(steps[k].air[0].w, steps[k].air[1].w, steps[k].air[2].w);
    force[j] = rest.w * (gravity + rate.x * drawn + u_damping * (drift(k, p) - u)
                         + rate.y * (rest.xyz - p)) + vec3(outer.w, more.xy);
    if (j == 1) force[1] -= held_back;
    place[j] = p;
    speed[j] = u;
    gain[j] = a;
}

// Solve the tridiagonal system that `pivot`, `beside` (j - 1 and j) and `value` hold.
void solve_tridiagonal() {
    for (int j = 0; j < EACH_SEGMENT; j++)
        if (j > 0) {
            float factor = beside[j] / pivot[j - 1];
            pivot[j] -= factor * beside[j];
            value[j] -= factor * value[j - 1];
        }
    for (int j = EACH_SEGMENT - 1; j >= 0; j--) {
        if (j + 1 < SEGMENTS) value[j] -= beside[j + 1] * value[j + 1];
        value[j] /= pivot[j];
    }
}

// Rotate frames about their segments until torques balance: one Newton step.
void relax_twist() {
    vec4 before = root_frame;
    for (int j = 0; j < EACH_SEGMENT; j++) {
        vec4 after = frame[j];
        vec3 quarter, axis = third_axis(before);
        vec3 natural = rotate(half_way(before, after, quarter), curvature(j));
        vec3 turn = direction[j] - axis;
        vec4 firmness = stiffness(j);
        float bend = firmness.x, twist = firmness.y;
        vec3 spun = cross(natural, turn), aside = cross(quarter, spun);
        float torque = twist * (twist_between(before, after) - firmness.z);
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
    for (int j = 0; j < EACH_SEGMENT; j++) {
        // half angles by a rational cosine and sine, as in the reference
        float angle = 0.5 * clamp(value[j], -SPIN, SPIN);
        frame[j] = product(vec4(angle * direction[j], 1.0) / sqrt(1.0 + angle * angle), frame[j]);
    }
}

// Add the node forces of bending and twist: the negative gradient of the energy.
void add_elastic() {
    vec4 before = root_frame;
    vec3 reach_before = third_axis(before), pull = vec3(0.0);
    for (int j = 0; j < EACH_SEGMENT; j++) {
        vec4 after = frame[j];
        vec3 quarter, axis = third_axis(before);
        vec3 natural = rotate(half_way(before, after, quarter), curvature(j));
        vec4 firmness = stiffness(j);
        float bend = firmness.x, over = firmness.w;
        vec3 reach = edge[j] * over, turn = reach - reach_before;
        vec3 spun = cross(natural, turn), aside = cross(quarter, spun);
        float torque = firmness.y * (twist_between(before, after) - firmness.z);
        vec3 twisting = cross(axis, direction[j])
            * (torque / max(1.0 + dot(axis, direction[j]), SHARPEST));
        vec3 moment = bend * (natural - turn);
        if (j > 0) {
            pull += cross(0.5 * bend * (spun - aside), axis) - moment - twisting;
            vec3 done = pull * stiffness(j - 1).w;
            force[j - 1] -= done;
            force[j] += done;
        }
        pull = moment - twisting + cross(0.5 * bend * (spun + aside), direction[j]);
        before = after;
        reach_before = reach;
    }
    force[SEGMENTS - 1] -= pull * stiffness(SEGMENTS - 1).w;
    force[SEGMENTS] += pull * stiffness(SEGMENTS - 1).w;
}

// Write A^-1 force of the free nodes to `solved`.
void solve_banded() {
    vec3 one = vec3(0.0), two = vec3(0.0);
    for (int j = 0; j < EACH_NODE; j++) {
        solved[j] = vec3(0.0);
        if (j > 0) {
            vec4 factor = banded(j - 1);
            vec3 here = force[j] - factor.x * one - factor.y * two;
            two = one;
            one = here;
            solved[j] = here * factor.z;
        }
    }
    for (int j = EACH_NODE - 1; j >= 0; j--) {
        if (j > 0 && j + 1 < NODES) solved[j] -= banded(j).x * solved[j + 1];
        if (j > 0 && j + 2 < NODES) solved[j] -= banded(j + 1).y * solved[j + 2];
    }
}

#if NODES <= UNROLLED
#include "rods_lengths_unrolled.glsl"
#else
#include "rods_lengths.glsl"
#endif

// Solve for the forces, and for the tensions that keep the lengths; move the nodes.
void go_on() {
    solve_banded();
    solve_lengths();
    vec3 before = vec3(0.0);
    for (int j = 0; j < EACH_NODE; j++) {
        vec3 after = j < SEGMENTS ? value[j] * direction[j] : vec3(0.0);
        force[j] += after - before;
        before = after;
    }
    solve_banded();
    for (int j = 1; j < EACH_NODE; j++) {
        vec3 change = solved[j], added = change / (IMPLICIT * u_seconds);
        place[j] += change;
        speed[j] += added;
        gain[j] += added / u_seconds;
        gain[j] *= min(CHANGE / sqrt(dot(gain[j], gain[j]) + TINY), 1.0);
    }
}

#include "rods_contact.glsl"

// Give segments their exact lengths, from the root to the tip, and bound how fast they turn.
void keep_lengths() {
    for (int j = 0; j < EACH_SEGMENT; j++) {
        vec3 now = place[j + 1] - place[j];
        float size = banded(j).w;
        vec3 way = (size / sqrt(dot(now, now) + TINY) - 1.0) * now;
        place[j + 1] += way;
        vec3 apart = speed[j + 1] + way / u_seconds - speed[j];
        float share = TURN * size / (u_seconds * sqrt(dot(apart, apart) + TINY));
        speed[j + 1] = speed[j] + min(share, 1.0) * apart;
    }
}

void main() {
    rod = invocation();
    if (rod >= u_rods) return;
    for (int j = 0; j < EACH_NODE; j++) {
        vec4 at = state(rod, 4 * j);
        place[j] = at.xyz;
        slack[j] = at.w;
        speed[j] = state(rod, 4 * j + 1).xyz;
        gain[j] = state(rod, 4 * j + 2).xyz;
    }
    root_frame = frame_before(rod, 0);
    for (int j = 0; j < EACH_SEGMENT; j++) frame[j] = frame_before(rod, j + 1);
    for (int k = 0; k < u_substeps; k++) {
        for (int j = 0; j < EACH_NODE; j++) predict(k, j);
        for (int j = 0; j < EACH_SEGMENT; j++) {
            edge[j] = place[j + 1] - place[j];
            direction[j] = normalize(edge[j]);
            frame[j] = transport_frame(product(steps[k].head_turn.yzwx, frame[j]), direction[j]);
        }
        relax_twist();
        add_elastic();
        go_on();
        resolve_contacts(k);
        keep_lengths();
    }
    for (int j = 0; j < EACH_NODE; j++) {
        imageStore(u_new_state, texel(rod, 4 * j, STATE_ROWS), vec4(place[j], slack[j]));
        imageStore(u_new_state, texel(rod, 4 * j + 1, STATE_ROWS), vec4(speed[j], 0.0));
        imageStore(u_new_state, texel(rod, 4 * j + 2, STATE_ROWS), vec4(gain[j], 0.0));
        vec4 turn = j > 0 ? frame[max(j - 1, 0)].wxyz : root_frame.wxyz;
        imageStore(u_new_state, texel(rod, 4 * j + 3, STATE_ROWS), turn);
    }
}
