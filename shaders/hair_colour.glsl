// Colour of a point of hair: light of two lamps and the sky, or its direction. Needs u_perspective,
// u_forward and `light_at`. The studio's page includes it too.
#include "lighting.glsl"
#include "marschner.glsl"
#include "tone.glsl"
#constants hairkit.rendering.fibre BOUNCED SKYWARD OTHER LEAST_POWER POWERS LEAST_BRIGHT BRIGHTS DIRECTION_BASE

uniform vec3 u_eye;             // camera centre, head frame
uniform float u_show_direction; // 1: red runs left and right, green front and back, blue up and down

// The square roots of a linear colour in three times ten bits, above them 1: a number as a float too.
vec3 unpacked(uint bits) {
    vec3 root = vec3((uvec3(bits) >> uvec3(0u, 10u, 20u)) & 1023u) / 1023.0;
    return root * root;
}

// `own` is the hair's colour there, `random` the strand's random number.
vec3 seen_colour(vec3 position, vec3 tangent, vec3 own, float random) {
    vec3 to_eye = u_perspective > 0.5 ? normalize(u_eye - position) : -u_forward;
    float other = fract(random * OTHER);
    vec3 colour = pow(own, vec3(LEAST_POWER + POWERS * random)) * (LEAST_BRIGHT + BRIGHTS * other);
    vec3 reached = light_at(position);
    if (u_show_direction > 0.5)
        return mix(abs(tangent.xzy), vec3(1.0), DIRECTION_BASE) * (0.5 + 0.5 * reached.b)
            * mix(1.0, other, DIRECTION_BASE);
    vec3 key = fibre(tangent, u_key_direction, to_eye, colour, random) * u_key_colour * reached.r;
    vec3 rim = fibre(tangent, u_rim_direction, to_eye, colour, other) * u_rim_colour * reached.g;
    vec3 sky = colour * ambient(SKYWARD) * mix(BOUNCED, 1.0, reached.b);
    return tone(key + rim + sky);
}
