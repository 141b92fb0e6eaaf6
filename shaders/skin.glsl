// Skin in two layers (Weyrich et al. 2006): oil that reflects, and flesh below that scatters.
#include "light_volume.glsl"
#include "lighting.glsl"
#include "tone.glsl"
#include "skin_lobe.glsl"

uniform vec3 u_eye;
uniform vec3 u_forward;
uniform float u_perspective;
uniform float u_scatter;   // 1 skin, 0 cloth
uniform float u_wrapped;   // 1 where light is not diffused over the picture afterwards
uniform int u_lobe;
uniform float u_roughness; // square root of alpha, as in glTF
uniform float u_f0;        // reflectance at normal incidence

#constants hairkit.rendering.skin_lobe WRAP LIFT
const float SMOOTHEST = 0.1;

struct Layers {
    vec3 diffuse;    // light that leaves the flesh, for an albedo of 1
    vec3 specular;   // light that the oil reflects
};

void add_light(inout Layers sum, vec3 normal, vec3 to_eye, vec3 direction, vec3 light, float rough) {
    vec3 wrap = WRAP * u_scatter * u_wrapped;
    vec3 diffuse = max((dot(normal, direction) + wrap) / (1.0 + wrap), 0.0);
    float alpha = pow(max(rough, SMOOTHEST), 2.0);
    float nl = clamp(dot(normal, direction), 0.0, 1.0), nv = clamp(dot(normal, to_eye), 0.0, 1.0);
    sum.diffuse += light * diffuse * mix(1.0, below(u_f0, nl, nv) / pow(1.0 - u_f0, 2.0), u_scatter);
    sum.specular += light * u_scatter * LOBE_PI * oil(u_lobe, alpha, u_f0, normal, direction, to_eye);
}

vec3 eye_direction(vec3 position) {
    return u_perspective > 0.5 ? normalize(u_eye - position) : -u_forward;
}

Layers skin_layers(vec3 position, vec3 normal, float rough) {
    vec3 to_eye = eye_direction(position);
    vec3 reached = light_at(position + LIFT * normal);
    Layers sum = Layers(ambient(normal.y) * reached.b, vec3(0.0));
    add_light(sum, normal, to_eye, u_key_direction, u_key_colour * reached.r, rough);
    add_light(sum, normal, to_eye, u_rim_direction, u_rim_colour * reached.g, rough);
    return sum;
}
