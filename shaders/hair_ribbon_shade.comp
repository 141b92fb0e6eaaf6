#version 430
// Shapes ribbons and shades their points.
#include "ribbon_shape.glsl"
#include "lighting.glsl"
#include "marschner.glsl"
#include "tone.glsl"

uniform vec3 u_eye;             // camera centre, head frame
uniform vec3 u_root_colour;
uniform vec3 u_tip_colour;
uniform float u_show_direction; // 1: red runs left and right, green front and back, blue up and down

const float BOUNCED = 0.35;     // share of the sky's light that scatters through hair

vec3 seen_colour(StrandPoint point, vec3 tangent) {
    vec3 position = point.position.xyz;
    vec3 to_eye = u_perspective > 0.5 ? normalize(u_eye - position) : -u_forward;
    float random = point.look.y;
    float other = fract(random * 61.8034);
    vec3 colour = mix(u_root_colour, u_tip_colour, point.position.w);
    colour = pow(colour, vec3(0.85 + 0.3 * random)) * (0.8 + 0.4 * other);

    vec3 reached = light_at(position);
    if (u_show_direction > 0.5)
        return (0.2 + 0.8 * abs(tangent.xzy)) * (0.5 + 0.5 * reached.b) * (0.8 + 0.2 * other);
    vec3 key = fibre(tangent, u_key_direction, to_eye, colour, random) * u_key_colour * reached.r;
    vec3 rim = fibre(tangent, u_rim_direction, to_eye, colour, other) * u_rim_colour * reached.g;
    vec3 sky = colour * ambient(0.3) * mix(BOUNCED, 1.0, reached.b);
    return tone(key + rim + sky);
}

void main() {
    uint index = gl_GlobalInvocationID.x;
    if (index >= u_count) return;
    vec3 tangent;
    StrandPoint point = strand_points[index];
    RibbonPoint r = shaped(index, point, tangent);
    r.colour = packUnorm4x8(vec4(seen_colour(point, tangent), 1.0));
    ribbon_points[index] = r;
}
