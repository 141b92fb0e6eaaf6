#version 430
// Forces on grabbed points in one substep (see plugins/pbd/grab.py), one grab per invocation; the first
// grab of a node adds all of them. Forces are divided by the rod's mean mass.
#include "pbd_layout.glsl"
#include "pbd_quaternion.glsl"
#include "pbd_constants.glsl"
#include "pbd_substep_schedule.glsl"
struct Grab { int rod, node; float target[3]; };         // world
struct Learnt { vec4 standing, hoped; };                 // force; place, and 1 where it is known
layout(std430, binding = 0) readonly buffer Grabs { Grab grabs[]; };
layout(std430, binding = 1) buffer Known { Learnt known[]; };
layout(std430, binding = 2) buffer Factors { float factors[]; };  // of each grab; compilers of graphics
                                                                  // cards refuse local arrays that long
layout(rgba32f, binding = 0) writeonly uniform image2D u_new_force;
uniform int u_grabs;
uniform int u_step;
uniform float u_seconds;   // of a substep
uniform float u_speed;     // m/s, of the fastest pull
uniform vec4 u_back[3];    // rows of the motion from the world to the head axes after the substep
uniform float u_softest, u_learnt, u_kept, u_most, u_strongest, u_taut, u_ahead;
const int MANY = 64;
const float LEAST_SIZE = 1e-30;

vec3 expected[MANY], carried_place;
float column[MANY];        // how the node's force moves each node, of A^-1

vec3 clamp_length(vec3 v, float most) { return v * min(1.0, most / max(length(v), LEAST_SIZE)); }
float segment_length(int rod, int i) { return constant(rod, ELEMENT_ROW + 3 * i).w; }

// Predicted nodes without a pull.
void expect(int rod, int node) {
    for (int j = 0; j < u_nodes; j++) {
        vec3 place = to_new_axes(u_step, vec4(node_place(rod, j).xyz, 1.0));
        if (j == node) carried_place = place;
        expected[j] = place + u_seconds * to_new_axes(u_step, vec4(node_speed(rod, j).xyz, 0.0));
    }
}

// Solve A column = 1 at the node; rows of the factor are those of the free nodes, from 1.
void respond(int rod, int node) {
    float one = 0.0, two = 0.0;
    for (int j = 1; j < u_nodes; j++) {
        vec4 factor = constant(rod, ELEMENT_ROW + 3 * (j - 1));
        float here = (j == node ? 1.0 : 0.0) - factor.x * one - factor.y * two;
        two = one;
        one = here;
        column[j] = here * factor.z;
    }
    column[0] = 0.0;
    for (int j = u_nodes - 2; j > 0; j--) {
        column[j] -= constant(rod, ELEMENT_ROW + 3 * j).x * column[j + 1];
        if (j + 2 < u_nodes) column[j] -= constant(rod, ELEMENT_ROW + 3 * (j + 1)).y * column[j + 2];
    }
}

// The part of a free node's compliance that the length constraints remove: C^T M^-1 C with M = L D L^T, row by row.
mat3 held_back(int rod, int own) {
    float scaled[MANY], pivot[MANY];
    vec3 solved[MANY];
    int start = own * ((u_nodes - 1) * (u_nodes - 2) / 2);
    mat3 sum = mat3(0.0);
    for (int i = 0; i < u_nodes - 1; i++) {
        vec3 way = normalize(expected[i + 1] - expected[i]);
        vec3 right = (column[i + 1] - column[i]) * way;
        int row = i * (i + 1) / 2;
        float last = 0.0;
        for (int j = 0; j <= i; j++) {
            float here = constant(rod, METRIC_ROW + (row + j) / 4)[(row + j) % 4]
                * dot(way, normalize(expected[j + 1] - expected[j]));
            for (int k = 0; k < j; k++) here -= scaled[k] * factors[start + j * (j - 1) / 2 + k];
            scaled[j] = here;
            last = here;
            if (j == i) break;
            float low = here * pivot[j];
            factors[start + i * (i - 1) / 2 + j] = low;
            right -= low * solved[j];
        }
        // all columns before are eliminated from scaled[j]
        pivot[i] = 1.0 / max(last, LEAST_SIZE);
        solved[i] = right;
        sum += pivot[i] * outerProduct(right, right);
    }
    return sum;
}

// The point nearest to the target that the strand's length allows.
vec3 reachable(vec3 target, int rod, int node) {
    float reach = 0.0;
    for (int i = 0; i < node; i++) reach += segment_length(rod, i);
    vec3 root = constant(rod, NODE_ROW).xyz;
    return root + clamp_length(target - root, u_taut * reach);
}

vec3 pull(int i, mat3 stiff, float free) {
    int node = grabs[i].node;
    vec4 target = vec4(grabs[i].target[0], grabs[i].target[1], grabs[i].target[2], 1.0);
    target.xyz = rows(u_back[0], u_back[1], u_back[2], target);
    vec3 away = reachable(target.xyz, grabs[i].rod, node) - carried_place;
    // at the target a substep later: a change of place goes on as one of velocity
    vec3 wanted = clamp_length(away, 2.0 * u_speed * u_seconds) - 2.0 * (expected[node] - carried_place);
    wanted /= u_ahead;
    Learnt before = known[i];
    vec3 missed = before.hoped.w * (before.hoped.xyz - carried_place);
    vec3 standing = u_kept * before.standing.xyz + u_learnt / free * clamp_length(missed, u_most);
    known[i].standing = vec4(standing, 0.0);
    known[i].hoped = vec4(expected[node] + wanted, 1.0);
    return clamp_length(stiff * wanted + standing, u_strongest * u_speed * u_seconds / free);
}

bool same_node(int i, int other) {
    return grabs[i].rod == grabs[other].rod && grabs[i].node == grabs[other].node;
}

void main() {
    int first = invocation();
    if (first >= u_grabs || first > 0 && same_node(first, first - 1)) return;
    int rod = grabs[first].rod, node = grabs[first].node;
    expect(rod, node);
    respond(rod, node);
    float free = column[node];
    mat3 stiff = inverse(mat3((1.0 + u_softest) * free) - held_back(rod, first));
    vec3 sum = vec3(0.0);
    for (int i = first; i < u_grabs && same_node(i, first); i++) sum += pull(i, stiff, free);
    imageStore(u_new_force, texel(rod, node, NODES), vec4(sum, 0.0));
}
