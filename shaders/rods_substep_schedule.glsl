#constants hairkit_plugins.rods.gl_backend MOST_STEPS

// Head motion and gravity of one substep, head axes after it.
struct Step {
    vec4 head_step[3];     // rows of turn and shift from the axes before
    vec4 drift[3];    // rows of velocity of a point that rides on the head: matrix and minus shift
    vec4 air[3];      // rows of the turn from the world's axes, and gravity
    vec4 head_turn;   // as a quaternion (w, x, y, z)
    vec4 torso[3];    // rows from the head's axes to the torso's
    vec4 torso_drift[3];  // as `drift`, of a point that rides on the torso
};
layout(std140, binding = 0) uniform Steps { Step steps[MOST_STEPS]; };

vec3 rows(vec4 a, vec4 b, vec4 c, vec4 v) { return vec3(dot(a, v), dot(b, v), dot(c, v)); }
vec3 to_new_axes(int k, vec4 v) { return rows(steps[k].head_step[0], steps[k].head_step[1], steps[k].head_step[2], v); }
