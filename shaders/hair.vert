#version 430
#include "ribbon.glsl"
#include "lighting.glsl"
#include "marschner.glsl"
#include "tone.glsl"

uniform vec3 u_eye;             // camera centre, head frame
uniform vec3 u_forward;         // optical axis, head frame
uniform vec3 u_root_colour;
uniform vec3 u_tip_colour;
uniform float u_show_direction; // 1: red runs left and right, green front and back, blue up and down

out vec3 v_colour;

const float BOUNCED = 0.1;       // of the sky's light, that comes through hair on all ways

void main() {
    Ribbon r = ribbon_vertex();
    vec3 position = r.point.position.xyz;
    vec3 to_eye = u_perspective > 0.5 ? normalize(u_eye - position) : -u_forward;
    float random = r.point.look.y;
    float other = fract(random * 61.8034);
    vec3 colour = mix(u_root_colour, u_tip_colour, r.point.position.w);
    colour = pow(colour, vec3(0.85 + 0.3 * random)) * (0.8 + 0.4 * other);

    vec3 reached = light_at(position);
    vec3 key = fibre(r.tangent, u_key_direction, to_eye, colour, random) * u_key_colour * reached.r;
    vec3 rim = fibre(r.tangent, u_rim_direction, to_eye, colour, other) * u_rim_colour * reached.g;
    vec3 sky = colour * ambient(0.3) * mix(BOUNCED, 1.0, reached.b);
    vec3 shown = (0.2 + 0.8 * abs(r.tangent.xzy)) * (0.5 + 0.5 * reached.b) * (0.8 + 0.2 * other);
    v_colour = mix(tone(key + rim + sky), shown, u_show_direction);
    gl_Position = r.clip;
}
