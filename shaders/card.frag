#version 430
// The albedo, lit from the camera (Lambert) above ambient light, where its alpha reaches the cutoff.

uniform sampler2D u_cards;
uniform vec3 u_forward;
uniform float u_cutoff;
uniform float u_ambient;

in vec3 v_normal;
in vec2 v_uv;
out vec4 out_colour;

void main() {
    vec4 albedo = texture(u_cards, v_uv);
    if (albedo.a < u_cutoff) discard;
    float lit = u_ambient + (1.0 - u_ambient) * abs(dot(normalize(v_normal), u_forward));
    out_colour = vec4(albedo.rgb * lit, 1.0);
}
