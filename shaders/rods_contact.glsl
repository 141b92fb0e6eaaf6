// Contact: penetration, Coulomb friction, restoring the lengths. Part of rods_substeps.comp.
#include "rods_distance.glsl"
#constants hairkit.simulation.contact_kernels FURTHER STILL
#constants hairkit_plugins.rods.kernel_contact SOFTEST

vec3 normal[NODE_ROOM];           // contact normal, 0 for free nodes
vec3 surface[NODE_ROOM];          // velocity of the obstacle where it is touched, m/s
float grip[NODE_ROOM];            // largest change of velocity by friction, m/s

// Restore the lengths; a node in contact moves only perpendicular to its normal, and its pressure adds
// friction.
void restore_lengths() {
    vec3 end_before = vec3(0.0);
    for (int j = 0; j < EACH_SEGMENT; j++) {
        vec3 way = place[j + 1] - place[j];
        float reach = length(way);
        direction[j] = way / reach;
        float a = dot(normal[j], direction[j]), b = dot(normal[j + 1], direction[j]);
        float ease = rates(j).w, ease_after = rates(j + 1).w;
        vec3 start = ease * (direction[j] - a * normal[j]);
        vec3 end = ease_after * (direction[j] - b * normal[j + 1]);
        pivot[j] = ease * (SOFTEST - a * a) + ease_after * (SOFTEST - b * b);
        beside[j] = -dot(end_before, direction[j]);
        value[j] = reach - banded(j).w;
        end_before = end;
    }
    solve_tridiagonal();
    for (int j = 0; j < EACH_NODE; j++) {
        vec3 pull = vec3(0.0);
        if (j > 0) pull -= value[j - 1] * direction[j - 1];
        if (j < SEGMENTS) pull += value[j] * direction[j];
        float away = dot(pull, normal[j]);
        vec3 change = rates(j).w * (pull - away * normal[j]);
        place[j] += change;
        speed[j] += change / u_seconds;
        grip[j] -= u_friction * rates(j).w * away / u_seconds;
    }
}

// Coulomb: friction takes from the speed along the obstacle at most the grip.
void apply_friction() {
    for (int j = 1; j < EACH_NODE; j++) {
        vec3 relative = speed[j] - surface[j];
        vec3 slide = relative - dot(relative, normal[j]) * normal[j];
        float size = length(slide), slowed = clamp(grip[j], 0.0, size);
        vec3 brake = slide * (slowed / max(size, STILL));
        grip[j] -= slowed;
        speed[j] -= brake;
        place[j] -= 0.5 * u_seconds * brake;
    }
}

// Push a node out of the obstacles; return the contact normal, else 0. The grids are read only after the
// node may have moved by its distance at the last lookup.
vec3 contact_normal(int k, int j) {
    vec3 p = place[j], mean = speed[j] - 0.5 * u_seconds * gain[j], way = vec3(0.0);
    vec3 head = drift(k, p), torso = torso_drift(k, p);
    float clear = rates(j).z, left = slack[j];
    left -= FURTHER * u_seconds * max(distance(mean, head), distance(mean, torso));
    if (left <= 0.0) {
        bool on_torso;
        left = obstacle_distance(p, steps[k].torso, clear, way, on_torso) - clear;
        surface[j] = on_torso ? torso : head;
        float inward = max(-dot(speed[j] - surface[j], way), 0.0);
        // depth of this substep is removed at once, older depth at a limited speed
        float depth = min(-left, (inward + u_fastest) * u_seconds);
        if (left < 0.0) {
            grip[j] = u_friction * inward;
            speed[j] += inward * way;
            place[j] += depth * way;
        } else {
            way = vec3(0.0);
        }
    }
    slack[j] = left;
    return way;
}

void resolve_contacts(int k) {
    for (int j = 0; j < EACH_NODE; j++) {
        grip[j] = 0.0;
        surface[j] = vec3(0.0);
        normal[j] = j > 0 ? contact_normal(k, j) : vec3(0.0);
    }
    for (int round = 0; round <= u_rounds; round++) {
        apply_friction();
        restore_lengths();
    }
}
